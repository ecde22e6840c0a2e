//! What the event loop asks of a mechanical model. The loop itself, its horizons, sections, caps,
//! impacts, grazes, completed chatter and repeats, is the same for all (simulate.rs, flight.rs,
//! contact.rs).

#![allow(private_interfaces)] // nobody outside of the crate can name the trait

use std::fmt::Debug;

use serde::Serialize;
use serde::de::DeserializeOwned;

use super::{Anchor, Checkpoint, Observer, Phase, Simulation, Turn};
use crate::contact::chatter::{Bounce, Limit, Others, Scales};
use crate::flight::Drive;
use crate::impact::RegimeKind;
use crate::model::error::StateError;
use crate::model::state::{Clock, ModelState};
use crate::numerics::double_double::DoubleDouble;
use crate::numerics::lanes::LANES;
use crate::search::Start;
use crate::search::first_contact::{ContactReport, Touch};
use crate::simulate::event::{StopEvent, StopReason};

/// The start of a leg of this model.
pub type AnchorOf<M> = Anchor<<M as Model>::State, <M as Model>::Mode, <M as Model>::Touching>;
/// All that a simulation of this model needs to go on.
pub type CheckpointOf<M> = Checkpoint<
    <M as Model>::State,
    <M as Model>::Mode,
    <M as Model>::Touching,
    <M as Model>::Others,
>;

/// A leg between two events: it starts at some instant and is evaluated at local times.
pub trait Leg<S>: Clone + Debug + Send + Sync {
    /// Its start.
    fn clock(&self) -> Clock;
    /// Moves it on by whole drive periods.
    fn later_by(&mut self, periods: i64);
    /// The state at its start.
    fn state(&self) -> &S;
}

/// What an event says to the loop.
pub trait ModelEvent<S>: Debug {
    /// When.
    fn clock(&self) -> Clock;
    /// The end of a run.
    fn stop(stop: StopEvent<S>) -> Self;
    /// That end, if this is one.
    fn as_stop(&self) -> Option<&StopEvent<S>>;
    /// Whether it is an impact,
    fn is_impact(&self) -> bool;
    /// or a graze.
    fn is_graze(&self) -> bool;

    /// Whether it may happen among the bounces of a chatter.
    fn is_hop(&self) -> bool {
        self.is_impact() || self.is_graze()
    }
}

/// An impact, and the leg that it begins.
pub struct Struck<M: Model> {
    /// State just before.
    pub pre: M::State,
    /// What it does.
    pub impact: M::Impact,
    /// The flight after it.
    pub flight: M::Flight,
    /// Whether that is a free one, or one in contact.
    pub phase: Phase<M::Mode>,
    /// The contacts on which it begins.
    pub touching: M::Touching,
}

/// Why no leg follows an impact.
pub enum NotStruck<M: Model> {
    /// The law gives no outcome, or a rule of the model ends the run.
    Stops(StopReason, M::State),
    /// A number is not finite.
    NotFinite,
}

/// What follows a landing, or the end of a leg in contact.
pub enum Follows<M: Model> {
    /// A leg.
    Leg(AnchorOf<M>),
    /// The end of the run.
    Stops(StopReason),
}

/// An impact, as the completion of chatter sees it.
#[derive(Debug, Clone, Copy)]
pub struct ChatterView {
    /// How friction acted.
    pub regime: RegimeKind,
    /// u before it.
    pub approach: f64,
    /// -u after it.
    pub separation: f64,
    /// Coefficient of restitution of this and of all lower impacts; NaN where theirs is another.
    pub restitution: f64,
    /// Which contact, of those of the model.
    pub contact: u32,
}

/// The impacts that a completed chatter left out.
#[derive(Debug, Clone, Copy)]
pub struct Skipped {
    /// How many come before the time left is lost in rounding.
    pub impacts: f64,
    /// Time from the last impact to the accumulation point.
    pub time_jump: f64,
    /// Bound of the error of time and state, in their scales.
    pub error: f64,
}

/// A mechanical model with one-sided contacts.
pub trait Model: Clone + PartialEq + Debug + Send + Sync {
    /// Coordinates and velocities.
    type State: ModelState + Serialize + DeserializeOwned;
    /// What an impact does.
    type Impact: Copy + PartialEq + Debug + Send + Sync + Serialize + DeserializeOwned;
    /// An event of a run.
    type Event: ModelEvent<Self::State>;
    /// What its flights have in common.
    type Motion: Clone + Debug + Send + Sync;
    /// A leg between two events.
    type Flight: Leg<Self::State>;
    /// What a search met.
    type Touched: Copy + Debug + Send + Sync;
    /// How the bodies move while contact lasts.
    type Mode: Copy + PartialEq + Debug + Send + Sync + Serialize + DeserializeOwned;
    /// Whether a landing after an impact that stopped slip is one without slip; of the pendulum the
    /// velocity itself says so.
    const STOPS_SLIP: bool;
    /// Which contacts a leg begins on, where there are several.
    type Touching: Clone + PartialEq + Default + Debug + Send + Sync + Serialize + DeserializeOwned;
    /// What a chatter sequence carries to its limit beside time and slip.
    type Others: Others + Serialize + DeserializeOwned + Send + Sync;
    /// All numbers of a leg's start but its clock, bit by bit.
    type Bits: Clone + PartialEq + Debug + Send + Sync;

    /// The motion between contacts.
    fn motion(&self) -> Self::Motion;
    /// Its drive.
    fn drive(motion: &Self::Motion) -> &Drive;
    /// Length of a local flight.
    fn span(motion: &Self::Motion) -> f64;

    /// The leg from which a start goes on.
    ///
    /// # Errors
    /// [`StateError`] if bodies overlap, or a number is not finite.
    fn begin(&self, initial: Self::State) -> Result<AnchorOf<Self>, StateError>;
    /// The local flight of a leg from this instant on.
    fn flight(
        &self,
        motion: &Self::Motion,
        leg: &AnchorOf<Self>,
        clock: Clock,
        state: Self::State,
    ) -> Self::Flight;
    /// State after any local time,
    fn state_after(motion: &Self::Motion, flight: &Self::Flight, time: DoubleDouble)
    -> Self::State;
    /// within the local flight,
    fn state_at(motion: &Self::Motion, flight: &Self::Flight, s: f64) -> Self::State;
    /// after one that is rarely far,
    fn state_within(
        motion: &Self::Motion,
        flight: &Self::Flight,
        time: DoubleDouble,
    ) -> Self::State;
    /// and after several such times.
    fn states_within(
        motion: &Self::Motion,
        flight: &Self::Flight,
        times: &[DoubleDouble],
    ) -> [Self::State; LANES];

    /// First contact of a local flight; `grazed`: the contact of the graze it goes on from.
    fn search(
        &self,
        motion: &Self::Motion,
        leg: &AnchorOf<Self>,
        flight: &Self::Flight,
        start: Start,
        grazed: u32,
    ) -> ContactReport<Self::Touched>;
    /// The state that a search met.
    fn touched(
        motion: &Self::Motion,
        flight: &Self::Flight,
        touch: &Touch<Self::Touched>,
    ) -> Self::State;
    /// The number of the contact that a search met.
    fn contact_of(touched: &Self::Touched) -> u32;
    /// Whether a number out of range is the law's doing.
    fn diverges_by_law(&self) -> bool;

    /// What follows where a search meets something: an impact, or a change of contact.
    fn meet<O: Observer<Self::State>>(
        simulation: &mut Simulation<Self>,
        touch: &Touch<Self::Touched>,
        observer: &mut O,
    ) -> Turn<Self>;
    /// The impact of a start on the contact that approaches.
    fn strike_at_start<O: Observer<Self::State>>(
        simulation: &mut Simulation<Self>,
        observer: &mut O,
    ) -> Turn<Self>;
    /// An impact as an event: clock, time and phase, and the states before and after it.
    fn impact_event(
        place: (Clock, f64, f64),
        pre: Self::State,
        post: Self::State,
        impact: Self::Impact,
    ) -> Self::Event;

    /// A graze as an event.
    fn graze_event(
        place: (Clock, f64, f64),
        state: Self::State,
        touch: &Touch<Self::Touched>,
    ) -> Self::Event;
    /// Whether a graze has a finite effect.
    fn grazes_undecidably(&self, state: &Self::State, touched: &Self::Touched) -> bool;

    /// The leg of bodies that touch at a contact with g' = 0, after another leg; `stopped`: without
    /// slip.
    fn landing(
        &self,
        before: &AnchorOf<Self>,
        clock: Clock,
        state: Self::State,
        contact: u32,
        stopped: bool,
    ) -> AnchorOf<Self>;
    /// The state with g = g' = 0 there; `stopped`: and without slip.
    fn landed(
        &self,
        motion: &Self::Motion,
        clock: Clock,
        state: Self::State,
        contact: u32,
        stopped: bool,
    ) -> Self::State;
    /// What follows a landing.
    fn follows(&self, motion: &Self::Motion, here: &AnchorOf<Self>) -> Follows<Self>;
    /// A change of contact as an event; `held`: from contact, so that its end is one.
    fn contact_event(
        &self,
        motion: &Self::Motion,
        place: (Clock, f64, f64),
        before: &AnchorOf<Self>,
        after: &AnchorOf<Self>,
        held: bool,
    ) -> Option<Self::Event>;
    /// A part of a leg while contact lasts.
    fn hold<O: Observer<Self::State>>(
        simulation: &mut Simulation<Self>,
        mode: Self::Mode,
        observer: &mut O,
    ) -> Turn<Self>;

    /// Whether nothing will ever end or move a leg. A model that tells it in `hold` need not here.
    fn rests(_motion: &Self::Motion, _flight: &Self::Flight) -> bool {
        false
    }

    /// An impact, as the completion of chatter sees it,
    fn chatter_view(&self, impact: &Self::Impact) -> ChatterView;
    /// and what it leaves behind.
    fn bounce(&self, view: &ChatterView, clock: Clock, post: &Self::State) -> Bounce<Self::Others>;
    /// Whether slip ends on the side of the contact on which the bounces are.
    fn keeps_side(&self, bounce: &Bounce<Self::Others>, limit: &Limit<Self::Others>) -> bool;
    /// g'' and g''' of a contact at the start of a flight.
    fn gap_jet(&self, motion: &Self::Motion, flight: &Self::Flight, contact: u32) -> [f64; 2];
    /// State at an accumulation point, and what the error of the limit is divided by there.
    fn limit_state(
        &self,
        motion: &Self::Motion,
        flight: &Self::Flight,
        limit: &Limit<Self::Others>,
        contact: u32,
    ) -> (Self::State, f64);
    /// What errors of an accumulation point are measured in, after the flight that begins here.
    fn scales(&self, _motion: &Self::Motion, _flight: &Self::Flight, _contact: u32) -> Scales {
        Scales::NONE
    }
    /// Whether no other contact can be met in so much time after the start of a flight of this leg.
    fn is_alone(
        &self,
        _motion: &Self::Motion,
        _leg: &AnchorOf<Self>,
        _flight: &Self::Flight,
        _contact: u32,
        _time: f64,
    ) -> bool {
        true
    }
    /// Largest number of a state, in its scale, and the speed of which u is a difference.
    fn sizes(&self, state: &Self::State, contact: u32, scales: &Scales) -> (f64, f64);
    /// Largest coordinate, at least 1 where lengths have a unit.
    fn extent(&self, state: &Self::State) -> f64;
    /// Whether contact lasts at an accumulation point.
    fn holds(&self, motion: &Self::Motion, leg: &AnchorOf<Self>) -> bool;
    /// An accumulation point as an event.
    fn chatter_event(
        &self,
        motion: &Self::Motion,
        place: (Clock, f64, f64),
        leg: &AnchorOf<Self>,
        contact: u32,
        skipped: Skipped,
    ) -> Self::Event;
    /// Slip and others after bounces of a leg too low to tell, met at this clock, in this state and at
    /// this contact: to leading order from u, the ratio by which it shrinks, and the time they last;
    /// `stopped`: without slip.
    fn after_bounces(
        &self,
        motion: &Self::Motion,
        leg: &AnchorOf<Self>,
        met: (Clock, &Self::State, u32),
        bounces: (f64, f64, f64),
        stopped: bool,
    ) -> (f64, Self::Others);
    /// -u at the start of a leg.
    fn separation(&self, motion: &Self::Motion, leg: &AnchorOf<Self>, contact: u32) -> f64;

    /// The bits of a leg's start.
    fn bits(leg: &AnchorOf<Self>) -> Self::Bits;
}

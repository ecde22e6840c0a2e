//! The hybrid automaton as an iterator of events (docs/theory.md, sections 3 to 5):
//! flight -> impact -> flight | contact (slide, stick) -> flight, with grazes, complete chatter,
//! caps and typed stop reasons.
//!
//! Nothing before the end depends on where the run is asked to end, so a run that is resumed gives
//! the same bits as one long run.

mod batch;
mod checkpoint;
mod contact;
pub(crate) mod event;
mod flight;
pub(crate) mod model;
mod oblique;
mod recurrence;
pub(crate) mod run;
mod sections;
mod stop;
pub(crate) mod structure;
pub(crate) mod tolerances;

pub(crate) use batch::{Companion, ImpactLanes, Job, Laned, run_batch};
pub(crate) use checkpoint::{Anchor, Checkpoint, Completion, FlightStart, Phase};
pub(crate) use flight::{hops, impacts_hop_by_hop};
pub(crate) use model::{AnchorOf, CheckpointOf, Leg, Model, ModelEvent};
pub(crate) use recurrence::Cycle;

use serde::{Deserialize, Serialize};

use self::recurrence::Recurrence;
use crate::flight::Drive;
use crate::model::error::{SimulationError, StateError};
use crate::model::parameters::System;
use crate::model::state::{Clock, ModelState, State};
use crate::numerics::cancel::CancelToken;
use crate::numerics::double_double::DoubleDouble;
use crate::search::first_contact::Found;
use crate::simulate::event::{StopEvent, StopReason};
use crate::simulate::tolerances::{
    DEFAULT_MAX_EVENTS, DEFAULT_MAX_TIME, DEFAULT_TOLERANCE, MOST_COUNTED,
};

/// How far a simulation goes.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub enum Horizon {
    /// So many drive periods from t = 0.
    Periods(i64),
    /// Up to this time from t = 0.
    Time(f64),
    /// Until so many impacts have happened, or the time cap.
    Impacts {
        /// Number of impacts from t = 0.
        count: u64,
        /// Time cap.
        max_time: f64,
    },
}

/// Where section points go. What the implementing type does not want is not computed.
pub trait Observer<S = State> {
    /// Whether stroboscopic section points are wanted.
    const SECTIONS: bool;
    /// The state at the k-th stroboscopic section (k >= 1), after an impact at that instant.
    fn section(&mut self, k: i64, state: &S);
    /// The first section that is wanted; states of those before it are not computed.
    fn first_section(&self) -> i64 {
        i64::MIN
    }
    /// Whether an impact at this instant, which leaves `state`, is passed over:
    /// [`Simulation::advance`] then goes on to the next event, and its record is not made.
    fn skips(&mut self, _clock: Clock, _state: &S) -> bool {
        false
    }
}

impl<S> Observer<S> for () {
    const SECTIONS: bool = false;
    fn section(&mut self, _: i64, _: &S) {}
}

/// A running simulation: an iterator over its events, the last of which is
/// [`Event::Stop`](crate::Event::Stop).
///
/// ```
/// use vibroimpact::{Event, Simulation, State, System};
///
/// let system = System::builder()
///     .mass_ratio(0.6).frequency_ratio(2.0).restitution(0.8).gap(0.5)
///     .drive_frequency(1.8).moment_amplitude(1.0)
///     .build()?;
/// let start = State::new(0.0, 0.5, 0.0, 0.0)?;
/// let mut impacts = 0;
/// for event in Simulation::new(&system, start)?.periods(600) {
///     if let Event::Impact(_) = event? {
///         impacts += 1;
///     }
/// }
/// assert_eq!(impacts, 600);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone)]
pub struct Simulation<M: Model = System> {
    system: M,
    motion: M::Motion,
    horizon: Horizon,
    /// Clock of the horizon.
    end: Clock,
    max_events: u64,
    /// Asked before every local flight.
    cancel: CancelToken,
    chatter_tolerance: f64,
    /// Whether chatter is completed; not while single hops of it are asked for.
    completes: bool,
    /// Section time in the period.
    section_offset: f64,
    point: CheckpointOf<M>,
    /// The present local flight.
    flight: M::Flight,
    /// What the search found in the present local flight, once it has run.
    found: Option<Found<M::Touched>>,
    evaluations: u64,
    /// Events that were passed over, because they repeat those before them.
    repeated: u64,
    /// Looks for a motion that repeats, in runs.
    recurrence: Option<Recurrence<M::Bits>>,
}

/// How one turn of the automaton ends: with an event, or without one.
pub(crate) type Turn<M = System> = Option<Result<<M as Model>::Event, SimulationError>>;

impl<M: Model> Simulation<M> {
    /// A simulation from `initial` at t = 0, forcing cos(omega t + phi). A start on the contact
    /// (g = 0 to rounding) begins with an impact, a contact phase or a flight, as its velocities
    /// and forces say. Without a horizon it runs up to the caps on events and time.
    ///
    /// # Errors
    /// [`StateError`] if the bodies overlap in `initial`, or it is not finite.
    pub fn new(system: &M, initial: M::State) -> Result<Self, StateError> {
        Ok(Self::from_checkpoint(system, Checkpoint::at(system.begin(initial)?)))
    }

    pub(crate) fn from_checkpoint(system: &M, point: CheckpointOf<M>) -> Self {
        let motion = system.motion();
        let Anchor { clock, ref state, .. } = point.anchor;
        let flight = system.flight(&motion, &point.anchor, clock, state.clone());
        let mut simulation = Self {
            system: system.clone(),
            end: M::drive(&motion).clock_at(DEFAULT_MAX_TIME),
            motion,
            horizon: Horizon::Impacts { count: u64::MAX, max_time: DEFAULT_MAX_TIME },
            max_events: DEFAULT_MAX_EVENTS,
            cancel: CancelToken::never(),
            chatter_tolerance: DEFAULT_TOLERANCE,
            completes: true,
            section_offset: 0.0,
            point,
            flight,
            found: None,
            evaluations: 0,
            repeated: 0,
            recurrence: None,
        };
        simulation.enter_flight();
        simulation
    }

    /// Ends after so many drive periods; a drive that stands still has none: the time cap ends the run.
    #[must_use]
    pub fn periods(self, periods: u32) -> Self {
        self.until(Horizon::Periods(i64::from(periods)))
    }

    /// Ends at this horizon; its time must be finite, or the default cap on time takes its place.
    /// One before t = 0 is t = 0, one after 2^53 drive periods is that.
    #[must_use]
    pub fn until(mut self, horizon: Horizon) -> Self {
        (self.horizon, self.end) = self.horizon_at(horizon);
        self
    }

    /// A horizon within what can be counted, and its clock.
    fn horizon_at(&self, horizon: Horizon) -> (Horizon, Clock) {
        let drive = self.drive();
        let most = if drive.has_period() { MOST_COUNTED * drive.period.hi } else { f64::INFINITY };
        let capped =
            |time: f64| if time.is_finite() { time.clamp(0.0, most) } else { DEFAULT_MAX_TIME };
        let horizon = match horizon {
            Horizon::Periods(periods) => Horizon::Periods(periods.clamp(0, MOST_COUNTED as i64)),
            Horizon::Time(time) => Horizon::Time(capped(time)),
            Horizon::Impacts { count, max_time } => {
                Horizon::Impacts { count, max_time: capped(max_time) }
            }
        };
        let end = match horizon {
            Horizon::Periods(periods) if drive.has_period() => Clock::new(periods, 0.0),
            Horizon::Periods(_) => drive.clock_at(DEFAULT_MAX_TIME),
            Horizon::Time(time) | Horizon::Impacts { max_time: time, .. } => drive.clock_at(time),
        };
        (horizon, end)
    }

    /// Goes on to a further horizon, also after a stop at the last one.
    pub(crate) fn extend_to(&mut self, horizon: Horizon) {
        self.point.stopped = None;
        (self.horizon, self.end) = self.horizon_at(horizon);
    }

    /// The run ends with [`StopReason::Interrupted`] once this is cancelled.
    #[must_use]
    pub fn cancel_with(mut self, cancel: &CancelToken) -> Self {
        self.cancel = cancel.clone();
        self
    }

    /// Goes on where it was interrupted, until this is cancelled.
    pub(crate) fn proceed_with(&mut self, cancel: &CancelToken) {
        self.cancel = cancel.clone();
        if self.point.stopped == Some(StopReason::Interrupted) {
            self.point.stopped = None;
        }
    }

    /// Whether the caller has cancelled it.
    pub(crate) fn is_cancelled(&self) -> bool {
        self.cancel.is_cancelled()
    }

    /// Cap on the number of events; the run then stops with [`StopReason::EventCap`].
    #[must_use]
    pub fn max_events(mut self, events: u64) -> Self {
        self.max_events = events;
        self
    }

    /// Tolerance in time and state where something is approximated (the completion of chatter):
    /// absolute for a [`System`](crate::System), of a structure a part of the scales of its motion.
    #[must_use]
    pub fn chatter_tolerance(mut self, chatter_tolerance: f64) -> Self {
        self.chatter_tolerance = chatter_tolerance;
        self
    }

    /// Moves the stroboscopic section to omega t = `phase` (mod 2 pi), `phase` in [0, 2 pi).
    #[must_use]
    pub fn section_phase(mut self, phase: f64) -> Self {
        self.section_offset = if phase > 0.0 { phase / self.drive().omega } else { 0.0 };
        self
    }

    /// Evaluations of the gap function so far.
    #[must_use]
    pub fn evaluations(&self) -> u64 {
        self.evaluations
    }

    /// Events that were not worked out, because they repeat those before them.
    pub(crate) fn repeated(&self) -> u64 {
        self.repeated
    }

    /// Impacts since t = 0.
    #[must_use]
    pub fn impact_count(&self) -> u64 {
        self.point.impacts
    }

    /// Contact mode at present; `None` in flight.
    #[must_use]
    pub fn mode(&self) -> Option<M::Mode> {
        match self.point.anchor.phase {
            Phase::Contact(mode) => Some(mode),
            _ => None,
        }
    }

    /// Clock at the start of the present leg.
    pub(crate) fn clock(&self) -> Clock {
        self.point.anchor.clock
    }

    pub(crate) fn drive(&self) -> &Drive {
        M::drive(&self.motion)
    }

    pub(crate) fn checkpoint(&self) -> &CheckpointOf<M> {
        &self.point
    }

    /// The present local flight.
    pub(crate) fn present_flight(&self) -> &M::Flight {
        &self.flight
    }

    /// Whether this event, the last one so far, lies among skipped impacts.
    pub(crate) fn skips_at(&self, event: &M::Event) -> bool {
        event.as_stop().is_some() && self.point.skips()
    }

    /// Clock of the horizon. Every run has one: a motion without contact must end too.
    pub(crate) fn horizon_clock(&self) -> Clock {
        self.end
    }

    /// The stop of a simulation that had stopped before.
    pub(crate) fn standstill(&self) -> StopEvent<M::State> {
        let (mut clock, mut state) = (self.flight.clock(), self.flight.state().clone());
        // Not before the graze that the flight goes on from.
        if let Some(s) = self.point.grazed {
            let grazing = M::state_at(&self.motion, &self.flight, s);
            if grazing.is_finite() {
                (clock, state) = (self.clock_after(s, self.point.grazed_rest), grazing);
            }
        }
        let reason = self.point.stopped.unwrap_or(StopReason::Failed);
        StopEvent { clock, time: self.drive().time(clock), state, reason }
    }

    /// Skips the sections before the `first`-th.
    pub(crate) fn sections_from(&mut self, first: i64) {
        self.point.next_section = self.point.next_section.max(first);
    }

    /// Goes on to the next event; `None` after the stop.
    ///
    /// # Errors
    /// [`SimulationError`] with time, number of impacts and state.
    pub fn advance<O: Observer<M::State>>(
        &mut self,
        observer: &mut O,
    ) -> Option<Result<M::Event, SimulationError>> {
        if self.point.stopped.is_some() {
            return None;
        }
        loop {
            let turn = self.step(observer);
            if turn.is_some() {
                return turn;
            }
        }
    }

    /// A single turn of the automaton, with an event or without one. Only before the stop.
    #[inline(always)]
    #[allow(clippy::inline_always)] // as one with the loop of `advance`
    pub(crate) fn step<O: Observer<M::State>>(&mut self, observer: &mut O) -> Turn<M> {
        let turn = match self.stops_before_leg() {
            Some(reason) => Some(Ok(self.stop_here(reason))),
            None => self.turn(observer),
        };
        if turn.is_some() { self.checked(turn) } else { None }
    }

    /// One leg.
    fn turn<O: Observer<M::State>>(&mut self, observer: &mut O) -> Turn<M> {
        match self.point.anchor.phase {
            Phase::Flight(_) | Phase::Contact(_) | Phase::Landing
                if self.point.completion.is_some() =>
            {
                self.complete(observer)
            }
            Phase::Flight(began) => self.fly(began, observer),
            Phase::Contact(mode) => M::hold(self, mode, observer),
            Phase::Landing => self.land(observer),
            Phase::Strike => M::strike_at_start(self, observer),
        }
    }

    /// Local time from the start of the present leg at which the horizon lies.
    #[inline(always)]
    #[allow(clippy::inline_always)]
    fn horizon_in_leg(&self) -> DoubleDouble {
        self.drive().until(self.flight.clock(), self.end)
    }

    /// Whether the next local time `reached` of the present leg certainly lies before `target`:
    /// told by whole periods, without a difference of clocks.
    #[inline(always)]
    #[allow(clippy::inline_always)]
    fn is_far(&self, target: Clock, reached: f64) -> bool {
        let between = target.period - self.flight.clock().period - 1;
        between > 0 && reached < (between as f64 - 0.5) * self.drive().period.hi
    }

    /// Clock at a local time of the present leg, given in two parts.
    #[inline(always)]
    #[allow(clippy::inline_always)]
    fn clock_at(&self, time: f64, offset: f64) -> Clock {
        self.drive().advance(self.flight.clock(), DoubleDouble::sum(time, offset))
    }

    /// Clock as [`Simulation::clock_at`], but never before the leg starts: two clocks may have the
    /// value of an impact's.
    fn clock_after(&self, time: f64, offset: f64) -> Clock {
        let (start, clock) = (self.flight.clock(), self.clock_at(time, offset));
        if clock < start { start } else { clock }
    }

    /// Clock, time and phase at a local time of the present leg, given in two parts.
    #[inline(always)]
    #[allow(clippy::inline_always)]
    fn place(&self, time: f64, offset: f64) -> (Clock, f64, f64) {
        let drive = self.drive();
        let clock = self.clock_after(time, offset);
        (clock, drive.time(clock), drive.phase_at(clock))
    }

    /// Starts a new leg.
    fn anchor(&mut self, clock: Clock, state: M::State, phase: Phase<M::Mode>) {
        self.begin_leg(Anchor { clock, state, phase, touching: M::Touching::default() });
    }

    fn begin_leg(&mut self, leg: AnchorOf<M>) {
        self.point.anchor = leg;
        self.point.elapsed = DoubleDouble::ZERO;
        self.point.grazed = None;
        self.enter_flight();
    }
}

impl<M: Model> Iterator for Simulation<M> {
    type Item = Result<M::Event, SimulationError>;

    fn next(&mut self) -> Option<Self::Item> {
        self.advance(&mut ())
    }
}

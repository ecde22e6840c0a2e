//! All that a simulation has to know to go on later with the same bits.

use serde::{Deserialize, Serialize};

use super::event::StopReason;
use crate::contact::chatter::ChatterMonitor;
use crate::contact::sustained::ContactMode;
use crate::model::state::{Clock, State};
use crate::numerics::double_double::DoubleDouble;

/// What the automaton is doing.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub enum Phase<K = ContactMode> {
    /// Free flight.
    Flight(FlightStart),
    /// On the contact and approaching: an impact at once (a start only).
    Strike,
    /// On the contact with g' = 0: contact or flight follows, as the forces say.
    Landing,
    /// Sustained contact.
    Contact(K),
}

/// How a flight began.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub enum FlightStart {
    /// Apart.
    Apart,
    /// On the contact, g' < 0 or g' = 0 and g'' < 0.
    Touching,
    /// On the contact with g' = g'' = 0.
    Released,
}

/// Start of a leg (a flight, or a step of a contact phase), from which everything up to the next
/// event follows.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Anchor<S = State, K = ContactMode, C = ()> {
    pub clock: Clock,
    pub state: S,
    pub phase: Phase<K>,
    /// Which contacts it begins on, where there are several.
    #[serde(default, skip_serializing_if = "is_nothing")]
    #[serde(bound(
        deserialize = "C: Default + Deserialize<'de>",
        serialize = "C: Default + PartialEq + Serialize"
    ))]
    pub touching: C,
}

fn is_nothing<C: Default + PartialEq>(touching: &C) -> bool {
    *touching == C::default()
}

/// Where the chatter that follows an impact ends.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Completion<S = State> {
    pub clock: Clock,
    pub state: S,
    pub impacts_skipped: f64,
    pub time_jump: f64,
    pub error: f64,
}

/// All that is needed to go on later with the same bits.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Checkpoint<S = State, K = ContactMode, C = (), V = [f64; 2]> {
    #[serde(bound(
        deserialize = "S: Deserialize<'de>, K: Deserialize<'de>, C: Default + Deserialize<'de>",
        serialize = "S: Serialize, K: Serialize, C: Default + PartialEq + Serialize"
    ))]
    pub anchor: Anchor<S, K, C>,
    /// Time from the anchor to the start of the present local flight.
    pub elapsed: DoubleDouble,
    /// Local time of a graze in the present local flight.
    pub grazed: Option<f64>,
    /// What rounding it to one number left out.
    #[serde(default)]
    pub grazed_rest: f64,
    /// The impacts after the anchor are skipped.
    pub completion: Option<Completion<S>>,
    /// The contact of the graze, or of the impacts that are skipped, where there are several.
    #[serde(default, skip_serializing_if = "is_nothing")]
    pub contact: u32,
    /// Changes of the contact mode without progress in time.
    pub standstill: u32,
    /// How often time was moved on because of them.
    pub moves: u32,
    pub monitor: ChatterMonitor<V>,
    /// Next stroboscopic section.
    pub next_section: i64,
    pub impacts: u64,
    pub events: u64,
    pub stopped: Option<StopReason>,
}

impl<S, K, C: Default> Anchor<S, K, C> {
    /// A flight of bodies that are apart.
    pub fn apart(clock: Clock, state: S) -> Self {
        let phase = Phase::Flight(FlightStart::Apart);
        Self { clock, state, phase, touching: C::default() }
    }
}

impl Anchor {
    /// The flight after an impact.
    #[inline]
    pub fn after_impact(clock: Clock, state: State) -> Self {
        Self { clock, state, phase: Phase::Flight(FlightStart::Touching), touching: () }
    }
}

impl<S, K, C, V> Checkpoint<S, K, C, V> {
    /// Whether the impacts that follow are skipped.
    pub fn skips(&self) -> bool {
        self.completion.is_some()
    }

    /// The same instant and counts, but another leg.
    pub fn restarted(&self, anchor: Anchor<S, K, C>) -> Self {
        let Self { next_section, impacts, events, stopped, .. } = *self;
        Self { next_section, impacts, events, stopped, ..Self::at(anchor) }
    }

    pub fn at(anchor: Anchor<S, K, C>) -> Self {
        Self {
            anchor,
            elapsed: DoubleDouble::ZERO,
            grazed: None,
            grazed_rest: 0.0,
            completion: None,
            contact: 0,
            standstill: 0,
            moves: 0,
            monitor: ChatterMonitor::default(),
            next_section: 1,
            impacts: 0,
            events: 0,
            stopped: None,
        }
    }
}

//! The sequence of legs of a periodic motion: what the bodies do from one event to the next, and
//! which event ends it. Where the sequence is kept fixed, event times and states are smooth
//! functions of the parameters: a motion can be followed beyond the point at which it ceases to be
//! one (a flight that penetrates, a slip that would have reversed), and that point is a root of a
//! smooth function (docs/orbits.md).

mod leg;

pub use leg::{Leg, Sign, Signs, StickEnd};

use crate::contact::sustained::ContactMode;
use crate::flight::Drive;
use crate::model::error::{ParameterError, SimulationError, StateError};
use crate::model::parameters::System;
use crate::model::state::{Clock, State};
use crate::numerics::cancel::CancelToken;
use crate::simulate::Simulation;
use crate::simulate::event::{Event, StopReason};
use crate::tangent::tolerances::{CLEAR_ENDS, LOW_BOUNCE, MOST_LEGS, STILL_WALL};

/// Where a leg starts: just after an event, on the contact. Body 2 is where g = 0 has it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Node {
    /// x1; of a circuit, at the start of a drive period.
    pub x1: f64,
    /// x1' after the event.
    pub v1: f64,
    /// x2' after the event.
    pub v2: f64,
    /// Time in the drive period; of a circuit, which starts with one, x2.
    pub time: f64,
}

impl Node {
    /// The components, in order.
    #[must_use]
    pub fn to_array(self) -> [f64; 4] {
        [self.x1, self.v1, self.v2, self.time]
    }

    /// A node with these components.
    #[must_use]
    pub fn from_array([x1, v1, v2, time]: [f64; 4]) -> Self {
        Self { x1, v1, v2, time }
    }
}

/// The legs of a periodic motion.
#[derive(Debug, Clone, PartialEq)]
pub struct Itinerary {
    /// The legs in order; the first follows on the last.
    pub legs: Vec<Leg>,
    /// Drive periods after which the motion repeats.
    pub periods: i64,
    /// Completed drive periods at the start of each leg, counted from any.
    pub clocks: Vec<i64>,
    /// Whether body 2 is a wall at rest (mbar = 0): it is left out then.
    pub wall_at_rest: bool,
}

/// Why no itinerary was found.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ItineraryError {
    /// Bad input.
    #[error(transparent)]
    Parameter(#[from] ParameterError),
    /// Bad input.
    #[error(transparent)]
    State(#[from] StateError),
    /// A failed computation.
    #[error(transparent)]
    Simulation(#[from] SimulationError),
    /// The motion ends.
    #[error("the motion ends: {}", .0.name())]
    Stopped(StopReason),
    /// The events of one cycle cannot be told from the next one's.
    #[error("the events do not repeat")]
    NotClosed,
    /// More legs than the dense matrices of shooting are made for.
    #[error("{0} legs are more than the {MOST_LEGS} that can be solved for")]
    TooLong(usize),
    /// A stop of a structure stays closed for a while, or infinitely many impacts follow one another.
    #[error("the motion has {0} at stop {1}; what is followed are sequences of impacts")]
    NotImpacts(&'static str, usize),
    /// Several stops of a structure are struck at one instant.
    #[error(
        "stops {0} and {1} are struck at one instant; what is followed are sequences of impacts at \
         instants of their own"
    )]
    Together(usize, usize),
}

/// Refuses what no periodic motion has: so many legs, among which is a circuit or not, the drive
/// periods after which it repeats, and those at the start of each leg.
pub(crate) fn checked_sequence(
    (legs, circuit): (usize, bool),
    periods: i64,
    clocks: &[i64],
) -> Result<(), ParameterError> {
    if periods < 1 {
        return Err(ParameterError::new("periods", periods, "a whole number >= 1"));
    }
    if legs == 0 || (circuit && legs > 1) {
        return Err(ParameterError::new("legs", legs, "a circuit alone, or others"));
    }
    if clocks.len() != legs {
        return Err(ParameterError::new("clocks", clocks.len(), "as many as legs"));
    }
    // Their sums and differences are counted too.
    let most = 1i64 << 53;
    for (name, count) in
        [("periods", periods)].into_iter().chain(clocks.iter().map(|&clock| ("clocks", clock)))
    {
        if !(-most..=most).contains(&count) {
            return Err(ParameterError::new(name, count, "at most 2^53"));
        }
    }
    Ok(())
}

/// A leg with the event that ends it.
#[derive(Clone)]
struct EndedLeg {
    leg: Leg,
    clock: Clock,
    state: State,
    /// Whether contact follows, in whatever mode.
    holds: bool,
    /// u of an impact.
    approach_velocity: f64,
}

impl Itinerary {
    /// An itinerary of these legs.
    ///
    /// # Errors
    /// [`ParameterError`] for an empty or inconsistent sequence.
    pub fn new(
        legs: Vec<Leg>,
        periods: i64,
        clocks: Option<Vec<i64>>,
        wall_at_rest: bool,
    ) -> Result<Self, ParameterError> {
        let clocks = clocks.unwrap_or_else(|| vec![0; legs.len()]);
        checked_sequence((legs.len(), legs.contains(&Leg::Circuit)), periods, &clocks)?;
        Ok(Self { legs, periods, clocks, wall_at_rest })
    }

    /// Follows a motion from t = 0 for two cycles of `periods` drive periods and reads off the legs
    /// of one cycle, with the nodes at their starts. `cancel` ends it.
    ///
    /// # Errors
    /// [`ItineraryError`]
    pub fn follow(
        system: &System,
        initial: State,
        periods: i64,
        max_events: u64,
        cancel: &CancelToken,
    ) -> Result<(Self, Vec<Node>), ItineraryError> {
        if system.drive_frequency == 0.0 {
            return Err(ParameterError::new("drive_frequency", 0.0, "> 0 for a period").into());
        }
        // Two cycles, and a drive period more in case an event lies at their start.
        let whole = periods.checked_mul(2).and_then(|twice| u32::try_from(twice + 1).ok());
        let (Some(whole), true) = (whole, periods >= 1) else {
            return Err(ParameterError::new("periods", periods, "a whole number >= 1").into());
        };
        let initial = with_wall_at_rest(system, initial);
        let wall_at_rest = system.is_wall_at_rest(&initial);
        let ended = ended_legs(system, initial, whole, max_events, cancel)?;
        if ended.is_empty() {
            let node = Node { x1: initial.x1, v1: initial.v1, v2: initial.v2, time: initial.x2 };
            let legs = Self { legs: vec![Leg::Circuit], periods, clocks: vec![0], wall_at_rest };
            return Ok((legs, vec![node]));
        }
        let drive = Drive::of(system);
        let time = |end: &EndedLeg| drive.time(end.clock);
        let length = periods as f64 * system.drive_period();
        // One cycle is enough, and all that a guess near an unstable motion may give, if no event
        // is so close to its ends that drift could move it across.
        let inside = ended.iter().take_while(|leg| time(leg) < length).count();
        let clear = CLEAR_ENDS * system.drive_period();
        let apart = |i: usize, end: f64| ended.get(i).is_none_or(|m| (time(m) - end).abs() > clear);
        let one = inside > 0 && apart(0, 0.0) && apart(inside - 1, length) && apart(inside, length);
        let (begins, count) = if one {
            (0, inside)
        } else {
            // The cycle begins with the event of the first one that has most room before it.
            let room = |i: usize| time(&ended[i]) - if i == 0 { 0.0 } else { time(&ended[i - 1]) };
            let first = length + 0.5 * system.drive_period();
            let begins = (0..ended.iter().take_while(|leg| time(leg) < first).count())
                .max_by(|&i, &j| room(i).total_cmp(&room(j)))
                .ok_or(ItineraryError::NotClosed)?;
            let end = time(&ended[begins]) + length - 0.5 * room(begins);
            (begins, ended[begins..].iter().take_while(|leg| time(leg) < end).count())
        };
        let cycle = &ended[begins..begins + count];
        let next = if one {
            &ended[0]
        } else {
            ended.get(begins + count).ok_or(ItineraryError::NotClosed)?
        };
        if cycle.len() > MOST_LEGS {
            return Err(ItineraryError::TooLong(cycle.len()));
        }
        let legs: Vec<Leg> = cycle[1..].iter().map(|m| m.leg).chain([next.leg]).collect();
        let consistent = cycle.iter().zip(&legs).all(|(end, leg): (&EndedLeg, &Leg)| {
            let held = matches!(leg, Leg::SlideToRelease(_) | Leg::SlideToStop(_) | Leg::Stick(_));
            held == end.holds
        });
        if !consistent {
            return Err(ItineraryError::NotClosed);
        }
        let clocks = cycle.iter().map(|m| m.clock.period).collect();
        let nodes = cycle
            .iter()
            .map(|m| {
                let State { x1, v1, v2, .. } = m.state;
                Node { x1, v1, v2, time: m.clock.time_in_period }
            })
            .collect();
        Ok((Self { legs, periods, clocks, wall_at_rest }, nodes))
    }
}

/// A wall (mbar = 0) that no drive moves comes to rest, if it is damped: what is left of its motion
/// must not decide between contact that slides and contact that sticks.
pub(crate) fn with_wall_at_rest(system: &System, state: State) -> State {
    let place = system.static_force;
    let decays = system.is_wall()
        && system.force_amplitude == 0.0
        && system.oscillator_damping > 0.0
        && (state.x2 - place).abs().max(state.v2.abs()) <= STILL_WALL;
    let still = State { x2: place, v2: 0.0, ..state };
    if decays && system.gap_function(&still) <= 0.0 { still } else { state }
}

/// What an event changes about the legs.
pub(crate) enum LegChange {
    /// It ends this leg; the state is the one after it.
    Ends(Leg, Clock, State),
    /// Contact begins in this state where an impact or chatter has just ended, or at t = 0.
    Begins(State),
    /// It ends no leg.
    Nothing,
    /// The run ends.
    Stops(StopReason),
}

/// Reads events one by one. A contact mode that follows on an impact or on chatter at the same
/// instant is no event of its own.
pub(crate) struct LegReader {
    /// The mode of the leg that runs, and the leg that the next change of mode would end.
    pub mode: Option<ContactMode>,
}

impl LegReader {
    pub fn read(&mut self, system: &System, event: &Event) -> LegChange {
        let (leg, clock, state, after) = match event {
            Event::Impact(impact) => {
                (Leg::to_impact(system, impact), impact.clock, impact.post, None)
            }
            Event::Chatter(chatter) => (Leg::Chatter, chatter.clock, chatter.state, None),
            Event::SlidePositive(change)
            | Event::SlideNegative(change)
            | Event::Stick(change)
            | Event::Release(change) => {
                let Some(ended) = self.mode else {
                    self.mode = change.mode;
                    return LegChange::Begins(change.state);
                };
                // Without friction the direction plays no part.
                let positive = ended == ContactMode::SlidePositive || system.friction == 0.0;
                let leg = match (ended, change.mode) {
                    (ContactMode::Stick, None) => Leg::Stick(StickEnd::Release),
                    (ContactMode::Stick, Some(ContactMode::SlidePositive)) => {
                        Leg::Stick(StickEnd::SlipPositive)
                    }
                    (ContactMode::Stick, Some(_)) => Leg::Stick(StickEnd::SlipNegative),
                    (_, None) => Leg::SlideToRelease(positive),
                    (_, Some(_)) => Leg::SlideToStop(positive),
                };
                (leg, change.clock, change.state, change.mode)
            }
            Event::Graze(_) => return LegChange::Nothing,
            Event::Stop(stop) => return LegChange::Stops(stop.reason),
        };
        self.mode = after;
        LegChange::Ends(leg, clock, state)
    }
}

/// The events of so many drive periods, each with the leg it ends.
fn ended_legs(
    system: &System,
    initial: State,
    periods: u32,
    max_events: u64,
    cancel: &CancelToken,
) -> Result<Vec<EndedLeg>, ItineraryError> {
    let mut ended: Vec<EndedLeg> = Vec::new();
    let mut reader = LegReader { mode: None };
    let mut simulation = Simulation::new(system, initial)?
        .periods(periods)
        .max_events(max_events)
        .cancel_with(cancel);
    while let Some(event) = simulation.advance(&mut ()) {
        let event = event?;
        match reader.read(system, &event) {
            LegChange::Ends(leg, clock, state) => {
                let approach_velocity = match event {
                    Event::Impact(impact) => impact.impact.approach_velocity,
                    _ => 0.0,
                };
                let holds = reader.mode.is_some();
                ended.push(EndedLeg { leg, clock, state, holds, approach_velocity });
            }
            LegChange::Begins(state) => {
                if let Some(last) = ended.last_mut() {
                    last.holds = true;
                    last.state = state;
                }
            }
            LegChange::Nothing => {}
            LegChange::Stops(StopReason::Completed) => break,
            LegChange::Stops(reason) => return Err(ItineraryError::Stopped(reason)),
        }
    }
    Ok(without_low_bounces(&ended))
}

/// The low impacts that lead into chatter are left to the chatter's leg: as legs of their own their
/// times have the rounding of the gap over u.
fn without_low_bounces(ended: &[EndedLeg]) -> Vec<EndedLeg> {
    let highest = ended.iter().map(|end| end.approach_velocity).fold(0.0, f64::max);
    let mut kept: Vec<EndedLeg> = Vec::with_capacity(ended.len());
    for end in ended {
        if end.leg == Leg::Chatter {
            while let [.., before, last] = &kept[..] {
                let low = last.approach_velocity < LOW_BOUNCE * highest
                    && before.approach_velocity > last.approach_velocity;
                if !low {
                    break;
                }
                kept.pop();
            }
        }
        kept.push(end.clone());
    }
    kept
}

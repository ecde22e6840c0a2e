//! The hybrid automaton as an iterator of events: flight -> impact -> flight, with grazes, caps
//! and typed stop reasons (docs/theory.md, sections 3 to 5).
//!
//! The search of a flight never depends on where the run is asked to end, so a run that is
//! resumed gives the same bits as one long run.

use serde::{Deserialize, Serialize};

use crate::chatter::{ChatterMonitor, remaining_time_error};
use crate::contact::{Found, Start, Touch, next_contact};
use crate::double_double::DoubleDouble;
use crate::error::{SimulationError, StateError};
use crate::event::{Event, GrazeEvent, ImpactEvent, StopEvent, StopReason};
use crate::flight::{Flight, FreeMotion};
use crate::impact::{self, ImpactFailure, PreImpact};
use crate::params::{ImpactLaw, System};
use crate::state::{Clock, State};
use crate::tolerance::{DEFAULT_MAX_EVENTS, DEFAULT_MAX_TIME, DEFAULT_TOLERANCE};

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
pub trait Observer {
    /// Whether stroboscopic section points are wanted.
    const SECTIONS: bool;
    /// The state at the k-th stroboscopic section (k >= 1), after an impact at that instant.
    fn section(&mut self, k: i64, state: &State);
    /// Asked before every local flight, with or without events; `false` ends the run there with
    /// [`StopReason::Interrupted`].
    fn go_on(&mut self) -> bool {
        true
    }
}

impl Observer for () {
    const SECTIONS: bool = false;
    fn section(&mut self, _: i64, _: &State) {}
}

/// Start of a flight, from which everything up to the next impact follows.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(crate) struct Anchor {
    pub clock: Clock,
    pub state: State,
    /// On the contact, just after an impact.
    pub touching: bool,
}

/// All that is needed to go on later with the same bits.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(crate) struct Checkpoint {
    pub anchor: Anchor,
    /// Local flights of the full span since the anchor.
    chunk: u64,
    /// Local time of a graze in the present local flight.
    grazed: Option<f64>,
    /// Chatter completes: the next flight does not start.
    resting: bool,
    monitor: ChatterMonitor,
    /// Next stroboscopic section.
    pub next_section: i64,
    pub impacts: u64,
    pub events: u64,
    pub stopped: Option<StopReason>,
}

/// A running simulation: an iterator over its events, the last of which is [`Event::Stop`].
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
pub struct Simulation {
    system: System,
    motion: FreeMotion,
    horizon: Horizon,
    max_events: u64,
    tolerance: f64,
    /// Section time in the period.
    section_offset: f64,
    point: Checkpoint,
    /// The present local flight.
    flight: Flight,
    /// What the search found in the present local flight, once it has run.
    found: Option<Found>,
    evaluations: u64,
}

impl Simulation {
    /// A simulation from `initial` at t = 0, forcing cos(omega t + phi). Without a horizon it runs
    /// up to the caps on events and time.
    ///
    /// # Errors
    /// [`StateError`] if the bodies touch or overlap in `initial`.
    pub fn new(system: &System, initial: State) -> Result<Self, StateError> {
        let gap = system.gap_function(&initial);
        let noise = system.gap_noise(&initial);
        let State { x1, x2, .. } = initial;
        if gap > noise {
            return Err(StateError::Penetrating { gap, x1, x2 });
        }
        if gap >= -noise {
            return Err(StateError::InContact { gap, noise, x1, x2 });
        }
        let anchor = Anchor { clock: Clock::START, state: initial, touching: false };
        Ok(Self::from_checkpoint(
            system,
            Checkpoint {
                anchor,
                chunk: 0,
                grazed: None,
                resting: false,
                monitor: ChatterMonitor::default(),
                next_section: 1,
                impacts: 0,
                events: 0,
                stopped: None,
            },
        ))
    }

    pub(crate) fn from_checkpoint(system: &System, point: Checkpoint) -> Self {
        let motion = FreeMotion::new(system);
        let flight = motion.flight(point.anchor.clock, point.anchor.state);
        let mut simulation = Self {
            system: *system,
            motion,
            horizon: Horizon::Impacts { count: u64::MAX, max_time: DEFAULT_MAX_TIME },
            max_events: DEFAULT_MAX_EVENTS,
            tolerance: DEFAULT_TOLERANCE,
            section_offset: 0.0,
            point,
            flight,
            found: None,
            evaluations: 0,
        };
        simulation.enter_chunk();
        simulation
    }

    /// Ends after so many drive periods; a constant load has none, and meets the time cap.
    #[must_use]
    pub fn periods(self, periods: u32) -> Self {
        self.until(Horizon::Periods(i64::from(periods)))
    }

    /// Ends at this horizon; its time must be finite, or the default cap on time takes its place.
    #[must_use]
    pub fn until(mut self, horizon: Horizon) -> Self {
        let capped = |time: f64| if time.is_finite() { time } else { DEFAULT_MAX_TIME };
        self.horizon = match horizon {
            Horizon::Periods(_) => horizon,
            Horizon::Time(time) => Horizon::Time(capped(time)),
            Horizon::Impacts { count, max_time } => {
                Horizon::Impacts { count, max_time: capped(max_time) }
            }
        };
        self
    }

    /// Cap on the number of events; the run then stops with [`StopReason::EventCap`].
    #[must_use]
    pub fn max_events(mut self, events: u64) -> Self {
        self.max_events = events;
        self
    }

    /// Absolute tolerance in time where something is approximated (chatter).
    #[must_use]
    pub fn tolerance(mut self, tolerance: f64) -> Self {
        self.tolerance = tolerance;
        self
    }

    /// Moves the stroboscopic section to omega t = `phase` (mod 2 pi), `phase` in [0, 2 pi).
    #[must_use]
    pub fn section_phase(mut self, phase: f64) -> Self {
        self.section_offset = if phase > 0.0 { phase / self.system.drive_frequency } else { 0.0 };
        self
    }

    /// Evaluations of the gap function so far.
    #[must_use]
    pub fn evaluations(&self) -> u64 {
        self.evaluations
    }

    /// Impacts since t = 0.
    #[must_use]
    pub fn impact_count(&self) -> u64 {
        self.point.impacts
    }

    pub(crate) fn checkpoint(&self) -> Checkpoint {
        self.point
    }

    /// The stop of a simulation that had stopped before.
    pub(crate) fn standstill(&self) -> StopEvent {
        let Flight { clock, state, .. } = self.flight;
        let reason = self.point.stopped.unwrap_or(StopReason::Interrupted);
        StopEvent { clock, time: self.motion.drive.time(clock), state, reason }
    }

    /// Skips the sections before the `first`-th.
    pub(crate) fn sections_from(&mut self, first: i64) {
        self.point.next_section = self.point.next_section.max(first);
    }

    /// Goes on to the next event; `None` after the stop.
    ///
    /// # Errors
    /// [`SimulationError`] with time, number of impacts and state.
    pub fn advance(
        &mut self,
        observer: &mut impl Observer,
    ) -> Option<Result<Event, SimulationError>> {
        if self.point.stopped.is_some() {
            return None;
        }
        loop {
            if let Some(stop) = self.stop_before_flight() {
                return Some(Ok(stop));
            }
            if !observer.go_on() {
                return Some(Ok(self.stop_here(StopReason::Interrupted)));
            }
            let found = self.search();
            let reached = match found {
                Found::Contact(touch) | Found::Graze(touch) => touch.local_time(),
                Found::Nothing => self.motion.span,
                Found::Resting => 0.0,
                // The literal law creates energy without bound.
                Found::NotFinite | Found::Stalled if self.system.law == ImpactLaw::Paper => {
                    return Some(Ok(self.stop_here(StopReason::LawFailed)));
                }
                Found::NotFinite => return Some(Err(self.fail(false))),
                Found::Stalled => return Some(Err(self.fail(true))),
            };
            let end = self.horizon_in_flight();
            // A contact at the very end still belongs to the run.
            let over = reached > end;
            self.pass_sections(if over { end } else { reached }, over, observer);
            if over {
                return Some(Ok(self.stop_at_horizon(end)));
            }
            match found {
                Found::Contact(touch) => return Some(self.strike(&touch)),
                Found::Graze(touch) => return Some(Ok(self.graze(&touch))),
                Found::Resting => return Some(Ok(self.stop_here(StopReason::Chatter))),
                _ => {
                    self.point.chunk += 1;
                    self.point.grazed = None;
                    self.enter_chunk();
                    if !self.flight.state.is_finite() {
                        return Some(Err(self.fail(false)));
                    }
                }
            }
        }
    }

    /// Starts the present local flight, from the anchor without accumulating rounding.
    fn enter_chunk(&mut self) {
        let Anchor { clock, state, .. } = self.point.anchor;
        self.found = self.point.resting.then_some(Found::Resting);
        self.flight = self.motion.flight(clock, state);
        if self.point.chunk > 0 {
            let elapsed = DoubleDouble::product(self.motion.span, self.point.chunk as f64);
            let state = self.motion.state_after(&self.flight, elapsed);
            self.flight = self.motion.flight(self.motion.drive.advance(clock, elapsed), state);
        }
    }

    fn search(&mut self) -> Found {
        if let Some(found) = self.found {
            return found;
        }
        let start = match self.point.grazed {
            Some(time) => Start::Grazed(time),
            None if self.point.anchor.touching && self.point.chunk == 0 => Start::Touching,
            None => Start::Apart,
        };
        let System { contact, gap, .. } = self.system;
        let report =
            next_contact(&self.motion, &self.flight, contact, gap, start, self.motion.span);
        self.evaluations += report.evaluations;
        self.found = Some(report.found);
        report.found
    }

    /// Local time at which the horizon lies.
    fn horizon_in_flight(&self) -> f64 {
        self.motion.drive.until(self.flight.clock, self.horizon_clock()).value()
    }

    /// Clock of the horizon. Every run has one: a motion without contact must end too.
    pub(crate) fn horizon_clock(&self) -> Clock {
        let drive = &self.motion.drive;
        match self.horizon {
            Horizon::Periods(periods) if drive.has_period() => Clock::new(periods, 0.0),
            Horizon::Periods(_) => drive.clock_at(DEFAULT_MAX_TIME),
            Horizon::Time(time) | Horizon::Impacts { max_time: time, .. } => drive.clock_at(time),
        }
    }

    fn stop_before_flight(&mut self) -> Option<Event> {
        let reason = match self.horizon {
            Horizon::Impacts { count, .. } if self.point.impacts >= count => StopReason::Completed,
            _ if self.point.events >= self.max_events => StopReason::EventCap,
            _ => return None,
        };
        Some(self.stop_here(reason))
    }

    /// Hands the sections up to local time `reached` to the observer; one that falls on an impact
    /// is left for the flight after it.
    fn pass_sections<O: Observer>(&mut self, reached: f64, inclusive: bool, observer: &mut O) {
        if !O::SECTIONS || !self.motion.drive.has_period() {
            return;
        }
        loop {
            let period = self.point.next_section - i64::from(self.section_offset > 0.0);
            let section = Clock::new(period, self.section_offset);
            let at = self.motion.drive.until(self.flight.clock, section).value();
            if at > reached || (at == reached && !inclusive) {
                return;
            }
            let state = self.motion.state_at(&self.flight, at.max(0.0));
            observer.section(self.point.next_section, &state);
            self.point.next_section += 1;
        }
    }

    fn place(&self, time: f64, offset: f64) -> (Clock, f64, f64) {
        let drive = &self.motion.drive;
        let clock = drive.advance(self.flight.clock, DoubleDouble::sum(time, offset));
        (clock, drive.time(clock), drive.phase_at(clock))
    }

    /// Impact, and a new anchor.
    fn strike(&mut self, touch: &Touch) -> Result<Event, SimulationError> {
        let (clock, time, phase) = self.place(touch.time, touch.offset);
        let mut pre = touch.state;
        // g = 0 to rounding: let x2 follow from it, so that rounding does not add up.
        pre.x2 = self.system.tip(pre.x1) - self.system.gap;
        let mut velocities = PreImpact::new(self.system.contact, &pre);
        if velocities.approach_velocity() <= 0.0 {
            // The approach velocity is below rounding; the search's own is positive.
            velocities.v2 = velocities.v1 * velocities.cos - touch.gap.rate.max(f64::MIN_POSITIVE);
        }
        let impact = match impact::resolve(&self.system, &velocities) {
            Ok(impact) => impact,
            Err(failure) => {
                let reason = match failure {
                    ImpactFailure::Jammed => StopReason::Jammed,
                    ImpactFailure::LawFailed => StopReason::LawFailed,
                };
                return Ok(self.stop(clock, time, pre, reason));
            }
        };
        let post = State { v1: impact.v1_post, v2: impact.v2_post, ..pre };
        if !(post.is_finite() && impact.impulse_normal.is_finite()) {
            return Err(self.fail(false));
        }
        self.point.anchor = Anchor { clock, state: post, touching: true };
        self.point.chunk = 0;
        self.point.grazed = None;
        self.point.impacts += 1;
        self.point.events += 1;
        self.enter_chunk();
        if let Some(ratio) = self.point.monitor.observe(&impact, self.system.restitution) {
            self.believe_chatter(ratio, -impact.separation_velocity);
        }
        Ok(Event::Impact(ImpactEvent { clock, time, phase, pre, post, impact }))
    }

    /// Ends the next flight before it starts if chatter completes within the tolerance.
    fn believe_chatter(&mut self, ratio: f64, separation: f64) {
        let gap = self.motion.contact_gap(&self.flight, self.system.contact);
        if gap.second > 0.0 {
            let error = remaining_time_error(separation, ratio, gap.second, gap.third);
            // Neither the time nor the height of the hops left out may be seen.
            let height = separation * separation / (2.0 * gap.second);
            let steady = self.point.monitor.is_steady(gap.second, ratio);
            if steady && error <= self.tolerance && height <= self.tolerance {
                self.point.resting = true;
                self.found = Some(Found::Resting);
            }
        }
    }

    fn graze(&mut self, touch: &Touch) -> Event {
        let (clock, time, phase) = self.place(touch.time, touch.offset);
        let state = touch.state;
        let pre = PreImpact::new(self.system.contact, &state);
        if impact::approach_grows(&self.system, &pre) {
            return self.stop(clock, time, state, StopReason::UndecidableGraze);
        }
        self.point.grazed = Some(touch.local_time());
        self.point.events += 1;
        self.found = None;
        Event::Graze(GrazeEvent { clock, time, phase, state, gap_acceleration: touch.gap.second })
    }

    /// Stops at the horizon, whose clock is known exactly.
    fn stop_at_horizon(&mut self, s: f64) -> Event {
        let reason = match self.horizon {
            Horizon::Impacts { .. } => StopReason::TimeCap,
            Horizon::Periods(_) if !self.motion.drive.has_period() => StopReason::TimeCap,
            _ => StopReason::Completed,
        };
        let clock = self.horizon_clock();
        let state = self.motion.state_at(&self.flight, s.max(0.0));
        self.stop(clock, self.motion.drive.time(clock), state, reason)
    }

    /// Stops at the start of the present flight, or at the graze it goes on from.
    fn stop_here(&mut self, reason: StopReason) -> Event {
        let s = self.point.grazed.unwrap_or(0.0);
        let (clock, time, _) = self.place(s, 0.0);
        let state = self.motion.state_at(&self.flight, s);
        self.stop(clock, time, state, reason)
    }

    fn stop(&mut self, clock: Clock, time: f64, state: State, reason: StopReason) -> Event {
        self.point.stopped = Some(reason);
        Event::Stop(StopEvent { clock, time, state, reason })
    }

    fn fail(&mut self, stalled: bool) -> SimulationError {
        let Flight { clock, state, .. } = self.flight;
        let (time, impacts) = (self.motion.drive.time(clock), self.point.impacts);
        let state = state.to_array();
        self.point.stopped = Some(StopReason::Interrupted);
        if stalled {
            SimulationError::SearchStalled { time, impacts, state }
        } else {
            SimulationError::NotFinite { time, impacts, state }
        }
    }
}

impl Iterator for Simulation {
    type Item = Result<Event, SimulationError>;

    fn next(&mut self) -> Option<Self::Item> {
        self.advance(&mut ())
    }
}

//! A whole run with what is kept of it: the last periods' impacts, sections, grazes and events.

use serde::{Deserialize, Serialize};

use crate::double_double::DoubleDouble;
use crate::error::{ParameterError, SimulationError, StateError};
use crate::event::{Event, EventKind, EventRecord, GrazeRecord, ImpactRecord, StopReason};
use crate::flight::FreeMotion;
use crate::params::System;
use crate::period::{Kind, PeriodReport, detect_period, resolve_by_growth};
use crate::simulate::{Anchor, Checkpoint, Horizon, Observer, Simulation};
use crate::state::{Clock, State};
use crate::tolerance::{DEFAULT_MAX_EVENTS, DEFAULT_TOLERANCE};

/// How a run is made and what is kept of it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct RunOptions {
    /// How far the run goes, from t = 0.
    pub horizon: Horizon,
    /// Keep only the last so many drive periods before the horizon; everything if `None`. A run
    /// that stops before they begin keeps nothing.
    pub keep: Option<i64>,
    /// Cap on the number of events.
    pub max_events: u64,
    /// Absolute tolerance in time where something is approximated (chatter).
    pub tolerance: f64,
    /// The stroboscopic section lies at omega t = this (mod 2 pi), in [0, 2 pi).
    pub section_phase: f64,
}

impl RunOptions {
    /// So many drive periods, everything kept.
    #[must_use]
    pub fn periods(periods: i64) -> Self {
        Self::until(Horizon::Periods(periods))
    }

    /// Up to a horizon, everything kept.
    #[must_use]
    pub fn until(horizon: Horizon) -> Self {
        Self {
            horizon,
            keep: None,
            max_events: DEFAULT_MAX_EVENTS,
            tolerance: DEFAULT_TOLERANCE,
            section_phase: 0.0,
        }
    }

    /// Keeps the last so many periods only.
    #[must_use]
    pub fn keep(mut self, periods: i64) -> Self {
        self.keep = Some(periods);
        self
    }

    /// Refuses what makes no sense for `system`, before any work.
    ///
    /// # Errors
    /// [`ParameterError`] names the option, its value and the allowed range.
    pub fn check(&self, system: &System) -> Result<(), ParameterError> {
        let error = |name, value: String, allowed: &str| {
            Err(ParameterError::new(name, value, allowed.to_string()))
        };
        match self.horizon {
            Horizon::Periods(periods) if system.drive_frequency() == 0.0 => {
                return error("periods", periods.to_string(), "time instead: drive_frequency is 0");
            }
            Horizon::Periods(periods) if periods < 0 => {
                return error("periods", periods.to_string(), "a whole number >= 0");
            }
            Horizon::Time(time) | Horizon::Impacts { max_time: time, .. }
                if !(time.is_finite() && time >= 0.0) =>
            {
                return error("time", time.to_string(), "a finite number >= 0");
            }
            _ => {}
        }
        let turns = match self.horizon {
            Horizon::Periods(periods) => periods as f64,
            Horizon::Time(time) | Horizon::Impacts { max_time: time, .. } => {
                time / system.drive_period()
            }
        };
        if turns > MOST_PERIODS {
            return error("time", turns.to_string(), "at most 2^53 drive periods");
        }
        match (self.keep, self.horizon) {
            (Some(keep), Horizon::Periods(periods)) if !(0..=periods).contains(&keep) => {
                return error("keep", keep.to_string(), "a whole number in [0, periods]");
            }
            (Some(keep), Horizon::Time(_) | Horizon::Impacts { .. }) => {
                return error("keep", keep.to_string(), "only together with periods");
            }
            _ => {}
        }
        if !(self.tolerance.is_finite() && self.tolerance > 0.0) {
            return error("tolerance", self.tolerance.to_string(), "a finite number > 0");
        }
        if !(0.0..std::f64::consts::TAU).contains(&self.section_phase) {
            return error("section_phase", self.section_phase.to_string(), "in [0, 2 pi)");
        }
        Ok(())
    }

    /// First drive period of which anything is kept.
    fn window(&self) -> i64 {
        match (self.keep, self.horizon) {
            (Some(keep), Horizon::Periods(periods)) => periods - keep,
            _ => 0,
        }
    }
}

/// Why a run could not be made.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum RunError {
    /// Bad option.
    #[error(transparent)]
    Parameter(#[from] ParameterError),
    /// Bad start.
    #[error(transparent)]
    State(#[from] StateError),
    /// Failed computation.
    #[error(transparent)]
    Simulation(#[from] SimulationError),
}

/// State at the end of a run.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct FinalState {
    /// The state, after the impact if one falls on that instant.
    pub state: State,
    /// Periods and time in the period.
    pub clock: Clock,
    /// Time since the start.
    pub time: f64,
}

/// A run: what was kept, how it ended, and what is needed to go on.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Run {
    /// The system.
    pub system: System,
    /// How it was made.
    pub options: RunOptions,
    /// Impacts in the window.
    #[serde(skip)]
    pub impacts: Vec<ImpactRecord>,
    /// States at the stroboscopic sections in the window.
    #[serde(skip)]
    pub stroboscopic: Vec<[f64; 4]>,
    /// Grazes in the window.
    #[serde(skip)]
    pub grazes: Vec<GrazeRecord>,
    /// Events in the window.
    #[serde(skip)]
    pub events: Vec<EventRecord>,
    /// State at the end.
    pub final_state: FinalState,
    /// Why the run ended.
    pub stop_reason: StopReason,
    /// Impacts since t = 0, kept or not.
    pub impact_count: u64,
    /// Evaluations of the gap function.
    pub evaluations: u64,
    /// Start of the window.
    window: Clock,
    /// Number of the first section in the window.
    first_section: i64,
    /// The flight in which the window begins.
    window_anchor: Anchor,
    checkpoint: Checkpoint,
}

/// Drive periods that can be counted without a gap in the numbers.
const MOST_PERIODS: f64 = 9_007_199_254_740_992.0;

/// Local flights between two looks at the caller's wish to go on: some milliseconds.
const FLIGHTS_PER_LOOK: u32 = 2048;

/// Collects sections, and asks the caller now and then.
struct Collector<'a> {
    sections: Vec<[f64; 4]>,
    flights: u32,
    go_on: &'a mut dyn FnMut() -> bool,
}

impl Observer for Collector<'_> {
    const SECTIONS: bool = true;

    fn section(&mut self, _: i64, state: &State) {
        self.sections.push(state.to_array());
    }

    fn go_on(&mut self) -> bool {
        self.flights += 1;
        if self.flights < FLIGHTS_PER_LOOK {
            return true;
        }
        self.flights = 0;
        (self.go_on)()
    }
}

/// Makes a run. `go_on` is asked every few thousand flights; `false` ends it with what is done.
///
/// # Errors
/// [`RunError`]: a bad option or start before any work, or a failed computation.
pub fn run(
    system: &System,
    initial: State,
    options: RunOptions,
    go_on: &mut dyn FnMut() -> bool,
) -> Result<Run, RunError> {
    options.check(system)?;
    let simulation = Simulation::new(system, initial)?;
    Ok(collect(simulation, system, options, Clock::new(options.window(), 0.0), go_on)?)
}

fn collect(
    simulation: Simulation,
    system: &System,
    options: RunOptions,
    window: Clock,
    go_on: &mut dyn FnMut() -> bool,
) -> Result<Run, SimulationError> {
    let mut simulation = simulation
        .until(options.horizon)
        .max_events(options.max_events)
        .tolerance(options.tolerance)
        .section_phase(options.section_phase);
    simulation.sections_from(window.period + 1);
    let first_section = simulation.checkpoint().next_section;
    let mut collector = Collector { sections: Vec::new(), flights: 0, go_on };
    let (mut impacts, mut grazes, mut events) = (Vec::new(), Vec::new(), Vec::new());
    let inside = move |clock: Clock| clock > window;
    let mut window_anchor = simulation.checkpoint().anchor;
    let mut end = None;
    while let Some(event) = simulation.advance(&mut collector) {
        match event? {
            Event::Impact(event) if inside(event.clock) => {
                events.push(record(event.time, event.clock, EventKind::Impact, impacts.len()));
                impacts.push(ImpactRecord::from(&event));
            }
            Event::Impact(_) => window_anchor = simulation.checkpoint().anchor,
            Event::Graze(event) if inside(event.clock) => {
                events.push(record(event.time, event.clock, EventKind::Graze, grazes.len()));
                grazes.push(GrazeRecord::from(&event));
            }
            Event::Graze(_) => {}
            Event::Stop(stop) => end = Some(stop),
        }
    }
    let end = end.unwrap_or_else(|| simulation.standstill());
    // A run that ends before its window has kept nothing: its window is its end.
    let window = if window > end.clock { end.clock } else { window };
    events.push(EventRecord {
        time: end.time,
        period: end.clock.period,
        kind: EventKind::Stop as i64,
        index: -1,
    });
    Ok(Run {
        system: *system,
        options,
        impacts,
        stroboscopic: collector.sections,
        grazes,
        events,
        final_state: FinalState { state: end.state, clock: end.clock, time: end.time },
        stop_reason: end.reason,
        impact_count: simulation.impact_count(),
        evaluations: simulation.evaluations(),
        window,
        first_section,
        window_anchor,
        checkpoint: simulation.checkpoint(),
    })
}

fn record(time: f64, clock: Clock, kind: EventKind, index: usize) -> EventRecord {
    EventRecord { time, period: clock.period, kind: kind as i64, index: index as i64 }
}

impl Run {
    /// Goes on to a further horizon, with the same bits as one long run; keeps the last `keep`
    /// periods of the continuation (all of it if `None`).
    ///
    /// # Errors
    /// [`RunError`]: bad options, a run that ended for good, or a failed computation.
    pub fn resume(
        &self,
        options: RunOptions,
        go_on: &mut dyn FnMut() -> bool,
    ) -> Result<Run, RunError> {
        options.check(&self.system)?;
        let resumable = matches!(
            self.stop_reason,
            StopReason::Completed
                | StopReason::EventCap
                | StopReason::TimeCap
                | StopReason::Interrupted
        );
        if !resumable {
            let allowed = "a run that completed, was interrupted or met a cap";
            return Err(ParameterError::new("stop_reason", self.stop_reason.name(), allowed).into());
        }
        let mut point = self.checkpoint;
        point.stopped = None;
        let simulation = Simulation::from_checkpoint(&self.system, point).until(options.horizon);
        let here = self.final_state.clock;
        if simulation.horizon_clock() < here {
            let value = format!("{:?}", options.horizon);
            return Err(ParameterError::new("horizon", value, "not before the run's end").into());
        }
        let kept = Clock::new(options.window(), 0.0);
        let window = if options.keep.is_some() && kept > here { kept } else { here };
        Ok(collect(simulation, &self.system, options, window, go_on)?)
    }

    /// Start of the kept window.
    #[must_use]
    pub fn kept_from(&self) -> f64 {
        FreeMotion::new(&self.system).drive.time(self.window)
    }

    /// States at the given times, right-continuous: after the impact at its instant. `None` for a
    /// time outside the kept window.
    #[must_use]
    pub fn trajectory(&self, times: &[f64]) -> Option<Vec<[f64; 4]>> {
        let motion = FreeMotion::new(&self.system);
        let (from, to) = (motion.drive.time(self.window), self.final_state.time);
        let mut states = Vec::with_capacity(times.len());
        let mut last = None;
        for &time in times {
            if !(from..=to).contains(&time) {
                return None;
            }
            // The flight that holds this time: after the last impact not later than it.
            let index = self.impacts.partition_point(|impact| impact.time <= time);
            let (clock, flight) = match last {
                Some((i, clock, flight)) if i == index => (clock, flight),
                _ => {
                    let (clock, state) = self.flight_start(index);
                    (clock, motion.flight(clock, state))
                }
            };
            last = Some((index, clock, flight));
            let elapsed = motion.drive.until(clock, motion.drive.clock_at(time));
            let elapsed = if elapsed.hi < 0.0 { DoubleDouble::ZERO } else { elapsed };
            states.push(motion.state_after(&flight, elapsed).to_array());
        }
        Some(states)
    }

    fn flight_start(&self, index: usize) -> (Clock, State) {
        if index == 0 {
            return (self.window_anchor.clock, self.window_anchor.state);
        }
        let i = &self.impacts[index - 1];
        let state = State { x1: i.x1, v1: i.v1_post, x2: i.x2, v2: i.v2_post };
        (Clock::new(i.period, i.time_in_period), state)
    }

    /// Period and label of the motion in the kept window; follows a nearby orbit if it does not
    /// repeat.
    #[must_use]
    pub fn period(&self) -> PeriodReport {
        let mut report = self.return_report();
        if self.stop_reason != StopReason::Completed {
            report.kind = Kind::Unresolved;
            report.orbit = None;
            report.method = "the run did not complete";
            return report;
        }
        if report.kind == Kind::Unresolved && report.residual.is_finite() {
            // A phase that fits the section makes it the start of a drive period.
            let phase = self.system.phase() + self.options.section_phase;
            if let (Some(last), Ok(system)) =
                (self.stroboscopic.last(), self.system.with("phase", phase))
            {
                return resolve_by_growth(&system, State::from_array(*last), report);
            }
        }
        report
    }

    /// The period from the kept sections alone, without following a nearby orbit.
    #[must_use]
    pub fn return_report(&self) -> PeriodReport {
        let shift = self.options.section_phase / self.system.drive_frequency();
        let mut counts = vec![0u32; self.stroboscopic.len()];
        for impact in &self.impacts {
            // Section k lies at k T, or at (k - 1) T + shift; an impact at a section belongs to
            // the interval that ends there.
            let past = impact.time_in_period > shift;
            let k = impact.period + i64::from(shift > 0.0) + i64::from(past);
            let row = usize::try_from(k - self.first_section).ok();
            if let Some(count) = row.and_then(|row| counts.get_mut(row)) {
                *count += 1;
            }
        }
        // A first interval that begins before the window: its count is not known.
        let cut = shift > 0.0 || self.window.time_in_period > 0.0;
        let known = usize::from(cut).min(counts.len());
        detect_period(&self.stroboscopic[known..], &counts[known..])
    }
}

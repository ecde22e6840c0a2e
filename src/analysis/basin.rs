//! Basins of attraction: on which of the known attractors a start ends up.
//!
//! A start has *arrived* once a section lies in the trapping region of an attractor, a whole cycle
//! of m drive periods later one does so again, no further from the attractor, and every drive
//! period of the cycle had the attractor's number of impacts. A start that has not arrived by the
//! end hands over the tail of its section, by which it is judged.

use crate::analysis::tolerances::NEAR_ATTRACTOR;
use std::collections::VecDeque;

use crate::analysis::period::{CHATTERING, PeriodReport, detect_period};
use crate::model::error::{SimulationError, StateError};
use crate::model::parameters::System;
use crate::model::state::{Clock, State};
use crate::numerics::cancel::CancelToken;
use crate::simulate::event::{Event, StopEvent, StopReason};
use crate::simulate::run::RunOptions;
use crate::simulate::{Job, Observer, Simulation};

/// Trapping region of a periodic attractor around one of its section points c: |W (X - c)| <= 1.
#[derive(Debug, Clone, PartialEq)]
pub struct Target {
    /// The section point c.
    pub center: [f64; 4],
    /// W, row by row.
    pub factor: [[f64; 4]; 4],
    /// Impacts in each of the m drive periods that follow c, [`CHATTERING`] where infinitely many.
    pub counts: Vec<u32>,
}

impl Target {
    /// |W (X - c)|; the angle of a free rotor counts modulo a turn.
    fn distance(&self, state: &[f64; 4], rotor: bool) -> f64 {
        let mut off: [f64; 4] = std::array::from_fn(|i| state[i] - self.center[i]);
        if rotor {
            let turn = std::f64::consts::TAU;
            off[0] -= turn * (off[0] / turn).round();
        }
        let row = |w: &[f64; 4]| w.iter().zip(off).map(|(a, b)| a * b).sum::<f64>().powi(2);
        self.factor.iter().map(row).sum::<f64>().sqrt()
    }
}

/// How the run of a start ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum ArrivalStatus {
    /// Not reached, or cut short, before the caller ended the work.
    Pending,
    /// The bodies overlap in it.
    Overlap,
    /// On the attractor of this number, having entered its region at this section.
    Arrived {
        /// Number of the target.
        target: usize,
        /// Drive periods until it entered the region.
        periods: i64,
    },
    /// On none of them by the end of the run, whose reason this is.
    Elsewhere(StopReason),
    /// The computation failed.
    Failed,
}

/// Where a start ended up.
#[derive(Debug, Clone, PartialEq)]
pub struct Arrival {
    /// How its run ended.
    pub status: ArrivalStatus,
    /// Its state where it arrived or ended.
    pub state: Option<[f64; 4]>,
    /// The last sections of a start that reached the end of its run without arriving,
    pub tail: Vec<[f64; 4]>,
    /// the impacts in the drive period that ends at each of them,
    pub counts: Vec<u32>,
    /// and the period they show.
    pub period: Option<PeriodReport>,
}

impl Arrival {
    pub(crate) fn empty(status: ArrivalStatus) -> Self {
        Self { status, state: None, tail: Vec::new(), counts: Vec::new(), period: None }
    }
}

/// Compares every section with the targets, and keeps the last of them.
pub(crate) struct Watch<'a> {
    targets: &'a [Target],
    rotor: bool,
    /// Ends the run of this start alone, once it has arrived.
    own: CancelToken,
    /// Impacts since the last section.
    impacts: u32,
    keep: usize,
    /// Longest cycle of a target.
    longest: usize,
    sections: VecDeque<[f64; 4]>,
    counts: VecDeque<u32>,
    /// For each target the section that entered its region last, and its distance there.
    entered: Vec<Option<(i64, f64)>>,
    arrived: Option<(usize, i64, [f64; 4])>,
}

impl<'a> Watch<'a> {
    fn new(targets: &'a [Target], system: &System, options: &RunOptions, own: CancelToken) -> Self {
        Self {
            targets,
            rotor: system.is_rotor(),
            own,
            impacts: 0,
            keep: usize::try_from(options.keep.unwrap_or(0)).unwrap_or(0),
            longest: targets.iter().map(|target| target.counts.len()).max().unwrap_or(0),
            sections: VecDeque::new(),
            counts: VecDeque::new(),
            entered: vec![None; targets.len()],
            arrived: None,
        }
    }

    /// Whether the last drive periods had the impacts of the target's cycle.
    fn cycled(&self, target: &Target) -> bool {
        let pairs = self.counts.iter().rev().zip(target.counts.iter().rev());
        self.counts.len() >= target.counts.len() && pairs.into_iter().all(|(a, b)| a == b)
    }
}

impl Observer for Watch<'_> {
    const SECTIONS: bool = true;

    fn section(&mut self, k: i64, state: &State) {
        if self.arrived.is_some() {
            return; // a long flight may pass further sections
        }
        let state = state.to_array();
        if self.sections.len() == self.keep {
            self.sections.pop_front();
        }
        if self.counts.len() == self.keep.max(self.longest) {
            self.counts.pop_front();
        }
        if self.keep > 0 {
            self.sections.push_back(state);
        }
        self.counts.push_back(std::mem::take(&mut self.impacts));
        for (number, target) in self.targets.iter().enumerate() {
            let distance = target.distance(&state, self.rotor);
            let cycle = target.counts.len() as i64;
            if let Some((at, before)) = self.entered[number] {
                if k < at + cycle {
                    continue; // a cycle is on its way
                }
                let nearer = distance <= before.max(NEAR_ATTRACTOR);
                if k == at + cycle && nearer && self.cycled(target) {
                    self.arrived = Some((number, at, state));
                    self.own.cancel();
                    return;
                }
            }
            self.entered[number] = (distance <= 1.0).then_some((k, distance));
        }
    }

    fn skips(&mut self, _: Clock, _: &State) -> bool {
        self.impacts = self.impacts.saturating_add(1);
        true
    }
}

/// The run of one start.
pub(crate) struct BasinRun<'a> {
    simulation: Simulation,
    watch: Watch<'a>,
    end: Option<StopEvent>,
    failed: bool,
}

impl<'a> Job for BasinRun<'a> {
    type Watch = Watch<'a>;
    type Beside = ();

    fn parts(&mut self) -> (&mut Simulation, &mut Watch<'a>) {
        (&mut self.simulation, &mut self.watch)
    }

    fn take(&mut self, event: Result<Event, SimulationError>) {
        match event {
            Ok(Event::Chatter(_)) => self.watch.impacts = CHATTERING,
            Ok(Event::Stop(stop)) => self.end = Some(stop),
            Ok(_) => {}
            Err(_) => self.failed = true,
        }
    }
}

impl<'a> BasinRun<'a> {
    /// From `initial`; `cancel` leaves it pending.
    ///
    /// # Errors
    /// [`StateError`] if the bodies overlap there.
    pub fn new(
        system: &System,
        initial: State,
        targets: &'a [Target],
        options: RunOptions,
        cancel: &CancelToken,
    ) -> Result<Self, StateError> {
        let own = cancel.part();
        let simulation = Simulation::new(system, initial)?
            .until(options.horizon)
            .max_events(options.max_events)
            .chatter_tolerance(options.chatter_tolerance)
            .section_phase(options.section_phase)
            .cancel_with(&own);
        let watch = Watch::new(targets, system, &options, own);
        Ok(Self { simulation, watch, end: None, failed: false })
    }

    /// Goes on to the end, and says where it has come to.
    pub fn arrive(mut self) -> Arrival {
        self.finish();
        let Self { watch, end, failed, .. } = self;
        if failed {
            return Arrival::empty(ArrivalStatus::Failed);
        }
        if let Some((target, periods, state)) = watch.arrived {
            let status = ArrivalStatus::Arrived { target, periods };
            return Arrival { state: Some(state), ..Arrival::empty(status) };
        }
        let Some(stop) = end.filter(|stop| stop.reason != StopReason::Interrupted) else {
            return Arrival::empty(ArrivalStatus::Pending);
        };
        let mut arrival = Arrival::empty(ArrivalStatus::Elsewhere(stop.reason));
        arrival.state = Some(stop.state.to_array());
        if stop.reason.reached_the_end() {
            arrival.tail = watch.sections.into();
            let spare = watch.counts.len().saturating_sub(arrival.tail.len());
            arrival.counts = watch.counts.into_iter().skip(spare).collect();
            arrival.period =
                Some(detect_period(&arrival.tail, &arrival.counts, &CancelToken::never()));
        }
        arrival
    }
}

/// Follows a start until it arrives at one of the targets, or to the end. `cancel` leaves
/// it pending.
#[must_use]
pub fn arrive(
    system: &System,
    initial: State,
    targets: &[Target],
    options: RunOptions,
    cancel: &CancelToken,
) -> Arrival {
    match BasinRun::new(system, initial, targets, options, cancel) {
        Ok(run) => run.arrive(),
        Err(_) => Arrival::empty(ArrivalStatus::Overlap),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simulate::run::run;

    /// The system in which a 4-5 and a 6-7 motion coexist (docs/coexistence.md).
    fn coexisting() -> System {
        System::builder()
            .mass_ratio(0.6)
            .frequency_ratio(2.0)
            .restitution(0.8)
            .gap(0.5)
            .friction(0.5)
            .moment_amplitude(1.0)
            .drive_frequency(1.5752)
            .build()
            .unwrap()
    }

    fn state([x1, v1, x2, v2]: [f64; 4]) -> State {
        State::new(x1, v1, x2, v2).unwrap()
    }

    fn go(system: &System, initial: [f64; 4], targets: &[Target], periods: i64) -> Arrival {
        let options = RunOptions::periods(periods).keep(periods.min(60));
        arrive(system, state(initial), targets, options, &CancelToken::never())
    }

    /// A ball around the last section of a run that has settled.
    fn target(initial: [f64; 4], m: usize) -> Target {
        let settled = go(&coexisting(), initial, &[], 4000);
        let mut factor = [[0.0; 4]; 4];
        (0..4).for_each(|i| factor[i][i] = 1e4);
        let counts = settled.counts[settled.counts.len() - m..].to_vec();
        Target { center: settled.tail[settled.tail.len() - 1], factor, counts }
    }

    const TO_4_5: [f64; 4] = [0.0, 0.0, 0.0, 0.0];
    const TO_6_7: [f64; 4] = [0.0, 0.5, 0.0, 0.0];

    #[test]
    fn a_start_left_over_has_the_tail_and_the_period_of_a_run() {
        let options = RunOptions::periods(900).keep(60);
        for initial in [TO_4_5, TO_6_7] {
            let system = coexisting();
            let run = run(&system, state(initial), options, &CancelToken::never()).unwrap();
            let left = go(&system, initial, &[], 900);
            assert_eq!(left.status, ArrivalStatus::Elsewhere(StopReason::Completed));
            assert_eq!(left.tail, run.stroboscopic);
            assert_eq!(left.period, Some(run.return_report(&CancelToken::never())));
            assert_eq!(left.counts.iter().sum::<u32>() as usize, run.impacts.len());
            assert_eq!(left.state, Some(run.final_state.state.to_array()));
        }
    }

    #[test]
    fn starts_arrive_where_a_long_run_ends() {
        let targets = [target(TO_4_5, 4), target(TO_6_7, 6)];
        assert_eq!(targets.each_ref().map(|t| t.counts.iter().sum::<u32>()), [5, 7]);
        for (initial, expected) in [(TO_4_5, 0), (TO_6_7, 1), (targets[1].center, 1)] {
            let arrival = go(&coexisting(), initial, &targets, 4000);
            let ArrivalStatus::Arrived { target, periods } = arrival.status else {
                panic!("{arrival:?}")
            };
            assert_eq!(target, expected);
            assert!(targets[target].distance(&arrival.state.unwrap(), false) <= 1.0);
            // The region is entered where it says, not before and not for the last time.
            let at = go(&coexisting(), initial, &[], periods).state.unwrap();
            assert!(targets[target].distance(&at, false) <= 1.0);
        }
    }

    #[test]
    fn a_cycle_with_other_impacts_is_no_arrival() {
        let mut other = target(TO_4_5, 4);
        other.counts[1] += 1;
        let arrival = go(&coexisting(), TO_4_5, &[other], 2000);
        assert_eq!(arrival.status, ArrivalStatus::Elsewhere(StopReason::Completed));
        assert_eq!(arrival.period.unwrap().label(), "4-5");
    }

    #[test]
    fn starts_that_cannot_run_say_why() {
        let system = coexisting();
        assert_eq!(go(&system, [1.5, 0.0, 0.0, 0.0], &[], 100).status, ArrivalStatus::Overlap);
        let capped = RunOptions { max_events: 3, ..RunOptions::periods(100) };
        let start = state(TO_4_5);
        let arrival = arrive(&system, start, &[], capped, &CancelToken::never());
        assert_eq!(arrival.status, ArrivalStatus::Elsewhere(StopReason::EventCap));
        assert!(arrival.tail.is_empty() && arrival.period.is_none());
        let cancelled =
            arrive(&system, start, &[], RunOptions::periods(100), &CancelToken::after(0));
        assert_eq!(cancelled.status, ArrivalStatus::Pending);
    }

    #[test]
    fn the_angle_of_a_free_rotor_counts_modulo_a_turn() {
        let mut ball = target(TO_4_5, 4);
        ball.center = [0.25, 0.0, 0.0, 0.0];
        let turned = [0.25 - 2.0 * std::f64::consts::TAU, 0.0, 0.0, 0.0];
        assert!(ball.distance(&turned, true) < 1e-10);
        assert!(ball.distance(&turned, false) > 1.0);
    }
}

//! Basins of attraction: on which of the known attractors a start ends up.
//!
//! A start has *arrived* once a section lies in the trapping region of an attractor, a whole cycle
//! of m drive periods later one does so again, no further from the attractor, and every drive
//! period of the cycle had the attractor's number of impacts. A start that has not arrived by the
//! end hands over the tail of its section, by which it is judged.

use crate::analysis::tolerances::NEAR_ATTRACTOR;
use std::collections::VecDeque;

use crate::analysis::period::{CHATTERING, PeriodReport, detect_period};
use crate::model::Point;
use crate::model::error::{SimulationError, StateError};
use crate::model::parameters::System;
use crate::model::state::Clock;
use crate::model::structure::{Structure, StructureState};
use crate::numerics::cancel::CancelToken;
use crate::simulate::event::{EventKind, StopEvent, StopReason};
use crate::simulate::run::{Kept, Recorded, RunOptions, Together};
use crate::simulate::{Job, ModelEvent, Observer, Simulation};

/// Trapping region of a periodic attractor around one of its section points c: |W (X - c)| <= 1.
#[derive(Debug, Clone, PartialEq)]
pub struct Target<P = [f64; 4]> {
    /// The section point c.
    pub center: P,
    /// W, row by row.
    pub factor: Vec<P>,
    /// Impacts in each of the m drive periods that follow c, [`CHATTERING`] where infinitely many.
    pub counts: Vec<u32>,
}

/// A model whose starts are followed to attractors.
#[allow(private_interfaces)] // nobody outside of the crate can name the trait
pub trait Followed: Together {
    /// Takes the whole turns out of a difference of sections, where a coordinate counts modulo a turn.
    fn unturned(&self, off: &mut Self::Section);
}

impl Followed for System {
    #[inline]
    fn unturned(&self, off: &mut [f64; 4]) {
        if self.is_rotor() {
            let turn = std::f64::consts::TAU;
            off[0] -= turn * (off[0] / turn).round();
        }
    }
}

impl Followed for Structure {
    fn unturned(&self, _: &mut StructureState) {}
}

impl<P: Point> Target<P> {
    /// |W (X - c)|; the angle of a free rotor counts modulo a turn.
    fn distance(&self, state: &P, unturned: impl Fn(&mut P)) -> f64 {
        let mut off = state.zip(&self.center, |x, c| x - c);
        unturned(&mut off);
        self.factor.iter().map(|row| row.dot(&off).powi(2)).sum::<f64>().sqrt()
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
pub struct Arrival<P = [f64; 4]> {
    /// How its run ended.
    pub status: ArrivalStatus,
    /// Its state where it arrived or ended.
    pub state: Option<P>,
    /// The last sections of a start that reached the end of its run without arriving,
    pub tail: Vec<P>,
    /// the impacts in the drive period that ends at each of them,
    pub counts: Vec<u32>,
    /// and the period they show.
    pub period: Option<PeriodReport>,
}

impl<P> Arrival<P> {
    pub(crate) fn empty(status: ArrivalStatus) -> Self {
        Self { status, state: None, tail: Vec::new(), counts: Vec::new(), period: None }
    }
}

/// Compares every section with the targets, and keeps the last of them.
pub(crate) struct Watch<'a, M: Recorded> {
    system: &'a M,
    targets: &'a [Target<M::Section>],
    /// Ends the run of this start alone, once it has arrived.
    own: CancelToken,
    /// Impacts since the last section.
    impacts: u32,
    keep: usize,
    /// Longest cycle of a target.
    longest: usize,
    sections: VecDeque<M::Section>,
    counts: VecDeque<u32>,
    /// For each target the section that entered its region last, and its distance there.
    entered: Vec<Option<(i64, f64)>>,
    arrived: Option<(usize, i64, M::Section)>,
}

impl<'a, M: Followed> Watch<'a, M> {
    fn new(
        targets: &'a [Target<M::Section>],
        system: &'a M,
        options: &RunOptions,
        own: CancelToken,
    ) -> Self {
        Self {
            system,
            targets,
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
    fn cycled(&self, target: &Target<M::Section>) -> bool {
        let pairs = self.counts.iter().rev().zip(target.counts.iter().rev());
        self.counts.len() >= target.counts.len() && pairs.into_iter().all(|(a, b)| a == b)
    }
}

impl<M: Followed> Observer<M::State> for Watch<'_, M> {
    const SECTIONS: bool = true;

    fn section(&mut self, k: i64, state: &M::State) {
        if self.arrived.is_some() {
            return; // a long flight may pass further sections
        }
        let state = M::section(state);
        if self.sections.len() == self.keep {
            self.sections.pop_front();
        }
        if self.counts.len() == self.keep.max(self.longest) {
            self.counts.pop_front();
        }
        if self.keep > 0 {
            self.sections.push_back(state.clone());
        }
        self.counts.push_back(std::mem::take(&mut self.impacts));
        for (number, target) in self.targets.iter().enumerate() {
            let distance = target.distance(&state, |off| self.system.unturned(off));
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

    fn skips(&mut self, _: Clock, _: &M::State) -> bool {
        self.impacts = self.impacts.saturating_add(1);
        true
    }
}

/// The run of one start.
pub struct BasinRun<'a, M: Recorded = System> {
    simulation: Simulation<M>,
    watch: Watch<'a, M>,
    end: Option<StopEvent<M::State>>,
    failed: bool,
}

impl<'a, M: Followed> Job for BasinRun<'a, M> {
    type Model = M;
    type Watch = Watch<'a, M>;
    type Beside = ();

    fn parts(&mut self) -> (&mut Simulation<M>, &mut Watch<'a, M>) {
        (&mut self.simulation, &mut self.watch)
    }

    fn take(&mut self, event: Result<M::Event, SimulationError>) {
        self.took(event);
    }
}

impl<'a, M: Followed> BasinRun<'a, M> {
    /// From `initial`; `cancel` leaves it pending.
    ///
    /// # Errors
    /// [`StateError`] if the bodies overlap there.
    pub(crate) fn new(
        system: &'a M,
        initial: M::State,
        targets: &'a [Target<M::Section>],
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

    fn took(&mut self, event: Result<M::Event, SimulationError>) {
        let Ok(event) = event else {
            self.failed = true;
            return;
        };
        if let Some(stop) = event.as_stop() {
            self.end = Some(stop.clone());
        } else if event.is_impact() {
            self.watch.impacts = self.watch.impacts.saturating_add(1); // one that was not passed over
        } else if let (_, _, Kept::Contact(EventKind::Chatter, _)) = M::kept(&event) {
            self.watch.impacts = CHATTERING;
        }
    }

    fn run_out(&mut self) {
        while let Some(event) = self.simulation.advance(&mut self.watch) {
            self.took(event);
        }
    }

    /// Goes on to the end, and says where it has come to.
    pub(crate) fn arrive(mut self) -> Arrival<M::Section> {
        self.run_out();
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
        arrival.state = Some(M::section(&stop.state));
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
pub fn arrive<M: Followed>(
    system: &M,
    initial: M::State,
    targets: &[Target<M::Section>],
    options: RunOptions,
    cancel: &CancelToken,
) -> Arrival<M::Section> {
    match BasinRun::new(system, initial, targets, options, cancel) {
        Ok(run) => run.arrive(),
        Err(_) => Arrival::empty(ArrivalStatus::Overlap),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::state::State;
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
        let mut factor = vec![[0.0; 4]; 4];
        (0..4).for_each(|i| factor[i][i] = 1e4);
        let counts = settled.counts[settled.counts.len() - m..].to_vec();
        Target { center: settled.tail[settled.tail.len() - 1], factor, counts }
    }

    fn distance(target: &Target, state: &[f64; 4]) -> f64 {
        target.distance(state, |off| coexisting().unturned(off))
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
            assert!(distance(&targets[target], &arrival.state.unwrap()) <= 1.0);
            // The region is entered where it says, not before and not for the last time.
            let at = go(&coexisting(), initial, &[], periods).state.unwrap();
            assert!(distance(&targets[target], &at) <= 1.0);
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
        let rotor = System::builder()
            .mass_ratio(0.6)
            .frequency_ratio(0.0)
            .restitution(0.8)
            .gap(0.5)
            .drive_frequency(1.5)
            .build()
            .unwrap();
        assert!(ball.distance(&turned, |off| rotor.unturned(off)) < 1e-10);
        assert!(distance(&ball, &turned) > 1.0);
    }

    /// One mass on a spring with one stop, as a structure and as head-on contact of a pendulum with a
    /// wall: the same motion in the same regions at the same sections.
    #[test]
    fn a_structure_arrives_where_and_when_the_same_system_does() {
        let system = System::builder()
            .mass_ratio(0.0)
            .frequency_ratio(1.0)
            .restitution(0.8)
            .gap(0.3)
            .drive_frequency(2.0)
            .moment_amplitude(1.0)
            .pendulum_damping(0.05)
            .contact(crate::model::parameters::Contact::Direct)
            .build()
            .unwrap();
        let structure = Structure::builder(vec![vec![1.0]], vec![vec![1.0]])
            .damping_ratios([0.05])
            .drive([1.0.into()], 2.0, 0.0)
            .stop(crate::model::structure::Stop::new([1.0], 0.3, 0.8))
            .build()
            .unwrap();
        let never = CancelToken::never();
        let options = RunOptions::periods(400).keep(40);
        let ends = arrive(&system, state([0.0; 4]), &[], options, &never);
        let one = StructureState::new(&[0.0], &[0.0]);
        let left = arrive(&structure, one.clone(), &[], options, &never);
        assert_eq!(left.counts, ends.counts);
        assert_eq!(left.period.unwrap().label(), ends.period.unwrap().label());
        let period = left.period.unwrap().orbit.unwrap().0;
        let counts = left.counts[left.counts.len() - period..].to_vec();
        let center = left.tail[left.tail.len() - 1].clone();
        let row = |q: f64, v: f64| StructureState::new(&[q], &[v]);
        let target = Target { center, factor: vec![row(1e4, 0.0), row(0.0, 1e4)], counts };
        let pendulum = Target {
            center: [target.center.q[0], target.center.v[0], 0.0, 0.0],
            factor: (0..4)
                .map(|i| std::array::from_fn(|j| if i == j && i < 2 { 1e4 } else { 0.0 }))
                .collect(),
            counts: target.counts.clone(),
        };
        let here = arrive(&structure, one, std::slice::from_ref(&target), options, &never);
        let there = arrive(&system, state([0.0; 4]), &[pendulum], options, &never);
        assert!(matches!(here.status, ArrivalStatus::Arrived { target: 0, .. }), "{here:?}");
        assert_eq!(here.status, there.status);
        let beyond = StructureState::new(&[0.5], &[0.0]);
        let overlap = arrive(&structure, beyond, &[target], options, &never);
        assert_eq!(overlap.status, ArrivalStatus::Overlap);
    }
}

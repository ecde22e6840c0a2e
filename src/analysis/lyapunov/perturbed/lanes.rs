//! One perturbation of each of several motions, mapped through the usual impacts in the lanes that
//! the motions are in: together those without friction or whose slip keeps its direction, the others
//! one by one.
//!
//! A lane does what [`Perturbations::take`] does, by the same functions. Everything that is not usual
//! (two low impacts in a row, which may lead into chatter; strong damping; a perturbation that leaves the
//! range of floats) is left to it.

#![allow(clippy::inline_always)] // a round is compiled for several instruction sets
#![allow(clippy::needless_bitwise_bool)] // conditions without jumps, for the lanes
#![allow(clippy::needless_range_loop)] // loops over lanes read best with their index

use super::{Perturbations, PerturbedState, Series};
use crate::analysis::tolerances::{LOW_APPROACH, MOST_CONTRACTION};
use crate::model::parameters::ImpactLaw;
use crate::model::restitution::RestitutionAt;
use crate::model::state::{Clock, State};
use crate::model::tip::Tip;
use crate::numerics::lanes::{LANES, Lanes, lanes_of};
use crate::simulate::ImpactLanes;
use crate::tangent::itinerary::Signs;
use crate::tangent::tolerances::LOW_BOUNCE;
use crate::tangent::{Columns, Departure, ImpactPoint, Numbers, Rates, flown, scaled};

/// Squares of the lengths that a perturbation has in a lane, just inside those that are left as they are
/// outside (`FACTORS`).
const SQUARES: std::ops::Range<f64> = 1e-49..1e49;

/// A motion just after an impact, with a perturbation (dx1, dx1', dx2', dt).
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Node {
    dx1: f64,
    dv1: f64,
    dv2: f64,
    dt: f64,
    x1: f64,
    v1: f64,
    a1: f64,
    x2: f64,
    v2: f64,
    a2: f64,
    /// dx2/dx1 on the contact.
    slope: f64,
    time_in_period: f64,
    residual: f64,
    /// u before the impact, and the largest so far.
    approach_velocity: f64,
    largest: f64,
}

lanes_of! {
    /// Several motions.
    Nodes of Node {
        dx1: dx1, dv1: dv1, dv2: dv2, dt: dt,
        x1: x1, v1: v1, a1: a1, x2: x2, v2: v2, a2: a2,
        slope: slope, time_in_period: time_in_period, residual: residual,
        approach_velocity: approach_velocity, largest: largest,
    }
}

impl Node {
    /// The motion after the impact of lane `j`, `time` after this one and with changes of the bodies'
    /// amplitudes since, by this map of what has flown there; `moves`: 0 for a wall at rest, else 1.
    #[inline(always)]
    fn after_impact<G: Tip>(
        &self,
        j: usize,
        impacts: &ImpactLanes,
        (time, changes): (f64, [f64; 2]),
        moves: f64,
        map: impl FnOnce(&ImpactPoint, &Columns<1>) -> Columns<1>,
    ) -> Self {
        let (pendulum, oscillator) = impacts.equations(j);
        let first = pendulum.swung_transition(time, changes[0]);
        let second = scaled(oscillator.swung_transition(time, changes[1]), moves);
        let columns = [[self.dx1], [self.dv1], [self.dv2], [self.dt]];
        let columns = flown(&columns, &self.rates(), self.slope, &[first, second]);
        let (clock, after) = impacts.start_after(j, 0);
        let (angle, phase) = impacts.angles_after(j);
        let before = impacts.state_before(j);
        let [mass_ratio, friction, restitution] = impacts.contact_numbers(j);
        let approach_velocity = impacts.approach_velocity(j);
        let point = ImpactPoint {
            angle,
            turns: G::TURNS,
            rates: Rates::at(&before, phase.cos, (&pendulum, &oscillator)),
            approach_velocity,
            // A perturbation where r depends on u travels by itself.
            numbers: Numbers {
                mass_ratio,
                friction,
                restitution: RestitutionAt { value: restitution, by_speed: 0.0 },
                moves,
            },
        };
        let [[dx1], [dv1], [dv2], [dt]] = map(&point, &columns);
        let decay_rates = [pendulum.decay_rate, oscillator.decay_rate];
        let rates = point.rates.after([after.v1, after.v2], decay_rates);
        Self {
            dx1,
            dv1,
            dv2,
            dt,
            x1: after.x1,
            v1: after.v1,
            a1: rates.accelerations[0],
            x2: after.x2,
            v2: after.v2,
            a2: rates.accelerations[1],
            slope: moves * angle.cos,
            time_in_period: clock.time_in_period,
            residual: clock.residual,
            approach_velocity,
            largest: self.largest.max(approach_velocity),
        }
    }

    /// The square of the perturbation's length.
    #[inline(always)]
    fn square(&self) -> f64 {
        let Self { dx1, dv1, dv2, dt, .. } = *self;
        dx1 * dx1 + dv1 * dv1 + dv2 * dv2 + dt * dt
    }

    fn rates(&self) -> Rates {
        Rates { velocities: [self.v1, self.v2], accelerations: [self.a1, self.a2] }
    }
}

/// Perturbations in the lanes.
#[derive(Debug, Clone, Default)]
#[repr(C, align(64))]
pub(crate) struct PerturbationLanes {
    /// After the last impact.
    here: Nodes,
    /// From the last impact to the next one.
    times: Lanes,
    /// Drive periods from the last impact's to the one in which the present flight began.
    ahead: Lanes,
    moves: Lanes,
    fastest_decay: Lanes,
    laws: [ImpactLaw; LANES],
    /// 1 where the lane has the perturbation of its job.
    held: [u64; LANES],
    /// 1 where the next impact is a usual one.
    usual: [u64; LANES],
    /// 1 where the last impact is low and lower than the one before: [`Series::Decreasing`]; and for
    /// the next impact.
    low: [u64; LANES],
    next_low: [u64; LANES],
    /// After the impact before a low one, and its drive period.
    before: Nodes,
    before_periods: [i64; LANES],
    /// 1 where the next impact is passed over.
    passed: [u64; LANES],
    /// Impacts passed over, and the drive period of the last impact.
    impacts: [u64; LANES],
    periods: [i64; LANES],
}

impl PerturbationLanes {
    /// Looks at the impacts that come next: which are usual ones.
    #[inline(always)]
    pub fn look(&mut self, impacts: &ImpactLanes) {
        let Self { here, times, ahead, fastest_decay, held, usual, low, next_low, .. } = self;
        if *held == [0; LANES] {
            return;
        }
        for j in 0..LANES {
            let node = here.get(j);
            let time = impacts.roughly_since(j, node.time_in_period, node.residual, ahead[j]);
            let approach_velocity = impacts.approach_velocity(j);
            let largest = node.largest.max(approach_velocity);
            // As in `Perturbations::note_impact`.
            let falls = (approach_velocity < LOW_BOUNCE * largest)
                & ((approach_velocity < node.approach_velocity)
                    | (approach_velocity < LOW_APPROACH * largest));
            let holds = (held[j] == 1)
                & impacts.turns_within(j, time)
                // Well below where the way outside takes steps.
                & (time * fastest_decay[j] < 0.5 * MOST_CONTRACTION)
                & !(falls & (low[j] == 1))
                & SQUARES.contains(&node.square());
            times[j] = time;
            usual[j] = u64::from(holds);
            next_low[j] = u64::from(falls);
        }
    }

    /// The perturbations after the impacts that have been passed over.
    #[inline(always)]
    pub fn map<G: Tip>(&mut self, impacts: &ImpactLanes) {
        let Self { here, times, moves, laws, passed, .. } = self;
        if *passed == [0; LANES] {
            return;
        }
        let [first, second] = impacts.amplitude_changes(times);
        for j in 0..LANES {
            let Some(impact) = impacts.switched(j).filter(|_| passed[j] == 1) else { continue };
            let flight = (times[j], [first[j], second[j]]);
            let (law, kind) = (laws[j], impact.regime.kind());
            let after =
                here.get(j).after_impact::<G>(j, impacts, flight, moves[j], |point, flown| {
                    let (slip, side) = (point.rates.velocities[0], point.angle.sin);
                    point.map_in_regime(
                        flown,
                        law,
                        kind,
                        Signs::of_regime(impact.regime, slip, side),
                    )
                });
            here.set(j, &after);
            passed[j] = 0;
        }
        for j in 0..LANES {
            let flight = (times[j], [first[j], second[j]]);
            let map = |point: &ImpactPoint, flown: &_| point.map_in_slip(flown);
            let after = here.get(j).after_impact::<G>(j, impacts, flight, moves[j], map);
            here.set_if(j, passed[j], &after);
        }
        *passed = [0; LANES];
    }

    /// Whether the next impact in lane `j` is a usual one.
    #[inline(always)]
    pub fn is_usual(&self, j: usize) -> bool {
        self.usual[j] == 1
    }

    /// The motion in lane `j` goes on from this instant after its last impact.
    pub fn go_on(&mut self, j: usize, clock: Clock) {
        if self.held[j] == 1 {
            self.ahead[j] = (clock.period - self.periods[j]) as f64;
        }
    }

    /// Whether the last impact in lane `j` is a low one.
    pub fn is_low(&self, j: usize) -> bool {
        self.low[j] == 1
    }

    /// Passes over the next impact in lane `j`, at this instant; [`Self::map`] follows.
    #[inline(always)]
    pub fn pass(&mut self, j: usize, clock: Clock) {
        self.passed[j] = 1;
        self.low[j] = self.next_low[j];
        if self.low[j] == 1 {
            self.before.set(j, &self.here.get(j));
            self.before_periods[j] = self.periods[j];
        }
        self.impacts[j] += 1;
        (self.periods[j], self.ahead[j]) = (clock.period, 0.0);
    }
}

impl Perturbations<1> {
    /// Whether the perturbation is just after an impact and may travel in a lane.
    fn departs(&self) -> Option<(Departure, f64)> {
        let departure = self.here.departure?;
        let fits = self.here.at_event
            && self.rank() == 1
            && self.orthonormal
            && !self.paused
            && self.reader.mode.is_none()
            && matches!(self.series, Series::High)
            && self.model.system.restitution > 0.0
            && self.model.system.restitution_curve.is_none();
        departure.slope.filter(|_| fits).map(|slope| (departure, slope))
    }

    /// From the impact that was taken last, the perturbation is in lane `j`.
    pub fn enter(&mut self, j: usize, lanes: &mut PerturbationLanes) {
        let Some((departure, slope)) = self.departs() else { return };
        let [[dx1], [dv1], [dv2], [dt]] = *self.here.directions.columns();
        let ([v1, v2], [a1, a2]) = (departure.rates.velocities, departure.rates.accelerations);
        let State { x1, x2, .. } = self.here.state;
        let Clock { time_in_period, residual, .. } = departure.clock;
        let node = Node {
            dx1,
            dv1,
            dv2,
            dt,
            x1,
            v1,
            a1,
            x2,
            v2,
            a2,
            slope,
            time_in_period,
            residual,
            approach_velocity: self.last,
            largest: self.largest,
        };
        lanes.here.set(j, &node);
        lanes.moves[j] = if self.model.wall_at_rest { 0.0 } else { 1.0 };
        lanes.fastest_decay[j] = self.fastest_decay;
        lanes.laws[j] = self.model.system.law;
        (lanes.periods[j], lanes.ahead[j]) = (departure.clock.period, 0.0);
        (lanes.held[j], lanes.usual[j], lanes.low[j], lanes.impacts[j]) = (1, 0, 0, 0);
    }

    /// The perturbation is in lane `j` no more.
    pub fn leave(&mut self, j: usize, lanes: &mut PerturbationLanes) {
        self.read(j, lanes);
        (lanes.held[j], lanes.usual[j]) = (0, 0);
        if std::mem::take(&mut lanes.low[j]) == 1 {
            let node = lanes.before.get(j);
            let mut before = self.here.clone();
            before.take_node(&node, lanes.before_periods[j]);
            self.before = before.clock;
            self.series = Series::Decreasing(Box::new(before), node.approach_velocity);
        }
        // As after each impact outside of the lanes; before the last one the length was not extreme.
        self.here.directions.orthonormalise();
    }

    /// Takes over what lane `j` has, if it has a perturbation.
    pub fn read(&mut self, j: usize, lanes: &mut PerturbationLanes) {
        let impacts = std::mem::take(&mut lanes.impacts[j]);
        if lanes.held[j] == 0 || impacts == 0 {
            return;
        }
        let node = lanes.here.get(j);
        self.here.take_node(&node, lanes.periods[j]);
        (self.last, self.largest) = (node.approach_velocity, node.largest);
        self.impacts += impacts;
    }
}

impl PerturbedState<1> {
    fn take_node(&mut self, node: &Node, period: i64) {
        let Node { x1, v1, x2, v2, time_in_period, residual, .. } = *node;
        self.state = State { x1, v1, x2, v2 };
        self.clock = Clock { period, time_in_period, residual };
        let (rates, slope) = (node.rates(), Some(node.slope));
        self.departure = Some(Departure { clock: self.clock, rates, slope });
        self.directions.set([[node.dx1], [node.dv1], [node.dv2], [node.dt]]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::parameters::System;
    use crate::numerics::cancel::CancelToken;
    use crate::simulate::run::{RunOptions, run};

    #[test]
    fn a_perturbation_that_a_low_impact_makes_very_long_is_shortened_once() {
        let system = System::builder()
            .mass_ratio(0.6)
            .frequency_ratio(2.0)
            .restitution(0.8)
            .gap(0.5)
            .drive_frequency(1.55)
            .moment_amplitude(1.0)
            .build()
            .unwrap();
        let start = State { x1: 0.0, v1: 0.5, x2: 0.0, v2: 0.0 };
        let options = RunOptions::periods(10);
        let end = run(&system, start, options, &CancelToken::never()).unwrap().final_state;
        let mut perturbations = Perturbations::<1>::new(&system, &end, false, true);
        perturbations.series = Series::High;
        let (model, here) = (&perturbations.model, &mut perturbations.here);
        here.at_event = true;
        here.departure = Some(Departure::new(model, &here.state, here.clock, true));
        let [log] = here.directions.logs();

        let mut lanes = PerturbationLanes::default();
        perturbations.enter(0, &mut lanes);
        let node = lanes.here.get(0);
        lanes.before.set(0, &node);
        let [dx1, dv1, dv2, dt] = [node.dx1, node.dv1, node.dv2, node.dt].map(|d| 1e30 * d);
        lanes.here.set(0, &Node { dx1, dv1, dv2, dt, ..node });
        (lanes.low[0], lanes.impacts[0]) = (1, 1);
        perturbations.leave(0, &mut lanes);

        let [longer] = perturbations.here.directions.logs();
        assert!((longer - log - 1e30_f64.ln()).abs() < 1e-12, "{log} {longer}");
        assert!(perturbations.columns().iter().all(|[component]| component.abs() <= 1.0));
        let Series::Decreasing(before, _) = &perturbations.series else {
            panic!("the last impact was low")
        };
        assert_eq!(before.directions.logs(), [log]);
    }
}

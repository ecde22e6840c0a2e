//! Impacts on stops: of one, and of several at one instant.
//!
//! Two stops that are met at one instant, or one that is struck while another is closed, do not see
//! each other if no velocity at the one changes by an impulse at the other. A closed stop j that is
//! pulled off by the impulse at i, n_i M^-1 n_j > 0, opens. Everything else is a question of
//! modelling, which the structure answers by `simultaneous` (docs/structures.md).

use smallvec::SmallVec;

use super::motion::Motion;
use super::touching::{StopStart, Touching};
use crate::contact::closed_stops::impulses;
use crate::impact::{self, ImpactFailure, Regime, StopImpact};
use crate::model::state::{Clock, ModelState};
use crate::model::structure::{Coordinates, Simultaneous, Structure, StructureState};
use crate::numerics::EPS;
use crate::search::tolerances::REST_NOISE;
use crate::simulate::event::StopReason;
use crate::simulate::model::{NotStruck, Struck};
use crate::simulate::tolerances::{MOST_IN_SEQUENCE, SAME_INSTANT};
use crate::simulate::{Anchor, AnchorOf, FlightStart, Phase};

/// Squared sine of an angle between normals below which their stops are nearly one.
const NEARLY_ONE: f64 = 1.0 / 64.0;

/// A stop that touches to rounding, and its rate u.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Near {
    pub stop: u32,
    pub rate: f64,
    /// u is more than rounding: it approaches (> 0), or separates (< 0).
    pub moves: bool,
    /// It does not, or separates more slowly than loads would move it over the rounding of its gap: a
    /// bounce lower than any digit.
    pub stays: bool,
}

impl Motion {
    /// The stops that touch to rounding in this state, whatever the leg says. `before`: the speed
    /// before the impacts of this instant, whose rounding the rates have.
    pub(crate) fn near(
        &self,
        clock: Clock,
        state: &StructureState,
        before: f64,
    ) -> SmallVec<[Near; 4]> {
        let (speed, time) = (self.speed(state), self.time_scale(clock));
        let mut all = SmallVec::new();
        for (index, stop) in self.structure().stops().iter().enumerate() {
            let (apart, size) = self.free.at_least_apart(index, &state.q, speed * time);
            // Most are far away. Of hundreds of terms the sum is off by twice the level.
            if apart > 4.0 * SAME_INSTANT * EPS * size {
                continue;
            }
            let (gap, rate) = self.free.gap(index, clock, &state.q, &state.v);
            let moved = stop.rate_size(speed, 0.0) * time;
            let level = SAME_INSTANT * EPS * stop.gap_size(&state.q);
            if gap.abs() <= level + SAME_INSTANT * EPS * moved {
                let moves = rate.abs() > self.rest(index, clock, speed.max(before));
                let slow = rate < 0.0 && self.is_low(index, &state.q, rate);
                all.push(Near { stop: index as u32, rate, moves, stays: !moves || slow });
            }
        }
        all
    }

    /// Whether a bounce at this rate is lower than any digit: loads would give the structure the rate
    /// over the rounding of the gap alone.
    pub(crate) fn is_low(&self, stop: usize, q: &[f64], rate: f64) -> bool {
        let level = SAME_INSTANT * EPS * self.structure().stops()[stop].gap_size(q);
        rate * rate <= 2.0 * self.loads[stop] * level
    }

    /// The coordinates moved onto all stops that touch to rounding, by the shortest way in the mass
    /// matrix. What rounding leaves between them would not shrink as the bounces in a corner do, and
    /// decide one day which stop is met first.
    pub(super) fn on_stops(&self, clock: Clock, near: &[Near], q: Coordinates) -> Coordinates {
        if near.len() < 2 {
            return q;
        }
        self.moved(near.iter(), q, |stop, q| self.free.gap(stop, clock, q, q).0)
    }

    /// The velocities after the last bounces on all stops where they are lower than any digit, u = 0,
    /// by the impulses there. Without them these stops would be struck with velocities that no row
    /// tells, and give the structure energy.
    fn at_rest(&self, clock: Clock, near: &[Near], stop: u32, pre: &mut StructureState) {
        let slow = near.iter().filter(|at| at.stop != stop && at.stays);
        let rate = |stop: usize, v: &Coordinates| self.free.gap(stop, clock, &pre.q, v).1;
        pre.v = self.moved(slow, pre.v.clone(), rate);
    }

    /// Coordinates or velocities moved by the shortest way in the mass matrix, so that nothing is left
    /// of what is `off` at some stops.
    fn moved<'a>(
        &self,
        near: impl Iterator<Item = &'a Near>,
        mut x: Coordinates,
        off: impl Fn(usize, &Coordinates) -> f64,
    ) -> Coordinates {
        let product = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        let mut ways: SmallVec<[Coordinates; 4]> = SmallVec::new();
        for at in near {
            let stop = at.stop as usize;
            let normal = self.structure().stops()[stop].normal();
            let rows = self.structure().contact(stop);
            let mut way = Coordinates::from_vec(rows.by_normal.clone());
            for other in &ways {
                let part = product(normal, other);
                way.iter_mut().zip(other).for_each(|(way, other)| *way -= part * other);
            }
            let square = product(normal, &way);
            // Between normals of nearly one direction the way could be long.
            if square < NEARLY_ONE * rows.mobilities[0] {
                continue;
            }
            let much = off(stop, &x) / square;
            x.iter_mut().zip(&way).for_each(|(x, way)| *x -= much * way);
            way.iter_mut().for_each(|way| *way /= square.sqrt());
            ways.push(way);
        }
        x
    }

    /// The impact at `stop`, from a state on it that approaches at u, in the leg `before`.
    pub(super) fn strike(
        &self,
        clock: Clock,
        before: &AnchorOf<Structure>,
        mut pre: StructureState,
        near: &[Near],
        stop: u32,
        approach: f64,
    ) -> Result<Struck<Structure>, NotStruck<Structure>> {
        let structure = self.structure();
        let were_held = match before.phase {
            Phase::Contact(mode) => Some(mode),
            _ => before.touching.were_held,
        };
        let before = &before.touching;
        let speed = before.speed.max(self.speed(&pre));
        // An impact of this instant may have pulled some of them off.
        let opens = |stop: u32| near.iter().any(|at| at.stop == stop && at.moves && at.rate < 0.0);
        let mut closed = before.closed();
        closed.retain(|stop| !opens(*stop));
        // Those that approach, too, and those that are pressed by this impact.
        let seen = |other: u32| structure.sees(stop as usize, other as usize);
        let together =
            near.iter().any(|at| at.stop != stop && at.moves && at.rate > 0.0 && seen(at.stop));
        let presses = |other: u32| structure.presses(stop as usize, other as usize);
        let touched = near.iter().filter(|at| at.stop != stop && at.stays).map(|at| at.stop);
        let pressed = closed.iter().copied().chain(touched).any(presses);
        let mut touching = Touching {
            in_sequence: before.in_sequence + 1,
            were_closed: before.closed_before(),
            were_held,
            speed,
            ..before.landed()
        };
        let mut post = pre.clone();
        let first = if together || pressed {
            match structure.simultaneous() {
                Simultaneous::Stop => return Err(NotStruck::Stops(StopReason::Simultaneous, pre)),
                Simultaneous::Sequence => self.strike_one(stop, approach, &pre, &mut post)?,
                Simultaneous::Together => {
                    self.at_rest(clock, near, stop, &mut pre);
                    post.clone_from(&pre);
                    // Between walls without clearance no velocity obeys the rule.
                    let Some(impacts) = self.strike_together(clock, &pre, stop, near, &closed)
                    else {
                        return Err(NotStruck::Stops(StopReason::Simultaneous, pre));
                    };
                    let mut impacts = impacts.into_iter();
                    // A bounce as low as those on stops that have come to rest may have ended with
                    // them: nothing approaches any more.
                    let first = impacts.next().unwrap_or(StopImpact {
                        stop: stop as usize,
                        regime: Regime::Frictionless,
                        approach_velocity: 0.0,
                        separation_velocity: 0.0,
                        impulse_normal: 0.0,
                        impulse_tangential: 0.0,
                        energy_loss: 0.0,
                        friction_loss: 0.0,
                    });
                    touching.pending = impacts.collect();
                    self.push(&first, &mut post);
                    first
                }
            }
        } else {
            self.strike_one(stop, approach, &pre, &mut post)?
        };
        if touching.in_sequence > MOST_IN_SEQUENCE {
            return Err(NotStruck::Stops(StopReason::SequenceCap, pre));
        }
        self.struck(clock, touching, (pre, post), first, together || pressed)
    }

    /// The next impact of an instant at which several stops are struck together.
    pub(super) fn next_pending(
        &self,
        clock: Clock,
        before: &Touching,
        pre: StructureState,
    ) -> Option<Result<Struck<Structure>, NotStruck<Structure>>> {
        let mut touching = before.clone();
        if touching.pending.is_empty() {
            return None;
        }
        let impact = touching.pending.remove(0);
        let mut post = pre.clone();
        self.push(&impact, &mut post);
        Some(self.struck(clock, touching, (pre, post), impact, true))
    }

    /// The leg after an impact from one state to another; `several`: of several stops at one instant.
    fn struck(
        &self,
        clock: Clock,
        mut touching: Touching,
        (pre, post): (StructureState, StructureState),
        impact: StopImpact,
        several: bool,
    ) -> Result<Struck<Structure>, NotStruck<Structure>> {
        if !(post.is_finite()
            && impact.impulse_normal.is_finite()
            && impact.energy_loss.is_finite())
        {
            return Err(NotStruck::NotFinite);
        }
        let stop = impact.stop as u32;
        // A plastic impact that ends in stick is a landing: stick and flight may both be motions.
        let stuck = self.structure().stops()[impact.stop].restitution() == 0.0
            && impact.regime.kind().sticks();
        touching.set(stop, if stuck { StopStart::Stuck } else { StopStart::Touching });
        let post = if stuck { self.on_stop_at_rest(clock, post, impact.stop, true) } else { post };
        let mut strikes = !touching.pending.is_empty();
        let mut lands = stuck;
        let near = self.near(clock, &post, touching.speed);
        if touching.pending.is_empty() {
            // What was still to land at this instant does so, or has been pulled off.
            for (other, start) in &mut touching.at {
                if *other != stop && matches!(start, StopStart::Landed | StopStart::Stuck) {
                    if near.iter().any(|at| at.stop == *other && !at.moves) {
                        lands = true;
                    } else {
                        *start = StopStart::Touching;
                    }
                }
            }
        }
        for Near { stop: other, rate, moves, .. } in near {
            if touching.pending.is_empty() && other != stop && moves && rate > 0.0 {
                strikes = true;
            }
            if touching.of(other).is_none() {
                touching.set(other, StopStart::Touching);
            }
            // All of them, or a sequence, have come to rest there.
            let settles = several || touching.in_sequence > 1;
            if settles && !moves && touching.of(other) != Some(StopStart::Closed) {
                lands = true;
                if touching.of(other) != Some(StopStart::Stuck) {
                    touching.set(other, StopStart::Landed);
                }
            }
        }
        let phase = if strikes {
            Phase::Strike
        } else if touching.closed_before().is_empty() && !lands {
            Phase::Flight(FlightStart::Touching)
        } else {
            // Whether they stay closed.
            Phase::Landing
        };
        if !strikes {
            touching.in_sequence = 0;
        }
        if let Phase::Flight(_) = phase {
            touching.speed = 0.0;
        }
        let leg: AnchorOf<Structure> = Anchor { clock, state: post.clone(), phase, touching };
        let flight = self.leg(&leg, clock, post);
        Ok(Struck { pre, impact, flight, phase, touching: leg.touching })
    }

    fn strike_one(
        &self,
        stop: u32,
        approach: f64,
        pre: &StructureState,
        post: &mut StructureState,
    ) -> Result<StopImpact, NotStruck<Structure>> {
        let struck = impact::strike(self.structure(), stop as usize, approach, &mut post.v);
        struck.map_err(|failure| {
            let reason = match failure {
                ImpactFailure::Jammed => StopReason::Jammed,
                ImpactFailure::LawFailed => StopReason::LawFailed,
            };
            NotStruck::Stops(reason, pre.clone())
        })
    }

    /// v+ = v - M^-1 n P of an impact without friction.
    fn push(&self, impact: &StopImpact, state: &mut StructureState) {
        let rows = self.structure().contact(impact.stop);
        for (v, n) in state.v.iter_mut().zip(&rows.by_normal) {
            *v -= impact.impulse_normal * n;
        }
    }

    /// Impulses P >= 0 of all stops that touch, with u+ + r max(u, 0) <= 0 complementary to them,
    /// u+ = u - W P, W_ij = n_i M^-1 n_j: the impacts with P > 0, from the lowest number on; `None`
    /// where no velocity obeys that.
    fn strike_together(
        &self,
        clock: Clock,
        pre: &StructureState,
        stop: u32,
        near: &[Near],
        closed: &[u32],
    ) -> Option<Vec<StopImpact>> {
        let structure = self.structure();
        let rate = |stop: u32| self.gap(stop as usize, clock, pre).1;
        let mut at: Vec<(u32, f64)> = near
            .iter()
            .filter(|at| at.stop != stop)
            .map(|at| {
                let held = closed.contains(&at.stop) || at.stays;
                (at.stop, if held { 0.0 } else { rate(at.stop) })
            })
            .collect();
        // The search knows that it approaches, also where that is below rounding.
        at.push((stop, rate(stop).max(f64::MIN_POSITIVE)));
        at.sort_by_key(|&(stop, _)| stop);
        let stops: Vec<usize> = at.iter().map(|&(stop, _)| stop as usize).collect();
        let speed = at.iter().fold(0.0f64, |most, (_, u)| most.max(u.abs()));
        let wanted: Vec<(f64, f64)> = at
            .iter()
            .map(|&(i, u)| {
                let before = u.max(0.0);
                let restitution = structure.stops()[i as usize].coefficient().at(before);
                (u + restitution * before, REST_NOISE * EPS * speed)
            })
            .collect();
        let impulses = impulses(structure, &stops, &wanted)?;
        let told = at.iter().zip(&impulses).filter(|(_, p)| **p > 0.0);
        let impacts = told.map(|(&(i, u), &impulse)| {
            let pushed = stops.iter().zip(&impulses);
            let after = pushed.fold(u, |u, (&j, p)| u - structure.mobility(i as usize, j) * p);
            let loss = 0.5 * impulse * (u + after);
            StopImpact {
                stop: i as usize,
                regime: Regime::Frictionless,
                approach_velocity: u,
                separation_velocity: after,
                impulse_normal: impulse,
                impulse_tangential: 0.0,
                energy_loss: loss,
                friction_loss: 0.0,
            }
        });
        Some(impacts.collect())
    }
}

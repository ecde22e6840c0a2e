//! Contacts and impacts of several flights, one in each lane. No branch depends on a lane: a result
//! may be of no use in some lanes, and a flag of the lane says so (1 or 0, as wide as a float).

#![allow(clippy::inline_always)] // a round is compiled for several instruction sets
#![allow(clippy::needless_bitwise_bool)] // conditions without jumps, for the lanes
#![allow(clippy::needless_range_loop)] // loops over lanes read best with their index

mod results;

use super::motions::{Flights, Motions, Systems};
use crate::flight::gap::{change_of, higher_of, scan_start, start_of};
use crate::flight::{BodyFlight, Flight, FreeMotion, state_past};
use crate::impact::{self, Impact, PreImpact};
use crate::model::angle::Angle;
use crate::model::parameters::System;
use crate::model::state::{Clock, State};
use crate::model::tip::Tip;
use crate::model::tolerances::WALL_SLOPE;
use crate::numerics::double_double::DoubleDouble;
use crate::numerics::elementary::{self, MOST_TURNED};
use crate::numerics::lanes::{self, LANES, Lanes};
use crate::search::first_contact::short_time;
use crate::search::gap::{GapBounds, GapBoundsLanes, GapPoint, GapPoints, noise};
use crate::search::scan::{RisingStep, RisingSteps};
use crate::search::steps::ScanStarts;
use crate::search::tolerances::SETTLE_PART;

/// Where the first pass has found a contact.
#[derive(Clone, Copy)]
pub(super) enum Nearby {
    /// On a step.
    On(RisingStep),
    /// Near a local time.
    Near(f64),
}

/// The flights of all lanes, the contacts that end them, the impacts there, and the flights after
/// them.
#[derive(Debug, Clone, Default)]
#[repr(C, align(64))]
pub(crate) struct ImpactLanes {
    systems: Systems,
    flights: Flights,
    rising_steps: RisingSteps,
    /// 1 for a contact on a step; others are near a local time.
    on_step: [u64; LANES],
    near: Lanes,
    evaluations: [u64; LANES],
    start: Lanes,
    start_noise: Lanes,
    bounds: GapBoundsLanes,
    motions: Motions,
    contacts: Contacts,
    impacts: Impacts,
}

/// The contacts of these flights.
#[derive(Debug, Clone, Default)]
#[repr(C, align(64))]
struct Contacts {
    offset: Lanes,
    gaps: GapPoints,
    x1: Lanes,
    v1: Lanes,
    x2: Lanes,
    v2: Lanes,
    /// 1 where the contact is certain and exact.
    certain: [u64; LANES],
}

/// The impacts at these contacts, and the flights after them.
#[derive(Debug, Clone, Default)]
#[repr(C, align(64))]
struct Impacts {
    pre_x1: Lanes,
    pre_x2: Lanes,
    /// Periods that have passed since the start of the flight.
    periods: Lanes,
    flights: Flights,
    v1_post: Lanes,
    v2_post: Lanes,
    approach: Lanes,
    separation: Lanes,
    impulse_approach: Lanes,
    impulse_normal: Lanes,
    impulse_tangential: Lanes,
    energy_loss: Lanes,
    friction_loss: Lanes,
    /// 1 where the state before the impact is usual.
    met: [u64; LANES],
    /// What the scans of the flights after the impacts start from, where the forced motions are
    /// steady.
    scan_starts: ScanStarts,
    /// 1 where the impact is resolved without a switch: no friction, or slip in one direction to
    /// its end.
    unswitched: [u64; LANES],
    /// Impacts of other regimes.
    switched: [Option<Impact>; LANES],
}

impl ImpactLanes {
    /// Sets the system of lane `j`.
    pub fn set_system(&mut self, j: usize, system: &System, motion: &FreeMotion) {
        self.systems.set(j, system, motion);
    }

    /// The present flight of lane `j`, with bounds of its derivatives; `touching`: it started on
    /// the contact.
    #[inline(always)]
    pub fn load<G: Tip>(&mut self, j: usize, flight: &Flight, bounds: &GapBounds, touching: bool) {
        let to = &mut self.flights;
        to.time_in_period[j] = flight.clock.time_in_period;
        to.residual[j] = flight.clock.residual;
        to.angles.set(j, &flight.angle);
        to.phases.set(j, &flight.start);
        to.pendulums.set(j, &flight.pendulum);
        to.oscillators.set(j, &flight.oscillator);
        self.bounds.set(j, bounds);
        (self.start[j], self.start_noise[j]) = if touching {
            (0.0, 0.0)
        } else {
            let (start, size) = start_of::<G>(&flight.state, flight.angle, self.systems.gap[j]);
            (start, noise(size))
        };
    }

    /// The flights after the impacts are the present ones, in lanes for which `which` is 1.
    #[inline(always)]
    pub fn accept(&mut self, which: &[u64; LANES]) {
        let Flights { time_in_period, residual, angles, phases, pendulums, oscillators } =
            &mut self.flights;
        let after = &self.impacts.flights;
        lanes::take(time_in_period, &after.time_in_period, which);
        lanes::take(residual, &after.residual, which);
        angles.take(&after.angles, which);
        phases.take(&after.phases, which);
        pendulums.take(&after.pendulums, which);
        oscillators.take(&after.oscillators, which);
        self.bounds.take(&self.impacts.scan_starts.bounds(), which);
        lanes::take(&mut self.start, &[0.0; LANES], which);
        lanes::take(&mut self.start_noise, &[0.0; LANES], which);
    }

    /// Sets where the first pass has found the contact of lane `j`, after so many evaluations of
    /// the gap.
    #[inline(always)]
    pub(super) fn set_nearby(&mut self, j: usize, nearby: &Nearby, evaluations: u64) {
        match nearby {
            Nearby::On(rising) => {
                self.rising_steps.set(j, rising);
                self.on_step[j] = 1;
            }
            Nearby::Near(near) => (self.near[j], self.on_step[j]) = (*near, 0),
        }
        self.evaluations[j] = evaluations;
    }

    /// Bounds of the present flight of lane `j`.
    #[inline(always)]
    pub fn bounds(&self, j: usize) -> GapBounds {
        self.bounds.get(j)
    }

    /// Both bodies in the present flight of lane `j`.
    #[inline(always)]
    pub fn bodies(&self, j: usize) -> (BodyFlight, BodyFlight) {
        (self.flights.pendulums.get(j), self.flights.oscillators.get(j))
    }

    /// The contacts: the exact motion near each, and the Taylor polynomial from there
    /// (as in src/search/first_contact.rs).
    #[inline(always)]
    pub fn find_contacts<G: Tip>(&mut self) {
        let Self {
            systems, flights, rising_steps, on_step, near, bounds, motions, contacts, ..
        } = self;
        let (start, start_noise) = (&self.start, &self.start_noise);
        let mut undecayed = [0; LANES];
        for j in 0..LANES {
            let rising = rising_steps.get(j);
            let on_step = on_step[j] == 1;
            let at = if on_step { rising.near() } else { near[j] };
            near[j] = short_time(at);
            let decayed = systems.pendulums.get(j).decayed(near[j])
                | systems.oscillators.get(j).decayed(near[j]);
            undecayed[j] = u64::from(!decayed);
        }
        motions.evaluate(systems, flights, near);
        for j in 0..LANES {
            let s = near[j];
            let (pendulum, oscillator) = (systems.pendulums.get(j), systems.oscillators.get(j));
            let (p, o) = motions.get(j, flights);
            let turned = if G::TURNS {
                elementary::turn_within(p.increment, 0.0)
            } else {
                elementary::STRAIGHT
            };
            let (change, angle) = change_of::<G>(flights.angles.get(j), turned, &(p, o));
            let gap = GapPoint { value: start[j] + change.value, ..change };
            let higher = higher_of::<G>((&pendulum, &oscillator), angle, &(p, o));
            let (offset, holds) = gap.rise_by_series(higher);
            let limits = bounds.get(j);
            let left = limits.remainder(offset);
            let level = start_noise[j] + limits.noise((s + offset).max(0.0));
            let later = gap.later(offset);
            let certain = (undecayed[j] == 1)
                & holds
                & (s + offset >= 0.0)
                & (left <= SETTLE_PART * level)
                & (later.rate > 0.0)
                & (p.increment.abs() <= MOST_TURNED);
            contacts.offset[j] = offset;
            contacts.gaps.set(j, &later);
            (contacts.x1[j], contacts.v1[j]) = pendulum.later(&p, offset);
            (contacts.x2[j], contacts.v2[j]) = oscillator.later(&o, offset);
            contacts.certain[j] = u64::from(certain);
        }
    }

    /// The impacts (as in src/simulate/flight.rs).
    #[inline(always)]
    pub fn resolve<G: Tip>(&mut self) {
        let Self { systems, contacts, impacts, .. } = self;
        let after = &mut impacts.flights;
        for j in 0..LANES {
            let angle = |x1: f64| {
                let (sin, cos) =
                    if G::TURNS { elementary::sin_cos_within(x1, 0.0) } else { (0.0, 1.0) };
                Angle { sin, cos }
            };
            let (x1, x2, gap) = (contacts.x1[j], contacts.x2[j], systems.gap[j]);
            let (mass_ratio, restitution) = (systems.mass_ratio[j], systems.restitution[j]);
            let friction = systems.friction[j];
            // The state is moved onto the contact.
            let before = angle(x1);
            let tip = G::position(x1, before);
            let on_wall = (mass_ratio == 0.0) & (before.cos.abs() > WALL_SLOPE);
            let x1 = if on_wall { x1 - (tip - x2 - gap) / before.cos } else { x1 };
            let x2 = if on_wall { x2 } else { tip - gap };
            let angle = angle(x1);
            let Angle { sin, cos } = angle;
            let pre = PreImpact { cos, sin, v1: contacts.v1[j], v2: contacts.v2[j] };
            let contact = pre.coordinates(mass_ratio, friction);
            let (impact, without_switch) = impact::resolve_without_switch(&contact, restitution);
            let met = (impact.approach_velocity > 0.0)
                & (on_wall | (mass_ratio > 0.0))
                & (x1.abs() <= MOST_TURNED);
            let unswitched = without_switch & impact.is_finite();
            (impacts.pre_x1[j], impacts.pre_x2[j]) = (x1, x2);
            after.angles.set(j, &angle);
            impacts.v1_post[j] = impact.slip;
            impacts.v2_post[j] = impact.parting;
            impacts.approach[j] = impact.approach_velocity;
            impacts.separation[j] = impact.separation_velocity;
            impacts.impulse_approach[j] = impact.impulse_approach;
            impacts.impulse_normal[j] = impact.impulse_normal;
            impacts.impulse_tangential[j] = impact.impulse_tangential;
            impacts.energy_loss[j] = impact.energy_loss;
            impacts.friction_loss[j] = impact.friction_loss;
            impacts.met[j] = u64::from(met);
            impacts.unswitched[j] = u64::from(met & unswitched);
        }
    }

    /// Whether the impact in lane `j` is of another regime, to be resolved by itself: the state
    /// before it.
    #[inline(always)]
    pub fn switches(&mut self, j: usize) -> Option<PreImpact> {
        let Self { contacts, impacts, .. } = self;
        impacts.switched[j] = None;
        let switches =
            contacts.certain[j] == 1 && impacts.met[j] == 1 && impacts.unswitched[j] == 0;
        switches.then(|| self.pre_impact(j))
    }

    /// Sets the impact in lane `j`.
    pub fn set_switched(&mut self, j: usize, impact: &Impact) {
        if impact.is_finite() {
            self.impacts.v1_post[j] = impact.v1_post;
            self.impacts.v2_post[j] = impact.v2_post;
            self.impacts.switched[j] = Some(*impact);
        }
    }

    /// The flights after the impacts.
    #[inline(always)]
    pub fn start_flights<G: Tip>(&mut self) {
        let Self { systems, flights, near, contacts, impacts, .. } = self;
        let after = &mut impacts.flights;
        for j in 0..LANES {
            let drive = systems.drives.get(j);
            let start = DoubleDouble { hi: flights.time_in_period[j], lo: flights.residual[j] };
            let time = DoubleDouble::sum(near[j], contacts.offset[j]) + start;
            let (wrapped, passed) = drive.wrapped(time);
            let holds = drive.holds(time);
            let time = DoubleDouble {
                hi: if holds { time.hi } else { wrapped.hi },
                lo: drive.ticked(if holds { time.lo } else { wrapped.lo }),
            };
            impacts.periods[j] = if holds { 0.0 } else { passed };
            let clock = Clock { period: 0, time_in_period: time.hi, residual: time.lo };
            let phase = drive.trig_at(clock);
            (after.time_in_period[j], after.residual[j]) = (time.hi, time.lo);
            after.phases.set(j, &phase);
            let (pendulum, oscillator) = (systems.pendulums.get(j), systems.oscillators.get(j));
            let (x1, x2) = (impacts.pre_x1[j], impacts.pre_x2[j]);
            after.pendulums.set(j, &pendulum.steady_flight(x1, impacts.v1_post[j], phase));
            after.oscillators.set(j, &oscillator.steady_flight(x2, impacts.v2_post[j], phase));
        }
        let Flights { angles, phases, pendulums, oscillators, .. } = after;
        let Impacts { pre_x1, pre_x2, v1_post, v2_post, scan_starts, .. } = impacts;
        for j in 0..LANES {
            let equations = (&systems.pendulums.get(j), &systems.oscillators.get(j));
            let bounds = (
                equations.0.steady_bounds(&pendulums.get(j)),
                equations.1.steady_bounds(&oscillators.get(j)),
            );
            let state = State { x1: pre_x1[j], v1: v1_post[j], x2: pre_x2[j], v2: v2_post[j] };
            let (angle, cos_psi) = (angles.get(j), phases.cos[j]);
            let scan_start =
                scan_start::<G>(equations, systems.gap[j], &state, angle, cos_psi, bounds);
            scan_starts.set(j, &scan_start);
        }
        systems.beats[0].start(&systems.pendulums, pre_x1, v1_post, phases, pendulums);
        systems.beats[1].start(&systems.oscillators, pre_x2, v2_post, phases, oscillators);
    }

    /// Local times near the contacts.
    pub fn near(&self) -> &Lanes {
        &self.near
    }

    /// States at a local time of each flight, at which no free motion has decayed.
    #[inline(always)]
    pub fn pass(&mut self, times: &Lanes) {
        let Self { systems, flights, motions, .. } = self;
        motions.evaluate(systems, flights, times);
    }

    /// The state of lane `j`, this much after the last of these times.
    #[inline(always)]
    pub fn state(&self, j: usize, rest: f64) -> State {
        state_past(&self.motions.get(j, &self.flights), rest)
    }
}

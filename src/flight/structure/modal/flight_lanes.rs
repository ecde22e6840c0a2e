//! Flights of several structures at once, one in each lane, whose modes all swing and answer the
//! drive with their steady response. No branch depends on a lane: a result may be of no use in some
//! lanes, and a flag of the lane says so (1 or 0, as wide as a float).
//!
//! The operations are those of a single flight (modal.rs, begins.rs, fours.rs, search.rs,
//! stop_gap.rs), and so are the bits.

#![allow(clippy::inline_always)] // what calls them is compiled for several instruction sets
#![allow(clippy::needless_bitwise_bool)] // conditions without jumps, for the lanes
#![allow(clippy::needless_range_loop)] // loops over lanes read best with their index

mod search;

use self::search::StopSearch;
pub(crate) use self::search::{Looked, Met};
use super::begins::{BOUNDED, Begins, guess_when_apart, guess_when_touching};
use super::{FEW, ModalFlight, ModalMotion};
use crate::flight::drive::{Drives, Trigs, Turn, turn_within};
use crate::flight::oscillator::{BodyFlights, Equations, Motion, MotionLanes, SeriesLanes};
use crate::flight::structure::{Flights, Motions, StructureFlight, StructureMotion};
use crate::model::state::Clock;
use crate::numerics::double_double::DoubleDouble;
use crate::numerics::elementary::decay_minus_1;
use crate::numerics::lanes::{LANES, Lanes};
use crate::search::first_contact::{Start, short_time};
use crate::search::gap::{GapBoundsLanes, GapPoint, Higher};
use crate::search::tolerances::SETTLE_PART;

/// Stops at most, so that they are one group.
const MOST_STOPS: usize = LANES;

/// What all structures of one batch have in common.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Shape {
    modes: usize,
    stops: usize,
}

impl Shape {
    /// That of a structure whose usual flights lanes can hold: few modes, which all swing, under a
    /// drive that turns; few stops, all at rest.
    pub fn of(motion: &StructureMotion) -> Option<Self> {
        let Motions::Modal(modal) = &motion.motion else { return None };
        let (modes, stops) = (modal.modes.len(), modal.stops.len());
        let swings = modal.modes.iter().all(|mode| mode.oscillator.swings_from().is_finite());
        let rest = modal.stops.iter().all(|stop| stop.amplitude == 0.0);
        let turns = modal.drive.has_period() && modal.longest.is_finite();
        let few = (1..=FEW).contains(&modes) && (1..=MOST_STOPS).contains(&stops);
        (few && swings && rest && turns && !modal.grows).then_some(Self { modes, stops })
    }
}

/// The flights of all lanes, the contacts that end them, and the flights after those.
#[derive(Default)]
#[repr(C, align(64))]
pub(crate) struct FlightLanes {
    shape: Shape,
    drives: Drives,
    modes: [ModeLanes; FEW],
    stops: [StopLanes; MOST_STOPS],
    searches: [StopSearch; LANES],
    /// What a contact is found from: a time near it; n . phi of the stop's modes, the bounds of its
    /// gap, where that begins, and its rounding there.
    near: Lanes,
    parts: [Lanes; FEW],
    bounds: GapBoundsLanes,
    start: Lanes,
    start_noise: Lanes,
    offset: Lanes,
    /// 1 where that contact is certain and exact.
    certain: [u64; LANES],
    /// Local times of states, in two parts.
    time: Lanes,
    rest: Lanes,
    /// 1 where the last motions are of use.
    usual: [u64; LANES],
    /// Clocks and states: at the contacts, and from which the next flights start.
    time_in_period: Lanes,
    residual: Lanes,
    q: [Lanes; FEW],
    v: [Lanes; FEW],
}

/// One mode of each structure.
#[derive(Default)]
#[repr(C, align(64))]
struct ModeLanes {
    equations: Equations,
    /// The argument of the drive's complex amplitude.
    ahead: Trigs,
    /// M phi and phi by coordinate.
    row: [[Lanes; 2]; FEW],
    shape: [Lanes; FEW],
    phases: Trigs,
    bodies: BodyFlights,
    series: SeriesLanes,
    motions: MotionLanes,
    /// Displacement at the contact.
    met: Lanes,
}

/// One stop of each structure.
#[derive(Default)]
#[repr(C, align(64))]
struct StopLanes {
    /// n . phi of each mode.
    parts: [Lanes; FEW],
    gap: Lanes,
    /// |gap|.
    size: Lanes,
    /// How its gap begins, in each lane.
    begins: Begins,
    /// When it is met, as far as that tells, by a flight that begins apart from it, or on it.
    guess_apart: Lanes,
    guess_touching: Lanes,
}

/// What one mode of each structure begins with.
#[derive(Default)]
#[repr(C, align(64))]
struct ModeBegins {
    x: Lanes,
    derivatives: [Lanes; 5],
    bounds: [Lanes; BOUNDED.len()],
}

impl ModeLanes {
    /// (M phi) . x, as for one structure (fours.rs).
    #[inline(always)]
    fn coordinates(&self, x: &[Lanes]) -> Lanes {
        let (mut sum, mut rest) = ([0.0; LANES], [0.0; LANES]);
        for ([row, lower], x) in self.row.iter().zip(x) {
            for j in 0..LANES {
                let product = DoubleDouble::product(row[j], x[j]);
                let added = DoubleDouble::sum(sum[j], product.hi);
                sum[j] = added.hi;
                rest[j] += added.lo + (product.lo + lower[j] * x[j]);
            }
        }
        for j in 0..LANES {
            sum[j] += rest[j];
        }
        sum
    }

    #[inline(always)]
    fn motion(&self, j: usize) -> Motion {
        let mut motion = self.motions.get(j);
        motion.place_after(self.bodies.x[j]);
        motion
    }

    /// Displacements, derivatives and bounds at the starts.
    #[inline(always)]
    fn begin(&self, begins: &mut ModeBegins) {
        begins.x = self.bodies.x;
        for j in 0..LANES {
            let (equation, body) = (self.equations.get(j), self.bodies.get(j));
            let turn = Turn::new(self.phases.get(j), 0.0, 0.0);
            let motion = equation.motion_from(0.0, body.v, [body.x, 0.0], &turn);
            let [fourth, fifth, _] = equation.higher(&motion);
            let bounds = equation.steady_bounds(&body);
            let derivatives = [motion.rate, motion.acceleration, motion.jerk, fourth, fifth];
            for k in 0..derivatives.len() {
                begins.derivatives[k][j] = derivatives[k];
            }
            for k in 0..BOUNDED.len() {
                begins.bounds[k][j] = bounds[usize::from(BOUNDED[k]) - 1];
            }
        }
    }
}

impl StopLanes {
    /// How the gap begins in all lanes.
    #[inline(always)]
    fn begin(&mut self, modes: &[ModeBegins]) {
        let Self { parts, gap, size, begins, guess_apart, guess_touching } = self;
        let (mut value, mut sizes) = ([0.0; LANES], *size);
        for j in 0..LANES {
            value[j] = -gap[j];
        }
        for (mode, part) in modes.iter().zip(&*parts) {
            for j in 0..LANES {
                value[j] += part[j] * mode.x[j];
                sizes[j] += (part[j] * mode.x[j]).abs();
            }
        }
        (begins.value, begins.size) = (value, sizes);
        for k in 0..begins.derivatives.len() {
            let mut sum = [0.0; LANES];
            for (mode, part) in modes.iter().zip(&*parts) {
                for j in 0..LANES {
                    sum[j] += part[j] * mode.derivatives[k][j];
                }
            }
            begins.derivatives[k] = sum;
        }
        for k in 0..BOUNDED.len() {
            let mut sum = [0.0; LANES];
            for (mode, part) in modes.iter().zip(&*parts) {
                for j in 0..LANES {
                    sum[j] += part[j].abs() * mode.bounds[k][j];
                }
            }
            begins.bounds[k] = sum;
        }
        let [rate, second, ..] = &begins.derivatives;
        for j in 0..LANES {
            guess_apart[j] = guess_when_apart(begins.value[j], rate[j], second[j]);
            guess_touching[j] = guess_when_touching(rate[j], second[j]);
        }
    }
}

/// A flight by modes, and its structure's motion.
#[inline(always)]
fn by_modes<'a>(
    motion: &'a StructureMotion,
    flight: &'a StructureFlight,
) -> Option<(&'a ModalMotion, &'a ModalFlight)> {
    match (&motion.motion, &flight.flight) {
        (Motions::Modal(motion), Flights::Modal(flight)) => Some((motion, flight)),
        _ => None,
    }
}

impl FlightLanes {
    /// Modes, and coordinates, at most.
    pub const MOST_MODES: usize = FEW;

    /// Sets the structure of lane `j`.
    pub fn set(&mut self, j: usize, motion: &StructureMotion) {
        let Some(shape) = Shape::of(motion) else { return };
        let Motions::Modal(modal) = &motion.motion else { return };
        self.shape = shape;
        self.drives.set(j, &modal.drive);
        for ((lanes, mode), of) in
            self.modes.iter_mut().zip(&modal.modes).zip(motion.structure.modes())
        {
            lanes.equations.set(j, &mode.oscillator.equation);
            lanes.ahead.set(j, &mode.ahead);
            for c in 0..shape.modes {
                let [row, lower] = &mut lanes.row[c];
                (row[j], lower[j]) = (of.row[c].hi, of.row[c].lo);
                lanes.shape[c][j] = of.shape[c];
            }
        }
        for (lanes, stop) in self.stops.iter_mut().zip(&modal.stops) {
            for (part, &of) in lanes.parts.iter_mut().zip(&stop.row) {
                part[j] = of;
            }
            (lanes.gap[j], lanes.size[j]) = (stop.gap, stop.gap.abs());
        }
    }

    /// The present flight of lane `j`; whether it is one by modes.
    #[inline(never)]
    pub fn load(&mut self, j: usize, motion: &StructureMotion, flight: &StructureFlight) -> bool {
        let Some((modal, flight)) = by_modes(motion, flight) else { return false };
        for (i, lanes) in self.modes.iter_mut().enumerate().take(self.shape.modes) {
            lanes.phases.set(j, &flight.phases[i]);
            lanes.bodies.set(j, &flight.modes[i]);
        }
        let begins = modal.begins(flight, &modal.mode_begins(flight), 0);
        for (stop, lanes) in self.stops.iter_mut().enumerate().take(self.shape.stops) {
            lanes.begins.copy_lane(j, &begins, stop);
            let begin = begins.get(stop);
            lanes.guess_apart[j] = begin.guess(Start::Apart);
            lanes.guess_touching[j] = begin.guess(Start::Touching);
        }
        true
    }

    /// The state at the contact of lane `j`, q and q', or that from which its next flight starts.
    #[inline(always)]
    pub fn state(&self, j: usize) -> ([f64; FEW], [f64; FEW]) {
        (self.q.map(|q| q[j]), self.v.map(|v| v[j]))
    }

    /// Whether that is of use.
    #[inline(always)]
    pub fn is_usual(&self, j: usize) -> bool {
        self.usual[j] == 1
    }

    /// Sets from where the next flight of lane `j` starts.
    #[inline(always)]
    pub fn set_state(&mut self, j: usize, clock: Clock, (q, v): (&[f64; FEW], &[f64; FEW])) {
        (self.time_in_period[j], self.residual[j]) = (clock.time_in_period, clock.residual);
        for c in 0..FEW {
            (self.q[c][j], self.v[c][j]) = (q[c], v[c]);
        }
    }

    /// Writes the flight of lane `j`, which starts at this clock, over another of its structure.
    #[inline(always)]
    pub fn store(
        &self,
        j: usize,
        motion: &StructureMotion,
        clock: Clock,
        flight: &mut StructureFlight,
    ) {
        flight.clock = clock;
        let (Motions::Modal(modal), Flights::Modal(flight)) = (&motion.motion, &mut flight.flight)
        else {
            return;
        };
        flight.since = modal.drive.time(clock);
        let to = flight.modes.iter_mut().zip(&mut flight.phases);
        for (lanes, (body, phase)) in self.modes.iter().zip(to) {
            (*body, *phase) = (lanes.bodies.get(j), lanes.phases.get(j));
        }
    }

    /// The motions of all modes at a local time of each flight.
    #[inline(always)]
    fn evaluate(&mut self, times: &Lanes) {
        let Self { shape, drives, modes, usual, .. } = self;
        let modes = &mut modes[..shape.modes];
        // Of a structure's modes all have the order that the fastest of those needs.
        let (mut orders, mut most) = ([0.0f64; LANES], 0);
        for mode in &*modes {
            for j in 0..LANES {
                let short = mode.equations.short[j];
                if short > 0.0 && times[j] <= short {
                    let order = mode.equations.get(j).series_order(times[j]);
                    (orders[j], most) = (orders[j].max(order as f64), most.max(order));
                }
            }
        }
        let (mut cos_minus_1, mut sin) = ([0.0; LANES], [0.0; LANES]);
        for j in 0..LANES {
            let omega = DoubleDouble::new(drives.omega[j]);
            (cos_minus_1[j], sin[j]) = turn_within(omega, times[j]);
        }
        *usual = [1; LANES];
        for mode in modes {
            let ModeLanes { equations, phases, bodies, series, motions, .. } = mode;
            series.sum_to(equations, bodies, phases, times, (&orders, most));
            let (mut own_cos, mut own_sin, mut change) = ([0.0; LANES], [0.0; LANES], [0.0; LANES]);
            for j in 0..LANES {
                (own_cos[j], own_sin[j]) = turn_within(equations.get(j).damped, times[j]);
            }
            for j in 0..LANES {
                change[j] = decay_minus_1(-equations.decay_rate[j] * times[j]);
            }
            for j in 0..LANES {
                let (equation, body, s) = (equations.get(j), bodies.get(j), times[j]);
                let turn = Turn::new(phases.get(j), cos_minus_1[j], sin[j]);
                let swung = equation.swung(&body, change[j], (own_cos[j], own_sin[j]), &turn);
                let is_short = s <= equation.short;
                let increment = if is_short { series.increment[j] } else { swung.0 };
                let rate = if is_short { series.rate[j] } else { swung.1 };
                let motion = equation.motion_from(increment, rate, [body.x, increment], &turn);
                motions.set(j, &motion);
                let finite = increment.is_finite() & rate.is_finite();
                usual[j] &= u64::from(finite & !equation.decayed(s));
            }
        }
    }

    /// The contacts near what the scans have found: the exact motion there, and the Taylor
    /// polynomial of the gap (src/search/first_contact.rs).
    #[inline(always)]
    pub fn find_contacts(&mut self) {
        for j in 0..LANES {
            self.near[j] = short_time(self.near[j]);
        }
        let times = self.near;
        self.evaluate(&times);
        let Self {
            shape, modes, parts, bounds, start, start_noise, offset, certain, usual, ..
        } = self;
        let mut sums = [[0.0; LANES]; 6];
        for (mode, part) in modes[..shape.modes].iter().zip(&*parts) {
            for j in 0..LANES {
                let motion = mode.motion(j);
                let [fourth, fifth, _] = mode.equations.get(j).higher(&motion);
                let Motion { increment, rate, acceleration, jerk, .. } = motion;
                let terms = [increment, rate, acceleration, jerk, fourth, fifth];
                for k in 0..terms.len() {
                    sums[k][j] += part[j] * terms[k];
                }
            }
        }
        for j in 0..LANES {
            let s = times[j];
            let [change, rate, second, third, fourth, fifth] = sums.map(|sum| sum[j]);
            let gap = GapPoint { value: start[j] + change, rate, second, third };
            let (by, holds) = gap.rise_by_series(Higher { fourth, fifth });
            let limits = bounds.get(j);
            let left = limits.remainder(by);
            let level = start_noise[j] + limits.noise((s + by).max(0.0));
            let exact = (usual[j] == 1)
                & (s > 0.0)
                & holds
                & (s + by >= 0.0)
                & (left <= SETTLE_PART * level)
                & (gap.later(by).rate > 0.0);
            offset[j] = by;
            certain[j] = u64::from(exact);
        }
    }

    /// The states at the contacts.
    #[inline(always)]
    pub fn find_states(&mut self) {
        let times = self.time;
        self.evaluate(&times);
        let Self { shape, modes, rest, q, v, .. } = self;
        let count = shape.modes;
        (*q, *v) = Default::default();
        for mode in &mut modes[..count] {
            let (mut place, mut rate) = ([0.0; LANES], [0.0; LANES]);
            for j in 0..LANES {
                (place[j], rate[j]) = mode.equations.get(j).later(&mode.motion(j), rest[j]);
            }
            for c in 0..count {
                for j in 0..LANES {
                    q[c][j] += mode.shape[c][j] * place[j];
                    v[c][j] += mode.shape[c][j] * rate[j];
                }
            }
            mode.met = place;
        }
    }

    /// The flights from the clocks and states.
    #[inline(always)]
    pub fn start(&mut self) {
        let Self { shape, drives, modes, stops, time_in_period, residual, q, v, .. } = self;
        let count = shape.modes;
        let mut starts = Trigs::default();
        for j in 0..LANES {
            let (time_in_period, residual) = (time_in_period[j], residual[j]);
            let clock = Clock { period: 0, time_in_period, residual };
            starts.set(j, &drives.get(j).trig_at(clock));
        }
        let mut begins: [ModeBegins; FEW] = Default::default();
        for (mode, begins) in modes[..count].iter_mut().zip(&mut begins) {
            let (x, v) = (mode.coordinates(&q[..count]), mode.coordinates(&v[..count]));
            for j in 0..LANES {
                let phase = starts.get(j).turned_by(mode.ahead.get(j));
                mode.phases.set(j, &phase);
                mode.bodies.set(j, &mode.equations.get(j).steady_flight(x[j], v[j], phase));
            }
            mode.begin(begins);
        }
        for stop in &mut stops[..shape.stops] {
            stop.begin(&begins[..count]);
        }
    }
}

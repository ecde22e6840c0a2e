//! How the gaps of all stops begin along a flight: their derivatives and bounds, eight stops at a
//! time, from those of the modes.

#![allow(clippy::inline_always)] // what calls them is compiled for several instruction sets
#![allow(clippy::needless_range_loop)] // loops over lanes read best with their index

use smallvec::SmallVec;

use super::{FEW, ModalFlight, ModalMotion};
use crate::flight::drive::{Trig, Turn};
use crate::flight::structure::StopMotion;
use crate::numerics::lanes::{LANES, Lanes};
use crate::search::first_contact::Start;
use crate::search::gap::{GapBounds, GapPoint, Higher};
use crate::search::tolerances::{BOUND_MARGIN, SCAN_SLACK};

/// Derivatives of a gap that are bounded.
pub(super) const BOUNDED: [u8; 4] = [1, 4, 5, 6];

/// Eight stops, or fewer and zeros.
#[derive(Debug, Clone, Default)]
#[repr(align(64))]
pub(super) struct StopGroup {
    gap: Lanes,
    /// |gap| + |A|.
    size: Lanes,
    /// Bounds of the stop's own motion.
    bounds: [Lanes; BOUNDED.len()],
    moves: bool,
    /// n . phi of each mode.
    parts: Vec<Lanes>,
}

/// What the gaps of a group begin with.
#[derive(Debug, Clone, Default)]
#[repr(align(64))]
pub(super) struct Begins {
    pub value: Lanes,
    pub size: Lanes,
    pub derivatives: [Lanes; 5],
    pub bounds: [Lanes; BOUNDED.len()],
}

/// What one gap begins with.
#[derive(Debug, Clone, Copy)]
pub(super) struct Begin {
    pub value: f64,
    /// Sum of the sizes of its terms.
    pub size: f64,
    /// With an increment of 0 as the value.
    pub point: GapPoint,
    pub higher: Higher,
    pub bounds: GapBounds,
}

/// What a mode begins with.
#[derive(Clone, Copy)]
pub(super) struct ModeBegin {
    x: f64,
    derivatives: [f64; 5],
    bounds: [f64; BOUNDED.len()],
}

impl StopGroup {
    /// All stops.
    pub fn all(stops: &[StopMotion]) -> Vec<Self> {
        stops
            .chunks(LANES)
            .map(|stops| {
                let modes = stops[0].row.len();
                let mut group = Self { parts: vec![[0.0; LANES]; modes], ..Self::default() };
                for (j, stop) in stops.iter().enumerate() {
                    group.gap[j] = stop.gap;
                    group.size[j] = stop.gap.abs() + stop.amplitude.abs();
                    group.moves |= stop.amplitude != 0.0;
                    for (bound, order) in group.bounds.iter_mut().zip(BOUNDED) {
                        bound[j] = stop.amplitude.abs() * stop.drive.omega.powi(order.into());
                    }
                    for (part, &of) in group.parts.iter_mut().zip(&stop.row) {
                        part[j] = of;
                    }
                }
                group
            })
            .collect()
    }
}

impl ModalMotion {
    /// What the modes begin with.
    #[inline(always)]
    pub(super) fn mode_begins(&self, flight: &ModalFlight) -> SmallVec<[ModeBegin; FEW]> {
        let mut begins = SmallVec::with_capacity(self.modes.len());
        for i in 0..self.modes.len() {
            let (oscillator, body) = (&self.modes[i].oscillator, &flight.modes[i]);
            let turn = Turn::new(flight.phases[i], 0.0, 0.0);
            let motion = oscillator.equation.motion_from(0.0, body.v, [body.x, 0.0], &turn);
            let [fourth, fifth, _] = oscillator.equation.higher(&motion);
            let mut bounds = oscillator.derivative_bounds(body);
            bounds[0] += oscillator.speed_of_rounding(body);
            begins.push(ModeBegin {
                x: body.x,
                derivatives: [motion.rate, motion.acceleration, motion.jerk, fourth, fifth],
                bounds: BOUNDED.map(|order| bounds[usize::from(order) - 1]),
            });
        }
        begins
    }

    /// What the gaps of a group of stops begin with.
    #[inline(always)]
    pub(super) fn begins(&self, flight: &ModalFlight, modes: &[ModeBegin], group: usize) -> Begins {
        let stops = &self.groups[group];
        let mut begins = Begins { size: stops.size, bounds: stops.bounds, ..Begins::default() };
        for j in 0..LANES {
            begins.value[j] = -stops.gap[j];
        }
        if stops.moves {
            let first = group * LANES;
            let last = (first + LANES).min(self.stops.len());
            for stop in first..last {
                let (own, j) = (&self.stops[stop], stop - first);
                begins.value[j] -= own.amplitude * flight.stops[stop].cos;
                let [_, derivatives @ ..] = own.motion(flight.stops[stop], (0.0, 0.0));
                for (sum, term) in begins.derivatives.iter_mut().zip(derivatives) {
                    sum[j] = -term;
                }
            }
        }
        // Sum by sum, each of which compilers keep in whole registers.
        let terms = || modes.iter().zip(&stops.parts);
        let (mut value, mut size) = (begins.value, begins.size);
        for (mode, parts) in terms() {
            for j in 0..LANES {
                value[j] += parts[j] * mode.x;
                size[j] += (parts[j] * mode.x).abs();
            }
        }
        (begins.value, begins.size) = (value, size);
        for k in 0..begins.derivatives.len() {
            let mut sum = begins.derivatives[k];
            for (mode, parts) in terms() {
                let by = mode.derivatives[k];
                for j in 0..LANES {
                    sum[j] += parts[j] * by;
                }
            }
            begins.derivatives[k] = sum;
        }
        for k in 0..BOUNDED.len() {
            let mut sum = begins.bounds[k];
            for (mode, parts) in terms() {
                let by = mode.bounds[k];
                for j in 0..LANES {
                    sum[j] += parts[j].abs() * by;
                }
            }
            begins.bounds[k] = sum;
        }
        begins
    }
}

impl Begins {
    /// Copies one of other gaps.
    pub fn copy_lane(&mut self, j: usize, others: &Self, other: usize) {
        (self.value[j], self.size[j]) = (others.value[other], others.size[other]);
        let ours = self.derivatives.iter_mut().chain(&mut self.bounds);
        for (own, others) in ours.zip(others.derivatives.iter().chain(&others.bounds)) {
            own[j] = others[other];
        }
    }

    #[inline(always)]
    pub fn get(&self, j: usize) -> Begin {
        let [rate, second, third, fourth, fifth] = &self.derivatives;
        let [first_bound, fourth_bound, fifth_bound, sixth_bound] = &self.bounds;
        Begin {
            value: self.value[j],
            size: self.size[j],
            point: GapPoint { value: 0.0, rate: rate[j], second: second[j], third: third[j] },
            higher: Higher { fourth: fourth[j], fifth: fifth[j] },
            bounds: GapBounds {
                slope_noise: 0.0,
                rate: first_bound[j],
                fourth: fourth_bound[j] * BOUND_MARGIN,
                fifth: fifth_bound[j],
                sixth: sixth_bound[j],
            },
        }
    }
}

/// When a gap that begins so rises to 0, were its acceleration to last.
#[inline(always)]
pub(super) fn guess_when_apart(value: f64, rate: f64, second: f64) -> f64 {
    let height = rate * rate - 2.0 * second * value;
    let speed = rate + (if height > 0.0 { height } else { 0.0 }).sqrt();
    if speed > 0.0 { -2.0 * value / speed } else { f64::INFINITY }
}

/// The same of a gap that begins at 0.
#[inline(always)]
pub(super) fn guess_when_touching(rate: f64, second: f64) -> f64 {
    if second > 0.0 { -2.0 * rate / second } else { f64::INFINITY }
}

impl Begin {
    /// About when the stop is met, were the acceleration of its gap to last: the order in which
    /// stops are looked at.
    #[inline(always)]
    pub fn guess(&self, start: Start) -> f64 {
        let GapPoint { rate, second, .. } = self.point;
        match start {
            Start::Apart => guess_when_apart(self.value, rate, second),
            Start::Touching => guess_when_touching(rate, second),
            Start::Grazed(_) | Start::Released => 0.0,
        }
    }

    /// Whether the stop is certainly not met up to a time within the span: by the Taylor polynomial
    /// with its remainder, of which no more than what rises is taken.
    #[inline(always)]
    pub fn stays_apart(&self, until: f64, span: f64) -> bool {
        let GapPoint { rate, second, third, .. } = self.point;
        let third = third / 6.0 + self.bounds.fourth / 24.0 * until;
        let second = 0.5 * second + third.max(0.0) * until;
        let rate = rate + second.max(0.0) * until;
        let slack = SCAN_SLACK * (self.size + self.bounds.rate * span);
        // Of a NaN nothing is certain.
        let rises = rate.max(0.0) * until;
        self.bounds.fourth.is_finite() && self.value + rises < -slack
    }
}

impl StopMotion {
    /// Derivatives 0 to 5 of the stop's motion A cos, its value as the increment from the start;
    /// `turned`: (cos - 1, sin) of what it has turned since.
    #[inline(always)]
    pub(super) fn motion(&self, start: Trig, turned: (f64, f64)) -> [f64; 6] {
        let Self { amplitude, drive, .. } = self;
        if *amplitude == 0.0 {
            return [0.0; 6];
        }
        let (c1, sin) = turned;
        let Trig { cos, sin: sin_psi } = Turn::new(start, c1, sin).phase;
        let (w, a) = (drive.omega, *amplitude);
        let increment = a * (start.cos * c1 - start.sin * sin);
        let (even, odd) = (a * w * w * cos, a * w * sin_psi);
        [increment, -odd, -even, odd * w * w, even * w * w, -odd * w.powi(4)]
    }
}

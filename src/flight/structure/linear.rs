//! Exact motion of a linear structure under any damping, and while stops stay closed: what is free
//! obeys y'' = (from place) y + (from rate) y' + (from loads) u with constant matrices
//! (equation.rs), so each leg is a Taylor series over a short span, and a power of one matrix
//! exponential over long times. No eigenvectors: resonance, rigid bodies, critical damping and
//! defective matrices are no special cases.

#[cfg(test)]
pub(crate) mod draws;
mod equation;
mod events;
mod gap;
mod leg;
#[cfg(test)]
mod tests;

use std::sync::OnceLock;

use self::equation::{Equation, LOADS, Row};
use self::gap::Condition;
use super::{dot, stop_motions};
use crate::flight::drive::{Drive, Trig};
use crate::flight::tolerances::LEG_ORDER;
use crate::model::state::Clock;
use crate::model::structure::Structure;
use crate::numerics::dense::{self, Matrix};
use crate::numerics::double_double::DoubleDouble;
use crate::numerics::lanes::LANES;
use crate::search::steps::{LEVELS, Weights};
use crate::search::tolerances::SCAN_STEPS;
pub(crate) use events::LegEvent;
pub(crate) use leg::LinearFlight;

/// Which stops stay closed, and how. All that one list names see no friction.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Closed {
    /// These, ascending, without friction; none: free flight.
    Frictionless(Vec<usize>),
    /// One slides with friction, its velocity of slip of this sign, beside frictionless stops that
    /// do not see it.
    Slide { stop: usize, direction: f64, beside: Vec<usize> },
    /// One is held by friction.
    Stick { stop: usize, beside: Vec<usize> },
}

/// Forces in a closed stop, P >= 0 against its normal and Q along its tangent.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct StopForce {
    pub stop: usize,
    pub normal: f64,
    pub tangential: f64,
}

/// What the legs with one set of closed stops have in common, worked out once.
#[derive(Debug, Clone)]
pub(crate) struct LinearMotion {
    closed: Closed,
    drive: Drive,
    equation: Equation,
    /// t of a stop that sticks; the friction of one that slides.
    held: Option<Vec<f64>>,
    friction: f64,
    conditions: Vec<Condition>,
    weights: [Weights; LEVELS],
    /// Of (y, y', u) over 2^k spans.
    powers: [OnceLock<Matrix>; POWERS],
}

/// Powers of two of a span up to which a state is asked for.
const POWERS: usize = 64;

impl Closed {
    /// All of them, ascending.
    pub fn stops(&self) -> Vec<usize> {
        match self {
            Self::Frictionless(stops) => stops.clone(),
            Self::Slide { stop, beside, .. } | Self::Stick { stop, beside } => {
                let mut stops = beside.clone();
                stops.push(*stop);
                stops.sort_unstable();
                stops
            }
        }
    }
}

impl LinearMotion {
    /// The motion while these stops stay closed. Stops whose normals are combinations of those of
    /// others before them carry no force. `None`: no force keeps them closed, or more than one (a +
    /// mu s b <= 0: a Painleve point).
    pub fn new(structure: &Structure, closed: Closed) -> Option<Self> {
        let drive = Drive::new(structure.drive_frequency(), structure.phase());
        let stops = stop_motions(structure);
        let equation = Equation::new(structure, &stops, &drive, &closed)?;
        let held = match &closed {
            Closed::Stick { stop, .. } => structure.stops()[*stop].tangent().map(<[f64]>::to_vec),
            _ => None,
        };
        let friction = match &closed {
            Closed::Slide { stop, .. } => structure.stops()[*stop].friction(),
            _ => 0.0,
        };
        let conditions = Condition::all(structure, &stops, &drive, &closed, &equation);
        let weights = std::array::from_fn(|level| Weights::new(step(equation.span, level)));
        let powers = std::array::from_fn(|_| OnceLock::new());
        Some(Self { closed, drive, equation, held, friction, conditions, weights, powers })
    }

    /// Length of a local flight, up to which an event is looked for at once.
    pub fn span(&self) -> f64 {
        self.equation.span
    }

    /// Time after which its velocities have turned or decayed; infinite where none does.
    pub fn longest(&self) -> f64 {
        if self.equation.turns { self.equation.span } else { f64::INFINITY }
    }

    /// Dimension of its states: of y and y', and in stick of tau.
    pub fn dimension(&self) -> usize {
        2 * self.equation.free + usize::from(self.held.is_some())
    }

    /// Which stops are closed.
    pub fn closed(&self) -> &Closed {
        &self.closed
    }

    /// The leg that starts at `clock` from q and q', each (N,); on the closed stops, to rounding.
    pub fn flight(&self, clock: Clock, q: &[f64], v: &[f64]) -> LinearFlight {
        let Equation { to_free, span, .. } = &self.equation;
        let on = |vector: &[f64]| -> Vec<f64> {
            let row = |i| {
                let terms = to_free.row(i).iter().zip(vector);
                terms.fold(DoubleDouble::ZERO, |sum, (t, &x)| sum + t.scale(x)).value()
            };
            (0..self.equation.free).map(row).collect()
        };
        let tau = self.held.as_ref().map_or(0.0, |tangent| dot(tangent, q));
        let rate = on(v).iter().map(|rate| rate * span).collect();
        LinearFlight::new(self, clock, on(q), rate, tau)
    }

    /// The clock at a time after the start of a leg.
    #[cfg(test)]
    pub fn clock_after(&self, flight: &LinearFlight, elapsed: DoubleDouble) -> Clock {
        self.drive.advance(flight.clock, elapsed)
    }

    /// Coordinates and velocities at any time after the start of a leg.
    pub fn state_after(
        &self,
        flight: &LinearFlight,
        elapsed: DoubleDouble,
    ) -> (Vec<f64>, Vec<f64>) {
        let (place, rate) = self.free_after(flight, elapsed);
        let loads = self.loads_after(flight, elapsed);
        let Equation { coordinates, shift, shift_rate, span, .. } = &self.equation;
        let sum = |i: usize, free: &[f64], shift: &Matrix| {
            let terms = coordinates.row(i).iter().zip(free);
            let sum = terms.fold(DoubleDouble::ZERO, |sum, (c, &x)| sum + c.scale(x));
            let own = shift.row(i).iter().zip(&loads);
            own.fold(sum, |sum, (c, &x)| sum + c.scale(x)).value()
        };
        let rate: Vec<f64> = rate.iter().map(|rate| rate / span).collect();
        let all =
            |free: &[f64], shift| (0..coordinates.rows).map(|i| sum(i, free, shift)).collect();
        (all(&place, shift), all(&rate, shift_rate))
    }

    /// Forces in the closed stops at any time after the start of a leg. A stop whose normal is a
    /// combination of others' has none.
    pub fn forces(&self, flight: &LinearFlight, elapsed: DoubleDouble) -> Vec<StopForce> {
        let (place, rate) = self.free_after(flight, elapsed);
        let loads = self.loads_after(flight, elapsed);
        let Equation { forces, pressed, .. } = &self.equation;
        let value = |row: &Row| row.value(&place, &rate, &loads).0;
        pressed
            .iter()
            .zip(forces)
            .map(|(&stop, row)| {
                let normal = value(row);
                let tangential = match self.closed {
                    Closed::Slide { stop: rubs, direction, .. } if rubs == stop => {
                        -self.friction * direction * normal
                    }
                    Closed::Stick { stop: rubs, .. } if rubs == stop => {
                        forces.last().map_or(0.0, |row| -value(row))
                    }
                    _ => 0.0,
                };
                StopForce { stop, normal, tangential }
            })
            .collect()
    }

    fn loads_after(&self, flight: &LinearFlight, elapsed: DoubleDouble) -> [f64; LOADS] {
        let Trig { cos, sin } = self.drive.trig_at(self.drive.advance(flight.clock, elapsed));
        [1.0, flight.tau, cos, sin]
    }

    /// y and y' at any time: whole spans by powers of one matrix, the rest by the Taylor series.
    fn free_after(&self, flight: &LinearFlight, elapsed: DoubleDouble) -> (Vec<f64>, Vec<f64>) {
        let span = self.equation.span;
        let whole = (elapsed.value() / span).floor();
        if whole.is_nan() || whole < 1.0 {
            return flight.free_within(self, elapsed);
        }
        let free = self.equation.free;
        let start = [1.0, flight.tau, flight.start.cos, flight.start.sin];
        let mut w: Vec<DoubleDouble> = flight
            .place
            .iter()
            .chain(&flight.rate)
            .chain(&start)
            .map(|&x| DoubleDouble::new(x))
            .collect();
        let mut left = whole;
        for k in 0..POWERS {
            let half = (0.5 * left).floor();
            if left != 2.0 * half {
                let power = self.power(k);
                w = (0..power.rows).map(|i| dense::dot(power.row(i), &w)).collect();
            }
            left = half;
        }
        if left > 0.0 {
            // Further than a phase has any digit.
            w.fill(DoubleDouble::new(f64::NAN));
        }
        let passed = DoubleDouble::product(whole, span);
        let there = LinearFlight::new(
            self,
            self.drive.advance(flight.clock, passed),
            w[..free].iter().map(|x| x.hi).collect(),
            w[free..2 * free].iter().map(|x| x.hi).collect(),
            flight.tau,
        );
        there.free_within(self, elapsed - passed)
    }

    /// exp over 2^k spans.
    fn power(&self, k: usize) -> &Matrix {
        self.powers[k].get_or_init(|| match k {
            0 => self.exponential(),
            _ => self.power(k - 1).times(self.power(k - 1)),
        })
    }

    /// exp over one span, by its Taylor series, column by column.
    fn exponential(&self) -> Matrix {
        let Equation { free, from_place, from_rate, from_loads, turn, .. } = &self.equation;
        let size = 2 * free + LOADS;
        let columns: Vec<Vec<DoubleDouble>> = (0..size)
            .map(|j| {
                let mut term: Vec<DoubleDouble> =
                    (0..size).map(|i| DoubleDouble::new(f64::from(u8::from(i == j)))).collect();
                let mut sum = term.clone();
                for n in 1..=LEG_ORDER {
                    let (place, rest) = term.split_at(*free);
                    let (rate, loads) = rest.split_at(*free);
                    let acceleration = (0..*free).map(|i| {
                        dense::dot(from_place.row(i), place)
                            + dense::dot(from_rate.row(i), rate)
                            + dense::dot(from_loads.row(i), loads)
                    });
                    let turned = [loads[3].scale(-turn), loads[2].scale(*turn)];
                    let order = DoubleDouble::new(n as f64);
                    term = rate
                        .iter()
                        .copied()
                        .chain(acceleration)
                        .chain([DoubleDouble::ZERO; 2])
                        .chain(turned)
                        .map(|x| x.divide(order))
                        .collect();
                    for (sum, &term) in sum.iter_mut().zip(&term) {
                        *sum = *sum + term;
                    }
                }
                sum
            })
            .collect();
        Matrix::from_rows(&columns, size).transposed()
    }

    fn step(&self, level: usize) -> f64 {
        step(self.equation.span, level)
    }
}

/// Length of the steps of a level.
fn step(span: f64, level: usize) -> f64 {
    SCAN_STEPS * span / (LANES << level) as f64
}

impl Row {
    /// Its value, and the sum of the sizes of its terms.
    pub fn value(&self, place: &[f64], rate: &[f64], loads: &[f64; LOADS]) -> (f64, f64) {
        let terms = self.place.iter().zip(place);
        let terms = terms.chain(self.rate.iter().zip(rate)).chain(self.loads.iter().zip(loads));
        let (mut sum, mut size) = (DoubleDouble::ZERO, 0.0);
        for (row, &x) in terms {
            let term = row.scale(x);
            (sum, size) = (sum + term, size + term.hi.abs());
        }
        (sum.value(), size)
    }
}

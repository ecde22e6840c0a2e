//! One leg of linear motion: where it starts, and its Taylor series over the spans that have been
//! asked for.

use std::sync::OnceLock;

use super::LinearMotion;
use super::equation::{Equation, LOADS, Row};
use crate::flight::drive::Trig;
use crate::flight::tolerances::LEG_ORDER;
use crate::model::state::Clock;
use crate::numerics::EPS;
use crate::numerics::double_double::DoubleDouble;

/// Spans for which a leg has series: as many as a first pass looks ahead.
pub(super) const SEGMENTS: usize = 8;
/// Orders whose sums are compensated: what they round is of the size of the motion itself.
const COMPENSATED: usize = 3;
/// Derivatives of which bounds are asked for: the sixth of a force is the seventh of y.
const BOUNDED: usize = 7;

/// A leg: it starts at some instant, and is evaluated at local times.
#[derive(Debug, Clone)]
pub(crate) struct LinearFlight {
    pub(super) clock: Clock,
    /// y, and y' per span.
    pub(super) place: Vec<f64>,
    pub(super) rate: Vec<f64>,
    pub(super) tau: f64,
    pub(super) start: Trig,
    /// |z| and its derivatives at the start, z = (scales y, y'), per span.
    sizes: [f64; BOUNDED],
    segments: [OnceLock<Segment>; SEGMENTS],
}

/// Taylor series in time over the span.
#[derive(Debug, Clone)]
pub(super) struct Segment {
    /// y, by order and then by component, up to `LEG_ORDER` + 1.
    place: Vec<f64>,
    loads: Vec<[f64; LOADS]>,
}

impl LinearFlight {
    pub(super) fn new(
        motion: &LinearMotion,
        clock: Clock,
        place: Vec<f64>,
        rate: Vec<f64>,
        tau: f64,
    ) -> Self {
        let start = motion.drive.trig_at(clock);
        let first = Segment::new(&motion.equation, &place, &rate, tau, start);
        let sizes = first.sizes(&motion.equation);
        let segments = std::array::from_fn(|_| OnceLock::new());
        let _ = segments[0].set(first);
        Self { clock, place, rate, tau, start, sizes, segments }
    }

    /// The series over one of the first spans.
    pub(super) fn segment(&self, motion: &LinearMotion, i: usize) -> &Segment {
        self.segments[i].get_or_init(|| {
            let equation = &motion.equation;
            let before = self.segment(motion, i.saturating_sub(1));
            let (place, rate) = before.at(equation.free, 1.0);
            let start = motion.drive.turned(self.start, equation.span * i as f64).phase;
            Segment::new(equation, &place, &rate, self.tau, start)
        })
    }

    /// y and y' at a local time within the first spans; y' per span.
    pub(super) fn free_within(
        &self,
        motion: &LinearMotion,
        elapsed: DoubleDouble,
    ) -> (Vec<f64>, Vec<f64>) {
        let Equation { free, span, .. } = motion.equation;
        let segment = self.segment(motion, 0);
        let (mut place, mut rate) = segment.change(free, elapsed.hi / span);
        let rest = elapsed.lo / span;
        for i in 0..free {
            let (y, v) = (self.place[i], self.rate[i] + rate[i]);
            place[i] = y + (place[i] + rest * v);
            rate[i] = v;
        }
        (place, rate)
    }

    /// Value of a row at the start, and the sum of the sizes of its terms.
    pub(super) fn value(&self, row: &Row) -> (f64, f64) {
        row.value(&self.place, &self.rate, &[1.0, self.tau, self.start.cos, self.start.sin])
    }

    /// Bounds of |z^(k)| up to a local time, in spans: with growth mu and loads h
    /// |z^(k)(s)| <= e^(mu s) (|z^(k)(0)| + s max |h^(k)|).
    pub(super) fn bounds(&self, equation: &Equation, until: f64) -> [f64; BOUNDED] {
        let column = |j: usize| -> f64 {
            let of = &equation.from_loads;
            (0..of.rows).map(|i| of[(i, j)].hi.powi(2)).sum::<f64>().sqrt()
        };
        let still = column(0) + column(1) * self.tau.abs();
        let turning = column(2).hypot(column(3));
        let growth = (equation.growth * until).exp();
        std::array::from_fn(|k| {
            let turning = turning * equation.turn.powi(k as i32);
            let load = if k == 0 { still + turning } else { turning };
            growth * (self.sizes[k] + until * load)
        })
    }
}

impl Segment {
    fn new(equation: &Equation, place: &[f64], rate: &[f64], tau: f64, start: Trig) -> Self {
        let free = equation.free;
        let mut series = vec![0.0; (LEG_ORDER + 2) * free];
        series[..free].copy_from_slice(place);
        series[free..2 * free].copy_from_slice(rate);
        let mut loads = Vec::with_capacity(LEG_ORDER + 1);
        loads.push([1.0, tau, start.cos, start.sin]);
        for k in 0..LEG_ORDER {
            let [.., cos, sin] = loads[k];
            let per_order = equation.turn / (k + 1) as f64;
            loads.push([0.0, 0.0, -per_order * sin, per_order * cos]);
        }
        let mut now = vec![0.0; 2 * free + LOADS];
        for k in 0..LEG_ORDER {
            let order = (k + 1) as f64;
            now[..free].copy_from_slice(&series[k * free..(k + 1) * free]);
            for (now, next) in now[free..2 * free].iter_mut().zip(&series[(k + 1) * free..]) {
                *now = order * next;
            }
            now[2 * free..].copy_from_slice(&loads[k]);
            for i in 0..free {
                let rows = [
                    equation.from_place.row(i),
                    equation.from_rate.row(i),
                    equation.from_loads.row(i),
                ];
                let sum = times(rows, &now, k < COMPENSATED);
                series[(k + 2) * free + i] = sum / (order * (order + 1.0));
            }
        }
        Self { place: series, loads }
    }

    fn order(&self, free: usize, k: usize) -> &[f64] {
        &self.place[k * free..(k + 1) * free]
    }

    /// Change of y and of y' since the start, at a time in spans.
    fn change(&self, free: usize, s: f64) -> (Vec<f64>, Vec<f64>) {
        let (mut place, mut rate) = (vec![0.0; free], vec![0.0; free]);
        for k in (1..=LEG_ORDER).rev() {
            let (this, next) = (self.order(free, k), self.order(free, k + 1));
            for i in 0..free {
                place[i] = s * (place[i] + this[i]);
                rate[i] = s * (rate[i] + (k + 1) as f64 * next[i]);
            }
        }
        (place, rate)
    }

    /// y and y' at a time in spans.
    fn at(&self, free: usize, s: f64) -> (Vec<f64>, Vec<f64>) {
        let (mut place, mut rate) = self.change(free, s);
        for i in 0..free {
            place[i] += self.order(free, 0)[i];
            rate[i] += self.order(free, 1)[i];
        }
        (place, rate)
    }

    /// The series of a row.
    pub fn of(&self, free: usize, row: &Row) -> [f64; LEG_ORDER + 1] {
        std::array::from_fn(|k| {
            let (place, next) = (self.order(free, k), self.order(free, k + 1));
            let order = (k + 1) as f64;
            if k < COMPENSATED {
                let rate: Vec<f64> = next.iter().map(|next| order * next).collect();
                return row.value(place, &rate, &self.loads[k]).0;
            }
            let sum = |row: &[DoubleDouble], of: &[f64]| -> f64 {
                row.iter().zip(of).map(|(row, x)| row.hi * x).sum()
            };
            sum(&row.place, place) + order * sum(&row.rate, next) + sum(&row.loads, &self.loads[k])
        })
    }

    /// |z| and its derivatives at the start, with their rounding.
    fn sizes(&self, equation: &Equation) -> [f64; BOUNDED] {
        let free = equation.free;
        let mut factorial = 1.0;
        // Terms that cancel are at most so large, and leave so much rounding.
        let mut before = (0..free)
            .map(|i| {
                let terms = equation.from_loads.row(i).iter().zip(&self.loads[0]);
                terms.map(|(load, x)| (load.hi * x).abs()).sum::<f64>()
            })
            .sum::<f64>();
        std::array::from_fn(|k| {
            if k > 0 {
                factorial *= k as f64;
            }
            let (place, next) = (self.order(free, k), self.order(free, k + 1));
            let squares = place.iter().zip(next).zip(&equation.scales).map(|((y, next), scale)| {
                let (y, v) = (scale * factorial * y, factorial * (k + 1) as f64 * next);
                y * y + v * v
            });
            let size = squares.sum::<f64>().sqrt();
            let rounding = 8.0 * EPS * (2 * free + LOADS) as f64;
            before = size.max(2.0 * before);
            size + rounding * before
        })
    }
}

/// Sum of products, of three rows one after another.
fn times(rows: [&[DoubleDouble]; 3], x: &[f64], compensated: bool) -> f64 {
    let terms = || rows.into_iter().flatten().zip(x);
    if compensated {
        return terms().fold(DoubleDouble::ZERO, |sum, (row, &x)| sum + row.scale(x)).value();
    }
    let (sum, rest) =
        terms().fold((0.0, 0.0), |(sum, rest), (row, &x)| (sum + row.hi * x, rest + row.lo * x));
    sum + rest
}

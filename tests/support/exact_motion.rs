//! A flight in double-double arithmetic, exact to about 30 digits: the motion behind the dense
//! search (dense.rs). It shares no code and no formula of the motion with the library.
//!
//! The forced linear system is autonomous in (x1, v1, x2, v2, cos psi, sin psi). Its one-step
//! propagator is the Taylor series of the matrix exponential; states are stepped with it.
//! Equations of motion and gap: docs/theory.md, section 1.

use vibroimpact::{Contact, State, System};

use super::dense::{ExactMotion, Gap, Sample};
use super::double_double::Dd;
use super::judge::Measured;

/// Samples over a flight at least; more where the pendulum turns fast.
const STEPS: f64 = 256.0;
/// Largest turn of the pendulum between samples (oblique contact).
const LARGEST_TURN: f64 = 0.1;
/// Steps are halved at most so often.
const LEVELS: usize = 16;

/// Displacements, rates and drive at one instant.
#[derive(Debug, Clone, Copy)]
pub struct Point {
    pub x: [Dd; 2],
    pub v: [Dd; 2],
    cos: Dd,
    sin: Dd,
}

/// A flight that is exact to about 30 digits.
#[derive(Debug, Clone)]
pub struct DenseFlight {
    direct: bool,
    touching: bool,
    delta: Dd,
    omega: Dd,
    /// w^2, 2 zeta w and f of both bodies.
    stiffness: [Dd; 2],
    damping: [Dd; 2],
    forcing: [Dd; 2],
    /// Constant loads.
    loads: [Dd; 2],
    start: Point,
    span: f64,
    propagators: [Option<Propagator>; LEVELS],
}

/// Maps of (x, v) and (cos, sin) over one step: x' = a x + b v + c cos + d sin + e, the same for v.
#[derive(Debug, Clone, Copy)]
struct Propagator {
    rows: [[[Dd; 5]; 2]; 2],
    turn: [Dd; 2],
}

impl DenseFlight {
    /// `touching`: x2 is tip - delta without rounding.
    pub fn new(system: &System, state: &State, touching: bool, span: f64) -> Self {
        let dd = Dd::new;
        let w0 = dd(system.frequency_ratio());
        let direct = system.contact() == Contact::Direct;
        let (sin, cos) = dd(system.phase()).sin_cos();
        let x1 = dd(state.x1);
        let delta = dd(system.gap());
        let tip = if direct { x1 } else { x1.sin_cos().0 };
        let x2 = if touching { tip - delta } else { dd(state.x2) };
        Self {
            direct,
            touching,
            delta,
            omega: dd(system.drive_frequency()),
            stiffness: [w0 * w0, Dd::ONE],
            damping: [
                (dd(system.pendulum_damping()) * w0).scale(2.0),
                dd(system.oscillator_damping()).scale(2.0),
            ],
            forcing: [dd(system.moment_amplitude()), dd(system.force_amplitude())],
            loads: [dd(system.static_moment()), dd(system.static_force())],
            start: Point { x: [x1, x2], v: [dd(state.v1), dd(state.v2)], cos, sin },
            span,
            propagators: [None; LEVELS],
        }
    }

    fn propagator(&mut self, level: usize) -> Propagator {
        if let Some(known) = self.propagators[level] {
            return known;
        }
        let h = Dd::new(self.step(level));
        let (zero, one) = ([Dd::ZERO; 2], [Dd::ONE; 2]);
        let unit = |x, v, cos, sin| self.under(zero, &Point { x, v, cos, sin }, h);
        let columns = [
            unit(one, zero, Dd::ZERO, Dd::ZERO),
            unit(zero, one, Dd::ZERO, Dd::ZERO),
            unit(zero, zero, Dd::ONE, Dd::ZERO),
            unit(zero, zero, Dd::ZERO, Dd::ONE),
            self.later(&Point { x: zero, v: zero, cos: Dd::ZERO, sin: Dd::ZERO }, h),
        ];
        let rows = std::array::from_fn(|i| [columns.map(|c| c.x[i]), columns.map(|c| c.v[i])]);
        let made = Propagator { rows, turn: [columns[2].cos, columns[2].sin] };
        self.propagators[level] = Some(made);
        made
    }

    /// The point a time `h` later under these constant loads, by its Taylor series.
    fn under(&self, mut loads: [Dd; 2], point: &Point, h: Dd) -> Point {
        let mut term = *point;
        let mut sum = *point;
        let mut small = 0;
        for n in 1..200 {
            let k = h.over(f64::from(n));
            let Point { x, v, cos, sin } = term;
            for i in 0..2 {
                let force = self.forcing[i] * cos + loads[i] - self.damping[i] * v[i];
                term.x[i] = k * v[i];
                term.v[i] = k * (force - self.stiffness[i] * x[i]);
            }
            // A constant load has one coefficient.
            loads = [Dd::ZERO; 2];
            let turn = k * self.omega;
            (term.cos, term.sin) = (-(turn * sin), turn * cos);
            let mut size = [0.0, 0.0];
            let mut add = |sum: &mut Dd, term: Dd| {
                *sum = *sum + term;
                size[0] += sum.hi.abs();
                size[1] += term.hi.abs();
            };
            for i in 0..2 {
                add(&mut sum.x[i], term.x[i]);
                add(&mut sum.v[i], term.v[i]);
            }
            add(&mut sum.cos, term.cos);
            add(&mut sum.sin, term.sin);
            // Every second term alone may vanish.
            small = if size[1] <= 1e-35 * size[0] { small + 1 } else { 0 };
            if small == 2 {
                break;
            }
        }
        sum
    }

    fn step(&self, level: usize) -> f64 {
        self.span / STEPS / f64::from(1u32 << level)
    }
}

impl ExactMotion for DenseFlight {
    type Point = Point;

    fn touching(&self) -> bool {
        self.touching
    }

    fn start(&self) -> Point {
        self.start
    }

    fn first_step(&self) -> f64 {
        self.step(0)
    }

    fn later(&self, point: &Point, h: Dd) -> Point {
        self.under(self.loads, point, h)
    }

    fn gap(&self, point: &Point) -> Gap {
        let Point { x, v, cos, .. } = *point;
        let a: [Dd; 2] = std::array::from_fn(|i| {
            self.forcing[i] * cos + self.loads[i]
                - self.damping[i] * v[i]
                - self.stiffness[i] * x[i]
        });
        let [value, rate, second] = if self.direct {
            [x[0], v[0], a[0]]
        } else {
            let (sin, cos) = x[0].sin_cos();
            [sin, v[0] * cos, a[0] * cos - v[0] * v[0] * sin]
        };
        Gap { value: value - x[1] - self.delta, rate: rate - v[1], second: second - a[1] }
    }

    fn sample(&self, time: Dd, point: Point) -> Sample<Point> {
        let Point { x, v, cos, .. } = point;
        let a: [f64; 2] = std::array::from_fn(|i| {
            self.forcing[i].hi * cos.hi + self.loads[i].hi
                - self.damping[i].hi * v[i].hi
                - self.stiffness[i].hi * x[i].hi
        });
        let [tip, rate, second] = if self.direct {
            [x[0].hi, v[0].hi, a[0]]
        } else {
            let (sin, cos) = x[0].hi.sin_cos();
            [sin, v[0].hi * cos, a[0] * cos - v[0].hi * v[0].hi * sin]
        };
        let (rate, second) = (rate - v[1].hi, second - a[1]);
        let plain = tip - x[1].hi - self.delta.hi;
        let near = 1e-9 * (tip.abs() + x[1].hi.abs() + self.delta.hi.abs());
        let gap = if plain.abs() > near { Dd::new(plain) } else { self.gap(&point).value };
        Sample { time, point, gap, rate, second }
    }

    fn next(&mut self, from: &Sample<Point>) -> Option<Sample<Point>> {
        let left = Dd::new(self.span) - from.time;
        // The sum of the steps misses the span by rounding.
        if left.hi <= 1e-14 * self.span {
            return None;
        }
        let turn = if self.direct { 0.0 } else { from.point.v[0].hi.abs() * self.step(0) };
        let level = (turn / LARGEST_TURN).max(1.0).log2().ceil() as usize;
        let level = level.min(LEVELS - 1);
        let h = self.step(level);
        if left.hi < h {
            return Some(self.sample(Dd::new(self.span), self.later(&from.point, left)));
        }
        let Propagator { rows, turn } = self.propagator(level);
        let Point { x, v, cos, sin } = from.point;
        let map = |i: usize, [a, b, c, d, e]: [Dd; 5]| {
            let free = a * x[i] + b * v[i] + e;
            if self.forcing[i].hi == 0.0 { free } else { free + (c * cos + d * sin) }
        };
        let point = Point {
            x: [map(0, rows[0][0]), map(1, rows[1][0])],
            v: [map(0, rows[0][1]), map(1, rows[1][1])],
            cos: turn[0] * cos - turn[1] * sin,
            sin: turn[1] * cos + turn[0] * sin,
        };
        Some(self.sample(from.time + Dd::new(h), point))
    }
}

impl Measured for DenseFlight {
    type State = State;

    /// |tip| + |x2| + |delta|.
    fn size(&self, point: &Point) -> f64 {
        let x1 = point.x[0].hi;
        let tip = if self.direct { x1 } else { x1.sin() };
        tip.abs() + point.x[1].hi.abs() + self.delta.hi.abs()
    }

    fn off(&self, point: &Point, told: &State) -> (f64, f64, f64) {
        let off = |exact: Dd, told: f64| (exact - Dd::new(told)).hi.abs();
        let displacement = off(point.x[0], told.x1).max(off(point.x[1], told.x2));
        let velocity = off(point.v[0], told.v1).max(off(point.v[1], told.v2));
        (displacement, velocity, point.x[0].hi.abs())
    }
}

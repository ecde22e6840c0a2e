//! A flight of a linear structure with one stop in double-double, along the Taylor series of the
//! equations of motion, which knows no modes: the independent party of audits (docs/contact-audit.md).

use nalgebra::Complex;

use super::dense::{self, ExactMotion, Sample};
use super::double_double::Dd;
use super::judge::Measured;

/// Coordinates at most.
pub const MOST: usize = 6;
pub type Row = [Dd; MOST];

/// A structure with one stop, as its matrices, and the start of a flight at t = 0.
#[derive(Debug, Clone)]
pub struct Case {
    pub mass: Vec<Vec<f64>>,
    pub stiffness: Vec<Vec<f64>>,
    /// C = m M + k K, one of them 0 and the other a power of two: no entry is rounded. Or a matrix
    /// that couples the modes.
    pub damping: Vec<Vec<f64>>,
    pub load: Vec<f64>,
    pub drive: Vec<Complex<f64>>,
    pub frequency: f64,
    pub phase: f64,
    pub normal: Vec<f64>,
    pub gap: f64,
    /// Amplitude and phase of the stop.
    pub moving: [f64; 2],
    pub q: Vec<f64>,
    pub v: Vec<f64>,
    pub touching: bool,
}

/// The flight in double-double.
#[derive(Debug, Clone)]
pub struct Exact {
    count: usize,
    /// M^-1 K, M^-1 C, and M^-1 times the load and both parts of the drive's amplitude.
    stiffness: [Row; MOST],
    damping: [Row; MOST],
    load: Row,
    drive: [Row; 2],
    frequency: Dd,
    normal: Row,
    gap: Dd,
    stop: [Dd; 2],
    start: Point,
    touching: bool,
    span: f64,
    /// The regular step, once one is taken.
    regular: Option<Step>,
}

/// Where one regular step takes a state of which one number is 1 and all others, or none, are 0: it
/// takes any other to their combination, for a tenth of the work of its series.
#[derive(Debug, Clone)]
struct Step {
    units: Vec<Point>,
    /// Without anything but the constant load.
    load: Point,
}

#[derive(Debug, Clone, Copy)]
pub struct Point {
    q: Row,
    v: Row,
    cos: Dd,
    sin: Dd,
}

impl Point {
    const ZERO: Self =
        Self { q: [Dd::ZERO; MOST], v: [Dd::ZERO; MOST], cos: Dd::ZERO, sin: Dd::ZERO };

    /// Its numbers, the same for every point of so many coordinates.
    fn numbers(&mut self, count: usize) -> impl Iterator<Item = &mut Dd> {
        let Self { q, v, cos, sin } = self;
        q[..count].iter_mut().chain(&mut v[..count]).chain([cos, sin])
    }
}

fn row(values: impl IntoIterator<Item = f64>) -> Row {
    let mut row = [Dd::ZERO; MOST];
    for (entry, value) in row.iter_mut().zip(values) {
        *entry = Dd::new(value);
    }
    row
}

/// M^-1 b for several b, by Gauss's elimination.
fn solve(mass: &[Vec<f64>], mut right: Vec<Row>) -> Vec<Row> {
    let count = mass.len();
    let mut m: Vec<Row> = mass.iter().map(|r| row(r.iter().copied())).collect();
    for p in 0..count {
        for i in 0..count {
            if i != p {
                let factor = m[i][p].divide(m[p][p]);
                let pivot = m[p];
                for (entry, &other) in m[i].iter_mut().zip(&pivot) {
                    *entry = *entry - factor * other;
                }
                for b in &mut right {
                    b[i] = b[i] - factor * b[p];
                }
            }
        }
    }
    for b in &mut right {
        for p in 0..count {
            b[p] = b[p].divide(m[p][p]);
        }
    }
    right
}

impl Exact {
    pub fn new(case: &Case, span: f64) -> Self {
        let count = case.q.len();
        let columns = |matrix: &[Vec<f64>]| -> [Row; MOST] {
            let right = (0..count).map(|j| row(matrix.iter().map(|r| r[j]))).collect();
            let solved = solve(&case.mass, right);
            std::array::from_fn(|i| {
                std::array::from_fn(
                    |j| if i < count && j < count { solved[j][i] } else { Dd::ZERO },
                )
            })
        };
        let loads = vec![
            row(case.load.iter().copied()),
            row(case.drive.iter().map(|f| f.re)),
            row(case.drive.iter().map(|f| f.im)),
        ];
        let loads = solve(&case.mass, loads);
        let (sin, cos) = Dd::new(case.phase).sin_cos();
        // A cos(omega t + stop's phase) by the phase of the drive.
        let (turn_sin, turn_cos) = Dd::sum(case.moving[1], -case.phase).sin_cos();
        let amplitude = Dd::new(case.moving[0]);
        let mut exact = Self {
            count,
            stiffness: columns(&case.stiffness),
            damping: columns(&case.damping),
            load: loads[0],
            drive: [loads[1], loads[2]],
            frequency: Dd::new(case.frequency),
            normal: row(case.normal.iter().copied()),
            gap: Dd::new(case.gap),
            stop: [amplitude * turn_cos, amplitude * turn_sin],
            start: Point {
                q: row(case.q.iter().copied()),
                v: row(case.v.iter().copied()),
                cos,
                sin,
            },
            touching: case.touching,
            span,
            regular: None,
        };
        if case.touching {
            // The flight starts on the stop without rounding.
            let start = exact.start;
            exact.gap = exact.gap + exact.gap(&start).value;
        }
        exact
    }

    fn dot(&self, a: &Row, b: &Row) -> Dd {
        (0..self.count).fold(Dd::ZERO, |sum, i| sum + a[i] * b[i])
    }

    /// What a step of length h does.
    fn step(&self, h: Dd) -> Step {
        let unit = |number: usize| {
            let mut start = Point::ZERO;
            start.numbers(self.count).skip(number).take(1).for_each(|one| *one = Dd::ONE);
            self.series(&start, h, false)
        };
        let units = (0..2 * self.count + 2).map(unit).collect();
        Step { units, load: self.series(&Point::ZERO, h, true) }
    }

    /// `point` one regular step later.
    fn stepped(&mut self, point: &Point) -> Point {
        let step = match self.regular.take() {
            Some(step) => step,
            None => self.step(Dd::new(self.first_step())),
        };
        let (mut from, mut sum) = (*point, step.load);
        for (&mut share, unit) in from.numbers(self.count).zip(&step.units) {
            let mut unit = *unit;
            for (sum, &mut unit) in sum.numbers(self.count).zip(unit.numbers(self.count)) {
                *sum = *sum + share * unit;
            }
        }
        self.regular = Some(step);
        sum
    }

    /// `point` a time h later, by the Taylor series; with the constant load or without.
    fn series(&self, point: &Point, h: Dd, load: bool) -> Point {
        let (mut term, mut sum) = (*point, *point);
        let mut small = 0;
        for n in 1..200 {
            let k = h.over(f64::from(n));
            // A constant load has one coefficient.
            let a = self.acceleration(&term, load && n == 1);
            let turn = k * self.frequency;
            let Point { v, cos, sin, .. } = term;
            for i in 0..self.count {
                (term.q[i], term.v[i]) = (k * v[i], k * a[i]);
                (sum.q[i], sum.v[i]) = (sum.q[i] + term.q[i], sum.v[i] + term.v[i]);
            }
            (term.cos, term.sin) = (-(turn * sin), turn * cos);
            (sum.cos, sum.sin) = (sum.cos + term.cos, sum.sin + term.sin);
            let size = |p: &Point| {
                let both = p.q.iter().chain(&p.v).chain([&p.cos, &p.sin]);
                both.map(|c| c.hi.abs()).sum::<f64>()
            };
            // Every second term alone may vanish.
            small = if size(&term) <= 1e-33 * size(&sum) { small + 1 } else { 0 };
            if small == 2 {
                break;
            }
        }
        sum
    }

    /// q'' under this load; `load` 0 or 1.
    fn acceleration(&self, &Point { q, v, cos, sin }: &Point, load: bool) -> Row {
        let mut a = [Dd::ZERO; MOST];
        for (i, entry) in a.iter_mut().enumerate().take(self.count) {
            let own = if load { self.load[i] } else { Dd::ZERO };
            let driven = self.drive[0][i] * cos - self.drive[1][i] * sin;
            *entry =
                own + driven - self.dot(&self.stiffness[i], &q) - self.dot(&self.damping[i], &v);
        }
        a
    }
}

impl ExactMotion for Exact {
    type Point = Point;

    fn touching(&self) -> bool {
        self.touching
    }

    fn start(&self) -> Point {
        self.start
    }

    fn first_step(&self) -> f64 {
        self.span / 128.0
    }

    fn later(&self, point: &Point, h: Dd) -> Point {
        self.series(point, h, true)
    }

    fn gap(&self, point: &Point) -> dense::Gap {
        let Point { q, v, cos, sin } = *point;
        let a = self.acceleration(point, true);
        let w = self.frequency;
        let own = self.stop[0] * cos - self.stop[1] * sin;
        let rate = -(w * (self.stop[0] * sin + self.stop[1] * cos));
        dense::Gap {
            value: self.dot(&self.normal, &q) - self.gap - own,
            rate: self.dot(&self.normal, &v) - rate,
            second: self.dot(&self.normal, &a) + w * w * own,
        }
    }

    fn sample(&self, time: Dd, point: Point) -> Sample<Point> {
        let dense::Gap { value, rate, second } = self.gap(&point);
        Sample { time, point, gap: value, rate: rate.hi, second: second.hi }
    }

    fn next(&mut self, from: &Sample<Point>) -> Option<Sample<Point>> {
        let left = Dd::new(self.span) - from.time;
        if left.hi <= 1e-14 * self.span {
            return None;
        }
        let step = self.first_step();
        if step <= left.hi {
            let point = self.stepped(&from.point);
            return Some(self.sample(from.time + Dd::new(step), point));
        }
        Some(self.sample(from.time + left, self.later(&from.point, left)))
    }
}

impl Measured for Exact {
    type State = ();

    fn size(&self, point: &Point) -> f64 {
        let terms = (0..self.count).map(|i| (self.normal[i] * point.q[i]).hi.abs());
        terms.sum::<f64>() + self.gap.hi.abs() + self.stop[0].hi.hypot(self.stop[1].hi)
    }

    fn off(&self, _: &Point, (): &()) -> (f64, f64, f64) {
        (0.0, 0.0, 0.0)
    }
}

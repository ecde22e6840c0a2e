//! Random flights of linear structures: the library's first contact, by modes, against a dense
//! search along the Taylor series of the equations of motion in double-double, which knows no modes
//! (docs/contact-audit.md).

use nalgebra::Complex;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::f64::consts::PI;
use vibroimpact::{Clock, Start, Stop, StopContact, Structure, StructureMotion};

use crate::support::audit::Outcome;
use crate::support::audit::dense::{self, DenseSearch, ExactMotion, Sample};
use crate::support::audit::double_double::Dd;
use crate::support::audit::judge::{Judge, Last, Level, Measured, Searched, Told};
use crate::support::draws;

/// Coordinates at most.
const MOST: usize = 6;
type Row = [Dd; MOST];

/// A structure with one stop, as its matrices, and the start of a flight at t = 0.
#[derive(Debug, Clone)]
struct Case {
    mass: Vec<Vec<f64>>,
    stiffness: Vec<Vec<f64>>,
    /// C = m M + k K, one of them 0 and the other a power of two: no entry is rounded. Or a matrix
    /// that couples the modes.
    damping: Vec<Vec<f64>>,
    load: Vec<f64>,
    drive: Vec<Complex<f64>>,
    frequency: f64,
    phase: f64,
    normal: Vec<f64>,
    gap: f64,
    /// Amplitude and phase of the stop.
    moving: [f64; 2],
    q: Vec<f64>,
    v: Vec<f64>,
    touching: bool,
}

impl Case {
    fn structure(&self) -> Structure {
        Structure::builder(self.mass.clone(), self.stiffness.clone())
            .damping(self.damping.clone())
            .static_load(self.load.clone())
            .drive(self.drive.clone(), self.frequency, self.phase)
            .stop(
                Stop::new(self.normal.clone(), self.gap, 0.8)
                    .moving(self.moving[0], self.moving[1]),
            )
            .build()
            .unwrap()
    }
}

/// The flight in double-double.
#[derive(Debug, Clone)]
struct Exact {
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
}

#[derive(Debug, Clone, Copy)]
struct Point {
    q: Row,
    v: Row,
    cos: Dd,
    sin: Dd,
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
    fn new(case: &Case, span: f64) -> Self {
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
        let (mut term, mut sum) = (*point, *point);
        let mut small = 0;
        for n in 1..200 {
            let k = h.over(f64::from(n));
            // A constant load has one coefficient.
            let a = self.acceleration(&term, n == 1);
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
        let step = Dd::new(self.first_step().min(left.hi));
        Some(self.sample(from.time + step, self.later(&from.point, step)))
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

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// The rounding level that the search states: 4 eps of the terms of the gap, and 6 eps V t with V
/// >= |g'|, both by the modes.
fn level(case: &Case, structure: &Structure, span: f64) -> Level {
    let omega = case.frequency;
    let (mut size, mut rate) =
        (case.gap.abs() + case.moving[0].abs(), case.moving[0].abs() * omega);
    let inertia = |of: &[f64]| -> Vec<f64> { case.mass.iter().map(|row| dot(row, of)).collect() };
    for (shape, w) in structure.shapes().iter().zip(structure.frequencies()) {
        let part = dot(shape, &case.normal);
        let (p, speed) = (dot(shape, &inertia(&case.q)), dot(shape, &inertia(&case.v)));
        let (re, im): (Vec<f64>, Vec<f64>) = case.drive.iter().map(|f| (f.re, f.im)).unzip();
        let force = dot(shape, &re).hypot(dot(shape, &im)) + dot(shape, &case.load).abs();
        size += (part * p).abs();
        rate += part.abs() * (speed.hypot(w * p) + force * span);
    }
    Level::new(size, rate, case.touching)
}

/// The search, followed past grazes.
fn search(case: &Case, structure: &Structure) -> Searched<()> {
    let motion = StructureMotion::new(structure);
    let flight = motion.flight(Clock::START, &case.q, &case.v);
    let mut start = if case.touching { Start::Touching } else { Start::Apart };
    let mut grazes = Vec::new();
    loop {
        let last = match motion.next_contact(&flight, &[(0, start)]) {
            StopContact::Met { time, offset, .. } => {
                Last::Contact(Told { time: [time, offset], state: () })
            }
            StopContact::Grazed { time, .. } if grazes.len() < 100 => {
                grazes.push(Told { time: [time, 0.0], state: () });
                start = Start::Grazed(time);
                continue;
            }
            StopContact::Clear(_) => Last::Clear,
            _ => Last::Failed,
        };
        return Searched { grazes, last, evaluations: 0 };
    }
}

/// `coupled`: by a damping matrix that couples the modes.
fn draw(rng: &mut ChaCha8Rng, coupled: bool) -> Case {
    loop {
        let count = rng.random_range(1..=MOST);
        let mut within = |from: f64, to: f64| rng.random_range(from..to);
        let mut vector =
            |size: f64| -> Vec<f64> { (0..count).map(|_| within(-size, size)).collect() };
        // A sum of squares of rows, and what is on the diagonal.
        let mut matrix = |least: f64| -> Vec<Vec<f64>> {
            let rows: Vec<Vec<f64>> = (0..count).map(|_| vector(0.7)).collect();
            let entry = |i: usize, j: usize| {
                let sum: f64 = rows.iter().map(|row| row[i] * row[j]).sum();
                if i == j { sum + least } else { sum }
            };
            (0..count).map(|i| (0..count).map(|j| entry(i, j)).collect()).collect()
        };
        let (mass, mut stiffness) = (matrix(0.5), matrix(0.2));
        let [q, v, mut load, normal, re, im] = [1.0, 1.5, 0.5, 1.0, 1.0, 0.5].map(&mut vector);
        let kind = rng.random_range(0..10);
        if rng.random_bool(0.2) {
            // A chain that nothing holds: rigid motion.
            for (i, row) in stiffness.iter_mut().enumerate() {
                for (j, entry) in row.iter_mut().enumerate() {
                    let ends = usize::from(i > 0) + usize::from(i + 1 < count);
                    *entry = match i.abs_diff(j) {
                        0 => ends as f64,
                        1 => -1.0,
                        _ => 0.0,
                    };
                }
            }
        }
        if rng.random_bool(0.5) {
            load.fill(0.0);
        }
        let power = 2f64.powi(-rng.random_range(2..9));
        let [m, k] = [[0.0, 0.0], [power, 0.0], [0.0, power]][rng.random_range(0..3)];
        let damping = if coupled {
            coupled_damping(rng, count)
        } else {
            let of = |i: usize, j: usize| m * mass[i][j] + k * stiffness[i][j];
            (0..count).map(|i| (0..count).map(|j| of(i, j)).collect()).collect()
        };
        let moving = if rng.random_bool(0.4) { rng.random_range(-0.5..0.5) } else { 0.0 };
        let mut case = Case {
            mass,
            stiffness,
            damping,
            load,
            drive: re.iter().zip(&im).map(|(&re, &im)| Complex::new(re, im)).collect(),
            frequency: rng.random_range(0.3..6.0),
            phase: rng.random_range(-PI..PI),
            normal,
            gap: 0.0,
            moving: [moving, rng.random_range(-PI..PI)],
            q,
            v,
            touching: false,
        };
        let span = StructureMotion::new(&case.structure()).span();
        let start = |case: &Case| {
            let exact = Exact::new(case, span);
            exact.gap(&exact.start)
        };
        // g = 0 at the start, then further away.
        case.gap = start(&case).value.value();
        match kind {
            0..3 => case.gap += 10f64.powf(rng.random_range(-3.0..0.5)),
            3..6 => {
                // It separates by so much.
                let rate = start(&case).rate.value() + 10f64.powf(rng.random_range(-10.0..0.3));
                let square = dot(&case.normal, &case.normal);
                for (v, n) in case.v.iter_mut().zip(&case.normal) {
                    *v -= rate / square * n;
                }
                case.touching = true;
                if start(&case).rate.value() > -1e-11 {
                    continue;
                }
            }
            _ => {
                case.gap += 10f64.powf(rng.random_range(-3.0..0.5));
                let humps = Exact::new(&case, span).record_humps();
                if humps.is_empty() {
                    continue;
                }
                let hump = humps[rng.random_range(0..humps.len())];
                let height = 10f64.powf(rng.random_range(-15.0..-1.0));
                let height = if rng.random_bool(0.5) { height } else { -height };
                let before = case.gap;
                case.gap = (Dd::new(case.gap) + hump.gap.value - Dd::new(height)).value();
                if start(&case).value.value() > -1e-13 * (1.0 + before.abs()) {
                    continue;
                }
            }
        }
        return case;
    }
}

/// The sum of squares of a few rows, from weak to beyond critical damping: one dashpot, or more.
fn coupled_damping(rng: &mut ChaCha8Rng, count: usize) -> Vec<Vec<f64>> {
    let size = 10f64.powf(rng.random_range(-1.5..0.5));
    let rows: Vec<Vec<f64>> = (0..rng.random_range(1..=count))
        .map(|_| (0..count).map(|_| rng.random_range(-size..size)).collect())
        .collect();
    let sum = |i: usize, j: usize| rows.iter().map(|row| row[i] * row[j]).sum();
    (0..count).map(|i| (0..count).map(|j| sum(i, j)).collect()).collect()
}

#[test]
fn no_contact_of_a_structure_is_missed_or_invented() {
    audit(11, draws(600, 20_000), false);
}

#[test]
fn no_contact_of_a_structure_with_coupled_modes_is_missed_or_invented() {
    audit(12, draws(600, 20_000), true);
}

fn audit(seed: u64, flights: usize, coupled: bool) {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut outcomes = [0; Outcome::ALL.len()];
    let (mut contacts, mut grazes, mut worst) = (0, 0, 0.0f64);
    for _ in 0..flights {
        let case = draw(&mut rng, coupled);
        let structure = case.structure();
        let span = StructureMotion::new(&structure).span();
        let judge = Judge::new(Exact::new(&case, span), level(&case, &structure, span), span);
        let searched = search(&case, &structure);
        let (outcome, errors, _) = judge.judge(&searched);
        assert!(!outcome.is_disagreement(), "{outcome:?} {errors:?} {case:?}");
        outcomes[outcome as usize] += 1;
        contacts += usize::from(matches!(searched.last, Last::Contact(_)));
        grazes += searched.grazes.len();
        worst = worst.max(errors.map_or(0.0, |errors| errors.level));
    }
    println!("{outcomes:?}, {contacts} contacts, {grazes} grazes, worst |g| {worst} e");
    assert!(contacts > flights / 4 && grazes > flights / 300);
    assert!(outcomes[Outcome::Undecided as usize] < flights / 5);
}

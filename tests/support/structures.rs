//! Random flights of linear structures: the library's first contact, by modes or by matrix
//! exponentials, against the dense search of linear_motion.rs (docs/contact-audit.md).

use std::f64::consts::PI;
use std::fmt;

use nalgebra::Complex;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use vibroimpact::{Clock, Start, Stop, StopContact, Structure, StructureMotion};

use super::dense::{DenseSearch, ExactMotion};
use super::double_double::Dd;
use super::judge::{Judge, Last, Level, Outcome, Searched, Told};
use super::linear_motion::{Case, Exact, MOST};

impl Case {
    /// What is drawn is a structure.
    #[allow(clippy::unwrap_used)]
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

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// The rounding level that the search states: 4 eps of the terms of the gap, and 6 eps V t with V
/// at least |g'|. By modes V is the sum of what each can do: its energy, and the work of its force.
/// Where damping couples them one may gain what another loses, and only all together are bounded,
///
/// > |n q'| <= |n phi| |z(t)| <= |n phi| (|z(0)| + t |f|),   z = (w p, p'),
///
/// as damping takes energy; a mode slower than a sixteenth of a radian per span counts as one of that.
/// One coordinate is a mode of its own; damped beyond critical, at a rate c, its displacement p is a
/// difference of terms of the size c |p| t.
fn level(case: &Case, structure: &Structure, span: f64, coupled: bool) -> Level {
    let inertia = |of: &[f64]| -> Vec<f64> { case.mass.iter().map(|row| dot(row, of)).collect() };
    let (re, im): (Vec<f64>, Vec<f64>) = case.drive.iter().map(|f| (f.re, f.im)).unzip();
    let (q, v) = (inertia(&case.q), inertia(&case.v));
    let least = if coupled { 1.0 / (16.0 * span) } else { 0.0 };
    let mut size = case.gap.abs() + case.moving[0].abs();
    let (mut each, mut all, mut beyond) = (0.0, [0.0f64; 5], 0.0);
    for (shape, w) in structure.shapes().iter().zip(structure.frequencies()) {
        let part = dot(shape, &case.normal);
        let (p, energy) = (dot(shape, &q), dot(shape, &v).hypot(w.max(least) * dot(shape, &q)));
        let force = [&re, &im, &case.load].map(|force| dot(shape, force));
        size += (part * p).abs();
        if let [[damping]] = case.damping.iter().map(Vec::as_slice).collect::<Vec<_>>()[..] {
            let rate = 0.5 * damping * shape[0] * shape[0];
            beyond += if rate > w { part.abs() * rate * p.abs() } else { 0.0 };
        }
        each += part.abs() * (energy + (force[0].hypot(force[1]) + force[2].abs()) * span);
        for (all, x) in all.iter_mut().zip([part, energy].into_iter().chain(force)) {
            *all = all.hypot(x);
        }
    }
    let [part, energy, re, im, load] = all;
    let together = part * (energy + (re.hypot(im) + load) * span);
    let moving = case.moving[0].abs() * case.frequency;
    let rate = if coupled { together } else { each } + beyond + moving;
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
    // Once, or motions without humps, which coupled modes mostly have, would be drawn more often.
    let kind = rng.random_range(0..10);
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
        let [q, v, mut load, normal, mut re, mut im] =
            [1.0, 1.5, 0.5, 1.0, 1.0, 0.5].map(&mut vector);
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
        if rng.random_bool(0.25) {
            (re, im) = (vec![0.0; count], vec![0.0; count]);
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
            exact.gap(&exact.start())
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

/// Everything counted.
#[derive(Debug, Clone, Default)]
pub struct Structures {
    pub flights: u64,
    pub outcomes: [u64; Outcome::ALL.len()],
    pub contacts: u64,
    pub grazes: u64,
    /// |g| at a contact, in units of the stated rounding level.
    pub worst: f64,
    /// Flights that disagree.
    pub disagreements: Vec<(u64, Outcome)>,
}

impl Structures {
    pub fn count(&self, outcome: Outcome) -> u64 {
        self.outcomes[outcome as usize]
    }

    fn merge(mut self, other: Self) -> Self {
        self.flights += other.flights;
        for (sum, more) in self.outcomes.iter_mut().zip(other.outcomes) {
            *sum += more;
        }
        self.contacts += other.contacts;
        self.grazes += other.grazes;
        self.worst = self.worst.max(other.worst);
        self.disagreements.extend(other.disagreements);
        self
    }
}

impl fmt::Display for Structures {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { flights, contacts, grazes, worst, disagreements, .. } = self;
        writeln!(
            f,
            "{flights} flights, {contacts} contacts, {grazes} grazes; |g| <= {worst:.3} e"
        )?;
        for outcome in Outcome::ALL {
            write!(f, "{outcome:?} {}  ", self.count(outcome))?;
        }
        writeln!(f)?;
        disagreements.iter().try_for_each(|(index, what)| writeln!(f, "flight {index}: {what:?}"))
    }
}

/// Judges flights 0 ... `count` - 1 of a seed; `coupled`: of structures whose damping couples the
/// modes.
pub fn audit_structures(seed: u64, coupled: bool, count: u64) -> Structures {
    (0..count)
        .into_par_iter()
        .map(|index| judged(seed, coupled, index))
        .reduce(Structures::default, Structures::merge)
}

/// Judges flight `index` of a seed.
pub fn judged(seed: u64, coupled: bool, index: u64) -> Structures {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    rng.set_stream(index);
    let case = draw(&mut rng, coupled);
    let structure = case.structure();
    let span = StructureMotion::new(&structure).span();
    let judge = Judge::new(Exact::new(&case, span), level(&case, &structure, span, coupled), span);
    let searched = search(&case, &structure);
    let (outcome, errors, _) = judge.judge(&searched);
    let mut outcomes = [0; Outcome::ALL.len()];
    outcomes[outcome as usize] = 1;
    Structures {
        flights: 1,
        outcomes,
        contacts: u64::from(matches!(searched.last, Last::Contact(_))),
        grazes: searched.grazes.len() as u64,
        worst: errors.map_or(0.0, |errors| errors.level),
        disagreements: if outcome.is_disagreement() { vec![(index, outcome)] } else { vec![] },
    }
}

/// |g'| at most on a flight, over the bound V that the level has.
#[allow(dead_code)] // each user its own
pub fn fastest(seed: u64, coupled: bool, index: u64) -> f64 {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    rng.set_stream(index);
    let case = draw(&mut rng, coupled);
    let structure = case.structure();
    let span = StructureMotion::new(&structure).span();
    let mut exact = Exact::new(&case, span);
    let mut sample = exact.sample(Dd::ZERO, exact.start());
    let mut most = sample.rate.abs();
    while let Some(next) = exact.next(&sample) {
        most = most.max(next.rate.abs());
        sample = next;
    }
    most / level(&case, &structure, span, coupled).rate_bound
}

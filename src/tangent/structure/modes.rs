//! What a flight adds to derivatives by numbers of its equation, in closed form, where damping does not
//! couple the modes.
//!
//! With z_i = (p_i, p_i') of mode i less its answer to loads and drive, A_i its matrix, and B_ij what a
//! number makes of z_j in mode i,
//!
//! ```text
//! z_i' = A_i z_i,   dz_i' = A_i dz_i + sum of B_ij z_j
//! Y_ij A_j - A_i Y_ij = B_ij,   Y_ii A_i - A_i Y_ii + alpha_i + beta_i A_i = B_ii
//! dz(t) = Y z(t) + e^{At} (dz(0) - Y z(0)) + t (alpha + beta A) z(t)
//! ```
//!
//! Y is what the number makes of the shapes, alpha + beta A what it makes of frequency and damping. The
//! answers to loads and drive vary likewise, by a Y of theirs. The rows of Y for p' are those for p at z',
//! so that one matrix is enough. Y exists where no two modes are alike, none is damped critically, and
//! none resonates: else, and in flights so short that Y z(t) and Y z(0) cancel, the series of forced.rs
//! hold.

#![allow(clippy::inline_always)] // a flight is compiled for several instruction sets

use nalgebra::{Complex, DMatrix};
use smallvec::SmallVec;

use super::equation::Equation;
use super::rates::{Linearised, Varied};
use crate::flight::Trig;
use crate::flight::structure::Transitions;
use crate::numerics::lanes;
use crate::tangent::tolerances::MOST_MIXED;

/// N numbers.
type Numbers = SmallVec<[f64; 24]>;

/// As many numbers as a register holds.
const FOUR: usize = 4;

/// Rows of N numbers whose sums are taken, four of them at a time.
#[derive(Debug)]
struct Rows {
    rows: usize,
    /// The first four of all rows, the next four, and so on.
    fours: Vec<[f64; FOUR]>,
}

impl Rows {
    /// From a function of row and place.
    fn new((rows, count): (usize, usize), of: impl Fn(usize, usize) -> f64) -> Self {
        let mut fours = Vec::with_capacity(rows * count.div_ceil(FOUR));
        for first in (0..count).step_by(FOUR) {
            fours.extend((0..rows).map(|row| {
                std::array::from_fn(|j| if first + j < count { of(row, first + j) } else { 0.0 })
            }));
        }
        Self { rows, fours }
    }

    /// The sums of the rows, each so many times, for two lists of times.
    #[inline(always)]
    fn sums(&self, times: [&[f64]; 2], [to, also]: [&mut [f64]; 2]) {
        let parts = self.fours.chunks_exact(self.rows);
        for ((part, to), also) in parts.zip(to.chunks_mut(FOUR)).zip(also.chunks_mut(FOUR)) {
            let (mut first, mut second) = ([0.0; FOUR], [0.0; FOUR]);
            for ((row, x), y) in part.iter().zip(times[0]).zip(times[1]) {
                for j in 0..FOUR {
                    first[j] += row[j] * x;
                    second[j] += row[j] * y;
                }
            }
            to.copy_from_slice(&first[..to.len()]);
            also.copy_from_slice(&second[..also.len()]);
        }
    }
}

/// What flights add to all columns, worked out once.
#[derive(Debug)]
pub(super) struct ModalFlights {
    modes: Vec<Answer>,
    /// (M phi) by coordinate, and phi by mode.
    into_modes: Rows,
    shapes: Rows,
    omega: f64,
    columns: Vec<Option<Change>>,
}

/// A mode, and its answer to loads and drive.
#[derive(Debug, Clone, Copy)]
struct Answer {
    square: f64,
    twice_decay: f64,
    load: f64,
    /// Re(P e^{i psi}).
    drive: Complex<f64>,
}

/// What a number changes.
#[derive(Debug)]
struct Change {
    /// Rows of Y by the place of each mode, and then by the rate of each; none where it is 0.
    mixed: Option<Rows>,
    /// alpha, beta.
    own: Vec<[f64; 2]>,
    /// Of the answers to loads, and to the drive: place and rate.
    load: Vec<f64>,
    drive: Vec<[Complex<f64>; 2]>,
    /// Of the drive's frequency.
    faster: f64,
}

/// A flight: the modes at its start, the phase of the drive there and at the end, how long it lasts.
pub(super) struct Flown<'a> {
    pub q: &'a [f64],
    pub v: &'a [f64],
    pub phases: [Trig; 2],
    pub elapsed: f64,
    pub transitions: &'a Transitions,
}

impl Answer {
    /// w^2 + 2 c x + x^2 of an exponent x.
    fn at(&self, x: Complex<f64>) -> Complex<f64> {
        x * x + x * self.twice_decay + self.square
    }

    /// The row of Y to this mode from another: y chi(A) = b, chi(A) = A^2 + 2 c A + w^2.
    fn row_of_y(&self, from: &Self, (place, rate): (f64, f64)) -> [f64; 2] {
        // chi(A) = x + y A, A = [[0, 1], [-w^2, -2 c]].
        let (x, y) = (self.square - from.square, self.twice_decay - from.twice_decay);
        let matrix = [[x, y], [-from.square * y, x - from.twice_decay * y]];
        let determinant = matrix[0][0] * matrix[1][1] - matrix[0][1] * matrix[1][0];
        [
            (place * matrix[1][1] - rate * matrix[1][0]) / determinant,
            (rate * matrix[0][0] - place * matrix[0][1]) / determinant,
        ]
    }
}

impl ModalFlights {
    /// `None` where there is no Y, or a large one.
    pub fn new(
        of: &Linearised,
        equation: &Equation,
        acts: &[(usize, DMatrix<f64>)],
    ) -> Option<Self> {
        let structure = &of.structure;
        if structure.couples_modes() {
            return None;
        }
        let (all, omega) = (structure.modes(), structure.drive_frequency());
        let count = all.len();
        let answer = |mode: &crate::model::structure::Mode| {
            let (square, twice_decay) = (mode.frequency.value().powi(2), 2.0 * mode.decay_rate);
            let mut own = Answer { square, twice_decay, load: 0.0, drive: Complex::ZERO };
            let [still, turned] = [0.0, omega].map(|x| own.at(Complex::new(0.0, x)));
            own.load = if mode.load == 0.0 { 0.0 } else { mode.load / still.re };
            own.drive = if mode.drive == Complex::ZERO { mode.drive } else { mode.drive / turned };
            own
        };
        let modes: Vec<Answer> = all.iter().map(answer).collect();
        let scale = equation.fastest(of).max(f64::MIN_POSITIVE);
        let is_small = |(own, mode): (&Answer, &crate::model::structure::Mode)| {
            let (load, drive) = (mode.load.abs(), mode.drive.norm());
            let most = MOST_MIXED / (scale * scale);
            own.load.abs() <= most * load && own.drive.norm() <= most * drive
        };
        if !acts.is_empty() && !modes.iter().zip(all).all(is_small) {
            return None;
        }
        let mut found = Self {
            modes,
            into_modes: Rows::new((count, count), |k, i| all[i].row[k].hi),
            shapes: Rows::new((count, count), |i, k| all[i].shape[k]),
            omega,
            columns: (0..of.by.len()).map(|_| None).collect(),
        };
        for (at, change) in acts {
            found.columns[*at] = Some(found.change(&of.by[*at], change, scale)?);
        }
        Some(found)
    }

    /// What a number changes, from its matrix B over (p, p', 1, cos psi, sin psi).
    fn change(&self, varied: &Varied, b: &DMatrix<f64>, scale: f64) -> Option<Change> {
        let (count, omega, faster) = (self.modes.len(), self.omega, varied.by.drive_frequency);
        let mut mixed = Vec::new();
        let mut change = Change {
            mixed: None,
            own: Vec::with_capacity(count),
            load: Vec::with_capacity(count),
            drive: Vec::with_capacity(count),
            faster,
        };
        for (i, mode) in self.modes.iter().enumerate() {
            let row = b.row(count + i);
            // Of the answers of all modes: real, by the load; cos and sin as a complex number.
            let (mut load, mut drive) =
                (row[2 * count], Complex::new(row[2 * count + 1], -row[2 * count + 2]));
            let mut largest = 0.0f64;
            let mut size = 0.0f64;
            for (j, other) in self.modes.iter().enumerate() {
                let (place, rate) = (row[j], row[count + j]);
                load += place * other.load;
                drive += other.drive * Complex::new(place, rate * omega);
                if place == 0.0 && rate == 0.0 {
                    if j == i {
                        change.own.push([0.0; 2]);
                    }
                    continue;
                }
                largest = largest.max(place.abs() + rate.abs() * scale);
                if i == j {
                    let c = 0.5 * mode.twice_decay;
                    let beta = 0.5 * (place - c * rate) / (c * c - mode.square);
                    let alpha = 0.5 * rate + c * beta;
                    change.own.push([alpha, beta]);
                    size += (alpha.abs() / scale + beta.abs()) * scale * scale;
                } else {
                    let by = mode.row_of_y(other, (place, rate));
                    mixed.resize(2 * count * count, 0.0);
                    for (k, y) in by.into_iter().enumerate() {
                        mixed[(k * count + j) * count + i] = y;
                    }
                    size += (by[0].abs() + by[1].abs() * scale) * scale * scale;
                }
            }
            change.load.push(if load == 0.0 { 0.0 } else { load / mode.square });
            let by_drive =
                drive + mode.drive * Complex::new(2.0 * omega, -mode.twice_decay) * faster;
            let turn = Complex::new(0.0, 1.0);
            let stiffness = mode.at(turn * omega);
            let place = if by_drive == Complex::ZERO { by_drive } else { by_drive / stiffness };
            change.drive.push([place, turn * (place * omega + mode.drive * faster)]);
            let answers = change.load[i].abs() * scale * scale / load.abs().max(f64::MIN_POSITIVE);
            let driven =
                if by_drive == Complex::ZERO { 0.0 } else { scale * scale / stiffness.norm() };
            let mixed = size / largest.max(f64::MIN_POSITIVE);
            // Not a number either.
            if ![mixed, answers, driven].iter().all(|&part| part <= MOST_MIXED) {
                return None;
            }
        }
        if !mixed.is_empty() {
            change.mixed = Some(Rows::new((2 * count, count), |row, i| mixed[row * count + i]));
        }
        Some(change)
    }

    /// Carries the columns along a flight; `turns`: by how much the phase of the drive varies in each
    /// at its start.
    pub fn carry(&self, flown: &Flown<'_>, turns: &[f64], columns: &mut [f64]) {
        lanes::narrow(Carried { of: self, flown, turns, columns });
    }
}

/// Columns along a flight, compiled for each set of vector instructions.
struct Carried<'a> {
    of: &'a ModalFlights,
    flown: &'a Flown<'a>,
    turns: &'a [f64],
    columns: &'a mut [f64],
}

/// The motion of all modes less their answers: places and rates, and rates and accelerations.
struct Free {
    state: Numbers,
    rates: Numbers,
}

impl Free {
    /// From places and rates.
    #[inline(always)]
    fn new(state: Numbers, modes: &[Answer]) -> Self {
        let (place, rate) = state.split_at(modes.len());
        let each = place.iter().zip(rate).zip(modes);
        let second = each.map(|((p, v), mode)| -(mode.square * p + mode.twice_decay * v));
        let rates = rate.iter().copied().chain(second).collect();
        Self { state, rates }
    }
}

impl Change {
    /// Adds so many times Y (z, answers) to a column in the modes.
    #[inline(always)]
    fn add(
        &self,
        factor: f64,
        (of, free): (&ModalFlights, &Free),
        (phase, turn): (Trig, f64),
        (places, rates): (&mut [f64], &mut [f64]),
    ) {
        let count = places.len();
        if let Some(mixed) = &self.mixed {
            let (mut place, mut rate) =
                (Numbers::from_elem(0.0, count), Numbers::from_elem(0.0, count));
            mixed.sums([&free.state, &free.rates], [&mut place, &mut rate]);
            let to = places.iter_mut().zip(rates.iter_mut()).zip(place.iter().zip(&rate));
            for ((to_place, to_rate), (place, rate)) in to {
                *to_place += factor * place;
                *to_rate += factor * rate;
            }
        }
        let own = self.own.iter().zip(&self.drive).zip(&self.load).zip(&of.modes);
        let to = places.iter_mut().zip(rates).zip(free.state.iter().zip(&free.rates));
        for (((to_place, to_rate), (p, v)), (((own, drive), load), mode)) in to.zip(own) {
            // dP + i P dpsi, and its rate.
            let turned = Complex::new(-mode.drive.im, mode.drive.re) * turn;
            let (place, rate) = (drive[0] + turned, drive[1] - mode.drive * (of.omega * turn));
            let moved = |x: Complex<f64>| x.re * phase.cos - x.im * phase.sin;
            *to_place += factor * (load + moved(place));
            *to_rate += factor * (moved(rate) + own[0] * p + own[1] * v);
        }
    }
}

impl pulp::NullaryFnOnce for Carried<'_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let Self { of, flown, turns, columns } = self;
        let modes = &of.modes;
        let count = modes.len();
        let moved = |x: Complex<f64>, phase: Trig| x.re * phase.cos - x.im * phase.sin;
        let [begin, end] = flown.phases;
        let mut state = Numbers::from_elem(0.0, 2 * count);
        let (place, rate) = state.split_at_mut(count);
        of.into_modes.sums([flown.q, flown.v], [&mut *place, &mut *rate]);
        for ((place, rate), mode) in place.iter_mut().zip(rate.iter_mut()).zip(modes) {
            *place -= mode.load + moved(mode.drive, begin);
            *rate -= of.omega * moved(Complex::new(-mode.drive.im, mode.drive.re), begin);
        }
        let mut later = Numbers::from_elem(0.0, 2 * count);
        let (later_place, later_rate) = later.split_at_mut(count);
        let to = later_place.iter_mut().zip(later_rate).zip(place.iter().zip(rate.iter()));
        for (((to_place, to_rate), (x, v)), [by_place, by_rate]) in to.zip(flown.transitions) {
            *to_place = by_place.0 * x + by_rate.0 * v;
            *to_rate = by_place.1 * x + by_rate.1 * v;
        }
        let (first, last) = (Free::new(state, modes), Free::new(later, modes));
        let mut x = Numbers::from_elem(0.0, count);
        let mut u = x.clone();
        for ((column, change), &turn) in
            columns.chunks_exact_mut(2 * count).zip(&of.columns).zip(turns)
        {
            let (q, v) = column.split_at_mut(count);
            of.into_modes.sums([q, v], [&mut x, &mut u]);
            if let Some(change) = change {
                change.add(-1.0, (of, &first), (begin, turn), (&mut x, &mut u));
            }
            for ((x, u), of) in x.iter_mut().zip(&mut u).zip(flown.transitions) {
                let [by_place, by_rate] = *of;
                (*x, *u) = (by_place.0 * *x + by_rate.0 * *u, by_place.1 * *x + by_rate.1 * *u);
            }
            if let Some(change) = change {
                let turn = turn + change.faster * flown.elapsed;
                change.add(1.0, (of, &last), (end, turn), (&mut x, &mut u));
                let free = last.state.iter().zip(&last.rates).zip(&last.rates[count..]);
                let to = x.iter_mut().zip(&mut u).zip(&change.own);
                for (((x, u), own), ((p, v), a)) in to.zip(free) {
                    let [alpha, beta] = own.map(|own| own * flown.elapsed);
                    *x += alpha * p + beta * v;
                    *u += alpha * v + beta * a;
                }
            }
            of.shapes.sums([&x, &u], [q, v]);
        }
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use nalgebra::DMatrix;

    use super::super::forced::Steppers;
    use super::super::rates::Linearised;
    use crate::model::state::Clock;
    use crate::model::structure::{Stop, Structure, StructureState, Variation};
    use crate::numerics::double_double::DoubleDouble;
    use crate::simulate::Anchor;

    fn chain(ratios: [f64; 3]) -> Structure {
        let mass = vec![vec![1.0, 0.1, 0.0], vec![0.1, 2.0, 0.0], vec![0.0, 0.0, 0.7]];
        let stiffness = vec![vec![3.0, -1.0, 0.0], vec![-1.0, 2.0, -0.5], vec![0.0, -0.5, 0.9]];
        Structure::builder(mass, stiffness)
            .stop(Stop::new([1.0, 0.0, 0.0], 1e3, 0.8))
            .damping_ratios(ratios.to_vec())
            .static_load(vec![0.2, 0.0, -0.3])
            .drive(vec![1.0.into(), nalgebra::Complex::new(0.2, -0.4), 0.5.into()], 0.7, 0.3)
            .build()
            .unwrap()
    }

    /// The closed form against the steps, which know nothing of modes, for flights of all lengths.
    #[test]
    fn flights_in_closed_form_are_those_in_steps() {
        let names = [
            "stiffness[0,1]",
            "stiffness[2,2]",
            "damping[0,2]",
            "mass[1,1]",
            "drive_frequency",
            "phase",
            "q_1",
        ];
        for ratios in [[0.0; 3], [0.02, 0.05, 0.3], [0.1, 0.4, 1.3]] {
            let structure = chain(ratios);
            let mut by: Vec<_> =
                names.iter().map(|name| Variation::named(name, &structure).unwrap()).collect();
            by.push(Variation { static_load: Some(vec![1.0, 0.0, 2.0]), ..Variation::default() });
            let drive_amplitude = Some(vec![0.0.into(), 1.0.into(), nalgebra::Complex::i()]);
            by.push(Variation { drive_amplitude, ..Variation::default() });
            let of = Linearised::along(&structure, by);
            let steppers = Arc::new(Steppers::default());
            let state = StructureState::new(&[0.3, -0.2, 0.5], &[1.0, 0.4, -0.7]);
            let begin = Clock::new(2, 1.1);
            let leg = Anchor::apart(begin, state);
            assert!(steppers.flies_at_once(&of, &leg), "{ratios:?}");
            for elapsed in [0.05, 0.3, 1.0, 4.0, 17.0, 60.0] {
                let elapsed = DoubleDouble::new(elapsed);
                let over = ([begin, of.drive().advance(begin, elapsed)], elapsed);
                let start = DMatrix::from_fn(6, of.by.len(), |i, j| ((i + 2 * j) as f64).sin());
                let (mut closed, mut stepped) = (start.clone(), start);
                steppers.carry(&of, &leg, over, &mut closed).unwrap();
                steppers.carry_in_steps(&of, &leg, over, &mut stepped).unwrap();
                let size = 1.0 + stepped.amax();
                let off = (&closed - &stepped).amax() / size;
                assert!(off < 1e-13, "{ratios:?}, {}: off by {off:e} of {size}", elapsed.hi);
            }
        }
    }

    #[test]
    fn modes_that_are_alike_or_resonate_have_no_closed_form() {
        let alike = |stiffness: f64, omega: f64| {
            let structure = Structure::builder(
                vec![vec![1.0, 0.0], vec![0.0, 1.0]],
                vec![vec![1.0, 0.0], vec![0.0, stiffness]],
            )
            .drive(vec![1.0.into(), 0.0.into()], omega, 0.0)
            .build()
            .unwrap();
            let by = vec![Variation::named("stiffness[0,1]", &structure).unwrap()];
            let of = Linearised::along(&structure, by);
            let rest = StructureState::new(&[0.0, 0.0], &[0.0, 0.0]);
            Steppers::default().flies_at_once(&of, &Anchor::apart(Clock::START, rest))
        };
        assert!(alike(2.0, 0.5));
        assert!(!alike(1.0, 0.5) && !alike(1.0 + 1e-4, 0.5));
        assert!(!alike(2.0, 1.0) && !alike(2.0, 1.0 + 1e-4));
    }
}

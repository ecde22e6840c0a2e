//! Derivatives of one body's free flight by the numbers of its equation of motion,
//! x'' + 2 zeta w x' + w^2 x = f cos psi + c.
//!
//! They solve the same equation from rest, forced by what the number changes,
//!
//! ```text
//! f: cos psi      c: 1      psi: -f sin psi      w: -2 zeta x' - 2 w x      zeta: -2 w x'
//! omega: -f s sin psi.
//! ```
//!
//! The first three are flights from rest under another load, in closed form (flight.rs). The sources
//! of the others are flights themselves. With z = (x, x', 1, cos psi, sin psi), over any time the motion
//! grows by C z and a derivative d = (dx, dx') by X d + L z, where X are the first two columns of C;
//! over twice the time by
//!
//! ```text
//! C -> 2 C + C T      L -> 2 L + X L + L T      T: what z grows by
//! ```
//!
//! ([`Steps`]). So whole steps are binary, and what is left is a short Taylor series: the same lines for
//! every damping, at resonance, and for short times.

#![allow(clippy::inline_always)] // what calls them is compiled for several instruction sets

mod coefficient;
mod hop;
mod response;
mod rows;

pub(super) use coefficient::{ByEquation, Coefficient};
pub(super) use hop::Hops;
pub(super) use response::Flown;

use std::sync::OnceLock;

use coefficient::{ALL, COEFFICIENTS};
use response::Response;
use rows::{grow, over, sum};
use smallvec::SmallVec;

use crate::flight::{Drive, Oscillator, Trig};
use crate::model::oblique::Body;
use crate::numerics::double_double::DoubleDouble;
use crate::numerics::elementary;
use crate::tangent::long_flight::longest_part;
use crate::tangent::tolerances::{
    LEAST_TERM, LONGEST_SERIES, LONGEST_STEP, MOST_STEPS, SHORTEST_PART,
};

/// Displacement and rate.
pub(super) type Pair = [f64; 2];

/// Derivatives of displacement and rate after a time by the phase of the drive at the start.
pub(super) fn by_phase(
    oscillator: &Oscillator,
    drive: &Drive,
    start: Trig,
    elapsed: DoubleDouble,
) -> Pair {
    if !oscillator.is_forced() {
        return [0.0; 2];
    }
    // The response to -f sin psi alone, from rest.
    let ahead = Trig { cos: -start.sin, sin: start.cos };
    let turn = drive.turned_far(ahead, elapsed);
    oscillator
        .without_constant(|driven| {
            driven.after(&driven.flight(0.0, 0.0, ahead), 0.0, elapsed, &turn)
        })
        .into()
}

/// z = (x, x', 1, cos psi, sin psi).
type Along = [f64; 5];
/// Two rows over z, column by column, as what displacement and rate grow by; the last two are nothing.
type Rows = [f64; 12];
/// Over two components.
type Narrow = [f64; 4];
/// Some coefficients, in the order of all.
type Coefficients = SmallVec<[Coefficient; COEFFICIENTS]>;
/// One for each coefficient.
type Each<T> = [T; COEFFICIENTS];

/// Most steps of powers of two; longer flights take the longest more than once.
const LEVELS: usize = 24;

/// How one body's flights change with coefficients of its equation: what is worked out once.
#[derive(Debug)]
pub(super) struct Steps {
    body: Body<f64>,
    omega: f64,
    /// What is asked for; with the frequency of the drive its phase, too.
    wanted: Coefficients,
    response: Response,
    /// Of what is asked for that by which the response differentiates long flights, and the rest.
    told: Coefficients,
    stepped: Coefficients,
    /// Length of the shortest steps, a power of two, and the fastest rate.
    length: f64,
    fastest: f64,
    series: OnceLock<Box<Series>>,
    /// Steps of 2^k lengths.
    levels: [OnceLock<Box<Level>>; LEVELS],
}

/// Taylor series over up to half a length forward and back: their terms of orders 1, 2 ... in lengths.
#[derive(Debug)]
struct Series {
    /// C, and X.
    change: Vec<Rows>,
    growth: Vec<Narrow>,
    /// L of what is asked for.
    added: SmallVec<[(Coefficient, Terms); 2]>,
}

/// The terms of rows over z, or over two components from this one on.
#[derive(Debug)]
enum Terms {
    Wide(Vec<Rows>),
    Narrow(usize, Vec<Narrow>),
}

/// A step of this time.
#[derive(Debug)]
struct Level {
    time: f64,
    /// cos(omega t) - 1 and sin(omega t).
    turn: (f64, f64),
    /// C, and L of what is asked for; that of omega from where its phase is the drive's.
    change: Rows,
    added: Each<Rows>,
}

impl Steps {
    /// Of a body driven at `omega`.
    pub fn new(body: &Body<f64>, omega: f64, wanted: &[Coefficient]) -> Self {
        let with_phase = wanted.contains(&Coefficient::Omega);
        let is_wanted = |coefficient: &Coefficient| {
            wanted.contains(coefficient) || (with_phase && *coefficient == Coefficient::Phase)
        };
        let fastest = omega.max(body.natural).max(2.0 * body.damping * body.natural);
        // Where nothing turns or decays the series are finite, in any unit.
        let length =
            if fastest > 0.0 { (LONGEST_SERIES / fastest).log2().floor().exp2() } else { 1.0 };
        let wanted: Coefficients = ALL.into_iter().filter(is_wanted).collect();
        let response = Response::new(body, omega, fastest);
        let (told, stepped) = wanted.iter().copied().partition(|&of| response.tells(of));
        Self {
            body: *body,
            omega,
            response,
            wanted,
            told,
            stepped,
            length,
            fastest,
            series: OnceLock::new(),
            levels: [const { OnceLock::new() }; LEVELS],
        }
    }

    /// The longest time over which the derivatives keep their digits.
    pub fn longest_part(&self) -> f64 {
        if self.stepped.is_empty() {
            return f64::INFINITY;
        }
        longest_part((self.fastest, self.body.natural.max(self.omega)), SHORTEST_PART)
    }

    /// Whether nothing is asked for.
    #[inline(always)]
    pub fn is_idle(&self) -> bool {
        self.wanted.is_empty()
    }

    /// As [`Self::after`], of a flight whose ends are known.
    #[inline(always)]
    pub fn between(&self, start: (f64, f64), flown: &Flown) -> Option<ByEquation> {
        // No closures: they would not be compiled for what calls this.
        let mut columns = [[0.0; 2]; COEFFICIENTS];
        if self.told.is_empty() || !self.response.after((&self.told, &mut columns), start, flown) {
            return self.after(start, flown.start, flown.time);
        }
        let all = self.step((&self.stepped, &mut columns), start, flown.start, flown.time);
        all.then_some(ByEquation(columns))
    }

    /// Derivatives after `time` of a flight from displacement and rate, at this phase of the drive; `None`
    /// for bodies so strongly damped that too many steps would be needed.
    #[inline(always)]
    pub fn after(&self, state: (f64, f64), start: Trig, time: f64) -> Option<ByEquation> {
        let mut columns = [[0.0; 2]; COEFFICIENTS];
        let all = self.step((&self.wanted, &mut columns), state, start, time);
        all.then_some(ByEquation(columns))
    }

    /// The columns of some of what is asked for, if not too many steps are needed.
    #[inline(always)]
    fn step(
        &self,
        (wanted, columns): (&[Coefficient], &mut Each<Pair>),
        (x, v): (f64, f64),
        start: Trig,
        time: f64,
    ) -> bool {
        if wanted.is_empty() || time == 0.0 {
            return true;
        }
        let steps = time * self.fastest / LONGEST_STEP;
        if steps.is_nan() || steps > MOST_STEPS {
            return false;
        }
        let mut at = [x, v, 1.0, start.cos, start.sin];
        let whole = if self.fastest > 0.0 { (time / self.length).round_ties_even() } else { 0.0 };
        #[allow(clippy::cast_sign_loss, clippy::cast_possible_truncation)] // few, and not negative
        let mut left = whole as u64;
        let mut done = 0.0;
        while left > 0 {
            let k = (left.ilog2() as usize).min(LEVELS - 1);
            let level = self.level(k);
            level.take(wanted, (done, &mut at), columns);
            done += level.time;
            left -= 1 << k;
        }
        let series = self.known_series();
        series.take(wanted, (time - done) / self.length, (done, &at), columns);
        true
    }

    /// A step of 2^k lengths.
    #[inline(always)]
    fn level(&self, k: usize) -> &Level {
        self.levels[k].get_or_init(|| Box::new(self.made(k)))
    }

    #[inline(never)]
    fn made(&self, k: usize) -> Level {
        if k > 0 {
            return self.twice(self.level(k - 1));
        }
        let series = self.known_series();
        let mut added = [[0.0; 12]; COEFFICIENTS];
        for (wanted, terms) in &series.added {
            let wanted = *wanted;
            match terms {
                Terms::Wide(terms) => added[wanted as usize] = sum(terms, 0.5),
                Terms::Narrow(place, terms) => {
                    added[wanted as usize][2 * place..][..4].copy_from_slice(&sum(terms, 0.5));
                }
            }
        }
        let time = 0.5 * self.length;
        let turn = elementary::turn(self.omega * time, 0.0);
        self.twice(&Level { time, turn, change: sum(&series.change, 0.5), added })
    }

    fn twice(&self, level: &Level) -> Level {
        let Level { time, change, added, .. } = level;
        let mut twice = [[0.0; 12]; COEFFICIENTS];
        for &wanted in &self.wanted {
            let own = &added[wanted as usize];
            let grown = level.grown(own);
            let ahead = &added[Coefficient::Phase as usize];
            let grown_ahead = level.grown(ahead);
            // The phase is ahead in the second half.
            let later = if wanted == Coefficient::Omega { *time } else { 0.0 };
            twice[wanted as usize] = std::array::from_fn(|i| {
                let column = i / 2 * 2;
                let turned = change[i % 2] * own[column] + change[2 + i % 2] * own[column + 1];
                2.0 * own[i] + turned + grown[i] + later * (ahead[i] + grown_ahead[i])
            });
        }
        let grown = level.grown(change);
        Level {
            time: 2.0 * time,
            turn: elementary::turn(self.omega * (2.0 * time), 0.0),
            change: std::array::from_fn(|i| 2.0 * change[i] + grown[i]),
            added: twice,
        }
    }

    #[inline(always)]
    fn known_series(&self) -> &Series {
        self.series.get_or_init(|| Box::new(self.made_series()))
    }

    #[inline(never)]
    fn made_series(&self) -> Series {
        let half = 0.5 * self.fastest * self.length;
        let (mut orders, mut size) = (2, half);
        while size > LEAST_TERM {
            size *= half / orders as f64;
            orders += 1;
        }
        // Where nothing turns or decays the terms end with t^3.
        let orders = orders.max(3);
        let mut change = vec![[0.0; 12]; orders];
        let mut added = [const { Vec::new() }; COEFFICIENTS];
        for &wanted in &self.wanted {
            added[wanted as usize] = vec![[0.0; 12]; orders];
        }
        for place in 0..5 {
            let (motion, own) = self.terms(place, orders);
            let pair = |terms: &[f64], order: usize| {
                [terms[order], (order + 1) as f64 * terms[order + 1] / self.length]
            };
            for order in 1..=orders {
                let put = |rows: &mut Vec<Rows>, terms: &[f64]| {
                    rows[order - 1][2 * place..][..2].copy_from_slice(&pair(terms, order));
                };
                put(&mut change, &motion);
                for &wanted in &self.wanted {
                    put(&mut added[wanted as usize], &own[wanted as usize]);
                }
            }
        }
        let narrow = |rows: &Rows, place: usize| std::array::from_fn(|i| rows[2 * place + i]);
        let terms = |&wanted: &Coefficient| {
            let rows = std::mem::take(&mut added[wanted as usize]);
            let terms = match wanted.place() {
                None => Terms::Wide(rows),
                Some(place) => {
                    Terms::Narrow(place, rows.iter().map(|rows| narrow(rows, place)).collect())
                }
            };
            (wanted, terms)
        };
        Series {
            added: self.wanted.iter().map(terms).collect(),
            growth: change.iter().map(|rows| narrow(rows, 0)).collect(),
            change,
        }
    }

    /// Terms of the displacement from one component of z, and of its derivatives, up to an order. Time is
    /// counted in lengths, so that every coefficient is a term.
    fn terms(&self, place: usize, orders: usize) -> (Vec<f64>, Each<Vec<f64>>) {
        let Self { body, omega, length: h, .. } = self;
        let mut at = [0.0; 5];
        at[place] = 1.0;
        let [x, v, one, mut cos, mut sin] = at;
        let square = h * h;
        let (mut one, mut sin_before) = (one * square, 0.0);
        let (turn, decay) = (body.natural * h, 2.0 * body.damping * body.natural * h);
        let force = body.amplitude * square;
        let mut motion = vec![x, v * h];
        let mut own: Each<Vec<f64>> = std::array::from_fn(|_| vec![0.0; 2]);
        for n in 0..orders {
            let next = (n + 1) as f64;
            let rate = next * motion[n + 1];
            let grow = |terms: &mut Vec<f64>, source: f64| {
                let forces = source - decay * next * terms[n + 1] - turn * turn * terms[n];
                terms.push(forces / (next * (next + 1.0)));
            };
            for &wanted in &self.wanted {
                let source = match wanted {
                    Coefficient::Natural => -2.0 * (body.damping * h * rate + turn * h * motion[n]),
                    Coefficient::Damping => -2.0 * turn * rate,
                    Coefficient::Omega => -force * h * sin_before,
                    Coefficient::Phase => -force * sin,
                    Coefficient::Amplitude => square * cos,
                    Coefficient::Constant => one,
                };
                grow(&mut own[wanted as usize], source);
            }
            grow(&mut motion, force * cos + body.constant * one);
            sin_before = sin;
            let angle = omega * h / next;
            (cos, sin) = (-angle * sin, angle * cos);
            one = 0.0;
        }
        (motion, own)
    }
}

impl Series {
    /// A time, in lengths, that begins at `before` since the start of the flight.
    #[inline(always)]
    fn take(
        &self,
        wanted: &[Coefficient],
        time: f64,
        (before, at): (f64, &Along),
        columns: &mut Each<Pair>,
    ) {
        let growth = sum(&self.growth, time);
        let mut ahead = [0.0; 2];
        for &(wanted, ref terms) in self.added.iter().filter(|(of, _)| wanted.contains(of)) {
            let mut added = match terms {
                Terms::Wide(terms) => over(&sum(terms, time)[..10], at),
                Terms::Narrow(place, terms) => over(&sum(terms, time), &at[*place..]),
            };
            if wanted == Coefficient::Phase {
                ahead = added;
            }
            if wanted == Coefficient::Omega {
                added = [added[0] + before * ahead[0], added[1] + before * ahead[1]];
            }
            grow(&mut columns[wanted as usize], &growth, added);
        }
    }
}

impl Level {
    /// Rows over what z changes by, as rows over z.
    fn grown(&self, rows: &Rows) -> Rows {
        let (cos, sin) = self.turn;
        std::array::from_fn(|i| {
            let (column, row) = (i / 2, i % 2);
            let free =
                rows[row] * self.change[2 * column] + rows[2 + row] * self.change[2 * column + 1];
            let turned = match column {
                3 => rows[6 + row] * cos + rows[8 + row] * sin,
                4 => rows[8 + row] * cos - rows[6 + row] * sin,
                _ => 0.0,
            };
            free + turned
        })
    }

    /// This step, which begins at the time `before` since the start of the flight.
    #[inline(always)]
    fn take(
        &self,
        wanted: &[Coefficient],
        (before, at): (f64, &mut Along),
        columns: &mut Each<Pair>,
    ) {
        let mut ahead = [0.0; 2];
        for &wanted in wanted {
            let rows = &self.added[wanted as usize];
            let mut added = match wanted.place() {
                None => over(&rows[..10], at),
                Some(place) => over(&rows[2 * place..][..4], &at[place..]),
            };
            if wanted == Coefficient::Phase {
                ahead = added;
            }
            if wanted == Coefficient::Omega {
                added = [added[0] + before * ahead[0], added[1] + before * ahead[1]];
            }
            grow(&mut columns[wanted as usize], &self.change, added);
        }
        let [x, v] = over(&self.change[..10], at);
        let (cos, sin) = self.turn;
        *at = [
            at[0] + x,
            at[1] + v,
            1.0,
            at[3] + (at[3] * cos - at[4] * sin),
            at[4] + (at[4] * cos + at[3] * sin),
        ];
    }
}

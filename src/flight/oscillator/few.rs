//! The Taylor series of a few bodies' motions together, for short times.

#![allow(clippy::inline_always)] // what calls them is compiled for several instruction sets
#![allow(clippy::needless_range_loop)] // loops over lanes read best with their index

use super::Equation;
use super::equation::INVERSE;

/// What the series take from the equations of N bodies.
#[derive(Debug, Clone)]
pub(crate) struct FewEquations<const N: usize> {
    natural_squared: [f64; N],
    decay_rate: [f64; N],
    forcing: [f64; N],
    load: [f64; N],
    omega: [f64; N],
    short: [f64; N],
}

impl<const N: usize> Default for FewEquations<N> {
    fn default() -> Self {
        let none = [0.0; N];
        Self {
            natural_squared: none,
            decay_rate: none,
            forcing: none,
            load: none,
            omega: none,
            short: none,
        }
    }
}

impl<const N: usize> FewEquations<N> {
    /// Sets one of them.
    pub fn set(&mut self, j: usize, equation: &Equation) {
        self.natural_squared[j] = equation.natural_squared;
        self.decay_rate[j] = equation.decay_rate;
        self.forcing[j] = equation.forcing;
        self.load[j] = equation.load;
        self.omega[j] = equation.omega;
        self.short[j] = equation.short;
    }

    /// Increments and rates at a time that is short for some of them; for the others they mean
    /// nothing. As Series::at, to the order that the fastest of those needs.
    #[inline(always)]
    pub fn series(
        &self,
        x: [f64; N],
        v: [f64; N],
        (mut cos, mut sin): ([f64; N], [f64; N]),
        s: f64,
    ) -> ([f64; N], [f64; N]) {
        let mut most = 0;
        for j in 0..N {
            if s <= self.short[j] {
                let equation = Equation { short: self.short[j], ..Equation::default() };
                most = most.max(equation.series_order(s));
            }
        }
        let (mut lower, mut upper, mut load) = (x, v, self.load);
        for j in 0..N {
            (cos[j], sin[j]) = (self.forcing[j] * cos[j], self.forcing[j] * sin[j]);
        }
        let (mut increment, mut rate, mut power) = ([0.0; N], [0.0; N], 1.0);
        for n in 1..=most {
            let (order, part, next_part) = (n as f64, INVERSE[n], INVERSE[n + 1]);
            let before = power;
            power *= s;
            for j in 0..N {
                rate[j] += order * upper[j] * before;
                increment[j] += upper[j] * power;
                let c2 = 2.0 * self.decay_rate[j];
                let free = cos[j] - c2 * order * upper[j] - self.natural_squared[j] * lower[j];
                let next = (free + load[j]) * (part * next_part);
                (lower[j], upper[j], load[j]) = (upper[j], next, 0.0);
                (cos[j], sin[j]) = (-self.omega[j] * sin[j] * part, self.omega[j] * cos[j] * part);
            }
        }
        (increment, rate)
    }
}

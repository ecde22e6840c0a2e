//! Bounds of one body's motion: of its derivatives over a local flight, and of its size for ever.

#![allow(clippy::inline_always)] // what calls them is compiled for several instruction sets

use super::{BodyFlight, Decay, Oscillator, Response};
use crate::flight::Trig;

/// Bounds of |x'|, |x''|, |x'''|, |x''''| during a local flight.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Bounds(pub [f64; 4]);

impl Oscillator {
    /// Amplitudes that the free part of a flight and its steady response never exceed; not finite
    /// where there is no such bound.
    #[inline(always)]
    pub fn amplitudes(&self, f: &BodyFlight) -> (f64, f64) {
        if !self.is_steady() {
            return (f64::INFINITY, f64::INFINITY);
        }
        // The energy v^2 + w^2 x^2 of a free oscillation does not grow.
        (
            (f.rate * f.rate / self.equation.natural_squared + f.a * f.a).sqrt(),
            self.equation.steady_size,
        )
    }

    /// Whether [`Oscillator::growth`] bounds its motion: nothing of it is a response that cancels.
    pub fn grows(&self) -> bool {
        matches!(self.response, Response::Unforced | Response::FromRest(_))
    }

    /// By what |x'|, and the sum of the terms of x', may grow per unit time in a local flight: what
    /// accelerates the body, and what its damper takes away.
    #[inline(always)]
    pub fn growth(&self, f: &BodyFlight) -> f64 {
        let [speed, acceleration, ..] = self.derivative_bounds(f);
        acceleration + 2.0 * self.equation.decay_rate * speed
    }

    /// By what the rounding of the displacement grows more than a bound of |x'| says: a (C - 1) and
    /// b S, b = v + c a, nearly cancel where damping is beyond critical.
    #[inline(always)]
    pub fn speed_of_rounding(&self, f: &BodyFlight) -> f64 {
        match self.decay {
            Decay::Overdamped { .. } => self.equation.decay_rate * f.a.abs(),
            _ => 0.0,
        }
    }

    /// Amplitude of the difference between the steady responses of two bodies.
    #[inline(always)]
    pub fn steady_difference(&self, other: &Self) -> f64 {
        let (one, two) = (&self.equation, &other.equation);
        let (re, im) = (one.steady_re - two.steady_re, one.steady_im - two.steady_im);
        (re * re + im * im).sqrt()
    }

    /// Bounds of the derivatives 1 to 6 over a local flight. Where the steady response or the
    /// equilibrium is not used, drive and load add at most |f| + |load| per unit time, and the equation
    /// of motion gives the higher derivatives.
    #[inline(always)]
    pub fn derivative_bounds(&self, f: &BodyFlight) -> [f64; 6] {
        if self.is_steady() {
            return self.equation.steady_bounds(f);
        }
        let (w2, c2) = (self.equation.natural_squared, 2.0 * self.equation.decay_rate);
        let mut bounds = [0.0; 6];
        let mut drive = self.equation.forcing.abs();
        let load = drive + self.equation.load.abs();
        let energy = (f.v * f.v + w2 * f.x * f.x).sqrt() + load * self.span;
        bounds[0] = energy;
        bounds[1] = load + c2 * energy + w2.sqrt() * energy;
        for n in 2..6 {
            drive *= self.equation.omega;
            bounds[n] = drive + c2 * bounds[n - 1] + w2 * bounds[n - 2];
        }
        bounds
    }

    /// Bounds over a local flight. Every derivative of a free oscillation is a free oscillation,
    /// whose energy does not grow: |x_h^(n+1)| <= sqrt(x_h^(n+1)(0)^2 + w^2 x_h^(n)(0)^2), and the
    /// steady response adds |P| omega^(n+1). Near resonance, where that may be huge, the same
    /// holds for the whole motion with |f| omega^n per unit time, and |load| without an equilibrium;
    /// the smaller bound is taken.
    pub fn bounds(&self, f: &BodyFlight, start: Trig) -> Bounds {
        let equation = &self.equation;
        let omega = equation.omega;
        if self.is_steady() {
            return self.energy_bounds(f.a, f.rate, [0.0; 3], equation.steady_size * omega, 0.0);
        }
        // About the equilibrium, if there is one, there is no load.
        let x = f.x - equation.equilibrium;
        let load = equation.load - equation.natural_squared * equation.equilibrium;
        let loads = [
            equation.forcing * start.cos + load,
            -equation.forcing * omega * start.sin,
            -equation.forcing * omega * omega * start.cos,
        ];
        let (extra, loaded) = (equation.forcing.abs() * self.span, load.abs() * self.span);
        let driven = self.energy_bounds(x, f.v, loads, extra, loaded);
        let (p, q) = equation.steady_start(start);
        let loads = [load, 0.0, 0.0];
        let extra = equation.steady_size * omega;
        let free = self.energy_bounds(x - p, f.v - omega * q, loads, extra, loaded);
        // f64::min passes over the NaN of an infinite steady response.
        Bounds(std::array::from_fn(|n| driven.0[n].min(free.0[n])))
    }

    /// sqrt(x^(n+1)^2 + w^2 x^(n)^2) + extra omega^n for n = 0 ... 3, and `loaded` more for n = 0, the
    /// derivatives at the start from the equation of motion under `load` (f cos psi + load and its
    /// derivatives).
    fn energy_bounds(&self, x: f64, v: f64, load: [f64; 3], mut extra: f64, loaded: f64) -> Bounds {
        let (w2, c2) = (self.equation.natural_squared, 2.0 * self.equation.decay_rate);
        let mut bounds = [0.0; 4];
        let (mut lower, mut upper) = (x, v);
        for (n, bound) in bounds.iter_mut().enumerate() {
            *bound = (upper * upper + w2 * lower * lower).sqrt() + extra;
            extra *= self.equation.omega;
            if n < 3 {
                (lower, upper) = (upper, load[n] - c2 * upper - w2 * lower);
            }
        }
        bounds[0] += loaded;
        Bounds(bounds)
    }
}

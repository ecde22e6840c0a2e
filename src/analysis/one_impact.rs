//! The condition of periodicity of a motion with one impact in n drive periods without friction, in
//! interval arithmetic: for proofs of where it has roots and where it has none.
//!
//! Given the angle x1 of the impact, the conditions are linear in the other unknowns. With D(kappa)
//! their determinant and Nc, Ns the numerators of the cosine and the sine of the phase,
//!
//!   F(x1) = Nc^2 + Ns^2 - D^2 = 0,   D = d(kappa),   N = x1 p(kappa) + y q(kappa) + s(kappa),
//!
//! y = sigma(x1) - delta, kappa = sigma', sigma the sine, or the identity for direct contact; d, p,
//! q, s quadratic, s = 0 without constant loads. This is (35) with its poles multiplied out (docs/orbits.md; where the
//! coefficients come from: python/vibroimpact/single_impact/algebraic.py).
//!
//! ```
//! use vibroimpact::Contact;
//! use vibroimpact::analysis::one_impact::{Interval, OneImpact};
//!
//! let quadratic = |a, b, c| [a, b, c].map(Interval::point);
//! let zero = quadratic(0.0, 0.0, 0.0);
//! // D = 1, Nc = 2 x1, Ns = 0: F = 4 x1^2 - 1.
//! let condition = OneImpact {
//!     contact: Contact::Direct,
//!     gap: 0.0,
//!     determinant: quadratic(1.0, 0.0, 0.0),
//!     numerators: [[quadratic(2.0, 0.0, 0.0), zero], [zero, zero]],
//!     loaded: None,
//! };
//! let enclosed = condition.enclose(Interval { lo: 0.4, hi: 0.6 });
//! assert!(enclosed.value.holds_zero() && enclosed.slope.lo > 0.0);
//! assert!(!condition.enclose(Interval { lo: 0.6, hi: 0.7 }).value.holds_zero());
//! ```

use rayon::prelude::*;

use crate::model::parameters::Contact;
pub use crate::numerics::interval::Interval;

/// Fewer boxes than this are not worth another thread: they take some 30 us.
const FEWEST_BOXES: usize = 256;

/// Coefficients of 1, kappa and kappa^2.
type Quadratic = [Interval; 3];

/// The condition of one system.
#[derive(Debug, Clone)]
pub struct OneImpact {
    /// Its geometry.
    pub contact: Contact,
    /// delta.
    pub gap: f64,
    /// d of D.
    pub determinant: Quadratic,
    /// (p, q) of Nc and of Ns.
    pub numerators: [[Quadratic; 2]; 2],
    /// s of Nc and of Ns, where there are constant loads.
    pub loaded: Option<[Quadratic; 2]>,
}

/// A function over an interval: all its values and all its slopes.
#[derive(Debug, Clone, Copy)]
pub struct Enclosed {
    /// F.
    pub value: Interval,
    /// Its derivative by x1; the whole line if F has no zero there, where nobody asks for it.
    pub slope: Interval,
}

impl OneImpact {
    /// F over an interval of x1: D, Nc, Ns by their mean-value form, q(m) + q'(X)(X - m), then F
    /// likewise.
    #[must_use]
    pub fn enclose(&self, x: Interval) -> Enclosed {
        let place = self.place(x);
        let natural = self.values(&place);
        let value = sum_of_squares(natural);
        // One form that excludes zero is enough.
        if !value.holds_zero() {
            return Enclosed { value, slope: Interval::WHOLE };
        }
        let mut parts = self.parts(&place, natural);
        // Of a point the two forms are the same.
        if x.lo == x.hi {
            return Enclosed { value, slope: slope(parts) };
        }
        let middle = Interval::point(x.middle());
        let offset = x - middle;
        let at_middle = self.values(&self.place(middle));
        for (part, mean) in parts.iter_mut().zip(at_middle) {
            part.value = part.value.meet(mean + part.slope * offset);
        }
        let slope = slope(parts);
        let value = sum_of_squares(parts.map(|part| part.value));
        Enclosed { value: value.meet(sum_of_squares(at_middle) + slope * offset), slope }
    }

    /// F over many intervals, each with its condition, on all processors.
    #[must_use]
    pub fn enclose_all(boxes: &[(&Self, Interval)]) -> Vec<Enclosed> {
        let each = boxes.par_iter().with_min_len(FEWEST_BOXES);
        each.map(|(condition, x)| condition.enclose(*x)).collect()
    }

    fn place(&self, x: Interval) -> Place {
        let one = Interval::point(1.0);
        let (tip, kappa, bend) = match self.contact {
            Contact::Oblique => {
                let (sin, cos) = x.sin_cos();
                (sin, cos, Interval { lo: -sin.hi, hi: -sin.lo })
            }
            Contact::Direct => (x, one, Interval::point(0.0)),
        };
        Place { x, y: tip - Interval::point(self.gap), kappa, bend }
    }

    /// D, Nc, Ns.
    fn values(&self, place: &Place) -> [Interval; 3] {
        let numerator =
            |[p, q]: &[Quadratic; 2]| place.x * place.value(p) + place.y * place.value(q);
        let [cosine, sine] = self.numerators.each_ref().map(numerator);
        let (cosine, sine) = match &self.loaded {
            Some([c, s]) => (cosine + place.value(c), sine + place.value(s)),
            None => (cosine, sine),
        };
        [place.value(&self.determinant), cosine, sine]
    }

    /// These values with their slopes.
    fn parts(&self, place: &Place, [d, c, s]: [Interval; 3]) -> [Enclosed; 3] {
        let Place { x, y, kappa, .. } = *place;
        let numerator = |[p, q]: &[Quadratic; 2]| {
            place.value(p) + x * place.slope(p) + kappa * place.value(q) + y * place.slope(q)
        };
        let [cosine, sine] = self.numerators.each_ref().map(numerator);
        let (cosine, sine) = match &self.loaded {
            Some([c, s]) => (cosine + place.slope(c), sine + place.slope(s)),
            None => (cosine, sine),
        };
        [
            Enclosed { value: d, slope: place.slope(&self.determinant) },
            Enclosed { value: c, slope: cosine },
            Enclosed { value: s, slope: sine },
        ]
    }
}

/// x1, y, kappa = sigma' and sigma''.
struct Place {
    x: Interval,
    y: Interval,
    kappa: Interval,
    bend: Interval,
}

impl Place {
    fn value(&self, &[a, b, c]: &Quadratic) -> Interval {
        a + self.kappa * (b + c * self.kappa)
    }

    /// Derivative by x1.
    fn slope(&self, &[_, b, c]: &Quadratic) -> Interval {
        (b + (c * self.kappa).twice()) * self.bend
    }
}

/// Nc^2 + Ns^2 - D^2.
fn sum_of_squares([d, c, s]: [Interval; 3]) -> Interval {
    c.square() + s.square() - d.square()
}

/// Its derivative.
fn slope([d, c, s]: [Enclosed; 3]) -> Interval {
    (c.value * c.slope + s.value * s.slope - d.value * d.slope).twice()
}

#[cfg(test)]
mod tests {
    use super::OneImpact;
    use crate::model::parameters::Contact;
    use crate::numerics::interval::Interval;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    /// F in floats, and what its terms add up to.
    fn value(one: &OneImpact, x: f64) -> (f64, f64) {
        let (tip, kappa) = match one.contact {
            Contact::Oblique => x.sin_cos(),
            Contact::Direct => (x, 1.0),
        };
        let quadratic = |c: &super::Quadratic| c[0].lo + kappa * (c[1].lo + kappa * c[2].lo);
        let numerator = |k: usize| {
            let [p, q] = &one.numerators[k];
            let loaded = one.loaded.as_ref().map_or(0.0, |loaded| quadratic(&loaded[k]));
            x * quadratic(p) + (tip - one.gap) * quadratic(q) + loaded
        };
        let [cosine, sine] = [0, 1].map(numerator);
        let d = quadratic(&one.determinant);
        (cosine * cosine + sine * sine - d * d, cosine * cosine + sine * sine + d * d)
    }

    fn drawn(random: &mut ChaCha8Rng) -> OneImpact {
        let mut quadratic =
            || std::array::from_fn(|_| Interval::point(random.random_range(-1.0..1.0)));
        let determinant = quadratic();
        let numerators = [[quadratic(), quadratic()], [quadratic(), quadratic()]];
        let loads = [quadratic(), quadratic()];
        let loaded = random.random_bool(0.5).then_some(loads);
        let contact = if random.random_bool(0.5) { Contact::Oblique } else { Contact::Direct };
        OneImpact { contact, gap: random.random_range(-1.0..1.0), determinant, numerators, loaded }
    }

    #[test]
    fn values_and_slopes_are_inside() {
        let mut random = ChaCha8Rng::seed_from_u64(2);
        let mut excluded = 0;
        for _ in 0..5_000 {
            let one = drawn(&mut random);
            let lo = random.random_range(-2.0..2.0);
            let x = Interval { lo, hi: lo + 10f64.powf(random.random_range(-9.0..-0.5)) };
            let enclosed = one.enclose(x);
            excluded += usize::from(!enclosed.value.holds_zero());
            let ((from, rounding), (to, more)) = (value(&one, x.lo), value(&one, x.hi));
            // Rounding of the comparison, not of the enclosure.
            let slack = 1e-14 * (rounding + more);
            for f in [from, to, value(&one, x.middle()).0] {
                let Interval { lo, hi } = enclosed.value;
                assert!(lo - slack <= f && f <= hi + slack, "{one:?} at {x:?}");
            }
            let mean = Interval { lo: to - from - slack, hi: to - from + slack };
            let width = Interval { lo: x.hi - x.lo, hi: x.hi - x.lo };
            let change = enclosed.slope * width;
            assert!(change.lo <= mean.hi && mean.lo <= change.hi, "{one:?} at {x:?}");
        }
        assert!(excluded > 3_000, "{excluded}");
    }

    #[test]
    fn a_point_is_enclosed_within_rounding() {
        let mut random = ChaCha8Rng::seed_from_u64(3);
        for _ in 0..1_000 {
            let one = drawn(&mut random);
            let x = random.random_range(-2.0..2.0);
            let Interval { lo, hi } = one.enclose(Interval::point(x)).value;
            assert!(hi - lo <= 1e-13 * (1.0 + value(&one, x).1), "{one:?} at {x}");
        }
    }
}

//! Dense search for the first contact of a flight in double-double arithmetic: the independent
//! party of the contact audit (docs/contact-audit.md).
//!
//! The flight is sampled densely; between neighbouring samples the maxima of g are located
//! (g' = 0) and roots refined in double-double. No proof, but no bound to get wrong either.

use super::double_double::Dd;

/// The first steps after a start in contact are halved at least so often.
const START_HALVINGS: i32 = 12;

/// Gap function and its first two derivatives.
#[derive(Debug, Clone, Copy)]
pub struct Gap {
    pub value: Dd,
    pub rate: Dd,
    pub second: Dd,
}

/// A sampled instant.
#[derive(Debug, Clone, Copy)]
pub struct Sample<P> {
    pub time: Dd,
    pub point: P,
    /// g, double-double where it is near 0, and g', g''.
    pub gap: Dd,
    pub rate: f64,
    pub second: f64,
}

/// A motion with a gap, known to about 30 digits and sampled up to the end of a flight.
pub trait ExactMotion {
    /// The bodies at one instant.
    type Point: Copy;

    /// Whether the flight starts on the contact.
    fn touching(&self) -> bool;
    /// The bodies at the start of the flight.
    fn start(&self) -> Self::Point;
    /// The longest step between samples.
    fn first_step(&self) -> f64;
    /// `point` a short time h later (either sign).
    fn later(&self, point: &Self::Point, h: Dd) -> Self::Point;
    /// g, g', g'' in double-double.
    fn gap(&self, point: &Self::Point) -> Gap;
    /// The sample at a point.
    fn sample(&self, time: Dd, point: Self::Point) -> Sample<Self::Point>;
    /// The sample after this one, at most at the end of the flight.
    fn next(&mut self, from: &Sample<Self::Point>) -> Option<Sample<Self::Point>>;
}

/// A maximum of g, or a rising root.
#[derive(Debug, Clone, Copy)]
pub struct Place<P> {
    pub time: Dd,
    pub point: P,
    pub gap: Gap,
}

/// What the dense search saw: humps whose top is within the stated level of 0, in order, up to the
/// first place where g rises above the level.
#[derive(Debug, Clone)]
pub struct Seen<P> {
    pub humps: Vec<Place<P>>,
    /// Rising root of the first rise above the level.
    pub contact: Option<Place<P>>,
    /// The end of the flight, if there was no such rise.
    pub end: Option<Sample<P>>,
    pub samples: u64,
}

/// The search itself, for every motion.
pub trait DenseSearch: ExactMotion {
    /// Zero of `f` (value, derivative) at most `end` after `a`, where f changes its sign once,
    /// upwards if `rising`. Newton's steps, bisection where they leave the bracket.
    fn zero(
        &self,
        a: &Sample<Self::Point>,
        end: Dd,
        f: impl Fn(&Gap) -> (Dd, Dd),
        rising: bool,
    ) -> Place<Self::Point> {
        let (mut low, mut high) = (Dd::ZERO, end);
        let mut h = end.scale(0.5);
        let at = |h: Dd| {
            let point = self.later(&a.point, h);
            Place { time: a.time + h, point, gap: self.gap(&point) }
        };
        let mut place = at(h);
        for _ in 0..200 {
            let (value, slope) = f(&place.gap);
            if value.is_negative() == rising {
                low = h;
            } else {
                high = h;
            }
            if value.hi == 0.0 || (high - low).hi <= 1e-31 * end.hi {
                break;
            }
            let newton = if slope.hi == 0.0 { low } else { h - value.divide(slope) };
            let inside = !(newton - low).is_negative() && !(high - newton).is_negative();
            let next = if inside { newton } else { (low + high).scale(0.5) };
            let moved = (next - h).abs();
            h = next;
            place = at(h);
            if inside && moved.hi <= 1e-18 * end.hi {
                // Newton's step doubles the digits.
                break;
            }
        }
        place
    }

    /// First rising root after `a` (g < 0) and before `b` (g >= 0).
    fn root(&self, a: &Sample<Self::Point>, b: &Sample<Self::Point>) -> Place<Self::Point> {
        self.zero(a, b.time - a.time, |gap| (gap.value, gap.rate), true)
    }

    /// Maximum of g between neighbouring samples, if there is one.
    fn maximum(
        &self,
        a: &Sample<Self::Point>,
        b: &Sample<Self::Point>,
    ) -> Option<Place<Self::Point>> {
        let length = b.time - a.time;
        let top = |from: &Sample<Self::Point>, end: Dd| {
            self.zero(from, end, |gap| (gap.rate, gap.second), false)
        };
        match (a.rate > 0.0, b.rate > 0.0) {
            (true, false) => Some(top(a, length)),
            (false, true) => None,
            // Two extrema may hide where g'' changes its sign.
            (sign, _) => {
                let turns = if sign {
                    a.second < 0.0 && b.second > 0.0
                } else {
                    a.second > 0.0 && b.second < 0.0
                };
                if !turns {
                    return None;
                }
                let middle = self.flattest(a, length);
                let rate = self.gap(&self.later(&a.point, middle)).rate;
                match (sign, rate.is_negative()) {
                    (true, true) => Some(top(a, middle)),
                    (false, false) => {
                        let from = self.sample(a.time + middle, self.later(&a.point, middle));
                        Some(top(&from, length - middle))
                    }
                    _ => None,
                }
            }
        }
    }

    /// Local time after `a` at which g'' changes its sign, by bisection.
    fn flattest(&self, a: &Sample<Self::Point>, length: Dd) -> Dd {
        let (mut low, mut high) = (Dd::ZERO, length);
        for _ in 0..40 {
            let h = (low + high).scale(0.5);
            let second = self.gap(&self.later(&a.point, h)).second;
            if second.is_negative() == (a.second < 0.0) { low = h } else { high = h }
        }
        low
    }

    /// Whether g may reach `-level` between the samples.
    fn may_reach(a: &Sample<Self::Point>, b: &Sample<Self::Point>, level: f64) -> bool {
        let length = (b.time - a.time).hi;
        let rise = length * (a.rate.abs() + b.rate.abs())
            + length * length * (a.second.abs() + b.second.abs());
        a.gap.hi.max(b.gap.hi) + rise >= -level
    }

    /// The samples before the first regular one: none, or from a start in contact geometrically
    /// growing steps, the first of which is still on the way apart.
    fn first_samples(&self) -> Vec<Sample<Self::Point>> {
        let start = self.sample(Dd::ZERO, self.start());
        if !self.touching() {
            return vec![start];
        }
        let at = |k: i32| {
            let h = Dd::new(self.first_step()).scale(2f64.powi(-k));
            self.sample(h, self.later(&self.start(), h))
        };
        let mut samples: Vec<Sample<Self::Point>> = (0..=START_HALVINGS).map(at).collect();
        while let Some(last) = samples.last() {
            let apart = last.gap.is_negative() && last.rate < 0.0;
            if apart || samples.len() > 200 {
                break;
            }
            samples.push(at(samples.len() as i32));
        }
        samples.reverse();
        samples
    }

    /// Searches the whole flight for the first rise of g above `level(t)`.
    fn search(&mut self, level: impl Fn(f64) -> f64) -> Seen<Self::Point> {
        let mut seen = Seen { humps: Vec::new(), contact: None, end: None, samples: 0 };
        let mut before = self.first_samples().into_iter();
        let Some(mut a) = before.next() else { return seen };
        let mut apart = a;
        loop {
            let Some(b) = before.next().or_else(|| self.next(&a)) else {
                seen.end = Some(a);
                return seen;
            };
            seen.samples += 1;
            let threshold = level(b.time.hi);
            // Bracket of a rise above the level: up to the top between, or up to b.
            let mut above = (b.gap.hi > threshold).then_some(b);
            if Self::may_reach(&a, &b, threshold)
                && let Some(place) = self.maximum(&a, &b)
            {
                if place.gap.value.hi > threshold {
                    above = Some(self.sample(place.time, place.point));
                } else if place.gap.value.hi >= -threshold {
                    seen.humps.push(place);
                }
            }
            if let Some(above) = above {
                seen.contact = Some(self.root(&apart, &above));
                return seen;
            }
            if b.gap.is_negative() {
                apart = b;
            }
            a = b;
        }
    }

    /// Maxima of g over the whole flight that are higher than all before; after an impact its
    /// start does not count.
    fn record_humps(&mut self) -> Vec<Place<Self::Point>> {
        let mut records = Vec::new();
        let mut before = self.first_samples().into_iter();
        let Some(mut a) = before.next() else { return records };
        let mut highest = if self.touching() { f64::NEG_INFINITY } else { a.gap.hi };
        while let Some(b) = before.next().or_else(|| self.next(&a)) {
            if a.rate > 0.0 {
                let top = a.gap.hi.max(b.gap.hi);
                if b.rate <= 0.0 && top > highest {
                    records.extend(self.maximum(&a, &b));
                }
                highest = highest.max(top);
            }
            a = b;
        }
        records
    }
}

impl<M: ExactMotion> DenseSearch for M {}

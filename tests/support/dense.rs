//! Dense search for the first contact of a flight in double-double arithmetic: the independent
//! party of the contact audit. It shares no code and no formula of the motion with the library.
//!
//! The forced linear system is autonomous in (x1, v1, x2, v2, cos psi, sin psi). Its one-step
//! propagator is the Taylor series of the matrix exponential; states are stepped with it. Between
//! neighbouring samples the maxima of g are located (g' = 0) and roots refined in double-double.
//! Equations of motion and gap: docs/theory.md, section 1.

use vibroimpact::{Contact, State, System};

use super::double_double::Dd;

/// Samples over a flight at least; more where the pendulum turns fast.
const STEPS: f64 = 256.0;
/// Largest turn of the pendulum between samples (oblique contact).
const LARGEST_TURN: f64 = 0.1;
/// Steps are halved at most so often.
const LEVELS: usize = 16;
/// The first steps after a start in contact are halved at least so often.
const START_HALVINGS: i32 = 12;

/// Displacements, rates and drive at one instant.
#[derive(Debug, Clone, Copy)]
pub struct Point {
    pub x: [Dd; 2],
    pub v: [Dd; 2],
    cos: Dd,
    sin: Dd,
}

/// Gap function and its first two derivatives.
#[derive(Debug, Clone, Copy)]
pub struct Gap {
    pub value: Dd,
    pub rate: Dd,
    pub second: Dd,
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
    start: Point,
    span: f64,
    propagators: [Option<Propagator>; LEVELS],
}

/// Maps of (x, v) and (cos, sin) over one step: x' = a x + b v + c cos + d sin, the same for v.
#[derive(Debug, Clone, Copy)]
struct Propagator {
    rows: [[[Dd; 4]; 2]; 2],
    turn: [Dd; 2],
}

/// A sampled instant.
#[derive(Debug, Clone, Copy)]
struct Sample {
    time: Dd,
    point: Point,
    /// g, double-double where it is near 0, and g', g''.
    gap: Dd,
    rate: f64,
    second: f64,
}

/// A maximum of g, or a rising root.
#[derive(Debug, Clone, Copy)]
pub struct Place {
    pub time: Dd,
    pub point: Point,
    pub gap: Gap,
}

/// What the dense search saw: humps whose top is within the stated level of 0, in order, up to the
/// first place where g rises above the level.
#[derive(Debug, Clone, Default)]
pub struct Seen {
    pub humps: Vec<Place>,
    /// Rising root of the first rise above the level.
    pub contact: Option<Place>,
    pub samples: u64,
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
            start: Point { x: [x1, x2], v: [dd(state.v1), dd(state.v2)], cos, sin },
            span,
            propagators: [None; LEVELS],
        }
    }

    /// Gap function at the start.
    pub fn start_gap(&self) -> Gap {
        self.gap(&self.start)
    }

    /// `point` a short time h later (either sign), by its Taylor series.
    pub fn later(&self, point: &Point, h: Dd) -> Point {
        let mut term = *point;
        let mut sum = *point;
        let mut small = 0;
        for n in 1..200 {
            let k = h.over(f64::from(n));
            let Point { x, v, cos, sin } = term;
            for i in 0..2 {
                let force = self.forcing[i] * cos - self.damping[i] * v[i];
                term.x[i] = k * v[i];
                term.v[i] = k * (force - self.stiffness[i] * x[i]);
            }
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

    fn propagator(&mut self, level: usize) -> Propagator {
        if let Some(known) = self.propagators[level] {
            return known;
        }
        let h = Dd::new(self.step(level));
        let (zero, one) = ([Dd::ZERO; 2], [Dd::ONE; 2]);
        let unit = |x, v, cos, sin| self.later(&Point { x, v, cos, sin }, h);
        let columns = [
            unit(one, zero, Dd::ZERO, Dd::ZERO),
            unit(zero, one, Dd::ZERO, Dd::ZERO),
            unit(zero, zero, Dd::ONE, Dd::ZERO),
            unit(zero, zero, Dd::ZERO, Dd::ONE),
        ];
        let rows = std::array::from_fn(|i| [columns.map(|c| c.x[i]), columns.map(|c| c.v[i])]);
        let made = Propagator { rows, turn: [columns[2].cos, columns[2].sin] };
        self.propagators[level] = Some(made);
        made
    }

    fn step(&self, level: usize) -> f64 {
        self.span / STEPS / f64::from(1u32 << level)
    }

    /// g, g', g'' in double-double.
    pub fn gap(&self, point: &Point) -> Gap {
        let Point { x, v, cos, .. } = *point;
        let a: [Dd; 2] = std::array::from_fn(|i| {
            self.forcing[i] * cos - self.damping[i] * v[i] - self.stiffness[i] * x[i]
        });
        let [value, rate, second] = if self.direct {
            [x[0], v[0], a[0]]
        } else {
            let (sin, cos) = x[0].sin_cos();
            [sin, v[0] * cos, a[0] * cos - v[0] * v[0] * sin]
        };
        Gap { value: value - x[1] - self.delta, rate: rate - v[1], second: second - a[1] }
    }

    /// |tip| + |x2| + |delta|.
    pub fn size(&self, point: &Point) -> f64 {
        let x1 = point.x[0].hi;
        let tip = if self.direct { x1 } else { x1.sin() };
        tip.abs() + point.x[1].hi.abs() + self.delta.hi.abs()
    }

    fn sample(&self, time: Dd, point: Point) -> Sample {
        let Point { x, v, cos, .. } = point;
        let a: [f64; 2] = std::array::from_fn(|i| {
            self.forcing[i].hi * cos.hi - self.damping[i].hi * v[i].hi - self.stiffness[i].hi * x[i].hi
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

    /// The sample after this one, at most at the end of the flight.
    fn next(&mut self, from: &Sample) -> Option<Sample> {
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
        let map = |i: usize, [a, b, c, d]: [Dd; 4]| {
            let free = a * x[i] + b * v[i];
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

    /// The samples before the first regular one: none, or from a start in contact geometrically
    /// growing steps, the first of which is still on the way apart.
    fn first_samples(&self) -> Vec<Sample> {
        let start = self.sample(Dd::ZERO, self.start);
        if !self.touching {
            return vec![start];
        }
        let at = |k: i32| {
            let h = Dd::new(self.step(0)).scale(2f64.powi(-k));
            self.sample(h, self.later(&self.start, h))
        };
        let mut samples: Vec<Sample> = (0..=START_HALVINGS).map(at).collect();
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

    /// Zero of `f` (value, derivative) at most `end` after `a`, where f changes its sign once,
    /// upwards if `rising`. Newton's steps, bisection where they leave the bracket.
    fn zero(&self, a: &Sample, end: Dd, f: impl Fn(&Gap) -> (Dd, Dd), rising: bool) -> Place {
        let (mut low, mut high) = (Dd::ZERO, end);
        let mut h = end.scale(0.5);
        let at = |h: Dd| {
            let point = self.later(&a.point, h);
            Place { time: a.time + h, point, gap: self.gap(&point) }
        };
        let mut place = at(h);
        for _ in 0..200 {
            let (value, slope) = f(&place.gap);
            if value.is_negative() == rising { low = h } else { high = h }
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
    fn root(&self, a: &Sample, b: &Sample) -> Place {
        self.zero(a, b.time - a.time, |gap| (gap.value, gap.rate), true)
    }

    /// Maximum of g between neighbouring samples, if there is one.
    fn maximum(&self, a: &Sample, b: &Sample) -> Option<Place> {
        let length = b.time - a.time;
        let top = |from: &Sample, end: Dd| self.zero(from, end, |gap| (gap.rate, gap.second), false);
        match (a.rate > 0.0, b.rate > 0.0) {
            (true, false) => Some(top(a, length)),
            (false, true) => None,
            // Two extrema may hide where g'' changes its sign.
            (sign, _) => {
                let turns = if sign { a.second < 0.0 && b.second > 0.0 } else {
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
    fn flattest(&self, a: &Sample, length: Dd) -> Dd {
        let (mut low, mut high) = (Dd::ZERO, length);
        for _ in 0..40 {
            let h = (low + high).scale(0.5);
            let second = self.gap(&self.later(&a.point, h)).second;
            if second.is_negative() == (a.second < 0.0) { low = h } else { high = h }
        }
        low
    }

    /// Whether g may reach `-level` between the samples.
    fn may_reach(a: &Sample, b: &Sample, level: f64) -> bool {
        let length = (b.time - a.time).hi;
        let rise = length * (a.rate.abs() + b.rate.abs())
            + length * length * (a.second.abs() + b.second.abs());
        a.gap.hi.max(b.gap.hi) + rise >= -level
    }

    /// Searches the whole flight for the first rise of g above `level(t)`.
    pub fn search(&mut self, level: impl Fn(f64) -> f64) -> Seen {
        let mut seen = Seen::default();
        let mut before = self.first_samples().into_iter();
        let Some(mut a) = before.next() else { return seen };
        let mut apart = a;
        loop {
            let Some(b) = before.next().or_else(|| self.next(&a)) else { return seen };
            seen.samples += 1;
            let threshold = level(b.time.hi);
            // Bracket of a rise above the level: up to the top between, or up to b.
            let mut above = (b.gap.hi > threshold).then_some(b);
            if Self::may_reach(&a, &b, threshold) {
                if let Some(place) = self.maximum(&a, &b) {
                    if place.gap.value.hi > threshold {
                        above = Some(self.sample(place.time, place.point));
                    } else if place.gap.value.hi >= -threshold {
                        seen.humps.push(place);
                    }
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

    /// Maxima of g over the whole flight that are higher than all before.
    pub fn record_humps(&mut self) -> Vec<Place> {
        let mut records = Vec::new();
        let mut before = self.first_samples().into_iter();
        let Some(mut a) = before.next() else { return records };
        let mut highest = a.gap.hi;
        while let Some(b) = before.next().or_else(|| self.next(&a)) {
            if a.rate > 0.0 && b.rate <= 0.0 && a.gap.hi.max(b.gap.hi) > highest {
                records.extend(self.maximum(&a, &b));
            }
            highest = highest.max(b.gap.hi);
            a = b;
        }
        records
    }
}

//! A second model: two coupled, damped oscillators, the first of which is driven and meets a stop.
//! Its gap g = x1 - delta is a sum of three damped sinusoids. It asks nothing of this machine, and
//! passes the same audit as the pendulum does (docs/contact-audit.md): random flights against a
//! dense search, here along the Taylor series of the equations of motion,
//!
//! > M x'' + (a M + b K) x' + K x = (f cos(omega t + phi), 0).

#[path = "../../tests/support/dense.rs"]
#[allow(dead_code)]
mod dense;
#[path = "../../tests/support/double_double.rs"]
#[allow(dead_code)]
pub(crate) mod double_double;
#[path = "../../tests/support/judge.rs"]
#[allow(dead_code)]
mod judge;
#[path = "../../tests/support/linear_motion.rs"]
#[allow(dead_code)]
mod linear_motion;

use std::f64::consts::{PI, TAU};

use dense::{DenseSearch, Place};
use double_double::Dd;
use judge::{Judge, Last, Level, Outcome, Searched, Told};
use linear_motion::{Case, Exact, Point};
use nalgebra::Complex;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::first_contact::{Found, Start, Touch, first_contact};
use super::gap::{Gap, GapBounds, GapPoint, Higher};
use super::steps::{Jet, Jets, LEVELS, ScanStart, SteppedGap, Weights, sextic_remainder};
use super::tolerances::{BOUND_MARGIN, SCAN_SPANS, SCAN_STEPS};
use crate::numerics::lanes::LANES;

/// Terms of the motion: two modes and the response to the drive.
type Terms = [Complex<f64>; 3];

/// The amplitudes of the terms come from some two dozen roundings, where the search allows for the
/// four of an increment (`FLIGHT_NOISE`): so much larger is the bound of |g'| that it is told.
const AMPLITUDE_ROUNDING: f64 = 4.0;

/// Parameters, and displacement and velocity of both bodies at the start.
#[derive(Debug, Clone, Copy)]
struct Oscillators {
    mass: [f64; 2],
    stiffness: [f64; 2],
    coupling: f64,
    /// Of the masses and of the stiffnesses: a, b.
    damping: [f64; 2],
    force: f64,
    frequency: f64,
    phase: f64,
    delta: f64,
    x: [f64; 2],
    v: [f64; 2],
    touching: bool,
}

/// The gap along a flight.
#[derive(Debug, Clone)]
struct StopGap {
    start: Oscillators,
    amplitudes: Terms,
    rates: Terms,
    span: f64,
    weights: [Weights; LEVELS],
    turns: [[Terms; LANES]; LEVELS],
    /// Factor on the bounds of the derivatives from the fourth on: 1, or too small.
    trust: f64,
}

/// e^z - 1, relatively exact for small z.
fn exp_minus_1(z: Complex<f64>) -> Complex<f64> {
    let (sin, cos) = z.im.sin_cos();
    let half = (0.5 * z.im).sin();
    Complex::new(z.re.exp_m1() * cos - 2.0 * half * half, z.re.exp() * sin)
}

impl Oscillators {
    /// Amplitudes in x1, and rates, of the terms of the motion.
    fn terms(&self) -> (Terms, Terms) {
        let [m1, m2] = self.mass;
        let [k1, k2] = self.stiffness;
        let coupling = self.coupling;
        // Of the symmetric matrix M^(-1/2) K M^(-1/2).
        let (first, second) = ((k1 + coupling) / m1, (k2 + coupling) / m2);
        let mixed = -coupling / (m1 * m2).sqrt();
        let half = (0.5 * (first - second)).hypot(mixed);
        let largest = 0.5 * (first + second) + half;
        let smallest = (k1 * k2 + coupling * (k1 + k2)) / (m1 * m2) / largest;
        let (sin, cos) = (0.5 * (2.0 * mixed).atan2(first - second)).sin_cos();
        let steady_rate = Complex::new(0.0, self.frequency);
        let (mut amplitudes, mut rates) = ([Complex::default(); 3], [steady_rate; 3]);
        for (k, (square, along)) in
            [(largest, [cos, sin]), (smallest, [-sin, cos])].into_iter().enumerate()
        {
            let shape = [along[0] / m1.sqrt(), along[1] / m2.sqrt()];
            let coordinate = |of: [f64; 2]| m1 * shape[0] * of[0] + m2 * shape[1] * of[1];
            let decay = 0.5 * (self.damping[0] + self.damping[1] * square);
            let turns = (square - decay * decay).sqrt();
            let stiffness =
                Complex::new(square - self.frequency.powi(2), 2.0 * decay * self.frequency);
            let steady = Complex::from_polar(shape[0] * self.force, self.phase) / stiffness;
            let p = coordinate(self.x) - steady.re;
            let rate = coordinate(self.v) - (steady_rate * steady).re;
            amplitudes[k] = Complex::new(p, -(rate + decay * p) / turns) * shape[0];
            amplitudes[2] += steady * shape[0];
            rates[k] = Complex::new(-decay, turns);
        }
        (amplitudes, rates)
    }

    /// The flight in double-double.
    fn exact(&self, span: f64) -> Exact {
        let Self { mass: [m1, m2], stiffness: [k1, k2], coupling, damping: [a, b], .. } = *self;
        let stiffness = [[k1 + coupling, -coupling], [-coupling, k2 + coupling]];
        let [mut damping, mass] = [stiffness.map(|row| row.map(|k| b * k)), [[m1, 0.0], [0.0, m2]]];
        (damping[0][0], damping[1][1]) = (damping[0][0] + a * m1, damping[1][1] + a * m2);
        let rows = |of: [[f64; 2]; 2]| of.map(|row| row.to_vec()).to_vec();
        let case = Case {
            mass: rows(mass),
            stiffness: rows(stiffness),
            damping: rows(damping),
            load: vec![0.0; 2],
            drive: vec![Complex::from(self.force), Complex::default()],
            frequency: self.frequency,
            phase: self.phase,
            normal: vec![1.0, 0.0],
            gap: self.delta,
            moving: [0.0; 2],
            q: self.x.to_vec(),
            v: self.v.to_vec(),
            touching: self.touching,
        };
        Exact::new(&case, span)
    }
}

impl StopGap {
    fn new(start: Oscillators, trust: f64) -> Self {
        let (amplitudes, rates) = start.terms();
        let fastest = rates.iter().map(|rate| rate.norm()).fold(0.0, f64::max);
        let span = 2.0 * TAU / fastest;
        let step = |level: usize| SCAN_STEPS * span / (LANES << level) as f64;
        let turns = std::array::from_fn(|level| {
            std::array::from_fn(|j| rates.map(|rate| (rate * (step(level) * (j + 1) as f64)).exp()))
        });
        let weights = std::array::from_fn(|level| Weights::new(step(level)));
        Self { start, amplitudes, rates, span, weights, turns, trust }
    }

    /// The derivative of this order of the sum of some terms.
    fn derivative(&self, terms: &Terms, order: i32) -> f64 {
        terms.iter().zip(&self.rates).map(|(term, rate)| (term * rate.powi(order)).re).sum()
    }

    /// Sum of the sizes of a derivative's terms. They do not grow with time.
    fn bound(&self, order: i32) -> f64 {
        let sizes = self.amplitudes.iter().zip(&self.rates);
        sizes.map(|(term, rate)| term.norm() * rate.norm().powi(order)).sum::<f64>() * BOUND_MARGIN
    }

    fn jet(&self, terms: &Terms) -> Jet {
        let value: f64 = terms.iter().map(|term| term.re).sum();
        Jet {
            value: value - self.start.delta,
            rate: self.derivative(terms, 1),
            second: self.derivative(terms, 2),
        }
    }
}

impl Gap for StopGap {
    /// The terms.
    type Instant = Terms;
    type State = ();

    fn start(&self) -> (f64, f64) {
        let (x1, delta) = (self.start.x[0], self.start.delta);
        (x1 - delta, x1.abs() + delta.abs())
    }

    fn bounds(&self) -> GapBounds {
        GapBounds {
            slope_noise: 0.0,
            rate: AMPLITUDE_ROUNDING * self.bound(1),
            fourth: self.trust * self.bound(4),
            fifth: self.trust * self.bound(5),
            sixth: self.trust * self.bound(6),
        }
    }

    fn change(&self, s: f64) -> (GapPoint, Self::Instant) {
        let mut value = 0.0;
        let terms: Terms = std::array::from_fn(|k| {
            let change = self.amplitudes[k] * exp_minus_1(self.rates[k] * s);
            value += change.re;
            self.amplitudes[k] + change
        });
        let [rate, second, third] = [1, 2, 3].map(|order| self.derivative(&terms, order));
        let point = GapPoint { value, rate, second, third };
        (point, terms)
    }

    fn higher(&self, terms: &Self::Instant) -> Higher {
        let [fourth, fifth] = [4, 5].map(|order| self.derivative(terms, order));
        Higher { fourth, fifth }
    }

    fn state(&self, _: &Self::Instant, _: f64) {}
}

impl SteppedGap for StopGap {
    type Place = Terms;
    type Places = [Terms; LANES];

    fn scan_start(&self) -> ScanStart {
        ScanStart { start: self.jet(&self.amplitudes), bounds: self.bounds() }
    }

    fn bounds_hold(&self) -> f64 {
        SCAN_SPANS * self.span
    }

    fn reach(&self) -> f64 {
        SCAN_SPANS * self.span
    }

    fn extent(&self) -> f64 {
        self.start().1
    }

    fn steps_hold(&self, _: f64) -> bool {
        true
    }

    fn never_meets(&self, slack: f64) -> bool {
        self.bound(0) < self.start.delta - slack
    }

    fn higher_at_start(&self) -> (f64, f64) {
        (self.derivative(&self.amplitudes, 3), self.derivative(&self.amplitudes, 4))
    }

    fn remainder_factor(&self) -> f64 {
        sextic_remainder(self.step(0))
    }

    fn place(&self) -> Terms {
        self.amplitudes
    }

    fn step(&self, level: usize) -> f64 {
        SCAN_STEPS * self.span / (LANES << level) as f64
    }

    fn weights(&self, level: usize) -> &Weights {
        &self.weights[level]
    }

    fn eight_steps(&self, level: usize, from: &Terms) -> ([Terms; LANES], Jets) {
        let mut jets = Jets::default();
        let places = std::array::from_fn(|j| {
            let terms = std::array::from_fn(|k| from[k] * self.turns[level][j][k]);
            let Jet { value, rate, second } = self.jet(&terms);
            (jets.value[j], jets.rate[j], jets.second[j]) = (value, rate, second);
            terms
        });
        (places, jets)
    }

    fn place_after(places: &[Terms; LANES], j: usize) -> Terms {
        places[j]
    }
}

/// The search, followed past grazes.
fn search(gap: &StopGap) -> Searched<()> {
    let mut start = if gap.start.touching { Start::Touching } else { Start::Apart };
    let (mut grazes, mut evaluations) = (Vec::new(), 0);
    let told = |touch: Touch<()>| Told { time: [touch.time, touch.offset], state: touch.state };
    loop {
        let report = first_contact(gap, start, gap.span);
        evaluations += report.evaluations;
        let last = match report.found {
            Found::Graze(touch) if grazes.len() < 100 => {
                grazes.push(told(touch));
                start = Start::Grazed(touch.time);
                continue;
            }
            Found::Contact(touch) if touch.local_time() <= gap.span => Last::Contact(told(touch)),
            Found::Contact(_) | Found::Clear(_) => Last::Clear,
            _ => Last::Failed,
        };
        return Searched { grazes, last, evaluations };
    }
}

/// Draws a flight: apart, after an impact (of any speed), or with a hump next to the stop.
fn draw(rng: &mut ChaCha8Rng) -> Oscillators {
    loop {
        let mut within = |from: f64, to: f64| rng.random_range(from..to);
        let mut flight = Oscillators {
            mass: [1.0, within(0.2, 5.0)],
            stiffness: [within(0.2, 4.0), within(0.2, 4.0)],
            coupling: within(0.05, 4.0),
            damping: [within(0.0, 0.1), within(0.0, 0.02)],
            force: within(-2.0, 2.0),
            frequency: within(0.3, 6.0),
            phase: within(-PI, PI),
            delta: 0.0,
            x: [within(-1.0, 1.0), within(-1.0, 1.0)],
            v: [within(-1.5, 1.5), within(-1.5, 1.5)],
            touching: false,
        };
        let (tall, wide) = (10f64.powf(within(-15.0, -1.0)), 10f64.powf(within(-10.0, 0.3)));
        flight.delta = flight.x[0] + 10f64.powf(within(-3.0, 0.5));
        match rng.random_range(0..10) {
            0..3 => {}
            3..6 => {
                (flight.touching, flight.delta) = (true, flight.x[0]);
                flight.v[0] = -wide;
            }
            _ => {
                let span = StopGap::new(flight, 1.0).span;
                let humps: Vec<Place<Point>> = flight.exact(span).record_humps();
                if humps.is_empty() {
                    continue;
                }
                let hump = humps[rng.random_range(0..humps.len())];
                let height = if rng.random_bool(0.5) { tall } else { -tall };
                flight.delta = (Dd::new(flight.delta) + hump.gap.value - Dd::new(height)).hi;
                if flight.delta - flight.x[0] <= 1e-14 {
                    continue;
                }
            }
        }
        return flight;
    }
}

/// How often each outcome came, with contacts and grazes.
#[derive(Debug, Default)]
struct Counts {
    outcomes: [usize; Outcome::ALL.len()],
    contacts: usize,
    grazes: usize,
}

fn audit(flights: usize, trust: f64) -> Counts {
    let mut rng = ChaCha8Rng::seed_from_u64(7);
    let mut counts = Counts::default();
    for _ in 0..flights {
        let flight = draw(&mut rng);
        let gap = StopGap::new(flight, trust);
        let level = Level::new(gap.start().1, gap.bounds().rate, flight.touching);
        let judge = Judge::new(flight.exact(gap.span), level, gap.span);
        let searched = search(&gap);
        let (outcome, errors, _) = judge.judge(&searched);
        assert!(trust < 1.0 || !outcome.is_disagreement(), "{outcome:?} {errors:?} {flight:?}");
        counts.outcomes[outcome as usize] += 1;
        counts.contacts += usize::from(matches!(searched.last, Last::Contact(_)));
        counts.grazes += searched.grazes.len();
    }
    counts
}

#[test]
fn no_contact_of_two_oscillators_with_a_stop_is_missed_or_invented() {
    let flights = 2_000;
    let counts = audit(flights, 1.0);
    println!("{counts:?}");
    // The sample has to reach what it is for.
    assert!(counts.contacts > flights / 4 && counts.grazes > flights / 200);
    assert!(counts.outcomes[Outcome::Undecided as usize] < flights / 10);
}

/// The guarantee rests on the bounds that the model states, and on nothing else.
#[test]
fn bounds_that_are_too_small_are_found_out() {
    let counts = audit(400, 1e-3);
    assert!(counts.outcomes[Outcome::Missed as usize] > 0, "{counts:?}");
}

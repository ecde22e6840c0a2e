//! Random flights for the contact audit: parameters over their whole range with the special values
//! and their neighbourhoods, and starts chosen to be hard for a contact search.
//!
//! Flight number `index` has its own stream of ChaCha8, so that every flight is the same whatever
//! the number of threads and flights.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::f64::consts::PI;
use vibroimpact::{Clock, Contact, FreeMotion, State, System};

use super::dense::{DenseSearch, ExactMotion, Place};
use super::double_double::Dd;
use super::exact_motion::{DenseFlight, Point};
use super::rounding;

/// How a flight starts.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Kind {
    /// Anywhere apart.
    Apart,
    /// Apart by 1e-13 ... 1e-3.
    JustApart,
    /// Apart, the gap parameter such that a hump of g ends 1e-15 ... 1e-1 above or below 0.
    NearGraze,
    /// Apart, the gap parameter such that g rises through 0 next to the end of the local flight:
    /// before it by 1e-9 ... 0.3 of it.
    NearEnd,
    /// After an impact.
    Impact,
    /// After an impact with separation velocity 1e-10 ... 1e-3.
    SlowImpact,
    /// After an impact, v2 such that a hump ends 1e-15 ... 1e-1 above or below 0.
    ImpactNearGraze,
}

impl Kind {
    pub const ALL: [Self; 7] = [
        Self::Apart,
        Self::JustApart,
        Self::NearGraze,
        Self::NearEnd,
        Self::Impact,
        Self::SlowImpact,
        Self::ImpactNearGraze,
    ];

    pub fn touching(self) -> bool {
        matches!(self, Self::Impact | Self::SlowImpact | Self::ImpactNearGraze)
    }
}

/// Largest |v2| that may come of a wanted hump.
const FASTEST: f64 = 20.0;

/// A flight that starts at t = 0.
#[derive(Debug, Clone)]
pub struct Draw {
    pub kind: Kind,
    pub system: System,
    /// After an impact, x2 is tip - delta rounded.
    pub state: State,
}

/// Random flights.
#[derive(Debug, Clone, Copy)]
pub struct Flights {
    pub seed: u64,
    /// Whether bodies may have constant loads.
    pub loads: bool,
}

/// Flight number `index`.
pub fn draw(Flights { seed, loads }: Flights, index: u64) -> Draw {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    rng.set_stream(index);
    let kind = match rng.random_range(0..100) {
        0..25 => Kind::Apart,
        25..35 => Kind::NearEnd,
        35..40 => Kind::JustApart,
        40..63 => Kind::NearGraze,
        63..83 => Kind::Impact,
        83..92 => Kind::SlowImpact,
        _ => Kind::ImpactNearGraze,
    };
    loop {
        match (Drawer { rng: &mut rng, loads }).draw(kind) {
            Some(drawn) if admissible(&drawn) => return drawn,
            _ => {}
        }
    }
}

/// Apart by more than rounding, or in contact and separating.
fn admissible(draw: &Draw) -> bool {
    let (system, state) = (&draw.system, &draw.state);
    if draw.kind.touching() {
        let flight = DenseFlight::new(system, state, true, 1.0);
        return flight.gap(&flight.start()).rate.is_negative();
    }
    let noise = 4.0 * f64::EPSILON * rounding::size(system, state);
    system.gap_function(state) < -noise
}

struct Drawer<'a> {
    rng: &'a mut ChaCha8Rng,
    loads: bool,
}

impl Drawer<'_> {
    fn uniform(&mut self, from: f64, to: f64) -> f64 {
        self.rng.random_range(from..to)
    }

    /// 10^u, u uniform.
    fn power(&mut self, from: f64, to: f64) -> f64 {
        10f64.powf(self.uniform(from, to))
    }

    fn sign(&mut self) -> f64 {
        if self.rng.random_bool(0.5) { 1.0 } else { -1.0 }
    }

    /// A number next to `value`, 1e-15 ... 0.1 away, relatively.
    fn next_to(&mut self, value: f64) -> f64 {
        value * (1.0 + self.sign() * self.power(-15.0, -1.0))
    }

    fn frequency_ratio(&mut self) -> f64 {
        match self.rng.random_range(0..10) {
            0 => 0.0,
            1 => 1.0,
            2 => self.power(-6.0, 0.0),
            _ => self.uniform(0.0, 10.0),
        }
    }

    fn damping(&mut self) -> f64 {
        match self.rng.random_range(0..10) {
            0..3 => 0.0,
            3 => 1.0,
            4 => self.next_to(1.0),
            5 => self.power(-15.0, -1.0),
            _ => self.uniform(0.0, 3.0),
        }
    }

    fn drive_frequency(&mut self, frequency_ratio: f64) -> f64 {
        let own = if self.rng.random_bool(0.5) { frequency_ratio } else { 1.0 };
        match self.rng.random_range(0..12) {
            0 => 0.0,
            1 => own,
            2..5 => self.next_to(own),
            5 | 6 => self.power(0.05f64.log10(), 20f64.log10()),
            _ => self.uniform(0.05, 20.0),
        }
    }

    fn amplitude(&mut self) -> f64 {
        let size = match self.rng.random_range(0..8) {
            0 | 1 => 0.0,
            2 => self.power(-6.0, 0.0),
            _ => self.uniform(0.0, 10.0),
        };
        size * self.sign()
    }

    fn system(&mut self) -> System {
        let frequency_ratio = self.frequency_ratio();
        let contact = if self.rng.random_bool(0.3) { Contact::Direct } else { Contact::Oblique };
        let builder = if self.loads {
            let loads = (self.amplitude(), self.amplitude());
            System::builder().static_moment(loads.0).static_force(loads.1)
        } else {
            System::builder()
        };
        builder
            .mass_ratio(1.0)
            .restitution(1.0)
            .frequency_ratio(frequency_ratio)
            .pendulum_damping(self.damping())
            .oscillator_damping(self.damping())
            .drive_frequency(self.drive_frequency(frequency_ratio))
            .moment_amplitude(self.amplitude())
            .force_amplitude(self.amplitude())
            .phase(self.uniform(-PI, PI))
            .gap(self.uniform(-0.5, 1.0))
            .contact(contact)
            .build()
            .expect("parameters are within their ranges")
    }

    /// `None` if a hump is wanted and there is none, or a rise.
    fn draw(&mut self, kind: Kind) -> Option<Draw> {
        let system = self.system();
        let direct = system.contact() == Contact::Direct;
        let (x1, v1) = (self.uniform(-PI, PI), self.uniform(-3.0, 3.0));
        let (sin, cos) = x1.sin_cos();
        let (tip, speed) = if direct { (x1, v1) } else { (sin, v1 * cos) };
        let apart = match kind {
            Kind::JustApart => self.power(-13.0, -3.0),
            _ if kind.touching() => 0.0,
            _ => self.power(-3.0, 0.5),
        };
        let x2 = tip - system.gap() + apart;
        let v2 = match kind {
            Kind::SlowImpact => speed + self.power(-10.0, -3.0),
            _ if kind.touching() => speed + self.uniform(0.0, 5.0),
            _ => self.uniform(-3.0, 3.0),
        };
        let plain = Draw { kind, system, state: State { x1, v1, x2, v2 } };
        let target = self.sign() * self.power(-15.0, -1.0);
        match kind {
            Kind::NearGraze => self.lowered(plain, target),
            Kind::NearEnd => self.ended(plain),
            Kind::ImpactNearGraze => self.thrown(plain, target),
            _ => Some(plain),
        }
    }

    fn some_hump(&mut self, draw: &Draw) -> Option<Place<Point>> {
        let humps = humps(draw);
        (!humps.is_empty()).then(|| humps[self.rng.random_range(0..humps.len())])
    }

    /// The flight with its gap parameter such that one of its humps is `target` high.
    fn lowered(&mut self, draw: Draw, target: f64) -> Option<Draw> {
        let hump = self.some_hump(&draw)?;
        let gap = Dd::new(draw.system.gap()) + hump.gap.value - Dd::new(target);
        Some(Draw { system: draw.system.with("gap", gap.value()).ok()?, ..draw })
    }

    /// The flight with its gap parameter such that g rises through 0 next to its end.
    fn ended(&mut self, draw: Draw) -> Option<Draw> {
        let motion = FreeMotion::new(&draw.system);
        let flight = motion.flight(Clock::START, draw.state);
        let time = motion.span() * (1.0 - self.power(-9.0, -0.5));
        let state = motion.state_at(&flight, time);
        let gap = draw.system.gap() + draw.system.gap_function(&state);
        let rises = draw.system.approach_velocity(&state) > 0.0;
        rises.then_some(Draw { system: draw.system.with("gap", gap).ok()?, ..draw })
    }

    /// The flight with v2 such that one of its humps is about `target` high: secant steps, the
    /// hump being followed by its time.
    fn thrown(&mut self, mut draw: Draw, target: f64) -> Option<Draw> {
        let first = self.some_hump(&draw)?;
        let (mut time, mut height) = (first.time.hi, first.gap.value.value() - target);
        let mut change = 1e-3;
        for _ in 0..8 {
            let v2 = draw.state.v2 + change;
            let step = v2 - draw.state.v2;
            if step == 0.0 {
                break;
            }
            let moved = Draw { state: State { v2, ..draw.state }, ..draw };
            let near = humps(&moved)
                .into_iter()
                .min_by(|a, b| (a.time.hi - time).abs().total_cmp(&(b.time.hi - time).abs()));
            let hump = near?;
            let new = hump.gap.value.value() - target;
            change = -new * step / (new - height);
            (draw, time, height) = (moved, hump.time.hi, new);
            if !change.is_finite() {
                break;
            }
        }
        (draw.state.v2.abs() < FASTEST).then_some(draw)
    }
}

fn humps(draw: &Draw) -> Vec<Place<Point>> {
    let span = FreeMotion::new(&draw.system).span();
    DenseFlight::new(&draw.system, &draw.state, draw.kind.touching(), span).record_humps()
}

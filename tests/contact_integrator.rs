//! The integrator of the contact phase (`src/contact/sustained`, docs/contact-phase.md), from
//! outside: against DOP853 of the crate `differential-equations` on random systems, against the
//! closed form of direct contact, and by the balances of momentum, displacement and energy along
//! `Run::trajectory` and `Run::contact_forces` (docs/theory.md, section 5).

mod balance;
mod closed_form;

use std::f64::consts::PI;

use crate::support::contact_ode::{Change, Events, contact_phase};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use vibroimpact::{
    CancelToken, Contact, Event, Horizon, Run, RunOptions, Simulation, State, System, run,
};

/// Tolerance of DOP853: with 1e-14 the worst difference is seven times as large, with 1e-16 half.
const TIGHTEST: f64 = 1e-15;
/// Looks into every step of DOP853, some 1e-3 apart in time: p may fall through 0 and come back
/// within a step, which its ends do not show.
const LOOKS: u32 = 64;
/// Time and state of every change, relative to max(1, |x1|, |v1|). 1e-12 is asked for; 7e-14 is
/// measured, most of it DOP853's own, and five times that is a step length gone wrong.
const AGREEMENT: f64 = 3e-13;
/// A start displaced by this shows how errors grow up to a change: large beside what DOP853 leaves
/// (1e-14), small beside the motion.
const DISPLACED: f64 = 1e-7;
/// A change whose time or state moves by more than so many times the displacement of the start is
/// ill conditioned (p or x1' grazes 0): that much is then lost to the rounding of the start.
const WELL_CONDITIONED: f64 = 100.0;
/// For the ill-conditioned: agreement in units of that growth, 2e-16 measured.
const AGREEMENT_BY_GROWTH: f64 = AGREEMENT / WELL_CONDITIONED;
/// Contact phases are followed up to this time.
const HORIZON: f64 = 20.0;

/// A start in contact.
struct Case {
    system: System,
    x1: f64,
    v1: f64,
}

impl Case {
    /// Of a quarter each: direct; oblique without friction; the other half with friction. Every
    /// second one is damped, every third one has constant loads. Friction stays away from Painleve points, mu < 2 sqrt(mbar (1 +
    /// mbar)).
    fn draw(rng: &mut ChaCha8Rng, index: usize) -> Self {
        let mut uniform = |low: f64, high: f64| rng.random_range(low..high);
        let direct = index.is_multiple_of(4);
        let mbar = uniform(0.1, 3.0);
        let friction = if index % 4 > 1 {
            uniform(0.0, 1.4) * (mbar * (1.0 + mbar)).sqrt().min(1.0)
        } else {
            0.0
        };
        let damped = if index % 8 < 4 { 0.5 } else { 0.0 };
        let system = System::builder()
            .mass_ratio(mbar)
            .frequency_ratio(uniform(0.3, 3.0))
            .restitution(0.5)
            .gap(uniform(-1.0, 1.0))
            .drive_frequency(uniform(0.1, 3.0))
            .pendulum_damping(damped * uniform(0.0, 1.0))
            .oscillator_damping(damped * uniform(0.0, 1.0))
            .moment_amplitude(uniform(0.0, 3.0))
            .force_amplitude(uniform(0.0, 2.0))
            .friction(friction)
            .phase(uniform(-PI, PI))
            .contact(if direct { Contact::Direct } else { Contact::Oblique })
            .build()
            .unwrap();
        let (x1, v1) = (uniform(-2.5, 2.5), uniform(-1.5, 1.5));
        let system = if index % 3 == 2 {
            system
                .with("static_moment", uniform(-1.0, 1.0))
                .and_then(|system| system.with("static_force", uniform(-1.0, 1.0)))
                .unwrap()
        } else {
            system
        };
        Self { system, x1, v1: if index % 16 > 13 { 0.0 } else { v1 } }
    }

    fn start(&self) -> State {
        let (tip, slope) = match self.system.contact() {
            Contact::Direct => (self.x1, 1.0),
            _ => (self.x1.sin(), self.x1.cos()),
        };
        State::new(self.x1, self.v1, tip - self.system.gap(), self.v1 * slope).unwrap()
    }

    /// Changes of the contact phase by the library; `None` if the bodies separate at once.
    fn by_library(&self) -> Option<Vec<Change>> {
        let mut changes = Vec::new();
        let simulation = Simulation::new(&self.system, self.start()).unwrap();
        for event in simulation.until(Horizon::Time(HORIZON)) {
            let (time, state, mode) = match event.unwrap() {
                Event::SlidePositive(e) => (e.time, e.state, Some(1.0)),
                Event::SlideNegative(e) => (e.time, e.state, Some(-1.0)),
                Event::Stick(e) => (e.time, e.state, Some(0.0)),
                Event::Release(e) => (e.time, e.state, None),
                Event::Stop(e) => (e.time, e.state, changes.last().and_then(|c: &Change| c.mode)),
                _ => return None,
            };
            changes.push(Change { time, x1: state.x1, v1: state.v1, mode });
            if mode.is_none() {
                break;
            }
        }
        (changes[0].time == 0.0 && changes[0].mode.is_some()).then_some(changes)
    }

    fn by_dop853(&self, moved: f64) -> Vec<Change> {
        let v1 = if self.v1 == 0.0 { 0.0 } else { self.v1 + moved };
        let start = (self.x1 + moved, v1);
        contact_phase(&self.system, start, HORIZON, TIGHTEST, Events::Polished(LOOKS))
    }

    fn run(&self, time: f64) -> Run {
        let options = RunOptions::until(Horizon::Time(time));
        run(&self.system, self.start(), options, &CancelToken::never()).unwrap()
    }
}

/// Cases whose contact lasts, with the changes by the library.
fn cases(seed: u64, count: usize) -> Vec<(Case, Vec<Change>)> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut found = Vec::new();
    while found.len() < count {
        let case = Case::draw(&mut rng, found.len());
        if let Some(changes) = case.by_library() {
            found.push((case, changes));
        }
    }
    found
}

/// Largest difference of time and state.
fn distance(a: &Change, b: &Change) -> f64 {
    (a.time - b.time).abs().max((a.x1 - b.x1).abs()).max((a.v1 - b.v1).abs())
}

/// Whether both made the same changes. Without friction the direction of a slide is a name only.
fn alike(system: &System, a: &[Change], b: &[Change]) -> bool {
    let same = |a: &Change, b: &Change| {
        a.mode == b.mode || (system.friction() == 0.0 && a.mode.is_some() && b.mode.is_some())
    };
    a.len() == b.len() && a.iter().zip(b).all(|(a, b)| same(a, b))
}

#[test]
fn changes_agree_with_those_by_dop853() {
    let (mut well, mut ill) = ((0, 0.0f64), (0, 0.0f64));
    let [mut releases, mut stops, mut lasting] = [0; 3];
    for (case, ours) in cases(20, 2000) {
        let theirs = case.by_dop853(0.0);
        let moved = case.by_dop853(DISPLACED);
        assert!(alike(&case.system, &ours, &theirs), "{:?} {ours:?} {theirs:?}", case.system);
        stops += ours.len() - 2;
        if ours.last().unwrap().mode.is_none() {
            releases += 1
        } else {
            lasting += 1
        }
        for (i, (a, b)) in ours.iter().zip(&theirs).enumerate().skip(1) {
            let size = a.x1.abs().max(a.v1.abs()).max(1.0);
            let difference = distance(a, b) / size;
            // Where the displaced start changes otherwise the growth has no bound.
            let growth = moved.get(i).map_or(f64::INFINITY, |c| distance(b, c) / DISPLACED);
            if growth <= WELL_CONDITIONED {
                well = (well.0 + 1, well.1.max(difference));
                assert!(difference <= AGREEMENT, "{difference:e} {a:?} {b:?} {:?}", case.system);
            } else if growth.is_finite() {
                ill = (ill.0 + 1, ill.1.max(difference / growth));
                let allowed = AGREEMENT_BY_GROWTH * growth;
                assert!(difference <= allowed, "{difference:e} {growth:e} {a:?} {b:?}");
            }
        }
    }
    println!("{releases} releases, {lasting} lasting contacts, {stops} changes before");
    println!("well conditioned: {} changes, worst difference {:e}", well.0, well.1);
    println!("ill conditioned: {} changes, worst difference {:e} of the growth", ill.0, ill.1);
    assert!(releases > 1000 && stops > 500 && lasting > 50);
}

//! Direct contact is one linear oscillator about x0 = delta/((1 + mbar) w^2), whose motion is known
//! (docs/theory.md, section 5, with cos x1 -> 1, sin x1 -> 0; p is eliminated):
//!
//! w^2 = (mbar omega0^2 + 1)/(1 + mbar), 2 c = (2 mbar zeta1 omega0 + 2 zeta2)/(1 + mbar),
//! f = (mbar f1 + f2)/(1 + mbar), c = zeta w.

use std::f64::consts::PI;

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use vibroimpact::{Clock, Contact, FreeMotion, State, System};

use super::{Case, HORIZON};

/// Difference relative to the motion's size: 1e-15 is measured.
const CLOSED_FORM: f64 = 1e-14;

#[test]
fn direct_contact_is_one_oscillator_in_closed_form() {
    let mut rng = ChaCha8Rng::seed_from_u64(21);
    let (mut worst, mut compared) = (0.0f64, 0);
    for index in 0..200 {
        let mut uniform = |low: f64, high: f64| rng.random_range(low..high);
        // A gap far below 0 presses the bodies together.
        let damped = if index % 2 == 0 { 0.3 } else { 0.0 };
        let system = System::builder()
            .mass_ratio(uniform(0.1, 3.0))
            .frequency_ratio(uniform(0.3, 3.0))
            .restitution(0.5)
            .gap(uniform(-8.0, -4.0))
            .drive_frequency(uniform(0.1, 3.0))
            .pendulum_damping(damped * uniform(0.0, 1.0))
            .oscillator_damping(damped * uniform(0.0, 1.0))
            .moment_amplitude(uniform(0.0, 1.0))
            .force_amplitude(uniform(0.0, 1.0))
            .phase(uniform(-PI, PI))
            .contact(Contact::Direct)
            .build()
            .unwrap();
        let (m, w0) = (system.mass_ratio(), system.frequency_ratio());
        let square = (m * w0 * w0 + 1.0) / (1.0 + m);
        let natural = square.sqrt();
        let rate = (m * system.pendulum_damping() * w0 + system.oscillator_damping()) / (1.0 + m);
        let offset = system.gap() / ((1.0 + m) * square);
        let both = System::builder()
            .mass_ratio(m)
            .frequency_ratio(natural)
            .restitution(0.5)
            .gap(0.0)
            .drive_frequency(system.drive_frequency())
            .pendulum_damping(rate / natural)
            .moment_amplitude(
                (m * system.moment_amplitude() + system.force_amplitude()) / (1.0 + m),
            )
            .phase(system.phase())
            .build()
            .unwrap();
        let case = Case { system, x1: offset + uniform(-0.2, 0.2), v1: uniform(-0.2, 0.2) };
        let run = case.run(HORIZON);
        // Up to the release, if there is one.
        let end = run.contacts.get(1).map_or(HORIZON, |c| c.time);
        let motion = FreeMotion::new(&both);
        let start = State::new(case.x1 - offset, case.v1, 0.0, 0.0).unwrap();
        let flight = motion.flight(Clock::START, start);
        let times: Vec<f64> = (1..=100).map(|i| end * f64::from(i) / 100.0).collect();
        let states = run.trajectory(&times).unwrap();
        let size = states.iter().flatten().fold(0.0f64, |most, c| most.max(c.abs()));
        for (time, state) in times.iter().zip(&states) {
            let exact = motion.state_after_periods(&flight, 0, *time);
            let difference =
                (state[0] - offset - exact.x1).abs().max((state[1] - exact.v1).abs()) / size;
            worst = worst.max(difference);
        }
        compared += usize::from(end > 1.0);
    }
    println!("closed form: worst difference {worst:e} of the motion, {compared} contacts");
    assert!(compared > 150);
    assert!(worst <= CLOSED_FORM, "{worst:e}");
}

//! Constant loads beside the drive (docs/theory.md, section 2): they move the equilibria of bodies
//! on springs, and accelerate bodies without one.

use std::f64::consts::PI;

use vibroimpact::{Clock, Contact, FreeMotion, RunOptions, State, System, SystemBuilder};

use super::{Draw, ball, go, state, until};

/// Allowed difference of runs that are the same on paper, over a few impacts.
const SAME: f64 = 2e-12;

fn largest_difference(one: &State, other: &State, shift: [f64; 4]) -> f64 {
    let (one, other) = (one.to_array(), other.to_array());
    (0..4).map(|i| (one[i] - other[i] - shift[i]).abs()).fold(0.0, f64::max)
}

/// In direct contact the equilibria are a change of the gap.
#[test]
fn loads_on_springs_shift_the_equilibria() {
    let mut draw = Draw::new(31);
    for i in 0..200 {
        let free = draw.system().with("friction", 0.0).unwrap();
        let direct = System::builder()
            .mass_ratio(free.mass_ratio())
            .frequency_ratio(free.frequency_ratio())
            .restitution(free.restitution())
            .drive_frequency(free.drive_frequency())
            .pendulum_damping(if i % 7 == 0 { 1.3 } else { free.pendulum_damping() })
            .oscillator_damping(free.oscillator_damping())
            .moment_amplitude(free.moment_amplitude())
            .force_amplitude(free.force_amplitude())
            .contact(Contact::Direct);
        let (c1, c2) = (draw.uniform(-2.0, 2.0), draw.uniform(-2.0, 2.0));
        let shift = [c1 / free.frequency_ratio().powi(2), 0.0, c2, 0.0];
        let plain = direct.clone().gap(0.3).build().unwrap();
        let loaded = direct.gap(0.3 + shift[0] - shift[2]).static_moment(c1).static_force(c2);
        let loaded = loaded.build().unwrap();
        let start = draw.start(&plain);
        let moved = State::new(start.x1 + shift[0], start.v1, start.x2 + shift[2], start.v2);
        let one = go(&loaded, moved.unwrap(), RunOptions::periods(3));
        let other = go(&plain, start, RunOptions::periods(3));
        assert_eq!(one.impacts.len(), other.impacts.len(), "{loaded:?}");
        let off = largest_difference(&one.final_state.state, &other.final_state.state, shift);
        assert!(off < SAME, "{off:e} {loaded:?} {start:?}");
    }
}

/// A drive that stands still is a constant load, too.
#[test]
fn a_load_adds_to_a_drive_that_stands_still() {
    for frequency_ratio in [0.0, 1e-3, 0.5, 2.0] {
        for damping in [0.0, 0.1, 1.5] {
            let system = |f1: f64, c1: f64, f2: f64, c2: f64| -> SystemBuilder {
                System::builder()
                    .mass_ratio(0.5)
                    .frequency_ratio(frequency_ratio)
                    .restitution(0.7)
                    .gap(0.3)
                    .drive_frequency(0.0)
                    .pendulum_damping(damping)
                    .oscillator_damping(damping)
                    .friction(0.2)
                    .moment_amplitude(f1)
                    .static_moment(c1)
                    .force_amplitude(f2)
                    .static_force(c2)
            };
            let runs = [(0.7, 0.0, 0.2, 0.0), (0.3, 0.4, -0.3, 0.5), (0.0, 0.7, 0.0, 0.2)]
                .map(|(f1, c1, f2, c2)| system(f1, c1, f2, c2).build().unwrap())
                .map(|system| go(&system, state(0.0, 0.1, 0.1, 0.0), until(8.0)));
            for run in &runs[1..] {
                assert_eq!(run.impacts.len(), runs[0].impacts.len());
                let ends = [&run.final_state.state, &runs[0].final_state.state];
                let off = largest_difference(ends[0], ends[1], [0.0; 4]);
                assert!(off < SAME, "{off:e} {:?}", run.system);
            }
        }
    }
}

/// x = c (1 - cos wt)/w^2, and c t^2/2 without a spring: nothing is lost for weak springs, far from
/// their equilibrium.
#[test]
fn a_weak_spring_loses_no_digits() {
    for exponent in 0..=40 {
        let natural = if exponent == 40 { 0.0 } else { 10f64.powf(-0.2 * f64::from(exponent)) };
        for omega in [0.3, 1.0, 40.0] {
            let system = System::builder()
                .mass_ratio(1.0)
                .frequency_ratio(natural)
                .restitution(1.0)
                .gap(1e6)
                .drive_frequency(omega)
                .static_moment(0.7)
                .contact(Contact::Direct)
                .build()
                .unwrap();
            let motion = FreeMotion::new(&system);
            let flight = motion.flight(Clock::START, state(0.0, 0.0, 0.0, 0.0));
            for part in 1..=20 {
                let s = motion.span() * f64::from(part) / 20.0;
                let half = 0.5 * natural * s;
                // sin(half)/half, which is 1 to rounding where its square cannot be seen.
                let sinc = if half < 1e-9 { 1.0 } else { half.sin() / half };
                let (x1, v1) = (0.35 * s * s * sinc * sinc, 0.7 * s * sinc * half.cos());
                let told = motion.state_at(&flight, s);
                // The angles of the sines are rounded.
                let level = 8.0 * f64::EPSILON * (1.0 + natural * s);
                let size = 0.35 * s * s;
                assert!((told.x1 - x1).abs() <= level * size, "{natural:e} {omega} {s}: {told:?}");
                assert!((told.v1 - v1).abs() <= level * 0.7 * s, "{natural:e} {omega} {s}");
            }
        }
    }
}

/// Constant loads (docs/special-systems.md): one bounce per period on a table A cos(omega t), at +- pi G/omega
/// relative to the ground.
#[test]
fn a_ball_bounces_once_per_period_of_a_table() {
    let (r, gravity, omega, damping) = (0.8, 9.81, 2.0, 0.05);
    let kappa = (1.0 - r) / (1.0 + r);
    for beta in [kappa * PI + 1e-3, 0.6, 1.02, 1.07] {
        let amplitude: f64 = beta * gravity / (omega * omega);
        let stiffness = (1.0 - omega * omega).hypot(2.0 * damping * omega);
        let lag = (2.0 * damping * omega).atan2(1.0 - omega * omega);
        // On the stable side.
        let psi = PI - (kappa * PI / beta).asin();
        let system = System::builder()
            .mass_ratio(0.0)
            .frequency_ratio(0.0)
            .restitution(r)
            .gap(0.0)
            .drive_frequency(omega)
            .force_amplitude(amplitude * stiffness)
            .oscillator_damping(damping)
            .static_moment(gravity)
            .phase(psi + lag)
            .contact(Contact::Direct)
            .build()
            .unwrap();
        let (x, speed) = (amplitude * psi.cos(), PI * gravity / omega);
        let start = state(x, -speed, x, -amplitude * omega * psi.sin());
        let run = go(&system, start, until(100.5 * system.drive_period()));
        assert_eq!(run.impacts.len(), 100, "beta = {beta}");
        for impact in &run.impacts {
            assert!((impact.v1_pre / speed - 1.0).abs() < 1e-10, "{beta} {impact:?}");
            assert!((impact.v1_post / speed + 1.0).abs() < 1e-10, "{beta} {impact:?}");
        }
    }
}

/// The same impacts, whether gravity is a drive that stands still or a load.
#[test]
fn a_falling_ball_falls_under_a_load_too() {
    let plain = ball(9.81, 0.7);
    let loaded = plain.with("moment_amplitude", 0.0).unwrap();
    let loaded = loaded.with("static_moment", 9.81).unwrap();
    let start = state(-1.0, 0.0, 0.0, 0.0);
    let [one, other] = [plain, loaded].map(|system| go(&system, start, until(10.0)));
    assert_eq!(one.impacts.len(), other.impacts.len());
    let off = largest_difference(&one.final_state.state, &other.final_state.state, [0.0; 4]);
    assert!(off < SAME, "{off:e}");
}

/// Pressed together by a load, the bodies of the paper stay in contact.
#[test]
fn a_preload_holds_a_contact_closed() {
    let mut draw = Draw::new(32);
    let mut held = 0;
    for _ in 0..40 {
        let system = draw.system().with("static_moment", draw.uniform(2.0, 6.0)).unwrap();
        let start = draw.start(&system);
        let run = go(&system, start, RunOptions::periods(20));
        let audit = run.energy_audit(&vibroimpact::CancelToken::never()).unwrap();
        assert!(audit.residual().abs() <= 1e-12 * audit.total, "{audit:?} {system:?}");
        held += usize::from(!run.contacts.is_empty());
    }
    assert!(held > 10, "{held}");
}

//! Free motion against 25-digit reference data (tests/data/README.md): every damping, resonance and
//! their neighbourhoods, up to 10^6 periods, to 1e-13 of the motion's scale.

use std::f64::consts::TAU;
use std::path::Path;

use serde_json::Value;
use vibroimpact::{Clock, FreeMotion, State, System};

/// Allowed error relative to the largest displacement and velocity of the motion.
const ALLOWED: f64 = 1e-13;

fn cases() -> Vec<Value> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/flights.json");
    serde_json::from_str(&std::fs::read_to_string(path).unwrap()).unwrap()
}

fn number(value: &Value) -> f64 {
    match value {
        Value::String(text) => text.parse().unwrap(),
        other => other.as_f64().unwrap(),
    }
}

/// The body whose equation of motion the case describes.
#[derive(Clone, Copy, PartialEq)]
enum Body {
    Pendulum,
    Oscillator,
}

fn motion(case: &Value, body: Body) -> FreeMotion {
    let of = |name: &str| number(&case[name]);
    let system = System::builder()
        .mass_ratio(1.0)
        .restitution(1.0)
        .gap(0.0)
        .drive_frequency(of("omega"))
        .phase(of("phase"));
    let system = match body {
        Body::Pendulum => system
            .frequency_ratio(of("omega0"))
            .pendulum_damping(of("zeta"))
            .moment_amplitude(of("f")),
        Body::Oscillator => {
            system.frequency_ratio(1.0).oscillator_damping(of("zeta")).force_amplitude(of("f"))
        }
    };
    FreeMotion::new(&system.build().unwrap())
}

fn start(case: &Value, body: Body) -> State {
    let (x, v) = (number(&case["x0"]), number(&case["v0"]));
    match body {
        Body::Pendulum => State::new(x, v, 0.0, 0.0).unwrap(),
        Body::Oscillator => State::new(0.0, 0.0, x, v).unwrap(),
    }
}

/// Larger error of displacement and velocity, in units of the motion's scale.
fn error(case: &Value, body: Body, state: &State) -> f64 {
    let (x, v) = match body {
        Body::Pendulum => (state.x1, state.v1),
        Body::Oscillator => (state.x2, state.v2),
    };
    let of = |name: &str| number(&case[name]);
    let (dx, dv) = ((x - of("x")).abs() / of("scale_x"), (v - of("v")).abs() / of("scale_v"));
    assert!(dx.is_finite() && dv.is_finite(), "{case}");
    dx.max(dv)
}

fn bodies(case: &Value) -> &'static [Body] {
    let oscillator = number(&case["omega0"]) == 1.0;
    if oscillator { &[Body::Pendulum, Body::Oscillator] } else { &[Body::Pendulum] }
}

#[test]
fn flights_of_any_length() {
    let (mut worst, mut number_of) = ((0.0, 0), [0; 2]);
    for (i, case) in cases().iter().enumerate() {
        for &body in bodies(case) {
            let motion = motion(case, body);
            let flight = motion.flight(Clock::START, start(case, body));
            let periods = case["n"].as_i64().unwrap();
            let state = motion.state_after_periods(&flight, periods, number(&case["tau"]));
            let error = error(case, body, &state);
            assert!(error <= ALLOWED, "case {i}: {error:e} {case}");
            number_of[body as usize] += 1;
            if error > worst.0 {
                worst = (error, i);
            }
        }
    }
    println!("{number_of:?} flights of pendulum and oscillator, worst error {worst:?}");
    assert!(number_of[0] > 600 && number_of[1] > 100);
}

#[test]
fn short_flights_by_local_evaluation() {
    let (mut worst, mut number_of) = ((0.0, 0), 0);
    for (i, case) in cases().iter().enumerate() {
        for &body in bodies(case) {
            let motion = motion(case, body);
            let periods = case["n"].as_f64().unwrap();
            let whole = if periods > 0.0 { periods * (TAU / number(&case["omega"])) } else { 0.0 };
            let elapsed = whole + number(&case["tau"]);
            if elapsed > motion.span() {
                continue;
            }
            let flight = motion.flight(Clock::START, start(case, body));
            let error = error(case, body, &motion.state_at(&flight, elapsed));
            assert!(error <= ALLOWED, "case {i}: {error:e} {case}");
            number_of += 1;
            if error > worst.0 {
                worst = (error, i);
            }
        }
    }
    println!("{number_of} local flights, worst error {worst:?}");
    assert!(number_of > 50);
}

#[test]
fn resonance_with_hardly_any_damping_is_finite() {
    // Squares of such damping ratios underflow.
    for damping in [1e-90, 1e-165, 1e-300, f64::MIN_POSITIVE] {
        let system = System::builder()
            .mass_ratio(0.6)
            .frequency_ratio(0.5)
            .restitution(0.8)
            .gap(2.0)
            .drive_frequency(1.0)
            .oscillator_damping(damping)
            .force_amplitude(0.5)
            .build()
            .unwrap();
        let motion = FreeMotion::new(&system);
        let rest = State::new(0.0, 0.0, 0.0, 0.0).unwrap();
        let end = motion.state_at(&motion.flight(Clock::START, rest), 3.0);
        // x2 = f2 t sin(t)/2
        assert!((end.x2 - 0.25 * 3.0 * 3f64.sin()).abs() < 1e-15, "{damping}: {end:?}");
    }
}

/// The state of a body that was thrown at 1e4 and is nearly at rest: what is left of the motion,
/// not of the first velocity, has to be right.
#[test]
fn decayed_motion_keeps_its_own_digits() {
    let mut worst = 0f64;
    for (zeta, drive) in [(1.3, 0.7), (5.0, 0.7), (60.0, 0.01), (3e3, 1e-4), (1e4, 2.0)] {
        let system = System::builder()
            .mass_ratio(1.0)
            .frequency_ratio(1.0)
            .restitution(1.0)
            .gap(0.0)
            .drive_frequency(drive)
            .pendulum_damping(zeta)
            .oscillator_damping(zeta)
            .force_amplitude(1e-3)
            .build()
            .unwrap();
        let motion = FreeMotion::new(&system);
        let start = State::new(0.0, 1e4, 0.0, 0.0).unwrap();
        let flight = motion.flight(Clock::START, start);
        let kappa = ((zeta - 1.0) * (zeta + 1.0f64)).sqrt();
        let (slow, fast) = (1.0 / (zeta + kappa), zeta + kappa);
        // Re (e^{i omega t} - e^{-a t})/(a + i omega): of a mode of rate a, under cos(omega t).
        let response = |a: f64, t: f64| {
            let difference = -2.0 * (0.5 * drive * t).sin().powi(2) - (-a * t).exp_m1();
            (a * difference + drive * (drive * t).sin()) / (a * a + drive * drive)
        };
        for t in [4.0, 9.0, 12.5] {
            if t > motion.span() || zeta * t < 5.0 {
                continue;
            }
            let (slow_left, fast_left) = ((-slow * t).exp(), (-fast * t).exp());
            let v1 = 1e4 * (fast * fast_left - slow * slow_left) / (2.0 * kappa);
            let x1 = 1e4 * (slow_left - fast_left) / (2.0 * kappa);
            let x2 = 1e-3 * (response(slow, t) - response(fast, t)) / (2.0 * kappa);
            let far = motion.state_after_periods(&flight, 0, t);
            for state in [motion.state_at(&flight, t), far] {
                let off = [state.x1 / x1 - 1.0, state.v1 / v1 - 1.0, state.x2 / x2 - 1.0];
                let error = off.iter().fold(0.0, |most: f64, e| most.max(e.abs()));
                assert!(error < 1e-13, "zeta = {zeta}, t = {t}: {off:?}");
                worst = worst.max(error);
            }
        }
    }
    println!("worst relative error {worst:e}");
    assert!(worst > 0.0);
}

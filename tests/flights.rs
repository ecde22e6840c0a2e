//! Free motion against 25-digit reference data (tests/data/README.md): every damping, resonance and
//! their neighbourhoods, up to 10^6 periods, to 1e-13 of the motion's scale.

#![allow(clippy::unwrap_used)]

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

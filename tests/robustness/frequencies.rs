//! The ends of the range of frequencies: zero, the least and the largest ones.

use vibroimpact::{CancelToken, Clock, FreeMotion, RunOptions, State, run};

use super::{assert_finite, paper, start};

#[test]
fn minus_zero_is_zero() {
    let system = paper().drive_frequency(-0.0).build().unwrap();
    assert_eq!(system.drive_frequency().to_bits(), 0);
    assert_eq!(system.drive_period(), f64::INFINITY);
    assert_eq!(system, paper().drive_frequency(0.0).build().unwrap());
    assert_eq!(system, system.with("drive_frequency", -0.0).unwrap());
}

/// Beyond, powers of the drive period are no numbers, and sections came out as none.
#[test]
fn a_drive_too_fast_to_reckon_with_is_refused() {
    let fastest = paper().pendulum_damping(1.5).oscillator_damping(1.5).drive_frequency(1e50);
    let run =
        run(&fastest.build().unwrap(), start(), RunOptions::periods(200), &CancelToken::never());
    assert_finite(&run.unwrap());
    let error = paper().drive_frequency(1e51).build().unwrap_err();
    assert_eq!((&*error.name, &*error.allowed), ("drive_frequency", "a number in [0, 1e50]"));
}

/// Their squares have lost digits, and motions after a release came out wrong.
#[test]
fn frequency_ratios_whose_squares_underflow_count_as_zero() {
    let rotor = paper().frequency_ratio(0.0).friction(0.3).build().unwrap();
    for least in [5e-324, 1e-300, 9.9e-151] {
        let system = paper().frequency_ratio(least).friction(0.3).build().unwrap();
        assert_eq!(system, rotor);
        assert_eq!(system, rotor.with("frequency_ratio", least).unwrap());
    }
    let system = rotor.with("frequency_ratio", 1e-150).unwrap();
    assert_eq!(system.frequency_ratio(), 1e-150);
    let go = |system| run(system, start(), RunOptions::periods(20), &CancelToken::never()).unwrap();
    let (slow, none) = (go(&system), go(&rotor));
    assert_finite(&slow);
    assert_eq!(slow.impacts.len(), none.impacts.len());
}

/// A frequency whose square times itself underflows, met at resonance: the displacement was NaN.
#[test]
fn a_resonance_of_hardly_any_frequency_grows_as_any_other() {
    let w = 2.8e-89;
    let builder = paper().frequency_ratio(w).drive_frequency(w).pendulum_damping(w).gap(w);
    let system = builder.moment_amplitude(w).force_amplitude(w).build().unwrap();
    let motion = FreeMotion::new(&system);
    let flight = motion.flight(Clock::new(0, 0.0), start());
    for periods in [0, 1, 7] {
        for part in [0.25, 0.4, 0.9] {
            let time = part * system.drive_period();
            let angle = std::f64::consts::TAU * (periods as f64 + part);
            let State { x1, v1, .. } = motion.state_after_periods(&flight, periods, time);
            // Without its damping, some 1e-88: v/w sin wt + f/(2 w^2) wt sin wt, with f = w.
            let x = (0.5 + 0.5 * angle) * angle.sin() / w;
            let v = 0.5 * (angle.cos() * (1.0 + angle) + angle.sin());
            assert!((x1 * w - x * w).abs() < 1e-12 && (v1 - v).abs() < 1e-12, "{x1} {v1}: {x} {v}");
        }
    }
}

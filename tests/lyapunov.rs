//! Lyapunov exponents: closed forms, the sum identity in every regime, Floquet multipliers, the
//! divergence of nearby orbits, directions that die out.

use vibroimpact::{
    CancelToken, Horizon, ImpactLaw, ImpactRecord, Run, RunOptions, Spectrum, State, System,
    SystemBuilder, largest_lyapunov_exponent, lyapunov_spectrum, run,
};

fn paper(frequency: f64) -> SystemBuilder {
    System::builder()
        .mass_ratio(0.6)
        .frequency_ratio(2.0)
        .restitution(0.8)
        .gap(0.5)
        .drive_frequency(frequency)
        .moment_amplitude(1.0)
}

fn settled(system: &System, periods: i64) -> Run {
    let start = State::new(0.0, 0.5, 0.0, 0.0).unwrap();
    run(system, start, RunOptions::periods(periods).keep(100), &CancelToken::never()).unwrap()
}

fn spectrum(run: &Run, periods: u32) -> Spectrum {
    let spectrum = lyapunov_spectrum(run, periods, None, &CancelToken::never()).unwrap();
    assert_eq!(spectrum.error, None);
    spectrum
}

#[test]
fn without_contact_they_are_the_decay_rates_of_both_bodies() {
    let system = paper(0.9).pendulum_damping(0.05).oscillator_damping(0.02).gap(2.0).build();
    let spectrum = spectrum(&settled(&system.unwrap(), 100), 4000);
    assert_eq!(spectrum.impacts, 0);
    for (found, exact) in spectrum.exponents.iter().zip([-0.02, -0.02, -0.1, -0.1]) {
        assert!((found - exact).abs() < 1e-4, "{found} {exact}");
    }
    let sum: f64 = spectrum.exponents.iter().sum();
    assert!((sum + 0.24).abs() < 1e-12, "{sum}");
}

#[test]
fn one_perturbation_gives_the_largest_of_the_four() {
    let damped = |friction: f64| {
        paper(1.545).friction(friction).pendulum_damping(0.01).oscillator_damping(0.01)
    };
    for builder in [paper(1.545).friction(0.5), damped(0.0), damped(0.5)] {
        let run = settled(&builder.build().unwrap(), 300);
        let four = spectrum(&run, 20_000);
        let one = largest_lyapunov_exponent(&run, 20_000, None, &CancelToken::never()).unwrap();
        assert_eq!((one.impacts, one.time), (four.impacts, four.time));
        assert!(one.exponents[1..].iter().chain(&one.errors[1..]).all(|x| x.is_nan()));
        let (found, expected) = (one.exponents[0], four.exponents[0]);
        let slack = 3.0 * (one.errors[0] + four.errors[0]) + 1e-5;
        assert!((found - expected).abs() < slack, "{found} {expected}");
        // Once aligned, one direction grows as the first of several does: not only on average.
        assert!((found - expected).abs() * four.time < 5.0, "{found} {expected}");
    }
}

#[test]
fn the_largest_exponent_of_motions_that_stick_is_that_of_the_four() {
    // A plastic impact and a stick take away one direction each, and the slide that follows more.
    for (restitution, friction) in [(0.0, 0.0), (0.5, 3.0), (0.0, 3.0)] {
        let builder = paper(0.8).restitution(restitution).friction(friction);
        let run = settled(&builder.force_amplitude(0.5).build().unwrap(), 200);
        let never = CancelToken::never();
        let four = lyapunov_spectrum(&run, 2_000, None, &never).unwrap();
        let one = largest_lyapunov_exponent(&run, 2_000, None, &never).unwrap();
        let (found, expected) = (one.exponents[0], four.exponents[0]);
        assert!(
            found == expected || (found - expected).abs() * four.time < 5.0,
            "{restitution} {friction}: {found} {expected}"
        );
    }
}

/// ln |det S| of an impact (docs/theory.md, section 7).
fn log_determinant(system: &System, impact: &ImpactRecord) -> f64 {
    let r = system.restitution();
    let (sin, cos) = impact.x1.sin_cos();
    let approach = impact.v1_pre * cos - impact.v2_pre;
    let separation = impact.v2_post - impact.v1_post * cos;
    let side = impact.v1_pre.signum() * system.friction() * sin.abs();
    let (before, after) = (cos + side, cos - side);
    let pull = |k: f64| system.mass_ratio() + k * cos;
    let determinant = match (impact.regime, system.law()) {
        (0 | 1, _) => r * r,
        (2 | 3, ImpactLaw::Poisson) => r * (after / before) * separation / approach,
        (2 | 3, ImpactLaw::Newton) => r * r * (after / before) * pull(before) / pull(after),
        (2 | 3, ImpactLaw::Energetic) => r * r * after / before,
        _ => 0.0,
    };
    determinant.abs().ln()
}

#[test]
fn their_sum_is_that_of_all_contractions() {
    // Chaotic motions, one without friction; the identity holds to rounding in each window.
    let laws = [ImpactLaw::Poisson, ImpactLaw::Newton, ImpactLaw::Energetic];
    let mut reversals = 0;
    for (friction, frequency) in [(0.0, 0.55), (0.0, 2.3), (0.5, 1.545)] {
        for law in laws {
            let system = paper(frequency)
                .friction(friction)
                .pendulum_damping(0.003)
                .oscillator_damping(0.001)
                .law(law)
                .build()
                .unwrap();
            let periods = 2000;
            let from = settled(&system, 300);
            let found = spectrum(&from, periods);
            // The window that counts: the first tenth aligns.
            let end = Horizon::Periods(300 + i64::from(periods));
            let options = RunOptions { horizon: end, keep: Some(1800), ..RunOptions::periods(0) };
            let window = from.resume(options, &CancelToken::never()).unwrap();
            assert_eq!(found.impacts as usize, window.impacts.len());
            assert!(window.contacts.is_empty());
            reversals += window.impacts.iter().filter(|i| i.regime > 1).count();
            let logs: f64 = window.impacts.iter().map(|i| log_determinant(&system, i)).sum();
            let exact = logs / found.time - 2.0 * (0.003 * 2.0 + 0.001);
            let sum: f64 = found.exponents.iter().sum();
            assert!(sum == exact || (sum - exact).abs() < 1e-9 * exact.abs(), "{sum} {exact}");
        }
    }
    assert!(reversals > 1000, "{reversals}");
}

#[test]
fn of_a_periodic_motion_they_are_those_of_its_multipliers() {
    // 1-1 with a pair of complex multipliers, 2-4, damped 1-3.
    for system in [
        paper(1.8).build().unwrap(),
        paper(1.1).build().unwrap(),
        paper(0.75)
            .pendulum_damping(0.1)
            .oscillator_damping(0.1)
            .force_amplitude(1.5)
            .build()
            .unwrap(),
    ] {
        let from = settled(&system, 3000);
        let (report, [exponent, error]) = from.period_and_exponent(&CancelToken::never());
        assert!(report.orbit.is_some());
        assert!(error < 1e-6, "{error}");
        let spectrum = spectrum(&from, 20_000);
        let difference = (spectrum.exponents[0] - exponent).abs();
        assert!(
            difference < 3e-5 && difference < 5.0 * spectrum.errors[0].max(1e-6),
            "{difference}"
        );
    }
}

#[test]
fn chaos_and_a_slow_approach_are_told_apart() {
    // Fig. 9(2) and 9(4) of the paper; the latter is no chaos from this start
    // (docs/theory.md, erratum E10).
    let chaotic = paper(1.545).friction(0.5).build().unwrap();
    let largest = spectrum(&settled(&chaotic, 600), 20_000);
    let [found, error] = [largest.exponents[0], largest.errors[0]];
    assert!((found - 0.025).abs() < 0.003 && error < 0.002, "{found} {error}");
    let slow = paper(2.55)
        .friction(0.4)
        .pendulum_damping(0.01)
        .oscillator_damping(0.01)
        .force_amplitude(0.5)
        .build()
        .unwrap();
    let largest = spectrum(&settled(&slow, 600), 20_000);
    let [found, error] = [largest.exponents[0], largest.errors[0]];
    assert!(found <= 3.0 * error, "{found} {error}");
}

#[test]
fn the_largest_is_the_rate_at_which_nearby_orbits_part() {
    let system = paper(1.545).friction(0.5).build().unwrap();
    let from = settled(&system, 600);
    let found = spectrum(&from, 10_000);
    // Renormalised after every drive period, from the states at the sections.
    let (mut state, mut nearby) = (from.final_state.state, from.final_state.state);
    let size = 1e-8;
    nearby.v1 += size;
    let (mut sum, mut count) = (0.0, 0);
    for k in 0..10_000 {
        let next = |state| {
            run(&system, state, RunOptions::periods(1), &CancelToken::never())
                .unwrap()
                .final_state
                .state
        };
        (state, nearby) = (next(state), next(nearby));
        let (a, b) = (state.to_array(), nearby.to_array());
        let distance = a.iter().zip(b).map(|(x, y)| (x - y).powi(2)).sum::<f64>().sqrt();
        let [x1, v1, x2, v2]: [f64; 4] =
            std::array::from_fn(|i| a[i] + (b[i] - a[i]) * size / distance);
        nearby = State::new(x1, v1, x2, v2).unwrap();
        if k >= 1000 {
            sum += (distance / size).ln();
            count += 1;
        }
    }
    let direct = sum / (f64::from(count) * system.drive_period());
    let difference = (found.exponents[0] - direct).abs();
    // Both estimates have such an error, of orbits that soon have nothing in common.
    let error = std::f64::consts::SQRT_2 * found.errors[0];
    assert!(difference < 4.0 * error, "{difference} {error}");
}

#[test]
fn directions_that_leave_no_trace_have_minus_infinity() {
    let infinite = |s: &Spectrum| s.exponents.iter().filter(|e| **e == f64::NEG_INFINITY).count();
    // A plastic impact forgets the approach velocity.
    let plastic = paper(1.8).restitution(0.0).build().unwrap();
    assert_eq!(infinite(&spectrum(&settled(&plastic, 200), 200)), 1);
    // Contact leaves two directions, stick in contact one.
    let chatters = paper(0.3).force_amplitude(2.0).pendulum_damping(0.1).oscillator_damping(0.1);
    let slides = chatters.clone().build().unwrap();
    let run = settled(&slides, 200);
    assert!(!run.contacts.is_empty() && run.contacts.iter().all(|c| c.kind != 5));
    assert_eq!(infinite(&spectrum(&run, 50)), 2);
    let sticks = chatters.friction(1.2).build().unwrap();
    let run = settled(&sticks, 200);
    assert!(run.contacts.iter().any(|c| c.kind == 5));
    assert_eq!(infinite(&spectrum(&run, 50)), 3);
}

#[test]
fn under_a_constant_load_the_steps_are_given() {
    // A damped flight under a constant moment: it decays to its equilibrium.
    let system =
        paper(0.0).pendulum_damping(0.1).oscillator_damping(0.1).moment_amplitude(0.1).gap(2.0);
    let system = system.build().unwrap();
    let start = State::new(0.0, 0.1, 0.0, 0.0).unwrap();
    let from =
        run(&system, start, RunOptions::until(Horizon::Time(1.0)), &CancelToken::never()).unwrap();
    assert_eq!(lyapunov_spectrum(&from, 10, None, &CancelToken::never()).unwrap_err().name, "step");
    // Steps that do not move the time were taken, and all exponents 0/0; over 5e-324 they were
    // infinite.
    for short in [1e-17, 5e-324, 0.0] {
        let refused = lyapunov_spectrum(&from, 10, Some(short), &CancelToken::never()).unwrap_err();
        assert_eq!(refused.name, "step");
    }
    let found = lyapunov_spectrum(&from, 1000, Some(1.0), &CancelToken::never()).unwrap();
    assert!((found.time - 900.0).abs() < 1e-9);
    for (found, exact) in found.exponents.iter().zip([-0.1, -0.1, -0.2, -0.2]) {
        assert!((found - exact).abs() < 1e-3, "{found} {exact}");
    }
}

#[test]
fn it_ends_early_with_what_is_done() {
    let from = settled(&paper(1.545).friction(0.5).build().unwrap(), 100);
    let part = lyapunov_spectrum(&from, 1_000_000, None, &CancelToken::after(6_000)).unwrap();
    assert!(part.error.is_some());
    assert!(part.time > 0.0 && part.exponents[0].is_finite() && !part.history.is_empty());
}

#[test]
fn strong_damping_leaves_all_four() {
    // No contact: the exponents are the decay rates, -w (zeta +- sqrt(zeta^2 - 1)).
    for (zeta, tolerance) in [(1.5, 1e-4), (50.0, 1e-3)] {
        let system = paper(0.4).frequency_ratio(3.0).pendulum_damping(zeta).oscillator_damping(0.1);
        let system = system.moment_amplitude(0.3).gap(0.9).build().unwrap();
        let start = State::new(0.0, 0.05, 0.0, 0.0).unwrap();
        let options = RunOptions::periods(50).keep(10);
        let found = spectrum(&run(&system, start, options, &CancelToken::never()).unwrap(), 2000);
        assert_eq!(found.impacts, 0);
        let root = (zeta * zeta - 1.0).sqrt();
        let mut exact = [-0.1, -0.1, -3.0 * (zeta - root), -3.0 * (zeta + root)];
        exact.sort_by(|a, b| b.total_cmp(a));
        for (found, exact) in found.exponents.iter().zip(exact) {
            assert!((found - exact).abs() < tolerance * exact.abs().max(1.0), "{found} {exact}");
        }
    }
}

#[test]
fn slides_that_turn_round_lose_no_further_direction() {
    // Chatter, slide, slide the other way, release: two directions are left.
    let system = System::builder()
        .mass_ratio(0.6)
        .frequency_ratio(1.5987882917479714)
        .restitution(0.5)
        .gap(0.4524007030544761)
        .drive_frequency(0.44260314109024335)
        .oscillator_damping(1.5)
        .moment_amplitude(2.479215490036162)
        .friction(0.27578798868460835)
        .law(ImpactLaw::Energetic)
        .build()
        .unwrap();
    let start = State::new(-0.2, 0.5, 0.1, 0.0).unwrap();
    let options = RunOptions::periods(1500).keep(10);
    let from = run(&system, start, options, &CancelToken::never()).unwrap();
    let mut kinds: Vec<i64> = from.contacts.iter().rev().take(4).map(|c| c.kind).collect();
    kinds.sort_unstable();
    assert_eq!(kinds, [2, 3, 4, 6]);
    let found = spectrum(&from, 1000);
    // Finite differences of (x1, x1') over the contact section: |lambda| = 0.01583.
    let exact = 0.015_83_f64.ln() / system.drive_period();
    for exponent in &found.exponents[..2] {
        assert!((exponent - exact).abs() < 1e-3, "{exponent} {exact}");
    }
    assert_eq!(found.exponents[2..], [f64::NEG_INFINITY; 2]);
}

#[test]
fn what_is_lost_before_the_measurement_does_not_count() {
    let system = System::builder()
        .mass_ratio(0.3)
        .frequency_ratio(2.5723698594825093)
        .restitution(0.8)
        .gap(0.5157802385834485)
        .drive_frequency(0.3850118123304781)
        .oscillator_damping(0.01)
        .moment_amplitude(1.1216044038813144)
        .force_amplitude(0.8934221457003664)
        .friction(1.1158311242054806)
        .build()
        .unwrap();
    let start = State::new(-0.2, 0.5, 0.2, 0.0).unwrap();
    let from = |periods| {
        let options = RunOptions::periods(periods).keep(1);
        run(&system, start, options, &CancelToken::never()).unwrap()
    };
    // Contact and stick up to period 14, none later.
    let early = spectrum(&from(1), 4000);
    let late = spectrum(&from(400), 4000);
    for (a, b) in early.exponents.iter().zip(late.exponents) {
        assert!((a - b).abs() < 5e-3, "{a} {b}");
    }
}

/// A wall comes to rest, and the last impact is a low one after a higher: no bounce of chatter, for
/// none follows. It was waited for to the end, and nothing was measured.
#[test]
fn after_a_last_low_impact_the_motion_is_measured() {
    let system = System::builder()
        .mass_ratio(0.0)
        .frequency_ratio(3.0)
        .restitution(1.0)
        .gap(1.0)
        .drive_frequency(2.1713588158999007)
        .oscillator_damping(1.5)
        .build()
        .unwrap();
    let start = State::new(-1.29692530708782, -2.0, -1.35096644946936, 0.44705882352941).unwrap();
    let run = run(&system, start, RunOptions::periods(1), &CancelToken::never()).unwrap();
    let spectrum = spectrum(&run, 2_000);
    // A free pendulum, and an overdamped body: -zeta2 -+ sqrt(zeta2^2 - 1).
    let rates = [0.0, 0.0, -1.5 + 1.25f64.sqrt(), -1.5 - 1.25f64.sqrt()];
    for (found, exact) in spectrum.exponents.iter().zip(rates) {
        assert!((found - exact).abs() < 2e-3, "{found} {exact}");
    }
    assert!(spectrum.time > 5_000.0, "{}", spectrum.time);
}

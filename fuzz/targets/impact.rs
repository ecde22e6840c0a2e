//! Impact laws, in closed form and in many small steps.

#![no_main]

use libfuzzer_sys::fuzz_target;
use vibroimpact::impact::{Impact, ImpactOutcome, OutcomeError, PreImpact, incremental, resolve};
use vibroimpact::{ImpactLaw, State, System};
use vibroimpact_fuzz::{Draw, assert_finite, assert_numbers, execution};

/// Beyond these, squares and quotients leave the range of numbers.
const MODERATE: std::ops::Range<f64> = 1e-30..1e30;

fn moderate(values: &[f64]) -> bool {
    values.iter().all(|v| *v == 0.0 || MODERATE.contains(&v.abs()))
}

fn row(row: &ImpactOutcome) {
    assert_finite("before", &[row.x1, row.v1_pre, row.v2_pre, row.approach_velocity]);
    let after = [row.v1_post, row.v2_post, row.separation_velocity, row.impulse_normal];
    if row.regime < 0 {
        assert!(after.iter().all(|v| v.is_nan()), "{row:?}");
    } else {
        assert_finite("after", &after);
        let rest = [row.impulse_tangential, row.energy_loss, row.friction_loss];
        assert_numbers("impulses and energies", &rest);
        assert_numbers("effective restitution", &[row.effective_restitution]);
    }
}

fn outcome(system: &System, pre: &PreImpact, impact: &Impact) {
    let &Impact { v1_post, v2_post, approach_velocity, separation_velocity, .. } = impact;
    let all = [
        v1_post,
        v2_post,
        approach_velocity,
        separation_velocity,
        impact.impulse_approach,
        impact.impulse_normal,
        impact.impulse_tangential,
        impact.energy_loss,
        impact.friction_loss,
        impact.effective_restitution(),
    ];
    assert_finite("outcome", &all);
    // That law has no guard for impulses that pull.
    if system.law() != ImpactLaw::Paper {
        assert!(impact.impulse_normal >= 0.0, "{impact:?} of {pre:?} in {system:?}");
        let speed = pre.v1.abs() + pre.v2.abs() + v1_post.abs() + v2_post.abs();
        assert!(separation_velocity <= 1e-12 * speed, "{impact:?} of {pre:?} in {system:?}");
    }
}

fn body(draw: &mut Draw) {
    let Some(system) = draw.system() else { return };
    let [x1, v1, v2] = [draw.number(-4.0, 4.0), draw.number(-3.0, 3.0), draw.number(-3.0, 3.0)];
    let steps = match draw.below(16) {
        0 => draw.integer() as u32,
        n => 1 + n as u32 * 3,
    };
    if let Ok(outcome) = ImpactOutcome::new(&system, x1, v1, v2) {
        row(&outcome);
    }
    // A million steps take a tenth of a second.
    if steps <= 1000 || steps > 1_000_000 {
        match ImpactOutcome::incremental(&system, x1, v1, v2, steps) {
            Ok(outcome) => row(&outcome),
            Err(OutcomeError::Parameter(error)) => assert!(!error.to_string().is_empty()),
            Err(error) => assert!(!error.to_string().is_empty()),
        }
    }
    let state = State { x1, v1, x2: draw.any(), v2 };
    let geometry = PreImpact::new(system.contact(), &state);
    let parameters = [system.mass_ratio(), system.restitution(), system.friction(), x1, v1, v2];
    let u = geometry.approach_velocity();
    if moderate(&parameters) && u > 1e-12 && geometry.cos.abs() > 1e-12 {
        if let Ok(impact) = resolve(&system, &geometry) {
            outcome(&system, &geometry, &impact);
        }
    }
    // Fields are open to anything: any outcome, but one.
    let pre = PreImpact {
        cos: draw.number(-1.0, 1.0),
        sin: draw.number(-1.0, 1.0),
        v1: draw.number(-3.0, 3.0),
        v2: draw.number(-3.0, 3.0),
    };
    let _ = resolve(&system, &pre);
    if steps <= 1000 {
        let _ = incremental(&system, &pre, steps);
    }
}

fuzz_target!(|bytes: &[u8]| execution(|| body(&mut Draw::new(bytes))));

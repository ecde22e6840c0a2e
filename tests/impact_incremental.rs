//! The closed walk along the impulse against the incremental-impulse integrator, which shares no
//! code with it (docs/theory.md, section 4): for every law and every regime both agree to a
//! multiple of the step, and the difference falls in proportion to it.

use vibroimpact::impact::MAX_INCREMENTS;
use vibroimpact::impact::{Impact, ImpactFailure, IncrementalError, Regime, incremental};
use vibroimpact::{Contact, ImpactLaw};

use crate::support::draws;
use crate::support::impacts::{Case, LAWS, sample};

/// |x1'| and |x2'|/(1 + mbar) differ by at most this times (1 + mu) dP. An impulse dP changes them
/// by (1 + mu) dP at most. The end of the approach is found up to one step too late, and that of
/// the impact another one; Poisson's law carries the first over to restitution r times: its step
/// is the (1 + r)-th part of the last one, so both make no more than two of the last.
const STEPS_OFF: f64 = 2.0;

/// Rounding of the sums, in units of EPS and of the largest velocity per step: the steps grow from
/// the `steps`-th part of the impulse on, some 10 `steps` of them at most in these ranges.
const ROUNDINGS: f64 = 10.0;

/// The last and largest step, relative to the impulse of the longer of both.
fn last_step(closed: &Impact, stepped: &Impact, steps: u32) -> f64 {
    closed.impulse_normal.max(stepped.impulse_normal) / f64::from(steps)
}

fn difference(case: &Case, closed: &Impact, stepped: &Impact) -> f64 {
    let second = (closed.v2_post - stepped.v2_post).abs() / (1.0 + case.mass_ratio);
    (closed.v1_post - stepped.v1_post).abs().max(second)
}

fn switch(regime: Regime) -> Option<f64> {
    match regime {
        Regime::ReversalInApproach { switch }
        | Regime::ReversalInRestitution { switch }
        | Regime::StickInApproach { switch }
        | Regime::StickInRestitution { switch } => Some(switch),
        _ => None,
    }
}

/// Both outcomes, or None where the impact is jammed under both.
fn both(case: &Case, law: ImpactLaw, steps: u32) -> Option<(Impact, Impact)> {
    match (case.resolve(law), incremental(&case.system(law), &case.pre, steps)) {
        (Ok(closed), Ok(stepped)) => Some((closed, stepped)),
        (Err(failure), Err(stepped)) => {
            assert_eq!(failure, ImpactFailure::Jammed);
            assert_eq!(stepped, IncrementalError::Impact(ImpactFailure::Jammed));
            None
        }
        other => panic!("{case:?} {law:?}: {other:?}"),
    }
}

#[test]
fn the_walk_agrees_with_many_small_steps_in_every_regime_under_every_law() {
    let steps = 500;
    let mut counts = [[0; 6]; 3];
    let mut worst = [[0f64; 6]; 3];
    let mut jammed = 0;
    for case in sample(draws(5_000, 20_000)) {
        for (number, law) in LAWS.into_iter().enumerate() {
            let Some((closed, stepped)) = both(&case, law, steps) else {
                jammed += 1;
                continue;
            };
            let step = last_step(&closed, &stepped, steps);
            let per_step = (1.0 + case.friction) * step;
            let speed = case.pre.v1.abs() + case.pre.v2.abs() + closed.v2_post.abs();
            let rounding = ROUNDINGS * f64::from(steps) * f64::EPSILON * speed;
            let off = difference(&case, &closed, &stepped);
            assert!(
                off <= STEPS_OFF * per_step + rounding,
                "{law:?} {case:?} {closed:?} {stepped:?}"
            );
            let kind = closed.regime.kind();
            counts[number][kind as usize] += 1;
            worst[number][kind as usize] = worst[number][kind as usize].max(off / per_step);

            // Friction's work changes by mu |sin| |x1'| dP, that of u by |u| dP.
            let reach = speed + stepped.v1_post.abs() + closed.approach_velocity;
            let works = 4.0 * (1.0 + case.friction).powi(2) * step * reach + rounding * reach;
            let moved = (closed.impulse_normal - stepped.impulse_normal).abs();
            // The impulse itself may be off by more where velocities hardly depend on it any more
            // (a wall that holds the tip and hardly recedes); so may the works then.
            if moved <= 2.0 * step {
                assert!((closed.friction_loss - stepped.friction_loss).abs() <= works);
                assert!((closed.energy_loss - stepped.energy_loss).abs() <= works, "{closed:?}");
            }
            // Slip ends at the same impulse; where the ends of slip, of approach and of the impact
            // are not within a step of each other, the regime is the same too.
            if let (Some(exact), Some(found)) = (switch(closed.regime), switch(stepped.regime)) {
                assert!((exact - found).abs() <= step + rounding, "{closed:?} {stepped:?}");
                let clear = (exact - closed.impulse_approach).abs() > 2.0 * step;
                assert!(!clear || kind == stepped.regime.kind(), "{closed:?} {stepped:?}");
            } else if switch(closed.regime).or(switch(stepped.regime)).is_none() {
                assert_eq!(kind, stepped.regime.kind());
            }
        }
    }
    println!("steps off (limit {STEPS_OFF}), by law and regime: {worst:.2?}; counts {counts:?}");
    assert!(counts.iter().flatten().all(|&count| count > 100), "{counts:?}");
    assert!(jammed > 300, "{jammed}");
}

#[test]
fn the_difference_falls_in_proportion_to_the_step() {
    // The mean over the impacts of a regime: a single difference depends on where in a step the
    // end falls. First order: halving the step halves it, to 10 % (some hundred impacts each).
    let cases = sample(draws(2_000, 6_000));
    for law in LAWS {
        let means = [250u32, 500, 1000, 2000].map(|steps| {
            let (mut sums, mut counts) = ([0.0; 6], [0.0; 6]);
            for case in &cases {
                let Some((closed, stepped)) = both(case, law, steps) else { continue };
                let kind = closed.regime.kind() as usize;
                sums[kind] += difference(case, &closed, &stepped) / closed.impulse_normal;
                counts[kind] += 1.0;
            }
            assert!(counts.iter().all(|&count| count > 30.0), "{counts:?}");
            std::array::from_fn::<f64, 6, _>(|kind| sums[kind] / counts[kind])
        });
        for (kind, (coarse, fine)) in means[0].iter().zip(means[3]).enumerate() {
            let order = (coarse / fine).log2() / 3.0;
            println!("{law:?} regime {kind}: order {order:.3}");
            assert!((order - 1.0).abs() < 0.1, "{law:?} {kind}: {order}");
        }
    }
}

#[test]
fn direct_contact_agrees_too() {
    let mut count = 0;
    for case in sample(5_000).into_iter().filter(|case| case.contact == Contact::Direct) {
        for law in LAWS {
            let (closed, stepped) = both(&case, law, 4_000).unwrap();
            let step = last_step(&closed, &stepped, 4_000);
            assert_eq!(closed.regime, stepped.regime);
            assert_eq!((stepped.friction_loss, stepped.impulse_tangential), (0.0, 0.0));
            assert!(difference(&case, &closed, &stepped) <= STEPS_OFF * step + 1e-12);
            count += 1;
        }
    }
    assert!(count > 1000, "{count}");
}

#[test]
fn a_large_friction_coefficient_and_a_heavy_pendulum_agree_as_well() {
    // mbar = 100 and mu = 5 at once, 200 angles all round, both directions of slip.
    for index in 0..200 {
        let (sin, cos) = (f64::from(index) * 0.031_41 * 2.0).sin_cos();
        for v1 in [-1.0, 0.0, 1.0] {
            for law in LAWS {
                let pre = vibroimpact::impact::PreImpact { cos, sin, v1, v2: v1 * cos - 1.0 };
                let case = Case {
                    contact: Contact::Oblique,
                    mass_ratio: 100.0,
                    restitution: 0.9,
                    friction: 5.0,
                    pre,
                };
                let (closed, stepped) = both(&case, law, 1_000).unwrap();
                let step = last_step(&closed, &stepped, 1_000);
                assert!(difference(&case, &closed, &stepped) <= STEPS_OFF * 6.0 * step + 1e-11);
            }
        }
    }
}

#[test]
fn bad_arguments_are_named() {
    let case = sample(1)[0];
    let name = |law, case: Case, steps| match incremental(&case.system(law), &case.pre, steps) {
        Err(IncrementalError::Parameter(error)) => error.name.to_string(),
        other => panic!("{other:?}"),
    };
    assert_eq!(name(ImpactLaw::Paper, case, 10), "law");
    assert_eq!(name(ImpactLaw::Poisson, case, 0), "steps");
    assert_eq!(name(ImpactLaw::Poisson, case, MAX_INCREMENTS + 1), "steps");
    for v2 in [f64::NAN, f64::INFINITY, 1e3] {
        let mut parting = case;
        parting.pre.v2 = v2;
        assert_eq!(name(ImpactLaw::Newton, parting, 10), "approach_velocity");
    }
}

#[test]
fn one_step_is_enough_to_end() {
    // However coarse, every impact ends or is jammed.
    for case in sample(2_000) {
        for law in LAWS {
            if let Some((_, stepped)) = both(&case, law, 1) {
                assert!(stepped.v1_post.is_finite() && stepped.separation_velocity <= 0.0);
            }
        }
    }
}

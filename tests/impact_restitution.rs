//! The laws of restitution beside each other (docs/theory.md, section 4): what is exact under each,
//! where they agree, and their edges: r = 0, r = 1, walls, ends of the ranges.

use proptest::prelude::*;
use vibroimpact::impact::{Impact, ImpactFailure, PreImpact, RegimeKind};
use vibroimpact::{Contact, ImpactLaw};

use crate::support::impacts::{Case, LAWS, cases, config, sample};
use ImpactLaw::{Energetic, Newton, Poisson};
use RegimeKind::{
    Frictionless, ReversalInApproach, ReversalInRestitution, Slip, StickInApproach,
    StickInRestitution,
};

fn sticks(impact: &Impact) -> bool {
    matches!(impact.regime.kind(), StickInApproach | StickInRestitution)
}

/// Rounding of a velocity after the impact: eight roundings of the largest velocity in play.
fn rounding(case: &Case, impact: &Impact) -> f64 {
    let given = case.mass_ratio * impact.impulse_normal;
    8.0 * f64::EPSILON * case.pre.v1.abs().max(case.pre.v2.abs()).max(given)
}

proptest! {
    #![proptest_config(config())]

    #[test]
    fn the_regime_does_not_depend_on_the_law(case in cases()) {
        let poisson = case.resolve(Poisson);
        for law in [Newton, Energetic] {
            let other = case.resolve(law);
            match (&poisson, &other) {
                (Ok(a), Ok(b)) => {
                    prop_assert_eq!(a.regime, b.regime);
                    prop_assert_eq!(a.impulse_approach, b.impulse_approach);
                    if matches!(a.regime.kind(), Frictionless | Slip) {
                        prop_assert_eq!(a.v1_post, b.v1_post);
                        prop_assert_eq!(a.v2_post, b.v2_post);
                        prop_assert_eq!(a.separation_velocity, b.separation_velocity);
                        prop_assert_eq!(a.impulse_normal, b.impulse_normal);
                        prop_assert_eq!(a.friction_loss, b.friction_loss);
                    }
                }
                (a, b) => prop_assert_eq!(a, b),
            }
        }
    }

    #[test]
    fn newton_separates_at_minus_r_u(case in cases()) {
        let Ok(impact) = case.resolve(Newton) else { return Ok(()) };
        if case.mass_ratio == 0.0 && sticks(&impact) {
            return Ok(()); // below
        }
        let expected = -case.restitution * impact.approach_velocity;
        prop_assert_eq!(impact.separation_velocity, expected);
        if sticks(&impact) {
            prop_assert_eq!((impact.v1_post, impact.v2_post), (0.0, -expected));
        }
    }

    #[test]
    fn the_velocities_are_those_of_the_impulses(case in cases()) {
        for law in LAWS {
            let Ok(impact) = case.resolve(law) else { continue };
            let (pre, p, t) = (&case.pre, impact.impulse_normal, impact.impulse_tangential);
            let near = rounding(&case, &impact).max(8.0 * f64::EPSILON * p) * (1.0 + case.friction);
            prop_assert!((impact.v2_post - pre.v2 - case.mass_ratio * p).abs() <= near);
            let moment = impact.v1_post - pre.v1 + pre.cos * p - pre.sin * t;
            prop_assert!(moment.abs() <= near, "{law:?} {moment:e} {impact:?}");
            prop_assert!(t.abs() <= case.friction * p * (1.0 + 8.0 * f64::EPSILON));
            let by_velocities = impact.v1_post * pre.cos - impact.v2_post;
            prop_assert!((impact.separation_velocity - by_velocities).abs() <= near);
            prop_assert!(impact.separation_velocity <= 0.0);
            prop_assert!(p >= impact.impulse_approach * (1.0 - 8.0 * f64::EPSILON));
        }
    }

    #[test]
    fn mirrored_impacts_have_mirrored_outcomes(case in cases()) {
        let pre = PreImpact { cos: -case.pre.cos, v1: -case.pre.v1, ..case.pre };
        if case.contact == Contact::Direct {
            return Ok(());
        }
        for law in [Newton, Energetic] {
            match (case.resolve(law), Case { pre, ..case }.resolve(law)) {
                (Ok(impact), Ok(mirror)) => {
                    let turned = (-mirror.v1_post, mirror.v2_post, mirror.friction_loss);
                    prop_assert_eq!((impact.v1_post, impact.v2_post, impact.friction_loss), turned);
                }
                (a, b) => prop_assert_eq!(a.err(), b.err()),
            }
        }
    }

    #[test]
    fn without_restitution_all_laws_end_with_the_approach(case in cases()) {
        let case = Case { restitution: 0.0, ..case };
        for law in LAWS {
            let Ok(impact) = case.resolve(law) else { continue };
            prop_assert!(impact.separation_velocity.abs() <= rounding(&case, &impact));
            let excess = impact.impulse_normal - impact.impulse_approach;
            prop_assert!(excess.abs() <= 4.0 * f64::EPSILON * impact.impulse_normal);
            if law == Newton && !sticks(&impact) {
                prop_assert_eq!(impact.separation_velocity, 0.0);
            }
        }
    }

    #[test]
    fn full_restitution_returns_all_the_work_under_energetic(case in cases()) {
        let case = Case { restitution: 1.0, ..case };
        let Ok(impact) = case.resolve(Energetic) else { return Ok(()) };
        let held_by_wall = case.mass_ratio == 0.0 && case.pre.v2 == 0.0 && sticks(&impact);
        if !held_by_wall {
            // Twelve digits of the works, which are impulses times velocities.
            let speed = case.pre.v1.abs() + case.pre.v2.abs() + impact.v2_post.abs();
            let restitution = impact.energy_loss - impact.friction_loss;
            prop_assert!(restitution.abs() <= 1e-12 * impact.impulse_normal * speed, "{impact:?}");
        }
    }
}

#[test]
fn the_laws_end_in_order_where_slip_ends_in_approach() {
    // With x1' cos x1 > 0 before, u falls more slowly after the bend (a2 < a1): r P_I then brings
    // less than r u0, and the work of approach lies between. With x1' cos x1 < 0 (stick only) it
    // falls faster after the bend, and the order is the other way round.
    let mut counts = [0; 2];
    for case in sample(20_000) {
        let [Ok(poisson), Ok(newton), Ok(energetic)] = LAWS.map(|law| case.resolve(law)) else {
            continue;
        };
        let bent = matches!(poisson.regime.kind(), ReversalInApproach | StickInApproach);
        let tip = case.pre.v1 * case.pre.cos;
        if !bent || case.restitution < 0.01 || tip.abs() < 0.01 || case.mass_ratio == 0.0 {
            continue;
        }
        let [p, n, e] = [poisson, newton, energetic].map(|i| i.impulse_normal);
        if tip > 0.0 {
            counts[0] += 1;
            assert!(p < e && e < n, "{case:?} {p} {e} {n}");
        } else {
            counts[1] += 1;
            assert!(n < e && e < p, "{case:?} {p} {e} {n}");
        }
    }
    assert!(counts.iter().all(|&count| count > 500), "{counts:?}");
}

#[test]
fn energetic_by_hand() {
    // mbar = 1/4, mu = 1/2, cos = 3/4, sin = 1/2 (the law never uses cos^2 + sin^2 = 1): k = 1 then
    // 1/2, a1 = 1 then a2 = 5/8; x1' = 1 stops at P* = 1, where u = 2 has fallen to 1.
    let case = Case {
        contact: Contact::Oblique,
        mass_ratio: 0.25,
        restitution: 0.5,
        friction: 0.5,
        pre: PreImpact { cos: 0.75, sin: 0.5, v1: 1.0, v2: -1.25 },
    };
    let impact = case.resolve(Energetic).unwrap();
    assert_eq!(impact.regime.kind(), ReversalInApproach);
    assert_eq!(impact.approach_velocity, 2.0);
    // Work of approach 3/2 + 1/(2 a2) = 2.3; u_post^2/(2 a2) = 2.3/4.
    let separation = -(2.0 * 0.625 * 2.3 / 4.0f64).sqrt();
    assert!((impact.separation_velocity - separation).abs() <= 4.0 * f64::EPSILON);
    assert!((impact.impulse_normal - (1.0 + (1.0 - separation) / 0.625)).abs() <= 1e-15 * 8.0);
    // Newton: u = -1 at P = 1 + (1 + 1)/a2.
    let newton = case.resolve(Newton).unwrap();
    assert_eq!((newton.separation_velocity, newton.impulse_normal), (-1.0, 4.2));
    // Friction: mu |sin| = 1/4 times the mean speeds.
    let (first, second) = (0.25 * 0.5, 0.25 * 0.5 * 3.2 * 1.6);
    assert!((newton.friction_loss - (first + second)).abs() <= 4.0 * f64::EPSILON);
}

#[test]
fn a_wall_that_holds_the_tip_ends_the_impact_where_velocities_end_to_change() {
    let (sin, cos) = 1.2f64.sin_cos();
    let case = |v2: f64| Case {
        contact: Contact::Oblique,
        mass_ratio: 0.0,
        restitution: 0.8,
        friction: 1.0,
        pre: PreImpact { cos, sin, v1: 1.0, v2 },
    };
    for law in LAWS {
        // At rest: u = 0 for good.
        let impact = case(0.0).resolve(law).unwrap();
        assert_eq!(impact.regime.kind(), StickInRestitution);
        assert_eq!((impact.v1_post, impact.v2_post, impact.separation_velocity), (0.0, 0.0, 0.0));
        assert!(impact.impulse_normal.is_finite() && impact.impulse_tangential.is_finite());
        // Receding: u = -x2' for good. Newton's -r u is out of reach, energetic's work is not.
        let v2 = 0.1;
        let impact = case(v2).resolve(law).unwrap();
        assert_eq!(impact.regime.kind(), StickInRestitution);
        assert_eq!((impact.v1_post, impact.v2_post, impact.separation_velocity), (0.0, v2, -v2));
        // Approaching: no impulse stops it.
        assert_eq!(case(-0.1).resolve(law), Err(ImpactFailure::Jammed));
    }
    // The wall hardly recedes: energetic's impulse grows beyond all bounds, then there is none.
    let impulses =
        [1e-3, 1e-9, 1e-300, 5e-324].map(|v2| case(v2).resolve(Energetic).unwrap().impulse_normal);
    assert!(impulses.windows(2).take(2).all(|pair| pair[1] > 1e5 * pair[0]), "{impulses:?}");
    assert!(impulses[3].is_finite());
    let switch = case(0.1).resolve(Newton).unwrap().impulse_normal;
    assert!((switch - 1.0 / (cos + sin)).abs() <= 4.0 * f64::EPSILON);
}

#[test]
fn newton_on_a_small_mass_has_no_limit() {
    // As mbar -> 0 newton throws body 2 at r u whatever it weighs; the impulse grows as 1/mbar.
    let (sin, cos) = 1.2f64.sin_cos();
    let pre = PreImpact { cos, sin, v1: 1.0, v2: 0.0 };
    for mass_ratio in [1e-3, 1e-6, 1e-100] {
        let case =
            Case { contact: Contact::Oblique, mass_ratio, restitution: 0.8, friction: 1.0, pre };
        let impact = case.resolve(Newton).unwrap();
        assert_eq!(impact.v2_post, 0.8 * cos);
        assert!(
            (impact.impulse_normal * mass_ratio / (0.8 * cos) - 1.0).abs()
                < 3.0 * mass_ratio.sqrt()
        );
        let energetic = case.resolve(Energetic).unwrap();
        assert!(energetic.v2_post <= mass_ratio.sqrt());
    }
}

#[test]
fn the_laws_are_continuous_across_the_ends_of_slip() {
    // mbar = 1/4, mu = 1/2 (reversal) and 3/2 (stick): P* = P_f and P* = (1 + r) P_f, exactly.
    let post = |friction: f64, v2: f64, law| {
        let case = Case {
            contact: Contact::Oblique,
            mass_ratio: 0.25,
            restitution: 0.5,
            friction,
            pre: PreImpact { cos: 0.75, sin: 0.5, v1: 1.0, v2 },
        };
        let impact = case.resolve(law).unwrap();
        (impact.regime.kind(), [impact.v1_post, impact.v2_post, impact.separation_velocity])
    };
    for law in [Newton, Energetic] {
        for (friction, kinds) in [
            (0.5, [ReversalInApproach, ReversalInRestitution, Slip]),
            (1.5, [StickInApproach, StickInRestitution, Slip]),
        ] {
            // k = 3/4 + mu/2, P* = 1/k; u = P* (mbar + 3k/4) at P* = P_f, 2/3 of that at the other.
            let k = 0.75 + 0.5 * friction;
            let end = (0.25 + 0.75 * k) / k;
            for (edge, before, beyond) in
                [(0.75 - end, kinds[0], kinds[1]), (0.75 - end / 1.5, kinds[1], kinds[2])]
            {
                for d in [1e-3, 1e-6, 1e-9] {
                    let (low, high) =
                        (post(friction, edge - d, law), post(friction, edge + d, law));
                    assert_eq!((low.0, high.0), (before, beyond), "{law:?} {friction} {d}");
                    for (a, b) in low.1.iter().zip(high.1) {
                        // Slopes of the law at these numbers: at most 10.
                        assert!((a - b).abs() <= 20.0 * d, "{law:?} {friction} {d}: {a} {b}");
                    }
                }
            }
        }
    }
}

#[test]
fn direct_contact_is_the_same_under_all_laws() {
    let mut count = 0;
    for case in sample(20_000).into_iter().filter(|case| case.contact == Contact::Direct) {
        let [poisson, newton, energetic] = LAWS.map(|law| case.resolve(law).unwrap());
        assert_eq!(poisson.regime.kind(), Frictionless);
        assert_eq!(poisson, newton);
        assert_eq!(poisson, energetic);
        assert_eq!(poisson.separation_velocity, -case.restitution * poisson.approach_velocity);
        count += 1;
    }
    assert!(count > 1000, "{count}");
}

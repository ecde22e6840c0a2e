//! Exact properties of single impacts under Poisson's law with Coulomb friction, on random
//! impacts (docs/theory.md, section 4): energy, balances of momentum, restitution by regime, the
//! regime table as a partition, symmetries, limits.
//!
//! Ranges: all angles, |v1| <= 2, u in (0, 2], mbar in [0.01, 10], mu in [0, 5], r in [0, 1].

use crate::support::impacts::system;
use crate::support::random_cases;
use std::f64::consts::{PI, TAU};

use proptest::prelude::*;
use vibroimpact::impact::{Impact, PreImpact, RegimeKind, resolve};
use vibroimpact::{Contact, State, System};

use RegimeKind::{
    Frictionless, ReversalInApproach, ReversalInRestitution, Slip, StickInApproach,
    StickInRestitution,
};

/// One random impact.
#[derive(Debug, Clone, Copy)]
struct Case {
    mass_ratio: f64,
    restitution: f64,
    friction: f64,
    x1: f64,
    v1: f64,
    u: f64,
}

impl Case {
    fn pre(&self) -> PreImpact {
        let (sin, cos) = self.x1.sin_cos();
        PreImpact { cos, sin, v1: self.v1, v2: self.v1 * cos - self.u }
    }

    fn system(&self) -> System {
        system(self.mass_ratio, self.restitution, self.friction)
    }

    fn impact(&self) -> Impact {
        resolve(&self.system(), &self.pre()).unwrap()
    }

    /// Largest velocity in play: the tip's own, and what the impulse gives body 2.
    fn speed(&self, impact: &Impact) -> f64 {
        let pre = self.pre();
        pre.v1.abs().max(pre.v2.abs()).max(self.mass_ratio * impact.impulse_normal)
    }

    fn energy(&self, v1: f64, v2: f64) -> f64 {
        0.5 * v1 * v1 + 0.5 * v2 * v2 / self.mass_ratio
    }
}

fn cases() -> impl Strategy<Value = Case> {
    // The ends of the ranges, and x1' = 0, in every tenth case.
    let restitution = prop_oneof![8 => 0.0..1.0, 1 => Just(0.0), 1 => Just(1.0)];
    let friction = prop_oneof![9 => 0.0..5.0, 1 => Just(0.0)];
    let v1 = prop_oneof![9 => -2.0..2.0, 1 => Just(0.0)];
    (-2.0..1.0, restitution, friction, -PI..PI, v1, 1e-3..2.0).prop_map(
        |(magnitude, restitution, friction, x1, v1, u)| Case {
            mass_ratio: 10f64.powf(magnitude),
            restitution,
            friction,
            x1,
            v1,
            u,
        },
    )
}

/// k for a slip direction.
fn k(pre: &PreImpact, friction: f64, direction: f64) -> f64 {
    pre.cos + friction * direction.signum() * pre.sin.abs()
}

/// The regime table of docs/theory.md, section 4, row by row: every condition on its own, and the
/// impulses P*, P_I it comes with.
fn table(case: &Case) -> Vec<(RegimeKind, f64)> {
    let Case { mass_ratio, restitution, friction, v1, .. } = *case;
    let pre = case.pre();
    let u = pre.approach_velocity();
    let level = friction == 0.0 || pre.sin == 0.0;
    let cone = pre.cos.abs() <= friction * pre.sin.abs();
    let still = v1 == 0.0;
    let direction = if still { -pre.cos } else { v1 };
    let first = k(&pre, friction, direction);
    let slowing = mass_ratio + first * pre.cos;
    let stopping = slowing > 0.0;
    let star = v1 / first;
    let approach = u / slowing;
    let whole = (1.0 + restitution) * approach;
    let second = mass_ratio + k(&pre, friction, -pre.cos) * pre.cos;

    let in_approach = star > 0.0 && (!stopping || star < approach);
    let in_restitution = star > 0.0 && stopping && approach <= star && star < whole;
    let never = stopping && (star <= 0.0 || star >= whole);
    // x1' = 0 in the approach leaves u = -(v2 + mbar P*).
    let left = -(pre.v2 + mass_ratio * star);
    let rows = [
        (level, Frictionless, u / (mass_ratio + pre.cos * pre.cos)),
        (!level && ((still && !cone) || (!still && never)), Slip, approach),
        (!level && !still && in_approach && !cone, ReversalInApproach, star + left / second),
        (!level && !still && in_restitution && !cone, ReversalInRestitution, approach),
        (!level && cone && (still || in_approach), StickInApproach, star + left / mass_ratio),
        (!level && !still && in_restitution && cone, StickInRestitution, approach),
    ];
    rows.into_iter().filter(|row| row.0).map(|(_, kind, approach)| (kind, approach)).collect()
}

proptest! {
    #![proptest_config(random_cases(2_000, 20_000))]

    #[test]
    fn energy_never_grows_and_the_loss_is_its_drop(case in cases()) {
        let (pre, impact) = (case.pre(), case.impact());
        let before = case.energy(pre.v1, pre.v2);
        let after = case.energy(impact.v1_post, impact.v2_post);
        prop_assert!(after <= before * (1.0 + 4.0 * f64::EPSILON), "{before} {after} {impact:?}");
        prop_assert!(impact.energy_loss >= 0.0);
        prop_assert!((impact.energy_loss - (before - after)).abs() <= 1e-12 * before);
    }

    #[test]
    fn the_bodies_separate_as_their_regime_says(case in cases()) {
        let (pre, impact) = (case.pre(), case.impact());
        let r = case.restitution;
        let u = pre.approach_velocity();
        prop_assert_eq!(impact.approach_velocity, u);
        prop_assert!(impact.separation_velocity <= 0.0);
        let by_velocities = impact.v1_post * pre.cos - impact.v2_post;
        let rounding = 8.0 * f64::EPSILON * case.speed(&impact);
        prop_assert!((impact.separation_velocity - by_velocities).abs() <= rounding);
        let ratio = impact.effective_restitution();
        match impact.regime.kind() {
            Frictionless | Slip => prop_assert_eq!(impact.separation_velocity, -r * u),
            ReversalInApproach | ReversalInRestitution => {
                prop_assert!(ratio >= 0.0 && (ratio < r || r == 0.0), "{} {:?}", ratio, impact);
            }
            StickInApproach | StickInRestitution => {
                prop_assert_eq!(impact.v1_post, 0.0);
                if impact.regime.kind() == StickInApproach {
                    prop_assert!((impact.v2_post + r * pre.v2).abs() <= rounding);
                }
                // With x1' = 0 at the start, and with r = 0, both are equal.
                if r > 0.0 && case.v1 != 0.0 {
                    prop_assert_eq!(ratio > r, case.v1 * pre.cos < 0.0, "{} {:?}", ratio, impact);
                }
            }
            other => prop_assert!(false, "{other:?}"),
        }
    }

    #[test]
    fn momentum_is_balanced_within_the_friction_cone(case in cases()) {
        let (pre, impact) = (case.pre(), case.impact());
        let (p, t) = (impact.impulse_normal, impact.impulse_tangential);
        let rounding = 8.0 * f64::EPSILON * case.speed(&impact).max(p);
        prop_assert!(p >= 0.0);
        prop_assert!((impact.v2_post - pre.v2 - case.mass_ratio * p).abs() <= rounding);
        // M1 l^2 x1'' has the moments -cos x1 of P and +sin x1 of T.
        let moment = impact.v1_post - pre.v1 + pre.cos * p - pre.sin * t;
        prop_assert!(moment.abs() <= rounding * (1.0 + case.friction), "{moment:e} {impact:?}");
        prop_assert!(t.abs() <= case.friction * p * (1.0 + 8.0 * f64::EPSILON), "{impact:?}");
        if impact.regime.kind() == Slip && case.v1 != 0.0 {
            let expected = -case.friction * p * case.v1.signum() * pre.sin.signum();
            prop_assert!((t - expected).abs() <= 4.0 * f64::EPSILON * expected.abs());
        }
    }

    #[test]
    fn the_regimes_cover_every_impact_once(case in cases()) {
        let impact = case.impact();
        let rows = table(&case);
        prop_assert_eq!(rows.len(), 1, "{:?}", rows);
        let (kind, approach) = rows[0];
        prop_assert_eq!(impact.regime.kind(), kind);
        let rounding = 1e-13 * (case.speed(&impact) / case.mass_ratio).max(approach);
        prop_assert!((impact.impulse_approach - approach).abs() <= rounding, "{approach} {impact:?}");
        let whole = (1.0 + case.restitution) * impact.impulse_approach;
        prop_assert!((impact.impulse_normal - whole).abs() <= 1e-14 * whole);
    }

    #[test]
    fn mirrored_impacts_have_mirrored_outcomes(case in cases()) {
        let (pre, impact, system) = (case.pre(), case.impact(), case.system());
        // x1 -> pi - x1, x1' -> -x1': exact on sine and cosine.
        let mirror = resolve(&system, &PreImpact { cos: -pre.cos, v1: -pre.v1, ..pre }).unwrap();
        prop_assert_eq!(mirror.regime.kind(), impact.regime.kind());
        prop_assert_eq!((mirror.v1_post, mirror.v2_post), (-impact.v1_post, impact.v2_post));
        prop_assert_eq!(mirror.impulse_tangential, -impact.impulse_tangential);
        prop_assert_eq!(mirror.energy_loss, impact.energy_loss);
        // x1 -> -x1: only the tangential impulse turns round.
        let turned = resolve(&system, &PreImpact { sin: -pre.sin, ..pre }).unwrap();
        prop_assert_eq!((turned.v1_post, turned.v2_post), (impact.v1_post, impact.v2_post));
        prop_assert_eq!(turned.impulse_tangential, -impact.impulse_tangential);
    }

    #[test]
    fn angles_count_modulo_a_turn(case in cases()) {
        let impact = case.impact();
        let pre = case.pre();
        for (x1, sign) in [(case.x1 + TAU, 1.0), (PI - case.x1, -1.0)] {
            let state = State::new(x1, sign * pre.v1, 0.0, pre.v2).unwrap();
            let other = resolve(&case.system(), &PreImpact::new(Contact::Oblique, &state)).unwrap();
            // The rounded angle moves sine and cosine by its spacing; slopes go with mu/mbar.
            let slope = case.speed(&impact).max(impact.impulse_normal)
                * (1.0 + case.friction).powi(2)
                * (1.0 + 1.0 / case.mass_ratio);
            let moved = 16.0 * f64::EPSILON * slope;
            prop_assert!((other.v1_post * sign - impact.v1_post).abs() <= moved);
            prop_assert!((other.v2_post - impact.v2_post).abs() <= moved * (1.0 + case.mass_ratio));
        }
    }

    #[test]
    fn small_friction_tends_to_none(case in cases()) {
        tends(&Case { friction: 0.0, ..case }, |d| Case { friction: d, ..case })?;
        prop_assert_eq!(Case { friction: 0.0, ..case }.impact().regime.kind(), Frictionless);
    }

    #[test]
    fn a_level_contact_tends_to_frictionless(case in cases()) {
        tends(&Case { x1: 0.0, ..case }, |d| Case { x1: d, ..case })?;
        tends(&Case { x1: 0.0, ..case }, |d| Case { x1: -d, ..case })?;
        prop_assert_eq!(Case { x1: 0.0, ..case }.impact().regime.kind(), Frictionless);
    }

    #[test]
    fn restitution_tends_to_its_ends(case in cases()) {
        let plastic = Case { restitution: 0.0, ..case };
        tends(&plastic, |d| Case { restitution: d, ..case })?;
        let impact = plastic.impact();
        let by_velocities = impact.v1_post * case.pre().cos - impact.v2_post;
        let rounding = 8.0 * f64::EPSILON * plastic.speed(&impact);
        prop_assert!(impact.separation_velocity.abs().max(by_velocities.abs()) <= rounding);

        let elastic = Case { restitution: 1.0, ..case };
        tends(&elastic, |d| Case { restitution: 1.0 - d, ..case })?;
        let smooth = Case { friction: 0.0, ..elastic };
        let energy = smooth.energy(smooth.pre().v1, smooth.pre().v2);
        prop_assert!(smooth.impact().energy_loss <= 1e-14 * energy);
    }
}

/// Velocities after an impact go to those of `limit` no slower than the distance.
fn tends(limit: &Case, near: impl Fn(f64) -> Case) -> Result<(), TestCaseError> {
    let end = limit.impact();
    for d in [1e-4, 1e-7, 1e-10] {
        let case = near(d);
        let impact = case.impact();
        let slope = 10.0
            * case.speed(&impact).max(impact.impulse_normal).max(end.impulse_normal)
            * (1.0 + case.friction)
            * (1.0 + 1.0 / case.mass_ratio);
        let off = (impact.v1_post - end.v1_post)
            .abs()
            .max((impact.v2_post - end.v2_post).abs() / (1.0 + case.mass_ratio));
        prop_assert!(off <= slope * d, "{off:e} at {d:e}: {case:?} {impact:?} {end:?}");
    }
    Ok(())
}

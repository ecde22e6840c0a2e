//! The impact law edge by edge (docs/theory.md, section 4), and against the closed forms of Han,
//! Jin & Hu (2004).
//!
//! At an edge of the regime table the regime follows a written rule, and the velocities after the
//! impact are continuous: on both sides of the edge they differ by no more than the distance times
//! a constant.

mod closed_forms;

use crate::support::impacts::system;
use std::f64::consts::PI;

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use vibroimpact::System;
use vibroimpact::impact::{Impact, ImpactFailure, PreImpact, RegimeKind, resolve};

use RegimeKind::{
    Frictionless, ReversalInApproach, ReversalInRestitution, Slip, StickInApproach,
    StickInRestitution,
};

fn strike(system: &System, pre: PreImpact) -> Impact {
    assert!(pre.approach_velocity() > 0.0, "{pre:?} does not approach");
    resolve(system, &pre).unwrap()
}

fn kind(system: &System, pre: PreImpact) -> RegimeKind {
    strike(system, pre).regime.kind()
}

/// Largest difference of the velocities after two impacts.
fn jump(a: &Impact, b: &Impact) -> f64 {
    (a.v1_post - b.v1_post).abs().max((a.v2_post - b.v2_post).abs())
}

/// Random impacts with moderate parameters: mbar 0.1..3, r 0.1..1, |v1| 0.2..2, u 0.1..2, so that
/// one constant bounds the slopes of the law.
struct Draw {
    rng: ChaCha8Rng,
}

impl Draw {
    fn new(seed: u64) -> Self {
        Self { rng: ChaCha8Rng::seed_from_u64(seed) }
    }

    fn uniform(&mut self, low: f64, high: f64) -> f64 {
        self.rng.random_range(low..high)
    }

    fn sign(&mut self) -> f64 {
        if self.rng.random_bool(0.5) { 1.0 } else { -1.0 }
    }

    fn parameters(&mut self) -> (f64, f64) {
        (self.uniform(0.1, 3.0), self.uniform(0.1, 1.0))
    }
}

/// Bound of the slopes |d post/d edge coordinate| for the ranges of [`Draw`].
const SLOPE: f64 = 200.0;
const DISTANCES: [f64; 3] = [1e-3, 1e-6, 1e-9];

/// Asserts continuity of `after`, a function of the signed distance from the edge, and the regimes
/// before, on and beyond it.
fn edge(regimes: [RegimeKind; 3], after: impl Fn(f64) -> Impact) {
    let on = after(0.0);
    assert_eq!(on.regime.kind(), regimes[1], "on the edge: {on:?}");
    for d in DISTANCES {
        let (before, beyond) = (after(-d), after(d));
        assert_eq!(before.regime.kind(), regimes[0], "{d} before the edge: {before:?}");
        assert_eq!(beyond.regime.kind(), regimes[2], "{d} beyond the edge: {beyond:?}");
        let largest = jump(&before, &on).max(jump(&beyond, &on));
        assert!(largest <= SLOPE * d, "jump {largest:e} at distance {d:e}: {before:?} {beyond:?}");
    }
}

// P* = 1, P_f = u, for the dyadic numbers below: comparisons are exact. The law never uses
// cos^2 + sin^2 = 1.
const UNIT: PreImpact = PreImpact { cos: 0.75, sin: 0.5, v1: 1.0, v2: 0.0 };
const UNIT_MASS_RATIO: f64 = 0.25;

#[test]
fn slip_that_ends_with_the_approach_counts_as_restitution() {
    // mu = 1/2: k = 1, reversal; u = P_f = 1 = P* at v2 = -1/4.
    let reversing = system(UNIT_MASS_RATIO, 0.5, 0.5);
    edge([ReversalInApproach, ReversalInRestitution, ReversalInRestitution], |d| {
        strike(&reversing, PreImpact { v2: -0.25 + d, ..UNIT })
    });
    // Sticking: random impacts on the edge th mbar = -k v2, where P* and P_f are equal but for
    // rounding, which must not decide.
    let mut draw = Draw::new(1);
    let (mut sticks, mut reversals) = (0, 0);
    for _ in 0..4000 {
        let (mass_ratio, restitution) = draw.parameters();
        let (friction, angle) = (draw.uniform(0.2, 3.0), draw.uniform(0.2, PI - 0.2));
        let (sin, cos) = angle.sin_cos();
        let v1 = draw.uniform(0.2, 2.0).copysign(cos);
        let k = cos + friction * v1.signum() * sin.abs();
        let system = system(mass_ratio, restitution, friction);
        let pre = PreImpact { cos, sin, v1, v2: -mass_ratio * v1 / k };
        if (cos.abs() - friction * sin).abs() < 1e-3 || pre.approach_velocity() < 0.1 {
            continue;
        }
        let [approach, at_rest] = if cos.abs() <= friction * sin {
            sticks += 1;
            [StickInApproach, StickInRestitution]
        } else {
            reversals += 1;
            [ReversalInApproach, ReversalInRestitution]
        };
        edge([approach, at_rest, at_rest], |d| {
            let v2 = pre.v2 + d * restitution.min(0.5);
            strike(&system, PreImpact { v2, ..pre })
        });
    }
    assert!(sticks > 500 && reversals > 500, "{sticks} {reversals}");
}

#[test]
fn slip_that_ends_with_the_restitution_is_slip() {
    // r = 1: (1 + r) P_f = 2 u = 1 = P* at v2 = 1/4.
    let system_ = system(UNIT_MASS_RATIO, 1.0, 0.5);
    edge([ReversalInRestitution, Slip, Slip], |d| {
        strike(&system_, PreImpact { v2: 0.25 + d / 4.0, ..UNIT })
    });
    // The same with sticking: mu = 3/2, k = 3/2, P* = 2/3 as soon as u = 11/24.
    let sticking = system(UNIT_MASS_RATIO, 1.0, 1.5);
    let edge_velocity = 0.75 - 11.0 / 24.0;
    assert_eq!(kind(&sticking, PreImpact { v2: edge_velocity + 1e-9, ..UNIT }), Slip);
    assert_eq!(kind(&sticking, PreImpact { v2: edge_velocity - 1e-9, ..UNIT }), StickInRestitution);
    for d in DISTANCES {
        let [before, beyond] =
            [-d, d].map(|d| strike(&sticking, PreImpact { v2: edge_velocity + d / 4.0, ..UNIT }));
        assert!(jump(&before, &beyond) <= SLOPE * d);
    }
}

#[test]
fn the_boundary_of_the_friction_cone_sticks() {
    // |cos x1| = mu |sin x1| exactly for mu = 3/2; in approach and in restitution.
    for (v2, reversal, stick) in [
        (-1.0, ReversalInApproach, StickInApproach),
        (0.0, ReversalInRestitution, StickInRestitution),
    ] {
        edge([reversal, stick, stick], |d| {
            strike(&system(UNIT_MASS_RATIO, 0.5, 1.5 + d / 4.0), PreImpact { v2, ..UNIT })
        });
    }
    // The mirrored tip, and x1' = 0 at the start, where the edge lies between slip and stick.
    for sign in [1.0, -1.0] {
        let pre = PreImpact { cos: 0.75 * sign, v1: 0.0, v2: -1.0, ..UNIT };
        edge([Slip, StickInApproach, StickInApproach], |d| {
            strike(&system(UNIT_MASS_RATIO, 0.5, 1.5 + d / 4.0), pre)
        });
    }
}

#[test]
fn without_tangential_velocity_the_tip_sticks_or_slips_away_from_the_push() {
    let mut draw = Draw::new(2);
    let (mut sticks, mut slips) = (0, 0);
    for _ in 0..2000 {
        let (mass_ratio, restitution) = draw.parameters();
        let angle = draw.uniform(0.2, PI - 0.2) * draw.sign();
        let friction = draw.uniform(0.05, 3.0);
        let (sin, cos) = angle.sin_cos();
        if (cos.abs() - friction * sin.abs()).abs() < 0.02 || cos.abs() < 0.02 {
            continue;
        }
        let system = system(mass_ratio, restitution, friction);
        let pre = PreImpact { cos, sin, v1: 0.0, v2: -draw.uniform(0.1, 2.0) };
        // The sign of a zero means nothing.
        let impact = strike(&system, pre);
        let negative = strike(&system, PreImpact { v1: -0.0, ..pre });
        assert_eq!(jump(&impact, &negative), 0.0);
        assert_eq!(impact.regime, negative.regime);
        if cos.abs() <= friction * sin.abs() {
            assert_eq!(impact.regime.kind(), StickInApproach);
            assert_eq!(impact.v1_post, 0.0);
            sticks += 1;
        } else {
            assert_eq!(impact.regime.kind(), Slip);
            assert_eq!(impact.v1_post.signum(), -cos.signum());
            slips += 1;
        }
        for d in DISTANCES {
            for v1 in [d, -d] {
                let beside = strike(&system, PreImpact { v1, ..pre });
                assert!(jump(&beside, &impact) <= SLOPE * d, "{pre:?} {friction} {d}");
            }
        }
    }
    assert!(sticks > 200 && slips > 200, "{sticks} {slips}");
}

#[test]
fn a_level_contact_is_frictionless() {
    let mut draw = Draw::new(3);
    for _ in 0..500 {
        let (mass_ratio, restitution) = draw.parameters();
        let system = system(mass_ratio, restitution, draw.uniform(0.1, 3.0));
        let cos = draw.sign();
        let v1 = draw.uniform(-2.0, 2.0);
        let pre = PreImpact { cos, sin: 0.0, v1, v2: v1 * cos - draw.uniform(0.1, 2.0) };
        let impact = strike(&system, pre);
        assert_eq!(impact.regime.kind(), Frictionless);
        assert_eq!(impact.impulse_tangential, 0.0);
        assert_eq!(kind(&system, PreImpact { sin: -0.0, ..pre }), Frictionless);
        for d in DISTANCES {
            for sin in [d, -d] {
                let beside = strike(&system, PreImpact { sin, ..pre });
                assert_ne!(beside.regime.kind(), Frictionless);
                assert!(jump(&beside, &impact) <= SLOPE * d, "{pre:?} {d}");
            }
        }
    }
}

#[test]
fn an_approach_that_slip_cannot_stop_ends_in_stick() {
    // s = -1: k = cos - mu |sin| = 3/4 - 7/4 = -1 for mu = 7/2, so mbar + k cos = 0 at mbar = 3/4.
    let pre = PreImpact { v1: -1.0, v2: -2.0, ..UNIT };
    edge([StickInApproach; 3], |d| strike(&system(0.75 + d / 4.0, 0.5, 3.5), pre));
    let mut draw = Draw::new(4);
    let mut grows = 0;
    for _ in 0..4000 {
        let (mass_ratio, restitution) = draw.parameters();
        let friction = draw.uniform(1.0, 5.0);
        let (sin, cos) = (draw.uniform(0.2, PI - 0.2) * draw.sign()).sin_cos();
        let v1 = -draw.uniform(0.2, 2.0).copysign(cos);
        let k = cos + friction * v1.signum() * sin.abs();
        if mass_ratio + k * cos > 0.0 {
            continue;
        }
        grows += 1;
        let pre = PreImpact { cos, sin, v1, v2: v1 * cos - draw.uniform(0.1, 2.0) };
        let impact = strike(&system(mass_ratio, restitution, friction), pre);
        assert_eq!(impact.regime.kind(), StickInApproach);
        assert_eq!(impact.v1_post, 0.0);
        // A graze there has a finite effect: it does not vanish with u.
        let gentle = PreImpact { v2: v1 * cos - 1e-12, ..pre };
        let impact = strike(&system(mass_ratio, restitution, friction), gentle);
        assert_eq!(impact.v1_post, 0.0);
        assert!((impact.v1_post - v1).abs() >= 0.2);
    }
    assert!(grows > 200, "{grows}");
}

#[test]
fn a_push_through_the_pivot_of_slip_keeps_the_angular_velocity() {
    // k = cos - mu |sin| = 0 for mu = 3/2 and s = -1.
    let system_ = system(0.5, 0.5, 1.5);
    let pre = PreImpact { v1: -1.0, v2: -2.0, ..UNIT };
    let impact = strike(&system_, pre);
    assert_eq!(impact.regime.kind(), Slip);
    assert_eq!(impact.v1_post, pre.v1);
    assert_eq!(impact.separation_velocity, -0.5 * impact.approach_velocity);
    for d in DISTANCES {
        for friction in [1.5 - d, 1.5 + d] {
            let beside = strike(&system(0.5, 0.5, friction), pre);
            assert!(jump(&beside, &impact) <= SLOPE * d);
        }
    }
    // With an immovable wall no impulse stops that approach.
    assert_eq!(resolve(&system(0.0, 0.5, 1.5), &pre), Err(ImpactFailure::Jammed));
}

#[test]
fn a_wall_jams_only_while_it_approaches_a_sticking_tip() {
    let mut draw = Draw::new(5);
    let mut counts = [0; 3];
    for _ in 0..4000 {
        let (_, restitution) = draw.parameters();
        let friction = draw.uniform(0.1, 3.0);
        let (sin, cos) = (draw.uniform(0.2, PI - 0.2) * draw.sign()).sin_cos();
        let sticks = cos.abs() <= friction * sin.abs();
        let system = system(0.0, restitution, friction);
        let v1 = draw.uniform(0.2, 2.0).copysign(cos);
        let tip = v1 * cos;

        // At rest: P* = P_f identically, whatever rounding says.
        let impact = strike(&system, PreImpact { cos, sin, v1, v2: 0.0 });
        let expected = if sticks { StickInRestitution } else { ReversalInRestitution };
        assert_eq!(impact.regime.kind(), expected);
        assert_eq!(impact.v2_post, 0.0);
        if sticks {
            assert_eq!((impact.v1_post, impact.separation_velocity), (0.0, 0.0));
        }

        // Receding more slowly than the tip comes: never jammed.
        let v2 = tip * draw.uniform(0.01, 0.9);
        let impact = strike(&system, PreImpact { cos, sin, v1, v2 });
        assert!(!matches!(impact.regime.kind(), StickInApproach | ReversalInApproach));
        assert_eq!(impact.v2_post, v2);

        // Approaching: slip ends in approach; a tip that sticks then is jammed.
        let pre = PreImpact { cos, sin, v1, v2: -draw.uniform(0.1, 2.0) };
        if sticks {
            assert_eq!(resolve(&system, &pre), Err(ImpactFailure::Jammed));
            let still = PreImpact { v1: 0.0, ..pre };
            assert_eq!(resolve(&system, &still), Err(ImpactFailure::Jammed));
            counts[0] += 1;
        } else {
            let impact = strike(&system, pre);
            assert_eq!(impact.regime.kind(), ReversalInApproach);
            assert!(impact.separation_velocity < 0.0);
            counts[1] += 1;
        }
        // A tip that slips towards the wall's push and meets it head-on slips through.
        let away = PreImpact { v1: -v1, v2: -tip - draw.uniform(0.1, 1.0), ..pre };
        let k = cos - friction * sin.abs() * cos.signum();
        if k * cos > 0.0 {
            assert_eq!(kind(&system, away), Slip);
            counts[2] += 1;
        } else {
            assert_eq!(resolve(&system, &away), Err(ImpactFailure::Jammed));
        }
    }
    assert!(counts.iter().all(|&count| count > 500), "{counts:?}");
}

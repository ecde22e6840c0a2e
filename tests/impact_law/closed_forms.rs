//! The closed forms of Han, Jin & Hu (2004), eqs. (9), (10), (14)-(18), coded anew here: they equal
//! the walk where nothing sticks, and taken literally they create energy or fail (docs/theory.md,
//! section 4 and errata E1 to E3).

use std::f64::consts::PI;

use vibroimpact::impact::{ImpactFailure, PreImpact, RegimeKind, resolve};
use vibroimpact::{ImpactLaw, System};

use RegimeKind::{ReversalInApproach, ReversalInRestitution, Slip};

use super::{Draw, jump, kind, strike, system};

fn literal(mass_ratio: f64, restitution: f64, friction: f64) -> System {
    System::builder()
        .mass_ratio(mass_ratio)
        .frequency_ratio(1.0)
        .restitution(restitution)
        .gap(0.0)
        .drive_frequency(1.0)
        .friction(friction)
        .law(ImpactLaw::Paper)
        .build()
        .unwrap()
}

/// The paper's case by its own inequalities, or by the table of docs/theory.md.
#[derive(Clone, Copy, PartialEq, Debug)]
enum Case {
    /// Eq. (14): reversal in approach.
    One,
    /// Eq. (16): reversal in restitution.
    Two,
    /// Eq. (18): no reversal.
    Three,
}

/// One impact in the paper's notation, with its signed sine.
struct Printed {
    mbar: f64,
    r: f64,
    c: f64,
    th: f64,
    x: f64,
    /// cos + mu sgn(th) sin and cos - mu sgn(th) sin.
    plus: f64,
    minus: f64,
}

impl Printed {
    fn new(system: &System, pre: &PreImpact) -> Self {
        let friction = system.friction() * pre.v1.signum() * pre.sin;
        Self {
            mbar: system.mass_ratio(),
            r: system.restitution(),
            c: pre.cos,
            th: pre.v1,
            x: pre.v2,
            plus: pre.cos + friction,
            minus: pre.cos - friction,
        }
    }

    /// (P*, P_f), eqs. (10), (9).
    fn impulses(&self) -> (f64, f64) {
        let Self { mbar, c, th, x, plus, .. } = *self;
        (th / plus, (th * c - x) / (mbar + c * plus))
    }

    fn case_as_printed(&self) -> Case {
        let (star, f) = self.impulses();
        if star < f {
            Case::One
        } else if star < (1.0 + self.r) * f {
            Case::Two
        } else {
            Case::Three
        }
    }

    fn case_by_table(&self) -> Case {
        let (star, _) = self.impulses();
        if star <= 0.0 { Case::Three } else { self.case_as_printed() }
    }

    /// (x1', x2') after, eqs. (14), (15); (16), (17); (18).
    fn velocities(&self, case: Case) -> (f64, f64) {
        let Self { mbar, r, c, th, x, plus, minus } = *self;
        let b2 = mbar + c * plus;
        match case {
            Case::One => {
                let a = c * ((plus - minus) / 2.0).powi(2) - c.powi(3) - mbar * plus;
                (
                    -minus * (mbar * th - r * th * c * minus + (1.0 + r) * x * plus) / a,
                    -(x * c * plus * minus + (1.0 + r) * mbar * th * c * minus
                        - r * mbar * x * plus)
                        / a,
                )
            }
            Case::Two => (
                minus * (mbar * th - plus * (r * th * c - (1.0 + r) * x)) / (b2 * plus),
                (x * c * plus + (1.0 + r) * mbar * th * c - r * mbar * x) / b2,
            ),
            Case::Three => (
                (mbar * th + plus * ((1.0 + r) * x - r * th * c)) / b2,
                ((1.0 + r) * mbar * th * c + x * c * plus - r * mbar * x) / b2,
            ),
        }
    }
}

#[test]
fn the_closed_forms_equal_the_walk_where_nothing_sticks() {
    let mut draw = Draw::new(6);
    let mut cases = [0; 3];
    let mut misjudged = 0;
    for _ in 0..60_000 {
        let (mass_ratio, restitution) = draw.parameters();
        let friction = draw.uniform(0.01, 1.5);
        let (sin, cos) = draw.uniform(0.01, PI - 0.01).sin_cos();
        let v1 = draw.uniform(0.05, 2.0) * draw.sign();
        let pre = PreImpact { cos, sin, v1, v2: v1 * cos - draw.uniform(0.05, 2.0) };
        let walk = strike(&system(mass_ratio, restitution, friction), pre);
        if cos.abs() <= friction * sin {
            // Sticking cannot be told apart by the closed forms; slip to the end can.
            if walk.regime.kind() != Slip {
                continue;
            }
        }
        let printed = Printed::new(&system(mass_ratio, restitution, friction), &pre);
        let case = printed.case_by_table();
        let expected = match case {
            Case::One => ReversalInApproach,
            Case::Two => ReversalInRestitution,
            Case::Three => Slip,
        };
        cases[case as usize] += 1;
        assert_eq!(walk.regime.kind(), expected, "{pre:?} {friction}");
        let (v1_post, v2_post) = printed.velocities(case);
        // The forms divide by mbar + k cos, and by k in case (2).
        let scale = 1.0 + pre.v1.abs() + pre.v2.abs();
        let loss = scale / mass_ratio.min(printed.plus.abs()).min(1.0);
        for (walked, closed) in [(walk.v1_post, v1_post), (walk.v2_post, v2_post)] {
            assert!((walked - closed).abs() <= 40.0 * f64::EPSILON * loss, "{pre:?} {walk:?}");
        }
        // The inequalities as printed agree where x1' cos x1 > 0, and fail on P* < 0.
        if v1 * cos > 0.0 {
            assert_eq!(printed.case_as_printed(), case);
        } else if printed.case_as_printed() != case {
            misjudged += 1;
        }
    }
    assert!(cases.iter().all(|&count| count > 1000), "{cases:?}");
    assert!(misjudged > 1000, "{misjudged}");
}

fn energy(mass_ratio: f64, v1: f64, v2: f64) -> f64 {
    0.5 * v1 * v1 + 0.5 * v2 * v2 / mass_ratio
}

#[test]
fn the_law_by_the_name_paper_is_what_is_printed() {
    let mut draw = Draw::new(7);
    let (mut created, mut failed, mut same) = (0, 0, 0);
    for _ in 0..20_000 {
        let (mass_ratio, restitution) = draw.parameters();
        let friction = draw.uniform(0.05, 1.5);
        let (sin, cos) = draw.uniform(-1.5, 1.5).sin_cos();
        let v1 = draw.uniform(0.05, 2.0) * draw.sign();
        let pre = PreImpact { cos, sin, v1, v2: v1 * cos - draw.uniform(0.05, 2.0) };
        let law = literal(mass_ratio, restitution, friction);
        let printed = Printed::new(&law, &pre);
        let (v1_post, v2_post) = printed.velocities(printed.case_as_printed());
        let before = energy(mass_ratio, pre.v1, pre.v2);
        match resolve(&law, &pre) {
            Ok(impact) => {
                let scale = 1.0 + v1_post.abs() + v2_post.abs();
                let near = |a: f64, b: f64| (a - b).abs() <= 1e-11 * scale / printed.plus.abs();
                assert!(near(impact.v1_post, v1_post) && near(impact.v2_post, v2_post), "{pre:?}");
                assert!(impact.separation_velocity <= 0.0);
                if energy(mass_ratio, impact.v1_post, impact.v2_post) > 1.01 * before {
                    // Friction drives the slip where sin x1 < 0 (E1), or reverses none (E2).
                    assert!(sin < 0.0 || v1 * cos < 0.0 || cos.abs() <= friction * sin.abs());
                    created += 1;
                }
                // Where the paper's assumptions hold it is right.
                if sin > 0.0 && v1 * cos > 0.0 && cos > friction * sin {
                    let walk = strike(&system(mass_ratio, restitution, friction), pre);
                    assert!(jump(&walk, &impact) <= 1e-12 * scale / printed.plus.abs());
                    same += 1;
                }
            }
            Err(failure) => {
                assert_eq!(failure, ImpactFailure::LawFailed);
                assert!(v1_post * cos - v2_post > -1e-12);
                failed += 1;
            }
        }
    }
    println!("paper: energy created {created}, law failed {failed}, same as poisson {same}");
    assert!(created > 100 && failed > 100 && same > 1000, "{created} {failed} {same}");
}

#[test]
fn for_negative_angles_the_literal_friction_drives_the_slip() {
    // x1 = -0.8: k = cos x1 - mu |sin x1| where it should be +; nothing is lost to restitution.
    let (sin, cos) = (-0.8f64).sin_cos();
    let pre = PreImpact { cos, sin, v1: 2.0, v2: 0.5 };
    let gain = |system: System| {
        let impact = strike(&system, pre);
        energy(0.6, impact.v1_post, impact.v2_post) / energy(0.6, pre.v1, pre.v2) - 1.0
    };
    let (literal, corrected) = (gain(literal(0.6, 1.0, 0.5)), gain(system(0.6, 1.0, 0.5)));
    println!("energy: literal {literal:+.3}, corrected {corrected:+.3}");
    assert!(literal > 0.01 && corrected < -0.01);
}

#[test]
fn the_literal_law_fails_where_it_lets_the_bodies_go_on_approaching() {
    // P* < 0 < P_f: by eq. (14) slip reverses before it began (E2).
    let (sin, cos) = 0.9f64.sin_cos();
    let pre = PreImpact { cos, sin, v1: -1.9, v2: -1.3 };
    assert_eq!(resolve(&literal(0.4, 0.5, 0.2), &pre), Err(ImpactFailure::LawFailed));
    assert_eq!(kind(&system(0.4, 0.5, 0.2), pre), Slip);
}

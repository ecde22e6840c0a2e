//! Energy audit of single impacts under every law (docs/theory.md, section 4): what is lost is the
//! drop of the kinetic energy, friction's work and restitution's together; a wall (mbar = 0) adds
//! its own work. `poisson` and `energetic` never gain energy, `newton` can.

use proptest::prelude::*;
use vibroimpact::impact::{Impact, PreImpact, Regime, RegimeKind};
use vibroimpact::{Contact, ImpactLaw};

use crate::support::impacts::{Case, LAWS, cases, config, sample};

/// Relative to the absolute works involved: a dozen roundings each, and the cancellation of
/// x1' cos x1 with x2' in u.
const AUDIT: f64 = 1e-12;

/// x1'^2/2 + x2'^2/(2 mbar).
fn energy(case: &Case, v1: f64, v2: f64) -> f64 {
    0.5 * v1 * v1 + 0.5 * v2 * v2 / case.mass_ratio
}

/// The works of an impact, each from its own straight segments of u(P) and x1'(P).
struct Works {
    /// int u dP while u > 0.
    approach: f64,
    /// -int u dP after.
    restitution: f64,
    /// int mu |sin x1| |x1'| dP.
    friction: f64,
}

impl Works {
    fn of(case: &Case, impact: &Impact) -> Self {
        let pre = &case.pre;
        let switch = match impact.regime {
            Regime::ReversalInApproach { switch }
            | Regime::ReversalInRestitution { switch }
            | Regime::StickInApproach { switch }
            | Regime::StickInRestitution { switch } => Some(switch),
            _ => None,
        };
        let mut knots = vec![(0.0, impact.approach_velocity, pre.v1)];
        if let Some(switch) = switch {
            knots.push((switch, -(pre.v2 + case.mass_ratio * switch), 0.0));
        }
        let end = (impact.impulse_normal, impact.separation_velocity, impact.v1_post);
        knots.push(end);
        let mut works = Self { approach: 0.0, restitution: 0.0, friction: 0.0 };
        for pair in knots.windows(2) {
            let ((p0, u0, v0), (p1, u1, v1)) = (pair[0], pair[1]);
            let step = p1 - p0;
            works.friction += 0.5 * step * case.friction * pre.sin.abs() * (v0.abs() + v1.abs());
            let (above, below) = (u0.max(0.0) + u1.max(0.0), u0.min(0.0) + u1.min(0.0));
            let (up, down) = if u0 > 0.0 && u1 < 0.0 {
                (step * u0 / (u0 - u1), step * u1 / (u1 - u0))
            } else {
                (step, step)
            };
            works.approach += 0.5 * up * above;
            works.restitution -= 0.5 * down * below;
        }
        works
    }

    fn size(&self) -> f64 {
        self.approach + self.restitution + self.friction
    }
}

proptest! {
    #![proptest_config(config())]

    #[test]
    fn the_loss_is_what_the_bodies_lose(case in cases()) {
        for law in LAWS {
            let Ok(impact) = case.resolve(law) else { continue };
            let (pre, works) = (&case.pre, Works::of(&case, &impact));
            let first = 0.5 * (pre.v1 * pre.v1 - impact.v1_post * impact.v1_post);
            if case.mass_ratio > 0.0 {
                let before = energy(&case, pre.v1, pre.v2);
                let after = energy(&case, impact.v1_post, impact.v2_post);
                let size = before + after + works.size();
                let error = before - after - impact.energy_loss;
                prop_assert!(error.abs() <= AUDIT * size, "{law:?} {error:e} {size} {impact:?}");
            } else {
                // Body 1 loses what is dissipated, and what it does on the moving wall.
                let on_wall = pre.v2 * impact.impulse_normal;
                let size = 0.5 * (pre.v1.powi(2) + impact.v1_post.powi(2))
                    + on_wall.abs()
                    + works.size();
                let error = first - impact.energy_loss - on_wall;
                prop_assert!(error.abs() <= AUDIT * size, "{law:?} {error:e} {size} {impact:?}");
            }
        }
    }

    #[test]
    fn the_loss_is_friction_and_what_restitution_keeps(case in cases()) {
        for law in LAWS {
            let Ok(impact) = case.resolve(law) else { continue };
            let works = Works::of(&case, &impact);
            let size = works.size();
            let kept = works.approach - works.restitution;
            prop_assert!((impact.friction_loss - works.friction).abs() <= AUDIT * size);
            let restitution = impact.energy_loss - impact.friction_loss;
            prop_assert!((restitution - kept).abs() <= AUDIT * size, "{law:?} {impact:?}");
            prop_assert!(impact.friction_loss >= 0.0);
            if case.friction == 0.0 || case.pre.sin == 0.0 {
                prop_assert_eq!(impact.friction_loss, 0.0);
            }
        }
    }

    #[test]
    fn restitution_returns_r_squared_of_the_work_of_approach(case in cases()) {
        let Ok(impact) = case.resolve(ImpactLaw::Energetic) else { return Ok(()) };
        let works = Works::of(&case, &impact);
        let stuck = matches!(
            impact.regime.kind(),
            RegimeKind::StickInApproach | RegimeKind::StickInRestitution
        );
        if case.mass_ratio == 0.0 && case.pre.v2 == 0.0 && stuck {
            // A wall at rest that holds the tip: u = 0 for good, and no work comes back.
            prop_assert_eq!((impact.v1_post, impact.separation_velocity), (0.0, 0.0));
            return Ok(());
        }
        let returned = case.restitution.powi(2) * works.approach;
        prop_assert!((works.restitution - returned).abs() <= AUDIT * works.size(), "{impact:?}");
    }

    #[test]
    fn only_newton_gains(case in cases()) {
        for law in [ImpactLaw::Poisson, ImpactLaw::Energetic] {
            let Ok(impact) = case.resolve(law) else { continue };
            prop_assert!(impact.energy_loss >= 0.0);
            if case.mass_ratio > 0.0 {
                let before = energy(&case, case.pre.v1, case.pre.v2);
                let after = energy(&case, impact.v1_post, impact.v2_post);
                prop_assert!(after <= before * (1.0 + 4.0 * f64::EPSILON), "{law:?} {impact:?}");
            }
        }
    }
}

#[test]
fn under_the_law_of_the_paper_friction_works_at_the_mean_slip_velocity() {
    // Exact while slip keeps its direction; where the sine is negative the literal friction drives.
    let (mut same, mut drives) = (0, 0);
    for case in sample(20_000) {
        let Ok(paper) = case.resolve(ImpactLaw::Paper) else { continue };
        assert!(paper.friction_loss.is_finite());
        match paper.regime.kind() {
            RegimeKind::Frictionless => assert_eq!(paper.friction_loss, 0.0),
            RegimeKind::Slip if case.pre.sin > 0.0 && case.pre.v1 != 0.0 => {
                let Ok(poisson) = case.resolve(ImpactLaw::Poisson) else { continue };
                if poisson.regime.kind() == RegimeKind::Slip {
                    // Its tangential impulse is a difference of velocities.
                    let size = Works::of(&case, &poisson).size()
                        + case.pre.v1.powi(2)
                        + poisson.v1_post.powi(2);
                    assert!((paper.friction_loss - poisson.friction_loss).abs() <= AUDIT * size);
                    same += 1;
                }
            }
            // Its impulse can be negative, too, where mbar + k cos x1 < 0.
            RegimeKind::Slip if case.pre.v1 * paper.v1_post > 0.0 && paper.impulse_normal > 0.0 => {
                assert!(paper.friction_loss < 0.0, "{case:?} {paper:?}");
                drives += 1;
            }
            _ => {}
        }
    }
    assert!(same > 500 && drives > 500, "{same} {drives}");
}

/// E_post/E_pre under `newton`.
fn growth(mass_ratio: f64, restitution: f64, friction: f64, pre: PreImpact) -> f64 {
    let case = Case { contact: Contact::Oblique, mass_ratio, restitution, friction, pre };
    let impact = case.resolve(ImpactLaw::Newton).unwrap();
    let (before, after) =
        (energy(&case, pre.v1, pre.v2), energy(&case, impact.v1_post, impact.v2_post));
    // The loss is its drop, and negative where energy is created.
    assert!((before - after - impact.energy_loss).abs() <= AUDIT * (before + after));
    after / before
}

/// The largest growth over 400 angles in (0, pi/2) and 400 ratios x1'/u in (0, 2).
fn largest_growth(mass_ratio: f64, restitution: f64, friction: f64) -> f64 {
    let middle = |index: i32| (f64::from(index) + 0.5) / 400.0;
    let mut largest = 0f64;
    for (angle, ratio) in (0..400).flat_map(|i| (0..400).map(move |j| (middle(i), middle(j)))) {
        let (sin, cos) = (angle * std::f64::consts::FRAC_PI_2).sin_cos();
        let v1 = 2.0 * ratio;
        let pre = PreImpact { cos, sin, v1, v2: v1 * cos - 1.0 };
        largest = largest.max(growth(mass_ratio, restitution, friction, pre));
    }
    largest
}

#[test]
fn newton_creates_energy_at_the_papers_parameters() {
    // mbar = 0.6, r = 0.8: nothing at mu = 0.7, some four per cent at 0.78, two thirds at 5.
    let growths = [0.5, 0.7, 0.78, 5.0].map(|friction| largest_growth(0.6, 0.8, friction));
    println!("largest E_post/E_pre under newton at mu 0.5, 0.7, 0.78, 5: {growths:?}");
    assert!(growths[0] < 1.0 && growths[1] < 1.0);
    assert!((growths[2] - 1.043).abs() < 0.001, "{growths:?}");
    assert!((growths[3] - 1.664).abs() < 0.005, "{growths:?}");
}

#[test]
fn newton_creates_energy_without_bound_as_the_mass_ratio_vanishes() {
    // Body 2 at rest and a tip that comes to stick: all that is left is x2' = r x1' cos x1, with
    // r^2 cos^2 x1/mbar times the energy before.
    for (mass_ratio, expected) in [(0.1, 9.6), (0.02, 48.0), (1e-6, 9.6e5)] {
        let (sin, cos) = 0.2f64.sin_cos();
        let factor = growth(mass_ratio, 1.0, 5.0, PreImpact { cos, sin, v1: 1.0, v2: 0.0 });
        println!("newton, mbar = {mass_ratio}: E_post/E_pre = {factor:.4}");
        assert!((factor * mass_ratio / (cos * cos) - 1.0).abs() <= AUDIT);
        assert!((factor / expected - 1.0).abs() < 0.01);
    }
}

#[test]
fn every_law_meets_every_regime_in_the_audit() {
    let mut seen = [[0; 6]; 3];
    let mut gains = 0;
    for case in sample(20_000) {
        for (law, seen) in LAWS.into_iter().zip(&mut seen) {
            if let Ok(impact) = case.resolve(law) {
                seen[impact.regime.kind() as usize] += 1;
                gains += i32::from(impact.energy_loss < 0.0);
            }
        }
    }
    println!("impacts by law and regime {seen:?}, {gains} with a gain");
    assert!(seen.iter().flatten().all(|&count| count > 100), "{seen:?}");
    assert!(gains > 100, "{gains}");
}

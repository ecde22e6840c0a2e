//! Energy audit: the works of forcing, damping, impacts, friction and contact sum to the change of
//! energy.

use vibroimpact::{CancelToken, Contact, ImpactLaw, Run, RunOptions, StopReason, System};

use super::{Draw, ball, chattering, go, paper_start, state, until};

/// Allowed residual, in units of the total absolute work.
const RESIDUAL: f64 = 1e-12;

fn check(run: &Run) -> f64 {
    let audit = run.energy_audit(&CancelToken::never()).unwrap();
    let residual = audit.residual().abs() / audit.total;
    // A wall that drives the tip to the end of its reach, cos x1 = 0, leaves no digits.
    if run.stop_reason == StopReason::Jammed {
        return 0.0;
    }
    assert!(residual <= RESIDUAL, "{residual:e} {audit:?}\n{:?}", run.system);
    assert!(audit.damping <= 0.0 && audit.contact_friction <= 0.0, "{audit:?}");
    residual
}

#[test]
fn the_works_of_random_runs_sum_to_the_change_of_energy() {
    let mut worst: f64 = 0.0;
    let mut draw = Draw::new(17);
    for law in [ImpactLaw::Poisson, ImpactLaw::Newton, ImpactLaw::Energetic] {
        for i in 0..60 {
            let system = draw.system();
            let system = if i % 3 == 0 { system.with("mass_ratio", 0.0).unwrap() } else { system };
            let system = system.with_law(law);
            let start = draw.start(&system);
            let run = go(&system, start, RunOptions::periods(40));
            worst = worst.max(check(&run));
            let impacts = run.energy_audit(&CancelToken::never()).unwrap();
            assert!(impacts.impact_friction <= 0.0);
        }
    }
    println!("worst residual {worst:e} of the total absolute work");
}

#[test]
fn chatter_and_contact_are_audited_too() {
    let (mut worst, mut in_contact): (f64, usize) = (0.0, 0);
    for friction in [0.0, 0.3, 0.8] {
        for omega in [0.22, 0.3, 0.4] {
            for mass_ratio in [0.0, 0.6] {
                let system = chattering(omega).restitution(0.5).moment_amplitude(3.0);
                // A wall that swings little enough not to jam the pendulum.
                let (force, gap) = if mass_ratio == 0.0 { (0.3, 0.0) } else { (1.5, 0.5) };
                let system = system.friction(friction).mass_ratio(mass_ratio);
                let system = system.force_amplitude(force).gap(gap).build().unwrap();
                let run = go(&system, paper_start(), RunOptions::periods(6));
                worst = worst.max(check(&run));
                let audit = run.energy_audit(&CancelToken::never()).unwrap();
                in_contact += usize::from(!run.contacts.is_empty());
                assert_eq!(run.stop_reason, StopReason::Completed);
                assert_eq!(audit.wall != 0.0, mass_ratio == 0.0);
                // The window's works add up: first half and second half.
                let half = go(&system, paper_start(), RunOptions::periods(3));
                let rest = half.resume(RunOptions::periods(6), &CancelToken::never()).unwrap();
                worst = worst.max(check(&rest));
                let sum = half.energy_audit(&CancelToken::never()).unwrap().moment
                    + rest.energy_audit(&CancelToken::never()).unwrap().moment;
                assert!((sum - audit.moment).abs() <= 1e-12 * audit.total);
            }
        }
    }
    assert!(in_contact > 12, "{in_contact}");
    println!("worst residual {worst:e} of the total absolute work");
}

#[test]
fn a_ball_loses_all_its_energy_in_its_bounces() {
    let audit = go(&ball(9.8, 0.5), state(-1.0, 0.0, 0.0, 0.0), until(2.0))
        .energy_audit(&CancelToken::never())
        .unwrap();
    assert!((audit.moment - 9.8).abs() < 1e-14);
    assert!((audit.restitution + 9.8).abs() < 1e-12, "{audit:?}");
    assert_eq!((audit.damping, audit.force, audit.wall), (0.0, 0.0, 0.0));
    assert_eq!((audit.energy_start, audit.energy_end), (0.0, 0.0));
}

#[test]
fn a_start_on_the_contact_is_audited_from_before_its_impact() {
    let system: System = chattering(0.4).contact(Contact::Oblique).build().unwrap();
    let run = go(&system, state(0.3, 1.0, 0.3f64.sin() - 0.5, 0.2), RunOptions::periods(2));
    assert_eq!(run.impacts[0].time, 0.0);
    check(&run);
}

#[test]
fn elastic_impacts_keep_the_energy() {
    // A rounded 1 + mbar would take the same part of the energy in each of the 46,000 impacts.
    for mass_ratio in [0.6, 0.3, 1.7] {
        let system = System::builder()
            .mass_ratio(mass_ratio)
            .frequency_ratio(2.0)
            .restitution(1.0)
            .gap(0.1)
            .drive_frequency(1.0)
            .contact(Contact::Direct)
            .build()
            .unwrap();
        let run = go(&system, paper_start(), RunOptions::periods(20_000).keep(0));
        let end = run.final_state.state;
        let energy = 0.5 * (end.v1 * end.v1 + 4.0 * end.x1 * end.x1)
            + 0.5 * (end.v2 * end.v2 + end.x2 * end.x2) / mass_ratio;
        let drift = energy / 0.125 - 1.0;
        println!("mbar = {mass_ratio}: {drift:e} after {} impacts", run.impact_count);
        assert!(run.impact_count > 40_000 && drift.abs() < 1e-12, "{drift:e}");
    }
}

use super::*;
use crate::model::parameters::{Contact, ImpactLaw, SystemBuilder};
use crate::simulate::run::{RunOptions, run};
use crate::tangent::Strike;
use crate::{CancelToken, Horizon};

/// Largest difference between what an impact maps perturbations to and the derivative of its
/// whole leg, relative to the latter, and how many impacts there were of each regime.
fn compare(builder: SystemBuilder) -> (f64, [usize; 6]) {
    let system = builder.build().unwrap();
    let start = State { x1: 0.0, v1: 0.5, x2: 0.0, v2: 0.0 };
    let options = RunOptions::periods(20);
    let before = run(&system, start, options, &CancelToken::never()).unwrap();
    let mut simulation = before.resumed();
    simulation.extend_to(Horizon::Periods(60));
    let mut perturbations = Perturbations::<4>::new(&system, &before.final_state, false, true);
    let (mut worst, mut regimes) = (0.0_f64, [0; 6]);
    while let Some(Ok(event)) = simulation.advance(&mut ()) {
        let from = perturbations.here.clone();
        let reader = LegReader { mode: perturbations.reader.mode };
        if let (Event::Impact(impact), None) = (&event, reader.mode) {
            let kind = impact.impact.regime.kind();
            let clock = impact.clock;
            let mut probe = reader;
            let LegChange::Ends(leg, ..) = probe.read(&system, &event) else { unreachable!() };
            let whole = perturbations.derivative_of(leg, None, clock).unwrap();
            let mut expected = from.directions.clone();
            expected.map(&whole);
            let Leg::Impact(_, signs) = leg else { unreachable!() };
            let departure = from.departure(&perturbations.model);
            let strike = Strike::new(
                &perturbations.model,
                &departure,
                impact,
                simulation.present_flight(),
                (kind, signs),
            );
            let mut found = from.directions.clone();
            found.map(&strike);
            let pairs = || {
                let columns = [found.columns(), expected.columns()];
                columns[0].iter().flatten().zip(columns[1].iter().flatten())
            };
            let size = pairs().fold(0.0_f64, |most, (_, x)| most.max(x.abs()));
            let off = pairs().fold(0.0_f64, |most, (x, y)| most.max((x - y).abs()));
            worst = worst.max(off / size.max(1.0));
            regimes[kind as usize] += 1;
        }
        if perturbations.take(&event, simulation.present_flight()).is_err() {
            break;
        }
    }
    (worst, regimes)
}

#[test]
fn an_impact_maps_perturbations_as_the_derivative_of_its_leg_does() {
    let paper = System::builder()
        .mass_ratio(0.6)
        .frequency_ratio(2.0)
        .restitution(0.8)
        .gap(0.5)
        .drive_frequency(1.545)
        .moment_amplitude(1.0);
    let mut all = [0; 6];
    for law in [ImpactLaw::Poisson, ImpactLaw::Newton, ImpactLaw::Energetic] {
        for friction in [0.0, 0.1, 0.5, 2.0] {
            for damping in [0.0, 0.02] {
                for contact in [Contact::Oblique, Contact::Direct] {
                    let builder = paper
                        .clone()
                        .law(law)
                        .friction(if contact == Contact::Direct { 0.0 } else { friction })
                        .pendulum_damping(damping)
                        .oscillator_damping(damping)
                        .contact(contact);
                    let (worst, regimes) = compare(builder);
                    assert!(worst < 1e-9, "{law:?} {friction} {damping} {contact:?} {worst}");
                    for (all, one) in all.iter_mut().zip(regimes) {
                        *all += one;
                    }
                }
            }
        }
    }
    assert!(all.iter().filter(|&&impacts| impacts > 10).count() >= 5, "{all:?}");
}

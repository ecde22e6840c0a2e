//! Periodic motions from the Rust side: legs, residuals, derivatives, return map.
//! The reference values are tested from Python (tests/python/test_orbits.py).

use nalgebra::{DMatrix, DVector, Matrix4};
use vibroimpact::analysis::shooting::{BorderKind, Orbit};
use vibroimpact::tangent::itinerary::{Itinerary, ItineraryError, Leg, Node};
use vibroimpact::{CancelToken, Contact, RunOptions, State, System, run};

fn paper(omega: f64) -> vibroimpact::SystemBuilder {
    System::builder()
        .mass_ratio(0.6)
        .frequency_ratio(2.0)
        .restitution(0.8)
        .gap(0.5)
        .drive_frequency(omega)
        .moment_amplitude(1.0)
}

/// A motion of `m` periods by Newton's method from the end of a run.
fn settled(system: &System, m: i64) -> (Itinerary, Vec<Node>) {
    let start = State::new(0.0, 0.5, 0.0, 0.0).unwrap();
    let end =
        run(system, start, RunOptions::periods(3000), &CancelToken::never()).unwrap().final_state;
    let (legs, mut nodes) =
        Itinerary::follow(system, end.state, m, 100_000, &CancelToken::never()).unwrap();
    for _ in 0..6 {
        let residual = Orbit::new(system, &legs, &nodes).unwrap().residual(&[]).unwrap();
        let rows = residual.values.len();
        let jacobian = DMatrix::from_row_slice(rows, residual.columns, &residual.jacobian);
        let step = jacobian.lu().solve(&DVector::from_vec(residual.values)).unwrap();
        for (node, change) in nodes.iter_mut().zip(step.as_slice().chunks(4)) {
            *node = Node::from_array(std::array::from_fn(|c| node.to_array()[c] - change[c]));
        }
    }
    (legs, nodes)
}

fn determinant(system: &System, legs: &Itinerary, nodes: &[Node]) -> f64 {
    let transfer = Orbit::new(system, legs, nodes).unwrap().transfer();
    transfer.iter().map(Matrix4::determinant).product()
}

#[test]
fn a_motion_without_friction_contracts_volumes_as_the_theory_says() {
    // docs/theory.md, section 7: r^(2n) exp(-2 (zeta1 omega0 + zeta2) 2 m pi/omega).
    for (builder, m) in [
        (paper(1.8), 1),
        (paper(1.25), 1),
        (paper(1.1), 2),
        (paper(0.75).pendulum_damping(0.1).oscillator_damping(0.1).force_amplitude(1.5), 1),
    ] {
        let system = builder.build().unwrap();
        let (legs, nodes) = settled(&system, m);
        let impacts = i32::try_from(legs.legs.len()).unwrap();
        let decay =
            system.pendulum_damping() * system.frequency_ratio() + system.oscillator_damping();
        let volume = system.restitution().powi(2 * impacts)
            * (-2.0 * decay * m as f64 * system.drive_period()).exp();
        let found = determinant(&system, &legs, &nodes);
        assert!((found / volume - 1.0).abs() < 1e-12, "{found} {volume}");
    }
}

#[test]
fn a_motion_with_chatter_has_a_chatter_leg_and_a_slide() {
    let system = paper(0.3)
        .pendulum_damping(0.1)
        .oscillator_damping(0.1)
        .force_amplitude(1.5)
        .build()
        .unwrap();
    let (legs, nodes) = settled(&system, 1);
    assert_eq!(legs.legs.iter().filter(|leg| **leg == Leg::Chatter).count(), 1);
    assert!(legs.legs.contains(&Leg::SlideToRelease(true)));
    let tests = Orbit::new(&system, &legs, &nodes).unwrap().tests();
    assert!(tests.iter().all(|test| test.value > 0.0), "{tests:?}");
    assert!(tests.iter().any(|test| test.condition.border.kind() == BorderKind::ChatterOnset));
    // Sliding holds the motion on g = g' = 0: two multipliers are zero.
    assert!(determinant(&system, &legs, &nodes).abs() < 1e-16);
}

#[test]
fn the_return_map_of_a_wall_at_rest_is_that_of_the_impact_oscillator() {
    // COCO's oscillator: multipliers -0.584295314342 +- 0.005600351492 i.
    let system = System::builder()
        .mass_ratio(0.0)
        .frequency_ratio(1.0)
        .pendulum_damping(0.05)
        .restitution(0.8)
        .gap(1.0)
        .drive_frequency(1.0)
        .moment_amplitude(1.0)
        .contact(Contact::Direct)
        .build()
        .unwrap();
    let start = State::new(0.0, 0.0, 0.0, 0.0).unwrap();
    let end =
        run(&system, start, RunOptions::periods(2000), &CancelToken::never()).unwrap().final_state;
    let (legs, nodes) =
        Itinerary::follow(&system, end.state, 1, 1000, &CancelToken::never()).unwrap();
    assert!(legs.wall_at_rest);
    let map = Orbit::new(&system, &legs, &nodes).unwrap().transfer()[0];
    let trace = map[(1, 1)] + map[(3, 3)];
    let determinant = map[(1, 1)] * map[(3, 3)] - map[(1, 3)] * map[(3, 1)];
    assert!((trace - 2.0 * -0.584_295_314_342).abs() < 1e-10, "{trace}");
    let modulus = 0.584_295_314_342_f64.hypot(0.005_600_351_492);
    assert!((determinant - modulus * modulus).abs() < 1e-10, "{determinant}");
}

#[test]
fn bad_input_is_refused() {
    let system = paper(1.8).build().unwrap();
    let start = State::new(0.0, 0.5, 0.0, 0.0).unwrap();
    assert!(Itinerary::follow(&system, start, 0, 1000, &CancelToken::never()).is_err());
    let still = system.with("drive_frequency", 0.0).unwrap();
    assert!(matches!(
        Itinerary::follow(&still, start, 1, 1000, &CancelToken::never()),
        Err(ItineraryError::Parameter(error)) if error.name == "drive_frequency"
    ));
    let legs = Itinerary::new(vec!["circuit".parse().unwrap()], 1, None, false).unwrap();
    assert_eq!(Orbit::new(&system, &legs, &[]).unwrap_err().name, "nodes");
    let node = [Node { x1: 0.0, v1: 0.0, v2: 0.0, time: 0.0 }];
    let orbit = Orbit::new(&system, &legs, &node).unwrap();
    let names = |list: &[&str]| list.iter().map(ToString::to_string).collect::<Vec<_>>();
    assert!(orbit.residual(&names(&["colour"])).is_err());
    assert!(orbit.residual(&names(&["gap", "friction", "phase"])).is_err());
    assert!("impact:slip:+".parse::<Leg>().is_err());
}

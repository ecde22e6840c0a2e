//! Structures with stops, from rest, for the benchmarks.

use vibroimpact::{Stop, Structure, StructureState};

/// Drive frequencies at which two masses between two stops move chaotically.
pub const CHAOTIC_TWO: [f64; 8] = [0.8, 0.81, 0.82, 0.825, 0.875, 0.88, 0.97, 0.975];

/// Two masses, of which the first moves between two stops (docs/other-peoples-systems.md).
pub fn two_stops(drive_frequency: f64) -> Structure {
    Structure::builder(vec![vec![1.0, 0.0], vec![0.0, 2.0]], vec![vec![2.0, -1.0], vec![-1.0, 1.0]])
        .stop(Stop::new([1.0, 0.0], 0.3, 0.8))
        .stop(Stop::new([-1.0, 0.0], 0.3, 0.8))
        .damping_ratios(vec![0.02, 0.05])
        .drive(vec![0.0.into(), 1.0.into()], drive_frequency, 0.0)
        .build()
        .unwrap()
}

/// Masses in a row, each on a spring of its own, coupled to the next, and with a stop.
pub fn row_with_stops(count: usize, drive_frequency: f64) -> Structure {
    // Numbers without an order: multiples of the golden ratio, without their whole parts.
    let mut turns = 0.0;
    let mut draw = |low: f64, high: f64| {
        turns += 0.618_034;
        low + (high - low) * (turns % 1.0)
    };
    let mut mass = vec![vec![0.0; count]; count];
    let mut stiffness = mass.clone();
    let mut force = Vec::new();
    for i in 0..count {
        mass[i][i] = draw(0.8, 1.2);
        stiffness[i][i] += draw(0.4, 0.6);
        if i + 1 < count {
            let coupling = draw(0.8, 1.2);
            stiffness[i][i] += coupling;
            stiffness[i + 1][i + 1] += coupling;
            stiffness[i][i + 1] -= coupling;
            stiffness[i + 1][i] -= coupling;
        }
        force.push(draw(-1.0, 1.0).into());
    }
    let mut builder = Structure::builder(mass, stiffness).damping_ratios(vec![0.02; count]).drive(
        force,
        drive_frequency,
        0.0,
    );
    for i in 0..count {
        let mut normal = vec![0.0; count];
        normal[i] = 1.0;
        builder = builder.stop(Stop::new(normal, draw(0.3, 0.6), 0.7));
    }
    builder.build().unwrap()
}

/// At rest.
pub fn at_rest(count: usize) -> StructureState {
    StructureState::new(&vec![0.0; count], &vec![0.0; count])
}

//! Periodic motions and Lyapunov exponents of structures: head-on contact against the pendulum's
//! own machinery, one oscillator against closed forms, and what holds exactly.

use nalgebra::{Complex, DMatrix, DVector};
use vibroimpact::analysis::shooting::Orbit;
use vibroimpact::impact::strike;
use vibroimpact::tangent::itinerary::Itinerary;
use vibroimpact::{
    CancelToken, Contact, ParameterError, RunOptions, State, Stop, StopImpactRecord, Structure,
    StructureOrbitError, StructureStability, StructureState, System, lyapunov_spectrum, run,
    structure_lyapunov, structure_orbit,
};

const NEVER: fn() -> CancelToken = CancelToken::never;

/// (mbar, omega0, f1, f2, omega, damping, r).
type Head = (f64, f64, f64, f64, f64, f64, f64);

fn system(&(mass_ratio, frequency, f1, f2, omega, damping, r): &Head) -> System {
    System::builder()
        .mass_ratio(mass_ratio)
        .frequency_ratio(frequency)
        .restitution(r)
        .gap(0.5)
        .drive_frequency(omega)
        .moment_amplitude(f1)
        .force_amplitude(f2)
        .pendulum_damping(damping)
        .oscillator_damping(0.5 * damping)
        .contact(Contact::Direct)
        .build()
        .unwrap()
}

/// The same machine as a structure (docs/structures.md).
fn structure(&(mass_ratio, frequency, f1, f2, omega, damping, r): &Head) -> Structure {
    let diagonal = |a: f64, b: f64| vec![vec![a, 0.0], vec![0.0, b / mass_ratio]];
    Structure::builder(diagonal(1.0, 1.0), diagonal(frequency * frequency, 1.0))
        .damping(diagonal(2.0 * damping * frequency, damping))
        .drive([f1.into(), (f2 / mass_ratio).into()], omega, 0.0)
        .stop(Stop::new([1.0, -1.0], 0.5, r))
        .build()
        .unwrap()
}

const HEADS: [Head; 4] = [
    (0.6, 2.0, 1.0, 0.0, 1.8, 0.05, 0.8),
    (0.6, 2.0, 1.5, 0.3, 1.25, 0.1, 0.7),
    (1.5, 1.3, 0.8, -0.6, 2.2, 0.08, 0.6),
    (0.3, 2.6, 1.2, 0.4, 0.9, 0.12, 0.75),
];

fn moduli(of: &[Complex<f64>]) -> Vec<f64> {
    let mut found: Vec<f64> = of.iter().map(|l| l.norm()).collect();
    found.sort_by(|a, b| b.total_cmp(a));
    found
}

#[test]
fn head_on_contact_is_the_pendulums() {
    let mut compared = 0;
    for head in &HEADS {
        let (system, structure) = (system(head), structure(head));
        let start = State::new(0.0, 0.5, 0.0, 0.0).unwrap();
        let settled = run(&system, start, RunOptions::periods(2_000), &NEVER()).unwrap();
        let report = settled.period(&NEVER());
        let Some((m, _)) = report.orbit else { continue };
        let State { x1, v1, x2, v2 } = settled.final_state.state;
        let initial = StructureState::new(&[x1, x2], &[v1, v2]);
        let found = structure_orbit(&structure, initial.clone(), m as u32, &NEVER()).unwrap();
        let (legs, nodes) =
            Itinerary::follow(&system, settled.final_state.state, m as i64, 10_000, &NEVER())
                .unwrap();
        let own = Orbit::new(&system, &legs, &nodes).unwrap().return_map();
        let wanted = moduli(own.complex_eigenvalues().as_slice());
        let multipliers = moduli(&found.multipliers);
        assert_eq!(found.stability, StructureStability::Stable);
        assert!(found.residual < 1e-13);
        for (a, b) in multipliers.iter().zip(&wanted) {
            assert!((a - b).abs() < 1e-9, "{head:?}: {multipliers:?} {wanted:?}");
        }
        // From the orbit itself the exponents are ln |multiplier|/time, once the directions are
        // aligned.
        let time = f64::from(found.periods) * system.drive_period();
        let spectrum =
            structure_lyapunov(&structure, found.state.clone(), 2_000, 4, None, &NEVER()).unwrap();
        let theirs = lyapunov_spectrum(&settled, 2_000, None, &NEVER()).unwrap();
        // A pair of complex multipliers turns its directions: the area that they span is exact.
        let logs: Vec<f64> = multipliers.iter().map(|l| l.ln() / time).collect();
        for of in [&spectrum.exponents[..], &theirs.exponents] {
            for pair in 0..2 {
                let sum = of[2 * pair] + of[2 * pair + 1];
                let wanted = logs[2 * pair] + logs[2 * pair + 1];
                assert!((sum - wanted).abs() < 1e-9, "{head:?}: {sum} {wanted}");
            }
        }
        let first = structure_lyapunov(&structure, found.state, 2_000, 1, None, &NEVER()).unwrap();
        assert!((first.exponents[0] - logs[0]).abs() < 1e-3);
        compared += 1;
    }
    assert!(compared >= 3, "{compared}");
}

fn oscillator(omega: f64, gap: f64, r: f64, phase: f64) -> Structure {
    Structure::builder(vec![vec![1.0]], vec![vec![1.0]])
        .drive([1.0.into()], omega, phase)
        .stop(Stop::new([1.0], gap, r))
        .build()
        .unwrap()
}

/// x'' + x = cos(omega t), a stop at `gap`, one impact of velocity u and phase psi per drive period
/// T (Shaw & Holmes 1983). From one impact on, with h = 1/(1 - omega^2),
///
/// ```text
/// x = A cos t + B sin t + h cos(omega t + psi)
/// A = gap - h cos psi,   B = -r u + h omega sin psi
/// x(T) = gap, x'(T) = u:   B = A (1 - cos T)/sin T,   (1 + r) u = -2 B
/// h^2 = (gap - A)^2 + ((B + r u)/omega)^2, a quadratic equation for A
/// trace of the return map = -2 r cos T + (1 + r) (cos psi - gap) sin T/u,   determinant r^2
/// ```
#[test]
fn an_impact_oscillator_repeats_as_its_closed_form_says() {
    let mut stable = 0;
    for (omega, gap, r) in [(2.0, 0.0, 0.7), (2.2, -0.1, 0.8), (1.7, 0.3, 0.6), (2.6, 0.05, 0.5)] {
        let period = std::f64::consts::TAU / omega;
        let response = 1.0 / (1.0 - omega * omega);
        let (sin, cos) = period.sin_cos();
        let by_b = (1.0 - cos) / sin;
        let by_u = -2.0 * by_b / (1.0 + r);
        let by_s = (by_b + r * by_u) / omega;
        let (p, q, s) = (1.0 + by_s * by_s, -2.0 * gap, gap * gap - response * response);
        let root = (q * q - 4.0 * p * s).sqrt();
        for a in [(-q + root) / (2.0 * p), (-q - root) / (2.0 * p)] {
            let u = by_u * a;
            if u <= 0.0 {
                continue;
            }
            let (c, s) = ((gap - a) / response, by_s * a / response);
            let trace = -2.0 * r * cos + (1.0 + r) * (c - gap) * sin / u;
            // From half a period before, along the closed form.
            let (sin, cos) = (0.5 * period).sin_cos();
            let b = by_b * a;
            let from = StructureState::new(
                &[a * cos + b * sin - response * c],
                &[b * cos - a * sin + response * omega * s],
            );
            let structure = oscillator(omega, gap, r, s.atan2(c) + std::f64::consts::PI);
            let found = structure_orbit(&structure, from.clone(), 1, &NEVER()).unwrap();
            assert_eq!(found.impacts, [1]);
            let off = found.state.q[0] - from.q[0];
            let sum: Complex<f64> = found.multipliers.iter().sum();
            let product: Complex<f64> = found.multipliers.iter().product();
            assert!(off.abs() < 1e-13);
            assert!((sum.re - trace).abs() < 1e-12 * trace.abs().max(1.0) && sum.im.abs() < 1e-13);
            assert!((product.re - r * r).abs() < 1e-13);
            // Schur and Cohn: |trace| < 1 + determinant.
            let wanted = if trace.abs() < 1.0 + r * r {
                StructureStability::Stable
            } else {
                StructureStability::Unstable
            };
            assert_eq!(found.stability, wanted);
            stable += usize::from(wanted == StructureStability::Stable);
        }
    }
    assert!(stable >= 2, "{stable}");
}

/// Two masses on springs, one of which meets a stop.
fn chain(omega: f64, gap: f64, restitution: f64) -> Result<Structure, ParameterError> {
    Structure::builder(vec![vec![1.0, 0.0], vec![0.0, 1.0]], vec![vec![2.0, -1.0], vec![-1.0, 2.0]])
        .damping_ratios([0.05, 0.05])
        .drive([1.0.into(), 0.0.into()], omega, 0.0)
        .stop(Stop::new([0.0, 1.0], gap, restitution))
        .build()
}

fn settled(structure: &Structure) -> StructureState {
    let rest = StructureState::new(&[0.0; 2], &[0.0; 2]);
    run(structure, rest, RunOptions::periods(400), &NEVER()).unwrap().final_state.state
}

/// A row of masses on springs, each of which meets a stop along its coordinate and slips beside it.
fn row(count: usize, friction: f64) -> Structure {
    let between = |own: f64, next: f64| {
        let entry = |i: usize, j: usize| match i.abs_diff(j) {
            0 => own,
            1 => next,
            _ => 0.0,
        };
        (0..count).map(|i| (0..count).map(|j| entry(i, j)).collect()).collect::<Vec<Vec<f64>>>()
    };
    let mut builder = Structure::builder(between(1.0, 0.1), between(2.0, -0.9))
        .damping(between(0.06, -0.02))
        .drive((0..count).map(|i| (1.0 + 0.1 * i as f64).into()).collect::<Vec<_>>(), 1.1, 0.0);
    for i in 0..count {
        let along = |own: f64, next: f64| {
            let mut row = vec![0.0; count];
            row[i] = own;
            row[(i + 1) % count] += next;
            row
        };
        let stop = Stop::new(along(1.0, 0.0), 0.4 + 0.01 * i as f64, 0.8);
        builder = builder.stop(if friction > 0.0 {
            stop.with_friction(friction, along(0.3, 1.0))
        } else {
            stop
        });
    }
    builder.build().unwrap()
}

/// ln |det S| of an impact: S = R + (F+ - R F-) (n, 0)/u-, whose determinant is det(dv+/dv-) u+/u-.
fn volume_of(structure: &Structure, impact: &StopImpactRecord) -> f64 {
    let stop = usize::try_from(impact.stop).unwrap();
    let normal = structure.stops()[stop].normal();
    let after = |place: usize, by: f64| {
        let mut v = impact.v_pre.to_vec();
        v[place] += by;
        let u = normal.iter().zip(&v).map(|(n, v)| n * v).sum();
        strike(structure, stop, u, &mut v).unwrap();
        DVector::from_vec(v)
    };
    // An impact that slips is linear in the velocities: differences have no error but rounding.
    let step = 1e-4;
    let columns: Vec<DVector<f64>> = (0..structure.coordinates())
        .map(|place| (after(place, step) - after(place, -step)) / (2.0 * step))
        .collect();
    let apart: f64 = normal.iter().zip(&impact.v_post).map(|(n, v)| n * v).sum();
    (DMatrix::from_columns(&columns).determinant() * apart / impact.approach_velocity).abs().ln()
}

/// Of all 2N exponents damping takes tr M^-1 C, and each impact the logarithm of its determinant.
#[test]
fn all_exponents_add_up_to_damping_and_impacts() {
    let (periods, aligning) = (60, 6);
    for (count, friction) in [(20, 0.0), (20, 0.02), (6, 0.05)] {
        let structure = row(count, friction);
        let matrix = |of: &[Vec<f64>]| DMatrix::from_fn(count, count, |i, j| of[i][j]);
        let damping = matrix(structure.mass()).lu().solve(&matrix(&structure.damping())).unwrap();
        let rest = StructureState::new(&vec![0.0; count], &vec![0.0; count]);
        let found =
            structure_lyapunov(&structure, rest.clone(), periods, 2 * count, None, &NEVER())
                .unwrap();
        assert!(found.error.is_none(), "{:?}", found.error);
        let whole = run(&structure, rest, RunOptions::periods(periods.into()), &NEVER()).unwrap();
        let measured = whole.impacts.iter().filter(|impact| impact.period >= aligning);
        let volumes: Vec<f64> = measured.map(|impact| volume_of(&structure, impact)).collect();
        assert_eq!(volumes.len() as u64, found.impacts.iter().sum::<u64>());
        assert!(volumes.len() > 300 && volumes.iter().all(|volume| volume.is_finite()));
        let wanted = volumes.iter().sum::<f64>() / found.time - damping.trace();
        let sum: f64 = found.exponents.iter().sum();
        assert!((sum - wanted).abs() < 1e-9 * wanted.abs(), "{count} {friction}: {sum} {wanted}");
    }
}

/// The sum of all exponents is that of volumes; a direction that contact takes away has -inf.
#[test]
fn exponents_add_up_to_the_loss_of_volume() {
    let structure = chain(0.8, 0.3, 0.8).unwrap();
    let found =
        structure_lyapunov(&structure, settled(&structure), 300, 4, None, &NEVER()).unwrap();
    let damping: f64 = (0..2).map(|i| structure.damping()[i][i]).sum();
    let lost = 2.0 * found.impacts[0] as f64 * 0.8f64.ln() / found.time - damping;
    let sum: f64 = found.exponents.iter().sum();
    assert!((sum - lost).abs() < 1e-12, "{sum} {lost}");
    assert!(found.exponents.is_sorted_by(|a, b| a >= b));
    // One period of the motion after it has closed and opened again takes two directions away.
    let plastic = chain(0.8, 0.1, 0.0).unwrap();
    let found = structure_lyapunov(&plastic, settled(&plastic), 100, 4, None, &NEVER()).unwrap();
    assert!(found.error.is_none(), "{:?}", found.error);
    let lost = found.exponents.iter().filter(|e| **e == f64::NEG_INFINITY).count();
    assert_eq!(lost, 2, "{:?}", found.exponents);
    assert_eq!(found.errors[3], 0.0);
}

/// Modes that decay by e^-60 and e^-6 in a period, and a free one on a damper, without a drive.
#[test]
fn fast_decay_hides_no_exponent() {
    let diagonal = |a: f64, b: f64| vec![vec![a, 0.0], vec![0.0, b]];
    let overdamped = Structure::builder(diagonal(1.0, 1.0), diagonal(9.0, 4.0))
        .damping(diagonal(10.0, 5.0))
        .drive([1.0.into(), 0.0.into()], 1.0, 0.0)
        .build()
        .unwrap();
    let rest = || StructureState::new(&[0.0; 2], &[0.0; 2]);
    let found = structure_lyapunov(&overdamped, rest(), 100, 4, None, &NEVER()).unwrap();
    for (found, wanted) in found.exponents.iter().zip([-1.0, -1.0, -4.0, -9.0]) {
        assert!((found - wanted).abs() < 1e-9, "{found} {wanted}");
    }
    let on_damper = Structure::builder(diagonal(1.0, 1.0), diagonal(0.0, 4.0))
        .damping(diagonal(3.0, 5.0))
        .build()
        .unwrap();
    let found = structure_lyapunov(&on_damper, rest(), 100, 4, Some(2.0), &NEVER()).unwrap();
    for (found, wanted) in found.exponents.iter().zip([0.0, -1.0, -3.0, -4.0]) {
        assert!((found - wanted).abs() < 1e-9, "{found} {wanted}");
    }
    let refused = structure_lyapunov(&on_damper, rest(), 100, 4, None, &NEVER());
    assert!(refused.unwrap_err().to_string().contains("step"));
    let refused = structure_lyapunov(&on_damper, rest(), 100, 5, Some(2.0), &NEVER());
    assert!(refused.unwrap_err().to_string().contains("count"));
}

#[test]
fn what_is_no_periodic_motion_says_why() {
    let structure = chain(0.8, 0.3, 0.8).unwrap();
    let state = settled(&structure);
    let refused = structure_orbit(&structure, state.clone(), 0, &NEVER());
    assert!(matches!(refused, Err(StructureOrbitError::Parameter(_))), "{refused:?}");
    // A free body drifts.
    let free = Structure::builder(vec![vec![1.0]], vec![vec![0.0]])
        .drive([1.0.into()], 1.0, 0.0)
        .build()
        .unwrap();
    let start = StructureState::new(&[0.0], &[0.1]);
    assert_eq!(structure_orbit(&free, start, 1, &NEVER()), Err(StructureOrbitError::Singular));
    // Far away from a motion Newton's steps lead to others, or nowhere.
    let mut said = [0; 2];
    for i in 0..20 {
        let far = StructureState::new(&[0.1 * f64::from(i), -3.0], &[1.0, -0.5 * f64::from(i)]);
        match structure_orbit(&structure, far, 1, &NEVER()) {
            Err(StructureOrbitError::EventsChanged) => said[0] += 1,
            Err(StructureOrbitError::NotConverged(_)) => said[1] += 1,
            other => println!("{i}: {other:?}"),
        }
    }
    assert!(said[0] > 0, "{said:?}");
}

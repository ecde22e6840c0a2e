//! Flights of linear structures, the contacts that end them, and their impacts, against 25-digit
//! reference data (tests/data/README.md): 60 random structures with moving stops, rigid-body modes,
//! loads, and friction in 20 of them.

use nalgebra::Complex;
use serde_json::Value;
use vibroimpact::{
    CancelToken, EventKind, Run, RunOptions, Simulation, Simultaneous, Stop, StopReason, Structure,
    StructureEvent, StructureState, run,
};

fn data(name: &str) -> Vec<Value> {
    let path = format!("{}/tests/data/{name}", env!("CARGO_MANIFEST_DIR"));
    serde_json::from_str(&std::fs::read_to_string(path).unwrap()).unwrap()
}

fn number(value: &Value) -> f64 {
    match value {
        Value::String(text) => text.parse().unwrap(),
        other => other.as_f64().unwrap(),
    }
}

fn vector(value: &Value) -> Vec<f64> {
    value.as_array().unwrap().iter().map(number).collect()
}

fn matrix(value: &Value) -> Vec<Vec<f64>> {
    value.as_array().unwrap().iter().map(vector).collect()
}

/// Real, or a pair of real and imaginary part.
fn complex(value: &Value) -> Complex<f64> {
    match value {
        Value::Array(parts) => Complex::new(number(&parts[0]), number(&parts[1])),
        other => Complex::new(number(other), 0.0),
    }
}

fn structure(scene: &Value) -> Structure {
    let drive: Vec<_> = scene["drive_amplitude"].as_array().unwrap().iter().map(complex).collect();
    let builder = Structure::builder(matrix(&scene["mass"]), matrix(&scene["stiffness"]))
        .damping_ratios(vector(&scene["damping_ratios"]))
        .static_load(vector(&scene["load"]))
        .drive(drive, number(&scene["drive_frequency"]), number(&scene["phase"]));
    let stops = scene["stops"].as_array().unwrap().iter();
    stops
        .map(|stop| {
            let [gap, r, amplitude, phase] =
                ["gap", "restitution", "amplitude", "phase"].map(|name| number(&stop[name]));
            let made = Stop::new(vector(&stop["normal"]), gap, r).moving(amplitude, phase);
            match &stop["tangent"] {
                Value::Array(_) => {
                    made.with_friction(number(&stop["friction"]), vector(&stop["tangent"]))
                }
                _ => made,
            }
        })
        .fold(builder, vibroimpact::StructureBuilder::stop)
        .build()
        .unwrap()
}

/// The run of a scene.
fn simulated(scene: &Value, structure: &Structure) -> Run<Structure> {
    let [q, v] = [0, 1].map(|i| vector(&scene["initial"][i]));
    let periods = scene["periods"].as_i64().unwrap();
    let (start, options) = (StructureState::new(&q, &v), RunOptions::periods(periods));
    run(structure, start, options, &CancelToken::never()).unwrap()
}

/// As tests/data/README.md says: 100 eps times the amplification and the size; times and velocities
/// over min(1, u) too.
fn compare(name: &str) -> (usize, Vec<String>) {
    let (mut worst, mut count): (f64, usize) = (0.0, 0);
    let mut regimes = Vec::new();
    for (number_of_scene, scene) in data(name).iter().enumerate() {
        let Run { impacts, stroboscopic: sections, .. } = simulated(scene, &structure(scene));
        let wanted = scene["impacts"].as_array().unwrap();
        assert_eq!(impacts.len(), wanted.len(), "scene {number_of_scene}");
        let period = std::f64::consts::TAU / number(&scene["drive_frequency"]);
        let mut most = 1.0f64;
        for (found, wanted) in impacts.iter().zip(wanted) {
            let place = format!("scene {number_of_scene}, t = {}", wanted["time"]);
            assert_eq!(found.stop, wanted["stop"].as_i64().unwrap(), "{place}");
            let amplification = number(&wanted["amplification"]).max(1.0);
            most = most.max(amplification);
            let mut check = |what: &str, found: f64, wanted: f64, over: f64| {
                let level = f64::EPSILON * amplification * wanted.abs().max(1.0) / over;
                let error = (found - wanted).abs() / level;
                worst = worst.max(error);
                assert!(error <= 100.0, "{place}: {what} {found} {wanted}: {error}");
            };
            let slow = found.approach_velocity.min(1.0);
            let regime = found.regime.name();
            assert_eq!(regime, wanted["regime"].as_str().unwrap(), "{place}");
            regimes.push(regime.to_owned());
            let time = found.period as f64 * period + found.time_in_period;
            check("time", time, number(&wanted["time"]), slow);
            for (what, found, name, over) in [
                ("q", &found.q, "q", 1.0),
                ("v before", &found.v_pre, "v_pre", slow),
                ("v after", &found.v_post, "v_post", slow),
            ] {
                for (&found, wanted) in found.iter().zip(vector(&wanted[name])) {
                    check(what, found, wanted, over);
                }
            }
            let impulses = [found.impulse_normal, found.impulse_tangential];
            for (found, name) in impulses.into_iter().zip(["impulse_normal", "impulse_tangential"])
            {
                check(name, found, number(&wanted[name]), slow);
            }
            assert!(found.energy_loss >= 0.0, "{place}");
            count += 1;
        }
        let wanted = scene["stroboscopic"].as_array().unwrap();
        assert_eq!(sections.len(), wanted.len());
        for (k, (found, wanted)) in sections.iter().zip(wanted).enumerate() {
            for (i, part) in [&found.q, &found.v].into_iter().enumerate() {
                for (&found, wanted) in part.iter().zip(vector(&wanted[i])) {
                    let level = 100.0 * f64::EPSILON * most * wanted.abs().max(1.0);
                    let error = (found - wanted).abs() / level;
                    assert!(error <= 1.0, "scene {number_of_scene}, section {k}: {error}");
                }
            }
        }
    }
    println!("{name}: {count} impacts, worst error {worst} eps");
    regimes.sort();
    regimes.dedup();
    (count, regimes)
}

#[test]
fn random_structures_meet_their_stops_as_the_reference_says() {
    let (count, regimes) = compare("structures.json");
    assert!(count > 400);
    assert_eq!(regimes, ["frictionless"]);
}

#[test]
fn friction_acts_in_the_stops_of_structures_as_the_reference_says() {
    let (count, regimes) = compare("structures_friction.json");
    assert!(count > 100);
    assert!(regimes.len() > 3, "{regimes:?}");
}

/// 12 structures whose stops stay closed, after plastic impacts or complete chatter.
#[test]
fn contact_lasts_as_the_reference_says() {
    let (mut closings, mut worst) = (0, 0.0f64);
    for (place, scene) in data("structures_contact.json").iter().enumerate() {
        let count = scene["mass"].as_array().unwrap().len();
        let drive = vector(&scene["drive_amplitude"]).into_iter().map(Complex::from);
        let builder = Structure::builder(matrix(&scene["mass"]), matrix(&scene["stiffness"]))
            .damping(matrix(&scene["damping"]))
            .static_load(vector(&scene["load"]))
            .drive(
                drive.collect::<Vec<_>>(),
                number(&scene["drive_frequency"]),
                number(&scene["phase"]),
            );
        let stops = scene["stops"].as_array().unwrap();
        let at: Vec<_> = stops.iter().map(|stop| stop["coordinate"].as_u64().unwrap()).collect();
        let structure = stops
            .iter()
            .map(|stop| {
                let mut normal = vec![0.0; count];
                normal[stop["coordinate"].as_u64().unwrap() as usize] =
                    number(&stop["normal_sign"]);
                Stop::new(normal, number(&stop["gap"]), number(&stop["restitution"]))
            })
            .fold(builder, vibroimpact::StructureBuilder::stop)
            .build()
            .unwrap();
        let made = simulated(scene, &structure);
        assert_eq!(made.stop_reason, StopReason::Completed, "scene {place}");
        let wanted = scene["stroboscopic"].as_array().unwrap();
        assert_eq!(made.stroboscopic.len(), wanted.len(), "scene {place}");
        for (k, (found, wanted)) in made.stroboscopic.iter().zip(wanted).enumerate() {
            let found = found.q.iter().chain(&found.v);
            for (found, wanted) in found.zip([0, 1].iter().flat_map(|&i| vector(&wanted[i]))) {
                let error = (found - wanted).abs() / wanted.abs().max(1.0);
                worst = worst.max(error);
                assert!(error <= 1e-9, "scene {place}, section {k}: {found} {wanted}");
            }
        }
        let changes = |kind: &str| -> Vec<(f64, u64)> {
            let events = scene["events"].as_array().unwrap().iter();
            let such = events.filter(|event| event["kind"] == kind);
            such.map(|event| (number(&event["time"]), event["stop"].as_u64().unwrap())).collect()
        };
        for (kind, name) in [(EventKind::Closed, "closed"), (EventKind::Release, "release")] {
            let found: Vec<_> = made.contacts.iter().filter(|row| row.kind == kind).collect();
            let wanted = changes(name);
            assert_eq!(found.len(), wanted.len(), "scene {place}, {name}");
            for (found, (time, coordinate)) in found.iter().zip(wanted) {
                assert_eq!(at[found.stop as usize], coordinate, "scene {place}, {name}");
                let error = (found.time - time).abs() / time.max(1.0);
                // The end of a chatter is told by the reference when its bounces are low, at some
                // 1e-6, and not where they accumulate.
                let chatters = structure.stops()[found.stop as usize].restitution() > 0.0;
                if chatters && kind == EventKind::Closed {
                    assert!(error <= 2e-7, "scene {place}, {name} at {time}: {}", found.time);
                } else {
                    worst = worst.max(error);
                    assert!(error <= 1e-9, "scene {place}, {name} at {time}: {}", found.time);
                }
                closings += 1;
            }
        }
    }
    println!("{closings} changes of contact, worst error {worst:e}");
    assert!(closings > 50);
}

/// Every bad input is named, with its value and what is allowed.
#[test]
fn what_is_no_structure_is_refused_by_name() {
    let unit = || vec![vec![1.0, 0.0], vec![0.0, 1.0]];
    let good = || Structure::builder(unit(), vec![vec![2.0, -1.0], vec![-1.0, 2.0]]);
    let stop = || Stop::new([1.0, 0.0], 0.5, 0.8);
    let free = || Structure::builder(unit(), vec![vec![1.0, -1.0], vec![-1.0, 1.0]]);
    let twice = || Structure::builder(unit(), unit());
    let cases = [
        (Structure::builder(vec![], vec![]), "mass"),
        (Structure::builder(vec![vec![1.0, 2.0], vec![2.0, 1.0]], unit()), "mass"),
        (Structure::builder(vec![vec![1.0, f64::NAN], vec![0.0, 1.0]], unit()), "mass[0, 1]"),
        (Structure::builder(vec![vec![1.0, 0.2], vec![0.1, 1.0]], unit()), "mass[1, 0]"),
        (Structure::builder(unit(), vec![vec![1.0, 2.0], vec![2.0, 1.0]]), "stiffness"),
        (Structure::builder(unit(), vec![vec![1.0]]), "stiffness"),
        (good().damping_ratios([0.1]), "damping_ratios"),
        (good().damping_ratios([0.1, -0.1]), "damping_ratios[1]"),
        (free().damping_ratios([0.1, 0.1]), "damping_ratios[0]"),
        (twice().damping_ratios([0.1, 0.2]), "damping_ratios[1]"),
        (good().damping(vec![vec![1.0, 0.0], vec![0.0, -1e-9]]), "damping"),
        (good().damping(vec![vec![-1.0, 0.0], vec![0.0, -1.0]]), "damping"),
        (good().damping(vec![vec![1.0, 0.5], vec![0.4, 1.0]]), "damping[1, 0]"),
        (good().static_load([0.0, f64::INFINITY]), "static_load[1]"),
        (
            good().drive([Complex::new(1.0, f64::NAN), Complex::default()], 1.0, 0.0),
            "drive_amplitude[0]",
        ),
        (good().drive([Complex::default(); 2], -1.0, 0.0), "drive_frequency"),
        (good().drive([Complex::default(); 2], 1.0, f64::NAN), "phase"),
        (good().law(vibroimpact::ImpactLaw::Paper), "law"),
        (good().stop(Stop::new([1.0], 0.5, 0.8)), "stops[0].normal"),
        (good().stop(stop()).stop(Stop::new([0.0, 0.0], 0.5, 0.8)), "stops[1].normal"),
        (good().stop(Stop::new([1.0, 0.0], f64::NAN, 0.8)), "stops[0].gap"),
        (good().stop(Stop::new([1.0, 0.0], 0.5, 1.1)), "stops[0].restitution"),
        (good().stop(stop().moving(0.1, 0.0)), "stops[0].amplitude"),
        (good().stop(stop().with_friction(-0.1, [0.0, 1.0])), "stops[0].friction"),
        (good().stop(stop().with_friction(0.1, [2.0, 0.0])), "stops[0].tangent"),
        (good().stop(stop().with_friction(0.1, [0.0, 0.0])), "stops[0].tangent"),
        (good().stop(stop().with_friction(0.1, [1.0])), "stops[0].tangent"),
        (good().stop(Stop::new([1e200, 0.0], 0.5, 0.8)), "stops[0].normal"),
        (good().stop(Stop::new([1e-200, 0.0], 0.5, 0.8)), "stops[0].normal"),
        (
            good().stop(stop().with_friction(0.1, [0.0, 1.0])).simultaneous(Simultaneous::Together),
            "simultaneous",
        ),
        (good().damping_ratios([0.0, f64::MAX]), "damping_ratios[1]"),
        (Structure::builder(vec![vec![1e-60]], vec![vec![1.0]]), "mass[0, 0]"),
        (Structure::builder(vec![vec![1.0]], vec![vec![1e60]]), "stiffness"),
        (Structure::builder(vec![vec![0.0; 257]; 257], vec![]), "mass"),
    ];
    for (builder, name) in cases {
        let error = builder.build().unwrap_err();
        assert_eq!(error.name, name, "{error}");
    }
    assert!(free().damping(unit()).stop(stop().with_friction(0.1, [0.0, 1.0])).build().is_ok());
}

/// The choices have the names that Python and files use.
#[test]
fn what_happens_at_one_instant_is_chosen_by_name() {
    for &choice in Simultaneous::ALL {
        assert_eq!(Simultaneous::from_name(choice.name()), Ok(choice));
        let built = Structure::builder(vec![vec![1.0]], vec![vec![1.0]])
            .stop(Stop::new([1.0], 0.5, 0.8))
            .simultaneous(choice)
            .build()
            .unwrap();
        assert_eq!(built.simultaneous(), choice);
    }
    let error = Simultaneous::from_name("at once").unwrap_err();
    assert_eq!(error.allowed, "one of stop, sequence, together");
}

#[test]
fn a_run_without_an_end_stops_where_nothing_will_move_any_more() {
    let falling = |load: f64, drive: f64| {
        Structure::builder(vec![vec![1.0]], vec![vec![0.0]])
            .static_load([load])
            .drive(vec![drive.into()], 1.0, 0.0)
            .stop(Stop::new([1.0], 0.0, 0.5))
            .build()
            .unwrap()
    };
    let start = || StructureState::new(&[-1.0], &[0.0]);
    let last = |structure: &Structure| {
        let mut simulation = Simulation::new(structure, start()).unwrap().max_events(100);
        simulation.find_map(|event| match event.unwrap() {
            StructureEvent::Stop(stop) => Some((stop.reason, stop.time)),
            _ => None,
        })
    };
    // The bounces of a ball under the load 1 end at 3 sqrt(2).
    let (reason, time) = last(&falling(1.0, 0.0)).unwrap();
    assert_eq!(reason, StopReason::Rest);
    assert!((3.0 * 2f64.sqrt()..100.0).contains(&time), "{time}");
    // A drive that lifts it again lets it bounce for ever.
    assert_eq!(last(&falling(1.0, 1.1)).unwrap().0, StopReason::EventCap);
}

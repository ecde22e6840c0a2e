//! Flights of linear structures, the contacts that end them, and their impacts, against 25-digit
//! reference data (tests/data/README.md): 60 random structures with moving stops, rigid-body modes,
//! loads, and friction in 20 of them.

use nalgebra::Complex;
use serde_json::Value;
use vibroimpact::impact::{StopImpact, strike};
use vibroimpact::{Clock, Simultaneous, Start, Stop, StopContact, Structure, StructureMotion};

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

/// An impact: clock, stop, q, velocities before and after.
struct Impact {
    clock: Clock,
    stop: usize,
    q: Vec<f64>,
    pre: Vec<f64>,
    post: Vec<f64>,
    of: StopImpact,
}

/// Impacts, and the states after each period.
type Motion = (Vec<Impact>, Vec<[Vec<f64>; 2]>);

fn simulated(scene: &Value) -> Motion {
    let initial = [0, 1].map(|i| vector(&scene["initial"][i]));
    motion_of(&structure(scene), scene, initial)
}

/// The same in modal coordinates p, q = Phi p: M is 1 there, and rows and loads are those on Phi.
fn simulated_in_modes(scene: &Value) -> Motion {
    let physical = structure(scene);
    let (frequencies, shapes) = (physical.frequencies(), physical.shapes());
    let on = |row: &[f64]| -> Vec<f64> {
        shapes.iter().map(|shape| shape.iter().zip(row).map(|(a, b)| a * b).sum()).collect()
    };
    let diagonal = |entries: Vec<f64>| -> Vec<Vec<f64>> {
        (0..entries.len())
            .map(|i| (0..entries.len()).map(|j| if i == j { entries[i] } else { 0.0 }).collect())
            .collect()
    };
    let ones = diagonal(vec![1.0; shapes.len()]);
    let squares = diagonal(frequencies.iter().map(|w| w * w).collect());
    let drive: Vec<_> = scene["drive_amplitude"].as_array().unwrap().iter().map(complex).collect();
    let re = on(&drive.iter().map(|f| f.re).collect::<Vec<_>>());
    let im = on(&drive.iter().map(|f| f.im).collect::<Vec<_>>());
    let drive: Vec<_> = re.iter().zip(&im).map(|(&re, &im)| Complex::new(re, im)).collect();
    let builder = Structure::builder(ones, squares)
        .damping_ratios(vector(&scene["damping_ratios"]))
        .static_load(on(&vector(&scene["load"])))
        .drive(drive, physical.drive_frequency(), physical.phase());
    let modal = physical
        .stops()
        .iter()
        .map(|stop| {
            let made = Stop::new(on(stop.normal()), stop.gap(), stop.restitution())
                .moving(stop.amplitude(), stop.phase());
            match stop.tangent() {
                Some(tangent) => made.with_friction(stop.friction(), on(tangent)),
                None => made,
            }
        })
        .fold(builder, vibroimpact::StructureBuilder::stop)
        .build()
        .unwrap();
    let mass = matrix(&scene["mass"]);
    let initial = [0, 1].map(|i| {
        let x = vector(&scene["initial"][i]);
        let momenta = mass.iter().map(|row| row.iter().zip(&x).map(|(a, b)| a * b).sum());
        on(&momenta.collect::<Vec<f64>>())
    });
    let back = |p: &[f64]| -> Vec<f64> {
        let parts = |k: usize| shapes.iter().zip(p).map(move |(shape, p)| shape[k] * p);
        (0..p.len()).map(|k| parts(k).sum()).collect()
    };
    let (impacts, sections) = motion_of(&modal, scene, initial);
    let impacts = impacts.into_iter().map(|impact| Impact {
        q: back(&impact.q),
        pre: back(&impact.pre),
        post: back(&impact.post),
        ..impact
    });
    let sections = sections.into_iter().map(|section| section.map(|part| back(&part)));
    (impacts.collect(), sections.collect())
}

fn motion_of(structure: &Structure, scene: &Value, initial: [Vec<f64>; 2]) -> Motion {
    let motion = StructureMotion::new(structure);
    let [mut q, mut v] = initial;
    let periods = scene["periods"].as_i64().unwrap();
    let period = std::f64::consts::TAU / structure.drive_frequency();
    let (mut clock, mut starts) = (Clock::START, Vec::new());
    let (mut impacts, mut sections): (Vec<Impact>, Vec<[Vec<f64>; 2]>) = Default::default();
    loop {
        let flight = motion.flight(clock, &q, &v);
        let found = motion.next_contact(&flight, &starts);
        let (time, offset, met) = match found {
            StopContact::Met { stop, time, offset } => (time, offset, Some(stop)),
            StopContact::Clear(_) => (motion.span(), 0.0, None),
            other => panic!("{other:?}"),
        };
        let next = motion.clock_after(&flight, time, offset);
        // Sections on the way.
        for k in clock.period + 1..=next.period.min(periods) {
            let until = (k - clock.period) as f64 * period - clock.time_in_period;
            let (q, v) = motion.state_after(&flight, until, 0.0);
            sections.push([q, v]);
        }
        if next.period >= periods {
            return (impacts, sections);
        }
        (q, v) = motion.state_after(&flight, time, offset);
        clock = next;
        starts.clear();
        if let Some(stop) = met {
            let (gap, u) = motion.gap(stop, clock, &q, &v);
            q = motion.on_stop(stop, gap, &q);
            let pre = v.clone();
            let of = strike(structure, stop, u, &mut v).unwrap();
            impacts.push(Impact { clock, stop, q: q.clone(), pre, post: v.clone(), of });
            starts.push((stop, Start::Touching));
        }
    }
}

/// As tests/data/README.md says: 100 eps times the amplification and the size; times and velocities
/// over min(1, u) too.
fn compare(name: &str, simulated: fn(&Value) -> Motion) -> (usize, Vec<String>) {
    let (mut worst, mut count): (f64, usize) = (0.0, 0);
    let mut regimes = Vec::new();
    for (number_of_scene, scene) in data(name).iter().enumerate() {
        let (impacts, sections) = simulated(scene);
        let wanted = scene["impacts"].as_array().unwrap();
        assert_eq!(impacts.len(), wanted.len(), "scene {number_of_scene}");
        let period = std::f64::consts::TAU / number(&scene["drive_frequency"]);
        let mut most = 1.0f64;
        for (found, wanted) in impacts.iter().zip(wanted) {
            let place = format!("scene {number_of_scene}, t = {}", wanted["time"]);
            assert_eq!(found.stop as u64, wanted["stop"].as_u64().unwrap(), "{place}");
            let amplification = number(&wanted["amplification"]).max(1.0);
            most = most.max(amplification);
            let mut check = |what: &str, found: f64, wanted: f64, over: f64| {
                let level = f64::EPSILON * amplification * wanted.abs().max(1.0) / over;
                let error = (found - wanted).abs() / level;
                worst = worst.max(error);
                assert!(error <= 100.0, "{place}: {what} {found} {wanted}: {error}");
            };
            let slow = found.of.approach_velocity.min(1.0);
            let regime = found.of.regime.kind().name();
            assert_eq!(regime, wanted["regime"].as_str().unwrap(), "{place}");
            regimes.push(regime.to_owned());
            let time = found.clock.period as f64 * period + found.clock.time_in_period;
            check("time", time, number(&wanted["time"]), slow);
            for (what, found, name, over) in [
                ("q", &found.q, "q", 1.0),
                ("v before", &found.pre, "v_pre", slow),
                ("v after", &found.post, "v_post", slow),
            ] {
                for (&found, wanted) in found.iter().zip(vector(&wanted[name])) {
                    check(what, found, wanted, over);
                }
            }
            let impulses = [found.of.impulse_normal, found.of.impulse_tangential];
            for (found, name) in impulses.into_iter().zip(["impulse_normal", "impulse_tangential"])
            {
                check(name, found, number(&wanted[name]), slow);
            }
            assert!(found.of.separation_velocity <= 0.0 && found.of.energy_loss >= 0.0, "{place}");
            count += 1;
        }
        let wanted = scene["stroboscopic"].as_array().unwrap();
        assert_eq!(sections.len(), wanted.len());
        for (k, (found, wanted)) in sections.iter().zip(wanted).enumerate() {
            for (i, part) in found.iter().enumerate() {
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
    let (count, regimes) = compare("structures.json", simulated);
    assert!(count > 400);
    assert_eq!(regimes, ["frictionless"]);
}

#[test]
fn friction_acts_in_the_stops_of_structures_as_the_reference_says() {
    let (count, regimes) = compare("structures_friction.json", simulated);
    assert!(count > 100);
    assert!(regimes.len() > 3, "{regimes:?}");
}

/// So do structures whose coordinates are their modes, as `Structure.from_modes` in Python has them.
#[test]
fn structures_in_modal_coordinates_move_alike() {
    for name in ["structures.json", "structures_friction.json"] {
        let (count, regimes) = compare(name, simulated_in_modes);
        assert_eq!((count, regimes), compare(name, simulated));
    }
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
        (good().damping(vec![vec![1.0, 0.0], vec![0.0, 0.0]]), "damping"),
        (good().damping(vec![vec![-1.0, 0.0], vec![0.0, -1.0]]), "damping"),
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

//! Chatter, sustained contact and release against the high-precision reference
//! (tests/data/contact_reference.json; 43 scenes, values good to 1e-43), and against the supplied
//! contact.json (4 scenes, good to about 1e-10).

use serde_json::Value;
use vibroimpact::{
    CancelToken, Contact, EventKind, Horizon, Run, RunOptions, State, StopReason, System, run,
};

/// Allowed error of a state, relative to max(1, |value|): a few hundred roundings, as many as the
/// impacts of a chatter sequence. The stated amplifications of the scenes are below 8.
const STATES: f64 = 1e-13;
/// Allowed error of a time, where x1' or p passes through zero slowly less certain than the state.
const TIMES: f64 = 1e-13;

fn scenes() -> serde_json::Map<String, Value> {
    serde_json::from_str(include_str!("data/contact_reference.json")).unwrap()
}

/// The supplied scenes: oblique, phase 0.
fn supplied() -> serde_json::Map<String, Value> {
    serde_json::from_str(include_str!("data/contact.json")).unwrap()
}

fn number(value: &Value) -> f64 {
    value.as_str().map_or_else(|| value.as_f64().unwrap(), |text| text.parse().unwrap())
}

fn numbers(value: &Value) -> Vec<f64> {
    value.as_array().unwrap().iter().map(number).collect()
}

fn system(scene: &Value) -> System {
    let get = |name: &str| number(&scene["params"][name]);
    System::builder()
        .mass_ratio(get("mbar"))
        .frequency_ratio(get("omega0"))
        .restitution(get("r"))
        .gap(get("delta"))
        .drive_frequency(get("omega"))
        .pendulum_damping(get("zeta1"))
        .oscillator_damping(get("zeta2"))
        .moment_amplitude(get("f1"))
        .force_amplitude(get("f2"))
        .friction(get("mu"))
        .phase(scene.get("phase").map_or(0.0, number))
        .contact(Contact::from_name(scene["contact"].as_str().unwrap_or("oblique")).unwrap())
        .build()
        .unwrap()
}

fn go(scene: &Value, system: &System) -> Run {
    let x = numbers(&scene["initial"]);
    let start = State::new(x[0], x[1], x[2], x[3]).unwrap();
    let horizon = match scene["periods"].as_i64() {
        Some(periods) => Horizon::Periods(periods),
        None => Horizon::Time(*numbers(&scene["times"]).last().unwrap()),
    };
    run(system, start, RunOptions::until(horizon), &CancelToken::never()).unwrap()
}

/// What happens at a contact row, in the reference's words.
fn word(kind: i64) -> &'static str {
    [
        (EventKind::Chatter, "chatter"),
        (EventKind::SlidePositive, "slide_positive"),
        (EventKind::SlideNegative, "slide_negative"),
        (EventKind::Stick, "stick"),
        (EventKind::Release, "release"),
    ]
    .iter()
    .find_map(|&(k, word)| (k as i64 == kind).then_some(word))
    .unwrap()
}

#[derive(Default)]
struct Worst {
    state: f64,
    time: f64,
    force: f64,
}

fn compare(name: &str, scene: &Value) -> Worst {
    let system = system(scene);
    let run = go(scene, &system);
    let mut worst = Worst::default();
    let ending = scene["ending"].as_str().unwrap();
    if run.stop_reason.name() != ending {
        println!("{:#?} {:?}", run.contacts, run.final_state);
    }
    assert_eq!(run.stop_reason.name(), ending, "{name}");
    // Impacts are in another table.
    let phases: Vec<&Value> = scene["phases"]
        .as_array()
        .unwrap()
        .iter()
        .filter(|phase| !phase["event"].as_str().unwrap().starts_with("impact"))
        .collect();
    let found: Vec<&str> = run.contacts.iter().map(|c| word(c.kind)).collect();
    let expected: Vec<&str> = phases.iter().map(|p| p["event"].as_str().unwrap()).collect();
    assert_eq!(found, expected, "{name}");
    let error = |value: f64, reference: &Value| {
        let reference = number(reference);
        (value - reference).abs() / reference.abs().max(1.0)
    };
    for (c, phase) in run.contacts.iter().zip(&phases) {
        worst.time = worst.time.max(error(c.time, &phase["t"]));
        for (value, key) in [(c.x1, "x1"), (c.v1, "v1"), (c.x2, "x2"), (c.v2, "v2")] {
            worst.state = worst.state.max(error(value, &phase[key]));
        }
        for (value, key) in
            [(c.normal_force, "normal_force"), (c.tangential_force, "friction_force")]
        {
            if !phase[key].is_null() {
                worst.force = worst.force.max(error(value, &phase[key]));
            }
        }
    }
    let rows: Vec<[f64; 4]> = match scene["periods"].as_i64() {
        Some(_) => run.stroboscopic.clone(),
        None => run.trajectory(&numbers(&scene["times"])).unwrap(),
    };
    let sections = scene["stroboscopic"].as_array().unwrap();
    assert_eq!(rows.len(), sections.len(), "{name}");
    for (row, section) in rows.iter().zip(sections) {
        for (&value, reference) in row.iter().zip(section.as_array().unwrap()) {
            worst.state = worst.state.max(error(value, reference));
        }
    }
    worst
}

#[test]
fn contact_phases_are_those_of_the_high_precision_reference() {
    let mut bad = Vec::new();
    for (name, scene) in scenes() {
        let Worst { state, time, force } = compare(&name, &scene);
        println!("{name}: state {state:.1e}, time {time:.1e}, force {force:.1e}");
        if state > STATES || force > STATES || time > TIMES {
            bad.push(name);
        }
    }
    assert!(bad.is_empty(), "{bad:?}");
}

#[test]
fn the_scenes_reach_every_kind_of_event_and_ending() {
    let scenes = scenes();
    let count = |event: &str| {
        let of = |scene: &Value| {
            let phases = scene["phases"].as_array().unwrap();
            phases.iter().filter(|p| p["event"] == event).count()
        };
        scenes.values().map(of).sum::<usize>()
    };
    for event in ["chatter", "slide_positive", "slide_negative", "stick", "release"] {
        assert!(count(event) > 40, "{event}");
    }
    for reason in [StopReason::Completed, StopReason::Rest, StopReason::Painleve] {
        assert!(scenes.values().any(|scene| scene["ending"] == reason.name()));
    }
}

#[test]
fn the_supplied_phases_come_out() {
    let mut worst: f64 = 0.0;
    for (name, scene) in supplied() {
        let run = go(&scene, &system(&scene));
        let phases = scene["phases"].as_array().unwrap();
        // There the end of chatter is a contact, and slides have no direction.
        let found = run.contacts.iter().map(|c| match word(c.kind) {
            "chatter" => "contact",
            word if word.starts_with("slide") => "slide",
            word => word,
        });
        let expected = phases.iter().map(|phase| phase["event"].as_str().unwrap());
        assert!(found.eq(expected), "{name}");
        for (c, phase) in run.contacts.iter().zip(phases) {
            for (value, key) in [(c.time, "t"), (c.x1, "x1"), (c.v1, "v1")] {
                worst = worst.max((value - number(&phase[key])).abs());
            }
        }
        let sections = scene["stroboscopic"].as_array().unwrap();
        assert_eq!(run.stroboscopic.len(), sections.len(), "{name}");
        for (row, section) in run.stroboscopic.iter().zip(sections) {
            for (value, reference) in row.iter().zip(numbers(section)) {
                worst = worst.max((value - reference).abs());
            }
        }
    }
    println!("worst difference {worst:e}");
    assert!(worst < 1e-9, "{worst:e}");
}

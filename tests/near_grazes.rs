//! The ladder of near-grazes (tests/data/README.md): flights whose gap has a hump of height d =
//! +-1e-2 ... +-1e-14. Above the stated threshold every contact is found, below minus the threshold
//! none, and in between the outcome is a graze or either side (docs/contact-detection.md).

use std::path::Path;

use crate::support::audit::rounding;
use serde_json::Value;
use vibroimpact::{
    Clock, Contact, Event, Found, FreeMotion, Horizon, Simulation, Start, State, System,
    next_contact,
};

const EPS: f64 = f64::EPSILON;

/// Allowed error of a contact's time, in units of eps max(1, t)/min(1, u).
const ALLOWED: f64 = 100.0;

/// Higher humps of the ladder are decided: 1e-13 and all above.
const LARGEST_THRESHOLD: f64 = 5e-14;

struct Case {
    name: String,
    system: System,
    state: State,
    touching: bool,
    end: f64,
    hump_time: f64,
    height: f64,
    roots: Option<[f64; 2]>,
    /// Time and approach velocity.
    contact: Option<(f64, f64)>,
}

fn number(value: &Value) -> f64 {
    value.as_str().unwrap().parse().unwrap()
}

fn cases() -> Vec<Case> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/near_grazes.json");
    let rows: Value = serde_json::from_str(&std::fs::read_to_string(path).unwrap()).unwrap();
    rows.as_array().unwrap().iter().map(Case::read).collect()
}

impl Case {
    fn read(row: &Value) -> Self {
        let of = |name: &str| number(&row["parameters"][name]);
        let contact = Contact::from_name(row["contact"].as_str().unwrap()).unwrap();
        let system = System::builder()
            .mass_ratio(of("mbar"))
            .frequency_ratio(of("omega0"))
            .restitution(of("r"))
            .gap(of("delta"))
            .pendulum_damping(of("zeta1"))
            .oscillator_damping(of("zeta2"))
            .moment_amplitude(of("f1"))
            .force_amplitude(of("f2"))
            .drive_frequency(of("omega"))
            .phase(number(&row["phase"]))
            .contact(contact)
            .build()
            .unwrap();
        let [x1, v1, x2, v2] = ["x1", "v1", "x2", "v2"].map(|name| number(&row[name]));
        let touching = row["touching"].as_bool().unwrap();
        let tip = if contact == Contact::Direct { x1 } else { x1.sin() };
        let x2 = if touching { tip - of("delta") } else { x2 };
        let roots = row["roots"].as_array().unwrap();
        Self {
            name: format!("{} {}", row["ladder"], row["rung"]),
            system,
            state: State::new(x1, v1, x2, v2).unwrap(),
            touching,
            end: number(&row["t_end"]),
            hump_time: number(&row["hump_time"]),
            height: number(&row["hump_height"]),
            roots: (roots.len() == 2).then(|| [number(&roots[0]), number(&roots[1])]),
            contact: row["contact_time"]
                .as_str()
                .map(|t| (t.parse().unwrap(), number(&row["approach_velocity"]))),
        }
    }

    /// Grazes, then the contact if there is one until the end.
    fn search(&self) -> (Vec<f64>, Option<f64>) {
        let motion = FreeMotion::new(&self.system);
        let whole = motion.flight(Clock::START, self.state);
        let (mut flight, mut begin) = (whole, 0.0);
        let mut start = if self.touching { Start::Touching } else { Start::Apart };
        let mut grazes = Vec::new();
        while begin < self.end {
            let span = motion.span().min(self.end - begin);
            match next_contact(&motion, &flight, start, span).found {
                Found::Contact(touch) => return (grazes, Some(begin + touch.local_time())),
                Found::Graze(touch) => {
                    grazes.push(begin + touch.local_time());
                    start = Start::Grazed(touch.local_time());
                }
                Found::Clear(time) => {
                    begin += time;
                    let state = motion.state_after_periods(&whole, 0, begin);
                    flight = motion.flight(Clock::new(0, begin), state);
                    start = Start::Apart;
                }
                other => panic!("{}: {other:?}", self.name),
            }
        }
        (grazes, None)
    }

    /// Error of a contact found at `time`, in units of eps max(1, t)/min(1, u).
    fn units(&self, time: f64) -> f64 {
        let (exact, u) = self.contact.unwrap();
        (time - exact).abs() * u.min(1.0) / (EPS * exact.max(1.0))
    }

    /// Height within which nothing in double precision decides; the rounding level counts from the
    /// start of the local flight in which the hump lies.
    fn threshold(&self) -> f64 {
        let motion = FreeMotion::new(&self.system);
        let span = motion.span();
        let chunk = (self.hump_time / span).floor();
        let (state, system) = if chunk == 0.0 {
            (self.state, self.system.clone())
        } else {
            let flight = motion.flight(Clock::START, self.state);
            let phase = self.system.phase() + self.system.drive_frequency() * chunk * span;
            let state = motion.state_after_periods(&flight, 0, chunk * span);
            (state, self.system.with("phase", phase).unwrap())
        };
        let touching = self.touching && chunk == 0.0;
        let level = rounding::level(&system, &state, touching, span);
        level.undecided(self.hump_time - chunk * span)
    }
}

#[test]
fn every_hump_above_the_threshold_is_a_contact_and_none_below() {
    let (mut worst, mut threshold) = ((0.0, String::new()), 0f64);
    let (mut grazes_in_between, mut decided) = (0, [0; 2]);
    for case in cases() {
        let (grazes, contact) = case.search();
        let name = &case.name;
        if case.height.abs() <= case.threshold() {
            assert!(case.height.abs() < LARGEST_THRESHOLD, "{name}: {:e}", case.threshold());
            let size = rounding::size(&case.system, &case.state);
            threshold = threshold.max(case.threshold() / (EPS * size));
            grazes_in_between += grazes.len();
            let at_hump = |time: f64| (time - case.hump_time).abs() < 1e-5;
            assert!(grazes.iter().all(|&time| at_hump(time)), "{name}: {grazes:?}");
            if let (true, Some(time)) = (grazes.is_empty(), contact) {
                assert!(at_hump(time) || time > case.hump_time, "{name}: {time}");
            }
            continue;
        }
        assert!(grazes.is_empty(), "{name}: {grazes:?}");
        assert_eq!(contact.is_some(), case.contact.is_some(), "{name}: {contact:?}");
        decided[usize::from(case.height > 0.0)] += 1;
        if let Some(time) = contact {
            if let Some([rising, _]) = case.roots {
                assert!((time - rising).abs() < (case.hump_time - rising), "{name}: {time}");
            }
            let units = case.units(time);
            assert!(units <= ALLOWED, "{name}: {time} is off by {units} units");
            if units > worst.0 {
                worst = (units, name.clone());
            }
        }
    }
    println!("decided below and above {decided:?}, grazes in between {grazes_in_between}");
    println!("largest threshold {threshold:.0} eps (|tip| + |x2| + |delta|) at the start");
    println!("worst error {worst:?} eps max(1, t)/min(1, u)");
    assert!(decided[0] > 100 && decided[1] > 100);
}

#[test]
fn a_simulation_sees_the_same_contacts() {
    for case in cases().iter().filter(|case| !case.touching) {
        let horizon = Horizon::Impacts { count: 1, max_time: case.end };
        let simulation = Simulation::new(&case.system, case.state).unwrap().until(horizon);
        let (mut grazes, mut contact) = (0, None);
        for event in simulation {
            match event.unwrap() {
                Event::Impact(impact) => contact = Some(impact.time),
                Event::Graze(_) => grazes += 1,
                _ => {}
            }
        }
        let (expected_grazes, expected) = case.search();
        assert_eq!((grazes, contact.is_some()), (expected_grazes.len(), expected.is_some()));
        if case.height.abs() > case.threshold() {
            assert!(contact.is_none_or(|time| case.units(time) <= ALLOWED), "{}", case.name);
        }
    }
}

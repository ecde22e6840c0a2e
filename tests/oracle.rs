//! The simulator against 25-digit reference data (tests/data/README.md): single impacts, the
//! paper's eleven motions and sixty random systems, to the tolerances of docs/accuracy.md.

use std::path::Path;

use serde_json::Value;
use vibroimpact::impact::{PreImpact, resolve};
use vibroimpact::{Event, Horizon, ImpactEvent, Observer, Simulation, State, System};

fn data(name: &str) -> Value {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data").join(name);
    serde_json::from_str(&std::fs::read_to_string(path).unwrap()).unwrap()
}

fn number(value: &Value) -> f64 {
    match value {
        Value::String(text) => text.parse().unwrap(),
        other => other.as_f64().unwrap(),
    }
}

fn system(scene: &Value) -> System {
    let p = &scene["params"];
    System::builder()
        .mass_ratio(number(&p["mbar"]))
        .frequency_ratio(number(&p["omega0"]))
        .restitution(number(&p["r"]))
        .gap(number(&p["delta"]))
        .pendulum_damping(number(&p["zeta1"]))
        .oscillator_damping(number(&p["zeta2"]))
        .moment_amplitude(number(&p["f1"]))
        .force_amplitude(number(&p["f2"]))
        .drive_frequency(number(&p["omega"]))
        .friction(number(&p["mu"]))
        .phase(number(&scene["phase"]))
        .build()
        .unwrap()
}

fn state(values: &Value) -> State {
    let [x1, v1, x2, v2] = [0, 1, 2, 3].map(|i| number(&values[i]));
    State::new(x1, v1, x2, v2).unwrap()
}

#[derive(Default)]
struct Sections(Vec<State>);

impl Observer for Sections {
    const SECTIONS: bool = true;
    fn section(&mut self, k: i64, state: &State) {
        assert_eq!(k as usize, self.0.len() + 1);
        self.0.push(*state);
    }
}

fn run(system: &System, initial: State, periods: i64) -> (Vec<ImpactEvent>, Vec<State>) {
    let mut simulation =
        Simulation::new(system, initial).unwrap().until(Horizon::Periods(periods));
    let mut sections = Sections::default();
    let mut impacts = Vec::new();
    while let Some(event) = simulation.advance(&mut sections) {
        if let Event::Impact(impact) = event.unwrap() {
            impacts.push(impact);
        }
    }
    (impacts, sections.0)
}

/// Error in units of the tolerance without its factor 100: eps max(1, A_k, A_k/A_j) max(1, |x|).
struct Tolerance(Vec<f64>);

impl Tolerance {
    fn new(scene: &Value) -> Self {
        let a: Vec<f64> =
            scene["amplification"].as_array().unwrap().iter().map(number).collect();
        let growth = |k: usize| {
            a[..k].iter().map(|aj| a[k] / aj).fold(1f64.max(a[k]), f64::max)
        };
        Self((0..a.len()).map(growth).collect())
    }

    /// `k` counts periods from 0.
    fn units(&self, k: usize, found: f64, exact: f64) -> f64 {
        (found - exact).abs() / (f64::EPSILON * self.0[k] * exact.abs().max(1.0))
    }
}

#[test]
fn single_impacts_to_1e_14() {
    for case in data("impacts.json").as_array().unwrap() {
        let system = System::builder()
            .mass_ratio(number(&case["mbar"]))
            .frequency_ratio(1.0)
            .restitution(number(&case["r"]))
            .gap(0.0)
            .drive_frequency(1.0)
            .friction(number(&case["mu"]))
            .build()
            .unwrap();
        let (sin, cos) = number(&case["x1"]).sin_cos();
        let pre = PreImpact { cos, sin, v1: number(&case["v1_pre"]), v2: number(&case["v2_pre"]) };
        let impact = resolve(&system, &pre).unwrap();
        assert_eq!(impact.regime.kind().name(), case["regime"], "{case}");
        for (found, name) in [(impact.v1_post, "v1_post"), (impact.v2_post, "v2_post")] {
            let exact = number(&case[name]);
            assert!((found - exact).abs() <= 1e-14 * exact.abs().max(1.0), "{name} {found} {case}");
        }
    }
}

fn compare(name: &str, scene: &Value) -> f64 {
    let periods = scene["periods"].as_u64().unwrap() as usize;
    let (impacts, sections) = run(&system(scene), state(&scene["initial"]), periods as i64);
    let tolerance = Tolerance::new(scene);
    let exact = scene["impacts"].as_array().unwrap();
    assert_eq!(impacts.len(), exact.len(), "{name}: number of impacts");
    let mut worst = 0f64;
    for (i, (found, exact)) in impacts.iter().zip(exact).enumerate() {
        let period = exact["period"].as_u64().unwrap();
        assert_eq!(found.clock.period as u64, period, "{name}: impact {i}");
        assert_eq!(found.impact.regime.kind().name(), exact["regime"], "{name}: impact {i}");
        let k = period as usize;
        let u = found.impact.approach_velocity.min(1.0);
        let mut check = |found: f64, key: &str, scale: f64| {
            let units = tolerance.units(k, found, number(&exact[key])) * scale;
            assert!(units <= 1000.0, "{name}: impact {i} {key}: {units} units, u = {u}");
            worst = worst.max(units);
        };
        check(found.time, "t", u);
        check(found.pre.x1, "x1", 1.0);
        check(found.pre.v1, "v1_pre", 1.0);
        check(found.post.v1, "v1_post", 1.0);
        check(found.pre.x2, "x2", 1.0);
        check(found.pre.v2, "v2_pre", 1.0);
        check(found.post.v2, "v2_post", 1.0);
    }
    for (k, exact) in scene["stroboscopic"].as_array().unwrap().iter().enumerate() {
        for (i, found) in sections[k].to_array().into_iter().enumerate() {
            let units = tolerance.units(k, found, number(&exact[i]));
            assert!(units <= 1000.0, "{name}: section {k} component {i}: {units} units");
            worst = worst.max(units);
        }
    }
    worst
}

#[test]
fn paper_scenes_impact_by_impact() {
    for (name, scene) in data("paper_scenes.json").as_object().unwrap() {
        println!("{name}: worst error {:.1} eps", compare(name, scene));
    }
}

#[test]
fn random_systems_impact_by_impact() {
    for (i, scene) in data("random.json").as_array().unwrap().iter().enumerate() {
        println!("random {i}: worst error {:.1} eps", compare(&format!("random {i}"), scene));
    }
}

#[test]
fn paper_scenes_after_600_periods() {
    for (name, scene) in data("paper_scenes.json").as_object().unwrap() {
        // Their transients are chaotic beyond double precision's horizon (docs/theory.md, section 10).
        if name == "fig6a" || name == "fig9_2" {
            continue;
        }
        let (impacts, sections) = run(&system(scene), state(&scene["initial"]), 600);
        let last = impacts.iter().filter(|e| e.clock.period >= 500).count();
        let worst = sections[599]
            .to_array()
            .into_iter()
            .enumerate()
            .map(|(i, x)| (x - number(&scene["state_after_600_periods"][i])).abs())
            .fold(0.0, f64::max);
        println!("{name}: {} {} {worst:e}", impacts.len(), last);
    }
}

#[test]
fn work_counts() {
    for (name, scene) in data("paper_scenes.json").as_object().unwrap() {
        let mut simulation = Simulation::new(&system(scene), state(&scene["initial"]))
            .unwrap()
            .until(Horizon::Periods(600));
        let _ = simulation.by_ref().count();
        println!(
            "{name}: {} impacts, {:.2} evaluations per period",
            simulation.impact_count(),
            simulation.evaluations() as f64 / 600.0
        );
    }
}

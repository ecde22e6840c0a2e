//! Parameters, states and options: what is accepted is in range and the same after a round trip,
//! what is refused is named.

#![no_main]

use libfuzzer_sys::fuzz_target;
use vibroimpact::{Contact, ImpactLaw, RunOptions, State, System, Workers};
use vibroimpact_fuzz::{Draw, assert_finite, execution};

fn numbers(system: &System) -> [f64; 13] {
    [
        system.mass_ratio(),
        system.frequency_ratio(),
        system.restitution(),
        system.gap(),
        system.drive_frequency(),
        system.pendulum_damping(),
        system.oscillator_damping(),
        system.moment_amplitude(),
        system.force_amplitude(),
        system.friction(),
        system.phase(),
        system.static_moment(),
        system.static_force(),
    ]
}

fn in_range(system: &System) {
    let values = numbers(system);
    assert_finite("parameters", &values);
    assert!(values.iter().all(|v| v.to_bits() != (-0f64).to_bits()), "{system:?}");
    for at_least_zero in [0, 1, 4, 5, 6, 9] {
        assert!(values[at_least_zero] >= 0.0, "{system:?}");
    }
    assert!((0.0..=1.0).contains(&system.restitution()));
    assert!(system.contact() == Contact::Oblique || system.friction() == 0.0);
    assert!(system.drive_period() > 0.0, "{system:?}");
}

fn round_trip(system: &System) {
    let text = serde_json::to_string(system).expect("finite numbers are JSON");
    let back: System = serde_json::from_str(&text).expect("a valid system is read back");
    assert_eq!(back, *system);
}

fn body(draw: &mut Draw) {
    let system = match draw.builder().build() {
        Ok(system) => system,
        Err(error) => {
            assert!(System::NUMERIC.contains(&&*error.name), "{error}");
            assert!(!error.to_string().is_empty());
            return;
        }
    };
    in_range(&system);
    round_trip(&system);
    match draw.below(8) {
        0 => {
            let name = System::NUMERIC[draw.below(System::NUMERIC.len())];
            let value = draw.any();
            match system.with(name, value) {
                Ok(other) => in_range(&other),
                Err(error) => assert!(error.name == name || error.name == "friction", "{error}"),
            }
        }
        1 => {
            let name = draw.text();
            let value = draw.any();
            if let Ok(other) = system.with(&name, value) {
                in_range(&other);
            }
            for found in [Contact::from_name(&name).is_ok(), ImpactLaw::from_name(&name).is_ok()] {
                assert!(!found || name.len() >= 5);
            }
        }
        2 | 3 => {
            let options = draw.options();
            let checked = options.check(&system);
            if let Err(error) = &checked {
                assert!(!error.to_string().is_empty());
            } else {
                assert!(options.chatter_tolerance > 0.0 && options.section_phase >= 0.0);
            }
            if let Ok(text) = serde_json::to_string(&options)
                && let Ok(back) = serde_json::from_str::<RunOptions>(&text)
                && checked.is_ok()
            {
                assert_eq!(back, options);
            }
        }
        4 => {
            // Numbers of a file, which the file may have anyhow.
            let mut value = serde_json::to_value(system).expect("a system is an object");
            let name = System::NUMERIC[draw.below(System::NUMERIC.len())];
            value[name] = serde_json::json!(draw.any());
            if let Ok(read) = serde_json::from_value::<System>(value) {
                in_range(&read);
            }
        }
        5 => {
            if let Ok(read) = serde_json::from_str::<System>(&draw.text()) {
                in_range(&read);
            }
        }
        6 => {
            // Threads are dear: only numbers that are refused.
            let count = draw.integer() as usize;
            if count == 0 || count > 1024 {
                assert!(Workers::new(Some(count)).is_err());
            }
        }
        _ => {
            let [x1, v1, x2, v2] = draw.state_numbers(&system);
            match State::new(x1, v1, x2, v2) {
                Ok(state) => {
                    let gap = system.gap_function(&state);
                    assert!(!gap.is_nan(), "g = {gap} of {state:?} in {system:?}");
                    let u = system.approach_velocity(&state);
                    assert!(!u.is_nan(), "u = {u} of {state:?} in {system:?}");
                }
                Err(error) => assert!(!error.to_string().is_empty()),
            }
        }
    }
}

fuzz_target!(|bytes: &[u8]| execution(|| body(&mut Draw::new(bytes))));

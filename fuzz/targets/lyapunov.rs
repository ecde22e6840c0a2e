//! Lyapunov exponents of what goes on from the end of a run.

#![no_main]

use libfuzzer_sys::fuzz_target;
use vibroimpact::LyapunovError;
use vibroimpact::{lyapunov_spectrum, run};
use vibroimpact_fuzz::{Draw, check_error, enough, execution, is_hectic, made};

fn body(draw: &mut Draw) {
    let Some(system) = draw.system() else { return };
    let start = draw.state(&system);
    if is_hectic(&system, &start) {
        return;
    }
    let options = if draw.below(4) == 3 { draw.options() } else { draw.few_periods(6) };
    let Some(run) = made(run(&system, start, options, &enough())) else { return };
    if run.evaluations > 400 {
        return;
    }
    let steps = if draw.below(16) == 15 { 0 } else { 1 + draw.below(24) as u32 };
    let step = match draw.below(4) {
        0 => None,
        1 => Some(draw.any()),
        _ => Some(draw.within(0.1, 2.0)),
    };
    match lyapunov_spectrum(&run, steps, step, &enough()) {
        Err(error) => assert!(!error.to_string().is_empty()),
        Ok(spectrum) => {
            if let Some(LyapunovError::Simulation(error)) = &spectrum.error {
                check_error(error);
            }
            // Descending, those that could not be measured last.
            let known = spectrum.exponents.iter().take_while(|e| !e.is_nan()).count();
            assert!(spectrum.exponents[known..].iter().all(|e| e.is_nan()), "{spectrum:?}");
            assert!(spectrum.exponents[..known].windows(2).all(|e| e[0] >= e[1]), "{spectrum:?}");
            assert!(spectrum.exponents[..known].iter().all(|&e| e < f64::INFINITY), "{spectrum:?}");
            assert!(spectrum.history.len() == spectrum.history_time.len());
            assert!(spectrum.time >= 0.0, "{spectrum:?}");
            if spectrum.error.is_none() {
                let wall = system.mass_ratio() == 0.0;
                assert!(known >= if wall { 2 } else { 4 }, "{spectrum:?} in {system:?}");
            }
        }
    }
}

fuzz_target!(|bytes: &[u8]| execution(|| body(&mut Draw::new(bytes))));

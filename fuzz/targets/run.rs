//! Whole runs with any options: their tables, trajectories, forces, audits, going on, files.

#![no_main]

use libfuzzer_sys::fuzz_target;
use vibroimpact::{CancelToken, Run, RunError, State, System, run};
use vibroimpact_fuzz::{
    Draw, assert_finite, check_run, enough, execution, is_hectic, made, numbers,
};

fn moderate(system: &System, state: &State) -> bool {
    numbers(system, state).iter().all(|v| *v == 0.0 || (1e-20..1e20).contains(&v.abs()))
}

fn look(draw: &mut Draw, run: &Run) {
    check_run(run);
    let (from, to) = (run.kept_from(), run.final_state.time);
    let times = [from, to, from + 0.37 * (to - from), from + 0.81 * (to - from)];
    if let Some(states) = run.trajectory(&times) {
        for state in &states {
            assert_finite("trajectory", state);
        }
    }
    let anywhere = [draw.any(), draw.any()];
    if let Some(states) = run.trajectory(&anywhere) {
        assert_finite("trajectory anywhere", &states.concat());
    }
    if let Some(forces) = run.contact_forces(&times) {
        assert!(forces.iter().all(|f| !f.normal.is_nan() && !f.tangential.is_nan()), "{forces:?}");
    }
    assert_finite("time in contact", &[run.time_in_contact()]);
    // On a torus the time grows with the square of the sections.
    if run.stroboscopic.len() < 20_000 {
        assert!(!run.return_report(&CancelToken::never()).label().is_empty());
    }
}

fn body(draw: &mut Draw) {
    let Some(system) = draw.system() else { return };
    let start = draw.state(&system);
    if is_hectic(&system, &start) {
        return;
    }
    let options = draw.options();
    let made = match run(&system, start, options, &enough()) {
        Err(RunError::Simulation { done, .. }) => {
            assert_finite("time at the end", &[done.final_state.time]);
            return;
        }
        other => made(other),
    };
    let Some(run) = made else { return };
    look(draw, &run);
    // Quadrature over all that a run has kept: only where it is short.
    let turns = (run.final_state.time - run.kept_from())
        * [system.frequency_ratio(), system.drive_frequency(), 1.0]
            .into_iter()
            .chain([2.0 * system.pendulum_damping() * system.frequency_ratio()])
            .chain([2.0 * system.oscillator_damping()])
            .fold(0.0, f64::max);
    if turns < 100.0 && draw.below(4) == 0 {
        let audit = run.energy_audit(&CancelToken::never()).unwrap();
        let sums = [audit.residual(), audit.total, audit.energy_start, audit.energy_end];
        if moderate(&system, &start) || !sums.iter().all(|sum| sum.is_nan()) {
            assert_finite("audit", &sums);
        }
    }
    if draw.below(4) == 0 {
        let further = draw.options();
        if let Ok(next) = run.resume(further, &enough()) {
            check_run(&next);
        }
    }
    if draw.below(8) == 0
        && let Ok(text) = serde_json::to_string(&run)
    {
        let back: Run = serde_json::from_str(&text).expect("a run is read back");
        assert_eq!(back.system, run.system);
        assert_eq!(back.final_state, run.final_state);
    }
}

fuzz_target!(|bytes: &[u8]| execution(|| body(&mut Draw::new(bytes))));

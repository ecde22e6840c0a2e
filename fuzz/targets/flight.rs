//! Free flights, their states at any time, and the search of their first contact.

#![no_main]

use libfuzzer_sys::fuzz_target;
use vibroimpact::{Found, Start, next_contact};
use vibroimpact::{Clock, FreeMotion};
use vibroimpact_fuzz::{Draw, assert_finite, execution, is_hectic, numbers};

fn body(draw: &mut Draw) {
    let Some(system) = draw.system() else { return };
    let motion = FreeMotion::new(&system);
    assert!(motion.span() > 0.0 && motion.span().is_finite(), "{system:?}");
    let state = draw.state(&system);
    if is_hectic(&system, &state) {
        return;
    }
    let clock = match draw.below(4) {
        0 => Clock::new(draw.integer(), draw.any()),
        1 => Clock::new(draw.integer(), draw.within(0.0, 1.0) * system.drive_period().min(1e3)),
        _ => Clock::new(0, draw.within(0.0, 1.0) * system.drive_period().min(1e3)),
    };
    let flight = motion.flight(clock, state);
    let start = match draw.below(4) {
        0 => Start::Apart,
        1 => Start::Touching,
        2 => Start::Grazed(draw.number(0.0, motion.span())),
        _ => Start::Released,
    };
    let span = match draw.below(4) {
        0 => draw.any(),
        1 => draw.within(0.0, 1.0) * motion.span(),
        _ => motion.span(),
    };
    let report = next_contact(&motion, &flight, start, span);
    match report.found {
        Found::Contact(touch) | Found::Graze(touch) | Found::Resting(touch) => {
            assert_finite("touch", &touch.state.to_array());
            assert_finite("time of the touch", &[touch.local_time()]);
            assert!(touch.local_time() <= span, "{touch:?} beyond {span}");
        }
        Found::Clear(time) => assert!(!time.is_nan(), "clear up to {time}"),
        Found::NotFinite | Found::Stalled => {}
    }
    let _ = motion.state_at(&flight, draw.number(0.0, motion.span()));
    let _ = motion.state_after_periods(&flight, draw.integer(), draw.number(0.0, 7.0));
    // Of numbers far from the ends of their range.
    let usual = numbers(&system, &state).iter().all(|v| v.is_finite() && v.abs() < 1e50);
    if usual && clock.period == 0 && (0.0..1e3).contains(&clock.time_in_period) {
        let part = draw.within(0.0, 1.0);
        let local = motion.state_at(&flight, part * motion.span());
        assert_finite("state in a local flight", &local.to_array());
        let periods = draw.below(200) as i64;
        let far = motion.state_after_periods(&flight, periods, part);
        // No run lasts longer.
        if (periods + 1) as f64 * system.drive_period() <= 2f64.powi(53) {
            assert_finite("state after periods", &far.to_array());
        }
    }
}

fuzz_target!(|bytes: &[u8]| execution(|| body(&mut Draw::new(bytes))));

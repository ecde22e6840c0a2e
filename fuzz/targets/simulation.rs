//! The iterator of events, from any state to any horizon.

#![no_main]

use libfuzzer_sys::fuzz_target;
use vibroimpact::{Clock, Event, Simulation, StopReason};
use vibroimpact_fuzz::{
    Draw, Limited, MOST_EVENTS, MOST_FLIGHTS, check_error, check_event, execution, is_hectic, shown,
};

fn body(draw: &mut Draw) {
    let Some(system) = draw.system() else { return };
    let start = draw.state(&system);
    let mut limits = Limited::to(if is_hectic(&system, &start) { 3 } else { MOST_FLIGHTS });
    let Ok(simulation) = Simulation::new(&system, start) else { return };
    let mut simulation = simulation.cancel_with(&limits.cancel);
    simulation = match draw.below(8) {
        0 => simulation,
        1 => simulation.periods(draw.integer() as u32),
        _ => simulation.until(draw.horizon()),
    };
    simulation = simulation.max_events(u64::from(draw.byte()) % MOST_EVENTS + 1);
    if draw.below(6) == 5 {
        simulation = simulation.chatter_tolerance(draw.any());
    }
    if draw.below(4) == 3 {
        simulation = simulation.section_phase(draw.number(0.0, 6.28));
    }
    let (mut last, mut clock) = (f64::NEG_INFINITY, Clock::START);
    let mut events = 0;
    while let Some(event) = simulation.advance(&mut limits) {
        events += 1;
        assert!(events <= MOST_EVENTS + 1, "more events than the cap");
        match event {
            Err(error) => {
                check_error(&error);
                assert!(simulation.advance(&mut limits).is_none(), "it goes on after {error}");
                break;
            }
            Ok(event) => {
                let event = shown(event);
                check_event(&event);
                let time = match event {
                    Event::Impact(e) => e.time,
                    Event::Stop(e) => e.time,
                    Event::Graze(e) => e.time,
                    Event::Chatter(e) => e.time,
                    _ => last,
                };
                assert!(time >= last, "{event:?} after {last}");
                // An impact half a last digit from the number told may be read a digit earlier or
                // later.
                let now = event.clock();
                let read = (now.period, now.time_in_period.next_up());
                assert!(read >= (clock.period, clock.time_in_period), "{event:?} after {clock:?}");
                (last, clock) = (time, event.clock());
                if let Event::Stop(stop) = event {
                    let complete = matches!(stop.reason, StopReason::Completed | StopReason::Rest);
                    assert!(!complete || limits.bad_section.is_none(), "{:?}", limits.bad_section);
                    assert!(simulation.advance(&mut limits).is_none());
                    break;
                }
            }
        }
    }
    let _ = (simulation.mode(), simulation.impact_count(), simulation.evaluations());
}

fuzz_target!(|bytes: &[u8]| execution(|| body(&mut Draw::new(bytes))));

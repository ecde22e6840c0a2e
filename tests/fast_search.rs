//! The search of first_contact.rs, its fast first pass in front (docs/contact-detection.md), along
//! whole sequences of flights and impacts, each flight judged by the independent dense search of
//! the contact audit; and contacts that the fast pass once told wrongly.

use std::collections::BTreeMap;
use std::f64::consts::{PI, TAU};

use crate::support::audit::{self, Draw, Flights, Kind, Outcome, judge_flight};
use crate::support::{draws, random_systems};
use rayon::prelude::*;
use vibroimpact::impact::{PreImpact, resolve};
use vibroimpact::{
    Clock, Contact, Event, Found, FreeMotion, Horizon, Simulation, Start, State, System,
    SystemBuilder, Touch, next_contact,
};

const EPS: f64 = f64::EPSILON;

/// Neither that of the audit nor that of random_systems.rs.
const SEED: u64 = 5;
/// Local flights in one sequence.
const FLIGHTS: usize = 16;

/// How the systems of the audit and of random_systems.rs are changed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Family {
    /// Resonance, critical damping, near grazes, low hops.
    Audit,
    /// The systems of the audit under a load that does not act.
    Unforced,
    /// Strong damping, any frequency.
    Random,
    /// A free or weakly held pendulum, turned by up to a million turns and fast: beyond 1e5 the
    /// fast pass takes no angle.
    Turned,
    /// Direct contact, lengths scaled by 2^-30 ... 2^30.
    Scaled,
}

const FAMILIES: [Family; 5] =
    [Family::Audit, Family::Unforced, Family::Random, Family::Turned, Family::Scaled];

fn changed(system: System, changes: &[(&str, f64)]) -> System {
    changes.iter().fold(system, |system, &(name, value)| system.with(name, value).unwrap())
}

/// Start number `index` of a family; `None` if it is not apart.
fn start(family: Family, index: u64) -> Option<Draw> {
    let drawn = audit::draw(Flights { seed: SEED, loads: index % 2 == 1 }, index);
    let loss = (index % 7) as f64 / 7.0;
    let bounces = [("restitution", 1.0 - 0.5 * loss), ("mass_ratio", 3f64.powi(index as i32 % 5))];
    let audited = Draw { system: changed(drawn.system, &bounces), ..drawn };
    Some(match family {
        Family::Audit => audited,
        Family::Unforced => {
            let still = [("moment_amplitude", 0.0), ("force_amplitude", 0.0)];
            // The hump that was wanted is another one.
            let kind = if drawn.kind.touching() { Kind::Impact } else { Kind::Apart };
            Draw { kind, system: changed(audited.system, &still), ..audited }
        }
        Family::Random => {
            let (system, state) = random_systems::draw(SEED, index);
            let apart = system.gap_function(&state) < -1e-9;
            return apart.then_some(Draw { kind: Kind::Apart, system, state });
        }
        Family::Turned => {
            let (system, state) = random_systems::draw(SEED, index);
            let turns = 10f64.powf((index % 13) as f64 / 2.0).round() * TAU;
            let stiffness = [0.0, 1e-6, 1e-3][index as usize % 3];
            let system = changed(system, &[("frequency_ratio", stiffness)]);
            let state = State { x1: state.x1 + turns, v1: state.v1 * 10.0 * loss, ..state };
            let apart = system.contact() == Contact::Oblique && system.gap_function(&state) < -1e-6;
            return apart.then_some(Draw { kind: Kind::Apart, system, state });
        }
        Family::Scaled => {
            let (system, state) = random_systems::draw(SEED, index);
            let scale = 2f64.powi(index as i32 % 61 - 30);
            let lengths = [
                ("gap", scale * system.gap()),
                ("moment_amplitude", scale * system.moment_amplitude()),
                ("force_amplitude", scale * system.force_amplitude()),
            ];
            let state = State {
                x1: scale * state.x1,
                v1: scale * state.v1,
                x2: scale * state.x2,
                v2: scale * state.v2,
            };
            let system = changed(system, &lengths);
            let apart =
                system.contact() == Contact::Direct && system.gap_function(&state) < -1e-9 * scale;
            return apart.then_some(Draw { kind: Kind::Apart, system, state });
        }
    })
}

/// What follows a local flight: the next one, its clock set to zero and the phase to what it is.
fn next(draw: &Draw) -> Option<Draw> {
    let motion = FreeMotion::new(&draw.system);
    let flight = motion.flight(Clock::START, draw.state);
    let (contact, delta) = (draw.system.contact(), draw.system.gap());
    let start = if draw.kind.touching() { Start::Touching } else { Start::Apart };
    let found = next_contact(&motion, &flight, start, motion.span()).found;
    let at_phase = |time: f64| {
        let phase = draw.system.phase() + draw.system.drive_frequency() * time;
        draw.system.with("phase", phase.rem_euclid(TAU)).unwrap()
    };
    match found {
        Found::Clear(time) => {
            let state = motion.state_after_periods(&flight, 0, time);
            let apart = draw.system.gap_function(&state) < -1e-12 * (1.0 + delta.abs());
            apart.then_some(Draw { kind: Kind::Apart, system: at_phase(time), state })
        }
        Found::Contact(touch) => {
            let State { x1, v1, v2, .. } = touch.state;
            let impact = resolve(&draw.system, &PreImpact::new(contact, &touch.state)).ok()?;
            let tip = if contact == Contact::Direct { x1 } else { x1.sin() };
            let state = State { x1, v1: impact.v1_post, x2: tip - delta, v2: impact.v2_post };
            // Less is rest: cos x1 has the rounding of x1.
            let rest = (1e-9 + 1e-14 * x1.abs()) * (v1.abs() + v2.abs() + 1.0);
            let leaves = draw.system.approach_velocity(&state) < -rest;
            let system = at_phase(touch.local_time());
            leaves.then_some(Draw { kind: Kind::Impact, system, state })
        }
        _ => None,
    }
}

#[test]
fn sequences_of_flights_are_those_of_a_dense_search() {
    // Of each family.
    let sequences = draws(15, 150);
    let judged: Vec<(Family, u64, usize, Outcome, String)> = FAMILIES
        .par_iter()
        .flat_map(|&family| {
            // Two in three draws of a family may be refused.
            let starts = (0..).filter_map(move |index| Some((index, start(family, index)?)));
            let starts: Vec<(u64, Draw)> = starts.take(sequences).collect();
            starts.into_par_iter().flat_map_iter(move |(index, first)| {
                let flights = std::iter::successors(Some(first), next);
                flights.take(FLIGHTS).enumerate().map(move |(number, draw)| {
                    let judged = judge_flight(index, draw);
                    (family, index, number, judged.outcome, format!("{:?}", judged.draw))
                })
            })
        })
        .collect();
    let mut counts: BTreeMap<(Family, Outcome), usize> = BTreeMap::new();
    for (family, index, number, outcome, draw) in &judged {
        *counts.entry((*family, *outcome)).or_default() += 1;
        if outcome.is_disagreement() {
            println!("{family:?} {index}, flight {number}: {outcome:?} {draw}");
        }
    }
    println!("{counts:?}");
    assert!(judged.iter().all(|(_, _, _, outcome, _)| !outcome.is_disagreement()));
    // Sequences go on, and rounding decides hardly any flight that was not drawn for that.
    for family in FAMILIES {
        let of = |outcome| counts.get(&(family, outcome)).copied().unwrap_or(0);
        assert!(of(Outcome::Agree) > 5 * sequences, "{family:?}");
        assert!(of(Outcome::Undecided) < sequences, "{family:?}");
    }
}

fn direct() -> SystemBuilder {
    System::builder()
        .mass_ratio(0.6)
        .frequency_ratio(1.75)
        .restitution(0.8)
        .drive_frequency(1.0)
        .contact(Contact::Direct)
}

fn first_contact(system: &System, start: State, until: f64) -> Option<Touch> {
    let motion = FreeMotion::new(system);
    assert!(until <= motion.span());
    let flight = motion.flight(Clock::START, start);
    match next_contact(&motion, &flight, Start::Apart, until).found {
        Found::Contact(touch) => Some(touch),
        _ => None,
    }
}

/// x1 = -A sin t meets a body at rest at A - h: Newton's steps on a cubic leapt over the double
/// root, or stopped short of it.
#[test]
fn a_contact_just_below_a_top_is_met_at_its_instant() {
    let amplitude = 0.75;
    let moment = amplitude * (1.75 * 1.75 - 1.0);
    for exponent in 24..=120 {
        let height = 10f64.powf(-f64::from(exponent) / 10.0);
        let gap = amplitude - height;
        let height = amplitude - gap;
        let builder = direct().gap(gap).moment_amplitude(moment).phase(PI / 2.0);
        let system = builder.build().unwrap();
        let start = State::new(0.0, -amplitude, 0.0, 0.0).unwrap();
        let touch = first_contact(&system, start, 6.0).unwrap();
        // cos d = 1 - h/A.
        let before = 2.0 * (height / (2.0 * amplitude)).sqrt().asin();
        let u = amplitude * before.sin();
        let late = touch.local_time() - (1.5 * PI - before);
        // The drive's amplitude and the lag of pi/2 are rounded too.
        let units = late.abs() * u / (EPS * 5.0);
        assert!(units < 5.0, "h = {height:e}: {late:e}, {units}");
        assert!((touch.gap.rate / u - 1.0).abs() < 20.0 * EPS / height, "h = {height:e}");
    }
}

/// Whatever the unit of length: with numbers above 1e5 the search once took another path.
#[test]
fn direct_contact_scales_to_the_last_bit() {
    let impacts = |scale: f64, mass_ratio: f64| {
        let system = direct()
            .mass_ratio(mass_ratio)
            .gap(0.5 * scale)
            .moment_amplitude(1.3 * scale)
            .force_amplitude(0.2 * scale)
            .build()
            .unwrap();
        let start = State::new(0.0, 0.5 * scale, 0.1 * scale, 0.0).unwrap();
        let horizon = Horizon::Impacts { count: 40, max_time: 1e3 };
        let events = Simulation::new(&system, start).unwrap().until(horizon);
        let found: Vec<[f64; 2]> = events
            .filter_map(|event| match event.unwrap() {
                Event::Impact(impact) => Some([impact.time, impact.post.v1 / scale]),
                _ => None,
            })
            .collect();
        assert_eq!(found.len(), 40);
        found
    };
    for mass_ratio in [0.6, 0.0] {
        let plain = impacts(1.0, mass_ratio);
        for exponent in [-240, -50, -27, -3, 9, 12, 17, 27, 50, 240] {
            assert_eq!(impacts(2f64.powi(exponent), mass_ratio), plain, "2^{exponent}");
        }
    }
}

//! What the first pass of the contact search tells without many samples: hops that end soon after
//! an impact, contacts several local flights ahead, and contacts at the end of a simple fraction of
//! a turn. Contacts are compared with a dense search in double-double arithmetic, or are known
//! exactly.

use std::f64::consts::{PI, TAU};

use crate::support::audit::dense::{DenseSearch, ExactMotion, Place};
use crate::support::audit::double_double::Dd;
use crate::support::audit::exact_motion::{DenseFlight, Point};
use crate::support::audit::judge::{Level, Measured};
use crate::support::audit::rounding;
use crate::support::audit::{Draw, Kind, Outcome, judge_flight};
use crate::support::draws;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use vibroimpact::{
    Clock, Contact, ContactReport, Event, Found, FreeMotion, Horizon, Simulation, Start, State,
    System, SystemBuilder, next_contact,
};

const EPS: f64 = f64::EPSILON;

struct Drawer(ChaCha8Rng);

impl Drawer {
    fn new(seed: u64, index: u64) -> Self {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        rng.set_stream(index);
        Self(rng)
    }

    fn uniform(&mut self, from: f64, to: f64) -> f64 {
        self.0.random_range(from..to)
    }

    fn some(&mut self, from: f64, to: f64) -> f64 {
        if self.0.random_bool(0.3) { 0.0 } else { self.uniform(from, to) }
    }

    fn system(&mut self, damping: f64) -> SystemBuilder {
        let direct = self.0.random_bool(0.4);
        System::builder()
            .mass_ratio(1.0)
            .restitution(1.0)
            .gap(0.0)
            .frequency_ratio(self.uniform(0.2, 4.0))
            .drive_frequency(self.uniform(0.2, 6.0))
            .pendulum_damping(self.some(0.0, damping))
            .oscillator_damping(self.some(0.0, damping))
            .moment_amplitude(self.some(-3.0, 3.0))
            .force_amplitude(self.some(-3.0, 3.0))
            .phase(self.uniform(-PI, PI))
            .contact(if direct { Contact::Direct } else { Contact::Oblique })
    }
}

fn after_impact(system: &System, state: State) -> ContactReport {
    let motion = FreeMotion::new(system);
    let flight = motion.flight(Clock::START, state);
    next_contact(&motion, &flight, Start::Touching, motion.span())
}

/// A hop that is wanted: of the length T = -2 g'/g'', if g'' stayed what it is.
#[derive(Debug, Clone)]
struct Hop {
    draw: Draw,
    /// T as part of a turn of the fastest motion.
    turns: f64,
    /// T g'''/g'' at the start: below -1 it changes the sign of g'' before T.
    bend: f64,
    /// Speed at which the bodies part, as part of what g' can be.
    speed: f64,
}

impl Hop {
    /// Flight number `index`, its g'' such that `bend` is so large, either sign; `None` if there is
    /// none.
    fn new(index: u64) -> Option<Self> {
        let mut drawer = Drawer::new(7, index);
        let plain = drawer.system(1.2).build().unwrap();
        let turns = 10f64.powf(drawer.uniform(-6.0, 0.3f64.log10()));
        let bend = 10f64.powf(drawer.uniform(turns.log10(), 1.5));
        let (x1, v1) = (drawer.uniform(-1.3, 1.3), drawer.uniform(-2.0, 2.0));
        let (w, omega) = (plain.frequency_ratio(), plain.drive_frequency());
        let length = turns * TAU / w.max(omega).max(1.0);
        // Displacement of the tip and its derivatives, by the equation of motion.
        let (sin_psi, cos_psi) = plain.phase().sin_cos();
        let (f1, f2) = (plain.moment_amplitude(), plain.force_amplitude());
        let c1 = 2.0 * plain.pendulum_damping() * w;
        let a1 = f1 * cos_psi - c1 * v1 - w * w * x1;
        let j1 = -f1 * omega * sin_psi - c1 * a1 - w * w * v1;
        let (sin, cos) = x1.sin_cos();
        let tip = match plain.contact() {
            Contact::Direct => [x1, v1, a1, j1],
            _ => [
                sin,
                v1 * cos,
                a1 * cos - v1 * v1 * sin,
                (j1 - v1.powi(3)) * cos - 3.0 * v1 * a1 * sin,
            ],
        };
        let c2 = 2.0 * plain.oscillator_damping();
        // g''' where g' and g'' are small.
        let third = tip[3] + f2 * omega * sin_psi + c2 * tip[2] + tip[1];
        let second = third.abs() * length / bend;
        let (v2, a2) = (tip[1] + 0.5 * second * length, tip[2] - second);
        let x2 = f2 * cos_psi - c2 * v2 - a2;
        let third = tip[3] - (-f2 * omega * sin_psi - c2 * a2 - v2);
        let system = plain.with("gap", tip[0] - x2).unwrap();
        let state = State { x1, v1, x2, v2 };
        let span = FreeMotion::new(&system).span();
        let speed = 0.5 * second * length / rounding::level(&system, &state, true, span).rate_bound;
        let draw = Draw { kind: Kind::Impact, system, state };
        // Slower ones are at rest, to rounding.
        (speed > 1e-12).then_some(Self { draw, turns, bend: length * third / second, speed })
    }
}

/// The bodies leave the contact with g'' > 0. Where g''' hardly matters, one evaluation is enough,
/// however short the hop; where g'' changes its sign before the hop is over, or g''' doubles it,
/// samples are needed.
#[test]
fn short_hops_end_where_a_dense_search_says() {
    let hops: Vec<Hop> = (0..).filter_map(Hop::new).take(draws(6_000, 12_000)).collect();
    let judged: Vec<(Hop, Outcome, bool)> = hops
        .into_par_iter()
        .enumerate()
        .map(|(index, hop)| {
            let judged = judge_flight(index as u64, hop.draw.clone());
            // Nothing found may be seen at one glance too.
            let at_once = judged.evaluations == 1 && judged.found != "none";
            (hop, judged.outcome, at_once)
        })
        .collect();
    for (hop, outcome, _) in &judged {
        assert!(!outcome.is_disagreement(), "{outcome:?} {hop:?}");
    }
    let among = |wanted: &dyn Fn(&Hop) -> bool| {
        let all = judged.iter().filter(|(hop, ..)| wanted(hop));
        let one = all.clone().filter(|(_, _, at_once)| *at_once).count();
        (one, all.count())
    };
    let contact = |hop: &Hop| hop.draw.system.contact();
    for geometry in [Contact::Oblique, Contact::Direct] {
        for turns in [1e-6, 1e-5, 1e-4, 1e-3, 1e-2, 0.1] {
            let part = |hop: &Hop| {
                let here = hop.turns >= turns && hop.turns < 10.0 * turns;
                here && contact(hop) == geometry
            };
            let straight = among(&|hop| part(hop) && hop.bend.abs() < 0.03 && hop.speed > 1e-6);
            let bent = among(&|hop| part(hop) && hop.bend < -1.0);
            let doubled = among(&|hop| part(hop) && hop.bend > 1.0);
            println!("{geometry:?} {turns:e} {straight:?} {bent:?} {doubled:?}");
            if turns < 0.01 {
                assert!(straight.1 > 10 && 10 * straight.0 > 9 * straight.1);
            }
            assert!(bent.0 == 0 && doubled.0 == 0);
            if turns > 1e-4 {
                assert!(bent.1 > 10 && doubled.1 > 10);
            }
        }
    }
}

/// Under a constant load a ball without a spring hops along a parabola: the hop lasts 2 u/a.
#[test]
fn a_hop_along_a_parabola_is_exact_at_any_length() {
    for tenth in -60..-5 {
        for load in [0.3, 1.0, 9.8] {
            let time = TAU * 10f64.powf(f64::from(tenth) / 10.0);
            let speed = 0.5 * time * load;
            let system = System::builder()
                .mass_ratio(0.0)
                .frequency_ratio(0.0)
                .restitution(1.0)
                .gap(0.0)
                .drive_frequency(0.0)
                .moment_amplitude(load)
                .contact(Contact::Direct)
                .build()
                .unwrap();
            let report = after_impact(&system, State { x1: 0.0, v1: -speed, x2: 0.0, v2: 0.0 });
            let Found::Contact(touch) = report.found else { panic!("{report:?}") };
            let late = touch.local_time() / (2.0 * speed / load) - 1.0;
            assert!(late.abs() <= 4.0 * f64::EPSILON, "{time:e} {load}: {late:e}");
            assert!((touch.state.v1 / speed - 1.0).abs() <= 4.0 * f64::EPSILON, "{time:e} {load}");
            assert_eq!(report.evaluations, 1, "{time:e} {load}");
        }
    }
}

/// A flight with its first contact, by the dense search, one to eight local flights ahead.
struct Far {
    system: System,
    start: State,
    exact: DenseFlight,
    contact: Place<Point>,
    level: Level,
    /// Its time in local flights.
    spans: f64,
}

impl Far {
    /// Flight number `index`: two bodies that swing, and a gap that only the higher humps bridge.
    fn new(index: u64) -> Option<Self> {
        let mut drawer = Drawer::new(8, index);
        let touching = drawer.0.random_bool(0.5);
        let system = drawer.system(0.05).gap(drawer.uniform(0.2, 2.0)).build().unwrap();
        let direct = system.contact() == Contact::Direct;
        let (x1, v1) = (drawer.uniform(-0.8, 0.8), drawer.uniform(-0.8, 0.8));
        let (tip, slope) = if direct { (x1, 1.0) } else { (x1.sin(), x1.cos()) };
        let apart = if touching { 0.0 } else { drawer.uniform(0.1, 1.5) };
        let leaving = drawer.uniform(if touching { 0.05 } else { -0.5 }, 1.0);
        let x2 = tip - system.gap() + apart;
        let start = State { x1, v1, x2, v2: v1 * slope + leaving };
        let span = FreeMotion::new(&system).span();
        let mut exact = DenseFlight::new(&system, &start, touching, 8.0 * span);
        let level = rounding::level(&system, &start, touching, 8.0 * span);
        // No hump is so close to the contact that rounding decides about it.
        let seen = exact.search(|s| 1e6 * level.at(s));
        let contact = seen.contact.filter(|_| seen.humps.is_empty())?;
        let spans = contact.time.hi / span;
        (spans > 1.001).then_some(Self { system, start, exact, contact, level, spans })
    }
}

/// A contact that lies several local flights ahead is met from where the flight starts; the angles
/// have grown by then, but nothing is lost.
#[test]
fn a_contact_several_local_flights_ahead_is_met_to_rounding() {
    let flights: Vec<Far> =
        (0..draws(3_000, 6_000) as u64).into_par_iter().filter_map(Far::new).collect();
    let (mut worst, mut number) = ([0f64; 3], [0; 8]);
    for far in &flights {
        let Far { system, start, exact, contact, level, spans } = far;
        let mut simulation = Simulation::new(system, *start).unwrap();
        let (mut found, wanted) = (None, contact.time.hi);
        simulation = simulation.until(Horizon::Time(2.0 * wanted));
        for event in simulation {
            if let Event::Impact(impact) = event.unwrap() {
                found = Some(impact);
                break;
            }
        }
        let Some(impact) = found else { panic!("{spans} {system:?} {start:?}") };
        let late = Dd::new(impact.time) - contact.time;
        let noise = level.at(wanted) / contact.gap.rate.hi + EPS * wanted;
        let there = exact.later(&contact.point, late);
        let off = |exact: Dd, found: f64| (exact - Dd::new(found)).hi.abs();
        let State { x1, v1, x2, v2 } = impact.pre;
        // A time of one double, which is later as it is rounded, is part of these.
        let bound = level.rate_bound * wanted.max(1.0);
        let places =
            off(there.x[0], x1).max(off(there.x[1], x2)) / (EPS * (exact.size(&there) + bound));
        let rates = off(there.v[0], v1).max(off(there.v[1], v2)) / (EPS * bound);
        for (worst, now) in worst.iter_mut().zip([late.hi.abs() / noise, places, rates]) {
            *worst = worst.max(now);
        }
        number[*spans as usize] += 1;
        assert!(
            late.hi.abs() <= noise && places <= 6.0 && rates <= 6.0,
            "{worst:?} {spans} {system:?} {start:?}"
        );
    }
    println!("{} flights, {number:?}, {worst:?}", flights.len());
    assert!(number[1..].iter().all(|&flights| flights >= 5), "{number:?}");
}

/// A body that creeps is evaluated for one local flight only, and what lies beyond belongs to the
/// next one. On the last step the root of the interpolant is too rough to tell on which side a
/// contact lies: contacts before the end were once taken for later ones, and met at the end, where
/// the bodies overlapped.
#[test]
fn a_contact_just_before_the_end_of_a_local_flight_is_met_there() {
    let meet = |index: u64| -> Option<(f64, f64, f64)> {
        let mut drawer = Drawer::new(9, index);
        let creeping = drawer.uniform(1.05, 3.0);
        let system = drawer.system(1.0).oscillator_damping(creeping).build().unwrap();
        let motion = FreeMotion::new(&system);
        let direct = system.contact() == Contact::Direct;
        let place = |s: State| if direct { s.x1 } else { s.x1.sin() } - s.x2;
        let mut near = |size: f64| drawer.uniform(-size, size);
        let start = State { x1: near(0.8), v1: near(1.0), x2: near(0.8), v2: near(1.0) };
        let flight = motion.flight(Clock::START, start);
        let wanted = motion.span() * (1.0 - 10f64.powf(drawer.uniform(-5.0, -1.5)));
        // The gap is such that the bodies meet at the time that is wanted, and not before.
        let at = |part: f64| place(motion.state_at(&flight, part * wanted));
        let gap = at(1.0);
        let apart = (0..1_000).all(|i| at(f64::from(i) * 1e-3) < gap);
        let rate = (gap - at(1.0 - 1e-6)) / (1e-6 * wanted);
        if !(apart && place(start) < gap - 0.01 && rate > 0.01) {
            return None;
        }
        let motion = FreeMotion::new(&system.with("gap", gap).unwrap());
        let flight = motion.flight(Clock::START, start);
        let found = next_contact(&motion, &flight, Start::Apart, motion.span()).found;
        let Found::Contact(touch) = found else { return Some((wanted, f64::INFINITY, rate)) };
        Some((wanted, touch.local_time(), rate))
    };
    let flights = draws(5_000, 20_000) as u64;
    let met: Vec<_> = (0..flights).into_par_iter().filter_map(meet).collect();
    let wrong: Vec<_> = met
        .iter()
        .filter(|(wanted, found, rate)| (found - wanted).abs() > 1e-13 * wanted.max(1.0 / rate))
        .collect();
    println!("{} flights, {} wrong", met.len(), wrong.len());
    assert!(10 * met.len() as u64 > flights, "{}", met.len());
    assert!(wrong.is_empty(), "{} {:?}", wrong.len(), wrong.first());
}

/// A drive that is the fastest of the motion: its period is half a local flight, and the flights of
/// a motion that repeats with it all end there. Steps that ended there too left all these contacts
/// to the careful search.
#[test]
fn a_flight_of_one_drive_period_costs_few_evaluations() {
    let mut motions = 0;
    for (frequency_ratio, damping) in [(2.0, 0.0), (1.5, 0.05), (1.5, 0.1)] {
        for tenth in 16..25 {
            let drive_frequency = f64::from(tenth) / 10.0;
            let system = System::builder()
                .mass_ratio(0.6)
                .frequency_ratio(frequency_ratio)
                .restitution(0.8)
                .gap(0.5)
                .drive_frequency(drive_frequency)
                .moment_amplitude(1.0)
                .pendulum_damping(damping)
                .oscillator_damping(damping)
                .build()
                .unwrap();
            if drive_frequency < frequency_ratio + 0.05 {
                continue;
            }
            let count = |periods: i64| {
                let start = State::new(0.0, 0.5, 0.0, 0.0).unwrap();
                let mut simulation = Simulation::new(&system, start).unwrap();
                simulation = simulation.until(Horizon::Periods(periods));
                assert!(simulation.by_ref().all(|event| event.is_ok()));
                (simulation.evaluations(), simulation.impact_count())
            };
            let ((before, few), (after, many)) = (count(2_000), count(3_000));
            if many - few == 1_000 {
                let each = (after - before) as f64 / 1_000.0;
                println!("{frequency_ratio} {damping} {drive_frequency}: {each}");
                motions += 1;
                assert!(each <= 26.0, "{frequency_ratio} {damping} {drive_frequency}: {each}");
            }
        }
    }
    assert!(motions >= 10, "{motions}");
}

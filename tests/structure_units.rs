//! The same motion in other units of mass, length and time, in other coordinates, and backwards in
//! time.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use vibroimpact::{
    CancelToken, Horizon, Run, RunOptions, StopImpactRecord, StopReason, Structure, StructureState,
    run,
};

use crate::support::draws;
use crate::support::random_structures::{Drawn, Units, uniform};

fn made(drawn: &Drawn, units: Units, v: &[f64]) -> Run<Structure> {
    let drawn = Drawn { v: v.to_vec(), ..drawn.clone() };
    let options = RunOptions { max_events: 300, ..RunOptions::periods(4) };
    let (structure, start) = (drawn.structure(units), drawn.start(units));
    run(&structure, start, options, &CancelToken::never()).unwrap()
}

/// What is a number of units: impacts, changes of contact and the end.
fn numbers(run: &Run<Structure>, Units { length, time, .. }: Units) -> Vec<f64> {
    let state = |at: f64, q: &[f64], v: &[f64]| {
        let q = q.iter().map(|q| q / length).collect::<Vec<_>>();
        let v = v.iter().map(|v| v / (length / time)).collect::<Vec<_>>();
        [vec![at / time], q, v].concat()
    };
    let impacts = run.impacts.iter().map(|row| state(row.time, &row.q, &row.v_post));
    let contacts = run.contacts.iter().map(|row| state(row.time, &row.state.q, &row.state.v));
    let end = &run.final_state;
    let end = state(end.time, &end.state.q, &end.state.v);
    impacts.chain(contacts).chain([end]).flatten().collect()
}

/// What is left of a gap may be so small that it has no full mantissa in one of the units (it is
/// subnormal there: below 2e-308, for units down to 2^-50): only there does a power of two round.
const LOST: f64 = 1e-290;

/// Units whose ratios are powers of two (of mass and of velocity: of four) change no bit: no number
/// with a unit stands in the code.
#[test]
fn units_change_no_bit_of_a_motion() {
    let mut rng = ChaCha8Rng::seed_from_u64(51);
    let (mut impacts, mut contacts) = (0, 0);
    for case in 0..draws(100, 2_000) {
        let drawn = Drawn::random(&mut rng);
        let given = made(&drawn, Units::DRAWN, &drawn.v);
        // Modal coordinates have the square root of a mass, energetic impacts that of a velocity.
        let [mass, length, time] = [(10, 4.0f64), (20, 2.0), (10, 2.0)].map(|(most, base)| {
            let power = rng.random_range(1..=most);
            base.powi(if rng.random_bool(0.5) { power } else { -power })
        });
        let odd = (length / time).log2() % 2.0 != 0.0;
        let length = if odd { 2.0 * length } else { length };
        let units = Units { mass, length, time };
        let other = made(&drawn, units, &drawn.v);
        assert_eq!(given.stop_reason, other.stop_reason, "case {case}");
        let (ours, theirs) = (numbers(&given, Units::DRAWN), numbers(&other, units));
        assert_eq!(ours.len(), theirs.len(), "case {case}: {units:?}");
        for (ours, theirs) in ours.iter().zip(&theirs) {
            let lost = ours.abs().max(theirs.abs()) < LOST;
            assert!(ours == theirs || lost, "case {case}: {units:?}: {ours:e} {theirs:e}");
        }
        impacts += given.impacts.len();
        contacts += given.contacts.len();
    }
    println!("{impacts} impacts, {contacts} changes of contact");
    assert!(impacts > 1_000 && contacts > 300);
}

/// How many impacts of two runs are the same, those of the other written anew by `as_given`, and
/// their largest difference: in roundings, times what the distance of a neighbour says that the
/// motion makes of one. Before the first contact: after how many impacts a chatter is completed may
/// differ.
fn compare(
    case: usize,
    [given, other, beside]: [&Run<Structure>; 3],
    as_given: impl Fn(f64, &[f64], &[f64]) -> Vec<f64>,
) -> (usize, f64) {
    let (mut growth, mut worst, mut same) = (1.0f64, 0.0f64, 0);
    let cut = given.contacts.first().map_or(f64::INFINITY, |row| row.time);
    let rows = given.impacts.iter().zip(&other.impacts).zip(&beside.impacts);
    for ((a, b), near) in rows {
        let ours = [&[a.time], &a.q[..], &a.v_pre[..]].concat();
        let apart = [&[near.time], &near.q[..], &near.v_pre[..]].concat();
        let theirs = as_given(b.time, &b.q, &b.v_pre);
        let most = ours.iter().zip(&apart).fold(0.0f64, |most, (a, b)| most.max((a - b).abs()));
        growth = growth.max(most / NEAR);
        if growth > 1e5 || a.time.max(theirs[0]) >= cut || near.stop != a.stop {
            break;
        }
        assert_eq!(a.stop, b.stop, "case {case}, impact {same}");
        let slow = a.approach_velocity.min(1.0);
        for (a, b) in ours.iter().zip(&theirs) {
            let error = (a - b).abs() / (a.abs().max(1.0) * growth / slow * f64::EPSILON);
            worst = worst.max(error);
            assert!(error < 1_000.0, "case {case}, impact {same}: {a} {b}: {error}");
        }
        same += 1;
    }
    (same, worst)
}

/// How far away a neighbour starts.
const NEAR: f64 = 1e-9;

fn neighbour(drawn: &Drawn) -> Run<Structure> {
    let off: Vec<f64> = drawn.v.iter().map(|v| v + NEAR).collect();
    made(drawn, Units::DRAWN, &off)
}

/// Any other units change no more than rounding.
#[test]
fn other_units_change_no_more_than_rounding() {
    let mut rng = ChaCha8Rng::seed_from_u64(52);
    let (mut impacts, mut worst) = (0, 0.0f64);
    for case in 0..draws(100, 2_000) {
        let drawn = Drawn::random(&mut rng);
        let [mass, length, time] =
            [1e6, 1e6, 1e3].map(|unit: f64| if rng.random_bool(0.5) { unit } else { 1.0 / unit });
        let units = Units { mass, length, time };
        let (given, other) = (made(&drawn, Units::DRAWN, &drawn.v), made(&drawn, units, &drawn.v));
        let as_given = |t: f64, q: &[f64], v: &[f64]| {
            let q = q.iter().map(|q| q / length);
            let v = v.iter().map(|v| v / (length / time));
            std::iter::once(t / time).chain(q).chain(v).collect()
        };
        let (same, off) = compare(case, [&given, &other, &neighbour(&drawn)], as_given);
        (impacts, worst) = (impacts + same, worst.max(off));
    }
    println!("{impacts} impacts, worst {worst} eps");
    assert!(impacts > 300);
}

/// Coordinates in another order and with other signs, and any combinations of them, move alike.
#[test]
fn other_coordinates_change_no_more_than_rounding() {
    let mut rng = ChaCha8Rng::seed_from_u64(7);
    let (mut impacts, mut worst) = (0, 0.0f64);
    for case in 0..draws(100, 2_000) {
        let mut drawn = Drawn::random(&mut rng);
        let count = drawn.q.len();
        // q = B p.
        let b: Vec<Vec<f64>> = if case % 2 == 0 {
            let (turn, sign) = (rng.random_range(0..count), [1.0, -1.0][rng.random_range(0..2)]);
            let entry = |i: usize, j: usize| if (i + turn) % count == j { sign } else { 0.0 };
            (0..count).map(|i| (0..count).map(|j| entry(i, j)).collect()).collect()
        } else {
            let mut row = |i: usize| -> Vec<f64> {
                let unit = |j| f64::from(u8::from(i == j));
                (0..count).map(|j| unit(j) + uniform(&mut rng, -0.1, 0.1)).collect()
            };
            (0..count).map(&mut row).collect()
        };
        let by = |p: &[f64]| -> Vec<f64> {
            b.iter().map(|row| row.iter().zip(p).map(|(b, p)| b * p).sum()).collect()
        };
        let start = drawn.v.clone();
        let other = drawn.in_coordinates(&b);
        drawn.v = by(&start);
        let (given, other) =
            (made(&drawn, Units::DRAWN, &drawn.v), made(&other, Units::DRAWN, &start));
        let as_given = |t: f64, q: &[f64], v: &[f64]| [vec![t], by(q), by(v)].concat();
        let (same, off) = compare(case, [&given, &other, &neighbour(&drawn)], as_given);
        (impacts, worst) = (impacts + same, worst.max(off));
    }
    println!("{impacts} impacts, worst {worst} eps");
    assert!(impacts > 300);
}

/// Without friction, damping and loss a motion runs back to where it began.
#[test]
fn elastic_motions_run_back() {
    let mut rng = ChaCha8Rng::seed_from_u64(53);
    let (mut impacts, mut worst, mut compared) = (0, 0.0f64, 0);
    for case in 0..draws(100, 2_000) {
        let mut drawn = Drawn::random(&mut rng).without_loss();
        let time = uniform(&mut rng, 2.0, 8.0);
        let options = RunOptions { max_events: 200, ..RunOptions::until(Horizon::Time(time)) };
        let of = |drawn: &Drawn| {
            let (structure, start) = (drawn.structure(Units::DRAWN), drawn.start(Units::DRAWN));
            run(&structure, start, options, &CancelToken::never()).unwrap()
        };
        let there = of(&drawn);
        let off = Drawn { v: drawn.v.iter().map(|v| v + 1e-9).collect(), ..drawn.clone() };
        let beside = of(&off);
        // An impact at one end may be one at the other, or none.
        let inside = |row: &StopImpactRecord| row.time > 1e-6 && row.time < time - 1e-6;
        if there.stop_reason != StopReason::Completed
            || beside.impacts.len() != there.impacts.len()
            || !there.impacts.iter().all(inside)
        {
            continue;
        }
        let (first, last) = (drawn.start(Units::DRAWN), there.final_state.state.clone());
        drawn.turn_back(time, &last);
        let back = of(&drawn);
        let end = &back.final_state.state;
        assert_eq!(back.impacts.len(), there.impacts.len(), "case {case}");
        let distance = |a: &StructureState, q: &[f64], v: &[f64], sign: f64| {
            let q = a.q.iter().zip(q).map(|(a, b)| (a - b).abs());
            let v = a.v.iter().zip(v).map(|(a, b)| (a - sign * b).abs());
            q.chain(v).fold(0.0f64, f64::max)
        };
        let near = &beside.final_state.state;
        let growth = (distance(&last, &near.q, &near.v, 1.0) / 1e-9).max(1.0);
        let slow = there.impacts.iter().fold(1.0f64, |least, row| least.min(row.approach_velocity));
        let error = distance(&first, &end.q, &end.v, -1.0) / (growth / slow * f64::EPSILON);
        worst = worst.max(error);
        assert!(error < 1_000.0, "case {case}: {error}");
        impacts += there.impacts.len();
        compared += 1;
    }
    println!("{compared} motions, {impacts} impacts, worst {worst} eps");
    assert!(compared > 60 && impacts > 300);
}

//! Complete chatter on the bouncing ball, whose every bounce is known (DiffEqDocs; FMI reference
//! FMU BouncingBall): with fall acceleration f1, drop height 1 and t1 = sqrt(2/f1) the n-th impact
//! comes at t1 (1 + 2 (r + ... + r^(n-1))), the bounces accumulate at t1 (1 + r)/(1 - r).

use vibroimpact::{BouncesEnd, CancelToken, EventKind, Run, RunOptions, State, StopReason, System};

use super::{Draw, ball, chattering, go, paper_start, state, until};

/// Rows of the contacts that are chatter.
fn chatters(run: &Run) -> Vec<vibroimpact::ContactRecord> {
    let is_chatter = |c: &&vibroimpact::ContactRecord| c.kind == EventKind::Chatter as i64;
    run.contacts.iter().filter(is_chatter).copied().collect()
}

#[test]
fn a_bouncing_ball_comes_to_rest_where_its_bounces_accumulate() {
    let run = go(&ball(9.8, 0.5), state(-1.0, 0.0, 0.0, 0.0), until(2.0));
    assert_eq!(run.stop_reason, StopReason::Rest);
    assert_eq!(run.impacts[0].time, 0.451_753_951_452_625_6);
    for pair in run.impacts.windows(2) {
        assert!((pair[1].v1_pre - 0.5 * pair[0].v1_pre).abs() < 1e-15, "{pair:?}");
    }
    // The impacts left out begin where those that are listed end.
    let [chatter]: [_; 1] = chatters(&run).try_into().unwrap();
    assert!((chatter.time - 1.355_261_854_357_876_7).abs() < 1e-13, "{}", chatter.time);
    assert!(chatter.error <= 1e-12);
    let last = run.impacts.last().unwrap();
    assert!((chatter.time - last.time - chatter.time_jump).abs() < 1e-15);
    // T = 2 u/(g'' (1 - r)) exactly; n impacts leave T r^n.
    assert!((chatter.time_jump + 2.0 * last.v1_post / (9.8 * 0.5)).abs() < 1e-15);
    let left = chatter.time_jump * 0.5f64.powf(chatter.impacts_skipped);
    assert!(left <= f64::EPSILON * chatter.time && left > 0.4 * f64::EPSILON * chatter.time);
    // The ball's weight rests on the wall.
    let stick = run.contacts[1];
    assert_eq!((stick.kind, stick.time), (EventKind::Stick as i64, chatter.time));
    assert_eq!((stick.normal_force, stick.tangential_force), (9.8, 0.0));
    // At rest at t = 2.
    assert_eq!(run.final_state.time, 2.0);
    assert_eq!(run.final_state.state, state(0.0, 0.0, 0.0, 0.0));
    assert_eq!(run.trajectory(&[1.5]).unwrap(), [[0.0; 4]]);
    assert!((run.time_in_contact() - (2.0 - chatter.time)).abs() < 1e-15);
}

#[test]
fn the_ball_of_the_fmi_reference() {
    let run = go(&ball(9.81, 0.7), state(-1.0, 0.0, 0.0, 0.0), until(1.0));
    let [half, one]: [[f64; 4]; 2] = run.trajectory(&[0.5, 1.0]).unwrap().try_into().unwrap();
    // No impact between the two: the speeds differ by 9.81/2.
    for (state, height, speed) in [
        (half, 0.138_779_880_359_517_2, 2.625_059_760_719_034),
        (one, 0.225_059_760_719_034, -2.279_940_239_280_966),
    ] {
        assert!((-state[0] - height).abs() < 1e-14, "{state:?}");
        assert!((-state[1] - speed).abs() < 1e-14, "{state:?}");
        assert_eq!((state[2], state[3]), (0.0, 0.0));
    }
    // To the rounding of the impact's time in its record, beside the height and speed of the fall.
    let fall = [1.0, (2.0f64 * 9.81).sqrt(), 0.0, 0.0];
    for ((end, followed), size) in run.final_state.state.to_array().into_iter().zip(one).zip(fall) {
        assert!((end - followed).abs() <= f64::EPSILON * size);
    }
    let run = go(&ball(9.81, 0.7), state(-1.0, 0.0, 0.0, 0.0), until(3.0));
    assert_eq!(run.stop_reason, StopReason::Rest);
    let [chatter]: [_; 1] = chatters(&run).try_into().unwrap();
    assert!((chatter.time - 2.558_633_965_585_807_7).abs() < 1e-13, "{}", chatter.time);
}

#[test]
fn bounces_come_when_they_should() {
    let (gravity, r): (f64, f64) = (9.8, 0.9);
    let run = go(&ball(gravity, r), state(-1.0, 0.0, 0.0, 0.0), until(5.0));
    let first = (2.0 / gravity).sqrt();
    let mut time = first;
    for (n, impact) in run.impacts.iter().enumerate() {
        assert!((impact.time - time).abs() < 1e-13 * (n + 1) as f64, "{n}: {}", impact.time);
        time += 2.0 * first * r.powi(n as i32 + 1);
    }
    assert_eq!(run.impacts.len(), 8);
}

/// A horizon among the impacts that are left out: the ball is where its bounces put it.
#[test]
fn bounces_that_are_left_out_can_still_be_seen() {
    // Accumulation at 19 t1 = 8.583.
    let (system, start) = (ball(9.8, 0.9), state(-1.0, 0.0, 0.0, 0.0));
    let whole = go(&system, start, until(9.0));
    let [chatter]: [_; 1] = chatters(&whole).try_into().unwrap();
    let first = (2.0 / 9.8f64).sqrt();
    assert!((chatter.time - 19.0 * first).abs() < 1e-13);
    for part in [0.0, 0.3, 0.77, 0.999] {
        let time = chatter.time - (1.0 - part) * chatter.time_jump;
        // The bounce that holds this time, in closed form.
        let (mut from, mut speed) = (first, 9.8 * first);
        loop {
            speed *= 0.9;
            let flight = 2.0 * speed / 9.8;
            if from + flight > time {
                break;
            }
            from += flight;
        }
        let height = (time - from) * (speed - 4.9 * (time - from));
        let cut = go(&system, start, until(time));
        assert_eq!(cut.stop_reason, StopReason::Completed);
        assert!((-cut.final_state.state.x1 - height).abs() < 1e-13, "{part} {height}");
        assert!((-whole.trajectory(&[time]).unwrap()[0][0] - height).abs() < 1e-13);
        let before = 0.5 * (cut.impacts.last().unwrap().time + time);
        assert_eq!(cut.trajectory(&[before]).unwrap(), whole.trajectory(&[before]).unwrap());
        // Going on from there gives the same bits.
        let on = cut.resume(until(9.0), &CancelToken::never()).unwrap();
        assert_eq!(on.contacts, whole.contacts);
        assert_eq!(on.final_state, whole.final_state);
    }
}

/// All bounces follow the geometric law, those that are left out after those that are listed.
#[test]
fn bounces_that_are_left_out_can_be_listed() {
    let (gravity, r): (f64, f64) = (9.8, 0.9);
    let run = go(&ball(gravity, r), state(-1.0, 0.0, 0.0, 0.0), until(9.0));
    let never = CancelToken::never();
    let bounces = run.bounces(1e-9, usize::MAX, &never);
    assert_eq!(bounces.ends, [BouncesEnd::ApproachVelocity]);
    assert_eq!(bounces.impacts[..run.impacts.len()], run.impacts);
    let skipped = |n: usize| bounces.skipped[n];
    assert!((0..bounces.impacts.len()).all(|n| skipped(n) == (n >= run.impacts.len())));
    let first = (2.0 / gravity).sqrt();
    let mut time = first;
    for (n, impact) in bounces.impacts.iter().enumerate() {
        let speed = gravity * first * r.powi(n as i32);
        assert!((impact.v1_pre / speed - 1.0).abs() < 1e-12, "{n}: {}", impact.v1_pre);
        assert!((impact.time - time).abs() < 1e-13, "{n}: {}", impact.time);
        time += 2.0 * first * r.powi(n as i32 + 1);
    }
    let last = bounces.impacts.last().unwrap().v1_pre;
    assert!(last >= 1e-9 && r * last < 1e-9, "{last:e}");
    // Without a least velocity they go on to the accumulation point, but never beyond the cap.
    let all = run.bounces(0.0, usize::MAX, &never);
    assert_eq!(all.ends, [BouncesEnd::Accumulation]);
    let few = run.bounces(0.0, 7, &never);
    assert_eq!((few.impacts.len(), few.ends), (run.impacts.len() + 7, vec![BouncesEnd::Cap]));
}

#[test]
fn a_plastic_impact_lasts() {
    let run = go(&ball(9.8, 0.0), state(-1.0, 0.0, 0.0, 0.0), until(2.0));
    assert_eq!(run.stop_reason, StopReason::Rest);
    assert_eq!(run.impacts.len(), 1);
    assert_eq!(run.impacts[0].v1_post, 0.0);
    // One impact is no chatter.
    assert_eq!(run.contacts.len(), 1);
    assert_eq!(run.contacts[0].kind, EventKind::Stick as i64);
    assert_eq!(run.contacts[0].time, run.impacts[0].time);
}

#[test]
fn an_elastic_ball_never_chatters() {
    let mut options = until(1e9);
    options.max_events = 50_000;
    let run = go(&ball(9.8, 1.0), state(-1.0, 0.0, 0.0, 0.0), options);
    assert_eq!(run.stop_reason, StopReason::EventCap);
    assert_eq!(run.impacts.len(), 50_000);
}

/// All bounces of a ball are alike, and so are their roundings: from one height in six it gains or
/// loses a rounding or two at every bounce, from the others nothing. Over many heights there is no
/// preference for either.
#[test]
fn an_elastic_ball_keeps_its_speed_to_rounding_at_every_bounce() {
    const BOUNCES: usize = 1_000;
    let mut options = until(1e9);
    options.max_events = BOUNCES as u64 + 1;
    let mut draw = Draw::new(11);
    let (mut most, mut sum) = (0f64, 0.0);
    let heights = 600;
    for _ in 0..heights {
        let height = draw.uniform(0.2, 3.0);
        let run = go(&ball(9.8, 1.0), state(-height, 0.0, 0.0, 0.0), options);
        let [first, .., last] = &run.impacts[..] else { panic!("{height}") };
        assert!((first.v1_pre / (19.6 * height).sqrt() - 1.0).abs() <= 2.0 * f64::EPSILON);
        for pair in run.impacts.windows(2) {
            most = most.max((pair[1].v1_pre / pair[0].v1_pre - 1.0).abs());
        }
        sum += last.v1_pre / first.v1_pre - 1.0;
    }
    let mean = sum / f64::from(heights) / BOUNCES as f64;
    println!("{:.2} eps at most, {:.3} on average", most / f64::EPSILON, mean / f64::EPSILON);
    // The two terms of the rate are rounded, and those of the gap, twice as large, that give the
    // instant.
    assert!(most <= 4.0 * f64::EPSILON, "{most:e}");
    // The average of 600 drifts of standard deviation 0.5 eps has 0.02 itself.
    assert!(mean.abs() <= 0.08 * f64::EPSILON, "{mean:e}");
}

#[test]
fn low_bounces_of_an_elastic_ball_are_not_chatter_either() {
    let mut options = until(1e9);
    options.max_events = 10_000;
    let run = go(&ball(9.8, 1.0), state(-1e-10, 0.0, 0.0, 0.0), options);
    assert_eq!(run.stop_reason, StopReason::EventCap);
}

/// An end that is not asked for: nothing will ever happen again.
#[test]
fn a_run_without_an_end_stops_at_rest() {
    let run = go(
        &ball(9.8, 0.5),
        state(-1.0, 0.0, 0.0, 0.0),
        RunOptions::until(vibroimpact::Horizon::Impacts { count: 1000, max_time: 1e6 }),
    );
    assert_eq!(run.stop_reason, StopReason::Rest);
    assert!((run.final_state.time - 1.355_261_854_357_876_7).abs() < 1e-13);
}

/// The stated error of a completion against the same chatter bounce by bounce, down to bounces that
/// rounding swallows (a tolerance that no extrapolation meets).
fn worst_ratio(system: &System, start: State, periods: i64, tolerance: f64) -> (f64, usize) {
    let with = |tolerance: f64| {
        let mut options = RunOptions::periods(periods);
        options.chatter_tolerance = tolerance;
        go(system, start, options)
    };
    let (loose, exact) = (with(tolerance), with(1e-18));
    // Later contacts inherit the errors of the first, so only that is compared.
    let (Some(a), Some(b)) = (chatters(&loose).first().copied(), chatters(&exact).first().copied())
    else {
        return (0.0, 0);
    };
    assert_eq!(loose.impacts[0], exact.impacts[0]);
    let before = loose.impacts.iter().filter(|i| i.time < a.time).count();
    assert_eq!(loose.impacts[..before], exact.impacts[..before]);
    let difference = [a.time - b.time, a.x1 - b.x1, a.v1 - b.v1, a.x2 - b.x2, a.v2 - b.v2]
        .iter()
        .fold(0.0, |most: f64, d| most.max(d.abs()));
    (difference / (a.error + b.error), 1)
}

#[test]
fn the_stated_error_of_a_completion_holds() {
    for tolerance in [1e-7, 1e-12] {
        let (mut worst, mut compared): (f64, usize) = (0.0, 0);
        for omega in [0.22, 0.25, 0.3, 0.35, 0.4, 0.45] {
            for r in [0.05, 0.3, 0.8, 0.95] {
                let system = chattering(omega).restitution(r).build().unwrap();
                let (ratio, n) = worst_ratio(&system, paper_start(), 2, tolerance);
                (worst, compared) = (worst.max(ratio), compared + n);
            }
        }
        let mut draw = Draw::new(7);
        for _ in 0..300 {
            let system = draw.system().with("drive_frequency", draw.uniform(0.1, 0.5)).unwrap();
            let system = system.with("restitution", draw.uniform(0.0, 0.95)).unwrap();
            let start = draw.start(&system);
            let (ratio, n) = worst_ratio(&system, start, 10, tolerance);
            (worst, compared) = (worst.max(ratio), compared + n);
        }
        println!("tolerance {tolerance:e}: at worst {worst} of the error, {compared} chatters");
        assert!(compared > 150);
        assert!(worst <= 1.0, "{worst}");
    }
}

//! Complete chatter on the bouncing ball, whose every bounce is known (DiffEqDocs; FMI reference
//! FMU BouncingBall): with fall acceleration f1, drop height 1 and t1 = sqrt(2/f1) the n-th impact
//! comes at t1 (1 + 2 (r + ... + r^(n-1))), the bounces accumulate at t1 (1 + r)/(1 - r).

use vibroimpact::tolerance::CHATTER_IMPACTS;
use vibroimpact::{RunOptions, StopReason, System};

use crate::{ball, go, paper, paper_start, state, until};

#[test]
fn a_bouncing_ball_ends_in_chatter_where_its_bounces_accumulate() {
    let run = go(&ball(9.8, 0.5), state(-1.0, 0.0, 0.0, 0.0), until(2.0));
    assert_eq!(run.stop_reason, StopReason::Chatter);
    assert_eq!(run.impacts[0].time, 0.451_753_951_452_625_6);
    for pair in run.impacts.windows(2) {
        assert!((pair[1].v1_pre - 0.5 * pair[0].v1_pre).abs() < 1e-15, "{pair:?}");
    }
    assert!(run.impacts.len() > CHATTER_IMPACTS as usize);
    // The rest of the bounces from the state at the stop: 2 u/(g'' (1 - r)).
    let last = run.impacts.last().unwrap();
    let accumulation = last.time + 2.0 * -last.v1_post / (9.8 * (1.0 - 0.5));
    assert!((accumulation - 1.355_261_854_357_876_7).abs() < 1e-13, "{accumulation}");
    assert!(run.final_state.time >= last.time && run.final_state.time <= accumulation + 1e-12);
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
    assert_eq!(run.final_state.state.to_array(), one);
    let run = go(&ball(9.81, 0.7), state(-1.0, 0.0, 0.0, 0.0), until(3.0));
    assert_eq!(run.stop_reason, StopReason::Chatter);
    let last = run.impacts.last().unwrap();
    let accumulation = last.time + 2.0 * -last.v1_post / (9.81 * (1.0 - 0.7));
    assert!((accumulation - 2.558_633_965_585_807_7).abs() < 1e-13, "{accumulation}");
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

/// Chatter that will complete is not complete: bounces of visible height must still come.
#[test]
fn bounces_before_the_accumulation_are_not_left_out() {
    // Accumulation at 19 t1 = 8.583.
    let run = go(&ball(9.8, 0.9), state(-1.0, 0.0, 0.0, 0.0), until(8.0));
    assert_eq!(run.stop_reason, StopReason::Completed);
    assert_eq!(run.final_state.time, 8.0);
    let run = go(&ball(9.8, 0.9), state(-1.0, 0.0, 0.0, 0.0), until(9.0));
    assert_eq!(run.stop_reason, StopReason::Chatter);
    assert!((run.final_state.time - 19.0 * (2.0 / 9.8f64).sqrt()).abs() < 1e-3);
}

#[test]
fn a_plastic_impact_lasts() {
    let run = go(&ball(9.8, 0.0), state(-1.0, 0.0, 0.0, 0.0), until(2.0));
    assert_eq!(run.stop_reason, StopReason::Chatter);
    assert_eq!(run.impacts.len(), 1);
    assert_eq!(run.impacts[0].v1_post, 0.0);
    assert_eq!(run.final_state.time, run.impacts[0].time);
}

#[test]
fn an_elastic_ball_never_chatters() {
    let mut options = until(1e9);
    options.max_events = 50_000;
    let run = go(&ball(9.8, 1.0), state(-1.0, 0.0, 0.0, 0.0), options);
    assert_eq!(run.stop_reason, StopReason::EventCap);
    let speed = 19.6f64.sqrt();
    let worst = run.impacts.iter().map(|i| (i.v1_pre / speed - 1.0).abs()).fold(0.0, f64::max);
    assert!(worst < 1e-11, "{worst:e}");
}

#[test]
fn low_bounces_of_an_elastic_ball_are_not_chatter_either() {
    let mut options = until(1e9);
    options.max_events = 10_000;
    let run = go(&ball(9.8, 1.0), state(-1e-10, 0.0, 0.0, 0.0), options);
    assert_eq!(run.stop_reason, StopReason::EventCap);
}

/// Tightening the tolerance must move where chatter is believed, not whether, and all the impacts
/// before it stay bit for bit.
#[test]
fn the_tolerance_only_decides_when_chatter_is_believed() {
    // Low drive: sustained contact in every period (docs/theory.md, section 5 and E8).
    let system: System = paper(0.3)
        .pendulum_damping(0.1)
        .oscillator_damping(0.1)
        .force_amplitude(1.5)
        .build()
        .unwrap();
    let with = |tolerance: f64| {
        let mut options = RunOptions::periods(600);
        options.tolerance = tolerance;
        go(&system, paper_start(), options)
    };
    let (loose, usual, tight) = (with(1e-6), with(1e-12), with(1e-14));
    for run in [&loose, &usual, &tight] {
        assert_eq!(run.stop_reason, StopReason::Chatter);
    }
    assert!(loose.impacts.len() < usual.impacts.len());
    assert!(usual.impacts.len() <= tight.impacts.len());
    assert_eq!(loose.impacts, usual.impacts[..loose.impacts.len()]);
    assert_eq!(usual.impacts, tight.impacts[..usual.impacts.len()]);
    let end = tight.final_state.time;
    assert!((usual.final_state.time - end).abs() < 1e-4);
    // u shrinks by r to leading order.
    let tail = &usual.impacts[usual.impacts.len() - 4..];
    for pair in tail.windows(2) {
        let u = pair.iter().map(|i| i.v1_pre * i.x1.cos() - i.v2_pre).collect::<Vec<_>>();
        assert!((u[1] / u[0] - 0.8).abs() < 1e-3, "{u:?}");
    }
}

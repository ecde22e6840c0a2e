//! Labels of random systems against those found with twice the periods (docs/definitions of the
//! label: m drive periods, n impacts per orbit, or why none).

use vibroimpact::{RunOptions, StopReason};

use crate::{Draw, go};

fn explore(periods: i64, keep: i64) {
    let mut draw = Draw::new(30);
    let mut mismatches = 0;
    let mut kinds = std::collections::BTreeMap::new();
    let begin = std::time::Instant::now();
    for i in 0..200 {
        let system = draw.system();
        let start = draw.start(&system);
        let run = go(&system, start, RunOptions::periods(periods).keep(keep));
        let twice = go(&system, start, RunOptions::periods(2 * periods).keep(2*keep));
        if run.stop_reason != StopReason::Completed || twice.stop_reason != StopReason::Completed {
            *kinds.entry(format!("{}/{}", run.stop_reason.name(), twice.stop_reason.name())).or_insert(0) += 1;
            continue;
        }
        let (a, b) = (run.period(), twice.period());
        let class = |l: String| if l.contains('-') && l != "quasi-periodic" { "periodic".into() } else { l };
        *kinds.entry(class(a.label())).or_insert(0) += 1;
        if a.label() != b.label() {
            mismatches += 1;
            println!("{i}: {} (res {:.2e} rate {:.6} conf {:.2} {} {:?}) / {} (res {:.2e} rate {:.6} {:.2} {} {:?}) z1 {:.4} z2 {:.4} mu {:.3} r {:.3}", a.label(), a.residual, a.rate, a.confidence, a.method, a.growth, b.label(), b.residual, b.rate, b.confidence, b.method, b.growth, system.pendulum_damping(), system.oscillator_damping(), system.friction(), system.restitution());
        }
    }
    println!("N {periods} K {keep}: {mismatches} mismatches, {kinds:?}, {:.1} s", begin.elapsed().as_secs_f64());
}

#[test]
fn explore_labels() {
    explore(600, 100);
    explore(600, 300);
    explore(1000, 1000);
}

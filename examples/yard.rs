//! scratch: G and costs per period
#![allow(missing_docs, clippy::unwrap_used)]
use std::hint::black_box;
use std::time::Instant;
use vibroimpact::*;
fn g_kernel(n: usize) -> f64 {
    // free motions of both bodies, forcing, x1; two exponentials
    let (w1, w2, om, c1, c2) = (1.99, 0.999, 1.545, 0.02, 0.01);
    let (a1, b1, a2, b2, p1, q1) = (0.3, 0.2, 0.1, -0.4, 0.5, 0.01);
    let mut acc = 0.0;
    let mut s = 0.0f64;
    for _ in 0..n {
        s = black_box(s + 1e-3);
        let (s1, k1) = (w1 * s).sin_cos();
        let (s2, k2) = (w2 * s).sin_cos();
        let (so, ko) = (om * s).sin_cos();
        let (e1, e2) = ((-c1 * s).exp(), (-c2 * s).exp());
        let x1 = e1 * (a1 * k1 + b1 * s1) + p1 * ko + q1 * so;
        let v1 =
            e1 * ((b1 * w1 - c1 * a1) * k1 - (a1 * w1 + c1 * b1) * s1) + om * (q1 * ko - p1 * so);
        let x2 = e2 * (a2 * k2 + b2 * s2);
        let v2 = e2 * ((b2 * w2 - c2 * a2) * k2 - (a2 * w2 + c2 * b2) * s2);
        let (sx, cx) = x1.sin_cos();
        acc += black_box(sx - x2 - 0.5) + black_box(v1 * cx - v2);
    }
    acc
}
fn cpu() -> f64 {
    let s = std::fs::read_to_string("/proc/thread-self/schedstat").unwrap();
    s.split(' ').next().unwrap().parse::<f64>().unwrap() * 1e-9
}
fn time<F: FnMut()>(mut f: F) -> f64 {
    let _ = Instant::now();
    let t = cpu();
    f();
    cpu() - t
}
fn paper(w: f64) -> SystemBuilder {
    System::builder()
        .mass_ratio(0.6)
        .frequency_ratio(2.0)
        .restitution(0.8)
        .gap(0.5)
        .drive_frequency(w)
        .moment_amplitude(1.0)
}
fn main() {
    let start = State::new(0.0, 0.5, 0.0, 0.0).unwrap();
    let fig7 = |w: f64| {
        paper(w).restitution(0.3).pendulum_damping(0.1).oscillator_damping(0.1).force_amplitude(1.5)
    };
    let sweeps: Vec<(&str, Vec<System>)> = vec![
        ("fig4", (0..400).map(|i| paper(0.2 + 3.8 * i as f64 / 399.0).build().unwrap()).collect()),
        (
            "8b-like mu.5",
            (0..400)
                .map(|i| paper(0.2 + 3.8 * i as f64 / 399.0).friction(0.5).build().unwrap())
                .collect(),
        ),
        (
            "7b-like",
            (0..200)
                .map(|i| fig7(0.6 + 2.4 * i as f64 / 199.0).restitution(0.8).build().unwrap())
                .collect(),
        ),
    ];
    for _ in 0..3 {
        let n = 200_000;
        let g = time(|| {
            black_box(g_kernel(n));
        }) / n as f64;
        print!("G {:.1} ns ", g * 1e9);
        for (name, systems) in &sweeps {
            let mut impacts = 0u64;
            let mut evals = 0u64;
            let t = time(|| {
                for s in systems {
                    let mut sim = Simulation::new(s, start).unwrap().until(Horizon::Periods(600));
                    while let Some(e) = sim.next() {
                        black_box(e.unwrap());
                    }
                    impacts += sim.impact_count();
                    evals += sim.evaluations();
                }
            });
            let per = systems.len() as f64 * 600.0;
            print!(
                "| {name}: {:.2} G/period {:.0} ns, impacts/period {:.2}, evals/impact {:.2} ",
                t / per / g,
                t / per * 1e9,
                impacts as f64 / per,
                evals as f64 / impacts as f64
            );
        }
        println!();
    }
}

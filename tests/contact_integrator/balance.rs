//! Balances of the contact phase along `Run::trajectory` and `Run::contact_forces`
//! (docs/theory.md, section 5): with normal force p and friction q
//!
//! x1'' = a1 - p cos x1 + q sin x1, x2'' = a2 + mbar p,
//!
//! so over any interval the forces change the velocities, the velocities the displacements, and
//! the power of all but p, which does none, the energy x1'^2/2 + x2'^2/(2 mbar).

use std::f64::consts::PI;

use vibroimpact::{Contact, System};

use super::{HORIZON, cases};

/// |g| and |g'| in contact, in units of EPS times their terms: x2 and x2' are set from g = g' = 0,
/// with one rounding per operation.
const CONSTRAINT: f64 = 1.0;
/// Balances over an interval, relative to the largest of their terms or 1: 2e-15 is measured.
const BALANCE: f64 = 1e-14;
/// Intervals are no longer than this: sixteen nodes then integrate to rounding.
const PIECE: f64 = 0.125;

/// Nodes in (0, 1) and weights of Gauss-Legendre's rule, by Newton's steps on the recursion of the
/// Legendre polynomials.
fn gauss_legendre(n: usize) -> Vec<(f64, f64)> {
    let node = |i: usize| {
        let mut x = (PI * (i as f64 + 0.75) / (n as f64 + 0.5)).cos();
        for _ in 0..8 {
            x -= legendre(n, x).0 / legendre(n, x).1;
        }
        let slope = legendre(n, x).1;
        ((1.0 - x) / 2.0, 1.0 / ((1.0 - x * x) * slope * slope))
    };
    (0..n).map(node).collect()
}

/// Legendre polynomial and its derivative.
fn legendre(n: usize, x: f64) -> (f64, f64) {
    let (mut before, mut now) = (1.0, x);
    for k in 2..=n {
        let k = k as f64;
        (before, now) = (now, ((2.0 * k - 1.0) * x * now - (k - 1.0) * before) / k);
    }
    (now, n as f64 * (x * now - before) / (x * x - 1.0))
}

#[test]
fn forces_and_velocities_balance_in_contact() {
    let rule = gauss_legendre(16);
    let (mut worst, mut constraint, mut intervals) = (0.0f64, 0.0f64, 0);
    for (case, changes) in cases(22, 300) {
        let system = &case.system;
        let run = case.run(HORIZON);
        let m = system.mass_ratio();
        for pair in changes.windows(2) {
            let (from, to) = (pair[0].time, pair[1].time);
            let pieces = ((to - from) / PIECE).ceil() as usize;
            let at = |i: usize| from + (to - from) * i as f64 / pieces as f64;
            for piece in 0..pieces {
                // The end of a phase belongs to what follows: states are continuous there.
                let (a, b) = (at(piece), at(piece + 1).min(to));
                let times: Vec<f64> = rule.iter().map(|(x, _)| a + (b - a) * x).collect();
                let states = run.trajectory(&times).unwrap();
                let forces = run.contact_forces(&times).unwrap();
                let ends = run.trajectory(&[a, b]).unwrap();
                // |sin x1| has a kink that the rule does not see.
                if system.friction() > 0.0 && ends[0][0].sin() * ends[1][0].sin() <= 0.0 {
                    continue;
                }
                let mut sums = [0.0; 5];
                let mut sizes = [0.0f64; 5];
                for (((time, state), force), (_, weight)) in
                    times.iter().zip(&states).zip(&forces).zip(&rule)
                {
                    let rates = rates(system, *time, state, force.normal, force.tangential);
                    for (i, rate) in rates.into_iter().enumerate() {
                        sums[i] += (b - a) * weight * rate;
                        sizes[i] = sizes[i].max((b - a) * rate.abs());
                    }
                    constraint = constraint.max(constraint_error(system, state));
                }
                let energy = |s: &[f64; 4]| 0.5 * s[1] * s[1] + 0.5 * s[3] * s[3] / m;
                for i in 0..5 {
                    let value = |s: &[f64; 4]| if i < 4 { s[i] } else { energy(s) };
                    let (before, after) = (value(&ends[0]), value(&ends[1]));
                    let size = sizes[i].max(before.abs()).max(after.abs()).max(1.0);
                    worst = worst.max((after - before - sums[i]).abs() / size);
                }
                intervals += 1;
            }
        }
    }
    println!("{intervals} intervals, worst imbalance {worst:e}, |g|, |g'| {constraint} EPS");
    assert!(intervals > 3000);
    assert!(worst <= BALANCE, "{worst:e}");
    assert!(constraint <= CONSTRAINT, "{constraint}");
}

/// Rates of x1, x1', x2, x2' and energy under the contact forces.
fn rates(system: &System, time: f64, state: &[f64; 4], normal: f64, tangential: f64) -> [f64; 5] {
    let [x1, v1, x2, v2] = *state;
    let load = (system.drive_frequency() * time + system.phase()).cos();
    let w = system.frequency_ratio();
    let a1 = system.moment_amplitude() * load + system.static_moment()
        - 2.0 * system.pendulum_damping() * w * v1
        - w * w * x1;
    let a2 = system.force_amplitude() * load + system.static_force()
        - 2.0 * system.oscillator_damping() * v2
        - x2;
    let (sin, cos) = match system.contact() {
        Contact::Direct => (0.0, 1.0),
        _ => x1.sin_cos(),
    };
    let power = v1 * (a1 + tangential * sin) + v2 * a2 / system.mass_ratio();
    let (pendulum, oscillator) =
        (a1 - normal * cos + tangential * sin, a2 + system.mass_ratio() * normal);
    [v1, pendulum, v2, oscillator, power]
}

/// The larger one of |g| and |g'|, in units of EPS times their terms.
fn constraint_error(system: &System, state: &[f64; 4]) -> f64 {
    let [x1, v1, x2, v2] = *state;
    let (tip, slope) = match system.contact() {
        Contact::Direct => (x1, 1.0),
        _ => (x1.sin(), x1.cos()),
    };
    let gap = (tip - x2 - system.gap()).abs() / (tip.abs() + x2.abs() + system.gap().abs());
    let rate = (v1 * slope - v2).abs() / (v1.abs() + v2.abs()).max(f64::MIN_POSITIVE);
    gap.max(rate) / f64::EPSILON
}

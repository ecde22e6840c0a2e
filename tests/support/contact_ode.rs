//! The contact phase by a general integrator: DOP853 with dense output and events of the crate
//! `differential-equations`, the other party of `tests/contact_integrator.rs` and
//! `benches/contact_phase.rs`.
//!
//! Written from docs/theory.md, section 5: with a1, a2 the free accelerations on x2 = sin x1 - gap
//! (direct: x1 - gap), s the direction of slip and k = cos x1 + mu s |sin x1|,
//!
//! * slide: p = (a1 cos x1 - x1'^2 sin x1 - a2)/(mbar + k cos x1), x1'' = a1 - k p, until p falls
//!   through 0 (release) or, with friction, x1' reaches 0 (stop);
//! * stop: p_s = -a2/mbar; g'' < 0: release; p_s >= 0 and |a1 - p_s cos x1| <= mu p_s |sin x1|:
//!   stick; else slide with s = sgn(a1 - p_s cos x1);
//! * stick: until the cone is left.
//!
//! mbar > 0 and no Painleve point are taken for granted.

use differential_equations::control::ControlFlag;
use differential_equations::interpolate::Interpolation;
use differential_equations::ode::ODE;
use differential_equations::prelude::{ExplicitRungeKutta, IVP};
use differential_equations::solout::{CrossingDirection, Event, EventConfig, EventSolout, Solout};
use differential_equations::solution::Solution;
use vibroimpact::{Contact, System};

/// Place on the contact; `mode` is what follows: direction of slip, 0 for stick, none for flight.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Change {
    pub time: f64,
    pub x1: f64,
    pub v1: f64,
    pub mode: Option<f64>,
}

/// How events are located.
#[allow(dead_code)] // the test needs the best one only
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Events {
    /// By the crate itself, which says: Brent's method on the dense output, to 1e-12.
    Crate,
    /// On the crate's dense output, by false position, where a step's ends differ in sign.
    Dense,
    /// From there by Newton's steps, each integrated anew from the start of the step; with so many
    /// looks into every step, for a limit that falls through 0 and comes back within one.
    Polished(u32),
}

/// Step by which Newton's slope is taken: good to some ten digits.
const SLOPE_STEP: f64 = 1e-5;
/// Two would do.
const NEWTON_STEPS: u32 = 3;
/// Looks per drive period for the end of a stick.
const STICK_LOOKS: u32 = 4096;

/// Forces at one instant of the contact.
struct Forces {
    a1: f64,
    a2: f64,
    sin: f64,
    cos: f64,
    /// Numerator of p: the free gap acceleration.
    free: f64,
}

fn forces(system: &System, t: f64, [x, v]: [f64; 2]) -> Forces {
    let load = (system.drive_frequency() * t + system.phase()).cos();
    let w = system.frequency_ratio();
    let (sin, cos, tip) = match system.contact() {
        Contact::Direct => (0.0, 1.0, x),
        _ => (x.sin(), x.cos(), x.sin()),
    };
    let a1 = system.moment_amplitude() * load + system.static_moment()
        - 2.0 * system.pendulum_damping() * w * v
        - w * w * x;
    let a2 = system.force_amplitude() * load + system.static_force()
        - 2.0 * system.oscillator_damping() * v * cos
        - (tip - system.gap());
    Forces { a1, a2, sin, cos, free: a1 * cos - v * v * sin - a2 }
}

/// One slide on one side of sin x1 = 0, where |sin x1| = side * sin x1.
struct Slide<'a> {
    system: &'a System,
    start: f64,
    direction: f64,
    side: f64,
}

/// Time, state and number of the limit.
type End = (f64, [f64; 2], usize);

impl Slide<'_> {
    /// k and p.
    fn contact(&self, f: &Forces) -> (f64, f64) {
        let k = f.cos + self.system.friction() * self.direction * self.side * f.sin;
        (k, f.free / (self.system.mass_ratio() + k * f.cos))
    }

    /// What ends the slide where it falls through 0: p, and with friction s x1' and |sin x1|.
    fn limits(&self, t: f64, y: &[f64; 2]) -> [f64; 3] {
        let f = forces(self.system, t, *y);
        let (_, p) = self.contact(&f);
        if self.system.friction() == 0.0 {
            return [p, f64::INFINITY, f64::INFINITY];
        }
        [p, self.direction * y[1], self.side * f.sin]
    }

    fn solve(&self, from: f64, start: [f64; 2], to: f64, tolerance: f64) -> [f64; 2] {
        let solver = ExplicitRungeKutta::dop853().rtol(tolerance).atol(tolerance);
        let solution = IVP::ode(self, from, to, start).method(solver).solve().unwrap();
        *solution.y.last().unwrap()
    }

    /// The end of the slide; `None` if nothing ends it up to `horizon`.
    fn end(&self, from: &Change, horizon: f64, tolerance: f64, events: Events) -> Option<End> {
        let solver = ExplicitRungeKutta::dop853().rtol(tolerance).atol(tolerance);
        let problem = IVP::ode(self, from.time, horizon, [from.x1, from.v1]).method(solver);
        let solution = if events == Events::Crate {
            problem.solout(EventSolout::new(self, from.time, horizon)).solve()
        } else {
            let looks = if let Events::Polished(looks) = events { looks } else { 1 };
            problem.solout(FalsePosition { slide: self, looks }).solve()
        }
        .unwrap();
        // Before it, without the crate's own events, the start of the step.
        let (mut time, mut state) = (*solution.t.last()?, *solution.y.last()?);
        let limits = self.limits(time, &state).map(f64::abs);
        let which = (0..3).min_by(|&i, &j| limits[i].total_cmp(&limits[j])).unwrap();
        if matches!(events, Events::Polished(_)) {
            for _ in 0..NEWTON_STEPS {
                let mut rate = [0.0; 2];
                self.diff(time, &state, &mut rate);
                let beside = |h: f64| {
                    let y = [state[0] + h * rate[0], state[1] + h * rate[1]];
                    self.limits(time + h, &y)[which]
                };
                let slope = (beside(SLOPE_STEP) - beside(-SLOPE_STEP)) / (2.0 * SLOPE_STEP);
                time -= self.limits(time, &state)[which] / slope;
                state = self.solve(solution.t[0], solution.y[0], time, tolerance);
            }
        }
        Some((time, state, which))
    }
}

impl ODE<f64, [f64; 2]> for Slide<'_> {
    fn diff(&self, t: f64, y: &[f64; 2], dydt: &mut [f64; 2]) {
        let f = forces(self.system, t, *y);
        let (k, p) = self.contact(&f);
        *dydt = [y[1], f.a1 - k * p];
    }
}

impl Event<f64, [f64; 2]> for Slide<'_> {
    fn config(&self) -> EventConfig {
        EventConfig::new(CrossingDirection::Negative, Some(1))
    }

    fn event(&self, t: f64, y: &[f64; 2]) -> f64 {
        // A slide that begins at x1' = 0 or sin x1 = 0 begins on its own limit.
        if t <= self.start {
            return 1.0;
        }
        self.limits(t, y).into_iter().fold(f64::INFINITY, f64::min)
    }
}

/// Ends the integration at the first step over an event, which it locates on the dense output by
/// false position (the Illinois rule).
struct FalsePosition<'a> {
    slide: &'a Slide<'a>,
    looks: u32,
}

impl Solout<f64, [f64; 2]> for FalsePosition<'_> {
    fn solout<I: Interpolation<f64, [f64; 2]> + ?Sized>(
        &mut self,
        t: f64,
        t_prev: f64,
        y: &[f64; 2],
        y_prev: &[f64; 2],
        dense: &mut I,
        solution: &mut Solution<f64, [f64; 2]>,
    ) -> ControlFlag<f64, [f64; 2]> {
        let value_at = |time: f64, dense: &mut I| {
            let y = dense.interpolate(time).unwrap();
            self.slide.event(time, &y)
        };
        let (mut a, mut fa) = (t_prev, self.slide.event(t_prev, y_prev));
        let (mut b, mut fb) = (t, self.slide.event(t, y));
        for look in 1..self.looks {
            let time = t_prev + (t - t_prev) * f64::from(look) / f64::from(self.looks);
            let value = value_at(time, dense);
            if value <= 0.0 {
                (b, fb) = (time, value);
                break;
            }
            (a, fa) = (time, value);
        }
        if fb > 0.0 {
            return ControlFlag::Continue;
        }
        for _ in 0..100 {
            let middle = b - fb * (b - a) / (fb - fa);
            if !(middle > a.min(b) && middle < a.max(b)) {
                break;
            }
            let value = value_at(middle, dense);
            if (value > 0.0) == (fb > 0.0) {
                fa /= 2.0;
            } else {
                (a, fa) = (b, fb);
            }
            (b, fb) = (middle, value);
            if (b - a).abs() <= f64::EPSILON * b || fb == 0.0 {
                break;
            }
        }
        solution.push(t_prev, *y_prev);
        solution.push(b, dense.interpolate(b).unwrap());
        ControlFlag::Terminate
    }
}

/// mu p_s |sin x1| - |a1 - p_s cos x1|: what is left of the cone.
fn cone(system: &System, t: f64, x: f64) -> f64 {
    let f = forces(system, t, [x, 0.0]);
    let p = -f.a2 / system.mass_ratio();
    system.friction() * p * f.sin.abs() - (f.a1 - p * f.cos).abs()
}

/// What follows where x1' = 0.
fn after_stop(system: &System, t: f64, x: f64, from_stick: bool) -> Option<f64> {
    let f = forces(system, t, [x, 0.0]);
    let p = -f.a2 / system.mass_ratio();
    if f.free < 0.0 {
        None
    } else if !from_stick && p >= 0.0 && cone(system, t, x) >= 0.0 {
        Some(0.0)
    } else {
        Some((f.a1 - p * f.cos).signum())
    }
}

/// End of a stick, by looking and bisection.
fn stick_end(system: &System, from: &Change, horizon: f64) -> Option<f64> {
    let step = std::f64::consts::TAU / system.drive_frequency() / f64::from(STICK_LOOKS);
    let mut low = from.time;
    while low < horizon {
        let mut high = low + step;
        if cone(system, high, from.x1) < 0.0 {
            for _ in 0..60 {
                let middle = (low + high) / 2.0;
                if cone(system, middle, from.x1) < 0.0 { high = middle } else { low = middle }
            }
            return (high <= horizon).then_some(high);
        }
        low = high;
    }
    None
}

/// The changes of a contact phase that slides at its start, the start first, the release or the
/// place at `horizon` last.
pub fn contact_phase(
    system: &System,
    (x1, v1): (f64, f64),
    horizon: f64,
    tolerance: f64,
    events: Events,
) -> Vec<Change> {
    let mode = if v1 == 0.0 { after_stop(system, 0.0, x1, false) } else { Some(v1.signum()) };
    let mut now = Change { time: 0.0, x1, v1, mode };
    let mut changes = vec![now];
    while let Some(direction) = now.mode {
        if direction == 0.0 {
            let Some(time) = stick_end(system, &now, horizon) else {
                changes.push(Change { time: horizon, ..now });
                break;
            };
            now = Change { time, mode: after_stop(system, time, now.x1, true), ..now };
            changes.push(now);
            continue;
        }
        let (sin, cos) = now.x1.sin_cos();
        // A start on sin x1 = 0 goes to the side the tip slides to.
        let side = if sin.abs() < 1e-12 { direction * cos } else { sin };
        let slide = Slide { system, start: now.time, direction, side: side.signum() };
        let Some((time, [x1, v1], limit)) = slide.end(&now, horizon, tolerance, events) else {
            let [x1, v1] = slide.solve(now.time, [now.x1, now.v1], horizon, tolerance);
            changes.push(Change { time: horizon, x1, v1, ..now });
            break;
        };
        now = match limit {
            0 => Change { time, x1, v1, mode: None },
            1 => Change { time, x1, v1: 0.0, mode: after_stop(system, time, x1, false) },
            // The tip goes on on the other side of sin x1 = 0: no event.
            _ => {
                now = Change { time, x1, v1, mode: now.mode };
                continue;
            }
        };
        changes.push(now);
    }
    changes
}

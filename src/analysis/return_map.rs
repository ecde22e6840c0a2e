//! The return map of a motion over whole drive periods, X -> X m periods later, with its derivative;
//! and the fixed point beside a motion that settles on it.

use nalgebra::{Matrix4, Vector4};

use crate::analysis::lyapunov::{PerturbedMotion, largest_multiplier};
use crate::analysis::period::{ImpactCount, PeriodReport};
use crate::analysis::tolerances::{
    CLOSED_ORBIT, MOST_RETURN_STEPS, NEARLY_CLOSED, RETURN_RTOL, SETTLED_BEYOND,
};
use crate::model::Point;
use crate::model::state::State;
use crate::numerics::cancel::CancelToken;
use crate::simulate::Horizon;
use crate::simulate::run::Run;

/// A periodic motion.
pub(crate) struct Orbit {
    /// A run that ends on it.
    pub run: Run,
    /// Its drive periods.
    pub periods: u32,
    /// ln max|lambda|/(m T), and its change from the last point on the way to it.
    pub exponent: [f64; 2],
}

/// What Newton's method finds beside a motion.
pub(crate) enum Beside {
    /// The orbit on which the motion settles.
    Orbit(Box<Orbit>),
    /// Another orbit, or none.
    Nothing,
    /// No start: at both ends of a cycle the bodies must be apart, and its impacts be countable.
    NoStart,
}

impl Beside {
    /// The orbit, if there is one.
    pub fn orbit(self) -> Option<Orbit> {
        if let Self::Orbit(orbit) = self { Some(*orbit) } else { None }
    }
}

/// The orbit on which `run` settles, whose sections still move as `report` says: Newton's method
/// finds it from the end of the run on. It must attract, have the impacts of the report, and lie no
/// further away than sections go on that draw together by its multiplier.
pub(crate) fn orbit_beside(run: &Run, report: &PeriodReport, cancel: &CancelToken) -> Beside {
    let Some((m, ImpactCount::Finite(n))) = report.orbit else { return Beside::NoStart };
    let Ok(periods) = u32::try_from(m) else { return Beside::NoStart };
    let length = f64::from(periods) * run.system.drive_period();
    let start = Vector4::from(run.final_state.state.to_array());
    let size = start.iter().fold(1.0, |most: f64, x| most.max(x.abs()));
    let (mut point, mut before) = (start, f64::NAN);
    for step in 0..MOST_RETURN_STEPS {
        let from = State::from_array(point.into()).checked().ok().and_then(|s| run.begun_from(s));
        let turn = from.and_then(|from| Some((return_map(&from, periods, cancel)?, from)));
        let Some((Return { image, derivative, impacts }, from)) = turn else {
            return if step == 0 { Beside::NoStart } else { Beside::Nothing };
        };
        let off = image - point;
        let closed = off.amax() <= CLOSED_ORBIT * size;
        if closed || off.amax() <= NEARLY_CLOSED * size {
            let largest = largest_multiplier(&derivative);
            let exponent = largest.ln() / length;
            if closed {
                let near =
                    (point - start).amax() * (1.0 - largest) <= SETTLED_BEYOND * report.residual;
                let change = if before.is_nan() { 0.0 } else { (exponent - before).abs() };
                let change = if exponent == before { 0.0 } else { change };
                if !(largest < 1.0 && near && impacts == n) {
                    return Beside::Nothing;
                }
                let away = SETTLED_BEYOND * (point - start).amax();
                let closes = |part: &u32| {
                    run.may_close(*part as usize, away)
                        && return_map(&from, *part, cancel)
                            .is_some_and(|found| (found.image - point).amax() <= RETURN_RTOL * size)
                };
                // One that takes its turns in alternation on either side (a multiplier near -1) looks
                // like one of twice as many periods.
                let mut parts = (1..=periods / 2).filter(|part| periods.is_multiple_of(*part));
                let periods = parts.find(closes).unwrap_or(periods);
                let orbit = Orbit { run: from, periods, exponent: [exponent, change] };
                return Beside::Orbit(Box::new(orbit));
            }
            before = exponent;
        }
        let Some(by) = (derivative - Matrix4::identity()).lu().solve(&off) else { break };
        point -= by;
    }
    Beside::Nothing
}

impl Run {
    /// Whether the orbit from which the motion is so far away may close after so many periods: not if
    /// the last sections are further apart.
    fn may_close(&self, periods: usize, away: f64) -> bool {
        let mut last = self.stroboscopic.iter().rev();
        match (last.next(), last.nth(periods - 1)) {
            (Some(last), Some(before)) => last.is_within(before, away),
            _ => true,
        }
    }
}

/// What becomes of a state in some drive periods.
struct Return {
    image: Vector4<f64>,
    /// By the state.
    derivative: Matrix4<f64>,
    impacts: usize,
}

/// The return of the end of `run`.
fn return_map(run: &Run, periods: u32, cancel: &CancelToken) -> Option<Return> {
    let mut end = run.final_state.clock;
    end.period += i64::from(periods);
    let mut motion = PerturbedMotion::new(run, Horizon::Periods(end.period + 1), cancel);
    motion.advance_to(end).ok()?;
    // Perturbations are those of (x1, x1', x2', x2).
    let order = [0, 1, 3, 2];
    let derivatives = motion.derivatives();
    Some(Return {
        image: Vector4::from(motion.state().to_array()),
        derivative: Matrix4::from_fn(|r, c| derivatives[(order[r], order[c])]),
        impacts: usize::try_from(motion.impacts()).ok()?,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::analysis::lyapunov::lyapunov_spectrum;
    use crate::model::parameters::System;
    use crate::simulate::run::{RunOptions, run};

    fn settling(periods: i64) -> Run {
        // Fig. 5(c) of Han, Jin & Hu (2004): undamped, a 2-1 motion approached slowly.
        let system = System::builder()
            .mass_ratio(0.6)
            .frequency_ratio(2.0)
            .restitution(0.8)
            .gap(0.5)
            .drive_frequency(2.75)
            .moment_amplitude(1.0)
            .build()
            .unwrap();
        let start = State { x1: 0.0, v1: 0.5, x2: 0.0, v2: 0.0 };
        run(&system, start, RunOptions::periods(periods).keep(100), &CancelToken::never()).unwrap()
    }

    #[test]
    fn the_orbit_beside_a_motion_is_the_one_on_which_it_settles() {
        let never = CancelToken::never();
        let early = settling(600);
        let report = early.section_report(&never);
        assert!(report.residual > 1e-6, "{report:?}");
        let orbit = orbit_beside(&early, &report, &never).orbit().unwrap();
        let [found, expected] = [&orbit.run, &settling(6_000)].map(|run| run.final_state.state);
        for (found, expected) in found.to_array().iter().zip(expected.to_array()) {
            assert!((found - expected).abs() < 1e-10, "{found} {expected}");
        }
        let spectrum = lyapunov_spectrum(&orbit.run, 20_000, None, &never).unwrap();
        let [exponent, change] = orbit.exponent;
        assert!((exponent - spectrum.exponents[0]).abs() < 5.0 * spectrum.errors[0].max(1e-6));
        assert!(change < 1e-4 * exponent.abs(), "{change}");
    }

    #[test]
    fn an_orbit_with_other_impacts_is_not_taken() {
        let never = CancelToken::never();
        let early = settling(600);
        let report = early.section_report(&never);
        let others = PeriodReport { orbit: Some((2, ImpactCount::Finite(3))), ..report };
        assert!(matches!(orbit_beside(&early, &others, &never), Beside::Nothing));
        let far = PeriodReport { residual: 1e-9 * report.residual, ..report };
        assert!(matches!(orbit_beside(&early, &far, &never), Beside::Nothing));
    }
}

//! Derivatives of a free flight.
//!
//! With respect to the state at its start they are the matrix of the free oscillation, with respect
//! to the phase the forced response a quarter turn later. With respect to a parameter q of
//! x'' + 2 zeta w x' + w^2 x = f cos psi + c they solve the same equation from rest, forced by what the
//! parameter changes,
//!
//! ```text
//! w: -2 zeta x' - 2 w x      zeta: -2 w x'      f: cos psi      c: 1      omega: -f s sin psi,
//! ```
//!
//! which is integrated against the response to an impulse by Gauss-Legendre quadrature: the same
//! lines for every damping and at resonance, exact to rounding.

use super::{Dual, DualState, Model, Moment};
use crate::flight::{BodyFlight, Oscillator, Trig, Turn};
use crate::model::oblique::Body;
use crate::numerics::double_double::DoubleDouble;
use crate::numerics::dual::Number;
use crate::numerics::quadrature::PANEL_ANGLE;
use crate::numerics::quadrature::{PANEL, SHORT_PANEL};
use crate::tangent::tolerances::MOST_PANELS;

/// State after time `s` of free flight from `moment`.
pub(crate) fn fly(model: &Model, state: &DualState, moment: &Moment, s: Dual) -> DualState {
    let (p, motion) = (&model.parameters, &model.motion);
    let (start, angle) = model.phase(moment);
    let turn = motion.drive.turned_far(start, DoubleDouble::new(s.value));
    let forcing = Forcing { start, angle, turn };
    let (x1, v1) =
        fly_body(model, &motion.pendulum, &p.pendulum(), (state.x1, state.v1), &forcing, s);
    let (x2, v2) = if model.wall_at_rest {
        (model.wall_place(), Dual::constant(0.0))
    } else {
        fly_body(model, &motion.oscillator, &p.oscillator(), (state.x2, state.v2), &forcing, s)
    };
    DualState { x1, v1, x2, v2 }
}

/// The forcing during a flight.
struct Forcing {
    /// Phase at the start.
    start: Trig,
    /// Phase at the start as an angle, with derivatives.
    angle: Dual,
    /// From the start to the end.
    turn: Turn,
}

fn fly_body(
    model: &Model,
    oscillator: &Oscillator,
    body: &Body<Dual>,
    (x, v): (Dual, Dual),
    &Forcing { start, angle, ref turn }: &Forcing,
    s: Dual,
) -> (Dual, Dual) {
    let drive = &model.motion.drive;
    let elapsed = DoubleDouble::new(s.value);
    let flight = oscillator.flight(x.value, v.value, start);
    let (end, rate) = oscillator.after(&flight, x.value, elapsed, turn);
    let values = values(body);
    let acceleration = values.acceleration(end, rate, turn.phase.cos);
    let [[xx, xv], [vx, vv]] = oscillator.transition(elapsed);
    // The response to -f sin psi alone, from rest.
    let (shift, shift_rate) = if angle.is_constant() || values.amplitude == 0.0 {
        (0.0, 0.0)
    } else {
        let ahead = Trig { cos: -start.sin, sin: start.cos };
        let turn = drive.turned_far(ahead, elapsed);
        oscillator.without_constant(|driven| {
            driven.after(&driven.flight(0.0, 0.0, ahead), 0.0, elapsed, &turn)
        })
    };
    let omega = model.parameters.drive_frequency;
    let varied = [body.natural, body.damping, body.amplitude, body.constant, omega];
    let [of_w, of_zeta, of_f, of_c, of_omega] = if varied.iter().all(Dual::is_constant) {
        [[0.0; 2]; 5]
    } else {
        parameter_derivatives(model, oscillator, &values, &flight, (x.value, start), s.value)
    };
    let chain = |value: f64, i: usize, [to_x, to_v, to_s, to_angle]: [f64; 4]| {
        Dual::chain(
            value,
            [
                (to_x, x),
                (to_v, v),
                (to_s, s),
                (to_angle, angle),
                (of_w[i], body.natural),
                (of_zeta[i], body.damping),
                (of_f[i], body.amplitude),
                (of_c[i], body.constant),
                (of_omega[i], omega),
            ],
        )
    };
    (chain(end, 0, [xx, xv, rate, shift]), chain(rate, 1, [vx, vv, acceleration, shift_rate]))
}

fn values(body: &Body<Dual>) -> Body<f64> {
    let &Body { natural, damping, amplitude, constant } = body;
    Body {
        natural: natural.value,
        damping: damping.value,
        amplitude: amplitude.value,
        constant: constant.value,
    }
}

/// Derivatives of displacement and rate after `time` with respect to w, zeta, f, c, omega.
fn parameter_derivatives(
    model: &Model,
    oscillator: &Oscillator,
    body: &Body<f64>,
    flight: &BodyFlight,
    (x, start): (f64, Trig),
    time: f64,
) -> [[f64; 2]; 5] {
    let drive = &model.motion.drive;
    let &Body { natural: w, damping: zeta, amplitude: f, .. } = body;
    let fastest = drive.omega.max(body.fastest_rate()).max(1.0);
    let panels = (time * fastest / PANEL_ANGLE).ceil().max(1.0);
    if panels > MOST_PANELS {
        return [[f64::NAN; 2]; 5];
    }
    #[allow(clippy::cast_sign_loss)] // at least 1
    let panels = panels as usize;
    let length = time / panels as f64;
    let short = time * fastest <= PANEL_ANGLE / 6.0;
    let quadrature: &[(f64, f64)] = if short { &*SHORT_PANEL } else { &*PANEL };
    let mut sums = [[0.0; 2]; 5];
    for panel in 0..panels {
        for &(node, weight) in quadrature {
            let s = (panel as f64 + node) * length;
            let turn = drive.turned_far(start, DoubleDouble::new(s));
            let (x, v) = oscillator.after(flight, x, DoubleDouble::new(s), &turn);
            let [[_, response], [_, rate]] = oscillator.transition(DoubleDouble::new(time - s));
            let sources = [
                -2.0 * (zeta * v + w * x),
                -2.0 * w * v,
                turn.phase.cos,
                1.0,
                -f * s * turn.phase.sin,
            ];
            for (sum, source) in sums.iter_mut().zip(sources) {
                sum[0] += weight * length * source * response;
                sum[1] += weight * length * source * rate;
            }
        }
    }
    sums
}

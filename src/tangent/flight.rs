//! Derivatives of a free flight.
//!
//! With respect to the state at its start they are the matrix of the free oscillation, with respect
//! to the phase the forced response a quarter turn later; with respect to the numbers of the equation of
//! motion they are in `equation`.

use pulp::NullaryFnOnce;
use smallvec::SmallVec;

use super::equation::{ByEquation, Coefficient, Pair, Steps, by_phase};
use super::{Dual, DualState, Model, Moment};
use crate::flight::{Oscillator, Trig, Turn};
use crate::model::oblique::Body;
use crate::numerics::double_double::DoubleDouble;
use crate::numerics::dual::Number;
use crate::numerics::lanes::narrow;

/// State after time `s` of free flight from `moment`.
pub(crate) fn fly(model: &Model, state: &DualState, moment: &Moment, s: Dual) -> DualState {
    let (p, motion) = (&model.parameters, &model.motion);
    let (start, angle) = model.phase(moment);
    let turn = motion.drive.turned_far(start, DoubleDouble::new(s.value));
    let forcing = Forcing { start, angle, turn };
    let (x1, v1) =
        fly_body(model, (&motion.pendulum, 0), &p.pendulum(), (state.x1, state.v1), &forcing, s);
    let (x2, v2) = if model.wall_at_rest {
        (model.wall_place(), Dual::constant(0.0))
    } else {
        fly_body(model, (&motion.oscillator, 1), &p.oscillator(), (state.x2, state.v2), &forcing, s)
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
    (oscillator, number): (&Oscillator, usize),
    body: &Body<Dual>,
    (x, v): (Dual, Dual),
    &Forcing { start, angle, ref turn }: &Forcing,
    s: Dual,
) -> (Dual, Dual) {
    let elapsed = DoubleDouble::new(s.value);
    let flight = oscillator.flight(x.value, v.value, start);
    let (end, rate) = oscillator.after(&flight, x.value, elapsed, turn);
    let values = values(body);
    let acceleration = values.acceleration(end, rate, turn.phase.cos);
    let [[xx, xv], [vx, vv]] = oscillator.transition(elapsed);
    let omega = model.parameters.drive_frequency;
    let shift = if angle.is_constant() {
        [0.0; 2]
    } else {
        by_phase(oscillator, &model.motion.drive, start, elapsed)
    };
    let (by_f, by_c) = (!body.amplitude.is_constant(), !body.constant.is_constant());
    let loads = (by_f || by_c).then(|| Loads::new(&values, omega.value, model.motion.span));
    let [of_f, of_c] =
        loads.map_or([[0.0; 2]; 2], |loads| [loads.driven(elapsed, turn), loads.loaded(elapsed)]);
    let found = narrow(Equation {
        steps: &model.steps[number],
        from: (x.value, v.value),
        start,
        time: s.value,
    });
    let by_equation = found.unwrap_or(ByEquation::NONE);
    let [of_w, of_zeta, of_omega] =
        [Coefficient::Natural, Coefficient::Damping, Coefficient::Omega]
            .map(|coefficient| by_equation.of(coefficient));
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
    (chain(end, 0, [xx, xv, rate, shift[0]]), chain(rate, 1, [vx, vv, acceleration, shift[1]]))
}

/// [`Steps::after`].
struct Equation<'a> {
    steps: &'a Steps,
    from: (f64, f64),
    start: Trig,
    time: f64,
}

impl NullaryFnOnce for Equation<'_> {
    type Output = Option<ByEquation>;

    #[inline(always)]
    #[allow(clippy::inline_always)] // compiled for several instruction sets
    fn call(self) -> Self::Output {
        self.steps.after(self.from, self.start, self.time)
    }
}

/// What legs need of a body's equation where its numbers carry these derivatives.
pub(super) fn steps<const N: usize>(body: &Body<Dual<N>>, omega: Dual<N>) -> Steps {
    let driven = body.amplitude.value != 0.0 && !omega.is_constant();
    let all = [
        (Coefficient::Natural, !body.natural.is_constant()),
        (Coefficient::Damping, !body.damping.is_constant()),
        (Coefficient::Omega, driven),
    ];
    let wanted: SmallVec<[_; 3]> =
        all.into_iter().filter_map(|(coefficient, varies)| varies.then_some(coefficient)).collect();
    Steps::new(&values(body), omega.value, &wanted)
}

fn values<const N: usize>(body: &Body<Dual<N>>) -> Body<f64> {
    let &Body { natural, damping, amplitude, constant } = body;
    Body {
        natural: natural.value,
        damping: damping.value,
        amplitude: amplitude.value,
        constant: constant.value,
    }
}

/// One body under a drive of amplitude 1, and under a constant load of 1.
#[derive(Debug, Clone)]
struct Loads {
    drive: Oscillator,
    constant: Oscillator,
}

impl Loads {
    /// Of a body driven at `omega`, for local flights of at most `span`.
    fn new(body: &Body<f64>, omega: f64, span: f64) -> Self {
        let under = |amplitude: f64, constant: f64| {
            Oscillator::new(&Body { amplitude, constant, ..*body }, omega, span)
        };
        Self { drive: under(1.0, 0.0), constant: under(0.0, 1.0) }
    }

    /// The motion from rest under the drive, after the time of this turn.
    fn driven(&self, elapsed: DoubleDouble, turn: &Turn) -> Pair {
        let rest = self.drive.flight(0.0, 0.0, turn.start);
        self.drive.after(&rest, 0.0, elapsed, turn).into()
    }

    /// The motion from rest under the constant load.
    fn loaded(&self, elapsed: DoubleDouble) -> Pair {
        let rest = self.constant.flight(0.0, 0.0, Trig::ONE);
        self.constant.after(&rest, 0.0, elapsed, &Turn::STILL).into()
    }
}

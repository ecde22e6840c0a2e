//! Derivatives of one body's free flight by the numbers of its equation of motion,
//! x'' + 2 zeta w x' + w^2 x = f cos psi + c.
//!
//! They solve the same equation from rest, forced by what the number changes,
//!
//! ```text
//! f: cos psi      c: 1      psi: -f sin psi      w: -2 zeta x' - 2 w x      zeta: -2 w x'
//! omega: -f s sin psi.
//! ```
//!
//! The first three are flights from rest under another load, in closed form ([`Loads`]). The sources
//! of the others are flights themselves: all are summed together as Taylor series, step by step
//! ([`by_equation`]), the same lines for every damping, at resonance, and for short times.

use crate::flight::{Drive, Oscillator, Trig, Turn};
use crate::model::oblique::Body;
use crate::numerics::double_double::DoubleDouble;
use crate::tangent::tolerances::{LEAST_TERM, LONGEST_STEP, MOST_STEPS};

/// Displacement and rate.
pub(super) type Pair = [f64; 2];

/// One body under a drive of amplitude 1, and under a constant load of 1.
#[derive(Debug, Clone)]
pub(super) struct Loads {
    drive: Oscillator,
    constant: Oscillator,
}

impl Loads {
    /// Of a body driven at `omega`, for local flights of at most `span`.
    pub fn new(body: &Body<f64>, omega: f64, span: f64) -> Self {
        let under = |amplitude: f64, constant: f64| {
            Oscillator::new(&Body { amplitude, constant, ..*body }, omega, span)
        };
        Self { drive: under(1.0, 0.0), constant: under(0.0, 1.0) }
    }

    /// The motion from rest under the drive, after the time of this turn.
    pub fn driven(&self, elapsed: DoubleDouble, turn: &Turn) -> Pair {
        let rest = self.drive.flight(0.0, 0.0, turn.start);
        self.drive.after(&rest, 0.0, elapsed, turn).into()
    }

    /// The motion from rest under the constant load.
    pub fn loaded(&self, elapsed: DoubleDouble) -> Pair {
        let rest = self.constant.flight(0.0, 0.0, Trig::ONE);
        self.constant.after(&rest, 0.0, elapsed, &Turn::STILL).into()
    }
}

/// Derivatives of displacement and rate after a time by the phase of the drive at the start.
pub(super) fn by_phase(
    oscillator: &Oscillator,
    drive: &Drive,
    start: Trig,
    elapsed: DoubleDouble,
) -> Pair {
    if !oscillator.is_forced() {
        return [0.0; 2];
    }
    // The response to -f sin psi alone, from rest.
    let ahead = Trig { cos: -start.sin, sin: start.cos };
    let turn = drive.turned_far(ahead, elapsed);
    oscillator
        .without_constant(|driven| {
            driven.after(&driven.flight(0.0, 0.0, ahead), 0.0, elapsed, &turn)
        })
        .into()
}

/// Derivatives of displacement and rate after a time by w, zeta and omega.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct ByEquation {
    pub natural: Pair,
    pub damping: Pair,
    pub omega: Pair,
}

impl ByEquation {
    /// Where there are none.
    pub const NONE: Self =
        Self { natural: [f64::NAN; 2], damping: [f64::NAN; 2], omega: [f64::NAN; 2] };
}

/// Derivatives after `time` of a flight from displacement and rate, at this phase of a drive that
/// turns with `omega`; `None` for bodies so strongly damped that too many steps would be needed.
pub(super) fn by_equation(
    body: &Body<f64>,
    omega: f64,
    ((x, v), start): ((f64, f64), Trig),
    time: f64,
) -> Option<ByEquation> {
    if time == 0.0 {
        return Some(ByEquation::default());
    }
    let fastest = omega.max(body.natural).max(2.0 * body.damping * body.natural);
    let steps = (time * fastest / LONGEST_STEP).ceil().max(1.0);
    if steps.is_nan() || steps > MOST_STEPS {
        return None;
    }
    let length = time / steps;
    let mut sums = Sums { motion: [x, v], ..Sums::default() };
    let mut phase = start;
    #[allow(clippy::cast_sign_loss)] // at least 1
    let steps = steps as usize;
    for step in 0..steps {
        sums = sums.after(body, (omega, phase), step as f64 * length, (length, fastest * length));
        if step + 1 < steps {
            phase = start.turned_by(turned(omega * (length * (step + 1) as f64)));
        }
    }
    Some(sums.derivatives)
}

fn turned(angle: f64) -> Trig {
    let (sin, cos) = crate::numerics::elementary::sin_cos(angle);
    Trig { cos, sin }
}

/// A motion and its derivatives.
#[derive(Default)]
struct Sums {
    motion: Pair,
    derivatives: ByEquation,
}

impl Sums {
    /// After a step of time `h`, which begins at the time `before` since the start of the flight.
    /// Time is counted in steps, so that every coefficient is a term; none turns or decays faster than
    /// by the angle `most` in a step.
    fn after(
        &self,
        body: &Body<f64>,
        (omega, phase): (f64, Trig),
        before: f64,
        (h, most): (f64, f64),
    ) -> Self {
        let ByEquation { natural, damping, omega: by_omega } = self.derivatives;
        let square = h * h;
        let (turn, decay) = (body.natural * h, 2.0 * body.damping * body.natural * h);
        let stiffness = turn * turn;
        let force = body.amplitude * square;
        // Two terms each, the n-th and the one after it, of the motion and its derivatives.
        let begin = |[x, v]: Pair| [x, v * h];
        let mut terms = [self.motion, natural, damping, by_omega].map(begin);
        let mut sums = terms.map(|[lower, upper]| [lower + upper, upper]);
        // Of cos psi and sin psi.
        let (mut cos, mut sin, mut sin_before) = (phase.cos, phase.sin, 0.0);
        let mut constant = body.constant * square;
        let (mut next, mut size) = (1.0, 1.0);
        while size > LEAST_TERM {
            let rate = next * terms[0][1];
            let sources = [
                force * cos + constant,
                -2.0 * (body.damping * h * rate + turn * h * terms[0][0]),
                -2.0 * turn * rate,
                -force * (before * sin + h * sin_before),
            ];
            let inverse = 1.0 / (next * (next + 1.0));
            for ((term, sum), source) in terms.iter_mut().zip(&mut sums).zip(sources) {
                let [lower, upper] = *term;
                let new = (source - decay * next * upper - stiffness * lower) * inverse;
                *term = [upper, new];
                sum[0] += new;
                sum[1] += (next + 1.0) * new;
            }
            sin_before = sin;
            let angle = omega * h / next;
            (cos, sin) = (-angle * sin, angle * cos);
            constant = 0.0;
            size *= most / next;
            next += 1.0;
        }
        let [motion, natural, damping, omega] = sums.map(|[x, v]| [x, v / h]);
        Self { motion, derivatives: ByEquation { natural, damping, omega } }
    }
}

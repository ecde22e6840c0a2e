//! What ends a leg, as functions of time that rise through zero, for the contact search: the gaps
//! of the open stops; the forces of the closed ones, negative; the velocity of slip of a stop that
//! slides, against its direction; how far a stop that sticks is from the friction cone's sides.

use std::cell::OnceCell;

use super::equation::{Equation, Row};
use super::leg::SEGMENTS;
use super::{Closed, LinearFlight, LinearMotion};
use crate::flight::drive::Drive;
use crate::flight::structure::StopMotion;
use crate::flight::tolerances::{LEG_ORDER, QUIET_PROBES};
use crate::model::structure::Structure;
use crate::numerics::dense::{DEPENDENT, length};
use crate::numerics::double_double::DoubleDouble;
use crate::numerics::lanes::LANES;
use crate::search::gap::{Gap, GapBounds, GapPoint, Higher, Speeds};
use crate::search::steps::{Jet, Jets, ScanStart, SteppedGap, Weights, sextic_remainder};
use crate::search::tolerances::{BOUND_MARGIN, GRAZE_NOISE, REST_TIME, SCAN_STEPS};

/// What a condition ends.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Ends {
    /// An open stop is met.
    Open(usize),
    /// A closed stop is released.
    Held(usize),
    /// Slip ends.
    Slip,
    /// Slip begins, in this direction.
    Stick(f64),
}

/// A function of time that is negative while a leg lasts.
#[derive(Debug, Clone)]
pub(super) struct Condition {
    pub ends: Ends,
    row: Row,
    /// Sizes of the row: of its part in y, the same in units of the scales, in y', in cos and sin.
    norms: [f64; 4],
}

impl Condition {
    /// All that may end a leg with these closed stops: those of closed stops first.
    pub fn all(
        structure: &Structure,
        stops: &[StopMotion],
        drive: &Drive,
        closed: &Closed,
        equation: &Equation,
    ) -> Vec<Self> {
        let made = |ends, row: Row| {
            let norms = equation.norms(&row);
            Self { ends, row, norms }
        };
        let mut all: Vec<Self> = equation
            .pressed
            .iter()
            .zip(&equation.forces)
            .map(|(&stop, force)| made(Ends::Held(stop), force.scaled(-1.0)))
            .collect();
        match closed {
            Closed::Frictionless(_) => {}
            Closed::Slide { stop, direction, .. } => {
                let tangent = &structure.contact(*stop).modal_tangent;
                let slip = equation.velocity(tangent, drive.omega);
                all.push(made(Ends::Slip, slip.scaled(-direction)));
            }
            Closed::Stick { stop, .. } => {
                let friction = structure.stops()[*stop].friction();
                let place = equation.pressed.iter().position(|j| j == stop);
                if let (Some(normal), Some(tangential)) = (place, equation.forces.last()) {
                    let cone = equation.forces[normal].scaled(-friction);
                    // Q = -lambda falls to -mu P, or rises to mu P.
                    for direction in [1.0, -1.0] {
                        let side = cone.plus(&tangential.scaled(direction));
                        all.push(made(Ends::Stick(direction), side));
                    }
                }
            }
        }
        let held = closed.stops();
        for (j, stop) in stops.iter().enumerate().filter(|(j, _)| !held.contains(j)) {
            let normal = &structure.contact(j).modal_normal;
            let mut row = equation.gap(normal, &stop.place(drive));
            row.round_off(normal, stop);
            all.push(made(Ends::Open(j), row));
        }
        // What never changes ends nothing: the gap of a stop that closed ones carry along, too.
        all.retain(|condition| condition.norms != [0.0; 4]);
        all
    }
}

impl Condition {
    /// Whether it stays below 0 at this tau, without free coordinates, for every phase.
    pub fn stays_below(&self, tau: f64) -> bool {
        let [constant, place, cos, sin] = self.row.loads.map(DoubleDouble::value);
        constant + tau * place + cos.hypot(sin) < 0.0
    }
}

impl Row {
    fn scaled(&self, factor: f64) -> Self {
        let scaled = |row: &[DoubleDouble]| row.iter().map(|x| x.scale(factor)).collect();
        Self {
            place: scaled(&self.place),
            rate: scaled(&self.rate),
            loads: self.loads.map(|x| x.scale(factor)),
        }
    }

    fn plus(&self, other: &Self) -> Self {
        let sum = |a: &[DoubleDouble], b: &[DoubleDouble]| {
            a.iter().zip(b).map(|(&a, &b)| a + b).collect()
        };
        Self {
            place: sum(&self.place, &other.place),
            rate: sum(&self.rate, &other.rate),
            loads: std::array::from_fn(|j| self.loads[j] + other.loads[j]),
        }
    }

    /// A normal that is a combination of those of closed stops leaves nothing but rounding.
    fn round_off(&mut self, normal: &[DoubleDouble], stop: &StopMotion) {
        if length(&self.place) <= DEPENDENT * length(normal) {
            self.place.fill(DoubleDouble::ZERO);
        }
        let turning = self.loads[2].hi.hypot(self.loads[3].hi);
        if turning <= DEPENDENT * stop.amplitude.abs() {
            self.loads[2..].fill(DoubleDouble::ZERO);
        }
    }
}

impl Equation {
    fn norms(&self, row: &Row) -> [f64; 4] {
        let scaled = row.place.iter().zip(&self.scales).map(|(x, scale)| (x.hi / scale).powi(2));
        let turning = if self.turn > 0.0 { length(&row.loads[2..]) } else { 0.0 };
        [length(&row.place), scaled.sum::<f64>().sqrt(), length(&row.rate), turning]
    }
}

/// A condition along a leg.
pub(super) struct LinearGap<'a> {
    pub(super) motion: &'a LinearMotion,
    flight: &'a LinearFlight,
    pub(super) condition: &'a Condition,
    series: [OnceCell<[f64; LEG_ORDER + 1]>; SEGMENTS],
}

impl<'a> LinearGap<'a> {
    pub fn new(
        motion: &'a LinearMotion,
        flight: &'a LinearFlight,
        condition: &'a Condition,
    ) -> Self {
        let series = std::array::from_fn(|_| OnceCell::new());
        Self { motion, flight, condition, series }
    }

    pub(super) fn series(&self, segment: usize) -> &[f64; LEG_ORDER + 1] {
        self.series[segment].get_or_init(|| {
            let free = self.motion.equation.free;
            self.flight.segment(self.motion, segment).of(free, &self.condition.row)
        })
    }

    /// Bounds of the derivatives 1 to 6 up to a local time.
    pub(super) fn derivative_bounds(&self, until: f64) -> [f64; 6] {
        let equation = &self.motion.equation;
        let [place, over, rate, turning] = self.condition.norms;
        let z = self.flight.bounds(equation, until / equation.span);
        let mut per_span = 1.0;
        std::array::from_fn(|k| {
            per_span /= equation.span;
            let order = k as i32 + 1;
            let free = (place * z[k]).min(over * z[k + 1]) + rate * z[k + 1];
            (free + turning * equation.turn.powi(order)) * per_span * BOUND_MARGIN
        })
    }

    fn bounds_until(&self, until: f64) -> GapBounds {
        let [rate, _, _, fourth, fifth, sixth] = self.derivative_bounds(until);
        GapBounds { slope_noise: 0.0, rate, fourth, fifth, sixth }
    }

    /// The first of a few times at which a condition that starts at 0, to many orders, is not 0 to
    /// rounding, and its sign there; or the end of the span.
    pub fn quiet_until(&self) -> (f64, f64) {
        let span = self.motion.equation.span;
        let bounds = self.bounds();
        let value = |s: f64| {
            let (point, _) = self.change(s);
            let loud = point.value.abs() > 2.0 * GRAZE_NOISE * bounds.noise(s);
            if loud { point.value.signum() } else { 0.0 }
        };
        (1..=QUIET_PROBES)
            .map(|i| span * i as f64 / QUIET_PROBES as f64)
            .map(|s| (s, value(s)))
            .find(|(_, sign)| *sign != 0.0)
            .unwrap_or((span, 0.0))
    }

    /// The first derivative of the condition at the start that is not rounding, from the value on:
    /// its order, and its sign. None: it is zero to many orders.
    pub fn leading(&self, noise: f64) -> Option<(usize, f64)> {
        let series = self.series(0);
        let (_, size) = self.flight.value(&self.condition.row);
        let z = self.flight.bounds(&self.motion.equation, 1.0);
        let [place, over, rate, turning] = self.condition.norms;
        let level = |k: usize| {
            let free = (place * z[k - 1]).min(over * z[k]) + rate * z[k];
            free + turning * self.motion.equation.turn.powi(k as i32)
        };
        let mut factorial = 1.0;
        let order = (0..z.len() - 1).find(|&k| {
            factorial *= k.max(1) as f64;
            // What it has lost or gained by the next derivative has left its rounding.
            let own = if k == 0 { size } else { level(k) };
            (series[k] * factorial).abs() > noise * (own + level(k + 1))
        })?;
        Some((order, series[order].signum()))
    }
}

/// Value and derivatives of a polynomial, over their factorials: the first of `N`.
pub(super) fn taylor<const N: usize>(c: &[f64; LEG_ORDER + 1], s: f64) -> [f64; N] {
    let mut d = [0.0; N];
    for c in c.iter().rev() {
        for i in (1..N).rev() {
            d[i] = d[i] * s + d[i - 1];
        }
        d[0] = d[0] * s + c;
    }
    d
}

impl Gap for LinearGap<'_> {
    /// The jet, and the next two derivatives.
    type Instant = (GapPoint, Higher);
    type State = ();
    const GROWS: bool = true;

    fn start(&self) -> (f64, f64) {
        self.flight.value(&self.condition.row)
    }

    fn bounds(&self) -> GapBounds {
        self.bounds_until(self.motion.equation.span)
    }

    fn speeds(&self, _: &GapBounds) -> Speeds {
        let Equation { span, turn, .. } = self.motion.equation;
        let longest = self.motion.longest();
        let [place, _, rate, turning] = self.condition.norms;
        let z = self.flight.bounds(&self.motion.equation, 1.0);
        let moved = self.flight.rate.iter().map(|y| y * y).sum::<f64>().sqrt();
        let [_, growth, ..] = self.derivative_bounds(span);
        let since = REST_TIME * self.motion.drive.time(self.flight.clock).min(longest);
        let first = (place * moved + rate * z[1] + turning * turn) / span;
        Speeds { first, growth, since }
    }

    fn change(&self, s: f64) -> (GapPoint, Self::Instant) {
        let span = self.motion.equation.span;
        let mut c = *self.series(0);
        c[0] = 0.0;
        let d = taylor::<6>(&c, s / span);
        let (per, factorial) = (1.0 / span, [1.0, 1.0, 2.0, 6.0, 24.0, 120.0]);
        let derivative = |k: usize| factorial[k] * d[k] * per.powi(k as i32);
        let [value, rate, second, third, fourth, fifth] = [0, 1, 2, 3, 4, 5].map(derivative);
        let point = GapPoint { value, rate, second, third };
        (point, (point, Higher { fourth, fifth }))
    }

    fn higher(&self, (_, higher): &Self::Instant) -> Higher {
        *higher
    }

    fn state(&self, _: &Self::Instant, _: f64) {}
}

impl SteppedGap for LinearGap<'_> {
    /// Local time where a scan stands.
    type Place = f64;
    /// Local time of the last place, and the step.
    type Places = (f64, f64);

    fn scan_start(&self) -> ScanStart {
        let (value, _) = self.start();
        let (point, _) = self.change(0.0);
        let span = self.motion.equation.span;
        ScanStart {
            start: Jet { value, rate: point.rate, second: point.second },
            // The last eight steps may begin just before the end.
            bounds: self.bounds_until(self.bounds_hold() + SCAN_STEPS * span),
        }
    }

    fn bounds_hold(&self) -> f64 {
        self.motion.equation.holds * self.motion.equation.span
    }

    fn reach(&self) -> f64 {
        self.motion.equation.span
    }

    fn extent(&self) -> f64 {
        self.start().1
    }

    fn steps_hold(&self, _: f64) -> bool {
        true
    }

    fn never_meets(&self, _: f64) -> bool {
        false
    }

    fn higher_at_start(&self) -> (f64, f64) {
        let (point, (_, higher)) = self.change(0.0);
        (point.third, higher.fourth)
    }

    fn remainder_factor(&self) -> f64 {
        sextic_remainder(self.motion.step(0))
    }

    fn place(&self) -> f64 {
        0.0
    }

    fn step(&self, level: usize) -> f64 {
        self.motion.step(level)
    }

    fn weights(&self, level: usize) -> &Weights {
        &self.motion.weights[level]
    }

    /// From the series of the span in which the steps begin: they end a little more than two spans
    /// after its start at most.
    fn eight_steps(&self, level: usize, from: &f64) -> ((f64, f64), Jets) {
        let (span, step) = (self.motion.equation.span, self.motion.step(level));
        let segment = (1..SEGMENTS).take_while(|&i| *from >= i as f64 * span).count();
        let c = self.series(segment);
        let first = from / span - segment as f64;
        let at: [f64; LANES] = std::array::from_fn(|j| first + step / span * (j + 1) as f64);
        let mut jets = Jets::default();
        for c in c.iter().rev() {
            for (j, s) in at.iter().enumerate() {
                jets.second[j] = jets.second[j] * s + jets.rate[j];
                jets.rate[j] = jets.rate[j] * s + jets.value[j];
                jets.value[j] = jets.value[j] * s + c;
            }
        }
        let per = 1.0 / span;
        for j in 0..LANES {
            jets.rate[j] *= per;
            jets.second[j] *= 2.0 * per * per;
        }
        ((*from, step), jets)
    }

    fn place_after((from, step): &(f64, f64), j: usize) -> f64 {
        from + step * (j + 1) as f64
    }
}

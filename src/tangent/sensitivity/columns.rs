//! Derivatives of the state at one instant, and how flights and impacts carry them on.
//!
//! As perturbations, they have the components (x1, x1', x2', t) at an event, the time within its drive
//! period, and (x1, x1', x2', x2) between events, at a fixed time in a fixed period. Flights and
//! impacts map them like perturbations, and add what a parameter changes by itself.

#![allow(clippy::inline_always)] // one of them for each impact of a motion that is followed

use std::sync::Arc;

use pulp::NullaryFnOnce;
use smallvec::SmallVec;

use super::by::{Added, By, coefficients};
use super::error::SensitivityError;
use super::impact::FollowedImpact;
use super::models::Models;
use crate::flight::{FreeMotion, Trig};
use crate::impact::{RegimeKind, resolve};
use crate::model::contact_coordinates::PreImpact;
use crate::model::parameters::{Contact, System};
use crate::model::state::{Clock, State};
use crate::numerics::elementary;
use crate::numerics::lanes::narrow;
use crate::tangent::Model;
use crate::tangent::equation::{Flown, Hops, Steps};
use crate::tangent::itinerary::Signs;
use crate::tangent::long_flight::Parts;
use crate::tangent::strike::{Departure, ImpactPoint, Numbers, Rates};
use crate::tangent::tolerances::{LEAST_DERIVATIVE, SHORT_HOP};

/// Derivatives of one instant by one number.
pub(super) type Column = [f64; 4];
/// By all of them; by few without memory of their own.
pub(super) type Columns = SmallVec<[Column; 4]>;

/// The components of a state.
const STATE: [By; 4] = [By::Start(0), By::Start(1), By::Start(2), By::Start(3)];

/// A friction so small that it acts to first order.
const FAINT: f64 = 1e-300;

/// A system, and what its runs are differentiated by.
pub(super) struct Differentiated {
    pub system: System,
    pub model: Arc<Model>,
    pub by: Vec<By>,
    pub names: Vec<String>,
    /// Of pendulum and oscillator.
    steps: Arc<[Steps; 2]>,
    hops: Arc<[Hops; 2]>,
    /// Of long flights.
    pub(super) parts: Parts,
    /// The fastest rate at which anything turns or decays.
    pub(super) fastest: f64,
    /// What contact needs of the system.
    pub(super) contact: Models,
}

/// The derivatives at one instant of a motion.
#[derive(Debug, Clone)]
pub(super) struct Here {
    pub state: State,
    pub clock: Clock,
    /// Of the drive.
    pub trig: Trig,
    /// The flight that begins here, after an event or between two.
    pub departure: Departure,
    pub columns: Columns,
}

impl Differentiated {
    pub fn new(system: &System, by: Vec<By>, names: Vec<String>) -> Self {
        let model = Model::new(system, &[], false);
        let bodies = [system.pendulum(), system.oscillator()];
        let wanted = coefficients(&by, system);
        let steps = [0, 1].map(|i| Steps::new(&bodies[i], system.drive_frequency, &wanted[i]));
        let [pendulum, oscillator] = [0, 1].map(|i| bodies[i].fastest_rate());
        let fastest = system.drive_frequency.max(pendulum).max(oscillator);
        let hops = bodies.map(|body| Hops::new(&body, system.drive_frequency));
        let longest = steps[0].longest_part().min(steps[1].longest_part());
        let parts = Parts::new(&model.motion.drive, longest, by.contains(&By::DriveFrequency));
        let (model, steps, hops) = (Arc::new(model), Arc::new(steps), Arc::new(hops));
        let contact = Models::default();
        Self { system: system.clone(), model, by, names, steps, hops, parts, fastest, contact }
    }

    /// The same, by the state at an event before all others.
    pub fn with_basis(&self) -> Self {
        Self {
            system: self.system.clone(),
            model: Arc::clone(&self.model),
            by: STATE.into_iter().chain(self.by.iter().copied()).collect(),
            names: STATE.iter().map(|_| String::new()).chain(self.names.iter().cloned()).collect(),
            steps: Arc::clone(&self.steps),
            hops: Arc::clone(&self.hops),
            parts: self.parts,
            fastest: self.fastest,
            contact: Models::default(),
        }
    }

    /// The columns of the basis, and no others yet.
    pub fn basis(&self) -> Columns {
        let unit = |i: usize| std::array::from_fn(|j| f64::from(u8::from(i == j)));
        (0..self.by.len()).map(unit).collect()
    }

    /// d(2 pi/omega)/d omega; 0 of a drive that stands still, of which no periods are counted.
    pub fn period_rate(&self) -> f64 {
        let drive = &self.model.motion.drive;
        if drive.has_period() { -drive.period.hi / drive.omega } else { 0.0 }
    }

    /// The start of a motion.
    pub fn start(&self, state: State, clock: Clock) -> Here {
        let column = |by: &By| std::array::from_fn(|i| f64::from(u8::from(*by == By::Start(i))));
        let columns = self.by.iter().map(column).collect();
        let departure = Departure::new(&self.model, &state, clock, false);
        Here { state, clock, trig: self.model.trig(clock), departure, columns }
    }

    /// After an event that leaves this state.
    pub fn event(&self, mut columns: Columns, clock: Clock, state: State) -> Here {
        for column in &mut columns {
            *column = column.map(counted);
        }
        let departure = Departure::new(&self.model, &state, clock, true);
        Here { state, clock, trig: self.model.trig(clock), departure, columns }
    }

    /// The state at an instant of the flight from here.
    pub fn state_at(&self, here: &Here, clock: Clock) -> State {
        let motion = &self.model.motion;
        let elapsed = motion.drive.until(here.clock, clock);
        motion.state_after(&motion.flight(here.clock, here.state), elapsed)
    }

    /// As [`Self::at`], in a flight that needs no parts.
    pub fn at_once(
        &self,
        here: &Here,
        clock: Clock,
        known: Option<&State>,
    ) -> Result<(Columns, Column), SensitivityError> {
        let mut rates = Rates::default();
        if self.by.contains(&By::DriveFrequency) {
            let state = known.copied().unwrap_or_else(|| self.state_at(here, clock));
            rates = self.rates(&state, clock);
        }
        let columns = narrow(Flight { of: self, here, clock, rates: &rates })?;
        let ([v1, v2], [a1, a2]) = (rates.velocities, rates.accelerations);
        Ok((columns, [v1, a1, a2, v2]))
    }

    /// How fast a free motion changes in this state.
    pub fn rates(&self, state: &State, clock: Clock) -> Rates {
        self.rates_at(state, self.model.motion.drive.trig_at(clock).cos)
    }

    #[inline(always)]
    fn rates_at(&self, state: &State, cos_psi: f64) -> Rates {
        let FreeMotion { pendulum, oscillator, .. } = &self.model.motion;
        Rates::at(state, cos_psi, (&pendulum.equation, &oscillator.equation))
    }

    /// The derivatives of the state at a fixed instant of the flight from here, in which it has these
    /// rates.
    #[inline(always)]
    fn flown(
        &self,
        here: &Here,
        (clock, trig): (Clock, Trig),
        rates: &Rates,
    ) -> Result<Columns, SensitivityError> {
        let drive = &self.model.motion.drive;
        let elapsed = drive.along_flight(here.clock, clock);
        let time = elapsed.hi;
        let transitions = self.model.motion.transitions(elapsed);
        let [[[xx1, xv1], [vx1, vv1]], [[xx2, xv2], [vx2, vv2]]] = transitions;
        let added = self.added(here, time, Some((trig, transitions)))?;
        let ([r1, r2], [a1, a2]) = (rates.velocities, rates.accelerations);
        let mut columns = Columns::from_slice(&here.columns);
        for (column, &by) in columns.iter_mut().zip(&self.by) {
            let [x1, v1, v2, x2] = Self::fixed(here, column, by);
            *column = [
                xx1 * x1 + xv1 * v1,
                vx1 * x1 + vv1 * v1,
                vx2 * x2 + vv2 * v2,
                xx2 * x2 + xv2 * v2,
            ];
            if let Some(added) = &added {
                for (x, own) in column.iter_mut().zip(by.own(added, here.clock)) {
                    *x += own;
                }
            }
            if by == By::DriveFrequency {
                let later = self.later(by, here.clock, clock);
                for (x, rate) in column.iter_mut().zip([r1, a1, a2, r2]) {
                    *x += rate * later;
                }
            }
        }
        Ok(columns)
    }

    /// At a fixed time: an event that comes later leaves the flight behind.
    #[inline(always)]
    fn fixed(here: &Here, column: &Column, by: By) -> Column {
        let Departure { rates, slope, .. } = &here.departure;
        let Some(slope) = slope else { return *column };
        let ([x1, v1, v2, dt], [r1, r2], [a1, a2]) =
            (*column, rates.velocities, rates.accelerations);
        let x2 = slope * x1 - moves_stop(by);
        [x1 - r1 * dt, v1 - a1 * dt, v2 - a2 * dt, x2 - r2 * dt]
    }

    /// What the flight from here adds, if it does.
    #[inline(always)]
    fn added(
        &self,
        here: &Here,
        time: f64,
        end: Option<(Trig, [[[f64; 2]; 2]; 2])>,
    ) -> Result<Option<Added>, SensitivityError> {
        let [pendulum, oscillator] = &*self.steps;
        if pendulum.is_idle() && oscillator.is_idle() {
            return Ok(None);
        }
        let State { x1, v1, x2, v2 } = here.state;
        let start = here.trig;
        let found = if let Some((end, [first, second])) = end {
            let flown = |transition| Flown { start, end, time, transition };
            (
                pendulum.between((x1, v1), &flown(first)),
                oscillator.between((x2, v2), &flown(second)),
            )
        } else {
            (pendulum.after((x1, v1), start, time), oscillator.after((x2, v2), start, time))
        };
        let (Some(first), Some(second)) = found else {
            let time = self.model.motion.drive.time(here.clock);
            return Err(SensitivityError::Damping { time });
        };
        Ok(Some([first, second]))
    }

    /// By how much an instant in another drive period comes later in time.
    #[inline(always)]
    pub fn later(&self, by: By, from: Clock, to: Clock) -> f64 {
        match (by, to.period - from.period) {
            (By::DriveFrequency, periods) if periods != 0 => periods as f64 * self.period_rate(),
            _ => 0.0,
        }
    }

    /// Derivatives at the end of the flight from here to an impact, at the impact's own time, and the
    /// delay of that.
    #[inline(always)]
    fn met(
        &self,
        here: &Here,
        (impact, clock, trig): (&FollowedImpact, Clock, Trig),
        rates: &Rates,
    ) -> Result<Columns, SensitivityError> {
        let time = self.model.motion.drive.roughly_until(here.clock, clock);
        let (angle, approach) = (impact.angle, impact.approach_velocity);
        if let Some(slope) = here.departure.slope
            && time * self.fastest < SHORT_HOP
        {
            let hop = Hop { of: self, here, impact: (clock, approach), rates, time, slope };
            return narrow(hop);
        }
        let per_approach = 1.0 / approach;
        let ([r1, _], [a1, a2]) = (rates.velocities, rates.accelerations);
        let mut columns = self.flown(here, (clock, trig), rates)?;
        for (column, &by) in columns.iter_mut().zip(&self.by) {
            let [x1, v1, v2, x2] = *column;
            let delay = (x2 + moves_stop(by) - angle.cos * x1) * per_approach;
            *column = [x1 + r1 * delay, v1 + a1 * delay, v2 + a2 * delay, delay];
        }
        Ok(columns)
    }

    /// As [`Self::met`], after a short flight from the contact. What the two bodies move alike would
    /// leave its rounding, over a low approach velocity, in the time of the impact: the gap is
    /// differentiated by what changes in it since the last event, at a fixed time after that.
    #[inline(always)]
    fn hopped(
        &self,
        here: &Here,
        (clock, approach_velocity): (Clock, f64),
        rates: &Rates,
        (slope, time): (f64, f64),
    ) -> Result<Columns, SensitivityError> {
        let added = self.added(here, time, None)?;
        let State { x1, v1, x2, v2 } = here.state;
        let [pendulum, oscillator] = &*self.hops;
        let first = pendulum.after((x1, v1), here.trig, time);
        let second = oscillator.after((x2, v2), here.trig, time);
        let omega = self.model.motion.drive.omega;
        let by_time = [first.by_phase, second.by_phase].map(|[x, v]| [omega * x, omega * v]);
        let [[[xx1, xv1], [vx1, vv1]], [[xx2, xv2], [vx2, vv2]]] =
            [first.transition, second.transition];
        let turned = match self.system.contact {
            Contact::Direct => 0.0,
            Contact::Oblique => {
                let half = 0.5 * first.displacement;
                let [(sin, _), (half_sin, _)] =
                    [elementary::sin_cos(x1 + half), elementary::sin_cos(half)];
                -2.0 * sin * half_sin
            }
        };
        let ([r1, _], [a1, a2]) = (rates.velocities, rates.accelerations);
        let per_approach = 1.0 / approach_velocity;
        let columns = here.columns.iter().zip(&self.by).map(|(&[x1, v1, v2, dt], &by)| {
            let x2 = slope * x1 - moves_stop(by);
            let [a, b, c, d] = added.as_ref().map_or([0.0; 4], |added| by.own(added, here.clock));
            let moved = xx1 * x1 + xv1 * v1 + a + by_time[0][0] * dt;
            let other = xx2 * x2 + xv2 * v2 + d + by_time[1][0] * dt;
            let x1 = x1 + moved;
            let v1 = v1 + (vx1 * (x1 - moved) + vv1 * v1 + b + by_time[0][1] * dt);
            let v2 = v2 + (vx2 * x2 + vv2 * v2 + c + by_time[1][1] * dt);
            let longer = -(slope * moved - other + turned * x1) * per_approach;
            let delay = dt + longer - self.later(by, here.clock, clock);
            [x1 + r1 * longer, v1 + a1 * longer, v2 + a2 * longer, delay]
        });
        Ok(columns.collect())
    }

    /// As [`Self::strike`], from a flight that needs no parts.
    pub fn strike_at_once(
        &self,
        here: &mut Here,
        impact: &FollowedImpact,
        clock: Clock,
    ) -> Result<(Columns, f64), SensitivityError> {
        narrow(Struck { of: self, here, impact, clock })
    }

    #[inline(always)]
    fn struck(
        &self,
        here: &mut Here,
        impact: &FollowedImpact,
        clock: Clock,
    ) -> Result<(Columns, f64), SensitivityError> {
        let system = &self.system;
        let &FollowedImpact { angle, approach_velocity, .. } = impact;
        let trig = self.model.trig(clock);
        let before = self.rates_at(&impact.pre, trig.cos);
        let columns = self.met(here, (impact, clock, trig), &before)?;
        let point = ImpactPoint {
            angle,
            turns: system.contact == Contact::Oblique,
            rates: before,
            approach_velocity,
            numbers: Numbers {
                mass_ratio: system.mass_ratio,
                friction: system.friction,
                restitution: system.coefficient().with_slope(approach_velocity),
                moves: 1.0,
            },
        };
        let regime = self.regime(impact);
        let after = &mut here.columns;
        let separation = match columns.len() {
            1 => self.after_it::<1>(&point, (&columns, after), regime),
            2 => self.after_it::<2>(&point, (&columns, after), regime),
            _ => self.after_it::<4>(&point, (&columns, after), regime),
        };
        let FreeMotion { pendulum, oscillator, .. } = &self.model.motion;
        let decay_rates = [pendulum, oscillator].map(|body| body.equation.decay_rate);
        let rates = before.after([impact.post.v1, impact.post.v2], decay_rates);
        here.departure = Departure { clock, rates, slope: Some(angle.cos) };
        (here.state, here.clock, here.trig) = (impact.post, clock, trig);
        Ok((columns, separation))
    }

    /// Derivatives just after an impact, from those before it, N of them at a time; u after it.
    #[inline(always)]
    fn after_it<const N: usize>(
        &self,
        point: &ImpactPoint,
        (before, after): (&Columns, &mut Columns),
        regime: (RegimeKind, Signs),
    ) -> f64 {
        let coefficient = self.system.coefficient();
        let by_curve = |place| coefficient.by_number(point.approach_velocity, place);
        let mut separation = 0.0;
        let parts = before.chunks(N).zip(after.chunks_mut(N)).zip(self.by.chunks(N));
        for ((before, after), by) in parts {
            let (mut rows, mut direct) = ([[0.0; N]; 3], [[0.0; N]; 3]);
            for (i, (column, &by)) in before.iter().zip(by).enumerate() {
                for (row, x) in rows.iter_mut().zip(column) {
                    row[i] = *x;
                }
                match by {
                    By::MassRatio => direct[0][i] = 1.0,
                    By::Friction => direct[1][i] = 1.0,
                    By::Restitution => direct[2][i] = 1.0,
                    By::OfCurve(place) => direct[2][i] = by_curve(place),
                    _ => {}
                }
            }
            let end = point.after(&rows, direct, self.system.law, regime);
            let (slip, parting) = (end.slip.slope, end.parting.slope);
            for (i, (after, before)) in after.iter_mut().zip(before).enumerate() {
                *after = [before[0], slip[i], parting[i], before[3]].map(counted);
            }
            separation = end.separation_velocity.value;
        }
        separation
    }

    /// The regime of an impact, that of a faint friction where the derivative by friction is wanted and
    /// there is none.
    pub fn regime(&self, impact: &FollowedImpact) -> (RegimeKind, Signs) {
        let (system, known) = (&self.system, impact.regime);
        let smooth = known.0 == RegimeKind::Frictionless && system.law.is_coulomb();
        if !smooth || system.contact == Contact::Direct {
            return known;
        }
        if !self.by.contains(&By::Friction) && system.friction == 0.0 {
            return known;
        }
        let mut pre = PreImpact::at(impact.angle, &impact.pre);
        if pre.sin == 0.0 {
            pre.sin = FAINT;
        }
        let faint = System { friction: system.friction.max(FAINT), ..system.clone() };
        let Ok(outcome) = resolve(&faint, &pre) else { return known };
        (outcome.regime.kind(), Signs::of_regime(outcome.regime, pre.v1, pre.sin))
    }
}

/// [`Differentiated::struck`].
struct Struck<'a> {
    of: &'a Differentiated,
    here: &'a mut Here,
    impact: &'a FollowedImpact,
    clock: Clock,
}

impl NullaryFnOnce for Struck<'_> {
    type Output = Result<(Columns, f64), SensitivityError>;

    #[inline(always)]
    fn call(self) -> Self::Output {
        self.of.struck(self.here, self.impact, self.clock)
    }
}

/// [`Differentiated::hopped`], apart from what is done for all impacts.
struct Hop<'a> {
    of: &'a Differentiated,
    here: &'a Here,
    impact: (Clock, f64),
    rates: &'a Rates,
    time: f64,
    slope: f64,
}

impl NullaryFnOnce for Hop<'_> {
    type Output = Result<Columns, SensitivityError>;

    #[inline(always)]
    fn call(self) -> Self::Output {
        self.of.hopped(self.here, self.impact, self.rates, (self.slope, self.time))
    }
}

/// [`Differentiated::flown`].
struct Flight<'a> {
    of: &'a Differentiated,
    here: &'a Here,
    clock: Clock,
    rates: &'a Rates,
}

impl NullaryFnOnce for Flight<'_> {
    type Output = Result<Columns, SensitivityError>;

    #[inline(always)]
    fn call(self) -> Self::Output {
        self.of.flown(self.here, (self.clock, self.of.model.trig(self.clock)), self.rates)
    }
}

/// A derivative, or zero in place of next to nothing: of a start long forgotten.
#[inline(always)]
pub(super) fn counted(derivative: f64) -> f64 {
    if derivative.abs() < LEAST_DERIVATIVE { 0.0 } else { derivative }
}

/// d g/d gap with the sign of x2: how far body 2 is in the tip's place.
pub(super) fn moves_stop(by: By) -> f64 {
    f64::from(u8::from(by == By::Gap))
}

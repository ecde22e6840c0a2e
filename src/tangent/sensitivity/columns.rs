//! Derivatives of the state at one instant, and how flights and impacts carry them on.
//!
//! As perturbations, they have the components (x1, x1', x2', t) at an event, the time within its drive
//! period, and (x1, x1', x2', x2) between events, at a fixed time in a fixed period. Flights and
//! impacts map them like perturbations, and add what a parameter changes by itself.

use smallvec::SmallVec;

use super::by::{By, Needs};
use super::error::SensitivityError;
use crate::flight::FreeMotion;
use crate::impact::{RegimeKind, resolve};
use crate::model::angle::Angle;
use crate::model::contact_coordinates::PreImpact;
use crate::model::parameters::{Contact, System};
use crate::model::state::{Clock, State};
use crate::numerics::double_double::DoubleDouble;
use crate::simulate::event::ImpactEvent;
use crate::tangent::Model;
use crate::tangent::equation::{ByEquation, Loads, by_equation, by_phase};
use crate::tangent::itinerary::{Leg, Signs};
use crate::tangent::strike::{Departure, ImpactPoint, Numbers, Rates};
use crate::tangent::tolerances::SHORT_HOP;

/// Derivatives of one instant by one number.
pub(super) type Column = [f64; 4];
/// By all of them; by few without memory of their own.
pub(super) type Columns = SmallVec<[Column; 4]>;

/// A friction so small that it acts to first order.
const FAINT: f64 = 1e-300;

/// A system, and what its runs are differentiated by.
pub(super) struct Differentiated {
    pub system: System,
    pub model: Model,
    pub by: Vec<By>,
    pub names: Vec<String>,
    needs: [Needs; 2],
    loads: [Option<Loads>; 2],
    /// The fastest rate at which anything turns or decays.
    pub(super) fastest: f64,
}

/// The derivatives at one instant of a motion.
#[derive(Debug, Clone)]
pub(super) struct Here {
    pub state: State,
    pub clock: Clock,
    /// The flight that begins here, after an event or between two.
    pub departure: Departure,
    pub columns: Columns,
}

/// What a flight adds to the derivatives of both bodies.
#[derive(Default)]
struct Added {
    drive: [[f64; 2]; 2],
    constant: [[f64; 2]; 2],
    phase: [[f64; 2]; 2],
    equation: [ByEquation; 2],
}

impl Differentiated {
    pub fn new(system: &System, by: Vec<By>, names: Vec<String>) -> Self {
        let model = Model::new(system, &[], false);
        let needs = Needs::of(&by, system);
        let bodies = [system.pendulum(), system.oscillator()];
        let loads = [0, 1].map(|i| {
            let needs: Needs = needs[i];
            let wanted = needs.drive || needs.constant;
            wanted.then(|| Loads::new(&bodies[i], system.drive_frequency, model.motion.span))
        });
        let [pendulum, oscillator] = bodies.map(|body| body.fastest_rate());
        let fastest = system.drive_frequency.max(pendulum).max(oscillator);
        Self { system: system.clone(), model, by, names, needs, loads, fastest }
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
        Here { state, clock, departure, columns }
    }

    /// After an event that leaves this state.
    pub fn event(&self, columns: Columns, clock: Clock, state: State) -> Here {
        let departure = Departure::new(&self.model, &state, clock, true);
        Here { state, clock, departure, columns }
    }

    /// The state at an instant of the flight from here.
    pub fn state_at(&self, here: &Here, clock: Clock) -> State {
        let motion = &self.model.motion;
        let elapsed = motion.drive.until(here.clock, clock);
        motion.state_after(&motion.flight(here.clock, here.state), elapsed)
    }

    /// How fast a free motion changes in this state.
    pub fn rates(&self, state: &State, clock: Clock) -> Rates {
        let FreeMotion { drive, pendulum, oscillator, .. } = &self.model.motion;
        Rates::at(state, drive.trig_at(clock).cos, (&pendulum.equation, &oscillator.equation))
    }

    /// The derivatives of the state at a fixed instant of the flight from here, in which it has these
    /// rates.
    pub fn flown(
        &self,
        here: &Here,
        clock: Clock,
        rates: &Rates,
    ) -> Result<Columns, SensitivityError> {
        let drive = &self.model.motion.drive;
        let time = drive.roughly_until(here.clock, clock);
        let transitions = self.model.motion.transitions(time);
        let added = self.added(here, time)?;
        let [[[xx1, xv1], [vx1, vv1]], [[xx2, xv2], [vx2, vv2]]] = transitions;
        let ([r1, r2], [a1, a2]) = (rates.velocities, rates.accelerations);
        let columns = here.columns.iter().zip(&self.by).map(|(column, &by)| {
            let [x1, v1, v2, x2] = Self::fixed(here, column, by);
            let [a, b, c, d] = Self::of(by, &added, here.clock);
            let later = self.later(by, here.clock, clock);
            [
                xx1 * x1 + xv1 * v1 + (a + r1 * later),
                vx1 * x1 + vv1 * v1 + (b + a1 * later),
                vx2 * x2 + vv2 * v2 + (c + a2 * later),
                xx2 * x2 + xv2 * v2 + (d + r2 * later),
            ]
        });
        Ok(columns.collect())
    }

    /// At a fixed time: an event that comes later leaves the flight behind.
    fn fixed(here: &Here, column: &Column, by: By) -> Column {
        let Departure { rates, slope, .. } = &here.departure;
        let Some(slope) = slope else { return *column };
        let ([x1, v1, v2, dt], [r1, r2], [a1, a2]) =
            (*column, rates.velocities, rates.accelerations);
        let x2 = slope * x1 - moves_stop(by);
        [x1 - r1 * dt, v1 - a1 * dt, v2 - a2 * dt, x2 - r2 * dt]
    }

    /// What the flight from here adds.
    fn added(&self, here: &Here, time: f64) -> Result<Added, SensitivityError> {
        let FreeMotion { drive, pendulum, oscillator, .. } = &self.model.motion;
        let mut added = Added::default();
        let needs = |of: fn(&Needs) -> bool| self.needs.iter().any(of);
        if !needs(|n| n.drive || n.constant || n.phase || n.equation) {
            return Ok(added);
        }
        let start = self.model.trig(here.clock);
        let elapsed = DoubleDouble::new(time);
        let State { x1, v1, x2, v2 } = here.state;
        let bodies = [
            (self.system.pendulum(), pendulum, (x1, v1)),
            (self.system.oscillator(), oscillator, (x2, v2)),
        ];
        for (i, (body, oscillator, state)) in bodies.into_iter().enumerate() {
            let needs = self.needs[i];
            if let Some(loads) = &self.loads[i] {
                if needs.drive {
                    added.drive[i] = loads.driven(elapsed, &drive.turned_far(start, elapsed));
                }
                if needs.constant {
                    added.constant[i] = loads.loaded(elapsed);
                }
            }
            if needs.phase {
                added.phase[i] = by_phase(oscillator, drive, start, elapsed);
            }
            if needs.equation {
                let found = by_equation(&body, drive.omega, (state, start), time);
                let time = drive.time(here.clock);
                added.equation[i] = found.ok_or(SensitivityError::Damping { time })?;
            }
        }
        Ok(added)
    }

    /// What a flight between two instants adds to the derivatives by one number, at a fixed time after its
    /// start.
    fn of(by: By, added: &Added, from: Clock) -> Column {
        let first = |[x, v]: [f64; 2]| [x, v, 0.0, 0.0];
        let second = |[x, v]: [f64; 2]| [0.0, 0.0, v, x];
        let both = |[[x1, v1], [x2, v2]]: [[f64; 2]; 2]| [x1, v1, v2, x2];
        match by {
            By::FrequencyRatio => first(added.equation[0].natural),
            By::PendulumDamping => first(added.equation[0].damping),
            By::OscillatorDamping => second(added.equation[1].damping),
            By::MomentAmplitude => first(added.drive[0]),
            By::ForceAmplitude => second(added.drive[1]),
            By::StaticMoment => first(added.constant[0]),
            By::StaticForce => second(added.constant[1]),
            By::Phase => both(added.phase),
            By::DriveFrequency => {
                // The phase of a time within a period, and the drive in the flight.
                let ahead = both(added.phase).map(|x| from.time_in_period * x);
                let turned = both(added.equation.map(|equation| equation.omega));
                std::array::from_fn(|i| ahead[i] + turned[i])
            }
            By::MassRatio
            | By::Restitution
            | By::OfCurve(_)
            | By::Gap
            | By::Friction
            | By::Start(_) => [0.0; 4],
        }
    }

    /// By how much an instant in another drive period comes later in time.
    pub fn later(&self, by: By, from: Clock, to: Clock) -> f64 {
        match (by, to.period - from.period) {
            (By::DriveFrequency, periods) if periods != 0 => periods as f64 * self.period_rate(),
            _ => 0.0,
        }
    }

    /// Derivatives at the end of the flight from here to an impact, at the impact's own time, and the
    /// delay of that.
    fn met(
        &self,
        here: &Here,
        impact: &ImpactEvent,
        rates: &Rates,
        angle: Angle,
    ) -> Result<Columns, SensitivityError> {
        let drive = &self.model.motion.drive;
        let time = drive.roughly_until(here.clock, impact.clock);
        let per_approach = 1.0 / impact.impact.approach_velocity;
        let ([r1, _], [a1, a2]) = (rates.velocities, rates.accelerations);
        if let Some(slope) = here.departure.slope
            && time * self.fastest < SHORT_HOP
        {
            return self.hopped(here, impact, rates, (slope, time));
        }
        let mut columns = self.flown(here, impact.clock, rates)?;
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
    fn hopped(
        &self,
        here: &Here,
        impact: &ImpactEvent,
        rates: &Rates,
        (slope, time): (f64, f64),
    ) -> Result<Columns, SensitivityError> {
        let FreeMotion { drive, pendulum, oscillator, .. } = &self.model.motion;
        let elapsed = DoubleDouble::new(time);
        let added = self.added(here, time)?;
        let start = self.model.trig(here.clock);
        let by_time = [pendulum, oscillator]
            .map(|body| by_phase(body, drive, start, elapsed).map(|x| drive.omega * x));
        let [[[xx1, xv1], [vx1, vv1]], [[xx2, xv2], [vx2, vv2]]] =
            [pendulum, oscillator].map(|body| body.transition_change(time));
        let turned = match self.system.contact {
            Contact::Direct => 0.0,
            Contact::Oblique => {
                let State { x1, v1, .. } = here.state;
                let flight = pendulum.flight(x1, v1, drive.trig_at(here.clock));
                let half = 0.5 * pendulum.at(&flight, time, &drive.turned(start, time)).increment;
                -2.0 * (x1 + half).sin() * half.sin()
            }
        };
        let ([r1, _], [a1, a2]) = (rates.velocities, rates.accelerations);
        let per_approach = 1.0 / impact.impact.approach_velocity;
        let columns = here.columns.iter().zip(&self.by).map(|(&[x1, v1, v2, dt], &by)| {
            let x2 = slope * x1 - moves_stop(by);
            let [a, b, c, d] = Self::of(by, &added, here.clock);
            let moved = xx1 * x1 + xv1 * v1 + a + by_time[0][0] * dt;
            let other = xx2 * x2 + xv2 * v2 + d + by_time[1][0] * dt;
            let x1 = x1 + moved;
            let v1 = v1 + (vx1 * (x1 - moved) + vv1 * v1 + b + by_time[0][1] * dt);
            let v2 = v2 + (vx2 * x2 + vv2 * v2 + c + by_time[1][1] * dt);
            let longer = -(slope * moved - other + turned * x1) * per_approach;
            let delay = dt + longer - self.later(by, here.clock, impact.clock);
            [x1 + r1 * longer, v1 + a1 * longer, v2 + a2 * longer, delay]
        });
        Ok(columns.collect())
    }

    /// The derivatives just before the impact that ends the flight from here, at its time, and those after
    /// it.
    pub fn strike(
        &self,
        here: &Here,
        impact: &ImpactEvent,
    ) -> Result<(Columns, Here), SensitivityError> {
        let system = &self.system;
        let before = self.rates(&impact.pre, impact.clock);
        let angle = system.contact.angle(impact.pre.x1);
        let columns = self.met(here, impact, &before, angle)?;
        let point = ImpactPoint {
            angle,
            turns: system.contact == Contact::Oblique,
            rates: before,
            approach_velocity: impact.impact.approach_velocity,
            numbers: Numbers {
                mass_ratio: system.mass_ratio,
                friction: system.friction,
                restitution: system.coefficient().with_slope(impact.impact.approach_velocity),
                moves: 1.0,
            },
        };
        let (kind, signs) = self.regime(impact);
        let [by_slip, by_parting] = point.by_all(system.law, kind, signs);
        let u = impact.impact.approach_velocity;
        let by_curve = |place| system.coefficient().by_number(u, place);
        let mut after_it = Columns::with_capacity(columns.len());
        for (&[x1, v1, v2, delay], &by) in columns.iter().zip(&self.by) {
            let after = |row: &[f64; 6]| {
                let direct = match by {
                    By::MassRatio => row[3],
                    By::Friction => row[4],
                    By::Restitution => row[5],
                    By::OfCurve(place) => row[5] * by_curve(place),
                    _ => 0.0,
                };
                row[0] * x1 + row[1] * v1 + row[2] * v2 + direct
            };
            after_it.push([x1, after(&by_slip), after(&by_parting), delay]);
        }
        let FreeMotion { pendulum, oscillator, .. } = &self.model.motion;
        let decay_rates = [pendulum, oscillator].map(|body| body.equation.decay_rate);
        let rates = before.after([impact.post.v1, impact.post.v2], decay_rates);
        let departure = Departure { clock: impact.clock, rates, slope: Some(angle.cos) };
        let (state, clock) = (impact.post, impact.clock);
        Ok((columns, Here { state, clock, departure, columns: after_it }))
    }

    /// The regime of an impact, that of a faint friction where the derivative by friction is wanted and
    /// there is none.
    fn regime(&self, impact: &ImpactEvent) -> (RegimeKind, Signs) {
        let system = &self.system;
        let known = Leg::regime_of(system, impact);
        let smooth = known.0 == RegimeKind::Frictionless && system.law.is_coulomb();
        if !smooth || system.contact == Contact::Direct {
            return known;
        }
        if !self.by.contains(&By::Friction) && system.friction == 0.0 {
            return known;
        }
        let mut pre = PreImpact::new(system.contact, &impact.pre);
        if pre.sin == 0.0 {
            pre.sin = FAINT;
        }
        let faint = System { friction: system.friction.max(FAINT), ..system.clone() };
        let Ok(outcome) = resolve(&faint, &pre) else { return known };
        (outcome.regime.kind(), Signs::of(outcome.regime, pre.v1, pre.sin))
    }
}

/// d g/d gap with the sign of x2: how far body 2 is in the tip's place.
pub(super) fn moves_stop(by: By) -> f64 {
    f64::from(u8::from(by == By::Gap))
}

//! The gap between the pendulum's tip and body 2 along a flight, as the contact search asks for it
//! (src/search/gap.rs): g = tip(x1) - x2 - delta (docs/theory.md, section 1).

#![allow(clippy::inline_always)] // what calls them is compiled for several instruction sets

use std::marker::PhantomData;

use super::{Equation, Flight, FreeMotion, Motion, Point, States};
use crate::model::angle::Angle;
use crate::model::parameters::{Contact, System};
use crate::model::state::{Clock, ModelState, State};
use crate::model::tip::{Direct, Oblique, Tip};
use crate::numerics::elementary::{self, MOST_TURNED};
use crate::numerics::lanes::{self, LANES};
use crate::search::first_contact::{self, Start};
use crate::search::gap::{BoundedGap, Gap, GapBounds, GapPoint, Higher, noise};
use crate::search::steps::{Jet, Jets, ScanStart, SteppedGap, Weights};
use crate::search::tolerances::{BOUND_MARGIN, SCAN_SPANS};

/// A contact of this machine, or the top of a graze.
pub type Touch = first_contact::Touch<State>;
/// What a search along a flight of this machine found.
pub type Found = first_contact::Found<State>;
/// Outcome and cost of a search along a flight of this machine.
pub type ContactReport = first_contact::ContactReport<State>;

/// The gap along a flight, in one of the two geometries.
pub(crate) struct TipGap<'a, T> {
    motion: &'a FreeMotion,
    flight: &'a Flight,
    tip: PhantomData<T>,
}

impl<'a, T: Tip> TipGap<'a, T> {
    #[inline(always)]
    pub fn new(motion: &'a FreeMotion, flight: &'a Flight) -> Self {
        Self { motion, flight, tip: PhantomData }
    }

    /// With bounds of its own; `touching`: the flight starts on the contact.
    pub fn bounded(&self, touching: bool) -> BoundedGap<'_, Self> {
        BoundedGap::new(self, touching, self.bounds())
    }
}

/// What becomes of bodies that never meet again.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Apart {
    /// They swing for ever.
    Swings,
    /// They settle on the response to the drive: what is left of their free motion decays at least
    /// by this rate.
    Settles(f64),
}

/// What becomes of the bodies from this state in free flight on, if it is certain that they never
/// meet again.
pub(crate) fn stays_apart(system: &System, clock: Clock, state: State) -> Option<Apart> {
    let motion = FreeMotion::new(system);
    let (flight, slack) = (motion.flight(clock, state), system.gap_noise(&state));
    let apart = match system.contact {
        Contact::Oblique => TipGap::<Oblique>::new(&motion, &flight).never_meets(slack),
        Contact::Direct => TipGap::<Direct>::new(&motion, &flight).never_meets(slack),
    };
    let slowest = motion.pendulum.slowest_decay().min(motion.oscillator.slowest_decay());
    let becomes = if slowest > 0.0 { Apart::Settles(slowest) } else { Apart::Swings };
    apart.then_some(becomes)
}

/// Angle, and motions of pendulum and body 2, at one instant.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Instant {
    angle: Angle,
    bodies: (Motion, Motion),
}

impl<T: Tip> Gap for TipGap<'_, T> {
    type Instant = Instant;
    type State = State;

    #[inline(always)]
    fn start(&self) -> (f64, f64) {
        start_of::<T>(&self.flight.state, self.flight.angle, self.motion.gap)
    }

    fn bounds(&self) -> GapBounds {
        let (p, o) = self.motion.bounds(self.flight);
        GapBounds {
            slope_noise: T::slope_noise(self.flight.state.x1, p.0[0]),
            rate: p.0[0] + o.0[0],
            fourth: (T::fourth_bound(&p.0) + o.0[3]) * BOUND_MARGIN,
            fifth: f64::INFINITY,
            sixth: f64::INFINITY,
        }
    }

    #[inline(always)]
    fn change(&self, s: f64) -> (GapPoint, Instant) {
        let bodies = self.motion.at(self.flight, s);
        let turned =
            if T::TURNS { elementary::turn(bodies.0.increment, 0.0) } else { elementary::STRAIGHT };
        let (gap, angle) = change_of::<T>(self.flight.angle, turned, &bodies);
        (gap, Instant { angle, bodies })
    }

    #[inline(always)]
    fn higher(&self, Instant { angle, bodies }: &Instant) -> Higher {
        higher_of::<T>(self.motion.equations(), *angle, bodies)
    }

    #[inline(always)]
    fn state(&self, instant: &Instant, h: f64) -> State {
        self.motion.state_later(&instant.bodies, h)
    }
}

impl<T: Tip> SteppedGap for TipGap<'_, T> {
    type Place = Point;
    type Places = States;

    #[inline(always)]
    fn scan_start(&self) -> ScanStart {
        let Self { motion, flight, .. } = self;
        let bounds = (
            motion.pendulum.derivative_bounds(&flight.pendulum),
            motion.oscillator.derivative_bounds(&flight.oscillator),
        );
        let Flight { state, angle, start, .. } = flight;
        scan_start::<T>(motion.equations(), motion.gap, state, *angle, start.cos, bounds)
    }

    /// Bounds of steady motions hold for ever, others for one span.
    #[inline(always)]
    fn bounds_hold(&self) -> f64 {
        let FreeMotion { pendulum, oscillator, span, .. } = self.motion;
        if pendulum.is_steady() && oscillator.is_steady() { SCAN_SPANS * span } else { *span }
    }

    #[inline(always)]
    fn reach(&self) -> f64 {
        self.motion.reach
    }

    #[inline(always)]
    fn extent(&self) -> f64 {
        let State { x1, x2, .. } = self.flight.state;
        x1.abs() + x2.abs() + self.motion.gap.abs()
    }

    #[inline(always)]
    fn steps_hold(&self, moved: f64) -> bool {
        !T::TURNS || self.flight.state.x1.abs() + moved <= MOST_TURNED
    }

    /// By the amplitudes of all parts of the motion about the equilibria: those of the steady
    /// responses each by itself, or as they go together.
    #[inline(always)]
    fn never_meets(&self, slack: f64) -> bool {
        let FreeMotion { pendulum, oscillator, .. } = self.motion;
        let &FreeMotion { equilibrium, gap_at_rest, .. } = self.motion;
        let (free1, steady1) = pendulum.amplitudes(&self.flight.pendulum);
        let (free2, steady2) = oscillator.amplitudes(&self.flight.oscillator);
        let (highest, ahead) = T::reach(equilibrium, free1 + steady1);
        let together = pendulum.steady_difference(oscillator) + free1 + free2 + ahead + equilibrium;
        (highest + free2 + steady2).min(together) * BOUND_MARGIN < gap_at_rest - slack
    }

    #[inline(always)]
    fn higher_at_start(&self) -> (f64, f64) {
        let (motion, angle) = (self.motion, self.flight.angle);
        let bodies = motion.at_start(self.flight);
        let (gap, angle) = change_of::<T>(angle, elementary::STRAIGHT, &bodies);
        (gap.third, higher_of::<T>(motion.equations(), angle, &bodies).fourth)
    }

    #[inline(always)]
    fn remainder_factor(&self) -> f64 {
        self.motion.remainder_factor
    }

    #[inline(always)]
    fn place(&self) -> Point {
        let State { x1, v1, x2, v2 } = self.flight.state;
        Point { x1, v1, x2, v2, psi: self.flight.start }
    }

    #[inline(always)]
    fn step(&self, level: usize) -> f64 {
        self.motion.step(level)
    }

    #[inline(always)]
    fn weights(&self, level: usize) -> &Weights {
        &self.motion.table(level).weights
    }

    #[inline(always)]
    #[allow(clippy::needless_range_loop)] // loops over lanes read best with their index
    fn eight_steps(&self, level: usize, from: &Point) -> (States, Jets) {
        let motion = self.motion;
        let (pendulum, oscillator) = motion.equations();
        let states = motion.table(level).states(from);
        let (mut value, mut rate, mut second) = ([0.0; LANES], [0.0; LANES], [0.0; LANES]);
        for j in 0..LANES {
            let (x1, v1, x2, v2) = (states.x1[j], states.v1[j], states.x2[j], states.v2[j]);
            let a1 = pendulum.acceleration(x1, v1, states.cos_psi[j]);
            let a2 = oscillator.acceleration(x2, v2, states.cos_psi[j]);
            let tip = T::fast(x1, v1, a1);
            value[j] = tip[0] - x2 - motion.gap;
            rate[j] = tip[1] - v2;
            second[j] = tip[2] - a2;
        }
        (states, Jets { value, rate, second })
    }

    #[inline(always)]
    fn place_after(states: &States, j: usize) -> Point {
        states.point(j)
    }
}

/// Gap function and size of its terms in a state.
#[inline(always)]
pub(crate) fn start_of<T: Tip>(state: &State, angle: Angle, gap: f64) -> (f64, f64) {
    let (tip, x2) = (T::position(state.x1, angle), state.x2);
    (tip - x2 - gap, tip.abs() + x2.abs() + gap.abs())
}

/// Change of the gap since the start of a flight by a motion of both bodies, and the angle;
/// `turned`: (cos - 1, sin) of the increment of x1.
#[inline(always)]
pub(crate) fn change_of<T: Tip>(
    start: Angle,
    turned: (f64, f64),
    (p, o): &(Motion, Motion),
) -> (GapPoint, Angle) {
    let motion = [p.increment, p.rate, p.acceleration, p.jerk];
    let (tip, angle) = T::change(start, turned, motion);
    let gap = GapPoint {
        value: tip[0] - o.increment,
        rate: tip[1] - o.rate,
        second: tip[2] - o.acceleration,
        third: tip[3] - o.jerk,
    };
    (gap, angle)
}

/// Higher derivatives of the gap after a motion of both bodies.
#[inline(always)]
pub(crate) fn higher_of<T: Tip>(
    (pendulum, oscillator): (&Equation, &Equation),
    angle: Angle,
    (p, o): &(Motion, Motion),
) -> Higher {
    let [fourth, fifth, _] = pendulum.higher(p);
    let [others_fourth, others_fifth, _] = oscillator.higher(o);
    let tip = T::higher(angle, [p.rate, p.acceleration, p.jerk, fourth, fifth]);
    Higher { fourth: tip[0] - others_fourth, fifth: tip[1] - others_fifth }
}

/// The jet of the gap in a state, and bounds of its derivatives from bounds of the derivatives 1 to
/// 6 of both displacements.
#[inline(always)]
pub(crate) fn scan_start<T: Tip>(
    (pendulum, oscillator): (&Equation, &Equation),
    gap: f64,
    state: &State,
    angle: Angle,
    cos_psi: f64,
    (p, o): ([f64; 6], [f64; 6]),
) -> ScanStart {
    let &State { x1, v1, x2, v2 } = state;
    let [fourth, fifth, sixth] = T::high_bounds(&p);
    let bounds = GapBounds {
        slope_noise: T::slope_noise(x1, p[0]),
        rate: p[0] + o[0],
        fourth: (fourth + o[3]) * BOUND_MARGIN,
        fifth: fifth + o[4],
        sixth: sixth + o[5],
    };
    let a1 = pendulum.acceleration(x1, v1, cos_psi);
    let a2 = oscillator.acceleration(x2, v2, cos_psi);
    let [rate, second] = T::rates(angle, v1, a1);
    let value = T::position(x1, angle) - x2 - gap;
    ScanStart { start: Jet { value, rate: rate - v2, second: second - a2 }, bounds }
}

/// First contact of `flight` in (0, `span`], `span` at most that of the motion; none where that is
/// empty.
#[must_use]
pub fn next_contact(
    motion: &FreeMotion,
    flight: &Flight,
    start: Start,
    span: f64,
) -> ContactReport {
    if span.is_nan() || span <= 0.0 {
        return ContactReport { found: Found::Clear(0.0), evaluations: 0 };
    }
    let span = span.min(motion.span);
    let mut report = lanes::narrow(SearchJob { motion, flight, start, span });
    match report.found {
        Found::Contact(touch) | Found::Graze(touch) | Found::Resting(touch)
            if !touch.state.is_finite() || !touch.local_time().is_finite() =>
        {
            report.found = Found::NotFinite;
        }
        Found::Contact(touch) if touch.local_time() > span => report.found = Found::Clear(span),
        _ => {}
    }
    report
}

/// A search, compiled for each kind of vector instructions.
struct SearchJob<'a> {
    motion: &'a FreeMotion,
    flight: &'a Flight,
    start: Start,
    span: f64,
}

impl pulp::NullaryFnOnce for SearchJob<'_> {
    type Output = ContactReport;

    #[inline(always)]
    fn call(self) -> ContactReport {
        first_contact(self.motion, self.flight, self.start, self.span)
    }
}

/// [`next_contact`], for callers that are compiled for several instruction sets themselves.
#[inline(always)]
pub(crate) fn first_contact(
    motion: &FreeMotion,
    flight: &Flight,
    start: Start,
    span: f64,
) -> ContactReport {
    match motion.contact {
        Contact::Oblique => first_contact_of::<Oblique>(motion, flight, start, span),
        Contact::Direct => first_contact_of::<Direct>(motion, flight, start, span),
    }
}

#[inline(always)]
fn first_contact_of<T: Tip>(
    motion: &FreeMotion,
    flight: &Flight,
    start: Start,
    span: f64,
) -> ContactReport {
    first_contact::first_contact(&TipGap::<T>::new(motion, flight), start, span)
}

impl FreeMotion {
    /// Equations of both bodies.
    #[inline(always)]
    fn equations(&self) -> (&Equation, &Equation) {
        (&self.pendulum.equation, &self.oscillator.equation)
    }

    /// The gap function and its derivatives at the start of a flight on the contact.
    pub(crate) fn contact_gap(&self, flight: &Flight) -> GapPoint {
        match self.contact {
            Contact::Oblique => TipGap::<Oblique>::new(self, flight).change(0.0).0,
            Contact::Direct => TipGap::<Direct>::new(self, flight).change(0.0).0,
        }
    }
}

impl System {
    /// Rounding level of [`System::gap_function`] there.
    pub(crate) fn gap_noise(&self, state: &State) -> f64 {
        noise(self.tip(state.x1).abs() + state.x2.abs() + self.gap.abs())
    }
}

//! Free flights, the impacts that end them, and grazes.

#![allow(clippy::inline_always)] // a flight is compiled for several instruction sets

use super::{Anchor, Checkpoint, Completion, FlightStart, Observer, Phase, Simulation, Turn};
use crate::contact::chatter::{Bounce, Limit};
use crate::contact::sustained::Next;
use crate::flight::Flight;
use crate::flight::gap::first_contact;
use crate::flight::{Found, Touch};
use crate::impact::{self, Impact, ImpactFailure, PreImpact, RegimeKind};
use crate::model::angle::Angle;
use crate::model::error::SimulationError;
use crate::model::parameters::System;
use crate::model::state::{Clock, State};
use crate::numerics::EPS;
use crate::numerics::double_double::DoubleDouble;
use crate::numerics::lanes;
use crate::search::Start;
use crate::simulate::event::{Event, GrazeEvent, ImpactEvent, StopReason};
use crate::simulate::tolerances::{
    CHATTER_LEADING_RTOL, LOOSEST_COMPLETION, STANDSTILL_EVENTS, STANDSTILL_TIME,
};

impl Simulation {
    /// One local flight, and the impact that ends it.
    pub(super) fn fly<O: Observer>(&mut self, began: FlightStart, observer: &mut O) -> Turn {
        lanes::narrow(FlightStep { simulation: self, began, observer })
    }

    #[inline(always)]
    fn fly_to_impact<O: Observer>(&mut self, began: FlightStart, observer: &mut O) -> Turn {
        let found = self.search(began);
        let (time, offset) = match found {
            Found::Contact(touch) | Found::Graze(touch) | Found::Resting(touch) => {
                (touch.time, touch.offset)
            }
            Found::Clear(time) => (time, 0.0),
            // The law as printed creates energy without bound.
            Found::NotFinite | Found::Stalled if !self.system.law.is_coulomb() => {
                return Some(Ok(self.stop_here(StopReason::LawFailed)));
            }
            Found::NotFinite => return Some(Err(self.fail(false))),
            Found::Stalled => return Some(Err(self.fail(true))),
        };
        let over = self.horizon_before(time, offset, matches!(found, Found::Contact(_)));
        let reached = over.unwrap_or(DoubleDouble::sum(time, offset));
        self.pass_sections_in_flight(reached, over.is_some(), observer);
        if let Some(end) = over {
            // A run that goes on uses what was found.
            self.found = Some(found);
            let state = self.motion.state_within(&self.flight, end.not_negative());
            return Some(Ok(self.stop_at_horizon(state)));
        }
        match found {
            Found::Contact(touch) => self.strike(&touch, observer),
            Found::Graze(touch) | Found::Resting(touch) if !is_finite(&touch) => {
                Some(Err(self.fail(false)))
            }
            Found::Graze(touch) => self.graze(&touch),
            Found::Resting(touch) => self.come_to_rest(&touch),
            _ => {
                let (elapsed, grazed) = (self.point.elapsed, self.point.grazed);
                self.point.elapsed = elapsed + DoubleDouble::new(time);
                self.point.grazed = None;
                self.enter_flight();
                if self.flight.state.is_finite() {
                    return None;
                }
                // The failure is reported at the last finite state.
                (self.point.elapsed, self.point.grazed) = (elapsed, grazed);
                self.enter_flight();
                Some(Err(self.fail(false)))
            }
        }
    }

    /// Local time of the horizon if it lies before this one, at which the bodies may strike: told
    /// by the clock that the event will have. An event at the very end still belongs to the run.
    #[inline(always)]
    pub(super) fn horizon_before(
        &self,
        time: f64,
        offset: f64,
        strikes: bool,
    ) -> Option<DoubleDouble> {
        if self.is_far(self.end, time + offset) {
            return None;
        }
        let end = self.horizon_in_leg();
        let (reached, last) = (time + offset, end.value());
        let level = EPS * (4.0 * (reached.abs() + last.abs()) + self.motion.drive.period.hi);
        // An impact at the very end, to rounding, belongs to the run.
        let over = if !strikes && (reached - last).abs() < level {
            self.clock_at(time, offset) > self.end
        } else {
            reached > last
        };
        over.then_some(end)
    }

    /// Starts the present local flight, from the anchor without accumulating rounding.
    pub(super) fn enter_flight(&mut self) {
        let Anchor { clock, state, .. } = self.point.anchor;
        self.found = None;
        self.flight = self.motion.flight(clock, state);
        let elapsed = self.point.elapsed;
        if elapsed.hi > 0.0 {
            let state = self.motion.state_after(&self.flight, elapsed);
            self.flight = self.motion.flight(self.motion.drive.advance(clock, elapsed), state);
        }
    }

    #[inline(always)]
    fn search(&mut self, began: FlightStart) -> Found {
        if let Some(found) = self.found {
            return found;
        }
        let start = self.start(began);
        let report = first_contact(&self.motion, &self.flight, start, self.motion.span);
        self.evaluations += report.evaluations;
        self.checked_against_graze(report.found)
    }

    /// What was found, if its last step is one within a local flight, and not before the graze from
    /// which the flight goes on.
    #[inline(always)]
    pub(super) fn checked_against_graze(&self, found: Found) -> Found {
        match found {
            Found::Contact(touch) | Found::Graze(touch) | Found::Resting(touch)
                if touch.offset.abs() > self.motion.span || touch.local_time().is_nan() =>
            {
                Found::NotFinite
            }
            _ if self.point.grazed.is_some() => self.after_graze(found),
            _ => found,
        }
    }

    #[inline(never)]
    fn after_graze(&self, mut found: Found) -> Found {
        if let (Some(hi), Found::Contact(touch) | Found::Graze(touch) | Found::Resting(touch)) =
            (self.point.grazed, &mut found)
        {
            let before = DoubleDouble { hi, lo: self.point.grazed_rest };
            if DoubleDouble::sum(touch.time, touch.offset) < before {
                (touch.time, touch.offset) = (before.hi, before.lo);
            }
        }
        found
    }

    /// How the present local flight starts.
    #[inline(always)]
    pub(super) fn start(&self, began: FlightStart) -> Start {
        match (self.point.grazed, began) {
            (Some(time), _) => Start::Grazed(time),
            (None, FlightStart::Touching) if self.point.elapsed.hi == 0.0 => Start::Touching,
            (None, FlightStart::Released) if self.point.elapsed.hi == 0.0 => Start::Released,
            _ => Start::Apart,
        }
    }

    /// Impact at the end of a flight.
    #[inline(always)]
    pub(super) fn strike<O: Observer>(&mut self, touch: &Touch, observer: &mut O) -> Turn {
        // g = 0 to rounding: the state is moved onto it, so that rounding does not add up.
        let (pre, angle) = self.system.touching_at(touch.state);
        self.strike_from((touch.time, touch.offset), pre, angle, touch.gap.rate, observer)
    }

    /// Impact of a start on the contact that approaches.
    pub(super) fn strike_at_start<O: Observer>(&mut self, observer: &mut O) -> Turn {
        let pre = self.point.anchor.state;
        let rate = self.system.approach_velocity(&pre);
        self.strike_from((0.0, 0.0), pre, self.system.contact.angle(pre.x1), rate, observer)
    }

    /// Impact at a local time, and a new flight.
    #[inline(always)]
    fn strike_from<O: Observer>(
        &mut self,
        (time, offset): (f64, f64),
        pre: State,
        angle: Angle,
        rate: f64,
        observer: &mut O,
    ) -> Turn {
        let mut clock = self.clock_at(time, offset);
        clock.residual = self.motion.drive.ticked(clock.residual);
        let mut velocities = PreImpact::at(angle, &pre);
        if velocities.approach_velocity() <= 0.0 {
            // The approach velocity is below rounding; the search's own is positive.
            velocities.v2 = velocities.v1 * velocities.cos - rate.max(f64::MIN_POSITIVE);
        }
        let impact = match impact::resolve(&self.system, &velocities) {
            Ok(impact) => impact,
            Err(failure) => {
                let reason = match failure {
                    ImpactFailure::Jammed => StopReason::Jammed,
                    ImpactFailure::LawFailed => StopReason::LawFailed,
                };
                return Some(Ok(self.stop(clock, self.motion.drive.time(clock), pre, reason)));
            }
        };
        let post = State { v1: impact.v1_post, v2: impact.v2_post, ..pre };
        if !(post.is_finite() && impact.is_finite()) {
            return Some(Err(self.fail(false)));
        }
        self.flight = self.motion.flight_at(clock, post, angle);
        let turn = self.rebound(pre, impact, observer);
        // Where flight and contact both fit, neither is chosen (docs/theory.md, section 5).
        if impact.ends_at_rest() && self.system.has_no_contact_force(self.flight.start, &post) {
            self.point.anchor.phase = Phase::Landing;
        }
        turn
    }

    /// An impact has happened, and the present flight begins.
    #[inline(always)]
    fn rebound<O: Observer>(&mut self, pre: State, impact: Impact, observer: &mut O) -> Turn {
        let Flight { clock, state, .. } = self.flight;
        if self.leave(clock, state, impact.regime.kind(), impact.approach_velocity) {
            self.complete_chatter_if_certain(&impact);
        }
        // The clock may have moved on.
        let skipped = observer.skips(self.flight.clock, &state);
        (!skipped).then(|| Ok(self.record(pre, impact)))
    }

    /// The present flight begins at this clock and state, with an impact; whether chatter may have
    /// begun.
    #[inline(always)]
    pub(super) fn leave(
        &mut self,
        clock: Clock,
        state: State,
        regime: RegimeKind,
        approach_velocity: f64,
    ) -> bool {
        self.point.anchor = Anchor::after_impact(clock, state);
        self.point.elapsed = DoubleDouble::ZERO;
        self.point.grazed = None;
        self.found = None;
        self.point.impacts += 1;
        self.point.events += 1;
        self.point.standstill = 0;
        let restitution = self.system.restitution;
        let chatters =
            self.point.monitor.observe(regime, approach_velocity, restitution) && self.completes;
        if let Some(recurrence) = &mut self.recurrence
            && recurrence.may_repeat(clock)
        {
            self.look_for_repeat();
        }
        chatters
    }

    /// The impact from which the present flight has begun.
    #[inline(always)]
    pub(super) fn record(&self, pre: State, impact: Impact) -> Event {
        let Flight { clock, state: post, .. } = self.flight;
        // To rounding it is at the end, and belongs there.
        let clock = if clock > self.end { self.end } else { clock };
        let (time, phase) = (self.motion.drive.time(clock), self.motion.drive.phase_at(clock));
        Event::Impact(ImpactEvent { clock, time, phase, pre, post, impact })
    }

    /// Skips the impacts that follow, if they are chatter.
    #[inline(never)]
    pub(super) fn complete_chatter_if_certain(&mut self, impact: &Impact) {
        self.point.completion = self.chatter_ahead(self.flight.clock, impact);
    }

    /// The end of chatter, if it is known within the tolerance and contact follows.
    fn chatter_ahead(&mut self, clock: Clock, impact: &Impact) -> Option<Completion> {
        let post = self.point.anchor.state;
        let drive = &self.motion.drive;
        let upper = |x1: f64| self.system.contact.angle(x1).sin > 0.0;
        let bounce = Bounce {
            regime: impact.regime.kind(),
            separation: -impact.separation_velocity,
            clock,
            slip: post.v1,
            upper: upper(post.x1),
            others: [post.x1, post.v2],
        };
        let limit = self.point.monitor.extrapolate(drive, &bounce)?;
        if bounce.regime == RegimeKind::Slip && upper(limit.others[0]) != bounce.upper {
            return None;
        }
        let gap = self.motion.contact_gap(&self.flight);
        if gap.second <= 0.0 {
            return None;
        }
        let leading = 2.0 * -impact.separation_velocity / (gap.second * (1.0 - limit.ratio));
        let agrees = (limit.time - leading).abs() <= CHATTER_LEADING_RTOL * limit.time;
        if !agrees || limit.time > self.motion.span {
            return None;
        }
        let completion = self.completion(&limit, &post, gap.second);
        if completion.error > self.chatter_tolerance.min(LOOSEST_COMPLETION) {
            return None;
        }
        let phase = self.motion.drive.trig_at(completion.clock);
        let holds = matches!(self.system.land(phase, &completion.state), Next::Hold(_));
        holds.then_some(completion)
    }

    /// The accumulation point that lies `limit` after the start of the present flight.
    pub(super) fn completion(&self, limit: &Limit, post: &State, second: f64) -> Completion {
        let drive = &self.motion.drive;
        let clock = drive.advance(self.flight.clock, DoubleDouble::new(limit.time));
        let size = post.to_array().iter().fold(0.0, |most: f64, c| most.max(c.abs()));
        // A rounded x1 turns x1' cos x1 by |x1 x1'| roundings.
        let speed = post.v1.abs() * (1.0 + post.x1.abs()) + post.v2.abs();
        let mut error = limit.error + limit.rounding(size, speed, second);
        let (x1, v1) = (limit.others[0], limit.slip);
        let state = if self.system.is_wall() {
            // The wall's own motion, which x1' = x2'/cos x1 magnifies.
            error /= self.system.tip_slope(x1).powi(2);
            let free = self.motion.state_at(&self.flight, limit.time);
            self.system.landed(State { x1, v1, ..free })
        } else {
            self.system.on_contact(x1, v1)
        };
        let resolution = EPS * clock.time_in_period.max(1.0);
        Completion {
            clock,
            state,
            impacts_skipped: ((limit.time / resolution).ln() / -limit.ratio.ln()).ceil().max(0.0),
            time_jump: limit.time,
            error,
        }
    }

    fn graze(&mut self, touch: &Touch) -> Turn {
        let (clock, time, phase) = self.place(touch.time, touch.offset);
        let state = touch.state;
        let pre = PreImpact::new(self.system.contact, &state);
        if impact::approach_grows(&self.system, &pre) {
            return Some(Ok(self.stop(clock, time, state, StopReason::UndecidableGraze)));
        }
        let before = self.point.grazed.unwrap_or(f64::NEG_INFINITY);
        if touch.local_time() <= before + STANDSTILL_TIME * self.motion.span {
            // The gap stays at rounding level: such grazes do not follow one another for ever.
            self.point.standstill += 1;
            if self.point.standstill > STANDSTILL_EVENTS {
                self.anchor(clock, self.system.landed(state), Phase::Landing);
                return None;
            }
        }
        let DoubleDouble { hi, lo } = DoubleDouble::sum(touch.time, touch.offset);
        (self.point.grazed, self.point.grazed_rest) = (Some(hi), lo);
        self.point.events += 1;
        self.found = None;
        let gap_acceleration = touch.gap.second;
        Some(Ok(Event::Graze(GrazeEvent { clock, time, phase, state, gap_acceleration })))
    }

    /// The state at local time `s` inside a chatter sequence that is skipped: its hops one by one
    /// from the last impact.
    pub(super) fn hop(&self, completion: &Completion, s: f64) -> State {
        let target = self.motion.drive.advance(self.flight.clock, DoubleDouble::new(s));
        let (state, _) = hops(&self.system, self.point.anchor, target);
        state.unwrap_or_else(|| completion.state.earlier(completion.time_jump - s))
    }
}

fn is_finite(touch: &Touch) -> bool {
    touch.state.is_finite() && touch.local_time().is_finite()
}

/// A flight and the usual events at its end, compiled for each set of vector instructions.
struct FlightStep<'a, O> {
    simulation: &'a mut Simulation,
    began: FlightStart,
    observer: &'a mut O,
}

impl<O: Observer> pulp::NullaryFnOnce for FlightStep<'_, O> {
    type Output = Turn;

    #[inline(always)]
    fn call(self) -> Turn {
        self.simulation.fly_to_impact(self.began, self.observer)
    }
}

/// State at `target` by single hops, `None` if the bodies come to rest before; and the last hop's
/// start, from which a later time can go on.
pub(crate) fn hops(system: &System, anchor: Anchor, target: Clock) -> (Option<State>, Anchor) {
    let mut simulation = Simulation::hopping(system, anchor, target);
    let mut last = anchor;
    loop {
        match simulation.advance(&mut ()) {
            Some(Ok(Event::Impact(_))) => last = simulation.point.anchor,
            Some(Ok(Event::Graze(_))) => {}
            Some(Ok(Event::Stop(stop))) => return (Some(stop.state), last),
            _ => return (None, last),
        }
    }
}

/// The impacts of single hops up to `target`, or until the bodies come to rest.
pub(crate) fn impacts_hop_by_hop(
    system: &System,
    anchor: Anchor,
    target: Clock,
) -> impl Iterator<Item = ImpactEvent> {
    let is_hop = |event: &Result<Event, SimulationError>| {
        matches!(event, Ok(Event::Impact(_) | Event::Graze(_)))
    };
    Simulation::hopping(system, anchor, target).take_while(is_hop).filter_map(|event| match event {
        Ok(Event::Impact(impact)) => Some(impact),
        _ => None,
    })
}

impl Simulation {
    /// A simulation that resolves chatter, hop by hop.
    fn hopping(system: &System, anchor: Anchor, target: Clock) -> Self {
        let mut simulation = Self::from_checkpoint(system, &Checkpoint::at(anchor));
        (simulation.completes, simulation.end) = (false, target);
        simulation.max_events = u64::MAX;
        simulation
    }
}

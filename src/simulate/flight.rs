//! Free flights, the impacts that end them, and grazes.

#![allow(clippy::inline_always)] // a flight is compiled for several instruction sets

use super::model::{ChatterView, NotStruck, Struck};
use super::{
    Anchor, AnchorOf, Checkpoint, Completion, FlightStart, Horizon, Leg, Model, ModelEvent,
    Observer, Simulation, Turn,
};
use crate::contact::chatter::{Limit, Scales};
use crate::model::state::{Clock, ModelState};
use crate::numerics::EPS;
use crate::numerics::double_double::DoubleDouble;
use crate::numerics::lanes;
use crate::search::Start;
use crate::search::first_contact::{Found, Touch};
use crate::simulate::event::StopReason;
use crate::simulate::tolerances::{
    CHATTER_LEADING_RTOL, DEFAULT_MAX_TIME, LOOSEST_COMPLETION, STANDSTILL_EVENTS, STANDSTILL_TIME,
};

impl<M: Model> Simulation<M> {
    /// One local flight, and the impact that ends it.
    pub(super) fn fly<O: Observer<M::State>>(
        &mut self,
        began: FlightStart,
        observer: &mut O,
    ) -> Turn<M> {
        lanes::narrow(FlightStep { simulation: self, began, observer })
    }

    #[inline(always)]
    fn fly_to_impact<O: Observer<M::State>>(
        &mut self,
        began: FlightStart,
        observer: &mut O,
    ) -> Turn<M> {
        let found = self.search(began);
        let (time, offset) = match found {
            Found::Contact(touch) | Found::Graze(touch) | Found::Resting(touch) => {
                (touch.time, touch.offset)
            }
            Found::Clear(time) => (time, 0.0),
            // The law as printed creates energy without bound.
            Found::NotFinite | Found::Stalled if self.system.diverges_by_law() => {
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
            let state = M::state_within(&self.motion, &self.flight, end.not_negative());
            return Some(Ok(self.stop_at_horizon(state)));
        }
        match found {
            Found::Contact(touch) => M::meet(self, &touch, observer),
            Found::Graze(touch) | Found::Resting(touch) if !self.is_finite(&touch) => {
                Some(Err(self.fail(false)))
            }
            Found::Graze(touch) => self.graze(&touch),
            Found::Resting(touch) => self.come_to_rest(&touch),
            _ if matches!(self.horizon, Horizon::Impacts { .. })
                && M::rests(&self.motion, &self.flight) =>
            {
                Some(Ok(self.stop_here(StopReason::Rest)))
            }
            _ => {
                let (elapsed, grazed) = (self.point.elapsed, self.point.grazed);
                self.point.elapsed = elapsed + DoubleDouble::new(time);
                self.point.grazed = None;
                self.enter_flight();
                if self.flight.state().is_finite() {
                    return None;
                }
                // The failure is reported at the last finite state.
                (self.point.elapsed, self.point.grazed) = (elapsed, grazed);
                self.enter_flight();
                Some(Err(self.fail(false)))
            }
        }
    }

    fn is_finite(&self, touch: &Touch<M::Touched>) -> bool {
        M::touched(&self.motion, &self.flight, touch).is_finite() && touch.local_time().is_finite()
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
        let level = EPS * (4.0 * (reached.abs() + last.abs()) + self.drive().period.hi);
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
        let Anchor { clock, ref state, .. } = self.point.anchor;
        self.found = None;
        self.flight = self.flight_from(clock, state.clone());
        let elapsed = self.point.elapsed;
        if elapsed.hi > 0.0 {
            let state = M::state_after(&self.motion, &self.flight, elapsed);
            self.flight = self.flight_from(self.drive().advance(clock, elapsed), state);
        }
    }

    /// A local flight of the present leg.
    #[inline(always)]
    pub(super) fn flight_from(&self, clock: Clock, state: M::State) -> M::Flight {
        self.system.flight(&self.motion, &self.point.anchor, clock, state)
    }

    #[inline(always)]
    fn search(&mut self, began: FlightStart) -> Found<M::Touched> {
        if let Some(found) = self.found {
            return found;
        }
        let start = self.start(began);
        let report = self.system.search(
            &self.motion,
            &self.point.anchor,
            &self.flight,
            start,
            self.point.contact,
        );
        self.evaluations += report.evaluations;
        self.checked_against_graze(report.found)
    }

    /// What was found, if its last step is one within a local flight, and not before the graze from
    /// which the flight goes on.
    #[inline(always)]
    pub(super) fn checked_against_graze(&self, found: Found<M::Touched>) -> Found<M::Touched> {
        match found {
            Found::Contact(touch) | Found::Graze(touch) | Found::Resting(touch)
                if touch.offset.abs() > M::span(&self.motion) || touch.local_time().is_nan() =>
            {
                Found::NotFinite
            }
            _ if self.point.grazed.is_some() => self.after_graze(found),
            _ => found,
        }
    }

    #[inline(never)]
    fn after_graze(&self, mut found: Found<M::Touched>) -> Found<M::Touched> {
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

    /// Clock of an impact at a local time.
    #[inline(always)]
    pub(super) fn impact_clock(&self, time: f64, offset: f64) -> Clock {
        let mut clock = self.clock_at(time, offset);
        clock.residual = self.drive().ticked(clock.residual);
        clock
    }

    /// An impact at this clock has happened, or not.
    #[inline(always)]
    pub(super) fn rebound<O: Observer<M::State>>(
        &mut self,
        clock: Clock,
        struck: Result<Struck<M>, NotStruck<M>>,
        observer: &mut O,
    ) -> Turn<M> {
        let Struck { pre, impact, flight, phase, touching } = match struck {
            Ok(struck) => struck,
            Err(NotStruck::NotFinite) => return Some(Err(self.fail(false))),
            Err(NotStruck::Stops(reason, pre)) => {
                return Some(Ok(self.stop(clock, self.drive().time(clock), pre, reason)));
            }
        };
        self.flight = flight;
        let view = self.system.chatter_view(&impact);
        if self.leave(Anchor { clock, state: self.flight.state().clone(), phase, touching }, &view)
        {
            self.complete_chatter_if_certain(&view);
        }
        // The clock may have moved on.
        let skipped = observer.skips(self.flight.clock(), self.flight.state());
        (!skipped).then(|| Ok(self.record(pre, impact)))
    }

    /// The present flight begins this leg, with an impact; whether chatter may have begun.
    #[inline(always)]
    pub(super) fn leave(&mut self, leg: AnchorOf<M>, view: &ChatterView) -> bool {
        self.point.anchor = leg;
        self.left(view)
    }

    /// The present flight has begun the present leg, with an impact; whether chatter may have begun.
    #[inline(always)]
    pub(super) fn left(&mut self, view: &ChatterView) -> bool {
        let clock = self.point.anchor.clock;
        self.point.elapsed = DoubleDouble::ZERO;
        self.point.grazed = None;
        self.found = None;
        self.point.impacts += 1;
        self.point.events += 1;
        self.point.standstill = 0;
        let &ChatterView { regime, approach, restitution, .. } = view;
        let chatters = self.point.monitor.observe(regime, approach, restitution) && self.completes;
        if let Some(recurrence) = &mut self.recurrence
            && recurrence.may_repeat(clock)
        {
            self.look_for_repeat();
        }
        chatters
    }

    /// The impact from which the present flight has begun.
    #[inline(always)]
    pub(super) fn record(&self, pre: M::State, impact: M::Impact) -> M::Event {
        let clock = self.flight.clock();
        // To rounding it is at the end, and belongs there.
        let clock = if clock > self.end { self.end } else { clock };
        let place = (clock, self.drive().time(clock), self.drive().phase_at(clock));
        M::impact_event(place, pre, self.flight.state().clone(), impact)
    }

    /// Skips the impacts that follow, if they are chatter.
    #[inline(never)]
    pub(super) fn complete_chatter_if_certain(&mut self, view: &ChatterView) {
        self.point.completion = self.chatter_ahead(self.flight.clock(), view);
        self.point.contact = view.contact;
    }

    /// The end of chatter, if it is known within the tolerance and contact follows.
    fn chatter_ahead(&mut self, clock: Clock, view: &ChatterView) -> Option<Completion<M::State>> {
        let bounce = self.system.bounce(view, clock, &self.point.anchor.state);
        let scales = self.system.scales(&self.motion, &self.flight, view.contact);
        let drive = M::drive(&self.motion);
        let limit = self.point.monitor.extrapolate(drive, &bounce, &scales)?;
        if !self.system.keeps_side(&bounce, &limit) {
            return None;
        }
        let [second, _] = self.system.gap_jet(&self.motion, &self.flight, view.contact);
        if second <= 0.0 {
            return None;
        }
        let leading = 2.0 * view.separation / (second * (1.0 - limit.ratio));
        let agrees = (limit.time - leading).abs() <= CHATTER_LEADING_RTOL * limit.time;
        if !agrees || limit.time > M::span(&self.motion) {
            return None;
        }
        if !self.is_alone(view.contact, limit.time) {
            return None;
        }
        let completion = self.completion(&limit, second, view.contact, &scales);
        if completion.error > self.chatter_tolerance.min(LOOSEST_COMPLETION) {
            return None;
        }
        let end = self.accumulation(&completion, view.contact);
        self.system.holds(&self.motion, &end).then_some(completion)
    }

    /// Whether no other contact can be met in so much time after the start of the present flight.
    pub(super) fn is_alone(&self, contact: u32, time: f64) -> bool {
        let Self { system, motion, flight, point, .. } = self;
        system.is_alone(motion, &point.anchor, flight, contact, time)
    }

    /// The accumulation point that lies `limit` after the start of the present flight.
    pub(super) fn completion(
        &self,
        limit: &Limit<M::Others>,
        second: f64,
        contact: u32,
        scales: &Scales,
    ) -> Completion<M::State> {
        let clock = self.drive().advance(self.flight.clock(), DoubleDouble::new(limit.time));
        let (size, speed) = self.system.sizes(&self.point.anchor.state, contact, scales);
        let (state, divisor) = self.system.limit_state(&self.motion, &self.flight, limit, contact);
        let error = (limit.error + limit.rounding(size, speed, second, scales)) / divisor;
        let resolution = EPS * clock.time_in_period.max(scales.time);
        Completion {
            clock,
            state,
            impacts_skipped: ((limit.time / resolution).ln() / -limit.ratio.ln()).ceil().max(0.0),
            time_jump: limit.time,
            error,
        }
    }

    fn graze(&mut self, touch: &Touch<M::Touched>) -> Turn<M> {
        let place = self.place(touch.time, touch.offset);
        let state = M::touched(&self.motion, &self.flight, touch);
        if self.system.grazes_undecidably(&state, &touch.state) {
            let (clock, time, _) = place;
            return Some(Ok(self.stop(clock, time, state, StopReason::UndecidableGraze)));
        }
        let before = self.point.grazed.unwrap_or(f64::NEG_INFINITY);
        if touch.local_time() <= before + STANDSTILL_TIME * M::span(&self.motion) {
            // The gap stays at rounding level: such grazes do not follow one another for ever.
            self.point.standstill += 1;
            if self.point.standstill > STANDSTILL_EVENTS {
                self.land_at(place.0, state, M::contact_of(&touch.state));
                return None;
            }
        }
        let DoubleDouble { hi, lo } = DoubleDouble::sum(touch.time, touch.offset);
        (self.point.grazed, self.point.grazed_rest) = (Some(hi), lo);
        self.point.contact = M::contact_of(&touch.state);
        self.point.events += 1;
        self.found = None;
        Some(Ok(M::graze_event(place, state, touch)))
    }

    /// The state at local time `s` inside a chatter sequence that is skipped: its hops one by one
    /// from the last impact.
    pub(super) fn hop(&self, completion: &Completion<M::State>, s: f64) -> M::State {
        let target = self.drive().advance(self.flight.clock(), DoubleDouble::new(s));
        let (state, _) = hops(&self.system, self.point.anchor.clone(), target);
        state.unwrap_or_else(|| completion.state.clone().earlier(completion.time_jump - s))
    }
}

/// A flight and the usual events at its end, compiled for each set of vector instructions.
struct FlightStep<'a, M: Model, O> {
    simulation: &'a mut Simulation<M>,
    began: FlightStart,
    observer: &'a mut O,
}

impl<M: Model, O: Observer<M::State>> pulp::NullaryFnOnce for FlightStep<'_, M, O> {
    type Output = Turn<M>;

    #[inline(always)]
    fn call(self) -> Turn<M> {
        self.simulation.fly_to_impact(self.began, self.observer)
    }
}

/// State at `target` by single hops, `None` if the bodies come to rest before; and the last hop's
/// start, from which a later time can go on.
pub(crate) fn hops<M: Model>(
    system: &M,
    anchor: AnchorOf<M>,
    target: Clock,
) -> (Option<M::State>, AnchorOf<M>) {
    let mut last = anchor.clone();
    let mut simulation = Simulation::hopping(system, anchor, target);
    loop {
        match simulation.advance(&mut ()) {
            Some(Ok(event)) if event.is_hop() => {
                if event.is_impact() {
                    last = simulation.point.anchor.clone();
                }
            }
            Some(Ok(event)) => return (event.as_stop().map(|stop| stop.state.clone()), last),
            _ => return (None, last),
        }
    }
}

/// The impacts of single hops up to `target`, or until the bodies come to rest.
pub(crate) fn impacts_hop_by_hop<M: Model>(
    system: &M,
    anchor: AnchorOf<M>,
    target: Clock,
) -> impl Iterator<Item = M::Event> {
    Simulation::hopping(system, anchor, target)
        .map_while(|event| event.ok().filter(ModelEvent::is_hop))
        .filter(ModelEvent::is_impact)
}

impl<M: Model> Simulation<M> {
    /// A simulation that resolves chatter, hop by hop.
    pub(crate) fn hopping(system: &M, anchor: AnchorOf<M>, target: Clock) -> Self {
        let mut simulation = Self::from_checkpoint(system, Checkpoint::at(anchor));
        (simulation.completes, simulation.end) = (false, target);
        simulation.max_events = u64::MAX;
        simulation
    }

    /// The same from another leg on.
    pub(crate) fn hops_from(&mut self, anchor: AnchorOf<M>, target: Clock) {
        let state = anchor.state.clone();
        self.flight = self.system.flight(&self.motion, &anchor, anchor.clock, state);
        self.point = Checkpoint::at(anchor);
        (self.found, self.evaluations) = (None, 0);
        self.end = M::drive(&self.motion).clock_at(DEFAULT_MAX_TIME);
        self.enter_flight();
        self.end = target;
    }
}

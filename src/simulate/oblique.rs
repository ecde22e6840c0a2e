//! The pendulum and the mass in the event loop: what it asks of them (model.rs).

#![allow(clippy::inline_always)] // a flight is compiled for several instruction sets
#![allow(private_interfaces)] // nobody outside of the crate can name the trait

mod contact;

use super::model::{ChatterView, Follows, Leg, Model, ModelEvent, NotStruck, Skipped, Struck};
use super::{Anchor, FlightStart, Observer, Phase, Simulation, Turn};
use crate::contact::chatter::{Bounce, Limit, Scales};
use crate::contact::sustained::{ContactForce, ContactMode, Next};
use crate::flight::gap::first_contact;
use crate::flight::{Drive, Flight, FreeMotion};
use crate::impact::{self, Impact, ImpactFailure, PreImpact, RegimeKind};
use crate::model::angle::Angle;
use crate::model::error::StateError;
use crate::model::parameters::System;
use crate::model::state::{Clock, ModelState, State};
use crate::numerics::EPS;
use crate::numerics::double_double::DoubleDouble;
use crate::numerics::lanes::LANES;
use crate::search::Start;
use crate::search::first_contact::{ContactReport, Touch};
use crate::search::tolerances::REST_NOISE;
use crate::simulate::event::{
    ChatterEvent, ContactEvent, Event, GrazeEvent, ImpactEvent, StopEvent, StopReason,
};

impl Leg<State> for Flight {
    #[inline(always)]
    fn clock(&self) -> Clock {
        self.clock
    }

    fn later_by(&mut self, periods: i64) {
        self.clock.period += periods;
    }

    #[inline(always)]
    fn state(&self) -> &State {
        &self.state
    }
}

impl ModelEvent<State> for Event {
    fn clock(&self) -> Clock {
        Event::clock(self)
    }

    fn stop(stop: StopEvent) -> Self {
        Self::Stop(stop)
    }

    #[inline(always)]
    fn as_stop(&self) -> Option<&StopEvent> {
        if let Self::Stop(stop) = self { Some(stop) } else { None }
    }

    fn is_impact(&self) -> bool {
        matches!(self, Self::Impact(_))
    }

    fn is_graze(&self) -> bool {
        matches!(self, Self::Graze(_))
    }
}

impl Model for System {
    type State = State;
    type Impact = Impact;
    type Event = Event;
    type Motion = FreeMotion;
    type Flight = Flight;
    type Touched = State;
    type Mode = ContactMode;
    const STOPS_SLIP: bool = false;
    type Touching = ();
    type Others = [f64; 2];
    type Bits = [u64; 4];

    fn motion(&self) -> FreeMotion {
        FreeMotion::new(self)
    }

    #[inline(always)]
    fn drive(motion: &FreeMotion) -> &Drive {
        &motion.drive
    }

    #[inline(always)]
    fn span(motion: &FreeMotion) -> f64 {
        motion.span
    }

    fn begin(&self, initial: State) -> Result<Anchor, StateError> {
        let initial = initial.checked()?;
        let gap = self.gap_function(&initial);
        let noise = self.gap_noise(&initial);
        let State { x1, v1, x2, v2 } = initial;
        if gap > noise {
            return Err(StateError::Penetrating { gap, x1, x2 });
        }
        if gap < -noise {
            return Ok(Anchor::apart(Clock::START, initial));
        }
        let approach = self.approach_velocity(&initial);
        let rest = REST_NOISE * EPS * (v1.abs() + v2.abs());
        let phase = if approach > rest {
            Phase::Strike
        } else if approach < -rest {
            Phase::Flight(FlightStart::Touching)
        } else {
            Phase::Landing
        };
        let state = match phase {
            Phase::Landing => System::landed(self, initial),
            _ => self.touching(initial),
        };
        Ok(Anchor { clock: Clock::START, state, phase, touching: () })
    }

    #[inline(always)]
    fn flight(&self, motion: &FreeMotion, _: &Anchor, clock: Clock, state: State) -> Flight {
        motion.flight(clock, state)
    }

    fn state_after(motion: &FreeMotion, flight: &Flight, time: DoubleDouble) -> State {
        motion.state_after(flight, time)
    }

    fn state_at(motion: &FreeMotion, flight: &Flight, s: f64) -> State {
        motion.state_at(flight, s)
    }

    #[inline(always)]
    fn state_within(motion: &FreeMotion, flight: &Flight, time: DoubleDouble) -> State {
        motion.state_within(flight, time)
    }

    fn states_within(
        motion: &FreeMotion,
        flight: &Flight,
        times: &[DoubleDouble],
    ) -> [State; LANES] {
        motion.states_within(flight, times)
    }

    #[inline(always)]
    fn search(
        &self,
        motion: &FreeMotion,
        _: &Anchor,
        flight: &Flight,
        start: Start,
        _: u32,
    ) -> ContactReport<State> {
        first_contact(motion, flight, start, motion.span)
    }

    #[inline(always)]
    fn touched(_: &FreeMotion, _: &Flight, touch: &Touch<State>) -> State {
        touch.state
    }

    #[inline(always)]
    fn contact_of(_: &State) -> u32 {
        0
    }

    #[inline(always)]
    fn diverges_by_law(&self) -> bool {
        !self.law.is_coulomb()
    }

    #[inline(always)]
    fn meet<O: Observer>(
        simulation: &mut Simulation,
        touch: &Touch<State>,
        observer: &mut O,
    ) -> Turn {
        simulation.strike(touch, observer)
    }

    fn strike_at_start<O: Observer>(simulation: &mut Simulation, observer: &mut O) -> Turn {
        let pre = simulation.point.anchor.state;
        let system = &simulation.system;
        let (angle, rate) = (system.contact.angle(pre.x1), system.approach_velocity(&pre));
        simulation.strike_from((0.0, 0.0), pre, angle, rate, observer)
    }

    #[inline(always)]
    fn impact_event(
        (clock, time, phase): (Clock, f64, f64),
        pre: State,
        post: State,
        impact: Impact,
    ) -> Event {
        Event::Impact(ImpactEvent { clock, time, phase, pre, post, impact })
    }

    fn graze_event(
        (clock, time, phase): (Clock, f64, f64),
        state: State,
        touch: &Touch<State>,
    ) -> Event {
        let gap_acceleration = touch.gap.second;
        Event::Graze(GrazeEvent { clock, time, phase, state, gap_acceleration })
    }

    fn grazes_undecidably(&self, state: &State, _: &State) -> bool {
        impact::approach_grows(self, &PreImpact::new(self.contact, state))
    }

    fn landing(&self, _: &Anchor, clock: Clock, state: State, _: u32, _: bool) -> Anchor {
        Anchor { clock, state, phase: Phase::Landing, touching: () }
    }

    fn landed(&self, _: &FreeMotion, _: Clock, state: State, _: u32, stopped: bool) -> State {
        System::landed(self, State { v1: if stopped { 0.0 } else { state.v1 }, ..state })
    }

    #[inline(always)]
    fn chatter_view(&self, impact: &Impact) -> ChatterView {
        ChatterView {
            regime: impact.regime.kind(),
            approach: impact.approach_velocity,
            separation: -impact.separation_velocity,
            restitution: self.coefficient().below(impact.approach_velocity),
            contact: 0,
        }
    }

    fn bounce(&self, view: &ChatterView, clock: Clock, post: &State) -> Bounce {
        let &ChatterView { regime, separation, .. } = view;
        let upper = self.contact.angle(post.x1).sin > 0.0;
        Bounce { regime, separation, clock, slip: post.v1, upper, others: [post.x1, post.v2] }
    }

    fn keeps_side(&self, bounce: &Bounce, limit: &Limit) -> bool {
        let upper = self.contact.angle(limit.others[0]).sin > 0.0;
        bounce.regime != RegimeKind::Slip || upper == bounce.upper
    }

    fn gap_jet(&self, motion: &FreeMotion, flight: &Flight, _: u32) -> [f64; 2] {
        let gap = motion.contact_gap(flight);
        [gap.second, gap.third]
    }

    fn limit_state(
        &self,
        motion: &FreeMotion,
        flight: &Flight,
        limit: &Limit,
        _: u32,
    ) -> (State, f64) {
        let (x1, v1) = (limit.others[0], limit.slip);
        if !self.is_wall() {
            return (self.on_contact(x1, v1), 1.0);
        }
        // The wall's own motion, which x1' = x2'/cos x1 magnifies.
        let free = motion.state_at(flight, limit.time);
        let magnified = self.tip_slope(x1).powi(2);
        (System::landed(self, State { x1, v1, ..free }), magnified)
    }

    fn sizes(&self, state: &State, _: u32, _: &Scales) -> (f64, f64) {
        let size = state.to_array().iter().fold(0.0, |most: f64, c| most.max(c.abs()));
        // A rounded x1 turns x1' cos x1 by |x1 x1'| roundings.
        (size, state.v1.abs() * (1.0 + state.x1.abs()) + state.v2.abs())
    }

    fn extent(&self, state: &State) -> f64 {
        state.x1.abs().max(state.x2.abs()).max(1.0)
    }

    fn holds(&self, motion: &FreeMotion, leg: &Anchor) -> bool {
        matches!(System::land(self, motion.drive.trig_at(leg.clock), &leg.state), Next::Hold(_))
    }

    fn chatter_event(
        &self,
        motion: &FreeMotion,
        (clock, time, phase): (Clock, f64, f64),
        leg: &Anchor,
        _: u32,
        skipped: Skipped,
    ) -> Event {
        let (load, state) = (motion.drive.trig_at(clock), leg.state);
        let force = match System::land(self, load, &state) {
            Next::Hold(mode) => self.contact_force(load, &state, mode),
            _ => ContactForce::default(),
        };
        let Skipped { impacts: impacts_skipped, time_jump, error } = skipped;
        Event::Chatter(ChatterEvent {
            clock,
            time,
            phase,
            state,
            force,
            impacts_skipped,
            time_jump,
            error,
        })
    }

    fn after_bounces(
        &self,
        motion: &FreeMotion,
        _: &Anchor,
        (clock, state, _): (Clock, &State, u32),
        (u, ratio, time): (f64, f64, f64),
        stopped: bool,
    ) -> (f64, [f64; 2]) {
        let slip = if stopped {
            0.0
        } else {
            self.slip_after_bounces(motion.drive.trig_at(clock), state, (u, ratio), time)
        };
        (slip, [state.x1 + state.v1 * time, state.v2])
    }

    fn separation(&self, _: &FreeMotion, leg: &Anchor, _: u32) -> f64 {
        -self.approach_velocity(&leg.state)
    }

    fn follows(&self, motion: &FreeMotion, here: &Anchor) -> Follows<Self> {
        let next = System::land(self, motion.drive.trig_at(here.clock), &here.state);
        follows(here.clock, here.state, next)
    }

    fn contact_event(
        &self,
        motion: &FreeMotion,
        (clock, time, phase): (Clock, f64, f64),
        _: &Anchor,
        leg: &Anchor,
        held: bool,
    ) -> Option<Event> {
        let state = leg.state;
        let mode = if let Phase::Contact(mode) = leg.phase { Some(mode) } else { None };
        if mode.is_none() && !held {
            return None;
        }
        let force = mode.map_or(ContactForce::default(), |mode| {
            self.contact_force(motion.drive.trig_at(clock), &state, mode)
        });
        let event = ContactEvent { clock, time, phase, state, mode, force };
        Some(match mode {
            Some(ContactMode::SlidePositive) => Event::SlidePositive(event),
            Some(ContactMode::SlideNegative) => Event::SlideNegative(event),
            Some(ContactMode::Stick) => Event::Stick(event),
            None => Event::Release(event),
        })
    }

    fn hold<O: Observer>(simulation: &mut Simulation, mode: ContactMode, observer: &mut O) -> Turn {
        if mode == ContactMode::Stick {
            simulation.stick(observer)
        } else {
            simulation.slide(mode, observer)
        }
    }

    fn bits(leg: &Anchor) -> [u64; 4] {
        leg.state.to_array().map(f64::to_bits)
    }
}

/// The leg that follows from this clock and state on.
fn follows(clock: Clock, state: State, next: Next) -> Follows<System> {
    let phase = match next {
        Next::Hold(mode) => Phase::Contact(mode),
        Next::Separate => Phase::Flight(FlightStart::Touching),
        Next::Release => Phase::Flight(FlightStart::Released),
        Next::Painleve => return Follows::Stops(StopReason::Painleve),
        Next::Jammed => return Follows::Stops(StopReason::Jammed),
    };
    Follows::Leg(Anchor { clock, state, phase, touching: () })
}

impl Simulation {
    /// Impact at the end of a flight.
    #[inline(always)]
    pub(super) fn strike<O: Observer>(&mut self, touch: &Touch<State>, observer: &mut O) -> Turn {
        // g = 0 to rounding: the state is moved onto it, so that rounding does not add up.
        let (pre, angle) = self.system.touching_at(touch.state);
        self.strike_from((touch.time, touch.offset), pre, angle, touch.gap.rate, observer)
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
        let clock = self.impact_clock(time, offset);
        let struck = self.struck(clock, pre, angle, rate);
        self.rebound(clock, struck, observer)
    }

    #[inline(always)]
    fn struck(
        &self,
        clock: Clock,
        pre: State,
        angle: Angle,
        rate: f64,
    ) -> Result<Struck<System>, NotStruck<System>> {
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
                return Err(NotStruck::Stops(reason, pre));
            }
        };
        let post = State { v1: impact.v1_post, v2: impact.v2_post, ..pre };
        if !(post.is_finite() && impact.is_finite()) {
            return Err(NotStruck::NotFinite);
        }
        let flight = self.motion.flight_at(clock, post, angle);
        // Where flight and contact both fit, neither is chosen (docs/theory.md, section 5).
        let lands = impact.ends_at_rest() && self.system.has_no_contact_force(flight.start, &post);
        let phase = if lands { Phase::Landing } else { Phase::Flight(FlightStart::Touching) };
        Ok(Struck { pre, impact, flight, phase, touching: () })
    }
}

//! What a run keeps of the pendulum and the mass, and how their legs are followed.

#![allow(private_interfaces)] // nobody outside of the crate can name the traits

use super::Run;
use super::legs::{self, Kind};
use super::recorded::{Kept, Recorded, Row};
use crate::contact::sustained::{ContactForce, ContactMode, SlideStep};
use crate::flight::{Drive, Flight, FreeMotion};
use crate::impact::{Impact, PreImpact, resolve};
use crate::model::parameters::System;
use crate::model::state::{Clock, ModelState, State};
use crate::numerics::double_double::DoubleDouble;
use crate::simulate::event::{
    ContactRecord, Event, EventKind, EventRecord, GrazeRecord, ImpactRecord,
};
use crate::simulate::{Anchor, FlightStart, Phase, hops};

type Leg = legs::Leg<System>;

impl Row for ImpactRecord {
    fn time_in_period(&self) -> f64 {
        self.time_in_period
    }

    fn moved(self, time: f64, period: i64) -> Self {
        Self { time, period, ..self }
    }
}

impl Row for GrazeRecord {
    fn time_in_period(&self) -> f64 {
        self.time_in_period
    }

    fn moved(self, time: f64, period: i64) -> Self {
        Self { time, period, ..self }
    }
}

impl Row for ContactRecord {
    fn time_in_period(&self) -> f64 {
        self.time_in_period
    }

    fn moved(self, time: f64, period: i64) -> Self {
        Self { time, period, ..self }
    }
}

impl Recorded for System {
    type ImpactRow = ImpactRecord;
    type GrazeRow = GrazeRecord;
    type ContactRow = ContactRecord;
    type Section = [f64; 4];
    type Force = ContactForce;
    type Follower = Follower;

    #[inline(always)]
    #[allow(clippy::inline_always)] // for every section that is kept
    fn section(state: &State) -> [f64; 4] {
        state.to_array()
    }

    #[inline(always)]
    #[allow(clippy::inline_always)] // for every event that is kept
    fn kept(event: &Event) -> (Clock, f64, Kept<Self>) {
        match event {
            Event::Impact(e) => (e.clock, e.time, Kept::Impact(ImpactRecord::from(e))),
            Event::Graze(e) => (e.clock, e.time, Kept::Graze(GrazeRecord::from(e))),
            Event::Chatter(e) => {
                let row = ContactRecord::from(e);
                (e.clock, e.time, Kept::Contact(EventKind::Chatter, row))
            }
            Event::SlidePositive(e)
            | Event::SlideNegative(e)
            | Event::Stick(e)
            | Event::Release(e) => {
                let row = ContactRecord::from(e);
                (e.clock, e.time, Kept::Contact(EventKind::of(e.mode), row))
            }
            Event::Stop(e) => (e.clock, e.time, Kept::Nothing),
        }
    }

    #[inline(always)]
    #[allow(clippy::inline_always)] // for every impact before the window
    fn passed_over(clock: Clock, state: &State) -> Option<Anchor> {
        Some(Anchor::after_impact(clock, *state))
    }

    fn resolved(&self, row: &ImpactRecord) -> Option<Impact> {
        let pre = State { x1: row.x1, v1: row.v1_pre, x2: row.x2, v2: row.v2_pre };
        resolve(self, &PreImpact::new(self.contact, &pre)).ok()
    }

    fn approach(event: &Event) -> f64 {
        event.into_impact().map_or(0.0, |event| event.impact.approach_velocity)
    }

    fn leg_after(run: &Run, event: &EventRecord, _: &Anchor) -> Option<Anchor> {
        run.anchor_of(event.kind, event.index)
    }

    fn follower(run: &Run, motion: &FreeMotion, leg: &Leg) -> Follower {
        Follower::new(run, motion, leg)
    }

    fn followed(
        follower: &mut Follower,
        run: &Run,
        motion: &FreeMotion,
        leg: &Leg,
        clock: Clock,
    ) -> (State, ContactForce) {
        follower.at(run, motion, leg, clock)
    }

    fn own_drive(&self) -> Drive {
        Drive::of(self)
    }
}

impl Run {
    /// The leg that an event begins; `None` for grazes and the stop.
    fn anchor_of(&self, kind: i64, index: i64) -> Option<Anchor> {
        let index = usize::try_from(index).ok()?;
        if kind == EventKind::Impact as i64 {
            let i = self.impacts.get(index)?;
            let state = State { x1: i.x1, v1: i.v1_post, x2: i.x2, v2: i.v2_post };
            let clock = Clock::new(i.period, i.time_in_period);
            return Some(Anchor {
                clock,
                state,
                phase: Phase::Flight(FlightStart::Touching),
                touching: (),
            });
        }
        if kind == EventKind::Graze as i64 {
            return None;
        }
        let c = self.contacts.get(index)?;
        let phase = match EventKind::mode(kind) {
            Some(mode) => Phase::Contact(mode),
            None if kind == EventKind::Release as i64 => Phase::Flight(FlightStart::Released),
            // The end of chatter: the next leg begins at once.
            None => Phase::Landing,
        };
        let state = State { x1: c.x1, v1: c.v1, x2: c.x2, v2: c.v2 };
        Some(Anchor { clock: Clock::new(c.period, c.time_in_period), state, phase, touching: () })
    }
}

/// Evaluates one leg at times that mostly increase.
pub enum Follower {
    Flight(Flight),
    /// The start of the last hop looked at.
    Hops(Anchor),
    Slide(Box<Slide>),
    /// A stick, or a slide that ends where it starts.
    Rest,
}

/// The step of a slide that holds the last time asked for.
pub struct Slide {
    pub clock: Clock,
    pub step: SlideStep,
}

impl Slide {
    /// The first step of a slide; `None` where a run ends for want of one.
    pub fn new(run: &Run, motion: &FreeMotion, anchor: &Anchor, mode: ContactMode) -> Option<Self> {
        Self::from(run, motion, anchor.clock, &anchor.state, mode)
    }

    fn from(
        run: &Run,
        motion: &FreeMotion,
        clock: Clock,
        state: &State,
        mode: ContactMode,
    ) -> Option<Self> {
        let step = run.system.slide(motion.drive.trig_at(clock), state, mode);
        (!step.stalls(motion.span) && step.is_finite()).then_some(Self { clock, step })
    }

    /// Local time up to which this step is taken. The end of the leg is that of the slide, and not
    /// what the step says of its own: a force that is all but zero falls through it where rounding
    /// decides.
    pub fn reach(&self) -> f64 {
        let (reached, end) = self.step.end();
        if end.goes_on() && reached > 0.0 { reached } else { self.step.length() }
    }

    /// Goes on to the next step; `false` if there is none.
    pub fn advance(&mut self, run: &Run, motion: &FreeMotion, mode: ContactMode) -> bool {
        let reached = self.reach();
        let (x1, v1) = self.step.at(reached);
        let clock = motion.drive.advance(self.clock, DoubleDouble::new(reached));
        let next = Self::from(run, motion, clock, &run.system.on_contact(x1, v1), mode);
        let goes_on = reached > 0.0 && next.is_some();
        if let Some(next) = next.filter(|_| goes_on) {
            *self = next;
        }
        goes_on
    }
}

impl Follower {
    pub fn new(run: &Run, motion: &FreeMotion, leg: &Leg) -> Self {
        match leg.kind {
            Kind::Flight => Self::Flight(motion.flight(leg.anchor.clock, leg.anchor.state)),
            Kind::Hops(_) => Self::Hops(leg.anchor),
            Kind::Contact(ContactMode::Stick) => Self::Rest,
            Kind::Contact(mode) => match Slide::new(run, motion, &leg.anchor, mode) {
                Some(slide) => Self::Slide(Box::new(slide)),
                None => Self::Rest,
            },
        }
    }

    pub fn at(
        &mut self,
        run: &Run,
        motion: &FreeMotion,
        leg: &Leg,
        clock: Clock,
    ) -> (State, ContactForce) {
        let since = |start: Clock| {
            let elapsed = motion.drive.until(start, clock);
            if elapsed.hi < 0.0 { DoubleDouble::ZERO } else { elapsed }
        };
        // Forces so large that nothing after its start is a number end a leg where it starts, but
        // for what its clock is rounded by.
        let in_range = |state: State| {
            let start = Clock { residual: leg.end.residual, ..leg.anchor.clock };
            if leg.end <= start && !state.is_finite() { leg.anchor.state } else { state }
        };
        let force = |state: &State, mode: ContactMode| {
            run.system.contact_force(motion.drive.trig_at(clock), state, mode)
        };
        let Kind::Contact(mode) = leg.kind else {
            let state = match (self, leg.kind) {
                (Self::Flight(flight), _) => {
                    in_range(motion.state_after(flight, since(flight.clock)))
                }
                // Where the hops are too short to tell, their limit stands for all.
                (Self::Hops(last), Kind::Hops(limit)) => {
                    let start = if last.clock <= clock { *last } else { leg.anchor };
                    let (state, hop) = hops(&run.system, start, clock);
                    *last = hop;
                    state.unwrap_or_else(|| {
                        limit.earlier(motion.drive.until(clock, leg.end).value())
                    })
                }
                _ => leg.anchor.state,
            };
            return (state, ContactForce::default());
        };
        let Self::Slide(slide) = self else {
            let state = leg.anchor.state;
            return (state, force(&state, mode));
        };
        if clock < slide.clock
            && let Some(first) = Slide::new(run, motion, &leg.anchor, mode)
        {
            **slide = first;
        }
        let mut time = since(slide.clock).value();
        while time > slide.reach() {
            if !slide.advance(run, motion, mode) {
                time = slide.reach();
                break;
            }
            time = since(slide.clock).value();
        }
        let (x1, v1) = slide.step.at(time);
        let state = run.system.on_contact(x1, v1);
        (state, force(&state, mode))
    }
}

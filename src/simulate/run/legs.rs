//! The kept window leg by leg: flights, hops of a chatter sequence, contact phases. From the legs
//! follow the states at any time, the contact forces, and the time in contact.

use super::Run;
use crate::contact::sustained::{ContactForce, ContactMode, SlideStep};
use crate::flight::{Drive, Flight, FreeMotion};
use crate::model::state::{Clock, ModelState, State};
use crate::numerics::cancel::CancelToken;
use crate::numerics::double_double::DoubleDouble;
use crate::simulate::event::{EventKind, EventRecord};
use crate::simulate::{Anchor, FlightStart, Phase, hops};

/// What the bodies do between two events.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Kind {
    Flight,
    /// Skipped impacts of a chatter sequence, up to this state.
    Hops(State),
    Contact(ContactMode),
}

/// The stretch between two events.
#[derive(Debug, Clone, Copy)]
pub(super) struct Leg {
    pub anchor: Anchor,
    pub kind: Kind,
    /// Time at its start, as in the tables.
    pub time: f64,
    /// Its end.
    pub end: Clock,
}

impl Run {
    /// The legs of the kept window, in order; the first may begin before it.
    pub(super) fn legs(&self) -> Vec<Leg> {
        let drive = Drive::of(&self.system);
        let leg = |anchor: Anchor, time: f64| {
            let kind = match anchor.phase {
                Phase::Contact(mode) => Kind::Contact(mode),
                _ => Kind::Flight,
            };
            Leg { anchor, kind, time, end: self.final_state.clock }
        };
        let first = self.window_anchor;
        let mut legs = vec![leg(first, drive.time(first.clock))];
        for event in &self.events {
            let Some(anchor) = self.anchor_of(event.kind, event.index) else { continue };
            if let Some(last) = legs.last_mut() {
                last.end = anchor.clock;
                if event.kind == EventKind::Chatter as i64 {
                    last.kind = Kind::Hops(anchor.state);
                }
            }
            legs.push(leg(anchor, event.time));
        }
        // A run that ends among skipped impacts.
        if let (true, Some(last)) = (self.checkpoint.skips(), legs.last_mut()) {
            last.kind = Kind::Hops(self.final_state.state);
        }
        legs
    }

    /// Whether an event begins a leg.
    pub(super) fn begins_leg(&self, event: &EventRecord) -> bool {
        self.anchor_of(event.kind, event.index).is_some()
    }

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

    /// States at the given times, right-continuous: after the event at its instant. `None` for a
    /// time outside the kept window.
    #[must_use]
    pub fn trajectory(&self, times: &[f64]) -> Option<Vec<[f64; 4]>> {
        let mut states = Vec::with_capacity(times.len());
        self.follow(times, &CancelToken::never(), |state, _| states.push(state.to_array()))?;
        Some(states)
    }

    /// Contact forces (zero in flight) at the given times, just after the event at its instant.
    /// `None` for a time outside the kept window.
    #[must_use]
    pub fn contact_forces(&self, times: &[f64]) -> Option<Vec<ContactForce>> {
        let mut forces = Vec::with_capacity(times.len());
        self.follow(times, &CancelToken::never(), |_, force| forces.push(force))?;
        Some(forces)
    }

    /// Hands over state and force at one time after the other, until `cancel` ends it.
    /// `None` for a time outside the kept window.
    pub(crate) fn follow(
        &self,
        times: &[f64],
        cancel: &CancelToken,
        mut hand_over: impl FnMut(&State, ContactForce),
    ) -> Option<()> {
        let motion = FreeMotion::new(&self.system);
        let (from, to) = (motion.drive.time(self.window), self.final_state.time);
        let legs = self.legs();
        let mut follower: Option<(usize, Follower)> = None;
        for &time in times {
            if !(from..=to).contains(&time) {
                return None;
            }
            if cancel.is_cancelled() {
                break;
            }
            // The last leg that begins not later than this.
            let index = legs.partition_point(|leg| leg.time <= time).max(1) - 1;
            let clock = motion.drive.clock_at(time);
            let mut now = match follower.take() {
                Some((i, now)) if i == index => now,
                _ => Follower::new(self, &motion, &legs[index]),
            };
            let (state, force) = now.at(self, &motion, &legs[index], clock);
            hand_over(&state, force);
            follower = Some((index, now));
        }
        Some(())
    }

    /// Time in contact within the kept window (dimensionless).
    #[must_use]
    pub fn time_in_contact(&self) -> f64 {
        if self.contacts.is_empty() && !matches!(self.window_anchor.phase, Phase::Contact(_)) {
            return 0.0;
        }
        let drive = Drive::of(&self.system);
        let within = |clock: Clock| if clock < self.window { self.window } else { clock };
        self.legs()
            .iter()
            .filter(|leg| matches!(leg.kind, Kind::Contact(_)))
            .map(|leg| drive.until(within(leg.anchor.clock), within(leg.end)).value())
            .sum()
    }
}

/// Evaluates one leg at times that mostly increase.
pub(super) enum Follower {
    Flight(Flight),
    /// The start of the last hop looked at.
    Hops(Anchor),
    Slide(Box<Slide>),
    /// A stick, or a slide that ends where it starts.
    Rest,
}

/// The step of a slide that holds the last time asked for.
pub(super) struct Slide {
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

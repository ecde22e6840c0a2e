//! The kept window leg by leg: flights, hops of a chatter sequence, contact phases. From the legs
//! follow the states at any time, the contact forces, and the time in contact.

use super::Run;
pub use super::leg::{Kind, Leg};
use super::recorded::Recorded;
use crate::model::state::Clock;
#[cfg(feature = "python")]
use crate::model::state::ModelState as _;
use crate::numerics::cancel::CancelToken;
use crate::simulate::event::{EventKind, EventRecord};
use crate::simulate::{AnchorOf, Phase};

/// Whether an event begins a leg: grazes and the stop do not.
pub(super) fn begins_leg(event: &EventRecord) -> bool {
    event.kind != EventKind::Graze as i64 && event.kind != EventKind::Stop as i64
}

/// Numbers of states in flight that are worked out within a few milliseconds.
#[cfg(feature = "python")]
const SOON_FOLLOWED: usize = 1 << 14;

impl<M: Recorded> Run<M> {
    /// The legs of the kept window, in order; the first may begin before it.
    pub(super) fn legs(&self) -> Vec<Leg<M>> {
        let drive = self.system.own_drive();
        let leg = |anchor: AnchorOf<M>, time: f64| {
            let kind = match anchor.phase {
                Phase::Contact(mode) => Kind::Contact(mode),
                _ => Kind::Flight,
            };
            Leg { anchor, kind, time, end: self.final_state.clock }
        };
        let mut before = self.window_anchor.clone();
        let mut legs = vec![leg(before.clone(), drive.time(before.clock))];
        for event in self.events.iter().filter(|event| begins_leg(event)) {
            let Some(anchor) = M::leg_after(self, event, &before) else { continue };
            if let Some(last) = legs.last_mut() {
                last.end = anchor.clock;
                if event.kind == EventKind::Chatter as i64 {
                    last.kind = Kind::Hops(anchor.state.clone());
                }
            }
            legs.push(leg(anchor.clone(), event.time));
            before = anchor;
        }
        // A run that ends among skipped impacts.
        if let (true, Some(last)) = (self.checkpoint.skips(), legs.last_mut()) {
            last.kind = Kind::Hops(self.final_state.state.clone());
        }
        legs
    }

    /// States at the given times, right-continuous: after the event at its instant. `None` for a
    /// time outside the kept window.
    #[must_use]
    pub fn trajectory(&self, times: &[f64]) -> Option<Vec<M::Section>> {
        let mut states = Vec::with_capacity(times.len());
        self.follow(times, &CancelToken::never(), |state, _| states.push(M::section(state)))?;
        Some(states)
    }

    /// Contact forces (zero in flight) at the given times, just after the event at its instant.
    /// `None` for a time outside the kept window.
    #[must_use]
    pub fn contact_forces(&self, times: &[f64]) -> Option<Vec<M::Force>> {
        let mut forces = Vec::with_capacity(times.len());
        self.follow(times, &CancelToken::never(), |_, force| forces.push(force))?;
        Some(forces)
    }

    /// Whether [`Self::follow`] surely takes a few milliseconds only, for so many times.
    #[cfg(feature = "python")]
    pub(crate) fn is_soon_followed(&self, times: usize) -> bool {
        let begins_in_flight = matches!(self.window_anchor.phase, Phase::Flight(_));
        let flies = begins_in_flight && self.contacts.is_empty() && !self.skips_at_end();
        let components = self.final_state.state.to_vec().len();
        flies && (times + self.events.len()).saturating_mul(components) <= SOON_FOLLOWED
    }

    /// Hands over state and force at one time after the other, until `cancel` ends it.
    /// `None` for a time outside the kept window.
    pub(crate) fn follow(
        &self,
        times: &[f64],
        cancel: &CancelToken,
        mut hand_over: impl FnMut(&M::State, M::Force),
    ) -> Option<()> {
        let motion = self.system.motion();
        let drive = M::drive(&motion);
        let (from, to) = (drive.time(self.window), self.final_state.time);
        let legs = self.legs();
        let mut follower: Option<(usize, M::Follower)> = None;
        for &time in times {
            if !(from..=to).contains(&time) {
                return None;
            }
            if cancel.is_cancelled() {
                break;
            }
            // The last leg that begins not later than this.
            let index = legs.partition_point(|leg| leg.time <= time).max(1) - 1;
            let clock = drive.clock_at(time);
            let mut now = match follower.take() {
                Some((i, now)) if i == index => now,
                _ => M::follower(self, &motion, &legs[index]),
            };
            let (state, force) = M::followed(&mut now, self, &motion, &legs[index], clock);
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
        let drive = self.system.own_drive();
        let within = |clock: Clock| if clock < self.window { self.window } else { clock };
        self.legs()
            .iter()
            .filter(|leg| matches!(leg.kind, Kind::Contact(_)))
            .map(|leg| drive.until(within(leg.anchor.clock), within(leg.end)).value())
            .sum()
    }
}

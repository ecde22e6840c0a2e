//! Events at which the derivatives are those of one side only.

use super::columns::Differentiated;
use super::impact::FollowedImpact;
use super::source::Next;
use crate::contact::sustained::{ContactForce, ContactMode};
use crate::impact::RegimeKind;
use crate::model::contact_coordinates::PreImpact;
use crate::model::parameters::System;
use crate::model::state::{Clock, State};
use crate::numerics::lanes::narrow;
use crate::simulate::event::{ChatterEvent, ContactEvent, Event};
use crate::tangent::border::{Border, BorderValue};
use crate::tangent::impact::{regime_borders, regime_path};
use crate::tangent::tolerances::{AT_BORDER, NEAR_ONSET};

/// Why derivatives are one-sided from an event on: on the other side the motion is another one.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum OneSidedReason {
    /// The bodies graze: beyond, they strike.
    Graze,
    /// An impact on the border of its regime.
    RegimeBorder,
    /// Chatter that ends with next to no contact force: beyond, it is incomplete.
    ChatterOnset,
    /// Contact that begins without force, sticks at the limit of friction, or ends without a rate of what
    /// ends it: beyond, it goes on otherwise.
    ContactBorder,
    /// The motion starts on the contact: beyond, the bodies overlap or fly.
    StartOnContact,
    /// An impact at a knot of the restitution curve, where its slope jumps; derivatives are those from
    /// above.
    RestitutionKnot,
}

impl OneSidedReason {
    /// All, in order.
    pub const ALL: &'static [Self] = &[
        Self::Graze,
        Self::RegimeBorder,
        Self::ChatterOnset,
        Self::ContactBorder,
        Self::StartOnContact,
        Self::RestitutionKnot,
    ];

    /// The name used in Python.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Graze => "graze",
            Self::RegimeBorder => "regime_border",
            Self::ChatterOnset => "chatter_onset",
            Self::ContactBorder => "contact_border",
            Self::StartOnContact => "start_on_contact",
            Self::RestitutionKnot => "restitution_knot",
        }
    }
}

/// An event from which on derivatives are one-sided.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OneSided {
    /// Row of the event among those of the run; -1 for one before the window, the first with its reason.
    pub index: i64,
    /// Its time.
    pub time: f64,
    /// Why.
    pub reason: OneSidedReason,
}

/// Takes note of an event; of those before the window only the first with each reason, so that however many
/// these are they take no memory.
pub(super) fn note(all: &mut Vec<OneSided>, event: OneSided, is_early: bool) {
    // Those so far are then early, too.
    if !(is_early && all.iter().any(|other| other.reason == event.reason)) {
        all.push(event);
    }
}

/// Why derivatives are one-sided from this event on, if they are; `at_start`: nothing has come before.
pub(super) fn one_sided(
    of: &Differentiated,
    event: &Next,
    at_start: bool,
) -> Option<OneSidedReason> {
    let starts = at_start && event.clock() == Clock::START;
    let event = match event {
        Next::Other(Event::Graze(_)) => return Some(OneSidedReason::Graze),
        Next::Other(Event::Stop(_)) => return None,
        _ if starts => return Some(OneSidedReason::StartOnContact),
        Next::Other(event) => event,
        Next::Impact(impact) if is_at_border(of, impact) => {
            return Some(OneSidedReason::RegimeBorder);
        }
        Next::Impact(impact) => {
            return is_at_knot(of, impact).then_some(OneSidedReason::RestitutionKnot);
        }
    };
    match event {
        Event::Chatter(chatter) if has_no_force(of, chatter) => Some(OneSidedReason::ChatterOnset),
        Event::SlidePositive(contact) | Event::SlideNegative(contact) | Event::Stick(contact)
            if is_at_border_of_contact(of, contact) =>
        {
            Some(OneSidedReason::ContactBorder)
        }
        _ => None,
    }
}

/// Whether an impact lies on the border of its regime, to rounding.
fn is_at_border(of: &Differentiated, impact: &FollowedImpact) -> bool {
    let system = &of.system;
    if system.friction == 0.0 || !system.law.is_coulomb() {
        return false;
    }
    narrow(
        #[inline(always)]
        || is_at_border_of_regime(system, impact),
    )
}

#[inline(always)]
#[allow(clippy::inline_always)] // compiled for several instruction sets
fn is_at_border_of_regime(system: &System, impact: &FollowedImpact) -> bool {
    let pre = PreImpact::at(impact.angle, &impact.pre);
    let contact = pre.coordinates(system.mass_ratio, system.friction);
    if contact.scale.abs() <= AT_BORDER {
        return true;
    }
    let (kind, signs) = impact.regime;
    if kind == RegimeKind::Frictionless {
        return true;
    }
    let restitution = system.restitution_at(impact.approach_velocity);
    let direction = signs.direction.value();
    let (switch, end) = regime_path(&contact, (restitution, &system.law), kind, direction);
    let speed = pre.v1.abs() + pre.v2.abs();
    let size = |border: Border| match border {
        Border::StopAtEndOfImpact if kind != RegimeKind::Slip => impact.impulse_normal,
        Border::SlipBefore | Border::StopAtEndOfApproach | Border::StopAtEndOfImpact => speed,
        _ => 1.0,
    };
    let is_small = |at: &BorderValue| at.value.abs() <= AT_BORDER * size(at.border);
    let one_body = system.is_wall_at_rest(&impact.pre);
    regime_borders(&contact, restitution, (kind, direction), (switch, &end), one_body)
        .iter()
        .any(is_small)
}

/// Whether an impact lies at a knot of the restitution curve, to rounding.
fn is_at_knot(of: &Differentiated, impact: &FollowedImpact) -> bool {
    of.system.coefficient().is_at_knot(impact.approach_velocity)
}

/// Whether the force that follows chatter is near 0.
fn has_no_force(of: &Differentiated, chatter: &ChatterEvent) -> bool {
    chatter.force.normal.abs() <= NEAR_ONSET * size_of_forces(of, &chatter.state)
}

/// Whether contact begins or goes on without force, or sticks at the limit of friction, to rounding.
fn is_at_border_of_contact(of: &Differentiated, contact: &ContactEvent) -> bool {
    let size = size_of_forces(of, &contact.state);
    let friction = of.system.friction;
    let ContactForce { normal, tangential } = contact.force;
    let sticks = contact.mode == Some(ContactMode::Stick) && friction > 0.0;
    let grip = friction * normal - tangential.abs();
    normal <= AT_BORDER * size || (sticks && grip <= AT_BORDER * (1.0 + friction) * size)
}

/// The size of what the contact force is a difference of.
fn size_of_forces(of: &Differentiated, state: &State) -> f64 {
    let first = of.system.pendulum().terms(state.x1, state.v1, 1.0);
    let second = of.system.oscillator().terms(state.x2, state.v2, 1.0);
    first.into_iter().chain(second).map(f64::abs).sum()
}

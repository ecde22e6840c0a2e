//! An impact of a motion, as far as derivatives look at it.

use crate::impact::RegimeKind;
use crate::model::angle::Angle;
use crate::model::contact_coordinates::PreImpact;
use crate::model::parameters::System;
use crate::model::state::{Clock, State};
use crate::numerics::lanes::narrow;
use crate::simulate::event::{ImpactEvent, ImpactRecord};
use crate::simulate::run::Recorded;
use crate::tangent::itinerary::{Leg, Signs};

/// An impact that the motion has been followed to.
#[derive(Debug, Clone, Copy)]
pub(super) struct FollowedImpact {
    pub clock: Clock,
    pub pre: State,
    pub post: State,
    /// Of x1.
    pub angle: Angle,
    /// u before.
    pub approach_velocity: f64,
    pub impulse_normal: f64,
    pub regime: (RegimeKind, Signs),
}

impl FollowedImpact {
    /// As a simulation has found it.
    pub fn found(system: &System, event: &ImpactEvent) -> Self {
        let &ImpactEvent { clock, pre, post, impact, .. } = event;
        Self {
            clock,
            pre,
            post,
            angle: angle(system, &pre),
            approach_velocity: impact.approach_velocity,
            impulse_normal: impact.impulse_normal,
            regime: Leg::regime_of(system, (impact.regime, &pre)),
        }
    }

    /// As its row in the table of a run tells; `None`: that is none of this system.
    pub fn kept(system: &System, row: &ImpactRecord, clock: Clock) -> Option<Self> {
        let &ImpactRecord { x1, x2, impulse_normal, .. } = row;
        let pre = State { x1, v1: row.v1_pre, x2, v2: row.v2_pre };
        let post = State { x1, v1: row.v1_post, x2, v2: row.v2_post };
        let angle = angle(system, &pre);
        let kind = *RegimeKind::ALL.get(usize::try_from(row.regime).ok()?)?;
        // Slip that begins in the impact has a direction that its row does not tell.
        let regime = if pre.v1 != 0.0 && system.law.is_coulomb() {
            (kind, Signs::of(kind, pre.v1, angle.sin))
        } else {
            Leg::regime_of(system, (system.resolved(row)?.regime, &pre))
        };
        let contact = PreImpact::at(angle, &pre).coordinates(system.mass_ratio, system.friction);
        let approach_velocity = contact.approach_velocity();
        Some(Self { clock, pre, post, angle, approach_velocity, impulse_normal, regime })
    }
}

fn angle(system: &System, pre: &State) -> Angle {
    narrow(
        #[inline(always)]
        || system.contact.angle(pre.x1),
    )
}

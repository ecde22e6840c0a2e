//! What a simulation hands to its lane, and takes back from it.

#![allow(clippy::inline_always)] // a round is compiled for several instruction sets

use super::impacts::ImpactLanes;
use crate::flight::Found;
use crate::flight::gap::TipGap;
use crate::model::tip::Tip;
use crate::search::Start;
use crate::search::first_contact::{FirstPass, careful_search};
use crate::simulate::model::ChatterView;
use crate::simulate::{Anchor, Phase, Simulation};

impl Simulation {
    /// Whether lanes can hold the usual flights and impacts of this system.
    pub(super) fn fits_a_lane(&self) -> bool {
        self.motion.swings_or_beats() && self.system.law.is_coulomb()
    }

    #[inline(always)]
    pub(super) fn tip_gap<T: Tip>(&self) -> TipGap<'_, T> {
        TipGap::new(&self.motion, &self.flight)
    }

    /// How the present flight starts, if a scan is its next step.
    #[inline(always)]
    pub(super) fn scanned_from(&self) -> Option<Start> {
        let Phase::Flight(began) = self.point.anchor.phase else { return None };
        if self.found.is_some() || self.point.completion.is_some() {
            return None;
        }
        Some(self.start(began)).filter(|start| matches!(start, Start::Apart | Start::Touching))
    }

    /// Stores the result of the first pass for the next turn. A contact ahead is not stored: the
    /// turn finds it.
    #[inline(never)]
    pub(super) fn store_first_pass<G: Tip>(&mut self, first_pass: FirstPass, evaluations: u64) {
        let Phase::Flight(began) = self.point.anchor.phase else { return };
        match first_pass {
            FirstPass::Ahead { .. } => {}
            FirstPass::Clear(time) => {
                self.evaluations += evaluations;
                self.found = Some(Found::Clear(time));
            }
            FirstPass::Unsure(clear) => {
                let gap = self.tip_gap::<G>();
                let (start, span) = (self.start(began), self.motion.span);
                let report = careful_search(&gap, start, span, clear, evaluations);
                self.evaluations += report.evaluations;
                self.found = Some(self.checked_against_graze(report.found));
            }
        }
    }

    /// Begins the flight after the impact in lane `j`, the bodies' constants left in the lane;
    /// whether chatter may have begun. Not inlined: wide loads of numbers that were just written
    /// would wait.
    #[inline(never)]
    pub(super) fn start_next_flight(&mut self, j: usize, impacts: &ImpactLanes) -> bool {
        let (clock, state) = impacts.start_after(j, self.flight.clock.period);
        let (angle, start) = impacts.angles_after(j);
        (self.flight.clock, self.flight.state) = (clock, state);
        (self.flight.angle, self.flight.start) = (angle, start);
        let (regime, approach_velocity) = impacts.approach(j);
        let restitution = self.system.coefficient().below(approach_velocity);
        let view = ChatterView {
            regime,
            approach: approach_velocity,
            separation: 0.0,
            restitution,
            contact: 0,
        };
        self.leave(Anchor::after_impact(clock, state), &view)
    }

    /// Whether a wall leaves the bodies no room at the contact in lane `j`.
    #[inline(always)]
    pub(super) fn has_no_room(&self, j: usize, impacts: &ImpactLanes) -> bool {
        self.system.is_wall() && impacts.pre_impact(j).has_no_room(&self.system)
    }
}

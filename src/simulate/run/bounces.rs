//! All impacts of the kept window: those that a run lists, and those that complete chatter skipped,
//! made again hop by hop from the last listed one (docs/theory.md, section 5).
//!
//! A complete chatter has infinitely many impacts. Their list ends at an approach velocity, at a
//! number of impacts, or where what is left is below rounding; each chatter says which.

use super::Run;
use super::legs::{Kind, Leg, begins_leg};
use super::recorded::{Kept, Recorded};
use crate::numerics::cancel::CancelToken;
use crate::simulate::event::{EventKind, ImpactRecord};
use crate::simulate::impacts_hop_by_hop;

/// Why the list of skipped impacts of one chatter ends.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum BouncesEnd {
    /// The next one approaches more slowly than asked for.
    ApproachVelocity,
    /// What is left of them is below rounding, or within the error of the accumulation point.
    Accumulation,
    /// The run ends among them.
    RunEnd,
    /// As many are listed as were allowed.
    Cap,
    /// The caller wished no more.
    Interrupted,
}

impl BouncesEnd {
    /// All, in order.
    pub const ALL: &'static [Self] =
        &[Self::ApproachVelocity, Self::Accumulation, Self::RunEnd, Self::Cap, Self::Interrupted];

    /// The name used in Python.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::ApproachVelocity => "approach_velocity",
            Self::Accumulation => "accumulation",
            Self::RunEnd => "run_end",
            Self::Cap => "cap",
            Self::Interrupted => "interrupted",
        }
    }
}

/// The impacts of a window, with those that chatter skipped.
#[derive(Debug, Clone, PartialEq)]
pub struct Bounces<R = ImpactRecord> {
    /// In the order of time.
    pub impacts: Vec<R>,
    /// Of each, whether the run skipped it.
    pub skipped: Vec<bool>,
    /// Of each chatter in the window, in order, why the list of its impacts ends.
    pub ends: Vec<BouncesEnd>,
}

impl<R> Default for Bounces<R> {
    fn default() -> Self {
        Self { impacts: Vec::new(), skipped: Vec::new(), ends: Vec::new() }
    }
}

impl<M: Recorded> Run<M> {
    /// The impacts of the kept window and those that were skipped there, down to this approach
    /// velocity, and at most so many of them. Once `cancel` has ended it, the skipped impacts up to
    /// there.
    #[must_use]
    pub fn bounces(
        &self,
        slowest: f64,
        most: usize,
        cancel: &CancelToken,
    ) -> Bounces<M::ImpactRow> {
        let mut bounces = Bounces::default();
        // One leg comes before the first event, and one after each event that begins a leg.
        let mut legs = self.legs().into_iter();
        let mut left = most;
        let mut skip = |bounces: &mut Bounces<M::ImpactRow>, leg: Option<Leg<M>>, is_last: bool| {
            let Some(leg) = leg.filter(|leg| matches!(leg.kind, Kind::Hops(_))) else { return };
            let end = self.skipped_in(&leg, slowest, &mut left, cancel, bounces);
            let cut = end == BouncesEnd::Accumulation && is_last && self.skips_at_end();
            bounces.ends.push(if cut { BouncesEnd::RunEnd } else { end });
        };
        let first = legs.next();
        skip(&mut bounces, first, legs.len() == 0);
        for event in &self.events {
            let impact = event.kind == EventKind::Impact as i64;
            if let (true, Ok(row)) = (impact, usize::try_from(event.index))
                && let Some(record) = self.impacts.get(row)
            {
                bounces.impacts.push(record.clone());
                bounces.skipped.push(false);
            }
            if begins_leg(event) {
                let leg = legs.next();
                skip(&mut bounces, leg, legs.len() == 0);
            }
        }
        bounces
    }

    /// Lists the impacts that were skipped in a leg, and says why the list ends.
    fn skipped_in(
        &self,
        leg: &Leg<M>,
        slowest: f64,
        left: &mut usize,
        cancel: &CancelToken,
        bounces: &mut Bounces<M::ImpactRow>,
    ) -> BouncesEnd {
        for event in impacts_hop_by_hop(&self.system, leg.anchor.clone(), leg.end) {
            let (clock, _, Kept::Impact(impact)) = M::kept(&event) else { continue };
            if cancel.is_cancelled() {
                return BouncesEnd::Interrupted;
            }
            if M::approach(&event) < slowest {
                return BouncesEnd::ApproachVelocity;
            }
            // The window may begin among the impacts of a chatter.
            if clock <= self.window {
                continue;
            }
            if *left == 0 {
                return BouncesEnd::Cap;
            }
            *left -= 1;
            bounces.impacts.push(impact);
            bounces.skipped.push(true);
        }
        BouncesEnd::Accumulation
    }
}

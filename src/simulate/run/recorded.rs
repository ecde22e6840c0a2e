//! What a run keeps of a model's events.

#![allow(private_interfaces)] // nobody outside of the crate can name the traits

use std::fmt::Debug;

use super::Run;
use super::leg::Leg;
use super::trace::Begins;
use crate::flight::Drive;
use crate::model::Point;
use crate::model::state::Clock;
use crate::simulate::event::{EventKind, EventRecord};
use crate::simulate::{AnchorOf, Model};

/// A kept event: a row of a table.
pub trait Row: Clone + PartialEq + Debug + Send + Sync {
    /// Time in the period.
    fn time_in_period(&self) -> f64;
    /// The same, in another period.
    #[must_use]
    fn moved(self, time: f64, period: i64) -> Self;
}

/// An event as a row of one of the tables; a stop is none.
pub enum Kept<M: Recorded> {
    /// An impact.
    Impact(M::ImpactRow),
    /// A graze.
    Graze(M::GrazeRow),
    /// An event of lasting contact.
    Contact(EventKind, M::ContactRow),
    /// None of these.
    Nothing,
}

/// A model whose runs are recorded.
pub trait Recorded: Model {
    /// A kept impact.
    type ImpactRow: Row;
    /// A kept graze.
    type GrazeRow: Row;
    /// A kept event of lasting contact.
    type ContactRow: Row;
    /// A kept section.
    type Section: Point + PartialEq + Debug + Send + Sync;
    /// Force in contact.
    type Force: Clone + Default + Debug;
    /// Evaluates a leg at times that mostly increase.
    type Follower;

    /// A section that is kept.
    fn section(state: &Self::State) -> Self::Section;
    /// An event, as it is kept, with its clock and time.
    fn kept(event: &Self::Event) -> (Clock, f64, Kept<Self>);
    /// The leg after an impact that is passed over, where its state tells all of it.
    fn passed_over(clock: Clock, state: &Self::State) -> Option<AnchorOf<Self>>;
    /// What the impact of a row does, where one contact is struck alone.
    fn resolved(&self, row: &Self::ImpactRow) -> Option<Self::Impact>;
    /// Whether a leg, and the impact that it begins with, are of this model: a file can say anything.
    fn has_leg(&self, _leg: &AnchorOf<Self>, _impact: Option<&Self::Impact>) -> bool {
        true
    }
    /// Whether all rows of a run are.
    fn has_rows(_run: &Run<Self>) -> bool {
        true
    }
    /// u before an impact.
    fn approach(event: &Self::Event) -> f64;
    /// Whether legs are noted that the events of a run do not tell.
    const NOTES_LEGS: bool = false;
    /// How this leg begins, in which impacts are skipped or not, with this event; `None` where the event
    /// tells all of it.
    fn begins(
        _event: &Self::Event,
        _leg: &AnchorOf<Self>,
        _skips: bool,
    ) -> Option<Begins<Self::Impact>> {
        None
    }
    /// The leg that a kept event begins, after the leg before it.
    fn leg_after(
        run: &Run<Self>,
        event: &EventRecord,
        before: &AnchorOf<Self>,
    ) -> Option<AnchorOf<Self>>;
    /// Follows a leg of a run.
    fn follower(run: &Run<Self>, motion: &Self::Motion, leg: &Leg<Self>) -> Self::Follower;
    /// State and force at an instant of that leg.
    fn followed(
        follower: &mut Self::Follower,
        run: &Run<Self>,
        motion: &Self::Motion,
        leg: &Leg<Self>,
        clock: Clock,
    ) -> (Self::State, Self::Force);
    /// The drive, and so its period.
    fn own_drive(&self) -> Drive;
}

//! The label of a run of a structure.

use crate::analysis::period::{PeriodReport, WhyUndecided};
use crate::model::structure::Structure;
use crate::numerics::cancel::CancelToken;
use crate::simulate::run::Run;

impl Run<Structure> {
    /// Period and label from the sections of the run and, where they still draw together, of its
    /// continuation.
    #[must_use]
    pub fn period(&self, cancel: &CancelToken) -> PeriodReport {
        let (report, later) = self.judged_by_sections(cancel);
        if !self.stop_reason.reached_the_end() {
            return report.undecided(WhyUndecided::Incomplete).unless(cancel);
        }
        let (found, last) = self.followed(report, later, |r| r.convergence().is_none(), cancel);
        let told = match &last {
            Some(last) => self.told_by(last, found),
            None => found,
        };
        told.unless(cancel)
    }
}

//! Work on a run that can be interrupted and go on.

use crate::numerics::cancel::CancelToken;

/// Work on a run that can be interrupted and go on.
pub(crate) trait Proceeds {
    /// Goes on until the run ends or `cancel` interrupts it, also after an interruption. Returns
    /// whether it has ended.
    fn proceed(&mut self, cancel: &CancelToken) -> bool;

    /// How many millionths of its time are done.
    #[cfg(feature = "python")]
    fn millionths_done(&self) -> usize;
}

//! A run in the making that is followed with its derivatives.

use super::error::SensitivityError;
use crate::numerics::cancel::CancelToken;
use crate::simulate::run::{Collection, Proceeds, Recorded, Run};

/// Where the events of a motion come from.
pub(super) trait Events {
    type Model: Recorded;

    /// The run that is in the making.
    #[cfg(feature = "python")]
    fn made(&self) -> Option<&Collection<Self::Model>>;
    /// The same, to go on with,
    fn made_mut(&mut self) -> Option<&mut Collection<Self::Model>>;
    /// and that alone.
    fn into_made(self) -> Option<Collection<Self::Model>>;
}

/// Follows a motion with its derivatives.
pub(super) trait Follows {
    type Source: Events;
    /// Derivatives of the state at the end.
    type Last;
    /// What is told of the motion.
    type Told;

    /// To the end of the run: the derivatives of the state there, or nothing if the caller has cancelled. A
    /// run in the making can then go on.
    fn follow(&mut self, source: &mut Self::Source)
    -> Result<Option<Self::Last>, SensitivityError>;

    /// What there is to tell, from what following has come to; of a motion that was cancelled up to its last
    /// event.
    fn told(self, last: Option<Self::Last>) -> Result<Self::Told, SensitivityError>;
}

/// A run in the making, and what follows it.
pub(super) struct Making<F: Follows> {
    follower: F,
    source: F::Source,
    /// The derivatives at the end, or why there are none.
    last: Option<Result<F::Last, SensitivityError>>,
}

/// A run, and what is told of its derivatives or why it has none.
pub(super) type Made<F> = (
    Run<<<F as Follows>::Source as Events>::Model>,
    Result<<F as Follows>::Told, SensitivityError>,
);

impl<F: Follows> Making<F> {
    pub fn new(follower: F, source: F::Source) -> Self {
        Self { follower, source, last: None }
    }

    /// The run, also one that was interrupted so early that nothing can be told.
    ///
    /// # Errors
    /// Those of the run, and why following it has ended.
    pub fn into_parts(self) -> Result<Made<F>, SensitivityError> {
        let told = self.follower.told(self.last.transpose()?);
        let Some(made) = self.source.into_made() else { unreachable!("a run in the making") };
        Ok((made.into_run()?, told))
    }
}

impl<F: Follows> Proceeds for Making<F> {
    fn proceed(&mut self, cancel: &CancelToken) -> bool {
        if self.last.is_none() {
            if let Some(made) = self.source.made_mut() {
                made.proceed_with(cancel);
            }
            self.last = self.follower.follow(&mut self.source).transpose();
        }
        self.last.is_some()
    }

    #[cfg(feature = "python")]
    fn millionths_done(&self) -> usize {
        self.source.made().map_or(0, Proceeds::millionths_done)
    }
}

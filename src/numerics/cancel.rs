//! A wish to end work early, shared between whoever may have it and all who work.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering::Relaxed};

/// Asks left of a token that nothing but [`CancelToken::cancel`] ends.
const UNCOUNTED: u64 = u64::MAX;

/// Ends work early, with what is done by then. Clones share one wish; a wish is never taken back.
///
/// A loop asks [`is_cancelled`](Self::is_cancelled) as often as it likes: the answer is one load of
/// a number that hardly ever changes.
#[derive(Debug, Clone)]
pub struct CancelToken {
    /// How many more times the answer is no: 0 once cancelled.
    left: Option<Arc<AtomicU64>>,
    /// The wish to end the work of which this is a part.
    whole: Option<Arc<AtomicU64>>,
}

impl CancelToken {
    /// A token that [`cancel`](Self::cancel) ends.
    #[must_use]
    pub fn new() -> Self {
        Self::after(UNCOUNTED)
    }

    /// A token that nothing ends.
    #[must_use]
    pub const fn never() -> Self {
        Self { left: None, whole: None }
    }

    /// A token that is cancelled when it is asked for the `asks`-th time. On one thread the work
    /// then ends at the same place each time, however fast it is.
    #[must_use]
    pub fn after(asks: u64) -> Self {
        Self { left: Some(Arc::new(AtomicU64::new(asks))), whole: None }
    }

    /// A token of a part of the work, which ends with the whole or on its own. Of a part's own
    /// parts only the outermost whole counts.
    pub(crate) fn part(&self) -> Self {
        let whole = self.whole.as_ref().or(self.left.as_ref()).map(Arc::clone);
        Self { whole, ..Self::new() }
    }

    /// As [`Self::part`], cancelled as well when it is asked for the `asks`-th time.
    #[cfg_attr(not(feature = "python"), expect(dead_code))]
    pub(crate) fn part_of(&self, asks: u64) -> Self {
        Self { left: Self::after(asks).left, ..self.part() }
    }

    /// Ends the work, soon.
    pub fn cancel(&self) {
        if let Some(left) = &self.left {
            left.store(0, Relaxed);
        }
    }

    /// Whether the work is to end.
    #[inline(always)]
    #[allow(clippy::inline_always)] // asked before every flight
    #[must_use]
    pub fn is_cancelled(&self) -> bool {
        let over = |left: &Option<Arc<AtomicU64>>| left.as_ref().is_some_and(|left| is_over(left));
        over(&self.left) || over(&self.whole)
    }

    /// How many more times the answer is no, as far as that is counted.
    #[must_use]
    pub fn asks_left(&self) -> u64 {
        self.left.as_ref().map_or(UNCOUNTED, |left| left.load(Relaxed))
    }
}

impl Default for CancelToken {
    fn default() -> Self {
        Self::new()
    }
}

#[inline(always)]
#[allow(clippy::inline_always)]
fn is_over(left: &AtomicU64) -> bool {
    match left.load(Relaxed) {
        UNCOUNTED => false,
        0 => true,
        _ => count(left),
    }
}

/// Counts an ask, the last of which cancels.
#[cold]
fn count(left: &AtomicU64) -> bool {
    let counted = |n: u64| (n != 0 && n != UNCOUNTED).then(|| n - 1);
    left.fetch_update(Relaxed, Relaxed, counted).is_ok_and(|before| before == 1)
        || left.load(Relaxed) == 0
}

#[cfg(test)]
mod tests {
    use super::CancelToken;

    #[test]
    fn the_nth_ask_cancels_and_all_after_it() {
        let token = CancelToken::after(3);
        let answers: Vec<bool> = (0..5).map(|_| token.is_cancelled()).collect();
        assert_eq!(answers, [false, false, true, true, true]);
        assert!(CancelToken::after(0).is_cancelled());
        let wish = CancelToken::new();
        assert!((0..10).all(|_| !wish.is_cancelled()));
        wish.clone().cancel();
        assert!(wish.is_cancelled());
        let never = CancelToken::never();
        never.cancel();
        assert!(!never.is_cancelled());
    }

    #[test]
    fn a_part_ends_alone_or_with_the_whole() {
        let whole = CancelToken::new();
        let (one, other) = (whole.part(), whole.part());
        one.cancel();
        assert!(one.is_cancelled() && !other.is_cancelled() && !whole.is_cancelled());
        whole.cancel();
        assert!(other.is_cancelled());
    }

    #[test]
    fn asks_of_a_part_are_asks_of_the_whole() {
        let whole = CancelToken::after(2);
        let part = whole.part();
        assert!(!part.is_cancelled() && part.is_cancelled() && whole.is_cancelled());
    }
}

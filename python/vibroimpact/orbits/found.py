"""What a search for periodic motions returns."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..interruption import interruptible
from .motion import PeriodicMotion

Array = NDArray[np.float64]


@interruptible
@dataclass(frozen=True, kw_only=True)
class NotFound:
    """No periodic motion was found; counts as False.

    Attributes
    ----------
    reason
        Why, in words.
    """

    reason: str

    def __bool__(self) -> bool:
        """Return False."""
        return False


@interruptible
@dataclass(frozen=True, kw_only=True, eq=False)
class MotionSearch:
    """Periodic motions reached from many starts.

    Attributes
    ----------
    motions
        Every periodic motion found, that with the largest share first.
    shares
        Part of the starts that end on each motion, shape (motions,).
    others
        Parts of the starts that end elsewhere, by label or stop reason; ``pending`` after Ctrl-C.
    starts
        Initial states, shape (k, 4).
    reached
        Number of the motion each start ends on, -1 for none, shape (k,).
    """

    motions: tuple[PeriodicMotion, ...]
    shares: Array
    others: dict[str, float]
    starts: Array
    reached: NDArray[np.int64]

    def __repr__(self) -> str:
        """Return the motions on which the starts end, with their shares, in words."""
        labels = [motion.label for motion in self.motions]
        ends = [*zip(labels, self.shares, strict=True), *self.others.items()]
        texts = ", ".join(f"{label} {share:.1%}" for label, share in ends)
        return f"<MotionSearch from {len(self.starts)} starts: {texts}>"

"""Windows of longer periods in a bifurcation diagram, to be enlarged on a finer grid."""

from dataclasses import dataclass

import numpy as np

from ..diagrams import Diagram


@dataclass(frozen=True)
class Window:
    """A run of adjacent parameter values with the same period m-n."""

    low: float
    high: float
    m: int
    n: int

    def widened(self, fraction: float) -> tuple[float, float]:
        """Return the interval with so much of its width added on either side."""
        margin = fraction * (self.high - self.low)
        return self.low - margin, self.high + margin


def period_windows(diagram: Diagram, *, longer_than: int = 2, at_least: int = 3) -> list[Window]:
    """Return the windows of period m > `longer_than` with impacts, the widest first.

    Parameters
    ----------
    diagram : Diagram
        Its parameter values must increase.
    longer_than : int
        Only motions of more drive periods than this.
    at_least : int
        Fewest adjacent values that count as a window.
    """
    m, n = np.asarray(diagram.m), np.asarray(diagram.n)
    change = np.flatnonzero((np.diff(m) != 0) | (np.diff(n) != 0)) + 1
    starts = np.concatenate([[0], change])
    stops = np.concatenate([change, [len(m)]])
    windows = [
        Window(
            float(diagram.parameter[start]),
            float(diagram.parameter[stop - 1]),
            int(m[start]),
            int(n[start]),
        )
        for start, stop in zip(starts, stops, strict=True)
        if m[start] > longer_than and n[start] > 0 and stop - start >= at_least
    ]
    return sorted(windows, key=lambda window: window.low - window.high)

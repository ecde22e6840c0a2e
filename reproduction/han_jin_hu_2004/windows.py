"""Windows of longer periods in a bifurcation diagram, to be enlarged on a finer grid.

Where a focus converges slowly, its spiral can pass for a longer period after some hundred drive
periods: a window counts only if a run ten times as long gives the same label.
"""

from dataclasses import dataclass

import numpy as np

from vibroimpact import Diagram, simulate

_LONGER = 10
_PLACES = (0.5, 0.25, 0.75)


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
    return sorted(_joined(windows), key=lambda window: window.low - window.high)


def _joined(windows: list[Window]) -> list[Window]:
    """Join windows of the same m-n that only a short stretch of other motions separates."""
    joined: list[Window] = []
    for window in windows:
        last = joined[-1] if joined else None
        if last is not None and (last.m, last.n) == (window.m, window.n):
            wider = max(last.high - last.low, window.high - window.low)
            if window.low - last.high < 0.5 * wider:
                joined[-1] = Window(last.low, window.high, last.m, last.n)
                continue
        joined.append(window)
    return joined


def is_confirmed(window: Window, diagram: Diagram) -> bool:
    """Return whether a longer run at one of three places in the window has its period m-n."""
    settings = diagram.settings
    for place in _PLACES:
        value = window.low + place * (window.high - window.low)
        run = simulate(
            diagram.system.replace(**{diagram.parameter_name: value}),
            initial=settings.initial[0],
            periods=_LONGER * settings.periods,
            keep=settings.keep,
        )
        if run.label == f"{window.m}-{window.n}":
            return True
    return False

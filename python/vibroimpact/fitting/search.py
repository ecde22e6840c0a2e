"""The search for the values of the unknowns that fit best.

The window that is fitted grows from the start of the records to their end: it goes as far as the
prediction agrees, is fitted, and goes on. Where small differences have grown much, a new segment
starts. So neither a chaotic record nor a wrong first guess needs luck.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ..errors import SimulationError
from ..tables import EventKind
from .alignment import intervals
from .jumps import WIDTHS, jumps, widened, without_edges
from .minimum import Found, Minimiser
from .prediction import sizes_in, states_at
from .problem import Evaluation, Point, Problem, Window
from .record import Record, is_heard
from .statistics import are_negligible, bounded, determination, ljung_box

Array = NDArray[np.float64]

# A new segment starts where a small difference of the state has grown so many times.
_GROWTH = 30.0
# Segments at most, and the shortest flight, in parts of the mean, in whose middle one may start.
_MOST_SEGMENTS, _LEAST_FLIGHT = 120, 0.2
# Steps at most: while the window grows, and in all of it.
_STEPS_BETWEEN, _STEPS = 12, 60
# After so many in all there are no more random changes, and the window grows to the whole.
_MOST_STEPS = 400
# Fewer of long motions, and fewer segments: so many impacts in all steps, but at least so many
# steps.
_MOST_WORK, _LEAST_STEPS = 200_000, 20
# The window grows at least by this part of all rows; so often in a row without agreement.
_LEAST_GROWTH, _MOST_FAILURES = 40, 5
# Rounds in which rows beside impacts are chosen anew.
_MOST_ROUNDS = 4
# Random changes of a minimum that does not fit: the mean square of its residuals in standard errors
# is larger than the first, or they are random with less than the second probability.
_HOPS, _FAR_TOO_LARGE, _NOT_RANDOM = 4, 2.0, 1e-8
# A prediction agrees with a time of an impact to this part of the intervals beside it, and with a
# value to this part of the standard deviation of all; or to so many standard errors.
_TIME_AGREES, _VALUE_AGREES, _ERRORS_AGREE = 0.25, 0.3, 6.0


class Search(Minimiser):
    """The search from one start.

    Parameters
    ----------
    problem
        What is fitted.
    sigmas
        Standard errors of the rows of each record.
    loss
        Name of the loss.
    slow
        Whether the window grows only where the prediction agrees to its errors. Then the first rows
        lead, and a minimum that all rows together have beside the right one is passed by.
    """

    def __init__(
        self, problem: Problem, sigmas: Sequence[Array], loss: str, slow: bool = False
    ) -> None:
        super().__init__(problem, widened(problem, sigmas, WIDTHS[0]), loss)
        self.slow = slow
        self.base = list(sigmas)
        self.most = _MOST_STEPS
        self.random = np.random.default_rng(0)
        self.times = np.unique(np.concatenate([record.times for record in problem.records]))

    def run(self, values: Array) -> Found | None:
        """Return the fit from some values; None if the machine has no motion there."""
        least = max(1, len(self.times) // _LEAST_GROWTH)
        start = Point(values, np.zeros((0, len(self.problem.initial))))
        whole = self._window((0.0,), len(self.times))
        first = self.problem.evaluate(start, whole)
        rows = min(len(self.times), max(3, least))
        if first is None:
            # It may go wrong late only.
            whole = self._window((0.0,), rows)
            first = self.problem.evaluate(start, whole)
            if first is None:
                return None
        self.take_sizes(values, first)
        work = sum(len(run.impacts) for run in first.runs)
        self.most = int(np.clip(_MOST_WORK // max(1, work), _LEAST_STEPS, _MOST_STEPS))
        rows = max(rows, self._agrees(first, whole))
        point, failures = start, 0
        borders: tuple[float, ...] = (0.0,)
        found: Found | None = None
        while True:
            window = self._window(borders, rows)
            point, window = self._cut(point, window)
            borders = window.borders
            final = rows == len(self.times)
            found = self._settled(point, window, final)
            if found is None or final:
                return found
            point = found.point
            rows_there, failed = self._further(found, rows)
            failures = failures + 1 if failed else 0
            if failures > _MOST_FAILURES or self.steps > self.most:
                rows = len(self.times)
            else:
                rows = min(len(self.times), max(rows + least, min(rows_there, 2 * rows)))

    def again(self, found: Found, sigmas: Sequence[Array]) -> Found | None:
        """Return the fit of all rows from another one, with other standard errors."""
        self.base = list(sigmas)
        return (
            self._exact(found)
            if self._jumps
            else self._with(self.base, found.point, found.window, True)
        )

    def _settled(self, point: Point, window: Window, final: bool) -> Found | None:
        """Return the fit of a window."""
        if not self._jumps:
            return self._with(self.base, point, window, final)
        found = None
        for width in WIDTHS:
            sigmas = widened(self.problem, self.base, width)
            found = self._with(sigmas, point, window, final)
            if found is None:
                return None
            point = found.point
        assert found is not None
        return self._exact(found)

    def _exact(self, found: Found) -> Found | None:
        """Return the fit without rows on which side of an impact is not known."""
        for _ in range(_MOST_ROUNDS):
            sigmas = self.with_sides(found)
            if sigmas is None:
                break
            better = self._with(sigmas, found.point, found.window, found.whole)
            if better is None:
                break
            found = better
        return found

    def with_sides(self, found: Found) -> list[Array] | None:
        """Return standard errors, infinite for rows on which side of an impact is not known.

        None where these are those of the search, or would leave too few rows.
        """
        derived = self.along(found)
        if derived is None:
            return None
        count = len(found.point.values)
        rows = sum(int(np.isfinite(sigma).sum()) for sigma in self.sigmas)
        size = max(1.0, 2.0 * found.cost / max(1, rows - count))
        own, changes = self.problem.unknowns.scales, derived.changes
        spread = determination(derived.derivative, changes[:count], own, size).spread
        deviations = self.scales(found.point)[:, None] * (changes @ spread)
        sigmas = without_edges(self.problem, found.point, found.window, self.base, deviations)
        same = all(np.array_equal(a, b) for a, b in zip(sigmas, self.sigmas, strict=True))
        counting = sum(int(np.isfinite(sigma).sum()) for sigma in sigmas)
        return None if same or counting <= count else sigmas

    def expect(self, found: Found) -> None:
        """Take the standard errors of rows that a fit which ends here would have."""
        self.sigmas = self.base
        for _ in range(_MOST_ROUNDS):
            sigmas = self.with_sides(found)
            if sigmas is None:
                break
            self.sigmas = sigmas

    def _with(self, sigmas: list[Array], point: Point, window: Window, final: bool) -> Found | None:
        """Return the fit of a window with some standard errors."""
        self.sigmas = sigmas
        most = _STEPS if final else _STEPS_BETWEEN
        found = self.minimise(point, window, most, final)
        return found if found is None else self._hopped(found, most)

    def _hopped(self, found: Found, most: int) -> Found:
        """Return a lower minimum near one that does not fit, if there is one."""
        for _ in range(_HOPS):
            if self.steps > self.most or not self._misfits(found):
                break
            point = self.kicked(found, self.random)
            other = None if point is None else self.minimise(point, found.window, most, found.whole)
            if other is not None and self._misfit(other) < self._misfit(found):
                found = other
        return found

    def _misfit(self, found: Found) -> float:
        return self.misfit(found.evaluation, found.window)

    def _misfits(self, found: Found) -> bool:
        """Whether residuals are far too large, or far from random."""
        known = [record.sigma is not None for record in self.problem.records]
        for z, sigma, stated in zip(
            self.weighted(found.evaluation), self.sigmas, known, strict=True
        ):
            used = z[np.isfinite(sigma[: len(z)])]
            if stated and float(used @ used) > _FAR_TOO_LARGE * len(used):
                return True
            if not are_negligible(used) and ljung_box(bounded(used)) < _NOT_RANDOM:
                return True
        extra = found.whole and found.evaluation.unheard(found.window.end)
        return bool(found.evaluation.missing or extra)

    @property
    def _jumps(self) -> bool:
        return any(jumps(record, self.problem) for record in self.problem.records)

    def _further(self, found: Found, rows: int) -> tuple[int, bool]:
        """Return as far as the prediction agrees, in rows, and whether not even in the window."""
        window = self._window(found.window.borders, len(self.times))
        ahead = self.problem.evaluate(found.point, window)
        if ahead is None:
            return rows, False
        agreed = self._agrees(ahead, window)
        return agreed, agreed < rows

    def _window(self, borders: tuple[float, ...], rows: int) -> Window:
        """Return the window of the first rows of all records together."""
        end = float(self.times[rows - 1])
        least = 1e-3 * self.problem.machine._usual_period
        return Window(borders, max(end, least))

    def take_sizes(self, values: Array, found: Evaluation) -> None:
        """Set the units of steps by the motion at some values."""
        self.sizes = sizes_in(found.runs, self.problem.initial)
        unknowns = self.problem.unknowns.sized(values, self.sizes)
        self.problem = replace(self.problem, unknowns=unknowns)

    # How far a prediction agrees.

    def _agrees(self, found: Evaluation, window: Window) -> int:
        """Return the number of rows, of all records together, before the first disagreement."""
        last = window.end
        for record, sigma, residuals in zip(
            self.problem.records, self.base, found.residuals, strict=True
        ):
            bad = _disagreement(record, sigma, residuals, self.slow)
            if bad is not None:
                last = min(last, np.nextafter(record.times[bad], 0.0))
        return int(np.searchsorted(self.times, last, "right"))

    # Where segments start.

    def _cut(self, point: Point, window: Window) -> tuple[Point, Window]:
        """Let a new segment start wherever small differences have grown much."""
        while len(window.borders) < min(_MOST_SEGMENTS, self.most):
            found = self.problem.evaluate(point, window)
            if found is None:
                break
            run, begin = found.runs[-1], window.borders[-1]
            times = _within_flights(run, window.end - begin)
            if not len(times):
                break
            names = self.problem.machine._coordinates_by_name
            try:
                moved = run.sensitivity(*names).trajectory(times)
            except SimulationError:
                break
            with np.errstate(over="ignore", invalid="ignore"):
                scaled = moved * self.sizes[None, None, :] / self.sizes[None, :, None]
            grown = np.flatnonzero(~(np.abs(scaled).max(axis=(1, 2)) <= _GROWTH))
            if not len(grown):
                break
            time = times[grown[0]]
            state = states_at(run, np.array([time]))
            point = Point(point.values, np.vstack([point.nodes, state]))
            window = replace(window, borders=(*window.borders, begin + float(time)))
        return point, window


def _disagreement(record: Record, sigma: Array, residuals: Array, slow: bool) -> int | None:
    """Return the first row that a prediction misses by much; None if there is none.

    ``slow``: by more than its error.
    """
    count = len(residuals)
    size = np.abs(residuals)
    if is_heard(record.kind):
        beside = intervals(record.times)[:count]
        wide = np.zeros(count) if slow else _TIME_AGREES * beside
        bad = size > np.maximum(wide, _ERRORS_AGREE * sigma[:count])
        found = np.flatnonzero(bad)
        return int(found[0]) if len(found) else None
    if len(record) == 1:
        return None
    least = 0.0 if slow else _VALUE_AGREES * float(np.std(record.values))
    bad = size > np.maximum(least, _ERRORS_AGREE * sigma[:count])
    # A velocity is far off for a moment where an impact comes a little early or late; an outlier
    # is alone.
    near = np.convolve(bad, np.ones(5), "full")[: len(bad)]
    found = np.flatnonzero(near >= 3)
    return int(found[0]) if len(found) else None


def _within_flights(run: object, end: float) -> Array:
    """Return the middles of the flights of a run, but for very short ones, before a time."""
    events = run.events  # type: ignore[attr-defined]
    times = np.array([0.0, *np.asarray(events["time"])])
    flying = (EventKind.IMPACT, EventKind.GRAZE, EventKind.RELEASE)
    free = np.array([False, *[kind in flying for kind in events["kind"]]])[:-1]
    lengths = np.diff(times)
    middles = 0.5 * (times[1:] + times[:-1])
    long = lengths > _LEAST_FLIGHT * end / max(1, len(lengths))
    chosen: Array = middles[free & long & (middles < end)]
    return chosen

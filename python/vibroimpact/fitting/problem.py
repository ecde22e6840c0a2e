"""The equations of a fit: residuals of records, and continuity between segments of the motion.

The motion is cut into segments. Each starts from a state of its own, an unknown; that the end of
one is the start of the next is an equality constraint (multiple shooting: H. G. Bock, 1981). The
impacts that a segment predicts are compared one by one, in their order, with those measured in it;
a run that lacks one goes on past the segment's end until it comes.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import ParameterError, SimulationError, StateError
from ..run import Run
from ..simulation import simulate
from ..system import System
from .alignment import Places, aligned, intervals
from .prediction import derivative, later, predicted, states_at
from .record import IMPACT_TIMES, Record
from .unknowns import Unknowns, coordinates_of

Array = NDArray[np.float64]

# How often a run that lacks impacts goes on, each time by its own length again or by a period.
_MOST_EXTENSIONS = 3
# A run ends a little after the last instant that it is asked for.
_BEYOND = 1.0 + 1e-6
# Events of a run: so many for each row of a record, and so many more.
_EVENTS_PER_ROW, _MORE_EVENTS = 20, 20_000


@dataclass(frozen=True)
class Point:
    """Where the search is: values of the unknowns, and the start of each later segment."""

    values: Array
    nodes: Array


@dataclass(frozen=True)
class Window:
    """The part of the records that is fitted, and where segments start: 0 first."""

    borders: tuple[float, ...]
    end: float

    def ends(self) -> list[tuple[float, float]]:
        """Return first and last time of each segment."""
        return [*zip(self.borders, (*self.borders[1:], self.end), strict=True)]


@dataclass(frozen=True)
class Evaluation:
    """The residuals of a point, predicted minus measured, of the rows of each record in the window.

    Attributes
    ----------
    runs
        One for each segment.
    starts
        When each begins.
    residuals
        One array for each record; half the interval beside it where an impact is missing.
    predicted
        What is compared with the values.
    places
        Of impact times, for each segment: which impact of its run each row is, -1 for none.
    defects
        End of each segment minus start of the next, flat.
    """

    runs: list[Run]
    starts: tuple[float, ...]
    residuals: list[Array]
    predicted: list[Array]
    places: list[list[Places | None]]
    defects: Array

    @property
    def missing(self) -> int:
        """How many measured impacts the motion lacks."""
        return sum(
            int((mine < 0).sum()) for many in self.places for mine in many if mine is not None
        )

    def unheard(self, end: float) -> list[float]:
        """Return the approach velocities of impacts before ``end`` that were not measured."""
        found: list[float] = []
        for run, begin, stop, many in zip(
            self.runs, self.starts, (*self.starts[1:], end), self.places, strict=True
        ):
            times = begin + np.asarray(run.impacts["time"])
            for mine in many:
                if mine is not None:
                    extra = np.flatnonzero(times < stop)
                    extra = extra[~np.isin(extra, mine)]
                    found += np.asarray(run.impacts["approach_velocity"])[extra].tolist()
        return found


@dataclass(frozen=True)
class Problem:
    """A machine with a start, records, and what is looked for."""

    system: System
    initial: Array
    unknowns: Unknowns
    records: Sequence[Record]

    def evaluate(self, point: Point, window: Window) -> Evaluation | None:
        """Return the residuals of a point; None where there is no motion of this kind."""
        try:
            machine = self.unknowns.machine_of(self.system, point.values)
            first = self.unknowns.start_of(self.initial, point.values)
        except ParameterError:
            return None
        runs: list[Run] = []
        values: list[list[Array]] = [[] for _ in self.records]
        places: list[list[Places | None]] = []
        starts = [first, *point.nodes]
        for (begin, end), start in zip(window.ends(), starts, strict=True):
            rows = [self._rows(record, begin, end) for record in self.records]
            run = self._run(later(machine, begin), start, end - begin, rows)
            if run is None:
                return None
            runs.append(run)
            here = [
                self._places(run, record, mine, begin)
                for record, mine in zip(self.records, rows, strict=True)
            ]
            for many, record, mine, place in zip(values, self.records, rows, here, strict=True):
                many.append(_values(run, record, mine, place, begin))
            places.append(here)
        found = [np.concatenate(many) for many in values]
        residuals = [
            each - record.values[: len(each)]
            for each, record in zip(found, self.records, strict=True)
        ]
        ends = [
            states_at(run, np.array([end - begin]))[0]
            for run, (begin, end) in zip(runs[:-1], window.ends()[:-1], strict=True)
        ]
        defects = np.concatenate(
            [np.zeros(0), *(e - s for e, s in zip(ends, starts[1:], strict=True))]
        )
        return Evaluation(runs, window.borders, residuals, found, places, defects)

    def derivatives(self, found: Evaluation, window: Window) -> tuple[list[Array], Array]:
        """Return derivatives of the residuals of each record, and of the defects.

        Columns are the unknowns, then the starts of later segments.
        """
        size, many = len(self.initial), len(found.runs)
        width = len(self.unknowns.names) + size * (many - 1)
        jacobians: list[list[Array]] = [[] for _ in self.records]
        constraint = np.zeros((size * (many - 1), width))
        for k, (run, (begin, end)) in enumerate(zip(found.runs, window.ends(), strict=True)):
            names, columns, chain = self._columns(k, begin)
            sensitivity = run.sensitivity(*names)
            for blocks, record, place in zip(jacobians, self.records, found.places[k], strict=True):
                rows = self._rows(record, begin, end)
                block = np.zeros((rows.stop - rows.start, width))
                own = _derivative(run, sensitivity, names, record, rows, place, begin)
                block[:, columns] = own @ chain
                blocks.append(block)
            if k < many - 1:
                moved = sensitivity.trajectory(np.array([end - begin]))[0]
                here = slice(size * k, size * (k + 1))
                constraint[here, columns] = moved @ chain
                first = len(self.unknowns.names) + size * k
                constraint[here, first : first + size] = -np.eye(size)
        return [np.concatenate(blocks) for blocks in jacobians], constraint

    def _columns(self, segment: int, begin: float) -> tuple[list[str], list[int], Array]:
        """Return what a segment is differentiated by, the columns that get it, and the chain rule.

        The phase at which a segment starts turns with the drive frequency.
        """
        numbers = list(self.unknowns.names[: self.unknowns.machine])
        coordinates = coordinates_of(self.system)
        size, count = len(coordinates), len(self.unknowns.names)
        if segment == 0:
            names = [*numbers, *self.unknowns.names[self.unknowns.machine :]]
            columns = list(range(count))
        else:
            names = [*numbers, *coordinates]
            first = count + size * (segment - 1)
            columns = [*range(len(numbers)), *range(first, first + size)]
        chain = np.eye(len(names))
        if "drive_frequency" in numbers and begin > 0.0:
            turned = chain[names.index("phase")] if "phase" in numbers else np.zeros(len(names))
            turned = turned.copy()
            turned[names.index("drive_frequency")] += begin
            if "phase" in numbers:
                chain[names.index("phase")] = turned
            else:
                names = [*names, "phase"]
                chain = np.vstack([chain, turned])
        return names, columns, chain

    def _rows(self, record: Record, begin: float, end: float) -> slice:
        """Return the rows of a record in (begin, end], with those at 0 in the first segment."""
        side: Any = "left" if begin == 0.0 else "right"
        first = int(np.searchsorted(record.times, begin, side))
        return slice(first, max(first, int(np.searchsorted(record.times, end, "right"))))

    def _places(self, run: Run, record: Record, rows: slice, begin: float) -> Places | None:
        """Return which impacts of a run the rows of a record are; None for other kinds."""
        if record.kind != IMPACT_TIMES:
            return None
        impacts = run.impacts
        return aligned(
            record.times[rows],
            intervals(record.times)[rows],
            begin + np.asarray(impacts["time"]),
            np.asarray(impacts["approach_velocity"]),
        )

    def _run(self, machine: System, start: Array, length: float, rows: list[slice]) -> Run | None:
        """Return the run of a segment, long enough for its impacts if they come."""
        wanted = max(
            (mine.stop - mine.start) for record, mine in zip(self.records, rows, strict=True)
        )
        heard = max(
            [0]
            + [
                mine.stop - mine.start
                for record, mine in zip(self.records, rows, strict=True)
                if record.kind == IMPACT_TIMES
            ]
        )
        cap = _EVENTS_PER_ROW * wanted + _MORE_EVENTS
        more = min(machine.drive_period, 2.0 * np.pi)
        whole = length * _BEYOND
        for _ in range(_MOST_EXTENSIONS + 1):
            try:
                run: Run = simulate(machine, initial=start.tolist(), time=whole, max_events=cap)
            except (StateError, SimulationError):
                return None
            if run.final_state.time < length:
                return None
            if len(run.impacts) >= heard or run.stop_reason != "completed":
                break
            whole += max(more, 0.5 * whole)
        return run


def _values(run: Run, record: Record, rows: slice, places: Places | None, begin: float) -> Array:
    """Return what a segment predicts of its rows of a record.

    Of a missing impact it is a time that is half an interval off.
    """
    if places is None:
        return predicted(run, record.kind, record.times[rows] - begin)
    times = begin + np.asarray(run.impacts["time"])
    found = record.times[rows] + 0.5 * intervals(record.times)[rows]
    found[places >= 0] = times[places[places >= 0]]
    return found


def _derivative(
    run: Run,
    sensitivity: Any,
    names: Sequence[str],
    record: Record,
    rows: slice,
    places: Places | None,
    begin: float,
) -> Array:
    """Return the derivatives of `_values`; those of missing impacts are 0."""
    if places is None:
        return derivative(run, sensitivity, names, record.kind, record.times[rows] - begin)
    moved = np.asarray(sensitivity.impacts.time)
    found = np.zeros((len(places), len(names)))
    found[places >= 0] = moved[places[places >= 0]]
    return found

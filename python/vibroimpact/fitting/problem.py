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
from ..machine import Machine
from ..made import Basis, basis_of
from ..simulation import simulated
from .alignment import Places, aligned, intervals
from .prediction import derivative, heard_in, partial, predicted, states_at
from .record import Record, is_heard
from .unknowns import Unknowns

Array = NDArray[np.float64]

# How often a run that lacks impacts goes on, each time by its own length again or by a period.
_MOST_EXTENSIONS = 3
# A run ends a little after the last instant that it is asked for.
_BEYOND = 1.0 + 1e-6
# Where a measured impact is none of the motion: it lacks it, or the record may have it wrongly.
MISSING, DOUBTFUL = -1, -2
# Standard errors that two impacts are apart at least where one is not taken for the other.
_ERRORS = 6.0
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
    machine
        The machine with the values of the point.
    runs
        One for each segment.
    starts
        When each begins.
    residuals
        One array for each record; half the interval beside it where an impact is missing.
    predicted
        What is compared with the values.
    places
        Of impact times, for each segment: which impact of its run each row is; or
        MISSING, or DOUBTFUL where it is not sure that it was heard.
    heard
        Of impact times, for each segment: the impacts of its run that must have been heard.
    defects
        End of each segment minus start of the next, flat.
    """

    machine: Any
    runs: list[Any]
    starts: tuple[float, ...]
    residuals: list[Array]
    predicted: list[Array]
    places: list[list[Places | None]]
    heard: list[list[Places]]
    defects: Array

    @property
    def missing(self) -> int:
        """How many measured impacts the motion lacks."""
        return sum(
            int((mine == MISSING).sum())
            for many in self.places
            for mine in many
            if mine is not None
        )

    def lacking(self, records: Sequence[Record]) -> list[NDArray[np.bool_]]:
        """Return where measured impacts of each record are none of the motion."""
        found: list[NDArray[np.bool_]] = []
        for record, many in zip(records, zip(*self.places, strict=True), strict=True):
            mine = np.concatenate([_NONE, *(each for each in many if each is not None)])
            missing = np.zeros(len(record), dtype=np.bool_)
            missing[: len(mine)] = mine == MISSING
            found.append(missing)
        return found

    def unheard(self, end: float) -> list[tuple[float, float]]:
        """Return times and approach velocities of impacts before ``end`` that were not measured."""
        found: list[tuple[float, float]] = []
        for run, begin, stop, many, could in zip(
            self.runs,
            self.starts,
            (*self.starts[1:], end),
            self.places,
            self.heard,
            strict=True,
        ):
            times = begin + np.asarray(run.impacts["time"])
            for mine, theirs in zip(many, could, strict=True):
                if mine is not None:
                    extra = theirs[times[theirs] < stop]
                    extra = extra[~np.isin(extra, mine)]
                    velocities = np.asarray(run.impacts["approach_velocity"])[extra]
                    found += zip(times[extra].tolist(), velocities.tolist(), strict=True)
        return found


@dataclass(frozen=True)
class Problem:
    """A machine with a start, records, and what is looked for.

    Attributes
    ----------
    in_order
        Whether the impacts of a record are the first ones of the motion, whatever their times.
    """

    machine: Any
    initial: Array
    unknowns: Unknowns
    records: Sequence[Record]
    in_order: bool = False

    def evaluate(self, point: Point, window: Window) -> Evaluation | None:
        """Return the residuals of a point; None where there is no motion of this kind."""
        try:
            machine = self.unknowns.machine_of(self.machine, point.values)
            first = self.unknowns.start_of(self.initial, point.values)
        except ParameterError:
            return None
        runs: list[Any] = []
        values: list[list[Array]] = [[] for _ in self.records]
        places: list[list[Places | None]] = []
        starts = [first, *point.nodes]
        for (begin, end), start in zip(window.ends(), starts, strict=True):
            rows = [self._rows(record, begin, end) for record in self.records]
            run = self._run(machine, begin, start, end - begin, rows)
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
        heard = [
            [
                _surely_heard(run, record) if is_heard(record.kind) else _NONE
                for record in self.records
            ]
            for run in runs
        ]
        return Evaluation(machine, runs, window.borders, residuals, found, places, heard, defects)

    def derivatives(self, found: Evaluation, window: Window) -> tuple[list[Array], Array]:
        """Return derivatives of the residuals of each record, and of the defects.

        Columns are the unknowns, then the starts of later segments.
        """
        size, many = len(self.initial), len(found.runs)
        width = len(self.unknowns.names) + size * (many - 1)
        jacobians: list[list[Array]] = [[] for _ in self.records]
        constraint = np.zeros((size * (many - 1), width))
        numbers = self.unknowns.names[: self.unknowns.machine]
        sizes = self.unknowns.scales[: len(numbers)]
        basis = basis_of(found.machine, numbers)
        for k, (run, (begin, end)) in enumerate(zip(found.runs, window.ends(), strict=True)):
            own, columns = self._columns(k, begin, basis, found.machine)
            sensitivity = own.of(run)
            for blocks, record, place in zip(jacobians, self.records, found.places[k], strict=True):
                rows = self._rows(record, begin, end)
                times = record.times[rows] - begin
                block = np.zeros((rows.stop - rows.start, width))
                if place is None:
                    moved = derivative(run, sensitivity, record.kind, times)
                    block[:, columns] = _product(moved, own.chain)
                    block[:, : len(numbers)] += partial(
                        found.machine, run, begin, record.kind, times, numbers, sizes
                    )
                else:  # those of missing impacts are 0
                    heard = place >= 0
                    moved = np.asarray(sensitivity.impacts.time)[place[heard]]
                    block[np.flatnonzero(heard)[:, None], columns] = _product(moved, own.chain)
                blocks.append(block)
            if k < many - 1:
                moved = sensitivity.trajectory(np.array([end - begin]))[0]
                here = slice(size * k, size * (k + 1))
                constraint[here, columns] = _product(moved, own.chain)
                first = len(self.unknowns.names) + size * k
                constraint[here, first : first + size] = -np.eye(size)
        return [np.concatenate(blocks) for blocks in jacobians], constraint

    def _columns(
        self, segment: int, begin: float, basis: Basis, machine: Any
    ) -> tuple[Basis, list[int]]:
        """Return by what a segment is differentiated, and the columns that get it."""
        coordinates = machine._coordinates_by_name
        size, count = len(coordinates), len(self.unknowns.names)
        if segment == 0:
            own = basis.with_coordinates(self.unknowns.names[self.unknowns.machine :])
            return own, list(range(count))
        first = count + size * (segment - 1)
        columns = [*range(self.unknowns.machine), *range(first, first + size)]
        return basis.turned(machine, begin).with_coordinates(coordinates), columns

    def _rows(self, record: Record, begin: float, end: float) -> slice:
        """Return the rows of a record in (begin, end], with those at 0 in the first segment."""
        side: Any = "left" if begin == 0.0 else "right"
        first = int(np.searchsorted(record.times, begin, side))
        return slice(first, max(first, int(np.searchsorted(record.times, end, "right"))))

    def _places(self, run: Any, record: Record, rows: slice, begin: float) -> Places | None:
        """Return which impacts of a run the rows of a record are; None for other kinds."""
        if not is_heard(record.kind):
            return None
        could = heard_in(run, record.kind, record.resolution)
        if self.in_order:
            first = np.full(rows.stop - rows.start, MISSING)
            first[: len(could)] = could[: len(first)]
            return first
        found = aligned(
            record.times[rows],
            _reach(record)[rows],
            begin + np.asarray(run.impacts["time"])[could],
            np.asarray(run.impacts["approach_velocity"])[could],
        )
        alone = found == MISSING
        found[~alone] = could[found[~alone]]
        if record.resolution is not None:
            near = np.diff(record.times, prepend=-np.inf)[rows] < _sure(record)
            found[alone & near] = DOUBTFUL
        return found

    def _run(
        self, machine: Machine, begin: float, start: Array, length: float, rows: list[slice]
    ) -> Any:
        """Return the run of a segment, long enough for its impacts if they come; or None."""
        pairs = [*zip(self.records, rows, strict=True)]
        cap = _EVENTS_PER_ROW * max(mine.stop - mine.start for _, mine in pairs) + _MORE_EVENTS
        heard = [(each, mine.stop - mine.start) for each, mine in pairs if is_heard(each.kind)]
        turned: Any = machine._turned(machine.drive_frequency * begin) if begin else machine
        more = machine._usual_period
        whole = length * _BEYOND
        initial = start.reshape(machine._starts_shape)
        for _ in range(_MOST_EXTENSIONS + 1):
            try:
                run = simulated(turned, initial=initial, time=whole, max_events=cap)
            except (StateError, SimulationError):
                return None
            if run.final_state.time < length:
                return None
            enough = all(
                len(heard_in(run, each.kind, each.resolution)) >= many for each, many in heard
            )
            if enough or run.stop_reason != "completed":
                break
            whole += max(more, 0.5 * whole)
        return run


def _reach(record: Record) -> Array:
    """Return how far a time may be off for its impact to be taken for another one.

    It is the interval beside it, but for impacts so near to each other that errors are larger.
    """
    beside = intervals(record.times)
    return beside if record.sigma is None else np.maximum(beside, _ERRORS * record.sigma)


def _sure(record: Record) -> float:
    """Return the interval above which an impact is surely heard, and below which it may be none."""
    error = 0.0 if record.sigma is None else float(record.sigma.max())
    return (record.resolution or 0.0) + _ERRORS * error


def _surely_heard(run: Any, record: Record) -> Places:
    """Return the impacts of a run that a record must have."""
    shortest = None if record.resolution is None else _sure(record)
    return heard_in(run, record.kind, shortest)


# Impacts of a record that hears none.
_NONE = np.zeros(0, dtype=np.int64)


def _product(moved: Array, chain: Array) -> Array:
    """Return derivatives by the chain rule; not finite ones are refused later."""
    with np.errstate(over="ignore", invalid="ignore"):
        found: Array = moved @ chain
    return found


def _values(run: Any, record: Record, rows: slice, places: Places | None, begin: float) -> Array:
    """Return what a segment predicts of its rows of a record.

    Of a missing impact it is a time that is half an interval off; a doubtful one does not count.
    """
    if places is None:
        return predicted(run, record.kind, record.times[rows] - begin)
    times = begin + np.asarray(run.impacts["time"])
    missing = places == MISSING
    found = record.times[rows] + np.where(missing, 0.5 * intervals(record.times)[rows], 0.0)
    found[places >= 0] = times[places[places >= 0]]
    return found

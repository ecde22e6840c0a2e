"""Velocities and accelerations jump at impacts: how a search gets past that.

A row beside an impact changes by the jump when the predicted impact passes it, and its derivative
does not tell. While the search is under way, rows may be right at another instant, some rows away:
their standard errors are widened by what changes in that time. In the end rows that are so near to
an impact that the fit cannot tell on which side of it they are do not count.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ..errors import SimulationError
from ..machine import Machine
from .problem import Point, Problem, Window
from .record import Record, is_heard

Array = NDArray[np.float64]

WIDTHS = (4, 2, 1)
"""How many rows the instants may be wrong by, one after another."""

# Standard errors of an impact's time within which rows do not count, and at most so many rows.
_ERRORS, _MOST_ROWS = 4.0, 2.0
# A derivative that has left the range of floats.
_MOST = 1e100
# The same as a part of the median interval between impacts, for rows that are far apart.
_OF_INTERVAL = 0.1


def jumps(record: Record, problem: Problem) -> bool:
    """Whether what is recorded jumps at impacts."""
    return not is_heard(record.kind) and jumps_at_impacts(problem.machine, record.kind)


def jumps_at_impacts(machine: Machine, kind: str) -> bool:
    """Whether this of a machine's motion, no times of impacts, jumps there: not displacements."""
    return kind not in machine._coordinates_by_name or kind[0] == "v"


def widened(problem: Problem, sigmas: Sequence[Array], width: int) -> list[Array]:
    """Return standard errors that allow for instants that are wrong by some rows."""
    found = []
    for record, sigma in zip(problem.records, sigmas, strict=True):
        if jumps(record, problem):
            values, most = record.values, np.zeros(len(record))
            for k in range(1, min(width, len(values) - 1) + 1):
                change = np.abs(values[k:] - values[:-k])
                most[k:] = np.maximum(most[k:], change)
                most[:-k] = np.maximum(most[:-k], change)
            sigma = np.hypot(sigma, 0.5 * most)
        found.append(sigma)
    return found


def without_edges(
    problem: Problem, point: Point, window: Window, sigmas: Sequence[Array], deviations: Array
) -> list[Array]:
    """Return standard errors that are infinite for rows on which side of an impact is not known.

    ``deviations`` are independent ones of one standard error, of the unknowns and of the starts of
    segments: columns.
    """
    times, errors = _impacts(problem, point, window, deviations)
    found = []
    for record, sigma in zip(problem.records, sigmas, strict=True):
        if jumps(record, problem) and len(times) and len(record) > 1:
            most = _MOST_ROWS * float(np.median(np.diff(record.times)))
            if len(times) > 1:
                most = min(most, _OF_INTERVAL * float(np.median(np.diff(times))))
            reach = np.minimum(_ERRORS * errors, most)
            first = np.searchsorted(record.times, times - reach, "left")
            last = np.searchsorted(record.times, times + reach, "right")
            sigma = sigma.copy()
            for begin, end in zip(first.tolist(), last.tolist(), strict=True):
                sigma[begin:end] = np.inf
        found.append(sigma)
    return found


def _impacts(
    problem: Problem, point: Point, window: Window, deviations: Array
) -> tuple[Array, Array]:
    """Return the times of all impacts of a motion, and their standard errors."""
    found = problem.evaluate(point, window)
    if found is None:
        return np.zeros(0), np.zeros(0)
    parts = [
        begin + np.asarray(run.impacts["time"])
        for run, begin in zip(found.runs, window.borders, strict=True)
    ]
    ends = (*window.borders[1:], window.end)
    kept = [part[part <= end] for part, end in zip(parts, ends, strict=True)]
    times = np.unique(np.concatenate([np.zeros(0), *kept]))
    if not len(times):
        return times, times
    heard = replace(problem, records=[Record("impact_times", times)])
    again = heard.evaluate(point, window)
    if again is None:
        return times, np.zeros(len(times))
    try:
        (moved,), _ = heard.derivatives(again, window)
    except SimulationError:
        return times, np.zeros(len(times))
    with np.errstate(over="ignore", invalid="ignore"):
        errors = np.sqrt(np.square(moved @ deviations).sum(axis=1))
    return times, np.nan_to_num(errors, nan=_MOST, posinf=_MOST)

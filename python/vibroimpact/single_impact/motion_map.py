"""Period n-1 motions without friction over a grid of parameters, each with its verdict.

The equations of all grid points are solved together; see `motions` for one system.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .._core import PARAMETERS
from ..arguments import axis, count, reject
from ..errors import Interrupted, ParameterError
from ..interruption import interruptible
from ..orbits.motion import PeriodicMotion
from ..system import System
from .algebraic import Parameters, conditions
from .motions import check_system, limits_of, motion_at, motions_in
from .results import SOLUTION_DTYPE, STATE, MotionMap
from .solutions import Solutions, lost, reach_of, solve_many

Array = NDArray[np.float64]

# Grid points whose equations are solved together.
BATCH = 4000
# Grid points at most.
_MAX_POINTS = 10_000_000


@interruptible
def motion_map(
    system: System,
    n: int = 1,
    *,
    within: tuple[float, float] | None = None,
    **parameters: ArrayLike,
) -> MotionMap:
    """Find all period n-1 solutions of a system over a grid of parameters.

    Parameters
    ----------
    system
        A system without friction.
    n
        Drive periods per orbit, >= 1.
    within
        Interval of x1 at the impact to search, in radians; default all that a bound allows.
    **parameters
        One or two numeric fields of System with arrays of their values; for a range use
        ``numpy.linspace``, e.g.
        ``drive_frequency=np.linspace(0.2, 3, 561)``.

    Returns
    -------
    MotionMap

    Raises
    ------
    ParameterError
        For bad input, as for ``periodic_motions``; nothing has run then.
    Interrupted
        After Ctrl-C; ``.result`` is the MotionMap, points not reached being ``pending``.
    """
    if not isinstance(system, System):
        reject("system", system, "a vibroimpact.System")
    n = count("n", n, least=1, most=100_000)
    limits = None if within is None else limits_of(within)
    grid = _grid(parameters)
    size = int(np.prod([len(values) for values in grid.values()]))
    undecided = np.zeros(size, dtype=np.int64)
    empty = np.zeros(size, dtype=np.bool_)
    pending = np.ones(size, dtype=np.bool_)
    parts: list[NDArray[np.void]] = []

    def result() -> MotionMap:
        solutions = np.concatenate([np.empty(0, dtype=SOLUTION_DTYPE), *parts])
        solutions = solutions[~pending[solutions["point"]]]
        solutions = solutions[np.lexsort((solutions["x1"], solutions["point"]))]
        for array in (solutions, undecided, empty, pending):
            array.flags.writeable = False
        return MotionMap(
            system=system,
            n=n,
            grid=grid,
            solutions=solutions,
            undecided=undecided,
            empty=empty,
            pending=pending,
        )

    try:
        points = [
            system.replace(**dict(zip(grid, values, strict=True)))
            for values in itertools.product(*(column.tolist() for column in grid.values()))
        ]
        for point in points:
            check_system(point)
        for start in range(0, size, BATCH):
            batch = slice(start, start + BATCH)
            rows, unsure, nothing = _solve(points[batch], n, limits)
            rows["point"] += start
            parts.append(rows)
            undecided[batch], empty[batch] = unsure, nothing
            pending[batch] = False  # set last: if Ctrl-C comes before, the batch stays pending
    except KeyboardInterrupt:
        undecided[pending], empty[pending] = 0, False
        done = size - np.count_nonzero(pending)
        raise Interrupted(
            f"interrupted after {done} of {size} points", result(), holds="them"
        ) from None
    return result()


def _grid(parameters: Mapping[str, Any]) -> dict[str, Array]:
    if not 1 <= len(parameters) <= 2 or not set(parameters) <= set(PARAMETERS):
        given = ", ".join(parameters) or "nothing"
        raise ParameterError(
            f"the varied parameters must be one or two of {', '.join(PARAMETERS)}; got {given}"
        )
    grid = {name: axis(name, values) for name, values in parameters.items()}
    size = int(np.prod([len(values) for values in grid.values()]))
    if size > _MAX_POINTS:
        raise ParameterError(f"a grid of {size} points is not allowed; allowed: 1 to {_MAX_POINTS}")
    return grid


def _solve(
    systems: list[System], n: int, within: tuple[float, float] | None
) -> tuple[NDArray[np.void], NDArray[np.int64], NDArray[np.bool_]]:
    """Return the rows of some systems, their undecided intervals, and which are empty."""
    reaches = reach_of(conditions(Parameters.of(systems, n)))
    empty = np.array([reach.empty for reach in reaches])
    undecided = np.zeros(len(systems), dtype=np.int64)
    kept = np.flatnonzero(~empty)
    if not len(kept):
        return np.empty(0, dtype=SOLUTION_DTYPE), undecided, empty
    equations = conditions(Parameters.of([systems[k] for k in kept], n))
    if within is None:
        hi = np.array([reaches[k].bound for k in kept])
        lo = -hi
    else:
        lo, hi = (np.full(len(kept), end) for end in within)
    found = solve_many(equations, lo, hi)
    gone = found.isolated & lost(
        equations.parameters.drive_frequency[found.which],
        found.approach_velocity,
        *(found.x1, found.v1, found.v2),
    )
    np.add.at(undecided, kept[found.which[gone]], 1)
    rows = [_rows(systems, found, found.isolated & ~gone, kept, n)]
    # A box without one simple root is examined on its own.
    for k in np.flatnonzero(~found.isolated):
        number = int(kept[found.which[k]])
        alone = conditions(Parameters.of([systems[number]], n))
        motions, reason = motions_in(systems[number], alone, found.box[k : k + 1], (math.nan,) * 4)
        undecided[number] += bool(reason)
        rows += [_row(number, motion) for motion in motions]
    return np.concatenate(rows), undecided, empty


def _rows(
    systems: list[System],
    found: Solutions,
    sure: NDArray[np.bool_],
    kept: NDArray[np.int64],
    n: int,
) -> NDArray[np.void]:
    """Judge solutions."""
    which = found.which[sure]
    columns = {name: getattr(found, name)[sure] for name in STATE}
    state = np.stack([columns[name] for name in STATE[:4]], axis=1)
    rows = np.empty(len(which), dtype=SOLUTION_DTYPE)
    rows["point"] = kept[which]
    for name, column in columns.items():
        rows[name] = column
    for row, values in zip(rows, state.tolist(), strict=True):
        motion = motion_at(systems[row["point"]], n, tuple(values))
        row["admissible"] = motion.admissible
        row["largest_multiplier"] = np.abs(motion.multipliers[0])
        row["stable"] = motion.stable
    return rows


def _row(point: int, motion: PeriodicMotion) -> NDArray[np.void]:
    row = np.zeros(1, dtype=SOLUTION_DTYPE)
    row[0] = (
        point,
        *motion.state,
        motion.approach_velocity,
        motion.admissible,
        abs(motion.multipliers[0]),
        motion.stable,
    )
    return row

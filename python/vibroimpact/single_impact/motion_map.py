"""Period n-1 motions without friction over a grid of parameters, each with its verdict.

The equations of all grid points are solved together; see `motions` for one system.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Unpack

import numpy as np
from numpy.typing import NDArray

from .. import _core, keyword_types
from ..arguments import axis, count
from ..errors import Interrupted, ParameterError
from ..interruption import interruptible
from ..machine_kinds import need_system
from ..orbits.motion import PeriodicMotion, all_inside, multipliers_of
from ..orbits.verdict import MAX_EVENTS
from ..system import System
from .algebraic import Parameters, conditions
from .curved import Curved
from .curved_search import search_curved
from .motions import CHECKED, check_columns, limits_of, motions_in, one_impact
from .results import SOLUTION_DTYPE, STATE, MotionMap
from .solutions import Solutions, lost, nodes_after, reach_of, solve_many
from .starts import starts_in

Array = NDArray[np.float64]

# Grid points whose equations are solved together.
BATCH = 4000
# Grid points at most.
_MAX_POINTS = 10_000_000


@interruptible
@keyword_types.completing(keyword_types.Parameters)
def motion_map(
    system: System,
    n: int = 1,
    *,
    within: tuple[float, float] | None = None,
    **parameters: Unpack[keyword_types.Parameters],
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
        ``drive_frequency=np.linspace(0.2, 3, 561)``. Also numbers of a restitution curve; with one
        every point is searched on its own, which takes some 100 times as long.

    Returns
    -------
    MotionMap

    Raises
    ------
    ParameterError
        For bad input, as for ``periodic_motions``; nothing has run then.
    Interrupted
        After Ctrl-C; ``.result`` is the MotionMap, points not reached being ``pending``.

    Examples
    --------
    >>> import vibroimpact as vi
    >>> system = vi.System(mass_ratio=0.6, frequency_ratio=2, restitution=0.8, gap=0.5,
    ...                    drive_frequency=1.8, moment_amplitude=1)
    >>> solutions = vi.motion_map(system, drive_frequency=[1.6, 1.8, 2.0])
    >>> solutions.shape
    (3,)
    """
    need_system(system)
    n = count("n", n, least=1, most=100_000)
    limits = None if within is None else limits_of(within)
    grid = _grid(system, dict(parameters))
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
        batches = list(_batches(system, n, grid))
        for batch in batches:
            check_columns(**{name: batch.systems.column(name) for name in CHECKED})
        for batch in batches:
            rows, unsure, nothing = _solve(batch, limits)
            place = slice(batch.start, batch.start + len(batch.values))
            rows["point"] += batch.start
            parts.append(rows)
            undecided[place], empty[place] = unsure, nothing
            pending[place] = False  # set last: if Ctrl-C comes before, the batch stays pending
    except KeyboardInterrupt:
        undecided[pending], empty[pending] = 0, False
        done = size - np.count_nonzero(pending)
        raise Interrupted(
            f"interrupted after {done} of {size} points", result(), holds="them"
        ) from None
    return result()


def _grid(system: System, parameters: Mapping[str, Any]) -> dict[str, Array]:
    known = system._numbers_by_name
    if not 1 <= len(parameters) <= 2 or not set(parameters) <= set(known):
        given = ", ".join(parameters) or "nothing"
        raise ParameterError(
            f"the varied parameters must be one or two of {', '.join(known)}; got {given}"
        )
    grid = {name: axis(name, values) for name, values in parameters.items()}
    size = int(np.prod([len(values) for values in grid.values()]))
    if size > _MAX_POINTS:
        raise ParameterError(f"a grid of {size} points is not allowed; allowed: 1 to {_MAX_POINTS}")
    return grid


@dataclass(frozen=True)
class _Batch:
    """Systems of grid points in a row, the first of which has the number ``start``.

    ``values`` has a row for each point and a column for each of the varied parameters ``names``.
    """

    system: System
    n: int
    names: list[str]
    start: int
    values: Array

    @cached_property
    def systems(self) -> _core.Systems:
        return _core.Systems(self.system._compiled, self.names, self.values)

    def at(self, number: int) -> System:
        changes = zip(self.names, self.values[number].tolist(), strict=True)
        return self.system.replace(**dict(changes))


def _batches(system: System, n: int, grid: Mapping[str, Array]) -> Iterator[_Batch]:
    columns = np.meshgrid(*grid.values(), indexing="ij")
    values = np.stack([column.ravel() for column in columns], axis=1)
    size = BATCH if isinstance(system.restitution, float) else 1
    for start in range(0, len(values), size):
        yield _Batch(system, n, list(grid), start, values[start : start + size])


def _solve(
    batch: _Batch, within: tuple[float, float] | None
) -> tuple[NDArray[np.void], NDArray[np.int64], NDArray[np.bool_]]:
    """Return the rows of some systems, their undecided intervals, and which are empty."""
    if not isinstance(batch.system.restitution, float):
        return _solve_curved(batch, within)
    parameters = Parameters.of(batch.system, batch.n, batch.systems)
    equations = conditions(parameters)
    reaches = reach_of(equations)
    empty = np.array([reach.empty for reach in reaches])
    undecided = np.zeros(len(reaches), dtype=np.int64)
    kept = np.flatnonzero(~empty)
    if within is None:
        hi = np.array([reaches[k].bound for k in kept])
        lo = -hi
    else:
        lo, hi = (np.full(len(kept), end) for end in within)
    found = solve_many(equations, kept, lo, hi)
    gone = found.isolated & lost(
        parameters.drive_frequency[found.which],
        found.approach_velocity,
        *(found.x1, found.v1, found.v2),
    )
    np.add.at(undecided, found.which[gone], 1)
    rows = [_rows(batch, parameters, found, found.isolated & ~gone)]
    # A box without one simple root is examined on its own.
    for k in np.flatnonzero(~found.isolated):
        number = int(found.which[k])
        starts = starts_in(equations.only(number), found.box[k : k + 1], (math.nan,) * 4)
        motions, reason = motions_in(batch.at(number), batch.n, starts)
        undecided[number] += bool(reason)
        rows += [_row(number, motion) for motion in motions]
    return np.concatenate(rows), undecided, empty


def _solve_curved(
    batch: _Batch, within: tuple[float, float] | None
) -> tuple[NDArray[np.void], NDArray[np.int64], NDArray[np.bool_]]:
    """As `_solve`, of one system whose restitution depends on the approach velocity."""
    system = batch.at(0)
    curved = Curved(system, batch.n)
    (reach,) = reach_of(curved.all())
    rows, undecided = [np.empty(0, dtype=SOLUTION_DTYPE)], 0
    if not reach.empty:
        for starts in search_curved(curved, *(within or (-reach.bound, reach.bound))):
            motions, reason = motions_in(system, batch.n, starts)
            undecided += bool(reason)
            rows += [_row(0, motion) for motion in motions]
    return np.concatenate(rows), np.array([undecided]), np.array([reach.empty])


def _rows(
    batch: _Batch, parameters: Parameters, found: Solutions, sure: NDArray[np.bool_]
) -> NDArray[np.void]:
    """Judge solutions."""
    which = found.which[sure]
    columns = {name: getattr(found, name)[sure] for name in STATE}
    rows = np.empty(len(which), dtype=SOLUTION_DTYPE)
    rows["point"] = which
    for name, column in columns.items():
        rows[name] = column
    nodes = nodes_after(parameters, which, *(columns[name] for name in STATE[:4]))
    at_rest = parameters.at_rest[which]
    for wall_at_rest in (False, True):
        alike = np.flatnonzero(at_rest == wall_at_rest)
        itinerary = one_impact(batch.n, wall_at_rest=wall_at_rest)
        return_maps, admissible = itinerary.judge_all(
            batch.systems, which[alike], nodes[alike], MAX_EVENTS
        )
        multipliers = multipliers_of(return_maps, itinerary)
        rows["admissible"][alike] = admissible
        rows["largest_multiplier"][alike] = np.abs(multipliers[:, 0])
        rows["stable"][alike] = admissible & all_inside(multipliers)
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

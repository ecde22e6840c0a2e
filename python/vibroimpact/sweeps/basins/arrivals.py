"""Basins of attraction over a plane of initial states.

First some of the cells, evenly spread, are searched for attractors (`search`). Then every
cell is followed until it has arrived at one of them. Cells that arrive nowhere are followed again
in *rounds*, each for twice the time, after some of them have been searched for attractors not yet
known. Attractors change between passes over the cells only, never within one, so that the result
has the same bits however the cells are divided among chunks, threads and machines.
"""

from __future__ import annotations

import dataclasses
import hashlib
import json
import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self, Unpack, overload

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..._core import CHATTER_TOLERANCE
from ...arguments import axis, count, optional_count, positive, reject, state, swept, threads
from ...errors import Interrupted
from ...horizons import kept_periods
from ...interruption import interruptible
from ...keyword_types import Coordinates, completing
from ...machine import Machine, first_of_each
from ...scales import Scales, Units
from ...system import System
from ..cluster import check_client
from ..columns import COORDINATES, Columns
from ..engine import compute
from ..fields import STATUS, STATUS_NAMES, ChunkResult
from ..grid import Grid
from ..grid_machine import GridMachine, with_coordinates
from ..machines import machine_of
from ..store import folder_of_stores, store_in
from .attractors import Attractor
from .region import Follow
from .results import ATTRACTOR, SETTLING, Basins, BasinSettings
from .search import find_attractors, follow_all

if TYPE_CHECKING:
    from ...structure import Structure


class BasinsCall(Coordinates, total=False):
    """Keywords of ``basins``."""

    periods: int
    keep: int | None
    units: Units | None
    scouts: int
    rounds: int
    max_events: int | None
    chatter_tolerance: float
    progress: bool
    workers: int | None
    chunk: int | None
    client: Any
    store: str | os.PathLike[str] | None


PENDING, COMPLETED, UNRESOLVED = (
    STATUS_NAMES.index(name) for name in ("pending", "completed", "unresolved")
)
# Drive periods that a cell usually takes, where it can arrive.
_USUAL = 200
# Number of sections by which a cell that has not arrived is judged, unless given.
USUAL_KEEP = 200
# Cells that are followed at a time; this limits the memory for those that do not arrive.
_BLOCK = 8192
# How many of the remaining cells are searched for attractors in every round.
_SEARCHED = 32
# Names of the stores of the passes.
_PASSES = r"cells|round_\d+"


@dataclass(frozen=True, eq=False)
class ArrivalTask:
    """Follow cells of a plane to the attractors known: all of them, or those ``left`` over.

    Attributes
    ----------
    machine, initial, follow, attractors
        The machine, its fixed coordinates, how cells are followed, and the attractors known.
    plane
        The two coordinates that vary.
    left
        Numbers of the cells of the plane, shape (k,), or None for all.
    """

    machine: GridMachine
    initial: Any
    follow: Follow
    attractors: tuple[Attractor, ...]
    plane: Grid
    left: NDArray[np.int64] | None = None

    kind = "basins"
    fields = (STATUS, ATTRACTOR, SETTLING)
    rows = ()
    divisible = True

    @property
    def grid(self) -> Grid:
        """The plane, or a list of its cells."""
        return self.plane if self.left is None else Grid({"cell": self.left})

    @property
    def cost(self) -> float:
        """Drive periods per cell."""
        arrives = any(attractor.region is not None for attractor in self.attractors)
        return min(self.follow.periods, _USUAL) if arrives else self.follow.periods

    def settings(self) -> dict[str, Any]:
        """Return all settings, apart from the grid, on which the numbers depend."""
        plane = {name: values.tolist() for name, values in self.plane.axes.items()}
        return {
            "system": self.machine.to_dict(),
            "initial": self.initial,
            "follow": dataclasses.asdict(self.follow),
            "attractors": [attractor.to_dict() for attractor in self.attractors],
            "plane": None if self.left is None else _digest(json.dumps(plane)),
        }

    def starts(self, numbers: NDArray[np.int64]) -> NDArray[np.float64]:
        """Return the initial states of cells of the plane, shape (len(numbers), d)."""
        result = np.empty((len(numbers), *self.machine.final_state.shape))
        result[:] = self.initial
        places = np.unravel_index(numbers, self.plane.shape)
        axes = zip(self.plane.axes.items(), places, strict=True)
        with_coordinates(
            self.machine, result, {name: values[place] for (name, values), place in axes}
        )
        return result.reshape(len(numbers), -1)

    def within(self, _first: int, _last: int) -> Self:
        """Return this task: functions of the user make nothing for it."""
        return self

    def compute(
        self,
        first: int,
        last: int,
        *,
        workers: int | None,
        progress: Callable[[int], object] | None,
    ) -> ChunkResult:
        """Follow the cells first ... last - 1."""
        columns = {
            field.name: np.full(last - first, field.fill, field.dtype) for field in self.fields
        }
        for start in range(first, last, _BLOCK):
            numbers = np.arange(start, min(start + _BLOCK, last))
            ends = follow_all(
                self.machine.system,
                self.starts(numbers if self.left is None else self.left[numbers]),
                self.attractors,
                self.follow,
                workers=workers,
                progress=None if progress is None else _shifted(progress, start - first),
            )
            block = slice(start - first, start - first + len(numbers))
            columns["status"][block] = np.where(ends.attractor >= 0, COMPLETED, ends.status)
            columns["attractor"][block] = ends.attractor
            columns["settling"][block] = ends.periods
            if ends.interrupted:
                return ChunkResult(columns, interrupted=True)
        return ChunkResult(columns)


def _shifted(progress: Callable[[int], object], before: int) -> Callable[[int], object]:
    return lambda done: progress(before + done)


def _digest(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()


@overload
def basins(
    system: System, *, initial: ArrayLike | None = None, **keywords: Unpack[BasinsCall]
) -> Basins: ...


@overload
def basins(system: Structure, *, initial: ArrayLike | None = None, **keywords: Any) -> Basins: ...


@interruptible
@completing(Coordinates)
def basins(
    system: System | Structure,
    *,
    initial: ArrayLike | None = None,
    periods: int = 2000,
    keep: int | None = None,
    units: Units | None = None,
    scouts: int = 1000,
    rounds: int = 2,
    max_events: int | None = None,
    chatter_tolerance: float = CHATTER_TOLERANCE,
    progress: bool = False,
    workers: int | None = None,
    chunk: int | None = None,
    client: Any = None,
    store: str | os.PathLike[str] | None = None,
    **axes: ArrayLike,
) -> Basins:
    """Find the attractors that a plane of initial states leads to, and the basin of each.

    The number of attractors need not be known. A stable periodic motion is refined by Newton's
    method, as by ``run.refine``, and gets a trapping region, confirmed by simulations; a cell is
    followed until it has stayed in one of them for a whole cycle with the motion's impacts. Cells
    that arrive nowhere are judged by their sections at the end (basins page).

    Parameters
    ----------
    system
        The System or Structure; drive_frequency > 0. Of a structure `from_modes` all starts of the
        plane must lie in the span of its modes, as they do where it has as many coordinates.
    initial
        (x1, v1, x2, v2) at t = 0, of a structure the rows q and v, (2, N); zeros by default. Its
        values of the two that vary have no influence.
    periods
        Drive periods for which a cell is followed at most, at first.
    keep
        Number of sections at the end by which a cell is judged if it has arrived nowhere: 200 by
        default, or all of fewer.
    units
        ``"SI"``: ``initial`` and the starts that vary are in rad, rad/s, m, m/s, and so are the
        ``axes`` of the result; for a system of ``System.from_physical``.
    scouts
        About so many cells, evenly spread, are searched for attractors beforehand.
    rounds
        How often the remaining cells are followed again, each time for twice as long.
    max_events
        Cap on the number of events of each run, as in ``simulate``.
    chatter_tolerance
        Absolute, on time and state where chatter is completed, as in ``simulate``.
    progress
        Show progress bars.
    workers
        Threads; default all cores. The result does not depend on it.
    chunk
        Cells that are computed at a time; the result does not depend on it.
    client
        A ``distributed.Client`` whose workers compute the cells, with the same result.
    store
        Directory for Zarr stores, one for each pass over cells. A call with the same arguments
        goes on where an interrupted or killed one ended.
    **axes
        Two of x1, v1, x2, v2, of a structure two of ``q_0``, ``q_1``, ... ``v_0``, ``v_1``, ...,
        with arrays of their values; for a range use ``numpy.linspace``, e.g.
        ``x1=np.linspace(-0.3, 0.3, 1000), v1=np.linspace(-1, 1, 1000)``.

    Returns
    -------
    Basins

    Raises
    ------
    ParameterError, StateError
        For bad input; nothing has run then.
    Interrupted
        After Ctrl-C; ``.result`` holds the Basins with what is done.

    Examples
    --------
    >>> import vibroimpact as vi
    >>> system = vi.System(mass_ratio=0.6, frequency_ratio=2, restitution=0.8, gap=0.5,
    ...                    drive_frequency=1.8, moment_amplitude=1)
    >>> import numpy as np
    >>> grid = np.linspace(-1, 1, 8)
    >>> basins = vi.basins(system, x1=[0.0, 0.1, 0.2], v1=grid, scouts=20, periods=300)
    >>> basins.attractor.shape
    (3, 8)
    """
    if not isinstance(system, Machine):
        reject("system", system, "a vibroimpact.System or a vibroimpact.Structure")
    if system.drive_frequency == 0.0:
        reject("drive_frequency", 0.0, "a number > 0: basins are told on the stroboscopic section")
    machine = machine_of(system)
    scales = system._chosen(units)
    plane = _plane(machine, dict(axes))
    start = machine.start(np.zeros(machine.final_state.shape) if initial is None else initial)
    machine.check_starts(plane.axes, start)
    periods = count("periods", periods, least=8)
    settings = BasinSettings(
        initial=start,
        periods=periods,
        keep=kept_periods(keep, periods, usual=USUAL_KEEP, least=8),
        scouts=count("scouts", scouts, least=1, most=1_000_000),
        rounds=count("rounds", rounds, least=0, most=20),
        max_events=optional_count("max_events", max_events, least=1),
        chatter_tolerance=positive("chatter_tolerance", chatter_tolerance),
        units=units,
    )
    workers = threads(workers)
    chunk = optional_count("chunk", chunk, least=1)
    if not isinstance(progress, bool):
        reject("progress", progress, "True or False")
    if client is not None:
        check_client(client)
    options = {"progress": progress, "workers": workers, "chunk": chunk, "client": client}
    folder = folder_of_stores(store, _PASSES, "basins")
    return _Computation(machine, plane, settings, options, folder, scales).run()


def _plane(machine: GridMachine, axes: dict[str, Any]) -> Grid:
    shown = ", ".join(first_of_each(machine.coordinates))
    swept(basins, axes, machine.coordinates, exactly=2, shown=shown)
    return Grid({name: axis(name, given) for name, given in axes.items()})


def _dimensionless(initial: Any, plane: Grid, scales: Scales | None) -> tuple[Any, Grid]:
    """Return a start and a plane of starts without their units, which they may have."""
    if scales is None:
        return initial, plane
    axes = {}
    for name, values in plane.axes.items():
        starts = np.zeros((len(values), 4))
        starts[:, COORDINATES.index(name)] = values
        axes[name] = scales.from_si(starts)[:, COORDINATES.index(name)]
    return state(scales.from_si(initial)), Grid(axes)


class _Computation:
    """The passes over the cells, and what they have found so far."""

    def __init__(
        self,
        machine: GridMachine,
        plane: Grid,
        settings: BasinSettings,
        options: dict[str, Any],
        store: Path | None,
        scales: Scales | None,
    ) -> None:
        initial, own = _dimensionless(settings.initial, plane, scales)
        self.task = ArrivalTask(machine, initial, settings.follow, (), own)
        self.settings = settings
        self.axes = dict(plane.axes)
        self.options = options
        self.store = store
        self.columns = {
            field.name: np.full(plane.size, field.fill, field.dtype) for field in ArrivalTask.fields
        }

    def run(self) -> Basins:
        plane, follow = self.task.plane, self.settings.follow
        self._search(_spread(plane, self.settings.scouts), follow)
        self._pass("cells")
        for number in range(1, self.settings.rounds + 1):
            left = np.flatnonzero(self.columns["status"] == UNRESOLVED)
            if not len(left):
                break
            follow = dataclasses.replace(follow, periods=2 * follow.periods)
            some = np.unique(np.linspace(0, len(left) - 1, _SEARCHED).round().astype(np.int64))
            self._search(left[some], follow)
            self.task = dataclasses.replace(self.task, follow=follow, left=left)
            self._pass(f"round_{number}")
        return self.result()

    def _search(self, cells: NDArray[np.int64], follow: Follow) -> None:
        """Look for attractors from some cells."""
        task = self.task
        try:
            attractors = find_attractors(
                task.machine.system,
                task.starts(cells),
                follow,
                known=task.attractors,
                workers=self.options["workers"],
            )
        except KeyboardInterrupt:
            done = np.count_nonzero(self.columns["status"] != PENDING)
            raise Interrupted(
                f"interrupted while attractors were searched, after {done} of "
                f"{task.plane.size} cells",
                self.result(),
                holds="them",
            ) from None
        self.task = dataclasses.replace(task, attractors=attractors)

    def _pass(self, name: str) -> None:
        """Follow cells to the attractors known."""
        light = dataclasses.replace(
            self.task, attractors=tuple(found.light() for found in self.task.attractors)
        )
        compute(light, self._take, store=store_in(self.store, name), **self.options)

    def _take(self, columns: Columns) -> Basins:
        """Copy the columns of a pass to the cells of the plane."""
        left = self.task.left
        for name, values in self.columns.items():
            found = columns[name].ravel()
            if left is None:
                values[:] = found
            else:
                # A cell that this pass has not reached keeps what it had.
                done = columns["status"] != PENDING
                values[left[done]] = found[done]
        return self.result()

    def result(self) -> Basins:
        task = self.task
        shaped = {
            name: values.reshape(task.plane.shape).copy() for name, values in self.columns.items()
        }
        return Basins(
            system=task.machine.system,
            axes=self.axes,
            attractors=task.attractors,
            settings=self.settings,
            attractor=shaped["attractor"],
            status_code=shaped["status"],
            settling=shaped["settling"],
        )


def _spread(plane: Grid, number: int) -> NDArray[np.int64]:
    """Return about so many cells, evenly spread, as many along each axis."""
    side = int(np.ceil(np.sqrt(number)))
    places: Sequence[NDArray[np.int64]] = [
        np.unique(np.linspace(0, length - 1, min(length, side)).round().astype(np.int64))
        for length in plane.shape
    ]
    return (places[0][:, None] * plane.shape[1] + places[1]).ravel()

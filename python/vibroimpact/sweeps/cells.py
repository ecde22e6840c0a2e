"""Cells on the compiled kernel: one run for each combination of parameters and initial states."""

import dataclasses
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar, Literal, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .. import _core
from .._core import CHATTER_TOLERANCE, PARAMETERS
from ..arguments import (
    axis,
    count,
    flag,
    kept_periods,
    number,
    optional_count,
    positive,
    reject,
    state,
    swept,
)
from ..made import is_maker, need_system
from ..system import System
from .columns import COORDINATES
from .fields import STATUS, ChunkResult, Field, RowGroup
from .grid import Grid
from .made_cells import CellsToMake, Made

# Periods that are kept of each run unless given, or all if there are fewer.
USUAL_KEEP = 100
Measure = Literal["returns", "label", "largest_exponent", "spectrum"]


def measure_of(labels: Any, exponents: Any) -> Measure:
    """Return what is found out about each cell; an exponent comes with a label always."""
    measure: Measure = "label" if flag("labels", labels) else "returns"
    return "largest_exponent" if flag("exponents", exponents) else measure


MOTION = Field("motion", "int8", "kind of motion", flags=_core.MOTION_NAMES)
_LABEL = (
    MOTION,
    Field("m", "int64", "drive periods per orbit; 0 where no period was found"),
    Field("n", "int64", "impacts per orbit; -1 for complete chatter"),
    Field("residual", "float64", "largest difference of sections m periods apart"),
    Field("contact_fraction", "float64", "part of the kept time in sustained contact"),
    Field("final_state", "float64", "x1, v1, x2, v2 at the end", (4,), ("coordinate",)),
)
_LARGEST = (
    Field("largest_exponent", "float64", "largest Lyapunov exponent per unit time"),
    Field("exponent_error", "float64", "its standard error"),
)
_SPECTRUM = (
    Field("exponents", "float64", "Lyapunov exponents per unit time", (4,), ("exponent",)),
    Field("exponent_errors", "float64", "their standard errors", (4,), ("exponent",)),
)
IMPACT_ROWS = RowGroup(
    "impact",
    (
        Field("x1", "float64", "x1 at each kept impact"),
        Field("v1", "float64", "x1' just before it"),
        Field("v2", "float64", "x2' just before it"),
        # "phase" is the name of a parameter, which may be an axis.
        Field("impact_phase", "float64", "phase of the drive in [0, 2 pi)"),
        Field("approach_velocity", "float64", "u just before it"),
        Field("energy_loss", "float64", "energy it takes"),
        Field("regime", "int8", "its regime"),
    ),
)
STROBOSCOPIC_ROWS = RowGroup(
    "stroboscopic",
    (
        Field(
            "stroboscopic", "float64", "x1, v1, x2, v2 at each kept section", (4,), ("coordinate",)
        ),
    ),
)


@dataclass(frozen=True, kw_only=True)
class RunSettings:
    """Settings of each run of a grid; meanings as in ``simulate``."""

    initial: tuple[float, float, float, float]
    periods: int
    keep: int
    max_events: int | None = None
    chatter_tolerance: float = CHATTER_TOLERANCE
    section_phase: float = 0.0

    @classmethod
    def checked(
        cls,
        *,
        initial: ArrayLike,
        periods: Any,
        keep: Any,
        max_events: Any,
        chatter_tolerance: Any,
        section_phase: Any,
    ) -> "RunSettings":
        """Return the settings of valid arguments; ParameterError or StateError for others."""
        periods = count("periods", periods, least=1)
        return cls(
            initial=state(initial),
            periods=periods,
            keep=kept_periods(keep, periods, usual=USUAL_KEEP),
            max_events=optional_count("max_events", max_events, least=1),
            chatter_tolerance=positive("chatter_tolerance", chatter_tolerance),
            section_phase=number("section_phase", section_phase),
        )

    def kernel_options(self) -> dict[str, Any]:
        """Return the options of the kernel; a cap of None stands for the core's own default."""
        options = {k: v for k, v in dataclasses.asdict(self).items() if v is not None}
        del options["initial"]
        return options


def checked_axes(
    function: Callable[..., Any],
    system: Any,
    axes: Mapping[str, ArrayLike],
    *,
    allowed: Sequence[str] = (*PARAMETERS, *COORDINATES),
    exactly: int | None = None,
) -> dict[str, NDArray[np.float64]]:
    """Return the axes of a function's grid: fields of System, coordinates of the initial state.

    Where a function makes the system they are its arguments in place of fields of System.

    Raises
    ------
    ParameterError
        If a name is not ``allowed``, there are not ``exactly`` so many, an axis is empty, or a
        value is out of range.
    """
    need_system(system, maker=True)
    if is_maker(system):
        names = [name for name in axes if name not in allowed or name not in COORDINATES]
        swept(function, axes, [*names, *allowed], exactly=exactly)
        return {name: axis(name, values) for name, values in axes.items()}
    swept(function, axes, allowed, exactly=exactly)
    checked = {}
    for name, values in axes.items():
        checked[name] = axis(name, values)
        if name in PARAMETERS:
            for value in (checked[name].min(), checked[name].max()):
                system.replace(**{name: float(value)})
    frequencies = checked.get("drive_frequency", np.array([system.drive_frequency]))
    if (frequencies == 0.0).any():
        reject("drive_frequency", 0.0, "a number > 0: runs are counted in drive periods")
    return checked


@dataclass(frozen=True, kw_only=True, eq=False)
class CellTask:
    """One run for each cell of a grid over parameters and coordinates of the initial state."""

    kind: str
    system: System
    grid: Grid
    run: RunSettings
    measure: Measure
    # Drive periods over which a spectrum is measured.
    measured: int = 0
    # Systems and starts that functions made for the cells.
    made: Made | None = None

    divisible = True
    rows: ClassVar[tuple[RowGroup, ...]] = ()

    @property
    def fields(self) -> tuple[Field, ...]:
        """The columns."""
        more = {"largest_exponent": _LARGEST, "spectrum": _SPECTRUM}.get(self.measure, ())
        return (STATUS, *_LABEL, *more, *(() if self.made is None else self.made.fields))

    @property
    def cost(self) -> float:
        """Drive periods per cell; the label of a motion without a period takes thousands more."""
        more = {"label": 2000, "largest_exponent": 2000, "spectrum": 2 * self.measured}
        return self.run.periods + more.get(self.measure, 0)

    def settings(self) -> dict[str, Any]:
        """Return all that the numbers depend on but the grid."""
        measured = {"measured": self.measured} if self.measure == "spectrum" else {}
        return {
            "system": self.system.to_dict(),
            **dataclasses.asdict(self.run),
            "measure": self.measure,
            **measured,
        }

    def compute(
        self,
        first: int,
        last: int,
        *,
        workers: int | None,
        progress: Callable[[int], object] | None,
    ) -> ChunkResult:
        """Run the cells first ... last - 1."""
        values = self.cell_values(first, last)
        sweep = run_cells(
            self.system,
            values,
            self.run,
            cells=last - first,
            measure=self.measure,
            measured=self.measured,
            workers=workers,
            progress=progress,
        )
        columns = label_columns(sweep, self.measure) | self.known(first, last)
        return ChunkResult(columns, interrupted=sweep.interrupted)

    def within(self, first: int, last: int) -> Self:
        """Return the task for these cells, with what functions make for them."""
        if not isinstance(self.made, CellsToMake):
            return self
        return dataclasses.replace(self, made=self.made.within(self.grid, first, last))

    def cell_values(self, first: int, last: int) -> dict[str, NDArray[np.float64]]:
        """Return what is set in the cells first ... last - 1: parameters and coordinates."""
        if self.made is None:
            return self.grid.values(first, last)
        return self.made.values(self.grid, first, last)

    def known(self, first: int, last: int) -> dict[str, NDArray[np.float64]]:
        """Return the columns that functions made, before anything is computed."""
        return {} if self.made is None else self.made.columns(self.grid, first, last)


def run_cells(
    system: System,
    values: Mapping[str, NDArray[np.float64]],
    run: RunSettings,
    *,
    cells: int,
    measure: Measure,
    measured: int = 0,
    start: str = "fresh",
    rows: bool = False,
    workers: int | None,
    progress: Callable[[int], object] | None,
) -> _core.Sweep:
    """Run cells with these values of parameters and of coordinates of the initial state."""
    initials = np.tile(np.array(run.initial), (cells, 1))
    names = [name for name in values if name not in COORDINATES]
    for place, name in enumerate(COORDINATES):
        if name in values:
            initials[:, place] = values[name]
    parameters = np.empty((cells, len(names)))
    for place, name in enumerate(names):
        parameters[:, place] = values[name]

    return _core.sweep(
        system._compiled,
        names,
        parameters,
        initials,
        start=start,
        measure=measure,
        measured=measured,
        rows=rows,
        workers=workers,
        progress=progress,
        **run.kernel_options(),
    )


def label_columns(sweep: _core.Sweep, measure: Measure) -> dict[str, NDArray[Any]]:
    """Return the columns of the cells, without those of the sections."""
    columns: dict[str, NDArray[Any]] = {
        "status": sweep.status,
        "motion": sweep.motion,
        "m": sweep.m,
        "n": sweep.n,
        "residual": sweep.residual,
        "contact_fraction": sweep.contact_fraction,
        "final_state": sweep.final_states,
    }
    if measure == "largest_exponent":
        columns["largest_exponent"] = sweep.exponents[:, 0].copy()
        columns["exponent_error"] = sweep.exponent_errors[:, 0].copy()
    if measure == "spectrum":
        columns |= {"exponents": sweep.exponents, "exponent_errors": sweep.exponent_errors}
    return columns

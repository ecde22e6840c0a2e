"""Cells on the compiled kernel: one run for each combination of parameters and initial states."""

import dataclasses
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, ClassVar, Literal, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .. import _core
from .._core import CHATTER_TOLERANCE
from ..arguments import axis, count, flag, number, optional_count, positive, reject, swept
from ..horizons import kept_periods
from ..machine import first_of_each
from ..machine_kinds import is_maker
from ..made import names_of
from .fields import STATUS, ChunkResult, Field, RowGroup
from .grid import Grid
from .grid_machine import START, GridMachine, Rows, with_coordinates
from .machines import machine_of, need_machine
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
)
_LARGEST = (
    Field("largest_exponent", "float64", "largest Lyapunov exponent per unit time"),
    Field("exponent_error", "float64", "its standard error"),
)


def _spectrum(count: int) -> tuple[Field, ...]:
    shape, dims = (count,), ("exponent",)
    return (
        Field("exponents", "float64", "Lyapunov exponents per unit time", shape, dims),
        Field("exponent_errors", "float64", "their standard errors", shape, dims),
    )


@dataclass(frozen=True, kw_only=True)
class RunSettings:
    """Settings of each run of a grid; meanings as in ``simulate``."""

    # As nested tuples.
    initial: Any
    periods: int
    keep: int
    max_events: int | None = None
    chatter_tolerance: float = CHATTER_TOLERANCE
    section_phase: float = 0.0

    @classmethod
    def checked(
        cls,
        machine: GridMachine,
        *,
        initial: Any,
        periods: Any,
        keep: Any,
        max_events: Any,
        chatter_tolerance: Any,
        section_phase: Any,
    ) -> "RunSettings":
        """Return the settings of valid arguments; ParameterError or StateError for others."""
        periods = count("periods", periods, least=1)
        return cls(
            initial=machine.start(initial),
            periods=periods,
            keep=kept_periods(keep, periods, usual=USUAL_KEEP),
            max_events=optional_count("max_events", max_events, least=1),
            chatter_tolerance=positive("chatter_tolerance", chatter_tolerance),
            section_phase=number("section_phase", section_phase),
        )

    def kernel_options(self) -> dict[str, Any]:
        """Return the options of the kernel; a cap of None stands for the core's own default."""
        options = {k: v for k, v in vars(self).items() if v is not None}
        del options["initial"]
        return options


def checked_axes(
    function: Callable[..., Any],
    system: Any,
    axes: Mapping[str, ArrayLike],
    *,
    starts: bool = True,
    exactly: int | None = None,
) -> dict[str, NDArray[np.float64]]:
    """Return the axes of a function's grid: numbers of a machine, coordinates of the start.

    Where a function makes the machine they are its arguments in place of the machine's numbers.

    Parameters
    ----------
    function
        The sweep, for messages.
    system, axes
        As the sweep gets them.
    starts
        Whether coordinates of the start are varied.
    exactly
        So many axes are wanted; None for any number.

    Raises
    ------
    ParameterError
        If a name is not allowed, there are not ``exactly`` so many, an axis is empty, or a value is
        out of range.
    """
    need_machine(system)
    if is_maker(system):
        # `made_cells` refuses what it does not take; numbers of a start it knows, too.
        shown = ", ".join(names_of(system)) or "the arguments of the function that makes the system"
        swept(function, axes, [*axes], exactly=exactly, shown=shown)
        return {name: axis(name, values) for name, values in axes.items()}
    machine = machine_of(system)
    more = machine.coordinates if starts else ()
    also = f"or an argument of a function that makes the {system._WHAT}{system._made_as}"
    shown = ", ".join((machine.system._numbers_in_words, *first_of_each(more), also))
    swept(function, axes, [*machine.numbers, *more], exactly=exactly, shown=shown)
    checked = {}
    for name, values in axes.items():
        checked[name] = axis(name, values)
        if name in machine.numbers:
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
    machine: GridMachine
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
        more = {"largest_exponent": _LARGEST, "spectrum": _spectrum(self.machine.exponents)}
        made = () if self.made is None else self.made.fields
        found = more.get(self.measure, ())
        return (STATUS, *_LABEL, self.machine.final_state, *found, *made)

    @property
    def cost(self) -> float:
        """Drive periods per cell; the label of a motion without a period takes thousands more."""
        more = {"label": 2000, "largest_exponent": 2000, "spectrum": 2 * self.measured}
        return self.run.periods + more.get(self.measure, 0)

    def settings(self) -> dict[str, Any]:
        """Return all that the numbers depend on but the grid."""
        measured = {"measured": self.measured} if self.measure == "spectrum" else {}
        return {
            "system": self.machine.to_dict(),
            **vars(self.run),
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
        columns, _, interrupted = self.run_cells(
            self.run.initial, first, last, workers=workers, progress=progress
        )
        return ChunkResult(columns, interrupted=interrupted)

    def within(self, first: int, last: int) -> Self:
        """Return the task for these cells, with what functions make for them."""
        if not isinstance(self.made, CellsToMake):
            return self
        return dataclasses.replace(self, made=self.made.within(self.grid, first, last))

    def known(self, first: int, last: int) -> dict[str, NDArray[np.float64]]:
        """Return the columns that functions made, before anything is computed."""
        return {} if self.made is None else self.made.columns(self.grid, first, last)

    def run_cells(
        self, initial: Any, first: int, last: int, **options: Any
    ) -> tuple[dict[str, NDArray[Any]], Rows, bool]:
        """Run the cells first ... last - 1 from a start, if no function makes the starts.

        Returns the columns of the cells, the rows if ``options`` has them, and whether Ctrl-C came.
        """
        made = self.known(first, last)
        values = self.grid.values(first, last)
        if made.keys() - {START}:
            assert self.made is not None
            values = {name: values[name] for name in values if name not in self.made.axes}
        starts = made.get(START)
        if starts is None:
            starts = np.empty((last - first, *self.machine.final_state.shape))
            starts[:] = initial
            with_coordinates(self.machine, starts, values)
        options |= self.run.kernel_options()
        kernel, final_states, rows = self.machine.run(
            values,
            made,
            np.ascontiguousarray(starts),
            **{"measure": self.measure, "measured": self.measured, "rows": False} | options,
        )
        columns: dict[str, NDArray[Any]] = {
            "status": kernel.status,
            "motion": kernel.motion,
            "m": kernel.m,
            "n": kernel.n,
            "residual": kernel.residual,
            "contact_fraction": kernel.contact_fraction,
            "final_state": final_states,
        }
        if self.measure == "largest_exponent":
            columns["largest_exponent"] = _of_motions(kernel.exponents, 1)[:, 0].copy()
            columns["exponent_error"] = _of_motions(kernel.exponent_errors, 1)[:, 0].copy()
        if self.measure == "spectrum":
            count = self.machine.exponents
            columns["exponents"] = _of_motions(kernel.exponents, count)
            columns["exponent_errors"] = _of_motions(kernel.exponent_errors, count)
        return columns | made, rows, kernel.interrupted


def _of_motions(exponents: NDArray[np.float64], count: int) -> NDArray[np.float64]:
    """Return exponents in so many columns at least: where no motion has come to its end, none."""
    missing = count - exponents.shape[1]
    return (
        np.pad(exponents, ((0, 0), (0, missing)), constant_values=np.nan)
        if missing > 0
        else exponents
    )

"""What a machine gives to a computation over a grid; here the machine of System.

A grid varies numbers of a machine and numbers of its start, both by name. Everything else that
depends on the machine is here and in `structure_machine`: the shape of a state, the columns that
keep a machine that a function made, the rows of a diagram, and the compiled kernel.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from .. import _core
from .._core import PARAMETERS
from ..arguments import reject, state, states
from ..errors import ParameterError
from ..made import Maker, called, in_words, is_maker, is_structure
from ..scales import Scales
from ..system import System
from .columns import COORDINATES
from .fields import Field, RowGroup

Array = NDArray[np.float64]
# Numbers of a machine, or coordinates of a start, by name: one for each cell, shape (cells,).
Values = Mapping[str, Array]
# Names of the columns of what functions made for each cell.
START = "initial_state"
FINAL = Field(
    "final_state", "float64", "x1, v1, x2, v2 at the end", (len(COORDINATES),), ("coordinate",)
)


# Rows of each group, as a `ChunkResult` has them.
Rows = dict[str, tuple[NDArray[np.int64], dict[str, NDArray[Any]]]]
# What the compiled kernel gives, the states at the end, and the rows if they are wanted.
Ran = tuple[_core.Sweep | _core.StructureSweep, Array, Rows]


class Machine(Protocol):
    """A kind of machine, with the one that a grid varies.

    Attributes
    ----------
    system
        The System or Structure; where a function makes one for each cell, that of the first.
    numbers
        Names of its numbers that an axis can vary, and how a message lists them.
    coordinates
        Names of the numbers of a start, in C order of its shape.
    final_state
        The field of states at the end; a start has its shape.
    exponents
        How many Lyapunov exponents a motion has.
    made_fields
        The columns that keep a machine that a function made.
    row_groups
        The impacts and the sections of a diagram.
    """

    @property
    def system(self) -> Any: ...  # noqa: D102
    @property
    def numbers(self) -> tuple[str, ...]: ...  # noqa: D102
    @property
    def named(self) -> str: ...  # noqa: D102
    @property
    def coordinates(self) -> tuple[str, ...]: ...  # noqa: D102
    @property
    def final_state(self) -> Field: ...  # noqa: D102
    @property
    def exponents(self) -> int: ...  # noqa: D102
    @property
    def made_fields(self) -> tuple[Field, ...]: ...  # noqa: D102
    @property
    def row_groups(self) -> tuple[RowGroup, ...]: ...  # noqa: D102

    def to_dict(self) -> dict[str, Any]:
        """Return the machine as a dict, fit for JSON."""
        ...

    def starts(self, initial: Any) -> Array:
        """Return checked starts, (k, *shape of a state); of one start k = 1."""
        ...

    def start(self, initial: Any) -> Any:
        """Return one checked start as nested tuples."""
        ...

    def check_starts(self, axes: Values, initial: Any) -> None:
        """Refuse axes of coordinates whose combinations are no starts."""
        ...

    def row(self, system: Any, values: Mapping[str, float]) -> dict[str, Any]:
        """Return the columns of a machine that a function made from some values.

        Raises
        ------
        ParameterError
            If it is another kind of machine than that of the first cell.
        """
        ...

    def at(self, row: Mapping[str, Array]) -> Any:
        """Return the machine of a row of those columns."""
        ...

    def entry_name(self, column: str, place: int) -> str:
        """Return what an entry of one of these columns is, for messages."""
        ...

    def run(self, values: Values, columns: Values, starts: Array, **options: Any) -> Ran:
        """Run cells by the compiled kernel.

        ``values`` holds the numbers that are varied by name, ``columns`` what functions made.
        """
        ...


def machine_of(system: Any) -> Machine:
    """Return what a System or a Structure gives to a grid."""
    if isinstance(system, System):
        return SystemMachine(system)
    from .structure_machine import StructureMachine  # who works without pays nothing

    return StructureMachine(system)


def made_machine(function: Maker, values: Mapping[str, float]) -> Any:
    """Return the machine that a function makes; ParameterError if it makes something else."""
    system = called(function, values)
    if not isinstance(system, System) and not is_structure(system):
        raise ParameterError(
            f"at {in_words(values)}: the function gave {system!r}; allowed: a vibroimpact.System "
            "or a vibroimpact.Structure"
        )
    return system


def need_machine(system: Any) -> None:
    """Refuse what is no machine, nor a function that makes one."""
    if isinstance(system, System) or is_maker(system) or is_structure(system):
        return
    reject("system", system, "a vibroimpact.System, a vibroimpact.Structure, or a function of one")


def machine_from_dict(fields: Mapping[str, Any]) -> Machine:
    """Return the machine of a dict of ``Machine.to_dict``."""
    if "stops" not in fields:
        return SystemMachine(System.from_dict(fields))
    from .structure_machine import StructureMachine

    return StructureMachine.from_dict(fields)


PARAMETER_FIELD = Field(
    "system_parameters",
    "float64",
    f"parameters of the system that the function made: {', '.join(PARAMETERS)}",
    (len(PARAMETERS),),
    ("system_parameter",),
)
SCALES_FIELD = Field(
    "system_scales", "float64", "its scales: length, mass, time in SI", (3,), ("scale",)
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


@dataclass(frozen=True)
class SystemMachine:
    """The pendulum and the mass."""

    system: System

    numbers = (*PARAMETERS,)
    named = ", ".join(PARAMETERS)
    coordinates = COORDINATES
    final_state = FINAL
    exponents = 4
    row_groups = (IMPACT_ROWS, STROBOSCOPIC_ROWS)

    @property
    def made_fields(self) -> tuple[Field, ...]:
        """Its parameters, and its scales where it has some."""
        return (PARAMETER_FIELD, *(() if self.system.scales is None else (SCALES_FIELD,)))

    def to_dict(self) -> dict[str, Any]:
        """Return the fields of the system."""
        return self.system.to_dict()

    def starts(self, initial: Any) -> Array:
        """Return checked starts, (k, 4)."""
        return states(initial).reshape(-1, len(COORDINATES))

    def start(self, initial: Any) -> tuple[float, float, float, float]:
        """Return one checked start."""
        return state(initial)

    def check_starts(self, axes: Values, initial: Any) -> None:
        """Take any numbers: a start in which bodies overlap is a status of its cell."""

    def row(self, system: Any, values: Mapping[str, float]) -> dict[str, Any]:
        """Return parameters and scales; contact and law are the same in all cells."""
        if not isinstance(system, System):
            raise unlike(values, "the function gave", system, "a vibroimpact.System as before")
        for name in ("contact", "law"):
            found, allowed = getattr(system, name), getattr(self.system, name)
            if found != allowed:
                raise unlike(values, f"{name} =", found, f"{allowed!r}, as for the first values")
        scales = system.scales
        if self.system.scales is None and scales is not None:
            raise unlike(values, "scales =", scales, "None, as for the first values")
        in_si = (math.nan,) * 3 if scales is None else (scales.length, scales.mass, scales.time)
        return {
            PARAMETER_FIELD.name: [getattr(system, name) for name in PARAMETERS],
            SCALES_FIELD.name: in_si,
        }

    def at(self, row: Mapping[str, Array]) -> System:
        """Return the system of a row."""
        made = dict(zip(PARAMETERS, row[PARAMETER_FIELD.name].tolist(), strict=True))
        scales = None
        if SCALES_FIELD.name in row:
            length, mass, time = row[SCALES_FIELD.name].tolist()
            if not math.isnan(length):
                scales = Scales(length=length, mass=mass, time=time)
        return self.system.replace(**made, scales=scales)

    def entry_name(self, column: str, place: int) -> str:
        """Return the name of a parameter, a scale or a coordinate."""
        names = {PARAMETER_FIELD.name: [*PARAMETERS], START: [*COORDINATES]}
        return names.get(column, ["length", "mass", "time"])[place]

    def run(self, values: Values, columns: Values, starts: Array, **options: Any) -> Ran:
        """Run cells."""
        if PARAMETER_FIELD.name in columns:
            names: list[str] = [*PARAMETERS]
            parameters = columns[PARAMETER_FIELD.name]
        else:
            names = [name for name in values if name in PARAMETERS]
            parameters = np.empty((len(starts), len(names)))
            for place, name in enumerate(names):
                parameters[:, place] = values[name]
        kernel = _core.sweep(self.system._compiled, names, parameters, starts, **options)
        if not options.get("rows"):
            return kernel, kernel.final_states, {}
        columns_of = ("x1", "v1", "v2", "impact_phase", "approach_velocity", "energy_loss")
        impacts = dict(zip(columns_of, kernel.impact_section, strict=True))
        rows: Rows = {
            "impact": (kernel.impact_count, {**impacts, "regime": kernel.regime}),
            "stroboscopic": (kernel.stroboscopic_count, {"stroboscopic": kernel.stroboscopic}),
        }
        return kernel, kernel.final_states, rows


def unlike(values: Mapping[str, float], what: str, found: Any, allowed: str) -> ParameterError:
    """Return the error of a machine that is not like that of the first cell."""
    shown = repr(found)
    shown = shown if len(shown) <= 200 else f"{shown[:200]} ..."
    return ParameterError(
        f"at {in_words(values)}: {what} {shown} is not allowed; allowed: {allowed}"
    )


def start_field(machine: Machine) -> Field:
    """Return the column of starts that a function made."""
    shape, dims = machine.final_state.shape, machine.final_state.dims
    what = machine.final_state.description.replace("at the end", "at t = 0, from the function")
    return Field(START, "float64", what, shape, dims)


def with_coordinates(machine: Machine, starts: Array, values: Values) -> Array:
    """Set those numbers of starts, (cells, *shape), that are varied by name; in place."""
    flat = starts.reshape(len(starts), -1)
    for place, name in enumerate(machine.coordinates):
        if name in values:
            flat[:, place] = values[name]
    return starts

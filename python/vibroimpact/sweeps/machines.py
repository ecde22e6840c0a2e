"""The machine of System as a grid sees it, and the choice between machines."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from .. import _core
from ..arguments import reject, state, states
from ..machine import Machine
from ..machine_kinds import is_maker
from ..restitution import is_alike
from ..scales import Scales
from ..system import System
from .columns import COORDINATES
from .fields import Field, RowGroup
from .grid_machine import START, Array, GridMachine, Ran, Rows, Values, unlike

FINAL = Field(
    "final_state", "float64", "x1, v1, x2, v2 at the end", (len(COORDINATES),), ("coordinate",)
)
_PARAMETERS = "system_parameters"
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

    coordinates = COORDINATES
    final_state = FINAL
    exponents = 4
    row_groups = (IMPACT_ROWS, STROBOSCOPIC_ROWS)

    @property
    def numbers(self) -> tuple[str, ...]:
        """The names of what varies."""
        return self.system._numbers_by_name

    @property
    def made_fields(self) -> tuple[Field, ...]:
        """Its parameters, and its scales where it has some."""
        names = self.numbers
        what = f"parameters of the system that the function made: {', '.join(names)}"
        field = Field(_PARAMETERS, "float64", what, (len(names),), ("system_parameter",))
        return (field, *(() if self.system.scales is None else (SCALES_FIELD,)))

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
        if not is_alike(system.restitution, self.system.restitution):
            allowed = f"one with the numbers of {self.system.restitution!r} by name"
            raise unlike(values, "restitution =", system.restitution, allowed)
        scales = system.scales
        if self.system.scales is None and scales is not None:
            raise unlike(values, "scales =", scales, "None, as for the first values")
        in_si = (math.nan,) * 3 if scales is None else (scales.length, scales.mass, scales.time)
        return {
            _PARAMETERS: [getattr(system, name) for name in self.numbers],
            SCALES_FIELD.name: in_si,
        }

    def at(self, row: Mapping[str, Array]) -> System:
        """Return the system of a row."""
        made = dict(zip(self.numbers, row[_PARAMETERS].tolist(), strict=True))
        scales = None
        if SCALES_FIELD.name in row:
            length, mass, time = row[SCALES_FIELD.name].tolist()
            if not math.isnan(length):
                scales = Scales(length=length, mass=mass, time=time)
        return self.system.replace(**made, scales=scales)

    def entry_name(self, column: str, place: int) -> str:
        """Return the name of a parameter, a scale or a coordinate."""
        names = {_PARAMETERS: [*self.numbers], START: [*COORDINATES]}
        return names.get(column, ["length", "mass", "time"])[place]

    def run(self, values: Values, columns: Values, starts: Array, **options: Any) -> Ran:
        """Run cells."""
        if _PARAMETERS in columns:
            names = [*self.numbers]
            parameters = columns[_PARAMETERS]
        else:
            names = [name for name in values if name in self.numbers]
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


def machine_of(system: Any) -> GridMachine:
    """Return what a System or a Structure gives to a grid."""
    if isinstance(system, System):
        return SystemMachine(system)
    from .structure_machine import StructureMachine  # who works without pays nothing

    return StructureMachine(system)


def need_machine(system: Any) -> None:
    """Refuse what is no machine, nor a function that makes one."""
    if not isinstance(system, Machine) and not is_maker(system):
        allowed = "a vibroimpact.System, a vibroimpact.Structure, or a function that makes one"
        reject("system", system, allowed)


def machine_from_dict(fields: Mapping[str, Any]) -> GridMachine:
    """Return the machine of a dict of ``Machine.to_dict``."""
    if "stops" not in fields:
        return SystemMachine(System.from_dict(fields))
    from .structure_machine import StructureMachine

    return StructureMachine.from_dict(fields)

"""What a Structure gives to a computation over a grid, as `machine` describes it."""

from __future__ import annotations

import itertools
import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .. import _core
from ..by_value import leaves
from ..errors import StateError
from ..structure import Structure
from .fields import Field, RowGroup
from .grid_machine import START, Array, Ran, Values, unlike, with_coordinates

# The columns of impacts that have N entries, in coordinates of the compiled structure.
_WIDE = ("q", "v_pre", "v_post")
_PARTS = ("part", "coordinate")
_NUMBERS = "system_numbers"
# Combinations of coordinates of a start that are looked at together.
_MANY = 65536


@dataclass(frozen=True)
class StructureMachine:
    """Any linear structure with stops."""

    system: Structure

    @classmethod
    def from_dict(cls, fields: Mapping[str, Any]) -> StructureMachine:
        """Return the machine of a dict of ``to_dict``."""
        return cls(Structure.from_json(json.dumps(dict(fields))))

    def to_dict(self) -> dict[str, Any]:
        """Return the fields of the structure as JSON has them."""
        fields: dict[str, Any] = json.loads(self.system.to_json())
        return fields

    @property
    def numbers(self) -> tuple[str, ...]:
        """Drive frequency, phase, and the numbers of all stops or of one."""
        return self.system._numbers_by_name

    @property
    def coordinates(self) -> tuple[str, ...]:
        """The names ``q_0``, ``q_1``, ... ``v_0``, ``v_1``, ..."""
        places = range(self.system.coordinates)
        return tuple(f"{part}_{place}" for part in "qv" for place in places)

    @property
    def final_state(self) -> Field:
        """Rows q and v."""
        shape = (2, self.system.coordinates)
        return Field("final_state", "float64", "q and v at the end", shape, _PARTS)

    @property
    def exponents(self) -> int:
        """All of the compiled structure."""
        return 2 * len(self.system._compiled.frequencies)

    @property
    def made_fields(self) -> tuple[Field, ...]:
        """All numbers of the structure in one row."""
        what = "numbers of the structure that the function made, in the order of its JSON"
        length = len(self._names)
        return (Field(_NUMBERS, "float64", what, (length,), ("system_number",)),)

    @property
    def row_groups(self) -> tuple[RowGroup, ...]:
        """Impacts and sections; names of columns are none that an axis has."""
        wide = ((self.system.coordinates,), ("coordinate",))
        impacts = (
            Field("time", "float64", "time of each kept impact"),
            Field("period", "int64", "its whole drive periods"),
            Field("time_in_period", "float64", "time since"),
            Field("stop", "int64", "which stop"),
            Field("q", "float64", "q at it", *wide),
            Field("v_pre", "float64", "q' just before it", *wide),
            Field("v_post", "float64", "q' just after it", *wide),
            Field("approach_velocity", "float64", "u just before it"),
            Field("impact_phase", "float64", "phase of the drive in [0, 2 pi)"),
            Field("regime", "int64", "its regime"),
            Field("impulse_normal", "float64", "impulse against the normal"),
            Field("impulse_tangential", "float64", "impulse along the tangent"),
            Field("energy_loss", "float64", "energy it takes"),
        )
        state = self.final_state
        sections = Field(
            "stroboscopic", "float64", "q and v at each kept section", state.shape, state.dims
        )
        return (RowGroup("impact", impacts), RowGroup("stroboscopic", (sections,)))

    def starts(self, initial: Any) -> Array:
        """Return checked starts, (k, 2, N), which lie in the span of the modes."""
        states = self.system._starts(initial).reshape(-1, *self.final_state.shape)
        self.system._to_core(states)
        return states

    def start(self, initial: Any) -> tuple[tuple[float, ...], ...]:
        """Return one checked start, its rows q and v."""
        states = self.starts(initial)
        if np.ndim(initial) != 2:
            shape = (2, self.system.coordinates)
            raise StateError(
                f"initial of shape {np.shape(initial)} is not allowed; allowed: rows q and v of "
                f"shape {shape}"
            )
        q, v = states[0].tolist()
        return tuple(q), tuple(v)

    def check_starts(self, axes: Values, initial: Any) -> None:
        """Refuse combinations of coordinates that lie outside of the span of the modes."""
        own = [name for name in axes if name in self.coordinates]
        if not self.system._basis.is_modal or not own:
            return
        rows = itertools.product(*(axes[name].tolist() for name in own))
        while part := [*itertools.islice(rows, _MANY)]:
            states = np.tile(np.asarray(initial, dtype=float), (len(part), 1, 1))
            columns = np.array(part).T
            with_coordinates(self, states, dict(zip(own, columns, strict=True)))
            try:
                self.system._to_core(states)
            except StateError as error:
                raise StateError(f"over {', '.join(own)}: {error}") from error

    @cached_property
    def _entries(self) -> dict[str, Any]:
        """The fields, with as many numbers whatever their values: all of the drive are pairs."""
        drive = self.system.drive_amplitude.tolist()
        return {
            **self.to_dict(),
            "drive_amplitude": [[amplitude.real, amplitude.imag] for amplitude in drive],
        }

    @cached_property
    def _names(self) -> list[str]:
        return [name for name, value in leaves(self._entries) if _is_number(value)]

    def row(self, system: Any, values: Mapping[str, float]) -> dict[str, Any]:
        """Return all numbers of a structure; what is no number is the same in all cells."""
        if not isinstance(system, Structure):
            raise unlike(values, "the function gave", system, "a vibroimpact.Structure as before")
        if system._in_short() != self.system._in_short():
            allowed = f"{self.system._in_short()}, as for the first values"
            raise unlike(values, "the function gave", system, allowed)
        first, here = self._entries, StructureMachine(system)._entries
        for name in first | here:
            if _without_numbers(first.get(name)) != _without_numbers(here.get(name)):
                allowed = f"{first.get(name)!r:.200}, or that with other numbers"
                raise unlike(
                    values, f"{name} =", here.get(name), f"{allowed}, as for the first values"
                )
        numbers = [float(value) for _, value in leaves(here) if _is_number(value)]
        return {_NUMBERS: numbers}

    def at(self, row: Mapping[str, Array]) -> Structure:
        """Return the structure of a row."""
        numbers = iter(row[_NUMBERS].tolist())
        return StructureMachine.from_dict(_with_numbers(self._entries, numbers)).system

    def entry_name(self, column: str, place: int) -> str:
        """Return the path of a number of the structure, or the name of a coordinate."""
        return self.coordinates[place] if column == START else self._names[place]

    def run(self, values: Values, columns: Values, starts: Array, **options: Any) -> Ran:
        """Run cells."""
        systems, which = [self.system], np.zeros(len(starts), np.int64)
        # The number of one stop goes before that of all.
        names = sorted((name for name in values if name in self.numbers), key=self.numbers.index)
        if _NUMBERS in columns:
            names = []
            rows, which = np.unique(columns[_NUMBERS], axis=0, return_inverse=True)
            which = np.ascontiguousarray(which.reshape(-1), np.int64)
            systems = [self.at({_NUMBERS: row}) for row in rows]
        numbers = np.empty((len(starts), len(names)))
        for place, name in enumerate(names):
            numbers[:, place] = values[name]
        compiled = [system._compiled for system in systems]
        initials = _by_system(systems, which, starts, Structure._to_core)
        kernel = _core.structure_sweep(compiled, which, names, numbers, initials, **options)

        def physical(states: Array, counts: NDArray[np.int64] | None = None) -> Array:
            own = which if counts is None else np.repeat(which, counts)
            return _by_system(systems, own, states, Structure._from_core)

        rows_of_groups = {}
        if options.get("rows"):
            impacts: dict[str, NDArray[Any]] = dict(kernel.impacts)
            impacts["impact_phase"] = impacts.pop("phase")
            for name in _WIDE:
                impacts[name] = physical(impacts[name], kernel.impact_count)
            counts = kernel.stroboscopic_count
            sections = {"stroboscopic": physical(kernel.stroboscopic, counts)}
            rows_of_groups = {
                "impact": (kernel.impact_count, impacts),
                "stroboscopic": (counts, sections),
            }
        return kernel, physical(kernel.final_states), rows_of_groups


def _by_system(
    systems: Sequence[Structure],
    which: NDArray[np.int64],
    states: Array,
    convert: Callable[[Structure, Array], Array],
) -> Array:
    """Convert states between physical and compiled coordinates, each by its own structure."""
    if not any(system._basis.is_modal for system in systems):
        return states
    parts = [which == place for place in range(len(systems))]
    converted = [convert(system, states[part]) for system, part in zip(systems, parts, strict=True)]
    result = np.empty((len(states), *converted[0].shape[1:]))
    for part, found in zip(parts, converted, strict=True):
        result[part] = found
    return result


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)


def _without_numbers(value: Any) -> Any:
    if isinstance(value, dict):
        return {name: _without_numbers(part) for name, part in value.items()}
    if isinstance(value, list):
        return [_without_numbers(part) for part in value]
    return 0 if _is_number(value) else value


def _with_numbers(value: Any, numbers: Iterator[float]) -> Any:
    if isinstance(value, dict):
        return {name: _with_numbers(part, numbers) for name, part in value.items()}
    if isinstance(value, list):
        return [_with_numbers(part, numbers) for part in value]
    return next(numbers) if _is_number(value) else value

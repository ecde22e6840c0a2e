"""What a system file describes, and flags change: a System, or a Structure.

A description knows what it can be asked for on the command line: which flags, which names that can
vary, how a start is written. The commands ask it and need not know which machine it is.
"""

import itertools
from abc import ABC, abstractmethod
from collections.abc import Collection, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from .._core import PARAMETERS
from ..by_value import arguments_of
from ..errors import ParameterError
from ..physical import QUANTITIES
from ..restitution import RestitutionCurve, restitution_of
from ..stop import OF_DRIVE, OF_STOPS, numbers_by_name
from ..structure import Structure
from ..sweeps.columns import COORDINATES
from ..system import System

_CHOICES = ("contact", "law", "simultaneous")
# Every flag that changes a machine.
FLAGS = (*PARAMETERS, *_CHOICES)


class Description(ABC):
    """A machine, perhaps not all of it: flags may add what is missing."""

    # In words, with its article, and how its start is given.
    what: str
    how_to_start: str
    flags: Collection[str]
    in_si = False

    @abstractmethod
    def names(self, units: Mapping[str, Any]) -> tuple[str, ...]:
        """Return what can be varied; with ``units`` in SI."""

    @abstractmethod
    def coordinates(self) -> tuple[str, ...]:
        """Return the names of the coordinates of a start."""

    @abstractmethod
    def impact_values(self) -> dict[str, dict[str, Any]]:
        """Return the columns of impacts that a figure can show, as it is asked for them."""

    @abstractmethod
    def start(self, numbers: Sequence[float]) -> Any:
        """Return a start from the numbers of the flag."""

    @abstractmethod
    def _made(self, changes: Mapping[str, Any], missing: Mapping[str, float], units: Any) -> Any:
        """Return the machine with changes, and numbers where it has none."""

    def machine(
        self, changes: Mapping[str, Any], missing: Mapping[str, float], units: Mapping[str, Any]
    ) -> Any:
        """Return the machine with changes; ``missing`` are numbers where it has none of its own.

        Raises
        ------
        ParameterError
            If a flag belongs to another machine, or the numbers make no machine.
        """
        for name in FLAGS:
            if name in changes and name not in self.flags:
                known = ", ".join(_flag(each) for each in self.flags)
                raise ParameterError(
                    f"{_flag(name)} {changes[name]} is not allowed with {self.what}; "
                    f"allowed: {known}"
                )
        if units and not self.in_si:
            raise ParameterError(
                "--units SI is not allowed here; allowed: with a system file that has a table "
                "[physical], quantities in SI"
            )
        return self._made(changes, missing, units)


@dataclass(frozen=True)
class DescribedSystem(Description):
    """The fields of a System by name, perhaps not all; or one that is made, with its scales."""

    fields: Mapping[str, Any] = field(default_factory=dict)
    made: System | None = None

    what = "a system of two bodies"
    how_to_start = "--initial X1 V1 X2 V2, or initial = [x1, v1, x2, v2]"
    flags = (*PARAMETERS, "contact", "law")

    @property
    def in_si(self) -> bool:  # type: ignore[override]
        """Whether it has scales, or may have."""
        return self.made is not None

    def names(self, units: Mapping[str, Any]) -> tuple[str, ...]:
        """Return what can be varied: parameters, or quantities in SI."""
        if units:
            return QUANTITIES
        given = self.made.restitution if self.made else self.fields.get("restitution")
        if not isinstance(given, Mapping | RestitutionCurve):
            return tuple(PARAMETERS)
        curve: Any = restitution_of(given)
        return (*(name for name in PARAMETERS if name != "restitution"), *curve.names)

    def coordinates(self) -> tuple[str, ...]:
        """Return the names of the coordinates of a start."""
        return COORDINATES

    def impact_values(self) -> dict[str, dict[str, Any]]:
        """Return the columns of impacts that a figure can show, as it is asked for them."""
        names = ("x1", "v1", "v2", "phase", "approach_velocity", "energy_loss")
        return {name: {"value": name} for name in names}

    def start(self, numbers: Sequence[float]) -> Any:
        """Return x1, v1, x2, v2."""
        return numbers

    def _made(self, changes: Mapping[str, Any], missing: Mapping[str, float], units: Any) -> System:
        if self.made is None:
            # The numbers of a curve of restitution are never missing.
            own = {name: value for name, value in missing.items() if name in PARAMETERS}
            given = {**own, **self.fields, **changes}
            lacking = sorted({*arguments_of(System)[1]} - {*given})
            if lacking and not self.fields:
                raise ParameterError(
                    f"missing system parameters: {', '.join(lacking)}; allowed: a flag for each, "
                    "or --system with a file of a system or a structure, such as vibroimpact "
                    "template prints"
                )
            # Numbers of a curve of restitution are changes of the system that has it.
            curve = {*self.names({})} - {*PARAMETERS}
            own = {name: given.pop(name) for name in changes if name in curve}
            made = System.from_dict(given)
            return made.replace(**own) if own else made
        words = {name: value for name, value in changes.items() if name in _CHOICES}
        numbers = {name: value for name, value in changes.items() if name not in _CHOICES}
        return self.made.replace(**words).replace(**numbers, **units)


@dataclass(frozen=True)
class DescribedStructure(Description):
    """The fields of a Structure by name; numbers of it may be missing."""

    fields: Mapping[str, Any]
    path: Path

    what = "a structure"
    how_to_start = "--initial Q ... V ..., or initial = [[q, ...], [v, ...]]"
    flags = (*OF_DRIVE, *OF_STOPS, "law", "simultaneous")

    def names(self, units: Mapping[str, Any]) -> tuple[str, ...]:
        """Return what can be varied: of the drive, of all stops, of one."""
        return numbers_by_name([stop.get("restitution") for stop in self.fields["stops"]])

    def coordinates(self) -> tuple[str, ...]:
        """Return the names of the coordinates of a start: q_0 ..., v_0 ..."""
        return tuple(f"{part}_{i}" for part in "qv" for i in self._places)

    @property
    def _places(self) -> range:
        return range(len(self.fields.get("mass", self.fields.get("shapes"))))

    def impact_values(self) -> dict[str, dict[str, Any]]:
        """Return the columns of impacts that a figure can show, as it is asked for them."""
        names = ("approach_velocity", "phase", "impulse_normal", "energy_loss")
        wide = itertools.product(("q", "v_pre", "v_post"), self._places)
        return {name: {"value": name} for name in names} | {
            f"{name}_{i}": {"value": name, "coordinate": i} for name, i in wide
        }

    def start(self, numbers: Sequence[float]) -> Any:
        """Return the rows q and v."""
        if len(numbers) % 2:
            raise ParameterError(
                f"--initial of {len(numbers)} numbers is not allowed; allowed: as many q as v, "
                "first all q, then all v"
            )
        return np.reshape(numbers, (2, -1))

    def _made(
        self, changes: Mapping[str, Any], missing: Mapping[str, float], units: Any
    ) -> Structure:
        fields = dict(self.fields)
        given = {**missing, **changes}
        for name in OF_DRIVE:
            if name in given:
                fields.setdefault(name, given[name])
        fields["stops"] = [
            {name: given[found] for name in OF_STOPS if (found := _of_stop(name, place, given))}
            | stop
            for place, stop in enumerate(fields["stops"])
        ]
        with naming_the_file(f"{self.path}, [structure]"):
            for place, stop in enumerate(fields["stops"]):
                lacking = [name for name in ("normal", "gap", "restitution") if name not in stop]
                if lacking:
                    raise ParameterError(f"stops[{place}]: missing: {', '.join(lacking)}")
            made = Structure.from_dict(fields)
        return made.replace(**changes)


@contextmanager
def naming_the_file(where: str) -> Iterator[None]:
    """Let errors about what a file holds say where that is."""
    try:
        yield
    except ParameterError as error:
        raise ParameterError(f"{where}: {error}") from error


def _of_stop(name: str, place: int, given: Mapping[str, Any]) -> str | None:
    """Return the name under which a number of one stop is given, if it is."""
    return next((each for each in (f"{name}_{place}", name) if each in given), None)


def _flag(name: str) -> str:
    return f"--{name.replace('_', '-')}"

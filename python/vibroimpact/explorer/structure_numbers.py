"""The numbers of a `Structure` that the explorer can change, their names, and its starts.

The matrices are those that it was given. Drive and damping have a factor each, the stops their
numbers: each of a few stops, or all of many at once.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Self

import numpy as np

from ..arguments import not_negative, number, reject, starts
from ..plot.coordinates import Combination
from ..plot.stop_rows import rows_of
from ..restitution import MEANINGS
from ..stop import SUBSCRIPTS, of_one_stop, varied_in
from ..structure import Structure
from . import curves
from .axis import Axis, around
from .machine import STROBOSCOPIC, Array, Machine

# Factors of what was given.
DRIVE, DAMPING = "drive_factor", "damping_factor"
_WORDS = {
    "drive_frequency": ("ω", "drive frequency"),
    "phase": ("φ", "phase of the drive"),
    DRIVE: ("", "factor of the drive"),
    DAMPING: ("", "factor of the damping"),
}
_SYMBOLS = {"gap": "δ", "restitution": "r", "friction": "μ"}
# What happens at several stops at one instant.
_AT_ONCE = {"stop": "the run ends", "sequence": "one by one", "together": "all at once"}
# Up to so many stops have sliders of their own, and so many coordinates fields of their start.
_FEW_STOPS, _FEW = 4, 4
# Curves of the time history.
_CURVES = 4


@dataclass(frozen=True)
class StructureNumbers(Machine):
    """A Structure, with factors of the drive and the damping it was given.

    Parameters
    ----------
    base
        As it was given.
    system
        With all changes.
    drive_factor, damping_factor
        Those that it has in place of the base's drive and damping.
    """

    base: Structure
    system: Structure
    drive_factor: float = 1.0
    damping_factor: float = 1.0

    @classmethod
    def of(cls, structure: Structure) -> Self:
        """Return the machine of a structure."""
        return cls(structure, structure)

    # Names.

    @cached_property
    def groups(self) -> dict[str, tuple[str, ...]]:
        """The drive with its damping, and the stops: each, or all of many."""
        drive = ["drive_frequency", DRIVE, "phase"] if self._is_driven else ["drive_frequency"]
        drive += [DAMPING] if self._is_damped else []
        count = len(self.base.stops)
        groups = {"Drive and damping": tuple(drive)}
        if not count:
            return groups
        choices = tuple(self.choices)
        if count == 1:
            return groups | {"Stop": (*choices, *self._of_all)}
        groups |= {"Impact": choices} if choices else {}
        if count > _FEW_STOPS:
            return groups | {f"All {count} stops": self._of_all}
        return groups | {f"Stop {stop}": self._of_one(stop) for stop in range(count)}

    @cached_property
    def choices(self) -> dict[str, tuple[str, ...]]:
        """What stops may do at one instant, and the law of friction where there is any."""
        rough = any(stop.tangent is not None for stop in self.base.stops)
        choices: dict[str, tuple[str, ...]] = {}
        if rough:
            choices["law"] = ("poisson", "newton", "energetic")
        if len(self.base.stops) > 1:
            choices["simultaneous"] = ("stop", "sequence") + (() if rough else ("together",))
        return choices

    def choice_words(self, name: str, choice: str) -> str:
        """Return what happens at several stops in words, a law by its name."""
        return _AT_ONCE[choice] if name == "simultaneous" else choice

    @cached_property
    def parameters(self) -> tuple[str, ...]:
        """Drive, damping, and numbers of all stops and of each."""
        factors = [DRIVE] * self._is_driven + [DAMPING] * self._is_damped
        return ("drive_frequency", "phase", *factors, *self._of_all, *self._of_each)

    @cached_property
    def _of_all(self) -> tuple[str, ...]:
        first, *others = [self._varied(stop) for stop in range(len(self.base.stops))] or [()]
        return tuple(name for name in first if all(name in other for other in others))

    def _of_one(self, stop: int) -> tuple[str, ...]:
        return tuple(f"{name}_{stop}" for name in self._varied(stop))

    def _varied(self, place: int) -> tuple[str, ...]:
        stop = self.base.stops[place]
        *names, friction = varied_in(stop.restitution)
        return tuple(names) if stop.tangent is None else (*names, friction)

    @cached_property
    def _of_each(self) -> tuple[str, ...]:
        count = len(self.base.stops)
        if count < 2:
            return ()
        return tuple(name for stop in range(count) for name in self._of_one(stop))

    @cached_property
    def coordinates(self) -> tuple[str, ...]:
        """All coordinates and then all velocities."""
        return tuple(f"{what}{i}" for what in "qv" for i in range(self.base.coordinates))

    @cached_property
    def starts(self) -> tuple[str, ...]:
        """Of few coordinates all; not of modes, whose span one coordinate alone leaves."""
        few = self.base.coordinates <= _FEW and self.base.mass is not None
        return self.coordinates if few else ()

    @cached_property
    def shown(self) -> tuple[str, ...]:
        """Every coordinate, and the differences of two of them that stops limit."""
        between = (_difference(row.normal) for row in rows_of(self.base))
        return (*self.coordinates[: self.base.coordinates], *(name for name in between if name))

    @property
    def values(self) -> dict[str, str]:
        """The sections of impacts, and the stroboscopic one."""
        return {
            "approach_velocity": "approach velocity",
            "q": "coordinate at impact",
            "phase": "phase at impact",
            STROBOSCOPIC: "coordinate once per period",
        }

    @property
    def heights(self) -> tuple[str, ...]:
        """One column for each curve."""
        return tuple(f"hit{k}" for k in range(self.curve_count))

    @property
    def first(self) -> dict[str, str]:
        """The approach velocity, and the first coordinate on which a stop acts."""
        return {"value": "approach_velocity", "shown": f"q{self.met[0]}"}

    @property
    def _is_driven(self) -> bool:
        return bool(np.any(self.base.drive_amplitude))

    @property
    def _is_damped(self) -> bool:
        given = (self.base.damping, self.base.damping_ratios)
        return any(each is not None and bool(np.any(each)) for each in given)

    # Numbers and starts.

    def numbers(self) -> dict[str, float | str]:
        """Return all numbers; of those of all stops NaN where the stops differ."""
        named = {"drive_frequency": self.system.drive_frequency, "phase": self.system.phase}
        named |= {DRIVE: self.drive_factor, DAMPING: self.damping_factor}
        for name in self._of_all:
            of_stops = {getattr(stop, name) for stop in self.system.stops}
            named[name] = of_stops.pop() if len(of_stops) == 1 else math.nan
        found: dict[str, float | str] = {name: named[name] for name in named if name in
                                         self.parameters}  # fmt: skip
        for name in self._of_each:
            if one := of_one_stop(name):
                found[name] = getattr(self.system.stops[one.place], one.what)
        return found | {name: getattr(self.system, name) for name in self.choices}

    def fields(self) -> dict[str, float | str]:
        """Return the numbers, of several stops those of each."""
        several = len(self.base.stops) > 1
        return {
            name: value
            for name, value in self.numbers().items()
            if not (several and name in self._of_all)
        }

    def without(self, names: Collection[str]) -> dict[str, float | str]:
        """Return the fields that stay; a number of all stops is that of each."""
        return {
            name: value
            for name, value in self.fields().items()
            if name not in names and not ((one := of_one_stop(name)) and one.what in names)
        }

    def replace(self, **changes: Any) -> Self:
        """Return the machine with some numbers and choices changed."""
        factors = {
            name: not_negative(name, changes.pop(name, getattr(self, name)))
            if name == DAMPING
            else number(name, changes.pop(name, getattr(self, name)))
            for name in (DRIVE, DAMPING)
        }
        structure = self.system
        if factors[DRIVE] != self.drive_factor:
            changes["drive_amplitude"] = factors[DRIVE] * self.base.drive_amplitude
        if factors[DAMPING] != self.damping_factor:
            for name in ("damping", "damping_ratios"):
                if (given := getattr(self.base, name)) is not None:
                    changes[name] = factors[DAMPING] * given
        if changes:
            structure = structure.replace(**changes)
        return type(self)(self.base, structure, factors[DRIVE], factors[DAMPING])

    def flat(self, initial: Any) -> tuple[float, ...]:
        """Return the rows q and v, one after the other."""
        count = self.base.coordinates
        shape = np.shape(initial)
        rows = np.reshape(initial, (2, count)) if shape == (2 * count,) else initial
        checked = starts(rows, count)
        if checked.ndim != 2:
            reject("initial", shape, f"one start, rows q and v of shape (2, {count})")
        return tuple(checked.ravel().tolist())

    def begin(self, initial: Sequence[float]) -> Any:
        """Return the rows q and v."""
        count = self.base.coordinates
        return [[*initial[:count]], [*initial[count:]]]

    def span(self, name: str) -> tuple[float, float]:
        """Return a range around what the structure was given."""
        fixed = {"phase": math.tau, DRIVE: 3.0, DAMPING: 5.0, "restitution": 1.0, "friction": 1.5}
        one = of_one_stop(name)
        kind = one.what if one else name
        if kind in fixed:
            return 0.0, fixed[kind]
        if kind == "drive_frequency":
            frequency = self.base.drive_frequency or float(self.base.frequencies[-1])
            return 0.0, 2.0 * (frequency or 1.0)
        length = self._length
        if kind == "gap":
            gaps = [stop.gap for stop in self.base.stops]
            some = [gaps[one.place]] if one else gaps
            return min(some) - length, max(some) + length
        # As far as the stops, and as fast as the drive or the fastest mode goes there.
        speed = length * (self.base.drive_frequency or float(self.base.frequencies[-1]) or 1.0)
        if (of_curve := curves.span(kind, speed)) is not None:
            return of_curve
        reach = length if name[0] == "q" else speed  # of a start
        return -reach, reach

    @property
    def _length(self) -> float:
        return max((abs(stop.gap) for stop in self.base.stops), default=0.0) or 1.0

    def usual(self, name: str) -> Axis:
        """Return the range of a map; of a factor around what was given."""
        return around(name, 1.0) if name in (DRIVE, DAMPING) else super().usual(name)

    def axes(self, *, own: bool) -> dict[str, Axis]:
        """Return a range around the drive's frequency, or without a drive one of the gap."""
        frequency = self.system.drive_frequency
        if frequency > 0.0:
            vary = around("drive_frequency", frequency)
        else:
            # Without a drive its frequency changes nothing.
            vary = self.usual("gap" if self._of_all else "drive_frequency")
        return {
            "vary": vary,
            "across": vary,
            "upward": self.usual(DRIVE if self._is_driven else "phase"),
            "right": self.usual("q0"),
            "up": self.usual("v0"),
        }

    def symbol(self, name: str) -> str:
        """Return the symbol of a number, with the stop's or coordinate's index."""
        if name in _WORDS:
            return _WORDS[name][0]
        if name in self.coordinates:
            return f"{'q' if name[0] == 'q' else 'q̇'}{name[1:].translate(SUBSCRIPTS)}"
        if name in self.shown:
            return " - ".join(map(self.symbol, name.split("-")))
        if one := of_one_stop(name):
            place = str(one.place).translate(SUBSCRIPTS)
            return f"{_SYMBOLS.get(one.what) or f'{curves.SYMBOLS[one.what]},'}{place}"
        return _SYMBOLS.get(name) or curves.SYMBOLS[name]

    def words(self, name: str) -> str:
        """Return the name of a number, with its stop."""
        if name in self.coordinates or name in self.shown:
            return ""
        if name in _WORDS:
            return _WORDS[name][1]
        one = of_one_stop(name)
        what = one.what if one else name
        what = MEANINGS.get(what, what)
        if one:
            return f"{what} of stop {one.place}"
        return what if len(self.base.stops) == 1 else f"{what} of all stops"

    @cached_property
    def met(self) -> list[int]:
        """Coordinates, those on which stops act before the others."""
        acts = np.zeros(self.base.coordinates, dtype=bool)
        for stop in self.base.stops:
            acts |= stop.normal != 0.0
        order: list[int] = np.argsort(~acts, kind="stable").tolist()
        return order

    @property
    def curve_count(self) -> int:
        """How many coordinates the time history draws."""
        return min(_CURVES, self.base.coordinates)


def looked_at(shown: str) -> Combination:
    """Return what is looked at under a name such as ``q1`` or ``q0-q1``."""
    return Combination(
        tuple((-1 if later else 1, int(name[1:])) for later, name in enumerate(shown.split("-")))
    )


def _difference(normal: Array) -> str:
    """Return the name of a row on which stops act, if it is a difference of two coordinates."""
    at = np.flatnonzero(normal).tolist()
    return f"q{at[0]}-q{at[1]}" if normal[at].tolist() == [1.0, -1.0] else ""

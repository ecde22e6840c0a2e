"""What a page of the explorer shows, as numbers and names: its state, and its address.

The address of the page is untrusted. `from_query` takes numbers and known names from it, checks
each of them, and evaluates nothing. Numbers come back bit for bit.
"""

from __future__ import annotations

import dataclasses
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from .._core import CONTACTS, LAWS, PARAMETERS
from ..arguments import close_to, number, reject
from ..arguments import state as checked_state
from ..errors import ParameterError
from ..system import System

COORDINATES = ("x1", "v1", "x2", "v2")
MAPS = ("diagram", "chart", "basins")
VALUES = ("x1", "approach_velocity", "phase", "stroboscopic")
STARTS = ("fresh", "forward", "backward")
# Fields whose values are one of a few names.
CHOICES: dict[str, tuple[str, ...]] = {
    "contact": CONTACTS,
    "law": LAWS,
    "map": MAPS,
    "value": VALUES,
    "start": STARTS,
    "branch": ("off", "on"),
    "theme": ("light", "dark"),
}
# The number of the address's two axes of a chart, and so on, by the name of the first part.
_AXES = {
    "vary": tuple(PARAMETERS),
    "across": tuple(PARAMETERS),
    "upward": tuple(PARAMETERS),
    "right": COORDINATES,
    "up": COORDINATES,
}
_NUMBER = re.compile(r"[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?")
# Whole numbers below this are written without a decimal point.
_WHOLE = 1e15
# No number that Python writes is longer.
_LONGEST = 40


@dataclass(frozen=True, kw_only=True)
class Axis:
    """A quantity that varies, and its range.

    Attributes
    ----------
    name
        Of a numeric parameter of System, or of a coordinate of the start.
    low, high
        Both ends, ``low < high``.
    """

    name: str
    low: float
    high: float

    def __post_init__(self) -> None:
        """Refuse an empty range."""
        for end in ("low", "high"):
            object.__setattr__(self, end, number(f"{self.name}: {end}", getattr(self, end)))
        if not self.low < self.high:
            reject(self.name, (self.low, self.high), "a range whose first end is the lower one")


@dataclass(frozen=True, kw_only=True)
class State:
    """All that a page of the explorer shows.

    Attributes
    ----------
    system, initial
        The machine, and its state (x1, v1, x2, v2) at t = 0.
    origin
        Where a followed diagram begins, if the motion of the page is that of one of its columns,
        which starts elsewhere: in ``initial``. None: the diagram begins there, too.
    map
        Which map of motions is shown: ``diagram``, ``chart`` or ``basins``.
    vary
        Parameter and range of the bifurcation diagram.
    value
        What the diagram draws: ``x1``, ``approach_velocity`` or ``phase`` at impact, or x1 once per
        drive period, ``stroboscopic``.
    start
        How the columns of the diagram start, as in ``vi.bifurcation_diagram``.
    across, upward
        The two parameters of the chart, and their ranges.
    right, up
        The two coordinates of the start that the basins vary, and their ranges.
    branch
        Whether the branch of the periodic motion lies over the diagram.
    theme
        ``light`` or ``dark``.
    """

    system: System
    initial: tuple[float, float, float, float]
    origin: tuple[float, float, float, float] | None = None
    map: str = "diagram"
    vary: Axis = Axis(name="drive_frequency", low=0.5, high=3.0)
    value: str = "x1"
    start: str = "fresh"
    across: Axis = Axis(name="drive_frequency", low=0.5, high=3.0)
    upward: Axis = Axis(name="moment_amplitude", low=0.2, high=2.0)
    right: Axis = Axis(name="x1", low=-0.5, high=0.5)
    up: Axis = Axis(name="v1", low=-1.5, high=1.5)
    branch: bool = False
    theme: str = "light"

    def __post_init__(self) -> None:
        """Check every field.

        Raises
        ------
        ParameterError, StateError
            Names the field, its value and what is allowed.
        """
        if not isinstance(self.system, System):
            reject("system", self.system, "a vibroimpact.System")
        object.__setattr__(self, "initial", checked_state(self.initial))
        if self.origin is not None:
            object.__setattr__(self, "origin", checked_state(self.origin))
        for name in ("map", "value", "start", "theme"):
            if getattr(self, name) not in CHOICES[name]:
                reject(name, getattr(self, name), ", ".join(CHOICES[name]))
        for name, known in _AXES.items():
            axis = getattr(self, name)
            if axis.name not in known:
                reject(name, axis.name, ", ".join(known))
        for one, other in (("across", "upward"), ("right", "up")):
            if getattr(self, one).name == getattr(self, other).name:
                reject(other, getattr(self, other).name, f"another one than of {one}")

    @property
    def diagram_initial(self) -> tuple[float, float, float, float]:
        """Where the diagram begins."""
        return self.initial if self.origin is None else self.origin

    def replace(self, **changes: Any) -> State:
        """Return a state with some fields changed; parameters and coordinates by their names too.

        A new start of the motion is that of the diagram, too, unless ``origin`` is given.

        Raises
        ------
        ParameterError, StateError
            As for a new state.
        """
        known = {field.name for field in dataclasses.fields(self)}
        parameters = {k: v for k, v in changes.items() if k in (*PARAMETERS, "contact", "law")}
        start = [changes.get(k, old) for k, old in zip(COORDINATES, self.initial, strict=True)]
        fields = {k: v for k, v in changes.items() if k in known}
        if unknown := set(changes) - known - set(parameters) - set(COORDINATES):
            name = min(unknown)
            hint = close_to(name, [*known, *PARAMETERS, *COORDINATES])
            raise ParameterError(f"unknown name {name}{hint}")
        if parameters:
            fields["system"] = fields.get("system", self.system).replace(**parameters)
        if set(changes) & set(COORDINATES):
            fields["initial"] = tuple(start)
        if "initial" in fields:
            fields = {"origin": None} | fields
        return dataclasses.replace(self, **fields)

    def to_query(self) -> str:
        """Return the state as the query of an address, without question mark."""
        system = self.system.to_dict()
        fields: dict[str, str | float] = {name: system[name] for name in PARAMETERS}
        fields |= {name: system[name] for name in ("contact", "law")}
        fields |= zip(COORDINATES, self.initial, strict=True)
        if self.origin is not None:
            fields |= zip(_ORIGIN, self.origin, strict=True)
        fields |= {name: getattr(self, name) for name in ("map", "value", "start", "theme")}
        fields["branch"] = "on" if self.branch else "off"
        for name in _AXES:
            axis = getattr(self, name)
            fields |= {name: axis.name, f"{name}_low": axis.low, f"{name}_high": axis.high}
        # A plus sign would mean a blank in an address.
        return "&".join(f"{name}={_text(value)}" for name, value in fields.items())


def map_key(state: State) -> tuple[Any, ...]:
    """Return all that the map of a state depends on, with its kind and axes first."""
    system = state.system.to_dict()
    begin = state.diagram_initial if state.map == "diagram" else state.initial
    start: dict[str, float] = dict(zip(COORDINATES, begin, strict=True))
    if state.map == "diagram":
        axes: tuple[Any, ...] = (state.vary,)
    elif state.map == "chart":
        axes = (state.across, state.upward)
    else:
        axes = (state.right, state.up)
    names = {axis.name for axis in axes}
    rest = {k: v for k, v in (system | start).items() if k not in names}
    assert names <= {*PARAMETERS, *start}
    more = (state.start,) if state.map == "diagram" else ()
    return (state.map, tuple(sorted(names)), axes, tuple(rest.items()), more)


def from_query(arguments: Mapping[str, Sequence[bytes]], default: State) -> State:
    """Return the state that the arguments of an address hold.

    Parameters
    ----------
    arguments
        The values of each name, as a web server gives them.
    default
        For what is not in the address.

    Raises
    ------
    ParameterError, StateError
        If a name is unknown or comes twice, or a value is no number, no known name, or out of
        range; names it.
    """
    fields: dict[str, Any] = {}
    known = _names()
    for name, values in arguments.items():
        if name not in known:
            raise ParameterError(f"unknown name in the address: {name[:_LONGEST]!r}")
        if len(values) != 1:
            reject(name, len(values), "to stand once in the address")
        fields[name] = known[name](name, values[0].decode("ascii", "replace"))
    for name in _AXES:
        parts = {part: fields.pop(key) for part, key in _parts(name) if key in fields}
        if parts:
            fields[name] = dataclasses.replace(getattr(default, name), **parts)
    origin = [fields.pop(name) for name in _ORIGIN if name in fields]
    if origin:
        if len(origin) != len(_ORIGIN):
            reject("origin", tuple(origin), f"{', '.join(_ORIGIN)}, all or none of them")
        fields["origin"] = tuple(origin)
    if "branch" in fields:
        fields["branch"] = fields["branch"] == "on"
    return default.replace(**fields)


def read_number(name: str, text: str) -> float:
    """Return the number that a text is.

    Raises
    ------
    ParameterError
        If it is none, or not finite.
    """
    text = text.strip().replace("\N{MINUS SIGN}", "-")
    if len(text) > _LONGEST or not _NUMBER.fullmatch(text):
        reject(name, text[:_LONGEST], "a number, such as 0.5 or 1e-3")
    return number(name, float(text))


def write_number(value: float) -> str:
    """Return the shortest text of a number that gives it back bit for bit."""
    return str(int(value)) if value.is_integer() and abs(value) < _WHOLE else repr(value)


def _text(value: str | float) -> str:
    return value if isinstance(value, str) else write_number(value).replace("e+", "e")


def _choice(name: str, text: str) -> str:
    allowed = CHOICES[name] if name in CHOICES else _AXES[name]
    if text not in allowed:
        reject(name, text[:_LONGEST], ", ".join(allowed))
    return text


def _parts(name: str) -> tuple[tuple[str, str], ...]:
    return ("name", name), ("low", f"{name}_low"), ("high", f"{name}_high")


def _names() -> dict[str, Any]:
    """Return how the value of each name in an address is read."""
    numbers = (
        *PARAMETERS,
        *COORDINATES,
        *_ORIGIN,
        *(f"{name}_{end}" for name in _AXES for end in _ENDS),
    )
    return dict.fromkeys((*CHOICES, *_AXES), _choice) | dict.fromkeys(numbers, read_number)


_ENDS = ("low", "high")
_ORIGIN = tuple(f"origin_{name}" for name in COORDINATES)

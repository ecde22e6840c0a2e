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

from ..arguments import number, reject
from ..errors import ParameterError
from ..hints import close_to
from .axis import Axis
from .machine import Machine
from .machines import machine_of

STARTS = ("fresh", "forward", "backward")
# Fields whose values are one of a few names; those of the machine are beside them.
CHOICES: dict[str, tuple[str, ...]] = {
    "start": STARTS,
    "branch": ("off", "on"),
    "theme": ("light", "dark"),
}
# Axes of the maps: of the diagram, the chart, the basins.
AXES = ("vary", "across", "upward", "right", "up")
_NUMBER = re.compile(r"[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?")
# Whole numbers below this are written without a decimal point.
_WHOLE = 1e15
# No number that Python writes is longer.
_LONGEST = 40


@dataclass(frozen=True, kw_only=True)
class State:
    """All that a page of the explorer shows.

    Attributes
    ----------
    machine, initial
        The machine, and its state at t = 0 in the order of ``machine.coordinates``.
    origin
        Where a followed diagram begins, if the motion of the page is that of one of its columns,
        which starts elsewhere: in ``initial``. None: the diagram begins there, too.
    map
        Which map of motions is shown: ``diagram``, ``chart`` or ``basins``.
    vary
        Parameter and range of the bifurcation diagram.
    value
        What the diagram draws: one of ``machine.values``.
    shown
        The coordinate that is looked at.
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

    machine: Machine
    initial: tuple[float, ...]
    origin: tuple[float, ...] | None = None
    map: str = "diagram"
    vary: Axis
    value: str
    shown: str
    start: str = "fresh"
    across: Axis
    upward: Axis
    right: Axis
    up: Axis
    branch: bool = False
    theme: str = "light"

    @classmethod
    def of(cls, system: Any, *, own: bool = False, **fields: Any) -> State:
        """Return a state of a system or a structure, at rest unless ``initial`` is given.

        Parameters
        ----------
        system
            The System or Structure.
        own
            Whether the maps have ranges around its own values.
        **fields
            Any other fields.

        Raises
        ------
        ParameterError, StateError
            As for a new state.
        """
        machine = machine_of(system)
        rest: dict[str, Any] = {"initial": (0.0,) * len(machine.coordinates)}
        return cls(machine=machine, **(rest | machine.first | machine.axes(own=own) | fields))

    def __post_init__(self) -> None:
        """Check every field.

        Raises
        ------
        ParameterError, StateError
            Names the field, its value and what is allowed.
        """
        object.__setattr__(self, "initial", self.machine.flat(self.initial))
        if self.origin is not None:
            object.__setattr__(self, "origin", self.machine.flat(self.origin))
        for name, allowed in choices(self.machine).items():
            # Those of the machine are checked by itself.
            own = name in self.machine.choices or name == "branch"
            if not own and getattr(self, name) not in allowed:
                reject(name, getattr(self, name), ", ".join(allowed))
        for name, known in axis_names(self.machine).items():
            axis = getattr(self, name)
            if axis.name not in known:
                reject(name, axis.name, ", ".join(known))
        for one, other in (("across", "upward"), ("right", "up")):
            if getattr(self, one).name == getattr(self, other).name:
                reject(other, getattr(self, other).name, f"another one than of {one}")

    @property
    def system(self) -> Any:
        """The System or Structure."""
        return self.machine.system

    @property
    def diagram_initial(self) -> tuple[float, ...]:
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
        machine = self.machine
        if "system" in changes:
            machine = machine_of(changes.pop("system"))
        own = {*machine.parameters, *machine.choices}
        parameters = {name: value for name, value in changes.items() if name in own}
        pairs = zip(machine.coordinates, self.initial, strict=False)
        start = [changes.get(name, old) for name, old in pairs]
        fields = {name: value for name, value in changes.items() if name in known}
        if unknown := set(changes) - known - own - {*machine.coordinates}:
            name = min(unknown)
            hint = close_to(name, [*known, *own, *machine.coordinates])
            raise ParameterError(f"unknown name {name}{hint}")
        if parameters or machine is not self.machine:
            machine = fields.get("machine", machine)
            fields["machine"] = machine.replace(**parameters) if parameters else machine
        if set(changes) & set(machine.coordinates):
            fields["initial"] = tuple(start)
        if "initial" in fields:
            fields = {"origin": None} | fields
        return dataclasses.replace(self, **fields)

    def to_query(self) -> str:
        """Return the state as the query of an address, without question mark."""
        machine = self.machine
        fields: dict[str, str | float] = machine.fields()
        fields |= zip(machine.coordinates, self.initial, strict=True)
        if self.origin is not None:
            fields |= zip(_origin(machine), self.origin, strict=True)
        names = ["map", "value", "start", "theme"]
        names += ["shown"] if len(machine.shown) > 1 else []
        fields |= {name: getattr(self, name) for name in names}
        fields["branch"] = "on" if self.branch else "off"
        for name in AXES:
            axis = getattr(self, name)
            fields |= {name: axis.name, f"{name}_low": axis.low, f"{name}_high": axis.high}
        # A plus sign would mean a blank in an address.
        return "&".join(f"{name}={_text(value)}" for name, value in fields.items())


def choices(machine: Machine) -> dict[str, tuple[str, ...]]:
    """Return the names allowed for each field that has some."""
    own = {"map": machine.maps, "value": tuple(machine.values), "shown": machine.shown}
    return {**machine.choices, **own, **CHOICES}


def axis_names(machine: Machine) -> dict[str, tuple[str, ...]]:
    """Return what each axis of a map may vary."""
    parameters, coordinates = machine.parameters, machine.coordinates
    return dict(zip(AXES, (*[parameters] * 3, *[coordinates] * 2), strict=True))


def map_key(state: State) -> tuple[Any, ...]:
    """Return all that the map of a state depends on, with its kind and axes first."""
    begin = state.diagram_initial if state.map == "diagram" else state.initial
    start: dict[str, Any] = dict(zip(state.machine.coordinates, begin, strict=True))
    if state.map == "diagram":
        axes: tuple[Any, ...] = (state.vary,)
    elif state.map == "chart":
        axes = (state.across, state.upward)
    else:
        axes = (state.right, state.up)
    names = {axis.name for axis in axes}
    rest = {k: v for k, v in start.items() if k not in names} | state.machine.without(names)
    assert names <= {*state.machine.parameters, *start}
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
    machine = default.machine
    known, allowed = _names(machine), {**choices(machine), **axis_names(machine)}
    for name, values in arguments.items():
        if name not in known:
            raise ParameterError(f"unknown name in the address: {name[:_LONGEST]!r}")
        if len(values) != 1:
            reject(name, len(values), "to stand once in the address")
        text = values[0].decode("ascii", "replace")
        fields[name] = (
            _choice(name, text, allowed[name]) if name in allowed else read_number(name, text)
        )
    for name in AXES:
        parts = {part: fields.pop(key) for part, key in _parts(name) if key in fields}
        if parts:
            fields[name] = dataclasses.replace(getattr(default, name), **parts)
    names = _origin(machine)
    origin = [fields.pop(name) for name in names if name in fields]
    if origin:
        if len(origin) != len(names):
            reject("origin", tuple(origin), f"{', '.join(names)}, all or none of them")
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


def _choice(name: str, text: str, allowed: Sequence[str]) -> str:
    if text not in allowed:
        reject(name, text[:_LONGEST], ", ".join(allowed))
    return text


def _parts(name: str) -> tuple[tuple[str, str], ...]:
    return ("name", name), ("low", f"{name}_low"), ("high", f"{name}_high")


def _origin(machine: Machine) -> tuple[str, ...]:
    return tuple(f"origin_{name}" for name in machine.coordinates)


def _names(machine: Machine) -> set[str]:
    """Return every name that an address may have."""
    ends = (f"{name}_{end}" for name in AXES for end in ("low", "high"))
    numbers = (*machine.parameters, *machine.coordinates, *_origin(machine), *ends)
    return {*choices(machine), *AXES, *numbers}

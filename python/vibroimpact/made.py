"""Systems that a function makes from numbers, such as a stiffness in N/m.

Where a system is varied, a function ``f(name=value, ...) -> System`` may stand in its place. It is
called once for each value, before anything is computed (sweeps with a store: chunk by chunk). With
``units="SI"`` that function is the `MakerInSI` of the given system: its SI quantities, some of
which are varied. For continuation a machine that was `Made` remembers its function and numbers:
derivatives by such a number are those by the system's own parameters times the differences of the
function.
"""

import inspect
import math
import re
from abc import abstractmethod
from collections.abc import Callable, Mapping, Sequence
from typing import Any, ClassVar, Self

import numpy as np
from numpy.typing import NDArray

from ._core import PARAMETERS
from .arguments import in_short, reject, state, states, swept, unknown
from .by_numbers import Basis as Basis
from .by_numbers import direction_of
from .by_value import leaves
from .errors import ParameterError, StateError
from .machine import Machine
from .machine_kinds import is_maker, is_structure, need_system
from .physical import QUANTITIES
from .restitution import is_alike
from .scales import in_si, needed
from .stop import is_of_stops, value_of_stops
from .structure import Structure
from .structure_directions import slopes_of_function
from .system import COORDINATES, System

Maker = Callable[..., System]

# Quantities that change the units of a start, l and omega_2.
_SCALING = {"length", "oscillator_mass", "stiffness"}

# Step of the differences of a function, as part of the number's size: its cube is the rounding of a
# double, which makes both errors of a central difference about equal.
_STEP = 6e-6
# The scale of a number is at least this part of its range.
_LEAST_SCALE = 0.1
# Coordinates beside the numbers of a function that makes a machine.
_COORDINATE = re.compile(r"[xv][12]|[qv]_[0-9]{1,6}")
# The direction of a number on which a structure does not depend.
_NONE = {"phase": 0.0}
# A start may differ so much from the system that the function makes for it.
_SAME = 1e-9


def in_words(values: Mapping[str, float]) -> str:
    """Return the numbers in words, for messages."""
    return ", ".join(f"{name} = {value!r}" for name, value in values.items())


def called(function: Callable[..., Any], values: Mapping[str, float]) -> Any:
    """Call a function of named numbers; its errors name them."""
    try:
        return function(**values)
    except (ParameterError, StateError) as error:
        raise type(error)(f"at {in_words(values)}: {error}") from error
    except Exception as error:
        error.add_note(f"at {in_words(values)}")
        raise


def made(function: Callable[..., Any], values: Mapping[str, float], *kinds: type[Any]) -> Any:
    """Return what a function makes; ParameterError if that is none of some kinds of machine."""
    found = called(function, values)
    if not isinstance(found, kinds):
        allowed = " or ".join(f"a vibroimpact.{kind.__name__}" for kind in kinds)
        raise ParameterError(
            f"at {in_words(values)}: the function gave {in_short(found)}; allowed: {allowed}"
        )
    return found


def takes(function: Callable[..., Any], name: str) -> bool:
    """Return whether a function takes an argument of a name; with ``**names`` it takes any."""
    known, _, any_name = _own_names(function)
    return any_name or name in known


def names_of(function: Callable[..., Any]) -> list[str]:
    """Return the names of the arguments of a function, but for those of its ``**names``."""
    return _own_names(function)[0]


def defaults_of(function: Callable[..., Any]) -> dict[str, Any]:
    """Return the arguments of a function with their defaults, None where there is none."""
    own = inspect.signature(function).parameters.values()
    variadic = (inspect.Parameter.VAR_KEYWORD, inspect.Parameter.VAR_POSITIONAL)
    return {
        each.name: None if each.default is each.empty else each.default
        for each in own
        if each.kind not in variadic
    }


def _own_names(function: Callable[..., Any]) -> tuple[list[str], list[str], bool]:
    """Return the names that a function takes, those that it needs, and whether it takes any."""
    known, required, any_name = [], [], False
    for parameter in inspect.signature(function).parameters.values():
        if parameter.kind is parameter.VAR_KEYWORD:
            any_name = True
        elif parameter.kind is not parameter.VAR_POSITIONAL:
            known.append(parameter.name)
            if parameter.default is parameter.empty:
                required.append(parameter.name)
    return known, required, any_name


def is_coordinate(name: str) -> bool:
    """Whether a name is that of a coordinate of a start, whichever the machine is."""
    return _COORDINATE.fullmatch(name) is not None


def of_start(name: str) -> str:
    """Say that the name of an argument is that of a coordinate, for a message."""
    return f"{name} is the name of a coordinate of the start"


def check_names(
    function: Callable[..., Any], names: Sequence[str], what: str = "system", *, least: bool = True
) -> None:
    """Refuse names that a function does not take, and with ``least`` one that needs more.

    Raises
    ------
    ParameterError
        Names what is unknown or missing, and the function's own names.
    """
    known, required, any_name = _own_names(function)
    own = ", ".join(known) or "nothing"
    for name in names:
        if name not in known and not any_name:
            raise unknown(name, known, f"it takes {own}", of=f" of the function {what}")
    missing = [name for name in required if name not in names]
    if missing and least:
        named_so = [name for name in missing if is_coordinate(name)]
        hint = f"; {of_start(named_so[0])}: call that argument otherwise" if named_so else ""
        raise ParameterError(
            f"the function {what} takes {own}; no values are given for {', '.join(missing)}{hint}"
        )


class MakerInSI:
    """The function of SI quantities that makes a system with scales, the others as they are.

    It takes coordinates of a start, too, which have no influence on the system: so the start is
    made beside it, in the units of each system.

    Parameters
    ----------
    system
        The system with its scales.

    Raises
    ------
    ParameterError
        If the system has no scales.
    """

    def __init__(self, system: System) -> None:
        needed(system.scales)
        self._system = system
        kind = inspect.Parameter.KEYWORD_ONLY
        self.__signature__ = inspect.Signature(
            [inspect.Parameter(name, kind, default=None) for name in (*QUANTITIES, *COORDINATES)]
        )

    def __call__(self, **values: float) -> System:
        """Return the system with these quantities, in SI."""
        own = {name: value for name, value in values.items() if name not in COORDINATES}
        return self._system.replace(**own, units="SI")

    def starts(self, initial: Any) -> Callable[..., NDArray[np.float64]]:
        """Return the function of the same numbers that gives a dimensionless start.

        ``initial`` is one in SI, or a function that gives one.
        """

        def start(**values: float) -> NDArray[np.float64]:
            given = state(initial(**values) if is_maker(initial) else initial)
            at = [values.get(name, x) for name, x in zip(COORDINATES, given, strict=True)]
            system = self(**values) if {*values} & _SCALING else self._system
            return needed(system.scales).from_si(at)

        if is_maker(initial):
            start.__signature__ = inspect.signature(initial)  # type: ignore[attr-defined]
        return start


def in_units(
    function: Callable[..., Any],
    units: Any,
    system: Any,
    initial: Any,
    axes: Mapping[str, Any],
    *,
    coordinates: bool = False,
) -> tuple[Any, Any]:
    """Return what a sweep varies, and its start: as they are, or in SI as functions of the axes.

    Parameters
    ----------
    function
        The sweep, for messages.
    units
        None or ``"SI"``.
    system, initial
        As the sweep gets them.
    axes
        What is varied, by name.
    coordinates
        Whether coordinates of the start may be among the axes.

    Raises
    ------
    ParameterError
        For other units, for a system without scales, and for an axis that is no quantity.
    """
    if not in_si(units):
        return system, initial
    if is_structure(system):
        reject("units", units, "None: a structure has no scales")
    need_system(system, maker=True)
    if is_maker(system):
        reject("units", units, "None where a function makes the system, in units of its own")
    machine = MakerInSI(system)
    for name in axes:
        if name in PARAMETERS and name not in QUANTITIES:
            raise ParameterError(
                f"{name} is not allowed with units='SI'; allowed: the quantities of "
                f"System.from_physical: {', '.join(QUANTITIES)}"
            )
    swept(function, axes, [*QUANTITIES, *(COORDINATES if coordinates else ())])
    several = not is_maker(initial) and states(initial).ndim == 2
    moved = sorted({*axes} & _SCALING)
    if several and moved:
        reject("initial", initial, f"one start: the units of starts change with {moved[0]}")
    if is_maker(initial) or moved or {*axes} & {*COORDINATES}:
        return machine, machine.starts(initial)
    return (machine if axes else system), needed(system.scales).from_si(states(initial))


class Made(Machine):
    """A machine that remembers the function and the numbers that made it.

    It compares, saves and pickles as any other of its kind, without them.
    """

    # Of which it is one.
    _KIND: ClassVar[type[Any]]

    _function: Callable[..., Any]
    _numbers: dict[str, float]
    _sizes: dict[str, float]

    @classmethod
    def of(
        cls,
        function: Callable[..., Any],
        numbers: Mapping[str, float],
        sizes: Mapping[str, float],
    ) -> Self:
        """Make the machine at some numbers; ``sizes`` are those of their ranges."""
        own = {"_function": function, "_numbers": dict(numbers), "_sizes": dict(sizes)}
        machine = object.__new__(cls)
        for name, value in (vars(made(function, numbers, cls._KIND)) | own).items():
            object.__setattr__(machine, name, value)
        return machine

    @abstractmethod
    def basis(self, names: Sequence[str]) -> Basis:
        """Return by what its runs are differentiated to get derivatives by some numbers."""

    def at(self, numbers: Mapping[str, float]) -> Self:
        """Return the machine that the function makes at other numbers."""
        return self.of(self._function, self._numbers | dict(numbers), self._sizes)

    def replace(self, **changes: Any) -> Any:
        """Return a machine with some of its own numbers changed, which no function has made."""
        return self._KIND.from_dict(self.to_dict()).replace(**changes)  # ``units`` is among them

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickle and copy as the machine that it is."""
        return self._KIND.from_dict, (self.to_dict(),)


class MadeSystem(Made, System):
    """A System that remembers the function and the numbers that made it."""

    _KIND = System

    def derivatives(self, names: Sequence[str]) -> NDArray[np.float64]:
        """Return the derivatives of all own numbers by some numbers, shape (own, names)."""
        return np.column_stack([self._derivative(name) for name in names])

    def basis(self, names: Sequence[str]) -> Basis:
        """Return the own numbers that change with some numbers."""
        derivatives = self.derivatives(names)
        moved = np.flatnonzero(derivatives.any(axis=1))
        return Basis([self._numbers_by_name[k] for k in moved], {}, derivatives[moved])

    def _derivative(self, name: str) -> NDArray[np.float64]:
        value, size = self._numbers[name], self._sizes[name]
        step = _STEP * scale_of(value, size)

        def at(steps: float) -> NDArray[np.float64] | None:
            numbers = self._numbers | {name: value + steps * step}
            try:
                there = made(self._function, numbers, System)
            except ParameterError:
                return None
            _must_have_numbers(numbers, there, self)
            return _row(there)

        here, above, below = _row(self), at(1.0), at(-1.0)
        if above is not None and below is not None:
            return (above - below) / (2.0 * step)
        # At an end of what is allowed, such as a damping of zero.
        for side, near in ((1.0, above), (-1.0, below)):
            far = at(2.0 * side)
            if near is not None and far is not None:
                return side * (4.0 * near - 3.0 * here - far) / (2.0 * step)
        raise ParameterError(f"at {name} = {value!r}: no derivative; both neighbours are refused")


def scale_of(number: float, size: float) -> float:
    """Return the scale on which a function is taken to vary at a number with a range of that size.

    It is the number itself, if that is small beside the range, but not too small: where the number
    passes zero differences over so short a step would be rounding.
    """
    return max(min(abs(number), size), _LEAST_SCALE * size)


def _row(system: System) -> NDArray[np.float64]:
    return np.array([getattr(system, name) for name in system._numbers_by_name])


def rows_of(systems: Sequence[System]) -> NDArray[np.float64]:
    """Return the own numbers of systems that have the same ones, in rows, in their order."""
    return np.array([_row(system) for system in systems])


def _must_have_numbers(values: Mapping[str, float], found: System, like: System) -> None:
    """Refuse a system whose restitution does not vary from that of another one by numbers."""
    if not is_alike(found.restitution, like.restitution):
        raise ParameterError(
            f"at {in_words(values)}: restitution = {found.restitution!r} is not allowed; allowed: "
            f"one with the numbers of {like.restitution!r} by name"
        )


class MadeStructure(Made, Structure):
    """A Structure that remembers the function and the numbers that made it."""

    _KIND = Structure

    def basis(self, names: Sequence[str]) -> Basis:
        """Return the directions in which the structure changes with some numbers."""
        directions = {}
        for name in names:

            def at(value: float, name: str = name) -> Any:
                return called(self._function, self._numbers | {name: value})

            slopes = slopes_of_function(self, name, (at, self._numbers[name]))
            directions[direction_of(name)] = slopes or _NONE
        return Basis([], directions, np.eye(len(names)))


def machine_made(
    function: Callable[..., Any], numbers: Mapping[str, float], sizes: Mapping[str, float]
) -> MadeSystem | MadeStructure:
    """Return what a function makes of numbers, a machine of either kind."""
    found = made(function, numbers, System, Structure)
    kind = MadeStructure if isinstance(found, Structure) else MadeSystem
    return kind.of(function, numbers, sizes)


def value_of(system: System | Structure, name: str) -> float:
    """Return the value of what is varied: a number of the function, or an own parameter.

    Raises
    ------
    ParameterError
        If it is a number of all stops of a structure, which differ in it.
    """
    if isinstance(system, Made) and name in system._numbers:
        return system._numbers[name]
    if isinstance(system, Structure) and is_of_stops(name):
        return value_of_stops(system.stops, name)
    value: float = getattr(system, name)
    return value


def varied(system: Any, values: Mapping[str, float]) -> Any:
    """Return the system at other values of what is varied, as in `value_of`."""
    if isinstance(system, Made) and all(name in system._numbers for name in values):
        return system.at(values)
    return system.replace(**values)


def basis_of(machine: Any, names: Sequence[str]) -> Basis:
    """Return by what runs of a machine are differentiated to get derivatives by its numbers.

    The numbers are its own, or those of the function that made it.

    Raises
    ------
    ParameterError
        If the function has no derivative there.
    """
    if isinstance(machine, Made) and names and names[0] in machine._numbers:
        return machine.basis(names)
    return Basis([*names], {}, np.eye(len(names)))


def numbers_of(machine: Machine) -> tuple[str, ...]:
    """Return the names of the numbers of a machine: its own, or those of its function."""
    return tuple(machine._numbers) if isinstance(machine, Made) else machine._numbers_by_name


def made_from(system: Any, names: Sequence[str]) -> MadeSystem | None:
    """Return the system if all names are numbers of the function that made it, else None."""
    if isinstance(system, MadeSystem) and all(name in system._numbers for name in names):
        return system
    return None


def started(
    function: Callable[..., Any],
    numbers: Mapping[str, float],
    sizes: Mapping[str, float],
    start: Any,
) -> Any:
    """Make the system at which a continuation starts; it must be that of its motion.

    Raises
    ------
    ParameterError
        If they differ, with the first parameter that does.
    """
    if isinstance(start, Structure):
        structure = MadeStructure.of(function, numbers, sizes)
        _must_be(in_words(numbers), structure, start)
        return structure
    system = MadeSystem.of(function, numbers, sizes)
    _must_have_numbers(numbers, system, start)
    for name in (*system._numbers_by_name, "contact", "law"):
        there, here = getattr(start, name), getattr(system, name)
        choice = name in ("contact", "law")
        close = not choice and math.isclose(there, here, rel_tol=_SAME, abs_tol=_SAME)
        if there != here and not close:
            raise ParameterError(
                f"at {in_words(numbers)} the function makes another system than the motion has: "
                f"{name} is {here!r}, not {there!r}"
            )
    return system


def _must_be(at: str, made: Structure, start: Structure) -> None:
    here, there = dict(leaves(made.to_dict())), dict(leaves(start.to_dict()))
    for name in here | there:
        if not _alike(here.get(name), there.get(name)):
            raise ParameterError(
                f"at {at} the function makes another structure than the motion has: {name} is "
                f"{here.get(name)!r}, not {there.get(name)!r}"
            )


def _alike(one: Any, other: Any) -> bool:
    """Whether entries of structures agree to rounding."""
    if isinstance(one, float | complex | int) and isinstance(other, float | complex | int):
        return bool(np.isclose(one, other, rtol=_SAME, atol=_SAME))
    return bool(one == other)

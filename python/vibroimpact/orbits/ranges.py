"""Checks of the one or two parameters over which a motion is followed, with their ranges."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any, NoReturn, TypeVar

from ..arguments import number, pair, reject, triple, unknown
from ..errors import ParameterError
from ..machine_kinds import NOT_YET, is_maker
from ..made import MadeStructure, Maker, MakerInSI, check_names, made_from, started, value_of
from ..physical import QUANTITIES
from ..scales import in_si
from ..structure import Structure
from ..structure_motion import StructureOrbit
from ..system import System
from .bifurcation import Bifurcation
from .curve import CodimensionTwo
from .motion import PeriodicMotion

# Largest ends of a range: their products and squares must be finite floats.
_WIDEST = 1e100
# The longest step, as part of the ranges: from there it is halved until it fits.
LONGEST_STEP = 1000.0

# Where a continuation starts.
Start = TypeVar("Start", bound=PeriodicMotion | StructureOrbit | Bifurcation | CodimensionTwo)
# Motions, of a System or of a Structure.
MOTIONS = (PeriodicMotion, StructureOrbit)
# Options of all that follow, which may be what is meant by a name that does not vary.
_OPTIONS = ("system", "step", "max_step", "max_points")
Range = tuple[float, float]
Bounds = tuple[Range, Range]


def is_of_structure(given: Any) -> bool:
    """Whether this is a motion of a structure, or a bifurcation of one."""
    return isinstance(given.motion if isinstance(given, Bifurcation) else given, StructureOrbit)


def refuse(name: str, given: Any, allowed: str) -> NoReturn:
    """Refuse what a continuation cannot start from; of a structure say that this is the reason."""
    reject(name, given, f"{allowed}{NOT_YET if is_of_structure(given) else ''}")


def begin(
    start: Start, function: Maker | None, parameters: Mapping[str, Any], units: Any = None
) -> tuple[Start, Mapping[str, Any]]:
    """Return where a continuation starts, and its ranges as pairs.

    Where a ``function`` makes the system, that of the result is a `MadeSystem`, and a range is
    (low, value at the start, high). With ``units="SI"`` the function is the system's own `Machine`,
    which knows the value at the start.

    Raises
    ------
    ParameterError
        If the function, its arguments or its system do not fit.
    """
    motion = start if isinstance(start, MOTIONS) else start.motion
    is_structure = isinstance(motion, StructureOrbit)
    if is_structure and units is not None:
        reject("units", units, "None: a structure has the units of its numbers")
    if in_si(units):
        if function is not None:
            reject("units", units, "None where a function makes the system, in units of its own")
        of_motion: Any = motion.system
        function = MakerInSI(of_motion)
        own = of_motion.to_physical()
        for name in parameters:
            if name not in QUANTITIES:
                raise unknown(name, QUANTITIES, f"what can vary: {', '.join(QUANTITIES)}")
        around = {name: around_motion(own[name]) for name in parameters}
        ends = {name: pair(name, given, around[name]) for name, given in parameters.items()}
        parameters = {name: (low, own[name], high) for name, (low, high) in ends.items()}
    if function is None:
        return start, parameters
    if not is_maker(function):
        kind = "Structure" if is_structure else "System"
        reject("system", function, f"None, or a function that makes a vibroimpact.{kind}")
    check_names(function, [*parameters])
    numbers, sizes, pairs = {}, {}, {}
    for name, given in parameters.items():
        allowed = "a range (low, value at the start, high)"
        low, at, high = triple(name, given, allowed)
        numbers[name] = number(name, at, allowed)
        pairs[name] = (low, high)
        sizes[name] = abs(number(name, high, allowed) - number(name, low, allowed))
    system = started(function, numbers, sizes, motion.system)
    return _with_system(start, motion, system), pairs


def _with_system(start: Start, motion: Any, system: System | Structure) -> Start:
    anew: Any = replace(motion, system=system)
    if not isinstance(start, MOTIONS):
        anew = replace(start, motion=anew)
    begun: Start = anew
    return begun


def one_range(system: System | Structure, parameters: Mapping[str, Any]) -> tuple[str, Range]:
    """Return the name of the one parameter and its range."""
    if len(parameters) != 1:
        given = ", ".join(parameters) or "none"
        raise ParameterError(f"give exactly one parameter with its range, got {given}")
    ((name, bounds),) = parameters.items()
    return name, range_around(system, name, bounds)


def two_ranges(system: System, parameters: Mapping[str, Any]) -> tuple[tuple[str, str], Bounds]:
    """Return the names of the two parameters and their ranges."""
    if len(parameters) != 2:
        given = ", ".join(parameters) or "none"
        raise ParameterError(f"give exactly two parameters with their ranges, got {given}")
    first, second = parameters
    one, other = (range_around(system, name, parameters[name]) for name in (first, second))
    return (first, second), (one, other)


def around_motion(value: float) -> str:
    """Return what is allowed as a range, in words."""
    return f"a range (low, high) around {value!r}, that of the motion"


def range_around(system: System | Structure, name: str, bounds: Any) -> Range:
    """Check a range of a parameter that contains its value."""
    _check_name(system, name)
    value = value_of(system, name)
    allowed = f"{around_motion(value)}, with low < high"
    low, high = pair(name, bounds, allowed)
    low, high = number(name, low, allowed), number(name, high, allowed)
    if not low <= value <= high or low == high:
        reject(name, (low, high), allowed)
    if max(-low, high) > _WIDEST:
        reject(name, (low, high), f"ends from -{_WIDEST:g} to {_WIDEST:g}")
    return low, high


def _check_name(system: System | Structure, name: str) -> None:
    """Refuse what is neither a number of the machine nor one of the function that made it."""
    if isinstance(system, MadeStructure) or made_from(system, [name]) is not None:
        return
    known = system._numbers_by_name
    if name not in known:
        also = f"or with system= an argument of a function that makes the {system._WHAT}"
        rest = f"what can vary: {system._numbers_in_words}, {also}{system._made_as}"
        raise unknown(name, [*known, *_OPTIONS], rest)

"""Checks of arguments; each error names the argument, its value and the allowed range.

The compiled core checks physical ranges. These functions check type, shape and finiteness, so that
no work starts before every argument is known to be usable.
"""

import functools
import inspect
import math
import os
from collections.abc import Callable, Iterable, Mapping, Sequence, Set
from numbers import Integral, Real
from typing import Any, NamedTuple, NoReturn, ParamSpec, TypeVar

import numpy as np
from numpy.typing import NDArray

from ._core import PARAMETERS
from .errors import ParameterError, StateError

# The attribute of a function with the names that its signature has for completion only.
LISTED = "_listed"

Item = TypeVar("Item")
Arguments = ParamSpec("Arguments")

# Every whole number up to here is a float64, so that times of that many periods are distinct.
_MOST = 2**53


class Horizon(NamedTuple):
    """How far a run goes and what it keeps: exactly one of ``periods`` and ``time`` is set."""

    periods: int | None
    time: float | None
    keep: int | None


# Of a longer value an error shows the beginning.
LONGEST = 200


def in_short(value: object) -> str:
    """Return a value as an error shows it: an object of many numbers says what it is."""
    # Asked of the type: an object that gives hints for unknown names would give one here.
    words = getattr(type(value), "_in_short", None)
    text = repr(value) if words is None else words(value)
    return text if len(text) <= LONGEST else f"{text[:LONGEST]} ..."


def reject(name: str, value: object, allowed: str) -> NoReturn:
    """Raise the ParameterError for ``name``; the wording is that of the compiled core."""
    raise ParameterError(f"{name} = {in_short(value)} is not allowed; allowed: {allowed}")


def number(name: str, value: Any, allowed: str = "a finite number") -> float:
    """Return ``value`` as a float, with -0.0 made 0.0 so that equal inputs have equal bits."""
    # Nearly always; the checks below take longer than a short run.
    if type(value) is float and math.isfinite(value):
        return value + 0.0
    scalar = value[()] if isinstance(value, np.ndarray) and value.ndim == 0 else value
    # Python counts a bool as an Integral, but as a parameter it is a mistake.
    if not isinstance(scalar, Real) or isinstance(scalar, bool):
        reject(name, value, allowed)
    try:
        result = float(scalar)
    except OverflowError:
        result = math.inf
    if not math.isfinite(result):
        reject(name, value, allowed)
    return result + 0.0


def positive(name: str, value: Any) -> float:
    """Return ``value`` as a float > 0."""
    allowed = "a finite number > 0"
    result = number(name, value, allowed)
    if result <= 0.0:
        reject(name, value, allowed)
    return result


def not_negative(name: str, value: Any) -> float:
    """Return ``value`` as a float >= 0."""
    allowed = "a finite number >= 0"
    result = number(name, value, allowed)
    if result < 0.0:
        reject(name, value, allowed)
    return result


def count(name: str, value: Any, *, least: int, most: int = _MOST) -> int:
    """Return ``value`` as an int in least ... most; 1e3 and 600.0 are whole numbers, too."""
    allowed = f"an integer >= {least}" if most == _MOST else f"an integer from {least} to {most}"
    whole = isinstance(value, Integral) or (
        isinstance(value, float | np.floating) and bool(np.isfinite(value)) and value == int(value)
    )
    if not whole or isinstance(value, bool):
        reject(name, value, allowed)
    result = int(value)
    if not least <= result <= most:
        reject(name, value, f"an integer from {least} to {most}" if result > most else allowed)
    return result


def pair(name: str, value: Any, allowed: str) -> tuple[Any, Any]:
    """Return the two entries of a pair, which has an order and is no text."""
    if isinstance(value, str | bytes | bytearray | Mapping | Set):
        reject(name, value, allowed)
    try:
        first, second = value
    except (TypeError, ValueError):
        reject(name, value, allowed)
    return first, second


def triple(name: str, value: Any, allowed: str) -> tuple[Any, Any, Any]:
    """Return the three entries of a triple, which has an order and is no text."""
    if isinstance(value, str | bytes | bytearray | Mapping | Set):
        reject(name, value, allowed)
    try:
        first, second, third = value
    except (TypeError, ValueError):
        reject(name, value, allowed)
    return first, second, third


def path(name: str, value: Any, what: str = "the path of a file") -> str:
    """Return a path as text.

    A number is refused: ``open`` would take it for a file descriptor, and close that file.
    """
    allowed = f"{what}, as str or os.PathLike"
    text = os.fspath(value) if isinstance(value, str | os.PathLike) else None
    if not isinstance(text, str) or not text or "\0" in text:
        reject(name, value, allowed)
    return text


def optional_count(name: str, value: Any, *, least: int, most: int = _MOST) -> int | None:
    """Return None for None, else a checked count."""
    return None if value is None else count(name, value, least=least, most=most)


def kept_periods(keep: Any, periods: int, *, usual: int, least: int = 0) -> int:
    """Return how many of ``periods`` are kept: ``usual``, or all of fewer, where None is given."""
    if keep is None:
        return min(usual, periods)
    return count("keep", keep, least=least, most=periods)


# What else people call an argument: the symbols of the theory (M1, omega ...; notation page),
# and names of other packages. Where several are given, the first that the call knows is meant.
_OTHER_NAMES: dict[str, tuple[str, ...]] = {
    **{parameter.symbol: (name,) for name, parameter in PARAMETERS.items()},
    **{"M1": ("pendulum_mass",), "M2": ("oscillator_mass",), "l": ("length",), "L": ("length",)},
    **{"K1": ("torsional_stiffness",), "K2": ("stiffness",), "k": ("stiffness",)},
    **{"C1": ("torsional_damping",), "C2": ("damping",), "c": ("damping",)},
    **{"f10": ("moment_amplitude",), "f20": ("force_amplitude",), "Delta": ("gap",)},
    **{"C10": ("static_moment",), "F20": ("static_force",)},
    **{"Omega": ("drive_frequency",), "frequency": ("drive_frequency",), "e": ("restitution",)},
    **{"M": ("mass",), "K": ("stiffness",), "C": ("damping",), "F": ("drive_amplitude",)},
    **dict.fromkeys(("zeta", "zetas"), ("damping_ratios", "damping", "pendulum_damping")),
    **dict.fromkeys(("x0", "y0", "X0", "state", "start", "initial_state", "ic"), ("initial",)),
    **dict.fromkeys(("duration", "t_end", "tmax", "t_max", "T"), ("time", "periods")),
    **dict.fromkeys(("cycles", "n_periods", "steps"), ("periods",)),
    **dict.fromkeys(("threads", "n_jobs", "cores"), ("workers",)),
    **dict.fromkeys(("tolerance", "tol", "atol"), ("chatter_tolerance",)),
    **{"x": ("x1", "q_0"), "q": ("q_0",), "v": ("v1", "v_0")},
    **{"x1": ("q_0",), "x2": ("q_1",), "v1": ("v_0",), "v2": ("v_1",)},
}


def closest(name: str, known: Iterable[str]) -> str | None:
    """Return the known name that is meant by an unknown one, None if none is close."""
    import difflib  # here, to keep the import of the package light

    names = [*known]
    meant = [other for other in _OTHER_NAMES.get(name, ()) if other in names]
    close = meant or difflib.get_close_matches(name, names, n=1)
    return close[0] if close else None


def close_to(name: str, known: Iterable[str]) -> str:
    """Return a hint for the error about an unknown name: the known name that is meant by it."""
    meant = closest(name, known)
    return f", did you mean {meant}?" if meant else ""


# What the verbs of other packages are called here.
_OTHER_VERBS: dict[str, str] = {
    **dict.fromkeys(("solve", "solve_ivp", "integrate"), "simulate"),
    **dict.fromkeys(("poincare", "poincare_section"), "plot.impact_section or plot.stroboscopic"),
    **dict.fromkeys(("lyapunov", "lyapunov_exponents"), "lyapunov_spectrum"),
    **dict.fromkeys(("basins_of_attraction", "attractors"), "basins"),
    **dict.fromkeys(("follow", "continue_motion"), "follow_motion"),
    **dict.fromkeys(("find_periodic_orbit", "periodic_orbit", "orbit"), "periodic_motion"),
    **dict.fromkeys(("animate", "animation"), "plot.animation, or run.animate()"),
    **dict.fromkeys(("bifurcation", "diagram"), "bifurcation_diagram"),
    **dict.fromkeys(("ImpactOscillator", "Oscillator", "BouncingBall", "Parameters"), "System"),
}


def meant_in_package(name: str, public: Iterable[str]) -> str:
    """Return a hint for the error about a name that the package does not have."""
    if name in _OTHER_VERBS:
        return f", did you mean {_OTHER_VERBS[name]}?"
    return close_to(name, public)


# What attributes of results are called elsewhere; the first that an object has is meant.
_OTHER_ATTRIBUTES: dict[str, tuple[str, ...]] = {
    **dict.fromkeys(("t", "times", "y", "q", "v", "x"), ("trajectory",)),
    "states": ("trajectory", "final_states"),
    **dict.fromkeys(("eigenvalues", "floquet_multipliers"), ("multipliers",)),
    "to_csv": ("to_pandas",),
    "at": ("run",),
    "poincare": ("stroboscopic",),
    "energy": ("energy_audit",),
    **dict.fromkeys(("lyapunov", "lyapunov_exponent"), ("largest_exponent", "largest")),
}
# How they are written, where the name alone does not say it.
_IN_FULL = {"trajectory": "trajectory(times)", "to_pandas": "to_pandas().to_csv(path)"}


def meant_of_object(name: str, known: Iterable[str]) -> str:
    """Return a hint for the error about an attribute that an object does not have."""
    names = [other for other in known if other[:1] != "_"]
    for meant in _OTHER_ATTRIBUTES.get(name, ()):
        if meant in names:
            return f", did you mean {_IN_FULL.get(meant, meant)}?"
    return close_to(name, names)


def unexpected(function: Callable[..., Any], given: Iterable[str]) -> TypeError | None:
    """Return the error about a keyword that a function does not take, None if it takes all."""
    parameters = inspect.signature(function).parameters.values()
    if any(parameter.kind is parameter.VAR_KEYWORD for parameter in parameters):
        return None
    known = [parameter.name for parameter in parameters if parameter.name not in ("self", "cls")]
    called = function.__qualname__.removesuffix(".__init__")
    for name in given:
        if name not in known:
            hint = close_to(name, known) or f"; known: {', '.join(known)}"
            return TypeError(f"{called}() got an unexpected keyword argument {name!r}{hint}")
    return None


def naming(function: Callable[Arguments, Item]) -> Callable[Arguments, Item]:
    """Let the error about an unknown keyword of a function suggest the name that was meant."""

    @functools.wraps(function)
    def checked(*values: Arguments.args, **given: Arguments.kwargs) -> Item:
        try:
            return function(*values, **given)
        except TypeError:
            if (error := unexpected(function, given)) is not None:
                raise error from None
            raise

    return checked


def swept(
    function: Callable[..., Any],
    given: Mapping[str, Any],
    allowed: Sequence[str],
    *,
    exactly: int | None = None,
    shown: str | None = None,
) -> None:
    """Refuse keywords that are neither arguments of a function nor what it can sweep.

    ``exactly`` so many are wanted; None for any number. ``shown`` lists what is allowed in words.
    """
    shown = ", ".join(allowed) if shown is None else shown
    for name in given:
        if name not in allowed:
            # Without the names that its signature has for completion.
            own = inspect.signature(function).parameters.keys() - getattr(function, LISTED, set())
            hint = close_to(name, [*allowed, *own]) or ";"
            raise ParameterError(
                f"unknown argument {name} of {function.__name__}{hint} what can be swept: {shown}"
            )
    if exactly is not None and len(given) != exactly:
        raise ParameterError(
            f"{function.__name__} sweeps exactly {exactly} of {shown}; "
            f"got {', '.join(given) or 'nothing'}"
        )


def flag(name: str, value: Any) -> bool:
    """Return ``value`` if it is True or False."""
    if not isinstance(value, bool | np.bool_):
        reject(name, value, "True or False")
    return bool(value)


def threads(workers: Any) -> int | None:
    """Return a number of threads as an int, or None for all cores."""
    return optional_count("workers", workers, least=1, most=1024)


def several(name: str, given: Any, *kinds: type[Item]) -> list[Item]:
    """Return one object of some kinds, or a sequence of at least one, as a list."""
    one = " or ".join(f"a vibroimpact.{kind.__name__}" for kind in kinds)
    allowed = f"{one} or a sequence of them"
    if isinstance(given, kinds):
        return [given]
    if not isinstance(given, Sequence) or isinstance(given, str) or not given:
        reject(name, given, allowed)
    many: list[Item] = []
    for place, item in enumerate(given):
        if not isinstance(item, kinds):
            reject(f"{name}[{place}]", item, one)
        many.append(item)
    return many


def horizon(drive_frequency: float, *, periods: Any, time: Any, keep: Any) -> Horizon:
    """Check the length of a run: whole drive periods, or a time where there is no period."""
    if (periods is None) == (time is None):
        given = "neither" if periods is None else "both"
        raise ParameterError(f"give exactly one of periods= and time=, got {given}")
    if drive_frequency == 0.0:
        for name, value in (("periods", periods), ("keep", keep)):
            if value is not None:
                reject(name, value, "None for drive_frequency = 0 (no drive period): use time=")
    if periods is None:
        if keep is not None:
            reject("keep", keep, "None together with time=; it counts drive periods")
        return Horizon(None, positive("time", time), None)
    periods = count("periods", periods, least=1)
    return Horizon(periods, None, optional_count("keep", keep, least=0, most=periods))


def as_floats(array: NDArray[Any]) -> NDArray[np.float64]:
    """Return real numbers as float64, with -0.0 made 0.0; infinite where they are beyond it."""
    if array.dtype == np.float64:
        return array + 0.0
    with np.errstate(over="ignore"):
        return array.astype(np.float64) + 0.0


def array_of(
    name: str, given: Any, allowed: str, *, error: type[ValueError] = ParameterError
) -> NDArray[Any]:
    """Return what is given as an array, of any type and shape, but neither ragged nor masked."""

    # The text of the value is made for an error only: to print an array takes longer than to use
    # it.
    def refusal() -> str:
        return f"{name} = {in_short(given)} is not allowed; allowed: {allowed}"

    if isinstance(given, np.ma.MaskedArray) and np.ma.is_masked(given):
        raise error(f"{refusal()}, without a mask")
    try:
        return np.asarray(given)
    except ValueError as ragged:
        raise error(refusal()) from ragged


def states(initial: Any, name: str = "initial") -> NDArray[np.float64]:
    """Return initial states as float64 of shape (4,) or (k, 4), all finite."""
    wanted = "(x1, v1, x2, v2) of shape (4,), or (k, 4) for several"
    array = array_of(name, initial, wanted, error=StateError)
    if array.shape != (4,) and (array.ndim != 2 or array.shape[1] != 4):
        shown = f"{name} of shape {array.shape}" if array.ndim else f"{name} = {initial!r}"
        raise StateError(f"{shown} is not allowed; allowed: {wanted}")
    if array.dtype.kind not in "iuf":
        raise StateError(f"{name} = {initial!r} is not allowed; allowed: finite numbers {wanted}")
    result = as_floats(array)
    finite = np.isfinite(result)
    if not finite.all():
        row = int(np.argmin(finite)) // 4
        bad = tuple(result.reshape(-1, 4)[row].tolist())
        where = "" if result.ndim == 1 else f"[{row}]"
        raise StateError(f"{name}{where} = {bad} is not allowed; allowed: finite numbers")
    return result


def state(initial: Any) -> tuple[float, float, float, float]:
    """Return one initial state as four floats."""
    array = states(initial)
    if array.ndim != 1:
        raise StateError(
            f"initial of shape {array.shape} is not allowed; allowed: (x1, v1, x2, v2)"
        )
    x1, v1, x2, v2 = array.tolist()
    return x1, v1, x2, v2


def starts(initial: Any, count: int) -> NDArray[np.float64]:
    """Return starts of ``count`` coordinates as float64, (2, count) or (k, 2, count), finite."""
    wanted = f"rows q and v of shape (2, {count}), or (k, 2, {count}) for several"
    array = array_of("initial", initial, wanted, error=StateError)
    if array.ndim not in (2, 3) or array.shape[-2:] != (2, count):
        shown = (
            f"initial of shape {array.shape}" if array.ndim else f"initial = {in_short(initial)}"
        )
        turned = ", did you mean its transpose?" if array.shape == (count, 2) else ""
        raise StateError(f"{shown} is not allowed; allowed: {wanted}{turned}")
    if array.dtype.kind not in "iuf":
        raise StateError(f"initial of type {array.dtype} is not allowed; allowed: real numbers")
    result = as_floats(array)
    finite = np.isfinite(result)
    if not finite.all():
        place = tuple(int(i) for i in np.argwhere(~finite)[0])
        where = f"initial[{', '.join(map(str, place))}]"
        raise StateError(f"{where} = {result[place]} is not allowed; allowed: finite numbers")
    return result


def axis(name: str, values: Any) -> NDArray[np.float64]:
    """Return the values of an axis of a grid: a ``vector`` of at least one."""
    result = vector(name, values)
    if not len(result):
        reject(name, values, "an array of at least one number")
    return result


def times_of(name: str, values: Any) -> tuple[NDArray[np.float64], bool]:
    """Return times as a ``vector``, and whether one number was given in place of an array."""
    single = isinstance(values, Real) or (isinstance(values, np.ndarray) and values.ndim == 0)
    if single:
        return np.array([number(name, values)]), True
    return vector(name, values), False


def vector(name: str, values: Any, *, length: int | None = None) -> NDArray[np.float64]:
    """Return ``values`` as a one-dimensional float64 array of finite numbers, so many if told."""
    array = array_of(name, values, "a one-dimensional array of finite numbers")
    if array.ndim != 1:
        got = "" if array.ndim else f", got {values!r}"
        raise ParameterError(
            f"{name} of shape {array.shape} is not allowed; allowed: one dimension{got}"
        )
    _check_shape(name, array, length)
    if array.dtype.kind not in "iuf" and array.size > 0:
        raise ParameterError(f"{name} of type {array.dtype} is not allowed; allowed: real numbers")
    result = as_floats(array)
    _check_finite(name, result)
    return result


def complex_vector(
    name: str, values: Any, *, length: int
) -> NDArray[np.float64] | NDArray[np.complex128]:
    """Return a vector of real or complex numbers; as float64 where all imaginary parts are 0."""
    array = array_of(name, values, "a one-dimensional array of finite numbers, real or complex")
    if array.dtype.kind != "c":
        return vector(name, values, length=length)
    _check_shape(name, array, length)
    real, imaginary = as_floats(array.real), as_floats(array.imag)
    if not imaginary.any():
        _check_finite(name, real)
        return real
    result = np.empty(length, np.complex128)
    result.real, result.imag = real, imaginary
    _check_finite(name, result)
    return result


def matrix(
    name: str, values: Any, *, rows: int | None = None, columns: int | None = None
) -> NDArray[np.float64]:
    """Return ``values`` as a matrix of finite numbers; square where no numbers are told."""
    array = array_of(name, values, "a matrix of finite numbers")
    sides = ["n >= 1" if side is None else str(side) for side in (rows, columns)]
    wanted = f"({', '.join(sides)})"
    fits = array.ndim == 2 and array.size > 0
    if fits and rows is None and columns is None:
        fits = array.shape[0] == array.shape[1]
    elif fits:
        fits = rows in (None, array.shape[0]) and columns in (None, array.shape[1])
    if not fits:
        got = "" if array.ndim else f", got {values!r}"
        raise ParameterError(
            f"{name} of shape {array.shape} is not allowed; allowed: shape {wanted}{got}"
        )
    if array.dtype.kind not in "iuf":
        raise ParameterError(f"{name} of type {array.dtype} is not allowed; allowed: real numbers")
    result = as_floats(array)
    _check_finite(name, result)
    return result


def _check_shape(name: str, array: NDArray[Any], length: int | None) -> None:
    if array.ndim != 1 or length not in (None, len(array)):
        got = "" if array.ndim else f", got {array[()]!r}"
        raise ParameterError(
            f"{name} of shape {array.shape} is not allowed; allowed: shape ({length},){got}"
        )


def _check_finite(name: str, array: NDArray[Any]) -> None:
    finite = np.isfinite(array)
    if not finite.all():
        place = tuple(int(i) for i in np.argwhere(~finite)[0])
        reject(f"{name}[{', '.join(map(str, place))}]", array[place].item(), "a finite number")

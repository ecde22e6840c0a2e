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
from typing import Any, NoReturn, ParamSpec, TypeVar

import numpy as np
from numpy.typing import NDArray

from .errors import ParameterError, StateError
from .hints import close_to

# The attribute of a function with the names that its signature has for completion only.
LISTED = "_listed"

Item = TypeVar("Item")
Arguments = ParamSpec("Arguments")

# Every whole number up to here is a float64, so that times of that many periods are distinct.
_MOST = 2**53


# Of a longer value an error shows the beginning.
LONGEST = 200
# So many values of an axis may be meant.
_MOST_STEPS = 99_999
# Of more rows it does not tell the lengths.
_MOST_ROWS = 8


def in_short(value: object) -> str:
    """Return a value as an error shows it: an object of many numbers says what it is."""
    # Asked of the type: an object that gives hints for unknown names would give one here.
    words = getattr(type(value), "_in_short", None)
    text = repr(value) if words is None else words(value)
    return text if len(text) <= LONGEST else f"{text[:LONGEST]} ..."


def reject(name: str, value: object, allowed: str, *, known: Sequence[str] = ()) -> NoReturn:
    """Raise the ParameterError for ``name``; the wording is that of the compiled core.

    Where one of the ``known`` names is wanted, the error says which was meant.
    """
    hint = close_to(value, known) if known and isinstance(value, str) else ""
    hint = hint or ";"
    raise ParameterError(f"{name} = {in_short(value)} is not allowed{hint} allowed: {allowed}")


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


def parameter(name: str, value: Any, allowed: str = "a finite number") -> float:
    """Return a ``number`` of a machine; several of them are the axis of a sweep."""
    size = value.size if isinstance(value, np.ndarray) else 0
    if size > 1 or (isinstance(value, list | tuple) and len(value) > 1):
        sweeps = f"vibroimpact.bifurcation_diagram(..., {name}=[...]) and other sweeps vary it"
        reject(name, value, f"{allowed}; {sweeps}")
    return number(name, value, allowed)


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
        plain = type(value) is np.ndarray and value.ndim == 1 and value.dtype.kind in "iuf"
        if plain and value.size:
            allowed += f"; of these numbers ({value[0]:g}, {value[-1]:g})"
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


# So many of the names that a function takes are listed where values are given without names.
_LISTED = 4


def unexpected(
    function: Callable[..., Any], values: Sequence[Any], given: Iterable[str]
) -> TypeError | None:
    """Return the error about arguments that a function does not take, None if it takes all.

    It takes too few ``values`` by their place, or does not know a name that is ``given``.
    """
    parameters = inspect.signature(function).parameters.values()
    known = [parameter.name for parameter in parameters if parameter.name not in ("self", "cls")]
    called = function.__qualname__.removesuffix(".__init__")
    kinds = {parameter.kind for parameter in parameters}
    placed = [p.name for p in parameters if p.kind in (p.POSITIONAL_ONLY, p.POSITIONAL_OR_KEYWORD)]
    if len(values) > len(placed) and inspect.Parameter.VAR_POSITIONAL not in kinds:
        own = len(placed) - sum(name in known for name in placed)
        others = [name for name in known if name not in placed]
        names = [f"{name}=" for name in others[:_LISTED]]
        names += ["..."] if len(others) > _LISTED else []
        taken = f"only {', '.join(placed[own:])}" if placed[own:] else "no argument"
        return TypeError(
            f"{called}() takes {taken} without a name, but {len(values) - own} were given so; "
            f"give by name: {', '.join(names)}"
        )
    if inspect.Parameter.VAR_KEYWORD in kinds:
        return None
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
            if (error := unexpected(function, values, given)) is not None:
                raise error from None
            raise

    return checked


def unknown(name: str, known: Iterable[str], rest: str, *, of: str = "") -> ParameterError:
    """Return the error about an argument by a name that is none; ``rest`` says what is allowed."""
    hint = close_to(name, known) or ";"
    return ParameterError(f"unknown argument {name}{of}{hint} {rest}")


def one_value(
    function: str, known: Sequence[str], given: Sequence[tuple[str, Any]], *, also: str = ""
) -> tuple[str, Any]:
    """Return the one of the ``known`` parameters that is given to a function, with its value.

    ``also`` is what an error adds to what is allowed.
    """
    wanted = f"{' or '.join(known)} with its value{also}"
    for name, _ in given:
        if name not in known:
            raise unknown(name, known, f"allowed: {wanted}", of=f" of {function}")
    if len(given) != 1:
        got = ", ".join(f"{name} = {in_short(value)}" for name, value in given) or "nothing"
        raise ParameterError(f"{function} takes exactly one value, got {got}; allowed: {wanted}")
    return given[0]


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
            of, parameters = f" of {function.__name__}", inspect.signature(function).parameters
            listed: set[str] = getattr(function, LISTED, set())
            named = [one for one in parameters.values() if one.kind is one.KEYWORD_ONLY]
            own = [one.name for one in named if one.name not in listed]
            known = [*allowed, *(one for one in parameters if one not in listed)]
            said = f"what can be swept: {shown}; options: {', '.join(own)}"
            raise unknown(name, known, said, of=of)
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
    if hasattr(type(given), "toarray"):  # a sparse matrix, which NumPy takes for one object
        kind = type(given).__name__
        raise error(
            f"{name} of type {kind} is not allowed; allowed: {allowed}: {name}.toarray() gives them"
        )
    try:
        return np.asarray(given)
    except ValueError as ragged:
        raise error(f"{refusal()}{_row_lengths(given)}") from ragged


def _row_lengths(given: Any) -> str:
    """Return what to add about rows of different lengths, such as where a bracket is missing."""
    rows = [len(row) if isinstance(row, Sequence) else 0 for row in given][:_MOST_ROWS]
    if len({*rows}) < 2:
        return ""
    return f"; its rows have {', '.join(str(n) if n else 'no' for n in rows)} entries"


def refuse_kind(name: str, given: Any, *, error: type[ValueError] = ParameterError) -> NoReturn:
    """Refuse what is no array of real numbers: by its first entry that is none, such as text."""
    # Beside one text, NumPy takes all entries for texts.
    for place, entry in np.ndenumerate(np.asarray(given, dtype=object)):
        if not isinstance(entry, Real) or isinstance(entry, bool | np.bool_):
            where = f"{name}[{', '.join(map(str, place))}]" if place else name
            text = isinstance(entry, str)
            shown = in_short(entry.item() if isinstance(entry, np.generic) else entry)
            raise error(
                f"{where} = {shown} is not allowed; allowed: a real number"
                f"{', not text' if text else ''}"
            )
    kind = np.asarray(given).dtype
    raise error(f"{name} of type {kind} is not allowed; allowed: real numbers")


def states(initial: Any, name: str = "initial") -> NDArray[np.float64]:
    """Return initial states as float64 of shape (4,) or (k, 4), all finite."""
    wanted = "(x1, v1, x2, v2) of shape (4,), or (k, 4) for several"
    array = array_of(name, initial, wanted, error=StateError)
    if array.shape != (4,) and (array.ndim != 2 or array.shape[1] != 4):
        shown = f"{name} of shape {array.shape}" if array.ndim else f"{name} = {initial!r}"
        raise StateError(f"{shown} is not allowed; allowed: {wanted}")
    if array.dtype.kind not in "iuf":
        refuse_kind(name, initial, error=StateError)
    result = as_floats(array)
    finite = np.isfinite(result)
    if not finite.all():
        row = int(np.argmin(finite)) // 4
        bad = tuple(result.reshape(-1, 4)[row].tolist())
        where = "" if result.ndim == 1 else f"[{row}]"
        raise StateError(f"{name}{where} = {bad} is not allowed; allowed: finite numbers")
    return result


def state(initial: Any, name: str = "initial") -> tuple[float, float, float, float]:
    """Return one state as four floats."""
    array = states(initial, name)
    if array.ndim != 1:
        raise StateError(f"{name} of shape {array.shape} is not allowed; allowed: (x1, v1, x2, v2)")
    x1, v1, x2, v2 = array.tolist()
    return x1, v1, x2, v2


def starts(initial: Any, count: int, name: str = "initial") -> NDArray[np.float64]:
    """Return starts of ``count`` coordinates as float64, (2, count) or (k, 2, count), finite."""
    wanted = f"rows q and v of shape (2, {count}), or (k, 2, {count}) for several"
    array = array_of(name, initial, wanted, error=StateError)
    if array.ndim not in (2, 3) or array.shape[-2:] != (2, count):
        shown = f"{name} of shape {array.shape}" if array.ndim else f"{name} = {in_short(initial)}"
        turned = ", did you mean its transpose?" if array.shape == (count, 2) else ""
        raise StateError(f"{shown} is not allowed; allowed: {wanted}{turned}")
    if array.dtype.kind not in "iuf":
        refuse_kind(name, initial, error=StateError)
    result = as_floats(array)
    finite = np.isfinite(result)
    if not finite.all():
        place = tuple(int(i) for i in np.argwhere(~finite)[0])
        where = f"{name}[{', '.join(map(str, place))}]"
        raise StateError(f"{where} = {result[place]} is not allowed; allowed: finite numbers")
    return result


def axis(name: str, values: Any) -> NDArray[np.float64]:
    """Return the values of an axis of a grid: a ``vector`` of at least one.

    Two or three numbers in a tuple are refused: where motions are followed they are a range, and
    elsewhere often the first value, the last one and how many.
    """
    if isinstance(values, tuple) and len(values) in (2, 3):
        low, high, *more = (f"{number(name, value):g}" for value in values)
        steps = more[0] if more and 2 <= values[2] == int(values[2]) <= _MOST_STEPS else "200"
        known = f"np.linspace({low}, {high}, {steps}) for a range"
        these = f"[{', '.join((low, high, *more))}] for these {('two', 'three')[len(more)]} values"
        reject(name, values, f"an array of values; {known}, {these}")
    result = vector(name, values)
    if not len(result):
        reject(name, values, "an array of at least one number")
    return result


def times_of(name: str, values: Any) -> tuple[NDArray[np.float64], bool]:
    """Return times as a ``vector``, and whether one number was given in place of an array."""
    single = not isinstance(values, Iterable) or isinstance(values, str | bytes)
    if single or (isinstance(values, np.ndarray) and values.ndim == 0):
        return np.array([number(name, values, "a finite number, or an array of them")]), True
    return vector(name, values), False


def vector(
    name: str, values: Any, *, length: int | None = None, spread: bool = False
) -> NDArray[np.float64]:
    """Return ``values`` as a one-dimensional float64 array of finite numbers, so many if told.

    With ``spread`` one number stands for ``length`` equal ones.
    """
    array = array_of(name, values, "a one-dimensional array of finite numbers")
    if spread and array.ndim == 0 and array.dtype.kind in "iuf" and length is not None:
        array = np.repeat(array, length)
    _check_shape(name, array, length, ", or one number for all" if spread else "")
    if array.dtype.kind not in "iuf" and array.size > 0:
        refuse_kind(name, values)
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
    name: str, values: Any, *, rows: int | None = None, columns: int | None = None, more: str = ""
) -> NDArray[np.float64]:
    """Return ``values`` as a matrix of finite numbers; square where no numbers are told.

    ``more`` ends what an error about the shape allows.
    """
    array = array_of(name, values, "a matrix of finite numbers")
    sides = ["n >= 1" if side is None else str(side) for side in (rows, columns)]
    wanted = f"({', '.join(sides)})"
    if not array.ndim and array.dtype.kind in "iuf" and rows == columns in (None, 1):
        more += f", such as [[{array.item()!r}]]"
    fits = array.ndim == 2 and array.size > 0
    if fits and rows is None and columns is None:
        fits = array.shape[0] == array.shape[1]
    elif fits:
        fits = rows in (None, array.shape[0]) and columns in (None, array.shape[1])
    if not fits:
        if array.ndim == 1 and array.size and rows == columns:
            more += f"; np.diag({name}) has these numbers on its diagonal"
        shown = _shape_of(name, array)
        raise ParameterError(f"{shown} is not allowed; allowed: shape {wanted}{more}")
    if array.dtype.kind not in "iuf":
        refuse_kind(name, values)
    result = as_floats(array)
    _check_finite(name, result)
    return result


def _check_shape(name: str, array: NDArray[Any], length: int | None, more: str = "") -> None:
    if array.ndim != 1 or length not in (None, len(array)):
        wanted = "one dimension" if length is None else f"shape ({length},)"
        if not array.ndim and array.dtype.kind in "iufc":
            entries = [array.item(), *[0] * ((length or 1) - 1)]
            wanted += f", such as {in_short(entries)}"
        raise ParameterError(f"{_shape_of(name, array)} is not allowed; allowed: {wanted}{more}")


def _shape_of(name: str, array: NDArray[Any]) -> str:
    """Return what an error says of an array of another shape; of one number its value."""
    return f"{name} of shape {array.shape}" if array.ndim else f"{name} = {in_short(array.item())}"


def _check_finite(name: str, array: NDArray[Any]) -> None:
    finite = np.isfinite(array)
    if not finite.all():
        place = tuple(int(i) for i in np.argwhere(~finite)[0])
        reject(f"{name}[{', '.join(map(str, place))}]", array[place].item(), "a finite number")

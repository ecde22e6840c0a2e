"""A rigid one-sided stop of a linear structure.

    g = normal . q - gap - amplitude cos(omega t + phase) <= 0

Source: the page on structures; the ranges are those of the compiled core.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, fields
from functools import cached_property
from numbers import Real
from typing import Any, NamedTuple, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _core
from .arguments import naming, not_negative, number, reject, vector
from .by_value import ByValue, fixed
from .errors import ParameterError
from .interruption import interruptible
from .keyword_types import StopChanges, completing
from .showing import Facts, Shown


@interruptible
@dataclass(frozen=True, eq=False, repr=False, init=False)
class Stop(ByValue, Shown):
    """A rigid stop of a structure: contact where normal . q reaches it, apart below.

    Immutable, comparable, hashable, picklable; ``eval(repr(stop)) == stop``. Its units are those of
    its structure.

    Parameters
    ----------
    normal
        Row n of the structure, (N,): the gap closes as n . q grows. A row of one coordinate, or a
        difference of two rows: two bodies that meet.
    gap
        Distance along the normal at q = 0, any finite number.
    restitution
        Coefficient of restitution in [0, 1].
    friction
        Coulomb's coefficient >= 0.
    tangent
        Row t, (N,): t . q' is the velocity of slip, in the same unit of length as normal . q', or
        the coefficient of friction means nothing. Needed with friction > 0.
    amplitude
        Amplitude of the stop's own motion along the normal, amplitude cos(omega t + phase); other
        than 0 only in a structure with ``drive_frequency`` > 0.
    phase
        Phase of this motion at t = 0 in radians. It is not added to the drive's.

    Raises
    ------
    ParameterError
        Names the parameter, its value and what is allowed.

    Examples
    --------
    >>> import vibroimpact as vi
    >>> stop = vi.Stop([0, 1], 0.3, 0.8)
    >>> stop.gap, stop.normal
    (0.3, array([0., 1.]))
    >>> stop == stop.replace(friction=0)
    True
    """

    _WHAT = "stop"

    normal: NDArray[np.float64]
    gap: float
    restitution: float
    friction: float
    tangent: NDArray[np.float64] | None
    amplitude: float
    phase: float

    @naming
    def __init__(
        self,
        normal: ArrayLike,
        gap: float,
        restitution: float,
        *,
        friction: float = 0.0,
        tangent: ArrayLike | None = None,
        amplitude: float = 0.0,
        phase: float = 0.0,
    ) -> None:
        if isinstance(normal, Real):
            # The place of a mass, perhaps.
            reject("normal", normal, "one number for each coordinate, such as [0, 0, 1]")
        row = fixed(vector("normal", normal))
        if not len(row):
            reject("normal", [], "at least one number")
        if tangent is not None:
            tangent = fixed(vector("tangent", tangent))
            if tangent.shape != row.shape:
                raise ParameterError(
                    f"tangent of shape {tangent.shape} is not allowed; "
                    f"allowed: shape {row.shape}, that of normal"
                )
        values: dict[str, Any] = {
            "normal": row,
            "gap": number("gap", gap),
            "restitution": number("restitution", restitution, "a number in [0, 1]"),
            "friction": not_negative("friction", friction),
            "tangent": tangent,
            "amplitude": number("amplitude", amplitude),
            "phase": number("phase", phase),
        }
        if tangent is None and values["friction"] > 0.0:
            reject("tangent", None, "a row, with friction > 0: the slip is along it")
        for name, value in values.items():
            object.__setattr__(self, name, value)
        self._compiled  # noqa: B018  builds the compiled form, which checks the ranges

    @cached_property
    def _compiled(self) -> _core.Stop:
        return self._with_rows(self.normal, self.tangent)

    def _with_rows(
        self, normal: NDArray[np.float64], tangent: NDArray[np.float64] | None
    ) -> _core.Stop:
        """Return the compiled form, with rows in the coordinates of the compiled structure."""
        return _core.Stop(
            normal,
            self.gap,
            self.restitution,
            friction=self.friction,
            tangent=tangent,
            amplitude=self.amplitude,
            phase=self.phase,
        )

    @completing(StopChanges)
    def replace(self, **changes: Any) -> Self:
        """Return a stop with some parameters changed.

        Parameters
        ----------
        **changes
            New values by name.

        Raises
        ------
        ParameterError
            Names the parameter, its value and what is allowed.

        Examples
        --------
        >>> stop.replace(gap=0.5).gap
        0.5
        """
        return type(self)(**(self._fields() | changes))

    def _fields(self) -> dict[str, Any]:
        found = {name: getattr(self, name) for name in _NAMES}
        return {name: value for name, value in found.items() if value is not None}

    def _facts(self) -> Facts:
        return dict(self.to_dict())

    def _line(self) -> str:
        """Return the numbers of a stop in words, but for its rows."""
        shown = {name: getattr(self, name) for name in ("gap", "restitution", "friction")}
        shown |= {"amplitude": self.amplitude} if self.amplitude else {}
        return ", ".join(f"{name} = {value:.6g}" for name, value in shown.items())


# Numbers of the drive of a structure that vary by name.
OF_DRIVE = ("drive_frequency", "phase")
# What is changed in all stops of a structure by its name, and in one as name_number.
OF_STOPS = ("gap", "restitution", "friction")
_OF_ONE = re.compile(rf"({'|'.join(OF_STOPS)})_(0|[1-9]\d*)")
_NUMBERED = re.compile(r"(.+)_(0|[1-9]\d*)")
# Of more stops a message names the first and the last.
_MOST_LISTED = 2
_NAMES = tuple(entry.name for entry in fields(Stop))


class Numbered(NamedTuple):
    """What a name with a number means, such as ``gap_0`` or ``v_pre_1``."""

    what: str
    place: int


def numbered(name: str) -> Numbered | None:
    """Return what a name with a number means, None of one without."""
    match = _NUMBERED.fullmatch(name)
    return Numbered(match[1], int(match[2])) if match else None


def numbers_by_name(stops: int) -> tuple[str, ...]:
    """Return the names of what varies in a structure: of its drive, of all stops, of each."""
    of_one = (f"{name}_{stop}" for stop in range(stops) for name in OF_STOPS)
    return (*OF_DRIVE, *OF_STOPS, *of_one)


def numbers_in_words(stops: int) -> str:
    """Return the same for a message: there may be many stops."""
    names = [*OF_DRIVE, *OF_STOPS]
    for name in OF_STOPS:
        if stops <= _MOST_LISTED:
            names += [f"{name}_{stop}" for stop in range(stops)]
        else:
            names.append(f"{name}_0 ... {name}_{stops - 1}")
    return ", ".join(names)


def is_of_stops(name: str) -> bool:
    """Whether a name is that of a number of all stops, or of one, such as ``gap_0``."""
    return name in OF_STOPS or _OF_ONE.fullmatch(name) is not None


def _numbers_of(stops: Sequence[Stop]) -> str:
    """Return in words which numbers stops have in names."""
    return f"the number of a stop, 0 to {len(stops) - 1}" if stops else "none: there are no stops"


def value_of_stops(stops: Sequence[Stop], name: str) -> float:
    """Return the number of one stop, or that of all.

    Raises
    ------
    ParameterError
        If there is no such stop, or they differ in it.
    """
    if match := _OF_ONE.fullmatch(name):
        if int(match[2]) >= len(stops):
            reject("parameter", name, _numbers_of(stops))
        one: float = getattr(stops[int(match[2])], match[1])
        return one
    found: set[float] = {getattr(stop, name) for stop in stops}
    if len(found) != 1:
        reject("parameter", name, f"that of one stop, as {name}_0: the stops differ in it")
    return found.pop()


def with_changes(stops: Sequence[Stop], changes: Mapping[str, Any]) -> list[Stop]:
    """Return stops with numbers of all changed, and then numbers of one.

    Raises
    ------
    ParameterError
        If there is no such stop, or a value is not allowed.
    """
    of_all = {name: value for name, value in changes.items() if name in OF_STOPS}
    changed = [dict(of_all) for _ in stops]
    for name, value in changes.items():
        if match := _OF_ONE.fullmatch(name):
            if int(match[2]) >= len(stops):
                reject(name, value, _numbers_of(stops))
            changed[int(match[2])][match[1]] = value
    if of_all and not stops:
        name, value = of_all.popitem()
        reject(name, value, "no such number: the structure has no stops")
    result = []
    for place, (stop, new) in enumerate(zip(stops, changed, strict=True)):
        with _naming(place):
            result.append(stop.replace(**new))
    return result


def from_dicts(stops: Any) -> Any:
    """Return stops from their dicts; what is none is left as it is."""
    if isinstance(stops, str) or not isinstance(stops, Sequence):
        return stops
    result = []
    for place, stop in enumerate(stops):
        with _naming(place):
            result.append(Stop.from_dict(stop) if isinstance(stop, Mapping) else stop)
    return result


def checked_stops(stops: Any, count: int | None = None) -> tuple[Stop, ...]:
    """Return one or several stops as a tuple; with ``count``, of rows with so many entries.

    Raises
    ------
    ParameterError
        Names what is no stop, or has other rows.
    """
    if isinstance(stops, Stop):
        stops = [stops]
    if not isinstance(stops, Sequence) or isinstance(stops, str | bytes):
        reject("stops", stops, "a vibroimpact.Stop or a sequence of them")
    for place, stop in enumerate(stops):
        if not isinstance(stop, Stop):
            reject(f"stops[{place}]", stop, "a vibroimpact.Stop")
        if count is not None and len(stop.normal) != count:
            raise ParameterError(
                f"stops[{place}].normal of shape {stop.normal.shape} is not allowed; "
                f"allowed: shape ({count},)"
            )
    return tuple(stops)


@contextmanager
def _naming(place: int) -> Iterator[None]:
    """Let errors about a stop say which it is."""
    try:
        yield
    except ParameterError as error:
        raise ParameterError(f"stops[{place}].{error}") from error


# Digits of a number below the line.
SUBSCRIPTS = str.maketrans("0123456789", "₀₁₂₃₄₅₆₇₈₉")


def row_words(row: NDArray[np.float64]) -> str:
    """Return a row of a stop in words, such as q₀ + q₁; or that it is one of many coordinates."""
    terms = np.flatnonzero(row).tolist()
    if len(terms) > 3:
        return f"a sum of {len(terms)} coordinates"
    text = ""
    for i in terms:
        size = abs(float(row[i]))
        sign = "\N{MINUS SIGN}" if row[i] < 0.0 else "+" if text else ""
        sign = f" {sign} " if text else sign
        factor = "" if size == 1.0 else f"{size:.3g} "
        text += f"{sign}{factor}q{str(i).translate(SUBSCRIPTS)}"
    return text

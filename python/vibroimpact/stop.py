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
from .arguments import naming, not_negative, parameter, reject, vector
from .by_value import ByValue, fixed
from .errors import ParameterError
from .interruption import interruptible
from .keyword_types import StopChanges, completing
from .restitution import (
    OF_POWER_LAWS,
    OF_TABLES,
    HasRestitution,
    Restitution,
    RestitutionCurve,
    names_of_curve,
    restitution_of,
)
from .showing import Facts, Shown


@interruptible
@dataclass(frozen=True, eq=False, repr=False, init=False)
class Stop(HasRestitution, ByValue, Shown):
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
        Coefficient of restitution in [0, 1]; or a ``RestitutionTable`` or ``RestitutionPowerLaw``,
        where it depends on the approach velocity, in the structure's units.
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
    restitution: Any  # a float, or a curve
    friction: float
    tangent: NDArray[np.float64] | None
    amplitude: float
    phase: float

    @naming
    def __init__(
        self,
        normal: ArrayLike,
        gap: float,
        restitution: Restitution,
        *,
        friction: float = 0.0,
        tangent: ArrayLike | None = None,
        amplitude: float = 0.0,
        phase: float = 0.0,
    ) -> None:
        if isinstance(normal, Real | str):
            # The place of a mass, perhaps, or its name.
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
            "gap": parameter("gap", gap),
            "restitution": restitution_of(restitution),
            "friction": not_negative("friction", friction),
            "tangent": tangent,
            "amplitude": parameter("amplitude", amplitude),
            "phase": parameter("phase", phase),
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
        curve = self.restitution if isinstance(self.restitution, RestitutionCurve) else None
        return _core.Stop(
            normal,
            self.gap,
            self.restitution if curve is None else curve(0.0),
            curve=None if curve is None else curve._compiled,
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
        fields = self._fields()
        self._take_curve(fields, changes)
        return type(self)(**(fields | changes))

    def _fields(self) -> dict[str, Any]:
        found = {name: getattr(self, name) for name in _NAMES}
        return {name: value for name, value in found.items() if value is not None}

    def _facts(self) -> Facts:
        return dict(self.to_dict())

    def _line(self) -> str:
        """Return the numbers of a stop in words, but for its rows."""
        shown = {name: getattr(self, name) for name in varied_in(self.restitution)}
        shown |= {"amplitude": self.amplitude} if self.amplitude else {}
        return ", ".join(f"{name} = {value:.6g}" for name, value in shown.items())


# Numbers of the drive of a structure that vary by name.
OF_DRIVE = ("drive_frequency", "phase")
# What is changed in all stops of a structure by its name, and in one as name_number.
OF_STOPS = ("gap", "restitution", "friction")
# The same with the numbers of curves of restitution, of the stops that have them.
_OF_SOME = (*OF_STOPS, *OF_TABLES, *OF_POWER_LAWS)
_OF_ONE = re.compile(rf"({'|'.join(_OF_SOME)})_(0|[1-9]\d*)")
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


def of_one_stop(name: str) -> Numbered | None:
    """Return what the name of a number of one stop means, such as ``gap_0``, None of another."""
    match = _OF_ONE.fullmatch(name)
    return Numbered(match[1], int(match[2])) if match else None


def varied_in(restitution: Any) -> tuple[str, ...]:
    """Return what varies in a stop with this restitution, perhaps none yet, or a curve's fields."""
    if isinstance(restitution, Mapping):
        restitution = restitution_of(restitution)
    gap, number_of, friction = OF_STOPS
    return (gap, *(names_of_curve(restitution) or (number_of,)), friction)


def _varied_in_all(restitutions: Sequence[Any]) -> dict[str, list[int]]:
    """Return what varies in stops, with those that have it; not a number where some have none."""
    found: dict[str, list[int]] = {name: [] for name in OF_STOPS}
    for place, restitution in enumerate(restitutions):
        for name in varied_in(restitution):
            found.setdefault(name, []).append(place)
    return found


def _of_all(found: Mapping[str, Sequence[int]], stops: int) -> list[str]:
    """Return the names without a number: ``restitution`` only where no stop has a curve."""
    return [name for name in found if name not in OF_STOPS or len(found[name]) == stops]


def numbers_by_name(restitutions: Sequence[Any]) -> tuple[str, ...]:
    """Return the names of what varies in a structure: of its drive, of all stops, of each."""
    found = _varied_in_all(restitutions)
    of_one = (f"{name}_{i}" for i, each in enumerate(restitutions) for name in varied_in(each))
    return (*OF_DRIVE, *_of_all(found, len(restitutions)), *of_one)


def numbers_in_words(restitutions: Sequence[Any]) -> str:
    """Return the same for a message: there may be many stops."""
    found = _varied_in_all(restitutions)
    names = [*OF_DRIVE, *_of_all(found, len(restitutions))]
    for name, places in found.items():
        if len(places) <= _MOST_LISTED:
            names += [f"{name}_{stop}" for stop in places]
        else:
            names.append(f"{name}_{places[0]} ... {name}_{places[-1]}")
    return ", ".join(names)


def is_of_stops(name: str) -> bool:
    """Whether a name is that of a number of all stops, or of one, such as ``gap_0``."""
    return name in _OF_SOME or of_one_stop(name) is not None


def _numbers_of(stops: Sequence[Stop]) -> str:
    """Return in words which numbers stops have in names."""
    return f"the number of a stop, 0 to {len(stops) - 1}" if stops else "none: there are no stops"


def _having(stops: Sequence[Stop], name: str, value: Any) -> dict[int, str]:
    """Return the places of the stops whose number has this name, and what they call it.

    Raises
    ------
    ParameterError
        If there is no such stop, or none with such a number, with the value that is refused.
    """
    one = of_one_stop(name)
    what, places = (one.what, [one.place]) if one else (name, [*range(len(stops))])
    if one and one.place >= len(stops):
        reject(name, value, _numbers_of(stops))
    if what in OF_STOPS:
        return dict.fromkeys(places, what)
    found = {place: what for place in places if what in stops[place]._of_curve}
    if not found:
        reject(name, value, "that of a stop whose restitution is a curve with this number")
    return found


def value_of_stops(stops: Sequence[Stop], name: str) -> float:
    """Return the number of one stop, or that of all.

    Raises
    ------
    ParameterError
        If there is no such stop, or they differ in it.
    """
    try:
        having = _having(stops, name, None)
    except ParameterError:
        reject("parameter", name, _numbers_of(stops))
    found: list[float] = [getattr(stops[place], what) for place, what in having.items()]
    if not found:
        reject("parameter", name, _numbers_of(stops))
    if len({*found}) > 1:
        between = ", " if len(having) == _MOST_LISTED else " ... "
        ends = between.join(f"{name}_{place}" for place in (min(having), max(having)))
        alike = f"one value of all, as replace({name}={found[0]:g}) makes it"
        reject(f"{name} of all stops", found, f"{alike}; of one stop say {ends}")
    return found[0]


def with_changes(stops: Sequence[Stop], changes: Mapping[str, Any]) -> list[Stop]:
    """Return stops with numbers of all changed, and then numbers of one.

    Raises
    ------
    ParameterError
        If there is no such stop, or a value is not allowed.
    """
    changed: list[dict[str, Any]] = [{} for _ in stops]
    # Those of all first.
    for name in sorted(changes, key=lambda name: name not in _OF_SOME):
        value = changes[name]
        if name in OF_STOPS and not stops:
            reject(name, value, "no such number: the structure has no stops")
        for place, what in _having(stops, name, value).items():
            changed[place][what] = value
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
            reject(f"stops[{place}]", stop, "a vibroimpact.Stop(normal, gap, restitution)")
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

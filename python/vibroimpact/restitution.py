"""Coefficients of restitution that depend on the approach velocity u (theory page, section 4).

A table is linear in u between its knots, a power law falls as u^(-p) above a least speed. Both are
constant below, where chatter is completed. The formulas are those of the compiled core.
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _core
from .arguments import array_of, as_floats, number, reject, vector
from .by_value import ByValue, fixed
from .errors import ParameterError
from .interruption import interruptible
from .showing import Facts, Shown

Array = NDArray[np.float64]
#: The names of the numbers of tables, which have 16 knots at most, and of power laws.
_KNOTS = range(16)
OF_VALUES, OF_SPEEDS = (tuple(f"{what}_{i}" for i in _KNOTS) for what in ("r", "speed"))
OF_TABLES = (*OF_VALUES, *OF_SPEEDS)
OF_POWER_LAWS = ("r_low", "least_speed", "exponent")
#: What they are, in words.
MEANINGS = {
    **{name: f"restitution at knot {i}" for i, name in enumerate(OF_VALUES)},
    **{name: f"speed of knot {i}" for i, name in enumerate(OF_SPEEDS)},
    "r_low": "restitution of slow impacts",
    "least_speed": "speed from which it falls",
    "exponent": "exponent of its fall",
}


@interruptible
class RestitutionCurve(ByValue, Shown):
    """A coefficient of restitution r(u): `RestitutionTable` or `RestitutionPowerLaw`."""

    @property
    @abstractmethod
    def _compiled(self) -> _core.RestitutionCurve:
        """The compiled form."""

    @property
    def names(self) -> tuple[str, ...]:
        """The names of its numbers, by which a run is differentiated and a system varied.

        Examples
        --------
        >>> import vibroimpact as vi
        >>> vi.RestitutionPowerLaw(0.9, 0.01).names
        ('r_low', 'least_speed', 'exponent')
        """
        return tuple(self._compiled.names)

    def __call__(self, u: ArrayLike) -> Any:
        """Return r at approach velocities.

        Parameters
        ----------
        u
            Finite numbers >= 0 of any shape, in the unit of the knots.

        Returns
        -------
        array of the same shape; a number for a number

        Raises
        ------
        ParameterError
            For another value.

        Examples
        --------
        >>> import vibroimpact as vi
        >>> vi.RestitutionTable([0.1, 1.0], [0.9, 0.6])([0.05, 0.55, 2.0])
        array([0.9 , 0.75, 0.6 ])
        """
        allowed = "finite numbers >= 0"
        given = array_of("u", u, allowed)
        if given.dtype.kind not in "iuf":
            reject("u", u, allowed)
        speeds = as_floats(given)
        if not (np.isfinite(speeds) & (speeds >= 0.0)).all():
            reject("u", u, allowed)
        r = self._compiled.at(speeds.ravel())
        return r.reshape(speeds.shape) if speeds.ndim else r.item()

    def _facts(self) -> Facts:
        return dict(self.to_dict())

    @abstractmethod
    def _with(self, numbers: Mapping[str, Any]) -> Self:
        """Return the curve with some of its `names` changed."""

    @abstractmethod
    def _in_units(self, speed: float) -> Self:
        """Return the curve of speeds that are `speed` times as large."""


@interruptible
@dataclass(frozen=True, eq=False, repr=False, init=False)
class RestitutionTable(RestitutionCurve):
    """A coefficient of restitution from a table: linear between knots, constant beyond its ends.

    Immutable, comparable, hashable, picklable. Its values have the names ``r_0``, ``r_1`` ..., its
    speeds ``speed_0``, ``speed_1`` ... in ``run.sensitivity``, ``system.replace`` and wherever a
    system is varied by name.

    Parameters
    ----------
    speeds
        Approach velocities u of 2 to 16 knots, positive and increasing, shape (k,). Dimensionless
        in a ``System``; in m/s in ``System.from_physical``.
    values
        r there, numbers in (0, 1], shape (k,). Below the first speed r is ``values[0]``, above the
        last ``values[-1]``.

    Raises
    ------
    ParameterError
        Names the entry, its value and what is allowed.

    Examples
    --------
    >>> import vibroimpact as vi
    >>> table = vi.RestitutionTable([0.1, 1.0], [0.9, 0.6])
    >>> table.names, round(table(0.4), 12)
    (('r_0', 'r_1', 'speed_0', 'speed_1'), 0.8)
    >>> system = vi.System(mass_ratio=0.6, frequency_ratio=2, restitution=table, gap=0.5,
    ...                    drive_frequency=1.8, moment_amplitude=1)
    >>> system.replace(r_1=0.5).restitution
    RestitutionTable(speeds=[0.1, 1.0], values=[0.9, 0.5])
    """

    _WHAT = "restitution table"

    speeds: Array
    values: Array

    def __init__(self, speeds: ArrayLike, values: ArrayLike) -> None:
        object.__setattr__(self, "speeds", fixed(vector("speeds", speeds)))
        object.__setattr__(self, "values", fixed(vector("values", values)))
        self._compiled  # noqa: B018  builds the compiled form, which checks the ranges

    @cached_property
    def _compiled(self) -> _core.RestitutionCurve:
        return _core.RestitutionCurve.table(self.speeds, self.values)

    def _fields(self) -> dict[str, Any]:
        return {"speeds": self.speeds, "values": self.values}

    def _with(self, numbers: Mapping[str, Any]) -> Self:
        count = len(self.values)
        entries = np.concatenate([self.values, self.speeds])
        for name, value in numbers.items():
            place = self.names.index(name)
            allowed = "a number in (0, 1]" if place < count else "a finite number > 0"
            entries[place] = number(name, value, allowed)
            if not 0.0 < entries[place] <= (1.0 if place < count else np.inf):
                reject(name, value, allowed)
        return type(self)(entries[count:], entries[:count])

    def _in_units(self, speed: float) -> Self:
        return type(self)(self.speeds * speed, self.values)


@interruptible
@dataclass(frozen=True, eq=False, repr=False, init=False)
class RestitutionPowerLaw(RestitutionCurve):
    """A coefficient of restitution that falls as a power of the approach velocity u.

        r = r_low for u <= least_speed,    r_low (u/least_speed)^(-exponent) above

    The exponent 1/4 is that of contacts that yield (Johnson, Contact Mechanics (1985), section
    11.5); then ``least_speed`` is the velocity of first yield. Immutable, comparable, hashable,
    picklable; its numbers vary by their names.

    Parameters
    ----------
    r_low
        r of the lowest impacts, in (0, 1].
    least_speed
        u up to which r is constant, > 0. Dimensionless in a ``System``; in m/s in
        ``System.from_physical``.
    exponent
        In (0, 1).

    Raises
    ------
    ParameterError
        Names the number, its value and what is allowed.

    Examples
    --------
    >>> import vibroimpact as vi
    >>> law = vi.RestitutionPowerLaw(0.9, 0.01)
    >>> law(0.005), round(law(0.16), 12)
    (0.9, 0.45)
    """

    _WHAT = "restitution law"

    r_low: float
    least_speed: float
    exponent: float

    def __init__(self, r_low: float, least_speed: float, exponent: float = 0.25) -> None:
        object.__setattr__(self, "r_low", number("r_low", r_low, "a number in (0, 1]"))
        speed = number("least_speed", least_speed, "a finite number > 0")
        object.__setattr__(self, "least_speed", speed)
        object.__setattr__(self, "exponent", number("exponent", exponent, "a number in (0, 1)"))
        self._compiled  # noqa: B018  builds the compiled form, which checks the ranges

    @cached_property
    def _compiled(self) -> _core.RestitutionCurve:
        return _core.RestitutionCurve.power_law(self.r_low, self.least_speed, self.exponent)

    def _fields(self) -> dict[str, Any]:
        return {name: getattr(self, name) for name in OF_POWER_LAWS}

    def _with(self, numbers: Mapping[str, Any]) -> Self:
        return type(self)(**(self._fields() | dict(numbers)))

    def _in_units(self, speed: float) -> Self:
        return type(self)(self.r_low, self.least_speed * speed, self.exponent)


Restitution = float | RestitutionTable | RestitutionPowerLaw
_ALLOWED = "a restitution curve, or a number in [0, 1]"
# From here on a number may be meant in per cent.
_PER_CENT = 5.0


def restitution_of(given: Any) -> Restitution:
    """Return a coefficient of restitution from a number, a curve, or a mapping of its fields."""
    if isinstance(given, RestitutionTable | RestitutionPowerLaw):
        return given
    if isinstance(given, Mapping):
        kind = RestitutionTable if {"speeds", "values"} & {*given} else RestitutionPowerLaw
        return kind.from_dict(given)
    value = number("restitution", given, _ALLOWED)
    if _PER_CENT <= value <= 100.0:
        reject("restitution", value, f"{_ALLOWED}; {value:g} per cent are {0.01 * value:g}")
    return value


class HasRestitution:
    """What has a coefficient of restitution: the numbers of a curve are attributes, and vary."""

    restitution: Any  # a float, or a curve

    if not TYPE_CHECKING:

        def __getattr__(self, name: str) -> Any:
            """Return a number of the restitution curve."""
            curve = self.__dict__.get("restitution")
            if isinstance(curve, RestitutionCurve) and name in curve.names:
                return curve._compiled.get(name)
            return super().__getattr__(name)

    @property
    def _of_curve(self) -> tuple[str, ...]:
        return names_of_curve(self.restitution)

    def _take_curve(self, fields: dict[str, Any], changes: dict[str, Any]) -> None:
        """Make changes of numbers of the curve one of the restitution among the fields."""
        if own := {name: changes.pop(name) for name in self._of_curve if name in changes}:
            if "restitution" in changes:
                name, value = next(iter(own.items()))
                reject(name, value, "a number of the present curve, or another restitution=")
            fields["restitution"] = self.restitution._with(own)


def names_of_curve(restitution: Any) -> tuple[str, ...]:
    """Return the names of the numbers of a curve, none of a number."""
    return restitution.names if isinstance(restitution, RestitutionCurve) else ()


def knots_of(machine: Any) -> list[NDArray[np.float64]]:
    """Return the speeds at which the slope of the restitution jumps, of each contact."""
    contacts = getattr(machine, "stops", (machine,))
    return [_knots(contact.restitution) for contact in contacts]


def _knots(restitution: Any) -> NDArray[np.float64]:
    if isinstance(restitution, RestitutionTable):
        return np.asarray(restitution.speeds)
    least = [restitution.least_speed] if isinstance(restitution, RestitutionPowerLaw) else []
    return np.array(least, dtype=np.float64)


def is_alike(one: Any, other: Any) -> bool:
    """Whether two coefficients have the same numbers by name."""
    return names_of_curve(one) == names_of_curve(other)


def constant(restitution: Restitution, what: str) -> float:
    """Return a coefficient of restitution that is a number, as some parts need it.

    Raises
    ------
    ParameterError
        For one that depends on the approach velocity, with what needs a number.
    """
    if isinstance(restitution, RestitutionCurve):
        raise ParameterError(
            f"restitution = {restitution!r} is not allowed; allowed: a number, for {what}"
        )
    return restitution


def need_constants(machine: Any, what: str) -> None:
    """Refuse a system, or a structure, whose restitution depends on the approach velocity.

    Raises
    ------
    ParameterError
        As `constant`.
    """
    for each in getattr(machine, "stops", (machine,)):
        constant(each.restitution, what)


def is_one(restitution: Restitution) -> bool:
    """Whether no impact loses energy by restitution."""
    if isinstance(restitution, RestitutionTable):
        return bool((restitution.values == 1.0).all())
    return restitution == 1.0


def in_units(restitution: Restitution, speed: float) -> Restitution:
    """Return a coefficient of restitution whose speeds are `speed` times as large."""
    if isinstance(restitution, RestitutionTable | RestitutionPowerLaw):
        return restitution._in_units(speed)
    return restitution

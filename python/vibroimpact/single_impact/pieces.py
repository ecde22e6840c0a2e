"""Smooth pieces of a coefficient of restitution r(u), each over a coordinate s of its own.

    table       s = u           r linear in s,  1/u = 1/s
    power law   s = ln(u/u0)    r = r0 e^{-p s}, 1/u = e^{-s}/u0

In these coordinates both are smooth beyond the ends of the piece as well, and the search of
`curved` is over x1 and s. Where r is constant, no coordinate is needed.
"""

import math
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from ..restitution import RestitutionCurve, RestitutionPowerLaw, RestitutionTable
from .intervals import Interval

Array = NDArray[np.float64]

# Approach velocities beyond the larger of 1 and u0 times this are searched in one piece, if r is
# below this part of that of slow impacts; but e^s must not overflow.
_FAST, _PLASTIC, _GREATEST = 1e6, 1e-2, 600.0
# An approach velocity this near to a knot, relative to it, may lie on either side.
_AT_KNOT = 1e-10


@dataclass(frozen=True)
class Speeds:
    """rho = r/(1 + r) and 1/u over boxes of s, and their derivatives by s."""

    rho: Interval
    rho_slope: Interval
    inverse: Interval
    inverse_slope: Interval


@dataclass(frozen=True)
class Level:
    """A range of approach velocities in which r is constant."""

    r: float
    lo: float
    hi: float

    def side(self, u: float) -> int:
        """Return 1 for an approach velocity in it, -1 for one outside, 0 for one at an end."""
        if any(math.isclose(u, end, rel_tol=_AT_KNOT) for end in (self.lo, self.hi)):
            return 0
        return 1 if self.lo < u < self.hi else -1

    def misses(self, u: Interval) -> bool:
        """Whether none of these approach velocities, shape (1,), is in it."""
        return bool(u.hi[0] < self.lo or u.lo[0] > self.hi)


@dataclass(frozen=True)
class Linear:
    """A piece of a table, s = u."""

    low: tuple[float, float]
    high: tuple[float, float]

    @property
    def ends(self) -> tuple[float, float]:
        """The range of s."""
        return self.low[0], self.high[0]

    def at(self, s: Interval) -> Speeds:
        """Enclose rho and 1/u."""
        (speed, r), (faster, other) = self.low, self.high
        slope = (Interval(other) - r) / (Interval(faster) - speed)
        part = 1.0 / (1.0 + (slope * (s - speed) + r))
        inverse = 1.0 / s
        return Speeds(1.0 - part, part.square() * slope, inverse, -inverse.square())

    def speed(self, s: Array) -> Array:
        """Return u."""
        return s


@dataclass(frozen=True)
class Power:
    """The falling part of a power law, s = ln(u/u0)."""

    law: RestitutionPowerLaw

    @property
    def ends(self) -> tuple[float, float]:
        """The range of s that is searched; faster impacts are those of `beyond`."""
        fast = np.log(_FAST * max(1.0, 1.0 / self.law.least_speed))
        return 0.0, float(min(max(fast, -np.log(_PLASTIC) / self.law.exponent), _GREATEST))

    def at(self, s: Interval) -> Speeds:
        """Enclose rho and 1/u."""
        r = self.law.r_low * (-(s * self.law.exponent)).exp()
        part = 1.0 / (1.0 + r)
        inverse = (-s).exp() / self.law.least_speed
        return Speeds(1.0 - part, -(part.square() * r * self.law.exponent), inverse, -inverse)

    def beyond(self) -> Speeds:
        """Enclose rho and 1/u at all greater s."""
        last = self.at(Interval(np.array([self.ends[1]])))
        nothing = Interval(np.zeros(1))
        return Speeds(
            Interval(np.zeros(1), last.rho.hi),
            nothing,
            Interval(np.zeros(1), last.inverse.hi),
            nothing,
        )

    def speed(self, s: Array) -> Array:
        """Return u."""
        return np.asarray(self.law.least_speed * np.exp(s))


Slope = Linear | Power


def pieces_of(curve: RestitutionCurve) -> tuple[list[Level], list[Slope]]:
    """Return the pieces of a curve: those where r is constant, and the others."""
    if isinstance(curve, RestitutionPowerLaw):
        return [Level(curve.r_low, -np.inf, curve.least_speed)], [Power(curve)]
    assert isinstance(curve, RestitutionTable)
    knots = list(zip(curve.speeds.tolist(), curve.values.tolist(), strict=True))
    levels = [Level(knots[0][1], -np.inf, knots[0][0])]
    slopes: list[Slope] = []
    for low, high in pairwise(knots):
        if low[1] != high[1]:
            slopes.append(Linear(low, high))
            levels.append(Level(high[1], high[0], high[0]))
        else:
            levels[-1] = Level(low[1], levels[-1].lo, high[0])
    levels[-1] = Level(levels[-1].r, levels[-1].lo, np.inf)
    return [level for level in levels if level.lo < level.hi], slopes

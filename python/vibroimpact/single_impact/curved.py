"""Period n-1 motions without friction whose restitution depends on the approach velocity u.

The conditions are those of `algebraic`, with rho = r(u)/(1 + r(u)), in the two unknowns x1 and u.
D and the numerators N of Cramer's rule are of first degree in rho, and the numerator M of P is free
of it, so that

    F = Nc^2 + Ns^2 - D^2 = 0,    G = D - omega l (1 - rho) M/u = 0

with the lever l = mbar + kappa^2, of a wall l = kappa (kappa times the impulse takes P's place).
G is Newton's law (1 + r) u = omega (mbar + kappa^2) P. Each smooth piece of r(u) is searched in a
coordinate s of its own (`pieces`).
"""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ..restitution import RestitutionCurve
from ..system import System
from .algebraic import Conditions, Parameters, Quadratic, columns, conditions, cross
from .intervals import Interval
from .pieces import Slope, Speeds
from .plane import Box, Pair
from .starts import State

Array = NDArray[np.float64]


def _line(start: Quadratic, end: Quadratic, at: Interval) -> Quadratic:
    """Return start + at (end - start)."""
    a, b, c = (p + at * (q - p) for p, q in zip(start, end, strict=True))
    return a, b, c


@dataclass(frozen=True)
class _Place:
    """x1, y, kappa and the derivative of kappa by x1, over boxes."""

    x: Interval
    y: Interval
    kappa: Interval
    bend: Interval

    def value(self, q: Quadratic) -> Interval:
        return q[0] + self.kappa * (q[1] + q[2] * self.kappa)

    def slope(self, q: Quadratic) -> Interval:
        return (q[1] + 2.0 * (q[2] * self.kappa)) * self.bend

    def numerator(self, parts: tuple[Quadratic, ...]) -> tuple[Interval, Interval]:
        """Return x p + y q + h and its derivative by x1."""
        p, q, h = parts
        value_p, value_q = self.value(p), self.value(q)
        value = self.x * value_p + self.y * value_q + self.value(h)
        slope = value_p + self.x * self.slope(p) + self.kappa * value_q + self.y * self.slope(q)
        return value, slope + self.slope(h)


def at_constant(system: System, state: State) -> System:
    """Return the system with the constant restitution that it has in an impact."""
    curve = system.restitution
    if not isinstance(curve, RestitutionCurve):
        return system
    # Bodies that separate have that of the lowest impacts.
    r = curve(max(_approach_velocity(system, state), 0.0))
    return system.replace(restitution=float(r))


def _approach_velocity(system: System, state: State) -> float:
    x1, v1, v2, _ = state
    return float(system.slope(x1)) * v1 - v2


class Curved:
    """The conditions of one system at any coefficient of restitution."""

    def __init__(self, system: System, n: int) -> None:
        self.system, self.n = system, n
        # rho = 0 and rho = 1/2.
        self._plastic, self._elastic = (self.at(r) for r in (0.0, 1.0))

    @property
    def parameters(self) -> Parameters:
        """Those of the system, without its restitution."""
        return self._plastic.parameters

    def at(self, r: float) -> Conditions:
        """Return the conditions at a constant restitution."""
        return conditions(Parameters.of(self.system.replace(restitution=float(r)), self.n))

    def all(self) -> Conditions:
        """Return conditions that enclose those at every r up to the largest of the curve."""
        curve: RestitutionCurve = self.system.restitution
        largest = max(getattr(curve, "values", (getattr(curve, "r_low", 0.0),)))
        most = self.at(largest)
        rho = Interval(np.zeros(1), most.rho.hi)
        d, *numerators = self._coefficients(rho)
        (a, b, c), (p, q, s) = (tuple(each) for each in numerators)
        return replace(most, rho=rho, d=d, cosine=(a, b, c), sine=(p, q, s))

    def _coefficients(self, rho: Interval) -> tuple[Quadratic, list[Quadratic], list[Quadratic]]:
        one, two = self._plastic, self._elastic
        at = 2.0 * rho
        return (
            _line(one.d, two.d, at),
            [_line(p, q, at) for p, q in zip(one.cosine, two.cosine, strict=True)],
            [_line(p, q, at) for p, q in zip(one.sine, two.sine, strict=True)],
        )

    @cached_property
    def _by_rho(self) -> tuple[Quadratic, list[Quadratic], list[Quadratic]]:
        """Derivatives of the coefficients by rho."""
        one, two = self._plastic, self._elastic

        def change(p: Quadratic, q: Quadratic) -> Quadratic:
            a, b, c = (2.0 * (y - x) for x, y in zip(p, q, strict=True))
            return a, b, c

        return (
            change(one.d, two.d),
            [change(p, q) for p, q in zip(one.cosine, two.cosine, strict=True)],
            [change(p, q) for p, q in zip(one.sine, two.sine, strict=True)],
        )

    @cached_property
    def _impulse(self) -> tuple[Quadratic, Quadratic, Quadratic]:
        """Coefficients (p, q, h) of M: the P column replaced by the right-hand side."""
        one, two = columns(self._plastic.first), columns(self._plastic.second)
        zero = Interval(np.zeros(1))

        def a(left: str, right: str) -> Interval:
            return cross(one[left], one[right])

        def b(left: str, right: str) -> Interval:
            return cross(two[left], two[right])

        def of_first(side: str) -> Quadratic:
            constant = a("v", side) * b("c", "s")
            return constant, a(side, "c") * b("v", "s") - a(side, "s") * b("v", "c"), zero

        def of_second(side: str) -> Quadratic:
            constant = a("v", "s") * b(side, "c") - a("v", "c") * b(side, "s")
            return constant, a("c", "s") * b("v", side), zero

        loads = zip(of_first("h"), of_second("h"), strict=True)
        p, q, r = (left + right for left, right in loads)
        return of_first("q"), of_second("q"), (p, q, r)

    def _place(self, x: Interval) -> _Place:
        tip, kappa, bend = self._plastic.contact(x)
        return _Place(x, tip - self.parameters.gap, kappa, bend)

    def _lever(self, place: _Place) -> tuple[Interval, Interval]:
        """Return omega l and its derivative by x1."""
        omega = self.parameters.drive_frequency
        if self.parameters.is_wall[0]:
            return place.kappa * omega, place.bend * omega
        lever = place.kappa.square() + self.parameters.mass_ratio
        return lever * omega, 2.0 * (place.kappa * place.bend) * omega

    def approach_velocity(self, state: State) -> float:
        """Return u of a state."""
        return _approach_velocity(self.system, state)

    def speed(self, x: Interval, rho: Interval) -> Interval:
        """Enclose the approach velocity of solutions over boxes of x1."""
        place = self._place(x)
        d, *_ = self._coefficients(rho)
        part, _ = place.numerator(self._impulse)
        return self._lever(place)[0] * (1.0 - rho) * part / place.value(d)

    def enclose(self, x: Interval, speeds: Speeds) -> Pair:
        """Enclose F and G over boxes of x1 and s."""
        place, rho = self._place(x), speeds.rho
        d, cosine, sine = self._coefficients(rho)
        d_rho, cosine_rho, sine_rho = self._by_rho
        value, slope = place.value(d), place.slope(d)
        by_s = place.value(d_rho) * speeds.rho_slope
        f, fx, fs = -value.square(), -(value * slope), -(value * by_s)
        for parts, change in ((cosine, cosine_rho), (sine, sine_rho)):
            part, part_x = place.numerator(tuple(parts))
            part_s = place.numerator(tuple(change))[0] * speeds.rho_slope
            f, fx, fs = f + part.square(), fx + part * part_x, fs + part * part_s
        lever, lever_x = self._lever(place)
        impulse, impulse_x = place.numerator(self._impulse)
        rest = 1.0 - rho
        weight = rest * speeds.inverse
        weight_s = rest * speeds.inverse_slope - speeds.rho_slope * speeds.inverse
        g = value - lever * impulse * weight
        gx = slope - (lever_x * impulse + lever * impulse_x) * weight
        return Pair(f, g, 2.0 * fx, 2.0 * fs, gx, by_s - lever * impulse * weight_s)

    def over(self, piece: Slope, box: Box) -> Pair:
        """Enclose F and G over boxes of a piece."""
        return self.enclose(box.x, piece.at(box.s))

"""The impact formulas of section 2 as they are printed, on arrays.

(14) to (18) are given the sine as an argument: the printed formulas have sin theta_0, the corrected
ones its absolute value (docs/theory.md, E1). Each is the outcome of one sequence of slip; the
impact may have another one.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Pair = tuple[Array, Array]


@dataclass(frozen=True)
class Before:
    """Impacts about to happen: theta_0, its rate, the rate of x; and the constants."""

    x1: Array
    v1: Array
    v2: Array
    mass_ratio: float
    restitution: float
    friction: float
    absolute: bool

    @property
    def cos(self) -> Array:
        """Cosine of the angle."""
        return np.asarray(np.cos(self.x1))

    @property
    def sin(self) -> Array:
        """Sine of the angle as it enters the moment of friction."""
        sine = np.sin(self.x1)
        return np.asarray(np.abs(sine) if self.absolute else sine)

    @property
    def plus(self) -> Array:
        """Cosine plus the moment of friction, before slip reverses."""
        return np.asarray(self.cos + self.friction * np.sign(self.v1) * self.sin)

    @property
    def minus(self) -> Array:
        """Cosine minus the moment of friction, after slip has reversed."""
        return np.asarray(self.cos - self.friction * np.sign(self.v1) * self.sin)


def approach_impulse(b: Before) -> Array:
    """P_f of (9)."""
    normal = b.v1 * b.cos - b.v2
    sine = b.friction * np.sign(b.v1) * b.sin * b.cos
    return np.asarray(normal / (b.mass_ratio + b.cos**2 + sine))


def reversal_impulse(b: Before) -> Array:
    """P_* of (10)."""
    return np.asarray(b.v1 / b.plus)


def reversed_in_approach(b: Before) -> Pair:
    """(14), (15)."""
    m, r, mu2 = b.mass_ratio, b.restitution, (b.friction * b.sin) ** 2
    a = mu2 * b.cos - b.cos**3 - m * b.plus
    inner = m * b.v1 - r * b.v1 * b.cos * b.minus + (1 + r) * b.v2 * b.plus
    second = (
        b.v2 * b.cos * (b.cos**2 - mu2)
        + (1 + r) * m * b.v1 * b.cos * b.minus
        - r * m * b.v2 * b.plus
    )
    return np.asarray(-b.minus * inner / a), np.asarray(-second / a)


def _second_body(b: Before) -> Array:
    """(16b), which is (18b), with B2 of (17a)."""
    m, r = b.mass_ratio, b.restitution
    b2 = m + b.cos * b.plus
    top = b.v2 * b.cos * b.plus + (1 + r) * m * b.v1 * b.cos - r * m * b.v2
    return np.asarray(top / b2)


def reversed_in_restitution(b: Before) -> Pair:
    """(16), (17)."""
    m, r = b.mass_ratio, b.restitution
    b1 = (m + b.cos * b.plus) * b.plus
    inner = m * b.v1 - b.plus * (r * b.v1 * b.cos - (1 + r) * b.v2)
    return np.asarray(b.minus * inner / b1), _second_body(b)


def slipping(b: Before) -> Pair:
    """(18)."""
    m, r = b.mass_ratio, b.restitution
    b2 = m + b.cos * b.plus
    first = (m * b.v1 + b.plus * ((1 + r) * b.v2 - r * b.v1 * b.cos)) / b2
    return np.asarray(first), _second_body(b)


def frictionless_coefficients(
    x1: NDArray[Any], mass_ratio: float | Array, r0: float | Array
) -> NDArray[Any]:
    """r_1 to r_4 of (20), shape (4, ...); complex if ``x1`` is."""
    cos, m = np.cos(x1), mass_ratio
    q = m + cos**2
    return np.asarray(
        [
            (m - r0 * cos**2) / q,
            (1 + r0) * cos / q,
            (1 + r0) * m * cos / q,
            (-r0 * m + cos**2) / q,
        ]
    )


def coefficient_slopes(x1: Array, mass_ratio: float | Array, r: float | Array) -> Array:
    """Derivatives of r_1 to r_4 by the angle, (44), shape (4, ...)."""
    cos, sin, m = np.cos(x1), np.sin(x1), mass_ratio
    q2 = (m + cos**2) ** 2
    first = 2 * m * (r + 1) * sin * cos / q2
    second = (r + 1) * sin * (cos**2 - m) / q2
    return np.asarray([first, second, m * second, -first])

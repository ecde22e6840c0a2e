"""Free flight of one body over whole drive periods, in intervals, for many systems at once.

x'' + 2 zeta w x' + w^2 x = f cos(omega t + psi) + c, time in 1/omega: over T = 2 pi n

    x(T) = A11 x + A12 v + Re(Gx e^{i psi}) + Hx,
    x'(T) = A21 x + A22 v + Re(Gv e^{i psi}) + Hv.

Hx = (1 - A11) e and Hv = -A21 e, with the equilibrium e = c/w^2; without a spring Hx = c T^2/2,
Hv = c T over omega^2.
These are (A.1)-(A.8) for every damping. Near resonance Gx = f (E(z+) - E(z-))/(z+ - z-) with
E(z) = (e^{zT} - 1)/z and the exponents z of the free motion less that of the drive: the response
from rest, which has no pole. 1 - A is computed and not A, from the difference of the number of
turns of the body to a whole number, so that small differences keep their digits (theory page,
section 2).
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from .intervals import EPS, PI, Interval

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

# Where |(w/omega)^2 - 1 + 2 i zeta w/omega| is smaller, the forced motion is written as a beat.
_NEAR_RESONANCE = 0.5
# Near critical damping sin(wd T)/wd is summed as a series in (wd T)^2, |wd T| < 1. So many terms
# leave less than 1e-20; with half as many what is left would have to be bounded, and seen.
_SERIES_TERMS = 12


@dataclass(frozen=True)
class Complex:
    """A complex number with enclosed parts."""

    re: Interval
    im: Interval

    def times(self, factor: "Complex | Interval") -> "Complex":
        """Return the product."""
        if isinstance(factor, Interval):
            return Complex(self.re * factor, self.im * factor)
        return Complex(
            self.re * factor.re - self.im * factor.im, self.re * factor.im + self.im * factor.re
        )

    def over(self, divisor: "Complex") -> "Complex":
        """Return the quotient."""
        size = divisor.re.square() + divisor.im.square()
        product = self.times(Complex(divisor.re, -divisor.im))
        return Complex(product.re / size, product.im / size)

    def plus(self, other: "Complex") -> "Complex":
        """Return the sum."""
        return Complex(self.re + other.re, self.im + other.im)

    def part(self, part: slice) -> "Complex":
        """Return some of the numbers."""
        return Complex(self.re[part], self.im[part])

    def turned(self) -> "Complex":
        """Return i times the number."""
        return Complex(-self.im, self.re)

    @property
    def largest(self) -> Array:
        """Upper bound of the modulus."""
        return (self.re.square() + self.im.square()).sqrt().hi


@dataclass(frozen=True)
class Flight:
    """Flight of one body over n drive periods, enclosed, time in 1/omega."""

    # 1 - A11, A12, A21, 1 - A22.
    c11: Interval
    a12: Interval
    a21: Interval
    c22: Interval
    gx: Complex
    gv: Complex
    # Hx, Hv, and the equilibrium, 0 without a spring.
    hx: Interval
    hv: Interval
    equilibrium: Array
    # Steady response to the drive, not finite at undamped resonance.
    steady: Complex
    # Undamped, and a whole number of turns to rounding: A = 1.
    returns: Mask

    def part(self, part: slice) -> "Flight":
        """Return the flights of some of the systems."""
        return Flight(
            c11=self.c11[part],
            a12=self.a12[part],
            a21=self.a21[part],
            c22=self.c22[part],
            gx=self.gx.part(part),
            gv=self.gv.part(part),
            hx=self.hx[part],
            hv=self.hv[part],
            equilibrium=self.equilibrium[part],
            steady=self.steady.part(part),
            returns=self.returns[part],
        )

    @property
    def kicked(self) -> tuple[Interval, Interval]:
        """Displacement and velocity just before a unit impulse, which acts once in n periods."""
        det = self.c11 * self.c22 - self.a12 * self.a21
        return self.a12 / det, (self.a21 * self.a12 + self.c11 * (1.0 - self.c22)) / det


def choose(mask: Mask, yes: Interval, no: Interval) -> Interval:
    """Return ``yes`` where the mask holds, else ``no``."""
    return Interval(np.where(mask, yes.lo, no.lo), np.where(mask, yes.hi, no.hi))


def _product(a: Array, b: Array) -> tuple[Array, Array]:
    """Return a b as a sum of two floats, exactly (T. J. Dekker, 1971)."""

    def split(x: Array) -> tuple[Array, Array]:
        high = 134217729.0 * x
        high = high - (high - x)
        return high, x - high

    product = a * b
    (ah, al), (bh, bl) = split(a), split(b)
    return product, ((ah * bh - product) + ah * bl + al * bh) + al * bl


def _turns_beyond_whole(n: int, natural: Array, omega: Array) -> tuple[Interval, Mask, Mask]:
    """Return n natural/omega less the nearest whole number; where that is rounding, and 1/2.

    The remainder is computed exactly, so that it has all its digits where it is small.
    """
    counted = np.full(natural.shape, float(n))
    whole = np.rint(counted * natural / omega)
    (p, p_low), (q, q_low) = _product(counted, natural), _product(whole, omega)
    exact = (p == q) & (p_low == q_low)
    rest = (Interval(p - q) + (Interval(p_low) - q_low)) / omega
    zero = Interval(np.zeros(natural.shape))
    # Within the rounding of natural and omega themselves.
    near = exact | (rest.largest <= 4.0 * EPS * whole)
    half = (np.abs(p - q) == 0.5 * omega) & (p_low == q_low)
    return choose(exact, zero, rest), near, half


def flight(
    n: int, natural: Array, damping: Array, force: Array, load: Array, omega: Array
) -> Flight:
    """Enclose the flight over n drive periods, with w = ``natural``; arrays of shape (k,)."""
    with np.errstate(all="ignore"):
        return _flight(n, natural, damping, force, load, omega)


def _flight(
    n: int, natural: Array, damping: Array, force: Array, load: Array, omega: Array
) -> Flight:
    duration = PI * (2.0 * n)
    ratio = Interval(natural) / omega
    rate = ratio * damping
    zeta = Interval(damping)
    under = damping < 1.0
    shape = np.where(under, (1.0 - damping), (damping - 1.0))
    root = (Interval(shape) * (1.0 + zeta)).sqrt()
    # The damped frequency, or half the difference of the rates of decay.
    damped = choose(damping == 0.0, ratio, ratio * root)
    rest, whole, halves = _turns_beyond_whole(n, natural, omega)
    rest = choose(damping == 0.0, rest, rest - n * ratio * zeta.square() / (1.0 + root))
    shrink = (-(rate * duration)).expm1()
    remaining = 1.0 + shrink
    shrink = choose(damping == 0.0, Interval(np.zeros(natural.shape)), shrink)
    remaining = choose(damping == 0.0, Interval(np.ones(natural.shape)), remaining)
    half = PI * rest
    sine, cosine = half.sin(), half.cos()
    # 1 - C and S of (A.1), (A.2): C = e^{-ct} cos wd t, S = e^{-ct} sin(wd t)/wd.
    versine = 2.0 * sine.square()
    one_minus_c = remaining * versine - shrink
    wave = remaining * (2.0 * (sine * cosine))
    wave = choose(halves & (damping == 0.0), Interval(np.zeros(natural.shape)), wave)
    s = choose(natural == 0.0, duration + Interval(np.zeros(natural.shape)), wave / damped)
    c11, c22 = one_minus_c - rate * s, one_minus_c + rate * s
    # What only some systems need is computed if there are such.
    over = damping > 1.0
    if over.any():
        # Overdamped: rates of decay `slow` and `fast`.
        fast = rate + damped
        slow = ratio.square() / fast
        late, early = -(-(slow * duration)).expm1(), -(-(fast * duration)).expm1()
        gap = 2.0 * damped
        c11 = choose(over, (fast * late - slow * early) / gap, c11)
        c22 = choose(over, (fast * early - slow * late) / gap, c22)
        s = choose(over, (early - late) / gap, s)
    # Near critical damping: series in y = (wd T)^2, negative beyond it.
    y = ratio.square() * duration.square() * ((1.0 - zeta) * (1.0 + zeta))
    critical = (damping > 0.5) & (y.largest < 1.0)
    if critical.any():
        y = choose(critical, y, Interval(np.zeros(natural.shape)))
        cos_series, sin_series = _series(y, 0), _series(y, 1)
        near_c = 1.0 - remaining * cos_series
        near_s = remaining * sin_series * duration
        c11 = choose(critical, near_c - rate * near_s, c11)
        c22 = choose(critical, near_c + rate * near_s, c22)
        s = choose(critical, near_s, s)
    a21 = -(ratio.square() * s)

    amplitude = Interval(force) / Interval(omega).square()
    amplitude = choose(force == 0.0, Interval(np.zeros(natural.shape)), amplitude)
    detuning = (Interval(natural) - omega) * (Interval(natural) + omega) / Interval(omega).square()
    detuning = choose(natural == omega, Interval(np.zeros(natural.shape)), detuning)
    stiffness = Complex(detuning, 2.0 * rate)
    nothing = Interval(np.zeros(natural.shape))
    steady = Complex(amplitude, nothing).over(stiffness)
    # G = (1 - A)(steady, i steady)
    gx = steady.times(c11).plus(steady.turned().times(-s))
    gv = steady.times(-a21).plus(steady.turned().times(c22))
    near = stiffness.largest < _NEAR_RESONANCE
    if near.any():
        # The beat: E(z) = (e^{zT} - 1)/z at z = -c + i(+-wd - 1); e^{-iT} = 1.
        slow_z = Complex(-rate, (detuning - rate.square()) / (damped + 1.0))
        fast_z = Complex(-rate, -(damped + 1.0))
        at_rest = slow_z.re.holds_zero & slow_z.im.holds_zero
        slow_e = Complex(-one_minus_c, wave).over(slow_z)
        spread = slow_z.largest * (2.0 * np.pi * n) * 4.0 * duration.hi
        slow_e = Complex(
            choose(at_rest, duration + Interval(-spread, spread), slow_e.re),
            choose(at_rest, Interval(-spread, spread), slow_e.im),
        )
        fast_e = Complex(-one_minus_c, -wave).over(fast_z)
        difference = slow_e.plus(Complex(-fast_e.re, -fast_e.im))
        factor = amplitude / (2.0 * damped)
        beat_x = Complex(difference.im * factor, -(difference.re * factor))
        beat_v = Complex(amplitude * s, nothing).plus(beat_x.turned())
        gx = Complex(choose(near, beat_x.re, gx.re), choose(near, beat_x.im, gx.im))
        gv = Complex(choose(near, beat_v.re, gv.re), choose(near, beat_v.im, gv.im))
    still = force == 0.0
    gx = Complex(choose(still, nothing, gx.re), choose(still, nothing, gx.im))
    gv = Complex(choose(still, nothing, gv.re), choose(still, nothing, gv.im))
    steady = Complex(choose(still, nothing, steady.re), choose(still, nothing, steady.im))
    returns = whole & (damping == 0.0) & (natural > 0.0)
    rotor, unloaded = natural == 0.0, load == 0.0
    place = Interval(load) / Interval(natural).square()
    push = Interval(load) / Interval(omega).square() * duration
    hx = choose(rotor, push * duration * 0.5, c11 * place)
    hv = choose(rotor, push, -(a21 * place))
    hx, hv = choose(unloaded, nothing, hx), choose(unloaded, nothing, hv)
    equilibrium = np.where(rotor | unloaded, 0.0, place.middle)
    return Flight(c11, s, a21, c22, gx, gv, hx, hv, equilibrium, steady, returns)


def _series(y: Interval, odd: int) -> Interval:
    """Enclose cos sqrt(y), or sin(sqrt y)/sqrt y if ``odd``, for |y| <= 1 of either sign."""
    # The terms left out are below the first of them, times 1 + 1/12 + ...
    total = Interval(-1e-20, 1e-20) + Interval(np.zeros(y.lo.shape))
    for k in range(_SERIES_TERMS, -1, -1):
        # Horner: 1 - y/((2k+1+odd)(2k+2+odd)) (...)
        total = 1.0 - y * total / float((2 * k + 1 + odd) * (2 * k + 2 + odd))
    return total


def rigid_wall(body: Flight, mask: Mask) -> Flight:
    """Return the flights with A = 0 where the mask holds: a body that stays at its equilibrium."""
    one, zero = Interval(np.ones(len(mask))), Interval(np.zeros(len(mask)))
    return replace(
        body,
        c11=choose(mask, one, body.c11),
        a12=choose(mask, zero, body.a12),
        a21=choose(mask, zero, body.a21),
        c22=choose(mask, one, body.c22),
        hx=choose(mask, Interval(body.equilibrium), body.hx),
        hv=choose(mask, zero, body.hv),
        returns=body.returns & ~mask,
    )

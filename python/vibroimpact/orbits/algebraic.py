"""Conditions of a period n-1 motion without friction: n drive periods, one impact (paper, section 3.2).

Time in 1/omega, so that a flight lasts T = 2 pi n and velocities are in units of omega. Just after the
impact x1 and x2 = y = sigma(x1) - delta have velocities V and W, P is the impulse, psi the phase, and
kappa = sigma': sigma = sin, or the identity for direct contact. With (A, G) the flight of a body,

    x(T) = A11 x + A12 v + Re(Gx e^{i psi}),    x'(T) = A21 x + A22 v + Re(Gv e^{i psi}),

the motion repeats, and Newton's law holds at the impact (rho = r/(1 + r), in place of (19), (20)), if

    (1 - A11) x1 - A12 V = Re(G1x e^{i psi})       (1 - A22) V + kappa P - A21 x1 = Re(G1v e^{i psi})
    (1 - B11) y  - B12 W = Re(G2x e^{i psi})       (1 - B22) W - mbar P  - B21 y  = Re(G2v e^{i psi})
    kappa V - W + rho (mbar + kappa^2) P = 0.

Given x1 they are linear in (V, W, P, cos psi, sin psi), with a determinant D(kappa) and Cramer's
numerators Nc, Ns; cos^2 + sin^2 = 1 leaves the one equation

    F(x1) = Nc^2 + Ns^2 - D^2 = 0,    D = d(kappa),    N = x1 p(kappa) + y q(kappa),

d, p, q quadratic: this is (35) with its poles multiplied out, for any damping, both forces, both
contacts, a wall, and at resonance, since nothing is divided by.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..system import System
from .intervals import PI, Interval

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
# Three coefficients, of 1, kappa and kappa^2.
Quadratic = tuple[Interval, Interval, Interval]

# Where |(omega0/omega)^2 - 1 + 2 i zeta omega0/omega| is smaller, the forced motion is written as a beat.
NEAR_RESONANCE = 0.5
# Near critical damping sin(wd T)/wd is summed as a series in (wd T)^2, |wd T| < 1.
SERIES_TERMS = 12


@dataclass(frozen=True)
class Parameters:
    """Parameters of many systems without friction, arrays of shape (k,), and their common n."""

    n: int
    oblique: bool
    mass_ratio: Array
    frequency_ratio: Array
    restitution: Array
    gap: Array
    drive_frequency: Array
    pendulum_damping: Array
    oscillator_damping: Array
    moment_amplitude: Array
    force_amplitude: Array

    @classmethod
    def of(cls, systems: Sequence[System], n: int) -> "Parameters":
        """Collect the parameters of systems of one contact."""
        names = [name for name in cls.__dataclass_fields__ if name not in ("n", "oblique")]
        columns = {name: np.array([getattr(system, name) for system in systems]) for name in names}
        return cls(n=n, oblique=systems[0].contact == "oblique", **columns)

    def __len__(self) -> int:
        """Number of systems."""
        return len(self.gap)


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
    # Steady response to the drive, not finite at undamped resonance.
    steady: Complex
    # Undamped, and a whole number of turns: A = 1.
    returns: Mask

    @property
    def kicked(self) -> tuple[Interval, Interval]:
        """Displacement and velocity before a unit kick of the body kicked once in n periods."""
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


def _turns_beyond_whole(n: int, natural: Array, omega: Array) -> tuple[Interval, Mask]:
    """Return n natural/omega less the nearest whole number, and where nothing is left.

    The remainder is formed exactly, so that it has all its digits where it is small.
    """
    counted = np.full(natural.shape, float(n))
    whole = np.rint(counted * natural / omega)
    (p, p_low), (q, q_low) = _product(counted, natural), _product(whole, omega)
    exact = (p == q) & (p_low == q_low)
    rest = (Interval(p - q) + (Interval(p_low) - q_low)) / omega
    zero = Interval(np.zeros(natural.shape))
    return choose(exact, zero, rest), exact


def flight(n: int, natural: Array, damping: Array, force: Array, omega: Array) -> Flight:
    """Enclose the flight of x'' + 2 zeta w x' + w^2 x = f cos(omega t + psi) over n periods.

    (A.1)-(A.8) for every damping; near resonance the response from rest, which has no pole.
    """
    with np.errstate(all="ignore"):
        return _flight(n, natural, damping, force, omega)


def _flight(n: int, natural: Array, damping: Array, force: Array, omega: Array) -> Flight:
    duration = PI * (2.0 * n)
    ratio = Interval(natural) / omega
    rate = ratio * damping
    zeta = Interval(damping)
    under = damping < 1.0
    shape = np.where(under, (1.0 - damping), (damping - 1.0))
    root = (Interval(shape) * (1.0 + zeta)).sqrt()
    # The damped frequency, or half the difference of the rates of decay.
    damped = choose(damping == 0.0, ratio, ratio * root)
    rest, whole = _turns_beyond_whole(n, natural, omega)
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
    s = choose(natural == 0.0, duration + Interval(np.zeros(natural.shape)), wave / damped)
    c11, c22 = one_minus_c - rate * s, one_minus_c + rate * s
    # Overdamped: rates of decay `slow` and `fast`.
    fast = rate + damped
    slow = ratio.square() / fast
    late, early = -(-(slow * duration)).expm1(), -(-(fast * duration)).expm1()
    gap = 2.0 * damped
    over = damping > 1.0
    c11 = choose(over, (fast * late - slow * early) / gap, c11)
    c22 = choose(over, (fast * early - slow * late) / gap, c22)
    s = choose(over, (early - late) / gap, s)
    # Near critical damping: series in y = (wd T)^2, negative beyond it.
    y = ratio.square() * duration.square() * ((1.0 - zeta) * (1.0 + zeta))
    critical = (damping > 0.5) & (y.largest < 1.0)
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
    # The beat: E(z) = (e^{zT} - 1)/z at z = -c + i(+-wd - 1); e^{-iT} = 1.
    beat = stiffness.largest < NEAR_RESONANCE
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
    gx = Complex(choose(beat, beat_x.re, gx.re), choose(beat, beat_x.im, gx.im))
    gv = Complex(choose(beat, beat_v.re, gv.re), choose(beat, beat_v.im, gv.im))
    still = force == 0.0
    gx = Complex(choose(still, nothing, gx.re), choose(still, nothing, gx.im))
    gv = Complex(choose(still, nothing, gv.re), choose(still, nothing, gv.im))
    steady = Complex(choose(still, nothing, steady.re), choose(still, nothing, steady.im))
    returns = whole & (damping == 0.0) & (natural > 0.0)
    return Flight(c11, s, a21, c22, gx, gv, steady, returns)


def _series(y: Interval, odd: int) -> Interval:
    """Enclose cos sqrt(y), or sin(sqrt y)/sqrt y if ``odd``, for |y| <= 1 of either sign."""
    # The terms left out are below the first of them, times 1 + 1/12 + ...
    total = Interval(-1e-20, 1e-20) + Interval(np.zeros(y.lo.shape))
    for k in range(SERIES_TERMS, -1, -1):
        # Horner: 1 - y/((2k+1+odd)(2k+2+odd)) (...)
        total = 1.0 - y * total / float((2 * k + 1 + odd) * (2 * k + 2 + odd))
    return total


@dataclass(frozen=True)
class Conditions:
    """The conditions of periodicity of many systems: F(x1) = Nc^2 + Ns^2 - D^2 and its slope.

    Attributes
    ----------
    parameters
        The systems.
    first, second
        Flights of the bodies. A wall at rest (mbar = f2 = 0) has B = 0: it stays where it is.
    d
        Coefficients of D.
    cosine, sine
        Coefficients (p, q) of Nc and of Ns.
    """

    parameters: Parameters
    first: Flight
    second: Flight
    d: Quadratic
    cosine: tuple[Quadratic, Quadratic]
    sine: tuple[Quadratic, Quadratic]

    def enclose(self, which: NDArray[np.int64], x: Interval) -> tuple[Interval, Interval]:
        """Enclose F and its slope over boxes of x1; ``which`` numbers the systems.

        D, Nc, Ns by their mean-value form, q(m) + q'(X)(X - m), then F likewise.
        """
        middle = Interval(x.middle)
        at_middle, _ = self._values(which, middle)
        natural, slopes = self._values(which, x)
        offset = x - middle
        values = [
            value.meet(mean + slope * offset)
            for value, mean, slope in zip(natural, at_middle, slopes, strict=True)
        ]
        (d, c, s), (d1, c1, s1) = values, slopes
        slope = 2.0 * (c * c1 + s * s1 - d * d1)
        value = c.square() + s.square() - d.square()
        dm, cm, sm = at_middle
        mean = cm.square() + sm.square() - dm.square() + slope * offset
        return value.meet(mean), slope

    def _values(
        self, which: NDArray[np.int64], x: Interval
    ) -> tuple[tuple[Interval, Interval, Interval], tuple[Interval, Interval, Interval]]:
        """Enclose D, Nc, Ns and their derivatives by x1."""
        gap = self.parameters.gap[which]
        if self.parameters.oblique:
            tip, kappa = x.sin(), x.cos()
            bend = -tip
        else:
            one = np.ones(x.lo.shape)
            tip, kappa, bend = x, Interval(one), Interval(0.0 * one)
        y = tip - gap

        def quadratic(coefficients: Quadratic) -> tuple[Interval, Interval]:
            a, b, c = (coefficient[which] for coefficient in coefficients)
            ck = c * kappa
            return a + kappa * (b + ck), (b + 2.0 * ck) * bend

        def numerator(pair: tuple[Quadratic, Quadratic]) -> tuple[Interval, Interval]:
            (p, p1), (q, q1) = quadratic(pair[0]), quadratic(pair[1])
            return x * p + y * q, p + x * p1 + kappa * q + y * q1

        d, d1 = quadratic(self.d)
        c, c1 = numerator(self.cosine)
        s, s1 = numerator(self.sine)
        return (d, c, s), (d1, c1, s1)

    def linear(self, which: NDArray[np.int64], x1: Array) -> tuple[Array, Array]:
        """Return matrix (k, 5, 5) and right-hand side (k, 5) for (V, W, P, cos psi, sin psi)."""
        par = self.parameters
        mbar, r = par.mass_ratio[which], par.restitution[which]
        kappa = np.cos(x1) if par.oblique else np.ones_like(x1)
        y = (np.sin(x1) if par.oblique else x1) - par.gap[which]
        matrix, rhs = np.zeros((len(x1), 5, 5)), np.zeros((len(x1), 5))
        for row, column, body, place, kick in (
            (0, 0, self.first, x1, kappa),
            (2, 1, self.second, y, -mbar),
        ):
            matrix[:, row, column] = -body.a12.middle[which]
            matrix[:, row, 3] = -body.gx.re.middle[which]
            matrix[:, row, 4] = body.gx.im.middle[which]
            matrix[:, row + 1, column] = body.c22.middle[which]
            matrix[:, row + 1, 2] = kick
            matrix[:, row + 1, 3] = -body.gv.re.middle[which]
            matrix[:, row + 1, 4] = body.gv.im.middle[which]
            rhs[:, row] = -body.c11.middle[which] * place
            rhs[:, row + 1] = body.a21.middle[which] * place
        matrix[:, 4, 0], matrix[:, 4, 1] = kappa, -1.0
        matrix[:, 4, 2] = r / (1.0 + r) * (mbar + kappa**2)
        return matrix, rhs


def conditions(parameters: Parameters) -> Conditions:
    """Enclose the coefficients of F for every system.

    The determinant is expanded by its last row; [a b] is the determinant of the columns a, b of one
    body's two rows.
    """
    par = parameters
    omega = par.drive_frequency
    first = flight(par.n, par.frequency_ratio, par.pendulum_damping, par.moment_amplitude, omega)
    ones = np.ones(len(par))
    second = flight(par.n, ones, par.oscillator_damping, par.force_amplitude, omega)
    wall = (par.mass_ratio == 0.0) & (par.force_amplitude == 0.0)
    one, zero = Interval(ones), Interval(0.0 * ones)
    second = Flight(
        *(
            choose(wall, plain, own)
            for plain, own in (
                (one, second.c11),
                (zero, second.a12),
                (zero, second.a21),
                (one, second.c22),
            )
        ),
        second.gx,
        second.gv,
        second.steady,
        second.returns & ~wall,
    )
    mbar, r = Interval(par.mass_ratio), Interval(par.restitution)
    rho = r / (1.0 + r)

    def columns(body: Flight) -> dict[str, tuple[Interval, Interval]]:
        return {
            "v": (-body.a12, body.c22),
            "e": (zero, one),
            "c": (-body.gx.re, -body.gv.re),
            "s": (body.gx.im, body.gv.im),
            "q": (-body.c11, body.a21),
        }

    one_of, two_of = columns(first), columns(second)

    def a(left: str, right: str) -> Interval:
        return _cross(one_of[left], one_of[right])

    def b(left: str, right: str) -> Interval:
        return _cross(two_of[left], two_of[right])

    def cramer(c: str, s: str, c2: str, s2: str) -> Quadratic:
        """Determinant with columns c, s of body 1 and c2, s2 of body 2; "" is a column of zeros."""

        def a_(left: str, right: str) -> Interval:
            return a(left, right) if left and right else zero

        def b_(left: str, right: str) -> Interval:
            return b(left, right) if left and right else zero

        # Minors without the columns V, W and P.
        free = a_("v", s) * b_("v", c2) - a_("v", c) * b_("v", s2)
        of_v = a_("e", c) * b_("v", s2) - a_("e", s) * b_("v", c2)
        of_w = a_("v", c) * b_("e", s2) - a_("v", s) * b_("e", c2)
        return (
            mbar * of_w + rho * mbar * free,
            a("v", "e") * b_(c2, s2) - mbar * a_(c, s) * b("v", "e"),
            of_v + rho * free,
        )

    return Conditions(
        parameters=par,
        first=first,
        second=second,
        d=cramer("c", "s", "c", "s"),
        # x1 enters by body 1's right-hand side, y by body 2's.
        cosine=(cramer("q", "s", "", "s"), cramer("", "s", "q", "s")),
        sine=(cramer("c", "q", "c", ""), cramer("c", "", "c", "q")),
    )


def _cross(a: tuple[Interval, Interval], b: tuple[Interval, Interval]) -> Interval:
    return a[0] * b[1] - a[1] * b[0]

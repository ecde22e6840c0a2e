"""Exact free motion of both bodies in ball arithmetic, at any precision.

One body (theory page, section 1): x'' + 2 zeta omega0 x' + omega0^2 x = f cos psi + c,
psi(t) = psi0 + omega t, with t = 0 at the start of the flight. The motion is the matrix
exponential of the linear system in (x, v, f cos psi, f sin psi, c), which has no special cases
(section 2); `Body.state_closed` is the textbook closed form, with all of them, as a check;
`Body.state_quick` takes the entries of that matrix from the closed form where it loses nothing.
Parameters and initial values are exact rationals; every result encloses the exact value.
All quantities are dimensionless. The precision is python-flint's `ctx.prec`, in bits.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from fractions import Fraction
from typing import Protocol

from flint import acb, arb, arb_mat, arb_series, ctx, fmpq

#: An exact number: a float64 stands for its bits, a string for its decimal (0.6 for 3/5).
Number = float | int | str | Fraction | fmpq
#: An exact number or an enclosure of one.
Value = fmpq | arb
#: Enclosures of x1, v1, x2, v2.
State = tuple[arb, arb, arb, arb]


def exact(value: Number) -> fmpq:
    """The rational that `value` stands for: floats bit for bit, strings as written."""
    if isinstance(value, fmpq):
        return value
    fraction = Fraction(value)
    return fmpq(fraction.numerator, fraction.denominator)


def as_float(text: str) -> float:
    """The float64 that a decimal or C99 hex string stands for; 0.6 is not 3/5 but the float."""
    return float.fromhex(text) if "0x" in text.lower() else float(text)


def ball(value: Value) -> arb:
    """Enclosure of `value` at the current precision; an enclosure is returned as it is."""
    return value if isinstance(value, arb) else arb(value)


def rational(point: arb) -> fmpq:
    """The exact value of a ball of radius zero."""
    mantissa, exponent = point.man_exp()
    scale = fmpq(2) ** abs(int(exponent))
    return fmpq(mantissa) * scale if exponent >= 0 else fmpq(mantissa) / scale


#: What `Body.state_quick` leaves to the matrix exponential: times up to SHORT, and squared
#: frequencies of vibration or distances from resonance below CLEAR.
SHORT, CLEAR = fmpq(1, 64), fmpq(1, 1024)


@dataclass(frozen=True)
class Body:
    """One forced linear oscillator: any omega0, zeta, omega >= 0 and any f, c, all exact."""

    omega0: fmpq
    zeta: fmpq
    f: fmpq
    omega: fmpq
    c: fmpq = field(default_factory=fmpq)
    _cache: dict[int, tuple[arb, ...]] = field(default_factory=dict, compare=False, repr=False)

    def _balls(self) -> tuple[arb, ...]:
        """Damping 2 zeta omega0, stiffness omega0^2, f, omega and c at the current precision."""
        found = self._cache.get(ctx.prec)
        if found is None:
            damping, stiffness = 2 * self.zeta * self.omega0, self.omega0**2
            found = tuple(arb(q) for q in (damping, stiffness, self.f, self.omega, self.c))
            self._cache[ctx.prec] = found
        return found

    def state(self, t: Value, x: Value, v: Value, psi: Value) -> tuple[arb, arb]:
        """Position and velocity at time `t` from (x, v) and forcing phase `psi` at time 0."""
        damping, stiffness, f, omega, c = self._balls()
        tau, phase = ball(t), ball(psi)
        turn, zero = omega * tau, arb(0)
        start = [ball(x), ball(v), f * phase.cos(), f * phase.sin()]
        rates = [
            [zero, tau, zero, zero, zero],
            [-stiffness * tau, -damping * tau, tau, zero, tau],
            [zero, zero, zero, -turn, zero],
            [zero, zero, turn, zero, zero],
            [zero, zero, zero, zero, zero],
        ]
        if not c.is_zero():
            start.append(c)
        size = len(start)
        flow = arb_mat([row[:size] for row in rates[:size]]).exp()
        rows = [sum((flow[i, j] * start[j] for j in range(size)), arb(0)) for i in range(2)]
        return rows[0], rows[1]

    def state_quick(self, t: Value, x: Value, v: Value, psi: Value) -> tuple[arb, arb]:
        """Position and velocity as by `state`, as tight and faster, if the body vibrates.

        It is used far from critical damping and from undamped resonance, and not for short times,
        because there the closed form cancels; otherwise `state` is called.
        """
        tau, phase = ball(t), ball(psi)
        balls = self._quick_balls()
        if balls is None or not tau > SHORT:
            return self.state(t, x, v, psi)
        damping, stiffness, f, omega, c = self._balls()
        equilibrium = c / stiffness
        turn_free, real, imag = balls
        sine, even = (turn_free * tau).sin_cos()
        odd = sine / turn_free
        xx = vv = even
        if not damping.is_zero():
            decay = damping / 2
            damp = (-decay * tau).exp()
            even, odd = damp * even, damp * odd
            xx, vv = even + decay * odd, even - decay * odd
        xv, vx = odd, -stiffness * odd
        here, there = ball(x) - equilibrium, ball(v)
        first, second = equilibrium + xx * here + xv * there, vx * here + vv * there
        if not f.is_zero():
            sin, cos = (omega * tau).sin_cos()
            # responses R e^{i turn} to e^{i turn}, and i R e^{i turn} to i e^{i turn}, from rest
            even_x, odd_x = real * cos - imag * sin, -(real * sin + imag * cos)
            sin_phase, cos_phase = phase.sin_cos()
            for drive, p, q, start, rate in (
                (f * cos_phase, even_x, omega * odd_x, real, -omega * imag),
                (f * sin_phase, odd_x, -omega * even_x, -imag, -omega * real),
            ):
                first += drive * (p - xx * start - xv * rate)
                second += drive * (q - vx * start - vv * rate)
        return first, second

    def _quick_balls(self) -> tuple[arb, arb, arb] | None:
        """Angular velocity of the free vibration, and R; None where `state_quick` is not used."""
        found = self._cache.get(-ctx.prec)
        if found is None:
            square = (1 - self.zeta**2) * self.omega0**2
            detuning = self.omega0**2 - self.omega**2
            loss = 2 * self.zeta * self.omega0 * self.omega
            norm = detuning**2 + loss**2
            if square < CLEAR or norm < CLEAR:
                return None
            found = (arb(square).sqrt(), arb(detuning / norm), arb(-loss / norm))
            self._cache[-ctx.prec] = found
        return found[0], found[1], found[2]

    def state_closed(self, t: Value, x: Value, v: Value, psi: Value) -> tuple[arb, arb]:
        """Position and velocity by the closed form, with cases decided on the exact parameters."""
        tau, phase = ball(t), ball(psi)
        decay, stiffness = arb(self.zeta * self.omega0), arb(self.omega0**2)
        discriminant = (self.zeta**2 - 1) * self.omega0**2
        if discriminant == 0:
            even, odd = arb(1), tau
        else:
            root = acb(arb(discriminant)).sqrt()
            even, odd = (root * tau).cosh().real, ((root * tau).sinh() / root).real
        damp = (-decay * tau).exp()
        xp0, vp0 = self._particular(arb(0), phase)
        xp, vp = self._particular(tau, phase)
        xh, vh = ball(x) - xp0, ball(v) - vp0
        return (
            xp + damp * (even * xh + odd * (vh + decay * xh)),
            vp + damp * (even * vh - odd * (decay * vh + stiffness * xh)),
        )

    def _particular(self, t: arb, psi0: arb) -> tuple[arb, arb]:
        """A particular solution and its velocity."""
        driven, loaded = self._driven(t, psi0), self._loaded(t)
        return driven[0] + loaded[0], driven[1] + loaded[1]

    def _loaded(self, t: arb) -> tuple[arb, arb]:
        """That under c: an equilibrium, or a parabola."""
        c = arb(self.c)
        return (c / arb(self.omega0**2), arb(0)) if self.omega0 != 0 else (c * t**2 / 2, c * t)

    def _driven(self, t: arb, psi0: arb) -> tuple[arb, arb]:
        """That under the drive: steady, secular or parabolic."""
        f, omega = arb(self.f), arb(self.omega)
        psi = psi0 + omega * t
        detuning = self.omega0**2 - self.omega**2
        loss = 2 * self.zeta * self.omega0 * self.omega
        if detuning != 0 or loss != 0:
            amplitude = acb(f) / acb(arb(detuning), arb(loss))
            steady = amplitude * acb(psi.cos(), psi.sin())
            return steady.real, -omega * steady.imag
        if self.omega != 0:
            swing = f / (2 * omega)
            return swing * t * psi.sin(), swing * (psi.sin() + omega * t * psi.cos())
        load = f * psi.cos()
        return load * t**2 / 2, load * t

    def rate(self) -> float:
        """Bound on the relative rate of change of (max(omega0, 1/4) x, v) and of the forcing."""
        omega0, zeta, omega = float(self.omega0), float(self.zeta), float(self.omega)
        scale = max(omega0, 0.25)
        return max(scale, omega0**2 / scale + 2 * zeta * omega0, omega)

    def spread(self, x: arb, v: arb, h: arb) -> tuple[arb, arb]:
        """Enclosures of position and velocity for all times within `h` of the state (x, v).

        For y = (s x, v), |y'| <= b |y| + |f| + |c| in the maximum norm, so |y(t) - y| is at most
        (exp(b h) - 1) (|y| + (|f| + |c|)/b) (Gronwall).
        """
        damping, stiffness, f, _, c = self._balls()
        scale = arb(max(float(self.omega0), 0.25))
        bound = scale.max(stiffness / scale + damping)
        size = (scale * x).abs_upper().max(v.abs_upper())
        reach = ((bound * h).expm1() * (size + (abs(f) + abs(c)) / bound)).abs_upper()
        return x + arb(0, reach / scale), v + arb(0, reach)

    def taylor(self, x: arb, v: arb, psi: arb, order: int) -> list[arb]:
        """Taylor coefficients 0 ... order of the position about a state with phase `psi`."""
        damping, stiffness, f, omega, c = self._balls()
        damped, forced = not damping.is_zero(), not f.is_zero()
        if forced:
            even, odd = f * psi.cos(), -f * omega * psi.sin()
            minus_square = -(omega**2)
        series = [x, v]
        for j in range(order - 1):
            force = -stiffness * series[j]
            if j == 0:
                force += c
            if damped:
                force -= damping * (j + 1) * series[j + 1]
            if forced:
                force += even
                even, odd = odd, even * minus_square / ((j + 1) * (j + 2))
            series.append(force / ((j + 1) * (j + 2)))
        return series


class Curve(Protocol):
    """A coefficient of restitution that depends on the approach velocity (restitution.py)."""

    @property
    def lowest(self) -> fmpq:
        """R of the lowest impacts."""

    def pieces(self, u: arb) -> list[tuple[arb, arb]]:
        """Values r and dr/du on the pieces on which a ball of u lies."""


@dataclass(frozen=True)
class System:
    """Parameters of the pair of bodies (theory page, section 1) as exact rationals."""

    mbar: fmpq
    omega0: fmpq
    r: fmpq
    delta: fmpq
    zeta1: fmpq
    zeta2: fmpq
    f1: fmpq
    f2: fmpq
    omega: fmpq
    mu: fmpq
    c1: fmpq = field(default_factory=fmpq)
    c2: fmpq = field(default_factory=fmpq)
    oblique: bool = True
    #: r where it depends on the approach velocity; then `r` is that of the lowest impacts.
    curve: Curve | None = None

    @classmethod
    def parse(cls, values: Mapping[str, Number], contact: str = "oblique") -> System:
        """From a mapping with the symbols, c1 and c2 where there are loads; others are ignored."""
        if contact not in ("oblique", "direct"):
            raise ValueError(f"contact is {contact!r}, not oblique or direct")
        names = ("mbar", "omega0", "r", "delta", "zeta1", "zeta2", "f1", "f2", "omega", "mu")
        needed = {name: exact(values[name]) for name in names}
        loads = {name: exact(values.get(name, 0)) for name in ("c1", "c2")}
        return cls(**needed, **loads, curve=None, oblique=contact == "oblique")

    def bodies(self) -> tuple[Body, Body]:
        """Pendulum and oscillator; the oscillator's own frequency is 1."""
        first = Body(self.omega0, self.zeta1, self.f1, self.omega, self.c1)
        return first, Body(fmpq(1), self.zeta2, self.f2, self.omega, self.c2)

    def wall_rests(self, x2: fmpq, v2: fmpq) -> bool:
        """Whether body 2 is a wall (mbar = 0) that rests in this state and will never move."""
        return bool(self.mbar == 0 and self.f2 == 0 and x2 == self.c2 and v2 == 0)

    def tip(self, x1: arb) -> arb:
        """Position of the pendulum's tip along the contact normal: sin x1, or x1 if direct."""
        return x1.sin() if self.oblique else x1

    def slope(self, x1: arb) -> arb:
        """Derivative of `tip` by x1: cos x1, or 1 if direct."""
        return x1.cos() if self.oblique else arb(1)

    def gap_rate(self, x1: arb, v1: arb, v2: arb) -> arb:
        """Rate g' of the gap function."""
        return v1 * self.slope(x1) - v2


class Flight:
    """A free flight of both bodies and of the gap g = sin x1 - x2 - delta (direct: x1 for sin x1).

    Parameters
    ----------
    system : System
    start : (x1, v1, x2, v2), exact rationals or enclosures; x2 None: contact, g = 0 exactly
    phase : forcing phase at the start of the flight
    quick : by the closed form where that loses nothing
    """

    def __init__(
        self,
        system: System,
        start: tuple[Value, Value, Value | None, Value],
        phase: Value,
        *,
        quick: bool = False,
    ) -> None:
        self.system, self.phase, self.quick = system, phase, quick
        self._start = start
        self._first, self._second = system.bodies()
        self.rate = max(self._first.rate(), self._second.rate())

    def start(self) -> State:
        """Enclosure of the initial state at the current precision."""
        x1, v1, x2, v2 = self._start
        touching = self.system.tip(ball(x1)) - arb(self.system.delta)
        return ball(x1), ball(v1), touching if x2 is None else ball(x2), ball(v2)

    def state(self, t: Value) -> State:
        """Enclosure of (x1, v1, x2, v2) at time `t` of the flight."""
        x1, v1, x2, v2 = self.start()
        if self.quick:
            one = self._first.state_quick(t, x1, v1, self.phase)
            return *one, *self._second.state_quick(t, x2, v2, self.phase)
        return *self._first.state(t, x1, v1, self.phase), *self._second.state(t, x2, v2, self.phase)

    def gap(self, t: Value) -> arb:
        """Enclosure of the gap function g at time `t` (g < 0: bodies apart)."""
        x1, _, x2, _ = self.state(t)
        return self.system.tip(x1) - x2 - arb(self.system.delta)

    def velocity(self, t: Value) -> arb:
        """Enclosure of g' at time `t`."""
        x1, v1, _, v2 = self.state(t)
        return self.system.gap_rate(x1, v1, v2)

    def gap_series(self, centre: fmpq, h: fmpq, order: int) -> list[arb]:
        """Coefficients of g about `centre`, sound for |s| <= h: g(centre + s) lies in their sum.

        Coefficients 0 ... order - 1 are Taylor's at the centre, the last one encloses Taylor's
        at every point of the interval (Lagrange's remainder). Differentiating the sum term by
        term gives sound enclosures of the derivatives of g in the same way.
        """
        x1, v1, x2, v2 = self.state(centre)
        psi = ball(self.phase) + arb(self.system.omega) * arb(centre)
        series = self._compose(x1, v1, x2, v2, psi, order)
        if h != 0:
            radius = arb(h)
            wide1 = self._first.spread(x1, v1, radius)
            wide2 = self._second.spread(x2, v2, radius)
            wide_psi = psi + arb(0, (arb(self.system.omega) * radius).abs_upper())
            series[-1] = self._compose(*wide1, *wide2, wide_psi, order)[-1]
        series[0] -= arb(self.system.delta)
        return series

    def _compose(self, x1: arb, v1: arb, x2: arb, v2: arb, psi: arb, order: int) -> list[arb]:
        """Taylor coefficients of g + delta from those of both bodies."""
        first = self._first.taylor(x1, v1, psi, order)
        second = self._second.taylor(x2, v2, psi, order)
        if self.system.oblique:
            cap, ctx.cap = ctx.cap, order + 1
            try:
                sine = arb_series(first, order + 1).sin()
                first = [sine[j] for j in range(order + 1)]
            finally:
                ctx.cap = cap
        return [p - q for p, q in zip(first, second, strict=True)]

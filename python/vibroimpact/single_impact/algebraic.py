"""Conditions of a period n-1 motion without friction: n drive periods, one impact.

Source: section 3.2 of the paper, extended. Time in 1/omega, so that a flight lasts T = 2 pi n and
velocities are in units of omega. Just after the impact x1 and x2 = y = sigma(x1) - delta have
velocities V and W; P is the impulse, psi the phase, kappa = sigma', and sigma the sine, or the
identity for direct contact. With (A, G) the flight of the first body,

    x1(T) = A11 x1 + A12 V + Re(Gx e^{i psi}),    x1'(T) = A21 x1 + A22 V + Re(Gv e^{i psi}),

and (B, H) that of the second, the motion repeats, and obeys Newton's law of impact (for which (19),
(20) stand in the paper; rho = r/(1 + r)), if

    (1 - A11) x1 - A12 V           = Re(Gx e^{i psi})
    (1 - A22) V - A21 x1 + kappa P = Re(Gv e^{i psi})
    (1 - B11) y - B12 W            = Re(Hx e^{i psi})
    (1 - B22) W - B21 y - mbar P   = Re(Hv e^{i psi})
    kappa V - W + rho (mbar + kappa^2) P = 0.

Given x1 they are linear in (V, W, P, cos psi, sin psi), with a determinant D(kappa) and Cramer's
numerators Nc, Ns; cos^2 + sin^2 = 1 leaves the one equation

    F(x1) = Nc^2 + Ns^2 - D^2 = 0,    D = d(kappa),    N = x1 p(kappa) + y q(kappa),

d, p, q quadratic. This is (35) with its poles multiplied out, for any damping, both forces, both
contacts and a wall. Nothing is divided by, so that it holds at resonance as well.

These equations belong to this machine alone: for other equations of motion, another law or another
geometry of the contact they are others. They are written out here, and not asked of the
core's flights, because a proof needs them in interval arithmetic. F itself is evaluated by
src/analysis/one_impact.rs.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache, cached_property
from itertools import chain
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .. import _core
from ..system import System
from .enclosed_flight import Flight, choose, flight, rigid_wall
from .intervals import Interval

Array = NDArray[np.float64]
# Three coefficients, of 1, kappa and kappa^2.
Quadratic = tuple[Interval, Interval, Interval]


@dataclass(frozen=True)
class Parameters:
    """Parameters of many systems without friction, arrays of shape (k,), and their common n."""

    n: int
    oblique: bool
    # `System.slope`, which is the same for all of them.
    slope: Callable[[Array], Array]
    is_wall: NDArray[np.bool_]
    mass_ratio: Array
    frequency_ratio: Array
    restitution: Array
    gap: Array
    drive_frequency: Array
    pendulum_damping: Array
    oscillator_damping: Array
    moment_amplitude: Array
    force_amplitude: Array
    static_moment: Array
    static_force: Array
    phase: Array

    @classmethod
    def of(cls, system: System, n: int, systems: _core.Systems | None = None) -> "Parameters":
        """Collect the parameters of a system, or of several with its contact."""
        if systems is None:
            systems = _core.Systems(system._compiled, (), np.empty((1, 0)))
        _, *names = cls._columns()
        return cls(
            n=n,
            oblique=system.contact == "oblique",
            slope=system.slope,
            is_wall=systems.is_wall,
            **{name: systems.column(name) for name in names},
        )

    def __len__(self) -> int:
        """Number of systems."""
        return len(self.gap)

    def part(self, part: slice) -> "Parameters":
        """Return the parameters of some of the systems."""
        columns = {name: getattr(self, name)[part] for name in self._columns()}
        return replace(self, **columns)

    @classmethod
    def _columns(cls) -> list[str]:
        return list(cls.__dataclass_fields__)[3:]

    @property
    def has_loads(self) -> bool:
        """Whether any of the systems has a constant load."""
        return bool(self.static_moment.any() or self.static_force.any())

    @property
    def at_rest(self) -> NDArray[np.bool_]:
        """Which have a body 2 that stays where it is: a wall that no drive moves."""
        return np.asarray(self.is_wall & (self.force_amplitude == 0.0))


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
        Coefficients (p, q, s) of Nc and of Ns; s is 0 without constant loads.
    rho
        r/(1 + r).
    """

    parameters: Parameters
    rho: Interval
    first: Flight
    second: Flight
    d: Quadratic
    cosine: tuple[Quadratic, Quadratic, Quadratic]
    sine: tuple[Quadratic, Quadratic, Quadratic]

    def only(self, number: int) -> "Conditions":
        """Return the conditions of one of the systems."""
        part = slice(number, number + 1)

        def of(quadratic: Quadratic) -> Quadratic:
            a, b, c = quadratic
            return a[part], b[part], c[part]

        return Conditions(
            parameters=self.parameters.part(part),
            rho=self.rho[part],
            first=self.first.part(part),
            second=self.second.part(part),
            d=of(self.d),
            cosine=(of(self.cosine[0]), of(self.cosine[1]), of(self.cosine[2])),
            sine=(of(self.sine[0]), of(self.sine[1]), of(self.sine[2])),
        )

    def enclose(self, which: NDArray[np.int64], x: Interval) -> tuple[Interval, Interval]:
        """Enclose F and its slope over boxes of x1; ``which`` numbers the systems."""
        value, slope = self._compiled.enclose(which, x.lo, x.hi)
        return Interval(*value), Interval(*slope)

    @cached_property
    def _compiled(self) -> _core.OneImpacts:
        par = self.parameters
        rows = [*self.d, *chain(*self.cosine[:2]), *chain(*self.sine[:2])]
        if par.has_loads:
            rows += [*self.cosine[2], *self.sine[2]]
        lo, hi = np.array([row.lo for row in rows]), np.array([row.hi for row in rows])
        return _core.OneImpacts("oblique" if par.oblique else "direct", par.gap, lo, hi)

    def linear(self, which: NDArray[np.int64], x1: Interval) -> tuple[Interval, Interval]:
        """Return matrix (k, 5, 5) and right-hand side (k, 5) for (V, W, P, cos psi, sin psi)."""
        par = self.parameters
        mbar, rho = Interval(par.mass_ratio[which]), self.rho[which]
        tip, kappa, _ = self.contact(x1)
        y = tip - par.gap[which]
        matrix = Interval(np.zeros((len(which), 5, 5)), np.zeros((len(which), 5, 5)))
        rhs = Interval(np.zeros((len(which), 5)), np.zeros((len(which), 5)))

        def put(array: Interval, place: tuple[int, ...], value: Interval) -> None:
            at: Any = (slice(None), *place)
            array.lo[at], array.hi[at] = value.lo, value.hi

        for row, body, place, kick in ((0, self.first, x1, kappa), (2, self.second, y, -mbar)):
            put(matrix, (row, row // 2), -body.a12[which])
            put(matrix, (row, 3), -body.gx.re[which])
            put(matrix, (row, 4), body.gx.im[which])
            put(matrix, (row + 1, row // 2), body.c22[which])
            put(matrix, (row + 1, 2), kick)
            put(matrix, (row + 1, 3), -body.gv.re[which])
            put(matrix, (row + 1, 4), body.gv.im[which])
            put(rhs, (row,), body.hx[which] - body.c11[which] * place)
            put(rhs, (row + 1,), body.hv[which] + body.a21[which] * place)
        put(matrix, (4, 0), kappa)
        put(matrix, (4, 1), Interval(-np.ones(len(which))))
        put(matrix, (4, 2), rho * (mbar + kappa.square()))
        return matrix, rhs

    def contact(self, x1: Interval) -> tuple[Interval, Interval, Interval]:
        """Return sigma(x1) and its first two derivatives."""
        if self.parameters.oblique:
            tip = x1.sin()
            return tip, x1.cos(), -tip
        one = np.ones(x1.lo.shape)
        return x1, Interval(one), Interval(0.0 * one)


# Beyond the range of floats an interval is the whole line, or NaN, which decides nothing.
@np.errstate(over="ignore", invalid="ignore")
def conditions(parameters: Parameters) -> Conditions:
    """Enclose the coefficients of F for every system.

    The determinant is expanded by its last row; [a b] is the determinant of the columns a, b of one
    body's two rows.
    """
    par = parameters
    omega = par.drive_frequency
    ones = np.ones(len(par))
    loads = (par.moment_amplitude, par.static_moment), (par.force_amplitude, par.static_force)
    first = flight(par.n, par.frequency_ratio, par.pendulum_damping, *loads[0], omega)
    second = flight(par.n, ones, par.oscillator_damping, *loads[1], omega)
    second = rigid_wall(second, par.at_rest)
    zero = Interval(0.0 * ones)
    mbar, r = Interval(par.mass_ratio), Interval(par.restitution)
    rho = r / (1.0 + r)

    one_of, two_of = columns(first), columns(second)
    loaded, none = par.has_loads, (zero, zero, zero)

    # Each is needed several times.
    @cache
    def a(left: str, right: str) -> Interval:
        return cross(one_of[left], one_of[right])

    @cache
    def b(left: str, right: str) -> Interval:
        return cross(two_of[left], two_of[right])

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
        constant = mbar * (of_w + rho * free)
        linear = a("v", "e") * b_(c2, s2) - mbar * a_(c, s) * b("v", "e")
        quadratic = of_v + rho * free
        # P does not act on a wall, and kappa P takes its place: D and N lose a factor kappa.
        return (
            choose(par.is_wall, linear, constant),
            choose(par.is_wall, quadratic, linear),
            choose(par.is_wall, zero, quadratic),
        )

    return Conditions(
        parameters=par,
        rho=rho,
        first=first,
        second=second,
        d=cramer("c", "s", "c", "s"),
        # x1 enters by body 1's right-hand side, y by body 2's, and the loads by both.
        cosine=(
            cramer("q", "s", "", "s"),
            cramer("", "s", "q", "s"),
            _sum(cramer("h", "s", "", "s"), cramer("", "s", "h", "s")) if loaded else none,
        ),
        sine=(
            cramer("c", "q", "c", ""),
            cramer("c", "", "c", "q"),
            _sum(cramer("c", "h", "c", ""), cramer("c", "", "c", "h")) if loaded else none,
        ),
    )


def _sum(one: Quadratic, other: Quadratic) -> Quadratic:
    return one[0] + other[0], one[1] + other[1], one[2] + other[2]


def columns(body: Flight) -> dict[str, tuple[Interval, Interval]]:
    """Return a body's two rows of the conditions by column; "e" is that of an impulse of 1."""
    ones = np.ones(body.c11.lo.shape)
    return {
        "v": (-body.a12, body.c22),
        "e": (Interval(0.0 * ones), Interval(ones)),
        "c": (-body.gx.re, -body.gv.re),
        "s": (body.gx.im, body.gv.im),
        "q": (-body.c11, body.a21),
        "h": (body.hx, body.hv),
    }


def cross(a: tuple[Interval, Interval], b: tuple[Interval, Interval]) -> Interval:
    """Return the determinant of two columns."""
    return a[0] * b[1] - a[1] * b[0]

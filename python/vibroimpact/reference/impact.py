"""Impact laws in ball arithmetic: Routh's path, the pendulum on it, and `paper`.

A planar impact with normal impulse P and tangential impulse Q (structures page): approach
velocity u > 0, velocity of slip s,
    du = -a dP + b dQ,   ds = -b dP + c dQ,   dQ = -mu sgn(s) dP in slip, (b/c) dP in stick,
which holds iff |b| <= mu c. The walk uses w = u - (b/c) s, for which dw = -h dP with
h = a - b^2/c in slip and stick alike: w and h are what no friction can change. In slip
ds = -k dP, k = b + mu sgn(s) c, and du = -(h + (b/c) k) dP.

The pendulum (section 4; M1 l^2 = 1) is s = v1, w = -v2, b = cos x1, c = 1, h = mbar, with
mu |sin x1| for mu; direct contact: cos -> 1, sin -> 0. The path ends by one of three laws, which
differ only if it bends at s = 0:
    poisson     P_II = r P_I                              impulses
    newton      u = -r u0                                 velocities
    energetic   -int u dP (u < 0) = r^2 int u dP (u > 0)   work of the normal impulse
`paper` evaluates Han, Jin & Hu (2004), eqs (14), (16), (18)-(20), as printed: signed sine, cases by
(9), (10), no guards; it may leave the bodies approaching each other, and then has failed.

Edges: P* = P_f counts as restitution, P* = (1 + r) P_f as slip, |b| = mu c as sticking, s = 0 at
the start as sticking or as slip with the sign of -b. Comparisons are certified; one that the balls
do not decide raises Undecided.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Literal

from flint import arb

from .contact import Undecided
from .flight import System
from .restitution import restitution_at

Law = Literal["poisson", "newton", "energetic"]


class Jammed(ArithmeticError):
    """The approach never ends (mbar = 0), or the formulas have no value."""


@dataclass(frozen=True)
class Impact:
    """Outcome of an impact: velocities after, regime, impulses (theory page, section 4).

    `impulse` is the whole normal impulse, `approach` its part P_I until u = 0, `switch` the
    impulse P* at which v1 = 0 (None if it is never reached or not positive).
    `paper` gives no switch.
    """

    regime: str
    v1: arb
    v2: arb
    impulse: arb | None = None
    approach: arb | None = None
    switch: arb | None = None


@dataclass(frozen=True)
class Path:
    """The path of an impact: velocities s and w after it, regime, impulses.

    `impulse` is the whole normal impulse, `approach` its part P_I until u = 0, `switch` the
    impulse P* at which s = 0 (None if it is never reached or not positive).
    """

    regime: str
    s: arb
    w: arb
    impulse: arb
    approach: arb
    switch: arb | None = None


@dataclass(frozen=True)
class PlanarImpact:
    """What makes the path: restitution r, friction mu, and b, c, h = a - b^2/c."""

    r: arb
    mu: arb
    b: arb
    c: arb
    h: arb

    def path(self, law: Law, s: arb, w: arb) -> Path:
        """The exact path from the velocities s, w to the end that `law` gives."""
        ratio, friction = self.b / self.c, self.mu * self.c
        u = w + ratio * s
        if not _below(arb(0), u):
            raise ValueError("the bodies do not approach each other")
        if self.mu.is_zero():
            return self._slip("frictionless", s, w, self.b, _divide(u, self.h + ratio * self.b))

        sticks = not _below(friction, abs(self.b))
        after = self.b - _sign(self.b) * friction  # k once slip has reversed; has the sign of b
        if s.is_zero():
            if sticks:
                approach = _divide(w, self.h)
                total = (1 + self.r) * approach
                return Path("stick_approach", arb(0), -self.r * w, total, approach, arb(0))
            return self._slip("slip", s, w, after, _divide(u, self.h + ratio * after))

        k = self.b + _sign(s) * friction
        rate = self.h + ratio * k
        if _sign(k) != _sign(s):
            return self._slip("slip", s, w, k, _divide(u, rate))
        switch = s / k
        # P* < P_f is u(P*) = w - h P* > 0, without a division by the rate
        left = w - self.h * switch
        unmoved = self.h.is_zero() and w.is_zero()  # P* = P_f identically
        bent = self.h if sticks else self.h + ratio * after
        if not unmoved and _below(arb(0), left):
            approach = _divide(w, self.h) if sticks else switch + left / bent
            total = _end(law, self.r, u, switch, left, bent, approach)
            return self._bent("approach", sticks, w, after, total, approach, switch)
        approach = switch if unmoved else u / rate
        total = (1 + self.r) * approach
        if not _below(switch, total):
            return self._slip("slip", s, w, k, approach, switch)
        if unmoved and sticks:
            total = total if law == "poisson" else switch
        else:
            total = _end(law, self.r, u, switch, left, bent, approach)
        return self._bent("restitution", sticks, w, after, total, approach, switch)

    def _slip(
        self, regime: str, s: arb, w: arb, k: arb, approach: arb, switch: arb | None = None
    ) -> Path:
        """Slip in one direction to the end."""
        total = (1 + self.r) * approach
        return Path(regime, s - k * total, w - self.h * total, total, approach, switch)

    def _bent(
        self, phase: str, sticks: bool, w: arb, after: arb, total: arb, approach: arb, switch: arb
    ) -> Path:
        """A path on which s falls to 0 at the impulse `switch`."""
        regime = f"{'stick' if sticks else 'reversal'}_{phase}"
        s_post = arb(0) if sticks else -after * (total - switch)
        return Path(regime, s_post, w - self.h * total, total, approach, switch)


def walk(law: Law, system: System, x1: arb, v1: arb, v2: arb) -> Impact:
    """The pendulum's impact under `law`."""
    cos, friction = _geometry(system, x1)
    planar = PlanarImpact(_ratio(system, v1 * cos - v2), friction, cos, arb(1), arb(system.mbar))
    path = planar.path(law, v1, -v2)
    return Impact(path.regime, path.s, -path.w, path.impulse, path.approach, path.switch)


def _end(law: Law, r: arb, u: arb, switch: arb, bent: arb, rate: arb, approach: arb) -> arb:
    """The whole impulse of an impact in which slip ends at the impulse `switch`.

    u falls on a straight line from `u` to `bent` at `switch`, and at `rate` from there on. At the
    rate 0 (h = 0 in stick) u stays `bent`, and `newton` ends there.
    """
    if law == "poisson":
        return (1 + r) * approach
    if rate.is_zero() and _below(bent, arb(0)):
        returned = (r**2 * u * approach + bent * (switch - approach)) / 2
        return switch if law == "newton" else switch - returned / bent
    if law == "newton":
        return switch + _divide(bent + r * u, rate)
    if _below(arb(0), bent):
        work = ((u + bent) * switch + bent * (approach - switch)) / 2
        return approach + _divide(r * (2 * rate * work).sqrt(), rate)
    # what is still to be returned after `switch`
    work = (r**2 * u * approach + bent * (switch - approach)) / 2
    return switch + _divide(bent + (bent**2 + 2 * rate * work).sqrt(), rate)


def paper(system: System, x1: arb, v1: arb, v2: arb) -> Impact:
    """The paper's formulas as printed: eqs (14), (16), (18); (19), (20) without friction."""
    m, mu = arb(system.mbar), arb(system.mu)
    c, s = (x1.cos(), x1.sin()) if system.oblique else (arb(1), arb(0))
    r = _ratio(system, v1 * c - v2)
    if system.mu == 0:
        below = m + c**2
        approach = _divide(v1 * c - v2, below)
        return Impact(
            "frictionless",
            (m - r * c**2) / below * v1 + (1 + r) * c / below * v2,
            (1 + r) * m * c / below * v1 + (c**2 - r * m) / below * v2,
            (1 + r) * approach,
            approach,
        )
    sign = 0 if v1.is_zero() else _sign(v1)
    plus, minus = c + mu * sign * s, c - mu * sign * s
    p_f = _divide(v1 * c - v2, m + c**2 + mu * sign * s * c)  # (9)
    p_star = _divide(v1, plus)  # (10)
    b2 = m + c * plus  # (17a)
    if _below(p_star, p_f):
        a = mu**2 * s**2 * c - c**3 - m * plus  # (15)
        v1_post = -minus / a * (m * v1 - r * v1 * c * minus + (1 + r) * v2 * plus)
        v2_post = (
            -(v2 * c * (c**2 - mu**2 * s**2) + (1 + r) * m * v1 * c * minus - r * m * v2 * plus) / a
        )
        approach = p_star - _divide(v2 + m * p_star, m + minus * c)
        return Impact("reversal_approach", v1_post, v2_post, (1 + r) * approach, approach)  # (14)
    v2_post = (v2 * c * plus + (1 + r) * m * v1 * c - r * m * v2) / b2  # (16b), (18b)
    if _below(p_star, (1 + r) * p_f):
        v1_post = minus / (b2 * plus) * (m * v1 - plus * (r * v1 * c - (1 + r) * v2))
        return Impact("reversal_restitution", v1_post, v2_post, (1 + r) * p_f, p_f)  # (16a)
    v1_post = (m * v1 + plus * ((1 + r) * v2 - r * v1 * c)) / b2
    return Impact("slip", v1_post, v2_post, (1 + r) * p_f, p_f)  # (18a)


poisson = partial(walk, "poisson")
#: Laws by the name that simulate and hybrid know them under.
LAWS: dict[str, Callable[[System, arb, arb, arb], Impact]] = {
    "poisson": poisson,
    "newton": partial(walk, "newton"),
    "energetic": partial(walk, "energetic"),
    "paper": paper,
}


def _geometry(system: System, x1: arb) -> tuple[arb, arb]:
    """Values of cos x1 and mu |sin x1|, or 1 and 0 for direct contact."""
    if not system.oblique:
        return arb(1), arb(0)
    return x1.cos(), arb(system.mu) * abs(x1.sin())


def _ratio(system: System, u: arb) -> arb:
    """The coefficient of restitution at the approach velocity u."""
    return arb(system.r) if system.curve is None else restitution_at(system.curve, u)


def _below(a: arb, b: arb) -> bool:
    """Whether a < b, certified either way."""
    if a < b:
        return True
    if a >= b:
        return False
    raise Undecided("a comparison in the impact law")


def _sign(a: arb) -> int:
    """Certified sign."""
    return 0 if a.is_zero() else 1 if _below(arb(0), a) else -1


def _divide(a: arb, b: arb) -> arb:
    """Quotient a / b, the impulse at the rate b; Jammed if the rate is exactly zero."""
    if b.is_zero():
        raise Jammed("the approach does not end")
    return a / b

"""Impact laws in ball arithmetic: the impulse path of the theory page, section 4, and `paper`.

With M1 l^2 = 1 and normal impulse P: dv1 = -k dP, dv2 = mbar dP, k = cos x1 + mu s |sin x1|,
s = sgn(v1); approach velocity u = v1 cos x1 - v2 > 0, du = -(mbar + k cos x1) dP. Direct contact:
cos -> 1, sin -> 0. The path ends by one of three laws, which differ only if the path bends at
v1 = 0:
    poisson     P_II = r P_I                              impulses
    newton      u = -r u0                                 velocities
    energetic   -int u dP (u < 0) = r^2 int u dP (u > 0)   work of the normal impulse
`paper` evaluates Han, Jin & Hu (2004), eqs (14), (16), (18)-(20), as printed: signed sine, cases by
(9), (10), no guards; it may leave the bodies approaching each other, and then has failed.

Edges: P* = P_f counts as restitution, P* = (1 + r) P_f as slip, |cos| = mu |sin| as sticking,
v1 = 0 at the start as sticking or as slip with s = -sgn(cos x1). Comparisons are certified;
one that the balls do not decide raises Undecided.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Literal

from flint import arb

from .contact import Undecided
from .flight import System

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


def walk(law: Law, system: System, x1: arb, v1: arb, v2: arb) -> Impact:
    """The exact impulse path to the end that `law` gives."""
    mbar, r = arb(system.mbar), arb(system.r)
    cos, friction = _geometry(system, x1)
    u = v1 * cos - v2
    if not _below(arb(0), u):
        raise ValueError("the bodies do not approach each other")
    if friction.is_zero():
        approach = _divide(u, mbar + cos * cos)
        total = (1 + r) * approach
        return Impact("frictionless", v1 - cos * total, v2 + mbar * total, total, approach)

    sticks = not _below(friction, abs(cos))
    after = cos - _sign(cos) * friction  # k once slip has reversed; has the sign of cos
    if v1.is_zero():
        return _from_rest(system, u, v2, sticks, after, cos)

    k = cos + _sign(v1) * friction
    rate = mbar + k * cos
    if _sign(k) != _sign(v1):
        approach = _divide(u, rate)
        return _slip(system, v1, v2, k, approach, None)
    switch = v1 / k
    # P* < P_f is u(P*) = -v2 - mbar P* > 0, without a division by mbar + k cos x1
    left = -v2 - mbar * switch
    wall_at_rest = system.mbar == 0 and v2.is_zero()
    if not wall_at_rest and _below(arb(0), left):
        if sticks:
            approach = _divide(-v2, mbar)
            total = _end(law, r, u, switch, left, mbar, approach)
            return Impact("stick_approach", arb(0), v2 + mbar * total, total, approach, switch)
        rate = mbar + after * cos
        approach = switch + left / rate
        total = _end(law, r, u, switch, left, rate, approach)
        v1_post = -after * (total - switch)
        return Impact("reversal_approach", v1_post, v2 + mbar * total, total, approach, switch)
    approach = switch if wall_at_rest else u / rate
    total = (1 + r) * approach
    if not _below(switch, total):
        return _slip(system, v1, v2, k, approach, switch)
    if wall_at_rest and sticks:
        total = total if law == "poisson" else switch
    else:
        total = _end(law, r, u, switch, left, mbar if sticks else mbar + after * cos, approach)
    v2_post = v2 + mbar * total
    if sticks:
        return Impact("stick_restitution", arb(0), v2_post, total, approach, switch)
    v1_post = -after * (total - switch)
    return Impact("reversal_restitution", v1_post, v2_post, total, approach, switch)


def _end(law: Law, r: arb, u: arb, switch: arb, bent: arb, rate: arb, approach: arb) -> arb:
    """The whole impulse of an impact in which slip ends at the impulse `switch`.

    u falls on a straight line from `u` to `bent` at `switch`, and at `rate` from there on. At the
    rate 0 (mbar = 0 and the tip sticks) u stays `bent`, and `newton` ends there.
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


def _from_rest(system: System, u: arb, v2: arb, sticks: bool, after: arb, cos: arb) -> Impact:
    """v1 = 0 at the start of the impact: stick in approach, or slip driven by the impact."""
    mbar, r = arb(system.mbar), arb(system.r)
    if sticks:
        approach = _divide(-v2, mbar)
        return Impact("stick_approach", arb(0), -r * v2, (1 + r) * approach, approach, arb(0))
    approach = _divide(u, mbar + after * cos)
    return _slip(system, arb(0), v2, after, approach, None)


def _slip(system: System, v1: arb, v2: arb, k: arb, approach: arb, switch: arb | None) -> Impact:
    """Slip in one direction to the end."""
    total = (1 + arb(system.r)) * approach
    return Impact("slip", v1 - k * total, v2 + arb(system.mbar) * total, total, approach, switch)


def paper(system: System, x1: arb, v1: arb, v2: arb) -> Impact:
    """The paper's formulas as printed: eqs (14), (16), (18); (19), (20) without friction."""
    m, r, mu = arb(system.mbar), arb(system.r), arb(system.mu)
    c, s = (x1.cos(), x1.sin()) if system.oblique else (arb(1), arb(0))
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

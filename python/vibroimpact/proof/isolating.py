"""The search for a certificate that motions n-1 are all; all_solutions.py judges it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

from flint import arb, arb_mat, arb_series, ctx, fmpq

from ..orbits.motion import PeriodicMotion
from ..single_impact.motions import motion_at
from ..single_impact.results import PeriodicMotions, Undecided
from .all_solutions import OneImpact, conditions_in, sure
from .files import text
from .posing import two_bodies_in_text
from .proving import proved
from .result import Proof

#: Bits of the conditions.
_PRECISION = 128
#: First and narrowest interval around a solution; that in which a search for other roots begins;
#: the narrowest that is halved.
_WIDE, _NARROW, _FIRST, _LEAST = 2**-3, 2**-44, 2**-3, fmpq(1, 2**40)
#: Intervals that are looked at.
_MOST = 200_000

#: Steps of Newton's method.
_STEPS = 12

Interval = tuple[fmpq, fmpq]


def posed_of(motions: PeriodicMotions) -> dict[str, Any]:
    """The problem: machine, n and precision."""
    system = motions.system
    rests = system.mass_ratio == 0.0 and system.force_amplitude == 0.0
    machine = two_bodies_in_text(system, rests=rests)
    return {"machine": machine, "n": motions.n, "precision": _PRECISION}


def search(motions: PeriodicMotions, proofs: list[Proof]) -> tuple[dict[str, Any], list[Undecided]]:
    """A certificate without its motions, whose proofs are put into `proofs`, and what is open."""
    posed = posed_of(motions)
    with ctx.workprec(_PRECISION):
        equations = conditions_in(posed)
        known = [*motions, *_missed(motions, equations)]
        known.sort(key=lambda motion: motion.state[0])
        low, high = _range(motions, equations)
        around, left = _around(equations, known, low, high)
        cuts: list[fmpq] = [low]
        holds: list[list[int]] = []
        for begin, end, inner in [*around, (high, high, [])]:
            for cut, why in _clear(equations, cuts[-1], begin):
                if why:
                    left.append(_open(cuts[-1], cut, why))
                cuts.append(cut)
                holds.append([])
            if begin < end:
                cuts.append(end)
                holds.append(inner)
    for motion in known:
        proofs.append(proved(motion))
        if proofs[-1].verdict == "undecided":
            x = rational(motion.state[0])
            left.append(_open(x, x, proofs[-1].why))
    return posed | {"cuts": [text(x) for x in cuts], "holds": holds}, left


def _missed(motions: PeriodicMotions, equations: OneImpact) -> list[PeriodicMotion]:
    """Solutions that double precision leaves open, where Newton's method finds them."""
    found = []
    for part in [] if equations.wall_rests else motions.undecided:
        x = arb((part.lo + part.hi) / 2)
        for _ in range(_STEPS):
            wide = equations.equation(arb_series([x, 1], 2))
            x = (x - wide[0] / wide[1]).mid() if wide[1] != 0 else x
        state = _before(equations, x)
        near = abs(float(x) - part.lo) <= 2 * (part.hi - part.lo) + 2**-40
        if near and all(map(math.isfinite, state)):
            found.append(motion_at(motions.system, motions.n, state))
    return found


def ball(low: fmpq, high: fmpq) -> arb:
    """The ball of an interval."""
    return arb((low + high) / 2, (high - low) / 2)


def _before(equations: OneImpact, x: arb) -> tuple[float, float, float, float]:
    """x1, v1, v2 and the phase before the impact of the solution at a zero of F; NaN if open."""
    (d, c, s), body = equations.parts(x), equations.bodies[0]
    cosine, sine, kappa = c / d, s / d, x.cos() if equations.oblique else arb(1)
    place, speed = (body.drive * arb_mat([[cosine], [sine]]) + body.load).entries()
    v = (place - body.keeps[0, 0] * x) / body.keeps[0, 1]
    kick = speed - body.keeps[1, 0] * x - body.keeps[1, 1] * v
    mbar, impulse = equations.number["mbar"], kick / kappa
    w = kappa * v + equations.number["rho"] * (mbar + kappa**2) * impulse
    phase = math.atan2(float(sine.mid()), float(cosine.mid()))
    before = (x, v + kick, w - mbar * impulse)
    x1, v1, v2 = (float(number.mid()) for number in before)
    return x1, v1, v2, phase


def rational(number: float) -> fmpq:
    """A float, exactly."""
    return fmpq(*number.as_integer_ratio())


def _open(low: fmpq, high: fmpq, why: str) -> Undecided:
    return Undecided(lo=float(arb(low)), hi=float(arb(high)), reason=why)


def _range(motions: PeriodicMotions, equations: OneImpact) -> Interval:
    """What was searched, and all of it if there is a bound."""
    low, high = map(rational, motions.within)
    reach = equations.reach()
    if motions.bounded and reach is not None:
        # a little beyond, in few bits
        most = rational(float(reach.upper()) * (1 + 2**-40) + 2**-40)
        low, high = min(low, -most), max(high, most)
    return low, high


def _around(
    equations: OneImpact, motions: Sequence[PeriodicMotion], low: fmpq, high: fmpq
) -> tuple[list[tuple[fmpq, fmpq, list[int]]], list[Undecided]]:
    """Intervals around the solutions in which F rises or falls, rising, with those in each."""
    places: dict[float, list[int]] = {}
    for k, motion in enumerate(motions):
        x = motion.state[0]
        same = [y for y in places if equations.wall_rests and abs(x - y) < 2**-40]
        places.setdefault(same[0] if same else x, []).append(k)
    if equations.wall_rests:  # where the wall is met, but no solution is found
        for lo, hi in _roots(equations, low, high):
            x = float(arb((lo + hi) / 2))
            if all(abs(x - y) > 2**-30 for y in places):
                places[x] = []
    found: list[tuple[fmpq, fmpq, list[int]]] = []
    left: list[Undecided] = []
    ordered = sorted(places)
    for i, x in enumerate(ordered):
        room = min([abs(x - y) for y in ordered[max(0, i - 1) : i + 2] if y != x], default=1.0) / 2
        # where a wall is met, but no solution is found, the discriminant must be negative
        width = min(_WIDE if places[x] else _NARROW * 2**10, room * 0.9)
        while width > _NARROW:
            begin, end = (rational(x + sign * width) for sign in (-1, 1))
            begin, end = max(begin, low), min(end, high)
            if begin < end and sure(equations.enclose(ball(begin, end))[1]):
                found.append((begin, end, places[x]))
                break
            width /= 2
        else:
            at = rational(x)
            left.append(_open(at, at, "a double root, or two roots too close to tell apart"))
    return found, left


def _roots(equations: OneImpact, low: fmpq, high: fmpq) -> list[Interval]:
    """Narrow intervals that may hold a root of F."""
    found: list[Interval] = []
    cut = low
    for end, why in _clear(equations, low, high):
        if why:
            found.append((cut, end))
        cut = end
    return found


def _clear(equations: OneImpact, low: fmpq, high: fmpq) -> list[tuple[fmpq, str]]:
    """Ends of intervals, from `low` to `high`, over which F has no zero; others say why not."""
    if low >= high:
        return []
    count = int((high - low) / rational(_FIRST)) + 1
    todo, found, looked = [], [], 0
    ends = [rational(float(arb(low + (high - low) * i / count))) for i in range(1, count)]
    for one in zip([*ends, high][::-1], [low, *ends][::-1], strict=True):
        todo.append(one)
    while todo:
        end, begin = todo.pop()
        looked += 1
        if sure(equations.enclose(ball(begin, end))[0]):
            found.append((end, ""))
        elif end - begin < _LEAST or looked > _MOST:
            found.append((end, "a double root, or another root"))
        else:
            middle = (begin + end) / 2
            todo += [(end, middle), (middle, begin)]
    return found

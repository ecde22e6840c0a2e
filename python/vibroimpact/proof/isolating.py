"""The search for a certificate that motions n-1 are all; all_solutions.py judges it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from flint import arb, ctx, fmpq

from ..orbits.motion import PeriodicMotion
from ..single_impact.results import PeriodicMotions, Undecided
from .all_solutions import OneImpact, ball, conditions_in
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

Interval = tuple[fmpq, fmpq]


def posed_of(motions: PeriodicMotions) -> dict[str, Any]:
    """The problem: machine, n and precision."""
    system = motions.system
    rests = system.mass_ratio == 0.0 and system.force_amplitude == 0.0
    machine = two_bodies_in_text(system, rests=rests)
    return {"machine": machine, "n": motions.n, "precision": _PRECISION}


def search(motions: PeriodicMotions) -> tuple[dict[str, Any], list[Proof], list[Undecided]]:
    """A certificate without claims, the proofs of its motions, and what is left open, with why."""
    posed, proofs = posed_of(motions), [proved(motion) for motion in motions]
    with ctx.workprec(_PRECISION):
        equations = conditions_in(posed)
        low, high = _range(motions, equations)
        around, left = _around(equations, motions, low, high)
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
    left += [
        _open(x := rational(motion.state[0]), x, proof.why)
        for motion, proof in zip(motions, proofs, strict=True)
        if proof.verdict == "undecided"
    ]
    posed |= {"cuts": [text(x) for x in cuts], "holds": holds}
    return posed, proofs, left


def rational(number: float) -> fmpq:
    """A float, exactly."""
    return fmpq(*number.as_integer_ratio())


def _open(low: fmpq, high: fmpq, why: str) -> Undecided:
    return Undecided(lo=float(arb(low)), hi=float(arb(high)), reason=why)


def _range(motions: PeriodicMotions, equations: OneImpact) -> Interval:
    """What was searched, and all of it if there is a bound."""
    low, high = map(exact_number, motions.within)
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
        same = [y for y in places if equations.rests and abs(x - y) < 2**-40]
        places.setdefault(same[0] if same else x, []).append(k)
    if equations.rests:  # where the wall is met, but no solution is found
        for lo, hi in _roots(equations, low, high):
            x = float(arb((lo + hi) / 2))
            if all(abs(x - y) > 2**-30 for y in places):
                places[x] = []
    found: list[tuple[fmpq, fmpq, list[int]]] = []
    left: list[Undecided] = []
    ordered = sorted(places)
    for i, x in enumerate(ordered):
        room = min([abs(x - y) for y in ordered[max(0, i - 1) : i + 2] if y != x], default=1.0) / 2
        width = min(_WIDE, room * 0.9)
        while width > _NARROW:
            begin, end = (rational(x + sign * width) for sign in (-1, 1))
            begin, end = max(begin, low), min(end, high)
            if begin < end and equations.rises_or_falls(ball(begin, end)):
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
    cut = low
    while todo:
        end, begin = todo.pop()
        looked += 1
        if equations.excludes(ball(begin, end)):
            found.append((end, ""))
        elif end - begin < _LEAST or looked > _MOST:
            found.append((end, "a double root, or another root"))
        else:
            middle = (begin + end) / 2
            todo += [(end, middle), (middle, begin)]
        cut = end
    return found


"""The search for a certificate; certificate.py judges it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from flint import arb, arb_mat, ctx
from numpy.typing import NDArray

from .certificate import Finding, examine, machine_in
from .files import proof_of, text
from .formulas import Undecided
from .near import near_inverse
from .posing import AnyMotion, legs_of, machine_in_text, nodes_of
from .result import Proof
from .verifier import Orbit, inside, krawczyk

Array = NDArray[np.float64]

#: A multiplier below this is 0 to rounding.
_NO_MULTIPLIER = 1e-30
#: Steps of Newton's method; part of its size by which a motion may move to its solution.
_STEPS, _NEAR = 40, 1e-3
#: Step after which the derivative is kept.
_SETTLED = 1e-8
#: Widest boxes tried, as a part of the motion's size, and narrowest, in bits above the precision.
_WIDEST, _NARROWEST, _WIDENINGS = 0.25, 24, 8


def proved(motion: AnyMotion) -> Proof:
    """What can be shown of a motion."""
    legs = legs_of(motion, free=True)
    if isinstance(legs, str):
        return Proof(verdict="undecided", why=legs, label=motion.label)
    problem = {"machine": machine_in_text(motion), "m": motion.m, "legs": legs}
    best: Proof | None = None
    for precision in _precisions(motion):
        posed, found = _examined(motion, {**problem, "precision": precision})
        if best is None or found.verdict != "undecided":
            best = proof_of(posed, found)
        if found.verdict == "disproved" or (found.verdict == "proved" and not found.why):
            break
    assert best is not None
    return best


def _examined(motion: AnyMotion, problem: dict[str, Any]) -> tuple[dict[str, Any], Finding]:
    """The problem with the box that is found for it, and what holds of it."""
    with ctx.workprec(problem["precision"]):
        try:
            posed = {**problem, "box": _box(motion, problem)}
        except Undecided as reason:
            return {**problem, "box": []}, Finding("undecided", str(reason))
        return posed, examine(posed)


def _precisions(motion: AnyMotion) -> list[int]:
    """Bits to try: enough to tell the smallest multiplier from rounding."""
    sizes = np.abs(motion.multipliers)
    least = float(sizes[sizes > _NO_MULTIPLIER].min(initial=1.0))
    first = 128 + 64 * math.ceil(max(0.0, -2.0 * math.log2(least) - 32.0) / 64)
    return [first, 2 * first, 4 * first]


def _scales(nodes: Array, omega: float) -> Array:
    """Sizes of the unknowns of a node: coordinates, speeds, time."""
    n = nodes.shape[1] // 2
    length = max(float(np.abs(nodes[:, :n]).max()), float(np.abs(nodes[:, n:-1]).max()) / omega)
    length = length or 1.0  # at rest at 0 nothing has a size
    return np.array([length] * n + [length * omega] * n + [1.0 / omega])


def _box(motion: AnyMotion, problem: dict[str, Any]) -> list[list[str]]:
    """The widest box about the solution near a motion in which it is shown to be alone."""
    nodes, precision = nodes_of(motion), problem["precision"]
    machine = machine_in(problem["machine"])
    orbit = Orbit(machine, problem["m"], tuple((stop, regime) for stop, regime in problem["legs"]))
    sizes = np.tile(_scales(nodes, motion.system.drive_frequency), len(nodes))
    z = _refined(orbit, nodes.ravel(), sizes, precision)
    scale, near = [arb(x) for x in sizes], near_inverse(orbit, z)

    def contracts(width: arb) -> arb | None:
        """The part to which a box shrinks, None where it does not lie inside."""
        box = [x + arb(0, width * s) for x, s in zip(z, scale, strict=True)]
        try:
            image = krawczyk(orbit, box, near)
        except (Undecided, ValueError, ZeroDivisionError):  # a divisor may be 0 in the box
            return None
        if not inside(image, box):
            return None
        return max(x.rad() / y.rad() for x, y in zip(image, box, strict=True))

    least = arb(2) ** -(precision - _NARROWEST)
    width = arb(2) ** -(precision // 3)
    part = contracts(width)
    while part is None and width > least:
        width /= 2**8
        part = contracts(width)
    if part is None:
        raise Undecided("Krawczyk's operator contracts in no box")
    # the part grows as the width does: that of a box that just lies inside is near 1
    for _ in range(_WIDENINGS):
        wider = min(arb(_WIDEST), 0.7 * width / part).mid()
        if wider < 1.2 * width:
            break
        found = contracts(wider)
        while found is None and wider > 1.2 * width:
            wider /= 2
            found = contracts(wider)
        if found is None:
            break
        width, part = wider, found
    return [[text(x), text((width * s).mid())] for x, s in zip(z, scale, strict=True)]


def _refined(orbit: Orbit, start: Array, sizes: Array, precision: int) -> list[arb]:
    """The solution near a motion, to working precision."""
    begin, scale = [arb(x) for x in start], [arb(s) for s in sizes]
    z, goal = begin, arb(2) ** -(precision - _NARROWEST - 4)
    inverse: list[arb_mat] | None = None
    settles = False
    for _ in range(_STEPS):
        try:
            if inverse is None or not settles:
                inverse = near_inverse(orbit, z)
            change = times(inverse, orbit.residual(z))
        except (ValueError, ZeroDivisionError) as error:
            raise Undecided("Newton's method does not converge") from error
        z = [(x - dx).mid() for x, dx in zip(z, change, strict=True)]
        moved = max(abs(x - y) / s for x, y, s in zip(z, begin, scale, strict=True))
        if not moved < _NEAR:
            raise Undecided("Newton's method finds no solution near the motion")
        last = max(abs(dx) / s for dx, s in zip(change, scale, strict=True))
        if last < goal:
            return z
        settles = last < _SETTLED
    raise Undecided("Newton's method does not converge")


def times(columns: Sequence[arb_mat], vector: Sequence[arb]) -> list[arb]:
    """A matrix in columns of blocks times a vector."""
    width, total = len(vector) // len(columns), arb_mat(len(vector), 1)
    for k, block in enumerate(columns):
        total += block * arb_mat(width, 1, vector[k * width : (k + 1) * width])
    return list(total.entries())

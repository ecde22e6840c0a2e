"""The search for a certificate; certificate.py judges it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from flint import arb, arb_mat, ctx
from numpy.typing import NDArray

from .certificate import Finding, examine, machine_in
from .formulas import Undecided
from .posing import AnyMotion, legs_of, machine_of, nodes_of, text
from .files import proof_of
from .result import Proof
from .verifier import Orbit, inside, krawczyk, near_inverse

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
    legs = legs_of(motion)
    if isinstance(legs, str):
        return Proof(verdict="undecided", why=legs, label=motion.label)
    if motion.system.law == "paper":
        return Proof(verdict="undecided", why="the law of the paper is not proved with", label=motion.label)
    problem = {"machine": machine_of(motion), "m": motion.m, "legs": legs}
    best: Proof | None = None
    for precision in _precisions(motion):
        with ctx.workprec(precision):
            try:
                box = _box(motion, problem, precision)
            except Undecided as reason:
                found, posed = Finding("undecided", str(reason)), {**problem, "precision": precision, "box": []}
            else:
                posed = {**problem, "precision": precision, "box": box}
                found = examine(posed)
        if best is None or found.verdict != "undecided":
            best = proof_of(posed, found)
        if best.verdict != "undecided" and not found.why:
            break
    assert best is not None
    return best


def _precisions(motion: AnyMotion) -> list[int]:
    """Bits to try: enough to tell the smallest multiplier from rounding."""
    sizes = np.abs(motion.multipliers)
    least = float(sizes[sizes > _NO_MULTIPLIER].min(initial=1.0))
    first = 128 + 64 * math.ceil(max(0.0, -2.0 * math.log2(least) - 32.0) / 64)
    return [first, 2 * first, 4 * first]


def _open(motion: AnyMotion, why: str) -> Proof:
    return Proof.of(motion, {}, Finding("undecided", why))


def _scales(nodes: Array, omega: float) -> Array:
    """Sizes of the unknowns of a node: coordinates, speeds, time."""
    n = nodes.shape[1] // 2
    length = max(float(np.abs(nodes[:, :n]).max()), float(np.abs(nodes[:, n:-1]).max()) / omega)
    return np.array([length] * n + [length * omega] * n + [1.0 / omega])


def _box(motion: AnyMotion, problem: dict[str, Any], precision: int) -> list[list[str]]:
    """The widest box about the solution near a motion in which it is shown to be alone."""
    nodes = nodes_of(motion)
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
        except Undecided:
            return None
        if not inside(image, box):
            return None
        return max(x.rad() / y.rad() for x, y in zip(image, box, strict=True))

    least = arb(2) ** -(precision - _NARROWEST)
    first = arb(2) ** -(precision // 3)
    width, part = first, contracts(first)
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
    z, scale = [arb(x) for x in start], [arb(s) for s in sizes]
    goal, inverse, settles = arb(2) ** -(precision - _NARROWEST - 4), None, False
    for step in range(_STEPS):
        try:
            if inverse is None or not settles:
                inverse = near_inverse(orbit, z)
            change = times(inverse, orbit.residual(z))
        except (ValueError, ZeroDivisionError) as error:
            raise Undecided("Newton's method does not converge") from error
        z = [(x - dx).mid() for x, dx in zip(z, change, strict=True)]
        moved = max(abs(x - y) / s for x, y, s in zip(z, map(arb, start), scale, strict=True))
        if not moved < _NEAR:
            raise Undecided("there is no solution near the motion")
        last = max(abs(dx) / s for dx, s in zip(change, scale, strict=True))
        if last < goal:
            return z
        settles = last < _SETTLED
    raise Undecided("Newton's method does not converge")


def times(columns: Sequence[arb_mat], vector: Sequence[arb]) -> list[arb]:
    """A matrix in columns of blocks times a vector."""
    width = len(vector) // len(columns)
    parts = (
        block * arb_mat(width, 1, vector[k * width : (k + 1) * width])
        for k, block in enumerate(columns)
    )
    return list(sum(parts, arb_mat(len(vector), 1)).entries())

"""Section 3.2.1: what of (35) can be solved in closed form."""

import math

import numpy as np

from vibroimpact import System, periodic_motions

from ..claims import Verdict
from ..parameters import paper_system
from ..printed_impact import frictionless_coefficients
from . import printed_motion as printed
from .statement import Finding, stated

TRIED = 60
# How well a solution found by intervals has to agree.
FOUND = 1e-8
# No larger force is tried.
LARGEST = 100.0


def amplitude(system: System, n: int, x10: float) -> float:
    """Return the factor of both amplitudes for which x10 solves (35), from (31) alone.

    Both enter (31) only with sin phi and cos phi, so that it gives factor times these two.
    """
    r = frictionless_coefficients(np.array(x10), system.mass_ratio, system.restitution)
    matrix, rhs = printed.linear_system(printed.period(system, n), r, x10, system.gap)
    _, _, sine, cosine = np.linalg.solve(matrix, rhs)
    return math.hypot(sine, cosine)


@stated(
    "no-analytic-solution",
    "sections 3.2.1 and 5",
    "(35) has no analytical solution; such solutions exist under special conditions only",
    page="orbits.md#all-motions-with-one-impact",
)
def explicit() -> Finding:
    """Take x10 at random, compute the amplitudes in closed form, and look for x10 by intervals."""
    random = np.random.default_rng(11)
    found = tried = 0
    while tried < TRIED:
        damping = tuple(random.uniform(0.0, 0.2, 2).tolist())
        system = paper_system(
            drive_frequency=float(random.uniform(0.3, 3.5)),
            force_amplitude=float(random.uniform(-1.0, 1.0)),
        ).replace(damping=damping)
        n, x10 = int(random.integers(1, 3)), float(random.uniform(-1.4, 1.4))
        factor = amplitude(system, n, x10)
        if factor > LARGEST:
            continue
        tried += 1
        scaled = system.replace(
            moment_amplitude=factor * system.moment_amplitude,
            force_amplitude=factor * system.force_amplitude,
        )
        near = periodic_motions(scaled, n, within=(x10 - 1e-3, x10 + 1e-3))
        found += any(abs(motion.state[0] - x10) < FOUND for motion in near)
    verdict: Verdict = "corrected" if found == tried else "open"
    return Finding(
        f"none for x10, but one for the amplitudes: x10 is found at {found} of {tried}",
        verdict,
        "(35) is explicit in the size of both amplitudes: (31) at any x10 gives it by four linear "
        f"equations, with damping and both forces. At {found} of {tried} random systems and x10 "
        "the search by intervals finds that x10 at the amplitudes so computed. A formula for x10 "
        "at given amplitudes is not known; that there is none is no matter of computation",
    )

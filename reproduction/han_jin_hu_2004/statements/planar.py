"""Section 2: impacts of any two rigid bodies in a plane, by Routh's method and in small steps.

The normal and the tangential velocity of the contact, un (negative in approach) and ut, change with
the impulses by a symmetric matrix: un by a pn + b pt, ut by b pn + c pt.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..claims import Verdict
from .statement import Finding, stated

Array = NDArray[np.float64]
BODIES = 400
STEPS = 4000
# The error of small steps, relative to the velocities, is of the order of one over their number.
STEPPED = 20.0 / STEPS


@dataclass(frozen=True)
class Impacts:
    """Impacts about to happen, one entry each."""

    a: Array
    b: Array
    c: Array
    un: Array
    ut: Array
    friction: Array
    restitution: Array


def random_bodies(count: int = BODIES) -> Impacts:
    """Draw masses, inertias and places of the contact of two bodies, and velocities."""
    random = np.random.default_rng(12)
    mass, inertia = random.uniform(0.2, 3.0, (2, 2, count))
    along, across = random.normal(size=(2, 2, count))
    return Impacts(
        a=(1.0 / mass + across**2 / inertia).sum(axis=0),
        b=-(along * across / inertia).sum(axis=0),
        c=(1.0 / mass + along**2 / inertia).sum(axis=0),
        un=-random.uniform(0.1, 2.0, count),
        ut=random.normal(size=count),
        friction=random.uniform(0.0, 1.5, count),
        restitution=random.uniform(0.0, 1.0, count),
    )


def closed(given: Impacts) -> tuple[Array, Array]:
    """Return both velocities after the impacts: two phases, in each of which they are linear."""
    side = np.sign(given.ut)
    push = -given.friction * side
    normal, slip = given.a + given.b * push, given.b + given.c * push
    with np.errstate(divide="ignore"):
        stop = np.where(slip * side < 0.0, -given.ut / slip, np.inf)
    # After slip has stopped: friction holds the contact, or is not strong enough for it.
    holds = np.abs(given.b) <= given.friction * given.c
    later = np.where(holds, -given.b / given.c, -given.friction * np.sign(given.b))
    normal_later, slip_later = given.a + given.b * later, given.b + given.c * later

    def after(impulse: Array) -> tuple[Array, Array]:
        first = np.minimum(impulse, stop)
        rest = impulse - first
        return (
            given.un + normal * first + normal_later * rest,
            given.ut + slip * first + np.where(holds, 0.0, slip_later) * rest,
        )

    with np.errstate(divide="ignore", invalid="ignore"):
        early = -given.un / normal
        late = stop - (given.un + normal * stop) / normal_later
    approach = np.where((normal > 0.0) & (early <= stop), early, late)
    return after((1.0 + given.restitution) * approach)


def stepped(given: Impacts, steps: int = STEPS) -> tuple[Array, Array]:
    """Return them by small steps of the normal impulse, in each of which friction resists slip."""
    un, ut = given.un.copy(), given.ut.copy()
    step = -given.un / given.a / steps
    total = np.zeros_like(un)
    end = np.full_like(un, np.inf)
    while True:
        going = total < end
        if not going.any():
            return un, ut
        limit = given.friction * step
        pt = np.clip(-(ut + given.b * step) / given.c, -limit, limit)
        un = np.where(going, un + given.a * step + given.b * pt, un)
        ut = np.where(going, ut + given.b * step + given.c * pt, ut)
        total = np.where(going, total + step, total)
        turned = (un >= 0.0) & np.isinf(end)
        end = np.where(turned, (1.0 + given.restitution) * total, end)


@stated(
    "no-closed-forms",
    "section 2",
    "for most oblique-impact systems no closed relation of the velocities can be found",
    page="theory.md#4-impact",
)
def closed_forms() -> Finding:
    """Write down the relation for any two bodies in a plane, and compare."""
    given = random_bodies()
    exact, near = closed(given), stepped(given)
    size = 1.0 + np.abs(given.un) + np.abs(given.ut)
    off = float(
        max((np.abs(one - other) / size).max() for one, other in zip(exact, near, strict=True))
    )
    verdict: Verdict = "corrected" if off < STEPPED else "open"
    return Finding(
        f"any two bodies in a plane have one: off by {off:.1g}, the error of small steps",
        verdict,
        f"{len(given.un)} random pairs of rigid bodies that meet at one point in a plane, with "
        "random masses, inertias, places of contact, friction up to 1.5 and restitution: "
        "Poisson's law and Coulomb friction give both velocities in closed form (two phases, "
        f"linear in the impulse: Routh), and small steps of the impulse agree to {off:.2g} "
        "of the velocities. In space, where the direction of slip turns, or with several contacts, "
        "it is not judged",
    )

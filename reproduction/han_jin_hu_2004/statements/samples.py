"""Random impacts of the paper's system, by the exact impulse path; seeds are fixed."""

from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vibroimpact import Regime, System, impact

from .. import printed_impact as printed
from ..parameters import paper_system

Table = NDArray[np.void]
IMPACTS = 20_000
FRICTION = 0.5
"""That of Fig. 8(a)."""


@cache
def impacts(
    friction: float = FRICTION,
    law: str = "poisson",
    *,
    contact: str = "oblique",
    mass_ratio: float = 0.6,
    steps: int | None = None,
    within: float = np.pi,
    size: int = IMPACTS,
) -> Table:
    """Return impacts at random angles |x1| < `within`, velocities of order one, u in (0.05, 2)."""
    random = np.random.default_rng(0)
    x1 = random.uniform(-within, within, size)
    v1, u = random.normal(size=size), random.uniform(0.05, 2.0, size)
    made = system(friction, law, contact, mass_ratio)
    table = impact(made, x1=x1, v1=v1, v2=v1 * made.slope(x1) - u, steps=steps)
    table.flags.writeable = False
    return table


def system(
    friction: float, law: str = "poisson", contact: str = "oblique", mass_ratio: float = 0.6
) -> System:
    """Return the paper's system with another law, contact or mass ratio."""
    changes: dict[str, Any] = {"law": law, "contact": contact, "mass_ratio": mass_ratio}
    friction = friction if contact == "oblique" else 0.0
    return paper_system(friction=friction).replace(**changes)


def before(table: Table, friction: float, *, absolute: bool) -> printed.Before:
    """Return the states before the impacts, for the printed formulas."""
    made = system(friction)
    return printed.Before(
        x1=table["x1"],
        v1=table["v1_pre"],
        v2=table["v2_pre"],
        mass_ratio=made.mass_ratio,
        restitution=made.restitution,
        friction=friction,
        absolute=absolute,
    )


def states_before(hits: Table) -> NDArray[np.float64]:
    """Return the states x1, v1, x2, v2 just before the impacts of a run, shape (n, 4)."""
    return np.column_stack([hits[name] for name in ("x1", "v1_pre", "x2", "v2_pre")])


def in_regime(table: Table, *regimes: Regime) -> Table:
    """Return the impacts of some regimes."""
    return table[np.isin(table["regime"], [int(regime) for regime in regimes])]


def off(table: Table, pair: printed.Pair) -> float:
    """Largest difference of both velocities after the impact, relative to those before."""
    size = 1.0 + np.abs(table["v1_pre"]) + np.abs(table["v2_pre"])
    first, second = np.abs(pair[0] - table["v1_post"]), np.abs(pair[1] - table["v2_post"])
    return float((np.maximum(first, second) / size).max(initial=0.0))

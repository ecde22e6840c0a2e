"""Where Newton's method is to start: the solutions in an interval of x1, and what is left open."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .algebraic import Conditions
from .intervals import Interval
from .open_phase import cuts, is_finite, is_open
from .solutions import Solutions, states_before

Array = NDArray[np.float64]
# (x1, v1, v2, phase) just before the impact.
State = tuple[float, float, float, float]

CLOSE = "a double root, or two roots too close to tell apart"
OPEN = "the conditions leave the drive phase open here"


@dataclass(frozen=True)
class Starts:
    """Solutions in an interval of x1 of shape (1,), and why there may be others, "" if not."""

    box: Interval
    states: list[State]
    reason: str = ""

    @property
    def ends(self) -> tuple[float, float]:
        """The ends of the interval."""
        return float(self.box.lo[0]), float(self.box.hi[0])


# Beyond the range of floats an interval is the whole line, or NaN, which decides nothing.
@np.errstate(over="ignore", invalid="ignore")
def starts_in(equations: Conditions, box: Interval, state: State) -> Starts:
    """Return the solutions in a box of x1.

    ``state`` is that of the only solution in the box; where there is none such, it is NaN.
    """
    if not math.isnan(state[0]):
        return Starts(box, [state])
    if not is_finite(equations, box):
        return Starts(box, [], "numbers beyond the range of floats")
    if not is_open(equations, float(box.middle[0])):
        return Starts(box, [], CLOSE)
    points, complete = cuts(equations, box)
    return Starts(box, states_of(equations, points), "" if complete else OPEN)


def states_of(equations: Conditions, points: list[Array]) -> list[State]:
    """Return the states of solutions (x1, V, W, P, cos psi, sin psi) of the first system."""
    values = np.array(points).reshape(-1, 6)
    which = np.zeros(len(points), dtype=np.int64)
    sure = np.ones(len(points), dtype=bool)
    at = Interval(values[:, 0])
    found = states_before(equations, which, at, sure, values[:, 0], values[:, 1:])
    return [state_of(found, k) for k in range(len(found))]


def state_of(found: Solutions, k: int) -> State:
    """Return the state of a solution."""
    columns = (found.x1, found.v1, found.v2, found.phase)
    x1, v1, v2, phase = (float(column[k]) for column in columns)
    return x1, v1, v2, phase

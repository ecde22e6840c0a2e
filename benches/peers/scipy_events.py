"""SciPy: ``solve_ivp`` with a terminal event at contact, restarted after it.

Written as a user of SciPy would write it, with what the documentation recommends: the gap as a
terminal event of direction +1, plain Python floats in the right-hand side (quicker than arrays of
four), the constant Jacobian given to LSODA, and no dense output but for the sections that are asked
for.
"""

import importlib
import math
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .law import resolve
from .outcome import Outcome, Problem, Solve, most_impacts, one_by_one, penetration

NAME = "SciPy"
SETTING = "DOP853, terminal event"
LACKS = "two crossings within one step; chatter; sustained contact"
TOLERANCES = tuple(10.0**-digits for digits in (4, 6, 8, 10, 12, 13))
# RK45 and Radau were slower at every error that they reached.
METHODS = ("DOP853", "LSODA")

# After a false event at the very start, the time by which the state is pushed on.
NUDGE = 1e-9


def missing() -> str:
    """Why this peer cannot run here; empty if it can."""
    try:
        importlib.import_module("scipy.integrate")
    except ImportError:
        return "not installed"
    return ""


def right_hand_side(
    p: dict[str, float], omega: float
) -> tuple[Callable[..., Any], Callable[..., float], NDArray[np.float64]]:
    """Free motion, gap, and the constant Jacobian of the free motion."""
    omega0, phase = p["frequency_ratio"], p.get("phase", 0.0)
    d1, d2 = 2.0 * p["pendulum_damping"] * omega0, 2.0 * p["oscillator_damping"]
    stiffness = omega0 * omega0
    f1, f2 = p["moment_amplitude"], p["force_amplitude"]
    delta = p["gap"]
    cos, sin = math.cos, math.sin

    def motion(t: float, y: NDArray[np.float64]) -> tuple[float, ...]:
        x1, v1, x2, v2 = y.tolist()
        drive = cos(omega * t + phase)
        return v1, f1 * drive - d1 * v1 - stiffness * x1, v2, f2 * drive - d2 * v2 - x2

    def gap(_t: float, y: NDArray[np.float64]) -> float:
        return sin(y[0]) - y[2] - delta  # type: ignore[no-any-return]

    gap.terminal = True  # type: ignore[attr-defined]
    gap.direction = 1.0  # type: ignore[attr-defined]
    jacobian = [[0, 1, 0, 0], [-stiffness, -d1, 0, 0], [0, 0, 0, 1], [0, 0, -1, -d2]]
    return motion, gap, np.array(jacobian, dtype=np.float64)


def prepare(problem: Problem, tolerance: float = 1e-12, method: str = "DOP853") -> Solve:
    """Return what solves the problem at given drive frequencies."""
    solve_ivp = importlib.import_module("scipy.integrate").solve_ivp
    p = problem.parameters

    def solve_one(omega: float, periods: int, keep: int, samples: int) -> Outcome:
        motion, gap, jacobian = right_hand_side(p, omega)
        implicit = {"jac": lambda _t, _y: jacobian} if method == "LSODA" else {}
        period = 2.0 * math.pi / omega
        end = periods * period
        grid = np.linspace((periods - keep) * period, end, keep * samples + 1)[1:]
        t, y = 0.0, np.array(problem.initial)
        rows, section = [], []
        impacts = evaluations = false_events = 0
        ended = ""
        while True:
            try:
                leg = solve_ivp(
                    motion,
                    (t, end),
                    y,
                    method=method,
                    t_eval=grid[np.searchsorted(grid, t, side="right") :],
                    events=gap,
                    rtol=tolerance,
                    atol=tolerance,
                    **implicit,
                )
            except ValueError as error:
                # The root finder's, where an event lies at the end of a step (scipy#17066).
                ended = f"ValueError: {error}"
                break
            evaluations += leg.nfev
            if len(leg.t):
                rows.append(leg.y.T)
            if leg.status != 1:
                ended = "" if leg.status == 0 else leg.message
                break
            if impacts + false_events >= most_impacts(periods):
                ended = "too many contacts"
                break
            t, y = float(leg.t_events[0][0]), leg.y_events[0][0].copy()
            x1, v1, _, v2 = y.tolist()
            if v1 * math.cos(x1) - v2 > 0.0:
                impacts += 1
                if t > end - keep * period:
                    section.append((x1, v1, v2, (omega * t + p.get("phase", 0.0)) % math.tau))
                y[1], y[3] = resolve(p, x1, v1, v2)
            else:
                false_events += 1
                y += NUDGE * np.array(motion(t, y))
                t += NUDGE
                if t >= end:
                    rows.append(y[None])
                    break
        stroboscopic = np.concatenate(rows) if rows else np.empty((0, 4))
        return Outcome(
            stroboscopic=stroboscopic,
            impact_section=np.array(section).reshape(-1, 4),
            impacts=impacts,
            false_events=false_events,
            penetration=penetration(stroboscopic, p["gap"]),
            evaluations=evaluations,
            ended=ended,
        )

    return one_by_one(solve_one)

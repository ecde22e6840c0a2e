"""The same motions by SciPy: ``solve_ivp`` with a terminal event at contact, restarted after it.

Written as a user of SciPy would write it, with what the documentation recommends: the gap as a
terminal event of direction +1, plain Python floats in the right-hand side (quicker than arrays of
four), the constant Jacobian given to the implicit methods, and no dense output, since only the
state at the end is asked for. The impact law is that of docs/theory.md section 4, coded again here
in Python and sharing nothing with the core.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.integrate import solve_ivp

from scenes import Scene, State

METHODS = ("DOP853", "RK45", "LSODA", "Radau")

# After a false event at the very start, the time by which the state is pushed on.
NUDGE = 1e-9
# No scene has more than 100 impacts in its 25 periods.
MAX_LEGS = 2_000


@dataclass(frozen=True)
class Outcome:
    """State at the end and what it took to get there.

    ``false_events`` counts contacts reported at a restart, where the bodies are separating;
    ``penetration`` is the largest gap g > 0 at the end of a step: bodies inside one another.
    """

    state: State
    impacts: int
    evaluations: int
    false_events: int
    penetration: float
    finished: bool


def resolve(parameters: dict[str, float], x1: float, v1: float, v2: float) -> tuple[float, float]:
    """Velocities after an impact: Poisson's law on the walk over the normal impulse."""
    mbar, r = parameters["mass_ratio"], parameters["restitution"]
    c, friction = math.cos(x1), parameters["friction"] * abs(math.sin(x1))
    u = v1 * c - v2
    sticks = abs(c) <= friction
    # The second leg: held at v1 = 0, or slipping back with s = -sgn(cos x1).
    k_after = 0.0 if sticks else c - math.copysign(friction, c)
    k = c + math.copysign(friction, v1) if v1 != 0.0 else k_after

    rate = mbar + k * c
    until_stop = v1 / k if k != 0.0 else math.inf
    approach = u / rate if rate > 0.0 else math.inf
    if v1 == 0.0 or friction == 0.0 or until_stop <= 0.0:
        until_stop = math.inf
    if until_stop < approach:
        u_left = -(v2 + mbar * until_stop)
        approach = until_stop + u_left / (mbar + k_after * c)
    impulse = (1.0 + r) * approach
    before, after = min(impulse, until_stop), max(impulse - until_stop, 0.0)
    v1_stop = 0.0 if after > 0.0 else v1 - k * before
    return v1_stop - k_after * after, v2 + mbar * impulse


def right_hand_side(
    parameters: dict[str, float],
) -> tuple[Callable[..., tuple[float, ...]], Callable[..., float], np.ndarray]:
    """Free motion, gap, and the constant Jacobian of the free motion."""
    omega0, omega = parameters["frequency_ratio"], parameters["drive_frequency"]
    d1 = 2.0 * parameters["pendulum_damping"] * omega0
    d2 = 2.0 * parameters["oscillator_damping"]
    stiffness = omega0 * omega0
    f1, f2 = parameters["moment_amplitude"], parameters["force_amplitude"]
    delta = parameters["gap"]
    cos, sin = math.cos, math.sin

    def motion(t: float, y: np.ndarray) -> tuple[float, ...]:
        x1, v1, x2, v2 = y.tolist()
        drive = cos(omega * t)
        return v1, f1 * drive - d1 * v1 - stiffness * x1, v2, f2 * drive - d2 * v2 - x2

    def gap(_t: float, y: np.ndarray) -> float:
        return sin(y[0]) - y[2] - delta

    gap.terminal = True  # type: ignore[attr-defined]
    gap.direction = 1.0  # type: ignore[attr-defined]
    jacobian = np.array(
        [[0, 1, 0, 0], [-stiffness, -d1, 0, 0], [0, 0, 0, 1], [0, 0, -1, -d2]], dtype=float
    )
    return motion, gap, jacobian


def simulate(scene: Scene, periods: int, method: str, rtol: float, atol: float) -> Outcome:
    """Follow a scene over so many drive periods with one SciPy method and tolerance."""
    parameters = scene.parameters
    motion, gap, jacobian = right_hand_side(parameters)
    implicit = {"jac": jacobian} if method == "Radau" else {}
    if method == "LSODA":
        implicit = {"jac": lambda _t, _y: jacobian}
    end = periods * scene.drive_period
    t, y = 0.0, np.array(scene.initial)
    impacts = evaluations = false_events = 0
    penetration = 0.0
    for _ in range(MAX_LEGS):
        leg = solve_ivp(
            motion, (t, end), y, method=method, events=gap, rtol=rtol, atol=atol, **implicit
        )
        evaluations += leg.nfev
        inside = np.sin(leg.y[0, 1:]) - leg.y[2, 1:] - parameters["gap"]
        penetration = max(penetration, float(inside.max(initial=0.0)))
        if leg.status != 1:
            x1, v1, x2, v2 = leg.y[:, -1].tolist()
            finished = leg.status == 0
            break
        t, y = float(leg.t_events[0][0]), leg.y_events[0][0].copy()
        x1, v1, x2, v2 = y.tolist()
        if v1 * math.cos(x1) - v2 > 0.0:
            impacts += 1
            y[1], y[3] = resolve(parameters, x1, v1, v2)
        else:
            false_events += 1
            y += NUDGE * np.array(motion(t, y))
            t += NUDGE
    else:
        finished = False
    return Outcome((x1, v1, x2, v2), impacts, evaluations, false_events, penetration, finished)

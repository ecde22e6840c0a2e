"""SciPy: ``solve_ivp`` with every stop a terminal event, restarted after each impact."""

from typing import Any

import numpy as np
from scipy.integrate import solve_ivp

from structure_scenes import Modal, Outcome, Scene, Solve, Vector

NAME = "SciPy DOP853"
TOLERANCES = (1e-6, 1e-9, 1e-12)


def missing() -> str:
    """Empty: the package's own tests need SciPy, too."""
    return ""


def prepare(scene: Scene, tolerance: float) -> Solve:
    """Return what follows the scene."""
    modal = Modal.of(scene.structure)
    count = len(modal.w)
    stiffness, damping = -(modal.w**2), -2.0 * modal.d
    omega, real, imaginary = modal.omega, modal.f.real, modal.f.imag

    def motion(t: float, y: Vector) -> Vector:
        p, v = y[:count], y[count:]
        force = real * np.cos(omega * t) - imaginary * np.sin(omega * t)
        return np.concatenate([v, stiffness * p + damping * v + force])

    def event(j: int) -> Any:
        row, gap = modal.normals[j], modal.gaps[j]

        def met(_t: float, y: Vector) -> float:
            return float(row @ y[:count] - gap)

        met.terminal = True  # type: ignore[attr-defined]
        met.direction = 1.0  # type: ignore[attr-defined]
        return met

    events = [event(j) for j in range(len(modal.gaps))]

    def solve(periods: int) -> Outcome:
        t, y, impacts = 0.0, np.zeros(2 * count), 0
        while True:
            try:
                leg = solve_ivp(
                    motion,
                    (t, scene.end(periods)),
                    y,
                    method="DOP853",
                    t_eval=[scene.end(periods)],
                    events=events,
                    rtol=tolerance,
                    atol=tolerance,
                )
            except ValueError as error:
                # The root finder's, where an event lies at the end of a step (scipy#17066).
                return Outcome(np.full((2, count), np.nan), impacts, f"ValueError: {error}")
            if leg.status != 1:
                p, v = leg.y[:count, -1], leg.y[count:, -1]
                return Outcome(np.array([modal.shapes @ p, modal.shapes @ v]), impacts)
            stop = next(j for j, times in enumerate(leg.t_events) if len(times))
            t, y = float(leg.t_events[stop][0]), leg.y_events[stop][0].copy()
            u = float(modal.normals[stop] @ y[count:])
            if u > 0.0:
                y[count:] -= modal.kicks[stop] * u
                impacts += 1
            else:
                y, t = y + 1e-9 * motion(t, y), t + 1e-9

    return solve

"""heyoka.py's batch integrator: as many copies of the scene as a register has lanes, all at once.

Equations, events and the impact are those of heyoka_modal.py. Its time is that of all copies,
divided by their number: what one of many structures costs, of which each goes its own way.
"""

import importlib
from typing import Any

import numpy as np
from heyoka_modal import COMPACT_FROM, FASTEST, TOLERANCES, compiled_impact, equations, missing

from structure_scenes import Modal, Outcome, Scene, Solve

NAME = "heyoka.py batch"
LANES = 8

__all__ = ["LANES", "NAME", "TOLERANCES", "missing", "prepare"]


def prepare(scene: Scene, tolerance: float) -> Solve:
    """Return what follows the copies of the scene."""
    hy = importlib.import_module("heyoka")
    modal = Modal.of(scene.structure)
    count = len(modal.w)
    motion, gaps = equations(modal)
    impact = compiled_impact(modal)
    impacts = [0] * LANES
    lanes: list[Any] = []

    def event(j: int) -> Any:
        def strike(_ta: Any, _direction: int, lane: int) -> bool:
            # A lane's column is a view, made once.
            if impact(lanes[lane], j):
                impacts[lane] += 1
            return impacts[lane] < 100_000

        return hy.t_event_batch(gaps[j], callback=strike, direction=hy.event_direction.positive)

    start = np.zeros((2 * count + 2, LANES))
    start[-2] = 1.0
    # No two lanes do quite the same at once; the first one is the scene itself.
    start[:count] += 1e-3 * np.arange(LANES)
    integrator = hy.taylor_adaptive_batch(
        motion,
        start,
        t_events=[event(j) for j in range(len(gaps))],
        tol=tolerance,
        compact_mode=count >= COMPACT_FROM,
        # Lanes of 512 bits where the processor has them.
        force_avx512=True,
        **FASTEST,
    )
    lanes += [integrator.state[:, lane] for lane in range(LANES)]

    def solve(periods: int) -> Outcome:
        impacts[:] = [0] * LANES
        integrator.reset_cooldowns()
        integrator.set_time(np.zeros(LANES))
        integrator.state[:] = start
        integrator.propagate_until(np.full(LANES, scene.end(periods)))
        p, v = integrator.state[:count, 0], integrator.state[count : 2 * count, 0]
        ended = "" if max(impacts) < 100_000 else "too many contacts"
        return Outcome(np.array([modal.shapes @ p, modal.shapes @ v]), impacts[0], ended)

    return solve

"""heyoka.py's batch integrator: eight drive frequencies at once, one in each SIMD lane.

The system, its event and the impact are those of heyoka_events.py.
"""

import importlib
import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from . import heyoka_events
from .heyoka_events import FASTEST, compiled_impact, equations, missing
from .outcome import Outcome, Problem, Solve, most_impacts, penetration

NAME = "heyoka.py batch"
LANES = 8
SETTING = f"{LANES} lanes, compiled impact law"
LACKS = heyoka_events.LACKS
TOLERANCES = heyoka_events.TOLERANCES

__all__ = ["LACKS", "LANES", "NAME", "SETTING", "TOLERANCES", "missing", "prepare"]


def prepare(problem: Problem, tolerance: float = 1e-12) -> Solve:
    """Return what solves the problem at given drive frequencies, eight at a time."""
    hy = importlib.import_module("heyoka")
    motion, gap = equations(problem)
    impact = compiled_impact(problem)
    counts = [[0] * LANES, [0] * LANES]
    limit = [0]
    sections = [np.empty((1, 4))] * LANES
    lanes: list[Any] = []

    def strike(ta: Any, _direction: int, lane: int) -> bool:
        # A lane's column is a view, made once.
        if impact(lanes[lane], sections[lane][counts[0][lane]]):
            counts[0][lane] += 1
        else:
            counts[1][lane] += 1
        return counts[0][lane] + counts[1][lane] < limit[0]

    event = hy.t_event_batch(gap, callback=strike, direction=hy.event_direction.positive)
    phase = problem.parameters.get("phase", 0.0)
    start = np.array([*problem.initial, math.cos(phase), math.sin(phase)])
    begin_state = np.repeat(start[:, None], LANES, axis=1)
    integrator = hy.taylor_adaptive_batch(
        motion,
        begin_state,
        pars=np.full((1, LANES), problem.frequency),
        t_events=[event],
        tol=tolerance,
        # Lanes of 512 bits where the processor has them.
        force_avx512=True,
        **FASTEST,
    )
    lanes += [integrator.state[:, lane] for lane in range(LANES)]

    def solve_batch(
        frequencies: Sequence[float], periods: int, keep: int, samples: int
    ) -> list[Outcome]:
        asked = len(frequencies)
        # The last lanes of an incomplete batch repeat its last frequency.
        omegas = np.array([*frequencies, *[frequencies[-1]] * (LANES - asked)])
        limit[0] = most_impacts(periods)
        for lane in range(LANES):
            counts[0][lane] = counts[1][lane] = 0
            sections[lane] = np.empty((limit[0] + 1, 4))
        integrator.reset_cooldowns()
        integrator.set_time(np.zeros(LANES))
        integrator.pars[0, :] = omegas
        integrator.state[:] = begin_state
        period = 2.0 * np.pi / omegas
        begin = (periods - keep) * period
        if periods > keep:
            integrator.propagate_until(begin)
        first = list(counts[0])
        steps = np.arange(keep * samples + 1)[:, None] / samples
        grid = begin + steps * period
        # Where a lane was stopped its time is not the grid's start; such a batch is given up.
        stopped = [counts[0][lane] + counts[1][lane] >= limit[0] for lane in range(LANES)]
        rows = np.full((keep * samples, 6, LANES), np.nan)
        if not any(stopped):
            grid[0] = integrator.time
            rows = integrator.propagate_grid(grid)[-1][1:]
            stopped = [counts[0][lane] + counts[1][lane] >= limit[0] for lane in range(LANES)]
        return [
            Outcome(
                stroboscopic=rows[:, :4, lane],
                impact_section=sections[lane][first[lane] : counts[0][lane]],
                impacts=counts[0][lane],
                false_events=counts[1][lane],
                penetration=penetration(rows[:, :4, lane], problem.parameters["gap"]),
                ended="too many contacts" if any(stopped) else "",
            )
            for lane in range(asked)
        ]

    def solve(
        frequencies: Sequence[float], periods: int, keep: int, samples: int = 1
    ) -> list[Outcome]:
        outcomes: list[Outcome] = []
        for index in range(0, len(frequencies), LANES):
            batch = frequencies[index : index + LANES]
            outcomes += solve_batch(batch, periods, keep, samples)
        return outcomes

    return solve

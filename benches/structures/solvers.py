"""Run time and error of every solver on every scene, and the cost of sweeps, measured in rounds.

A round runs vibroimpact and then each configuration of each peer once, so a ratio compares two runs
made within the same second or so of one another; reported are medians over the rounds.
"""

import math
import statistics
from collections.abc import Sequence
from dataclasses import dataclass
from time import perf_counter
from typing import Any

import heyoka_modal
import heyoka_modal_batch
import numba_modal
import numpy as np
import scipy_stops

import vibroimpact as vi
from structure_scenes import Outcome, Scene, Solve

CORE = "vibroimpact"
PEERS = (heyoka_modal, heyoka_modal_batch, numba_modal, scipy_stops)
# A call of some microseconds is repeated for this long in each round.
SHORTEST = 0.02
# A run that takes longer than this is timed once, and no tighter tolerance is tried.
LONGEST = 2.0
# The run that is timed is so many times as long as the one whose end is known exactly.
TIMES_LONGER = 10


@dataclass(frozen=True)
class Row:
    """A solver at one tolerance on a scene: a long run that is timed, and the error of its start.

    ``seconds`` are those of the whole run, set-up included; of a batch, its part for one run.
    """

    scene: str
    solver: str
    tolerance: float | None
    seconds: float
    periods: int
    impacts: int
    first_impacts: int
    first_expected: int
    error: float
    ratio: float
    ended: str
    rounds: int


@dataclass(frozen=True)
class Swept:
    """A sweep: nanoseconds per drive period and per impact of each round, by number of threads."""

    name: str
    workers: int
    per_period: tuple[float, ...]
    per_impact: tuple[float, ...]


def core(scene: Scene) -> Solve:
    """Return what follows the scene here, and keeps the state at its end."""
    rest = np.zeros((2, len(scene.structure.mass)))

    def solve(periods: int) -> Outcome:
        run = vi.simulate(scene.structure, initial=rest, periods=periods, keep=1)
        ended = "" if run.stop_reason == "completed" else run.stop_reason
        return Outcome(run.stroboscopic[-1], run.impact_count, ended)

    return solve


def measure_scene(scene: Scene, rounds: int, *, longest: float = LONGEST) -> list[Row]:
    """Measure all solvers that can run here."""
    trials: list[tuple[str, float | None, int, Solve, Outcome, float]] = []
    solve = core(scene)
    trials.append((CORE, None, 1, solve, solve(scene.periods), 0.0))
    long = TIMES_LONGER * scene.periods
    for peer in PEERS:
        for tolerance in () if peer.missing() else peer.TOLERANCES:
            solve = peer.prepare(scene, tolerance)
            outcome = solve(scene.periods)
            start = perf_counter()
            solve(scene.periods)
            elapsed = TIMES_LONGER * (perf_counter() - start)
            # A batch makes as many runs as it has lanes.
            made = getattr(peer, "LANES", 1)
            trials.append((peer.NAME, tolerance, made, solve, outcome, elapsed))
            if elapsed > longest:
                break
    seconds: list[list[float]] = [[] for _ in trials]
    impacts = [0 for _ in trials]
    for index in range(rounds):
        for place, (_, _, made, solve, _, elapsed) in enumerate(trials):
            if index == 0 or elapsed <= longest:
                time, impacts[place] = _time(solve, long)
                seconds[place].append(time / made)
    return [
        Row(
            scene=scene.title,
            solver=name,
            tolerance=tolerance,
            seconds=statistics.median(times),
            periods=long,
            impacts=count,
            first_impacts=first.impacts,
            first_expected=scene.impacts,
            error=scene.error(first.state.tolist()) if not first.ended else math.inf,
            ratio=statistics.median(
                time / ours for time, ours in zip(times, seconds[0], strict=False)
            ),
            ended=first.ended,
            rounds=len(times),
        )
        for (name, tolerance, _, _, first, _), times, count in zip(
            trials, seconds, impacts, strict=True
        )
    ]


# Drive frequencies at which the motion is chaotic: none repeats, and every impact is computed.
CHAOTIC = (1.55, 1.575, 1.585, 1.875, 1.9, 1.925, 1.95, 1.975)
CHAOTIC += (2.5, 2.525, 2.6, 2.61, 2.9, 2.925, 2.95, 2.975)
CHAOTIC_TWO = (0.8, 0.81, 0.82, 0.825, 0.875, 0.88, 0.97, 0.975)
SWEPT_PERIODS = 600


def measure_sweeps(scene: Scene, rounds: int, threads: Sequence[int]) -> list[Swept]:
    """Measure sweeps over chaotic motions: of ``System``, Fig. 4 of the paper, and a structure."""
    system = vi.System(
        mass_ratio=0.6,
        frequency_ratio=2.0,
        restitution=0.8,
        gap=0.5,
        drive_frequency=1.0,
        moment_amplitude=1.0,
    )
    rest = np.zeros((2, len(scene.structure.mass)))
    given: list[tuple[str, Any, Any, Any]] = [
        ("System", system, [0.0, 0.5, 0.0, 0.0], np.repeat(CHAOTIC, 4)),
        (scene.title, scene.structure, rest, np.repeat(CHAOTIC_TWO, 8)),
    ]
    # The same motion again: all lanes and threads have work, and none is found to repeat.
    seconds: dict[tuple[str, int], list[float]] = {}
    impacts = {
        name: sum(
            vi.simulate(
                machine.replace(drive_frequency=float(omega)),
                initial=start,
                periods=SWEPT_PERIODS,
                keep=1,
            ).impact_count
            for omega in frequencies
        )
        for name, machine, start, frequencies in given
    }
    for _ in range(rounds):
        for workers in threads:
            for name, machine, start, frequencies in given:
                begin = perf_counter()
                vi.bifurcation_diagram(
                    machine,
                    initial=start,
                    drive_frequency=frequencies,
                    periods=SWEPT_PERIODS,
                    keep=1,
                    workers=workers,
                )
                elapsed = perf_counter() - begin
                seconds.setdefault((name, workers), []).append(elapsed)
    return [
        Swept(
            name,
            workers,
            per_period=tuple(1e9 * time / (64 * SWEPT_PERIODS) for time in times),
            per_impact=tuple(1e9 * time / impacts[name] for time in times),
        )
        for (name, workers), times in seconds.items()
    ]


def _time(solve: Solve, periods: int) -> tuple[float, int]:
    """Mean time of a call, and its impacts."""
    calls, start, elapsed = 0, perf_counter(), 0.0
    while elapsed < SHORTEST:
        outcome = solve(periods)
        calls += 1
        elapsed = perf_counter() - start
    return elapsed / calls, outcome.impacts

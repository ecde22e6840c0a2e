"""Run time and error of every solver on every scene, measured in rounds.

A round runs vibroimpact and then each SciPy configuration once, so a ratio compares two runs made
within the same second or so of one another; reported are medians over the rounds. vibroimpact has
one point per scene: its flights are closed forms and there is no step tolerance to vary.
"""

import math
import statistics
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from time import perf_counter

from tqdm import tqdm

import scipy_events
import vibroimpact as vi
from scenes import Scene

CORE = "vibroimpact"
TOLERANCES = tuple(10.0**-digits for digits in range(3, 14))

# A call of some microseconds is repeated for this long in each round.
SHORTEST_TIMING = 0.01


@dataclass(frozen=True)
class Row:
    """One point of the diagram; ``rtol`` is None for vibroimpact, whose ratio is 1."""

    scene: str
    solver: str
    rtol: float | None
    seconds: float
    ratio: float
    error: float
    impacts: int
    impacts_expected: int
    evaluations: int | None
    false_events: int
    penetration: float
    finished: bool
    rounds: int


def measure(scenes: Sequence[Scene], *, periods: int, rounds: int, max_seconds: float) -> list[Row]:
    """Measure every scene.

    Parameters
    ----------
    scenes : sequence of Scene
        Problems with reference states.
    periods : int
        Drive periods to follow; the error is taken at the end of them.
    rounds : int
        Repetitions; medians are reported.
    max_seconds : float
        A method is not tried at a tighter tolerance once a run has taken longer than this.
    """
    rows: list[Row] = []
    for scene in tqdm(scenes, unit="scene"):
        rows += _measure_scene(scene, periods, rounds, max_seconds)
    return rows


def _measure_scene(scene: Scene, periods: int, rounds: int, max_seconds: float) -> list[Row]:
    system = vi.System(**scene.parameters)
    run = vi.simulate(system, initial=scene.initial, periods=periods)
    final = run.final_state
    outcomes = dict(_affordable(scene, periods, max_seconds))
    core_seconds: list[float] = []
    seconds: dict[tuple[str, float], list[float]] = {key: [] for key in outcomes}
    for _ in range(rounds):
        core_seconds.append(_time_core(system, scene, periods))
        for (method, rtol), times in seconds.items():
            start = perf_counter()
            scipy_events.simulate(scene, periods, method, rtol, rtol)
            times.append(perf_counter() - start)

    expected = scene.impacts(periods)
    rows = [
        Row(
            scene=scene.name,
            solver=CORE,
            rtol=None,
            seconds=statistics.median(core_seconds),
            ratio=1.0,
            error=scene.error(periods, (final.x1, final.v1, final.x2, final.v2)),
            impacts=len(run.impacts),
            impacts_expected=expected,
            evaluations=None,
            false_events=0,
            penetration=0.0,
            finished=run.stop_reason == "completed",
            rounds=rounds,
        )
    ]
    for (method, rtol), outcome in outcomes.items():
        times = seconds[method, rtol]
        ratios = [time / core for time, core in zip(times, core_seconds, strict=True)]
        rows.append(
            Row(
                scene=scene.name,
                solver=method,
                rtol=rtol,
                seconds=statistics.median(times),
                ratio=statistics.median(ratios),
                error=scene.error(periods, outcome.state) if outcome.finished else math.inf,
                impacts=outcome.impacts,
                impacts_expected=expected,
                evaluations=outcome.evaluations,
                false_events=outcome.false_events,
                penetration=outcome.penetration,
                finished=outcome.finished,
                rounds=rounds,
            )
        )
    return rows


def _affordable(
    scene: Scene, periods: int, max_seconds: float
) -> Iterable[tuple[tuple[str, float], scipy_events.Outcome]]:
    """Run each method at ever tighter tolerances, until a run takes too long."""
    for method in scipy_events.METHODS:
        for rtol in TOLERANCES:
            start = perf_counter()
            outcome = scipy_events.simulate(scene, periods, method, rtol, rtol)
            yield (method, rtol), outcome
            if perf_counter() - start > max_seconds:
                break


def _time_core(system: vi.System, scene: Scene, periods: int) -> float:
    """Mean time of a call that asks, as SciPy is asked, for the end only."""
    calls, start, elapsed = 0, perf_counter(), 0.0
    while elapsed < SHORTEST_TIMING:
        vi.simulate(system, initial=scene.initial, periods=periods, keep=1)
        calls += 1
        elapsed = perf_counter() - start
    return elapsed / calls

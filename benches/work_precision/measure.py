"""Run time and error of every solver on every scene, measured in rounds.

A round runs vibroimpact and then each configuration of each peer once, so a ratio compares two runs
made within the same second or so of one another; reported are medians over the rounds. vibroimpact
has one point per scene: its flights are closed forms and there is no step tolerance to vary.
"""

import math
import statistics
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import partial
from time import perf_counter

import numpy as np

import vibroimpact as vi
from peers import cvode_events, heyoka_events, numba_flights, scipy_events
from peers.outcome import Outcome, Solve, penetration
from progress import step
from scenes import Scene

CORE = "vibroimpact"
# The batch integrator is for many runs, not for one.
PEERS = (
    (heyoka_events.NAME, heyoka_events, heyoka_events.prepare),
    (numba_flights.NAME, numba_flights, numba_flights.prepare),
    (cvode_events.NAME, cvode_events, cvode_events.prepare),
    *(
        (f"SciPy {method}", scipy_events, partial(scipy_events.prepare, method=method))
        for method in scipy_events.METHODS
    ),
)
SOLVERS = (CORE, *(name for name, _, _ in PEERS))

# A call of some microseconds is repeated for this long in each round.
SHORTEST_TIMING = 0.01
# Sections per drive period on which bodies are looked for inside one another, untimed.
SAMPLES = 256
# Deeper than this they have missed a contact.
PENETRATION = 1e-6


@dataclass(frozen=True)
class Row:
    """One point of the diagram; vibroimpact has no tolerance, and its ratio is 1.

    ``impacts_expected`` is None where a complete chatter has infinitely many.
    """

    scene: str
    kind: str
    title: str
    periods: int
    solver: str
    tolerance: float | None
    seconds: float
    ratio: float
    error: float
    impacts: int
    impacts_expected: int | None
    evaluations: int
    false_events: int
    penetration: float
    missed: str
    rounds: int


@dataclass(frozen=True)
class Trial:
    """A method at one tolerance, and its first run, which may have compiled something."""

    solver: str
    tolerance: float
    solve: Solve
    outcome: Outcome
    seconds: float


@dataclass(frozen=True)
class Measured:
    """All rows, and the solvers that could not run with the reason."""

    rows: list[Row]
    absent: dict[str, str]


def by_scene(rows: Sequence[Row]) -> dict[str, list[Row]]:
    """Return the rows of each scene, in their order."""
    scenes: dict[str, list[Row]] = {}
    for row in rows:
        scenes.setdefault(row.scene, []).append(row)
    return scenes


def measure(scenes: Sequence[Scene], *, rounds: int, max_seconds: float) -> Measured:
    """Measure every scene.

    Parameters
    ----------
    scenes : sequence of Scene
        Problems with reference states; each is followed to its last one.
    rounds : int
        Repetitions; medians are reported.
    max_seconds : float
        A method is not tried at a tighter tolerance once a run has taken longer than this.
    """
    absent = {name: why for name, module, _ in PEERS if (why := module.missing())}
    rows: list[Row] = []
    for number, scene in enumerate(scenes, 1):
        title = f"run time against error {number}/{len(scenes)}: {scene.kind}, {scene.title}"
        with step(title):
            rows += _measure_scene(scene, rounds, max_seconds, absent)
    return Measured(rows, absent)


def _measure_scene(
    scene: Scene, rounds: int, max_seconds: float, absent: dict[str, str]
) -> list[Row]:
    system = vi.System(**scene.problem.parameters)
    tried = list(_affordable(scene, max_seconds, absent))
    core_seconds: list[float] = []
    seconds: list[list[float]] = [[] for _ in tried]
    for index in range(rounds):
        core_seconds.append(_time_core(system, scene))
        for trial, times in zip(tried, seconds, strict=True):
            # A long run is timed once.
            if index == 0 or trial.seconds <= max_seconds:
                times.append(_time(trial.solve, scene))

    rows = [_core_row(system, scene, core_seconds)]
    for trial, times in zip(tried, seconds, strict=True):
        outcome, solve = trial.outcome, trial.solve
        sampled = solve([scene.problem.frequency], scene.periods, scene.periods, SAMPLES)[0]
        error = scene.error(scene.periods, outcome.final_state)
        rows.append(
            Row(
                scene=scene.name,
                kind=scene.kind,
                title=scene.title,
                periods=scene.periods,
                solver=trial.solver,
                tolerance=trial.tolerance,
                seconds=statistics.median(times),
                ratio=statistics.median(
                    time / core for time, core in zip(times, core_seconds, strict=False)
                ),
                error=error,
                impacts=outcome.impacts,
                impacts_expected=scene.impacts(scene.periods),
                evaluations=outcome.evaluations,
                false_events=outcome.false_events,
                penetration=sampled.penetration,
                missed=_missed(scene, outcome, sampled.penetration, error),
                rounds=len(times),
            )
        )
    return rows


def _core_row(system: vi.System, scene: Scene, seconds: list[float]) -> Row:
    run = vi.simulate(system, initial=scene.problem.initial, periods=scene.periods)
    end = scene.periods * math.tau / scene.problem.frequency
    times = np.linspace(0.0, end, SAMPLES * scene.periods, endpoint=False)
    final = run.stroboscopic[-1].tolist()
    outcome = Outcome(
        stroboscopic=run.stroboscopic,
        impact_section=np.empty((0, 4)),
        impacts=len(run.impacts),
        ended="" if run.stop_reason == "completed" else run.stop_reason,
    )
    inside = penetration(run.trajectory(times), scene.problem.parameters["gap"])
    error = scene.error(scene.periods, final)
    return Row(
        scene=scene.name,
        kind=scene.kind,
        title=scene.title,
        periods=scene.periods,
        solver=CORE,
        tolerance=None,
        seconds=statistics.median(seconds),
        ratio=1.0,
        error=error,
        impacts=outcome.impacts,
        impacts_expected=scene.impacts(scene.periods),
        evaluations=0,
        false_events=0,
        penetration=inside,
        missed=_missed(scene, outcome, inside, error),
        rounds=len(seconds),
    )


def _missed(scene: Scene, outcome: Outcome, inside: float, error: float) -> str:
    """Say what a run missed; empty if nothing."""
    expected = scene.impacts(scene.periods)
    found = []
    if outcome.ended:
        found.append(f"given up: {outcome.ended}")
    elif expected is not None and outcome.impacts != expected:
        found.append(f"{outcome.impacts} impacts of {expected}")
    elif expected is None and error > 1e-6:
        found.append("the lasting contact")
    if inside > PENETRATION:
        found.append(f"bodies inside one another by {inside:.0e}")
    return ", ".join(found)


def _affordable(scene: Scene, max_seconds: float, absent: dict[str, str]) -> Iterable[Trial]:
    """Prepare each method at ever tighter tolerances, until a run takes too long."""
    for name, module, prepare in PEERS:
        if name in absent:
            continue
        for tolerance in module.TOLERANCES:
            solve = prepare(scene.problem, tolerance)
            start = perf_counter()
            outcome = solve([scene.problem.frequency], scene.periods, 1)[0]
            elapsed = perf_counter() - start
            yield Trial(name, tolerance, solve, outcome, elapsed)
            if elapsed > max_seconds:
                break


def _time(solve: Solve, scene: Scene) -> float:
    """Mean time of a call that asks for the state at the end."""
    calls, start, elapsed = 0, perf_counter(), 0.0
    while elapsed < SHORTEST_TIMING:
        solve([scene.problem.frequency], scene.periods, 1)
        calls += 1
        elapsed = perf_counter() - start
    return elapsed / calls


def _time_core(system: vi.System, scene: Scene) -> float:
    calls, start, elapsed = 0, perf_counter(), 0.0
    while elapsed < SHORTEST_TIMING:
        vi.simulate(system, initial=scene.problem.initial, periods=scene.periods, keep=1)
        calls += 1
        elapsed = perf_counter() - start
    return elapsed / calls

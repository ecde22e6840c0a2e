"""What the derivatives of a run cost beside the run itself.

    python benches/sensitivity.py [--rounds 5] [--only chatter ...] [--quick]

Whole calls from Python on one core, in processor time: `run.sensitivity(name)` for one name alone,
and for ten of them, per name. The run and its derivatives are computed in alternation; a figure is
the least time of all rounds in parts of the least time of the run. Tables of both are worked out
when they are read: where a column says so they are, of the run, too. The first name is measured
on the run that a file brings back, too; reading it is not part of that. The bar is 1 per name.

A run that keeps its last drive periods only, one name and ten, in parts of that shorter run. Made
with its derivatives it takes longer, by what the columns "made with" tell. Afterwards the motion
has to be followed again, which costs as much as making it did: the bar of one name alone is 2.
Writes a table in Markdown and every round as JSON.
"""

import argparse
import json
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from time import process_time
from typing import Any

import numpy as np

import vibroimpact as vi
from han_jin_hu_2004.parameters import INITIAL, MOTIONS
from machine import load, machine
from progress import step
from rounds import measure, table
from scenes import read_scenes

OUT = Path(__file__).parent / "out"
BAR = 1.0
# Of one name of a run that has to be followed again.
BAR_AGAIN = 2.0
# Long enough that a call takes much longer than what Python does beside it.
PERIODS = 2000

# Names alone, by the column they stand in; and ten at once.
ALONE = {
    "restitution": "restitution",
    "start": "v1",
    "load": "force_amplitude",
    "phase": "phase",
    "frequency": "drive_frequency",
    "damping": "pendulum_damping",
    "stiffness": "frequency_ratio",
}
TEN = (
    "restitution",
    "mass_ratio",
    "gap",
    "frequency_ratio",
    "pendulum_damping",
    "oscillator_damping",
    "moment_amplitude",
    "force_amplitude",
    "drive_frequency",
    "v1",
)


@dataclass(frozen=True)
class Scene:
    """A run, and by what it is differentiated: names alone by their column, and many at once."""

    name: str
    run: Callable[[], Any]
    kept: Callable[..., Any]
    alone: dict[str, str]
    together: tuple[str, ...]


def system_scenes(periods: int) -> list[Scene]:
    """Return runs of a system: flights and impacts, complete chatter, contact that lasts."""
    motions: dict[str, tuple[vi.System, tuple[float, ...]]] = {
        f"chaos, Fig. {motion.id}": (motion.system, INITIAL)
        for motion in MOTIONS
        if motion.id in CHAOTIC
    }
    kinds = ("periodic", "chattering", "sustained contact", "stick-slip")
    for scene in read_scenes():
        if scene.kind in kinds:
            problem = scene.problem
            motions[f"{scene.kind}, {scene.title}"] = (
                vi.System(**problem.parameters),
                problem.initial,
            )
    return [
        Scene(
            name,
            _simulate(system, initial, periods),
            _simulate(system, initial, periods, keep=_kept(periods)),
            ALONE,
            TEN,
        )
        for name, (system, initial) in motions.items()
    ]


CHAOTIC = ("9(2)",)


def _simulate(
    system: vi.System, initial: tuple[float, ...], periods: int, keep: int | None = None
) -> Callable[..., vi.Run]:
    return partial(vi.simulate, system, initial=initial, periods=periods, keep=keep)


def _kept(periods: int) -> int:
    """Return how many drive periods at the end are kept where not all are."""
    return max(1, periods // 100)


# The same of structures.
OF_STRUCTURES = {
    "restitution": "restitution",
    "start": "q_0",
    "phase": "phase",
    "frequency": "drive_frequency",
    "damping": "damping[0,0]",
    "stiffness": "stiffness[0,0]",
    "mass": "mass[0,0]",
}
TEN_OF_STRUCTURES = (*OF_STRUCTURES.values(), "gap", "v_0", "stiffness[0,1]")


def structure_scenes(periods: int) -> list[Scene]:
    """Return runs of structures: chaotic flights, few masses and many, chatter and contact."""
    rub = {"friction": 0.3, "tangent": [1, 0]}
    structures = {
        "2 masses, chaos": _masses([0.3, 0.3], 0.8, drive_frequency=0.82),
        "20 masses, chaos": _row(20),
        "2 masses, coupled damping": _masses(
            [0.3, 0.3], 0.8, drive_frequency=0.82, damping=[[0.1, 0], [0, 0.01]]
        ),
        "2 masses, chatter": _masses([0.1, 0.3], 0.4, drive_frequency=0.41),
        "2 masses, closed stops": _masses([0.05, 0.05], 0.5, drive_frequency=0.23),
        "2 masses, friction and stick": vi.Structure(
            np.eye(2),
            [[2, -1], [-1, 2]],
            [vi.Stop([0, 1], 0.1, 0.2, **rub)],
            damping_ratios=[0.02, 0.02],
            drive_amplitude=[1, 0.3],
            static_load=[0, 0.4],
            drive_frequency=0.37,
        ),
    }
    # In the end the derivatives of a chaotic motion are no numbers any more.
    longest = {"2 masses, chaos": periods // 5, "2 masses, coupled damping": periods // 5}
    return [
        Scene(
            f"structure: {name}",
            _simulate_structure(
                structure,
                count := max(3, longest.get(name, periods // structure.coordinates)),
            ),
            _simulate_structure(structure, count, keep=_kept(count)),
            OF_STRUCTURES,
            TEN_OF_STRUCTURES,
        )
        for name, structure in structures.items()
    ]


def _masses(gaps: list[float], restitution: float, **drive: Any) -> vi.Structure:
    """Return two masses, of which the first moves between two stops."""
    damping = {} if "damping" in drive else {"damping_ratios": [0.02, 0.05]}
    return vi.Structure(
        [[1, 0], [0, 2]],
        [[2, -1], [-1, 1]],
        [vi.Stop([side, 0], gap, restitution) for side, gap in zip((1, -1), gaps, strict=True)],
        drive_amplitude=[0, 1],
        **damping,
        **drive,
    )


def _row(count: int) -> vi.Structure:
    """Return masses in a row, each with a stop."""
    return vi.Structure(
        np.eye(count),
        2.5 * np.eye(count) - np.eye(count, k=1) - np.eye(count, k=-1),
        [vi.Stop(unit, 0.3, 0.7) for unit in np.eye(count)],
        damping_ratios=np.full(count, 0.02),
        drive_amplitude=np.linspace(-1.0, 1.0, count),
        drive_frequency=1.3,
    )


def _simulate_structure(
    structure: vi.Structure, periods: int, keep: int | None = None
) -> Callable[..., vi.StructureRun]:
    initial = np.zeros((2, structure.coordinates))
    initial[0, 0] = 0.01
    return partial(vi.simulate, structure, initial=initial, periods=periods, keep=keep)


def jobs_of(scene: Scene) -> dict[str, Callable[[], object]]:
    """Return the run, and its derivatives by one name or by all."""
    run = scene.run()

    def of(*names: str) -> Callable[[], object]:
        return lambda: run.sensitivity(*names)

    def read(*names: str) -> Callable[[], object]:
        return lambda: _tables(run.sensitivity(*names))

    jobs: dict[str, Callable[[], object]] = {"run": scene.run}
    jobs |= {column: of(name) for column, name in scene.alone.items()}
    back, part = _from_file(run), scene.kept()
    jobs[FILE] = lambda: back.sensitivity(scene.together[0])
    jobs |= {MANY: of(*scene.together), RUN_READ: lambda: _tables(scene.run())}
    jobs |= {RUN_KEPT: scene.kept, ONE_KEPT: lambda: part.sensitivity(scene.together[0])}
    jobs |= {MANY_KEPT: lambda: part.sensitivity(*scene.together)}
    jobs |= {ONE_WITH: lambda: scene.kept(sensitivity=scene.together[0])}
    jobs |= {MANY_WITH: lambda: scene.kept(sensitivity=scene.together)}
    return jobs | {ONE_READ: read(scene.together[0]), MANY_READ: read(*scene.together)}


def _from_file(run: Any) -> Any:
    """Return a run as a file brings it back."""
    with TemporaryDirectory() as folder:
        run.save(Path(folder) / "run.npz")
        return vi.load(Path(folder) / "run.npz")


MANY, FILE = "ten, each", "one, from a file"
RUN_READ, ONE_READ, MANY_READ = "run, read", "one, read", "ten, each, read"
RUN_KEPT = "run, kept in part"
ONE_WITH, MANY_WITH = "one, made with", "ten, each, made with"
ONE_KEPT, MANY_KEPT = "one, afterwards", "ten, each, afterwards"


def _tables(of: Any) -> object:
    """Return the tables of a run or of its derivatives."""
    return of.impacts, of.stroboscopic, of.final_state


def parts(scene: Scene, timings: dict[str, Any]) -> dict[str, float]:
    """Return the time of each column in parts of the run's."""
    least = {what: min(timing.seconds) for what, timing in timings.items()}
    found = {column: least[column] / least["run"] for column in scene.alone}
    count = len(scene.together)
    return found | {
        FILE: least[FILE] / least["run"],
        MANY: least[MANY] / least["run"] / count,
        ONE_READ: least[ONE_READ] / least[RUN_READ],
        MANY_READ: least[MANY_READ] / least[RUN_READ] / count,
        ONE_WITH: least[ONE_WITH] / least[RUN_KEPT] - 1.0,
        MANY_WITH: (least[MANY_WITH] / least[RUN_KEPT] - 1.0) / count,
        ONE_KEPT: least[ONE_KEPT] / least[RUN_KEPT],
        MANY_KEPT: least[MANY_KEPT] / least[RUN_KEPT] / count,
    }


def main(arguments: list[str] | None = None) -> None:
    """Measure, print the table and write it."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--periods", type=int, default=PERIODS)
    parser.add_argument("--only", nargs="*", default=[""], help="scenes with these words")
    parser.add_argument("--quick", action="store_true", help="a trial of all parts, no figures")
    parser.add_argument("--out", type=Path, default=OUT)
    options = parser.parse_args(arguments)
    quick = options.quick
    rounds, periods = (1, 3) if quick else (options.rounds, options.periods)
    chosen = [
        scene
        for scene in (*system_scenes(periods), *structure_scenes(periods))
        if any(word in scene.name for word in options.only)
    ]
    columns = [*dict.fromkeys(column for scene in chosen for column in scene.alone)]
    columns += [FILE, MANY, ONE_READ, MANY_READ, ONE_WITH, MANY_WITH, ONE_KEPT, MANY_KEPT]
    rows, results = [], []
    for scene in chosen:
        with step(f"sensitivity: {scene.name}"):
            timings = measure(
                jobs_of(scene), rounds, shortest=0.0 if quick else 0.02, clock=process_time
            )
        found = parts(scene, timings)
        shown = [f"{found[column]:.2f}" if column in found else "-" for column in columns]
        milliseconds = f"{1e3 * min(timings['run'].seconds):.3g}"
        bars = {column: BAR_AGAIN if column == ONE_KEPT else BAR for column in found}
        verdict = "met" if all(part <= bars[column] for column, part in found.items()) else "missed"
        rows.append([scene.name, milliseconds, *shown, verdict])
        seconds = {what: list(timing.seconds) for what, timing in timings.items()}
        results.append({"name": scene.name, "parts": found, "seconds": seconds})
    title = "# A trial run, no figures" if quick else "# Derivatives of a run"
    opening = (
        f"{title}\n\n{machine()}; load {load()} at the start. Least of {rounds} rounds, in parts "
        f"of the run; {periods} drive periods."
    )
    head = ["run", "ms", *columns, f"bar {BAR:g}, {BAR_AGAIN:g} again"]
    text = "\n".join([opening, "", *table(head, rows)])
    options.out.mkdir(parents=True, exist_ok=True)
    (options.out / "sensitivity.md").write_text(text + "\n", encoding="utf-8")
    written = json.dumps(results, indent=1)
    (options.out / "sensitivity.json").write_text(written + "\n", encoding="utf-8")
    print(text)


if __name__ == "__main__":
    main()

"""What labels and exponents cost beside the same sweep without them, and the bars to be met.

    python benches/labels.py [--rounds 5] [--points 2000] [--quick]

Whole calls from Python, on one core, in processor time. Calls that are compared run in alternation;
ratios are of the same round. Four exponents are compared with the same motion without them.
How many of the labels are right is counted by examples/robust_labels.rs. Writes a table in Markdown
and every round as JSON.
"""

import argparse
import json
import math
import statistics
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from time import process_time
from typing import Any

import numpy as np

import vibroimpact as vi
from han_jin_hu_2004.parameters import FREQUENCY_RANGE, INITIAL, MOTIONS, TRANSITIONS, paper_system
from machine import load, machine
from progress import step
from rounds import measure, ratios, spread, table

OUT = Path(__file__).parent / "out"
PERIODS, KEEP = 600, 100
# Of a chart; and the periods over which four exponents are measured.
CELLS, CHART_PERIODS = (60, 50), 400
EXPONENT_PERIODS = 10_000
BARS = {"4": 2.5, "8a": 2.5, "7a": 1.75, "8b": 1.75}
CHART_BAR, EXPONENTS_BAR = 3.0, 2.5
CHARTS = {
    "chart": paper_system(),
    "chart, friction 0.5": paper_system(friction=0.5),
    "chart, damping 0.01, f2 = 0.5": paper_system(damping=0.01, force_amplitude=0.5),
}
# Of structures; and of a row of masses that all meet stops.
STRUCTURE_CELLS, MASSES, ROW_PERIODS = (40, 20), 20, 200


def two_masses(damping: float, friction: float = 0.0) -> vi.Structure:
    """Return two masses, of which one moves between two stops."""
    rub = {"friction": friction, "tangent": [1, 0]} if friction else {}
    return vi.Structure(
        np.eye(2),
        [[2, -1], [-1, 2]],
        [vi.Stop([0, side], 0.3, 0.8, **rub) for side in (1, -1)],
        damping_ratios=[damping, damping],
        drive_amplitude=[1, 0],
        drive_frequency=1.2,
    )


STRUCTURES = {
    "chart of a structure": two_masses(0.02),
    "the same, no damping": two_masses(0.0),
    "the same, friction 0.3": two_masses(0.02, friction=0.3),
}


@dataclass(frozen=True)
class Case:
    """Calls whose times are compared with that of the first."""

    name: str
    calls: dict[str, Callable[[], object]]
    # Infinite: there is none.
    bar: float


def diagram(name: str, points: int) -> Case:
    """Return a diagram of the paper without labels, with them, and with exponents."""
    system = next(transition.system for transition in TRANSITIONS if transition.id == name)
    frequencies = np.linspace(*FREQUENCY_RANGE, points)

    def call(**wanted: bool) -> Callable[[], object]:
        return lambda: vi.bifurcation_diagram(
            system,
            initial=INITIAL,
            periods=PERIODS,
            keep=KEEP,
            workers=1,
            drive_frequency=frequencies,
            **wanted,
        )

    calls = {
        "plain": call(labels=False),
        "labels": call(),
        "labels and exponents": call(exponents=True),
    }
    return Case(f"Fig. {name}", calls, BARS[name])


def chart(name: str, cells: tuple[int, int]) -> Case:
    """Return a chart without labels, and with labels and exponents."""

    def call(**wanted: bool) -> Callable[[], object]:
        return lambda: vi.chart(
            CHARTS[name],
            initial=INITIAL,
            periods=CHART_PERIODS,
            workers=1,
            drive_frequency=np.linspace(0.2, 4.0, cells[0]),
            moment_amplitude=np.linspace(0.1, 2.0, cells[1]),
            **wanted,
        )

    return Case(name, {"plain": call(labels=False), "labels and exponents": call()}, CHART_BAR)


def exponents(name: str, periods: int) -> Case:
    """Return a chaotic motion without its exponents, and with all four over its last part."""
    system = next(motion.system for motion in MOTIONS if motion.id == name)
    calls = {
        "plain": lambda: vi.simulate(system, initial=INITIAL, periods=periods, keep=KEEP),
        "labels and exponents": lambda: vi.lyapunov_spectrum(
            system, initial=INITIAL, periods=periods
        ),
    }
    return Case(f"four exponents, {name}", calls, EXPONENTS_BAR)


def structure_chart(name: str, cells: tuple[int, int]) -> Case:
    """Return a chart of a structure without labels, with them, and with exponents."""

    def call(**wanted: bool) -> Callable[[], object]:
        return lambda: vi.chart(
            STRUCTURES[name],
            initial=np.zeros((2, 2)),
            periods=CHART_PERIODS,
            workers=1,
            drive_frequency=np.linspace(0.4, 3.0, cells[0]),
            gap=np.linspace(0.05, 1.0, cells[1]),
            **wanted,
        )

    calls = {
        "plain": call(labels=False),
        "labels": call(exponents=False),
        "labels and exponents": call(),
    }
    return Case(name, calls, CHART_BAR)


def row_exponents(count: int, periods: int) -> Case:
    """Return a chaotic motion of a row of masses without its exponents, and with some of them."""
    structure = vi.Structure(
        np.eye(count),
        2.0 * np.eye(count) - np.eye(count, k=1) - np.eye(count, k=-1),
        [vi.Stop(unit, 0.3, 0.8) for unit in np.eye(count)],
        damping_ratios=np.full(count, 0.02),
        drive_amplitude=np.linspace(1.0, 2.0, count),
        drive_frequency=0.9,
    )
    rest = np.zeros((2, count))

    def spectrum(most: int) -> Callable[[], object]:
        return lambda: vi.lyapunov_spectrum(structure, initial=rest, periods=periods, most=most)

    calls = {
        "plain": lambda: vi.simulate(structure, initial=rest, periods=periods, keep=1),
        "labels": spectrum(1),
        "labels and exponents": spectrum(2 * count),
    }
    return Case(f"{count} masses: one exponent, all {2 * count}", calls, math.inf)


def row(case: Case, timings: dict[str, Any]) -> tuple[list[str], dict[str, Any]]:
    """Return the row of the table, and every round."""
    seconds = {what: timings[f"{case.name}: {what}"].seconds for what in case.calls}
    found = {
        what: ratios(seconds[what], seconds["plain"]) for what in case.calls if what != "plain"
    }
    worst = max(statistics.median(values) for values in found.values())
    shown = [spread(found[what]) if what in found else "-" for what in COLUMNS]
    verdict = "met" if worst <= case.bar else "missed"
    bar = [f"{case.bar:g}", verdict] if math.isfinite(case.bar) else ["-", "-"]
    return [case.name, *shown, *bar], {
        "name": case.name,
        "seconds": {what: list(values) for what, values in seconds.items()},
    }


COLUMNS = ("labels", "labels and exponents")


def main(arguments: list[str] | None = None) -> None:
    """Measure, print the table and write it."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--points", type=int, default=2000)
    parser.add_argument("--quick", action="store_true", help="a trial of all parts, no figures")
    parser.add_argument("--out", type=Path, default=OUT)
    options = parser.parse_args(arguments)
    quick = options.quick
    rounds, points = (1, 6) if quick else (options.rounds, options.points)
    cells = (3, 2) if quick else CELLS
    cases = [diagram(name, points) for name in BARS]
    cases += [chart(name, cells) for name in CHARTS]
    structure_cells = (3, 2) if quick else STRUCTURE_CELLS
    cases += [structure_chart(name, structure_cells) for name in STRUCTURES]
    cases.append(row_exponents(*((3, 20) if quick else (MASSES, ROW_PERIODS))))
    cases.append(exponents("9(2)", 200 if quick else EXPONENT_PERIODS))
    rows, results = [], []
    for case in cases:
        with step(f"labels: {case.name}"):
            jobs = {f"{case.name}: {what}": call for what, call in case.calls.items()}
            shortest = 0.0 if quick else 0.05
            timings = measure(jobs, rounds, shortest=shortest, clock=process_time)
        one, result = row(case, timings)
        rows.append(one)
        results.append(result)
    title = "# A trial run, no figures" if quick else "# Labels"
    head = ["times the plain call", *COLUMNS, "bar", ""]
    opening = (
        f"{title}\n\n{machine()}; load {load()} at the start. Medians of {rounds} rounds, ranges."
    )
    text = "\n".join([opening, "", *table(head, rows)])
    options.out.mkdir(parents=True, exist_ok=True)
    (options.out / "labels.md").write_text(text + "\n", encoding="utf-8")
    written = json.dumps(results, indent=1)
    (options.out / "labels.json").write_text(written + "\n", encoding="utf-8")
    print(text)


if __name__ == "__main__":
    main()

"""What one perturbation costs along a motion, and the bars to be met.

    python benches/perturbation.py [--rounds 5] [--points 400] [--quick]

A label follows a perturbation along a chaotic motion, for as many drive periods as its evidence says.
The same run, as many periods longer, is the motion without it. The difference in processor time, on
one core, is given in G (yardstick.c, measured in the same rounds) per impact of these periods. The
motions are those of Fig. 4 whose growth is certain within the fewest periods that an exponent is
measured over, so that all of them are followed equally far in a sweep. Writes a table in Markdown and
every round as JSON.
"""

import argparse
import json
import statistics
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from time import process_time

import numpy as np

import vibroimpact as vi
from han_jin_hu_2004.parameters import FREQUENCY_RANGE, INITIAL, TRANSITIONS
from machine import load, machine
from progress import step
from rounds import measure, spread, table

OUT = Path(__file__).parent / "out"
PERIODS, KEEP = 600, 100
# Drive periods of growth that an exponent is measured over at least.
FEWEST = 320


@dataclass(frozen=True)
class Case:
    """Calls that follow the same motions equally far, with a perturbation and without."""

    name: str
    followed: Callable[[], object]
    plain: Callable[[], object]
    impacts: int
    bar: float


def cases(points: int) -> list[Case]:
    """Return single runs and a sweep of the same chaotic motions."""
    system = next(transition.system for transition in TRANSITIONS if transition.id == "4")

    def run(frequency: float, more: int = 0) -> vi.Run:
        return vi.simulate(
            system.replace(drive_frequency=frequency),
            initial=INITIAL,
            periods=PERIODS + more,
            keep=KEEP,
            workers=1,
        )

    periods = {}
    for frequency in np.linspace(*FREQUENCY_RANGE, points):
        report = run(frequency).period
        if report.label == "chaotic" and report.evidence.growth_periods <= FEWEST:
            periods[float(frequency)] = report.evidence.growth_periods
    frequencies = list(periods)

    def swept(more: int = 0, **wanted: bool) -> vi.Diagram:
        return vi.bifurcation_diagram(
            system,
            initial=INITIAL,
            periods=PERIODS + more,
            keep=KEEP,
            workers=1,
            drive_frequency=frequencies,
            **wanted,
        )

    def impacts(more: dict[float, int]) -> int:
        return sum(
            run(frequency, periods).impact_count - run(frequency).impact_count
            for frequency, periods in more.items()
        )

    return [
        Case(
            "single runs",
            lambda: [run(frequency).label for frequency in frequencies],
            lambda: [run(frequency, more) for frequency, more in periods.items()],
            impacts(periods),
            1.0,
        ),
        Case(
            "lanes of a sweep",
            lambda: swept(exponents=True),
            lambda: swept(FEWEST, labels=False),
            impacts(dict.fromkeys(frequencies, FEWEST)),
            0.3,
        ),
    ]


def main(arguments: list[str] | None = None) -> None:
    """Measure, print the table and write it."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--points", type=int, default=400)
    parser.add_argument("--quick", action="store_true", help="a trial of all parts, no figures")
    parser.add_argument("--out", type=Path, default=OUT)
    options = parser.parse_args(arguments)
    quick = options.quick
    rounds, points = (1, 12) if quick else (options.rounds, options.points)
    rows, results = [], []
    for case in cases(points):
        with step(f"one perturbation: {case.name}"):
            jobs = {"followed": case.followed, "plain": case.plain}
            timings = measure(jobs, rounds, shortest=0.0 if quick else 0.05, clock=process_time)
        followed, plain = timings["followed"], timings["plain"]
        in_g = [
            (with_it - without) / case.impacts / (0.5e-9 * (g + beside))
            for with_it, without, g, beside in zip(
                followed.seconds, plain.seconds, followed.g, plain.g, strict=True
            )
        ]
        met = "met" if statistics.median(in_g) <= case.bar else "missed"
        rows.append([case.name, f"{case.impacts:,}", spread(in_g), f"{case.bar:g}", met])
        results.append({"name": case.name, "impacts": case.impacts, "g_per_impact": in_g})
    title = "# A trial run, no figures" if quick else "# One perturbation"
    head = ["along", "impacts", "G per impact", "bar", ""]
    opening = (
        f"{title}\n\n{machine()}; load {load()} at the start. Medians of {rounds} rounds, ranges."
    )
    text = "\n".join([opening, "", *table(head, rows)])
    options.out.mkdir(parents=True, exist_ok=True)
    (options.out / "perturbation.md").write_text(text + "\n", encoding="utf-8")
    written = json.dumps(results, indent=1)
    (options.out / "perturbation.json").write_text(written + "\n", encoding="utf-8")
    print(text)


if __name__ == "__main__":
    main()

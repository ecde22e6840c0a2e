"""Structures with stops beside other solvers: run time against error, and the cost of sweeps.

Run as ``python benches/structures`` (or ``make bench``); some five minutes. Every scene has its
exact state at the end; a solver that is not installed is left out. Written are every point (CSV)
and a table.
"""

import argparse
import csv
import statistics
import sys
from collections.abc import Sequence
from dataclasses import asdict, fields
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))
sys.path.insert(0, str(Path(__file__).parent))

from solvers import PEERS, TIMES_LONGER, Row, Swept, measure_scene, measure_sweeps

from machine import cores, load, machine
from progress import step
from structure_scenes import read_scenes


def main(arguments: list[str] | None = None) -> None:
    """Parse the options, measure, and write the results."""
    parser = argparse.ArgumentParser(prog="structures", description=__doc__)
    parser.add_argument("--out", type=Path, default=Path(__file__).parents[1] / "out")
    parser.add_argument("--rounds", type=int, default=7)
    parser.add_argument("--quick", action="store_true", help="a trial of all parts")
    options = parser.parse_args(arguments)
    rounds = 1 if options.quick else options.rounds
    scenes, rows = read_scenes(), []
    for scene in scenes:
        with step(f"run time against error: {scene.title}"):
            rows += measure_scene(scene, rounds, longest=0.05 if options.quick else 2.0)
    with step("sweeps"):
        swept = measure_sweeps(scenes[0], rounds, sorted({1, cores()}))
    options.out.mkdir(parents=True, exist_ok=True)
    with (options.out / "structures.csv").open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, [field.name for field in fields(Row)])
        writer.writeheader()
        writer.writerows(asdict(row) for row in rows)
    text = report(rows, swept)
    (options.out / "structures.md").write_text(text, encoding="utf-8")
    print(text)


def report(rows: Sequence[Row], swept: Sequence[Swept]) -> str:
    """Return the tables."""
    absent = [f"{peer.NAME}: {why}" for peer in PEERS if (why := peer.missing())]
    lines = [
        "# Structures",
        "",
        f"{machine()}; load {load()} at the end. Whole calls from Python; medians of up to "
        f"{max(row.rounds for row in rows)} rounds, each ratio within one round. Errors of the "
        f"state after a {TIMES_LONGER}th of the run against the exact motion, relative to "
        "max(1, |value|), and impacts up to there.",
        *absent,
        "",
        "| scene | solver | tolerance | us per period | us per impact | error | impacts | ratio |",
        "|---|---|---|---|---|---|---|---|",
    ]
    for row in rows:
        tolerance = "" if row.tolerance is None else f"{row.tolerance:.0e}"
        impacts = row.ended or f"{row.first_impacts} of {row.first_expected}"
        lines.append(
            f"| {row.scene} | {row.solver} | {tolerance} | {1e6 * row.seconds / row.periods:.3g} "
            f"| {1e6 * row.seconds / max(1, row.impacts):.3g} | {row.error:.0e} | {impacts} "
            f"| {row.ratio:.3g} |"
        )
    lines += [
        "",
        "Sweeps over chaotic motions, in which every impact is computed:",
        "",
        "| sweep | threads | ns per period | ns per impact |",
        "|---|---|---|---|",
    ]
    for sweep in swept:
        lines.append(
            f"| {sweep.name} | {sweep.workers} | {statistics.median(sweep.per_period):.0f} "
            f"| {statistics.median(sweep.per_impact):.0f} |"
        )
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    main()

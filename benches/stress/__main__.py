"""Numerical stability under stress: python benches/stress [--quick] [--out DIR].

Writes plots, rows as CSV, and the tables of docs/stress.md (tables.md) into the folder, and ends
with status 1 if a case is wrong in a range that is said to hold. Needs python-flint.
"""

import argparse
import os
import platform
import sys
import time
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import Any

import chatter
import long_runs
import scaling
from exact import BROKEN
from ranges import RANGES, measure, plot_range
from report import HEADER, draw, drift_lines, orbit_lines, range_line, write_rows

Row = dict[str, Any]
RULE = "|---|---|---|---|---|"


def count(text: str) -> int:
    """A positive whole number."""
    value = int(text)
    if value < 1:
        raise argparse.ArgumentTypeError(f"{value} is not at least 1")
    return value


def main(arguments: list[str] | None = None) -> int:
    """Measure all, write all, and say what broke."""
    parser = argparse.ArgumentParser(prog="stress", description=__doc__)
    parser.add_argument("--quick", action="store_true", help="a few cases of each, in seconds")
    parser.add_argument(
        "--out", type=Path, default=Path(__file__).parent / "out", help="folder (%(default)s)"
    )
    parser.add_argument("--cases", type=count, help="random cases of each range (150)")
    parser.add_argument("--impacts", type=count, help="elastic impacts of each motion (10^8)")
    parser.add_argument(
        "--workers", type=count, default=os.cpu_count(), help="processes (%(default)s)"
    )
    given = parser.parse_args(arguments)
    given.out.mkdir(parents=True, exist_ok=True)

    def size(small: int, full: int) -> int:
        return small if given.quick else full

    cases = given.cases or size(4, 150)
    impacts = given.impacts or size(10**4, 10**8)
    began = time.perf_counter()
    lines, broken = [], []

    def finish(name: str, rows: list[Row], plot: Callable[[Any], None], bad: int) -> None:
        write_rows(given.out / f"{name}.csv", rows)
        draw(given.out / f"{name}.png", plot)
        if bad:
            broken.append(f"{name}: {bad} of {len(rows)}")
        print(f"{name}: {len(rows)} rows, {bad} wrong, {time.perf_counter() - began:.0f} s")

    with ProcessPoolExecutor(max_workers=given.workers) as pool:
        # The longest first.
        energies = [
            pool.submit(long_runs.energy_drift, case, impacts) for case in long_runs.ELASTIC
        ]
        sets = {r.name: pool.submit(measure, r, cases) for r in RANGES}
        orbits = pool.submit(long_runs.orbit_error, size(1000, 10**6), size(10, 2000))
        grazes = pool.submit(long_runs.grazing, size(20, 10**4), size(5, 1))
        driven = pool.submit(chatter.driven_chatter, max(2, cases // 3))
        lines += ["", HEADER]
        for chosen in RANGES:
            rows = sets[chosen.name].result()
            wrong = sum(row["outcome"] in BROKEN for row in rows if row["inside"])
            name = chosen.name.replace(" ", "_")
            finish(name, rows, lambda ax, r=chosen, found=rows: plot_range(r, found, ax), wrong)
            lines.append(range_line(chosen, rows))
        rows = driven.result()
        wrong = sum(row["outcome"] in BROKEN for row in rows)
        finish("driven_chatter", rows, lambda ax: chatter.plot_driven(rows, ax), wrong)
        error = max(row["units"] for row in rows)
        lines += [
            "",
            f"Driven chatter: {len(rows)} cases, {wrong} wrong, largest error {error:.2g}",
        ]
        orbit = orbits.result()
        wrong = sum(row["error"] > long_runs.ALLOWED for row in orbit)
        finish("orbit", orbit, lambda ax: long_runs.plot_orbit_error(orbit, ax), wrong)
        lines += ["", "| motion | distance from | periods | largest | / 100 eps |", RULE]
        lines += orbit_lines(orbit)
        graze = grazes.result()
        wrong = sum(not row["good"] for row in graze)
        finish("grazing", graze, lambda ax: long_runs.plot_grazing(graze, ax), wrong)
    balls = chatter.bouncing_ball(size(20, 200), largest=0.999 if given.quick else 0.9999)
    wrong = sum(row["units"] > 1 for row in balls if row["restitution"] <= 0.9990000001)
    finish("chatter", balls, lambda ax: chatter.plot_chatter(balls, ax), wrong)
    for least in (0.0, 0.99, 0.999, 0.9999):
        own = [row for row in balls if least <= row["restitution"]]
        if own:
            lines.append(f"ball, r >= {least}: {max(row['relative'] for row in own):.1e} relative")
    scaled = scaling.scaling(size(4, 200))
    wrong = sum(not (row["equal"] or row["contact"]) for row in scaled)
    wrong += sum(row["difference"] > 1e-12 for row in scaled)
    finish("scaling", scaled, lambda ax: scaling.plot_scaling(scaled, ax), wrong)
    drift = [row for future in energies for row in future.result()]
    wrong = sum(abs(row["drift"]) > long_runs.drift_bound(row["impacts"]) for row in drift)
    finish("energy", drift, lambda ax: long_runs.plot_energy_drift(drift, ax), wrong)
    lines += ["", "| motion | impacts | E/E(0) - 1 | largest | / (eps sqrt n) |", RULE]
    lines += drift_lines(drift)

    seconds = time.perf_counter() - began
    machine = f"{platform.machine()}, {os.cpu_count()} cores, {platform.system()}, {seconds:.0f} s"
    (given.out / "tables.md").write_text("\n".join([machine, *lines, ""]), encoding="utf-8")
    print("\n".join(broken or ["nothing broke in the ranges that hold"]))
    return 1 if broken else 0


if __name__ == "__main__":
    sys.exit(main())

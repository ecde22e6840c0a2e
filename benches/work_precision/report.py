"""Writes what was measured: a CSV with every point, tables in Markdown, and the diagrams."""

import csv
from collections.abc import Sequence
from dataclasses import asdict, fields
from pathlib import Path

import diagram
import readme_table
from machine import load, machine
from measure import CORE, SOLVERS, Measured, Row, by_scene
from scenes import FIRST
from wording import short_error, times

# Errors at which run times are compared in the table.
TARGETS = (1e-6, 1e-10)


def write(measured: Measured, out: Path) -> None:
    """Write the points, the tables and the diagrams into ``out``."""
    out.mkdir(parents=True, exist_ok=True)
    with (out / "work_precision.csv").open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, [field.name for field in fields(Row)])
        writer.writeheader()
        writer.writerows(asdict(row) for row in measured.rows)
    (out / "work_precision.md").write_text(_markdown(measured), encoding="utf-8")
    (out / "readme_table.md").write_text(readme_table.markdown(measured), encoding="utf-8")
    diagram.draw(measured.rows, out / "work_precision_all.png", columns=5)
    one_of_each = [row for row in measured.rows if row.scene in FIRST]
    if one_of_each:
        diagram.draw(one_of_each, out / "work_precision.png", columns=3)


def _markdown(measured: Measured) -> str:
    rows, absent = measured.rows, measured.absent
    peers = SOLVERS[1:]
    lines = [
        "# Run time against error",
        "",
        f"{machine()}; load {load()} at the end. Error of the state at the end of each scene, "
        "relative to max(1, |value|), against references of 25 digits. Run times are those of "
        "whole calls from Python, set-up included, and medians of "
        f"up to {max(row.rounds for row in rows)} rounds; a ratio is the median of a peer's time "
        "over vibroimpact's within one round, of its fastest tolerance that reaches the error. "
        "Compilation is not counted. SciPy calls Python at every evaluation; heyoka.py, Numba and "
        "CVODE (in C) do not.",
        "",
        "Each cell: times as long as vibroimpact for an error of at most "
        f"{short_error(TARGETS[0])} / {short_error(TARGETS[1])}; `-`: not reached at any "
        "tolerance that was tried.",
        "",
        f"| scene | kind | {CORE} error | time, us | " + " | ".join(peers) + " |",
        "|" + "---|" * (4 + len(peers)),
    ]
    for name, points in by_scene(rows).items():
        core = next(row for row in points if row.solver == CORE)
        cells = [name, core.kind, short_error(core.error), f"{core.seconds * 1e6:.1f}"]
        for peer in peers:
            mine = [row for row in points if row.solver == peer]
            cells.append(absent.get(peer) or " / ".join(_fastest(mine, t) for t in TARGETS))
        lines.append("| " + " | ".join(cells) + " |")
    lines += [
        "",
        "## What each solver missed",
        "",
        "At its tightest tolerance, and in brackets how many of the tolerances tried missed "
        "something. On a chaotic motion another number of impacts can also follow from the error "
        "before. Where chatter is complete no number of impacts is right.",
        "",
        "| scene | " + " | ".join(SOLVERS) + " |",
        "|" + "---|" * (1 + len(SOLVERS)),
    ]
    for name, points in by_scene(rows).items():
        cells = [name]
        for solver in SOLVERS:
            mine = [row for row in points if row.solver == solver]
            cells.append(absent.get(solver) or _worst(mine))
        lines.append("| " + " | ".join(cells) + " |")
    return "\n".join(lines) + "\n"


def _fastest(rows: Sequence[Row], target: float) -> str:
    reached = [row.ratio for row in rows if row.error <= target]
    return times(min(reached)) if reached else "-"


def _worst(rows: Sequence[Row]) -> str:
    last = rows[-1].missed or "nothing"
    count = sum(bool(row.missed) for row in rows)
    return f"{last} [{count} of {len(rows)}]"

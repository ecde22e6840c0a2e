"""Writes what was measured: a CSV with every point, tables in Markdown, and the diagram."""

import csv
import math
from collections.abc import Sequence
from dataclasses import asdict, fields
from pathlib import Path

import matplotlib.pyplot as plt

from machine import load, machine
from measure import CORE, SOLVERS, Measured, Row

# Errors at which run times are compared in the table.
TARGETS = (1e-6, 1e-10)
# An error of exactly zero has no place on a logarithmic axis.
SMALLEST_ERROR = 1e-17

STYLES = ("k*", "D-", "P-", "h-", "o-", "s-", "^-", "v-")


def write(measured: Measured, out: Path) -> None:
    """Write work_precision.csv, .md and .png into ``out``."""
    out.mkdir(parents=True, exist_ok=True)
    with (out / "work_precision.csv").open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, [field.name for field in fields(Row)])
        writer.writeheader()
        writer.writerows(asdict(row) for row in measured.rows)
    (out / "work_precision.md").write_text(_markdown(measured), encoding="utf-8")
    _draw(measured.rows, out / "work_precision.png")


def _by_scene(rows: Sequence[Row]) -> dict[str, list[Row]]:
    scenes: dict[str, list[Row]] = {}
    for row in rows:
        scenes.setdefault(row.scene, []).append(row)
    return scenes


def _markdown(measured: Measured) -> str:
    rows, absent = measured.rows, measured.absent
    peers = SOLVERS[1:]
    lines = [
        "# Run time against error",
        "",
        f"{machine()}; load {load()} at the end. Error of the state at the end of each scene, "
        "relative to max(1, |value|), against references of 25 digits. Run times are medians of "
        f"up to {max(row.rounds for row in rows)} rounds; a ratio is the median of a peer's time "
        "over vibroimpact's within one round, of its fastest tolerance that reaches the error. "
        "Compilation is not counted. SciPy calls Python at every evaluation; heyoka.py, Numba and "
        "CVODE (in C) do not.",
        "",
        f"Each cell: times as long as vibroimpact for an error of at most {_sci(TARGETS[0])} / "
        f"{_sci(TARGETS[1])}; `-`: not reached at any tolerance that was tried.",
        "",
        f"| scene | kind | {CORE} error | time, us | " + " | ".join(peers) + " |",
        "|" + "---|" * (4 + len(peers)),
    ]
    for name, points in _by_scene(rows).items():
        core = next(row for row in points if row.solver == CORE)
        cells = [name, core.kind, _sci(core.error), f"{core.seconds * 1e6:.1f}"]
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
    for name, points in _by_scene(rows).items():
        cells = [name]
        for solver in SOLVERS:
            mine = [row for row in points if row.solver == solver]
            cells.append(absent.get(solver) or _worst(mine))
        lines.append("| " + " | ".join(cells) + " |")
    return "\n".join(lines) + "\n"


def _fastest(rows: Sequence[Row], target: float) -> str:
    reached = [row.ratio for row in rows if row.error <= target]
    return f"{min(reached):.3g}" if reached else "-"


def _worst(rows: Sequence[Row]) -> str:
    last = rows[-1].missed or "nothing"
    count = sum(bool(row.missed) for row in rows)
    return f"{last} [{count} of {len(rows)}]"


def _sci(value: float) -> str:
    return f"{value:.0e}" if math.isfinite(value) else "none"


def _draw(rows: Sequence[Row], path: Path) -> None:
    scenes = _by_scene(rows)
    columns = min(4, len(scenes))
    lines = math.ceil(len(scenes) / columns)
    figure, axes = plt.subplots(
        lines,
        columns,
        figsize=(3.2 * columns, 2.8 * lines + 0.8),
        sharex=True,
        sharey=True,
        squeeze=False,
        layout="constrained",
    )
    for ax, (name, points) in zip(axes.flat, scenes.items(), strict=False):
        for solver, style in zip(SOLVERS, STYLES, strict=True):
            mine = [row for row in points if row.solver == solver and math.isfinite(row.error)]
            ax.loglog(
                [max(row.error, SMALLEST_ERROR) for row in mine],
                [row.seconds for row in mine],
                style,
                markersize=11 if solver == CORE else 4,
                linewidth=1,
                label=solver,
            )
        ax.set_title(f"{name} ({points[0].kind})", fontsize=9)
        ax.grid(alpha=0.3)
    for ax in axes.flat[len(scenes) :]:
        ax.set_axis_off()
    for ax in axes[:, 0]:
        ax.set_ylabel("run time, s")
    for index in range(max(0, len(scenes) - columns), len(scenes)):
        # The lowest panel of each column, also where the last line is not full.
        axes.flat[index].tick_params(labelbottom=True)
        axes.flat[index].set_xlabel("error at the end")
    figure.legend(*axes[0, 0].get_legend_handles_labels(), loc="outside lower center", ncols=4)
    figure.savefig(path, dpi=150)
    plt.close(figure)

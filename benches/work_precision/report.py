"""Writes what was measured: a CSV with every point, a table in Markdown, and the diagram."""

import csv
import math
import os
import platform
from collections.abc import Sequence
from dataclasses import asdict, fields
from importlib.metadata import version
from pathlib import Path

import matplotlib.pyplot as plt

from measure import CORE, Row
from scipy_events import METHODS

# Errors at which run times are compared in the table.
TARGETS = (1e-6, 1e-10)
# Bodies inside one another by more than this have missed a contact.
PENETRATION = 1e-6
# An error of exactly zero has no place on a logarithmic axis.
SMALLEST_ERROR = 1e-17

STYLES = {CORE: "k*", "DOP853": "o-", "RK45": "s-", "LSODA": "^-", "Radau": "v-"}


def write(rows: Sequence[Row], out: Path, *, periods: int) -> None:
    """Write work_precision.csv, .md and .png into ``out``."""
    out.mkdir(parents=True, exist_ok=True)
    with (out / "work_precision.csv").open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, [field.name for field in fields(Row)])
        writer.writeheader()
        writer.writerows(asdict(row) for row in rows)
    (out / "work_precision.md").write_text(_markdown(rows, periods), encoding="utf-8")
    _draw(rows, out / "work_precision.png", periods)


def machine() -> str:
    """Processor, number of cores this process may use, system, and versions of what ran."""
    processor = platform.processor()
    cpuinfo = Path("/proc/cpuinfo")
    if cpuinfo.exists():
        for line in cpuinfo.read_text(encoding="utf-8").splitlines():
            if line.startswith("model name"):
                processor = line.split(":", 1)[1].strip()
                break
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count()
    packages = ", ".join(f"{name} {version(name)}" for name in (CORE, "numpy", "scipy"))
    return (
        f"{processor or platform.machine()}, {cores} cores, {platform.system()}, "
        f"Python {platform.python_version()}, {packages}"
    )


def _by_scene(rows: Sequence[Row]) -> dict[str, list[Row]]:
    scenes: dict[str, list[Row]] = {}
    for row in rows:
        scenes.setdefault(row.scene, []).append(row)
    return scenes


def _markdown(rows: Sequence[Row], periods: int) -> str:
    lines = [
        "# Run time against error",
        "",
        f"{machine()}. The paper's motions over {periods} drive periods; error of the state at "
        "their end, relative to max(1, |value|), against 25-digit references. Run times are "
        f"medians of {rows[0].rounds} rounds; a ratio is the median of SciPy's time over "
        "vibroimpact's within one round. SciPy's right-hand side is plain Python.",
        "",
        "| scene | "
        + f"{CORE} error | time, us | "
        + " | ".join(f"{method}: ratio at {_sci(t)}" for method in METHODS for t in TARGETS)
        + " |",
        "|" + "---|" * (3 + len(METHODS) * len(TARGETS)),
    ]
    for name, points in _by_scene(rows).items():
        core = next(row for row in points if row.solver == CORE)
        cells = [name, _sci(core.error), f"{core.seconds * 1e6:.1f}"]
        for method in METHODS:
            mine = [row for row in points if row.solver == method]
            for target in TARGETS:
                reached = [row.ratio for row in mine if row.error <= target]
                cells.append(f"{min(reached):.0f}" if reached else "-")
        lines.append("| " + " | ".join(cells) + " |")
    lines += [
        "",
        "`-`: error not reached at any tolerance that was tried.",
        "",
        "## Contacts missed and reported twice",
        "",
        "Over all scenes and tolerances: runs with another number of impacts than the reference "
        "(on a chaotic transient that can also follow from the error before), the tightest "
        "tolerance among them, runs with the bodies inside one another by more than "
        f"{_sci(PENETRATION)} at the end of a step, contacts reported again at the restart, runs "
        "given up.",
        "",
        "| solver | runs | other number of impacts | at rtol down to | penetrating "
        "| reported twice | given up |",
        "|---|---|---|---|---|---|---|",
    ]
    for solver in (CORE, *METHODS):
        mine = [row for row in rows if row.solver == solver]
        wrong = [row for row in mine if row.impacts != row.impacts_expected]
        tolerances = [row.rtol for row in wrong if row.rtol is not None]
        cells = [
            solver,
            str(len(mine)),
            str(len(wrong)),
            _sci(min(tolerances)) if tolerances else "-",
            str(sum(row.penetration > PENETRATION for row in mine)),
            str(sum(row.false_events for row in mine)),
            str(sum(not row.finished for row in mine)),
        ]
        lines.append("| " + " | ".join(cells) + " |")
    return "\n".join(lines) + "\n"


def _sci(value: float) -> str:
    return f"{value:.0e}" if math.isfinite(value) else "none"


def _draw(rows: Sequence[Row], path: Path, periods: int) -> None:
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
        for solver, style in STYLES.items():
            mine = [row for row in points if row.solver == solver and math.isfinite(row.error)]
            ax.loglog(
                [max(row.error, SMALLEST_ERROR) for row in mine],
                [row.seconds for row in mine],
                style,
                markersize=11 if solver == CORE else 4,
                linewidth=1,
                label=solver,
            )
        ax.set_title(name)
        ax.grid(alpha=0.3)
    for ax in axes.flat[len(scenes) :]:
        ax.set_axis_off()
    for ax in axes[:, 0]:
        ax.set_ylabel("run time, s")
    for index in range(max(0, len(scenes) - columns), len(scenes)):
        # The lowest panel of each column, also where the last line is not full.
        axes.flat[index].tick_params(labelbottom=True)
        axes.flat[index].set_xlabel(f"error after {periods} periods")
    figure.legend(*axes[0, 0].get_legend_handles_labels(), loc="outside lower center", ncols=5)
    figure.savefig(path, dpi=150)
    plt.close(figure)

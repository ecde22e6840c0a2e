"""The diagram: run time per drive period against the error at the end, one panel per scene.

A run that missed nothing is a filled symbol, and those of one solver are joined; the others are
hollow. Runs given up have no error and stand in a strip at the right.
"""

import math
from collections.abc import Sequence
from pathlib import Path

import matplotlib.pyplot as plt
from matplotlib.axes import Axes
from matplotlib.lines import Line2D

from measure import CORE, SOLVERS, Row, by_scene
from vibroimpact.plot import publication_style
from vibroimpact.plot.style import BLACK, BLUE, GREEN, ORANGE, PURPLE, VERMILLION

DOTS_PER_INCH = 250
# An error of exactly zero has no place on a logarithmic axis.
SMALLEST_ERROR = 1e-17
# Where runs without an error stand, and what parts them from the others.
GIVEN_UP, STRIP = 1e4, 1e2
TICKS = {
    1e-16: "$10^{-16}$",
    1e-12: "$10^{-12}$",
    1e-8: "$10^{-8}$",
    1e-4: "$10^{-4}$",
    1.0: "1",
    GIVEN_UP: "given\nup",
}
# Symbols differ as well as colours.
STYLES = dict(
    zip(
        SOLVERS,
        (
            (BLACK, "*"),
            (BLUE, "D"),
            (ORANGE, "P"),
            (GREEN, "o"),
            (VERMILLION, "s"),
            (PURPLE, "^"),
        ),
        strict=True,
    )
)
ERROR = (
    r"error of the final state $y = (x_1, \dot x_1, x_2, \dot x_2)$ against the reference "
    r"$\hat y$, $\max_i\, |y_i - \hat y_i| \,/\, \max(1, |\hat y_i|)$"
)
HOLLOW = {"linestyle": "none", "markerfacecolor": "white", "markeredgewidth": 0.8}


def draw(rows: Sequence[Row], path: Path, *, columns: int) -> None:
    """Draw the scenes of these rows into a file."""
    scenes = by_scene(rows)
    columns = min(columns, len(scenes))
    lines = math.ceil(len(scenes) / columns)
    with publication_style():
        figure, axes = plt.subplots(
            lines,
            columns,
            figsize=(max(2.4 * columns, 4.8), 2.2 * lines + 0.8),
            sharex=True,
            sharey=True,
            squeeze=False,
            layout="constrained",
        )
        panels = list(axes.flat)
        for ax, points in zip(panels, scenes.values(), strict=False):
            panel(ax, points)
        for ax in panels[len(scenes) :]:
            ax.set_axis_off()
        for index in range(max(0, len(scenes) - columns), len(scenes)):
            # The lowest panel of each column, also where the last line is not full.
            panels[index].tick_params(labelbottom=True)
        figure.supxlabel(ERROR, fontsize=9)
        figure.supylabel("run time per drive period (s)", fontsize=9)
        figure.legend(handles=_legend(), loc="outside upper center", ncols=4)
        figure.savefig(path, dpi=DOTS_PER_INCH)
        plt.close(figure)


def panel(ax: Axes, points: Sequence[Row]) -> None:
    """Draw the runs on one scene."""
    for solver, (color, marker) in STYLES.items():
        mine = [row for row in points if row.solver == solver]
        size, order = (10, 4) if solver == CORE else (4, 3)
        right = [row for row in mine if not row.missed]
        wrong = [row for row in mine if row.missed]
        style = {"color": color, "marker": marker, "markersize": size, "zorder": order}
        ax.plot(*_places(right), **style, linewidth=0.8)
        ax.plot(*_places(wrong), **style, **HOLLOW)
    ax.set(xscale="log", yscale="log", xlim=(SMALLEST_ERROR / 3.0, 10.0 * GIVEN_UP))
    ax.set_xticks(list(TICKS), list(TICKS.values()))
    ax.minorticks_off()
    ax.axvline(STRIP, color="0.5", linewidth=0.8, linestyle=":")
    ax.grid(alpha=0.3, linewidth=0.5)
    ax.set_title(f"{points[0].kind}\n{points[0].title}")


def _places(rows: Sequence[Row]) -> tuple[list[float], list[float]]:
    errors = [
        max(row.error, SMALLEST_ERROR) if math.isfinite(row.error) else GIVEN_UP for row in rows
    ]
    return errors, [row.seconds / row.periods for row in rows]


def _legend() -> list[Line2D]:
    solvers = [
        Line2D([], [], color=color, marker=marker, linewidth=0.8, markersize=5, label=solver)
        for solver, (color, marker) in STYLES.items()
    ]
    gray = {"color": "0.4", "marker": "o", "markersize": 5}
    return [
        *solvers,
        Line2D([], [], **gray, linestyle="none", label="as many impacts as the reference"),
        Line2D([], [], **gray, **HOLLOW, label="contact missed, made up, fallen through"),
    ]

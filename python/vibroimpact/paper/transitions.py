"""Pages of Figs. 4, 7 and 8: bifurcation diagrams over the drive frequency, and enlargements."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes

from .. import plot
from ..diagrams import Diagram, bifurcation_diagram
from .layout import Page, fixed_parameters, row_parameters
from .parameters import (
    ENLARGED_RANGE,
    FREQUENCY_RANGE,
    INITIAL,
    KEEP,
    PERIODS,
    Transition,
)
from .windows import Window, is_confirmed, period_windows

Color = Literal["regime"] | None

MOST_WINDOWS = 6
_MARGIN = 0.25


@dataclass(frozen=True)
class Enlargement:
    """A part of a diagram on a finer grid; `window` is None for a range fixed beforehand."""

    diagram: Diagram
    window: Window | None
    found: int


def compute(transition: Transition, frequencies: int, workers: int | None) -> Diagram:
    """Return the diagram of one panel over `FREQUENCY_RANGE`."""
    return _diagram(transition, FREQUENCY_RANGE, frequencies, workers)


def enlarge(
    transition: Transition, diagram: Diagram, frequencies: int, workers: int | None
) -> list[Enlargement]:
    """Return the parts of a diagram that are shown enlarged.

    For Fig. 8(a) the range in which the paper reports 2-2, 6-6, 4-5 and 8-10 motions; then the
    widest windows of period m > 2, at most `MOST_WINDOWS`, in the order of their frequencies.
    """
    parts = []
    if transition.id == "8a":
        zoom = _diagram(transition, ENLARGED_RANGE, max(frequencies // 4, 2), workers)
        parts.append(Enlargement(zoom, None, 0))
    windows = [window for window in period_windows(diagram) if is_confirmed(window, diagram)]
    for window in sorted(windows[:MOST_WINDOWS], key=lambda window: window.low):
        span = window.widened(_MARGIN)
        zoom = _diagram(transition, span, max(frequencies // 10, 2), workers)
        parts.append(Enlargement(zoom, window, len(windows)))
    return parts


def _diagram(
    transition: Transition, span: tuple[float, float], frequencies: int, workers: int | None
) -> Diagram:
    return bifurcation_diagram(
        transition.system,
        drive_frequency=np.linspace(*span, frequencies),
        initial=INITIAL,
        periods=PERIODS,
        keep=KEEP,
        workers=workers,
    )


def draw(figure: int, panels: Sequence[tuple[Transition, Diagram]], color: Color) -> Page:
    """Draw a page with one row for each panel: impact section left, stroboscopic section right."""
    first = panels[0][1]
    page = Page(
        f"Fig. {figure}: {fixed_parameters(first.system)}; last {KEEP} of {PERIODS} drive periods, "
        f"{len(first.parameter)} frequencies",
        rows=len(panels),
        row_height=62.0,
    )
    for transition, diagram in panels:
        letter = f"({transition.panel})  " if transition.panel else ""
        parameters = row_parameters(transition.system, frequency=False)
        left, right = page.row(f"{letter}{parameters}{_stopped(diagram)}")
        _pair(left, right, diagram, color, size=0.25)
    page.legend(_regimes([diagram for _, diagram in panels], color))
    return page


def draw_enlargements(transition: Transition, parts: Sequence[Enlargement], color: Color) -> Page:
    """Draw the enlarged parts of a diagram: fixed ranges in full width, windows three in a row."""
    ranges = [part for part in parts if part.window is None]
    windows = [part for part in parts if part.window is not None]
    rows = [windows[start : start + 3] for start in range(0, len(windows), 3)]
    page = Page(
        f"Fig. {transition.figure}{transition.panel and f'({transition.panel})'} enlarged: "
        f"{fixed_parameters(transition.system)},\n"
        f"{row_parameters(transition.system, frequency=False)}; last {KEEP} of {PERIODS} drive "
        "periods",
        rows=len(ranges) + len(rows),
        row_height=60.0,
    )
    for part in ranges:
        count = len(part.diagram.parameter)
        heading = f"{count} frequencies; periods found: {_periods(part.diagram)}"
        left, right = page.row(f"{heading}{_stopped(part.diagram)}")
        _pair(left, right, part.diagram, color, size=0.4)
    for number, row in enumerate(rows):
        heading = (
            f"the {len(windows)} widest of {row[0].found} windows of period $m > 2$, "
            f"{len(row[0].diagram.parameter)} frequencies each; dashed: edges on the first grid"
        )
        axes = page.row("" if number else heading, columns=3)
        for ax, part in zip(axes, row, strict=False):
            _window(ax, part, color)
        for ax in axes[len(row) :]:
            ax.set_axis_off()
    page.legend(_regimes([part.diagram for part in parts], color))
    return page


def _pair(left: Axes, right: Axes, diagram: Diagram, color: Color, size: float) -> None:
    plot.bifurcation(diagram, color=color, size=size, legend=False, ax=left)
    plot.bifurcation(diagram, section="stroboscopic", size=size, legend=False, ax=right)


def _window(ax: Axes, part: Enlargement, color: Color) -> None:
    if part.window is None:
        return
    plot.bifurcation(part.diagram, color=color, size=0.6, legend=False, ax=ax)
    _show_window(ax, part.diagram, part.window)
    for edge in (part.window.low, part.window.high):
        ax.axvline(edge, color="0.6", lw=0.5, ls=(0, (3, 2)), zorder=0)
    ax.set_title(f"{part.window.m}-{part.window.n}", loc="left", pad=3)
    ax.locator_params(axis="x", nbins=4)


def _show_window(ax: Axes, diagram: Diagram, window: Window) -> None:
    """Fit the vertical range to the middle half of the window, where transients are shortest."""
    quarter = 0.25 * (window.high - window.low)
    parameter = diagram.impact_parameter
    inside = (parameter >= window.low + quarter) & (parameter <= window.high - quarter)
    if inside.any():
        low, high = float(diagram.x1[inside].min()), float(diagram.x1[inside].max())
        margin = 0.15 * (high - low) or 0.1
        ax.set_ylim(low - margin, high + margin)


def _periods(diagram: Diagram, at_least: int = 3) -> str:
    """Return the labels m-n that so many values have, the most frequent first."""
    pairs, counts = np.unique(
        np.column_stack([diagram.m, diagram.n])[diagram.m > 0], axis=0, return_counts=True
    )
    order = np.argsort(-counts, kind="stable")
    labels = [f"{pairs[row][0]}-{pairs[row][1]}" for row in order if counts[row] >= at_least]
    return ", ".join(labels) or "none"


def _stopped(diagram: Diagram) -> str:
    """Return how many runs did not complete, for a heading; empty if all did."""
    kinds, counts = np.unique(diagram.status[diagram.status != "completed"], return_counts=True)
    parts = [f"{count} runs ended by {kind}" for kind, count in zip(kinds, counts, strict=True)]
    return f"; grey rug: {', '.join(parts)}" if parts else ""


def _regimes(diagrams: Sequence[Diagram], color: Color) -> list[Artist]:
    if color is None:
        return []
    present = np.unique(np.concatenate([np.asarray(diagram.regime) for diagram in diagrams]))
    return plot.regime_handles(present.tolist(), shapes=False)

"""Marks on the drawing of a run: impacts by their regime, and the times of sustained contact.

The functions `draw_...` take such impacts and stretches from any source, for example a periodic
motion. Sustained contact: the theory page, section 5; the rows of `Run.contacts` say when it
begins, changes its mode and ends.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from numpy.typing import NDArray

from ..run import EventKind
from .curve import Array, Curve
from .style import (
    CHATTER_STYLE,
    CLOSED_STYLE,
    REGIME_STYLES,
    SLIDE_STYLE,
    STICK_STYLE,
    ContactStyle,
    phase_axis,
    show_around,
)

if TYPE_CHECKING:
    from ..run import Run

Mode = Literal["closed", "slide", "stick", "chatter"]

_STYLES: dict[str, ContactStyle] = {
    "closed": CLOSED_STYLE,
    "slide": SLIDE_STYLE,
    "stick": STICK_STYLE,
    "chatter": CHATTER_STYLE,
}


class Mark(NamedTuple):
    """How a point of a section is drawn, and what it is called."""

    color: str
    marker: str
    text: str


REGIME_MARKS = {
    int(regime): Mark(style.color, style.marker, style.text)
    for regime, style in REGIME_STYLES.items()
}


class ContactSpan(NamedTuple):
    """A stretch of sustained contact in one mode; slides to either side are one mode here.

    Of periodic motions also a stretch of complete chatter.
    """

    start: float
    end: float
    mode: Mode


def contact_spans(run: Run, window: tuple[float, float]) -> list[ContactSpan]:
    """Return the stretches of sustained contact in a time window, in order."""
    start, end = window
    changes: list[tuple[float, Literal["slide", "stick"] | None]] = [
        (float(row["time"]), _mode(int(row["kind"])))
        for row in run.contacts
        if row["kind"] != EventKind.CHATTER
    ]
    # The phase at the start of the window began before its first event: the contact force shows
    # whether it is contact.
    _, v1, _, _, normal, _ = run.trajectory([run.kept_from], forces=True)[0]
    first: Literal["slide", "stick"] = "slide" if v1 else "stick"
    changes.insert(0, (float(run.kept_from), first if normal > 0.0 else None))
    changes.append((float(run.final_state.time), None))
    spans: list[ContactSpan] = []
    for (since, mode), (until, _) in pairwise(changes):
        low, high = max(since, start), min(until, end)
        if mode is None or high <= low:
            continue
        if spans and (spans[-1].end, spans[-1].mode) == (low, mode):
            low = spans.pop().start
        spans.append(ContactSpan(low, high, mode))
    return spans


def _mode(kind: int) -> Literal["slide", "stick"] | None:
    if kind == EventKind.RELEASE:
        return None
    return "stick" if kind == EventKind.STICK else "slide"


def mark_contact_times(ax: Axes, run: Run, window: tuple[float, float], unit: float = 1.0) -> None:
    """Draw the times of sustained contact, in a unit of time, as bands over the axes' height."""
    spans = contact_spans(run, window)
    draw_bands(ax, [span._replace(start=span.start * unit, end=span.end * unit) for span in spans])


def draw_bands(ax: Axes, spans: Sequence[ContactSpan]) -> None:
    """Draw stretches of contact as bands over the height of the axes."""
    for mode, style in _STYLES.items():
        boxes = [
            [(span.start, 0.0), (span.start, 1.0), (span.end, 1.0), (span.end, 0.0)]
            for span in spans
            if span.mode == mode
        ]
        if not boxes:
            continue
        bands = PolyCollection(
            boxes,
            facecolors=style.band,
            # The outline keeps a stick visible that is shorter than a dot is wide.
            edgecolors=style.edge,
            hatch=style.hatch or None,
            linewidths=0.8 if style.hatch else 0.4,
            transform=ax.get_xaxis_transform(),
            label=style.text,
            zorder=0,
        )
        bands.set_gid(f"contact-{mode}")
        ax.add_collection(bands, autolim=False)


def mark_contact_path(
    ax: Axes, run: Run, curve: Curve, x: Array, y: Array, *, named: bool = True
) -> None:
    """Mark the part of a curve (x, y) that belongs to sustained contact, in the legend if `named`.

    Sliding is a broad line under the curve; sticking, where the bodies rest, a dot.
    """
    window = (float(curve.time[0]), float(curve.time[-1]))
    draw_path(ax, contact_spans(run, window), curve.time, x, y, named=named)


def draw_path(
    ax: Axes, spans: Sequence[ContactSpan], time: Array, x: Array, y: Array, *, named: bool = True
) -> None:
    """Mark the parts of a curve (x, y) over time that belong to stretches of contact."""
    for mode, style in _STYLES.items():
        parts = [(time >= span.start) & (time <= span.end) for span in spans if span.mode == mode]
        if not parts:
            continue
        # A gap between the parts, so that no line joins them.
        path = np.concatenate([_closed(np.column_stack([x, y])[part]) for part in parts])
        ax.plot(
            path[:, 0],
            path[:, 1],
            color=style.color,
            linestyle="none" if mode == "stick" else "-",
            lw=3.0,
            solid_capstyle="round",
            marker="o" if mode == "stick" else "",
            markersize=5.0,
            markeredgewidth=0.0,
            label=style.text if named else "_nolegend_",
            zorder=1,
        )


def _closed(part: Array) -> Array:
    return np.vstack([part, np.full((1, 2), np.nan)])


def mark_regimes(
    ax: Axes, run: Run, x: Array, y: Array, chosen: NDArray[np.bool_], *, size: float = 4.0
) -> None:
    """Mark the chosen impacts of a run at (x, y) with colour and shape of their regime."""
    draw_regimes(ax, run.impacts["regime"][chosen], x, y, size=size)


def draw_section(
    ax: Axes, x: Array, y: Array, kinds: NDArray[Any], styles: Mapping[int, Mark], area: float
) -> None:
    """Draw the points of a section, each kind of them in its style."""
    for kind in np.unique(kinds):
        here = kinds == kind
        color, marker, text = styles[int(kind)]
        ax.scatter(
            x[here],
            y[here],
            s=area,
            color=color,
            marker=marker,
            linewidths=0,
            label=text,
            rasterized=True,
        )


def name_section(ax: Axes, names: Sequence[str], texts: Sequence[str]) -> None:
    """Name the axes of an impact section, and let them show what the columns need."""
    for axis, name, text in zip("xy", names, texts, strict=True):
        ax.set(**{f"{axis}label": text})
        if name == "phase":
            phase_axis(ax, axis)
        else:
            show_around(ax, axis)
    if names[1] == "approach_velocity":
        # The sizes of the bounces can be compared.
        ax.set_ylim(bottom=0.0)


def draw_regimes(
    ax: Axes,
    regimes: NDArray[np.integer[Any]],
    x: Array,
    y: Array,
    *,
    size: float = 4.0,
    named: bool = True,
) -> None:
    """Mark impacts at (x, y) with colour and shape of their regime."""
    for regime in np.unique(regimes):
        style = REGIME_STYLES[int(regime)]
        here = regimes == regime
        ax.plot(
            x[here],
            y[here],
            linestyle="none",
            marker=style.marker,
            markersize=size,
            markerfacecolor=style.color,
            markeredgecolor="white",
            markeredgewidth=0.3,
            label=style.text if named else "_nolegend_",
            zorder=3,
        )

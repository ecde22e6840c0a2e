"""Motions that coexist: their branches over the drive frequency, multipliers and portraits.

Where a simulation of one of the paper's motions and random starts end on different motions, each of
these is followed until it ends, so that the figure shows at which bifurcations it begins and ends
(docs/coexistence.md, docs/theory.md, E9).
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from numpy.typing import NDArray

from vibroimpact import (
    Branch,
    Diagram,
    PeriodicMotion,
    System,
    bifurcation_diagram,
    follow_motion,
    plot,
    search_motions,
)
from vibroimpact.plot import BIFURCATION_STYLES, label_text

from .layout import BLACK, Page, row_parameters, values
from .parameters import ENLARGED_RANGE, INITIAL, KEEP, MOTIONS, PERIODS

MOTION = "9(3)"
"""The paper's motion beside which another one exists."""
STARTS = 64
SETTLING = 3000
"""Drive periods that each start is given."""
FREQUENCIES = 17
"""Drive frequencies at which the shares of the basins are found."""
_STEP = 0.01
# The window of stability is shown with this part of its width on either side.
_MARGIN = 0.25
# In the panel of shares: another motion, then each motion with its doublings.
_FAMILY_COLORS = ("white", "0.8", "#F4BE96")
_FAMILY_NAMES = ("grey", "orange")
_FAMILY_TEXTS = (BLACK, "0.35", "#B04A00")
# Letters of a name from which it is long.
_LONG = 6
# A larger share has its name inside.
_NAMED_INSIDE = 0.12
_FIXED = ("mass_ratio", "frequency_ratio", "restitution", "gap")


@dataclass(frozen=True)
class Coexistence:
    """What the pages show.

    `branches` are those of `motions`, from end to end, and `windows` the same inside `window`, the
    frequencies around those at which one of them is stable. `shares` are parts of random starts
    over `frequencies`, by label.
    """

    system: System
    motions: tuple[PeriodicMotion, ...]
    branches: list[Branch]
    diagram: Diagram
    window: tuple[float, float]
    windows: list[Branch]
    zoom: Diagram
    frequencies: NDArray[np.float64]
    shares: dict[str, NDArray[np.float64]]


def compute(frequencies: int, workers: int | None = None) -> Coexistence:
    """Find the coexisting motions, follow them, and simulate the diagram beneath.

    Parameters
    ----------
    frequencies : int
        Drive frequencies of the diagram; half as many in the window.
    workers : int, optional
        Threads; all cores by default.
    """
    system = next(motion.system for motion in MOTIONS if motion.id == MOTION)
    found = search_motions(system, starts=STARTS, periods=SETTLING, workers=workers)
    branches = [_follow(motion, ENLARGED_RANGE) for motion in found.motions]
    stable = np.concatenate([branch.values[branch.stable] for branch in branches])
    low, high = float(stable.min()), float(stable.max())
    margin = _MARGIN * (high - low)
    window = (low - margin, high + margin)
    grid = np.linspace(*window, FREQUENCIES + 2)[1:-1]
    return Coexistence(
        system=system,
        motions=found.motions,
        branches=branches,
        diagram=_diagram(system, ENLARGED_RANGE, frequencies, workers),
        window=window,
        windows=[_follow(motion, window) for motion in found.motions],
        zoom=_diagram(system, window, max(frequencies // 2, 2), workers),
        frequencies=grid,
        shares=_shares(system, grid, workers),
    )


def _follow(motion: PeriodicMotion, span: tuple[float, float]) -> Branch:
    return follow_motion(motion, max_step=_STEP, drive_frequency=span)


def _diagram(
    system: System, span: tuple[float, float], frequencies: int, workers: int | None
) -> Diagram:
    return bifurcation_diagram(
        system,
        labels=False,
        drive_frequency=np.linspace(*span, frequencies),
        initial=INITIAL,
        periods=PERIODS,
        keep=KEEP,
        workers=workers,
    )


def _shares(
    system: System, grid: NDArray[np.float64], workers: int | None
) -> dict[str, NDArray[np.float64]]:
    """Return the parts of the starts that end on motions of each label, over the frequencies."""
    shares: dict[str, NDArray[np.float64]] = {}
    for place, frequency in enumerate(grid):
        found = search_motions(
            system.replace(drive_frequency=float(frequency)),
            starts=STARTS,
            periods=SETTLING,
            workers=workers,
        )
        parts = [
            (motion.label, share) for motion, share in zip(found.motions, found.shares, strict=True)
        ]
        for label, share in [*parts, *found.others.items()]:
            shares.setdefault(label, np.zeros(len(grid)))[place] += share
    return shares


def draw_branches(computed: Coexistence) -> Page:
    """Draw the branches from end to end, around their stable parts, and the basins' shares."""
    page = _page("branches", computed, heights=(72.0, 78.0, 56.0))
    (ax,) = page.row(
        "(a)  both branches from end to end; grey: simulated from the paper's start "
        f"$({', '.join(f'{value:g}' for value in INITIAL)})$;\n"
        "the bifurcations in the shaded range are marked in (b)",
        columns=1,
    )
    plot.branches(computed.branches, diagram=computed.diagram, size=3.5, legend=False, ax=ax)
    _leave_to_the_window(ax, computed)
    low, high = computed.window
    between = _crowded_from(computed)
    left, right = page.row(
        f"(b)  the shaded range of (a), around their stable parts; right: from {between:.4f} on, "
        "in a larger scale",
        widths=(1.0, 1.8),
    )
    for ax, ends in ((left, (low, between)), (right, (between, high))):
        plot.branches(computed.windows, diagram=computed.zoom, size=3.5, legend=False, ax=ax)
        ax.set_xlim(*ends)
        ax.locator_params(axis="x", nbins=5)
    right.set_ylabel("")
    families = ", ".join(
        f"{color}: {label_text(motion.label)} and its period doublings"
        for color, motion in zip(_FAMILY_NAMES, computed.motions, strict=False)
    )
    (ax,) = page.row(
        f"(c)  the motions on which {STARTS:,} random starts are after {SETTLING:,} drive "
        f"periods;\n{families}, white: others",
        columns=1,
    )
    _draw_shares(ax, computed)
    ax.set_xlabel(right.get_xlabel())
    handles = plot.branch_handles(computed.branches, names=True)
    for handle, motion, branch in zip(handles, computed.motions, computed.branches, strict=False):
        handle.set_label(_branch_text(motion, branch))
    page.legend(handles)
    return page


def _crowded_from(computed: Coexistence) -> float:
    """Return the frequency in the window beyond which its bifurcations lie close together."""
    low, high = computed.window
    found = {each.value for branch in computed.windows for each in branch.bifurcations}
    values = np.array([low, *sorted(value for value in found if low < value < high)])
    place = int(np.diff(values).argmax()) if len(values) > 1 else 0
    after = values[min(place + 1, len(values) - 1)]
    return float(after - 0.1 * (high - after))


def _leave_to_the_window(ax: Axes, computed: Coexistence) -> None:
    """Shade the range that has its own panel; the bifurcations in it are drawn there."""
    low, high = computed.window
    ax.axvspan(low, high, color="0.9", lw=0, zorder=0)
    for line in ax.get_lines():
        if line.get_gid() in BIFURCATION_STYLES:
            values, angles = np.array(line.get_data())
            away = (values < low) | (values > high)
            line.set_data(values[away], angles[away])


def _branch_text(motion: PeriodicMotion, branch: Branch) -> str:
    """Return the name of a branch: its number of impacts changes where a flight grazes."""
    others = dict.fromkeys(piece.label for piece in branch.pieces if piece.label != motion.label)
    beyond = f" (beyond a grazing {', '.join(map(label_text, others))})" if others else ""
    return f"{label_text(motion.label)}{beyond}"


def _draw_shares(ax: Axes, computed: Coexistence) -> None:
    """Draw the shares as stacked bars, and name each label where it begins to be seen."""
    grid = computed.frequencies
    bottom = np.zeros(len(grid))
    # Small shares on top, where there is room for their names.
    families = {label: _family(label, computed.motions) for label in computed.shares}
    for label in sorted(computed.shares, key=lambda label: (families[label], label)):
        share = computed.shares[label]
        ax.bar(
            grid,
            share,
            0.9 * float(np.diff(grid).min(initial=math.inf)) if len(grid) > 1 else 1e-3,
            bottom,
            color=_FAMILY_COLORS[min(families[label], len(_FAMILY_NAMES))],
            edgecolor=BLACK,
            lw=0.4,
            label=label,
        )
        places = np.flatnonzero(share > 0.0)
        for run in np.split(places, np.flatnonzero(np.diff(places) > 1) + 1):
            place = int(run[len(run) // 2])
            inside = share[place] > _NAMED_INSIDE
            height = bottom[place] + 0.5 * share[place] if inside else 1.08
            ax.text(
                grid[place],
                height,
                label_text(label),
                ha="center",
                va="center",
                # Above the bars the colour says of which part.
                color=BLACK if inside else _FAMILY_TEXTS[min(families[label], len(_FAMILY_NAMES))],
                # Long ones would be wider than a bar.
                fontsize=8 if len(label) < _LONG else 6.5,
            )
        bottom = bottom + share
    ax.set_xlim(*computed.window)
    ax.set_ylim(0.0, 1.17)
    ax.tick_params(axis="x", top=False)
    ax.set_ylabel("part of the starts")


def _family(label: str, motions: Sequence[PeriodicMotion]) -> int:
    """Return the place of the motion of which a label is a period doubling, from 1; 0 if none."""
    m, _, n = label.partition("-")
    for place, motion in enumerate(motions, start=1):
        if not (m.isdecimal() and n.isdecimal()):
            break
        times = int(m) // motion.m
        if times * motion.m == int(m) and times * motion.n == int(n) and times.bit_count() == 1:
            return place
    return 0


def draw_multipliers(computed: Coexistence) -> Page:
    """Draw the multipliers of every branch around its stable part."""
    page = _page("Floquet multipliers", computed, heights=(74.0,))
    axes = page.row("", columns=len(computed.windows))
    kinds: list[str] = []
    for ax, branch, motion in zip(axes, computed.windows, computed.motions, strict=True):
        plot.multipliers(branch, limit=1.3, legend=False, ax=ax)
        ax.set_title(f"branch of the {motion.label} motion", loc="left", pad=3)
        kinds += [found.kind for found in branch.bifurcations if found.kind in plot.CROSSINGS]
    page.legend(plot.bifurcation_handles(kinds))
    return page


def draw_portraits(computed: Coexistence) -> Page:
    """Draw the motions side by side: portraits of both bodies, time histories."""
    page = _page("portraits", computed, heights=(55.0, 50.0, 45.0), frequency=True)
    count = len(computed.motions)
    rows = [page.row("", count), page.row("", count), page.row("", count)]
    handles: list[Artist] = []
    for motion, axes in zip(computed.motions, zip(*rows, strict=True), strict=True):
        plot.orbit(motion, legend=False, axes=axes)
        largest = rf"$\max|\lambda| = {abs(motion.multipliers[0]):.4f}$"
        axes[0].set_title(f"{motion.label}, {largest}", loc="left", pad=3)
        handles += axes[2].get_legend_handles_labels()[0]
    for row in rows:
        _share_limits(row)
    page.legend(handles)
    return page


def _share_limits(row: Sequence[Axes]) -> None:
    """Give the panels of a row one vertical range, so that they can be compared."""
    low = min(ax.get_ylim()[0] for ax in row)
    high = max(ax.get_ylim()[1] for ax in row)
    for ax in row:
        ax.set_ylim(low, high)


def _page(
    what: str, computed: Coexistence, *, heights: Sequence[float], frequency: bool = False
) -> Page:
    labels = " and ".join(motion.label for motion in computed.motions)
    at = values(computed.system, ("drive_frequency",))
    where = "" if frequency else f", which coexist at {at}"
    return Page(
        f"Coexisting motions {labels}{where}: {what}. {values(computed.system, _FIXED)},\n"
        f"{row_parameters(computed.system, frequency=frequency)}",
        rows=len(heights),
        row_height=0.0,
        heights=heights,
    )

"""The "islands" of section 4.1: where the periodic motions of Fig. 4's system are stable.

The paper calls its periodic motions isolated islands among the non-periodic ones. Here each has its
border in the plane of drive frequency and moment amplitude: motions are looked for by simulations
from the paper's initial state on a coarse grid, and the border of each region of stability is
followed (docs/islands.md). The labels are those that section 4.1 names.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.patches import Rectangle
from matplotlib.patheffects import withStroke
from numpy.typing import NDArray

from vibroimpact import (
    BifurcationCurve,
    Diagram,
    NotFound,
    StabilityRegion,
    bifurcation_diagram,
    plot,
    simulate,
    stability_region,
)
from vibroimpact.plot import BIFURCATION_STYLES, curve_handles

from .label_places import Ground
from .layout import GREY, Page, values
from .parameters import INITIAL, KEEP, PERIODS, paper_system

LABELS = ("1-1", "2-1", "1-2", "2-4", "8-6")
"""The motions of section 4.1: Figs. 2, 3, 5 and 6."""
MOMENTS = (0.25, 0.5, 0.75, 1.0, 1.25, 1.5, 1.75, 2.0, 2.3)
FREQUENCIES = 139
MOMENT_RANGE = (0.05, 2.5)
FREQUENCY_RANGE = (0.2, 3.0)
RESONANCE = 1.0
"""Own frequency of the undamped oscillator: there no motion with impacts is periodic."""
FROM_RESONANCE = 0.01
PATH = 1.0
"""Moment amplitude of Fig. 4."""
# Drive periods in which an undamped motion settles well enough for Newton's method.
_SETTLED = 3000
_MOST_POINTS = 150
_SHADES = {"1-1": "#DCE9F5", "2-1": "#E3F1E4", "1-2": "#FBE8D3", "2-4": "#EFE0EC", "8-6": "#F2EFC8"}
# How the parts of bifurcation curves that bound stability are marked in a drawing.
_OF_STABILITY = frozenset(f"{kind}-stability" for kind in BIFURCATION_STYLES)
# Where borders are so close that they need a panel of their own.
_CROWDED = ((1.005, 1.13), (1.2, 2.4))
# Width and height of a label in points.
_LABEL_SIZE = (15.0, 8.5)
_SHOWN = ("mass_ratio", "frequency_ratio", "restitution", "gap", "friction")


@dataclass(frozen=True)
class Islands:
    """The regions found, and the simulations in which they were looked for.

    Attributes
    ----------
    regions
        In the order of LABELS.
    settled
        Frequency and moment amplitude of the runs that settled on a motion of LABELS.
    inside
        For each of them, whether it lies in a region of its label.
    """

    regions: tuple[StabilityRegion, ...]
    settled: tuple[tuple[str, float, float], ...]
    inside: NDArray[np.bool_]


def compute(
    moments: Sequence[float] = MOMENTS,
    frequencies: int = FREQUENCIES,
    *,
    labels: Sequence[str] = LABELS,
    workers: int | None = None,
) -> Islands:
    """Look for the motions on the grid, and follow the border of each region."""
    low, high = FREQUENCY_RANGE
    grid = np.linspace(low, high, frequencies + 2)[1:-1]
    settled: list[tuple[str, float, float]] = []
    for moment in moments:
        diagram = bifurcation_diagram(
            paper_system(moment_amplitude=moment),
            labels=False,
            initial=INITIAL,
            periods=PERIODS,
            keep=KEEP,
            drive_frequency=grid[np.abs(grid - RESONANCE) > FROM_RESONANCE],
            workers=workers,
        )
        settled += [(label, w, moment) for w, label in _labels(diagram) if label in labels]
    # First in the middle of the plane: from there borders are the shortest to find.
    settled.sort(key=lambda run: (labels.index(run[0]), abs(run[2] - PATH), run[1]))
    regions: list[StabilityRegion] = []
    for label, omega, moment in settled:
        if not _inside(regions, label, omega, moment):
            region = _region(label, omega, moment)
            if region is not None:
                regions.append(region)
    inside = np.array([_inside(regions, *run) for run in settled], dtype=np.bool_)
    return Islands(tuple(regions), tuple(settled), inside)


def _labels(diagram: Diagram) -> list[tuple[float, str]]:
    return [
        (float(omega), f"{m}-{n}")
        for omega, m, n in zip(diagram.parameter, diagram.m, diagram.n, strict=True)
    ]


def _inside(regions: Sequence[StabilityRegion], label: str, omega: float, moment: float) -> bool:
    return any(
        region.label == label and bool(region.sheets([[omega, moment]])[0]) for region in regions
    )


def _region(label: str, omega: float, moment: float) -> StabilityRegion | None:
    """Return the region of the motion that a run settles on, if it is one of this label."""
    system = paper_system(drive_frequency=omega, moment_amplitude=moment)
    motion = simulate(system, initial=INITIAL, periods=_SETTLED, keep=KEEP).refine()
    if isinstance(motion, NotFound) or motion.label != label:
        return None
    if not (motion.admissible and motion.stable):
        return None
    low, high = FREQUENCY_RANGE
    side = (
        (RESONANCE + FROM_RESONANCE, high)
        if omega > RESONANCE
        else (low, RESONANCE - FROM_RESONANCE)
    )
    return stability_region(
        motion, max_points=_MOST_POINTS, drive_frequency=side, moment_amplitude=MOMENT_RANGE
    )


def draw(islands: Islands) -> Page:
    """Draw the regions with the kinds of their borders, and the path of Fig. 4."""
    system = paper_system()
    heading = f"Section 4.1   Islands of stability   {values(system, _SHOWN)}, undamped"
    page = Page(heading, 2, 0.0, heights=(128.0, 92.0))
    (whole,) = page.row(
        "(a)  Inside a border a periodic motion $m$-$n$ is stable (shaded where the border is "
        "known all round); lines: the bifurcation\nat which it ends; marks: where a line meets a "
        "second condition, those in the rectangle in (b) only; resonances by their multipliers",
        columns=1,
    )
    (x0, x1), (y0, y1) = _CROWDED
    (part,) = page.row("(b)  the rectangle of (a) enlarged", columns=1)
    handles = _draw_plane(whole, islands)
    _leave_to_the_part(whole)
    _draw_plane(part, islands)
    whole.set_xlim(*FREQUENCY_RANGE)
    whole.set_ylim(0.0, MOMENT_RANGE[1])
    whole.add_patch(Rectangle((x0, y0), x1 - x0, y1 - y0, fill=False, ec="0.3", lw=0.5, zorder=4.5))
    part.set_xlim(x0, x1)
    part.set_ylim(y0, y1)
    page.legend(handles)
    # Places of labels depend on the size of the axes.
    page.figure.draw_without_rendering()
    _name(whole, [each for each in islands.regions if not _is_in_the_part(each)])
    _name(part, islands.regions)
    return page


def _draw_plane(ax: Axes, islands: Islands) -> list[Artist]:
    """Draw the regions, their borders and the path; return the legend entries."""
    for region in islands.regions:
        if region.closed:
            ax.fill(*region.border.T, color=_SHADES.get(region.label, GREY), lw=0, zorder=0)
    arcs: list[BifurcationCurve] = [arc for region in islands.regions for arc in region.arcs]
    if arcs:
        plot.bifurcation_curves(arcs, size=3.0, legend=False, ax=ax)
        for line in list(ax.get_lines()):
            # All of an arc bounds stability: one line of middle width will do.
            if line.get_gid() in _OF_STABILITY:
                line.remove()
            elif line.get_gid() in BIFURCATION_STYLES:
                line.set_linewidth(1.1)
    handles = curve_handles(arcs)
    path = ax.axhline(PATH, color=GREY, lw=0.8, zorder=0.5, label="path of Fig. 4")
    outside = [
        run for run, inside in zip(islands.settled, islands.inside, strict=True) if not inside
    ]
    if outside:
        (marks,) = ax.plot(
            *np.array([run[1:] for run in outside]).T,
            linestyle="none",
            marker="x",
            ms=3.5,
            color="0.3",
            label="simulated: stable, inside no border",
        )
        handles.append(marks)
    return [*handles, path]


def _leave_to_the_part(ax: Axes) -> None:
    """Take away the marks in the range that has its own panel: here they cover each other."""
    (x0, x1), (y0, y1) = _CROWDED
    for line in ax.get_lines():
        if str(line.get_gid()).startswith("codimension-two-"):
            x, y = np.array(line.get_data())
            away = (x < x0) | (x > x1) | (y < y0) | (y > y1)
            line.set_data(x[away], y[away])


def _name(ax: Axes, regions: Sequence[StabilityRegion]) -> None:
    """Write the labels of the regions in view where they cover nothing, the largest first.

    Of regions of one label whose borders in view cover each other, one has its name.
    """
    arcs = [arc for region in regions for arc in region.arcs]
    points = [np.array([point.values for point in arc.points]) for arc in arcs if arc.points]
    curves = [region.border for region in regions]
    path = np.array([[FREQUENCY_RANGE[0], PATH], [FREQUENCY_RANGE[1], PATH]])
    (x0, x1), (y0, y1) = _CROWDED
    rectangle = np.array([[x0, y0], [x1, y0], [x1, y1], [x0, y1], [x0, y0]])
    ground = Ground(ax, [*curves, path, rectangle], points, _LABEL_SIZE)
    # An open border has no inside: its label leads to it.
    covered = [
        ground.inside(region.border) if region.closed else ground.along(region.border)
        for region in regions
    ]
    order = np.argsort([-mask.sum() for mask in covered], kind="stable").tolist()
    named: list[int] = []
    for number in order:
        if any(
            regions[other].label == regions[number].label
            and ground.covers(covered[other], covered[number])
            for other in named
        ):
            continue
        named.append(number)
        place = ground.place(covered[number], np.sum(covered, axis=0) > covered[number])
        if place is None:
            continue
        ax.annotate(
            regions[number].label,
            place.leads_to or place.at,
            xytext=place.at,
            ha="center",
            va="center",
            fontsize=8,
            zorder=5,
            path_effects=[withStroke(linewidth=1.5, foreground="white")],
            arrowprops={"arrowstyle": "-", "lw": 0.5, "shrinkA": 0.0, "shrinkB": 0.0, "zorder": 4}
            if place.leads_to
            else None,
        )


def _is_in_the_part(region: StabilityRegion) -> bool:
    """Whether a region lies in the range that has its own panel, which has its name, too."""
    (x0, x1), (y0, y1) = _CROWDED
    (left, low), (right, high) = region.border.min(axis=0), region.border.max(axis=0)
    return bool(x0 <= left <= right <= x1 and y0 <= low <= high <= y1)


def extents(region: StabilityRegion) -> list[tuple[str, float]]:
    """Return kind and frequency of the border's crossings with the path of Fig. 4."""
    low, high = region.bounds[1]
    if not low < PATH < high:
        return []
    return [(found.kind, found.value) for found in region.crossings(moment_amplitude=PATH)]

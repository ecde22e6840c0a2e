"""Branches of periodic motions over one parameter, and bifurcation curves in two.

The impact section is the state just before each impact, the stroboscopic section the state once
per drive period (theory page, section 6); kinds of bifurcations as on the notation page.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from typing import Any, Literal

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.patheffects import withStroke
from numpy.typing import NDArray

from ..arguments import naming, positive, reject, several
from ..orbits import Bifurcation, BifurcationCurve, Branch, StabilityRegion
from ..scales import Units
from ..structure import Structure
from ..sweeps import Diagram
from ..sweeps.structure_diagram_results import StructureDiagram
from .axis_names import PARAMETER_SYMBOLS, SECTIONS, axis_name
from .branch_lines import draw_lines, line_handles, lines_of
from .branch_views import StructureView, SystemView, View
from .diagram import bifurcation, no_impact_handles, square
from .given import expected
from .parameter_units import piece_label
from .style import (
    BIFURCATION_STYLES,
    BLACK,
    POINT_TEXTS,
    bifurcation_handles,
    bifurcation_marker,
    legend_above,
    new_axes,
    phase_axis,
)

Array = NDArray[np.float64]
Section = Literal["impact", "stroboscopic"]
Curves = BifurcationCurve | StabilityRegion | Sequence[BifurcationCurve | StabilityRegion]

_DIAGRAM_GREY = "0.7"
_DIAGRAM_SIZE = 1.0
# How much wider than a curve its white edge is, in points.
_HALO = 1.4
# An impact is the same on both sides of a border if its height is, to this accuracy.
_SAME_HEIGHT = 1e-6
# Two pieces meet at a border if its value is that of their ends to this accuracy.
_SAME_BORDER = 1e-9

# What the axes of a plane of two parameters may be called.
_PARAMETERS = {axis_name(name, made=False) for name in PARAMETER_SYMBOLS}


@naming
def branches(
    branches: Branch | Sequence[Branch],
    *,
    diagram: Diagram | StructureDiagram | None = None,
    section: Section = "impact",
    value: str | None = None,
    coordinate: int = 0,
    size: float = 4.5,
    legend: bool = True,
    units: Units | None = None,
    ax: Axes | None = None,
) -> Axes:
    r"""Draw branches of periodic motions: stable solid, unstable dashed, bifurcations marked.

    Every impact (or every drive period) of an orbit has a line of its own. Curves that coincide, as
    those of mirror images do, are drawn once, and the legend names them together. Neutral saddles
    are no bifurcations and have no mark.

    Parameters
    ----------
    branches : Branch or sequence of Branch
        Results of `vibroimpact.follow_motion` or `vibroimpact.switch_branch`, over one parameter.
    diagram : Diagram or StructureDiagram, optional
        A bifurcation diagram over the same parameter, drawn in grey beneath.
    section : {"impact", "stroboscopic"}
        Section (48a) or (48b) of the paper: just before each impact, or once per drive period.
    value : str, optional
        What of the section: "x1", "v1", "v2", "phase" or "approach_velocity" at impact; "x1", "v1",
        "x2" or "v2" once per drive period. By default "x1", but the approach velocity where body 2
        is a wall at rest: x1 at impact is the place of the wall there. Of structures
        "approach_velocity", the default, "phase", "q", "v_pre" or "v_post" at impact; "q", the
        default, or "v" once per drive period. Of a coordinate it may be the whole name, as "q_1",
        or a difference, as "q_0-q_1".
    coordinate : int
        Of structures this one of "q" and the velocities, from 0.
    size : float
        Size of the marks in points.
    legend : bool
        Name branches, stability and bifurcations above the axes.
    units : "SI", optional
        Draw in SI; the systems need scales. A number of a function that makes the systems stays as
        it is.
    ax : matplotlib.axes.Axes, optional
        Where to draw; a new figure if None.

    Returns
    -------
    matplotlib.axes.Axes

    Raises
    ------
    ParameterError
        If an argument is of the wrong kind or unknown, or branches and diagram differ in their
        parameter.

    Examples
    --------
    >>> import vibroimpact as vi
    >>> system = vi.System(mass_ratio=0.6, frequency_ratio=2, restitution=0.8, gap=0.5,
    ...                    drive_frequency=1.8, moment_amplitude=1)
    >>> motion = vi.simulate(system, initial=(0, 0.5, 0, 0), periods=600, keep=100).refine()
    >>> branch = motion.follow(drive_frequency=(1.5, 1.9))
    >>> vi.plot.branches(branch, value="v1").get_ylabel()
    'velocity $\\dot x_1$ of body 1 before impact'
    """
    if not isinstance(branches, Sequence):
        branches = expected("branches", branches, Branch)
    many = several("branches", branches, Branch)
    names = {branch.parameter for branch in many}
    if len(names) > 1:
        reject("branches", sorted(names), "branches over one parameter")
    name = many[0].parameter
    if section not in SECTIONS:
        reject("section", section, "'impact' or 'stroboscopic'")
    size = positive("size", size)
    held = [piece.system for branch in many for piece in branch.pieces]
    of_structures = any(isinstance(system, Structure) for system in held)
    if of_structures:
        view: View = StructureView.checked(many, section, value, coordinate, units)
    else:
        view = SystemView.checked(many, section, value, coordinate, units)
    if diagram is not None:
        wanted = StructureDiagram if of_structures else Diagram
        if not isinstance(diagram, wanted):
            reject("diagram", diagram, f"a vibroimpact.{wanted.__name__} or None")
        if diagram.parameter_name != name:
            reject("diagram", diagram, f"a diagram over {name}, which the branches are over")
    ax = new_axes(ax)
    if diagram is not None:
        bifurcation(
            diagram,
            section=section,
            value=view.name,
            size=_DIAGRAM_SIZE,
            legend=False,
            units=units,
            ax=ax,
        )
        ax.collections[0].set_color(_DIAGRAM_GREY)
    lines = lines_of(many, view)
    for each in lines:
        draw_lines(ax, each, view)
    for kind in BIFURCATION_STYLES:
        _marks(ax, kind, many, view, size)
    if legend:
        handles = line_handles(many, lines, names=True) + _found_handles(many)
        if diagram is not None:
            handles += [square(_DIAGRAM_GREY, "simulated"), *no_impact_handles(diagram)]
        legend_above(ax, handles, columns=3)
    ax.autoscale_view()
    ax.set_xlabel(view.parameter_label if held else axis_name(name, made=False))
    ax.set_ylabel(view.value_label)
    if view.value == "phase":
        phase_axis(ax, "y")
    return ax


@naming
def branch_handles(branches: Sequence[Branch], *, names: bool = False) -> list[Artist]:
    """Return the legend entries of stability and of the bifurcations that branches have.

    With `names` those of the branches come first, by the labels of their motions; the same labels
    have letters. A single branch has its name beside its stability.

    Examples
    --------
    >>> import vibroimpact as vi
    >>> system = vi.System(mass_ratio=0.6, frequency_ratio=2, restitution=0.8, gap=0.5,
    ...                    drive_frequency=1.8, moment_amplitude=1)
    >>> motion = vi.simulate(system, initial=(0, 0.5, 0, 0), periods=600, keep=100).refine()
    >>> branch = motion.follow(drive_frequency=(1.5, 1.9))
    >>> [handle.get_label() for handle in vi.plot.branch_handles([branch])]
    ['stable', 'unstable', 'saddle-node', 'period doubling', 'Neimark-Sacker']
    """
    return line_handles(branches, None, names=names) + _found_handles(branches)


def _found_handles(branches: Sequence[Branch]) -> list[Artist]:
    return bifurcation_handles(found.kind for branch in branches for found in branch.bifurcations)


@naming
def bifurcation_curves(
    curves: Curves,
    *,
    size: float = 5.0,
    halo: bool = False,
    legend: bool = True,
    ax: Axes | None = None,
) -> Axes:
    r"""Draw curves of bifurcations in the plane of two parameters, by kind.

    A curve is thick where the motion is stable on one side of it, thin where it is unstable on
    both. Points of codimension two have the mark of the second bifurcation.

    Parameters
    ----------
    curves : BifurcationCurve, StabilityRegion, or sequence of them
        Results of `vibroimpact.bifurcation_curve` or `vibroimpact.stability_region`, over the same
        two parameters in the same order; of a region its arcs.
    size : float
        Size of the marks in points.
    halo : bool
        Draw curves and marks with a white edge, to be read over a chart (`plot.chart`).
    legend : bool
        Name the kinds above the axes.
    ax : matplotlib.axes.Axes, optional
        Where to draw, e.g. over a chart of the same two parameters; a new figure if None.

    Returns
    -------
    matplotlib.axes.Axes

    Raises
    ------
    ParameterError
        If an argument is of the wrong kind, or the curves differ in their parameters among
        themselves or from those on the axes.

    Examples
    --------
    >>> import vibroimpact as vi
    >>> system = vi.System(mass_ratio=0.6, frequency_ratio=2, restitution=0.8, gap=0.5,
    ...                    drive_frequency=1.8, moment_amplitude=1)
    >>> motion = vi.simulate(system, initial=(0, 0.5, 0, 0), periods=600, keep=100).refine()
    >>> found = motion.follow(drive_frequency=(1.5, 1.9)).bifurcations[0]
    >>> curve = vi.bifurcation_curve(found, drive_frequency=(1.4, 1.7), restitution=(0.75, 0.85))
    >>> vi.plot.bifurcation_curves(curve).get_xlabel()
    'drive frequency $\\omega$'
    """
    many = _all_curves(curves)
    planes = {curve.parameters for curve in many}
    if len(planes) > 1:
        reject("curves", sorted(planes), "curves over the same two parameters, in one order")
    size = positive("size", size)
    said = [piece_label(name, many[0].system) for name in many[0].parameters]
    if ax is not None:
        there = [ax.get_xlabel(), ax.get_ylabel()]
        if set(there) <= _PARAMETERS and there != said:
            reject("curves", many[0].parameters, f"curves over {there[0]} and {there[1]}")

    ax = new_axes(ax)
    for kind, style in BIFURCATION_STYLES.items():
        color = BLACK if style.color == "white" else style.color
        dashes = (0.0, style.dashes) if style.dashes else "-"
        here = [curve for curve in many if curve.kind == kind]
        for curve in here:
            # The part that bounds a region of stability is drawn over the curve.
            border = np.where(curve.bounds_stability, curve.values.T, np.nan)
            for gid, line, width in (
                (kind, curve.values.T, 0.6),
                (f"{kind}-stability", border, 1.8),
            ):
                if halo:
                    (white,) = ax.plot(*line, color="white", lw=width + _HALO, zorder=1.9)
                    white.set_gid(f"halo-{gid}")
                ax.plot(*line, color=color, lw=width, ls=dashes)[0].set_gid(gid)
    points = [point for curve in many for point in curve.points]
    for kind in BIFURCATION_STYLES:
        places = np.array([point.values for point in points if point.kind == kind])
        if len(places):
            (marks,) = ax.plot(*places.T, **bifurcation_marker(kind, size), zorder=4)
            if halo:
                marks.set_path_effects([withStroke(linewidth=_HALO, foreground="white")])
            marks.set_gid(f"codimension-two-{kind}")
    if legend:
        legend_above(ax, curve_handles(many), columns=3)
    ax.set_xlabel(said[0])
    ax.set_ylabel(said[1])
    return ax


def _all_curves(given: Any) -> list[BifurcationCurve]:
    """Return the curves among what was given, those of regions with them."""
    if isinstance(given, StabilityRegion):
        given = [given]
    if isinstance(given, Sequence):
        parts = [one.arcs if isinstance(one, StabilityRegion) else [one] for one in given]
        given = [curve for part in parts for curve in part]
    return several("curves", given, BifurcationCurve)


@naming
def curve_handles(curves: Curves) -> list[Artist]:
    """Return what a legend of curves and of their points of codimension two shows.

    Examples
    --------
    >>> import vibroimpact as vi
    >>> system = vi.System(mass_ratio=0.6, frequency_ratio=2, restitution=0.8, gap=0.5,
    ...                    drive_frequency=1.8, moment_amplitude=1)
    >>> motion = vi.simulate(system, initial=(0, 0.5, 0, 0), periods=600, keep=100).refine()
    >>> found = motion.follow(drive_frequency=(1.5, 1.9)).bifurcations[0]
    >>> curve = vi.bifurcation_curve(found, drive_frequency=(1.4, 1.7), restitution=(0.75, 0.85))
    >>> [handle.get_label() for handle in vi.plot.curve_handles(curve)]
    ['period doubling', 'meets saddle-node']
    """
    handles: list[Artist] = []
    curves = _all_curves(curves) if curves else []
    for kind, style in BIFURCATION_STYLES.items():
        if any(curve.kind == kind for curve in curves):
            color = BLACK if style.color == "white" else style.color
            dashes = (0.0, style.dashes) if style.dashes else "-"
            handles.append(Line2D([], [], color=color, lw=1.2, ls=dashes, label=style.text))
    kinds = {point.kind for curve in curves for point in curve.points}
    for kind in BIFURCATION_STYLES:
        for handle in bifurcation_handles(kinds & {kind}):
            handle.set_label(POINT_TEXTS[kind])
            handles.append(handle)
    return handles


def _marks(ax: Axes, kind: str, branches: Sequence[Branch], view: View, size: float) -> None:
    """Mark the bifurcations of a kind, at a border also what only the motion beyond it has."""
    places: list[tuple[float, float]] = []
    for branch in branches:
        for point in branch.of_kind(kind):
            heights = view.heights_of(point).tolist()
            heights += [
                height
                for height in _beyond(branch, point, view).tolist()
                if all(
                    abs(height - known) > _SAME_HEIGHT * max(1.0, abs(known)) for known in heights
                )
            ]
            places += [(view.factor * point.value, height) for height in heights]
    if places:
        (marks,) = ax.plot(*np.transpose(places), **bifurcation_marker(kind, size), zorder=4)
        marks.set_gid(kind)


def _beyond(branch: Branch, border: Bifurcation, view: View) -> Array:
    """Return what is drawn of the motion beyond a border: it may have more impacts."""
    for piece in branch.pieces if border.goes_on else ():
        if Counter(piece.itinerary.legs) != Counter(border.goes_on):
            continue
        for end in (0, -1):
            if abs(piece.values[end] - border.value) <= _SAME_BORDER * max(1.0, abs(border.value)):
                heights: Array = view.heights(piece)[end]
                return heights
    return np.empty(0)

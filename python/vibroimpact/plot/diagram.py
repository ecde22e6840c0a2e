"""Bifurcation diagrams: a section of the long-term motion against the swept parameter.

`contact_fraction` draws the time in sustained contact beneath (theory page, section 5). The
impact section is the state just before each impact, the stroboscopic section the state once per
drive period; Han, Jin & Hu (2004), eqs. (48a) and (48b), theory page, section 6.
"""

from __future__ import annotations

import math
from typing import Any, Literal, NamedTuple

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.colors import to_rgba_array
from matplotlib.lines import Line2D
from numpy.typing import NDArray

from .._core import Regime
from ..arguments import naming, positive
from ..errors import ParameterError
from ..scales import Units, in_si
from ..sweeps import Diagram
from ..sweeps.diagram_results import AnyDiagram
from ..sweeps.structure_diagram_results import StructureDiagram
from .axis_names import SECTIONS, at_drive_phase
from .given import expected, of_structure, of_system, usual_value
from .labels import LABEL_STYLES, NO_LABEL_COLOR, UNRESOLVED, label_codes, label_handles
from .mesh import strip
from .parameter_units import (
    along_parameter,
    grid_label,
    parameter_axis,
    point_factors,
    with_unit,
)
from .structure_diagram import heights_of_structures, stop_colors
from .style import (
    BLACK,
    BLUE,
    CHATTER_COLOR,
    GREEN,
    ORANGE,
    PURPLE,
    REGIME_STYLES,
    SKY_BLUE,
    SLIDE_STYLE,
    VERMILLION,
    curve_legend,
    new_axes,
    phase_axis,
    regimes_found,
)

Array = NDArray[np.float64]

_BRANCH_COLORS = (BLUE, VERMILLION, GREEN, PURPLE, SKY_BLUE, ORANGE)
_RUG_HEIGHT = 0.035
# Points closer than one of so many parts of either axis are one: those of periodic motions repeat.
_APART = 2000
# Area of a point in square points, times the root of their number, and its limits.
_ALL_POINTS, _LEAST_POINT, _LARGEST_POINT = 200.0, 1.0, 12.0
# Parts of the axes' height for what is marked along their upper end.
_ABOVE = (1.0 - _RUG_HEIGHT, 1.0)
_RUG_GREYS = ("0.45", "0.7", "0.2")
_ENDED = {"completed", "rest"}
_NO_IMPACT_GREY = "0.75"
_NO_IMPACT_TEXT = "no impact in the kept drive periods"
_CHATTER_TEXT = r"complete chatter ($m$-$\infty$)"


@naming
def bifurcation(
    diagram: Diagram | StructureDiagram,
    *,
    section: Literal["impact", "stroboscopic"] = "impact",
    value: str | None = None,
    coordinate: int | None = None,
    color: Literal["regime", "label", "branch", "stop"] | None = None,
    size: float | None = None,
    legend: bool = True,
    units: Units | None = None,
    ax: Axes | None = None,
) -> Axes:
    r"""Draw a section against the swept parameter.

    Values whose run did not complete are marked by a grey rug along the bottom axis, one row for
    each status, so that an empty column cannot be confused with a motion without impacts. Values
    whose motion has complete chatter in every orbit (`Diagram.n` = -1) have a strip of their own
    colour along the top, and black points take that colour too: only the impacts before the
    completion of the chatter are drawn there, and the infinitely many others lie at the tip of the
    column. With several branches, strip and rug mark what occurs on any of them. A grey strip there
    marks the runs that came to their end and have no impact in the kept drive periods: their
    columns of the impact section are empty, of several branches on each.

    Parameters
    ----------
    diagram : Diagram or StructureDiagram
        Result of `vibroimpact.bifurcation_diagram`.
    section : {"impact", "stroboscopic"}
        Section (48a) or (48b) of the paper.
    value : str, optional
        What of the section: "x1", "v1", "v2", "phase", "approach_velocity" or "energy_loss" at
        impact; "x1", "v1", "x2" or "v2" once per drive period. By default "x1", but the approach
        velocity where body 2 is a wall at rest: x1 at impact is the place of the wall there. Of
        structures "approach_velocity", the default, "phase", "impulse_normal", "energy_loss", "q",
        "v_pre" or "v_post" at impact; "q", the default, or "v" once per drive period. Of a
        coordinate it may be the whole name, as "q_1", or a difference, as "q_0-q_1".
    coordinate : int, optional
        Of structures this one of "q" and the velocities, from 0, the default.
    color : {"regime", "label", "branch", "stop"} or None
        Colour each impact by its regime (only impacts have one; without friction there is one
        regime, and the legend says so), each point by the label of its
        motion or by its branch, or each impact of structures by its stop; then the points are drawn
        in a fixed random order, so that no colour hides the others. None: by branch if there are
        several; else impacts of structures by stop, if there are several; else black.
    size : float, optional
        Area of a point in square points, as in `matplotlib.axes.Axes.scatter`; by default 1 to 12,
        smaller the more of them do not coincide. Below 1, a picture of 100 dots per inch or less
        shows none; 0.25 suits dense diagrams in print.
    legend : bool
        Name the colours, the strip and the rug above the axes.
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
        If `diagram` is something else, `section`, `value` or `color` is unknown, or regimes or
        stops are asked for on the stroboscopic section.

    Examples
    --------
    >>> import vibroimpact as vi
    >>> system = vi.System(mass_ratio=0.6, frequency_ratio=2, restitution=0.8, gap=0.5,
    ...                    drive_frequency=1.8, moment_amplitude=1)
    >>> diagram = vi.bifurcation_diagram(
    ...     system, drive_frequency=[1.7, 1.8, 1.9], initial=(0, 0.5, 0, 0), periods=200, keep=50,
    ... )
    >>> vi.plot.bifurcation(diagram, section="stroboscopic", value="v1").get_ylabel()
    'velocity $\\dot x_1$ of body 1 once per drive period, at $\\psi = 0$'
    """
    if not isinstance(diagram, StructureDiagram):
        diagram = expected("diagram", diagram, Diagram)
    if section not in SECTIONS:
        raise ParameterError(f"section must be 'impact' or 'stroboscopic', not {section!r}")
    drawn = _section(diagram, section, value, coordinate, units)
    by = _color(diagram, section, color)

    ax = new_axes(ax)
    impacts = section == "impact"
    parameter = diagram.impact_parameter if impacts else diagram.stroboscopic_parameter
    parameter, values = drawn.factor * parameter, drawn.factor * diagram.values
    heights = drawn.heights
    colors, handles = _colors(diagram, section, by)
    if by is not None:
        order = np.random.default_rng(0).permutation(len(heights))
        parameter, heights, colors = parameter[order], heights[order], colors[order]
    area = _area(size, parameter, heights)
    ax.scatter(parameter, heights, s=area, c=colors, marker="s", linewidths=0, rasterized=True)

    # With colours by label, chatter has a colour already, and so have points without impact.
    handles += _chatter_strip(ax, diagram, values) if by != "label" else []
    if impacts or by != "label":
        handles += _no_impact_strip(ax, diagram, values)
    handles += _status_rug(ax, diagram, values)
    curve_legend(ax, legend, handles)
    along_parameter(ax, values, drawn.name)
    ax.set_ylabel(drawn.text)
    if drawn.value == "phase":
        phase_axis(ax, "y")
    return ax


def _area(given: float | None, parameter: Array, heights: Array) -> float:
    """Return the area of a point in square points: as given, or smaller the more are apart."""
    if given is not None:
        return positive("size", given)
    cells = np.zeros(len(heights), np.int64)
    for column in (parameter, heights):
        low = column.min(initial=math.inf)
        extent = float(np.ptp(column)) if len(column) else 0.0
        places = (column - low) / (extent or 1.0)
        cells = cells * (_APART + 1) + (np.nan_to_num(places) * _APART).astype(np.int64)
    apart = max(len(np.unique(cells)), 1)
    return min(max(_ALL_POINTS / math.sqrt(apart), _LEAST_POINT), _LARGEST_POINT)


class _Section(NamedTuple):
    """What of a section is drawn, its heights with their name, and the factor and name along."""

    value: str
    heights: Array
    text: str
    factor: float
    name: str


def _section(
    diagram: Diagram | StructureDiagram, section: str, value: Any, coordinate: Any, units: Any
) -> _Section:
    if isinstance(diagram, StructureDiagram):
        of_system(units=units)
        found = heights_of_structures(diagram, section, value, coordinate)
        return _Section(*found, 1.0, grid_label(diagram, diagram.parameter_name))
    of_structure(coordinate=coordinate)
    known = SECTIONS[section]
    if value is None:
        value = usual_value(section, diagram)
    if not isinstance(value, str) or value not in known:
        raise ParameterError(
            f"value must be one of {', '.join(known)} on the {section} section, not {value!r}"
        )
    is_si = in_si(units)
    factors = point_factors(diagram, value) if is_si else None
    factor, name = _parameter(diagram, is_si=is_si)
    offset, text = diagram.offset, known[value]
    if section == "impact":
        heights = np.asarray(getattr(diagram, value))
    else:
        offset, text = diagram.stroboscopic_offset, _stroboscopic(text, diagram)
        heights = diagram.stroboscopic[:, [*known].index(value)]
    if factors is not None:
        heights = heights * np.repeat(factors, np.diff(offset))
    return _Section(value, heights, with_unit(text, value, is_si=is_si), factor, name)


def _color(diagram: Diagram | StructureDiagram, section: str, color: Any) -> str | None:
    """Return by what points are coloured."""
    known = ["regime", "label", "branch"]
    stops = isinstance(diagram, StructureDiagram)
    known += ["stop"] if stops else []
    if color is not None and (not isinstance(color, str) or color not in known):
        named = ", ".join(map(repr, known[:-1]))
        raise ParameterError(f"color must be None, {named} or {known[-1]!r}, not {color!r}")
    if color in ("regime", "stop") and section == "stroboscopic":
        raise ParameterError(f"color={color!r} needs section='impact': only impacts have a {color}")
    if color is not None:
        return str(color)
    if diagram.branch.any():
        return "branch"
    if isinstance(diagram, StructureDiagram) and section == "impact":
        return "stop" if len(np.unique(diagram.impacts["stop"])) > 1 else None
    return None


def _stroboscopic(text: str, diagram: Diagram) -> str:
    """Return a name of the stroboscopic section with its drive phase."""
    if diagram.parameter_name == "phase":
        return at_drive_phase(text, None)
    return at_drive_phase(text, diagram.system.phase + diagram.settings.section_phase)


def _colors(diagram: Any, section: str, color: str | None) -> tuple[Any, list[Artist]]:
    """Return the colour of each point of the section, and the legend entries.

    Colours are numbers, because matplotlib reads colours given as text one by one.
    """
    if isinstance(diagram, StructureDiagram) and color == "stop":
        stops, which, handles = stop_colors(diagram)
        return to_rgba_array(stops)[which], handles
    if color == "regime":
        structures = isinstance(diagram, StructureDiagram)
        regime = np.asarray(diagram.impacts["regime"] if structures else diagram.regime)
        handles = regimes_found(np.unique(regime).tolist(), shapes=False)
        return to_rgba_array([REGIME_STYLES[each].color for each in Regime])[regime], handles
    offset = diagram.offset if section == "impact" else diagram.stroboscopic_offset
    rows = np.diff(offset)
    if color == "label":
        codes = label_codes(diagram).reshape(-1)
        palette = to_rgba_array([*(style.point_color for style in LABEL_STYLES), NO_LABEL_COLOR])
        present = np.unique(codes[rows > 0]).tolist()
        return palette[np.minimum(np.repeat(codes, rows), UNRESOLVED)], label_handles(
            present, points=True
        )
    if color == "branch":
        names = branch_names(diagram)
        palette = to_rgba_array([branch_color(number) for number in range(len(names))])
        handles = [square(branch_color(number), name) for number, name in enumerate(names)]
        return palette[np.repeat(diagram.branch, rows)], handles
    chatters = np.asarray(diagram.n) == -1
    if chatters.any():
        return to_rgba_array([BLACK, CHATTER_COLOR])[np.repeat(chatters, rows).astype(int)], []
    return BLACK, []


def branch_color(number: int) -> str:
    """Return the colour of a branch of a diagram."""
    return _BRANCH_COLORS[number % len(_BRANCH_COLORS)]


def branch_names(diagram: AnyDiagram[Any]) -> list[str]:
    """Return names that distinguish the branches: direction, initial state, or both."""
    initials, starts = diagram.settings.initial, diagram.settings.start
    names = []
    for initial, start in zip(initials, starts, strict=True):
        parts: list[str] = []
        if len(set(starts)) > 1 or start != "fresh":
            parts.append(start)
        if len(set(initials)) > 1 or not parts:
            parts.append("from (" + ", ".join(f"{value:g}" for value in np.ravel(initial)) + ")")
        names.append(" ".join(parts))
    return names


@naming
def contact_fraction(diagram: Diagram | StructureDiagram, *, ax: Axes | None = None) -> Axes:
    r"""Draw the fraction of the time in sustained contact against the parameter.

    The time is that of the kept drive periods, so that for a settled motion this is the fraction
    of the drive period. Values where nothing is kept leave a gap. Several branches have the colours
    of `bifurcation`.

    Parameters
    ----------
    diagram : Diagram or StructureDiagram
        Result of `vibroimpact.bifurcation_diagram`; its values must increase or decrease.
    ax : matplotlib.axes.Axes, optional
        Where to draw; a new figure if None.

    Returns
    -------
    matplotlib.axes.Axes

    Raises
    ------
    ParameterError
        If `diagram` is something else.

    Examples
    --------
    >>> import vibroimpact as vi
    >>> system = vi.System(mass_ratio=0.6, frequency_ratio=2, restitution=0.8, gap=0.5,
    ...                    drive_frequency=1.8, moment_amplitude=1)
    >>> diagram = vi.bifurcation_diagram(
    ...     system, drive_frequency=[1.7, 1.8, 1.9], initial=(0, 0.5, 0, 0), periods=200, keep=50,
    ... )
    >>> vi.plot.contact_fraction(diagram).get_xlabel()
    'drive frequency $\\omega$'
    """
    if not isinstance(diagram, StructureDiagram):
        diagram = expected("diagram", diagram, Diagram)
    ax = new_axes(ax)
    fractions = np.asarray(diagram.contact_fraction).reshape(-1, len(diagram.values))
    for number, fraction in enumerate(fractions):
        ax.fill_between(diagram.values, 0.0, fraction, color=SLIDE_STYLE.band, lw=0)
        color = BLACK if len(fractions) == 1 else branch_color(number)
        ax.plot(diagram.values, fraction, color=color, lw=0.7)
    ax.set_ylim(bottom=0.0)
    along_parameter(ax, diagram.values, grid_label(diagram, diagram.parameter_name))
    ax.set_ylabel("fraction of time\nin contact")
    return ax


def _parameter(diagram: Diagram, *, is_si: bool) -> tuple[float, str]:
    """Return the factor and the label of the axis of the swept parameter."""
    name = diagram.parameter_name
    if diagram.is_made:
        return 1.0, grid_label(diagram, name)
    return parameter_axis(name, diagram.system, is_si=is_si)


@naming
def chatter_handles(diagram: AnyDiagram[Any]) -> list[Artist]:
    """Return the legend entry of complete chatter, if any value of the diagram has it.

    Examples
    --------
    >>> import vibroimpact as vi
    >>> system = vi.System(mass_ratio=0.6, frequency_ratio=2, restitution=0.8, gap=0.5,
    ...                    drive_frequency=1.8, moment_amplitude=1)
    >>> diagram = vi.bifurcation_diagram(
    ...     system, drive_frequency=[1.7, 1.8, 1.9], initial=(0, 0.5, 0, 0), periods=200, keep=50,
    ... )
    >>> vi.plot.chatter_handles(diagram)  # no chatter
    []
    """
    if not (np.asarray(diagram.n) == -1).any():
        return []
    return [square(CHATTER_COLOR, _CHATTER_TEXT)]


def square(color: str, text: str) -> Line2D:
    """Return the legend entry of points or of a strip of a colour."""
    return Line2D(
        [], [], ls="none", marker="s", markersize=4.5, markeredgewidth=0, color=color, label=text
    )


def _on_any_branch(diagram: AnyDiagram[Any], chosen: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Tell of each value whether one of its points is chosen."""
    return np.asarray(chosen.reshape(-1, len(diagram.values)).any(axis=0))


@naming
def no_impact_handles(diagram: AnyDiagram[Any]) -> list[Artist]:
    """Return the legend entry of motions without impact, if some value has only those.

    Examples
    --------
    >>> import vibroimpact as vi
    >>> system = vi.System(mass_ratio=0.6, frequency_ratio=2, restitution=0.8, gap=0.5,
    ...                    drive_frequency=1.8, moment_amplitude=1)
    >>> diagram = vi.bifurcation_diagram(
    ...     system, drive_frequency=[1.7, 1.8, 1.9], initial=(0, 0.5, 0, 0), periods=200, keep=50,
    ... )
    >>> vi.plot.no_impact_handles(diagram)  # all strike
    []
    """
    if not _without_impact(diagram).any():
        return []
    of_all = ", on any branch" if diagram.branch.any() else ""
    return [square(_NO_IMPACT_GREY, _NO_IMPACT_TEXT + of_all)]


def _without_impact(diagram: AnyDiagram[Any]) -> NDArray[np.bool_]:
    """Tell of each value whether all its runs came to their end and kept no impact."""
    quiet = (np.diff(diagram.offset) == 0) & np.isin(diagram.status, [*_ENDED])
    return ~_on_any_branch(diagram, ~quiet)


def _chatter_strip(ax: Axes, diagram: AnyDiagram[Any], values: Array) -> list[Artist]:
    """Mark the values with complete chatter along the top axis; return the legend entry."""
    handles = chatter_handles(diagram)
    if handles:
        chatters = _on_any_branch(diagram, np.asarray(diagram.n) == -1)
        strip(ax, values, chatters, _ABOVE, CHATTER_COLOR, gid="complete-chatter")
    return handles


def _no_impact_strip(ax: Axes, diagram: AnyDiagram[Any], values: Array) -> list[Artist]:
    """Mark the values without impact along the top axis; return the legend entry."""
    handles = no_impact_handles(diagram)
    if handles:
        strip(ax, values, _without_impact(diagram), _ABOVE, _NO_IMPACT_GREY, gid="no-impact")
    return handles


def _status_rug(ax: Axes, diagram: AnyDiagram[Any], values: Array) -> list[Artist]:
    """Mark every value whose run ended early; return the legend entries."""
    status = np.asarray(diagram.status)
    entries: list[Artist] = []
    for row, kind in enumerate(sorted(set(status.tolist()) - _ENDED)):
        stopped = _on_any_branch(diagram, status == kind)
        grey = _RUG_GREYS[row % len(_RUG_GREYS)]
        heights = (row * _RUG_HEIGHT, (row + 1) * _RUG_HEIGHT)
        text = f"{kind}: {int(stopped.sum())} of {len(stopped)} values"
        entries.append(strip(ax, values, stopped, heights, grey, gid=f"status-{kind}", text=text))
    return entries

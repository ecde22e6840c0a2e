"""Figure of basins of attraction: which start leads to which attractor, and why some to none."""

from typing import Any

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.colors import ListedColormap
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from ..arguments import naming
from ..scales import COLUMN_UNITS, in_si
from ..sweeps.basins.results import Basins
from ..sweeps.fields import STATUS_NAMES
from ..sweeps.machines import machine_of
from .axis_names import state_name, state_symbol
from .given import expected
from .mesh import edges
from .parameter_units import with_unit
from .style import BLACK, BLUE, GREEN, ORANGE, PURPLE, SKY_BLUE, VERMILLION, legend_above, new_axes

YELLOW = "#F0E442"
# One colour and one mark for each attractor; if the colours do not suffice they repeat with other
# marks.
BASIN_COLORS = (SKY_BLUE, ORANGE, GREEN, PURPLE, YELLOW, BLUE, VERMILLION)
_MARKERS = "osD^vP*X<>"
_HATCH = "/////"
# Greys of the reasons, from dark to light; overlap of the bodies is hatched.
_GREYS = ("0.45", "0.6", "0.7", "0.8")
# At most so many section points are drawn of an attractor that is not periodic.
_MOST_DOTS = 500
# Coordinates that all starts share are named, where there are at most so many.
_MOST_NAMED = 4


@naming
def basins(
    basins: Basins, *, sections: bool = False, legend: bool = True, ax: Axes | None = None
) -> Axes:
    """Draw basins of attraction, the first axis of the grid along the horizontal.

    Each attractor has a colour. Hatched: the bodies overlap; grey: no attractor is known, and the
    legend says why.

    Parameters
    ----------
    basins : Basins
        As computed by ``vi.basins``.
    sections : bool
        Mark the sections of the attractors that lie within the axes, projected onto the two
        coordinates: they lie in the plane only by chance, so a mark may lie in another basin.
    legend : bool
        Put a legend above the axes, with the part of the cells of each attractor, the
        coordinates that all starts share, and what the marks are.
    ax : Axes, optional
        Where to draw; a new figure if None.

    Returns
    -------
    Axes

    Raises
    ------
    ParameterError
        If `basins` is something else.

    Examples
    --------
    >>> import vibroimpact as vi
    >>> system = vi.System(mass_ratio=0.6, frequency_ratio=2, restitution=0.8, gap=0.5,
    ...                    drive_frequency=1.8, moment_amplitude=1)
    >>> grid = [-0.5, 0.0, 0.2]
    >>> basins = vi.basins(system, x1=grid, v1=grid, scouts=20, periods=300)
    >>> vi.plot.basins(basins).get_xlabel()
    'position $x_1$ of body 1'
    """
    basins = expected("basins", basins, Basins)
    ax = new_axes(ax)
    (first, x), (second, y) = basins.axes.items()
    reasons = [name for name in basins.reasons if name not in ("overlap", "pending")]
    greys = {name: _GREYS[min(k, len(_GREYS) - 1)] for k, name in enumerate(reasons)}
    count = len(basins.attractors)
    codes = np.where(basins.attractor >= 0, basins.attractor, -1).astype(np.int64)
    for k, name in enumerate(reasons):
        codes[(basins.attractor < 0) & (basins.status_code == STATUS_NAMES.index(name))] = count + k
    colors = [_color(k) for k in range(count)] + list(greys.values())
    order_x, order_y = np.argsort(x), np.argsort(y)
    ax.pcolormesh(
        edges(x[order_x]),
        edges(y[order_y]),
        np.ma.masked_less(codes, 0)[np.ix_(order_x, order_y)].T,
        cmap=ListedColormap(colors or ["white"]),
        vmin=-0.5,
        vmax=max(len(colors), 1) - 0.5,
        rasterized=True,
    )
    if "overlap" in basins.reasons:
        # Visible where cells are not drawn.
        ax.patch.set(hatch=_HATCH, edgecolor="0.75", linewidth=0.0)
    limits = ax.get_xlim(), ax.get_ylim()
    marked = sections and _mark_sections(ax, basins, first, second)
    ax.set_xlim(limits[0])
    ax.set_ylim(limits[1])
    is_si = in_si(basins.settings.units)
    ax.set_xlabel(with_unit(state_name(first), first, is_si=is_si))
    ax.set_ylabel(with_unit(state_name(second), second, is_si=is_si))
    if legend:
        handles = basin_handles(basins, sections=sections)
        handles += [
            Patch(facecolor=grey, label=name.replace("_", " ")) for name, grey in greys.items()
        ]
        if "overlap" in basins.reasons:
            handles.append(
                Patch(
                    hatch=_HATCH,
                    facecolor="white",
                    edgecolor="0.75",
                    linewidth=0.0,
                    label="bodies overlap",
                )
            )
        if handles:
            box = legend_above(ax, handles, columns=3)
            lines = [_plane(basins), _marks(basins) if marked else ""]
            box.set_title("\n".join(line for line in lines if line))
            box.get_title().set_fontsize(box.get_texts()[0].get_fontsize())
            box.set_alignment("left")
    return ax


def _plane(basins: Basins) -> str:
    """Return the coordinates that all starts share, as text; of many those other than 0."""
    names = machine_of(basins.system).coordinates
    initial = zip(names, np.ravel(basins.settings.initial).tolist(), strict=True)
    is_si = in_si(basins.settings.units)
    others = [(name, value) for name, value in initial if name not in basins.axes]
    named = others if len(others) <= _MOST_NAMED else [pair for pair in others if pair[1] != 0.0]
    shared = [
        f"{state_symbol(name)} = {value:g}{f' {COLUMN_UNITS[name][1]}' if is_si else ''}"
        for name, value in named
    ]
    rest = ["all others 0"] if len(named) < len(others) else []
    words = ", ".join([*shared, *rest])
    return f"starts with {words}" if words else ""


def _marks(basins: Basins) -> str:
    """Say what is marked, and that the marks need not lie in the plane of the starts."""
    names = machine_of(basins.system).coordinates
    free = [state_symbol(name) for name in names if name not in basins.axes]
    words = ", ".join(free) if len(free) <= _MOST_NAMED else "other coordinates"
    whatever = f", whatever their {words}" if words else ""
    return f"marks: the attractors once per drive period{whatever}"


@naming
def basin_handles(basins: Basins, *, sections: bool = False) -> list[Artist]:
    """Return one legend entry for each attractor: its label, and its part of the cells.

    Parameters
    ----------
    basins : Basins
        As computed by ``vi.basins``.
    sections : bool
        With the mark of its sections.

    Examples
    --------
    >>> import vibroimpact as vi
    >>> system = vi.System(mass_ratio=0.6, frequency_ratio=2, restitution=0.8, gap=0.5,
    ...                    drive_frequency=1.8, moment_amplitude=1)
    >>> import numpy as np
    >>> basins = vi.basins(system, x1=[0.1], v1=np.linspace(-1, 1, 9), scouts=20, periods=300)
    >>> [handle.get_label() for handle in vi.plot.basin_handles(basins)]
    ['1-1, 100 %']
    """
    shown = zip(basins.attractors, basins._names, basins.shares, strict=True)
    return [
        Line2D(
            [],
            [],
            color=_color(k),
            linewidth=8.0,
            solid_capstyle="butt",
            markersize=4.5,
            markerfacecolor="white",
            markeredgecolor=BLACK,
            markeredgewidth=0.7,
            marker=_MARKERS[k % len(_MARKERS)] if sections and found.kind == "periodic" else "",
            label=f"{name}, {_percent(float(share))}",
        )
        for k, (found, name, share) in enumerate(shown)
    ]


def _mark_sections(ax: Axes, basins: Basins, first: str, second: str) -> bool:
    """Mark the sections of the attractors; return whether there are any within the axes."""
    names = machine_of(basins.system).coordinates
    columns = [names.index(name) for name in (first, second)]
    (left, right), (low, high) = sorted(ax.get_xlim()), sorted(ax.get_ylim())
    scales = basins.system._chosen(basins.settings.units)
    within = False
    for k, found in enumerate(basins.attractors):
        points = found.sections if scales is None else scales.to_si(found.sections)
        points = points.reshape(len(points), -1)[:, columns]
        if found.kind == "periodic":
            style: dict[str, Any] = {"marker": _MARKERS[k % len(_MARKERS)], "markersize": 4.5}
            style |= {"markerfacecolor": "white", "markeredgewidth": 0.7}
        elif found.kind == "family":
            continue
        else:
            points = points[:_MOST_DOTS]
            style = {"marker": ".", "markersize": 1.5, "markeredgewidth": 0.0}
            style |= {"markerfacecolor": BLACK}
        # Drawing moves the limits of the axes; they are put back by the caller.
        ax.plot(*points.T, linestyle="none", markeredgecolor=BLACK, zorder=3, **style)
        within |= bool(((points >= (left, low)) & (points <= (right, high))).all(axis=1).any())
    return within


def _color(number: int) -> str:
    return BASIN_COLORS[number % len(BASIN_COLORS)]


def _percent(share: float) -> str:
    """The share with three digits, but never rounded to 0 or 100 %."""
    text = f"{100.0 * share:.3g}"
    return f"{100.0 * share:.6g} %" if text == "100" and share < 1.0 else f"{text} %"

"""Charts over two parameters: the label of the motion, or its largest exponent.

Bifurcation curves of the same two parameters go over it (`bifurcation_curves`, ``halo=True``).
"""

from typing import Any, Literal

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.collections import QuadMesh
from matplotlib.colors import CenteredNorm, ListedColormap
from matplotlib.patches import Patch
from numpy.typing import NDArray

from ..arguments import naming, positive, reject
from ..sweeps import Sweep
from .axis_names import LARGEST_EXPONENT
from .given import expected
from .labels import HATCH_GREY, LABEL_STYLES, UNRESOLVED, label_codes, label_handles, label_style
from .mesh import edges
from .parameter_units import grid_label
from .style import legend_above, new_axes

Array = NDArray[np.float64]

_NO_EXPONENT = "/////"


@naming
def chart(
    chart: Sweep,
    *,
    color: Literal["label", "exponent"] = "label",
    limit: float | None = None,
    legend: bool = True,
    ax: Axes | None = None,
) -> Axes:
    r"""Draw a chart, its first axis along the horizontal.

    By label: a colour for each number m of drive periods per orbit, and one each for complete
    chatter, no impact, quasi-periodic and chaotic motions. Where there is no label the cells are
    hatched, and the legend says why.

    By exponent: the largest Lyapunov exponent, white where it is 0, red where it is positive;
    hatched where there is none.

    Parameters
    ----------
    chart : Chart, or Sweep over two axes
        Result of `vibroimpact.chart`.
    color : {"label", "exponent"}
        What the colour tells.
    limit : float, optional
        Exponents of this size have the full colour, and so have those beyond. By default the
        largest positive exponent, or the largest size if none is positive.
    legend : bool
        Name the kinds of labels above the axes, or put a colour bar beside them.
    ax : matplotlib.axes.Axes, optional
        Where to draw; a new figure if None.

    Returns
    -------
    matplotlib.axes.Axes

    Raises
    ------
    ParameterError
        If an argument is of the wrong kind or out of range, or the chart has no exponents.

    Examples
    --------
    >>> import vibroimpact as vi
    >>> system = vi.System(mass_ratio=0.6, frequency_ratio=2, restitution=0.8, gap=0.5,
    ...                    drive_frequency=1.8, moment_amplitude=1)
    >>> chart = vi.chart(
    ...     system, drive_frequency=[1.7, 1.8, 1.9], restitution=[0.7, 0.8], initial=(0, 0.5, 0, 0),
    ...     periods=200,
    ... )
    >>> vi.plot.chart(chart, color="exponent").get_xlabel()
    'drive frequency $\\omega$'
    """
    chart = expected("chart", chart, Sweep)
    if len(chart.axes) != 2 or not len(chart):
        reject("chart", chart, "a vibroimpact.Chart, or a Sweep over two axes")
    if color not in ("label", "exponent"):
        reject("color", color, "'label' or 'exponent'")
    if limit is not None:
        limit = positive("limit", limit)
    if color == "exponent" and "largest_exponent" not in chart.columns:
        reject("color", color, "'label' for a chart without exponents")
    ax = new_axes(ax)
    if color == "label":
        handles = _labels(ax, chart)
        if legend:
            legend_above(ax, handles, columns=4)
    else:
        _exponents(ax, chart, limit, legend)
    (first, x), (second, y) = chart.axes.items()
    # Curves drawn over the chart do not change its limits.
    left, *_, right = edges(np.sort(x)).tolist()
    bottom, *_, top = edges(np.sort(y)).tolist()
    ax.set_xlim(left, right)
    ax.set_ylim(bottom, top)
    ax.set_xlabel(grid_label(chart, first))
    ax.set_ylabel(grid_label(chart, second))
    return ax


@naming
def chart_handles(chart: Sweep) -> list[Artist]:
    """Return one legend entry for each kind of label in a chart.

    Examples
    --------
    >>> import vibroimpact as vi
    >>> system = vi.System(mass_ratio=0.6, frequency_ratio=2, restitution=0.8, gap=0.5,
    ...                    drive_frequency=1.8, moment_amplitude=1)
    >>> chart = vi.chart(
    ...     system, drive_frequency=[1.7, 1.8, 1.9], restitution=[0.7, 0.8], initial=(0, 0.5, 0, 0),
    ...     periods=200,
    ... )
    >>> [handle.get_label() for handle in vi.plot.chart_handles(chart)]
    ['$m = 1$', 'chaotic']
    """
    return label_handles(np.unique(label_codes(chart)).tolist())


def _labels(ax: Axes, chart: Sweep) -> list[Artist]:
    codes = label_codes(chart)
    palette = ListedColormap([style.color for style in LABEL_STYLES])
    colored = np.ma.masked_greater_equal(codes, UNRESOLVED)
    _mesh(ax, chart, colored, cmap=palette, vmin=-0.5, vmax=len(LABEL_STYLES) - 0.5)
    present: list[int] = np.unique(codes).tolist()
    for code in present:
        if code >= UNRESOLVED:
            _hatch(ax, chart, codes == code, label_style(code).hatch)
    return label_handles(present)


def _exponents(ax: Axes, chart: Sweep, limit: float | None, legend: bool) -> None:
    exponent = chart.largest_exponent
    finite = exponent[np.isfinite(exponent)]
    if limit is None:
        largest = max(finite.max(initial=0.0), 0.0) or np.abs(finite).max(initial=0.0)
        limit = float(largest) or 1.0
    none = np.isnan(exponent)
    mesh = _mesh(
        ax,
        chart,
        # -inf, where perturbations die out at once, has the colour of the lower end.
        np.ma.masked_where(none, np.maximum(exponent, -1e300)),
        cmap="RdBu_r",
        norm=CenteredNorm(0.0, halfrange=limit),
    )
    if none.any():
        _hatch(ax, chart, none, _NO_EXPONENT)
    if legend:
        below, above = bool((exponent < -limit).any()), bool((exponent > limit).any())
        extend = {(True, False): "min", (False, True): "max", (True, True): "both"}
        bar = ax.figure.colorbar(mesh, ax=ax, extend=extend.get((below, above), "neither"))
        bar.set_label(LARGEST_EXPONENT)
        if none.any():
            patch = Patch(facecolor="white", edgecolor=HATCH_GREY, hatch=_NO_EXPONENT, lw=0.4)
            patch.set_label("no exponent")
            legend_above(ax, [patch])


def _mesh(ax: Axes, chart: Sweep, values: NDArray[Any], **options: Any) -> QuadMesh:
    """Draw one value per cell, the first axis along the horizontal, in rising order."""
    x, y, order = _corners(chart)
    return ax.pcolormesh(x, y, values[order].T, rasterized=True, **options)


def _hatch(ax: Axes, chart: Sweep, chosen: NDArray[np.bool_], hatch: str) -> None:
    x, y, order = _corners(chart)
    cells = ax.pcolor(
        x,
        y,
        np.ma.masked_where(~chosen, chosen)[order].T,
        hatch=hatch,
        cmap=ListedColormap(["white"]),
        edgecolor=HATCH_GREY,
        linewidth=0.0,
    )
    cells.set_gid(f"hatch-{hatch}")


def _corners(chart: Sweep) -> tuple[Array, Array, tuple[NDArray[np.int64], ...]]:
    x, y = chart.axes.values()
    by_x, by_y = np.argsort(x), np.argsort(y)
    return edges(x[by_x]), edges(y[by_y]), np.ix_(by_x, by_y)

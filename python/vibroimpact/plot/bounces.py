"""All impacts of a run over time, those that complete chatter skipped included.

`vibroimpact.Run.bounces`; chatter: theory page, section 5.
"""

from __future__ import annotations

from matplotlib.axes import Axes

from ..arguments import naming
from ..bounces import Bounces
from .axis_names import STATE_NAMES
from .given import expected
from .style import BLACK, ORANGE, curve_legend, mark_area, new_axes


@naming
def bounces(
    result: Bounces, *, size: float | None = None, legend: bool = True, ax: Axes | None = None
) -> Axes:
    """Draw the approach velocity of every impact against time, on a logarithmic axis.

    In a complete chatter the points fall on a steep line towards the instant at which it ends.
    Those that the run skipped are orange.

    Parameters
    ----------
    result : Bounces
        Result of `vibroimpact.Run.bounces`.
    size : float, optional
        Area of a marker in square points; by default smaller the more impacts there are.
    legend : bool
        Name both kinds of impacts above the axes, if there are both.
    ax : matplotlib.axes.Axes, optional
        Where to draw; a new figure if None.

    Returns
    -------
    matplotlib.axes.Axes

    Raises
    ------
    ParameterError
        If an argument is of the wrong kind.

    Examples
    --------
    >>> import vibroimpact as vi
    >>> ball = vi.System(
    ...     mass_ratio=0, frequency_ratio=0, restitution=0.9, gap=0, drive_frequency=0,
    ...     moment_amplitude=1, contact="direct",
    ... )
    >>> run = vi.simulate(ball, initial=(-1, 0, 0, 0), time=40)
    >>> vi.plot.bounces(run.bounces(down_to=1e-6)).get_yscale()
    'log'
    """
    result = expected("result", result, Bounces)
    rows = result.impacts
    area = mark_area(size, len(rows))
    ax = new_axes(ax)
    # A graze may approach with velocity 0, which has no place on the axis.
    moving = rows["approach_velocity"] > 0.0
    for skipped, color, text in (
        (False, BLACK, "listed by the run"),
        (True, ORANGE, "skipped in chatter"),
    ):
        here = moving & (rows["skipped"] == skipped)
        if here.any():
            ax.scatter(
                rows["time"][here],
                rows["approach_velocity"][here],
                s=area,
                color=color,
                linewidths=0,
                label=text,
                rasterized=True,
            )
    if moving.any():
        ax.set_yscale("log")
    ax.set_xlabel(STATE_NAMES["time"])
    ax.set_ylabel(STATE_NAMES["approach_velocity"])
    curve_legend(ax, legend)
    return ax

"""The digits of a run that `vibroimpact.verify` found to be right, over time."""

from __future__ import annotations

from matplotlib.axes import Axes

from ..arguments import naming
from ..verification import Verification
from .axis_names import STATE_NAMES
from .given import expected
from .style import BLACK, BLUE, GREY, ORANGE, VERMILLION, curve_legend, new_axes

# Tables, their names, colours and marks.
_TABLES = (
    ("whole_impacts", "impacts", BLACK, "."),
    ("whole_contacts", "sustained contact", ORANGE, "s"),
    ("whole_sections", "sections", BLUE, "+"),
    ("final", "final state", BLACK, "D"),
)


@naming
def verification(result: Verification, *, legend: bool = True, ax: Axes | None = None) -> Axes:
    """Draw how many digits of a run are right, event by event, against time.

    Each mark is the worst number of its row. The dashed line is at the digits asked for; a red line
    is the horizon, the first event that lacks them.

    Parameters
    ----------
    result : Verification
        Result of `vibroimpact.verify`.
    legend : bool
        Name marks and lines above the axes.
    ax : matplotlib.axes.Axes, optional
        Where to draw; a new figure if None.

    Returns
    -------
    matplotlib.axes.Axes

    Raises
    ------
    ParameterError
        If `result` is something else.

    Examples
    --------
    >>> import vibroimpact as vi
    >>> system = vi.System(mass_ratio=0.6, frequency_ratio=2, restitution=0.8, gap=0.5,
    ...                    drive_frequency=1.8, moment_amplitude=1)
    >>> check = vi.verify(vi.simulate(system, initial=(0, 0.5, 0, 0), periods=10))
    >>> vi.plot.verification(check).get_ylabel()
    'right digits'
    """
    result = expected("result", result, Verification)
    ax = new_axes(ax)
    for name, text, color, marker in _TABLES:
        table = getattr(result, name)
        if len(table):
            ax.plot(
                table["time"], table["digits"], marker, color=color, ms=4.0, mew=0.8, label=text
            )
    ax.axhline(result.digits, color=GREY, lw=0.8, ls=(0, (4, 2)), label="asked for")
    if result.horizon is not None:
        ax.axvline(result.horizon.time, color=VERMILLION, lw=0.8, label="horizon")
    ax.set_ylim(0.0, 17.0)
    ax.set_xlabel(STATE_NAMES["time"])
    ax.set_ylabel("right digits")
    curve_legend(ax, legend)
    return ax

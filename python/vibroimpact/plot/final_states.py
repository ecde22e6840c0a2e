"""A sweep over one parameter: where each run ends, coloured by the label of its motion."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import to_rgba_array

from ..arguments import naming, reject
from ..sweeps import Sweep
from .axis_names import state_name
from .labels import LABEL_STYLES, NO_LABEL_COLOR, UNRESOLVED, label_codes, label_handles
from .parameter_units import grid_label
from .style import legend_above, new_axes


@naming
def final_states(
    sweep: Sweep,
    *,
    value: str | None = None,
    size: float = 6.0,
    legend: bool = True,
    ax: Axes | None = None,
) -> Axes:
    """Draw the state at the end of each run of a sweep over one axis, coloured by label.

    A run ends with a drive period, so that a point is one of the stroboscopic section.

    Parameters
    ----------
    sweep : Sweep
        Result of `vibroimpact.sweep` over one axis.
    value : str, optional
        What of the state: "x1", the default, "v1", "x2" or "v2"; of a structure "q_0", the default,
        or another of its coordinates and velocities, such as "v_1".
    size : float
        Area of a point in square points.
    legend : bool
        Name the kinds of labels above the axes.
    ax : matplotlib.axes.Axes, optional
        Where to draw; a new figure if None.

    Returns
    -------
    matplotlib.axes.Axes

    Raises
    ------
    ParameterError
        If an argument is of the wrong kind, or the sweep has not one axis.

    Examples
    --------
    >>> import vibroimpact as vi
    >>> system = vi.System(mass_ratio=0.6, frequency_ratio=2, restitution=0.8, gap=0.5,
    ...                    drive_frequency=1.8, moment_amplitude=1)
    >>> states = vi.sweep(system, drive_frequency=[1.7, 1.8], initial=(0, 0.5, 0, 0), periods=200)
    >>> vi.plot.final_states(states, value="x2").get_ylabel()
    'position $x_2$ of body 2 at the end'
    """
    if not isinstance(sweep, Sweep) or len(sweep.axes) != 1:
        reject("sweep", sweep, "a vibroimpact.Sweep over one axis, or over two for plot.chart")
    coordinates = sweep._machine.coordinates
    value = coordinates[0] if value is None else value
    if value not in coordinates:
        reject("value", value, f"one of {', '.join(coordinates)}")
    ((name, values),) = sweep.axes.items()
    codes = label_codes(sweep)
    palette = to_rgba_array([*(style.point_color for style in LABEL_STYLES), NO_LABEL_COLOR])
    heights = sweep.final_states.reshape(len(values), -1)[:, coordinates.index(value)]
    ax = new_axes(ax)
    ax.scatter(values, heights, s=size, c=palette[np.minimum(codes, UNRESOLVED)], linewidths=0)
    if legend and len(codes):
        legend_above(ax, label_handles(np.unique(codes).tolist(), points=True), columns=4)
    ax.set_xlabel(grid_label(sweep, name))
    name = state_name(value)
    ax.set_ylabel(f"{name} at the end")
    return ax

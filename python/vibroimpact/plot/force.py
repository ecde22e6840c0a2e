"""The contact force of one run over time.

Normal force p and tangential force on the tip, docs/theory.md section 5: in slip the tangential
force is -mu s sgn(sin x1) p, in stick the force that holds the tip, at most mu p in size.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes

from .curve import sample, times_within
from .marks import mark_contact_times
from .style import BLACK, VERMILLION, new_axes
from .units import AxisUnits

if TYPE_CHECKING:
    from ..run import Run
    from ..scales import Units


def contact_force(
    run: Run,
    *,
    window: tuple[float, float] | None = None,
    periods: float = 8,
    points_per_period: int = 200,
    units: Units | None = None,
    ax: Axes | None = None,
) -> Axes:
    r"""Draw the normal and the tangential contact force against time.

    Both are zero in flight; the impulses of impacts take no time and are not drawn. The dotted
    lines are the edges of Coulomb's cone, `mu p` to either side: on an edge the tip slides, between
    them it sticks. Bands mark sustained contact. Unit: M1 l omega_2^2, or N.

    Parameters
    ----------
    run : Run
        Result of `vibroimpact.simulate`.
    window : (float, float), optional
        Times; by default the last `periods` drive periods, or what is kept of them. Needed for a
        constant load, which has no period.
    periods : float
        Length of the default window in drive periods.
    points_per_period : int
        Samples in a drive period; with a constant load, samples in the window.
    units : "SI", optional
        Draw in s and N, and take `window` in s; the system needs scales.
    ax : matplotlib.axes.Axes, optional
        Where to draw; a new figure if None.

    Returns
    -------
    matplotlib.axes.Axes
    """
    ax = new_axes(ax)
    drawn = AxisUnits.of(units, run.system)
    curve = sample(
        run, window=drawn.window(window), periods=periods, points_per_period=points_per_period
    )
    start, end = window = (float(curve.time[0]), float(curve.time[-1]))
    # Both sides of every change, where the forces jump.
    changes = times_within(run.contacts["time"], window)
    before = times_within(np.nextafter(changes, -np.inf), window)
    time = np.unique(np.concatenate([curve.time, before]))
    forces = run.trajectory(time, forces=True)[:, 4:] * drawn.factor("normal_force")
    normal, tangential = forces.T
    seconds = drawn.factor("time")
    mark_contact_times(ax, run, window, seconds)
    time = time * seconds
    friction = run.system.friction
    if friction > 0.0 and normal.any():
        for sign, label in ((1.0, r"$\pm\mu p$"), (-1.0, "_nolegend_")):
            ax.plot(time, sign * friction * normal, color="0.4", lw=0.7, ls=":", label=label)
    ax.plot(time, normal, color=BLACK, lw=1.2, label=r"normal, $p$")
    ax.plot(time, tangential, color=VERMILLION, lw=1.0, ls=(0, (4, 1.5)), label="tangential")
    ax.set_xlim(start * seconds, end * seconds)
    ax.set_xlabel(drawn.label("time"))
    ax.set_ylabel(drawn.label("normal_force", "contact force"))
    return ax

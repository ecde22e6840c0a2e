"""The contact force of one run over time.

Normal force p and tangential force on the tip, theory page, section 5: in slip the tangential
force is -mu s sgn(sin x1) p, in stick the force that holds the tip, at most mu p in size.
"""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes

from ..arguments import naming
from ..run import Run
from ..scales import Units
from .curve import times_within
from .history import History
from .style import BLACK, VERMILLION


@naming
def contact_force(
    run: Run,
    *,
    window: tuple[float, float] | None = None,
    periods: float | None = None,
    points_per_period: int | None = None,
    legend: bool = True,
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
        Times, within the kept part of the run. By default what can be read: the last eight drive
        periods, or fewer where these have many oscillations or impacts; without a drive the
        beginning of the kept part, down to rest.
    periods : float, optional
        Length of the window in drive periods, in place of `window`: the last ones, or what is kept
        of them.
    points_per_period : int, optional
        Samples in a drive period; without one, in the window. By default so many that
        every flight and every oscillation is smooth.
    legend : bool
        Name forces and bands above the axes.
    units : "SI", optional
        Draw in s and N, and take `window` in s; the system needs scales.
    ax : matplotlib.axes.Axes, optional
        Where to draw; a new figure if None.

    Returns
    -------
    matplotlib.axes.Axes

    Raises
    ------
    ParameterError
        As for `time_history`.

    Examples
    --------
    >>> import vibroimpact as vi
    >>> ball = vi.System(
    ...     mass_ratio=0, frequency_ratio=0, restitution=0.9, gap=0, drive_frequency=0,
    ...     moment_amplitude=1, contact="direct",
    ... )
    >>> run = vi.simulate(ball, initial=(-1, 0, 0, 0), time=40)
    >>> vi.plot.contact_force(run, window=(0, 40)).get_ylabel()
    'contact force'
    """
    history = History(
        run,
        window=window,
        periods=periods,
        points_per_period=points_per_period,
        units=units,
        ax=ax,
    )
    ax, drawn, window = history.axes, history.units, history.window
    # Both sides of every change, where the forces jump.
    changes = times_within(run.contacts["time"], window)
    before = times_within(np.nextafter(changes, -np.inf), window)
    time = np.unique(np.concatenate([history.curve.time, before]))
    forces = run.trajectory(time, forces=True)[:, 4:] * drawn.factor("normal_force")
    normal, tangential = forces.T
    time = time * drawn.factor("time")
    friction = run.system.friction
    if friction > 0.0 and normal.any():
        for sign, label in ((1.0, r"$\pm\mu p$"), (-1.0, "_nolegend_")):
            ax.plot(time, sign * friction * normal, color="0.4", lw=0.7, ls=":", label=label)
    ax.plot(time, normal, color=BLACK, lw=1.2, label=r"normal, $p$")
    ax.plot(time, tangential, color=VERMILLION, lw=1.0, ls=(0, (4, 1.5)), label="tangential")
    if not normal.any():
        text = "no sustained contact in this window"
        ax.text(0.5, 0.9, text, transform=ax.transAxes, ha="center", va="top", color="0.35")
        ax.set_ylim(-0.2, 1.0)
    return history.finish(drawn.label("normal_force", "contact force"), legend=legend)

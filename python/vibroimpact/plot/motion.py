"""Time histories and phase portraits of one run.

Curves are drawn through `Run.trajectory` with the states before and after every impact inserted, so
that a velocity jumps exactly at the instant of the impact. Sustained contact is marked: bands on an
axis of time, a broad line and dots in a portrait; sticking is darker and hatched. Symbols as in
the notation page: gap function g = sin x1 - x2 - delta (oblique), theory page, section 1.
"""

from __future__ import annotations

from typing import Literal

import numpy as np
from matplotlib.axes import Axes
from numpy.typing import NDArray

from ..run import Run
from .curve import Curve, is_driven, is_one_orbit, orbit_window, sample, tip_symbol
from .given import bodies_of, chosen, expected, regime_color
from .marks import mark_contact_path, mark_contact_times, mark_regimes
from .style import BLACK, BLUE, GREY, curve_legend, new_axes

Array = NDArray[np.float64]
Drive = Literal["auto", "plain", "none"]

_DRIVES = ("auto", "plain", "none")
# The drive, of amplitude 1, may take so many times the height of the motion.
_FLATTENED = 2.2
# Else its amplitude is this part of the height.
_SCALED = 0.25
# Portraits with more jumps have thin lines.
_MANY = 60


def time_history(
    run: Run,
    *,
    window: tuple[float, float] | None = None,
    periods: float | None = None,
    points_per_period: int | None = None,
    color: Literal["regime"] | None = None,
    drive: Drive = "auto",
    legend: bool = True,
    ax: Axes | None = None,
) -> Axes:
    r"""Draw the contact faces of both bodies and the drive against time.

    The thick curve is `x2`, the thin one `sin x1 - delta` (they touch at an impact), the dashed
    one `cos(omega t + phi)`, as in the paper's Figs. 5, 6 and 9. Bands mark sustained contact.

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
        Samples in a drive period; of a constant load, samples in the window. By default so many
        that every flight and every oscillation is smooth.
    color : "regime" or None
        Mark the impacts by their regime.
    drive : {"auto", "plain", "none"}
        The curve of the drive: as it is, or none. "auto" scales and shifts it where it would
        flatten the motion, which the legend says, and leaves it out where nothing is driven.
    legend : bool
        Name curves, bands and regimes above the axes.
    ax : matplotlib.axes.Axes, optional
        Where to draw; a new figure if None.

    Returns
    -------
    matplotlib.axes.Axes

    Raises
    ------
    ParameterError
        If an argument is of the wrong kind or out of range, the window lies outside the kept part
        of the run, or `periods` is given for a constant load.
    """
    run = expected("run", run, Run)
    by_regime = regime_color(color)
    chosen("drive", drive, _DRIVES)
    ax = new_axes(ax)
    curve = sample(run, window=window, periods=periods, points_per_period=points_per_period)
    mark_contact_times(ax, run, (curve.time[0], curve.time[-1]))
    system = run.system
    face = system.tip(curve.state[:, 0]) - system.gap
    if drive == "plain" or (drive == "auto" and is_driven(system)):
        _drive(ax, run, curve, np.concatenate([face, curve.state[:, 2]]), plain=drive == "plain")
    ax.plot(curve.time, curve.state[:, 2], color=BLACK, lw=1.4, label=r"$x_2$")
    ax.plot(curve.time, face, color=BLACK, lw=0.6, label=rf"${tip_symbol(run.system)}-\delta$")
    if by_regime:
        hits = run.impacts[curve.impacts]
        mark_regimes(ax, run, hits["time"], hits["x2"], curve.impacts)
    ax.set_ylabel(rf"$x_2,\ {tip_symbol(run.system)}-\delta$")
    _time_axis(ax, curve, legend)
    return ax


def _drive(ax: Axes, run: Run, curve: Curve, motion: Array, *, plain: bool) -> None:
    """Draw the drive; where it would flatten the motion, or be flattened, scaled and shifted."""
    low, high = float(motion.min()), float(motion.max())
    height, together = high - low, max(high, 1.0) - min(low, -1.0)
    drive = np.cos(run.system.drive_frequency * curve.time + run.system.phase)
    label = r"$\cos\omega t$"
    if not plain and height > 0.0 and not together / _FLATTENED <= height <= 10.0:
        drive = 0.5 * (low + high) + _SCALED * height * drive
        label += ", scaled"
    ax.plot(curve.time, drive, color=GREY, lw=0.6, ls=(0, (4, 2)), label=label)


def _time_axis(ax: Axes, curve: Curve, legend: bool) -> None:
    ax.set_xlim(curve.time[0], curve.time[-1])
    ax.set_xlabel(r"$t$")
    curve_legend(ax, legend)


def phase_portrait(
    run: Run,
    *,
    bodies: int | tuple[int, ...] | None = None,
    window: tuple[float, float] | None = None,
    periods: float | None = None,
    points_per_period: int | None = None,
    color: Literal["regime"] | None = None,
    legend: bool = True,
    ax: Axes | None = None,
) -> Axes:
    """Draw velocity against position, impacts as vertical jumps.

    Body 1 is a solid line. So is body 2, thin and blue, but for a periodic motion drawn once, which
    leaves room for dashes. A broad light line marks sliding in sustained contact, a dot sticking.

    Parameters
    ----------
    run, points_per_period, color, legend
        As in `time_history`.
    bodies : int or tuple of int, optional
        Which bodies to draw: 1 the pendulum, 2 the oscillator. By default both, but for a wall at
        rest.
    window : (float, float), optional
        Times, within the kept part of the run. By default one orbit of a periodic motion, of others
        the last forty drive periods; without a drive as in `time_history`.
    periods : float, optional
        Length of the window in drive periods, in place of `window`.
    ax : matplotlib.axes.Axes, optional
        Where to draw; a new figure if None.

    Returns
    -------
    matplotlib.axes.Axes

    Raises
    ------
    ParameterError
        As for `time_history`.
    """
    run = expected("run", run, Run)
    by_regime = regime_color(color)
    drawn = bodies_of(bodies, run)
    if window is None and periods is None:
        window = orbit_window(run)
    curve = sample(run, window=window, periods=periods, points_per_period=points_per_period)
    ax = new_axes(ax)
    hits = run.impacts[curve.impacts]
    once = is_one_orbit(run, float(curve.time[-1] - curve.time[0]))
    many = not once and len(hits) > _MANY
    for body in drawn:
        x, v = curve.state[:, 2 * body - 2], curve.state[:, 2 * body - 1]
        first = body == 1
        mark_contact_path(ax, run, curve, x, v, named=body == drawn[0])
        ax.plot(
            x,
            v,
            color=BLACK if first else BLUE,
            lw=0.4 if many else 0.8,
            ls="-" if first or not once else (0, (5, 1.2, 1, 1.2)),
            label=rf"$x_{body},\ \dot x_{body}$",
        )
        if by_regime:
            mark_regimes(ax, run, hits[f"x{body}"], hits[f"v{body}_pre"], curve.impacts)
    ax.set_xlabel("$" + r",\ ".join(f"x_{body}" for body in drawn) + "$")
    ax.set_ylabel("$" + r",\ ".join(rf"\dot x_{body}" for body in drawn) + "$")
    curve_legend(ax, legend)
    return ax


def gap_history(
    run: Run,
    *,
    window: tuple[float, float] | None = None,
    periods: float | None = None,
    points_per_period: int | None = None,
    color: Literal["regime"] | None = None,
    legend: bool = True,
    ax: Axes | None = None,
) -> Axes:
    """Draw the gap function sin x1 - x2 - delta against time; it is zero at an impact.

    It stays zero in sustained contact, which bands mark.

    Parameters
    ----------
    run, window, periods, points_per_period, color
        As in `time_history`.
    legend : bool
        Name bands and regimes above the axes, if there are any.
    ax : matplotlib.axes.Axes, optional
        Where to draw; a new figure if None.

    Returns
    -------
    matplotlib.axes.Axes

    Raises
    ------
    ParameterError
        As for `time_history`.
    """
    run = expected("run", run, Run)
    by_regime = regime_color(color)
    ax = new_axes(ax)
    curve = sample(run, window=window, periods=periods, points_per_period=points_per_period)
    gap = run.system.gap_function(curve.state)
    mark_contact_times(ax, run, (curve.time[0], curve.time[-1]))
    ax.axhline(0.0, color=GREY, lw=0.6)
    ax.plot(curve.time, gap, color=BLACK, lw=0.6)
    if by_regime:
        hits = run.impacts[curve.impacts]
        mark_regimes(ax, run, hits["time"], np.zeros(len(hits)), curve.impacts)
    ax.set_ylabel(rf"${tip_symbol(run.system)}-x_2-\delta$")
    _time_axis(ax, curve, legend)
    return ax


def displacement_history(
    run: Run,
    *,
    window: tuple[float, float] | None = None,
    periods: float | None = None,
    points_per_period: int | None = None,
    color: Literal["regime"] | None = None,
    legend: bool = True,
    ax: Axes | None = None,
) -> Axes:
    """Draw x1 (grey) and x2 (black) against time, as in the paper's Fig. 10(b).

    Bands mark sustained contact.

    Parameters
    ----------
    run, window, periods, points_per_period, color, legend
        As in `time_history`.
    ax : matplotlib.axes.Axes, optional
        Where to draw; a new figure if None.

    Returns
    -------
    matplotlib.axes.Axes

    Raises
    ------
    ParameterError
        As for `time_history`.
    """
    run = expected("run", run, Run)
    by_regime = regime_color(color)
    ax = new_axes(ax)
    curve = sample(run, window=window, periods=periods, points_per_period=points_per_period)
    mark_contact_times(ax, run, (curve.time[0], curve.time[-1]))
    ax.plot(curve.time, curve.state[:, 0], color=GREY, lw=0.6, label=r"$x_1$")
    ax.plot(curve.time, curve.state[:, 2], color=BLACK, lw=0.8, label=r"$x_2$")
    if by_regime:
        hits = run.impacts[curve.impacts]
        mark_regimes(ax, run, hits["time"], hits["x2"], curve.impacts)
    ax.set_ylabel(r"$x_1,\ x_2$")
    _time_axis(ax, curve, legend)
    return ax

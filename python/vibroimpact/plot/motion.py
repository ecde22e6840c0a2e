"""Time histories and phase portraits of one run.

Curves are drawn through `Run.trajectory` with the states before and after every impact inserted, so
that a velocity jumps exactly at the instant of the impact. Sustained contact is marked: bands on an
axis of time, a broad line and dots in a portrait; sticking is darker and hatched. Symbols as in
the notation page: gap function g = sin x1 - x2 - delta (oblique), theory page, section 1.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal

import numpy as np
from matplotlib.axes import Axes
from numpy.typing import NDArray

from ..arguments import naming, reject
from ..run import Run
from ..scales import Units
from ..structure_run import StructureRun
from .axis_names import STATE_SYMBOLS
from .curve import is_driven, is_one_orbit, orbit_window, sample, tip_symbol
from .given import bodies_of, chosen, expected, of_structure, of_system, regime_color
from .history import History
from .marks import mark_contact_path, mark_regimes
from .structure_history import structure_history
from .structure_portrait import structure_portrait
from .style import BLACK, BODY_COLORS, GREY, curve_legend, new_axes
from .units import AxisUnits

Array = NDArray[np.float64]
Drive = Literal["auto", "plain", "none"]

_DRIVES = ("auto", "plain", "none")
# The drive, of amplitude 1, may take so many times the height of the motion.
_FLATTENED = 2.2
# Else its amplitude is this part of the height.
_SCALED = 0.25
# Portraits with more jumps have thin lines.
_MANY = 60


@naming
def time_history(
    run: Run | StructureRun,
    *,
    coordinates: int | str | Sequence[int | str] | None = None,
    window: tuple[float, float] | None = None,
    periods: float | None = None,
    points_per_period: int | None = None,
    color: Literal["regime"] | None = None,
    drive: Drive = "auto",
    legend: bool = True,
    units: Units | None = None,
    ax: Axes | None = None,
) -> Axes:
    r"""Draw the contact faces of both bodies and the drive against time.

    The thick grey curve is `x2`, the thin black one `sin x1 - delta` (they touch at an impact), the
    dotted one `cos(omega t + phi)`: the curves of the paper's Figs. 5, 6 and 9. Bands mark
    sustained contact.

    Of a structure coordinates are drawn. A dashed line is a stop that acts on one of them, a mark
    an impact on that stop or on another that acts on the coordinate; a broad line of the stop's
    colour says that it is closed.

    Parameters
    ----------
    run : Run or StructureRun
        Result of `vibroimpact.simulate`.
    coordinates : int, str, or sequence of them, optional
        Of a structure, which coordinates to draw, from 0, at most eight; ``"q_0-q_1"`` is a
        difference. By default four, those on which stops act before others.
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
    color : "regime" or None
        Mark the impacts by their regime; of a structure in place of their stop.
    drive : {"auto", "plain", "none"}
        The curve of the drive: as it is, or none. "auto" scales and shifts it where it would
        flatten the motion, which the legend says, and leaves it out where nothing is driven. None
        is drawn of a structure, whose coordinates have drives of their own.
    legend : bool
        Name curves, bands and regimes above the axes.
    units : "SI", optional
        Draw in s, m, rad, m/s, rad/s, and take `window` in s; the system needs scales.
    ax : matplotlib.axes.Axes, optional
        Where to draw; a new figure if None.

    Returns
    -------
    matplotlib.axes.Axes

    Raises
    ------
    ParameterError
        If an argument is of the wrong kind or out of range, the window lies outside the kept part
        of the run, or `periods` is given for `drive_frequency` = 0.

    Examples
    --------
    >>> import vibroimpact as vi
    >>> system = vi.System(mass_ratio=0.6, frequency_ratio=2, restitution=0.8, gap=0.5,
    ...                    drive_frequency=1.8, moment_amplitude=1)
    >>> run = vi.simulate(system, initial=(0, 0.5, 0, 0), periods=600, keep=100)
    >>> vi.plot.time_history(run, periods=4).get_xlabel()
    'time $t$'
    """
    chosen("drive", drive, _DRIVES)
    if isinstance(run, StructureRun):
        of_system(units=units)
        if drive == "plain":
            reject("drive", drive, "'auto' or 'none' for the run of a structure")
        return structure_history(
            run,
            coordinates=coordinates,
            window=window,
            periods=periods,
            points_per_period=points_per_period,
            color=color,
            legend=legend,
            ax=ax,
        )
    of_structure(coordinates=coordinates)
    by_regime = regime_color(color)
    history = History(
        run,
        window=window,
        periods=periods,
        points_per_period=points_per_period,
        units=units,
        ax=ax,
    )
    system, drawn, states = run.system, history.units, history.curve.state
    length = drawn.factor("x2")
    face = (system.tip(states[:, 0]) - system.gap) * length
    body2 = states[:, 2] * length
    tip = rf"l\,{tip_symbol(system)}-\Delta" if drawn.is_si else rf"{tip_symbol(system)}-\delta"
    body = "X" if drawn.is_si else "x_2"
    if drive == "plain" or (drive == "auto" and is_driven(system)):
        motion = np.concatenate([face, body2])
        _drive(history, motion, plain=drive == "plain")
    history.axes.plot(history.time, body2, color=BODY_COLORS[2], lw=1.8, label=f"${body}$")
    history.axes.plot(history.time, face, color=BODY_COLORS[1], lw=0.7, label=f"${tip}$")
    if by_regime:
        history.mark_regimes(history.hits["x2"] * length)
    return history.finish(drawn.label("x2", rf"positions ${body},\ {tip}$"), legend=legend)


def _drive(history: History, motion: Array, *, plain: bool) -> None:
    """Draw the drive; where it would flatten the motion, or be flattened, scaled and shifted."""
    # In SI a drive has another unit than a length: it is drawn as l cos(omega t + phi).
    system, drawn = history.run.system, history.units
    length = drawn.factor("x2")
    low, high = float(motion.min()), float(motion.max())
    height, together = high - low, max(high, length) - min(low, -length)
    drive = np.cos(system.drive_frequency * history.curve.time + system.phase)
    label = r"$l\,\cos\omega t$" if drawn.is_si else r"$\cos\omega t$"
    if not plain and height > 0.0 and not together / _FLATTENED <= height <= 10.0 * length:
        drive = 0.5 * (low + high) + _SCALED * height * drive
        # A scaled drive has no length.
        label = r"$\cos\omega t$, scaled"
    else:
        drive = length * drive
    history.axes.plot(history.time, drive, color=BLACK, lw=0.5, ls=(0, (1, 3)), label=label)


@naming
def phase_portrait(
    run: Run | StructureRun,
    *,
    bodies: int | tuple[int, ...] | None = None,
    coordinates: int | str | Sequence[int | str] | None = None,
    window: tuple[float, float] | None = None,
    periods: float | None = None,
    points_per_period: int | None = None,
    color: Literal["regime"] | None = None,
    legend: bool = True,
    units: Units | None = None,
    ax: Axes | None = None,
) -> Axes:
    """Draw velocity against position, impacts as vertical jumps.

    Body 1 is black, body 2 grey and broader. A broad blue line under them marks sliding in
    sustained contact, a dot sticking. Of a structure coordinates are drawn, with a mark of its stop
    before each impact.

    Parameters
    ----------
    run : Run or StructureRun
        Result of `vibroimpact.simulate`.
    bodies : int or tuple of int, optional
        Of a System, which bodies to draw: 1 the pendulum, 2 the oscillator. By default both, but
        for a wall at rest.
    coordinates : int, str, or sequence of them, optional
        Of a structure, which coordinates to draw, from 0, at most eight; ``"q_0-q_1"`` is a
        difference. By default two, those on
        which stops act before others.
    window : (float, float), optional
        Times, within the kept part of the run. By default one orbit of a periodic motion, of others
        the last forty drive periods; without a drive as in `time_history`.
    periods : float, optional
        Length of the window in drive periods, in place of `window`.
    points_per_period : int, optional
        Samples in a drive period; without one, in the window. By default so many that
        every flight and every oscillation is smooth.
    color : "regime" or None
        Mark the state before each impact by its regime; of a structure in place of its stop.
    legend : bool
        Name curves, marks of contact and regimes above the axes.
    units : "SI", optional
        Draw in s, m, rad, m/s, rad/s, and take `window` in s; the system needs scales.
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
    >>> system = vi.System(mass_ratio=0.6, frequency_ratio=2, restitution=0.8, gap=0.5,
    ...                    drive_frequency=1.8, moment_amplitude=1)
    >>> run = vi.simulate(system, initial=(0, 0.5, 0, 0), periods=600, keep=100)
    >>> vi.plot.phase_portrait(run, bodies=1).get_xlabel()
    'position $x_1$ of body 1'
    """
    if isinstance(run, StructureRun):
        of_system(bodies=bodies, units=units)
        return structure_portrait(
            run,
            coordinates=coordinates,
            window=window,
            periods=periods,
            points_per_period=points_per_period,
            color=color,
            legend=legend,
            ax=ax,
        )
    run = expected("run", run, Run)
    of_structure(coordinates=coordinates)
    by_regime = regime_color(color)
    shown = bodies_of(bodies, run)
    drawn = AxisUnits.of(units, run.system)
    window = drawn.window(window, run)
    if window is None and periods is None:
        window = orbit_window(run)
    curve = sample(run, window=window, periods=periods, points_per_period=points_per_period)
    ax = new_axes(ax)
    hits = run.impacts[curve.impacts]
    once = is_one_orbit(run, float(curve.time[-1] - curve.time[0]))
    many = not once and len(hits) > _MANY
    for body in shown:
        by_x, by_v = drawn.factor(f"x{body}"), drawn.factor(f"v{body}")
        x, v = curve.state[:, 2 * body - 2] * by_x, curve.state[:, 2 * body - 1] * by_v
        mark_contact_path(ax, run, curve, x, v, named=body == shown[0])
        ax.plot(
            x,
            v,
            color=BODY_COLORS[body],
            lw=(0.4 if many else 0.8) * (1.0 if body == 1 else 1.6),
            # Lines with many turns may not hide those of body 1.
            zorder=2.0 if body == 1 else 1.9,
            label=rf"$x_{body},\ \dot x_{body}$",
        )
        if by_regime:
            before = hits[f"v{body}_pre"] * by_v
            mark_regimes(ax, run, hits[f"x{body}"] * by_x, before, curve.impacts)
    ax.set_xlabel(drawn.of_bodies("x", shown))
    ax.set_ylabel(drawn.of_bodies("v", shown))
    curve_legend(ax, legend)
    return ax


@naming
def gap_history(
    run: Run,
    *,
    window: tuple[float, float] | None = None,
    periods: float | None = None,
    points_per_period: int | None = None,
    color: Literal["regime"] | None = None,
    legend: bool = True,
    units: Units | None = None,
    ax: Axes | None = None,
) -> Axes:
    """Draw the gap function sin x1 - x2 - delta against time; it is zero at an impact.

    It stays zero in sustained contact, which bands mark.

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
    color : "regime" or None
        Mark the impacts by their regime.
    legend : bool
        Name bands and regimes above the axes, if there are any.
    units : "SI", optional
        Draw in s, m, rad, m/s, rad/s, and take `window` in s; the system needs scales.
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
    >>> system = vi.System(mass_ratio=0.6, frequency_ratio=2, restitution=0.8, gap=0.5,
    ...                    drive_frequency=1.8, moment_amplitude=1)
    >>> run = vi.simulate(system, initial=(0, 0.5, 0, 0), periods=600, keep=100)
    >>> vi.plot.gap_history(run, periods=4).get_xlabel()
    'time $t$'
    """
    by_regime = regime_color(color)
    history = History(
        run,
        window=window,
        periods=periods,
        points_per_period=points_per_period,
        units=units,
        ax=ax,
    )
    drawn, states = history.units, history.curve.state
    gap = run.system.gap_function(states) * drawn.factor("x2")
    history.axes.axhline(0.0, color=GREY, lw=0.6)
    history.axes.plot(history.time, gap, color=BLACK, lw=0.6)
    if by_regime:
        history.mark_regimes(np.zeros(len(history.hits)))
    tip = tip_symbol(run.system)
    symbols = rf"l\,{tip}-X-\Delta" if drawn.is_si else rf"{tip}-x_2-\delta"
    return history.finish(drawn.label("x2", f"gap function ${symbols}$"), legend=legend)


@naming
def displacement_history(
    run: Run,
    *,
    window: tuple[float, float] | None = None,
    periods: float | None = None,
    points_per_period: int | None = None,
    color: Literal["regime"] | None = None,
    legend: bool = True,
    units: Units | None = None,
    ax: Axes | None = None,
) -> Axes:
    r"""Draw x1 (black) and x2 (grey) against time, as in the paper's Fig. 10(b).

    Bands mark sustained contact.

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
    color : "regime" or None
        Mark the impacts by their regime.
    legend : bool
        Name curves, bands and regimes above the axes.
    units : "SI", optional
        Draw in s, m, rad, m/s, rad/s, and take `window` in s; the system needs scales.
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
    >>> system = vi.System(mass_ratio=0.6, frequency_ratio=2, restitution=0.8, gap=0.5,
    ...                    drive_frequency=1.8, moment_amplitude=1)
    >>> run = vi.simulate(system, initial=(0, 0.5, 0, 0), periods=600, keep=100)
    >>> vi.plot.displacement_history(run, periods=4).get_ylabel()
    'positions $x_1$, $x_2$'
    """
    by_regime = regime_color(color)
    history = History(
        run,
        window=window,
        periods=periods,
        points_per_period=points_per_period,
        units=units,
        ax=ax,
    )
    drawn, states = history.units, history.curve.state
    x1, x2 = states[:, 0], states[:, 2] * drawn.factor("x2")
    history.axes.plot(history.time, x1, color=BODY_COLORS[1], lw=0.6, label=STATE_SYMBOLS["x1"])
    history.axes.plot(history.time, x2, color=BODY_COLORS[2], lw=1.4, label=STATE_SYMBOLS["x2"])
    if by_regime:
        history.mark_regimes(history.hits["x2"] * drawn.factor("x2"))
    return history.finish(drawn.of_bodies("x", (1, 2)), legend=legend)

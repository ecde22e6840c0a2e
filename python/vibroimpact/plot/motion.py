"""Time histories, phase portraits and impact sections of one run.

Curves are drawn through `Run.trajectory` with the states before and after every impact inserted, so
that a velocity jumps exactly at the instant of the impact. Sustained contact is marked: bands on an
axis of time, a broad line and dots in a portrait; sticking is darker and hatched. Symbols as in
docs/notation.md: gap function g = sin x1 - x2 - delta (oblique), docs/theory.md section 1.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal

import numpy as np
from matplotlib.axes import Axes

from .curve import sample, tip_symbol
from .marks import mark_contact_path, mark_contact_times, mark_regimes
from .style import (
    BLACK,
    GREY,
    REGIME_STYLES,
    new_axes,
)
from .units import AxisUnits

if TYPE_CHECKING:
    from ..run import Run
    from ..scales import Units


def time_history(
    run: Run,
    *,
    window: tuple[float, float] | None = None,
    periods: float = 8,
    points_per_period: int = 200,
    color: Literal["regime"] | None = None,
    units: Units | None = None,
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
        Times; by default the last `periods` drive periods, or what is kept of them. Needed for a
        constant load, which has no period.
    periods : float
        Length of the default window in drive periods.
    points_per_period : int
        Samples in a drive period; with a constant load, samples in the window.
    color : "regime" or None
        Mark the impacts by their regime.
    units : "SI", optional
        Draw in s, m, rad, m/s, rad/s, and take `window` in s; the system needs scales.
    ax : matplotlib.axes.Axes, optional
        Where to draw; a new figure if None.
    """
    ax = new_axes(ax)
    drawn = AxisUnits.of(units, run.system)
    curve = sample(
        run, window=drawn.window(window), periods=periods, points_per_period=points_per_period
    )
    time = curve.time * drawn.factor("time")
    mark_contact_times(ax, run, (curve.time[0], curve.time[-1]), drawn.factor("time"))
    system = run.system
    length = drawn.factor("x2")
    face = (system.tip(curve.state[:, 0]) - system.gap) * length
    # In SI a drive has another unit than a length: it is drawn as l cos(omega t + phi).
    drive = np.cos(system.drive_frequency * curve.time + system.phase) * length
    shown = r"$l\,\cos\omega t$" if drawn.is_si else r"$\cos\omega t$"
    tip = rf"l\,{tip_symbol(system)}-\Delta" if drawn.is_si else rf"{tip_symbol(system)}-\delta"
    body = "X" if drawn.is_si else "x_2"
    ax.plot(time, drive, color=GREY, lw=0.6, ls=(0, (4, 2)), label=shown)
    ax.plot(time, curve.state[:, 2] * length, color=BLACK, lw=1.4, label=f"${body}$")
    ax.plot(time, face, color=BLACK, lw=0.6, label=f"${tip}$")
    if color == "regime":
        hits = run.impacts[curve.impacts]
        mark_regimes(
            ax, run, hits["time"] * drawn.factor("time"), hits["x2"] * length, curve.impacts
        )
    ax.set_xlim(time[0], time[-1])
    ax.set_xlabel(drawn.label("time"))
    ax.set_ylabel(drawn.label("x2", rf"${body},\ {tip}$"))
    return ax


def phase_portrait(
    run: Run,
    *,
    bodies: tuple[int, ...] = (1, 2),
    window: tuple[float, float] | None = None,
    periods: float = 8,
    points_per_period: int = 200,
    color: Literal["regime"] | None = None,
    units: Units | None = None,
    ax: Axes | None = None,
) -> Axes:
    """Draw velocity against position: body 1 solid, body 2 dash-dotted, impacts as vertical jumps.

    A broad light line marks sliding in sustained contact, a dot sticking.

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
    bodies : tuple of int
        Which bodies to draw: 1 the pendulum, 2 the oscillator.
    color : "regime" or None
        Mark the state before each impact by its regime.
    units : "SI", optional
        Draw in s, m, rad, m/s, rad/s, and take `window` in s; the system needs scales.
    ax : matplotlib.axes.Axes, optional
        Where to draw; a new figure if None.
    """
    ax = new_axes(ax)
    drawn = AxisUnits.of(units, run.system)
    curve = sample(
        run, window=drawn.window(window), periods=periods, points_per_period=points_per_period
    )
    hits = run.impacts[curve.impacts]
    for body in bodies:
        by_x, by_v = drawn.factor(f"x{body}"), drawn.factor(f"v{body}")
        x, v = curve.state[:, 2 * body - 2] * by_x, curve.state[:, 2 * body - 1] * by_v
        solid = body == 1
        mark_contact_path(ax, run, curve, x, v, named=body == bodies[0])
        ax.plot(
            x,
            v,
            color=BLACK if solid else GREY,
            lw=0.7,
            ls="-" if solid else (0, (5, 1.2, 1, 1.2)),
            label=rf"$x_{body},\ \dot x_{body}$",
        )
        if color == "regime":
            before = hits[f"v{body}_pre"] * by_v
            mark_regimes(ax, run, hits[f"x{body}"] * by_x, before, curve.impacts)
    if drawn.is_si:
        ax.set_xlabel(", ".join(drawn.label(f"x{body}") for body in bodies))
        ax.set_ylabel(", ".join(drawn.label(f"v{body}") for body in bodies))
    else:
        ax.set_xlabel("$" + r",\ ".join(f"x_{body}" for body in bodies) + "$")
        ax.set_ylabel("$" + r",\ ".join(rf"\dot x_{body}" for body in bodies) + "$")
    return ax


def impact_section(
    run: Run,
    *,
    x: str = "x1",
    y: str = "v1_pre",
    color: Literal["regime"] | None = None,
    size: float = 6.0,
    units: Units | None = None,
    ax: Axes | None = None,
) -> Axes:
    """Draw two columns of `Run.impacts` against each other, one point for each kept impact.

    Parameters
    ----------
    run : Run
        Result of `vibroimpact.simulate`.
    x : str
        Column of the impact table on the horizontal axis.
    y : str
        Column on the vertical axis.
    color : "regime" or None
        Colour and shape by regime, or black dots.
    size : float
        Area of a marker in square points.
    units : "SI", optional
        Draw in SI; the system needs scales.
    ax : matplotlib.axes.Axes, optional
        Where to draw; a new figure if None.
    """
    ax = new_axes(ax)
    drawn = AxisUnits.of(units, run.system)
    impacts = run.impacts if units is None else run.in_si().impacts
    if color == "regime":
        for regime in np.unique(impacts["regime"]):
            style = REGIME_STYLES[int(regime)]
            here = impacts[impacts["regime"] == regime]
            ax.scatter(
                here[x],
                here[y],
                s=size,
                color=style.color,
                marker=style.marker,
                linewidths=0,
                label=style.text,
                rasterized=True,
            )
    else:
        ax.scatter(impacts[x], impacts[y], s=size, color=BLACK, linewidths=0, rasterized=True)
    ax.set_xlabel(drawn.label(x))
    ax.set_ylabel(drawn.label(y))
    return ax


def gap_history(
    run: Run,
    *,
    window: tuple[float, float] | None = None,
    periods: float = 8,
    points_per_period: int = 200,
    color: Literal["regime"] | None = None,
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
        Times; by default the last `periods` drive periods, or what is kept of them. Needed for a
        constant load, which has no period.
    periods : float
        Length of the default window in drive periods.
    points_per_period : int
        Samples in a drive period; with a constant load, samples in the window.
    color : "regime" or None
        Mark the impacts by their regime.
    units : "SI", optional
        Draw in s, m, rad, m/s, rad/s, and take `window` in s; the system needs scales.
    ax : matplotlib.axes.Axes, optional
        Where to draw; a new figure if None.
    """
    ax = new_axes(ax)
    drawn = AxisUnits.of(units, run.system)
    curve = sample(
        run, window=drawn.window(window), periods=periods, points_per_period=points_per_period
    )
    gap = run.system.gap_function(curve.state) * drawn.factor("x2")
    time = curve.time * drawn.factor("time")
    mark_contact_times(ax, run, (curve.time[0], curve.time[-1]), drawn.factor("time"))
    ax.axhline(0.0, color=GREY, lw=0.6)
    ax.plot(time, gap, color=BLACK, lw=0.6)
    if color == "regime":
        hits = run.impacts[curve.impacts]
        moments = hits["time"] * drawn.factor("time")
        mark_regimes(ax, run, moments, np.zeros(len(hits)), curve.impacts)
    ax.set_xlim(time[0], time[-1])
    ax.set_xlabel(drawn.label("time"))
    tip = tip_symbol(run.system)
    text = rf"$l\,{tip}-X-\Delta$" if drawn.is_si else rf"${tip}-x_2-\delta$"
    ax.set_ylabel(drawn.label("x2", text))
    return ax


def displacement_history(
    run: Run,
    *,
    window: tuple[float, float] | None = None,
    periods: float = 8,
    points_per_period: int = 200,
    color: Literal["regime"] | None = None,
    units: Units | None = None,
    ax: Axes | None = None,
) -> Axes:
    """Draw x1 (grey) and x2 (black) against time, as in the paper's Fig. 10(b).

    Bands mark sustained contact.

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
    color : "regime" or None
        Mark the impacts by their regime.
    units : "SI", optional
        Draw in s, m, rad, m/s, rad/s, and take `window` in s; the system needs scales.
    ax : matplotlib.axes.Axes, optional
        Where to draw; a new figure if None.
    """
    ax = new_axes(ax)
    drawn = AxisUnits.of(units, run.system)
    curve = sample(
        run, window=drawn.window(window), periods=periods, points_per_period=points_per_period
    )
    time = curve.time * drawn.factor("time")
    mark_contact_times(ax, run, (curve.time[0], curve.time[-1]), drawn.factor("time"))
    x1, x2 = curve.state[:, 0], curve.state[:, 2] * drawn.factor("x2")
    ax.plot(time, x1, color=GREY, lw=0.6, label=drawn.label("x1"))
    ax.plot(time, x2, color=BLACK, lw=0.8, label=drawn.label("x2"))
    if color == "regime":
        hits = run.impacts[curve.impacts]
        moments = hits["time"] * drawn.factor("time")
        mark_regimes(ax, run, moments, hits["x2"] * drawn.factor("x2"), curve.impacts)
    ax.set_xlim(time[0], time[-1])
    ax.set_xlabel(drawn.label("time"))
    ax.set_ylabel(f"{drawn.label('x1')}, {drawn.label('x2')}" if drawn.is_si else r"$x_1,\ x_2$")
    return ax


def impact_count(run: Run, *, ax: Axes | None = None) -> Axes:
    """Draw the number of impacts since t = 0 against drive periods, for the kept part of a run.

    Both axes are logarithmic: impacts that stop after a finite number end in a level line.

    Parameters
    ----------
    run : Run
        Result of `vibroimpact.simulate`.
    ax : matplotlib.axes.Axes, optional
        Where to draw; a new figure if None.
    """
    ax = new_axes(ax)
    period = run.impacts["period"] + 1
    count = np.arange(1, len(period) + 1) + run.impact_count - len(period)
    ax.step(
        np.append(period, run.final_state.time / run.system.drive_period),
        np.append(count, run.impact_count),
        where="post",
        color=BLACK,
        lw=0.9,
    )
    if run.impact_count:
        ax.set_xscale("log")
        ax.set_yscale("log")
    ax.set_xlabel("drive periods")
    ax.set_ylabel("impacts")
    return ax

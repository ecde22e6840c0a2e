r"""One periodic motion: phase portraits of both bodies, and the contact faces over one orbit.

Unlike the figures of runs these are drawn from the solution itself, so that they can show an
unstable motion, and a solution that is not admissible (orbits page).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes
from numpy.typing import NDArray

from .._core import Leg, LegKind
from ..arguments import count, naming
from ..orbits import PeriodicMotion
from ..scales import Units
from ..structure_motion import StructureOrbit
from ..sweeps.columns import COORDINATES
from .curve import tip_symbol
from .given import expected, of_structure, of_system
from .marks import ContactSpan, Mode, draw_bands, draw_path, draw_regimes
from .structure_orbit import structure_orbit
from .style import BLACK, BODY_COLORS, GREY, VERMILLION, several_axes
from .units import AxisUnits

Array = NDArray[np.float64]

# How the legs that are not flights are drawn.
_MODES: dict[LegKind, Mode] = {
    LegKind.CHATTER: "chatter",
    LegKind.SLIDE: "slide",
    LegKind.STICK: "stick",
}
# Gaps up to this are rounding.
_OVERLAP = 1e-10
# Samples of a stretch of chatter, whose bounces become ever shorter.
_CHATTER_POINTS = 300


class _Orbit(NamedTuple):
    """An orbit from t = 0: NaN rows keep the two sides of an impact apart."""

    time: Array
    state: Array
    face: Array
    spans: list[ContactSpan]
    # Where the bodies overlap.
    overlap: NDArray[np.bool_]


@naming
def orbit(
    motion: PeriodicMotion | StructureOrbit,
    *,
    coordinates: int | str | Sequence[int | str] | None = None,
    points_per_period: int = 400,
    legend: bool = True,
    units: Units | None = None,
    axes: Sequence[Axes] | None = None,
) -> list[Axes]:
    r"""Draw a periodic motion: the phase portrait of either body, and its time history.

    The history has `x2` (grey, thick) and `sin x1 - delta` (black, thin), which touch at an impact.
    Impacts have colour and shape of their regime, in the portraits at the state before; dotted
    lines are the jumps. Bands mark chatter and sustained contact. A solution that is not admissible
    has a title that says why; where the bodies overlap the curves are red and the space between
    them filled, and a cross marks an impact of bodies that are separating.

    Of a structure there are one portrait and one history of some coordinates, with the impacts
    marked by their stops, as those of `phase_portrait` and `time_history`.

    Parameters
    ----------
    motion : PeriodicMotion or StructureOrbit
        Stable or not, admissible or not.
    coordinates : int, str, or sequence of them, optional
        Of a structure, which coordinates to draw, as in `phase_portrait`.
    points_per_period : int
        Samples in a drive period.
    legend : bool
        Name what is marked, above the history.
    units : "SI", optional
        Draw in s, m, rad, m/s, rad/s; the system needs scales.
    axes : sequence of three matplotlib.axes.Axes, optional
        For the portraits of pendulum and oscillator and for the history; of a structure two, for
        the portrait and the history. A new figure if None.

    Returns
    -------
    list of matplotlib.axes.Axes

    Raises
    ------
    ParameterError
        If an argument is of the wrong kind or out of range.

    Examples
    --------
    >>> import vibroimpact as vi
    >>> system = vi.System(mass_ratio=0.6, frequency_ratio=2, restitution=0.8, gap=0.5,
    ...                    drive_frequency=1.8, moment_amplitude=1)
    >>> motion = vi.simulate(system, initial=(0, 0.5, 0, 0), periods=600, keep=100).refine()
    >>> len(vi.plot.orbit(motion))
    3
    """
    points = count("points_per_period", points_per_period, least=2, most=1_000_000)
    if isinstance(motion, StructureOrbit):
        of_system(units=units)
        return structure_orbit(
            motion,
            coordinates=coordinates,
            points_per_period=points,
            legend=legend,
            axes=axes,
        )
    motion = expected("motion", motion, PeriodicMotion)
    of_structure(coordinates=coordinates)
    drawn = AxisUnits.of(units, motion.system)
    axes = several_axes(axes, 3, (7.1, 5.2), mosaic=[[0, 1], [2, 2]])
    curve = _in_units(_sample(motion, points), drawn)
    hits = drawn.table(motion.impacts)
    separating = hits["approach_velocity"] <= 0.0
    for body, ax in ((1, axes[0]), (2, axes[1])):
        x, v = curve.state[:, 2 * body - 2], curve.state[:, 2 * body - 1]
        draw_path(ax, curve.spans, curve.time, x, v, named=False)
        ax.plot(
            x, v, color=BODY_COLORS[body], lw=0.2 + 0.6 * body, label=rf"$x_{body},\ \dot x_{body}$"
        )
        jumps = np.column_stack([hits[f"v{body}_pre"], hits[f"v{body}_post"]])
        _jumps(ax, hits[f"x{body}"], jumps)
        _overlap(ax, curve, x, v)
        at = (hits[f"x{body}"], hits[f"v{body}_pre"])
        draw_regimes(ax, hits["regime"], *at, named=False)
        _crosses(ax, at[0][separating], at[1][separating], named=False)
        ax.set_xlabel(drawn.label(f"x{body}"))
        ax.set_ylabel(drawn.label(f"v{body}"))
    _history(axes[2], motion, curve, hits, drawn)
    if legend:
        axes[2].legend(
            loc="lower left",
            bbox_to_anchor=(0.0, 1.0 if motion.admissible else 1.09),
            ncols=4,
            borderaxespad=0.2,
            columnspacing=1.2,
        )
    return axes


def _history(
    ax: Axes, motion: PeriodicMotion, curve: _Orbit, hits: NDArray[np.void], drawn: AxisUnits
) -> None:
    separating = hits["approach_velocity"] <= 0.0
    tip = tip_symbol(motion.system)
    body, face = "x_2", rf"{tip}-\delta"
    if drawn.is_si:
        body, face = "X", rf"l\,{tip}-\Delta"
    draw_bands(ax, curve.spans)
    ax.plot(curve.time, curve.state[:, 2], color=BODY_COLORS[2], lw=1.8, label=f"${body}$")
    ax.plot(curve.time, curve.face, color=BODY_COLORS[1], lw=0.7, label=f"${face}$")
    overlap = curve.overlap
    if overlap.any():
        ax.fill_between(
            curve.time,
            curve.state[:, 2],
            curve.face,
            where=overlap.tolist(),
            facecolor=VERMILLION,
            edgecolor=VERMILLION,
            hatch="////",
            alpha=0.5,
            label="the bodies overlap",
            zorder=2,
        )
    draw_regimes(ax, hits["regime"], hits["time"], hits["x2"])
    _crosses(ax, hits["time"][separating], hits["x2"][separating], named=True)
    ax.set_xlim(0.0, motion.m * motion.system.drive_period * drawn.factor("time"))
    ax.set_xlabel(drawn.label("time"))
    ax.set_ylabel(drawn.label("x2", rf"positions ${body},\ {face}$"))
    if not motion.admissible:
        ax.set_title(f"no motion: {motion.why_not}", loc="left", pad=3)


def _jumps(ax: Axes, x: Array, jumps: Array) -> None:
    """Draw vertical lines between the velocities before and after each impact."""
    gaps = np.full(len(x), np.nan)
    ax.plot(
        np.column_stack([x, x, gaps]).ravel(),
        np.column_stack([jumps, gaps]).ravel(),
        color=GREY,
        lw=0.8,
        ls=(0, (1, 1)),
        label="impact",
        zorder=1.5,
    )


def _overlap(ax: Axes, curve: _Orbit, x: Array, v: Array) -> None:
    if curve.overlap.any():
        inside = np.where(curve.overlap, 0.0, np.nan)
        ax.plot(x + inside, v, color=VERMILLION, lw=2.4, label="the bodies overlap", zorder=2)


def _crosses(ax: Axes, x: Array, y: Array, *, named: bool) -> None:
    if len(x):
        ax.plot(
            x,
            y,
            linestyle="none",
            marker="x",
            markersize=7.0,
            markeredgewidth=1.2,
            color=BLACK,
            label="separating" if named else "_nolegend_",
            zorder=4,
        )


def _sample(motion: PeriodicMotion, points: int) -> _Orbit:
    """Sample one orbit from t = 0, both sides of every impact, ends of chatter and contact."""
    end = motion.m * motion.system.drive_period
    spans = _spans(motion, end)
    grids = [np.linspace(0.0, end, motion.m * points + 1)]
    grids += [np.linspace(span.start, span.end, _CHATTER_POINTS) for span in spans]
    hits = motion.impacts
    grid = np.unique(np.concatenate(grids))
    if len(hits):
        near = np.abs(grid[:, None] - hits["time"]).min(axis=1)
        grid = grid[near > 1e-9 * end]
    before = np.column_stack([hits["x1"], hits["v1_pre"], hits["x2"], hits["v2_pre"]])
    after = np.column_stack([hits["x1"], hits["v1_post"], hits["x2"], hits["v2_post"]])
    time = np.concatenate([grid, *[hits["time"]] * 3])
    state = np.concatenate(
        [motion.trajectory(grid), before, np.full((len(hits), 4), np.nan), after]
    )
    order = np.argsort(time, kind="stable")
    time, state = time[order], state[order]
    face = motion.system.tip(state[:, 0]) - motion.system.gap
    return _Orbit(time, state, face, spans, face - state[:, 2] > _OVERLAP)


def _in_units(curve: _Orbit, drawn: AxisUnits) -> _Orbit:
    """Return an orbit in the units of its picture."""
    seconds = drawn.factor("time")
    return curve._replace(
        time=seconds * curve.time,
        state=curve.state * [drawn.factor(name) for name in COORDINATES],
        face=drawn.factor("x2") * curve.face,
        spans=[
            span._replace(start=seconds * span.start, end=seconds * span.end)
            for span in curve.spans
        ],
    )


def _spans(motion: PeriodicMotion, end: float) -> list[ContactSpan]:
    """Return the stretches of chatter and sustained contact in one orbit from t = 0."""
    if motion.legs[0] == Leg.CIRCUIT:
        return []
    times = np.array(motion.clocks) * motion.system.drive_period + motion.nodes[:, 3]
    spans = []
    for leg, start in enumerate(times):
        mode = _MODES.get(motion.legs[leg].kind)
        if mode is None:
            continue
        length = (times[(leg + 1) % len(times)] - start) % end
        first = math.fmod(start, end)
        first = first + end if first < 0.0 else first
        spans.append(ContactSpan(first, min(first + length, end), mode))
        if first + length > end:
            spans.append(ContactSpan(0.0, first + length - end, mode))
    return spans

"""Unstable manifolds on the stroboscopic section, with the saddle and the attractors they lead to.

theory page, sections 6 and 7; `vibroimpact.unstable_manifold`.
"""

from __future__ import annotations

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes

from ..arguments import naming, positive, reject
from ..orbits import ManifoldSide, PeriodicMotion, UnstableManifold
from .axis_names import ONCE_A_PERIOD, STATE_NAMES, at_drive_phase
from .style import BLACK, BLUE, VERMILLION, legend_above, new_axes

_STATES = ("x1", "v1", "x2", "v2")
_COLORS = (BLUE, VERMILLION)


@naming
def manifold(
    result: UnstableManifold | ManifoldSide,
    *,
    x: str = "x1",
    y: str = "v1",
    size: float = 4.5,
    legend: bool = True,
    ax: Axes | None = None,
) -> Axes:
    r"""Draw both sides of an unstable manifold, each in its colour, open where it is broken.

    The saddle is a cross. The points of its attractors are dots for the first side and rings for
    the second; those outside the manifold's frame are not shown. Of a side alone only the curve is
    drawn: it knows neither the saddle nor the section.

    Parameters
    ----------
    result : UnstableManifold or ManifoldSide
        Result of `vibroimpact.unstable_manifold`, or one of its sides.
    x : {"x1", "v1", "x2", "v2"}
        Component on the horizontal axis.
    y : {"x1", "v1", "x2", "v2"}
        Component on the vertical axis.
    size : float
        Size of the marks in points.
    legend : bool
        Name sides, saddle and attractors above the axes.
    ax : matplotlib.axes.Axes, optional
        Where to draw; a new figure if None.

    Returns
    -------
    matplotlib.axes.Axes

    Raises
    ------
    ParameterError
        If an argument is of the wrong type or out of range.

    Examples
    --------
    >>> import vibroimpact as vi
    >>> system = vi.System(mass_ratio=0.6, frequency_ratio=2, restitution=0.8, gap=0.5,
    ...                    drive_frequency=1.8, moment_amplitude=1)
    >>> motion = vi.simulate(system, initial=(0, 0.5, 0, 0), periods=600, keep=100).refine()
    >>> saddle = motion.follow(drive_frequency=(1.5, 1.8)).at(drive_frequency=1.55)[0]
    >>> manifold = vi.unstable_manifold(saddle, length=0.5, settle=300)
    >>> vi.plot.manifold(manifold, x="x2", y="v2").get_xlabel()
    'position $x_2$ of body 2 once per drive period, at $\\psi = 0$'
    """
    if not isinstance(result, UnstableManifold | ManifoldSide):
        reject("result", result, "an UnstableManifold, or one of its sides")
    for name, component in (("x", x), ("y", y)):
        if component not in _STATES:
            reject(name, component, f"one of {', '.join(_STATES)}")
    size = positive("size", size)
    ax = new_axes(ax)
    first, second = _STATES.index(x), _STATES.index(y)
    handles: list[Artist] = []
    whole = result if isinstance(result, UnstableManifold) else None
    sides = (result,) if isinstance(result, ManifoldSide) else result.sides
    for side, color in zip(sides, _COLORS, strict=False):
        for i, piece in enumerate(side.pieces()):
            # A side begins at the saddle itself.
            points = piece if i or whole is None else np.vstack((whole.saddle, piece))
            (line,) = ax.plot(points[:, first], points[:, second], color=color, lw=0.8)
        ends = ", ".join(_name(found) for found in side.attractors) or "nothing"
        line.set_label(f"manifold to {ends}")
        handles.append(line)
    if whole is not None:
        marks = [_mark_saddle(ax, whole, (first, second), size)]
        # The frame is that of the manifold: far attractors do not widen it.
        ax.autoscale_view()
        handles = [*marks, *handles, *_mark_attractors(ax, whole, (first, second), size)]
    if legend:
        legend_above(ax, handles)
    ax.set_xlabel(_label(x, whole))
    ax.set_ylabel(_label(y, whole))
    return ax


def _mark_saddle(ax: Axes, result: UnstableManifold, shown: tuple[int, int], size: float) -> Artist:
    (cross,) = ax.plot(
        *result.saddle[[*shown]],
        "X",
        color=BLACK,
        ms=1.3 * size,
        mew=0.0,
        zorder=4,
        label=f"unstable {result.motion.label} (saddle)",
    )
    return cross


def _mark_attractors(
    ax: Axes, result: UnstableManifold, shown: tuple[int, int], size: float
) -> list[Artist]:
    """Draw dots for the attractors of the first side, rings for those of the second."""
    handles: list[Artist] = []
    for number, (side, color) in enumerate(zip(result.sides, _COLORS, strict=False)):
        for attractor in side.attractors:
            if not isinstance(attractor, PeriodicMotion):
                continue
            period = attractor.system.drive_period
            times = result.section_phase / attractor.system.drive_frequency
            states = attractor.trajectory(times + np.arange(attractor.m) * period)
            ring = {"mfc": "none", "ms": 1.8 * size} if number else {"ms": size}
            (marks,) = ax.plot(
                states[:, shown[0]],
                states[:, shown[1]],
                "o",
                color=color,
                scalex=False,
                scaley=False,
                zorder=3,
                label=f"stable {attractor.label}",
                **ring,
            )
            handles.append(marks)
    return handles


def _label(component: str, result: UnstableManifold | None) -> str:
    """Return the name of an axis; a side alone does not know the phase of its section."""
    if result is None:
        return f"{STATE_NAMES[component]} once per drive period"
    phase = result.motion.system.phase + result.section_phase
    return at_drive_phase(ONCE_A_PERIOD[component], phase)


def _name(attractor: PeriodicMotion | str) -> str:
    return f"stable {attractor.label}" if isinstance(attractor, PeriodicMotion) else attractor

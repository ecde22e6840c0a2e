"""Floquet multipliers in the complex plane: inside the unit circle a motion is stable.

The multipliers are the eigenvalues of the derivative of the return map; theory page, section 7.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Circle
from numpy.typing import NDArray

from ..arguments import naming, number, positive, reject, several
from ..orbits import Bifurcation, Branch, PeriodicMotion
from ..structure_motion import StructureOrbit
from .parameter_units import piece_label
from .style import (
    BLACK,
    BLUE,
    GREEN,
    GREY,
    ORANGE,
    PURPLE,
    VERMILLION,
    bifurcation_handles,
    bifurcation_marker,
    legend_above,
    new_axes,
)

Motion = PeriodicMotion | StructureOrbit

_SHAPES = tuple(zip("osD^vP", (BLACK, VERMILLION, BLUE, ORANGE, GREEN, PURPLE), strict=True))
CROSSINGS = ("saddle_node", "period_doubling", "neimark_sacker", "branch_point")
"""Kinds of bifurcations at which multipliers cross the unit circle."""


@naming
def multipliers(
    motions: Motion | Sequence[Motion] | Branch,
    *,
    limit: float = 1.6,
    size: float = 4.5,
    legend: bool = True,
    ax: Axes | None = None,
) -> Axes:
    """Draw Floquet multipliers and the unit circle.

    Along a branch they are coloured by the parameter, and marked where they cross the circle. The
    number of multipliers outside the frame is given below it: near a grazing one multiplier grows
    without bound.

    Parameters
    ----------
    motions : PeriodicMotion, StructureOrbit, sequence of them, or Branch
        One motion, several, or a branch.
    limit : float
        Real and imaginary parts are shown up to this size; at least 1.
    size : float
        Size of the marks in points.
    legend : bool
        Name motions or crossings above the axes.
    ax : matplotlib.axes.Axes, optional
        Where to draw; a new figure if None.

    Returns
    -------
    matplotlib.axes.Axes

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
    >>> vi.plot.multipliers(motion).get_aspect()
    1.0
    """
    branch = motions if isinstance(motions, Branch) else None
    many: list[Any] = []
    if branch is None:
        many = several("motions", motions, PeriodicMotion, StructureOrbit)
    allowed = "a finite number >= 1"
    limit = number("limit", limit, allowed)
    if limit < 1.0:
        reject("limit", limit, allowed)
    size = positive("size", size)

    ax = new_axes(ax)
    for at in (ax.axhline, ax.axvline):
        at(0.0, color=GREY, lw=0.4, zorder=0)
    ax.add_patch(Circle((0.0, 0.0), 1.0, fill=False, ec=BLACK, lw=0.8, zorder=1))
    if branch is not None:
        drawn = _along(ax, branch, limit, size, legend)
    else:
        drawn = np.concatenate([motion.multipliers for motion in many])
        for place, motion in enumerate(many):
            marker, color = _SHAPES[place % len(_SHAPES)]
            ax.plot(
                motion.multipliers.real,
                motion.multipliers.imag,
                linestyle="none",
                marker=marker,
                markersize=size,
                markerfacecolor=color,
                markeredgecolor="white",
                markeredgewidth=0.3,
                label=motion.label,
                zorder=3,
            )
        if legend:
            legend_above(ax, ax.get_legend_handles_labels()[0], columns=3)
    ax.set_xlim(-limit, limit)
    ax.set_ylim(-limit, limit)
    ax.set_aspect("equal")
    ax.set_xlabel(r"real part of the multipliers, Re $\lambda$")
    ax.set_ylabel(r"imaginary part, Im $\lambda$")
    outside = ~(np.maximum(np.abs(drawn.real), np.abs(drawn.imag)) <= limit)
    if outside.any():
        text = f"{np.count_nonzero(outside)} of {len(drawn)} multipliers outside the frame"
        ax.annotate(
            text, (0.5, 0.015), xycoords="axes fraction", ha="center", va="bottom", fontsize=8
        )
    return ax


def _along(
    ax: Axes, branch: Branch, limit: float, size: float, legend: bool
) -> NDArray[np.complex128]:
    """Draw the multipliers of a branch, and mark those on the circle; return all of them."""
    values = np.concatenate(
        [np.repeat(piece.values, piece.multipliers.shape[1]) for piece in branch.pieces]
    )
    drawn = np.concatenate([piece.multipliers.ravel() for piece in branch.pieces])
    points = ax.scatter(
        drawn.real,
        drawn.imag,
        c=values,
        s=(0.6 * size) ** 2,
        cmap="cividis",
        linewidths=0,
        zorder=2,
    )
    # Beside the frame, whose aspect is fixed, and of the same height.
    bar = ax.figure.colorbar(points, cax=ax.inset_axes((1.04, 0.0, 0.05, 1.0)))
    bar.ax.tick_params(direction="out", left=False)
    held = [piece.system for piece in branch.pieces]
    bar.set_label(piece_label(branch.parameter, held[0]) if held else branch.parameter)
    for kind in CROSSINGS:
        crossing = [_on_circle(found) for found in branch.of_kind(kind)]
        if crossing:
            at = np.concatenate(crossing)
            (marks,) = ax.plot(at.real, at.imag, **bifurcation_marker(kind, 1.2 * size), zorder=4)
            marks.set_gid(kind)
    if legend:
        kinds = [found.kind for found in branch.bifurcations if found.kind in CROSSINGS]
        legend_above(ax, bifurcation_handles(kinds))
    return drawn


def _on_circle(found: Bifurcation) -> NDArray[np.complex128]:
    """Return the multiplier that crosses at a bifurcation, or the pair."""
    values: NDArray[np.complex128] = found.motion.multipliers
    if found.kind == "neimark_sacker":
        pair = np.argsort(np.where(values.imag == 0.0, np.inf, np.abs(np.abs(values) - 1.0)))
        return values[pair[:2]]
    aim = -1.0 if found.kind == "period_doubling" else 1.0
    return values[[np.argmin(np.abs(values - aim))]]

"""The parts of the machine as they are drawn: pendulum, mass, springs, dampers, frame.

The pivot is the origin and the pendulum's length the unit. The tip is a small ball; what is
measured from it begins at that point of the ball which strikes. The parts that move are returned,
so that a picture that moves can take them away again.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.patches import Circle, Polygon, Rectangle

from .style import BLACK

Point = tuple[float, float]
Drawn = list[Artist]

BALL = 0.035
PIVOT = 0.03
"""Radii of the pendulum's tip and of its pivot."""

FRAME = "0.45"
BESIDE = "0.55"
GHOST = "0.80"
BODY = "0.91"


def arrow(ax: Axes, tail: Point, head: Point, color: str = BLACK, **style: Any) -> Drawn:
    """Draw an arrow; the style is that of a `FancyArrowPatch`."""
    look = {"arrowstyle": "-|>,head_length=0.5,head_width=0.2", "lw": 1.5, "color": color}
    look |= {"shrinkA": 0, "shrinkB": 0, "joinstyle": "miter", "capstyle": "butt"}
    return [ax.annotate("", head, tail, arrowprops=look | style, zorder=6)]


def thin(ax: Axes, start: Point, end: Point, **style: Any) -> None:
    """Draw a line to measure from."""
    x, y = zip(start, end, strict=True)
    look: dict[str, Any] = {"color": BESIDE, "lw": 0.6, "zorder": 0}
    ax.plot(x, y, **(look | style))


def fixed(ax: Axes, start: Point, end: Point) -> None:
    """Draw a line that does not move, hatched on its left as seen from `start`."""
    first, last = np.array(start), np.array(end)
    along = (last - first) / math.dist(start, end)
    outwards = 0.045 * (np.array([-along[1], along[0]]) - along)
    ax.plot(*zip(first, last, strict=True), color=FRAME, lw=1.1, solid_capstyle="butt")
    for step in np.arange(0.045, math.dist(start, end) + 1e-9, 0.045):
        foot = first + step * along
        ax.plot(*zip(foot, foot + outwards, strict=True), color=FRAME, lw=0.6)


def rod(ax: Axes, angle: float, color: str, order: int = 3, tip_color: str = "") -> Drawn:
    """Draw the pendulum at an angle."""
    tip = (math.sin(angle), -math.cos(angle))
    line = ax.plot(*zip((0, 0), tip, strict=True), color=color, lw=2.6, zorder=order)
    # Arrows that start at the tip come out from under it.
    ball = Circle(tip, BALL, fc=tip_color or color, lw=0, zorder=order + 4)
    return [*line, ax.add_patch(ball)]


def bearing(ax: Axes, top: float, left: float, right: float) -> None:
    """Draw the pivot and the frame that holds it."""
    ax.add_patch(Polygon([(-0.08, top), (0.08, top), (0, 0)], fc=GHOST, lw=0, zorder=0.5))
    fixed(ax, (left, top), (right, top))
    ax.add_patch(Circle((0, 0), PIVOT, fc="white", ec=BLACK, lw=1.0, zorder=5))


def torsion_spring(ax: Axes, top: float) -> None:
    """Draw a spiral from the pendulum's shaft to the frame."""
    outer = 0.17
    turn = np.linspace(-math.pi / 2, 6 * math.pi, 500)
    radius = np.interp(turn, (turn[0], turn[-1]), (0.03, outer))
    x, y = radius * np.cos(turn), radius * np.sin(turn)
    ax.plot([*x, outer], [*y, top], color=BLACK, lw=0.9, zorder=1)


def torsion_damper(ax: Axes, top: float) -> None:
    """Draw a damper bent around the pivot, from the pendulum to the frame."""
    radius, half = 0.37, 0.05

    def arc(start: float, end: float, r: float = radius) -> None:
        turn = np.radians(np.linspace(start, end, 40))
        ax.plot(r * np.cos(turn), r * np.sin(turn), color=BLACK, lw=1.0, zorder=1)

    def across(at: float, reach: float, width: float) -> None:
        turn, r = math.radians(at), np.array([radius - reach, radius + reach])
        ax.plot(r * math.cos(turn), r * math.sin(turn), color=BLACK, lw=width, zorder=1)

    # The cylinder lies between the angles 175 and 212 degrees, open towards the piston's rod.
    arc(270, 196)
    across(196, 0.7 * half, 1.8)
    for r in (radius - half, radius + half):
        arc(212, 175, r)
    across(175, half, 1.0)
    arc(175, 180 - math.degrees(math.asin(top / radius)))


def spring(ax: Axes, start: float, end: float, y: float) -> Drawn:
    """Draw a spring along a horizontal line."""
    lead, teeth = 0.1, 12
    x = np.r_[start, np.linspace(start + lead, end - lead, teeth + 1), end]
    side = np.r_[0, 0, np.resize([1, -1], teeth - 1), 0, 0]
    return [*ax.plot(x, y + 0.055 * side, color=BLACK, lw=1.0, solid_joinstyle="round")]


def damper(ax: Axes, start: float, end: float, y: float) -> Drawn:
    """Draw a damper along a horizontal line, all its lengths in proportion."""
    half, left, right = 0.05, start + 0.35 * (end - start), start + 0.65 * (end - start)
    piston = left + 0.55 * (right - left)
    wide: dict[str, Any] = {"color": BLACK, "lw": 1.0}
    return [
        *ax.plot((left, right, right, left), y + half * np.array([1, 1, -1, -1]), **wide),
        *ax.plot((right, end), (y, y), **wide),
        *ax.plot((start, piston), (y, y), **wide),
        *ax.plot((piston, piston), (y - 0.7 * half, y + 0.7 * half), color=BLACK, lw=1.8),
    ]


ROLLER = 0.02
"""Radius of the rollers between the mass and its guides."""


def block(ax: Axes, corner: Point, width: float, height: float) -> Drawn:
    """Draw the mass, from its lower left corner, with its rollers."""
    drawn: Drawn = [
        ax.add_patch(Rectangle(corner, width, height, fc=BODY, ec=BLACK, lw=1.1, zorder=1))
    ]
    left, right = corner[0] + 0.12 * width, corner[0] + 0.88 * width
    for y, side in ((corner[1] + height, 1), (corner[1], -1)):
        for x in (left + 0.06, right - 0.06):
            wheel = Circle((x, y + side * ROLLER), ROLLER, fc="white", ec=FRAME, lw=0.8)
            drawn.append(ax.add_patch(wheel))
    return drawn


def guides(ax: Axes, left: float, right: float, bottom: float, top: float) -> None:
    """Draw the guides between which a mass moves, from its bottom and top."""
    for y, side in ((top, 1), (bottom, -1)):
        rail = y + 2 * side * ROLLER
        ends = (left, rail), (right, rail)
        fixed(ax, *(ends if side > 0 else ends[::-1]))


def mass(ax: Axes, corner: Point, width: float, height: float) -> None:
    """Draw the mass at rest, from its lower left corner, between its guides."""
    block(ax, corner, width, height)
    left, right = corner[0] + 0.12 * width, corner[0] + 0.88 * width
    guides(ax, left, right, corner[1], corner[1] + height)

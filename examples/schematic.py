"""The machine: a sketch of the pendulum and of the mass it strikes, at rest and in an impact.

Run ``python examples/schematic.py [--out schematic.png]``; ``make schematic`` draws it into
docs/images. Symbols are those of docs/notation.md: physical quantities on the left, dimensionless
ones on the right. Lengths are to scale; so are, among themselves, the velocities and the impulses
of the impact, which `vi.impact` computes. The parts of the machine are those of `vibroimpact.plot`.

Both panels have the pivot for their origin and the pendulum's length for their unit. The tip is a
small ball, so what is measured from it begins at that point of the ball which strikes.
"""

import argparse
import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle

import vibroimpact as vi
from vibroimpact.plot.parts import (
    BALL,
    BESIDE,
    GHOST,
    Point,
    arrow,
    bearing,
    damper,
    fixed,
    mass,
    rod,
    spring,
    thin,
    torsion_damper,
    torsion_spring,
)
from vibroimpact.plot.style import BLACK, BLUE, GREEN, VERMILLION

SYSTEM = vi.System(
    mass_ratio=0.6,
    frequency_ratio=2.0,
    restitution=0.8,
    gap=0.5,
    drive_frequency=1.0,
    friction=0.5,
)
GAP = SYSTEM.gap
# The state just before the impact, but for x2, which contact gives: sin x1 - gap.
ANGLE, SPIN, SPEED = 0.8, 1.0, 0.4
# Lengths of the arrows of a velocity and of an impulse of 1.
VELOCITY, IMPULSE = 0.55, 0.8

DRIVE = r"\cos(\Omega T + \varphi)"

WIDTH, HEIGHT = 7.2, 3.0
DOTS_PER_INCH = 250


def label(ax: Axes, at: Point, text: str, color: str = BLACK, **where: Any) -> None:
    """Write a symbol; `where` moves it by points (`xytext`) and aligns it."""
    place = {"xytext": (0, 0), "ha": "center", "va": "center", "size": 10} | where
    ax.annotate(text, at, textcoords="offset points", color=color, zorder=7, **place)


def measure(ax: Axes, start: Point, end: Point, text: str, **where: Any) -> None:
    """Draw a double arrow with its name, below the middle unless told otherwise."""
    head = "<|-|>,head_length=0.32,head_width=0.12"
    arrow(ax, start, end, arrowstyle=head, lw=0.7, mutation_scale=9)
    middle = ((start[0] + end[0]) / 2, (start[1] + end[1]) / 2)
    label(ax, middle, text, **{"xytext": (0, -2.5), "va": "top"} | where)


def at_rest(ax: Axes) -> None:
    """Draw the whole machine at rest, with all its physical quantities."""
    top, face, width, bottom, height, wall = 0.24, BALL + GAP, 0.48, -1.13, 0.6, 1.72
    torsion_spring(ax, top)
    torsion_damper(ax, top)
    bearing(ax, top, -0.42, 0.3)
    rod(ax, 0.0, BLACK)
    label(ax, (-BALL, -1.0), "$M_1$", xytext=(-3, -3), ha="right", va="top")
    label(ax, (0.17, 0.13), "$K_1$", xytext=(3, 0), ha="left")
    label(ax, (-0.33, -0.27), "$C_1$", xytext=(-2, 0), ha="right", va="top")

    # How the angle counts, by a pendulum turned a little.
    turned = 0.36
    tip = (math.sin(turned), -math.cos(turned))
    thin(ax, (0, 0), tip, ls=(0, (5, 2)), lw=0.9)
    ax.add_patch(Circle(tip, BALL, fc="white", ec=BESIDE, lw=0.8, zorder=2))
    turn = np.linspace(0, turned, 30)
    x, y = 0.72 * np.sin(turn), -0.72 * np.cos(turn)
    ax.plot(x[:-3], y[:-3], color=BLACK, lw=0.9)
    arrow(ax, (x[-6], y[-6]), (x[-1], y[-1]), lw=0.9, mutation_scale=8)
    label(ax, (x[15], y[15]), r"$\theta$", xytext=(0, -4), va="top")

    measure(ax, (-0.58, 0), (-0.58, -1), "$l$", xytext=(-3, 0), ha="right", va="center")
    thin(ax, (-0.62, 0), (-0.47, 0))
    thin(ax, (-0.62, -1), (-BALL, -1))

    # Drawn in pieces, an arc has its head along the curve.
    turn = np.radians(np.linspace(-72, 8, 60))
    x, y = 0.31 * np.cos(turn), 0.31 * np.sin(turn)
    ax.plot(x[:-6], y[:-6], color=GREEN, lw=1.5)
    arrow(ax, (x[-9], y[-9]), (x[-1], y[-1]), GREEN)
    label(ax, (0.34, -0.1), f"$f_{{10}}\\,{DRIVE}$", GREEN, xytext=(3, 0), ha="left")

    mass(ax, (face, bottom), width, height)
    label(ax, (face + width / 2, bottom + height / 2), "$M_2$")
    right = face + width
    fixed(ax, (wall, bottom + height - 0.1), (wall, bottom - 0.02))
    spring(ax, right, wall, -0.8)
    damper(ax, right, wall, -1.04)
    label(ax, ((right + wall) / 2, -0.855), "$K_2$", xytext=(0, -2), va="top")
    label(ax, ((right + wall) / 2, -1.09), "$C_2$", xytext=(0, -3), va="top")
    arrow(ax, (right, -0.62), (right + 0.3, -0.62), GREEN)
    force = f"$f_{{20}}\\,{DRIVE}$"
    label(ax, (right, -0.585), force, GREEN, xytext=(4, 1), ha="left", va="bottom")
    label(ax, (face - 0.01, -0.62), r"$\mu,\ r$", xytext=(-2, 0), ha="right")

    below = -1.34
    thin(ax, (BALL, -1.0), (BALL, below - 0.04))
    thin(ax, (face, bottom), (face, below - 0.04))
    measure(ax, (BALL, below), (face, below), r"$\Delta$")
    arrow(ax, (face, below), (face + 0.28, below), lw=0.9, mutation_scale=8)
    label(ax, (face + 0.28, below), "$X$", xytext=(3, 0), ha="left")


def in_contact(ax: Axes) -> None:
    """Draw an impact: velocities just before it, and the impulses on the tip."""
    tip = (math.sin(ANGLE), -math.cos(ANGLE))
    at_rest, face, width, bottom, height = BALL + GAP, BALL + tip[0], 0.6, -1.02, 0.86
    hit = vi.impact(SYSTEM, x1=ANGLE, v1=SPIN, v2=SPEED)[()]
    assert hit["regime"] == vi.Regime.SLIP  # its friction impulse is mu P, as the figure says
    bearing(ax, 0.13, -0.16, 0.16)
    rod(ax, 0.0, GHOST, order=0)
    rod(ax, ANGLE, BLACK)
    turn = np.linspace(0, ANGLE, 60)
    x, y = 0.4 * np.sin(turn), -0.4 * np.cos(turn)
    ax.plot(x[:-4], y[:-4], color=BLACK, lw=0.9)
    arrow(ax, (x[-7], y[-7]), (x[-1], y[-1]), lw=0.9, mutation_scale=8)
    label(ax, (x[28], y[28]), "$x_1$", xytext=(1, -5), va="top")

    mass(ax, (face, bottom), width, height)
    label(ax, (face + 0.8 * width, bottom + 0.14), "$M_2$")

    along, across = SPIN * math.cos(ANGLE) * VELOCITY, SPIN * math.sin(ANGLE) * VELOCITY
    end = (tip[0] + along, tip[1] + across)
    for corner in ((end[0], tip[1]), (tip[0], end[1])):
        thin(ax, corner, end, color=BLUE, ls=(0, (3, 2)), lw=0.7, zorder=4)
        arrow(ax, tip, corner, BLUE, lw=1.0)
    arrow(ax, tip, end, BLUE, lw=1.8)
    label(ax, end, r"$\dot x_1$", BLUE, xytext=(2, 1), ha="left", va="bottom")
    label(ax, (end[0], tip[1]), r"$\dot x_1\, \cos x_1$", BLUE, xytext=(-2, -4), va="top")
    label(ax, (tip[0], end[1]), r"$\dot x_1\, \sin x_1$", BLUE, xytext=(-4, 1), ha="right")
    push = (face + width, bottom + 0.62 * height)
    arrow(ax, push, (push[0] + SPEED * VELOCITY, push[1]), BLUE, lw=1.8)
    label(ax, (push[0] + SPEED * VELOCITY, push[1]), r"$\dot x_2$", BLUE, xytext=(3, 0), ha="left")

    normal = (tip[0] - IMPULSE * hit["impulse_normal"], tip[1])
    friction = (tip[0], tip[1] + IMPULSE * hit["impulse_tangential"])
    arrow(ax, tip, normal, VERMILLION, lw=1.8)
    arrow(ax, tip, friction, VERMILLION, lw=1.8)
    label(ax, normal, "$P$", VERMILLION, xytext=(-3, 0), ha="right")
    label(ax, friction, r"$\mu P$", VERMILLION, xytext=(-4, 2), ha="right")

    first, second = -1.16, -1.3
    thin(ax, (BALL, -1.0), (BALL, second - 0.03))
    thin(ax, (at_rest, tip[1] - 0.08), (at_rest, first - 0.03), ls=(0, (4, 2)))
    thin(ax, (face, bottom), (face, second - 0.03))
    measure(ax, (BALL, first), (at_rest, first), r"$\delta$", xytext=(0, 2), va="bottom")
    measure(ax, (at_rest, first), (face, first), "$x_2$", xytext=(0, 2), va="bottom")
    measure(ax, (BALL, second), (face, second), r"$\sin x_1$")


def panel(page: Figure, left: float, inches: float, x: Point, top: float, title: str) -> Axes:
    """Return axes of a width in inches that show x and what is below `top`, true to scale."""
    margin = 0.26
    height = HEIGHT - margin
    ax = page.add_axes((left / WIDTH, 0, inches / WIDTH, height / HEIGHT))
    ax.set_axis_off()
    ax.set_xlim(x)
    ax.set_ylim(top - (x[1] - x[0]) * height / inches, top)
    page.text(left / WIDTH, 1 - 0.17 / HEIGHT, title, va="center")
    return ax


def draw() -> Figure:
    """Draw both panels."""
    page = Figure(figsize=(WIDTH, HEIGHT))
    title = "(a) at rest, seen from above"
    at_rest(panel(page, 0.05, 3.7, (-0.66, 1.8), 0.31, title))
    title = r"(b) an impact, lengths in units of $l$: $g = \sin x_1 - x_2 - \delta = 0$"
    in_contact(panel(page, 3.95, 3.2, (-0.2, 1.75), 0.2, title))
    return page


def main(arguments: Sequence[str] | None = None) -> None:
    """Draw the figure as the command line asks for."""
    parser = argparse.ArgumentParser(prog="schematic.py")
    default = Path("schematic.png")
    parser.add_argument(
        "--out", type=Path, default=default, help="file to write, .png, .pdf or .svg (%(default)s)"
    )
    given = parser.parse_args(arguments)
    with vi.plot.publication_style():
        draw().savefig(given.out, dpi=DOTS_PER_INCH)
    print(given.out)


if __name__ == "__main__":
    main()

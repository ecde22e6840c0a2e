"""Small sketches of the words that newcomers meet (docs/words.md), drawn by hand, not computed.

Run ``python examples/words.py [--out FOLDER]`` (``make words``); each word is one PNG.
"""

import argparse
from collections.abc import Callable
from pathlib import Path

import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle, Rectangle

from vibroimpact import Regime
from vibroimpact.plot import REGIME_STYLES, publication_style
from vibroimpact.plot.style import BLACK, BLUE, GREY, ORANGE, SKY_BLUE, VERMILLION

FOLDER = Path(__file__).parents[1] / "docs" / "images" / "words"
SIZE = (1.9, 1.1)  # inches
SKETCHES: dict[str, Callable[[Axes], None]] = {}
LINE = {"color": BLACK, "lw": 1.2}


def sketch(draw: Callable[[Axes], None]) -> Callable[[Axes], None]:
    """Enter a sketch under its name."""
    SKETCHES[draw.__name__] = draw
    return draw


def wall(ax: Axes, left: float = 0.0, right: float = 1.0) -> None:
    """Draw the line at which the bodies touch."""
    ax.plot([left, right], [0, 0], color=GREY, lw=0.8)


def hops(heights: list[float]) -> tuple[np.ndarray, np.ndarray]:
    """Return parabolas below 0, one after another, as broad as a fall from their depth is long."""
    x, y, start = [], [], 0.0
    for depth in heights:
        s = np.linspace(0, 1, 40)
        x.append(start + s * np.sqrt(depth))
        y.append(-4 * depth * s * (1 - s))
        start += np.sqrt(depth)
    x = np.concatenate(x)
    return x / x[-1], np.concatenate(y)


def arrow(ax: Axes, start: tuple, end: tuple, color: str = BLUE) -> None:
    """Draw an arrow."""
    ax.annotate("", end, start, arrowprops={"arrowstyle": "->", "color": color, "lw": 1.3})


@sketch
def gap(ax: Axes) -> None:
    """The signed distance of two bodies."""
    ax.add_patch(Circle((0.2, 0), 0.12, color=BLACK))
    ax.add_patch(Rectangle((0.75, -0.3), 0.3, 0.6, fc="0.85", ec=BLACK))
    ax.annotate("", (0.75, 0), (0.32, 0), arrowprops={"arrowstyle": "<->", "lw": 1.0})
    ax.text(0.53, 0.08, "$-g$", ha="center")
    ax.set_xlim(0, 1.1)
    ax.set_ylim(-0.35, 0.35)
    ax.set_aspect("equal")


@sketch
def flight(ax: Axes) -> None:
    """A motion between two contacts."""
    wall(ax)
    x, y = hops([1.0, 1.0, 1.0])
    ax.plot(x, y, color=GREY, lw=0.8)
    middle = (x > 1 / 3) & (x < 2 / 3)
    ax.plot(x[middle], y[middle], color=BLUE, lw=2)


@sketch
def impact(ax: Axes) -> None:
    """The velocity jumps, the position does not."""
    wall(ax)
    ax.plot([0, 0.5, 1], [-1, 0, -0.55], **LINE)
    arrow(ax, (0.12, -0.6), (0.36, -0.1))
    arrow(ax, (0.64, -0.02), (0.88, -0.28), ORANGE)
    ax.text(0.1, -0.25, "$u$", color=BLUE)
    ax.text(0.8, 0.0, "$-ru$", color=ORANGE)
    ax.set_ylim(-1, 0.3)


@sketch
def regime(ax: Axes) -> None:
    """The contact point slips, reverses, or sticks."""
    slip, reversal, stick = (
        REGIME_STYLES[each].color
        for each in (Regime.SLIP, Regime.REVERSAL_APPROACH, Regime.STICK_APPROACH)
    )
    p = np.linspace(0, 1, 50)
    ax.plot(p, 0.9 - 0.5 * p, color=slip)
    ax.plot(p, 0.5 - 1.1 * p, color=reversal)
    ax.plot(p, np.maximum(0.25 - 0.8 * p, 0), color=stick)
    wall(ax)
    for y, text, color in ((0.45, "slip", slip), (-0.6, "reversal", reversal)):
        ax.text(1.03, y, text, color=color, va="center")
    ax.text(1.03, 0.05, "stick", color=stick, va="center")
    ax.set_xlim(0, 1.5)


@sketch
def graze(ax: Axes) -> None:
    """The bodies only just touch."""
    wall(ax)
    x = np.linspace(0, 1, 60)
    ax.plot(x, -4 * (x - 0.5) ** 2, **LINE)
    ax.plot(0.5, 0, "o", ms=4, color=VERMILLION)


@sketch
def chatter(ax: Axes) -> None:
    """Infinitely many impacts in a finite time."""
    x, y = hops([0.55**k for k in range(14)])
    wall(ax, 0, 1.3)
    ax.plot(x, y, **LINE)
    ax.axvline(1.0, color=SKY_BLUE, lw=1, ls=":")
    ax.text(1.02, -0.55, r"$t_\infty$", color=BLUE)


@sketch
def sustained_contact(ax: Axes) -> None:
    """The bodies stay together under a force."""
    wall(ax, 0, 1.6)
    x, y = hops([0.5**k for k in range(10)])
    ax.plot(0.7 * x, y, **LINE)
    ax.plot([0.7, 1.2], [0, 0], color=BLUE, lw=3)
    s = np.linspace(0, 0.4, 30)
    ax.plot(1.2 + s, -6 * s**2, **LINE)
    ax.text(0.95, -0.25, "$p>0$", color=BLUE, ha="center")


@sketch
def stroboscopic_section(ax: Axes) -> None:
    """One look in each drive period."""
    t = np.linspace(0, 4, 200)
    ax.plot(t, np.sin(2 * np.pi * t + 0.7) + 0.3 * np.sin(np.pi * t), color=GREY, lw=0.9)
    k = np.arange(5)
    ax.plot(k, np.sin(0.7) + 0 * k, "o", ms=4, color=BLUE)
    for each in k:
        ax.axvline(each, color=SKY_BLUE, lw=0.6)


@sketch
def impact_section(ax: Axes) -> None:
    """One look at each impact."""
    wall(ax)
    x, y = hops([1.0, 0.4, 0.8, 0.5])
    ax.plot(x, y, color=GREY, lw=0.9)
    ends = np.cumsum(np.sqrt([1.0, 0.4, 0.8, 0.5]))
    ax.plot(ends / ends[-1], 0 * ends, "o", ms=4, color=BLUE)
    ax.set_ylim(-1.1, 0.2)


@sketch
def m_n(ax: Axes) -> None:
    """Two drive periods, three impacts."""
    x, y = hops([1.0, 0.3, 0.55] * 2)
    wall(ax)
    ax.plot(x, y, **LINE)
    for k in range(5):
        ax.axvline(k / 4, color=SKY_BLUE, lw=0.8, zorder=0)
    ax.annotate("", (0.5, 0.25), (0, 0.25), arrowprops={"arrowstyle": "<->", "color": BLUE})
    ax.text(0.125, 0.35, "2-3", ha="center", color=BLUE)
    ax.set_ylim(-1.05, 0.7)


@sketch
def attractor(ax: Axes) -> None:
    """Motions that start elsewhere approach it."""
    t = np.linspace(0, 18, 400)
    for phase, color in ((0, GREY), (np.pi, SKY_BLUE)):
        r = 0.6 + (0.9 if phase else -0.5) * np.exp(-0.25 * t)
        ax.plot(1.6 * r * np.cos(t + phase), r * np.sin(t + phase), color=color, lw=0.7)
    ax.plot(0.96 * np.cos(t), 0.6 * np.sin(t), color=BLUE, lw=1.8)


@sketch
def basin(ax: Axes) -> None:
    """Starts of one colour lead to one motion."""
    x = np.linspace(0, 1, 60)
    border = 0.5 + 0.2 * np.sin(7 * x)
    ax.fill_between(x, 0, border, color=SKY_BLUE)
    ax.fill_between(x, border, 1, color="#f5d28c")
    ax.plot(0.3, 0.25, "o", ms=5, color=BLUE)
    ax.plot(0.75, 0.8, "s", ms=5, color=ORANGE)


@sketch
def saddle_node(ax: Axes) -> None:
    """A stable and an unstable motion (dashed) meet and vanish."""
    y = np.linspace(-1, 1, 60)
    x = 1 - y**2
    ax.plot(x[y >= 0], y[y >= 0], color=BLUE, lw=1.5)
    ax.plot(x[y <= 0], y[y <= 0], color=BLUE, lw=1.2, ls="--")
    ax.plot(1, 0, "o", ms=4, color=BLACK)
    ax.set_xlim(0, 1.4)


@sketch
def period_doubling(ax: Axes) -> None:
    """The motion repeats after twice the time."""
    ax.plot([0, 0.45], [0, 0], color=BLUE, lw=1.5)
    ax.plot([0.45, 1], [0, 0], color=BLUE, lw=1.2, ls="--")
    x = np.linspace(0, 0.55, 40)
    for sign in (1, -1):
        ax.plot(0.45 + x, sign * np.sqrt(x), color=ORANGE, lw=1.5)
    ax.plot(0.45, 0, "o", ms=4, color=BLACK)


@sketch
def multipliers(ax: Axes) -> None:
    """Inside the unit circle: stable."""
    ax.add_patch(Circle((0, 0), 1, fill=False, ec=BLACK))
    ax.plot([0.3, 0.3, -0.6], [0.4, -0.4, 0], "o", ms=4, color=BLUE)
    ax.plot(1.5, 0, "o", ms=4, color=VERMILLION)
    ax.text(1.65, 0.1, "unstable", color=VERMILLION, fontsize=7)
    ax.set_xlim(-2.2, 3)
    ax.set_ylim(-1.2, 1.2)
    ax.set_aspect("equal")


@sketch
def saltation(ax: Axes) -> None:
    """Two neighbours strike at different instants."""
    wall(ax)
    ax.plot([0, 0.45, 0.95], [-0.9, 0, -0.5], color=BLUE, lw=1.3)
    ax.plot([0, 0.6, 1.0], [-1.1, 0, -0.35], color=ORANGE, lw=1.3)
    ax.annotate("", (0.6, 0.12), (0.45, 0.12), arrowprops={"arrowstyle": "<->"})
    ax.text(0.52, 0.2, r"$\delta t$", ha="center")
    ax.set_ylim(-1.1, 0.5)


@sketch
def admissible(ax: Axes) -> None:
    """A solution that passes through the other body is no motion."""
    wall(ax)
    x = np.linspace(0, 1, 80)
    y = -np.sin(np.pi * x) * (1 - 2.4 * np.exp(-(((x - 0.5) / 0.16) ** 2)))
    ax.plot(x, y, **LINE)
    ax.fill_between(x, 0, y, where=y > 0, color=VERMILLION, alpha=0.5)
    ax.text(0.5, 0.55, "?", color=VERMILLION, ha="center", va="center", fontsize=11)


@sketch
def manifold(ax: Axes) -> None:
    """The motions that leave a saddle."""
    s = np.linspace(-1, 1, 60)
    ax.plot(s, 0.5 * s**3, color=VERMILLION, lw=1.5)
    ax.plot(-0.4 * s, s, color=GREY, lw=0.9)
    for x in (0.6, -0.6):
        arrow(ax, (x * 0.8, 0.5 * (x * 0.8) ** 3), (x * 1.3, 0.5 * (x * 1.3) ** 3), VERMILLION)
    ax.plot(0, 0, "x", ms=6, color=BLACK)


@sketch
def chaos(ax: Axes) -> None:
    """Two neighbours separate exponentially."""
    t = np.linspace(0, 5, 200)
    a = np.sin(3 * t) + 0.5 * np.sin(5.1 * t)
    ax.plot(t, a, color=BLUE, lw=1)
    grown = 0.01 * np.exp(np.minimum(1.05 * t, 4.6))
    ax.plot(t, a + grown * np.cos(2.3 * t), color=ORANGE, lw=1)


@sketch
def quasi_periodic(ax: Axes) -> None:
    """A closed curve that is never passed twice in the same points."""
    k = np.arange(60) * 2.399
    ax.plot(1.6 * np.cos(k), np.sin(k) + 0.25 * np.cos(2 * k), "o", ms=1.8, color=BLUE)


def figure(name: str) -> Figure:
    """Return one sketch."""
    with publication_style(), rc_context({"font.size": 11}):
        made = Figure(figsize=SIZE, layout="constrained")
        ax = made.subplots()
        SKETCHES[name](ax)
        ax.axis("off")
    return made


def main(arguments: list[str] | None = None) -> None:
    """Write all sketches into a folder."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, default=FOLDER, metavar="FOLDER")
    folder = parser.parse_args(arguments).out
    folder.mkdir(parents=True, exist_ok=True)
    for name in SKETCHES:
        figure(name).savefig(folder / f"{name}.png", dpi=200, metadata={"Software": None})
    print(folder)


if __name__ == "__main__":
    main()

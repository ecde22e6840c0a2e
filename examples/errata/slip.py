"""E2, E3: when slip goes on, reverses or sticks, as printed, corrected, and in small steps.

The dots are the incremental-impulse method (the paper's reference [30]): thousands of small steps
that judge the direction of slip each time and know neither regimes nor closed forms.
"""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

import vibroimpact as vi
from vibroimpact.plot.axis_names import AT_IMPACT
from vibroimpact.plot.style import BLACK, SKY_BLUE, VERMILLION

SYSTEM = vi.System(
    mass_ratio=0.6,
    frequency_ratio=2.0,
    restitution=0.8,
    gap=0.5,
    drive_frequency=1.0,
    friction=0.8,
)
STEPS = 3000


def after(system: vi.System, x1: np.ndarray, ratio: np.ndarray, steps: int | None = None):
    """Return x1' after impacts with u = 1 and x1' = ratio before."""
    x1, ratio = np.broadcast_arrays(x1, ratio)
    v2 = ratio * np.cos(x1) - 1.0
    return vi.impact(system, x1=x1, v1=ratio, v2=v2, steps=steps)["v1_post"]


def compare(ax: Axes, axis: np.ndarray, x1: np.ndarray, ratio: np.ndarray) -> None:
    """Draw x1' after the impact by both laws and by the method of small steps."""
    printed = after(SYSTEM.replace(law="paper"), x1, ratio)
    ax.plot(axis, printed, color=VERMILLION, lw=1.2, ls=(0, (4, 1.5)), label="as printed")
    ax.plot(axis, after(SYSTEM, x1, ratio), color=BLACK, lw=1.2, label="corrected")
    few = slice(None, None, max(1, len(axis) // 24))
    stepped = after(SYSTEM, *(part[few] for part in np.broadcast_arrays(x1, ratio)), STEPS)
    ax.plot(axis[few], stepped, "o", ms=3.6, mfc="none", mec=SKY_BLUE, label="in small steps")
    ax.axhline(0.0, color="0.55", lw=0.5, zorder=0)
    ax.set_ylabel(r"velocity $\dot x_1/u$ after the impact")


def draw(quick: bool) -> Figure:
    """Draw the angular velocity after an impact over that before, and over the angle."""
    figure = Figure(figsize=(6.0, 2.9), layout="constrained")
    left, right = figure.subplots(1, 2)
    points = 49 if quick else 481
    ratio = np.linspace(-1.5, 2.5, points)
    compare(left, ratio, np.array(0.6), ratio)
    left.set_xlabel(r"velocity $\dot x_1/u$ before the impact")
    left.set_title(r"(E2) at $x_1 = 0.6$", pad=4)
    left.legend(loc="upper left")
    x1 = np.linspace(0.02, 1.5, points)
    compare(right, x1, x1, np.array(0.4))
    edge = float(np.arctan(1.0 / SYSTEM.friction))
    right.axvline(edge, color="0.55", lw=0.7, ls=(0, (1, 1)))
    right.annotate(
        r"$\mu\,\tan x_1 = 1$",
        (edge, 0.05),
        xycoords=("data", "axes fraction"),
        xytext=(-3, 0),
        textcoords="offset points",
        ha="right",
    )
    right.set_xlabel(AT_IMPACT["x1"])
    right.set_title(r"(E3) with $\dot x_1/u = 0.4$ before", pad=4)
    return figure

"""Panels that tell a chaotic motion from a periodic one of which the impact section looks alike.

How a perturbation of either grows, and the map from one impact of the chaotic motion to the one
that comes to the same narrow band of the section (docs/theory.md, E10).
"""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from numpy.typing import NDArray

from vibroimpact import System

from .evidence import amplification
from .layout import BLACK, GREY, VERMILLION

RETURN = 154
"""Impacts of the chaotic motion of Fig. 9(4') from a band back to it; the orbit of the other motion
has as many drive periods."""
SETTLING = 20_000
"""Drive periods after which it is on its attractor."""
_ORBITS = 70


def draw_growth(
    ax: Axes, system: System, starts: Sequence[tuple[Sequence[float], str]], orbits: int = _ORBITS
) -> None:
    """Draw the growth of a perturbation from each start, the first black, the second coloured."""
    for (start, text), color in zip(starts, (BLACK, VERMILLION), strict=True):
        values = amplification(system, initial=start, periods=RETURN * orbits)
        # Over an orbit it swings by two orders of magnitude.
        middle = np.median(values.reshape(-1, RETURN), axis=1)
        ax.plot(RETURN * np.arange(1, len(middle) + 1), middle, color=color, lw=1.1)
        ax.annotate(
            text,
            (RETURN * len(middle), middle[-1]),
            xytext=(-4, -10 if color == VERMILLION else 10),
            textcoords="offset points",
            ha="right",
            va="top" if color == VERMILLION else "bottom",
            color=color,
        )
    ax.set_yscale("log")
    ax.set_xlabel("drive periods")
    ax.set_ylabel("distance / distance at first")


def draw_returns(ax: Axes, velocity: NDArray[np.float64]) -> None:
    """Draw the velocity before an impact against that `RETURN` impacts before, in a wide band."""
    bands = velocity[: len(velocity) // RETURN * RETURN].reshape(-1, RETURN)
    band = bands[:, np.ptp(bands, axis=0).argmax()]
    ends = (band.min(), band.max())
    ax.plot(ends, ends, color=GREY, lw=0.8, ls=(0, (4, 2)))
    ax.scatter(band[:-1], band[1:], s=2.0, color=VERMILLION, lw=0, rasterized=True)
    ax.set_xlabel(r"velocity $\dot x_1$ before an impact")
    ax.set_ylabel(f"the same {RETURN} impacts later")

"""E5: how fast a simulation approaches the motions of Fig. 5, and what the paper's matrix says.

Each run starts 1e-6 beside the motion; the lines are the powers of the largest Floquet multiplier
and of the largest eigenvalue of (42).
"""

import numpy as np
from matplotlib.figure import Figure

import vibroimpact as vi
from han_jin_hu_2004 import MOTIONS, criterion
from vibroimpact.plot.style import BLACK, SKY_BLUE, VERMILLION

SHOWN = ("5a", "5b", "5c")
BESIDE = 1e-6
HIGHEST = 1e-3


def draw(quick: bool) -> Figure:
    """Draw the distance from the motion over its orbits, with both predictions."""
    figure = Figure(figsize=(6.0, 2.9), layout="constrained")
    orbits = 60 if quick else 400
    for ax, name in zip(figure.subplots(1, 3, sharey=True), SHOWN, strict=True):
        shown = next(motion for motion in MOTIONS if motion.id == name)
        n = int(shown.paper_says[0])
        motion = next(motion for motion in vi.periodic_motions(shown.system, n) if motion.stable)
        x1, v1, x2, v2 = motion.initial
        start = (x1, v1 + BESIDE, x2, v2)
        run = vi.simulate(shown.system, initial=start, periods=n * orbits)
        away = np.abs(run.stroboscopic[n - 1 :: n] - motion.initial).max(axis=1)
        number = np.arange(1, orbits + 1)
        ax.plot(number, away, ".", ms=2.0, color=SKY_BLUE, label="simulated")
        true = float(abs(motion.multipliers[0]))
        ax.plot(number, BESIDE * true**number, color=BLACK, lw=0.9, label=f"multiplier {true:.3f}")
        _, printed = criterion.verdict(motion)
        said = number[number * np.log(printed) < np.log(HIGHEST / BESIDE)]
        ax.plot(
            said,
            BESIDE * printed**said,
            color=VERMILLION,
            lw=1.2,
            ls=(0, (4, 1.5)),
            label=f"by (42): {printed:.2f}",
        )
        ax.set_yscale("log")
        ax.set_ylim(1e-16, 10 * HIGHEST)
        ax.set_xlabel(f"orbits of {n} drive period{'s' if n > 1 else ''}")
        ax.set_title(rf"Fig. 5({name[1]}), $\omega = {shown.system.drive_frequency:g}$", pad=4)
        ax.legend(loc="lower left", fontsize=7)
    figure.axes[0].set_ylabel("distance from the motion")
    return figure

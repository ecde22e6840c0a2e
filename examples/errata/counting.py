"""E11: the impacts of Fig. 10 do not stop after a finite number.

Beyond some 2,000 drive periods the counts depend on the last bits of double precision (two runs
that start 1e-15 apart are drawn), but not that there are ever more.
"""

import numpy as np
from matplotlib.figure import Figure

import vibroimpact as vi
from han_jin_hu_2004 import INITIAL, MOTIONS
from vibroimpact.plot.style import BLACK, SKY_BLUE

SYSTEM = next(motion.system for motion in MOTIONS if motion.id == "10")
BESIDE = 1e-15
# Time at which Fig. 10(a) ends.
SHOWN = 400


def draw(quick: bool) -> Figure:
    """Draw the number of impacts over drive periods."""
    figure = Figure(figsize=(6.0, 2.8), layout="constrained")
    ax = figure.subplots()
    x1, v1, x2, v2 = INITIAL
    starts = ((x1, v1, x2, v2), (x1, v1 + BESIDE, x2, v2))
    periods = 1000 if quick else 20_000
    for start, color, width in zip(starts, (BLACK, SKY_BLUE), (1.6, 0.9), strict=True):
        run = vi.simulate(SYSTEM, initial=start, periods=periods)
        hits = run.impacts["period"] + 1
        ax.step(
            np.append(hits, periods),
            np.append(np.arange(1, len(hits) + 1), len(hits)),
            where="post",
            color=color,
            lw=width,
            label=rf"$\dot x_1(0) = 0.5{' + 10^{-15}' if start != starts[0] else ''}$",
        )
    shown = SHOWN / SYSTEM.drive_period
    ax.axvline(shown, color="0.55", lw=0.7, ls=(0, (1, 1)))
    ax.annotate(
        "the paper's figure ends",
        (shown, 0.05),
        xycoords=("data", "axes fraction"),
        xytext=(3, 0),
        textcoords="offset points",
    )
    ax.set_xscale("log")
    ax.set_yscale("log")
    ax.set_xlabel("drive periods")
    ax.set_ylabel("impacts so far")
    ax.legend(loc="upper left")
    return figure

"""E10: at the parameters of Fig. 9(4) a stable 154-77 motion and a chaotic one coexist.

Impact sections of both, the growth of a perturbation of each, and the map from one impact of the
chaotic motion to the 154th after it, in one of the 154 narrow bands that its impacts fill: two
branches, both steeper than the diagonal.
"""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

import vibroimpact as vi
from han_jin_hu_2004 import INITIAL, MOTIONS
from han_jin_hu_2004.evidence import coexisting_chaos
from han_jin_hu_2004.told_apart import SETTLING, draw_growth, draw_returns
from vibroimpact.plot.axis_names import AT_IMPACT
from vibroimpact.plot.style import BLACK, GREY, VERMILLION

SYSTEM = next(motion.system for motion in MOTIONS if motion.id == "9(4)")
# A part of both sections, enlarged: x1, x1'.
WINDOW = ((0.055, 0.130), (1.490, 1.600))


def draw(quick: bool) -> Figure:
    """Draw both sections, the growth from both starts, and the return map."""
    chaos = coexisting_chaos(SYSTEM, periods=400 if quick else SETTLING).run
    if chaos is None:
        raise RuntimeError("no random start leads to chaos")
    figure = Figure(figsize=(6.4, 5.4), layout="constrained")
    ((ordered, chaotic), (growth, returns)) = figure.subplots(2, 2)
    cases = (
        (ordered, INITIAL, BLACK, "(a) from the paper's start: 154-77", "paper's start"),
        (chaotic, chaos.initial, VERMILLION, "(b) from another start: chaotic", "other start"),
    )
    for ax, start, color, title, _ in cases:
        keep = 2_000 if quick else 200_000
        run = vi.simulate(SYSTEM, initial=start, periods=SETTLING + keep, keep=keep)
        impacts = run.impacts
        section(ax, impacts, color, title)
    starts = [(start, short) for _, start, _, _, short in cases]
    draw_growth(growth, SYSTEM, starts, orbits=10 if quick else 70)
    growth.set_title("(c) growth of a perturbation", loc="left")
    draw_returns(returns, impacts["v1_pre"])
    returns.set_title("(d) return map in a band of (b)", loc="left")
    return figure


def section(ax: Axes, impacts: NDArray[np.void], color: str, title: str) -> None:
    """Draw the impacts of a run, and a part of them enlarged."""
    inset = ax.inset_axes((0.20, 0.32, 0.40, 0.40))
    for axes, size in ((ax, 1.6), (inset, 2.0)):
        axes.scatter(impacts["x1"], impacts["v1_pre"], s=size, color=color, lw=0, rasterized=True)
    inset.set_xlim(*WINDOW[0])
    inset.set_ylim(*WINDOW[1])
    inset.tick_params(labelsize=6, length=2)
    ax.indicate_inset_zoom(inset, edgecolor=GREY)
    ax.set_xlabel(AT_IMPACT["x1"])
    ax.set_ylabel(AT_IMPACT["v1"])
    ax.set_title(title, loc="left")

"""E10: two orbits that start 1e-9 apart, at the parameters of Fig. 9(2) and of Fig. 9(4).

The paper calls both motions chaotic. Under the corrected law the orbits of the first drift apart
exponentially, those of the second do not.
"""

import numpy as np
from matplotlib.figure import Figure

from vibroimpact.paper import MOTIONS
from vibroimpact.paper.evidence import PERTURBATION, amplification
from vibroimpact.plot.style import BLACK, SKY_BLUE

SHOWN = (("9(2)", SKY_BLUE, "o"), ("9(4)", BLACK, "s"))


def draw(quick: bool) -> Figure:
    """Draw the growth of a perturbation over drive periods."""
    figure = Figure(figsize=(6.0, 2.8), layout="constrained")
    ax = figure.subplots()
    for name, color, marker in SHOWN:
        motion = next(motion for motion in MOTIONS if motion.id == name)
        values = amplification(motion.system, periods=100 if quick else 600)
        ax.plot(
            np.arange(1, len(values) + 1),
            values,
            color=color,
            lw=0.9,
            marker=marker,
            ms=4.0,
            markevery=50,
            label=rf"Fig. {name}, $\omega = {motion.system.drive_frequency:g}$",
        )
    ax.set_yscale("log")
    ax.set_xlabel("drive periods")
    exponent = round(np.log10(PERTURBATION))
    ax.set_ylabel(rf"distance / $10^{{{exponent}}}$")
    ax.legend(loc="center right")
    return figure

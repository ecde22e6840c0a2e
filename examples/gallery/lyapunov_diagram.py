"""Chaos measured: the largest Lyapunov exponent under the bifurcation diagram of Fig. 8(a).

Run ``python examples/gallery/lyapunov_diagram.py [--quick] [--out lyapunov_diagram.png]``.
"""

import numpy as np
from matplotlib.figure import Figure

import vibroimpact as vi
from picture import START, SYSTEM, main, new_figure


def draw(quick: bool) -> Figure:
    """Draw both over one axis of frequencies."""
    diagram = vi.bifurcation_diagram(
        SYSTEM.replace(friction=0.5),
        initial=START,
        exponents=True,
        drive_frequency=np.linspace(0.2, 4.0, 40 if quick else 1600),
        progress=not quick,
    )
    figure = new_figure(5.0)
    above, below = figure.subplots(2, 1, sharex=True, height_ratios=(3, 2))
    vi.plot.bifurcation(diagram, color="regime", ax=above)
    above.set_xlabel("")
    vi.plot.lyapunov(diagram, ax=below)
    below.set_ylim(-0.1, 0.12)
    return figure


if __name__ == "__main__":
    main(draw, __file__)

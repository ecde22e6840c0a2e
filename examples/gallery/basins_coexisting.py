"""Two motions at once: the basins of the 4-5 and the 6-7 motion of Fig. 9(3) (docs/coexistence.md).

Run ``python examples/gallery/basins_coexisting.py [--quick] [--out basins_coexisting.png]``.
"""

import numpy as np
from matplotlib.figure import Figure
from matplotlib.patheffects import withStroke

import vibroimpact as vi
from picture import COEXISTING, START, main, new_figure


def draw(quick: bool) -> Figure:
    """Draw which start leads to which motion, the oscillator at rest at first."""
    # At full size about a cell for every dot.
    columns, rows, scouts = (20, 20, 16) if quick else (1600, 1280, 1000)
    basins = vi.basins(
        COEXISTING,
        x1=np.linspace(-1.2, 0.6, columns),
        v1=np.linspace(-2.5, 2.5, rows),
        scouts=scouts,
        periods=1000 if quick else 2000,
        progress=not quick,
    )
    figure = new_figure(5.1)
    ax = vi.plot.basins(basins, ax=figure.subplots())
    ax.plot(*START[:2], "X", color="black", markeredgecolor="white", markersize=7)
    ax.annotate(
        "the paper's start",
        START[:2],
        xytext=(8, -15),
        textcoords="offset points",
        path_effects=[withStroke(linewidth=2.5, foreground="white")],
    )
    return figure


if __name__ == "__main__":
    main(draw, __file__)

"""Hysteresis: an attractor followed up and down over the drive frequency.

Run ``python examples/gallery/hysteresis.py [--quick] [--out hysteresis.png]``.
"""

import numpy as np
from matplotlib.figure import Figure

import vibroimpact as vi
from picture import START, SYSTEM, main, new_figure


def draw(quick: bool) -> Figure:
    """Draw both branches once per drive period, where motions without impact show, too."""
    diagram = vi.bifurcation_diagram(
        SYSTEM.replace(damping=(0.1, 0.1), force_amplitude=0.5),
        initial=START,
        start=["forward", "backward"],
        periods=300,
        keep=20,
        labels=False,
        drive_frequency=np.linspace(2.2, 2.7, 40 if quick else 600),
    )
    figure = new_figure(3.6)
    vi.plot.bifurcation(diagram, section="stroboscopic", size=2.0, ax=figure.subplots())
    return figure


if __name__ == "__main__":
    main(draw, __file__)

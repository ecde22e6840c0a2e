"""Chatter and sustained contact: the low frequencies of Fig. 7(c), and the time spent in contact.

Run ``python examples/gallery/contact_fraction.py [--quick] [--out contact_fraction.png]``.
"""

import numpy as np
from matplotlib.figure import Figure

import vibroimpact as vi
from picture import START, SYSTEM, main, new_figure


def draw(quick: bool) -> Figure:
    """Draw the angle at impact, and below it the part of the time in contact."""
    diagram = vi.bifurcation_diagram(
        SYSTEM.replace(damping=(0.1, 0.1), force_amplitude=1.5),
        initial=START,
        periods=300,
        keep=20,
        drive_frequency=np.linspace(0.2, 0.7, 30 if quick else 700),
    )
    figure = new_figure(4.6)
    above, below = figure.subplots(2, 1, sharex=True, height_ratios=(2, 1))
    vi.plot.bifurcation(diagram, size=0.6, ax=above)
    above.set_xlabel("")
    vi.plot.contact_fraction(diagram, ax=below)
    return figure


if __name__ == "__main__":
    main(draw, __file__)

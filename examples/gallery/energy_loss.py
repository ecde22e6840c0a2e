"""What an impact takes: energy loss and drive phase of each impact over the drive frequency.

Run ``python examples/gallery/energy_loss.py [--quick] [--out energy_loss.png]``.
"""

import numpy as np
from matplotlib.figure import Figure

import vibroimpact as vi
from picture import START, SYSTEM, main, new_figure


def draw(quick: bool) -> Figure:
    """Draw two observables of the impact section, by impact regime."""
    diagram = vi.bifurcation_diagram(
        SYSTEM.replace(friction=0.5),
        initial=START,
        labels=False,
        drive_frequency=np.linspace(1.2, 2.4, 40 if quick else 1200),
    )
    figure = new_figure(5.0)
    above, below = figure.subplots(2, 1, sharex=True)
    vi.plot.bifurcation(diagram, value="energy_loss", color="regime", size=0.6, ax=above)
    above.set_xlabel("")
    vi.plot.bifurcation(diagram, value="phase", color="regime", size=0.6, legend=False, ax=below)
    return figure


if __name__ == "__main__":
    main(draw, __file__)

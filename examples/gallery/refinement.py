"""Where to look closer: a diagram that halves its own steps wherever the label changes.

Run ``python examples/gallery/refinement.py [--quick] [--out refinement.png]``.
"""

import numpy as np
from matplotlib.figure import Figure

import vibroimpact as vi
from picture import START, SYSTEM, main, new_figure


def draw(quick: bool) -> Figure:
    """Draw the diagram by label, and below it the steps between its frequencies."""
    diagram = vi.bifurcation_diagram(
        SYSTEM.replace(friction=0.5),
        initial=START,
        drive_frequency=np.linspace(1.56, 1.6, 9 if quick else 201),
        refine=2 if quick else 6,
        progress=not quick,
    )
    figure = new_figure(5.0)
    above, below = figure.subplots(2, 1, sharex=True, height_ratios=(3, 1))
    vi.plot.bifurcation(diagram, color="label", size=0.8, ax=above)
    omega = diagram.values
    below.step(omega[:-1], np.diff(omega), where="post", color="black", lw=0.7)
    below.set_yscale("log")
    below.set_xlabel(above.get_xlabel())
    above.set_xlabel("")
    below.set_ylabel(r"step $\Delta\omega$")
    return figure


if __name__ == "__main__":
    main(draw, __file__)

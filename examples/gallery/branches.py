"""What a diagram does not show: unstable motions and bifurcations, laid over the stable ones.

Run ``python examples/gallery/branches.py [--quick] [--out branches.png]``.
"""

import numpy as np
from matplotlib.figure import Figure

import vibroimpact as vi
from picture import START, SYSTEM, main, new_figure


def draw(quick: bool) -> Figure:
    """Draw the 1-1 motion, its doubled one, and the diagram in grey."""
    system = SYSTEM.replace(friction=0.5, drive_frequency=1.586)
    omega = (1.574, 1.588)
    motion = vi.simulate(system, initial=START, periods=600, keep=100).refine()
    single = vi.follow_motion(motion, drive_frequency=omega)
    (doubling,) = single.of_kind("period_doubling")
    doubled = vi.switch_branch(doubling, drive_frequency=omega)
    diagram = vi.bifurcation_diagram(
        system,
        initial=START,
        periods=600 if quick else 3000,
        keep=60,
        labels=False,
        drive_frequency=np.linspace(*omega, 30 if quick else 700),
    )
    figure = new_figure(4.0)
    vi.plot.branches([single, doubled], diagram=diagram, ax=figure.subplots())
    return figure


if __name__ == "__main__":
    main(draw, __file__)

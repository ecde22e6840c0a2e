"""A strange attractor: the impact section of the chaotic motion of Fig. 9(2), by impact regime.

Run ``python examples/gallery/impact_section.py [--quick] [--out impact_section.png]``.
"""

from matplotlib.figure import Figure

import vibroimpact as vi
from picture import START, SYSTEM, main, new_figure


def draw(quick: bool) -> Figure:
    """Draw angle and angular velocity just before each impact."""
    periods = 600 if quick else 20_000
    run = vi.simulate(
        SYSTEM.replace(drive_frequency=1.545, friction=0.5),
        initial=START,
        periods=periods,
        keep=periods - 100,
    )
    figure = new_figure(4.2)
    vi.plot.impact_section(run, color="regime", size=1.5, legend=False, ax=figure.subplots())
    handles = vi.plot.regime_handles(run.impacts["regime"].tolist(), shapes=False)
    figure.legend(handles=handles, loc="outside upper center", ncols=3)
    return figure


if __name__ == "__main__":
    main(draw, __file__)

"""How chaotic where: the chart of chart_periods.py by its largest Lyapunov exponent.

Run ``python examples/gallery/chart_exponents.py [--quick] [--out chart_exponents.png]``.
"""

from matplotlib.figure import Figure

import vibroimpact as vi
from chart_periods import chart
from picture import main, new_figure


def draw(quick: bool) -> Figure:
    """Draw the exponents, white where they are zero."""
    figure = new_figure(3.8)
    vi.plot.chart(chart(quick), color="exponent", limit=0.15, ax=figure.subplots())
    return figure


if __name__ == "__main__":
    main(draw, __file__)

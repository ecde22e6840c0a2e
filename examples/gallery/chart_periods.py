"""Which motion where: a chart over drive frequency and moment amplitude, and its islands' borders.

Run ``python examples/gallery/chart_periods.py [--quick] [--out chart_periods.png]``.

The chart is one simulation per cell, all from one start; the borders are curves of bifurcations,
computed without it (docs/islands.md). Where they do not agree, motions coexist.
"""

import numpy as np
from matplotlib.figure import Figure

import vibroimpact as vi
from picture import START, SYSTEM, main, new_figure

# A frequency and an amplitude inside each island.
ISLANDS = ((1.25, 1.0), (2.2, 1.0), (2.75, 1.0), (2.56, 1.0), (1.1, 1.0), (0.73, 2.3))
AMPLITUDES = (0.05, 2.5)


def chart(quick: bool) -> vi.Chart:
    """Label and largest exponent over the plane, at frequencies that are no ratios of integers.

    At those the free motion, whose own frequencies are 1 and 2, is periodic, else quasi-periodic.
    """
    columns, rows, periods = (16, 9, 200) if quick else (240, 150, 600)
    frequencies = np.linspace(0.2, 3.0, columns) + 1e-3 * (np.sqrt(5.0) - 1.0)
    return vi.chart(
        SYSTEM,
        initial=START,
        periods=periods,
        keep=100,
        drive_frequency=frequencies,
        moment_amplitude=np.linspace(*AMPLITUDES, rows),
        progress=not quick,
    )


def islands(quick: bool) -> list[vi.StabilityRegion]:
    """Walk round the island of each periodic motion."""
    regions = []
    for omega, amplitude in ISLANDS[:1] if quick else ISLANDS:
        system = SYSTEM.replace(drive_frequency=omega, moment_amplitude=amplitude)
        motion = vi.simulate(system, initial=START, periods=3000, keep=100).refine()
        frequencies = (1.01, 3.0) if omega > 1.0 else (0.2, 0.99)
        plane = {"drive_frequency": frequencies, "moment_amplitude": AMPLITUDES}
        regions.append(vi.stability_region(motion, max_points=60 if quick else 150, **plane))
    return regions


def draw(quick: bool) -> Figure:
    """Draw the borders over the chart."""
    figure = new_figure(5.3)
    ax = vi.plot.chart(chart(quick), ax=figure.subplots())
    regions = islands(quick)
    vi.plot.bifurcation_curves(regions, size=3.5, halo=True, legend=False, ax=ax)
    figure.legend(
        handles=vi.plot.curve_handles(regions),
        title="Borders of the islands",
        loc="outside lower center",
        ncols=3,
    )
    return figure


if __name__ == "__main__":
    main(draw, __file__)

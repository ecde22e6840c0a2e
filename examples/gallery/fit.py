"""A machine from a record: the fit, its residuals, and a diagram with what the record leaves open.

Run ``python examples/gallery/fit.py [--quick] [--out fit.png]``.
"""

import numpy as np
from matplotlib.figure import Figure

import vibroimpact as vi
from picture import START, SYSTEM, main, new_figure

FREQUENCIES = (1.3, 1.86)
# So poor a record that the band is wide enough to be seen.
HEARD, NOISE, MACHINES = 8, 0.05, 30


def draw(quick: bool) -> Figure:
    """Draw a record of x1 with its fit, and machines that eight times of impacts leave possible."""
    system = SYSTEM.replace(drive_frequency=1.8, friction=0.2)
    run = vi.simulate(system, initial=START, periods=8 if quick else 20)
    record = vi.measure(run, "x1", sampling=0.1, noise=0.02, seed=1)
    guess = system.replace(restitution=0.6, friction=0.4, gap=0.4)
    found = vi.fit(record, guess, unknown=["restitution", "friction", "gap"], initial=START)

    times = vi.measure(run, "impact_times", noise=NOISE, seed=2).times[: 5 if quick else HEARD]
    heard = vi.Record("impact_times", times, sigma=NOISE)
    rough = vi.fit(heard, found.machine, unknown=["restitution", "gap"], initial=START)

    figure = new_figure(6.2)
    above, middle, below = figure.subplots(3, 1, height_ratios=(2, 1, 2))
    vi.plot.fit(found, axes=(above, middle))
    middle.sharex(above)
    above.tick_params(labelbottom=False)
    frequencies = np.linspace(*FREQUENCIES, 7 if quick else 141)
    possible = rough.sample(2 if quick else MACHINES)
    for machines, size, color, label in (
        (possible, 4.0, "0.8", f"machines that the times of {len(times)} impacts leave possible"),
        ([found.machine], 2.0, "#0072B2", "machine fitted to $x_1$"),
    ):
        diagrams = [
            vi.bifurcation_diagram(
                machine, drive_frequency=frequencies, initial=START, periods=200, keep=20
            )
            for machine in machines
        ]
        below.plot(
            np.concatenate([diagram.impact_parameter for diagram in diagrams]),
            np.concatenate([diagram.approach_velocity for diagram in diagrams]),
            ".",
            markersize=size,
            markeredgewidth=0,
            color=color,
            label=label,
        )
    below.set_xlabel(r"drive frequency $\omega$")
    below.set_ylabel("approach velocity $u$")
    below.legend(loc="lower left", bbox_to_anchor=(0, 1), ncols=2, markerscale=3, frameon=False)
    return figure


if __name__ == "__main__":
    main(draw, __file__)

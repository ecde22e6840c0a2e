"""E4: two solutions that the paper quotes as motions, in which the bodies are separating.

The gap along one orbit of each, and of an admissible 1-1 motion of the same system for comparison.
At a motion's impact the gap comes up to zero from below; here it arrives from above.
"""

import numpy as np
from matplotlib.figure import Figure

import vibroimpact as vi
from vibroimpact.plot.style import BLACK, GREY, VERMILLION

SYSTEM = vi.System(
    mass_ratio=0.6,
    frequency_ratio=2.0,
    restitution=0.8,
    gap=0.5,
    drive_frequency=0.65,
    moment_amplitude=0.95,
)
# (drive periods, angle at the impact) as quoted in section 4.1, and the paper's verdict on them.
QUOTED = ((1, 0.5369, "stable"), (2, 0.3300, "unstable"))


def nearest(n: int, x10: float) -> vi.PeriodicMotion:
    """Return the solution of period n-1 whose angle at the impact is closest to x10."""
    found = vi.periodic_motions(SYSTEM, n, within=(x10 - 0.05, x10 + 0.05))
    return min(found, key=lambda motion: abs(motion.state[0] - x10))


def gap(motion: vi.PeriodicMotion, points: int) -> tuple[np.ndarray, np.ndarray]:
    """Return times from just after the impact to just before the next, and the gap there."""
    (hit,) = motion.impacts["time"]
    end = motion.m * SYSTEM.drive_period
    since = np.linspace(1e-6, end - 1e-6, points)
    x1, _, x2, _ = motion.trajectory((hit + since) % end).T
    return since, np.sin(x1) - x2 - SYSTEM.gap


def draw(quick: bool) -> Figure:
    """Draw the gap between impact and impact, for both solutions."""
    figure = Figure(figsize=(6.0, 2.8), layout="constrained")
    for ax, (n, x10, verdict) in zip(figure.subplots(1, 2), QUOTED, strict=True):
        motion = nearest(n, x10)
        time, values = gap(motion, 200 if quick else 2000)
        ax.axhline(0.0, color=GREY, lw=0.6)
        ax.fill_between(
            time,
            values,
            where=(values > 0.0).tolist(),
            facecolor=VERMILLION,
            edgecolor=VERMILLION,
            hatch="////",
            alpha=0.5,
            label="the bodies overlap",
        )
        ax.plot(time, values, color=BLACK, lw=1.0)
        ax.set_xlim(0.0, time[-1])
        # Room for the legend above the curve.
        ax.set_ylim(top=0.2)
        ax.set_xlabel("time since the impact")
        ax.set_ylabel(r"gap function $\sin x_1 - x_2 - \delta$")
        ax.set_title(
            f"{n}-1, $x_{{10}} = {motion.state[0]:.4f}$, $u = {motion.approach_velocity:.3f}$\n"
            f'"{verdict}" in the paper',
            pad=4,
        )
        ax.legend(loc="upper center")
    return figure

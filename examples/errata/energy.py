"""E1, E2: the impact law as printed gives energy to the bodies.

Above, the part of the kinetic energy that one impact takes, over the angle of incidence and the
ratio of angular and approach velocity, by the law as printed and by the corrected one. Below, the
kinetic energy after each impact of the run of Fig. 9(4): as printed, its 65th impact leaves the
bodies approaching, so that there is another one at once, and another.
"""

import math

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import TwoSlopeNorm
from matplotlib.figure import Figure

import vibroimpact as vi
from han_jin_hu_2004 import INITIAL, MOTIONS
from vibroimpact.plot.axis_names import AT_IMPACT
from vibroimpact.plot.style import ANGLE_TICKS, BLACK, VERMILLION

SYSTEM = next(motion.system for motion in MOTIONS if motion.id == "9(4)")
PRINTED = SYSTEM.replace(law="paper")
NO_OUTCOME = "0.85"
# Impacts at the instant at which the printed run ends.
REPEATED = 50


def reversal(x1: float, v1: float, v2: float) -> tuple[float, float]:
    """Return the velocities after an impact by (14) and (15), which slip with P* < 0 gets."""
    mbar, r, c = SYSTEM.mass_ratio, SYSTEM.restitution, math.cos(x1)
    friction = SYSTEM.friction * math.sin(x1)
    with_slip = c + math.copysign(friction, v1)
    against = c - math.copysign(friction, v1)
    a = friction**2 * c - c**3 - mbar * with_slip
    first = -against / a * (mbar * v1 - r * v1 * c * against + (1.0 + r) * v2 * with_slip)
    second = (
        -v2 * c * (c * c - friction**2)
        - (1.0 + r) * mbar * v1 * c * against
        + r * mbar * v2 * with_slip
    )
    return first, second / a


def kinetic(v1: np.ndarray, v2: np.ndarray) -> np.ndarray:
    """Return the kinetic energy of both bodies."""
    return 0.5 * v1**2 + 0.5 * v2**2 / SYSTEM.mass_ratio


def draw_map(ax: Axes, system: vi.System, cells: int):
    """Draw the part of the energy that each impact takes; return the colours."""
    angles = np.pi / 2 * (2 * np.arange(cells) + 1 - cells) / cells
    ratios = 4.0 * (2 * np.arange(cells) + 1 - cells) / cells
    taken = vi.impact_regimes(system, x1=angles, velocity_ratio=ratios).energy_loss
    ax.set_facecolor(NO_OUTCOME)
    mesh = ax.pcolormesh(
        angles, ratios, taken, cmap="PuOr", norm=TwoSlopeNorm(0.0, -1.0, 1.0), rasterized=True
    )
    ax.set_xticks(list(ANGLE_TICKS), list(ANGLE_TICKS.values()))
    ax.set_xlabel(AT_IMPACT["x1"])
    name = "corrected" if system is SYSTEM else "as printed"
    ax.set_title(f"{name}: {(taken < 0.0).mean():.0%} of the impacts give energy", pad=4)
    return mesh


def draw_run(ax: Axes) -> None:
    """Draw the kinetic energy after each impact of the run of Fig. 9(4) under both laws."""
    run = vi.simulate(PRINTED, initial=INITIAL, periods=120)
    energy = kinetic(run.impacts["v1_post"], run.impacts["v2_post"]).tolist()
    x1, v1, _, v2 = run.final_state.state
    for _ in range(REPEATED if run.stop_reason == "law_failed" else 0):
        v1, v2 = reversal(x1, v1, v2)
        energy.append(kinetic(v1, v2))
    number = np.arange(1, len(energy) + 1)
    ax.plot(number, energy, color=VERMILLION, lw=1.2, label="as printed")
    corrected = vi.simulate(SYSTEM, initial=INITIAL, periods=300).impacts[: len(energy)]
    after = kinetic(corrected["v1_post"], corrected["v2_post"])
    ax.plot(number, after, color=BLACK, lw=1.0, label="corrected")
    ax.axvline(run.impact_count + 0.5, color="0.55", lw=0.7, ls=(0, (1, 1)))
    ax.annotate(
        f"all at one instant,\nafter {run.final_state.period} drive periods",
        (run.impact_count + 0.5, 0.95),
        xycoords=("data", "axes fraction"),
        xytext=(4, 0),
        textcoords="offset points",
        va="top",
    )
    ax.set_yscale("log")
    ax.set_xlabel("impact")
    ax.set_ylabel("energy after it, $E_{+}$")
    ax.legend(loc="upper left")


def draw(quick: bool) -> Figure:
    """Draw the energy that single impacts take, and that of a run."""
    figure = Figure(figsize=(6.0, 5.2), layout="constrained")
    panels = figure.subplot_mosaic([["left", "right"], ["run", "run"]], height_ratios=(3, 2))
    maps = [panels["left"], panels["right"]]
    cells = 50 if quick else 160
    for ax, system in zip(maps, (PRINTED, SYSTEM), strict=True):
        mesh = draw_map(ax, system, cells)
    for text, x1, ratio in (("E1", -0.6, 2.5), ("E2", 0.4, -1.3)):
        maps[0].annotate(text, (x1, ratio), ha="center", va="center", fontsize=11)
    maps[0].set_ylabel(r"velocity ratio $\dot x_1/u$")
    bar = figure.colorbar(mesh, ax=maps, extend="both", aspect=22)
    bar.set_label(r"$(E-E_{+})/E$, negative: gain")
    draw_run(panels["run"])
    return figure

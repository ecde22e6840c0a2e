"""Chatter up to r = 0.999 and beyond: the instant at which infinitely many impacts have happened.

A ball that starts at rest at the height h over a wall, under a constant load 1 towards it, comes to
rest at sqrt(2 h) (1 + r)/(1 - r). That time changes by 2/(1 - r) times a change of the speed of the
first impact, which is the growth A in the bound 100 eps A max(1, time) of docs/accuracy.md. Driven
chatter is compared with the high-precision reference. All quantities are dimensionless.
"""

import math
from dataclasses import asdict
from typing import Any

import numpy as np
from flint import arb, ctx
from matplotlib.axes import Axes

import vibroimpact as vi
from exact import ALLOWED, Case, Outcome, judge
from ranges import MARKS, moderate
from vibroimpact.plot.style import BLUE, GREY, VERMILLION

Row = dict[str, Any]
HEIGHTS = (0.1, 0.5, 1.0, math.pi)


def bouncing_ball(count: int, largest: float = 0.999, seed: int = 7) -> list[Row]:
    """Rows (restitution, units, impacts) of `count` balls with 1 - r from 0.9 to 1 - `largest`."""
    rng = np.random.default_rng(seed)
    ends = [1 - largest, 0.5, 0.9]
    losses = ends + np.exp(rng.uniform(math.log(1 - largest), math.log(0.9), count)).tolist()
    return [_ball(1.0 - loss, float(rng.choice(HEIGHTS))) for loss in losses]


def _ball(restitution: float, height: float) -> Row:
    system = vi.System(
        mass_ratio=0.0,
        frequency_ratio=0.0,
        restitution=restitution,
        gap=0.0,
        drive_frequency=0.0,
        moment_amplitude=1.0,
        contact="direct",
    )
    with ctx.workprec(300):
        r = arb(restitution)
        end = (2 * arb(height)).sqrt() * (1 + r) / (1 - r)
        run = vi.simulate(system, initial=(-height, 0, 0, 0), time=1.5 * float(end))
        rows = run.contacts
        found = len(rows) > 0 and run.stop_reason == "rest"
        error = abs(float(arb(float(rows["time"][0])) - end)) if found else math.inf
    growth = 2 / (1 - restitution)
    return {
        "restitution": restitution,
        "impacts": run.impact_count,
        "error": error,
        "relative": error / float(end),
        "units": error / (ALLOWED * growth * max(1.0, float(end))),
    }


def driven_chatter(count: int, seed: int = 8) -> list[Row]:
    """Rows of driven motions with complete chatter, r from 0.05 to 0.9, against the reference."""
    rng = np.random.default_rng(seed)
    rows: list[Row] = []
    while len(rows) < count:
        case = moderate(rng, restitution=rng.uniform(0.05, 0.9), drive_frequency=0.25)
        run = vi.simulate(case.system, initial=case.initial, time=case.time, max_events=2000)
        ends = run.contacts["time"][run.contacts["kind"] == vi.EventKind.CHATTER]
        # To soon after the first chatter: the reference needs seconds for a long run.
        if len(ends) == 0 or run.impact_count > 200:
            continue
        verdict = judge(Case(case.system, case.initial, float(ends[0]) + 0.3))
        rows.append({"restitution": case.system.restitution} | asdict(verdict))
    return rows


def plot_driven(rows: list[Row], ax: Axes) -> None:
    """The error after the end of a driven chatter, in units of the bound."""
    for outcome in Outcome:
        own = [row for row in rows if row["outcome"] == outcome]
        if own:
            marker, color = MARKS[outcome]
            units = np.nan_to_num([row["units"] for row in own], nan=1e-3)
            r = [row["restitution"] for row in own]
            ax.semilogy(r, np.maximum(units, 1e-3), marker, ms=3.5, color=color, label=outcome)
    ax.axhline(1, color="black", lw=0.7)
    ax.set(xlabel="$r$", ylabel="error / allowed error after the chatter")
    ax.legend()


def plot_chatter(rows: list[Row], ax: Axes) -> None:
    """Relative error of the time of the accumulation, and that of rounding 1 + r."""
    loss = np.array([1 - row["restitution"] for row in rows])
    error = np.array([row["relative"] for row in rows])
    ax.loglog(loss, np.maximum(error, 1e-17), "o", ms=3, color=BLUE, label="ball on a wall")
    line = np.geomspace(loss.min(), loss.max())
    ax.loglog(line, 2.0**-53 / line, "--", color=VERMILLION, label=r"$2^{-53}/(1-r)$")
    bound = ALLOWED * 2 / line
    ax.loglog(line, bound, ":", color=GREY, label="allowed")
    ax.set(xlabel=r"$1-r$", ylabel="relative error of the end of the chatter")
    ax.legend()

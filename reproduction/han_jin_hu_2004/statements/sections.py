"""Fig. 1 and the opening of section 4: contact, Poincaré sections, and what they show."""

import math
from functools import cache

import numpy as np
from numpy.typing import NDArray

from vibroimpact import Run, simulate

from ..claims import Verdict
from ..parameters import INITIAL, KEEP, PERIODS, paper_system
from .diagrams import MOTION
from .samples import states_before
from .statement import Finding, formula, stated

# Points of a settled orbit differ by less, those of different places by more.
SETTLED = 1e-6
CHAOS = "9(2)"
MODEL = "theory.md#1-model"
PUBLISHED = "theory.md#8-errata-of-the-paper"


def different(points: NDArray[np.float64]) -> int:
    """Count points that are further apart than a settled orbit leaves them."""
    kept: list[NDArray[np.float64]] = []
    for point in points:
        if all(np.abs(point - other).max() > SETTLED for other in kept):
            kept.append(point)
    return len(kept)


@cache
def settled_runs() -> tuple[Run, ...]:
    """The named motions that are periodic, long after their transients."""
    runs = [
        simulate(motion.system, initial=INITIAL, periods=20 * PERIODS, keep=KEEP)
        for motion in MOTION.values()
    ]
    return tuple(run for run in runs if run.period.m is not None and 2 * run.period.m <= KEEP)


@cache
def chaotic_run() -> Run:
    """The motion of Fig. 9(2)."""
    return simulate(MOTION[CHAOS].system, initial=INITIAL, periods=PERIODS, keep=KEEP)


@stated(
    "fig1",
    "Fig. 1 and section 2",
    "pendulum and mass lie in a horizontal plane, and the tip meets the left face of the mass",
    page=MODEL,
)
def sketch() -> Finding:
    """Put impacts of a free machine into the geometry and into the energy of the two springs."""
    system = paper_system(moment_amplitude=0.0).replace(gap=0.05)
    run = simulate(system, initial=(-0.3, 1.5, 0.4, -0.5), periods=20)
    hits = run.impacts
    contact = float(np.abs(system.gap_function(states_before(hits))).max())
    energy = {
        side: 0.5 * (hits[f"v1_{side}"] ** 2 + (system.frequency_ratio * hits["x1"]) ** 2)
        + 0.5 * (hits[f"v2_{side}"] ** 2 + hits["x2"] ** 2) / system.mass_ratio
        for side in ("pre", "post")
    }
    drift = float(np.abs(energy["pre"][1:] - energy["post"][:-1]).max())
    return formula(
        max(contact, drift),
        f"in the place of the tip at {len(hits)} impacts of the machine without drive and damping, "
        "and in the energy of the springs from one impact to the next, in which weight has no part",
        allowed=1e-11,
    )


@stated("eq48a", "eq. (48a)", "the impact section: the states with sin x1 - x2 = delta")
def impact_section() -> Finding:
    """Look where the motions are at the instants of their impacts."""
    off, count = 0.0, 0
    for run in (*settled_runs(), chaotic_run()):
        gaps = run.system.gap_function(run.trajectory(run.impacts["time"]))
        off = max(off, float(np.abs(gaps).max()))
        count += len(gaps)
    return formula(
        off,
        f"in sin x1 - x2 = delta at {count} impacts of the motions of Figs. 5, 6, 9",
        allowed=1e-9,
    )


@stated(
    "eq48b",
    "eq. (48b)",
    "the excitation phase section: the states at mod(t, T) = 0",
    page=PUBLISHED,
)
def phase_section() -> Finding:
    """Take the states one drive period apart, and one unit of time."""
    agree, right, other = 0.0, 0, 0
    for run in settled_runs():
        drive = run.system.drive_period
        end = round(run.final_state.time / drive)
        cycles = np.arange(end - KEEP + 1, end + 1)
        made = run.trajectory(cycles[:-1] * drive)
        agree = max(agree, float(np.abs(made - run.stroboscopic[:-1]).max()))
        right += different(run.stroboscopic) == run.period.m
        units = np.arange(math.ceil(cycles[0] * drive), math.floor(cycles[-1] * drive))
        other += different(run.trajectory(units.astype(float))) == run.period.m
    total = len(settled_runs())
    verdict: Verdict = "refuted"
    if agree < 1e-9 and right == total:
        verdict = "reproduced" if other == total else "corrected"
    return Finding(
        f"T is the drive period: m points for {right} of {total} motions",
        verdict,
        f"with T = 2 pi/omega the section of an m-n motion has m points for {right} of {total} "
        f"named motions, with T = 1 for {other}; T, which (23) uses for the time with dimension, "
        f"is not defined here (E7). The states are those of the trajectory to {agree:.1g}",
    )


@stated(
    "any-coordinate",
    "section 4, below eq. (48)",
    "x1 shows the changes of the motion, and so would each of x1', x2, x2'",
)
def any_coordinate() -> Finding:
    """Count the different values of each in both sections of the named motions."""
    names = ("x1", "v1_pre", "x2", "v2_pre")
    right = np.zeros(4, dtype=int)
    for run in settled_runs():
        for place, name in enumerate(names):
            strobe = different(run.stroboscopic[:, [place]])
            impact = different(run.impacts[name][:, None])
            right[place] += (strobe, impact) == (run.period.m, run.period.n)
    many = [different(chaotic_run().stroboscopic[:, [place]]) for place in range(4)]
    total = len(settled_runs())
    verdict: Verdict = "refuted"
    if right[0] == total and many[0] == KEEP:
        verdict = "reproduced" if min(right) == total and min(many) == KEEP else "corrected"
    return Finding(
        f"each has m and n values for {min(right)} of {total} motions",
        verdict,
        "x1, x1', x2, x2' take m different values in the excitation phase section and n in the "
        f"impact section for {', '.join(map(str, right))} of {total} named motions; Fig. 9(2), "
        f"chaotic, has {', '.join(map(str, many))} in {KEEP} drive periods",
    )


@stated(
    "both-sections",
    "section 4.2.2, Figs. 7 and 8",
    "impact section and stroboscopic section both show m-n and non-periodic motions",
)
def both_sections() -> Finding:
    """Count the different points in either section of the named motions."""
    right, lines = 0, []
    for run in settled_runs():
        impacts = different(np.column_stack([run.impacts["x1"], run.impacts["v1_pre"]]))
        strobes = different(run.stroboscopic)
        right += (strobes, impacts) == (run.period.m, run.period.n)
        lines.append(f"{run.label}: {strobes} and {impacts}")
    total = len(settled_runs())
    many = different(chaotic_run().stroboscopic)
    verdict: Verdict = "refuted"
    if right == total and many == KEEP:
        verdict = "reproduced"
    return Finding(
        f"m and n points for {right} of {total} motions",
        verdict,
        f"different points of the stroboscopic and of the impact section: {'; '.join(lines)}; "
        f"Fig. 9(2), chaotic, has {many} in {KEEP} drive periods",
    )

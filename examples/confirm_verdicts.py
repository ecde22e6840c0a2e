"""Confirm every verdict on stability of Figs. 2 and 3 by simulation.

Each motion of the two maps is simulated from a little beside it, for as many orbits as its largest
multiplier takes to change a distance by a given factor: a stable one must be found again, an
unstable one left. The distance is taken on a section a quarter of a drive period after the impact.

    python examples/confirm_verdicts.py [--figure 2] [--every 100]

All motions take some minutes; the exit status is 1 if a verdict is not confirmed.
"""

import argparse
import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

import vibroimpact as vi
from han_jin_hu_2004 import criterion, existence

# How far off a motion a simulation starts, in (x1, v1, x2, v2): 1e-8 where it nearly grazes
# and its multipliers do not hold for 1e-6; and for an unstable one another direction, where next to
# nothing grows along the first.
BESIDE = ((0.0, 1e-6, 0.0, 0.0), (0.0, 1e-8, 0.0, 0.0))
ALSO_BESIDE = (0.0, 0.0, 0.0, 1e-8)
# The factor of a stable motion, of whose distance k orbits leave k |lambda|^k where two multipliers
# meet; and of an unstable one, as little of the offset may lie along the direction that grows.
SHRINKS, GROWS = 1e4, 1e6
# A distance this many times smaller or larger than the offset is a return or a leaving.
RETURNED, LEFT = 0.1, 100.0
# Multipliers this close to the unit circle take too long to tell from it.
NEUTRAL = 2e-4


@dataclass
class Count:
    """Motions of one verdict: how many were simulated and confirmed, and which were not."""

    simulated: int = 0
    neutral: int = 0
    denied_by_45: int = 0
    failed: list[str] = field(default_factory=list)

    def __str__(self) -> str:
        """Counts in words."""
        confirmed = self.simulated - len(self.failed)
        return (
            f"{confirmed} of {self.simulated} confirmed, {self.denied_by_45} of these against "
            f"(45); {self.neutral} left out, within {NEUTRAL:g} of the unit circle"
        )


def distances(
    motion: vi.PeriodicMotion, beside: Sequence[float], orbits: int
) -> NDArray[np.float64]:
    """Return the distance from a motion after each orbit of a simulation, shape (orbits,)."""
    system = motion.system
    time = motion.impacts["time"][0] + 0.25 * system.drive_period
    section = system.replace(phase=system.phase + system.drive_frequency * time)
    state = motion.trajectory([time])[0]
    run = vi.simulate(section, initial=state + np.array(beside), periods=orbits * motion.m)
    sections = run.stroboscopic[motion.m - 1 :: motion.m]
    return np.asarray(np.abs(sections - state).max(axis=1), dtype=np.float64)


def is_confirmed(motion: vi.PeriodicMotion, stable: bool, size: float) -> bool:
    """Whether simulations agree with a verdict; ``size`` is the largest modulus of a multiplier."""
    orbits = math.ceil(math.log(SHRINKS if stable else GROWS) / abs(math.log(size)))
    for beside in BESIDE if stable else (*BESIDE, ALSO_BESIDE):
        distance, offset = distances(motion, beside, orbits), max(beside)
        if (distance[-1] < RETURNED * offset) if stable else (distance.max() > LEFT * offset):
            return True
    return False


def confirm(found: vi.MotionMap, *, stable: bool, every: int) -> Count:
    """Simulate every so manyth motion of one verdict."""
    rows, result = found.solutions, Count()
    chosen = np.flatnonzero(rows["admissible"] & (rows["stable"] == stable))[::every]
    by_45 = criterion.is_stable(criterion.map_eigenvalues(found))
    for k in chosen:
        size = float(rows["largest_multiplier"][k])
        if abs(size - 1.0) < NEUTRAL:
            result.neutral += 1
            continue
        motion = found.motion(int(k))
        result.simulated += 1
        if is_confirmed(motion, stable, size):
            result.denied_by_45 += int(by_45[k] != stable)
        else:
            result.failed.append(
                f"omega = {motion.system.drive_frequency:g}, "
                f"f1 = {motion.system.moment_amplitude:g}, "
                f"x10 = {motion.state[0]:.10f}, |lambda| = {size:.10f}"
            )
    return result


def main(arguments: Sequence[str] | None = None) -> int:
    """Print the counts; return how many figures have a verdict that is not confirmed."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--figure", type=int, choices=(2, 3), help="one of them; default both")
    parser.add_argument("--every", type=int, default=1, help="every so manyth motion; default all")
    parser.add_argument(
        "--frequencies",
        type=int,
        default=existence.FREQUENCIES,
        help="drive frequencies of the map; default those of the figure",
    )
    given = parser.parse_args(arguments)
    if given.every < 1 or given.frequencies < 2:
        parser.error("--every must be at least 1, --frequencies at least 2")
    wrong = 0
    for figure in (given.figure,) if given.figure else (2, 3):
        found = existence.solve(figure, given.frequencies)
        for verdict in ("stable", "unstable"):
            count = confirm(found, stable=verdict == "stable", every=given.every)
            print(f"Fig. {figure}, {verdict}: {count}", flush=True)
            for failure in count.failed:
                print(f"  not confirmed: {failure}")
            wrong += bool(count.failed)
    return min(wrong, 1)


if __name__ == "__main__":
    raise SystemExit(main())

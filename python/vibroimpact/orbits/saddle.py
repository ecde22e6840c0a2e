"""A saddle on the stroboscopic section: its unstable direction, and where nearby orbits end."""

import math

import numpy as np
from numpy.typing import NDArray

from .._core import LegKind
from ..arguments import reject
from ..simulation import simulated
from ..system import System
from .motion import PeriodicMotion, reduced
from .ranges import refuse
from .shooting import refine

Array = NDArray[np.float64]


def unstable_multiplier(motion: PeriodicMotion) -> float:
    """Return the multiplier outside the unit circle, of a motion that has exactly one."""
    if not isinstance(motion, PeriodicMotion):
        refuse("motion", motion, "a PeriodicMotion")
    if not motion.admissible:
        reject("motion", motion, f"an admissible one; this is none: {motion.why_not}")
    outside = motion.multipliers[np.abs(motion.multipliers) > 1.0]
    if len(outside) != 1:
        reject("motion", motion, "one with exactly one multiplier outside the unit circle")
    return float(outside[0].real)


def eigenvector(motion: PeriodicMotion, time: float) -> Array:
    """Return the unit eigenvector of the unstable multiplier on the section at ``time``.

    With d = (dx1, dx1', dx2', dt) just after an event, at which the state is y, the state at a
    given time differs by dX = dy - F dt, F the vector field after the event.
    """
    itinerary, system = motion.itinerary, motion.system
    matrix = reduced(motion.return_map, itinerary)
    values, vectors = np.linalg.eig(matrix)
    unstable = np.real(vectors[:, np.argmax(np.abs(values))])
    change = np.zeros(4)
    change[[1, 3] if itinerary.wall_at_rest else slice(None)] = unstable
    leg, passed = _leg_at(motion, time)
    if motion.legs[leg].kind is not LegKind.IMPACT:
        reject("section_phase", time * system.drive_frequency, "a phase in a free flight")
    for transfer in itinerary.transfer(system._compiled, motion.nodes)[:leg]:
        change = transfer @ change
    x1, v1, v2, clock = motion.nodes[leg]
    touch = np.array([x1, v1, system.tip(x1) - system.gap, v2])
    a1, a2 = system.accelerations(touch, system.drive_frequency * clock + system.phase)
    moved = np.array([change[0], change[1], system.slope(x1) * change[0], change[2]])
    moved -= change[3] * np.array([v1, a1, v2, a2])
    if itinerary.wall_at_rest:
        moved[2:] = 0.0
    direction: Array = _free_flow(system, passed) @ moved
    direction /= np.linalg.norm(direction)
    direction *= np.sign(direction[np.argmax(np.abs(direction))])
    return direction


def attractor_of(
    system: System, section: System, phase: float, state: Array, settle: int
) -> PeriodicMotion | str:
    """Return the attractor that a state on the section reaches."""
    if phase > 0.0:
        left = (math.tau - phase) / system.drive_frequency
        rest = simulated(section, initial=state.tolist(), time=left)
        if rest.stop_reason not in ("completed", "rest"):
            return str(rest.stop_reason)
        state = np.array(rest.final_state.state)
    run = simulated(system, initial=state.tolist(), periods=settle, keep=min(settle, 400))
    if run.stop_reason not in ("completed", "rest"):
        return str(run.stop_reason)
    motion = refine(run)
    if isinstance(motion, PeriodicMotion) and motion.admissible and motion.stable:
        return motion
    return str(run.label)


def _leg_at(motion: PeriodicMotion, time: float) -> tuple[int, float]:
    """Return the leg that runs at ``time`` and the time since its start."""
    period = motion.system.drive_period
    starts = np.array(motion.clocks) * period + motion.nodes[:, 3]
    place = (time - starts[0]) % (motion.m * period)
    leg = int(np.searchsorted(starts - starts[0], place, side="right")) - 1
    return leg, float(place - (starts[leg] - starts[0]))


def _free_flow(system: System, time: float) -> Array:
    """Return the derivative of a free flight of this time, shape (4, 4)."""
    # Without loads it is the flow itself, which is linear.
    loads = ("moment_amplitude", "force_amplitude", "static_moment", "static_force")
    free = system.replace(**dict.fromkeys(loads, 0.0))
    return np.column_stack([free.free_flight(unit, [time])[0] for unit in np.eye(4)])

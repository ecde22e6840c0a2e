"""What a run predicts of a record, and how that changes with what the run depends on."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..run import Run
from ..system import System
from .record import IMPACT_TIMES
from .unknowns import coordinates_of

Array = NDArray[np.float64]

# Step of central differences of the accelerations, which are smooth and cheap.
_STEP = 6e-6
# Step in time, as part of the drive period or of 2 pi, of differences of velocities in contact.
_INSTANT = 1e-5


def kinds_of(system: System) -> tuple[str, ...]:
    """Return what can be measured of a machine."""
    names = coordinates_of(system)
    accelerations = tuple(f"a{name[1:]}" for name in names if name[0] == "v")
    return (IMPACT_TIMES, *names, *accelerations)


def later(system: System, time: float) -> System:
    """Return the machine with the phase that its drive has after some time."""
    turned = (system.phase + system.drive_frequency * time) % (2.0 * np.pi)
    return system.replace(phase=float(turned))


def states_at(run: Run, times: Array) -> Array:
    """Return flat states of a run at times; beyond its ends those at the ends."""
    inside = np.clip(times, run.kept_from, run.final_state.time)
    return run.trajectory(inside).reshape(len(times), np.size(run.initial))


def predicted(run: Run, kind: str, times: Array) -> Array:
    """Return what is measured at times of a run, of any kind but impact times."""
    names = coordinates_of(run.system)
    if kind in names:
        return states_at(run, times)[:, names.index(kind)]
    values = _free(run.system, kind, states_at(run, times), times)
    held = _in_contact(run, times)
    if held.any():
        column = names.index(f"v{kind[1:]}")
        before, after, length = _beside(run, times[held])
        change = states_at(run, after)[:, column] - states_at(run, before)[:, column]
        values[held] = change / length
    return values


def derivative(run: Run, sensitivity: Any, names: Sequence[str], kind: str, times: Array) -> Array:
    """Return the derivatives of `predicted` by names, shape (times, names)."""
    coordinates = coordinates_of(run.system)
    inside = np.clip(times, run.kept_from, run.final_state.time)
    moved = sensitivity.trajectory(inside)
    if kind in coordinates:
        return np.asarray(moved[:, coordinates.index(kind)])
    states = states_at(run, times)
    found = np.zeros((len(times), len(names)))
    for place in range(states.shape[1]):
        by_state = _difference(run.system, kind, states, times, place)
        with np.errstate(over="ignore", invalid="ignore"):  # not finite, and then refused
            found += by_state[:, None] * moved[:, place]
    for column, name in enumerate(names):
        if name not in coordinates:
            found[:, column] += _difference(run.system, kind, states, times, name)
    held = _in_contact(run, times)
    if held.any():
        column = coordinates.index(f"v{kind[1:]}")
        before, after, length = _beside(run, times[held])
        change = sensitivity.trajectory(after) - sensitivity.trajectory(before)
        found[held] = change[:, column] / length[:, None]
    return found


def _free(system: System, kind: str, states: Array, times: Array) -> Array:
    """Return an acceleration of the motion without contact."""
    phases = (system.phase + system.drive_frequency * times) % (2.0 * np.pi)
    accelerations = system.accelerations(states, phases)
    names = [f"a{name[1:]}" for name in coordinates_of(system) if name[0] == "v"]
    return np.array(accelerations[:, names.index(kind)])


def _difference(system: System, kind: str, states: Array, times: Array, by: str | int) -> Array:
    """Return the derivative of an acceleration by a number of the machine, or by a coordinate."""
    if isinstance(by, int):
        moved = np.zeros(states.shape[1])
        moved[by] = 1.0
        ends = [_free(system, kind, states + sign * moved, times) for sign in (-1.0, 1.0)]
        return (ends[1] - ends[0]) / 2.0  # it is linear in the state
    value = getattr(system, by)
    step = _STEP * max(1.0, abs(value))
    # At the end of its range a number moves to one side only.
    low, high = value - step, value + step
    if by not in ("gap", "phase", "moment_amplitude", "force_amplitude") and low < 0.0 <= value:
        low = value
    if by in ("restitution", "mass_ratio", "friction", "gap"):
        return np.zeros(len(times))
    ends = [_free(system.replace(**{by: end}), kind, states, times) for end in (low, high)]
    slope: Array = (ends[1] - ends[0]) / (high - low)
    return slope


def _in_contact(run: Run, times: Array) -> NDArray[np.bool_]:
    """Return where the bodies are in sustained contact."""
    if run.time_in_contact == 0.0:
        return np.zeros(len(times), np.bool_)
    inside = np.clip(times, run.kept_from, run.final_state.time)
    return np.asarray(run.trajectory(inside, forces=True)[:, 4] > 0.0)


def _beside(run: Run, times: Array) -> tuple[Array, Array, Array]:
    """Return instants just before and after times, inside the run, and the time between them."""
    end = run.final_state.time
    step = _INSTANT * min(run.system.drive_period, 2.0 * np.pi)
    before = np.clip(times - step, run.kept_from, end)
    after = np.clip(times + step, run.kept_from, end)
    return before, after, after - before

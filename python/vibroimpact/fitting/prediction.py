"""What a run predicts of a record, and how that changes with what the run depends on."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import ParameterError
from ..machine import Machine
from ..made import value_of, varied
from .record import IMPACT_TIMES, stop_of

Array = NDArray[np.float64]

# Of more kinds a message names the first and the last.
_MOST_LISTED = 12
# Samples of a run that tell how large its coordinates become, at least this part of the largest.
_SAMPLES, _LEAST_SIZE = 200, 0.05
# Step of differences of the accelerations, which are smooth and cheap, in sizes of the numbers.
_STEP = 6e-6
# Step in time, as part of the shortest period, of differences of velocities in contact.
_INSTANT = 1e-5


def kinds_of(machine: Machine) -> tuple[str, ...]:
    """Return what can be measured of a machine."""
    names = machine._coordinates_by_name
    heard = [IMPACT_TIMES, *(f"{IMPACT_TIMES}_{k}" for k in range(machine._stop_count))]
    return (*heard, *names, *_accelerations_of(machine))


def kinds_in_words(machine: Machine) -> str:
    """Return the same for a message: a structure may have many."""
    kinds = kinds_of(machine)
    if len(kinds) <= _MOST_LISTED:
        return ", ".join(kinds)
    stops, last = machine._stop_count, len(machine._coordinates_by_name) // 2 - 1
    ends = [("impact_times", stops - 1), *((kind, last) for kind in "qva")]
    return ", ".join([IMPACT_TIMES, *(f"{kind}_0 ... {kind}_{end}" for kind, end in ends)])


def heard_in(run: Any, kind: str, resolution: float | None) -> NDArray[np.int64]:
    """Return the rows of the impacts of a run that a record of their times hears."""
    stop = stop_of(kind)
    rows = np.arange(len(run.impacts))
    if stop is not None:
        rows = np.flatnonzero(np.asarray(run.impacts["stop"]) == stop)
    if resolution is None:
        return rows
    times = np.asarray(run.impacts["time"])[rows]
    return rows[np.diff(times, prepend=-np.inf) >= resolution]


def states_at(run: Any, times: Array) -> Array:
    """Return flat states of a run at times; beyond its ends those at the ends."""
    inside = np.clip(times, run.kept_from, run.final_state.time)
    states: Array = run.trajectory(inside).reshape(len(times), np.size(run.initial))
    return states


def sizes_in(runs: Sequence[Any], initial: Array) -> Array:
    """Return how large each coordinate becomes in runs, or is in a start."""
    rows = [np.abs(initial)]
    for run in runs:
        times = np.linspace(run.kept_from, run.final_state.time, _SAMPLES)
        rows.append(np.abs(states_at(run, times)).max(axis=0))
    sizes: Array = np.max(rows, axis=0)
    names = runs[0].system._coordinates_by_name
    for kind in "xqv":  # coordinates, and velocities, have units in common
        mine = [place for place, name in enumerate(names) if name[0] == kind]
        if mine:
            most = float(sizes[mine].max()) or 1.0
            sizes[mine] = np.maximum(sizes[mine], _LEAST_SIZE * most)
    return sizes


def predicted(run: Any, kind: str, times: Array) -> Array:
    """Return what is measured at times of a run, of any kind but impact times."""
    names = run.system._coordinates_by_name
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


def derivative(run: Any, sensitivity: Any, kind: str, times: Array) -> Array:
    """Return the derivatives of `predicted` through the states, (times, columns of these)."""
    coordinates = run.system._coordinates_by_name
    inside = np.clip(times, run.kept_from, run.final_state.time)
    moved = sensitivity.trajectory(inside)
    if kind in coordinates:
        return np.asarray(moved[:, coordinates.index(kind)])
    # The motion without contact is linear in the state.
    found = np.empty((len(times), moved.shape[2]))
    with np.errstate(over="ignore", invalid="ignore"):  # not finite, and then refused
        still = _free(run.system, kind, np.zeros(moved.shape[:2]), times)
        for column in range(moved.shape[2]):
            rows = moved[:, :, column]
            whole = np.isfinite(rows).all(axis=1)
            found[~whole, column] = np.inf
            found[whole, column] = _free(run.system, kind, rows[whole], times[whole]) - still[whole]
    held = _in_contact(run, times)
    if held.any():
        place = coordinates.index(f"v{kind[1:]}")
        before, after, length = _beside(run, times[held])
        change = sensitivity.trajectory(after) - sensitivity.trajectory(before)
        found[held] = change[:, place] / length[:, None]
    return found


def partial(
    machine: Any,
    run: Any,
    begin: float,
    kind: str,
    times: Array,
    names: Sequence[str],
    sizes: Array,
) -> Array:
    """Return the derivatives of `predicted` by numbers of the machine at fixed states.

    The run begins at ``begin``; ``sizes`` are those of the numbers.
    """
    found = np.zeros((len(times), len(names)))
    if kind in machine._coordinates_by_name:
        return found
    states = states_at(run, times)
    here = _free(machine, kind, states, begin + times)
    for column, (name, size) in enumerate(zip(names, sizes.tolist(), strict=True)):
        value, step = value_of(machine, name), _STEP * size

        def at(steps: float, name: str = name, value: float = value, step: float = step) -> Any:
            try:
                changed = varied(machine, {name: value + steps * step})
            except ParameterError:  # beyond the end of its range
                return None
            return _free(changed, kind, states, begin + times)

        above, below = at(1.0), at(-1.0)
        if above is not None and below is not None:
            found[:, column] = (above - below) / (2.0 * step)
            continue
        for side, near in ((1.0, above), (-1.0, below)):
            far = at(2.0 * side)
            if near is not None and far is not None:
                found[:, column] = side * (4.0 * near - 3.0 * here - far) / (2.0 * step)
    found[_in_contact(run, times)] = 0.0
    return found


def _accelerations_of(machine: Machine) -> tuple[str, ...]:
    return tuple(f"a{name[1:]}" for name in machine._coordinates_by_name if name[0] == "v")


def _free(machine: Machine, kind: str, states: Array, times: Array) -> Array:
    """Return an acceleration of the motion without contact."""
    phases = (machine.phase + machine.drive_frequency * times) % (2.0 * np.pi)
    accelerations = machine._accelerations(states, phases)
    return np.array(accelerations[:, _accelerations_of(machine).index(kind)])


def _in_contact(run: Any, times: Array) -> NDArray[np.bool_]:
    """Return where the bodies are in sustained contact."""
    if run.time_in_contact == 0.0:
        return np.zeros(len(times), np.bool_)
    inside = np.clip(times, run.kept_from, run.final_state.time)
    pressed: NDArray[np.bool_] = run._pressed(inside)
    return pressed


def _beside(run: Any, times: Array) -> tuple[Array, Array, Array]:
    """Return instants just before and after times, inside the run, and the time between them."""
    end = run.final_state.time
    step = _INSTANT * 2.0 * np.pi / run.system._fastest
    before = np.clip(times - step, run.kept_from, end)
    after = np.clip(times + step, run.kept_from, end)
    return before, after, after - before

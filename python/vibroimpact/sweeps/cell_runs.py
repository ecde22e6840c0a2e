"""The run of one cell of a grid, made again: the same start and settings, so the same bits."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..arguments import count, reject
from ..errors import ParameterError, StateError
from ..simulation import simulated
from .diagram_results import AnyDiagram
from .fields import STATUS_NAMES
from .grid_machine import START, with_coordinates
from .results import GridResult

_PENDING = STATUS_NAMES.index("pending")


def place_of(shape: tuple[int, ...], names: tuple[str, ...], indices: Any) -> tuple[int, ...]:
    """Return the checked place of a cell; negative numbers count from the end.

    Raises
    ------
    ParameterError
        If there are not as many indices as axes, or one lies outside of its axis.
    """
    if len(indices) != len(shape):
        raise ParameterError(
            f"run({', '.join(map(repr, indices))}) is not allowed; allowed: one index for each of "
            f"{', '.join(names) or 'no axes'}"
        )
    place = []
    for name, length, index in zip(names, shape, indices, strict=True):
        checked = count(f"index of {name}", index, least=-length, most=length - 1)
        place.append(checked + length if checked < 0 else checked)
    return tuple(place)


def run_of_cell(result: GridResult, *indices: int) -> Any:
    """Make the run of a cell of a sweep again; see ``GridResult.run``."""
    axes = result.axes
    shape = tuple(len(values) for values in axes.values())
    place = place_of(shape, tuple(axes), indices)
    values = {name: float(axes[name][k]) for name, k in zip(axes, place, strict=True)}
    settings = result.settings
    machine = result._machine
    initial = np.array(settings["initial"], dtype=float)[np.newaxis]
    own = {name: np.array([value]) for name, value in values.items()}
    initial = with_coordinates(machine, initial, own)[0].tolist()
    number = int(np.ravel_multi_index(place, shape)) if shape else 0
    initial = _start(result, place, initial)
    return _run(result.system_at(number), initial, settings)


def run_of_point(diagram: AnyDiagram[Any], i: int) -> Any:
    """Make the run of a point of a diagram again; see ``Diagram.run``."""
    place = count("i", i, least=-len(diagram), most=len(diagram) - 1) % len(diagram)
    settings = vars(diagram.settings)
    branch, number = divmod(place, len(diagram.values))
    cell = np.unravel_index(place, diagram.columns.grid.shape)
    own = _start(diagram, cell, settings["initial"][branch])
    system = diagram.system_at(place)
    followed = _followed(diagram, branch, number, settings["start"][branch])
    if followed is not None:
        try:
            return _run(system, followed, settings)
        except StateError:
            pass  # The bodies overlap in it: the point was started from the branch's own state.
    return _run(system, own, settings)


def _followed(diagram: AnyDiagram[Any], branch: int, number: int, start: str) -> list[float] | None:
    """Return the state from which a point of a followed branch started; None for the branch's own.

    It is the last state of the nearest point before it that has one: a run that failed has none,
    and the branch went on from the one before.
    """
    length = len(diagram.values)
    before = {
        "fresh": range(0),
        "forward": range(number - 1, -1, -1),
        "backward": range(number + 1, length),
    }[start]
    states = diagram.final_states[branch * length : (branch + 1) * length]
    status = diagram.columns["status"].reshape(-1)[branch * length : (branch + 1) * length]
    for k in before:
        if status[k] == _PENDING:
            i = branch * length + number
            reject(
                "i",
                i,
                f"a point whose start is known: this one is followed from point "
                f"{branch * length + k}, which was not reached (pending)",
            )
        if np.isfinite(states[k]).all():
            found: list[float] = states[k].tolist()
            return found
    return None


def _start(result: GridResult, cell: tuple[Any, ...], initial: Any) -> Any:
    """Return the start that a function made for a cell; without a function that of the settings."""
    if START not in result.columns:
        return initial
    return result.columns[START][cell].tolist()


def _run(system: Any, initial: Any, settings: dict[str, Any]) -> Any:
    names = ("periods", "keep", "max_events", "chatter_tolerance", "section_phase")
    return simulated(system, initial=initial, **{name: settings[name] for name in names})

"""What is said of cells of a grid that have no run, or whose run ended at a cap nobody asked for.

A cell that cannot be run is no reason to refuse the others: it has a status. That there are such
cells is a warning, which names the first of them and why.
"""

from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from ..errors import StateError, warn
from ..run_record import AT_THE_CAP
from ..showing import counted
from .cell_runs import run_of_cell, run_of_point
from .diagram_results import AnyDiagram
from .fields import STATUS_NAMES
from .results import GridResult

_OVERLAP, _CAPPED = (STATUS_NAMES.index(name) for name in ("overlap", "event_cap"))

Result = TypeVar("Result", bound=GridResult)


def told(result: Result) -> Result:
    """Warn of such cells, and return the result.

    Starts over a plane of coordinates are a map of where there are starts: no warning.
    """
    status = np.asarray(result.columns["status"]).reshape(-1)
    over_starts = any(name in result._machine.coordinates for name in result.axes)
    if not over_starts and (status == _OVERLAP).any():
        words, first = _cells(result, status == _OVERLAP)
        inside = "inside a stop" if result.system._stop_count else "where the bodies overlap"
        warn(f"{words} a start {inside} and no run, status overlap: {_why(result, first)}")
    if result.columns.layout.settings["max_events"] is None and (status == _CAPPED).any():
        words, _ = _cells(result, status == _CAPPED)
        warn(f"{words} a run that ended early, status event_cap: {AT_THE_CAP}")
    in_words = "" if result.is_made else result.system._not_in_si
    if in_words and not _may_have_impacts(result):
        warn(f"there are no impacts in any cell; {in_words}")
    return result


def _may_have_impacts(result: GridResult) -> bool:
    """Whether impacts are kept, or may have been where no period tells how many there are."""
    if isinstance(result, AnyDiagram):
        return not len(result) or bool(result.offset[-1])
    return not len(result) or bool(np.any((result.n != 0) | (result.m == 0)))


def _cells(result: GridResult, which: NDArray[np.bool_]) -> tuple[str, int]:
    """Return in words how many cells have something, up to that, and the number of the first."""
    count, first = np.count_nonzero(which), int(which.argmax())
    axes = result.columns.grid.axes
    place = np.unravel_index(first, result.columns.grid.shape)
    at = [
        f"{name} = {values[k]:.6g}" for (name, values), k in zip(axes.items(), place, strict=True)
    ]
    where = f", the first at {', '.join(at)}," if at else ""
    verb = "has" if count == 1 else "have"
    return f"{count} of {counted(len(which), 'cell')}{where} {verb}", first


def _why(result: Any, number: int) -> str:
    """Return why a cell has no run: what its run, made again, is refused for."""
    place = np.unravel_index(number, result.columns.grid.shape)
    try:
        if isinstance(result, AnyDiagram):
            run_of_point(result, number)
        else:
            run_of_cell(result, *map(int, place))
    except StateError as error:
        return str(error)
    return "the bodies overlap at the start"

"""Results over a grid of cells: what is printed of them, and what their columns mean."""

from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..scales import COLUMN_UNITS, needed
from ..showing import counted
from ..sweeps import GridResult
from ..system import System
from . import outputs
from .exit_codes import ExitCode

# Labels that are printed, the most frequent ones.
_MOST_LABELS = 10

# The unit of each column, a property of Scales; the exponents are rates.
_UNITS = {name: unit for name, (unit, _) in COLUMN_UNITS.items()}
_RATES = ("exponent", "error")
_UNITS |= dict.fromkeys(("largest_exponent", "exponent_error"), "frequency")
_UNITS |= {f"{name}_{k}": "frequency" for name in _RATES for k in range(1, 5)}

COLUMNS = """\
  label             m-n, m-inf (complete chatter), chaotic, quasi-periodic,
                    unresolved
  m, n              drive periods and impacts per orbit; 0 where no period was
                    found, n = inf for complete chatter
  residual          largest difference between sections m periods apart
  status            completed; restarted, a followed state did not fit the new
                    value; overlap, the bodies do so at the start; failed; or
                    why the run stopped early"""


def columns_of(
    result: GridResult, names: Iterable[str], units: str | None = None
) -> dict[str, NDArray[Any]]:
    """Return columns of the cells by name, as they are written: n is inf with complete chatter."""
    columns = {name: np.asarray(getattr(result, name)).ravel() for name in names}
    columns = in_units(result, columns, units)
    if "n" in columns:
        n = columns["n"]
        columns["n"] = np.where(n == -1, "inf", n.astype(np.str_))
    return columns


def in_units(
    result: GridResult,
    columns: Mapping[str, NDArray[Any]],
    units: str | None,
    counts: NDArray[np.int64] | int = 1,
) -> dict[str, NDArray[Any]]:
    """Return columns in SI, where that is asked for; ``counts`` are the rows of each cell."""
    if units is None:
        return dict(columns)
    scales = [needed(system.scales) for system in _systems(result)]
    chosen: dict[str, NDArray[Any]] = {}
    for name, column in columns.items():
        unit = _UNITS.get(name, "")
        of_cells = np.array([getattr(each, unit) for each in scales] if unit else [])
        chosen[name] = column * np.repeat(of_cells, counts) if unit else column
    return chosen


def _systems(result: GridResult) -> list[System]:
    """Return the system of each cell."""
    if not result.is_made:
        return [result.system] * len(result)
    return [result.system_at(number) for number in range(len(result))]


def describe(status: NDArray[np.str_], label: NDArray[np.str_]) -> list[tuple[str, str]]:
    """Count statuses, and the most frequent labels of the cells that were reached."""
    lines = statuses(status)
    found = _counted(label[status != "pending"])
    lines += [(name, counted(count, "cell")) for name, count in found[:_MOST_LABELS]]
    rest = sum(count for _, count in found[_MOST_LABELS:])
    return [*lines, ("others", counted(rest, "cell"))] if rest else lines


def statuses(status: NDArray[np.str_]) -> list[tuple[str, str]]:
    """Count statuses."""
    return [
        (name, f"{count} of {counted(status.size, 'cell')}") for name, count in _counted(status)
    ]


def _counted(names: NDArray[np.str_]) -> list[tuple[str, int]]:
    """Return the names that occur and how often, the most frequent first."""
    kinds, counts = np.unique(names, return_counts=True)
    order = np.argsort(-counts, kind="stable")
    return [(str(kinds[i]), int(counts[i])) for i in order]


def exit_code(status: NDArray[np.str_]) -> ExitCode:
    """Say whether all cells have come to their end."""
    complete = np.isin(status, outputs.COMPLETE).all()
    return ExitCode.DONE if complete else ExitCode.INCOMPLETE

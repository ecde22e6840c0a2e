"""Results over a grid of cells: what is printed of them, and what their columns mean."""

from collections.abc import Iterable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..sweeps import GridResult
from . import outputs
from .exit_codes import ExitCode

# Labels that are printed, the most frequent ones.
_MOST_LABELS = 10

COLUMNS = """\
  label             m-n, m-inf (complete chatter), chaotic, quasi-periodic,
                    unresolved
  m, n              drive periods and impacts per orbit; 0 where no period was
                    found, n = inf for complete chatter
  residual          largest difference between sections m periods apart
  status            completed; restarted, a followed state did not fit the new
                    value; overlap, the bodies do so at the start; failed; or
                    why the run stopped early"""


def columns_of(result: GridResult, names: Iterable[str]) -> dict[str, NDArray[Any]]:
    """Return columns of the cells by name, as they are written: n is inf with complete chatter."""
    columns = {name: np.asarray(getattr(result, name)).ravel() for name in names}
    if "n" in columns:
        n = columns["n"]
        columns["n"] = np.where(n == -1, "inf", n.astype(np.str_))
    return columns


def describe(status: NDArray[np.str_], label: NDArray[np.str_]) -> list[tuple[str, str]]:
    """Count statuses, and the most frequent labels of the cells that were reached."""
    lines = statuses(status)
    found = _counted(label[status != "pending"])
    lines += [(name, f"{count} cells") for name, count in found[:_MOST_LABELS]]
    rest = sum(count for _, count in found[_MOST_LABELS:])
    return [*lines, ("others", f"{rest} cells")] if rest else lines


def statuses(status: NDArray[np.str_]) -> list[tuple[str, str]]:
    """Count statuses."""
    return [(name, f"{count} of {status.size} cells") for name, count in _counted(status)]


def _counted(names: NDArray[np.str_]) -> list[tuple[str, int]]:
    """Return the names that occur and how often, the most frequent first."""
    kinds, counts = np.unique(names, return_counts=True)
    order = np.argsort(-counts, kind="stable")
    return [(str(kinds[i]), int(counts[i])) for i in order]


def exit_code(status: NDArray[np.str_]) -> ExitCode:
    """Say whether all cells have come to their end."""
    complete = np.isin(status, outputs.COMPLETE).all()
    return ExitCode.DONE if complete else ExitCode.INCOMPLETE

"""The data of the views as CSV: the columns are those of the command line's files."""

from __future__ import annotations

import csv
import io
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .._core import Regime
from ..sweeps import Basins, Chart
from .machine import Machine


def of_run(run: Any) -> str:
    """Return the kept impacts of a run, one row each."""
    return _text({name: run.impacts[name] for name in run.impacts.dtype.names or ()})


def of_map(result: Any, machine: Machine) -> str:
    """Return a map: a row for each impact of a diagram, for each cell of a chart or of basins."""
    if not isinstance(result, Chart | Basins):
        return _text(machine.columns(result))
    (first, x), (second, y) = result.axes.items()
    columns: dict[str, Any] = {first: np.repeat(x, len(y)), second: np.tile(y, len(x))}
    columns |= {name: getattr(result, name).ravel() for name in ("label", "status")}
    if isinstance(result, Basins):
        columns["attractor"] = result.attractor.ravel()
    return _text(columns)


def _flat(columns: Mapping[str, NDArray[Any]]) -> dict[str, NDArray[Any]]:
    """Return a column for each coordinate of those that have several, and regimes in words."""
    flat: dict[str, Any] = {}
    regimes: NDArray[Any] = np.array([regime.name.lower() for regime in Regime])
    for name, values in columns.items():
        if name == "regime":
            flat[name] = regimes[np.asarray(values)]
        elif np.ndim(values) == 2:
            rows: Any = values
            flat |= {f"{name}{i}": rows[:, i] for i in range(np.shape(values)[1])}
        else:
            flat[name] = np.asarray(values)
    return flat


def _text(given: Mapping[str, NDArray[Any]]) -> str:
    """Return a table as text; numbers come back from it bit for bit."""
    columns = _flat(given)
    file = io.StringIO()
    writer = csv.writer(file, lineterminator="\n")
    writer.writerow(columns)
    writer.writerows(zip(*(column.tolist() for column in columns.values()), strict=True))
    return file.getvalue()

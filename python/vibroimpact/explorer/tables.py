"""The data of the views as CSV: the columns are those of the command line's files."""

from __future__ import annotations

import csv
import io
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .._core import Regime
from ..run import Run
from ..sweeps import Basins, Chart, Diagram


def of_run(run: Run) -> str:
    """Return the kept impacts of a run, one row each."""
    columns = {name: run.impacts[name] for name in run.impacts.dtype.names or ()}
    return _text(columns | {"regime": _regimes(columns["regime"])})


def of_map(result: Diagram | Chart | Basins) -> str:
    """Return a map: a row for each impact of a diagram, for each cell of a chart or of basins."""
    if isinstance(result, Diagram):
        names = ("x1", "v1", "v2", "phase", "approach_velocity", "energy_loss")
        columns: dict[str, NDArray[Any]] = {result.parameter_name: result.impact_parameter}
        columns |= {name: np.asarray(getattr(result, name)) for name in names}
        return _text(columns | {"regime": _regimes(result.regime)})
    (first, x), (second, y) = result.axes.items()
    columns = {first: np.repeat(x, len(y)), second: np.tile(y, len(x))}
    columns |= {name: getattr(result, name).ravel() for name in ("label", "status")}
    if isinstance(result, Basins):
        columns["attractor"] = result.attractor.ravel()
    return _text(columns)


def _regimes(regimes: NDArray[Any]) -> NDArray[np.str_]:
    names = np.array([regime.name.lower() for regime in Regime])
    return np.asarray(names[np.asarray(regimes)])


def _text(columns: Mapping[str, NDArray[Any]]) -> str:
    """Return a table as text; numbers come back from it bit for bit."""
    file = io.StringIO()
    writer = csv.writer(file, lineterminator="\n")
    writer.writerow(columns)
    writer.writerows(zip(*(column.tolist() for column in columns.values()), strict=True))
    return file.getvalue()

"""Peak memory of a computation over a grid, in a store and in memory, for growing grids.

    python benches/sweep_memory.py [--cells 10000 100000 1000000]

Each run has a process of its own, whose peak resident memory (ru_maxrss) is printed. The cells hold
a cheap logistic map with the columns of a sweep and some rows each: memory depends on what is kept,
not on how long it takes to compute.
"""

import argparse
import json
import math
import resource
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from vibroimpact import atlas
from vibroimpact.atlas import STATUS, ChunkResult, Columns, Field, Grid, RowGroup

STEPS, ROWS = 20, 10
CHUNK = 4096


@dataclass(frozen=True)
class Logistic:
    """x -> r x (1 - x) in every cell: a state of four, a dozen numbers, ten rows."""

    grid: Grid
    kind: str = "logistic map"
    fields: tuple[Field, ...] = (
        STATUS,
        Field("m", "int64", "period"),
        Field("n", "int64", "impacts"),
        Field("residual", "float64", "change over a period"),
        Field("final_state", "float64", "the last values", (4,), ("coordinate",)),
        Field("exponents", "float64", "rates", (4,), ("exponent",)),
    )
    rows: tuple[RowGroup, ...] = (RowGroup("impact", (Field("x1", "float64", "values"),)),)
    cost: float = 600.0
    divisible: bool = True

    def settings(self) -> dict[str, Any]:
        """Return what the numbers depend on."""
        return {"steps": STEPS}

    def compute(self, first: int, last: int, **_: Any) -> ChunkResult:
        """Compute a chunk."""
        size = last - first
        values = self.grid.values(first, last)
        r = 3.6 + 0.2 * (values["gap"] + values["restitution"])
        path = np.full((size, STEPS), 0.3)
        for step in range(1, STEPS):
            path[:, step] = r * path[:, step - 1] * (1.0 - path[:, step - 1])
        columns = {
            "status": np.ones(size, np.int8),
            "m": np.argmin(abs(path[:, :-1] - path[:, -1:]), axis=1),
            "n": (path > 0.5).sum(axis=1),
            "residual": path[:, -1] - path[:, -2],
            "final_state": path[:, -4:].copy(),
            "exponents": np.log(abs(path[:, -4:] - 0.5) + 1e-3),
        }
        rows = {"x1": path[:, -ROWS:].ravel()}
        return ChunkResult(columns, {"impact": (np.full(size, ROWS), rows)})


def measure(cells: int, stored: bool) -> dict[str, float]:
    """Run one computation; return its peak memory in MB, its time and what came of it."""
    side = math.isqrt(cells)
    axis = np.linspace(0.0, 1.0, side)
    task = Logistic(Grid({"gap": axis, "restitution": axis}))

    def wrap(columns: Columns) -> int:
        return columns.done

    with tempfile.TemporaryDirectory() as folder:
        store = Path(folder) / "sweep.zarr"
        if stored:
            atlas.compute(Logistic(Grid({"gap": [0.0], "restitution": [0.0]})), wrap, store=store)
            store = Path(folder) / "second.zarr"
        before = peak()
        start = time.perf_counter()
        done = atlas.compute(task, wrap, chunk=CHUNK, store=store if stored else None)
        seconds = time.perf_counter() - start
        size = sum(file.stat().st_size for file in store.rglob("*") if file.is_file())
    assert done == side**2
    return {
        "cells": done,
        "before": before,
        "peak": peak(),
        "seconds": seconds,
        "disk": size / 1e6,
    }


def peak() -> float:
    """Return the largest resident memory of this process so far, in MB."""
    unit = 1 if sys.platform == "darwin" else 1024  # bytes there, kilobytes elsewhere
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * unit / 1e6


def main() -> None:
    """Measure each size in a fresh process, and print a table."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--cells", type=int, nargs="+", default=[10**4, 10**5, 10**6])
    parser.add_argument("--one", choices=["store", "memory"], help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    if arguments.one:
        print(json.dumps(measure(arguments.cells[0], arguments.one == "store")))
        return
    print(f"{'kept in':8} {'cells':>9} {'before':>10} {'peak':>10} {'on disk':>10} {'time':>8}")
    for kept in ("store", "memory"):
        for cells in arguments.cells:
            command = [sys.executable, __file__, "--one", kept, "--cells", str(cells)]
            run = subprocess.run(command, capture_output=True, text=True, check=True)
            found = json.loads(run.stdout)
            disk = f"{found['disk']:7.1f} MB" if kept == "store" else ""
            print(
                f"{kept:8} {found['cells']:9} {found['before']:7.0f} MB {found['peak']:7.0f} MB "
                f"{disk:>10} {found['seconds']:6.1f} s",
                flush=True,
            )


if __name__ == "__main__":
    main()

"""Peak memory of computations over a grid, in a store and in memory, for growing grids.

    python benches/sweep_memory.py [--cells 10000 100000 1000000]

Each has a process of its own, whose peak resident memory (ru_maxrss) is printed. ``cells`` are runs
over two parameters, ``diagram`` keeps the sections of each run, too: ragged rows. The runs are as
short as can be, since memory depends on what is kept and not on how long it takes to compute.
"""

import argparse
import json
import math
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

import vibroimpact as vi
from vibroimpact import sweeps
from vibroimpact.sweeps import Columns, Grid
from vibroimpact.sweeps.cells import CellTask, RunSettings

SYSTEM = vi.System(
    mass_ratio=0.6,
    frequency_ratio=2.0,
    restitution=0.8,
    gap=0.5,
    drive_frequency=1.8,
    moment_amplitude=1.0,
)
INITIAL = (0.0, 0.5, 0.0, 0.0)
PERIODS, KEEP = 6, 4
CHUNK = 4096


def run_cells(cells: int, store: Path | None) -> Columns:
    """Run a square of so many cells."""
    side = math.isqrt(cells)
    axes = {"drive_frequency": np.linspace(1.0, 2.0, side), "gap": np.linspace(0.4, 0.6, side)}
    run = RunSettings(initial=INITIAL, periods=PERIODS, keep=KEEP)
    task = CellTask(kind="sweep", system=SYSTEM, grid=Grid(axes), run=run, measure="returns")
    return sweeps.compute(task, lambda columns: columns, chunk=CHUNK, store=store)


def run_diagram(cells: int, store: Path | None) -> Columns:
    """Compute a diagram of so many points."""
    return vi.bifurcation_diagram(
        SYSTEM,
        initial=INITIAL,
        periods=PERIODS,
        keep=KEEP,
        labels=False,
        chunk=CHUNK,
        store=store,
        drive_frequency=np.linspace(1.0, 2.0, cells),
    ).columns


COMPUTATIONS = {"cells": run_cells, "diagram": run_diagram}


def measure(name: str, kept: str, cells: int) -> dict[str, float]:
    """Run one computation; return its peak memory in MB, its time and what came of it."""
    with tempfile.TemporaryDirectory() as folder:
        stores = [Path(folder) / f"{place}.zarr" if kept == "store" else None for place in "ab"]
        COMPUTATIONS[name](4, stores[0])  # loads what there is to load
        before = peak()
        start = time.perf_counter()
        columns = COMPUTATIONS[name](cells, stores[1])
        seconds = time.perf_counter() - start
        if not columns.complete:
            raise RuntimeError(f"{columns.done} of {columns.grid.size} cells done")
        files = [file for file in Path(folder).rglob("*") if file.is_file()]
        return {
            "cells": columns.grid.size,
            "before": before,
            "peak": peak(),
            "disk": sum(file.stat().st_size for file in files) / 1e6,
            "seconds": seconds,
        }


def peak() -> float:
    """Return the largest resident memory of this process so far, in MB."""
    unit = 1 if sys.platform == "darwin" else 1024  # bytes there, kilobytes elsewhere
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * unit / 1e6


def main() -> None:
    """Measure each size in a fresh process, and print a table."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--cells", type=int, nargs="+", default=[10**4, 10**5, 10**6])
    parser.add_argument("--one", nargs=2, help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    if arguments.one:
        print(json.dumps(measure(*arguments.one, arguments.cells[0])))
        return
    print("computed  kept in      cells     before       peak    on disk      time")
    for name in COMPUTATIONS:
        for kept in ("store", "memory"):
            for cells in arguments.cells:
                command = [sys.executable, __file__, "--one", name, kept, "--cells", str(cells)]
                run = subprocess.run(command, stdout=subprocess.PIPE, text=True, check=True)
                found = json.loads(run.stdout)
                disk = f"{found['disk']:7.1f} MB" if kept == "store" else ""
                print(
                    f"{name:9} {kept:8} {found['cells']:9} {found['before']:7.0f} MB "
                    f"{found['peak']:7.0f} MB {disk:>10} {found['seconds']:7.1f} s",
                    flush=True,
                )


if __name__ == "__main__":
    main()

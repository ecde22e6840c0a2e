"""A task for the engine that needs nothing of the compiled kernel: a logistic map in every cell."""

import os
import signal
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from vibroimpact.sweeps import STATUS, ChunkResult, Columns, Field, Grid, RowGroup

GRID = Grid({"gap": np.linspace(0.0, 1.0, 7), "restitution": np.linspace(0.2, 0.9, 11)})

FIELDS = (
    STATUS,
    Field("final", "float64", "value after the last step"),
    Field("visits", "int64", "steps that ended in each half", shape=(2,), dims=("half",)),
    Field("above", "bool", "whether the last value is above a half"),
)
ROWS = RowGroup(
    "peak",
    (
        Field("step", "int32", "step at which the value exceeded 0.9"),
        Field("peak", "float64", "value before and after that step", (2,), ("side",)),
    ),
)


@dataclass(frozen=True)
class Toy:
    """x -> r x (1 - x), chaotic, with the steps above 0.9 as ragged rows.

    ``trouble`` names what happens at the start of the chunk that holds the cell ``at``, once if a
    file ``fuse`` is given and for as long as it exists: ``ctrl_c``, ``half`` (Ctrl-C found within
    the chunk), ``kill``, ``raise``; ``wait`` until another process lets go of the ``gate``.
    """

    grid: Grid = GRID
    steps: int = 50
    ragged: bool = True
    divisible: bool = True
    trouble: str = ""
    at: int = 0
    fuse: Path | None = None
    gate: Path | None = None
    kind: str = "toy"
    extra: dict[str, Any] = field(default_factory=dict)

    @property
    def fields(self) -> tuple[Field, ...]:
        return FIELDS

    @property
    def rows(self) -> tuple[RowGroup, ...]:
        return (ROWS,) if self.ragged else ()

    @property
    def cost(self) -> float:
        return 5000.0

    def settings(self) -> dict[str, Any]:
        return {"system": {"name": "logistic", "start": 0.3}, "steps": self.steps, **self.extra}

    def within(self, _first: int, _last: int) -> "Toy":
        return self

    def compute(
        self, first: int, last: int, *, workers: int | None, progress: Callable[[int], bool] | None
    ) -> ChunkResult:
        done = last - first
        if self.trouble and first <= self.at < last and self._burn():
            done = self._suffer(first, last)
        result = self._iterate(first, first + done)
        if done < last - first:
            result = padded(result, last - first)
        if progress is not None:
            progress(done)
        return result

    def _burn(self) -> bool:
        if self.fuse is None:
            return True
        try:
            self.fuse.unlink()
        except FileNotFoundError:
            return False
        return True

    def _suffer(self, first: int, last: int) -> int:
        match self.trouble:
            case "ctrl_c":
                signal.raise_signal(signal.SIGINT)
            case "half":
                return (last - first) // 2
            case "kill":
                os.kill(os.getpid(), signal.SIGKILL)
            case "raise":
                raise ArithmeticError(f"cell {self.at}")
            case "wait":
                # A named pipe: here until it is opened at the other end too, and closed there.
                self.gate.read_bytes()
        return last - first

    def _iterate(self, first: int, last: int) -> ChunkResult:
        values = self.grid.values(first, last)
        r = 3.6 + 0.4 * np.mod(sum(values.values(), np.zeros(last - first)), 1.0)
        x = np.full(last - first, 0.3)
        path = np.empty((last - first, self.steps + 1))
        path[:, 0] = x
        for step in range(self.steps):
            x = r * x * (1.0 - x)
            path[:, step + 1] = x
        high = path[:, 1:] > 0.5
        columns = {
            "status": np.full(last - first, 1, np.int8),
            "final": x,
            "visits": np.stack([(~high).sum(axis=1), high.sum(axis=1)], axis=1),
            "above": x > 0.5,
        }
        if not self.ragged:
            return ChunkResult(columns)
        cell, step = np.nonzero(path[:, 1:] > 0.9)
        rows = {
            "step": step.astype(np.int32) + 1,
            "peak": np.stack([path[cell, step], path[cell, step + 1]], axis=1),
        }
        return ChunkResult(columns, {"peak": (np.bincount(cell, minlength=last - first), rows)})


@contextmanager
def held(gate: Path) -> Iterator[None]:
    """Wait until a task has come to its gate, and keep it there for the block."""
    with gate.open("wb"):
        yield


def padded(result: ChunkResult, length: int) -> ChunkResult:
    """Return an interrupted result of so many cells, the last ones pending."""
    columns = {}
    for entry in FIELDS:
        columns[entry.name] = np.full((length, *entry.shape), entry.fill, entry.dtype)
        columns[entry.name][: len(result.columns["status"])] = result.columns[entry.name]
    rows = {
        name: (np.pad(counts, (0, length - len(counts))), arrays)
        for name, (counts, arrays) in result.rows.items()
    }
    return ChunkResult(columns, rows, interrupted=True)


def whole(columns: Columns) -> Columns:
    """Hand the columns over as they are."""
    return columns


def assert_same(found: Columns, expected: Columns) -> None:
    """Check that two computations have the same bits in all columns."""
    assert found.names == expected.names
    for name in expected.names:
        one, other = found[name], expected[name]
        assert (one.shape, one.dtype) == (other.shape, other.dtype), name
        assert one.tobytes() == other.tobytes(), name

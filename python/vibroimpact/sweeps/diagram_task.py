"""The points of a bifurcation diagram as the cells of a grid: one branch for each start."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from .cells import CellTask
from .diagram_results import Start
from .fields import ChunkResult, RowGroup


@dataclass(frozen=True, kw_only=True, eq=False)
class DiagramTask(CellTask):
    """One branch for each start, over the values of one parameter: axes (branch, parameter)."""

    # As nested tuples.
    initials: tuple[Any, ...]
    starts: tuple[Start, ...]

    @property
    def rows(self) -> tuple[RowGroup, ...]:  # type: ignore[override]
        """Impacts and sections."""
        return self.machine.row_groups

    @property
    def divisible(self) -> bool:  # type: ignore[override]
        """Whether no branch is followed from point to point."""
        return set(self.starts) == {"fresh"}

    def settings(self) -> dict[str, Any]:
        """Return all that the numbers depend on but the grid."""
        settings = vars(self.run) | {
            "initial": [*self.initials],
            "start": list(self.starts),
            "labels": self.measure != "returns",
            "exponents": self.measure == "largest_exponent",
        }
        return {"system": self.machine.to_dict(), **settings}

    def compute(
        self,
        first: int,
        last: int,
        *,
        workers: int | None,
        progress: Callable[[int], object] | None,
    ) -> ChunkResult:
        """Run the points first ... last - 1, which may belong to several branches."""
        length = self.grid.shape[-1]
        parts: list[ChunkResult] = []
        for branch in range(first // length, (last - 1) // length + 1) if last > first else ():
            begin = max(first, branch * length)
            end = min(last, (branch + 1) * length)
            stopped = bool(parts) and parts[-1].interrupted
            advance = None if progress is None else _after(begin - first, progress)
            parts.append(
                self._pending(end - begin)
                if stopped
                else self._run(branch, begin, end, workers, advance)
            )
        return _joined(parts or [self._pending(0)])

    def _run(
        self,
        branch: int,
        first: int,
        last: int,
        workers: int | None,
        progress: Callable[[int], object] | None,
    ) -> ChunkResult:
        options = {"start": self.starts[branch], "rows": True}
        return ChunkResult(
            *self.run_cells(
                self.initials[branch], first, last, workers=workers, progress=progress, **options
            )
        )

    def _pending(self, cells: int) -> ChunkResult:
        """Return the result of points that were not computed because of Ctrl-C."""
        columns = {f.name: np.full((cells, *f.shape), f.fill, f.dtype) for f in self.fields}
        none = np.zeros(cells, np.int64)
        rows = {
            group.name: (none, {f.name: np.empty((0, *f.shape), f.dtype) for f in group.fields})
            for group in self.rows
        }
        return ChunkResult(columns, rows, interrupted=cells > 0)


def _after(before: int, progress: Callable[[int], object]) -> Callable[[int], object]:
    return lambda done: progress(before + done)


def _joined(parts: Sequence[ChunkResult]) -> ChunkResult:
    if len(parts) == 1:
        return parts[0]
    columns = {
        name: np.concatenate([part.columns[name] for part in parts]) for name in parts[0].columns
    }
    rows = {}
    for group, (_, fields) in parts[0].rows.items():
        counts = np.concatenate([part.rows[group][0] for part in parts])
        rows[group] = (
            counts,
            {
                name: np.concatenate([part.rows[group][1][name] for part in parts])
                for name in fields
            },
        )
    return ChunkResult(columns, rows, any(part.interrupted for part in parts))

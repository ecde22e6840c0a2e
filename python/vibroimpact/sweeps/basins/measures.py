"""Measures of basins and their boundaries, from the attractors of the cells of a grid.

Uncertainty exponent: C. Grebogi, S. W. McDonald, E. Ott and J. A. Yorke, Phys. Lett. A 99, 415
(1983). Basin entropy: A. Daza, A. Wagemakers, B. Georgeot, D. Guery-Odelin and M. A. F. Sanjuan,
Sci. Rep. 6, 31416 (2016).
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ...arguments import array_of, count, reject
from ...interruption import interruptible
from ...showing import counted

Labels = NDArray[np.integer]

# Blocks along each axis of the grid for the jackknife.
_BLOCKS = 4
# Fewest uncertain cells of a distance that takes part in the fit.
_FEWEST = 10
# Spacings of an axis may differ by this part.
_EVEN = 1e-6


@interruptible
@dataclass(frozen=True, kw_only=True, eq=False)
class UncertaintyExponent:
    """How the part f of uncertain cells falls with the distance: f ~ distance^exponent.

    A cell is uncertain at a distance of k cells if one of the cells k steps before and after it,
    along an axis, has another attractor; f is the mean over both axes. A smooth boundary has the
    exponent 1, a fractal one of dimension D in the plane 2 - D. With an exponent near 0 a more
    precise start hardly helps.

    Attributes
    ----------
    exponent
        Slope of ln f over ln k; NaN where fewer than two distances have uncertain cells.
    error
        Standard error: of the sample, from leaving out one sixteenth of the grid at a time, and of
        the fit, from its residuals, both together. Structure finer than the grid is not included.
    dimension
        2 - exponent, the box dimension of the boundary.
    steps
        Distances, in cells, shape (k,).
    uncertain
        Part of the cells that is uncertain at each, shape (k,).
    fitted
        Which of them take part in the fit, shape (k,): those with ten uncertain cells or more.
    """

    exponent: float
    error: float
    steps: NDArray[np.int64]
    uncertain: NDArray[np.float64]
    fitted: NDArray[np.bool_]

    @property
    def dimension(self) -> float:
        """Box dimension of the boundary."""
        return 2.0 - self.exponent

    def __repr__(self) -> str:
        """Exponent with its error."""
        return f"<UncertaintyExponent {self.exponent:.3f} +- {self.error:.3f}>"


@interruptible
@dataclass(frozen=True, kw_only=True)
class BasinEntropy:
    """Mean entropy of the attractors in boxes of cells, natural logarithm.

    Attributes
    ----------
    entropy
        Basin entropy S_b: mean over all boxes, 0 ... ln(attractors).
    boundary_entropy
        Boundary basin entropy S_bb: mean over the boxes with more than one attractor; NaN without
        any. Above ln 2 the boundary is fractal; the converse does not hold.
    boundary_error
        Standard error of S_bb, the boxes taken as independent.
    boxes, boundary_boxes
        Number of boxes, and of those with more than one attractor.
    box
        Cells along each side of a box.
    """

    entropy: float
    boundary_entropy: float
    boundary_error: float
    boxes: int
    boundary_boxes: int
    box: int

    def __repr__(self) -> str:
        """Both entropies, and how many boxes they are of."""
        where = "no boundary"
        if self.boundary_boxes:
            error = f" +- {self.boundary_error:.3f}" if self.boundary_boxes > 1 else ""
            where = f"on the boundary {self.boundary_entropy:.3f}{error}"
        boxes = f"{self.boundary_boxes} of {counted(self.boxes, 'box', ending='es')}"
        return (
            f"<BasinEntropy {self.entropy:.3f}, {where}, {boxes} of {self.box} x {self.box} cells>"
        )

    @property
    def fractal(self) -> bool:
        """Whether S_bb exceeds ln 2 by two standard errors: sufficient, not necessary."""
        return self.boundary_entropy - 2.0 * self.boundary_error > math.log(2.0)


@interruptible
def uncertainty_exponent(
    labels: Labels,
    *,
    axes: Mapping[str, NDArray[np.float64]] | None = None,
    steps: ArrayLike | None = None,
) -> UncertaintyExponent:
    """Return the uncertainty exponent of a grid of labels.

    Parameters
    ----------
    labels
        Number of the attractor of each cell, shape (a, b), -1 for none. Along each axis the cells
        are judged that have an attractor, as have all those at the distances before and after.
    axes
        Values of the two axes, which must be evenly spaced.
    steps
        Distances, in cells; default 1, 2, 4 ... up to an eighth of the shorter axis.

    Raises
    ------
    ParameterError
        If an axis is not evenly spaced or a step does not fit into the grid.
    """
    for name, values in (axes or {}).items():
        spacing = np.diff(values)
        if len(spacing) and np.ptp(spacing) > _EVEN * np.abs(spacing).max():
            reject(name, values, "evenly spaced values: distances are counted in cells")
    shortest = min(labels.shape)
    if shortest < 3:
        reject("shape", labels.shape, "at least 3 cells along each axis")
    if steps is None:
        powers = 2 ** np.arange(31)
        chosen = powers[powers <= max(shortest // 8, 1)]
    else:
        wanted = "whole numbers, at least one"
        given = np.atleast_1d(array_of("steps", steps, wanted)).ravel().tolist()
        if not given:
            reject("steps", steps, wanted)
        chosen = np.array([count("steps", k, least=1, most=(shortest - 1) // 2) for k in given])
    cells, uncertain = _tally(labels, chosen)
    whole = uncertain.sum(axis=1)
    fitted = whole >= _FEWEST
    exponent, spread = _slope(chosen[fitted], uncertain[fitted].sum(axis=1))
    rest = [
        _slope(chosen[fitted], np.delete(uncertain[fitted], block, axis=1).sum(axis=1))[0]
        for block in range(_BLOCKS**2)
    ]
    jackknife = math.sqrt((_BLOCKS**2 - 1) * float(np.var(rest)))
    return UncertaintyExponent(
        exponent=exponent,
        error=math.hypot(jackknife, spread),
        steps=chosen.astype(np.int64),
        uncertain=whole / max(cells, 1),
        fitted=fitted,
    )


def _tally(labels: Labels, steps: NDArray[np.integer]) -> tuple[int, NDArray[np.int64]]:
    """Count the cells that are judged, the same at all distances, and the uncertain ones by block.

    Returns
    -------
    cells
        Number of cells, those judged along both axes twice.
    uncertain
        How many of them are uncertain at each distance, in each block, shape (k, blocks).
    """
    cells, reach = 0, int(steps.max())
    uncertain = np.zeros((len(steps), _BLOCKS**2), dtype=np.int64)
    for field in (labels, labels.T):
        here = field[reach:-reach]
        rows, columns = (np.arange(n) * _BLOCKS // n for n in here.shape)
        block = rows[:, None] * _BLOCKS + columns
        both = [
            (field[reach - k : len(field) - reach - k], field[reach + k : len(field) - reach + k])
            for k in steps.tolist()
        ]
        judged = here >= 0
        for before, after in both:
            judged &= (before >= 0) & (after >= 0)
        cells += int(np.count_nonzero(judged))
        for number, (before, after) in zip(uncertain, both, strict=True):
            differs = judged & ((before != here) | (after != here))
            number += np.bincount(block[differs], minlength=_BLOCKS**2)
    return cells, uncertain


def _slope(steps: NDArray[np.integer], uncertain: NDArray[np.int64]) -> tuple[float, float]:
    """Fit ln f over ln k by least squares; slope, and its error from the residuals."""
    kept = uncertain > 0
    if np.count_nonzero(kept) < 2:
        return math.nan, math.nan
    x, y = np.log(steps[kept]), np.log(uncertain[kept])
    x = x - x.mean()
    slope = float((x * y).sum() / (x * x).sum())
    residuals = y - y.mean() - slope * x
    free = max(len(x) - 2, 1)
    return slope, math.sqrt(float((residuals**2).sum()) / free / float((x * x).sum()))


@interruptible
def basin_entropy(labels: Labels, *, box: int = 5) -> BasinEntropy:
    """Return the basin entropy of a grid of labels.

    Parameters
    ----------
    labels
        Number of the attractor of each cell, shape (a, b). Cells with -1 are left out; a box with
        none but them does not count. Cells beyond the last whole box are not used.
    box
        Cells along each side of a box.

    Raises
    ------
    ParameterError
        If the grid is smaller than a box.
    """
    box = count("box", box, least=2, most=max(min(labels.shape), 2))
    if min(labels.shape) < box:
        reject("shape", labels.shape, f"at least {box} cells along each axis")
    rows, columns = (length // box for length in labels.shape)
    cut = labels[: rows * box, : columns * box].reshape(rows, box, columns, box)
    boxes = cut.transpose(0, 2, 1, 3).reshape(rows * columns, box * box)
    total = (boxes >= 0).sum(axis=1)
    entropies = np.zeros(len(boxes))
    several = np.zeros(len(boxes), dtype=np.int64)
    for label in np.unique(labels[labels >= 0]):
        number = (boxes == label).sum(axis=1)
        part = number / np.maximum(total, 1)
        entropies -= part * np.log(np.where(number > 0, part, 1.0))
        several += number > 0
    used, boundary = total > 0, several > 1
    values = entropies[boundary]
    return BasinEntropy(
        entropy=float(entropies[used].mean()) if used.any() else math.nan,
        boundary_entropy=float(values.mean()) if len(values) else math.nan,
        boundary_error=float(values.std(ddof=1) / math.sqrt(len(values)))
        if len(values) > 1
        else math.nan,
        boxes=int(used.sum()),
        boundary_boxes=len(values),
        box=box,
    )

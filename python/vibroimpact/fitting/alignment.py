"""Which predicted impact is which measured one.

In a search a motion may have a weak impact too many, or lack one: beyond a graze. Then the others
must not be compared with their neighbours. The alignment keeps the order, and costs least:

    a pair                   (predicted - measured)^2, in units of the interval beside the measured
    a measured one alone     1/4, as a pair half an interval apart
    a predicted one alone    1/50 to 1/4, by its approach velocity in units of the median

Source: S. B. Needleman, C. D. Wunsch, J. Mol. Biol. 48 (1970) 443.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Places = NDArray[np.int64]

_ALONE, _WEAK = 0.25, 0.02
# Pairs so near need no other alignment.
_NEAR = 0.3
# The table of costs grows with the square of the rows: long records are aligned in blocks of so
# many, of each of which the first half is kept.
_BLOCK = 1000


def intervals(times: Array) -> Array:
    """Return the shorter interval beside each instant; before the first one begins the motion."""
    gaps = np.diff(times, prepend=0.0)
    beside = np.minimum(gaps, np.append(gaps[1:], np.inf))
    widths: Array = np.maximum(beside, 1e-12)
    return widths


def aligned(measured: Array, widths: Array, predicted: Array, velocities: Array) -> Places:
    """Return the place of each measured impact among the predicted ones, -1 where it has none.

    ``widths`` are the intervals beside the measured impacts.
    """
    n = len(measured)
    if len(predicted) >= n:
        near = np.abs(predicted[:n] - measured) <= _NEAR * widths
        if near.all():
            return np.arange(n)
    places = np.full(n, -1)
    row = first = 0
    while row < n:
        rows = slice(row, row + _BLOCK)
        found = _block(measured[rows], widths[rows], predicted[first:], velocities[first:])
        last = row + _BLOCK >= n
        kept = found if last else found[: _BLOCK // 2]
        paired = kept >= 0
        places[row : row + len(kept)][paired] = first + kept[paired]
        row += len(kept)
        first += int(kept.max(initial=-1)) + 1
    return places


def _block(measured: Array, widths: Array, predicted: Array, velocities: Array) -> Places:
    """Return the places of some rows among what is predicted from the first of them on."""
    n = len(measured)
    # Predicted ones long after the last measured belong to later rows.
    last = measured[-1] + widths[-1]
    predicted = predicted[predicted <= last]
    m = len(predicted)
    if not m:
        return np.full(n, -1)
    typical = max(float(np.median(velocities[:m])), 1e-300)
    alone = np.clip(_ALONE * velocities[:m] / typical, _WEAK, _ALONE)
    pair = ((predicted[None, :] - measured[:, None]) / widths[:, None]) ** 2
    # best[i, j]: least cost of the first i measured and the first j predicted ones.
    best = np.empty((n + 1, m + 1))
    best[0] = np.concatenate([[0.0], np.cumsum(alone)])
    skipped = best[0].copy()
    for i in range(1, n + 1):
        own = np.empty(m + 1)
        own[0] = best[i - 1, 0] + _ALONE
        own[1:] = np.minimum(best[i - 1, :-1] + pair[i - 1], best[i - 1, 1:] + _ALONE)
        # own[j] = min(own[j], own[j - 1] + alone[j - 1]), for all j at once.
        best[i] = np.minimum.accumulate(own - skipped) + skipped
    places = np.full(n, -1)
    i, j = n, int(np.argmin(best[n]))
    while i > 0:
        if (
            j > 0
            and best[i, j] >= best[i - 1, j - 1] + pair[i - 1, j - 1] - 1e-12
            and (
                best[i - 1, j - 1] + pair[i - 1, j - 1]
                <= min(best[i - 1, j] + _ALONE, best[i, j - 1] + alone[j - 1]) + 1e-12
            )
        ):
            i, j = i - 1, j - 1
            places[i] = j
        elif best[i - 1, j] + _ALONE <= (best[i, j - 1] + alone[j - 1] if j else np.inf):
            i -= 1
        else:
            j -= 1
    return places

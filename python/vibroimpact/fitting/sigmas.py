"""Standard errors of records that do not state them: a first guess, then from the residuals."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from .minimum import Found
from .record import Record, is_heard
from .search import Search

Array = NDArray[np.float64]

# First guesses: parts of the median interval of impacts, and of the standard deviation of values.
_OF_INTERVAL, _OF_SPREAD = 0.02, 0.05
# Part of the size of the values below which residuals are rounding, as it grows along a motion.
_ROUNDING = 1e-11
# Median of the absolute value of a normal variable of variance 1.
_MEDIAN = 0.6744897501960817


def first_sigmas(records: Sequence[Record]) -> list[Array]:
    """Return standard errors of all rows, guessed where they are not known."""
    found = []
    for record in records:
        if record.sigma is not None:
            found.append(np.array(record.sigma))
            continue
        if is_heard(record.kind):
            size = _OF_INTERVAL * float(np.median(np.diff(record.times, prepend=0.0)))
        else:
            size = _OF_SPREAD * float(np.std(record.values))
        size = size if size > 0.0 else _OF_SPREAD * max(float(np.abs(record.values).max()), 1.0)
        found.append(np.full(len(record), size))
    return found


def estimated(search: Search, found: Found, sigmas: Sequence[Array]) -> list[Array] | None:
    """Return standard errors from the residuals; None if all are known, or nothing can be said.

    Of the rows of a record those count that are not used up by the unknowns (its leverage).
    """
    records = search.problem.records
    if all(record.sigma is not None for record in records):
        return None
    derived = search.along(found)
    if derived is None:
        return None
    weighted = derived.weighted
    basis, singular, _ = np.linalg.svd(derived.derivative, full_matrices=False)
    basis = basis[:, singular > 1e-10 * singular[0]]
    leverages = np.split((basis**2).sum(axis=1), np.cumsum([len(z) for z in weighted])[:-1])
    better = []
    for number, (record, sigma) in enumerate(zip(records, sigmas, strict=True)):
        z, leverage = weighted[number], leverages[number]
        used = np.isfinite(search.sigmas[number])
        free = int(used.sum()) - float(leverage.sum())
        if record.sigma is not None or free < 0.5:
            better.append(sigma)
            continue
        if search.loss == "linear":
            size = float(np.sqrt((z @ z) / free))
        else:
            size = float(np.median(np.abs(z[used]))) / _MEDIAN * float(np.sqrt(used.sum() / free))
        least = _ROUNDING * max(float(np.abs(record.values).max()), 1e-300)
        better.append(np.maximum(sigma * size, least))
    return better

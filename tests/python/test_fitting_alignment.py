"""Which predicted impact is which measured one: short and long records, weak and lost impacts."""

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from vibroimpact.fitting import alignment


def record(
    rows: int, seed: int
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64], NDArray[np.int64]]:
    """Return measured times, predicted times and velocities, and the places of the measured."""
    random = np.random.default_rng(seed)
    times = np.cumsum(random.uniform(0.5, 1.5, rows))
    kinds = random.random(rows)
    measured, predicted, velocities, places = [], [], [], []
    for time, kind in zip(times.tolist(), kinds.tolist(), strict=True):
        if kind > 0.98:  # the motion has a weak impact that was not measured
            predicted.append(time - 0.2)
            velocities.append(0.01)
        measured.append(time)
        if kind < 0.02:  # the motion lacks the impact
            places.append(-1)
            continue
        places.append(len(predicted))
        predicted.append(time + random.normal(0.0, 0.02))
        velocities.append(1.0)
    return np.array(measured), np.array(predicted), np.array(velocities), np.array(places)


@pytest.mark.parametrize("rows", [1, 30, 999, 1001, 5000])
def test_weak_and_lost_impacts_are_told(rows: int) -> None:
    """The pairs are those of the motion, in one block of rows and in several."""
    measured, predicted, velocities, places = record(rows, seed=rows)
    found = alignment.aligned(measured, alignment.intervals(measured), predicted, velocities)
    assert np.array_equal(found, places)


def test_blocks_pair_as_one_table_does(monkeypatch: pytest.MonkeyPatch) -> None:
    """A record in blocks of 100 rows has the pairs of the whole table."""
    measured, predicted, velocities, _ = record(900, seed=3)
    late = predicted + 0.3 * np.sin(0.01 * predicted)  # off by up to half an interval
    widths = alignment.intervals(measured)
    whole = alignment.aligned(measured, widths, late, velocities)
    monkeypatch.setattr(alignment, "_BLOCK", 100)
    assert np.array_equal(alignment.aligned(measured, widths, late, velocities), whole)


def test_a_long_record_takes_memory_of_its_length(monkeypatch: pytest.MonkeyPatch) -> None:
    """No table of all rows by all impacts is made: it had 3.6 GB here."""
    measured, predicted, velocities, places = record(15_000, seed=1)
    largest, empty = 0, np.empty

    def watched(shape: Any, *rest: Any) -> Any:
        nonlocal largest
        largest = max(largest, int(np.prod(shape)))
        return empty(shape, *rest)

    monkeypatch.setattr(np, "empty", watched)
    found = alignment.aligned(measured, alignment.intervals(measured), predicted, velocities)
    assert np.array_equal(found, places)
    assert 0 < largest < 3_000_000

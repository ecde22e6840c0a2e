"""A thousand hostile records, 200 in a usual run: a clear error that names the row, or a fit.

Never NaN.
"""

import re

import numpy as np
import pytest

import sizes
import vibroimpact as vi
from small_results import START
from systems import PAPER

RUN = vi.simulate(PAPER, initial=START, periods=8)
KINDS = ("impact_times", "x1", "v1", "a1", "x2", "v2", "a2")
WAYS = (
    *("unsorted", "empty", "one row", "units of time", "units of values", "missing", "nan"),
    *("infinite", "negative", "equal times", "shuffled values", "noise", "huge", "constant"),
    *("zero sigma", "early end", "late"),
)
MANY = 1000


def spoilt(number: int) -> tuple[str, str, np.ndarray, np.ndarray | None, object]:
    """A way, a kind, times, values and sigma of a record that is wrong in this way."""
    random = np.random.default_rng(number)
    way, kind = WAYS[number % len(WAYS)], KINDS[random.integers(len(KINDS))]
    options = {} if kind == "impact_times" else {"sampling": random.uniform(0.2, 2.0)}
    record = vi.measure(RUN, kind, noise=0.01, seed=number, **options)
    times = record.times.copy()
    values = None if kind == "impact_times" else record.values.copy()
    sigma: object = None if random.random() < 0.5 else 0.01
    row = int(random.integers(len(times)))
    column = times if values is None else values
    match way:
        case "unsorted":
            random.shuffle(times)
        case "empty":
            times, values = times[:0], None if values is None else values[:0]
        case "one row":
            times, values = times[:1], None if values is None else values[:1]
        case "units of time":
            times *= random.choice([1e-3, 1e3, 60.0, 1e6, 1e12])
        case "units of values":
            column *= random.choice([1e-3, 1e3, 57.29577951308232])
        case "missing":
            kept = np.sort(random.choice(len(times), max(1, len(times) // 3), replace=False))
            times, values = times[kept], None if values is None else values[kept]
        case "nan":
            column[row] = np.nan
        case "infinite":
            column[row] = random.choice([np.inf, -np.inf])
        case "negative":
            times -= random.uniform(0.5, 5.0) + times[0]
        case "equal times":
            times[row:] = times[row]
        case "shuffled values":
            random.shuffle(column)
            times = np.sort(times)
        case "noise":
            values = None if values is None else random.standard_normal(len(times))
            times = np.sort(random.uniform(0.0, 30.0, len(times)))
        case "huge":
            column[row] = random.choice([1e30, 1e45, 1e49])
            times = np.sort(times)
        case "constant":
            values = None if values is None else np.zeros(len(times))
        case "zero sigma":
            sigma = np.where(np.arange(len(times)) == row, 0.0, 0.01)
        case "early end":
            times = times * 1e-9
        case "late":
            times = times + 1e4 * RUN.final_state.time
    return way, kind, times, values, sigma


# Ways that are refused whatever the rest is.
REFUSED = ("empty", "nan", "infinite", "negative", "zero sigma", "late")
ROW = re.compile(r"(times|values|sigma)\[\d+\]|at least one row")


def resolution_of(number: int, kind: str) -> float | None:
    """How near impacts are heard apart: often not told, else of any size; also of other kinds."""
    random = np.random.default_rng(MANY + number)
    if random.random() < (0.3 if kind == "impact_times" else 0.9):
        return None
    of_the_motion = float(np.diff(RUN.impacts["time"]).min())
    if random.random() < 0.6:
        return of_the_motion * float(random.uniform(0.01, 3.0))
    return float(random.choice([1e-300, 1e-12, RUN.final_state.time, 1e6, 1e300]))


def fitted_or_refusal(kind, times, values, sigma, resolution=None) -> vi.Fit | str:
    """The fit of a record, or the words in which it is refused."""
    unknown = ["restitution", "gap", "v1"]
    try:
        record = vi.Record(kind, times, values, sigma=sigma, resolution=resolution)
        return vi.fit(record, PAPER, unknown=unknown, initial=START, starts=1)
    except vi.ParameterError as error:
        return str(error)


@pytest.mark.parametrize("part", range(sizes.either(1, 10)))
def test_hostile_records(part):
    refused = 0
    for number in range(part * MANY // 10, (part + 1) * MANY // 10):
        way, kind, times, values, sigma = spoilt(number)
        resolution = resolution_of(number, kind)
        found = fitted_or_refusal(kind, times, values, sigma, resolution)
        if isinstance(found, str):
            refused += 1
            if resolution is not None and kind != "impact_times":
                assert "resolution = " in found, (number, way, found)
            else:
                assert ROW.search(found), (number, way, found)
            continue
        assert resolution is None or kind == "impact_times"
        assert way not in REFUSED, (number, way)
        assert np.isfinite(found.estimates).all(), (number, way)
        assert not np.isnan(found.standard_errors).any(), (number, way)
        assert np.isfinite(found.covariance).all(), (number, way)
        assert np.isfinite(found.predicted).all(), (number, way)
        assert np.isfinite(found.chi2), (number, way)
        assert not np.isnan(found.combination_errors).any(), (number, way)
        assert found.summary(), (number, way)
        if way in ("units of values", "noise", "shuffled values") and kind != "impact_times":
            assert found.verdict != "fits" or len(times) <= 20, (number, way, kind)
    assert refused > 20

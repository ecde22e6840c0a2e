"""Simulated measurements: what a record of a run would look like, with noise and jitter."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..arguments import count, not_negative, positive, reject, vector
from ..errors import ParameterError
from ..interruption import interruptible
from ..run_record import AnyRun, RunRecord
from .jumps import jumps_at_impacts
from .prediction import heard_in, kinds_in_words, kinds_of, predicted
from .record import Record, is_heard

Array = NDArray[np.float64]

# Noise is at most of this size.
_MOST = 1e40
# A sampled record has at most so many rows.
_MOST_ROWS = 10_000_000
# A run is so much longer than its end says, for rounding.
_WHOLE = 1.0 + 1e-12
# Node of the rule for normal errors; and how many standard errors of an instant an impact is away
# at least that it does not come to lie on the other side.
_NODE, _FAR = 3.0**0.5, 4.0


@interruptible
def measure(
    run: AnyRun,
    what: str,
    *,
    noise: float = 0.0,
    at: ArrayLike | None = None,
    sampling: float | None = None,
    jitter: float = 0.0,
    resolution: float | None = None,
    seed: int = 0,
) -> Record:
    """Return a record as a measurement of a run would give it: to plan one, or to try a fit.

    Parameters
    ----------
    run
        A run that keeps all of its impacts and sections.
    what
        ``"impact_times"``; or a coordinate, its rate or acceleration: ``"x1"``, ``"v1"``,
        ``"a1"``, ``"x2"``, ``"v2"``, ``"a2"``. Of a structure ``"impact_times_0"`` of one stop, and
        ``"q_0"``, ``"v_0"``, ``"a_0"``, ``"q_1"`` ... Impacts that complete chatter skipped have no
        times here.
    noise
        Standard deviation of normal, independent errors of the values, or of the times of impacts;
        0 for none.
    at
        When values are measured, ascending times inside the run, shape (n,); or else ``sampling``.
    sampling
        Time between values.
    jitter
        Standard deviation of errors of the instants of measurement: the record has the intended
        times. ``sigma`` of the record takes them into account.
    resolution
        Of times of impacts: what comes sooner after another impact is not heard, as in `Record`.
    seed
        Of the random numbers: records with errors of their own need seeds of their own.

    Returns
    -------
    Record
        Its ``sigma`` is that of the errors made; None without errors.

    Raises
    ------
    ParameterError
        If an argument is out of range, or the run has no impact to be heard.

    Examples
    --------
    >>> import vibroimpact as vi
    >>> system = vi.System(mass_ratio=0.6, frequency_ratio=2, restitution=0.8, gap=0.5,
    ...                    drive_frequency=1.8, moment_amplitude=1)
    >>> run = vi.simulate(system, initial=(0, 0.5, 0, 0), periods=20)
    >>> vi.measure(run, "x1", noise=0.01, sampling=0.1)
    <Record x1: 699 rows from time 0 to 69.8, sigma 0.01>
    >>> vi.measure(run, "impact_times")
    <Record impact_times: 19 rows from time 3.51736 to 66.2458, sigma unknown>
    """
    need_run(run)
    kinds = kinds_of(run.system)
    if not isinstance(what, str) or what not in kinds:
        reject("what", what, kinds_in_words(run.system), known=kinds)
    if run.kept_from > 0.0:
        reject("run", run, "a run that keeps all, from t = 0 on: simulated without keep=")
    noise, jitter = not_negative("noise", noise), not_negative("jitter", jitter)
    for label, size, most in (("noise", noise, _MOST), ("jitter", jitter, run.final_state.time)):
        if size > most:
            reject(label, size, f"a number from 0 to {most:g}")
    random = np.random.default_rng(count("seed", seed, least=0))
    if is_heard(what):
        for name, value in (("at", at), ("sampling", sampling)):
            if value is not None:
                reject(name, value, "None for impact times")
        if resolution is not None:
            resolution = positive("resolution", resolution)
        return _heard(run, what, float(np.hypot(noise, jitter)), resolution, random)
    if resolution is not None:
        reject("resolution", resolution, "None but for impact times")
    times = _instants(run, at, sampling)
    true = times
    spread = np.full(len(times), noise)
    if jitter > 0.0:
        end = run.final_state.time
        true = np.clip(times + jitter * random.standard_normal(len(times)), 0.0, end)
        spread = np.hypot(noise, _by_jitter(run, what, times, jitter))
        spread = np.maximum(spread, 1e-3 * max(float(spread.mean()), 1e-300))
    values = predicted(run, what, true) + noise * random.standard_normal(len(times))
    return Record(what, times, values, sigma=spread if noise or jitter else None)


def _by_jitter(run: AnyRun, kind: str, times: Array, jitter: float) -> Array:
    """Return standard errors of values that are measured at other instants than is thought."""
    end = run.final_state.time

    def change(by: float) -> Array:
        away: Array = predicted(run, kind, np.clip(times + by * jitter, 0.0, end))
        return away - predicted(run, kind, times)

    # Gauss and Hermite's rule for the mean square: nodes +-3^(1/2) with 1/6 each.
    found = np.hypot(*(change(side * _NODE) for side in (-1.0, 1.0))) / 6.0**0.5
    # Beside an impact a few rows may lie on its other side, and be off by all that changes there.
    if not jumps_at_impacts(run.system, kind):
        return np.asarray(found)
    impacts = np.asarray(run.impacts["time"])
    sides = [np.searchsorted(impacts, times + side * _FAR * jitter) for side in (-1.0, 1.0)]
    across = np.maximum(*(np.abs(change(side * _FAR)) for side in (-1.0, 1.0)))
    return np.asarray(np.where(sides[0] < sides[1], np.maximum(found, 0.5 * across), found))


def need_run(run: Any) -> None:
    """Refuse what is no run."""
    if not isinstance(run, RunRecord):
        reject("run", run, "a vibroimpact.Run or a vibroimpact.StructureRun")


def _heard(
    run: AnyRun, kind: str, noise: float, resolution: float | None, random: np.random.Generator
) -> Record:
    """Return the times of impacts with errors, in their order."""
    exact = np.asarray(run.impacts["time"])[heard_in(run, kind, resolution)]
    if not len(exact):
        reject("run", run, "a run with an impact to be heard")
    times = np.sort(np.maximum(exact + noise * random.standard_normal(len(exact)), 0.0))
    for k in np.flatnonzero(np.diff(times) <= 0.0):  # both at 0, or equal by chance
        times[k + 1] = np.nextafter(times[k], np.inf)
    return Record(kind, times, sigma=noise or None, resolution=resolution)


def _instants(run: AnyRun, at: Any, sampling: Any) -> Array:
    """Return the checked instants of measurement."""
    end = run.final_state.time
    if (at is None) == (sampling is None):
        given = "neither" if at is None else "both"
        raise ParameterError(f"give exactly one of at= and sampling=, got {given}")
    if at is None:
        step = positive("sampling", sampling)
        if end / step > _MOST_ROWS:
            reject("sampling", sampling, f"a time of at least 1/{_MOST_ROWS} of the run")
        # A run over periods is a whole number of steps but for rounding.
        steps = int(end / step * _WHOLE) + 1
        return np.asarray(np.minimum(step * np.arange(steps), end), dtype=np.float64)
    times = vector("at", at)
    if not len(times):
        reject("at", at, "at least one time")
    outside = np.flatnonzero((times < 0.0) | (times > end))
    if len(outside):
        k = int(outside[0])
        reject(f"at[{k}]", times[k].item(), f"times inside the run, 0 to {end!r}")
    return times

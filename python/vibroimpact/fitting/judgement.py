"""The verdict on a fit: whether it is one, and what the records leave open."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..showing import counted
from .alignment import intervals
from .minimum import Found
from .problem import Problem
from .record import Record, is_heard
from .result import Fit, Verdict, tuples
from .search import Search
from .statistics import (
    are_negligible,
    bounded,
    chi2_tail,
    determination,
    inflation,
    ljung_box,
    runs_test,
    sign_test,
)

Array = NDArray[np.float64]

# A test with less probability by chance speaks against the model.
_LEAST_PROBABILITY = 1e-3
# Fewer rows than this do not show an order.
_TESTED = 30
# Less probable things are all told alike.
_LEAST_SHOWN = 1e-99
# Residuals of this part of what there was to explain, by medians, explain little.
_UNEXPLAINED = 0.3
# A value or interval is in other units if it is so many times what the machine does.
_OTHER_UNITS = 15.0
# A record of so many rows and turns at least goes with a frequency of which it has this part.
_LEAST_RHYTHM, _LEAST_TURNS, _RHYTHM = 8, 4.0, 0.5
# A robust loss leaves out residuals beyond so many standard errors; of more than this part of the
# others they are no outliers.
_OUTLIER, _MOST_OUTLIERS = 4.0, 0.25
# Impacts of a record that the motion lacks do not count unless they are more than this part of it.
_MOST_LOST = 0.25
# Impacts that follow each other within so many standard errors are not told apart.
_APART = 6.0


def judged(search: Search, found: Found | None, values: Array) -> Fit:
    """Return the fit of a search, with its verdict."""
    problem = search.problem
    unknowns = problem.unknowns
    rows = sum(map(len, problem.records))
    count = len(unknowns.names)
    sigma = np.concatenate(search.sigmas)
    measured = np.concatenate([record.values for record in problem.records])
    point = values if found is None else found.point.values
    start = unknowns.start_of(problem.initial, point)
    nothing = np.full(count, np.inf)
    common: dict[str, Any] = {
        "machine": unknowns.machine_of(problem.machine, point),
        "initial": tuples(start.reshape(problem.machine._starts_shape).tolist()),
        "names": unknowns.names,
        "estimates": point.copy(),
        "sizes": unknowns.scales.copy(),
        "ranges": np.column_stack([unknowns.low, unknowns.high]),
        "records": tuple(problem.records),
        "sigma": sigma,
        "dof": max(rows - count, 0),
        "loss": search.loss,
        "steps": search.steps,
        "segments": (0.0,) if found is None else found.window.borders,
    }
    derived = None
    if found is not None and found.whole:
        derived = search.along(found)
    if found is None or derived is None:
        predicted, reason = _unfinished(found, measured)
        z = (measured - predicted) / sigma
        return Fit(
            verdict="not converged",
            reasons=(reason, *_units(problem, found)),
            profile=None,
            covariance=np.diag(unknowns.scales**2),
            standard_errors=nothing,
            combinations=np.eye(count),
            combination_errors=nothing,
            at_bounds=(),
            predicted=predicted,
            chi2=float(z @ z),
            probability=None,
            missing_impacts=_NO_TIMES,
            extra_impacts=_NO_TIMES,
            **common,
        )
    lost = found.evaluation.lacking(problem.records)
    extra = found.evaluation.unheard(found.window.end)
    weighted = [
        each[np.isfinite(sigma) & ~(missing & (missing.mean() <= _MOST_LOST))]
        for each, sigma, missing in zip(derived.weighted, search.sigmas, lost, strict=True)
    ]
    variance = inflation(search.loss, np.concatenate(weighted), count)
    outliers = 0
    if search.loss != "linear":  # it gives outliers little weight, and so does the verdict
        kept = [each[np.abs(each) <= _OUTLIER] for each in weighted]
        outliers = sum(map(len, weighted)) - sum(map(len, kept))
        weighted = kept
    z = np.concatenate(weighted)
    rows = len(z)
    common["dof"] = max(rows - count, 0)
    chi2 = float(z @ z)
    probability = _probability(problem, weighted, count)
    times = [record.times[missing] for record, missing in zip(problem.records, lost, strict=True)]
    missing_impacts, extra_impacts = np.concatenate(times), np.array([time for time, _ in extra])
    reasons = _reasons(problem, found, weighted, probability)
    reasons += _other_impacts(problem, missing_impacts.tolist(), extra)
    if outliers > _MOST_OUTLIERS * rows:
        many = f"{outliers} of {rows + outliers} rows"
        reasons.append(("residuals too large", f"{many} are more than 4 standard errors off"))
    verdict = _verdict(reasons)
    dof = common["dof"]
    if verdict in ("systematic residuals", "residuals too large") and dof:
        variance *= max(1.0, chi2 / dof)
    changes = derived.changes[:count]
    known = determination(derived.derivative, changes, unknowns.scales, variance)
    # From no more rows than unknowns nothing tells the size of errors that is not stated.
    untold = rows <= count and any(record.sigma is None for record in problem.records)
    errors = np.full(len(known.errors), np.inf) if untold else known.errors
    told = np.isinf(known.open_errors) | (not untold)
    combinations, combination_errors = known.open[told], known.open_errors[told]
    said = [sentence for _, sentence in reasons]
    if outliers and verdict == "fits":
        many = counted(outliers, "outlier")
        said.append(f"{many}, more than 4 standard errors off, with little weight")
    # Of residuals that no unknown changes, their size says nothing about the model.
    nothing_told = bool(np.isinf(errors).all())
    common_ones = not len(missing_impacts) and not extra
    if (verdict == "fits" and (len(combinations) or untold)) or (
        verdict == "residuals too large" and probability is None and nothing_told and common_ones
    ):
        verdict = "not identifiable"
        if untold:
            said.append("there are no more rows than unknowns: nothing tells their errors")
    if verdict != "fits":
        said += _units(problem, found)
        said += [each for record in problem.records for each in _crowded(record)]
    tiny = probability is not None and probability > 1.0 - _LEAST_PROBABILITY
    if tiny and dof and verdict in ("fits", "not identifiable"):
        said.append("the residuals are much smaller than the stated sigma: is sigma right?")
    low, high = unknowns.low, unknowns.high
    ends = (point <= low) | (point >= high)
    return Fit(
        verdict=verdict,
        reasons=tuple(said),
        profile=None,
        covariance=known.covariance,
        standard_errors=errors,
        combinations=combinations,
        combination_errors=combination_errors,
        at_bounds=tuple(name for name, at in zip(unknowns.names, ends, strict=True) if at),
        predicted=np.concatenate(found.evaluation.predicted),
        chi2=chi2,
        probability=probability,
        missing_impacts=missing_impacts,
        extra_impacts=extra_impacts,
        **common,
    )


def _unfinished(found: Found | None, measured: Array) -> tuple[Array, str]:
    """Return predictions of a search that came to nothing, and why it did."""
    if found is None:
        return np.zeros(len(measured)), "the machine has no motion at the first guesses"
    predicted = np.concatenate(found.evaluation.predicted)
    if len(predicted) != len(measured):
        return np.zeros(len(measured)), "the search did not reach the end of the records"
    return predicted, "derivatives do not exist where the search ended, such as at a graze"


def _probability(problem: Problem, weighted: list[Array], unknowns: int) -> float | None:
    """Return the probability of so large residuals by chance, of records with known errors."""
    known = [z for z, r in zip(weighted, problem.records, strict=True) if r.sigma is not None]
    if not known:
        return None
    rows = sum(map(len, known))
    # Records without errors take their part of the unknowns.
    share = unknowns * rows / max(1, sum(map(len, weighted)))
    # With as many unknowns as rows all residuals can be 0; those of the true values have as many
    # degrees of freedom as there are rows.
    return chi2_tail(float(sum(z @ z for z in known)), rows - share if rows > share else rows)


# What residuals of a record are not if they are random.
_TESTS = (
    (ljung_box, "neighbours alike"),
    (runs_test, "signs in runs"),
    (sign_test, "most of one sign"),
)
# Each reason has the verdict that it leads to.
_Reason = tuple[Verdict, str]
_WORST_FIRST: tuple[Verdict, ...] = (
    *("not converged", "systematic residuals", "residuals too large"),
    "other impacts",
)
_NO_TIMES = np.zeros(0)


def _reasons(
    problem: Problem, found: Found, weighted: list[Array], probability: float | None
) -> list[_Reason]:
    """Return what speaks against the fit."""
    reasons: list[_Reason] = []
    if not found.converged:
        reasons.append(("not converged", f"no minimum was reached in {found.steps} steps"))
    tests = len(_TESTS) * len(weighted)
    for record, z in zip(problem.records, weighted, strict=True):
        if are_negligible(z):  # such as rounding, of a record without noise
            continue
        for test, told in _TESTS:
            chance = test(bounded(z))
            if chance * tests < _LEAST_PROBABILITY:
                said = f"the residuals of {record.name} are not random: {told} ({_by(chance)})"
                reasons.append(("systematic residuals", said))
    for record, residuals in zip(problem.records, found.evaluation.residuals, strict=True):
        if record.sigma is None and (said := _unexplained(record, residuals)):
            reasons.append(("residuals too large", said))
    if probability is not None and probability < _LEAST_PROBABILITY:
        verdict: Verdict = "residuals too large"
        said = f"the residuals are larger than the stated sigma ({_by(probability)})"
        if max(map(len, weighted)) < _TESTED:
            said += "; so few rows do not tell whether they are random"
        reasons.append((verdict, said))
    return reasons


def _other_impacts(
    problem: Problem, missing: list[float], extra: Sequence[tuple[float, float]]
) -> list[_Reason]:
    """Return which impacts the motion and the records do not have in common."""
    reasons: list[_Reason] = []
    if missing:
        many = counted(len(missing), "impact")
        reasons.append(("other impacts", f"the motion lacks {many} of the record{_at(missing)}"))
    if extra:
        times, velocities = map(list, zip(*extra, strict=True))
        many = counted(len(extra), "impact")
        are = "is" if len(extra) == 1 else "are"
        said = f"the motion has {many} that {are} not in the record{_at(times)}"
        said += f", approach velocities to {max(velocities):.2g}"
        if any(is_heard(each.kind) and each.resolution is None for each in problem.records):
            said += "; resolution= leaves out those that are too near to others to be heard"
        reasons.append(("other impacts", said))
    return reasons


def _crowded(record: Record) -> list[str]:
    """Return that impacts of a record follow each other too soon to be told apart."""
    sigma = record.sigma
    if not is_heard(record.kind) or record.resolution is not None or sigma is None:
        return []
    widths = np.diff(record.times)
    near = widths < _APART * np.maximum(sigma[1:], sigma[:-1])
    if not near.any():
        return []
    many = counted(int(near.sum()), "impact")
    return [
        f"{many} of {record.name} came within {_APART:g} standard errors of the one before, the "
        f"nearest within {float(widths.min()):.2g}: such impacts are not told apart; a record with "
        f"resolution={1.1 * _APART * float(sigma.max()):.1g} leaves them out"
    ]


def _by(chance: float) -> str:
    """Return a probability; one that is no number of its own any more, as less than another."""
    return f"p = {chance:.1e}" if chance >= _LEAST_SHOWN else f"p < {_LEAST_SHOWN:.0e}"


def _at(times: list[float]) -> str:
    """Return when it is, or the first of several."""
    return f", {'the first ' if len(times) > 1 else ''}at t = {min(times):.6g}"


def _unexplained(record: Record, residuals: Array) -> str:
    """Return what is not explained of a record whose errors are not known; "" if all is well."""
    size = float(np.median(np.abs(residuals)))
    if is_heard(record.kind):
        part = size / float(np.median(intervals(record.times)))
        what = "of the intervals between impacts"
    else:
        deviations = np.abs(record.values - np.median(record.values))
        # Of a record that hardly ever varies the median says nothing.
        spread = float(np.median(deviations)) or float(np.std(record.values))
        part = size / spread if spread else math.inf if size else 0.0
        what = "of its deviations from the median"
    if part <= _UNEXPLAINED:
        return ""
    if math.isinf(part):
        return f"{record.name} does not vary, and what is predicted is {size:.3g} off"
    many = f"{part:.0%}" if part < _OTHER_UNITS else f"{part:.3g} times the size"
    return f"the residuals of {record.name} are {many} {what}: little of it is explained"


def _verdict(reasons: list[_Reason]) -> Verdict:
    """Return the worst verdict of some reasons."""
    found = {verdict for verdict, _ in reasons}
    return next((verdict for verdict in _WORST_FIRST if verdict in found), "fits")


def _units(problem: Problem, found: Found | None) -> list[str]:
    """Return sentences on records that seem to be in other units than the machine."""
    said = [each for record in problem.records for each in _clocks(problem, record)]
    if found is None:
        return said
    for record, predicted in zip(problem.records, found.evaluation.predicted, strict=True):
        kept = predicted[np.isfinite(predicted)]
        if is_heard(record.kind):
            # The motion found may have no impacts in such times, or thousands: its period tells.
            theirs, period = (
                float(np.median(intervals(record.times))),
                problem.machine._usual_period,
            )
            off = np.abs(predicted - record.values[: len(predicted)])
            if len(off) and float(np.median(off)) < _UNEXPLAINED * theirs:
                continue
            if not 1.0 / _OTHER_UNITS < theirs / period < _OTHER_UNITS:
                said.append(
                    f"{record.name}: impacts follow each other after {theirs:.3g}, and a period of "
                    f"the machine is {period:.3g}: are they in other units?"
                )
            continue
        mine, theirs = float(np.std(kept)) if len(kept) else 0.0, float(np.std(record.values))
        if mine > 0.0 and theirs > 0.0 and not 1.0 / _OTHER_UNITS < theirs / mine < _OTHER_UNITS:
            said.append(
                f"{record.name} varies {theirs / mine:.3g} times as much as the machine's: is it "
                "in other units?"
            )
    return said


def _clocks(problem: Problem, record: Record) -> list[str]:
    """Return why times may be in other units, or the drive frequency in Hz."""
    machine, times = problem.machine, record.times
    said, period = [], machine._usual_period
    if not is_heard(record.kind) and len(record) > 1:
        apart, whole = float(np.median(np.diff(times))), float(times[-1] - times[0])
        if apart > period or whole < period / _OTHER_UNITS:
            said.append(
                f"the rows of {record.name} are {apart:.3g} apart, {whole:.3g} in all, and a "
                f"period of the machine is {period:.3g}: are the times in other units?"
            )
    drive, known = machine.drive_frequency, "drive_frequency" not in problem.unknowns.names
    if known and drive > 0.0 and _rhythm(record, drive) < _RHYTHM:
        others = [(2.0 * np.pi, "is it in Hz? 2 pi times that is meant")]
        others.append((0.5 / np.pi, "was it multiplied by 2 pi once too often?"))
        strength, by, meant = max((_rhythm(record, drive * by), by, meant) for by, meant in others)
        if strength > _RHYTHM:
            said.append(
                f"{record.name} goes with the frequency {drive * by:.6g}, and drive_frequency is "
                f"{drive:.6g}: {meant}"
            )
    return said


def _rhythm(record: Record, frequency: float) -> float:
    """Return which part of a record goes with a frequency, from 0 to 1; 0 of a short record."""
    turns = np.exp(1j * frequency * record.times)
    if len(turns) < _LEAST_RHYTHM or frequency * np.ptp(record.times) < _LEAST_TURNS * 2.0 * np.pi:
        return 0.0
    if is_heard(record.kind):
        return float(np.abs(turns.mean()))
    waves = np.column_stack([turns.real, turns.imag, np.ones(len(turns))])
    values = record.values / (np.abs(record.values).max() or 1.0)
    left = values - waves @ np.linalg.lstsq(waves, values, rcond=None)[0]
    spread = values - values.mean()
    return 1.0 - float(left @ left) / (float(spread @ spread) or 1.0)

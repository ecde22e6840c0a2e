"""The calls: a machine from records, and the errors that a measurement would leave."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..arguments import count, number, pair, reject, several
from ..errors import Interrupted, ParameterError, SimulationError
from ..interruption import interruptible
from ..machine import Machine
from ..machine_kinds import is_maker
from ..made import (
    Made,
    basis_of,
    check_names,
    defaults_of,
    is_coordinate,
    machine_made,
    of_start,
    varied,
)
from ..run_record import AnyRun
from ..scales import Scales, Units
from ..showing import counted
from ..simulation import simulated
from ..stop import numbered
from .determined import ExpectedErrors
from .judgement import judged
from .measuring import need_run
from .minimum import Found
from .prediction import kinds_in_words, kinds_of, sizes_in
from .problem import Point, Problem, Window
from .profile import LOWER, bent, rises
from .record import Record, is_heard
from .result import Fit
from .rivals import is_better, is_one, is_settled, with_rivals
from .search import Search
from .sigmas import estimated, first_sigmas
from .statistics import LOSSES, determination
from .unknowns import START, Unknowns, named, unknowns_of

Array = NDArray[np.float64]

# Drive periods, or periods 2 pi of the second body, that a record may last.
_LONGEST = 20_000
# Rounds in which unknown standard errors are estimated, until they change by less.
_MOST_ROUNDS, _STEADY = 6, 0.01
# Part of the size of a number by which it is changed to see whether units change, and how much they
# may by rounding.
_SHARE, _ALIKE = 1e-3, 1e-12
# Part of a period of a run that only looks whether there can be one.
_MOMENT = 1e-9
# Periods of the first motion that tell the sizes of the coordinates.
_SOON = 20.0
# Draws of a start of which a function makes no machine.
_MOST_DRAWS = 50
# Times that a search goes on from a lower minimum beside the one that it has found.
_MOST_LOWER = 4
# Parts of the ranges or sizes in which starts of the search are drawn, one after another.
_PARTS = (1.0, 0.1, 0.3, 0.02)
# From this part on phases are drawn anywhere: of an angle a guess that is wrong says little.
_FAR = 0.3
_RANGE = "(low, high), two numbers with low < high"
# Starts of the search at most.
_MOST_STARTS = 1000


@interruptible
def fit(
    record: Record | Sequence[Record],
    system: Machine | Callable[..., Any],
    *,
    unknown: Sequence[str] | Mapping[str, tuple[float, float] | None],
    initial: ArrayLike,
    loss: str = "linear",
    starts: int = 10,
    seed: int = 0,
    units: Units | None = None,
) -> Fit:
    """Find numbers of a machine from a record of its motion, by least squares.

    Derivatives are exact, through impacts too. The motion is cut into segments where small
    differences grow (multiple shooting), and the part of the record that is fitted grows from its
    start, so that chaotic and long records can be fitted.

    Parameters
    ----------
    record
        What was measured, or several records of the same motion.
    system
        The System or Structure, with first guesses of what is unknown and all other numbers as they
        are. Or a function of named numbers that makes one: first guesses are its defaults, or the
        middles of the ranges.
    unknown
        Names of what is looked for: numbers of the system, of its stops (``"gap_0"``), or of the
        function, and coordinates of the start (``"x1"``, ``"v1"``, ``"x2"``, ``"v2"``, of a
        structure ``"q_0"``, ``"v_0"`` ...; ``"start"`` for all of them). Or a mapping from names to
        ranges (low, high), None for those that nature sets.
    initial
        The start at t = 0, as in ``simulate``, with first guesses of what is unknown.
    loss
        ``"linear"``, least squares; or what bears outliers: ``"huber"``, ``"soft_l1"``,
        ``"cauchy"``, with constants for 95 % efficiency at normal errors (``"soft_l1"`` between).
    starts
        How many starts of the search are tried, until one fits with residuals that are not
        improbably large and errors that are linear ones: the first guesses; these once more, with
        the first rows leading, each within its error before the next ones count; for times of
        impacts from values with which the motion has as many, one for each; then random ones, in
        the ranges or, where there are none, around the guesses and the best so far; phases anywhere
        in their ranges.
    seed
        Of the random starts.
    units
        ``"SI"``: records and ``initial`` are in s, rad, m and their quotients, and the system has
        scales. The numbers of the system, and all of the result, stay dimensionless; those of a
        function are what they are in it. Its units of length and time are to stay the same.

    Returns
    -------
    Fit
        Values with standard errors and correlations, what stays undetermined, and a verdict
        whether the model fits.

    Raises
    ------
    ParameterError
        If an argument is out of range; of a record it names the row.
    StateError
        If the start is not finite, or the bodies overlap in it.
    SimulationError
        If no motion from the start can be computed or differentiated.
    Interrupted
        After Ctrl-C; ``.result`` is the best Fit of the starts tried so far, or None.

    Examples
    --------
    >>> import vibroimpact as vi
    >>> system = vi.System(mass_ratio=0.6, frequency_ratio=2, restitution=0.8, gap=0.5,
    ...                    drive_frequency=1.8, moment_amplitude=1, friction=0.2)
    >>> run = vi.simulate(system, initial=(0, 0.5, 0, 0), periods=30)
    >>> record = vi.measure(run, "impact_times", noise=0.001)
    >>> guess = system.replace(restitution=0.6, friction=0.4)
    >>> found = vi.fit(record, guess, unknown=["restitution", "friction"], initial=run.initial)
    >>> found.verdict, round(found.values["restitution"], 2), round(found.values["friction"], 2)
    ('fits', 0.8, 0.2)
    """
    records = _records(record)
    machine = _machine(system, unknown)
    start = np.array(machine._one_start(initial)).ravel()
    scales = machine._chosen(units)
    if scales is not None:
        records = [record._in_units_of(scales) for record in records]
        start = scales.from_si(start)
    unknowns = unknowns_of(unknown, machine, start)
    _check_scales(machine, start, unknowns, scales)
    _check_records(records, machine)
    if not isinstance(loss, str) or loss not in LOSSES:
        reject("loss", loss, ", ".join(map(repr, LOSSES)))
    starts = count("starts", starts, least=1, most=_MOST_STARTS)
    random = np.random.default_rng(count("seed", seed, least=0))
    problem = Problem(machine, start, unknowns, records)
    _check_start(problem)
    given = unknowns.values_of(machine, start)
    problem = _sized(problem, given)
    hears = any(is_heard(each.kind) for each in records)
    best: Fit | None = None
    tried: list[Fit] = []
    try:
        for turn in range(starts):
            if turn < 2:
                values = given
            elif turn == 2 and hears:
                values = _in_order(problem, given, loss)
            else:
                # Near the best one, and near the first guesses, in turn: a search often ends beside
                # the right minimum, at the border of another sequence of impacts.
                around = given if turn % 2 == 0 or best is None else best.estimates
                values = _drawn(problem, around, _PARTS[turn % len(_PARTS)], random)
            found, *others = _fitted(problem, values, loss, slow=turn == 1)
            tried += [found, *others]
            if best is None or is_better(found, best):
                best = found
            if is_settled(found):
                break
    except (Interrupted, KeyboardInterrupt) as stopped:
        held = "nothing" if best is None else "the best fit so far"
        raise Interrupted("interrupted while fitting", best, holds=held) from stopped
    assert best is not None
    best = with_rivals(best, tried)
    _need_scales(best.machine, scales)
    if not is_one(best):
        many = counted(starts, "search", ending="es")
        advice = f"this is the best of {many}; starts={min(5 * starts, _MOST_STARTS)} makes more"
        best = replace(best, reasons=(*best.reasons, advice))
    if not best and scales is None and machine._not_in_si:
        best = replace(best, reasons=(*best.reasons, machine._not_in_si))
    return best


@interruptible
def expected_errors(
    run: AnyRun,
    record: Record | Sequence[Record],
    *,
    unknown: Sequence[str] | Mapping[str, tuple[float, float] | None],
    system: Callable[..., Any] | None = None,
) -> ExpectedErrors:
    """Return the standard errors that a measurement would leave, before it is made.

    They come from the Fisher matrix: the derivatives of what would be measured.

    Parameters
    ----------
    run
        The motion that would be measured.
    record
        The plan: records with times and ``sigma``, as ``measure`` with ``noise`` makes them; the
        values do not matter.
    unknown
        What would be looked for, as in ``fit``.
    system
        A function of named numbers that makes the machine of the run, for unknowns among them: at
        its defaults, or the middles of the ranges.

    Returns
    -------
    ExpectedErrors

    Raises
    ------
    ParameterError
        If an argument is out of range, or a record has no ``sigma``.

    Examples
    --------
    >>> import vibroimpact as vi
    >>> system = vi.System(mass_ratio=0.6, frequency_ratio=2, restitution=0.8, gap=0.5,
    ...                    drive_frequency=1.8, moment_amplitude=1)
    >>> run = vi.simulate(system, initial=(0, 0.5, 0, 0), periods=20)
    >>> plan = vi.measure(run, "x1", noise=0.01, sampling=0.2)
    >>> errors = vi.expected_errors(run, plan, unknown=["restitution", "gap"]).errors
    >>> errors["restitution"] < 0.01
    True
    """
    need_run(run)
    records = _records(record)
    for place, each in enumerate(records):
        if each.sigma is None:
            reject(f"record[{place}]", each, "a record with sigma")
    start = np.array(run.initial, dtype=np.float64).ravel()
    machine = run.system
    if system is not None:
        machine = _machine(system, unknown)
        if machine != run.system:
            reject("system", system, "a function whose defaults make the machine of the run")
    unknowns = unknowns_of(unknown, machine, start)
    _check_records(records, machine)
    problem = Problem(machine, start, unknowns, records)
    sigmas = [each.sigma for each in records if each.sigma is not None]
    search = Search(problem, sigmas, "linear")
    values = unknowns.values_of(machine, start)
    end = max(float(each.times[-1]) for each in records)
    window = Window((0.0,), max(end, 1e-9))
    point = Point(values, np.zeros((0, len(start))))
    evaluation = problem.evaluate(point, window)
    if evaluation is None or evaluation.missing:
        reject("record", record, "times of impacts, and times, that this motion has")
    found = Found(point, window, evaluation, 0.0, True, True, 0)
    search.take_sizes(values, evaluation)
    search.expect(found)
    derived = search.along(found)
    if derived is None:
        raise ParameterError(
            "the run has an event at which derivatives do not exist, such as a graze; no errors "
            "can be expected of it"
        )
    sizes = search.problem.unknowns.scales
    known = determination(derived.derivative, derived.changes, sizes, 1.0)
    return ExpectedErrors(
        names=unknowns.names,
        estimates=values,
        covariance=known.covariance,
        standard_errors=known.errors,
        sizes=sizes.copy(),
        combinations=known.open,
        combination_errors=known.open_errors,
        rows=sum(map(len, records)),
    )


def _records(given: Any) -> list[Record]:
    """Return one record, or several, as a list."""
    if isinstance(given, bytes | bytearray):  # a sequence of numbers to Python
        reject("record", given, "a vibroimpact.Record or a sequence of them")
    return several("record", given, Record)


def _machine(system: Any, unknown: Any) -> Any:
    """Return the machine with its first guesses; that of a function remembers it."""
    if not is_maker(system):
        if not isinstance(system, Machine):
            reject("system", system, "a System, a Structure, or a function that makes one")
        return system
    guesses = defaults_of(system)
    numbers: dict[str, float] = {}
    given = named(unknown, ", ".join(guesses))
    own = [each for each in given if each[0] != START and not is_coordinate(each[0])]
    check_names(system, [name for name, _ in own], least=False)
    for name, _ in given:
        if is_coordinate(name) and name in guesses:
            allowed = f"another name for this argument of the function: {of_start(name)}"
            reject("unknown", name, allowed)
    for name, limits in own:
        if limits is not None:
            low, high = (number(f"unknown[{name!r}]", each) for each in pair(name, limits, _RANGE))
        value = guesses.get(name)
        if value is None:
            if limits is None:
                reject(f"unknown[{name!r}]", None, f"{_RANGE}, or a default in the function")
            value = 0.5 * (low + high)
        numbers[name] = number(name, value)
    check_names(system, [*numbers])
    return machine_made(system, numbers, {name: abs(value) for name, value in numbers.items()})


def _check_scales(machine: Any, start: Array, unknowns: Unknowns, scales: Scales | None) -> None:
    """Refuse numbers of a function that change the units in which the record is."""
    if scales is None or not isinstance(machine, Made):
        return
    given = unknowns.values_of(machine, start)
    for place, name in enumerate(unknowns.names[: unknowns.machine]):
        step = _SHARE * unknowns.scales[place]
        for value in given[place] + np.array([-step, step]):
            inside = float(np.clip(value, unknowns.low[place], unknowns.high[place]))
            try:
                changed = varied(machine, {name: inside})
            except ParameterError:  # beyond the end of its range
                continue
            _need_scales(changed, scales, name)


def _need_scales(machine: Any, scales: Scales | None, name: str = "") -> None:
    """Refuse a machine whose units of length and time are others."""
    if scales is None:
        return
    own = machine.scales
    pairs = [(scales.length, own.length), (scales.time, own.time)] if own else [(1.0, 0.0)]
    if not all(math.isclose(one, two, rel_tol=_ALIKE) for one, two in pairs):
        reject(
            "units",
            "SI",
            "None where the numbers of a function change the units of length and time"
            + (f", as {name} does" if name else ""),
        )


def _check_start(problem: Problem) -> None:
    """Refuse a start that overlaps, and what no run can be differentiated by."""
    machine, unknowns = problem.machine, problem.unknowns
    start = problem.initial.reshape(machine._starts_shape)
    run = simulated(machine, initial=start, time=_MOMENT * machine._usual_period)
    basis = basis_of(machine, unknowns.names[: unknowns.machine])
    basis.with_coordinates(unknowns.names[unknowns.machine :]).of(run)


def _sized(problem: Problem, values: Array) -> Problem:
    """Return the problem with the sizes of coordinates in the motion at the first guesses."""
    machine, initial = problem.machine, problem.initial
    end = max(float(each.times[-1]) for each in problem.records)
    period = machine._usual_period
    try:
        run = simulated(
            machine,
            initial=initial.reshape(machine._starts_shape),
            time=min(max(end, _MOMENT * period), _SOON * period),
        )
    except SimulationError:  # the search tells
        return problem
    sizes = sizes_in([run], initial)
    return replace(problem, unknowns=problem.unknowns.sized(values, sizes))


def _check_records(records: list[Record], system: Machine) -> None:
    """Refuse kinds that the machine does not have, and times that cannot be meant."""
    kinds = kinds_of(system)
    longest = _LONGEST * system._usual_period
    for place, record in enumerate(records):
        where = f"record[{place}]" if len(records) > 1 else "record"
        if record.kind not in kinds:
            reject(f"{where}.kind", record.kind, kinds_in_words(system), known=kinds)
        late = np.flatnonzero(record.times > longest)
        if len(late):
            row = int(late[0])
            raise ParameterError(
                f"{where}.times[{row}] = {record.times[row].item()!r} is not allowed; allowed: "
                f"times up to {longest:.6g}, {_LONGEST} periods of {system._usual_period:.6g}: is "
                "the record in other units?"
            )


def _drawn(problem: Problem, around: Array, part: float, random: np.random.Generator) -> Array:
    """Return random values to start from: in part of the ranges, or of the sizes, around some."""
    unknowns = problem.unknowns
    finite = np.isfinite(unknowns.low) & np.isfinite(unknowns.high)
    width = part * np.where(finite, unknowns.high - unknowns.low, 2.0 * unknowns.scales)
    if part >= _FAR:
        kinds = [one.what if (one := numbered(name)) else name for name in unknowns.names]
        width = np.where(np.array(kinds) == "phase", np.maximum(width, 2.0 * np.pi), width)
    for _ in range(_MOST_DRAWS):
        drawn = around + width * (random.random(len(around)) - 0.5)
        # Beyond an end of a range they are mirrored: there would be too many at the end itself.
        drawn = np.where(drawn < unknowns.low, 2.0 * unknowns.low - drawn, drawn)
        drawn = np.where(drawn > unknowns.high, 2.0 * unknowns.high - drawn, drawn)
        inside: Array = np.clip(drawn, unknowns.low, unknowns.high)
        try:
            unknowns.machine_of(problem.machine, inside)
        except ParameterError:  # a function makes no machine there
            continue
        return inside
    return around


def _in_order(problem: Problem, values: Array, loss: str) -> Array:
    """Return values that fit if each impact of a record is the next one of the motion.

    Nothing is skipped then, so a guess with which impacts come far too early or late, and too many
    of them, is led to the right number.
    """
    ordered = replace(problem, in_order=True)
    found = Search(ordered, first_sigmas(problem.records), loss, slow=True).run(values)
    return values if found is None else found.point.values


def _fitted(problem: Problem, values: Array, loss: str, slow: bool) -> list[Fit]:
    """Return the fit of one start of the search, with its verdict, and those found beside it."""
    sigmas = first_sigmas(problem.records)
    search = Search(problem, sigmas, loss, slow)
    found = search.run(values)
    for _ in range(_MOST_ROUNDS):
        if found is None:
            break
        better = estimated(search, found, sigmas)
        if better is None:
            break
        changes = [
            float(np.abs(new / old - 1.0).max()) for new, old in zip(better, sigmas, strict=True)
        ]
        sigmas = better
        found = search.again(found, sigmas)
        if max(changes) < _STEADY:
            break
    if found is not None:
        search.take_sizes(found.point.values, found.evaluation)
    fit = judged(search, found, values)
    passed: list[Fit] = []
    for _ in range(_MOST_LOWER):
        if found is None or fit.verdict != "fits" or loss != "linear":
            break
        way = rises(search, found, fit)
        beside = [search.again(each, search.base) for each in way.beyond]
        others = [each for each in beside if each is not None]
        deeper = min(others, key=lambda each: each.cost, default=found)
        if deeper.cost > found.cost - LOWER:
            fit = replace(
                fit,
                profile=way.profile,
                covariance=fit.covariance * way.wider[:, None] * way.wider,
                standard_errors=fit.standard_errors * way.wider,
                reasons=(*fit.reasons, *bent(fit.names, way.profile)),
            )
            return [fit, *passed, *(judged(search, each, values) for each in others)]
        passed.append(fit)
        found = deeper
        search.take_sizes(found.point.values, found.evaluation)
        fit = judged(search, found, values)
    return [fit, *passed]

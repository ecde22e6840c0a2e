"""One case against high precision: its largest error, in units of what docs/accuracy.md allows.

The reference is vibroimpact.reference (ball arithmetic, no code shared with the core). A case
is looked at on `SAMPLES` equal steps; by step k a state may differ by

    100 eps max(1, A_k, max over j < k of A_k/A_j),   relative to max(1, |value|),

A_k being the growth of a small perturbation of v1(0); an impact's time by 1/min(1, u) of that,
relative to max(1, time). A_k sees one direction only. Where the bound is exceeded, the growth of
a relative perturbation of any coordinate, made at the start or at any step, takes the place of A:
what is left then is wrong, the rest merely ill-conditioned. All quantities are dimensionless.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import StrEnum

import numpy as np
from flint import arb
from numpy.typing import NDArray

import vibroimpact as vi
from vibroimpact.reference.contact import Undecided
from vibroimpact.reference.flight import System as ExactSystem
from vibroimpact.reference.flight import exact
from vibroimpact.reference.hybrid import Run as ExactRun
from vibroimpact.reference.hybrid import follow
from vibroimpact.reference.slide import Settings
from vibroimpact.system import SYMBOLS

EPS = float(np.finfo(np.float64).eps)
ALLOWED = 100 * EPS
SAMPLES = 6
MOST_IMPACTS = 8
NUDGE = exact("1e-30")
# Bits tried one after the other: after a bounce with r = 1e-16 the gap is as small as r^2.
SETTINGS = (Settings(precision=400), Settings(precision=1200))

State = tuple[float, float, float, float]


class Outcome(StrEnum):
    """What became of a case."""

    WITHIN = "within"
    ILL_CONDITIONED = "ill-conditioned"
    STOPPED = "typed stop"
    EARLY = "stops early"
    WRONG = "wrong"
    UNDECIDED = "no reference"


# None of these where a range is said to hold.
BROKEN = (Outcome.WRONG, Outcome.EARLY)


@dataclass(frozen=True)
class Case:
    """A system, a start with g < 0, and the length of the run."""

    system: vi.System
    initial: State
    time: float


@dataclass(frozen=True)
class Verdict:
    """Outcome, error in units of the bound (with A, and with all directions), and why."""

    outcome: Outcome
    units: float = float("nan")
    conditioned: float = float("nan")
    detail: str = ""
    impacts: int = 0


def reference_system(system: vi.System) -> ExactSystem:
    """Return the same system for the reference, every double taken for its exact value."""
    values = {short: getattr(system, name) for short, name in SYMBOLS.items()}
    return ExactSystem.parse(values, system.contact)


def shortened(case: Case, most: int = MOST_IMPACTS) -> Case:
    """Return the case with an end soon after so many impacts, to keep the reference cheap."""
    try:
        run = vi.simulate(
            case.system, initial=case.initial, time=case.time, max_events=4 * most + 8
        )
    except vi.SimulationError:
        return case
    times = run.impacts["time"]
    if len(times) > most:
        return replace(case, time=float(0.4 * times[most - 1] + 0.6 * times[most]))
    if run.stop_reason == "event_cap":
        return replace(case, time=0.9 * run.final_state.time)
    return case


def judge(case: Case) -> Verdict:
    """Run a case in both ways and compare."""
    try:
        run = vi.simulate(case.system, initial=case.initial, time=case.time)
    except vi.SimulationError as error:
        return Verdict(Outcome.WRONG, detail=f"SimulationError: {error}")
    times = np.linspace(0.0, case.time, SAMPLES + 1)[1:]
    times[-1] = case.time
    try:
        plain = _follow(case, case.initial, times)
    except (Undecided, RuntimeError, ValueError, ZeroDivisionError) as doubt:
        return Verdict(Outcome.UNDECIDED, detail=f"{type(doubt).__name__}: {doubt}")
    if plain.ending == "painleve" and case.system.friction == 0 < case.system.mass_ratio:
        # mbar + cos^2 x1 > 0: the reference's steps have become too short, no more.
        return Verdict(Outcome.UNDECIDED, detail="too short steps in contact")
    goes_on = ("completed", "rest")
    if run.stop_reason not in goes_on or plain.ending not in goes_on:
        # Both see that no motion fits; which of two reasons comes first is a matter of rounding.
        outcome = Outcome.WRONG
        if run.stop_reason not in goes_on:
            outcome = Outcome.EARLY if plain.ending in goes_on else Outcome.STOPPED
        return Verdict(outcome, detail=f"{run.stop_reason}, reference {plain.ending}")
    if len(plain.samples) != SAMPLES:
        return Verdict(Outcome.UNDECIDED, detail="the reference ends early")
    states = np.array([[float(x) for x in state] for state in plain.samples])
    error = np.abs(run.trajectory(times) - states)
    # What goes on into the rest of a longer run need not be what `trajectory` computes anew.
    error[-1] = np.maximum(error[-1], np.abs(run.final_state.state - states[-1]))
    if not np.isfinite(error).all():
        return Verdict(Outcome.WRONG, detail="not finite")
    try:
        late, difference = _times(run, plain)
        moved = _columns(case, times, plain, [1])[1]
        growth = np.abs(moved).max(axis=1)
        bound = np.maximum(1.0, np.maximum(growth, growth / np.minimum.accumulate(growth)))
        units = _units(error, states, bound[:, None], late, times)
        if units <= 1 and not difference:
            return Verdict(Outcome.WITHIN, units, detail=difference, impacts=len(run.impacts))
        bound = _conditioning(case, times, plain, states)
    except (Undecided, RuntimeError, ValueError, ZeroDivisionError) as doubt:
        return Verdict(Outcome.UNDECIDED, detail=f"{type(doubt).__name__}: {doubt}")
    conditioned = _units(error, states, bound, late, times)
    good = conditioned <= 1 and not difference
    outcome = Outcome.ILL_CONDITIONED if good else Outcome.WRONG
    return Verdict(outcome, units, conditioned, difference, len(run.impacts))


def _follow(case: Case, initial: Sequence[object], times: NDArray[np.float64]) -> ExactRun:
    values = [arb(exact(float(time))) for time in times]
    system = reference_system(case.system)
    for settings in SETTINGS:
        try:
            return follow(
                system, initial, lambda: values, phase=case.system.phase, settings=settings
            )
        except Undecided:
            if settings == SETTINGS[-1]:
                raise
    raise AssertionError


def _times(run: vi.Run, plain: ExactRun) -> tuple[NDArray[np.float64], str]:
    """Rows (time, error times min(1, u)) of the impacts, and how the sequences differ, if they do.

    Where contact lasts the reference does not list the impacts of a chatter: states must do.
    """
    if plain.phases or len(run.contacts):
        return np.empty((0, 2)), ""
    ours, theirs = run.impacts, plain.hits
    if len(ours) != len(theirs):
        end = run.final_state.time
        extra = [float(hit.time) for hit in theirs[len(ours) :]] or ours["time"][len(theirs) :]
        if min(extra) >= end - 16 * EPS * max(1.0, end):
            raise Undecided("impacts within rounding of the end")
        return np.empty((0, 2)), f"{len(ours)} impacts, not {len(theirs)}"
    rows = []
    for a, b in zip(ours, theirs, strict=True):
        name = vi.Regime(a["regime"]).name.lower()
        if name != b.regime:
            return np.empty((0, 2)), f"{name}, not {b.regime}"
        cos = np.cos(a["x1"]) if run.system.contact == "oblique" else 1.0
        u = a["v1_pre"] * cos - a["v2_pre"]
        rows.append((a["time"], abs(float(arb(exact(float(a["time"]))) - b.time)) * min(1.0, u)))
    return np.array(rows).reshape(-1, 2), ""


def _units(
    error: NDArray[np.float64],
    states: NDArray[np.float64],
    bound: NDArray[np.float64],
    late: NDArray[np.float64],
    times: NDArray[np.float64],
) -> float:
    """The largest error in units of 100 eps bound max(1, |value|)."""
    bound = np.broadcast_to(bound, error.shape)
    worst = float((error / (bound * np.maximum(1.0, np.abs(states)))).max())
    for time, wrong in late:
        k = min(int(np.searchsorted(times, time)), len(times) - 1)
        worst = max(worst, wrong / (bound[k].max() * max(1.0, time)))
    return worst / ALLOWED


def _columns(
    case: Case, times: NDArray[np.float64], plain: ExactRun, which: Sequence[int]
) -> dict[int, NDArray[np.float64]]:
    """Growth of a perturbation of coordinate i of the start, by i: states at the steps."""
    found = {}
    for i in which:
        start = [exact(value) for value in case.initial]
        start[i] += NUDGE
        moved = _follow(case, start, times)
        if len(moved.samples) != len(plain.samples):
            raise RuntimeError("the perturbed motion ends elsewhere")
        found[i] = np.array(
            [
                [float((p - q) / arb(NUDGE)) for p, q in zip(a, b, strict=True)]
                for a, b in zip(moved.samples, plain.samples, strict=True)
            ]
        )
    return found


def _conditioning(
    case: Case, times: NDArray[np.float64], plain: ExactRun, states: NDArray[np.float64]
) -> NDArray[np.float64]:
    """How much of a relative perturbation at any earlier step is left, in units of each value.

    With M_k the derivative of the state at step k, that is |M_k M_j^+| max(1, |state_j|).
    """
    wall = case.system.mass_ratio == 0 and case.system.force_amplitude == 0
    which = [0, 1] if wall and case.initial[2:] == (0.0, 0.0) else [0, 1, 2, 3]
    columns = _columns(case, times, plain, which)
    identity = np.eye(4)[:, which]
    matrices = [identity, *np.stack([columns[i] for i in which], axis=-1)]
    sizes = np.maximum(1.0, np.abs(np.vstack([case.initial, states])))
    bound = np.ones((len(times), 4))
    for k in range(1, len(matrices)):
        for j in range(k):
            left = np.abs(matrices[k] @ np.linalg.pinv(matrices[j], rcond=1e-13))
            bound[k - 1] = np.maximum(bound[k - 1], left @ sizes[j] / sizes[k])
    return bound

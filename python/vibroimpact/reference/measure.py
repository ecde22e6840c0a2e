"""Stated errors and amplification of a whole run (hybrid.py), each from a second run.

Error: the run is repeated with finer settings; the difference, and what both runs state for their
own steps, is the radius of every value. Amplification, as on the accuracy page: the growth of a
perturbation of v1(0) by 1e-30, in the maximum norm of a state, or of the time and state of a phase.
At a start with g = u = 0, v2(0) is perturbed alike, which keeps u = 0. Dimensionless.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from flint import arb, ctx

from .flight import Number, State, System, exact
from .hold import Phase
from .hybrid import FINER, Run, approach_in_contact, follow

#: Size of the perturbation: far above the errors, far below all scales of the motion.
NUDGE = exact("1e-30")
#: Differences below this may come from the errors of the runs, 1e-43 at most.
_UNSEEN = 1e-41


@dataclass(frozen=True)
class Measured:
    """A run with its errors as radii, and its amplification per phase and per sample."""

    run: Run
    error: arb
    phase_growth: list[float]
    sample_growth: list[float]


def measured(
    system: System,
    initial: Sequence[Number],
    times: Callable[[], Sequence[arb]],
    *,
    phase: Number = 0,
) -> Measured:
    """Run three times: as it is, finer, and perturbed.

    Raises AssertionError if they differ in their sequence of phases; else as `hybrid.follow`.
    """
    plain = follow(system, initial, times, phase=phase)
    finer = follow(system, initial, times, phase=phase, settings=FINER)
    start = [exact(value) for value in initial]
    touching = approach_in_contact(system, start) == 0
    start[1] += NUDGE
    if touching:
        start[3] += NUDGE
    moved = follow(system, start, times, phase=phase)
    for other in (finer, moved):
        assert [p.event for p in plain.phases] == [p.event for p in other.phases]
        assert (plain.ending, len(plain.samples)) == (other.ending, len(other.samples))
    with ctx.workprec(FINER.precision):
        phases = [_merged(p, q) for p, q in zip(plain.phases, finer.phases, strict=True)]
        samples = [_state(one, two) for one, two in zip(plain.samples, finer.samples, strict=True)]
        worst = arb(0)
        for values in (*(_values(p) for p in phases), *samples):
            for value in values:
                worst = worst.max(value.rad())
        merged = Run(phases, samples, plain.ending, plain.impacts)
        return Measured(
            merged,
            worst,
            [_growth(_values(p), _values(q)) for p, q in zip(phases, moved.phases, strict=True)],
            [_growth(p, q) for p, q in zip(samples, moved.samples, strict=True)],
        )


def _together(one: arb, two: arb) -> arb:
    """The finer value with a radius that includes the other one."""
    return arb(two.mid(), (abs(one - two) + two.rad()).abs_upper())


def _state(one: State, two: State) -> State:
    """Finer values with radii, for all coordinates."""
    x1, v1, x2, v2 = (_together(p, q) for p, q in zip(one, two, strict=True))
    return x1, v1, x2, v2


def _merged(one: Phase, two: Phase) -> Phase:
    """Finer values with radii, for a phase."""
    forces: list[arb | None] = [
        None if p is None or q is None else _together(p, q)
        for p, q in ((one.normal, two.normal), (one.friction, two.friction))
    ]
    return Phase(two.event, _together(one.time, two.time), _state(one.state, two.state), *forces)


def _values(phase: Phase) -> tuple[arb, ...]:
    """Time and state."""
    return phase.time, *phase.state


def _growth(one: Sequence[arb], two: Sequence[arb]) -> float:
    """Largest difference in units of the perturbation, to three digits; 0 if it is not seen."""
    worst = max(float(abs(p.mid() - q.mid())) for p, q in zip(one, two, strict=True))
    return float(f"{worst / float(NUDGE):.3g}") if worst > _UNSEEN else 0.0

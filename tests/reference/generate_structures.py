"""Writes the reference data of structures: tests/data/structures_reference.json.

    python -m reference.regenerate structures_reference.json --write     (in tests)

Inputs are float64; the reference values belong to exactly those floats. Format:
tests/data/README.md. Cases: structure_cases.py. Units are those of the structure.
"""

from __future__ import annotations

import random
from collections.abc import Iterable
from fractions import Fraction
from typing import Any

from flint import arb, ctx

from vibroimpact.reference.structure import Change, Impact, Structure, StructureRun
from vibroimpact.reference.structure import simulate_structure as simulate

from .generate_contact import text
from .structure_cases import Case

NAME = "structures_reference.json"
#: A stated error of more than this, or more growth, is no reference.
LARGEST_ERROR, LARGEST_GROWTH = 1e-28, 1e6
#: Size and number of the perturbations by which the growth is measured.
PERTURBATION, DIRECTIONS = Fraction(1, 10**18), 3
DIED_OUT = 1e-9


def case_record(case: Case) -> dict[str, Any]:
    """One case of the file."""
    run = followed(case, case.initial)
    moved = [followed(case, start) for start in perturbed(case)]
    for other in moved:
        if told(other) != told(run):
            raise ArithmeticError(f"a perturbation changes the events: {case}")
    with ctx.workprec(run.precision):
        error = max((float(value.rad()) for value in all_values(run)), default=0.0)
        growth = [
            largest(numbers(entry), [numbers(other.story[place]) for other in moved])
            for place, entry in enumerate(run.story)
        ]
        sampled = [
            largest([*state[0], *state[1]], [[*s[0], *s[1]] for s in (o.states[k] for o in moved)])
            for k, state in enumerate(run.states)
        ]
        if not error < LARGEST_ERROR or max([0.0, *growth, *sampled]) > LARGEST_GROWTH:
            raise ArithmeticError(f"error {error}, amplification {growth}, {sampled}: {case}")
        return {
            **case.values,
            "initial": list(case.initial),
            "periods": case.periods,
            "times": list(case.times),
            "ending": run.ending,
            "error": f"{error:.1e}",
            "story": [
                entry_record(entry) | {"amplification": rounded(factor)}
                for entry, factor in zip(run.story, growth, strict=True)
            ],
            "states": [[texts(part) for part in state] for state in run.states],
            "amplification": [rounded(factor) for factor in sampled],
        }


def followed(case: Case, initial: Any) -> StructureRun:
    """The motion of a case from a start."""
    structure = Structure.parse(case.values)
    if case.periods is None:
        return simulate(structure, initial, times=case.times)
    return simulate(structure, initial, periods=case.periods)


def perturbed(case: Case) -> list[list[list[Fraction]]]:
    """Starts beside that of a case."""
    draw = random.Random(11)
    moves = range(len(case.initial[0])) if case.moves is None else case.moves

    def moved(values: list[float]) -> list[Fraction]:
        sizes = [PERTURBATION * (i in moves) for i in range(len(values))]
        by = [size * Fraction(draw.uniform(-1.0, 1.0)) for size in sizes]
        return [Fraction(x) + change for x, change in zip(values, by, strict=True)]

    return [[moved(part) for part in case.initial] for _ in range(DIRECTIONS)]


def told(run: StructureRun) -> list[tuple[Any, ...]]:
    """What happens in a run, without its numbers."""
    return [(entry_record(entry)["kind"], entry.stop) for entry in run.story] + [(run.ending,)]


def numbers(entry: Impact | Change) -> list[arb]:
    """What the growth of an entry is measured on."""
    if isinstance(entry, Change):
        return [entry.time, *entry.state[0], *entry.state[1]]
    return [entry.time, *entry.q, *entry.v_pre, *entry.v_post]


def all_values(run: StructureRun) -> Iterable[arb]:
    """All numbers of a run."""
    for entry in run.story:
        yield from numbers(entry)
    for q, v in run.states:
        yield from (*q, *v)


def largest(values: list[arb], others: list[list[arb]]) -> float:
    """By how much a perturbation has grown."""
    changes = (
        abs(float((value - moved).mid()))
        for other in others
        for value, moved in zip(values, other, strict=True)
    )
    return max(changes) / float(PERTURBATION)


def rounded(factor: float) -> float:
    """Three digits; 0 of what has died out, since the rest is the perturbation's own error."""
    return float(f"{factor:.3g}") if factor > DIED_OUT else 0.0


def texts(values: Iterable[arb]) -> list[str | None]:
    """25 digits of each."""
    return [text(value) for value in values]


def entry_record(entry: Impact | Change) -> dict[str, Any]:
    """One impact or change of the file."""
    if isinstance(entry, Change):
        q, v = entry.state
        head = {"kind": entry.kind, "time": text(entry.time), "stop": entry.stop}
        return {**head, "q": texts(q), "v": texts(v)}
    return {
        "kind": "impact",
        "time": text(entry.time),
        "stop": entry.stop,
        "q": texts(entry.q),
        "v_pre": texts(entry.v_pre),
        "v_post": texts(entry.v_post),
        "approach_velocity": text(entry.approach_velocity),
        "impulse_normal": text(entry.impulse_normal),
        "impulse_tangential": text(entry.impulse_tangential),
        "energy_loss": text(entry.energy_loss),
        "regime": entry.regime,
    }

"""Writes the derivatives of structures' runs: tests/data/structure_sensitivity_reference.json.

    python -m reference.regenerate structure_sensitivity_reference.json --write     (in tests)

Derivatives of runs of structures by numbers of their stops, drive and loads, entries of their
matrices and the start, as central differences of two runs of the reference simulator that differ by
2 H in one number: their error is that of third derivatives times H^2/6, and that of runs over H.
Inputs are float64. Format: tests/data/README.md. Cases: structure_cases.py, those whose neighbours
move alike.
"""

from __future__ import annotations

import copy
from collections.abc import Iterator
from fractions import Fraction
from typing import Any

from flint import arb, ctx

from vibroimpact.reference.structure import Structure, StructureRun
from vibroimpact.reference.structure import simulate_structure as simulate

from .structure_cases import CASES, Case

NAME = "structure_sensitivity_reference.json"
#: Half the distance of the two numbers, and the digits that are left.
H = Fraction(1, 10**25)
DIGITS = 20
#: Number of the impact that is told, at most: in chatter all come one after another.
IMPACT = 5
#: Most drive periods.
PERIODS = 3
#: Cases whose neighbours meet the same stops in the same order.
SCENES = [
    *("coupled_damping", "free_body_on_a_damper", "chatter_and_contact"),
    *("chatter_on_a_moving_stop", "two_closed_stops", "corner_together", "slide_and_stick"),
    *("chatter_with_friction", "friction_poisson", "friction_newton", "friction_energetic"),
    "six_masses",
]
_OF_STOPS = ("gap", "restitution", "friction", "amplitude", "phase")


def names(case: Case) -> Iterator[str]:
    """What a run is differentiated by: one number of each kind, not what ends its range."""
    values = case.values
    count = len(values["mass"])
    yield from ("drive_frequency", "static_load[0]")
    if "drive_amplitude" in values:
        yield "phase"
    stop = values["stops"][0]
    yield "gap_0"
    yield from (f"{of}_0" for of in ("restitution", "friction") if stop.get(of, 0.0) != 0.0)
    if stop.get("amplitude", 0.0) != 0.0:
        yield from ("amplitude_0", "phase_0")
    yield from ("mass[0,0]", f"stiffness[0,{count - 1}]")
    yield from (f"{of}[0,0]" for of in ("damping",) if of in values)
    yield from (f"{of}[0]" for of in ("damping_ratios",) if of in values)
    yield from ("q_0", "v_0")


def changed(case: Case, name: str, by: Fraction) -> StructureRun:
    """The run with one number changed."""
    values: dict[str, Any] = copy.deepcopy(case.values)
    start = [[Fraction(x) for x in part] for part in case.initial]
    count = len(values["mass"])
    if name.endswith("]"):
        field, _, place = name[:-1].partition("[")
        where = [int(i) for i in place.split(",")]
        if len(where) == 1:
            row = [Fraction(x) for x in values.get(field, [0.0] * count)]
            row[where[0]] += by
            values[field] = row
        else:
            rows = [[Fraction(x) for x in row] for row in values[field]]
            for i, j in {(where[0], where[1]), (where[1], where[0])}:
                rows[i][j] += by
            values[field] = rows
    elif name[-1].isdigit():
        field, _, place = name.rpartition("_")
        if field in _OF_STOPS:
            stop = values["stops"][int(place)]
            stop[field] = Fraction(stop.get(field, 0.0)) + by
        else:
            start["qv".index(field)][int(place)] += by
    else:
        values[name] = Fraction(values.get(name, 0.0)) + by
    return simulate(Structure.parse(values), start, periods=periods(case))


def periods(case: Case) -> int:
    """How many drive periods are followed."""
    return min(case.periods or PERIODS, PERIODS)


def told(run: StructureRun) -> tuple[list[arb], list[arb]]:
    """Time, q, q' before and after of an impact, and the state after the last period."""
    impact = run.impacts[:IMPACT][-1]
    q, v = run.states[-1]
    return [impact.time, *impact.q, *impact.v_pre, *impact.v_post], [*q, *v]


def kinds(run: StructureRun) -> list[Any]:
    """What two runs must have alike to be differentiated."""
    changes = [(entry.kind, entry.stop) for entry in run.story if hasattr(entry, "kind")]
    return [*[(hit.stop, hit.regime) for hit in run.impacts[:IMPACT]], *changes, run.ending]


def scene_record(name: str) -> dict[str, Any]:
    """One scene of the file."""
    case = CASES[name]
    by = list(names(case))
    met = changed(case, "phase", Fraction(0))
    at_impact: list[list[str]] = []
    at_section: list[list[str]] = []
    for of in by:
        ahead, behind = (changed(case, of, step) for step in (H, -H))
        if not kinds(ahead) == kinds(behind) == kinds(met):
            raise ArithmeticError(f"{name} lies on a border in {of}")
        with ctx.workprec(met.precision):
            for rows, there, back in zip(
                (at_impact, at_section), told(ahead), told(behind), strict=True
            ):
                slopes = [(a - b) / (2 * arb(10) ** -25) for a, b in zip(there, back, strict=True)]
                small = [abs(slope) < arb(10) ** -DIGITS for slope in slopes]
                rows.append(
                    [
                        "0" if s else x.str(DIGITS, radius=False)
                        for s, x in zip(small, slopes, strict=True)
                    ]
                )
    return {
        **case.values,
        "initial": list(case.initial),
        "periods": periods(case),
        "by": by,
        "number": min(IMPACT, len(met.impacts)) - 1,
        "impact": at_impact,
        "section": at_section,
    }

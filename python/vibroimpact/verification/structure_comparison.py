"""Comparison of a structure's run with the exact motion, in the coordinates of its compiled form.

A run and the reference may tell in different rows what impacts do to closed stops: that one stays
closed, or that an impact of its own has opened it. Such rows are left out on both sides (told.py).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any, cast

import numpy as np
from flint import arb, ctx

from .._core import Regime
from ..reference.contact import Undecided
from ..reference.impact import PlanarImpact
from ..reference.structure import Structure as ExactStructure
from .columns import structure_tables
from .comparison import GRAZING, verification
from .judged import Judged, distance, right_digits, turned
from .passes import Entry, Pass
from .result import Disagreement, Verification
from .stretches import Rows, Stretches
from .structure_motion import DEAD_ENDS, StructureEntry
from .structure_sizes import StructureSizes
from .told import essential


def compare_structure(
    parts: Stretches,
    beside: Sequence[tuple[Rows, Pass]],
    exact: Pass,
    structure: ExactStructure,
    sizes: StructureSizes,
    section_times: Sequence[float],
    digits: int,
) -> Verification:
    """The verification of a run, as `comparison.compare`."""
    with ctx.workprec(exact.bits):
        done = list[StructureComparison]()
        grazes, holds = 0, dict[int, str]()
        for rows, motion in beside:
            given = section_times[rows.before[2] :], digits, grazes
            done.append(StructureComparison(structure, holds, rows, motion, sizes, *given))
            done[-1].compare()
            grazes += len(rows.grazes)
            holds = done[-1].holds
    return verification(parts, done, structure_tables(structure.size), exact, digits)


class StructureComparison(Judged):
    """A stretch of a run of a structure."""

    dead_ends = DEAD_ENDS
    sizes: StructureSizes

    def __init__(self, structure: ExactStructure, holds: dict[int, str], *given: Any) -> None:
        super().__init__(*given)
        self.structure, self.size = structure, structure.size
        #: Of the stops that the run has closed what was told last: before its rows, then after.
        self.holds = holds

    def _told(self) -> list[tuple[str, int]]:
        told = super()._told()
        tables = [self.rows.impacts if kind == "impact" else self.rows.contacts for kind, _ in told]
        rows = [table[index] for table, (_, index) in zip(tables, told, strict=True)]
        events = [
            (kind, int(row["stop"]), float(row["time"]))
            for (kind, _), row in zip(told, rows, strict=True)
        ]
        impulses = [
            float(row["impulse_normal"]) if kind == "impact" else 0.0
            for (kind, _), row in zip(told, rows, strict=True)
        ]
        places, self.holds = essential(events, told_again=True, holds=self.holds, impulses=impulses)
        return [told[place] for place in places]

    def _fits(self, row: np.void, entry: Entry) -> bool:
        return bool(row["stop"] == cast("StructureEntry", entry).stop)

    def _columns(self, errors: Sequence[float]) -> tuple[Any, ...]:
        return list(errors[: self.size]), list(errors[self.size :])

    def _without_grazes(self) -> None:
        grazes, entries = self.rows.grazes, list[Entry]()
        for entry in cast("Sequence[StructureEntry]", self.exact.entries):
            here = np.flatnonzero(grazes["stop"] == entry.stop)
            weak = len(here) and entry.kind == "impact" and entry.jump() < GRAZING
            off = np.abs(grazes["time"][here] - float(entry.values[0]))
            if not weak or not off.min() < GRAZING * self.sizes.time:
                entries.append(entry)
                continue
            index = int(here[off.argmin()])
            row = grazes[index]
            states = (*entry.q(), *entry.velocities()[0]), entry.after()
            digits = right_digits(self._time_errors(row, entry.values[0])[1], self.sizes.time)
            sizes = self.sizes.at(float(row["time"]), *states)
            for value, balls, size in zip(
                (*row["q"], *row["v"]), zip(*states, strict=True), sizes, strict=True
            ):
                error = max(distance(float(value), ball) for ball in balls)
                digits = min(digits, right_digits(error, size))
            number = self.grazes + index
            self._miss(entry, number, digits)
            self._wrong("graze", number, float(row["time"]), digits)
        self.exact = replace(self.exact, entries=entries)

    def _impact(self, index: int, row: np.void, entry: Entry) -> bool:
        assert isinstance(entry, StructureEntry)
        time_error, counted = self._time_errors(row, entry.values[0])
        errors = [
            [distance(float(value), ball) for value, ball in zip(row[name], balls, strict=True)]
            for name, balls in zip(
                ("q", "v_pre", "v_post"), (entry.q(), *entry.velocities()), strict=True
            )
        ]
        names = ("approach_velocity", "phase", "impulse_normal", "impulse_tangential")
        more = [
            distance(float(row[name]), turned(name, row, cast("arb", ball)))
            for name, ball in zip((*names, "energy_loss"), entry.more, strict=True)
        ]
        sizes = self.sizes.of_impact(entry)
        flat = (counted, *(error for part in errors for error in part), *more)
        judged = self._judge(sizes, flat, (*entry.values, *entry.more), entry.certified)
        if judged is None:
            return False
        regime = Regime[(entry.regime or "").upper()]
        agrees = bool(regime == row["regime"])
        ambiguous = not agrees and self._on_a_border(int(row["regime"]), entry, max(flat))
        number, time = self._number(index), float(row["time"])
        found = (time_error, *errors, *more, regime, agrees, ambiguous)
        self.impacts.append((number, entry.stop, time, *found, *judged, entry.growth))
        wrong = judged[0] < self.digits
        if wrong or not (agrees or ambiguous):
            reason = "digits" if wrong else "regime"
            self.failures.append(
                Disagreement(event="impact", number=number, time=time, reason=reason)
            )
        return True

    def _contact(self, index: int, row: np.void, entry: Entry) -> bool:
        assert isinstance(entry, StructureEntry)
        values = (entry.values[0], *entry.after())
        time_error, counted = self._time_errors(row, values[0])
        numbers = (*row["q"], *row["v"])
        errors = [distance(float(q), ball) for q, ball in zip(numbers, values[1:], strict=True)]
        sizes = (self.sizes.time, *self.sizes.at(float(values[0]), values[1:]))
        judged = self._judge(sizes, (counted, *errors), values, entry.certified)
        if judged is None:
            return False
        time, index = float(row["time"]), self.rows.before[1] + index
        found = (time_error, *self._columns(errors), *judged, entry.growth)
        self.contacts.append((index, int(row["kind"]), entry.stop, time, *found))
        self._wrong(entry.kind, index, time, judged[0])
        return True

    def _on_a_border(self, regime: int, entry: StructureEntry, error: float) -> bool:
        """Whether approach and slip within the errors of the run have the run's regime."""
        structure, stop = self.structure, self.structure.stops[entry.stop]
        if stop.tangent is None:
            return False
        a, b, c = (
            arb(structure.coupling(one, other))
            for one, other in (
                (stop.normal, stop.normal), (stop.normal, stop.tangent),
                (stop.tangent, stop.tangent),
            )
        )  # fmt: skip
        before = entry.velocities()[0]
        slip = sum((arb(stop.tangent[0, i]) * v for i, v in enumerate(before)), arb(0)).mid()
        u = cast("arb", entry.more[0]).mid()
        planar = PlanarImpact(stop.restitution_at(u), arb(stop.friction), b, c, a - b**2 / c)
        reach = 2.0 * error + 4.0 * float(np.finfo(float).eps)
        for shift in (-reach, 0.0, reach):
            s = slip + shift
            try:
                found = planar.path(structure.law, s, u - b / c * s).regime
            except (Undecided, ValueError):
                continue
            if Regime[found.upper()] == regime:
                return True
        return False

"""Comparison of the numbers of a run with the exact ones: errors, digits, first failure.

A graze of the run has no counterpart if in the exact motion that contact does not happen. If it is
an impact there, the state of the graze is compared with those before and after it. All quantities
are dimensionless.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from flint import ctx
from numpy.typing import NDArray

from .._core import Regime
from ..reference.contact import Undecided
from ..reference.flight import System as ExactSystem
from ..reference.impact import LAWS
from .columns import (
    CONTACT_DTYPE,
    FINAL_DTYPE,
    FURTHER_NUMBERS,
    IMPACT_DTYPE,
    MISSED_DTYPE,
    MOTION_NUMBERS,
    SECTION_DTYPE,
)
from .judged import Judged, distance, right_digits, turned
from .passes import Entry, Pass
from .result import Disagreement, Verification
from .sizes import Sizes
from .stretches import Rows, Stretches

#: An impact that changes v1 and v2 by no more than this may be a graze of the run.
GRAZING = 1e-6
#: Places of the values of an Entry that make up CONTACT_NUMBERS, and the state of a section.
_CONTACT_PLACES = (0, 1, 3, 4, 6)
#: The numbers of a state.
STATE = ("x1", "v1", "x2", "v2")
#: The tables of a verification.
TABLES = {
    "impacts": IMPACT_DTYPE,
    "contacts": CONTACT_DTYPE,
    "sections": SECTION_DTYPE,
    "final": FINAL_DTYPE,
    "missed": MISSED_DTYPE,
}


def compare(
    parts: Stretches,
    beside: Sequence[tuple[Rows, Pass]],
    exact: Pass,
    system: ExactSystem,
    section_times: Sequence[float],
    digits: int,
) -> Verification:
    """The verification of a run, given its stretches beside the exact motion, the kept one last."""
    with ctx.workprec(exact.bits):
        sizes = Sizes(exact, system, section_times)
        done = list[Comparison]()
        for rows, motion in beside:
            times, grazes = section_times[rows.before[2] :], _grazes(beside, len(done))
            done.append(Comparison(system, rows, motion, sizes, times, digits, grazes))
            done[-1].compare()
    return verification(parts, done, TABLES, exact, digits)


def _grazes(beside: Sequence[tuple[Rows, Pass]], place: int) -> int:
    """Grazes of the stretches before one."""
    return sum(len(rows.grazes) for rows, _ in beside[:place])


def verification(
    parts: Stretches,
    done: Sequence[Judged],
    dtypes: Mapping[str, np.dtype[np.void]],
    exact: Pass,
    digits: int,
) -> Verification:
    """The verification from the compared stretches, the kept one last."""
    run, kept = parts.kept.run, parts.kept
    last = done[-1]
    if parts.lead is not None and last.stopped == "completed" and done[0].stopped != "sequence":
        # the first stretch may have ended because the reference is not precise enough
        last.stopped, last.detail = done[0].stopped, done[0].detail
    failures = [failure for each in done for failure in each.failures]
    first = min(failures, key=lambda failure: failure.time, default=None)
    tables = [
        np.array([row for each in done for row in getattr(each, name)], dtype)
        for name, dtype in dtypes.items()
    ]
    mine = (
        tables[0][tables[0]["number"] > kept.before[0]],
        *(
            _shifted(table[table["row"] >= before], before)
            for table, before in zip(tables[1:3], kept.before[1:], strict=True)
        ),
    )
    return Verification(
        digits=digits,
        horizon=first,
        impacts=_frozen(mine[0]),
        contacts=_frozen(mine[1]),
        sections=_frozen(mine[2]),
        whole_impacts=_frozen(tables[0]),
        whole_contacts=_frozen(tables[1]),
        whole_sections=_frozen(tables[2]),
        final=_frozen(tables[3]),
        missed=_frozen(tables[4]),
        kept=(len(run.impacts), len(run.contacts), len(run.stroboscopic)),
        first_kept=kept.before[0] + 1,
        kept_from=run.kept_from,
        from_start=parts.from_start,
        stopped=last.stopped,
        stop_detail=last.detail,
        precision=exact.bits,
        growth=_mean_growth(tables[0]),
    )


class Comparison(Judged):
    """A stretch of a run of a System."""

    sizes: Sizes

    def __init__(self, system: ExactSystem, *given: Any) -> None:
        super().__init__(*given)
        self.system = system

    def _without_grazes(self) -> None:
        """Find impacts that are grazes in the run, and compare them separately."""
        grazes, entries = self.rows.grazes, []
        for entry in self.exact.entries:
            if not len(grazes) or entry.kind != "impact" or not entry.jump() < GRAZING:
                entries.append(entry)
                continue
            off = np.abs(grazes["time"] - float(entry.values[0]))
            index = int(off.argmin())
            if not off[index] < GRAZING:
                entries.append(entry)
                continue
            row = grazes[index]
            _, x1, v1, v1_, x2, v2, v2_ = entry.values
            sizes = self.sizes.at(float(row["time"]), (x1, v1, x2, v2), (x1, v1_, x2, v2_))
            balls = ((x1, x1), (v1, v1_), (x2, x2), (v2, v2_))
            digits = right_digits(self._time_errors(row, entry.values[0])[1], self.sizes.time)
            for name, both, size in zip(STATE, balls, sizes, strict=True):
                error = max(distance(float(row[name]), ball) for ball in both)
                digits = min(digits, right_digits(error, size))
            number = self.grazes + index
            self._miss(entry, number, digits)
            self._wrong("graze", number, float(row["time"]), digits)
        self.exact = replace(self.exact, entries=entries)

    def _impact(self, index: int, row: np.void, entry: Entry) -> bool:
        """One impact; False if the reference is not known well enough to judge it."""
        time_error, counted = self._time_errors(row, entry.values[0])
        errors = [
            distance(float(row[name]), ball)
            for name, ball in zip(MOTION_NUMBERS[1:], entry.values[1:], strict=True)
        ]
        more = [
            math.nan if ball is None else distance(float(row[name]), turned(name, row, ball))
            for name, ball in zip(FURTHER_NUMBERS, entry.more, strict=True)
        ]
        sizes = self.sizes.of_impact(entry.values, entry.more[1])
        balls = (*entry.values, *entry.more)
        judged = self._judge(sizes, (counted, *errors, *more), balls, entry.certified)
        if judged is None:
            return False
        regime = Regime[entry.regime.upper()] if entry.regime else Regime(int(row["regime"]))
        agrees = bool(regime == row["regime"])
        worst = max(time_error, *errors)
        ambiguous = not agrees and self._on_a_border(int(row["regime"]), entry, worst)
        number, time = self._number(index), float(row["time"])
        found = (time_error, *errors, *more, regime, agrees, ambiguous)
        self.impacts.append((number, time, *found, *judged, entry.growth))
        wrong = judged[0] < self.digits
        if wrong or not (agrees or ambiguous):
            self.failures.append(
                Disagreement(
                    event="impact", number=number, time=time, reason="digits" if wrong else "regime"
                )
            )
        return True

    def _contact(self, index: int, row: np.void, entry: Entry) -> bool:
        """One event of sustained contact; False as for an impact."""
        values = tuple(entry.values[place] for place in _CONTACT_PLACES)
        time_error, counted = self._time_errors(row, values[0])
        errors = [
            distance(float(row[name]), ball) for name, ball in zip(STATE, values[1:], strict=True)
        ]
        sizes = (self.sizes.time, *self.sizes.at(float(values[0]), values[1:]))
        judged = self._judge(sizes, (counted, *errors), values, entry.certified)
        if judged is None:
            return False
        time, index = float(row["time"]), self.rows.before[1] + index
        found = (time_error, *errors, *judged, entry.growth)
        self.contacts.append((index, int(row["kind"]), time, *found))
        self._wrong(entry.kind, index, time, judged[0])
        return True

    def _on_a_border(self, regime: int, entry: Entry, error: float) -> bool:
        """Whether states within the errors of the run have the run's regime."""
        law = LAWS[self.run.system.law]
        x1, v1, v2 = (entry.values[place].mid() for place in (1, 2, 5))
        reach = 2.0 * error + 4.0 * float(np.finfo(float).eps)
        for shift in itertools.product((-reach, 0.0, reach), repeat=3):
            a, b, c = (q + d for q, d in zip((x1, v1, v2), shift, strict=True))
            try:
                if Regime[law(self.system, a, b, c).regime.upper()] == regime:
                    return True
            except (Undecided, ValueError):
                continue
        return False


def _mean_growth(impacts: NDArray[np.void]) -> float:
    """Mean logarithmic growth from impact to impact."""
    seen = impacts["growth"][impacts["growth"] > 0]
    return math.nan if len(seen) < 2 else math.log(seen[-1] / seen[0]) / (len(seen) - 1)


def _shifted(table: NDArray[np.void], by: int) -> NDArray[np.void]:
    """A copy whose rows are numbered from a given start."""
    table = table.copy()
    table["row"] -= by
    return table


def _frozen(table: NDArray[np.void]) -> NDArray[np.void]:
    table.flags.writeable = False
    return table

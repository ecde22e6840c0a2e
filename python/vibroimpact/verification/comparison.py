"""The numbers of a run beside those of the exact motion: errors, digits, and the first that fails.

Events are set side by side in their order, with the pairing of motion.py. A graze of the run has no
counterpart: in the exact motion that contact does not happen, or is an impact that changes next to
nothing. All quantities are dimensionless.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from flint import arb, ctx
from numpy.typing import NDArray

from ..reference.contact import Undecided
from ..reference.flight import System as ExactSystem
from ..reference.impact import LAWS
from ..results import EventKind, Regime
from .motion import DEAD_ENDS, Entry, Pass, pairs
from .result import (
    CONTACT_DTYPE,
    CONTACT_NUMBERS,
    IMPACT_DTYPE,
    IMPACT_NUMBERS,
    MOST_DIGITS,
    SECTION_DTYPE,
    SECTION_NUMBERS,
    Disagreement,
    Verification,
)
from .stretches import Rows, Stretches

#: An impact that changes v1 and v2 by no more than this may be a graze of the run.
GRAZING = 1e-6
#: A run that ends in a chatter does not list the last of its impacts, which are weaker than this.
WEAK = 1e-3
#: Times are the same, where events are only set side by side, to this part of their size.
CLOSE = 1e-6
#: Places of the values of an Entry that make up CONTACT_NUMBERS, and the state of a section.
CONTACT_PLACES = (0, 1, 3, 4, 6)
#: The size of a number that stays 0 or next to it, in units of the largest of the four.
STILL = 1e-8
#: Floats are rounded to nearest; a bound is rounded up.
UP = 1.0 + 2.0**-50


@dataclass(frozen=True)
class Sizes:
    """What errors are measured in: of times, x1, v1, x2, v2."""

    time: float
    x1: float
    v1: float
    x2: float
    v2: float

    def of(self, name: str) -> float:
        """The size of a number by its column."""
        return float(getattr(self, name.partition("_")[0]))


def compare(
    parts: Stretches,
    beside: Sequence[tuple[Rows, Pass]],
    exact: Pass,
    system: ExactSystem,
    section_times: Sequence[float],
    digits: int,
) -> Verification:
    """The verification of a run, given its stretches beside the exact motion, the kept one last."""
    run, kept = parts.kept.run, parts.kept
    with ctx.workprec(exact.bits):
        sizes = _sizes(exact, system)
        done = []
        for rows, motion in beside:
            times = section_times[rows.before[2] :]
            done.append(_Comparison(rows, motion, system, sizes, times, digits))
            done[-1].compare()
    last = done[-1]
    if parts.lead is not None and last.stopped == "completed" and done[0].stopped != "sequence":
        # the first stretch may have ended where the reference is not known well enough
        last.stopped, last.detail = done[0].stopped, done[0].detail
    failures = [failure for each in done for failure in each.failures]
    first = min(failures, key=lambda failure: failure.time, default=None)
    tables = [
        np.array([row for each in done for row in getattr(each, name)], dtype)
        for name, dtype in (
            ("impacts", IMPACT_DTYPE),
            ("contacts", CONTACT_DTYPE),
            ("sections", SECTION_DTYPE),
        )
    ]
    mine = (
        tables[0][tables[0]["number"] > kept.before[0]],
        *(
            _shifted(table[table["row"] >= before], before)
            for table, before in zip(tables[1:], kept.before[1:], strict=True)
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
        kept=(len(run.impacts), len(run.contacts), len(run.stroboscopic)),
        first_kept=kept.before[0] + 1,
        kept_from=run.kept_from,
        from_start=parts.from_start,
        stopped=last.stopped,
        stop_detail=last.detail,
        precision=exact.bits,
        growth=_mean_growth(tables[0]),
    )


def _sizes(exact: Pass, system: ExactSystem) -> Sizes:
    """Largest values of the motion, and the drive period."""
    entries = [[abs(float(q)) for q in entry.values] for entry in exact.entries]
    states = [[abs(float(q)) for q in state] for state in exact.samples if state]
    time = float(2 * arb.pi() / arb(system.omega)) if system.omega != 0 else 0.0
    largest = [0.0] * 5
    for time_, x1, v1, v1_, x2, v2, v2_ in entries:
        row = (time_, x1, max(v1, v1_), x2, max(v2, v2_))
        largest = [max(a, b) for a, b in zip(largest, row, strict=True)]
    for state in states:
        largest[1:] = [max(a, b) for a, b in zip(largest[1:], state, strict=True)]
    floor = STILL * max(largest[1:])
    return Sizes(time or largest[0], *(max(size, floor) for size in largest[1:]))


class _Comparison:
    """One stretch of a run beside the exact motion; rows and failures are collected in order."""

    def __init__(
        self,
        rows: Rows,
        exact: Pass,
        system: ExactSystem,
        sizes: Sizes,
        section_times: Sequence[float],
        digits: int,
    ) -> None:
        self.rows, self.run, self.system, self.digits = rows, rows.run, system, digits
        self.section_times, self.sizes = section_times, sizes
        self.exact = replace(exact, entries=_without_grazes(exact.entries, rows))
        omega = arb(system.omega)
        self.period = 2 * arb.pi() / omega if system.omega != 0 else None
        self.failures: list[Disagreement] = []
        self.impacts: list[tuple[Any, ...]] = []
        self.contacts: list[tuple[Any, ...]] = []
        self.sections: list[tuple[Any, ...]] = []
        self.stopped, self.detail = exact.stopped or "completed", exact.detail

    def compare(self) -> None:
        """Collect all rows."""
        self._events()
        self._sections()

    def _events(self) -> None:
        """Impacts and events of contact, in their order."""
        run, entries = self.rows, self.exact.entries
        told = [
            (EventKind(kind).name.lower(), int(index))
            for kind, index in zip(run.events["kind"], run.events["index"], strict=True)
            if kind not in (EventKind.GRAZE, EventKind.STOP)
        ]
        *matched, (i, j) = pairs([kind for kind, _ in told], [entry.kind for entry in entries])
        for place, other in matched:
            kind, index = told[place]
            row = run.impacts[index] if kind == "impact" else run.contacts[index]
            add = self._impact if kind == "impact" else self._contact
            if not add(index, row, entries[other]):
                return
        if i < len(told) and (j < len(entries) or not self.exact.stopped):
            if self._cut_in_chatter(told[i:], entries[j:]) or (j == len(entries) and self._ends()):
                return
            kind, index = told[i]
            table = run.impacts if kind == "impact" else run.contacts
            # the reference may have been stopped on its way to the end of the same chatter
            cut = kind == "chatter" and all(entry.kind == "impact" for entry in entries[j:])
            if cut and self.exact.stopped:
                return
            self._apart(kind, index, float(table["time"][index]))
        elif self.rows.to_the_end and i == len(told) and not self._ends() and j < len(entries):
            self._left_over(entries[j])

    def _cut_in_chatter(self, told: Sequence[tuple[str, int]], entries: Sequence[Entry]) -> bool:
        """Whether a run that ends before a chatter does only lists more of its impacts.

        Which those are is a matter of tolerance, as in motion.pairs.
        """
        if not entries or entries[0].kind != "chatter" or any(k != "impact" for k, _ in told):
            return False
        limit = float(entries[0].values[0]) + CLOSE * self.sizes.time
        return bool((self.rows.impacts["time"][[index for _, index in told]] <= limit).all())

    def _ends(self) -> bool:
        """Whether only one of both ends where the model has no motion, or more than one."""
        run, ends, close = self.run, self.exact.ends, CLOSE * self.sizes.time
        time = run.final_state.time
        if ends is not None and ends < time - close:
            said = f"the exact motion has no one continuation at time {ends:.6g}, the run goes on"
            time = ends
        elif (
            run.stop_reason in DEAD_ENDS
            and not self.exact.stopped
            and (ends is None or ends > time + close)
        ):
            said = f"the run ends as {run.stop_reason} at time {time:.6g}, the exact motion goes on"
        else:
            return False
        self.failures.append(Disagreement(event="stop", number=0, time=time, reason="sequence"))
        self.stopped, self.detail = "sequence", said
        return True

    def _left_over(self, entry: Entry) -> None:
        """An event of the exact motion after all of the run's: missing, if before the run's end."""
        time = float(entry.values[0])
        end = self.run.final_state.time
        weak = entry.kind == "impact" and _change(entry) < WEAK
        if time < end - CLOSE * self.sizes.time and not weak:
            rows = self.impacts if entry.kind == "impact" else self.contacts
            self._apart(entry.kind, len(rows), time)

    def _apart(self, kind: str, index: int, time: float) -> None:
        """The run and the exact motion meet different events."""
        number = self._number(index) if kind == "impact" else self.rows.before[1] + index
        self.failures.append(Disagreement(event=kind, number=number, time=time, reason="sequence"))
        self.stopped = "sequence"
        self.detail = f"at {kind} {number} (time {time:.6g}) the exact motion goes another way"

    def _number(self, index: int) -> int:
        """Number of a kept impact since t = 0, from 1."""
        return self.rows.before[0] + index + 1

    def _impact(self, index: int, row: np.void, entry: Entry) -> bool:
        """One impact; False if the reference is not known well enough to judge it."""
        errors = [self._time_error(row, entry.values[0])]
        errors += [
            _off(float(row[name]), ball)
            for name, ball in zip(IMPACT_NUMBERS[1:], entry.values[1:], strict=True)
        ]
        judged = self._judge(IMPACT_NUMBERS, errors, entry.values, entry)
        if judged is None:
            return False
        regime = Regime[entry.regime.upper()] if entry.regime else Regime(int(row["regime"]))
        agrees = bool(regime == row["regime"])
        ambiguous = not agrees and self._on_a_border(int(row["regime"]), entry, max(errors))
        number, time = self._number(index), float(row["time"])
        self.impacts.append(
            (number, time, *errors, regime, agrees, ambiguous, *judged, entry.growth)
        )
        wrong = judged[0] < self.digits
        if wrong or not (agrees or ambiguous):
            self.failures.append(
                Disagreement(
                    event="impact", number=number, time=time, reason="digits" if wrong else "regime"
                )
            )
        return True

    def _contact(self, index: int, row: np.void, entry: Entry) -> bool:
        """One event of lasting contact; False as for an impact."""
        values = tuple(entry.values[place] for place in CONTACT_PLACES)
        errors = [self._time_error(row, values[0])]
        errors += [
            _off(float(row[name]), ball)
            for name, ball in zip(CONTACT_NUMBERS[1:], values[1:], strict=True)
        ]
        judged = self._judge(CONTACT_NUMBERS, errors, values, entry)
        if judged is None:
            return False
        time, index = float(row["time"]), self.rows.before[1] + index
        self.contacts.append((index, int(row["kind"]), time, *errors, *judged, entry.growth))
        self._wrong(entry.kind, index, time, judged[0])
        return True

    def _sections(self) -> None:
        """States at the sections."""
        for index, (row, state, time) in enumerate(
            zip(self.rows.sections, self.exact.samples, self.section_times, strict=False)
        ):
            if state is None:
                continue
            errors = [_off(float(q), ball) for q, ball in zip(row, state, strict=True)]
            entry = Entry("section", state, None, index < self.exact.proved_samples)
            judged = self._judge(SECTION_NUMBERS, errors, state, entry)
            if judged is None:
                return
            number = self.rows.before[2] + index
            self.sections.append((number, time, *errors, *judged))
            self._wrong("section", number, time, judged[0])

    def _wrong(self, event: str, number: int, time: float, digits: float) -> None:
        if digits < self.digits:
            self.failures.append(
                Disagreement(event=event, number=number, time=time, reason="digits")
            )

    def _judge(
        self, names: Iterable[str], errors: Sequence[float], values: Sequence[arb], entry: Entry
    ) -> tuple[float, float, bool] | None:
        """Digits of the worst number, and how well the exact one is known; None: too badly."""
        least, own = MOST_DIGITS, 0.0
        for name, error, value in zip(names, errors, values, strict=True):
            size, blur = self.sizes.of(name), float(value.rad()) * UP
            own = max(own, blur)
            if blur > size * 10.0 ** -(self.digits + 1):
                if self.stopped == "completed":
                    self.stopped = "precision_cap"
                    self.detail = f"the reference itself is known to {blur:.1g} only"
                return None
            least = min(least, _digits(error, size))
        return least, own, entry.certified

    def _time_error(self, row: np.void, ball: arb) -> float:
        """Error of the time, from the period and the time in it, which do not lose digits.

        The column `time` may differ from these by its own rounding, no more.
        """
        time = float(row["time"])
        error = max(0.0, _off(time, ball) - float(np.spacing(abs(time))))
        if self.period is None:
            return _off(time, ball)
        since = ball - int(row["period"]) * self.period
        return max(error, _off(float(row["time_in_period"]), since))

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


def _without_grazes(entries: Sequence[Entry], rows: Rows) -> list[Entry]:
    """The entries without impacts that the run has as grazes."""
    times = rows.grazes["time"]
    return [
        entry
        for entry in entries
        if not (
            len(times)
            and entry.kind == "impact"
            and _change(entry) < GRAZING
            and np.abs(times - float(entry.values[0])).min() < GRAZING
        )
    ]


def _change(entry: Entry) -> float:
    """How much an impact changes the velocities."""
    _, _, v1_pre, v1_post, _, v2_pre, v2_post = entry.values
    return max(abs(float(v1_post - v1_pre)), abs(float(v2_post - v2_pre)))


def _off(value: float, ball: arb) -> float:
    """Upper bound of the distance of a number from an enclosure."""
    if not math.isfinite(value):
        return math.inf
    return float(abs(ball - arb(value)).abs_upper()) * UP


def _digits(error: float, size: float) -> float:
    """Correct digits of a number of a size."""
    if error == 0.0:
        return MOST_DIGITS
    if size == 0.0 or not math.isfinite(error):
        return 0.0
    return min(MOST_DIGITS, max(0.0, -math.log10(error / size)))


def _mean_growth(impacts: NDArray[np.void]) -> float:
    """Mean logarithmic growth from impact to impact."""
    seen = impacts["growth"][impacts["growth"] > 0]
    return math.nan if len(seen) < 2 else math.log(seen[-1] / seen[0]) / (len(seen) - 1)


def _shifted(table: NDArray[np.void], by: int) -> NDArray[np.void]:
    """A copy whose rows are counted from there."""
    table = table.copy()
    table["row"] -= by
    return table


def _frozen(table: NDArray[np.void]) -> NDArray[np.void]:
    table.flags.writeable = False
    return table

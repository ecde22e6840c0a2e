"""Comparison of the numbers of a run with the exact ones: errors, digits, first failure.

Events are compared in their order, with the pairing of motion.py. A graze of the run has no
counterpart if in the exact motion that contact does not happen. If it is an impact there, the state
of the graze is compared with those before and after it. All quantities are dimensionless.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from flint import arb, ctx
from numpy.typing import NDArray

from .._core import Regime
from ..reference.contact import Undecided
from ..reference.flight import State
from ..reference.flight import System as ExactSystem
from ..reference.impact import LAWS
from ..run import EventKind
from .columns import (
    CONTACT_DTYPE,
    FINAL_DTYPE,
    FURTHER_NUMBERS,
    IMPACT_DTYPE,
    MISSED_DTYPE,
    MOST_DIGITS,
    MOTION_NUMBERS,
    SECTION_DTYPE,
)
from .motion import DEAD_ENDS, Entry, Pass, pairs
from .result import Disagreement, Verification
from .sizes import Sizes
from .stretches import Rows, Stretches

#: An impact that changes v1 and v2 by no more than this may be a graze of the run.
GRAZING = 1e-6
#: A run that ends in a chatter does not list the last of its impacts, which are weaker than this.
_WEAK = 1e-3
#: For the pairing of events, times are equal if they agree to this part of their size.
_CLOSE = 1e-6
#: Places of the values of an Entry that make up CONTACT_NUMBERS, and the state of a section.
_CONTACT_PLACES = (0, 1, 3, 4, 6)
#: The numbers of a state.
STATE = ("x1", "v1", "x2", "v2")
#: Floats are rounded to nearest; a bound is rounded up.
_UP = 1.0 + 2.0**-50


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
        sizes = Sizes(exact, system, section_times)
        done = []
        grazes = 0
        for rows, motion in beside:
            times = section_times[rows.before[2] :]
            done.append(_Comparison(rows, motion, system, sizes, times, digits, grazes))
            done[-1].compare()
            grazes += len(rows.grazes)
    last = done[-1]
    if parts.lead is not None and last.stopped == "completed" and done[0].stopped != "sequence":
        # the first stretch may have ended because the reference is not precise enough
        last.stopped, last.detail = done[0].stopped, done[0].detail
    failures = [failure for each in done for failure in each.failures]
    first = min(failures, key=lambda failure: failure.time, default=None)
    tables = [
        np.array([row for each in done for row in getattr(each, name)], dtype)
        for name, dtype in (
            ("impacts", IMPACT_DTYPE),
            ("contacts", CONTACT_DTYPE),
            ("sections", SECTION_DTYPE),
            ("final", FINAL_DTYPE),
            ("missed", MISSED_DTYPE),
        )
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
        grazes: int,
    ) -> None:
        self.rows, self.run, self.system, self.digits = rows, rows.run, system, digits
        self.section_times, self.sizes, self.grazes = section_times, sizes, grazes
        self.exact = exact
        omega = arb(system.omega)
        self.period = 2 * arb.pi() / omega if system.omega != 0 else None
        self.failures: list[Disagreement] = []
        self.impacts: list[tuple[Any, ...]] = []
        self.contacts: list[tuple[Any, ...]] = []
        self.sections: list[tuple[Any, ...]] = []
        self.final: list[tuple[Any, ...]] = []
        self.missed: list[tuple[Any, ...]] = []
        #: Weak impacts of the exact motion after the last event of the run.
        self.weak: list[Entry] = []
        self.stopped, self.detail = exact.stopped or "completed", exact.detail

    def compare(self) -> None:
        """Collect all rows."""
        self._without_grazes()
        self._events()
        self._sections()
        if self.rows.to_the_end:
            self._final()

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
            self._left_over(entries[j:])

    def _cut_in_chatter(self, told: Sequence[tuple[str, int]], entries: Sequence[Entry]) -> bool:
        """Whether a run that ends before a chatter only lists more of its impacts.

        Which impacts are listed depends on tolerances, as in motion.pairs.
        """
        if not entries or entries[0].kind != "chatter" or any(k != "impact" for k, _ in told):
            return False
        limit = float(entries[0].values[0]) + _CLOSE * self.sizes.time
        return bool((self.rows.impacts["time"][[index for _, index in told]] <= limit).all())

    def _ends(self) -> bool:
        """Whether only one of them ends where the model has no motion, or more than one."""
        run, ends, close = self.run, self.exact.ends, _CLOSE * self.sizes.time
        time = run.final_state.time
        if ends is not None and ends < time - close:
            what = "has no one continuation"
            if self.exact.ending == "law_failed":
                what = "meets an impact for which the law has no outcome"
            said = f"the exact motion {what} at time {ends:.6g}, the run goes on"
            time = ends
        elif (
            run.stop_reason in DEAD_ENDS
            and not self.exact.stopped
            and (ends is None or ends > time + close)
        ):
            said = f"the run ends as {run.stop_reason} at time {time:.6g}, the exact motion goes on"
        else:
            if self.exact.ending and run.stop_reason in DEAD_ENDS and self.stopped == "completed":
                self.detail = f"the run and the exact motion both end at time {time:.6g}: "
                self.detail += " and ".join(sorted({run.stop_reason, self.exact.ending}))
            return False
        self.failures.append(Disagreement(event="stop", number=0, time=time, reason="sequence"))
        self.stopped, self.detail = "sequence", said
        return True

    def _left_over(self, entries: Sequence[Entry]) -> None:
        """Events of the exact motion after all of the run's: missing, if before the run's end.

        Weak impacts may be the end of a chatter, of which the run lists no more; the final state
        decides.
        """
        end = self.run.final_state.time - _CLOSE * self.sizes.time
        for entry in entries:
            time = float(entry.values[0])
            if not time < end:
                return
            if not (entry.kind == "impact" and _change(entry) < _WEAK):
                rows = self.impacts if entry.kind == "impact" else self.contacts
                self._apart(entry.kind, len(rows), time)
                return
            self.weak.append(entry)
            self._miss(entry, -1, math.nan)

    def _miss(self, entry: Entry, graze: int, digits: float) -> None:
        """An impact of the exact motion that the run does not have."""
        time = float(entry.values[0])
        own = entry.error() * _UP
        self.missed.append((time, _change(entry), graze, digits, own, entry.certified))

    def _without_grazes(self) -> None:
        """Find impacts that are grazes in the run, and compare them separately."""
        grazes, entries = self.rows.grazes, []
        for entry in self.exact.entries:
            if not len(grazes) or entry.kind != "impact" or not _change(entry) < GRAZING:
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
            digits = _digits(self._time_errors(row, entry.values[0])[1], self.sizes.time)
            for name, both, size in zip(STATE, balls, sizes, strict=True):
                error = max(_off(float(row[name]), ball) for ball in both)
                digits = min(digits, _digits(error, size))
            number = self.grazes + index
            self._miss(entry, number, digits)
            self._wrong("graze", number, float(row["time"]), digits)
        self.exact = replace(self.exact, entries=entries)

    def _apart(self, kind: str, index: int, time: float) -> None:
        """The run and the exact motion have different events."""
        number = self._number(index) if kind == "impact" else self.rows.before[1] + index
        self.failures.append(Disagreement(event=kind, number=number, time=time, reason="sequence"))
        self.stopped = "sequence"
        self.detail = f"at {kind} {number} (time {time:.6g}) the exact motion goes another way"

    def _number(self, index: int) -> int:
        """Number of a kept impact since t = 0, from 1."""
        return self.rows.before[0] + index + 1

    def _impact(self, index: int, row: np.void, entry: Entry) -> bool:
        """One impact; False if the reference is not known well enough to judge it."""
        time_error, counted = self._time_errors(row, entry.values[0])
        errors = [
            _off(float(row[name]), ball)
            for name, ball in zip(MOTION_NUMBERS[1:], entry.values[1:], strict=True)
        ]
        more = [
            math.nan if ball is None else _off(float(row[name]), _turned(name, row, ball))
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
            _off(float(row[name]), ball) for name, ball in zip(STATE, values[1:], strict=True)
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

    def _sections(self) -> None:
        """States at the sections."""
        for index, (row, state, time) in enumerate(
            zip(self.rows.sections, self.exact.samples, self.section_times, strict=False)
        ):
            number = self.rows.before[2] + index
            if state is None:
                if self.stopped == "completed":
                    self.stopped = "undecided"
                    self.detail = (
                        f"section {number} (time {time:.6g}) lies at an event or in the end of a"
                        " chatter"
                    )
                continue
            errors = [_off(float(q), ball) for q, ball in zip(row, state, strict=True)]
            proved = index < self.exact.proved_samples
            judged = self._judge(self.sizes.at(time, state), errors, state, proved)
            if judged is None:
                return
            self.sections.append((number, time, *errors, *judged))
            self._wrong("section", number, time, judged[0])

    def _final(self) -> None:
        """The final state; after the impact, if one falls on that instant."""
        run, exact, near = self.run.final_state, self.exact, _CLOSE * self.sizes.time
        known: list[tuple[State, bool]] = []
        if exact.final is not None:
            known.append((exact.final, exact.proved_final))
        for entry in exact.entries:
            if abs(float(entry.values[0]) - run.time) < near:
                _, x1, _, v1, x2, _, v2 = entry.values
                known.append(((x1, v1, x2, v2), entry.certified))
        # at an impact that has no outcome; a Painleve point is not located as precisely
        same = exact.ending in ("jammed", "law_failed") and exact.ending == self.run.stop_reason
        if same and exact.last and exact.ends and abs(exact.ends - run.time) < near:
            known.append((exact.last, exact.proved_final and exact.final is None))
        found = []
        for state, proved in known:
            errors = [_off(q, ball) for q, ball in zip(run.state, state, strict=True)]
            sizes = self.sizes.at(run.time, state)
            judged = self._judge(sizes, errors, state, proved)
            if judged is not None:
                found.append((run.time, *errors, *judged))
        if found:
            best = max(found, key=lambda row: row[5])
            self.final.append(best)
            self._wrong("final_state", 0, run.time, best[5])
        elif self.weak and self.stopped == "completed":
            entry = self.weak[0]
            self._apart("impact", len(self.impacts), float(entry.values[0]))

    def _wrong(self, event: str, number: int, time: float, digits: float) -> None:
        if digits < self.digits:
            self.failures.append(
                Disagreement(event=event, number=number, time=time, reason="digits")
            )

    def _judge(
        self,
        sizes: Sequence[float],
        errors: Sequence[float],
        values: Sequence[arb | None],
        proved: bool,
    ) -> tuple[float, float, bool] | None:
        """Digits of the worst number, and the error of the exact one; None if that is too large."""
        least, own = MOST_DIGITS, 0.0
        for size, error, value in zip(sizes, errors, values, strict=True):
            if value is None:
                continue
            blur = float(value.rad()) * _UP
            own = max(own, blur)
            if blur > size * 10.0 ** -(self.digits + 1):
                if self.stopped == "completed":
                    self.stopped = "precision_cap"
                    self.detail = f"the reference itself is known to {blur:.1g} only"
                return None
            least = min(least, _digits(error, size))
        return least, own, proved

    def _time_errors(self, row: np.void, ball: arb) -> tuple[float, float]:
        """Error of the time, and the part of it that counts.

        The first bounds the errors of `time`, and of `time_in_period` with `period`. The second is
        without the rounding of both to a double, which does not make the time itself worse.
        """
        balls = [("time", ball)]
        if self.period is not None:
            balls.append(("time_in_period", ball - int(row["period"]) * self.period))
        error = counted = 0.0
        for name, exact in balls:
            value = float(row[name])
            off = _off(value, exact)
            error = max(error, off)
            counted = max(counted, off - float(np.spacing(abs(value))))
        return error, max(counted, 0.0)

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


def _turned(name: str, row: np.void, ball: arb) -> arb:
    """A phase, brought next to that of the row by whole turns; any other number as it is."""
    if name != "phase" or not math.isfinite(float(row[name])):
        return ball
    turns = round(float((ball - float(row[name])) / (2 * arb.pi())))
    return ball - 2 * arb.pi() * turns


def _change(entry: Entry) -> float:
    """How much an impact changes the velocities."""
    _, _, v1_pre, v1_post, _, v2_pre, v2_post = entry.values
    return max(abs(float(v1_post - v1_pre)), abs(float(v2_post - v2_pre)))


def _off(value: float, ball: arb) -> float:
    """Upper bound of the distance of a number from an enclosure."""
    if not math.isfinite(value):
        return math.inf
    return float(abs(ball - arb(value)).abs_upper()) * _UP


def _digits(error: float, size: float) -> float:
    """Correct digits of a number of a size."""
    if error == 0.0:
        return MOST_DIGITS
    if size == 0.0 or not math.isfinite(error):
        return 0.0
    # no quotient, which may leave the range of doubles
    return min(MOST_DIGITS, max(0.0, math.log10(size) - math.log10(error)))


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

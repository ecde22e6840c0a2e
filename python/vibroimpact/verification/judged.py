"""The comparison of a run with the exact motion that holds for systems and structures alike.

Events are compared in their order, with the pairing of pairs.py; what the numbers of a row are, the
subclasses in comparison.py and structure_comparison.py know.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import Any, Protocol

import numpy as np
from flint import arb

from ..run import EventKind
from .columns import MOST_DIGITS
from .motion import DEAD_ENDS
from .pairs import pairs
from .passes import Entry, Pass
from .result import Disagreement
from .stretches import Rows, final_numbers

#: A run that ends in a chatter does not list the last of its impacts, which are weaker than this.
_WEAK = 1e-3
#: For the pairing of events, times are equal if they agree to this part of their size.
CLOSE = 1e-6
#: Floats are rounded to nearest; a bound is rounded up.
UP = 1.0 + 2.0**-50


class Units(Protocol):
    """The units of errors: of times, and of the numbers of a state about one instant."""

    @property
    def time(self) -> float:
        """Unit of times."""

    def at(self, time: float, *states: Sequence[arb]) -> Sequence[float]:
        """Sizes of the numbers of states just before, or after, or both."""


class Judged(ABC):
    """One stretch of a run beside the exact motion; rows and failures are collected in order."""

    #: Endings beyond which the model has no motion, or more than one.
    dead_ends: tuple[str, ...] = DEAD_ENDS

    def __init__(
        self,
        rows: Rows,
        exact: Pass,
        sizes: Units,
        section_times: Sequence[float],
        digits: int,
        grazes: int,
    ) -> None:
        self.rows, self.run, self.digits = rows, rows.run, digits
        self.section_times, self.sizes, self.grazes = section_times, sizes, grazes
        self.exact = exact
        omega = rows.run.system.drive_frequency
        self.period = 2 * arb.pi() / arb(omega) if omega else None
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

    @abstractmethod
    def _without_grazes(self) -> None:
        """Find impacts that are grazes in the run, and compare them separately."""

    @abstractmethod
    def _impact(self, index: int, row: np.void, entry: Entry) -> bool:
        """One impact; False if the reference is not known well enough to judge it."""

    @abstractmethod
    def _contact(self, index: int, row: np.void, entry: Entry) -> bool:
        """One event of sustained contact; False as for an impact."""

    def _columns(self, errors: Sequence[float]) -> tuple[Any, ...]:
        """The errors of a state as they stand in the tables."""
        return tuple(errors)

    def _told(self) -> list[tuple[str, int]]:
        """Kinds of the events of the run, without grazes, and their rows."""
        events = self.rows.events
        return [
            (EventKind(kind).name.lower(), int(index))
            for kind, index in zip(events["kind"], events["index"], strict=True)
            if kind not in (EventKind.GRAZE, EventKind.STOP)
        ]

    def _fits(self, row: np.void, entry: Entry) -> bool:
        """Whether two events of one kind are the same event."""
        return True

    def _events(self) -> None:
        """Impacts and events of contact, in their order."""
        run, told, entries = self.rows, self._told(), self.exact.entries
        *matched, (i, j) = pairs([kind for kind, _ in told], [entry.kind for entry in entries])
        for place, other in matched:
            kind, index = told[place]
            row = run.impacts[index] if kind == "impact" else run.contacts[index]
            add = self._impact if kind == "impact" else self._contact
            if not self._fits(row, entries[other]):
                self._apart(kind, index, float(row["time"]))
                return
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

        Which impacts are listed depends on tolerances, as in pairs.py.
        """
        if not entries or entries[0].kind != "chatter" or any(k != "impact" for k, _ in told):
            return False
        limit = float(entries[0].values[0]) + CLOSE * self.sizes.time
        return bool((self.rows.impacts["time"][[index for _, index in told]] <= limit).all())

    def _ends(self) -> bool:
        """Whether only one of them ends where the model has no motion, or more than one."""
        run, ends, close = self.run, self.exact.ends, CLOSE * self.sizes.time
        time = run.final_state.time
        if ends is not None and ends < time - close:
            what = "has no one continuation"
            if self.exact.ending == "law_failed":
                what = "meets an impact for which the law has no outcome"
            said = f"the exact motion {what} at time {ends:.6g}, the run goes on"
            time = ends
        elif (
            run.stop_reason in self.dead_ends
            and not self.exact.stopped
            and (ends is None or ends > time + close)
        ):
            said = f"the run ends as {run.stop_reason} at time {time:.6g}, the exact motion goes on"
        else:
            both = self.exact.ending and run.stop_reason in self.dead_ends
            if both and self.stopped == "completed":
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
        end = self.run.final_state.time - CLOSE * self.sizes.time
        for entry in entries:
            time = float(entry.values[0])
            if not time < end:
                return
            if not (entry.kind == "impact" and entry.jump() < _WEAK):
                rows = self.impacts if entry.kind == "impact" else self.contacts
                self._apart(entry.kind, len(rows), time)
                return
            self.weak.append(entry)
            self._miss(entry, -1, math.nan)

    def _miss(self, entry: Entry, graze: int, digits: float) -> None:
        """An impact of the exact motion that the run does not have."""
        time = float(entry.values[0])
        own = entry.error() * UP
        self.missed.append((time, entry.jump(), graze, digits, own, entry.certified))

    def _apart(self, kind: str, index: int, time: float) -> None:
        """The run and the exact motion have different events."""
        number = self._number(index) if kind == "impact" else self.rows.before[1] + index
        self.failures.append(Disagreement(event=kind, number=number, time=time, reason="sequence"))
        self.stopped = "sequence"
        self.detail = f"at {kind} {number} (time {time:.6g}) the exact motion goes another way"

    def _number(self, index: int) -> int:
        """Number of a kept impact since t = 0, from 1."""
        return self.rows.before[0] + index + 1

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
            errors = [distance(float(q), ball) for q, ball in zip(row, state, strict=True)]
            proved = index < self.exact.proved_samples
            judged = self._judge(self.sizes.at(time, state), errors, state, proved)
            if judged is None:
                return
            self.sections.append((number, time, *self._columns(errors), *judged))
            self._wrong("section", number, time, judged[0])

    def _final(self) -> None:
        """The final state; after the impact, if one falls on that instant."""
        run, exact, near = self.run.final_state, self.exact, CLOSE * self.sizes.time
        known: list[tuple[Sequence[arb], bool]] = []
        numbers = final_numbers(self.run).tolist()
        if exact.final is not None:
            known.append((exact.final, exact.proved_final))
        # where the exact motion is not followed to the end, more may happen at that instant
        for entry in () if exact.stopped and exact.final is None else exact.entries:
            if abs(float(entry.values[0]) - run.time) < near:
                known.append((entry.after(), entry.certified))
        # at an impact that has no outcome; a Painleve point is not located as precisely
        same = exact.ending != "painleve" and exact.ending == self.run.stop_reason
        if same and exact.last and exact.ends and abs(exact.ends - run.time) < near:
            known.append((exact.last, exact.proved_final and exact.final is None))
        found = []
        for state, proved in known:
            errors = [distance(q, ball) for q, ball in zip(numbers, state, strict=True)]
            sizes = self.sizes.at(run.time, state)
            judged = self._judge(sizes, errors, state, proved)
            if judged is not None:
                found.append((run.time, *self._columns(errors), *judged))
        if found:
            best = max(found, key=lambda row: row[-3])  # the digits
            self.final.append(best)
            self._wrong("final_state", 0, run.time, best[-3])
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
            blur = float(value.rad()) * UP
            own = max(own, blur)
            if blur > size * 10.0 ** -(self.digits + 1):
                if self.stopped == "completed":
                    self.stopped = "precision_cap"
                    self.detail = f"the reference itself is known to {blur:.1g} only"
                return None
            least = min(least, right_digits(error, size))
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
            off = distance(value, exact)
            error = max(error, off)
            counted = max(counted, off - float(np.spacing(abs(value))))
        return error, max(counted, 0.0)


def turned(name: str, row: np.void, ball: arb) -> arb:
    """A phase, brought next to that of the row by whole turns; any other number as it is."""
    if name != "phase" or not math.isfinite(float(row[name])):
        return ball
    turns = round(float((ball - float(row[name])) / (2 * arb.pi())))
    return ball - 2 * arb.pi() * turns


def distance(value: float, ball: arb) -> float:
    """Upper bound of the distance of a number from an enclosure."""
    if not math.isfinite(value):
        return math.inf
    return float(abs(ball - arb(value)).abs_upper()) * UP


def right_digits(error: float, size: float) -> float:
    """Correct digits of a number of a size."""
    if error == 0.0:
        return MOST_DIGITS
    if size == 0.0 or not math.isfinite(error):
        return 0.0
    # no quotient, which may leave the range of doubles
    return min(MOST_DIGITS, max(0.0, math.log10(size) - math.log10(error)))

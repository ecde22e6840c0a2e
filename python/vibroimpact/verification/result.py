"""What a verification says: errors of every kept number, and from where on the run is wrong.

Errors are upper bounds of |run - exact motion| and hold the reference's own error. The digits of a
number are -log10 of its error in units of its size: for x1, v1, x2, v2 the largest value that the
motion takes (1e-8 of the largest of all, if it is less), for times the drive period (without a
drive, the largest time). A row has the digits of its worst number, at most 16, since a double has
no more. All quantities are dimensionless.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..fixed_arrays import FixedArrays

#: Numbers of an impact that are verified, besides its regime.
IMPACT_NUMBERS = ("time", "x1", "v1_pre", "v1_post", "x2", "v2_pre", "v2_post")
#: Numbers of an event of lasting contact, and those of a section.
CONTACT_NUMBERS = ("time", "x1", "v1", "x2", "v2")
SECTION_NUMBERS = ("x1", "v1", "x2", "v2")
#: A double has no more digits than these.
MOST_DIGITS = 16.0

_JUDGED = [("digits", "f8"), ("reference_error", "f8"), ("certified", "?")]
IMPACT_DTYPE = np.dtype(
    [
        ("number", "i8"),
        ("time", "f8"),
        *((f"error_{name}", "f8") for name in IMPACT_NUMBERS),
        ("regime", "i8"),
        ("regime_agrees", "?"),
        ("ambiguous", "?"),
        *_JUDGED,
        ("growth", "f8"),
    ]
)
CONTACT_DTYPE = np.dtype(
    [
        ("row", "i8"),
        ("kind", "i8"),
        ("time", "f8"),
        *((f"error_{name}", "f8") for name in CONTACT_NUMBERS),
        *_JUDGED,
        ("growth", "f8"),
    ]
)
SECTION_DTYPE = np.dtype(
    [
        ("row", "i8"),
        ("time", "f8"),
        *((f"error_{name}", "f8") for name in SECTION_NUMBERS),
        *_JUDGED,
    ]
)


@dataclass(frozen=True, kw_only=True)
class Disagreement:
    """The first event at which a run does not have the digits asked for.

    Attributes
    ----------
    event
        ``"impact"``, ``"section"``, the kind of an event of lasting contact, or ``"stop"``: the
        run ends as ``jammed`` or ``painleve`` and the exact motion goes on, or the reverse.
    number
        Of an impact its number since t = 0, counted from 1; of a stop 0; else the row in the run's
        table.
    time
        When, as the run has it.
    reason
        ``"digits"``: a number is wrong; ``"regime"``: the numbers are right, the regime is not;
        ``"sequence"``: the exact motion meets another kind of event, or none, or one more, or
        does not end where the run does.
    """

    event: str
    number: int
    time: float
    reason: str


@dataclass(frozen=True, kw_only=True, repr=False)
class Verification(FixedArrays):
    """A run beside the exact motion of its system and start, as ``verify`` returns it.

    Attributes
    ----------
    digits
        The number of correct digits asked for.
    horizon
        The first event from which on the run lacks them; None if all that was verified has them.
    impacts
        One row per verified impact of ``run.impacts``, from the first kept one on: ``number``
        (since t = 0, counted from 1), ``time``, ``error_time``, ``error_x1``, ``error_v1_pre``,
        ``error_v1_post``, ``error_x2``, ``error_v2_pre``, ``error_v2_post`` (upper bounds of the
        absolute errors), ``regime`` (that of the exact motion), ``regime_agrees``, ``ambiguous``
        (another regime, but so near the border between both that the errors explain it), ``digits``
        (those of the worst number), ``reference_error`` (largest error of the reference itself),
        ``certified`` (that error is proved; otherwise it is the difference of two precisions),
        ``growth`` (of a small perturbation of v1 at t = 0 until then, as a factor; NaN if unknown).
    contacts
        The same for ``run.contacts``: ``row``, ``kind``, ``time``, errors of time, x1, v1, x2, v2.
    sections
        The same for ``run.stroboscopic``: ``row``, ``time``, errors of x1, v1, x2, v2.
    kept
        Numbers of impacts, contact events and sections that the run holds.
    stopped
        ``"completed"``: all that the run holds is verified. Else why it ends earlier: ``"lost"``
        (the run has parted from the exact motion for good), ``"sequence"`` (other events than in
        the exact motion, or another end), ``"precision_cap"``, ``"event_cap"``, ``"undecided"``
        (an event that no precision decides, such as a graze), ``"start"`` (the reference takes the
        start for an overlap), ``"interrupted"``.
    stop_detail
        That in a sentence, with the place.
    precision
        Bits of the most precise pass that was made.
    growth
        Mean logarithmic growth of a perturbation from impact to impact; NaN if not measured.
    """

    digits: int
    horizon: Disagreement | None
    impacts: NDArray[np.void]
    contacts: NDArray[np.void]
    sections: NDArray[np.void]
    kept: tuple[int, int, int]
    stopped: str
    stop_detail: str
    precision: int
    growth: float

    @property
    def holds(self) -> bool:
        """Whether all that the run holds was verified and has the digits asked for."""
        return self.horizon is None and self.stopped == "completed"

    @property
    def certified(self) -> bool:
        """Whether every error stated here is proved: enclosures all the way, no estimate."""
        return all(bool(table["certified"].all()) for table in self._tables())

    @property
    def least_digits(self) -> float:
        """The fewest digits that any number before the horizon has; NaN if there is none."""
        end = math.inf if self.horizon is None else self.horizon.time
        digits = [table["digits"][table["time"] < end] for table in self._tables()]
        found = np.concatenate(digits)
        return float(found.min()) if len(found) else math.nan

    def _tables(self) -> tuple[NDArray[np.void], ...]:
        return self.impacts, self.contacts, self.sections

    def summary(self) -> str:
        """Say in a few lines what holds, to how many digits, until when, and how that is known."""
        lines = [self._what_holds()]
        if self.horizon is not None:
            lines += self._what_is_wrong(self.horizon)
        if self.stopped != "completed":
            lines.append(f"verified up to there only: {self.stop_detail}")
        if math.isfinite(self.growth) and self.growth > 0.01:
            every = math.log(10) / self.growth
            lines.append(
                f"differences grow: by a factor of {math.exp(self.growth):.3g} from impact to"
                f" impact on average, which costs a digit every {every:.3g} impacts"
            )
        lines.append(self._how_it_is_known())
        return "\n".join(lines)

    def _what_holds(self) -> str:
        least = self.least_digits
        if math.isnan(least):
            return "nothing is verified"
        held = f"to {math.floor(least)} digits"
        if self.horizon is None:
            words = ("impact", "contact event", "section")
            parts = [
                _counted(len(table), of, word)
                for table, of, word in zip(self._tables(), self.kept, words, strict=True)
                if of
            ]
            return f"{_listed(parts)} hold {held}"
        good = self.impacts["number"][self.impacts["time"] < self.horizon.time]
        if not len(good):
            return f"all before time {self.horizon.time:.6g} holds {held}"
        return f"impacts {good[0]} to {good[-1]} hold {held}"

    def _what_is_wrong(self, horizon: Disagreement) -> list[str]:
        what = f"fewer than {self.digits} digits"
        if horizon.reason == "regime":
            what = "the regime is wrong"
        if horizon.reason == "sequence":
            what = "the exact motion goes another way"
        which = "" if horizon.event == "stop" else f" {horizon.number}"
        place = f"{horizon.event}{which}, time {horizon.time:.6g}"
        first = math.isnan(self.least_digits)
        whence = f"from the first row kept on, {place}" if first else f"from there on ({place})"
        lines = [f"{whence}: {what}"]
        right = np.flatnonzero(self.impacts["digits"] >= 1.0)
        last = self.impacts["number"][right[-1]] if len(right) else None
        if last is not None and last != self.impacts["number"][-1]:
            lines.append(f"no digit holds after impact {last}")
        return lines

    def _how_it_is_known(self) -> str:
        tables = self._tables()
        proved = sum(int(table["certified"].sum()) for table in tables)
        total = sum(map(len, tables))
        how = f"{proved} of {total} rows by proof, the rest by two precisions"
        if proved == total:
            how = "enclosed by proof"
        elif not proved:
            how = "by two precisions, an estimate and no proof"
        errors = [float(table["reference_error"].max()) for table in tables if len(table)]
        known = f", itself known to {max(errors):.1g}" if errors else ""
        return f"the exact motion: {how}, at up to {self.precision} bits{known}"

    def __str__(self) -> str:
        """The summary."""
        return self.summary()

    def __repr__(self) -> str:
        """Say it in one line."""
        horizon = self.horizon
        end = "no horizon" if horizon is None else f"horizon {horizon.event} {horizon.number}"
        return (
            f"<Verification {self.stopped}: {len(self.impacts)} of {self.kept[0]} impacts, "
            f"{self.digits} digits asked for, {end}>"
        )


def _counted(number: int, of: int, word: str) -> str:
    how_many = f"all {of}" if number == of else f"{number} of {of}"
    return f"{how_many} {word}{'' if of == 1 else 's'}"


def _listed(parts: list[str]) -> str:
    return parts[0] if len(parts) == 1 else f"{', '.join(parts[:-1])} and {parts[-1]}"

"""The result of a verification: errors of every kept number, and where the run becomes wrong.

Errors are upper bounds of |run - exact motion|, the reference's own error included. The digits of a
number are -log10 of its error in units of its size: for x1, v1, x2, v2 the largest value that the
motion takes in the last period before the row, for times the drive period, or 2 pi if that is less
(more exactly in sizes.py, and of structures in structure_sizes.py). The rounding of a time to a
double does not count. A row has the digits of its worst number, at most 16, since a double has no
more. All quantities are dimensionless; those of a structure are in its units.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import NDArray

from ..fixed_arrays import FixedArrays
from ..interruption import interruptible
from ..showing import Facts, Shown
from ..verbs import verb

if TYPE_CHECKING:
    from matplotlib.axes import Axes

#: Why a pass of the reference, or a verification, ends early: see `Verification.stopped`. Only a
#: pass is ``unproved``: there enclosures end, and two passes are compared.
Early = Literal[
    "lost",
    "sequence",
    "precision_cap",
    "event_cap",
    "undecided",
    "start",
    "interrupted",
    "unproved",
]
Stopped = Literal["completed"] | Early


@interruptible
@dataclass(frozen=True, kw_only=True)
class Disagreement:
    """The first event at which a run does not have the digits asked for.

    Attributes
    ----------
    event
        ``"impact"``, ``"section"``, the kind of an event of sustained contact, ``"graze"`` (of the
        run, where the exact motion has an impact), ``"final_state"``, or ``"stop"``: the run ends
        as ``jammed``, ``painleve`` or ``law_failed`` (a structure's also as ``simultaneous``,
        ``sequence_cap`` or ``several_frictional``) and the exact motion goes on, or the reverse.
    number
        Of an impact its number since t = 0, counted from 1; of a stop or the final state 0; else
        the row in the table of a run that keeps all.
    time
        When, as the run has it.
    reason
        ``"digits"``: a number is wrong; ``"regime"``: the numbers are right, but the regime is
        wrong; ``"sequence"``: the exact motion meets another kind of event, or none, or one more,
        or does not end where the run does.

    Examples
    --------
    >>> import vibroimpact as vi
    >>> system = vi.System(mass_ratio=0.6, frequency_ratio=2, restitution=0.8, gap=0.5,
    ...                    drive_frequency=1.8, moment_amplitude=1)
    >>> check = vi.verify(vi.simulate(system, initial=(0, 0.5, 0, 0), periods=10))
    >>> check.horizon is None  # nothing disagrees
    True
    >>> vi.Disagreement(event="impact", number=7, time=20.5, reason="digits")
    Disagreement(event='impact', number=7, time=20.5, reason='digits')
    """

    event: str
    number: int
    time: float
    reason: str


@interruptible
@dataclass(frozen=True, kw_only=True, repr=False)
class Verification(FixedArrays, Shown):
    """The comparison of a run with the exact motion of its system and start, by ``verify``.

    Tables of a structure's run have the column ``stop``, and in place of x1, v1, x2, v2 its
    ``error_q``, ``error_v``, ``error_v_pre``, ``error_v_post``, arrays (N,) for each row (of a
    structure `from_modes` in its modal coordinates), and ``error_approach_velocity``.

    Attributes
    ----------
    digits
        The number of correct digits asked for.
    horizon
        The first event since t = 0, kept or not, at which the run lacks them; None if all that was
        verified has them.
    impacts
        One row per verified impact of ``run.impacts``, from the first kept one on: ``number``
        (since t = 0, counted from 1), ``time``, ``error_time`` (of ``time``, and of
        ``time_in_period`` with ``period``), ``error_x1``, ``error_v1_pre``, ``error_v1_post``,
        ``error_x2``, ``error_v2_pre``, ``error_v2_post``, ``error_phase``,
        ``error_impulse_normal``, ``error_impulse_tangential`` (NaN where sin x1 = 0 leaves it no
        sign), ``error_energy_loss`` (upper bounds of the
        absolute errors), ``regime`` (that of the exact motion), ``regime_agrees``, ``ambiguous``
        (another regime, but so near the border between both that the errors explain it), ``digits``
        (those of the worst number), ``reference_error`` (largest error of the reference itself),
        ``certified`` (that error is proved; otherwise it is the difference of two precisions),
        ``growth`` (of a small perturbation of v1 at t = 0 until then, as a factor; NaN if unknown).
    contacts
        One row per verified row of ``run.contacts``: ``row``, ``kind``, ``time``, errors of time,
        x1, v1, x2, v2. Its phase, its forces and what it says of the chatter are not compared.
    sections
        One row per verified row of ``run.stroboscopic``: ``row``, ``time``, errors of x1, v1, x2,
        v2.
    whole_impacts, whole_contacts, whole_sections
        These tables from t = 0 on, kept or not, with ``row`` as in a run that keeps all. What the
        run has not kept was made again.
    final
        One row for ``run.final_state``: ``time``, errors of x1, v1, x2, v2; none if it was not
        reached, at a Painleve point, or within the end of a chatter.
    missed
        Impacts of the exact motion since t = 0 that the run does not have: ``time``, ``jump`` (how
        much they change a velocity), ``graze`` (row of the graze of the run in its place, -1 if
        there is none: the weakest of a chatter in which the run ends), ``digits`` (of the graze,
        beside the states before and after the impact; else NaN), and ``reference_error``,
        ``certified`` as above.
    kept
        Numbers of impacts, contact events and sections that the run holds.
    first_kept, kept_from
        Where its window begins: number since t = 0 of its first impact (the next one, if it has
        none), and the time.
    from_start
        False if the run comes from another version, and simulated again has other bits: then only
        the part that it keeps is judged.
    stopped
        ``"completed"``: all that the run holds is verified. Else why it ends earlier: ``"lost"``
        (the run has left the exact motion for good: 40 impacts or sections in a row are far off,
        and it is not periodic at the end), ``"sequence"`` (other events than in the exact motion,
        or another end), ``"precision_cap"``, ``"event_cap"``, ``"undecided"`` (an event that no
        precision decides, such as a graze), ``"start"`` (the reference takes the start for an
        overlap), ``"interrupted"``.
    stop_detail
        That in a sentence, with the place.
    precision
        Bits of the most precise pass that was made.
    growth
        Mean logarithmic growth of a perturbation from impact to impact; NaN if not measured.

    Examples
    --------
    >>> import vibroimpact as vi
    >>> system = vi.System(mass_ratio=0.6, frequency_ratio=2, restitution=0.8, gap=0.5,
    ...                    drive_frequency=1.8, moment_amplitude=1)
    >>> check = vi.verify(vi.simulate(system, initial=(0, 0.5, 0, 0), periods=10))
    >>> check.certified, check.holds
    (True, True)
    """

    digits: int
    horizon: Disagreement | None
    impacts: NDArray[np.void]
    contacts: NDArray[np.void]
    sections: NDArray[np.void]
    whole_impacts: NDArray[np.void]
    whole_contacts: NDArray[np.void]
    whole_sections: NDArray[np.void]
    final: NDArray[np.void]
    missed: NDArray[np.void]
    kept: tuple[int, int, int]
    first_kept: int
    kept_from: float
    from_start: bool
    stopped: Stopped
    stop_detail: str
    precision: int
    growth: float

    @property
    def holds(self) -> bool:
        """Whether all that the run holds was verified and has the digits asked for.

        For a run that keeps nothing: whether its whole motion has. False if nothing was verified.
        """
        if not any(self.kept) and self.horizon is not None:
            return False
        grazes = self.missed["digits"][self.missed["time"] > self.kept_from]
        return (
            self.stopped == "completed"
            and any(map(len, self._tables()))
            and not bool((grazes < self.digits).any())
            and all(bool(good.all()) for good in self._right())
        )

    @property
    def certified(self) -> bool:
        """Whether errors are stated and all proved: enclosures all the way, no estimate."""
        tables = (*self._whole(), self.missed)
        return any(map(len, self._whole())) and all(
            bool(table["certified"].all()) for table in tables
        )

    @property
    def least_digits(self) -> float:
        """The fewest digits of any number before the horizon, kept or not; NaN if none is."""
        end = math.inf if self.horizon is None else self.horizon.time
        digits = [table["digits"][table["time"] < end] for table in self._whole()]
        found = np.concatenate(digits)
        return float(found.min()) if len(found) else math.nan

    @property
    def last_right(self) -> int:
        """Number since t = 0 of the last impact with at least one right digit; 0 if none has."""
        right = np.flatnonzero(self.whole_impacts["digits"] >= 1.0)
        return int(self.whole_impacts["number"][right[-1]]) if len(right) else 0

    def _tables(self) -> tuple[NDArray[np.void], ...]:
        return self.impacts, self.contacts, self.sections, self.final

    def _whole(self) -> tuple[NDArray[np.void], ...]:
        return self.whole_impacts, self.whole_contacts, self.whole_sections, self.final

    def _right(self) -> list[NDArray[np.bool_]]:
        """Which of the kept rows have the digits asked for, and the regime."""
        right = [table["digits"] >= self.digits for table in self._tables()]
        right[0] &= self.impacts["regime_agrees"] | self.impacts["ambiguous"]
        return right

    def summary(self) -> str:
        """Return a summary in a few lines: digits, until when, and how that is known.

        Examples
        --------
        >>> print(check.summary().splitlines()[0])
        all 9 impacts, all 10 sections and the final state hold to 14 digits
        """
        return "\n".join(_sentences(self))

    def plot(self, **options: Any) -> Axes:
        """Draw the right digits against time, by ``vi.plot.verification``.

        Parameters
        ----------
        **options
            As in ``vi.plot.verification``.

        Returns
        -------
        matplotlib.axes.Axes

        Examples
        --------
        >>> check.plot().get_ylabel()
        'right digits'
        """
        axes: Axes = verb("draw")(self, **options)
        return axes

    def __str__(self) -> str:
        """The summary."""
        return self.summary()

    def _facts(self) -> Facts:
        horizon = self.horizon
        facts: Facts = {
            "digits asked for": self.digits,
            "impacts verified": f"{len(self.impacts)} of {self.kept[0]}",
            "stopped": self.stopped,
        }
        if horizon is not None:
            place = f"{horizon.event} {horizon.number} at time {horizon.time:.6g}"
            facts["horizon"] = f"{place}: {horizon.reason}"
        return facts

    def __repr__(self) -> str:
        """Say it in one line."""
        horizon = self.horizon
        end = "no horizon" if horizon is None else f"horizon {horizon.event} {horizon.number}"
        return (
            f"<Verification {self.stopped}: {len(self.impacts)} of {self.kept[0]} impacts, "
            f"{self.digits} digits asked for, {end}>"
        )


# The summary. Each sentence names its impacts by their numbers since t = 0. One sentence says how
# far the comparison goes, others how far the digits are right.


def _sentences(found: Verification) -> list[str]:
    """Say what holds, to how many digits, until when, and how that is known."""
    horizon, lines = found.horizon, list[str]()
    if horizon is None or found.kept_from:
        lines.append(_kept(found))
    if horizon is not None or not any(map(len, found._tables())):
        lines += [_held(found)] if any(map(len, found._whole())) else []
    if horizon is not None:
        lines += _horizon(found, horizon)
    lines += _missed(found)
    if found.stopped != "completed":
        lines.append(_end(found))
    else:
        lines += [found.stop_detail] if found.stop_detail else []
        if not len(found.final):
            where = "where the model ends" if found.stop_detail else "within the end of a chatter"
            lines.append(f"the final state is not compared: it lies {where}")
    if not found.from_start:
        lines.append(
            "only what is kept is judged: made again, this run does not get the same numbers"
            " (another version made it)"
        )
    if math.isfinite(found.growth) and found.growth > 0.01:
        every = math.log(10) / found.growth
        lines.append(
            f"differences grow: by a factor of {math.exp(found.growth):.3g} from impact to"
            f" impact on average, which costs a digit every {every:.3g} impacts"
        )
    if any(map(len, found._whole())):
        lines.append(_how_it_is_known(found))
    return lines


def _kept(found: Verification) -> str:
    """The part of the kept rows that is verified, and has the digits."""
    tables, of = found._tables(), found.kept
    right = [int(good.sum()) for good in found._right()]
    if not any((*of, *right)):
        return "nothing is kept"
    if not any(map(len, tables)):
        return "nothing that is kept is verified"
    if not any(right):
        return f"nothing that is kept holds {found.digits} digits"
    words = ("impact", "contact event", "section")
    every = [*zip(right[:3], of, words, strict=True)]
    parts = [_counted(*part) for part in every if part[1]]
    if parts and found.kept_from:
        parts[-1] += " that are kept"
    if right[3]:
        parts.append("the final state")
    least = min(
        float(table["digits"][good].min())
        for table, good in zip(tables, found._right(), strict=True)
        if good.any()
    )
    hold = "hold" if len(parts) > 1 or any(of) else "holds"
    said = f"{_listed(parts)} {hold} to {math.floor(least)} digits"
    return said if right[3] or not len(found.final) else f"{said}, the final state does not"


def _held(found: Verification) -> str:
    """Up to where the whole motion has the digits, and where the window begins."""
    least, horizon, impacts = found.least_digits, found.horizon, found.whole_impacts
    end = math.inf if horizon is None else horizon.time
    good = impacts[impacts["time"] < end]
    if math.isnan(least):
        held = f"nothing of the run holds {found.digits} digits"
    else:
        times = [table["time"][table["time"] < end] for table in found._whole()]
        last = max(float(each.max()) for each in times if len(each))
        until = _impact(good[-1]) if len(good) else f"time {last:.6g}"
        held = f"the run holds {math.floor(least)} digits up to {until}"
    if not found.kept_from:
        return held
    place = f"time {found.kept_from:.6g}"
    if found.kept[0]:
        place = f"impact {found.first_kept} ({place})"
    return f"{held}; its window begins at {place}"


def _horizon(found: Verification, horizon: Disagreement) -> list[str]:
    """What follows when the digits are lost, and where the last right one is."""
    impacts, lines = found.whole_impacts, list[str]()
    if horizon.reason == "sequence":
        if found.stopped != "sequence":
            lines.append(f"at {_where(horizon)} the exact motion goes another way")
    elif horizon.reason == "regime":
        lines.append(f"{_where(horizon)} is the first with a wrong regime")
    else:
        lines.append(_first_wrong(found, horizon))
    with_a_digit = np.flatnonzero(impacts["digits"] >= 1.0)
    if len(with_a_digit) and with_a_digit[-1] < len(impacts) - 1:
        lines.append(f"{_impact(impacts[with_a_digit[-1]])} is the last with a right digit")
    return lines


def _missed(found: Verification) -> list[str]:
    """The impacts of the exact motion that the run does not have."""
    lines, missed = list[str](), found.missed
    of_graze = missed["graze"] >= 0
    for rows, where in (
        (missed[of_graze], "a graze of the run, without impulse"),
        (missed[~of_graze], "not in the run, which ends in their chatter"),
    ):
        if len(rows):
            many, strongest = len(rows), float(rows["jump"].max())
            what = "impact of the exact motion is" if many == 1 else "impacts of the exact motion,"
            each = "" if many == 1 else " each"
            lines.append(
                f"{many} {what}{each} {where}; the velocities jump there by up to {strongest:.2g}"
            )
    return lines


def _first_wrong(found: Verification, horizon: Disagreement) -> str:
    """The horizon, and the last wrong row if right ones follow."""
    few = f"fewer than {found.digits} digits"
    impacts = found.whole_impacts
    wrong = np.flatnonzero(impacts["digits"] < found.digits)
    if horizon.event == "impact" and len(wrong) and wrong[-1] < len(impacts) - 1:
        if len(wrong) == 1:
            return f"{_where(horizon)} is the only impact with {few}"
        last = _impact(impacts[wrong[-1]])
        return f"{_where(horizon)} is the first with {few}, {last} the last"
    return f"{_where(horizon)} is the first with {few}"


def _end(found: Verification) -> str:
    """Where the comparison ends, and why."""
    if found.stopped == "sequence":
        return f"the comparison ends: {found.stop_detail}"
    rows = [table["time"] for table in found._whole() if len(table)]
    last = max((float(times.max()) for times in rows), default=math.nan)
    if math.isnan(last):
        return f"nothing is compared: {found.stop_detail}"
    impacts = found.whole_impacts
    place = f"time {last:.6g}"
    if len(impacts) and impacts["time"][-1] == last:
        place = _impact(impacts[-1])
    elif len(impacts):
        place = f"time {last:.6g}, after impact {impacts['number'][-1]}"
    return f"the comparison ends at {place}: {found.stop_detail}"


def _impact(row: np.void) -> str:
    return f"impact {row['number']} (time {row['time']:.6g})"


def _where(horizon: Disagreement) -> str:
    if horizon.event in ("stop", "final_state"):
        return f"the {horizon.event.replace('_', ' ')} (time {horizon.time:.6g})"
    return f"{horizon.event} {horizon.number} (time {horizon.time:.6g})"


def _how_it_is_known(found: Verification) -> str:
    tables: tuple[NDArray[np.void], ...] = found._whole()
    proved = sum(int(table["certified"].sum()) for table in tables)
    total = sum(map(len, tables))
    how = f"{proved} of {total} rows by proof, the rest by two precisions"
    if proved == total:
        how = "enclosed by proof"
    elif not proved:
        how = "by two precisions, an estimate and no proof"
    error = max(float(table["reference_error"].max()) for table in tables if len(table))
    bits = f"at up to {found.precision} bits"
    return f"the exact motion: {how}, {bits}, itself known to {error:.1g}"


def _counted(number: int, of: int, word: str) -> str:
    how_many = f"all {of}" if number == of else f"{number} of {of}"
    return f"{how_many} {word}{'' if of == 1 else 's'}"


def _listed(parts: list[str]) -> str:
    return parts[0] if len(parts) == 1 else f"{', '.join(parts[:-1])} and {parts[-1]}"

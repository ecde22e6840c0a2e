"""What a verification comes to, in a few plain sentences.

Each sentence names its impacts by their numbers since t = 0. To be compared and to hold are two
things: how far the comparison goes is told in one sentence, how far the digits are right in others.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from .result import Disagreement, Verification


def sentences(found: Verification) -> list[str]:
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
    """What of the kept rows is verified, and holds."""
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
    """Up to where the whole motion holds, and where the window begins."""
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
    """What comes when the digits are lost, and where the last right one is."""
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
    """What impacts of the exact motion the run does not have."""
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

"""Passes of the reference at some precision, and what they say together of the exact motion.

First by enclosures, which prove every digit they give. How far one pass gets shows how fast they
widen, and so the precision that the rest needs: the next pass has it, if the cap allows, else there
is none. What enclosures do not reach (complete chatter, sustained contact of a system, motions that
widen them faster than precision rises) comes from two passes of different precision, tolerance and
order, from midpoint to midpoint, precision rising until they agree; their difference is an estimate
of the error and no bound. A last pass from a start shifted by a tiny amount measures the growth of
perturbations. Parameters and start are the exact doubles.

An event that no precision decides (`undecided`) is told from enclosures that have become too wide
to decide (`precision_cap`) by their width: GOOD at most.
"""

from __future__ import annotations

import itertools
import math
from array import array
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Literal, Protocol

from flint import arb, ctx

from .pairs import pairs
from .result import Early

#: The reference is precise enough if its error is below this: four digits more than a double.
GOOD = 1e-20
#: Bits of the first pass.
FIRST = 256
#: More bits than the extrapolation gives, and the least step of precision.
_RESERVE, _STEP = 1.1, 1.25
#: A difference counts if it is above the first part of the shift (else it may be an error), and
#: below the second number (else its growth is not linear).
_UNSEEN, _LINEAR = 1e-6, 1e-4


@dataclass(frozen=True)
class Entry:
    """An impact or an event of contact: values as MOTION_NUMBERS, radii the reference's error.

    `more` has those of FURTHER_NUMBERS, of an impact only; None where one has no value.
    """

    kind: str
    values: tuple[arb, ...]
    regime: str | None = None
    certified: bool = False
    growth: float = math.nan
    more: tuple[arb | None, ...] = ()

    def error(self) -> float:
        """Largest error of the values."""
        return max(float(value.rad()) for value in self.values)

    def is_like(self, other: Entry) -> bool:
        """Whether an event of the same kind in another pass is this one."""
        return self.regime == other.regime

    def jump(self) -> float:
        """How much an impact changes the velocities."""
        _, _, v1_pre, v1_post, _, v2_pre, v2_post = self.values
        return max(abs(float(v1_post - v1_pre)), abs(float(v2_post - v2_pre)))

    def after(self) -> tuple[arb, ...]:
        """The state after it."""
        _, x1, _, v1, x2, _, v2 = self.values
        return x1, v1, x2, v2


@dataclass(frozen=True)
class Pass:
    """The result of the reference, and why it ended ("" if it reached the end).

    The first `proved_samples` states are enclosures; a state is None where it is not known.
    `final` is the state at the time at which the run ends, None likewise. `ends` is the time beyond
    which the exact motion has no, or no one, continuation, `ending` why, and `last` the state
    there; None and "" if there is none. `looks` are rough values of the motion in between, as in
    path.py. `blur` is the largest radius of time and state where the pass ended.
    """

    bits: int
    entries: Sequence[Entry]
    samples: Sequence[tuple[arb, ...] | None]
    proved_samples: int = 0
    stopped: Early | Literal[""] = ""
    detail: str = ""
    ends: float | None = None
    ending: str = ""
    last: tuple[arb, ...] | None = None
    final: tuple[arb, ...] | None = None
    proved_final: bool = False
    looks: array[float] = field(default_factory=lambda: array("d"), repr=False)
    blur: float = 0.0


class Followed(Protocol):
    """What a kind of machine provides: passes of its reference."""

    @property
    def nudges(self) -> tuple[str, str] | None:
        """Shifts of the start for the growth in flights, and through contact; None: unmeasured."""

    @property
    def spreads_until(self) -> float:
        """The time until which differences are expected to grow."""

    def follow(self, bits: int, *, enclose: bool, nudge: str = "0") -> Pass:
        """One pass; `stopped` says what ended it early, also Ctrl-C.

        With `enclose` it ends where nothing can be proved any more; else its states are rounded.
        `nudge` is added to a velocity at the start.
        """


def exact_motion(problem: Followed, max_precision: int) -> Pass:
    """The exact motion; with `interrupted` what there is."""
    bits, before = min(FIRST, max_precision), 0.0
    while True:
        proof = problem.follow(bits, enclose=True)
        if _settled(proof):
            return _with_growth(problem, proof)
        if proof.stopped == "interrupted":
            return _certified_part(proof)
        known = _certified_part(proof)
        narrow = proof.blur < GOOD and len(known.entries) == len(proof.entries)
        time = _time(known.entries)
        if (proof.stopped == "unproved" and narrow) or time < 1.1 * before:
            break  # no enclosure goes on from here, or more precision does not help
        before = time
        wanted = max(_STEP * bits, _needed(bits, time, problem.spreads_until))
        if wanted > max_precision:
            break
        bits = min(max_precision, _whole(wanted))
    compared = _compared(problem, max_precision)
    return _with_growth(problem, _joined(_certified_part(proof), compared))


def _needed(bits: int, time: float, until: float) -> float:
    """Bits with which a pass is good until a time, from those with which another one was."""
    lasting = -math.log2(GOOD)
    return math.inf if not time else lasting + _RESERVE * (bits - lasting) * until / time


def _time(entries: Sequence[Entry]) -> float:
    """The time of the last event."""
    return float(entries[-1].values[0]) if entries else 0.0


def _below(entries: Sequence[Entry]) -> list[Entry]:
    """The first events, as far as they are precise enough."""
    return list(itertools.takewhile(lambda entry: entry.error() < GOOD, entries))


def _settled(done: Pass) -> bool:
    """Whether a pass proves everything that can be known."""
    decided = done.stopped in ("", "lost", "start", "event_cap") and done.blur < GOOD
    return decided and all(entry.certified and entry.error() < GOOD for entry in done.entries)


def _certified_part(done: Pass) -> Pass:
    """The proved part of a pass, as far as it is precise enough.

    A state that is not known between events that are known lies at one of them; after the last one
    it may be that the balls are too wide.
    """
    entries = list(itertools.takewhile(lambda entry: entry.certified, _below(done.entries)))
    proved, known = done.samples[: done.proved_samples], 0
    for place, state in enumerate(proved):
        if state is not None and not _narrow(state):
            break
        known = place + 1 if state is not None else known
    final = done.final if done.final and _narrow(done.final) else None
    samples = proved[:known]
    return replace(done, entries=entries, samples=samples, proved_samples=known, final=final)


def _narrow(state: Sequence[arb]) -> bool:
    return max(float(value.rad()) for value in state) < GOOD


def _compared(problem: Followed, max_precision: int) -> Pass:
    """Two passes that agree, or the last of those that a cap on precision allows.

    Two pairs of passes show how many bits more of the motion need. No pair is followed if the cap
    is lower.
    """
    one = problem.follow(FIRST, enclose=False)
    before: tuple[int, float] | None = None
    bits = 2 * FIRST
    while True:
        if one.stopped == "interrupted":
            return replace(one, entries=[], samples=[])
        two = problem.follow(bits, enclose=False)
        both, agree = _difference(one, two)
        if two.stopped == "interrupted" or agree:
            return both
        time = _time(_below(both.entries))
        # bits of the coarser pass of the next pair, which the time grows with
        coarse, fine = float(two.bits), 2.0
        if before is not None:
            gained = (time - before[1]) / (one.bits - before[0])
            more = math.inf if gained <= 0 else (problem.spreads_until - time) / gained
            coarse, fine = max(coarse, one.bits + _RESERVE * more), _STEP
        if fine * coarse > max_precision:
            said = f"precisions of {one.bits} and {two.bits} bits agree until time {time:.6g}"
            if before is not None and math.isfinite(coarse):
                said += f"; about {100 * math.ceil(coarse / 100)} bits are needed"
            return replace(both, stopped="precision_cap", detail=said)
        before = one.bits, time
        one = two if coarse == two.bits else problem.follow(_whole(coarse), enclose=False)
        bits = min(max_precision, _whole(fine * coarse))


def _whole(bits: float) -> int:
    return 64 * math.ceil(bits / 64)


def _difference(one: Pass, two: Pass) -> tuple[Pass, bool]:
    """The finer pass with its differences to the other as errors, and whether they agree."""
    *matched, (i, j) = pairs([e.kind for e in one.entries], [e.kind for e in two.entries])
    agree = one.stopped == two.stopped and (one.ends is None) == (two.ends is None)
    left, right = one.entries[i:], two.entries[j:]
    if one.stopped in ("event_cap", "lost"):
        # the end may be inside a chatter, of which both list different numbers of impacts
        agree = agree and any(all(e.kind == "impact" for e in rest) for rest in (left, right))
    else:
        agree = agree and not left and not right
    entries = []
    with ctx.workprec(two.bits):
        for p, q in matched:
            coarse, fine = one.entries[p], two.entries[q]
            values = together(coarse.values, fine.values)
            more = _joint(coarse.more, fine.more)
            if not coarse.is_like(fine):
                agree = False
                break
            entries.append(replace(fine, values=values, more=more, certified=False))
        samples = [_state(p, q) for p, q in zip(one.samples, two.samples, strict=False)]
        final, last = _state(one.final, two.final), _state(one.last, two.last)
    agree = agree and len(_below(entries)) == len(entries)
    both = replace(two, entries=entries, samples=samples, proved_samples=0)
    return replace(both, final=final, last=last, proved_final=False), agree


def together(coarse: Sequence[arb], fine: Sequence[arb]) -> tuple[arb, ...]:
    """The finer values with radii that include the coarser ones."""
    return tuple(
        arb(q.mid(), (abs(p - q) + q.rad()).abs_upper()) for p, q in zip(coarse, fine, strict=True)
    )


def _state(coarse: Sequence[arb] | None, fine: Sequence[arb] | None) -> tuple[arb, ...] | None:
    """The finer state with such radii, if both passes have it."""
    if coarse is None or fine is None:
        return None
    return together(coarse, fine)


def _joint(coarse: Sequence[arb | None], fine: Sequence[arb | None]) -> tuple[arb | None, ...]:
    """The finer values with such radii, None where one is missing."""
    return tuple(
        None if p is None or q is None else together((p,), (q,))[0]
        for p, q in zip(coarse, fine, strict=True)
    )


def _joined(proof: Pass, compared: Pass) -> Pass:
    """The proved part, continued by comparison of two passes."""
    *matched, _ = pairs([e.kind for e in proof.entries], [e.kind for e in compared.entries])
    entries = list(compared.entries)
    for i, j in matched:
        entries[j] = proof.entries[i]
    if len(proof.entries) > len(entries) and all(e.kind == "impact" for e in entries):
        entries = list(proof.entries)
    samples = [*proof.samples, *compared.samples[len(proof.samples) :]]
    bits = max(proof.bits, compared.bits)
    known = len(proof.samples)
    done = replace(compared, bits=bits, entries=entries, samples=samples, proved_samples=known)
    if proof.final is not None:
        done = replace(done, final=proof.final, proved_final=True)
    return replace(done, looks=proof.looks + compared.looks)


def _with_growth(problem: Followed, done: Pass) -> Pass:
    """The result, with the growth of a perturbation until each entry."""
    if problem.nudges is None or done.stopped in ("interrupted", "start") or not done.entries:
        return done
    held = any(entry.kind != "impact" for entry in done.entries)
    nudge = problem.nudges[held]
    moved = problem.follow(FIRST, enclose=False, nudge=nudge)
    *matched, _ = pairs([e.kind for e in done.entries], [e.kind for e in moved.entries])
    entries = list(done.entries)
    for i, j in matched:
        here, there = entries[i].values, moved.entries[j].values
        far = max(float(abs(p.mid() - q.mid())) for p, q in zip(here, there, strict=True))
        if far > _LINEAR or not entries[i].is_like(moved.entries[j]):
            break
        growth = far / float(nudge)
        entries[i] = replace(entries[i], growth=growth if growth > _UNSEEN else 0.0)
    return replace(done, entries=entries)

"""The exact motion of a run's system and start, by the reference, with sufficient precision.

First by enclosures, which prove every digit they give: precision rises until all are narrow, as far
as the cap allows. What they do not reach (complete chatter, sustained contact, motions that widen
them faster than precision rises) comes from two passes of different precision, tolerance and order,
precision doubling until they agree; their difference is an estimate of the error and no bound. A
last pass from a start shifted by a tiny amount measures the growth of perturbations. Parameters and
start are the exact doubles. Source: theory page, sections 1 to 5.
"""

from __future__ import annotations

import math
from array import array
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from typing import Literal

from flint import arb, ctx, fmpq

from ..reference.contact import Undecided
from ..reference.flight import System as ExactSystem
from ..reference.flight import exact
from ..reference.hold import Phase
from ..reference.hybrid import Motion, approach_in_contact
from ..reference.simulate import Event
from ..reference.slide import Settings, Touch
from ..system import SYMBOLS, System
from .path import Parted, Path
from .result import Early
from .watch import Watch

#: The reference is precise enough if its error is below this: four digits more than a double.
GOOD = 1e-20
#: Bits of the first pass, and those that enclosures lose from impact to impact, as a first guess.
FIRST, _LOST = 256, 6
#: Shifts of v1(0) that show how perturbations grow, in flights and, less exact, through contact.
#: A difference counts if it is above the first part of the shift (else it may be an error), and
#: below the second number (else its growth is not linear).
_NUDGES, _UNSEEN, _LINEAR = ("1e-30", "1e-18"), 1e-6, 1e-4
#: Endings beyond which the model has no motion, or more than one.
DEAD_ENDS = ("jammed", "painleve", "law_failed")
#: Phases that only repeat an impact, or the start.
ECHOES = ("impact", "impact_at_start")
#: Phases of sustained contact.
HOLDS = ("closed", "slide_positive", "slide_negative", "stick")


@dataclass(frozen=True)
class Problem:
    """What is followed: exact parameters, start, times of sections, and the end.

    `times` makes the times of the sections and, last, a time past the end of the run, at the
    working precision; `end` makes the time at which the run ends. `watch` looks at each impact and
    section, and says whether the run has left the motion for good. At most `most_impacts` are
    followed.
    """

    system: ExactSystem
    initial: tuple[fmpq, ...]
    phase: fmpq
    law: str
    times: Callable[[], Sequence[arb]]
    end: Callable[[], arb]
    watch: Watch
    most_impacts: int


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
    which the exact motion has no, or no one, continuation, `ending` (one of DEAD_ENDS) why, and
    `last` the state there; None and "" if there is none. `looks` are rough values of the motion in
    between, as in path.py.
    """

    bits: int
    entries: list[Entry]
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


def exact_system(system: System) -> ExactSystem:
    """The parameters as exact rationals."""
    values = {symbol: getattr(system, name) for symbol, name in SYMBOLS.items()}
    return ExactSystem.parse(values, system.contact)


class _Unproved(Exception):
    """Nothing is proved from here on."""


class _Followed(Motion):
    """A motion that ends when the run has left it, or when an enclosure ends."""

    watch: Watch

    def _contact(
        self, touch: Touch, event: str | None = None, error: arb | None = None
    ) -> str | None:
        if self.enclosing:
            raise _Unproved
        return super()._contact(touch, event, error)

    def _tell(self, entry: Event | Phase) -> None:
        super()._tell(entry)
        if isinstance(entry, Event) and self.watch.impact(self.impacts - 1, entry.time):
            raise Parted


def follow(problem: Problem, bits: int, *, enclose: bool, nudge: str = "0") -> Pass:
    """One pass; `stopped` says what ended it early, also Ctrl-C.

    `nudge` is added to v1 at the start.
    """
    start = list(problem.initial)
    # a start at rest on the contact stays there
    touching = approach_in_contact(problem.system, start) == 0
    start[1] += exact(nudge)
    start[3] += exact(nudge) if touching else 0
    tolerance = 10.0 ** -min(300.0, 0.13 * bits)
    settings = Settings(bits, order=max(20, bits // 8), tolerance=tolerance)
    stopped: Early | Literal[""] = ""
    detail = ending = ""
    problem.watch.begin(bits)
    with ctx.workprec(bits):
        moments = Path(problem.times(), problem.end(), problem.watch, problem.system)
        motion = _Followed(
            problem.system,
            start,
            moments,
            problem.phase,
            settings,
            problem.law,
            enclose=enclose,
            quick=True,
            most_impacts=problem.most_impacts,
        )
        motion.watch = problem.watch
        try:
            ending = motion.run().ending
        except Parted:
            stopped, detail = "lost", "the run has parted from the exact motion for good"
        except _Unproved:
            stopped, detail = "unproved", "complete chatter or sustained contact"
        except Undecided as doubt:
            stopped, detail = "undecided", str(doubt)
        except ValueError as error:
            stopped = "undecided" if motion.story else "start"
            detail = str(error)
        except RuntimeError as error:
            stopped, detail = "event_cap", f"{error} (max_events)"
        except KeyboardInterrupt:
            stopped, detail = "interrupted", "interrupted"
        entries = [
            _entry(told, place < motion.proved, problem)
            for place, told in enumerate(motion.story)
            if not (isinstance(told, Phase) and told.event in ECHOES)
        ]
        done = Pass(bits, entries, moments.states, motion.proved_samples, stopped, detail)
        done = replace(done, final=moments.final, proved_final=enclose, looks=moments.looks)
        if ending in DEAD_ENDS:
            last = (motion.x1, motion.v1, motion.x2, motion.v2)
            done = replace(done, ending=ending, ends=float(motion.now), last=last)
    return done


def _entry(told: Event | Phase, proved: bool, problem: Problem) -> Entry:
    if isinstance(told, Event):
        velocities = (told.v1_pre, told.v1_post, told.x2, told.v2_pre, told.v2_post)
        more = _impulses(told, problem)
        return Entry("impact", (told.time, told.x1, *velocities), told.regime, proved, more=more)
    x1, v1, x2, v2 = told.state
    return Entry(told.event, (told.time, x1, v1, v1, x2, v2, v2), None, proved)


def _impulses(told: Event, problem: Problem) -> tuple[arb | None, ...]:
    """Phase (not reduced), normal and tangential impulse, and energy loss of an impact.

    The moment balance of body 1, v1' - v1 = -cos x1 P + sin x1 T, gives T, and where sin x1 = 0 it
    has none; the loss is (v1^2 - v1'^2)/2 - P (v2 + v2')/2, finite for mbar = 0.
    """
    system, normal = problem.system, told.impulse
    phase = arb(system.omega) * told.time + arb(problem.phase)
    if normal is None:
        return phase, None, None, None
    change = told.v1_post - told.v1_pre
    tangential: arb | None = arb(0)
    if system.mu != 0:
        sine = told.x1.sin()
        known = not sine.contains(0)
        tangential = (change + told.x1.cos() * normal) / sine if known else None
    loss = -change * (told.v1_pre + told.v1_post) / 2
    loss -= normal * (told.v2_pre + told.v2_post) / 2
    return phase, normal, tangential, loss


def exact_motion(problem: Problem, impacts: int, max_precision: int) -> Pass:
    """The exact motion, for a run of about so many impacts; with `interrupted` what there is."""
    bits = min(max_precision, _rounded(FIRST + _LOST * min(impacts, 100)))
    before = 0
    while True:
        proof = follow(problem, bits, enclose=True)
        if _settled(proof):
            return _with_growth(problem, proof)
        if proof.stopped == "interrupted":
            return _certified_part(proof)
        known = sum(entry.error() < GOOD for entry in proof.entries) + 1
        needed = _rounded(bits * min(2.0, max(1.25, 1.1 * (impacts + 1) / known)))
        if known > impacts + 1 or known < 1.1 * before:
            break  # a chatter in which the run ends, or more precision does not help
        before = known
        narrow = known > len(proof.entries)
        if needed > max_precision or (proof.stopped == "unproved" and narrow):
            break
        bits = needed
    compared = _compared(problem, max_precision)
    return _with_growth(problem, _joined(_certified_part(proof), compared))


def pairs(left: Sequence[str], right: Sequence[str]) -> Iterator[tuple[int, int]]:
    """Places of the events that belong together, up to the first that do not.

    How many impacts of a complete chatter are listed depends on tolerances: further impacts on one
    side are skipped if a chatter ends them. With a small restitution the last impact may be listed
    as plastic: then the bodies are in contact at once, and the chatter of the other side is skipped
    with its impacts. The rows that follow show how large the difference is. A last pair, (left,
    right) beyond one of the ends or of different kinds, says where it stops.
    """
    i = j = 0
    while i < len(left) and j < len(right):
        if left[i] == right[j]:
            yield i, j
            i, j = i + 1, j + 1
        elif left[i] == "impact" and right[j] == "chatter" and _chatters(left, i):
            i = left.index("chatter", i)
        elif right[j] == "impact" and left[i] == "chatter" and _chatters(right, j):
            j = right.index("chatter", j)
        elif hold := _same_hold(left, i, right, j):
            i, j = hold
        else:
            break
    yield i, j


def _same_hold(left: Sequence[str], i: int, right: Sequence[str], j: int) -> tuple[int, int] | None:
    """Places of the contact that both go over to by impacts, one of them or both by a chatter."""
    k, m = _hold(left, i), _hold(right, j)
    if k is None or m is None or left[k] != right[m]:
        return None
    return (k, m) if "chatter" in (left[k - 1], right[m - 1]) else None


def _hold(kinds: Sequence[str], place: int) -> int | None:
    """Place of the next contact, if impacts and at most one chatter, just before it, lead to it."""
    k = place
    while k < len(kinds) and kinds[k] == "impact":
        k += 1
    if k < len(kinds) and kinds[k] == "chatter":
        k += 1
    landed = k > 0 and kinds[k - 1] in ("impact", "chatter")
    return k if landed and k < len(kinds) and kinds[k] in HOLDS else None


def _chatters(kinds: Sequence[str], place: int) -> bool:
    """Whether the next event that is no impact is the end of a chatter."""
    return next((kind for kind in kinds[place:] if kind != "impact"), "") == "chatter"


def _settled(done: Pass) -> bool:
    """Whether a pass proves everything that can be known."""
    decided = done.stopped in ("", "lost", "start", "event_cap")
    return decided and all(entry.certified and entry.error() < GOOD for entry in done.entries)


def _rounded(bits: float) -> int:
    return 64 * math.ceil(bits / 64)


def _certified_part(done: Pass) -> Pass:
    """The proved part of a pass, as far as it is precise enough."""
    entries = []
    for entry in done.entries:
        if not (entry.certified and entry.error() < GOOD):
            break
        entries.append(entry)
    proved = done.samples[: done.proved_samples]
    good = 0
    for state in proved:
        if state is not None and not _narrow(state):
            break
        good += 1
    final = done.final if done.final and _narrow(done.final) else None
    return replace(done, entries=entries, samples=proved[:good], proved_samples=good, final=final)


def _narrow(state: Sequence[arb]) -> bool:
    return max(float(value.rad()) for value in state) < GOOD


def _compared(problem: Problem, max_precision: int) -> Pass:
    """Two passes that agree, or those of the highest precision allowed."""
    one = follow(problem, FIRST, enclose=False)
    while True:
        if one.stopped == "interrupted":
            return replace(one, entries=[], samples=[])
        two = follow(problem, 2 * one.bits, enclose=False)
        both, agree = _difference(one, two)
        if two.stopped == "interrupted" or agree:
            return both
        if 4 * one.bits > max_precision:
            detail = f"precisions of {one.bits} and {two.bits} bits do not agree any further"
            return replace(both, stopped="precision_cap", detail=detail)
        one = two


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
            if coarse.regime != fine.regime:
                agree = False
                break
            values = together(coarse.values, fine.values)
            entries.append(replace(fine, values=values, more=_joint(coarse.more, fine.more)))
        samples = [_state(p, q) for p, q in zip(one.samples, two.samples, strict=False)]
        final, last = _state(one.final, two.final), _state(one.last, two.last)
    agree = agree and all(entry.error() < GOOD for entry in entries)
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
        entries = proof.entries
    samples = [*proof.samples, *compared.samples[len(proof.samples) :]]
    bits = max(proof.bits, compared.bits)
    known = len(proof.samples)
    done = replace(compared, bits=bits, entries=entries, samples=samples, proved_samples=known)
    if proof.final is not None:
        done = replace(done, final=proof.final, proved_final=True)
    return replace(done, looks=proof.looks + compared.looks)


def _with_growth(problem: Problem, done: Pass) -> Pass:
    """The result, with the growth of a perturbation until each entry."""
    if done.stopped in ("interrupted", "start") or not done.entries:
        return done
    held = any(entry.kind != "impact" for entry in done.entries)
    nudge = _NUDGES[held]
    moved = follow(problem, FIRST, enclose=False, nudge=nudge)
    *matched, _ = pairs([e.kind for e in done.entries], [e.kind for e in moved.entries])
    entries = list(done.entries)
    for i, j in matched:
        here, there = entries[i].values, moved.entries[j].values
        far = max(float(abs(p.mid() - q.mid())) for p, q in zip(here, there, strict=True))
        if far > _LINEAR or entries[i].regime != moved.entries[j].regime:
            break
        growth = far / float(nudge)
        entries[i] = replace(entries[i], growth=growth if growth > _UNSEEN else 0.0)
    return replace(done, entries=entries)

"""The exact motion of a structure's run, by its reference, with sufficient precision.

As motion.py for a System: parameters and start are the exact doubles, enclosures where they reach,
and after complete chatter, or where a sequence of impacts has no end, two passes that agree. A
structure `from_modes` is followed in its modal coordinates.
"""

from __future__ import annotations

import itertools
import math
from array import array
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Literal

from flint import arb, ctx, fmpq

from ..reference.contact import Undecided
from ..reference.samples import Samples
from ..reference.structure import Change, Impact, StructureRun
from ..reference.structure import Structure as ExactStructure
from ..reference.structure.flow import vector
from ..reference.structure.result import State, merged
from ..reference.structure.simulate import Motion
from ..structure import Structure
from .motion import FIRST, GOOD, Entry, Pass, together
from .path import Parted
from .result import Early
from .told import essential
from .watch import Watch

#: Endings beyond which the model has no motion, or no one; the reference has a longer name for one.
DEAD_ENDS = ("painleve", "simultaneous", "sequence_cap", "several_frictional")
_NAMES = {"frictional_contacts": "several_frictional"}
#: Times at which the motion is looked at in a window, and the bits for that.
_LOOKS, _ROUGH = 16, 64
#: Bits that enclosures lose from impact to impact, as a first guess, and how precision rises.
_LOST, _MORE, _FINER = 2, 2, 1.375


@dataclass(frozen=True)
class StructureProblem:
    """What is followed, as `motion.Problem`; looks at the motion are a `window`/16 apart."""

    structure: ExactStructure
    start: tuple[tuple[fmpq, ...], tuple[fmpq, ...]]
    times: Callable[[], Sequence[arb]]
    end: Callable[[], arb]
    watch: Watch
    most: int
    window: float


@dataclass(frozen=True)
class StructureEntry(Entry):
    """An event at a stop: values time, q, v before it, v after it; of an impact `more` as well.

    `more`: approach velocity, phase (not reduced), impulses, loss of energy.
    """

    stop: int = -1

    @property
    def size(self) -> int:
        """Number of coordinates."""
        return len(self.values) // 3

    def q(self) -> tuple[arb, ...]:
        """Coordinates."""
        return self.values[1 : self.size + 1]

    def velocities(self) -> tuple[tuple[arb, ...], tuple[arb, ...]]:
        """Velocities before and after it."""
        n = self.size
        return self.values[n + 1 : 2 * n + 1], self.values[2 * n + 1 :]

    def jump(self) -> float:
        """How much an impact changes the velocities."""
        pairs = zip(*self.velocities(), strict=True)
        return max(abs(float(after - before)) for before, after in pairs)

    def after(self) -> tuple[arb, ...]:
        """The state after it."""
        return (*self.q(), *self.velocities()[1])


def exact_structure(structure: Structure) -> ExactStructure:
    """The numbers of a structure, or of its modes, as exact rationals."""
    basis = structure._basis
    fields = structure._fields()
    stops = [stop.to_dict() for stop in structure.stops]
    fields["mass"], fields["stiffness"] = basis.matrices
    for name in ("static_load", "drive_amplitude"):
        fields[name] = basis.on(name, fields[name])
    if "damping" in fields:
        fields["damping"] = basis.square("damping", fields["damping"])
    for place, stop in enumerate(structure.stops):
        for name in ("normal", "tangent"):
            row = getattr(stop, name)
            if row is not None:
                stops[place][name] = basis.on(name, row)
    plain = {
        name: value.tolist() if hasattr(value, "tolist") else value
        for name, value in fields.items()
    }
    return ExactStructure.parse(plain | {"stops": stops})


class _Path(Samples[State]):
    """States at the sections, and past the end; rough values of the motion in between.

    `final` is the state at the end of the run; None if that is not certainly before or after an
    event.
    """

    def __init__(self, problem: StructureProblem) -> None:
        *sections, past = problem.times()
        super().__init__([*sections, past])
        self.end: arb | None = problem.end()
        self.final: State | None = None
        self.sections = len(sections)
        self.watch, self.step = problem.watch, problem.window / _LOOKS
        self.looks = array("d")
        self._next = 0.0

    def take(self, until: arb, state: Callable[[arb], State]) -> None:
        """States at the times before `until`."""
        self._look(float(until), state)
        if self.end is not None and not self.end > until:
            self.final = state(self.end) if self.end < until else None
            self.end = None
        before = len(self.states)
        super().take(until, state)
        for number in range(before, min(len(self.states), self.sections)):
            q, v = self.states[number]
            if self.watch.section(number, self.times[number], (*q, *v)):
                raise Parted

    def _look(self, until: float, state: Callable[[arb], State]) -> None:
        with ctx.workprec(_ROUGH):
            while self._next < until:
                try:
                    q, v = state(arb(self._next))
                except Undecided:  # within the end of a chatter
                    self._next = until
                    return
                values = [float(value) for value in (*q, *v)]
                if all(map(math.isfinite, values)):
                    self.looks.extend((self._next, *values))
                self._next += self.step


class _Followed(Motion):
    """A motion that ends when the run has left it."""

    watch: Watch
    count = 0

    def _impact(self, struck: Sequence[int]) -> str | None:
        place = len(self.story)
        ending = super()._impact(struck)
        for told in self.story[place:]:
            if isinstance(told, Impact):
                self.count += 1
                if self.watch.impact(self.count - 1, told.time):
                    raise Parted
        return ending


@dataclass(frozen=True)
class _Done:
    """One pass: what the reference found, and why it ended early.

    `final` is the state at the end of the run, None if it is not known, `last` that at the time
    `now`, where the pass ends.
    """

    run: StructureRun
    looks: array[float]
    now: float
    last: tuple[arb, ...]
    final: tuple[arb, ...] | None
    stopped: Early | Literal[""] = ""
    detail: str = ""

    def narrow(self) -> bool:
        """Whether all of it is known well enough."""
        return _known(self.run) == (len(self.run.story), len(self.run.states))

    def proved(self) -> bool:
        """Whether all of it encloses the exact motion."""
        run = self.run
        return run.proved == len(run.story) and run.proved_states == len(run.states)


def _follow(problem: StructureProblem, bits: int) -> _Done:
    """One pass; `stopped` says what ended it early, also Ctrl-C."""
    stopped: Early | Literal[""] = ""
    detail = ""
    problem.watch.begin(bits)
    with ctx.workprec(bits):
        path = _Path(problem)
        motion = _Followed(problem.structure, problem.start, path, problem.most)
        motion.watch = problem.watch
        try:
            run = motion.run()
        except Parted:
            stopped, detail = "lost", "the run has parted from the exact motion for good"
        except Undecided as doubt:
            stopped, detail = "undecided", str(doubt)
        except ValueError as error:
            stopped, detail = "undecided" if motion.story else "start", str(error)
        except KeyboardInterrupt:
            stopped, detail = "interrupted", "interrupted"
        if stopped:
            # `merged` takes runs that end at their cap as far as both go
            run = motion.so_far("event_cap")
        elif run.ending == "event_cap":
            stopped, detail = "event_cap", f"more than {problem.most} events (max_events)"
        last = vector(motion.z, 0, 2 * motion.size)
        final = path.final and (*path.final[0], *path.final[1])
        return _Done(run, path.looks, float(motion.now), last, final, stopped, detail)


def exact_structure_motion(problem: StructureProblem, impacts: int, max_precision: int) -> Pass:
    """The exact motion, for a run of about so many impacts; with `interrupted` what there is."""
    bits = min(max_precision, _rounded(FIRST + _LOST * min(impacts, 100)))
    while True:
        done = _follow(problem, bits)
        if done.stopped in ("interrupted", "start"):
            return _as_pass(done, problem)
        if not done.proved():
            finer = _follow(problem, _rounded(_FINER * bits))
            if finer.stopped == "interrupted":
                return _as_pass(_proved(done, "interrupted", "interrupted"), problem)
            try:
                done = _merged(done, finer)
            except Undecided as doubt:
                done = _proved(done, "undecided", str(doubt))
        if done.stopped != "undecided" and done.narrow():
            return _as_pass(done, problem)
        if _MORE * bits > max_precision:
            if done.stopped != "undecided":
                detail = f"{bits} bits are too few"
                done = replace(done, stopped="precision_cap", detail=detail)
            return _as_pass(done, problem)
        bits *= _MORE


def _merged(done: _Done, finer: _Done) -> _Done:
    """A pass with its differences to a finer one as errors, where it is no enclosure."""
    run = merged(done.run, finer.run)
    with ctx.workprec(finer.run.precision):
        last = together(done.last, finer.last)
        final = done.final and finer.final and together(done.final, finer.final)
    return replace(done, run=run, last=last, final=final)


def _proved(done: _Done, stopped: Early, detail: str) -> _Done:
    """The part of a pass that is proved."""
    run = done.run
    story, states = run.story[: run.proved], run.states[: run.proved_states]
    return replace(
        done, run=replace(run, story=story, states=states), final=None, stopped=stopped,
        detail=detail,
    )  # fmt: skip


def _known(run: StructureRun) -> tuple[int, int]:
    """How many events, and states, are known well enough, up to the first that is not."""
    events = (_narrow((told.time, *_numbers(told))) for told in run.story)
    states = (_narrow((*q, *v)) for q, v in run.states)
    return _first_false(events), _first_false(states)


def _first_false(good: Iterable[bool]) -> int:
    return sum(1 for _ in itertools.takewhile(bool, good))


def _narrow(values: Sequence[arb]) -> bool:
    return max(float(value.rad()) for value in values) < GOOD


def _numbers(told: Impact | Change) -> tuple[arb, ...]:
    if isinstance(told, Impact):
        return (*told.q, *told.v_pre, *told.v_post)
    q, v = told.state
    return (*q, *v, *v)


def _as_pass(done: _Done, problem: StructureProblem) -> Pass:
    """A pass as far as it is known well enough."""
    run, count = done.run, len(problem.times()) - 1
    events, states = _known(run)
    with ctx.workprec(run.precision):
        entries = _entries(problem.structure, run, events)
        samples = [(*q, *v) for q, v in run.states[:states]]
    found = Pass(
        run.precision, [*entries], samples[:count], min(run.proved_states, count), done.stopped,
        done.detail, last=done.last, proved_final=done.proved(), looks=done.looks,
    )  # fmt: skip
    if events == len(run.story):
        found = replace(found, final=done.final)
    ending = _NAMES.get(run.ending, run.ending)
    if ending in DEAD_ENDS and not done.stopped:
        found = replace(found, ends=done.now, ending=ending)
    return found


def _entries(structure: ExactStructure, run: StructureRun, count: int) -> list[StructureEntry]:
    """The first events of a run, without rows that only say what impacts did to closed stops."""
    entries: list[StructureEntry] = []
    after: tuple[arb, ...] = ()
    story = run.story[:count]
    for place, told in enumerate(story):
        proved = place < run.proved
        values = (told.time, *_numbers(told))
        if isinstance(told, Change):
            entries.append(StructureEntry(told.kind, values, certified=proved, stop=told.stop))
            continue
        first = not _at_once(story[max(place - 1, 0) : place], told)
        v_pre = told.v_pre if first else after
        after = told.v_post
        if not first or _at_once(story[place + 1 : place + 2], told):
            # the reference gives each row the whole change, the run's rows go from one to the next
            n = structure.size
            push = structure.push(structure.stops[told.stop].normal)
            after = tuple(v - push[n + i, 0] * told.impulse_normal for i, v in enumerate(v_pre))
            if told.approach_velocity.contains(0) and told.impulse_normal.contains(0):
                continue  # a closed stop that the impact elsewhere does not press
        values = (told.time, *told.q, *v_pre, *after)
        phase = arb(structure.omega) * told.time + arb(structure.phase)
        more = (
            told.approach_velocity, phase, told.impulse_normal, told.impulse_tangential,
            told.energy_loss,
        )  # fmt: skip
        entries.append(
            StructureEntry("impact", values, told.regime, proved, more=more, stop=told.stop)
        )
    events = [(entry.kind, entry.stop, float(entry.values[0])) for entry in entries]
    impulses = [float(entry.more[2] or 0) if entry.more else 0.0 for entry in entries]
    places, _ = essential(events, told_again=False, impulses=impulses)
    return [entries[place] for place in places]


def _at_once(beside: Sequence[Impact | Change], told: Impact) -> bool:
    """Whether an event, if there is one, is an impact that is resolved together with another."""
    return any(
        isinstance(other, Impact)
        and all(
            p.overlaps(q)
            for p, q in zip(
                (other.time, *other.v_pre, *other.v_post),
                (told.time, *told.v_pre, *told.v_post),
                strict=True,
            )
        )
        for other in beside
    )


def _rounded(bits: float) -> int:
    return 64 * math.ceil(bits / 64)

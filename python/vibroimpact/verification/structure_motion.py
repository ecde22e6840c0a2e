"""Passes over the exact motion of a structure, by its reference.

As motion.py for a System; enclosures end at complete chatter, and where a sequence of impacts has
no end. A structure `from_modes` is followed in its modal coordinates.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

from flint import arb, ctx, fmpq

from ..reference.structure import Change, Impact
from ..reference.structure import Structure as ExactStructure
from ..reference.structure.flow import vector
from ..reference.structure.result import State
from ..reference.structure.simulate import Motion
from ..structure import Structure
from .passes import Entry, Pass
from .path import Parted, Unproved, Watched, ended
from .told import essential
from .watch import Watch

#: Endings beyond which the model has no motion, or no one; the reference has a longer name for one.
DEAD_ENDS = ("painleve", "simultaneous", "sequence_cap", "several_frictional")
_NAMES = {"frictional_contacts": "several_frictional"}
#: Times at which the motion is looked at in a window, and the bits for that.
_LOOKS, _ROUGH = 16, 64


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
    #: The growth of differences is not measured.
    nudges: None = None

    @property
    def spreads_until(self) -> float:
        """As `passes.Followed`."""
        return self.watch.spreads_until

    def follow(self, bits: int, *, enclose: bool, nudge: str = "0") -> Pass:
        """One pass, as `passes.Followed`; there is no `nudge`."""
        return _follow(self, bits, enclose=enclose)


@dataclass(frozen=True)
class StructureEntry(Entry):
    """An event at a stop: values time, q, v before it, v after it; of an impact `more` as well.

    `more`: approach velocity, phase (not reduced), impulses, loss of energy.
    """

    stop: int = -1

    def is_like(self, other: Entry) -> bool:
        """Whether an event of the same kind in another pass is this one."""
        assert isinstance(other, StructureEntry)
        return super().is_like(other) and self.stop == other.stop

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


class _Path(Watched[State]):
    """States at the sections, at the end and past it; looks all the time."""

    def __init__(self, problem: StructureProblem) -> None:
        super().__init__(problem.times(), problem.end(), problem.watch, _flat)
        self.step, self._next = problem.window / _LOOKS, 0.0

    def _look(self, until: arb, state: Callable[[arb], State]) -> None:
        with ctx.workprec(_ROUGH):
            while self._next < float(until):
                if not self._take_down(self._next, state):
                    self._next = float(until)  # within the end of a chatter
                    return
                self._next += self.step


def _flat(state: State) -> tuple[arb, ...]:
    return (*state[0], *state[1])


class _Followed(Motion):
    """A motion that ends when the run has left it, or when an enclosure ends."""

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

    def _keep(self) -> None:
        if not self.enclose:
            super()._keep()

    def _unprove(self) -> None:
        if self.enclose:
            raise Unproved
        super()._unprove()


def _follow(problem: StructureProblem, bits: int, *, enclose: bool) -> Pass:
    structure = problem.structure
    problem.watch.begin(bits)
    with ctx.workprec(bits):
        path = _Path(problem)
        motion = _Followed(structure, problem.start, path, problem.most, enclose=enclose)
        motion.watch = problem.watch
        ending, stopped, detail = ended(
            lambda: motion.run().ending,
            motion.story,
            unproved="complete chatter, or a sequence without end",
        )
        if ending == "event_cap":
            stopped, detail = "event_cap", f"more than {problem.most} events (max_events)"
        done = Pass(
            bits, _entries(structure, motion.story, enclose), path.known()[: len(path.times) - 1],
            len(path.states) if enclose else 0, stopped, detail,
            last=vector(motion.z, 0, 2 * motion.size), proved_final=enclose, looks=path.looks,
            blur=motion.width(),
        )  # fmt: skip
        if path.final is not None:
            done = replace(done, final=_flat(path.final))
        ending = _NAMES.get(ending, ending)
        if ending in DEAD_ENDS and not stopped:
            done = replace(done, ends=float(motion.now), ending=ending)
    return done


def _numbers(told: Impact | Change) -> tuple[arb, ...]:
    if isinstance(told, Impact):
        return (*told.q, *told.v_pre, *told.v_post)
    q, v = told.state
    return (*q, *v, *v)


def _entries(
    structure: ExactStructure, story: Sequence[Impact | Change], proved: bool
) -> list[StructureEntry]:
    """The events of a motion, without rows that only say what impacts did to closed stops."""
    entries: list[StructureEntry] = []
    after: tuple[arb, ...] = ()
    for place, told in enumerate(story):
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

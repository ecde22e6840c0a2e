"""Passes over the exact motion of a system, by its reference.

Parameters and start are the exact doubles. Source: theory page, sections 1 to 5.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

from flint import arb, ctx, fmpq

from ..reference.flight import System as ExactSystem
from ..reference.flight import exact
from ..reference.hold import Phase
from ..reference.hybrid import Motion, approach_in_contact
from ..reference.restitution import curve_of
from ..reference.simulate import Event
from ..reference.slide import Settings, Touch
from ..restitution import RestitutionCurve
from ..system import SYMBOLS, System
from .passes import Entry, Pass
from .path import Parted, Path, Unproved, ended
from .watch import Watch

#: Shifts of v1(0) that show how perturbations grow, in flights and, less exact, through contact.
_NUDGES = ("1e-30", "1e-18")
#: Endings beyond which the model has no motion, or more than one.
DEAD_ENDS = ("jammed", "painleve", "law_failed")
#: Phases that only repeat an impact, or the start.
ECHOES = ("impact", "impact_at_start")


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

    @property
    def nudges(self) -> tuple[str, str]:
        """As `passes.Followed`."""
        return _NUDGES

    @property
    def spreads_until(self) -> float:
        """As `passes.Followed`."""
        return self.watch.spreads_until

    def follow(self, bits: int, *, enclose: bool, nudge: str = "0") -> Pass:
        """One pass, as `passes.Followed`; `nudge` is added to v1."""
        return follow(self, bits, enclose=enclose, nudge=nudge)


def exact_system(system: System) -> ExactSystem:
    """The parameters as exact rationals."""
    values = {symbol: getattr(system, name) for symbol, name in SYMBOLS.items()}
    if not isinstance(system.restitution, RestitutionCurve):
        return ExactSystem.parse(values, system.contact)
    curve = curve_of(system.restitution.to_dict())
    values["r"] = system.restitution(0.0)
    return replace(ExactSystem.parse(values, system.contact), curve=curve)


class _Followed(Motion):
    """A motion that ends when the run has left it, or when an enclosure ends."""

    watch: Watch

    def _contact(
        self, touch: Touch, event: str | None = None, error: arb | None = None
    ) -> str | None:
        if self.enclosing:
            raise Unproved
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
        ending, stopped, detail = ended(
            lambda: motion.run().ending,
            motion.story,
            unproved="complete chatter or sustained contact",
        )
        entries = [
            _entry(told, place < motion.proved, problem)
            for place, told in enumerate(motion.story)
            if not (isinstance(told, Phase) and told.event in ECHOES)
        ]
        done = Pass(bits, entries, moments.states, motion.proved_samples, stopped, detail)
        done = replace(done, final=moments.final, proved_final=enclose, looks=moments.looks)
        state = (motion.now, motion.x1, motion.v1, motion.x2, motion.v2)
        done = replace(done, blur=max(float(value.rad()) for value in state))
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

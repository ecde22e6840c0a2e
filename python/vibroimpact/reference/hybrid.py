"""The whole motion: flights, impacts, completed chatter, sustained contact, release.

flight -> impact -> flight | contact -> flight, theory page, sections 3 to 5. Flights, first
contacts and impacts are those of simulate.py, each certified from its own start; chatter.py and
hold.py supply the rest. Between two steps a state is rounded to the midpoint of its ball, since
enclosures would not survive the limit of a chatter: a run as a whole is no enclosure. Its stated
error comes from measure.py: two runs that differ in precision, in the number of impacts before a
chatter is completed, in the order of the Taylor series and in the length of their steps. With
`enclose` nothing is rounded before the first chatter or contact, so that what comes before it is
enclosed by proof, as in simulate.py. All quantities are dimensionless.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

from flint import arb, ctx, fmpq

from .carried import Carried
from .chatter import ANALYTIC, Bounce, Tail
from .contact import Undecided, first_contact
from .flight import Flight, Number, State, System, exact, rational
from .hold import Hold, Phase, sign
from .impact import LAWS, Jammed
from .samples import Samples, no_state
from .simulate import Event
from .slide import Settings, Slide, Touch

#: Settings that differ from the standard in everything on which a result may depend.
FINER = Settings(precision=544, order=52, tolerance=1e-60)
_MAX_IMPACTS = 20_000


@dataclass(frozen=True)
class Run:
    """Phases in order, states at the times asked for, why it ended, impacts met and their number.

    `ending`: completed, rest, painleve, jammed or law_failed (the law `paper` left the bodies
    approaching each other); times after the end have no states, but a motion at rest goes on. The
    impact at which a chatter is completed is counted, not listed; the period of a listed one is the
    number of samples before it.
    """

    phases: list[Phase]
    samples: list[State]
    ending: str
    impacts: int
    hits: list[Event] = field(default_factory=list)


def follow(
    system: System,
    initial: Sequence[Number],
    times: Callable[[], Sequence[arb]],
    *,
    phase: Number = 0,
    settings: Settings | None = None,
    law: str = "poisson",
) -> Run:
    """Follow the motion from `initial` = (x1, v1, x2, v2), g <= 0, to the last of `times`.

    Parameters
    ----------
    times : makes the ascending times of the samples at the working precision, as for `sections`

    Raises
    ------
    ValueError : an inadmissible start
    Undecided : an event, a regime or a mode is not decided: a graze, or a start on an edge
    RuntimeError : too many impacts or phases
    """
    settings = settings or Settings()
    with ctx.workprec(settings.precision):
        return Motion(system, initial, Samples(times()), exact(phase), settings, law).run()


def sections(system: System, periods: int) -> Callable[[], Sequence[arb]]:
    """The ends of the first drive periods."""
    return lambda: [2 * arb.pi() * k / arb(system.omega) for k in range(1, periods + 1)]


def approach_in_contact(system: System, start: Sequence[fmpq]) -> fmpq | None:
    """Approach velocity u of a start with g = 0 exactly; None if g is not 0."""
    x1, v1, x2, v2 = start
    # sin x1 is rational at x1 = 0 only, and cos x1 = 1 there
    if (system.oblique and x1 != 0) or x1 - x2 - system.delta != 0:
        return None
    return v1 - v2


class Motion:
    """One run, to be made and run at the precision of its settings.

    If the run ends early, what has happened until then is available: `story`, all impacts and
    phases in order, and `samples`. The first `proved` entries of the story enclose the exact
    motion, and the first `proved_samples` states.
    """

    def __init__(
        self,
        system: System,
        initial: Sequence[Number],
        samples: Samples[State],
        phase: fmpq,
        settings: Settings,
        law: str,
        *,
        enclose: bool = False,
        quick: bool = False,
        most_impacts: int = _MAX_IMPACTS,
    ) -> None:
        self.system, self.settings, self.phase = system, settings, arb(phase)
        self.law, self.most_impacts = LAWS[law], most_impacts
        self.samples, self.end = samples, samples.times[-1]
        self.start = [exact(value) for value in initial]
        self.at_rest = system.wall_rests(*self.start[2:])
        self.hold = Hold(system, self.phase, self.at_rest, settings)
        self.tail = Tail(arb(settings.tolerance))
        self.story: list[Event | Phase] = []
        self.quick = quick
        self.enclosing, self.proved, self._proved_samples = enclose, 0, 0
        self.impacts = 0
        self.now = arb(0)
        self.x1, self.v1, self.x2, self.v2 = (arb(q) for q in self.start)
        state = (self.x1, self.v1, self.x2, self.v2)
        self.carried = Carried(system, self.phase, self.now, state) if enclose else None
        #: Derivatives of g, from g itself on, that vanish at the start of the next flight.
        self.touching = 0

    @property
    def proved_samples(self) -> int:
        """How many of the sampled states enclose the exact motion: the first so many."""
        return len(self.samples.states) if self.enclosing else self._proved_samples

    def run(self) -> Run:
        """To the end."""
        try:
            ending = self._begin() or self._loop()
        except Jammed:
            ending = "jammed"
        phases = [entry for entry in self.story if isinstance(entry, Phase)]
        hits = [entry for entry in self.story if isinstance(entry, Event)]
        return Run(phases, self.samples.states, ending, self.impacts, hits)

    def _kept(self, value: arb) -> arb:
        """A value as the next step takes it: the ball itself, or its midpoint."""
        return value if self.enclosing else value.mid()

    def _begin(self) -> str | None:
        """A start in contact (theory page, section 3); the ending, if the run ends at once."""
        approach = approach_in_contact(self.system, self.start)
        if approach is None:
            return None
        self.touching = 1
        if approach < 0:
            return None
        return self._impact("impact_at_start") if approach > 0 else self._contact(self._touch())

    def _loop(self) -> str:
        """Flights, and the impacts or contacts that end them."""
        system, bits = self.system, self.settings.precision
        while self.impacts < self.most_impacts:
            x2 = self.x2 if self.touching == 0 or system.mbar == 0 else None
            psi = self.phase + arb(system.omega) * self.now
            flight = Flight(system, (self.x1, self.v1, x2, self.v2), psi, quick=self.quick)
            left = rational((self.end - self.now).upper())
            found = first_contact(flight, left, touching=self.touching, precision=bits, cap=bits)
            if found.kind in ("undecided", "immediate"):
                raise Undecided(f"{found.kind} contact after {self.impacts} impacts")
            then = self.end if found.time is None else self.now + found.time

            def state(t: arb, flight: Flight = flight, began: arb = self.now) -> State:
                return flight.state(t - began)

            self.samples.take(then, state)
            if found.time is None or self.samples.full():
                return "completed"
            began, self.now = self.now, self._kept(then)
            self.x1, self.v1, self.x2, self.v2 = map(self._kept, flight.state(found.time))
            if self.carried and self.enclosing:
                balls = (self.x1, self.v1, self.x2, self.v2)
                self.carried.fly(flight, began, found.time, self.now, balls)
                self.now, balls = self.carried.narrowed(self.now, balls)
                self.x1, self.v1, self.x2, self.v2 = balls
            ending = self._impact()
            if ending is not None:
                return ending
        raise RuntimeError(f"more than {self.most_impacts} impacts")

    def _impact(self, event: str | None = None) -> str | None:
        """An impact, and the contact it leads to; the ending, if the run ends there.

        A tail is completed from the states before its impacts, in place of the last of them.
        """
        system = self.system
        outcome = self.law(system, self.x1, self.v1, self.v2)
        if system.gap_rate(self.x1, outcome.v1, outcome.v2) > 0:
            return "law_failed"
        self.impacts += 1
        kinks = system.mu != 0
        signs = (sign(self.v1), sign(self.x1.sin())) if kinks else (0, 0)
        u = system.gap_rate(self.x1, self.v1, self.v2)
        values = tuple(q.mid() for q in (self.now, self.x1, self.v1, self.v2))
        limit = self.tail.observe(Bounce(values, u.mid(), outcome.regime, signs))
        if limit is not None:
            self.samples.take(limit.values[0], no_state)
            self.now, self.x1, self.v1 = (q.mid() for q in limit.values[:3])
            # all but slip and frictionless impacts reverse or stop v1, so v1 is of the order of u
            if self.at_rest or limit.regime not in ANALYTIC:
                self.v1 = arb(0)
            elif kinks and not abs(self.v1) > 10 * limit.error():
                raise Undecided("the direction of slip at the end of a chatter")
            return self._contact(self._touch(), "chatter", limit.error())
        passed, x2, pre = len(self.samples.states), self._state()[2], (self.v1, self.v2)
        self.v1, self.v2 = self._kept(outcome.v1), self._kept(outcome.v2)
        if self.carried and self.enclosing:
            after = (self.x1, self.v1, x2, self.v2)
            before = (self.x1, pre[0], x2, pre[1])
            self.carried.strike(self.law, before, outcome.regime, self.now, after)
            _, (_, self.v1, _, self.v2) = self.carried.narrowed(self.now, after)
        post = (self.v1, self.v2, outcome.regime, outcome.impulse)
        self._tell(Event(passed, self.now, self.x1, pre[0], x2, pre[1], *post))
        if system.r == 0 or (self.at_rest and self.v1.is_zero()):
            return self._contact(self._touch(), event or "impact")
        if event:
            self._record(event, arb(0))
        self.touching = 1
        return None

    def _contact(
        self, touch: Touch, event: str | None = None, error: arb | None = None
    ) -> str | None:
        """Contact at g = g' = 0, or the flight that begins there; the ending, if the run ends.

        `event` is what led here; `error` its stated error.
        """
        error = arb(0) if error is None else error
        self._proved_samples, self.enclosing = self.proved_samples, False
        self.now, self.x1, self.v1 = self.now.mid(), self.x1.mid(), self.v1.mid()
        touch = replace(touch, time=self.now, x1=self.x1, v1=self.v1)
        self.v2 = self._state()[3].mid()
        separates = self.hold.mode(touch) == "separate"
        if event == "chatter" and separates:
            raise Undecided("a chatter whose limit is no contact")
        if event and not (event == "impact" and separates):
            self._record(event, error)
        if separates:
            self.touching = 3 if touch.unloaded else 2
            return None
        held = self.hold.follow(touch, self.end, self.samples.take, error)
        self.story += held.phases
        self.now, self.x1, self.v1 = held.touch.time, held.touch.x1, held.touch.v1
        self.x2, self.v2 = (q.mid() for q in self._state()[2:])
        self.touching = 3
        self.tail.forget()
        if held.ending == "release":
            return None
        return "completed" if held.ending == "end" else held.ending

    def _touch(self) -> Touch:
        """The present state as one on g = g' = 0."""
        crossing = self.system.oblique and self.x1.is_zero()
        touch = Touch(self.now, self.x1, self.v1, int(self.v1.is_zero()), crossing)
        free = self.hold.slide(touch, 1).free_acceleration(touch)
        return replace(touch, unloaded=True) if free.is_zero() else touch

    def _record(self, event: str, error: arb) -> None:
        """An event at the present state, without forces."""
        blur = arb(0, error.abs_upper())
        x1, v1, x2, v2 = self._state()
        if event == "impact_at_start":
            v2 = self.v2
        state = (x1 + blur, v1 + blur, x2 + blur, v2 + blur)
        self._tell(Phase(event, self.now + blur, state))

    def _tell(self, entry: Event | Phase) -> None:
        """The next entry of the story."""
        self.proved += self.enclosing
        self.story.append(entry)

    def _state(self) -> State:
        """The present state on g = g' = 0; the wall at rest stays where it is, exactly."""
        if self.at_rest:
            return self.x1, self.v1, arb(self.system.c2), arb(0)
        return Slide(self.system, self.phase, 1, 1).state(self.x1, self.v1)

"""Sustained contact: which mode begins, sticking in closed form, and the way to the release.

Modes on g = 0 (theory page, section 5): slide +/- (slide.py), stick (x1' = 0), separate. At
x1' = 0 the mode is unique for mbar > 0 and mbar + k cos x1 > 0 with both directions: separate if
the free g'' < 0; else stick if p_s = -a2/mbar >= 0 and |a1 - p_s cos x1| <= mu p_s |sin x1|; else
slide with s = sgn(a1 - p_s cos x1). With mbar = 0 the limit of that is taken, and with the wall at
rest the frictionless force a1/cos x1. While sticking, x1 and x2 stay, so each margin is of the form
A cos psi + B and its fall through 0 an arccosine. Without friction a contact is one slide, whatever
the sign of v1. The wall at rest (mbar = 0, body 2 never moves) holds body 1: mode stick.

Endings: release, end (of the time asked for), rest (it sticks for ever), painleve
(mbar + k cos x1 <= 0), jammed (the wall moves towards a tip that sticks).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Literal

from flint import arb

from .contact import Undecided
from .flight import State, System
from .slide import Settings, Slide, Touch

Mode = Literal["slide_positive", "slide_negative", "stick", "separate", "painleve", "jammed"]
Sampler = Callable[[arb, Callable[[arb], State]], None]
#: Largest number of phases of one contact; more would be an error of the program.
_LONGEST = 200


@dataclass(frozen=True)
class Phase:
    """A phase that begins: event, time, state, normal and friction force just after it.

    The radii of the balls are the stated errors of the step that led there. The friction force is
    signed as the tangential impulse of an impact: its moment about the pivot is that times sin x1.
    """

    event: str
    time: arb
    state: State
    normal: arb | None = None
    friction: arb | None = None


@dataclass(frozen=True)
class Held:
    """How a contact ended, where, its phases, and the sum of their stated errors."""

    ending: Literal["release", "end", "rest", "painleve", "jammed"]
    touch: Touch
    phases: list[Phase]
    error: arb


class Hold:
    """Follows contact phases of one system; `at_rest`: mbar = 0 and body 2 never moves."""

    def __init__(self, system: System, phase: arb, at_rest: bool, settings: Settings) -> None:
        self.system, self.phase = system, phase
        self.at_rest, self.settings = at_rest, settings

    def follow(self, start: Touch, end: arb, sample: Sampler, error: arb) -> Held:
        """From a state on g = 0 = g' to the end of the contact, or to the time `end`.

        `error` is the stated error of the start.
        """
        touch = start
        phases: list[Phase] = []
        mode: Mode | None = None
        for _ in range(_LONGEST):
            mode = mode or self.mode(touch)
            if mode == "separate":
                phases.append(self._record("release", touch, error, arb(0), arb(0)))
                return Held("release", touch, phases, error)
            if mode == "painleve" or mode == "jammed":
                return Held(mode, touch, phases, error)
            if mode == "stick":
                normal, friction = self._grip(touch)
                phases.append(self._record("stick", touch, error, normal, friction))
                state = self.slide(touch, 1).state(touch.x1, arb(0))
                mode, then = self._stick_ends(touch)
                until = end if then is None else then.min(end)
                sample(until, lambda t, state=state: state)  # type: ignore[misc]
                touch = Touch(until.mid(), touch.x1, arb(0), flat=2)
                if then is None or not then < end:
                    return Held("rest" if then is None else "end", touch, phases, error)
                if mode != "separate":
                    mode = self._slides(touch, 1 if mode == "slide_positive" else -1)
                continue
            slide = self.slide(touch, 1 if mode == "slide_positive" else -1)
            normal = slide.force(touch)
            friction = arb(0)
            if self.system.mu != 0:
                friction = -arb(self.system.mu) * slide.direction * slide.side * normal
            phases.append(self._record(mode, touch, error, normal, friction))
            while True:
                slid = slide.follow(touch, end, self.settings, sample)
                touch, error = slid.touch, error + slid.error
                if slid.ending != "cross":
                    break
                slide = replace(slide, side=-slide.side)
            if slid.ending == "end" or slid.ending == "painleve":
                return Held(slid.ending, touch, phases, error)
            mode = "separate" if slid.ending == "release" else None
        raise RuntimeError(f"more than {_LONGEST} phases of one contact")

    def slide(self, touch: Touch, direction: int) -> Slide:
        """The stretch of sliding that begins at a state; sigma looks ahead where sin x1 = 0."""
        side = 1
        if self.system.mu != 0 and self.system.oblique:
            side = sign(touch.x1.cos()) * direction if touch.crossing else sign(touch.x1.sin())
        return Slide(self.system, self.phase, direction, side)

    def mode(self, touch: Touch) -> Mode:
        """The mode of contact that begins at a state on g = 0 = g'."""
        system = self.system
        ahead = self.slide(touch, 1)
        free = ahead.free_acceleration(touch)
        if touch.unloaded:
            # g''' of the free flight is the slope of the free g'' along the contact, as p = 0
            free = ahead.series(touch, 2)["numerator"][1]
        rubs = bool(system.mu) and not self.at_rest
        stopped = rubs and touch.v1.is_zero()
        if sign(free) < 0:
            # where slip could drive the bodies together, both flight and stick may be possible
            tight = stopped and any(
                not self.slide(touch, s).denominator(touch) > 0 for s in (1, -1) if system.mbar
            )
            return "painleve" if tight and self._sticks(touch) else "separate"
        if self.at_rest:
            return "stick"
        if not rubs:
            series = ahead.series(touch, 3)["velocity"]
            return _named(next((sign(c) for c in series if not c.is_zero()), 1))
        if not stopped:
            return self._slides(touch, sign(touch.v1))
        a1, a2 = self._free(touch)
        cos = touch.x1.cos()
        if system.mbar == 0:
            # p_s = -a2/mbar is infinite: its sign decides
            sine = arb(0) if touch.crossing else touch.x1.sin()
            if sign(a2) < 0 and sign(arb(system.mu) * abs(sine) - abs(cos)) >= 0:
                return "jammed"
            return self._slides(touch, sign(a2 * cos))
        if self._sticks(touch):
            return "stick"
        return self._slides(touch, sign(a1 + a2 * cos / arb(system.mbar)))

    def _slides(self, touch: Touch, direction: int) -> Mode:
        """A slide, or a Painleve point: no contact force fits where mbar + k cos x1 <= 0."""
        return (
            _named(direction) if self.slide(touch, direction).denominator(touch) > 0 else "painleve"
        )

    def _sticks(self, touch: Touch) -> bool:
        """Whether friction can hold the tip: p_s = -a2/mbar >= 0 and the cone (mbar > 0)."""
        a1, a2 = self._free(touch)
        cos, sine = touch.x1.cos(), arb(0) if touch.crossing else touch.x1.sin()
        push = -a2 / arb(self.system.mbar)
        grip = arb(self.system.mu) * push * abs(sine)
        return sign(push) >= 0 and sign(grip - abs(a1 - push * cos)) >= 0

    def _free(self, touch: Touch) -> tuple[arb, arb]:
        """Free accelerations a1, a2 at a state with v1 = v2 = 0."""
        system = self.system
        load = (self.phase + arb(system.omega) * touch.time).cos()
        x2 = system.tip(touch.x1) - arb(system.delta)
        return (
            arb(system.f1) * load + arb(system.c1) - arb(system.omega0**2) * touch.x1,
            arb(system.f2) * load + arb(system.c2) - x2,
        )

    def _grip(self, touch: Touch) -> tuple[arb, arb]:
        """Normal and friction force that keep x1' = 0."""
        a1, a2 = self._free(touch)
        cos = self.system.slope(touch.x1)
        if self.at_rest:
            return a1 / cos, arb(0)
        push = -a2 / arb(self.system.mbar)
        return push, (push * cos - a1) / touch.x1.sin()

    def _stick_ends(self, touch: Touch) -> tuple[Mode | None, arb | None]:
        """What follows a stick, and when (None: never)."""
        system = self.system
        f1, f2, mu = arb(system.f1), arb(system.f2), arb(system.mu)
        spring = arb(system.omega0**2) * touch.x1 - arb(system.c1)
        cos = system.slope(touch.x1)
        margins: list[tuple[Mode, arb, arb]] = []
        if self.at_rest:
            margins.append(("separate", f1 * sign(cos), -spring * sign(cos)))
        else:
            mbar, slope = arb(system.mbar), mu * abs(touch.x1.sin())
            pull = system.tip(touch.x1) - arb(system.delta) - arb(system.c2)
            push, offset = -f2 / mbar, pull / mbar
            margins.append(("separate", push, offset))
            for s in (1, -1):
                grip = slope + s * cos
                margins.append((_named(s), grip * push - s * f1, grip * offset + s * spring))
        first: arb | None = None
        after: Mode | None = None
        for mode, swing, level in margins:
            time = self._falls(swing, level, touch.time)
            if time is None:
                continue
            if first is None or time < first:
                after, first = mode, time
            elif not time > first:
                raise Undecided("two ends of a stick")
        return after, first

    def _falls(self, swing: arb, level: arb, time: arb) -> arb | None:
        """First t > `time` at which swing cos psi(t) + level falls through 0; None if never."""
        if self._constant() or swing.is_zero() or abs(level) > abs(swing):
            return None
        if not abs(level) < abs(swing):
            raise Undecided("a margin that touches 0")
        turn, omega = 2 * arb.pi(), arb(self.system.omega)
        psi = self.phase + omega * time
        # falling where -swing sin psi < 0
        root = sign(swing) * (-level / swing).acos()
        laps = ((psi - root) / turn).mid().ceil()
        there = root + laps * turn
        if not there > psi:
            raise Undecided("the end of a stick at its start")
        return (there - self.phase) / omega

    def _constant(self) -> bool:
        """Whether the load does not change in time."""
        return bool(self.system.omega == 0 or (self.system.f1 == 0 and self.system.f2 == 0))

    def _record(self, event: str, touch: Touch, error: arb, normal: arb, friction: arb) -> Phase:
        """A phase that begins at a state."""
        x1, v1, x2, v2 = self.slide(touch, 1).state(touch.x1, touch.v1)
        blur = arb(0, error.abs_upper())
        if touch.v1.is_zero():
            state = (x1 + blur, v1, x2 + blur, v2)
        else:
            state = (x1 + blur, v1 + blur, x2 + blur, v2 + blur)
        forces = (force if force.is_zero() else force + blur for force in (normal, friction))
        return Phase(event, touch.time + blur, state, *forces)


def sign(value: arb) -> int:
    """Sign of a number that is 0 by definition or certified not to be."""
    if value.is_zero():
        return 0
    if value > 0:
        return 1
    if value < 0:
        return -1
    raise Undecided("a sign in contact")


def _named(direction: int) -> Mode:
    """Name of the slide in a direction."""
    return "slide_positive" if direction >= 0 else "slide_negative"

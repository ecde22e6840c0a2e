"""Samples of the exact motion between its events: its size, and its state at the run's end.

Every flight, slide and stick gives the state at any time. Three things are taken from it: the
states at the sections, the one at the end of the run, and rough values, in few bits and often
enough that their largest is the size of the motion. A state at a time that is not certainly before
or after an event is None: whether it lies there, or the balls are too wide to tell, is for
passes.py to say.
"""

from __future__ import annotations

import math
from abc import abstractmethod
from array import array
from collections.abc import Callable, Sequence
from typing import Literal, TypeVar

from flint import arb, ctx

from ..reference.contact import Undecided
from ..reference.flight import State
from ..reference.flight import System as ExactSystem
from ..reference.samples import Samples
from .result import Early
from .watch import OWN_PERIOD, Watch

S = TypeVar("S")
#: Times at which the motion is looked at in a window, and the bits for that.
_LOOKS, _ROUGH = 32, 64
#: A window is no longer than so many periods of body 2 alone, however slow drive or pendulum are.
LONGEST_WINDOW = 10


def window(system: ExactSystem) -> float:
    """The time over which the size of the motion is measured: its longest period, within limits."""
    rates = [float(rate) for rate in (system.omega, system.omega0) if rate > 0]
    slowest = min([1.0, *rates])
    return OWN_PERIOD * min(LONGEST_WINDOW, 1.0 / slowest)


class Parted(Exception):
    """The run has left the motion for good."""


class Unproved(Exception):
    """Nothing is proved from here on."""


def ended(
    run: Callable[[], str], story: Sequence[object], *, unproved: str
) -> tuple[str, Early | Literal[""], str]:
    """Run a motion; return how it ended, or why it stopped early, and that in words.

    `story` is what it tells of so far; `unproved` says what an enclosure cannot pass.
    """
    try:
        return run(), "", ""
    except Parted:
        return "", "lost", "the run has parted from the exact motion for good"
    except Unproved:
        return "", "unproved", unproved
    except Undecided as doubt:
        return "", "undecided", str(doubt)
    except ValueError as error:
        return "", "undecided" if story else "start", str(error)
    except RuntimeError as error:
        return "", "event_cap", f"{error} (max_events)"
    except KeyboardInterrupt:
        return "", "interrupted", "interrupted"


class Watched(Samples[S]):
    """Collects the states at sections; None where one is not known.

    `final` is the state at the time `end`, None likewise; `looks` has the time and the numbers of
    each look, one after the other. `sections` of the `times` are looked at by `watch`.
    """

    states: list[S | None]  # type: ignore[assignment]

    def __init__(
        self, times: Sequence[arb], end: arb, watch: Watch, numbers: Callable[[S], Sequence[arb]]
    ) -> None:
        super().__init__(times)
        self.end: arb | None = end
        self.watch, self.numbers = watch, numbers
        self.final: S | None = None
        self.looks = array("d")

    def take(self, until: arb, state: Callable[[arb], S]) -> None:
        """States at the times before `until`."""
        self._look(until, state)
        if self.end is not None and not self.end > until:
            self.final = self._at(self.end, until, state)
            self.end = None
        while len(self.states) < len(self.times):
            time = self.times[len(self.states)]
            if time > until:
                return
            number = len(self.states)
            self.states.append(self._at(time, until, state))
            known = self.states[-1]
            if known is not None and self.watch.section(number, time, self.numbers(known)):
                raise Parted

    def known(self) -> list[tuple[arb, ...] | None]:
        """The numbers of the states."""
        return [None if state is None else tuple(self.numbers(state)) for state in self.states]

    def _at(self, time: arb, until: arb, state: Callable[[arb], S]) -> S | None:
        try:
            return state(time) if time < until else None
        except Undecided:
            return None

    @abstractmethod
    def _look(self, until: arb, state: Callable[[arb], S]) -> None:
        """Rough values before `until`."""

    def _take_down(self, time: float, state: Callable[[arb], S]) -> bool:
        """One look; whether there is a state."""
        try:
            values = [float(q) for q in self.numbers(state(arb(time)))]
        except Undecided:
            return False
        if all(map(math.isfinite, values)):
            self.looks.extend((time, *values))
        return True


class Path(Watched[State]):
    """The same for a System: looks only in the windows before sections and events."""

    def __init__(self, times: Sequence[arb], end: arb, watch: Watch, system: ExactSystem) -> None:
        super().__init__(times, end, watch, tuple)
        self.window = window(system)
        self._reached = self._next = 0.0

    def _look(self, until: arb, state: Callable[[arb], State]) -> None:
        """Rough values in the windows before the sections of a stretch, and before its end."""
        stop, step = float(until), self.window / _LOOKS
        anchors = []
        for place in range(len(self.states), len(self.times)):
            if not self.times[place] < until:
                break
            anchors.append(float(self.times[place]))
        with ctx.workprec(_ROUGH):
            for anchor in (*anchors, stop):
                time = max(self._next, anchor - self.window, self._reached)
                while time < anchor:
                    self._take_down(time, state)
                    time += step
                self._next = time
        self._reached = stop

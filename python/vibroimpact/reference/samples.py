"""The states of a run at given times, taken from the motions that cover them in turn."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Generic, NoReturn, TypeVar

from flint import arb, ctx

from .contact import Undecided

S = TypeVar("S")


class Samples(Generic[S]):
    """Collects the states at given ascending times from the motions that cover them."""

    def __init__(self, times: Sequence[arb]) -> None:
        self.times, self.states = times, list[S]()

    def take(self, until: arb, state: Callable[[arb], S]) -> None:
        """States at the times before `until`; one that is not certainly before or after fails.

        Either the event is there, to half the digits, or too few of them are left to tell.
        """
        while len(self.states) < len(self.times):
            time = self.times[len(self.states)]
            if time > until:
                return
            last = len(self.states) + 1 == len(self.times)
            if not (time < until or (last and time.overlaps(until))):
                near = time.rad().max(until.rad()) < arb(2) ** -(ctx.prec // 2)
                said = "an event at a sampled time"
                raise Undecided(said if near else "balls too wide for the order of events")
            self.states.append(state(time))

    def full(self) -> bool:
        """Whether all states are known."""
        return len(self.states) == len(self.times)


def no_state(time: arb) -> NoReturn:
    """No state is known between the last impact of a tail and its limit."""
    raise Undecided(f"the sampled time {time.str(10)} falls into the end of a chatter")

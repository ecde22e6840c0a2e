"""What a peer is asked and what it answers, the same for all."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

State = tuple[float, float, float, float]


@dataclass(frozen=True)
class Problem:
    """A motion to follow: parameters by code name (docs/notation.md) and the initial state."""

    parameters: dict[str, float]
    initial: State

    @property
    def frequency(self) -> float:
        """Drive frequency of the problem itself."""
        return self.parameters["drive_frequency"]


@dataclass(frozen=True)
class Outcome:
    """The kept sections of a run, and what it took.

    ``false_events`` counts contacts reported where the bodies separate; ``penetration`` is the
    largest gap g > 0 that was seen: bodies inside one another; ``ended`` says why a run was given
    up, empty if it was not. ``evaluations`` is 0 where a peer counts none.
    """

    stroboscopic: NDArray[np.float64]
    impact_section: NDArray[np.float64]
    impacts: int
    false_events: int = 0
    penetration: float = 0.0
    evaluations: int = 0
    ended: str = ""

    @property
    def finished(self) -> bool:
        """Whether the end was reached."""
        return not self.ended

    @property
    def final_state(self) -> State:
        """State at the end; NaN if it was not reached."""
        if not self.finished or not len(self.stroboscopic):
            return (math.nan,) * 4
        x1, v1, x2, v2 = self.stroboscopic[-1].tolist()
        return x1, v1, x2, v2


class Solve(Protocol):
    """Runs at these drive frequencies, over so many periods of which the last are kept.

    The kept sections are ``samples`` per drive period, of which every last is the stroboscopic one.
    """

    def __call__(
        self, frequencies: Sequence[float], periods: int, keep: int, samples: int = 1
    ) -> list[Outcome]:
        """Return one outcome for each frequency."""
        ...


def one_by_one(solve_one: Callable[[float, int, int, int], Outcome]) -> Solve:
    """Return the ``Solve`` of a peer that takes one frequency at a time."""

    def solve(
        frequencies: Sequence[float], periods: int, keep: int, samples: int = 1
    ) -> list[Outcome]:
        return [solve_one(omega, periods, keep, samples) for omega in frequencies]

    return solve


def most_impacts(periods: int) -> int:
    """Impacts after which a peer is stopped: it does not get past a chatter's accumulation."""
    return 1_000 + 100 * periods


def penetration(rows: NDArray[np.float64], gap: float) -> float:
    """Largest g > 0 of states (x1, x1', x2, x2'), or 0."""
    inside = np.sin(rows[:, 0]) - rows[:, 2] - gap
    return float(inside.max(initial=0.0))

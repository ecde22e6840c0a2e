"""What a run of a structure gives, and two such runs as one with stated errors."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

from flint import arb, ctx

from ..contact import Undecided
from .impulses import StopImpact

#: Coordinates and velocities.
State = tuple[tuple[arb, ...], tuple[arb, ...]]


@dataclass(frozen=True)
class Impact(StopImpact):
    """One impact of a run: completed periods, time and coordinates (N,) besides."""

    period: int
    time: arb
    q: tuple[arb, ...]


@dataclass(frozen=True)
class Change:
    """Another event: what becomes of a stop, with the state.

    kind: chatter (its limit), closed (without friction), slide_positive, slide_negative, stick,
    release.
    """

    kind: str
    time: arb
    stop: int
    state: State


@dataclass(frozen=True)
class StructureRun:
    """Impacts and other events in order; the states at the times asked for; why the run ended.

    `ending`: completed, event_cap, or what is no single outcome: simultaneous, sequence_cap,
    painleve (no force fits), frictional_contacts (several closed stops, with friction). The impact
    at which a chatter is completed is not listed. The first `proved` entries of the story and the
    first `proved_states` states enclose the exact motion, the radii of the others are stated
    errors. `precision` in bits.
    """

    story: list[Impact | Change]
    states: list[State]
    ending: str
    precision: int
    proved: int
    proved_states: int

    @property
    def impacts(self) -> list[Impact]:
        """The impacts in order."""
        return [entry for entry in self.story if isinstance(entry, Impact)]


def merged(plain: StructureRun, finer: StructureRun) -> StructureRun:
    """The finer values with radii that include the plain ones, where these are no enclosures.

    Further impacts of the finer run before the limit of a chatter are left out. Of runs that ended
    at their cap of events the first part is kept that both have.

    Raises
    ------
    Undecided : the runs differ in their events
    """
    with ctx.workprec(finer.precision):
        story: list[Impact | Change] = []
        rest = iter(finer.story)
        capped = plain.ending == finer.ending == "event_cap"
        for number, one in enumerate(plain.story):
            two = next(rest, None)
            while isinstance(one, Change) and one.kind == "chatter" and isinstance(two, Impact):
                two = next(rest, None)
            if two is None and capped:
                break
            if number < plain.proved:
                story.append(one)
            elif isinstance(one, Impact) and isinstance(two, Impact):
                story.append(_impact(one, two))
            elif isinstance(one, Change) and isinstance(two, Change):
                if (one.kind, one.stop) != (two.kind, two.stop):
                    raise Undecided("the events of two runs")
                state = _states(one.state, two.state)
                story.append(replace(two, time=_ball(one.time, two.time), state=state))
            else:
                raise Undecided("the events of two runs")
        known = (plain.ending, len(plain.states), None)
        if not capped and known != (finer.ending, len(finer.states), next(rest, None)):
            raise Undecided("the ends of two runs")
        states = [
            one if k < plain.proved_states else _states(one, two)
            for k, (one, two) in enumerate(zip(plain.states, finer.states, strict=not capped))
        ]
    return replace(plain, story=story, states=states)


def _impact(one: Impact, two: Impact) -> Impact:
    if (one.period, one.stop, one.regime) != (two.period, two.stop, two.regime):
        raise Undecided("the impacts of two runs")
    values: dict[str, Any] = {}
    for name, value in vars(one).items():
        other = getattr(two, name)
        if isinstance(value, arb):
            values[name] = _ball(value, other)
        else:
            values[name] = _balls(value, other) if isinstance(value, tuple) else other
    return Impact(**values)


def _states(one: State, two: State) -> State:
    return _balls(one[0], two[0]), _balls(one[1], two[1])


def _balls(one: tuple[arb, ...], two: tuple[arb, ...]) -> tuple[arb, ...]:
    return tuple(_ball(p, q) for p, q in zip(one, two, strict=True))


def _ball(one: arb, two: arb) -> arb:
    """The finer value with a radius that includes the other one."""
    return arb(two.mid(), (abs(one - two) + two.rad()).abs_upper())

"""The two stretches of a run: its kept window, and the part before it, simulated again.

A run is reproducible to the bit, so that the same call gives again the part that it has not kept.
It is simulated again only as far as the reference may go.
"""

from __future__ import annotations

import json
import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import SimulationError
from ..run import EventKind, Run
from ..simulation import simulated
from ..structure_run import StructureRun
from ..tables import of_columns

#: Events simulated again for each one that the reference may follow; more than one, because the
#: reference lists fewer impacts of a chatter, and no grazes.
MORE, _SOME = 4, 1000


AnyRun = Run | StructureRun


@dataclass(frozen=True)
class Rows:
    """Rows of a run in one stretch of it, and how many impacts, contacts, sections come before.

    Those of a structure are in the coordinates of its compiled form, a section the numbers q, v.
    """

    run: AnyRun
    impacts: NDArray[np.void]
    grazes: NDArray[np.void]
    contacts: NDArray[np.void]
    events: NDArray[np.void]
    sections: NDArray[np.float64]
    before: tuple[int, int, int]
    #: Whether the stretch ends where the run does.
    to_the_end: bool


@dataclass(frozen=True)
class Stretches:
    """A run in its stretches.

    Attributes
    ----------
    lead
        The part before the kept window; None if there is none, or if it cannot be reproduced.
    kept
        The kept window.
    from_start
        Whether all from t = 0 on is known, as far as the reference may go.
    first_turn
        Drive periods before the first section of a run that keeps all.
    section_phase
        Of the sections.
    again
        The run simulated again; None if that was not necessary.
    """

    lead: Rows | None
    kept: Rows
    from_start: bool
    first_turn: int
    section_phase: float
    again: AnyRun | None


def stretches(run: AnyRun, most: int) -> Stretches:
    """Simulate again what a run has not kept, as far as so many impacts and periods.

    Raises
    ------
    Interrupted
        After Ctrl-C.
    """
    core: dict[str, Any] = json.loads(run._core.to_json())
    # the last row is the stop, which is not counted
    dropped = int(core["checkpoint"]["events"]) - (len(run.events) - 1)
    found = only_kept(run)
    sections = found.kept.before[2]
    if not (dropped or sections):
        return replace(found, from_start=True)
    again = _made_again(run, core["options"], most)
    if not _is_the_same(run, again, dropped, sections, most):
        return replace(found, again=again)
    whole = only_kept(again).kept
    rows = whole.events[:-1][:dropped]
    before = (found.kept.before[0], _contacts(rows), sections)
    lead = _first_rows(run, whole, rows, sections)
    kept = replace(found.kept, before=before)
    return replace(found, lead=lead, kept=kept, from_start=True, again=again)


def only_kept(run: AnyRun) -> Stretches:
    """The kept window alone."""
    core: dict[str, Any] = json.loads(run._core.to_json())
    impacts, grazes, contacts, events, sections = _tables(run)
    # the number of sections is known, that of contacts is not
    before = (run.impact_count - len(run.impacts), 0, int(core["first_section"]) - 1)
    kept = Rows(run, impacts, grazes, contacts, events, sections, before, to_the_end=True)
    phase = float(core["options"]["section_phase"])
    return Stretches(None, kept, False, 1 - (phase > 0.0), phase, None)


def _tables(run: AnyRun) -> tuple[Any, ...]:
    """Impacts, grazes, contacts, events and sections."""
    if isinstance(run, Run):
        return run.impacts, run.grazes, run.contacts, run.events, run.stroboscopic
    core = run._core
    tables = (of_columns(each) for each in (core.impacts, core.grazes, core.contacts, core.events))
    count, *shape = core.stroboscopic.shape
    return *tables, core.stroboscopic.reshape(count, math.prod(shape))


def final_numbers(run: AnyRun) -> NDArray[np.float64]:
    """The numbers of the final state, as those of a section."""
    if isinstance(run, Run):
        return np.array(run.final_state.state)
    end = run._core.final_state
    return np.concatenate([end["q"], end["v"]])


def _made_again(run: AnyRun, options: dict[str, Any], most: int) -> AnyRun:
    """The run with all its rows, up to its end or a little further than the reference goes."""
    end, horizon = run.final_state, options["horizon"]
    in_periods = run._core.interrupted or end.period > most or "Periods" in horizon
    length: dict[str, Any] = {"time": horizon.get("Time")}
    if run.system.drive_frequency > 0.0 and in_periods:
        asked = horizon.get("Periods", end.period + 1)
        length = {"periods": min(asked, end.period + 1, most + 1)}
    again: AnyRun
    try:
        again = simulated(
            run.system,
            initial=run.initial,
            **length,
            max_events=min(options["max_events"], _most_events(most)),
            chatter_tolerance=options["chatter_tolerance"],
            section_phase=options["section_phase"],
        )
    except SimulationError as error:
        again = error.result
    return again


def _most_events(most: int) -> int:
    return MORE * most + _SOME


def _is_the_same(run: AnyRun, again: AnyRun, dropped: int, sections: int, most: int) -> bool:
    """Whether the repeated run equals the run, as far as both have rows, and goes far enough."""
    events, rows = again.events[:-1], run.events[:-1]
    beyond = run.final_state.period > most or dropped + len(rows) > _most_events(most)
    if not beyond:
        # a run that ends before its window begins has fewer
        sections = min(sections, run.final_state.period)
        if len(events) < dropped + len(rows) or len(again.stroboscopic) < sections:
            return False
        if not run._core.interrupted and _end(again) != _end(run):
            return False
    both = min(len(rows), max(0, len(events) - dropped))
    later = events[dropped : dropped + both]
    alike = all((later[name] == rows[name][:both]).all() for name in ("time", "period", "kind"))
    impacts = int((events["kind"][:dropped] == EventKind.IMPACT).sum())
    known = len(events) < dropped or impacts == run.impact_count - len(run.impacts)
    return alike and known


def _end(run: AnyRun) -> tuple[Any, ...]:
    end = run.final_state
    return end.time, end.period, end.time_in_period, end.mode, *final_numbers(run).tolist()


def _first_rows(run: AnyRun, whole: Rows, events: NDArray[np.void], sections: int) -> Rows:
    """The rows of so many events and sections."""
    impacts = int((events["kind"] == EventKind.IMPACT).sum())
    grazes = int((events["kind"] == EventKind.GRAZE).sum())
    return Rows(
        run,
        whole.impacts[:impacts],
        whole.grazes[:grazes],
        whole.contacts[: _contacts(events)],
        events,
        whole.sections[:sections],
        (0, 0, 0),
        to_the_end=False,
    )


def _contacts(events: NDArray[np.void]) -> int:
    """How many of these events are rows of sustained contact."""
    return int(np.isin(events["kind"], (EventKind.IMPACT, EventKind.GRAZE), invert=True).sum())

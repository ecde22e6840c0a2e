"""`verify`: the checks of what is given, the problem that a run poses, and the interrupt."""

from __future__ import annotations

import bisect
import json
from typing import TYPE_CHECKING, Any

from ..checks import count, reject
from ..errors import Interrupted
from ..results import Run
from .result import Verification

if TYPE_CHECKING:
    from flint import arb

    from ..reference.simulate import Event
    from .motion import Pass, Problem

#: Digits that may be asked for: a double has hardly more.
MOST_ASKED = 14
#: So many impacts in a row this far off, in drive periods, and the run has parted for good.
PARTED, FAR = 40, 0.01
#: How far past the end of a run the reference goes, in its length or in drive periods.
BEYOND = 2**-10


def need_flint() -> None:
    """Say how to get python-flint where it is not installed."""
    try:
        import flint  # noqa: F401
    except ImportError as error:
        raise ImportError(
            'verification needs python-flint: pip install "vibroimpact[verify]"', name="flint"
        ) from error


def verify(
    run: Run, *, digits: int = 10, max_precision: int = 4096, max_events: int = 10_000
) -> Verification:
    """Re-run a motion at higher precision, and say how far and to how many digits it is right.

    Parameters and start are taken as the exact doubles that they are, and the motion is followed
    from t = 0, whatever the run keeps, by an independent simulator in ball arithmetic. Where it
    can, it encloses the exact motion, so that the errors stated are proved; complete chatter and
    lasting contact, and what enclosures at ``max_precision`` do not reach, rest on two precisions
    that agree. Each row says which. It takes some ten to a hundred milliseconds for an impact.

    Parameters
    ----------
    run
        What ``simulate``, ``Run.resume`` or ``load`` returned.
    digits
        Correct digits asked for, 1 to 14: the horizon is where the run no longer has them.
    max_precision
        Most bits of the reference, 512 to 65536.
    max_events
        Most impacts, and most drive periods, to follow from t = 0.

    Returns
    -------
    Verification
        Errors of all kept impacts, contact events and sections, the horizon, and in ``stopped``
        why it ended early, if it did; ``print`` it for a summary.

    Raises
    ------
    ParameterError
        If an argument is of the wrong kind or out of range.
    ImportError
        Without python-flint, which ``vibroimpact[verify]`` brings.
    Interrupted
        After Ctrl-C; ``.result`` is the Verification of what was known by then.
    """
    if not isinstance(run, Run):
        reject("run", run, "a vibroimpact.Run")
    digits = count("digits", digits, least=1, most=MOST_ASKED)
    max_precision = count("max_precision", max_precision, least=512, most=65_536)
    max_events = count("max_events", max_events, least=1)
    need_flint()
    from .comparison import compare
    from .motion import exact_motion

    span = _Span(run, max_events)
    problem = span.problem()
    exact = span.window(exact_motion(problem, run.impact_count, max_precision))
    found = compare(run, exact, problem.system, span.section_times(), digits)
    if found.stopped == "interrupted":
        raise Interrupted("interrupted; .result holds what is verified so far", found)
    return found


class _Span:
    """The times of a run: its kept window, its sections, and how far the reference goes."""

    def __init__(self, run: Run, max_events: int) -> None:
        core: dict[str, Any] = json.loads(run._core.to_json())
        self.run, self.max_events = run, max_events
        self.first_section = int(core["first_section"])
        self.section_phase = float(core["options"]["section_phase"])
        self.end = run.final_state.time
        self.period = run.system.drive_period
        self.driven = run.system.drive_frequency > 0.0
        self.in_a_row = 0

    def problem(self) -> Problem:
        """What the reference is to follow."""
        from ..reference.flight import exact
        from .motion import Problem, exact_system

        system = self.run.system
        return Problem(
            system=exact_system(system),
            initial=tuple(exact(value) for value in self.run.initial),
            phase=exact(system.phase),
            law=system.law,
            times=self._times,
            parted=self._parted,
            most_impacts=self.max_events,
        )

    def capped(self) -> bool:
        """Whether the run is longer than the reference may go."""
        return self.driven and self.end > self.max_events * self.period

    def section_times(self) -> list[float]:
        """Times of the kept sections."""
        shift = self.section_phase / self.run.system.drive_frequency if self.driven else 0.0
        number = len(self.run.stroboscopic)
        turns = range(self._first_turn(), self._first_turn() + number)
        return [turn * self.period + shift for turn in turns]

    def _first_turn(self) -> int:
        """Section k lies at k T, or at (k - 1) T + shift."""
        return self.first_section - (self.section_phase > 0.0)

    def _times(self) -> list[arb]:
        """Times of the kept sections within reach, and one past the end, as balls."""
        from flint import arb

        end = arb(self.end) * (1 + BEYOND) + BEYOND
        if not self.driven:
            return [end]
        turn = 2 * arb.pi() / arb(self.run.system.drive_frequency)
        shift = arb(self.section_phase) / arb(self.run.system.drive_frequency)
        end = turn * self.max_events if self.capped() else arb(self.end) + turn * BEYOND
        number, first = len(self.run.stroboscopic), self._first_turn()
        times = (turn * k + shift for k in range(first, first + number))
        return [*(time for time in times if time < end), end]

    def _parted(self, number: int, event: Event) -> bool:
        """Whether the run has parted from the exact motion for good, by the times of impacts.

        Not asked with contact in the run: the numbers of its impacts are a matter of tolerance.
        """
        times = self.run.impacts["time"]
        row = number - (self.run.impact_count - len(times))
        if number == 0:
            self.in_a_row = 0
        if not self.driven or len(self.run.contacts) or not 0 <= row < len(times):
            return False
        far = not abs(float(event.time) - float(times[row])) < FAR * self.period
        self.in_a_row = self.in_a_row + 1 if far else 0
        return self.in_a_row == PARTED

    def window(self, exact: Pass) -> Pass:
        """The exact motion from the start of the kept window on."""
        from dataclasses import replace

        times = [float(entry.values[0]) for entry in exact.entries]
        near = 1e-9 * max(1.0, self.run.kept_from)
        first = bisect.bisect_left(times, self.run.kept_from - near) if self.run.kept_from else 0
        kept = self.run.events["time"]
        while first < len(times) and times[first] < self.run.kept_from + near:
            if len(kept) and abs(float(kept[0]) - times[first]) < 2 * near:
                break
            first += 1
        stopped, detail = exact.stopped, exact.detail
        if self.capped() and not stopped:
            stopped, detail = "event_cap", f"more than {self.max_events} drive periods"
        return replace(exact, entries=exact.entries[first:], stopped=stopped, detail=detail)

"""`verify`: the checks of arguments, the problems for the references, and Ctrl-C."""

from __future__ import annotations

import bisect
from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

from ..arguments import count, flag, reject
from ..errors import Interrupted
from ..extras import missing
from ..interruption import interruptible
from ..run import Run
from ..structure_run import StructureRun
from .result import Verification
from .stretches import AnyRun, Stretches, only_kept, stretches
from .watch import Watch, progress_bar

if TYPE_CHECKING:
    from flint import arb

    from .passes import Pass
    from .stretches import Rows

#: Digits that may be asked for: a double has hardly more. Users see this limit.
MOST_ASKED = 14
#: How far the reference goes beyond the end of a run, relative to its length or in drive periods.
_BEYOND = 2**-10


def need_flint() -> None:
    """Return the error for a missing python-flint, with how to install it."""
    try:
        import flint  # noqa: F401
    except ImportError as error:
        raise missing("verify", "verification needs python-flint") from error


@interruptible
def verify(
    run: Run | StructureRun,
    *,
    digits: int = 10,
    max_precision: int = 4096,
    max_events: int = 10_000,
    progress: bool = False,
) -> Verification:
    """Say until when a motion is right, and to how many digits, at higher precision.

    Parameters and start are taken as the exact doubles that they are, and the motion is followed
    from t = 0, whatever the run keeps, by an independent simulator in ball arithmetic. Parts that
    the run has not kept are simulated again, to the same bits, and compared as well: the horizon is
    that of the whole motion. The comparison ends where the run has left the exact motion for good.
    Where the simulator can, it encloses the exact motion, so that the errors stated are proved. For
    complete chatter and sustained contact, and where enclosures at ``max_precision`` are too wide,
    two precisions that agree are compared instead. Each row says which is the case. It takes some
    five milliseconds for an impact of one or two bodies.

    Parameters
    ----------
    run
        What ``simulate``, ``resume`` or ``load`` returned, of a System or of a Structure.
    digits
        Correct digits asked for, 1 to 14: the horizon is where the run no longer has them.
    max_precision
        Most bits of the reference, 512 to 65536.
    max_events
        Most impacts, and most drive periods, to follow from t = 0.
    progress
        Show a progress bar; it starts anew with each pass at another precision.

    Returns
    -------
    Verification
        Errors of all impacts, contact events and sections, those kept and those from t = 0 on, the
        horizon, and in ``stopped`` why it ended early, if it did; ``print`` it for a summary.

    Raises
    ------
    ParameterError
        If an argument is of the wrong kind or out of range.
    ImportError
        Without python-flint, which ``pip install python-flint`` brings.
    Interrupted
        After Ctrl-C; ``.result`` is the Verification of what was known by then.

    Examples
    --------
    >>> import vibroimpact as vi
    >>> system = vi.System(mass_ratio=0.6, frequency_ratio=2, restitution=0.8, gap=0.5,
    ...                    drive_frequency=1.8, moment_amplitude=1)
    >>> check = vi.verify(vi.simulate(system, initial=(0, 0.5, 0, 0), periods=10))
    >>> check.certified, check.least_digits > 13
    (True, True)
    >>> mass = vi.Structure([[1]], [[1]], [vi.Stop([1], 0.2, 0.8)], drive_amplitude=[1],
    ...                     drive_frequency=1.4)
    >>> vi.verify(vi.simulate(mass, initial=[[0], [0]], periods=3)).holds
    True
    """
    if not isinstance(run, (Run, StructureRun)):
        reject("run", run, "a vibroimpact.Run or a vibroimpact.StructureRun")
    digits = count("digits", digits, least=1, most=MOST_ASKED)
    max_precision = count("max_precision", max_precision, least=512, most=65_536)
    max_events = count("max_events", max_events, least=1)
    progress = flag("progress", progress)
    need_flint()
    from .passes import FIRST, Pass

    try:
        parts = stretches(run, max_events)
        span = _span(run, parts, max_events)
        with progress_bar(run, max_events, shown=progress) as bar:
            exact = span.within_reach(span.exact(Watch(parts, bar), max_precision))
    except Interrupted:
        # while the part that the run has not kept was simulated again
        parts = only_kept(run)
        span = _span(run, parts, max_events)
        exact = Pass(FIRST, [], [], 0, "interrupted", "interrupted")
    beside = [] if parts.lead is None else [(parts.lead, span.lead(exact))]
    beside.append((parts.kept, span.window(exact)))
    found = span.compare(beside, exact, digits)
    if found.stopped == "interrupted":
        raise Interrupted("interrupted", found, holds="what is verified so far")
    return found


def _span(run: AnyRun, parts: Stretches, max_events: int) -> _Span:
    of_kind = _Span if isinstance(run, Run) else _StructureSpan
    return of_kind(run, parts, max_events)


class _Span:
    """How far the reference goes for a run, and which part belongs to which stretch."""

    def __init__(self, run: AnyRun, parts: Stretches, max_events: int) -> None:
        self.run, self.parts, self.max_events = run, parts, max_events
        self.end = run.final_state.time
        self.period = run.system.drive_period
        self.driven = run.system.drive_frequency > 0.0

    def exact(self, watch: Watch, max_precision: int) -> Pass:
        """The exact motion."""
        from ..reference.flight import exact
        from .motion import Problem, exact_system
        from .passes import exact_motion

        assert isinstance(self.run, Run)
        system = self.run.system
        problem = Problem(
            system=exact_system(system),
            initial=tuple(exact(value) for value in self.run.initial),
            phase=exact(system.phase),
            law=system.law,
            times=self._times,
            end=self._end,
            watch=watch,
            most_impacts=self.max_events,
        )
        return exact_motion(problem, max_precision)

    def compare(
        self, beside: Sequence[tuple[Rows, Pass]], exact: Pass, digits: int
    ) -> Verification:
        """The stretches of the run beside those of the exact motion."""
        from .comparison import compare
        from .motion import exact_system

        assert isinstance(self.run, Run)
        system = exact_system(self.run.system)
        return compare(self.parts, beside, exact, system, self.section_times(), digits)

    def capped(self) -> bool:
        """Whether the run is longer than the reference may go."""
        return self.driven and self.end > self.max_events * self.period

    def section_times(self) -> list[float]:
        """Times of all sections, from t = 0 to the end of the run."""
        shift = self.parts.section_phase / self.run.system.drive_frequency if self.driven else 0.0
        return [turn * self.period + shift for turn in self._turns()]

    def _turns(self) -> range:
        """Section k lies at k T, or at (k - 1) T + shift."""
        first, kept = self.parts.first_turn, self.parts.kept
        return range(first, first + kept.before[2] + len(kept.sections))

    def _end(self) -> arb:
        """The time at which the run ends, as a ball."""
        from flint import arb

        final = self.run.final_state
        if not self.driven:
            return arb(final.time)
        turn = 2 * arb.pi() / arb(self.run.system.drive_frequency)
        return turn * final.period + arb(final.time_in_period)

    def _times(self) -> list[arb]:
        """Times of the sections within reach, and one past the end, as balls."""
        from flint import arb

        end = arb(self.end) * (1 + _BEYOND) + _BEYOND
        if not self.driven:
            return [end]
        turn = 2 * arb.pi() / arb(self.run.system.drive_frequency)
        shift = arb(self.parts.section_phase) / arb(self.run.system.drive_frequency)
        end = turn * self.max_events if self.capped() else arb(self.end) + turn * _BEYOND
        within = self._turns()[: self.max_events + 1]
        times = (turn * k + shift for k in within)
        return [*(time for time in times if time < end), end]

    def within_reach(self, exact: Pass) -> Pass:
        """The exact motion, with the reason to stop if it ends before the run does."""
        if not self.capped() or exact.stopped:
            return exact
        detail = f"the run has more than {self.max_events} drive periods (max_events)"
        return replace(exact, stopped="event_cap", detail=detail)

    def lead(self, exact: Pass) -> Pass:
        """The exact motion beside what comes before the kept window."""
        return replace(exact, samples=exact.samples[: self.parts.kept.before[2]])

    def window(self, exact: Pass) -> Pass:
        """The exact motion from the start of the kept window on."""
        times = [float(entry.values[0]) for entry in exact.entries]
        near = 1e-9 * max(1.0, self.run.kept_from)
        first = bisect.bisect_left(times, self.run.kept_from - near) if self.run.kept_from else 0
        kept = self.run.events["time"]
        while first < len(times) and times[first] < self.run.kept_from + near:
            if len(kept) and abs(float(kept[0]) - times[first]) < 2 * near:
                break
            first += 1
        before = self.parts.kept.before[2]
        return replace(
            exact,
            entries=exact.entries[first:],
            samples=exact.samples[before:],
            proved_samples=max(0, exact.proved_samples - before),
        )


class _StructureSpan(_Span):
    """The same for a run of a structure."""

    def exact(self, watch: Watch, max_precision: int) -> Pass:
        """The exact motion."""
        from ..reference.flight import exact
        from .passes import exact_motion
        from .structure_motion import StructureProblem, exact_structure
        from .structure_sizes import window

        assert isinstance(self.run, StructureRun)
        structure = self.run.system
        q, v = structure._to_core(self.run.initial).tolist()
        problem = StructureProblem(
            structure=exact_structure(structure),
            start=(tuple(map(exact, q)), tuple(map(exact, v))),
            times=self._times,
            end=self._end,
            watch=watch,
            most=self.max_events,
            window=min(window(structure.frequencies, structure.drive_frequency), self.end or 1.0),
        )
        return exact_motion(problem, max_precision)

    def compare(
        self, beside: Sequence[tuple[Rows, Pass]], exact: Pass, digits: int
    ) -> Verification:
        """The stretches of the run beside those of the exact motion."""
        from .structure_comparison import compare_structure
        from .structure_motion import exact_structure
        from .structure_sizes import StructureSizes

        assert isinstance(self.run, StructureRun)
        frequencies, times = self.run.system.frequencies, self.section_times()
        made = exact_structure(self.run.system)
        sizes = StructureSizes(made, frequencies, exact, times, self.end)
        return compare_structure(self.parts, beside, exact, made, sizes, times, digits)

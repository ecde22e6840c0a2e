"""What the runs of all machines have alike: how they ended, what motion it is, and going on."""

from __future__ import annotations

import os
from abc import abstractmethod
from collections.abc import Mapping, Sequence
from functools import cached_property
from typing import TYPE_CHECKING, Any, Generic, Self, TypeAlias, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _core
from ._core import Regime
from .archived import Archived, Parts
from .arguments import count, flag, not_negative, optional_count, positive, reject, times_of
from .errors import Interrupted, SimulationError, warn
from .horizons import horizon
from .interruption import interruptible
from .machine import Machine
from .made_with import MadeWith
from .period_report import PeriodReport, as_period_report
from .quadrature import Integrable
from .run_parts import Slopes
from .run_trace import Trace, with_trace, without_trace
from .scales import Units
from .showing import Facts, Shown
from .tables import EventKind, Table
from .verbs import verb

if TYPE_CHECKING:
    import pandas
    from matplotlib.axes import Axes

    from .bounces import Bounces
    from .verb_types import Animation

# The machine, its compiled runs, and how a start of it is told.
MachineT = TypeVar("MachineT", bound=Machine)
CoreT = TypeVar("CoreT", bound=_core.Run | _core.StructureRun)
StartT = TypeVar("StartT")
AnyRun: TypeAlias = "RunRecord[Any, Any, Any]"


@interruptible
class RunRecord(Archived, Shown, Integrable, Generic[MachineT, CoreT, StartT]):
    """What a `Run` and a `StructureRun` have alike."""

    # The derivatives that it was made with.
    _made_with: MadeWith | None = None

    def __init__(self, core: CoreT, system: MachineT, initial: StartT) -> None:
        self._core = core
        self._system = system
        self._initial = initial

    @property
    def system(self) -> MachineT:
        """The system or structure that was simulated."""
        return self._system

    @classmethod
    @abstractmethod
    def _by(cls, system: MachineT, names: tuple[Any, ...], along: Mapping[str, Any]) -> Any:
        """Return what the core differentiates a run by; ParameterError for what it cannot."""

    @property
    @abstractmethod
    def initial(self) -> StartT:
        """The state at t = 0."""

    @property
    @abstractmethod
    def impacts(self) -> Table:
        """Kept impacts."""

    @property
    @abstractmethod
    def contacts(self) -> Table:
        """Kept events of sustained contact."""

    @property
    @abstractmethod
    def final_state(self) -> Any:
        """The state at the end."""

    @abstractmethod
    def _impacts(self, rows: Any) -> Table:
        """Return impacts of the core as a table."""

    @abstractmethod
    def _beside_impacts(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return the states just before and just after the impacts, as rows of a trajectory."""

    @abstractmethod
    def _impact_rates(self, found: Any, slopes: Slopes) -> dict[str, NDArray[np.float64]]:
        """Return derivatives (n, ..., k) of columns of the impacts, from an `ImpactSensitivity`.

        ``slopes(field, shape)`` are those of fields of the machine.
        """

    @abstractmethod
    def _pressed(self, times: NDArray[np.float64]) -> NDArray[np.bool_]:
        """Whether a contact is closed, under force, at times."""

    @abstractmethod
    def _states(self, times: NDArray[np.float64], forces: bool) -> tuple[list[Any], bool]:
        """Return arrays with a row for each time, states first; whether Ctrl-C left rows out."""

    @abstractmethod
    def _tables(self) -> Parts:
        """Return metadata and arrays of a file, without the trace."""

    @classmethod
    @abstractmethod
    def _from_tables(
        cls, metadata: dict[str, Any], arrays: dict[str, NDArray[Any]], trace: Trace | None
    ) -> Self:
        """Return the run of these, with its trace if it has one."""

    def _parts(self) -> Parts:
        return with_trace(self._tables(), self._core)

    @classmethod
    def _from_parts(cls, metadata: dict[str, Any], arrays: dict[str, NDArray[Any]]) -> Self:
        return cls._from_tables(metadata, *without_trace(metadata, arrays))

    @property
    def time_in_contact(self) -> float:
        """Time in sustained contact within the kept window; impacts take no time."""
        return self._core.time_in_contact

    @property
    def stop_reason(self) -> str:
        """Why the run ended: ``"completed"``, or what stopped it earlier; see the notation page.

        ``"rest"`` is no early stop: both bodies of a System rest in contact, nothing will ever move
        them, and the run is carried to the end asked for.
        """
        return self._core.stop_reason

    @property
    def stop_detail(self) -> str:
        """A sentence with time and impact number, of a System with its state, on how it ended."""
        return self._core.stop_detail

    @property
    def kept_from(self) -> float:
        """The time at which the kept window starts."""
        return self._core.kept_from

    @property
    def impact_count(self) -> int:
        """Number of impacts since t = 0, kept or not, on all stops of a structure.

        Of a complete chatter, which has infinitely many, it counts those before the skipped ones;
        ``bounces`` lists the others.
        """
        return self._core.impact_count

    @cached_property
    def period(self) -> PeriodReport:
        """The period m-n with its evidence; may follow a nearby orbit for some periods.

        Raises
        ------
        Interrupted
            After Ctrl-C; ``.result`` is this run.
        """
        core = self._core.period()
        if core.interrupted:
            raise Interrupted("interrupted while the period was looked for", self)
        return as_period_report(core)

    @property
    def label(self) -> str:
        """The label of the motion: ``"1-1"``, ``"2-inf"`` (chatter), ``"unresolved"`` ...

        ``period.evidence`` says in words why it is unresolved. With fewer than four kept drive
        periods it always is: simulate, or keep, more. From four on the motion is followed beyond
        the run until it is known, or for ten times the run's own periods, at least 1536.
        """
        return self.period.label

    def _at(self, t: ArrayLike, forces: bool) -> list[Any]:
        """Return the arrays of ``_states`` at times in the kept window, for one time their row.

        Raises
        ------
        ParameterError
            If a time lies outside.
        Interrupted
            After Ctrl-C; ``.result`` holds the rows of the first times.
        """
        times, single = times_of("t", t)
        forces = flag("forces", forces)
        first, last = self.kept_from, self.final_state.time
        outside = np.flatnonzero((times < first) | (times > last))
        if len(outside):
            place = int(outside[0])
            window = f"times in the kept window, {first!r} to {last!r}"
            reject("t" if single else f"t[{place}]", float(times[place]), window)
        arrays, interrupted = self._states(times, forces)
        if interrupted:
            known = f"the rows of the first {len(arrays[0])} times"
            raise Interrupted("interrupted", _one_or_all(arrays), holds=known)
        return [array[0] for array in arrays] if single else arrays

    def _works(self) -> dict[str, float]:
        """Return energies and works in the kept window, by name.

        Raises
        ------
        Interrupted
            After Ctrl-C; ``.result`` is this run.
        """
        works = self._core.energy_audit()
        if works is None:
            raise Interrupted("interrupted while the works were added up", self)
        return works

    def bounces(self, *, down_to: float = 0.0, most: int = 1_000_000) -> Bounces:
        """List all impacts of the kept window, those that complete chatter skipped included.

        The skipped ones are computed one by one from the last listed impact before them, as
        ``trajectory`` and ``energy_audit`` do.

        Parameters
        ----------
        down_to
            The list of a chatter ends before the first skipped impact whose approach velocity is
            below this, >= 0; 0 lists all that rounding lets the bodies make. Rows of ``impacts``
            are listed whatever their velocity.
        most
            Cap on the number of skipped impacts, of all chatters together. The result says in
            ``ends`` which lists end there.

        Returns
        -------
        Bounces
            ``.impacts`` has the columns of ``impacts``, and ``skipped``.

        Raises
        ------
        ParameterError
            If an argument is out of range.
        Interrupted
            After Ctrl-C; ``.result`` is the Bounces up to there.

        Examples
        --------
        A ball falls on a table, and loses a tenth of its speed at each bounce:

        >>> import vibroimpact as vi
        >>> ball = vi.System(
        ...     mass_ratio=0, frequency_ratio=0, restitution=0.9, gap=0, drive_frequency=0,
        ...     moment_amplitude=1, contact="direct",
        ... )
        >>> run = vi.simulate(ball, initial=(-1, 0, 0, 0), time=40)
        >>> bounces = run.bounces(down_to=1e-6)
        >>> len(run.impacts), len(bounces.impacts)
        (19, 135)
        """
        slowest = not_negative("down_to", down_to)
        most = count("most", most, least=0)
        from .bounces import as_bounces  # here, to keep the import of the package light

        rows, skipped, ends, interrupted = self._core.bounces(slowest, most)
        bounces = as_bounces(self._impacts(rows), skipped, ends)
        if interrupted:
            known = f"the first {len(bounces.impacts)} impacts"
            raise Interrupted("interrupted while bounces were listed", bounces, holds=known)
        return bounces

    def resume(
        self,
        *,
        periods: int | None = None,
        time: float | None = None,
        keep: int | None = None,
        max_events: int | None = None,
        units: Units | None = None,
    ) -> Self:
        """Continue for further periods or time; all bits are those of one long run.

        Parameters
        ----------
        periods
            How many drive periods further; or else ``time``.
        time
            How much further in time; or else ``periods``. With ``units="SI"`` in s.
        keep
            Keep only the last so many periods; default all further ones.
        max_events
            Cap on the number of events since t = 0; default the cap of this run.
        units
            ``"SI"``: ``time`` is in s; for a System with scales.

        Raises
        ------
        ParameterError
            If an argument is of the wrong kind or out of range.
        SimulationError
            If a number left the range of floats; ``.result`` is the run up to there.
        Interrupted
            After Ctrl-C; ``.result`` is the run up to there.

        Examples
        --------
        >>> longer = run.resume(periods=10)
        >>> longer.final_state.period - run.final_state.period
        10
        """
        scales = self._system._chosen(units)
        if scales is not None and time is not None:
            time = positive("time", time) / scales.time
        span = horizon(self._system.drive_frequency, periods=periods, time=time, keep=keep)
        cap = optional_count("max_events", max_events, least=1)
        try:
            core: Any = self._core.resume(
                periods=span.periods, time=span.time, keep=span.keep, max_events=cap
            )
        except SimulationError as error:
            error.result = type(self)(error.result, self._system, self._initial)
            raise
        run = type(self)(core, self._system, self._initial)
        raise_if_interrupted(run)
        warn_of_the_cap([run], cap)
        return run

    def plot(self, **options: Any) -> Axes:
        """Draw the motion against time, by ``vi.plot.time_history``.

        Parameters
        ----------
        **options
            As in ``vi.plot.time_history``: ``periods``, ``window`` ...
            Without a drive period all that is kept is drawn, unless ``window`` says otherwise.

        Returns
        -------
        matplotlib.axes.Axes

        Examples
        --------
        >>> run.plot(periods=4).get_xlabel()
        'time $t$'
        """
        axes: Axes = verb("draw")(self, **options)
        return axes

    def animate(self, path: str | os.PathLike[str] | None = None, **options: Any) -> Animation:
        """Let the run move: the machine, or its stops, beside phase portrait and time history.

        Parameters
        ----------
        path
            Where to write it: .gif, .mp4 (needs the program ffmpeg) or .html. None writes nothing;
            in a notebook the result shows itself.
        **options
            ``window``, ``periods``, ``frames`` and ``frames_per_second``, as in
            `vibroimpact.plot.animation`.

        Returns
        -------
        vibroimpact.plot.Animation

        Raises
        ------
        ParameterError
            If an argument is of the wrong kind or out of range, the ending of the path is another,
            or there is no ffmpeg for .mp4.
        OSError
            If the file cannot be written.

        Examples
        --------
        >>> moving = run.animate(periods=1, frames=5)
        >>> type(moving).__name__
        'Animation'
        """
        moving: Animation = verb("animate")(self, path, **options)
        return moving

    def summary(self) -> str:
        """Return in some lines how the run ended, what motion it is, and what it holds.

        Examples
        --------
        >>> run.summary().splitlines()[1]
        'stop             completed'
        """
        facts = self._facts()
        width = max(map(len, facts)) + 2
        return "\n".join(f"{name:<{width}}{fact}" for name, fact in facts.items())

    def to_pandas(self) -> pandas.DataFrame:
        """Return the kept impacts as a data frame; ``run.events.to_pandas()`` gives the events.

        Raises
        ------
        ImportError
            If pandas is not installed.

        Examples
        --------
        >>> run.to_pandas()["regime"].unique().tolist()
        ['frictionless']
        """
        return self.impacts.to_pandas()

    def _facts(self) -> Facts:
        end = self.final_state
        regimes, numbers = np.unique(self.impacts["regime"], return_counts=True)
        names = [Regime(int(regime)).name.lower() for regime in regimes]
        counted = [f"{number} {name}" for name, number in zip(names, numbers, strict=True)]
        return {
            "motion": f"{self.label} ({self.period.evidence})",
            "stop": self.stop_reason
            if self.stop_reason in ("completed", "rest")
            else f"{self.stop_reason}: {self.stop_detail}",
            **self._ends(),
            "drive periods": end.period,
            "impacts": f"{self.impact_count}, of which {len(self.impacts)} are kept",
            "regimes": ", ".join(counted) or "none",
            "kept": f"time {self.kept_from:.6g} to {end.time:.6g}",
            "time in contact": f"{self.time_in_contact:.6g}",
        }

    def _ends(self) -> Facts:
        """Return what is said of start and end."""
        end = self.final_state
        return {"end": f"time {end.time:.6g}, {end.mode.replace('_', ' ')}"}

    def __eq__(self, other: object) -> bool:
        """Whether both are one motion, kept alike: the same numbers to the last bit."""
        if not isinstance(other, type(self)):
            return NotImplemented
        (ours, arrays), (theirs, others) = self._tables(), other._tables()
        return ours == theirs and all(
            array.tobytes() == others[name].tobytes() for name, array in arrays.items()
        )

    def __hash__(self) -> int:
        """Return a hash that equal runs share."""
        return hash((self._system, *np.ravel(self._initial).tolist(), self.impact_count))  # type: ignore[call-overload]

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickle through the parts that ``save`` writes."""
        return type(self)._from_parts, self._parts()

    def __repr__(self) -> str:
        """Say how the run ended and what it holds, without computing its label."""
        end = self.final_state
        return (
            f"<{type(self).__name__} {self.stop_reason} at time {end.time:.6g} "
            f"(period {end.period}), {impacts_in_words(self, ' impacts')}>"
        )


def raise_if_interrupted(run: AnyRun) -> None:
    """Raise Interrupted, carrying the run, if Ctrl-C cut it short."""
    if run._core.interrupted:
        time = run.final_state.time
        raise Interrupted(f"interrupted at time {time:.6g}", run, holds="the run so far")


# What is to be done about it.
AT_THE_CAP = "10 million events, the cap unless max_events= gives another, were not enough"


def warn_of_the_cap(runs: Sequence[AnyRun], cap: int | None) -> None:
    """Warn of runs that ended early at a cap that nobody asked for."""
    capped = [run for run in runs if run.stop_reason == "event_cap"] if cap is None else []
    if not capped:
        return
    which = "the run" if len(runs) == 1 else f"{len(capped)} of {len(runs)} runs"
    end = capped[0].final_state
    at = f"t = {end.time:.6g}, after {end.period} drive periods"
    warn(f"{which} ended early, at {at} (stop_reason event_cap): {AT_THE_CAP}")


def _one_or_all(arrays: list[Any]) -> Any:
    return arrays[0] if len(arrays) == 1 else tuple(arrays)


def impacts_in_words(run: AnyRun, unit: str = "") -> str:
    """Say how many impacts a run counts and keeps, and of how many chatters some are left out."""
    counted, kept = f"{run.impact_count}{unit}", f"{len(run.impacts)} kept"
    chatters = int(np.count_nonzero(run.contacts["kind"] == EventKind.CHATTER))
    if chatters:
        more = "a complete chatter" if chatters == 1 else f"{chatters} complete chatters"
        # Those that are known are in the kept window, which may be the whole run.
        if len(run.impacts) == run.impact_count:
            return f"{counted} and {more}, {kept}"
        return f"{counted}, {kept} and {more}"
    return f"{counted}, {kept}"

"""What a simulation returns: a run with its impacts, sections, events and label.

Field names and meanings are those of the notation page; all quantities are dimensionless. The
numbers live in the compiled core; a Run returns them as read-only arrays, built when first used.
"""

from __future__ import annotations

import os
from typing import TYPE_CHECKING, Any, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _core
from .arguments import (
    count,
    flag,
    horizon,
    not_negative,
    optional_count,
    positive,
    reject,
    times_of,
)
from .errors import Interrupted, SimulationError
from .interruption import interruptible
from .period_report import Evidence as Evidence
from .period_report import PeriodReport as PeriodReport
from .run_parts import EnergyAudit as EnergyAudit
from .run_parts import FinalState as FinalState
from .run_parts import read_only as read_only
from .run_record import RunRecord, impacts_in_words
from .scales import Units, chosen
from .system import System
from .tables import EventKind as EventKind
from .verbs import verb

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from .bounces import Bounces
    from .verb_types import Animation, NotFound, PeriodicMotion, RunInSI

# The tables of events, as the core has them.
_EVENTS = ("events", "grazes", "contacts")


@interruptible
class Run(RunRecord):
    """One simulated motion, as ``simulate``, ``Run.resume`` and ``load`` return it.

    Examples
    --------
    >>> import vibroimpact as vi
    >>> system = vi.System(mass_ratio=0.6, frequency_ratio=2, restitution=0.8, gap=0.5,
    ...                    drive_frequency=1.8, moment_amplitude=1)
    >>> run = vi.simulate(system, initial=(0, 0.5, 0, 0), periods=600, keep=100)
    >>> run
    <Run completed at time 2094.4 (period 600), 600 impacts, 100 kept>
    >>> run.label
    '1-1'
    >>> run.impacts["approach_velocity"].round(3)[:2]
    array([1.109, 1.109])
    """

    def trajectory(self, t: ArrayLike, *, forces: bool = False) -> NDArray[np.float64]:
        """Return the states x1, v1, x2, v2 at times ``t``, with ``forces`` the contact forces too.

        At the instant of an event this is the state after it. Within a complete chatter the states
        between the skipped impacts are computed as asked for.

        Parameters
        ----------
        t
            Times inside the kept window, in any order, shape (k,); or one time.
        forces
            Add two columns: normal force p >= 0 and tangential force on the tip, in units
            M1 l omega_2^2, zero in flight (theory page, section 5). The impulses of impacts are
            not forces: they are columns of ``impacts``.

        Returns
        -------
        array, shape (k, 4), or (k, 6) with ``forces``; (4,) or (6,) for one time

        Raises
        ------
        ParameterError
            If a time lies outside the kept window, from ``kept_from`` to ``final_state.time``.
        Interrupted
            After Ctrl-C; ``.result`` holds the rows of the first times.

        Examples
        --------
        >>> run.trajectory([run.kept_from, run.final_state.time]).shape
        (2, 4)
        """
        times, single = times_of("t", t)
        forces = flag("forces", forces)
        first, last = self.kept_from, self.final_state.time
        outside = np.flatnonzero((times < first) | (times > last))
        if len(outside):
            place = int(outside[0])
            window = f"times in the kept window, {first!r} to {last!r}"
            reject("t" if single else f"t[{place}]", float(times[place]), window)
        rows, interrupted = self._core.trajectory(times, forces)
        if interrupted:
            known = f"the rows of the first {len(rows)} times"
            raise Interrupted("interrupted", rows, holds=known)
        return rows[0] if single else rows

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
        bounces = as_bounces(self._with_approach(rows), skipped, ends)
        if interrupted:
            known = f"the first {len(bounces.impacts)} impacts"
            raise Interrupted("interrupted while bounces were listed", bounces, holds=known)
        return bounces

    def energy_audit(self) -> EnergyAudit:
        """Add up the works of all forces in the kept window and compare with the energies.

        Raises
        ------
        Interrupted
            After Ctrl-C; ``.result`` is this run.

        Examples
        --------
        >>> abs(run.energy_audit().residual) < 1e-9
        True
        """
        works = self._core.energy_audit()
        if works is None:
            raise Interrupted("interrupted while the works were added up", self)
        return EnergyAudit(**works)

    def resume(
        self,
        *,
        periods: int | None = None,
        time: float | None = None,
        keep: int | None = None,
        max_events: int | None = None,
        units: Units | None = None,
    ) -> Run:
        """Continue for further periods or time; all bits are those of one long run.

        Parameters
        ----------
        periods
            How many drive periods further; or else ``time``.
        time
            How much further in time; or else ``periods``. With ``units="SI"`` in s.
        keep
            Keep only the last so many periods.
        max_events
            Cap on the number of events since t = 0; default the cap of this run.
        units
            ``"SI"``: ``time`` is in s; the system needs scales.

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
        >>> longer.final_state.period
        610
        """
        scales = chosen(units, self._system.scales)
        if scales is not None and time is not None:
            time = positive("time", time) / scales.time
        span = horizon(self._system.drive_frequency, periods=periods, time=time, keep=keep)
        cap = optional_count("max_events", max_events, least=1)
        try:
            core = self._core.resume(
                periods=span.periods, time=span.time, keep=span.keep, max_events=cap
            )
        except SimulationError as error:
            error.result = type(self)(error.result, self._system, self._initial)
            raise
        run = type(self)(core, self._system, self._initial)
        raise_if_interrupted(run)
        return run

    def refine(self) -> PeriodicMotion | NotFound:
        """Find the periodic motion that this run has settled on, to rounding, with its verdict.

        Newton's method with exact derivatives starts from the end of the run; the sequence of
        events is that of a simulation from there. Works for a label m-n, chatter included.

        Returns
        -------
        PeriodicMotion or NotFound
            The motion; or, counting as False, why there is none.

        Raises
        ------
        ParameterError
            With ``drive_frequency = 0``: there is no period.

        Examples
        --------
        >>> motion = run.refine()
        >>> motion.label, motion.stability
        ('1-1', 'stable')
        """
        motion: PeriodicMotion | NotFound = verb("refine")(self)
        return motion

    def in_si(self) -> RunInSI:
        """Return the run in SI, by the scales of its system; attributes have the same names.

        Raises
        ------
        ParameterError
            If the system has no scales; those from ``System.from_physical`` have.

        Examples
        --------
        >>> import vibroimpact as vi
        >>> machine = vi.System.from_physical(
        ...     pendulum_mass=3, oscillator_mass=5, length=0.1, torsional_stiffness=500,
        ...     stiffness=50e3, gap=0.05, restitution=0.8, drive_frequency=180,
        ...     moment_amplitude=300,
        ... )
        >>> run = vi.simulate(machine, initial=(0, 0.5, 0, 0), periods=20, units="SI")
        >>> round(run.in_si().final_state.time, 2)  # in s
        0.7
        """
        found: RunInSI = verb("in_si")(self)
        return found

    def plot(self, **options: Any) -> Axes:
        """Draw the motion against time, by ``vi.plot.time_history``.

        Parameters
        ----------
        **options
            As in ``vi.plot.time_history``. Without a drive period all that is kept is drawn,
            unless ``window`` says otherwise.

        Returns
        -------
        matplotlib.axes.Axes

        Examples
        --------
        >>> import vibroimpact as vi
        >>> system = vi.System(mass_ratio=0.6, frequency_ratio=2.0, restitution=0.8, gap=0.5,
        ...                    drive_frequency=1.8, moment_amplitude=1.0)
        >>> run = vi.simulate(system, initial=(0, 0.5, 0, 0), periods=600, keep=100)
        >>> run.plot(periods=4).get_xlabel()
        '$t$'
        """
        axes: Axes = verb("draw")(self, **options)
        return axes

    def animate(self, path: str | os.PathLike[str] | None = None, **options: Any) -> Animation:
        """Let the run move: the machine beside its phase portrait and its time history.

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

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the run to ``path`` (.npz, no pickle); ``load`` gives it back bit for bit.

        Examples
        --------
        >>> run.save("run.npz")
        >>> vi.load("run.npz").label
        '1-1'
        """
        from . import archive  # here, to keep the import of the package light

        metadata, arrays = self._parts()
        archive.write(path, "run", metadata, arrays)

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> Self:
        """Read a run written by ``save``.

        Raises
        ------
        ValueError
            If the file is damaged, foreign, or holds something else.

        Examples
        --------
        >>> run.save("run.npz")
        >>> vi.Run.load("run.npz")
        <Run completed at time 2094.4 (period 600), 600 impacts, 100 kept>
        """
        from . import archive  # here, to keep the import of the package light

        return archive.read(path, {"run": cls._from_parts})

    def _parts(self) -> tuple[dict[str, Any], dict[str, NDArray[Any]]]:
        metadata = {
            "system": self._system.to_dict(),
            "initial": self._initial,
            "core": self._core.to_json(),
        }
        arrays: dict[str, NDArray[Any]] = {
            "impacts": read_only(self._core.impacts),
            "stroboscopic": self.stroboscopic,
            **{name: getattr(self, name).view(np.ndarray) for name in _EVENTS},
        }
        return metadata, arrays

    @classmethod
    def _from_parts(cls, metadata: dict[str, Any], arrays: dict[str, NDArray[Any]]) -> Self:
        x1, v1, x2, v2 = map(float, metadata["initial"])
        core = _core.Run.from_parts(metadata["core"], **arrays)
        return cls(core, System.from_dict(metadata["system"]), (x1, v1, x2, v2))

    def __eq__(self, other: object) -> bool:
        """Whether both are one motion, kept alike: the same numbers to the last bit."""
        if not isinstance(other, Run):
            return NotImplemented
        (ours, arrays), (theirs, others) = self._parts(), other._parts()
        return ours == theirs and all(
            array.tobytes() == others[name].tobytes() for name, array in arrays.items()
        )

    def __hash__(self) -> int:
        """Return a hash that equal runs share."""
        return hash((self._system, self._initial, self.impact_count))

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickle through the parts that ``save`` writes."""
        return type(self)._from_parts, self._parts()

    def __repr__(self) -> str:
        """Say how the run ended and what it holds, without computing its label."""
        end = self.final_state
        return (
            f"<Run {self.stop_reason} at time {end.time:.6g} (period {end.period}), "
            f"{impacts_in_words(self, ' impacts')}>"
        )


def raise_if_interrupted(run: Run) -> None:
    """Raise Interrupted, carrying the run, if Ctrl-C cut it short."""
    if run._core.interrupted:
        time = run.final_state.time
        raise Interrupted(f"interrupted at time {time:.6g}", run, holds="the run so far")

"""What a simulation of a structure returns: a run with its impacts, sections, events.

Field names and meanings are those of the notation page; units are those of the structure. The
numbers live in the compiled core; a StructureRun returns them as read-only arrays, built when first
used.
"""

from __future__ import annotations

import json
import os
from functools import cached_property
from typing import TYPE_CHECKING, Any, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _core
from .arguments import count, flag, horizon, not_negative, optional_count, reject, times_of
from .errors import Interrupted, SimulationError
from .interruption import interruptible
from .period_report import PeriodReport, as_period_report
from .run_parts import read_only
from .showing import Facts, Shown
from .structure import Structure
from .structure_run_parts import TABLES, StructureState, arrays_of, check_arrays, core_of
from .tables import Table, of_columns
from .verbs import verb

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from .bounces import Bounces
    from .structure_motion import StructureOrbit
    from .verb_types import NotFound

Array = NDArray[np.float64]
# Columns in coordinates of the compiled structure.
_WIDE = ("q", "v", "v_pre", "v_post")


@interruptible
class StructureRun(Shown):
    """One simulated motion of a structure, as ``simulate`` returns it.

    Examples
    --------
    A mass on a spring, driven, with a stop:

    >>> import vibroimpact as vi
    >>> structure = vi.Structure([[1]], [[1]], [vi.Stop([1], 0.3, 0.8)],
    ...                          drive_amplitude=[1], drive_frequency=2.0)
    >>> run = vi.simulate(structure, initial=[[0], [0]], periods=10)
    >>> run.impacts["stop"].tolist()[:2], run.stroboscopic.shape
    ([0, 0], (10, 2, 1))
    """

    def __init__(self, core: _core.StructureRun, system: Structure, initial: Array) -> None:
        self._core = core
        self._system = system
        self._initial = read_only(np.array(initial))

    @property
    def system(self) -> Structure:
        """The structure that was simulated."""
        return self._system

    @property
    def initial(self) -> Array:
        """The state (2, N) at t = 0: rows q and v."""
        return self._initial

    @cached_property
    def impacts(self) -> Table:
        """Kept impacts: structured array, one row each.

        Columns ``time, period, time_in_period, stop, q (N,), v_pre (N,), v_post (N,),
        approach_velocity, phase, regime, impulse_normal, impulse_tangential, energy_loss``.
        ``stop`` is the number of the stop, ``regime`` a Regime; the impulses act against its normal
        and along its tangent. Impacts that complete chatter skipped are not listed here:
        ``bounces`` lists them too.
        """
        return self._table(self._core.impacts)

    @cached_property
    def grazes(self) -> Table:
        """Kept grazes (contact without impulse): structured array.

        Columns ``time, period, time_in_period, stop, q (N,), v (N,), phase, gap_acceleration``.
        """
        return self._table(self._core.grazes)

    @cached_property
    def contacts(self) -> Table:
        """Kept events of lasting contact: structured array, one row each.

        Columns ``time, period, time_in_period, kind, stop, closed (stops,), q (N,), v (N,), phase,
        normal_force, tangential_force, impacts_skipped, time_jump, error``. ``kind`` is an
        EventKind: CHATTER (infinitely many impacts end here), CLOSED, SLIDE_POSITIVE,
        SLIDE_NEGATIVE or STICK (``stop`` closes, or goes on so) or RELEASE (it opens). ``closed``
        tells all stops that are closed just after it; the forces are those at ``stop``. The last
        three columns are as those of a Run.
        """
        return self._table(self._core.contacts)

    @cached_property
    def events(self) -> Table:
        """Kept events: structured array ``time, period, kind, index, stop``.

        ``kind`` is an EventKind, ``index`` the row of ``impacts``, ``grazes`` or ``contacts``, -1
        for the end of the run, as is ``stop`` there.
        """
        return self._table(self._core.events)

    @cached_property
    def stroboscopic(self) -> Array:
        """Kept stroboscopic states, (k, 2, N): rows q and v; k = 0 without a drive period."""
        return read_only(self._system._from_core(self._core.stroboscopic))

    @property
    def time_in_contact(self) -> float:
        """Time in which a stop is closed within the kept window; impacts take no time."""
        return self._core.time_in_contact

    @cached_property
    def final_state(self) -> StructureState:
        """The state at the end."""
        end = self._core.final_state
        q, v = (read_only(self._system._from_core(end[name])) for name in ("q", "v"))
        return StructureState(**{**end, "q": q, "v": v, "closed": read_only(end["closed"])})

    @property
    def stop_reason(self) -> str:
        """Why the run ended: ``"completed"``, or what stopped it earlier; see the notation page."""
        return self._core.stop_reason

    @property
    def stop_detail(self) -> str:
        """A sentence with time and impact number for a run that did not complete."""
        return self._core.stop_detail

    @property
    def kept_from(self) -> float:
        """The time at which the kept window starts."""
        return self._core.kept_from

    @property
    def impact_count(self) -> int:
        """Number of impacts since t = 0, on all stops, kept or not."""
        return self._core.impact_count

    @cached_property
    def period(self) -> PeriodReport:
        """The period m-n with its evidence; may follow the motion further where it converges.

        Impacts on all stops count in n. A motion that does not return is ``unresolved``.

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
        """The label of the motion: ``"1-1"``, ``"2-inf"`` (chatter) or ``"unresolved"``."""
        return self.period.label

    def trajectory(self, t: ArrayLike, *, forces: bool = False) -> Any:
        """Return the states at times ``t``, with ``forces`` the contact forces too.

        At the instant of an event this is the state after it.

        Parameters
        ----------
        t
            Times inside the kept window, in any order, shape (k,); or one time.
        forces
            Return the forces in the stops as well.

        Returns
        -------
        array, shape (k, 2, N), rows q and v; (2, N) for one time
            With ``forces`` a pair: this, and the forces (k, stops, 2), against the normal and along
            the tangent of each stop, 0 where it is open. Impulses of impacts are not forces.

        Raises
        ------
        ParameterError
            If a time lies outside the kept window, from ``kept_from`` to ``final_state.time``.
        Interrupted
            After Ctrl-C; ``.result`` holds the rows of the first times.

        Examples
        --------
        >>> run.trajectory([0.0, 1.0]).shape
        (2, 2, 1)
        """
        times, single = times_of("t", t)
        forces = flag("forces", forces)
        first, last = self.kept_from, self.final_state.time
        outside = np.flatnonzero((times < first) | (times > last))
        if len(outside):
            place = int(outside[0])
            window = f"times in the kept window, {first!r} to {last!r}"
            reject("t" if single else f"t[{place}]", float(times[place]), window)
        rows, acting, interrupted = self._core.trajectory(times)
        rows = self._system._from_core(rows)
        result: Any = (rows, acting) if forces else rows
        if interrupted:
            known = f"the rows of the first {len(rows)} times"
            raise Interrupted("interrupted", result, holds=known)
        if single:
            return (rows[0], acting[0]) if forces else rows[0]
        return result

    def bounces(self, *, down_to: float = 0.0, most: int = 1_000_000) -> Bounces:
        """List all impacts of the kept window, those that complete chatter skipped included.

        Parameters
        ----------
        down_to
            The list of a chatter ends before the first skipped impact whose approach velocity is
            below this, >= 0.
        most
            Cap on the number of skipped impacts, of all chatters together.

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
        >>> len(run.bounces().impacts) == len(run.impacts)
        True
        """
        slowest = not_negative("down_to", down_to)
        most = count("most", most, least=0)
        from .bounces import as_bounces  # here, to keep the import of the package light

        rows, skipped, ends, interrupted = self._core.bounces(slowest, most)
        bounces = as_bounces(self._table(rows), skipped, ends)
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
    ) -> StructureRun:
        """Continue for further periods or time; all bits are those of one long run.

        Parameters
        ----------
        periods
            How many drive periods further; or else ``time``.
        time
            How much further in time; or else ``periods``.
        keep
            Keep only the last so many periods.
        max_events
            Cap on the number of events since t = 0; default the cap of this run.

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
        >>> run.resume(periods=5).final_state.period
        15
        """
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
        if core.interrupted:
            message = f"interrupted at time {run.final_state.time:.6g}"
            raise Interrupted(message, run, holds="the run so far")
        return run

    def plot(self, **options: Any) -> Axes:
        """Draw coordinates against time, by ``vi.plot.time_history``.

        Parameters
        ----------
        **options
            As in ``vi.plot.time_history``: ``coordinates=(0, 1)``, ``periods``, ``window`` ...
            Without a drive period all that is kept is drawn, unless ``window`` says otherwise.

        Returns
        -------
        matplotlib.axes.Axes

        Examples
        --------
        >>> run.plot(periods=4).get_ylabel()
        '$q_{0}$'
        """
        axes: Axes = verb("draw")(self, **options)
        return axes

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the run to ``path`` (.npz, no pickle); ``load`` gives it back bit for bit.

        Examples
        --------
        >>> run.save("structure_run.npz")
        >>> vi.load("structure_run.npz") == run
        True
        """
        from . import archive  # here, to keep the import of the package light

        metadata, arrays = self._parts()
        archive.write(path, "structure_run", metadata, arrays)

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> Self:
        """Read a run written by ``save``.

        Raises
        ------
        ValueError
            If the file is damaged, foreign, or holds something else.

        Examples
        --------
        >>> run.save("structure_run.npz")
        >>> vi.StructureRun.load("structure_run.npz").final_state.period
        10
        """
        from . import archive  # here, to keep the import of the package light

        return archive.read(path, {"structure_run": cls._from_parts})

    def _parts(self) -> tuple[dict[str, Any], dict[str, NDArray[Any]]]:
        metadata: dict[str, Any] = {
            "system": json.loads(self._system.to_json()),
            "core": self._core.to_json(),
        }
        physical: dict[str, NDArray[Any]] = {
            "initial": self._initial,
            "stroboscopic": self.stroboscopic,
            **{name: getattr(self, name).view(np.ndarray) for name in TABLES},
        }
        return metadata, arrays_of(self._core, physical, self._system._basis is not None)

    @classmethod
    def _from_parts(cls, metadata: dict[str, Any], arrays: dict[str, NDArray[Any]]) -> Self:
        structure = Structure.from_json(json.dumps(metadata["system"]))
        # A run of no length from the same start has tables of the same columns.
        initial = arrays["initial"]
        cores, *_ = _core.simulate_structure(
            structure._compiled, structure._to_core(initial), time=0.0
        )
        _, like = cls(cores[0], structure, initial)._parts()
        check_arrays(arrays, like)
        modal = structure._basis is not None
        return cls(
            core_of(structure._compiled, metadata["core"], arrays, modal), structure, initial
        )

    def refine(self) -> StructureOrbit | NotFound:
        """Find the periodic motion that this run has settled on, to rounding, with its multipliers.

        Newton's method with the exact derivative of the motion starts from the end of the run,
        which must be the end of a drive period, as that of a run over ``periods`` is.

        Returns
        -------
        StructureOrbit or NotFound
            The motion; or, counting as False, why there is none.

        Raises
        ------
        ParameterError
            With ``drive_frequency = 0``: there is no period.
        Interrupted
            After Ctrl-C; ``.result`` is this run.

        Examples
        --------
        >>> settled = vi.simulate(structure.replace(gap=0.3, damping_ratios=[0.05]),
        ...                       initial=[[0], [0]], periods=200, keep=50)
        >>> settled.refine()
        <StructureOrbit 1-1, stable>
        """
        found: StructureOrbit | NotFound = verb("refine_structure")(self)
        return found

    def _table(self, columns: dict[str, NDArray[Any]]) -> Table:
        wide = {name: self._system._from_core(columns[name]) for name in _WIDE if name in columns}
        return of_columns(columns | wide)

    def _facts(self) -> Facts:
        end = self.final_state
        return {
            "motion": f"{self.label} ({self.period.evidence})",
            "stop": self.stop_reason,
            "end": f"time {end.time:.6g}, {end.mode.replace('_', ' ')}",
            "drive periods": end.period,
            "impacts": f"{self.impact_count}, of which {len(self.impacts)} are kept",
            "kept": f"time {self.kept_from:.6g} to {end.time:.6g}",
            "time in contact": f"{self.time_in_contact:.6g}",
        }

    def __eq__(self, other: object) -> bool:
        """Whether both are one motion, kept alike: the same numbers to the last bit."""
        if not isinstance(other, StructureRun):
            return NotImplemented
        (ours, arrays), (theirs, others) = self._parts(), other._parts()
        return ours == theirs and all(
            array.tobytes() == others[name].tobytes() for name, array in arrays.items()
        )

    def __hash__(self) -> int:
        """Return a hash that equal runs share."""
        return hash((self._system, self._initial.tobytes(), self.impact_count))

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickle through the parts that ``save`` writes."""
        return type(self)._from_parts, self._parts()

    def __repr__(self) -> str:
        """Say how the run ended and what it holds."""
        end = self.final_state
        return (
            f"<StructureRun {self.stop_reason} at time {end.time:.6g} (period {end.period}), "
            f"{self.impact_count} impacts, {len(self.impacts)} kept>"
        )

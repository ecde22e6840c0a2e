"""What a simulation returns: a run with its impacts, sections, events and label.

Field names and meanings are those of docs/notation.md; all quantities are dimensionless. The
numbers live in the compiled core; a Run returns them as read-only arrays, built when first used.
"""

from __future__ import annotations

import dataclasses
import math
import os
from dataclasses import dataclass, field
from enum import IntEnum
from functools import cached_property
from typing import TYPE_CHECKING, Any, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _core
from ._core import EvidenceKind, WhyUndecided
from .arguments import flag, horizon, optional_count, reject, vector
from .errors import Interrupted, SimulationError
from .interruption import interruptible
from .run_parts import EnergyAudit as EnergyAudit
from .run_parts import FinalState as FinalState
from .run_parts import read_only as read_only
from .system import System
from .verbs import verb

if TYPE_CHECKING:
    from .verb_types import NotFound, PeriodicMotion, RunInSI


class EventKind(IntEnum):
    """The kinds of events of a run, as in the column ``kind`` of ``run.events``."""

    IMPACT = 0
    GRAZE = 1
    CHATTER = 2
    SLIDE_POSITIVE = 3
    SLIDE_NEGATIVE = 4
    STICK = 5
    RELEASE = 6
    STOP = 7


@interruptible
@dataclass(frozen=True, kw_only=True)
class Evidence:
    """The evidence for the label of a motion, with its numbers.

    Attributes
    ----------
    kind
        ``returned``: the sections return to within rounding. ``converging``: they approach each
        other geometrically. ``growth_bounded``, ``growth_exponential``: no return, and a small
        perturbation grows no faster than a shear, or exponentially. ``undecided``: none of these.
    further
        Of ``returned`` and ``converging``: drive periods by which the motion was followed beyond
        the run to see it; 0 in the run itself.
    rate
        Of ``converging``: the factor by which the sections' extent shrinks per drive period.
    growth, growth_error, growth_periods
        Where it was measured, and the motion does not repeat: the mean logarithmic growth of a
        small perturbation per drive period, its standard error, and the periods it is taken over.
    why
        Of ``undecided``: why.
    text
        The evidence in words, for people.
    """

    kind: EvidenceKind
    further: int = 0
    rate: float | None = None
    growth: float | None = None
    growth_error: float | None = None
    growth_periods: int | None = None
    why: WhyUndecided | None = None
    text: str = field(default="", compare=False)

    def __str__(self) -> str:
        """Say it in words."""
        return self.text or str(self.kind)


@dataclass(frozen=True, kw_only=True)
class PeriodReport:
    """The period m-n of a motion, with the evidence for it.

    Attributes
    ----------
    m, n
        Drive periods and impacts per orbit; None where no period was found. n is ``math.inf`` for
        a motion with complete chatter, infinitely many impacts in a finite time.
    residual
        Largest difference between sections m periods apart: of the kept ones; of those of later
        periods where ``evidence.further`` is not 0.
    evidence
        The evidence for the label.
    label
        ``"3-4"``, ``"1-0"``, ``"2-inf"``, ``"quasi-periodic"``, ``"chaotic"`` or
        ``"unresolved"``.
    """

    m: int | None
    n: int | float | None
    residual: float
    evidence: Evidence
    label: str


@interruptible
class Run:
    """One simulated motion, as ``simulate``, ``Run.resume`` and ``load`` return it."""

    def __init__(
        self, core: _core.Run, system: System, initial: tuple[float, float, float, float]
    ) -> None:
        self._core = core
        self._system = system
        self._initial = initial

    @property
    def system(self) -> System:
        """The system that was simulated."""
        return self._system

    @property
    def initial(self) -> tuple[float, float, float, float]:
        """The state (x1, v1, x2, v2) at t = 0."""
        return self._initial

    @cached_property
    def impacts(self) -> NDArray[np.void]:
        """Kept impacts: structured array, one row each.

        Columns ``time, period, time_in_period, x1, v1_pre, v1_post, x2, v2_pre, v2_post, phase,
        regime, impulse_normal, impulse_tangential, energy_loss``. Impulses are in units
        M1 l omega_2, energies in M1 l^2 omega_2^2; ``regime`` is a Regime.
        """
        return read_only(self._core.impacts)

    @cached_property
    def stroboscopic(self) -> NDArray[np.float64]:
        """Kept stroboscopic states x1, v1, x2, v2, shape (k, 4); (0, 4) without a drive period."""
        return read_only(self._core.stroboscopic)

    @cached_property
    def events(self) -> NDArray[np.void]:
        """Kept events: structured array ``time, period, kind, index``.

        ``kind`` is an EventKind, ``index`` the row of ``impacts``, ``grazes`` or ``contacts``, -1
        for the stop.
        """
        return read_only(self._core.events)

    @cached_property
    def grazes(self) -> NDArray[np.void]:
        """Kept grazes (contact without impulse): structured array."""
        return read_only(self._core.grazes)

    @cached_property
    def contacts(self) -> NDArray[np.void]:
        """Kept events of sustained contact: structured array, one row each.

        Columns ``time, period, time_in_period, kind, x1, v1, x2, v2, phase, normal_force,
        tangential_force, impacts_skipped, time_jump, error``. ``kind`` is an EventKind: CHATTER
        (infinitely many impacts end here), SLIDE_POSITIVE, SLIDE_NEGATIVE or STICK (contact begins,
        or goes on in this mode) or RELEASE (flight again). State and forces are those just after
        the event; forces are in units M1 l omega_2^2, the tangential one acts on the tip.

        The last three columns are 0 except in rows of CHATTER. ``impacts_skipped`` is the number of
        impacts left out until the remaining time is below the rounding of ``time_in_period``;
        ``time_jump`` is the time from the last impact to the accumulation point; ``error`` is an
        absolute bound on the error of time and state there, without the rounding of ``time`` to one
        number. Source: docs/theory.md, section 5.
        """
        return read_only(self._core.contacts)

    @property
    def time_in_contact(self) -> float:
        """Time in sustained contact within the kept window; impacts take no time."""
        return self._core.time_in_contact

    @cached_property
    def final_state(self) -> FinalState:
        """The state at the end."""
        return FinalState(**_attributes(FinalState, self._core.final_state))

    @property
    def stop_reason(self) -> str:
        """Why the run ended: ``"completed"``, or what stopped it earlier; docs/notation.md.

        ``"rest"`` is no early stop: both bodies rest in contact, nothing will ever move them, and
        the run is carried to the end asked for.
        """
        return self._core.stop_reason

    @property
    def stop_detail(self) -> str:
        """A sentence with time, impact number and state for a run that did not complete."""
        return self._core.stop_detail

    @property
    def kept_from(self) -> float:
        """The time at which the kept window starts."""
        return self._core.kept_from

    @property
    def impact_count(self) -> int:
        """Number of impacts since t = 0, kept or not."""
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
        n = core.n
        return PeriodReport(
            m=core.m,
            n=int(n) if n is not None and math.isfinite(n) else n,
            residual=core.residual,
            evidence=Evidence(**_attributes(Evidence, core)),
            label=core.label,
        )

    @property
    def label(self) -> str:
        """The label of the motion: ``"1-1"``, ``"2-inf"`` (chatter), ``"chaotic"`` ..."""
        return self.period.label

    def trajectory(self, t: ArrayLike, *, forces: bool = False) -> NDArray[np.float64]:
        """Return the states x1, v1, x2, v2 at times ``t``, with ``forces`` the contact forces too.

        At the instant of an event this is the state after it. Within a complete chatter the states
        between the skipped impacts are computed as asked for.

        Parameters
        ----------
        t
            Times inside the kept window, in any order, shape (k,).
        forces
            Add two columns: normal force p >= 0 and tangential force on the tip, in units
            M1 l omega_2^2, zero in flight (docs/theory.md, section 5). The impulses of impacts are
            not forces: they are columns of ``impacts``.

        Returns
        -------
        array, shape (k, 4), or (k, 6) with ``forces``

        Raises
        ------
        ParameterError
            If a time lies outside the kept window, from ``kept_from`` to ``final_state.time``.
        Interrupted
            After Ctrl-C; ``.result`` holds the rows of the first times.
        """
        times = vector("t", t)
        forces = flag("forces", forces)
        first, last = self.kept_from, self.final_state.time
        outside = np.flatnonzero((times < first) | (times > last))
        if len(outside):
            place = int(outside[0])
            window = f"times in the kept window, {first!r} to {last!r}"
            reject(f"t[{place}]", float(times[place]), window)
        rows, interrupted = self._core.trajectory(times, forces)
        if interrupted:
            known = f"the rows of the first {len(rows)} times"
            raise Interrupted("interrupted", rows, holds=known)
        return rows

    def energy_audit(self) -> EnergyAudit:
        """Add up the works of all forces in the kept window and compare with the energies.

        Raises
        ------
        Interrupted
            After Ctrl-C; ``.result`` is this run.
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
    ) -> Run:
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
        SimulationError
            If a number left the range of floats; ``.result`` is the run up to there.
        Interrupted
            After Ctrl-C; ``.result`` is the run up to there.
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
        """
        motion: PeriodicMotion | NotFound = verb("refine")(self)
        return motion

    def in_si(self) -> RunInSI:
        """Return the run in SI, by the scales of its system; attributes have the same names.

        Raises
        ------
        ParameterError
            If the system has no scales; those from ``System.from_physical`` have.
        """
        found: RunInSI = verb("in_si")(self)
        return found

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the run to ``path`` (.npz, no pickle); ``load`` gives it back bit for bit."""
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
            "impacts": self.impacts,
            "stroboscopic": self.stroboscopic,
            "events": self.events,
            "grazes": self.grazes,
            "contacts": self.contacts,
        }
        return metadata, arrays

    @classmethod
    def _from_parts(cls, metadata: dict[str, Any], arrays: dict[str, NDArray[Any]]) -> Self:
        x1, v1, x2, v2 = map(float, metadata["initial"])
        core = _core.Run.from_parts(metadata["core"], **arrays)
        return cls(core, System.from_dict(metadata["system"]), (x1, v1, x2, v2))

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickle through the parts that ``save`` writes."""
        return type(self)._from_parts, self._parts()

    def __repr__(self) -> str:
        """Say how the run ended and what it holds, without computing its label."""
        end = self.final_state
        return (
            f"<Run {self.stop_reason} at time {end.time:.6g} (period {end.period}), "
            f"{self.impact_count} impacts, {len(self.impacts)} kept>"
        )


def raise_if_interrupted(run: Run) -> None:
    """Raise Interrupted, carrying the run, if Ctrl-C cut it short."""
    if run._core.interrupted:
        time = run.final_state.time
        raise Interrupted(f"interrupted at time {time:.6g}", run, holds="the run so far")


def _attributes(cls: type[FinalState | Evidence], source: object) -> dict[str, Any]:
    return {field.name: getattr(source, field.name) for field in dataclasses.fields(cls)}

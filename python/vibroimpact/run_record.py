"""The record of a run: its impacts, sections and events, how it ended, and what motion it is."""

from __future__ import annotations

import dataclasses
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from . import _core
from .errors import Interrupted
from .interruption import interruptible
from .period_report import PeriodReport, as_period_report
from .run_parts import FinalState, read_only
from .showing import Facts, Shown
from .system import System
from .tables import EventKind, Table, table, with_column

if TYPE_CHECKING:
    import pandas


@interruptible
class RunRecord(Shown):
    """What a `Run` holds: all that can be read from it without going on or drawing."""

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
    def impacts(self) -> Table:
        """Kept impacts: structured array, one row each.

        Columns ``time, period, time_in_period, x1, v1_pre, v1_post, x2, v2_pre, v2_post,
        approach_velocity, phase, regime, impulse_normal, impulse_tangential, energy_loss``.
        Impulses are in units M1 l omega_2, energies in M1 l^2 omega_2^2; ``regime`` is a Regime.
        Impacts that complete chatter skipped are not listed here: ``bounces`` lists them too.
        ``impacts.to_pandas()`` gives a data frame.
        """
        return self._with_approach(self._core.impacts)

    def _with_approach(self, rows: NDArray[np.void]) -> Table:
        """Return impacts of the core with their approach velocity."""
        before = np.column_stack([rows[name] for name in ("x1", "v1_pre", "x2", "v2_pre")])
        velocity = np.asarray(self._system.gap_rate(before))
        return with_column(rows, "approach_velocity", velocity, after="v2_post")

    @cached_property
    def stroboscopic(self) -> NDArray[np.float64]:
        """Kept stroboscopic states x1, v1, x2, v2, shape (k, 4); (0, 4) without a drive period."""
        return read_only(self._core.stroboscopic)

    @cached_property
    def events(self) -> Table:
        """Kept events: structured array ``time, period, kind, index``.

        ``kind`` is an EventKind, ``index`` the row of ``impacts``, ``grazes`` or ``contacts``, -1
        for the stop.
        """
        return table(self._core.events)

    @cached_property
    def grazes(self) -> Table:
        """Kept grazes (contact without impulse): structured array."""
        return table(self._core.grazes)

    @cached_property
    def contacts(self) -> Table:
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
        number. Source: theory page, section 5.
        """
        return table(self._core.contacts)

    @property
    def time_in_contact(self) -> float:
        """Time in sustained contact within the kept window; impacts take no time."""
        return self._core.time_in_contact

    @cached_property
    def final_state(self) -> FinalState:
        """The state at the end."""
        return FinalState(**_attributes(self._core.final_state))

    @property
    def stop_reason(self) -> str:
        """Why the run ended: ``"completed"``, or what stopped it earlier; see the notation page.

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
        """Number of impacts since t = 0, kept or not.

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
        """The label of the motion: ``"1-1"``, ``"2-inf"`` (chatter), ``"chaotic"`` ..."""
        return self.period.label

    def summary(self) -> str:
        """Return in some lines how the run ended, what motion it is, and what it holds.

        Examples
        --------
        >>> import vibroimpact as vi
        >>> system = vi.System(mass_ratio=0.6, frequency_ratio=2.0, restitution=0.8, gap=0.5,
        ...                    drive_frequency=1.8, moment_amplitude=1.0)
        >>> run = vi.simulate(system, initial=(0, 0.5, 0, 0), periods=600, keep=100)
        >>> print(run.summary().splitlines()[5])
        impacts          600, of which 100 are kept
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
        >>> import vibroimpact as vi
        >>> system = vi.System(mass_ratio=0.6, frequency_ratio=2.0, restitution=0.8, gap=0.5,
        ...                    drive_frequency=1.8, moment_amplitude=1.0)
        >>> run = vi.simulate(system, initial=(0, 0.5, 0, 0), periods=600, keep=100)
        >>> run.to_pandas()["regime"].unique().tolist()
        ['frictionless']
        """
        return self.impacts.to_pandas()

    def _facts(self) -> Facts:
        end = self.final_state
        regimes, numbers = np.unique(self.impacts["regime"], return_counts=True)
        names = [_core.Regime(int(regime)).name.lower() for regime in regimes]
        counted = [f"{number} {name}" for name, number in zip(names, numbers, strict=True)]
        return {
            "motion": f"{self.label} ({self.period.evidence})",
            "stop": self.stop_reason
            if self.stop_reason in ("completed", "rest")
            else f"{self.stop_reason}: {self.stop_detail}",
            "start": _numbers(self._initial),
            "end": f"{_numbers(end.state)} at time {end.time:.6g}, {end.mode.replace('_', ' ')}",
            "drive periods": end.period,
            "impacts": f"{self.impact_count}, of which {len(self.impacts)} are kept",
            "regimes": ", ".join(counted) or "none",
            "kept": f"time {self.kept_from:.6g} to {end.time:.6g}",
            "time in contact": f"{self.time_in_contact:.6g}",
        }


def impacts_in_words(run: RunRecord, unit: str = "") -> str:
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


def _numbers(state: tuple[float, ...]) -> str:
    return f"({', '.join(f'{value:.6g}' for value in state)})"


def _attributes(source: object) -> dict[str, Any]:
    return {field.name: getattr(source, field.name) for field in dataclasses.fields(FinalState)}

"""What a simulation returns: a run with its impacts, sections, events and label.

Field names and meanings are those of the notation page; all quantities are dimensionless. The
numbers live in the compiled core; a Run returns them as read-only arrays, built when first used.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from functools import cached_property
from typing import TYPE_CHECKING, Any, Never, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _core
from .archived import Parts
from .arguments import reject
from .errors import SimulationError
from .interruption import interruptible
from .period_report import Evidence as Evidence
from .period_report import PeriodReport as PeriodReport
from .run_parts import EnergyAudit as EnergyAudit
from .run_parts import FinalState as FinalState
from .run_parts import Slopes, clock_rates, impulses_on_wall, refuse_units
from .run_parts import read_only as read_only
from .run_record import RunRecord
from .run_trace import Trace
from .showing import Facts
from .system import System
from .tables import EventKind as EventKind
from .tables import Table, table, with_column
from .verbs import verb

if TYPE_CHECKING:
    from .verb_types import NotFound, PeriodicMotion, RunInSI, Sensitivity

# The tables of events, as the core has them.
_EVENTS = ("events", "grazes", "contacts")
# The column of impacts that the core does not have.
_ADDED = "approach_velocity"


@interruptible
class Run(RunRecord[System, _core.Run, tuple[float, float, float, float]]):
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

    _KIND = "run"

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
        return self._impacts(self._core.impacts)

    def _columns(self) -> dict[str, tuple[str, ...]]:
        return {"impacts": (*(_core.IMPACT_DTYPE.names or ()), _ADDED)}

    def _impacts(self, rows: NDArray[np.void]) -> Table:
        """Return impacts of the core with their approach velocity."""
        before = np.column_stack([rows[name] for name in ("x1", "v1_pre", "x2", "v2_pre")])
        velocity = np.asarray(self._system.gap_rate(before))
        return with_column(rows, _ADDED, velocity, after="v2_post")

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

    @cached_property
    def final_state(self) -> FinalState:
        """The state at the end."""
        return FinalState(**{name: getattr(self._core.final_state, name) for name in _OF_END})

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
        rows: NDArray[np.float64] = self._at(t, forces)[0]
        return rows

    def _pressed(self, times: NDArray[np.float64]) -> NDArray[np.bool_]:
        return np.asarray(self.trajectory(times, forces=True)[:, 4] > 0.0)

    def _states(self, times: NDArray[np.float64], forces: bool) -> tuple[list[Any], bool]:
        rows, interrupted = self._core.trajectory(times, forces)
        return [rows], interrupted

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
        return EnergyAudit(**self._works())

    def sensitivity(self, *names: str, **directions: Never) -> Sensitivity:
        """Differentiate the run by parameters and its start, exactly, through impacts and contact.

        Derivatives that ``simulate(..., sensitivity=...)`` was asked for are there. For others the
        motion is followed once more, along its events where the run has kept all; with ``keep=`` it
        is simulated again, which costs more than the run. At the instant of an impact
        derivatives jump as the motion does, and the instant itself moves. Where the motion lies on
        a border (a graze, a border of regimes, the onset of chatter) they are those of the side
        that has the run's events; ``one_sided`` of the result lists such events. ``final_state`` of
        the result is at a fixed time, also by ``drive_frequency``; in ``gradient`` the end of a run
        over ``periods`` moves.

        Parameters
        ----------
        *names
            Numeric parameters of the system (``"restitution"``, ``"gap"``, ...), and components of
            the start: ``"x1"``, ``"v1"``, ``"x2"``, ``"v2"``; each once.
        **directions
            None: runs of a Structure alone are differentiated along directions.

        Raises
        ------
        ParameterError
            For an unknown name, one given twice, none, a direction, or ``"friction"`` of direct
            contact.
        TypeError
            For ``units``: derivatives are dimensionless.
        SimulationError
            If a leg of the motion has no derivatives that can be computed, or they grow beyond
            1e308, as in a long chaotic motion; ``.result`` is this run.
        Interrupted
            After Ctrl-C; ``.result`` has the derivatives up to its ``until``.

        Examples
        --------
        >>> found = run.sensitivity("restitution", "gap", "v1")
        >>> found.impacts.time.shape == (len(run.impacts), 3)
        True
        """
        core: Any = self._made_with and self._made_with.by(names, directions)
        if core is None:
            by = self._by(self.system, names, directions)
            try:
                core = _core.sensitivity(self._core, self._initial, [name for name, _ in by])
            except SimulationError as error:
                error.result = self
                raise
        found: Sensitivity = verb("sensitivity")(core, self, names)
        return found

    @classmethod
    def _by(cls, system: System, names: tuple[Any, ...], along: Mapping[str, Any]) -> Any:
        more = f"any other number by vibroimpact.gradient, with {system._by_function}"
        refuse_units(
            along,
            "derivatives are dimensionless; in SI they are these times the unit of what is "
            "differentiated, over that of the number, both of run.system.scales",
        )
        for name, direction in along.items():
            allowed = 'names alone, such as "gap": directions by keyword are for a Structure only'
            reject(name, direction, f"{allowed}; {more}")
        for name in names:
            if not isinstance(name, str):
                reject("names", name, 'names, each an argument of its own: "gap", "v1"')
            if name not in (known := system._names):
                reject("names", name, f"{system._names_in_words}; {more}", known=known)
        return [(name, None) for name in names]

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

    def _beside_impacts(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        rows = self.impacts
        before, after = (
            np.column_stack([rows[name] for name in ("x1", f"v1_{side}", "x2", f"v2_{side}")])
            for side in ("pre", "post")
        )
        return before, after

    def _impact_rates(self, found: Any, slopes: Slopes) -> dict[str, NDArray[np.float64]]:
        rows, system, (time, before, after) = self.impacts, self.system, found
        rates = clock_rates(rows, system.drive_frequency, time, slopes)
        for place, name in enumerate(("x1", "v1_pre", "x2", "v2_pre")):
            rates[name] = before[:, place]
        rates |= {"v1_post": after[:, 1], "v2_post": after[:, 3]}
        x1, v1 = (np.asarray(rows[name])[:, None] for name in ("x1", "v1_pre"))
        slope = system.slope(x1)
        curving = (-system.tip(x1) if system.contact == "oblique" else 0.0) * rates["x1"]
        rates["approach_velocity"] = curving * v1 + slope * rates["v1_pre"] - rates["v2_pre"]
        ratio, moved = system.mass_ratio, slopes("mass_ratio")
        # Momentum of both bodies: v2+ - v2- = mbar P, v1+ - v1- = sin(x1) Q - slope P.
        p, q = (np.asarray(rows[f"impulse_{way}"])[:, None] for way in ("normal", "tangential"))
        pushed: NDArray[np.float64] | None
        if ratio > 0.0:
            pushed = (rates["v2_post"] - rates["v2_pre"] - p * moved) / ratio
        else:
            pushed = impulses_on_wall(system, rows, rates, slopes)
        lost = np.zeros_like(time)
        for side, sign in (("pre", 1.0), ("post", -1.0)):
            v1, v2 = (np.asarray(rows[f"{name}_{side}"])[:, None] for name in ("v1", "v2"))
            lost += sign * v1 * rates[f"v1_{side}"]
            if ratio > 0.0:
                lost += sign * (v2 * rates[f"v2_{side}"] / ratio - v2**2 * moved / (2.0 * ratio**2))
        # A wall has no energy, but does work when it moves, or begins to do so.
        if ratio == 0.0 and (v2.any() or moved.any()):
            if pushed is None:
                return rates
            lost -= v2 * pushed + 0.5 * (rates["v2_pre"] + rates["v2_post"]) * p
        rates["energy_loss"] = lost
        if pushed is None:
            return rates
        rates["impulse_normal"] = pushed
        if (system.friction == 0.0 and not slopes("friction").any()) or system.contact == "direct":
            rates["impulse_tangential"] = np.zeros_like(time)
        else:
            # Friction has no lever at x1 = 0, and jumps there.
            lever = np.where(system.tip(x1) == 0.0, np.nan, system.tip(x1))
            turned = slope * (pushed - q * rates["x1"])
            jumps = rates["v1_post"] - rates["v1_pre"]
            rates["impulse_tangential"] = (jumps + curving * p + turned) / lever
        return rates

    def _tables(self) -> Parts:
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
    def _from_tables(
        cls, metadata: dict[str, Any], arrays: dict[str, NDArray[Any]], trace: Trace | None
    ) -> Self:
        x1, v1, x2, v2 = map(float, metadata["initial"])
        core = _core.Run.from_parts(metadata["core"], **arrays, trace=trace)
        return cls(core, System.from_dict(metadata["system"]), (x1, v1, x2, v2))

    def _ends(self) -> Facts:
        end = self.final_state
        return {
            "start": _numbers(self._initial),
            "end": f"{_numbers(end.state)} at time {end.time:.6g}, {end.mode.replace('_', ' ')}",
        }


# What the core tells of the end.
_OF_END = tuple(field.name for field in dataclasses.fields(FinalState))


def _numbers(state: tuple[float, ...]) -> str:
    return f"({', '.join(f'{value:.6g}' for value in state)})"

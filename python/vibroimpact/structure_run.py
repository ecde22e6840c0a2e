"""What a simulation of a structure returns: a run with its impacts, sections, events.

Field names and meanings are those of the notation page; units are those of the structure. The
numbers live in the compiled core; a StructureRun returns them as read-only arrays, built when first
used.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from functools import cached_property
from typing import TYPE_CHECKING, Any, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _core
from .archived import Parts
from .errors import SimulationError
from .interruption import interruptible
from .run_parts import Slopes, read_only, refuse_units
from .run_record import RunRecord
from .run_trace import Trace
from .structure import Structure
from .structure_directions import directions as directions_of
from .structure_run_parts import (
    IMPACT_COLUMNS,
    TABLES,
    StructureEnergyAudit,
    StructureState,
    arrays_of,
    check_arrays,
    core_of,
    impact_rates,
    physical_sensitivity,
)
from .tables import Table, of_columns
from .verbs import verb

if TYPE_CHECKING:
    from .sensitivity import Sensitivity
    from .structure_motion import StructureOrbit
    from .verb_types import NotFound

Array = NDArray[np.float64]
# Columns in coordinates of the compiled structure.
_WIDE = ("q", "v", "v_pre", "v_post")


@interruptible
class StructureRun(RunRecord[Structure, _core.StructureRun, Array]):
    """One simulated motion of a structure, as ``simulate`` returns it.

    States are arrays (2, N), rows q and v; several of them, as ``stroboscopic`` and
    ``trajectory(t)``, are (k, 2, N): times, then q and v, then the N coordinates.

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

    _KIND = "structure_run"

    def __init__(self, core: _core.StructureRun, system: Structure, initial: Array) -> None:
        super().__init__(core, system, read_only(np.array(initial)))

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
        return self._impacts(self._core.impacts)

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
        """Kept stroboscopic states, shape (k, 2, N); k = 0 without a drive period.

        First axis: the kept drive periods, the earliest first, with the state at the end of each,
        or at ``section_phase``. Second: q and v. Third: the N coordinates, of a structure from
        modes its points. ``stroboscopic[:, 0, 1]`` is q_1 once per period, ``[:, 1, 1]`` its rate.
        """
        return read_only(self._system._from_core(self._core.stroboscopic))

    @cached_property
    def final_state(self) -> StructureState:
        """The state at the end."""
        end = self._core.final_state
        q, v = (read_only(self._system._from_core(end[name])) for name in ("q", "v"))
        return StructureState(**{**end, "q": q, "v": v, "closed": read_only(end["closed"])})

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
        arrays = self._at(t, forces)
        return tuple(arrays) if forces else arrays[0]

    def _pressed(self, times: Array) -> NDArray[np.bool_]:
        return np.asarray((self.trajectory(times, forces=True)[1][:, :, 0] > 0.0).any(axis=1))

    def _states(self, times: Array, forces: bool) -> tuple[list[Any], bool]:
        rows, acting, interrupted = self._core.trajectory(times)
        rows = self._system._from_core(rows)
        return [rows, acting] if forces else [rows], interrupted

    def _tables(self) -> Parts:
        metadata: dict[str, Any] = {
            "system": json.loads(self._system.to_json()),
            "core": self._core.to_json(),
        }
        physical: dict[str, NDArray[Any]] = {
            "initial": self._initial,
            "stroboscopic": self.stroboscopic,
            **{name: getattr(self, name).view(np.ndarray) for name in TABLES},
        }
        return metadata, arrays_of(self._core, physical, self._system._basis.is_modal)

    @classmethod
    def _from_tables(
        cls, metadata: dict[str, Any], arrays: dict[str, NDArray[Any]], trace: Trace | None
    ) -> Self:
        structure = Structure.from_json(json.dumps(metadata["system"]))
        # A run of no length from the same start has tables of the same columns.
        initial = arrays["initial"]
        (core,), *_ = _core.simulate(structure._compiled, structure._to_core(initial), time=0.0)
        _, like = structure._run(core, initial)._tables()
        check_arrays(arrays, like)
        modal = structure._basis.is_modal
        core = core_of(structure._compiled, metadata["core"], arrays, modal, trace)
        return cls(core, structure, initial)

    def energy_audit(self) -> StructureEnergyAudit:
        """Add up the works of all forces in the kept window and compare with the energies.

        Raises
        ------
        Interrupted
            After Ctrl-C; ``.result`` is this run.

        Examples
        --------
        >>> audit = run.energy_audit()
        >>> audit.impacts < 0 < audit.loads, abs(audit.residual) < 1e-12 * audit.total
        (True, True)
        """
        return StructureEnergyAudit(**self._works())

    def sensitivity(self, *names: str, **directions: Any) -> Sensitivity:
        """Differentiate the run by numbers of its structure and its start, exactly.

        The motion is followed once more, through impacts, chatter and closed stops, as
        ``Run.sensitivity`` follows that of a System. States have 2N rows, q and then v.

        Parameters
        ----------
        *names
            ``"drive_frequency"``, ``"phase"``; ``"gap"``, ``"restitution"``, ``"friction"`` of all
            stops, or of one of them, ``"gap_0"``; an entry of a matrix with its mirror image,
            ``"stiffness[0, 1]"``, also of ``mass`` and ``damping``; components of the start,
            ``"q_0"``, ``"v_0"``. Each once.
        **directions
            Numbers that the structure depends on, by names of your own: a mapping from fields of
            the structure to their derivatives, as ``k2={"stiffness": [[0, 0], [0, 1]]}``; or a pair
            of a function of the number that makes the structure, and the number. Damping ratios
            that are given stay as they are where mass or stiffness vary.

        Raises
        ------
        ParameterError
            For an unknown name or field, one given twice, none, or a number that the structure
            cannot be varied by, such as the friction of a stop without it.
        SimulationError
            If a leg of the motion has no derivatives that can be computed, or they grow beyond
            1e308, as in a long chaotic motion; ``.result`` is this run.
        Interrupted
            After Ctrl-C; ``.result`` has the derivatives up to its ``until``.

        Examples
        --------
        >>> found = run.sensitivity("gap", "v_0", spring={"stiffness": [[1.0]]})
        >>> found.names, found.final_state.shape
        (('gap', 'v_0', 'spring'), (2, 3))
        """
        core: Any = self._made_with and self._made_with.by(names, directions)
        if core is None:
            by = self._by(self._system, names, directions)
            start = self._system._to_core(self._initial)
            try:
                core = _core.structure_sensitivity(self._core, start, by)
            except SimulationError as error:
                error.result = self
                raise
        if self._system._basis.is_modal:
            core = physical_sensitivity(core, self._system._from_core)
        found: Sensitivity = verb("sensitivity")(core, self, names, directions)
        return found

    @classmethod
    def _by(cls, system: Structure, names: tuple[Any, ...], along: Mapping[str, Any]) -> Any:
        refuse_units(along, "derivatives are in the units of the structure")
        return directions_of(system, names, along)

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

    def _beside_impacts(self) -> tuple[Array, Array]:
        rows = self.impacts
        before, after = (
            np.stack([rows["q"], rows[f"v_{side}"]], axis=1) for side in ("pre", "post")
        )
        return before, after

    def _impact_rates(self, found: Any, slopes: Slopes) -> dict[str, Array]:
        return impact_rates(self.system, self.impacts, found, slopes)

    def _columns(self) -> dict[str, tuple[str, ...]]:
        return {"impacts": IMPACT_COLUMNS}

    def _impacts(self, rows: dict[str, NDArray[Any]]) -> Table:
        return self._table(rows)

    def _table(self, columns: dict[str, NDArray[Any]]) -> Table:
        wide = {name: self._system._from_core(columns[name]) for name in _WIDE if name in columns}
        return of_columns(columns | wide)

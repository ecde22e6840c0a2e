"""A run in SI: the same numbers times the scales of its system (`scales`)."""

from __future__ import annotations

import dataclasses
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .arguments import times_of
from .interruption import interruptible
from .run_parts import EnergyAudit, FinalState, read_only
from .scales import COLUMN_UNITS, Scales, needed

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Array = NDArray[np.float64]


@interruptible
class RunInSI:
    """A run in SI, as ``Run.in_si`` returns it; attributes are named as those of ``Run``.

    Attributes
    ----------
    run
        The run itself, dimensionless.
    scales
        Those of its system.

    Examples
    --------
    >>> import vibroimpact as vi
    >>> machine = vi.System.from_physical(
    ...     pendulum_mass=3, oscillator_mass=5, length=0.1, torsional_stiffness=500, stiffness=50e3,
    ...     gap=0.05, restitution=0.8, drive_frequency=180, moment_amplitude=300,
    ... )
    >>> run = vi.simulate(machine, initial=(0, 0.5, 0, 0), periods=20, units="SI")
    >>> run.in_si().impacts.dtype.names[:5]
    ('time', 'period', 'time_in_period', 'x1', 'v1_pre')
    """

    def __init__(self, run: Any) -> None:
        self.run = run
        self.scales: Scales = needed(run.system.scales)

    @property
    def initial(self) -> tuple[float, float, float, float]:
        """The state at t = 0 in rad, rad/s, m, m/s."""
        x1, v1, x2, v2 = self.scales.to_si(self.run.initial).tolist()
        return x1, v1, x2, v2

    @cached_property
    def impacts(self) -> NDArray[np.void]:
        """Kept impacts, columns as in ``Run.impacts``: s, rad, rad/s, m, m/s, N s, J."""
        return self._table(self.run.impacts)

    @cached_property
    def stroboscopic(self) -> Array:
        """Kept stroboscopic states, shape (k, 4): rad, rad/s, m, m/s."""
        return read_only(self.scales.to_si(self.run.stroboscopic))

    @cached_property
    def events(self) -> NDArray[np.void]:
        """Kept events, columns as in ``Run.events``; ``time`` in s."""
        return self._table(self.run.events)

    @cached_property
    def grazes(self) -> NDArray[np.void]:
        """Kept grazes, columns as in ``Run.grazes``; ``gap_acceleration`` in m/s^2."""
        return self._table(self.run.grazes)

    @cached_property
    def contacts(self) -> NDArray[np.void]:
        """Kept events of sustained contact, columns as in ``Run.contacts``; forces in N.

        ``error`` bounds time and state together, and stays dimensionless.
        """
        return self._table(self.run.contacts)

    @property
    def time_in_contact(self) -> float:
        """Time in sustained contact within the kept window, in s."""
        return float(self.run.time_in_contact * self.scales.time)

    @property
    def kept_from(self) -> float:
        """The time at which the kept window starts, in s."""
        return float(self.run.kept_from * self.scales.time)

    @cached_property
    def final_state(self) -> FinalState:
        """The state at the end: rad, rad/s, m, m/s, s."""
        end: FinalState = self.run.final_state
        x1, v1, x2, v2 = self.scales.to_si(end.state).tolist()
        return dataclasses.replace(
            end,
            x1=x1,
            v1=v1,
            x2=x2,
            v2=v2,
            time=end.time * self.scales.time,
            time_in_period=end.time_in_period * self.scales.time,
        )

    def trajectory(self, t: ArrayLike, *, forces: bool = False) -> Array:
        """Return the states at times ``t``, with ``forces`` the contact forces too.

        Parameters
        ----------
        t
            Times in s inside the kept window, shape (k,); or one time.
        forces
            Add two columns: normal and tangential force in N.

        Returns
        -------
        array, shape (k, 4), or (k, 6) with ``forces``; (4,) or (6,) for one time
            In rad, rad/s, m, m/s, N, N.

        Raises
        ------
        ParameterError, Interrupted
            As ``Run.trajectory``.

        Examples
        --------
        >>> run.in_si().trajectory([0.1, 0.2]).shape  # at 0.1 s and 0.2 s
        (2, 4)
        """
        times, single = times_of("t", t)
        times = times_of_run(self.run, times, self.scales)
        rows = self.run.trajectory(times[0] if single else times, forces=forces)
        states, loads = self.scales.to_si(rows[..., :4]), rows[..., 4:] * self.scales.force
        return np.concatenate([states, loads], axis=-1)

    def plot(self, **options: Any) -> Axes:
        """Draw the motion against time in SI, by ``vi.plot.time_history``.

        Parameters
        ----------
        **options
            As in ``Run.plot``; times are in s.

        Returns
        -------
        matplotlib.axes.Axes

        Examples
        --------
        >>> run.in_si().plot(window=(0.5, 0.6)).get_xlabel()
        'time $t$ (s)'
        """
        axes: Axes = self.run.plot(**{"units": "SI"} | options)
        return axes

    def energy_audit(self) -> EnergyAudit:
        """Return the works of all forces, as ``Run.energy_audit``, in J.

        Examples
        --------
        >>> run.in_si().energy_audit().restitution < 0  # in J
        True
        """
        works = dataclasses.asdict(self.run.energy_audit())
        return EnergyAudit(**{name: work * self.scales.energy for name, work in works.items()})

    def _table(self, table: NDArray[np.void]) -> NDArray[np.void]:
        scaled = table.copy()
        for name in table.dtype.names or ():
            scaled[name] *= self._unit(name)
        return read_only(scaled)

    def _unit(self, column: str) -> Any:
        if column == "gap_acceleration":
            return self.scales.speed / self.scales.time
        unit = COLUMN_UNITS.get(column, ("", ""))[0]
        return getattr(self.scales, unit) if unit else 1

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickle and copy through the run: the arrays are made anew, read-only."""
        return type(self), (self.run,)

    def __repr__(self) -> str:
        """Say what it is, and when the run ended."""
        end = self.final_state
        return f"<RunInSI {self.run.stop_reason} at {end.time:.6g} s, {len(self.impacts)} impacts>"


def times_of_run(run: Any, seconds: ArrayLike, scales: Scales) -> Array:
    """Return times in s as those of a run, dimensionless.

    The ends of what is kept may have been rounded on their way through seconds: what is as near as
    that is the end itself.
    """
    times = np.asarray(seconds, dtype=np.float64) / scales.time
    for end in (run.kept_from, run.final_state.time):
        times[np.abs(times - end) <= 4.0 * np.spacing(abs(end))] = end
    return times

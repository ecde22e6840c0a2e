"""Parts of a run: the state at its end, the works of all forces, derivatives of its clock."""

from dataclasses import dataclass
from typing import Protocol, TypeVar

import numpy as np
from numpy.typing import NDArray

from .interruption import interruptible

_T = TypeVar("_T", bound=np.generic)


@interruptible
@dataclass(frozen=True, kw_only=True)
class FinalState:
    """The state at the end of a run, after the impact if one falls on that instant.

    Attributes
    ----------
    x1, v1, x2, v2
        Pendulum angle and its rate, oscillator displacement and its rate.
    time
        Time since the start.
    period, time_in_period
        Completed drive periods and the time since the last one, which together stay exact where
        ``time`` has lost digits.
    mode
        ``"flight"``, or in sustained contact ``"slide_positive"``, ``"slide_negative"`` (the sign
        of x1' while the tip slides; without friction, that at the start of the slide) or
        ``"stick"`` (x1' = 0, held by friction or by a wall at rest).

    Examples
    --------
    >>> import vibroimpact as vi
    >>> system = vi.System(mass_ratio=0.6, frequency_ratio=2, restitution=0.8, gap=0.5,
    ...                    drive_frequency=1.8, moment_amplitude=1)
    >>> run = vi.simulate(system, initial=(0, 0.5, 0, 0), periods=600, keep=100)
    >>> run.final_state.period, str(run.final_state.mode)
    (600, 'flight')
    >>> len(run.final_state.state)
    4
    """

    x1: float
    v1: float
    x2: float
    v2: float
    time: float
    period: int
    time_in_period: float
    mode: str

    @property
    def state(self) -> tuple[float, float, float, float]:
        """The four state variables (x1, v1, x2, v2), as ``initial=`` takes them."""
        return self.x1, self.v1, self.x2, self.v2


@interruptible
@dataclass(frozen=True, kw_only=True)
class EnergyAudit:
    """The works of all forces in the kept window of a run, in M1 l^2 omega_2^2.

    Energy is E = x1'^2/2 + omega0^2 x1^2/2 + (x2'^2 + x2^2)/(2 mbar); with mass_ratio = 0 body 2 is
    a wall, which has no energy of its own but does work. Works are positive where energy enters.
    The works between impacts are integrated by quadrature along the motion, independently of the
    formulas that gave it; impacts skipped in chatter are resolved. All are NaN where one leaves the
    range of floats: velocities beyond 1e154 have energies beyond it.

    Attributes
    ----------
    energy_start, energy_end
        E at both ends of the window.
    moment, force
        Work of the drive and the constant loads on pendulum and oscillator.
    damping
        Work of both dampers, <= 0.
    restitution, impact_friction
        Work of the normal impulses and of friction during impacts. The work of friction is <= 0.
        That of the normal impulses is usually <= 0, but not where friction drives the bodies
        together. Under ``law="paper"`` both may be positive.
    contact_friction
        Work of friction in sustained contact, <= 0.
    wall
        Work of a wall (mass_ratio = 0) on the pendulum, in impacts and contact.
    total
        Sum of all absolute works.
    residual
        Change of energy that no work explains: rounding, some 1e-13 of ``total``, more where a run
        ends jammed or at a Painleve point.

    Examples
    --------
    >>> import vibroimpact as vi
    >>> system = vi.System(mass_ratio=0.6, frequency_ratio=2, restitution=0.8, gap=0.5,
    ...                    drive_frequency=1.8, moment_amplitude=1)
    >>> run = vi.simulate(system, initial=(0, 0.5, 0, 0), periods=600, keep=100)
    >>> audit = run.energy_audit()
    >>> audit.restitution < 0 < audit.moment
    True
    """

    energy_start: float
    energy_end: float
    moment: float
    force: float
    damping: float
    restitution: float
    impact_friction: float
    contact_friction: float
    wall: float
    total: float
    residual: float


def read_only(array: NDArray[_T]) -> NDArray[_T]:
    """Return the array with its writeable flag cleared."""
    array.flags.writeable = False
    return array


class Slopes(Protocol):
    """The derivatives of fields of a machine by what its run is differentiated by."""

    def __call__(self, field: str, shape: tuple[int, ...] = ()) -> NDArray[np.float64]:
        """Return those of a field of some shape, (*shape, k)."""
        ...


def clock_rates(
    impacts: NDArray[np.void], omega: float, time: NDArray[np.float64], slopes: Slopes
) -> dict[str, NDArray[np.float64]]:
    """Return derivatives (n, k) of the times of impacts and of the drive's phase there.

    Parameters
    ----------
    impacts
        Their table.
    omega
        The drive frequency.
    time
        The derivatives of ``impacts["time"]``.
    slopes
        Those of fields of the machine.
    """
    rate, at = slopes("drive_frequency"), np.asarray(impacts["time"])[:, None]
    rates = {"time": time, "phase": rate * at + omega * time + slopes("phase")}
    if omega > 0.0:
        # After so many periods, each of 2 pi/omega.
        turns = np.asarray(impacts["period"])[:, None]
        rates["time_in_period"] = time + turns * (2.0 * np.pi / omega**2) * rate
    return rates

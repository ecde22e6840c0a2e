"""Parts of a run: the state at its end, the works of all forces, derivatives of its clock."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Protocol, TypeVar

import numpy as np
from numpy.typing import NDArray

from ._core import Regime
from .interruption import interruptible
from .system import System

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


def refuse_units(directions: Mapping[str, Any], why: str) -> None:
    """Refuse units in place of a direction, which may have that name."""
    if isinstance(directions.get("units"), str):
        raise TypeError(f"sensitivity() takes no units=: {why}")


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


def impulses_on_wall(
    system: System,
    impacts: NDArray[np.void],
    rates: Mapping[str, NDArray[np.float64]],
    slopes: Slopes,
) -> NDArray[np.float64] | None:
    """Return derivatives (n, k) of the normal impulses on a wall, which follow from no momentum.

    With k = slope + mu s |sin x1| slip ends at P* = x1'/k, and P = x1'/k - x1'_post/k_post, after a
    reversal with the other s. In stick nothing moves: Newton's law ends at P*, Poisson's at
    (1 + r) P_I, and the energetic one where the work is done.

    Parameters
    ----------
    system, impacts
        The system, with mass_ratio 0, and the table.
    rates
        Derivatives of ``x1``, ``v1_pre``, ``v1_post``, ``v2_pre``, ``approach_velocity``.
    slopes
        Those of fields of the system.

    Returns
    -------
    array, or None under the law of the paper with friction, and where a tip sticks: if restitution
    depends on the approach velocity; and by mass_ratio if a heavy body that is to move as the law
    wants takes an impulse without bound.
    """
    x1, v1, v1_post, v2, u = (
        np.asarray(impacts[name])[:, None]
        for name in ("x1", "v1_pre", "v1_post", "v2_pre", "approach_velocity")
    )
    regime = np.asarray(impacts["regime"])[:, None]
    oblique = system.contact == "oblique"
    slope, sine = system.slope(x1), system.tip(x1) if oblique else np.zeros_like(x1)
    smooth = not oblique or (system.friction == 0.0 and not slopes("friction").any())
    sticks = (regime == Regime.STICK_APPROACH) | (regime == Regime.STICK_RESTITUTION)
    if not smooth and system.law == "paper":
        return None
    # From x1' = 0 slip begins in the direction that approach leaves it.
    direction = np.where(v1 == 0.0, -np.sign(slope), np.sign(v1))
    curving = -sine * rates["x1"]

    def along(s: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        grip = s * np.abs(sine)
        swung = s * np.sign(sine) * slope * rates["x1"]
        # Friction jumps at x1 = 0.
        swung = np.where((sine == 0.0) & (rates["x1"] != 0.0) & (not smooth), np.nan, swung)
        turning = grip * slopes("friction") + system.friction * swung
        return slope + system.friction * grip, curving + turning

    def over(v: NDArray[np.float64], dv: NDArray[np.float64], s: NDArray[np.float64]) -> Any:
        k, dk = along(s)
        return (dv - v / k * dk) / k

    turned = (regime == Regime.REVERSAL_APPROACH) | (regime == Regime.REVERSAL_RESTITUTION)
    after = over(v1_post, rates["v1_post"], np.where(turned, -direction, direction))
    pushed = over(v1, rates["v1_pre"], direction) - np.where(sticks, 0.0, after)
    heavy = slopes("mass_ratio")
    unbounded = sticks & {"newton": True, "energetic": v2 <= 0.0}.get(system.law, False)
    if heavy.any() and unbounded.any():
        return None
    if system.law == "newton" or not sticks.any():
        return np.asarray(pushed)
    if not isinstance(system.restitution, float):
        return None
    (k, dk), (r, dr) = along(direction), (system.restitution, slopes("restitution"))
    slows, faster = k * slope, dk * slope + k * curving + heavy
    # The wall's velocity in stick, which a heavy body has gained a part of by then.
    du, w, dw = rates["approach_velocity"], v2, rates["v2_pre"] + v1 / k * heavy
    with np.errstate(divide="ignore", invalid="ignore"):
        if system.law == "poisson":
            # P_I = u/(k slope): a wall at rest has u = x1' slope.
            ending = u / slows
            stuck = (1.0 + r) * (du - ending * faster) / slows + ending * dr
        else:
            # u stays -x2', and what r^2 u^2/(2 k slope) leaves of the work is done there.
            left, scale = (r * u) ** 2 - w**2, 2.0 * slows * w
            change = 2.0 * (r * u * (dr * u + r * du) - w * dw)
            stuck = (change - left / scale * 2.0 * (faster * w + slows * dw)) / scale
            stuck -= (left / scale) ** 2 * heavy / (2.0 * w)
            stuck = pushed + np.where(w > 0.0, stuck, 0.0)
    return np.where(sticks, stuck, pushed)

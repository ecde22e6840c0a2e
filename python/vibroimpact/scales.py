"""The units of a system's dimensionless numbers in SI, and which unit each quantity has.

Length is measured in the pendulum's length l, mass in M1, time in 1/omega_2 with
omega_2 = sqrt(K2/M2) (theory page, section 1). Angles are in radians in both.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, fields
from typing import Any, Literal, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .arguments import positive, reject
from .hints import close_to
from .interruption import interruptible

Units = Literal["SI"]


@interruptible
@dataclass(frozen=True, kw_only=True)
class Scales:
    """The units of a system's dimensionless numbers, in SI.

    A dimensionless number times its unit is the quantity in SI.

    Parameters
    ----------
    length
        The pendulum's length l in m, > 0.
    mass
        The mass M1 of its tip in kg, > 0.
    time
        1/omega_2 in s, > 0.

    Raises
    ------
    ParameterError
        If one of them is not a finite number > 0.

    Examples
    --------
    >>> import vibroimpact as vi
    >>> machine = vi.System.from_physical(
    ...     pendulum_mass=3, oscillator_mass=5, length=0.1, torsional_stiffness=500, stiffness=50e3,
    ...     gap=0.05, restitution=0.8, drive_frequency=180, moment_amplitude=300,
    ... )
    >>> machine.scales
    Scales(length=0.1, mass=3.0, time=0.01)
    >>> round(machine.scales.speed, 2)  # in m/s
    10.0
    """

    length: float
    mass: float
    time: float

    def __post_init__(self) -> None:
        """Check the three units."""
        for name, value in asdict(self).items():
            object.__setattr__(self, name, positive(f"scales.{name}", value))

    @classmethod
    def of(cls, given: Any) -> Self | None:
        """Return scales from scales, from a mapping of their fields, or None from None.

        Raises
        ------
        ParameterError
            For anything else, and for a name that is missing or unknown.

        Examples
        --------
        >>> vi.Scales.of({"length": 0.1, "mass": 3.0, "time": 0.01})
        Scales(length=0.1, mass=3.0, time=0.01)
        """
        if given is None or isinstance(given, cls):
            return given
        names = [field.name for field in fields(cls)]
        mapping = isinstance(given, Mapping)
        if not mapping or set(given) != set(names):
            wrong = [str(name) for name in given if name not in names] if mapping else []
            hint = close_to(wrong[0], names) if wrong else ""
            reject("scales", given, f"None, or a Scales of {', '.join(names)}{hint}")
        return cls(**given)

    @property
    def frequency(self) -> float:
        """omega_2 in rad/s: unit of frequencies, of x1' and of Lyapunov exponents."""
        return 1.0 / self.time

    @property
    def speed(self) -> float:
        """L omega_2 in m/s: unit of x2' and of the approach velocity."""
        return self.length / self.time

    @property
    def angular_acceleration(self) -> float:
        """omega_2^2 in rad/s^2: unit of x1''."""
        return 1.0 / self.time**2

    @property
    def acceleration(self) -> float:
        """Length times omega_2^2 in m/s^2: unit of x2''."""
        return self.length / self.time**2

    @property
    def impulse(self) -> float:
        """M1 l omega_2 in N s: unit of the impulses of impacts."""
        return self.mass * self.length / self.time

    @property
    def force(self) -> float:
        """M1 l omega_2^2 in N: unit of contact forces."""
        return self.mass * self.length / self.time**2

    @property
    def energy(self) -> float:
        """M1 l^2 omega_2^2 in J: unit of energies and works."""
        return self.mass * (self.length / self.time) ** 2

    @property
    def _state(self) -> NDArray[np.float64]:
        return np.array([1.0, self.frequency, self.length, self.speed])

    def to_si(self, states: ArrayLike) -> NDArray[np.float64]:
        """Return dimensionless states in SI.

        Parameters
        ----------
        states
            x1, v1, x2, v2 in the last axis, shape (..., 4), dimensionless.

        Returns
        -------
        array, shape (..., 4)
            In rad, rad/s, m, m/s.

        Examples
        --------
        >>> machine.scales.to_si((0.1, 0.5, 0.1, 0.2)).round(3).tolist()
        [0.1, 50.0, 0.01, 2.0]
        """
        return _rows("states", states) * self._state

    def from_si(self, states: ArrayLike) -> NDArray[np.float64]:
        """Return states in SI as dimensionless ones, as ``initial=`` takes them.

        Parameters
        ----------
        states
            x1, v1, x2, v2 in rad, rad/s, m, m/s in the last axis, shape (..., 4).

        Returns
        -------
        array, shape (..., 4)

        Examples
        --------
        >>> machine.scales.from_si((0.1, 2.0, 0.01, 0.5)).round(3).tolist()
        [0.1, 0.02, 0.1, 0.05]
        """
        return _rows("states", states) / self._state


# The unit of each column of a run's arrays: a property of Scales, and its sign in print.
COLUMN_UNITS: Mapping[str, tuple[str, str]] = {
    **dict.fromkeys(("time", "time_in_period", "time_jump"), ("time", "s")),
    **dict.fromkeys(("v1", "v1_pre", "v1_post"), ("frequency", "rad/s")),
    "x2": ("length", "m"),
    **dict.fromkeys(("v2", "v2_pre", "v2_post", "approach_velocity"), ("speed", "m/s")),
    "a1": ("angular_acceleration", "rad/s²"),
    "a2": ("acceleration", "m/s²"),
    **dict.fromkeys(("impulse_normal", "impulse_tangential"), ("impulse", "N s")),
    **dict.fromkeys(("normal_force", "tangential_force"), ("force", "N")),
    "energy_loss": ("energy", "J"),
    **dict.fromkeys(("x1", "phase"), ("", "rad")),
}


def unit_of(column: str, scales: Scales | None) -> float:
    """Return the unit of a column in SI; 1 of one that has none, and without scales."""
    unit = COLUMN_UNITS.get(column, ("", ""))[0]
    return getattr(scales, unit) if unit and scales is not None else 1.0


# Where scales come from.
_SCALES_OF = (
    "a system from System.from_physical has them, another gets them by system.replace(scales=...)"
)


def needed(scales: Scales | None) -> Scales:
    """Return the scales of a system; ParameterError if it has none."""
    if scales is None:
        reject("scales", None, f"the scales of a system, for SI units: {_SCALES_OF}")
    return scales


def in_si(units: Any) -> bool:
    """Whether numbers are wanted in SI; ParameterError for other units."""
    if units is not None and not (isinstance(units, str) and units == "SI"):
        reject("units", units, "None (dimensionless) or 'SI'")
    return units is not None


def chosen(units: Any, scales: Scales | None) -> Scales | None:
    """Return None for ``units=None``, and the scales of a system for ``units="SI"``.

    Raises
    ------
    ParameterError
        For other units, and if the system has no scales.
    """
    if in_si(units) and scales is None:
        reject("units", units, f"None for a system without scales: {_SCALES_OF}")
    return scales if in_si(units) else None


def not_in_si(scales: Scales) -> str:
    """Return what numbers mean that are given without ``units="SI"``, for a message."""
    frequency, length = 1.0 / scales.time, scales.length
    return (
        "without units='SI' all numbers are dimensionless, also those of a system made in SI: 1 "
        f"means {scales.time:.3g} s, {frequency:.3g} rad/s, {length:.3g} m"
    )


def _rows(name: str, given: ArrayLike) -> NDArray[np.float64]:
    array = np.asarray(given, dtype=np.float64)
    if not array.ndim or array.shape[-1] != 4:
        reject(f"{name}.shape", array.shape, "(..., 4): x1, v1, x2, v2 in the last axis")
    return array

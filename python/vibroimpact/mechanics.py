"""The mechanics of a system, many states at once: gap, accelerations, motion without contact.

The formulas are those of the compiled core (theory page, section 1). Lengths are in units of the
pendulum's length l, times in 1/omega_2; see the notation page.
"""

from __future__ import annotations

from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _core
from .arguments import array_of, as_floats, number, reject, state, states, vector
from .errors import ParameterError
from .interruption import interruptible
from .machine import Machine
from .restitution import RestitutionCurve

Array = NDArray[np.float64]


@interruptible
class Mechanics(Machine):
    """The mechanics of `System`."""

    @cached_property
    def _compiled(self) -> _core.System:
        # It is no field, so that it has no influence on equality, hash, repr or pickle.
        fields = {name: value for name, value in self._fields().items() if name != "scales"}
        if isinstance(fields["restitution"], RestitutionCurve):
            fields["curve"] = fields.pop("restitution")._compiled
        return _core.System(**fields)

    @property
    def is_wall(self) -> bool:
        """Whether the second body is a wall: ``mass_ratio`` = 0, impacts do not act on it."""
        return self._compiled.is_wall

    @property
    def is_rotor(self) -> bool:
        """Whether the pendulum is a free rotor in oblique contact: x1 counts modulo a turn."""
        return self._compiled.is_rotor

    def tip(self, x1: ArrayLike) -> Array:
        """Return the position of the pendulum's tip along the contact normal, in l.

        Parameters
        ----------
        x1
            Angles in radians, real numbers of any shape; NaN stays NaN.

        Returns
        -------
        array of the same shape
            sin x1, or x1 in direct contact.

        Raises
        ------
        ParameterError
            If ``x1`` is no array of real numbers.

        Examples
        --------
        >>> import vibroimpact as vi
        >>> system = vi.System(mass_ratio=0.6, frequency_ratio=2.0, restitution=0.8, gap=0.5,
        ...                    drive_frequency=1.25)
        >>> system.tip([0.0, 0.5]).round(3)
        array([0.   , 0.479])
        """
        angles = _reals("x1", x1)
        return self._compiled.tip(angles.ravel()).reshape(angles.shape)[()]

    def slope(self, x1: ArrayLike) -> Array:
        """Return the derivative of `tip` by x1: cos x1, or 1 in direct contact.

        Parameters, shapes and errors are those of `tip`.

        Examples
        --------
        >>> import vibroimpact as vi
        >>> system = vi.System(mass_ratio=0.6, frequency_ratio=2.0, restitution=0.8, gap=0.5,
        ...                    drive_frequency=1.25)
        >>> system.slope(0.5).round(3)
        np.float64(0.878)
        """
        angles = _reals("x1", x1)
        return self._compiled.slope(angles.ravel()).reshape(angles.shape)[()]

    def gap_function(self, states: ArrayLike) -> Array:
        """Return g = tip(x1) - x2 - gap, in l: negative while the bodies are apart.

        Parameters
        ----------
        states
            States x1, v1, x2, v2, finite numbers of shape (4,) or (k, 4).

        Returns
        -------
        number, or array of shape (k,)

        Raises
        ------
        StateError
            If ``states`` has another shape or is not finite.

        Examples
        --------
        >>> import vibroimpact as vi
        >>> system = vi.System(mass_ratio=0.6, frequency_ratio=2.0, restitution=0.8, gap=0.5,
        ...                    drive_frequency=1.25)
        >>> system.gap_function([[0.0, 0.0, 0.0, 0.0], [0.0, 1.0, -0.5, 0.2]])
        array([-0.5,  0. ])
        """
        rows, one = _rows(states)
        return _shaped(self._compiled.gap_function(rows), one)

    def gap_rate(self, states: ArrayLike) -> Array:
        """Return g' = x1' tip'(x1) - x2', in l omega_2: the approach velocity u at contact.

        Parameters, shapes and errors are those of `gap_function`.

        Examples
        --------
        >>> import vibroimpact as vi
        >>> system = vi.System(mass_ratio=0.6, frequency_ratio=2.0, restitution=0.8, gap=0.5,
        ...                    drive_frequency=1.25)
        >>> system.gap_rate([0.0, 1.0, -0.5, 0.25])
        np.float64(0.75)
        """
        rows, one = _rows(states)
        return _shaped(self._compiled.gap_rate(rows), one)

    def gap_acceleration(self, states: ArrayLike, phase: ArrayLike) -> Array:
        """Return g'' of the motion without contact, in l omega_2^2.

        Parameters
        ----------
        states
            As in `gap_function`.
        phase
            Phase of the drive in radians, one for all states or one each, shape (k,).

        Returns
        -------
        number, or array of shape (k,)

        Raises
        ------
        StateError
            If ``states`` has another shape or is not finite.
        ParameterError
            If ``phase`` does not fit the states or is not finite.

        Examples
        --------
        >>> import vibroimpact as vi
        >>> system = vi.System(mass_ratio=0.6, frequency_ratio=2.0, restitution=0.8, gap=0.5,
        ...                    drive_frequency=1.25, force_amplitude=0.5)
        >>> system.gap_acceleration([0.0, 1.0, -0.5, 0.25], 0.0)
        np.float64(-1.0)
        """
        rows, one = _rows(states)
        return _shaped(self._compiled.gap_acceleration(rows, _phases(phase, len(rows))), one)

    def accelerations(self, states: ArrayLike, phase: ArrayLike) -> Array:
        """Return x1'' and x2'' of the motion without contact, in omega_2^2 and l omega_2^2.

        Parameters and errors are those of `gap_acceleration`.

        Returns
        -------
        array of shape (2,) or (k, 2)

        Examples
        --------
        >>> import vibroimpact as vi
        >>> system = vi.System(mass_ratio=0.6, frequency_ratio=2.0, restitution=0.8, gap=0.5,
        ...                    drive_frequency=1.25, moment_amplitude=1.0)
        >>> system.accelerations([0.5, 0.0, -0.5, 0.0], 0.0)
        array([-1. ,  0.5])
        """
        rows, one = _rows(states)
        values = self._compiled.accelerations(rows, _phases(phase, len(rows)))
        return values[0] if one else values

    def free_flight(
        self, initial: ArrayLike, times: ArrayLike, *, phase: float | None = None
    ) -> Array:
        """Return the motion from a state as if the bodies never met, exact to rounding.

        Parameters
        ----------
        initial
            State x1, v1, x2, v2 at the start, shape (4,).
        times
            Times >= 0 since the start, in 1/omega_2, shape (n,), in any order.
        phase
            Phase of the drive at the start in radians; the system's own if not given, as at t = 0.

        Returns
        -------
        array of shape (n, 4)
            States x1, v1, x2, v2, whether or not the bodies overlap there.

        Raises
        ------
        StateError
            If ``initial`` is no finite state.
        ParameterError
            If ``times`` or ``phase`` are not finite, or a time is negative.

        Examples
        --------
        >>> import math
        >>> import vibroimpact as vi
        >>> system = vi.System(mass_ratio=0.6, frequency_ratio=2.0, restitution=0.8, gap=0.5,
        ...                    drive_frequency=1.25)
        >>> system.free_flight((0.5, 0.0, 1.0, 0.0), [0.0, math.pi]).round(12) + 0.0
        array([[ 0.5,  0. ,  1. ,  0. ],
               [ 0.5,  0. , -1. ,  0. ]])
        """
        start = state(initial)
        moments = vector("times", times)
        early = np.flatnonzero(moments < 0.0)
        if len(early):
            reject(f"times[{early[0]}]", float(moments[early[0]]), "a finite number >= 0")
        psi = self.to_dict()["phase"] if phase is None else number("phase", phase)
        return self._compiled.free_flight(start, moments, psi)


def _reals(name: str, given: ArrayLike) -> Array:
    wanted = "real numbers"
    array = array_of(name, given, wanted)
    if array.dtype.kind not in "iuf":
        raise ParameterError(f"{name} = {given!r} is not allowed; allowed: {wanted}")
    return as_floats(array)


def _rows(given: ArrayLike) -> tuple[Array, bool]:
    """Return states of shape (k, 4), and whether a single state was given."""
    array = states(given, "states")
    return np.atleast_2d(array), array.ndim == 1


def _phases(given: ArrayLike, count: int) -> Array:
    phases = _reals("phase", given)
    if phases.shape not in ((), (count,)) or not np.isfinite(phases).all():
        reject("phase", given, f"a finite number, or {count} of them")
    return np.broadcast_to(phases, (count,))


def _shaped(values: Array, one: bool) -> Array:
    return values[0] if one else values

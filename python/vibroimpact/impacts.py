"""Single impacts: their outcome under any law, exact or in small steps of the impulse.

Along the normal impulse P, with u = x1' cos x1 - x2' and s = sgn x1':

    d x1' = -k dP,  k = cos x1 + mu s |sin x1|        d x2' = mbar dP

Source: theory page, section 4; Han, Jin & Hu (2004), section 2. All quantities dimensionless.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _core
from .arguments import array_of, as_floats, optional_count, reject
from .errors import ParameterError, StateError
from .interruption import interruptible
from .machine_kinds import need_system
from .system import System

MOST_STEPS = 10**6
"""Most steps of the incremental-impulse integrator; beyond, rounding takes over."""


@interruptible
def impact(
    system: System,
    *,
    x1: ArrayLike,
    v1: ArrayLike,
    v2: ArrayLike,
    steps: int | None = None,
) -> NDArray[np.void]:
    """Resolve impacts from the states just before them, by the law of the system.

    Parameters
    ----------
    system
        Its mass ratio, restitution, friction, contact and law are used.
    x1
        Angle of the pendulum; a number, or an array that broadcasts with the others.
    v1
        Its rate x1' just before the impact. The bodies must approach: u = x1' cos x1 - x2' > 0
        (x1' - x2' in direct contact).
    v2
        Velocity x2' of the oscillator just before the impact.
    steps
        None for the exact impulse path. With a number, the incremental integration is used instead,
        an independent check with an error of first order: each step is the ``steps``-th part of the
        impulse so far. 1 ... 1,000,000; not for ``law="paper"``.

    Returns
    -------
    numpy.ndarray
        Structured, of the broadcast shape: ``x1, v1_pre, v2_pre, v1_post, v2_post,
        approach_velocity, separation_velocity, regime, impulse_normal, impulse_tangential,
        energy_loss, friction_loss, effective_restitution``. Impulses in M1 l omega_2, energies in
        M1 l^2 omega_2^2; ``friction_loss`` is friction's part of ``energy_loss``,
        ``effective_restitution`` is -u_post/u. An impact without outcome (jammed, or
        ``law="paper"`` failed) has the regime -1 and NaN.

    Raises
    ------
    ParameterError
        If an argument is no number, the shapes do not broadcast, or ``steps`` is out of range.
    StateError
        If a value is not finite, or the bodies do not approach.

    Examples
    --------
    >>> import vibroimpact as vi
    >>> system = vi.System(mass_ratio=0.6, frequency_ratio=2, restitution=0.8, gap=0.5,
    ...                    drive_frequency=1.8, moment_amplitude=1)
    >>> after = vi.impact(system, x1=0.3, v1=1.0, v2=0.2)
    >>> after.shape, "v1_post" in after.dtype.names
    ((), True)
    """
    need_system(system)
    steps = optional_count("steps", steps, least=1, most=MOST_STEPS)
    given = [_numbers(name, value) for name, value in (("x1", x1), ("v1", v1), ("v2", v2))]
    try:
        states = np.broadcast_arrays(*given)
    except ValueError:
        shapes = ", ".join(str(array.shape) for array in given)
        raise ParameterError(
            f"x1, v1, v2 of shapes {shapes} are not allowed; allowed: shapes that broadcast"
        ) from None
    flat = [np.ascontiguousarray(array).ravel() for array in states]
    return _core.impact(system._compiled, *flat, steps=steps).reshape(states[0].shape)


def _numbers(name: str, value: Any) -> NDArray[np.float64]:
    array = array_of(name, value, "a number or an array of numbers")
    if array.dtype.kind not in "iuf":
        reject(name, value, "a number or an array of numbers")
    result = as_floats(array)
    if not np.isfinite(result).all():
        bad = float(result[~np.isfinite(result)][0])
        raise StateError(f"{name} = {bad!r} is not allowed; allowed: a finite number")
    return result

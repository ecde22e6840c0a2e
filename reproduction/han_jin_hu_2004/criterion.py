"""The paper's criterion of stability, (42)-(45), for period n-1 solutions.

D is the derivative by Y = (x1, x1', x2', psi) just before the impact of (x1, x1', x2, x2') after
the impact, (20) and (44), and a flight of *fixed* length n drive periods. The paper takes the
eigenvalues of the residual's Jacobian (42), D - E with E the embedding of Y, for multipliers and
calls a motion stable if all lie inside the unit circle. That matrix is not the derivative of the
return map (docs/errata.md, E5).
"""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from vibroimpact import MotionMap, ParameterError, PeriodicMotion, System

from .printed_impact import coefficient_slopes, frictionless_coefficients

NAME = "(45)"
Array = NDArray[np.float64]

_FIELDS = (
    *("mass_ratio", "frequency_ratio", "restitution", "drive_frequency"),
    *("pendulum_damping", "oscillator_damping", "moment_amplitude", "force_amplitude"),
)
# The exponential of a matrix of norm 1: terms of its series down to rounding.
_SERIES_TERMS = 18


def eigenvalues(motion: PeriodicMotion) -> NDArray[np.complex128]:
    """Return the roots of (45) for a motion with one impact, by falling modulus, shape (4,).

    Raises
    ------
    ParameterError
        If it is not defined: not one impact, direct contact, friction, or a wall at rest.
    """
    system = motion.system
    direct = system.contact == "direct"
    if motion.n != 1 or direct or system.friction != 0.0 or _is_wall_at_rest(system):
        raise ParameterError(
            f"motion = {motion!r}: the criterion is defined for one oblique impact without "
            "friction and a moving body 2"
        )
    columns = {name: np.array([getattr(system, name)]) for name in _FIELDS}
    state = np.array([motion.state])
    (roots,) = _eigenvalues(motion.m, columns, state)
    return np.asarray(roots)


def map_eigenvalues(found: MotionMap) -> NDArray[np.complex128]:
    """Return the roots of (45) for every solution of a map, shape (solutions, 4).

    Raises
    ------
    ParameterError
        If the contact is direct or body 2 a wall at rest: there they are not defined.
    """
    rows = found.solutions
    columns = {
        name: found.parameter(name)
        if name in found.grid
        else np.full(len(rows), getattr(found.system, name))
        for name in _FIELDS
    }
    # The columns are those of many systems at once, which `System.is_wall` does not take.
    at_rest = (columns["mass_ratio"] == 0.0) & (columns["force_amplitude"] == 0.0)
    if found.system.contact == "direct" or at_rest.any():
        raise ParameterError("the criterion is defined for oblique impacts on a moving body 2 only")
    state = np.column_stack([rows[name] for name in ("x1", "v1", "v2", "phase")])
    return _eigenvalues(found.n, columns, state)


def is_stable(roots: NDArray[np.complex128]) -> NDArray[np.bool_]:
    """Say of each set of roots, along the last axis, whether all lie inside the unit circle."""
    return np.asarray(np.abs(roots).max(axis=-1, initial=0.0) < 1.0)


def verdict(motion: PeriodicMotion) -> tuple[str, float]:
    """Return what the criterion calls a motion, and the largest modulus of its roots."""
    roots = eigenvalues(motion)
    return "stable" if is_stable(roots) else "unstable", float(np.abs(roots).max())


def _is_wall_at_rest(system: System) -> bool:
    return system.is_wall and system.force_amplitude == 0.0


def _eigenvalues(n: int, system: Mapping[str, Array], state: Array) -> NDArray[np.complex128]:
    x1, v1, v2, phase = state.T
    mbar, r, omega = (system[name] for name in ("mass_ratio", "restitution", "drive_frequency"))
    one, zero = np.ones_like(x1), np.zeros_like(x1)
    kappa = np.cos(x1)
    r1, r2, r3, r4 = frictionless_coefficients(x1, mbar, r)
    r1_x, r2_x, r3_x, r4_x = coefficient_slopes(x1, mbar, r)
    after = np.empty((len(x1), 4, 4))
    after[:, 0] = np.stack([one, zero, zero, zero], axis=1)
    after[:, 1] = np.stack([r1_x * v1 + r2_x * v2, r1, r2, zero], axis=1)
    after[:, 2] = np.stack([kappa, zero, zero, zero], axis=1)
    after[:, 3] = np.stack([r3_x * v1 + r4_x * v2, r3, r4, zero], axis=1)
    embedding = np.zeros_like(after)
    embedding[:, 0, 0] = embedding[:, 1, 1] = embedding[:, 3, 2] = 1.0
    embedding[:, 2, 0] = kappa
    derivative = np.empty_like(after)
    bodies = (
        (system["frequency_ratio"], system["pendulum_damping"], system["moment_amplitude"]),
        (one, system["oscillator_damping"], system["force_amplitude"]),
    )
    for row, (frequency, damping, force) in zip((0, 2), bodies, strict=True):
        flight = _flight(n, omega, frequency, damping, force)
        derivative[:, row : row + 2] = flight[:, :2, :2] @ after[:, row : row + 2]
        # The flight starts with cos psi, sin psi.
        turning = np.stack([-np.sin(phase), np.cos(phase)], axis=1)
        derivative[:, row : row + 2, 3] += (flight[:, :2, 2:] @ turning[..., None])[..., 0]
    values = np.linalg.eigvals(derivative - embedding).astype(np.complex128)
    order = np.lexsort((-values.imag, -np.round(np.abs(values), 13)), axis=-1)
    return np.take_along_axis(values, order, axis=-1)


def _flight(n: int, omega: Array, frequency: Array, damping: Array, force: Array) -> Array:
    """Carry (x, x', cos psi, sin psi) of a body over n drive periods: matrices, shape (k, 4, 4).

    By the exponential of the matrix of x'' + 2 zeta w x' + w^2 x = f cos psi, psi' = omega, which
    has no special cases at resonance or critical damping. The matrix is scaled down, its series
    summed, and the result squared again.
    """
    matrix = np.zeros((len(omega), 4, 4))
    matrix[:, 0, 1] = 1.0
    matrix[:, 1, :3] = np.stack([-(frequency**2), -2.0 * damping * frequency, force], axis=1)
    matrix[:, 2, 3], matrix[:, 3, 2] = -omega, omega
    matrix *= (2.0 * np.pi * n / omega)[:, None, None]
    norm = float(np.abs(matrix).sum(axis=2).max(initial=0.0))
    halvings = max(0, int(np.ceil(np.log2(norm)))) if norm else 0
    matrix /= 2.0**halvings
    identity = np.eye(4)
    result = np.broadcast_to(identity, matrix.shape)
    for k in range(_SERIES_TERMS, 0, -1):
        result = identity + matrix @ result / k
    for _ in range(halvings):
        result = result @ result
    return result

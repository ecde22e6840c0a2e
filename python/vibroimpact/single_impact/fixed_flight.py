"""Floquet multipliers of period n-1 solutions, of many systems at once.

The formulas are special to this machine without friction. The general way, `Itinerary.transfer` of
the compiled core, takes one system at a time.

D is the derivative by Y = (x1, x1', x2', psi) just before the impact of (x1, x1', x2, x2') after
the impact and a flight of *fixed* length n drive periods. The return map also changes the time of
arrival (docs/theory.md, section 7):

    dX = (I - F (grad g)^T/u) D dY,      d psi' = d psi - omega (grad g)^T D dY/u.
"""

import numpy as np
from numpy.typing import NDArray

from .algebraic import Conditions
from .enclosed_flight import Complex, Flight

Array = NDArray[np.float64]


def _fixed_flight(equations: Conditions, which: NDArray[np.int64], state: Array) -> Array:
    """Return D, shape (k, 4, 4), at states (x1, v1, v2, phase), shape (k, 4)."""
    par = equations.parameters
    x1, v1, v2, phase = state.T
    omega, mbar, r = (
        column[which] for column in (par.drive_frequency, par.mass_ratio, par.restitution)
    )
    one, zero = np.ones_like(x1), np.zeros_like(x1)
    _, kappa, bend = par.tip_jet(x1)
    # Han, Jin & Hu (2004), (20) and (44).
    q = mbar + kappa**2
    r1, r2 = (mbar - r * kappa**2) / q, (1.0 + r) * kappa / q
    r3, r4 = mbar * r2, (kappa**2 - r * mbar) / q
    r1_x = -2.0 * (1.0 + r) * mbar * kappa / q**2 * bend
    r2_x = (1.0 + r) * (mbar - kappa**2) / q**2 * bend
    after = np.empty((len(x1), 4, 4))
    after[:, 0] = np.stack([one, zero, zero, zero], axis=1)
    after[:, 1] = np.stack([r1_x * v1 + r2_x * v2, r1, r2, zero], axis=1)
    after[:, 2] = np.stack([kappa, zero, zero, zero], axis=1)
    after[:, 3] = np.stack([mbar * r2_x * v1 - r1_x * v2, r3, r4, zero], axis=1)
    derivative = np.empty_like(after)
    for row, body in ((0, equations.first), (2, equations.second)):
        a = _propagator(body, which, omega)
        derivative[:, row : row + 2] = a @ after[:, row : row + 2]
        derivative[:, row, 3] += _turning(body.gx, which, phase)
        derivative[:, row + 1, 3] += omega * _turning(body.gv, which, phase)
    return derivative


def multipliers(
    equations: Conditions, which: NDArray[np.int64], state: Array
) -> NDArray[np.complex128]:
    """Return the Floquet multipliers, by falling modulus, shape (k, 4)."""
    par = equations.parameters
    derivative = _fixed_flight(equations, which, state)
    x1, v1, v2, phase = state.T
    tip, kappa, _ = par.tip_jet(x1)
    y = tip - par.gap[which]
    omega0, zeta1, zeta2 = (
        column[which]
        for column in (par.frequency_ratio, par.pendulum_damping, par.oscillator_damping)
    )
    drive = np.cos(phase)
    a1 = par.moment_amplitude[which] * drive - 2.0 * zeta1 * omega0 * v1 - omega0**2 * x1
    a2 = par.force_amplitude[which] * drive - 2.0 * zeta2 * v2 - y
    # Minus the time that each variation of Y arrives later.
    ahead = kappa[:, None] * derivative[:, 0] - derivative[:, 2]
    ahead /= (kappa * v1 - v2)[:, None]
    field = np.stack([v1, a1, v2, a2], axis=1)
    shifted = derivative - field[:, :, None] * ahead[:, None, :]
    result = np.empty_like(derivative)
    result[:, :3] = shifted[:, [0, 1, 3]]
    result[:, 3] = np.eye(4)[3] - par.drive_frequency[which][:, None] * ahead
    return _sorted(result)


def _propagator(body: Flight, which: NDArray[np.int64], omega: Array) -> Array:
    """A of one body, time in 1/omega_2 again, shape (k, 2, 2)."""
    a = np.empty((len(which), 2, 2))
    a[:, 0, 0], a[:, 1, 1] = 1.0 - body.c11.middle[which], 1.0 - body.c22.middle[which]
    a[:, 0, 1], a[:, 1, 0] = body.a12.middle[which] / omega, omega * body.a21.middle[which]
    return a


def _turning(force: Complex, which: NDArray[np.int64], phase: Array) -> Array:
    """Derivative of Re(G e^{i psi}) by psi."""
    return -force.re.middle[which] * np.sin(phase) - force.im.middle[which] * np.cos(phase)


def _sorted(matrices: Array) -> NDArray[np.complex128]:
    """Eigenvalues by falling modulus."""
    values = np.linalg.eigvals(matrices).astype(np.complex128)
    order = np.lexsort((-values.imag, -np.round(np.abs(values), 13)), axis=-1)
    return np.take_along_axis(values, order, axis=-1)

"""Derivatives by the drive's frequency of motions without impacts, over very many drive periods."""

import numpy as np
import pytest

import vibroimpact as vi

OMEGA = 1.1
FAR = 5.0
MASS, STIFFNESS = np.diag([1.0, 2.0]), np.array([[3.0, -1.0], [-1.0, 2.0]])
FORCE = np.array([0.3, 0.1])
COUPLED = np.array([[0.3, -0.05], [-0.05, 0.1]])
ALIKE = 0.2 * MASS + 0.05 * STIFFNESS
MOMENT, FREQUENCY, RATIO = 0.3, 1.4, 0.07


def response(mass, stiffness, damping, force):
    """Return d(q, q')/d omega at the phase 0 of the steady response Re(X e^{i psi}), exactly."""
    impedance = np.linalg.inv(stiffness - OMEGA**2 * mass + 1j * OMEGA * damping)
    amplitude = impedance @ force
    slope = -impedance @ (1j * damping - 2.0 * OMEGA * mass) @ amplitude
    return np.concatenate([slope.real, (1j * (amplitude + OMEGA * slope)).real])


def far(damping):
    """Return a structure that never meets its stop."""
    return vi.Structure(
        MASS,
        STIFFNESS,
        [vi.Stop([1, 0], FAR, 0.8)],
        damping=damping,
        drive_amplitude=FORCE,
        drive_frequency=OMEGA,
    )


PENDULUM = vi.System(
    mass_ratio=0.5,
    frequency_ratio=FREQUENCY,
    restitution=0.8,
    gap=FAR,
    drive_frequency=OMEGA,
    pendulum_damping=RATIO,
    oscillator_damping=0.1,
    moment_amplitude=MOMENT,
)
REST = np.zeros((2, 2))
CASES = {
    "modes": (far(ALIKE), REST, [0, 1, 2, 3], response(MASS, STIFFNESS, ALIKE, FORCE)),
    "coupled": (far(COUPLED), REST, [0, 1, 2, 3], response(MASS, STIFFNESS, COUPLED, FORCE)),
    "system": (
        PENDULUM,
        (0, 0, 0, 0),
        [0, 1],
        response(
            np.eye(1),
            np.array([[FREQUENCY**2]]),
            np.array([[2.0 * RATIO * FREQUENCY]]),
            np.array([MOMENT]),
        ),
    ),
}


@pytest.mark.parametrize("periods", [300, 3_000, 10_000])
@pytest.mark.parametrize("kind", CASES)
def test_they_keep_their_digits(kind, periods):
    machine, initial, rows, exact = CASES[kind]
    given = {"initial": initial, "periods": periods, "keep": 1, "max_events": 10**15}
    made = vi.simulate(machine, **given, sensitivity="drive_frequency")
    assert made.impact_count == 0
    for run in (made, vi.simulate(machine, **given)):
        found = run.sensitivity("drive_frequency").stroboscopic[-1, rows, 0]
        assert np.abs(found - exact).max() < 1e-13

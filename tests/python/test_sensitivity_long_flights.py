"""Derivatives of motions without impacts, over very many drive periods."""

import signal
import threading

import numpy as np
import pytest

import vibroimpact as vi
from ctrl_c import asks_of, ctrl_c_at, interrupted

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


@pytest.mark.parametrize("periods", [4_000, 400_000])
def test_equal_modes_that_a_spring_couples_keep_their_digits(periods):
    """From rest at Q both are there again, and have received -Q t/2 from each other."""
    alike = vi.Structure(np.eye(2), np.eye(2), [vi.Stop([1, 0], FAR, 0.8)], drive_frequency=4.0)
    start = np.array([[0.3, 0.2], [0.0, 0.0]])
    run = vi.simulate(alike, initial=start, periods=periods, keep=1)
    found = run.sensitivity(spring={"stiffness": [[0, 1], [1, 0]]}).stroboscopic[-1, :, 0]
    time = periods * 2.0 * np.pi / 4.0
    assert np.abs(found - [0.0, 0.0, -0.5 * time * 0.2, -0.5 * time * 0.3]).max() < 1e-12 * time


SLOW, FAST = 0.5, 4.0
X1, V1, X2, V2 = START = 0.3, 0.2, 0.1, 0.3
UNDAMPED = vi.System(
    mass_ratio=0.5,
    frequency_ratio=SLOW,
    restitution=0.8,
    gap=50.0,
    drive_frequency=FAST,
    moment_amplitude=1.0,
)


@pytest.mark.parametrize("periods", [8_000, 800_000])
def test_without_damping_they_keep_their_digits(periods):
    """Where all motions are back at their start, x = A cos(w t) + v/w sin(w t) + F cos(omega t)."""
    names = {
        "pendulum_damping": lambda t: [-SLOW * t * free, -SLOW * t * V1, 0, 0],
        "frequency_ratio": lambda t: [t * V1 / SLOW, -t * SLOW * free, 0, 0],
        # At a fixed phase of the drive: earlier, where it is faster.
        "drive_frequency": lambda t: np.array([-V1, SLOW**2 * free, -V2, X2]) * t / FAST,
        "oscillator_damping": lambda t: [0, 0, -t * X2, -t * V2],
    }
    free = X1 - 1.0 / (SLOW**2 - FAST**2)
    time = periods * 2.0 * np.pi / FAST
    run = vi.simulate(UNDAMPED, initial=START, periods=periods, keep=1)
    found = run.sensitivity(*names).stroboscopic[-1]
    exact = np.array([by(time) for by in names.values()]).T
    assert np.abs(found - exact).max() < 1e-11 * time


@pytest.mark.parametrize("names", [["drive_frequency"], ["frequency_ratio", "drive_frequency"]])
def test_what_is_told_at_a_time_does_not_depend_on_the_others(names):
    found = vi.simulate(UNDAMPED, initial=START, periods=5_000).sensitivity(*names)
    times = np.linspace(0.0, found.until, 1_000)
    all_of_them = found.trajectory(times)
    back = np.random.default_rng(5).permutation(1_000)
    assert np.array_equal(found.trajectory(times[back]), all_of_them[back])
    assert np.array_equal(found.trajectory(times[700]), all_of_them[700])


def test_an_interrupted_trajectory_has_the_first_rows():
    found = vi.simulate(UNDAMPED, initial=START, periods=50).sensitivity("drive_frequency")
    times = np.linspace(0.0, found.until, 40)
    rows = found.trajectory(times)
    asks = asks_of(lambda: found.trajectory(times))
    with ctrl_c_at(asks // 2) as caught:
        found.trajectory(times)
    part = caught.value.result
    assert 0 < len(part) < 40
    assert np.array_equal(part, rows[: len(part)])


def test_ctrl_c_is_heard_before_the_first_impact():
    # Long work, of which the kept window has nothing.
    run = vi.simulate(UNDAMPED, initial=START, periods=3 * 10**8, keep=1)
    ring = threading.Timer(0.1, signal.raise_signal, [signal.SIGINT])
    ring.start()
    with interrupted() as caught:
        run.sensitivity("drive_frequency")
    ring.join()
    assert caught.value.result.until == 0.0


@pytest.mark.parametrize("kind", ["modes", "coupled", "system"])
def test_an_interrupted_flight_has_its_first_sections(kind):
    machine, initial, *_ = CASES[kind]
    run = vi.simulate(machine, initial=initial, periods=60)
    whole = run.sensitivity("drive_frequency")
    asks = asks_of(lambda: run.sensitivity("drive_frequency"))
    with ctrl_c_at(asks // 2) as caught:
        run.sensitivity("drive_frequency")
    part = caught.value.result
    rows = len(part.stroboscopic)
    assert 20 < rows < 40
    assert np.array_equal(part.stroboscopic, whole.stroboscopic[:rows])
    assert part.until == pytest.approx(rows * machine.drive_period, rel=1e-15)
    assert np.abs(part.final_state - whole.trajectory(part.until)).max() < 1e-12


@pytest.mark.parametrize("other", ["static_moment", "frequency_ratio", "pendulum_damping"])
def test_what_is_asked_for_beside_a_name_takes_no_digits_from_it(other):
    """A free rotor: d x1/d A = (1 - cos t)/1, and the other needs steps."""
    rotor = UNDAMPED.replace(frequency_ratio=0.0, drive_frequency=1.0, gap=1e9)
    run = vi.simulate(rotor, initial=(0, 0, 0, 0), time=1e5)
    found = run.sensitivity("moment_amplitude", other).final_state[0, 0]
    assert found == pytest.approx(1.0 - np.cos(1e5), abs=1e-9)


@pytest.mark.parametrize("omega", [0.0, 0.01])
def test_a_strong_damping_under_a_slow_drive(omega):
    """After a long time a body rests where the load lets it: x1 = M/w^2."""
    slow = UNDAMPED.replace(
        frequency_ratio=2.0,
        pendulum_damping=1000.0,
        drive_frequency=omega,
        moment_amplitude=0.0,
        static_moment=0.3,
    )
    run = vi.simulate(slow, initial=(0, 0, 0, 0), time=7e4)
    found = run.sensitivity("static_moment", "frequency_ratio", "pendulum_damping")
    assert np.abs(found.final_state[0] - [0.25, -2.0 * 0.3 / 8.0, 0.0]).max() < 1e-12

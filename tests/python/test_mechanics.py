"""The mechanics of a System against the equations of motion and against simulated motions."""

import numpy as np
import pytest

import vibroimpact as vi
from vibroimpact.mechanics import Mechanics

PARAMETERS = {
    "mass_ratio": 0.6,
    "frequency_ratio": 1.7,
    "restitution": 0.8,
    "gap": 0.4,
    "drive_frequency": 1.25,
    "pendulum_damping": 0.2,
    "oscillator_damping": 0.05,
    "moment_amplitude": 0.7,
    "force_amplitude": -0.3,
    "static_moment": 0.4,
    "static_force": -0.2,
    "phase": 0.9,
}
STATES = np.array([[0.9, -1.3, 0.2, 0.5], [-2.0, 0.4, -0.1, 0.0], [0.0, 0.0, 0.0, 1.0]])


@pytest.fixture(params=["oblique", "direct"])
def system(request):
    return vi.System(**PARAMETERS, contact=request.param)


def test_the_mechanics_are_those_of_a_system():
    with pytest.raises(TypeError, match=r"abstract methods .*_starts"):
        Mechanics()


def test_tip_and_slope(system):
    x1 = np.linspace(-7.0, 7.0, 30).reshape(2, 3, 5)
    oblique = system.contact == "oblique"
    np.testing.assert_allclose(system.tip(x1), np.sin(x1) if oblique else x1, rtol=1e-15, atol=0)
    wanted = np.cos(x1) if oblique else np.ones_like(x1)
    np.testing.assert_allclose(system.slope(x1), wanted, rtol=1e-15, atol=0)
    assert system.tip(0.5).shape == system.slope(0.5).shape == ()
    assert np.isnan(system.tip(np.nan))


def test_states_by_themselves_and_together(system):
    phases = np.array([0.1, 0.2, 0.3])
    for method in (system.gap_function, system.gap_rate):
        assert [method(state) for state in STATES] == method(STATES).tolist()
    for method in (system.gap_acceleration, system.accelerations):
        rows = [method(state, phase) for state, phase in zip(STATES, phases, strict=True)]
        np.testing.assert_array_equal(rows, method(STATES, phases))
        np.testing.assert_array_equal(method(STATES, 0.1)[0], rows[0])


def test_the_gap_changes_along_a_free_flight_as_its_derivatives_say(system):
    h, omega = 1e-4, system.drive_frequency
    for state in STATES:
        times = np.array([0.3 - h, 0.3, 0.3 + h])
        motion = system.free_flight(state, times)
        gap, rate = system.gap_function(motion), system.gap_rate(motion)
        assert rate[1] == pytest.approx((gap[2] - gap[0]) / (2 * h), abs=1e-6)
        phase = omega * times[1] + system.phase
        second = system.gap_acceleration(motion[1], phase)
        assert second == pytest.approx((rate[2] - rate[0]) / (2 * h), abs=1e-6)
        change = (motion[2] - motion[0]) / (2 * h)
        assert system.accelerations(motion[1], phase) == pytest.approx(change[[1, 3]], abs=1e-6)


def test_a_free_flight_is_a_run_that_never_strikes(system):
    apart = system.replace(gap=1e3)
    run = vi.simulate(apart, initial=STATES[0].tolist(), time=40.0)
    times = np.linspace(0.0, 40.0, 9)
    flown = system.free_flight(STATES[0], times)
    np.testing.assert_allclose(flown, run.trajectory(times), rtol=0, atol=1e-14)
    # From a later phase it is the rest of the same flight.
    phase = system.drive_frequency * times[3] + system.phase
    rest = system.free_flight(flown[3], times[3:] - times[3], phase=phase)
    np.testing.assert_allclose(rest, flown[3:], rtol=0, atol=1e-13)
    assert system.free_flight(STATES[0], []).shape == (0, 4)


def test_at_impacts_of_a_run_the_bodies_touch_and_approach():
    system = vi.System(**PARAMETERS)
    impacts = vi.simulate(system, initial=(0.0, 0.0, 0.0, 0.0), periods=20).impacts
    assert len(impacts) > 3
    before = np.column_stack([impacts[name] for name in ("x1", "v1_pre", "x2", "v2_pre")])
    assert np.abs(system.gap_function(before)).max() < 1e-15
    after = np.column_stack([impacts[name] for name in ("x1", "v1_post", "x2", "v2_post")])
    approach = system.gap_rate(before)
    assert approach.min() > 0.0
    np.testing.assert_allclose(system.gap_rate(after), -0.8 * approach, rtol=0, atol=1e-14)


def test_walls_and_rotors():
    system = vi.System(**PARAMETERS)
    assert not system.is_wall
    assert system.replace(mass_ratio=0.0).is_wall
    rotor = system.replace(frequency_ratio=0.0)
    assert rotor.is_rotor
    assert not system.is_rotor
    assert not rotor.replace(contact="direct").is_rotor


@pytest.mark.parametrize(
    ("call", "error"),
    [
        (lambda s: s.tip("a"), vi.ParameterError),
        (lambda s: s.slope([True]), vi.ParameterError),
        (lambda s: s.gap_function([1.0, 2.0]), vi.StateError),
        (lambda s: s.gap_rate([0.0, 0.0, 0.0, np.nan]), vi.StateError),
        (lambda s: s.accelerations(STATES, [0.0, 1.0]), vi.ParameterError),
        (lambda s: s.gap_acceleration(STATES, np.inf), vi.ParameterError),
        (lambda s: s.free_flight(STATES, [0.0]), vi.StateError),
        (lambda s: s.free_flight(STATES[0], [0.0, -1.0]), vi.ParameterError),
        (lambda s: s.free_flight(STATES[0], 1.0), vi.ParameterError),
        (lambda s: s.free_flight(STATES[0], [1.0], phase=np.nan), vi.ParameterError),
    ],
)
def test_bad_input_is_refused(system, call, error):
    with pytest.raises(error, match="not allowed"):
        call(system)

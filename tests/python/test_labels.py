"""Labels of runs whose sections seem to draw together."""

import pytest

import vibroimpact as vi

# Undamped; damped; with friction.
TORI = {
    "two masses in resonance": (
        vi.System(
            mass_ratio=1.908458080769043,
            frequency_ratio=2.3961498068657536,
            restitution=0.5284020941066664,
            gap=0.4359081611551485,
            drive_frequency=1.1628250682736414,
            moment_amplitude=0.4649741606095511,
            force_amplitude=0.28909376592106173,
        ),
        (0, 0.3, 0, 0),
    ),
    "Fig. 7(a)": (
        vi.System(
            mass_ratio=0.6,
            frequency_ratio=2.0,
            restitution=0.8,
            gap=0.5,
            drive_frequency=0.9772943235808953,
            damping=(0.01, 0.01),
            moment_amplitude=1.0,
            force_amplitude=0.5,
        ),
        (0, 0.5, 0, 0),
    ),
    "Fig. 8(a)": (
        vi.System(
            mass_ratio=0.6,
            frequency_ratio=2.0,
            restitution=0.8,
            gap=0.5,
            drive_frequency=1.2253063265816453,
            moment_amplitude=1.0,
            friction=0.5,
        ),
        (0, 0.5, 0, 0),
    ),
}


@pytest.mark.parametrize("name", TORI)
def test_a_torus_that_is_passed_through_for_long_is_no_convergence(name):
    """In a window of many hundred periods its sections seem to draw together, once."""
    system, start = TORI[name]
    for periods, keep in ((600, 100), (20_600, 2_000)):
        assert vi.simulate(system, initial=start, periods=periods, keep=keep).label == (
            "quasi-periodic"
        )


def test_a_motion_that_alternates_about_its_orbit_has_no_double_period():
    """Fig. 8(b): a 1-1 motion with the multiplier -0.9998."""
    system = TORI["Fig. 7(a)"][0].replace(drive_frequency=2.337084271067767, friction=0.4)
    for periods, keep in ((600, 100), (20_000, 2_000)):
        run = vi.simulate(system, initial=(0, 0.5, 0, 0), periods=periods, keep=keep)
        assert run.label == "1-1"

"""A structure that comes to rest on its stops for ever says so, as the pendulum does."""

import numpy as np
import pytest

import vibroimpact as vi


def fallen(*, load=1.0, drive=0.0, amplitude=0.0, friction=0.0, stiffness=0.0):
    """A mass that falls on a stop, beside another one on a spring that nothing moves."""
    stop = vi.Stop(
        [1.0, 0.0],
        0.0,
        0.5,
        friction=friction,
        tangent=[0.0, 1.0] if friction else None,
        amplitude=amplitude,
    )
    stops = [stop, *([] if friction else [vi.Stop([0.0, 1.0], 0.0, 0.0)])]
    return vi.Structure(
        np.eye(2),
        np.diag([stiffness, stiffness]),
        stops,
        static_load=[load, 0.1],
        drive_amplitude=[drive, 0.0],
        drive_frequency=1.0,
    )


START = np.array([[-0.5, -0.2], [0.0, 0.0]])


@pytest.mark.parametrize(
    "held",
    [fallen(), fallen(drive=0.9), fallen(friction=0.5), fallen(stiffness=0.3)],
    ids=["load", "drive", "stick", "spring"],
)
def test_held_for_ever_by_every_phase_of_the_drive(held):
    run = vi.simulate(held, initial=START, periods=40)
    assert run.stop_reason == "rest"
    assert (run.final_state.period, run.final_state.time_in_period) == (40, 0.0)
    assert not run.final_state.v.any()
    further = run.resume(periods=200)
    assert further.stop_reason == "rest"
    assert (further.final_state.q == run.final_state.q).all()
    assert further.impact_count == run.impact_count


@pytest.mark.parametrize(
    "loose",
    [fallen(drive=1.1), fallen(amplitude=0.3), fallen(friction=0.05)],
    ids=["the drive lifts it", "the stop moves", "it slides"],
)
def test_what_moves_or_opens_again_is_not_at_rest(loose):
    assert vi.simulate(loose, initial=START, periods=40).stop_reason == "completed"


def test_without_a_drive_as_the_ball_on_a_table():
    ball = vi.System(
        mass_ratio=0,
        frequency_ratio=0,
        restitution=0.5,
        gap=0,
        drive_frequency=0,
        static_moment=1,
        contact="direct",
    )
    same = vi.Structure([[1]], [[0]], [vi.Stop([1], 0, 0.5)], static_load=[1])
    of_ball = vi.simulate(ball, initial=(-1, 0, 0, 0), time=40)
    of_structure = vi.simulate(same, initial=[[-1], [0]], time=40)
    assert of_structure.stop_reason == of_ball.stop_reason == "rest"
    assert of_structure.final_state.time == 40.0


def test_a_low_bounce_that_ends_as_another_stop_comes_to_rest():
    """Four stops in a corner, chatter of chatter: one at rest takes the approach to another."""
    mass = [
        [1.0146, 0.1726, 0.2149, -0.1419],
        [0.1726, 2.2209, -0.7331, -0.3017],
        [0.2149, -0.7331, 1.0033, 0.1045],
        [-0.1419, -0.3017, 0.1045, 0.7595],
    ]
    normals = [
        [1.0421, -0.1215, 0.3922, -0.0185],
        [0.1113, 0.7069, 0.2427, -0.1233],
        [0.1336, -0.225, 1.0466, 0.0349],
        [-0.376, 0.0007, 0.0682, 0.8936],
    ]
    corner = vi.Structure(
        mass,
        np.zeros((4, 4)),
        [vi.Stop(normal, 0.0, 0.5) for normal in normals],
        static_load=[2.5159, 0.8859, 2.91, 0.4664],
        simultaneous="together",
    )
    start = [[-0.4006, -0.6752, -0.6436, -0.2154], [0.6655, 0.3169, 0.2049, 0.5503]]
    run = vi.simulate(corner, initial=start, time=30, max_events=200_000)
    assert run.stop_reason in ("completed", "rest")
    # Such a bounce is told, without an impulse.
    low = run.impacts[run.impacts["impulse_normal"] == 0.0]
    assert len(low) > 0
    assert not low["approach_velocity"].any()
    assert np.abs(normals @ run.final_state.q).max() < 1e-15
    audit = run.energy_audit()
    assert abs(audit.residual) < 1e-12 * audit.total

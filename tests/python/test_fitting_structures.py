"""Records of structures, and structures found from records."""

import numpy as np
import pytest

import vibroimpact as vi
from struck import BEAM, PRESSED, REST

# Three masses on springs between two walls; the third meets a stop, the first another one.
MASSES = vi.Structure(
    np.diag([1.0, 2.0, 1.5]),
    [[3.0, -1.0, 0.0], [-1.0, 2.0, -1.0], [0.0, -1.0, 2.0]],
    [vi.Stop([0, 0, 1], 0.3, 0.7), vi.Stop([-1, 0, 0], 0.4, 0.8)],
    damping_ratios=[0.02, 0.03, 0.04],
    static_load=[0.0, 0.1, 0.0],
    drive_amplitude=[1.0, 0.0, 0.5j],
    drive_frequency=1.1,
    phase=0.4,
)
RUN = vi.simulate(MASSES, initial=REST[3], periods=20)


def apart(run: vi.StructureRun) -> np.ndarray:
    """Times of a run in flight, not at impacts."""
    times = np.linspace(0.05, run.final_state.time - 0.05, 300)
    times = times[np.abs(times[:, None] - run.impacts["time"]).min(axis=1) > 1e-3]
    return times[(run.trajectory(times, forces=True)[1] == 0.0).all(axis=(1, 2))]


def test_coordinates_and_velocities_are_those_of_the_run():
    at = [0.5, 1.5, 20.0]
    states = RUN.trajectory(at)
    for row, part in enumerate("qv"):
        for k in range(3):
            assert np.array_equal(vi.measure(RUN, f"{part}_{k}", at=at).values, states[:, row, k])


@pytest.mark.parametrize("system", [MASSES, MASSES.replace(damping=np.diag([0.1, 0.2, 0.3])), BEAM])
def test_accelerations_are_rates_of_the_velocities(system):
    run = vi.simulate(system, initial=REST[3], periods=12)
    times, step = apart(run), 1e-4
    for k in range(3):
        measured = vi.measure(run, f"a_{k}", at=times).values
        ends = [run.trajectory(times + sign * step)[:, 1, k] for sign in (-1.0, 1.0)]
        assert measured == pytest.approx((ends[1] - ends[0]) / (2 * step), abs=1e-6)


def test_acceleration_at_a_closed_stop_is_that_of_the_motion():
    run = vi.simulate(PRESSED, initial=REST[2], periods=12)
    inside = np.linspace(0.01, run.final_state.time - 0.01, 400)
    held = inside[run.trajectory(inside, forces=True)[1][:, 0, 0] > 0.0]
    assert len(held) > 20
    # The mass at the stop does not move along its normal.
    assert np.median(np.abs(vi.measure(run, "a_0", at=held).values)) < 1e-9


def test_impacts_are_heard_at_all_stops_or_at_one():
    stops = RUN.impacts["stop"]
    assert {*stops.tolist()} == {0, 1}
    assert np.array_equal(vi.measure(RUN, "impact_times").times, RUN.impacts["time"])
    for stop in (0, 1):
        heard = vi.measure(RUN, f"impact_times_{stop}").times
        assert np.array_equal(heard, RUN.impacts["time"][stops == stop])


def test_what_a_structure_does_not_have_is_named():
    with pytest.raises(vi.ParameterError, match=r"q_7.*did you mean.*q_0, q_1, q_2"):
        vi.measure(RUN, "q_7", sampling=0.1)
    with pytest.raises(vi.ParameterError, match="impact_times_2"):
        vi.measure(RUN, "impact_times_2")
    with pytest.raises(vi.ParameterError, match="x1"):
        vi.measure(RUN, "x1", sampling=0.1)
    many = vi.Structure(np.eye(20), np.eye(20), [vi.Stop(np.eye(20)[0], 1.0, 0.8)])
    run = vi.simulate(many, initial=np.zeros((2, 20)), time=1)
    with pytest.raises(vi.ParameterError, match=r"q_0 \.\.\. q_19, v_0 \.\.\. v_19"):
        vi.measure(run, "q_20", sampling=0.1)


def test_a_beam_whose_modes_its_points_do_not_tell_has_no_accelerations():
    one = vi.Structure.from_modes(
        [1.0, 3.0], [[1.0, 1.0]], [vi.Stop([1], 0.3, 0.8)], drive_amplitude=[1], drive_frequency=1.3
    )
    run = vi.simulate(one, initial=np.zeros((2, 1)), periods=3)
    vi.measure(run, "q_0", sampling=0.1)
    with pytest.raises(vi.StateError, match=r"^1 coordinates do not determine 2 modes"):
        vi.measure(run, "a_0", sampling=0.1)

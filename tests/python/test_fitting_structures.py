"""Records of structures, and structures found from records."""

import numpy as np
import pytest
from matplotlib import pyplot

import vibroimpact as vi
from struck import BEAM, MOVING, PRESSED, REST

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


def test_coordinates_that_cannot_change_alone_are_no_unknowns():
    run = vi.simulate(BEAM, initial=np.zeros((2, 3)), periods=5)
    record = vi.measure(run, "q_0", sampling=0.1, noise=1e-3)
    said = "is not allowed; allowed: a coordinate of the start that can change alone; of a struct"
    for unknown, named in (("v_0", "v_0"), ("start", "q_0")):
        with pytest.raises(vi.ParameterError, match=f"^unknown = '{named}' {said}"):
            vi.fit(record, BEAM, unknown=["gap", unknown], initial=run.initial)
        with pytest.raises(vi.ParameterError, match=f"^unknown = '{named}' {said}"):
            vi.expected_errors(run, record, unknown=[unknown])


@pytest.mark.parametrize(
    ("initial", "said"),
    [
        ([0, 1, 2], r"initial of shape \(3,\) .* one start, rows q and v of shape \(2, 3\)$"),
        (np.zeros((5, 2, 3)), r"initial of shape \(5, 2, 3\) .* one start, rows q and v"),
        (np.zeros((3, 2)), r"initial of shape \(3, 2\) .* did you mean its transpose\?$"),
    ],
)
def test_another_start_than_one_is_refused(initial, said):
    record = vi.measure(RUN, "q_0", sampling=0.1, noise=1e-3)
    with pytest.raises(vi.StateError, match=f"^{said}"):
        vi.fit(record, MASSES, unknown=["gap"], initial=initial)


def chain(k=1.0, r=0.7, gap=0.3) -> vi.Structure:
    """The same with a spring between the first two, and the stop of the third."""
    return vi.Structure(
        np.diag([1.0, 2.0, 1.5]),
        [[2.0 + k, -k, 0.0], [-k, 1.0 + k, -1.0], [0.0, -1.0, 2.0]],
        [vi.Stop([0, 0, 1], gap, r)],
        damping_ratios=[0.02, 0.03, 0.04],
        drive_amplitude=[2.0, 0.0, 2.5],
        drive_frequency=1.1,
        phase=0.4,
    )


TRUE = {"k": 1.3, "r": 0.8, "gap": 0.25}
CHAIN = chain(**TRUE)
STRUCK = vi.simulate(CHAIN, initial=REST[3], periods=15)


def measured(kind: str, noise: float, seed: int = 2) -> vi.Record:
    """What is measured of the chain, with an error of part of its size."""
    if kind.startswith("impact_times"):
        return vi.measure(STRUCK, kind, noise=noise, seed=seed)
    exact = vi.measure(STRUCK, kind, sampling=0.2)
    return vi.measure(
        STRUCK, kind, sampling=0.2, noise=noise * float(exact.values.std()), seed=seed
    )


@pytest.mark.parametrize("kind", ["impact_times", "impact_times_0", "q_2", "v_0", "a_2"])
def test_numbers_of_a_function_are_found(kind):
    found = vi.fit(measured(kind, 0.01), chain, unknown=["k", "r", "gap"], initial=REST[3])
    assert found.verdict == "fits"
    off = [(found.values[name] - TRUE[name]) / found.errors[name] for name in TRUE]
    assert np.abs(off).max() < 4.0
    assert isinstance(found.machine, vi.Structure)
    assert found.machine == chain(**found.values)


def test_own_numbers_and_the_start_are_found():
    names = ["gap_0", "restitution_0", "q_0", "v_2"]
    guess = CHAIN.replace(gap=0.3, restitution=0.7)
    start = np.array([[0.05, 0.0, 0.0], [0.0, 0.0, 0.1]])
    found = vi.fit(measured("q_1", 0.01), guess, unknown=names, initial=start)
    assert found.verdict == "fits"
    off = found.estimates - [0.25, 0.8, 0.0, 0.0]
    assert np.abs(off / found.standard_errors).max() < 4.0
    assert np.shape(found.initial) == (2, 3)
    assert np.array_equal(found.run.impacts["stop"], STRUCK.impacts["stop"])


def test_drive_and_moving_stops_are_found_through_segments():
    moving = MOVING.replace(damping_ratios=[0.05])
    run = vi.simulate(moving, initial=REST[1], periods=25)
    record = vi.measure(run, "q_0", sampling=0.2, noise=1e-3, seed=1)
    guess = moving.replace(drive_frequency=0.702)
    found = vi.fit(record, guess, unknown=["drive_frequency", "restitution_1"], initial=REST[1])
    assert found.verdict == "fits"
    off = found.estimates - [0.7, 0.9]
    assert np.abs(off / found.standard_errors).max() < 4.0


def test_ranges_of_a_function_without_defaults():
    def one(k, r):
        return chain(k, r, 0.25)

    record = measured("q_2", 0.01)
    found = vi.fit(record, one, unknown={"k": (1, 2), "r": (0.6, 0.9)}, initial=REST[3])
    assert found.verdict == "fits"
    assert found.ranges.tolist() == [[1.0, 2.0], [0.6, 0.9]]
    with pytest.raises(vi.ParameterError, match=r"unknown\['k'\] = None .*a default"):
        vi.fit(record, one, unknown=["k", "r"], initial=REST[3])
    with pytest.raises(vi.ParameterError, match=r"gapp.*did you mean gap"):
        vi.fit(record, chain, unknown=["gapp"], initial=REST[3])
    with pytest.raises(vi.ParameterError, match="units"):
        vi.fit(record, chain, unknown=["gap"], initial=REST[3], units="SI")


def test_a_fit_of_a_structure_is_saved(tmp_path):
    found = vi.fit(measured("q_2", 0.01), chain, unknown=["k", "r", "gap"], initial=REST[3])
    assert [each.stops[0].gap for each in found.sample(2)] != [found.values["gap"]] * 2
    found.save(tmp_path / "fit.npz")
    again = vi.load(tmp_path / "fit.npz")
    assert again.summary() == found.summary()
    assert again.machine == found.machine
    assert again.initial == found.initial
    assert np.array_equal(again.ranges, found.ranges)
    with pytest.raises(vi.ParameterError, match="no file holds"):
        again.sample(2)
    own = vi.fit(measured("q_2", 0.01), CHAIN, unknown=["gap_0", "v_0"], initial=REST[3])
    own.save(tmp_path / "fit.npz")
    assert vi.load(tmp_path / "fit.npz").sample(2) == own.sample(2)


def test_expected_errors_of_a_structure_are_those_of_a_fit():
    record = measured("q_2", 0.01)
    names = ["gap_0", "restitution_0"]
    expected = vi.expected_errors(STRUCK, record, unknown=names)
    found = vi.fit(record, CHAIN, unknown=names, initial=REST[3])
    assert expected.standard_errors == pytest.approx(found.standard_errors, rel=0.05)


def test_expected_errors_of_numbers_of_a_function():
    def at_truth(k=TRUE["k"], r=TRUE["r"], gap=TRUE["gap"]):
        return chain(k, r, gap)

    record = measured("q_2", 0.01)
    names = ["k", "r", "gap"]
    expected = vi.expected_errors(STRUCK, record, unknown=names, system=at_truth)
    found = vi.fit(record, chain, unknown=names, initial=REST[3])
    assert expected.standard_errors == pytest.approx(found.standard_errors, rel=0.05)
    assert expected.values == TRUE
    with pytest.raises(vi.ParameterError, match="defaults make the machine of the run"):
        vi.expected_errors(STRUCK, record, unknown=names, system=chain)


def test_a_fit_of_a_structure_is_drawn():
    found = vi.fit(measured("a_2", 0.01), CHAIN, unknown=["gap_0"], initial=REST[3])
    top, bottom = found.plot()
    assert top.get_ylabel() == r"acceleration $\ddot q_{2}$"
    assert bottom.get_xlabel() == "time $t$"
    pyplot.close(top.figure)


def test_no_friction_at_a_stop_is_found():
    def rubbing(friction):
        stop = vi.Stop([1, 0], 0.1, 0.6, friction=friction, tangent=[-0.3, 1])
        return vi.Structure(
            np.diag([1, 1.3]),
            [[4, -2], [-2, 3]],
            [stop],
            damping=0.04 * np.eye(2),
            static_load=[0.3, 0.3],
            drive_amplitude=[1.5, 0.5],
            drive_frequency=1.3,
        )

    initial = [[0, 0], [0.4, 0.3]]
    run = vi.simulate(rubbing(0), initial=initial, time=40)
    record = vi.measure(run, "q_1", sampling=0.1, noise=0.01, seed=1)
    for limits in (None, (0, 1)):
        found = vi.fit(record, rubbing(0.1), unknown={"friction": limits}, initial=initial)
        assert found.values["friction"] < 3 * found.errors["friction"] < 0.01
    with pytest.raises(vi.ParameterError, match="friction = 0"):
        vi.fit(record, rubbing(0), unknown=["friction"], initial=initial)

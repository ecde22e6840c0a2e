"""Records: what is refused names the row; simulated measurements are what they say."""

import numpy as np
import pytest

import vibroimpact as vi
from small_results import START
from systems import PAPER

RUN = vi.simulate(PAPER, initial=START, periods=20)
HEARD = vi.measure(RUN, "impact_times", noise=0.01, seed=3)


@pytest.mark.parametrize(
    ("times", "values", "sigma", "said"),
    [
        ([], [], None, r"times = \[\] .*at least one row"),
        ([0.0, 2.0, 1.0], [0, 0, 0], None, r"times\[2\] = 1.0 .*more than times\[1\] = 2.0"),
        ([0.0, 1.0, 1.0], [0, 0, 0], None, r"times\[2\] = 1.0"),
        ([-0.5, 1.0], [0, 0], None, r"times\[0\] = -0.5"),
        ([0.0, np.nan], [0, 0], None, r"times\[1\] = nan"),
        ([0.0, 1.0], [0, np.inf], None, r"values\[1\] = inf"),
        ([0.0, 1.0], [0, 1e60], None, r"values\[1\] = 1e\+60"),
        ([0.0, 1.0], [0.0], None, r"values of shape \(1,\) .*allowed: 2 rows"),
        ([0.0, 1.0], None, None, "values = None"),
        ([0.0, 1.0], [0, 0], 0.0, "sigma = 0.0"),
        ([0.0, 1.0], [0, 0], [0.1, -0.1], r"sigma\[1\] = -0.1"),
        ([0.0, 1.0], [0, 0], [0.1], r"sigma of shape \(1,\)"),
        ("abc", [0, 0], None, "times"),
        ([[0.0, 1.0]], [0, 0], None, r"times of shape \(1, 2\)"),
    ],
)
def test_a_wrong_row_is_named(times, values, sigma, said):
    with pytest.raises(vi.ParameterError, match=said):
        vi.Record("x1", times, values, sigma=sigma)


def test_impact_times_have_no_values():
    with pytest.raises(vi.ParameterError, match="values"):
        vi.Record("impact_times", [1.0, 2.0], [0.0, 0.0])


FILES = {
    "": "no line of column names",
    "time,x1\n": "no rows",
    "0.0,0.1\n0.1,0.2\n": "it has '0.0', '0.1'; a line of column names must come first",
    "t,x1\n0,1\n": "time = 'time' .*for the time; it has 't', 'x1'",
    "time,x1\n0,1\n\n# a remark\n1,two\n": "line 5: 'two' in column 'x1'",
    "time,x1\n0,1\n1,\n": "line 3: an empty cell in column 'x1'",
    "time,x1\n0,1\n1\n": "line 3: an empty cell",
    "time,x1\n0,1\n2,1\n1,1\n": "line 4: times = 1.0 .*more than .*line 3: times = 2.0",
    "time,x1\n0,1\n1,nan\n": "line 3: values = nan",
    "time,x1\n0,10,1,25\n1,20,1,31\n": "line 2: 4 cells, but 2 column names; .*decimal comma",
    "time;x1\n0;1\n": "time = 'time' .* is delimiter=';' meant",
    "time\tx1\n0\t1\n": r"is delimiter='\\t' meant",
    'time,x1\n"0,5",1\n': "line 2: '0,5' in column 'time'; allowed: .*not a comma",
}


@pytest.mark.parametrize("text", FILES)
def test_a_wrong_line_of_a_file_is_named(text, tmp_path):
    path = tmp_path / "rig.csv"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(vi.ParameterError, match=FILES[text]):
        vi.Record.from_csv(path, "x1")


@pytest.mark.parametrize("code", ["utf-16", "utf-16-le", "utf-16-be"])
def test_a_file_in_another_encoding_is_told(code, tmp_path):
    path = tmp_path / "rig.csv"
    path.write_text("# a rig\ntime,x1\n0,1\n1,2\n", encoding=code)
    with pytest.raises(vi.ParameterError, match=r"^path = .*: text, in UTF-8; .* as CSV UTF-8$"):
        vi.Record.from_csv(path, "x1")


def test_a_column_whose_name_is_in_another_encoding_is_told(tmp_path):
    path = tmp_path / "rig.csv"
    path.write_text("time,größe\n0,1\n1,2\n", encoding="latin-1")
    with pytest.raises(vi.ParameterError, match=r"^value = 'größe' .*not in UTF-8: save it"):
        vi.Record.from_csv(path, "x1", value="größe")
    # Its other columns can be read.
    assert vi.Record.from_csv(path, "impact_times").times.tolist() == [0.0, 1.0]


def test_records_are_compared_by_what_they_hold():
    one, same = (vi.Record("x1", [0.0, 1.0], [0.1, 0.2], sigma=0.1) for _ in range(2))
    assert one == same
    assert hash(one) == hash(same)
    others = [
        vi.Record("v1", [0.0, 1.0], [0.1, 0.2], sigma=0.1),
        vi.Record("x1", [0.0, 1.5], [0.1, 0.2], sigma=0.1),
        vi.Record("x1", [0.0, 1.0], [0.1, 0.3], sigma=0.1),
        vi.Record("x1", [0.0, 1.0], [0.1, 0.2], sigma=0.2),
        vi.Record("x1", [0.0, 1.0], [0.1, 0.2]),
        vi.Record("x1", [0.0, 1.0], [0.1, 0.2], sigma=0.1, name="laser"),
        "x1",
    ]
    assert all(one != other for other in others)


def test_empty_cells_after_the_last_column_are_no_matter(tmp_path):
    path = tmp_path / "rig.csv"
    path.write_text("time,x1\n0,1,\n1,2,,\n", encoding="utf-8")
    assert vi.Record.from_csv(path, "x1").values.tolist() == [1.0, 2.0]


def test_a_file_is_read(tmp_path):
    path = tmp_path / "rig.csv"
    path.write_text("# a rig\nt; angle; error\n0;0.5;0.1\n1;;0.1\n2;0.25;0.2\n", encoding="utf-8")
    record = vi.Record.from_csv(
        path, "x1", time="t", value="angle", sigma="error", delimiter=";", skip_empty=True
    )
    assert record.times.tolist() == [0.0, 2.0]
    assert record.values.tolist() == [0.5, 0.25]
    assert record.sigma.tolist() == [0.1, 0.2]


def test_a_measurement_without_errors_is_the_run():
    heard = vi.measure(RUN, "impact_times")
    assert np.array_equal(heard.times, RUN.impacts["time"])
    assert heard.sigma is None
    at = [0.5, 1.5, 20.0]
    states = RUN.trajectory(at)
    for column, kind in enumerate(("x1", "v1", "x2", "v2")):
        assert np.array_equal(vi.measure(RUN, kind, at=at).values, states[:, column])
    phases = PAPER.phase + PAPER.drive_frequency * np.array(at)
    free = PAPER.accelerations(states, phases)
    for column, kind in enumerate(("a1", "a2")):
        assert vi.measure(RUN, kind, at=at).values == pytest.approx(free[:, column], abs=1e-14)


def test_noise_has_the_stated_size():
    exact = vi.measure(RUN, "x1", sampling=0.02)
    noisy = vi.measure(RUN, "x1", sampling=0.02, noise=0.01, seed=1)
    off = noisy.values - exact.values
    assert np.std(off) == pytest.approx(0.01, rel=0.05)
    jittered = vi.measure(RUN, "x1", sampling=0.02, jitter=1e-3, seed=1)
    z = (jittered.values - exact.values) / jittered.sigma
    # Some rows lie beside an impact, where x1 has a kink.
    assert np.std(z[np.abs(z) < 6.0]) == pytest.approx(1.0, rel=0.1)


@pytest.mark.parametrize("kind", ["x1", "v1", "v2", "a1"])
def test_errors_of_instants_beside_impacts_are_in_sigma(kind):
    exact = vi.measure(RUN, kind, sampling=0.02)
    for seed in range(5):
        jittered = vi.measure(RUN, kind, sampling=0.02, jitter=0.01, seed=seed)
        z = (jittered.values - exact.values) / jittered.sigma
        assert np.abs(z).max() < 6.0
        assert z[np.abs(z) < 3.0].std() == pytest.approx(1.0, rel=0.1)


def test_a_measurement_of_a_run_that_forgot_its_start_is_refused():
    late = vi.simulate(PAPER, initial=START, periods=20, keep=5)
    with pytest.raises(vi.ParameterError, match="from t = 0"):
        vi.measure(late, "impact_times")


def test_acceleration_in_contact_is_that_of_the_motion():
    sticky = PAPER.replace(
        drive_frequency=0.25, restitution=0.3, damping=(0.1, 0.1), moment_amplitude=3.0
    )
    run = vi.simulate(sticky, initial=START, periods=3)
    assert run.time_in_contact > 0.0
    kinds = run.contacts["kind"] == vi.EventKind.SLIDE_POSITIVE
    begins = run.contacts["time"][kinds]
    times = begins + 0.05
    held = run.trajectory(times, forces=True)[:, 4] > 0.0
    assert held.any()
    measured = vi.measure(run, "a1", at=times[held]).values
    h = 1e-4
    ends = [run.trajectory(times[held] + k * h)[:, 1] for k in (-1, 1)]
    assert measured == pytest.approx((ends[1] - ends[0]) / (2 * h), abs=1e-5)


CHATTERING = PAPER.replace(
    restitution=0.5, gap=0.3, drive_frequency=0.35, moment_amplitude=2, friction=0.1,
    damping=(0.1, 0.1),
)  # fmt: skip


def test_rows_that_are_nearer_than_the_resolution_are_left_out():
    record = vi.Record("impact_times", [1.0, 2.0, 2.05, 2.06, 4.0], sigma=0.01, resolution=0.1)
    assert record.times.tolist() == [1.0, 2.0, 4.0]
    assert len(record.sigma) == 3
    with pytest.raises(vi.ParameterError, match=r"resolution = 0.1 .*None but for impact times"):
        vi.Record("x1", [0.0, 1.0], [0.0, 1.0], resolution=0.1)
    with pytest.raises(vi.ParameterError, match=r"resolution = 0.0"):
        vi.Record("impact_times", [1.0], resolution=0.0)
    with pytest.raises(vi.ParameterError, match="resolution"):
        vi.measure(RUN, "x1", sampling=0.1, resolution=0.1)


@pytest.mark.parametrize(("noise", "resolution"), [(1e-3, 0.02), (1e-3, 0.1), (1e-2, 0.05)])
def test_chatter_is_fitted_as_far_as_it_is_heard(noise, resolution, tmp_path):
    run = vi.simulate(CHATTERING, initial=START, periods=6)
    assert run.label == "1-inf"
    heard = vi.measure(run, "impact_times", noise=noise, resolution=resolution, seed=3)
    assert len(heard) < len(run.impacts)
    guess = CHATTERING.replace(restitution=0.55, gap=0.32)
    options = {"unknown": ["restitution", "gap"], "initial": START}
    found = vi.fit(heard, guess, **options)
    assert found.verdict == "fits"
    off = (found.estimates - [0.5, 0.3]) / found.standard_errors
    assert np.abs(off).max() < 4.0
    found.save(tmp_path / "fit.npz")
    assert vi.load(tmp_path / "fit.npz").records[0].resolution == resolution
    # Where it is said that all impacts are heard, those at the end of the chatter are missed.
    all_of_them = vi.Record("impact_times", heard.times, sigma=noise)
    other = vi.fit(all_of_them, guess, **options, starts=1)
    assert "not in the record" in other.summary()

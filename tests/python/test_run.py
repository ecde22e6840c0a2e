"""The Run: trajectory, label, resumption, files and pickles, all bit for bit."""

import json
import pickle
import sys

import numpy as np
import pytest

import vibroimpact as vi
from comparing import ARRAYS, assert_same_bits


@pytest.fixture
def run(system, initial) -> vi.Run:
    return vi.simulate(system, initial=initial, periods=40, keep=30)


def test_arrays_are_cached_and_read_only(run):
    for name in ARRAYS:
        array = getattr(run, name)
        assert getattr(run, name) is array
        with pytest.raises(ValueError, match="read-only"):
            array[...] = array
    with pytest.raises(AttributeError):
        run.label = "1-1"
    with pytest.raises(AttributeError):
        run.system = None


def test_trajectory_passes_through_sections_and_impacts(run, system):
    times = np.arange(11, 41) * system.drive_period
    states = run.trajectory(times)
    assert states.shape == (30, 4)
    np.testing.assert_allclose(states, run.stroboscopic, rtol=0.0, atol=1e-11)
    impacts = run.impacts
    after = run.trajectory(impacts["time"])
    columns = ("x1", "v1_post", "x2", "v2_post")
    expected = np.column_stack([impacts[name] for name in columns])
    # Right-continuous; a time is known to an ulp only.
    np.testing.assert_allclose(after, expected, rtol=0.0, atol=1e-11)


def test_trajectory_takes_times_in_any_order(run):
    times = np.linspace(run.kept_from, run.final_state.time, 500)[1:]
    shuffled = np.random.default_rng(1).permutation(times)
    order = np.argsort(shuffled)
    assert run.trajectory(shuffled)[order].tobytes() == run.trajectory(times).tobytes()
    assert run.trajectory([]).shape == (0, 4)
    assert run.trajectory(times[:3].tolist()).tobytes() == run.trajectory(times[:3]).tobytes()


def test_trajectory_never_penetrates(run, system):
    times = np.linspace(run.kept_from, run.final_state.time, 20_000)[1:]
    x1, _, x2, _ = run.trajectory(times).T
    assert (np.sin(x1) - x2 - system.gap).max() < 1e-12


@pytest.mark.parametrize("forces", [False, True])
def test_a_time_outside_the_kept_window_is_named_with_the_window(run, forces):
    first, last = run.kept_from, run.final_state.time
    assert len(run.trajectory([first, last], forces=forces)) == 2
    for outside in (np.nextafter(first, 0.0), np.nextafter(last, np.inf), 0.0, -1e300):
        message = f"t[1] = {float(outside)!r} is not allowed; allowed: times in the kept window, "
        with pytest.raises(vi.ParameterError) as caught:
            run.trajectory([last, outside, first, -1.0], forces=forces)
        assert str(caught.value) == f"{message}{first!r} to {last!r}"


@pytest.mark.parametrize("times", [[np.nan], [[1.0]], ["now"], 1.0])
def test_times_of_a_trajectory_are_a_row_of_finite_numbers(run, times):
    with pytest.raises(vi.ParameterError, match=r"^t(\[0\])? "):
        run.trajectory(times)


def test_resume_is_one_long_run_bit_for_bit(system, initial):
    long = vi.simulate(system, initial=initial, periods=60, keep=20)
    short = vi.simulate(system, initial=initial, periods=25, keep=5)
    assert_same_bits(short.resume(periods=35, keep=20), long)
    steps = short
    for periods in (1, 14, 20):
        steps = steps.resume(periods=periods, keep=min(periods, 20))
    assert_same_bits(steps, long)
    assert steps.system == system
    assert steps.initial == initial


def test_a_resumed_run_knows_its_own_window(system, initial):
    whole = vi.simulate(system, initial=initial, periods=30)
    for periods in np.linspace(3.0, 20.0, 35):
        first = vi.simulate(system, initial=initial, time=periods * system.drive_period)
        more = first.resume(time=2.0 * system.drive_period)
        times = np.linspace(more.kept_from, more.final_state.time, 200)
        error = np.abs(more.trajectory(times) - whole.trajectory(times))
        assert error.max() < 1e-11, periods


def test_resume_after_a_stop_amid_a_period(system, initial):
    short = vi.simulate(system, initial=initial, time=7.3 * system.drive_period)
    long = vi.simulate(system, initial=initial, periods=12, keep=2)
    assert_same_bits(short.resume(periods=5, keep=2), long)


def test_resume_leaves_the_first_run_alone(run):
    before = pickle.dumps(run)
    run.resume(periods=3)
    assert pickle.dumps(run) == before


def test_resume_checks_its_arguments(run):
    for arguments in ({}, {"periods": 1, "time": 1.0}, {"periods": -1}, {"periods": 2, "keep": 3}):
        with pytest.raises(vi.ParameterError):
            run.resume(**arguments)


@pytest.mark.parametrize("reader", [vi.load, vi.Run.load])
def test_files_bring_a_run_back_bit_for_bit(run, tmp_path, reader):
    path = tmp_path / "run"
    run.save(path)
    back = reader(path)
    assert type(back) is vi.Run
    assert_same_bits(back, run)
    assert back.system == run.system
    assert back.initial == run.initial
    assert back.period == run.period
    times = np.linspace(run.kept_from, run.final_state.time, 100)[1:]
    assert back.trajectory(times).tobytes() == run.trajectory(times).tobytes()
    assert_same_bits(back.resume(periods=20), run.resume(periods=20))
    with pytest.raises(ValueError, match="read-only"):
        back.impacts["x1"] = 0.0


def test_equal_runs_have_the_same_numbers(run, system, initial, tmp_path):
    again = vi.simulate(system, initial=initial, periods=40, keep=30)
    run.save(tmp_path / "run.npz")
    for other in (again, pickle.loads(pickle.dumps(run)), vi.Run.load(tmp_path / "run.npz")):
        assert other == run
        assert hash(other) == hash(run)
    closer = vi.simulate(system, initial=(0.0, np.nextafter(0.5, 1.0), 0.0, 0.0), periods=40)
    others = [
        vi.simulate(system, initial=initial, periods=40, keep=29),
        vi.simulate(system, initial=initial, periods=40, keep=30, section_phase=0.1),
        run.resume(periods=1),
        closer,
        "a run",
    ]
    assert run not in others


def test_pickles_bring_a_run_back_bit_for_bit(run):
    back = pickle.loads(pickle.dumps(run))
    assert_same_bits(back, run)
    assert back.system == run.system
    assert_same_bits(back.resume(periods=20), run.resume(periods=20))


def test_a_file_is_open_to_plain_numpy(run, tmp_path):
    path = tmp_path / "run.npz"
    run.save(path)
    with np.load(path, allow_pickle=False) as archive:
        names = archive["impacts"].dtype.names
        # What follows from the other columns is not stored.
        assert {*run.impacts.dtype.names} - {*names} == {"approach_velocity"}
        for name in names:
            assert archive["impacts"][name].tobytes() == run.impacts[name].tobytes()
        metadata = json.loads(archive["metadata"].item())
    assert metadata["format"] == "vibroimpact"
    assert metadata["version"] == vi.__version__
    assert vi.System.from_dict(metadata["system"]) == run.system
    assert [file.name for file in tmp_path.iterdir()] == ["run.npz"]


def test_saving_replaces_an_old_file_and_leaves_no_other(run, tmp_path):
    path = tmp_path / "run.npz"
    path.write_bytes(b"old")
    run.save(str(path))
    assert_same_bits(vi.Run.load(str(path)), run)
    assert [file.name for file in tmp_path.iterdir()] == ["run.npz"]


def _foreign_files(run: vi.Run, directory) -> dict[str, bytes]:
    path = directory / "good"
    run.save(path)
    good = path.read_bytes()
    with np.load(path) as archive:
        arrays = dict(archive)
    metadata = json.loads(arrays.pop("metadata").item())

    def rewritten(changes=None, drop=(), **more):
        text = json.dumps({k: v for k, v in (metadata | (changes or {})).items() if k not in drop})
        content = {"metadata": np.array(text)} | arrays | more
        with open(path, "wb") as file:
            np.savez(file, **content)
        return path.read_bytes()

    with open(path, "wb") as file:
        np.save(file, np.zeros(3))
    single = path.read_bytes()
    with open(path, "wb") as file:
        np.savez(file, x=np.zeros(3))
    foreign = path.read_bytes()
    half = len(good) // 2
    return {
        "empty": b"",
        "text": b"time,x1\n0,0\n",
        "single array": single,
        "foreign archive": foreign,
        "cut short": good[:half],
        "flipped byte": good[:half] + bytes([good[half] ^ 0xFF]) + good[half + 1 :],
        "other format": rewritten({"format": "other"}),
        "newer format": rewritten({"format_version": 99}),
        "format before sustained contact": rewritten({"format_version": 1}),
        "other kind": rewritten({"kind": "basin"}),
        "no core": rewritten(drop=("core",)),
        "bad core": rewritten({"core": "{}"}),
        "bad system": rewritten({"system": {"gap": 1.0}}),
        "bad initial": rewritten({"initial": [0.0]}),
        "array of another type": rewritten(impacts=np.zeros(3)),
        "array too many": rewritten(extra=np.zeros(3)),
        "pickled array": rewritten(impacts=np.array([{}], dtype=object)),
    }


def test_foreign_and_damaged_files_are_named(run, tmp_path):
    for what, content in _foreign_files(run, tmp_path).items():
        path = tmp_path / f"{what}.npz"
        path.write_bytes(content)
        with pytest.raises(ValueError, match=what):
            vi.load(path)


def test_a_file_of_the_version_before_lasting_contact_is_refused(run, tmp_path):
    path = tmp_path / "run.npz"
    run.save(path)
    with np.load(path) as archive:
        arrays = dict(archive)
    metadata = json.loads(arrays.pop("metadata").item())
    del arrays["contacts"]
    np.savez(path, metadata=json.dumps(metadata | {"format_version": 1}), **arrays)
    with pytest.raises(ValueError, match=r"in format 1 by vibroimpact .* reads formats 3 and 4$"):
        vi.load(path)
    # Nor does a file do that lacks the contacts under the present number.
    np.savez(path, metadata=json.dumps(metadata), **arrays)
    with pytest.raises(ValueError, match=r"damaged .*contacts"):
        vi.load(path)


def test_loading_the_wrong_kind_or_nothing(run, tmp_path):
    path = tmp_path / "run.npz"
    run.save(path)
    with pytest.raises(ValueError, match="holds a run, not a diagram"):
        vi.Diagram.load(path)
    with pytest.raises(FileNotFoundError):
        vi.load(tmp_path / "absent.npz")


def test_repr_says_what_it_is_without_computing_the_label(run):
    text = repr(run)
    assert text.startswith("<Run completed at time ")
    assert "period 40" in text
    assert "period" not in vars(run)


def test_pickles_of_earlier_versions_find_the_classes_of_a_period():
    # They name the module in which these stood.
    for name in ("Evidence", "PeriodReport"):
        assert getattr(sys.modules["vibroimpact.run"], name) is getattr(vi, name)


def test_final_state_starts_another_run(run, system):
    again = vi.simulate(system, initial=run.final_state.state, periods=1)
    assert again.initial == run.final_state.state


@pytest.mark.parametrize("impacts", [0, 1, 2])
def test_a_run_with_few_impacts_can_be_saved(system, initial, tmp_path, impacts):
    whole = vi.simulate(system, initial=initial, periods=30)
    times = [0.0, *whole.impacts["time"][:3]]
    run = vi.simulate(system, initial=initial, time=0.5 * (times[impacts] + times[impacts + 1]))
    assert run.impact_count == impacts
    run.save(tmp_path / "run.npz")
    again = vi.load(tmp_path / "run.npz")
    assert again.impacts.tobytes() == run.impacts.tobytes()
    assert again.resume(time=20.0).impacts.tobytes() == run.resume(time=20.0).impacts.tobytes()

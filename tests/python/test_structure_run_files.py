"""The run of a structure comes back from files, pickles and copies, and says what it then lacks."""

import copy
import json
import pickle

import numpy as np
import pytest

import vibroimpact as vi
from struck import MOVING, REST, RUNS, masses_run, moving_run

TABLES = ("impacts", "grazes", "contacts", "events")


def assert_same(back: vi.StructureRun, run: vi.StructureRun) -> None:
    for name in (*TABLES, "stroboscopic", "initial"):
        one, other = getattr(back, name), getattr(run, name)
        assert one.dtype == other.dtype
        assert one.shape == other.shape
        assert one.tobytes() == other.tobytes()
        assert not one.flags.writeable
    for name in ("q", "v", "closed"):
        one, other = getattr(back.final_state, name), getattr(run.final_state, name)
        assert one.tobytes() == other.tobytes()
        assert not one.flags.writeable
    names = ("stop_reason", "stop_detail", "kept_from", "impact_count", "time_in_contact")
    for name in names:
        assert getattr(back, name) == getattr(run, name)
        assert type(getattr(back, name)) is type(getattr(run, name))
    for name in ("time", "period", "time_in_period", "mode"):
        assert getattr(back.final_state, name) == getattr(run.final_state, name)
    assert back.system == run.system
    assert repr(back) == repr(run)


@pytest.mark.parametrize("name", RUNS)
@pytest.mark.parametrize("reader", [vi.load, vi.StructureRun.load])
def test_a_file_brings_all_that_is_read_from_a_run_back(name, reader, tmp_path):
    run = RUNS[name]()
    assert len(run.impacts) > 5
    path = tmp_path / "run"
    run.save(path)
    back = reader(path)
    assert type(back) is vi.StructureRun
    assert_same(back, run)
    # And once more, from what came back.
    back.save(path)
    assert_same(reader(path), run)


@pytest.mark.parametrize("name", RUNS)
def test_equal_runs_have_the_same_numbers(name, tmp_path):
    run = RUNS[name]()
    run.save(tmp_path / "run.npz")
    for other in (pickle.loads(pickle.dumps(run)), vi.load(tmp_path / "run.npz")):
        assert_same(other, run)
        assert other == run
        assert hash(other) == hash(run)


def test_other_runs_are_not_equal():
    run = moving_run()
    assert vi.simulate(MOVING, initial=REST[1], periods=30, keep=10) == run
    others = [
        vi.simulate(MOVING, initial=REST[1], periods=30, keep=9),
        vi.simulate(MOVING, initial=[[0], [5e-324]], periods=30, keep=10),
        vi.simulate(MOVING, initial=REST[1], periods=30, keep=10, section_phase=0.1),
        vi.simulate(MOVING.replace(gap_1=0.41), initial=REST[1], periods=30, keep=10),
        run.resume(periods=1),
        masses_run(),
        "a run",
    ]
    assert run not in others


@pytest.mark.parametrize("again", [copy.copy, copy.deepcopy])
def test_a_copy_goes_on_as_its_run_does(again):
    run = moving_run()
    other = again(run)
    assert other is not run
    assert other == run
    assert other.resume(periods=2) == run.resume(periods=2)


@pytest.mark.parametrize("what", ["file", "pickle"])
def test_what_comes_back_goes_on_as_the_run_does(what, tmp_path):
    for run in (moving_run(), masses_run()):
        run.save(tmp_path / "run.npz")
        back = vi.load(tmp_path / "run.npz") if what == "file" else pickle.loads(pickle.dumps(run))
        assert back == run
        assert back.resume(periods=3) == run.resume(periods=3)
        times = np.linspace(run.kept_from, run.final_state.time, 7)
        assert (back.trajectory(times) == run.trajectory(times)).all()
        assert back.label == run.label


def test_a_loaded_run_starts_another(tmp_path):
    run = moving_run()
    run.save(tmp_path / "run.npz")
    back = vi.load(tmp_path / "run.npz")
    assert vi.simulate(back.system, initial=back.initial, periods=30, keep=10) == run


def test_a_file_is_open_to_plain_numpy(tmp_path):
    run = masses_run()
    run.save(tmp_path / "run.npz")
    with np.load(tmp_path / "run.npz", allow_pickle=False) as archive:
        for name in TABLES:
            assert archive[name].dtype == getattr(run, name).dtype
        metadata = json.loads(archive["metadata"].item())
    assert metadata["kind"] == "structure_run"
    assert vi.Structure.from_json(json.dumps(metadata["system"])) == run.system
    assert [file.name for file in tmp_path.iterdir()] == ["run.npz"]


def _foreign(run: vi.StructureRun, path) -> dict[str, bytes]:
    run.save(path)
    good = path.read_bytes()
    with np.load(path) as archive:
        arrays = dict(archive)
    metadata = json.loads(arrays.pop("metadata").item())

    def rewritten(changes=None, drop=(), **more):
        text = json.dumps({k: v for k, v in (metadata | (changes or {})).items() if k not in drop})
        given = {k: v for k, v in arrays.items() if k not in drop}
        with open(path, "wb") as file:
            np.savez(file, metadata=np.array(text), **given | more)
        return path.read_bytes()

    impacts = arrays["impacts"]
    progress = json.loads(metadata["core"])
    del progress["final_state"]
    return {
        "cut short": good[: len(good) // 2],
        "newer format": rewritten({"format_version": 99}),
        "no system": rewritten(drop=("system",)),
        "bad system": rewritten({"system": {"mass": [[1.0]]}}),
        "system that is a list": rewritten({"system": []}),
        "no progress": rewritten(drop=("core",)),
        "progress that is a word": rewritten({"core": "many"}),
        "progress without its end": rewritten({"core": json.dumps(progress)}),
        "no start": rewritten(drop=("initial",)),
        "start of another shape": rewritten(initial=np.zeros((2, 3))),
        "start within a stop": rewritten(initial=np.full((2, 2), 9.0)),
        "start that is no number": rewritten(initial=np.full((2, 2), np.nan)),
        "no impacts": rewritten(drop=("impacts",)),
        "table that is no table": rewritten(impacts=np.zeros(3)),
        "table of another width": rewritten(impacts=moving_run().impacts),
        "table with a column less": rewritten(impacts=impacts[["time", "stop"]].copy()),
        "table of a row": rewritten(impacts=impacts[0]),
        "sections of another width": rewritten(stroboscopic=np.zeros((3, 2, 3))),
        "sections of another kind": rewritten(stroboscopic=np.zeros((3, 2, 2), np.float32)),
        "array too many": rewritten(extra=np.zeros(3)),
        "pickled array": rewritten(impacts=np.array([{}], dtype=object)),
    }


def test_foreign_and_damaged_files_are_named(tmp_path):
    for what, content in _foreign(masses_run(), tmp_path / "good").items():
        path = tmp_path / f"{what}.npz"
        path.write_bytes(content)
        with pytest.raises(ValueError, match=what):
            vi.load(path)


def test_kinds_of_runs_are_told_apart(tmp_path, system, initial):
    moving_run().save(tmp_path / "structure.npz")
    vi.simulate(system, initial=initial, periods=1).save(tmp_path / "run.npz")
    with pytest.raises(ValueError, match="holds a structure_run, not a run"):
        vi.Run.load(tmp_path / "structure.npz")
    with pytest.raises(ValueError, match="holds a run, not a structure_run"):
        vi.StructureRun.load(tmp_path / "run.npz")


@pytest.mark.parametrize("time", [5e-324, 1.0])
def test_a_run_without_events_can_be_saved(tmp_path, time):
    far = MOVING.replace(gap=50.0)
    run = vi.simulate(far, initial=REST[1], time=time)
    run.save(tmp_path / "run.npz")
    assert vi.load(tmp_path / "run.npz") == run

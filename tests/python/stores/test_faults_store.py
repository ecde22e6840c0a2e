"""Faults of a store: kills at any moment, a full disk, damage, two writers, places that vanish.

Each is the real thing: a process that is killed, a file system without room, flipped bits.
"""

import errno
import os
import random
import shutil
import signal
import subprocess
import tempfile

import numpy as np
import pytest
import zarr

import vibroimpact as vi
from toy_store import CHUNK, at_gate, flipped, killed, script, small_disk, stored
from toy_task import Toy, assert_same, held, whole
from vibroimpact import sweeps
from vibroimpact.sweeps import store as store_module
from vibroimpact.sweeps.fields import FORMAT_VERSION
from vibroimpact.sweeps.store_lock import LOCK, Lock

COMPUTE = f"sweeps.compute(Toy(), whole, store=path, chunk={CHUNK})"
POSIX = pytest.mark.skipif(os.name != "posix", reason="signals and limits of POSIX")


def finished(line, path, *, before="", prefix=()):
    """Run a process to its end and return it."""
    return subprocess.run(
        [*prefix, *script(path, line, before=before)],
        capture_output=True,
        text=True,
        check=False,
    )


def cells_done(path, expected):
    """Return how many cells a store has, after a look at their numbers."""
    try:
        columns = sweeps.open_columns(path)
    except vi.ParameterError as error:
        if "is not a store" in str(error):
            return 0  # killed before it was made
        raise
    done = columns["status"] == 1
    for name in ("final", "visits", "above"):
        assert columns[name][done].tobytes() == expected[name][done].tobytes()
    rows = columns["peak_offset"][-1]
    assert columns["step"].tobytes() == expected["step"][:rows].tobytes()
    return columns.done


# Kills


@POSIX
def test_a_sweep_killed_at_random_calls(path, expected):
    # In any thread, Zarr's too, of any function in Python.
    draw = random.Random(7)
    done = [0]
    for _ in range(3):
        before = f"""
import itertools, threading
calls = itertools.count(1)
def count(frame, event, argument):
    if event == "call" and next(calls) == {draw.randrange(1, 300_000)}:
        os.kill(os.getpid(), signal.SIGKILL)
threading.setprofile(count)
sys.setprofile(count)
"""
        ended = finished(COMPUTE, path, before=before)
        assert ended.returncode == -signal.SIGKILL, ended.stderr
        done.append(cells_done(path, expected))
    assert done == sorted(done)
    assert 0 < done[-1] < 77
    assert_same(stored(path), expected)


@POSIX
@pytest.mark.parametrize("limit", [200, 20_000])
def test_a_sweep_killed_in_the_middle_of_a_file(path, limit):
    # The kernel ends the process by SIGXFSZ within the write that passes the limit; the file, of a
    # chunk of rows or of the metadata, is left half written.
    before = f"""
signal.signal(signal.SIGXFSZ, signal.SIG_DFL)
resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
resource.setrlimit(resource.RLIMIT_FSIZE, ({limit}, {limit}))
"""
    line = f"sweeps.compute(Toy(steps=500), whole, store=path, chunk={CHUNK})"
    ended = finished(line, path, before=before)
    assert ended.returncode == -signal.SIGXFSZ, ended.stderr
    # Several files may be being written at a time.
    halves = [*path.rglob("*.partial")]
    assert halves
    assert all(half.stat().st_size <= limit for half in halves)
    expected = sweeps.compute(Toy(steps=500), whole)
    assert cells_done(path, expected) < 77
    assert_same(sweeps.compute(Toy(steps=500), whole, store=path), expected)


KILLED_LATER = """
place, count = Path.replace, 0
def replace(self, target):
    global count
    count += "level-1" in str(target) or "round_1" in str(target)
    if count == 20:
        os.kill(os.getpid(), signal.SIGKILL)
    return place(self, target)
Path.replace = replace
import numpy as np
"""


@POSIX
@pytest.mark.parametrize("name", ["bifurcation_diagram", "basins"])
def test_several_stores_killed_between_their_passes(path, system, initial, name):
    if name == "basins":
        system = system.replace(friction=0.0, drive_frequency=1.8)
    arguments = {
        "bifurcation_diagram": f"initial={initial}, periods=60, keep=20, refine=1, "
        "drive_frequency=np.linspace(1.5, 1.6, 12)",
        "basins": "periods=8, keep=8, scouts=1, rounds=1, x1=np.linspace(-0.9, 0.4, 5), "
        "v1=np.linspace(-1, 1, 4)",
    }[name]
    call = f"vi.{name}(vi.System.from_json({system.to_json()!r}), {arguments}, %s)"
    ended = finished(call % "store=path, chunk=2, workers=1", path, before=KILLED_LATER)
    assert ended.returncode == -signal.SIGKILL, ended.stderr
    names = {"vi": vi, "np": np, "path": path}
    resumed = eval(call % "store=path, workers=2", names)
    fresh = eval(call % "workers=1", names)
    if name == "basins":
        for column in ("attractor", "status", "settling"):
            assert getattr(resumed, column).tobytes() == getattr(fresh, column).tobytes()
    else:
        assert_same(resumed.columns, fresh.columns)
        assert_same(vi.load(path).columns, fresh.columns)


# A full disk


def test_a_disk_that_is_really_full(tmp_path):
    line = f"""
ballast = Path(path).parent / "ballast"
ballast.write_bytes(bytes(600_000))
try:
    sweeps.compute(Toy(), whole, store=path, chunk={CHUNK})
except OSError as error:
    print(error.errno, error.strerror)
print(sweeps.open_columns(path).done)
try:
    sweeps.compute(Toy(), whole, store=path)
except OSError as error:
    print(error.errno)
ballast.unlink()
found = sweeps.compute(Toy(), whole, store=path)
assert_same(found, sweeps.compute(Toy(), whole))
print(found.done)
"""
    store = tmp_path / "toy.zarr"
    run = finished(line, store, prefix=small_disk(tmp_path, 1_000_000))
    assert run.returncode == 0, run.stderr
    message, done, again, last = run.stdout.splitlines()
    assert message == (
        f"{errno.ENOSPC} the store '{store}' cannot be written (No space left on device); the "
        "cells in it are safe, and with room enough the same call goes on from there"
    )
    assert 0 < int(done) < 77
    assert (again, last) == (str(errno.ENOSPC), "77")


# Damage


def test_every_flipped_bit_of_a_chunk_is_found(full, expected):
    file = full / "final/c/2/0"
    content = file.read_bytes()
    place = sweeps.Tiling.of(expected.grid.shape, CHUNK).slices(6)
    assert place == (slice(2, 3), slice(0, 4))
    columns, messages = sweeps.open_columns(full), set()
    for bit in range(8 * len(content)):
        file.write_bytes(flipped(content, bit))
        try:
            found = columns._read("final", place)
        except vi.ParameterError as error:
            messages.add(str(error).partition("; ")[2])
        else:
            # A bit of the frame's header that says nothing of its content.
            assert found.tobytes() == expected["final"][place].tobytes(), bit
    assert messages == {"delete that file, and the same call computes it again"}


@pytest.mark.parametrize("name", ["zarr.json", "final/zarr.json", "step/zarr.json"])
def test_no_flipped_bit_of_the_metadata_gives_wrong_numbers(full, expected, name):
    file = full / name
    content = file.read_bytes()
    settings = expected.layout.settings
    draw = random.Random(3)
    found = 0
    for bit in draw.sample(range(8 * len(content)), 60):
        file.write_bytes(flipped(content, bit))
        try:
            columns = sweeps.open_columns(full)
            assert columns.layout.settings == settings
            assert columns.layout.version == expected.layout.version
            assert_same(columns, expected)
        except vi.ParameterError:
            found += 1
    assert found > 30


def test_a_flipped_bit_in_the_description_is_found(full):
    # Another start of the same length: still JSON, still a system.
    file = full / "zarr.json"
    text = file.read_text()
    assert text.count(r"\"start\": 0.3") >= 1
    file.write_text(text.replace(r"\"start\": 0.3", r"\"start\": 0.7"))
    for call in (sweeps.open_columns, stored):
        with pytest.raises(vi.ParameterError, match=r"damaged.*its description has changed"):
            call(full)


def test_other_shapes_in_the_consolidated_metadata_are_found(full):
    columns = sweeps.open_columns(full)
    sweeps.to_dataset(columns)
    file = full / "zarr.json"
    lines = file.read_text()
    assert lines.count('"int8"') == 1
    file.write_text(lines.replace('"int8"', '"bool"'))
    with pytest.raises(vi.ParameterError, match="consolidated metadata are not those of status"):
        sweeps.to_dataset(columns)
    stored(full)
    sweeps.to_dataset(columns)


@pytest.mark.parametrize(
    "name",
    ["status/c/1/0", "final/c/2/0", "above/c/0/1", "peak_count/c/3/1", "step/c/0", "peak/c/0/0"],
)
def test_a_chunk_that_is_missing_is_never_taken_for_numbers(full, expected, name):
    (full / name).unlink()
    columns = sweeps.open_columns(full)
    array = name.partition("/")[0]
    if array == "status":
        assert not columns.complete
    else:
        for read in (lambda: columns[array], lambda: sweeps.to_dataset(columns)):
            with pytest.raises(vi.ParameterError, match=f"{name} is missing.*computes it again"):
                read()
    assert_same(stored(full), expected)
    assert_same(sweeps.open_columns(full), expected)
    sweeps.to_dataset(columns).load()


@pytest.mark.parametrize("content", [b"", b"no chunk", None])
@pytest.mark.parametrize("name", ["final/c/0/1", "step/c/0", "status/c/4/0"])
def test_a_damaged_chunk_is_named_and_computed_again(full, expected, name, content):
    file = full / name
    file.write_bytes(file.read_bytes()[:-1] if content is None else content)
    array = name.partition("/")[0]
    with pytest.raises(vi.ParameterError, match=f"damaged .{name}: .*delete that file") as caught:
        stored(full)[array]
    assert str(full) in str(caught.value)
    file.unlink()
    assert_same(stored(full), expected)


def test_a_kill_while_a_damaged_store_is_mended_loses_no_rows(full, expected):
    # The status of an early chunk is gone: the rows of the later ones are replaced one by one.
    (full / "status/c/1/0").unlink()
    with pytest.raises(ArithmeticError):
        stored(full, Toy(trouble="raise", at=40))
    cells_done(full, expected)
    assert_same(stored(full), expected)


def test_stores_of_others(tmp_path):
    zarr.create_array(tmp_path / "array", shape=(3,), dtype="float64")
    zarr.create_group(tmp_path / "second", zarr_format=2)
    (tmp_path / "list").mkdir()
    (tmp_path / "list" / "zarr.json").write_text("[]")
    for place in ("array", "second", "list"):
        before = sorted((tmp_path / place).rglob("*"))
        for call in (stored, sweeps.open_columns):
            with pytest.raises(vi.ParameterError, match=f"{place}.*(damaged|else|not a store)"):
                call(tmp_path / place)
        assert sorted((tmp_path / place).rglob("*")) == before


@pytest.mark.parametrize("offset", [-1, 1])
def test_stores_of_older_and_newer_formats(full, offset):
    version = FORMAT_VERSION + offset
    zarr.open_group(full, mode="r+").update_attributes({"format_version": version})
    for call in (stored, sweeps.open_columns):
        with pytest.raises(vi.ParameterError, match=f"in format {version}; .* {FORMAT_VERSION}"):
            call(full)


# Two writers


@POSIX
def test_two_processes_that_begin_one_store_at_once(path, expected):
    # Once both are ready, the end of their common input is the start.
    line = f"""
print("ready", flush=True)
sys.stdin.read()
try:
    sweeps.compute(Toy(), whole, store=path, chunk={CHUNK})
    print("wrote")
except vi.ParameterError as error:
    print(error)
"""
    start, go = os.pipe()
    both = [
        subprocess.Popen(script(path, line), stdin=start, stdout=subprocess.PIPE, text=True)
        for _ in "ab"
    ]
    os.close(start)
    assert [process.stdout.readline() for process in both] == ["ready\n"] * 2
    os.close(go)
    said = sorted(process.communicate()[0].strip() for process in both)
    assert said[-1] == "wrote"
    assert said[0] == "wrote" or "is being written by another process; wait" in said[0]
    assert_same(sweeps.open_columns(path), expected)
    assert not (path / LOCK).exists()


@POSIX
def test_the_lock_of_a_killed_process_is_none(path, gate, expected):
    process = at_gate(path, gate)
    with held(gate):
        killed(process)
    assert (path / LOCK).exists()
    assert_same(stored(path), expected)
    assert not (path / LOCK).exists()


@POSIX
def test_a_lock_file_that_goes_before_it_is_locked_is_made_again(path, monkeypatch):
    import fcntl

    path.mkdir()
    plain, calls = fcntl.flock, []

    def flock(handle, how):
        calls.append(handle)
        if len(calls) == 1:
            (path / LOCK).unlink()
        plain(handle, how)

    monkeypatch.setattr(fcntl, "flock", flock)
    lock = Lock(path)
    assert len(calls) == 2
    with pytest.raises(vi.ParameterError, match="being written by another process"):
        Lock(path)
    lock.release()
    Lock(path).release()


@POSIX
def test_without_locks_two_writers_are_warned(path, expected, monkeypatch):
    import fcntl

    def flock(handle, how):
        raise OSError(errno.ENOLCK, "No locks available")

    monkeypatch.setattr(fcntl, "flock", flock)
    path.mkdir()
    with pytest.warns(RuntimeWarning, match=r"the file system has no locks \(No locks available\)"):
        first = Lock(path)
    with pytest.warns(RuntimeWarning, match="the file system has no locks"):
        assert_same(stored(path), expected)
    first.release()


# Places


@pytest.mark.parametrize("moved", [True, False])
def test_a_store_that_vanishes_midway(path, expected, monkeypatch, moved):
    elsewhere = path.with_name("elsewhere.zarr")
    plain = store_module.Store.write

    def write(self, index, result):
        if index == 6:
            path.rename(elsewhere)
            if not moved:
                shutil.rmtree(elsewhere)
        plain(self, index, result)

    with monkeypatch.context() as patch:
        patch.setattr(store_module.Store, "write", write)
        with pytest.raises(FileNotFoundError, match="moved or removed while it was") as caught:
            stored(path)
    assert caught.value.filename == str(path)
    assert not path.exists()
    if moved:
        elsewhere.rename(path)
        assert cells_done(path, expected) > 0
    assert_same(stored(path), expected)


def test_a_store_below_a_file(tmp_path):
    (tmp_path / "file").touch()
    with pytest.raises(vi.ParameterError, match="has no folder to be in"):
        stored(tmp_path / "file" / "toy.zarr")
    with pytest.raises(vi.ParameterError, match="is not a store"):
        sweeps.open_columns(tmp_path / "file" / "toy.zarr")


AS_NOBODY = f"""
# All that is imported later must be readable still.
sweeps.compute(Toy(), whole, store=path + "/first.zarr", chunk={CHUNK})
if os.getuid() == 0:  # who may write everywhere
    os.setgid(65534)
    os.setuid(65534)
"""


@POSIX
def test_permission_that_is_missing_or_lost_midway():
    # The process gives up its rights, for root has all of them.
    line = f"""
def attempt(store):
    try:
        sweeps.compute(Toy(), whole, store=store, chunk={CHUNK})
    except PermissionError as error:
        print(error.strerror)

shut = Path(path) / "shut"
shut.mkdir()
shut.chmod(0o555)
attempt(shut / "toy.zarr")
place = Path(path) / "toy.zarr"
plain = sweeps.store.Store.write
def write(self, index, result):
    if index == 6:
        for folder in place.rglob("*/"):
            folder.chmod(0o555)
    plain(self, index, result)
sweeps.store.Store.write = write
attempt(place)
sweeps.store.Store.write = plain
print(sweeps.open_columns(place).done)
for folder in place.rglob("*/"):
    folder.chmod(0o755)
attempt(place)
assert_same(sweeps.open_columns(place), sweeps.compute(Toy(), whole))
"""
    with tempfile.TemporaryDirectory() as folder:
        os.chmod(folder, 0o777)
        run = finished(line, folder, before=AS_NOBODY)
    assert run.returncode == 0, run.stderr
    first, second, done = run.stdout.splitlines()
    for message, place in ((first, "shut/toy.zarr"), (second, "toy.zarr")):
        assert message == (
            f"the store '{folder}/{place}' cannot be written (Permission denied); the cells in it "
            "are safe, and with permission to write there the same call goes on from there"
        )
    assert 0 < int(done) < 77

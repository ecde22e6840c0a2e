"""Stores on disk: what stands in them, resuming after any end, and what is refused."""

import dataclasses
import errno
import json
import os
import shutil
import signal
import subprocess
import sys

import numpy as np
import pytest
import xarray
import zarr

import sizes
import vibroimpact as vi
from ctrl_c import ctrl_c_at
from toy_store import CHUNK, STORED, at_gate, killed, script, stored
from toy_task import GRID, Toy, assert_same, held, padded, whole
from vibroimpact import sweeps
from vibroimpact.sweeps import Grid, Tiling
from vibroimpact.sweeps.store import Store


@pytest.mark.parametrize("ragged", [True, False])
@pytest.mark.parametrize("chunk", sizes.either([3, 30, None], [1, 3, 11, 30, None]))
def test_a_store_has_the_same_bits_for_all_chunks(path, ragged, chunk):
    task = Toy(ragged=ragged)
    columns = sweeps.compute(task, whole, store=path, chunk=chunk)
    assert columns.complete
    assert columns.path == str(path)
    assert_same(columns, sweeps.compute(task, whole))
    assert_same(sweeps.open_columns(path), columns)


@pytest.mark.parametrize("axes", [{}, {"gap": []}, {"gap": [0.5]}])
def test_stores_of_one_cell_and_of_none(path, axes):
    task = Toy(Grid(axes))
    assert_same(sweeps.compute(task, whole, store=path), sweeps.compute(task, whole))
    assert_same(sweeps.compute(task, whole, store=path), sweeps.compute(task, whole))


def test_a_store_opens_in_xarray_with_names_on_everything(full, expected):
    dataset = xarray.open_zarr(full, chunks=None)
    assert dataset["final"].dims == ("gap", "restitution")
    assert dataset["visits"].dims == ("gap", "restitution", "half")
    assert dataset["peak"].dims == ("peak_row", "side")
    assert dataset["status"].dtype == np.int8
    assert dataset["gap"].to_numpy().tolist() == GRID.axes["gap"].tolist()
    cell = dataset.sel(gap=0.5, restitution=0.2, method="nearest")
    assert float(cell["final"]) == expected["final"][3, 0]
    assert dataset["final"].attrs == {
        "description": "value after the last step",
        "units": "dimensionless",
    }
    assert dataset["status"].attrs["flag_meanings"].split()[1] == "completed"
    assert dataset["peak_count"].attrs["sample_dimension"] == "peak_row"
    assert json.loads(dataset.attrs["system"]) == {"name": "logistic", "start": 0.3}
    assert json.loads(dataset.attrs["settings"]) == {"steps": 50}
    assert dataset.attrs["version"] == vi.__version__
    # The metadata in one place and that of the single arrays say the same.
    single = xarray.open_zarr(full, chunks=None, consolidated=False)
    xarray.testing.assert_identical(single, dataset)


def test_data_sets_of_memory_and_store_are_identical(path, expected):
    from_store = sweeps.to_dataset(stored(path))
    from_memory = sweeps.to_dataset(expected)
    assert not from_store.chunks  # read on demand without Dask
    assert list(from_store) == list(from_memory)
    xarray.testing.assert_identical(from_store, from_memory)
    for name in from_memory:
        assert from_store[name].dtype == from_memory[name].dtype


def test_a_complete_store_is_not_computed_again(full, expected):
    assert_same(stored(full, Toy(trouble="raise", at=0)), expected)


@pytest.mark.parametrize("trouble", ["ctrl_c", "half"])
@pytest.mark.parametrize("chunk", [CHUNK, 30])
def test_an_interrupted_store_is_completed(path, expected, trouble, chunk):
    with pytest.raises(vi.Interrupted, match="as does the store: call again") as caught:
        stored(path, Toy(trouble=trouble, at=20))
    columns = caught.value.result
    done = columns.done
    assert 10 < done < 30
    assert columns["status"].ravel().tolist() == [1] * done + [0] * (77 - done)
    assert columns["final"].ravel()[:done].tolist() == expected["final"].ravel()[:done].tolist()
    assert len(columns["step"]) == columns["peak_offset"][-1] == expected["peak_offset"][done]
    # The store keeps its own chunks.
    with pytest.raises(vi.Interrupted):
        sweeps.compute(Toy(trouble="half", at=22), whole, store=path, chunk=chunk)
    assert_same(sweeps.compute(Toy(), whole, store=path, chunk=chunk), expected)


def test_the_bar_of_a_resumed_run_begins_where_it_ended(path, capsys):
    with pytest.raises(vi.Interrupted):
        stored(path, Toy(trouble="ctrl_c", at=20))
    capsys.readouterr()
    stored(path, progress=True)
    shown = capsys.readouterr().err
    assert "| 19/77 [" in shown
    assert "77/77" in shown


def test_a_run_killed_at_any_write_ends_with_the_same_bits(path, expected):
    # Files take their place by Path.replace; the process kills itself at the n-th, before or after.
    before = """
place, count = Path.replace, 0
def replace(self, target):
    global count
    count += 1
    if count == {n} and {early}:
        os.kill(os.getpid(), signal.SIGKILL)
    place(self, target)
    if count == {n}:
        os.kill(os.getpid(), signal.SIGKILL)
    return target
Path.replace = replace
"""
    line = f"sweeps.compute(Toy(), whole, store=path, chunk={CHUNK})"
    done = [0]
    writes = (1, 2, 5, 30, 41, 34, 27, 33, 29, 32, 31)
    for n in sizes.either((5, 30, 34, 33, 32, 31), writes):
        text = before.format(n=n, early=bool(n % 2))
        ended = subprocess.run(
            script(path, line, before=text), capture_output=True, text=True, check=False
        )
        assert ended.returncode == -signal.SIGKILL, ended.stderr
        if n > 30:
            columns = sweeps.open_columns(path)
            done.append(columns.done)
            cells = columns["status"] == 1
            assert columns["final"][cells].tolist() == expected["final"][cells].tolist()
            xarray.open_zarr(path, chunks=None).load()
    assert done == sorted(done)
    assert 0 < done[-1] < 77
    assert_same(stored(path), expected)
    assert sorted(path.glob("*.*")) == [path / "zarr.json"]


def test_a_part_of_a_chunk_does_not_stand_beside_half_of_another(path, expected):
    layout = sweeps.Layout.of(Toy())

    def part(cells):
        return padded(Toy()._iterate(0, cells), 11)

    with Store(path, layout, Tiling.of(GRID.shape, 11)) as store:
        store.write(0, part(8))
        assert sweeps.open_columns(path).done == 8
        store._arrays["visits"] = None
        with pytest.raises(vi.ParameterError, match="damaged"):
            store.write(0, part(3))
    columns = sweeps.open_columns(path)
    assert columns.done == 0
    assert columns["peak_offset"][-1] == len(columns["step"])
    with Store(path, layout, Tiling.of(GRID.shape, 11)) as store:
        store.write(0, part(8))
        store.write(0, part(3))
    columns = sweeps.open_columns(path)
    assert columns.done == 3
    assert columns["final"][0, :3].tolist() == expected["final"][0, :3].tolist()
    assert np.isnan(columns["final"].ravel()[3:]).all()
    assert columns["step"].tolist() == expected["step"][: expected["peak_offset"][3]].tolist()
    assert_same(stored(path), expected)


def test_one_writer_many_readers_and_a_kill(path, gate, expected):
    process = at_gate(path, gate)
    with held(gate):
        with pytest.raises(vi.ParameterError, match="being written by another process"):
            stored(path)
        columns = sweeps.open_columns(path)
        killed(process)
    done = columns["status"] == 1
    assert done.sum() == columns.done == STORED
    assert columns["final"][done].tolist() == expected["final"][done].tolist()
    assert sweeps.open_columns(path).done == STORED
    assert_same(stored(path), expected)


@pytest.mark.parametrize("compute", ["sweep", "bifurcation_diagram"])
def test_killed_runs_are_completed_with_the_same_bits(path, system, initial, compute):
    # The process kills itself after it has stored six chunks.
    line = f"""
import numpy as np
plain = sweeps.store.Store.write
def write(self, index, result):
    plain(self, index, result)
    if index == 5:
        os.kill(os.getpid(), signal.SIGKILL)
sweeps.store.Store.write = write
system = vi.System.from_json({system.to_json()!r})
vi.{compute}(
    system, initial={initial}, periods=60, keep=20, drive_frequency=np.linspace(1.2, 2.0, 20),
    chunk=2, store=path,
)
"""
    ended = subprocess.run(script(path, line), capture_output=True, text=True, check=False)
    assert ended.returncode == -signal.SIGKILL, ended.stderr
    assert sweeps.open_columns(path).done == 12
    options = {"initial": initial, "periods": 60, "keep": 20}
    options |= {"drive_frequency": np.linspace(1.2, 2.0, 20)}
    found = getattr(vi, compute)(system, **options, store=path)
    assert_same(found.columns, getattr(vi, compute)(system, **options, chunk=64, workers=1).columns)


def test_ctrl_c_within_a_chunk_of_runs(path, system, initial):
    options = {"initial": initial, "periods": 600, "keep": 20}
    options |= {"drive_frequency": np.linspace(1.2, 2.0, 300), "store": path}
    with ctrl_c_at(60_000) as caught:
        vi.sweep(system, **options, chunk=300, workers=1)
    part = caught.value.result
    done = part.status != "pending"
    assert 0 < done.sum() < 300
    again = vi.sweep(system, **options)
    assert part.columns["final_state"][done].tolist() == again.columns["final_state"][done].tolist()
    assert_same(again.columns, vi.sweep(system, **options | {"store": None}).columns)


def test_ctrl_c_of_a_process(path, gate, expected):
    process = at_gate(path, gate)
    with held(gate):
        process.send_signal(signal.SIGINT)
    shown, said = process.communicate()
    assert process.returncode == 0, said
    assert sweeps.open_columns(path).done == STORED
    assert shown.startswith(f"{STORED} interrupted after {STORED} of 77 cells; .result holds them")
    assert_same(stored(path), expected)


@pytest.mark.parametrize(("limit", "cells"), [(800, "not a store"), (30_000, "cells")])
def test_a_disk_that_is_full(path, limit, cells):
    # No file may grow beyond the limit: at the first one the store cannot be made, at the second
    # the file of the rows meets it later on.
    line = f"""
limits = resource.getrlimit(resource.RLIMIT_FSIZE)
resource.setrlimit(resource.RLIMIT_FSIZE, ({limit}, limits[1]))
try:
    sweeps.compute(Toy(steps=500), whole, store=path, chunk={CHUNK})
except OSError as error:
    print(error.errno, error.strerror)
resource.setrlimit(resource.RLIMIT_FSIZE, limits)
try:
    print(sweeps.open_columns(path).done, "cells")
except vi.ParameterError as error:
    print(error)
sweeps.compute(Toy(steps=500), whole, store=path)
"""
    run = subprocess.run(script(path, line), capture_output=True, text=True, check=False)
    assert run.returncode == 0, run.stderr
    message, done = run.stdout.splitlines()
    assert message == (
        f"{errno.EFBIG} the store '{path}' cannot be written (File too large); the cells in it are "
        "safe, and with room enough the same call goes on from there"
    )
    assert cells in done
    if cells == "cells":
        assert 10 < int(done.split()[0]) < 77
    assert_same(sweeps.open_columns(path), sweeps.compute(Toy(steps=500), whole))


@pytest.mark.parametrize(
    ("other", "match"),
    [
        (Toy(steps=51), "steps is 50 there, 51 here"),
        (Toy(extra={"keep": [1, 2]}), r"keep is not known there, \[1, 2\] here"),
        (Toy(extra={"system": {"start": 0.4}}), r"system\.start is 0\.3 there, 0\.4 here"),
        (Toy(kind="chart"), "kind is toy there, chart here"),
        (Toy(ragged=False), "the field step is .* there, not known here"),
        (Toy(Grid({"gap": GRID.axes["gap"]})), "axes is gap x restitution there, gap here"),
        (Toy(Grid({**GRID.axes, "gap": [0.1]})), r"len\(gap\) is 7 there, 1 here"),
        (
            Toy(Grid({**GRID.axes, "gap": GRID.axes["gap"] ** 2})),
            r"gap\[1\] is 0\.16666666666666666 there, 0\.02777777777777",
        ),
    ],
)
def test_a_store_of_something_else_is_refused(full, expected, other, match):
    with pytest.raises(vi.ParameterError, match=f"holds another computation: .*{match}"):
        stored(full, other)
    assert_same(sweeps.open_columns(full), expected)


def test_a_store_of_another_version_can_only_be_read(path, expected):
    layout = dataclasses.replace(sweeps.Layout.of(Toy()), version="0.0.1")
    with Store(path, layout, Tiling.of(GRID.shape, 77)) as store:
        store.write(0, Toy()._iterate(0, 77))
    with pytest.raises(vi.ParameterError, match=f"version is 0.0.1 there, {vi.__version__} here"):
        stored(path)
    assert_same(sweeps.open_columns(path), expected)


def test_places_that_are_no_store(tmp_path):
    (tmp_path / "file").touch()
    (tmp_path / "folder").mkdir()
    (tmp_path / "folder" / "letter").touch()
    zarr.create_group(tmp_path / "foreign", attributes={"title": "something else"})
    for place, match in [
        ("file", "is a file"),
        ("folder", "is a directory of something else"),
        ("foreign", "is a Zarr group of something else"),
        ("nowhere/toy.zarr", "has no folder to be in"),
    ]:
        with pytest.raises(vi.ParameterError, match=match):
            stored(tmp_path / place)
    for place in ("file", "folder", "nowhere", "foreign"):
        with pytest.raises(vi.ParameterError, match=r"is not a store|something else"):
            sweeps.open_columns(tmp_path / place)
    with pytest.raises(vi.ParameterError, match="store = 3 is not allowed"):
        stored(3)
    assert sorted(entry.name for entry in tmp_path.iterdir()) == ["file", "folder", "foreign"]
    (tmp_path / "empty").mkdir()
    assert stored(tmp_path / "empty").complete


def _truncate(file):
    file.write_bytes(file.read_bytes()[:-3])


def _flip(file):
    content = bytearray(file.read_bytes())
    content[len(content) // 2] ^= 0x55
    file.write_bytes(content)


@pytest.mark.parametrize(
    ("name", "damage"),
    [
        ("zarr.json", _truncate),
        ("status/zarr.json", _truncate),
        ("status/c/1/0", _truncate),
        ("status/c/1/0", _flip),
        ("gap/c/0", _flip),
        ("final/zarr.json", os.unlink),
        ("step", shutil.rmtree),
    ],
)
def test_a_damaged_store_is_refused(full, name, damage):
    damage(full / name)
    with pytest.raises(vi.ParameterError, match="is damaged"):
        stored(full)


def test_a_damaged_column_is_found_when_it_is_read(full, expected):
    _flip(full / "final/c/2/0")
    columns = stored(full)
    with pytest.raises(vi.ParameterError, match="is damaged"):
        columns["final"]
    assert columns["visits"].tolist() == expected["visits"].tolist()


def test_what_is_not_installed_is_named(path, expected, monkeypatch):
    columns = stored(path)
    for module, call in [
        ("zarr", lambda: stored(path)),
        ("zarr", lambda: sweeps.open_columns(path)),
        ("xarray", lambda: sweeps.to_dataset(columns)),
    ]:
        with monkeypatch.context() as patch:
            patch.setitem(sys.modules, module, None)
            with pytest.raises(ImportError, match=r'pip install "zarr>=3\.1\.3" xarray$'):
                call()


def test_a_zarr_that_writes_into_standing_files_is_refused(path, monkeypatch):
    monkeypatch.setattr(zarr, "__version__", "3.1.2")
    with pytest.raises(ImportError, match=r"Zarr 3\.1\.3 or newer, found 3\.1\.2: .* -m pip"):
        stored(path)
    assert not path.exists()


def test_the_package_loads_none_of_them():
    code = (
        "import sys, vibroimpact.sweeps; "
        "print({'zarr', 'xarray', 'dask', 'distributed', 'tqdm'} & set(sys.modules))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "set()"

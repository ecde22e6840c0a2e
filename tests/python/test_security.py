"""What SECURITY.md promises: reading a file runs no code, and no input is evaluated."""

import ast
import io
import json
import pickle
import textwrap
import warnings
import zipfile
from pathlib import Path

import numpy as np
import pytest
import zarr

import vibroimpact as vi
from vibroimpact.sweeps import store_layout

MODULES = sorted(Path(vi.__file__).parent.rglob("*.py"))
# Modules that run code out of data, or other programs, or talk to a network.
FORBIDDEN_MODULES = {
    *("cPickle", "cloudpickle", "code", "dill", "joblib", "marshal", "pickle", "shelve", "yaml"),
    *("ctypes", "multiprocessing", "pty", "subprocess"),
    *("ftplib", "http", "requests", "smtplib", "socket", "urllib", "xmlrpc"),
}
FORBIDDEN_CALLS = {"__import__", "compile", "eval", "exec"}
FORBIDDEN_METHODS = {"eval", "exec"}
FORBIDDEN_IN_OS = {"execv", "execve", "popen", "posix_spawn", "spawnv", "startfile", "system"}
# They may be given, but only as False.
FORBIDDEN_OPTIONS = {"allow_pickle", "shell"}


def dangers(source: str) -> list[str]:
    """Return what in a module could run code that comes with data, each with its line."""
    found = []
    for node in ast.walk(ast.parse(source)):
        names: set[str] = set()
        match node:
            case ast.Import():
                names = {alias.name.split(".")[0] for alias in node.names} & FORBIDDEN_MODULES
            case ast.ImportFrom(level=0, module="os"):
                names = {alias.name for alias in node.names} & FORBIDDEN_IN_OS
            case ast.ImportFrom(level=0):
                names = {str(node.module).split(".")[0]} & FORBIDDEN_MODULES
            case ast.Call(func=ast.Name(id=name)):
                names = {name} & FORBIDDEN_CALLS
            case ast.Call(func=ast.Attribute(attr="import_module"), args=[ast.Constant(), *_]):
                pass
            # A module of the package itself: relative to its own name.
            case ast.Call(
                func=ast.Attribute(attr="import_module"),
                args=[
                    ast.JoinedStr(values=[ast.Constant(value="."), *_]),
                    ast.Name(id="__name__" | "__package__"),
                ],
            ):
                pass
            case ast.Call(func=ast.Attribute(attr="import_module")):
                names = {"import_module"}
            case ast.Call(func=ast.Attribute(value=ast.Name(id="os"), attr=name)):
                names = {name} & FORBIDDEN_IN_OS
            case ast.Call(func=ast.Attribute(attr=name)):
                names = {name} & FORBIDDEN_METHODS
            case ast.keyword(arg=str(name), value=value):
                harmless = isinstance(value, ast.Constant) and value.value is False
                names = set() if harmless else {name} & FORBIDDEN_OPTIONS
        found += [f"line {getattr(node, 'lineno', 0)}: {name}" for name in sorted(names)]
    return found


@pytest.mark.parametrize("path", MODULES, ids=lambda path: f"{path.parent.name}/{path.stem}")
def test_no_module_runs_what_comes_with_data(path):
    assert dangers(path.read_text(encoding="utf-8")) == []


@pytest.mark.parametrize(
    "source",
    [
        "import pickle",
        "import os, subprocess",
        "from urllib.request import urlopen",
        "def late():\n    import marshal",
        "x = eval(text)",
        "exec(compile(text, '', 'exec'))",
        "os.system(text)",
        "from os import popen",
        "frame.eval(text)",
        "np.load(file, allow_pickle=True)",
        "np.load(file, allow_pickle=wanted)",
        "run(text, shell=True)",
        "importlib.import_module(name)",
    ],
)
def test_what_is_looked_for_is_found(source):
    assert dangers(source)


@pytest.mark.parametrize(
    "source",
    [
        "re.compile(text)",
        "np.load(file, allow_pickle=False)",
        "from .evaluate import system",
        "options.system(given)",
        "importlib.import_module('.plot', __name__)",
    ],
)
def test_what_is_harmless_is_not(source):
    assert dangers(source) == []


class Trap:
    """Makes a file where it is unpickled."""

    def __init__(self, path: Path) -> None:
        self.path = path

    def __reduce__(self):
        return Path.touch, (self.path,)


@pytest.fixture
def sprung(tmp_path):
    """Return the path of the file that says that a trap was sprung; it must not be there."""
    path = tmp_path / "sprung"
    yield path
    assert not path.exists()


def trapped(path: Path) -> np.ndarray:
    """Return an array that holds a trap."""
    array = np.empty(1, dtype=object)
    array[0] = Trap(path)
    return array


@pytest.fixture(scope="module")
def run():
    system = vi.System(
        mass_ratio=0.6, frequency_ratio=2, restitution=0.8, gap=0.5, drive_frequency=1.8
    )
    return vi.simulate(system, initial=(0, 0.5, 0, 0), periods=3)


def test_the_trap_works(tmp_path):
    np.save(tmp_path / "trap.npy", trapped(tmp_path / "seen"), allow_pickle=True)
    np.load(tmp_path / "trap.npy", allow_pickle=True)
    assert (tmp_path / "seen").exists()


def test_a_run_with_a_pickle_in_any_of_its_arrays_is_refused(run, tmp_path, sprung):
    run.save(tmp_path / "run.npz")
    with np.load(tmp_path / "run.npz") as archive:
        arrays = dict(archive)
    assert "metadata" in arrays
    for name in (*arrays, "one_more"):
        with open(tmp_path / "bad.npz", "wb") as file:
            np.savez(file, allow_pickle=True, **arrays | {name: trapped(sprung)})
        for reader in (vi.load, vi.Run.load):
            with pytest.raises(ValueError, match="Object arrays cannot be loaded"):
                reader(tmp_path / "bad.npz")


def test_a_file_that_is_a_pickle_is_refused(tmp_path, sprung):
    bare = pickle.dumps(Trap(sprung))
    (tmp_path / "bare.npz").write_bytes(bare)
    np.save(tmp_path / "array.npy", trapped(sprung), allow_pickle=True)
    with zipfile.ZipFile(tmp_path / "inside.npz", "w") as archive:
        archive.writestr("metadata.npy", bare)
    for name in ("bare.npz", "array.npy", "inside.npz"):
        with pytest.raises(ValueError, match=f"{name}: not a vibroimpact file, or damaged"):
            vi.load(tmp_path / name)


@pytest.mark.parametrize("text", ["[" * 100_000, '{"format": ' * 100_000])
def test_metadata_nested_without_end_is_refused(tmp_path, text):
    with open(tmp_path / "deep.npz", "wb") as file:
        np.savez(file, metadata=np.array(text))
    with pytest.raises(ValueError, match="not a vibroimpact file, or damaged"):
        vi.load(tmp_path / "deep.npz")


def test_an_archive_writes_nothing_outside_itself(run, tmp_path):
    # A member's name that leads out of the archive is a name like any other.
    run.save(tmp_path / "run.npz")
    inside = io.BytesIO()
    np.save(inside, np.arange(3.0))
    with zipfile.ZipFile(tmp_path / "run.npz", "a") as archive:
        archive.writestr("../outside.npy", inside.getvalue())
    before = sorted(tmp_path.parent.iterdir())
    with pytest.raises(ValueError, match=r"damaged .*it has been altered"):
        vi.load(tmp_path / "run.npz")
    assert sorted(tmp_path.parent.iterdir()) == before


@pytest.fixture
def store(tmp_path, run):
    path = tmp_path / "sweep.zarr"
    vi.sweep(run.system, initial=(0, 0.5, 0, 0), periods=3, gap=[0.4, 0.5], store=path)
    return path


def test_a_store_with_pickles_of_the_older_format_is_refused(store, sprung):
    # Format 2 of Zarr could hold objects; format 3, which stores are in, cannot.
    column = store / "label"
    column = column if column.exists() else store / "status"
    for file in column.rglob("*"):
        if file.is_file():
            file.unlink()
    about = {
        "zarr_format": 2,
        "shape": [2],
        "chunks": [2],
        "dtype": "|O",
        "compressor": None,
        "fill_value": None,
        "filters": [{"id": "pickle", "protocol": 4}],
        "order": "C",
    }
    (column / ".zarray").write_text(json.dumps(about), encoding="utf-8")
    (column / "0").write_bytes(pickle.dumps([Trap(sprung), None]))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        with pytest.raises(vi.ParameterError, match="is damaged"):
            vi.load(store)


@pytest.mark.parametrize(
    "changes",
    [
        {"codecs": [{"name": "numcodecs.pickle", "configuration": {"protocol": 4}}]},
        {"codecs": [{"name": "pickle"}]},
        {"data_type": "object"},
        {"data_type": "variable_length_bytes"},
        {"storage_transformers": [{"name": "pickle"}]},
    ],
    ids=lambda changes: next(iter(changes.items()))[0],
)
def test_a_store_with_a_column_of_objects_is_refused(store, changes, sprung):
    description = store / "status" / "zarr.json"
    about = json.loads(description.read_text(encoding="utf-8")) | changes
    description.write_text(json.dumps(about), encoding="utf-8")
    for chunk in (store / "status").rglob("c/*"):
        if chunk.is_file():
            chunk.write_bytes(pickle.dumps(Trap(sprung)))
    with pytest.raises(vi.ParameterError, match="is damaged"):
        np.asarray(vi.load(store).columns["status"])


def test_no_array_of_a_store_holds_objects(store):
    group = zarr.open_group(str(store), mode="r")
    assert group.attrs["format"] == store_layout.FORMAT
    assert {array.dtype.kind for _, array in group.arrays()} <= set("biuf")


def test_a_system_file_is_data(tmp_path, run_command, sprung):
    text = f"""
        [system]
        mass_ratio = "__import__('pathlib').Path({str(sprung)!r}).touch()"
        frequency_ratio = 2
        restitution = 0.8
        gap = 0.5
        drive_frequency = 1.8
    """
    path = tmp_path / "system.toml"
    path.write_text(textwrap.dedent(text), encoding="utf-8")
    code, _, err = run_command("simulate --periods 3 --system", path)
    assert code == 2
    assert "mass_ratio" in err

"""Files that cannot be written: nothing that stood there is lost, and the error names the file."""

import contextlib
import errno
import io
import os
import random
import shlex
import signal
import subprocess
import sys

import numpy as np
import pytest

import vibroimpact as vi
from command_lines import BASINS, CHART, DIAGRAM, LYAPUNOV, ORBITS, SIMULATE
from toy_store import flipped, small_disk
from vibroimpact.whole_file import whole_file

resource = pytest.importorskip("resource", reason="limits and devices of POSIX")
FULL = "No space left on device); with room enough the same call writes it"


@pytest.fixture
def run(system, initial):
    """Return a short run."""
    return vi.simulate(system, initial=initial, periods=50)


@contextlib.contextmanager
def no_room():
    """Let no file of this process grow beyond some bytes, as on a full disk."""
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (100, limits[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)


def test_a_whole_file_replaces_another_or_nothing(tmp_path):
    file = tmp_path / "file"

    def half():
        with whole_file(file) as new:
            new.write(b"half")
            raise ArithmeticError

    with pytest.raises(ArithmeticError):
        half()
    assert not list(tmp_path.iterdir())
    with whole_file(file) as new:
        new.write(b"first")
    mask = os.umask(0)
    os.umask(mask)
    assert file.stat().st_mode & 0o777 == 0o666 & ~mask
    file.chmod(0o640)
    link = tmp_path / "link"
    link.symlink_to(file)
    with whole_file(link) as new:
        new.write(b"second")
        assert file.read_bytes() == b"first"
    assert file.read_bytes() == b"second"
    assert link.is_symlink()
    assert file.stat().st_mode & 0o777 == 0o640
    assert sorted(tmp_path.iterdir()) == [file, link]


@pytest.mark.parametrize(
    ("name", "number"),
    [("missing/a.npz", errno.ENOENT), ("folder", errno.EISDIR), ("file/a.npz", errno.ENOTDIR)],
)
def test_places_where_no_result_can_be_saved(tmp_path, run, name, number):
    (tmp_path / "folder").mkdir()
    (tmp_path / "file").touch()
    with pytest.raises(OSError, match="cannot be written") as caught:
        run.save(tmp_path / name)
    assert (caught.value.errno, caught.value.filename) == (number, str(tmp_path / name))
    assert {path.name for path in tmp_path.rglob("*")} == {"folder", "file"}


def test_a_result_is_saved_again_once_there_is_room(tmp_path, run):
    file = tmp_path / "run.npz"
    run.save(file)
    old = file.read_bytes()
    longer = run.resume(periods=10)
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (2000, limits[1]))
    try:
        with pytest.raises(OSError, match=r"File too large.*; with room enough") as caught:
            longer.save(file)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
    assert caught.value.filename == str(file)
    assert file.read_bytes() == old
    assert list(tmp_path.iterdir()) == [file]
    longer.save(file)
    assert vi.load(file).impacts.tobytes() == longer.impacts.tobytes()


def test_no_flipped_bit_of_a_saved_result_gives_wrong_numbers(tmp_path, run):
    file, again = tmp_path / "run.npz", tmp_path / "again.npz"
    run.save(file)
    content = file.read_bytes()
    draw, found = random.Random(11), 0
    for bit in draw.sample(range(8 * len(content)), 300):
        file.write_bytes(flipped(content, bit))
        try:
            vi.load(file).save(again)
        except ValueError:
            found += 1
        else:
            # A bit of the archive that says nothing of its content, such as a date.
            with np.load(again) as other, np.load(io.BytesIO(content)) as first:
                assert all(other[name].tobytes() == first[name].tobytes() for name in first), bit
    assert found > 200


def test_a_kill_while_a_result_is_saved_leaves_the_old_one(tmp_path, run):
    file = tmp_path / "run.npz"
    run.save(file)
    old = file.read_bytes()
    code = f"""
import resource, signal
import vibroimpact as vi
run = vi.load({str(file)!r}).resume(periods=50)
signal.signal(signal.SIGXFSZ, signal.SIG_DFL)
resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
resource.setrlimit(resource.RLIMIT_FSIZE, (2000, 2000))
run.save({str(file)!r})
"""
    killed = subprocess.run([sys.executable, "-c", code], capture_output=True, check=False)
    assert killed.returncode == -signal.SIGXFSZ
    assert file.read_bytes() == old
    assert vi.load(file).impacts.tobytes() == run.impacts.tobytes()
    (part,) = tmp_path.glob("*.part")
    assert part.stat().st_size <= 2000


@pytest.mark.parametrize(
    ("line", "flags"),
    [
        (SIMULATE, "--csv --save --plot"),
        (DIAGRAM, "--csv --points --save --plot"),
        (CHART, "--csv --save --plot"),
        (BASINS.replace("12 --vary", "3 --vary").replace("1 9", "1 3"), "--csv --plot"),
        (LYAPUNOV + " --drive-frequency 1.5", "--csv --plot"),
        (ORBITS + " --n 1", "--csv --plot"),
        (ORBITS + " --follow drive-frequency 1.79 1.81", "--csv --plot"),
    ],
    ids=lambda value: value.split()[0] + "-" * (value.count("--follow")),
)
def test_a_command_on_a_full_disk_names_every_file(run_command, tmp_path, line, flags):
    names = {"--csv": "a.csv", "--points": "b.csv", "--save": "c.npz", "--plot": "d.png"}
    files = [tmp_path / names[flag] for flag in flags.split()]
    for file in files:
        file.write_text("old")
    given = [word for pair in zip(flags.split(), files, strict=True) for word in pair]
    with no_room():
        code, out, err = run_command(line, *given)
    assert code == 1
    assert out  # the summary is printed still
    for file in files:
        assert "File too large); with room enough the same call writes it" in err
        assert err.count(f": '{file}'") == 1
        assert file.read_text() == "old"
    assert sorted(tmp_path.iterdir()) == sorted(files)


def test_the_files_that_fit_are_written(run_command, tmp_path):
    code, out, err = run_command(
        SIMULATE, "--csv", "/dev/full", "--save", tmp_path / "run.npz", "--plot", tmp_path / "a.png"
    )
    assert code == 1
    assert FULL in err
    assert "/dev/full" in err
    assert out.startswith("label")
    assert vi.load(tmp_path / "run.npz").label == "1-1"
    assert (tmp_path / "a.png").read_bytes().startswith(b"\x89PNG")


def test_a_command_whose_store_meets_a_full_disk_goes_on(tmp_path):
    line = shlex.split(DIAGRAM.replace("1.9 5", "1.9 40") + " --chunk 2")
    store, points = tmp_path / "d.zarr", tmp_path / "points.csv"
    code = f"""
import sys
from pathlib import Path
from vibroimpact.cli import main
line = {[*line, "--store", str(store), "--points", str(points)]!r}
ballast = Path({str(tmp_path)!r}, "ballast")
ballast.write_bytes(bytes(3_500_000))
first = main(line)
assert not Path({str(points)!r}).exists()
ballast.unlink()
second = main(line)
print(first, second, Path({str(points)!r}).read_text().count("completed"))
"""
    prefix = small_disk(tmp_path, 4_000_000)
    both = subprocess.run(
        [*prefix, sys.executable, "-c", code], capture_output=True, text=True, check=False
    )
    assert both.returncode == 0, both.stderr
    assert f"the store '{store}' cannot be written (No space left" in both.stderr
    assert both.stdout.splitlines()[-1] == "1 0 40"


def test_a_pipe_is_written_as_it_is(run_command, tmp_path):
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    reader = subprocess.Popen(["cat", pipe], stdout=subprocess.PIPE, text=True)
    assert run_command(SIMULATE, "--csv", pipe)[0] == 0
    shown, _ = reader.communicate()
    assert shown.startswith("time,")
    assert np.char.count(shown, "\n") == 101
    assert pipe.is_fifo()

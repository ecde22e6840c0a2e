"""The command line as a whole: its exit codes, and that bad input has no traceback."""

import os
import re
import shlex
import subprocess
import sys
from importlib.metadata import EntryPoint, EntryPoints

import pytest

import vibroimpact as vi
from command_lines import BASINS, CHART, DIAGRAM, LYAPUNOV, ORBITS, SIMULATE, START, SYSTEM
from vibroimpact import cli
from vibroimpact.cli import exit_codes, main, simulate
from vibroimpact.cli.exit_codes import ExitCode
from vibroimpact.extras import missing

SEARCH = ORBITS + " --search 2"


@pytest.mark.parametrize(
    ("line", "message"),
    [
        (SIMULATE.replace("0.8", "1.5"), "restitution = 1.5"),
        (SIMULATE.replace("--gap 0.5", ""), "missing system parameters: gap"),
        (SIMULATE.replace("--initial 0 0.5 0 0", "--initial 1 0 0 0"), "initial"),
        (SIMULATE.replace("--initial 0 0.5 0 0", ""), "initial is missing: give --initial"),
        (SIMULATE.replace("--gap 0.5", "--gap nan"), "gap = nan"),
        (SIMULATE.replace("--keep 100", "--keep 601"), "keep = 601"),
        (SIMULATE.replace("--periods 600", ""), "exactly one of --periods and --time, got neither"),
        (SIMULATE + " --max-events 0", "max_events = 0"),
        (SIMULATE + " --chatter-tolerance inf", "chatter_tolerance = inf"),
        (SIMULATE + " --law wishful", "law"),
        (SIMULATE + " --plot a.xyz", "allowed endings"),
        (SIMULATE + " --save missing/a.npz", "there is no folder missing"),
        (SIMULATE + " --csv .", "is a folder"),
        (SIMULATE + " --system missing.toml", "--system missing.toml: No such file"),
        (DIAGRAM.replace("drive-frequency", "label"), "--vary label: allowed are mass-ratio"),
        (
            DIAGRAM.replace("drive-frequency", "drive-freq"),
            "--vary drive-freq: did you mean drive-frequency? allowed are mass-ratio",
        ),
        (DIAGRAM.replace("1.9 5", "1.9 many"), "--vary"),
        (DIAGRAM.replace("1.9 5", "inf 5"), "--vary"),
        (DIAGRAM.replace("1.9 5", "1.9 0"), "COUNT = 0"),
        (DIAGRAM + " --vary gap 0 1 3", "--vary is given 2 times; allowed: 1"),
        (DIAGRAM + " --workers 0", "workers = 0"),
        (DIAGRAM + " --refine -1", "refine = -1"),
        (DIAGRAM + " --chunk 0", "chunk = 0"),
        (DIAGRAM + " --store missing/d.zarr", "--store missing/d.zarr: there is no folder"),
        (DIAGRAM + " --csv a.csv --points ./a.csv", "--points ./a.csv: --csv goes there, too"),
        (DIAGRAM + " --csv - --points -", "--points -: --csv goes there, too"),
        (DIAGRAM + " --scheduler nowhere", "--scheduler nowhere"),
        (CHART.replace("--vary gap 0.4 0.5 3", ""), "--vary is given 1 times; allowed: 2"),
        (CHART.replace("--vary gap 0.4", "--vary drive-frequency 0.4"), "given twice"),
        (CHART.replace("--vary gap", "--vary x1"), "--vary x1: allowed are mass-ratio"),
        (LYAPUNOV + " --drive-frequency 1.5 --keep 201", "keep = 201"),
        (LYAPUNOV + " --drive-frequency 1.5 --store l.zarr", "--store goes with --vary only"),
        (LYAPUNOV.replace("--periods 200", "--time 5") + " --drive-frequency 1.5", "time = 5.0"),
        (BASINS.replace("--vary x2 -1 1 9", ""), "--vary is given 1 times; allowed: 2"),
        (BASINS.replace("--vary x2", "--vary gap"), "--vary gap: allowed are x1, v1, x2, v2"),
        (BASINS + " --drive-frequency 0", "drive_frequency = 0.0"),
        (BASINS + " --rounds 21", "rounds = 21"),
        (ORBITS + " --n 0", "n = 0"),
        (ORBITS + " --n 1 --friction 0.5", "friction = 0.5"),
        (ORBITS + " --drive-frequency 0", "drive_frequency = 0.0"),
        (ORBITS + " --n 1 --seed 3", "--seed goes with --search only"),
        (SEARCH + " --within 0 1", "--within goes with --n only"),
        (SEARCH + " --periods 7", "periods = 7"),
        (ORBITS + " --follow gap 0.6 0.7", "gap = (0.6, 0.7)"),
        (ORBITS + " --follow gap 0.4 much", "--follow gap"),
        (ORBITS + " --follow label 0 1", "--follow label: allowed are mass-ratio"),
        (ORBITS + " --follow gap 0.4 0.7 --max-step 0", "max_step = 0.0"),
        ("bench --seconds 0", "--seconds = 0.0"),
        ("reproduce --out x --figures 11", "figures = [11]"),
    ],
)
def test_bad_input_gives_code_2_and_one_line(run_command, line, message, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    code, out, err = run_command(line)
    assert (code, out) == (2, "")
    assert err.startswith("vibroimpact: ")
    assert message in err
    assert err.count("\n") == 1


def test_flags_may_have_underscores_as_in_python(run_command, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    line = SIMULATE + " --max-events 50"
    python = re.sub(r"(?<=[a-z])-(?=[a-z])", "_", line)
    assert "--mass_ratio 0.6 --frequency_ratio" in python
    assert run_command(python) == run_command(line)
    run_command(python + " --csv=a_b.csv")
    assert (tmp_path / "a_b.csv").exists()


def test_files_that_cannot_be_written_are_refused_before_anything_runs(run_command, monkeypatch):
    monkeypatch.setattr(simulate, "simulate", None)
    for flag in ("--csv missing/a.csv", "--save missing/a.npz", "--plot missing/a.png"):
        assert run_command(f"{SIMULATE} {flag}")[0] == 2


@pytest.mark.parametrize(
    "line", ["", "unknown", "simulate --gap wide", "reproduce", f"{SIMULATE} --time 5", "diagram"]
)
def test_unparsable_arguments_give_code_2(line, capsys):
    with pytest.raises(SystemExit) as stopped:
        main(shlex.split(line))
    assert stopped.value.code == 2
    usage, *_, message = capsys.readouterr().err.splitlines()
    assert usage.startswith("usage: vibroimpact")
    command, known = line.partition(" ")[0], ("simulate", "reproduce", "diagram")
    program = f"vibroimpact {command}" if command in known else "vibroimpact"
    assert message.startswith(f"{program}: error: ")


@pytest.mark.parametrize(
    "line",
    [
        SIMULATE + " --max-events 50",
        DIAGRAM + " --max-events 50",
        CHART + " --max-events 50",
        # Chaotic: there is nothing periodic to find or to follow.
        f"orbits {SYSTEM} --friction 0.5 --drive-frequency 1.545 {START}",
        f"orbits {SYSTEM} --friction 0.5 --drive-frequency 1.545 {START} --follow gap 0.4 0.6",
        # Impacts too weak to be told from none: nothing moves the bodies at all.
        ORBITS + " --n 1 --within 2 2.1 --plot none.png",
    ],
)
def test_what_is_incomplete_gives_code_3(run_command, line, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    code, out, err = run_command(line)
    assert (code, err) == (3, "")
    assert out


def test_interruption_gives_code_130(run_command, monkeypatch):
    def interrupted(*_, **__):
        raise KeyboardInterrupt

    monkeypatch.setattr(simulate, "simulate", interrupted)
    assert run_command(SIMULATE) == (130, "", "vibroimpact: interrupted\n")


def test_a_failed_computation_gives_code_1(run_command, monkeypatch):
    def failed(*_, **__):
        raise vi.SimulationError("at time 1, after 2 events")

    monkeypatch.setattr(simulate, "simulate", failed)
    assert run_command(SIMULATE) == (1, "", "vibroimpact: at time 1, after 2 events\n")


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="no device that is always full")
def test_a_file_that_cannot_be_written_gives_code_1(run_command):
    code, _, err = run_command(SIMULATE + " --csv /dev/full")
    assert code == 1
    assert "No space left" in err


def test_more_memory_than_there_is_gives_code_1(run_command):
    code, _, err = run_command(DIAGRAM.replace("1.9 5", "1.9 1000000000000000"))
    assert code == 1
    assert err.startswith("vibroimpact: not enough memory")


def test_a_missing_extra_gives_code_2(run_command, monkeypatch):
    def without_zarr(*_, **__):
        raise missing("xarray", "needs zarr", module="zarr")

    monkeypatch.setattr(simulate, "simulate", without_zarr)
    code, _, err = run_command(SIMULATE)
    assert code == 2
    wanted = f'{sys.executable} -m pip install "zarr>=3.1.3" xarray'
    assert err == f"vibroimpact: needs zarr: {wanted}\n"


@pytest.mark.skipif(os.name != "posix", reason="pipes end otherwise elsewhere")
def test_a_reader_that_has_gone_gives_code_141():
    # The reader is gone before anything is written, so that no timing decides.
    reader, writer = os.pipe()
    os.close(reader)
    code = f"import sys; from vibroimpact.cli import main; sys.exit(main({shlex.split(SIMULATE)}))"
    done = subprocess.run(
        [sys.executable, "-c", code], stdout=writer, stderr=subprocess.PIPE, text=True, check=False
    )
    os.close(writer)
    assert (done.returncode, done.stderr) == (141, "")


@pytest.mark.parametrize("line", [SIMULATE, SIMULATE + " --max-events 50"])
def test_the_package_runs_as_the_command(run_command, line):
    words = [sys.executable, "-m", "vibroimpact", *shlex.split(line)]
    done = subprocess.run(words, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout, done.stderr) == run_command(line)


def test_the_table_of_exit_codes_names_all():
    for code in ExitCode:
        assert f"  {code:>3}  {exit_codes.MEANINGS[code].splitlines()[0]}" in exit_codes.table()


@pytest.mark.parametrize("name", ["reproduce", "claims", "bench"])
def test_a_command_of_another_distribution_is_named_with_it(run_command, monkeypatch, name):
    monkeypatch.setattr(cli, "entry_points", lambda group: EntryPoints(()))
    code, out, err = run_command(f"{name} --help")
    assert (code, out) == (2, "")
    assert err == (
        f"vibroimpact: {name}: a command of the distribution han-jin-hu-2004, which is not "
        "installed\n"
    )
    with pytest.raises(SystemExit) as stopped:
        run_command("no-such-command")
    assert stopped.value.code == 2


def test_another_distribution_adds_a_command(run_command, monkeypatch):
    entry = EntryPoint("hello", "toy_command", "vibroimpact.commands")
    monkeypatch.setattr(cli, "entry_points", lambda group: EntryPoints([entry]))
    monkeypatch.setitem(sys.modules, "toy_command", ToyCommand)
    assert run_command("hello --name you") == (3, "hello you\n", "")


class ToyCommand:
    """What the module of a command has."""

    @staticmethod
    def add(subparsers):
        parser = subparsers.add_parser("hello")
        parser.add_argument("--name")
        parser.set_defaults(run=ToyCommand.run)

    @staticmethod
    def run(options):
        print("hello", options.name)
        return 3

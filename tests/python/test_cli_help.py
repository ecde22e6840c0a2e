"""`--help` tells the truth: its examples run, its columns are those of the files."""

import csv
import inspect
import re
import shlex

import pytest

import vibroimpact as vi
from command_lines import example_file
from vibroimpact import cli
from vibroimpact._core import CONTACTS, LAWS, PARAMETERS
from vibroimpact.cli import (
    basins,
    chart,
    diagram,
    lyapunov,
    motion_table,
    orbits,
    simulate,
)
from vibroimpact.sweeps.basins.arrivals import USUAL_KEEP as BASIN_KEEP
from vibroimpact.sweeps.cells import USUAL_KEEP

WIDTH = 80
# Files whose columns their command's help explains, by name.
CSV_FILES = {
    "impacts.csv": simulate,
    "section.csv": diagram,
    "points.csv": diagram,
    "chart.csv": chart,
    "all.csv": orbits,
    "basins.csv": basins,
    "history.csv": lyapunov,
    "spectrum.csv": lyapunov,
}
FLAGS = ("--csv", "--points", "--plot", "--out")


def examples(command) -> list[str]:
    """Return the command lines that stand in the help of a command."""
    text = command.MORE.replace("\\\n", " ")
    return re.findall(r"^  vibroimpact (.*)$", text, re.M)


@pytest.mark.parametrize("command", cli.COMMANDS, ids=lambda command: command.__name__)
def test_examples_run_and_write_their_files(command, run_command, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "fig5b.toml").write_text(example_file(), encoding="utf-8")
    lines = examples(command)
    assert lines
    for line in lines:
        code, out, err = run_command(line)
        assert code == 0, err
        assert out
        words = shlex.split(line)
        named = [words[i + 1] for i, word in enumerate(words) if word in FLAGS]
        for name in named:
            assert (tmp_path / name).exists(), name
        for name in set(named) & set(CSV_FILES):
            with open(name, encoding="utf-8", newline="") as file:
                columns = next(csv.reader(file))
            for column in columns:
                told = column in PARAMETERS or explained(column, CSV_FILES[name].MORE)
                assert told, column


def explained(column: str, text: str) -> bool:
    """Whether a column is named in the help; the first of a kind stands for the others."""
    column = re.sub(r"^(multiplier|exponent|error)_\d", r"\1_1", column)
    column = re.sub(r"initial_\w\d", "initial_x1", column)
    return re.search(rf"(?<!\w){re.escape(column)}(?!\w)", text) is not None


def test_a_column_that_is_not_named_is_noticed():
    assert not explained("impulse", simulate.MORE)


@pytest.mark.parametrize("command", cli.COMMANDS, ids=lambda command: command.__name__)
def test_help_fits_the_terminal(command, capsys):
    with pytest.raises(SystemExit) as stopped:
        cli.main([command.__name__.rpartition(".")[2].replace("_", "-"), "--help"])
    assert stopped.value.code == 0
    text = capsys.readouterr().out
    assert command.ABOUT in text
    assert command.MORE in text
    for written in (command.ABOUT, command.MORE, cli.ABOUT, cli.MORE):
        assert max(map(len, written.splitlines())) < WIDTH


def test_help_and_version_succeed(capsys):
    for words, expected in (
        (["--version"], vi.__version__),
        (["--help"], "exit codes:"),
        (["simulate", "--help"], "--drive-frequency"),
        (["diagram", "--help"], "--vary NAME FIRST LAST COUNT"),
    ):
        with pytest.raises(SystemExit) as stopped:
            cli.main(words)
        assert stopped.value.code == 0
        assert expected in capsys.readouterr().out


def test_every_parameter_is_explained(capsys):
    with pytest.raises(SystemExit):
        cli.main(["simulate", "--help"])
    text = " ".join(capsys.readouterr().out.split())
    for name, parameter in PARAMETERS.items():
        flag = f"--{name.replace('_', '-')} X"
        default = "" if parameter.default is None else f" (default: {parameter.default:g})"
        assert f"{flag} {parameter.meaning}: {parameter.allowed}{default}" in text
    for name, choices in (("contact", CONTACTS), ("law", LAWS)):
        assert inspect.signature(vi.System).parameters[name].default == choices[0]
        assert f"{', '.join(choices)} (default: {choices[0]})" in text


def test_defaults_in_help_are_those_of_the_functions(capsys):
    def help_of(name):
        with pytest.raises(SystemExit):
            cli.main([name, "--help"])
        return " ".join(capsys.readouterr().out.split())

    def defaults(function):
        return {name: item.default for name, item in inspect.signature(function).parameters.items()}

    for name, function in (
        ("diagram", vi.bifurcation_diagram),
        ("chart", vi.chart),
    ):
        wanted = defaults(function)
        text = help_of(name)
        assert f"drive periods (default: {wanted['periods']})" in text
        assert f"keep the last K periods (default: {USUAL_KEEP}, or all of fewer)" in text
        assert f"where chatter is completed (default: {wanted['chatter_tolerance']})" in text
    assert f"N times (default: {defaults(vi.bifurcation_diagram)['refine']})" in help_of("diagram")
    wanted = defaults(vi.basins)
    text = help_of("basins")
    assert f"drive periods (default: {wanted['periods']})" in text
    assert f"keep the last K periods (default: {BASIN_KEEP}, or all of fewer)" in text
    assert f"beforehand (default: {wanted['scouts']})" in text
    assert f"twice as long (default: {wanted['rounds']})" in text
    assert f"with --search {defaults(vi.search_motions)['periods']})" in help_of("orbits")
    assert f"size (default: {defaults(vi.follow_motion)['max_step']})" in help_of("orbits")


def test_tables_name_their_columns():
    assert all(explained(name, orbits.MORE) for name in motion_table.CSV_NAMES)

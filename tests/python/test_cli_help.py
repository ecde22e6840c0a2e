"""`--help` tells the truth: its examples run, its columns are those of the files."""

import csv
import inspect
import re
import shlex

import pytest

import vibroimpact as vi
from command_lines import example_file
from vibroimpact import cli
from vibroimpact.cli import bench, diagram, motion_table, options, orbits, simulate
from vibroimpact.system import NUMERIC_RANGES

WIDTH = 80
# Files whose columns their command's help explains, by name.
CSV_FILES = {"impacts.csv": simulate, "section.csv": diagram, "all.csv": orbits}


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
        named = [
            words[i + 1] for i, word in enumerate(words) if word in ("--csv", "--plot", "--out")
        ]
        for name in named:
            assert (tmp_path / name).exists(), name
        for name in set(named) & set(CSV_FILES):
            with open(name, encoding="utf-8", newline="") as file:
                columns = next(csv.reader(file))
            for column in columns:
                assert explained(column, CSV_FILES[name].MORE), column


def explained(column: str, text: str) -> bool:
    """Whether a column is named in the help; the first of a kind stands for the others."""
    column = re.sub(r"multiplier_\d", "multiplier_1", column)
    column = re.sub(r"initial_\w\d", "initial_x1", column)
    return re.search(rf"(?<!\w){re.escape(column)}(?!\w)", text) is not None


def test_a_column_that_is_not_named_is_noticed():
    assert not explained("impulse", simulate.MORE)


@pytest.mark.parametrize("command", cli.COMMANDS, ids=lambda command: command.__name__)
def test_help_fits_the_terminal(command, capsys):
    with pytest.raises(SystemExit) as stopped:
        cli.main([command.__name__.rpartition(".")[2], "--help"])
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


def test_every_parameter_is_explained():
    assert list(options.PARAMETERS) == list(NUMERIC_RANGES)


def test_defaults_in_help_are_those_of_the_functions(capsys):
    def defaults(function):
        return {name: item.default for name, item in inspect.signature(function).parameters.items()}

    diagram_defaults = defaults(vi.bifurcation_diagram)
    with pytest.raises(SystemExit):
        cli.main(["diagram", "--help"])
    text = " ".join(capsys.readouterr().out.split())
    for words, name in (
        ("drive periods", "periods"),
        ("keep the last K periods", "keep"),
        ("where chatter is completed", "tolerance"),
    ):
        assert f"{words} (default: {diagram_defaults[name]})" in text
    with pytest.raises(SystemExit):
        cli.main(["orbits", "--help"])
    text = " ".join(capsys.readouterr().out.split())
    assert f"with --search {defaults(vi.search_motions)['periods']})" in text
    assert f"size (default: {defaults(vi.follow_motion)['max_step']})" in text


def test_tables_name_their_columns():
    assert all(explained(name, bench.MORE) for name in bench.NAMES)
    assert all(explained(name, orbits.MORE) for name in motion_table.CSV_NAMES)

"""The commands that the reproduction adds, and the files they write, also where they cannot."""

import resource
import shlex
from importlib.metadata import entry_points
from itertools import pairwise
from pathlib import Path

import pytest

import vibroimpact as vi
from command_lines import fields
from han_jin_hu_2004 import INITIAL, MOTIONS, claims, reproduce, reproduction
from test_cli_help import FLAGS, WIDTH, examples
from vibroimpact import cli

COMMANDS = {point.name: point.load() for point in entry_points(group="vibroimpact.commands")}


def test_the_commands_are_there_where_the_reproduction_is_installed():
    assert set(COMMANDS) == set(cli.ELSEWHERE) == {"reproduce", "claims", "bench"}


@pytest.mark.parametrize("name", cli.ELSEWHERE)
def test_examples_run_and_write_their_files(name, run_command, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    lines = examples(COMMANDS[name])
    assert lines
    for line in lines:
        code, out, err = run_command(line)
        assert code == 0, err
        assert out
        words = shlex.split(line)
        for flag, file in pairwise(words):
            assert flag not in (*FLAGS, "--json") or Path(file).exists(), file


@pytest.mark.parametrize("name", cli.ELSEWHERE)
def test_help_fits_the_terminal(name, capsys):
    command = COMMANDS[name]
    with pytest.raises(SystemExit) as stopped:
        cli.main([name, "--help"])
    assert stopped.value.code == 0
    text = capsys.readouterr().out
    assert command.ABOUT in text
    assert command.MORE in text
    assert max(map(len, f"{command.ABOUT}\n{command.MORE}".splitlines())) < WIDTH


def test_the_command_of_a_claim_gives_its_label(run_command):
    (motion,) = [motion for motion in MOTIONS if motion.id == "9(1)"]
    run = vi.simulate(motion.system, initial=INITIAL, periods=600, keep=100)
    claim = claims.evaluate(motion, run)
    program, line = claim.command.split(None, 1)
    assert program == "vibroimpact"
    code, out, _ = run_command(line)
    assert (code, fields(out)["label"]) == (0, claim.found)


def test_pages_of_the_paper_on_a_full_disk(tmp_path):
    (tmp_path / "claims.md").write_text("old")
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (100, limits[1]))
    try:
        with pytest.raises(OSError, match="cannot be written") as caught:
            reproduce(tmp_path, figures=[9], progress=False)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
    assert Path(caught.value.filename).suffix == ".png"
    assert [path.name for path in tmp_path.iterdir()] == ["claims.md"]
    assert (tmp_path / "claims.md").read_text() == "old"


def test_an_interrupted_reproduction_of_the_paper(monkeypatch, tmp_path, run_command):
    def page(job, figure):
        if figure == 10:
            raise KeyboardInterrupt
        job.files.append(job.out / f"fig{figure}.png")

    monkeypatch.setattr(reproduction._Job, "motion_pages", page)
    with pytest.raises(vi.Interrupted) as caught:
        reproduction.reproduce(tmp_path, figures=[9, 10], progress=False)
    assert caught.value.result.files == [tmp_path / "fig9.png"]
    assert not list(tmp_path.iterdir())  # no claims of a part
    code, out, err = run_command("reproduce --figures 9 10 --quiet --out", tmp_path)
    assert (code, out, err) == (130, "", "vibroimpact: interrupted after 1 files\n")

"""The commands that the reproduction adds, and the files they write, also where they cannot."""

import multiprocessing
import resource
import shlex
from concurrent.futures import as_completed
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
    code, out, err = run_command("reproduce --figures 9 10 --workers 1 --quiet --out", tmp_path)
    assert (code, out, err) == (130, "", "vibroimpact: interrupted after 1 files\n")


def test_pages_made_side_by_side_are_those_made_one_after_the_other(tmp_path):
    one, two = (
        reproduction.reproduce(
            tmp_path / str(processes),
            figures=[5, 6],
            workers=1,
            processes=processes,
            progress=False,
        )
        for processes in (1, 2)
    )
    assert [path.name for path in one.files] == [path.name for path in two.files]
    assert one.claims == two.claims
    for first, second in zip(one.files, two.files, strict=True):
        assert first.read_bytes() == second.read_bytes()


def test_a_page_that_fails_in_another_process_is_reported(tmp_path):
    (tmp_path / "fig6.png").mkdir()
    with pytest.raises(OSError, match=r"fig6\.png"):
        reproduction.reproduce(tmp_path, figures=[5, 6], processes=2, progress=False)


def test_ctrl_c_keeps_what_was_made_side_by_side(monkeypatch, tmp_path):
    def first_then_ctrl_c(futures):
        yield next(iter(as_completed(futures)))
        raise KeyboardInterrupt

    monkeypatch.setattr(reproduction, "as_completed", first_then_ctrl_c)
    # Those of other tests may still run.
    before = set(multiprocessing.active_children())
    with pytest.raises(vi.Interrupted) as caught:
        reproduction.reproduce(tmp_path, figures=[5, 6], processes=2, progress=False)
    (file,) = caught.value.result.files
    assert file.name in ("fig5.png", "fig6.png")
    assert file.is_file()
    assert set(multiprocessing.active_children()) <= before
    assert not (tmp_path / "claims.md").exists()

"""The commands that the reproduction adds, and the files they write, also where they cannot."""

import resource
from pathlib import Path

import pytest

import vibroimpact as vi
from command_lines import fields
from han_jin_hu_2004 import INITIAL, MOTIONS, claims, reproduce, reproduction


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

"""The gallery: each script draws at reduced size, and its picture and its page are there."""

import re
import runpy
from pathlib import Path

import pytest
from matplotlib.image import imread

import repository

ROOT = repository.root()
FOLDER = ROOT / "examples" / "gallery"
SCRIPTS = sorted(path for path in FOLDER.glob("*.py") if path.stem != "picture")
PICTURES = ROOT / "docs" / "images" / "gallery"
PAGE = (ROOT / "docs" / "gallery.md").read_text(encoding="utf-8")
# A page should not take long to load.
LARGEST_PICTURE = 500_000


def names(script: Path, monkeypatch) -> dict:
    """What a script defines; its neighbours are on the path, as when it is run."""
    monkeypatch.syspath_prepend(str(FOLDER))
    return runpy.run_path(str(script))


def test_there_are_at_least_ten():
    assert len(SCRIPTS) >= 10


@pytest.mark.parametrize("script", SCRIPTS, ids=lambda path: path.stem)
def test_a_script_draws_its_picture(script, tmp_path, monkeypatch, capsys):
    drawn = []
    script_names = names(script, monkeypatch)

    def draw(quick: bool):
        assert quick
        drawn.append(script_names["draw"](quick))
        return drawn[0]

    out = tmp_path / "small.png"
    script_names["main"](draw, str(script), ["--quick", "--out", str(out)])
    assert capsys.readouterr().out == f"{out}\n"
    (figure,) = drawn
    panels = [ax for ax in figure.axes if ax.get_label() != "<colorbar>"]
    assert panels
    for ax in panels:
        assert ax.collections or ax.lines
        assert ax.get_ylabel()
    assert panels[-1].get_xlabel()
    pixels = imread(out)
    assert pixels.shape[1] == 1800
    # Something in colour or black is on the white page.
    assert (pixels[..., :3] < 0.9).any(axis=-1).mean() > 0.01


@pytest.mark.parametrize("script", SCRIPTS, ids=lambda path: path.stem)
def test_the_picture_is_kept_and_shown_with_its_command(script):
    picture = PICTURES / f"{script.stem}.png"
    assert 5_000 < picture.stat().st_size <= LARGEST_PICTURE
    assert imread(picture).shape[1] == 1800
    assert f"](images/gallery/{picture.name})" in PAGE
    assert f"python examples/gallery/{script.name}\n" in PAGE


def test_the_page_shows_nothing_else():
    stems = [script.stem for script in SCRIPTS]
    assert sorted(re.findall(r"\]\(images/gallery/(\w+)\.png\)", PAGE)) == stems
    assert sorted(path.stem for path in PICTURES.iterdir()) == stems
    assert sorted(re.findall(r"python examples/gallery/(\w+)\.py", PAGE)) == stems


def test_a_figure_can_be_written_as_pdf(tmp_path, monkeypatch):
    script = FOLDER / "lyapunov_convergence.py"
    out = tmp_path / "page.pdf"
    found = names(script, monkeypatch)
    found["main"](found["draw"], str(script), ["--quick", "--out", str(out)])
    assert out.read_bytes().startswith(b"%PDF")


def test_bad_arguments_are_refused(monkeypatch, capsys):
    script = SCRIPTS[0]
    found = names(script, monkeypatch)
    with pytest.raises(SystemExit) as caught:
        found["main"](found["draw"], str(script), ["--fast"])
    assert caught.value.code == 2
    assert "--fast" in capsys.readouterr().err

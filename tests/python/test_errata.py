"""The figures of the errata: each draws at reduced size; its picture and command are there."""

import re
import runpy

import pytest
from matplotlib.image import imread

import repository

ROOT = repository.root()
FOLDER = ROOT / "examples" / "errata"
PICTURES = ROOT / "docs" / "images" / "errata"
PAGE = (ROOT / "docs" / "errata.md").read_text(encoding="utf-8")
NAMES = sorted(path.stem for path in FOLDER.glob("*.py") if path.stem != "__main__")
# A page should not take long to load.
LARGEST_PICTURE = 150_000


@pytest.fixture
def program(monkeypatch) -> dict:
    """What the program defines; its modules are on the path, as when it is run."""
    monkeypatch.syspath_prepend(str(FOLDER))
    return runpy.run_path(str(FOLDER / "__main__.py"))


def test_every_module_is_a_figure(program):
    assert sorted(program["FIGURES"]) == NAMES


@pytest.mark.parametrize("name", NAMES)
def test_a_figure_is_drawn(name, program, tmp_path, capsys):
    out = tmp_path / "small.png"
    program["main"]([name, "--quick", "--out", str(out)])
    assert capsys.readouterr().out == f"{out}\n"
    # Something in colour or black is on the white page.
    assert (imread(out)[..., :3] < 0.9).any(axis=-1).mean() > 0.01


@pytest.mark.parametrize("name", NAMES)
def test_its_axes_have_names(name, program):
    figure = program["FIGURES"][name](True)
    panels = [ax for ax in figure.axes if ax.get_label() != "<colorbar>"]
    assert panels
    for ax in panels:
        assert ax.collections or ax.lines
        assert ax.get_xlabel()
    assert panels[0].get_ylabel()


def test_the_pictures_are_kept_and_shown_with_their_commands():
    assert sorted(path.stem for path in PICTURES.iterdir()) == NAMES
    assert sorted(re.findall(r"\]\(images/errata/(\w+)\.png\)", PAGE)) == NAMES
    assert sorted(re.findall(r"^python examples/errata (\w+)$", PAGE, re.M)) == NAMES
    for path in PICTURES.iterdir():
        assert 5_000 < path.stat().st_size <= LARGEST_PICTURE


def test_an_unknown_figure_is_refused(program, capsys):
    with pytest.raises(SystemExit) as caught:
        program["main"](["no_such_figure"])
    assert caught.value.code == 2
    assert "no_such_figure" in capsys.readouterr().err

"""The other pictures of the documentation: each is there, shown, and drawn by one script."""

import runpy

import pytest
from PIL import Image

import repository

ROOT = repository.root()
SCRIPT = ROOT / "examples" / "pictures.py"
IMAGES = ROOT / "docs" / "images"
# Drawn by scripts of their own, or by the benchmarks.
OTHERS = {"schematic", "work_precision"}
LARGEST_PICTURE = 300_000


@pytest.fixture(scope="module")
def script():
    return runpy.run_path(str(SCRIPT))


def test_every_picture_has_its_script(script):
    names = list(script["PICTURES"])
    assert {path.stem for path in IMAGES.glob("*.png")} == {*names, *OTHERS}
    makefile = (ROOT / "Makefile").read_text(encoding="utf-8")
    assert f"PICTURES := {' '.join(names)}\n" in makefile
    assert "python examples/pictures.py $$name --out docs/images/$$name.png" in makefile
    pages = "".join(path.read_text(encoding="utf-8") for path in (ROOT / "docs").rglob("*.md"))
    pages += (ROOT / "README.md").read_text(encoding="utf-8")
    for name in names:
        assert f"images/{name}.png)" in pages
        assert 5_000 < (IMAGES / f"{name}.png").stat().st_size <= LARGEST_PICTURE


@pytest.mark.parametrize("name", ["fig7c-contact", "fig8-regimes"])
def test_a_picture_is_drawn(script, name, tmp_path, capsys):
    out = tmp_path / "small.png"
    script["main"]([name, "--quick", "--out", str(out)])
    assert capsys.readouterr().out == f"{out}\n"
    with Image.open(out) as drawn, Image.open(IMAGES / f"{name}.png") as kept:
        assert drawn.width == kept.width


def test_the_explorer_is_shown(script, tmp_path):
    out = tmp_path / "small.png"
    script["main"](["explorer", "--quick", "--out", str(out)])
    with Image.open(out) as drawn:
        assert len(drawn.convert("RGB").getcolors(1_000_000)) > 100


@pytest.mark.parametrize("page", ["README.md", "docs/index.md"])
def test_the_first_pages_name_the_explorer(page):
    text = (ROOT / page).read_text(encoding="utf-8")
    for part in ("`vi.explore(system)`", "`vibroimpact explore`", "explorer.md)"):
        assert part in text
    assert page == "README.md" or "(images/explorer.png)" in text

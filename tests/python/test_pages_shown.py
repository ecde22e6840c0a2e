"""Pages that the site runs: their cells, the notebook of the tutorial, sketches of words."""

import json
import re
import runpy
from types import SimpleNamespace

import pytest
from matplotlib.image import imread

import repository
import test_docs
import vibroimpact as vi

ROOT = repository.root()
DOCS = ROOT / "docs"
SKETCHES = DOCS / "images" / "words"
# A page has twenty of them.
LARGEST_SKETCH = 30_000


def script(path: str) -> SimpleNamespace:
    return SimpleNamespace(**runpy.run_path(str(ROOT / path)))


@pytest.fixture(scope="module")
def executed() -> SimpleNamespace:
    return script("docs/executed.py")


@pytest.fixture(scope="module")
def words() -> SimpleNamespace:
    return script("examples/words.py")


def test_a_page_is_cut_into_text_and_code(executed):
    page = "# Title\n\ntext\n\n```python\na = 1\n\nb\n```\n\n```sh\nls\n```\n```python\nc\n```\n"
    assert executed.cells(page) == [
        ("markdown", 0, "# Title\n\ntext"),
        ("code", 5, "a = 1\n\nb"),
        ("markdown", 9, "```sh\nls\n```"),
        ("code", 14, "c"),
    ]


def executed_pages() -> list[str]:
    settings = (DOCS / "conf.py").read_text(encoding="utf-8")
    listed = settings.split("EXECUTED = (", 1)[1].split("\n)\n", 1)[0]
    return re.findall(r'"([\w/-]+)"', listed)


@pytest.mark.parametrize("page", executed_pages())
def test_a_page_that_the_site_runs_has_code_that_is_tested(executed, page):
    path = DOCS / f"{page}.md"
    cells = executed.cells(path.read_text(encoding="utf-8"))
    code = [text for kind, _, text in cells if kind == "code"]
    assert code
    assert code == [block.strip("\n") for block in test_docs.blocks(path)]
    assert path in test_docs.PAGES_WITH_BLOCKS


@pytest.mark.parametrize("path", sorted(DOCS.rglob("*.md")), ids=lambda path: path.stem)
def test_a_page_whose_code_draws_has_pictures(path):
    name = path.relative_to(DOCS).with_suffix("").as_posix()
    draws = any("vi.plot." in block or "pyplot" in block for block in test_docs.blocks(path))
    has_pictures = name in executed_pages() or "![" in path.read_text(encoding="utf-8")
    assert has_pictures or not draws


def test_the_notebook_is_that_of_the_page(executed):
    page = (DOCS / "tutorial.md").read_text(encoding="utf-8")
    kept = (DOCS / "tutorial.ipynb").read_text(encoding="utf-8")
    assert kept == executed.text(page), "run `make notebook`"
    code = [cell["source"] for cell in json.loads(kept)["cells"] if cell["cell_type"] == "code"]
    assert code == [block.strip("\n") for block in test_docs.blocks(DOCS / "tutorial.md")]


def test_every_drawing_function_is_on_its_page():
    page = (DOCS / "drawing.md").read_text(encoding="utf-8")
    called = {*re.findall(r"vi\.plot\.(\w+)\(", page)}
    named = {*re.findall(r"^(`\w+`(?:, `\w+`)*):", page, re.M)}
    listed = {name for names in named for name in re.findall(r"\w+", names)}
    # What draws takes axes; the others make entries of legends and texts, or are styles.
    functions = {
        name
        for name in vi.plot.__all__
        if callable(getattr(vi.plot, name))
        and not isinstance(getattr(vi.plot, name), type)
        and not name.endswith("_handles")
        and name not in ("label_text", "publication_style")
    }
    assert called == functions
    assert listed == functions


def test_every_word_has_its_sketch(words):
    page = (DOCS / "words.md").read_text(encoding="utf-8")
    shown = re.findall(
        r"^\| \*\*[\w -]+\*\* \| !\[[^]]+\]\(images/words/(\w+)\.png\) \|", page, re.M
    )
    assert len(shown) == 20
    assert sorted(shown) == sorted(words.SKETCHES)
    assert sorted(path.stem for path in SKETCHES.iterdir()) == sorted(shown)


def test_the_sketches_are_drawn(words, tmp_path, capsys):
    words.main(["--out", str(tmp_path)])
    assert capsys.readouterr().out == f"{tmp_path}\n"
    for name in words.SKETCHES:
        drawn, kept = tmp_path / f"{name}.png", SKETCHES / f"{name}.png"
        pixels = imread(drawn)
        assert pixels.shape == imread(kept).shape
        assert kept.stat().st_size <= LARGEST_SKETCH
        # Something in colour or black is on the white page.
        assert (pixels[..., :3] < 0.9).any(axis=-1).mean() > 0.01


def test_the_commands_are_there():
    makefile = (ROOT / "Makefile").read_text(encoding="utf-8")
    assert "python examples/words.py --out docs/images/words\n" in makefile
    assert "python docs/executed.py\n" in makefile
    contributing = (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8")
    for command in ("words", "notebook"):
        assert f"| `make {command}` |" in contributing

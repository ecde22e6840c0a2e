"""The documentation site: links that lead nowhere are found, and no page is left out."""

import runpy
from pathlib import Path
from types import SimpleNamespace

import pytest

import repository

ROOT = repository.root()
DOCS = ROOT / "docs"


@pytest.fixture(scope="module")
def check_links() -> SimpleNamespace:
    return SimpleNamespace(**runpy.run_path(str(DOCS / "check_links.py")))


def write(site: Path, pages: dict[str, str]) -> None:
    for name, text in pages.items():
        path = site / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")


def test_a_site_whose_links_lead_on_passes(check_links, tmp_path, capsys):
    write(
        tmp_path,
        {
            "index.html": '<a href="docs/one.html#here">1</a> <a href="https://example.org">2</a>',
            "docs/one.html": '<p id="here"><a href="#here">3</a> <a href="../rust/x.html">4</a>',
            "rust/x.html": '<a href="rustdoc-checks-this.html">5</a>',
        },
    )
    assert check_links.main(str(tmp_path)) == 0
    assert capsys.readouterr().out == ""


@pytest.mark.parametrize(
    "link", ["gone.html", "index.html#gone", "#gone", "picture.png", "rust/gone.html"]
)
@pytest.mark.parametrize("tag", ['<a href="{}">', '<img src="{}">'])
def test_a_link_that_leads_nowhere_is_named(check_links, tmp_path, capsys, link, tag):
    write(tmp_path, {"index.html": tag.format(link)})
    assert check_links.main(str(tmp_path)) == 1
    assert capsys.readouterr().out == f"index.html: {link} leads nowhere\n"


def test_a_site_without_pages_is_no_site(check_links, tmp_path):
    assert check_links.main(str(tmp_path)) == 1


def test_the_crate_is_linked():
    page = (DOCS / "api" / "rust.md").read_text(encoding="utf-8")
    assert 'href="../../rust/vibroimpact/index.html"' in page

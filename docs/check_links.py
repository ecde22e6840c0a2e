"""Checks that every link within a built site leads somewhere: files, pictures, and places in pages.

Run ``python docs/check_links.py site``; prints the links that lead nowhere, and then ends with 1.
Sphinx checks what it writes itself, but not links into the reference of the crate, nor those of the
theme. Pages of the crate are looked into for places only; rustdoc checks its own links.
"""

import sys
from collections import defaultdict
from functools import cache
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urlsplit


class Page(HTMLParser):
    """The places and links of a page."""

    def __init__(self, path: Path) -> None:
        super().__init__()
        self.places: set[str] = set()
        self.links: list[str] = []
        self.feed(path.read_text(encoding="utf-8"))

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        """Note what a tag names and where it leads."""
        for name, value in attrs:
            if name == "id" and value:
                self.places.add(value)
            elif name in ("href", "src") and value:
                self.links.append(value)


def broken_links(site: Path) -> dict[Path, list[str]]:
    """Return the links that lead nowhere, by the page that has them."""
    read = cache(Page)
    broken = defaultdict(list)
    for path in sorted(site.rglob("*.html")):
        if path.relative_to(site).parts[0] == "rust":
            continue
        for link in read(path).links:
            parts = urlsplit(link)
            if parts.scheme or parts.netloc:
                continue
            target = (path.parent / unquote(parts.path)).resolve() if parts.path else path
            place = unquote(parts.fragment)
            found = target.is_file()
            if found and place and target.suffix == ".html":
                found = place in read(target).places
            if not found:
                broken[path].append(link)
    return dict(broken)


def main(site: str) -> int:
    """Print the links that lead nowhere; return 1 if there are any, or no pages at all."""
    folder = Path(site).resolve()
    pages = list(folder.rglob("*.html"))
    broken = broken_links(folder)
    for path, links in broken.items():
        for link in links:
            print(f"{path.relative_to(folder)}: {link} leads nowhere")
    return int(bool(broken) or not pages)


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))

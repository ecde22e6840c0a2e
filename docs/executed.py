"""Pages as notebooks: what is in a fence of Python is a cell of code, all else is text.

The site runs the pages that ``docs/conf.py`` names, and shows what each block prints and draws.
``python docs/executed.py`` writes ``docs/tutorial.ipynb`` from ``docs/tutorial.md`` (``make
notebook``); a test compares the two.
"""

import json
import re
from pathlib import Path
from typing import Any

FOLDER = Path(__file__).parent
BLOCK = re.compile(r"^```python\n(.*?)^```\n?", re.M | re.S)
# Comes before a page: what a block ends with is shown, but of axes their picture alone.
AXES_ARE_PICTURES = """\
from matplotlib.axes import Axes

get_ipython().display_formatter.ipython_display_formatter.for_type(Axes, lambda axes: None)
"""
KERNEL = {"name": "python3", "display_name": "Python 3", "language": "python"}


def cells(page: str) -> list[tuple[str, int, str]]:
    """Return kind, first line and text of each cell of a page, those without text left out."""
    pieces, end = [], 0
    for found in BLOCK.finditer(page):
        pieces += [("markdown", end, page[end : found.start()]), ("code", found.start(1), found[1])]
        end = found.end()
    pieces.append(("markdown", end, page[end:]))
    return [
        (kind, page.count("\n", 0, start), text.strip("\n"))
        for kind, start, text in pieces
        if text.strip()
    ]


def notebook(page: str) -> dict[str, Any]:
    """Return a page as a notebook that has not been run; no cell depends on when it was made."""
    made = []
    for number, (kind, _, text) in enumerate(cells(page)):
        cell = {"cell_type": kind, "id": f"cell-{number}", "metadata": {}, "source": text}
        made.append(cell | ({"execution_count": None, "outputs": []} if kind == "code" else {}))
    metadata = {"kernelspec": KERNEL, "language_info": {"name": "python"}}
    return {"cells": made, "metadata": metadata, "nbformat": 4, "nbformat_minor": 5}


def read(page: str) -> Any:
    """Return a page as the site's builder wants it, with the lines that its warnings name."""
    import nbformat

    made = nbformat.from_dict(notebook(page))
    hidden = {"metadata": {"tags": ["remove-cell"]}, "id": "axes"}
    made.cells.insert(0, nbformat.v4.new_code_cell(AXES_ARE_PICTURES, **hidden))
    made.metadata["source_map"] = [0, *(line for _, line, _ in cells(page))]
    return made


def text(page: str) -> str:
    """Return a notebook's file."""
    return json.dumps(notebook(page), indent=1, ensure_ascii=False) + "\n"


if __name__ == "__main__":
    tutorial = (FOLDER / "tutorial.md").read_text(encoding="utf-8")
    (FOLDER / "tutorial.ipynb").write_text(text(tutorial), encoding="utf-8")

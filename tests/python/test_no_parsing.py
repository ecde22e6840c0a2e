"""Meaning is in types: the package takes text apart only where it comes from files or users."""

import ast
from collections import Counter
from pathlib import Path

import pytest

import vibroimpact as vi

PACKAGE = Path(vi.__file__).parent
AFFIXES = {"startswith", "endswith", "removeprefix", "removesuffix"}
CUTS = {"split", "rsplit", "partition", "rpartition"}
# How often, and what is taken apart there.
ALLOWED = {
    "arguments.py": (1, "a function's name in Python, for a message"),
    "cli/__init__.py": (2, "words of a command line"),
    "cli/exit_codes.py": (1, "lines of a help text"),
    "cli/hints.py": (5, "words of a command line"),
    "cli/options.py": (1, "a comma of a message"),
    "explorer/structure_numbers.py": (2, "differences of coordinates, as the page names them"),
    "fitting/record.py": (1, "comments of a file"),
    "interruption.py": (1, "underscore of names in Python"),
    "proof/certificate.py": (1, "exact numbers in a file"),
    "sweeps/basins/files.py": (2, "names of arrays in a file"),
    "sweeps/merge.py": (1, "names of folders of a store"),
    "sweeps/store_layout.py": (1, "names of flags of a store"),
    "verbs.py": (1, "module and function of an entry of the registry"),
}
MODULES = sorted(PACKAGE.rglob("*.py"))


def takes_text_apart(node: ast.AST) -> bool:
    """Whether a call looks for a part of a text, or cuts it at one that is written there."""
    if not (isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute)):
        return False
    texts = [each for each in node.args if isinstance(each, ast.Constant | ast.JoinedStr)]
    return node.func.attr in AFFIXES or (node.func.attr in CUTS and bool(texts))


def places(source: str) -> int:
    """How many such calls a source has."""
    return sum(map(takes_text_apart, ast.walk(ast.parse(source))))


def test_text_is_taken_apart_where_it_comes_in_and_nowhere_else():
    found = Counter(
        {path.relative_to(PACKAGE).as_posix(): places(path.read_text("utf-8")) for path in MODULES}
    )
    assert +found == {name: count for name, (count, _) in ALLOWED.items()}


@pytest.mark.parametrize(
    ("source", "count"),
    [
        ('leg.startswith("impact")', 1),
        ('kind, rest = test.split(": ", 1)', 1),
        ('path.end.removeprefix("stopped: ").split(":")[0]', 2),
        ('leg.endswith(":release") or leg.removesuffix(end)', 2),
        ('test.rsplit(", leg ", 1), name.partition(":")', 2),
        ("words = line.split(), path.stem, np.split(rows, places)", 0),
    ],
)
def test_what_counts(source, count):
    assert places(source) == count

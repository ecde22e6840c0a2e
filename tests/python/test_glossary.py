"""The glossary has every public type of the crate and of the package, and no other.

The types of the crate are read from its sources: what `src/lib.rs` and its public modules define
or hand on with `pub use`. Those of the package are the classes in the `__all__` of its public
modules. A failure names the line of docs/glossary.md to edit.
"""

import importlib
import inspect
import re
from pathlib import Path

import pytest

import repository
from test_docs import REFERENCE

ROOT = repository.root()
PAGE = ROOT / "docs" / "glossary.md"
LIBRARY = ROOT / "src" / "lib.rs"
MOST_ENTRIES = 40


def rows(page: str) -> list[tuple[int, list[str]]]:
    """The entries of the table: number of the line, and the text of each column."""
    lines = page.splitlines()
    first = next(i for i, line in enumerate(lines) if line.startswith("| word |")) + 2
    found = []
    for number, line in enumerate(lines[first:], start=first + 1):
        if not line.startswith("|"):
            break
        found.append((number, [cell.strip() for cell in line.strip("|").split("|")]))
    return found


ROWS = rows(PAGE.read_text(encoding="utf-8"))
NAMED = {
    name: line for line, cells in ROWS for name in re.findall(r"`(\w+)`", cells[-1])
}  # with the line where each stands


def without_comments(source: str) -> str:
    """A Rust source without comments, and without items that an attribute `cfg` may leave out."""
    source = re.sub(r"//[^\n]*", "", source)
    return re.sub(r"#\[cfg\([^\]]*\)\]\s*(#\[[^\]]*\]\s*)*[^\n]*", "", source)


def rust_types(file: Path) -> dict[str, str]:
    """The public types that a module makes reachable, with the file that does."""
    source = without_comments(file.read_text(encoding="utf-8"))
    names = re.findall(r"^pub (?:struct|enum|trait|type|union) (\w+)", source, re.M)
    for path in re.findall(r"^pub use ([^;]+);", source, re.M):
        braces = re.search(r"\{(.*)\}", path, re.S)
        listed = braces[1].split(",") if braces else [path.rpartition("::")[2]]
        handed_on = [name.strip().rpartition(" as ")[2] for name in listed]
        # Types are in CamelCase; constants are in capitals, functions and modules in small letters.
        names += [name for name in handed_on if re.match(r"[A-Z]\w*[a-z]", name)]
    found = dict.fromkeys(names, file.name)
    folder = file.parent if file.name == "lib.rs" else file.with_suffix("")
    for module in re.findall(r"^pub mod (\w+);", source, re.M):
        found |= rust_types(folder / f"{module}.rs")
    return found


def python_types() -> dict[str, str]:
    """The public classes of the package, with the module that lists each."""
    modules = [name for name in REFERENCE if name.split(".")[0] == "vibroimpact"]
    found = {}
    for module in map(importlib.import_module, modules):
        for name in module.__all__:
            if inspect.isclass(getattr(module, name)):
                found.setdefault(name, f"{module.__name__}.__all__")
    return found


@pytest.mark.parametrize("types", [rust_types(LIBRARY), python_types()], ids=["Rust", "Python"])
def test_every_public_type_has_an_entry(types):
    assert len(types) > 30
    for name, place in types.items():
        assert name in NAMED, (
            f"{name}, public in {place}, is not in the glossary: add `{name}` to the last column "
            f"of the entry it belongs to, docs/glossary.md, lines {ROWS[0][0]} to {ROWS[-1][0]}"
        )


def test_no_entry_names_what_is_not_public():
    public = {*rust_types(LIBRARY), *python_types()}
    for name, line in NAMED.items():
        assert name in public, (
            f"docs/glossary.md:{line}: neither library has a public type {name}; delete it there"
        )


def test_every_entry_has_a_meaning_and_a_listed_source():
    sources = PAGE.read_text(encoding="utf-8").split("\nSources: ", 1)[1]
    assert len(ROWS) <= MOST_ENTRIES, f"docs/glossary.md has {len(ROWS)} entries: join some"
    for line, (word, meaning, source, types) in ROWS:
        assert all((word, meaning)), f"docs/glossary.md:{line}: an empty cell"
        assert source or types, f"docs/glossary.md:{line}: neither a textbook nor a type"
        for key in re.findall(r"\[\w+\]", source):
            assert f"{key} " in sources, f"docs/glossary.md:{line}: {key} is not below the table"


def test_words_and_types_stand_once():
    words = [word for _, cells in ROWS for word in cells[0].split(", ")]
    types = [name for _, cells in ROWS for name in re.findall(r"`(\w+)`", cells[-1])]
    for found in (words, types):
        twice = {each for each in found if found.count(each) > 1}
        assert not twice, f"docs/glossary.md has more than one entry of {sorted(twice)}"


def test_a_type_is_found_wherever_it_is_made_public(tmp_path):
    (tmp_path / "lib.rs").write_text(
        "pub mod shapes;\nmod hidden;\n// pub struct Comment;\n"
        "pub use hidden::{Ball as Sphere, LIMIT, area};\npub use hidden::Cone;\n"
        "pub(crate) use hidden::Private;\n#[cfg(test)]\npub mod absent;\npub trait Solid {}\n"
    )
    (tmp_path / "shapes.rs").write_text("pub mod flat;\nstruct Mine;\npub enum Kind { A }\n")
    (tmp_path / "shapes").mkdir()
    (tmp_path / "shapes" / "flat.rs").write_text("#[derive(Debug)]\npub struct Square<T>(T);\n")
    assert {*rust_types(tmp_path / "lib.rs")} == {"Sphere", "Cone", "Solid", "Kind", "Square"}

"""The documentation holds: its Python blocks run, its tables name what exists, its links lead on.

Rust blocks of the README are executed by rustdoc (``make test``).
"""

import dataclasses
import functools
import importlib
import re
import tomllib
from pathlib import Path

import matplotlib as mpl
import pytest
from matplotlib import pyplot

import repository
import vibroimpact as vi
from systems import PAPER
from vibroimpact._core import CONTACTS, LAWS, PARAMETERS, EvidenceKind
from vibroimpact.orbits import BifurcationKind
from vibroimpact.single_impact.results import SOLUTION_DTYPE
from vibroimpact.sweeps.results import GridResult

ROOT = repository.root()
PAGES = sorted(
    [*ROOT.glob("*.md"), *(ROOT / "reproduction").glob("*.md"), *(ROOT / "docs").rglob("*.md")]
)
NOTATION = (ROOT / "docs" / "notation.md").read_text(encoding="utf-8")


def blocks(page: Path, language: str = "python") -> list[str]:
    """Every fenced block of a page in a language."""
    return re.findall(rf"^```{language}\n(.*?)^```$", page.read_text(encoding="utf-8"), re.M | re.S)


def first_column(section: str) -> list[str]:
    """The back-quoted names in the first column of the table of a section of notation.md."""
    text = NOTATION.split(f"\n## {section}\n", 1)[1].split("\n## ", 1)[0]
    return re.findall(r"^\| `([^`]+)` \|", text, re.M)


def name(page: Path) -> str:
    """The path of a page within the repository."""
    return page.relative_to(ROOT).as_posix()


PAGES_WITH_BLOCKS = [page for page in PAGES if blocks(page)]


def test_the_rust_version_that_is_named_is_no_older_than_that_of_the_crate():
    def version(text: str) -> tuple[int, ...]:
        return tuple(map(int, text.split(".")))

    named = {
        found
        for page in ("README.md", "CONTRIBUTING.md")
        for found in re.findall(r"Rust ([\d.]+\d) or", (ROOT / page).read_text(encoding="utf-8"))
    }
    assert len(named) == 1  # one version, wherever it is named
    manifest = tomllib.loads((ROOT / "Cargo.toml").read_text(encoding="utf-8"))
    assert version(*named) >= version(manifest["package"]["rust-version"])


def test_the_readme_has_examples():
    assert ROOT / "README.md" in PAGES_WITH_BLOCKS


def test_pages_in_folders_are_collected():
    assert {name(page).count("/") for page in PAGES_WITH_BLOCKS} == {0, 1, 2}


@pytest.mark.parametrize("page", PAGES_WITH_BLOCKS, ids=name)
def test_python_blocks_run(page, tmp_path, monkeypatch):
    # The blocks of a page share their names, as a reader would run them one after another.
    monkeypatch.chdir(tmp_path)
    mpl.use("Agg")
    names = {"__name__": "__main__"}
    for number, block in enumerate(blocks(page), start=1):
        exec(compile(block, f"{name(page)}, Python block {number}", "exec"), names)
        pyplot.close("all")  # as the site does, which shows them


def test_rust_blocks_are_those_that_rustdoc_runs():
    # It runs the README and the front page of the crate.
    front = (ROOT / "src" / "lib.rs").read_text(encoding="utf-8")
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    run = re.sub(r"^//! ?", "", front, flags=re.M) + readme
    found = {name(page): blocks(page, "rust") for page in PAGES}
    assert found["docs/api/rust.md"]
    for page, shown in found.items():
        for block in shown:
            assert block in run, f"{page} shows Rust that no test runs"


@pytest.mark.parametrize("page", PAGES, ids=name)
def test_relative_links_lead_to_files(page):
    text = page.read_text(encoding="utf-8")
    for target in re.findall(r"\]\(([^)#\s]+)(?:#[^)]*)?\)", text):
        if "://" not in target:
            assert (page.parent / target).exists(), f"{page.name} links to {target}"


# The folders that hold what the pages name.
FOLDERS = ("benches", "docs", "examples", "fuzz", "python", "reproduction", "src", "tests")
# What programs write, which a clone does not have; git ignores it.
WRITTEN = re.compile(r"(benches|fuzz)/(.*/)?out/")


@functools.cache
def files() -> frozenset[str]:
    """Every source and page of the repository, by its path."""
    kinds = (".py", ".pyi", ".rs", ".md", ".c")
    found = (path for folder in FOLDERS for path in (ROOT / folder).rglob("*"))
    return frozenset(name(path) for path in found if path.suffix in kinds)


def code(text: str) -> list[str]:
    """The code of a page: what stands in back quotes, and the blocks in a fence."""
    if text.startswith("# Migration\n"):  # its first column has the names that are gone
        text = re.sub(r"^\|[^|]*", "", text, flags=re.M)
    fenced = re.findall(r"^```\w*\n(.*?)^```$", text, re.M | re.S)
    return fenced + re.findall(r"`([^`\n]+)`", text)


def paths_without_file(text: str, folder: Path) -> list[str]:
    """The paths in the code of a page, in a folder, that lead to nothing.

    A word in angle brackets stands for any name, and so does a star.
    """
    missing = []
    for each in code(text):
        pattern = rf"(?<![\w./<>*-])(?:{'|'.join(FOLDERS)})/[\w./<>*-]*[\w/>*]"
        for path in re.findall(pattern, each):
            glob = re.sub(r"<\w+>", "*", path)
            if WRITTEN.match(path) or any(ROOT.glob(glob)) or any(folder.glob(glob)):
                continue
            missing.append(path)
        # A file without its whole path: some file must end with these words.
        for path in re.findall(r"(?<![\w./<>*-])(\w+(?:/\w+)*\.(?:rs|pyi?))\b(?!/)", each):
            is_whole = path.split("/")[0] in FOLDERS
            if not is_whole and not any(file.endswith(f"/{path}") for file in files()):
                missing.append(path)
    return missing


def undefined_tests(text: str) -> list[str]:
    """The tests that the code of a page names and no file defines."""
    return [
        test
        for each in code(text)
        for test in re.findall(r"(?<![\w./-])test_\w+\b(?![./])", each)
        if test not in defined_tests()
    ]


@functools.cache
def defined_tests() -> frozenset[str]:
    """Every test that is defined in Python, and every file of them without its ending."""
    pages = [path for path in files() if Path(path).stem.startswith("test_")]
    texts = ((ROOT / path).read_text(encoding="utf-8") for path in pages)
    defined = {test for text in texts for test in re.findall(r"def (test_\w+)", text)}
    return frozenset(defined | {Path(path).stem for path in pages})


# The changelog tells of the past, too.
@pytest.mark.parametrize("page", [page for page in PAGES if page.stem != "CHANGELOG"], ids=name)
def test_files_and_tests_that_are_named_exist(page):
    text = page.read_text(encoding="utf-8")
    missing = paths_without_file(text, page.parent) + undefined_tests(text)
    assert not missing, f"{name(page)} names {', '.join(missing)}: no such file or test"


def test_a_file_or_test_that_is_gone_is_noticed():
    gone = "`src/no_such.rs` `run tests/python/no_such.py` `src/<law>/no_such` `search/no_such.rs`"
    assert paths_without_file(gone, ROOT) == [
        "src/no_such.rs",
        "tests/python/no_such.py",
        "src/<law>/no_such",
        "search/no_such.rs",
    ]
    assert paths_without_file("`src/*/tolerances.rs` `search/gap.rs` `fuzz/out/` src/x", ROOT) == []
    assert undefined_tests("`test_no_such`") == ["test_no_such"]
    assert undefined_tests("`test_docs.py`") == []


def test_the_page_on_rust_names_public_items():
    front = (ROOT / "src" / "lib.rs").read_text(encoding="utf-8")
    public = {*re.findall(r"^pub mod (\w+);", front, re.M)}
    for items in re.findall(r"^pub use [\w:]+(?:::(\w+)|::\{([^}]*)\});", front, re.M):
        public |= {*re.findall(r"\w+", " ".join(items))}
    table = (ROOT / "docs" / "api" / "rust.md").read_text(encoding="utf-8")
    cells = re.findall(r"^\|[^|]*\|([^|]*)\|$", table, re.M)
    named = {each for cell in cells for each in re.findall(r"`(\w+)(?:::|`)", cell)}
    assert named
    assert named <= public, f"not public: {named - public}"


@pytest.mark.parametrize("page", PAGES, ids=name)
def test_pictures_say_what_they_show(page):
    for text in re.findall(r"!\[([^\]]*)\]\(", page.read_text(encoding="utf-8")):
        assert len(text.split()) > 2, f"{page.name} has a picture with the text {text!r}"


# Where the names of a module are listed; those of packages are partly those of vi.
REFERENCE = {
    "vibroimpact": ("simulation", "orbits", "sweeps"),
    "vibroimpact.orbits": ("orbits",),
    "vibroimpact.single_impact": ("orbits",),
    "vibroimpact.sweeps": ("sweeps",),
    "vibroimpact.plot": ("plot",),
    "han_jin_hu_2004": ("paper",),
}


def entries(pages: tuple[str, ...]) -> list[str]:
    """The full names of the entries of pages of the reference."""
    found = []
    for page in pages:
        text = (ROOT / "docs" / "api" / f"{page}.md").read_text(encoding="utf-8")
        module = ""
        for kind, given in re.findall(r"^\.\. ([\w:]+):: ([\w.]+)", text, re.M):
            if kind in ("currentmodule", "automodule"):
                module = given
            else:
                found.append(given if "." in given else f"{module}.{given}")
    return found


@pytest.mark.parametrize("name", REFERENCE)
def test_the_reference_has_every_public_name(name):
    listed = entries(REFERENCE[name])
    assert len(listed) == len(set(listed))
    # A module is no entry of its own; a name may be listed as that of the whole package.
    module = importlib.import_module(name)
    public = {each for each in module.__all__ if each not in ("plot", "__version__")}
    for each in public:
        places = {f"{name}.{each}"}
        if hasattr(vi, each) and getattr(vi, each) is getattr(module, each):
            places.add(f"vibroimpact.{each}")
        assert places & {*listed}, each


def test_the_reference_lists_nothing_but_public_names():
    for entry in entries(tuple({page for pages in REFERENCE.values() for page in pages})):
        module, _, name = entry.rpartition(".")
        assert name in importlib.import_module(module).__all__, entry


def inherited(entry: type) -> set[str]:
    """The public names that a class has from other classes of the package."""
    bases = (base for base in entry.__mro__[1:] if base.__module__.startswith("vibroimpact"))
    return {name for base in bases for name in vars(base) if name[0] != "_"} - {*vars(entry)}


@pytest.mark.parametrize("page", ["simulation", "sweeps", "orbits"])
def test_the_reference_of_a_class_has_what_it_inherits(page):
    text = (ROOT / "docs" / "api" / f"{page}.md").read_text(encoding="utf-8")
    for name, options in re.findall(r"^\.\. autoclass:: ([\w.]+).*\n((?: {3}:.*\n)*)", text, re.M):
        if ":members:" in options and ":inherited-members:" not in options:
            module, _, own = (name if "." in name else f"vibroimpact.{name}").rpartition(".")
            assert not inherited(getattr(importlib.import_module(module), own)), name


def test_every_public_module_has_its_reference():
    page = (ROOT / "docs" / "deprecation.md").read_text(encoding="utf-8")
    row = next(line for line in page.splitlines() if "`__all__`" in line)
    public = {*re.findall(r"`(vibroimpact(?:\.\w+)?)`", row)}
    assert public == REFERENCE.keys() - {"han_jin_hu_2004"}


@pytest.fixture(scope="module")
def run():
    return vi.simulate(PAPER, initial=(0, 0.5, 0, 0), periods=3)


def test_notation_names_every_parameter(run):
    assert first_column("Parameters") == list(run.system.to_dict())


@pytest.mark.parametrize(("name", "parameter"), PARAMETERS.items(), ids=PARAMETERS)
def test_the_table_of_parameters_is_that_of_the_core(name, parameter):
    default = "" if parameter.default is None else f"{parameter.default:g}"
    (row,) = re.findall(rf"^\| `{name}` \|(.*)\|$", NOTATION, re.M)[:1]
    symbol, meaning, allowed, _, value = (cell.strip() for cell in row.split(" |"))
    assert (symbol, meaning, allowed, value) == (
        parameter.symbol,
        parameter.meaning,
        parameter.allowed,
        default,
    )


@pytest.mark.parametrize(("name", "choices"), [("contact", CONTACTS), ("law", LAWS)])
def test_the_table_of_parameters_names_the_choices(name, choices):
    (row,) = re.findall(rf"^\| `{name}` \|(.*)\|$", NOTATION, re.M)
    assert re.findall(r"`(\w+)`", row) == [*choices, choices[0]]


@pytest.mark.parametrize(
    ("section", "table"),
    [("Impacts", "impacts"), ("Grazes", "grazes"), ("Sustained contact", "contacts")],
)
def test_notation_names_every_column(run, section, table):
    assert first_column(section) == list(getattr(run, table).dtype.names)


@pytest.mark.parametrize(("section", "kind"), [("Regimes", vi.Regime), ("Events", vi.EventKind)])
def test_notation_names_every_member(section, kind):
    assert first_column(section) == [member.name for member in kind]


def test_notation_names_every_attribute_of_a_motion():
    fields = [field.name for field in dataclasses.fields(vi.PeriodicMotion)]
    assert first_column("Periodic motions") == fields


def test_notation_names_all_that_comes_with_period_n_1_motions():
    fields = [field.name for field in dataclasses.fields(vi.PeriodicMotions)]
    assert first_column("All period n-1 motions") == fields
    assert first_column("Motion maps") == list(SOLUTION_DTYPE.names)


def test_notation_names_every_attribute_of_a_diagram():
    named = first_column("Bifurcation diagrams")
    own = {
        name
        for kind in vi.Diagram.__mro__
        if kind not in GridResult.__mro__
        for name, item in vars(kind).items()
        if isinstance(item, property)
    }
    assert len(named) == len({*named})
    assert {*named} >= own
    assert all(isinstance(getattr(vi.Diagram, name), property) for name in named)


def test_notation_names_every_attribute_of_a_manifold():
    kinds = (vi.UnstableManifold, vi.ManifoldSide)
    assert first_column("Unstable manifolds") == [
        field.name for kind in kinds for field in dataclasses.fields(kind)
    ]


def test_notation_names_every_kind_of_bifurcation():
    of_codimension_two = {
        kind for kind in BifurcationKind if kind.startswith(("cusp", "resonance"))
    }
    assert set(first_column("Bifurcations")) == set(BifurcationKind) - of_codimension_two


def test_notation_names_every_kind_of_evidence():
    assert first_column("Labels")[-len(EvidenceKind) :] == list(EvidenceKind)


def test_notation_names_every_stop_reason():
    source = (ROOT / "src" / "simulate" / "event.rs").read_text(encoding="utf-8")
    body = source.split("impl StopReason", 1)[1].split("\n}\n", 1)[0]
    assert first_column("Stop reasons") == re.findall(r'=> "(\w+)"', body)

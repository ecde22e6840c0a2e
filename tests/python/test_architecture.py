"""Folders are the arrow diagram of docs/architecture.md: each uses only those before it.

The orders stand here as data; every import is read from the sources: lazy ones inside functions,
those for type checkers, and the strings of the registry `verbs` and of the front door. A failure
names the file, its line, the arrow, and the line of this file that would permit it.
"""

import ast
import importlib
import inspect
import re
from collections.abc import Iterable
from pathlib import Path

import pytest

import repository
import vibroimpact as vi
from python_arrows import (
    DOORS,
    MODULES,
    REGISTRY,
    TYPES_OF_REGISTRY,
    Arrow,
    arrows_of,
    circle,
    modules_of,
    targets,
)
from rust_arrows import rust_arrows, rust_paths

ROOT = repository.root()
HERE = Path(__file__)

# A folder or file uses only those before it. `__init__` is the front door, the public interface.
FIRST = [
    "errors",
    "extras",
    "hints",
    "arguments",
    "horizons",
    "interruption",
    "by_value",
    "whole_file",
    "fixed_arrays",
    "verbs",
    "verb_types",
    "keyword_types",
    "showing",
    "repeating",
    "tables",
    "archive",
    "archived",
    "scales",
    "restitution",
    "physical",
    "machine",
    "mechanics",
    "system",
    "machine_kinds",
    "stop",
    "modal_basis",
    "structure_fields",
    "structure_rest",
    "structure",
    "structure_directions",
    "by_numbers",
    "made",
]
PYTHON = [
    *FIRST,
    "quadrature",
    "run_parts",
    "period_report",
    "sensitivity",
    "bounces",
    "run_trace",
    "made_with",
    "run_record",
    "run",
    "run_in_si",
    "structure_run_parts",
    "structure_motion",
    "structure_run",
    "simulation",
    "gradients",
    "impacts",
    "impact_results",
    "impact_maps",
    "continuation",
    "orbits",
    "single_impact",
    "sweeps",
    "sweeps.basins",
    "fitting",
    "files",
    "reference",
    "verification",
    "proof",
    "plot",
    "explorer",
    "__init__",
    "cli",
    "__main__",
]
RUST = [
    "numerics",
    "search",
    "model",
    "flight",
    "impact",
    "contact",
    "simulate",
    "tangent",
    "analysis",
    "python",
]
# What the second distribution may import, by public names only.
REPRODUCTION = [
    "vibroimpact",
    "vibroimpact.orbits",
    "vibroimpact.plot",
    "vibroimpact.single_impact",
    "vibroimpact.sweeps",
]

# Arrows that run back up all the same, each with its reason.
PERMITTED: dict[tuple[str, str], str] = {
    ("orbits.motion", "verb_types"): "a motion is followed to a branch, which has motions: a type",
}

# Modules that import by name: the registry, and doors that load their parts on first use.
BY_NAME = [REGISTRY, "__init__"]
# What is handed back: it imports nouns and other results, nothing that computes or draws.
RESULTS = [
    "quadrature",
    "run_parts",
    "run_trace",
    "made_with",
    "sensitivity",
    "period_report",
    "run_record",
    "bounces",
    "run",
    "run_in_si",
    "structure_run_parts",
    "structure_motion",
    "structure_run",
    "impact_results",
    "fitting.determined",
    "fitting.result",
    "orbits.bifurcation",
    "orbits.branch",
    "orbits.curve",
    "orbits.found",
    "orbits.manifold",
    "orbits.motion",
    "orbits.region",
    "orbits.structure_piece",
    "proof.branch_result",
    "proof.result",
    "proof.solutions_result",
    "proof.theorem",
    "single_impact.results",
    "sweeps.results",
    "sweeps.sweep_results",
    "sweeps.diagram_results",
    "sweeps.structure_diagram_results",
    "sweeps.lyapunov_results",
    "sweeps.basins.attractors",
    "sweeps.basins.measures",
    "sweeps.basins.results",
    "verification.result",
]
NOUNS = [
    *FIRST,
    "continuation.names",
    "fitting.ranges",
    "fitting.record",
    "orbits.kinds",
    "orbits.ranges",
    "sweeps.ctrl_c",
    "sweeps.grid",
    "sweeps.fields",
    "sweeps.labels",
    "sweeps.label_array",
    "sweeps.columns",
    "sweeps.grid_machine",
    "sweeps.machines",
    "sweeps.structure_machine",
    "sweeps.made_cells",
    "sweeps.store_layout",
    "sweeps.store_check",
    "sweeps.store_lock",
    "sweeps.store",
    "sweeps.basins.clouds",
    "sweeps.basins.free_motion",
    "sweeps.basins.region",
]

# A longer file has more than one subject.
MOST_LINES = 500
SOURCES = ["python", "src", "reproduction", "tests", "benches", "examples"]


def line_of(entry: str, after: str) -> str:
    """Where an entry of a list of this file stands."""
    lines = HERE.read_text(encoding="utf-8").splitlines()
    start = next(i for i, line in enumerate(lines) if line.startswith(f"{after} = "))
    found = (i for i in range(start, len(lines)) if f'"{entry}"' in lines[i])
    return f"{HERE.relative_to(ROOT)}, line {next(found, start) + 1}"


ARROWS = [arrow for module, path in MODULES.items() for arrow in arrows_of(module, path)]
CHECKED = [arrow for arrow in ARROWS if arrow.source not in (REGISTRY, TYPES_OF_REGISTRY)]


def entry_of(module: str) -> str:
    """The folder or file of the order to which a module belongs."""
    parts = module.split(".")
    places = (".".join(parts[:k]) for k in range(len(parts), 0, -1))
    return next((place for place in places if place in PYTHON), module)


def is_permitted(arrow: Arrow) -> bool:
    """Whether an arrow back up has a reason."""
    return (arrow.source, entry_of(arrow.target)) in PERMITTED


def faults_of_order(arrows: Iterable[Arrow], order: list[str] = PYTHON) -> list[str]:
    """The arrows between folders that run back up, or from a folder to its own door."""
    faults = []
    for arrow in arrows:
        source, target = entry_of(arrow.source), entry_of(arrow.target)
        inside = arrow.target in DOORS and arrow.source.startswith(f"{arrow.target}.")
        if inside:
            faults.append(f"{arrow}: a file does not use the door of its own folder")
        elif arrow.source in DOORS and arrow.target.startswith(f"{arrow.source}."):
            continue  # A door hands on what is behind it.
        elif order.index(target) > order.index(source) and not is_permitted(arrow):
            faults.append(
                f"{arrow}: {source} comes before {target}; to permit it, move "
                f"{line_of(target, 'PYTHON')}, before {line_of(source, 'PYTHON')}"
            )
    return faults


def test_every_module_has_its_place_in_the_order():
    for module, path in MODULES.items():
        assert entry_of(module) in PYTHON, (
            f"{path.relative_to(ROOT)} has no place: give it one in {line_of(module, 'PYTHON')}"
        )
    for entry in PYTHON:
        assert entry in MODULES, f"{line_of(entry, 'PYTHON')}: there is no {entry}; delete the line"


def test_no_arrow_runs_back_up():
    assert len(CHECKED) > 300
    assert not (faults := faults_of_order(CHECKED)), "\n".join(faults)


def test_no_imports_run_in_a_circle():
    # Types of the registry included: only its strings are left out.
    ring = circle(arrow for arrow in ARROWS if arrow.source != REGISTRY and not is_permitted(arrow))
    assert not ring, "a circle:\n" + "\n".join(map(str, ring))


def test_each_permission_is_used():
    used = {(arrow.source, entry_of(arrow.target)) for arrow in CHECKED}
    for source, target in PERMITTED:
        assert (source, target) in used, (
            f"{line_of(source, 'PERMITTED')}: {source} does not use {target}; delete the line"
        )


def test_only_the_registry_and_doors_import_by_name():
    for module, path in MODULES.items():
        for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), start=1):
            assert module in BY_NAME or not re.search(r"\b(import_module|__import__)\(", line), (
                f"{path.relative_to(ROOT)}:{number}: imports by name; to permit it, add {module!r} "
                f"to {line_of(module, 'BY_NAME')}"
            )


def test_every_entry_of_the_registry_leads_to_a_function():
    from vibroimpact.verbs import VERBS, verb

    assert [*VERBS] == sorted(VERBS)
    for name in VERBS:
        assert callable(verb(name)), name
    sources = "".join(path.read_text(encoding="utf-8") for path in MODULES.values())
    assert {*re.findall(r'\bverb\("(\w+)"\)', sources)} == {*VERBS}


def test_results_import_nothing_that_computes_or_draws():
    for arrow in CHECKED:
        if arrow.source in (*RESULTS, *NOUNS):
            assert arrow.target in (*RESULTS, *NOUNS), (
                f"{arrow}: a result uses nouns and results alone; if {arrow.target} is one, add it "
                f"to {line_of(arrow.target, 'NOUNS')}"
            )
    for entry in (*RESULTS, *NOUNS):
        assert entry in MODULES, f"{line_of(entry, 'RESULTS')}: there is no {entry}"


def test_every_public_class_is_a_result_or_a_noun():
    doors = [importlib.import_module(name) for name in REPRODUCTION if name != "vibroimpact.plot"]
    public = {getattr(door, name) for door in doors for name in door.__all__}
    for found in filter(inspect.isclass, public):
        module = found.__module__.removeprefix("vibroimpact.")
        assert module in (*RESULTS, *NOUNS, "_core"), (
            f"{found.__name__} stands in {module}, with what computes; a result has a module of "
            f"its own, named in {line_of(module, 'RESULTS')}"
        )


# The second distribution.


def test_the_reproduction_runs_in_no_circle():
    doors = [*(ROOT / "reproduction").glob("*/__init__.py")]
    if not doors:
        pytest.skip("there is no package in reproduction/ yet")
    for root in (door.parent for door in doors):
        modules = modules_of(root)
        ring = circle(
            Arrow(path, node.lineno, module, target)
            for module, path in modules.items()
            for node in ast.walk(ast.parse(path.read_text(encoding="utf-8")))
            for target in targets(node, module, root.name, modules)
            if target != module
        )
        assert not ring, "a circle:\n" + "\n".join(map(str, ring))


def test_the_reproduction_imports_public_names_only():
    folder = ROOT / "reproduction"
    if not folder.is_dir():
        pytest.skip("there is no folder reproduction/ yet")
    modules = {name: importlib.import_module(name) for name in REPRODUCTION}
    short = {name.rpartition(".")[2] for name in REPRODUCTION}
    allowed = line_of("vibroimpact", "REPRODUCTION")
    # Its tests call the command line, too; they are judged by test_public_imports.py.
    for path in sorted(folder.glob("han_jin_hu_2004/**/*.py")):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            place = f"{path.relative_to(ROOT)}:{getattr(node, 'lineno', 0)}"
            if isinstance(node, ast.Import):
                for name in (alias.name for alias in node.names):
                    mine = name.split(".")[0] != "vibroimpact"
                    assert mine or name in modules, f"{place}: {name} is not public; {allowed}"
            elif isinstance(node, ast.ImportFrom) and (node.module or "").startswith("vibroimpact"):
                assert node.module in modules, f"{place}: {node.module} is not public; {allowed}"
                for name in (alias.name for alias in node.names):
                    public = {*modules[node.module].__all__}
                    public |= short if node.module == "vibroimpact" else set()
                    assert name in public, f"{place}: {node.module}.{name} is not public"
            elif (
                isinstance(node, ast.Attribute)
                and isinstance(node.value, ast.Name)
                and node.value.id == "vi"
            ):
                known = node.attr in vi.__all__ or node.attr in short
                assert known, f"{place}: vi.{node.attr} is not public"


# Rust: every path from the crate or from a parent.


@pytest.fixture(scope="module")
def rust() -> list[tuple[str, tuple[str, ...], tuple[str, ...]]]:
    if not (ROOT / "src" / "numerics").is_dir():
        pytest.skip("src/ is not in folders yet")
    return [*rust_arrows()]


def test_no_arrow_of_the_crate_runs_back_up(rust):
    assert len(rust) > 200
    faults = []
    for place, (source, *_), (target, *_) in rust:
        for folder in (source, target):
            assert folder in RUST, f"{place}: {folder} has no place in {line_of(folder, 'RUST')}"
        if RUST.index(target) > RUST.index(source):
            faults.append(
                f"{place}: {source} -> {target} runs back up; to permit it, move "
                f"{line_of(target, 'RUST')}, before {line_of(source, 'RUST')}"
            )
    assert not faults, "\n".join(faults)


def test_no_files_of_the_crate_run_in_a_circle(rust):
    # At each level of folders; a file and the files of its own folder are one module.
    arrows = set()
    for place, source, target in rust:
        depth = next(
            (k for k, (a, b) in enumerate(zip(source, target, strict=False)) if a != b), -1
        )
        if depth >= 0:
            name, line = place.split(":")
            ends = ("::".join(way[: depth + 1]) for way in (source, target))
            arrows.add(Arrow(ROOT / name, int(line), *ends))
    assert len(arrows) > 200
    ring = circle(sorted(arrows, key=str))
    assert not ring, "a circle:\n" + "\n".join(map(str, ring))


# The sizes of files.


def long_files(root: Path) -> dict[str, int]:
    """The files with more lines than any should have, by their paths below a root."""
    found = {}
    for path in (path for folder in SOURCES for path in sorted((root / folder).rglob("*"))):
        name = path.relative_to(root)
        # What is built or fetched has hidden folders.
        if path.suffix in (".py", ".rs") and not any(part.startswith(".") for part in name.parts):
            lines = path.read_text(encoding="utf-8").count("\n")
            found |= {name.as_posix(): lines} if lines > MOST_LINES else {}
    return found


def test_no_file_is_too_long():
    found = [f"{name} has {lines} lines" for name, lines in long_files(ROOT).items()]
    assert not found, f"more than {MOST_LINES}, to be split:\n" + "\n".join(found)


def test_long_files_are_found(tmp_path):
    for name, lines in {"a.py": 500, "b.py": 501, "c.rs": 501, "d.md": 900}.items():
        (tmp_path / "src" / "deep").mkdir(parents=True, exist_ok=True)
        (tmp_path / "src" / "deep" / name).write_text("\n" * lines, encoding="utf-8")
    assert long_files(tmp_path) == {"src/deep/b.py": 501, "src/deep/c.rs": 501}


# The page.

PAGE = (ROOT / "docs" / "architecture.md").read_text(encoding="utf-8")
DIAGRAMS = re.findall(r"^```text\n(.*?)^```$", PAGE, re.M | re.S)


def test_the_page_draws_the_orders(rust):
    drawn, package = ([*re.findall(r"[\w/]+", text)] for text in DIAGRAMS)
    assert sorted(drawn) == sorted(RUST)
    for _, (source, *_), (target, *_) in rust:
        assert drawn.index(target) <= drawn.index(source), f"{source} uses {target}"
    package = [name.replace("/", ".") for name in package]
    assert sorted(package) == sorted(PYTHON)
    # Row by row it is an order that all arrows keep, if not the one above.
    assert not (faults := faults_of_order(CHECKED, package)), "\n".join(faults)
    said = {*re.findall(r"`([\w/]+)`", "".join(re.findall(r"^\| (`.*?) \|", PAGE, re.M)))}
    assert {name.replace("/", ".") for name in said} >= {*RUST, *PYTHON}


# The checks themselves can fail.


def test_arrows_back_up_and_circles_are_found():
    path = MODULES["run"]
    up = [Arrow(path, 1, "run", "orbits.shooting")]
    (fault,) = faults_of_order(up)
    assert "run.py:1: run -> orbits.shooting" in fault
    assert line_of("orbits", "PYTHON") in fault
    assert faults_of_order([Arrow(path, 1, "sweeps.grid", "sweeps")])
    assert not faults_of_order([Arrow(path, 1, "orbits.shooting", "run")])
    ring = [Arrow(path, 1, "a", "b"), Arrow(path, 2, "b", "c"), Arrow(path, 3, "c", "b")]
    assert circle(ring) == ring[1:]
    assert circle(ring[:2]) == []


@pytest.mark.parametrize(
    ("text", "module", "found"),
    [
        ("def f():\n    from .orbits import shooting", "run", ["orbits.shooting"]),
        ("if TYPE_CHECKING:\n    from ..plot import style", "orbits.motion", ["plot.style"]),
        ("from .. import _core", "orbits.motion", ["_core"]),
        ("from . import motion", "orbits", ["orbits.motion"]),
        ("from .grid import Grid", "sweeps.cells", ["sweeps.grid"]),
        ("from ...system import System", "sweeps.basins.files", ["system"]),
        ("import vibroimpact.orbits.motion", "cli.orbits", ["orbits.motion"]),
        ("from vibroimpact import System", "cli.orbits", ["__init__"]),
    ],
)
def test_imports_of_every_kind_are_read(text, module, found):
    nodes = ast.walk(ast.parse(text))
    assert [target for node in nodes for target in targets(node, module)] == found


def test_paths_of_rust_are_read():
    text = """
    // use crate::comment;
    use crate::{flight::{Flight, table::Table as T}, model};
    fn f() { crate::search::scan(super::super::x()); let s = "crate::string"; }
    #[cfg(test)]
    mod tests { use crate::python; }
    """
    assert [*rust_paths(text)] == [
        (3, "crate::flight::Flight"),
        (3, "crate::flight::table::Table"),
        (3, "crate::model"),
        (4, "crate::search::scan"),
        (4, "super::super::x"),
    ]

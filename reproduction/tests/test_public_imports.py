"""The reproduction is a customer: it uses public names of vibroimpact only, late imports included.

Public is what `__all__` of a module of docs/deprecation.md names; the tests may call the command
line, too.
"""

import ast
import importlib
from collections.abc import Iterator
from pathlib import Path

import pytest

import han_jin_hu_2004

PUBLIC = ("vibroimpact", "vibroimpact.plot")
PACKAGE = Path(han_jin_hu_2004.__file__).parent
TESTS = Path(__file__).parent


def faults(text: str, modules: tuple[str, ...] = PUBLIC) -> Iterator[str]:
    """What a source uses of vibroimpact that is not public, or in a way that cannot be checked."""
    tree = ast.parse(text)
    called: dict[str, str] = {}  # modules by the name that they have there
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            for each in node.names:
                if each.name.partition(".")[0] == "vibroimpact":
                    called[each.asname or "vibroimpact"] = each.name
                    if each.name not in modules:
                        yield f"import {each.name}"
                if each.name == "importlib":
                    yield "importlib"
        elif isinstance(node, ast.ImportFrom) and not node.level:
            module = node.module or ""
            if module == "importlib" and "import_module" in {each.name for each in node.names}:
                yield "importlib"
            if module.partition(".")[0] != "vibroimpact":
                continue
            if module not in modules:
                yield f"from {module} import"
                continue
            for each in node.names:
                inner = f"{module}.{each.name}"
                if inner in modules:
                    called[each.asname or each.name] = inner
                elif each.name not in importlib.import_module(module).__all__:
                    yield inner
        elif isinstance(node, ast.Name) and node.id == "__import__":
            yield "__import__"
    for node in ast.walk(tree):
        if not isinstance(node, ast.Attribute):
            continue
        owner = ast.unparse(node.value)
        first, dot, rest = owner.partition(".")
        module = called.get(first, "") + dot + rest
        if module in PUBLIC:
            known = importlib.import_module(module).__all__
            if node.attr not in known and f"{module}.{node.attr}" not in modules:
                yield f"{module}.{node.attr}"
        if node.attr.startswith("_") and not node.attr.endswith("__") and owner != "self":
            yield f"{owner}.{node.attr}"


@pytest.mark.parametrize(
    "path", sorted(PACKAGE.rglob("*.py")), ids=lambda path: path.relative_to(PACKAGE).as_posix()
)
def test_the_package_imports_public_names(path):
    assert [*faults(path.read_text(encoding="utf-8"))] == []


@pytest.mark.parametrize("path", sorted(TESTS.glob("*.py")), ids=lambda path: path.name)
def test_the_tests_import_public_names_and_the_command_line(path):
    found = {*faults(path.read_text(encoding="utf-8"), (*PUBLIC, "vibroimpact.cli"))}
    # Tests may look behind names of the reproduction itself.
    imports = {fault for fault in found if "._" not in fault}
    assert imports <= ({"importlib"} if path == Path(__file__) else set())


@pytest.mark.parametrize(
    ("line", "fault"),
    [
        ("from vibroimpact.orbits import Branch", "from vibroimpact.orbits import"),
        ("def late():\n    import vibroimpact.sweeps as s", "import vibroimpact.sweeps"),
        ("from vibroimpact import no_such_name", "vibroimpact.no_such_name"),
        ("from vibroimpact import system", "vibroimpact.system"),
        ("import vibroimpact as vi\nvi.system.SYMBOLS", "vibroimpact.system"),
        ("from vibroimpact import plot\nplot.style", "vibroimpact.plot.style"),
        ("import vibroimpact as vi\nvi.plot.style", "vibroimpact.plot.style"),
        ("from vibroimpact.plot import style", "vibroimpact.plot.style"),
        ("import importlib", "importlib"),
        ("__import__('vibroimpact.orbits')", "__import__"),
        ("def f(system):\n    return system._compiled", "system._compiled"),
    ],
)
def test_what_is_not_public_is_named(line, fault):
    assert [*faults(line)] == [fault]


@pytest.mark.parametrize(
    "line",
    [
        "import vibroimpact as vi\nvi.System\nvi.plot.bifurcation",
        "from vibroimpact.plot import label_text as text",
        "from . import evidence",
        "class A:\n    def f(self):\n        return self._hidden",
    ],
)
def test_what_is_public_passes(line):
    assert [*faults(line)] == []

"""The handwritten stub file names what the compiled core exports, no more and no less."""

import ast
from pathlib import Path

import pytest

import vibroimpact
from vibroimpact import _core

STUB = ast.parse((Path(vibroimpact.__file__).parent / "_core.pyi").read_text(encoding="utf-8"))
CLASSES = {node.name: node for node in STUB.body if isinstance(node, ast.ClassDef)}


def _names(body: list[ast.stmt]) -> set[str]:
    names: set[str] = set()
    for node in body:
        if isinstance(node, ast.FunctionDef | ast.ClassDef):
            names.add(node.name)
        elif isinstance(node, ast.AnnAssign) and isinstance(node.target, ast.Name):
            names.add(node.target.id)
    return names


def _public(names: set[str]) -> set[str]:
    return {name for name in names if not name.startswith("_")}


def test_module_exports():
    exported = set(_core.__all__) if hasattr(_core, "__all__") else set(dir(_core))
    assert _public(exported) == _public(_names(STUB.body))
    assert _core.__version__ == vibroimpact.__version__


@pytest.mark.parametrize("name", sorted(CLASSES))
def test_class_members(name):
    assert _public(set(vars(getattr(_core, name)))) == _public(_names(CLASSES[name].body))


@pytest.mark.parametrize("name", sorted(CLASSES))
def test_classes_are_final(name):
    with pytest.raises(TypeError):
        type("Derived", (getattr(_core, name),), {})

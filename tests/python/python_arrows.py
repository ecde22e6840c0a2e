"""The arrows between the modules of the package: every import, wherever in a file it stands."""

import ast
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

import repository

ROOT = repository.root()
PACKAGE = ROOT / "python" / "vibroimpact"
# The one exception whose arrows run back up by declaration: methods of results that need a solver,
# and the types in their signatures.
REGISTRY = "verbs"
TYPES_OF_REGISTRY = "verb_types"


@dataclass(frozen=True)
class Arrow:
    """An import: from a module to a module, both by their dotted names within the package."""

    file: Path
    line: int
    source: str
    target: str

    def __str__(self) -> str:
        """The place, and the arrow."""
        return f"{self.file.relative_to(ROOT)}:{self.line}: {self.source} -> {self.target}"


def module_of(path: Path, root: Path = PACKAGE) -> str:
    """The dotted name of a file; that of a folder is the name of its door."""
    parts = path.relative_to(root).with_suffix("").parts
    return ".".join(parts[:-1] if len(parts) > 1 and parts[-1] == "__init__" else parts)


def modules_of(root: Path) -> dict[str, Path]:
    """The files of a package by their dotted names."""
    return {module_of(path, root): path for path in sorted(root.rglob("*.py"))}


MODULES = modules_of(PACKAGE)
DOORS = {name for name, path in MODULES.items() if path.stem == "__init__"}


def targets(
    node: ast.AST, module: str, package: str = "vibroimpact", modules: dict[str, Path] = MODULES
) -> Iterator[str]:
    """The modules of a package that an import names, absolute or relative."""
    if isinstance(node, ast.Import):
        for name in (alias.name for alias in node.names):
            if name.split(".")[0] == package:
                yield name.partition(".")[2] or "__init__"
    elif isinstance(node, ast.ImportFrom):
        if node.level:
            inside = [] if module == "__init__" else module.split(".")
            is_door = module == "__init__" or modules[module].stem == "__init__"
            depth = node.level - is_door
            base = inside[: len(inside) - depth] if depth else inside
            base = [*base, *((node.module or "").split(".") if node.module else [])]
        elif (node.module or "").split(".")[0] == package:
            base = (node.module or "").split(".")[1:]
        else:
            return
        for alias in node.names:
            full = ".".join([*base, alias.name])
            yield full if full in (*modules, "_core") else ".".join(base) or "__init__"


def named(tree: ast.Module, module: str) -> Iterator[tuple[int, str]]:
    """The modules in the tables of strings from which the registry and the front door import."""
    for node in ast.walk(tree):
        pair = None
        if isinstance(node, ast.Assign) and isinstance(node.targets[0], ast.Name):
            pair = node.targets[0].id, node.value
        elif isinstance(node, ast.AnnAssign) and isinstance(node.target, ast.Name):
            pair = node.target.id, node.value
        if pair is None or not isinstance(pair[1], ast.Dict):
            continue
        if (module, pair[0]) == ("__init__", "_ON_FIRST_USE"):
            yield from ((key.lineno, key.value) for key in pair[1].keys)
        if (module, pair[0]) == (REGISTRY, "VERBS"):
            yield from ((item.lineno, item.value.split(":")[0]) for item in pair[1].values)


def arrows_of(module: str, path: Path) -> Iterator[Arrow]:
    """Every import of a module from the package, wherever in the file it stands."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    for node in ast.walk(tree):
        for target in targets(node, module):
            if target.split(".")[0] != "_core" and target != module:
                yield Arrow(path, node.lineno, module, target)
    for line, target in named(tree, module):
        yield Arrow(path, line, module, target)


def circle(arrows: Iterable[Arrow]) -> list[Arrow]:
    """A circle of imports, as its arrows; empty if there is none."""
    leads: dict[str, list[Arrow]] = {}
    for arrow in arrows:
        leads.setdefault(arrow.source, []).append(arrow)
    done: set[str] = set()

    def found(module: str, way: list[Arrow]) -> list[Arrow]:
        for arrow in leads.get(module, []):
            sources = [step.source for step in way]
            if arrow.target in (*sources, module):
                return [*way, arrow][(*sources, module).index(arrow.target) :]
            if arrow.target not in done and (ring := found(arrow.target, [*way, arrow])):
                return ring
        done.add(module)
        return []

    return next((ring for module in sorted(leads) if (ring := found(module, []))), [])

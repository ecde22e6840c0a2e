"""The arrows between the modules of the crate: every path from the crate or from a parent."""

import re
from collections.abc import Iterator
from pathlib import Path

import repository

ROOT = repository.root()


def code_of(text: str) -> str:
    """A source without comments, strings and tests, of as many lines."""
    pattern = r'//[^\n]*|/\*.*?\*/|r#".*?"#|"(?:\\.|[^"\\])*"|\'(?:\\.|[^\'\\])\''
    text = re.sub(pattern, lambda found: "\n" * found[0].count("\n"), text, flags=re.S)
    for found in [*re.finditer(r"#\[cfg\(test\)\]\s*mod \w+ \{", text)][::-1]:
        end = block_end(text, found.end())
        text = text[: found.start()] + "\n" * text[found.start() : end].count("\n") + text[end:]
    return text


def block_end(text: str, start: int) -> int:
    """The place after the bracket that closes one opened just before ``start``."""
    depth = 1
    for place in range(start, len(text)):
        depth += {"{": 1, "}": -1}.get(text[place], 0)
        if not depth:
            return place + 1
    return len(text)


def expanded(tree: str) -> Iterator[str]:
    """The paths of a use declaration, braces multiplied out."""
    tree = re.sub(r"\s+as\s+\w+|\s+", "", tree)
    head, brace, rest = tree.partition("{")
    if not brace:
        yield tree
        return
    depth, part = 0, ""
    for letter in rest[: block_end(rest, 0) - 1] + ",":
        depth += {"{": 1, "}": -1}.get(letter, 0)
        if letter == "," and not depth:
            if part:
                yield from (head + path for path in expanded(part))
            part = ""
        else:
            part += letter


def rust_paths(text: str) -> Iterator[tuple[int, str]]:
    """Every path of a source that starts at the crate or at a parent, with its line."""
    code = code_of(text)
    for found in re.finditer(r"\buse ((?:crate|super)\b[^;]*);", code):
        line = code.count("\n", 0, found.start()) + 1
        yield from ((line, path) for path in expanded(found[1]))
    code = re.sub(r"\buse [^;]*;", lambda found: "\n" * found[0].count("\n"), code)
    for found in re.finditer(r"\b(?:crate|super)(?:::\w+)+", code):
        yield code.count("\n", 0, found.start()) + 1, found[0]


def rust_modules() -> dict[tuple[str, ...], Path]:
    """The modules of the crate by their paths, all but its root."""
    source = ROOT / "src"
    return {
        path.relative_to(source).with_suffix("").parts: path
        for path in sorted(source.rglob("*.rs"))
        if path.name not in ("lib.rs", "main.rs")
    }


def rust_arrows() -> Iterator[tuple[str, tuple[str, ...], tuple[str, ...]]]:
    """Every arrow: its place, and the modules it leads from and to."""
    modules = rust_modules()
    root = code_of((ROOT / "src" / "lib.rs").read_text(encoding="utf-8"))
    exports = {}
    for found in re.finditer(r"\bpub use ([^;]*);", root):
        for path in expanded(found[1]):
            *way, name = path.split("::")
            exports[name] = way
    for module, path in modules.items():
        for line, used in rust_paths(path.read_text(encoding="utf-8")):
            parts = used.split("::")
            if parts[0] == "crate":
                way = parts[1:]
                way = [*exports[way[0]], *way] if way[0] in exports else way
            else:
                ups = next(i for i, part in enumerate(parts) if part != "super")
                way = [*module[: len(module) - ups], *parts[ups:]]
            # The longest part of the path that is a module.
            length = next((k for k in range(len(way), 0, -1) if tuple(way[:k]) in modules), 0)
            if length:
                yield f"{path.relative_to(ROOT)}:{line}", module, tuple(way[:length])

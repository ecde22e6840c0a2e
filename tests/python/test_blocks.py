"""Every block of every page is run by a test, or excused here with the reason.

A block of a new kind, on a new page, or indented so that the test of its kind would not see it,
fails. What no other test runs is run here as far as it is cheap: of a command its words at least.
"""

import importlib
import json
import os
import re
import shlex
import shutil
import subprocess
import sys
import tomllib
from collections.abc import Callable
from dataclasses import dataclass

import pytest

import repository
import test_architecture
import test_cli_docs
import test_docs
import test_errata
import test_gallery
from han_jin_hu_2004.parameters import FIGURES
from vibroimpact import cli

ROOT = repository.root()
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]


@dataclass(frozen=True)
class Block:
    """A fenced block: where it begins, what it says it is, and what is in it."""

    page: str
    line: int
    language: str
    text: str

    def __str__(self) -> str:
        return f"{self.page}:{self.line}"


def fenced(page: str, text: str) -> list[Block]:
    """Every fenced block of a page, whatever its fence and however far it is indented."""
    found, fence, start, language, inside = [], "", 0, "", []
    for number, line in enumerate(text.splitlines(), start=1):
        mark = re.match(r"[\s>]*(?:[-*+] +|\d+\. +)?(`{3,}|~{3,})\s*(.*)", line)
        if not fence and mark:
            fence, start, language, inside = mark[1], number, mark[2].strip(), []
        elif fence and mark and mark[1].startswith(fence) and not mark[2]:
            found.append(Block(page, start, language, "".join(f"{each}\n" for each in inside)))
            fence = ""
        elif fence:
            inside.append(line)
    assert not fence, f"{page}:{start} is never closed"
    return found


def committed() -> list[str]:
    """The pages of the repository; of an export of it, those of the folders that have some."""
    if git := shutil.which("git"):
        command = [git, "ls-files", "*.md"]
        done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
        if done.returncode == 0 and done.stdout:
            return done.stdout.split()
    found = [*ROOT.glob("*.md"), *(ROOT / "reproduction").glob("*.md")]
    for folder in ("docs", "tests"):
        found += (ROOT / folder).rglob("*.md")
    return sorted(path.relative_to(ROOT).as_posix() for path in found)


BLOCKS = [
    block
    for page in committed()
    for block in fenced(page, (ROOT / page).read_text(encoding="utf-8"))
]


def in_docs(block: Block, language: str) -> bool:
    """Whether test_docs finds a block of a language."""
    path = ROOT / block.page
    return (
        block.language == language
        and path in test_docs.PAGES
        and block.text in test_docs.blocks(path, language)
    )


# The test that runs a block, and whether it does.
RUN_BY: dict[str, Callable[[Block], bool]] = {
    "test_docs.test_python_blocks_run": lambda block: in_docs(block, "python"),
    "test_docs.test_rust_blocks_are_those_that_rustdoc_runs": lambda block: in_docs(block, "rust"),
    "test_architecture.test_the_page_draws_the_orders": lambda block: (
        block.page == "docs/architecture.md" and block.text in test_architecture.DIAGRAMS
    ),
    "test_cli_docs.test_the_page_holds": lambda block: (
        block.page == "docs/command-line.md"
        and (block.language, block.text) in test_cli_docs.BLOCKS
    ),
    "test_blocks.test_the_crate_is_found_as_a_dependency": lambda block: block == DEPENDENCY,
    "test_blocks.test_lines_of_a_shell_hold": lambda block: (
        block.language == "sh" and block.page != "docs/command-line.md"
    ),
}
# Language and folder of blocks that no test runs, with the reason.
EXCUSED = {
    ("{toctree}", "docs/"): "Sphinx runs them in `make docs`; a warning is an error there",
    ("{eval-rst}", "docs/api/"): "likewise; test_docs compares the names in them",
}
(DEPENDENCY,) = (block for block in BLOCKS if block.language == "toml" and "README" in block.page)


def runners(block: Block) -> list[str]:
    excuses = [
        reason
        for (language, folder), reason in EXCUSED.items()
        if block.language == language and block.page.startswith(folder)
    ]
    return [name for name, runs in RUN_BY.items() if runs(block)] + excuses


@pytest.mark.parametrize("block", BLOCKS, ids=str)
def test_a_block_is_run_once_or_excused(block):
    assert len(runners(block)) == 1


def test_the_tests_that_run_blocks_exist_and_all_run_some():
    for name in RUN_BY:
        module, _, function = name.partition(".")
        assert hasattr(importlib.import_module(module), function)
    used = [name for block in BLOCKS for name in runners(block)]
    assert {*used} == {*RUN_BY, *EXCUSED.values()}


@pytest.mark.parametrize(
    ("page", "text"),
    [
        ("docs/new.md", "```sh\necho\n```\n"),  # its line is refused below
        ("docs/new.md", "```python\n1\n```\n"),
        ("docs/start.md", "- x\n\n  ```python\n  1 / 0\n  ```\n"),
        ("docs/start.md", "``` python\n1 / 0\n```\n"),
        ("docs/start.md", "~~~python\n1 / 0\n~~~\n"),
        ("docs/start.md", "````\n```\n1 / 0\n```\n````\n"),
        ("docs/start.md", "```toml\na = 1\n```\n"),
        ("docs/command-line.md", "```sh\necho\n```\n"),
    ],
)
def test_a_new_block_is_not_passed_over(page, text):
    (block,) = fenced(page, text)
    if runners(block):
        with pytest.raises(AssertionError, match="no test knows"):
            check("echo")
        assert runners(block) == ["test_blocks.test_lines_of_a_shell_hold"]


# Lines of a shell


def run(words: list[str]) -> None:
    try:
        code = cli.main(words[1:])
    except SystemExit as stopped:
        code = stopped.code
    assert code == 0


def parse(words: list[str]) -> None:
    given = cli._parser().parse_args(words[1:])
    assert {*(getattr(given, "figures", None) or FIGURES)} <= {*FIGURES}


def plan(words: list[str]) -> None:
    # Of a folder `make` would say that there is nothing to be done.
    targets = re.findall(r"^([\w-]+):", (ROOT / "Makefile").read_text(encoding="utf-8"), re.M)
    assert {*words[1:]} <= {*targets}
    outside = {name: value for name, value in os.environ.items() if not name.startswith("MAKE")}
    command = ["make", "--dry-run", *words[1:]]
    done = subprocess.run(command, cwd=ROOT, env=outside, capture_output=True, check=False)
    assert done.returncode == 0, done.stderr


def environment(words: list[str]) -> None:
    assert words in (["python3", "-m", "venv", ".venv"], [".", ".venv/bin/activate"])


def project(words: list[str]) -> None:
    done = subprocess.run([*words[:2], "--help"], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


def install(words: list[str]) -> None:
    (folder,) = words[2:]
    assert (ROOT / folder / "pyproject.toml").is_file()


def errata(words: list[str]) -> None:
    (name,) = words[2:]
    assert name in test_errata.NAMES


def gallery(words: list[str]) -> None:
    (script,) = words[1:]
    assert ROOT / script in test_gallery.SCRIPTS


def reference(words: list[str]) -> None:
    folder, _, module = words[2].partition(".")
    assert (ROOT / "tests" / folder / f"{module}.py").is_file()
    data = {path.name for path in (ROOT / "tests" / "data").iterdir()}
    assert {word for word in words if word.endswith(".json")} <= data
    # What takes no option has no help.
    if any(word.startswith("-") for word in words[3:]):
        options_are_known(words[3:], words[2])


def reference_tests(words: list[str]) -> None:
    assert [*(ROOT / "tests" / words[3]).glob("test_*.py")]


def cluster(words: list[str]) -> None:
    after = words[words.index("dask") + 1 :]
    options_are_known(after, f"distributed.cli.dask_{after[0]}")


def readers_own(words: list[str]) -> None:
    assert not (ROOT / words[1]).exists()


def options_are_known(words: list[str], module: str) -> None:
    """Check that each option of a line stands in the help of its module."""
    command = [sys.executable, "-m", module, "--help"]
    done = subprocess.run(command, cwd=ROOT / "tests", capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    for word in words:
        if word.startswith("-"):
            assert re.search(rf"(?<![\w-]){re.escape(word)}(?![\w-])", done.stdout), word


# How a line begins, what is done with it, and why no more.
LINES: dict[str, tuple[Callable[[list[str]], None], str]] = {
    "vibroimpact --help": (run, ""),
    "vibroimpact claims ": (run, ""),
    "vibroimpact template ": (run, ""),
    "vibroimpact bench": (parse, "measures for seconds; reproduction/tests/test_bench.py runs it"),
    "vibroimpact reproduce ": (
        parse,
        "takes minutes; reproduction/tests/test_figures.py draws it reduced",
    ),
    "make ": (plan, "takes minutes; continuous integration runs the tests"),
    "python3 -m venv ": (environment, "makes a folder; all tests run in such an environment"),
    ". ": (environment, "changes the shell"),
    "cargo new ": (project, "makes a folder; test_the_crate_is_found_as_a_dependency has one"),
    "pip install ": (install, "compiles the package, which `make wheel-test` does"),
    "python examples/errata ": (errata, "test_errata draws each, at reduced size"),
    "python examples/gallery/": (gallery, "test_gallery draws each, at reduced size"),
    "python -m reference.": (reference, "takes minutes; `make reference` runs them"),
    "python -m pytest reference": (reference_tests, "is part of `make test`"),
    "srun ": (cluster, "needs a batch system; the options of dask are looked up"),
    "python chart.py": (readers_own, "is a program of the reader's"),
}


def kinds(line: str) -> list[str]:
    return [start for start in LINES if line.startswith(start)]


def check(line: str) -> None:
    """Check one line of a shell block."""
    for extras in re.findall(r"\.\[([\w,]+)\]", line):
        assert {*extras.split(",")} <= PROJECT["optional-dependencies"].keys()
    words = shlex.split(line.removesuffix("&"), comments=True)
    if words:
        assert len(kinds(line)) == 1, f"no test knows {line!r}"
        LINES[kinds(line)[0]][0](words)


SHELL = [block for block in BLOCKS if RUN_BY["test_blocks.test_lines_of_a_shell_hold"](block)]


@pytest.mark.parametrize("block", SHELL, ids=str)
def test_lines_of_a_shell_hold(block, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    for line in block.text.splitlines():
        check(line)
    assert not [*tmp_path.iterdir()]


def test_every_kind_of_line_is_somewhere():
    lines = [line for block in SHELL for line in block.text.splitlines()]
    assert {start for line in lines for start in kinds(line)} == {*LINES}


def test_the_crate_is_found_as_a_dependency(tmp_path):
    folder = tmp_path / "project"
    (folder / "src").mkdir(parents=True)
    (folder / "src" / "lib.rs").touch()
    # Where the block has it, with the versions that are at hand.
    (tmp_path / "vibroimpact").symlink_to(ROOT)
    (folder / "Cargo.lock").write_bytes((ROOT / "Cargo.lock").read_bytes())
    head = '[package]\nname = "project"\nversion = "0.0.0"\nedition = "2024"\n\n'
    (folder / "Cargo.toml").write_text(head + DEPENDENCY.text, encoding="utf-8")
    version = subprocess.run(["rustc", "-vV"], capture_output=True, text=True, check=True).stdout
    host = re.search(r"^host: (.*)$", version, re.M)[1]
    command = ["cargo", "metadata", "--offline", "--format-version=1", "--filter-platform", host]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    names = {package["name"] for package in json.loads(done.stdout)["packages"]}
    assert {"project", "vibroimpact", "nalgebra"} <= names
    # As the README says below it.
    assert not {"pyo3", "numpy"} & names

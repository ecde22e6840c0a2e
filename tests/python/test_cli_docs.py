"""docs/command-line.md: its files are read, its commands run, and they print what it shows."""

import re
import shlex
from pathlib import Path

import repository
from vibroimpact import cli
from vibroimpact.cli import exit_codes

PAGE = (repository.root() / "docs" / "command-line.md").read_text(encoding="utf-8")
BLOCKS = re.findall(r"^```(sh|toml|text)\n(.*?)^```$", PAGE, re.M | re.S)


def run(line: str, capsys) -> str:
    """Run a command of the page, check its exit code, and return its output."""
    command, _, comment = line.partition("#")
    words = shlex.split(command)
    target = None
    if ">" in words:
        target = words[words.index(">") + 1]
        words = words[: words.index(">")]
    assert words[0] == "vibroimpact"
    expected = re.search(r"exit code (\d+)", comment)
    try:
        code = cli.main(words[1:])
    except SystemExit as stopped:
        code = stopped.code
    out, err = capsys.readouterr()
    assert code == (int(expected[1]) if expected else 0), err
    if target:
        Path(target).write_text(out, encoding="utf-8")
    return out


def first_words(text: str) -> list[str]:
    """The first word of each line: the rest holds numbers of one machine."""
    return [line.split()[0].rstrip(":") for line in text.splitlines()]


def test_the_page_holds(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    printed = ""
    for kind, text in BLOCKS:
        if kind == "toml":
            name = text.splitlines()[0].removeprefix("# ")
            (tmp_path / name).write_text(text, encoding="utf-8")
        elif kind == "sh":
            for line in text.splitlines():
                printed = run(line, capsys)
        else:
            assert first_words(text) == first_words(printed)
    assert [kind for kind, _ in BLOCKS].count("sh") >= 5
    assert (tmp_path / "section.csv").read_text(encoding="utf-8").startswith("drive_frequency,")


def test_the_page_lists_every_command():
    names = [command.__name__.rpartition(".")[2] for command in cli.COMMANDS]
    names = [name.replace("_", "-") for name in names]
    assert re.findall(r"^\| `([\w-]+)` \| ", PAGE, re.M) == [*names, *cli.ELSEWHERE]


def test_the_page_gives_every_exit_code():
    rows = re.findall(r"^\| (\d+) \|", PAGE, re.M)
    assert [int(row) for row in rows] == list(exit_codes.ExitCode)

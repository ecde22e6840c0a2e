"""What the tests of the command line share: command lines, and how to read what they print."""

import shlex
import textwrap

import pytest

from vibroimpact import cli

SYSTEM = "--mass-ratio 0.6 --frequency-ratio 2 --restitution 0.8 --gap 0.5 --moment-amplitude 1"
START = "--initial 0 0.5 0 0"
SIMULATE = f"simulate {SYSTEM} --drive-frequency 1.8 {START} --periods 600 --keep 100"
DIAGRAM = (
    f"diagram {SYSTEM} {START} --vary drive-frequency 1.7 1.9 5 --periods 60 --keep 20 --quiet"
)
CHART = (
    f"chart {SYSTEM} {START} --vary drive-frequency 1.7 1.9 4 --vary gap 0.4 0.5 3 "
    "--periods 60 --keep 20 --quiet"
)
LYAPUNOV = f"lyapunov {SYSTEM} {START} --friction 0.5 --periods 200 --quiet"
BASINS = (
    f"basins {SYSTEM} --friction 0.5 --drive-frequency 1.5752 --scouts 60 "
    "--vary x1 -0.3 1.2 12 --vary x2 -1 1 9 --quiet"
)
ORBITS = f"orbits {SYSTEM} --drive-frequency 1.8 {START}"


def example_file() -> str:
    """Return the system file that `vibroimpact --help` shows."""
    block = cli.MORE.split("fig5b.toml:\n\n", 1)[1].split("\n\n[run] may", 1)[0]
    return textwrap.dedent(block) + "\n"


def fields(text: str) -> dict[str, str]:
    """Return what is printed by its name."""
    return dict(line.split(None, 1) for line in text.splitlines())


@pytest.fixture
def run_command(capsys):
    """Run one command line and return its exit code, output and error output."""

    def run(line: str, *more: object) -> tuple[int, str, str]:
        code = cli.main([*shlex.split(line), *map(str, more)])
        return code, *capsys.readouterr()

    return run

"""Installs the packages of the extra ``peers`` one by one, into the interpreter that runs this.

One that has no wheel for this platform is named and left out; the tables of the benchmarks then say
that it is not installed.
"""

import subprocess
import sys
import tomllib
from pathlib import Path

from progress import step

PYPROJECT = Path(__file__).parents[1] / "pyproject.toml"


def main() -> None:
    """Install what can be installed."""
    project = tomllib.loads(PYPROJECT.read_text(encoding="utf-8"))["project"]
    for requirement in project["optional-dependencies"]["peers"]:
        command = [sys.executable, "-m", "pip", "install", "--quiet", "--only-binary=:all:"]
        with step(f"installing {requirement}"):
            failed = subprocess.run([*command, requirement], check=False).returncode
        if failed:
            print(f"{requirement} cannot be installed here; its rows will say so")


if __name__ == "__main__":
    main()

"""Install a wheel or an sdist in a virtual environment of its own, and run the tests on it.

The environment and the tests are in a temporary folder, outside of the repository; the tests are
those of an sdist, so that it has to hold them. A wheel is installed with no Rust on the path.

    python packaging/try_installed.py dist/vibroimpact-*.whl dist/han*.whl --tests dist/*.tar.gz
    python packaging/try_installed.py dist/*.tar.gz dist/han*.whl --tests dist/*.tar.gz -- -k files
"""

import argparse
import os
import shutil
import subprocess
import sys
import tarfile
import tempfile
import venv
from pathlib import Path

RUST = ("cargo", "rustc", "rustup")
# Prints where the installed package is, and what it was compiled as.
WHERE = "import vibroimpact; print(vibroimpact.__version__, vibroimpact.__file__)"


def without_rust(path: str) -> str:
    """Return a search path less the folders that hold Rust."""
    folders = path.split(os.pathsep)
    return os.pathsep.join(
        folder for folder in folders if not any(shutil.which(tool, path=folder) for tool in RUST)
    )


def surroundings(*, with_rust: bool) -> dict[str, str]:
    """Return environment variables that lead to no other Python, and to Rust if wanted."""
    unwanted = ("PYTHONPATH", "PYTHONHOME", "VIRTUAL_ENV", "CONDA_PREFIX", "PYO3_PYTHON")
    found = {name: value for name, value in os.environ.items() if name not in unwanted}
    if not with_rust:
        found["PATH"] = without_rust(found["PATH"])
    for tool in RUST:
        print(f"{tool}: {shutil.which(tool, path=found['PATH']) or 'not found'}", flush=True)
    if bool(shutil.which("rustc", path=found["PATH"])) != with_rust:
        sys.exit(f"rustc must {'' if with_rust else 'not '}be on the path")
    return found | {"MPLBACKEND": "Agg"}


def unpack_tests(sdist: Path, folder: Path) -> None:
    """Unpack the tests of an sdist, and the settings of pytest, but not the package."""
    with tarfile.open(sdist) as archive:
        for member in archive:
            inside = Path(*Path(member.name).parts[1:])
            is_test = inside.parts[:1] == ("tests",) or inside.parts[1:2] == ("tests",)
            if is_test or inside == Path("pyproject.toml"):
                member.name = inside.as_posix()
                archive.extract(member, folder, filter="data")


def main() -> int:
    """Install, run the tests, and return their exit status."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("package", type=Path, help="a wheel or an sdist")
    parser.add_argument("reproduction", type=Path, help="the wheel of the reproduction")
    parser.add_argument("--tests", type=Path, required=True, help="the sdist that holds the tests")
    parser.epilog = "what comes after -- is for pytest"
    words = sys.argv[1:]
    end = words.index("--") if "--" in words else len(words)
    given, for_pytest = parser.parse_args(words[:end]), words[end + 1 :]
    is_wheel = given.package.suffix == ".whl"
    with tempfile.TemporaryDirectory(prefix="installed-", ignore_cleanup_errors=True) as name:
        folder = Path(name).resolve()
        environment = surroundings(with_rust=not is_wheel)
        venv.create(folder / "venv", with_pip=True)
        python = folder / "venv" / ("Scripts/python.exe" if os.name == "nt" else "bin/python")

        def run(*words: str | Path, **options: object) -> subprocess.CompletedProcess[str]:
            command = [str(python), *map(str, words)]
            return subprocess.run(command, env=environment, text=True, **options)

        (folder / "tree").mkdir()
        unpack_tests(given.tests.resolve(), folder / "tree")
        # What a wheel needs must come as wheels too: there is nothing to compile it with.
        binary = ["--only-binary=:all:"] if is_wheel else []
        wanted = f"{given.package.resolve()}[test]"
        run("-m", "pip", "install", "--quiet", *binary, wanted, check=True)
        beside = given.reproduction.resolve()
        run("-m", "pip", "install", "--quiet", "--no-deps", beside, check=True)
        where = run("-c", WHERE, cwd=folder / "tree", check=True, stdout=subprocess.PIPE).stdout
        print(f"{given.package.name}: {where.strip()}", flush=True)
        if not Path(where.split(maxsplit=1)[1].strip()).is_relative_to(folder / "venv"):
            sys.exit("the tests would import another package than the one installed")
        done = run("-m", "pytest", "-q", "--installed", *for_pytest, cwd=folder / "tree")
        return done.returncode


if __name__ == "__main__":
    sys.exit(main())

"""Look into the wheels and the sdist of a folder: sizes, platforms, what they hold and must not.

python packaging/check_dist.py dist
"""

import argparse
import fnmatch
import sys
import tarfile
import zipfile
from pathlib import Path, PurePosixPath

LARGEST_WHEEL = 5_000_000
LICENCES = ("LICENSE-MIT", "LICENSE-APACHE")
# Patterns match whole paths; a star goes over slashes.
WHEEL = (
    "vibroimpact/*.py",
    "vibroimpact/_core.pyi",
    "vibroimpact/_core.abi3.so",
    "vibroimpact/_core.pyd",
    "vibroimpact/py.typed",
    "vibroimpact-*.dist-info/*",
)
NEEDED_IN_WHEEL = ("vibroimpact/_core.pyi", "vibroimpact/py.typed", "vibroimpact/_core.*[od]")
SDIST = (
    "PKG-INFO",
    "pyproject.toml",
    "Cargo.toml",
    "Cargo.lock",
    "README.md",
    "CHANGELOG.md",
    "CITATION.cff",
    "SECURITY.md",
    *LICENCES,
    "src/*.rs",
    "docs/notation.md",
    "docs/theory.md",
    "benches/*.rs",
    "examples/*.rs",
    "tests/*.rs",
    "python/vibroimpact/*.py",
    "python/vibroimpact/*.pyi",
    "python/vibroimpact/py.typed",
    "tests/data/*.json",
    "tests/data/README.md",
    "tests/*.py",
    "tests/slow.txt",
    "tests/python/*.py",
    "tests/reference/*.py",
    "tests/reference/README.md",
    "reproduction/tests/*.py",
)
REPRODUCTION = (
    "han_jin_hu_2004/*.py",
    "han_jin_hu_2004/py.typed",
    "han_jin_hu_2004/reference.json",
    "han_jin_hu_2004-*.dist-info/*",
    "han_jin_hu_2004-*.dist-info/entry_points.txt",
)


def faults(names: list[str], allowed: tuple[str, ...], needed: tuple[str, ...]) -> list[str]:
    """Return in words what does not belong there, and what is missing."""

    def is_one(name: str, patterns: tuple[str, ...]) -> bool:
        return any(fnmatch.fnmatchcase(name, pattern) for pattern in patterns)

    strange = [f"{name} does not belong there" for name in names if not is_one(name, allowed)]
    missing = [f"{each} is missing" for each in needed if not fnmatch.filter(names, each)]
    return strange + missing


def wheel_faults(path: Path) -> list[str]:
    """Return what is wrong with a wheel."""
    with zipfile.ZipFile(path) as archive:
        names = [entry.filename for entry in archive.infolist() if not entry.is_dir()]
    distribution = path.name.partition("-")[0]
    licences = tuple(f"{distribution}-*.dist-info/licenses/{name}" for name in LICENCES)
    if distribution == "han_jin_hu_2004":
        found = faults(names, REPRODUCTION, REPRODUCTION + licences)
        if not path.name.endswith("-none-any.whl"):
            found.append("is not for every platform")
        return found
    found = faults(names, WHEEL, NEEDED_IN_WHEEL + licences)
    size = path.stat().st_size
    if size >= LARGEST_WHEEL:
        found.append(f"{size:,} bytes, {LARGEST_WHEEL:,} are allowed")
    if "-abi3-" not in path.name:
        found.append("is for one version of Python alone")
    return found


def sdist_faults(path: Path) -> list[str]:
    """Return what is wrong with an sdist."""
    with tarfile.open(path) as archive:
        members = [PurePosixPath(each.name) for each in archive if not each.isdir()]
    names = [str(PurePosixPath(*member.parts[1:])) for member in members]
    return faults(names, SDIST, SDIST)


def main() -> int:
    """Print sizes and faults; return 1 if there are any."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=Path, help="where the wheels and the sdist are")
    folder = parser.parse_args().folder
    wheels, sdists = sorted(folder.glob("*.whl")), sorted(folder.glob("*.tar.gz"))
    found = {path: wheel_faults(path) for path in wheels}
    found |= {path: sdist_faults(path) for path in sdists}
    for path, wrong in found.items():
        print(f"{path.stat().st_size:>9,} bytes  {path.name}")
        for words in wrong:
            print(f"  {words}")
    if not found:
        print(f"{folder} holds neither a wheel nor an sdist")
    return int(not found or any(found.values()))


if __name__ == "__main__":
    sys.exit(main())

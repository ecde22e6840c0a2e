"""C sources of the benchmarks: compiled on first use into ``benches/.build``."""

import ctypes
import hashlib
import os
import platform
import shutil
import subprocess
import sys
from pathlib import Path

BUILD = Path(__file__).parent / ".build"
FLAGS = ("-O2", "-fPIC")
# The names that a peer's library brings are looked up when it is loaded.
LATE_NAMES = ("-undefined", "dynamic_lookup") if sys.platform == "darwin" else ()


def compiler() -> str | None:
    """Return the path of gcc, or else of the system's C compiler."""
    return shutil.which("gcc") or shutil.which("cc")


def load(source: Path) -> ctypes.CDLL:
    """Compile a source file to a library, unless this text was compiled here before, and load it.

    Raises
    ------
    OSError
        If there is no C compiler, or it fails.
    """
    return ctypes.CDLL(str(_build(source, ".so", ("-shared", *LATE_NAMES))))


def program(source: Path) -> Path:
    """Compile a source file to a program, with PROGRAM defined, and return its path.

    Raises
    ------
    OSError
        If there is no C compiler, or it fails.
    """
    return _build(source, ".out", ("-DPROGRAM",))


def _build(source: Path, suffix: str, flags: tuple[str, ...]) -> Path:
    name = compiler()
    if name is None:
        raise OSError("no C compiler (gcc or cc)")
    # Beside the source, what it may include.
    text = b"".join(path.read_bytes() for path in sorted(source.parent.glob("*.c")))
    text += f"{name} {FLAGS} {flags} {platform.platform()}".encode()
    built = BUILD / f"{source.stem}-{hashlib.sha256(text).hexdigest()[:16]}{suffix}"
    if not built.exists():
        BUILD.mkdir(exist_ok=True)
        # Under a name of its own first: another process may be compiling the same file.
        fresh = built.with_suffix(f".{os.getpid()}")
        command = [name, *FLAGS, *flags, "-o", str(fresh), str(source), "-lm"]
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        if done.returncode:
            raise OSError(f"{name} could not compile {source.name}: {done.stderr.strip()}")
        fresh.replace(built)
    return built

"""C sources of the benchmarks: compiled on first use into ``benches/.build``, called by ctypes."""

import ctypes
import hashlib
import os
import platform
import shutil
import subprocess
import sys
from pathlib import Path

BUILD = Path(__file__).parent / ".build"
FLAGS = ("-O2", "-shared", "-fPIC")
# The names that a peer's library brings are looked up when it is loaded.
LATE_NAMES = ("-undefined", "dynamic_lookup") if sys.platform == "darwin" else ()


def compiler() -> str | None:
    """Return the path of gcc, or else of the system's C compiler."""
    return shutil.which("gcc") or shutil.which("cc")


def load(source: Path) -> ctypes.CDLL:
    """Compile a source file, unless this text was compiled here before, and load it.

    Raises
    ------
    OSError
        If there is no C compiler, or it fails.
    """
    program = compiler()
    if program is None:
        raise OSError("no C compiler (gcc or cc)")
    # Beside the source, what it may include.
    text = b"".join(path.read_bytes() for path in sorted(source.parent.glob("*.c")))
    text += f"{program} {FLAGS} {platform.platform()}".encode()
    library = BUILD / f"{source.stem}-{hashlib.sha256(text).hexdigest()[:16]}.so"
    if not library.exists():
        BUILD.mkdir(exist_ok=True)
        # Under a name of its own first: another process may be compiling the same file.
        fresh = library.with_suffix(f".{os.getpid()}")
        command = [program, *FLAGS, *LATE_NAMES, "-o", fresh, source, "-lm"]
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        if done.returncode:
            raise OSError(f"{program} could not compile {source.name}: {done.stderr.strip()}")
        fresh.replace(library)
    return ctypes.CDLL(str(library))

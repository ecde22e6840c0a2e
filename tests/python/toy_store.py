"""A store of the toy computation, made here or in a process that may be killed; faults of files."""

import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from toy_task import Toy, whole
from vibroimpact import sweeps

# 18 chunks, four to each of the first rows of the grid.
CHUNK = 5


def stored(path, task=None, **options):
    return sweeps.compute(task or Toy(), whole, store=path, chunk=CHUNK, **options)


def script(path, line, *, before=""):
    """Return the command of a process that computes into the store."""
    code = f"""
import os, signal, sys, resource
from pathlib import Path
sys.path.insert(0, {str(Path(__file__).parent)!r})
from toy_task import Toy, whole, assert_same
import vibroimpact as vi
from vibroimpact import sweeps
path = {str(path)!r}
{before}
{line}
"""
    return [sys.executable, "-W", "error", "-c", code]


#: Cells in a store when the process of `at_gate` comes to its gate.
STORED = 19


def at_gate(path, gate, *, before=""):
    """Start a process that stores some cells, comes to a gate, and then stores the others.

    It prints "wrote", or what ended it.
    """
    os.mkfifo(gate)
    line = f"""
try:
    task = Toy(trouble="wait", at=20, gate=Path({str(gate)!r}))
    sweeps.compute(task, whole, store=path, chunk={CHUNK})
    print("wrote")
except vi.Interrupted as error:
    print(error.result.done, error)
"""
    return subprocess.Popen(
        script(path, line, before=before),
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )


def killed(process):
    """Kill a process, and see that it was still there."""
    process.kill()
    process.communicate()
    assert process.returncode == -signal.SIGKILL


def flipped(content, bit):
    changed = bytearray(content)
    changed[bit // 8] ^= 1 << bit % 8
    return bytes(changed)


def small_disk(folder, size):
    """Return the command before which a process sees a disk of so many bytes at a folder."""
    mount = f'mount -t tmpfs -o size={size} tmpfs "{folder}" && exec "$@"'
    prefix = ["unshare", "--user", "--map-root-user", "--mount", "sh", "-c", mount, "sh"]
    try:
        tried = subprocess.run([*prefix, "true"], capture_output=True, check=False)
    except FileNotFoundError:
        tried = None
    if tried is None or tried.returncode:
        pytest.skip("no small disk can be mounted here; RLIMIT_FSIZE stands for one elsewhere")
    return prefix

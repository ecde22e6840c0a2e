"""A store of the toy computation, made here or in a process that may be killed; faults of files."""

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

"""What files and pickles hold of a run beyond its tables: its trace.

Clocks of events have digits that the tables lack, and legs of a structure begin in ways that they
do not tell. With the trace a run that comes back is differentiated along its own events, to the
bit, and nothing is simulated again. It belongs to one motion: a checksum of start, tables and trace
tells an altered file.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any, TypeAlias
from zlib import crc32

import numpy as np
from numpy.typing import NDArray

from . import _core
from .archived import Parts
from .arguments import reject

Trace: TypeAlias = tuple[NDArray[np.uint8], NDArray[np.float64]]

# Arrays of a file: the trace as JSON, without the residuals of the clocks, and these.
_NAMES = ("trace", "residuals")
_CHECKSUM = "checksum"
# What is not an array, and belongs to the motion.
_MOTION = ("system", "initial", "core")


def with_trace(parts: Parts, core: _core.Run | _core.StructureRun) -> Parts:
    """Return the parts of a run with its trace, if it has kept all of its events."""
    metadata, arrays = parts
    trace = core.trace()
    if trace is None:
        return parts
    arrays = {**arrays, **dict(zip(_NAMES, trace, strict=True))}
    return {**metadata, _CHECKSUM: _checksum(metadata, arrays)}, arrays


def without_trace(
    metadata: Mapping[str, Any], arrays: Mapping[str, NDArray[Any]]
) -> tuple[dict[str, NDArray[Any]], Trace | None]:
    """Return the other arrays of a run, and its trace; none of a run of an older format.

    Raises
    ------
    ParameterError
        If the trace is not that of this motion.
    """
    others = {name: array for name, array in arrays.items() if name not in _NAMES}
    if _CHECKSUM not in metadata and len(others) == len(arrays):
        return others, None
    given, found = metadata.get(_CHECKSUM), _checksum(metadata, arrays)
    if given != found:
        allowed = f"{found!r}, that of what the file holds; it has been altered"
        reject(_CHECKSUM, given, allowed)
    text, residuals = (arrays[name] for name in _NAMES)
    return others, (text, residuals)


def _checksum(metadata: Mapping[str, Any], arrays: Mapping[str, NDArray[Any]]) -> int:
    """Return CRC-32 of all numbers of a motion: reading a file takes longer by little."""
    known = {name: metadata[name] for name in _MOTION if name in metadata}
    found = crc32(json.dumps(known, sort_keys=True).encode())
    for name in sorted(arrays):
        array = np.ascontiguousarray(arrays[name])
        found = crc32(f"{name} {array.dtype.descr} {array.shape}".encode(), found)
        found = crc32(array.reshape(-1).view(np.uint8).data, found)
    return found

"""The file format of results: a NumPy .npz archive of plain arrays and one JSON text.

No pickle is written or read. The text, stored as the array ``metadata``, names the format, its
version, the version of vibroimpact that wrote it, and all that is not an array.
"""

import errno
import json
import os
import zipfile
import zlib
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from . import _core
from .arguments import path as checked_path
from .arguments import reject
from .whole_file import whole_file

_Result = TypeVar("_Result")
# Makes a result from its metadata and arrays.
Builder = Callable[[dict[str, Any], dict[str, NDArray[Any]]], _Result]

FORMAT = "vibroimpact"
# 2: events of sustained contact in a run. 3: diagrams are columns over a grid. 4: runs have their
# trace. What 3 holds means the same; older ones are refused.
_FORMAT_VERSION = 4
_READ = (3, _FORMAT_VERSION)

# Endings of files of tables, of which none is written.
_TABLES = (".csv", ".tsv", ".txt", ".xlsx", ".mat")

# What the readers of zip, deflate, npy and JSON raise on bytes that are not what they claim to be.
_DAMAGE = (
    ValueError,
    KeyError,
    TypeError,
    EOFError,
    RuntimeError,  # JSON nested too deep; a member that is encrypted or compressed in another way
    zipfile.BadZipFile,
    zlib.error,
)


def write(
    path: str | os.PathLike[str],
    kind: str,
    metadata: Mapping[str, Any],
    arrays: Mapping[str, NDArray[Any]],
) -> None:
    """Write a result of the given kind; the file appears at ``path`` complete or not at all.

    Raises
    ------
    OSError
        If it cannot be written; a file that was there before is unchanged.
    """
    path = checked_path("path", path)
    if Path(path).suffix in _TABLES:
        reject("path", path, "the path of a file .npz; to_pandas() gives tables for other files")
    text = json.dumps(
        {
            "format": FORMAT,
            "format_version": _FORMAT_VERSION,
            "kind": kind,
            "version": _core.__version__,
            **metadata,
        },
        allow_nan=False,
    )
    with whole_file(path) as file:
        np.savez_compressed(file, allow_pickle=False, metadata=np.array(text), **arrays)


def read(path: str | os.PathLike[str], builders: Mapping[str, Builder[_Result]]) -> _Result:
    """Read a file made by ``write`` and build the result with the builder of its kind.

    Raises
    ------
    ValueError
        If the file is damaged, was made by something else or by another version, or holds a kind
        without a builder.
    """
    path = checked_path("path", path)
    with open(path, "rb") as file:
        try:
            # Checked before any byte is used: NumPy parses headers while it reads them.
            with zipfile.ZipFile(file) as whole:
                if (name := whole.testzip()) is not None:
                    raise ValueError(f"a wrong checksum of {name}")
            file.seek(0)
            content = np.load(file, allow_pickle=False)
            if not isinstance(content, np.lib.npyio.NpzFile):
                raise ValueError("a single array")
            with content:
                arrays: dict[str, NDArray[Any]] = {name: content[name] for name in content.files}
            # Where bytes do not begin like an array NumPy returns them unchanged.
            if not all(isinstance(array, np.ndarray) for array in arrays.values()):
                raise ValueError("not all of it are arrays")
            metadata: dict[str, Any] = json.loads(arrays.pop("metadata").item())
            header = [metadata[name] for name in ("format", "format_version", "kind", "version")]
        except _DAMAGE as error:
            raise _damaged(path, error) from error
        except OSError as error:
            if error.errno != errno.EINVAL:  # an offset before the beginning of the file
                raise
            raise _damaged(path, error) from error
    name, format_version, kind, version = header
    if name != FORMAT:
        raise ValueError(f"{path}: not a vibroimpact file, its format is {name!r}")
    if format_version not in _READ:
        raise ValueError(
            f"{path}: written in format {format_version} by vibroimpact {version}; "
            f"vibroimpact {_core.__version__} reads formats {' and '.join(map(str, _READ))}"
        )
    if kind not in builders:
        raise ValueError(f"{path}: holds a {kind}, not a {' or '.join(builders)}")
    try:
        return builders[kind](metadata, arrays)
    except _DAMAGE as error:
        raise _damaged(path, error) from error


def _damaged(path: str | os.PathLike[str], error: Exception) -> ValueError:
    if Path(path).suffix == ".json":
        hint = "vibroimpact.check_proof reads the certificate of a proof; from_json of System, "
        hint += "Structure and Stop reads the text that to_json gives"
        return ValueError(f"{path}: not a vibroimpact file of arrays; {hint}")
    return ValueError(f"{path}: not a vibroimpact file, or damaged ({error!r})")

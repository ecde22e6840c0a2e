"""Reading back what ``save`` has written, and opening stores."""

import os

from . import archive
from .atlas import RESULTS, GridResult, open_columns
from .results import Run


def load(path: str | os.PathLike[str]) -> Run | GridResult:
    """Read a result from the file that its ``save`` wrote, or open the Zarr store of a computation.

    The ``load`` of each class does the same where only its own will do.

    Raises
    ------
    ValueError
        If it is damaged, or was written by something else or by another version.
    """
    if os.path.isdir(path):
        columns = open_columns(path)
        return RESULTS[columns.layout.kind](columns)
    builders: dict[str, archive.Builder[Run | GridResult]] = {"run": Run._from_parts}
    builders |= {kind: result._from_parts for kind, result in RESULTS.items()}
    return archive.read(path, builders)

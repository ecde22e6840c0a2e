"""Reading back what ``Run.save`` and ``Diagram.save`` have written."""

import os

from . import archive
from .diagrams import Diagram
from .results import Run


def load(path: str | os.PathLike[str]) -> Run | Diagram:
    """Read a run or a diagram from the file that its ``save`` wrote.

    ``Run.load`` and ``Diagram.load`` do the same where only one of the two will do.

    Raises
    ------
    ValueError
        If the file is damaged, or was written by something else or by another version.
    """
    builders: dict[str, archive.Builder[Run | Diagram]] = {
        "run": Run._from_parts,
        "diagram": Diagram._from_parts,
    }
    return archive.read(path, builders)

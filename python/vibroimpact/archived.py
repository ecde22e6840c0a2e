"""Results that a file of arrays and one JSON text holds whole: `save` and `load`."""

from __future__ import annotations

import json
import os
from abc import ABC, abstractmethod
from typing import Any, ClassVar, Self

import numpy as np
from numpy.typing import NDArray

from .interruption import interruptible

# All that is not an array, and the arrays.
Parts = tuple[dict[str, Any], dict[str, NDArray[np.generic]]]


def alike(one: NDArray[Any], other: NDArray[Any]) -> bool:
    """Whether arrays are the same to the last bit."""
    form = (one.dtype, one.shape) == (other.dtype, other.shape)
    return form and one.tobytes() == other.tobytes()


@interruptible
class Archived(ABC):
    """A result with a file of its own."""

    # What a file of it is called.
    _KIND: ClassVar[str]

    @abstractmethod
    def _parts(self) -> Parts:
        """Return metadata and arrays of a file."""

    @classmethod
    @abstractmethod
    def _from_parts(cls, metadata: dict[str, Any], arrays: dict[str, NDArray[Any]]) -> Self:
        """Return the result of such a file."""

    def __eq__(self, other: object) -> bool:
        """Whether both hold the same: the same numbers to the last bit."""
        if not isinstance(other, type(self)):
            return NotImplemented
        (_, ours), (_, theirs) = self._parts(), other._parts()
        return (
            self._text() == other._text()
            and ours.keys() == theirs.keys()
            and all(alike(array, theirs[name]) for name, array in ours.items())
        )

    def __hash__(self) -> int:
        """Return a hash that equal ones share."""
        return hash(self._text())

    def _text(self) -> str:
        """Return all that is not an array."""
        return json.dumps(self._parts()[0])

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the result to ``path`` (.npz, no pickle); ``load`` gives it back bit for bit.

        Examples
        --------
        >>> import vibroimpact as vi
        >>> system = vi.System(mass_ratio=0.6, frequency_ratio=2, restitution=0.8, gap=0.5,
        ...                    drive_frequency=1.8, moment_amplitude=1)
        >>> run = vi.simulate(system, initial=(0, 0.5, 0, 0), periods=20)
        >>> run.save("run.npz")
        >>> vi.load("run.npz") == run
        True
        """
        from . import archive  # here, to keep the import of the package light

        metadata, arrays = self._parts()
        archive.write(path, self._KIND, metadata, arrays)

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> Self:
        """Read a result of this kind that ``save`` has written.

        Raises
        ------
        ValueError
            If the file is damaged, foreign, or holds something else.

        Examples
        --------
        >>> import vibroimpact as vi
        >>> ball = vi.System(mass_ratio=0, frequency_ratio=0, restitution=0.5, gap=1,
        ...                  drive_frequency=0, contact="direct")
        >>> vi.simulate(ball, initial=(0, 2, 0, 0), time=1).save("ball.npz")
        >>> vi.Run.load("ball.npz").impact_count
        1
        """
        from . import archive  # here, to keep the import of the package light

        return archive.read(path, {cls._KIND: cls._from_parts})

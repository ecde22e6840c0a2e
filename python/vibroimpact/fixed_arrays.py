"""Results whose copies and pickles are as read-only as they are themselves."""

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray


class FixedArrays:
    """An object with read-only arrays as attributes, or in mappings that are attributes.

    In a deep copy or a pickle NumPy does not keep the read-only flag of an array.
    """

    def __getstate__(self) -> tuple[dict[str, Any], list[str]]:
        """Return the attributes, and the names of those that may not be written to."""
        state = dict(vars(self))
        return state, [name for name, value in state.items() if _is_fixed(value)]

    def __setstate__(self, state: tuple[dict[str, Any], list[str]]) -> None:
        """Set the attributes, and make the named arrays read-only."""
        attributes, fixed = state
        for name in fixed:
            for array in _arrays(attributes[name]):
                array.flags.writeable = False
        vars(self).update(attributes)


def _is_fixed(value: object) -> bool:
    arrays = [*_arrays(value)]
    return bool(arrays) and not any(array.flags.writeable for array in arrays)


def _arrays(value: object) -> Iterator[NDArray[Any]]:
    entries = value.values() if isinstance(value, Mapping) else (value,)
    return (entry for entry in entries if isinstance(entry, np.ndarray))

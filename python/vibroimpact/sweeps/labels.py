"""Labels of cells, made from the columns ``motion``, ``m`` and ``n``."""

import numpy as np
from numpy.typing import NDArray

from .. import _core


def orbit_label(m: int, n: int) -> str:
    """Return the label of an orbit from the columns `m` and `n`: 3-4, 1-inf."""
    return f"{m}-{'inf' if n == -1 else n}"


def labels(
    motion: NDArray[np.int8], m: NDArray[np.int64], n: NDArray[np.int64]
) -> NDArray[np.str_]:
    """Return the label of each cell, of the arrays' shape."""
    # One number for each, of 30, 31 and 2 bits, which sorts faster than three; n is -1 at least.
    keys, inverse = np.unique((m << 33) + ((n + 1) << 2) + motion, return_inverse=True)
    texts = [
        orbit_label(key >> 33, (key >> 2) % 2**31 - 1) if key >> 33 else _core.MOTION_NAMES[key % 4]
        for key in keys.tolist()
    ]
    return np.array(texts, dtype=np.str_)[inverse].reshape(m.shape)

"""The labels of a data set, computed when they are used.

Only this module imports xarray, which is optional; the module is imported with the first data set.
"""

from typing import Any

import numpy as np
import xarray
from xarray.backends import BackendArray
from xarray.core import indexing

from .labels import labels


class LabelArray(BackendArray):
    """Labels from the variables motion, m and n, of which only the part asked for is read."""

    # m and n have up to ten digits.
    dtype = np.dtype("<U21")

    def __init__(self, parts: tuple[xarray.Variable, ...]) -> None:
        self.parts = parts
        self.shape = parts[0].shape

    def __getitem__(self, key: indexing.ExplicitIndexer) -> Any:
        """Return the labels of a part."""
        return indexing.explicit_indexing_adapter(
            key, self.shape, indexing.IndexingSupport.BASIC, self._read
        )

    def _read(self, key: tuple[int | slice, ...]) -> Any:
        return labels(*(part[key].values for part in self.parts)).astype(self.dtype)


def with_label(data: xarray.Dataset) -> xarray.Dataset:
    """Return the data set with the variable ``label`` where it has motions."""
    if "motion" not in data:
        return data
    parts = tuple(data[name].variable for name in ("motion", "m", "n"))
    array = indexing.LazilyIndexedArray(LabelArray(parts))
    attributes = {"description": "m-n, m-inf (chatter), quasi-periodic, chaotic, unresolved"}
    return data.assign(label=xarray.Variable(parts[0].dims, array, attributes))

"""Results of sweeps with other numbers, for what is hard to come by in a short computation."""

from typing import TypeVar

import numpy as np

from vibroimpact.sweeps import STATUS_NAMES, GridResult
from vibroimpact.sweeps.cells import MOTION
from vibroimpact.sweeps.results import in_memory

Result = TypeVar("Result", bound=GridResult)


def with_columns(result: Result, **columns) -> Result:
    """Return a result with these columns in place of its own; status and motion by name."""
    for name, names in (("status", STATUS_NAMES), ("motion", MOTION.flags)):
        if name in columns:
            given = np.asarray(columns[name])
            columns[name] = np.vectorize(names.index, otypes=[np.int8])(given)
    layout = result.columns.layout
    arrays = {entry.name: result.columns[entry.name] for entry, _ in layout.arrays()}
    return type(result)(in_memory(layout, arrays | columns))

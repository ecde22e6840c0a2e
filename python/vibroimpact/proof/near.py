"""Matrices near the inverse of a derivative: any matrix will do, and no proof rests on them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from flint import arb, arb_mat

from .formulas import Undecided


def near_inverse(orbit: Any, z: Sequence[arb]) -> list[arb_mat]:
    """Near the inverse of DF of an `Orbit`, in columns of legs."""
    count, width = len(orbit.legs), len(z) // len(orbit.legs)
    matrix = np.zeros((count, width, count, width))
    try:
        for k, flight in enumerate(orbit.flights(z)):
            for block, place in zip(orbit.blocks(k, flight), (k, (k + 1) % count), strict=True):
                rows = [[float(x.mid()) for x in row] for row in block.tolist()]
                matrix[k, :, place] += np.array(rows)
        inverse = np.linalg.inv(matrix.reshape(len(z), len(z)))
        return [arb_mat(part.tolist()) for part in np.split(inverse, count, axis=1)]
    except (np.linalg.LinAlgError, ValueError, ZeroDivisionError) as error:
        raise Undecided("the equations are singular") from error

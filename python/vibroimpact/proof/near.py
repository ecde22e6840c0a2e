"""Matrices near the inverse of a derivative: any matrix will do, and no proof rests on them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from flint import acb, acb_mat, arb, arb_mat

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


def inverse_of(matrix: arb_mat) -> arb_mat:
    """Near the inverse of a matrix."""
    try:
        rows = [[float(x.mid()) for x in row] for row in matrix.tolist()]
        return arb_mat(np.linalg.inv(np.array(rows)).tolist())
    except (np.linalg.LinAlgError, ValueError) as error:
        raise Undecided("the equations are singular") from error


def inverses_of(given: Sequence[arb_mat]) -> list[arb_mat]:
    """Near the coefficients of the inverse of a power series of matrices."""
    found = [inverse_of(given[0])]
    for k in range(1, len(given)):
        parts = [_middle(given[j]) * found[k - j] for j in range(1, k + 1)]
        found.append(_middle(-found[0] * sum(parts[1:], parts[0])))
    return found


def _middle(matrix: arb_mat) -> arb_mat:
    return arb_mat([[x.mid() for x in row] for row in matrix.tolist()])


def eigenvectors(matrix: acb_mat) -> acb_mat:
    """Near the eigenvectors of a matrix, in columns."""
    rows = np.linalg.eig(_numbers(matrix))[1].tolist()
    return acb_mat([[acb(x.real, x.imag) for x in row] for row in rows])


def singular_basis(matrix: arb_mat) -> tuple[arb_mat, arb_mat]:
    """Two matrices whose product about another one is near 1, but for its least singular value."""
    left, sizes, right = np.linalg.svd(_numbers(acb_mat(matrix)).real)
    scale = np.append(1.0 / sizes[:-1], 1.0)
    return arb_mat((left * scale).T.tolist()), arb_mat(right.T.tolist())


def _number(x: acb) -> complex:
    return complex(float(x.real.mid()), float(x.imag.mid()))


def _numbers(matrix: acb_mat) -> Any:
    numbers = np.array([[_number(x) for x in row] for row in matrix.tolist()])
    if not np.isfinite(numbers).all():
        raise Undecided("the derivative of the return map is not bounded")
    return numbers

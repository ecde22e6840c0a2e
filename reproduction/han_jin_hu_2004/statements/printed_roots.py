"""The characteristic equation (45) with (C.1) to (C.4), and its roots (46), (47), as printed."""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Roots = NDArray[np.complex128]


def characteristic(a: Array) -> tuple[float, float, float, float]:
    """J_0 to J_3 of (C.1) to (C.4), of a matrix of shape (4, 4)."""
    (a11, a12, a13, a14), (a21, a22, a23, a24) = a[:2].tolist()
    (a31, a32, a33, a34), (a41, a42, a43, a44) = a[2:].tolist()
    j0 = (
        (a11 * a22 - a21 * a12) * (a33 * a44 - a34 * a43)
        - (a11 * a32 - a31 * a12) * (a23 * a44 - a24 * a43)
        - (a11 * a42 - a41 * a12) * (a24 * a33 - a23 * a34)
        - (a13 * a44 - a14 * a43) * (a31 * a22 - a21 * a32)
        - (a14 * a33 - a13 * a34) * (a41 * a22 - a21 * a42)
        + (a14 * a23 - a13 * a24) * (a41 * a32 - a31 * a42)
    )
    j1 = (
        -a11 * (a22 * a33 - a23 * a32 + a22 * a44 - a24 * a42 + a33 * a44 - a34 * a43)
        - a22 * (a33 * a44 - a34 * a43)
        + a12 * (a21 * a33 - a31 * a23 + a21 * a44 - a41 * a24)
        - a13 * (a21 * a32 - a31 * a22 + a41 * a34 - a31 * a44)
        + a14 * (a41 * a33 - a31 * a43 + a41 * a22 - a21 * a42)
        + a32 * (a23 * a44 - a24 * a43)
        + a42 * (a24 * a33 - a23 * a34)
    )
    j2 = (
        a11 * a22
        - a12 * a21
        + a11 * a33
        - a13 * a31
        + a11 * a44
        - a14 * a41
        + a22 * a33
        - a23 * a32
        + a22 * a44
        - a24 * a42
        + a33 * a44
        - a34 * a43
    )
    return j0, j1, j2, -(a11 + a22 + a33 + a44)


def roots(j: tuple[float, float, float, float], *, corrected: bool) -> Roots:
    """Roots by (46), (47); corrected, with J2^2 for J2^3, and J3^2/2 - 4 J2/3 in D (E6)."""
    j0, j1, j2, j3 = (complex(value) for value in j)
    inner = 12 * j0 + (j2**2 if corrected else j2**3) - 3 * j1 * j3
    g = 2 * j2**3 - 9 * j1 * j2 * j3 + 27 * j1**2 + 27 * j0 * j3**2 - 72 * j0 * j2
    b = g**2 - 4 * inner**3
    cube = (np.sqrt(b) + g) ** (1 / 3)
    one, other = cube / (3 * 2 ** (1 / 3)), 2 ** (1 / 3) * inner / (3 * cube)
    a = one + j3**2 / 4 - 2 * j2 / 3 + other
    d = -one - other + (j3**2 / 2 - 4 * j2 / 3 if corrected else j3**2 / 4 - 2 * j2 / 3)
    half, last = np.sqrt(a), (-8 * j1 + 4 * j2 * j3 - j3**3) / (4 * np.sqrt(a))
    up, down = np.sqrt(d + last) / 2, np.sqrt(d - last) / 2
    pairs = ((half, up), (half, -up), (-half, down), (-half, -down))
    return np.array([middle / 2 - j3 / 4 + way for middle, way in pairs])


def apart(found: Roots, exact: Roots) -> float:
    """Largest distance of a root from the nearest exact one, and the other way round."""
    table = np.abs(found[:, None] - exact[None, :])
    return float(max(table.min(axis=0).max(), table.min(axis=1).max()))

"""Formulas of section 3 and of the appendices as they are printed.

S is the matrix S_ij of (29), shape (4, 4): rows x1, x1', x2, x2'; columns by displacement, by
velocity, by sin phi, by cos phi.
"""

import math

import numpy as np
from numpy.typing import NDArray

from vibroimpact import System

Array = NDArray[np.float64]


def flight(omega0: float, zeta: float, f: float, omega: float, t: float) -> Array:
    """(A.1) to (A.8) of one body, shape (2, 4)."""
    w2 = omega0**2 - omega**2
    h = w2**2 + (2 * zeta * omega * omega0) ** 2
    wd = omega0 * math.sqrt(1 - zeta**2)
    zw = zeta * omega0
    e, s, c = math.exp(-zw * t), math.sin(wd * t), math.cos(wd * t)
    sn, cn = math.sin(omega * t), math.cos(omega * t)
    s11 = e * (zw / wd * s + c)
    s12 = e / wd * s
    s13 = f * omega * e / h * ((w2 - 2 * zw**2) / wd * s - 2 * zw * c)
    s13 -= f / h * (w2 * sn - 2 * zw * omega * cn)
    s14 = -f * e / h * (zw / wd * (omega0**2 + omega**2) * s + w2 * c)
    s14 += f / h * (2 * zw * omega * sn + w2 * cn)
    s21 = -e * (zw**2 / wd + wd) * s
    s22 = -e * (zw / wd * s - c)
    s23 = f * omega * e / h * (-zw / wd * (w2 - 2 * zw**2 - 2 * wd**2) * s + w2 * c)
    s23 -= f * omega / h * (2 * zw * omega * sn + w2 * cn)
    inner = (zw**2 * (omega0**2 + omega**2) + wd**2 * w2) / wd * s
    s24 = f * e / h * (inner - 2 * zeta * omega**2 * omega0 * c)
    s24 -= f * omega / h * (w2 * sn - 2 * zw * omega * cn)
    return np.array([[s11, s12, s13, s14], [s21, s22, s23, s24]])


def period(system: System, n: int) -> Array:
    """S_ij of (29): the flights of both bodies over n drive periods."""
    omega, t = system.drive_frequency, n * system.drive_period
    first = flight(
        system.frequency_ratio, system.pendulum_damping, system.moment_amplitude, omega, t
    )
    second = flight(1.0, system.oscillator_damping, system.force_amplitude, omega, t)
    return np.vstack([first, second])


def simplified_period(system: System, n: int) -> Array:
    """S_ij of (36), without damping and force."""
    omega, w0, f1 = system.drive_frequency, system.frequency_ratio, system.moment_amplitude
    turn, own = 2 * n * math.pi * w0 / omega, 2 * n * math.pi / omega
    s = np.zeros((4, 4))
    s[0, 0] = s[1, 1] = math.cos(turn)
    s[0, 1] = math.sin(turn) / w0
    s[0, 2] = f1 * omega / (w0 * (w0**2 - omega**2)) * math.sin(turn)
    s[0, 3] = f1 / (w0**2 - omega**2) * (1 - math.cos(turn))
    s[1, 0] = -(w0**2) * s[0, 1]
    s[1, 2] = -omega * s[0, 3]
    s[1, 3] = w0**2 * s[0, 2] / omega
    s[2, 0] = s[3, 1] = math.cos(own)
    s[2, 1] = math.sin(own)
    s[3, 0] = -s[2, 1]
    return s


def linear_system(s: Array, r: Array, x10: float, gap: float) -> tuple[Array, Array]:
    """Matrix and right-hand side of (31), for (x1', x2', sin phi, cos phi)."""
    r1, r2, r3, r4 = r
    matrix = np.array(
        [
            [r1 * s[0, 1], r2 * s[0, 1], s[0, 2], s[0, 3]],
            [r1 * s[1, 1] - 1, r2 * s[1, 1], s[1, 2], s[1, 3]],
            [r3 * s[2, 1], r4 * s[2, 1], s[2, 2], s[2, 3]],
            [r3 * s[3, 1], r4 * s[3, 1] - 1, s[3, 2], s[3, 3]],
        ]
    )
    x20 = math.sin(x10) - gap
    rhs = -np.array([(s[0, 0] - 1) * x10, s[1, 0] * x10, (s[2, 0] - 1) * x20, s[3, 0] * x20])
    return matrix, rhs


def coefficients(s: Array, r: Array) -> tuple[float, Array]:
    """b_0 of (B.1), and b_ij of (B.2) to (B.9), shape (4, 2)."""
    r1, r2, r3, r4 = (float(value) for value in r)
    (s11, s12, s13, s14), (s21, s22, s23, s24) = s[:2].tolist()
    (s31, s32, s33, s34), (s41, s42, s43, s44) = s[2:].tolist()
    o, p = s11 - 1, s31 - 1
    turn = s22 * o - s12 * s21
    b0 = (
        r1 * (s12 * (s24 * s33 - s23 * s34) + s22 * (s13 * s34 - s14 * s33))
        + r2 * s12 * (s33 * s44 - s34 * s43)
        + r3 * s32 * (s14 * s23 - s13 * s24)
        + r4 * (s32 * (s14 * s43 - s13 * s44) + s42 * (s13 * s34 - s14 * s33))
        + r1
        * r4
        * (
            s22 * s32 * (s13 * s44 - s14 * s43)
            + s22 * s42 * (s14 * s33 - s13 * s34)
            + s12 * s32 * (s24 * s43 - s23 * s44)
            + s12 * s42 * (s23 * s34 - s24 * s33)
        )
        + r2
        * r3
        * (
            s12 * s32 * (s23 * s44 - s24 * s43)
            + s22 * s32 * (s14 * s43 - s13 * s44)
            + s42 * s12 * (s24 * s33 - s23 * s34)
            + s42 * s22 * (s13 * s34 - s14 * s33)
        )
        + s14 * s33
        - s13 * s34
    )
    b11 = (
        r2 * (s34 * s43 - s33 * s44) * turn
        + r4
        * (
            s21 * s32 * (s14 * s43 - s13 * s44)
            + s21 * s42 * (s13 * s34 - s14 * s33)
            + s32 * o * (s23 * s44 - s24 * s43)
            + s42 * o * (s24 * s33 - s23 * s34)
        )
        + o * (s23 * s34 - s24 * s33)
        - s21 * (s13 * s34 - s14 * s33)
    )
    b12 = (
        r2
        * (
            s41 * s12 * (s23 * s34 - s24 * s33)
            + s41 * s22 * (s14 * s33 - s13 * s34)
            + s12 * p * (s24 * s43 - s23 * s44)
            + s22 * p * (s13 * s44 - s14 * s43)
        )
        + r4 * (s14 * s23 - s13 * s24) * (s42 * p - s41 * s32)
        + p * (s13 * s24 - s14 * s23)
    )
    b21 = (
        r1 * (s33 * s44 - s34 * s43) * turn
        + r3
        * (
            s21 * s32 * (s13 * s44 - s14 * s43)
            + s32 * o * (s24 * s43 - s23 * s44)
            + s21 * s42 * (s14 * s33 - s13 * s34)
            + s42 * o * (s23 * s34 - s24 * s33)
        )
        + o * (s34 * s43 - s33 * s44)
    )
    b22 = (
        r1
        * (
            s41 * s12 * (s24 * s33 - s23 * s34)
            + s41 * s22 * (s13 * s34 - s14 * s33)
            + s12 * p * (s23 * s44 - s24 * s43)
            + s22 * p * (s14 * s43 - s13 * s44)
        )
        + r3 * (s13 * s24 - s14 * s23) * (s42 * p - s41 * s32)
        + p * (s13 * s44 - s14 * s43)
        + s41 * (s14 * s33 - s13 * s34)
    )
    b31 = (
        r1 * (r4 * (s42 * s34 - s32 * s44) - s34) * turn
        + r2 * r3 * (s32 * s44 - s42 * s34) * turn
        + r3 * s32 * (s24 * o - s21 * s14)
        + r4 * o * (s32 * s44 - s42 * s34)
        + s34 * o
    )
    b41 = (
        r1 * (s33 - r4 * (s42 * s33 - s32 * s43)) * turn
        + r2 * r3 * (s42 * s33 - s32 * s43) * turn
        + r3 * s32 * (-s23 * o + s21 * s13)
        + r4 * o * (s42 * s33 - s32 * s43)
        - s33 * o
    )
    kick = (1 - r4 * s42) * p + r4 * s32 * s41
    back = -s42 * p + s32 * s41
    b32 = (
        r1 * kick * (s22 * s14 - s12 * s24)
        + r2 * s12 * (-s44 * p + s34 * s41)
        + r2 * r3 * (s12 * s24 - s14 * s22) * back
        + r4 * s14 * (s42 * p - s32 * s41)
        - s14 * p
    )
    b42 = (
        r1 * kick * (s12 * s23 - s22 * s13)
        + r2 * s12 * (s43 * p - s33 * s41)
        + r2 * r3 * (s22 * s13 - s12 * s23) * back
        + r4 * s13 * back
        + s13 * p
    )
    return b0, np.array([[b11, b12], [b21, b22], [b31, b32], [b41, b42]])


def condition_37(system: System, n: int, x10: float) -> float:
    """Left-hand side of (37)."""
    m, r, w, w0 = (
        system.mass_ratio,
        system.restitution,
        system.drive_frequency,
        system.frequency_ratio,
    )
    cos = math.cos(x10)
    turn = math.sin(2 * n * math.pi / w) * (math.cos(2 * n * math.pi * w0 / w) - 1)
    top: float = 2 * (1 + r) * m * system.moment_amplitude**2 * w * cos * turn
    return top / ((m + cos**2) * (w0**2 - w**2) ** 2)


def equation_38(system: System, n: int, x10: float) -> tuple[float, float]:
    """Both sides of (38)."""
    m, r, w, w0 = (
        system.mass_ratio,
        system.restitution,
        system.drive_frequency,
        system.frequency_ratio,
    )
    cos, x20 = math.cos(x10), math.sin(x10) - system.gap
    tan, tan0 = math.tan(n * math.pi / w), math.tan(n * math.pi * w0 / w)
    left = x10**2 + 2 * tan * cos / (m * w0 * tan0) * x20 * x10
    square = cos**2 / (w0**2 * tan0**2)
    square += (1 - r) ** 2 * (m + cos**2) ** 2 / ((1 + r) ** 2 * w**2 * cos**2)
    left += tan**2 / m**2 * square * x20**2
    return left, system.moment_amplitude**2 / (w0**2 - w**2) ** 2


def state_39_40(system: System, n: int, x10: float) -> Array:
    """x1', x2', sin phi, cos phi of (39) and (40)."""
    m, r, w, w0 = (
        system.mass_ratio,
        system.restitution,
        system.drive_frequency,
        system.frequency_ratio,
    )
    f1, cos, x20 = system.moment_amplitude, math.cos(x10), math.sin(x10) - system.gap
    tan, tan0 = math.tan(n * math.pi / w), math.tan(n * math.pi * w0 / w)
    v1 = ((1 - r) * m + 2 * cos**2) * tan / ((1 + r) * m * cos) * x20
    sine = -(1 - r) * (w0**2 - w**2) * (m + cos**2) * tan / ((1 + r) * m * f1 * w * cos) * x20
    cosine = (w0**2 - w**2) / f1 * (x10 + tan * cos / (m * w0 * tan0) * x20)
    return np.array([v1, -tan * x20, sine, cosine])


def residual_41(s: Array, r: Array, gap: float, y: Array) -> Array:
    """Left-hand sides of (41) at Y = (x10, x10', x20', phi)."""
    x10, v1, v2, phi = y
    sine, cosine = np.sin(phi), np.cos(phi)
    r1, r2, r3, r4 = r
    return np.array(
        [
            (s[0, 0] - 1) * x10 + (r1 * v1 + r2 * v2) * s[0, 1] + s[0, 2] * sine + s[0, 3] * cosine,
            s[1, 0] * x10
            + (r1 * s[1, 1] - 1) * v1
            + r2 * s[1, 1] * v2
            + s[1, 2] * sine
            + s[1, 3] * cosine,
            (s[2, 0] - 1) * (np.sin(x10) - gap)
            + (r3 * v1 + r4 * v2) * s[2, 1]
            + s[2, 2] * sine
            + s[2, 3] * cosine,
            s[3, 0] * (np.sin(x10) - gap)
            + r3 * s[3, 1] * v1
            + (r4 * s[3, 1] - 1) * v2
            + s[3, 2] * sine
            + s[3, 3] * cosine,
        ]
    )


def jacobian_43(s: Array, r: Array, slope: Array, y: Array) -> Array:
    """a_ij of (43)."""
    x10, v1, v2, phi = (float(value) for value in y)
    sine, cosine, cos = math.sin(phi), math.cos(phi), math.cos(x10)
    first, second = slope[0] * v1 + slope[1] * v2, slope[2] * v1 + slope[3] * v2
    r1, r2, r3, r4 = r
    by_phase = s[:, 2] * cosine - s[:, 3] * sine
    rows = [
        [s[0, 0] - 1 + s[0, 1] * first, r1 * s[0, 1], r2 * s[0, 1]],
        [s[1, 0] + s[1, 1] * first, r1 * s[1, 1] - 1, r2 * s[1, 1]],
        [(s[2, 0] - 1) * cos + s[2, 1] * second, r3 * s[2, 1], r4 * s[2, 1]],
        [s[3, 0] * cos + s[3, 1] * second, r3 * s[3, 1], r4 * s[3, 1] - 1],
    ]
    return np.column_stack([np.array(rows), by_phase])

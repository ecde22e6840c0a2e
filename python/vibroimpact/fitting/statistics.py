"""What residuals tell: whether they are as large as stated, and whether they are random.

Standard errors and what a record leaves undetermined come from the singular values of the weighted
derivative. Sources: P. R. Bevington, D. K. Robinson, *Data Reduction and Error Analysis*, 3rd ed.,
2003, ch. 8 and 11; G. M. Ljung, G. E. P. Box, Biometrika 65 (1978) 297; A. Wald, J. Wolfowitz,
Ann. Math. Stat. 11 (1940) 147; P. J. Huber, *Robust Statistics*, 1981, ch. 7.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

# Where the series and the continued fraction of the incomplete gamma function end.
_EPSILON, _MOST_TERMS = 1e-15, 100_000
# Fewer residuals than this tell nothing about their order.
_LEAST = 12
# Lags of the test of Ljung and Box: at most so many, and at most this part of the rows.
_MOST_LAGS, _PART = 10, 5
# Robust losses stop to tell outliers from others at this many standard errors.
_OUTLIER = 3.0
# Residuals are cut off at so many standard errors; of normal ones half are below this many.
_CUT, _MEDIAN = 4.0, 0.6745
# Singular values below this part of the largest are rounding.
_ROUNDING = 1e-10
# A part of a combination that is smaller is rounding.
_PART_OF_ONE = 1e-6
# A derivative so small, in units of sizes per standard error, is none.
_NOTHING = 1e-30


def chi2_tail(value: float, dof: float) -> float:
    """Return the probability that chi-square of ``dof`` degrees is larger than ``value``."""
    if value <= 0.0:
        return 1.0
    if not math.isfinite(value):
        return 0.0
    a, x = dof / 2.0, value / 2.0
    log_front = a * math.log(x) - x - math.lgamma(a)
    front = math.exp(log_front) if log_front > -740.0 else 0.0
    if x < a + 1.0:  # the series of the lower function
        term = total = 1.0 / a
        for k in range(1, _MOST_TERMS):
            term *= x / (a + k)
            total += term
            if term < total * _EPSILON:
                break
        return max(0.0, 1.0 - front * total)
    # Continued fraction of the upper function, by Lentz's method.
    b = x + 1.0 - a
    c, d = 1e300, 1.0 / b
    fraction = d
    for k in range(1, _MOST_TERMS):
        numerator = -k * (k - a)
        b += 2.0
        d = 1.0 / (numerator * d + b)
        c = b + numerator / c
        step = c * d
        fraction *= step
        if abs(step - 1.0) < _EPSILON:
            break
    return min(1.0, front * fraction)


def ljung_box(residuals: Array) -> float:
    """Return the probability of so much correlation of neighbours by chance; 1 for few rows."""
    n = len(residuals)
    if n < _LEAST:
        return 1.0
    centred = residuals - residuals.mean()
    power = float(centred @ centred)
    if power == 0.0:
        return 1.0
    lags = min(_MOST_LAGS, n // _PART)
    correlations = [float(centred[k:] @ centred[:-k]) / power for k in range(1, lags + 1)]
    q = n * (n + 2) * sum(r * r / (n - k) for k, r in enumerate(correlations, start=1))
    return chi2_tail(q, lags)


def runs_test(residuals: Array) -> float:
    """Return the probability of so few or so many changes of sign by chance; 1 for few rows."""
    signs = residuals[residuals != 0.0] > 0.0
    n, above = len(signs), int(signs.sum())
    below = n - above
    if n < _LEAST or above < 5 or below < 5:
        return 1.0
    runs = 1 + int((signs[1:] != signs[:-1]).sum())
    mean = 1.0 + 2.0 * above * below / n
    variance = (mean - 1.0) * (mean - 2.0) / (n - 1.0)
    return math.erfc(abs(runs - mean) / math.sqrt(2.0 * variance))


def sign_test(residuals: Array) -> float:
    """Return the probability of so unequal numbers of signs by chance; 1 for few rows."""
    signs = residuals[residuals != 0.0] > 0.0
    n = len(signs)
    if n < _LEAST:
        return 1.0
    return math.erfc(abs(2.0 * float(signs.sum()) - n) / math.sqrt(2.0 * n))


def bounded(z: Array) -> Array:
    """Return residuals cut off at four times the usual one, which outliers do not move.

    Where most are larger than stated, they keep their order.
    """
    usual = max(1.0, float(np.median(np.abs(z))) / _MEDIAN) if len(z) else 1.0
    return np.clip(z, -_CUT * usual, _CUT * usual)


def are_negligible(z: Array) -> bool:
    """Whether residuals in standard errors move no value by one, even if they are systematic.

    They move the values by (J^T J)^-1 J^T z: in units of standard errors by |z| at most.
    """
    return float(z @ z) <= 1.0


@dataclass(frozen=True)
class Determination:
    """What a weighted derivative says about unknowns: shape (k, k) and (k,).

    Attributes
    ----------
    covariance
        Of the unknowns; along combinations that are left open to rounding it is finite, but huge.
    errors
        Standard errors; infinite where a combination that is open to rounding has a part in it.
    open
        Combinations that the record does not determine: rows, in units of the scales, of length 1.
    open_errors
        Their standard errors in units of the scales; infinite where all is rounding.
    spread
        Independent deviations of one standard error, as sums of the changes: columns.
    """

    covariance: Array
    errors: Array
    open: Array
    open_errors: Array
    spread: Array


def determination(
    derivative: Array, changes: Array, scales: Array, variance: float
) -> Determination:
    """Return what is determined by residuals of unit variance, whose derivative is (n, k).

    It is that by k ``changes`` of the unknowns, whose columns are in units of the scales.
    ``scales`` are the sizes of the unknowns: a combination whose standard error is larger than 1 in
    these units is not determined. ``variance`` multiplies the covariance.
    """
    k = derivative.shape[1]
    if len(derivative) < k:
        derivative = np.vstack([derivative, np.zeros((k - len(derivative), k))])
    _, singular, rows = np.linalg.svd(derivative, full_matrices=False)
    floor = max(float(singular[0]) * _ROUNDING, _NOTHING)
    lost = singular <= floor
    deviations = math.sqrt(variance) / np.where(lost, floor, singular)
    spread = rows.T * deviations
    directions = changes @ rows.T
    factor = (changes @ spread) * scales[:, None]
    covariance = factor @ factor.T
    errors = np.sqrt(np.diag(covariance))
    # A combination counts as a part of an unknown where rounding has not made its coefficient.
    taken = (np.abs(directions[:, lost]) > _PART_OF_ONE).any(axis=1)
    errors = np.where(taken, np.inf, errors)
    # Of what is not lost the axes of the ellipsoid of errors, of the rest the directions.
    axes, sizes, _ = np.linalg.svd((directions * deviations)[:, ~lost], full_matrices=False)
    nothing, length, _ = np.linalg.svd(directions[:, lost], full_matrices=False)
    bad, known = sizes > 1.0, length > _PART_OF_ONE
    return Determination(
        covariance,
        errors,
        np.vstack([axes[:, bad].T, nothing[:, known].T]),
        np.concatenate([sizes[bad], np.full(int(known.sum()), np.inf)]),
        spread,
    )


# Losses: weights of rows in the least squares, as functions of z = residual/sigma.


def weights(loss: str, z: Array) -> Array:
    """Return psi(z)/z of a loss, with which least squares have its equations."""
    size = np.abs(z)
    match loss:
        case "soft_l1":
            return 1.0 / np.sqrt(1.0 + (z / _SOFT) ** 2)
        case "huber":
            return np.where(size <= _HUBER, 1.0, _HUBER / np.maximum(size, _HUBER))
        case "cauchy":
            return 1.0 / (1.0 + (z / _CAUCHY) ** 2)
    return np.ones_like(z)


def costs(loss: str, z: Array) -> float:
    """Return the sum of the loss: half the sum of squares where all residuals are small."""
    square = z * z
    match loss:
        case "soft_l1":
            return float(_SOFT**2 * (np.sqrt(1.0 + square / _SOFT**2) - 1.0).sum())
        case "huber":
            far = _HUBER * np.abs(z) - 0.5 * _HUBER**2
            return float(np.where(np.abs(z) <= _HUBER, 0.5 * square, far).sum())
        case "cauchy":
            return float(0.5 * _CAUCHY**2 * np.log1p(square / _CAUCHY**2).sum())
    return 0.5 * float(square.sum())


def slopes(loss: str, z: Array) -> Array:
    """Return psi'(z) of a loss."""
    match loss:
        case "soft_l1":
            return (1.0 + (z / _SOFT) ** 2) ** -1.5
        case "huber":
            return (np.abs(z) <= _HUBER).astype(np.float64)
        case "cauchy":
            square = (z / _CAUCHY) ** 2
            return (1.0 - square) / (1.0 + square) ** 2
    return np.ones_like(z)


# Constants of 95 % efficiency at normal errors (Huber; Holland and Welsch, 1977); that of soft_l1
# lies between.
_HUBER, _CAUCHY, _SOFT = 1.345, 2.385, 1.345
LOSSES = ("linear", "soft_l1", "huber", "cauchy")


def inflation(loss: str, z: Array, unknowns: int) -> float:
    """Return the factor on the inverse of J^T J of an estimate with a loss (Huber, 7.6)."""
    n = len(z)
    if loss == "linear" or n <= unknowns:
        return 1.0
    psi = weights(loss, z) * z
    mean = float(slopes(loss, z).mean())
    if mean <= 0.1:  # nearly all rows count as outliers: nothing is known
        mean = 0.1
    return float(psi @ psi) / (n - unknowns) / mean**2

"""Derivatives of NumPy's elementwise functions.

Source: A. Griewank, A. Walther, *Evaluating Derivatives*, 2nd ed., SIAM, 2008, ch. 3.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np


def _one(*_: Any) -> float:
    return 1.0


# Derivatives of elementwise functions by each of their arguments, which come first; then the value.
RULES: dict[Any, tuple[Callable[..., Any], ...]] = {
    np.add: (_one, _one),
    np.subtract: (_one, lambda *_: -1.0),
    np.multiply: (lambda a, b, y: b, lambda a, b, y: a),
    np.divide: (lambda a, b, y: 1.0 / b, lambda a, b, y: -y / b),
    np.power: (
        lambda a, b, y: np.where(b == 0.0, 0.0, b * a ** (b - 1.0)),
        lambda a, b, y: y * np.log(a),
    ),
    np.remainder: (_one, lambda a, b, y: -np.floor_divide(a, b)),
    np.arctan2: (lambda a, b, y: b / (a * a + b * b), lambda a, b, y: -a / (a * a + b * b)),
    np.hypot: (lambda a, b, y: a / y, lambda a, b, y: b / y),
    np.maximum: (lambda a, b, y: a >= b, lambda a, b, y: a < b),
    np.minimum: (lambda a, b, y: a <= b, lambda a, b, y: a > b),
    np.negative: (lambda a, y: -1.0,),
    np.positive: (_one,),
    np.absolute: (lambda a, y: np.sign(a),),
    np.fabs: (lambda a, y: np.sign(a),),
    np.square: (lambda a, y: 2.0 * a,),
    np.sqrt: (lambda a, y: 0.5 / y,),
    np.cbrt: (lambda a, y: 1.0 / (3.0 * y * y),),
    np.reciprocal: (lambda a, y: -y * y,),
    np.exp: (lambda a, y: y,),
    np.expm1: (lambda a, y: np.exp(a),),
    np.log: (lambda a, y: 1.0 / a,),
    np.log1p: (lambda a, y: 1.0 / (1.0 + a),),
    np.log2: (lambda a, y: 1.0 / (a * np.log(2.0)),),
    np.log10: (lambda a, y: 1.0 / (a * np.log(10.0)),),
    np.sin: (lambda a, y: np.cos(a),),
    np.cos: (lambda a, y: -np.sin(a),),
    np.tan: (lambda a, y: 1.0 + y * y,),
    np.arcsin: (lambda a, y: 1.0 / np.sqrt(1.0 - a * a),),
    np.arccos: (lambda a, y: -1.0 / np.sqrt(1.0 - a * a),),
    np.arctan: (lambda a, y: 1.0 / (1.0 + a * a),),
    np.sinh: (lambda a, y: np.cosh(a),),
    np.cosh: (lambda a, y: np.sinh(a),),
    np.tanh: (lambda a, y: 1.0 - y * y,),
    np.deg2rad: (lambda a, y: np.pi / 180.0,),
    np.rad2deg: (lambda a, y: 180.0 / np.pi,),
}

# Functions of the values, which are plain: constant but for jumps.
OF_VALUES = {
    *(np.less, np.less_equal, np.greater, np.greater_equal, np.equal, np.not_equal),
    *(np.logical_and, np.logical_or, np.logical_xor, np.logical_not),
    *(np.isfinite, np.isnan, np.isinf, np.signbit, np.sign),
    *(np.floor, np.ceil, np.trunc, np.rint, np.floor_divide),
}

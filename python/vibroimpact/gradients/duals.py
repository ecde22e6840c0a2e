"""Arrays of numbers that carry their derivatives: forward differentiation of NumPy expressions.

Every operation that has a derivative here takes such arrays in place of plain ones. What has none
is refused, so that no derivative gets lost without a word. Comparisons are those of the values.
Source: A. Griewank, A. Walther, *Evaluating Derivatives*, 2nd ed., SIAM, 2008, ch. 3.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any, NoReturn

import numpy as np
from numpy.lib.mixins import NDArrayOperatorsMixin
from numpy.typing import NDArray

Array = NDArray[np.float64]


class Dual(NDArrayOperatorsMixin):
    """An array of numbers with their derivatives by k things: shapes (...) and (..., k)."""

    __slots__ = ("slope", "value")

    def __init__(self, value: Any, slope: Array) -> None:
        self.value = np.asarray(value, dtype=np.float64)
        self.slope = slope

    # What arrays have.

    @property
    def shape(self) -> tuple[int, ...]:
        """The shape of the values."""
        return self.value.shape

    @property
    def ndim(self) -> int:
        """The number of axes of the values."""
        return self.value.ndim

    @property
    def size(self) -> int:
        """The number of values."""
        return self.value.size

    @property
    def T(self) -> Dual:
        """The transpose."""
        return linear(np.transpose, self)

    def __len__(self) -> int:
        """Return the number of rows."""
        return len(self.value)

    def __getitem__(self, key: Any) -> Dual:
        """Return some of the numbers, with their derivatives."""
        return linear(lambda array: array[key], self)

    def __iter__(self) -> Iterator[Dual]:
        """Give the rows."""
        return (self[k] for k in range(len(self)))

    def __bool__(self) -> bool:
        """Whether the value is not 0."""
        return bool(self.value)

    def __repr__(self) -> str:
        """Say the values and that there are derivatives."""
        return f"{self.value!r}, with derivatives"

    def sum(self, *args: Any, **options: Any) -> Any:
        """As numpy.sum."""
        return np.sum(self, *args, **options)

    def mean(self, *args: Any, **options: Any) -> Any:
        """As numpy.mean."""
        return np.mean(self, *args, **options)

    def max(self, axis: int | None = None) -> Any:
        """As numpy.max."""
        return _extreme(np.argmax)(self, axis)

    def min(self, axis: int | None = None) -> Any:
        """As numpy.min."""
        return _extreme(np.argmin)(self, axis)

    def std(self, axis: int | None = None) -> Any:
        """As numpy.std."""
        return np.sqrt(_variance(self, axis))

    def var(self, axis: int | None = None) -> Any:
        """As numpy.var."""
        return _variance(self, axis)

    def reshape(self, *shape: Any) -> Dual:
        """As numpy.reshape."""
        return linear(lambda array: array.reshape(*shape), self)

    def ravel(self) -> Dual:
        """As numpy.ravel."""
        return linear(np.ravel, self)

    # What would lose the derivatives.

    def __array__(self, *_: Any, **__: Any) -> NoReturn:
        """Refuse to be a plain array."""
        _lost("an array")

    def __float__(self) -> NoReturn:
        """Refuse to be a plain number."""
        _lost("a float")

    def __int__(self) -> NoReturn:
        """Refuse to be a whole number."""
        _lost("an int")

    __complex__ = __float__

    # How NumPy asks for operations.

    def __array_ufunc__(self, ufunc: Any, method: str, *inputs: Any, **options: Any) -> Any:
        """Return what an elementwise function of NumPy gives."""
        if method != "__call__" or options:
            raise TypeError(f"numpy.{ufunc.__name__}.{method} with {[*options]} has no derivative")
        if ufunc in OF_VALUES:
            return ufunc(*map(value_of, inputs))
        if ufunc is np.matmul:
            return _bilinear(np.matmul)(*inputs)
        if ufunc not in RULES:
            raise TypeError(f"numpy.{ufunc.__name__} has no derivative; those that have: {KNOWN}")
        values = [value_of(each) for each in inputs]
        with np.errstate(divide="ignore", invalid="ignore"):
            result = ufunc(*values)
            parts = []
            for each, rule in zip(inputs, RULES[ufunc], strict=True):
                if isinstance(each, Dual):
                    factor = np.asarray(rule(*values, result), dtype=np.float64)[..., None]
                    # A number that does not depend on anything has no part, whatever the factor.
                    parts.append(np.where(each.slope == 0.0, 0.0, factor * each.slope))
        slope = parts[0] if len(parts) == 1 else parts[0] + parts[1]
        return Dual(result, np.broadcast_to(slope, (*np.shape(result), slope.shape[-1])))

    def __array_function__(self, func: Any, types: Any, args: Any, kwargs: Any) -> Any:
        """Return what another function of NumPy gives."""
        if func in OF_SHAPES:
            return func(*map(value_of, args), **kwargs)
        if func not in FUNCTIONS:
            raise TypeError(f"numpy.{func.__name__} has no derivative; those that have: {KNOWN}")
        return FUNCTIONS[func](*args, **kwargs)


def _lost(what: str) -> NoReturn:
    raise TypeError(
        f"a number of a run that carries its derivatives cannot become {what}, which would lose "
        "them; use functions of NumPy on it"
    )


def value_of(number: Any) -> Any:
    """Return the values of what may be a Dual."""
    return number.value if isinstance(number, Dual) else number


def constant(value: Any, count: int) -> Dual:
    """Return numbers that do not depend on any of ``count`` things."""
    array = np.asarray(value, dtype=np.float64)
    return Dual(array, np.zeros((*array.shape, count)))


def linear(function: Callable[..., Any], *args: Any, **options: Any) -> Dual:
    """Return a function that is linear in all of its Duals, which may lie in a list.

    Plain numbers beside them may add a constant, as those that are appended: its derivative is 0.
    """
    count = next(each.slope.shape[-1] for each in _duals(args))

    def at(pick: Callable[[Dual], Array]) -> Any:
        return function(*(_part(each, pick) for each in args), **options)

    def column(k: int) -> Any:
        return at(lambda dual: dual.slope[..., k])

    value, added = at(lambda dual: dual.value), at(lambda dual: np.zeros(dual.shape))
    columns = [column(k) for k in range(count)]
    if np.any(added):
        finite = np.isfinite(added)
        columns = [np.where(finite, each - np.where(finite, added, 0.0), 0.0) for each in columns]
    return Dual(value, np.stack(columns, axis=-1) if columns else np.zeros((*np.shape(value), 0)))


def _duals(args: Any) -> Iterator[Dual]:
    for each in args:
        if isinstance(each, Dual):
            yield each
        elif isinstance(each, list | tuple):
            yield from _duals(each)


def _part(given: Any, pick: Callable[[Dual], Array]) -> Any:
    """Return what is picked of Duals, and plain numbers as they are."""
    if isinstance(given, Dual):
        return pick(given)
    if isinstance(given, list | tuple) and any(True for _ in _duals(given)):
        return [_part(each, pick) for each in given]
    return given


def _as_linear(function: Callable[..., Any]) -> Callable[..., Any]:
    def call(*args: Any, **options: Any) -> Any:
        if any(True for _ in _duals(options.values())):
            raise TypeError(f"numpy.{function.__name__}: give what carries derivatives first")
        return linear(function, *args, **options)

    return call


def _bilinear(function: Callable[..., Any]) -> Callable[..., Any]:
    def call(a: Any, b: Any) -> Any:
        parts = []
        if isinstance(a, Dual):
            parts.append(linear(lambda x: function(x, value_of(b)), a))
        if isinstance(b, Dual):
            parts.append(linear(lambda x: function(value_of(a), x), b))
        slope = parts[0].slope if len(parts) == 1 else parts[0].slope + parts[1].slope
        return Dual(parts[0].value, slope)

    return call


def _extreme(place: Callable[..., Any]) -> Callable[..., Any]:
    def call(array: Any, axis: int | None = None) -> Any:
        if axis is None:
            return array.ravel()[int(place(array.value))]
        at = np.expand_dims(place(array.value, axis), axis)
        return linear(lambda x: np.take_along_axis(x, at, axis).squeeze(axis), array)

    return call


def _variance(array: Any, axis: int | None = None) -> Any:
    middle = array.mean() if axis is None else np.expand_dims(array.mean(axis), axis)
    return np.mean((array - middle) ** 2, axis=axis)


def _where(condition: Any, *choices: Any) -> Any:
    chosen = value_of(condition)
    if not choices:
        return np.where(chosen)
    first, second = np.broadcast_arrays(*map(value_of, choices))
    if not any(isinstance(each, Dual) for each in choices):
        return np.where(chosen, first, second)
    count = next(_duals(choices)).slope.shape[-1]
    full = [
        each if isinstance(each, Dual) else constant(value, count)
        for each, value in zip(choices, (first, second), strict=True)
    ]
    return linear(lambda a, b: np.where(chosen, a, b), *full)


def _median(array: Any, axis: int | None = None) -> Any:
    if axis is None:
        array, axis = array.ravel(), 0
    order = np.argsort(array.value, axis)
    many = array.shape[axis]
    middle = [(many - 1) // 2, many // 2]

    def call(x: Array) -> Any:
        return np.take(np.take_along_axis(x, order, axis), middle, axis).mean(axis)

    return linear(call, array)


def _sort(array: Any, axis: int = -1) -> Any:
    order = np.argsort(array.value, axis)
    return linear(lambda x: np.take_along_axis(x, order, axis), array)


def _norm(array: Any, ord: float | None = None, axis: int | None = None) -> Any:
    if not (ord is None or (ord == 2 and (axis is not None or array.ndim == 1))):
        raise TypeError(
            f"numpy.linalg.norm with ord = {ord!r} has no derivative here; allowed: the root of "
            "the sum of squares, ord = None, or 2 along one axis"
        )
    return np.sqrt(np.sum(array**2, axis=axis))


def _clip(array: Any, least: Any, most: Any) -> Any:
    return np.minimum(np.maximum(array, least), most)


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
    *(np.isfinite, np.isnan, np.isinf, np.signbit, np.sign),
}
OF_SHAPES = {np.shape, np.size, np.ndim, np.argmax, np.argmin, np.argsort, np.nonzero}

_LINEAR = (
    *(np.sum, np.mean, np.diff, np.cumsum, np.reshape, np.transpose, np.ravel, np.squeeze),
    *(np.expand_dims, np.concatenate, np.stack, np.vstack, np.hstack, np.column_stack, np.take),
    *(np.broadcast_to, np.flip, np.trace, np.append),
)
FUNCTIONS: dict[Any, Callable[..., Any]] = {
    **{function: _as_linear(function) for function in _LINEAR},
    **{function: _bilinear(function) for function in (np.dot, np.inner, np.outer)},
    np.max: _extreme(np.argmax),
    np.min: _extreme(np.argmin),
    np.std: lambda array, axis=None: array.std(axis),
    np.var: _variance,
    np.median: _median,
    np.sort: _sort,
    np.where: _where,
    np.clip: _clip,
    np.linalg.norm: _norm,
}
KNOWN = ", ".join(
    sorted({*(each.__name__ for each in RULES), *(each.__name__ for each in FUNCTIONS)})
)

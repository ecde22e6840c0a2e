"""Arrays of numbers that carry their derivatives: forward differentiation of NumPy expressions.

Every operation that has a derivative here takes such arrays in place of plain ones. What has none
is refused, so that no derivative gets lost without a word. Comparisons are those of the values.
Source: A. Griewank, A. Walther, *Evaluating Derivatives*, 2nd ed., SIAM, 2008, ch. 3.
"""

from __future__ import annotations

import inspect
import math
from collections.abc import Callable, Iterator
from typing import Any, NoReturn

import numpy as np
from numpy.lib.array_utils import normalize_axis_tuple
from numpy.lib.mixins import NDArrayOperatorsMixin
from numpy.typing import NDArray

from .elementwise import OF_VALUES, RULES

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
    def dtype(self) -> np.dtype[np.float64]:
        """The type of the values."""
        return self.value.dtype

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

    def __format__(self, spec: str) -> str:
        """Write the value, as a number."""
        return format(self.value[()], spec)

    def __getattr__(self, name: str) -> Any:
        """Return a method that is a function of NumPy, as ``sum``."""
        function = METHODS.get(name)
        if function is None:
            known = ", ".join(sorted(METHODS))
            raise AttributeError(
                f"{name} is not there for numbers that carry their derivatives; allowed: {known}"
            )

        def method(*args: Any, **options: Any) -> Any:
            return function(self, *args, **options)

        return method

    def reshape(self, *shape: Any) -> Dual:
        """As the method of arrays, which takes the lengths one by one, too."""
        return linear(lambda array: array.reshape(*shape), self)

    def transpose(self, *axes: Any) -> Dual:
        """As the method of arrays, which takes the axes one by one, too."""
        return linear(lambda array: array.transpose(*axes), self)

    # Numbers do not change, so that others which were taken from them do not, either: ``x += 1``
    # gives x to a new array.
    __iadd__ = NDArrayOperatorsMixin.__add__
    __isub__ = NDArrayOperatorsMixin.__sub__
    __imul__ = NDArrayOperatorsMixin.__mul__
    __itruediv__ = NDArrayOperatorsMixin.__truediv__
    __ipow__ = NDArrayOperatorsMixin.__pow__
    __imod__ = NDArrayOperatorsMixin.__mod__
    __imatmul__ = NDArrayOperatorsMixin.__matmul__

    def __setitem__(self, key: Any, _: Any) -> NoReturn:
        """Refuse to change."""
        raise TypeError(
            f"numbers of a run that carry their derivatives do not change: [{key!r}] = ...; "
            "numpy.where and numpy.concatenate make new ones"
        )

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

    def __round__(self, _: int | None = None) -> NoReturn:
        """Refuse to be rounded."""
        _lost("a rounded number")

    __complex__ = __float__

    # How NumPy asks for operations.

    def __array_ufunc__(self, ufunc: Any, method: str, *inputs: Any, **options: Any) -> Any:
        """Return what an elementwise function of NumPy gives."""
        if method == "reduce" and ufunc in REDUCTIONS:
            return REDUCTIONS[ufunc](*inputs, **{"axis": 0} | options)
        if method != "__call__" or options:
            used = [*([] if method == "__call__" else [method]), *(f"{each}=" for each in options)]
            raise TypeError(f"numpy.{ufunc.__name__} with {', '.join(used)} has no derivative here")
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
        if kwargs.get("out") is not None:
            _lost_in(func)
        rule = FUNCTIONS[func]
        signature = inspect.signature(rule)
        try:
            signature.bind(*args, **kwargs)
        except TypeError as error:
            allowed = ", ".join(signature.parameters)
            raise TypeError(
                f"numpy.{func.__name__} with derivatives: {error}; allowed: {allowed}"
            ) from None
        return rule(*args, **kwargs)


def _lost(what: str) -> NoReturn:
    raise TypeError(
        f"a number of a run that carries its derivatives cannot become {what}, which would lose "
        "them; use functions of NumPy on it, and numpy.stack to put several into an array"
    )


def _lost_in(function: Callable[..., Any]) -> NoReturn:
    raise TypeError(f"numpy.{function.__name__} with out would lose the derivatives")


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
        found = function(*(_part(each, pick) for each in args), **options)
        if any(found is each for each in args):
            _lost_in(function)
        return found

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
    def call(a: Any, b: Any, *args: Any, **options: Any) -> Any:
        if any(isinstance(each, np.ndarray) for each in args):
            _lost_in(function)
        parts = []
        if isinstance(a, Dual):
            parts.append(linear(lambda x: function(x, value_of(b), *args, **options), a))
        if isinstance(b, Dual):
            parts.append(linear(lambda x: function(value_of(a), x, *args, **options), b))
        slope = parts[0].slope if len(parts) == 1 else parts[0].slope + parts[1].slope
        return Dual(parts[0].value, slope)

    return call


def _in_rows(array: Any, axis: Any) -> tuple[Dual, tuple[int, ...]]:
    """Return numbers with these axes as the last one, and their shape with axes of length 1."""
    axes = normalize_axis_tuple(range(array.ndim) if axis is None else axis, array.ndim)
    others = [place for place in range(array.ndim) if place not in axes]
    kept = tuple(1 if place in axes else array.shape[place] for place in range(array.ndim))
    shape = [*(array.shape[place] for place in others), math.prod(array.shape[k] for k in axes)]
    return linear(lambda x: x.transpose([*others, *axes]).reshape(shape), array), kept


def _extreme(place: Callable[..., Any]) -> Callable[..., Any]:
    def call(a: Any, axis: Any = None, *, keepdims: bool = False) -> Any:
        rows, kept = _in_rows(a, axis)
        at = np.expand_dims(place(rows.value, -1), -1)
        found = linear(lambda x: np.take_along_axis(x, at, -1).squeeze(-1), rows)
        return found.reshape(kept) if keepdims else found

    return call


def _average(a: Any, axis: Any = None, weights: Any = None, *, keepdims: bool = False) -> Any:
    if weights is None:
        return np.mean(a, axis=axis, keepdims=keepdims)
    shape = np.shape(value_of(a))
    if np.shape(value_of(weights)) != shape:  # one for each row along an axis
        (along,) = normalize_axis_tuple(axis, len(shape))
        weights = np.reshape(weights, [-1 if k == along else 1 for k in range(len(shape))])
    weighted = np.sum(a * weights, axis=axis, keepdims=keepdims)
    return weighted / np.sum(np.broadcast_to(weights, shape), axis=axis, keepdims=keepdims)


def _peak_to_peak(a: Any, axis: Any = None, *, keepdims: bool = False) -> Any:
    return np.max(a, axis=axis, keepdims=keepdims) - np.min(a, axis=axis, keepdims=keepdims)


def _product(a: Any, axis: Any = None, *, keepdims: bool = False) -> Any:
    rows, kept = _in_rows(a, axis)
    one = np.ones((*rows.shape[:-1], 1))
    before = np.cumprod(np.concatenate([one, rows.value], axis=-1), axis=-1)[..., :-1]
    after = np.cumprod(np.concatenate([one, rows.value[..., ::-1]], axis=-1), axis=-1)[..., -2::-1]
    slope = ((before * after)[..., None] * rows.slope).sum(axis=-2)
    found = Dual(np.prod(rows.value, axis=-1), slope)
    return found.reshape(kept) if keepdims else found


def _variance(a: Any, axis: Any = None, *, ddof: float = 0, keepdims: bool = False) -> Any:
    rows, kept = _in_rows(a, axis)
    squares = (rows - np.mean(rows, axis=-1, keepdims=True)) ** 2
    found = np.sum(squares, axis=-1) / (rows.shape[-1] - ddof)
    return found.reshape(kept) if keepdims else found


def _deviation(a: Any, axis: Any = None, *, ddof: float = 0, keepdims: bool = False) -> Any:
    return np.sqrt(_variance(a, axis, ddof=ddof, keepdims=keepdims))


def _quantile(a: Any, q: Any, axis: Any = None, *, keepdims: bool = False) -> Any:
    if isinstance(q, Dual):
        raise TypeError("numpy.quantile has no derivative by q")
    rows, kept = _in_rows(a, axis)
    place = np.asarray(q, dtype=np.float64) * (rows.shape[-1] - 1)
    low = np.clip(np.floor(place).astype(np.int64), 0, max(rows.shape[-1] - 2, 0))
    high = np.minimum(low + 1, rows.shape[-1] - 1)
    ordered: Any = np.sort(rows)
    found = ordered[..., low] + (place - low) * (ordered[..., high] - ordered[..., low])
    # The axes of q come first.
    shape = (*place.shape, *(kept if keepdims else rows.shape[:-1]))
    last = [*range(rows.ndim - 1, found.ndim), *range(rows.ndim - 1)]
    return np.transpose(found, last).reshape(shape)


def _percentile(a: Any, q: Any, axis: Any = None, *, keepdims: bool = False) -> Any:
    return _quantile(
        a, q if isinstance(q, Dual) else np.asarray(q) / 100.0, axis, keepdims=keepdims
    )


def _median(a: Any, axis: Any = None, *, keepdims: bool = False) -> Any:
    return _quantile(a, 0.5, axis, keepdims=keepdims)


def _sort(a: Any, axis: int | None = -1, *, kind: Any = None, stable: bool | None = None) -> Any:
    if axis is None:
        a, axis = a.ravel(), -1
    order = np.argsort(a.value, axis, kind=kind, stable=stable)
    return linear(lambda x: np.take_along_axis(x, order, axis), a)


def _norm(x: Any, ord: float | None = None, axis: Any = None, *, keepdims: bool = False) -> Any:
    of_a_row = x.ndim == 1 if axis is None else np.ndim(axis) == 0
    if not (ord is None or (ord == 2 and of_a_row)):
        raise TypeError(
            f"numpy.linalg.norm with ord = {ord!r} has no derivative here; allowed: the root of "
            "the sum of squares, ord = None, or 2 along one axis"
        )
    return np.sqrt(np.sum(x**2, axis=axis, keepdims=keepdims))


def _clip(a: Any, a_min: Any = None, a_max: Any = None, *, min: Any = None, max: Any = None) -> Any:
    least, most = (a_min if min is None else min), (a_max if max is None else max)
    found = a if least is None else np.maximum(a, least)
    return found if most is None else np.minimum(found, most)


def _trapezoid(y: Any, x: Any = None, dx: Any = 1.0, axis: int = -1) -> Any:
    rows = np.moveaxis(y, axis, -1)
    widths = dx
    if x is not None:
        widths = np.diff(x) if np.ndim(value_of(x)) == 1 else np.diff(np.moveaxis(x, axis, -1))
    return np.sum(widths * (rows[..., 1:] + rows[..., :-1]) / 2.0, axis=-1)


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


# Functions of the values or of their places alone, which are plain.
OF_SHAPES = {
    *(np.shape, np.size, np.ndim, np.argmax, np.argmin, np.argsort, np.nonzero, np.flatnonzero),
    *(np.any, np.all, np.count_nonzero, np.isclose, np.allclose, np.array_equal, np.searchsorted),
    *(np.zeros_like, np.ones_like),
}

_LINEAR = (
    *(np.sum, np.mean, np.diff, np.cumsum, np.reshape, np.transpose, np.ravel, np.squeeze),
    *(np.expand_dims, np.concatenate, np.stack, np.vstack, np.hstack, np.column_stack, np.take),
    *(np.broadcast_to, np.flip, np.trace, np.append, np.copy, np.repeat, np.roll, np.tile),
    *(np.atleast_1d, np.atleast_2d, np.swapaxes, np.moveaxis, np.diagonal, np.delete),
    np.insert,
)
_BILINEAR = (np.dot, np.inner, np.outer, np.vdot, np.kron, np.convolve, np.cross, np.tensordot)
FUNCTIONS: dict[Any, Callable[..., Any]] = {
    **{function: _as_linear(function) for function in _LINEAR},
    **{function: _bilinear(function) for function in _BILINEAR},
    np.average: _average,
    np.max: _extreme(np.argmax),
    np.min: _extreme(np.argmin),
    np.ptp: _peak_to_peak,
    np.prod: _product,
    np.std: _deviation,
    np.var: _variance,
    np.quantile: _quantile,
    np.percentile: _percentile,
    np.median: _median,
    np.sort: _sort,
    np.where: _where,
    np.clip: _clip,
    np.linalg.norm: _norm,
    np.trapezoid: _trapezoid,
}
KNOWN = ", ".join(
    sorted({*(each.__name__ for each in RULES), *(each.__name__ for each in FUNCTIONS)})
)
REDUCTIONS: dict[Any, Callable[..., Any]] = {
    np.add: np.sum,
    np.multiply: np.prod,
    np.maximum: np.max,
    np.minimum: np.min,
}
# Methods of arrays, but for those that sort them in place.
METHODS: dict[str, Callable[..., Any]] = {
    function.__name__: function
    for function in [*FUNCTIONS, *OF_SHAPES]
    if callable(getattr(np.ndarray, function.__name__, None)) and function is not np.sort
} | {"flatten": np.ravel}

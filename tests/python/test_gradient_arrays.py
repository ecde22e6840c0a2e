"""Functions and methods of NumPy on numbers that carry their derivatives: against differences."""

import math

import numpy as np
import pytest

from vibroimpact.gradients.duals import FUNCTIONS, METHODS, Dual
from vibroimpact.gradients.elementwise import RULES

DATA = np.array([[0.3, 0.7, 0.2], [0.5, 0.9, 0.4]])
MOVED = np.array([[1.0, -2.0, 0.5], [0.3, 0.8, -0.7]])


def slope_of(function) -> np.ndarray:
    """The derivative of a function of an array along MOVED, by Dual."""
    found = function(Dual(DATA, MOVED[..., None]))
    return found.slope[..., 0]


def difference_of(function) -> np.ndarray:
    """The same by differences."""
    ends = [np.asarray(function(DATA + sign * 1e-6 * MOVED)) for sign in (-1.0, 1.0)]
    return (ends[1] - ends[0]) / 2e-6


@pytest.mark.parametrize("ufunc", RULES, ids=lambda each: each.__name__)
def test_elementwise_functions(ufunc):
    if ufunc.nin == 1:
        cases = [ufunc]
    else:
        cases = [
            lambda x: ufunc(x, 0.47),
            lambda x: ufunc(0.47, x),
            lambda x: ufunc(x, x[:, ::-1] + 1.2 * x[1]),
            lambda x: ufunc(np.array([0.65, 0.1, 0.87]), x),
        ]
    for case in cases:
        assert slope_of(case) == pytest.approx(difference_of(case), rel=1e-6, abs=1e-9)


OTHERS = {
    np.sum: [lambda x: np.sum(x), lambda x: np.sum(x, axis=0)],
    np.mean: [lambda x: np.mean(x, axis=1), lambda x: x.mean()],
    np.diff: [np.diff],
    np.cumsum: [lambda x: np.cumsum(x, axis=1)],
    np.reshape: [
        lambda x: np.reshape(x, (3, 2)),
        lambda x: x.reshape(6),
        lambda x: x.reshape(3, 2),
    ],
    np.transpose: [lambda x: np.transpose(x) + x.T],
    np.ravel: [lambda x: np.ravel(x) * x.ravel()],
    np.squeeze: [lambda x: np.squeeze(x[None])],
    np.expand_dims: [lambda x: np.expand_dims(x, 0)],
    np.concatenate: [lambda x: np.concatenate([x, DATA, 2.0 * x])],
    np.stack: [lambda x: np.stack([x, x], axis=1)],
    np.vstack: [lambda x: np.vstack([x, x])],
    np.hstack: [lambda x: np.hstack([x, x])],
    np.column_stack: [lambda x: np.column_stack([x, x])],
    np.take: [lambda x: np.take(x, [1, 0], axis=0)],
    np.broadcast_to: [lambda x: np.broadcast_to(x, (2, 2, 3))],
    np.flip: [np.flip],
    np.trace: [lambda x: np.trace(x[:, :2])],
    np.append: [lambda x: np.append(x, x)],
    np.dot: [lambda x: np.dot(x, x.T), lambda x: np.dot(DATA.T, x), lambda x: x @ DATA.T],
    np.inner: [lambda x: np.inner(x[0], x[1])],
    np.outer: [lambda x: np.outer(x[0], x[1])],
    np.copy: [lambda x: np.copy(x) - 2.0 * x.copy()],
    np.repeat: [lambda x: np.repeat(x, 2, axis=0)],
    np.roll: [lambda x: np.roll(x, 1, axis=1)],
    np.tile: [lambda x: np.tile(x, (2, 1))],
    np.atleast_1d: [lambda x: np.atleast_1d(x[0, 0])],
    np.atleast_2d: [lambda x: np.atleast_2d(x[0])],
    np.swapaxes: [lambda x: x.swapaxes(0, 1)],
    np.moveaxis: [lambda x: np.moveaxis(x, 0, 1)],
    np.diagonal: [lambda x: x.diagonal()],
    np.delete: [lambda x: np.delete(x, 1, axis=1)],
    np.insert: [lambda x: np.insert(x, 1, [0.5, 0.25], axis=1)],
    np.average: [
        lambda x: np.average(x, axis=1, weights=[1.0, 2.0, 3.0]),
        lambda x: np.average(x, axis=0, keepdims=True),
        lambda x: np.average(x, weights=1.0 + x**2),
        lambda x: np.average(DATA, axis=-1, weights=x, keepdims=True),
        lambda x: np.average(x, axis=0, weights=x[:, 0]),
    ],
    np.vdot: [lambda x: np.vdot(x, 2.0 * x)],
    np.kron: [lambda x: np.kron(x, x[0])],
    np.convolve: [lambda x: np.convolve(x[0], [0.5, 0.25], "same") * np.convolve(x[0], x[1])[1]],
    np.cross: [lambda x: np.cross(x[0], x[1])],
    np.tensordot: [lambda x: np.tensordot(x, x, axes=([0], [0]))],
    np.max: [
        *(lambda x: np.max(x), lambda x: np.max(x, axis=0), lambda x: x.max()),
        *(lambda x: x.max(axis=(0, 1)), lambda x: x.max(1, keepdims=True)),
        lambda x: np.maximum.reduce(x, axis=1),
    ],
    np.min: [
        *(lambda x: np.min(x), lambda x: np.min(x, axis=1), lambda x: x.min(0)),
        *(lambda x: x.min(keepdims=True), np.minimum.reduce),
    ],
    np.ptp: [np.ptp, lambda x: np.ptp(x, axis=1, keepdims=True)],
    np.prod: [
        *(np.prod, lambda x: np.prod(x, axis=(0,)), lambda x: x.prod(-1, keepdims=True)),
        *(np.multiply.reduce, lambda x: np.prod(x * [1.0, 0.0, 2.0], axis=1)),
        lambda x: np.prod(x - [0.3, 0.1, 0.0], axis=1),  # one of the factors is 0
    ],
    np.std: [
        *(np.std, lambda x: np.std(x, axis=0), lambda x: x.std()),
        *(lambda x: x.std(ddof=1), lambda x: np.std(x, axis=(1, 0), ddof=1, keepdims=True)),
    ],
    np.var: [np.var, lambda x: np.var(x, axis=1), lambda x: x.var(0, ddof=1, keepdims=True)],
    np.quantile: [
        *(lambda x: np.quantile(x, 0.3), lambda x: np.quantile(x, [0.0, 0.4, 1.0], axis=1)),
        lambda x: np.quantile(x, [[0.2, 0.7]], axis=0, keepdims=True),
        lambda x: np.quantile(x[:1], 0.7, axis=0),
    ],
    np.percentile: [lambda x: np.percentile(x, 95, axis=1)],
    np.median: [
        *(np.median, lambda x: np.median(x, axis=0), lambda x: np.median(x, axis=1)),
        lambda x: np.median(x, axis=(0, 1), keepdims=True),
    ],
    np.sort: [np.sort, lambda x: np.sort(x, axis=None, kind="stable")],
    np.where: [lambda x: np.where(x > 0.45, x**2, 1.0)],
    np.clip: [
        *(lambda x: np.clip(x, 0.25, 0.6), lambda x: np.clip(x, 0.35, None)),
        *(lambda x: x.clip(max=0.45), lambda x: np.clip(0.6, x, 0.8)),
    ],
    np.linalg.norm: [
        *(np.linalg.norm, lambda x: np.linalg.norm(x, axis=1)),
        lambda x: np.linalg.norm(x, 2, axis=0, keepdims=True),
    ],
    np.trapezoid: [
        *(np.trapezoid, lambda x: np.trapezoid(x, x**2), lambda x: np.trapezoid(x, dx=2.0, axis=0)),
        *(lambda x: np.trapezoid(x, [0.0, 0.5, 2.0]), lambda x: np.trapezoid([1.0, 2.0, 4.0], x)),
    ],
}
METHODS_THAT_NEED_MORE = {
    "clip": (0.25, 0.6),
    "dot": (DATA.T,),
    "repeat": (2,),
    "reshape": ((3, 2),),
    "searchsorted": (0.4,),
    "swapaxes": (0, 1),
    "take": ([1, 0], 0),
}


@pytest.mark.parametrize("name", sorted(METHODS))
def test_methods_are_those_of_arrays(name):
    def call(x):
        return getattr(x, name)(*METHODS_THAT_NEED_MORE.get(name, ()))

    def of(data):
        return data[0] if name == "searchsorted" else data

    found, plain = call(of(Dual(DATA, MOVED[..., None]))), call(of(DATA))
    if isinstance(found, Dual):
        assert found.value == pytest.approx(plain)
        assert found.slope[..., 0] == pytest.approx(difference_of(call), rel=1e-6, abs=1e-9)
    else:
        assert np.array_equal(found, plain)


def test_numbers_do_not_change_in_place():
    x = Dual(DATA, MOVED[..., None])
    y = x
    y -= x[0]
    y *= 2.0
    assert np.array_equal(x.value, DATA)
    assert np.array_equal(y.value, 2.0 * (DATA - DATA[0]))
    assert np.array_equal(y.slope[..., 0], 2.0 * (MOVED - MOVED[0]))
    with pytest.raises(TypeError, match=r"do not change: \[0\] = "):
        x[0] = 1.0


def test_functions_of_the_values_are_plain():
    x = Dual(DATA, MOVED[..., None])
    assert np.array_equal(np.floor(4.0 * x), np.floor(4.0 * DATA))
    assert np.any(x > 0.8)
    assert not np.all(x > 0.8)
    assert (x > 0.45).sum() == np.count_nonzero(x > 0.45) == 3
    assert np.allclose(x, DATA)
    assert np.array_equal(np.ones_like(x), np.ones_like(DATA))
    assert x.dtype == DATA.dtype


@pytest.mark.parametrize("function", FUNCTIONS, ids=lambda each: each.__name__)
def test_other_functions(function):
    for case in OTHERS[function]:
        plain = case(DATA)
        assert case(Dual(DATA, MOVED[..., None])).value == pytest.approx(plain)
        assert slope_of(case) == pytest.approx(difference_of(case), rel=1e-6, abs=1e-9)


def test_comparisons_are_those_of_the_values():
    x = Dual(DATA, MOVED[..., None])
    assert np.array_equal(x > 0.45, DATA > 0.45)
    assert np.array_equal(x[x > 0.45].value, DATA[DATA > 0.45])
    assert max(x[0]).value == 0.7
    assert [len(row) for row in x] == [3, 3]
    assert "derivatives" in repr(x)
    assert f"{x[0, 1]:.2f}" == "0.70"


@pytest.mark.parametrize(
    "use",
    [
        lambda x: float(x[0, 0]),
        lambda x: int(x[0, 0]),
        lambda x: round(x[0, 0]),
        lambda x: round(x[0, 0], 2),
        lambda x: math.sin(x[0, 0]),
        lambda x: np.array(x),
        lambda x: np.fft.fft(x),
        lambda x: np.interp(0.5, x[0], x[1]),
        lambda x: np.frexp(x),
        lambda x: np.add.accumulate(x),
        lambda x: np.add(x, 1.0, out=np.zeros((2, 3))),
        lambda x: np.sum(x, out=np.zeros(())),
        lambda x: np.sum(x, 0, None, np.zeros(3)),
        lambda x: np.add.reduce(x, out=np.zeros(3)),
        lambda x: np.dot(x, x.T, out=np.zeros((2, 2))),
        lambda x: np.dot(x, DATA.T, np.zeros((2, 2))),
        lambda x: np.quantile(DATA, x[0, 0]),
        lambda x: np.max(x, where=DATA > 0.5),
        lambda x: x.tolist(),
        lambda x: x.std(dtype=np.float64),
    ],
)
def test_what_would_lose_derivatives_is_refused(use):
    told = r"lose|has no derivative|with derivatives: |carry their derivatives"
    with pytest.raises((TypeError, AttributeError), match=told):
        use(Dual(DATA, MOVED[..., None]))


@pytest.mark.parametrize(
    "function",
    [
        lambda x: np.append(x, 5.0),
        lambda x: np.append([5.0], x),
        lambda x: np.diff(x, prepend=7.0),
        lambda x: np.diff(x, append=7.0),
        lambda x: np.sum(x, initial=3.0),
        lambda x: np.concatenate([x, [5.0, np.inf]]),
        lambda x: np.stack([x[0], 5.0]),
    ],
)
def test_constants_beside_numbers_have_no_derivative(function):
    value, slope = np.array([1.0, 2.0, 4.0]), np.array([[1.0, 0.0], [0.0, 2.0], [1.0, 1.0]])
    found, h = function(Dual(value, slope)), 0.25
    for k in range(2):
        ahead, behind = (function(value + sign * h * slope[:, k]) for sign in (1, -1))
        finite = np.isfinite(ahead)
        change = np.where(finite, ahead, 0.0) - np.where(finite, behind, 0.0)
        assert found.slope[..., k] == pytest.approx(change / (2 * h), abs=1e-14)

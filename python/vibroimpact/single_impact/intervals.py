"""Interval arithmetic on arrays, and the roots of functions isolated with a proof.

An `Interval` [lo, hi] holds arrays; every operation encloses all results of its operands' numbers.
The four operations and the square root are rounded to nearest and then moved outwards by one float
(``np.nextafter``). sin, cos and expm1 are the core's own, with the same bits on every machine,
moved by the bound of their errors, which is proven operation by operation
(src/numerics/interval.rs, tests/python/test_elementary.py). Products that underflow are not
covered: numbers here are of order one.

`isolate` finds all roots of many functions at once by bisection: a box is dropped where an
enclosure of the function excludes zero, and kept as *isolated* where one of the slope does and the
signs at its ends differ, so that it holds exactly one root (R. E. Moore, R. B. Kearfott,
M. J. Cloud, Introduction to Interval Analysis, SIAM 2009, chapters 6 and 8).
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .. import _core

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

EPS = float(np.finfo(float).eps)
# Bisection halves a box to the spacing of the numbers at most; more levels than floats have bits
# for cannot be needed. With fewer than 52, close roots would not be told apart.
_MAX_LEVELS = 80
# Largest number of boxes of one function at a time; with more they are left undecided.
_MAX_BOXES = 20_000


def _down(x: Array) -> Array:
    return np.nextafter(x, -np.inf)


def _up(x: Array) -> Array:
    return np.nextafter(x, np.inf)


class Interval:
    """Closed intervals [lo, hi], arrays of one shape."""

    __slots__ = ("hi", "lo")
    # NumPy must leave `array * interval` to the methods below.
    __array_ufunc__ = None

    def __init__(self, lo: ArrayLike, hi: ArrayLike | None = None) -> None:
        self.lo = np.asarray(lo, dtype=np.float64)
        self.hi = self.lo if hi is None else np.asarray(hi, dtype=np.float64)

    @classmethod
    def of(cls, value: "Interval | ArrayLike") -> "Interval":
        """Return an interval as it is, numbers as intervals of width zero."""
        return value if isinstance(value, Interval) else cls(value)

    def __getitem__(self, index: Any) -> "Interval":
        """Return the elements at ``index``."""
        return Interval(self.lo[index], self.hi[index])

    def __neg__(self) -> "Interval":
        """Return -x, exactly."""
        return Interval(-self.hi, -self.lo)

    def __add__(self, other: "Interval | ArrayLike") -> "Interval":
        """Return x + y."""
        y = Interval.of(other)
        return Interval(_down(self.lo + y.lo), _up(self.hi + y.hi))

    __radd__ = __add__

    def __sub__(self, other: "Interval | ArrayLike") -> "Interval":
        """Return x - y."""
        y = Interval.of(other)
        return Interval(_down(self.lo - y.hi), _up(self.hi - y.lo))

    def __rsub__(self, other: ArrayLike) -> "Interval":
        """Return y - x."""
        return Interval(other) - self

    def __mul__(self, other: "Interval | ArrayLike") -> "Interval":
        """Return x y."""
        y = Interval.of(other)
        a, b, c, d = self.lo * y.lo, self.lo * y.hi, self.hi * y.lo, self.hi * y.hi
        lowest = np.minimum(np.minimum(a, b), np.minimum(c, d))
        highest = np.maximum(np.maximum(a, b), np.maximum(c, d))
        return Interval(_down(lowest), _up(highest))

    __rmul__ = __mul__

    def __truediv__(self, other: "Interval | ArrayLike") -> "Interval":
        """Return x / y; the whole line where y contains zero."""
        y = Interval.of(other)
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            a, b, c, d = self.lo / y.lo, self.lo / y.hi, self.hi / y.lo, self.hi / y.hi
        lowest = _down(np.minimum(np.minimum(a, b), np.minimum(c, d)))
        highest = _up(np.maximum(np.maximum(a, b), np.maximum(c, d)))
        zero = y.holds_zero
        return Interval(np.where(zero, -np.inf, lowest), np.where(zero, np.inf, highest))

    def __rtruediv__(self, other: ArrayLike) -> "Interval":
        """Return y / x."""
        return Interval(other) / self

    @property
    def holds_zero(self) -> Mask:
        """Where 0 lies in the interval; also where it is NaN."""
        return ~((self.lo > 0.0) | (self.hi < 0.0))

    @property
    def sign(self) -> NDArray[np.int64]:
        """1 or -1 where all numbers have that sign, 0 elsewhere."""
        return (self.lo > 0.0).astype(np.int64) - (self.hi < 0.0)

    @property
    def largest(self) -> Array:
        """Largest absolute value."""
        return np.maximum(np.abs(self.lo), np.abs(self.hi))

    @property
    def smallest(self) -> Array:
        """Smallest absolute value."""
        return np.where(self.holds_zero, 0.0, np.minimum(np.abs(self.lo), np.abs(self.hi)))

    @property
    def middle(self) -> Array:
        """A number of the interval near its middle; NaN for the whole line."""
        with np.errstate(invalid="ignore"):
            return np.clip(0.5 * (self.lo + self.hi), self.lo, self.hi)

    @property
    def width(self) -> Array:
        """Width, rounded up."""
        return _up(self.hi - self.lo)

    def meet(self, other: "Interval") -> "Interval":
        """Return the common part; lo > hi where there is none."""
        return Interval(np.maximum(self.lo, other.lo), np.minimum(self.hi, other.hi))

    def square(self) -> "Interval":
        """Return x^2, which is never negative."""
        least, most = self.smallest, self.largest
        return Interval(np.maximum(_down(least * least), 0.0), _up(most * most))

    def sqrt(self) -> "Interval":
        """Return the square root of the part that is not negative."""
        roots = np.sqrt(np.maximum(self.lo, 0.0)), np.sqrt(np.maximum(self.hi, 0.0))
        return Interval(np.maximum(_down(roots[0]), 0.0), _up(roots[1]))

    def expm1(self) -> "Interval":
        """Return e^x - 1."""
        return Interval(_expm1(self.lo).lo, _expm1(self.hi).hi)

    def exp(self) -> "Interval":
        """Return e^x."""
        # A 32nd of x, so that 1 + (e^x - 1) keeps its digits.
        power = 1.0 + (self * 0.03125).expm1()
        for _ in range(5):
            power = power.square()
        return power

    def sin(self) -> "Interval":
        """Return sin x."""
        return self._waves()[0]

    def cos(self) -> "Interval":
        """Return cos x."""
        return self._waves()[1]

    def _waves(self) -> tuple["Interval", "Interval"]:
        """Return sine and cosine."""
        shape = self.lo.shape
        sin, cos = (
            Interval(lo.reshape(shape), hi.reshape(shape))
            for lo, hi in _core.enclosed_sin_cos(self.lo.ravel(), self.hi.ravel())
        )
        return sin, cos


def _widened(value: Array) -> Interval:
    by = _core.RELATIVE_ERROR * np.abs(value)
    return Interval(_down(value - by), _up(value + by))


def _expm1(x: Array) -> Interval:
    """Enclose e^x - 1 of numbers; that of x > 0, -y/(1 + y) with the y of -x, is wider."""
    y = _widened(_core.decay_minus_1(-np.abs(x).ravel()).reshape(x.shape))
    y = Interval(np.maximum(y.lo, -1.0), y.hi)
    above = -y / (1.0 + y)
    positive = x > 0.0
    return Interval(np.where(positive, above.lo, y.lo), np.where(positive, above.hi, y.hi))


def join(*parts: Interval, axis: int = 0) -> Interval:
    """Return the parts one after another; single intervals count as arrays of one."""
    lo = [np.atleast_1d(part.lo) for part in parts]
    hi = [np.atleast_1d(part.hi) for part in parts]
    return Interval(np.concatenate(lo, axis=axis), np.concatenate(hi, axis=axis))


def matmul(a: Interval, b: Interval) -> Interval:
    """Return the product of matrices of shapes (i, j) and (j, k)."""
    total = a[:, :1] * b[:1]
    for j in range(1, a.lo.shape[1]):
        total = total + a[:, j : j + 1] * b[j : j + 1]
    return total


PI = Interval(np.pi, np.nextafter(np.pi, 4.0))

#: Encloses value and slope of function number ``which`` over boxes [lo, hi].
Enclosure = Callable[[NDArray[np.int64], Interval], tuple[Interval, Interval]]


@dataclass(frozen=True)
class Roots:
    """Boxes that hold all roots of some functions, in order of function and place.

    Attributes
    ----------
    which
        Number of the function, shape (k,).
    box
        The boxes, shape (k,).
    isolated
        Whether a box holds exactly one root, and that a simple one; else it may hold any number.
    """

    which: NDArray[np.int64]
    box: Interval
    isolated: Mask

    def __len__(self) -> int:
        """Number of boxes."""
        return len(self.which)


class _Kept:
    """Boxes collected during a search."""

    def __init__(self) -> None:
        self.which: list[NDArray[np.int64]] = []
        self.lo: list[Array] = []
        self.hi: list[Array] = []

    def add(self, which: NDArray[np.int64], box: Interval, mask: Mask | None = None) -> None:
        taken = slice(None) if mask is None else mask
        self.which.append(which[taken])
        self.lo.append(box.lo[taken])
        self.hi.append(box.hi[taken])

    def all(self) -> tuple[NDArray[np.int64], Interval]:
        if not self.which:
            return np.empty(0, dtype=np.int64), Interval(np.empty(0))
        return (
            np.concatenate(self.which),
            Interval(np.concatenate(self.lo), np.concatenate(self.hi)),
        )


def isolate(enclose: Enclosure, which: NDArray[np.int64], box: Interval) -> Roots:
    """Find all roots of functions of one variable in given boxes, with proof.

    Parameters
    ----------
    enclose
        ``enclose(which, x)`` returns intervals that hold every value and every slope of function
        number ``which`` over the box ``x``; arrays of one shape (k,).
    which, box
        Where to search, shape (k,).

    Returns
    -------
    Roots
        Every root in the boxes lies in one of those returned.
    """
    alone, edges, undecided = _Kept(), _Kept(), _Kept()
    for _ in range(_MAX_LEVELS):
        if not len(which):
            break
        value, slope = enclose(which, box)
        left = value.holds_zero
        monotone = left & ~slope.holds_zero
        ends = _signs_at_ends(enclose, which[monotone], box[monotone])
        product = ends[0] * ends[1]
        alone.add(which[monotone], box[monotone], product < 0)
        edges.add(which[monotone], box[monotone], product == 0)
        which, box = which[left & ~monotone], box[left & ~monotone]
        stop = _is_noise(enclose, which, box)
        stop |= np.bincount(which, minlength=1)[which] > _MAX_BOXES if len(which) else False
        undecided.add(which, box, stop)
        which, box = _halves(which[~stop], box[~stop])
    undecided.add(which, box)
    proved, loose = _settle_edges(enclose, *edges.all())
    alone.add(*proved)
    undecided.add(*loose)
    which, box = alone.all()
    return _in_order(enclose, which, contract(enclose, which, box), *undecided.all())


def contract(enclose: Enclosure, which: NDArray[np.int64], box: Interval) -> Interval:
    """Shrink boxes that hold one root each to rounding, by Newton's method on intervals."""
    active = np.arange(len(which))
    lo, hi = box.lo.copy(), box.hi.copy()
    for _ in range(_MAX_LEVELS):
        if not len(active):
            break
        now = Interval(lo[active], hi[active])
        middle = now.middle
        value, _ = enclose(which[active], Interval(middle))
        _, slope = enclose(which[active], now)
        # X := X and (m - F(m)/F'(X)); the root lies in both.
        newer = now.meet(Interval(middle) - value / slope)
        lo[active], hi[active] = newer.lo, newer.hi
        active = active[newer.width < 0.9 * now.width]
    return Interval(lo, hi)


def _halves(which: NDArray[np.int64], box: Interval) -> tuple[NDArray[np.int64], Interval]:
    middle = box.middle
    lo, hi = np.concatenate([box.lo, middle]), np.concatenate([middle, box.hi])
    return np.concatenate([which, which]), Interval(lo, hi)


def _signs_at_ends(
    enclose: Enclosure, which: NDArray[np.int64], box: Interval
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    low, _ = enclose(which, Interval(box.lo))
    high, _ = enclose(which, Interval(box.hi))
    return low.sign, high.sign


def _is_noise(enclose: Enclosure, which: NDArray[np.int64], box: Interval) -> Mask:
    """Where further halving does not help: rounding hides the sign at ends and middle."""
    middle = box.middle
    stop = (middle <= box.lo) | (middle >= box.hi)
    small = np.flatnonzero(~stop & (box.width < 1e-4 * (1.0 + box.largest)))
    if len(small):
        hidden = np.ones(len(small), dtype=bool)
        for point in (box.lo, middle, box.hi):
            value, _ = enclose(which[small], Interval(point[small]))
            hidden &= value.holds_zero
        stop[small] = hidden
    return stop


def _settle_edges(
    enclose: Enclosure, which: NDArray[np.int64], box: Interval
) -> tuple[tuple[NDArray[np.int64], Interval], tuple[NDArray[np.int64], Interval]]:
    """Widen monotone boxes with a root at an end, until the signs at the ends are certain."""
    proved, loose = _Kept(), _Kept()
    for widening in 4.0 ** np.arange(1, 16):
        if not len(which):
            break
        _, slope = enclose(which, box)
        low, _ = enclose(which, Interval(box.lo))
        high, _ = enclose(which, Interval(box.hi))
        with np.errstate(divide="ignore", invalid="ignore"):
            steps = [value.largest / slope.smallest for value in (low, high)]
        least = 4.0 * EPS * np.maximum(box.largest, 1e-3)
        lo = np.where(low.holds_zero, box.lo - widening * np.maximum(steps[0], least), box.lo)
        hi = np.where(high.holds_zero, box.hi + widening * np.maximum(steps[1], least), box.hi)
        wider = Interval(lo, hi)
        _, slope = enclose(which, wider)
        ends = _signs_at_ends(enclose, which, wider)
        certain = ~slope.holds_zero & (ends[0] * ends[1] != 0)
        proved.add(which, wider, certain & (ends[0] * ends[1] < 0))
        lost = slope.holds_zero
        loose.add(which, box, lost)
        which, box = which[~certain & ~lost], box[~certain & ~lost]
    loose.add(which, box)
    return proved.all(), loose.all()


def _in_order(
    enclose: Enclosure,
    alone: NDArray[np.int64],
    box: Interval,
    unsure: NDArray[np.int64],
    doubtful: Interval,
) -> Roots:
    """Sort the boxes and join those that touch: one root if the slope of both has one sign."""
    which = np.concatenate([alone, unsure])
    lo, hi = np.concatenate([box.lo, doubtful.lo]), np.concatenate([box.hi, doubtful.hi])
    isolated = np.arange(len(which)) < len(alone)
    order = np.lexsort((hi, lo, which))
    which, lo, hi, isolated = which[order], lo[order], hi[order], isolated[order]
    while len(which) > 1:
        near = lo[1:] <= hi[:-1] + 4.0 * EPS * np.abs(hi[:-1])
        # Two isolated boxes that do not overlap hold a root each, however close.
        touching = (which[1:] == which[:-1]) & near & ~(isolated[1:] ^ isolated[:-1])
        first = np.flatnonzero(touching)
        first = first[np.append(True, np.diff(first) > 1)] if len(first) else first
        if not len(first):
            break
        hull = Interval(lo[first], np.maximum(hi[first], hi[first + 1]))
        _, slope = enclose(which[first], hull)
        isolated[first] &= isolated[first + 1] & ~slope.holds_zero
        hi[first] = hull.hi
        keep = np.ones(len(which), dtype=bool)
        keep[first + 1] = False
        which, lo, hi, isolated = which[keep], lo[keep], hi[keep], isolated[keep]
    return Roots(which, Interval(lo, hi), isolated)

"""Interval arithmetic encloses, and isolation finds every root with a proof.

Sums, products and quotients are compared with exact rationals, elementary functions with balls of
200 bits, roots with known ones.
"""

from fractions import Fraction

import numpy as np
import pytest
from flint import arb, ctx
from hypothesis import given, settings
from hypothesis import strategies as st

from vibroimpact.single_impact.intervals import Interval, contract, isolate, join, matmul

ctx.prec = 200
numbers = st.floats(-1e6, 1e6, allow_subnormal=False).filter(lambda x: x == 0 or abs(x) > 1e-9)


def holds(interval, exact):
    return Fraction(float(interval.lo)) <= exact <= Fraction(float(interval.hi))


def holds_ball(interval, exact):
    # The exact value is itself a ball, of radius 1e-60.
    return not exact < arb(float(interval.lo)) and not exact > arb(float(interval.hi))


@given(a=numbers, b=numbers, c=numbers, d=numbers, s=st.floats(0, 1), t=st.floats(0, 1))
@settings(max_examples=300, derandomize=True, deadline=None)
def test_arithmetic_holds_every_exact_result(a, b, c, d, s, t):
    x, y = Interval(min(a, b), max(a, b)), Interval(min(c, d), max(c, d))
    # One number of each interval.
    p = float(np.clip(x.lo + s * (x.hi - x.lo), x.lo, x.hi))
    q = float(np.clip(y.lo + t * (y.hi - y.lo), y.lo, y.hi))
    u, v = Fraction(p), Fraction(q)
    assert holds(x + y, u + v)
    assert holds(x - y, u - v)
    assert holds(x * y, u * v)
    assert holds(x.square(), u * u)
    if not y.holds_zero:
        assert holds(x / y, u / v)
    else:
        assert not np.isfinite((x / y).lo)


@given(a=st.floats(-1e4, 1e4), width=st.floats(0, 8), s=st.floats(0, 1))
@settings(max_examples=500, derandomize=True, deadline=None)
def test_elementary_functions_hold_every_value(a, width, s):
    x = Interval(a, a + width)
    p = float(np.clip(a + s * width, x.lo, x.hi))
    assert holds_ball(x.sin(), arb(p).sin())
    assert holds_ball(x.cos(), arb(p).cos())
    small = x * 0.01
    q = float(small.middle)
    assert holds_ball(small.expm1(), arb(q).expm1())
    if p > 0.0:
        assert holds_ball(Interval(p).sqrt(), arb(p).sqrt())


def test_results_of_points_are_a_few_floats_wide():
    # Enclosures that hold everything would pass the tests above.
    x, y = Interval(np.linspace(-3.0, 3.1, 50)), Interval(np.linspace(0.3, 7.0, 50))
    for result in (x + y, x * y, x / y, x.sin(), x.cos(), y.sqrt(), (-y).expm1()):
        assert (result.width <= 20 * np.spacing(np.maximum(result.largest, 0.1))).all()


def test_waves_reach_their_crests_inside():
    x = Interval(np.array([1.5, 4.6, 0.1, -20.0]), np.array([1.6, 4.8, 1.0, 20.0]))
    assert (x.sin().hi == [1.0, x.sin().hi[1], x.sin().hi[2], 1.0]).all()
    assert x.sin().lo[1] == x.sin().lo[3] == -1.0
    assert x.sin().hi[2] < 0.85
    assert x.sin().hi[1] < -0.99


def test_products_of_matrices_hold_the_exact_one():
    random = np.random.default_rng(7)
    a, b = random.uniform(-1, 1, (3, 4)), random.uniform(-1, 1, (4, 2))
    product = matmul(Interval(a), Interval(b))
    for i in range(3):
        for k in range(2):
            exact = sum(Fraction(a[i, j]) * Fraction(b[j, k]) for j in range(4))
            assert holds(product[i, k], exact)
    joined = join(Interval(1.0), Interval(np.array([2.0, 3.0])))
    assert joined.lo.tolist() == [1.0, 2.0, 3.0]


def wave(which, x):
    """sin(k x) for function number k, and its slope."""
    k = Interval(np.asarray(which, dtype=float))
    return (k * x).sin(), k * (k * x).cos()


def test_all_roots_of_several_functions_are_isolated():
    which = np.array([1, 2, 5])
    roots = isolate(wave, which, Interval(np.full(3, -4.0), np.full(3, 4.0)))
    assert roots.isolated.all()
    for k in which:
        most = int(4.0 * k / np.pi)
        known = np.arange(-most, most + 1) * np.pi / k
        mine = roots.which == k
        assert mine.sum() == len(known)
        assert (roots.box.lo[mine] <= known + 1e-15).all()
        assert (known - 1e-15 <= roots.box.hi[mine]).all()
        assert (roots.box.width[mine] <= 1e-14).all()


def test_a_root_on_the_seam_of_two_boxes_is_found_once():
    lo, hi = np.array([-1.0, 0.0]), np.array([0.0, 1.0])
    roots = isolate(wave, np.array([3, 3]), Interval(lo, hi))
    assert len(roots) == 1
    assert roots.isolated.all()
    assert roots.box.lo[0] <= 0.0 <= roots.box.hi[0]


def parabola(which, x):
    """x^2 - 10^-which: a double root at 0 where the shift is lost."""
    shift = np.where(np.asarray(which) > 300, 0.0, 10.0 ** -np.asarray(which, dtype=float))
    return (x + 1.0).square() - 2.0 * x - 1.0 - shift, 2.0 * x


@pytest.mark.parametrize("exponent", [2, 6, 10, 12])
def test_close_roots_are_told_apart(exponent):
    roots = isolate(parabola, np.array([exponent]), Interval(np.array([-1.0]), np.array([1.7])))
    assert roots.isolated.tolist() == [True, True]
    known = 10.0 ** (-exponent / 2)
    # The function has the rounding of numbers near one.
    assert np.abs(roots.box.middle - [-known, known]).max() <= 1e-15 / known


@pytest.mark.parametrize("exponent", [17, 400])
def test_a_double_root_is_returned_undecided(exponent):
    roots = isolate(parabola, np.array([exponent]), Interval(np.array([-1.0]), np.array([1.7])))
    assert not roots.isolated.any()
    assert roots.box.lo.min() <= 0.0 <= roots.box.hi.max()
    # Where x^2 is below the rounding of numbers near one.
    assert np.abs(roots.box.largest).max() <= 1e-7


def test_a_function_without_roots_has_none():
    def lifted(which, x):
        value, slope = wave(which, x)
        return value + 1.001, slope

    box = Interval(np.array([-10.0]), np.array([10.0]))
    assert len(isolate(lifted, np.array([4]), box)) == 0


def test_contraction_keeps_the_root():
    box = contract(wave, np.array([1]), Interval(np.array([3.0]), np.array([3.5])))
    assert float(box.lo[0]) <= np.pi
    assert np.nextafter(np.pi, 4) >= float(box.lo[0])
    assert float(box.hi[0]) >= np.pi
    assert float(box.width[0]) <= 2e-15

"""The core's elementary functions keep to the errors that interval arithmetic counts with.

The proof has three parts, for sin and cos of |x| <= 1e5 and for e^x - 1 of x <= 0:

1. The algorithms of src/numerics/elementary.rs, written below once more for numbers of any kind,
   give the core's bits with floats.
2. With `Bounded` numbers they bound their own rounding: beside an enclosure of every computed
   value goes a bound of its distance from what exact arithmetic would give (N. J. Higham, Accuracy
   and Stability of Numerical Algorithms, SIAM 2002, sections 2.2 and 3.3). The remainder's interval
   is cut into pieces, so that a relative bound follows on each.
3. What exact arithmetic would give is a polynomial, and its distance from the function is a series
   whose coefficients are small (ball arithmetic).

Underflow (numbers below 1e-290) is left out.
"""

import itertools
import math
from dataclasses import dataclass
from fractions import Fraction

import numpy as np
import pytest
from flint import arb, arb_poly, ctx, fmpz

from vibroimpact import _core
from vibroimpact._core import ABSOLUTE_ERROR, RELATIVE_ERROR, UNREDUCED
from vibroimpact._core import MOST_TURNED as FAR

ctx.prec = 200


def fac(n):
    return arb(fmpz.fac_ui(n))


# Unit roundoff; and what the bounds below are enlarged by, being computed in floats themselves.
U = 2.0**-53
SAFE = 1.0 + 1e-9

SHIFT = 6755399441055744.0
HALF_PI = (1.5707963267341256, 6.077100506506192e-11)
LN_2 = (6.931471803691238e-1, 1.9082149292705877e-10)
SIN = (
    -1.6666666666666632e-1,
    8.33333333332249e-3,
    -1.984126982985795e-4,
    2.7557313707070068e-6,
    -2.5050760253406863e-8,
    1.58969099521155e-10,
)
COS = (
    4.16666666666666e-2,
    -1.388888888887411e-3,
    2.480158728947673e-5,
    -2.7557314351390663e-7,
    2.087572321298175e-9,
    -1.1359647557788195e-11,
)
EXP = tuple(1.0 / math.factorial(n) for n in range(3, 14))


@dataclass(frozen=True)
class Bounded:
    """Computed values in [lo, hi], each within ``error`` of its exact counterpart."""

    lo: float
    hi: float
    error: float = 0.0

    @property
    def largest(self):
        return max(abs(self.lo), abs(self.hi))

    def rounded(self, lo, hi, error):
        """Return the result of one operation: ends moved outwards, and its own rounding."""
        lo, hi = (
            math.nextafter(lo, -math.inf),
            math.nextafter(hi, math.inf),
        )
        return Bounded(lo, hi, SAFE * (error + U * max(abs(lo), abs(hi))))

    def __add__(self, other):
        other = bounded(other)
        return self.rounded(self.lo + other.lo, self.hi + other.hi, self.error + other.error)

    __radd__ = __add__

    def __neg__(self):
        return Bounded(-self.hi, -self.lo, self.error)

    def __sub__(self, other):
        return self + -bounded(other)

    def __rsub__(self, other):
        return bounded(other) - self

    def __mul__(self, other):
        if other == 0.5:
            return Bounded(0.5 * self.lo, 0.5 * self.hi, 0.5 * self.error)
        other = bounded(other)
        corners = [a * b for a in (self.lo, self.hi) for b in (other.lo, other.hi)]
        error = (self.largest + self.error) * other.error + other.largest * self.error
        return self.rounded(min(corners), max(corners), error)

    __rmul__ = __mul__


def bounded(value):
    return value if isinstance(value, Bounded) else Bounded(value, value)


def sine(x, tail):
    """Sine of x + tail, |x| <= pi/4 (`Kernel` of the core)."""
    z = x * x
    w = z * z
    s = (SIN[1] + z * (SIN[2] + z * SIN[3])) + z * w * (SIN[4] + z * SIN[5])
    v = z * x
    return x - ((z * (0.5 * tail - v * s) - tail) - v * SIN[0])


def cosine(x, tail):
    """Cosine of x + tail, |x| <= pi/4, as 1 - ``half`` + ``rest``."""
    z = x * x
    w = z * z
    c = z * (COS[0] + z * (COS[1] + z * COS[2])) + w * w * (COS[3] + z * (COS[4] + z * COS[5]))
    return 0.5 * z, z * c - x * tail


def exponential_minus_1(r, tail):
    """e^(r + tail) - 1 for |r| <= ln 2/2 (`exponential` of the core)."""
    z, w = r * r, (r * r) * (r * r)
    low = (EXP[0] + r * EXP[1]) + z * (EXP[2] + r * EXP[3])
    high = (EXP[4] + r * EXP[5]) + z * (EXP[6] + r * EXP[7])
    high = high + w * ((EXP[8] + r * EXP[9]) + z * EXP[10])
    powers = low + w * high
    return r + (0.5 * z + (z * r * powers + tail * (1.0 + r)))


def reduced(x):
    """Quadrant, remainder and tail of an angle."""
    shifted = x * (2.0 / math.pi) + SHIFT
    quarters = shifted - SHIFT
    first = x - quarters * HALF_PI[0]
    rest = quarters * HALF_PI[1] - 0.0
    remainder = first - rest
    return int(quarters), remainder, (first - remainder) - rest


def sin_cos(x):
    quadrant, r, tail = reduced(x)
    half, rest = cosine(r, tail)
    rounded = 1.0 - half
    sin, cos = sine(r, tail), rounded + (((1.0 - rounded) - half) + rest)
    return [(sin, cos), (cos, -sin), (-sin, -cos), (-cos, sin)][quadrant % 4]


def decay_minus_1(x):
    shifted = max(x, -60.0) * math.log2(math.e) + SHIFT
    halvings = shifted - SHIFT
    first = max(x, -60.0) - halvings * LN_2[0]
    rest = halvings * LN_2[1]
    r = first - rest
    scale = 2.0**halvings
    return scale * exponential_minus_1(r, (first - r) - rest) + (scale - 1.0)


def angles(count):
    random = np.random.default_rng(1)
    spread = random.uniform(-1, 1, count) * 10.0 ** random.uniform(-12, 5, count)
    # Where the reduction cancels most.
    quarters = np.arange(1, 63_662) * (np.pi / 2)
    return np.concatenate(
        [spread, quarters, np.nextafter(quarters, 0), np.nextafter(quarters, np.inf), [0.0, FAR]]
    )


def test_the_algorithms_are_those_of_the_core():
    x = angles(20_000)
    mine = np.array([sin_cos(float(each)) for each in x])
    assert np.stack(_core.sin_cos(x), axis=1).tolist() == mine.tolist()
    x = -np.abs(x)
    mine = np.array([decay_minus_1(float(each)) for each in x])
    assert _core.decay_minus_1(x).tolist() == mine.tolist()


# The remainder has at most this size: the nearest quarter is told to within 2e-11.
MOST = math.pi / 4 + 1e-10
PIECES = 900


def pieces(most):
    """Cut [most 2^-30, most] in pieces whose ends are close to each other's."""
    edges = most * 0.5 ** (np.arange(PIECES + 1) * (30.0 / PIECES))
    return zip(edges[1:].tolist(), edges[:-1].tolist(), strict=True)


def polynomial_error(coefficients, exact, power, most):
    """Bound |z^power sum (c_k - exact_k) z^k|, z in [0, most^2]: what a polynomial leaves out."""
    terms = [arb(c) - exact(k) for k, c in enumerate(coefficients)]
    terms += [-exact(k) for k in range(len(coefficients), 20)]
    difference = arb_poly([0] * power + terms)
    edges = [arb(most) ** 2 * k / 200 for k in range(201)]
    worst = arb(0)
    for a, b in itertools.pairwise(edges):
        # Expanded about the middle: nothing cancels there but what the function itself does.
        about = difference(arb_poly([(a + b) / 2, 1]))
        bound = sum((abs(c) * ((b - a) / 2) ** j for j, c in enumerate(about)), arb(0))
        worst = max(worst, bound, key=lambda each: float(each.upper()))
    # The series' further terms: less than the first of them, most < 1 and 1/(2 k)! falling.
    return float((worst + 2 * abs(exact(20))).upper())


def test_sine_and_cosine_of_a_remainder():
    left_of_sine = polynomial_error(SIN, lambda k: arb((-1) ** (k + 1)) / fac(2 * k + 3), 1, MOST)
    left_of_cosine = polynomial_error(COS, lambda k: arb((-1) ** k) / fac(2 * k + 4), 2, MOST)
    worst = {"sine": 0.0, "cosine": 0.0}
    for lo, hi in pieces(MOST):
        # The tail is what rounding the remainder left out.
        x, tail = Bounded(lo, hi), Bounded(-U * hi, U * hi)
        # The kernel has tail (1 - x^2/2) for the change of the sine, -x tail for the cosine's.
        by_tail = U * hi * (hi**4 / 24 + U * hi)
        error = sine(x, tail).error + hi * left_of_sine + by_tail
        worst["sine"] = max(worst["sine"], error / math.sin(lo))
        half, rest = cosine(x, tail)
        by_tail = U * hi * (hi**3 / 6 + U)
        # (1 - rounded) - half is what rounding 1 - half left out, exactly (Sterbenz's lemma and
        # Fast2Sum, half < 1/2); so only the last two additions round.
        additions = U * (U + rest.largest) + U * math.cos(lo)
        error = half.error + rest.error + additions + left_of_cosine + by_tail
        worst["cosine"] = max(worst["cosine"], error / math.cos(hi))
    # Below the pieces x stands beside terms of x^3, whose rounding is nothing.
    least = MOST * 2.0**-30
    worst["sine"] = max(worst["sine"], SAFE * U * (1.0 + 10.0 * least))
    assert max(worst.values()) < RELATIVE_ERROR, worst
    assert min(worst.values()) > 0.5 * RELATIVE_ERROR


def test_the_reduction():
    turns = Fraction(FAR) / Fraction(math.pi / 2) + 1
    # The product with the first part, of 33 bits, is exact, and so is the difference (Sterbenz).
    mantissa = Fraction(HALF_PI[0]) * 2**32
    assert mantissa.denominator == 1
    assert math.ceil(turns).bit_length() + 33 <= 53
    # The rest: its own rounding, and that of remainder and tail where it exceeds `first`.
    rest = float(turns * Fraction(HALF_PI[1]))
    missing = abs(arb.pi() / 2 - arb(HALF_PI[0]) - arb(HALF_PI[1])) * float(turns)
    assert 3.0 * U * rest + float(missing.upper()) < 0.5 * ABSOLUTE_ERROR
    assert all(reduced(each)[0] == 0 for each in (-UNREDUCED, UNREDUCED))
    # A shifted product tells the nearest quarter up to its two roundings and that of 2/pi.
    assert 3.0 * U * float(turns) * math.pi / 2 < 1e-10


def test_decay():
    ln_2 = math.log(2.0)
    most = ln_2 / 2 + 1e-10

    def left_out(r):
        # The coefficients' rounding, and the terms from r^14 on.
        rounding = sum(r**n * U / math.factorial(n) for n in range(3, 14))
        return rounding + 1.1 * r**14 / math.factorial(14)

    worst = 0.0
    for lo, hi in pieces(most):
        # No halving: the remainder is x itself.
        result = exponential_minus_1(Bounded(-hi, -lo), Bounded(0.0, 0.0))
        worst = max(worst, (result.error + left_out(hi)) / -math.expm1(-lo))
    for halvings in range(1, 88):
        scale = 0.5**halvings
        for a, b in itertools.pairwise(np.linspace(-most, most, 200)):
            r, size = Bounded(float(a), float(b)), max(abs(a), abs(b))
            tail = Bounded(-U * size, U * size)
            result = exponential_minus_1(r, tail)
            # ln 2 in two parts, their products with the number of halvings; e^tail = 1 + tail + ...
            reduction = U * halvings * LN_2[1] * 3.0 + (U * size) ** 2
            error = scale * (result.error + left_out(size) + reduction)
            error += U * (halvings > 52)  # in scale - 1
            least = 1.0 - scale * math.exp(float(b))
            worst = max(worst, SAFE * (error / least + U))
    assert 0.5 * RELATIVE_ERROR < worst < RELATIVE_ERROR


@pytest.mark.parametrize("name", ["sin", "cos", "expm1"])
def test_against_balls(name):
    x = angles(4_000)
    if name == "expm1":
        x = -np.abs(x)
        found = _core.decay_minus_1(x)
    else:
        found = _core.sin_cos(x)[name == "cos"]
    for each, value in zip(x.tolist(), found.tolist(), strict=True):
        exact = getattr(arb(each), name)()
        absolute = 0.0 if name == "expm1" or abs(each) <= UNREDUCED else ABSOLUTE_ERROR
        assert abs(arb(value) - exact) <= RELATIVE_ERROR * abs(exact) + absolute, each

"""A number with its gradient, both in balls: the derivative of a formula by the formula itself.

It has what the impact laws of impact.py do with numbers; comparisons are those of the values.
"""

from __future__ import annotations

from dataclasses import dataclass

from flint import arb, arb_mat

from .contact import Undecided


@dataclass(frozen=True, eq=False)
class Dual:
    """A value, and its derivatives as a row (1, m)."""

    value: arb
    row: arb_mat

    @classmethod
    def of(cls, number: Dual | arb, like: Dual) -> Dual:
        """A number; one without a gradient is constant."""
        if isinstance(number, Dual):
            return number
        return cls(number, arb_mat(1, like.row.ncols()))

    def is_zero(self) -> bool:
        """Whether the value is exactly 0."""
        return bool(self.value.is_zero())

    def sqrt(self) -> Dual:
        """The square root."""
        root = self.value.sqrt()
        return Dual(root, self.row * (1 / (2 * root)))

    def sin(self) -> Dual:
        """The sine."""
        return Dual(self.value.sin(), self.row * self.value.cos())

    def cos(self) -> Dual:
        """The cosine."""
        return Dual(self.value.cos(), self.row * -self.value.sin())

    def __abs__(self) -> Dual:
        """The size, of a value with a sign."""
        if self.value > 0:
            return self
        if self.value < 0:
            return -self
        raise Undecided("a sign in a derivative")

    def __neg__(self) -> Dual:
        """The negative."""
        return Dual(-self.value, -self.row)

    def __add__(self, other: Dual | arb | int) -> Dual:
        """The sum."""
        if isinstance(other, Dual):
            return Dual(self.value + other.value, self.row + other.row)
        return Dual(self.value + other, self.row)

    __radd__ = __add__

    def __sub__(self, other: Dual | arb | int) -> Dual:
        """The difference."""
        return self + -other

    def __rsub__(self, other: arb | int) -> Dual:
        """The difference."""
        return -self + other

    def __mul__(self, other: Dual | arb | int) -> Dual:
        """The product."""
        if isinstance(other, Dual):
            return Dual(self.value * other.value, self.row * other.value + other.row * self.value)
        return Dual(self.value * other, self.row * arb(other))

    __rmul__ = __mul__

    def __truediv__(self, other: Dual | arb | int) -> Dual:
        """The quotient."""
        if isinstance(other, Dual):
            found = self.value / other.value
            return Dual(found, (self.row - other.row * found) * (1 / other.value))
        return Dual(self.value / other, self.row * (1 / arb(other)))

    def __rtruediv__(self, other: arb | int) -> Dual:
        """The quotient."""
        return Dual(arb(other), arb_mat(1, self.row.ncols())) / self

    def __pow__(self, power: int) -> Dual:
        """A whole power."""
        return Dual(self.value**power, self.row * (power * self.value ** (power - 1)))

    def __lt__(self, other: Dual | arb) -> bool:
        """Certainly less."""
        return bool(self.value < _value(other))

    def __gt__(self, other: Dual | arb) -> bool:
        """Certainly more."""
        return bool(self.value > _value(other))

    def __le__(self, other: Dual | arb) -> bool:
        """Certainly no more."""
        return bool(self.value <= _value(other))

    def __ge__(self, other: Dual | arb) -> bool:
        """Certainly no less."""
        return bool(self.value >= _value(other))


def _value(number: Dual | arb) -> arb:
    return number.value if isinstance(number, Dual) else number

"""A quantity that a map varies, and its range."""

from __future__ import annotations

from dataclasses import dataclass

from ..arguments import number, reject


@dataclass(frozen=True, kw_only=True)
class Axis:
    """A quantity that varies, and its range.

    Attributes
    ----------
    name
        Of a numeric parameter of the machine, or of a coordinate of the start.
    low, high
        Both ends, ``low < high``.
    """

    name: str
    low: float
    high: float

    def __post_init__(self) -> None:
        """Refuse an empty range."""
        for end in ("low", "high"):
            object.__setattr__(self, end, number(f"{self.name}: {end}", getattr(self, end)))
        if not self.low < self.high:
            reject(self.name, (self.low, self.high), "a range whose first end is the lower one")


def around(name: str, value: float) -> Axis:
    """Return the range of half a value on either side of it; the value is positive."""
    return Axis(name=name, low=0.5 * value, high=1.5 * value)

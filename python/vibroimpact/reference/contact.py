"""Certified first contact of a flight: the first t > 0 with g = 0 and g' > 0.

Method (theory page, section 3): the flight is covered from t = 0 on by intervals on each of
which Taylor enclosures of g, g', g'' decide by proof that there is no root, or exactly one:
    g < 0; g' < 0 (falling); g' > 0 (rising: sign at the end); g'' > 0 (convex: sign at the end);
    g'' < 0 (concave: a hump, sign of its height).
g < 0 holds at the left end of each interval, at t = 0 by the start condition. An interval that
none of them decides is shortened; the root is isolated with an interval Newton iteration.
If the balls are too wide to decide, `Undecided` is raised and the search is repeated at twice
the precision, up to a cap. An exact graze stays undecided at any precision.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import factorial
from typing import Literal, Protocol

from flint import arb, arb_poly, ctx, fmpq

from .flight import Value, rational

ORDER = 16  # Taylor order of the enclosures
WIDTH = fmpq(1021, 1024)  # widest interval times the motion's rate; odd, so ends hit no root
# Of quick flights: half widths below which Newton's method needs no more than so many terms.
NARROW, NARROW_ORDER = fmpq(1, 2**12), 5
SHORTEN, LENGTHEN = fmpq(479, 1024), fmpq(3, 2)


class Undecided(ArithmeticError):
    """The enclosures do not decide at the present precision; `where` is the place in time."""

    def __init__(self, what: str, where: fmpq | None = None, height: arb | None = None) -> None:
        super().__init__(what)
        self.where, self.height = where, height


class Gapped(Protocol):
    """A function of time whose first rise through 0 is sought: a gap, or a force that ends."""

    @property
    def rate(self) -> float:
        """Bound on its relative rate of change."""
        ...

    @property
    def quick(self) -> bool:
        """Whether Newton's method uses fewer terms on narrow intervals."""
        ...

    def gap(self, t: Value) -> arb:
        """Enclosure at time `t`."""
        ...

    def velocity(self, t: Value) -> arb:
        """Enclosure of the derivative at time `t`."""
        ...

    def gap_series(self, centre: fmpq, h: fmpq, order: int) -> list[arb]:
        """Taylor coefficients about `centre`, the last one sound within `h` of it."""
        ...


@dataclass(frozen=True)
class Hump:
    """A local maximum of g with a proof: its time and height (enclosures)."""

    time: arb
    height: arb


@dataclass(frozen=True)
class Contact:
    """Outcome of a search, proved unless `kind` is undecided.

    kind: contact at `time` with approach velocity `u` = g' > 0; none before the end; immediate:
    the motion enters contact at t = 0; undecided: an unresolved graze about `time`.
    `humps` are those maxima of g that had to be computed, the last one after the contact if it
    was reached over a hump; lower ones are excluded without computing them.
    """

    kind: Literal["contact", "none", "immediate", "undecided"]
    time: arb | None
    u: arb | None
    humps: tuple[Hump, ...]
    precision: int


def first_contact(
    flight: Gapped, end: fmpq, *, touching: int = 0, precision: int = 128, cap: int = 2048
) -> Contact:
    """First contact of a flight in (0, end], with proof.

    Parameters
    ----------
    flight : the free motion
    end : length of the search
    touching : 0: g < 0 at the start; 1: g = 0 exactly and g' < 0 (after an impact);
        k: g and its first k - 1 derivatives are 0 exactly
    precision, cap : first and last precision tried, in bits

    Raises
    ------
    ValueError : g > 0 at the start, or g' > 0 with touching = 1
    """
    saved = ctx.prec
    try:
        while True:
            ctx.prec = precision
            try:
                return _scan(flight, end, touching)
            except Undecided as doubt:
                if 2 * precision > cap:
                    time = None if doubt.where is None else arb(doubt.where)
                    humps = () if doubt.height is None else (Hump(arb(time), doubt.height),)
                    return Contact("undecided", time, None, humps, precision)
            precision *= 2
    finally:
        ctx.prec = saved


def derivatives(flight: Gapped, t: fmpq, order: int = 3) -> list[arb]:
    """Enclosures of g and its first derivatives at time t."""
    series = flight.gap_series(t, fmpq(0), order)
    return [factorial(k) * value for k, value in enumerate(series)]


def isolate(flight: Gapped, a: fmpq, b: fmpq, *, level: int = 0, rising: bool = True) -> arb:
    """The root of the level-th derivative of g in (a, b), as narrow as the balls allow.

    The caller has proved that there is exactly one and that it is a rising (falling) one:
    left of it the function is negative (positive), right of it positive (negative).
    """
    sign = 1 if rising else -1
    while b - a > 8 * _grain():
        middle, half = _dyadic((a + b) / 2), _dyadic((b - a) / 2) + 2 * _grain()
        order = NARROW_ORDER if flight.quick and half < NARROW else ORDER
        poly = _poly(flight.gap_series(middle, half, order), level)
        slope = sign * poly.derivative()(arb(0, arb(half)))
        value = sign * poly[0]
        if slope > 0:
            newton = arb(middle) - value / slope
            low, high = max(a, rational(newton.lower())), min(b, rational(newton.upper()))
            if 4 * (high - low) < 3 * (b - a):
                a, b = low, high
                continue
        if value < 0:
            a = middle
        elif value > 0:
            b = middle
        elif slope > 0:
            # value contains 0: the width is that of its ball divided by the slope
            return arb(low).union(arb(high))
        else:
            raise Undecided("sign at a trial point", middle)
    return arb(a).union(arb(b))


def top_near(flight: Gapped, near: fmpq) -> tuple[fmpq, arb] | None:
    """Time (to the precision, not enclosed) and height of the maximum of g next to `near`.

    Newton's method on g' where g'' < 0; None if it leaves that region or strays further than 1/2.
    """
    t = near
    for _ in range(60):
        _, slope, bend, _ = derivatives(flight, t)
        if not bend < 0:
            return None
        move = rational((slope / bend).mid())
        t = rational(arb(t - move).mid())
        if abs(t - near) > fmpq(1, 2):
            return None
        if abs(move) < 1 / fmpq(2) ** (ctx.prec * 3 // 4):
            return t, derivatives(flight, t)[0]
    return None


def _scan(flight: Gapped, end: fmpq, touching: int) -> Contact:
    """One pass at the present precision; raises Undecided."""
    at_start = derivatives(flight, fmpq(0), max(3, touching))
    early = _check_start(at_start, touching)
    if early:
        return Contact("immediate", arb(0), at_start[1], (), ctx.prec)
    widest = WIDTH / fmpq(round(1024 * flight.rate), 1024)
    shortest = max(widest, fmpq(1)) / fmpq(2) ** ctx.prec
    humps: list[Hump] = []
    a, width, held = fmpq(0), widest, touching
    if touching == 1 and at_start[2] > 0:
        # a flight within chatter takes about 2 |g'|/g'': to shorten the widest interval would take
        # long
        width = min(widest, rational((-3 * at_start[1] / at_start[2]).mid()))
    while a < end:
        b = min(end, _dyadic(a + width))
        root = _decide(flight, a, b, held, humps)
        if root is None:
            width *= SHORTEN
            if width < shortest:
                raise Undecided("the shortest interval", a)
        elif isinstance(root, arb):
            return Contact("contact", root, flight.velocity(root), tuple(humps), ctx.prec)
        else:
            a, held, width = b, 0, min(widest, width * LENGTHEN)
    return Contact("none", None, None, tuple(humps), ctx.prec)


def _check_start(g: list[arb], touching: int) -> bool:
    """Whether contact begins at once; raises on an inadmissible or undecided start.

    The first of g, g', ... that does not vanish by definition decides.
    """
    first = g[touching]
    if first < 0:
        return False
    if first > 0 and touching >= 2:
        return True
    if first > 0:
        raise ValueError("g > 0 at the start" if touching == 0 else "g = 0 and g' > 0 at the start")
    raise Undecided("the start", fmpq(0))


def _decide(flight: Gapped, a: fmpq, b: fmpq, held: int, humps: list[Hump]) -> arb | bool | None:
    """The root of g in (a, b]; False if there is none; None if the interval is too long.

    `held` > 0: a = 0 is the start of a flight that leaves contact (g(a) = 0, g'(a) <= 0).
    """
    middle, half = (a + b) / 2, (b - a) / 2
    poly = arb_poly(flight.gap_series(middle, half, ORDER))
    span = arb(0, arb(half))
    if not held and poly(span) < 0:
        return False
    first = poly.derivative()
    slope = first(span)
    if slope < 0:
        return False
    second = first.derivative()
    bend = second(span)
    if bend < 0 and held:
        return False
    higher = second
    for _ in range(2, held + 1):
        # derivatives below that of order `held` are 0 at the start, and this one is not positive
        higher = higher.derivative()
        if higher(span) < 0:
            return False
    if (slope > 0 and not held) or bend > 0:
        at_end = flight.gap(b)
        if at_end < 0:
            return False
        return isolate(flight, a, b) if at_end > 0 else None
    return _over_hump(flight, a, b, humps) if bend < 0 else None


def _over_hump(flight: Gapped, a: fmpq, b: fmpq, humps: list[Hump]) -> arb | bool | None:
    """The root of g in (a, b] where g'' < 0 and g(a) < 0."""
    length = arb(b - a)
    ga, slope_a = derivatives(flight, a)[:2]
    gb, slope_b = derivatives(flight, b)[:2]
    # A concave g lies below its tangents; this decides if the maximum is at or beyond an end.
    if ga + slope_a.max(arb(0)) * length < 0 or gb + (-slope_b).max(arb(0)) * length < 0:
        return False
    if slope_b > 0:
        if gb < 0:
            return False
        return isolate(flight, a, b) if gb > 0 else None
    if not (slope_a > 0 and slope_b < 0):
        return None
    top = isolate(flight, a, b, level=1, rising=False)
    middle = rational(top.mid())
    height = derivatives(flight, middle)[0]
    # g(top) - g(middle) = g'(between) (top - middle), and g' is tiny there
    radius = rational(top.rad())
    if radius != 0:
        poly = arb_poly(flight.gap_series(middle, radius, ORDER))
        height += poly.derivative()(arb(0, arb(radius))) * arb(0, arb(radius))
    if not (height < 0 or height > 0):
        raise Undecided("a graze", middle, height)
    humps.append(Hump(top, height))
    if height < 0:
        return False
    if not flight.gap(middle) > 0:
        raise Undecided("a graze", middle, height)
    return isolate(flight, a, middle)


def _poly(series: list[arb], level: int) -> arb_poly:
    """Enclosing polynomial of the level-th derivative."""
    poly = arb_poly(series)
    for _ in range(level):
        poly = poly.derivative()
    return poly


def _grain() -> fmpq:
    """Spacing of the times used, well below the precision."""
    return 1 / fmpq(2) ** (ctx.prec + 16)


def _dyadic(q: fmpq) -> fmpq:
    """`q` rounded down to a multiple of the grain, so that fractions stay short."""
    return fmpq((q / _grain()).floor()) * _grain()

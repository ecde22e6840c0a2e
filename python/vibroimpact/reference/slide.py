"""Sliding contact by Taylor series: the motion on g = 0 until its first event.

On g = 0 (theory page, section 5) body 2 follows the tip, x2 = sin x1 - delta, and with the
free accelerations a1, a2, sigma = sgn(sin x1) and the direction of slip s = sgn(v1)

    k = cos x1 + mu s sigma sin x1,      p = (a1 cos x1 - v1^2 sin x1 - a2)/(mbar + k cos x1),
    x1'' = a1 - k p      (direct contact: cos -> 1, sin -> 0).

Between the kinks at sin x1 = 0 this is analytic: the Taylor coefficients of x1 follow one by one
from products and one quotient of series. A step is as long as the last terms of order `order`
stay below the tolerance; the difference to order - 2 is added to the stated error of the phase.
Events are the first roots of the series of p (release) and, with friction, of v1 (stop),
sin x1 (cross) and mbar + k cos x1 (painleve). The roots are isolated by proof, but belong to the
truncated series: unlike a flight's first contact, nothing here encloses the exact motion.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Literal

from flint import arb, arb_poly, fmpq

from .contact import Undecided
from .flight import State, System

Ending = Literal["end", "release", "stop", "cross", "painleve"]
#: A step below this means the approach to a pole of p, a Painleve point.
_SHORTEST_STEP = 1e-9
#: Place at which an interval is cut in two: not the middle, where a root is likely.
CUT = fmpq(479, 1024)
#: Cuts of an interval before a root is called undecided (a double root, or one at an end).
_DEEPEST = 60


@dataclass(frozen=True)
class Settings:
    """Precision in bits, order of the Taylor series, and the tolerance of one step or limit."""

    precision: int = 400
    order: int = 40
    tolerance: float = 1e-45


@dataclass(frozen=True)
class Touch:
    """A state on g = 0: time, angle, velocity. Points, not enclosures.

    `flat` counts the vanishing derivatives of x1: 0, 1 (v1 = 0) or 2 (also x1'' = 0: the end of a
    stick). `crossing`: sin x1 = 0 by definition. `unloaded`: p = 0 by definition, and rising.
    """

    time: arb
    x1: arb
    v1: arb
    flat: int = 0
    crossing: bool = False
    unloaded: bool = False


@dataclass(frozen=True)
class Slid:
    """End of a slide: reason, state, and the stated error of the whole slide."""

    ending: Ending
    touch: Touch
    error: arb


@dataclass(frozen=True)
class Slide:
    """One smooth stretch of sliding: direction s and sigma = sgn(sin x1), +1 or -1."""

    system: System
    phase: arb
    direction: int
    side: int

    def state(self, x1: arb, v1: arb) -> State:
        """All four coordinates of a state on g = 0."""
        x2 = self.system.tip(x1) - arb(self.system.delta)
        return x1, v1, x2, v1 * self.system.slope(x1)

    def force(self, touch: Touch) -> arb:
        """Contact force p at a state."""
        return self.series(touch, 1)["force"][0]

    def denominator(self, touch: Touch) -> arb:
        """The denominator mbar + k cos x1 of p."""
        return self.series(touch, 1)["denominator"][0]

    def free_acceleration(self, touch: Touch) -> arb:
        """Second derivative g'' that the gap would have without contact."""
        return self.series(touch, 1)["numerator"][0]

    def series(self, touch: Touch, order: int) -> dict[str, list[arb]]:
        """Taylor coefficients about a state, of x1 to `order` + 1 and of all else to `order` - 1.

        Keys: angle, velocity, sine (sin x1), numerator, denominator, force.
        """
        system = self.system
        mbar, delta, omega = arb(system.mbar), arb(system.delta), arb(system.omega)
        damping1, stiffness = arb(2 * system.zeta1 * system.omega0), arb(system.omega0**2)
        damping2, friction = arb(2 * system.zeta2), arb(system.mu) * self.direction * self.side
        psi = self.phase + omega * touch.time
        even, odd = [psi.cos()], [psi.sin()]
        x, v = [touch.x1, touch.v1], [touch.v1]
        sine = [touch.x1.sin() if system.oblique else arb(0)]
        cosine = [system.slope(touch.x1)]
        tip = sine if system.oblique else x
        a1: list[arb] = []
        k: list[arb] = []
        square: list[arb] = []
        top: list[arb] = []
        bottom: list[arb] = []
        force: list[arb] = []
        for j in range(order):
            sine.append(_dot(v, cosine, j) / (j + 1) if system.oblique else arb(0))
            cosine.append(-_dot(v, sine, j) / (j + 1) if system.oblique else arb(0))
            even.append(-omega * odd[j] / (j + 1))
            odd.append(omega * even[j] / (j + 1))
            a1.append(arb(system.f1) * even[j] - damping1 * v[j] - stiffness * x[j])
            a2 = arb(system.f2) * even[j] - damping2 * (j + 1) * tip[j + 1] - tip[j]
            if j == 0:
                a1[0] += arb(system.c1)
                a2 += arb(system.c2)
            k.append(cosine[j] + friction * sine[j])
            square.append(_dot(v, v, j))
            top.append(_dot(a1, cosine, j) - _dot(square, sine, j) - a2)
            bottom.append(_dot(k, cosine, j))
            if j == 0:
                top[0] = arb(0) if touch.unloaded else top[0] - delta
                bottom[0] += mbar
                force.append(top[0] / bottom[0])
            else:
                force.append((top[j] - _dot(bottom[1:], force, j - 1)) / bottom[0])
            bend = a1[j] - _dot(k, force, j)
            if j == 0 and touch.flat == 2:
                bend = arb(0)
            x.append(bend / ((j + 1) * (j + 2)))
            v.append(bend / (j + 1))
        return {
            "angle": x,
            "velocity": v,
            "sine": sine,
            "numerator": top,
            "denominator": bottom,
            "force": force,
        }

    def follow(
        self,
        start: Touch,
        end: arb,
        settings: Settings,
        sample: Callable[[arb, Callable[[arb], State]], None],
    ) -> Slid:
        """Slide from `start` to the first event, or to the time `end`.

        `sample(until, state)` is called for each step: `state(t)` holds from its start to `until`.
        """
        touch, error = start, arb(0)
        while True:
            series = self.series(touch, settings.order)
            step = _step(series["angle"], settings)
            left = (end - touch.time).mid()
            last = not step < left
            step = left if last else step
            if step < _SHORTEST_STEP and not last:
                return Slid("painleve", touch, error)
            ending, at = self._first_event(series, touch, step)
            then = touch.time + (step if at is None else at)
            angle, velocity, origin = series["angle"], series["velocity"], touch.time

            def state(
                t: arb, angle: list[arb] = angle, velocity: list[arb] = velocity, t0: arb = origin
            ) -> State:
                return self.state(_value(angle, t - t0), _value(velocity, t - t0))

            sample(then, state)
            h = step if at is None else at
            error += _truncation(angle, h) + _truncation(velocity, h)
            still = ending == "stop"
            v1 = arb(0) if still else _value(velocity, h).mid()
            touch = Touch(
                then.mid(),
                _value(angle, h).mid(),
                v1,
                flat=1 if still else 0,
                crossing=ending == "cross",
            )
            if at is not None:
                return Slid(ending, touch, error)
            if last:
                return Slid("end", touch, error)

    def _first_event(
        self, series: dict[str, list[arb]], touch: Touch, step: arb
    ) -> tuple[Ending, arb | None]:
        """The earliest event within a step, and its time from the start of the step."""
        watched: list[tuple[Ending, list[arb], int]] = [
            ("release", series["force"], 1 if touch.unloaded else 0)
        ]
        if self.system.mu != 0:
            watched += [
                ("stop", series["velocity"], touch.flat),
                ("cross", series["sine"], 1 + touch.flat if touch.crossing else 0),
                ("painleve", series["denominator"], 0),
            ]
        kind: Ending = "end"
        first: arb | None = None
        for name, coefficients, zeros in watched:
            # roots at the start, known by definition, are divided out
            root = first_root(coefficients[zeros:], step)
            if root is None:
                continue
            if first is None or root < first:
                kind, first = name, root
            elif not root > first:
                raise Undecided(f"order of {kind} and {name} in contact")
        return kind, None if first is None else first.mid()


def first_root(coefficients: Sequence[arb], end: arb) -> arb | None:
    """First root of a polynomial in (0, end], isolated by proof; None if there is none.

    Raises Undecided at a double root, or a root at 0.
    """
    poly = arb_poly(list(coefficients))
    slope = poly.derivative()
    pending = [(arb(0), end, 0)]
    while pending:
        a, b, depth = pending.pop()
        middle, half = ((a + b) / 2).mid(), ((b - a) / 2).abs_upper()
        span = arb(middle, half)
        if not poly(span).contains(0):
            continue
        if not slope(span).contains(0):
            left, right = poly(a), poly(b)
            if left.contains(0) or right.contains(0):
                raise Undecided("a root at the end of a step in contact")
            if (left > 0) == (right > 0):
                continue
            return _polish(poly, slope, span)
        if depth == _DEEPEST:
            raise Undecided("a double root in contact")
        cut = (a + (b - a) * CUT).mid()
        pending += [(cut, b, depth + 1), (a, cut, depth + 1)]
    return None


def _polish(poly: arb_poly, slope: arb_poly, span: arb) -> arb:
    """Interval Newton for the one root in `span`, where the slope has one sign."""
    while True:
        middle = span.mid()
        newton = (middle - poly(middle) / slope(span)).intersection(span)
        if not newton.rad() < span.rad() * 0.75:
            return newton if newton.rad() < span.rad() else span
        span = newton


def _dot(a: Sequence[arb], b: Sequence[arb], j: int) -> arb:
    """Coefficient j of the product of two series."""
    total = arb(0)
    for i in range(j + 1):
        total += a[i] * b[j - i]
    return total


def _value(coefficients: Sequence[arb], h: arb) -> arb:
    """Sum of a series, by Horner's scheme."""
    total = arb(0)
    for coefficient in reversed(coefficients):
        total = total * h + coefficient
    return total


def _step(angle: Sequence[arb], settings: Settings) -> arb:
    """Length at which both last terms of the velocity's series fall below the tolerance."""
    steps = [arb(1)]
    for power in (len(angle) - 1, len(angle) - 2):
        size = power * abs(angle[power]).abs_upper()
        if size > 0:
            steps.append((arb(settings.tolerance) / size) ** (arb(1) / (power - 1)))
    shortest = steps[0]
    for step in steps[1:]:
        shortest = shortest.min(step)
    return shortest.mid()


def _truncation(coefficients: Sequence[arb], h: arb) -> arb:
    """Sum of the last two terms of a series."""
    n = len(coefficients) - 1
    return (abs(coefficients[n]) * h**n + abs(coefficients[n - 1]) * h ** (n - 1)).abs_upper()

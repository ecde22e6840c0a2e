"""The ladder of near-grazes: flights whose gap has a hump that ends d above (or below) 0.

For each ladder a flight with a suitable hump is drawn at random; then one of its numbers (gap,
start, phase, amplitude) is solved for the hump height d in high precision and ROUNDED to float64.
What is recorded belongs to the rounded floats: the height actually reached, both roots of g
beside the hump, and the certified first contact (docs/theory.md, section 3).
"""

from __future__ import annotations

import math
import random
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

from flint import arb, arb_poly, ctx, fmpq

from vibroimpact.reference.contact import (
    ORDER,
    Undecided,
    derivatives,
    first_contact,
    isolate,
    top_near,
)
from vibroimpact.reference.flight import Flight, Number, System, exact, rational

DIGITS = 25
SEED = 20040902
PRECISION = 256
#: Nominal hump heights, high to low, each with both signs.
RUNGS = [sign * 10.0**-k for k in range(2, 15) for sign in (1, -1)]
T_END = 25.0
CLEAR = 0.03  # the gap stays this much below the hump before it

_PLAIN: dict[str, Number] = {
    "mbar": 0.6, "omega0": 2.0, "r": 0.8, "delta": 0.5, "zeta1": 0.0, "zeta2": 0.0,
    "f1": 1.0, "f2": 0.0, "omega": 1.25, "mu": 0.0,
}  # fmt: skip
_LOSSY = _PLAIN | {"zeta1": 0.1, "zeta2": 0.1, "f2": 1.5, "omega": 0.75}
_MIXED = _PLAIN | {"omega0": 1.3, "zeta1": 0.02, "zeta2": 1.5, "f1": 0.7, "f2": -0.4, "omega": 2.1}
_FREE = _PLAIN | {"mbar": 0.0, "omega0": 0.0, "f1": -0.3, "omega": 0.0}
#: Parameters, contact, number solved for, whether the flight starts in contact.
LADDERS: list[tuple[str, dict[str, Number], str, str, bool]] = [
    ("plain-delta", _PLAIN, "oblique", "delta", False),
    ("plain-x2", _PLAIN, "oblique", "x2", False),
    ("lossy-v1", _LOSSY, "oblique", "v1", False),
    ("mixed-phase", _MIXED, "oblique", "phase", False),
    ("mixed-after-impact", _MIXED, "oblique", "v2", True),
    ("plain-after-impact", _PLAIN, "oblique", "v1", True),
    ("direct-delta", _PLAIN, "direct", "delta", False),
    ("direct-f1", _MIXED, "direct", "f1", False),
    ("direct-free", _FREE, "direct", "v1", False),
    ("direct-after-impact", _LOSSY, "direct", "v2", True),
]


def digits(value: arb) -> str:
    """`value` to 25 digits."""
    return str(value.str(DIGITS, radius=False))


@dataclass(frozen=True)
class GrazeCase:
    """A flight; `touching`: it starts in contact, x2 such that g(0) = 0 exactly."""

    parameters: dict[str, Number]
    contact: str
    start: dict[str, Number]
    touching: bool

    def flight(self) -> Flight:
        """The flight of exactly these numbers."""
        x1, v1, x2, v2, phase = (exact(self.start[k]) for k in ("x1", "v1", "x2", "v2", "phase"))
        system = System.parse(self.parameters, self.contact)
        return Flight(system, (x1, v1, None if self.touching else x2, v2), phase)

    def get(self, name: str) -> Number:
        """A parameter or initial value."""
        return self.start[name] if name in self.start else self.parameters[name]

    def put(self, name: str, value: Number) -> GrazeCase:
        """The same with another value of one number."""
        if name in self.start:
            return replace(self, start=self.start | {name: value})
        return replace(self, parameters=self.parameters | {name: value})


def graze_records() -> Iterator[dict[str, Any]]:
    """Every rung of every ladder, highest humps first."""
    rng = random.Random(SEED)
    with ctx.workprec(PRECISION):
        for name, parameters, contact, tuned, touching in LADDERS:
            for _ in range(2000):
                base = _draw(rng, parameters, contact, touching)
                near = _suitable_hump(base)
                rows = None if near is None else _ladder(name, base, tuned, near)
                if rows:
                    yield from rows
                    break
            else:
                raise Undecided(f"no flight for the ladder {name}")


def _draw(
    rng: random.Random, parameters: dict[str, Number], contact: str, touching: bool
) -> GrazeCase:
    """A flight with g(0) < 0, or g(0) = 0 and g'(0) < 0, in round numbers."""
    while True:
        x1, v1, x2, v2 = (round(rng.uniform(-1.2, 1.2), 3) for _ in range(4))
        phase, delta = round(rng.uniform(0, 6), 3), round(rng.uniform(0.1, 0.9), 3)
        tip, cos = (x1, 1.0) if contact == "direct" else (math.sin(x1), math.cos(x1))
        if parameters["mbar"] == 0:
            x2 = v2 = phase = 0.0
            v1 = abs(v1)
        if touching:
            x2 = tip - delta
        start: dict[str, Number] = {"x1": x1, "v1": v1, "x2": x2, "v2": v2, "phase": phase}
        apart = v1 * cos - v2 < -0.05 if touching else tip - x2 - delta < -CLEAR
        if apart:
            return GrazeCase(parameters | {"delta": delta}, contact, start, touching)


def _suitable_hump(case: GrazeCase) -> float | None:
    """Time of a hump near g = 0 that is higher than all before it, if there is one."""
    step = 1 / 64
    with ctx.workprec(64):
        flight = case.flight()
        gap = [float(flight.gap(fmpq(j, 64)).mid()) for j in range(1, int(10 / step))]
    for j in range(1, len(gap) - 1):
        top = gap[j] > gap[j - 1] and gap[j] >= gap[j + 1]
        if top and gap[j] > -CLEAR:
            risen = gap[j] - min(gap[:j])
            return (j + 1) * step if gap[j] < 0.05 and risen > CLEAR and j > 30 else None
        if gap[j] > 0.05:
            return None
    return None


def _solve(base: GrazeCase, tuned: str, near: float, height: float) -> GrazeCase | None:
    """The case with the tuned number, a float64, such that the hump is `height` high (secant)."""
    target = arb(exact(height))
    p = exact(base.get(tuned))
    q = p + exact(2.0**-20)
    first = top_near(base.flight(), exact(near))
    if first is None:
        return None
    residue = first[1] - target
    for _ in range(60):
        found = top_near(base.put(tuned, q).flight(), exact(near))
        if found is None:
            return None
        value = found[1] - target
        step = (value * arb(q - p) / (value - residue)).mid()
        if abs(float(step)) < 1e-30:
            return base.put(tuned, float(arb(q)))
        if not abs(float(step)) < 0.5:
            return None
        p, residue, q = q, value, rational(arb(q - rational(step)).mid())
    return None


def _ladder(name: str, base: GrazeCase, tuned: str, near: float) -> list[dict[str, Any]] | None:
    """All rungs, or None if the base does not carry the whole ladder."""
    rows = []
    for rung in RUNGS:
        case = _solve(base, tuned, near, rung)
        row = None if case is None else _record(name, case, rung, near)
        if row is None:
            return None
        rows.append(row)
    return rows


def _record(name: str, case: GrazeCase, rung: float, near: float) -> dict[str, Any] | None:
    """The certified data of one rung; None if the hump is not the first to reach that high."""
    flight = case.flight()
    top = top_near(flight, exact(near))
    if top is None:
        return None
    time, height = top
    # the interval on which g is concave, by proof, and which holds the hump and its two roots
    reach = min(exact(1), time * exact(0.9))
    while not _concave(flight, time - reach, time + reach):
        reach /= 2
    low, high = time - reach, time + reach
    ends = derivatives(flight, low), derivatives(flight, high)
    if not (ends[0][1] > 0 and ends[1][1] < 0 and ends[0][0] < 0 and ends[1][0] < 0):
        return None
    peak = isolate(flight, low, high, level=1, rising=False)
    roots: list[arb] = []
    if height > 0:
        roots = [isolate(flight, low, time), isolate(flight, time, high, rising=False)]
    found = first_contact(
        flight, exact(T_END), touching=int(case.touching), precision=PRECISION, cap=1024
    )
    if found.kind not in ("contact", "none"):
        return None
    if roots and (found.time is None or not found.time.overlaps(roots[0])):
        return None
    if not roots and found.time is not None and not found.time > peak:
        return None
    numbers = case.parameters | case.start
    return {
        "ladder": name,
        "rung": repr(rung),
        "contact": case.contact,
        "touching": case.touching,
        "parameters": {key: repr(value) for key, value in case.parameters.items()},
        **{key: repr(numbers[key]) for key in ("x1", "v1", "x2", "v2", "phase")},
        "t_end": repr(T_END),
        "hump_time": digits(peak),
        "hump_height": digits(height),
        "roots": [digits(root) for root in roots],
        "contact_time": None if found.time is None else digits(found.time),
        "approach_velocity": None if found.u is None else digits(found.u),
    }


def _concave(flight: Flight, low: fmpq, high: fmpq) -> bool:
    """Whether g'' < 0 on the whole interval, by proof."""
    half = (high - low) / 2
    poly = arb_poly(flight.gap_series((low + high) / 2, half, ORDER))
    return bool(poly.derivative().derivative()(arb(0, arb(half))) < 0)

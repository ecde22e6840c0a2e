"""Writes the reference data that the Rust and Python tests read: flights and near-grazes.

    python -m reference.regenerate flights.json near_grazes.json --write     (in tests)

`flights.json` sweeps docs/theory.md, section 2 with all its neighbourhoods; `near_grazes.json`
is the ladder of flights whose gap has a hump of height d = +-1e-2 ... +-1e-14 (ladder.py).
Inputs are float64, written so that reading the decimal gives the same bits; the reference values
belong to exactly those floats. Formats: tests/data/README.md. Quantities are dimensionless.
"""

from __future__ import annotations

import math
import random
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from flint import arb, ctx, fmpq

from vibroimpact.reference.contact import Undecided
from vibroimpact.reference.flight import Body, exact, rational

from .ladder import DIGITS, digits

DATA = Path(__file__).resolve().parents[1] / "data"
SEED = 20040901


@dataclass(frozen=True)
class FlightCase:
    """Inputs of one flight, all float64: body, start, and the time n * 2 pi/omega + tau."""

    omega0: float
    zeta: float
    f: float
    omega: float
    phase: float
    x0: float
    v0: float
    n: int
    tau: float

    def body(self) -> Body:
        """The oscillator with exactly these floats."""
        return Body(exact(self.omega0), exact(self.zeta), exact(self.f), exact(self.omega))

    def elapsed(self) -> arb:
        """Whole periods and tau, enclosed at the current precision."""
        whole = 2 * self.n * arb.pi() / arb(exact(self.omega)) if self.n else arb(0)
        return whole + arb(exact(self.tau))

    def start(self) -> tuple[fmpq, fmpq, fmpq]:
        """Position, velocity and forcing phase at time 0."""
        return exact(self.x0), exact(self.v0), exact(self.phase)


def flight_cases() -> Iterator[FlightCase]:
    """The sweep of flights.json, the same on every call."""
    rng = random.Random(SEED)
    counts = (0, 1, 30, 1000, 10**6)

    def case(omega0: float, zeta: float, omega: float, n: int, **fixed: float) -> FlightCase:
        return FlightCase(
            omega0,
            zeta,
            fixed.get("f", rng.uniform(-2, 2)),
            omega,
            rng.uniform(0, 2 * math.pi),
            fixed.get("x0", rng.uniform(-1, 1)),
            fixed.get("v0", rng.uniform(-1, 1)),
            n if omega > 0 else 0,
            fixed.get("tau", rng.uniform(0.01, 6)),
        )

    # near and at resonance
    for detuning in (0.0, *(10.0**-k for k in range(16, 0, -1))):
        for zeta in (0.0, 1e-14, 1e-8, 1e-3):
            for omega0 in (1.0, 2.0):
                side = rng.choice((-1, 1))
                yield case(omega0, zeta, omega0 + side * detuning, rng.choice(counts))
        yield case(1.0, 0.0, 1.0 + detuning, 10**6, f=1.0, x0=0.0, v0=0.0)
    # near and at critical damping
    for offset in (0.0, 1e-15, 1e-12, 1e-8, 1e-3):
        for zeta in (1 + offset, 1 - offset):
            for omega0 in (0.3, 1.0, 2.0):
                for n in (0, 0, 5):
                    yield case(omega0, zeta, rng.uniform(0.2, 4), n)
    # barely and heavily damped
    for zeta in (1e-14, 1e-8, 0.1, 0.5, 3.0, 100.0):
        for omega0 in (0.05, 1.0, 2.0, 7.0):
            for n in (0, 2, 1000):
                yield case(omega0, zeta, rng.uniform(0.2, 4), n)
    # slow and free bodies, slow and constant loads, with and without damping
    slow = (0.0, 1e-12, 1e-3)
    for omega0 in (*slow, 1.0):
        for omega in (*slow, 1.0):
            for zeta in (0.0, 0.1, 1.0, 3.0):
                yield case(omega0, zeta, omega, 0)
                yield case(omega0, zeta, omega, 0, tau=rng.uniform(50, 2000))
            if omega > 0:
                yield case(omega0, 0.0, omega, 3)
    # short times, where x(t) - x(0) is small
    for exponent in range(-8, 1):
        for zeta in (0.0, 0.1, 1.0):
            tau = 10.0**exponent * rng.uniform(0.5, 1)
            yield case(2.0, zeta, 1.25, 0, tau=tau)
            yield case(2.0, zeta, 1.25, 0, tau=tau, x0=0.0, v0=0.0)
    # anything
    for _ in range(130):
        zeta = rng.choice((0.0, 10 ** rng.uniform(-6, 1.5)))
        omega0, omega = 10 ** rng.uniform(-2, 1), 10 ** rng.uniform(-2, 1)
        yield case(omega0, zeta, omega, rng.choice(counts), f=10 ** rng.uniform(-3, 1))
    # long runs of undamped motion
    for _ in range(20):
        yield case(rng.uniform(0.5, 3), 0.0, rng.uniform(0.2, 4), 10**6)


def flight_record(case: FlightCase) -> dict[str, Any]:
    """Reference values of one flight: x, v to 25 digits and the scale of the motion."""
    body = case.body()
    text: dict[str, str] = {}
    for precision in (256, 512, 1024, 2048, 4096):
        with ctx.workprec(precision):
            x, v = body.state(case.elapsed(), *case.start())
            if all(q.is_zero() or q.rel_accuracy_bits() > 4 * DIGITS for q in (x, v)):
                text = {"x": digits(x), "v": digits(v)}
                break
    else:
        raise Undecided(f"digits of {case}")
    scale_x, scale_v = _scales(case, body, abs(float(x)), abs(float(v)))
    row: dict[str, Any] = {
        name: repr(value) if isinstance(value, float) else value
        for name, value in vars(case).items()
    }
    return row | text | {"scale_x": scale_x, "scale_v": scale_v}


def _scales(case: FlightCase, body: Body, x_end: float, v_end: float) -> tuple[float, float]:
    """Largest |x| and |v| on 1000 sampled times: first and last three periods, and between."""
    start = case.start()
    largest_x, largest_v = max(abs(case.x0), x_end), max(abs(case.v0), v_end)
    with ctx.workprec(128):
        end = rational(case.elapsed().mid())
        quick = max(case.omega, case.omega0, 1e-300)
        window = min(end, exact(6 * math.pi / quick))
        times = [window * j / 400 for j in range(1, 401)]
        times += [end - window * j / 400 for j in range(1, 400)]
        times += [end * j / 201 for j in range(1, 201)]
        for t in times:
            x, v = body.state(t, *start)
            largest_x = max(largest_x, abs(float(x.mid())))
            largest_v = max(largest_v, abs(float(v.mid())))
    return largest_x or 1e-300, largest_v or 1e-300

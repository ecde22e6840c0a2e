"""A Numba script: closed-form flights, the gap scanned in equal steps, Newton's method in brackets.

What somebody writes who knows that flights are closed forms and wants speed: the whole run in one
compiled function, constants of a flight computed once at its start. A contact is looked for where
g changes sign from one sample to the next, and where g' does downwards (a hump between samples:
then at its top). Two turns within one step are not seen. Underdamped bodies off resonance only.
"""

import importlib
import math
from functools import cache
from typing import Any

import numpy as np

from .law import walk
from .outcome import Outcome, Problem, Solve, most_impacts, one_by_one, penetration

NAME = "Numba"
SETTING = "closed-form flights, scan and Newton"
LACKS = "two turns of the gap within one step of the scan; chatter; sustained contact; resonance"
# There is no tolerance: the step of the scan stands here, in units of 1/(highest frequency). With 1
# no contact of the sweep of Fig. 7(b) is lost, and it is fastest there.
TOLERANCES = (1.0, 0.5, 0.1)
SCAN = 1.0


def missing() -> str:
    """Why this peer cannot run here; empty if it can."""
    try:
        importlib.import_module("numba")
    except ImportError:
        return "not installed"
    return ""


@cache
def _compiled() -> Any:
    """Compile, once per process."""
    numba = importlib.import_module("numba")
    law = numba.njit(walk)

    @numba.njit(inline="always")
    def free(d, w, a, b, c, s, omega, t, drive_cos, drive_sin):  # type: ignore[no-untyped-def]
        """Displacement and velocity of one body at time t of its flight."""
        e = math.exp(-d * t) if d > 0.0 else 1.0
        cos, sin = math.cos(w * t), math.sin(w * t)
        x = e * (a * cos + b * sin)
        v = e * w * (b * cos - a * sin) - d * x
        return (
            x + c * drive_cos + s * drive_sin,
            v + omega * (s * drive_cos - c * drive_sin),
        )

    @numba.njit
    def state(flight, t):  # type: ignore[no-untyped-def]
        d1, w1, a1, b1, c1, s1, d2, w2, a2, b2, c2, s2, omega, psi = flight
        drive_cos, drive_sin = math.cos(omega * t + psi), math.sin(omega * t + psi)
        x1, v1 = free(d1, w1, a1, b1, c1, s1, omega, t, drive_cos, drive_sin)
        x2, v2 = free(d2, w2, a2, b2, c2, s2, omega, t, drive_cos, drive_sin)
        return x1, v1, x2, v2

    @numba.njit
    def gap(flight, delta, t):  # type: ignore[no-untyped-def]
        x1, v1, x2, v2 = state(flight, t)
        return math.sin(x1) - x2 - delta, v1 * math.cos(x1) - v2

    @numba.njit
    def begin(system, t_of_period, x1, v1, x2, v2):  # type: ignore[no-untyped-def]
        """Constants of the flight from a state; the responses do not change."""
        d1, w1, c1, s1, d2, w2, c2, s2, omega, phase = system
        psi = omega * t_of_period + phase
        cos, sin = math.cos(psi), math.sin(psi)
        a1 = x1 - c1 * cos - s1 * sin
        b1 = (v1 - omega * (s1 * cos - c1 * sin) + d1 * a1) / w1
        a2 = x2 - c2 * cos - s2 * sin
        b2 = (v2 - omega * (s2 * cos - c2 * sin) + d2 * a2) / w2
        return (d1, w1, a1, b1, c1, s1, d2, w2, a2, b2, c2, s2, omega, psi)

    @numba.njit
    def root(flight, delta, low, high):  # type: ignore[no-untyped-def]
        """Zero of g between g < 0 and g > 0: Newton's method, bisection where it leaves."""
        t = 0.5 * (low + high)
        for _ in range(100):
            g, rate = gap(flight, delta, t)
            if g > 0.0:
                high = t
            else:
                low = t
            after = t - g / rate if rate > 0.0 else low - 1.0
            if not low <= after <= high:
                after = 0.5 * (low + high)
            if abs(after - t) <= 4e-16 * (1.0 + t):
                return after
            t = after
        return t

    @numba.njit
    def turn(flight, delta, low, high, sign):  # type: ignore[no-untyped-def]
        """Where g' changes sign, by bisection."""
        for _ in range(40):
            t = 0.5 * (low + high)
            if sign * gap(flight, delta, t)[1] > 0.0:
                low = t
            else:
                high = t
        return 0.5 * (low + high)

    @numba.njit
    def contact(flight, delta, longest, step):  # type: ignore[no-untyped-def]
        """Time of the first contact within the longest time, or -1."""
        t = 0.0
        g, rate = gap(flight, delta, 0.0)
        while t < longest:
            after = min(t + step, longest)
            g_after, rate_after = gap(flight, delta, after)
            top = after
            # A hump between samples lies below the tangents at both.
            hump = g_after <= 0.0 and rate > 0.0 >= rate_after
            if hump and g + rate * (after - t) > 0.0 and g_after - rate_after * (after - t) > 0.0:
                top = turn(flight, delta, t, after, 1.0)
                g_after = gap(flight, delta, top)[0]
            if g_after > 0.0:
                low = t
                if t == 0.0 and rate < 0.0:
                    # After an impact: from the bottom of this short flight.
                    low = turn(flight, delta, t, top, -1.0)
                return root(flight, delta, low, top)
            t, g, rate = after, g_after, rate_after
        return -1.0

    @numba.njit
    def run(  # type: ignore[no-untyped-def]
        system, impact, initial, scan, periods, keep, samples, sections, rows, most
    ):
        mbar, r, mu, delta = impact
        omega = system[8]
        period = 2.0 * math.pi / omega
        step = scan / max(system[1], system[5], omega)
        x1, v1, x2, v2 = initial
        # Times are counted from the start of the present drive period.
        start, k, impacts, kept, false_events, row = 0.0, 0, 0, 0, 0, 0
        flight = begin(system, start, x1, v1, x2, v2)
        while k < periods:
            longest = (periods - k) * period - start
            tau = contact(flight, delta, longest, step)
            last = tau if tau >= 0.0 else longest * (1.0 + 1e-14)
            if k + (start + last) / period > periods - keep:
                # Sections between here and the contact.
                while row < keep * samples:
                    at = (periods - keep - k + (row + 1) / samples) * period - start
                    if at > last:
                        break
                    if at >= 0.0:
                        s = state(flight, at)
                        for i in range(4):
                            rows[row, i] = s[i]
                    row += 1
            if tau < 0.0:
                break
            x1, v1, x2, v2 = state(flight, tau)
            if v1 * math.cos(x1) - v2 > 0.0:
                if k + (start + tau) / period > periods - keep:
                    phase = (flight[13] + omega * tau) % (2.0 * math.pi)
                    sections[kept, 0], sections[kept, 1] = x1, v1
                    sections[kept, 2], sections[kept, 3] = v2, phase
                    kept += 1
                v1, v2 = law(mbar, r, mu, math.cos(x1), math.sin(x1), v1, v2)
                impacts += 1
            else:
                false_events += 1
            start += tau
            whole = int(start / period)
            k, start = k + whole, start - whole * period
            flight = begin(system, start, x1, v1, x2, v2)
            if impacts + false_events >= most:
                return impacts, kept, false_events, False
        return impacts, kept, false_events, True

    return run


def prepare(problem: Problem, tolerance: float = SCAN) -> Solve:
    """Return what solves the problem at given drive frequencies."""
    run = _compiled()
    p = problem.parameters
    d1 = p["pendulum_damping"] * p["frequency_ratio"]
    d2 = p["oscillator_damping"]
    w1, w2 = math.sqrt(p["frequency_ratio"] ** 2 - d1**2), math.sqrt(1.0 - d2**2)
    impact = tuple(p[name] for name in ("mass_ratio", "restitution", "friction", "gap"))

    def response(natural: float, d: float, f: float, omega: float) -> tuple[float, float]:
        stiff, damped = natural**2 - omega**2, 2.0 * d * omega
        if f == 0.0:
            return 0.0, 0.0
        size = stiff**2 + damped**2
        return f * stiff / size, f * damped / size

    def solve_one(omega: float, periods: int, keep: int, samples: int) -> Outcome:
        first = response(p["frequency_ratio"], d1, p["moment_amplitude"], omega)
        second = response(1.0, d2, p["force_amplitude"], omega)
        system = (d1, w1, *first, d2, w2, *second, omega, p.get("phase", 0.0))
        most = most_impacts(periods)
        sections, rows = np.empty((most, 4)), np.empty((keep * samples, 4))
        impacts, kept, false_events, finished = run(
            system, impact, problem.initial, tolerance, periods, keep, samples, sections, rows, most
        )
        return Outcome(
            stroboscopic=rows,
            impact_section=sections[:kept],
            impacts=impacts,
            false_events=false_events,
            penetration=penetration(rows, p["gap"]) if finished else 0.0,
            ended="" if finished else "too many contacts",
        )

    solve = one_by_one(solve_one)
    # Compiled for these types now, outside of what is timed.
    solve([problem.frequency], 1, 1)
    return solve

"""Writes tests/data/bench_scenes.json: runs in 60-digit arithmetic for the benchmarks.

    python benches/reference_runs.py            # some minutes; needs mpmath

- ``graze_D``: after a few impacts the gap has a hump of height about D above 0, which a solver
  that looks at the ends of its steps does not see; ``graze_below_D``: as far below 0, no contact.
  The gap delta is solved for and then rounded to float64; the run is that of the rounded value.
- ``fig7b_OMEGA``: the damped system of Fig. 7(b) at some frequencies of its sweep.

Flights are closed forms (0 < zeta < 1). Contacts: the gap is sampled at steps of 0.01, far below
any time in which these gaps turn twice; where it turns downwards between samples its top is found,
so that no pair of crossings is lost; roots by bisection and Newton's method to 55 digits.
Independent of the core, and of tests/reference, which encloses other runs in ball arithmetic.
"""

import argparse
import json
from pathlib import Path
from typing import Any

import mpmath as mp
import numpy as np

from peers.law import walk

OUT = Path(__file__).parents[1] / "tests" / "data" / "bench_scenes.json"
STEP = "0.01"
DIGITS = 60
PRINTED = 25
# Perturbation of v1(0) by which the amplification is measured.
NUDGE = "1e-30"

PAPER = {"mbar": "0.6", "omega0": "2", "r": "0.8", "mu": "0", "f1": "1", "f2": "0.5"}
DAMPED = {**PAPER, "delta": "0.5", "zeta1": "0.1", "zeta2": "0.1"}
# Of the frequencies of the sweep in bars.py.
SWEEP = tuple(repr(omega) for omega in np.linspace(0.6, 3.0, 1000)[:800:200].tolist())
SWEEP_PERIODS = 25

GRAZING = {**PAPER, "zeta1": "0.02", "zeta2": "0.01", "f2": "0.2", "omega": "1.6"}
GRAZING_PERIODS = 10
# The hump is that of the first flight after this time.
GRAZING_AFTER = 24
HEIGHTS = {"graze_1e-4": "1e-4", "graze_1e-8": "1e-8", "graze_below_1e-8": "-1e-8"}


class Flight:
    """Free motion of both bodies from a state at time t0."""

    def __init__(self, p: dict[str, Any], t0: Any, state: Any) -> None:
        self.p, self.t0 = p, t0
        bodies = ((p["omega0"], p["zeta1"], p["f1"]), (mp.mpf(1), p["zeta2"], p["f2"]))
        self.bodies = []
        omega, psi = p["omega"], p["omega"] * t0
        for (w, zeta, f), x, v in zip(bodies, state[0::2], state[1::2], strict=True):
            response = f / mp.mpc(w * w - omega * omega, 2 * zeta * w * omega)
            # x = Re(response e^(i psi)) + e^(-d t) Re(free e^(i wd t))
            forced = response * mp.expjpi(psi / mp.pi)
            d, wd = zeta * w, w * mp.sqrt(1 - zeta * zeta)
            x0, v0 = x - forced.real, v - (1j * omega * forced).real
            self.bodies.append((mp.mpc(x0, -(v0 + d * x0) / wd), mp.mpc(-d, wd), forced))

    def state(self, t: Any) -> list[Any]:
        """(x1, x1', x2, x2') at a time."""
        tau = t - self.t0
        turn = mp.expjpi(self.p["omega"] * tau / mp.pi)
        state = []
        for free, rate, forced in self.bodies:
            a, b = free * mp.exp(rate * tau), forced * turn
            state += [(a + b).real, (a * rate + 1j * self.p["omega"] * b).real]
        return state

    def gap(self, t: Any) -> tuple[Any, Any]:
        """Return g and g'."""
        x1, v1, x2, v2 = self.state(t)
        return mp.sin(x1) - x2 - self.p["delta"], v1 * mp.cos(x1) - v2

    def root(self, low: Any, high: Any, which: int) -> Any:
        """Zero of g (which = 0) or g' (1) in a bracket."""
        at_low = self.gap(low)[which]
        for _ in range(12):
            middle = (low + high) / 2
            if (self.gap(middle)[which] > 0) == (at_low > 0):
                low = middle
            else:
                high = middle
        # The tolerance is one of the square.
        tolerance = mp.mpf(10) ** (10 - 2 * mp.mp.dps)
        values = (low, high)
        return mp.findroot(lambda t: self.gap(t)[which], values, solver="anderson", tol=tolerance)

    def top(self, low: Any, high: Any) -> Any | None:
        """Return the time of the first hump of g in the interval, None if there is none."""
        t, step = low, mp.mpf(STEP)
        rate = self.gap(t)[1]
        while t < high:
            after = min(t + step, high)
            rate_after = self.gap(after)[1]
            if rate > 0 >= rate_after:
                return self.root(t, after, 1)
            t, rate = after, rate_after
        return None

    def contact(self, high: Any) -> Any | None:
        """First contact in (t0, high], None if there is none; g(t0) < 0, or g = 0 and g' < 0."""
        t, step = self.t0, mp.mpf(STEP)
        rate = self.gap(t)[1]
        while t < high:
            after = min(t + step, high)
            g_after, rate_after = self.gap(after)
            if g_after > 0:
                return self.root(self._inside(t, after), after, 0)
            if rate > 0 >= rate_after:
                top = self.root(t, after, 1)
                if self.gap(top)[0] > 0:
                    return self.root(self._inside(t, top), top, 0)
            t, rate = after, rate_after
        return None

    def _inside(self, low: Any, high: Any) -> Any:
        """Time in an interval at which g < 0: its start, or the bottom after an impact."""
        if low > self.t0 or self.gap(low)[1] >= 0:
            return low
        return self.root(low, high, 1)


def run(p: dict[str, Any], initial: Any, periods: int) -> tuple[list[Any], list[Any]]:
    """Impacts (time, state before, state after) and the states at the ends of the periods."""
    period = 2 * mp.pi / p["omega"]
    flight, impacts, rows = Flight(p, mp.mpf(0), initial), [], []
    while len(rows) < periods:
        end = (len(rows) + 1) * period
        t = flight.contact(periods * period)
        while end <= (t or periods * period) and len(rows) < periods:
            rows.append(flight.state(end))
            end += period
        if t is None:
            break
        pre = flight.state(t)
        v1, v2 = walk(p["mbar"], p["r"], p["mu"], mp.cos(pre[0]), mp.sin(pre[0]), pre[1], pre[3])
        post = [pre[0], v1, pre[2], v2]
        impacts.append((t, pre, post))
        flight = Flight(p, t, post)
    return impacts, rows


def grazing_gap(height: str) -> str:
    """Return delta, as a float64, with which the hump has that height; g and delta move oppositely.

    Both the flights before the hump and its height depend on delta: the secant method, down to the
    spacing of float64.
    """
    initial = [mp.mpf(x) for x in ("0", "0.5", "0", "0")]

    def excess(delta: Any) -> Any:
        p = numbers({**GRAZING, "delta": repr(float(delta))})
        flight = Flight(p, mp.mpf(0), initial)
        while (t := flight.contact(mp.mpf(GRAZING_AFTER))) is not None:
            pre = flight.state(t)
            c, s = mp.cos(pre[0]), mp.sin(pre[0])
            v1, v2 = walk(p["mbar"], p["r"], p["mu"], c, s, pre[1], pre[3])
            flight = Flight(p, t, [pre[0], v1, pre[2], v2])
        top = flight.top(mp.mpf(GRAZING_AFTER), mp.mpf(GRAZING_AFTER + 3))
        return flight.gap(top)[0] - mp.mpf(height)

    root = mp.findroot(excess, (mp.mpf("0.51"), mp.mpf("0.52")), solver="secant", tol=1e-26)
    return repr(float(root))


def numbers(parameters: dict[str, str]) -> dict[str, Any]:
    """Parameters as exact values: of floats where they are rounded floats."""
    return {name: mp.mpf(float(text)) for name, text in parameters.items()}


def entry(parameters: dict[str, str], periods: int) -> dict[str, Any]:
    """One scene as it is stored, in the form of paper_scenes.json."""
    p, initial = numbers(parameters), [mp.mpf(x) for x in ("0", "0.5", "0", "0")]
    impacts, rows = run(p, initial, periods)
    nudged = [initial[0], initial[1] + mp.mpf(NUDGE), *initial[2:]]
    others = run(p, nudged, periods)[1]
    growth = [
        mp.sqrt(sum((a - b) ** 2 for a, b in zip(row, other, strict=True))) / mp.mpf(NUDGE)
        for row, other in zip(rows, others, strict=True)
    ]
    period = 2 * mp.pi / p["omega"]
    return {
        "params": parameters,
        "phase": "0",
        "initial": ["0", "0.5", "0", "0"],
        "periods": periods,
        "impacts": [
            {"period": int(t / period), "t": text(t), "approach_velocity": text(_approach(pre))}
            for t, pre, _ in impacts
        ],
        "stroboscopic": [[text(x) for x in row] for row in rows],
        "amplification": [float(mp.nstr(g, 3)) for g in growth],
    }


def _approach(pre: Any) -> Any:
    return pre[1] * mp.cos(pre[0]) - pre[3]


def text(x: Any) -> str:
    """Return a number as it is printed."""
    return str(mp.nstr(x, PRINTED))


def main() -> None:
    """Compute all scenes and write them."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path, default=OUT)
    options = parser.parse_args()
    mp.mp.dps = DIGITS
    scenes = {
        name: entry({**GRAZING, "delta": grazing_gap(height)}, GRAZING_PERIODS)
        for name, height in HEIGHTS.items()
    }
    for omega in SWEEP:
        scenes[f"fig7b_{float(omega):.2f}"] = entry({**DAMPED, "omega": omega}, SWEEP_PERIODS)
    options.out.write_text(json.dumps(scenes, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()

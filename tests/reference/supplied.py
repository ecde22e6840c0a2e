"""Compares enclosed runs with the supplied reference data, digit by digit.

    python -m reference.supplied        (in tests/; every scene of paper_scenes.json, random.json)

Ends with status 1 if a printed number may be off by more than rounding to its last digit.

All quantities are dimensionless.
"""

from __future__ import annotations

import json
import sys
import time as clock
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from flint import arb, ctx, fmpq

from vibroimpact.reference.flight import System, ball, exact
from vibroimpact.reference.simulate import Run, simulate

DATA = Path(__file__).resolve().parents[1] / "data"
#: Half a unit is that of rounding; the enclosures have a width, too.
LARGEST_UNITS = 0.6


def units(value: arb, text: str) -> float:
    """Largest distance of an enclosure from a printed decimal, in units of its last digit."""
    if exact(text) == 0:
        text = "0." + 25 * "0"  # an exact zero is printed as 0 or 0e-119
    digits, _, exponent = text.lower().partition("e")
    places = len(digits.partition(".")[2])
    last = arb(fmpq(10)) ** (int(exponent or 0) - places)
    return float((abs(value - ball(exact(text))) / last).abs_upper())


def compare(scene: Mapping[str, Any], precision: int = 600) -> tuple[Run, float]:
    """Run a scene of the reference data; the worst difference in units of the last digit.

    Raises AssertionError if the number of impacts, a period or a regime differs.
    """
    run = simulate(
        System.parse(scene["params"]),
        scene["initial"],
        periods=scene["periods"],
        phase=scene["phase"],
        precision=precision,
    )
    sequence = [(event.period, event.regime) for event in run.impacts]
    expected = [(impact["period"], impact["regime"]) for impact in scene["impacts"]]
    if sequence != expected:
        raise AssertionError(f"sequence of impacts: {sequence} against {expected}")
    pairs: list[tuple[arb, str]] = []
    for event, impact in zip(run.impacts, scene["impacts"], strict=True):
        pairs.append((event.time, impact["t"]))
        names = ("x1", "v1_pre", "x2", "v2_pre", "v1_post", "v2_post")
        pairs += [(getattr(event, name), impact[name]) for name in names]
    for state, printed in zip(run.stroboscopic, scene["stroboscopic"], strict=True):
        pairs += zip(state, printed, strict=True)
    with ctx.workprec(precision):
        return run, max(units(value, text) for value, text in pairs)


def main() -> int:
    """Compare every scene of paper_scenes.json and random.json; one line each."""
    wrong = 0
    for name in ("paper_scenes.json", "random.json"):
        scenes = json.loads((DATA / name).read_text())
        items = scenes.items() if isinstance(scenes, dict) else enumerate(scenes)
        for label, scene in items:
            began = clock.perf_counter()
            run, worst = compare(scene)
            seconds = clock.perf_counter() - began
            wrong += worst > LARGEST_UNITS
            print(f"{name} {label}: {len(run.impacts)} impacts, {worst:.2f} units, {seconds:.2f} s")
    return int(wrong > 0)


if __name__ == "__main__":
    sys.exit(main())

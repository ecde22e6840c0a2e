"""Event loop in ball arithmetic: every impact and every stroboscopic state, enclosed.

Flights, contacts and impacts follow docs/theory.md, sections 2 to 4; T = 2 pi/omega is the drive
period, counted exactly. Complete chatter runs into the impact cap; hybrid.py goes on through it,
without enclosing the result. All quantities are dimensionless; a result is as narrow as the
motion's growth allows, and an event the precision does not decide raises `Undecided`.

Run `python -m reference.simulate` (in tests/) to compare with the reference data in tests/data.
"""

from __future__ import annotations

import json
import sys
import time as clock
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from flint import arb, ctx, fmpq

from .contact import Undecided, first_contact
from .flight import Flight, Number, State, System, Value, ball, exact, rational
from .impact import LAWS

DATA = Path(__file__).resolve().parents[1] / "data"


@dataclass(frozen=True)
class Event:
    """One impact: completed periods, time, common position data, velocities before and after."""

    period: int
    time: arb
    x1: arb
    v1_pre: arb
    x2: arb
    v2_pre: arb
    v1_post: arb
    v2_post: arb
    regime: str


@dataclass(frozen=True)
class Run:
    """Impacts in order; stroboscopic[k - 1] is the state (x1, v1, x2, v2) at t = k T."""

    impacts: list[Event]
    stroboscopic: list[State]


def simulate(
    system: System,
    initial: Sequence[Number],
    *,
    periods: int,
    phase: Number = 0,
    precision: int = 400,
    law: str = "poisson",
    max_impacts: int = 100_000,
) -> Run:
    """Follow the motion from `initial` = (x1, v1, x2, v2), g < 0, for whole drive periods.

    Raises
    ------
    ValueError : omega = 0, or an inadmissible start
    Undecided : a contact, a regime or the order of two events is not decided at this precision
    RuntimeError : more than `max_impacts` impacts
    """
    if system.omega == 0:
        raise ValueError("omega = 0 has no drive period")
    with ctx.workprec(precision):
        return _run(system, initial, periods, phase, precision, law, max_impacts)


def _run(
    system: System,
    initial: Sequence[Number],
    periods: int,
    phase: Number,
    precision: int,
    law: str,
    max_impacts: int,
) -> Run:
    start_phase, omega = exact(phase), arb(system.omega)
    period = 2 * arb.pi() / omega
    now, touching = arb(0), 0
    values: list[Value] = [exact(value) for value in initial]
    run = Run([], [])
    while True:
        psi: Value = start_phase if touching == 0 else arb(start_phase) + omega * now
        flight = Flight(system, (values[0], values[1], values[2], values[3]), psi)
        rest = rational((periods * period - now).upper())
        found = first_contact(flight, rest, touching=touching, precision=precision, cap=precision)
        if found.kind in ("undecided", "immediate"):
            raise Undecided(f"{found.kind} contact after {len(run.impacts)} impacts")
        then = None if found.time is None else now + found.time
        while len(run.stroboscopic) < periods:
            section = (len(run.stroboscopic) + 1) * period
            if then is not None and not _before(section, then):
                break
            run.stroboscopic.append(flight.state(section - now))
        if then is None or found.time is None or len(run.stroboscopic) == periods:
            return run
        if len(run.impacts) == max_impacts:
            raise RuntimeError(f"more than {max_impacts} impacts by t = {then.str(10)}")
        x1, v1, _, v2 = flight.state(found.time)
        outcome = LAWS[law](system, x1, v1, v2)
        x2 = system.tip(x1) - ball(system.delta)
        run.impacts.append(
            Event(
                len(run.stroboscopic), then, x1, v1, x2, v2, outcome.v1, outcome.v2, outcome.regime
            )
        )
        now, values = then, [x1, outcome.v1, x2, outcome.v2]
        touching = 2 if system.r == 0 else 1


def _before(a: arb, b: arb) -> bool:
    """Whether a < b, certified either way."""
    if a < b:
        return True
    if a > b:
        return False
    raise Undecided("an impact at the end of a period")


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
    for name in ("paper_scenes.json", "random.json"):
        scenes = json.loads((DATA / name).read_text())
        items = scenes.items() if isinstance(scenes, dict) else enumerate(scenes)
        for label, scene in items:
            began = clock.perf_counter()
            run, worst = compare(scene)
            seconds = clock.perf_counter() - began
            print(f"{name} {label}: {len(run.impacts)} impacts, {worst:.2f} units, {seconds:.2f} s")
    return 0


if __name__ == "__main__":
    sys.exit(main())

"""Event loop in ball arithmetic: every impact and every stroboscopic state, enclosed.

Flights, contacts and impacts follow the theory page, sections 2 to 4; T = 2 pi/omega is the drive
period, counted exactly. Complete chatter runs into the impact cap; hybrid.py goes on through it,
without enclosing the result. All quantities are dimensionless; a result is as narrow as the
motion's growth allows, and an event the precision does not decide raises `Undecided`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from flint import arb, ctx

from .contact import Undecided, first_contact
from .flight import Flight, Number, State, System, Value, ball, exact, rational
from .impact import LAWS


@dataclass(frozen=True)
class Event:
    """One impact: completed periods, time, position, velocities before and after, impulse P."""

    period: int
    time: arb
    x1: arb
    v1_pre: arb
    x2: arb
    v2_pre: arb
    v1_post: arb
    v2_post: arb
    regime: str
    impulse: arb | None = None


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
                len(run.stroboscopic),
                then,
                x1,
                v1,
                x2,
                v2,
                outcome.v1,
                outcome.v2,
                outcome.regime,
                outcome.impulse,
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

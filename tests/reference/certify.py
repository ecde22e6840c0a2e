"""Certifies first contacts found by another program, flight by flight, in ball arithmetic.

    python -m reference.certify FLIGHTS.csv [--sample N --seed S] [--limit L]      (in tests/)

The CSV has the columns of COLUMNS; its numbers are float64, in C99 hex or the shortest decimal
that reads back as the same bits, and those bits are taken as exact. touching = 1:
g(0) = 0 by definition (x2 := sin x1 - delta, direct x1 - delta, without rounding), g'(0) < 0.
phase0 is the forcing phase at the start, found the time of contact, `none` or `graze`.

Verdicts: agree (the found time lies on the certified contact's rising branch: g' > 0 between them,
by proof); inaccurate (agree, but the error exceeds the limit); graze (the hump's height is below
eps (64 (|sin x1| + |x2| + |delta|) + 32 V t), V a bound of |g'|: either way counts); end (contact
within rounding of t_end); missed, later, earlier, spurious (disagreements); invalid (inadmissible
start). Errors in time are given in units of eps/min(1, u), u the approach velocity (docs/theory.md,
section 3).
"""

from __future__ import annotations

import argparse
import cmath
import csv
import math
import random
import sys
from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path

from flint import arb, arb_poly, ctx, fmpq

from vibroimpact.reference.contact import ORDER, Contact, first_contact, top_near
from vibroimpact.reference.flight import Flight, System, as_float, ball, exact, rational

PARAMETERS = (
    *("mbar", "omega0", "r", "delta", "zeta1", "zeta2", "f1", "f2", "c1", "c2", "omega", "mu"),
)
START = ("x1", "v1", "x2", "v2", "phase0")
COLUMNS = ("id", *PARAMETERS, "contact", "touching", *START, "t_end", "found")
EPS = 2.0**-52
GRAZE = 64  # heights below so many eps times the size of the terms of g are grazes,
GRAZE_RATE = 32  # and so many eps V t more: docs/contact-detection.md, rounding level
TURNS = 2  # of the fastest of bodies and drive, the longest flight for which V is taken
PRECISION = 128
DISAGREE = ("missed", "later", "earlier", "spurious", "inaccurate", "invalid")


@dataclass(frozen=True)
class Verdict:
    """Judgement of one flight; errors are NaN-free and zero where they do not apply."""

    kind: str
    certified: str
    time_error: float = 0.0
    residual: float = 0.0


@dataclass
class Report:
    """Counts, worst errors (with the flight's id) and the rows that disagree."""

    counts: Counter[str] = field(default_factory=Counter)
    worst_time: tuple[float, str] = (0.0, "")
    worst_gap: tuple[float, str] = (0.0, "")
    listed: list[str] = field(default_factory=list)

    def add(self, row: Mapping[str, str], verdict: Verdict) -> None:
        """Count one flight."""
        name = row["id"]
        self.counts[verdict.kind] += 1
        if verdict.kind in ("agree", "inaccurate"):
            self.worst_time = max(self.worst_time, (verdict.time_error, name))
            self.worst_gap = max(self.worst_gap, (verdict.residual, name))
        if verdict.kind in DISAGREE:
            self.listed.append(
                f"{name}: {verdict.kind}, found {row['found']}, certified {verdict.certified}"
            )

    def __str__(self) -> str:
        lines = [f"flights {self.counts.total()}"]
        lines += [f"{kind} {self.counts[kind]}" for kind in ("agree", "graze", "end", *DISAGREE)]
        lines.append("worst time error {:.3g} eps/min(1, u) (id {})".format(*self.worst_time))
        lines.append("worst |g| at the found time {:.3g} (id {})".format(*self.worst_gap))
        return "\n".join(lines + self.listed)


def certify(rows: Iterable[Mapping[str, str]], limit: float = 1000.0) -> Report:
    """Judge every row; `limit`: time errors above it, in eps max(1, t)/min(1, u), are listed."""
    report = Report()
    with ctx.workprec(PRECISION):
        for row in rows:
            report.add(row, judge(row, limit))
    return report


def judge(row: Mapping[str, str], limit: float) -> Verdict:
    """Judge one flight."""
    flight, end = _flight(row), _read(row, "t_end")
    touching = int(row["touching"])
    try:
        certified = first_contact(flight, end, touching=touching, precision=PRECISION)
    except ValueError as error:
        return Verdict("invalid", str(error))
    text: str = certified.kind
    if certified.time is not None:
        text += f" {certified.time.str(25)}"
    if certified.kind == "immediate":
        return Verdict("invalid", text)
    if row["found"] == "graze" or certified.kind == "undecided":
        return Verdict("graze" if _near_graze(flight, certified) else "spurious", text)
    found = None if row["found"] == "none" else _read(row, "found")
    if found is None:
        return _judge_none(flight, certified, end, text)
    return _judge_time(flight, certified, found, end, limit, text)


def _judge_none(flight: Flight, certified: Contact, end: fmpq, text: str) -> Verdict:
    """No contact was found."""
    if certified.time is None:
        return Verdict("agree", text)
    if _is_graze(flight, certified.time):
        return Verdict("graze", text)
    return Verdict("end" if _at_end(certified, end) else "missed", text)


def _judge_time(
    flight: Flight, certified: Contact, found: fmpq, end: fmpq, limit: float, text: str
) -> Verdict:
    """A contact was found at the time `found`."""
    residual = float(abs(flight.gap(found)).abs_upper())
    if certified.time is not None and certified.u is not None:
        distance = abs(certified.time - arb(found))
        error = float((distance * certified.u.min(arb(1))).abs_upper()) / EPS
        if _same_branch(flight, certified.time, found):
            inaccurate = error > limit * max(1.0, float(found))
            return Verdict("inaccurate" if inaccurate else "agree", text, error, residual)
        if _is_graze(flight, certified.time):
            return Verdict("graze", text)
    if _is_graze(flight, arb(found)):
        return Verdict("graze", text)
    if certified.time is None:
        slack = exact(limit * EPS) * max(fmpq(1), end)
        return Verdict("end" if abs(found - end) < slack else "spurious", text)
    return Verdict("later" if arb(found) > certified.time else "earlier", text)


def _flight(row: Mapping[str, str]) -> Flight:
    """The flight of one row, exactly."""
    parameters = {key: as_float(row[key]) for key in PARAMETERS}
    x2 = None if int(row["touching"]) else _read(row, "x2")
    start = (_read(row, "x1"), _read(row, "v1"), x2, _read(row, "v2"))
    return Flight(System.parse(parameters, row["contact"]), start, _read(row, "phase0"))


def _read(row: Mapping[str, str], key: str) -> fmpq:
    """The float64 in one column, exactly."""
    return exact(as_float(row[key]))


def _same_branch(flight: Flight, root: arb, found: fmpq) -> bool:
    """Whether g' > 0 between the root and the found time, by proof."""
    hull = root.union(arb(found))
    middle, half = rational(hull.mid()), rational(hull.rad())
    if half * fmpq(round(1024 * flight.rate), 1024) > 1:
        return False
    slope = arb_poly(flight.gap_series(middle, half, ORDER)).derivative()
    return bool(slope(arb(0, arb(half))) > 0)


def _is_graze(flight: Flight, near: arb) -> bool:
    """Whether the maximum of g next to a time is within the graze threshold of 0."""
    top = top_near(flight, rational(near.mid()))
    return top is not None and _below_threshold(flight, *top)


def _near_graze(flight: Flight, certified: Contact) -> bool:
    """Whether the flight has a hump within the threshold, up to its first contact."""
    if certified.kind == "undecided":
        return True
    if any(
        _below_threshold(flight, rational(hump.time.mid()), hump.height) for hump in certified.humps
    ):
        return True
    return certified.time is not None and _is_graze(flight, certified.time)


def _below_threshold(flight: Flight, time: fmpq, height: arb) -> bool:
    """|height| < eps (64 (|sin x1| + |x2| + |delta|) + 32 V t) with the state at `time`."""
    x1, _, x2, _ = flight.state(time)
    size = abs(flight.system.tip(x1)) + abs(x2) + abs(arb(flight.system.delta))
    level = GRAZE * size + GRAZE_RATE * _rate_bound(flight) * arb(time)
    return bool(abs(height) < arb(exact(EPS)) * level)


def _rate_bound(flight: Flight) -> float:
    """V >= |g'| over a flight of TURNS turns, from the state at its start.

    For each body the lesser of two bounds, since the energy of a free oscillation does not grow
    and a load adds |f| per unit time: |(v, w x)| + |f| T of the motion itself, and that of the
    motion about the steady response P e^{i psi}, plus |P| omega. Under a constant load c the motion
    is about its equilibrium, or c adds |c| T where the spring is too weak for that.
    """
    system, phase = flight.system, float(ball(flight.phase))
    omega = float(system.omega)
    span = TURNS * 2 * math.pi / max(float(system.omega0), omega, 1.0)
    x1, v1, x2, v2 = (float(value) for value in flight.start())
    total = 0.0
    for body, x, v in zip(system.bodies(), (x1, x2), (v1, v2), strict=True):
        w, zeta, f, c = (float(value) for value in (body.omega0, body.zeta, body.f, body.c))
        stiffness = complex((w - omega) * (w + omega), 2 * zeta * w * omega)
        held = w * span >= max(1.0, 2.0 * zeta)
        place, loaded = (x - c / w**2, 0.0) if held else (x, abs(c) * span)
        bound = math.hypot(v, w * place) + abs(f) * span
        if f != 0 and stiffness != 0:
            steady = f / stiffness * cmath.exp(1j * phase)
            free = math.hypot(v + omega * steady.imag, w * (place - steady.real))
            bound = min(bound, free + abs(steady) * omega)
        total += bound + loaded
    return total


def _at_end(certified: Contact, end: fmpq) -> bool:
    """Whether the certified contact lies within rounding of the end of the flight."""
    slack = exact(16 * EPS) * max(fmpq(1), end)
    return certified.time is not None and bool(certified.time > arb(end - slack))


def main() -> int:
    """Command line; exit status 1 if any flight disagrees."""
    parser = argparse.ArgumentParser(prog="python -m reference.certify")
    parser.add_argument("file", type=Path)
    parser.add_argument("--sample", type=int, help="judge only so many rows, drawn at random")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--limit", type=float, default=1000.0)
    options = parser.parse_args()
    with options.file.open(newline="") as stream:
        rows = list(csv.DictReader(stream))
    if not rows or set(rows[0]) != set(COLUMNS):
        parser.error(f"{options.file}: no flights, or columns other than {', '.join(COLUMNS)}")
    if options.sample is not None and options.sample < len(rows):
        rows = random.Random(options.seed).sample(rows, options.sample)
    report = certify(rows, options.limit)
    print(report)
    return 1 if report.listed else 0


if __name__ == "__main__":
    sys.exit(main())

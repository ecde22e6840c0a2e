"""Verify a branch: tubes that are joined, and what holds of the motions in them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

from flint import arb, ctx

from ..errors import ProofError
from .certificate import REGIMES, balls_of, exact, machine_in
from .formulas import Undecided
from .tube import TERMS, Family, Slice, Tube, image, point_at, slices

#: Parts of a tube that are looked at by themselves.
_MOST_SLICES = 64


@dataclass(frozen=True)
class Stretch:
    """Of each parameter between `lo` and `hi`, exclusive, one motion, with one verdict."""

    lo: arb
    hi: arb
    verdict: str
    stability: str
    why: str


@dataclass(frozen=True)
class Enclosed:
    """A bifurcation between two parameters."""

    kind: str
    lo: arb
    hi: arb
    why: str = ""


@dataclass(frozen=True)
class Open:
    """Parameters of which not everything is shown, and why."""

    lo: arb
    hi: arb
    why: str


def family_of(given: Mapping[str, Any]) -> Family:
    """The family of a certificate."""
    legs = tuple((stop, regime) for stop, regime in given["legs"])
    if not legs or any(regime not in REGIMES for _, regime in legs) or given["m"] not in range(1, 10**6):
        raise ProofError("legs or m")
    return Family(partial(machine_in, given["machine"], given["parameter"]), given["m"], legs)


def tube_in(given: Mapping[str, Any]) -> Tube:
    """A tube of a certificate."""
    line, radius = balls_of(given["line"]), balls_of(given["radius"])
    half = arb(exact(given["half"]))
    if not (half > 0 and all(r > 0 for r in radius)):
        raise ProofError("a tube without room")
    if not (2 <= len(line) <= TERMS and all(len(row) == len(radius) for row in line)):
        raise ProofError("a line of another size")
    return Tube(line, half, radius)


def examine_chain(given: Mapping[str, Any]) -> list[Slice]:
    """What is shown along a chain of tubes.

    Raises
    ------
    Undecided : a tube holds no branch, or two are not joined
    """
    with ctx.workprec(int(given["precision"])):
        family, told = family_of(given), []
        tubes = [tube_in(one) for one in given["tubes"]]
        counts = [one["slices"] for one in given["tubes"]]
        lo, before = -tubes[0].half, None
        for place, (tube, count) in enumerate(zip(tubes, counts, strict=True)):
            if count not in range(1, _MOST_SLICES + 1):
                raise ProofError("slices")
            found = image(family, tube)
            if not found.inside:
                raise Undecided("Krawczyk's operator does not contract in a tube")
            if before is not None:
                lo = joint(tube, before)
            hi = tube.half if place == len(tubes) - 1 else arb(exact(given["tubes"][place]["until"]))
            if not (lo < hi and hi <= tube.half):
                raise Undecided("two tubes are not joined")
            told += slices(family, tube, found, count, lo, hi)
            before = point_at(family, tube, found, hi)
        return told


def joint(tube: Tube, point: Sequence[arb]) -> arb:
    """Where along a tube a point of the branch lies that was reached by the tube before it."""
    h = tube.place(point)
    if h is None:
        raise Undecided("two tubes are not joined")
    return h


def summary(told: Sequence[Slice]) -> tuple[list[Stretch], list[Enclosed], list[Open]]:
    """Stretches of one verdict, the bifurcations between them, and what is open."""
    runs: list[list[Slice]] = []
    for one in told:
        key = (one.verdict, one.stability, one.rises)
        if runs and key == (runs[-1][0].verdict, runs[-1][0].stability, runs[-1][0].rises):
            runs[-1].append(one)
        else:
            runs.append([one])
    sure = [run[0].rises != 0 and run[0].verdict != "undecided" for run in runs]
    stretches, enclosed, left = [], [], []
    known: list[Slice] | None = None  # the last run of which all is shown
    between: list[Slice] = []
    for run, is_sure in zip(runs, sure, strict=True):
        if is_sure:
            ends = sorted((run[0].first, run[-1].last), key=lambda x: float(x.mid()))
            stretches.append(
                Stretch(ends[0].upper(), ends[1].lower(), run[0].verdict, run[0].stability, run[0].why)
            )
        if not is_sure or run[0].stability == "undecided":
            between += run
            if not is_sure:
                continue
        if run[0].stability == "undecided" and run[0].verdict == "proved":
            continue
        if known is not None:
            enclosed += _between(known[-1], run[0], between)
        known, between = run, []
    for run in runs:
        if not (run[0].rises != 0 and run[0].verdict != "undecided") or run[0].stability == "undecided":
            whole = _hull(run)
            why = run[0].why or ("the direction of the branch" if run[0].rises == 0 else "stability")
            left.append(Open(*whole, why))
    return stretches, enclosed, left


def _hull(run: Sequence[Slice]) -> tuple[arb, arb]:
    lows, highs = [x.whole.lower() for x in run], [x.whole.upper() for x in run]
    return min(lows, key=lambda x: float(x)), max(highs, key=lambda x: float(x))


def _between(one: Slice, other: Slice, open_ones: Sequence[Slice]) -> list[Enclosed]:
    """The bifurcations that must lie between two parts of which everything is shown."""
    where = _hull([one, *open_ones, other]) if not open_ones else _hull(open_ones)
    if one.rises == -other.rises:
        return [Enclosed("saddle_node", *where)]
    if one.verdict != other.verdict:
        why = one.why or other.why
        return [Enclosed("border", *where, why)]
    if one.at_minus_one == -other.at_minus_one != 0:
        return [Enclosed("period_doubling", *where)]
    if one.at_one == -other.at_one != 0:
        return [Enclosed("branch_point", *where)]
    if one.stability != other.stability:
        return [Enclosed("neimark_sacker", *where)]
    return []

"""Verify a branch: tubes that are joined, and what holds of the motions in them.

The arc of a branch in a tube goes on in the next one: the point at which the first is left lies
inside the second, where the solution in each plane is unique. Where the parameter rises all along
an arc, each of its values belongs to one point of the arc.
"""

from __future__ import annotations

import copy
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import groupby
from typing import Any

from flint import arb, ctx

from ..errors import ProofError
from ..system import SYMBOLS
from .certificate import exact, machine_in, numbers
from .formulas import REGIMES, Machine, Number, Undecided
from .tube import TERMS, Family, Slice, Tube, image, point_at, slices

#: Parts of a tube that are looked at by themselves.
_MOST_SLICES = 64
#: What is no parameter: matrices are exact.
_EXACT = ("mass", "stiffness", "damping", "damping_ratios")


@dataclass(frozen=True)
class Stretch:
    """Of each value of the parameter from `lo` to `hi` one solution, and one verdict."""

    lo: arb
    hi: arb
    verdict: str
    stability: str
    why: str


@dataclass(frozen=True)
class Between:
    """A bifurcation between two values of the parameter."""

    kind: str
    lo: arb
    hi: arb
    why: str


@dataclass(frozen=True)
class Shown:
    """What is shown along a chain, and reasons for what is not, with ranges of the parameter."""

    stretches: list[Stretch]
    bifurcations: list[Between]
    open: list[tuple[arb, arb, str]]
    whole: tuple[arb, arb] | None = None


def family_of(machine: Mapping[str, Any], place: Sequence[Any], piece: Mapping[str, Any]) -> Family:
    """The family of a piece of a certificate."""
    legs = tuple((stop, regime) for stop, regime in piece["legs"])
    count = 1 if machine["kind"] == "two bodies" else len(machine["stops"])
    known = all(regime in REGIMES and stop in range(count) for stop, regime in legs)
    if not (known and legs and piece["m"] in range(1, 10**6) and place):
        raise ProofError("legs, m or parameter")
    if machine["kind"] == "two bodies":
        # a wall at rest has no mass and no drive, whatever the value
        fixed = ("mbar", "f2") if machine["wall_rests"] else ()
        if len(place) != 1 or place[0] not in SYMBOLS or place[0] in fixed:
            raise ProofError("a parameter that is none")
    return Family(partial(machine_at, machine, place), piece["m"], legs)


def machine_at(machine: Mapping[str, Any], place: Sequence[Any], value: Number) -> Machine:
    """A machine with another value, a ball or a series, of the number at a place."""
    changed = copy.deepcopy({**machine})
    owner: Any = changed["numbers"] if machine["kind"] == "two bodies" else changed
    for step in place[:-1]:
        owner = owner[step]
    if place[0] in _EXACT or not isinstance(owner[place[-1]], str):
        raise ProofError("a parameter that is none")
    owner[place[-1]] = value
    return machine_in(changed)


def tube_in(given: Mapping[str, Any], size: int) -> Tube:
    """A tube of a certificate."""
    line, radius = numbers(given["line"], arb), numbers(given["radius"], arb)
    half = arb(exact(given["half"]))
    if not (half > 0 and all(r > 0 for r in radius) and len(radius) == size):
        raise ProofError("a tube without room")
    if not (2 <= len(line) <= TERMS and all(len(row) == size for row in line)):
        raise ProofError("a line of another size")
    return Tube(line, half, radius)


def examine_chain(
    machine: Mapping[str, Any], place: Sequence[Any], piece: Mapping[str, Any], precision: int
) -> Shown:
    """Find out what holds along a chain of tubes.

    Raises
    ------
    Undecided : a tube holds no branch, or two are not joined
    ProofError, KeyError, TypeError, ValueError : the certificate is damaged
    """
    with ctx.workprec(precision):
        family, told, before = family_of(machine, place, piece), [], None
        size = len(family.legs) * (2 * family.at(_own(machine, place)).machine.size + 1) + 1
        for given in piece["tubes"]:
            tube, count, until = tube_in(given, size), given["slices"], arb(exact(given["until"]))
            if count not in range(1, _MOST_SLICES + 1):
                raise ProofError("slices")
            found = image(family, tube)
            if not found.inside:
                raise Undecided("Krawczyk's operator does not contract in a tube")
            lo = -tube.half if before is None else tube.place(before)
            if lo is None or not (lo < until and until <= tube.half):
                raise Undecided("two tubes are not joined")
            told += slices(family, tube, found, count, lo, until)
            before = point_at(family, tube, found, until)
        return summary(told)


def _own(machine: Mapping[str, Any], place: Sequence[Any]) -> arb:
    """The value of the parameter in a machine."""
    owner: Any = machine["numbers"] if machine["kind"] == "two bodies" else machine
    for step in place:
        owner = owner[step]
    return arb(exact(owner))


def is_known(one: Slice) -> bool:
    """Whether everything is shown of a slice; of what is no motion stability is not asked."""
    steady = one.stability != "undecided" or one.verdict == "disproved"
    return one.verdict != "undecided" and one.rises != 0 and steady


def _key(one: Slice) -> tuple[str, str, int]:
    if one.verdict == "disproved":
        return one.verdict, "undecided", one.rises
    return one.verdict, one.stability, one.rises


def summary(told: Sequence[Slice]) -> Shown:
    """Stretches of one verdict, the bifurcations between them, and what is open."""
    runs = [list(run) for _, run in groupby(told, _key)]
    shown = Shown([], [], [], _hull(told) if told else None)
    last: Slice | None = None  # the last slice of which everything is shown
    between: list[Slice] = []
    for run in runs:
        first = run[0]
        if not is_known(first):
            between += run
            why = next((x.why for x in run if x.why), "")
            why = why or ("the direction of the branch" if first.rises == 0 else "stability")
            shown.open.append((*_hull(run), why))
        elif last is not None:
            if found := _bifurcation(last, first, between):
                shown.bifurcations.append(found)
            between = []
        if first.rises != 0 and first.verdict != "undecided":
            ends = (first.first, run[-1].last)
            low, high = ends if first.rises > 0 else ends[::-1]
            verdict, steady, _ = _key(first)
            why = first.why if verdict == "disproved" else ""
            shown.stretches.append(Stretch(low.upper(), high.lower(), verdict, steady, why))
        if is_known(first):
            last = run[-1]
    return shown


def _hull(run: Sequence[Slice]) -> tuple[arb, arb]:
    low = high = run[0].whole
    for one in run:
        low, high = low.min(one.whole.lower()), high.max(one.whole.upper())
    return low.lower(), high.upper()


def _bifurcation(one: Slice, other: Slice, between: Sequence[Slice]) -> Between | None:
    """What must lie between two slices of which everything is shown.

    The branch is a smooth curve through all tubes: a function that changes its sign vanishes.
    """
    where = _hull(between or [one, other])
    if one.rises == -other.rises:
        return Between("saddle_node", *where, "the parameter has an extremum")
    if one.verdict != other.verdict:
        beyond = one if one.verdict == "disproved" else other
        return Between(beyond.broken, *where, beyond.why)
    if one.verdict == "disproved":
        return None
    if one.at_minus_one == -other.at_minus_one != 0:
        return Between("period_doubling", *where, "a multiplier is -1")
    if one.at_one == -other.at_one != 0:
        return Between("branch_point", *where, "a multiplier is 1")
    if one.stability == other.stability:
        return None
    if all(x.at_one and x.at_minus_one for x in [one, *between, other]):
        return Between("neimark_sacker", *where, "two conjugate multipliers are on the unit circle")
    return Between("change_of_stability", *where, "a multiplier is on the unit circle")

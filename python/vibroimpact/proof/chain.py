"""Verify a branch: tubes that are joined, and what holds of the motions in them.

The arc of a branch in a tube goes on in the next one: the point where the first is left lies inside
the second, in each plane of which one solution lies. Where the parameter rises all along an arc,
each of its values belongs to one point.
"""

from __future__ import annotations

import copy
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from itertools import groupby, pairwise, product
from typing import Any

from flint import arb, ctx

from .certificate import machine_in, need, numbers
from .formulas import REGIMES, Number, Refuted, Undecided
from .parts import OPEN, UNDECIDED, Arc, Slice, border, multiplier
from .tube import TERMS, Family, Tube
from .verifier import CIRCUIT, CUTS, PASSED


@dataclass(frozen=True)
class Shown:
    """What is shown along a chain, by ranges of the parameter.

    `stretches`: of each value one solution, with one verdict. `events`: special points, each the
    only one of its part. `open`: what is not shown, and why; `ends`: the parts at both ends.
    """

    stretches: list[tuple[arb, arb, str, str, str]] = field(default_factory=list)
    events: list[tuple[arb, arb, str]] = field(default_factory=list)
    open: list[tuple[arb, arb, str]] = field(default_factory=list)
    ends: tuple[Slice, ...] = ()


def family_of(machine: Mapping[str, Any], place: Sequence[Any], piece: Mapping[str, Any]) -> Family:
    """The family of a piece of a certificate, over the number of a machine at a place."""
    m, legs = piece["m"], tuple((stop, regime) for stop, regime in piece["legs"])
    places = product(range(len(machine.get("stops", [0]))), (*REGIMES, PASSED))
    known = {*places, CIRCUIT} >= set(legs) and all(type(k) is int for k, _ in legs)
    need(known and legs and type(m) is int and 0 < m < 10**6, "legs, or m")
    need(CIRCUIT not in legs or all(x in CUTS for _, x in legs), "impacts in no motion without")
    path = ["numbers", *place] if machine["kind"] == "two bodies" else place
    return Family(lambda value: machine_in(changed(machine, path, value)), m, legs)


def changed(owner: Any, place: Sequence[Any], value: Number) -> Any:
    """A copy with another value at a place."""
    if not place:
        return value
    found = copy.copy(owner)
    found[place[0]] = changed(found[place[0]], place[1:], value)
    return found


def tube_in(given: Mapping[str, Any], size: int) -> tuple[Any, list[arb], Sequence[int]]:
    """A tube of a certificate, where its parts end, and in which to look for a special point."""
    line, radius, axis = numbers(given["line"], arb), numbers(given["radius"], arb), given["axis"]
    need(len(radius) == size and all(r > 0 for r in radius), "a tube without room")
    sound = 2 <= len(line) <= TERMS and all(len(row) == size for row in line)
    need(sound and type(axis) is int and 0 <= axis < size, "a line of another size")
    need(line[1][axis] != 0 and all(row[axis] == 0 for row in line[2:]), "a line that bends")
    return (line, radius, axis), numbers(given["cuts"], arb), given["asked"]


def examine_chain(
    machine: Mapping[str, Any], place: Sequence[Any], piece: Mapping[str, Any], precision: int
) -> Iterator[list[Slice]]:
    """What holds along each tube of a chain; raises Undecided if two are not joined."""
    need(type(precision) is int and 1 < precision < 10**5, "a precision that is none")
    with ctx.workprec(precision):
        family, before = family_of(machine, place, piece), None
        size = len(family.legs) * (2 * machine_in(machine).size + 1) + 1
        for tube, cuts, asked in [tube_in(given, size) for given in piece["tubes"]]:
            arc = Arc.of(Tube(family, *tube))
            lo = arb(-1) if before is None else arc.tube.place(before)
            if lo is None or not cuts or not cuts[-1] <= 1:
                raise Undecided("two tubes are not joined")
            need(all(a < b for a, b in pairwise([lo, *cuts])), "parts out of order")
            yield resolved(arc, [arc.look(a, b) for a, b in pairwise([lo, *cuts])], asked)
            before = arc.point(cuts[-1])


def resolved(arc: Arc, told: Sequence[Slice], asked: Sequence[int] = ()) -> list[Slice]:
    """The parts of a tube, where those about the only special point end at it."""
    told = [replace(x, stability=UNDECIDED) if k in asked else x for k, x in enumerate(told)]
    # first those between a motion and none, then all of which not everything is shown
    keys: list[Callable[[Slice], bool]] = [lambda x: x.verdict != "undecided", lambda x: x.known]
    for is_known in keys:
        groups = [list(run) for _, run in groupby(told, is_known)]
        for k in range(1, len(groups) - 1):
            # what follows a special point begins at it, and would tell of it again
            if not (is_known(groups[k][0]) or groups[k - 1][-1].special):
                with suppress(*OPEN, Refuted):
                    groups[k] = about(arc, groups[k - 1][-1], groups[k], groups[k + 1][0])
        told = [one for group in groups for one in group]
    return list(told)


def about(arc: Arc, one: Slice, between: list[Slice], other: Slice) -> list[Slice]:
    """Two parts that end at a special point, in the place of those between two others."""
    lo, hi, crosses = between[0].lo, between[-1].hi, one.verdict != other.verdict
    kind, value = (border if crosses else multiplier)(arc, lo, hi)
    # DF is singular, and a multiplier 1, where the parameter has an extremum, and there only
    turns, senses = kind == "saddle_node", {x.rises for x in (one, *between, other)}
    same = one.rises == -other.rises if turns else len(senses) == 1
    motions = crosses or all(x.verdict == "proved" for x in between)
    # two with the product 1 are on the circle if stability changes, else they may be real
    if not (same and motions and (kind != "neimark_sacker" or one.stability != other.stability)):
        raise Undecided("not the special point that it should be")
    halves = list[Slice]()
    for side, a, b in (one, between[0].first, value), (other, value, between[-1].last):
        kept = not crosses or all(x.stability == side.stability for x in between)
        part = replace(side, lo=lo, hi=hi, first=a, last=b, values=a.union(b), special="")
        halves.append(replace(part, stability=side.stability if kept else "undecided"))
    return [replace(halves[0], special=kind), halves[1]]


def summary(told: Sequence[Slice]) -> Shown:
    """Stretches of one verdict, the special points between them, and what is open."""
    shown = Shown(ends=(told[0], told[-1]))
    for _, run in groupby(told, lambda one: (one.verdict, one.stability, one.rises)):
        part = list(run)
        one, whys = part[0], list(dict.fromkeys(x.why for x in part if x.why))
        why = " or ".join(whys if one.verdict == "disproved" else whys[:1])
        if one.rises and one.verdict != "undecided":
            low, high = (one.first, part[-1].last)[:: one.rises]
            shown.stretches.append((low.upper(), high.lower(), one.verdict, one.stability, why))
        if not one.known:
            why = why or ("stability" if one.rises else "the direction of the branch")
            lows, highs = [x.values.lower() for x in part], [x.values.upper() for x in part]
            shown.open.append((min(lows), max(highs), why))
    shown.events.extend((x.last.lower(), x.last.upper(), x.special) for x in told if x.special)
    return shown

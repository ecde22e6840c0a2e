"""Verify a branch: tubes that are joined, and what holds of the motions in them.

The arc of a branch in a tube goes on in the next one: the point at which the first is left lies
inside the second, where the solution in each plane is unique. Where the parameter rises all along
an arc, each of its values belongs to one point of the arc.
"""

from __future__ import annotations

import copy
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from functools import partial
from itertools import groupby, pairwise
from typing import Any

from flint import arb, ctx

from ..system import SYMBOLS
from .certificate import exact, machine_in, need, numbers
from .formulas import REGIMES, Machine, Number, Undecided
from .parts import OPEN, Arc, Slice
from .special import Touch, border, multiplier
from .tube import TERMS, Family, Tube, image

#: Numbers of a structure that can be a parameter, and of one of its stops.
_NUMBERS, _OF_STOP = ("drive_frequency", "phase"), ("gap", "restitution", "friction")


@dataclass(frozen=True)
class Shown:
    """What is shown along a chain, by ranges of the parameter.

    `stretches`: of each value one solution, with one verdict. `events`: bifurcations, and whether
    it is only one. `open`: what is not shown, and why; `ends`: the parts at both ends.
    """

    stretches: list[tuple[arb, arb, str, str, str]] = field(default_factory=list)
    events: list[tuple[arb, arb, str, bool]] = field(default_factory=list)
    open: list[tuple[arb, arb, str]] = field(default_factory=list)
    ends: tuple[Slice, ...] = ()


def family_of(machine: Mapping[str, Any], place: Sequence[Any], piece: Mapping[str, Any]) -> Family:
    """The family of a piece of a certificate."""
    legs = tuple((stop, regime) for stop, regime in piece["legs"])
    bodies = machine["kind"] == "two bodies"
    stops = range(1 if bodies else len(machine["stops"]))
    known = all(regime in REGIMES and type(k) is int and k in stops for k, regime in legs)
    need(known and legs and type(piece["m"]) is int and 0 < piece["m"] < 10**6, "legs, or m")
    if bodies:
        # a wall at rest has no mass and no drive, whatever the value
        fixed = {"mbar", "f2"} if machine["wall_rests"] else set()
        sound = len(place) == 1 and place[0] in set(SYMBOLS) - fixed
    elif len(place) == 3:
        sound = place[0] == "stops" and type(place[1]) is int and place[1] in stops
        sound = sound and place[2] in _OF_STOP
    else:
        sound = len(place) == 1 and place[0] in _NUMBERS
    need(sound, "a parameter that is none")
    return Family(partial(machine_at, machine, place), piece["m"], legs)


def machine_at(machine: Mapping[str, Any], place: Sequence[Any], value: Number) -> Machine:
    """A machine with another value, a ball or a series, of the number at a place."""
    changed = copy.deepcopy({**machine})
    owner: Any = changed["numbers"] if machine["kind"] == "two bodies" else changed
    for step in place[:-1]:
        owner = owner[step]
    owner[place[-1]] = value
    return machine_in(changed)


def tube_in(given: Mapping[str, Any], size: int) -> tuple[Tube, list[arb], list[Touch]]:
    """A tube of a certificate, where its parts end, and touches in it."""
    line, radius = numbers(given["line"], arb), numbers(given["radius"], arb)
    half, touches = arb(exact(given["half"])), list[Touch]()
    need(half > 0 and len(radius) == size and all(r > 0 for r in radius), "a tube without room")
    sound = 2 <= len(line) <= TERMS and all(len(row) == size for row in line)
    need(sound, "a line of another size")
    for leg, stop, *times in given["touches"]:
        begin, end = numbers(times)
        need(type(leg) is type(stop) is int and min(leg, stop, begin) >= 0 < end - begin, "a touch")
        touches.append((leg, stop, arb((begin + end) / 2, (end - begin) / 2)))
    return Tube(line, half, radius), numbers(given["cuts"], arb), touches


def examine_chain(
    machine: Mapping[str, Any], place: Sequence[Any], piece: Mapping[str, Any], precision: int
) -> Shown:
    """Find out what holds along a chain of tubes.

    Raises
    ------
    Undecided : a tube holds no branch, or two are not joined
    ProofError, KeyError, TypeError, ValueError : the certificate is damaged
    """
    need(type(precision) is int and 1 < precision < 10**5, "a precision that is none")
    with ctx.workprec(precision):
        family, told, before = family_of(machine, place, piece), list[list[Slice]](), None
        size = len(family.legs) * (2 * machine_in(machine).size + 1) + 1
        for tube, cuts, touches in [tube_in(given, size) for given in piece["tubes"]]:
            arc = Arc.of(family, tube, image(family, tube))
            lo = -tube.half if before is None else tube.place(before)
            if lo is None or not cuts or not cuts[-1] <= tube.half:
                raise Undecided("two tubes are not joined")
            need(all(a < b for a, b in pairwise([lo, *cuts])), "parts out of order")
            told.append([arc.look(a, b) for a, b in pairwise([lo, *cuts])])
            told[-1] = resolved(arc, told[-1], touches)
            before = arc.point(cuts[-1])
        return summary([part for parts in told for part in parts])


def resolved(arc: Arc, told: Sequence[Slice], touches: Sequence[Touch]) -> list[Slice]:
    """The parts of a tube, where those about the only special point end at it."""
    for crosses, open_ in (
        (True, lambda x: x.verdict == "undecided"),
        (False, lambda x: not x.known),
    ):
        groups = [list(run) for _, run in groupby(told, open_)]
        for k in range(1, len(groups) - 1):
            one, other = groups[k - 1][-1], groups[k + 1][0]
            if open_(groups[k][0]) and crosses == (one.verdict != other.verdict):
                with suppress(*OPEN):
                    groups[k] = _about(arc, one, groups[k], other, touches)
        told = [one for group in groups for one in group]
    return list(told)


def _about(
    arc: Arc, one: Slice, between: list[Slice], other: Slice, touches: Sequence[Touch]
) -> list[Slice]:
    """Parts between two of which more is shown; two in their place if that is right."""
    lo, hi, crosses = between[0].lo, between[-1].hi, one.verdict != other.verdict
    found = border(arc, lo, hi, touches) if crosses else multiplier(arc, lo, hi)
    # DF is singular, and a multiplier 1, where the parameter has an extremum, and there only
    turns = found.kind == "saddle_node"
    if turns != (one.rises == -other.rises != 0):
        raise Undecided("a multiplier 1 where the parameter has no extremum")
    settled = found.clear if crosses else all(x.verdict == "proved" for x in between)
    if not settled or not (turns or {x.rises for x in (*between, other)} == {one.rises}):
        return [replace(between[0], special=found), *between[1:]]
    first, value, last = between[0].first, found.value, between[-1].last
    halves = list[Slice]()
    for side, a, b in ((one, first, value), (other, value, last)):
        same = all(x.stability == side.stability for x in between)
        steady = side.stability if same or (found.clear and not crosses) else "undecided"
        made = replace(side, lo=lo, hi=hi, first=a, last=b, values=a.union(b))
        halves.append(replace(made, stability=steady, special=None if halves else found))
    return halves


def summary(told: Sequence[Slice]) -> Shown:
    """Stretches of one verdict, the bifurcations between them, and what is open."""
    shown = Shown(ends=(told[0], told[-1]))
    groups = [list(run) for _, run in groupby(told, lambda one: one.known)]
    for k, group in enumerate(groups):
        found = [one.special for one in group if one.special is not None]
        shown.events.extend((x.value.lower(), x.value.upper(), x.kind, True) for x in found)
        inner = not found and not group[0].known and 0 < k < len(groups) - 1
        if inner and (kind := _kind(groups[k - 1][-1], groups[k + 1][0])):
            shown.events.append((*_hull(group), kind, False))
    for (verdict, steady, rises), run in groupby(told, _key):
        part = list(run)
        if rises and verdict != "undecided":
            low, high = (part[0].first, part[-1].last)[::rises]
            why = part[0].why if verdict == "disproved" else ""
            shown.stretches.append((low.upper(), high.lower(), verdict, steady, why))
        if not part[0].known:
            why = next((x.why for x in part if x.why), "")
            why = why or ("stability" if rises else "the direction of the branch")
            shown.open.append((*_hull(part), why))
    return shown


def _key(one: Slice) -> tuple[str, str, int]:
    steady = "undecided" if one.verdict == "disproved" else one.stability
    return one.verdict, steady, one.rises


def _hull(run: Sequence[Slice]) -> tuple[arb, arb]:
    return min(x.values.lower() for x in run), max(x.values.upper() for x in run)


def _kind(one: Slice, other: Slice) -> str:
    """What lies between two slices of which everything is shown, once or more; or ""."""
    if one.rises == -other.rises:
        return "saddle_node"
    if one.verdict != other.verdict:
        return one.broken or other.broken
    same = one.verdict == "disproved" or one.stability == other.stability
    return "" if same else "change_of_stability"

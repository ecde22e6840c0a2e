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

from ..system import SYMBOLS
from .certificate import exact, machine_in, need, numbers
from .formulas import REGIMES, Machine, Number, Undecided
from .special import BORDERS, SINGULAR, Special, only_special
from .tube import TERMS, Family, Slice, Spectrum, Tube, image, point_at, slices

#: Numbers of a structure that can be a parameter, and of one of its stops.
_NUMBERS, _OF_STOP = ("drive_frequency", "phase"), ("gap", "restitution", "friction")


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
    """A bifurcation between two values of the parameter; `single`: one only."""

    kind: str
    lo: arb
    hi: arb
    single: bool = False


@dataclass(frozen=True)
class Shown:
    """What is shown along a chain, and reasons for what is not, with ranges of the parameter.

    `events`: bifurcations, each with the slices in which it lies.
    """

    stretches: list[Stretch]
    events: list[tuple[Between, list[Slice]]]
    open: list[tuple[arb, arb, str]]
    whole: tuple[arb, arb] | None = None


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


def tube_in(given: Mapping[str, Any], size: int) -> Tube:
    """A tube of a certificate."""
    line, radius = numbers(given["line"], arb), numbers(given["radius"], arb)
    half = arb(exact(given["half"]))
    need(half > 0 and len(radius) == size and all(r > 0 for r in radius), "a tube without room")
    sound = 2 <= len(line) <= TERMS and all(len(row) == size for row in line)
    need(sound, "a line of another size")
    return Tube(line, half, radius)


def special_in(given: Mapping[str, Any], family: Family, size: int) -> tuple[Special, list[arb]]:
    """A special point of a certificate, and its box."""
    kind, leg, which = given["kind"], given["leg"], (given["condition"], given["stop"])
    need(kind in SINGULAR or kind in BORDERS, f"a special point {kind!r}")
    need(type(leg) is int and 0 <= leg < len(family.legs), "a leg that is none")
    need(all(x is None or (type(x) is int and 0 <= x < 100) for x in which), "a border")
    need(sum(x is not None for x in which) == (kind in BORDERS), "a border")
    pairs = numbers(given["box"])
    need(all(radius >= 0 for _, radius in pairs), "a negative radius")
    box = [arb(centre, radius) for centre, radius in pairs]  # or a little wider
    need(len(box) == size + (which[1] is not None), "a box of another size")
    return Special(kind, leg, *which), box


def examine_chain(
    machine: Mapping[str, Any], place: Sequence[Any], piece: Mapping[str, Any], precision: int
) -> Shown:
    """Find out what holds along a chain of tubes.

    Raises
    ------
    Undecided : a tube holds no branch, two are not joined, or there is no such special point
    ProofError, KeyError, TypeError, ValueError : the certificate is damaged
    """
    need(type(precision) is int and 1 < precision < 10**5, "a precision that is none")
    with ctx.workprec(precision):
        family, told, before = family_of(machine, place, piece), list[Slice](), None
        size = len(family.legs) * (2 * machine_in(machine).size + 1) + 1
        tubes = [tube_in(given, size) for given in piece["tubes"]]
        for tube, given in zip(tubes, piece["tubes"], strict=True):
            found, until = image(family, tube), arb(exact(given["until"]))
            if not found.inside:
                raise Undecided("Krawczyk's operator does not contract in a tube")
            lo = -tube.half if before is None else tube.place(before)
            if lo is None or not (lo < until and until <= tube.half):
                raise Undecided("two tubes are not joined")
            told += slices(family, tube, found, lo, until)
            before = point_at(family, tube, found, until)
        points = [special_in(given, family, size) for given in piece["specials"]]
        return summary(told, [located(family, tubes, *point) for point in points])


@dataclass(frozen=True)
class Located:
    """The only special point of a kind in a box, on a branch: its value of the parameter."""

    kind: str
    box: Sequence[arb]
    value: arb


def located(family: Family, tubes: Sequence[Tube], special: Special, box: list[arb]) -> Located:
    """Verify a special point; raises Undecided if it is none, or not on the branch."""
    size = len(tubes[0].radius)
    found = only_special(family, special, box)[:size]
    if all(tube.place(found) is None for tube in tubes):
        raise Undecided("a special point that is not on the branch")
    return Located(special.kind, box[:size], found[-1])


def summary(told: Sequence[Slice], points: Sequence[Located]) -> Shown:
    """Stretches of one verdict, the bifurcations between them, and what is open."""
    shown = Shown([], [], [], _hull(told) if told else None)
    groups = [list(run) for _, run in groupby(told, lambda one: one.known)]
    for k, arc in enumerate(groups):
        if arc[0].known or not 0 < k < len(groups) - 1:
            continue
        one, other = groups[k - 1][-1], groups[k + 1][0]
        if kind := _kind(one, other, arc):
            point = next((x for x in points if x.kind == kind and _holds(x.box, arc)), None)
            where = _hull(arc) if point is None else (point.value.lower(), point.value.upper())
            shown.events.append((Between(kind, *where, point is not None), arc))
            if point is not None and kind in SINGULAR:
                groups[k] = _parted(one, other, arc, kind, point.value)
    whole = [one for group in groups for one in group]
    for _, run in groupby(whole, _key):
        part = list(run)
        first, last = part[0], part[-1]
        if first.rises and first.verdict != "undecided":
            low, high = (first.first, last.last)[:: first.rises]
            told_ = _key(first)[:2]
            why = first.why if first.verdict == "disproved" else ""
            shown.stretches.append(Stretch(low.upper(), high.lower(), *told_, why))
        if not first.known:
            why = next((x.why for x in part if x.why), "")
            why = why or ("the direction of the branch" if first.rises == 0 else "stability")
            shown.open.append((*_hull(part), why))
    return shown


def _key(one: Slice) -> tuple[str, str, int]:
    steady = "undecided" if one.verdict == "disproved" else one.spectrum.stability
    return one.verdict, steady, one.rises


def _hull(run: Sequence[Slice]) -> tuple[arb, arb]:
    values = [one.box[-1] for one in run]
    return min(x.lower() for x in values), max(x.upper() for x in values)


def _holds(box: Sequence[arb], arc: Sequence[Slice]) -> bool:
    return all(y.contains(x) for one in arc for x, y in zip(one.box, box, strict=True))


def _kind(one: Slice, other: Slice, arc: Sequence[Slice]) -> str:
    """What must lie on the arc between two slices of which everything is shown; or "".

    The branch is a smooth curve through all tubes: a function that changes its sign vanishes. On
    it DF is singular, a multiplier is 1, where the parameter has an extremum, and there only.
    """
    if one.rises == -other.rises:
        return "saddle_node"
    if one.verdict != other.verdict:
        return one.broken or other.broken
    before, after = one.spectrum, other.spectrum
    if one.verdict == "disproved":
        return ""
    if before.at_minus_one == -after.at_minus_one != 0:
        return "period_doubling"
    if before.stability == after.stability:
        return ""
    spectra = [x.spectrum for x in (one, *arc, other)]
    real = all(x.at_one and x.at_minus_one for x in spectra)
    return "neimark_sacker" if real else "change_of_stability"


def _parted(one: Slice, other: Slice, arc: list[Slice], kind: str, value: arb) -> list[Slice]:
    """An arc in two, before and after its only turn or period doubling."""
    turns = kind == "saddle_node"
    if any(x.verdict != "proved" or (not turns and x.rises != one.rises) for x in arc):
        return arc
    spectra, halves = [x.spectrum for x in arc], []
    # the polynomial keeps its sign at the other of the points 1 and -1 if it is known all along
    other_signs = {x.at_minus_one if turns else x.at_one for x in spectra}
    for end, first, last in ((one, arc[0].first, value), (other, value, arc[-1].last)):
        sign = end.spectrum.at_one if turns else end.spectrum.at_minus_one
        inside = sign == 1 and other_signs == {1} and all(x.others_inside for x in spectra)
        steady = "unstable" if sign == -1 else "stable" if inside else "undecided"
        box = [first.union(last)]
        spectrum = Spectrum(steady)
        halves.append(Slice(box, arb(0), first, last, end.rises, "proved", "", "", spectrum))
    return halves

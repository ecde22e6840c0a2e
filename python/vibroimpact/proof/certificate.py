"""Certificates of proofs: what a file states, in exact numbers, and whether it is so.

A number is an integer and a power of two, "5404319552844595p-53": the double 0.6. `examine` makes
a finding of the problem that a certificate poses, and of nothing else; `agrees` says whether what
it claims is no more than that.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal

from flint import acb, arb, ctx, fmpq

from ..errors import ProofError
from .formulas import REGIMES, Machine, Refuted, Undecided, plain, structure, two_bodies
from .verifier import Orbit, multipliers, only_zero, return_map, settled, show_motion, stability

Verdict = Literal["proved", "disproved", "undecided"]
LAWS = ("poisson", "newton", "energetic")
_MATRICES = ("mass", "stiffness", "damping", "damping_ratios")
SYMBOLS = (
    *("mbar", "omega0", "r", "delta", "zeta1", "zeta2", "f1", "f2", "c1", "c2", "mu"),
    *("omega", "phi"),
)


@dataclass(frozen=True)
class Finding:
    """What is shown: the box of the only solution, discs of its multipliers, its stability."""

    verdict: Verdict
    why: str = ""
    box: Sequence[arb] = ()
    discs: Sequence[acb] = ()
    stability: Literal["stable", "unstable", "undecided"] = "undecided"


def exact(text: Any) -> fmpq:
    """The number of a text."""
    mantissa, exponent = text.split("p")
    return fmpq(int(mantissa)) * fmpq(2) ** int(exponent)


def numbers(given: Any) -> Any:
    """All of a list of lists."""
    return [numbers(one) for one in given] if isinstance(given, list) else exact(given)


def balls_of(given: Any) -> Any:
    """The same as balls."""
    return [balls_of(one) for one in given] if isinstance(given, list) else arb(exact(given))


def balls(given: Any) -> list[arb]:
    """Balls of pairs of a centre and a radius."""
    pairs = numbers(given)
    if not all(radius >= 0 for *_, radius in pairs):
        raise ProofError("a negative radius")
    return [arb(centre, radius) for centre, radius in pairs]


def machine_in(given: Mapping[str, Any], place: Sequence[Any] = (), value: Any = None) -> Machine:
    """The machine of a certificate, with a `value`, a ball or a series, at a place in it."""
    if given["law"] not in LAWS or given["kind"] not in ("two bodies", "structure"):
        raise ProofError(f"law {given['law']!r}, kind {given['kind']!r}")
    if given["kind"] == "two bodies":
        number = {name: balls_of(given["numbers"][name]) for name in SYMBOLS}
        if place:
            number[place[0]] = value
        sharp = {name: plain(x) for name, x in number.items()}
        rests, contact = given["wall_rests"], given["contact"]
        sound = sharp["omega"] > 0 and sharp["mbar"] >= 0 and sharp["mu"] >= 0
        sound = sound and 0 <= sharp["r"] <= 1 and contact in ("oblique", "direct")
        if not sound or (rests and (sharp["mbar"] != 0 or sharp["f2"] != 0)):
            raise ProofError("parameters outside their range")
        return two_bodies(number, contact, given["law"], wall_rests=rests)
    parts = {
        name: numbers(x) if name in _MATRICES else balls_of(x)
        for name, x in given.items()
        if name not in ("kind", "law", "stops")
    }
    parts["stops"] = [{name: balls_of(x) for name, x in stop.items()} for stop in given["stops"]]
    if place:
        owner: Any = parts
        for step in place[:-1]:
            owner = owner[step]
        if place[0] in _MATRICES or not isinstance(owner[place[-1]], arb):
            raise ProofError("a parameter that is none")
        owner[place[-1]] = value
    sound = plain(parts["drive_frequency"]) > 0
    for stop in parts["stops"]:
        sound = sound and 0 <= plain(stop["restitution"]) <= 1 and plain(stop["friction"]) >= 0
    if not sound:
        raise ProofError("parameters outside their range")
    return structure({**parts, "law": given["law"]})


def examine(given: Mapping[str, Any]) -> Finding:
    """Find out what holds of the problem of a certificate.

    Raises
    ------
    ProofError, KeyError, TypeError, ValueError : the certificate is damaged
    """
    with ctx.workprec(int(given["precision"])):
        machine = machine_in(given["machine"])
        legs = tuple((stop, regime) for stop, regime in given["legs"])
        known = all(
            regime in REGIMES and stop in range(len(machine.stops)) for stop, regime in legs
        )
        box = balls(given["box"])
        if not (known and legs and given["m"] in range(1, 10**6)):
            raise ProofError("legs or m")
        if len(box) != len(legs) * (2 * machine.size + 1):
            raise ProofError("a box of another size")
        orbit = Orbit(machine, given["m"], legs)
        try:
            box = only_zero(orbit, box)
            flights = orbit.flights(box)
            show_motion(orbit, flights)
        except Refuted as reason:
            return Finding("disproved", str(reason), box)
        except Undecided as reason:
            return Finding("undecided", str(reason))
        matrix = settled(return_map(flights))
        try:
            discs = multipliers(matrix)
        except Undecided as reason:
            return Finding("proved", str(reason), box, (), stability(matrix.charpoly().coeffs()))
        return Finding("proved", "", box, discs, stability(matrix.charpoly().coeffs()))


def agrees(claims: Mapping[str, Any], found: Finding) -> bool:
    """Whether a certificate claims no more than what is found."""
    with ctx.workprec(4096):  # claims are read exactly
        same = claims["verdict"] == found.verdict and claims["stability"] == found.stability
        box = balls(claims["box"])
        discs = [acb(*balls([[re, by], [im, by]])) for re, im, by in claims["discs"]]
        held = len(box) == len(found.box) and len(discs) == len(found.discs)
        held = held and all(map(arb.contains, box, found.box))
        return same and held and all(map(acb.contains, discs, found.discs))

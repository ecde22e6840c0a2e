"""Certificates of proofs: what a file states, in exact numbers, and whether it is so.

A number is an integer and a power of two, "5404319552844595p-53": the double 0.6. `examine` makes
a finding of the problem that a certificate poses; `agrees` says whether it claims no more.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from flint import acb, arb, ctx, fmpq, fmpq_mat

from ..errors import ProofError
from .formulas import REGIMES, Machine, Refuted, Undecided, plain, structure, two_bodies
from .verifier import (
    Orbit,
    Stability,
    multipliers,
    only_zero,
    return_map,
    settled,
    show_motion,
    show_shortest,
    stability,
)

LAWS = ("poisson", "newton", "energetic")
SYMBOLS = {"mbar", "omega0", "r", "delta", "zeta1", "zeta2", "f1", "f2", "c1", "c2", "mu"}
SYMBOLS |= {"omega", "phi"}
_STOP = {"gap", "restitution", "friction", "amplitude", "phase"}
_MATRICES = ("mass", "stiffness", "damping", "damping_ratios")


@dataclass(frozen=True)
class Finding:
    """What is shown: the box of the only solution, discs of its multipliers, its stability."""

    verdict: Literal["proved", "disproved", "undecided"]
    why: str = ""
    box: Sequence[arb] = ()
    discs: Sequence[acb] = ()
    stability: Stability = "undecided"


def need(holds: object, what: str) -> None:
    """Refuse a damaged certificate."""
    if not holds:
        raise ProofError(what)


def exact(text: Any) -> fmpq:
    """The number of a text."""
    mantissa, exponent = text.split("p")
    need(abs(int(exponent)) < 10**5, f"an exponent of {exponent}")
    return fmpq(int(mantissa)) * fmpq(2) ** int(exponent)


def numbers(given: Any) -> Any:
    """All of a list of lists."""
    return [numbers(one) for one in given] if isinstance(given, list) else exact(given)


def balls_of(given: Any) -> Any:
    """The same as balls."""
    if isinstance(given, dict):
        return {name: balls_of(one) for name, one in given.items()}
    return [balls_of(one) for one in given] if isinstance(given, list) else arb(exact(given))


def balls(given: Any) -> list[arb]:
    """Balls of pairs of a centre and a radius, or a little wider."""
    pairs = numbers(given)
    need(all(radius >= 0 for _, radius in pairs), "a negative radius")
    return [arb(centre, radius) for centre, radius in pairs]


def machine_in(given: Mapping[str, Any], place: Sequence[Any] = (), value: Any = None) -> Machine:
    """The machine of a certificate, with a `value`, a ball or a series, at a place in it."""
    need(given["law"] in LAWS, f"law {given['law']!r}")
    if given["kind"] == "two bodies":
        parts = balls_of(given["numbers"])
        need(set(given) == {"kind", "law", "contact", "wall_rests", "numbers"}, "other entries")
        need(set(parts) == SYMBOLS and type(given["wall_rests"]) is bool, "other numbers")
        need(given["contact"] in ("oblique", "direct"), f"contact {given['contact']!r}")
    else:
        need(given["kind"] == "structure", f"kind {given['kind']!r}")
        _check_shapes(given)
        parts = {
            name: numbers(x) if name in _MATRICES else balls_of(x)
            for name, x in given.items()
            if name not in ("kind", "law")
        }
    if place:
        owner: Any = parts
        for step in place[:-1]:
            owner = owner[step]
        need(isinstance(owner[place[-1]], arb), "a parameter that is none")
        owner[place[-1]] = value
    if given["kind"] == "two bodies":
        some = {name: plain(x) for name, x in parts.items()}
        least = ("mbar", "mu", "omega0", "zeta1", "zeta2")
        need(some["omega"] > 0 and all(some[x] >= 0 for x in least), "parameters below 0")
        need(0 <= some["r"] <= 1, "a restitution outside [0, 1]")
        rests = given["wall_rests"]
        need(not rests or (some["mbar"] == 0 and some["f2"] == 0), "a wall that does not rest")
        return two_bodies(parts, given["contact"], given["law"], wall_rests=rests)
    need(plain(parts["drive_frequency"]) > 0, "a frequency below 0")
    for stop in parts["stops"]:
        need(0 <= plain(stop["restitution"]) <= 1, "a restitution outside [0, 1]")
        need(plain(stop["friction"]) >= 0, "friction below 0")
    return structure({**parts, "law": given["law"]})


def _check_shapes(given: Mapping[str, Any]) -> None:
    """That matrices and vectors have one size, that M and K are symmetric, M positive definite."""
    n = len(given["mass"])
    shapes = {"mass": (n, n), "stiffness": (n, n), "static_load": (n,), "drive_amplitude": (n, 2)}
    shapes |= {"drive_frequency": (), "phase": ()}
    shapes |= {"damping": (n, n)} if "damping" in given else {"damping_ratios": (n,)}
    need(set(given) == {"kind", "law", "stops", *shapes}, "other entries")
    pairs = [(given[name], shape) for name, shape in shapes.items()]
    for stop in given["stops"]:
        need(set(stop) == {"normal", "tangent", *_STOP}, "other entries of a stop")
        pairs += [(stop["normal"], (n,)), (stop["tangent"], (n,))]
        pairs += [(stop[name], ()) for name in _STOP]
    need(all(np.array(x, object).shape == shape for x, shape in pairs), "an entry of another shape")
    mass, stiffness = numbers(given["mass"]), fmpq_mat(numbers(given["stiffness"]))
    need(fmpq_mat(mass) == fmpq_mat(mass).transpose(), "a mass matrix that is not symmetric")
    need(stiffness == stiffness.transpose(), "a stiffness matrix that is not symmetric")
    minors = (fmpq_mat([row[:k] for row in mass[:k]]).det() for k in range(1, n + 1))
    need(all(minor > 0 for minor in minors), "a mass matrix that is not positive definite")


def examine(given: Mapping[str, Any]) -> Finding:
    """Find out what holds of the problem of a certificate.

    Raises
    ------
    ProofError, KeyError, TypeError, ValueError : the certificate is damaged
    """
    m, precision = given["m"], given["precision"]
    need(type(m) is int and 0 < m < 10**6, "a number of drive periods that is none")
    need(type(precision) is int and 1 < precision < 10**5, "a precision that is none")
    with ctx.workprec(precision):
        machine = machine_in(given["machine"])
        legs = tuple((stop, regime) for stop, regime in given["legs"])
        for stop, regime in legs:
            known = type(stop) is int and 0 <= stop < len(machine.stops) and regime in REGIMES
            need(known, f"a leg to stop {stop!r}, {regime!r}")
        box = balls(given["box"])
        need(legs and len(box) == len(legs) * (2 * machine.size + 1), "a box of another size")
        orbit = Orbit(machine, m, legs)
        try:
            box = only_zero(orbit, box)
            flights = orbit.flights(box)
            show_motion(orbit, flights)
            show_shortest(orbit, box)
        except Refuted as reason:
            return Finding("disproved", str(reason), box)
        except (Undecided, ZeroDivisionError) as reason:
            return Finding("undecided", str(reason))
        why, discs = "", list[acb]()
        steady: Stability = "undecided"
        try:
            matrix = settled(return_map(flights))
            steady = stability(matrix.charpoly().coeffs())
            discs = multipliers(matrix)
        except Undecided as reason:
            why = str(reason)
        return Finding("proved", why, box, discs, steady)


def agrees(claims: Mapping[str, Any], found: Finding) -> bool:
    """Whether a certificate claims no more than what is found."""
    same = claims["verdict"] == found.verdict and claims["stability"] == found.stability
    discs = [pair for re, im, by in numbers(claims["discs"]) for pair in ((re, by), (im, by))]
    parts = [x for disc in found.discs for x in (disc.real, disc.imag)]
    pairs, known = numbers(claims["box"]) + discs, [*found.box, *parts]
    if not same or len(pairs) != len(known) or len(discs) != len(parts):
        return False
    with ctx.workprec(4096):  # exactly, but for rounding outward
        return all(abs(x - arb(c)) <= arb(by) for x, (c, by) in zip(known, pairs, strict=True))

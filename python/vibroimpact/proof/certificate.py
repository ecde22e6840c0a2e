"""Certificates of proofs: what a file states, in exact numbers, and whether it is so.

A number is an integer and a power of two, "5404319552844595p-53": the double 0.6. `examine` makes
a finding of the problem that a certificate poses; `agrees` says whether it claims no more.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal

from flint import acb, arb, arb_series, ctx, fmpq, fmpq_mat

from ..errors import ProofError
from . import verifier
from .formulas import REGIMES, Machine, Refuted, Undecided, plain, structure, two_bodies


@dataclass(frozen=True)
class Finding:
    """What is shown: the box of the only solution, discs of its multipliers, its stability."""

    verdict: Literal["proved", "disproved", "undecided"]
    why: str = ""
    box: Sequence[arb] = ()
    solved: bool = False  # whether the box holds a solution; of a disproved one it is no motion
    discs: Sequence[acb] = ()
    stability: verifier.Stability = "undecided"


def need(holds: object, what: str) -> None:
    """Refuse a damaged certificate."""
    if not holds:
        raise ProofError(what)


def exact(text: Any) -> fmpq:
    """The number of a text."""
    mantissa, exponent = text.split("p")
    need(abs(int(exponent)) < 10**5, f"an exponent of {exponent}")
    return fmpq(int(mantissa)) * fmpq(2) ** int(exponent)


def numbers(given: Any, kind: type = fmpq) -> Any:
    """All numbers of nested lists and entries, exact or as balls; a ball or a series stays one."""
    if isinstance(given, dict):
        return {name: numbers(one, kind) for name, one in given.items()}
    if isinstance(given, list):
        return [numbers(one, kind) for one in given]
    return given if isinstance(given, arb | arb_series) else kind(exact(given))


def machine_in(given: Mapping[str, Any]) -> Machine:
    """The machine of a certificate, of two bodies or a structure."""
    law, kind = given["law"], given["kind"]
    need(law in ("poisson", "newton", "energetic"), f"law {law!r}")
    if kind == "two bodies":
        contact, rests = given["contact"], given["wall_rests"]
        need(contact in ("oblique", "direct") and type(rests) is bool, "another contact")
        parts = numbers(given["numbers"], arb)
        need(not rests or plain(parts["mbar"]) == plain(parts["f2"]) == 0, "a wall that moves")
        least = [parts[x] for x in ("mbar", "mu", "omega0", "zeta1", "zeta2")]
        machine = two_bodies(parts, contact, law, rests)
    else:
        need(kind == "structure", f"{kind!r}")
        exactly = [x for x in ("mass", "stiffness", "damping", "damping_ratios") if x in given]
        others = ("static_load", "drive_amplitude", "drive_frequency", "phase", "stops")
        parts = {name: numbers(given[name]) for name in exactly}
        for name, rows in parts.items():
            need(name == "damping_ratios" or positive(fmpq_mat(rows)), f"{name} is not positive")
        parts |= {name: numbers(given[name], arb) for name in others}
        least = [arb(x) for x in parts.get("damping_ratios", [])]
        need("damping" in parts or len(least) == len(parts["mass"]), "other damping ratios")
        for stop in given["stops"]:
            across = fmpq_mat(numbers([stop["normal"], stop["tangent"]])).rank() == 2
            need(across or numbers(stop["friction"]) == 0, "a tangent along the normal")
        machine = structure(parts, law)
    stops = machine.stops
    least += [x for stop in stops for x in (stop.friction, stop.restitution, 1 - stop.restitution)]
    need(all(plain(x) >= 0 for x in least), "a parameter out of its range")
    need(plain(machine.omega) > 0, "a drive frequency that is not positive")
    return machine


def positive(matrix: fmpq_mat) -> bool:
    """Whether a matrix is symmetric and semidefinite: then the signs of det(x - A) alternate."""
    signs = [x * (-1) ** k for k, x in enumerate(reversed(matrix.charpoly().coeffs()))]
    return matrix == matrix.transpose() and all(x >= 0 for x in signs)


def examine(given: Mapping[str, Any]) -> Finding:
    """Find out what holds of the problem of a certificate; a damaged one raises some error."""
    m, precision = given["m"], given["precision"]
    need(type(m) is int and 0 < m < 10**6, "a number of drive periods that is none")
    need(type(precision) is int and 1 < precision < 10**5, "a precision that is none")
    with ctx.workprec(precision):
        machine, pairs = machine_in(given["machine"]), numbers(given["box"])
        legs = tuple((stop, regime) for stop, regime in given["legs"])
        known = {(stop, regime) for stop in range(len(machine.stops)) for regime in REGIMES}
        need(all(type(stop) is int for stop, _ in legs), "a stop that is none")
        need(known >= set(legs) or (legs, m) == ((verifier.CIRCUIT,), 1), "a leg that is none")
        need(legs and len(pairs) == len(legs) * (2 * machine.size + 1), "a box of another size")
        need(all(radius >= 0 for _, radius in pairs), "a negative radius")
        box = [arb(centre, radius) for centre, radius in pairs]  # or a little wider
        orbit, solved = verifier.Orbit(machine, m, legs), False
        try:
            box, solved = verifier.only_zero(orbit, box), True
            flights = orbit.flights(box)
            verifier.show_motion(orbit, flights)
            steady, discs, why = verifier.spectrum(orbit, flights)
        except Refuted as reason:
            return Finding("disproved", str(reason), box, solved)
        except (Undecided, ValueError, ZeroDivisionError) as reason:
            return Finding("undecided", str(reason))
        return Finding("proved", why, box, True, discs, steady)


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

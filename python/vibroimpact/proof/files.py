"""From findings to proofs of motions."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from fractions import Fraction
from typing import Any

import numpy as np
from flint import acb, arb, ctx, fmpq

from ..errors import ProofError
from .certificate import Finding, agrees, exact, examine
from .result import Disc, Proof, ProofBox
from .verifier import CIRCUIT

#: A claim is so much wider than what is found: another version of the arithmetic may round more.
_ROOM = 4


def text(value: arb | fmpq | float) -> str:
    """An exact number as certificates write it: a double, a dyadic fraction, a ball's midpoint."""
    if isinstance(value, arb):
        mantissa, exponent = value.mid().man_exp()
        return f"{int(mantissa)}p{int(exponent)}"
    part, whole = (value.p, value.q) if isinstance(value, fmpq) else value.as_integer_ratio()
    return f"{int(part)}p{1 - int(whole).bit_length()}"


def proof_of(posed: Mapping[str, Any], found: Finding) -> Proof:
    """The proof of a problem by what is found of it."""
    if found.verdict == "undecided":
        return Proof(verdict="undecided", why=found.why, label=_label(posed))
    with ctx.workprec(posed["precision"]):
        claims = {
            "verdict": found.verdict,
            "stability": found.stability,
            "box": [[text(x), text(_ROOM * x.rad())] for x in found.box],
            "discs": [[text(x.real), text(x.imag), text(_radius(x))] for x in found.discs],
        }
    return proof_from({**posed, "claims": claims}, found)


def _label(posed: Mapping[str, Any]) -> str:
    return f"{posed['m']}-{sum(regime != CIRCUIT[1] for _, regime in posed['legs'])}"


def _radius(disc: acb) -> arb:
    return _ROOM * (disc.real.rad() + disc.imag.rad())


def proof_from(certificate: dict[str, Any], found: Finding) -> Proof:
    """The proof that a certificate is, if it agrees with what is found of its problem."""
    claims = certificate["claims"]
    width = len(certificate["box"]) // len(certificate["legs"])
    center, radius = np.array([_double(*pair) for pair in claims["box"]]).T
    return Proof(
        verdict=found.verdict,
        why=found.why,
        solved=found.solved,
        label=_label(certificate),
        box=ProofBox(center=_fixed(center, width), radius=_fixed(radius, width)),
        unique_within=_alone(certificate["box"], center),
        multipliers=tuple(_disc(*three) for three in claims["discs"]),
        stability=found.stability,
        certificate=certificate,
    )


def _fixed(values: Any, width: int) -> Any:
    array = values.reshape(-1, width).copy()
    array.flags.writeable = False
    return array


def _alone(box: Sequence[Sequence[str]], center: Any) -> float:
    """A distance from the centers within which everything lies in a box, rounded down."""
    pairs = zip(box, center, strict=True)
    within = min(_exact(by) - abs(_exact(x) - Fraction(y)) for (x, by), y in pairs)
    return max(0.0, float(np.nextafter(float(within), -np.inf)))


def _double(centre: str, radius: str) -> tuple[float, float]:
    """A double near a centre, and the radius about it, rounded up."""
    middle = float(_exact(centre))
    bound = _exact(radius) + abs(_exact(centre) - Fraction(middle))
    return middle, float(np.nextafter(float(bound), np.inf))


def _exact(text: str) -> Fraction:
    number = exact(text)
    return Fraction(int(number.p), int(number.q))


def _disc(real: str, imag: str, radius: str) -> Disc:
    re, by_re = _double(real, radius)
    im, by_im = _double(imag, radius)
    return Disc(complex(re, im), float(np.nextafter(np.hypot(by_re, by_im), np.inf)))


def verified(posed: dict[str, Any], claims: Mapping[str, Any]) -> Proof:
    """Verify a problem and what is claimed of it anew.

    Raises
    ------
    ProofError, KeyError, TypeError, ValueError : it is damaged, or claims what is not shown
    """
    found = examine(posed)
    if found.verdict == "undecided":
        raise ProofError(f"nothing is shown: {found.why}")
    if not agrees(claims, found):
        raise ProofError("it claims more than is shown")
    return proof_from({**posed, "claims": claims}, found)

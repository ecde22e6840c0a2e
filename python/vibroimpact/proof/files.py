"""From findings to proofs, and certificates as files."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from typing import Any

import numpy as np
from flint import acb, arb, ctx

from ..arguments import reject
from ..errors import ProofError
from ..whole_file import whole_file
from .certificate import Finding, agrees, examine, exact
from .posing import text
from .result import Box, Disc, Proof
from .statement import statement

FORMAT = "vibroimpact proof 1"
#: Keys of a file: what poses the problem, and what is claimed.
_PROBLEM = ("machine", "m", "legs", "precision", "box")
_KEYS = {"format", *_PROBLEM, "claims", "statement"}
#: A claim is so much wider than what is found: another version of the arithmetic may round more.
_ROOM = 4


def proof_of(posed: Mapping[str, Any], found: Finding) -> Proof:
    """The proof of a problem by what is found of it."""
    label = f"{posed['m']}-{len(posed['legs'])}"
    if found.verdict == "undecided":
        return Proof(verdict="undecided", why=found.why, label=label)
    with ctx.workprec(posed["precision"]):
        claims = {
            "verdict": found.verdict,
            "stability": found.stability,
            "box": [[text(x), text(_ROOM * x.rad())] for x in found.box],
            "discs": [[text(x.real), text(x.imag), text(_radius(x))] for x in found.discs],
        }
    return proof_from({**posed, "claims": claims}, found)


def _radius(disc: acb) -> arb:
    return _ROOM * (disc.real.rad() + disc.imag.rad())


def proof_from(certificate: dict[str, Any], found: Finding) -> Proof:
    """The proof that a certificate is, if it agrees with what is found of its problem."""
    claims = certificate["claims"]
    width = len(certificate["box"]) // len(certificate["legs"])
    center, radius = np.array([_double(*pair) for pair in claims["box"]]).T
    discs = [_disc(*three) for three in claims["discs"]]
    return Proof(
        verdict=found.verdict,
        why=found.why,
        label=f"{certificate['m']}-{len(certificate['legs'])}",
        box=Box(center=_fixed(center, width), radius=_fixed(radius, width)),
        unique_within=min(_double(*pair, down=True)[1] for pair in certificate["box"]),
        multipliers=tuple(discs),
        stability=found.stability,
        certificate=certificate,
    )


def _fixed(values: Any, width: int) -> Any:
    array = values.reshape(-1, width).copy()
    array.flags.writeable = False
    return array


def _double(centre: str, radius: str, *, down: bool = False) -> tuple[float, float]:
    """A double near a centre, and the radius about it, rounded up, or that within, rounded down."""
    with ctx.workprec(4096):
        middle = float(arb(exact(centre)))
        away = abs(arb(exact(centre)) - arb(middle))
        size = arb(exact(radius))
        bound = float((size - away if down else size + away).mid())
    return middle, max(0.0, np.nextafter(bound, -np.inf if down else np.inf))


def _disc(real: str, imag: str, radius: str) -> Disc:
    re, by_re = _double(real, radius)
    im, by_im = _double(imag, radius)
    return Disc(complex(re, im), float(np.nextafter(np.hypot(by_re, by_im), np.inf)))


def write_proof(path: str | os.PathLike[str], proof: Proof) -> None:
    """Write a certificate to ``path``; the file appears complete or not at all."""
    if proof.verdict == "undecided":
        reject("proof", proof, "one that shows something: this one is undecided")
    content = {"format": FORMAT, **proof.certificate, "statement": statement(proof)}
    with whole_file(path) as file:
        file.write(json.dumps(content, indent=1).encode())


def read_proof(path: str | os.PathLike[str]) -> Proof:
    """Verify a certificate anew.

    Raises
    ------
    ProofError
        If it is damaged, or claims what is not shown.
    """
    with open(path, "rb") as file:
        raw = file.read()
    try:
        content = json.loads(raw)
        if not isinstance(content, dict) or set(content) != _KEYS or content["format"] != FORMAT:
            raise ProofError("not a certificate of this format")
        if set(content["claims"]) != {"verdict", "stability", "box", "discs"}:
            raise ProofError("claims of another kind")
        posed = {name: content[name] for name in _PROBLEM}
        found = examine(posed)
        if found.verdict == "undecided":
            raise ProofError(f"nothing is shown: {found.why}")
        if not agrees(content["claims"], found):
            raise ProofError("it claims more than is shown")
        proof = proof_from({**posed, "claims": content["claims"]}, found)
        if content["statement"] != statement(proof):
            raise ProofError("its statement is not what is shown")
    except ProofError:
        raise
    except (KeyError, TypeError, ValueError, IndexError, AttributeError, OverflowError) as error:
        raise ProofError(f"damaged: {error!r}") from error
    return proof

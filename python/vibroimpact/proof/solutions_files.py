"""Proofs that motions are all: from a search, to a sentence, to a file and back."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from typing import Any

from flint import arb, ctx

from ..arguments import path as path_of
from ..arguments import reject
from ..errors import Interrupted, ProofError
from ..showing import counted
from ..single_impact.results import PeriodicMotions, Undecided
from ..whole_file import whole_file
from .all_solutions import examine_all, problem
from .certificate import agrees, exact
from .files import proof_from
from .formulas import Undecided as NotShown
from .isolating import search
from .result import Proof
from .solutions_result import SolutionsProof
from .statement import PRINTED, machine_sentence, up

SOLUTIONS_FORMAT = "vibroimpact proof of all motions with one impact 1"
_PROBLEM = ("machine", "n", "precision", "cuts", "holds", "orbits")
_KEYS = {"format", *_PROBLEM, "claims", "statement"}
_ORBIT = {"precision", "box", "claims"}


def all_proved(motions: PeriodicMotions) -> SolutionsProof:
    """What can be shown of all solutions."""
    system = motions.system
    if system.law == "paper":
        return _undecided(motions, [], [], "the law of the paper is not proved with")
    if motions.within[0] == motions.within[1]:  # nothing was searched
        return _undecided(motions, [], [], motions.note)
    proofs: list[Proof] = []
    try:
        posed, left = search(motions, proofs)
    except NotShown as reason:
        return _undecided(motions, proofs, [], str(reason))
    except KeyboardInterrupt:
        raise Interrupted(
            "interrupted",
            _undecided(motions, proofs, [], "interrupted"),
            holds=f"the proofs of {len(proofs)} solutions",
        ) from None
    if left:
        return _undecided(motions, proofs, left, f"{left[0].reason}, x1 near {left[0].lo:.6g}")
    posed["orbits"] = [
        {name: proof.certificate[name] for name in ("precision", "box", "claims")}
        for proof in proofs
    ]
    try:
        return _examined(posed)
    except NotShown as reason:
        return _undecided(motions, proofs, [], str(reason))


def _undecided(
    motions: PeriodicMotions, proofs: list[Proof], left: list[Undecided], why: str
) -> SolutionsProof:
    return SolutionsProof(
        verdict="undecided",
        why=why,
        n=motions.n,
        proofs=tuple(proofs),
        within=motions.within,
        everywhere=False,
        uncovered=tuple(left),
    )


def _examined(posed: Mapping[str, Any], claims: Mapping[str, Any] | None = None) -> SolutionsProof:
    """The proof that a certificate is.

    Raises
    ------
    formulas.Undecided : it is none
    ProofError : it claims what is not shown
    """
    findings, everywhere = examine_all(posed)
    proofs = []
    for orbit, found in zip(posed["orbits"], findings, strict=True):
        if set(orbit) != _ORBIT or not agrees(orbit["claims"], found):
            raise ProofError("it claims more than is shown")
        proofs.append(proof_from({**problem(posed, orbit), "claims": orbit["claims"]}, found))
    if claims is not None and claims != {"everywhere": everywhere}:
        raise ProofError("it claims more than is shown")
    with ctx.workprec(4096):
        low, high = (float(arb(exact(posed["cuts"][i]))) for i in (0, -1))
    return SolutionsProof(
        verdict="proved",
        why="",
        n=posed["n"],
        proofs=tuple(proofs),
        within=(low, high),
        everywhere=everywhere,
        certificate={**posed, "claims": {"everywhere": everywhere}},
    )


def solutions_statement(proof: SolutionsProof) -> str:
    """The theorem, or what is open."""
    if proof.verdict == "undecided":
        return f"It is not shown that these {proof.n}-1 motions are all: {proof.why}."
    low, high = proof.within
    place = "" if proof.everywhere else f" at an x1 in [{low!r}, {high!r}]"
    told = (
        f"exactly {counted(proof.count, 'motion')}{_stabilities(proof)}. Motions that differ by a "
        "whole number of drive periods count as one. At the impact"
        if proof.count
        else "no motion."
    )
    lines = [
        f"Theorem. {machine_sentence(proof.certificate['machine'])} With one impact{place} in "
        f"{counted(proof.n, 'drive period')}, after which it repeats, it has {told}"
    ]
    for one in proof.motions:
        assert one.box is not None
        x1, bound = float(one.box.center[0, 0]), float(one.box.radius[0, 0])
        known = one.stability if one.stability != "undecided" else "stability undecided"
        lines.append(f"  x1 = {x1:.17g} to within {up(bound + PRINTED * abs(x1))}, {known}")
    others = [one for one in proof.proofs if one.verdict == "disproved"]
    if others:
        lines.append("The other solutions of the conditions of periodicity are no motions:")
    for one in others:
        assert one.box is not None
        lines.append(f"  x1 = {float(one.box.center[0, 0]):.17g}: {one.why}")
    return "\n".join(lines)


def _stabilities(proof: SolutionsProof) -> str:
    told = []
    for kind, words in (
        ("stable", "asymptotically stable"),
        ("unstable", "unstable"),
        ("undecided", "of a stability that is not shown"),
    ):
        count = sum(one.stability == kind for one in proof.motions)
        if count:
            told.append(f"{count} {words}")
    return ": " + ", ".join(told) if told else ""


def write_solutions_proof(path: str | os.PathLike[str], proof: SolutionsProof) -> None:
    """Write a certificate to ``path``; the file appears complete or not at all."""
    path = path_of("path", path)
    if proof.verdict == "undecided":
        reject("proof", proof, "one that shows something: this one is undecided")
    content = {"format": SOLUTIONS_FORMAT, **proof.certificate, "statement": proof.statement}
    with whole_file(path) as file:
        file.write(json.dumps(content, indent=1).encode())


def verified_solutions(content: Mapping[str, Any]) -> SolutionsProof:
    """Verify the content of a file anew.

    Raises
    ------
    ProofError, KeyError, TypeError, ValueError : it is damaged, or claims what is not shown
    """
    if set(content) != _KEYS:
        raise ProofError("not a certificate of this format")
    try:
        proof = _examined({name: content[name] for name in _PROBLEM}, content["claims"])
    except NotShown as reason:
        raise ProofError(f"it is not shown that these are all: {reason}") from reason
    if content["statement"] != proof.statement:
        raise ProofError("its statement is not what is shown")
    return proof

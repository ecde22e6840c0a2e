"""Proofs that motions are all: from a search, and from a certificate."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from flint import arb, ctx

from ..errors import Interrupted, ProofError
from ..single_impact.results import PeriodicMotions, Undecided
from .all_solutions import examine_all, problem
from .certificate import agrees, exact
from .files import proof_from
from .formulas import Undecided as NotShown
from .isolating import search
from .result import Proof
from .solutions_result import SolutionsProof

#: Entries of one of its solutions.
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


def verified_solutions(posed: dict[str, Any], claims: Mapping[str, Any]) -> SolutionsProof:
    """Verify a problem and what is claimed of it anew.

    Raises
    ------
    ProofError, KeyError, TypeError, ValueError : it is damaged, or claims what is not shown
    """
    try:
        return _examined(posed, claims)
    except NotShown as reason:
        raise ProofError(f"it is not shown that these are all: {reason}") from reason

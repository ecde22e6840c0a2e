"""What the proof of a branch says, in words."""

from __future__ import annotations

from .branch_result import BranchProof
from .statement import machine_sentence

#: Stretches and bifurcations that are printed.
_MOST = 20
_KINDS = {
    "saddle_node": "an extremum of the parameter (saddle-node)",
    "period_doubling": "a multiplier -1 (period doubling)",
    "branch_point": "a multiplier 1 (branch point)",
    "neimark_sacker": "two conjugate multipliers on the unit circle (Neimark-Sacker)",
    "change_of_stability": "a multiplier on the unit circle",
    "grazing": "the border of a flight's conditions (grazing)",
    "regime_border": "the border of a regime of an impact",
}


def branch_statement(proof: BranchProof) -> str:
    """The theorem, or what is open."""
    if not proof.stretches:
        reasons = "; ".join(dict.fromkeys(one.why for one in proof.uncovered))
        return f"Nothing is shown of the branch over {proof.parameter}: {reasons}."
    name = proof.parameter
    parts = [
        f"Theorem. {machine_sentence(proof.certificate['machine'])} Let {name} vary. Along the "
        "chain of tubes of the certificate the solutions form one smooth curve for each piece, "
        "and the tubes hold no other with the same order of impacts and regimes."
    ]
    for one in proof.stretches[:_MOST]:
        told = {
            "stable": "is a motion, and is asymptotically stable",
            "unstable": "is a motion, and is unstable",
            "undecided": "is a motion; its stability is open",
        }[one.stability]
        if one.verdict == "disproved":
            told = f"is no motion: {one.why}"
        parts.append(
            f"For every {name} in [{one.lo!r}, {one.hi!r}] there is exactly one {one.label} "
            f"solution on this part of the curve; it {told}."
        )
    parts += [
        f"Between {name} = {found.lo!r} and {found.hi!r} the {found.label} solutions have "
        f"{_KINDS[found.kind]}."
        for found in proof.bifurcations[:_MOST]
    ]
    more = max(0, len(proof.stretches) - _MOST) + max(0, len(proof.bifurcations) - _MOST)
    if more:
        parts.append(f"And {more} more, which the certificate lists.")
    return "\n".join(parts)

"""Valid calls of proofs, for `valid_calls`: what a `Call` is made of."""

from typing import Any

import vibroimpact as vi
from small_results import (
    branch,
    branch_proof,
    folder,
    motion,
    proof,
    saved_proof,
    solutions,
    solutions_proof,
)

PROVED = {
    "motion": "object",
    "within": "object or none",
    "max_tubes": "whole number",
    "progress": "true or false",
}
"""The kinds of what `prove` is given."""
_PATH = {"path": "path"}


def proof_calls() -> dict[str, tuple[Any, ...]]:
    """Valid calls by the name of the function, with the kinds of their arguments."""
    return {
        "prove": (vi.prove, {"motion": motion()}, PROVED),
        "prove: all": (vi.prove, {"motion": solutions()}, PROVED),
        "prove: branch": (
            vi.prove,
            {"motion": branch(), "within": (1.512, 1.5125), "max_tubes": 2, "progress": False},
            PROVED,
        ),
        "Proof.save": (proof().save, {"path": folder() / "proof.json"}, _PATH),
        "BranchProof.save": (branch_proof().save, {"path": folder() / "branch.json"}, _PATH),
        "SolutionsProof.save": (solutions_proof().save, {"path": folder() / "all.json"}, _PATH),
        "check_proof": (vi.check_proof, {"path": saved_proof()}, {"path": "path that is missing"}),
    }

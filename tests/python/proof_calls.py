"""Valid calls of proofs, for `valid_calls`: what a `Call` is made of."""

from typing import Any

import vibroimpact as vi
from small_results import folder, motion, proof, saved_proof, solutions, solutions_proof

_MOTION, _PATH = {"motion": "object"}, {"path": "path"}


def proof_calls() -> dict[str, tuple[Any, ...]]:
    """Valid calls by the name of the function, with the kinds of their arguments."""
    return {
        "prove": (vi.prove, {"motion": motion()}, _MOTION),
        "prove: all": (vi.prove, {"motion": solutions()}, _MOTION),
        "Proof.save": (proof().save, {"path": folder() / "proof.json"}, _PATH),
        "SolutionsProof.save": (solutions_proof().save, {"path": folder() / "all.json"}, _PATH),
        "check_proof": (vi.check_proof, {"path": saved_proof()}, {"path": "path that is missing"}),
    }

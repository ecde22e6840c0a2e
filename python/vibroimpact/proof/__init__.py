"""Proofs of periodic motions in ball arithmetic.

What a proof rests on stands in `formulas`, `verifier` and `certificate`, that motions are all in
`all_solutions`, and of branches in `along`, `tube`, `parts`, `special` and `chain`. All files but
`call` and the results need python-flint; they are imported when a proof is asked for.
"""

from .branch_result import BranchProof, ProvedBifurcation, ProvedStretch, Unproved
from .call import check_proof, prove
from .result import Disc, Proof, ProofBox
from .solutions_result import SolutionsProof

__all__ = [
    "BranchProof",
    "Disc",
    "Proof",
    "ProofBox",
    "ProvedBifurcation",
    "ProvedStretch",
    "SolutionsProof",
    "Unproved",
    "check_proof",
    "prove",
]

"""Proofs of periodic motions in ball arithmetic.

What a proof rests on stands in `formulas`, `verifier` and `certificate`, and that motions are all
in `all_solutions`. All files but `call` and the results need python-flint; they are imported when a
proof is asked for.
"""

from .call import check_proof, prove
from .result import Disc, Proof, ProofBox
from .solutions_result import SolutionsProof

__all__ = ["Disc", "Proof", "ProofBox", "SolutionsProof", "check_proof", "prove"]

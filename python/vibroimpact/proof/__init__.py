"""Proofs of periodic motions in ball arithmetic.

What a proof rests on stands in `formulas`, `verifier` and `certificate`. All files but `call` and
`result` need python-flint; they are imported when a proof is asked for.
"""

from .call import check_proof, prove
from .result import Disc, Proof, ProofBox

__all__ = ["Disc", "Proof", "ProofBox", "check_proof", "prove"]

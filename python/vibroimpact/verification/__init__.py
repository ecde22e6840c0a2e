"""Is this number real: a run against the exact motion, by the reference simulator.

The modules, each using only those before it, in this order: result (what is handed back), motion
(the exact motion, as precisely as it takes), comparison (the run beside it), call (`verify`
itself). Of these, motion and comparison need python-flint and are imported by the call.
"""

from .call import verify
from .result import Disagreement, Verification

__all__ = ["Disagreement", "Verification", "verify"]

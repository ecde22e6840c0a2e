"""Comparison of a run with the exact motion, by the reference simulator.

Of the modules, `path`, `motion`, `sizes`, `judged`, `comparison`, `told` and those of structures
need python-flint and are imported when `verify` is called.
"""

from .call import verify
from .result import Disagreement, Verification

__all__ = ["Disagreement", "Verification", "verify"]

"""Is this number real: a run against the exact motion, by the reference simulator.

Of the modules, path, motion, sizes and comparison need python-flint and are imported when `verify`
is called. Each uses only those before it, in this order: wording (the summary), result (what is
handed back), stretches (what the run has not kept, made again), watch (has the run parted?), path
(states between events), motion (the exact motion, as precisely as it takes), sizes (what errors are
measured in), comparison (the run beside it), call (`verify` itself).
"""

from .call import verify
from .result import Disagreement, Verification

__all__ = ["Disagreement", "Verification", "verify"]

"""Which named motions are theorems: what simulation finds, proved where python-flint is there."""

import math

from vibroimpact import PeriodicMotion, Run, prove

from .motions import Shown


def theorem(shown: Shown) -> str:
    """Say what is proved of the motions that a claim names, "" if nothing is.

    Those are the motion from the paper's start, after the longer time if there is one, and the
    motion of the paper's label, where another start leads to it.
    """
    runs = [shown.run if shown.long_run is None else shown.long_run]
    other = shown.other
    if other is not None and other.run is not None and other.run.label == shown.motion.paper_says:
        runs.append(other.run)
    return "; ".join(filter(None, map(_proved, runs)))


def _proved(run: Run) -> str:
    """The theorem of the motion that a run settles on, "" where none is shown."""
    motion = run.refine() if run.period.m is not None else None
    if not isinstance(motion, PeriodicMotion):
        return ""
    try:
        proof = prove(motion)
    except ImportError:
        return ""
    if proof.verdict != "proved" or proof.label != run.label:
        return ""
    largest = abs(proof.multipliers[0].center) if proof.multipliers else abs(motion.multipliers[0])
    within = math.floor(math.log10(proof.unique_within))
    return (
        f"the {proof.label} motion exists, is the only one of its order of impacts within "
        f"1e{within}, and is {proof.stability}, |lambda| = {largest:.6g}"
    )

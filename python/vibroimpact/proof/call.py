"""`prove` and `check_proof`: python-flint is imported when they are called."""

from __future__ import annotations

import os
from typing import overload

from ..arguments import path as path_of
from ..arguments import reject
from ..extras import missing
from ..interruption import interruptible
from ..orbits.motion import PeriodicMotion
from ..single_impact.results import PeriodicMotions
from ..structure_motion import StructureOrbit
from .result import Proof
from .solutions_result import SolutionsProof


def _need_flint() -> None:
    """Raise the error for a missing python-flint, with how to install it."""
    try:
        import flint  # noqa: F401
    except ImportError as error:
        raise missing("verify", "a proof needs python-flint") from error


@overload
def prove(motion: PeriodicMotion | StructureOrbit) -> Proof: ...
@overload
def prove(motion: PeriodicMotions) -> SolutionsProof: ...
@interruptible
def prove(motion: PeriodicMotion | StructureOrbit | PeriodicMotions) -> Proof | SolutionsProof:
    """Prove that a periodic motion exists, is the only one near by, and is stable or unstable.

    The conditions of periodicity are solved in ball arithmetic by Krawczyk's operator; at the
    solution all conditions of a motion are shown to hold: flight times, approach velocities, the
    inequalities of each impact's regime, and that no flight meets a stop before its end. The
    parameters are the exact doubles of the system. The docs explain it on the page *Proofs*.

    Parameters
    ----------
    motion
        As ``refine``, ``periodic_motion``, a branch or a search returns it, with impacts, of a
        `System` under every law but ``"paper"``, or of a `Structure`. It need not be admissible:
        then the proof may say that there is no motion. Or all n-1 motions, as
        ``periodic_motions`` returns them.

    Returns
    -------
    Proof
        With its verdict. Motions with complete chatter, sustained contact, or without impacts are
        ``"undecided"``.
    SolutionsProof
        Of all n-1 motions: that there are no others, and a proof for each.

    Raises
    ------
    ParameterError
        If ``motion`` is something else.
    ImportError
        If python-flint is not installed.
    Interrupted
        After Ctrl-C in a proof of all n-1 motions; ``.result`` holds the proofs so far.

    Examples
    --------
    >>> import vibroimpact as vi
    >>> system = vi.System(mass_ratio=0.6, frequency_ratio=2, restitution=0.8, gap=0.5,
    ...                    drive_frequency=1.8, moment_amplitude=1)
    >>> motion = vi.simulate(system, initial=(0, 0.5, 0, 0), periods=600, keep=100).refine()
    >>> vi.prove(motion)
    <Proof of 1-1: proved, stable>
    """
    if isinstance(motion, PeriodicMotions):
        _need_flint()
        from .solutions_files import all_proved

        return all_proved(motion)
    if not isinstance(motion, (PeriodicMotion, StructureOrbit)):
        reject("motion", motion, "a PeriodicMotion, a motion of a Structure, or PeriodicMotions")
    _need_flint()
    from .proving import proved

    return proved(motion)


@interruptible
def check_proof(path: str | os.PathLike[str]) -> Proof | SolutionsProof:
    """Verify a saved certificate anew, from the file alone.

    Nothing of the search for the proof is used: only ball arithmetic and the formulas of the
    theory page (``vibroimpact.proof.formulas`` and ``verifier``).

    Parameters
    ----------
    path
        What ``proof.save`` wrote.

    Returns
    -------
    Proof or SolutionsProof
        What the file proves, which is what it claims.

    Raises
    ------
    ProofError
        If it is damaged, or claims what is not shown.
    ImportError
        If python-flint is not installed.
    OSError
        If it cannot be read.

    Examples
    --------
    >>> import vibroimpact as vi
    >>> system = vi.System(mass_ratio=0.6, frequency_ratio=2, restitution=0.8, gap=0.5,
    ...                    drive_frequency=1.8, moment_amplitude=1)
    >>> motion = vi.simulate(system, initial=(0, 0.5, 0, 0), periods=600, keep=100).refine()
    >>> vi.prove(motion).save("motion.json")
    >>> vi.check_proof("motion.json")
    <Proof of 1-1: proved, stable>
    """
    path = path_of("path", path)
    _need_flint()
    from .reading import read_proof

    return read_proof(path)

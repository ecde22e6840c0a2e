"""`prove` and `check_proof`: python-flint is imported when they are called."""

from __future__ import annotations

import os
from typing import overload

from ..arguments import count, flag, number, pair, reject
from ..arguments import path as path_of
from ..errors import Interrupted
from ..extras import missing
from ..interruption import interruptible
from ..orbits.branch import Branch
from ..orbits.motion import PeriodicMotion
from ..restitution import need_constants
from ..single_impact.results import PeriodicMotions
from ..structure_motion import StructureOrbit
from .branch_result import BranchProof
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
@overload
def prove(
    motion: Branch,
    *,
    within: tuple[float, float] | None = None,
    max_tubes: int = 1000,
    progress: bool = False,
) -> BranchProof: ...
@interruptible
def prove(
    motion: PeriodicMotion | StructureOrbit | PeriodicMotions | Branch,
    *,
    within: tuple[float, float] | None = None,
    max_tubes: int = 1000,
    progress: bool = False,
) -> Proof | SolutionsProof | BranchProof:
    """Prove that a periodic motion exists, is the only one near by, and is stable or unstable.

    The conditions of periodicity are solved in ball arithmetic by Krawczyk's operator; at the
    solution all conditions of a motion are shown to hold: flight times, approach velocities, the
    inequalities of each impact's regime, and that no flight meets a stop before its end. The
    parameters are the exact doubles of the system. The docs explain it on the page *Proofs*.

    Of a branch all that is shown for every value of its parameter in a range, in tubes along it in
    which the solution is unique; bifurcations are enclosed between ranges of one verdict. The other
    parameters are those of ``branch.pieces[0].system``.

    Parameters
    ----------
    motion
        As ``refine``, ``periodic_motion``, a branch or a search returns it, also without impacts,
        of a `System` under every law but ``"paper"``, or of a `Structure`. It need not be
        admissible: then the proof may say that there is no motion. Or all n-1 motions, as
        ``periodic_motions`` returns them. Or a branch of motions, as ``follow`` returns it, over a
        parameter of a `System`, or over the drive's frequency or phase or a number of one stop of a
        `Structure`.
    within
        Of a branch: the range of its parameter, by default all of it.
    max_tubes
        Of a branch: most tubes; what lies beyond stays uncovered.
    progress
        Of a branch: show a bar that counts tubes.

    Returns
    -------
    Proof
        With its verdict. Motions with complete chatter, or with sustained contact are
        ``"undecided"``.
    SolutionsProof
        Of all n-1 motions: that there are no others, and a proof for each.
    BranchProof
        Of a branch. What is not shown is listed in ``uncovered``.

    Raises
    ------
    ParameterError
        If ``motion`` is something else, or an option is not allowed.
    ImportError
        If python-flint is not installed.
    Interrupted
        After Ctrl-C in a proof of all n-1 motions, or of a branch; ``.result`` holds what is
        proved so far.

    Examples
    --------
    >>> import vibroimpact as vi
    >>> system = vi.System(mass_ratio=0.6, frequency_ratio=2, restitution=0.8, gap=0.5,
    ...                    drive_frequency=1.8, moment_amplitude=1)
    >>> motion = vi.simulate(system, initial=(0, 0.5, 0, 0), periods=600, keep=100).refine()
    >>> vi.prove(motion)
    <Proof of 1-1: proved, stable>
    """
    kinds = (PeriodicMotion, StructureOrbit, PeriodicMotions, Branch)
    if not isinstance(motion, kinds):
        one = "a PeriodicMotion, or a motion of a Structure, as run.refine() gives it"
        allowed = f"{one}; PeriodicMotions; or a Branch"
        reject("motion", motion, allowed)
    max_tubes = count("max_tubes", max_tubes, least=1)
    progress = flag("progress", progress)
    if isinstance(motion, Branch):
        span = _range(motion, within)
        _need_flint()
        return _over_a_range(motion, span, max_tubes, progress)
    if within is not None:
        reject("within", within, "None: only a branch has a range of a parameter")
    if isinstance(motion, PeriodicMotions):
        need_constants(motion.system, "proofs that motions are all")
        _need_flint()
        from .solutions_files import all_proved

        return all_proved(motion)
    _need_flint()
    from .proving import proved

    return proved(motion)


def _range(branch: Branch, within: object) -> tuple[float, float]:
    """The range of the parameter, checked."""
    if not len(branch) or all(len(piece.values) < 2 for piece in branch.pieces):
        reject("motion", branch, "a Branch with two points or more")
    low, high = float(branch.values.min()), float(branch.values.max())
    if within is None:
        return low, high
    allowed = f"a range (low, high) inside that of the branch, {low!r} to {high!r}, with low < high"
    first, last = (number("within", x, allowed) for x in pair("within", within, allowed))
    if not low <= first < last <= high:
        reject("within", (first, last), allowed)
    return first, last


def _over_a_range(
    branch: Branch, within: tuple[float, float], max_tubes: int, progress: bool
) -> BranchProof:
    from .branch_proving import Tubes, proved_branch

    bar = None
    if progress:
        from tqdm import tqdm  # here, to keep the import of the package light

        bar = tqdm(desc="proof", unit="tube")
    try:
        found, interrupted = proved_branch(branch, within, Tubes(max_tubes, bar))
    finally:
        if bar is not None:
            bar.close()
    if interrupted:
        raise Interrupted("interrupted", found, holds="what is proved so far")
    return found


@interruptible
def check_proof(path: str | os.PathLike[str]) -> Proof | SolutionsProof | BranchProof:
    """Verify a saved certificate anew, from the file alone.

    Nothing of the search for the proof is used: only ball arithmetic and the formulas of the
    theory page (``vibroimpact.proof.formulas`` and ``verifier``).

    Parameters
    ----------
    path
        What ``proof.save`` wrote, of a motion or of a branch.

    Returns
    -------
    Proof, SolutionsProof or BranchProof
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
    from .kinds import read_proof

    return read_proof(path)

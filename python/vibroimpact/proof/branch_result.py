"""The result of a proof over a range of a parameter."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from ..interruption import interruptible
from ..showing import Facts, counted
from .theorem import Theorem


@interruptible
@dataclass(frozen=True, kw_only=True)
class ProvedStretch:
    """A range of the parameter over which one thing is proved of a branch.

    Attributes
    ----------
    lo, hi
        The range; its ends belong to it.
    verdict
        ``"proved"``: for each value the tube holds exactly one solution, and it is a motion.
        ``"disproved"``: exactly one, and it is no motion.
    stability
        ``"stable"``, ``"unstable"`` or ``"undecided"``, as of `Proof`.
    label
        The motion's m-n.
    why
        If disproved: why.

    Examples
    --------
    >>> import vibroimpact as vi
    >>> vi.ProvedStretch(lo=1.0, hi=1.1, verdict="proved", stability="stable", label="1-1")
    ProvedStretch(lo=1.0, hi=1.1, verdict='proved', stability='stable', label='1-1', why='')
    """

    lo: float
    hi: float
    verdict: str
    stability: str
    label: str
    why: str = ""


@interruptible
@dataclass(frozen=True, kw_only=True)
class ProvedBifurcation:
    """A range of the parameter in which a branch has a bifurcation for certain.

    Attributes
    ----------
    kind
        ``"period_doubling"``: a multiplier is -1. ``"saddle_node"``: the parameter has an extremum
        along the branch. ``"neimark_sacker"``: two conjugate ones are on the unit circle.
        ``"grazing"``, ``"regime_border"``: a condition of a flight, or of an impact's regime, is
        met on one side and violated on the other.
    lo, hi
        The range.
    label
        The motion's m-n.

    Examples
    --------
    >>> import vibroimpact as vi
    >>> found = vi.ProvedBifurcation(kind="saddle_node", lo=1.0, hi=1.1, label="1-1")
    >>> found
    ProvedBifurcation(kind='saddle_node', lo=1.0, hi=1.1, label='1-1')
    """

    kind: str
    lo: float
    hi: float
    label: str


@interruptible
@dataclass(frozen=True, kw_only=True)
class Unproved:
    """A range of the parameter over which something is left open of a branch.

    Attributes
    ----------
    lo, hi
        The range.
    label
        The motion's m-n.
    why
        What is open, or where the search ended.

    Examples
    --------
    >>> import vibroimpact as vi
    >>> vi.Unproved(lo=1.0, hi=1.1, label="1-1", why="stability")
    Unproved(lo=1.0, hi=1.1, label='1-1', why='stability')
    """

    lo: float
    hi: float
    label: str
    why: str


@interruptible
@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class BranchProof(Theorem):
    """What `prove` shows of a branch. All numbers of its system but one are those, exactly.

    Attributes
    ----------
    verdict
        ``"proved"``: something is shown, and nothing is left open. ``"undecided"``: the rest.
    parameter
        The one that varies.
    stretches
        Ranges with one verdict, along the branch.
    bifurcations
        Enclosed ones between them.
    uncovered
        What is left open, with its reason: bifurcations that are not enclosed, and ranges that no
        tube reaches, too.
    certificate
        The problem and the claims in exact numbers, as ``save`` writes them; empty if nothing is
        shown.

    Examples
    --------
    >>> import vibroimpact as vi
    >>> system = vi.System(mass_ratio=0.6, frequency_ratio=2, restitution=0.8, gap=0.5,
    ...                    drive_frequency=1.8, moment_amplitude=1)
    >>> motion = vi.simulate(system, initial=(0, 0.5, 0, 0), periods=600, keep=100).refine()
    >>> proof = vi.prove(motion.follow(drive_frequency=(1.79, 1.805)), within=(1.798, 1.802))
    >>> proof
    <BranchProof over drive_frequency, 1 stretch, 0 bifurcations, 0 uncovered>
    >>> proof.stretches[0]
    ProvedStretch(lo=1.798, hi=1.802, verdict='proved', stability='stable', label='1-1', why='')
    """

    verdict: Literal["proved", "undecided"]
    parameter: str
    stretches: tuple[ProvedStretch, ...]
    bifurcations: tuple[ProvedBifurcation, ...]
    uncovered: tuple[Unproved, ...]

    def _facts(self) -> Facts:
        facts: Facts = {"parameter": self.parameter, "verdict": self.verdict}
        for one in self.stretches:
            told = one.stability if one.verdict == "proved" else "no motion"
            facts[f"{one.lo:.9g} ... {one.hi:.9g}"] = f"{one.label} {told}"
        for found in self.bifurcations:
            facts[f"{found.lo:.12g} ... {found.hi:.12g}"] = found.kind
        return facts

    def __repr__(self) -> str:
        """The parameter, and how much is shown."""
        shown = counted(len(self.stretches), "stretch", ending="es")
        found = counted(len(self.bifurcations), "bifurcation")
        left = len(self.uncovered)
        return f"<BranchProof over {self.parameter}, {shown}, {found}, {left} uncovered>"

"""The result of a proof that motions are all."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from ..interruption import interruptible
from ..showing import Facts
from ..single_impact.results import Undecided
from .result import Proof
from .theorem import Theorem


@interruptible
@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class SolutionsProof(Theorem):
    """What `prove` shows of all motions of n drive periods with one impact, without friction.

    Attributes
    ----------
    verdict
        ``"proved"``: these solutions, and no others, solve the conditions of periodicity with x1 in
        ``within``, and of each it is shown whether it is a motion. ``"undecided"``: not all of
        this is shown.
    why
        Of an undecided one: why.
    n
        Drive periods.
    proofs
        Of the solutions, in order of x1: motions are ``"proved"``, others ``"disproved"``.
    within
        The interval of x1.
    everywhere
        Whether it is shown that no solution lies outside.
    uncovered
        Intervals of x1 that are left open, and why.
    certificate
        The problem and the claims in exact numbers, as ``save`` writes them; empty if undecided.

    Examples
    --------
    >>> import vibroimpact as vi
    >>> system = vi.System(mass_ratio=0.6, frequency_ratio=2, restitution=0.8, gap=0.5,
    ...                    drive_frequency=1.8, moment_amplitude=1)
    >>> proof = vi.prove(vi.periodic_motions(system))
    >>> proof.verdict, proof.everywhere
    ('proved', True)
    >>> len(proof.proofs), proof.count, proof.stable
    (12, 8, 1)
    """

    verdict: Literal["proved", "undecided"]
    why: str
    n: int
    proofs: tuple[Proof, ...]
    within: tuple[float, float]
    everywhere: bool
    uncovered: tuple[Undecided, ...] = ()

    @property
    def motions(self) -> tuple[Proof, ...]:
        """The proofs of those solutions that are motions.

        Examples
        --------
        >>> len(proof.motions)
        8
        """
        return tuple(proof for proof in self.proofs if proof.verdict == "proved")

    @property
    def count(self) -> int:
        """How many motions are proved; if the verdict is ``"proved"``, how many there are.

        Examples
        --------
        >>> proof.count
        8
        """
        return len(self.motions)

    @property
    def stable(self) -> int:
        """How many of them are proved to be asymptotically stable.

        Examples
        --------
        >>> proof.stable
        1
        """
        return sum(proof.stability == "stable" for proof in self.motions)

    def _facts(self) -> Facts:
        facts: Facts = {"motions": f"{self.n}-1", "verdict": self.verdict}
        if self.why:
            facts["why"] = self.why
        facts["x1"] = "everywhere" if self.everywhere else f"in {list(self.within)}"
        facts |= {"solutions": len(self.proofs), "motions proved": self.count}
        return facts | {"stable": self.stable, "uncovered": len(self.uncovered)}

    def __repr__(self) -> str:
        """Counts and verdict."""
        told = "" if self.verdict == "proved" else f", {self.why}"
        return (
            f"<SolutionsProof of all {self.n}-1 motions: {self.verdict}{told}; "
            f"{self.count} motions, {self.stable} stable, among {len(self.proofs)} solutions>"
        )

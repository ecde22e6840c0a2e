"""The result of a proof: what is shown of a periodic motion, in numbers and in a sentence."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from ..fixed_arrays import FixedArrays
from ..interruption import interruptible
from ..showing import Facts, Shown, in_a_line
from .theorem import Theorem

Array = NDArray[np.float64]


@interruptible
@dataclass(frozen=True)
class Disc:
    """A disc of the complex plane that holds a number for certain.

    Attributes
    ----------
    center, radius
        Of the disc.

    Examples
    --------
    >>> import vibroimpact as vi
    >>> system = vi.System(mass_ratio=0.6, frequency_ratio=2, restitution=0.8, gap=0.5,
    ...                    drive_frequency=1.8, moment_amplitude=1)
    >>> motion = vi.simulate(system, initial=(0, 0.5, 0, 0), periods=600, keep=100).refine()
    >>> disc = vi.prove(motion).multipliers[0]
    >>> disc.radius < 1e-14 and 0.5 not in disc
    True
    """

    center: complex
    radius: float

    def __contains__(self, number: complex) -> bool:
        """Whether a number lies in it."""
        return abs(number - self.center) <= self.radius


@interruptible
@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class ProofBox(FixedArrays, Shown):
    """Numbers with a bound of their error.

    Attributes
    ----------
    center, radius
        Of each number, arrays of one shape. The bounds are for the centers as they are here, in
        double precision; a certificate has more digits.

    Examples
    --------
    >>> import vibroimpact as vi
    >>> system = vi.System(mass_ratio=0.6, frequency_ratio=2, restitution=0.8, gap=0.5,
    ...                    drive_frequency=1.8, moment_amplitude=1)
    >>> motion = vi.simulate(system, initial=(0, 0.5, 0, 0), periods=600, keep=100).refine()
    >>> box = vi.prove(motion).box
    >>> box.center.shape  # one impact: x1, x2, v1, v2, t
    (1, 5)
    >>> bool((box.radius < 1e-14).all())
    True
    """

    center: Array
    radius: Array

    def _facts(self) -> Facts:
        return {"center": in_a_line(self.center.ravel()), "radius": f"{self.radius.max():.2g}"}

    def __repr__(self) -> str:
        """How many numbers, and the widest bound."""
        return f"<ProofBox of {self.center.size} numbers, to {self.radius.max():.2g}>"


@interruptible
@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class Proof(FixedArrays, Theorem):
    """What `prove` shows of a periodic motion. All numbers are those of its system, exactly.

    Attributes
    ----------
    verdict
        ``"proved"``: the motion exists, is the only one near by, strikes in its order of impacts
        and nowhere else. ``"disproved"``: the box around it holds no solution, or the only one in
        it is no motion. ``"undecided"``: neither is shown.
    why
        Of the last two: why.
    solved
        Whether the box holds a solution: of a proved motion it does; of a disproved one that
        solution is no motion.
    label
        The motion's m-n.
    box
        Nodes of the solution, (legs, 2N + 1): q, v just after each impact, and its time t; of a
        `System` x1, x2, v1, v2, t (x1, v1, t where the second body is a wall at rest). None if
        nothing is shown.
    unique_within
        Another solution with the same order of impacts and the same regimes differs from the
        center of the box by more than this in some number. 0 if that is not shown.
    multipliers
        Discs of the Floquet multipliers, by falling modulus, of a motion that is proved; none where
        they are too close to each other to be told apart.
    stability
        ``"stable"``: all multipliers lie inside the unit circle. ``"unstable"``: one lies outside.
        ``"undecided"``: neither is shown, as of neutral motions.
    certificate
        The problem and the claims in exact numbers, as ``save`` writes them; empty if undecided.

    Examples
    --------
    >>> import vibroimpact as vi
    >>> system = vi.System(mass_ratio=0.6, frequency_ratio=2, restitution=0.8, gap=0.5,
    ...                    drive_frequency=1.8, moment_amplitude=1)
    >>> motion = vi.simulate(system, initial=(0, 0.5, 0, 0), periods=600, keep=100).refine()
    >>> proof = vi.prove(motion)
    >>> proof.verdict, proof.stability
    ('proved', 'stable')
    >>> round(abs(proof.multipliers[0].center), 4)
    0.9587
    """

    verdict: Literal["proved", "disproved", "undecided"]
    why: str
    label: str
    solved: bool = False
    box: ProofBox | None = None
    unique_within: float = 0.0
    multipliers: tuple[Disc, ...] = ()
    stability: Literal["stable", "unstable", "undecided"] = "undecided"

    def _facts(self) -> Facts:
        facts: Facts = {"motion": self.label, "verdict": self.verdict}
        if self.why:
            facts["why"] = self.why
        if self.verdict == "proved":
            facts["stability"] = self.stability
            facts["multipliers"] = ", ".join(f"{disc.center:.6g}" for disc in self.multipliers)
            facts["the only one within"] = f"{self.unique_within:.2g}"
        return facts

    def __repr__(self) -> str:
        """Label and verdict."""
        told = self.stability if self.verdict == "proved" else self.why
        return f"<Proof of {self.label}: {self.verdict}, {told}>"

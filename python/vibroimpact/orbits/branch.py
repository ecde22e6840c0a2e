"""A branch of periodic motions over one parameter: its pieces and its located bifurcations."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from .. import _core
from .._core import Leg, LegKind
from ..arguments import close_to, reject
from ..interruption import interruptible
from ..made import varied
from ..system import System
from ..verbs import verb
from .kinds import BifurcationKind, BranchEnd, Test
from .motion import NEUTRAL, PeriodicMotion

Array = NDArray[np.float64]


@interruptible
@dataclass(frozen=True, kw_only=True, eq=False)
class Bifurcation:
    """A located bifurcation of a periodic motion.

    Attributes
    ----------
    kind
        ``saddle_node``, ``period_doubling``, ``neimark_sacker``, ``neutral_saddle`` (no
        bifurcation), ``branch_point``, or a border: ``grazing``, ``regime_border``,
        ``chatter_onset``, ``contact_border``.
    parameter, value
        Name and value of the parameter.
    motion
        The motion there.
    test, test_value
        The function that vanishes there, and its remaining value.
    goes_on
        At a border: the legs beyond it, ``()`` where the branch ends.
    """

    kind: BifurcationKind
    parameter: str
    value: float
    motion: PeriodicMotion
    test: Test
    test_value: float
    goes_on: tuple[Leg, ...] = ()

    def __repr__(self) -> str:
        """Kind, place and motion."""
        return f"<{self.kind} of {self.motion.label} at {self.parameter} = {self.value:.12g}>"


@dataclass(frozen=True, kw_only=True, eq=False)
class Piece:
    """Part of a branch with one sequence of legs.

    Attributes
    ----------
    system
        The system, at any value of the parameter.
    parameter
        Name of the parameter.
    itinerary
        The legs.
    values
        Of the parameter, shape (k,).
    nodes
        Shape (k, legs, 4), as in PeriodicMotion.
    multipliers
        Complex, by falling modulus, shape (k, 4) or (k, 2).
    """

    system: System
    parameter: str
    itinerary: _core.Itinerary
    values: Array
    nodes: Array
    multipliers: NDArray[np.complex128]

    @property
    def stable(self) -> NDArray[np.bool_]:
        """Whether all multipliers lie inside the unit circle, shape (k,)."""
        inside: NDArray[np.bool_] = np.abs(self.multipliers).max(axis=1) < 1.0 - NEUTRAL
        return inside

    @property
    def label(self) -> str:
        """The label of the motion, m-n."""
        legs = self.itinerary.legs
        impacts = sum(leg.kind is LegKind.IMPACT for leg in legs)
        return f"{self.itinerary.periods}-{'inf' if Leg.CHATTER in legs else impacts}"

    def __repr__(self) -> str:
        """Label, range and number of points."""
        low, high = self.values.min(), self.values.max()
        return (
            f"<Piece {self.label}, {self.parameter} {low:.6g} ... {high:.6g}, "
            f"{len(self.values)} points>"
        )

    def motion(self, k: int) -> PeriodicMotion:
        """Return the k-th motion, with its verdict."""
        motion: PeriodicMotion
        motion = verb("motion_of")(self._system_at(k), self.itinerary, self.nodes[k].copy())
        return motion

    def _system_at(self, k: int) -> System:
        return varied(self.system, {self.parameter: float(self.values[k])})

    @cached_property
    def impacts(self) -> Array:
        """x1 at the impacts that do not belong to chatter, shape (k, impacts)."""
        after = [i for i, leg in enumerate(self.itinerary.legs) if leg.kind is LegKind.IMPACT]
        count = len(self.itinerary.legs)
        return self.nodes[:, [(i + 1) % count for i in after], 0]

    @cached_property
    def sections(self) -> Array:
        """x1 at the starts of the m drive periods, shape (k, m)."""
        motion_of = verb("motion_of")
        # With ``whole``: at a period doubling an orbit that repeats twice would become a single
        # one.
        motions = (
            motion_of(self._system_at(k), self.itinerary, nodes.copy(), whole=True)
            for k, nodes in enumerate(self.nodes)
        )
        return np.array([motion.sections[:, 0] for motion in motions])


@interruptible
@dataclass(frozen=True, kw_only=True, eq=False)
class Branch:
    """A branch of periodic motions over one parameter.

    Attributes
    ----------
    parameter
        Its name.
    pieces
        In order along the branch, each with one sequence of legs.
    bifurcations
        In order along the branch.
    ends
        Why the branch ends, at its first and last point: ``bound``, the kind of a border that it
        does not pass, ``points``, ``closed``, ``start``, ``no convergence``, ``outside domain``,
        ``interrupted``, or ``refused``: a simulation does not confirm the next point.
    why_not
        For each end that is ``refused``: the reason of the simulation; else ``""``.
    """

    parameter: str
    pieces: tuple[Piece, ...]
    bifurcations: tuple[Bifurcation, ...]
    ends: tuple[BranchEnd, BranchEnd]
    why_not: tuple[str, str] = ("", "")

    @property
    def values(self) -> Array:
        """The parameter along the branch, shape (k,)."""
        return np.concatenate([np.empty(0), *(piece.values for piece in self.pieces)])

    @property
    def stable(self) -> NDArray[np.bool_]:
        """Whether the motion is stable, shape (k,)."""
        return np.concatenate([np.empty(0, bool), *(piece.stable for piece in self.pieces)])

    def of_kind(self, kind: str) -> list[Bifurcation]:
        """Return the bifurcations of one kind, such as ``"period_doubling"``.

        Raises
        ------
        ParameterError
            If there is no such kind.
        """
        known = tuple(BifurcationKind)
        if not isinstance(kind, str) or kind not in known:
            hint = close_to(kind, known) if isinstance(kind, str) else ""
            reject("kind", kind, f"one of {', '.join(known)}{hint}")
        return [found for found in self.bifurcations if found.kind == kind]

    def __repr__(self) -> str:
        """Labels, range and what happens on it."""
        if not self.pieces:
            return f"<Branch without points, ends: {self.ends[0]}, {self.ends[1]}>"
        labels = " ".join(dict.fromkeys(piece.label for piece in self.pieces))
        low, high = self.values.min(), self.values.max()
        return (
            f"<Branch {labels}, {self.parameter} {low:.6g} ... {high:.6g}, "
            f"{len(self.bifurcations)} bifurcations, ends: {self.ends[0]}, {self.ends[1]}>"
        )

"""Kinds of bifurcations of periodic motions, and the test functions that find them."""

from __future__ import annotations

from enum import StrEnum

from .._core import BorderKind, Condition, StopCondition
from ..continuation.names import OwnTest, PathEnd


class BifurcationKind(StrEnum):
    """A kind of bifurcation; equal to its name, such as ``"period_doubling"``."""

    SADDLE_NODE = "saddle_node"
    PERIOD_DOUBLING = "period_doubling"
    NEIMARK_SACKER = "neimark_sacker"
    NEUTRAL_SADDLE = "neutral_saddle"
    BRANCH_POINT = "branch_point"
    # The borders of a sequence of legs, as the core names them.
    GRAZING = BorderKind.GRAZING.value
    REGIME_BORDER = BorderKind.REGIME_BORDER.value
    CHATTER_ONSET = BorderKind.CHATTER_ONSET.value
    CONTACT_BORDER = BorderKind.CONTACT_BORDER.value
    # Of codimension two, on curves only.
    CUSP = "cusp"
    RESONANCE_1_1 = "resonance_1_1"
    RESONANCE_1_2 = "resonance_1_2"
    RESONANCE_1_3 = "resonance_1_3"
    RESONANCE_1_4 = "resonance_1_4"

    @classmethod
    def _missing_(cls, value: object) -> BifurcationKind | None:
        # A fold of any equations is called saddle-node for motions.
        return cls.SADDLE_NODE if value == OwnTest.FOLD else None


class Branching(StrEnum):
    """How two branches cross at a branch point; equal to its name."""

    # A motion that is its own mirror image, -q half a period later, loses that.
    SYMMETRY_BREAKING = "symmetry-breaking pitchfork"
    # On one of the branches the parameter has an extremum: as a rule a symmetry is lost there.
    PITCHFORK = "pitchfork"
    TRANSCRITICAL = "transcritical"


# Those of curves in two parameters: no branch meets them.
ON_CURVES = frozenset(
    kind for kind in BifurcationKind if kind is BifurcationKind.CUSP or "resonance" in kind
)
# The borders: beyond them the motion has other legs.
BORDERS = frozenset(BifurcationKind(kind.value) for kind in BorderKind)
# Where u of an impact vanishes, its other tests may vanish as well: that is a grazing.
FIRST = (BifurcationKind.GRAZING,)
# What vanishes at a bifurcation: a condition of a leg, a function of the multipliers named as the
# bifurcation, or a function of the path itself.
Test = Condition | StopCondition | BifurcationKind | OwnTest
# The conditions of legs, of a System and of a Structure.
CONDITIONS = (Condition, StopCondition)
# Why a branch or a curve ends: the bifurcation with which its motion ends, or another reason.
BranchEnd = PathEnd | BifurcationKind

"""The keywords of continuation as types, for type checkers: options, and parameters with ranges."""

from collections.abc import Sequence
from typing import TypedDict

from ..keyword_types import Ranges


class Steps(TypedDict, total=False):
    """What all of them take."""

    max_step: float
    max_points: int


class SwitchCall(Steps, Ranges, total=False):
    """Keywords of ``switch_branch``."""

    step: float | None
    both: bool
    direction: int
    stop_at: str | Sequence[str]


class FollowCall(SwitchCall, total=False):
    """Keywords of ``follow_motion``."""

    virtual: bool


class CurveCall(Steps, Ranges, total=False):
    """Keywords of ``bifurcation_curve`` and ``stability_region``."""

    step: float

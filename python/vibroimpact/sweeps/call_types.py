"""The keywords of sweeps as types, for type checkers: options, and names that can be varied."""

import os
from collections.abc import Sequence
from typing import Any, TypedDict

from ..keyword_types import Axes, Parameters
from .diagram_results import Start


class Options(TypedDict, total=False):
    """What all sweeps take."""

    periods: int
    keep: int | None
    max_events: int | None
    chatter_tolerance: float
    progress: bool
    workers: int | None
    chunk: int | None
    client: Any
    store: str | os.PathLike[str] | None


class LabelOptions(Options, total=False):
    """What sweeps that give labels take."""

    labels: bool
    section_phase: float


class SweepCall(LabelOptions, Axes, total=False):
    """Keywords of ``sweep``."""

    exponents: bool


class ChartCall(LabelOptions, Parameters, total=False):
    """Keywords of ``chart``."""

    exponents: bool | None


class DiagramCall(LabelOptions, Parameters, total=False):
    """Keywords of ``bifurcation_diagram``."""

    start: Start | Sequence[Start]
    exponents: bool
    refine: int


class LyapunovCall(Options, Axes, total=False):
    """Keywords of ``lyapunov_spectrum``."""

    time: float | None
    most: int | None

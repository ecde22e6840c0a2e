"""Nonsmooth modes: the natural motions that begin where a linear mode grazes a stop."""

from __future__ import annotations

import functools
import math
from typing import Any, Final

import numpy as np

from .._core import Border, Regime, StopCondition, StopLeg, StructureItinerary
from ..arguments import count, number, pair, reject
from ..interruption import interruptible
from ..made import MadeStructure
from ..structure import Structure
from .branch import Branch
from .following import Settings, followed
from .resegment import oriented
from .undriven import UndrivenProblem, is_undriven

# As drive frequencies from 1e-50 on.
LARGEST_PERIOD: Final = 1e50


@interruptible
def nonsmooth_mode(
    structure: Structure,
    *,
    period: tuple[float, float],
    mode: int = 0,
    stop: int = 0,
    step: float | None = None,
    max_step: float = 0.05,
    max_points: int = 2000,
) -> Branch:
    """Follow the natural motions with impacts that begin where a linear mode grazes a stop.

    Without drive, damping and losses a structure has such motions for a range of periods: at every
    energy there is one. They are followed over their period, which is unknown otherwise, from that
    of the mode on.

    Parameters
    ----------
    structure
        A structure without drive, damping, loads and moving stops, whose stops have restitution 1
        and no friction.
    period
        Range of periods (low, high) around that of the mode.
    mode
        Number of the mode, from 0.
    stop
        Number of the stop that it meets, from 0.
    step
        First step of the continuation, as in ``follow_motion``.
    max_step
        Largest step, likewise.
    max_points
        Most points of the branch.

    Returns
    -------
    Branch
        Over ``period``. The structures of its motions have the drive frequency 2 pi/period and no
        drive. Two multipliers are 1, so that a motion is ``"unstable"`` or ``"undecided"``.

    Raises
    ------
    ParameterError
        For bad input, and for a structure or a mode that has no such motions.
    Interrupted
        After Ctrl-C; ``.result`` is the branch so far.

    Examples
    --------
    >>> import numpy as np
    >>> import vibroimpact as vi
    >>> masses = vi.Structure(np.eye(2), [[2, -1], [-1, 1]], [vi.Stop([0, 1], 1.0, 1.0)])
    >>> branch = vi.nonsmooth_mode(masses, mode=0, period=(6.0, 10.5))
    >>> branch.parameter, branch.at(period=9.0)[0].label
    ('period', '1-1')
    """
    if not isinstance(structure, Structure):
        reject("structure", structure, "a vibroimpact.Structure")
    _must_be_natural(structure)
    mode = count("mode", mode, least=0, most=len(structure.frequencies) - 1)
    stop = count("stop", stop, least=0, most=len(structure.stops) - 1)
    at, frequency = structure.stops[stop], float(structure.frequencies[mode])
    shape = structure.shapes[:, mode]
    reach = float(at.normal @ shape)
    if frequency == 0.0 or abs(reach) <= 1e-12 * float(np.abs(at.normal) @ np.abs(shape)):
        reject("mode", mode, f"a mode with a frequency > 0 that moves towards stop {stop}")
    if not at.gap > 0.0:
        reject("gap", at.gap, f"a number > 0 of stop {stop}, at which the mode can graze")
    begin = math.tau / frequency
    allowed = (
        f"a range (low, high) around the period of the mode, {begin!r}, up to {LARGEST_PERIOD!r}"
    )
    low, high = (number("period", end, allowed) for end in pair("period", period, allowed))
    if not 0.0 < low <= begin <= high <= LARGEST_PERIOD or low == high:
        reject("period", (low, high), allowed)
    settings = Settings.checked("period", (low, high), step, max_step, max_points)
    maker = functools.partial(_with_period, structure)
    made = MadeStructure.of(maker, {"period": begin}, {"period": high - low})
    place = shape * at.gap / reach
    state = structure._to_core(np.array([place, np.zeros(len(shape))]))
    node = np.append(state.ravel(), 0.0)[None]
    legs = StructureItinerary([StopLeg.impact(stop, Regime.FRICTIONLESS)], 1, [0])
    problem = UndrivenProblem(made, legs, ("period",))
    grows = StopCondition(Border.APPROACH_VELOCITY, 0, stop)
    start = oriented(problem, np.array([begin]), legs, node, grows)
    if start is None:
        reject("mode", mode, "a mode from which a branch of motions with impacts leaves")
    return followed(made, start, (1,), settings)


def _with_period(structure: Structure, period: float) -> Structure:
    return structure.replace(drive_frequency=math.tau / period)


def _must_be_natural(structure: Structure) -> None:
    numbers: dict[str, Any] = {
        "drive_amplitude": structure.drive_amplitude,
        "static_load": structure.static_load,
        "damping": structure.damping,
        "damping_ratios": structure.damping_ratios,
    }
    for name, value in numbers.items():
        if value is not None and np.any(value):
            reject(name, value, "zero or None: such motions lose and gain nothing")
    if not structure.stops:
        reject("stops", structure.stops, "at least one stop")
    for place, stop in enumerate(structure.stops):
        if stop.restitution != 1.0:
            reject(f"stops[{place}].restitution", stop.restitution, "1: no impact loses energy")
        if stop.friction != 0.0:
            reject(f"stops[{place}].friction", stop.friction, "0: no impact loses energy")
    if not is_undriven(structure):
        reject("stops", structure.stops, "stops that do not move")

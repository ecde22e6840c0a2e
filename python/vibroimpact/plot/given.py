"""Checks of what drawing functions are given, and what they draw unless they are told.

The angle at the impact section says nothing where body 2 is a wall at rest: every impact is at the
place of the wall. There the figures draw the approach velocity u instead (theory page,
section 6). This rule is here and nowhere else.
"""

from __future__ import annotations

from typing import Any, Final, TypeVar

import numpy as np
from numpy.typing import NDArray

from ..arguments import reject
from ..errors import ParameterError
from ..fitting import Fit
from ..hints import close_to
from ..impact_results import ImpactAgreement, ImpactRegimes
from ..orbits import Branch, PeriodicMotion
from ..run import Run
from ..single_impact import MotionMap
from ..structure_motion import StructureOrbit
from ..structure_run import StructureRun
from ..sweeps import Diagram, LyapunovSpectrum, LyapunovSweep, Sweep
from ..sweeps.basins.results import Basins
from ..system import System

Item = TypeVar("Item")

# What draws a result, for the error about a result of another kind.
_DRAWN_BY: Final[tuple[tuple[type, str], ...]] = (
    (Run, "time_history, phase_portrait, impact_section, stroboscopic, animation"),
    (StructureRun, "time_history, phase_portrait, impact_section, stroboscopic, animation"),
    (PeriodicMotion, "orbit, multipliers"),
    (StructureOrbit, "orbit, multipliers"),
    (Branch, "branches, multipliers"),
    (Fit, "fit"),
    (Diagram, "bifurcation, contact_fraction"),
    (Basins, "basins"),
    (LyapunovSpectrum, "lyapunov"),
    (LyapunovSweep, "lyapunov"),
    (Sweep, "chart"),
    (MotionMap, "motion_branches, motion_space, stability_map"),
    (ImpactRegimes, "impact_regimes"),
    (ImpactAgreement, "impact_agreement"),
)
# A wall that moves less than this part of body 1, by their velocities at impact, is at rest.
_AT_REST = 1e-9


def expected(name: str, given: Any, kind: type[Item]) -> Item:
    """Return an object of a kind, or say which function draws what was given instead."""
    if isinstance(given, kind):
        return given
    allowed = f"a vibroimpact.{kind.__name__}"
    for other, functions in _DRAWN_BY:
        if isinstance(given, other):
            allowed += f"; what draws a {other.__name__} in vibroimpact.plot: {functions}"
            break
    reject(name, given, allowed)


def of_system(**given: Any) -> None:
    """Refuse arguments that only the run of a System takes, where it is that of a structure."""
    for name, value in given.items():
        if value is not None:
            why = "a structure has no scales" if name == "units" else "a structure has coordinates"
            reject(name, value, f"None: {why}")


def of_structure(**given: Any) -> None:
    """Refuse arguments that only the run of a structure takes, where it is that of a System."""
    for name, value in given.items():
        if value is not None:
            reject(name, value, "None but for the run of a structure")


def chosen(name: str, given: Any, known: tuple[str, ...]) -> str:
    """Return one of the known names, or suggest the one that was meant."""
    if not isinstance(given, str) or given not in known:
        hint = close_to(given, known) if isinstance(given, str) else ""
        reject(name, given, f"one of {', '.join(known)}{hint}")
    return given


def regime_color(color: Any) -> bool:
    """Return whether impacts are to be coloured by their regime."""
    if color is not None and not (isinstance(color, str) and color == "regime"):
        reject("color", color, "'regime' or None")
    return color is not None


def wall_at_rest(system: System, v1: NDArray[np.float64], v2: NDArray[np.float64]) -> bool:
    """Return whether body 2 is a wall that rests at all impacts, by the velocities before them."""
    moving = float(np.abs(v2).max(initial=0.0))
    return system.is_wall and moving <= _AT_REST * float(np.abs(v1).max(initial=0.0))


def run_hits_wall_at_rest(run: Run) -> bool:
    """Return whether body 2 of a run is a wall at rest."""
    system, (_, _, x2, v2) = run.system, run.initial
    equilibrium = x2 == system.static_force and v2 == 0.0
    still = system.is_wall and system.force_amplitude == 0.0 and equilibrium
    hits = run.impacts
    return still or (len(hits) > 0 and wall_at_rest(system, hits["v1_pre"], hits["v2_pre"]))


def usual_value(section: str, result: Diagram | Branch) -> str:
    """Return what of a section is drawn by default: the angle, or where it says nothing u."""
    if isinstance(result, Diagram):
        # The system of a diagram has one value of what varies.
        one = result.parameter_name != "mass_ratio"
        at_rest = one and wall_at_rest(result.system, result.v1, result.v2)
    else:
        at_rest = all(piece.itinerary.wall_at_rest for piece in result.pieces)
    return "approach_velocity" if at_rest and section == "impact" else "x1"


def impact_column(run: Run, name: str, argument: str) -> NDArray[Any]:
    """Return a column of the impact table of a run, or the approach velocity."""
    impacts = run.impacts
    known = impacts.dtype.names or ()
    if name in known:
        return np.asarray(impacts[name])
    chosen(argument, name, tuple(dict.fromkeys((*known, "approach_velocity"))))
    before = np.column_stack([impacts[each] for each in ("x1", "v1_pre", "x2", "v2_pre")])
    return np.asarray(run.system.gap_rate(before))


def bodies_of(given: Any, run: Run) -> tuple[int, ...]:
    """Return the numbers of the bodies to draw: by default all but a wall at rest."""
    if given is None:
        return (1,) if run_hits_wall_at_rest(run) else (1, 2)
    one = isinstance(given, int) and not isinstance(given, bool)
    try:
        many = (given,) if one else tuple(given)
    except TypeError:
        many = ()
    if not many or isinstance(given, str) or not all(body in (1, 2) for body in many):
        reject("bodies", given, "1, 2, (1, 2) or None")
    return tuple(int(body) for body in many)


def sectioned(run: Run | StructureRun) -> None:
    """Refuse a run without a stroboscopic section."""
    if run.system.drive_frequency == 0.0:
        raise ParameterError(
            "run.system.drive_frequency = 0.0 is not allowed; allowed: a number > 0: without "
            "drive period the run has no stroboscopic section"
        )

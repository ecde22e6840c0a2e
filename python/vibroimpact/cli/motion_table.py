"""Tables of periodic motions: what is printed of each, and the columns of its CSV row."""

from collections.abc import Sequence
from typing import Any

from ..orbits import PeriodicMotion
from ..scales import Units, chosen
from ..structure_motion import StructureOrbit

_MOST_MULTIPLIERS = 4
CSV_NAMES = (
    *("label", "m", "n", "admissible", "stable", "why_not"),
    *("x1", "v1", "v2", "phase"),
    *(f"initial_{name}" for name in ("x1", "v1", "x2", "v2")),
    *(
        f"multiplier_{number}_{part}"
        for number in range(1, _MOST_MULTIPLIERS + 1)
        for part in ("real", "imag")
    ),
    *("residual", "error"),
)
PRINTED_NAMES = ("motion", "x1", "v1", "v2", "phase", "|lambda|", "verdict")
_PRINTED_OF_STRUCTURES = ("motion", "|lambda|", "verdict")

COLUMNS = """\
  label, m, n      the motion m-n; n is inf with complete chatter
  admissible       whether the solution is a motion of the system
  stable           whether it is a motion with all multipliers inside the
                   unit circle
  why_not          why it is no motion, if it is none
  x1, v1, v2       state just before the first impact (without impacts: at
                   the start of a drive period)
  phase            drive phase there, -pi to pi
  initial_x1 ...   x1, v1, x2, v2 at t = 0, as --initial takes them
  multiplier_1_real, multiplier_1_imag ...
                   the Floquet multipliers by falling modulus; two of a wall
  residual, error  of the conditions of periodicity, and of the solution
and of a structure label, m, n, stability (stable, unstable or undecided),
  initial_q_0 ..., initial_v_0 ..., multiplier_1_real ..., residual, and as
  error that of the moduli of the multipliers"""


def csv_row(motion: PeriodicMotion | StructureOrbit, units: Units | None = None) -> dict[str, Any]:
    """Return the columns of a motion by name: `CSV_NAMES`, or those of a structure."""
    if isinstance(motion, StructureOrbit):
        return _of_structure(motion)
    parts = [part for value in motion.multipliers.tolist() for part in (value.real, value.imag)]
    parts += [""] * (2 * _MOST_MULTIPLIERS - len(parts))
    verdict = (int(motion.admissible), int(motion.stable), motion.why_not)
    values = (
        *(motion.label, motion.m, motion.n, *verdict),
        *_state(motion, units),
        *_initial(motion, units),
        *parts,
        *(motion.residual, motion.error),
    )
    return dict(zip(CSV_NAMES, values, strict=True))


def _of_structure(motion: StructureOrbit) -> dict[str, Any]:
    rows = zip(("q", "v"), motion.state.tolist(), strict=True)
    state = {f"initial_{name}_{i}": x for name, row in rows for i, x in enumerate(row)}
    multipliers = {
        f"multiplier_{number}_{part}": getattr(value, part)
        for number, value in enumerate(motion.multipliers.tolist(), start=1)
        for part in ("real", "imag")
    }
    return {
        **{"label": motion.label, "m": motion.m, "n": motion.n, "stability": motion.stability},
        **state,
        **multipliers,
        **{"residual": motion.residual, "error": motion.error},
    }


def _state(motion: PeriodicMotion, units: Units | None) -> list[float]:
    """Return x1, v1, v2 and phase just before the first impact."""
    x1, v1, v2, phase = motion.state
    scales = chosen(units, motion.system.scales)
    rows = [x1, v1, 0.0, v2] if scales is None else scales.to_si([x1, v1, 0.0, v2]).tolist()
    return [rows[0], rows[1], rows[3], phase]


def _initial(motion: PeriodicMotion, units: Units | None) -> list[float]:
    scales = chosen(units, motion.system.scales)
    return [*motion.initial] if scales is None else scales.to_si(motion.initial).tolist()


def printed_row(
    motion: PeriodicMotion | StructureOrbit, units: Units | None = None
) -> dict[str, str]:
    """Return the columns of a motion as they are printed: `PRINTED_NAMES`, or of a structure."""
    size = abs(motion.multipliers[0])
    numbers = [size]
    if isinstance(motion, PeriodicMotion):
        numbers = [*_state(motion, units), size]
    told = verdict(motion)
    if isinstance(motion, StructureOrbit) and motion.is_symmetric is False:
        told += "; its mirror image is another motion"
    values = [motion.label, *(f"{value:.9g}" for value in numbers), told]
    names = PRINTED_NAMES if isinstance(motion, PeriodicMotion) else _PRINTED_OF_STRUCTURES
    return dict(zip(names, values, strict=True))


def verdict(motion: PeriodicMotion | StructureOrbit) -> str:
    """Say whether it is a motion, and stable."""
    if isinstance(motion, StructureOrbit):
        return motion.stability
    if not motion.admissible:
        return f"no motion: {motion.why_not}"
    return "stable" if motion.stable else "unstable"


def shown(motions: Sequence[Any], most: int) -> list[Any]:
    """Return the first motions to draw, of the admissible ones if there are any."""
    chosen = [motion for motion in motions if getattr(motion, "admissible", True)] or list(motions)
    return chosen[:most]

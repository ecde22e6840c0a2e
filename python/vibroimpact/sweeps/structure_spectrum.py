"""Lyapunov exponents of a motion of a structure."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, TypeGuard

import numpy as np

from .. import _core
from ..arguments import count, kept_periods, positive, reject
from ..errors import Interrupted, SimulationError
from ..run_parts import read_only
from ..simulation import simulate
from ..structure import Structure
from ..structure_motion import StructureSpectrum

# As in lyapunov.py.
_LEAST, _STEPS, _LOOKED_AT = 20, 1000, 100


def is_structure(system: Any) -> TypeGuard[Structure]:
    """Whether this is a structure."""
    return isinstance(system, Structure)


def structure_spectrum(
    structure: Structure,
    initial: Any,
    time: float | None,
    periods: int | None,
    keep: int | None,
    most: int | None,
    options: Mapping[str, Any],
    refused: Mapping[str, Any],
) -> StructureSpectrum:
    """Measure the exponents of one motion; arguments as in ``lyapunov_spectrum``.

    Raises
    ------
    ParameterError, StateError
        If an argument is out of range, before any work.
    SimulationError
        If the motion ends, or its derivatives could not be computed.
    Interrupted
        After Ctrl-C; ``.result`` is the spectrum up to there.
    """
    for name, value in refused.items():
        if value is not None:
            reject(name, value, "None: exponents of a structure are of one motion so far")
    if time is not None:
        if periods is not None or keep is not None or structure.drive_frequency > 0.0:
            reject("time", time, "None, but for drive_frequency = 0")
        time = positive("time", time)
        length: dict[str, Any] = {"time": 0.25 * time}
        steps, step = _STEPS, 0.75 * time / _STEPS
    else:
        if structure.drive_frequency == 0.0:
            reject("time", time, "a number > 0: without a drive there are no periods")
        periods = count("periods", 2000 if periods is None else periods, least=_LEAST)
        usual = max(-(-3 * periods // 4), _LEAST)
        steps, step = kept_periods(keep, periods, usual=usual, least=_LEAST), None
        before = max(periods - steps, 1)
        length = {"periods": before, "keep": min(before, _LOOKED_AT)}
    modes = structure._compiled.frequencies
    most = 2 * len(modes) if most is None else count("most", most, least=1, most=2 * len(modes))
    run = simulate(structure, initial=initial, **length, **options)
    found = _core.structure_spectrum(run._core, steps, most, step)
    spectrum = StructureSpectrum(
        exponents=read_only(found.exponents),
        error=read_only(found.errors),
        time=found.time,
        impacts=read_only(np.array(found.impacts, np.int64)),
        history_time=read_only(found.history_time),
        history=read_only(found.history),
        label=run.label,
        system=structure,
    )
    if found.interrupted:
        message = f"interrupted after a time {found.time:g} of the measurement"
        raise Interrupted(message, spectrum, holds="it")
    if found.error is not None:
        raise SimulationError(f"no Lyapunov exponents: {found.error}")
    return spectrum

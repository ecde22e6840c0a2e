"""Lyapunov exponents of a motion of a structure."""

from __future__ import annotations

import numpy as np

from .. import _core
from ..arguments import count
from ..run_parts import read_only
from ..structure import Structure
from ..structure_motion import StructureSpectrum
from ..structure_run import StructureRun
from .lyapunov_results import measured_whole


def most_of(structure: Structure, most: int | None) -> int:
    """Return how many exponents are measured; ParameterError for more than there are."""
    whole = 2 * len(structure._compiled.frequencies)
    return whole if most is None else count("most", most, least=1, most=whole)


def structure_spectrum(
    run: StructureRun, steps: int, step: float | None, most: int
) -> StructureSpectrum:
    """Measure the exponents of the motion from the end of a run on; as in ``lyapunov_spectrum``.

    Raises
    ------
    SimulationError
        If the motion ends, or its derivatives could not be computed.
    Interrupted
        After Ctrl-C; ``.result`` is the spectrum up to there.
    """
    found = _core.structure_spectrum(run._core, steps, most, step)
    spectrum = StructureSpectrum(
        exponents=read_only(found.exponents),
        error=read_only(found.errors),
        time=found.time,
        impacts=read_only(np.array(found.impacts, np.int64)),
        history_time=read_only(found.history_time),
        history=read_only(found.history),
        label=run.label,
        system=run.system,
    )
    measured_whole(found, spectrum)
    return spectrum

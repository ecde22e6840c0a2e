"""Lyapunov spectra: of one motion with its convergence, or over a grid of parameters.

The perturbations are propagated by the exact derivatives of flights, impacts, chatter and contact
phases (theory page, section 7), and kept orthonormal (Benettin et al. 1980).
"""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any, Unpack, overload

import numpy as np
from numpy.typing import ArrayLike

from .. import _core
from .._core import CHATTER_TOLERANCE
from ..arguments import count, flag, positive, reject, state, threads
from ..horizons import kept_periods
from ..interruption import interruptible
from ..keyword_types import Axes, completing
from ..machine_kinds import is_maker, is_structure
from ..made import Maker, in_units
from ..scales import Units, in_si, needed
from ..simulation import simulated
from ..system import System
from .call_types import LyapunovCall
from .cells import CellTask, RunSettings, checked_axes
from .endings import told
from .engine import compute
from .grid import Grid
from .lyapunov_results import LyapunovSpectrum, LyapunovSweep, measured_whole
from .machines import need_machine
from .made_cells import made_cells

if TYPE_CHECKING:
    from ..structure import Structure
    from ..structure_motion import StructureSpectrum

# Drive periods that a measurement takes at least: two for each block of its error. Users see it.
_LEAST = 20
# Steps of a measurement without drive period.
_STEPS = 1000


@overload
def lyapunov_spectrum(
    system: System,
    *,
    initial: ArrayLike | Callable[..., ArrayLike],
    **keywords: Unpack[LyapunovCall],
) -> LyapunovSpectrum | LyapunovSweep: ...


@overload
def lyapunov_spectrum(
    system: System,
    *,
    initial: ArrayLike | Callable[..., ArrayLike],
    units: Units,
    **keywords: Any,
) -> LyapunovSpectrum | LyapunovSweep: ...


@overload
def lyapunov_spectrum(
    system: Structure,
    *,
    initial: ArrayLike | Callable[..., ArrayLike],
    **keywords: Any,
) -> StructureSpectrum | LyapunovSweep: ...


@overload
def lyapunov_spectrum(
    system: Maker,
    *,
    initial: ArrayLike | Callable[..., ArrayLike],
    **keywords: Any,
) -> LyapunovSweep: ...


@interruptible
@completing(Axes)
def lyapunov_spectrum(
    system: System | Structure | Maker,
    *,
    initial: ArrayLike | Callable[..., ArrayLike],
    periods: int | None = None,
    keep: int | None = None,
    time: float | None = None,
    units: Units | None = None,
    max_events: int | None = None,
    chatter_tolerance: float = CHATTER_TOLERANCE,
    progress: bool = False,
    workers: int | None = None,
    chunk: int | None = None,
    client: Any = None,
    store: str | os.PathLike[str] | None = None,
    most: int | None = None,
    **axes: ArrayLike,
) -> LyapunovSpectrum | LyapunovSweep | StructureSpectrum:
    """Measure the Lyapunov exponents of a motion, or of one for each cell of a grid.

    Parameters
    ----------
    system
        The System or Structure; over axes also a function that makes one from their values, as in
        ``sweep``.
    initial
        (x1, v1, x2, v2) at t = 0, of a structure the rows q and v, (2, N); over axes also a
        function of their values that gives it.
    periods
        Drive periods in all, at least 20 (default 2000).
    keep
        How many of them at the end the exponents are measured over, at least 20 (default three
        quarters, or 20 if that is more). A motion that has not come to its periodic orbit before is
        followed until it has, and measured then.
    time
        In place of periods, for ``drive_frequency = 0`` and without axes: time in all; the last
        three quarters are measured.
    units
        ``"SI"``: what is varied, and ``initial``, are in SI, as in ``bifurcation_diagram``, and
        ``time`` is in s. Exponents are dimensionless.
    max_events
        Cap on the number of events of each run, as in ``simulate``.
    chatter_tolerance
        Absolute, on time and state where chatter is completed, as in ``simulate``.
    progress
        Show a progress bar with rate and time left.
    workers
        Threads; default all cores.
    chunk
        For a grid only: cells that are computed, stored and sent together, as in ``sweep``.
    client
        For a grid only: a ``distributed.Client`` whose workers compute the chunks.
    store
        For a grid only: directory of a Zarr store for the results, as in ``sweep``.
    most
        Of one motion of a Structure: the largest so many; default all 2 N. It is measured from
        where the run of the other periods has ended.
    **axes
        Arrays of values as in ``sweep``; none for a single motion.

    Returns
    -------
    LyapunovSpectrum or LyapunovSweep; of a structure StructureSpectrum
        The second if there are axes.

    Raises
    ------
    ParameterError, StateError
        If an argument is out of range, before any work.
    SimulationError
        If the motion ends, or derivatives of it could not be computed; in a grid the exponents are
        NaN then.
    Interrupted
        After Ctrl-C; ``.result`` holds what is done: a spectrum, or before the measurement has
        begun the Run.

    Examples
    --------
    >>> import vibroimpact as vi
    >>> system = vi.System(mass_ratio=0.6, frequency_ratio=2, restitution=0.8, gap=0.5,
    ...                    drive_frequency=1.8, moment_amplitude=1)
    >>> spectrum = vi.lyapunov_spectrum(system, initial=(0, 0.5, 0, 0), periods=200)
    >>> spectrum.exponents.shape, spectrum.largest < 0
    ((4,), True)
    """
    need_machine(system)
    if is_maker(system) and not axes:
        reject("system", system, "a function over axes only; else a System or a Structure")
    if most is not None and (axes or not is_structure(system)):
        reject("most", most, "None, but for one motion of a structure")
    machine: Any
    machine, initial = in_units(lyapunov_spectrum, units, system, initial, axes, coordinates=True)
    single = not axes and not is_maker(machine)
    if not axes:
        threads(workers)
        flag("progress", progress)
        for name, given in (("chunk", chunk), ("client", client), ("store", store)):
            if given is not None:
                reject(name, given, "None for a single motion: it is one task, not stored")
    options = {"max_events": max_events, "chatter_tolerance": chatter_tolerance}
    if time is not None:
        counted = periods is not None or keep is not None
        if not single or counted or machine.drive_frequency > 0.0:
            reject("time", time, "None, but for a single motion with drive_frequency = 0")
        time = positive("time", time) / (needed(machine.scales).time if in_si(units) else 1.0)
        return _single(machine, initial, {"time": 0.25 * time}, _STEPS, 0.75 * time, most, options)
    periods = count("periods", 2000 if periods is None else periods, least=_LEAST)
    usual = max(-(-3 * periods // 4), _LEAST)
    measured = kept_periods(keep, periods, usual=usual, least=_LEAST)
    before = periods - measured
    if single:
        if machine.drive_frequency == 0.0:
            reject("time", time, "a number > 0: without a drive there are no periods")
        length = {"periods": max(before, 1), "keep": min(max(before, 1), _LOOKED_AT)}
        return _single(machine, initial, length, measured, None, most, options)
    grid = Grid(checked_axes(lyapunov_spectrum, machine, axes))
    base, start, made = made_cells(machine, initial, grid.axes, stored=store is not None)
    run = RunSettings.checked(
        base,
        initial=start,
        periods=max(before, 1),
        keep=min(before, _LOOKED_AT),
        max_events=max_events,
        chatter_tolerance=chatter_tolerance,
        section_phase=0.0,
    )
    task = CellTask(
        kind=LyapunovSweep.kind,
        machine=base,
        grid=grid,
        run=run,
        measure="spectrum",
        measured=measured,
        made=made,
    )
    found = compute(
        task,
        LyapunovSweep,
        chunk=chunk,
        workers=workers,
        progress=progress,
        client=client,
        store=store,
        known=task.known,
    )
    return told(found)


# Drive periods before the measurement from which the period is detected.
_LOOKED_AT = 100


def _single(
    system: System | Structure,
    initial: Any,
    length: Mapping[str, Any],
    steps: int,
    time: float | None,
    most: int | None,
    options: Mapping[str, Any],
) -> LyapunovSpectrum | StructureSpectrum:
    """Measure one motion after a run of a length, in steps of a time together, or of a period."""
    step = None if time is None else time / steps
    if not isinstance(system, System):
        from .structure_spectrum import most_of, structure_spectrum  # as in `machine_of`

        most = most_of(system, most)
        run = simulated(system, initial=initial, **length, **options)
        return structure_spectrum(run, steps, step, most)
    run = simulated(system, initial=state(initial), **length, **options)
    found = _core.lyapunov_spectrum(run._core, steps, step)
    flow = None
    if system.drive_frequency == 0.0 or system.moment_amplitude == system.force_amplitude == 0.0:
        # A wall at rest has two exponents only; the others are NaN.
        sizes = np.abs(found.exponents)
        flow = int(np.argmin(np.where(np.isnan(sizes), np.inf, sizes)))
    spectrum = LyapunovSpectrum(
        exponents=found.exponents,
        error=found.errors,
        time=found.time,
        impacts=found.impacts,
        history_time=found.history_time,
        history=found.history,
        flow=flow,
        label=run.label,
        system=system,
    )
    measured_whole(found, spectrum)
    return spectrum

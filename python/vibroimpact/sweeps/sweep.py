"""Sweeps: one labelled run for each cell of a grid of any number of axes; charts have two."""

from __future__ import annotations

import os
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, Unpack, overload

from numpy.typing import ArrayLike

from .._core import CHATTER_TOLERANCE
from ..interruption import interruptible
from ..keyword_types import Axes, Parameters, completing
from ..made import Maker, in_units
from ..scales import Units
from ..system import System
from .call_types import ChartCall, SweepCall
from .cells import CellTask, Measure, RunSettings, checked_axes, measure_of
from .endings import told
from .engine import compute
from .grid import Grid
from .grid_machine import GridMachine
from .made_cells import Made, made_cells
from .sweep_results import Chart, Sweep

if TYPE_CHECKING:
    from ..structure import Structure


@overload
def sweep(
    system: System,
    *,
    initial: ArrayLike | Callable[..., ArrayLike],
    **keywords: Unpack[SweepCall],
) -> Sweep: ...


@overload
def sweep(
    system: System,
    *,
    initial: ArrayLike | Callable[..., ArrayLike],
    units: Units,
    **keywords: Any,
) -> Sweep: ...


@overload
def sweep(
    system: Structure,
    *,
    initial: ArrayLike | Callable[..., ArrayLike],
    **keywords: Any,
) -> Sweep: ...


@overload
def sweep(
    system: Maker,
    *,
    initial: ArrayLike | Callable[..., ArrayLike],
    **keywords: Any,
) -> Sweep: ...


@interruptible
@completing(Axes)
def sweep(
    system: System | Structure | Maker,
    *,
    initial: ArrayLike | Callable[..., ArrayLike],
    periods: int = 400,
    keep: int | None = None,
    units: Units | None = None,
    labels: bool = True,
    exponents: bool = False,
    max_events: int | None = None,
    chatter_tolerance: float = CHATTER_TOLERANCE,
    section_phase: float = 0.0,
    progress: bool = False,
    workers: int | None = None,
    chunk: int | None = None,
    client: Any = None,
    store: str | os.PathLike[str] | None = None,
    **axes: ArrayLike,
) -> Sweep:
    """Simulate and label one run for each cell of a grid.

    Parameters
    ----------
    system
        The System or Structure; its own values of what is varied have no influence. Or a function
        that makes one, called once for each combination of values before anything is computed, with
        a store before each chunk: ``lambda stiffness, damping: vi.System.from_physical(...,
        stiffness=stiffness, damping=damping)``.
    initial
        (x1, v1, x2, v2) at t = 0, of a structure the rows q and v, (2, N); or a function of the
        same values that gives it.
    periods
        Drive periods per run.
    keep
        How many of them at the end are looked at for the label: 100 by default, or all of fewer.
    units
        ``"SI"``: what is varied, and ``initial``, are in SI, as in ``bifurcation_diagram``.
    labels
        Distinguish chaotic and quasi-periodic motions by the growth of perturbations. If False,
        which is faster, motions without a period are ``unresolved``.
    exponents
        Compute the largest Lyapunov exponent, too, which comes with the label.
    max_events
        Cap on the number of events of each run, as in ``simulate``.
    chatter_tolerance
        Absolute, on time and state where chatter is completed, as in ``simulate``.
    section_phase
        Phase of the stroboscopic section after that of t = 0, in radians.
    progress
        Show a progress bar with rate and time left.
    workers
        Threads; default all cores. No number depends on it, on ``chunk`` or on ``client``.
    chunk
        Cells that are computed, stored and sent together; default about a second's work.
    client
        A ``distributed.Client``: its workers compute the chunks (sweeps page).
    store
        Directory of a Zarr store: results go there chunk by chunk, and a call with the same
        arguments completes it. Memory then does not grow with the grid.
    **axes
        Arrays of values, each for a numeric field of System (or an argument of the function that
        makes it) or for a coordinate x1, v1, x2, v2 of the initial state; the first is the slowest
        axis. Of a Structure ``drive_frequency``, ``phase``, ``gap``, ``restitution``, ``friction``
        of all stops or of one, ``gap_0``, and of its start ``q_0``, ``q_1``, ... ``v_0``, ...
        A tuple ``(0.2, 4)``, ``(0.2, 4, 50)`` is refused; for a range use ``numpy.linspace``.

    Returns
    -------
    Sweep

    Raises
    ------
    ParameterError
        If an argument or a value is out of range, or the store is something else; nothing has run
        then. A cell in which the bodies overlap at the start, or a stop is penetrated, has the
        status ``overlap``.
    Interrupted
        After Ctrl-C; ``.result`` is the Sweep, cells not reached being ``pending``.

    Warns
    -----
    UserWarning
        If ``initial`` does so in some cells; if runs ended at the cap of events, and ``max_events``
        was not given.

    Examples
    --------
    >>> import vibroimpact as vi
    >>> system = vi.System(mass_ratio=0.6, frequency_ratio=2, restitution=0.8, gap=0.5,
    ...                    drive_frequency=1.8, moment_amplitude=1)
    >>> states = vi.sweep(system, drive_frequency=[1.7, 1.8], initial=(0, 0.5, 0, 0), periods=200)
    >>> states.label.tolist()
    ['1-1', '1-1']
    >>> states.final_states.shape
    (2, 4)
    """
    system, initial = in_units(sweep, units, system, initial, axes, coordinates=True)
    grid = Grid(checked_axes(sweep, system, axes))
    machine, start, made = made_cells(system, initial, grid.axes, stored=store is not None)
    run = RunSettings.checked(
        machine,
        initial=start,
        periods=periods,
        keep=keep,
        max_events=max_events,
        chatter_tolerance=chatter_tolerance,
        section_phase=section_phase,
    )
    task = _task(Sweep, machine, grid, run, measure_of(labels, exponents), made)
    found = compute(
        task,
        Sweep,
        chunk=chunk,
        workers=workers,
        progress=progress,
        client=client,
        store=store,
        known=task.known,
    )
    return told(found)


@overload
def chart(
    system: System,
    *,
    initial: ArrayLike | Callable[..., ArrayLike],
    **keywords: Unpack[ChartCall],
) -> Chart: ...


@overload
def chart(
    system: System,
    *,
    initial: ArrayLike | Callable[..., ArrayLike],
    units: Units,
    **keywords: Any,
) -> Chart: ...


@overload
def chart(
    system: Structure,
    *,
    initial: ArrayLike | Callable[..., ArrayLike],
    **keywords: Any,
) -> Chart: ...


@overload
def chart(
    system: Maker,
    *,
    initial: ArrayLike | Callable[..., ArrayLike],
    **keywords: Any,
) -> Chart: ...


@interruptible
@completing(Parameters)
def chart(
    system: System | Structure | Maker,
    *,
    initial: ArrayLike | Callable[..., ArrayLike],
    periods: int = 400,
    keep: int | None = None,
    units: Units | None = None,
    labels: bool = True,
    exponents: bool | None = None,
    max_events: int | None = None,
    chatter_tolerance: float = CHATTER_TOLERANCE,
    section_phase: float = 0.0,
    progress: bool = False,
    workers: int | None = None,
    chunk: int | None = None,
    client: Any = None,
    store: str | os.PathLike[str] | None = None,
    **axes: ArrayLike,
) -> Chart:
    """Label the motion, and measure its largest Lyapunov exponent, over two parameters.

    Parameters
    ----------
    system
        The System or Structure, or a function that makes one from two values, as in ``sweep``.
    initial
        (x1, v1, x2, v2) at t = 0, of a structure (2, N), or a function of the two values that gives
        it.
    periods
        Drive periods per run.
    keep
        How many of them at the end are looked at for the label: 100 by default, or all of fewer.
    units
        ``"SI"``: what is varied, and ``initial``, are in SI, as in ``bifurcation_diagram``.
    labels
        Distinguish chaotic and quasi-periodic motions, as in ``sweep``.
    exponents
        Compute the largest Lyapunov exponent; by default unless ``labels`` is False.
    max_events
        Cap on the number of events of each run, as in ``simulate``.
    chatter_tolerance
        Absolute, on time and state where chatter is completed, as in ``simulate``.
    section_phase
        Phase of the stroboscopic section after that of t = 0, in radians.
    progress
        Show a progress bar with rate and time left.
    workers
        Threads; default all cores.
    chunk
        Cells that are computed, stored and sent together, as in ``sweep``.
    client
        A ``distributed.Client`` whose workers compute the chunks.
    store
        Directory of a Zarr store for the results, as in ``sweep``.
    **axes
        Two numeric fields of System or numbers of a Structure, as in ``sweep``, or arguments of the
        function that makes it, with arrays of their values; for a range use
        ``numpy.linspace``, e.g.
        ``drive_frequency=np.linspace(0.2, 4, 400), moment_amplitude=np.linspace(0.2, 2, 300)``.

    Returns
    -------
    Chart
        Arrays have the shape (values of the first axis, values of the second).

    Raises
    ------
    ParameterError, Interrupted
        As in ``sweep``.

    Warns
    -----
    UserWarning
        As ``sweep``.

    Examples
    --------
    >>> import vibroimpact as vi
    >>> system = vi.System(mass_ratio=0.6, frequency_ratio=2, restitution=0.8, gap=0.5,
    ...                    drive_frequency=1.8, moment_amplitude=1)
    >>> chart = vi.chart(
    ...     system, drive_frequency=[1.7, 1.8, 1.9], restitution=[0.7, 0.8], initial=(0, 0.5, 0, 0),
    ...     periods=200,
    ... )
    >>> chart.label.shape
    (3, 2)
    """
    system, initial = in_units(chart, units, system, initial, axes)
    grid = Grid(checked_axes(chart, system, axes, starts=False, exactly=2))
    machine, start, made = made_cells(system, initial, grid.axes, stored=store is not None)
    run = RunSettings.checked(
        machine,
        initial=start,
        periods=periods,
        keep=keep,
        max_events=max_events,
        chatter_tolerance=chatter_tolerance,
        section_phase=section_phase,
    )
    exponents = labels if exponents is None else exponents
    task = _task(Chart, machine, grid, run, measure_of(labels, exponents), made)
    found = compute(
        task,
        Chart,
        chunk=chunk,
        workers=workers,
        progress=progress,
        client=client,
        store=store,
        known=task.known,
    )
    return told(found)


def _task(
    result: type[Sweep],
    machine: GridMachine,
    grid: Grid,
    run: RunSettings,
    measure: Measure,
    made: Made | None,
) -> CellTask:
    return CellTask(
        kind=result.kind, machine=machine, grid=grid, run=run, measure=measure, made=made
    )

"""Bifurcation diagrams: the long-term motion as one parameter of a system varies."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Unpack, get_args, overload

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .._core import CHATTER_TOLERANCE
from ..arguments import count, optional_count, reject, threads
from ..errors import ClusterError, Interrupted
from ..interruption import interruptible
from ..keyword_types import Parameters, completing
from ..machine_kinds import is_structure
from ..made import Maker, in_units
from ..scales import Units
from ..system import System
from .call_types import DiagramCall
from .cells import RunSettings, checked_axes, measure_of
from .columns import Columns
from .diagram_results import AnyDiagram, Diagram, Start
from .diagram_task import DiagramTask
from .endings import told
from .engine import compute
from .grid import Grid
from .grid_machine import GridMachine
from .made_cells import Made, made_cells
from .merge import LEVELS, merged
from .store import folder_of_stores, store_in
from .structure_diagram_results import StructureDiagram

if TYPE_CHECKING:
    from ..structure import Structure

# More refinements would give more points than a screen has.
_MOST_REFINEMENTS = 20


@overload
def bifurcation_diagram(
    system: System,
    *,
    initial: ArrayLike | Callable[..., ArrayLike],
    **keywords: Unpack[DiagramCall],
) -> Diagram: ...


@overload
def bifurcation_diagram(
    system: System,
    *,
    initial: ArrayLike | Callable[..., ArrayLike],
    units: Units,
    **keywords: Any,
) -> Diagram: ...


@overload
def bifurcation_diagram(
    system: Structure,
    *,
    initial: ArrayLike | Callable[..., ArrayLike],
    **keywords: Any,
) -> StructureDiagram: ...


@overload
def bifurcation_diagram(
    system: Maker,
    *,
    initial: ArrayLike | Callable[..., ArrayLike],
    **keywords: Any,
) -> Diagram: ...


@interruptible
@completing(Parameters)
def bifurcation_diagram(
    system: System | Structure | Maker,
    *,
    initial: ArrayLike | Callable[..., ArrayLike],
    periods: int = 600,
    keep: int | None = None,
    units: Units | None = None,
    start: Start | Sequence[Start] = "fresh",
    labels: bool = True,
    exponents: bool = False,
    refine: int = 0,
    max_events: int | None = None,
    chatter_tolerance: float = CHATTER_TOLERANCE,
    section_phase: float = 0.0,
    progress: bool = False,
    workers: int | None = None,
    chunk: int | None = None,
    client: Any = None,
    store: str | os.PathLike[str] | None = None,
    **parameter: ArrayLike,
) -> Diagram | StructureDiagram:
    """Simulate one run per value of a parameter and collect its sections.

    Parameters
    ----------
    system
        The System or Structure; its own value of what is varied has no influence. Or a function
        that makes it from the value, called once for each before anything is computed:
        ``lambda stiffness: vi.System.from_physical(..., stiffness=stiffness)``.
    initial
        (x1, v1, x2, v2) at t = 0, or several starts, shape (k, 4): a branch for each; of structures
        (2, N) or (k, 2, N). Or a function of the value that gives one start.
    periods
        Drive periods per run.
    keep
        How many of them at the end are kept: 100 by default, or all of fewer.
    units
        None: all numbers are dimensionless. ``"SI"``: what is varied are quantities of
        ``System.from_physical`` in their units, such as ``drive_frequency`` in rad/s, and starts
        are in rad, rad/s, m, m/s, as in ``simulate``; the results are dimensionless beside the
        values of the axes. The system needs ``scales``.
    start
        ``"fresh"``: every run starts from ``initial``. ``"forward"``, ``"backward"``: each starts
        from the last state of the one before, in the given or the reverse order; the result is in
        the given order always. With several of them there is a branch for each, from each
        ``initial``.
    labels
        Distinguish chaotic and quasi-periodic motions by the growth of perturbations. If False,
        which is faster, motions without a period are ``unresolved``.
    exponents
        Compute the largest Lyapunov exponent of each point, too.
    refine
        So many times, halve the steps across which the label of a fresh branch changes. The values
        of the result are then in increasing order, each once.
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
        Cells that are computed, stored and sent together, as in ``sweep``; a followed branch is
        one task, never cut.
    client
        A ``distributed.Client`` whose workers compute the chunks.
    store
        Directory of a Zarr store for the results, as in ``sweep``; with ``refine`` it has a part
        for each level.
    **parameter
        One numeric field of System, ``drive_frequency``, ``phase``, ``gap``, ``restitution_1`` ...
        of a Structure, or the argument of the function that makes the system, with an array of its
        values; for a range use ``numpy.linspace``, e.g.
        ``drive_frequency=np.linspace(0.2, 4, 4000)``.

    Returns
    -------
    Diagram; of structures StructureDiagram

    Raises
    ------
    ParameterError
        If an argument or one of the values is out of range; nothing has run then.
    StateError
        If an initial state is not finite.
    Interrupted
        After Ctrl-C; ``.result`` is the Diagram, unreached points having the status ``pending``.

    Warns
    -----
    UserWarning
        If the bodies overlap at the start of some points, or a stop is penetrated: these have the
        status ``overlap``. If runs ended at the cap of events, and ``max_events`` was not given.

    Examples
    --------
    >>> import vibroimpact as vi
    >>> system = vi.System(mass_ratio=0.6, frequency_ratio=2, restitution=0.8, gap=0.5,
    ...                    drive_frequency=1.8, moment_amplitude=1)
    >>> diagram = vi.bifurcation_diagram(
    ...     system, drive_frequency=[1.7, 1.8, 1.9], initial=(0, 0.5, 0, 0), periods=200, keep=50,
    ... )
    >>> diagram.label.tolist()
    ['1-1', '1-1', 'chaotic']

    In SI, over the drive frequency in rad/s:

    >>> machine = vi.System.from_physical(
    ...     pendulum_mass=3, oscillator_mass=5, length=0.1, torsional_stiffness=2e3 * 0.6,
    ...     stiffness=50e3, gap=0.05, restitution=0.8, drive_frequency=180, moment_amplitude=300,
    ... )
    >>> diagram = vi.bifurcation_diagram(
    ...     machine, drive_frequency=[190], initial=(0, 50, 0, 0), units="SI", periods=200, keep=50
    ... )
    >>> diagram.label.tolist()[-1]
    'chaotic'
    """
    system, initial = in_units(bifurcation_diagram, units, system, initial, parameter)
    axes = checked_axes(bifurcation_diagram, system, parameter, starts=False, exactly=1)
    ((name, values),) = axes.items()
    kinds = _starts(start)
    refinements = count("refine", refine, least=0, most=_MOST_REFINEMENTS)
    if refinements and set(kinds) != {"fresh"}:
        reject("refine", refine, "0 for followed branches: points between have no one to follow")
    if name == "branch":
        reject("name of an axis", name, "a name that no column of the result has")
    if refinements:
        values = np.unique(values)
    machine, given, made = made_cells(system, initial, {name: values})
    initials = _initials(machine, given)
    run = RunSettings.checked(
        machine,
        initial=initials[0],
        periods=periods,
        keep=keep,
        max_events=max_events,
        chatter_tolerance=chatter_tolerance,
        section_phase=section_phase,
    )
    branches = [(one, kind) for kind in kinds for one in initials]
    measure = measure_of(labels, exponents)

    result: Any = StructureDiagram if is_structure(machine.system) else Diagram

    def task(values: NDArray[np.float64], base: GridMachine, cells: Made | None) -> DiagramTask:
        axes = {name: values}
        if len(branches) > 1:
            axes = {"branch": np.arange(float(len(branches))), **axes}
        return DiagramTask(
            kind=result.kind,
            machine=base,
            grid=Grid(axes),
            run=run,
            measure=measure,
            made=cells,
            initials=tuple(one for one, _ in branches),
            starts=tuple(kind for _, kind in branches),
        )

    engine = {"chunk": chunk, "workers": workers, "progress": progress, "client": client}
    if not refinements:
        whole = task(values, machine, made)
        found: Diagram | StructureDiagram
        found = compute(whole, result, store=store, known=whole.known, **engine)
        return told(found)

    def level(values: NDArray[np.float64]) -> DiagramTask:
        if values is first_values:  # for which the functions have been called
            return task(values, machine, made)
        here, _, cells = made_cells(system, initial, {name: values})
        return task(values, here, cells)

    first_values = values
    optional_count("chunk", chunk, least=1)
    threads(workers)
    folder = folder_of_stores(store, LEVELS, "a refined diagram")
    return told(_refined(level, result, values, refinements, folder, engine))


def _initials(machine: GridMachine, initial: Any) -> list[Any]:
    several = machine.system._starts(initial).ndim > len(machine.final_state.shape)
    if not several:
        return [machine.start(initial)]
    given = [machine.start(one) for one in machine.starts(initial)]
    if not given:
        reject("initial", initial, "at least one start")
    return given


def _starts(start: Any) -> tuple[Start, ...]:
    several = isinstance(start, Iterable) and not isinstance(start, str)
    try:
        given = tuple(start) if several else (start,)
    except TypeError:  # an array without a dimension
        given = ()
    if not given or not all(isinstance(kind, str) and kind in get_args(Start) for kind in given):
        reject("start", start, "'fresh', 'forward', 'backward', or several of them")
    return given


def _refined(
    task: Callable[[NDArray[np.float64]], DiagramTask],
    result: Any,
    values: NDArray[np.float64],
    refinements: int,
    store: Path | None,
    engine: dict[str, Any],
) -> Diagram | StructureDiagram:
    """Compute level by level: each has the midpoints between unequal labels of all before."""
    done: Columns | None = None
    try:
        for level in range(refinements + 1):
            place = store_in(store, f"level-{level}")
            stopped: Interrupted | ClusterError | None = None
            try:
                part = task(values)
                columns = compute(part, _itself, store=place, known=part.known, **engine)
            except (Interrupted, ClusterError) as error:
                columns, stopped = error.result, error
            if columns is not None:
                done = columns if done is None else merged(done, columns)
            if stopped is not None:
                stopped.result = None if done is None else result(done)
                raise stopped from stopped.__cause__
            values = _midpoints(result(done))
            if not len(values):
                break
    except Interrupted:
        raise
    except KeyboardInterrupt:
        if done is None:
            raise
        message = f"interrupted after {done.done} points"
        raise Interrupted(message, result(done), holds="them") from None
    assert done is not None
    found: Diagram | StructureDiagram = result(done)
    return found


def _itself(columns: Columns) -> Columns:
    return columns


def _midpoints(diagram: AnyDiagram[Any]) -> NDArray[np.float64]:
    """Return the middle of each step across which the label changes on a branch."""
    values = diagram.values
    labels = diagram.label.reshape(-1, len(values))
    changes = (labels[:, 1:] != labels[:, :-1]).any(axis=0)
    middle = 0.5 * (values[1:] + values[:-1])
    # There is no double between two neighbouring ones.
    wanted: NDArray[np.float64] = middle[changes & (middle > values[:-1]) & (middle < values[1:])]
    return wanted

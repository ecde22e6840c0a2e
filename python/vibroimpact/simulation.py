"""The call that simulates one motion or many (theory page, sections 2 to 6)."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager, nullcontext
from typing import TYPE_CHECKING, Any, TypeAlias, overload

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _core
from ._core import CHATTER_TOLERANCE
from .arguments import (
    Horizon,
    flag,
    horizon,
    number,
    optional_count,
    positive,
    reject,
    states,
    threads,
)
from .errors import Interrupted, SimulationError
from .interruption import interruptible
from .run import Run, raise_if_interrupted
from .scales import Units, chosen
from .system import System

if TYPE_CHECKING:
    from .structure import Structure
    from .structure_run import StructureRun

# Gets how much is done.
_Tell: TypeAlias = Callable[[int], None]


@overload
def simulate(
    system: System,
    *,
    initial: Sequence[float],
    periods: int | None = ...,
    time: float | None = ...,
    keep: int | None = ...,
    max_events: int | None = ...,
    chatter_tolerance: float = ...,
    section_phase: float = ...,
    progress: bool = ...,
    units: Units | None = ...,
    workers: int | None = ...,
) -> Run: ...


@overload
def simulate(
    system: System,
    *,
    initial: Sequence[Sequence[float]],
    periods: int | None = ...,
    time: float | None = ...,
    keep: int | None = ...,
    max_events: int | None = ...,
    chatter_tolerance: float = ...,
    section_phase: float = ...,
    progress: bool = ...,
    units: Units | None = ...,
    workers: int | None = ...,
) -> list[Run]: ...


@overload
def simulate(
    system: Structure,
    *,
    initial: ArrayLike,
    periods: int | None = ...,
    time: float | None = ...,
    keep: int | None = ...,
    max_events: int | None = ...,
    chatter_tolerance: float = ...,
    section_phase: float = ...,
    progress: bool = ...,
    units: None = ...,
    workers: int | None = ...,
) -> Any: ...


@overload
def simulate(
    system: System,
    *,
    initial: NDArray[Any],
    periods: int | None = ...,
    time: float | None = ...,
    keep: int | None = ...,
    max_events: int | None = ...,
    chatter_tolerance: float = ...,
    section_phase: float = ...,
    progress: bool = ...,
    units: Units | None = ...,
    workers: int | None = ...,
) -> Any: ...


@interruptible
def simulate(
    system: System | Structure,
    *,
    initial: ArrayLike,
    periods: int | None = None,
    time: float | None = None,
    keep: int | None = None,
    max_events: int | None = None,
    chatter_tolerance: float = CHATTER_TOLERANCE,
    section_phase: float = 0.0,
    progress: bool = False,
    units: Units | None = None,
    workers: int | None = None,
) -> Run | StructureRun | list[Run] | list[StructureRun]:
    """Simulate the motion from one initial state, or from several.

    Every flight is exact and every contact is found (theory page, sections 2 and 3). Complete
    chatter is carried to its accumulation point, and the run goes on through the sustained contact
    that follows: slide, stick, release (section 5). All quantities are dimensionless.

    Parameters
    ----------
    system
        The System, or a Structure.
    initial
        (x1, v1, x2, v2) at t = 0, shape (4,); or (k, 4) for k runs. Of a structure the rows q and
        v, shape (2, N) or (k, 2, N). A start on the contact (g = 0
        to rounding) begins with an impact, a flight or sustained contact, depending on velocities
        and forces.
    periods
        Number of drive periods; or else ``time``.
    time
        Length in time; or else ``periods``. With ``drive_frequency = 0`` there is no period,
        and ``time`` is needed.
    keep
        Keep impacts, events and sections of the last so many periods only; default all.
    max_events
        Cap on the events of a run since t = 0, which ends it with the stop reason ``event_cap``;
        10 million unless given.
    chatter_tolerance
        Absolute tolerance on time and state where chatter is completed; flights and impacts are
        exact, and sustained contact is integrated to rounding.
    section_phase
        Drive phase of the stroboscopic section, relative to that of the start, in radians.
    workers
        Threads for several initial states; default all cores. The results do not depend on it.

    Returns
    -------
    Run or list of Run; of a structure StructureRun or list of them
        For ``initial`` of shape (4,) or (k, 4), (2, N) or (k, 2, N). Runs that ended early say so
        in ``stop_reason``.

    Raises
    ------
    ParameterError
        If an argument is out of range.
    StateError
        If an initial state is not finite, or the bodies overlap in it.
    SimulationError
        If a number left the range of floats, or no contact could be decided; ``.result`` is the
        part of the return value that was computed.
    Interrupted
        After Ctrl-C; ``.result`` as for SimulationError.

    Examples
    --------
    >>> import vibroimpact as vi
    >>> system = vi.System(mass_ratio=0.6, frequency_ratio=2, restitution=0.8, gap=0.5,
    ...                    drive_frequency=1.8, moment_amplitude=1)
    >>> run = vi.simulate(system, initial=(0, 0.5, 0, 0), periods=600, keep=100)
    >>> run.label
    '1-1'
    >>> len(run.impacts), run.stroboscopic.shape
    (100, (100, 4))
    >>> runs = vi.simulate(system, initial=[(0, 0.5, 0, 0), (0, 0.1, 0, 0)], periods=600, keep=100)
    >>> [run.label for run in runs]
    ['1-1', '1-1']
    """
    options: dict[str, Any] = {
        "chatter_tolerance": positive("chatter_tolerance", chatter_tolerance),
        "section_phase": number("section_phase", section_phase),
    }
    cap = optional_count("max_events", max_events, least=1)
    if cap is not None:
        options["max_events"] = cap
    shown = flag("progress", progress)
    if not isinstance(system, System):
        from .structure import Structure  # here, to keep the import of the package light

        if not isinstance(system, Structure):
            reject("system", system, "a vibroimpact.System or a vibroimpact.Structure")
        if units is not None:
            reject("units", units, "None: a structure has no scales")
        span = horizon(system.drive_frequency, periods=periods, time=time, keep=keep)
        options |= {"periods": span.periods, "time": span.time, "keep": span.keep}
        return _structure_runs(system, initial, span, options, threads(workers), shown)
    scales = chosen(units, system.scales)
    if scales is not None and time is not None:
        time = positive("time", time) / scales.time
    span = horizon(system.drive_frequency, periods=periods, time=time, keep=keep)
    start = states(initial)
    workers = threads(workers)
    if scales is not None:
        start = states(scales.from_si(start))
    options |= {"periods": span.periods, "time": span.time, "keep": span.keep}
    if start.ndim == 1:
        try:
            with _bar_of_run(span, shown) as tell:
                core = _core.simulate(system._compiled, start.tolist(), progress=tell, **options)
        except SimulationError as error:
            error.result = _wrap(error.result, system, start)
            raise
        run = _wrap(core, system, start)
        raise_if_interrupted(run)
        return run
    with progress_bar("runs", len(start), "run", shown) as tell:
        cores, interrupted, failure = _core.simulate_many(
            system._compiled, start, workers=workers, progress=tell, **options
        )
    # After Ctrl-C there may be fewer runs than starts; they are the first ones.
    runs = [_wrap(core, system, row) for core, row in zip(cores, start, strict=False)]
    if interrupted:
        raise Interrupted(f"interrupted after {len(runs)} of {len(start)} runs", runs, holds="them")
    if failure is not None:
        raise SimulationError(failure, runs, holds="all runs")
    return runs


def _structure_runs(
    structure: Structure,
    initial: ArrayLike,
    span: Horizon,
    options: dict[str, Any],
    workers: int | None,
    shown: bool,
) -> StructureRun | list[StructureRun]:
    from .structure_run import StructureRun

    starts = structure._to_core(initial)
    single = np.ndim(initial) == 2
    physical = np.asarray(initial, dtype=float).reshape(-1, 2, structure.coordinates)
    bar = _bar_of_run(span, shown) if single else progress_bar("runs", len(starts), "run", shown)
    try:
        with bar as tell:
            cores, interrupted, failure = _core.simulate_structure(
                structure._compiled, starts, workers=workers, progress=tell, **options
            )
    except SimulationError as error:
        error.result = StructureRun(error.result, structure, physical[0])
        raise
    # After Ctrl-C there may be fewer runs than starts; they are the first ones.
    pairs = zip(cores, physical, strict=False)
    runs = [StructureRun(core, structure, start) for core, start in pairs]
    if single:
        if interrupted:
            time = runs[0].final_state.time
            raise Interrupted(f"interrupted at time {time:.6g}", runs[0], holds="the run so far")
        return runs[0]
    if interrupted:
        raise Interrupted(
            f"interrupted after {len(runs)} of {len(starts)} runs", runs, holds="them"
        )
    if failure is not None:
        raise SimulationError(failure, runs, holds="all runs")
    return runs


def _bar_of_run(span: Horizon, shown: bool) -> AbstractContextManager[_Tell | None]:
    """Show how much of its length a run has done, of which the core tells the millionths."""
    if span.periods is not None:
        return progress_bar("run", span.periods, "period", shown, scale=1e-6 * span.periods)
    return progress_bar("run", 100, "%", shown, scale=1e-4)


def progress_bar(
    name: str, total: int, unit: str, shown: bool, *, scale: float = 1.0
) -> AbstractContextManager[_Tell | None]:
    """Give what shows on a tqdm bar how much is done, or None where no bar is wanted."""
    return _tqdm_bar(name, total, unit, scale) if shown else nullcontext()


@contextmanager
def _tqdm_bar(name: str, total: int, unit: str, scale: float) -> Iterator[_Tell]:
    from tqdm import tqdm  # here, to keep the import of the package light

    with tqdm(total=total, desc=name, unit=unit) as bar:

        def tell(done: int) -> None:
            bar.update(round(scale * done) - bar.n)

        yield tell


def refuse_overlap(system: System, initial: Sequence[float]) -> None:
    """Raise StateError for a start that does not fit: by a run of no length."""
    if _core.simulate(system._compiled, initial, time=0.0).interrupted:
        raise KeyboardInterrupt


def _wrap(core: _core.Run, system: System, initial: NDArray[np.float64]) -> Run:
    x1, v1, x2, v2 = initial.tolist()
    return Run(core, system, (x1, v1, x2, v2))

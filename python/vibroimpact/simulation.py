"""The call that simulates one motion or many (theory page, sections 2 to 6)."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, contextmanager, nullcontext
from typing import TYPE_CHECKING, Any, TypeAlias, overload

from numpy.typing import ArrayLike, NDArray

from . import _core
from ._core import CHATTER_TOLERANCE
from .arguments import flag, number, optional_count, positive, reject, threads
from .errors import Interrupted, ParameterError, SimulationError, StateError, warn
from .horizons import Horizon, horizon
from .interruption import interruptible
from .machine import Machine
from .made_with import Asked, MadeWith, asked_of
from .run import Run
from .run_record import AnyRun, raise_if_interrupted, warn_of_the_cap
from .scales import Units
from .system import System

if TYPE_CHECKING:
    from .structure import Structure
    from .structure_run import StructureRun

# Gets how much is done.
_Tell: TypeAlias = Callable[[int], None]
# Names, or directions by name.
_Sensitivity: TypeAlias = str | Sequence[str] | Mapping[str, Any] | None


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
    sensitivity: _Sensitivity = ...,
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
    sensitivity: None = ...,
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
    sensitivity: _Sensitivity = ...,
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
    sensitivity: _Sensitivity = ...,
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
    sensitivity: _Sensitivity = None,
) -> Run | StructureRun | list[Run] | list[StructureRun]:
    """Simulate the motion from one initial state, or from several.

    Every flight is exact and every contact is found (theory page, sections 2 and 3). Complete
    chatter is carried to its accumulation point, and the run goes on through the sustained contact
    that follows: slide, stick, release (section 5). Quantities of a System are dimensionless; a
    Structure has the units of its numbers.

    Parameters
    ----------
    system
        The System or Structure.
    initial
        (x1, v1, x2, v2) at t = 0, shape (4,); or (k, 4) for k runs. Of a structure the rows q and
        v, shape (2, N) or (k, 2, N). A start on the contact (g = 0 to rounding) begins with an
        impact, a flight or sustained contact, depending on velocities and forces.
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
        Tolerance on time and state where chatter is completed; flights and impacts are exact, and
        sustained contact is integrated to rounding. Absolute for a System, whose numbers have no
        units; of a structure it is a part of the time, coordinates and velocities of the motion.
    section_phase
        Drive phase of the stroboscopic section, relative to that of the start, in radians.
    workers
        Threads for several initial states; default all cores. The results do not depend on it.
    sensitivity
        With one start: names by which ``run.sensitivity`` is going to be asked for, and of a
        structure also a mapping, from names to directions, or to None where the name says it all.
        With ``keep`` the derivatives are then carried along, and asking for them takes no time:
        they cost less so than afterwards, for the motion before the window is followed once. What
        has no derivatives is refused by ``run.sensitivity``, not here.

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
        If an initial state is not finite, or the bodies overlap in it, or a stop is penetrated.
    SimulationError
        If a number left the range of floats, or no contact could be decided; ``.result`` is the
        part of the return value that was computed.
    Interrupted
        After Ctrl-C; ``.result`` as for SimulationError.

    Warns
    -----
    UserWarning
        If a run ended at the cap of events, and ``max_events`` was not given. If there are no
        impacts, and the system was made in SI but ``units`` is not given.

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
    >>> run = vi.simulate(system, initial=(0, 0.5, 0, 0), periods=600, keep=1, sensitivity="gap")
    >>> run.sensitivity("gap").impacts.time.shape
    (1, 1)
    """
    found: Run | StructureRun | list[Run] | list[StructureRun] = simulated(
        system,
        initial=initial,
        periods=periods,
        time=time,
        keep=keep,
        max_events=max_events,
        chatter_tolerance=chatter_tolerance,
        section_phase=section_phase,
        progress=progress,
        units=units,
        workers=workers,
        asked=asked_of(sensitivity),
    )
    runs: list[Any] = [*found] if isinstance(found, list) else [found]
    warn_of_the_cap(runs, max_events)
    if units is None:
        _warn_of_units(runs)
    return found


def simulated(
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
    asked: Asked | None = None,
) -> Any:
    """Do what ``simulate`` does, without its warnings: for runs that no caller has asked for."""
    options: dict[str, Any] = {
        "chatter_tolerance": positive("chatter_tolerance", chatter_tolerance),
        "section_phase": number("section_phase", section_phase),
    }
    cap = optional_count("max_events", max_events, least=1)
    if cap is not None:
        options["max_events"] = cap
    shown = flag("progress", progress)
    if not isinstance(system, Machine):
        reject("system", system, "a vibroimpact.System or a vibroimpact.Structure")
    scales = system._chosen(units)
    if scales is not None and time is not None:
        time = positive("time", time) / scales.time
    span = horizon(system.drive_frequency, periods=periods, time=time, keep=keep)
    start = system._starts(initial)
    if scales is not None:
        start = system._starts(scales.from_si(start))
    options |= {"periods": span.periods, "time": span.time, "keep": span.keep}
    single = start.ndim == system._AXES
    if asked is not None:
        if not single:
            reject("sensitivity", [*asked[0], *asked[1]], "None with several starts")
        by = _checked(system, asked)
        # What keeps all of its motion has its derivatives afterwards at no higher price.
        if span.keep is not None and span.keep != span.periods:
            with _bar_of_run(span, shown) as tell:
                run = _made_with(system, start, asked, by, progress=tell, **options)
            if run is not None:
                raise_if_interrupted(run)
                return run
    options["workers"] = threads(workers)
    bar = _bar_of_run(span, shown) if single else progress_bar("runs", len(start), "run", shown)
    with bar as tell:
        cores, interrupted, failure = _begun(system, start, progress=tell, **options)
    if single:
        run = system._run(cores[0], start)
        if failure is not None:
            raise SimulationError(failure[1], run)
        raise_if_interrupted(run)
        return run
    # After Ctrl-C there may be fewer runs than starts; they are the first ones.
    runs: list[Any] = [system._run(core, row) for core, row in zip(cores, start, strict=False)]
    if interrupted:
        raise Interrupted(f"interrupted after {len(runs)} of {len(start)} runs", runs, holds="them")
    if failure is not None:
        place, reason = failure
        raise SimulationError(f"run {place}: {reason}", runs, holds="all runs")
    return runs


def _checked(system: Machine, asked: Asked) -> Any:
    """Return what the core differentiates by."""
    try:
        return system._run_class()._by(system, *asked)
    except ParameterError as error:
        raise ParameterError(f"sensitivity: {error}") from None


def _made_with(system: Machine, start: NDArray[Any], asked: Asked, by: Any, **options: Any) -> Any:
    """Return a run with the derivatives that it was asked for; None if one of both has failed."""
    try:
        with _told_where_to_begin(system, start):
            core, found = _core.simulate_with_sensitivity(
                system._compiled, system._to_core(start), by, **options
            )
    except SimulationError:
        return None
    run = system._run(core, start)
    run._made_with = None if found is None else MadeWith(found, *asked)
    return run


def _begun(system: Machine, starts: NDArray[Any], **options: Any) -> Any:
    """Simulate in the core; what is wrong with a start has a word on where one may be."""
    with _told_where_to_begin(system, starts):
        return _core.simulate(system._compiled, system._to_core(starts), **options)


@contextmanager
def _told_where_to_begin(system: Machine, starts: NDArray[Any]) -> Iterator[None]:
    """Add a word on where a start may be to what is wrong with one."""
    try:
        yield
    except StateError as error:
        raise StateError(f"{error}{system._where_to_begin(starts)}") from None


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


def refuse_overlap(system: Machine, initial: Any) -> None:
    """Raise StateError for starts that do not fit: by runs of no length."""
    _, interrupted, _ = _begun(system, system._starts(initial), time=0.0)
    if interrupted:
        raise KeyboardInterrupt


def _warn_of_units(runs: Sequence[AnyRun]) -> None:
    """Warn of runs without impacts, of which the numbers were perhaps meant in SI."""
    if runs and runs[0]._system._not_in_si and not any(run.impact_count for run in runs):
        warn(f"there are no impacts; {runs[0]._system._not_in_si}")

"""Bifurcation diagrams: the long-term motion as one parameter of a system varies.

The result is ragged: point i of the diagram owns the rows offset[i] : offset[i + 1] of the impact
columns and stroboscopic_offset[i] : stroboscopic_offset[i + 1] of the stroboscopic states. The
sections are those of Han, Jin & Hu (2004), eq. (48); see docs/theory.md, section 6.
"""

import dataclasses
import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any, Literal, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _core, archive
from .checks import count, number, optional_count, positive, reject, state, vector
from .errors import Interrupted, ParameterError
from .system import NUMERIC_RANGES, System

Start = Literal["fresh", "forward", "backward"]

_ARRAYS = (
    "parameter",
    "offset",
    "x1",
    "v1",
    "v2",
    "phase",
    "regime",
    "stroboscopic_offset",
    "stroboscopic",
    "status",
    "m",
    "n",
    "residual",
    "contact_fraction",
    "final_states",
)


@dataclass(frozen=True, kw_only=True)
class DiagramSettings:
    """The arguments a diagram was computed with; meanings as in ``bifurcation_diagram``."""

    periods: int
    keep: int
    initial: tuple[float, float, float, float]
    start: Start
    max_events: int | None
    tolerance: float
    section_phase: float


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class Diagram:
    """A bifurcation diagram of n points; all arrays are read-only.

    Attributes
    ----------
    parameter_name, parameter
        Which field of the system was varied, and its values, shape (n,).
    offset
        Shape (n + 1,): point i owns the impact rows offset[i] : offset[i + 1].
    x1, v1, v2, phase
        State just before each kept impact, and drive phase in [0, 2 pi), shape (rows,).
    regime
        Regime of each kept impact, shape (rows,).
    stroboscopic_offset, stroboscopic
        Shape (n + 1,), and the kept stroboscopic states x1, v1, x2, v2, shape (rows, 4).
    status
        Shape (n,): ``completed``, ``restarted`` (a followed state did not fit the new parameter),
        the stop reason, or ``pending`` for a point an interrupted call did not reach.
    m, n
        Drive periods and impacts per orbit, shape (n,); m = 0 where no period was found, n = -1
        where the orbit has complete chatter, infinitely many impacts in a finite time.
    residual
        Largest difference between sections m periods apart, shape (n,).
    contact_fraction
        Part of the kept time in lasting contact, in [0, 1], shape (n,); NaN where nothing is kept.
    final_states
        State x1, v1, x2, v2 at the end of each run, shape (n, 4).
    system
        The system whose parameter was varied.
    settings
        The other arguments.
    """

    parameter_name: str
    parameter: NDArray[np.float64]
    offset: NDArray[np.int64]
    x1: NDArray[np.float64]
    v1: NDArray[np.float64]
    v2: NDArray[np.float64]
    phase: NDArray[np.float64]
    regime: NDArray[np.int8]
    stroboscopic_offset: NDArray[np.int64]
    stroboscopic: NDArray[np.float64]
    status: NDArray[np.str_]
    m: NDArray[np.int64]
    n: NDArray[np.int64]
    residual: NDArray[np.float64]
    contact_fraction: NDArray[np.float64]
    final_states: NDArray[np.float64]
    system: System
    settings: DiagramSettings

    def __post_init__(self) -> None:
        """Make the arrays read-only."""
        for name in _ARRAYS:
            getattr(self, name).flags.writeable = False

    def __len__(self) -> int:
        """Return the number of points."""
        return len(self.parameter)

    def __repr__(self) -> str:
        """Say what was varied and how much came of it."""
        span = f" in [{self.parameter.min():g}, {self.parameter.max():g}]" if len(self) else ""
        completed = np.count_nonzero(np.isin(self.status, ["completed", "restarted", "rest"]))
        return (
            f"<Diagram of {len(self)} values of {self.parameter_name}{span}, "
            f"{completed} completed, {len(self.x1)} impacts>"
        )

    @property
    def impact_parameter(self) -> NDArray[np.float64]:
        """The parameter value of each impact row, shape (rows,): the abscissa of a scatter."""
        return np.repeat(self.parameter, np.diff(self.offset))

    @property
    def stroboscopic_parameter(self) -> NDArray[np.float64]:
        """The parameter value of each stroboscopic row, shape (rows,)."""
        return np.repeat(self.parameter, np.diff(self.stroboscopic_offset))

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the diagram to ``path`` (.npz, no pickle); ``load`` gives it back bit for bit."""
        metadata = {
            "parameter_name": self.parameter_name,
            "system": self.system.to_dict(),
            "settings": dataclasses.asdict(self.settings),
        }
        archive.write(path, "diagram", metadata, {name: getattr(self, name) for name in _ARRAYS})

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> Self:
        """Read a diagram written by ``save``.

        Raises
        ------
        ValueError
            If the file is damaged, foreign, or holds something else.
        """
        return archive.read(path, {"diagram": cls._from_parts})

    @classmethod
    def _from_parts(cls, metadata: dict[str, Any], arrays: dict[str, NDArray[Any]]) -> Self:
        settings = metadata["settings"]
        return cls(
            parameter_name=metadata["parameter_name"],
            system=System.from_dict(metadata["system"]),
            settings=DiagramSettings(**settings | {"initial": tuple(settings["initial"])}),
            **arrays,
        )


def orbit_label(m: int, n: int) -> str:
    """Return the label of an orbit from the columns `m` and `n` of a diagram: 3-4, 1-inf."""
    return f"{m}-{'inf' if n == -1 else n}"


def bifurcation_diagram(
    system: System,
    *,
    initial: ArrayLike,
    periods: int = 600,
    keep: int = 100,
    start: Start = "fresh",
    progress: bool = False,
    workers: int | None = None,
    max_events: int | None = None,
    tolerance: float = 1e-12,
    section_phase: float = 0.0,
    **parameter: ArrayLike,
) -> Diagram:
    """Simulate one run per value of a parameter and collect its sections.

    Parameters
    ----------
    system
        The system; the varied parameter's own value plays no part.
    initial
        (x1, v1, x2, v2) at t = 0.
    periods, keep
        Drive periods per run, and how many of them at the end are kept.
    start
        ``"fresh"``: every run starts from ``initial``. ``"forward"``, ``"backward"``: each starts
        from the last state of the one before, in the given or the reverse order; the result is
        in the given order always.
    progress
        Show a progress bar.
    workers
        Threads; default all cores. The result does not depend on it.
    max_events, tolerance, section_phase
        As in ``simulate``.
    **parameter
        One numeric field of System with its values, e.g.
        ``drive_frequency=np.linspace(0.2, 4, 4000)``.

    Returns
    -------
    Diagram

    Raises
    ------
    ParameterError
        If an argument or one of the values is out of range; nothing has run then.
    StateError
        If ``initial`` is not finite, or the bodies overlap in it at one of the values.
    Interrupted
        After Ctrl-C; ``.result`` is the Diagram, unreached points having the status ``pending``.
    """
    if not isinstance(system, System):
        reject("system", system, "a vibroimpact.System")
    name, values = _swept(parameter)
    if start not in ("fresh", "forward", "backward"):
        reject("start", start, "'fresh', 'forward' or 'backward'")
    periods = count("periods", periods, least=1)
    settings = DiagramSettings(
        periods=periods,
        keep=count("keep", keep, least=0, most=periods),
        initial=state(initial),
        start=start,
        max_events=optional_count("max_events", max_events, least=1),
        tolerance=positive("tolerance", tolerance),
        section_phase=number("section_phase", section_phase),
    )
    optional_count("workers", workers, least=1)
    frequencies = values if name == "drive_frequency" else np.array([system.drive_frequency])
    if (frequencies == 0.0).any():
        reject("drive_frequency", 0.0, "a number > 0: a diagram counts drive periods")

    # A zero-length run refuses an initial state that does not fit. Of all swept parameters only the
    # gap matters to that, and a state without overlap at the smallest gap has none at any other.
    gap = values.min() if name == "gap" and len(values) else system.gap
    _core.simulate(system.replace(gap=gap)._compiled, settings.initial, time=0.0)

    # A cap of None stands for the core's own default.
    options = {k: v for k, v in dataclasses.asdict(settings).items() if v is not None}
    with _progress_bar(len(values), name, shown=progress) as advance:
        sweep = _core.sweep(
            system._compiled, name, values, workers=workers, progress=advance, **options
        )
    diagram = _collect(sweep, name, values, system, settings)
    if sweep.interrupted:
        reached = np.count_nonzero(sweep.done)
        raise Interrupted(
            f"interrupted after {reached} of {len(values)} points; .result holds them", diagram
        )
    return diagram


def _swept(parameter: dict[str, Any]) -> tuple[str, NDArray[np.float64]]:
    if len(parameter) != 1 or next(iter(parameter)) not in NUMERIC_RANGES:
        given = ", ".join(parameter) or "nothing"
        raise ParameterError(
            f"the swept parameter must be exactly one of {', '.join(NUMERIC_RANGES)}; got {given}"
        )
    name, values = next(iter(parameter.items()))
    return name, vector(name, values)


@contextmanager
def _progress_bar(total: int, name: str, *, shown: bool) -> Iterator[Callable[[int], Any] | None]:
    """Give the function that is told how many points are done, or None where no bar is wanted."""
    if not shown:
        yield None
        return
    from tqdm import tqdm  # here, to keep the import of the package light

    with tqdm(total=total, desc=name, unit="run") as bar:
        yield lambda done: bar.update(done - bar.n)


def _collect(
    sweep: _core.Sweep,
    name: str,
    values: NDArray[np.float64],
    system: System,
    settings: DiagramSettings,
) -> Diagram:
    section = sweep.impact_section
    return Diagram(
        parameter_name=name,
        parameter=values,
        offset=sweep.offset,
        x1=section[:, 0].copy(),
        v1=section[:, 1].copy(),
        v2=section[:, 2].copy(),
        phase=section[:, 3].copy(),
        regime=sweep.regime,
        stroboscopic_offset=sweep.stroboscopic_offset,
        stroboscopic=sweep.stroboscopic,
        status=np.array(sweep.status, dtype=np.str_),
        m=sweep.m,
        n=sweep.n,
        residual=sweep.residual,
        contact_fraction=sweep.contact_fraction,
        final_states=sweep.final_states,
        system=system,
        settings=settings,
    )

"""Lyapunov spectra: of one motion with its convergence, or over a grid of parameters.

The perturbations are propagated by the exact derivatives of flights, impacts, chatter and contact
phases (docs/theory.md, section 7), and kept orthonormal (Benettin et al. 1980).
"""

from __future__ import annotations

import os
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .. import _core
from ..arguments import count, flag, kept_periods, positive, reject, state, threads
from ..errors import Interrupted, SimulationError
from ..fixed_arrays import FixedArrays
from ..interruption import interruptible
from ..simulation import simulate
from ..system import System
from .cells import CellTask, RunSettings, checked_axes
from .columns import need_xarray
from .engine import compute
from .grid import Grid
from .results import GridResult

if TYPE_CHECKING:
    import xarray

# Drive periods that a measurement takes at least.
_LEAST = 20
# Steps of a measurement under a constant load.
_STEPS = 1000


@interruptible
@dataclass(frozen=True, kw_only=True, eq=False)
class LyapunovSpectrum(FixedArrays):
    """The four Lyapunov exponents of a motion, per unit time, natural logarithm; read-only arrays.

    They are those of the state at fixed time. The phase of the drive is a fifth coordinate with the
    exponent 0, left out here; without a drive the flow's own 0 is one of the four (``flow``).

    Attributes
    ----------
    exponents
        Shape (4,), descending. -inf where perturbations die out at once (stick, complete chatter,
        contact, a plastic impact); NaN for the two of a wall that rests, which is left out.
    error
        Standard errors from the means of ten blocks, shape (4,); 0 for -inf.
    time
        Dimensionless time they are measured over: the last nine tenths of what was asked for. The
        first tenth aligns the perturbations.
    impacts
        Number of impacts in that time.
    history_time, history
        Times since the measurement began, shape (h,), and the exponents up to them, shape (h, 4).
    flow
        Without a drive, index of the flow's own exponent: the one nearest 0, which is 0 unless the
        motion comes to rest. None with a drive.
    label
        Label of the motion.
    system
        The system.
    """

    exponents: NDArray[np.float64]
    error: NDArray[np.float64]
    time: float
    impacts: int
    history_time: NDArray[np.float64]
    history: NDArray[np.float64]
    flow: int | None
    label: str
    system: System

    def __post_init__(self) -> None:
        """Make the arrays read-only."""
        for name in ("exponents", "error", "history_time", "history"):
            getattr(self, name).flags.writeable = False

    @property
    def per_period(self) -> NDArray[np.float64]:
        """The exponents per drive period, those of the stroboscopic map, shape (4,)."""
        return self.exponents * self.system.drive_period

    @property
    def sum(self) -> float:
        """Sum of the exponents: the mean rate of contraction of volumes."""
        return float(self.exponents.sum())

    def to_xarray(self) -> xarray.Dataset:
        """Return the exponents, their errors and their history as a labelled data set.

        Raises
        ------
        ImportError
            If xarray is not installed.
        """
        need_xarray()
        import xarray

        return xarray.Dataset(
            {
                "exponents": ("exponent", self.exponents),
                "exponent_errors": ("exponent", self.error),
                "history": (("time", "exponent"), self.history),
            },
            {"time": self.history_time},
            {
                "label": self.label,
                "measured_time": self.time,
                "impacts": self.impacts,
                "system": self.system.to_json(),
                "version": _core.__version__,
            },
        )

    def __repr__(self) -> str:
        """Give the exponents with their errors."""
        texts = [
            f"{value:.4g} +- {error:.1g}" if np.isfinite(value) else f"{value}"
            for value, error in zip(self.exponents, self.error, strict=True)
        ]
        return f"<LyapunovSpectrum of a motion {self.label}: {', '.join(texts)}>"


@interruptible
class LyapunovSweep(GridResult):
    """Lyapunov spectra over a grid; arrays have the shape of the grid before their own."""

    kind = "lyapunov"

    @property
    def exponents(self) -> NDArray[np.float64]:
        """The exponents as in ``LyapunovSpectrum``, shape (..., 4)."""
        return self.columns["exponents"]

    @property
    def error(self) -> NDArray[np.float64]:
        """Their standard errors, shape (..., 4)."""
        return self.columns["exponent_errors"]


@interruptible
def lyapunov_spectrum(
    system: System,
    *,
    initial: ArrayLike,
    periods: int | None = None,
    keep: int | None = None,
    time: float | None = None,
    max_events: int | None = None,
    tolerance: float = 1e-12,
    progress: bool = False,
    workers: int | None = None,
    chunk: int | None = None,
    client: Any = None,
    store: str | os.PathLike[str] | None = None,
    **axes: ArrayLike,
) -> LyapunovSpectrum | LyapunovSweep:
    """Measure the Lyapunov exponents of a motion, or of one for each cell of a grid.

    Parameters
    ----------
    system
        The system.
    initial
        (x1, v1, x2, v2) at t = 0.
    periods
        Drive periods in all, at least 20 (default 2000).
    keep
        How many of them at the end the exponents are measured over, at least 20 (default three
        quarters, or 20 if that is more). A motion that has not come to its periodic orbit before is
        followed until it has, and measured then.
    time
        In place of periods, under a constant load (drive frequency 0) and without axes: time in
        all; the last three quarters are measured.
    max_events, tolerance
        As in ``simulate``.
    progress, workers, chunk, client, store
        As in ``sweep``; the last three for a grid only.
    **axes
        Arrays of values as in ``sweep``; none for a single motion.

    Returns
    -------
    LyapunovSpectrum or LyapunovSweep
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
    """
    if not isinstance(system, System):
        reject("system", system, "a vibroimpact.System")
    if not axes:
        threads(workers)
        flag("progress", progress)
        for name, given in (("chunk", chunk), ("client", client), ("store", store)):
            if given is not None:
                reject(name, given, "None for a single motion: it is one task, not stored")
    if time is not None:
        if axes or periods is not None or keep is not None or system.drive_frequency > 0.0:
            reject("time", time, "None, but for a single motion under a constant load")
        return _single(system, initial, positive("time", time), None, 0, max_events, tolerance)
    periods = count("periods", 2000 if periods is None else periods, least=_LEAST)
    usual = max(-(-3 * periods // 4), _LEAST)
    measured = kept_periods(keep, periods, usual=usual, least=_LEAST)
    if not axes:
        if system.drive_frequency == 0.0:
            reject("time", time, "a number > 0: without a drive there are no periods")
        return _single(system, initial, None, periods, measured, max_events, tolerance)
    before = periods - measured
    run = RunSettings.checked(
        initial=initial,
        periods=max(before, 1),
        keep=min(before, _LOOKED_AT),
        max_events=max_events,
        tolerance=tolerance,
        section_phase=0.0,
    )
    task = CellTask(
        kind=LyapunovSweep.kind,
        system=system,
        grid=Grid(checked_axes(lyapunov_spectrum, system, axes)),
        run=run,
        measure="spectrum",
        measured=measured,
    )
    return compute(
        task,
        LyapunovSweep,
        chunk=chunk,
        workers=workers,
        progress=progress,
        client=client,
        store=store,
    )


# Drive periods before the measurement from which the period is told.
_LOOKED_AT = 100


def _single(
    system: System,
    initial: ArrayLike,
    time: float | None,
    periods: int | None,
    measured: int,
    max_events: int | None,
    tolerance: float,
) -> LyapunovSpectrum:
    if time is None:
        assert periods is not None
        before = max(periods - measured, 1)
        length: dict[str, Any] = {"periods": before, "keep": min(before, _LOOKED_AT)}
        steps, step = measured, None
    else:
        length = {"time": 0.25 * time}
        steps, step = _STEPS, 0.75 * time / _STEPS
    run = simulate(
        system, initial=state(initial), max_events=max_events, tolerance=tolerance, **length
    )
    found = _core.lyapunov_spectrum(run._core, steps, step)
    flow = None
    if system.drive_frequency == 0.0 or system.moment_amplitude == system.force_amplitude == 0.0:
        flow = int(np.argmin(np.abs(found.exponents)))
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
    if found.interrupted:
        raise Interrupted(
            f"interrupted after a time {found.time:g} of the measurement; .result holds it",
            spectrum,
        )
    if found.error is not None:
        raise SimulationError(f"no Lyapunov exponents: {found.error}")
    return spectrum

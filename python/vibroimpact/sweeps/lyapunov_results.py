"""Lyapunov exponents as a result: of one motion, and over a grid."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Self

import numpy as np
from numpy.typing import NDArray

from .. import _core
from ..archived import Archived
from ..errors import Interrupted, SimulationError
from ..fixed_arrays import FixedArrays
from ..interruption import interruptible
from ..run import read_only
from ..showing import Facts, Shown
from ..system import System
from ..verbs import verb
from .columns import need_xarray
from .results import GridResult

if TYPE_CHECKING:
    import xarray
    from matplotlib.axes import Axes

_ARRAYS = ("exponents", "error", "history_time", "history")


@interruptible
@dataclass(frozen=True, kw_only=True, eq=False)
class LyapunovSpectrum(Archived, FixedArrays, Shown):
    """The four Lyapunov exponents of a motion, per unit time, natural logarithm; read-only arrays.

    They belong to the state at fixed time. The phase of the drive is a fifth coordinate with the
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

    Examples
    --------
    >>> import vibroimpact as vi
    >>> system = vi.System(mass_ratio=0.6, frequency_ratio=2, restitution=0.8, gap=0.5,
    ...                    drive_frequency=1.8, moment_amplitude=1)
    >>> spectrum = vi.lyapunov_spectrum(system, initial=(0, 0.5, 0, 0), periods=200)
    >>> spectrum.label, spectrum.sum < 0
    ('1-1', True)
    """

    _KIND = "spectrum"
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
        for name in _ARRAYS:
            getattr(self, name).flags.writeable = False

    @property
    def per_period(self) -> NDArray[np.float64]:
        """The exponents per drive period, those of the stroboscopic map, shape (4,)."""
        return self.exponents * self.system.drive_period

    @property
    def sum(self) -> float:
        """Sum of the exponents that there are: the mean rate of contraction of volumes."""
        return float(self.exponents[~self.missing].sum())

    @property
    def missing(self) -> NDArray[np.bool_]:
        """Which exponents there are none of, shape (4,): the last two with a wall at rest."""
        return np.isnan(self.exponents)

    @property
    def largest(self) -> float:
        """The largest exponent: > 0 for chaotic motion."""
        return float(self.exponents[0])

    @property
    def dimension(self) -> float:
        """Kaplan-Yorke dimension of the attractor in the space of (x1, v1, x2, v2).

        It is j + (lambda_1 + ... + lambda_j)/abs(lambda_j+1) with the largest j for which the sum
        is not negative; 0 if lambda_1 < 0, as for a periodic motion. With a drive the attractor is
        that of the stroboscopic section; in the space with the phase its dimension is greater by 1.
        Source: Kaplan and Yorke (1979).

        Examples
        --------
        >>> import vibroimpact as vi
        >>> system = vi.System(mass_ratio=0.6, frequency_ratio=2.0, restitution=0.8, gap=0.5,
        ...                    drive_frequency=1.8, moment_amplitude=1.0)
        >>> spectrum = vi.lyapunov_spectrum(
        ...     system.replace(damping=(0.1, 0.1)), initial=(0, 0.5, 0, 0), periods=400
        ... )
        >>> spectrum.label, spectrum.dimension
        ('1-1', 0.0)
        """
        return float(dimension_of(self.exponents))

    def plot(self, **options: Any) -> Axes:
        """Draw the exponents over the time of their measurement, by ``vi.plot.lyapunov``.

        Parameters
        ----------
        **options
            As in ``vi.plot.lyapunov``.

        Returns
        -------
        matplotlib.axes.Axes

        Examples
        --------
        >>> spectrum.plot().get_xlabel()
        'time $t$ since the measurement began'
        """
        axes: Axes = verb("draw")(self, **options)
        return axes

    def _parts(self) -> tuple[dict[str, Any], dict[str, NDArray[Any]]]:
        metadata = {
            **{name: getattr(self, name) for name in ("time", "impacts", "flow", "label")},
            "system": self.system.to_dict(),
        }
        return metadata, {name: getattr(self, name) for name in _ARRAYS}

    @classmethod
    def _from_parts(cls, metadata: dict[str, Any], arrays: dict[str, NDArray[Any]]) -> Self:
        flow = metadata["flow"]
        return cls(
            time=float(metadata["time"]),
            impacts=int(metadata["impacts"]),
            flow=None if flow is None else int(flow),
            label=str(metadata["label"]),
            system=System.from_dict(metadata["system"]),
            **{name: arrays[name] for name in _ARRAYS},
        )

    def _facts(self) -> Facts:
        facts: Facts = {"motion": self.label}
        for k, (value, error) in enumerate(zip(self.exponents, self.error, strict=True), 1):
            facts[f"exponent {k}"] = f"{value:.6g} +- {error:.1g}"
        return facts | {
            "dimension": f"{self.dimension:.4g}",
            "measured": f"over a time of {self.time:.6g}, with {self.impacts} impacts",
        }

    def to_xarray(self) -> xarray.Dataset:
        """Return the exponents, their errors and their history as a labelled data set.

        Raises
        ------
        ImportError
            If xarray is not installed.

        Examples
        --------
        >>> dict(spectrum.to_xarray().sizes)
        {'exponent': 4, 'time': 135}
        """
        need_xarray()
        import xarray

        return xarray.Dataset(
            {
                "exponents": ("exponent", self.exponents),
                "exponent_errors": ("exponent", self.error),
                "history": (("time", "exponent"), self.history),
            },
            {"time": self.history_time, "exponent": [1, 2, 3, 4]},
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
            if not np.isnan(value)
        ]
        texts += ["two of a wall at rest left out"] if self.missing.any() else []
        return f"<LyapunovSpectrum of a motion {self.label}: {', '.join(texts)}>"


@interruptible
class LyapunovSweep(GridResult):
    """Lyapunov spectra over a grid; arrays have the shape of the grid before their own.

    Examples
    --------
    >>> import vibroimpact as vi
    >>> system = vi.System(mass_ratio=0.6, frequency_ratio=2, restitution=0.8, gap=0.5,
    ...                    drive_frequency=1.8, moment_amplitude=1)
    >>> result = vi.lyapunov_spectrum(
    ...     system, drive_frequency=[1.7, 1.8], initial=(0, 0.5, 0, 0), periods=200,
    ... )
    >>> result.exponents.shape
    (2, 4)
    """

    kind = "lyapunov"

    @property
    def exponents(self) -> NDArray[np.float64]:
        """The exponents as in ``LyapunovSpectrum``, shape (..., 4); of structures (..., 2 N)."""
        return self.columns["exponents"]

    @property
    def error(self) -> NDArray[np.float64]:
        """Their standard errors, of the same shape."""
        return self.columns["exponent_errors"]

    @property
    def largest(self) -> NDArray[np.float64]:
        """The largest exponent of each cell, shape of the grid."""
        return read_only(self.exponents[..., 0].copy())

    @property
    def dimension(self) -> NDArray[np.float64]:
        """Kaplan-Yorke dimension of each cell, as in ``LyapunovSpectrum``, shape of the grid."""
        return read_only(dimension_of(self.exponents))


def measured_whole(found: Any, spectrum: Any) -> None:
    """Let the compiled measurement of a spectrum that has not come to its end raise.

    Raises
    ------
    Interrupted
        After Ctrl-C; ``.result`` is the spectrum up to there.
    SimulationError
        If the motion ends, or its derivatives could not be computed.
    """
    if found.interrupted:
        message = f"interrupted after a time {found.time:g} of the measurement"
        raise Interrupted(message, spectrum, holds="it")
    if found.error is not None:
        raise SimulationError(f"no Lyapunov exponents: {found.error}")


def dimension_of(exponents: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the Kaplan-Yorke dimensions of spectra in falling order, along the last axis.

    Those of a wall at rest, which are NaN and stand last, are left out; NaN without any other.
    """
    result = np.full(exponents.shape[:-1], np.nan)
    for place in np.ndindex(result.shape):
        spectrum = exponents[place][~np.isnan(exponents[place])]
        if not len(spectrum):
            continue
        sums = np.cumsum(spectrum)
        j = int(np.count_nonzero(np.logical_and.accumulate(sums >= 0.0)))
        part = sums[j - 1] / -spectrum[j] if 0 < j < len(spectrum) else 0.0
        result[place] = j + part
    return result

"""Lyapunov exponents as a result: of one motion, and over a grid."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from .. import _core
from ..fixed_arrays import FixedArrays
from ..interruption import interruptible
from ..system import System
from .columns import need_xarray
from .results import GridResult

if TYPE_CHECKING:
    import xarray


@interruptible
@dataclass(frozen=True, kw_only=True, eq=False)
class LyapunovSpectrum(FixedArrays):
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
        """Sum of the exponents that there are: the mean rate of contraction of volumes."""
        return float(self.exponents[~self.missing].sum())

    @property
    def missing(self) -> NDArray[np.bool_]:
        """Which exponents there are none of, shape (4,): the last two with a wall at rest."""
        return np.isnan(self.exponents)

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
            if not np.isnan(value)
        ]
        texts += ["two of a wall at rest left out"] if self.missing.any() else []
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

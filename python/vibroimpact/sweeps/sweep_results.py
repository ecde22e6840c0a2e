"""Sweeps and charts as results: a label for each cell of a grid."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..interruption import interruptible
from .results import GridResult


@interruptible
class Sweep(GridResult):
    """A label for each cell of a grid, and its largest Lyapunov exponent if asked for.

    Attributes are those of ``GridResult``; all arrays have the shape of the grid.
    """

    kind = "sweep"

    @property
    def contact_fraction(self) -> NDArray[np.float64]:
        """Part of the kept time in sustained contact, in [0, 1]; NaN where nothing is kept."""
        return self.columns["contact_fraction"]

    @property
    def final_states(self) -> NDArray[np.float64]:
        """State x1, v1, x2, v2 at the end of each run, shape (..., 4)."""
        return self.columns["final_state"]

    @property
    def largest_exponent(self) -> NDArray[np.float64]:
        """Largest Lyapunov exponent per unit time: of a periodic motion from its Floquet
        multipliers (-inf if all are 0), else measured; NaN where it could not be computed.

        Raises
        ------
        AttributeError
            If it was computed without ``exponents=True``.
        """  # noqa: D205
        return self._exponents("largest_exponent")

    @property
    def exponent_error(self) -> NDArray[np.float64]:
        """Standard error; of an exponent from multipliers, its change from orbit to orbit."""
        return self._exponents("exponent_error")


@interruptible
class Chart(Sweep):
    """A sweep over two axes: arrays have the shape (values of the first, of the second)."""

    kind = "chart"

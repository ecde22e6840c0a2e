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

    Examples
    --------
    >>> import vibroimpact as vi
    >>> system = vi.System(mass_ratio=0.6, frequency_ratio=2, restitution=0.8, gap=0.5,
    ...                    drive_frequency=1.8, moment_amplitude=1)
    >>> states = vi.sweep(system, drive_frequency=[1.7, 1.8], initial=(0, 0.5, 0, 0), periods=200)
    >>> states.axes["drive_frequency"], states.complete
    (array([1.7, 1.8]), True)
    """

    kind = "sweep"

    @property
    def contact_fraction(self) -> NDArray[np.float64]:
        """Part of the kept time in sustained contact, in [0, 1]; NaN where nothing is kept."""
        return self.columns["contact_fraction"]

    @property
    def final_states(self) -> NDArray[np.float64]:
        """State at the end of each run, shape (..., 4); of structures q and v, (..., 2, N)."""
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
    """A sweep over two axes: arrays have the shape (values of the first, of the second).

    Examples
    --------
    >>> import vibroimpact as vi
    >>> system = vi.System(mass_ratio=0.6, frequency_ratio=2, restitution=0.8, gap=0.5,
    ...                    drive_frequency=1.8, moment_amplitude=1)
    >>> chart = vi.chart(
    ...     system, drive_frequency=[1.7, 1.8, 1.9], restitution=[0.7, 0.8], initial=(0, 0.5, 0, 0),
    ...     periods=200,
    ... )
    >>> list(chart.axes), chart.largest_exponent.shape
    (['drive_frequency', 'restitution'], (3, 2))
    """

    kind = "chart"

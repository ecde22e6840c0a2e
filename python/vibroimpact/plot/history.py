"""What all drawings of a run against time share: window, samples, units, marks, axis of time."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from numpy.typing import NDArray

from ..run import Run
from ..scales import Units
from .curve import sample
from .given import expected
from .marks import mark_contact_times, mark_regimes
from .style import curve_legend, new_axes
from .units import AxisUnits

Array = NDArray[np.float64]


class History:
    """A run against time on axes, with bands where contact is sustained.

    Attributes
    ----------
    run, units, axes
        What is drawn, in which units, and where.
    curve
        Its samples, dimensionless.
    time
        Their times as drawn.
    """

    def __init__(
        self,
        run: Run,
        *,
        window: tuple[float, float] | None,
        periods: Any,
        points_per_period: Any,
        units: Units | None,
        ax: Axes | None,
    ) -> None:
        self.run = expected("run", run, Run)
        self.units = AxisUnits.of(units, run.system)
        self.curve = sample(
            run,
            window=self.units.window(window, run),
            periods=periods,
            points_per_period=points_per_period,
        )
        self.time: Array = self.curve.time * self.units.factor("time")
        # Now that nothing is refused.
        self.axes = new_axes(ax)
        mark_contact_times(self.axes, run, self.window, self.units.factor("time"))

    @property
    def window(self) -> tuple[float, float]:
        """First and last time, dimensionless."""
        return float(self.curve.time[0]), float(self.curve.time[-1])

    @property
    def hits(self) -> NDArray[np.void]:
        """The impacts in the window, dimensionless."""
        hits: NDArray[np.void] = self.run.impacts[self.curve.impacts]
        return hits

    def mark_regimes(self, heights: Array) -> None:
        """Mark the regimes of the impacts at heights as drawn."""
        moments = self.hits["time"] * self.units.factor("time")
        mark_regimes(self.axes, self.run, moments, heights, self.curve.impacts)

    def finish(self, ylabel: str, *, legend: bool) -> Axes:
        """Label the axes; return them."""
        self.axes.set_ylabel(ylabel)
        self.axes.set_xlim(self.time[0], self.time[-1])
        self.axes.set_xlabel(self.units.label("time"))
        curve_legend(self.axes, legend)
        return self.axes

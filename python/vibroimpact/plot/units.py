"""Axes of pictures of a run, dimensionless or in SI: factors of the numbers, and labels."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..run import Run
from ..run_in_si import times_of_run
from ..scales import COLUMN_UNITS, Scales, Units, chosen, unit_of
from ..system import System
from .axis_names import STATE_NAMES, in_unit, of_bodies
from .curve import shown_window

Array = NDArray[np.float64]


@dataclass(frozen=True)
class AxisUnits:
    """The units in which a picture of a run is drawn; dimensionless without scales."""

    scales: Scales | None

    @classmethod
    def of(cls, units: Units | None, system: System) -> AxisUnits:
        """Return the units asked for.

        Raises
        ------
        ParameterError
            For other units than ``"SI"``, or if the system has no scales.
        """
        return cls(chosen(units, system.scales))

    @property
    def is_si(self) -> bool:
        """Whether numbers are drawn in SI."""
        return self.scales is not None

    def factor(self, column: str) -> float:
        """Return the factor of a column such as ``v1_pre``, ``time``, ``normal_force``."""
        return unit_of(column, self.scales)

    def table(self, rows: NDArray[np.void]) -> NDArray[np.void]:
        """Return a table of impacts in these units."""
        if self.scales is None:
            return rows
        changed = np.array(rows)
        for name in changed.dtype.names or ():
            if self.factor(name) != 1.0:
                changed[name] *= self.factor(name)
        return changed

    def window(self, window: tuple[float, float] | None, run: Run) -> tuple[float, float] | None:
        """Return a window of time, given in these units, as a dimensionless one."""
        if window is None or self.scales is None:
            return window
        # In seconds it must be a window, too: the error names what was given.
        start, end = times_of_run(run, shown_window(run, window), self.scales).tolist()
        return start, end

    def label(self, column: str, text: str | None = None) -> str:
        """Return the label of an axis for a column, by default its name, with its unit in SI."""
        said = STATE_NAMES.get(column, column) if text is None else text
        return in_unit(said, self._sign(column))

    def of_bodies(self, what: str, bodies: Sequence[int]) -> str:
        """Return the label of an axis of positions "x" or velocities "v" of some bodies."""
        return of_bodies(what, {body: self._sign(f"{what}{body}") for body in bodies})

    def _sign(self, column: str) -> str:
        """Return the sign of the unit of a column; nothing where there is none."""
        return COLUMN_UNITS.get(column, ("", ""))[1] if self.is_si else ""

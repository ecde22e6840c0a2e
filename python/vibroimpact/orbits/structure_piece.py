"""Part of a branch of a structure, with one order of impacts."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from .. import _core
from ..arguments import count, reject
from ..interruption import interruptible
from ..made import varied
from ..structure import Structure
from .branch import Piece

Array = NDArray[np.float64]

# What `at_impacts` and `at_sections` know.
AT_STOPS = ("approach_velocity", "phase", "q", "v_pre", "v_post")
AT_STOP_SECTIONS = ("q", "v")


@interruptible
@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class StructurePiece(Piece):
    """Part of a branch of a structure, with one order of impacts.

    Attributes
    ----------
    system
        The structure, at any value of the parameter.
    parameter
        Name of the parameter.
    itinerary
        The impacts.
    values
        Of the parameter, shape (k,).
    nodes
        Shape (k, impacts, 2 N + 1), as in StructureOrbit; (k, 1, 2 N) without impacts.
    multipliers
        Complex, by falling modulus, shape (k, 2 N).
    """

    system: Structure  # type: ignore[assignment]
    itinerary: _core.StructureItinerary  # type: ignore[assignment]

    def _system_with(self, value: float) -> Structure:  # type: ignore[override]
        found: Structure = varied(self.system, {self.parameter: value})
        return found

    @property
    def stops(self) -> NDArray[np.int64]:
        """The stop of each impact, shape (impacts,)."""
        hits = [leg.stop for leg in self.itinerary.legs if leg.stop is not None]
        return np.array(hits, np.int64)

    @cached_property
    def _before(self) -> Array:
        """States (k, impacts, 2, N) just before the impacts; coordinates as the user has them."""
        return self._told(self.itinerary.before_events)[:, : len(self.stops)]

    @cached_property
    def impacts(self) -> Array:
        """Coordinates at the impacts, shape (k, impacts, N)."""
        return self._before[:, :, 0]

    @cached_property
    def _states(self) -> Array:
        """States (k, m, 2, N) at the starts of the m drive periods."""
        return self._told(self.itinerary.sections)

    def _told(self, kernel: Callable[[_core.Structure, Array], Array]) -> Array:
        """Return what a kernel says of each point, in the coordinates that the user has."""
        systems = [self._system_with(value) for value in self.values.tolist()]
        return np.array(
            [
                system._from_core(kernel(system._compiled, nodes.copy()))
                for system, nodes in zip(systems, self.nodes, strict=True)
            ]
        )

    @property
    def sections(self) -> Array:
        """States (k, m, 2, N) at the starts of the m drive periods: rows q and v."""
        return self._states

    def at_impacts(self, name: str, coordinate: int = 0) -> Array:
        """Return a quantity of the impacts, in the order of ``stops``.

        Parameters
        ----------
        name
            ``"approach_velocity"``, ``"phase"`` in [0, 2 pi), ``"q"``, ``"v_pre"`` or ``"v_post"``.
        coordinate
            Of the last three this coordinate, from 0.

        Returns
        -------
        array of shape (k, impacts)

        Raises
        ------
        ParameterError
            For another name, or no such coordinate.
        """
        if name not in AT_STOPS:
            reject("name", name, f"one of {', '.join(AT_STOPS)}")
        place = count("coordinate", coordinate, least=0, most=self.system.coordinates - 1)
        stops = self.stops
        if name in ("q", "v_pre"):
            column: Array = self._before[:, :, int(name == "v_pre"), place]
            return column
        size = (self.nodes.shape[2] - 1) // 2 if len(stops) else 0
        # A leg ends where the next one begins.
        after = np.roll(self.nodes, -1, axis=1)[:, : len(stops)]
        if name == "v_post":
            physical: Array = self.system._from_core(after[:, :, size : 2 * size])[:, :, place]
            return physical
        systems = [self._system_with(value) for value in self.values.tolist()]
        result = np.empty((len(self.values), len(stops)))
        for k, system in enumerate(systems):
            times = after[k, :, -1] if len(stops) else np.empty(0)
            turned = system.drive_frequency * times
            if name == "phase":
                result[k] = np.mod(turned + system.phase, math.tau)
                continue
            for i, number in enumerate(stops.tolist()):
                stop = system.stops[number]
                wall = stop.amplitude * system.drive_frequency * math.sin(turned[i] + stop.phase)
                result[k, i] = stop.normal @ self._before[k, i, 1] + wall
        return result

    def at_sections(self, name: str, coordinate: int = 0) -> Array:
        """Return a coordinate at the starts of the m drive periods, shape (k, m).

        Parameters
        ----------
        name
            ``"q"`` or ``"v"``.
        coordinate
            Which, from 0.

        Raises
        ------
        ParameterError
            For another name, or no such coordinate.
        """
        if name not in AT_STOP_SECTIONS:
            reject("name", name, f"one of {', '.join(AT_STOP_SECTIONS)}")
        place = count("coordinate", coordinate, least=0, most=self.system.coordinates - 1)
        column: Array = self._states[:, :, AT_STOP_SECTIONS.index(name), place]
        return column

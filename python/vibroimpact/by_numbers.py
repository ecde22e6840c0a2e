"""By what a run is differentiated to get its derivatives by the numbers that its machine has.

These are own numbers of the machine, or those of a function that makes it, such as a stiffness in
N/m: then derivatives by own numbers, or along directions of the fields of a structure, are chained
with those of the function.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .machine import Machine
from .stop import of_one_stop


def direction_of(name: str) -> str:
    """Return what a direction is called: no own name of a structure is so."""
    return f"direction {name}"


@dataclass(frozen=True)
class Basis:
    """By what a run of a machine is differentiated to get its derivatives by k numbers.

    Attributes
    ----------
    names
        Own numbers of the machine.
    directions
        Derivatives of fields of a structure, by names that stand for them.
    chain
        The derivatives of these by the k numbers, (names and directions, k).
    """

    names: list[str]
    directions: dict[str, dict[str, Any]]
    chain: NDArray[np.float64]

    def of(self, run: Any) -> Any:
        """Return the sensitivity of a run; its last axis times the chain is that by the numbers."""
        return run.sensitivity(*self.names, **self.directions)

    def slopes(self, field: str, shape: tuple[int, ...] = ()) -> NDArray[np.float64]:
        """Return the derivatives of a field by what the run is differentiated by, (*shape, own).

        That of a stop, as ``gap_0``, also changes with that of all stops.
        """
        one = of_one_stop(field)
        of_all = one.what if one else field
        none = np.zeros(shape)
        entries = [none + float(name in (field, of_all)) for name in self.names]
        for direction in self.directions.values():
            entries.append(none + direction.get(field, direction.get(of_all, 0.0)))
        return np.stack(entries, axis=-1) if entries else np.zeros((*shape, 0))

    @property
    def frequency(self) -> NDArray[np.float64]:
        """The derivatives of the drive frequency by the k numbers."""
        found: NDArray[np.float64] = self.slopes("drive_frequency") @ self.chain
        return found

    def with_coordinates(self, coordinates: Sequence[str]) -> Basis:
        """Return one with coordinates of the start beside the numbers: they are the last ones."""
        (own, k), more, along = self.chain.shape, len(coordinates), len(self.directions)
        chain = np.zeros((own + more, k + more))
        here = own - along  # names come before directions
        chain[:here, :k] = self.chain[:here]
        chain[here : here + more, k:] = np.eye(more)
        chain[here + more :, :k] = self.chain[here:]
        return Basis([*self.names, *coordinates], self.directions, chain)

    def turned(self, machine: Machine, time: float) -> Basis:
        """Return the one for a run that starts later: the phase turns with the drive frequency."""
        rates = time * self.frequency
        if not rates.any():
            return self
        turning = machine._turning
        if [*turning] == ["phase"] and "phase" in self.names:
            chain = self.chain.copy()
            chain[self.names.index("phase")] += rates
            return Basis(self.names, self.directions, chain)
        if [*turning] == ["phase"]:
            chain = np.insert(self.chain, len(self.names), rates, axis=0)
            return Basis([*self.names, "phase"], self.directions, chain)
        directions = self.directions | {direction_of("phase"): turning}
        return Basis(self.names, directions, np.vstack([self.chain, rates]))

"""Derivatives that a run was made with: by what, and those by some of it.

A run that keeps its last drive periods only has not kept the motion before them, on which all of
its derivatives depend. Where they are asked for before it is made, they are carried along.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from . import _core
from .arguments import reject

Array = NDArray[np.float64]
# What a run is differentiated by: names, and directions by name.
Asked = tuple[tuple[str, ...], Mapping[str, Any]]


def asked_of(sensitivity: Any) -> Asked | None:
    """Return names and directions of an argument ``sensitivity``; None if there is none.

    Raises
    ------
    ParameterError
        If it is neither names nor a mapping.
    """
    if sensitivity is None:
        return None
    if isinstance(sensitivity, str):
        return (sensitivity,), {}
    allowed = "names of what the run is differentiated by, each once, or a mapping to directions"
    if isinstance(sensitivity, Mapping):
        names = tuple(name for name, along in sensitivity.items() if along is None)
        rest = {name: along for name, along in sensitivity.items() if along is not None}
    elif isinstance(sensitivity, Sequence) and not isinstance(sensitivity, bytes | bytearray):
        names, rest = tuple(sensitivity), {}
    else:
        reject("sensitivity", sensitivity, allowed)
    own = (*names, *rest)
    if not own or any(not isinstance(name, str) for name in own) or len({*own}) < len(own):
        reject("sensitivity", sensitivity, allowed)
    return names, rest


@dataclass(frozen=True)
class MadeWith:
    """The derivatives that a run was made with.

    Attributes
    ----------
    core
        As the core has them.
    names, directions
        What they are by, in this order.
    """

    core: _core.Sensitivity
    names: tuple[str, ...]
    directions: Mapping[str, Any]

    def by(self, names: tuple[str, ...], directions: Mapping[str, Any]) -> Any:
        """Return those by these names and directions; None if some are not among them."""
        if not all(isinstance(name, str) for name in names):
            return None  # which is refused where derivatives are computed
        own = [*self.names, *self.directions]
        # A direction can hold arrays: the same object is the same direction.
        known = all(self.directions.get(name) is along for name, along in directions.items())
        if not known or not {*names} <= {*self.names} or not (names or directions):
            return None
        places = [own.index(name) for name in (*names, *directions)]
        if len({*places}) < len(places):
            return None  # a name given twice is refused there, too
        if places == [*range(len(own))]:
            return self.core

        def columns(rows: Array) -> Array:
            return rows[..., places]

        return Derived(self.core, columns, columns)


class Derived:
    """What the core gives of a sensitivity, in other rows or columns.

    Parameters
    ----------
    core
        As the core has it.
    of_states
        Changes arrays of states, (..., k).
    of_times
        Changes arrays of times, (n, k).
    """

    def __init__(
        self,
        core: _core.Sensitivity | Derived,
        of_states: Callable[[Array], Array],
        of_times: Callable[[Array], Array],
    ) -> None:
        self._core, self._of_states, self._of_times = core, of_states, of_times

    @property
    def times(self) -> Array:
        """Those of the core, changed."""
        return self._of_times(self._core.times)

    @property
    def before(self) -> Array:
        """Those of the core, changed."""
        return self._of_states(self._core.before)

    @property
    def after(self) -> Array:
        """Those of the core, changed."""
        return self._of_states(self._core.after)

    @property
    def stroboscopic(self) -> Array:
        """Those of the core, changed."""
        return self._of_states(self._core.stroboscopic)

    @property
    def final_state(self) -> Array:
        """That of the core, changed."""
        return self._of_states(self._core.final_state)

    @property
    def one_sided(self) -> list[tuple[int, float, str]]:
        """Those of the core."""
        return self._core.one_sided

    @property
    def until(self) -> float | None:
        """That of the core."""
        return self._core.until

    def trajectory(self, t: Array) -> tuple[Array, bool]:
        """Return that of the core, changed."""
        rows, interrupted = self._core.trajectory(t)
        return self._of_states(rows), interrupted

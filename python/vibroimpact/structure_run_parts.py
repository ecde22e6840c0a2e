"""Parts of a run of a structure: the state at its end, and what stands for the core of a saved one.

A run is saved and pickled as its tables, sections and end, not as the legs of its motion. One that
comes back has all that can be read from it; what needs the legs raises NotResumableError.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final, NoReturn

import numpy as np
from numpy.typing import NDArray

from .arguments import reject
from .errors import NotResumableError
from .fixed_arrays import FixedArrays
from .interruption import interruptible
from .showing import Facts, Shown, in_a_line

Array = NDArray[np.float64]

# What a run is saved as, beside its system, its start, its sections and the state at its end.
TABLES: Final = ("impacts", "grazes", "contacts", "events")
END: Final = ("time", "period", "time_in_period", "mode")
FACTS: Final = ("time_in_contact", "stop_reason", "stop_detail", "kept_from", "impact_count")


@interruptible
@dataclass(frozen=True, kw_only=True, eq=False)
class StructureState(FixedArrays, Shown):
    """The state of a structure at the end of a run, after the impact if one falls on that instant.

    Attributes
    ----------
    q, v
        Coordinates and velocities, (N,).
    time
        Time since the start.
    period, time_in_period
        Completed drive periods and the time since the last one, which together stay exact where
        ``time`` has lost digits.
    mode
        ``"flight"``; or while stops are closed ``"closed"``, without friction, or of the one with
        friction ``"slide_positive"``, ``"slide_negative"`` (the sign of tangent . v) or
        ``"stick"``.
    closed
        Which stops are closed, (number of stops,), booleans.

    Examples
    --------
    >>> import vibroimpact as vi
    >>> structure = vi.Structure([[1]], [[1]], [vi.Stop([1], 0.5, 0.8)],
    ...                          drive_amplitude=[1], drive_frequency=2.0)
    >>> run = vi.simulate(structure, initial=[[0], [0]], periods=10)
    >>> run.final_state.mode, run.final_state.q.shape
    ('flight', (1,))
    """

    q: Array
    v: Array
    time: float
    period: int
    time_in_period: float
    mode: str
    closed: NDArray[np.bool_]

    @property
    def state(self) -> Array:
        """Coordinates and velocities (2, N), as ``initial=`` takes them."""
        return np.stack([self.q, self.v])

    def __repr__(self) -> str:
        """Say when it is, what the stops do, and where the coordinates are."""
        return (
            f"<StructureState at time {self.time:.6g} (period {self.period}), "
            f"{self.mode.replace('_', ' ')}, q = {in_a_line(self.q)}>"
        )

    def _facts(self) -> Facts:
        closed = ", ".join(str(stop) for stop in np.flatnonzero(self.closed)) or "none"
        return {
            "time": f"{self.time:.6g}",
            "drive periods": self.period,
            "mode": self.mode.replace("_", " "),
            "closed stops": closed,
            "q": in_a_line(self.q),
            "v": in_a_line(self.v),
        }


class SavedCore:
    """Stands in a run that was loaded for the core of one that was simulated."""

    interrupted = False

    def __init__(self, facts: Mapping[str, Any]) -> None:
        self.time_in_contact = float(facts["time_in_contact"])
        self.stop_reason = str(facts["stop_reason"])
        self.stop_detail = str(facts["stop_detail"])
        self.kept_from = float(facts["kept_from"])
        self.impact_count = int(facts["impact_count"])

    def __getattr__(self, name: str) -> NoReturn:
        """Refuse what only the core of a simulated run has.

        Raises
        ------
        NotResumableError
            Always, but for names that no core has.
        """
        if name[:1] == "_":
            raise AttributeError(name)
        raise NotResumableError(
            f"no {name} of a StructureRun from a file or a pickle: these have its tables, not its "
            "legs; simulate it again: vi.simulate(run.system, initial=run.initial, ...)"
        )


def check_arrays(given: Mapping[str, NDArray[Any]], like: Mapping[str, NDArray[Any]]) -> None:
    """Check that arrays are of the same names, types and rows as others.

    Raises
    ------
    ParameterError
        Names the array.
    """
    if given.keys() != like.keys():
        reject("arrays", sorted(given), ", ".join(sorted(like)))
    for name, array in given.items():
        known, fixed = like[name], name in ("initial", "final_state")
        same = array.shape == known.shape if fixed else array.shape[1:] == known.shape[1:]
        if array.ndim != known.ndim or array.dtype != known.dtype or not same:
            reject(name, f"{array.dtype}, {array.shape}", f"rows like {known.dtype}, {known.shape}")

"""Derivatives of a run by the numbers of its machine and by its start, as a result.

The rows of the tables are those of the run. The definitions are on the sensitivity page.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from types import MappingProxyType
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .arguments import reject, times_of
from .errors import Interrupted
from .interruption import interruptible
from .run_parts import read_only
from .showing import Facts, Shown, counted, in_a_line


class ImpactSensitivity(NamedTuple):
    """Derivatives of the kept impacts of a run by k names; rows as in ``run.impacts``.

    Attributes
    ----------
    time
        By how much the impact comes later, shape (n, k).
    before, after
        Derivatives of the states just before and just after it, at its own time, which moves, shape
        (n, 4, k); rows x1, v1, x2, v2. Of a structure (n, 2N, k); rows q, then v.

    Examples
    --------
    >>> import vibroimpact as vi
    >>> ball = vi.System(mass_ratio=0, frequency_ratio=0, restitution=0.5, gap=1,
    ...                  drive_frequency=0, contact="direct")
    >>> run = vi.simulate(ball, initial=(0, 2, 0, 0), time=1)
    >>> impacts = run.sensitivity("gap", "v1", "restitution").impacts
    >>> impacts.time  # at gap/v1
    array([[ 0.5 , -0.25,  0.  ]])
    >>> impacts.after[0, 1]  # -restitution v1
    array([ 0. , -0.5, -2. ])
    """

    time: NDArray[np.float64]
    before: NDArray[np.float64]
    after: NDArray[np.float64]

    def __reduce__(self) -> tuple[Any, ...]:
        """Copy and pickle as read-only arrays."""
        return _impacts, (self.time, self.before, self.after)


def _impacts(*arrays: NDArray[np.float64]) -> ImpactSensitivity:
    return ImpactSensitivity(*map(read_only, arrays))


@dataclass(frozen=True, kw_only=True)
class OneSided:
    """An event from which on the derivatives of a run are those of one side only.

    On the other side the motion is another one; the derivatives are those of the motion that has
    the events of the run.

    Attributes
    ----------
    index
        Row of ``run.events``; -1 for an event before the kept window.
    time
        Its time.
    reason
        ``"graze"``: beyond, the bodies strike. ``"regime_border"``: an impact on the border of two
        regimes. ``"chatter_onset"``: a chatter that ends with next to no contact force; beyond, it
        is incomplete. ``"contact_border"``: a contact that begins without force, sticks at the
        limit of friction, or ends where what ends it has no rate. ``"start_on_contact"``: the
        motion starts on the contact; beyond, the bodies overlap, or fly. ``"restitution_knot"``: an
        impact at a speed at which the slope of the restitution jumps; derivatives are those from
        above.

    Examples
    --------
    >>> import vibroimpact as vi
    >>> ball = vi.System(mass_ratio=0, frequency_ratio=0, restitution=0.5, gap=0,
    ...                  drive_frequency=0, contact="direct")
    >>> run = vi.simulate(ball, initial=(0, 2, 0, 0), time=1)
    >>> run.sensitivity("v1").one_sided[0].reason
    'start_on_contact'
    """

    index: int
    time: float
    reason: str


def _where(mark: OneSided) -> str:
    return f"{mark.reason} at {mark.time:.6g}"


class _Core(Protocol):
    """What the core gives of a sensitivity."""

    @property
    def times(self) -> NDArray[np.float64]: ...
    @property
    def before(self) -> NDArray[np.float64]: ...
    @property
    def after(self) -> NDArray[np.float64]: ...
    @property
    def stroboscopic(self) -> NDArray[np.float64]: ...
    @property
    def final_state(self) -> NDArray[np.float64]: ...
    @property
    def one_sided(self) -> list[tuple[int, float, str]]: ...
    @property
    def until(self) -> float | None: ...
    def trajectory(self, t: NDArray[np.float64]) -> tuple[NDArray[np.float64], bool]: ...


@interruptible
class Sensitivity(Shown):
    """Derivatives of a run by k names, as ``run.sensitivity`` returns them; read-only arrays.

    States have the rows x1, v1, x2, v2; of a structure q and then v, 2N in place of 4.

    Examples
    --------
    >>> import vibroimpact as vi
    >>> system = vi.System(mass_ratio=0.6, frequency_ratio=2, restitution=0.8, gap=0.5,
    ...                    drive_frequency=1.8, moment_amplitude=1)
    >>> run = vi.simulate(system, initial=(0, 0.5, 0, 0), periods=10)
    >>> found = run.sensitivity("restitution", "v1")
    >>> found
    <Sensitivity of 9 impacts and 10 sections by restitution, v1>
    >>> found.final_state.shape
    (4, 2)
    """

    def __init__(
        self,
        core: _Core,
        run: Any,
        names: tuple[str, ...],
        directions: Mapping[str, Any] = MappingProxyType({}),
    ) -> None:
        self._core = core
        self._run = run
        self._names = (*names, *directions)
        # As they were given.
        self._directions = dict(directions)

    @property
    def names(self) -> tuple[str, ...]:
        """What the run is differentiated by: the last axis of all arrays."""
        return self._names

    @property
    def until(self) -> float:
        """Time up to which the derivatives are known: the run's end, or where Ctrl-C came.

        One that Ctrl-C has ended, ``Interrupted.result``, has the first rows of all tables, and the
        final state of this time.
        """
        known = self._core.until
        end: float = self._run.final_state.time if known is None else known
        return end

    @property
    def run(self) -> Any:
        """The run."""
        return self._run

    @cached_property
    def impacts(self) -> ImpactSensitivity:
        """Derivatives of the kept impacts: ``time``, ``before``, ``after``."""
        core = self._core
        return _impacts(core.times, core.before, core.after)

    @cached_property
    def stroboscopic(self) -> NDArray[np.float64]:
        """Derivatives of the kept sections, each at its fixed phase of the drive, (m, 4, k).

        The times of the sections move with ``drive_frequency``, and with nothing else.
        """
        return read_only(self._core.stroboscopic)

    @cached_property
    def final_state(self) -> NDArray[np.float64]:
        """Derivatives of the final state, at its fixed time, shape (4, k), or (2N, k).

        A run over ``periods`` ends at another time with another ``drive_frequency``, which is left
        out here: ``gradient`` goes with that end, and so does the last section.
        """
        return read_only(self._core.final_state[0])

    @cached_property
    def one_sided(self) -> tuple[OneSided, ...]:
        """The events from which on the derivatives are one-sided; empty, and so false, if none.

        Of those before the kept window the first for each reason, with -1 as its index.
        """
        found = self._core.one_sided
        return tuple(OneSided(index=at, time=time, reason=why) for at, time, why in found)

    def trajectory(self, t: ArrayLike) -> NDArray[np.float64]:
        """Return derivatives of the states at fixed times ``t``.

        At the instant of an event they are those of the state after it.

        Parameters
        ----------
        t
            Times inside the kept window, in any order, shape (j,); or one time. In their order they
            cost least.

        Returns
        -------
        array, shape (j, 4, k), rows x1, v1, x2, v2; (4, k) for one time; of a structure 2N rows

        Raises
        ------
        ParameterError
            If a time lies outside the kept window of the run.
        SimulationError
            If a phase of contact has no derivatives that can be computed.
        Interrupted
            After Ctrl-C; ``.result`` holds the rows of the first times.

        Examples
        --------
        >>> found = run.sensitivity("gap")
        >>> found.trajectory([run.kept_from, run.final_state.time]).shape
        (2, 4, 1)
        """
        times, single = times_of("t", t)
        first, last = self._run.kept_from, self.until
        outside = np.flatnonzero((times < first) | (times > last))
        if len(outside):
            place = int(outside[0])
            window = f"times in the kept window, {first!r} to {last!r}"
            reject("t" if single else f"t[{place}]", float(times[place]), window)
        rows, interrupted = self._core.trajectory(times)
        rows = read_only(rows)
        if interrupted:
            known = f"the rows of the first {len(rows)} times"
            raise Interrupted("interrupted", rows, holds=known)
        return rows[0] if single else rows

    def _facts(self) -> Facts:
        return {
            "by": ", ".join(self._names),
            "impacts": len(self.impacts.time),
            "sections": len(self.stroboscopic),
            "one-sided from": in_a_line(self.one_sided, _where) or "nowhere",
        }

    def __eq__(self, other: object) -> bool:
        """Whether both are of one run by the same names, along the same directions."""
        if not isinstance(other, type(self)):
            return NotImplemented
        same = self._names == other._names and bool(self._run == other._run)
        return same and bool((self.final_state == other.final_state).all())

    def __hash__(self) -> int:
        """Return a hash that equal ones share."""
        return hash((self._names, self._run))

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickle the run and what it is differentiated by, from which all else follows."""
        plain = self._names[: len(self._names) - len(self._directions)]
        return _again, (self._run, plain, self._directions)

    def __repr__(self) -> str:
        """Say what it is of."""
        impacts, sections = len(self.impacts.time), len(self.stroboscopic)
        return (
            f"<Sensitivity of {counted(impacts, 'impact')} and {counted(sections, 'section')} "
            f"by {', '.join(self._names)}>"
        )


def told(
    core: _Core,
    run: Any,
    names: tuple[str, ...],
    directions: Mapping[str, Any] = MappingProxyType({}),
) -> Sensitivity:
    """Return a sensitivity that the core has found.

    Raises
    ------
    Interrupted
        If Ctrl-C has ended it; ``.result`` has the derivatives up to there.
    """
    found = Sensitivity(core, run, names, directions)
    if core.until is not None:
        raise Interrupted("interrupted while the run was differentiated", found)
    return found


def _again(run: Any, names: tuple[str, ...], directions: dict[str, Any]) -> Sensitivity:
    found: Sensitivity = run.sensitivity(*names, **directions)
    return found

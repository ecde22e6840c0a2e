"""Attractors, and how a run is recognised to be on one of them.

A stable periodic motion has a trapping region (`trapping`); one that never repeats has the cloud of
its sections (`clouds`). Motions with a multiplier on the unit circle (free motion without damping,
bodies at rest under friction) are not isolated: all of one label are one *family*.
"""

from dataclasses import dataclass, replace
from enum import StrEnum
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import NDArray

from ...interruption import interruptible
from ...orbits.motion import PeriodicMotion, size_of
from ...showing import Facts, Shown
from ...structure_motion import StructureOrbit
from ...verbs import verb

if TYPE_CHECKING:
    from matplotlib.axes import Axes
from .clouds import INSIDE, Cloud
from .free_motion import never_strike
from .region import Region, wrapped

Array = NDArray[np.float64]
Kind = Literal["periodic", "quasi-periodic", "chaotic", "family"]

# Sections that agree to this part of their size belong to the same periodic orbit.
_SAME = 1e-6


def flat(sections: Array) -> Array:
    """Return states as rows of numbers, shape (k, d)."""
    return sections.reshape(len(sections), -1)


class Family(StrEnum):
    """Why the motions of a family are not separate attractors."""

    AT_REST = "at rest under friction: not isolated"
    NOT_ISOLATED = "a multiplier on the unit circle: not isolated"
    FREE = "free motion that never strikes: every start has its own"


@interruptible
@dataclass(frozen=True, kw_only=True, eq=False)
class Attractor(Shown):
    """An attractor, or a family of motions that are not isolated.

    Attributes
    ----------
    label
        As ``run.label``: ``4-5``, ``1-inf``, ``chaotic`` ...
    kind
        ``periodic``, ``quasi-periodic``, ``chaotic``, or ``family``: motions that are not isolated.
    motion
        The periodic motion, a PeriodicMotion or StructureOrbit, or None.
    sections
        States at the starts of drive periods: the m of a periodic motion, else many, shape (k, 4),
        of structures (k, 2, N). Of a family those of the first motion found.
    start
        The initial state from which it was found first.
    confirmed
        Whether it is shown to attract: a periodic motion by its multipliers and the simulations of
        its trapping region, another by a long run that stays.
    why_not
        If not, why, in words.
    orbit
        m and n of a motion that has a period, n = -1 with complete chatter; else (0, 0).
    family
        For a family: why its motions are not separate attractors.
    region
        Trapping region, of a confirmed periodic motion.
    cloud
        Boxes of its section, of a motion that does not repeat.
    rotor
        Whether x1 counts modulo a turn.
    system
        The system, of a family of free motions.

    Examples
    --------
    >>> import vibroimpact as vi
    >>> system = vi.System(mass_ratio=0.6, frequency_ratio=2, restitution=0.8, gap=0.5,
    ...                    drive_frequency=1.8, moment_amplitude=1)
    >>> import numpy as np
    >>> grid = np.linspace(-1, 1, 8)
    >>> basins = vi.basins(system, x1=[0.0, 0.1, 0.2], v1=grid, scouts=20, periods=300)
    >>> attractor = basins.attractors[0]
    >>> attractor.label, attractor.kind, attractor.confirmed
    ('1-1', 'periodic', True)
    """

    label: str
    kind: Kind
    sections: Array
    start: tuple[Any, ...]
    motion: PeriodicMotion | StructureOrbit | None = None
    confirmed: bool = False
    why_not: str = ""
    orbit: tuple[int, int] = (0, 0)
    family: Family | None = None
    region: Region | None = None
    cloud: Cloud | None = None
    rotor: bool = False
    system: Any = None

    def _facts(self) -> Facts:
        return {
            "motion": self.label,
            "kind": self.kind,
            "confirmed": "yes" if self.confirmed else f"no: {self.why_not}",
            "sections": len(self.sections),
            "start": f"({', '.join(f'{value:.6g}' for value in np.ravel(self.start))})",
        }

    def __repr__(self) -> str:
        """Label and whether it is confirmed."""
        verdict = "confirmed" if self.confirmed else f"not confirmed: {self.why_not}"
        return f"<Attractor {self.label}, {self.kind}, {verdict}>"

    def plot(self, **options: Any) -> "Axes":
        """Draw the sections and the orbit, by ``vi.plot.attractor``.

        Parameters
        ----------
        **options
            As in ``vi.plot.attractor``.

        Returns
        -------
        matplotlib.axes.Axes

        Examples
        --------
        >>> attractor.plot().get_xlabel()
        'position $x_1$ of body 1'
        """
        axes: Axes = verb("draw")(self, **options)
        return axes

    def light(self) -> "Attractor":
        """Return the attractor with only those parts that recognition in other processes needs.

        Examples
        --------
        >>> attractor.light().motion is None
        True
        """
        sections = self.sections if self.kind == "periodic" else self.sections[:0]
        return replace(self, motion=None, sections=sections)

    def to_dict(self) -> dict[str, Any]:
        """Return everything on which recognition depends, as values for JSON.

        Examples
        --------
        >>> attractor.to_dict()["label"]
        '1-1'
        """
        region, cloud = self.region, self.cloud
        return {
            "label": self.label,
            "kind": self.kind,
            "why_not": self.why_not,
            "sections": self.sections.tolist() if self.kind == "periodic" else None,
            "region": None
            if region is None
            else [region.center.tolist(), region.factor.tolist(), region.counts],
            "cloud": None if cloud is None else cloud.digest(),
        }

    def holds(self, tails: "Tails") -> NDArray[np.bool_]:
        """Tell which runs are on the attractor, by the tails of their sections.

        Parameters
        ----------
        tails
            The ends of k runs.

        Returns
        -------
        array of bool, shape (k,)

        Examples
        --------
        >>> from vibroimpact.sweeps.basins.attractors import Tails
        >>> tails = Tails(
        ...     sections=attractor.sections[None], counts=np.array([[1]]),
        ...     orbits=np.array([attractor.orbit]), rested=np.array([False]),
        ... )
        >>> attractor.holds(tails)
        array([ True])
        """
        if self.cloud is not None:
            return _both(tails.aperiodic, self.cloud.holds(tails.sections))
        if self.system is not None:  # the family of free motions
            free = _both(tails.aperiodic, (tails.counts == 0).all(axis=1))
            return _both(free, never_strike(self.system, tails.sections[:, -1]))
        alike = (tails.orbits == self.orbit).all(axis=1)
        if self.kind == "family":
            return _both(alike, tails.rested == (self.family is Family.AT_REST))
        own = flat(self.sections)
        m = len(own)
        last = tails.sections[:, -m:]
        if last.shape[1] < m:
            return np.zeros(len(last), dtype=bool)
        off = [
            np.abs(wrapped(last - np.roll(own, k, axis=0), rotor=self.rotor)).max(axis=(1, 2))
            for k in range(m)
        ]
        return _both(alike, np.min(off, axis=0) < _SAME * size_of(self.sections))


@dataclass(frozen=True, eq=False)
class Tails:
    """The ends of k runs that came to their last period without arriving at an attractor.

    Attributes
    ----------
    sections
        Last states at the starts of drive periods, shape (k, keep, d).
    counts
        Impacts in the drive period before each, -1 with complete chatter, shape (k, keep).
    orbits
        m and n, shape (k, 2); (0, 0) where no period was found, n = -1 with complete chatter.
    rested
        Whether the bodies came to rest in contact, shape (k,).
    """

    sections: Array
    counts: NDArray[np.int64]
    orbits: NDArray[np.int64]
    rested: NDArray[np.bool_]

    @property
    def aperiodic(self) -> NDArray[np.bool_]:
        """Which runs have no period."""
        return np.asarray(self.orbits[:, 0] == 0)

    def __len__(self) -> int:
        """Return the number of runs."""
        return len(self.orbits)

    def __getitem__(self, kept: NDArray[np.bool_]) -> "Tails":
        """Return some of them."""
        return Tails(self.sections[kept], self.counts[kept], self.orbits[kept], self.rested[kept])


def _both(one: NDArray[np.bool_], other: NDArray[np.bool_]) -> NDArray[np.bool_]:
    result: NDArray[np.bool_] = one & other
    return result


def same(new: Attractor, old: Attractor) -> bool:
    """Whether two attractors are the same."""
    if (new.kind, new.label) != (old.kind, old.label):
        return False
    if new.cloud is not None and old.cloud is not None:
        overlaps = (
            old.cloud.inside(flat(new.sections)).mean(),
            new.cloud.inside(flat(old.sections)).mean(),
        )
        return bool(min(overlaps) >= INSIDE)
    if new.kind == "family":
        return new.family is old.family
    m = len(new.sections)
    one = Tails(
        sections=flat(new.sections)[None],
        counts=np.zeros((1, m), dtype=np.int64),
        orbits=np.array([new.orbit]),
        rested=np.zeros(1, dtype=bool),
    )
    return bool(old.holds(one)[0])

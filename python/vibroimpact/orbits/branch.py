"""A branch of periodic motions over one parameter, and its pieces."""

from __future__ import annotations

import math
import os
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from .. import _core
from .._core import Leg, LegKind
from ..arguments import number, one_value, reject
from ..continuation.names import PathEnd
from ..hints import close_to
from ..interruption import interruptible
from ..made import varied
from ..showing import Facts, Shown
from ..system import System
from ..tables import frame
from ..verbs import verb
from .bifurcation import Bifurcation
from .kinds import BifurcationKind, BranchEnd
from .motion import IMPACT_DTYPE, NEUTRAL, PeriodicMotion

if TYPE_CHECKING:
    import pandas
    from matplotlib.axes import Axes

Array = NDArray[np.float64]

# What `Piece.at_impacts` and `Piece.at_sections` know.
AT_IMPACTS = ("x1", "v1", "v2", "phase", "approach_velocity")
AT_SECTIONS = ("x1", "v1", "x2", "v2")


@interruptible
@dataclass(frozen=True, kw_only=True, eq=False)
class Piece:
    """Part of a branch with one sequence of legs.

    Attributes
    ----------
    system
        The system, at any value of the parameter.
    parameter
        Name of the parameter.
    itinerary
        The legs.
    values
        Of the parameter, shape (k,).
    nodes
        Shape (k, legs, 4), as in PeriodicMotion.
    multipliers
        Complex, by falling modulus, shape (k, 4) or (k, 2).
    """

    system: System
    parameter: str
    itinerary: _core.Itinerary
    values: Array
    nodes: Array
    multipliers: NDArray[np.complex128]

    @property
    def stable(self) -> NDArray[np.bool_]:
        """Whether all multipliers lie inside the unit circle, shape (k,)."""
        inside: NDArray[np.bool_] = np.abs(self.multipliers).max(axis=1) < 1.0 - NEUTRAL
        return inside

    @property
    def label(self) -> str:
        """The label of the motion, m-n."""
        legs = self.itinerary.legs
        impacts = sum(leg.kind is LegKind.IMPACT for leg in legs)
        return f"{self.itinerary.periods}-{'inf' if Leg.CHATTER in legs else impacts}"

    def __repr__(self) -> str:
        """Label, range and number of points."""
        low, high = self.values.min(), self.values.max()
        return (
            f"<Piece {self.label}, {self.parameter} {low:.6g} ... {high:.6g}, "
            f"{len(self.values)} points>"
        )

    def motion(self, k: int) -> PeriodicMotion:
        """Return the k-th motion, with its verdict."""
        motion: PeriodicMotion
        motion = verb("motion_of")(self._system_at(k), self.itinerary, self.nodes[k].copy())
        return motion

    def _system_at(self, k: int) -> System:
        return self._system_with(float(self.values[k]))

    def _system_with(self, value: float) -> System:
        system: System = varied(self.system, {self.parameter: value})
        return system

    @cached_property
    def impacts(self) -> Array:
        """x1 at the impacts that do not belong to chatter, shape (k, impacts)."""
        after = [i for i, leg in enumerate(self.itinerary.legs) if leg.kind is LegKind.IMPACT]
        count = len(self.itinerary.legs)
        return self.nodes[:, [(i + 1) % count for i in after], 0]

    @property
    def sections(self) -> Array:
        """x1 at the starts of the m drive periods, shape (k, m)."""
        return self.at_sections("x1")

    @cached_property
    def _states(self) -> Array:
        """The states at the starts of the m drive periods, shape (k, m, 4)."""
        motion_of = verb("motion_of")
        # With ``whole``: at a period doubling an orbit that repeats twice would become a single
        # one.
        motions = (
            motion_of(self._system_at(k), self.itinerary, nodes.copy(), whole=True)
            for k, nodes in enumerate(self.nodes)
        )
        return np.array([motion.sections for motion in motions])

    def at_impacts(self, name: str) -> Array:
        """Return a quantity just before the impacts that do not belong to chatter.

        Parameters
        ----------
        name
            ``"x1"``, ``"v1"``, ``"v2"``, ``"phase"`` in [0, 2 pi), or ``"approach_velocity"``.

        Returns
        -------
        array of shape (k, impacts)

        Raises
        ------
        ParameterError
            For another name.
        """
        if name not in AT_IMPACTS:
            reject("name", name, f"one of {', '.join(AT_IMPACTS)}")
        if name == "x1":
            return self.impacts
        legs = self.itinerary.legs
        hits = [i for i, leg in enumerate(legs) if leg.kind is LegKind.IMPACT]
        systems = [self._system_at(k) for k in range(len(self.values))]
        if name == "phase":
            times = self.nodes[:, [(i + 1) % len(legs) for i in hits], 3]
            turned = [
                each.drive_frequency * row + each.phase
                for each, row in zip(systems, times, strict=True)
            ]
            phases: Array = np.mod(np.array(turned).reshape(times.shape), math.tau)
            return phases
        before = np.array(
            [
                self.itinerary.before_events(each._compiled, nodes.copy())[hits]
                for each, nodes in zip(systems, self.nodes, strict=True)
            ]
        ).reshape(len(self.values), len(hits), 4)
        if name == "approach_velocity":
            rates = [each.gap_rate(rows) for each, rows in zip(systems, before, strict=True)]
            return np.array(rates).reshape(before.shape[:2])
        column: Array = before[:, :, 1 if name == "v1" else 3]
        return column

    def at_sections(self, name: str) -> Array:
        """Return a coordinate at the starts of the m drive periods, shape (k, m).

        Parameters
        ----------
        name
            ``"x1"``, ``"v1"``, ``"x2"`` or ``"v2"``.

        Raises
        ------
        ParameterError
            For another name.
        """
        if name not in AT_SECTIONS:
            reject("name", name, f"one of {', '.join(AT_SECTIONS)}")
        column: Array = self._states[:, :, AT_SECTIONS.index(name)]
        return column


@interruptible
@dataclass(frozen=True, kw_only=True, eq=False)
class Branch(Shown):
    """A branch of periodic motions over one parameter.

    Attributes
    ----------
    parameter
        Its name.
    pieces
        In order along the branch, each with one sequence of legs.
    bifurcations
        In order along the branch.
    ends
        Why the branch ends, at its first and last point: ``bound``, the kind of a border that it
        does not pass, ``points``, ``closed``, ``start``, ``no convergence``, ``outside domain``,
        ``interrupted``, a kind that ``stop_at`` names, ``mirror image`` (at a pitchfork, since the
        images of its motions would follow), or ``refused``: a simulation does not confirm the next
        point.
    why_not
        For each end: why the branch does not go on, and what leads on; ``""`` at a bound of the
        range, at a start, and for a closed branch.

    Examples
    --------
    >>> import vibroimpact as vi
    >>> system = vi.System(mass_ratio=0.6, frequency_ratio=2, restitution=0.8, gap=0.5,
    ...                    drive_frequency=1.8, moment_amplitude=1)
    >>> motion = vi.simulate(system, initial=(0, 0.5, 0, 0), periods=600, keep=100).refine()
    >>> branch = vi.follow_motion(motion, drive_frequency=(1.5, 1.9))
    >>> branch
    <Branch 1-1, drive_frequency 1.5 ... 1.9, 7 bifurcations, ends: bound, bound>
    """

    parameter: str
    pieces: tuple[Piece, ...]
    bifurcations: tuple[Bifurcation, ...]
    ends: tuple[BranchEnd, BranchEnd]
    why_not: tuple[str, str] = ("", "")

    @property
    def values(self) -> Array:
        """The parameter along the branch, shape (k,)."""
        return np.concatenate([np.empty(0), *(piece.values for piece in self.pieces)])

    @property
    def stable(self) -> NDArray[np.bool_]:
        """Whether the motion is stable, shape (k,)."""
        return np.concatenate([np.empty(0, bool), *(piece.stable for piece in self.pieces)])

    @property
    def motions(self) -> tuple[PeriodicMotion, ...]:
        """The motion at each point, with its verdict, k of them; judged anew at each access."""
        return tuple(piece.motion(k) for piece in self.pieces for k in range(len(piece.values)))

    def _columns(self) -> dict[str, tuple[str, ...]]:
        # Motions of structures have no table.
        if not self.pieces or not isinstance(self.pieces[0].system, System):
            return {}
        return {"motions[0].impacts": IMPACT_DTYPE.names or ()}

    def __len__(self) -> int:
        """Return the number of points."""
        return sum(len(piece.values) for piece in self.pieces)

    def __bool__(self) -> bool:
        """Return True, whether or not the branch has points."""
        return True

    @cached_property
    def images(self) -> tuple[int | None, ...]:
        """For each bifurcation the place of the earlier one of its mirror image, or None.

        The mirror image of a motion q(t) is -q half a drive period later. Both sides of a pitchfork
        have each bifurcation, one for either image.
        """
        images: tuple[int | None, ...] = verb("earlier_images")(self.bifurcations)
        return images

    def at(self, value: float | None = None, /, **parameter: float) -> tuple[PeriodicMotion, ...]:
        """Return the motions of the branch at one value of its parameter, stable and unstable.

        Each is found to rounding by Newton's method, from the points of the branch beside it.

        Parameters
        ----------
        value
            The value: ``branch.at(1.545)``.
        **parameter
            Or the parameter of the branch with its value: ``drive_frequency=1.545``.

        Returns
        -------
        tuple of PeriodicMotion
            In order along the branch: several where the branch turns back, none where it has a gap.

        Raises
        ------
        ParameterError
            If it is another parameter, or the value lies outside of the branch.
        SimulationError
            If Newton's method fails between two points of the branch; ``.result`` has the others.

        Examples
        --------
        >>> import vibroimpact as vi
        >>> system = vi.System(mass_ratio=0.6, frequency_ratio=2.0, restitution=0.8, gap=0.5,
        ...                    drive_frequency=1.8, moment_amplitude=1.0)
        >>> run = vi.simulate(system, initial=(0, 0.5, 0, 0), periods=600, keep=100)
        >>> motion = run.refine()
        >>> branch = motion.follow(drive_frequency=(1.75, 1.85))
        >>> branch.at(drive_frequency=1.84)
        (<PeriodicMotion 1-1, admissible, unstable, |lambda| = 1.12931>,)
        """
        alone = [] if value is None else [(self.parameter, value)]
        named = [*alone, *parameter.items()]
        _, given = one_value("at", (self.parameter,), named, also=", or the value alone")
        value = number(self.parameter, given)
        values = np.append(self.values, [found.value for found in self.bifurcations])
        if not len(self):
            reject(self.parameter, given, "no value: the branch has no points")
        low, high = float(values.min()), float(values.max())
        if not low <= value <= high:
            reject(self.parameter, given, f"a value of the branch, from {low!r} to {high!r}")
        motions: tuple[PeriodicMotion, ...] = verb("motions_at")(self, value)
        return motions

    def plot(self, **options: Any) -> Axes:
        r"""Draw the branch with its bifurcations, by ``vi.plot.branches``.

        Parameters
        ----------
        **options
            As in ``vi.plot.branches``.

        Returns
        -------
        matplotlib.axes.Axes

        Examples
        --------
        >>> branch.plot().get_xlabel()
        'drive frequency $\\omega$'
        """
        axes: Axes = verb("draw")(self, **options)
        return axes

    def to_pandas(self) -> pandas.DataFrame:
        """Return the points as a data frame, one row each.

        Raises
        ------
        ImportError
            If pandas is not installed.

        Examples
        --------
        >>> branch.to_pandas().columns[:2].tolist()
        ['piece', 'drive_frequency']
        """
        lengths = [len(piece.values) for piece in self.pieces]
        sizes = [np.abs(piece.multipliers).max(axis=1) for piece in self.pieces]
        labels = np.array([piece.label for piece in self.pieces], dtype=object)
        return frame(
            {
                "piece": np.repeat(np.arange(len(lengths)), lengths),
                self.parameter: self.values,
                "label": np.repeat(labels, lengths),
                "stable": self.stable,
                "largest_multiplier": np.concatenate([np.empty(0), *sizes]),
            }
        )

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the branch to ``path`` (.npz, no pickle); ``vibroimpact.load`` reads it.

        Raises
        ------
        ParameterError
            If its parameter is a number of a function that makes the system: no file holds a
            function. ``to_pandas`` gives the points, and each motion can be saved.

        Examples
        --------
        >>> branch.save("branch.npz")
        >>> vi.load("branch.npz")
        <Branch 1-1, drive_frequency 1.5 ... 1.9, 7 bifurcations, ends: bound, bound>
        """
        verb("write_branch")(path, self)

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> Branch:
        """Read a branch from the file that ``save`` wrote; its motions are judged anew.

        Raises
        ------
        ValueError
            If it is damaged, foreign, or holds something else.

        Examples
        --------
        >>> branch.save("branch.npz")
        >>> len(vi.Branch.load("branch.npz")) == len(branch)
        True
        """
        branch: Branch = verb("read_branch")(path)
        return branch

    def _facts(self) -> Facts:
        facts: Facts = {"motions": " ".join(dict.fromkeys(piece.label for piece in self.pieces))}
        if len(self):
            low, high = self.values.min(), self.values.max()
            part = np.count_nonzero(self.stable)
            facts[self.parameter] = f"{low:.6g} to {high:.6g}"
            facts["points"] = f"{len(self)}, of which {part} are stable"
        for place, (found, image) in enumerate(zip(self.bifurcations, self.images, strict=True), 1):
            text = "" if image is None else f", mirror image of bifurcation {image + 1}"
            facts[f"bifurcation {place}"] = f"{found.kind} at {found.value:.12g}{text}"
        facts["ends"] = ", ".join(self._end_texts())
        reasons = zip(("first end", "last end"), self.why_not, strict=True)
        facts |= {place: why for place, why in reasons if why}
        return facts

    def _end_texts(self) -> tuple[str, str]:
        """Say of each end what it is, and where: which of the bounds."""
        values = self.values
        if not len(values):
            return str(self.ends[0]), str(self.ends[1])
        texts = []
        for end, value in zip(self.ends, values[[0, -1]].tolist(), strict=True):
            which = "low " if value == values.min() else "high "
            texts.append(f"{which if end is PathEnd.BOUND else ''}{end} at {value:.12g}")
        return texts[0], texts[1]

    def of_kind(self, kind: str) -> list[Bifurcation]:
        """Return the bifurcations of one kind, such as ``"period_doubling"``.

        Raises
        ------
        ParameterError
            If there is no such kind.

        Examples
        --------
        >>> len(branch.of_kind("period_doubling"))
        4
        """
        known = tuple(BifurcationKind)
        if not isinstance(kind, str) or kind not in known:
            hint = close_to(kind, known) if isinstance(kind, str) else ""
            reject("kind", kind, f"one of {', '.join(known)}{hint}")
        return [found for found in self.bifurcations if found.kind == kind]

    def __repr__(self) -> str:
        """Labels, range and what happens on it."""
        if not self.pieces:
            return f"<Branch without points, ends: {self.ends[0]}, {self.ends[1]}>"
        labels = " ".join(dict.fromkeys(piece.label for piece in self.pieces))
        low, high = self.values.min(), self.values.max()
        return (
            f"<Branch {labels}, {self.parameter} {low:.6g} ... {high:.6g}, "
            f"{len(self.bifurcations)} bifurcations, ends: {self.ends[0]}, {self.ends[1]}>"
        )

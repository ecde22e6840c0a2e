"""All period n-1 motions of a system, and of a grid of systems."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, Self, overload

import numpy as np
from numpy.typing import NDArray

from ..arguments import count, number, reject
from ..errors import ParameterError
from ..fixed_arrays import FixedArrays
from ..interruption import interruptible
from ..orbits.motion import PeriodicMotion, columns_of
from ..showing import Facts, Shown
from ..system import System
from ..tables import frame
from ..verbs import verb

if TYPE_CHECKING:
    import pandas
    from matplotlib.axes import Axes

Array = NDArray[np.float64]


@interruptible
@dataclass(frozen=True, kw_only=True)
class Undecided:
    """An interval of x1 in which double precision cannot decide how many solutions there are.

    Attributes
    ----------
    lo, hi
        The interval.
    reason
        Why, in words.

    Examples
    --------
    >>> import vibroimpact as vi
    >>> system = vi.System(mass_ratio=0.6, frequency_ratio=2, restitution=0.8, gap=0.5,
    ...                    drive_frequency=1.8, moment_amplitude=1)
    >>> vi.periodic_motions(system).undecided
    ()
    """

    lo: float
    hi: float
    reason: str


@interruptible
@dataclass(frozen=True, kw_only=True, eq=False)
class PeriodicMotions(Shown, Sequence[PeriodicMotion]):
    """All period n-1 solutions of a system, a sequence in order of x1.

    Attributes
    ----------
    system, n
        The system, and the drive periods of its motions.
    motions
        The solutions, admissible or not.
    boxes
        Intervals of x1, shape (motions, 2), proved to hold this solution and no other; where x1
        alone is fixed (a wall at rest) two solutions of different phase may share one, and with a
        restitution that depends on the approach velocity two of different velocity.
    undecided
        Intervals that may hold further solutions, such as an exact double root, or none.
    within
        The interval of x1 that was searched.
    bounded
        Whether no solution can lie outside it.
    note
        What is special about the system, such as why it has no isolated solutions; mostly ``""``.

    Examples
    --------
    >>> import vibroimpact as vi
    >>> system = vi.System(mass_ratio=0.6, frequency_ratio=2, restitution=0.8, gap=0.5,
    ...                    drive_frequency=1.8, moment_amplitude=1)
    >>> motions = vi.periodic_motions(system)
    >>> len(motions), motions.bounded
    (12, True)
    """

    system: System
    n: int
    motions: tuple[PeriodicMotion, ...]
    boxes: Array
    undecided: tuple[Undecided, ...]
    within: tuple[float, float]
    bounded: bool
    note: str = ""

    def __len__(self) -> int:
        """Number of solutions."""
        return len(self.motions)

    @overload
    def __getitem__(self, index: int) -> PeriodicMotion: ...
    @overload
    def __getitem__(self, index: slice) -> tuple[PeriodicMotion, ...]: ...
    def __getitem__(self, index: int | slice) -> PeriodicMotion | tuple[PeriodicMotion, ...]:
        """Return one solution, or several."""
        return self.motions[index]

    def __iter__(self) -> Iterator[PeriodicMotion]:
        """Iterate over the solutions."""
        return iter(self.motions)

    def plot(self, **options: Any) -> Axes:
        """Draw the multipliers of all solutions, by ``vi.plot.multipliers``.

        Parameters
        ----------
        **options
            As in ``vi.plot.multipliers``.

        Returns
        -------
        matplotlib.axes.Axes

        Raises
        ------
        ParameterError
            If there are no solutions.

        Examples
        --------
        >>> motions.plot().get_aspect()
        1.0
        """
        axes: Axes = verb("draw")(self, **options)
        return axes

    def to_pandas(self) -> pandas.DataFrame:
        """Return the solutions as a data frame, one row each.

        Raises
        ------
        ImportError
            If pandas is not installed.

        Examples
        --------
        >>> len(motions.to_pandas()) == len(motions)
        True
        """
        return frame(columns_of(self.motions))

    def _facts(self) -> Facts:
        facts: Facts = {"x1 searched": self._place(), "solutions": len(self)}
        for place, motion in enumerate(self.motions, 1):
            facts[f"solution {place}"] = (
                f"{motion.label}, {motion.stability}, x1 = {motion.state[0]:.6g}"
            )
        return (
            facts | {"undecided": len(self.undecided)} | ({"note": self.note} if self.note else {})
        )

    def _place(self) -> str:
        """Say where x1 was searched: where the interval is as narrow as rounding, the number."""
        # A wall at x1 = 0 has an interval of the smallest floats.
        low, high = (f"{0.0 if abs(end) < 1e-300 else end:.6g}" for end in self.within)
        return f"= {low}" if low == high else f"in [{low}, {high}]"

    def __repr__(self) -> str:
        """Count solutions and motions, and say where they were searched."""
        admissible = [motion for motion in self.motions if motion.admissible]
        stable = sum(motion.stable for motion in admissible)
        return (
            f"<PeriodicMotions with x1 {self._place()}: {len(self)} solutions, "
            f"{len(admissible)} admissible, {stable} of these stable; "
            f"{len(self.undecided)} intervals undecided>"
        )


STATE = ("x1", "v1", "v2", "phase", "approach_velocity")


# Columns of MotionMap.solutions.
SOLUTION_DTYPE = np.dtype(
    [
        ("point", "<i8"),
        *((name, "<f8") for name in STATE),
        ("admissible", "?"),
        ("largest_multiplier", "<f8"),
        ("stable", "?"),
    ]
)


@interruptible
@dataclass(frozen=True, kw_only=True, eq=False)
class MotionMap(FixedArrays, Shown):
    """All period n-1 solutions over a grid of one or two parameters.

    Attributes
    ----------
    system
        The system; its own values of the varied parameters have no influence.
    n
        Drive periods per orbit.
    grid
        Values of the varied parameters by name; point i is element i of their product, the last
        parameter running fastest.
    solutions
        One row per solution, by point and x1. Columns ``point``; ``x1, v1, v2, phase,
        approach_velocity`` just before the impact; ``admissible``; ``largest_multiplier``, the
        largest modulus, and ``stable``, admissible with all of them inside the unit circle.
    undecided
        Number of intervals of x1 at each point that double precision does not decide, shape
        (points,).
    empty
        Where the system is known to have no isolated solutions, shape (points,).
    pending
        Points that were not reached, after Ctrl-C, shape (points,); of their motions nothing is
        known.

    Examples
    --------
    >>> import vibroimpact as vi
    >>> system = vi.System(mass_ratio=0.6, frequency_ratio=2, restitution=0.8, gap=0.5,
    ...                    drive_frequency=1.8, moment_amplitude=1)
    >>> solutions = vi.motion_map(system, drive_frequency=[1.6, 1.8, 2.0])
    >>> solutions
    <MotionMap of period 1-1 over 3 drive_frequency: 18 solutions, 3 stable motions>
    """

    system: System
    n: int
    grid: Mapping[str, Array]
    solutions: NDArray[np.void]
    undecided: NDArray[np.int64]
    empty: NDArray[np.bool_]
    pending: NDArray[np.bool_]

    @property
    def shape(self) -> tuple[int, ...]:
        """Number of values of each varied parameter."""
        return tuple(len(values) for values in self.grid.values())

    def parameter(self, name: str) -> Array:
        """Return the value of a varied parameter for each solution.

        Examples
        --------
        >>> len(solutions.parameter("drive_frequency")) == len(solutions.solutions)
        True
        """
        if not isinstance(name, str) or name not in self.grid:
            reject("name", name, f"a varied parameter: {', '.join(self.grid)}")
        axis = list(self.grid).index(name)
        places = np.unravel_index(self.solutions["point"], self.shape)[axis]
        return np.asarray(self.grid[name][places])

    def at(self, **fixed: float) -> Self:
        """Return the part of a map over two parameters at one value of one of them.

        Parameters
        ----------
        **fixed
            Name and value; the value must be one of the grid's, to rounding.

        Raises
        ------
        ParameterError
            If there is no such parameter or value, or none would be left to vary.

        Examples
        --------
        >>> plane = vi.motion_map(system, drive_frequency=[1.6, 1.8], restitution=[0.7, 0.8, 0.9])
        >>> plane.at(drive_frequency=1.8).shape
        (3,)
        """
        if len(fixed) != 1 or len(self.grid) != 2 or not set(fixed) <= set(self.grid):
            raise ParameterError(
                f"at({', '.join(fixed)}): allowed is one of two varied parameters, "
                f"here {', '.join(self.grid)}"
            )
        name, value = next(iter(fixed.items()))
        value = number(name, value)
        near = np.flatnonzero(np.isclose(self.grid[name], value, rtol=1e-12, atol=1e-12))
        if not len(near):
            reject(name, value, "a value of the grid")
        axis = list(self.grid).index(name)
        places = np.array(np.unravel_index(self.solutions["point"], self.shape))
        kept = places[axis] == near[0]
        solutions = self.solutions[kept].copy()
        solutions["point"] = places[1 - axis][kept]
        rest = {other: values for other, values in self.grid.items() if other != name}
        point: list[Any] = [slice(None), slice(None)]
        point[axis] = near[0]
        return replace(
            self,
            system=self.system.replace(**{name: float(self.grid[name][near[0]])}),
            grid=rest,
            solutions=solutions,
            undecided=self.undecided.reshape(self.shape)[tuple(point)],
            empty=self.empty.reshape(self.shape)[tuple(point)],
            pending=self.pending.reshape(self.shape)[tuple(point)],
        )

    def motion(self, row: int) -> PeriodicMotion:
        """Return the motion of a row of ``solutions``, with its multipliers and verdict.

        Raises
        ------
        ParameterError
            If there is no such row.

        Examples
        --------
        >>> solutions.motion(0)
        <PeriodicMotion 1-1, admissible, stable, |lambda| = 0.935389>
        """
        size = len(self.solutions)
        row = count("row", row, least=-size, most=size - 1)
        chosen = self.solutions[row]
        system = self.system.replace(
            **{name: float(self.parameter(name)[row]) for name in self.grid}
        )
        state = tuple(float(chosen[name]) for name in STATE[:4])
        motion: PeriodicMotion = verb("motion_at")(system, self.n, state)
        return motion

    def plot(self, **options: Any) -> Axes:
        r"""Draw the solutions over one parameter, or where over two there are stable ones.

        Parameters
        ----------
        **options
            As in ``vi.plot.motion_branches``, over two parameters as in ``vi.plot.stability_map``.

        Returns
        -------
        matplotlib.axes.Axes

        Examples
        --------
        >>> solutions.plot().get_xlabel()
        'drive frequency $\\omega$'
        """
        axes: Axes = verb("draw")(self, **options)
        return axes

    def to_pandas(self) -> pandas.DataFrame:
        """Return the solutions as a data frame, one row each, with the varied parameters.

        Raises
        ------
        ImportError
            If pandas is not installed.

        Examples
        --------
        >>> len(solutions.to_pandas()) == len(solutions.solutions)
        True
        """
        names = [name for name in self.solutions.dtype.names or () if name not in self.grid]
        varied = {name: self.parameter(name) for name in self.grid}
        clash = {f"impact_{name}": self.solutions[name] for name in STATE if name in self.grid}
        return frame(varied | {name: self.solutions[name] for name in names} | clash)

    def _facts(self) -> Facts:
        facts: Facts = {"period": f"{self.n}-1"}
        for name, values in self.grid.items():
            facts[name] = f"{len(values)} values from {values.min():.6g} to {values.max():.6g}"
        return facts | {
            "solutions": len(self.solutions),
            "stable motions": int(np.count_nonzero(self.solutions["stable"])),
            "points pending": int(np.count_nonzero(self.pending)),
        }

    def __repr__(self) -> str:
        """Grid and number of solutions."""
        over = " x ".join(f"{len(values)} {name}" for name, values in self.grid.items())
        kept = int(np.count_nonzero(self.solutions["stable"]))
        left = int(np.count_nonzero(self.pending))
        return (
            f"<MotionMap of period {self.n}-1 over {over}: {len(self.solutions)} solutions, "
            f"{kept} stable motions{f', {left} points pending' if left else ''}>"
        )

"""A curve of bifurcations of a periodic motion in two parameters, and its special points."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from .. import _core
from .._core import Leg
from ..interruption import interruptible
from ..showing import Facts, Shown
from ..system import System
from ..tables import frame
from ..verbs import verb
from .kinds import BifurcationKind, BranchEnd, Test
from .motion import PeriodicMotion

if TYPE_CHECKING:
    import pandas
    from matplotlib.axes import Axes

    from ..verb_types import CurveProblem

Array = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True, eq=False)
class CodimensionTwo:
    """A point of a curve of bifurcations at which another test function vanishes.

    Attributes
    ----------
    kind
        Of the second bifurcation, as in Bifurcation; also ``cusp`` on a curve of saddle-nodes, and
        the strong resonances ``resonance_1_1``, ``resonance_1_2``, ``resonance_1_3``,
        ``resonance_1_4``.
    values
        Of both parameters, shape (2,).
    motion
        The motion there.
    test, test_value
        The second function, and its remaining value.
    goes_on
        Where two borders meet: the curve's own bifurcation with the legs beyond the other border,
        to be followed by ``bifurcation_curve``; None where it is not known.
    """

    kind: BifurcationKind
    values: Array
    motion: PeriodicMotion
    test: Test
    test_value: float
    goes_on: CodimensionTwo | None = None

    def __repr__(self) -> str:
        """Kind, place and motion."""
        a, b = self.values
        return f"<{self.kind} of {self.motion.label} at ({a:.12g}, {b:.12g})>"


@interruptible
@dataclass(frozen=True, kw_only=True, eq=False)
class BifurcationCurve(Shown):
    """A curve of bifurcations of one kind in the plane of two parameters.

    Attributes
    ----------
    kind
        Of the bifurcation.
    parameters
        Names of both parameters.
    values
        Shape (k, 2), in order along the curve.
    nodes
        Of the motion, shape (k, legs, 4); at a grazing without the touching impact.
    itinerary
        Its legs.
    multipliers
        By falling modulus, shape (k, 4) or (k, 2); NaN where an impact has u = 0.
    bounds_stability
        Whether the motion is stable on one side of the curve, shape (k,): all multipliers but the
        critical ones lie inside the unit circle, and all borders but the curve's own are positive.
    points
        Points of codimension two, in order along the curve.
    ends
        Why the curve ends, at its first and last point: ``bound``, the kind of a border,
        ``resonance_1_1`` or ``resonance_1_2`` (a Neimark-Sacker curve beyond which the pair is
        real), ``points``, ``closed``, ``start`` (it began at a point of codimension two, beyond
        which it is no bifurcation of a motion), ``no convergence``, ``outside domain`` or
        ``interrupted``.
    system
        The system, at any values of the parameters.
    test
        The function that vanishes along the curve.

    Examples
    --------
    >>> import vibroimpact as vi
    >>> system = vi.System(mass_ratio=0.6, frequency_ratio=2, restitution=0.8, gap=0.5,
    ...                    drive_frequency=1.8, moment_amplitude=1)
    >>> motion = vi.simulate(system, initial=(0, 0.5, 0, 0), periods=600, keep=100).refine()
    >>> found = motion.follow(drive_frequency=(1.5, 1.9)).bifurcations[0]
    >>> curve = vi.bifurcation_curve(found, drive_frequency=(1.4, 1.7), restitution=(0.75, 0.85))
    >>> curve.values.shape[1]
    2
    """

    kind: BifurcationKind
    parameters: tuple[str, str]
    values: Array
    nodes: Array
    itinerary: _core.Itinerary
    multipliers: NDArray[np.complex128]
    bounds_stability: NDArray[np.bool_]
    points: tuple[CodimensionTwo, ...]
    ends: tuple[BranchEnd, BranchEnd]
    system: System
    test: Test

    @property
    def problem(self) -> CurveProblem:
        """The equations of the curve."""
        problem: CurveProblem = verb("curve_problem")(
            self.system, self.itinerary, self.parameters, self.kind, self.test
        )
        return problem

    @property
    def legs(self) -> tuple[Leg, ...]:
        """The legs of the motion."""
        return tuple(self.itinerary.legs)

    def plot(self, **options: Any) -> Axes:
        r"""Draw the curve, by ``vi.plot.bifurcation_curves``.

        Parameters
        ----------
        **options
            As in ``vi.plot.bifurcation_curves``.

        Returns
        -------
        matplotlib.axes.Axes

        Examples
        --------
        >>> curve.plot().get_xlabel()
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
        >>> curve.to_pandas().columns[:2].tolist()
        ['drive_frequency', 'restitution']
        """
        columns = dict(zip(self.parameters, self.values.T, strict=True))
        return frame({**columns, "bounds_stability": self.bounds_stability})

    def _facts(self) -> Facts:
        facts: Facts = {"kind": str(self.kind), "points": len(self.values)}
        if len(self.values):
            ends = zip(self.values.min(axis=0), self.values.max(axis=0), strict=True)
            for name, (low, high) in zip(self.parameters, ends, strict=True):
                facts[name] = f"{low:.6g} to {high:.6g}"
        for place, point in enumerate(self.points, 1):
            a, b = point.values
            facts[f"codimension two {place}"] = f"{point.kind} at ({a:.10g}, {b:.10g})"
        return facts | {"ends": f"{self.ends[0]}, {self.ends[1]}"}

    def __repr__(self) -> str:
        """Kind, extent and ends."""
        if not len(self.values):
            return f"<BifurcationCurve {self.kind}, no points, ends: {self.ends[0]}>"
        (a, b), (low, high) = self.parameters, (self.values.min(axis=0), self.values.max(axis=0))
        return (
            f"<BifurcationCurve {self.kind}, {a} {low[0]:.6g} ... {high[0]:.6g}, "
            f"{b} {low[1]:.6g} ... {high[1]:.6g}, ends: {self.ends[0]}, {self.ends[1]}>"
        )

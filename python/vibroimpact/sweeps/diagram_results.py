"""A bifurcation diagram as a result: points of branches, and the rows of their sections.

It is ragged: point i owns the rows offset[i] : offset[i + 1] of the impact columns and
stroboscopic_offset[i] : stroboscopic_offset[i + 1] of the stroboscopic states. The sections are
those of Han, Jin & Hu (2004), eq. (48); see the theory page, section 6.
"""

from abc import ABC
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Generic, Literal, TypeVar, get_args

import numpy as np
from numpy.typing import NDArray

from ..arguments import reject
from ..interruption import interruptible
from ..run import Run, read_only
from ..structure_run import StructureRun
from ..tables import Table, frame, of_columns
from ..verbs import verb
from .columns import Columns
from .results import GridResult

if TYPE_CHECKING:
    import pandas
    from matplotlib.axes import Axes

Start = Literal["fresh", "forward", "backward"]
Rows = Literal["impact", "stroboscopic", "point"]
RunT = TypeVar("RunT", bound=Run | StructureRun)


@interruptible
@dataclass(frozen=True, kw_only=True)
class DiagramSettings:
    """The arguments a diagram was computed with; meanings as in ``bifurcation_diagram``.

    ``initial`` and ``start`` are those of each branch.

    Examples
    --------
    >>> import vibroimpact as vi
    >>> system = vi.System(mass_ratio=0.6, frequency_ratio=2, restitution=0.8, gap=0.5,
    ...                    drive_frequency=1.8, moment_amplitude=1)
    >>> diagram = vi.bifurcation_diagram(
    ...     system, drive_frequency=[1.7, 1.8, 1.9], initial=(0, 0.5, 0, 0), periods=200, keep=50,
    ... )
    >>> diagram.settings.start, diagram.settings.periods
    (('fresh',), 200)
    """

    initial: tuple[Any, ...]
    start: tuple[Start, ...]
    periods: int
    keep: int
    labels: bool
    exponents: bool
    max_events: int | None
    chatter_tolerance: float
    section_phase: float


def _tuples(value: Any) -> Any:
    return tuple(map(_tuples, value)) if isinstance(value, list | tuple) else value


@interruptible
class AnyDiagram(GridResult, ABC, Generic[RunT]):
    """What diagrams of all machines have: n points on branches, and the rows of their sections."""

    def __init__(self, columns: Columns) -> None:
        super().__init__(columns)
        self.parameter_name = [*columns.grid.axes][-1]

    @property
    def settings(self) -> DiagramSettings:  # type: ignore[override]
        """The arguments of the computation."""
        settings = super().settings
        initial = _tuples(settings.pop("initial"))
        start = tuple(settings.pop("start"))
        return DiagramSettings(initial=initial, start=start, **settings)

    def run(self, i: int) -> RunT:  # type: ignore[override]
        """Make the run of a point again, to the same bits.

        Parameters
        ----------
        i
            Number of the point; negative ones count from the end.

        Returns
        -------
        Run; of structures StructureRun
            On a followed branch it starts, as the point did, from the last state of the point
            before, or from the branch's initial state where that did not fit.

        Raises
        ------
        ParameterError
            If there is no such point, or it is followed from one that was not reached.
        StateError, SimulationError
            If the status of the point is ``overlap`` or ``failed``.

        Examples
        --------
        >>> import vibroimpact as vi
        >>> system = vi.System(mass_ratio=0.6, frequency_ratio=2.0, restitution=0.8, gap=0.5,
        ...                    drive_frequency=1.8, moment_amplitude=1.0)
        >>> diagram = vi.bifurcation_diagram(
        ...     system, initial=(0, 0.5, 0, 0), drive_frequency=[1.7, 1.75, 1.8]
        ... )
        >>> diagram.run(2).label == diagram.label[2]
        True
        """
        run: RunT = verb("run_of_point")(self, i)
        return run

    def plot(self, **options: Any) -> "Axes":
        r"""Draw the diagram, by ``vi.plot.bifurcation``.

        Parameters
        ----------
        **options
            As in ``vi.plot.bifurcation``.

        Returns
        -------
        matplotlib.axes.Axes

        Examples
        --------
        >>> diagram.plot().get_xlabel()
        'drive frequency $\\omega$'
        """
        return super().plot(**options)

    def to_pandas(self, rows: Rows = "impact") -> "pandas.DataFrame":
        """Return the diagram as a data frame.

        Parameters
        ----------
        rows
            A row for each kept ``"impact"``, for each kept ``"stroboscopic"`` state, or for each
            ``"point"``. Rows of sections have the number of their ``point``, with which they can be
            joined to the points.

        Raises
        ------
        ParameterError
            If ``rows`` is something else.
        ImportError
            If pandas is not installed.

        Examples
        --------
        >>> import vibroimpact as vi
        >>> system = vi.System(mass_ratio=0.6, frequency_ratio=2.0, restitution=0.8, gap=0.5,
        ...                    drive_frequency=1.8, moment_amplitude=1.0)
        >>> diagram = vi.bifurcation_diagram(
        ...     system, initial=(0, 0.5, 0, 0), drive_frequency=[1.7, 1.75, 1.8]
        ... )
        >>> diagram.to_pandas("point")["drive_frequency"].tolist()
        [1.7, 1.75, 1.8]
        """
        if not isinstance(rows, str) or rows not in get_args(Rows):
            reject("rows", rows, "'impact', 'stroboscopic' or 'point'")
        name = self.parameter_name
        if rows == "point":
            points = super().to_pandas()
            points.insert(0, "point", np.arange(len(self)))
            return points
        if rows == "impact":
            of_point = np.repeat(np.arange(len(self)), np.diff(self.offset))
            columns = self._impact_columns()
            if name in columns:
                columns[f"impact_{name}"] = columns.pop(name)
        else:
            of_point = np.repeat(np.arange(len(self)), np.diff(self.stroboscopic_offset))
            states = self.stroboscopic.reshape(len(of_point), -1).T
            columns = dict(zip(self._machine.coordinates, states, strict=True))
        before = {"point": of_point, "branch": self.branch[of_point]}
        return frame({**before, name: self.parameter[of_point], **columns})

    def _impact_columns(self) -> dict[str, Any]:
        columns: dict[str, Any] = {}
        impacts = np.asarray(self.impacts)
        for name in impacts.dtype.names or ():
            column = impacts[name]
            if column.ndim == 1:
                columns[name] = column
            else:
                columns |= {f"{name}_{place}": row for place, row in enumerate(column.T)}
        return columns

    def _flat(self, name: str) -> NDArray[Any]:
        array = self.columns[name]
        inner = array.shape[len(self.columns.grid.axes) :]
        return array.reshape(-1, *inner)

    def __repr__(self) -> str:
        """Return what was varied, and the numbers of points and rows, in words."""
        return f"{super().__repr__()[:-1]}, {self.offset[-1]} impacts>"

    @property
    def values(self) -> NDArray[np.float64]:
        """The values of the parameter, shape (values,)."""
        return self.columns.grid.axes[self.parameter_name]

    @property
    def branch(self) -> NDArray[np.int64]:
        """Number of the branch of each point, shape (n,): of ``settings.initial``, ``.start``."""
        numbers = np.arange(len(self) // len(self.values))
        return read_only(np.repeat(numbers, len(self.values)))

    @property
    def parameter(self) -> NDArray[np.float64]:
        """The value of the parameter at each point, shape (n,)."""
        return read_only(np.tile(self.values, len(self) // len(self.values)))

    @property
    def status(self) -> NDArray[np.str_]:
        """How each point ended, shape (n,); see ``GridResult.status``."""
        return super().status.reshape(-1)

    @property
    def label(self) -> NDArray[np.str_]:
        """Label of each point, shape (n,); ``unresolved`` without ``labels`` if not periodic."""
        return super().label.reshape(-1)

    @property
    def m(self) -> NDArray[np.int64]:
        """Drive periods per orbit, shape (n,); 0 where no period was found."""
        return self._flat("m")

    @property
    def n(self) -> NDArray[np.int64]:
        """Impacts per orbit, shape (n,); -1 for complete chatter, as integers have no inf."""
        return self._flat("n")

    @property
    def residual(self) -> NDArray[np.float64]:
        """Largest difference between sections m periods apart, shape (n,)."""
        return self._flat("residual")

    @property
    def contact_fraction(self) -> NDArray[np.float64]:
        """Part of the kept time in sustained contact, shape (n,); NaN where nothing is kept."""
        return self._flat("contact_fraction")

    @property
    def final_states(self) -> NDArray[np.float64]:
        """State at the end of each run, shape (n, 4) or of structures (n, 2, N)."""
        return self._flat("final_state")

    @property
    def largest_exponent(self) -> NDArray[np.float64]:
        """Largest Lyapunov exponent per unit time, shape (n,), as in ``Sweep``.

        Raises
        ------
        AttributeError
            If it was computed without ``exponents=True``.
        """
        return self._exponents("largest_exponent").reshape(-1)

    @property
    def exponent_error(self) -> NDArray[np.float64]:
        """Standard error of the largest exponent, shape (n,)."""
        return self._exponents("exponent_error").reshape(-1)

    @property
    def offset(self) -> NDArray[np.int64]:
        """Point i owns the impact rows offset[i] : offset[i + 1], shape (n + 1,)."""
        return self.columns["impact_offset"]

    @property
    def stroboscopic_offset(self) -> NDArray[np.int64]:
        """Point i owns the rows stroboscopic_offset[i] : ...[i + 1], shape (n + 1,)."""
        return self.columns["stroboscopic_offset"]

    @property
    def stroboscopic(self) -> NDArray[np.float64]:
        """The kept stroboscopic states, shape (rows, 4) or of structures (rows, 2, N)."""
        return self.columns["stroboscopic"]

    @property
    def impacts(self) -> Table:
        """Kept impacts of all points one after another, a table: of a system its columns below.

        Of structures the columns of ``StructureRun.impacts``. Point i owns the rows offset[i] :
        offset[i + 1].
        """
        (impacts, _) = self._machine.row_groups
        columns = {entry.name: self.columns[entry.name] for entry in impacts.fields}
        names = {"impact_phase": "phase"}
        return of_columns({names.get(name, name): rows for name, rows in columns.items()})

    @property
    def impact_parameter(self) -> NDArray[np.float64]:
        """The parameter value of each impact row, shape (rows,): the abscissa of a scatter."""
        return read_only(np.repeat(self.parameter, np.diff(self.offset)))

    @property
    def stroboscopic_parameter(self) -> NDArray[np.float64]:
        """The parameter value of each stroboscopic row, shape (rows,)."""
        return read_only(np.repeat(self.parameter, np.diff(self.stroboscopic_offset)))


@interruptible
class Diagram(AnyDiagram[Run]):
    """A bifurcation diagram of n points; all arrays are read-only.

    A point is one value of the parameter on one branch; the points of a branch follow each other. A
    branch is a start: an initial state, fresh or followed.

    Examples
    --------
    >>> import vibroimpact as vi
    >>> system = vi.System(mass_ratio=0.6, frequency_ratio=2, restitution=0.8, gap=0.5,
    ...                    drive_frequency=1.8, moment_amplitude=1)
    >>> diagram = vi.bifurcation_diagram(
    ...     system, drive_frequency=[1.7, 1.8, 1.9], initial=(0, 0.5, 0, 0), periods=200, keep=50,
    ... )
    >>> diagram.values, diagram.complete
    (array([1.7, 1.8, 1.9]), True)
    """

    kind = "diagram"

    @property
    def x1(self) -> NDArray[np.float64]:
        """x1 at each kept impact, shape (rows,)."""
        return self.columns["x1"]

    @property
    def v1(self) -> NDArray[np.float64]:
        """x1' just before each kept impact, shape (rows,)."""
        return self.columns["v1"]

    @property
    def v2(self) -> NDArray[np.float64]:
        """x2' just before each kept impact, shape (rows,)."""
        return self.columns["v2"]

    @property
    def phase(self) -> NDArray[np.float64]:
        """Phase of the drive at each kept impact, in [0, 2 pi), shape (rows,)."""
        return self.columns["impact_phase"]

    @property
    def approach_velocity(self) -> NDArray[np.float64]:
        """Approach velocity u just before each kept impact, shape (rows,)."""
        return self.columns["approach_velocity"]

    @property
    def energy_loss(self) -> NDArray[np.float64]:
        """Energy taken by each kept impact, shape (rows,)."""
        return self.columns["energy_loss"]

    @property
    def regime(self) -> NDArray[np.int8]:
        """Regime of each kept impact, shape (rows,)."""
        return self.columns["regime"]

"""What can be simulated: a `System` or a `Structure`, as the calls that simulate see it."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from . import _core
from .arguments import array_of, in_short, refuse_kind
from .by_value import ByValue
from .errors import StateError
from .interruption import interruptible
from .scales import Scales
from .showing import Shown
from .verbs import verb

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Array = NDArray[np.float64]


# Of more coordinates a message names the first of each kind.
_MOST_LISTED = 4


def first_of_each(coordinates: Sequence[str]) -> list[str]:
    """Return names of coordinates for a message: there may be hundreds."""
    if len(coordinates) <= _MOST_LISTED:
        return [*coordinates]
    half = len(coordinates) // 2
    return [f"{coordinates[0]} ...", f"{coordinates[half]} ..."]


@interruptible
class Machine(ByValue, Shown):
    """A machine of any kind: its drive, its compiled form, and how its states cross to it."""

    # Axes of the array of one start; one more for several.
    _AXES: ClassVar[int]

    drive_frequency: float
    phase: float

    @property
    @abstractmethod
    def _numbers_by_name(self) -> tuple[str, ...]:
        """The names of the numbers that vary by name."""

    @property
    def _starts_shape(self) -> tuple[int, ...]:
        """The shape of the array of one start."""
        size = len(self._coordinates_by_name)
        return (size,) if self._AXES == 1 else (2, size // 2)

    @property
    @abstractmethod
    def _coordinates_by_name(self) -> tuple[str, ...]:
        """The names of the coordinates of a start, in the order of its flat array."""

    @property
    @abstractmethod
    def _fastest(self) -> float:
        """The largest angular frequency of its free motion and its drive."""

    @property
    @abstractmethod
    def _usual_period(self) -> float:
        """The drive period, or that of a free motion where there is no shorter or no other one."""

    @property
    @abstractmethod
    def _stop_count(self) -> int:
        """The number of stops that have numbers of their own; 0 where there is one contact."""

    @abstractmethod
    def _least_size(self, name: str, start: Array) -> float:
        """Return what counts as a large change of a number or coordinate that is 0 or small."""

    @abstractmethod
    def _turned(self, angle: float) -> Machine:
        """Return it with the phases that its drive, and all that moves with it, has later."""

    @property
    @abstractmethod
    def _turning(self) -> dict[str, Any]:
        """What a run is differentiated by to turn these phases: fields and their derivatives."""

    @abstractmethod
    def _accelerations(self, states: Array, phases: Array) -> Array:
        """Return accelerations (n, N) without contact; states (n, 2 N) are flat, as starts are.

        Raises
        ------
        StateError
            If they do not follow from the coordinates.
        """

    @property
    def _numbers_in_words(self) -> str:
        """The same for a message."""
        return ", ".join(self._numbers_by_name)

    @property
    def _names(self) -> tuple[str, ...]:
        """The names of what a run is differentiated by: numbers, and coordinates of its start."""
        return (*self._numbers_by_name, *self._coordinates_by_name)

    @property
    def _names_in_words(self) -> str:
        """The same for a message."""
        return ", ".join((self._numbers_in_words, *first_of_each(self._coordinates_by_name)))

    @property
    def _by_function(self) -> str:
        """What makes a machine vary by a number that has no name, for a message."""
        return f"a function of it that makes the {self._WHAT}"

    @property
    def _made_as(self) -> str:
        """An example of a function that makes the machine, for a message; none need be."""
        return ""

    @property
    @abstractmethod
    def _compiled(self) -> _core.System | _core.Structure:
        """The compiled form."""

    @property
    def drive_period(self) -> float:
        """Drive period 2 pi/drive_frequency; infinite for ``drive_frequency = 0``."""
        return self._compiled.drive_period

    def plot(self, **options: Any) -> Axes:
        """Draw a sketch of it at rest, by ``vi.plot.machine``.

        The two bodies of a System; masses, springs, stops and drive of a Structure, or its modes.

        Parameters
        ----------
        **options
            As in ``vi.plot.machine``; ``state=`` draws it in another state.

        Returns
        -------
        matplotlib.axes.Axes

        Examples
        --------
        >>> import vibroimpact as vi
        >>> structure = vi.Structure([[1]], [[1]], [vi.Stop([1], 0.3, 0.8)])
        >>> structure.plot(state=[[0.3], [0]]).get_aspect()
        1.0
        """
        axes: Axes = verb("draw")(self, **options)
        return axes

    @abstractmethod
    def _starts(self, initial: Any) -> Array:
        """Return one start, or several, as an array of finite numbers.

        Raises
        ------
        StateError
            For another shape, or numbers that are not finite.
        """

    def _one_start(self, initial: Any) -> Array:
        """Return one start as an array of finite numbers; StateError for anything else."""
        shape = self._starts_shape
        rows = f"({', '.join(self._coordinates_by_name)})" if self._AXES == 1 else "rows q and v"
        wanted = f"one start, {rows} of shape {shape}"
        array = array_of("initial", initial, wanted, error=StateError)
        if array.shape != shape:
            shown = f" of shape {array.shape}" if array.ndim else f" = {in_short(initial)}"
            turned = ", did you mean its transpose?" if array.shape == shape[::-1] else ""
            raise StateError(f"initial{shown} is not allowed; allowed: {wanted}{turned}")
        if array.dtype.kind not in "iuf":
            refuse_kind("initial", initial, error=StateError)
        return self._starts(array)

    @abstractmethod
    def _chosen(self, units: Any) -> Scales | None:
        """Return the scales for ``units="SI"``, None for None.

        Raises
        ------
        ParameterError
            For other units, and without scales.
        """

    def _run(self, core: Any, start: Any) -> Any:
        """Return the run of that compiled one from a start."""
        return self._run_class()(core, self, start)

    @abstractmethod
    def _run_class(self) -> Any:
        """Return the class of its runs."""

    def _where_to_begin(self, starts: Array) -> str:
        """Return what to add to the error about starts of which some lie inside a contact."""
        return ""

    @property
    def _not_in_si(self) -> str:
        """What numbers without ``units=`` mean, where they may be meant in SI; "" elsewhere."""
        return ""

    def _to_core(self, states: Array) -> Array:
        """Return states in the coordinates of the compiled form.

        Raises
        ------
        StateError
            If they cannot be written in them.
        """
        return states

    def _from_core(self, states: Array) -> Array:
        """Return what is in coordinates of the compiled form in those of the machine."""
        return states

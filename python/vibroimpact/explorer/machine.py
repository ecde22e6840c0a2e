"""What a machine gives the explorer: its numbers, its start, what is computed and drawn of it.

The page asks this interface only. It has an implementation for a `System`, `of_system`, and one for
a `Structure`, `of_structure`. A machine is a value: whatever changes, it is replaced. It needs no
Bokeh; which view draws it is said in `views.drawings`.
"""

from __future__ import annotations

import dataclasses
from abc import ABC, abstractmethod
from collections.abc import Collection, Mapping, Sequence
from functools import cached_property
from typing import Any, ClassVar, NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from ..simulation import simulated
from .axis import Axis

Array = NDArray[np.float64]

# What every machine's diagram can draw without a colour: the sections.
STROBOSCOPIC = "stroboscopic"


@dataclasses.dataclass(frozen=True, eq=False)
class Motion:
    """The motion of a machine, sampled for the views.

    Attributes
    ----------
    machine
        That moves.
    run
        As ``vi.simulate`` gives it.
    time
        Times of the samples, shape (k,).
    states
        At these times, as ``run.trajectory`` gives them.
    forces
        Of the contacts at these times, where the machine's drawing needs them.
    shown
        The coordinate that is looked at.
    """

    machine: Machine
    run: Any
    time: Array
    states: Array
    forces: Array | None
    shown: str

    @cached_property
    def samples(self) -> dict[str, Array]:
        """The columns of curves and phases, with the times ``at`` in drive periods."""
        return {"at": self.time / self.unit_of_time} | self.machine.samples(self)

    @property
    def unit_of_time(self) -> float:
        """The time that counts as one: the drive period, if there is a drive."""
        return self.machine.drive_period if self.machine.driven else 1.0


class Curve(NamedTuple):
    """A line of the time history: its column among the samples, and its name."""

    column: str
    words: str


class Phase(NamedTuple):
    """A line of the phase portrait: two columns of the samples, and its name."""

    place: str
    speed: str
    words: str


class Machine(ABC):
    """A system or a structure, and what the page may change in it."""

    # How code calls it.
    noun: ClassVar[str]
    # Which maps there are of it, and whether the branch of a motion can be followed.
    maps: ClassVar[tuple[str, ...]]
    branches: ClassVar[bool]
    # What a rate is measured in.
    rate: ClassVar[str]

    # What the public functions take.
    system: Any

    @property
    @abstractmethod
    def groups(self) -> Mapping[str, tuple[str, ...]]:
        """Names of numbers and choices that have a control, by heading."""

    @property
    @abstractmethod
    def choices(self) -> Mapping[str, tuple[str, ...]]:
        """Names allowed for each choice."""

    @property
    @abstractmethod
    def parameters(self) -> tuple[str, ...]:
        """Numbers that a map can vary."""

    @property
    @abstractmethod
    def coordinates(self) -> tuple[str, ...]:
        """Names of the numbers of a start, in the order of a state's ``initial``."""

    @property
    @abstractmethod
    def starts(self) -> tuple[str, ...]:
        """Those of them that have a control."""

    @property
    @abstractmethod
    def shown(self) -> tuple[str, ...]:
        """Coordinates to look at."""

    @property
    @abstractmethod
    def values(self) -> Mapping[str, str]:
        """What the diagram can draw, in words."""

    @property
    @abstractmethod
    def heights(self) -> tuple[str, ...]:
        """Columns of the history's impacts, one for each curve that has them."""

    @property
    def driven(self) -> bool:
        """Whether there are drive periods."""
        return bool(self.system.drive_frequency > 0.0)

    @property
    def by_stop(self) -> bool:
        """Whether the kind of an impact, and its colour, is its stop; else its regime."""
        return False

    @property
    def drive_period(self) -> float:
        """The drive period."""
        return float(self.system.drive_period)

    # Numbers and starts.

    @abstractmethod
    def numbers(self) -> dict[str, float | str]:
        """Return all numbers and choices by name; NaN for one of several that differ."""

    @abstractmethod
    def fields(self) -> dict[str, float | str]:
        """Return those that tell it from others with the same matrices, for an address."""

    def without(self, names: Collection[str]) -> dict[str, float | str]:
        """Return the fields that stay when a map varies these numbers."""
        return {name: value for name, value in self.fields().items() if name not in names}

    @abstractmethod
    def replace(self, **changes: Any) -> Self:
        """Return a machine with some numbers and choices changed.

        Raises
        ------
        ParameterError
            Names what is refused, and what is allowed.
        """

    @abstractmethod
    def flat(self, initial: Any) -> tuple[float, ...]:
        """Return a start as numbers in the order of ``coordinates``.

        Raises
        ------
        StateError
            If it has another shape, or is not finite.
        """

    @abstractmethod
    def begin(self, initial: Sequence[float]) -> Any:
        """Return a start in the shape that the public functions take, of Python's numbers."""

    @property
    @abstractmethod
    def first(self) -> dict[str, str]:
        """What a page of the machine shows first: ``value`` and ``shown``."""

    def refuse_start(self, initial: Sequence[float]) -> None:
        """Raise StateError for a start that does not fit; there is no shorter run."""
        simulated(self.system, initial=self.begin(initial), time=1e-9, max_events=1)

    @abstractmethod
    def span(self, name: str) -> tuple[float, float]:
        """Return what the slider of a number reaches."""

    def usual(self, name: str) -> Axis:
        """Return the range of a map over a number that nobody has given one."""
        low, high = self.span(name)
        # Runs are counted in drive periods, which a frequency of 0 has not.
        low = 0.2 if name == "drive_frequency" and low <= 0.0 < 0.2 < high else low
        return Axis(name=name, low=low, high=high)

    @abstractmethod
    def axes(self, *, own: bool) -> dict[str, Axis]:
        """Return the first axes of the maps; with ``own`` around the machine's own values."""

    def choice_words(self, name: str, choice: str) -> str:
        """Return the name of a choice as the page's list shows it."""
        return choice

    @abstractmethod
    def symbol(self, name: str) -> str:
        """Return the symbol of a number or coordinate; or nothing."""

    @abstractmethod
    def words(self, name: str) -> str:
        """Return the name of a number in words; of a coordinate nothing."""

    def name_of(self, name: str) -> str:
        """Return symbol and name of a number, of a coordinate the symbol alone."""
        return ", ".join(filter(None, (self.symbol(name), self.words(name))))

    # What is computed.

    @property
    @abstractmethod
    def time(self) -> float:
        """Length of a motion without a drive."""

    @property
    @abstractmethod
    def effort(self) -> int:
        """By how much a map has fewer columns and rows than the smallest machine's."""

    # By how much coarser still a map is while a slider moves.
    haste: ClassVar[int] = 1

    @abstractmethod
    def sampled(self, run: Any, time: Array) -> tuple[Array, Array | None]:
        """Return states at some times, and forces if the drawing needs them."""

    @abstractmethod
    def exponent(self, initial: Sequence[float], **options: Any) -> tuple[float, float]:
        """Return the largest Lyapunov exponent and its standard error; NaN where there is none."""

    @abstractmethod
    def stability(self, periodic: Any) -> str:
        """Return what the multipliers of a periodic motion say."""

    @abstractmethod
    def family(self, *names: str) -> Any:
        """Return what ``vi.bifurcation_diagram`` and ``vi.chart`` vary by these names."""

    def column_start(self, diagram: Any, place: int) -> tuple[float, ...]:
        """Return where the run of a column of a diagram has begun.

        Raises
        ------
        ParameterError, StateError, SimulationError
            If the column has no run.
        """
        return self.flat(diagram.run(place).initial)

    # What is drawn.

    @abstractmethod
    def curves(self, shown: str) -> tuple[Curve, ...]:
        """Return the lines of the time history; always as many."""

    @abstractmethod
    def phases(self, shown: str) -> tuple[Phase, ...]:
        """Return the lines of the phase portrait; always as many."""

    @abstractmethod
    def phase_names(self, shown: str) -> tuple[tuple[str, str], ...]:
        """Return the symbols of place and velocity of each line of the phase portrait."""

    @abstractmethod
    def history_label(self, shown: str) -> str:
        """Return what stands along the upward axis of the time history."""

    @abstractmethod
    def samples(self, motion: Motion) -> dict[str, Array]:
        """Return the columns of curves and phases."""

    @abstractmethod
    def sections(self, run: Any, shown: str) -> Array:
        """Return place and velocity once per drive period, (k, 2)."""

    @abstractmethod
    def hits(self, motion: Motion) -> dict[str, Array]:
        """Return the columns ``heights`` of the kept impacts, NaN where a curve has none."""

    @abstractmethod
    def approach(self, run: Any) -> Array:
        """Return the approach velocity of each kept impact."""

    @abstractmethod
    def kinds(self, impacts: Any) -> NDArray[np.uint8]:
        """Return the kind of each impact, which has a colour of the palette: see ``by_stop``."""

    @abstractmethod
    def kind_words(self, kind: int) -> str:
        """Return the name of a kind of impacts."""

    @abstractmethod
    def points(
        self, diagram: Any, value: str, shown: str
    ) -> tuple[Array, Array, NDArray[np.uint8] | None]:
        """Return parameter, value and kind of each point of a diagram; sections have no kind."""

    @abstractmethod
    def columns(self, diagram: Any) -> dict[str, NDArray[Any]]:
        """Return the impacts of a diagram as columns of a table."""

    @abstractmethod
    def value_label(self, value: str, shown: str) -> str:
        """Return what stands along the upward axis of a diagram."""

    def facts(self, run: Any) -> list[tuple[str, str]]:
        """Return what else is said of a run: name and words."""
        return []

    # The code that makes all this.

    @abstractmethod
    def start_code(self, initial: Sequence[float]) -> str:
        """Return a start as code."""

    @abstractmethod
    def definition(self) -> list[str]:
        """Return lines that make the machine."""

    @abstractmethod
    def exponent_code(self, periods: int, keep: int, max_events: int) -> list[str]:
        """Return lines that print the exponent of a motion and the multipliers."""

    @abstractmethod
    def pictures(self, shown: str, periods: int) -> list[str]:
        """Return lines that draw a motion."""

    @abstractmethod
    def family_code(self, *names: str) -> str:
        """Return what a map varies by these names, as code."""

    @abstractmethod
    def drawn_code(self, value: str, shown: str) -> tuple[str, str]:
        """Return the code of what draws a diagram: the function, and its options with colours."""

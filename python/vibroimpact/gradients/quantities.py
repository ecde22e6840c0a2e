"""A run whose numbers carry their derivatives: what a function gets that is differentiated."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, NoReturn

import numpy as np
from numpy.typing import NDArray

from ..arguments import reject
from ..by_numbers import Basis
from ..errors import ParameterError
from ..made import Made, value_of
from ..quadrature import check_rate, integral_over, need_whole, rates_at
from ..sensitivity import OneSided
from ..stop import OF_DRIVE
from .duals import Dual, constant
from .duals import value_of as plain

Array = NDArray[np.float64]


class Numbers:
    """The machine of a run: its numbers, and its drive period, by name."""

    def __init__(self, machine: Any, basis: Basis, numbers: Mapping[str, int]) -> None:
        """``numbers`` has the places of the numbers of a function that made the machine."""
        self._machine = machine
        self._basis = basis
        self._numbers = numbers

    def __getattr__(self, name: str) -> Any:
        """Return a number, or a matrix of a structure, with its derivatives."""
        if "_numbers" not in vars(self):  # in the making, as of a copy
            raise AttributeError(name)
        machine, chain = self._machine, self._basis.chain
        if name == "drive_period":
            return 2.0 * np.pi / self.drive_frequency
        if name in ("contact", "law"):
            return getattr(machine, name)
        if name in self._numbers:
            slope = np.zeros(chain.shape[1])
            slope[self._numbers[name]] = 1.0
            return Dual(value_of(machine, name), slope)
        if name not in machine._numbers_by_name:
            allowed = f"allowed: {machine._numbers_in_words}, drive_period"
            raise AttributeError(f"{name} has no derivatives; {allowed}")
        return Dual(value_of(machine, name), self._slopes(name) @ chain)

    def _slopes(self, name: str) -> Array:
        """Return the derivatives of a number; one of all stops changes as each of them does."""
        known, stops = self._machine._numbers_by_name, range(self._machine._stop_count)
        places = [] if name in OF_DRIVE else [f"{name}_{place}" for place in stops]
        each = [self._basis.slopes(place) for place in places if place in known]
        if not each:
            return self._basis.slopes(name)
        if any((slopes != each[0]).any() for slopes in each):
            one = f"{name} of all stops has no derivatives where stops differ in them"
            raise AttributeError(f"{one}; allowed: {name}_0 ...")
        return each[0]


class Rows:
    """The impacts of a run, or one of them: columns by name, as those of its table."""

    def __init__(self, table: Any, columns: Mapping[str, Dual]) -> None:
        self._table = table
        self._columns = columns

    def __len__(self) -> int:
        """Return the number of impacts."""
        return len(self._table)

    def __getitem__(self, key: Any) -> Any:
        """Return a column by its name, or some of the impacts; whole numbers are plain."""
        if not isinstance(key, str):
            rows = plain(key)
            return Rows(
                self._table[rows], {name: column[rows] for name, column in self._columns.items()}
            )
        if key in self._columns:
            return self._columns[key]
        if key in self._table.dtype.names:
            column = np.asarray(self._table[key])
            if column.dtype.kind in "iub":
                return column
        if key not in self._table.dtype.names:
            reject("impacts", key, f"a column: {', '.join(self._columns)}", known=[*self._columns])
        known = ", ".join(self._columns)
        raise ParameterError(f"impacts[{key!r}] has no derivatives; allowed: {known}")

    def __getattr__(self, name: str) -> NoReturn:
        """Say how columns are taken."""
        raise AttributeError(f"impacts have no {name}; columns are taken by name: impacts['time']")


class End:
    """The state at the end of a run: ``state``, ``time``, and the coordinates by name.

    Of a structure also ``q`` and ``v``.
    """

    def __init__(self, coordinates: Sequence[str], state: Dual, time: Dual) -> None:
        self.state = state
        self.time = time
        self._coordinates = coordinates

    def __getattr__(self, name: str) -> Any:
        """Return a coordinate."""
        if "_coordinates" not in vars(self):
            raise AttributeError(name)
        if name in self._coordinates:
            return self.state.ravel()[self._coordinates.index(name)]
        if name in ("q", "v") and f"{name}_0" in self._coordinates:
            half = len(self._coordinates) // 2
            return self.state.ravel()[:half] if name == "q" else self.state.ravel()[half:]
        allowed = f"allowed: state, time, {', '.join(self._coordinates)}"
        raise AttributeError(f"{name} has no derivatives; {allowed}")


class Quantities:
    """A run with derivatives by k things.

    Attributes
    ----------
    run
        The plain run.
    system
        The numbers of its machine.
    initial
        Its start.
    """

    def __init__(
        self, run: Any, machine: Any, names: Sequence[str], basis: Basis, in_periods: bool
    ) -> None:
        """``names`` are those of the k things, ``in_periods`` whether its length is so many."""
        self.run = run
        self._basis = basis
        self._in_periods = in_periods
        self._sensitivity = basis.of(run)
        made = machine._numbers if isinstance(machine, Made) else {}
        places = {name: place for place, name in enumerate(names) if name in made}
        self.system = Numbers(machine, basis, places)
        moved = np.zeros((np.size(run.initial), len(names)))
        coordinates = run.system._coordinates_by_name
        for place, name in enumerate(names):
            if name in coordinates and name not in places:
                moved[coordinates.index(name), place] = 1.0
        self.initial = self._dual(run.initial, moved)

    def _dual(self, value: Any, slope: Array) -> Dual:
        array = np.asarray(value, dtype=np.float64)
        return Dual(array, slope.reshape(*array.shape, slope.shape[-1]))

    def __getattr__(self, name: str) -> Any:
        """Refuse what has no derivatives."""
        known = ", ".join(each for each in dir(type(self)) if each[0] != "_")
        raise AttributeError(
            f"{name} has no derivatives; allowed: run, system, initial, {known}; run.run has "
            "the plain run"
        )

    @property
    def _count(self) -> int:
        return int(self._basis.chain.shape[1])

    def _chained(self, value: Any, moved: Array) -> Dual:
        return self._dual(value, moved @ self._basis.chain)

    @property
    def label(self) -> str:
        """The label of the motion."""
        return str(self.run.label)

    @property
    def one_sided(self) -> tuple[OneSided, ...]:
        """The events from which on derivatives are one-sided."""
        found: tuple[OneSided, ...] = self._sensitivity.one_sided
        return found

    @property
    def impacts(self) -> Rows:
        """The kept impacts, each at its own time, which moves."""
        table = self.run.impacts
        rates = self.run._impact_rates(self._sensitivity.impacts, self._basis.slopes)
        return Rows(
            table,
            {name: self._chained(table[name], moved) for name, moved in rates.items()},
        )

    @property
    def stroboscopic(self) -> Dual:
        """The kept sections, each at its fixed phase of the drive."""
        return self._chained(self.run.stroboscopic, self._sensitivity.stroboscopic)

    @property
    def final_state(self) -> End:
        """The state at the end."""
        run, found = self.run, self._sensitivity
        need_whole(self.run, "derivatives of final_state")
        moves = self._in_periods and self._basis.frequency.any()
        if moves and not np.array_equal(np.ravel(run.stroboscopic[-1:]), np.ravel(_state(run))):
            raise ParameterError(
                "with drive_frequency the end of a run over so many periods moves, and it is no "
                "section that is kept; give time, or section_phase = 0 and keep of at least 1"
            )
        state = found.stroboscopic[-1] if moves else found.final_state
        time = self._period_moves(run.final_state.time) if self._in_periods else None
        return End(
            run.system._coordinates_by_name,
            self._chained(_state(run), state),
            constant(run.final_state.time, self._count) if time is None else time,
        )

    def _period_moves(self, time: float) -> Dual:
        """Return a time that is so many periods."""
        rates = self._basis.frequency
        if not rates.any():
            return constant(time, self._count)
        return Dual(time, -time / self.run.system.drive_frequency * rates)

    def trajectory(self, t: Any) -> Dual:
        """Return the states at fixed times ``t``, as ``trajectory`` of a run does."""
        if isinstance(t, Dual):
            raise TypeError("trajectory takes fixed times: plain numbers, without derivatives")
        return self._chained(self.run.trajectory(t), self._sensitivity.trajectory(t))

    def integral(self, rate: Callable[[Any, Any], Any]) -> Dual:
        """Return the integral of ``rate(times, states)`` over the kept window, as that of a run.

        An impact that comes later has a part in the derivative, where the rate jumps. The rate must
        not jump by itself between events, as with ``np.where``: the derivative would lack that
        jump.

        Parameters
        ----------
        rate
            A function of times (j,) and states, as ``trajectory`` returns them; (j,) numbers.
        """
        check_rate(rate)
        run = self.run

        def along(times: Array) -> Array:
            found = self._rates(rate, times, self.trajectory(times))
            return np.column_stack([found.value, found.slope])

        total, *slopes = integral_over(run, along)
        slope = np.array(slopes)
        # What an instant that moves takes from one side and gives to the other.
        if len(run.impacts):
            instants = self.impacts["time"]
            before, after = (
                plain(self._rates(rate, instants.value, constant(states, len(slope))))
                for states in self.run._beside_impacts()
            )
            slope = slope + (before - after) @ instants.slope
        ends = [(run.kept_from, -1.0)]
        ends += [(run.final_state.time, 1.0)] if self._in_periods else []
        for time, sign in ends:
            moves = self._period_moves(time).slope
            if moves.any():
                at = np.array([time])
                value = plain(self._rates(rate, at, self.trajectory(at)))[0]
                slope = slope + sign * value * moves
        return Dual(total, slope)

    def _rates(self, rate: Callable[[Any, Any], Any], times: Array, states: Dual) -> Dual:
        rates = rates_at(rate, times, states)
        return rates if isinstance(rates, Dual) else constant(rates, self._count)


def _state(run: Any) -> Array:
    return np.asarray(run.final_state.state, dtype=np.float64)

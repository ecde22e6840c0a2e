"""Tables of rows: structured arrays that know their columns, and data frames of pandas.

A table is a NumPy array. A column that it does not have is refused by an error that lists those
that it has. `to_pandas` of every result goes through `frame`.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from enum import IntEnum
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ._core import Regime
from .extras import install
from .hints import close_to, closest
from .interruption import interruptible

if TYPE_CHECKING:
    import pandas


class EventKind(IntEnum):
    """The kinds of events of a run, as in the column ``kind`` of ``run.events``.

    Examples
    --------
    >>> import vibroimpact as vi
    >>> system = vi.System(mass_ratio=0.6, frequency_ratio=2, restitution=0.8, gap=0.5,
    ...                    drive_frequency=1.8, moment_amplitude=1)
    >>> run = vi.simulate(system, initial=(0, 0.5, 0, 0), periods=600, keep=100)
    >>> int((run.events["kind"] == vi.EventKind.IMPACT).sum())
    100
    """

    IMPACT = 0
    GRAZE = 1
    CHATTER = 2
    SLIDE_POSITIVE = 3
    SLIDE_NEGATIVE = 4
    STICK = 5
    RELEASE = 6
    STOP = 7
    CLOSED = 8


# The columns whose numbers have names, and those names.
_NAMED: dict[str, type[IntEnum]] = {"kind": EventKind, "regime": Regime}


@interruptible
class Table(np.ndarray[Any, np.dtype[np.void]]):
    """A structured array, one row for each event; a column is an ordinary array.

    It can be read like every structured array: ``run.impacts["time"]``, ``run.impacts[0]``.

    Examples
    --------
    >>> import vibroimpact as vi
    >>> system = vi.System(mass_ratio=0.6, frequency_ratio=2, restitution=0.8, gap=0.5,
    ...                    drive_frequency=1.8, moment_amplitude=1)
    >>> run = vi.simulate(system, initial=(0, 0.5, 0, 0), periods=600, keep=100)
    >>> run.impacts["time"].shape
    (100,)
    >>> int(run.impacts[0]["period"])
    500
    """

    def __getitem__(self, key: Any) -> Any:
        """Return a column, rows, or columns.

        Raises
        ------
        ValueError
            If there is no column of that name; the message lists the columns.
        """
        names = self.dtype.names or ()
        for name in (key,) if isinstance(key, str) else key if isinstance(key, list) else ():
            if isinstance(name, str) and name not in names:
                hint = close_to(name, names)
                raise ValueError(f"no column {name!r}{hint}; the columns: {', '.join(names)}")
        found = super().__getitem__(key)
        # A column is a table no longer.
        plain = isinstance(found, Table) and found.dtype.names is None
        return found.view(np.ndarray) if plain else found

    # Not for type checkers: they know the names.
    if not TYPE_CHECKING:

        def __getattr__(self, name: str) -> Any:
            """Refuse a name that an array does not have: columns are read in brackets."""
            names = self.dtype.names or ()
            said = f"{type(self).__name__!r} object has no attribute {name!r}"
            if name[:1] != "_" and names:
                meant = name if name in names else closest(name, names)
                hint = f", did you mean [{meant!r}]?" if meant else ""
                said += f"{hint}; the columns: {', '.join(names)}"
            raise AttributeError(said)

    def __copy__(self) -> Table:
        """Return a copy, read-only if this one is."""
        return _as_table(np.array(self.view(np.ndarray)), self.flags.writeable)

    def __deepcopy__(self, memo: object) -> Table:
        """Return a copy, read-only if this one is."""
        return self.__copy__()

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickle the rows, and whether they may be written to."""
        return _as_table, (np.array(self.view(np.ndarray)), self.flags.writeable)

    def to_pandas(self) -> pandas.DataFrame:
        """Return the rows as a data frame; ``regime`` and ``kind`` are words in it.

        Raises
        ------
        ImportError
            If pandas is not installed.

        Examples
        --------
        >>> run.events.to_pandas()["kind"].unique().tolist()
        ['impact', 'stop']
        """
        return frame({name: self[name] for name in self.dtype.names or ()})


def _as_table(array: NDArray[Any], writeable: bool) -> Table:
    result = array.view(Table)
    result.flags.writeable = writeable
    return result


def table(array: NDArray[Any]) -> Table:
    """Return a structured array as a table that may not be written to."""
    result = array.view(Table)
    result.flags.writeable = False
    return result


def with_column(array: NDArray[Any], name: str, values: NDArray[Any], *, after: str) -> Table:
    """Return the rows as a table with one more column, after the column of that name."""
    dtypes: list[tuple[str, Any]] = []
    for each in array.dtype.names or ():
        dtypes.append((each, array.dtype[each]))
        if each == after:
            dtypes.append((name, values.dtype))
    result = np.empty(array.shape, np.dtype(dtypes))
    for each in array.dtype.names or ():
        result[each] = array[each]
    result[name] = values
    return table(result)


def of_columns(columns: Mapping[str, NDArray[Any]]) -> Table:
    """Return columns, of one length, as a table; one of shape (k, n) has n numbers in each row."""
    dtype = [(name, column.dtype, column.shape[1:]) for name, column in columns.items()]
    count = len(next(iter(columns.values())))
    result = np.empty(count, np.dtype(dtype))
    for name, column in columns.items():
        result[name] = column
    return table(result)


def frame(columns: Mapping[str, ArrayLike | Sequence[Any]]) -> pandas.DataFrame:
    """Return columns as a data frame of pandas; regimes and kinds of events by their names.

    Raises
    ------
    ImportError
        If pandas is not installed.
    """
    try:
        import pandas  # optional, and slow to import
    except ImportError as error:
        needed = f"a data frame needs pandas: {install('pandas')}"
        raise ImportError(needed, name="pandas") from error
    return pandas.DataFrame({name: _words(name, each) for name, each in narrow(columns)})


def narrow(columns: Mapping[str, Any]) -> Iterator[tuple[str, Any]]:
    """Give the columns; one of several numbers in a row as one for each: q_0, q_1, ..."""
    for name, values in columns.items():
        if np.ndim(values) == 2:
            yield from ((f"{name}_{i}", part) for i, part in enumerate(np.transpose(values)))
        else:
            yield name, values


def _words(name: str, values: Any) -> Any:
    """Return the values of a column, as names where it is known what the numbers stand for."""
    kinds = _NAMED.get(name)
    if kinds is None:
        return values
    words = np.array([kind.name.lower() for kind in kinds], dtype=object)
    return words[np.asarray(values)]

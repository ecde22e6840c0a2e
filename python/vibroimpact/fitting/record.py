"""What was measured: times of impacts, or one coordinate, velocity or acceleration over time.

Errors name the row: that of an array counts from 0, as its index does; that of a file is the line.
"""

from __future__ import annotations

import csv
import os
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..arguments import array_of, as_floats, in_short, naming, positive, reject
from ..arguments import path as checked_path
from ..by_value import Compared
from ..errors import ParameterError
from ..fixed_arrays import FixedArrays
from ..interruption import interruptible
from ..scales import Scales, unit_of
from ..showing import Facts, Shown, counted
from ..stop import numbered

Array = NDArray[np.float64]

IMPACT_TIMES = "impact_times"
"""The kind of a record that has no values but its times."""

# Coordinates of a System, or of a structure.
_KINDS = re.compile(r"impact_times(_[0-9]{1,6})?|[xva][12]|[qva]_[0-9]{1,6}")
# Numbers are at most of this size, and standard errors at least of its inverse.
_MOST = 1e50
# What columns are set off by.
_DELIMITERS = (";", "\t", ",")
# What to do about a file of another encoding.
_NOT_UTF_8 = "this file is not in UTF-8: save it anew as CSV UTF-8"
# Lines of a file beyond which no record is read.
_MOST_LINES = 10_000_000


def is_heard(kind: str) -> bool:
    """Whether a record is of times of impacts, which has no values but these."""
    one = numbered(kind)
    return IMPACT_TIMES in (kind, one.what if one else None)


def stop_of(kind: str) -> int | None:
    """Return the stop whose impacts are heard; None for all."""
    one = numbered(kind)
    return one.place if one and one.what == IMPACT_TIMES else None


@interruptible
@dataclass(frozen=True, eq=False, repr=False, init=False)
class Record(Compared, FixedArrays, Shown):
    """A record of a motion: what was measured, when, and with what standard error.

    Times count from the start of the motion, t = 0, and are in the units of the machine: those of a
    System are dimensionless, t = omega_2 T.

    Parameters
    ----------
    kind
        ``"impact_times"``, the instants of all impacts up to the last one, or
        ``"impact_times_0"``, of those at one stop of a structure; or what is measured at the times:
        ``"x1"``, ``"v1"``, ``"a1"`` (angle, its rate, its second derivative), ``"x2"``, ``"v2"``,
        ``"a2"``; of a structure ``"q_0"``, ``"v_0"``, ``"a_0"``, ``"q_1"`` ...
    times
        Ascending, >= 0, shape (n,), at least one.
    values
        What was measured at these times, shape (n,); None for impact times.
    sigma
        Standard error of the values, or of the times of impacts: one number > 0, or one for each
        row. None if it is not known: it is then taken from the scatter of the residuals, and
        whether the size of the residuals fits cannot be judged.
    resolution
        Of times of impacts: an impact that follows another one, or one that was not heard, by less
        time than this is not heard. Such rows are left out, and such impacts of the machine are not
        looked for in the record: those at the end of a chatter. None if all impacts are heard.
    name
        What messages and drawings call it; the kind if not given.

    Raises
    ------
    ParameterError
        Names the first row that cannot be used, and why.

    Examples
    --------
    >>> import vibroimpact as vi
    >>> heard = vi.Record("impact_times", [0.91, 2.34, 3.58], sigma=0.01)
    >>> heard
    <Record impact_times: 3 rows from time 0.91 to 3.58, sigma 0.01>
    >>> try:
    ...     vi.Record("impact_times", [0.91, 3.58, 2.34])
    ... except vi.ParameterError as error:
    ...     print(error)
    times[2] = 2.34 is not allowed; allowed: more than times[1] = 3.58
    """

    kind: str
    times: Array
    values: Array
    sigma: Array | None
    resolution: float | None
    name: str

    @naming
    def __init__(
        self,
        kind: str,
        times: ArrayLike,
        values: ArrayLike | None = None,
        *,
        sigma: ArrayLike | None = None,
        resolution: float | None = None,
        name: str | None = None,
    ) -> None:
        words = _words(kind, resolution, name)
        self._set(words, times, values, sigma, [])

    def _set(
        self, words: _Words, times: Any, values: Any, sigma: Any, lines: Sequence[str]
    ) -> None:
        """Check and set all; ``lines`` says where the rows stand in a file."""
        kind = words.kind
        rows = _Rows(lines)
        instants = rows.numbers("times", times)
        if not len(instants):
            reject("times", times, "an array of at least one row")
        early = np.flatnonzero(instants < 0.0)
        if len(early):
            rows.refuse("times", instants, early[0], "a time >= 0, since the start of the motion")
        back = np.flatnonzero(np.diff(instants) <= 0.0)
        if len(back):
            row = int(back[0]) + 1
            before = f"more than {rows.place('times', row - 1)} = {instants[row - 1].item()!r}"
            rows.refuse("times", instants, row, before)
        if is_heard(kind):
            if values is not None:
                reject("values", values, "None for impact times")
            measured = instants
        else:
            if values is None:
                reject("values", values, f"an array of {len(instants)} numbers for {kind!r}")
            measured = rows.numbers("values", values, len(instants))
        error = None if sigma is None else rows.errors(sigma, len(instants))
        if words.resolution is not None:
            apart = np.diff(instants, prepend=-np.inf) >= words.resolution
            instants = measured = instants[apart]
            error = None if error is None else error[apart]
        for array in (instants, measured, error):
            if array is not None:
                array.flags.writeable = False
        fields = (kind, instants, measured, error, words.resolution, words.name)
        for field, value in zip(self.__dataclass_fields__, fields, strict=True):
            object.__setattr__(self, field, value)

    @classmethod
    @naming
    def from_csv(
        cls,
        path: str | os.PathLike[str],
        kind: str,
        *,
        time: str = "time",
        value: str | None = None,
        sigma: str | float | None = None,
        delimiter: str = ",",
        skip_empty: bool = False,
        resolution: float | None = None,
        name: str | None = None,
    ) -> Self:
        r"""Read a record from a CSV file with a line of column names.

        Parameters
        ----------
        path
            The file. Lines that begin with # are comments.
        kind
            What was measured, as in `Record`.
        time
            Column of the times.
        value
            Column of the values; that of the name of the kind if not given.
        sigma
            Column of standard errors, one number for all rows, or None.
        delimiter
            What stands between columns, one character.
        skip_empty
            Leave out rows whose time or value is an empty cell; else they are an error.
        resolution
            Shortest time between impacts that are heard, as in `Record`.
        name
            What the record is called, as in `Record`.

        Raises
        ------
        ParameterError
            Names the line of the file that cannot be used, counted from 1, and why.
        OSError
            If the file cannot be read.

        Examples
        --------
        >>> with open("rig.csv", "w") as file:
        ...     _ = file.write("time,x1\n0.0,0.12\n0.1,0.15\n0.2,0.17\n")
        >>> vi.Record.from_csv("rig.csv", "x1", sigma=0.01)
        <Record x1: 3 rows from time 0 to 0.2, sigma 0.01>
        """
        if not isinstance(delimiter, str) or len(delimiter) != 1:
            reject("delimiter", delimiter, "one character")
        if not isinstance(skip_empty, bool):
            reject("skip_empty", skip_empty, "True or False")
        words = _words(kind, resolution, name)
        kind = words.kind
        file = checked_path("path", path)
        columns = {"time": time}
        if not is_heard(kind):
            columns["value"] = kind if value is None else value
        elif value is not None:
            reject("value", value, "None for impact times")
        if isinstance(sigma, str):
            columns["sigma"] = sigma
        for argument, column in columns.items():
            if not isinstance(column, str):
                reject(argument, column, "the name of a column")
        with open(file, newline="", encoding="utf-8-sig", errors="replace") as text:
            read, lines = _columns(text, file, columns, delimiter, skip_empty)
        record = cls.__new__(cls)
        errors = read.get("sigma", sigma)
        record._set(words, read["time"], read.get("value"), errors, lines)
        return record

    def _in_units_of(self, scales: Scales) -> Record:
        """Return a record in SI as a dimensionless one."""
        heard = is_heard(self.kind)
        unit = unit_of("time" if heard else self.kind, scales)
        values = None if heard else self.values / unit
        sigma = None if self.sigma is None else self.sigma / unit
        shortest = None if self.resolution is None else self.resolution / scales.time
        times = self.times / scales.time
        return Record(self.kind, times, values, sigma=sigma, resolution=shortest, name=self.name)

    @property
    def _identity(self) -> tuple[Any, ...]:
        rows = (None if each is None else each.tobytes() for each in (self.values, self.sigma))
        return (self.kind, self.times.tobytes(), *rows, self.resolution, self.name)

    def __len__(self) -> int:
        """Return the number of rows."""
        return len(self.times)

    def __repr__(self) -> str:
        """Say it in one line."""
        named = "" if self.name == self.kind else f" {self.name!r}"
        return (
            f"<Record{named} {self.kind}: {counted(len(self), 'row')} from time "
            f"{self.times[0]:.6g} to {self.times[-1]:.6g}, {self._error_in_words()}>"
        )

    def _error_in_words(self) -> str:
        if self.sigma is None:
            return "sigma unknown"
        low, high = self.sigma.min(), self.sigma.max()
        return f"sigma {low:.3g}" if low == high else f"sigma {low:.3g} to {high:.3g}"

    def _facts(self) -> Facts:
        return {
            "kind": self.kind,
            "rows": len(self),
            "times": f"{self.times[0]:.6g} to {self.times[-1]:.6g}",
            "standard error": self._error_in_words(),
        }


class _Words(NamedTuple):
    """What a record says of itself."""

    kind: str
    resolution: float | None
    name: str


def _words(kind: Any, resolution: Any, name: Any) -> _Words:
    """Return what a record says of itself, checked; which kinds a machine has is asked later."""
    if not isinstance(kind, str) or not _KINDS.fullmatch(kind):
        reject("kind", kind, "'impact_times', or a coordinate, its rate or acceleration, as 'x1'")
    if resolution is not None:
        if not is_heard(kind):
            reject("resolution", resolution, "None but for impact times")
        resolution = positive("resolution", resolution)
    if name is not None and not isinstance(name, str):
        reject("name", name, "a string")
    return _Words(kind, resolution, kind if name is None else name)


class _Rows:
    """Checks of columns, whose errors name the row."""

    def __init__(self, lines: Sequence[str]) -> None:
        self._lines = lines

    def place(self, name: str, row: int) -> str:
        """Return how a message calls an entry."""
        return f"{self._lines[row]}: {name}" if self._lines else f"{name}[{row}]"

    def refuse(self, name: str, array: Array, row: int, allowed: str) -> None:
        """Raise the error about an entry."""
        reject(self.place(name, int(row)), array[row].item(), allowed)

    def numbers(self, name: str, given: Any, length: int | None = None) -> Array:
        """Return a column of finite numbers."""
        wanted = "an array of finite numbers of one dimension"
        array = array_of(name, given, wanted)
        if array.ndim != 1 or (array.dtype.kind not in "iuf" and array.size):
            raise ParameterError(
                f"{name} = {in_short(given)} is not allowed; allowed: {wanted}"
                if array.ndim == 0
                else f"{name} of shape {array.shape} and type {array.dtype} is not allowed; "
                f"allowed: {wanted}"
            )
        if length not in (None, len(array)):
            raise ParameterError(
                f"{name} of shape {array.shape} is not allowed; allowed: {length} rows, as times "
                "has"
            )
        result = as_floats(array).copy()
        bad = np.flatnonzero(~(np.abs(result) <= _MOST))
        if len(bad):
            wanted = f"a finite number up to {_MOST:g} in size; leave out rows without one"
            self.refuse(name, result, bad[0], wanted)
        return result

    def errors(self, given: Any, length: int) -> Array:
        """Return a column of standard errors; one number stands for all rows."""
        array = array_of("sigma", given, "a number > 0, or one for each row")
        one = array.ndim == 0
        column = np.repeat(array, length) if one else array
        wanted = f"a number from {1.0 / _MOST:g} to {_MOST:g}"
        if one and (array.dtype.kind not in "iuf" or not 1.0 / _MOST <= float(array) <= _MOST):
            reject("sigma", given, wanted)
        result = self.numbers("sigma", column, length)
        bad = np.flatnonzero(result < 1.0 / _MOST)
        if len(bad):
            self.refuse("sigma", result, bad[0], wanted)
        return result


def _columns(
    text: Any, file: str, columns: dict[str, str], delimiter: str, skip_empty: bool
) -> tuple[dict[str, Array], list[str]]:
    """Return columns of a file by name, and where each row stands."""
    numbered = _lines(text, delimiter, file)
    try:
        _, header = next(numbered)
    except StopIteration:
        raise ParameterError(f"{file}: no line of column names") from None
    names = [cell.strip() for cell in header]
    if "\0" in "".join(names):
        reject("path", file, f"text, in UTF-8; {_NOT_UTF_8}")
    places = {}
    for what, column in columns.items():
        if names.count(column) > 1:
            reject(what, column, f"a column of {file} whose name stands there once")
        if column not in names:
            known = ", ".join(map(repr, names))
            read_as = "".join(names)
            other = next((one for one in _DELIMITERS if one != delimiter and one in read_as), None)
            hint = "" if other is None else f": is delimiter={other!r} meant?"
            # What stands for bytes that are no UTF-8.
            hint += f"; {_NOT_UTF_8}" if "\ufffd" in read_as else ""
            if all(map(_is_number, names)):
                hint += "; a line of column names must come first, which does not begin with #"
            wanted = f"a column of {file}, for the {what}; it has {known}{hint}"
            reject(what, column, wanted, known=names)
        places[what] = names.index(column)
    read: dict[str, list[float]] = {what: [] for what in columns}
    lines = []
    for number, cells in numbered:
        if any(cell.strip() for cell in cells[len(names) :]):
            raise ParameterError(
                f"{file}, line {number}: {len(cells)} cells, but {len(names)} column names; a "
                "number with a decimal comma stands in two cells where columns are set off by "
                f"{delimiter!r}"
            )
        row = {}
        for what, place in places.items():
            cell = cells[place].strip() if place < len(cells) else ""
            if not cell:
                if skip_empty and what != "sigma":
                    break
                raise ParameterError(
                    f"{file}, line {number}: an empty cell in column {columns[what]!r}; allowed: "
                    "a number, or skip_empty=True"
                )
            try:
                # To Python 1_0 is 10.
                row[what] = float(cell.replace("_", "?"))
            except ValueError:
                comma = ", with a point, not a comma, before its decimals" if "," in cell else ""
                raise ParameterError(
                    f"{file}, line {number}: {in_short(cell)} in column {columns[what]!r}; "
                    f"allowed: a number{comma}"
                ) from None
        else:
            for what, entry in row.items():
                read[what].append(entry)
            lines.append(f"{file}, line {number}")
    if not lines:
        raise ParameterError(f"{file}: no rows of numbers")
    return {what: np.array(column) for what, column in read.items()}, lines


def _is_number(cell: str) -> bool:
    try:
        float(cell)
    except ValueError:
        return False
    return True


def _lines(text: Any, delimiter: str, file: str) -> Iterator[tuple[int, list[str]]]:
    """Give the cells of lines that are neither empty nor comments, with their numbers."""
    reader = csv.reader(text, delimiter=delimiter)
    try:
        for cells in reader:
            if reader.line_num > _MOST_LINES:
                raise ParameterError(f"{file}: more than {_MOST_LINES} lines")
            if any(cell.strip() for cell in cells) and not cells[0].lstrip().startswith("#"):
                yield reader.line_num, cells
    except csv.Error as error:
        raise ParameterError(f"{file}, line {reader.line_num}: {error}") from error

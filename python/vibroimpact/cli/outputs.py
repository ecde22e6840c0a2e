"""What commands print and write: summaries, tables, CSV files and figures.

Results go to the standard output; where the CSV goes there, the summary goes to the standard error
stream. After Ctrl-C a command writes what is done by then.
"""

import argparse
import csv
import io
import os
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, TextIO, TypeVar

import numpy as np
from numpy.typing import NDArray

from .._core import Regime
from ..errors import ClusterError, Interrupted, ParameterError
from ..tables import narrow
from ..whole_file import is_special, whole_file

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_Result = TypeVar("_Result")

FORMATS = (".png", ".pdf", ".svg")
# Rows whose numbers are Python objects at the same time.
_BLOCK = 2**14
# Statuses of what is done: where the bodies overlap at the start there is nothing to do.
COMPLETE = ("completed", "restarted", "rest", "overlap")


def add_outputs(
    command: argparse.ArgumentParser, rows: str, *, save: str = ""
) -> argparse._ArgumentGroup:
    """Add the flags of the files that a command writes; return their group."""
    group = command.add_argument_group("output")
    group.add_argument("--csv", metavar="FILE", help=f"write {rows} as CSV; - for standard output")
    if save:
        group.add_argument("--save", type=Path, metavar="FILE.npz", help=save)
    group.add_argument("--plot", type=Path, metavar="FILE", help="draw a figure: .png, .pdf, .svg")
    return group


def check(options: argparse.Namespace) -> None:
    """Refuse output files that cannot be written, before anything is computed for them."""
    taken: dict[Path, str] = {}
    for name in ("csv", "points", "save", "plot", "store"):
        path = getattr(options, name, None)
        if path is None:
            continue
        place = Path(path) if path == "-" else Path(path).resolve()
        if place in taken and (path == "-" or not is_special(path)):
            raise ParameterError(f"--{name} {path}: --{taken[place]} goes there, too")
        taken[place] = name
        if path == "-":
            continue
        folder = Path(path).parent
        if not folder.is_dir():
            raise ParameterError(f"--{name} {path}: there is no folder {folder}")
        if not is_special(path) and not os.access(folder, os.W_OK):
            raise ParameterError(f"--{name} {path}: the folder {folder} cannot be written to")
        if name != "store" and Path(path).is_dir():
            raise ParameterError(f"--{name} {path}: is a folder; allowed: a file")
    plot = getattr(options, "plot", None)
    if plot is not None and plot.suffix.lower() not in FORMATS:
        raise ParameterError(f"--plot {plot}: allowed endings are {', '.join(FORMATS)}")


class Writing:
    """Writes the files of a command; if one fails, the others are written all the same."""

    def __init__(self) -> None:
        self._errors: list[OSError] = []

    def __call__(self, write: Callable[..., None], *arguments: Any) -> None:
        """Call ``write``; an error waits until the other files are written."""
        try:
            write(*arguments)
        except BrokenPipeError:
            raise  # nobody would read the rest
        except OSError as error:
            self._errors.append(error)

    def end(self) -> None:
        """Raise what went wrong.

        Raises
        ------
        OSError
            If files could not be written; names each of them.
        """
        if self._errors:
            raise OSError("; ".join(map(str, self._errors))) from self._errors[0]


def partial_on_interrupt(
    compute: Callable[[], _Result],
) -> tuple[_Result, Interrupted | ClusterError | None]:
    """Return the result and, if it was cut short, the exception to raise once it is written."""
    try:
        return compute(), None
    except (Interrupted, ClusterError) as error:
        if error.result is None:
            raise
        return error.result, error


def write_csv(path: str, names: Sequence[str], rows: Iterable[Sequence[Any]]) -> None:
    """Write a table; numbers come back from it bit for bit."""
    with _opened(path) as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(names)
        writer.writerows(rows)


def write_columns(path: str, columns: Mapping[str, NDArray[Any]]) -> None:
    """Write columns of one length, given by name; q of several coordinates as q_0, q_1, ..."""
    flat = dict(narrow(columns))
    write_csv(path, [*flat], _rows([*flat.values()]))


def _rows(columns: Sequence[NDArray[Any]]) -> Iterator[tuple[Any, ...]]:
    for first in range(0, len(columns[0]), _BLOCK):
        parts = (column[first : first + _BLOCK].tolist() for column in columns)
        yield from zip(*parts, strict=True)


@contextmanager
def _opened(path: str) -> Iterator[TextIO]:
    if path == "-":
        yield sys.stdout
    else:
        with whole_file(path) as file, io.TextIOWrapper(file, "utf-8", newline="") as text:
            yield text


@contextmanager
def figure(path: Path, width: float, height: float) -> Iterator["Figure"]:
    """Give an empty figure of a size in inches, and write it when it is drawn."""
    from matplotlib.figure import Figure

    from .. import plot

    with plot.publication_style():
        drawn = Figure(figsize=(width, height), layout="constrained")
        yield drawn
        with whole_file(path) as file:
            drawn.savefig(file, format=path.suffix[1:].lower())


def summary_stream(options: argparse.Namespace) -> TextIO:
    """Return the stream of the summary: standard error if the CSV goes to standard output."""
    return sys.stderr if options.csv == "-" else sys.stdout


def print_summary(lines: Sequence[tuple[str, str]], options: argparse.Namespace) -> None:
    """Print one line for each name and text."""
    print_table(lines, summary_stream(options))


def print_table(rows: Sequence[Sequence[str]], stream: TextIO) -> None:
    """Print rows of text in columns, the last one as it is."""
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    for row in rows:
        cells = (text.ljust(width) for text, width in zip(row, widths, strict=True))
        print("  ".join(cells).rstrip(), file=stream)


def regime_names(regimes: NDArray[np.integer]) -> NDArray[np.str_]:
    """Return impact regimes by name, as in a CSV file."""
    names = np.array([regime.name.lower() for regime in Regime])
    return np.asarray(names[regimes])

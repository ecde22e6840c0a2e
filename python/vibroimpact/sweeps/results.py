"""The result of every computation over a grid: columns by name, labels, files, data sets."""

import os
from typing import TYPE_CHECKING, Any, Self

import numpy as np
from numpy.typing import NDArray

from .. import _core, archive
from ..arguments import count, reject
from ..arguments import path as checked_path
from ..interruption import interruptible
from ..run import read_only
from ..showing import Facts, Shown
from ..tables import frame
from ..verbs import verb
from .columns import Columns, Memory, to_dataset
from .fields import STATUS_NAMES, ChunkResult, Field, Layout, RowGroup
from .grid import Grid, Tiling
from .labels import labels
from .machines import machine_from_dict
from .store import open_columns

if TYPE_CHECKING:
    import pandas
    import xarray
    from matplotlib.axes import Axes

MOTIONS = _core.MOTION_NAMES
# Cells of which the table of a notebook counts the labels, at most: it may take half a second.
_MOST_CELLS = 1_000_000
# Labels that it names.
_MOST_LABELS = 6
# What the entries of a column with an inner dimension are called in a data frame, else numbers.
_ENTRIES: dict[str, tuple[str, ...]] = {
    "scale": ("length", "mass", "time"),
}
# The cells with these statuses have come to the end of their run.
_COMPLETED = [STATUS_NAMES.index(name) for name in ("completed", "restarted", "rest")]


@interruptible
class GridResult(Shown):
    """Result of a computation over a grid of cells; arrays are read-only, in C order of the axes.

    Columns of a store are read at each access, so that a result takes no memory before it is used.

    Attributes
    ----------
    columns
        The arrays by name, with all that is known of the computation.
    system
        The system that was varied; where a function made one for each cell, that of the first. The
        system of any cell is ``system_at(...)``.
    """

    kind = "result"

    def __init__(self, columns: Columns) -> None:
        self.columns = columns
        self._machine = machine_from_dict(columns.layout.settings["system"])
        self.system = self._machine.system

    @property
    def axes(self) -> dict[str, NDArray[np.float64]]:
        """Name and values of each axis that was varied, shape (n,)."""
        return dict(self.columns.grid.axes)

    @property
    def is_made(self) -> bool:
        """Whether a function made the systems: then the axes are its arguments."""
        return self._machine.made_fields[0].name in self.columns

    def system_at(self, *cell: int) -> Any:
        """Return the system of a cell.

        Parameters
        ----------
        *cell
            The place along each axis; or one number, that of the cell in C order.

        Returns
        -------
        System or Structure
            With the values of the axes; or as the function made it, with its scales.

        Raises
        ------
        ParameterError
            If there is no such cell.

        Examples
        --------
        >>> import vibroimpact as vi
        >>> system = vi.System(mass_ratio=0.6, frequency_ratio=2, restitution=0.8, gap=0.5,
        ...                    drive_frequency=1.8, moment_amplitude=1)
        >>> states = vi.sweep(
        ...     system, drive_frequency=[1.7, 1.8], initial=(0, 0.5, 0, 0), periods=200,
        ... )
        >>> states.system_at(1).drive_frequency
        1.8
        """
        shape = self.columns.grid.shape
        sizes = shape if len(cell) == len(shape) else (len(self),)
        fits = len(cell) == len(sizes) and all(
            0 <= count("cell", place, least=0) < size
            for place, size in zip(cell, sizes, strict=True)
        )
        if not fits:
            reject("cell", cell, f"the place along each axis of {shape}, or one below {len(self)}")
        number = int(np.ravel_multi_index(cell, sizes))
        if not self.is_made:
            values = self.columns.grid.values(number, number + 1)
            numbers = self._machine.numbers
            own = {name: float(values[name][0]) for name in values if name in numbers}
            return self.system.replace(**own)
        inside = np.unravel_index(number, shape)
        names = [entry.name for entry in self._machine.made_fields if entry.name in self.columns]
        return self._machine.at({name: self.columns[name][inside] for name in names})

    @property
    def settings(self) -> dict[str, Any]:
        """The other arguments that the numbers depend on."""
        return {k: v for k, v in self.columns.layout.settings.items() if k != "system"}

    @property
    def status(self) -> NDArray[np.str_]:
        """How each cell ended: ``completed``, ``restarted`` (a followed state did not fit the new
        parameter: from ``initial``), ``overlap`` (the bodies overlap at the start), ``failed``, the
        stop reason, or ``pending`` if an interrupted call did not reach it.
        """  # noqa: D205
        return read_only(np.asarray(np.asarray(STATUS_NAMES)[self.columns["status"]]))

    @property
    def m(self) -> NDArray[np.int64]:
        """Drive periods per orbit; 0 where no period was found."""
        return self.columns["m"]

    @property
    def n(self) -> NDArray[np.int64]:
        """Impacts per orbit; -1 for complete chatter: the array has integers, and inf is none."""
        return self.columns["n"]

    @property
    def label(self) -> NDArray[np.str_]:
        """Label of each cell: ``3-4``, ``1-inf`` (chatter), ``quasi-periodic``, ``chaotic``,
        ``unresolved``.
        """  # noqa: D205
        # Of a sweep without axes NumPy makes a scalar.
        found = labels(*(self.columns[name] for name in ("motion", "m", "n")))
        return read_only(np.asarray(found))

    @property
    def residual(self) -> NDArray[np.float64]:
        """Largest difference between sections m periods apart."""
        return self.columns["residual"]

    def _exponents(self, name: str) -> NDArray[np.float64]:
        """Return a column of the largest exponent, which only some computations have."""
        if name not in self.columns:
            raise AttributeError(
                f"this {self.kind} has no {name}: it was computed without exponents=True"
            )
        return self.columns[name]

    @property
    def complete(self) -> bool:
        """Whether no cell is pending."""
        return self.columns.complete

    def __len__(self) -> int:
        """Return the number of cells."""
        return self.columns.grid.size

    def __repr__(self) -> str:
        """Return what was varied, and the number of cells, in words."""
        spans = [
            f"{len(values)} values of {name}"
            + (f" in [{values.min():g}, {values.max():g}]" if len(values) else "")
            for name, values in self.columns.grid.axes.items()
        ]
        kinds, counts = np.unique(np.asarray(self.columns["status"]), return_counts=True)
        found = dict(zip(kinds.tolist(), counts.tolist(), strict=True))
        completed = sum(found.pop(kind, 0) for kind in _COMPLETED)
        others = "".join(f", {count} {STATUS_NAMES[kind]}" for kind, count in found.items())
        over = " x ".join(spans) or "one system"
        return f"<{type(self).__name__} of {over}: {completed} of {len(self)} completed{others}>"

    def run(self, *indices: int) -> Any:
        """Make the run of one cell again, to the same bits.

        Parameters
        ----------
        *indices
            Place of the cell, an index for each axis; negative ones count from the end.

        Returns
        -------
        Run; of structures StructureRun
            It has the initial state and the settings of the cell. Of a sweep of Lyapunov spectra
            it is the run before the measurement.

        Raises
        ------
        ParameterError
            If there is no such cell.
        StateError
            If the bodies overlap at the start of the cell (status ``overlap``).
        SimulationError
            If the run fails (status ``failed``); ``.result`` is the run up to there.

        Examples
        --------
        >>> import vibroimpact as vi
        >>> system = vi.System(mass_ratio=0.6, frequency_ratio=2.0, restitution=0.8, gap=0.5,
        ...                    drive_frequency=1.8, moment_amplitude=1.0)
        >>> chart = vi.chart(
        ...     system, initial=(0, 0.5, 0, 0), gap=[0.4, 0.5], drive_frequency=[1.75, 1.8]
        ... )
        >>> chart.run(1, 1).label == chart.label[1, 1]
        True
        """
        return verb("run_of_cell")(self, *indices)

    def plot(self, **options: Any) -> "Axes":
        r"""Draw the result: a chart over two axes, labels or exponents over one.

        Parameters
        ----------
        **options
            Of a sweep over two axes as in ``vi.plot.chart``, over one as in
            ``vi.plot.final_states``; of Lyapunov spectra over one axis as in ``vi.plot.lyapunov``.

        Returns
        -------
        matplotlib.axes.Axes

        Raises
        ------
        ParameterError
            If there is no picture over so many axes.

        Examples
        --------
        >>> import vibroimpact as vi
        >>> system = vi.System(mass_ratio=0.6, frequency_ratio=2, restitution=0.8, gap=0.5,
        ...                    drive_frequency=1.8, moment_amplitude=1)
        >>> states = vi.sweep(
        ...     system, drive_frequency=[1.7, 1.8], initial=(0, 0.5, 0, 0), periods=200,
        ... )
        >>> states.plot().get_xlabel()
        'drive frequency $\\omega$'
        """
        axes: Axes = verb("draw")(self, **options)
        return axes

    def to_pandas(self) -> "pandas.DataFrame":
        """Return the cells as a data frame, one row each: axes, status, label, and numbers.

        Raises
        ------
        ImportError
            If pandas is not installed.

        Examples
        --------
        >>> import vibroimpact as vi
        >>> system = vi.System(mass_ratio=0.6, frequency_ratio=2.0, restitution=0.8, gap=0.5,
        ...                    drive_frequency=1.8, moment_amplitude=1.0)
        >>> chart = vi.chart(
        ...     system, initial=(0, 0.5, 0, 0), gap=[0.4, 0.5], drive_frequency=[1.75, 1.8]
        ... )
        >>> chart.to_pandas()[["gap", "drive_frequency"]].to_numpy().tolist()
        [[0.4, 1.75], [0.4, 1.8], [0.5, 1.75], [0.5, 1.8]]
        """
        grid = self.columns.grid
        columns: dict[str, Any] = dict(grid.values(0, grid.size))
        columns |= {"status": self.status.ravel(), "label": self.label.ravel()}
        for entry in self.columns.layout.fields:
            if entry.name in ("status", "motion"):
                continue
            values = self.columns[entry.name].reshape(grid.size, *entry.shape)
            if not entry.shape:
                columns[entry.name] = values
                continue
            flat = values.reshape(grid.size, -1)
            for i, name in enumerate(self._entry_names(entry)):
                columns[f"{entry.name}_{name}"] = flat[:, i]
        return frame(columns)

    def _entry_names(self, entry: Field) -> tuple[str, ...]:
        """Return the names of the entries of a column with inner dimensions, in C order."""
        if "coordinate" in entry.dims:
            return self._machine.coordinates
        if entry.dims[0] == "system_parameter":
            return self._machine.numbers
        numbers = tuple(map(str, range(1, entry.shape[0] + 1)))
        return _ENTRIES.get(entry.dims[0], numbers)

    def _facts(self) -> Facts:
        facts: Facts = {
            name: f"{len(values)} values"
            + (f" from {values[0]:.6g} to {values[-1]:.6g}" if len(values) else "")
            for name, values in self.axes.items()
        }
        if len(self) <= _MOST_CELLS:
            # Numbers are counted, not texts, which would take ten times longer.
            codes = np.stack([self.columns[name].ravel() for name in ("motion", "m", "n")])
            kinds, numbers = np.unique(codes, axis=1, return_counts=True)
            order = np.argsort(-numbers, kind="stable")
            names = labels(*kinds[:, order])
            shown = [
                f"{name} ({number})"
                for name, number in zip(names[:_MOST_LABELS], numbers[order], strict=False)
            ]
            more = len(names) - len(shown)
            facts["labels"] = ", ".join(shown) + (f", {more} more" if more > 0 else "")
        names, numbers = np.unique(self.status, return_counts=True)
        facts["status"] = ", ".join(
            f"{name} ({number})" for name, number in zip(names, numbers, strict=True)
        )
        return facts

    def to_xarray(self) -> "xarray.Dataset":
        """Return the columns as a labelled data set; one in a store is read when looked at.

        Its dimension ``coordinate`` has the coordinates x1, v1, x2, v2; ``exponent`` counts from 1.

        Raises
        ------
        ImportError
            If xarray is not installed.

        Examples
        --------
        >>> import vibroimpact as vi
        >>> system = vi.System(mass_ratio=0.6, frequency_ratio=2, restitution=0.8, gap=0.5,
        ...                    drive_frequency=1.8, moment_amplitude=1)
        >>> states = vi.sweep(
        ...     system, drive_frequency=[1.7, 1.8], initial=(0, 0.5, 0, 0), periods=200,
        ... )
        >>> dict(states.to_xarray().sizes)["drive_frequency"]
        2
        """
        return to_dataset(self.columns)

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the result to ``path`` (.npz, no pickle); ``vibroimpact.load`` reads it.

        Examples
        --------
        >>> import vibroimpact as vi
        >>> system = vi.System(mass_ratio=0.6, frequency_ratio=2, restitution=0.8, gap=0.5,
        ...                    drive_frequency=1.8, moment_amplitude=1)
        >>> states = vi.sweep(
        ...     system, drive_frequency=[1.7, 1.8], initial=(0, 0.5, 0, 0), periods=200,
        ... )
        >>> states.save("states.npz")
        >>> vi.load("states.npz").label.tolist()
        ['1-1', '1-1']
        """
        layout = self.columns.layout
        metadata = {
            "settings": dict(layout.settings),
            "axes": [*layout.grid.axes],
            "fields": [_written(entry) for entry in layout.fields],
            "rows": {group.name: [_written(f) for f in group.fields] for group in layout.rows},
        }
        arrays = {entry.name: self.columns[entry.name] for entry, _ in layout.arrays()}
        axes = {f"axis_{name}": values for name, values in layout.grid.axes.items()}
        archive.write(path, self.kind, metadata, arrays | axes)

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> Self:
        """Read a result from the file that ``save`` wrote, or open the store of a computation.

        Raises
        ------
        ValueError
            If it is damaged, foreign, or holds something else.

        Examples
        --------
        >>> import vibroimpact as vi
        >>> system = vi.System(mass_ratio=0.6, frequency_ratio=2, restitution=0.8, gap=0.5,
        ...                    drive_frequency=1.8, moment_amplitude=1)
        >>> states = vi.sweep(
        ...     system, drive_frequency=[1.7, 1.8], initial=(0, 0.5, 0, 0), periods=200,
        ... )
        >>> states.save("states.npz")
        >>> vi.Sweep.load("states.npz").complete
        True
        """
        path = checked_path("path", path)
        if os.path.isdir(path):
            columns = open_columns(path)
            if columns.layout.kind != cls.kind:
                raise ValueError(f"{path}: holds a {columns.layout.kind}, not a {cls.kind}")
            return cls(columns)
        return archive.read(path, {cls.kind: cls._from_parts})

    @classmethod
    def _from_parts(cls, metadata: dict[str, Any], arrays: dict[str, NDArray[Any]]) -> Self:
        layout = Layout(
            cls.kind,
            Grid({name: arrays[f"axis_{name}"] for name in metadata["axes"]}),
            tuple(_read(entry) for entry in metadata["fields"]),
            tuple(
                RowGroup(name, tuple(_read(entry) for entry in fields))
                for name, fields in metadata["rows"].items()
            ),
            metadata["settings"],
            metadata["version"],
        )
        return cls(in_memory(layout, arrays))


def in_memory(layout: Layout, arrays: dict[str, NDArray[Any]]) -> Columns:
    """Return columns of these arrays: of each field, and of the rows and counts of each group."""
    cells = layout.grid.size
    sink = Memory(layout, Tiling.of(layout.grid.shape, max(cells, 1)))
    columns = {
        entry.name: np.ascontiguousarray(arrays[entry.name]).reshape(cells, *entry.shape)
        for entry in layout.fields
    }
    rows = {
        group.name: (
            arrays[group.count.name].reshape(cells),
            {entry.name: arrays[entry.name] for entry in group.fields},
        )
        for group in layout.rows
    }
    if cells:
        sink.write(0, ChunkResult(columns, rows))
    return sink.columns()


def _written(entry: Field) -> dict[str, Any]:
    fill = None if isinstance(entry.fill, float) and np.isnan(entry.fill) else entry.fill
    return {
        "name": entry.name,
        "dtype": entry.dtype,
        "description": entry.description,
        "shape": entry.shape,
        "dims": entry.dims,
        "fill": fill,
        "flags": entry.flags,
    }


def _read(entry: dict[str, Any]) -> Field:
    parts = {name: tuple(entry[name]) for name in ("shape", "dims", "flags")}
    return Field(**entry | parts)

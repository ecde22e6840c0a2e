"""Pages of 180 mm width: rows with a heading, panels, one legend at the foot."""

import math
from collections.abc import Sequence
from pathlib import Path

from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure, SubFigure
from matplotlib.lines import Line2D

from vibroimpact import System
from vibroimpact.plot import PARAMETER_SYMBOLS

from .parameters import INITIAL
from .whole_file import whole_file

WIDTH_MM = 180.0
BLACK, GREY, VERMILLION = "#000000", "0.55", "#D55E00"
_INCH_MM = 25.4
# Dots per inch of pages and, so that the layout is that of what is written, of their texts.
_DPI = 300
# Columns of a legend where all of them fit.
_MOST_COLUMNS = 6
_FIXED = ("mass_ratio", "frequency_ratio", "restitution", "gap")
_VARIED = ("friction", "pendulum_damping", "oscillator_damping")
_DRIVE = ("moment_amplitude", "force_amplitude")
# What the symbols mean that stand in headings and along axes; they are the paper's.
_SYMBOLS = (
    r"$\bar m$ mass ratio, $\omega_0$ frequency ratio, $r$ restitution, $\delta$ gap, "
    r"$\mu$ friction, $\zeta_1, \zeta_2$ damping ratios, $f_1, f_2$ amplitudes of moment and force,"
    "\n"
    r"$\omega$ drive frequency; $x_1$ angle of the pendulum, $x_2$ displacement of the oscillator; "
    "$m$-$n$ periodic: $n$ impacts in $m$ drive periods"
)
_SYMBOLS_HEIGHT = 8.0


class Page:
    """A figure that is filled row by row, under a heading and the meaning of the symbols.

    Parameters
    ----------
    heading : str
        First line of the page.
    rows : int
        Number of rows.
    row_height : float
        Height of a row in mm, its heading included.
    heights : sequence of float, optional
        Heights of the rows one by one, where they differ.
    """

    def __init__(
        self, heading: str, rows: int, row_height: float, heights: Sequence[float] | None = None
    ) -> None:
        heights = heights or [row_height] * rows
        height = sum(heights) + 14.0 + _SYMBOLS_HEIGHT
        self.figure = Figure(
            figsize=(WIDTH_MM / _INCH_MM, height / _INCH_MM), dpi=_DPI, layout="constrained"
        )
        self.figure.suptitle(f"{heading}\n{_SYMBOLS}", x=0.012, ha="left")
        self._rows: list[SubFigure] = list(
            self.figure.subfigures(rows, 1, squeeze=False, height_ratios=heights)[:, 0]
        )
        self._used = 0

    def row(
        self,
        heading: str,
        columns: int = 2,
        widths: Sequence[float] | None = None,
        *,
        projection: str | None = None,
    ) -> list[Axes]:
        """Return the axes of the next row."""
        part = self._rows[self._used]
        self._used += 1
        if heading:
            part.suptitle(heading, x=0.012, ha="left")
        axes = part.subplots(
            1,
            columns,
            squeeze=False,
            width_ratios=widths,
            subplot_kw={"projection": projection} if projection else None,
        )
        return list(axes[0])

    def double_row(self, heading: str, heights: tuple[float, float]) -> list[Axes]:
        """Return the axes of the next row: two above two, aligned, heights in this ratio."""
        part = self._rows[self._used]
        self._used += 1
        part.suptitle(heading, x=0.012, ha="left")
        return list(part.subplots(2, 2, height_ratios=heights).flat)

    def lines(self, heading: str, panels: Sequence[int]) -> list[Axes]:
        """Return the axes of the next row: lines with so many panels each, all of full width."""
        part = self._rows[self._used]
        self._used += 1
        part.suptitle(heading, x=0.012, ha="left")
        columns = math.lcm(*panels)
        grid = part.add_gridspec(len(panels), columns)
        return [
            part.add_subplot(grid[line, k * columns // count : (k + 1) * columns // count])
            for line, count in enumerate(panels)
            for k in range(count)
        ]

    def legend(self, handles: Sequence[Artist]) -> None:
        """Put one legend at the foot of the page, in as many columns as its width has room for.

        Entries of the same name are shown once.
        """
        unique = {str(handle.get_label()): handle for handle in handles}
        for columns in range(min(len(unique), _MOST_COLUMNS), 0, -1):
            legend = self.figure.legend(
                handles=list(unique.values()),
                loc="outside lower center",
                ncols=columns,
                handletextpad=0.5,
                columnspacing=1.5,
            )
            if columns == 1 or legend.get_window_extent().width <= self.figure.bbox.width:
                return
            legend.remove()

    def save(self, out: Path, name: str, formats: Sequence[str]) -> list[Path]:
        """Write the page in each format and return the paths."""
        paths = [out / f"{name}.{suffix}" for suffix in formats]
        # Laid out once. Left to savefig, the page would be drawn twice in each format: to be laid
        # out, and to be written.
        if (engine := self.figure.get_layout_engine()) is not None:
            engine.execute(self.figure)
            self.figure.set_layout_engine("none")
        for path, suffix in zip(paths, formats, strict=True):
            with whole_file(path) as file:
                self.figure.savefig(file, format=suffix, dpi="figure")
        return paths


def in_drive_periods(ax: Axes, system: System) -> None:
    """Let the axis of time, which stays as it is, have its ticks at whole drive periods."""
    start, end = ax.get_xlim()
    period = system.drive_period
    # Rounding must not leave out the ends.
    numbers = range(math.ceil(start / period - 1e-6), math.floor(end / period + 1e-6) + 1)
    places = [min(max(number * period, start), end) for number in numbers]
    ax.set_xticks(places, [f"{number:,}" for number in numbers])
    ax.set_xlabel(r"drive periods $\omega t/2\pi$")


def square(color: str, text: str) -> Line2D:
    """Return the legend entry of points or of a strip of a colour."""
    return Line2D(
        [], [], ls="none", marker="s", markersize=4.5, markeredgewidth=0, color=color, label=text
    )


def values(system: System, names: Sequence[str]) -> str:
    """Return ``symbol = value`` for the named parameters."""
    return ", ".join(
        f"{PARAMETER_SYMBOLS[name].rstrip('$')} = {getattr(system, name):g}$" for name in names
    )


def fixed_parameters(system: System) -> str:
    """Return the parameters that all of the paper's figures share, and the initial state."""
    start = ", ".join(f"{value:g}" for value in INITIAL)
    return f"{values(system, _FIXED)}, from $({start})$"


def row_parameters(system: System, *, frequency: bool) -> str:
    """Return the parameters that differ from figure to figure."""
    if system.pendulum_damping == system.oscillator_damping:
        damping = rf"$\zeta_1 = \zeta_2 = {system.pendulum_damping:g}$"
    else:
        damping = values(system, ("pendulum_damping", "oscillator_damping"))
    parts = [values(system, ("friction",)), damping, values(system, _DRIVE)]
    if frequency:
        parts.append(values(system, ("drive_frequency",)))
    return ", ".join(parts)

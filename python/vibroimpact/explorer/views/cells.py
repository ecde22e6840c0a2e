"""Maps of cells: the chart of labels over two parameters, and basins over two coordinates."""

from __future__ import annotations

import numpy as np
from bokeh.models import ColumnDataSource, Range1d
from numpy.typing import NDArray

from ...plot.basins import BASIN_COLORS
from ...plot.labels import LABEL_STYLES, UNRESOLVED, label_codes
from ...showing import counted
from ...sweeps import Basins, Chart
from ..axis import Axis
from ..machine import Machine
from ..theme import Palette
from . import parts

# Label texts without the mathematics of print.
_PLAIN = str.maketrans({"$": "", "\\": ""})
_NO_LABEL, _NO_ATTRACTOR = "#B4B9BF", "#B4B9BF"


class CellsView:
    """An image of cells; a click chooses one, a box a range of both axes."""

    def __init__(self, name: str, machine: Machine) -> None:
        self._machine = machine
        self.source = ColumnDataSource(
            data={"image": [], "x": [], "y": [], "dw": [], "dh": []}, name=name
        )
        self.here = ColumnDataSource(data={"x": [], "y": []})
        self.key = parts.text(name=f"{name}-key", sizing_mode="stretch_width")
        self.figure = parts.zoomable(
            name, x_range=Range1d(0.0, 1.0), y_range=Range1d(0.0, 1.0), min_height=200
        )
        self.figure.grid.visible = False
        self.figure.image_rgba("image", "x", "y", "dw", "dh", source=self.source)
        self._cross = self.figure.scatter(
            "x", "y", source=self.here, size=13, marker="circle_cross", line_width=2
        )
        self._cross.glyph.fill_color = None
        self.sign = parts.Sign(self.figure, name)

    def frame(self, right: Axis, up: Axis, here: tuple[float, float]) -> None:
        """Show the ranges of two axes, and mark the motion of the page."""
        for axis, shown in ((right, self.figure.x_range), (up, self.figure.y_range)):
            shown.update(start=axis.low, end=axis.high)
        self.figure.xaxis.axis_label = self._machine.name_of(right.name)
        self.figure.yaxis.axis_label = self._machine.name_of(up.name)
        place = {"x": [here[0]], "y": [here[1]]}
        if self.here.data != place:
            self.here.data = place

    def clear(self) -> None:
        """Draw no cells."""
        self.source.data = {"image": [], "x": [], "y": [], "dw": [], "dh": []}
        self.key.text = ""

    def show_chart(self, chart: Chart, palette: Palette) -> None:
        """Draw the labels of a chart."""
        codes = np.minimum(label_codes(chart), UNRESOLVED)
        colors = [*(style.color for style in LABEL_STYLES), _NO_LABEL]
        texts = [*(style.text.translate(_PLAIN) for style in LABEL_STYLES), "no label"]
        texts = [text.replace("infty", "∞") for text in texts]
        present = np.unique(codes).tolist()
        self._image(codes, colors, [*chart.axes.values()])
        self.key.text = parts.keys((colors[code], texts[code]) for code in present)
        self.paint(palette)

    def show_basins(self, basins: Basins, palette: Palette) -> None:
        """Draw basins of attraction."""
        count = len(basins.attractors)
        colors = [BASIN_COLORS[k % len(BASIN_COLORS)] for k in range(count)]
        codes = np.where(basins.attractor >= 0, basins.attractor, count).astype(np.int64)
        self._image(codes, [*colors, _NO_ATTRACTOR], [*basins.axes.values()])
        key = [
            (color, f"{name}, {share:.1%}")
            for color, name, share in zip(colors, basins._names, basins.shares, strict=True)
        ]
        key += [
            (_NO_ATTRACTOR, f"{name}, {counted(number, 'cell')}")
            for name, number in _reasons(basins)
        ]
        self.key.text = parts.keys(key)
        self.paint(palette)

    def paint(self, palette: Palette) -> None:
        """Use the colours of a palette."""
        self._cross.glyph.line_color = palette.mark

    def _image(
        self, codes: NDArray[np.int64], colors: list[str], axes: list[NDArray[np.float64]]
    ) -> None:
        (x, y), rgba = axes, np.array([_rgba(color) for color in colors])[codes]
        # Each cell lies around its own values.
        dx, dy = ((values[-1] - values[0]) / max(len(values) - 1, 1) for values in (x, y))
        self.source.data = {
            "image": [np.ascontiguousarray(rgba.T)],
            "x": [x[0] - 0.5 * dx],
            "y": [y[0] - 0.5 * dy],
            "dw": [x[-1] - x[0] + dx],
            "dh": [y[-1] - y[0] + dy],
        }


def _reasons(basins: Basins) -> list[tuple[str, int]]:
    words = {"overlap": "the bodies overlap"}
    return [(words.get(name, name), number) for name, number in basins.reasons.items()]


def _rgba(color: str) -> np.uint32:
    red, green, blue = (int(color[k : k + 2], 16) for k in (1, 3, 5))
    # In the order of the bytes of a picture on a little-endian machine.
    return np.uint32(red | green << 8 | blue << 16 | 255 << 24)

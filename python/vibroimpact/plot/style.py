"""Colours, markers, symbols and print sizes shared by all figures.

Impact regimes have colours of their own. Each two of them differ in lightness as well as in hue, so
that they stay apart for readers with any of the common colour vision deficiencies and in grey
print (a test measures by how much); where markers are large enough to have a shape, the shape shows
the regime as well. All else is drawn in the palette of Okabe and Ito (Color Universal Design,
2008). What axes are called is in `axis_names`.
"""

import math
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any, Final

import matplotlib
import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.legend import Legend
from matplotlib.lines import Line2D

from .._core import Regime
from ..arguments import flag, naming, positive, reject

BLACK = "#000000"
ORANGE = "#E69F00"
SKY_BLUE = "#56B4E9"
GREEN = "#009E73"
BLUE = "#0072B2"
VERMILLION = "#D55E00"
PURPLE = "#CC79A7"
GREY = "0.55"

CHATTER_COLOR = SKY_BLUE
"""Points of motions with complete chatter: a colour no regime has."""


BODY_COLORS = {1: BLACK, 2: "0.6"}
"""Of the curves of either body: black the pendulum, grey the oscillator, in every picture."""


@dataclass(frozen=True)
class RegimeStyle:
    """How one impact regime is drawn and named."""

    text: str
    color: str
    marker: str


# Colour and mark of a stop of a structure, by its number. Marks alone tell six of them apart.
STOPS: Final = (
    (VERMILLION, "o"),
    (BLUE, "s"),
    (GREEN, "^"),
    (ORANGE, "v"),
    (PURPLE, "D"),
    (SKY_BLUE, "P"),
)

REGIME_STYLES: dict[int, RegimeStyle] = {
    Regime.FRICTIONLESS: RegimeStyle("frictionless", BLACK, "o"),
    Regime.SLIP: RegimeStyle("slip", "#0062E0", "s"),
    Regime.REVERSAL_APPROACH: RegimeStyle("reversal in approach", "#9B1A00", "^"),
    Regime.REVERSAL_RESTITUTION: RegimeStyle("reversal in restitution", "#E5C100", "v"),
    Regime.STICK_APPROACH: RegimeStyle("stick in approach", "#1ABC72", "D"),
    Regime.STICK_RESTITUTION: RegimeStyle("stick in restitution", "#C766A4", "P"),
}
"""Style of each impact regime, by `vibroimpact.Regime`."""


@dataclass(frozen=True)
class ContactStyle:
    """How sustained contact in one mode is drawn: a band with its outline and hatch, or a mark."""

    text: str
    band: str
    edge: str
    hatch: str
    color: str


CLOSED_STYLE = ContactStyle("contact", "#DCEEF9", "#DCEEF9", "", SKY_BLUE)
SLIDE_STYLE = ContactStyle("contact, sliding", "#DCEEF9", "#DCEEF9", "", SKY_BLUE)
STICK_STYLE = ContactStyle("contact, sticking", "#B9DAEE", "#7FB6DA", "///", BLUE)
CHATTER_STYLE = ContactStyle("chatter", "0.93", "0.75", "...", "0.75")


@dataclass(frozen=True)
class BifurcationStyle:
    """How one kind of bifurcation is drawn and named: a point of a branch, or a curve."""

    text: str
    color: str
    marker: str
    dashes: tuple[float, ...] = ()


BIFURCATION_STYLES = {
    "saddle_node": BifurcationStyle("saddle-node", BLACK, "o"),
    "period_doubling": BifurcationStyle("period doubling", VERMILLION, "^", (6, 1.5)),
    "neimark_sacker": BifurcationStyle("Neimark-Sacker", BLUE, "*", (6, 1.5, 1, 1.5)),
    # Of lines only: nothing bifurcates there.
    "neutral_saddle": BifurcationStyle("neutral saddle (no bifurcation)", GREY, "1"),
    "branch_point": BifurcationStyle("branch point", "white", "P"),
    "grazing": BifurcationStyle("grazing", "white", "s", (3, 1)),
    "regime_border": BifurcationStyle("regime border", SKY_BLUE, "d", (1, 1)),
    "chatter_onset": BifurcationStyle("chatter onset", ORANGE, "X", (6, 1, 1, 1, 1, 1)),
    "contact_border": BifurcationStyle("contact border", GREEN, "v", (2, 3)),
    "cusp": BifurcationStyle("cusp", PURPLE, "p"),
    "resonance_1_1": BifurcationStyle("resonance 1:1", "white", "o"),
    "resonance_1_2": BifurcationStyle("resonance 1:2", "white", "<"),
    "resonance_1_3": BifurcationStyle("resonance 1:3", "white", ">"),
    "resonance_1_4": BifurcationStyle("resonance 1:4", "white", "D"),
}
"""Style of each kind of bifurcation. Marker and dashes alone tell them apart.

White ones have a black outline; a curve of grazings is black.
"""

POINT_TEXTS = {kind: f"meets {style.text}" for kind, style in BIFURCATION_STYLES.items()} | {
    "cusp": "cusp: two saddle-nodes end",
    "resonance_1_1": "two multipliers 1 (1:1)",
    "resonance_1_2": r"two multipliers $-1$ (1:2)",
    "resonance_1_3": r"multipliers e$^{\pm 2\pi\mathrm{i}/3}$ (1:3)",
    "resonance_1_4": r"multipliers $\pm$i (1:4)",
}
"""What is met at a point of codimension two of a curve; resonances are told by their multipliers,
with the name that books give them in brackets."""

ANGLE_TICKS = {
    -math.pi / 2: r"$-\pi/2$",
    -math.pi / 4: r"$-\pi/4$",
    0.0: "0",
    math.pi / 4: r"$\pi/4$",
    math.pi / 2: r"$\pi/2$",
}
"""Ticks of an axis of angles, a quarter turn to either side."""

PUBLICATION: dict[str, Any] = {
    "font.family": "STIXGeneral",
    "mathtext.fontset": "stix",
    "font.size": 9,
    "axes.labelsize": 9,
    "axes.titlesize": 9,
    "xtick.labelsize": 8,
    "ytick.labelsize": 8,
    "legend.fontsize": 8,
    "figure.titlesize": 9,
    "axes.linewidth": 0.6,
    "xtick.major.width": 0.6,
    "ytick.major.width": 0.6,
    "xtick.direction": "in",
    "ytick.direction": "in",
    "xtick.top": True,
    "ytick.right": True,
    "legend.frameon": False,
    "savefig.dpi": 300,
    "pdf.fonttype": 42,
}
"""Settings for a page of 180 mm: text of at least 8 pt, 300 dots per inch, fonts embedded."""


@contextmanager
def publication_style() -> Iterator[None]:
    """Draw with the settings of `PUBLICATION` inside a ``with`` block only.

    Examples
    --------
    >>> import matplotlib.pyplot as plt
    >>> import vibroimpact as vi
    >>> with vi.plot.publication_style():
    ...     plt.rcParams["font.family"]
    ['STIXGeneral']
    """
    settings: Any = PUBLICATION  # matplotlib 3.11 types the keys as literals, 3.10 as str
    with matplotlib.rc_context(settings):
        yield


@naming
def label_text(label: str) -> str:
    r"""Return the label of a motion as figures write it: infinitely many impacts by a sign.

    Examples
    --------
    >>> import vibroimpact as vi
    >>> vi.plot.label_text("2-inf")
    '2-$\\infty$'
    """
    return label.replace("-inf", r"-$\infty$")


def new_axes(ax: Axes | None) -> Axes:
    """Return `ax`, or the axes of a new pyplot figure if it is None."""
    if ax is not None:
        return ax
    from matplotlib import pyplot

    return pyplot.figure(layout="constrained").add_subplot()


def several_axes(
    axes: Sequence[Axes] | None,
    number: int,
    inches: tuple[float, float],
    *,
    shared: bool = False,
    mosaic: Any = None,
) -> list[Axes]:
    """Return so many axes: those given, or those of a new pyplot figure.

    There they are in a row, of one height axis if ``shared``, or as ``mosaic`` arranges 0, 1, ...

    Raises
    ------
    ParameterError
        If others are given.
    """
    if axes is None:
        from matplotlib import pyplot

        figure = pyplot.figure(figsize=inches, layout="constrained")
        if mosaic is None:
            return [*np.ravel(figure.subplots(1, number, sharey=shared))]
        parts = figure.subplot_mosaic(mosaic)
        return [parts[place] for place in range(number)]
    chosen = list(np.ravel(np.asarray(axes, dtype=object)))
    if len(chosen) != number or not all(isinstance(ax, Axes) for ax in chosen):
        reject("axes", axes, f"{number} axes, or None")
    return chosen


@naming
def regime_handles(regimes: Iterable[int], *, shapes: bool = True) -> list[Artist]:
    """Return one legend entry for each regime in `regimes`, in the order of their values.

    Parameters
    ----------
    regimes : iterable of int
        Values of `vibroimpact.Regime`, in any order and with repetitions.
    shapes : bool
        Show the shape of each regime's marker; False for points too small to have one.

    Examples
    --------
    >>> import vibroimpact as vi
    >>> handles = vi.plot.regime_handles([vi.Regime.FRICTIONLESS, vi.Regime.SLIP])
    >>> [handle.get_label() for handle in handles]
    ['frictionless', 'slip']
    """
    return [
        Line2D(
            [],
            [],
            linestyle="none",
            marker=REGIME_STYLES[regime].marker if shapes else "s",
            markersize=4.5,
            markeredgewidth=0,
            color=REGIME_STYLES[regime].color,
            label=REGIME_STYLES[regime].text,
        )
        for regime in sorted(set(regimes))
    ]


def regimes_found(regimes: Iterable[int], *, shapes: bool = True) -> list[Artist]:
    """Return the legend entries of impacts by regime; if all have one it says so."""
    handles = regime_handles(regimes, shapes=shapes)
    if len(handles) == 1:
        handles[0].set_label(f"all impacts: {handles[0].get_label()}")
    return handles


@naming
def bifurcation_handles(kinds: Iterable[str], *, prefix: str = "") -> list[Artist]:
    """Return one legend entry for each kind of bifurcation, in the order of `BIFURCATION_STYLES`.

    Parameters
    ----------
    kinds : iterable of str
        Kinds, in any order and with repetitions.
    prefix : str
        What to put before the names.

    Examples
    --------
    >>> import vibroimpact as vi
    >>> [handle.get_label() for handle in vi.plot.bifurcation_handles(["saddle_node"])]
    ['saddle-node']
    """
    present = set(kinds)
    return [
        Line2D([], [], **bifurcation_marker(kind), label=prefix + style.text)
        for kind, style in BIFURCATION_STYLES.items()
        if kind in present
    ]


def bifurcation_marker(kind: str, size: float = 4.5) -> dict[str, Any]:
    """Return the arguments of `Axes.plot` that mark a bifurcation of this kind."""
    style = BIFURCATION_STYLES[kind]
    larger = 1.5 if style.marker in "*1" else 1.0
    return {
        "linestyle": "none",
        "marker": style.marker,
        "markersize": larger * size,
        "markerfacecolor": style.color,
        "markeredgecolor": BLACK,
        "markeredgewidth": 0.6,
    }


PHASE_TICKS = {0.0: "0", math.pi / 2: r"$\pi/2$", math.pi: r"$\pi$"}
PHASE_TICKS |= {1.5 * math.pi: r"$3\pi/2$", 2 * math.pi: r"$2\pi$"}
"""Ticks of an axis of drive phases."""

# Area of a mark in square points: the sum over all marks, and the limits of one.
_ALL_MARKS, _LEAST_MARK, _LARGEST_MARK = 3000.0, 0.6, 12.0


def mark_area(given: float | None, marks: int) -> float:
    """Return the area of a mark in square points: as given, or smaller the more marks there are."""
    if given is not None:
        return positive("size", given)
    return min(max(_ALL_MARKS / max(marks, 1), _LEAST_MARK), _LARGEST_MARK)


def phase_axis(ax: Axes, axis: str) -> None:
    """Let an axis, "x" or "y", show one turn of the drive phase."""
    ax.set(**{f"{axis}lim": (0.0, 2 * math.pi)})
    ax.set(**{f"{axis}ticks": [*PHASE_TICKS], f"{axis}ticklabels": [*PHASE_TICKS.values()]})


# The rest of a figure's width is for ticks and labels.
_LEGEND_PART = 0.85


def legend_above(
    ax: Axes, handles: Sequence[Artist], columns: int = 2, fontsize: float | None = None
) -> Legend:
    """Put a legend above the axes, where it hides no data; without entries none is seen.

    If the axes are alone in their figure the number of columns is reduced until the legend fits.
    """

    def legend(columns: int) -> Legend:
        return ax.legend(
            handles=list(handles),
            loc="lower left",
            bbox_to_anchor=(0.0, 1.0),
            ncols=columns,
            fontsize=fontsize,
            borderaxespad=0.2,
            handlelength=1.2,
            handletextpad=0.5,
            columnspacing=1.2,
        )

    drawn, figure = legend(columns), ax.figure
    while columns > 1 and len(figure.axes) == 1:
        if drawn.get_window_extent().width <= _LEGEND_PART * figure.bbox.width:
            break
        columns -= 1
        drawn = legend(columns)
    drawn.set_visible(len(handles) > 0)
    return drawn


# Beside other axes a legend may be a little wider than its own.
_SLOT_PART = 1.05


def curve_legend(ax: Axes, legend: bool, entries: Sequence[Artist] | None = None) -> None:
    """Name curves, bands and marks, or `entries`, above the axes, in as few rows as fit."""
    handles, texts = ax.get_legend_handles_labels()
    if entries is not None:
        handles, texts = [*entries], [str(entry.get_label()) for entry in entries]
    if not flag("legend", legend) or not handles:
        return
    named = dict(zip(texts, handles, strict=True))
    slot, whole = ax.get_window_extent().width, ax.figure.bbox.width
    alone = len(ax.figure.axes) == 1
    for columns in range(min(len(named), 6), 0, -1):
        drawn = legend_above(ax, [*named.values()], columns=columns)
        if drawn.get_window_extent().width <= (
            _LEGEND_PART * whole if alone else _SLOT_PART * slot
        ):
            break


# Points closer together than this part of their size are one point but for rounding; the axes then
# show this part of it.
_ONE_POINT, _AROUND = 1e-3, 0.1


def show_around(ax: Axes, axis: str) -> None:
    """Keep an axis from showing the rounding of a periodic motion in place of its points."""
    low, high = getattr(ax.dataLim, f"interval{axis}").tolist()
    size = max(abs(low), abs(high))
    if 0.0 < size < math.inf and high - low < _ONE_POINT * size:
        middle = 0.5 * (low + high)
        ax.set(**{f"{axis}lim": (middle - _AROUND * size, middle + _AROUND * size)})

"""Pages of Figs. 5, 6, 9 and 10: single motions as time histories, portraits and sections."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from numpy.typing import NDArray

from vibroimpact import Run, plot, simulate
from vibroimpact.plot import label_text

from .evidence import HORIZONS, Coexistence, coexisting, coexisting_chaos, drive_periods
from .layout import BLACK, GREY, Page, fixed_parameters, in_drive_periods, row_parameters
from .parameters import INITIAL, KEEP, PERIODS, Motion
from .told_apart import RETURN, SETTLING, draw_growth, draw_returns

Color = Literal["regime"] | None

_SHOWN_PERIODS = 8
_SPORADIC_END = 400.0
# What either body is in a history and in a portrait, where it is the same line.
_SYMBOLS = {
    "oscillator": ("$x_2$", r"$x_2,\ \dot x_2$"),
    "pendulum": (r"$\sin x_1-\delta$", r"$x_1,\ \dot x_1$"),
}
# Area of a large mark of an impact section in square points, and the colour of the small ones.
_LARGE = 7.0
_LATER_COLOR = "0.6"
# Sections of which a part is enlarged, x1 and x1': there a 154-77 motion has single points, and the
# chaotic one beside it narrow bands (errata, E10). The inset stands in the empty middle.
_ENLARGED = {"9(4)": ((0.055, 0.130), (1.490, 1.600))}
# Height in mm of the row that tells them apart. It comes last: none of Fig. 9 follows.
_TOLD_APART = 62.0
_INSET = (0.30, 0.32, 0.36, 0.42)


@dataclass(frozen=True)
class Shown:
    """A motion with the runs that its row draws.

    `long_run` adds points to an impact section; `other` is a coexisting motion for a row below,
    and `beside` that motion over the same times as this one, if an impact section shows it.
    """

    motion: Motion
    run: Run
    long_run: Run | None = None
    other: Coexistence | None = None
    beside: "Shown | None" = None


def simulated(motion: Motion, workers: int | None = None) -> Shown:
    """Simulate a motion as the paper does; if the result differs, also the runs that decide."""
    shown = _from(motion, INITIAL)
    if motion.figure == 10 or {shown.run.label, _long(shown).label} == {motion.paper_says}:
        return shown
    if motion.paper_says != "chaotic":
        return replace(shown, other=coexisting(motion.system, motion.paper_says, workers=workers))
    other = coexisting_chaos(motion.system, workers=workers)
    beside = None if other.run is None else _from(motion, other.run.initial)
    return replace(shown, other=other, beside=beside)


def _from(motion: Motion, initial: Sequence[float]) -> Shown:
    """Simulate a motion from a start, and longer where its row or its claim needs it."""
    run: Run = simulate(motion.system, initial=initial, periods=PERIODS, keep=KEEP)
    if motion.right != "section" and motion.figure != 10:
        return Shown(motion, run)
    # Fig. 10 is about the transient, an impact section about what follows it.
    longest = max(HORIZONS)
    keep = longest if motion.figure == 10 else longest - PERIODS
    long_run: Run = simulate(motion.system, initial=initial, periods=longest, keep=keep)
    return Shown(motion, run, long_run)


def _long(shown: Shown) -> Run:
    """Return the longest run there is."""
    return shown.run if shown.long_run is None else shown.long_run


def draw(figure: int, shown: Sequence[Shown], color: Color) -> Page:
    """Draw a page with one row for each motion: time history left, portrait or section right."""
    others = [item for item in shown if item.other is not None and item.other.run is not None]
    alike = [item for item in others if item.motion.id in _ENLARGED]
    heights = [47.0 if len(shown) > 3 else 58.0] * (len(shown) + len(others))
    heights += [_TOLD_APART] * len(alike)
    page = Page(
        f"Fig. {figure}: {fixed_parameters(shown[0].run.system)}; last {_SHOWN_PERIODS} drive "
        "periods shown",
        rows=len(heights),
        row_height=0.0,
        heights=heights,
    )
    drawn: list[Axes] = []
    sections: list[Artist] = []
    for item in shown:
        motion, run = item.motion, item.run
        panel = f"({motion.panel})"
        parameters = row_parameters(motion.system, frequency=True)
        found = f"paper: {motion.paper_says}; found: {label_text(run.label)}{_later(item)}"
        left, right = page.row(f"{panel}  {parameters}. {found}", widths=(1.5, 1.0))
        _row(left, right, item, run, color)
        drawn += [left, right]
        if motion.right == "section":
            sections = _section_handles(item, color)
        if item.other is not None and item.other.run is not None:
            start = ", ".join(f"{value:.3f}" for value in item.other.run.initial)
            same = f"{panel[:-1]}\u2032)  same parameters, from $({start})$"
            heading = f"{same}. found: {label_text(item.other.run.label)}"
            if motion.id in _ENLARGED:
                heading += f". Where {panel} has single points it has bands"
            left, right = page.row(heading, widths=(1.5, 1.0))
            beside = item.beside or Shown(motion, item.other.run)
            _row(left, right, beside, beside.run, color)
            drawn += [left, right]
            if item in alike:
                _tell_apart(page, item)
    page.legend([*_handles(*drawn), *sections])
    return page


def regimes_of(shown: Sequence[Shown]) -> set[int]:
    """Return the regimes of all impacts."""
    runs = [run for item in shown for run in (item.run, item.long_run) if run is not None]
    return {int(regime) for run in runs for regime in np.unique(run.impacts["regime"])}


def _later(item: Shown) -> str:
    """Return what the motion has become after a longer time, if that is another label."""
    if item.long_run is None or item.long_run.label == item.run.label:
        return ""
    return f", after {drive_periods(item.long_run)} periods {label_text(item.long_run.label)}"


def _row(left: Axes, right: Axes, item: Shown, run: Run, color: Color) -> None:
    options: dict[str, Any] = {"color": color, "legend": False}
    plot.time_history(run, periods=_SHOWN_PERIODS, drive="plain", ax=left, **options)
    in_drive_periods(left, run.system)
    if color is None:
        _mark_touches(left, run)
    if item.motion.right == "section":
        _section(right, item, run, color)
    else:
        bodies = (1,) if item.motion.right == "pendulum" else (1, 2)
        # A closed orbit is drawn once: a second pass would fill the gaps of the dashes.
        periods = min(run.period.m or _SHOWN_PERIODS, _SHOWN_PERIODS)
        plot.phase_portrait(run, bodies=bodies, periods=periods, ax=right, **options)
    for line in (*left.get_lines(), *right.get_lines()):
        for body, symbols in _SYMBOLS.items():
            if line.get_label() in symbols:
                line.set_label(f"{body}: left {symbols[0]}, right {symbols[1]}")


def _mark_touches(ax: Axes, run: Run) -> None:
    """Mark the impacts in view by a ring where the curves touch."""
    start, end = ax.get_xlim()
    hits = run.impacts[(run.impacts["time"] >= start) & (run.impacts["time"] <= end)]
    ax.plot(
        hits["time"],
        hits["x2"],
        linestyle="none",
        marker="o",
        markersize=4.0,
        markerfacecolor="white",
        markeredgecolor=BLACK,
        markeredgewidth=0.7,
        label="impact",
        zorder=3,
    )


def _section(ax: Axes, item: Shown, run: Run, color: Color) -> None:
    """Draw the impacts of the run large, those that come after it small."""
    if item.long_run is not None:
        plot.impact_section(item.long_run, color=color, size=0.6, legend=False, ax=ax)
    if color == "regime":
        plot.impact_section(run, color=color, size=_LARGE, legend=False, ax=ax)
    else:
        ax.collections[0].set_color(_LATER_COLOR)
        plot.impact_section(run, size=_LARGE, ax=ax)
    ax.set_xlabel("$x_1$ at impact")
    ax.set_ylabel(r"$\dot x_1$ before impact")
    if item.motion.id in _ENLARGED and item.long_run is not None:
        _enlarge(ax, item.long_run, _ENLARGED[item.motion.id], color)


def _enlarge(
    ax: Axes,
    run: Run,
    window: tuple[tuple[float, float], tuple[float, float]],
    color: Color,
) -> None:
    """Draw a part of a section again, larger, inside of it."""
    inset = ax.inset_axes(_INSET)
    plot.impact_section(run, color=color, size=1.5, legend=False, ax=inset)
    inset.set(xlim=window[0], ylim=window[1], xlabel="", ylabel="")
    inset.tick_params(labelsize=6, length=2)
    ax.indicate_inset_zoom(inset, edgecolor=GREY)


def _tell_apart(page: Page, item: Shown) -> None:
    """Draw what shows that of two motions with like sections one is periodic, the other chaotic."""
    if item.other is None or item.other.run is None:
        return
    panel, system, start = item.motion.panel, item.motion.system, item.other.run.initial
    this, that = f"({panel})", f"({panel}\u2032)"
    left, right = page.row(
        f"{this} and {that} told apart. Left: neighbours of {this} come back to it, those of "
        f"{that} leave it exponentially.\nRight: {that} in its widest band, each impact against "
        f"the one {RETURN} before: a map with two branches",
        widths=(1.5, 1.0),
    )
    texts = (f"{this}  from the paper's start", f"{that}  from the other start")
    draw_growth(left, system, [(INITIAL, texts[0]), (start, texts[1])])
    run: Run = simulate(system, initial=start, periods=6 * SETTLING, keep=5 * SETTLING)
    draw_returns(right, run.impacts["v1_pre"])


def _section_handles(item: Shown, color: Color) -> list[Artist]:
    """Return the legend entries of the impacts of the run and of those that come after it."""
    handles: list[Artist] = []
    for size, shade, run in (
        ("large", BLACK, item.run),
        ("small", _LATER_COLOR, item.long_run),
    ):
        if run is None:
            continue
        first = round(run.kept_from / run.system.drive_period) + 1
        text = f"right, {size}: impacts of drive periods {first:,} to {drive_periods(run):,}"
        mark = Line2D(
            [],
            [],
            linestyle="none",
            marker="o",
            markersize=math.sqrt(_LARGE) if size == "large" else 1.5,
            markeredgewidth=0,
            # The colour of a regime has its own entry.
            color=GREY if color == "regime" else shade,
            label=text,
        )
        handles.append(mark)
    return handles


def draw_sporadic(shown: Shown, color: Color) -> Page:
    """Draw Fig. 10: gap and displacements at the start, one impact enlarged, and the count.

    Parameters
    ----------
    shown : Shown
        `long_run` must have kept everything from t = 0.
    color : "regime" or None
        Mark the impacts by their regime.
    """
    run, motion = shown.long_run, shown.motion
    if run is None:
        raise ValueError("Fig. 10 needs a long run that starts at t = 0")
    window = (0.0, _SPORADIC_END)
    page = Page(
        f"Fig. 10: {fixed_parameters(run.system)},\n"
        f"{row_parameters(motion.system, frequency=True)}",
        rows=3,
        row_height=52.0,
    )
    left, right = page.row(
        "(a)  gap between the bodies: most of the times when it is almost zero are near misses",
        widths=(2.0, 1.0),
    )
    plot.gap_history(run, window=window, color=color, legend=False, ax=left)
    times = run.impacts["time"]
    centre = float(times[0]) if len(times) else 0.5 * _SPORADIC_END
    width = 0.15 * run.system.drive_period
    zoom = (max(centre - width, 0.0), centre + width)
    plot.gap_history(run, window=zoom, color=color, legend=False, ax=right)
    # Above the mark.
    right.set_title("around the first impact", loc="left", pad=3 if color else 8)
    drawn = [left, right]
    (ax,) = page.row("(b)  displacements of both bodies", columns=1)
    plot.displacement_history(run, window=window, color=color, legend=False, ax=ax)
    drawn.append(ax)
    if color is None:
        _mark_impacts(drawn, times)
    (ax,) = page.row(
        f"(c)  not in the paper: {len(times):,} impacts within {drive_periods(run):,} drive "
        "periods",
        columns=1,
    )
    plot.impact_count(run, ax=ax)
    ax.axvline(_SPORADIC_END / run.system.drive_period, color="0.6", lw=0.6, ls=(0, (3, 2)))
    ax.annotate(
        "end of (a), (b)",
        (_SPORADIC_END / run.system.drive_period, 0.96),
        xycoords=("data", "axes fraction"),
        xytext=(-3, 0),
        textcoords="offset points",
        ha="right",
        va="top",
        fontsize=8,
    )
    page.legend(_handles(*drawn))
    return page


def _mark_impacts(axes: Sequence[Axes], times: NDArray[np.float64]) -> None:
    """Mark impacts in view above the axes: in the curves themselves they cannot be seen."""
    for ax in axes:
        start, end = ax.get_xlim()
        shown = times[(times >= start) & (times <= end)]
        ax.plot(
            shown,
            np.full(len(shown), 1.03),
            linestyle="none",
            marker="v",
            markersize=4.0,
            markeredgewidth=0,
            color=BLACK,
            label="impact",
            transform=ax.get_xaxis_transform(),
            clip_on=False,
        )


def _handles(*axes: Axes) -> list[Artist]:
    """Return the legend entries of lines, then of regimes, whose markers get one size."""
    lines: dict[str, Artist] = {}
    for ax in axes:
        for handle in ax.get_legend_handles_labels()[0]:
            lines.setdefault(str(handle.get_label()), handle)
    regimes = [
        number for number, style in plot.REGIME_STYLES.items() if lines.pop(style.text, None)
    ]
    return [*lines.values(), *plot.regime_handles(regimes)]

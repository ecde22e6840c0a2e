"""Pages of Figs. 4, 7 and 8: bifurcation diagrams over the drive frequency, and enlargements."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes

from vibroimpact import Diagram, Run, bifurcation_diagram, plot, simulate
from vibroimpact.plot import label_text

from .layout import BLACK, Page, fixed_parameters, in_drive_periods, row_parameters, square
from .parameters import (
    ENLARGED_RANGE,
    FREQUENCY_RANGE,
    INITIAL,
    KEEP,
    LOW_EXAMPLES,
    LOW_RANGE,
    PERIODS,
    Transition,
)
from .windows import Window, is_confirmed, period_windows

Color = Literal["regime"] | None

MOST_WINDOWS = 6
_MARGIN = 0.25
# Heights in mm: of a row, and of one with the time in contact beneath. That is drawn where so large
# a part of the values have complete chatter: a few values among chaotic ones need none.
_HEIGHT = 62.0
_DOUBLE_HEIGHT = 100.0
_CHATTERING = 0.01
_RATIO = (1.0, 0.55)
_COLUMNS = 3
_WINDOW_HEIGHT = 60.0
# Panels inside of "Fig. 8(a)", whose own panels have letters.
_NUMERALS = ("i", "ii", "iii", "iv", "v", "vi")
_FREQUENCY = r"drive frequency $\omega = \Omega/\omega_2$"
_AT_IMPACT = r"angle $x_1$ at each impact"
_ONCE_A_PERIOD = r"angle $x_1$ at drive phase 0"
# How dark a point is, in the impact and in the stroboscopic section: where many lie on one another
# their density is seen, and a hundred points of a periodic motion are black nevertheless.
_OPACITY = (0.35, 0.06)
_OPACITY_ENLARGED = (0.8, 0.25)
# Parts of the impacts below and above which a panel does not reach.
_TAILS = (0.003, 0.997)


@dataclass(frozen=True)
class Enlargement:
    """A part of a diagram on a finer grid; `window` is None for a range fixed beforehand.

    `example` is a motion with sustained contact inside it.
    """

    diagram: Diagram
    window: Window | None
    found: int
    example: Run | None = None


def compute(transition: Transition, frequencies: int, workers: int | None) -> Diagram:
    """Return the diagram of one panel over `FREQUENCY_RANGE`."""
    return _diagram(transition, FREQUENCY_RANGE, frequencies, workers)


def enlarge(
    transition: Transition, diagram: Diagram, frequencies: int, workers: int | None
) -> list[Enlargement]:
    """Return the parts of a diagram that are shown enlarged.

    For Fig. 7(c) the low frequencies with complete chatter, and one motion there. For Fig. 8(a) the
    range in which the paper reports 2-2, 6-6, 4-5 and 8-10 motions; then the widest windows of
    period m > 2, at most `MOST_WINDOWS`, in the order of their frequencies.
    """
    parts = []
    if transition.id == "7c":
        zoom = _diagram(transition, LOW_RANGE, max(frequencies // 4, 2), workers)
        system = transition.system.replace(drive_frequency=LOW_EXAMPLES[1])
        run: Run = simulate(system, initial=INITIAL, periods=PERIODS, keep=KEEP)
        return [Enlargement(zoom, None, 0, run)]
    if transition.id == "8a":
        zoom = _diagram(transition, ENLARGED_RANGE, max(frequencies // 4, 2), workers)
        parts.append(Enlargement(zoom, None, 0))
    windows = [window for window in period_windows(diagram) if is_confirmed(window, diagram)]
    for window in sorted(windows[:MOST_WINDOWS], key=lambda window: window.low):
        span = window.widened(_MARGIN)
        zoom = _diagram(transition, span, max(frequencies // 10, 2), workers)
        parts.append(Enlargement(zoom, window, len(windows)))
    return parts


def _diagram(
    transition: Transition, span: tuple[float, float], frequencies: int, workers: int | None
) -> Diagram:
    return bifurcation_diagram(
        transition.system,
        labels=False,
        drive_frequency=np.linspace(*span, frequencies),
        initial=INITIAL,
        periods=PERIODS,
        keep=KEEP,
        workers=workers,
    )


def draw(figure: int, panels: Sequence[tuple[Transition, Diagram]], color: Color) -> Page:
    """Draw a page with one row for each panel: impact section left, stroboscopic section right.

    Where the motion has complete chatter over a range of frequencies, panels beneath show the time
    in sustained contact: over all frequencies left, over that range right.
    """
    first = panels[0][1]
    heights = [_DOUBLE_HEIGHT if _chatters(diagram) else _HEIGHT for _, diagram in panels]
    page = Page(
        f"Fig. {figure}: {fixed_parameters(first.system)}; last {KEEP} of {PERIODS} drive periods, "
        f"{len(first.parameter)} frequencies",
        rows=len(heights),
        row_height=_HEIGHT,
        heights=heights,
    )
    for transition, diagram in panels:
        letter = f"({transition.panel})  " if transition.panel else ""
        parameters = row_parameters(transition.system, frequency=False)
        heading = f"{letter}{parameters}{_stopped(diagram)}"
        if not _chatters(diagram):
            left, right = page.row(heading)
        else:
            left, right, whole, low = page.double_row(heading, _RATIO)
            plot.contact_fraction(diagram, ax=whole)
            plot.contact_fraction(diagram, ax=low)
            _name_axes(whole, low)
            whole.set_title("time in sustained contact", loc="left", pad=3)
            low.set_title("the same, low frequencies", loc="left", pad=3)
            low.set_xlim(diagram.parameter[0], 1.25 * diagram.parameter[diagram.n == -1].max())
        _pair(left, right, diagram, color, 0.25, _OPACITY)
    letters = [transition.panel for transition, _ in panels if transition.panel]
    of = f" of ({letters[0]})-({letters[-1]})" if len(letters) > 1 else ""
    page.legend(_entries([diagram for _, diagram in panels], color, of=of))
    return page


def _chatters(diagram: Diagram) -> bool:
    """Return whether the motion has complete chatter over a range of frequencies."""
    return bool(np.count_nonzero(diagram.n == -1) > _CHATTERING * len(diagram))


def draw_enlargements(transition: Transition, parts: Sequence[Enlargement], color: Color) -> Page:
    """Draw the enlarged parts of a diagram: fixed ranges in full width, windows three in a row.

    Beneath a range with an example of sustained contact: the time in contact, and that motion.
    """
    ranges = [part for part in parts if part.window is None]
    windows = [part for part in parts if part.window is not None]
    heights = [_HEIGHT if part.example is None else _DOUBLE_HEIGHT for part in ranges]
    lines = _lines(len(windows))
    heights += [len(lines) * _WINDOW_HEIGHT] if windows else []
    figure = f"Fig. {transition.figure}{transition.panel and f'({transition.panel})'}"
    page = Page(
        f"{figure} enlarged: {fixed_parameters(transition.system)},\n"
        f"{row_parameters(transition.system, frequency=False)}; last {KEEP} of {PERIODS} drive "
        "periods",
        rows=len(heights),
        row_height=_HEIGHT,
        heights=heights,
    )
    examples: list[Artist] = []
    for part in ranges:
        count = len(part.diagram.parameter)
        heading = f"{count} frequencies; periodic motions: {_periods(part.diagram)}"
        heading = f"{heading}{_stopped(part.diagram)}"
        if part.example is None:
            left, right = page.row(heading)
        else:
            left, right, beneath, motion = page.double_row(heading, _RATIO)
            plot.contact_fraction(part.diagram, ax=beneath)
            _name_axes(beneath)
            beneath.set_title("time in sustained contact", loc="left", pad=3)
            _example(motion, part.example)
            examples += motion.get_legend_handles_labels()[0]
        _pair(left, right, part.diagram, color, 0.4, _OPACITY_ENLARGED)
    if windows:
        axes = page.lines(_windows_heading(figure, windows), lines)
        for ax, numeral, part in zip(axes, _NUMERALS, windows, strict=False):
            _window(ax, numeral, part, color)
    diagrams = [part.diagram for part in parts]
    page.legend([*_entries(diagrams, color, stroboscopic=bool(ranges)), *examples])
    return page


def _lines(panels: int) -> list[int]:
    """Return how many panels each line of them has, so that the last one has no hole."""
    lines = math.ceil(panels / _COLUMNS)
    return [math.ceil((panels - line) / lines) for line in range(lines)]


def _windows_heading(figure: str, windows: Sequence[Enlargement]) -> str:
    shown, found = len(windows), windows[0].found
    which = f"all {found}" if shown == found else f"the {shown} widest of {found}"
    return (
        "Windows of periodic motions $m$-$n$ ($m$ drive periods, $n$ impacts) with $m > 2$: "
        f"{which} that {figure} has,\n"
        f"each computed again at {len(windows[0].diagram.parameter)} frequencies; "
        f"dashed: first and last frequency with that motion in {figure}"
    )


def _example(ax: Axes, run: Run) -> None:
    plot.time_history(run, periods=2, drive="plain", legend=False, ax=ax)
    in_drive_periods(ax, run.system)
    share = run.time_in_contact / (run.final_state.time - run.kept_from)
    frequency = rf"$\omega = {run.system.drive_frequency:g}$"
    text = f"{frequency}: {label_text(run.label)}, {share:.1%} of the time in contact"
    ax.set_title(text, loc="left", pad=3)


def _pair(
    left: Axes,
    right: Axes,
    diagram: Diagram,
    color: Color,
    size: float,
    opacity: tuple[float, float],
) -> None:
    plot.bifurcation(diagram, color=color, size=size, legend=False, ax=left)
    plot.bifurcation(diagram, section="stroboscopic", size=size, legend=False, ax=right)
    # Colours of regimes would mix.
    if color is None:
        left.collections[0].set_alpha(opacity[0])
    right.collections[0].set_alpha(opacity[1])
    _name_axes(left, right)
    left.set_ylabel(_AT_IMPACT)
    right.set_ylabel(_ONCE_A_PERIOD)


def _name_axes(*axes: Axes) -> None:
    for ax in axes:
        ax.set_xlabel(_FREQUENCY)


def _window(ax: Axes, numeral: str, part: Enlargement, color: Color) -> None:
    if part.window is None:
        return
    plot.bifurcation(part.diagram, color=color, size=0.6, legend=False, ax=ax)
    beyond = _fit(ax, part.diagram, part.window)
    for edge in (part.window.low, part.window.high):
        ax.axvline(edge, color="0.6", lw=0.5, ls=(0, (3, 2)), zorder=0)
    more = f"; {beyond:,} impacts outside the frame" if beyond else ""
    ax.set_title(f"({numeral}) {part.window.m}-{part.window.n}{more}", loc="left", pad=3)
    ax.set_ylabel(_AT_IMPACT)
    ax.locator_params(axis="x", nbins=4)


def _fit(ax: Axes, diagram: Diagram, window: Window) -> int:
    """Fit the vertical range to the window's motion and to most impacts.

    Returns how many are beyond: a few far ones of chaotic motions would flatten the branches.
    """
    x1 = np.asarray(diagram.x1)
    if not len(x1):
        return 0
    low, high = np.quantile(x1, _TAILS)
    of_motion = (np.asarray(diagram.m) == window.m) & (np.asarray(diagram.n) == window.n)
    own = x1[np.repeat(of_motion, np.diff(diagram.offset))]
    if len(own):
        low, high = min(low, own.min()), max(high, own.max())
    margin = 0.12 * (high - low) or 0.1
    ax.set_ylim(low - margin, high + margin)
    return int(np.count_nonzero((x1 < low - margin) | (x1 > high + margin)))


def _periods(diagram: Diagram, at_least: int = 3) -> str:
    """Return the labels m-n that so many values have, by m, then by n."""
    pairs, counts = np.unique(
        np.column_stack([diagram.m, diagram.n])[diagram.m > 0], axis=0, return_counts=True
    )
    found = [(int(m), int(n)) for m, n in pairs[counts >= at_least]]
    # Infinitely many impacts, stored as -1, come last.
    found.sort(key=lambda pair: (pair[0], pair[1] < 0, pair[1]))
    return ", ".join(label_text(f"{m}-{'inf' if n < 0 else n}") for m, n in found) or "none"


def _stopped(diagram: Diagram) -> str:
    """Return how many runs did not complete, for a heading; empty if all did."""
    early = ~np.isin(diagram.status, ["completed", "rest"])
    kinds, counts = np.unique(diagram.status[early], return_counts=True)
    parts = [f"{count} runs ended by {kind}" for kind, count in zip(kinds, counts, strict=True)]
    return f"; grey rug: {', '.join(parts)}" if parts else ""


def _entries(
    diagrams: Sequence[Diagram], color: Color, *, stroboscopic: bool = True, of: str = ""
) -> list[Artist]:
    """Return the legend entries of a page: strips, and regimes where they are shown.

    With `stroboscopic` the page shows that section, too, whose points have no regime. `of` says
    of which panels the shares of the regimes are.
    """
    strips = [
        handle
        for named in (plot.chatter_handles, plot.no_impact_handles)
        for diagram in diagrams
        for handle in named(diagram)
    ]
    if color is None:
        return [*_density("points"), *strips] if stroboscopic else strips
    regimes = np.concatenate([np.asarray(diagram.regime) for diagram in diagrams])
    present, counts = np.unique(regimes, return_counts=True)
    handles = plot.regime_handles(present.tolist(), shapes=False)
    for handle, count in zip(handles, counts, strict=True):
        # Some are too rare to be seen.
        share = count / len(regimes)
        text = f"{share:.0%}" if share >= 0.01 else f"{share:.1%}" if share >= 1e-3 else "< 0.1%"
        handle.set_label(f"{handle.get_label()} ({text} of the impacts{of})")
    if stroboscopic:
        handles += _density("right: states once per drive period")
    return [*handles, *strips]


def _density(points: str) -> list[Artist]:
    """Return the legend entry of black points, which are grey where they are few."""
    return [square(BLACK, f"{points}, darker where they are denser")]


def regimes_of(diagrams: Sequence[Diagram]) -> set[int]:
    """Return the regimes of all impacts."""
    return {int(regime) for diagram in diagrams for regime in np.unique(diagram.regime)}

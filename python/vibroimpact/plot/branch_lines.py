"""Lines of branches: how they look, which of them coincide, and their names in a legend.

Mirror images of motions have the same approach velocities, so that their curves coincide. Such a
curve is drawn once and named after both: a dashed line on another one would fill its gaps.
"""

from __future__ import annotations

import string
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any, Final

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.lines import Line2D
from matplotlib.patheffects import Normal, Stroke
from numpy.typing import NDArray

from ..orbits import Branch, Piece
from ..orbits.points import is_on, with_bifurcations
from .branch_views import View
from .style import BLACK, BLUE, VERMILLION, label_text

Array = NDArray[np.float64]

# A test measures how far apart they are, also for colour-blind readers. No grey is among them: that
# is a diagram's.
BRANCH_COLORS: Final = (BLACK, VERMILLION, BLUE, "#44CC66", "#8800EE", "#884444", "#002288")
UNSTABLE: Final = (0.0, (4.0, 1.5))
# Of no branch: darker than the grey of a diagram beneath.
_KEY_GREY = "0.25"
# Widths of stable and unstable lines, and what a hollow line is wider by, in points.
_WIDTHS = {True: 1.2, False: 0.7}
_HOLLOW = 1.4
# A multiplier this close to the unit circle belongs to a bifurcation: the point counts for both
# sides.
_ON_CIRCLE = 1e-6
# Pieces of one label are compared if all points of one lie beside the other, a polyline with steps
# of its own, to this part of their extent: heights as well as moduli of multipliers. They coincide
# if a motion in the middle of one is on the other, or its mirror image.
_NEAR = 2e-2
_LEAST_POINTS = 3
# Heights that differ by this part of their size only do not vary.
_FLAT = 1e-6


@dataclass
class BranchLines:
    """What is drawn of a branch: pieces with their heights, and the number of its look."""

    pieces: list[tuple[Piece, Array]]
    look: int


def lines_of(branches: Sequence[Branch], view: View) -> list[BranchLines]:
    """Return what is drawn of each branch, without pieces that coincide with earlier ones.

    Of two that coincide the longer one is drawn, in place of the first. A branch that has nothing
    of its own has the look of the one with which it coincides; the others are counted.
    """
    found: list[BranchLines] = []
    looks = 0
    for branch in branches:
        lines = BranchLines([], looks)
        shared: list[int] = []
        for piece in with_bifurcations(branch):
            here = (piece, view.heights(piece))
            for other in (*found, lines):
                same = (k for k, known in enumerate(other.pieces) if _same(*here, *known))
                if (place := next(same, None)) is None:
                    continue
                if not _within(*here, *other.pieces[place]):
                    other.pieces[place] = here
                shared.append(other.look)
                break
            else:
                lines.pieces.append(here)
        if lines.pieces or not shared:
            looks += 1
        else:
            lines.look = shared[0]
        found.append(lines)
    return found


def _same(piece: Piece, heights: Array, known: Piece, at: Array) -> bool:
    """Whether one of two pieces lies on the other one."""
    if piece.label != known.label or heights.shape[1:] != at.shape[1:]:
        return False
    if _within(piece, heights, known, at):
        return is_on(piece, len(piece.values) // 2, known)
    if _within(known, at, piece, heights):
        return is_on(known, len(known.values) // 2, piece)
    return False


def _within(piece: Piece, heights: Array, known: Piece, at: Array) -> bool:
    """Whether all points of a piece lie near the lines of another one, with near multipliers."""
    if min(len(known.values), len(piece.values)) < _LEAST_POINTS:
        return False
    line, points = (
        np.column_stack([each.values, np.sort(rows, axis=1), _bounded(each)])
        for each, rows in ((known, at), (piece, heights))
    )
    drawn = 1 + at.shape[1]
    sizes = np.maximum(np.ptp(points, axis=0), _FLAT * np.abs(points).max(axis=0) + 1e-300)
    # Moduli are numbers from 0 to 1 already.
    sizes[drawn:] = 1.0
    line, points = line / sizes, points / sizes
    # At a graze multipliers are rounding, so that those of the ends say nothing.
    return _beside(points[[0, -1], :drawn], line[:, :drawn]) and _beside(points[1:-1], line)


def _beside(points: Array, line: Array) -> bool:
    """Whether all points lie on a polyline."""
    start, along = line[:-1], np.diff(line, axis=0)
    lengths = np.maximum((along**2).sum(axis=1), 1e-300)
    for point in points:
        part = np.clip(((point - start) * along).sum(axis=1) / lengths, 0.0, 1.0)
        off = np.abs(start + part[:, None] * along - point).max(axis=1)
        if not off.min() <= _NEAR:
            return False
    return True


def _bounded(piece: Piece) -> Array:
    """Return the moduli of multipliers as numbers from 0 to 1; they are infinite at a graze."""
    sizes = np.abs(piece.multipliers)
    bounded: Array = np.where(np.isfinite(sizes), sizes / (1.0 + sizes), 1.0)
    return bounded


def line_style(look: int, *, stable: bool = True) -> dict[str, Any]:
    """Return the arguments of a line: colours in turn, solid lines first, then hollow ones."""
    turn, hue = divmod(look, len(BRANCH_COLORS))
    color, width = BRANCH_COLORS[hue], _WIDTHS[stable]
    style: dict[str, Any] = {"color": color, "lw": width, "ls": "-" if stable else UNSTABLE}
    if turn % 2:
        # A white line on a coloured one.
        style["color"] = "white"
        style["path_effects"] = [Stroke(linewidth=width + _HOLLOW, foreground=color), Normal()]
    return style


def draw_lines(ax: Axes, lines: BranchLines, view: View) -> None:
    """Draw the lines of a branch, one collection each for its stable and unstable parts."""
    segments: dict[bool, list[Array]] = {True: [], False: []}
    for piece, heights in lines.pieces:
        for first, last, stable in _stretches(piece):
            part = slice(first, last + 1)
            for column in heights.T:
                line = np.column_stack([view.factor * piece.values[part], column[part]])
                segments[stable] += _unwrapped(line) if view.value == "phase" else [line]
    for stable, parts in segments.items():
        style = line_style(lines.look, stable=stable)
        dashes = style.pop("ls")
        collection = LineCollection(
            parts,
            linestyles=dashes if stable else [dashes],
            zorder=3 if stable else 2.5,
            **style,
        )
        collection.set_gid("stable" if stable else "unstable")
        ax.add_collection(collection)


def _unwrapped(line: Array) -> list[Array]:
    """Cut a line of drive phases where it leaves at one end of the turn and enters at the other."""
    cuts = np.flatnonzero(np.abs(np.diff(line[:, 1])) > np.pi) + 1
    return list(np.split(line, cuts))


def _stretches(piece: Piece) -> list[tuple[int, int, bool]]:
    """Return first and last point of the stretches of one stability, in order."""
    size = np.abs(piece.multipliers).max(axis=1)
    neutral = np.abs(size - 1.0) < _ON_CIRCLE
    calm = piece.stable | neutral
    # Judged by the points in between: two neighbouring bifurcations do not say what is between
    # them.
    stable = calm[1:] & calm[:-1] & ~(neutral[1:] & neutral[:-1])
    starts = np.flatnonzero(np.diff(stable)) + 1
    edges = [0, *starts.tolist(), len(stable)]
    return [(first, last, bool(stable[first])) for first, last in pairwise(edges) if last > first]


def line_handles(
    branches: Sequence[Branch], lines: Sequence[BranchLines] | None, *, names: bool
) -> list[Artist]:
    """Return the legend entries of the lines: branches by name, and stability."""
    stable = np.concatenate([branch.stable for branch in branches])
    looks = [*range(len(branches))] if lines is None else [line.look for line in lines]
    handles: list[Artist] = []
    texts = _texts(branches, looks) if names else []
    if len(texts) > 1:
        for look, text in enumerate(texts):
            handles.append(Line2D([], [], label=text, **line_style(look)))
    # A single branch is named with its stability: two lines that look alike would say nothing.
    color, before = (BRANCH_COLORS[0], f"{texts[0]}, ") if len(texts) == 1 else (_KEY_GREY, "")
    if stable.any():
        handles.append(Line2D([], [], color=color, lw=1.2, label=f"{before}stable"))
    if not stable.all():
        text = f"{before}unstable"
        handles.append(Line2D([], [], color=color, lw=0.7, ls=UNSTABLE, label=text))
    return handles


def _texts(branches: Sequence[Branch], looks: Sequence[int]) -> list[str]:
    """Return the name of each look: of coinciding branches all their names."""
    named: dict[int, dict[str, list[str]]] = {}
    for look, (text, letter) in zip(looks, _names(branches), strict=True):
        named.setdefault(look, {}).setdefault(text, []).append(letter)
    return [
        " and ".join(
            f"{text} ({', '.join(letters)})" if all(letters) else text
            for text, letters in texts.items()
        )
        for _, texts in sorted(named.items())
    ]


def _names(branches: Sequence[Branch]) -> list[tuple[str, str]]:
    """Return what the branches are called: their labels, with letters where these are the same."""
    texts = [
        ", ".join(dict.fromkeys(label_text(piece.label) for piece in branch.pieces))
        for branch in branches
    ]
    letters = {text: iter(string.ascii_lowercase) for text in texts}
    counts = Counter(texts)
    return [(text, next(letters[text], "...") if counts[text] > 1 else "") for text in texts]

"""The sketch of a structure: masses, springs, stops and loads, or the shapes of given modes.

Coordinates stand in a row as if all were displacements along one line. A spring joins two of them
where K has an entry, k = -K_ij, and one joins a coordinate to the frame where its row of K has a
sum other than 0: at the ends of the row beside it, elsewhere above it. A stop is a buffer below a
body and a wall that stands on the frame, or two buffers between neighbours; what meets has the
colour and the number of the stop. A wall that moves stands on wheels. Displacements and gaps are in
one scale, lengths of blocks and springs mean nothing. Gaps and loads are named above the sketch:
beside walls their numbers would lie on each other.
"""

from __future__ import annotations

import math
from collections import Counter
from typing import Any

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.patches import Circle, FancyArrowPatch, Rectangle
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray

from ..arguments import reject, starts
from ..showing import counted
from ..stop import Stop, row_words
from ..structure import Structure
from . import parts
from .style import BLACK, BODY_COLORS, GREEN, ORANGE, STOPS, legend_above, new_axes, several_axes

Array = NDArray[np.float64]

# Blocks and modes that are drawn at most.
_MOST, _MOST_MODES = 12, 4
# Half the width and height of a block, whose neighbours are 1 away.
_HALF, _TALL = 0.2, 0.2
# The largest displacement or gap that is drawn to scale, and how far any is drawn.
_REACH, _FARTHEST = 0.16, 0.22
# Heights: of the springs between neighbours and to the frame, of drive and constant load.
_BESIDE, _ABOVE, _DRIVE, _LOAD = 0.09, 0.38, -0.13, 0.13
# How far the frame is from a block at an end of the row, and from the post above one.
_END, _POST = 0.75, 0.45
# Of the first stop under a block, of each one more, and of buffers between neighbours.
_FIRST, _NEXT, _BETWEEN = -0.42, -0.66, -0.1
# Half the size of a buffer; the width and height of a wall, and the foot on which it stands.
_BUFFER, _WALL, _WALL_TALL, _FOOT = 0.06, 0.06, 0.2, 0.13
# The radius of a wheel under a wall that moves.
_WHEEL = 0.03
# The height of a line of what is named above the sketch, in inches.
_LINE = 0.16
# Marks of loads in the legend, and how thick marks are drawn there.
_BOTH_WAYS, _ONE_WAY = r"$\leftrightarrow$", r"$\rightarrow$"
_MEW = {"|": 1.8, _BOTH_WAYS: 0.3, _ONE_WAY: 0.3}
# An entry of K below this part of the largest of its row is rounding.
_NO_SPRING = 1e-12
_LOADS: dict[str, Any] = {"lw": 1.4, "mutation_scale": 10}
_HEADS = "<|-|>,head_length=0.4,head_width=0.18"
_TO_AND_FRO: dict[str, Any] = {**_LOADS, "arrowstyle": _HEADS}


def structure_machine(structure: Structure, q: Array, phase: float | None, ax: Axes | None) -> Axes:
    """Draw a structure at coordinates (N,); at a phase with the forces of its drive."""
    if structure.mass is None:
        ax = new_axes(ax)
        _Shapes(ax, structure)
        return ax
    # An inch for each block; what is named above them is in two columns.
    names = _LINE * (2 + len(structure.stops)) / 2
    under = _TALL - _NEXT * (_levels(structure) - 1)
    inches = (0.6 + max(4, min(structure.coordinates, _MOST)), 1.8 + under + names)
    (ax,) = several_axes(None if ax is None else [ax], 1, inches)
    _Row(ax, structure, q, phase)
    return ax


class _Row:
    """A structure of matrices."""

    def __init__(self, ax: Axes, structure: Structure, q: Array, phase: float | None) -> None:
        self._ax, self._structure, self._q = ax, structure, q
        count = structure.coordinates
        order = np.argsort([not self._is_met(i) for i in range(count)], kind="stable")
        self._drawn = sorted(order[:_MOST].tolist())
        self._x = {i: float(place) for place, i in enumerate(self._drawn)}
        self._unit = self._scale()
        self._lowest, self._highest = _FIRST, _ABOVE + 0.13
        self._said: list[str] = []
        self._left_out = 0
        self._pegs: set[tuple[int, float]] = set()
        self._named: list[Artist] = []
        ax.set_axis_off()
        # Where the legend is put, there the axes end, whatever of their place the sketch needs.
        ax.set_aspect("equal", anchor="NW")
        self._springs()
        for i in self._drawn:
            corner = (self._at(i) - _HALF, -_TALL)
            look: dict[str, Any] = {"fc": parts.BODY, "ec": BLACK, "lw": 1.1, "zorder": 2}
            ax.add_patch(Rectangle(corner, 2 * _HALF, 2 * _TALL, **look))
            ax.text(self._at(i), 0.0, f"$q_{{{i}}}$", ha="center", va="center", zorder=3)
        self._stops()
        self._loads(phase)
        if more := count - len(self._drawn):
            on_them = f", with {counted(self._left_out, 'stop')}" if self._left_out else ""
            self._said.append(f"and {counted(more, 'coordinate')} more{on_them}")
        self._words()
        legend_above(ax, self._named, columns=4, fontsize=7)

    def _is_met(self, i: int) -> bool:
        return any(stop.normal[i] != 0.0 for stop in self._structure.stops)

    def _scale(self) -> float:
        """Return the length that is drawn for a displacement of 1."""
        gaps = [abs(_gap(stop)) for stop in self._structure.stops]
        near = [gap for gap in gaps if gap > 0.0]
        # A stop far away would hide the gaps of the others.
        sizes = [*(gap for gap in near if gap <= 10.0 * min(near)), *np.abs(self._q).tolist()]
        largest = max(sizes, default=0.0)
        return _REACH / largest if largest > 0.0 else 1.0

    def _at(self, i: int) -> float:
        """Return where the block of a coordinate is."""
        return self._x[i] + _limited(self._unit * float(self._q[i]))

    def _springs(self) -> None:
        stiffness = np.asarray(self._structure.stiffness)
        for place, i in enumerate(self._drawn):
            least = _NO_SPRING * float(np.abs(stiffness[i]).max())
            own = float(stiffness[i].sum())
            if abs(own) > least:
                self._to_the_frame(place, i)
            for other, j in enumerate(self._drawn[place + 1 :], place + 1):
                if abs(stiffness[i, j]) <= least:
                    continue
                if other == place + 1:
                    ends = (self._at(i) + _HALF, _BESIDE), (self._at(j) - _HALF, _BESIDE)
                    self._spring(*ends)
                else:
                    self._far_spring(i, j)

    def _to_the_frame(self, place: int, i: int) -> None:
        """Draw the spring of one coordinate alone, along the line of motion as the others."""
        side = -1.0 if place == 0 else 1.0
        if place in (0, len(self._drawn) - 1):
            frame, y, end = self._x[i] + side * _END, _BESIDE, self._at(i) + side * _HALF
        else:
            frame, y, end = self._x[i] - _POST, _ABOVE, self._at(i)
            self._ax.plot((end, end), (_TALL, y), color=BLACK, lw=1.6, zorder=1)
        self._spring((frame, y), (end, y))
        ends = (frame, y - 0.13), (frame, y + 0.13)
        # Hatched on the side away from the block.
        parts.fixed(self._ax, *(ends if frame < end else ends[::-1]))

    def _spring(self, start: parts.Point, end: parts.Point) -> None:
        """Draw a spring between two points."""
        along = np.array(end) - np.array(start)
        length = math.hypot(*along.tolist())
        if length == 0.0:
            return
        teeth, lead = 9, 0.15
        across = np.array([-along[1], along[0]]) * (0.045 / length)
        part = np.r_[0.0, np.linspace(lead, 1.0 - lead, teeth + 1), 1.0]
        side = np.r_[0.0, 0.0, np.resize([1.0, -1.0], teeth - 1), 0.0, 0.0]
        path = np.array(start) + part[:, None] * along + side[:, None] * across
        (line,) = self._ax.plot(*path.T, color=BLACK, lw=1.0, solid_joinstyle="round", zorder=1)
        line.set_gid("spring")

    def _far_spring(self, i: int, j: int) -> None:
        """Draw a spring between bodies that are no neighbours, as an arc above the others."""
        self._highest = max(self._highest, _TALL + 0.6)
        bend = -min(0.5, 0.9 / (self._x[j] - self._x[i]))
        arc = FancyArrowPatch(
            (self._at(i) + 0.6 * _HALF, _TALL),
            (self._at(j) - 0.6 * _HALF, _TALL),
            arrowstyle="-",
            connectionstyle=f"arc3,rad={bend}",
            color=parts.FRAME,
            lw=1.0,
            shrinkA=0,
            shrinkB=0,
            gid="spring",
        )
        self._ax.add_patch(arc)

    def _loads(self, phase: float | None) -> None:
        """Draw the drive of each coordinate, to and fro or at a phase, and its constant load."""
        structure = self._structure
        drive = np.asarray(structure.drive_amplitude)
        largest = float(np.abs(drive).max(initial=0.0))
        if any(drive[i] != 0.0 for i in self._drawn):
            at = "" if phase is None else " at this phase"
            self._named.append(
                _entry(f"drive{at}", GREEN, _BOTH_WAYS if phase is None else _ONE_WAY)
            )
        if any(structure.static_load[i] != 0.0 for i in self._drawn):
            self._named.append(_entry("constant load", ORANGE, _ONE_WAY))
        for i in self._drawn:
            x = self._at(i)
            if drive[i] != 0.0 and phase is None:
                parts.arrow(self._ax, (x - 0.16, _DRIVE), (x + 0.16, _DRIVE), GREEN, **_TO_AND_FRO)
            elif drive[i] != 0.0 and phase is not None:
                force = float((drive[i] * complex(math.cos(phase), math.sin(phase))).real)
                if abs(force) > 0.02 * largest:
                    end = (x + 0.3 * force / largest, _DRIVE)
                    parts.arrow(self._ax, (x, _DRIVE), end, GREEN, **_LOADS)
            load = float(structure.static_load[i])
            if load != 0.0:
                end = (x + math.copysign(0.26, load), _LOAD)
                parts.arrow(self._ax, (x, _LOAD), end, ORANGE, **_LOADS)

    def _stops(self) -> None:
        """Draw each stop, or say what it is where it is neither a wall nor between neighbours."""
        levels: dict[tuple[int, bool], int] = {}
        for number, stop in enumerate(self._structure.stops):
            met = np.flatnonzero(stop.normal).tolist()
            if any(i not in self._x for i in met):
                self._left_out += 1
            elif len(met) == 1:
                right = bool(stop.normal[met[0]] > 0.0)
                level = levels.setdefault((met[0], right), 0)
                levels[met[0], right] += 1
                self._wall(number, stop, met[0], right, _FIRST + _NEXT * level)
            elif self._are_neighbours(stop, met):
                self._buffers(number, stop, met[0], met[1])
            else:
                words = f"stop {number}: {row_words(stop.normal)} = {stop.gap:.3g} at contact"
                self._said.append(words)

    def _are_neighbours(self, stop: Stop, met: list[int]) -> bool:
        """Whether a stop is met as the first of two bodies comes nearer to the next one."""
        if len(met) != 2 or self._x[met[1]] - self._x[met[0]] != 1.0:
            return False
        return bool(stop.normal[met[0]] > 0.0 > stop.normal[met[1]])

    def _wall(self, number: int, stop: Stop, i: int, right: bool, y: float) -> None:
        """Draw a buffer under a block, and the wall that it meets."""
        ax, side = self._ax, 1.0 if right else -1.0
        color = STOPS[number % len(STOPS)][0]
        x = self._at(i)
        if (i, y) not in self._pegs:
            self._pegs.add((i, y))
            ax.plot((x, x), (-_TALL, y), color=BLACK, lw=1.6, zorder=1)
            self._buffer(x, y, "peg")
        struck = x + side * _BUFFER
        ax.plot((struck, struck), (y - _BUFFER, y + _BUFFER), color=color, lw=1.8, zorder=3)
        away = _limited(self._unit * max(_gap(stop) - side * float(self._q[i]), 0.0), far=0.3)
        face = struck + side * away
        bottom = y - 0.5 * _WALL_TALL
        left = face if right else face - _WALL
        # A wall and its foot, which is fixed, or on wheels.
        solid: dict[str, Any] = {"fc": parts.GHOST, "ec": parts.FRAME, "lw": 0.8, "zorder": 1}
        floor = bottom - _FOOT
        foot = floor if stop.amplitude == 0.0 else floor + 2.0 * _WHEEL
        ax.add_patch(Rectangle((left, foot), _WALL, bottom + _WALL_TALL - foot, **solid))
        if stop.amplitude != 0.0:
            for place in (left, left + _WALL):
                centre = (place, floor + _WHEEL)
                ax.add_patch(Circle(centre, _WHEEL, gid="wheel", fc="white", ec=BLACK, lw=0.8))
        parts.fixed(ax, (left + _WALL + 0.06, floor), (left - 0.06, floor))
        (line,) = ax.plot(
            (face, face), (bottom, bottom + _WALL_TALL), color=color, lw=1.8, zorder=3
        )
        line.set_gid(f"stop-{number}")
        if stop.amplitude != 0.0:
            self._moves(face, bottom + _WALL_TALL + 0.05, color)
        self._name(number, stop, (face + side * 0.5 * _WALL, floor - 0.07))
        self._lowest = min(self._lowest, y)

    def _moves(self, x: float, y: float, color: str) -> None:
        """Draw that a stop moves to and fro, around a point."""
        look = {**_TO_AND_FRO, "lw": 1.0, "mutation_scale": 8}
        parts.arrow(self._ax, (x - 0.09, y), (x + 0.09, y), color, **look)

    def _buffer(self, x: float, y: float, gid: str) -> None:
        """Draw a buffer around its centre."""
        corner = (x - _BUFFER, y - _BUFFER)
        look: dict[str, Any] = {"fc": parts.BODY, "ec": BLACK, "lw": 1.0, "zorder": 2}
        self._ax.add_patch(Rectangle(corner, 2 * _BUFFER, 2 * _BUFFER, gid=gid, **look))

    def _buffers(self, number: int, stop: Stop, i: int, j: int) -> None:
        """Draw the buffers of two neighbours that meet."""
        ax, color = self._ax, STOPS[number % len(STOPS)][0]
        left, right = self._at(i) + _HALF, self._at(j) - _HALF
        away = self._unit * max(_gap(stop) - float(stop.normal @ self._q) / _size(stop), 0.0)
        away = min(_limited(away, far=0.3), right - left)
        middle = 0.5 * (left + right)
        for start, side in ((left, -1.0), (right, 1.0)):
            face = middle + side * 0.5 * away
            ax.plot((start, face), (_BETWEEN, _BETWEEN), color=BLACK, lw=1.6, zorder=1)
            self._buffer(face + side * _BUFFER, _BETWEEN, "buffer")
            ends = (_BETWEEN - _BUFFER, _BETWEEN + _BUFFER)
            (line,) = ax.plot((face, face), ends, color=color, lw=1.8, zorder=3)
            line.set_gid(f"stop-{number}")
        if stop.amplitude != 0.0:
            self._moves(middle, _BETWEEN + _BUFFER + 0.05, color)
        self._name(number, stop, (middle, _BETWEEN - 0.1))

    def _name(self, number: int, stop: Stop, place: parts.Point) -> None:
        """Write the number of a stop below it, and above the sketch what it is."""
        words = f"stop {number}: gap {stop.gap:.3g}"
        if _size(stop) != 1.0:
            words += f", met at {_gap(stop):.3g}"
        if stop.amplitude != 0.0:
            words += f", moves by \N{PLUS-MINUS SIGN}{abs(stop.amplitude):.3g}"
        color = STOPS[number % len(STOPS)][0]
        self._named.append(_entry(words.replace("-", "\N{MINUS SIGN}"), color, "|"))
        look: dict[str, Any] = {"ha": "center", "va": "top", "fontsize": 7, "color": color}
        self._ax.text(*place, str(number), weight="bold", **look)

    def _words(self) -> None:
        """Say what is not drawn, and set the limits of the picture."""
        left, right = -_END - 0.1, len(self._drawn) - 1.0 + _END + 0.1
        bottom = self._lowest - 0.5
        if np.any(self._structure.damping) or np.any(self._structure.damping_ratios):
            self._said.append("damping is not drawn")
        for words in self._said[:_MOST]:
            self._ax.text(left + 0.1, bottom, words, fontsize=7, color="0.3", va="top")
            bottom -= 0.14
        self._ax.set_xlim(left, right)
        self._ax.set_ylim(bottom, self._highest + 0.1)


def _entry(words: str, color: str, marker: str) -> Artist:
    """Return an entry of the legend."""
    return Line2D(
        [], [], ls="none", color=color, marker=marker, ms=9.0, mew=_MEW[marker], label=words
    )


class _Shapes:
    """A structure of modes: the shapes of the first ones, and where its stops act."""

    def __init__(self, ax: Axes, structure: Structure) -> None:
        places = np.arange(structure.coordinates)
        ax.axhline(0.0, color="0.8", lw=0.6, zorder=0)
        for mode, frequency in enumerate(structure.frequencies[:_MOST_MODES].tolist()):
            shape = structure.shapes[:, mode]
            largest = float(np.abs(shape).max()) or 1.0
            ax.plot(
                places,
                shape / largest,
                color=BODY_COLORS[1 + mode % 2],
                lw=(1.2, 1.6)[mode % 2],
                ls=("-", (0, (5, 2)))[mode // 2],
                marker=".",
                label=rf"mode {mode}, $\omega$ = {frequency:.4g}",
            )
        for number, stop in enumerate(structure.stops):
            color, marker = STOPS[number % len(STOPS)]
            met = np.flatnonzero(stop.normal)
            # A stop above a coordinate is met as that grows.
            heights = 1.25 * np.sign(stop.normal[met])
            ax.plot(
                met,
                heights,
                ls="none",
                color=color,
                marker=marker,
                label=f"stop {number}: {row_words(stop.normal)}",
                gid=f"stop-{number}",
            )
        driven = np.flatnonzero(structure.drive_amplitude)
        if len(driven):
            look: dict[str, Any] = {"ls": "none", "color": GREEN, "marker": "x", "zorder": 4}
            ax.plot(driven, np.zeros(len(driven)), label="driven", **look)
        ax.set_ylim(-1.45, 1.45)
        ax.xaxis.set_major_locator(MaxNLocator(integer=True))
        ax.set_xlabel("coordinate")
        ax.set_ylabel("mode shape, largest 1")
        handles, _ = ax.get_legend_handles_labels()
        legend_above(ax, handles, columns=3)


def _levels(structure: Structure) -> int:
    """Return how many stops are below each other, at least 1."""
    sides = Counter(
        (int(met[0]), bool(stop.normal[met[0]] > 0.0))
        for stop in structure.stops
        if len(met := np.flatnonzero(stop.normal)) == 1
    )
    return max(sides.values(), default=1)


def _size(stop: Stop) -> float:
    """Return the size of a normal of one coordinate, or of two."""
    return float(np.abs(stop.normal).max())


def _gap(stop: Stop) -> float:
    """Return the gap as a displacement."""
    return stop.gap / _size(stop)


def _limited(length: float, far: float = _FARTHEST) -> float:
    """Return a length, or the largest that is drawn."""
    return math.copysign(min(abs(length), far), length)


def positions_of(structure: Structure, state: Any) -> Array:
    """Return the coordinates of a state, whose rows are q and v.

    Raises
    ------
    StateError
        For another shape, or numbers that are not finite.
    ParameterError
        For several states.
    """
    states = starts(state, structure.coordinates, "state")
    if states.ndim != 2:
        reject("state", state, f"one state, rows q and v of shape (2, {structure.coordinates})")
    q: Array = states[0]
    return q

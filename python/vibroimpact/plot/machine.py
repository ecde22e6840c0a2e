"""The machine in a state: pendulum and mass, or two masses on one line, as seen from above.

Oblique contact is drawn to scale, with the pendulum's length as unit and the pivot as origin. In
direct contact both bodies move on one line; there the way that they need has the length 1. A wall
(mass_ratio = 0) is a plate. In an impact arrows show the impulses on body 1, in sustained contact
the tip has the colour of the bands in a time history. The arrows of constant loads have another
colour than those of the drive, and always the same length.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Circle, Rectangle
from numpy.typing import NDArray

from ..arguments import naming, number, state
from ..structure import Structure
from ..system import System
from . import parts
from .given import expected
from .marks import Mode
from .structure_machine import positions_of, structure_machine
from .style import (
    BLACK,
    GREEN,
    ORANGE,
    REGIME_STYLES,
    SLIDE_STYLE,
    STICK_STYLE,
    VERMILLION,
    new_axes,
)

Array = NDArray[np.float64]

# Sizes in the unit of the picture.
_WIDTH, _PLATE, _SPRING, _TOP = 0.48, 0.1, 0.6, 0.24
_LOW, _HIGH = -1.13, -0.53
# Lengths of the arrows of the largest impulse and of the drive.
_IMPULSE, _DRIVE = 0.55, 0.3
# A drive smaller than this part of its amplitude has no arrow.
_NO_DRIVE = 0.12
_ARC_RADIUS, _INNER_RADIUS, _ARC_TURN = 0.31, 0.22, math.radians(75)
_LOAD_LOOK: dict[str, Any] = {"lw": 1.4, "mutation_scale": 9}
_CONTACT = {"slide": SLIDE_STYLE, "stick": STICK_STYLE}


class Hit(NamedTuple):
    """An impact: where, impulses as parts of the largest, regime, age from 0 to 1, and when."""

    x1: float
    normal: float
    tangential: float
    regime: int
    age: float
    time: float


@naming
def machine(
    system: System | Structure,
    state: Any,
    *,
    phase: float | None = None,
    ax: Axes | None = None,
) -> Axes:
    """Draw the machine in one state, as seen from above; a structure as a sketch.

    Of a structure a block is a coordinate, and a spring an entry of its stiffness: between two
    coordinates, as an arc where they are no neighbours, and to the frame where a row of the
    stiffness has a sum. A stop is a wall that the peg of a block meets, or two plates, with its gap
    in the unit of the coordinates; what is neither is told in words. Dampers are not drawn. Without
    a phase a double arrow is a coordinate that is driven. Of a structure from modes there are the
    shapes of the first four, with the coordinates on which stops act, above where the normal is
    positive.

    Parameters
    ----------
    system : System or Structure
        The system; a wall (mass_ratio = 0) is drawn as a plate.
    state : (x1, v1, x2, v2)
        The state; only the positions are drawn. Of a structure rows q and v, (2, N).
    phase : float, optional
        Phase of the drive in radians; arrows show its moment and force then. Those of the constant
        loads are always shown.
    ax : matplotlib.axes.Axes, optional
        Where to draw; a new figure if None. Its axes are switched off.

    Returns
    -------
    matplotlib.axes.Axes

    Raises
    ------
    ParameterError, StateError
        If an argument is of the wrong kind or not finite.

    Examples
    --------
    >>> import vibroimpact as vi
    >>> system = vi.System(mass_ratio=0.6, frequency_ratio=2, restitution=0.8, gap=0.5,
    ...                    drive_frequency=1.8, moment_amplitude=1)
    >>> vi.plot.machine(system, (0.1, 0, 0.2, 0)).get_aspect()
    1.0
    """
    turned = None if phase is None else number("phase", phase)
    if isinstance(system, Structure):
        return structure_machine(system, positions_of(system, state), turned, ax)
    system = expected("system", system, System)
    rows = np.array([_state(state, "state")])
    ax = new_axes(ax)
    Stage(ax, system, rows, rows[:0]).show(rows[0], phase=turned)
    return ax


_state = state


class Stage:
    """A machine on its axes: what stands still is drawn once, the rest for every state.

    Parameters
    ----------
    ax
        Where to draw.
    system
        The system.
    states, contacts
        The states that will be shown, and those at impacts: the room that the motion needs.
    """

    def __init__(self, ax: Axes, system: System, states: Array, contacts: Array) -> None:
        self._ax, self._system = ax, system
        self._oblique = system.contact == "oblique"
        self._moving: parts.Drawn = []
        faces = states[:, 2] + system.gap
        self._origin, self._unit = 0.0, 1.0
        self._bottom, self._top = _LOW, _HIGH
        if self._oblique:
            if len(contacts):
                highest = float((-np.cos(contacts[:, 0])).max()) + 0.12
                self._top = max(_HIGH, highest)
        else:
            low = min(float(states[:, 0].min()), float(faces.min()))
            high = max(float(states[:, 0].max()), float(faces.max()))
            self._origin, self._unit = low, (high - low) or 1.0
        self._faces = self._place(np.array([faces.min(), faces.max()]))
        self._plate = system.is_wall
        self._right = self._faces[1] + (_PLATE if self._plate else _WIDTH + _SPRING)
        self._still(states)

    def _place(self, x: Any) -> Any:
        """Return where a position along the contact normal is drawn: the face of body 2."""
        if self._oblique:
            return x + parts.BALL
        return (x - self._origin) / self._unit

    def _still(self, states: Array) -> None:
        """Draw what does not move, and set the limits of the picture."""
        ax, system = self._ax, self._system
        ax.set_axis_off()
        ax.set_aspect("equal")
        if self._oblique:
            if system.frequency_ratio > 0.0:
                parts.torsion_spring(ax, _TOP)
            if system.pendulum_damping > 0.0:
                parts.torsion_damper(ax, _TOP)
            parts.bearing(ax, _TOP, -0.42, 0.3)
            tips = np.sin(states[:, 0])
            left = min(-0.5, float(tips.min()) - 0.1)
            top = max(_TOP + 0.08, float((-np.cos(states[:, 0])).max()) + 0.1, self._top + 0.2)
        else:
            left = -_WIDTH - _SPRING
            if system.frequency_ratio > 0.0:
                parts.fixed(ax, (left, self._bottom), (left, self._top))
            parts.guides(ax, left + 0.05, 1.0, self._bottom, self._top)
            left, top = left - 0.1, self._top + 0.35
        right = float(self._right) + 0.1
        if not self._plate:
            wall = float(self._right)
            parts.fixed(ax, (wall, self._top), (wall, self._bottom))
            first = float(self._faces[0]) + (0.0 if self._oblique else 0.05)
            if self._oblique:
                end = float(self._faces[1]) + _WIDTH
                parts.guides(ax, first, end, self._bottom, self._top)
            else:
                parts.guides(ax, 1.0, wall - 0.05, self._bottom, self._top)
        ax.set_xlim(left, max(right, 0.4))
        ax.set_ylim(self._bottom - 0.15, top)

    def show(
        self,
        state: Array,
        *,
        phase: float | None = None,
        mode: Mode | None = None,
        hit: Hit | None = None,
    ) -> None:
        """Draw a state in place of the one before."""
        for artist in self._moving:
            artist.remove()
        x1, _, x2, _ = state.tolist()
        face = float(self._place(x2 + self._system.gap))
        style = _CONTACT.get(mode or "")
        self._moving = [
            *self._second(face),
            *self._first(x1, style.color if style else BLACK),
            *self._constant(face, self._tip(x1)),
        ]
        if phase is not None:
            self._moving += self._drive(face, self._tip(x1), math.cos(phase))
        if hit is not None:
            self._moving += self._impact(self._tip(hit.x1), hit)

    @property
    def moving(self) -> parts.Drawn:
        """What the last `show` has drawn."""
        return [*self._moving]

    def _tip(self, x1: float) -> parts.Point:
        """Return the point of body 1 that strikes."""
        if self._oblique:
            return math.sin(x1), -math.cos(x1)
        return float(self._place(x1)), 0.5 * (self._bottom + self._top)

    def _first(self, x1: float, color: str) -> parts.Drawn:
        """Draw body 1, what strikes in a colour."""
        ax, system = self._ax, self._system
        if self._oblique:
            pivot = Circle((0.0, 0.0), parts.PIVOT, fc="white", ec=BLACK, lw=1.0, zorder=5)
            return [*parts.rod(ax, x1, BLACK, tip_color=color), ax.add_patch(pivot)]
        place, height = float(self._place(x1)), self._top - self._bottom
        corner = (place - _WIDTH, self._bottom)
        drawn = parts.block(ax, corner, _WIDTH, height)
        if color != BLACK:
            drawn += ax.plot(
                (place, place), (self._bottom, self._top), color=color, lw=4.0, zorder=4
            )
        wall = -_WIDTH - _SPRING
        if system.frequency_ratio > 0.0:
            drawn += parts.spring(ax, wall, corner[0], self._bottom + 0.7 * height)
        if system.pendulum_damping > 0.0:
            middle = self._bottom + 0.3 * height
            drawn += parts.damper(ax, wall, corner[0], middle)
        return drawn

    def _second(self, face: float) -> parts.Drawn:
        """Draw body 2 with its face."""
        ax, height = self._ax, self._top - self._bottom
        if self._plate:
            plate = Rectangle(
                (face, self._bottom - 0.1),
                _PLATE,
                height + 0.2,
                fc=parts.GHOST,
                ec=parts.FRAME,
                hatch="////",
                lw=1.1,
                zorder=1,
            )
            return [ax.add_patch(plate)]
        drawn = parts.block(ax, (face, self._bottom), _WIDTH, height)
        right, wall = face + _WIDTH, float(self._right)
        drawn += parts.spring(ax, right, wall, self._bottom + 0.65 * height)
        if self._system.oscillator_damping > 0.0:
            middle = self._bottom + 0.25 * height
            drawn += parts.damper(ax, right, wall, middle)
        return drawn

    def _drive(self, face: float, tip: parts.Point, drive: float) -> parts.Drawn:
        """Draw moment and force of the drive, as long as they are large at this instant."""
        if abs(drive) < _NO_DRIVE:
            return []
        system = self._system
        drawn: parts.Drawn = []
        if system.moment_amplitude != 0.0:
            sense = math.copysign(1.0, system.moment_amplitude) * drive
            drawn += self._moment(tip, sense, _ARC_RADIUS, 0.2, GREEN)
        if system.force_amplitude != 0.0 and not self._plate:
            sense = math.copysign(1.0, system.force_amplitude) * drive
            drawn += self._force(face, sense, 0.14, GREEN)
        return drawn

    def _constant(self, face: float, tip: parts.Point) -> parts.Drawn:
        """Draw the constant moment and force."""
        system = self._system
        drawn: parts.Drawn = []
        if system.static_moment != 0.0:
            sense = math.copysign(1.0, system.static_moment)
            drawn += self._moment(tip, sense, _INNER_RADIUS, 0.28, ORANGE)
        if system.static_force != 0.0 and not self._plate:
            drawn += self._force(face, math.copysign(1.0, system.static_force), 0.22, ORANGE)
        return drawn

    def _moment(
        self, tip: parts.Point, sense: float, radius: float, height: float, color: str
    ) -> parts.Drawn:
        """Draw a moment about the pivot, or a force on body 1 at a height above it."""
        ax = self._ax
        if not self._oblique:
            start = (tip[0] - 0.5 * _WIDTH, self._top + height)
            end = (start[0] + _DRIVE * sense, start[1])
            return parts.arrow(ax, start, end, color, **_LOAD_LOOK)
        turn = np.linspace(0.0, _ARC_TURN * sense, 40) - math.pi / 2
        x, y = radius * np.cos(turn), radius * np.sin(turn)
        drawn: parts.Drawn = [*ax.plot(x[:-4], y[:-4], color=color, lw=1.4, zorder=2)]
        return drawn + parts.arrow(ax, (x[-6], y[-6]), (x[-1], y[-1]), color, **_LOAD_LOOK)

    def _force(self, face: float, sense: float, height: float, color: str) -> parts.Drawn:
        """Draw a force on body 2 at a height above it."""
        start = (face + 0.5 * _WIDTH, self._top + height)
        end = (start[0] + _DRIVE * sense, start[1])
        return parts.arrow(self._ax, start, end, color, **_LOAD_LOOK)

    def _impact(self, tip: parts.Point, hit: Hit) -> parts.Drawn:
        """Draw the impulses on body 1 and the mark of the regime, paler the older they are."""
        ax, alpha = self._ax, 1.0 - 0.75 * hit.age
        style = REGIME_STYLES[hit.regime]
        mark: dict[str, Any] = {"markersize": 9.0, "markeredgewidth": 0.0, "zorder": 9}
        drawn: parts.Drawn = [
            *ax.plot(*tip, marker=style.marker, color=style.color, alpha=alpha, **mark)
        ]
        ends = (
            (tip[0] - _IMPULSE * hit.normal, tip[1]),
            (tip[0], tip[1] + _IMPULSE * hit.tangential),
        )
        for end in ends:
            if math.dist(tip, end) > 0.05:
                look: dict[str, Any] = {"lw": 2.0, "mutation_scale": 11, "alpha": alpha}
                drawn += parts.arrow(ax, tip, end, VERMILLION, **look)
        return drawn

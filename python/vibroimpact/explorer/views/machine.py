"""The machine, drawn and moving: contact, slip and the impulses of impacts are visible.

Lengths are to scale in oblique contact: pivot at the origin, the pendulum's length as the unit. In
direct contact body 1 moves along the line of the impacts.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from bokeh.models import ColumnDataSource, DataRange1d, Label
from numpy.typing import NDArray

from ...plot.style import BLACK
from ...run import EventKind
from ..machine import Machine, Motion
from ..theme import Palette
from . import parts
from .columns import Sources
from .drawing import FADE, Drawing, small

Array = NDArray[np.float64]

# Length of the arrow of the largest impulse on the film.
_LONGEST = 0.4
_ZIGZAG = 17
# What the drawing says of a frame, by a code that the film has: nothing, a sustained contact, the
# regime of an impact.
_FIRST_REGIME = 3
_WORDS = (
    "",
    "contact, sliding",
    "contact, sticking",
    "impact: frictionless",
    "impact: slip",
    "impact: slip reverses in approach",
    "impact: slip reverses in restitution",
    "impact: sticks in approach",
    "impact: sticks in restitution",
)
_CONTACT = {EventKind.SLIDE_POSITIVE: 1, EventKind.SLIDE_NEGATIVE: 1, EventKind.STICK: 2}
_SCENE = ("value", "x", "y", "x0", "y0", "x1", "y1")
# The columns of a source are equally long; the longest of the scene has its six lengths.
_ROWS = 6
_NO_HIT = {
    **dict.fromkeys(("x0", "y0", "x1", "y1"), (0.0, 0.0)),
    "color": (BLACK, BLACK),
}

_DRAW = """
  const [d, w, to, middle, bottom, top] = scene.data.value
  put(rod, {x: [f.pivot_x[i], f.tip_x[i]], y: [0, f.tip_y[i]]})
  put(bob, {x: [f.tip_x[i]], y: [f.tip_y[i]]})
  const from = f.face[i] + w
  const alpha = 0.25 + 0.6 * f.touch[i]
  put(body, {left: [f.face[i]], right: [from], bottom: [bottom], top: [top], alpha: [alpha]})
  const xs = [], ys = []
  for (let k = 0; k < zigzag; k++) {
    const inside = k > 1 && k < zigzag - 2
    xs.push(from + (to - from) * k / (zigzag - 1))
    ys.push(middle + (inside ? 0.06 * d * (k % 2 ? 1 : -1) : 0))
  }
  put(spring, {x: xs, y: ys})
  const s = f.flash[i]
  const x = s > 0 ? f.hit_x[i] : NaN, y = s > 0 ? f.hit_y[i] : NaN
  const color = playing.tags[Math.max(f.says[i] - first, 0)]
  const left = x - s * f.normal[i], up = y + s * f.tangent[i]
  put(hit, {x0: [x, x], y0: [y, y], x1: [left, x], y1: [y, up], color: [color, color]})
  put(ring, {x: [x], y: [y], size: [s > 0 ? 8 + 34 * (1 - s) : 0], alpha: [s], color: [color]})
  if (says.text != words[f.says[i]]) says.text = words[f.says[i]]
"""


class MachineView(Drawing):
    """The drawing of both bodies."""

    script = _DRAW

    def __init__(self, machine: Machine, sources: Sources) -> None:
        super().__init__(machine, sources)
        source = ColumnDataSource
        # Lengths of the drawing, corners of what has to be seen, and what does not move.
        self._scene = source(data=dict.fromkeys(_SCENE, [np.nan] * _ROWS), name="scene")
        self._rod = source(data={"x": [0.0, 0.0], "y": [0.0, -1.0]}, name="rod")
        self._bob = source(data={"x": [0.0], "y": [-1.0]})
        self._body = source(
            data={"left": [0.5], "right": [0.9], "bottom": [-1.0], "top": [0.0], "alpha": [0.25]}
        )
        self._spring = source(data={"x": [0.0] * _ZIGZAG, "y": [0.0] * _ZIGZAG})
        self._hit = source(data={name: [*values] for name, values in _NO_HIT.items()})
        self._ring = source(
            data={"x": [0.0], "y": [0.0], "size": [0.0], "alpha": [0.0], "color": [BLACK]}
        )
        self._draw()

    def _draw(self) -> None:
        self.figure = parts.plain(
            "machine", match_aspect=True, x_range=DataRange1d(), y_range=DataRange1d()
        )
        self.figure.axis.visible = False
        self.figure.grid.visible = False
        extent = self.figure.scatter("x", "y", source=self._scene, size=1, alpha=0.0)
        for axis in (self.figure.x_range, self.figure.y_range):
            axis.renderers = [extent]
        self._lines = [
            self.figure.segment("x0", "y0", "x1", "y1", source=self._scene, line_width=3),
            self.figure.line("x", "y", source=self._spring, line_width=1.4),
        ]
        self._block = self.figure.quad(
            "left", "right", "top", "bottom", source=self._body, fill_alpha="alpha", line_width=1.5
        )
        self._arm = self.figure.line("x", "y", source=self._rod, line_width=4, line_cap="round")
        self._tip = self.figure.scatter("x", "y", source=self._bob, size=14, line_color=None)
        self._impulses = self.figure.segment(
            *("x0", "y0", "x1", "y1"),
            source=self._hit,
            line_color="color",
            line_width=3.5,
            line_cap="round",
        )
        self._wave = self.figure.scatter(
            *("x", "y"),
            size="size",
            source=self._ring,
            line_color="color",
            line_width=2,
            fill_color=None,
        )
        self._wave.glyph.line_alpha = "alpha"
        self.says = Label(x=8, y=6, x_units="screen", y_units="screen", text="", name="says")
        self.says.text_font_size = "13px"
        self.figure.add_layout(self.says)

    def models(self) -> dict[str, Any]:
        """Return what moves, and what is said."""
        return {
            "scene": self._scene,
            "rod": self._rod,
            "bob": self._bob,
            "body": self._body,
            "spring": self._spring,
            "hit": self._hit,
            "ring": self._ring,
            "says": self.says,
            "zigzag": _ZIGZAG,
            "first": _FIRST_REGIME,
            "words": _WORDS,
        }

    def show(self, motion: Motion, palette: Palette) -> None:
        """Draw the machine of a motion, and give the page its film.

        The film comes last: with it the page moves what it has, in this view and in others.
        """
        film, scene, extent = _film(motion)
        still = not np.ptp(film["face"])
        self._block.glyph.hatch_pattern = "right_diagonal_line" if still else None
        fixtures = _fixtures(film, scene, still=still)
        self._lines[1].visible = not still
        self.paint(palette)
        columns = {"value": [*scene.values()]} | extent | fixtures
        self._scene.data = {name: _filled(values) for name, values in columns.items()}
        self.film.data = motion.samples | film

    def paint(self, palette: Palette) -> None:
        """Use the colours of a palette."""
        self._lines[0].glyph.line_color = palette.muted
        self._lines[1].glyph.line_color = palette.muted
        self._block.glyph.line_color = self._block.glyph.fill_color = palette.second
        self._block.glyph.hatch_color = palette.second
        self._arm.glyph.line_color = self._tip.glyph.fill_color = palette.first
        # The impulse of an impact has the colour of its regime.
        self.playing.tags = palette.kinds(stops=False)
        key = [(palette.first, "body 1"), (palette.second, "body 2")]
        self.heading.text = parts.heading("Machine", key)


def _film(motion: Motion) -> tuple[dict[str, Any], dict[str, float], dict[str, Any]]:
    """Return the frames, what all of them share, and the corners of what has to be seen."""
    system, states = motion.run.system, motion.states
    x1, x2 = states[:, 0], states[:, 2]
    oblique = system.contact == "oblique"
    tip = np.asarray(system.tip(x1), dtype=np.float64)
    face = system.gap + x2
    if oblique:
        tip_x, tip_y, pivot_x = tip, -np.cos(x1), np.zeros_like(tip)
        tall, wide = 1.0, 0.4
        low, high = min(tip_y.min(), -0.8), max(tip_y.max(), -0.2)
        left = min(-0.5, float(tip.min()))
    else:
        tall = wide = 0.16 * max(float(np.ptp(np.concatenate([tip, face]))), 1e-3)
        tip_x, tip_y, pivot_x = tip - 0.5 * wide, np.zeros_like(tip), tip - 1.5 * wide
        low, high = -0.5 * tall, 0.5 * tall
        left = float(pivot_x.min()) - wide
    low, high = low - 0.12 * tall, high + 0.12 * tall
    anchor = float(face.max()) + wide + 0.7 * tall
    film = {
        "tip_x": tip_x,
        **small({"tip_y": tip_y, "pivot_x": pivot_x, "face": face}),
        **_hits(motion, tip, tall, oblique=oblique),
    }
    scene = {
        **{"tall": tall, "wide": wide, "anchor": anchor, "middle": 0.5 * (low + high)},
        **{"bottom": float(low), "top": float(high)},
    }
    top = max(0.12 if oblique else 0.0, high) + 0.08 * tall
    extent = {"x": [left - 0.1 * tall, anchor + 0.1 * tall], "y": [low - 0.1 * tall, top]}
    return film, scene, extent


def _hits(motion: Motion, tip: Array, tall: float, *, oblique: bool) -> dict[str, Any]:
    """Return for each frame the impact that is still visible, and the contact in words."""
    run, time = motion.run, motion.time
    count, step = len(time), float(time[-1] - time[0]) / max(len(time) - 1, 1)
    flash, normal, tangent, hit_x, hit_y = np.zeros((5, count))
    says = np.zeros(count, dtype=np.uint8)
    kinds = run.contacts["kind"]
    places = np.searchsorted(run.contacts["time"], time, side="right") - 1
    for kind, code in _CONTACT.items():
        if len(kinds):
            says[(places >= 0) & (kinds[places] == kind)] = code
    touch = (says > 0).astype(np.uint8)
    impacts = run.impacts[run.impacts["time"] >= time[0]]
    if len(impacts) and step > 0.0:
        which = np.searchsorted(impacts["time"], time, side="right") - 1
        age = (time - impacts["time"][which]) / step
        seen = (which >= 0) & (age < FADE)
        flash[seen] = 1.0 - age[seen] / FADE
        scale = (
            _LONGEST
            * (tall if oblique else 3.0 * tall)
            / max(float(impacts["impulse_normal"].max()), 1e-300)
        )
        normal = scale * impacts["impulse_normal"][which]
        tangent = scale * impacts["impulse_tangential"][which]
        angles = impacts["x1"][which]
        hit_x = np.asarray(run.system.tip(angles), dtype=np.float64)
        hit_y = -np.cos(angles) if oblique else np.zeros(count)
        says[seen] = _FIRST_REGIME + impacts["regime"][which[seen]]
    shown = {"flash": flash, "normal": normal, "tangent": tangent, "hit_x": hit_x, "hit_y": hit_y}
    return small(shown) | {"touch": touch, "says": says}


def _filled(values: Sequence[float]) -> Array:
    """Return a column of the scene, with NaN at its end, which is not drawn."""
    column = np.full(_ROWS, np.nan)
    column[: len(values)] = values
    return column


def _fixtures(
    film: dict[str, Any], scene: dict[str, float], *, still: bool
) -> dict[str, list[float]]:
    """Return what does not move: pivot, and the frame that the spring hangs on."""
    tall, anchor, middle = scene["tall"], scene["anchor"], scene["middle"]
    ends = [] if still else [(anchor, middle - 0.3 * tall, anchor, middle + 0.3 * tall)]
    if not np.ptp(film["pivot_x"]):
        ends.append((-0.12, 0.0, 0.12, 0.0))
    columns = zip(*ends, strict=True) if ends else ((), (), (), ())
    return {
        name: [float(value) for value in column]
        for name, column in zip(("x0", "y0", "x1", "y1"), columns, strict=True)
    }

"""What the drawings of machines have in common: a film, a button that plays it, and the player.

The page has a film of the motion, one frame per sample, and moves the drawing by itself, with the
dots of other views.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import Any, ClassVar, NamedTuple

import numpy as np
from bokeh.models import ColumnDataSource, CustomJS, Toggle
from numpy.typing import NDArray

from ..machine import Machine, Motion
from ..theme import Palette
from . import parts
from .columns import Sources

Array = NDArray[np.float64]

# Samples for which an impact stays visible.
FADE = 26
_SAYS = 'cb_obj.label = cb_obj.active ? "pause" : "play"'
# Two samples in every frame, thirty frames a second: a drive period takes two seconds. A source is
# changed in place and redrawn; nothing is sent back to the server. A new film shows its frame at
# once, and stands still until none has come for a while: the browser has the time for the views.
_PLAY = """
const put = (source, values) => {
  for (const [name, value] of Object.entries(values)) {
    for (let k = 0; k < value.length; k++) source.data[name][k] = value[k]
  }
  source.change.emit()
}
let frame = 0, last = 0, rest = 0
if (window.matchMedia("(prefers-reduced-motion: reduce)").matches) playing.active = false
const show = () => {
  const f = film.data
  const n = f.at?.length ?? 0
  if (n == 0) return
  frame = Math.min(frame, n - 1)
  const i = frame
  %s
  for (let k = 0; k < dots.length; k++) {
    const [x, y] = places[k]
    put(dots[k], {x: [f[x][i]], y: [f[y][i]]})
  }
}
film.properties.data.change.connect(() => {
  rest = performance.now() + 300
  show()
})
const step = (now) => {
  if (playing.document == null) return
  window.requestAnimationFrame(step)
  const n = film.data.at?.length ?? 0
  if (n == 0 || !playing.active || now < rest || now - last < 32) return
  last = now
  frame = (frame + 2) %% n
  show()
}
show()
window.requestAnimationFrame(step)
"""


class Dot(NamedTuple):
    """A point that moves with the film: its source, and the columns of the film that it follows."""

    source: ColumnDataSource
    x: str
    y: str

    @classmethod
    def on(cls, x: str, y: str) -> Dot:
        """Return one that has not moved yet."""
        return cls(ColumnDataSource(data={"x": [0.0], "y": [0.0]}), x, y)

    def drawn(self, figure: Any) -> Any:
        """Draw it over everything else; return its renderer, which takes the colours."""
        return figure.scatter("x", "y", source=self.source, size=9, line_width=1.5, level="overlay")


class Drawing(ABC):
    """A drawing of a machine.

    Attributes
    ----------
    heading, playing, figure
        Its title, the button that plays it, and the figure.
    """

    # Draws frame i of the film f, with what `models` names.
    script: ClassVar[str]
    figure: Any

    def __init__(self, machine: Machine, sources: Sources) -> None:
        self.film = sources.film
        self.heading = parts.text()
        self.playing = Toggle(label="pause", active=True, width=60, name="playing", margin=0)
        # A button says what it does.
        self.playing.js_on_change("active", CustomJS(code=_SAYS))

    def player(self, dots: Sequence[Dot]) -> CustomJS:
        """Return what plays the film; it moves some dots, too."""
        own = {
            "film": self.film,
            "playing": self.playing,
            "dots": [dot.source for dot in dots],
            "places": [[dot.x, dot.y] for dot in dots],
        }
        return CustomJS(args=own | self.models(), code=_PLAY % self.script)

    @abstractmethod
    def models(self) -> dict[str, Any]:
        """Return what the script works on."""

    @abstractmethod
    def show(self, motion: Motion, palette: Palette) -> None:
        """Draw the machine of a motion, and give the page its film.

        The film comes last: with it the page moves what it has, in this view and in others.
        """

    @abstractmethod
    def paint(self, palette: Palette) -> None:
        """Use the colours of a palette."""


def small(columns: dict[str, Array]) -> dict[str, Any]:
    """Return columns in half the bytes, which are enough for a drawing."""
    with np.errstate(over="ignore"):
        return {name: column.astype(np.float32) for name, column in columns.items()}

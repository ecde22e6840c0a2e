"""The browser acknowledges each picture, so that the server sends the next one only then.

Without this a slider that moves quickly sends more pictures than the browser can draw, and the
last one waits behind all others.
"""

from __future__ import annotations

from typing import Any

from bokeh.document import Document
from bokeh.models import ColumnDataSource, CustomJS

from .pace import Pace

# What came before a picture's number is drawn in the next frame, and that one has ended when the
# frame after it begins. A page that nobody sees has no frames, and acknowledges at once.
_ACKNOWLEDGE = """
const reply = () => { drawn.tags = sent.tags }
if (sent.tags.length == 0) return
if (document.hidden) reply()
else requestAnimationFrame(() => requestAnimationFrame(reply))
"""


class Acknowledgement:
    """Two numbers: of the last picture that was sent, and of the last one that was drawn.

    Parameters
    ----------
    name
        Of what is drawn.
    patience
        Seconds to wait for the browser's word.

    Attributes
    ----------
    pace
        That of the browser.
    """

    def __init__(self, name: str, patience: float) -> None:
        self.pace = Pace(self._ask, patience)
        # Models that are not drawn: whatever changes in a text, the browser makes a new layout.
        self._sent = ColumnDataSource(name=f"{name}-sent", tags=[])
        self._drawn = ColumnDataSource(name=f"{name}-drawn", tags=[])
        self._reply = CustomJS(args={"sent": self._sent, "drawn": self._drawn}, code=_ACKNOWLEDGE)
        self._sent.js_on_change("tags", self._reply)

        def replied(_name: str, _old: list[Any], new: list[Any]) -> None:
            # They come from the browser, so they may be anything.
            for number in new:
                self.pace.drawn(number)

        self._drawn.on_change("tags", replied)

    def enter(self, document: Document) -> None:
        """Put the numbers into a document."""
        document.add_root(self._sent)
        document.add_root(self._drawn)
        # The first picture may be there before the browser is.
        document.js_on_event("document_ready", self._reply)

    def _ask(self, number: int) -> None:
        """Ask the browser to acknowledge what has been sent until now."""
        self._sent.tags = [number]

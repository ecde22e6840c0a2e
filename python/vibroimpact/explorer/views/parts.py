"""What the views share: empty figures, cards, headings with the key of their colours."""

from __future__ import annotations

import html
import math
from collections.abc import Iterable
from typing import Any

from bokeh.models import BoxZoomTool, Column, Div, GlyphRenderer, Label
from bokeh.plotting import figure

from .. import theme


def text(content: str = "", **options: Any) -> Div:
    """Return a text in the style of the page."""
    return Div(text=content, stylesheets=[theme.TEXT_SHEET], **({"margin": 0} | options))


def plain(name: str, **options: Any) -> Any:
    """Return a figure of a name, without a toolbar."""
    usual: dict[str, Any] = {
        "tools": "",
        "toolbar_location": None,
        "title": None,
        "name": f"{name}-figure",
        "sizing_mode": "stretch_both",
        "min_height": 120,
    }
    return figure(**(usual | options))


def zoomable(name: str, **options: Any) -> Any:
    """Return a figure of a name in which a box gives new ranges."""
    return plain(name, tools=[BoxZoomTool(dimensions="auto")], **options)


def lean(models: Iterable[GlyphRenderer]) -> None:
    """Let points that nobody selects or mutes have one look, and the page fewer models.

    The server goes through all models of a page for each message that it sends.
    """
    for each in models:
        each.update(nonselection_glyph=None, muted_glyph=None)


class Sign:
    """A word in the middle of an empty figure."""

    def __init__(self, drawn_in: Any, name: str) -> None:
        self.label = Label(
            x=0.0,
            y=0.0,
            text="computing …",
            visible=False,
            name=f"{name}-sign",
            text_font_size="15px",
        )
        self.label.text_align, self.label.text_baseline = "center", "middle"
        self._figure = drawn_in
        drawn_in.add_layout(self.label)

    def show(self, *, visible: bool) -> None:
        """Show it in the middle of the ranges of its figure, or hide it."""
        if visible:
            x, y = self._figure.x_range, self._figure.y_range
            self.label.update(x=0.5 * (x.start + x.end), y=0.5 * (y.start + y.end))
        if self.label.visible != visible:
            self.label.visible = visible


# Parts of what is drawn that are left free at each end; a range longer than so many times what is
# drawn is made anew; values that differ by less are one value.
_EDGE, _ROOM, _FLAT = 0.05, 1.5, 1e-9


def fit(shown: Any, low: float, high: float) -> None:
    """Let a range show all from `low` to `high`; it stays as it is while it fits well enough.

    A new range costs a new layout, and a picture whose scale stays shows how the motion changes.
    """
    size = high - low
    # A wall at rest has one angle at every impact, but for rounding.
    margin = _EDGE * size if size > _FLAT * (1.0 + abs(high)) else 0.5
    if shown.start <= low and high <= shown.end and shown.end - shown.start <= _ROOM * size:
        return
    shown.update(start=low - margin, end=high + margin)


# A number is written as a power of ten if both it and its error are smaller than this; of a number
# whose error is not seen so many digits are written.
_SMALL, _DIGITS = 1e-4, 6


def with_error(value: float, error: float) -> str:
    """Return a number with the digits that its error leaves, and the error with one digit.

    Without an error it has six digits, and so it has if its error is smaller than these show.
    """
    size = max(abs(value), error)
    if not 0.0 < error < math.inf or error < 10.0 ** (1 + _power(size) - _DIGITS):
        return f"{value:.{_DIGITS}g}"
    decimals = -_power(float(f"{error:.0e}"))
    if decimals >= 0 and size >= _SMALL:
        return f"{value:.{decimals}f} ± {error:.{decimals}f}"
    # As a power of ten: that of the larger number, so that both can be compared.
    power = _power(size)
    shown, digits = 10.0**power, max(power + decimals, 0)
    return f"({value / shown:.{digits}f} ± {error / shown:.{digits}f})e{power}"


def _power(size: float) -> int:
    """Return the power of ten of a number's first digit."""
    return math.floor(math.log10(size))


def card(*children: Any, **options: Any) -> Column:
    """Return a card around a view."""
    usual = {"sizing_mode": "stretch_both", "spacing": 4}
    return Column(*children, stylesheets=[theme.CARD_SHEET], **(usual | options))


def heading(title: str, key: Iterable[tuple[str, str]] = ()) -> str:
    """Return the heading of a view, with the key of its colours."""
    return f"<h2>{html.escape(title)}</h2>{keys(key)}"


def keys(key: Iterable[tuple[str, str]]) -> str:
    """Return a key: squares of colour, each with its text."""
    return "".join(
        f'<span class="key"><i style="background:{color}"></i>{html.escape(words)}</span>'
        for color, words in key
    )

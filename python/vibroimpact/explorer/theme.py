"""Colours, type and style sheets of the page, light and dark.

Colours of data are those of the package's figures (`plot.style`, `plot.labels`): readers with any
of the common colour vision deficiencies can tell them apart. On a dark page impact regimes
have brighter variants of their colours, which stay apart for the same readers; a test measures
this, and the contrast with the page.

One colour has one meaning in the views of a motion and in the diagram: that of the impact regime,
or of the stop where a structure has several, as in the figures. So the bodies are grey, dark and
light, an impulse has the colour of its impact's regime, and what belongs to the motion of the page
in a map, its place and its branch, has a colour of its own.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from bokeh.themes import Theme
from numpy.typing import NDArray

from .._core import Regime
from ..plot.style import BLUE, REGIME_STYLES, SKY_BLUE, STOPS

_ON_LIGHT: Mapping[int, str] = {regime: style.color for regime, style in REGIME_STYLES.items()}
# The figures' blue and red are too dim on a dark page.
_ON_DARK: Mapping[int, str] = {
    Regime.FRICTIONLESS: "#FFFFFF",
    Regime.SLIP: "#4293FF",
    Regime.REVERSAL_APPROACH: "#FA323E",
    Regime.REVERSAL_RESTITUTION: "#E3C809",
    Regime.STICK_APPROACH: "#3BFA98",
    Regime.STICK_RESTITUTION: "#EC7FBD",
}

FONT = "system-ui, -apple-system, 'Segoe UI', Roboto, 'DejaVu Sans', sans-serif"


@dataclass(frozen=True)
class Palette:
    """The colours of one theme."""

    page: str
    card: str
    ink: str
    muted: str
    line: str
    field: str
    accent: str
    first: str
    second: str
    mark: str
    error: str
    regimes: Mapping[int, str]

    def kinds(self, *, stops: bool) -> list[str]:
        """Return the colours of the kinds of impacts: of stops, or of regimes."""
        if stops:
            return [color for color, _ in STOPS]
        return [self.regimes[each] for each in REGIME_STYLES]

    def numbers(self, *, stops: bool) -> NDArray[np.uint32]:
        """Return these colours as numbers, 0xRRGGBBAA, which the browser need not read."""
        colors = self.kinds(stops=stops)
        return np.array([int(color[1:] + "FF", 16) for color in colors], dtype=np.uint32)


PALETTES = {
    "light": Palette(
        page="#F3F5F7",
        card="#FFFFFF",
        ink="#1A1E23",
        muted="#5A636E",
        line="#DDE2E7",
        field="#FFFFFF",
        accent=BLUE,
        first="#46566A",
        second="#8E9BA8",
        mark="#D6006C",
        error="#B3261E",
        regimes=_ON_LIGHT,
    ),
    "dark": Palette(
        page="#101316",
        card="#191D22",
        ink="#E7EAEE",
        muted="#9CA6B1",
        line="#2F363E",
        field="#22272D",
        accent=SKY_BLUE,
        first="#DCE3EA",
        second="#7C8996",
        mark="#FF40E8",
        error="#FF8A80",
        regimes=_ON_DARK,
    ),
}


def figure_theme(palette: Palette) -> Theme:
    """Return how Bokeh draws figures in a palette."""
    text = {"text_font": FONT, "text_color": palette.ink}
    return Theme(
        json={
            "attrs": {
                "Plot": {
                    # The card shines through: of what fills a whole canvas, Bokeh leaves half a
                    # pixel at its edges when it draws anew in another colour.
                    "background_fill_color": None,
                    "border_fill_color": None,
                    "outline_line_color": None,
                    "min_border": 4,
                },
                "Axis": {
                    "axis_line_color": palette.muted,
                    "major_tick_line_color": palette.muted,
                    "minor_tick_line_color": None,
                    "major_tick_in": 0,
                    "major_tick_out": 4,
                    "major_label_text_color": palette.ink,
                    "major_label_text_font": FONT,
                    "major_label_text_font_size": "12px",
                    "axis_label_text_color": palette.ink,
                    "axis_label_text_font": FONT,
                    "axis_label_text_font_size": "13px",
                    "axis_label_text_font_style": "normal",
                    "axis_label_standoff": 6,
                },
                "Grid": {"grid_line_color": palette.line, "grid_line_alpha": 0.7},
                "Label": text,
                "BoxAnnotation": {"fill_color": palette.accent, "line_color": palette.accent},
            }
        }
    )


def variables(palette: Palette) -> str:
    """Return the palette as variables of a style sheet."""
    names = ("page", "card", "ink", "muted", "line", "field", "accent", "mark", "error")
    return "".join(f"--{name}: {getattr(palette, name)};" for name in names)


ROOT_SHEET = f"""
:host(.light) {{ {variables(PALETTES["light"])} color-scheme: light; }}
:host(.dark) {{ {variables(PALETTES["dark"])} color-scheme: dark; }}
:host {{
  font-family: {FONT}; font-size: 13px; color: var(--ink); background: var(--page);
  padding: 10px; gap: 10px; box-sizing: border-box; min-height: 100vh;
}}
"""
"""The sheet of the page; its variables are known to everything on it."""

WIDGET_SHEET = f"""
:host {{ font-family: {FONT}; font-size: 13px; color: var(--ink); }}
.bk-input {{
  font: inherit; color: var(--ink); background-color: var(--field);
  border: 1px solid var(--line); border-radius: 5px; height: 26px; padding: 0 6px; min-height: 0;
}}
.bk-input:focus {{ border-color: var(--accent); box-shadow: 0 0 0 1px var(--accent); }}
:host(.wrong) .bk-input {{ border-color: var(--error); }}
select.bk-input {{ padding-right: 4px; appearance: auto; background-image: none; }}
.bk-btn, .bk-btn-default {{
  font: inherit; color: var(--ink); background: var(--field);
  border: 1px solid var(--line); border-radius: 5px; padding: 3px 10px; height: 26px;
}}
.bk-btn:hover {{ border-color: var(--accent); color: var(--ink); background: var(--field); }}
.bk-btn[disabled], .bk-btn[disabled]:hover {{
  background: var(--field); color: var(--muted); border-color: var(--line); opacity: 0.5;
}}
.bk-btn.bk-active, .bk-btn-default.bk-active {{
  background: var(--accent); border-color: var(--accent); color: var(--card);
}}
label, .bk-input-group > label {{ color: var(--muted); margin: 0; }}
.noUi-target {{ border: none; box-shadow: none; background: var(--line); height: 4px;
  border-radius: 2px; margin-top: 5px; }}
.noUi-connect {{ background: var(--accent) !important; }}
.noUi-horizontal .noUi-handle {{
  width: 14px !important; height: 14px !important; top: -5px !important; right: -7px !important;
  border-radius: 50%; border: 2px solid var(--card); background: var(--accent); box-shadow: none;
}}
.noUi-handle::before, .noUi-handle::after {{ display: none; }}
"""
"""The sheet of every widget."""

WRAPPED_SHEET = ":host { flex-wrap: wrap !important; }"
"""The sheet of a row of fields, whose last ones may stand below the first."""


NARROW, MEDIUM = 800, 1200
"""Up to these widths in pixels the page has one column, and two of them beside the controls."""

PAIRS_SHEET = f"""
@media (min-width: {NARROW + 1}px) and (max-width: {MEDIUM}px) {{
  :host {{ flex-wrap: wrap !important; height: auto !important; }}
  :host > * {{ flex: 1 1 calc(50% - 10px) !important; height: 280px !important; }}
}}
"""
"""The sheet of a row whose children stand in pairs where the window is not wide."""


def stacked_sheet(direction: str, height: str, width: int = NARROW) -> str:
    """Return the sheet of a row or column that is as high as its children, or as the window.

    In a window up to a width its children stand one below another.
    """
    return f"""
:host {{ min-height: min-content !important; }}
@media (max-width: {width}px) {{
  :host {{ flex-direction: {direction} !important; height: auto !important; }}
  :host > * {{ width: 100% !important; flex: none !important; height: {height} !important; }}
}}
"""


CARD_SHEET = """
:host {
  background: var(--card); border: 1px solid var(--line); border-radius: 8px;
  padding: 8px 10px; box-sizing: border-box;
}
"""
"""The sheet of a card, which holds one view."""

TEXT_SHEET = f"""
:host {{ font-family: {FONT}; font-size: 13px; line-height: 1.4; color: var(--ink); }}
h1 {{ font-size: 16px; font-weight: 600; margin: 0; }}
h2 {{ font-size: 13px; font-weight: 600; margin: 0; display: inline; }}
.group {{ font-weight: 600; margin-top: 6px; }}
.key {{ color: var(--muted); margin-left: 10px; white-space: nowrap; display: inline-block; }}
.key i {{ display: inline-block; width: 9px; height: 9px; margin-right: 4px;
  border-radius: 2px; outline: 1px solid var(--line); }}
.muted {{ color: var(--muted); }}
.error {{ color: var(--error); }}
.bk-clearfix:has(pre) {{ display: block !important; width: 100%; }}
pre {{ font: 12px ui-monospace, 'DejaVu Sans Mono', monospace; color: var(--ink);
  white-space: pre; margin: 0; max-height: 40vh; overflow: auto; }}
.label {{ font-size: 24px; font-weight: 600; }}
table {{ border-spacing: 0; }}
td {{ padding: 0 14px 0 0; vertical-align: top; font-variant-numeric: tabular-nums; }}
td:first-child {{ color: var(--muted); white-space: nowrap; }}
"""
"""The sheet of texts."""

PAGE = """
{% extends base %}
{% block title %}vibroimpact explorer{% endblock %}
{% block postamble %}
<meta name="viewport" content="width=device-width, initial-scale=1">
<style>
  html, body { margin: 0; padding: 0; background: #F3F5F7; }
  @media (prefers-color-scheme: dark) { html, body { background: #101316; } }
</style>
{% endblock %}
"""
"""The page around the document."""

"""The page around the views: its header, the places of the views, what the browser does alone."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any

from bokeh.document import Document
from bokeh.models import (
    Button,
    Column,
    ColumnDataSource,
    CustomJS,
    Div,
    GlyphRenderer,
    Plot,
    Row,
    Select,
    Spacer,
    Toggle,
)
from jinja2 import Template

from . import theme
from .controls import ChoiceControl, sheets
from .machine import Machine
from .views import parts
from .views.columns import Sources
from .views.drawings import drawing_of
from .views.history import HistoryView
from .views.portrait import PortraitView
from .views.sections import SectionViews
from .views.verdict import VerdictView

NO_PRESET = "choose a preset"
_ADDRESS = 'window.history.replaceState(null, "", "?" + cb_obj.tags[0])'
_COPY = """
const say = (label) => {
  button.label = label
  setTimeout(() => { button.label = "copy" }, 1000)
}
navigator.clipboard.writeText(code.tags.join("")).then(() => say("copied"), () => say("failed"))
"""
_DOWNLOAD = """
if (!cb_obj.text) return
const link = document.createElement("a")
link.href = URL.createObjectURL(new Blob([cb_obj.text], {type: "text/csv"}))
link.download = cb_obj.tags[0] + ".csv"
link.click()
setTimeout(() => URL.revokeObjectURL(link.href), 1000)
cb_obj.text = ""
"""
_PREFERS = """
const wanted = new URLSearchParams(window.location.search).get("theme")
if (wanted == null && window.matchMedia("(prefers-color-scheme: dark)").matches) dark.active = true
"""
# Bokeh keeps an empty element for each axis, grid and glyph. At each paint it writes their places
# into style sheets, and an axis looks dozens of times for a style, which the browser then computes
# anew: that was half of the time of a picture. Nobody sees where a glyph's element is; the others
# are placed when their place changes.
_PLACES = """
for (const figure of figures) {
  for (const view of cb_context.index.find_one_by_id(figure.id).computed_renderer_views) {
    if (view.model.type == "GlyphRenderer") {
      view.position.replace(":host { position: absolute; width: 0; height: 0; }")
      view.update_position = () => {}
      continue
    }
    const place = view.update_position.bind(view)
    let last = ""
    view.update_position = () => {
      const {left, top, width, height} = view.bbox ?? {}
      const box = [left, top, width, height].join()
      if (box != last) place()
      last = box
    }
  }
}
"""

# A window may be lower than the controls.
_GROWS = ":host { flex: 1 0 auto !important; }"


class Frame:
    """Header, views and their places.

    Parameters
    ----------
    machine, shown
        Whose views they are, and the coordinate that is looked at.
    controls, maps
        What stands on the left, and below on the right.
    presets
        Names for the list of the header.
    look
        Gets another coordinate to look at.
    """

    def __init__(
        self,
        machine: Machine,
        shown: str,
        controls: Any,
        maps: Any,
        presets: Iterable[str],
        look: Callable[[str, str], None],
    ) -> None:
        sources = Sources(machine, shown)
        self.machine = drawing_of(machine, sources)
        self.history = HistoryView(machine, shown, sources)
        self.portrait = PortraitView(machine, shown, sources)
        self.sections = SectionViews(machine, sources)
        pairs = [(name, machine.name_of(name)) for name in machine.shown]
        usual: dict[str, Any] = {"width": 70, "sizing_mode": "fixed"}
        self.shown = ChoiceControl("shown", pairs, look, **usual)
        self.shown.root.visible = len(pairs) > 1
        self.what = VerdictView()
        # The machine comes last, since it reads and moves the others.
        self.views = (self.history, self.portrait, self.sections, self.machine)
        self._buttons(presets)
        wide: dict[str, Any] = {"sizing_mode": "stretch_width"}
        self.error = parts.text(visible=False, name="error", **wide)
        self.notice = parts.text(visible=False, name="notice", **wide)
        # Its query is a tag of a model that is not drawn: whatever changes in a text, the browser
        # makes a new layout of the page.
        self.address = ColumnDataSource(name="address")
        # On their way to the browser, which saves them.
        self.files = {
            name: Div(name=f"{name}-file", tags=[name], visible=False)
            for name in ("motion", *machine.maps)
        }
        for file in self.files.values():
            file.js_on_change("text", CustomJS(code=_DOWNLOAD))
        self.root = Column(
            *(self._header(), self.notice, self.error, self.code_card),
            Row(
                *(controls, self._places(maps)),
                spacing=10,
                sizing_mode="stretch_both",
                stylesheets=[*_stacked("column-reverse", "auto"), _GROWS],
            ),
            *self.files.values(),
            stylesheets=[theme.ROOT_SHEET],
            name="page",
            tags=[self.address],
            **wide,
        )

    def enter(self, document: Document, *, owns_address: bool) -> None:
        """Put the page into a document."""
        dots = [*self.history.dots, *self.portrait.dots]
        figures = [*self.root.select({"type": Plot})]
        document.js_on_event("document_ready", CustomJS(args={"figures": figures}, code=_PLACES))
        document.js_on_event("document_ready", self.machine.player(dots))
        if owns_address:
            self.address.js_on_change("tags", CustomJS(code=_ADDRESS))
            prefers = CustomJS(args={"dark": self.dark}, code=_PREFERS)
            document.js_on_event("document_ready", prefers)
        document.title = "vibroimpact explorer"
        document.template = Template(theme.PAGE)
        parts.lean(self.root.select({"type": GlyphRenderer}))
        document.add_root(self.root)

    def _buttons(self, presets: Iterable[str]) -> None:
        usual: dict[str, Any] = {"stylesheets": sheets(), "height": 26, "margin": 0}
        self.preset = Select(
            options=[NO_PRESET, *presets], value=NO_PRESET, name="preset", width=230, **usual
        )
        self.code = Toggle(label="Python code", name="code", width=100, **usual)
        self.motion_csv = Button(label="motion CSV", name="motion-csv", width=98, **usual)
        self.map_csv = Button(label="map CSV", name="map-csv", width=82, **usual)
        self.before = Button(
            label="motion before", name="motion-before", width=112, disabled=True, **usual
        )
        self.dark = Toggle(label="dark", name="dark", width=56, **usual)
        self.code_text = parts.text(name="code-text", sizing_mode="stretch_width")
        copy = Button(label="copy", name="copy", width=70, **usual)
        own = {"code": self.code_text, "button": copy}
        copy.js_on_event("button_click", CustomJS(args=own, code=_COPY))
        self.code_card = parts.card(
            *(copy, self.code_text), sizing_mode="stretch_width", visible=False
        )

    def _header(self) -> Row:
        title = parts.text("<h1>vibroimpact explorer</h1>", margin=(2, 14, 0, 4))
        return Row(
            *(title, self.preset, Spacer(sizing_mode="stretch_width")),
            *(self.code, self.motion_csv, self.map_csv, self.dark),
            spacing=8,
            stylesheets=[theme.WRAPPED_SHEET],
            sizing_mode="stretch_width",
        )

    def _places(self, maps: Any) -> Column:
        machine, history, portrait = self.machine, self.history, self.portrait
        sections = self.sections
        wide: dict[str, Any] = {"sizing_mode": "stretch_width"}
        both: dict[str, Any] = {"sizing_mode": "stretch_both", "spacing": 10}
        play = Row(machine.heading, machine.playing, **wide)
        for text in (machine.heading, history.heading, portrait.heading):
            text.sizing_mode = "stretch_width"
        for text in (sections.impact_heading, sections.stroboscopic_heading):
            text.sizing_mode = "stretch_width"
        machine.playing.update(stylesheets=sheets(), height=26)
        above = Row(
            parts.card(play, machine.figure),
            parts.card(history.heading, history.figure),
            parts.card(Row(portrait.heading, self.shown.root, **wide), portrait.figure),
            height=300,
            spacing=10,
            stylesheets=[
                *_stacked("column", "280px"),
                theme.PAIRS_SHEET,
            ],
            **wide,
        )
        pair = Row(
            parts.card(sections.impact_heading, sections.impact_figure),
            parts.card(sections.stroboscopic_heading, sections.stroboscopic_figure),
            min_height=260,
            stylesheets=[
                *_stacked("column", "280px"),
                theme.PAIRS_SHEET,
            ],
            **both,
        )
        said = parts.card(Row(self.what.text, self.before, **wide), min_height=150, **wide)
        auto: dict[str, Any] = both | {"stylesheets": _stacked("column", "auto")}
        side_by_side = both | {"stylesheets": _stacked("column", "auto", theme.MEDIUM)}
        below = Row(Column(said, pair, **auto), maps, **side_by_side)
        return Column(above, below, **auto)


def _stacked(direction: str, height: str, width: int = theme.NARROW) -> list[str]:
    return [theme.stacked_sheet(direction, height, width)]

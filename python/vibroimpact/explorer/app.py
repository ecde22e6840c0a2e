"""One page of the explorer: its state, the work that a change causes, and where results go."""

from __future__ import annotations

import html
import logging
from collections.abc import Callable
from functools import partial
from typing import Any

from bokeh.document import Document
from bokeh.models import (
    Button,
    Column,
    CustomJS,
    Div,
    InlineStyleSheet,
    Row,
    Select,
    Spacer,
    Toggle,
)
from jinja2 import Template

from .._core import PARAMETERS
from ..errors import ParameterError, SimulationError, StateError
from ..orbits import PeriodicMotion
from ..simulation import simulate
from . import compute, tables, theme
from .code import python_code
from .compute import Motion, Verdict
from .controls import Controls, sheets
from .jobs import Lane, Work
from .maps import MapsCard
from .presets import PRESETS
from .state import MAPS, State
from .views import parts
from .views.diagram import BranchLines, branch_lines
from .views.history import HistoryView
from .views.machine import MachineView
from .views.portrait import PortraitView
from .views.sections import SectionViews
from .views.verdict import VerdictView

# Milliseconds without a change after which verdict and fine maps are computed.
REST = 250
# What a page says; anything else is a fault, which the server's log gets.
EXPECTED = (ParameterError, StateError, SimulationError)

_MAPS: dict[str, Callable[[State, compute.Detail], Any]] = {
    "diagram": compute.diagram,
    "chart": compute.chart_of,
    "basins": compute.basins_of,
}
_NO_PRESET = "choose a preset"
_ADDRESS = 'if (cb_obj.text) window.history.replaceState(null, "", "?" + cb_obj.text)'
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


class Page:
    """What one browser window shows.

    Parameters
    ----------
    document
        The document of the session.
    state
        Where it begins.
    owns_address
        Whether the address of the window may hold the state; not in a notebook.
    """

    def __init__(self, document: Document, state: State, *, owns_address: bool = True) -> None:
        self.document, self.state, self._owns_address = document, state, owns_address
        self.motion: Motion | None = None
        self.verdict: Verdict | None = None
        self._turn, self._closed, self._map_key = 0, False, ("",)
        self._first = state
        self._lanes = {name: Lane(self._post) for name in ("motion", "verdict", "map", "branch")}
        self.controls = Controls(self.change)
        self.machine, self.history, self.portrait = MachineView(), HistoryView(), PortraitView()
        self.sections, self.what = SectionViews(), VerdictView()
        self.maps = MapsCard(self.change)
        self._build()
        document.on_session_destroyed(lambda _context: self.close())
        self._show(state)

    @property
    def palette(self) -> theme.Palette:
        """The colours of the page."""
        return theme.PALETTES[self.state.theme]

    @property
    def busy(self) -> bool:
        """Whether anything is computed."""
        return any(lane.busy for lane in self._lanes.values())

    def change(self, **fields: Any) -> None:
        """Change fields of the state by name.

        Raises
        ------
        ParameterError, StateError
            If the new state is refused; then nothing changes.
        """
        state = self.state.replace(**fields)
        if state == self.state:
            return
        if (state.system, state.initial) != (self.state.system, self.state.initial):
            # Refuses bodies that overlap at the start; there is no shorter run.
            simulate(state.system, initial=state.initial, time=1e-9, max_events=1)
        self._show(state)

    def refuse_address(self, error: Exception | None) -> None:
        """Say why the page does not show what its address asks for."""
        words = f"The address is not used: {error}"
        self.notice.text = f'<span class="error">{html.escape(words)}</span>'
        self.notice.visible = error is not None

    def close(self) -> None:
        """End all work of the page."""
        self._closed = True
        for lane in self._lanes.values():
            lane.cancel()

    # The page.

    def _build(self) -> None:
        usual: dict[str, Any] = {"stylesheets": sheets(), "height": 26, "margin": 0}
        own = {"as given": self._first} if self._first not in PRESETS.values() else {}
        self._presets = own | PRESETS
        self.preset = Select(
            **{"options": [_NO_PRESET, *self._presets], "value": _NO_PRESET, "name": "preset"},
            **usual | {"width": 230},
        )
        self.preset.on_change("value", self._preset)
        code = Toggle(label="Python code", name="code", width=100, **usual)
        code.on_change("active", self._show_code)
        motion_csv = Button(label="motion CSV", name="motion-csv", width=98, **usual)
        motion_csv.on_click(self._download_motion)
        map_csv = Button(label="map CSV", name="map-csv", width=82, **usual)
        map_csv.on_click(self._download_map)
        self.dark = Toggle(label="dark", name="dark", width=56, **usual)
        self.dark.on_change("active", self._themed)
        title = parts.text("<h1>vibroimpact explorer</h1>", margin=(2, 14, 0, 4))
        header = Row(
            *(title, self.preset, Spacer(sizing_mode="stretch_width")),
            *(code, motion_csv, map_csv, self.dark),
            spacing=8,
            sizing_mode="stretch_width",
        )
        self._code = parts.text(name="code-text", sizing_mode="stretch_width")
        copy = Button(label="copy", name="copy", width=60, **usual)
        copy.js_on_event(
            "button_click",
            CustomJS(
                args={"code": self._code},
                code="navigator.clipboard.writeText(code.tags.join(''))",
            ),
        )
        self._code_card = parts.card(
            *(copy, self._code), sizing_mode="stretch_width", visible=False
        )
        self.error = parts.text(visible=False, sizing_mode="stretch_width", name="error")
        self.notice = parts.text(visible=False, sizing_mode="stretch_width", name="notice")
        self.root = Column(
            *(header, self.notice, self.error, self._code_card),
            Row(self.controls.root, self._views(), spacing=10, sizing_mode="stretch_both"),
            *self._hidden(),
            stylesheets=[InlineStyleSheet(css=theme.ROOT_SHEET)],
            sizing_mode="stretch_width",
            name="page",
        )
        self.document.title = "vibroimpact explorer"
        self.document.template = Template(theme.PAGE)
        self.document.add_root(self.root)

    def _views(self) -> Column:
        machine, history, portrait = self.machine, self.history, self.portrait
        sections = self.sections
        options: dict[str, Any] = {"sizing_mode": "stretch_both", "spacing": 10}
        play = Row(
            machine.heading,
            Spacer(sizing_mode="stretch_width"),
            machine.playing,
            sizing_mode="stretch_width",
        )
        machine.playing.stylesheets = sheets()
        machine.playing.height = 26
        return Column(
            Row(
                parts.card(play, machine.figure),
                parts.card(history.heading, history.figure),
                parts.card(portrait.heading, portrait.figure),
                height=300,
                sizing_mode="stretch_width",
                spacing=10,
            ),
            Row(
                Column(
                    parts.card(self.what.text, sizing_mode="stretch_width", min_height=150),
                    Row(
                        parts.card(sections.impact_heading, sections.impact_figure),
                        parts.card(sections.stroboscopic_heading, sections.stroboscopic_figure),
                        min_height=260,
                        **options,
                    ),
                    **options,
                ),
                self.maps.root,
                **options,
            ),
            **options,
        )

    def _hidden(self) -> list[Div]:
        """Return what is not seen: the address, and files on their way."""
        self.address = Div(name="address", visible=False)
        self._files = {
            name: Div(name=f"{name}-file", tags=[name], visible=False) for name in ("motion", *MAPS)
        }
        for file in self._files.values():
            file.js_on_change("text", CustomJS(code=_DOWNLOAD))
        if self._owns_address:
            self.address.js_on_change("text", CustomJS(code=_ADDRESS))
        markers = {
            "now_1": self.history.now_1,
            "now_2": self.history.now_2,
            "here_1": self.portrait.here_1,
            "here_2": self.portrait.here_2,
        }
        self.document.js_on_event("document_ready", self.machine.player(markers))
        if self._owns_address:
            prefers = CustomJS(args={"dark": self.dark}, code=_PREFERS)
            self.document.js_on_event("document_ready", prefers)
        return [self.address, *self._files.values()]

    # What a change causes.

    def _show(self, state: State) -> None:
        old, self.state = self.state, state
        self._turn += 1
        self.root.css_classes = [state.theme]
        self.controls.show(state)
        self.maps.show_state(state)
        self.dark.active = state.theme == "dark"
        self.address.text = state.to_query()
        if self._code_card.visible:
            self._write_code()
        if self.motion is None or old.theme != state.theme:
            self.document.theme = theme.figure_theme(self.palette)
            self._paint()
        moved = (old.system, old.initial) != (state.system, state.initial)
        if self.motion is None or moved:
            self.verdict = None
            self._lanes["verdict"].cancel()
            show = partial(self._show_motion, state)
            self._submit("motion", partial(compute.motion, state), show)
        self._show_map()

    def _show_motion(self, state: State, motion: Motion) -> None:
        self.say(None)
        self.motion = motion
        self._draw_motion(motion)
        if (state.system, state.initial) == (self.state.system, self.state.initial):
            self._after_rest(partial(self._judge, state, motion))

    def _draw_motion(self, motion: Motion) -> None:
        for view in (self.machine, self.history, self.portrait, self.sections):
            view.show(motion, self.palette)
        self.what.show(motion, self.verdict)

    def _judge(self, state: State, motion: Motion) -> None:
        def show(verdict: Verdict) -> None:
            self.verdict = verdict
            self.what.show(motion, verdict)
            self._show_branch()

        self._submit("verdict", partial(compute.verdict, state, motion.run), show, quick=False)

    def _show_map(self) -> None:
        state = self.state
        key = _key(state)
        if key == self._map_key:
            self._show_value()
            return
        if key[:2] != self._map_key[:2]:
            self.maps.result = None
        self._map_key = key
        self._draw_branch(None)
        work = partial(_MAPS[state.map], state, compute.COARSE[state.map])
        self._submit("map", work, partial(self._show_result, state), self._refuse_map)
        self._after_rest(self._show_fine)

    def _show_fine(self) -> None:
        state = self.state
        work = partial(_MAPS[state.map], state, compute.FINE[state.map])
        show = partial(self._show_result, state)
        self._submit("map", work, show, self._refuse_map, quick=False)
        self._show_branch()

    def _show_result(self, state: State, result: Any) -> None:
        if self.state.map == state.map:
            # The newest value of what is drawn needs no new computation.
            self.maps.show(result, self.state, self.palette)

    def _show_value(self) -> None:
        if self.maps.result is not None:
            self.maps.show(self.maps.result, self.state, self.palette)
        self._show_branch()

    def _show_branch(self) -> None:
        state, verdict = self.state, self.verdict
        wanted = state.branch and state.map == "diagram"
        if not wanted or verdict is None:
            self._lanes["branch"].cancel()
            self._draw_branch(None)
            return
        if verdict.periodic is None:
            why = "no branch: the motion on the page is not periodic"
            self.maps.say(ParameterError(why))
            self._draw_branch(None)
            return
        work = partial(self._follow, state, verdict.periodic)
        self._submit("branch", work, self._draw_branch, self._refuse_map, quick=False)

    @staticmethod
    def _follow(state: State, periodic: PeriodicMotion) -> BranchLines:
        """Follow a branch, and find what is drawn of it, which takes as long."""
        return branch_lines(compute.branch(state, periodic), state.value)

    def _draw_branch(self, lines: BranchLines | None) -> None:
        self.maps.diagram.show_branch(lines, self.palette)

    def _paint(self) -> None:
        for view in (self.machine, self.history, self.portrait, self.sections):
            view.paint(self.palette)
        self.maps.paint(self.palette, self.state)
        if self.motion is not None:
            self._draw_motion(self.motion)

    # Buttons and lists.

    def _preset(self, _name: str, _old: str, new: str) -> None:
        if new in self._presets:
            self.maps.forget()
            self._map_key = ("",)
            self._show(self._presets[new].replace(theme=self.state.theme))

    def _themed(self, _name: str, _old: bool, new: bool) -> None:
        self.change(theme="dark" if new else "light")

    def _show_code(self, _name: str, _old: bool, new: bool) -> None:
        self._code_card.visible = bool(new)
        if new:
            self._write_code()

    def _write_code(self) -> None:
        code = python_code(self.state)
        self._code.text = f"<pre>{html.escape(code)}</pre>"
        self._code.tags = [code]

    def _download_motion(self) -> None:
        if self.motion is not None:
            self._files["motion"].text = tables.of_run(self.motion.run)

    def _download_map(self) -> None:
        if self.maps.result is not None:
            self._files[self.state.map].text = tables.of_map(self.maps.result)

    # Work and its results.

    def _submit(
        self,
        lane: str,
        work: Callable[[], Any],
        show: Callable[[Any], None],
        refuse: Callable[[Exception], None] | None = None,
        *,
        quick: bool = True,
    ) -> None:
        refuse = refuse or self.say
        self._lanes[lane].submit(Work(work, show, partial(self._refused, refuse), quick))

    def _refused(self, say: Callable[[Exception], None], error: Exception) -> None:
        if not isinstance(error, EXPECTED):
            logging.getLogger(__name__).error("a computation of the page failed", exc_info=error)
        say(error)

    def _refuse_map(self, error: Exception) -> None:
        self.maps.say(error)
        if self.maps.result is None:
            self.maps.clear()

    def say(self, error: Exception | None) -> None:
        """Show an error above the views, or none."""
        words = "" if error is None else html.escape(str(error))
        self.error.text = f'<span class="error">{words}</span>'
        self.error.visible = bool(words)

    def _after_rest(self, work: Callable[[], None]) -> None:
        """Do something if nothing has changed until then."""
        turn = self._turn

        def start() -> None:
            if turn == self._turn and not self._closed:
                work()

        self.document.add_timeout_callback(start, REST)

    def _post(self, show: Callable[[], None]) -> None:
        if not self._closed:
            self.document.add_next_tick_callback(show)


def _key(state: State) -> tuple[Any, ...]:
    """Return all that the map of a state depends on, with its kind and axes first."""
    system = state.system.to_dict()
    start: dict[str, float] = dict(zip(("x1", "v1", "x2", "v2"), state.initial, strict=True))
    if state.map == "diagram":
        axes: tuple[Any, ...] = (state.vary,)
    elif state.map == "chart":
        axes = (state.across, state.upward)
    else:
        axes = (state.right, state.up)
    names = {axis.name for axis in axes}
    rest = {k: v for k, v in (system | start).items() if k not in names}
    assert names <= {*PARAMETERS, *start}
    more = (state.start,) if state.map == "diagram" else ()
    return (state.map, tuple(sorted(names)), axes, tuple(rest.items()), more)

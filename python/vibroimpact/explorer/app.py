"""One page of the explorer: its state, the work that a change causes, and where results go."""

from __future__ import annotations

import dataclasses
import html
import logging
import math
import time
from collections.abc import Callable
from functools import partial
from typing import Any

from bokeh.document import Document

from ..errors import ParameterError, SimulationError, StateError
from ..orbits import PeriodicMotion
from . import compute, tables, theme
from .acknowledgement import Acknowledgement
from .code import python_code
from .compute import Verdict
from .controls import Controls
from .frame import Frame
from .jobs import Lane, Work
from .machine import Motion
from .maps import MapsCard
from .presets import PRESETS
from .state import State, map_key
from .views.diagram import BranchLines, branch_lines

# Milliseconds without a change after which verdict and fine maps are computed.
REST = 250
# Seconds between two changes of the controls and the address while a slider moves.
BETWEEN = 0.06
# Seconds to wait for the browser's word that it has drawn a picture, before the next one is begun.
PATIENCE = 3.0
# Motions that are remembered to go back to, but for the last.
_MOST_LEFT = 99
# What a page says; anything else is a fault, which the server's log gets.
EXPECTED = (ParameterError, StateError, SimulationError)

_MAPS: dict[str, Callable[[State, compute.Detail], Any]] = {
    "diagram": compute.diagram,
    "chart": compute.chart_of,
    "basins": compute.basins_of,
}


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
    soon
        Calls a function on the thread of the document, from any thread. Bokeh's documents may not
        be touched by other threads.
    """

    def __init__(
        self,
        document: Document,
        state: State,
        *,
        owns_address: bool = True,
        soon: Callable[[Callable[[], None]], Any] = lambda call: call(),
    ) -> None:
        self.document, self.state, self._soon = document, state, soon
        self.motion: Motion | None = None
        self.verdict: Verdict | None = None
        self._turn, self._closed, self._map_key = 0, False, ("",)
        # What begins by name once the page has been left alone for a while.
        self._resting: dict[str, Callable[[], None]] = {}
        # When controls and address have last been changed, and whether they will be.
        self._described, self._will_describe = -BETWEEN, False
        # States whose motions clicks have left.
        self._left: list[State] = []
        self._lanes = {name: Lane(self._post) for name in ("verdict", "branch")}
        for name in ("motion", "map"):
            self._pace(name)
        machine = state.machine
        own = {"as given": state} if state not in PRESETS.values() else {}
        # The views of a page are those of one kind of machine.
        kind = type(machine)
        self._presets = own | {
            name: preset for name, preset in PRESETS.items() if type(preset.machine) is kind
        }
        self.controls = Controls(machine, self.change, self.move)
        self.maps = MapsCard(machine, self.change, self.choose)
        self.frame = Frame(
            *(machine, state.shown, self.controls.root, self.maps.root, self._presets),
            look=self._look,
        )
        self._wire()
        self.frame.enter(document, owns_address=owns_address)
        document.js_on_event("document_ready", self.maps.diagram.drawing)
        self._show(state)

    @property
    def palette(self) -> theme.Palette:
        """The colours of the page."""
        return theme.PALETTES[self.state.theme]

    @property
    def busy(self) -> bool:
        """Whether anything is computed, or on its way to the browser."""
        return any(lane.busy for lane in self._lanes.values())

    def change(self, **fields: Any) -> None:
        """Change fields of the state by name.

        Raises
        ------
        ParameterError, StateError
            If the new state is refused; then nothing changes.
        """
        self._change(fields, self._describe)

    def move(self, **fields: Any) -> None:
        """Change fields as `change` does, for a slider, which changes them many times a second."""
        self._change(fields, self._describe_soon)

    def _change(self, fields: dict[str, Any], describe: Callable[[], None]) -> None:
        try:
            state = self.state.replace(**fields)
            if _moves(state) != _moves(self.state):
                state.machine.refuse_start(state.initial)
        except (ParameterError, StateError):
            # What is still to be shown of moves before would hide the words beside the field.
            if self._will_describe:
                self._describe()
            raise
        if state != self.state:
            self._show(state, describe)

    def choose(self, **fields: Any) -> None:
        """Change fields as `change` does, and remember the motion that is left."""
        left = self.state
        self.change(**fields)
        if self.state != left:
            self._left = [*self._left[-_MOST_LEFT:], left]
            self.frame.before.disabled = False

    def go_back(self) -> None:
        """Show the motion before the last click again; maps and ranges stay."""
        if self._left:
            left = self._left.pop()
            self.frame.before.disabled = not self._left
            self.change(machine=left.machine, initial=left.initial, origin=left.origin)

    def refuse_address(self, error: Exception | None) -> None:
        """Say why the page does not show what its address asks for."""
        words = f"The address is not used: {error}"
        self.frame.notice.text = f'<span class="error">{html.escape(words)}</span>'
        self.frame.notice.visible = error is not None

    def close(self) -> None:
        """End all work of the page."""
        self._closed = True
        for lane in self._lanes.values():
            lane.cancel()

    def _pace(self, name: str) -> None:
        """Give a view that follows the sliders a lane that waits for the browser."""
        told = Acknowledgement(name, PATIENCE)
        told.enter(self.document)
        self._lanes[name] = Lane(self._post, pace=told.pace)

    def _wire(self) -> None:
        frame = self.frame
        frame.preset.on_change("value", self._preset)
        frame.code.on_change("active", self._show_code)
        frame.dark.on_change("active", self._themed)
        frame.before.on_click(self.go_back)
        frame.motion_csv.on_click(self._download_motion)
        frame.map_csv.on_click(self._download_map)

    # What a change causes.

    def _describe(self) -> None:
        """Show the state in controls, ranges, address and code."""
        state = self.state
        self._will_describe = False
        self.frame.root.css_classes = [state.theme]
        self.controls.show(state)
        self.maps.show_state(state)
        self.frame.dark.active = state.theme == "dark"
        self.frame.shown.show(state.shown)
        self.frame.address.tags = [state.to_query()]
        if self.frame.code_card.visible:
            self._write_code()
        self._described = time.monotonic()

    def _describe_soon(self) -> None:
        """Do so now, or as soon as the last time is long enough ago: then with the newest state."""
        wait = BETWEEN - (time.monotonic() - self._described)
        if wait <= 0.0:
            self._describe()
        elif not self._will_describe:
            self._will_describe = True
            self.document.add_timeout_callback(self._describe_late, math.ceil(1e3 * wait))

    def _describe_late(self) -> None:
        if self._will_describe and not self._closed:
            self._describe()

    def _show(self, state: State, describe: Callable[[], None] | None = None) -> None:
        old, self.state = self.state, state
        self._turn += 1
        (describe or self._describe)()
        if self.motion is None or old.theme != state.theme:
            self.document.theme = theme.figure_theme(self.palette)
            self._paint()
        if self.motion is None or _moves(old) != _moves(state):
            self.verdict = None
            self._lanes["verdict"].cancel()
            self._resting.pop("verdict", None)
            show = partial(self._show_motion, state)
            self._submit("motion", partial(compute.motion, state), show)
        elif old.shown != state.shown:
            self.motion = dataclasses.replace(self.motion, shown=state.shown)
            self._draw_motion(self.motion)
        self._show_map()
        self._rest()

    def _show_motion(self, state: State, motion: Motion) -> None:
        self.say(None)
        self.motion = motion = dataclasses.replace(motion, shown=self.state.shown)
        self._draw_motion(motion)
        if _moves(state) == _moves(self.state):
            self._after_rest("verdict", partial(self._judge, state, motion))

    def _draw_motion(self, motion: Motion) -> None:
        for view in self.frame.views:
            view.show(motion, self.palette)
        self.frame.what.show(motion, self.verdict)

    def _judge(self, state: State, motion: Motion) -> None:
        def show(verdict: Verdict) -> None:
            self.verdict = verdict
            self.frame.what.show(motion, verdict)
            self._show_branch()

        self._submit("verdict", partial(compute.verdict, state, motion.run), show, quick=False)

    def _show_map(self) -> None:
        state = self.state
        key = map_key(state)
        if key == self._map_key:
            self._show_value()
            return
        if key[:2] != self._map_key[:2]:
            # What is drawn has other axes, or is of a motion before.
            self.maps.expect(state)
        self._map_key = key
        self._draw_branch(None)
        if not compute.has_periods(state):
            self._lanes["map"].cancel()
            self._resting.pop("fine map", None)
            self.maps.clear()
            self.maps.note("A map counts drive periods. There is no drive frequency.")
            return
        detail = compute.detail(state, compute.COARSE, moving=True)
        work = partial(_MAPS[state.map], state, detail)
        self._submit("map", work, partial(self._show_result, state), self._refuse_map)
        self._after_rest("fine map", self._show_fine)

    def _show_fine(self) -> None:
        if any(self._lanes[name].busy for name in ("motion", "map")):
            # It would take the processors from what the slider has moved last, and the place of a
            # coarse map that still waits.
            self._after_rest("fine map", self._show_fine)
            return
        state = self.state
        work = partial(_MAPS[state.map], state, compute.detail(state, compute.FINE))
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
        if not (state.branch and state.map == "diagram") or verdict is None:
            self._lanes["branch"].cancel()
            self._draw_branch(None)
            return
        if verdict.periodic is None:
            why = "no branch: the motion on the page is not periodic"
            self.maps.say(ParameterError(why))
            self._draw_branch(None)
            return
        work = partial(self._follow, state, verdict.periodic)
        self.maps.diagram.expect_branch()
        self._submit("branch", work, self._draw_branch, self._refuse_branch, quick=False)

    @staticmethod
    def _follow(state: State, periodic: PeriodicMotion) -> BranchLines:
        """Follow a branch, and find what is drawn of it, which takes as long."""
        return branch_lines(compute.branch(state, periodic), state.value)

    def _draw_branch(self, lines: BranchLines | None) -> None:
        self.maps.diagram.show_branch(lines, self.palette)

    def _paint(self) -> None:
        for view in self.frame.views:
            view.paint(self.palette)
        self.maps.paint(self.palette, self.state)
        if self.motion is not None:
            self._draw_motion(self.motion)

    # Buttons and lists.

    def _look(self, _name: str, shown: str) -> None:
        self.change(shown=shown)

    def _preset(self, _name: str, _old: str, new: str) -> None:
        if new in self._presets:
            self.maps.forget()
            self._map_key, self._left = ("",), []
            self.frame.before.disabled = True
            self._show(self._presets[new].replace(theme=self.state.theme))

    def _themed(self, _name: str, _old: bool, new: bool) -> None:
        self.change(theme="dark" if new else "light")

    def _show_code(self, _name: str, _old: bool, new: bool) -> None:
        self.frame.code_card.visible = bool(new)
        if new:
            self._write_code()

    def _write_code(self) -> None:
        code = python_code(self.state)
        self.frame.code_text.text = f"<pre>{html.escape(code)}</pre>"
        self.frame.code_text.tags = [code]

    def _download_motion(self) -> None:
        if self.motion is not None:
            self.frame.files["motion"].text = tables.of_run(self.motion.run)

    def _download_map(self) -> None:
        if self.maps.result is not None:
            self.frame.files[self.state.map].text = tables.of_map(
                self.maps.result, self.state.machine
            )

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

    def _refuse_branch(self, error: Exception) -> None:
        self._refuse_map(error)
        self._draw_branch(None)

    def say(self, error: Exception | None) -> None:
        """Show an error above the views, or none."""
        words = "" if error is None else html.escape(str(error))
        self.frame.error.text = f'<span class="error">{words}</span>'
        self.frame.error.visible = bool(words)

    def _after_rest(self, name: str, work: Callable[[], None]) -> None:
        """Do something, in place of what has this name, once nothing has changed for a while."""
        self._resting[name] = work
        self._rest()

    def _rest(self) -> None:
        """Begin what waits for it if nothing changes for a while; each change calls this again."""
        turn = self._turn

        def start() -> None:
            if turn == self._turn and not self._closed:
                waiting, self._resting = self._resting, {}
                for work in waiting.values():
                    work()

        if self._resting:
            self.document.add_timeout_callback(start, REST)

    def _post(self, show: Callable[[], None]) -> None:
        def post() -> None:
            if not self._closed:
                self.document.add_next_tick_callback(show)

        self._soon(post)


def _moves(state: State) -> tuple[Any, ...]:
    """Return all that the motion of a state depends on."""
    return state.machine, state.initial

"""The card of the maps: which one is shown, over which ranges, and what a click or a box does."""

from __future__ import annotations

import html
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
from bokeh.events import DoubleTap, RangesUpdate, Tap
from bokeh.models import (
    Button,
    Column,
    Div,
    RadioButtonGroup,
    Row,
    Toggle,
)

from ..errors import ParameterError, SimulationError, StateError
from . import theme
from .axis import Axis
from .controls import AxisControl, ChoiceControl, sheets
from .machine import Machine
from .state import STARTS, State
from .theme import Palette
from .views import parts
from .views.cells import CellsView
from .views.diagram import DiagramView

Change = Callable[..., None]
_TITLES = {"diagram": "Diagram", "chart": "Chart", "basins": "Basins"}
_STARTS = {"fresh": "each from the start", "forward": "followed up", "backward": "followed down"}
_HINT = '<span class="muted">click: that motion; drag a box: zoom; <i>range before</i>: back</span>'
# What a box in a map gives a new range, rightward and upward.
_ZOOMED = {"diagram": ("vary",), "chart": ("across", "upward"), "basins": ("right", "up")}
# Two ranges this close, as parts of their length, are the same.
_SAME = 1e-9


class MapsCard:
    """The maps of a machine.

    Parameters
    ----------
    machine
        Whose maps they are.
    change
        Changes fields of the state by name; raises the package's error if it is refused.
    choose
        Does the same for a click that chooses a motion.
    """

    def __init__(self, machine: Machine, change: Change, choose: Change) -> None:
        self._machine = machine
        self._try, self._choose = self._tried(change), self._tried(choose)
        self._state: State | None = None
        # Of each map, the ranges to go back to: of its axes, and of what a diagram draws.
        self._before: dict[str, list[tuple[dict[str, Axis], tuple[float, float] | None]]] = {}
        self._height: tuple[float, float] | None = None
        self.result: Any = None
        self._map_of_result = ""
        self.diagram = DiagramView(machine)
        self.chart, self.basins = CellsView("chart", machine), CellsView("basins", machine)
        self.message = parts.text(visible=False, sizing_mode="stretch_width", name="map-error")
        # What is wrong with the ranges in the fields; it does not hide what is said of the map.
        self.refusal = parts.text(visible=False, sizing_mode="stretch_width", name="range-error")
        self._build(change)

    def _build(self, change: Change) -> None:
        button: dict[str, Any] = {"margin": 0, "stylesheets": sheets(), "height": 26}
        titles = [_TITLES[name] for name in self._machine.maps]
        self._tabs = RadioButtonGroup(labels=titles, active=0, name="map", **button)
        # Where there is one map, nothing is to be chosen.
        several = len(titles) > 1
        title = parts.text(parts.heading("Bifurcation diagram"), margin=(4, 0, 0, 0))
        self._tabs.on_change("active", self._tab)
        self._quiet = False
        self._branch = Toggle(label="branch", name="branch", width=66, **button)
        self._branch.visible = self._machine.branches
        self._branch.on_change("active", self._branched)
        self._back = Button(label="range before", name="back", width=100, disabled=True, **button)
        self._back.on_click(self.go_back)
        axis = {
            field: AxisControl(field, self._machine, self._axis(name, change), self.refuse)
            for name, fields in _ZOOMED.items()
            if name in self._machine.maps
            for field in fields
        }
        self._axes = axis
        wide = {"sizing_mode": "fixed"}
        self._value = ChoiceControl(
            "value", [*self._machine.values.items()], self._named, width=170, **wide
        )
        self._start = ChoiceControl(
            "start", [(s, _STARTS[s]) for s in STARTS], self._named, width=160, **wide
        )
        wrapped = [theme.WRAPPED_SHEET]
        gap: dict[str, Any] = {
            "spacing": 6,
            "sizing_mode": "stretch_width",
            "stylesheets": wrapped,
        }
        self._bodies = {
            name: Column(
                *(*self._row(name, gap), view.figure, view.key),
                spacing=4,
                sizing_mode="stretch_both",
            )
            for name, view in self._views().items()
        }
        top = Row(
            self._tabs if several else title,
            self._back,
            parts.text(_HINT, margin=(4, 0, 0, 0)),
            **gap,
        )
        self.root = parts.card(
            top, self.message, self.refusal, *self._bodies.values(), min_height=380
        )
        # Those of other machines are never seen.
        self.diagram.figure.on_event(Tap, self._tap_diagram)
        self.chart.figure.on_event(Tap, self._tap_chart)
        self.basins.figure.on_event(Tap, self._tap_basins)
        for name, view in self._views().items():
            view.figure.on_event(RangesUpdate, partial(self._zoomed, name))
            view.figure.on_event(DoubleTap, lambda _event: self.go_back())

    def _row(self, name: str, gap: dict[str, Any]) -> list[Any]:
        """Return the fields above a map."""
        axes = [self._axes[field].root for field in _ZOOMED[name]]
        if name == "diagram":
            return [
                Row(*axes, self._branch, **gap),
                Row(self._value.root, self._start.root, **gap),
            ]
        return axes if name == "chart" else [Row(*axes, **gap)]

    def _views(self) -> dict[str, Any]:
        views = {"diagram": self.diagram, "chart": self.chart, "basins": self.basins}
        return {name: views[name] for name in self._machine.maps}

    def show_state(self, state: State) -> None:
        """Show names and ranges of a state, and mark its motion."""
        self._state = state
        self._quiet = True
        self._tabs.active = self._machine.maps.index(state.map)
        self._branch.active = state.branch
        self._quiet = False
        for name, control in self._axes.items():
            control.show(getattr(state, name))
        self._value.show(state.value)
        self._start.show(state.start)
        for name, body in self._bodies.items():
            body.visible = name == state.map
        self._frame(state)
        self._back.disabled = not self._before.get(state.map)
        self.refuse(None)

    def _frame(self, state: State) -> None:
        """Show the ranges of the map that is seen, and mark the motion of the page in it."""
        if state.map == "diagram":
            self.diagram.frame(state)
        elif state.map == "chart":
            numbers: dict[str, Any] = state.machine.numbers()
            at = [numbers[axis.name] for axis in (state.across, state.upward)]
            self.chart.frame(state.across, state.upward, (at[0], at[1]))
        else:
            start = dict(zip(state.machine.coordinates, state.initial, strict=True))
            here = (start[state.right.name], start[state.up.name])
            self.basins.frame(state.right, state.up, here)

    def forget(self) -> None:
        """Forget the ranges to go back to, for another system."""
        self._before, self._height = {}, None

    def show(self, result: Any, state: State, palette: Palette) -> None:
        """Draw a result."""
        self.say(None)
        self.result, self._map_of_result = result, state.map
        self._views()[state.map].sign.show(visible=False)
        if state.map == "diagram":
            self.diagram.show(result, state, palette)
            self.diagram.fit(self._height)
        elif state.map == "chart":
            self.chart.show_chart(result, palette)
        else:
            self.basins.show_basins(result, palette)

    def clear(self) -> None:
        """Draw no map."""
        self.result = None
        for view in self._views().values():
            view.clear()
            view.sign.show(visible=False)

    def expect(self, state: State) -> None:
        """Draw no map, and say that that of a state is computed."""
        self.clear()
        self._views()[state.map].sign.show(visible=True)

    def say(self, error: Exception | None) -> None:
        """Show an error, or none."""
        _tell(self.message, error)

    def refuse(self, error: Exception | None) -> None:
        """Show why the range in a field is not used, or nothing."""
        _tell(self.refusal, error)

    def note(self, words: str) -> None:
        """Say why there is no map, where nothing is wrong."""
        self.message.text = f'<span class="muted">{html.escape(words)}</span>'
        self.message.visible = True

    def paint(self, palette: Palette, state: State) -> None:
        """Use the colours of a palette."""
        for view in self._views().values():
            view.paint(palette)
        if self.result is not None:
            self.show(self.result, state, palette)

    def go_back(self) -> None:
        """Show the ranges before the last zoom."""
        before = None if self._state is None else self._before.get(self._state.map)
        if before:
            axes, self._height = before.pop()
            self._try(**axes)

    def _tried(self, change: Change) -> Change:
        def tried(**fields: Any) -> None:
            try:
                change(**fields)
            except (ParameterError, StateError) as error:
                self.say(error)

        return tried

    def _axis(self, name: str, change: Change) -> Change:
        def changed(**fields: Any) -> None:
            self._before.pop(name, None)
            if name == "diagram":
                self._height = None
            change(**fields)

        return changed

    def _named(self, field: str, name: str) -> None:
        if field == "value":
            self._height = None
        self._try(**{field: name})

    def _tab(self, _name: str, _old: int, new: int) -> None:
        if not self._quiet and new in range(len(self._machine.maps)):
            self._try(map=self._machine.maps[new])

    def _branched(self, _name: str, _old: bool, new: bool) -> None:
        if not self._quiet:
            self._try(branch=bool(new))

    def _zoomed(self, name: str, event: RangesUpdate) -> None:
        state = self._state
        if state is None or state.map != name or event.x0 is None or event.y0 is None:
            return
        across, upward = sorted((event.x0, event.x1)), sorted((event.y0, event.y1))
        if across[0] == across[1] or upward[0] == upward[1]:
            return
        old: dict[str, Axis] = {field: getattr(state, field) for field in _ZOOMED[name]}
        axes = {
            field: Axis(name=axis.name, low=float(low), high=float(high))
            for (field, axis), (low, high) in zip(old.items(), (across, upward), strict=False)
        }
        if all(_same(axes[field], axis) for field, axis in old.items()):
            return
        self._before.setdefault(name, []).append((old, self._height))
        if name == "diagram":
            self._height = (float(upward[0]), float(upward[1]))
        self._try(**axes)

    def _tap_diagram(self, event: Tap) -> None:
        diagram, state = self._result_of("diagram"), self._state
        if diagram is None or event.x is None or state is None:
            return
        place = _place(diagram.values, float(event.x))
        changes: dict[str, Any] = {
            state.vary.name: float(diagram.values[place]),
            "initial": state.diagram_initial,
        }
        if state.start != "fresh":
            # Where the column before has ended, so that the motion is that of the column.
            try:
                begun = state.machine.column_start(diagram, place)
                changes |= {"initial": begun, "origin": state.diagram_initial}
            except (ParameterError, StateError, SimulationError) as error:
                self.say(error)
                return
        self._choose(**changes)

    def _tap_chart(self, event: Tap) -> None:
        self._choose_cell(self._result_of("chart"), event)

    def _tap_basins(self, event: Tap) -> None:
        self._choose_cell(self._result_of("basins"), event)

    def _result_of(self, name: str) -> Any:
        """The result, if it is that of a map: a tap may come when the next one is already drawn."""
        return self.result if self._map_of_result == name else None

    def _choose_cell(self, result: Any, event: Tap) -> None:
        if result is None or event.x is None or event.y is None:
            return
        (first, x), (second, y) = result.axes.items()
        self._choose(**{first: _nearest(x, float(event.x)), second: _nearest(y, float(event.y))})


def _tell(where: Div, error: Exception | None) -> None:
    words = "" if error is None else html.escape(str(error))
    where.text = f'<span class="error">{words}</span>'
    where.visible = bool(words)


def _same(one: Axis, other: Axis) -> bool:
    within = _SAME * (other.high - other.low)
    return abs(one.low - other.low) < within and abs(one.high - other.high) < within


def _nearest(values: Any, wanted: float) -> float:
    return float(values[_place(values, wanted)])


def _place(values: Any, wanted: float) -> int:
    return int(np.argmin(np.abs(np.asarray(values) - wanted)))

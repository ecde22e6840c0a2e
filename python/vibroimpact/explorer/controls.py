"""The controls of the page: a slider and a field for every number, lists for names.

A field takes any number; what the package refuses is said beside it, in the package's words, and
changes nothing. A slider has the usual range of its number, made wider by what the field gets.
"""

from __future__ import annotations

import html
import math
from collections.abc import Callable, Iterable
from typing import Any

from bokeh.models import Column, Div, Row, Select, Slider, TextInput

from ..errors import ParameterError, StateError
from . import theme
from .axis import Axis
from .machine import Machine
from .state import State, axis_names, read_number, write_number
from .views import parts

_TITLES = {"law": "law of restitution", "simultaneous": "stops met at one instant"}
_STEPS = 1000
# Characters for which a number's field has place.
_PLACES = 8


def sheets() -> list[str]:
    """Return the style sheets of a widget."""
    return [theme.WIDGET_SHEET]


def rounded(value: float) -> float:
    """Return what a slider means: of what it gives, the digits beyond its step are rounding."""
    return float(f"{value:.6g}")


class NumberControl:
    """A slider and a field for one number.

    Parameters
    ----------
    name
        Of the number.
    machine
        Whose number it is.
    change
        Tries a new value; raises the package's error if it is refused.
    move
        Does so for the slider.
    """

    def __init__(
        self,
        name: str,
        machine: Machine,
        change: Callable[[str, float], None],
        move: Callable[[str, float], None],
    ) -> None:
        self._name, self._change, self._move, self._quiet = name, change, move, False
        self._value = 0.0
        low, high = machine.span(name)
        step = (high - low) / _STEPS
        self.slider = Slider(
            **{"start": low, "end": high, "step": step, "value": low, "title": None},
            **{"show_value": False, "name": f"{name}-slider", "margin": (1, 4, 0, 2)},
            **{"stylesheets": sheets(), "sizing_mode": "stretch_width", "height": 14},
        )
        self.field = TextInput(
            **{"name": name, "width": 74, "margin": 0, "stylesheets": sheets(), "height": 22},
        )
        title = "&ensp;".join(filter(None, (machine.symbol(name), machine.words(name))))
        self.error = parts.text(visible=False, sizing_mode="stretch_width", name=f"{name}-error")
        self.slider.on_change("value", self._moved)
        self.field.on_change("value", self._typed)
        self.root = Column(
            Row(
                parts.text(title, sizing_mode="stretch_width", margin=(4, 0, 0, 0)),
                self.field,
                sizing_mode="stretch_width",
            ),
            self.slider,
            self.error,
            sizing_mode="stretch_width",
        )

    def show(self, value: float) -> None:
        """Show a value that was accepted; NaN: that there are several."""
        self._value = value
        slider, text = self.slider, _field_text(value)
        if math.isnan(value):
            value = rounded(slider.value)
        if self.field.value == text and rounded(slider.value) == value and not self.error.visible:
            return
        self._quiet = True
        if value < slider.start:
            slider.start = value
        if value > slider.end:
            slider.end = value
        # What a slider gives is rounded: it stands there already, and may have moved on since.
        if rounded(slider.value) != value:
            slider.value = value
        self.field.value = text
        self._quiet = False
        self._say("")

    def _moved(self, _name: str, _old: float, new: float) -> None:
        if not self._quiet:
            self._try(rounded(new), self._move)

    def _typed(self, _name: str, _old: str, new: str) -> None:
        if self._quiet:
            return
        try:
            # What the field shows of the value in force may be less than all of its digits.
            same = new == _field_text(self._value)
            if same and math.isnan(self._value):
                self._say("")
                return
            value = self._value if same else read_number(self._name, new)
        except ParameterError as error:
            self._say(str(error))
        else:
            self._try(value, self._change)

    def _try(self, value: float, change: Callable[[str, float], None]) -> None:
        try:
            change(self._name, value)
        except (ParameterError, StateError) as error:
            self._say(str(error))
        else:
            # The value in force, typed again, changes nothing else on the page.
            self._say("")

    def _say(self, message: str) -> None:
        self.error.text = f'<span class="error">{html.escape(message)}</span>'
        self.error.visible = bool(message)
        self.field.css_classes = ["wrong"] if message else []


def _field_text(value: float) -> str:
    """Return a number as its field shows it: rounded, if the whole one has no place in it."""
    if math.isnan(value):
        return "differ"
    texts = (write_number(value), *(f"{value:.{digits}g}" for digits in range(_PLACES, 0, -1)))
    return next((text for text in texts if len(text) <= _PLACES), texts[-1])


class ChoiceControl:
    """A list for one name."""

    def __init__(
        self,
        name: str,
        choices: Iterable[str | tuple[str, str]],
        change: Callable[[str, str], None],
        **options: Any,
    ) -> None:
        self._name, self._change, self._quiet = name, change, False
        self._allowed = [one if isinstance(one, str) else one[0] for one in choices]
        usual = {"sizing_mode": "stretch_width", "margin": 0, "height": 26}
        self.root = Select(
            options=list(choices), name=name, stylesheets=sheets(), **(usual | options)
        )
        self.root.on_change("value", self._chosen)

    def show(self, value: str) -> None:
        """Show a name that was accepted."""
        self._quiet = True
        self.root.value = value
        self._quiet = False

    def _chosen(self, _name: str, old: str, new: str) -> None:
        if self._quiet:
            return
        if new in self._allowed:
            self._change(self._name, new)
        else:
            self.show(old)


class AxisControl:
    """Name and range of one axis of a map.

    Parameters
    ----------
    field
        Of the state.
    machine
        Whose numbers can be chosen from.
    change
        Tries a new axis; raises the package's error if it is refused.
    fail
        Gets the error of a refusal, and None when nothing is refused any more.
    """

    def __init__(
        self,
        field: str,
        machine: Machine,
        change: Callable[..., None],
        fail: Callable[[Exception | None], None],
    ) -> None:
        self._field, self._change, self._fail, self._quiet = field, change, fail, False
        self._axis: Axis | None = None
        self._machine = machine
        names = axis_names(machine)[field]
        pairs = [(name, machine.name_of(name)) for name in names]
        options = {"sizing_mode": "fixed", "width": 168 if len(names) > 4 else 78}
        self._name = ChoiceControl(field, pairs, self._named, **options)
        self._ends = {
            end: TextInput(
                width=76, height=26, margin=0, stylesheets=sheets(), name=f"{field}_{end}"
            )
            for end in ("low", "high")
        }
        for box in self._ends.values():
            box.on_change("value", self._typed)
        row = [self._name.root, self._ends["low"], parts.text("to", margin=(4, 0, 0, 0))]
        # On one line, however narrow the map is.
        self.root = Row(*row, self._ends["high"], spacing=6)

    def show(self, axis: Axis) -> None:
        """Show an axis that was accepted."""
        self._axis = axis
        self._quiet = True
        self._name.show(axis.name)
        for end, box in self._ends.items():
            box.value = _end_text(axis, end)
            box.css_classes = []
        self._quiet = False

    def _named(self, _field: str, name: str) -> None:
        if self._axis is None:
            return
        if name == self._axis.name:
            # After another name was refused: with the range in force.
            self._try(self._axis)
        else:
            self._try(self._machine.usual(name))

    def _typed(self, _name: str, _old: str, _new: str) -> None:
        """Try the range that both fields show: one that was refused may now be right."""
        if self._quiet or self._axis is None:
            return
        ends: dict[str, float] = {}
        errors: list[ParameterError] = []
        for end, box in self._ends.items():
            box.css_classes = []
            try:
                ends[end] = self._read(self._axis, end)
            except ParameterError as error:
                box.css_classes = ["wrong"]
                errors.append(error)
        if errors:
            self._fail(errors[0])
            return
        try:
            axis = Axis(name=self._axis.name, **ends)
        except ParameterError as error:
            for end, box in self._ends.items():
                box.css_classes = ["wrong"] if box.value != _end_text(self._axis, end) else []
            self._fail(error)
        else:
            self._try(axis)

    def _read(self, axis: Axis, end: str) -> float:
        """Return what a field shows; digits that it has no place for are not lost."""
        text = self._ends[end].value
        if text == _end_text(axis, end):
            return float(getattr(axis, end))
        return read_number(f"{axis.name}: {end}", text)

    def _try(self, axis: Axis) -> None:
        try:
            if axis != self._axis:
                self._change(**{self._field: axis})
        except (ParameterError, StateError) as error:
            self._fail(error)
        else:
            self.show(axis)
            self._fail(None)


def _end_text(axis: Axis, end: str) -> str:
    return write_number(float(f"{getattr(axis, end):.10g}"))


class Controls:
    """All controls of machine and start, in groups.

    Parameters
    ----------
    machine
        Of the page.
    change
        Tries to change fields of the state by name; raises the package's error if it is refused.
    move
        Does so for sliders.
    """

    def __init__(
        self, machine: Machine, change: Callable[..., None], move: Callable[..., None]
    ) -> None:
        def one(name: str, value: float) -> None:
            change(**{name: value})

        def moved(name: str, value: float) -> None:
            move(**{name: value})

        def tried(name: str, value: str) -> None:
            try:
                change(**{name: value})
            except (ParameterError, StateError) as error:
                self.error.text = f'<span class="error">{html.escape(str(error))}</span>'
                self.error.visible = True
            else:
                self.error.visible = False

        groups = dict(machine.groups) | ({"Start": machine.starts} if machine.starts else {})
        named = [name for names in groups.values() for name in names]
        self.choices = {
            name: ChoiceControl(
                name, [(one, machine.choice_words(name, one)) for one in allowed], tried
            )
            for name, allowed in machine.choices.items()
        }
        self.numbers = {
            name: NumberControl(name, machine, one, moved)
            for name in named
            if name not in machine.choices
        }
        self.error = parts.text(visible=False, sizing_mode="stretch_width", name="choice-error")
        children: list[Any] = []
        for title, names in groups.items():
            children.append(parts.text(f'<div class="group">{title}</div>'))
            lists = [self._titled(name) for name in names if name in self.choices]
            if lists:
                children += [
                    Row(*lists, spacing=6, sizing_mode="stretch_width"),
                    self.error,
                ]
            children += [self.numbers[name].root for name in names if name in self.numbers]
        # As high as its children, however low the window is.
        self.root = parts.card(
            *children, width=264, sizing_mode=None, height_policy="min", spacing=0
        )

    def _titled(self, name: str) -> Column:
        """Return a list with its title above it."""
        title = parts.text(_TITLES.get(name, name), margin=(2, 0, 0, 0))
        return Column(title, self.choices[name].root, sizing_mode="stretch_width")

    def show(self, state: State) -> None:
        """Show a state."""
        values: dict[str, Any] = state.machine.numbers()
        values |= zip(state.machine.coordinates, state.initial, strict=True)
        for name, number in self.numbers.items():
            number.show(values[name])
        for name, choice in self.choices.items():
            choice.show(values[name])
        self.error.visible = False

    @property
    def messages(self) -> list[Div]:
        """The messages beside the fields."""
        return [number.error for number in self.numbers.values()]

"""The fields of the explorer: a refusal is told beside the field, and goes when it is over."""

import pytest

from explorer_desk import SMALL, Desk, zoom
from vibroimpact.explorer import compute
from vibroimpact.explorer.axis import Axis
from vibroimpact.explorer.presets import DEFAULT


@pytest.fixture
def desk(monkeypatch):
    """Make every fine map a small one."""
    monkeypatch.setattr(compute, "FINE", dict.fromkeys(compute.FINE, SMALL))
    return Desk()


@pytest.mark.parametrize(
    ("field", "bad", "also_right"), [("restitution", "1.7", "0.80"), ("x1", "1.4", "0.0")]
)
def test_the_old_number_typed_again_takes_the_message_away(desk, field, bad, also_right):
    number, error = desk.named(field), desk.named(f"{field}-error")
    for right in (number.value, also_right):
        number.value = bad
        assert error.visible
        assert number.css_classes == ["wrong"]
        number.value = right
        assert not error.visible
        assert number.css_classes == []
    assert desk.page.state == DEFAULT


@pytest.mark.parametrize(
    ("value", "shown"),
    [
        (-0.011235955056179803, "-0.01124"),
        (1 / 3, "0.333333"),
        (1.2345678e-10, "1.23e-10"),
        (1.5752, "1.5752"),
    ],
)
def test_a_long_number_is_shown_rounded_and_kept(desk, value, shown):
    desk.page.change(v1=value)
    state, field = desk.page.state, desk.named("v1")
    assert field.value == shown
    field.value = "x"
    field.value = shown
    assert not desk.named("v1-error").visible
    assert desk.page.state == state
    field.value = "0.25"
    assert desk.page.state.initial[1] == 0.25


def test_the_old_name_chosen_again_takes_the_message_away(desk):
    desk.named("contact").value = "direct"
    assert "friction" in desk.named("choice-error").text
    desk.named("contact").value = "oblique"
    assert not desk.named("choice-error").visible
    desk.named("map").active = 1
    desk.settle()
    desk.named("across").value = "moment_amplitude"
    assert "another one than of across" in desk.named("range-error").text
    desk.named("across").value = "drive_frequency"
    assert not desk.named("range-error").visible
    # With the range that it had.
    assert desk.page.state == DEFAULT.replace(map="chart")


def ends(desk):
    """Return texts and marks of the range of the diagram, and whether a message is shown."""
    low, high = (desk.named(f"vary_{end}") for end in ("low", "high"))
    marks = (low.css_classes, high.css_classes)
    return low.value, high.value, *marks, desk.named("range-error").visible


def test_the_old_end_of_a_range_typed_again_takes_the_message_away(desk):
    zoom(desk, 1.5, 1.6)
    for end, bad in (("low", "1.7"), ("high", "1.2"), ("low", "x"), ("high", "")):
        old = desk.named(f"vary_{end}").value
        desk.named(f"vary_{end}").value = bad
        assert desk.named("range-error").visible
        assert desk.named(f"vary_{end}").css_classes == ["wrong"]
        desk.named(f"vary_{end}").value = old
        assert ends(desk) == ("1.5", "1.6", [], [], False)
    # Nothing was changed, so the range before the zoom is still there.
    desk.page.maps.go_back()
    assert desk.page.state.vary == DEFAULT.vary


def test_a_range_is_what_both_fields_show(desk):
    low, high = desk.named("vary_low"), desk.named("vary_high")
    low.value = "2.2"
    assert ends(desk) == ("2.2", "2", ["wrong"], [], True)
    high.value = "2.1"
    assert ends(desk) == ("2.2", "2.1", ["wrong"], ["wrong"], True)
    high.value = "2.3"
    assert desk.page.state.vary == Axis(name="drive_frequency", low=2.2, high=2.3)
    assert ends(desk) == ("2.2", "2.3", [], [], False)
    high.value = "high"
    low.value = "1.5"
    assert ends(desk) == ("1.5", "high", [], ["wrong"], True)
    high.value = "1.6"
    assert desk.page.state.vary == Axis(name="drive_frequency", low=1.5, high=1.6)
    # An end that is not typed keeps the digits that its field has no place for.
    zoom(desk, 1 / 3, 2 / 3)
    high.value = "0.7"
    assert desk.page.state.vary == Axis(name="drive_frequency", low=1 / 3, high=0.7)


def test_a_bad_range_does_not_hide_what_is_said_of_the_map(desk):
    desk.named("preset").value = "Bouncing ball"
    desk.settle()
    desk.named("vary").value = "gap"
    desk.named("vary_low").value = "x"
    desk.named("vary_low").value = "-0.5"
    assert not desk.named("range-error").visible
    assert "no drive frequency" in desk.named("map-error").text
    assert desk.named("map-error").visible

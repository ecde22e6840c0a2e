"""The explorer of a structure in headless Chromium: views, film, sliders, clicks, a closed stop."""

import logging
import random

import numpy as np
import pytest

import sizes
from chromium import PATIENCE, Records, Window, serving, started
from explorer_structures import CHAIN, PAIR, ROUGH
from vibroimpact.explorer import app, compute
from vibroimpact.explorer.code import python_code
from vibroimpact.explorer.server import first_state
from vibroimpact.explorer.structure_numbers import DRIVE
from vibroimpact.plot.stop_rows import BLOCK

pytest.importorskip("selenium")
SMALL = dict.fromkeys(compute.FINE, compute.Detail(30, 0, 60, 10))
PAGES = {"pair": PAIR, "rough": ROUGH, "chain": CHAIN}


@pytest.fixture(scope="module")
def chrome():
    """A browser for all pages, and small maps."""
    patch = pytest.MonkeyPatch()
    patch.setattr(compute, "FINE", SMALL)
    patch.setattr(compute, "COARSE", SMALL)
    # On a busy machine an acknowledgement may be late, but is not lost.
    patch.setattr(app, "PATIENCE", PATIENCE)
    with started() as driver:
        yield driver
    patch.undo()


@pytest.fixture
def window(chrome, request):
    """The page of a structure; afterwards nothing has complained."""
    records = Records()
    logging.getLogger().addHandler(records)
    state = first_state(PAGES[getattr(request, "param", "pair")], None)
    with serving(state) as server:
        window = Window(chrome, server.url)
        window.state = state
        window.open()
        window.settled()
        yield window
        assert window.complaints() == []
        assert records.messages == []
    logging.getLogger().removeHandler(records)


def model(name):
    return f"Bokeh.documents[0].get_model_by_name({name!r})"


@pytest.mark.parametrize("window", PAGES, indirect=True)
def test_each_view_of_a_structure_is_drawn_with_the_numbers_of_the_functions(window):
    for name in ("machine", "history", "portrait", "impact", "stroboscopic", "diagram"):
        box = window.js(
            "return arguments[0].getBoundingClientRect().toJSON()",
            window.element(f"{name}-figure"),
        )
        assert box["width"] > 150, name
        assert box["height"] > 100, name
    motion = compute.motion(window.state)
    shown = int(window.state.shown[1:])
    assert window.data("film", "speed") == motion.states[:, 1, shown].tolist()
    assert window.data("impact", "u") == motion.run.impacts["approach_velocity"].tolist()
    assert f">{motion.run.label}<".replace("inf", "∞") in window.get("verdict", "text")


def test_the_blocks_move_with_the_film(window):
    right = f"{model('blocks')}.data.right[1]"
    first = window.js(f"return {right}")
    window.wait(f"{right} != {first!r}")
    window.set("playing", "active", False)
    places = np.array(window.data("film", "d1"))
    assert np.isclose(window.js(f"return {right}") - 0.5 * BLOCK, places, atol=1e-6).any()


@pytest.mark.parametrize("window", ["rough"], indirect=True)
def test_a_stop_that_is_closed_is_said(window):
    says = f"{model('says')}.text"
    for words in ("stop 0: closed, slides", "stop 1: impact", "stop 0: impact"):
        window.wait(f"{says}.startsWith({words!r})")
    window.wait(f"{model('blocks')}.data.alpha[0] > 0.5")


def test_a_slider_of_a_structure_redraws_and_the_address_follows(window):
    window.set("gap_1-slider", "value", 0.4)
    window.set(f"{DRIVE}-slider", "value", 1.5)
    window.wait(f"window.location.search.includes('{DRIVE}=1.5&')")
    state = window.state.replace(gap_1=0.4, **{DRIVE: 1.5})
    assert window.js("return window.location.search") == f"?{state.to_query()}"
    speed = compute.motion(state).states[5, 1, 0].item()
    window.wait(f"{model('film')}.data.speed[5] == {speed!r}")
    # The address alone leads back to the state.
    window.chrome.refresh()
    window.wait(f"{model('gap_1')}.value == '0.4'")
    window.wait(f"{model('film')}.data.speed[5] == {speed!r}")


def test_a_click_on_a_column_of_a_structure_shows_its_motion(window):
    # The first map that comes has half the columns.
    window.wait(f"new Set({model('diagram')}.data.at).size > 15")
    low, high = window.several("diagram-figure", "y_range.start", "y_range.end")
    window.click("diagram-figure", 1.0, 0.5 * (low + high))
    window.wait(f"{model('drive_frequency')}.value != '1.2'")
    axis = window.state.vary
    values = np.linspace(axis.low, axis.high, 30)
    shown = float(window.get("drive_frequency", "value"))
    chosen = values[np.argmin(abs(values - shown))].item()
    assert f"drive_frequency={chosen!r}&" in window.js("return window.location.search")
    state = window.state.replace(drive_frequency=chosen)
    label = compute.motion(state).run.label
    window.wait(f"{model('verdict')}.text.includes('>{label}<')")
    window.set("code", "active", True)
    window.wait(f"{model('code-text')}.tags.length > 0")
    assert window.get("code-text", "tags") == [python_code(state)]


def test_random_actions_on_a_structure_leave_no_error(window):
    draw = random.Random(24)
    fields = ("gap_0", "restitution_1", "drive_frequency", DRIVE, "phase", "q1", "v0")
    lists = {
        "shown": ("q0", "q1"),
        "value": ("approach_velocity", "q", "phase", "stroboscopic"),
        "start": ("fresh", "forward", "backward"),
        "vary": ("gap", "gap_1", DRIVE, "drive_frequency"),
        "simultaneous": ("stop", "sequence", "together"),
    }
    for _ in range(sizes.either(30, 600)):
        kind = draw.choice(("slide", "slide", "type", "choose", "click", "press"))
        if kind == "slide":
            name = draw.choice(fields)
            low, high = window.several(f"{name}-slider", "start", "end")
            window.set(f"{name}-slider", "value", draw.uniform(low, high))
        elif kind == "type":
            text = draw.choice(("0.3", "1", "-1", "1e3", "nan", "x", "", "1e400", "0"))
            window.set(draw.choice((*fields, "vary_low")), "value", text)
        elif kind == "choose":
            name = draw.choice([*lists])
            window.set(name, "value", draw.choice(lists[name]))
        elif kind == "click":
            ends = (f"{axis}_range.{end}" for axis in "xy" for end in ("start", "end"))
            left, right, bottom, top = window.several("diagram-figure", *ends)
            window.click("diagram-figure", draw.uniform(left, right), draw.uniform(bottom, top))
        else:
            name = draw.choice(("code", "dark", "playing"))
            window.set(name, "active", not window.get(name, "active"))
    window.set("preset", "value", "choose a preset")
    window.set("preset", "value", "as given")
    window.wait(f"{model('gap_0')}.value == '0.2'")

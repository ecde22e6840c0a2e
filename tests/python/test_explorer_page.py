"""A page of the explorer on a document without a browser."""

import queue
import threading
from functools import partial

import numpy as np
import pytest
from bokeh.document import Document
from bokeh.events import Tap
from matplotlib import pyplot

import vibroimpact as vi
from explorer_desk import SMALL, Desk, zoom
from han_jin_hu_2004.parameters import INITIAL
from vibroimpact.explorer import app, compute, tables
from vibroimpact.explorer.app import Page
from vibroimpact.explorer.axis import Axis
from vibroimpact.explorer.code import python_code
from vibroimpact.explorer.presets import DEFAULT, PRESETS
from vibroimpact.explorer.state import from_query


def arguments(query):
    """What a web server makes of a query."""
    pairs = (part.partition("=") for part in query.split("&"))
    return {name: [value.encode()] for name, _, value in pairs}


@pytest.fixture
def coarse(monkeypatch):
    """Make every fine map a small one."""
    monkeypatch.setattr(compute, "FINE", dict.fromkeys(compute.FINE, SMALL))


@pytest.fixture
def desk(coarse):
    return Desk()


def test_a_page_shows_the_numbers_of_its_state(desk):
    motion = compute.motion(DEFAULT)
    assert np.array_equal(desk.named("film").data["v1"], motion.states[:, 1])
    assert np.array_equal(desk.named("impact").data["phase"], motion.run.impacts["phase"])
    assert np.array_equal(desk.named("stroboscopic").data["place"], motion.run.stroboscopic[:, 0])
    diagram = compute.diagram(DEFAULT, SMALL)
    assert np.array_equal(desk.named("diagram").data["value"], diagram.x1)
    assert "chaotic" in desk.named("verdict").text
    assert desk.named("address").tags == [DEFAULT.to_query()]


def test_the_machine_has_the_film_of_the_newest_motion(desk):
    for friction in (DEFAULT.system.friction, 0.25):
        desk.named("friction-slider").value = friction
        desk.settle()
        motion = compute.motion(DEFAULT.replace(friction=friction))
        assert np.array_equal(
            desk.named("film").data["tip_x"], motion.run.system.tip(motion.states[:, 0])
        )


def test_a_fine_map_begins_when_the_newest_pictures_are_drawn(coarse, monkeypatch):
    details = []

    def diagram(state, detail):
        details.append(detail)
        return compute.diagram(state, detail)

    monkeypatch.setitem(app._MAPS, "diagram", diagram)
    # An acknowledgement that is late on a busy machine is not taken for lost.
    monkeypatch.setattr(app, "PATIENCE", 300.0)
    desk = Desk()
    details.clear()
    sent = {name: desk.named(f"{name}-sent").tags for name in ("motion", "map")}
    desk.answers = False
    desk.named("friction-slider").value = 0.25
    while any(desk.named(f"{name}-sent").tags == tags for name, tags in sent.items()):
        for call in [*desk.waiting]:
            desk.waiting.remove(call)
            call()
    for call in [*desk.waiting]:
        desk.waiting.remove(call)
        call()
    assert details == [compute.COARSE["diagram"]]
    desk.answers = True
    for name in sent:
        desk.named(f"{name}-drawn").tags = desk.named(f"{name}-sent").tags
    desk.settle()
    assert details == [compute.COARSE["diagram"], SMALL]


def test_what_waits_for_rest_is_not_lost_by_another_change(coarse):
    desk = Desk()
    before = desk.page.motion
    # Timers stay; only what has been computed is shown.
    timers = []
    desk.document.add_timeout_callback = lambda call, _time: timers.append(call)
    desk.named("friction-slider").value = 0.25
    while desk.page.motion is before or desk.page.busy:
        while desk.waiting:
            desk.waiting.pop(0)()
    assert desk.named("verdict").text.count("largest exponent") == 0
    desk.page.change(theme="dark")
    desk.page.change(branch=True)
    desk.waiting.extend(timers)
    desk.document.add_timeout_callback = lambda call, _time: desk.waiting.append(call)
    desk.settle()
    state = DEFAULT.replace(friction=0.25)
    fine = compute.diagram(state, SMALL)
    assert np.array_equal(desk.named("diagram").data["value"], fine.x1)
    assert desk.page.verdict is not None
    assert "largest exponent" in desk.named("verdict").text
    assert "per unit of time 1/ω₂" in desk.named("verdict").text


def test_only_its_own_thread_touches_a_document(coarse):
    calls, threads, document = queue.SimpleQueue(), [], Document()
    document.add_next_tick_callback = lambda _show: threads.append(threading.current_thread())
    document.add_timeout_callback = lambda _call, _time: None
    Page(document, DEFAULT, soon=calls.put)
    # The motion and the map.
    for _ in range(2):
        calls.get()()
    assert threads == [threading.current_thread()] * 2


def test_slider_field_and_state_are_one(desk):
    desk.named("friction-slider").value = 0.25
    assert desk.page.state.system.friction == 0.25
    assert desk.named("friction").value == "0.25"
    desk.named("gap").value = "0.61"
    assert desk.page.state.system.gap == 0.61
    desk.named("moment_amplitude").value = "1e1"
    assert desk.named("moment_amplitude-slider").end == 10.0
    desk.named("law").value = "newton"
    assert desk.page.state.system.law == "newton"


def changed_by(desk, action):
    """Return the names of the models that an action changes, each change being a message."""
    changes = []
    desk.document.on_change(lambda event: changes.append(event))
    action()
    models = [event.model for event in changes if hasattr(event, "model")]
    return [model.name or type(model).__name__ for model in models]


def test_a_move_sends_field_and_address_and_a_motion_each_source_once(desk, monkeypatch):
    monkeypatch.setattr(app, "BETWEEN", 0.0)
    move = partial(desk.named("friction-slider").update, value=0.2500000001)
    assert changed_by(desk, move) == ["friction", "address", "friction-slider"]
    assert desk.page.state.system.friction == 0.25
    # What a slider gives is rounded, but not sent back: it may have moved on.
    assert desk.named("friction-slider").value == 0.2500000001
    names = changed_by(desk, desk.settle)
    for name in ("film", "impact", "stroboscopic", "scene"):
        assert names.count(name) == 1
    assert not {"history", "portrait", "ColumnDataSource", "GlyphRenderer"} & {*names}


def test_quick_moves_are_written_once_with_the_newest_value(desk, monkeypatch):
    monkeypatch.setattr(app, "BETWEEN", 60.0)
    slider, field = desk.named("friction-slider"), desk.named("friction")
    before = desk.named("address").tags
    for friction in (0.25, 0.3, 0.35):
        slider.value = friction
        assert desk.page.state.system.friction == friction
    assert desk.named("address").tags == before
    desk.settle()
    assert field.value == "0.35"
    assert desk.named("address").tags == [desk.page.state.to_query()]
    # A refusal is told at once, and nothing that is written later hides it.
    slider.value = 0.4
    desk.named("gap-slider").value = 0.6
    slider.value = -0.5
    assert field.value == "0.4"
    desk.settle()
    assert "friction = -0.5" in desk.named("friction-error").text
    assert desk.named("gap").value == "0.6"


@pytest.mark.parametrize(
    ("field", "text", "said"),
    [
        ("restitution", "1.5", "allowed: a number in [0, 1]"),
        ("restitution", "high", "allowed: a number, such as 0.5"),
        ("x1", "1.4", "initial"),
        ("gap", "nan", "allowed: a number"),
    ],
)
def test_a_bad_number_is_refused_beside_its_field(desk, field, text, said):
    desk.named(field).value = text
    error = desk.named(f"{field}-error")
    assert error.visible
    assert said in error.text
    assert desk.page.state == DEFAULT
    desk.named(field).value = "0.3"
    assert not error.visible


def test_clicks_choose_motions(desk):
    maps = desk.page.maps
    maps._tap_diagram(Tap(maps.diagram.figure, x=1.62, y=0.0))
    desk.settle()
    values = np.linspace(1.4, 2.0, 9)
    nearest = values[np.argmin(abs(values - 1.62))]
    assert desk.page.state.system.drive_frequency == nearest
    run = vi.simulate(DEFAULT.system.replace(drive_frequency=nearest), initial=INITIAL, periods=600)
    assert f">{run.label}<" in desk.named("verdict").text
    desk.named("map").active = 1
    desk.settle()
    maps._tap_chart(Tap(maps.chart.figure, x=1.41, y=0.64))
    assert desk.page.state.system.moment_amplitude == pytest.approx(0.65)
    desk.named("map").active = 2
    desk.settle()
    maps._tap_basins(Tap(maps.basins.figure, x=0.12, y=0.8))
    assert desk.page.state.initial == (0.125, 0.75, 0.0, 0.0)
    # Clicks on maps that the browser still shows, or shows already, while another one is drawn.
    desk.settle()
    shown = desk.page.state
    maps._tap_diagram(Tap(maps.diagram.figure, x=1.9, y=0.0))
    maps._tap_chart(Tap(maps.chart.figure, x=1.41, y=0.64))
    desk.named("map").active = 0
    desk.settle()
    maps._tap_basins(Tap(maps.basins.figure, x=0.12, y=0.8))
    assert desk.page.state == shown.replace(map="diagram")


@pytest.mark.parametrize("start", ["forward", "backward"])
def test_a_click_on_a_followed_column_shows_the_motion_of_the_column(monkeypatch, tmp_path, start):
    # Chaotic on the way down; from the start of the page it is another motion.
    detail = compute.Detail(columns=31, rows=0, periods=compute.PERIODS, keep=60)
    monkeypatch.setattr(compute, "FINE", dict.fromkeys(compute.FINE, detail))
    state = PRESETS["Paper, Fig. 9(3): 4-5"].replace(start=start)
    desk = Desk(state)
    diagram = compute.diagram(state, detail)
    maps = desk.page.maps
    before = desk.named("diagram").data["value"]
    others = 0
    for place in (4, 18, 20, 28):
        value = float(diagram.values[place])
        maps._tap_diagram(Tap(maps.diagram.figure, x=value, y=0.0))
        desk.settle()
        shown = desk.page.state
        assert (shown.system.drive_frequency, shown.origin) == (value, state.initial)
        assert shown.initial == diagram.run(place).initial
        # The last 60 drive periods of the motion are those of the column, to the last bit.
        column = diagram.x1[diagram.offset[place] : diagram.offset[place + 1]]
        assert np.array_equal(desk.page.motion.run.impacts["x1"][-len(column) :], column)
        others += not np.array_equal(
            compute.motion(state.replace(drive_frequency=value)).run.impacts["x1"],
            desk.page.motion.run.impacts["x1"],
        )
        # The diagram is the same: it begins where it began.
        assert np.array_equal(desk.named("diagram").data["value"], before)
    assert others
    made = {}
    monkeypatch.chdir(tmp_path)
    exec(compile(python_code(desk.page.state), "code", "exec"), made)
    assert np.array_equal(made["run"].impacts, desk.page.motion.run.impacts)
    assert np.array_equal(made["diagram"].x1, diagram.x1)
    assert from_query(arguments(desk.page.state.to_query()), DEFAULT) == desk.page.state
    # A start by hand is that of the diagram, too.
    desk.named("v1").value = "0.4"
    assert desk.page.state.origin is None
    pyplot.close("all")


def test_a_motion_that_a_click_has_left_comes_back(desk):
    maps, before = desk.page.maps, desk.named("motion-before")
    assert before.disabled
    maps._tap_diagram(Tap(maps.diagram.figure, x=1.62, y=0.0))
    desk.settle()
    second = desk.page.state
    desk.named("map").active = 2
    desk.settle()
    maps._tap_basins(Tap(maps.basins.figure, x=0.12, y=0.8))
    desk.settle()
    for left in (second, DEFAULT):
        assert not before.disabled
        desk.page.go_back()
        desk.settle()
        assert desk.page.state == left.replace(map="basins")
        motion = compute.motion(left)
        assert np.array_equal(desk.page.motion.run.impacts, motion.run.impacts)
    assert before.disabled


def test_a_zoom_computes_anew_and_goes_back(desk):
    zoom(desk, 1.5, 1.6)
    assert desk.page.state.vary == Axis(name="drive_frequency", low=1.5, high=1.6)
    at = desk.named("diagram").data["at"]
    assert set(at) <= set(np.linspace(1.5, 1.6, 9))
    assert not desk.named("back").disabled
    zoom(desk, 1.52, 1.54)
    desk.page.maps.go_back()
    assert desk.page.state.vary.high == 1.6
    desk.page.maps.go_back()
    desk.settle()
    assert desk.page.state == DEFAULT
    assert desk.named("back").disabled


@pytest.mark.parametrize("name", ["chart", "basins"])
def test_a_box_in_cells_gives_both_axes_a_range(desk, name):
    first, second = {"chart": ("across", "upward"), "basins": ("right", "up")}[name]
    desk.page.change(map=name)
    desk.settle()
    before = desk.page.state
    assert desk.named("back").disabled
    zoom(desk, 0.21, 0.33, 0.4, 0.45)
    state = desk.page.state
    assert (getattr(state, first).low, getattr(state, first).high) == (0.21, 0.33)
    assert (getattr(state, second).low, getattr(state, second).high) == (0.4, 0.45)
    image = desk.named(name).data
    assert image["x"][0] == pytest.approx(0.21, abs=0.02)
    assert image["y"][0] == pytest.approx(0.4, abs=0.02)
    desk.page.change(map="diagram")
    assert desk.named("back").disabled
    desk.page.change(map=name)
    assert not desk.named("back").disabled
    desk.page.maps.go_back()
    desk.settle()
    assert desk.page.state == before


def test_a_box_without_width_changes_nothing(desk):
    desk.page.change(map="chart")
    desk.settle()
    before = desk.page.state
    zoom(desk, 0.6, 0.6, 0.4, 0.45)
    assert desk.page.state == before
    assert desk.named("back").disabled


def test_the_branch_lies_over_the_diagram(coarse):
    state = PRESETS["Paper, Fig. 5(b): 1-1"].replace(
        vary=Axis(name="drive_frequency", low=1.78, high=1.84)
    )
    desk = Desk(state)
    assert desk.named("stable").data["xs"] == []
    desk.named("branch").active = True
    assert "following the motion" in desk.named("diagram-key").text
    desk.settle()
    assert "following" not in desk.named("diagram-key").text
    verdict = compute.verdict(state, compute.motion(state).run)
    branch = compute.branch(state, verdict.periodic)
    drawn = np.concatenate(desk.named("stable").data["ys"])
    stable = np.concatenate([p.impacts[p.stable].ravel() for p in branch.pieces])
    assert {*stable} <= {*drawn}
    assert len(desk.named("unstable").data["xs"])
    assert set(desk.named("marks").data["at"]) == {b.value for b in branch.bifurcations}
    key = desk.named("diagram-key").text
    for words in ("frictionless", "stable", "unstable", "Neimark-Sacker"):
        assert f"{words}</span>" in key
    assert set(desk.named("marks").data["marker"]) == {"star"}
    desk.named("branch").active = False
    assert "stable" not in desk.named("diagram-key").text


def test_an_empty_map_says_that_it_is_computed(desk):
    for shown, name in ((1, "chart"), (2, "basins"), (0, "diagram"), (1, "chart")):
        desk.named("map").active = shown
        # Not the picture of another system, either.
        column = "at" if name == "diagram" else "image"
        assert not len(desk.named(name).data[column])
        assert desk.named(f"{name}-sign").visible
        desk.settle()
        assert len(desk.named(name).data[column])
        assert not desk.named(f"{name}-sign").visible
    desk.named("drive_frequency").value = "0"
    desk.named("map").active = 0
    desk.named("vary").value = "gap"
    desk.settle()
    assert not desk.named("diagram-sign").visible


def test_a_system_without_drive_periods_has_no_map(desk):
    assert len(desk.named("diagram").data["at"])
    desk.named("preset").value = "Bouncing ball"
    desk.settle()
    assert "no drive frequency" in desk.named("map-error").text
    assert not len(desk.named("diagram").data["at"])
    assert desk.page.maps.result is None
    # A map over the drive frequency has them.
    desk.named("vary").value = "drive_frequency"
    desk.settle()
    assert not desk.named("map-error").visible
    assert desk.page.maps.result.parameter_name == "drive_frequency"


def test_a_motion_without_a_branch_is_told(desk):
    desk.named("branch").active = True
    desk.settle()
    assert "following" not in desk.named("diagram-key").text
    assert "not periodic" in desk.named("map-error").text


def test_presets_theme_code_and_files(desk):
    for name in PRESETS:
        desk.named("preset").value = name
        desk.settle()
        assert desk.page.state == PRESETS[name]
    desk.named("preset").value = "no such preset"
    assert desk.page.state == PRESETS[name]
    desk.named("dark").active = True
    assert desk.page.state.theme == "dark"
    assert desk.named("page").css_classes == ["dark"]
    desk.named("code").active = True
    assert desk.named("code-text").tags == [python_code(desk.page.state)]
    desk.page._download_motion()
    assert desk.named("motion-file").text == tables.of_run(desk.page.motion.run)

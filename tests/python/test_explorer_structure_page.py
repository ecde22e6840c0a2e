"""A page of the explorer of a structure, on a document without a browser."""

import numpy as np
import pytest
from bokeh.events import Tap
from matplotlib import pyplot

import vibroimpact as vi
from explorer_desk import Desk, zoom
from explorer_structures import BEAM, CHAIN, FREE, PAIR, ROUGH, SMALL
from struck import MIRRORED
from vibroimpact.explorer import compute
from vibroimpact.explorer.axis import Axis
from vibroimpact.explorer.code import python_code
from vibroimpact.explorer.server import first_state
from vibroimpact.explorer.structure_numbers import DAMPING, DRIVE
from vibroimpact.plot.stop_rows import BLOCK, places_of, rows_of
from vibroimpact.plot.style import STOPS


@pytest.fixture
def coarse(monkeypatch):
    """Make every map a small one."""
    monkeypatch.setattr(compute, "FINE", SMALL)
    monkeypatch.setattr(compute, "COARSE", SMALL)


@pytest.fixture
def desk(coarse):
    return Desk(first_state(PAIR, None))


def test_a_page_of_a_structure_shows_the_numbers_of_its_state(desk):
    motion = compute.motion(desk.page.state)
    film = desk.named("film").data
    for i in (0, 1):
        assert np.array_equal(film[f"curve{i}"], motion.states[:, 0, i])
    assert np.array_equal(film["place"], motion.states[:, 0, 0])
    for place, row in enumerate(rows_of(motion.machine.system)):
        shown = places_of(motion.machine.system, row, motion.time, motion.states[:, 0])
        assert np.array_equal(film[f"d{place}"], shown.block.astype(np.float32))
        assert np.array_equal(film[f"w{place}"], shown.walls[:, 0].astype(np.float32))
    impacts = motion.run.impacts
    drawn = desk.named("impact").data
    assert np.array_equal(drawn["u"], impacts["approach_velocity"])
    # Stop 0 acts on both coordinates, stop 1 on the last one.
    assert np.array_equal(drawn["hit1"], impacts["q"][:, 1])
    assert np.array_equal(np.isnan(drawn["hit0"]), impacts["stop"] == 1)
    assert np.array_equal(
        desk.named("stroboscopic").data["place"], motion.run.stroboscopic[:, 0, 0]
    )
    text = desk.named("verdict").text
    assert f">{motion.run.label}<" in text
    counts = np.bincount(impacts["stop"])
    assert f"{counts[0]} at stop 0, {counts[1]} at stop 1" in text
    assert desk.named("address").tags == [desk.page.state.to_query()]
    assert "stop 1</span>" in desk.named("diagram-key").text
    assert [*desk.named("rows").data["name"]] == ["q₀ \N{MINUS SIGN} q₁", "q₁"]
    walls = desk.named("walls")
    assert walls.data["name"] == ["stop 0", "stop 1"]
    # Colours of stops are those of the figures, in every view.
    assert walls.data["color"] == [STOPS[0][0], STOPS[1][0]]
    rgba = np.array([int(STOPS[stop][0][1:] + "FF", 16) for stop in impacts["stop"]], np.uint32)
    assert np.array_equal(drawn["color"], rgba)
    assert walls.tags == [[0, 1], [1, 1]]


def test_sliders_of_a_structure_change_it(desk):
    desk.named("gap_1-slider").value = 0.4
    assert desk.page.state.system == PAIR.replace(gap_1=0.4)
    desk.named(DRIVE).value = "2"
    twice = PAIR.replace(gap_1=0.4, drive_amplitude=2 * PAIR.drive_amplitude)
    assert desk.page.state.system == twice
    desk.named("simultaneous").value = "sequence"
    assert desk.page.state.system == twice.replace(simultaneous="sequence")
    desk.named("v1").value = "0.3"
    assert desk.page.state.initial == (0.0, 0.0, 0.0, 0.3)
    desk.settle()
    run = vi.simulate(desk.page.state.system, initial=[[0, 0], [0, 0.3]], periods=600, keep=100)
    assert np.array_equal(desk.named("impact").data["u"], run.impacts["approach_velocity"])
    for field, text, said in [
        ("restitution_0", "1.5", "allowed"),
        ("q1", "0.9", "stop"),
        (DAMPING, "-1", "allowed"),
    ]:
        before = desk.page.state
        desk.named(field).value = text
        assert said in desk.named(f"{field}-error").text
        assert desk.page.state == before


def test_another_coordinate_is_looked_at_without_a_new_run(desk):
    run = desk.page.motion.run
    desk.named("shown").value = "q1"
    assert desk.page.motion.run is run
    motion = desk.page.motion
    assert np.array_equal(desk.named("film").data["speed"], motion.states[:, 1, 1])
    assert np.array_equal(desk.named("stroboscopic").data["speed"], run.stroboscopic[:, 1, 1])
    desk.named("value").value = "q"
    desk.settle()
    diagram = compute.diagram(desk.page.state, SMALL["diagram"])
    assert np.array_equal(desk.named("diagram").data["value"], diagram.impacts["q"][:, 1])


@pytest.mark.parametrize("start", ["fresh", "forward", "backward"])
@pytest.mark.parametrize("vary", ["drive_frequency", DRIVE])
def test_a_click_on_a_column_of_a_structure_shows_its_motion(start, vary, monkeypatch):
    detail = compute.Detail(columns=7, rows=0, periods=compute.PERIODS, keep=20)
    monkeypatch.setattr(compute, "FINE", dict.fromkeys(compute.FINE, detail))
    monkeypatch.setattr(compute, "COARSE", SMALL)
    low, high = (1.1, 1.3) if vary == "drive_frequency" else (0.7, 1.3)
    state = first_state(PAIR, None).replace(start=start, vary=Axis(name=vary, low=low, high=high))
    desk = Desk(state)
    diagram = compute.diagram(state, detail)
    maps = desk.page.maps
    for place in (0, 3, 6):
        maps._tap_diagram(Tap(maps.diagram.figure, x=float(diagram.values[place]), y=0.0))
        desk.settle()
        assert desk.page.state.machine.numbers()[vary] == diagram.values[place]
        column = diagram.run(place).impacts["approach_velocity"]
        shown = desk.page.motion.run.impacts["approach_velocity"]
        assert len(column)
        assert np.array_equal(shown[-len(column) :], column)
        # The diagram is the same: it begins where it began.
        assert np.array_equal(desk.named("diagram").data["at"], diagram.impact_parameter)
    desk.page.go_back()
    assert desk.page.state.machine.numbers()[vary] == diagram.values[3]


def test_a_zoom_in_the_diagram_of_a_structure_and_the_way_back(desk):
    before = desk.page.state
    zoom(desk, 1.1, 1.15)
    assert desk.page.state.vary == Axis(name="drive_frequency", low=1.1, high=1.15)
    assert {*desk.named("diagram").data["at"]} <= {*np.linspace(1.1, 1.15, 7)}
    desk.page.maps.go_back()
    desk.settle()
    assert desk.page.state == before


def test_a_click_on_a_cell_of_the_chart_shows_its_motion(desk):
    desk.named("map").active = 1
    desk.named("upward").value = DRIVE
    desk.settle()
    maps, chart = desk.page.maps, desk.page.maps.result
    assert [*chart.axes] == ["drive_frequency", DRIVE]
    assert len(desk.named("chart").data["image"])
    x, y = (values[2].item() for values in chart.axes.values())
    maps._tap_chart(Tap(maps.chart.figure, x=x + 1e-3, y=y - 1e-3))
    desk.settle()
    assert desk.page.state.system == PAIR.replace(
        drive_frequency=x, drive_amplitude=y * PAIR.drive_amplitude
    )
    run = vi.simulate(desk.page.state.system, initial=np.zeros((2, 2)), periods=600, keep=100)
    assert f">{run.label}<" in desk.named("verdict").text


def test_a_number_of_all_stops_is_that_of_each(coarse):
    desk = Desk(first_state(CHAIN, None))
    assert desk.named("gap").value == "differ"
    assert desk.named("gap_0") is None
    desk.named("gap-slider").value = 0.5
    assert desk.page.state.system == CHAIN.replace(gap=0.5)
    assert desk.named("gap").value == "0.5"
    desk.settle()
    # Twelve stops on either side of six masses.
    struck = np.flatnonzero(np.bincount(desk.page.motion.run.impacts["stop"], minlength=12))
    drawn = [int(name.split()[1]) for name in desk.named("walls").data["name"]]
    assert {*struck} <= {*drawn}
    assert desk.named("blocks").tags == [6]
    assert [*desk.named("rows").data["name"]] == ["q₀", "q₁", "q₂", "q₃", "q₄", "q₅"]


def test_stops_on_either_side_of_a_mass_are_walls_of_one_row(coarse):
    desk = Desk(first_state(MIRRORED, None))
    walls, film = desk.named("walls"), desk.named("film").data
    assert [*desk.named("rows").data["name"]] == ["q₁"]
    assert walls.tags == [[0, 1], [0, -1]]
    left, right = walls.data["face"][1], walls.data["face"][0]
    assert (left, right) == (-0.5 * BLOCK, 1 + 0.5 * BLOCK)
    assert min(film["d0"]) == pytest.approx(0, abs=0.02)
    assert max(film["d0"]) == pytest.approx(1, abs=0.02)


def test_a_closed_stop_is_drawn_closed_and_said(coarse):
    desk = Desk(first_state(ROUGH, None))
    motion, film = desk.page.motion, desk.named("film").data
    closed = motion.forces[:, 0, 0] > 0.0
    assert 0 < closed.sum() < len(closed)
    assert np.array_equal(film["s0"] == 255, closed)
    assert set(film["says"][closed].tolist()) <= {2, 3}
    assert set(film["which"][closed].tolist()) == {0}


def test_what_makes_no_sense_for_a_structure_is_not_there(desk):
    page = desk.page
    assert desk.named("map").labels == ["Diagram", "Chart"]
    assert page.maps.root.select_one({"name": "basins-figure"}) is None
    assert not desk.named("branch").visible
    assert desk.named("preset").options == ["choose a preset", "as given"]
    # The page is as it was given again.
    desk.named("gap_0").value = "0.3"
    desk.named("preset").value = "as given"
    desk.settle()
    assert page.state == first_state(PAIR, None)
    desk.named("dark").active = True
    desk.named("code").active = True
    assert desk.named("code-text").tags == [python_code(page.state)]


def test_a_structure_without_drive_or_modes_of_its_own_has_a_page(coarse):
    desk = Desk(first_state(FREE, [[-0.2], [1.0]]))
    assert "no drive frequency" in desk.named("map-error").text
    assert len(desk.named("impact").data["u"])
    beam = Desk(first_state(BEAM, None))
    # One coordinate alone leaves the span of the modes, so that there is no start to change.
    assert beam.named("q0") is None
    assert len(beam.named("impact").data["u"])


def test_a_structure_without_stops_has_a_page(coarse):
    free = vi.Structure([[1.0]], [[1.0]], [], drive_amplitude=[1], drive_frequency=0.5)
    desk = Desk(first_state(free, None))
    assert len(desk.named("film").data["curve0"])
    assert "no impacts" in desk.named("diagram-key").text


def test_a_motion_that_ends_early_says_so_on_the_page_and_in_the_code(
    coarse, tmp_path, monkeypatch, capsys
):
    # Two stops that act on each other are met at once.
    corner = vi.Structure(
        np.eye(2),
        [[1, 0.1], [0.1, 1]],
        [vi.Stop([1, 0.2], 0.3, 0.8), vi.Stop([0.2, 1], 0.3, 0.8)],
        damping_ratios=[0.05, 0.05],
        drive_amplitude=[1, 1],
        drive_frequency=1.2,
    )
    desk = Desk(first_state(corner, None))
    run = desk.page.motion.run
    assert run.stop_reason == "simultaneous"
    text = desk.named("verdict").text
    assert "simultaneous" in text
    assert "the motion ends" in text
    monkeypatch.chdir(tmp_path)
    exec(compile(python_code(desk.page.state), "corner", "exec"), {})
    assert "the motion ends" in capsys.readouterr().out
    pyplot.close("all")
    desk.named("simultaneous").value = "together"
    desk.settle()
    assert desk.page.motion.run.stop_reason == "completed"


def test_a_move_of_a_structure_sends_each_source_once(desk):
    desk.named("gap_1-slider").value = 0.45
    changes = []
    desk.document.on_change(lambda event: changes.append(event))
    while desk.page.busy or desk.waiting:
        while desk.waiting:
            desk.waiting.pop(0)()
        if desk.page.motion.run.system == desk.page.state.system:
            break
    names = [event.model.name for event in changes if hasattr(event, "model")]
    for name in ("film", "impact", "stroboscopic"):
        assert names.count(name) == 1, name
    desk.settle()

"""Portraits and sections of structures show the numbers that their columns are named after."""

import numpy as np
import pytest
from matplotlib.figure import Figure

import vibroimpact as vi
from struck import RUNS, masses_run, moving_run, pressed_run


@pytest.fixture
def ax():
    return Figure().subplots()


def points(ax) -> np.ndarray:
    return np.concatenate([np.asarray(each.get_offsets()) for each in ax.collections])


def test_a_portrait_jumps_at_impacts_from_the_state_before_to_the_one_after(ax):
    run = masses_run()
    vi.plot.phase_portrait(run, coordinates=1, ax=ax)
    (curve,) = [each for each in ax.get_lines() if "q_1" in str(each.get_label())]
    path = np.column_stack(curve.get_data())
    shown = 0
    for hit in run.impacts:
        before = np.array([hit["q"][1], hit["v_pre"][1]])
        after = np.array([hit["q"][1], hit["v_post"][1]])
        places = np.flatnonzero((path == before).all(axis=1))
        if len(places):
            assert (path[places[0] + 1] == after).all()
            shown += 1
    assert shown > 0


def test_marks_of_a_portrait_lie_on_the_stops_that_act_on_the_coordinate(ax):
    run = moving_run()
    vi.plot.phase_portrait(run, ax=ax)
    marked = {
        str(each.get_label()): np.asarray(each.get_ydata())
        for each in ax.get_lines()
        if str(each.get_label()).startswith("stop")
    }
    assert marked.keys() <= {"stop 0", "stop 1"}
    for name, heights in marked.items():
        of = run.impacts[run.impacts["stop"] == int(name[-1])]
        assert np.isin(heights, of["v_pre"][:, 0]).all()


@pytest.mark.parametrize(
    ("x", "y"), [("q_1", "v_1"), ("v_0", "q_0"), (None, None)], ids=["second", "turned", "usual"]
)
def test_a_stroboscopic_section_has_the_numbers_asked_for(ax, x, y):
    run = masses_run()
    vi.plot.stroboscopic(run, x=x, y=y, ax=ax)
    rows = {"q": run.stroboscopic[:, 0], "v": run.stroboscopic[:, 1]}
    wanted = [rows[name[0]][:, int(name[2])] for name in (x or "q_0", y or "v_0")]
    assert (points(ax) == np.column_stack(wanted)).all()


def test_an_impact_section_has_a_point_for_each_impact_and_a_colour_for_each_stop(ax):
    run = moving_run()
    vi.plot.impact_section(run, x="v_pre_0", y="impulse_normal", ax=ax)
    found = points(ax)
    wanted = np.column_stack([run.impacts["v_pre"][:, 0], run.impacts["impulse_normal"]])
    assert sorted(map(tuple, found)) == sorted(map(tuple, wanted))
    assert len(ax.collections) == len(np.unique(run.impacts["stop"])) == 2
    colors = {tuple(each.get_facecolor()[0]) for each in ax.collections}
    assert len(colors) == 2
    assert [text.get_text() for text in ax.get_legend().get_texts()] == ["stop 0", "stop 1"]


def test_regimes_are_coloured_if_asked(ax):
    run = pressed_run()
    vi.plot.impact_section(run, color="regime", ax=ax)
    assert len(ax.collections) == len(np.unique(run.impacts["regime"]))
    assert ax.get_ylabel() == "approach velocity $u$"
    assert ax.get_xlabel() == r"drive phase $\psi$ at impact"


@pytest.mark.parametrize(
    ("draw", "given", "words"),
    [
        (vi.plot.stroboscopic, {"x": "q_2"}, "x = 'q_2'.*q_0, q_1, v_0, v_1"),
        (vi.plot.stroboscopic, {"y": "x1"}, "y = 'x1'"),
        (vi.plot.impact_section, {"x": "q"}, "x = 'q'.*v_post_1"),
        (vi.plot.impact_section, {"y": "v_pre_7"}, "y = 'v_pre_7'"),
        (vi.plot.phase_portrait, {"bodies": 1}, "bodies = 1.*a structure has coordinates"),
        (vi.plot.phase_portrait, {"coordinates": 2}, "coordinates = 2"),
        (vi.plot.phase_portrait, {"units": "SI"}, "units = 'SI'.*no scales"),
        (vi.plot.stroboscopic, {"units": "SI"}, "units = 'SI'.*no scales"),
        (vi.plot.impact_section, {"units": "SI"}, "units = 'SI'.*no scales"),
    ],
)
def test_what_a_structure_does_not_have_is_refused_by_name(draw, given, words):
    with pytest.raises(vi.ParameterError, match=words):
        draw(masses_run(), **given)


def test_without_a_drive_there_is_no_stroboscopic_section():
    ball = vi.Structure([[1]], [[0]], [vi.Stop([1], 0, 0.5)], static_load=[1])
    run = vi.simulate(ball, initial=[[-1], [0]], time=3)
    with pytest.raises(vi.ParameterError, match="drive_frequency"):
        vi.plot.stroboscopic(run)
    assert vi.plot.impact_section(run, ax=Figure().subplots()).get_xlabel() == "time $t$"


@pytest.mark.parametrize("name", RUNS)
@pytest.mark.parametrize(
    "draw", [vi.plot.phase_portrait, vi.plot.stroboscopic, vi.plot.impact_section]
)
def test_any_run_is_drawn(name, draw, ax):
    assert draw(RUNS[name](), ax=ax) is ax

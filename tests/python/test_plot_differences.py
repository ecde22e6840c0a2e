"""Differences of coordinates, such as q_0-q_1, are drawn wherever a coordinate is."""

import numpy as np
import pytest
from matplotlib.figure import Figure

import vibroimpact as vi
from struck import MIRRORED, PRESSED, REST, masses_run, moving_run
from test_plot_motion import line
from vibroimpact.plot.coordinates import Combination, named, single


@pytest.fixture
def ax():
    return Figure().subplots()


def test_names_are_sums_and_differences_of_numbers_of_one_column():
    assert named("q_1", ("q", "v"), 3) == ("q", single(1))
    assert named("q_0-q_1", ("q", "v"), 3) == ("q", Combination(((1, 0), (-1, 1))))
    assert named(" - v_2 + v_0 ", ("q", "v"), 3) == ("v", Combination(((-1, 2), (1, 0))))
    assert named("v_pre_0-v_pre_1", ("v_pre",), 2) == ("v_pre", Combination(((1, 0), (-1, 1))))
    for name in ("q", "q_0-", "q_0 q_1", "q_0-v_1", "q_0-q_0", "q_0-q_3", "q_00", "2q_0", "", "-"):
        assert named(name, ("q", "v"), 3) is None
    for form in (single(2), Combination(((-1, 2), (1, 0)))):
        assert named(form.name("q"), ("q",), 3) == ("q", form)


def test_a_combination_is_its_row():
    values = np.random.default_rng(1).normal(size=(5, 2, 4))
    for form in (single(3), Combination(((1, 0), (-1, 2))), Combination(((-1, 1), (1, 3)))):
        assert form.of(values) == pytest.approx(values @ form.row(4), abs=1e-15)
    assert np.array_equal(single(3).of(values), values[..., 3])
    assert Combination(((1, 0), (-1, 11))).symbol("q") == "q_0 - q_{11}"
    assert Combination(((-1, 0), (1, 1))).symbol("v") == r"-\dot q_0 + \dot q_1"


def test_a_history_of_a_difference_meets_the_stop_between_two_bodies(ax):
    run = masses_run()
    vi.plot.time_history(run, coordinates=["q_0-q_1", 1], periods=4, ax=ax)
    assert ax.get_ylabel() == r"coordinates $q_0 - q_1,\ q_1$"
    time, between = line(ax, "$q_0 - q_1$")
    q = run.trajectory(time)[:, 0]
    assert between == pytest.approx(q[:, 0] - q[:, 1], abs=1e-12)
    levels = {each.get_gid(): each for each in ax.get_lines() if "stop" in str(each.get_gid())}
    # Stop 1 moves between the two bodies, stop 0 is met by the second.
    assert {*levels} == {"stop-0", "stop-1"}
    stop = run.system.stops[1]
    level = stop.gap + stop.amplitude * np.cos(run.system.drive_frequency * time + stop.phase)
    assert levels["stop-1"].get_ydata() == pytest.approx(level, abs=1e-12)
    assert (between <= level + 1e-12).all()
    vi.plot.time_history(run, coordinates="q_1-q_0", ax=(other := Figure().subplots()))
    (turned,) = [each for each in other.get_lines() if each.get_gid() == "stop-1"]
    assert turned.get_ydata().max() < 0.0


def test_a_portrait_of_a_difference_is_that_of_both(ax):
    run = masses_run()
    vi.plot.phase_portrait(run, coordinates="q_0-q_1", periods=4, ax=ax)
    assert (ax.get_xlabel(), ax.get_ylabel()) == (
        "coordinates $q_0 - q_1$",
        r"velocities $\dot q_0 - \dot q_1$",
    )
    x, y = line(ax, r"$q_0 - q_1,\ \dot q_0 - \dot q_1$")
    for place in range(2):
        other = Figure().subplots()
        vi.plot.phase_portrait(run, coordinates=place, periods=4, ax=other)
        q, v = line(other, rf"$q_{place},\ \dot q_{place}$")
        x, y = (x - q, y - v) if place == 0 else (x + q, y + v)
    assert x == pytest.approx(0.0, abs=1e-12)
    assert y == pytest.approx(0.0, abs=1e-12)


def test_sections_of_differences(ax):
    run = masses_run()
    vi.plot.stroboscopic(run, x="q_0-q_1", y="v_0 - v_1", ax=ax)
    assert ax.get_ylabel() == r"velocities $\dot q_0 - \dot q_1$ once per drive period"
    rows = run.stroboscopic
    expected = np.column_stack([rows[:, 0, 0] - rows[:, 0, 1], rows[:, 1, 0] - rows[:, 1, 1]])
    assert np.array_equal(ax.collections[0].get_offsets(), expected)
    other = Figure().subplots()
    vi.plot.impact_section(run, x="phase", y="v_post_1-v_post_0", ax=other)
    assert other.get_ylabel() == r"velocities $\dot q_1 - \dot q_0$ after impact"
    drawn = np.concatenate([each.get_offsets()[:, 1] for each in other.collections])
    after = run.impacts["v_post"]
    assert sorted(drawn) == sorted(after[:, 1] - after[:, 0])


def test_diagrams_and_branches_of_differences(ax):
    diagram = vi.bifurcation_diagram(
        PRESSED, initial=REST[2], drive_frequency=[0.9, 1.0], periods=20
    )
    for value, section in (("q_0-q_1", "impact"), ("v_1-v_0", "stroboscopic")):
        drawn = Figure().subplots()
        vi.plot.bifurcation(diagram, value=value, section=section, color=None, ax=drawn)
        assert " - " in drawn.get_ylabel()
    heights = np.concatenate([each.get_offsets()[:, 1] for each in drawn.collections])
    sections = diagram.stroboscopic[:, 1]
    assert {*heights} >= {*(sections[:, 1] - sections[:, 0])}
    whole, parts = Figure().subplots(1, 2)
    vi.plot.bifurcation(diagram, value="q_1", section="stroboscopic", ax=whole)
    vi.plot.bifurcation(diagram, value="q", coordinate=1, section="stroboscopic", ax=parts)
    offsets = [each.collections[0].get_offsets() for each in (whole, parts)]
    assert np.array_equal(*offsets)
    assert whole.get_ylabel() == parts.get_ylabel()

    motion = vi.simulate(MIRRORED, initial=REST[2], periods=600, keep=50).refine()
    branch = motion.follow(drive_frequency=(1.25, 1.35))
    vi.plot.branches(branch, value="q_0-q_1", section="stroboscopic", diagram=None, ax=ax)
    assert ax.get_ylabel().startswith("coordinates $q_0 - q_1$")
    paths = [path.vertices[:, 1] for each in ax.collections for path in each.get_paths()]
    drawn = np.concatenate(paths)
    for piece in branch.pieces:
        expected = piece.at_sections("q", 0) - piece.at_sections("q", 1)
        assert {*expected.ravel()} <= {*drawn}


def test_a_periodic_motion_of_a_difference():
    motion = vi.simulate(MIRRORED, initial=REST[2], periods=600, keep=50).refine()
    portrait, history = vi.plot.orbit(motion, coordinates=["q_0-q_1"])
    assert portrait.get_xlabel() == history.get_ylabel() == "coordinates $q_0 - q_1$"


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (
            lambda run: vi.plot.impact_section(run, x="v_0"),
            "x = 'v_0' is not allowed; allowed: one of time, .* q_0, q_1, v_pre_0, v_pre_1, "
            r"v_post_0, v_post_1, or a difference, as q_0-q_1, did you mean v_pre_0\?",
        ),
        (
            lambda run: vi.plot.impact_section(run, y="v_pre"),
            r"y = 'v_pre' .*, did you mean v_pre_0\?",
        ),
        (
            lambda run: vi.plot.stroboscopic(run, x="v_pre_1"),
            "x = 'v_pre_1' is not allowed; allowed: one of q_0, q_1, v_0, v_1, or a difference, "
            r"as q_0-q_1, did you mean v_1\?",
        ),
        (lambda run: vi.plot.stroboscopic(run, y="q_0-v_1"), "y = 'q_0-v_1' is not allowed"),
        (
            lambda run: vi.plot.phase_portrait(run, coordinates="v_0"),
            "coordinates = 'v_0' is not allowed; allowed: None, a number from 0 to 1, a differe",
        ),
        (lambda run: vi.plot.phase_portrait(run, coordinates=["q_0", 0]), "coordinates = "),
        (lambda run: vi.plot.time_history(run, coordinates="q_0-q_2"), "coordinates = 'q_0-q_2'"),
        (lambda run: vi.plot.time_history(run, coordinates=[True]), "coordinates = "),
        (lambda run: vi.plot.time_history(run, coordinates=[]), "coordinates = "),
    ],
)
def test_what_is_no_coordinate_is_refused_with_a_hint(call, words):
    with pytest.raises(vi.ParameterError, match=f"^{words}"):
        call(masses_run())


def test_a_single_coordinate_has_no_differences():
    with pytest.raises(vi.ParameterError, match=r"allowed: one of q_0, v_0, did you mean q_0"):
        vi.plot.stroboscopic(moving_run(), x="q_0-q_1")

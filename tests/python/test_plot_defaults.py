"""The first picture of any run is a good one: values, windows, samples and legends by default."""

import math

import numpy as np
import pytest
from matplotlib.figure import Figure

import vibroimpact as vi
from systems import PAPER, ROUGH, STICKY
from vibroimpact.plot.curve import sample, shown_window
from vibroimpact.plot.style import BODY_COLORS

# Shaw and Holmes: x'' + x = cos wt, a wall at 0.
WALL = vi.System(
    mass_ratio=0.0,
    frequency_ratio=1.0,
    restitution=0.8,
    gap=0.0,
    drive_frequency=2.6,
    moment_amplitude=1.0,
    contact="direct",
)
BALL = WALL.replace(frequency_ratio=0.0, restitution=0.9, drive_frequency=0.0)
AT_REST = (0.0, 0.0, 0.0, 0.0)
RUN_DRAWINGS = (
    vi.plot.time_history,
    vi.plot.phase_portrait,
    vi.plot.displacement_history,
    vi.plot.gap_history,
    vi.plot.contact_force,
    vi.plot.impact_section,
    vi.plot.impact_count,
    vi.plot.stroboscopic,
    vi.plot.animation,
)


@pytest.fixture(scope="module")
def wall_run() -> vi.Run:
    return vi.simulate(WALL, initial=AT_REST, periods=300, keep=100)


@pytest.fixture(scope="module")
def ball() -> vi.Run:
    return vi.simulate(BALL, initial=(-0.5, 0.0, 0.0, 0.0), time=40.0)


@pytest.fixture(scope="module")
def rough() -> vi.Run:
    return vi.simulate(ROUGH, initial=(0, 0.5, 0, 0), periods=300, keep=100)


@pytest.fixture(scope="module")
def wall_diagram() -> vi.Diagram:
    return vi.bifurcation_diagram(
        WALL, initial=AT_REST, periods=60, keep=10, drive_frequency=np.linspace(2.5, 2.6, 5)
    )


@pytest.fixture
def ax():
    return Figure().subplots()


def texts(ax) -> list[str]:
    legend = ax.get_legend()
    return [] if legend is None else [text.get_text() for text in legend.get_texts()]


def test_a_wall_at_rest_has_its_approach_velocity_drawn(wall_diagram, ax):
    assert np.ptp(wall_diagram.x1) == 0.0  # so the angle would say nothing
    vi.plot.bifurcation(wall_diagram, ax=ax)
    heights = np.asarray(ax.collections[0].get_offsets())[:, 1]
    assert np.array_equal(heights, wall_diagram.approach_velocity)
    assert "approach velocity" in ax.get_ylabel()


def test_the_angle_is_drawn_where_it_says_something(ax):
    diagram = vi.bifurcation_diagram(
        PAPER, initial=(0, 0.5, 0, 0), periods=60, keep=10, drive_frequency=[1.8, 1.9]
    )
    vi.plot.bifurcation(diagram, ax=ax)
    assert np.array_equal(np.asarray(ax.collections[0].get_offsets())[:, 1], diagram.x1)


def test_a_driven_wall_is_not_at_rest(ax):
    moved = WALL.replace(force_amplitude=0.3, oscillator_damping=0.1)
    diagram = vi.bifurcation_diagram(
        moved, initial=AT_REST, periods=60, keep=10, drive_frequency=[2.5, 2.6]
    )
    vi.plot.bifurcation(diagram, ax=ax)
    assert np.array_equal(np.asarray(ax.collections[0].get_offsets())[:, 1], diagram.x1)


@pytest.fixture(scope="module")
def wall_branch() -> vi.Branch:
    run = vi.simulate(WALL.replace(drive_frequency=2.4), initial=AT_REST, periods=600)
    return vi.follow_motion(run.refine(), drive_frequency=(2.3, 2.5))


def test_branches_of_a_wall_are_not_flat(wall_branch, wall_diagram, ax):
    vi.plot.branches(wall_branch, diagram=wall_diagram, ax=ax)
    assert "approach velocity" in ax.get_ylabel()
    low, high = ax.get_ylim()
    assert high - low > 0.01


@pytest.mark.parametrize("value", ["x1", "v1", "v2", "phase", "approach_velocity"])
def test_a_piece_gives_the_values_of_its_motions(wall_branch, value):
    piece = wall_branch.pieces[0]
    column = {"v1": "v1_pre", "v2": "v2_pre"}.get(value, value)
    for k in (0, len(piece.values) // 2):
        assert piece.at_impacts(value)[k] == pytest.approx(piece.motion(k).impacts[column])


def test_a_piece_gives_the_states_of_its_sections(wall_branch):
    piece = wall_branch.pieces[0]
    for number, name in enumerate(("x1", "v1", "x2", "v2")):
        assert piece.at_sections(name)[0] == pytest.approx(piece.motion(0).sections[:, number])
    assert np.array_equal(piece.sections, piece.at_sections("x1"))
    for ask in (piece.at_impacts, piece.at_sections):
        with pytest.raises(vi.ParameterError, match="name = 'u'"):
            ask("u")


def test_a_line_of_phases_is_cut_at_the_end_of_the_turn(wall_branch, ax):
    vi.plot.branches(wall_branch, value="phase", ax=ax)
    for item in ax.collections:
        for line in item.get_segments():
            assert np.abs(np.diff(line[:, 1])).max(initial=0.0) <= math.pi
    assert ax.get_ylim() == (0.0, 2 * math.pi)
    with pytest.raises(vi.ParameterError, match="value = 'energy_loss'"):
        vi.plot.branches(wall_branch, value="energy_loss", ax=ax)


def test_the_impact_section_of_a_wall_shows_something(wall_run, ball, ax):
    vi.plot.impact_section(wall_run, ax=ax)
    drawn = np.asarray(ax.collections[0].get_offsets())
    impacts = wall_run.impacts
    assert drawn[:, 0].tolist() == impacts["phase"].tolist()
    assert drawn[:, 1] == pytest.approx(impacts["v1_pre"] - impacts["v2_pre"])
    other = Figure().subplots()
    vi.plot.impact_section(ball, ax=other)
    drawn = np.asarray(other.collections[0].get_offsets())
    assert drawn[:, 0].tolist() == ball.impacts["time"].tolist()
    assert np.all(np.diff(drawn[:, 1]) < 0.0)


def test_an_unknown_column_is_refused(rough, ax):
    with pytest.raises(vi.ParameterError, match=r"y = 'v1_pro' .* did you mean v1_pre"):
        vi.plot.impact_section(rough, y="v1_pro", ax=ax)


def test_a_settled_motion_is_a_point_and_not_its_rounding(ax):
    run = vi.simulate(PAPER, initial=(0, 0.5, 0, 0), periods=600, keep=100)
    rows = run.stroboscopic
    assert 0.0 < np.ptp(rows[:, 0]) < 1e-6
    vi.plot.stroboscopic(run, ax=ax)
    low, high = ax.get_xlim()
    assert high - low > 0.1 * abs(rows[0, 0])
    assert low < rows[:, 0].min() <= rows[:, 0].max() < high


def test_the_stroboscopic_section_is_drawn(rough, ball, ax):
    vi.plot.stroboscopic(rough, x="x2", y="v2", ax=ax)
    drawn = np.asarray(ax.collections[0].get_offsets())
    assert np.array_equal(drawn, rough.stroboscopic[:, 2:])
    with pytest.raises(vi.ParameterError, match=r"drive_frequency = 0.0"):
        vi.plot.stroboscopic(ball)
    with pytest.raises(vi.ParameterError, match="x = 'v3'"):
        vi.plot.stroboscopic(rough, x="v3")


@pytest.mark.parametrize("draw", RUN_DRAWINGS, ids=lambda draw: draw.__name__)
def test_a_result_of_another_kind_is_told_what_draws_it(wall_diagram, draw):
    with pytest.raises(vi.ParameterError, match=r"run = <Diagram .*Run; .*: bifurcation"):
        draw(wall_diagram)


@pytest.mark.parametrize(
    ("draw", "name"),
    [
        (vi.plot.bifurcation, "diagram"),
        (vi.plot.contact_fraction, "diagram"),
        (vi.plot.branches, "branches"),
        (vi.plot.orbit, "motion"),
        (vi.plot.chart, "chart"),
        (vi.plot.basins, "basins"),
    ],
    ids=lambda each: getattr(each, "__name__", each),
)
def test_a_run_given_to_another_drawing_is_told_what_draws_it(rough, draw, name):
    with pytest.raises(vi.ParameterError, match=rf"{name} = <Run .*: time_history, phase_portrait"):
        draw(rough)


@pytest.mark.parametrize("draw", [*RUN_DRAWINGS[:4], vi.plot.impact_section])
def test_an_unknown_colour_is_refused(rough, draw):
    with pytest.raises(vi.ParameterError, match="color = 'red'"):
        draw(rough, color="red")


@pytest.mark.parametrize("bodies", [1, (1,), [1]])
def test_one_body_can_be_given_by_its_number(rough, ax, bodies):
    vi.plot.phase_portrait(rough, bodies=bodies, ax=ax)
    assert [line.get_label() for line in ax.lines] == [r"$x_1,\ \dot x_1$"]


@pytest.mark.parametrize("bodies", [3, 0, (), "1", (1, 3), True, 1.5])
def test_other_bodies_are_refused(rough, bodies):
    with pytest.raises(vi.ParameterError, match="bodies ="):
        vi.plot.phase_portrait(rough, bodies=bodies)


def test_a_wall_at_rest_has_no_portrait_of_its_own(wall_run, ax):
    vi.plot.phase_portrait(wall_run, ax=ax)
    assert ax.get_xlabel() == "position $x_1$ of body 1"


def test_legends_name_the_curves_unless_told_otherwise(rough):
    for draw, wanted in (
        (vi.plot.time_history, {r"$x_2$", r"$\sin x_1-\delta$", r"$\cos\omega t$"}),
        (vi.plot.phase_portrait, {r"$x_1,\ \dot x_1$", r"$x_2,\ \dot x_2$"}),
        (vi.plot.displacement_history, {"$x_1$", "$x_2$"}),
        (vi.plot.contact_force, {"normal, $p$", "tangential"}),
    ):
        ax = Figure().subplots()
        draw(rough, ax=ax)
        assert wanted <= set(texts(ax))
        bare = Figure().subplots()
        draw(rough, legend=False, ax=bare)
        assert bare.get_legend() is None
        with pytest.raises(vi.ParameterError, match="legend = 'best'"):
            draw(rough, legend="best", ax=bare)


def test_a_legend_fits_beside_another_picture(rough):
    left, right = Figure(figsize=(7.1, 2.6), layout="constrained").subplots(1, 2)
    vi.plot.time_history(rough, color="regime", ax=left)
    vi.plot.phase_portrait(rough, color="regime", ax=right)
    left.figure.canvas.draw()
    boxes = [ax.get_legend().get_window_extent() for ax in (left, right)]
    assert not boxes[0].overlaps(boxes[1])


def test_a_small_motion_is_not_flattened_by_the_drive(ax):
    small = PAPER.replace(moment_amplitude=0.02, gap=0.004)
    run = vi.simulate(small, initial=(0, 0.005, 0, 0), periods=100, keep=20)
    vi.plot.time_history(run, ax=ax)
    curves = {line.get_label(): np.asarray(line.get_ydata()) for line in ax.lines}
    low, high = ax.get_ylim()
    assert np.ptp(curves[r"$x_2$"]) > 0.3 * (high - low)
    assert r"$\cos\omega t$, scaled" in curves
    plain = Figure().subplots()
    vi.plot.time_history(run, drive="plain", ax=plain)
    drive = next(line for line in plain.lines if line.get_label() == r"$\cos\omega t$")
    assert np.ptp(drive.get_ydata()) == pytest.approx(2.0, abs=1e-3)
    with pytest.raises(vi.ParameterError, match="drive = 'scale'"):
        vi.plot.time_history(run, drive="scale")


def test_what_is_not_driven_has_no_drive(ball, ax):
    vi.plot.time_history(ball, ax=ax)
    assert not any("omega" in str(line.get_label()) for line in ax.lines)


def test_every_small_bounce_is_resolved(ball):
    curve = sample(ball)
    start, end = shown_window(ball)
    last = float(ball.impacts["time"][-1])
    # Down to rest, and little beyond.
    rest = float(ball.contacts["time"].max())
    assert (start, ball.stop_reason) == (0.0, "rest")
    assert rest < end < 1.2 * rest
    for low, high in zip(ball.impacts["time"][:-1], ball.impacts["time"][1:], strict=True):
        inside = (curve.time > low) & (curve.time < high)
        assert inside.sum() >= 10
        # The top of a parabola between two impacts, u^2/2 for a load of 1.
        depth = -curve.state[inside, 0].min()
        assert depth == pytest.approx((high - low) ** 2 / 8, rel=0.01)
    # Bounces of the chatter, which the table of impacts does not list.
    x1 = curve.state[(curve.time > last) & (curve.time < rest), 0]
    tops = np.flatnonzero((x1[1:-1] < x1[:-2]) & (x1[1:-1] < x1[2:]))
    assert len(tops) > 20


def test_a_slow_drive_shows_what_can_be_read():
    slow = STICKY.replace(drive_frequency=0.01)
    run = vi.simulate(slow, initial=AT_REST, periods=10)
    start, end = shown_window(run)
    assert end == run.final_state.time
    assert end - start == pytest.approx(slow.drive_period)
    assert len(sample(run).time) > 60 * slow.drive_period / (2 * math.pi / slow.frequency_ratio)


def test_a_window_has_no_more_impacts_than_can_be_read():
    elastic = BALL.replace(restitution=1.0)
    run = vi.simulate(elastic, initial=(-0.001, 0.0, 0.0, 0.0), time=40.0)
    assert len(run.impacts) > 100
    assert sample(run).impacts.sum() <= 61


@pytest.mark.parametrize("window", [(2.0, 1.0), (1.0, 1.0), (1.0,), "ab", 3, (0.0, math.nan)])
def test_a_window_that_is_none_is_refused(rough, window):
    with pytest.raises(vi.ParameterError, match="window ="):
        vi.plot.time_history(rough, window=window)


@pytest.mark.parametrize("options", [{"periods": 0}, {"periods": "8"}, {"points_per_period": 0}])
def test_lengths_and_samples_are_checked(rough, options):
    with pytest.raises(vi.ParameterError, match=next(iter(options))):
        vi.plot.time_history(rough, **options)


def test_a_periodic_motion_is_drawn_once_and_others_longer(rough, ax):
    run = vi.simulate(PAPER, initial=(0, 0.5, 0, 0), periods=600, keep=100)
    vi.plot.phase_portrait(run, ax=ax)
    (impact,) = run.impacts[-1:]
    x1 = np.asarray(ax.lines[0].get_xdata())
    assert np.count_nonzero(np.abs(x1 - impact["x1"]) < 1e-6) == 2  # before and after one impact
    other = Figure().subplots()
    assert rough.period.m is None
    vi.plot.phase_portrait(rough, ax=other)
    assert len(other.lines[0].get_xdata()) > 5 * len(x1)


def test_a_body_has_one_colour_in_every_picture(rough):
    run = vi.simulate(PAPER, initial=(0, 0.5, 0, 0), periods=600, keep=100)
    for draw, first, second in (
        (vi.plot.time_history, r"$\sin x_1-\delta$", "$x_2$"),
        (vi.plot.displacement_history, "$x_1$", "$x_2$"),
        (vi.plot.phase_portrait, r"$x_1,\ \dot x_1$", r"$x_2,\ \dot x_2$"),
    ):
        lines = {line.get_label(): line for line in draw(run, ax=Figure().subplots()).lines}
        assert lines[first].get_color() == BODY_COLORS[1]
        assert lines[second].get_color() == BODY_COLORS[2]
        assert lines[first].get_linewidth() < lines[second].get_linewidth()


def test_counts_over_less_than_a_decade_have_linear_axes(rough, ax):
    vi.plot.impact_count(rough, ax=ax)
    assert (ax.get_xscale(), ax.get_yscale()) == ("linear", "linear")
    assert all(float(tick).is_integer() for tick in ax.get_yticks())
    whole = vi.simulate(ROUGH, initial=(0, 0.5, 0, 0), periods=300)
    other = Figure().subplots()
    vi.plot.impact_count(whole, ax=other)
    assert (other.get_xscale(), other.get_yscale()) == ("log", "log")


def test_no_contact_is_said_in_words(rough, ax):
    vi.plot.contact_force(rough, ax=ax)
    assert [text.get_text() for text in ax.texts] == ["no sustained contact in this window"]

"""The time history of a structure shows its own coordinates, stops, impacts and contacts."""

import numpy as np
import pytest
from matplotlib import pyplot
from matplotlib.figure import Figure

import vibroimpact as vi
from struck import (
    BEAM,
    MOVING,
    PRESSED,
    SETTLING,
    masses_run,
    moving_run,
    orbit,
    pressed_run,
    small_diagram,
)
from test_plot_motion import line
from test_symmetric_motions import sides, symmetric
from two_masses import structure
from vibroimpact.plot.structure_history import closed_spans


def settled(system):
    """Return the periodic motion on which a structure settles from rest."""
    rest = np.zeros((2, system.coordinates))
    found = vi.simulate(system, initial=rest, periods=400, keep=100).refine()
    assert isinstance(found, vi.StructureOrbit)
    return found


# Seven impacts at two stops, one with modes, and one with chatter and contact.
ORBITS = {
    "masses": lambda: settled(
        vi.Structure(
            [[1, 0], [0, 2]],
            [[2, -1], [-1, 1]],
            [vi.Stop([1, -1], 0.3, 0.7), vi.Stop([0, 1], 0.3, 0.8)],
            damping_ratios=[0.05, 0.05],
            drive_amplitude=[1, 1j],
            drive_frequency=1.0,
        )
    ),
    "beam": lambda: settled(BEAM),
    "contact": lambda: settled(
        SETTLING.replace(restitution=0.1, static_load=[0.8], drive_frequency=0.5, gap=0.1)
    ),
}


@pytest.fixture(autouse=True)
def _no_figure_is_left():
    yield
    pyplot.close("all")


@pytest.fixture
def ax():
    return Figure().subplots()


@pytest.fixture
def run() -> vi.StructureRun:
    return moving_run()


def level(ax, number):
    (found,) = [item for item in ax.get_lines() if item.get_gid() == f"stop-{number}"]
    return np.asarray(found.get_xdata()), np.asarray(found.get_ydata())


def bands(ax):
    found = {}
    for item in ax.collections:
        if str(item.get_gid()).startswith("contact-"):
            boxes = [path.vertices[:, 0] for path in item.get_paths()]
            found[item.get_gid()] = [(box.min(), box.max()) for box in boxes]
    return found


def test_coordinates_are_those_of_the_trajectory(ax):
    run = vi.simulate(structure(), initial=np.zeros((2, 2)), periods=20)
    assert vi.plot.time_history(run, periods=5, ax=ax) is ax
    for i in (0, 1):
        time, q = line(ax, f"$q_{i}$")
        assert np.allclose(q, run.trajectory(time)[:, 0, i], rtol=0, atol=1e-12)
    assert time[-1] == run.final_state.time
    assert time[-1] - time[0] == pytest.approx(5 * run.system.drive_period)
    assert (ax.get_xlabel(), ax.get_ylabel()) == ("time $t$", "coordinates $q_0,\\ q_1$")


def test_a_coordinate_meets_its_stops_at_their_impacts_and_never_crosses_them(run, ax):
    run.plot(ax=ax)
    time, q = line(ax, "$q_0$")
    for number, sign in ((0, 1), (1, -1)):
        when, where = level(ax, number)
        assert (when == time).all()
        assert (sign * (q - where)).max() < 1e-13
        marked, heights = line(ax, f"stop {number}")
        rows = run.impacts[(run.impacts["stop"] == number) & (run.impacts["time"] > time[0])]
        assert len(rows) > 2
        assert marked.tolist() == rows["time"].tolist()
        assert heights.tolist() == rows["q"][:, 0].tolist()
        assert np.abs(np.interp(marked, when, where) - heights).max() < 1e-12
    # 2 q = 0.6 + 0.4 cos(0.7 t)
    assert np.allclose(level(ax, 0)[1], 0.3 + 0.2 * np.cos(0.7 * time), rtol=0, atol=1e-12)


def test_bands_are_the_times_in_contact(run, ax):
    window = (run.kept_from, run.final_state.time)
    run.plot(window=window, ax=ax)
    (spans,) = bands(ax).values()
    assert len(spans) > 3
    assert sum(end - start for start, end in spans) == pytest.approx(run.time_in_contact, rel=1e-9)
    for start, end in spans:
        times = np.linspace(start, end, 12)[1:-1]
        _, forces = run.trajectory(times, forces=True)
        assert (forces[:, 0, 0] > 0.0).all()
    assert "contact" in [text.get_text() for text in ax.get_legend().get_texts()]


def test_sticking_is_told_from_sliding(ax):
    run = pressed_run()
    window = (0.0, run.final_state.time)
    spans = closed_spans(run, window)
    modes = {span.mode for span in spans}
    assert modes == {"slide", "stick"}
    rows = {kind: run.contacts[run.contacts["kind"] == kind]["time"] for kind in vi.EventKind}
    starts = {mode: [span.start for span in spans if span.mode == mode] for mode in modes}
    assert set(starts["stick"]) == {*rows[vi.EventKind.STICK]}
    run.plot(window=window, ax=ax)
    assert {*bands(ax)} == {"contact-slide", "contact-stick"}


def test_bands_begin_with_what_is_kept():
    whole = pressed_run()
    short = vi.simulate(PRESSED, initial=np.zeros((2, 2)), periods=12, keep=2)
    window = (short.kept_from, short.final_state.time)
    assert closed_spans(short, window) == closed_spans(whole, window) != []


def test_chosen_coordinates_are_drawn_and_by_default_those_with_stops(ax):
    chain = vi.Structure(
        np.eye(6),
        np.diag(np.arange(1.0, 7.0)),
        [vi.Stop([0, 0, 0, 0, 1, -1], 0.1, 0.8), vi.Stop([0, 0, 1, 0, 0, 0], 0.1, 0.8)],
        drive_amplitude=np.ones(6),
        drive_frequency=1.3,
    )
    run = vi.simulate(chain, initial=np.zeros((2, 6)), periods=4)
    run.plot(ax=ax)
    assert ax.get_ylabel() == "coordinates $q_0,\\ q_2,\\ q_4,\\ q_5$"
    assert [item.get_gid() for item in ax.get_lines() if item.get_gid()] == ["stop-1"]
    # An impact of two bodies is marked on both.
    rows = run.impacts[run.impacts["stop"] == 0]
    assert line(ax, "stop 0")[1].tolist() == [*rows["q"][:, 4], *rows["q"][:, 5]]
    for given, drawn in (
        (3, "coordinate $q_3$"),
        ((5, 1), "coordinates $q_5,\\ q_1$"),
        ([0], "coordinate $q_0$"),
    ):
        assert run.plot(coordinates=given, ax=Figure().subplots()).get_ylabel() == drawn


def test_impacts_are_marked_by_regime_if_asked(ax):
    run = masses_run()
    run.plot(window=(run.kept_from, run.final_state.time), color="regime", ax=ax)
    slips = run.impacts[run.impacts["regime"] == vi.Regime.SLIP]
    time, q = line(ax, "slip")
    # They are all on the stop between the masses: each is marked on both.
    assert time.tolist() == [*slips["time"]] * 2
    assert q.tolist() == [*slips["q"][:, 0], *slips["q"][:, 1]]
    assert not [item for item in ax.get_lines() if str(item.get_label()).startswith("stop")]


def test_a_stop_far_away_does_not_flatten_the_motion(ax):
    far = MOVING.replace(gap_1=50.0)
    run = vi.simulate(far, initial=[[0], [0]], periods=10)
    run.plot(ax=ax)
    assert [item.get_gid() for item in ax.get_lines() if item.get_gid()] == ["stop-0"]
    assert ax.get_ylim()[0] > -10.0


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"coordinates": 1}, "coordinates = 1 is not allowed; allowed: None, a number from 0 to 0"),
        ({"coordinates": ()}, r"coordinates = \(\) is not allowed"),
        ({"coordinates": (0, 0)}, r"coordinates = \(0, 0\) is not allowed"),
        ({"coordinates": "q"}, "coordinates = 'q' is not allowed"),
        ({"coordinates": True}, "coordinates = True is not allowed"),
        ({"units": "SI"}, "units = 'SI' is not allowed; allowed: None: a structure has no scales"),
        ({"drive": "plain"}, "drive = 'plain' is not allowed; allowed: 'auto' or 'none' for"),
        ({"drive": "plian"}, "drive = 'plian' is not allowed; allowed: one of auto, plain"),
        ({"color": "stop"}, "color = 'stop' is not allowed; allowed: 'regime' or None"),
        ({"window": (0.0, 1.0)}, "is not allowed; allowed: times in the kept window"),
        ({"points_per_period": 0}, "points_per_period = 0 is not allowed"),
    ],
)
def test_what_cannot_be_drawn_is_refused_by_name(run, given, words):
    with pytest.raises(vi.ParameterError, match=words):
        run.plot(**given)


def test_other_drawings_name_the_one_that_takes_a_structure(run):
    with pytest.raises(vi.ParameterError, match=r"StructureRun in vibroimpact.plot: time_history"):
        vi.plot.gap_history(run)


def test_coordinates_are_those_of_a_structure_only(system, initial):
    run = vi.simulate(system, initial=initial, periods=3)
    with pytest.raises(vi.ParameterError, match=r"coordinates = 0 .* None but for the run of a"):
        run.plot(coordinates=0)
    with pytest.raises(vi.ParameterError, match=r"coordinates = 0 .* None but for the run of a"):
        vi.plot.time_history(run, coordinates=0)


def test_without_a_drive_all_that_is_kept_is_drawn():
    free = vi.Structure([[1]], [[0]], [vi.Stop([1], 0.0, 0.5)], static_load=[1])
    run = vi.simulate(free, initial=[[-1], [0]], time=6)
    ax = run.plot(ax=Figure().subplots())
    assert ax.get_xlim() == (0.0, 6.0)
    # It comes to rest at the sum of the geometric series.
    (spans,) = bands(ax).values()
    assert spans[0] == (pytest.approx(3 * np.sqrt(2)), 6.0)


@pytest.mark.parametrize("picture", [vi.plot.time_history, vi.Run.plot])
def test_a_run_that_keeps_nothing_is_refused_by_name(picture, system, initial):
    nothing = vi.simulate(system, initial=initial, periods=5, keep=0)
    with pytest.raises(vi.ParameterError, match=r"^run = <Run .* of which some time is kept"):
        picture(nothing)
    nothing = vi.simulate(MOVING, initial=[[0], [0]], periods=5, keep=0)
    with pytest.raises(vi.ParameterError, match=r"^run = <StructureRun .* some time is kept"):
        vi.plot.time_history(nothing)


def test_any_structure_is_drawn(ax):
    # Without stops, at rest, without springs, and of the shortest time.
    loose = vi.Structure([[1]], [[0]], [vi.Stop([1], 1.0, 0.5)])
    free = vi.Structure(np.eye(2), np.eye(2), [], drive_amplitude=[1, 0], drive_frequency=2.0)
    for made, speed, time in ((free, 0.0, 9.0), (loose, 0.0, 3.0), (loose, 0.1, 5e-324)):
        start = np.zeros((2, made.coordinates))
        start[1] = speed
        run = vi.simulate(made, initial=start, time=time)
        times, _ = line(run.plot(ax=Figure().subplots()), "$q_0$")
        assert (times[0], times[-1]) == (0.0, time)


def marked(ax, number):
    """Return the places that mark a stop, wherever they are drawn."""
    (found,) = [each for each in ax.get_lines() if each.get_label() == f"stop {number}"]
    return np.column_stack(found.get_data())


@pytest.mark.parametrize("name", ["masses", "beam", "contact"])
def test_a_periodic_motion_is_drawn_as_its_run(name):
    motion = ORBITS[name]()
    run = vi.simulate(motion.system, initial=motion.state, periods=motion.m)
    shown = list(range(min(motion.system.coordinates, 2)))
    portrait, history = motion.plot(coordinates=shown, points_per_period=50)
    assert history.get_xlim() == pytest.approx((0, motion.period))
    tables = np.array(run.impacts)
    for number, stop in enumerate(motion.system.stops):
        here = tables[tables["stop"] == number]
        met = [i for i in shown if stop.normal[i] != 0]
        if not met or not len(here):
            continue
        when = np.tile(here["time"], len(met))
        where = np.concatenate([here["q"][:, i] for i in met])
        assert np.allclose(marked(history, number), np.column_stack([when, where]), atol=1e-9)
    for i in shown:
        time, q = line(history, f"$q_{i}$")
        # Impacts have their time to rounding: a velocity near them is of either side.
        assert np.allclose(q, run.trajectory(time)[:, 0, i], rtol=0, atol=1e-8)
        across, up = line(portrait, rf"$q_{i},\ \dot q_{i}$")
        assert across.tolist() == q.tolist()
        jumps = time[:-1][np.diff(time) == 0]
        assert len(jumps) == len(tables)
        pre = up[:-1][np.diff(time) == 0]
        assert np.allclose(pre, tables["v_pre"][:, i], atol=1e-8)


def test_a_motion_at_a_bifurcation_is_drawn_and_one_that_is_none_says_so():
    branch = orbit().follow(drive_frequency=(0.7, 2.6), virtual=True)
    for found in branch.bifurcations:
        assert len(found.plot()) == 2
    (none,) = branch.at(drive_frequency=0.8)
    assert not none.admissible
    portrait, history = none.plot()
    title = portrait.get_title(loc="left")
    assert title.replace("\n", " ") == f"no motion: {none.why_not}"
    # An impact after the end of its drive period is drawn in the next one.
    assert 0 <= marked(history, 0)[0, 0] <= none.period


def test_axes_and_coordinates_of_a_motion_are_checked():
    motion = orbit()
    with pytest.raises(vi.ParameterError, match=r"axes = .* allowed: 2 axes, or None"):
        motion.plot(axes=[Figure().subplots()] * 3)
    with pytest.raises(vi.ParameterError, match="coordinates = 1"):
        motion.plot(coordinates=1)
    with pytest.raises(vi.ParameterError, match="units = 'SI'"):
        motion.plot(units="SI")


def test_a_single_branch_is_named_with_its_stability(ax):
    vi.plot.branches(symmetric(), ax=ax)
    texts = [text.get_text() for text in ax.get_legend().get_texts()]
    assert texts == ["1-0, 1-2, stable", "1-0, 1-2, unstable", "branch point", "grazing"]
    colors = {handle.get_color() for handle in ax.get_legend().get_lines()[:2]}
    assert len(colors) == 1


def test_branch_points_and_all_grazes_are_marked_and_mirror_images_are_named_together(ax):
    drawn = [symmetric(), *sides(1)]
    vi.plot.branches(drawn, ax=ax)
    marks = {line.get_gid(): line.get_xydata() for line in ax.lines}
    points = {point.value for point in symmetric().of_kind("branch_point")}
    assert set(marks["branch_point"][:, 0]) == points
    # Beyond the graze at 1.74 each side has a third impact, which begins without velocity.
    graze = sides(1)[0].of_kind("grazing")[0].value
    beyond = marks["grazing"][np.abs(marks["grazing"][:, 0] - graze) < 1e-9]
    assert len(beyond) == 6
    assert np.count_nonzero(beyond[:, 1] < 1e-6) == 2
    texts = [text.get_text() for text in ax.get_legend().get_texts()]
    assert texts[:4] == ["1-0, 1-2", "1-2, 1-3 (a, b)", "stable", "unstable"]
    lines = ax.get_legend().get_lines()
    assert lines[0].get_color() != lines[3].get_color()


def test_multipliers_of_motions_of_structures_are_drawn():
    motions = [orbit(), ORBITS["masses"]()]
    ax = vi.plot.multipliers(motions)
    drawn = {each.get_label(): each.get_data() for each in ax.lines}
    for motion in motions:
        x, y = drawn[motion.label]
        assert x.tolist() == motion.multipliers.real.tolist()
        assert y.tolist() == motion.multipliers.imag.tolist()
    with pytest.raises(vi.ParameterError, match=r"motions\[1\] = 3 .*PeriodicMotion or .*Orbit"):
        vi.plot.multipliers([orbit(), 3])


def test_the_orbit_of_an_attractor_passes_through_its_sections():
    basins = vi.basins(SETTLING, q_0=[0.0], v_0=[0.0, 0.1], scouts=2, periods=200)
    (attractor,) = basins.attractors
    ax = attractor.plot()
    q, v = (np.asarray(part) for part in line(ax, "orbit"))
    near = np.abs(np.column_stack([q, v])[:, None] - attractor.sections[:, :, 0]).max(axis=2)
    assert near.min(axis=0).max() < 1e-9
    # It reaches its stop, and jumps there.
    assert q.max() == pytest.approx(SETTLING.stops[0].gap, abs=1e-9)
    assert np.abs(np.diff(v)).max() > 1


def test_a_diagram_of_structures_is_coloured_as_any_other(ax):
    diagram = vi.bifurcation_diagram(
        MOVING, initial=[[0], [0]], drive_frequency=[0.6, 0.7, 0.8], periods=60, keep=10,
        start=["forward", "backward"],
    )  # fmt: skip
    impacts = diagram.impacts
    assert {*impacts["stop"].tolist()} == {0, 1}

    def shown(**options):
        axes = diagram.plot(ax=Figure().subplots(), **options)
        points = axes.collections[0]
        names = [text.get_text() for text in axes.get_legend().get_texts()]
        return points.get_offsets(), points.get_facecolor(), names

    places, colors, names = shown()
    assert names[:2] == ["forward", "backward"]
    assert sorted(places[:, 1]) == sorted(impacts["approach_velocity"])
    places, colors, names = shown(color="stop", value="q", coordinate=0)
    assert names[:2] == ["stop 0", "stop 1"]
    for stop in (0, 1):
        own = {*impacts["q"][impacts["stop"] == stop][:, 0].tolist()}
        here = {tuple(c) for c, y in zip(colors.tolist(), places[:, 1], strict=True) if y in own}
        assert len(here) == 1
    assert "all impacts: frictionless" in shown(color="regime")[2]
    assert shown(color="label")[2]
    fractions = vi.plot.contact_fraction(diagram, ax=ax)
    drawn = [row.get_ydata().tolist() for row in fractions.lines]
    assert drawn == np.reshape(diagram.contact_fraction, (2, 3)).tolist()
    assert np.max(drawn) > 0.1


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"value": "x1"}, "value = 'x1' .* one of approach_velocity"),
        ({"value": ["q"]}, r"value = \['q'\]"),
        ({"coordinate": 1}, "coordinate = 1"),
        ({"units": "SI"}, "units = 'SI'"),
        ({"color": "red"}, "color must be None, 'regime', 'label', 'branch' or 'stop', not 'red'"),
        ({"color": "stop", "section": "stroboscopic"}, "only impacts have a stop"),
        ({"section": "poincare"}, "section must be"),
    ],
)
def test_what_a_picture_of_a_diagram_does_not_take_is_named(options, words):
    before = pyplot.get_fignums()
    with pytest.raises(vi.ParameterError, match=words):
        vi.plot.bifurcation(small_diagram(), **options)
    assert pyplot.get_fignums() == before

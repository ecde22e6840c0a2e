"""Plots of periodic motions show what motions, branches and curves hold, and refuse the rest."""

import itertools

import numpy as np
import pytest
from matplotlib import pyplot
from matplotlib.collections import LineCollection, PathCollection, PolyCollection
from matplotlib.colors import rgb_to_hsv, to_rgb
from matplotlib.figure import Figure
from matplotlib.patches import Circle

import vibroimpact as vi
from systems import COEXISTING, LOW
from vibroimpact._core import Regime
from vibroimpact.plot.style import (
    BIFURCATION_STYLES,
    CHATTER_STYLE,
    POINT_TEXTS,
    SLIDE_STYLE,
)

RANGE = (1.5, 1.6)
SECTIONS = ("impact", "stroboscopic")


@pytest.fixture(scope="module")
def motions() -> tuple[vi.PeriodicMotion, ...]:
    return vi.search_motions(COEXISTING, starts=64, periods=3000).motions


@pytest.fixture(scope="module")
def branches(motions) -> list[vi.Branch]:
    return [vi.follow_motion(motion, drive_frequency=RANGE) for motion in motions]


@pytest.fixture(scope="module")
def chattering() -> vi.PeriodicMotion:
    run = vi.simulate(
        LOW.replace(drive_frequency=0.3), initial=(0, 0.5, 0, 0), periods=300, keep=20
    )
    return run.refine()


@pytest.fixture(scope="module")
def overlapping(motions) -> vi.PeriodicMotion:
    """The 4-5 solution beyond its grazing."""
    virtual = vi.follow_motion(
        motions[0], drive_frequency=RANGE, virtual=True, both=False, direction=-1, max_points=60
    )
    (piece,) = virtual.pieces
    place = int(np.flatnonzero(piece.values < 1.5640)[0])
    return piece.motion(place)


@pytest.fixture
def ax():
    return Figure().subplots()


def stretches(ax) -> dict[str, np.ndarray]:
    """Every segment between two points that is drawn, as rows x0, y0, x1, y1, by stability."""
    found = {}
    for item in ax.collections:
        if isinstance(item, LineCollection):
            pairs = [
                np.hstack([line[:-1], line[1:]]) for line in item.get_segments() if len(line) > 1
            ]
            rows = found.setdefault(item.get_gid(), [])
            rows += pairs
    return {name: np.vstack(rows) if rows else np.empty((0, 4)) for name, rows in found.items()}


def marks(ax) -> dict[str, np.ndarray]:
    return {
        line.get_gid(): line.get_xydata()
        for line in ax.lines
        if line.get_gid() in BIFURCATION_STYLES
    }


def angles(holder, section) -> np.ndarray:
    if isinstance(holder, vi.Bifurcation):
        motion = holder.motion
        return motion.impacts["x1"] if section == "impact" else motion.sections[:, 0]
    return holder.impacts if section == "impact" else holder.sections


@pytest.mark.parametrize("section", SECTIONS)
def test_a_branch_is_drawn_through_all_its_points(branches, ax, section):
    assert vi.plot.branches(branches, section=section, ax=ax) is ax
    drawn = stretches(ax)
    every = np.vstack([drawn["stable"], drawn["unstable"]])
    ends = {tuple(point) for point in np.vstack([every[:, :2], every[:, 2:]])}
    for branch in branches:
        for piece in branch.pieces:
            x1 = angles(piece, section)
            if len(x1) == 1:
                continue  # a point is no line
            for value, row in zip(piece.values, x1, strict=True):
                assert all((value, x) in ends for x in row)
    assert ax.get_xlabel() == r"drive frequency $\omega$"


def test_solid_lines_are_stable_and_end_at_bifurcations(branches, ax):
    (branch, *_), values = branches, branches[0].values
    vi.plot.branches(branch, ax=ax)
    drawn = stretches(ax)
    stable = drawn["stable"]
    # The 4-5 motion: from its period doubling over its saddle-node, on which it turns back.
    doubling, fold = (
        branch.of_kind(kind)[k].value for kind, k in (("period_doubling", 1), ("saddle_node", 1))
    )
    assert stable[:, [0, 2]].min() == doubling
    assert stable[:, [0, 2]].max() == fold
    inside = values[branch.stable]
    assert inside.min() > doubling
    assert len(stable) == 5 * (len(np.unique(inside)) + 1)
    dashes = {item.get_gid(): item.get_linestyle()[0][1] for item in ax.collections}
    assert dashes["stable"] is None
    assert len(dashes["unstable"]) == 2


def test_both_stable_parts_of_the_closed_branch_are_solid(branches, ax):
    ring = branches[1]
    vi.plot.branches(ring, ax=ax)
    values = stretches(ax)["stable"][:, [0, 2]]
    kinds = {kind: [found.value for found in ring.of_kind(kind)] for kind in BIFURCATION_STYLES}
    edges = {kinds["period_doubling"][0], kinds["neimark_sacker"][0]}
    edges |= {min(kinds["saddle_node"]), max(kinds["grazing"])}
    ends, counts = np.unique(np.sort(values, axis=1), return_counts=True)
    # Seven impacts: a value inside a stretch is drawn fourteen times.
    assert edges == set(ends[counts == 7].tolist())


@pytest.mark.parametrize("section", SECTIONS)
def test_every_bifurcation_has_its_own_mark(branches, ax, section):
    vi.plot.branches(branches, section=section, ax=ax)
    drawn = marks(ax)
    pieces = [piece for branch in branches for piece in branch.pieces]
    ends = np.array([(piece.values[end], x) for piece in pieces for end in (0, -1)
                     for x in angles(piece, section)[end]])  # fmt: skip
    for kind in BIFURCATION_STYLES:
        wanted = [
            (found.value, x)
            for branch in branches
            for found in branch.of_kind(kind)
            for x in angles(found, section)
        ]
        places = [tuple(point) for point in drawn.get(kind, [])]
        assert [place for place in places if place in wanted] == wanted
        # A graze also marks the impact that begins there, at the end of a piece.
        more = set(places) - set(wanted)
        assert len(places) == len(wanted) + len(more)
        if (kind, section) != ("grazing", "impact"):
            assert not more
        for place in more:
            assert np.abs(ends - place).max(axis=1).min() < 1e-12
    texts = [text.get_text() for text in ax.get_legend().get_texts()]
    assert texts[:2] == ["4-6, 4-5", "6-7, 6-8"]
    assert {"saddle-node", "grazing", "regime border", "Neimark-Sacker"} < set(texts)
    neutral = any(branch.of_kind("neutral_saddle") for branch in branches)
    assert neutral
    assert "neutral saddle (no bifurcation)" in texts


def test_kinds_of_bifurcations_differ_without_colour():
    shapes = [style.marker for style in BIFURCATION_STYLES.values()]
    assert len(shapes) == 14
    same = [
        (a, b)
        for a, b in itertools.combinations(BIFURCATION_STYLES.values(), 2)
        if a.marker == b.marker
    ]
    # A saddle-node and a resonance 1:1 are a black and a white circle.
    assert [(a.text, b.text) for a, b in same] == [("saddle-node", "resonance 1:1")]
    black, white = (rgb_to_hsv(to_rgb(style.color))[2] for style in same[0])
    assert (black, white) == (0.0, 1.0)
    curves = [
        BIFURCATION_STYLES[kind].dashes
        for kind in (
            "saddle_node",
            "period_doubling",
            "neimark_sacker",
            "grazing",
            "regime_border",
            "chatter_onset",
            "contact_border",
        )
    ]
    assert len(set(curves)) == len(curves)


def test_a_diagram_lies_beneath_the_branches(motions, branches, ax):
    diagram = vi.bifurcation_diagram(
        motions[0].system,
        initial=(0, 0.5, 0, 0),
        periods=60,
        keep=20,
        drive_frequency=np.linspace(*RANGE, 9),
    )
    vi.plot.branches(branches, diagram=diagram, ax=ax)
    (points,) = [item for item in ax.collections if isinstance(item, PathCollection)]
    wanted = np.column_stack([diagram.impact_parameter, diagram.x1])
    assert np.array_equal(points.get_offsets(), wanted)
    grey = points.get_facecolor()[0, :3]
    assert grey.min() == grey.max() > 0.5
    assert "simulated" in [text.get_text() for text in ax.get_legend().get_texts()]
    assert points.get_zorder() < min(
        item.get_zorder() for item in ax.collections if isinstance(item, LineCollection)
    )


def test_multipliers_of_motions_are_drawn(motions, ax):
    assert vi.plot.multipliers(motions, ax=ax) is ax
    lines = {line.get_label(): line for line in ax.lines}
    for motion in motions:
        drawn = lines[motion.label].get_xydata()
        wanted = np.column_stack([motion.multipliers.real, motion.multipliers.imag])
        assert np.array_equal(drawn, wanted)
    assert len({lines[motion.label].get_marker() for motion in motions}) == len(motions)
    (circle,) = [patch for patch in ax.patches if isinstance(patch, Circle)]
    assert (circle.center, circle.radius) == ((0.0, 0.0), 1.0)
    assert ax.get_aspect() == 1.0


def test_multipliers_along_a_branch_have_the_colour_of_the_parameter(branches, ax):
    ring = branches[1]
    vi.plot.multipliers(ring, ax=ax, limit=1.3)
    (points,) = [item for item in ax.collections if isinstance(item, PathCollection)]
    every = np.concatenate([piece.multipliers.ravel() for piece in ring.pieces])
    assert np.array_equal(points.get_offsets(), np.column_stack([every.real, every.imag]))
    assert np.array_equal(points.get_array(), np.repeat(ring.values, 4))
    crossing = marks(ax)
    assert crossing.keys() == {"saddle_node", "period_doubling", "neimark_sacker"}
    assert np.allclose(np.hypot(*np.vstack(list(crossing.values())).T), 1.0, rtol=0, atol=1e-6)
    assert len(crossing["saddle_node"]) == len(ring.of_kind("saddle_node"))
    pair = crossing["neimark_sacker"]
    assert np.array_equal(pair[0], pair[1] * [1, -1])
    (note,) = [text.get_text() for text in ax.texts]
    outside = np.count_nonzero((abs(every.real) > 1.3) | (abs(every.imag) > 1.3))
    assert note == f"{outside} of {len(every)} multipliers outside the frame"


def curve_of(ax, label) -> np.ndarray:
    (line,) = [line for line in ax.lines if line.get_label() == label]
    return line.get_xydata()


def test_an_orbit_is_drawn_once_with_the_jumps_of_its_impacts(motions):
    figure = Figure()
    given = figure.subplots(3)
    motion = motions[0]
    axes = vi.plot.orbit(motion, points_per_period=50, axes=given)
    assert axes == list(given)
    hits = motion.impacts
    for body, ax in ((1, axes[0]), (2, axes[1])):
        drawn = curve_of(ax, rf"$x_{body},\ \dot x_{body}$")
        gaps = np.flatnonzero(np.isnan(drawn[:, 0]))
        assert len(gaps) == len(hits)
        # Before a gap the state before the impact, after it the state after.
        assert np.array_equal(
            drawn[gaps - 1], np.column_stack([hits[f"x{body}"], hits[f"v{body}_pre"]])
        )
        assert np.array_equal(
            drawn[gaps + 1], np.column_stack([hits[f"x{body}"], hits[f"v{body}_post"]])
        )
        jumps = curve_of(ax, "impact").reshape(-1, 3, 2)
        assert np.array_equal(jumps[:, 0], drawn[gaps - 1])
        assert np.array_equal(jumps[:, 1], drawn[gaps + 1])
    history = axes[2]
    time, x2 = curve_of(history, r"$x_2$").T
    known = ~np.isnan(x2)
    end = motion.m * motion.system.drive_period
    assert (time[0], time[-1]) == (0.0, pytest.approx(end, rel=1e-15))
    after = motion.trajectory(time[known])
    flying = np.abs(time[known][:, None] - hits["time"]).min(axis=1) > 0
    assert np.abs(after[flying, 2] - x2[known][flying]).max() == 0.0
    face = curve_of(history, r"$\sin x_1-\delta$")[known, 1]
    assert (
        np.abs(motion.system.tip(after[flying, 0]) - motion.system.gap - face[flying]).max() == 0.0
    )
    # The faces touch at the impacts and nowhere else.
    assert np.abs(face - x2[known])[~flying].max() < 1e-14
    assert (face - x2[known])[flying].max() < 0.0
    regimes = {line.get_label(): line.get_xydata() for line in history.lines}
    for regime in np.unique(hits["regime"]):
        here = hits[hits["regime"] == regime]
        text = Regime(regime).name.lower().replace("_", " in ")
        assert np.array_equal(regimes[text], np.column_stack([here["time"], here["x2"]]))


def bands(ax) -> dict[str, list[tuple[float, float]]]:
    return {
        item.get_gid(): [
            (path.vertices[:, 0].min(), path.vertices[:, 0].max()) for path in item.get_paths()
        ]
        for item in ax.collections
        if isinstance(item, PolyCollection) and item.get_gid()
    }


def test_chatter_and_contact_of_an_orbit_have_bands(chattering):
    axes = vi.plot.orbit(chattering, axes=Figure().subplots(3))
    run = vi.simulate(chattering.system, initial=chattering.initial, periods=1)
    chatter = run.contacts[run.contacts["kind"] == vi.EventKind.CHATTER]["time"][0]
    release = run.contacts[run.contacts["kind"] == vi.EventKind.RELEASE]["time"][0]
    found = bands(axes[2])
    assert found.keys() == {"contact-chatter", "contact-slide"}
    assert found["contact-slide"][0] == pytest.approx((chatter, release), abs=1e-9)
    last = chattering.impacts["time"][chattering.impacts["time"] < chatter].max()
    assert found["contact-chatter"][0] == pytest.approx((last, chatter), abs=1e-9)
    labels = axes[2].get_legend_handles_labels()[1]
    assert {CHATTER_STYLE.text, SLIDE_STYLE.text} < set(labels)
    # In contact the faces lie on one another.
    time, x2 = curve_of(axes[2], r"$x_2$").T
    face = curve_of(axes[2], r"$\sin x_1-\delta$")[:, 1]
    inside = (time > chatter + 1e-6) & (time < release - 1e-6)
    assert inside.sum() > 50
    assert np.abs(face - x2)[inside].max() < 1e-9
    assert np.nanmin((face - x2)[~inside]) < -0.1


def test_a_stretch_over_the_end_of_the_orbit_is_cut_in_two(chattering):
    # The drive half a period later: contact lasts over t = 0.
    ahead = chattering.system.replace(
        phase=chattering.system.drive_frequency * 12.0 + chattering.system.phase
    )
    start = chattering.trajectory([12.0])[0]
    moved = vi.simulate(ahead, initial=start, periods=20).refine()
    assert moved.label == chattering.label
    axes = vi.plot.orbit(moved, axes=Figure().subplots(3))
    slide = bands(axes[2])["contact-slide"]
    end = moved.system.drive_period
    assert len(slide) == 2
    assert sorted(slide)[0][0] == 0.0
    assert sorted(slide)[1][1] == pytest.approx(end, rel=1e-14)
    whole = bands(vi.plot.orbit(chattering, axes=Figure().subplots(3))[2])["contact-slide"][0]
    assert sum(b - a for a, b in slide) == pytest.approx(whole[1] - whole[0], rel=1e-9)


def test_where_the_bodies_of_a_solution_overlap_is_shown(overlapping, motions):
    assert not overlapping.admissible
    axes = vi.plot.orbit(overlapping, points_per_period=2000, axes=Figure().subplots(3))
    assert axes[2].get_title(loc="left") == f"no motion: {overlapping.why_not}"
    x2 = curve_of(axes[2], r"$x_2$")[:, 1]
    face = curve_of(axes[2], r"$\sin x_1-\delta$")[:, 1]
    over = face - x2 > 1e-9
    assert np.nanmax(face - x2) == pytest.approx(overlapping.max_gap, rel=1e-2)
    for body, ax in ((1, axes[0]), (2, axes[1])):
        red = curve_of(ax, "the bodies overlap")
        whole = curve_of(ax, rf"$x_{body},\ \dot x_{body}$")
        assert np.array_equal(np.isnan(red[:, 0]), ~over)
        assert np.array_equal(red[over], whole[over])
    assert "the bodies overlap" in axes[2].get_legend_handles_labels()[1]
    fine = vi.plot.orbit(motions[0], axes=Figure().subplots(3))
    assert fine[2].get_title(loc="left") == ""
    assert not any("overlap" in str(line.get_label()) for ax in fine for line in ax.lines)


def test_impacts_of_separating_bodies_have_a_cross(system):
    frictionless = system.replace(friction=0.0, drive_frequency=0.65, moment_amplitude=0.95)
    separating = [m for m in vi.periodic_motions(frictionless, 1) if m.approach_velocity < 0.0]
    motion = separating[0]
    axes = vi.plot.orbit(motion, axes=Figure().subplots(3))
    cross = curve_of(axes[2], "separating")
    assert np.array_equal(cross, np.column_stack([motion.impacts["time"], motion.impacts["x2"]]))


def test_curves_lie_in_the_plane_of_their_parameters(branches, ax):
    found = [branches[0].of_kind("saddle_node")[1], branches[0].of_kind("grazing")[0]]
    curves = [
        vi.bifurcation_curve(
            item, drive_frequency=(1.54, 1.6), moment_amplitude=(0.9, 1.1), max_points=60
        )
        for item in found
    ]
    assert vi.plot.bifurcation_curves(curves, ax=ax) is ax
    lines = {line.get_gid(): line for line in ax.lines}
    for curve in curves:
        assert np.array_equal(lines[curve.kind].get_xydata(), curve.values)
        thick = lines[f"{curve.kind}-stability"]
        assert thick.get_linewidth() > 2 * lines[curve.kind].get_linewidth()
        known = ~np.isnan(thick.get_xydata()[:, 0])
        assert np.array_equal(known, curve.bounds_stability)
    assert lines["saddle_node"].get_linestyle() != lines["grazing"].get_linestyle()
    points = [point for curve in curves for point in curve.points]
    assert points
    for kind in {point.kind for point in points}:
        wanted = [tuple(point.values) for point in points if point.kind == kind]
        drawn = lines[f"codimension-two-{kind}"].get_xydata()
        assert [tuple(point) for point in drawn] == wanted
    texts = [text.get_text() for text in ax.get_legend().get_texts()]
    assert texts[:2] == ["saddle-node", "grazing"]
    kinds = [kind for kind in POINT_TEXTS if kind in {point.kind for point in points}]
    assert texts[2:] == [POINT_TEXTS[kind] for kind in kinds]
    assert POINT_TEXTS["grazing"] == "meets grazing"
    # A resonance is told by its multipliers.
    assert "multipliers" in POINT_TEXTS["resonance_1_1"]
    assert (ax.get_xlabel(), ax.get_ylabel()) == (
        r"drive frequency $\omega$",
        "moment amplitude $f_1$",
    )


def test_plots_without_axes_make_a_figure(motions, branches):
    before = set(pyplot.get_fignums())
    made = [
        vi.plot.branches(branches[0]),
        vi.plot.multipliers(motions[0]),
        vi.plot.orbit(motions[0])[0],
    ]
    assert len(set(pyplot.get_fignums()) - before) == 3
    for ax in made:
        pyplot.close(ax.figure)


@pytest.mark.parametrize(
    ("draw", "words"),
    [
        (lambda m, b: vi.plot.branches(m), "branches = .* allowed: a vibroimpact.Branch"),
        (lambda m, b: vi.plot.branches([]), r"branches = \[\]"),
        (lambda m, b: vi.plot.branches([b, 1]), r"branches\[1\] = 1"),
        (lambda m, b: vi.plot.branches(b, section="time"), "section = 'time'"),
        (lambda m, b: vi.plot.branches(b, diagram=1), "diagram = 1"),
        (lambda m, b: vi.plot.branches(b, size=0), "size = 0"),
        (lambda m, b: vi.plot.branches(b, size=np.nan), "size = nan"),
        (lambda m, b: vi.plot.multipliers("4-5"), "motions = '4-5'"),
        (lambda m, b: vi.plot.multipliers([m, b]), r"motions\[1\]"),
        (lambda m, b: vi.plot.multipliers(m, limit=0.5), "limit = 0.5"),
        (lambda m, b: vi.plot.multipliers(m, limit=np.inf), "limit = inf"),
        (lambda m, b: vi.plot.multipliers(m, size=-1), "size = -1"),
        (lambda m, b: vi.plot.orbit(b), "motion = "),
        (lambda m, b: vi.plot.orbit(m, points_per_period=1), "points_per_period = 1"),
        (lambda m, b: vi.plot.orbit(m, points_per_period=2.5), "points_per_period = 2.5"),
        (lambda m, b: vi.plot.orbit(m, axes=[Figure().subplots()] * 2), "3 axes"),
        (lambda m, b: vi.plot.bifurcation_curves(b), "curves = "),
        (lambda m, b: vi.plot.bifurcation_curves([]), r"curves = \[\]"),
    ],
)
def test_bad_input_is_named(motions, branches, draw, words):
    before = pyplot.get_fignums()
    with pytest.raises(vi.ParameterError, match=words):
        draw(motions[0], branches[0])
    assert pyplot.get_fignums() == before


def test_different_parameters_are_refused(motions, branches, ax):
    other = vi.follow_motion(motions[0], friction=(0.49, 0.51), max_points=3)
    with pytest.raises(vi.ParameterError, match="branches over one parameter"):
        vi.plot.branches([branches[0], other], ax=ax)
    diagram = vi.bifurcation_diagram(
        motions[0].system, initial=(0, 0.5, 0, 0), periods=20, keep=5, friction=[0.5]
    )
    with pytest.raises(vi.ParameterError, match="a diagram over drive_frequency"):
        vi.plot.branches(branches, diagram=diagram, ax=ax)
    assert not ax.collections

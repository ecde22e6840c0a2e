"""Unstable manifolds of saddles: their points, their direction, their breaks, where they lead."""

import itertools
import math

import numpy as np
import pytest
from matplotlib.figure import Figure

import vibroimpact as vi
from ctrl_c import ctrl_c_at
from references import reference, scene_system
from vibroimpact._core import Leg

REFERENCE = reference("orbits_reference.json")


def known(name):
    scene = REFERENCE[name]
    initial = [float(value) for value in scene["stroboscopic"][0]]
    system = scene_system(scene).replace(contact=scene["contact"], law=scene["law"])
    return vi.periodic_motion(system, initial=initial, periods=scene["m"])


@pytest.fixture(scope="module")
def four_five():
    """Return the stable 4-5 motion, followed to its saddle-node at 1.57746890107 and beyond."""
    branch = vi.follow_motion(known("9_3_four_five"), drive_frequency=(1.57, 1.58), max_step=0.01)
    folds = [found.value for found in branch.of_kind("saddle_node") if found.motion.label == "4-5"]
    assert folds == [pytest.approx(1.57746890107, abs=1e-11)]
    return branch


def saddle_at(branch, value):
    """Return an unstable 4-5 motion of the branch near a drive frequency."""
    saddles = [
        piece.motion(k)
        for piece in branch.pieces
        for k in range(1, len(piece.values) - 1)
        if piece.label == "4-5"
        and abs(piece.multipliers[k][0] - 1.0) > 0.05
        and np.count_nonzero(np.abs(piece.multipliers[k]) > 1.0) == 1
        and piece.multipliers[k][0].real > 1.0
    ]
    return min(saddles, key=lambda motion: abs(motion.system.drive_frequency - value))


@pytest.fixture(scope="module")
def near_the_fold(four_five):
    saddle = saddle_at(four_five, 1.5774)
    return vi.unstable_manifold(saddle)


def image(motion, states, phase=0.0):
    """Return the states after m drive periods (2 m for a negative multiplier)."""
    flips = motion.multipliers[0].real < 0.0
    system = motion.system.replace(phase=motion.system.phase + phase)
    runs = vi.simulate(system, initial=states, periods=motion.m * (2 if flips else 1), keep=0)
    return np.array([run.final_state.state for run in runs])


def distances(points, manifold):
    """Distance of each point from the polylines of the manifold."""
    least = np.full(len(points), math.inf)
    for side in manifold.sides:
        for i, piece in enumerate(side.pieces()):
            chain = piece if i else np.vstack((manifold.saddle, piece))
            for a, b in itertools.pairwise(chain):
                along = (points - a) @ (b - a) / max((b - a) @ (b - a), 1e-300)
                foot = a + np.clip(along, 0.0, 1.0)[:, None] * (b - a)
                least = np.minimum(least, np.linalg.norm(points - foot, axis=1))
    return least


def test_the_saddle_of_the_four_five_separates_it_from_a_two_two(near_the_fold):
    manifold = near_the_fold
    assert manifold.motion.label == "4-5"
    reached = {side.attractors[0].label for side in manifold.sides}
    assert reached == {"4-5", "2-2"}
    assert all(len(side.attractors) == 1 for side in manifold.sides)
    assert manifold.separates
    assert [side.end for side in manifold.sides] == ["attractor", "attractor"]
    for side in manifold.sides:
        (attractor,) = side.attractors
        assert attractor.stable
        # The curve runs into a point of the attractor.
        assert np.linalg.norm(side.points[-1] - attractor.sections, axis=1).min() < 1e-2
    # Basins told by runs from both sides of the saddle agree.
    for sign, side in zip((1.0, -1.0), manifold.sides, strict=True):
        start = manifold.saddle + sign * 1e-4 * manifold.direction
        run = vi.simulate(manifold.motion.system, initial=start, periods=4000, keep=200)
        assert run.label == side.attractors[0].label


def test_further_from_the_fold_both_sides_lead_to_the_four_five(four_five):
    manifold = vi.unstable_manifold(saddle_at(four_five, 1.5771))
    assert [side.attractors[0].label for side in manifold.sides] == ["4-5", "4-5"]
    assert not manifold.separates


def test_points_are_mapped_onto_the_manifold(near_the_fold):
    manifold = near_the_fold
    for side in manifold.sides:
        points = side.points[:: max(1, len(side.points) // 60)]
        # Between neighbours at most 0.02 apart that turn by at most 0.2 the chord is off by less
        # than 0.02 x 0.2/4; at corners, resolved to 0.05 x 0.02, by less than that.
        assert distances(image(manifold.motion, points), manifold).max() < 1e-3


def test_a_finer_manifold_from_another_start_is_the_same_curve(near_the_fold):
    coarse = near_the_fold
    fine = vi.unstable_manifold(coarse.motion, spacing=0.004, max_angle=0.05, offset=3e-8)
    for one, other in zip(coarse.sides, fine.sides, strict=True):
        assert len(other.points) > len(one.points)
        assert distances(one.points, fine).max() < 2e-4
        assert one.length == pytest.approx(other.length, rel=0.02)
        assert one.attractors[0].label == other.attractors[0].label


@pytest.mark.parametrize("phase", [0.0, 3.0])
def test_first_points_lie_along_the_eigenvector_of_the_simulated_map(four_five, phase):
    motion = saddle_at(four_five, 1.5774)
    manifold = vi.unstable_manifold(motion, section_phase=phase, length=1e-3, settle=16)
    h = 1e-7
    ends = np.vstack((manifold.saddle + h * np.eye(4), manifold.saddle - h * np.eye(4)))
    images = image(motion, ends, phase)
    matrix = (images[:4] - images[4:]).T / (2.0 * h)
    values, vectors = np.linalg.eig(matrix)
    unstable = int(np.abs(values).argmax())
    assert values[unstable].real == pytest.approx(manifold.multiplier, rel=1e-5)
    vector = np.real(vectors[:, unstable])
    assert abs(vector @ manifold.direction) == pytest.approx(1.0, abs=1e-9)
    assert np.abs(image(motion, manifold.saddle[None, :], phase) - manifold.saddle).max() < 1e-11
    for sign, side in zip((1.0, -1.0), manifold.sides, strict=True):
        away = side.points[0] - manifold.saddle
        assert np.linalg.norm(away) == pytest.approx(1e-6, rel=1e-6)
        assert sign * (away @ manifold.direction) / np.linalg.norm(away) == pytest.approx(1.0)


def test_a_negative_multiplier_takes_the_map_twice():
    motion = known("9_3_two_three")
    assert motion.multipliers[0].real == pytest.approx(-2.739874244392647, rel=1e-9)
    manifold = vi.unstable_manifold(motion, length=0.3)
    assert manifold.multiplier == motion.multipliers[0].real
    # The map itself exchanges the sides, its square does not.
    one, other = (side.points[0] for side in manifold.sides)
    system = motion.system
    (once,) = vi.simulate(system, initial=[one], periods=motion.m, keep=0)
    moved = (np.array(once.final_state.state) - manifold.saddle) @ manifold.direction
    assert moved == pytest.approx(manifold.multiplier * 1e-6, rel=1e-3)
    twice = (image(motion, [one, other]) - manifold.saddle) @ manifold.direction
    assert twice == pytest.approx(manifold.multiplier**2 * np.array([1e-6, -1e-6]), rel=1e-3)
    for side in manifold.sides:
        points = side.points[: len(side.points) // 2]
        points = points[np.linalg.norm(points - manifold.saddle, axis=1) < 0.02]
        assert distances(image(motion, points), manifold).max() < 1e-3


def test_a_wall_has_manifolds_in_its_plane():
    branch = vi.follow_motion(known("wall_direct"), drive_frequency=(0.6, 3.0))
    saddles = [
        piece.motion(k)
        for piece in branch.pieces
        for k in range(1, len(piece.values) - 1)
        if np.count_nonzero(np.abs(piece.multipliers[k]) > 1.01) == 1
    ]
    assert saddles
    motion = saddles[len(saddles) // 2]
    manifold = vi.unstable_manifold(motion, length=1.0)
    for side in manifold.sides:
        assert not side.points[:, 2:].any()
        assert distances(image(motion, side.points[:10]), manifold).max() < 1e-3


def test_impacts_on_the_section_break_the_curve(four_five):
    motion = saddle_at(four_five, 1.5771)
    # A phase shortly before that of an impact of the saddle.
    phase = float(motion.impacts["phase"][0]) - 0.06
    manifold = vi.unstable_manifold(motion, section_phase=phase, length=2.0)
    assert sum(len(side.breaks) for side in manifold.sides) > 5
    system = motion.system.replace(phase=motion.system.phase + phase)
    for side in manifold.sides:
        assert sum(len(piece) for piece in side.pieces()) == len(side.points)
        joined = np.linalg.norm(np.diff(side.points, axis=0), axis=1)
        jumps = np.zeros(len(side.points), dtype=bool)
        jumps[side.breaks] = True
        # Points nearer than 0.05 of the spacing are left out, so that two steps may be one.
        assert joined[~jumps[1:]].max() < 0.02 * 1.1
        assert (joined[jumps[1:]] > 0.02).all()
        for number in side.breaks:
            # On both sides of a break the bodies touch on the section: its place on the first
            # piece is known to 3.6e-15, which the map stretches by some 1e7 on this length.
            states = side.points[number - 1 : number + 1]
            tip = np.sin(states[:, 0]) - states[:, 2] - system.gap
            assert np.abs(tip).max() < 1e-6
            # The impact law leads from one side to the other.
            before, after = sorted(states, key=lambda s: s[3] - s[1] * math.cos(s[0]))
            struck = vi.impact(system, x1=before[0], v1=before[1], v2=before[3])
            assert after[1] == pytest.approx(float(struck["v1_post"]), abs=1e-5)
            assert after[3] == pytest.approx(float(struck["v2_post"]), abs=1e-5)


def test_limits_end_a_side(four_five):
    motion = saddle_at(four_five, 1.5771)
    short = vi.unstable_manifold(motion, length=0.05)
    for side in short.sides:
        assert side.end == "length"
        assert 0.05 <= side.length < 0.05 + 0.02
    few = vi.unstable_manifold(motion, max_points=20)
    assert [len(side.points) <= 21 for side in few.sides] == [True, True]
    assert few.sides[1].end == "points" or few.sides[0].end == "points"


def test_manifolds_are_drawn(near_the_fold):
    ax = vi.plot.manifold(near_the_fold, ax=Figure().subplots(), x="x2", y="v2")
    lines = [line for line in ax.lines if line.get_linestyle() != "None"]
    drawn = np.vstack([line.get_xydata() for line in lines])
    expected = np.vstack(
        [np.vstack((near_the_fold.saddle, side.points)) for side in near_the_fold.sides]
    )
    assert np.array_equal(drawn, expected[:, 2:])
    labels = {text.get_text() for text in ax.get_legend().get_texts()}
    names = {"manifold to stable 4-5", "manifold to stable 2-2", "stable 4-5", "stable 2-2"}
    assert labels == {"unstable 4-5 (saddle)"} | names
    assert ax.get_ylabel().endswith(r"of body 2 once per drive period, at $\psi = 0$")
    alone = vi.plot.manifold(near_the_fold.sides[0], ax=Figure().subplots())
    assert alone.get_xlabel().endswith("of body 1 once per drive period")
    with pytest.raises(vi.ParameterError, match="x = 'phase'"):
        vi.plot.manifold(near_the_fold, x="phase")


def test_bad_input_is_refused(four_five):
    stable = known("9_3_four_five")
    for arguments, words in (
        ({"motion": stable}, "exactly one multiplier"),
        ({"motion": "saddle"}, "a PeriodicMotion"),
        ({"motion": known("9_3_one_one"), "length": 0.0}, "length"),
        ({"motion": known("9_3_one_one"), "spacing": math.nan}, "spacing"),
        ({"motion": known("9_3_one_one"), "max_angle": -1.0}, "max_angle"),
        ({"motion": known("9_3_one_one"), "max_points": 1}, "max_points"),
        ({"motion": known("9_3_one_one"), "offset": math.inf}, "offset"),
        ({"motion": known("9_3_one_one"), "section_phase": 7.0}, "section_phase"),
        ({"motion": known("9_3_one_one"), "settle": 0}, "settle"),
    ):
        with pytest.raises(vi.ParameterError, match=words):
            vi.unstable_manifold(arguments.pop("motion"), **arguments)
    # In sustained contact at the start of the drive period.
    contact = known("unstable_chatter")
    assert not contact.stable
    begins = float(contact.nodes[contact.legs.index(Leg.CHATTER), 3])
    phase = (contact.system.drive_frequency * (begins + 1e-3)) % math.tau
    with pytest.raises(vi.ParameterError, match="section_phase"):
        vi.unstable_manifold(contact, section_phase=phase)


def test_ctrl_c_keeps_the_manifold_so_far(four_five):
    motion = saddle_at(four_five, 1.5771)
    with ctrl_c_at(1000) as caught:
        vi.unstable_manifold(motion, spacing=1e-5, max_points=10**7, length=100.0)
    manifold = caught.value.result
    assert isinstance(manifold, vi.UnstableManifold)
    assert manifold.sides[-1].end == "interrupted"
    assert not manifold.separates

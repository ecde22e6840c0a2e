"""Motions that are their own mirror image, and the branch points at which they cease to be."""

import functools
import math

import numpy as np
import pytest

import vibroimpact as vi
from branch_cases import PAPER, settled
from struck import MIRRORED, REST
from vibroimpact.orbits.mirror import is_mirror_image

WIDE = {"drive_frequency": (0.9, 1.9)}


@functools.cache
def symmetric_motion():
    return vi.simulate(MIRRORED, initial=REST[2], periods=600, keep=100).refine()


@functools.cache
def symmetric(max_step=0.05):
    return symmetric_motion().follow(**WIDE, max_step=max_step)


@functools.cache
def sides(number, max_step=0.05):
    """The two branches that leave the branch point of that number."""
    point = symmetric().of_kind("branch_point")[number]
    return [
        vi.switch_branch(point, both=False, direction=way, max_step=max_step, **WIDE)
        for way in (1, -1)
    ]


# The motion with two impacts in closed form: a half of it, and its mirror image


def half(omega):
    """State after the impact on the first stop, and the derivative of a half period.

    Flights are s(t) = P(t) (s - x) + x with the forced motion x. The impact changes velocities by
    R. Half a period later both state and x are the opposite: -s = R (P (s - x) - x).
    """
    mass, spring = MIRRORED.mass, MIRRORED.stiffness
    root_mass = np.diag(mass.diagonal() ** -0.5)
    squares, shapes = np.linalg.eigh(root_mass @ spring @ root_mass)
    shapes = root_mass @ shapes
    own = np.sqrt(squares)
    damping = mass @ shapes @ np.diag(2 * 0.03 * own) @ shapes.T @ mass
    inverse = np.linalg.inv(mass)
    field = np.block([[np.zeros((2, 2)), np.eye(2)], [-inverse @ spring, -inverse @ damping]])
    values, vectors = np.linalg.eig(field)
    flight = (vectors @ np.diag(np.exp(values * math.pi / omega)) @ np.linalg.inv(vectors)).real
    load = np.concatenate([np.zeros(2), inverse @ [0.8, 0]])
    response = np.linalg.solve(1j * omega * np.eye(4) - field, load)
    kick = np.eye(4)
    kick[3, 3] = -0.75
    # s = real part of (gain e^(i psi)), psi the phase of the drive at the impact.
    gain = np.linalg.solve(np.eye(4) + kick @ flight, kick @ (flight + np.eye(4)) @ response)
    found = []
    for turn in (1, -1):
        psi = turn * math.acos(0.4 / abs(gain[1])) - np.angle(gain[1])
        state, forced = ((vector * np.exp(1j * psi)).real for vector in (gain, response))
        before = flight @ (state - forced) - forced
        if -before[3] <= 0 or state[3] >= 0:
            continue
        late = -load * math.cos(psi)
        after = kick @ before
        jump = field @ after + late - kick @ (field @ before + late)
        # The gap of the second stop is -q_2 - 0.4.
        saltation = kick + np.outer(jump, [0, -1, 0, 0]) / -before[3]
        found.append((state, saltation @ flight))
    return found


def off_mirror(omega):
    """det(H - I): zero where the half period, mirrored, has the multiplier -1."""
    (found,) = half(omega)
    return np.linalg.det(found[1] - np.eye(4))


def root(function, low, high):
    at_low = function(low)
    for _ in range(60):
        middle = 0.5 * (low + high)
        if function(middle) * at_low > 0:
            low = middle
        else:
            high = middle
    return 0.5 * (low + high)


def test_symmetric_motions_are_those_of_the_closed_form():
    for omega in (1.0, 1.1, 1.3, 1.5, 1.8):
        (found,) = symmetric().at(omega)
        (known,) = half(omega)
        state = known[0].reshape(2, 2)
        nodes = found.system._from_core(found.nodes[:, :4].reshape(-1, 2, 2))
        off = min(np.abs(sign * node - state).max() for node in nodes for sign in (1, -1))
        assert off < 1e-12
        squares = np.sort(np.abs(np.linalg.eigvals(known[1]) ** 2))
        assert np.sort(np.abs(found.multipliers)) == pytest.approx(squares, abs=1e-11)


def test_branch_points_are_where_the_closed_form_has_the_multiplier_1():
    points = symmetric().of_kind("branch_point")
    known = [root(off_mirror, 1.05, 1.1), root(off_mirror, 1.7, 1.76)]
    assert [point.value for point in points] == pytest.approx(known, abs=1e-12)
    for point in points:
        assert point.branching == "symmetry-breaking pitchfork"
        assert point.motion.multipliers[0] == pytest.approx(1, abs=1e-9)
        assert "symmetry-breaking pitchfork" in repr(point)


@pytest.mark.parametrize("max_step", [0.005, 0.02, 0.07, 0.1, 0.3, 1.0, 10.0])
def test_steps_of_any_size_find_the_same_branch(max_step):
    branch, known = symmetric(max_step), symmetric()
    assert branch.ends == ("bound", "bound")
    assert branch.why_not == ("", "")
    assert [piece.label for piece in branch.pieces] == [piece.label for piece in known.pieces]
    kinds = [str(each.kind) for each in known.bifurcations]
    assert kinds == ["grazing", "branch_point", "branch_point"]
    assert [str(each.kind) for each in branch.bifurcations] == kinds
    values = [each.value for each in known.bifurcations]
    assert [each.value for each in branch.bifurcations] == pytest.approx(values, abs=1e-13)


def test_symmetric_motions_are_stable_between_the_branch_points():
    low, high = (point.value for point in symmetric().of_kind("branch_point"))
    for piece in symmetric().pieces:
        inside = (piece.values > low) & (piece.values < high)
        if piece.label == "1-2":
            assert 10 < inside.sum() < len(inside) - 10
            assert np.array_equal(piece.stable, inside)


# The motions without symmetry


@pytest.mark.parametrize(("number", "kinds"), [
    (0, ["period_doubling", "saddle_node", "grazing", "saddle_node", "period_doubling",
         "neutral_saddle", "grazing"]),
    (1, ["grazing"]),
])  # fmt: skip
@pytest.mark.parametrize("max_step", [0.01, 0.05, 0.3, 2.0])
def test_steps_of_any_size_find_the_same_sides(number, kinds, max_step):
    known = [each.value for each in sides(number)[0].bifurcations]
    for side in sides(number, max_step):
        assert [str(each.kind) for each in side.bifurcations] == kinds
        assert [each.value for each in side.bifurcations] == pytest.approx(known, abs=1e-12)
        assert side.ends == ("start", "bound")


@pytest.mark.parametrize(("number", "values"), [
    (0, [1.07232, 1.0, 0.905]), (1, [1.7368, 1.739, 1.75])
])  # fmt: skip
def test_one_side_is_the_mirror_image_of_the_other(number, values):
    one, other = sides(number)
    for value in values:
        pairs = list(zip(one.at(value), other.at(value), strict=True))
        assert pairs
        for found, image in pairs:
            times = np.linspace(0, found.system.drive_period, 40)
            # Coordinates: velocities jump at impacts, to either side by rounding.
            q = found.trajectory(times)[:, 0]
            mirrored = -image.trajectory(times + 0.5 * found.system.drive_period)[:, 0]
            assert mirrored == pytest.approx(q, abs=1e-10)
            if found.n:
                assert np.abs(q + found.trajectory(times + times[-1] / 2)[:, 0]).max() > 1e-3
            assert image.multipliers == pytest.approx(found.multipliers, abs=1e-7)


def test_both_ways_are_the_two_sides():
    point = symmetric().of_kind("branch_point")[1]
    both = vi.switch_branch(point, **WIDE)
    labels = [piece.label for piece in sides(1)[0].pieces]
    assert [piece.label for piece in both.pieces] == [*labels[::-1], *labels]
    (crossing,) = both.of_kind("branch_point")
    assert crossing.value == point.value
    # Along the sides the parameter has an extremum there: the other branch is the first one.
    again = vi.switch_branch(crossing, **WIDE)
    (middle,) = again.at(1.3)
    assert middle.state == pytest.approx(symmetric_motion().state, abs=1e-9)


@functools.cache
def ring():
    """A mass whose motions without symmetry form a closed branch through both branch points."""
    stops = [vi.Stop([0.2], 0.25, 0.73), vi.Stop([-0.2], 0.25, 0.73)]
    between = vi.Structure(
        [[1.56]], [[1.14]], stops, damping=[[0.057]], drive_amplitude=[2.07], drive_frequency=1.14
    )
    return vi.simulate(between, initial=REST[1], periods=400, keep=100).refine()


@pytest.mark.parametrize("number", [0, 1])
@pytest.mark.parametrize("max_step", [0.01, 0.05, 0.07, 0.2])
def test_sides_that_end_at_one_branch_point_are_a_closed_branch(number, max_step):
    ranges = {"drive_frequency": (0.91, 1.48)}
    points = ring().follow(**ranges).of_kind("branch_point")
    assert len(points) == 2
    known = sorted(point.value for point in points)
    closed = vi.switch_branch(points[number], max_step=max_step, **ranges)
    assert closed.ends == ("closed", "closed")
    assert [str(each.kind) for each in closed.bifurcations] == ["branch_point"] * 2
    assert sorted(each.value for each in closed.bifurcations) == pytest.approx(known, abs=1e-12)
    # Both mirror images are on it, each half of it has one.
    one, image = closed.at(0.97)
    assert is_mirror_image(one, image)
    assert one.stable
    assert image.stable
    for way in (1, -1):
        side = vi.switch_branch(
            points[number], both=False, direction=way, max_step=max_step, **ranges
        )
        assert side.ends == ("start", "mirror image")
        assert "closes onto its mirror image" in side.why_not[1]
        (end,) = side.bifurcations
        assert end.value == pytest.approx(known[1 - number], abs=1e-12)
        assert len(side.at(0.97)) == 1


@pytest.mark.parametrize("max_step", [0.01, 0.05, 0.2])
def test_a_motion_without_symmetry_is_followed_from_one_branch_point_to_the_other(max_step):
    ranges = {"drive_frequency": (0.91, 1.48)}
    points = ring().follow(**ranges).of_kind("branch_point")
    (start,) = vi.switch_branch(points[0], both=False, **ranges).at(0.97)
    branch = start.follow(max_step=max_step, **ranges)
    assert branch.ends == ("mirror image", "mirror image")
    values = [each.value for each in branch.bifurcations]
    assert values == pytest.approx(sorted(point.value for point in points), abs=1e-12)
    assert len(branch.at(0.97)) == 1


@functools.cache
def long_sides(max_step=0.05):
    """The sides of the second branch point, which end at a third one beyond the usual range."""
    point = symmetric().of_kind("branch_point")[1]
    return [
        vi.switch_branch(
            point, both=False, direction=way, max_step=max_step, drive_frequency=(0.9, 3.0)
        )
        for way in (1, -1)
    ]


@pytest.mark.parametrize("max_step", [0.02, 0.05, 0.3])
def test_a_side_ends_at_the_branch_point_beyond_which_its_image_follows(max_step):
    kinds = ["grazing", "period_doubling", "neimark_sacker", "neutral_saddle", "grazing",
             "branch_point"]  # fmt: skip
    for side in long_sides(max_step):
        assert side.ends == ("start", "mirror image")
        assert [str(each.kind) for each in side.bifurcations] == kinds
        values = [each.value for each in side.bifurcations]
        assert len(set(np.round(values, 9))) == len(values)
        assert side.images == (None,) * len(kinds)
        assert side.bifurcations[-1].branching == "symmetry-breaking pitchfork"
    one, image = (side.at(2.2) for side in long_sides(max_step))
    assert len(one) == len(image) == 1
    assert is_mirror_image(one[0], image[0])


def test_both_sides_say_which_bifurcation_is_the_image_of_which():
    point = symmetric().of_kind("branch_point")[0]
    both = vi.switch_branch(point, **WIDE)
    count = len(sides(0)[0].bifurcations)
    assert len(both.bifurcations) == 2 * count + 1
    # In order along the branch: one side backwards, the point, the other side.
    assert both.images == (None,) * (count + 1) + tuple(range(count))[::-1]
    assert both._facts()[f"bifurcation {count + 2}"].endswith(
        f"mirror image of bifurcation {count}"
    )


# Where a branch is told to stop


@pytest.mark.parametrize("kind", ["branch_point", "period_doubling", "saddle_node", "grazing"])
def test_a_branch_stops_at_the_first_bifurcation_of_a_kind(kind):
    point = symmetric().of_kind("branch_point")[1 if kind == "branch_point" else 0]
    options = {"both": False, "drive_frequency": (0.9, 3.0)}
    whole = vi.switch_branch(point, **options)
    part = vi.switch_branch(point, stop_at=kind, **options)
    assert part.ends == ("start", kind)
    assert part.why_not == ("", "")
    first = [str(each.kind) for each in whole.bifurcations].index(kind)
    known = [(str(each.kind), each.value) for each in whole.bifurcations[: first + 1]]
    assert [str(each.kind) for each in part.bifurcations] == [name for name, _ in known]
    assert [each.value for each in part.bifurcations] == pytest.approx(
        [value for _, value in known], abs=1e-12
    )
    assert part.values[-1] == part.bifurcations[-1].value
    assert part.bifurcations[-1].goes_on == whole.bifurcations[first].goes_on


def test_a_branch_stops_at_the_first_of_several_kinds_both_ways():
    branch = symmetric_motion().follow(**WIDE, stop_at=["grazing", "branch_point"])
    assert branch.ends == ("branch_point", "branch_point")
    assert [each.value for each in branch.bifurcations] == pytest.approx(
        [each.value for each in symmetric().of_kind("branch_point")], abs=1e-13
    )
    assert branch.values[[0, -1]].tolist() == [each.value for each in branch.bifurcations]


@pytest.mark.parametrize("wrong", ["branch point", "cusp", ["grazing", 1], 3, None])
def test_kinds_at_which_no_branch_stops_are_refused(wrong):
    with pytest.raises(vi.ParameterError, match=r"stop_at = .* one or several of saddle_node"):
        symmetric_motion().follow(**WIDE, stop_at=wrong)


@pytest.mark.parametrize(("number", "omega", "label"), [
    (0, 0.95, "1-1"), (0, 1.0, "1-1"), (0, 1.05, "1-1"), (1, 1.738, "1-2"), (1, 1.7395, "1-2")
])  # fmt: skip
def test_runs_from_anywhere_settle_on_one_of_the_sides(number, omega, label):
    stable = on_sides(number, omega, label)
    rng = np.random.default_rng(7)
    reached = set()
    for _ in range(6):
        start = rng.uniform(-0.3, 0.3, (2, 2))
        settled = vi.simulate(stable[0].system, initial=start, periods=2000, keep=100)
        assert settled.label == label
        off = [np.abs(each.sections[0] - settled.stroboscopic[-1]).max() for each in stable]
        assert min(off) < 1e-8
        reached.add(off.index(min(off)))
    assert reached == {0, 1}


@pytest.mark.parametrize(("omega", "label", "periods"), [
    (1.0719, "1-1", 300), (1.0723, "1-1", 300), (1.07233, "1-1", 300), (1.07233, "1-2", 30000)
])  # fmt: skip
def test_close_to_the_branch_point_runs_beside_a_side_settle_on_it(omega, label, periods):
    # Others go to a 3-4. The 1-2 loses 0.11 % of a disturbance in a period.
    rng = np.random.default_rng(3)
    for found in on_sides(0, omega, label):
        start = found.state + rng.uniform(-1e-6, 1e-6, (2, 2))
        settled = vi.simulate(found.system, initial=start, periods=periods, keep=100)
        assert settled.label == label
        assert settled.stroboscopic[-1] == pytest.approx(found.state, abs=1e-9)


def on_sides(number, omega, label):
    """The stable motions on the two sides, with this label."""
    found = [each for side in sides(number) for each in side.at(omega)]
    stable = [each for each in found if each.stable and each.label == label]
    assert len(stable) == 2
    return stable


# Gaps that are not quite equal


def uneven(difference):
    """The motion at the second gap larger by so much."""
    return symmetric_motion().follow(gap_1=(0.4 - 1e-3, 0.4 + 1e-3)).at(0.4 + difference)[0]


@pytest.mark.parametrize("difference", [1e-9, 1e-6, 1e-3, -1e-3])
@pytest.mark.parametrize("max_step", [0.05, 0.3])
def test_a_difference_of_the_gaps_parts_the_branches(difference, max_step):
    branch = uneven(difference).follow(**WIDE, max_step=max_step)
    assert branch.ends == ("bound", "bound")
    assert not branch.of_kind("branch_point")
    # It goes over into one of the sides: at both ends the motion has lost its symmetry.
    assert {"1-1", "1-3"} <= {piece.label for piece in branch.pieces}


def test_the_fold_of_the_other_side_goes_with_the_power_two_thirds_of_the_difference():
    # x^3 - l x + d = 0 has its fold at l = 3 (d/2)^(2/3).
    point = symmetric().of_kind("branch_point")[1]
    differences = np.array([1e-9, 1e-8, 1e-7])
    shifts = []
    for difference in differences.tolist():
        folds = []
        for side in sides(1):
            (motion,) = side.at(1.7375)
            (moved,) = motion.follow(gap_1=(0.3999, 0.4001)).at(0.4 + difference)
            branch = moved.follow(drive_frequency=(1.73, 1.74), direction=-1, both=False)
            folds.append([fold.value for fold in branch.of_kind("saddle_node")])
        assert sorted(map(len, folds)) == [0, 1]
        shifts.append(max(folds)[0] - point.value)
    slopes = np.diff(np.log(shifts)) / np.diff(np.log(differences))
    assert slopes == pytest.approx([2 / 3, 2 / 3], abs=0.01)


# Two branches that cross in general: a saddle-node, with a parameter that turns back there


def system_and_fold():
    branch = settled(**PAPER, drive_frequency=1.8).follow(drive_frequency=(1.5, 1.9))
    return branch, vi.System(**PAPER, drive_frequency=1.8)


def structure_and_fold():
    between = vi.Structure(
        [[1]], [[1]], [vi.Stop([1], 0.5, 0.6)], drive_amplitude=[1], drive_frequency=1.6
    )
    motion = vi.simulate(between, initial=[[0], [0]], periods=3000, keep=50).refine()
    return motion.follow(drive_frequency=(1.5, 2.6)), between


@functools.cache
def beside_a_fold(of):
    """The fold, the side on which its two motions are, one of them, and the machine."""
    branch, machine = of()
    fold = branch.of_kind("saddle_node")[0]
    near = []
    for side in (1, -1):
        at = fold.value + side * 1e-4
        near += [(np.abs(each.nodes - fold.motion.nodes).max(), side, each)
                 for each in branch.at(at) if each.legs == fold.motion.legs]  # fmt: skip
    _, side, motion = min(near, key=lambda each: each[0])
    return fold.value, side, motion, machine


@pytest.mark.parametrize("of", [system_and_fold, structure_and_fold])
@pytest.mark.parametrize("max_step", [0.02, 0.05, 0.3])
def test_a_transcritical_crossing_is_passed_and_switched_at(of, max_step):
    value, side, motion, machine = beside_a_fold(of)

    def at(x):
        return machine.replace(drive_frequency=value + side * x * x)

    ranges = {"system": at, "x": (-0.05, 0.01, 0.05)}
    branch = vi.follow_motion(motion, **ranges, max_step=max_step)
    assert branch.ends == ("bound", "bound")
    (point,) = branch.bifurcations
    assert (point.kind, point.branching) == ("branch_point", "transcritical")
    # The fold is known to rounding, x as its root.
    assert abs(point.value) < 1e-6
    other = vi.switch_branch(point, system=at, x=(-0.05, point.value, 0.05), max_step=max_step)
    assert other.ends == ("bound", "bound")
    # Both motions of a value of x are those of -x, on the other branch: they have changed places.
    for x in (0.03, 0.01):
        here, there, back = branch.at(x)[0], branch.at(-x)[0], other.at(-x)[0]
        assert back.nodes == pytest.approx(here.nodes, abs=1e-8)
        assert np.abs(there.nodes - here.nodes).max() > 1e-4
        # One multiplier has passed 1, and no other.
        real = [each.multipliers[each.multipliers.imag == 0].real for each in (here, there)]
        assert abs(np.diff([np.count_nonzero(each > 1) for each in real])) == 1


@pytest.mark.parametrize("of", [system_and_fold, structure_and_fold])
@pytest.mark.parametrize("difference", [1e-9, 5e-5])
def test_a_crossing_that_is_missed_is_two_folds_or_none(of, difference):
    value, side, motion, machine = beside_a_fold(of)
    for sign in (1, -1):

        def at(x, sign=sign):
            shift = x * x + sign * difference
            return machine.replace(drive_frequency=value + side * shift)

        x = math.sqrt(1e-4 - sign * difference)
        branch = vi.follow_motion(motion, system=at, x=(-0.05, x, 0.05))
        assert branch.ends == ("bound", "bound")
        folds = [fold.value for fold in branch.bifurcations]
        assert {str(fold.kind) for fold in branch.bifurcations} <= {"saddle_node"}
        wanted = [] if sign == 1 else [math.sqrt(difference)]
        assert folds == pytest.approx(wanted, rel=1e-3 if difference < 1e-6 else 1e-6)


# What is said of ends, what is refused, files


def test_a_branch_point_comes_back_from_a_file(tmp_path):
    symmetric().save(tmp_path / "branch.npz")
    loaded = vi.load(tmp_path / "branch.npz")
    for found, known in zip(loaded.bifurcations, symmetric().bifurcations, strict=True):
        assert found.branching is known.branching
        assert np.array_equal(found.other, known.other)
    point = loaded.of_kind("branch_point")[1]
    again = vi.switch_branch(point, both=False, **WIDE)
    assert np.array_equal(again.values, sides(1)[0].values)


def test_what_is_no_branch_point_over_a_number_is_refused():
    graze = symmetric().of_kind("grazing")[0]
    with pytest.raises(vi.ParameterError, match="kind period_doubling or branch_point"):
        vi.switch_branch(graze, **WIDE)
    point = symmetric().of_kind("branch_point")[1]
    with pytest.raises(vi.ParameterError, match=r"direction = 2 .* 1 or -1"):
        vi.switch_branch(point, direction=2, **WIDE)
    # One gap alone parts the branches: over it there is a single branch.
    with pytest.raises(vi.ParameterError, match="two branches over gap_0 cross"):
        vi.switch_branch(point, gap_0=(0.3, 0.5))
    # Both gaps keep the symmetry.
    over = vi.switch_branch(point, gap=(0.38, 0.42))
    assert over.of_kind("branch_point")[0].value == 0.4

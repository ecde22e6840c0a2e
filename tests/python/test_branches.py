"""Branches of periodic motions: bifurcations, switching, friction from 0 on, bad input.

Their borders are tested in test_branch_borders.py, what simulations and closed forms say of them in
test_branch_references.py.
"""

import math

import numpy as np
import pytest

import sizes
import vibroimpact as vi
from branch_cases import CASES, branch_of, known, motion_of_case
from ctrl_c import ctrl_c_in
from vibroimpact._core import Border, Condition, Leg
from vibroimpact.orbits.problem import OrbitProblem


@pytest.fixture(scope="module", params=CASES)
def case(request):
    return request.param


def events(branch):
    """Kind and place of every event but neutral saddles, which are no bifurcations.

    Near a grazing multipliers run through infinity, so that neutral saddles lie as close to one
    another as one likes.
    """
    return sorted(
        (found.kind, found.value) for found in branch.bifurcations if found.kind != "neutral_saddle"
    )


def assert_same_events(one, other, tolerance=1e-10):
    assert [kind for kind, _ in one] == [kind for kind, _ in other]
    for (_, value), (_, again) in zip(one, other, strict=True):
        assert again == pytest.approx(value, rel=0, abs=tolerance)


def test_cases_have_every_kind():
    kinds = {found.kind for name in CASES for found in branch_of(name).bifurcations}
    assert kinds == {
        "saddle_node",
        "period_doubling",
        "neimark_sacker",
        "neutral_saddle",
        "grazing",
        "regime_border",
        "contact_border",
        "chatter_onset",
    }
    tests = [found.test for name in CASES for found in branch_of(name).bifurcations]
    assert {
        Border.STOP_AT_END_OF_APPROACH,
        Border.STOP_AT_END_OF_IMPACT,
        Border.SIDE_OF_IMPACT,
        Border.SLIP_BEFORE,
        Border.LENGTH,
        Border.SLIP_AT_START,
    } <= {test.border for test in tests if isinstance(test, Condition)}


@pytest.mark.parametrize(
    ("step", "max_step"), sizes.either([(0.02, 0.08)], [(0.004, 0.025), (0.02, 0.08)])
)
def test_places_depend_on_no_start_steps_or_direction(case, step, max_step):
    """Each way by itself, from another start and with other steps, they are those of the whole."""
    branch = branch_of(case)
    piece = max(branch.pieces, key=lambda piece: len(piece.values))
    start = piece.motion(len(piece.values) // 3)
    options = {"step": step, "max_step": max_step, "max_points": 4000, **CASES[case][1]}
    ways = [vi.follow_motion(start, both=False, direction=way, **options) for way in (1, -1)]
    assert sorted(way.ends[1] for way in ways) == sorted(branch.ends)
    assert [way.ends[0] for way in ways] == ["start", "start"]
    if "closed" in branch.ends:
        for way in ways:
            assert_same_events(events(branch), events(way))
    else:
        assert_same_events(events(branch), sorted(events(ways[0]) + events(ways[1])))


@pytest.mark.parametrize(
    ("name", "kind"),
    [
        ("one_one", "saddle_node"),
        ("one_one", "period_doubling"),
        ("one_one", "neimark_sacker"),
        ("four_five", "grazing"),
        ("slides_and_sticks", "contact_border"),
        ("newton", "regime_border"),
    ],
)
def test_a_branch_stops_at_the_first_bifurcation_of_a_kind_each_way(name, kind):
    _, ranges = CASES[name]
    found = 0
    for way in (1, -1):
        options = {"both": False, "direction": way, **ranges}
        whole = vi.follow_motion(motion_of_case(name), **options)
        part = vi.follow_motion(motion_of_case(name), stop_at=kind, **options)
        kinds = [str(each.kind) for each in whole.bifurcations]
        if kind not in kinds:
            assert part.ends == whole.ends
            continue
        found += 1
        known = whole.bifurcations[: kinds.index(kind) + 1]
        assert (part.ends, part.why_not) == (("start", kind), ("", ""))
        assert_same_events(events(part), sorted((each.kind, each.value) for each in known
                                                if each.kind != "neutral_saddle"))  # fmt: skip
        assert part.values[-1] == part.bifurcations[-1].value
        assert part.bifurcations[-1].goes_on == known[-1].goes_on
    assert found


def test_both_directions_in_one_call_are_the_whole():
    branch = branch_of("force")
    piece = max(branch.pieces, key=lambda piece: len(piece.values))
    again = vi.follow_motion(piece.motion(len(piece.values) // 3), **CASES["force"][1])
    assert_same_events(events(branch), events(again))
    assert again.ends == branch.ends


def test_chatter_onset_is_named_wherever_a_branch_is_joined():
    """Started within rounding of it, all of a path may lie where a simulation is undecided."""
    branch = branch_of("chatter")
    piece = max(branch.pieces, key=lambda piece: len(piece.values))
    for part in sizes.either((11,), (2, 4, 9, 11)):
        start = piece.motion(len(piece.values) * part // 12)
        again = vi.follow_motion(start, **CASES["chatter"][1])
        assert again.ends == ("bound", "chatter_onset")
        assert_same_events(events(branch), events(again))


def smooth(branch):
    return [
        found
        for found in branch.bifurcations
        if found.kind in ("saddle_node", "period_doubling", "neimark_sacker")
    ]


def test_multipliers_are_those_of_the_bifurcation(case):
    for found in smooth(branch_of(case)):
        values = found.motion.multipliers
        # Rounding of the eigenvalues, relative to the largest.
        tolerance = 1e-9 * max(1.0, abs(values[0]))
        if found.kind == "saddle_node":
            assert np.abs(values - 1.0).min() < tolerance
        elif found.kind == "period_doubling":
            assert np.abs(values + 1.0).min() < tolerance
        else:
            pairs = values[values.imag > 0.0]
            assert np.abs(np.abs(pairs) - 1.0).min() < tolerance


def test_points_are_motions_with_the_multipliers_of_the_branch(case):
    # A motion taken from a branch begins with the first event of its first drive period, which a
    # node may have left or entered along the branch.
    for piece in branch_of(case).pieces:
        # At rounding's distance from a bifurcation a motion may be on its other side.
        inside = np.abs(piece.values[:, None] - piece.values[[0, -1]]).min(axis=1) > 1e-11
        for k in np.flatnonzero(inside)[::3]:
            motion = piece.motion(k)
            assert motion.admissible, motion.why_not
            assert ((motion.nodes[:, 3] >= 0.0) | (motion.legs == (Leg.CIRCUIT,))).all()
            size = max(1.0, abs(motion.multipliers[0]))
            assert np.poly(motion.multipliers) == pytest.approx(
                np.poly(piece.multipliers[k]), abs=1e-9 * size**2
            )


def test_a_closed_branch_comes_back_to_its_start():
    branch = branch_of("six_seven")
    assert branch.ends == ("closed", "closed")
    first, last = branch.pieces[0], branch.pieces[-1]
    start, end = first.motion(0), last.motion(len(last.values) - 1)
    assert first.values[0] == pytest.approx(last.values[-1], abs=1e-12)
    shifts = [np.roll(end.sections, k, axis=0) - start.sections for k in range(start.m)]
    assert min(np.abs(shift).max() for shift in shifts) < 1e-9


def test_doubled_motions_are_admissible_and_meet_the_doubling_again():
    doubling = branch_of("one_one").of_kind("period_doubling")[0]
    branch = vi.switch_branch(doubling, drive_frequency=(1.5, 1.6))
    for piece in branch.pieces:
        inner = range(1, len(piece.values) - 1)
        assert all(piece.motion(k).admissible for k in inner)
    assert branch.ends == ("start", "period_doubling")
    # The branch that leaves 1-1 at one doubling comes back to it at another, found there too.
    others = [d.value for d in branch_of("one_one").of_kind("period_doubling")]
    assert min(abs(branch.bifurcations[-1].value - value) for value in others) < 1e-10
    assert abs(branch.bifurcations[-1].value - doubling.value) > 0.01


# Friction from 0 on


@pytest.mark.parametrize("name", ["5b", "6b", "6b_one_two", "9_1", "7c_0.45"])
def test_a_branch_over_friction_starts_without_friction(name):
    motion = known(name)
    assert motion.system.friction == 0.0
    branch = vi.follow_motion(motion, friction=(0.0, 0.3))
    start = branch.pieces[0].motion(0)
    assert start.admissible, start.why_not
    assert branch.values.min() == 0.0
    assert np.abs(start.sections - motion.sections).max() < 1e-12
    assert np.abs(start.multipliers - motion.multipliers).max() < 1e-9
    assert branch.values.max() == 0.3
    # The motion changes with friction, and is one.
    piece = branch.pieces[-1]
    end = piece.motion(len(piece.values) - 1)
    assert end.admissible, end.why_not
    assert np.abs(end.sections - motion.sections).max() > 1e-4
    # Against central differences over friction at its small end.
    small = 1e-4
    ahead = vi.periodic_motion(
        motion.system.replace(friction=small), initial=motion.initial, periods=motion.m
    )
    assert ahead.admissible
    again = vi.follow_motion(motion, both=False, friction=(0.0, small))
    last = again.pieces[-1].motion(len(again.pieces[-1].values) - 1)
    assert np.abs(last.sections - ahead.sections).max() < 1e-11


def test_the_doubled_and_the_single_motion_meet_over_friction():
    # 2-4 at omega = 1.1 ends on 1-2, at the doubling of which it was born; found from both sides.
    double = vi.follow_motion(known("6b"), friction=(0.0, 1.0))
    single = vi.follow_motion(known("6b_one_two"), friction=(0.0, 1.0))
    assert double.ends[1] == "period_doubling"
    (doubling,) = single.of_kind("period_doubling")
    assert double.bifurcations[-1].value == pytest.approx(doubling.value, abs=1e-10)


def test_direct_contact_has_no_friction_to_vary():
    with pytest.raises(vi.ParameterError, match="friction"):
        vi.follow_motion(known("direct"), friction=(0.0, 1.0))


# Bad input and Ctrl-C


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({}, "exactly one parameter"),
        ({"gap": (0.0, 1.0), "friction": (0.0, 1.0)}, "exactly one parameter"),
        ({"omega": (1.0, 2.0)}, "omega"),
        ({"contact": (0.0, 1.0)}, "contact"),
        ({"drive_frequency": 2.0}, "drive_frequency"),
        ({"drive_frequency": (1.0, math.nan)}, "drive_frequency"),
        ({"drive_frequency": (1.9, 2.0)}, "range .* around 1.8"),
        ({"drive_frequency": (1.8, 1.8)}, "range"),
        ({"drive_frequency": (1.0, 2.0), "step": 0.0}, "step"),
        ({"drive_frequency": (1.0, 2.0), "step": 0.1, "max_step": 0.01}, "step"),
        ({"drive_frequency": (1.0, 2.0), "max_points": 1}, "max_points"),
        ({"drive_frequency": (1.0, 2.0), "direction": 0}, "direction"),
    ],
)
def test_bad_input_is_refused(arguments, words):
    with pytest.raises(vi.ParameterError, match=words):
        vi.follow_motion(motion_of_case("one_one"), **arguments)


def test_a_saddle_node_is_not_switched_at():
    fold = branch_of("one_one").of_kind("saddle_node")[0]
    with pytest.raises(vi.ParameterError, match="bifurcation"):
        vi.switch_branch(fold, drive_frequency=(1.5, 1.6))


def test_ctrl_c_keeps_the_branch_so_far(monkeypatch):
    motion = motion_of_case("one_one")
    with ctrl_c_in(monkeypatch, OrbitProblem, "border_tests", at=40) as caught:
        vi.follow_motion(
            motion, step=1e-5, max_step=1e-4, max_points=10**6, drive_frequency=(0.9, 2.5)
        )
    branch = caught.value.result
    assert isinstance(branch, vi.Branch)
    assert "interrupted" in branch.ends
    assert any("followed on" in why for why in branch.why_not)
    assert 1 < len(branch.values) < 40
    assert len(branch.values) > 2

"""Coexisting motions of the paper's Fig. 9(3) system: their branches, checked by simulation.

Values of bifurcations come from the continuation; what they are checked against is computed by
other means: simulations with other tolerances, and differences of the simulated map.
"""

import numpy as np
import pytest

import vibroimpact as vi
from vibroimpact.paper.parameters import MOTIONS

RANGE = (1.5, 1.6)


@pytest.fixture(scope="module")
def motions() -> tuple[vi.PeriodicMotion, ...]:
    system = next(motion.system for motion in MOTIONS if motion.id == "9(3)")
    return vi.search_motions(system, starts=64, periods=3000).motions


@pytest.fixture(scope="module")
def branches(motions) -> list[vi.Branch]:
    return [vi.follow_motion(motion, drive_frequency=RANGE) for motion in motions]


@pytest.fixture(scope="module")
def doubled(branches) -> list[vi.Branch]:
    """The branches of doubled motions, at the period doublings of both stable motions."""
    return [vi.switch_branch(stable_doubling(branch), drive_frequency=RANGE) for branch in branches]


def stable_doubling(branch: vi.Branch) -> vi.Bifurcation:
    """The period doubling at which a branch loses its stability."""
    found = [
        bifurcation
        for bifurcation in branch.of_kind("period_doubling")
        if np.abs(bifurcation.motion.multipliers[1]) < 1
    ]
    assert len(found) == 1
    return found[0]


def test_both_motions_of_the_paper_are_found(motions):
    assert [motion.label for motion in motions] == ["4-5", "6-7"]
    assert all(motion.admissible and motion.stable for motion in motions)


def test_no_border_is_passed_where_two_lie_within_a_step(branches):
    # The 4-5 motion grazes at 1.57684; 7e-5 further on its branch would meet the grazing of the 2-2
    # motion, where the same gap is zero again.
    graze = branches[0].of_kind("grazing")[-1]
    assert graze.value == pytest.approx(1.57684048624, abs=1e-11)
    for piece in branches[0].pieces:
        assert all(piece.motion(k).admissible for k in range(1, len(piece.values) - 1))


def test_a_closed_branch_keeps_all_its_borders(branches):
    ring = branches[1]
    assert ring.ends == ("closed", "closed")
    borders = [found for found in ring.bifurcations if ": " in found.test]
    assert len(borders) == len(ring.pieces)
    ends = {round(float(piece.values[k]), 9) for piece in ring.pieces for k in (0, -1)}
    assert ends == {round(found.value, 9) for found in borders}


@pytest.mark.parametrize("which", [0, 1])
def test_doubled_motions_begin_at_the_period_doubling(branches, doubled, which):
    start, branch = stable_doubling(branches[which]), doubled[which]
    first = branch.pieces[0]
    single = start.motion
    assert first.label == f"{2 * single.m}-{2 * single.n}"
    assert first.values[0] == pytest.approx(start.value, abs=1e-12)
    # Stable as soon as its multiplier can be told from 1.
    away = np.flatnonzero(np.abs(first.multipliers[:, 0] - 1.0) > 1e-6)
    assert first.stable[away[:3]].tolist() == [True] * 3


def test_sections_of_a_doubled_branch_begin_with_the_single_motion_twice(branches, doubled):
    for branch, twice in zip(branches, doubled, strict=True):
        m = stable_doubling(branch).motion.m
        sections = twice.pieces[0].sections
        assert sections.shape == (len(twice.pieces[0].values), 2 * m)
        assert np.allclose(sections[0, :m], sections[0, m:], rtol=0, atol=1e-12)
        assert np.abs(sections[-1, :m] - sections[-1, m:]).max() > 1e-3


def test_a_branch_can_be_switched_to_at_either_end_of_it(branches):
    # A branch that ends at a period doubling of a shorter motion begins there, too.
    for end in (branches[0].bifurcations[0], branches[0].bifurcations[-1]):
        assert end.kind == "period_doubling"
        back = vi.switch_branch(end, drive_frequency=RANGE)
        assert {piece.label for piece in back.pieces} == {"4-5", "4-6"}


def test_a_run_that_has_not_settled_is_carried_on_before_it_is_refined(motions):
    # The label of these runs, 12-14, is foretold during transients; Newton's method leads from
    # there to unstable 4-5, 6-8, 12-16 and 12-17 motions, which attract nothing.
    found = vi.search_motions(
        motions[0].system.replace(drive_frequency=1.567), starts=150, periods=4000
    )
    assert [motion.label for motion in found.motions] == ["12-14"]
    assert found.motions[0].stable
    assert found.shares[0] + sum(found.others.values()) == pytest.approx(1.0)

"""A branch in a file comes back as it was."""

import numpy as np
import pytest

import vibroimpact as vi
from systems import PAPER, STICKY

START = (0.0, 0.5, 0.0, 0.0)


def same_motion(one, other):
    assert (one.label, one.system, one.legs) == (other.label, other.system, other.legs)
    assert np.array_equal(one.nodes, other.nodes)
    assert (one.stability, one.admissible, one.error) == (
        other.stability,
        other.admissible,
        other.error,
    )


@pytest.mark.parametrize(
    ("system", "ranges"),
    [
        (PAPER, {"drive_frequency": (1.5, 1.9)}),
        (STICKY, {"restitution": (0.25, 0.35)}),
    ],
    ids=["flight", "contact"],
)
def test_a_branch_comes_back_as_it_was(system, ranges, tmp_path):
    branch = vi.simulate(system, initial=START, periods=600, keep=100).refine().follow(**ranges)
    assert len(branch) > 5
    branch.save(tmp_path / "branch.npz")
    loaded = vi.load(tmp_path / "branch.npz")
    assert repr(loaded) == repr(branch)
    assert loaded.ends == branch.ends
    assert [type(end) for end in loaded.ends] == [type(end) for end in branch.ends]
    assert loaded.why_not == branch.why_not
    for one, other in zip(loaded.pieces, branch.pieces, strict=True):
        assert (one.system, one.parameter) == (other.system, other.parameter)
        assert (one.label, one.itinerary.legs) == (other.label, other.itinerary.legs)
        for name in ("values", "nodes", "multipliers"):
            assert np.array_equal(getattr(one, name), getattr(other, name))
        assert np.array_equal(one.at_sections("v1"), other.at_sections("v1"))
    for one, other in zip(loaded.bifurcations, branch.bifurcations, strict=True):
        assert (one.kind, one.value, one.test) == (other.kind, other.value, other.test)
        assert type(one.test) is type(other.test)
        assert (one.test_value, one.goes_on) == (other.test_value, other.goes_on)
        same_motion(one.motion, other.motion)
    name, (low, high) = next(iter(ranges.items()))
    middle = {name: 0.5 * (low + high)}
    for one, other in zip(loaded.at(**middle), branch.at(**middle), strict=True):
        same_motion(one, other)


def test_a_branch_goes_on_from_a_file(tmp_path):
    motion = vi.simulate(PAPER, initial=START, periods=600, keep=100).refine()
    motion.follow(drive_frequency=(1.5, 1.9)).save(tmp_path / "branch.npz")
    loaded = vi.Branch.load(tmp_path / "branch.npz")
    doubling = loaded.of_kind("period_doubling")[0]
    doubled = vi.switch_branch(doubling, drive_frequency=(1.45, 1.6))
    assert 2 in {piece.itinerary.periods for piece in doubled.pieces}


def test_a_branch_over_the_number_of_a_function_is_refused(tmp_path):
    motion = vi.simulate(PAPER, initial=START, periods=600, keep=100).refine()
    branch = vi.follow_motion(
        motion, system=lambda f: PAPER.replace(moment_amplitude=f), f=(0.99, 1.0, 1.01)
    )
    with pytest.raises(vi.ParameterError, match=r"branch over f, .* a file holds no function"):
        branch.save(tmp_path / "branch.npz")
    assert not any(tmp_path.iterdir())


def test_a_branch_without_points_comes_back(tmp_path):
    empty = vi.Branch(
        parameter="gap",
        pieces=(),
        bifurcations=(),
        ends=vi.simulate(PAPER, initial=START, periods=600, keep=100)
        .refine()
        .follow(gap=(0.49, 0.51))
        .ends,
    )
    empty.save(tmp_path / "branch.npz")
    assert repr(vi.load(tmp_path / "branch.npz")) == repr(empty)


def test_a_file_of_a_motion_is_no_branch(tmp_path):
    vi.simulate(PAPER, initial=START, periods=600).refine().save(tmp_path / "motion.npz")
    with pytest.raises(ValueError, match="holds a motion, not a branch"):
        vi.Branch.load(tmp_path / "motion.npz")


def test_a_branch_with_borders_comes_back(tmp_path):
    system = PAPER.replace(gap=0.1, drive_frequency=1.1)
    motion = vi.simulate(system, initial=START, periods=600, keep=100).refine()
    branch = motion.follow(drive_frequency=(0.8, 1.6))
    assert branch.of_kind("grazing")
    branch.save(tmp_path / "branch.npz")
    again = vi.load(tmp_path / "branch.npz")
    assert [each.test for each in again.bifurcations] == [each.test for each in branch.bifurcations]
    assert repr(again) == repr(branch)

"""Ctrl-C while motions and bifurcations are followed: wherever it comes, what is done is kept.

Each call is interrupted at many places, by an exception in the conditions of periodicity or in the
confirmation of a point, instead of after a time.
"""

import numpy as np
import pytest

import sizes
import vibroimpact as vi
from vibroimpact.orbits.curve_problem import CurveProblem
from vibroimpact.orbits.problem import OrbitProblem

# How many places of a call are looked at.
PLACES = sizes.either(5, 12)
PLANE = {"drive_frequency": (1.1, 1.6), "moment_amplitude": (0.7, 1.3)}


class Count:
    """Calls of a function, one of which raises KeyboardInterrupt."""

    def __init__(self, monkeypatch, *places):
        self.calls, self.at = 0, -1
        for owner, name in places:
            monkeypatch.setattr(owner, name, self.counted(getattr(owner, name)))

    def counted(self, plain):
        def counting(*arguments, **options):
            self.calls += 1
            if self.calls == self.at:
                raise KeyboardInterrupt
            return plain(*arguments, **options)

        return counting

    def interrupted(self, call, at):
        """Return the result of a call that is interrupted at one of the calls that are counted."""
        self.calls, self.at = 0, at
        with pytest.raises(KeyboardInterrupt) as caught:
            call()
        assert isinstance(caught.value, vi.Interrupted)
        assert self.calls >= at
        return caught.value.result

    def places(self, call, number):
        """Return the whole result, and numbers of calls spread over it."""
        self.calls, self.at = 0, -1
        whole = call()
        return whole, np.unique(np.linspace(1, self.calls, number).astype(int))


def settled(**changes):
    """Return a motion of the paper's undamped system, frictionless but for changes."""
    system = vi.System(
        **{
            "mass_ratio": 0.6,
            "frequency_ratio": 2.0,
            "restitution": 0.8,
            "gap": 0.5,
            "moment_amplitude": 1.0,
            **changes,
        }
    )
    return vi.simulate(system, initial=(0, 0.5, 0, 0), periods=600, keep=100).refine()


def rows_in(part, whole):
    """Whether all rows of an array are rows of another, bit for bit."""
    return {row.tobytes() for row in part} <= {row.tobytes() for row in whole}


@pytest.mark.parametrize(
    "place",
    [(OrbitProblem, "residual"), (OrbitProblem, "tests"), (OrbitProblem, "motion")],
    ids=lambda place: place[1],
)
def test_a_branch(monkeypatch, place):
    motion = settled(drive_frequency=1.5752, friction=0.5)
    count = Count(monkeypatch, place)

    def follow():
        return vi.follow_motion(motion, both=False, drive_frequency=(1.57, 1.58))

    whole, places = count.places(follow, PLACES)
    assert len(whole.pieces) > 1
    lengths = []
    for at in places:
        branch = count.interrupted(follow, at)
        assert isinstance(branch, vi.Branch)
        assert branch.ends == ("start", "interrupted")
        assert branch.values.tobytes() == whole.values[: len(branch.values)].tobytes()
        found = [bifurcation.value for bifurcation in branch.bifurcations]
        assert found == [bifurcation.value for bifurcation in whole.bifurcations[: len(found)]]
        lengths.append(len(branch.values))
    # All of the branch so far, but for the step under way.
    assert lengths == sorted(lengths)
    assert lengths[0] == 0
    assert lengths[-1] >= 0.8 * len(whole.values)


def test_the_second_direction_of_a_branch(monkeypatch):
    motion = settled(drive_frequency=1.8)
    count = Count(monkeypatch, (OrbitProblem, "residual"))

    def follow(**options):
        return vi.follow_motion(motion, drive_frequency=(1.75, 1.85), **options)

    whole, places = count.places(follow, 3)
    branch = count.interrupted(follow, places[-1])
    assert branch.ends == ("bound", "interrupted")
    assert branch.values[0] == whole.values[0] == 1.75
    assert len(branch.values) > 0.8 * len(whole.values)


@pytest.mark.parametrize("name", ["residual", "tests", "monodromy"])
def test_a_curve(monkeypatch, name):
    branch = vi.follow_motion(settled(drive_frequency=1.8), drive_frequency=(1.4, 1.85))
    bifurcation = branch.of_kind("period_doubling")[0]
    owner = CurveProblem if name == "tests" else OrbitProblem
    count = Count(monkeypatch, (owner, name))

    def follow():
        return vi.bifurcation_curve(
            bifurcation, drive_frequency=(1.4, 1.85), moment_amplitude=(0.8, 1.2)
        )

    whole, places = count.places(follow, PLACES)
    lengths = []
    for at in places:
        curve = count.interrupted(follow, at)
        assert isinstance(curve, vi.BifurcationCurve)
        assert rows_in(curve.values, whole.values)
        assert len(curve.multipliers) == len(curve.bounds_stability) == len(curve.values)
        assert repr(curve)
        lengths.append(len(curve.values))
    assert lengths == sorted(lengths)
    assert lengths[0] == 0
    assert lengths[-1] >= 0.8 * len(whole.values)


def test_a_region(monkeypatch):
    motion = settled(drive_frequency=1.25)
    count = Count(monkeypatch, (OrbitProblem, "residual"))

    def walk():
        return vi.stability_region(motion, **PLANE)

    whole, places = count.places(walk, PLACES)
    assert whole.closed
    lengths = []
    for at in places:
        region = count.interrupted(walk, at)
        assert isinstance(region, vi.StabilityRegion)
        assert not region.closed
        assert region.why_not == "interrupted"
        assert rows_in(region.border, whole.border)
        assert "open: interrupted" in repr(region)
        assert region.sheets([[0.0, 0.0]]).tolist() == [0]
        lengths.append(len(region.border))
    assert lengths == sorted(lengths)
    assert lengths[0] == 0
    assert lengths[-1] >= 0.8 * len(whole.border)

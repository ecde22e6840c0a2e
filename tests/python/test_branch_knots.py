"""Branches go on where the restitution passes a knot of its curve, with a kink, or turn there."""

import numpy as np
import pytest

import sizes
import vibroimpact as vi
from systems import PAPER

START = (0, 0.5, 0, 0)


def _motion(restitution, **numbers):
    system = PAPER.replace(restitution=restitution, **numbers)
    motion = vi.simulate(system, initial=START, periods=600, keep=100).refine()
    assert motion.label == "1-1"
    return motion


@pytest.mark.parametrize(
    ("restitution", "along"),
    [
        (vi.RestitutionTable([0.5, 2.0, 4.5], [0.8, 0.65, 0.5]), {"speed_1": (0.6, 3)}),
        (
            vi.RestitutionTable([0.2, 0.6, 1.0, 1.5, 2.0], [0.85, 0.8, 0.74, 0.68, 0.62]),
            {"moment_amplitude": (0.5, 3)},
        ),
        (vi.RestitutionPowerLaw(0.85, 0.9, 0.25), {"least_speed": (0.5, 2)}),
    ],
)
def test_a_branch_passes_the_knots_of_a_curve(restitution, along):
    branch = vi.follow_motion(_motion(restitution), **along)
    assert branch.ends == ("bound", "bound")
    ((name, (low, high)),) = along.items()
    # On both sides of each knot it is a motion that the algebraic equations have, too.
    for value in np.linspace(low, high, 9)[1:-1]:
        (here,) = branch.at(value)
        known = [each.approach_velocity for each in vi.periodic_motions(here.system)]
        assert np.abs(np.array(known) - here.approach_velocity).min() < 1e-9
        assert getattr(here.system, name) == pytest.approx(value)


def test_a_branch_turns_at_a_knot_where_both_sides_are_at_the_same_values():
    restitution = vi.RestitutionTable([0.75, 0.97, 2.35, 2.63], [0.816, 0.798, 0.551, 0.204])
    numbers = {"mass_ratio": 0.594, "frequency_ratio": 1.273, "gap": 0.2412}
    motion = _motion(restitution, **numbers, drive_frequency=1.5566, moment_amplitude=1.356)
    branch = vi.follow_motion(motion, moment_amplitude=(0.3, 3))
    assert branch.ends == ("bound", "bound")
    turns = np.flatnonzero(np.diff(np.sign(np.diff(branch.values))))
    speeds = [branch.motions[k + 1].approach_velocity for k in turns]
    assert np.abs(np.subtract.outer(speeds, restitution.speeds)).min(axis=1).min() < 1e-4
    # Several motions at one value, each of which the algebraic equations have, too.
    value = float(branch.values[turns[0] + 1])
    side = np.sign(branch.values[turns[0]] - value)
    for here in branch.at(value + 0.01 * side):
        known = [each.approach_velocity for each in vi.periodic_motions(here.system)]
        assert np.abs(np.array(known) - here.approach_velocity).min() < 1e-9
    assert len(branch.at(value + 0.01 * side)) > 1


def test_branches_of_random_curves_do_not_end_at_their_knots():
    random = np.random.default_rng(11)
    followed = 0
    while followed < sizes.either(4, 40):
        count = int(random.integers(2, 6))
        speeds = np.sort(random.uniform(0.1, 3.0, count))
        table = vi.RestitutionTable(speeds, np.sort(random.uniform(0.2, 0.95, count))[::-1])
        numbers = {
            "mass_ratio": random.uniform(0.2, 1.5),
            "frequency_ratio": random.uniform(0.8, 2.5),
            "gap": random.uniform(0.05, 0.8),
            "drive_frequency": random.uniform(0.8, 2.5),
            "moment_amplitude": random.uniform(0.7, 2.0),
        }
        system = PAPER.replace(restitution=table, **numbers)
        motion = vi.simulate(system, initial=(0, 0.3, 0, 0), periods=600, keep=60).refine()
        if not motion or motion.label != "1-1":
            continue
        followed += 1
        for along in ({"moment_amplitude": (0.3, 3)}, {"gap": (0.01, 1.5)}):
            assert "no convergence" not in vi.follow_motion(motion, **along).ends

"""Branches whose motions touch a stop inside a flight: without the impact, and with it."""

import dataclasses

import numpy as np
import pytest

import vibroimpact as vi

pytest.importorskip("flint")


def touched():
    """A branch over the place of a stop that its 1-1 motions just reach, and that place."""
    oscillator = vi.Structure(
        [[1]],
        [[1]],
        [vi.Stop([1], 0.3, 0.7), vi.Stop([-1], 3.0, 0.7)],
        damping_ratios=[0.05],
        drive_amplitude=[1],
        drive_frequency=2.0,
    )
    motion = vi.simulate(oscillator, initial=[[0], [0]], periods=200, keep=50).refine()
    times = np.linspace(0, motion.m * oscillator.drive_period, 20001)
    reach = float(-motion.trajectory(times)[:, 0].min())
    return motion.follow(gap_1=(reach - 0.01, 3.1)), reach


def test_a_branch_ends_where_a_flight_touches_a_stop(tmp_path):
    from vibroimpact.proof.branch_proving import Tubes, proved_branch

    whole, reach = touched()
    pieces = tuple(piece for piece in whole.pieces if piece.label == "1-1")
    branch = dataclasses.replace(whole, pieces=pieces)
    (graze,) = [x.value for x in branch.bifurcations if x.kind == "grazing"]
    proof, _ = proved_branch(branch, (graze - 1e-7, graze + 1e-7), Tubes(40, None))
    (piece,) = proof.certificate["pieces"]
    assert piece["legs"] == [[1, "passed"], [0, "frictionless"]]
    (found,) = proof.bifurcations
    assert (found.kind, found.label) == ("grazing", "1-1")
    assert found.hi - found.lo < 1e-14
    assert abs(found.lo - reach) < 1e-6
    below, above = proof.stretches
    assert (below.verdict, below.why) == ("disproved", "leg 1: a stop is met in a flight")
    assert (above.verdict, above.stability) == ("proved", "stable")
    assert (below.hi, above.lo) == (found.lo, found.hi)
    proof.save(tmp_path / "touch.json")
    again = vi.check_proof(tmp_path / "touch.json")
    assert again.stretches == proof.stretches
    assert again.bifurcations == proof.bifurcations


def test_the_motions_with_the_impact_are_proved_up_to_the_graze_too():
    """Their multiplier grows without bounds there; both kinds of motions lie on the same side."""
    branch, reach = touched()
    proof = vi.prove(branch, within=(reach - 1e-4, reach + 1e-4))
    assert {(x.kind, x.label) for x in proof.bifurcations} == {
        ("grazing", "1-1"),
        ("grazing", "1-2"),
    }
    assert all(abs(x.lo - reach) < 1e-6 and x.hi - x.lo < 1e-14 for x in proof.bifurcations)
    graze = {x.label: x for x in proof.bifurcations}
    ends = {(x.label, x.stability): x.lo for x in proof.stretches if x.lo == graze[x.label].hi}
    assert set(ends) == {("1-1", "stable"), ("1-2", "unstable")}
    assert not proof.uncovered

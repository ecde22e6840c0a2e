"""Painleve points of structures: where friction leaves no motion, or more than one."""

import numpy as np
import pytest

import vibroimpact as vi

#: a = 1, b = -2, c = 5: with mu = 0.8 slip forwards presses the stop together, a + mu b < 0.
TIGHT = vi.Stop([0, 1], 0, 0, friction=0.8, tangent=[1, -2])


def block(**fields) -> vi.Structure:
    return vi.Structure(np.eye(2), np.zeros((2, 2)), [TIGHT], drive_frequency=1, **fields)


def test_stick_ends_where_no_slip_fits():
    # P = press + 2 and Q = -1 hold it; Q = -mu P at press = -0.75
    structure = block(static_load=[1, 0.5], drive_amplitude=[0, 1.5])
    run = vi.simulate(structure, initial=np.zeros((2, 2)), time=5)
    assert [vi.EventKind(kind).name for kind in run.events["kind"]] == ["STICK", "STOP"]
    assert run.stop_reason == "painleve"
    assert run.final_state.time == pytest.approx(np.arccos(-1.25 / 1.5), abs=1e-13)
    pytest.importorskip("flint")
    found = vi.verify(run)
    assert (found.stopped, found.horizon) == ("completed", None), found


def test_a_plastic_impact_ends_where_stick_and_flight_are_motions():
    # it ends in stick, which the load along the stop would hold against that which pulls it off
    structure = block(static_load=[1, -0.25], drive_amplitude=[0, 0])
    run = vi.simulate(structure, initial=[[0, -0.1], [0.05, 1]], time=5)
    assert run.stop_reason == "painleve"
    assert len(run.impacts) == 1
    assert run.impacts["regime"][0] in (vi.Regime.STICK_APPROACH, vi.Regime.STICK_RESTITUTION)
    pytest.importorskip("flint")
    found = vi.verify(run)
    assert (found.stopped, found.horizon) == ("completed", None), found


def test_a_plastic_impact_is_left_where_stick_does_not_hold():
    structure = block(static_load=[0, -1], drive_amplitude=[0, 0])
    run = vi.simulate(structure, initial=[[0, -0.1], [0.05, 1]], time=1)
    assert (run.stop_reason, len(run.impacts), len(run.contacts)) == ("completed", 1, 0)

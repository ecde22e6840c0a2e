"""Nonsmooth modes of structures without a drive: closed form, multipliers, runs, bad input."""

import math

import numpy as np
import pytest

import vibroimpact as vi

ELASTIC = vi.Structure(np.eye(2), [[2, -1], [-1, 1]], [vi.Stop([0, 1], 1.0, 1.0)])


@pytest.mark.parametrize(("mode", "period"), [(0, (7.9, 10.2)), (1, (3.7, 3.9))])
def test_nonsmooth_modes_are_their_closed_form(mode, period):
    branch = vi.nonsmooth_mode(ELASTIC, mode=mode, period=period)
    frequencies, at_stop = ELASTIC.frequencies, ELASTIC.shapes[1]
    assert branch.values[0] == pytest.approx(math.tau / frequencies[mode], abs=1e-12)
    single = branch.pieces[0]
    assert single.label == "1-1"
    assert len(single.values) > 5
    tangents = np.tan(np.outer(single.values, frequencies) / 2) * frequencies
    impulse = -2 / np.sum(at_stop**2 / tangents, axis=1)
    # P = (1 + r) u/(n M^-1 n).
    found = 2 * single.at_impacts("approach_velocity")[:, 0]
    assert found == pytest.approx(impulse, abs=1e-11)
    for motion in (single.motion(3), single.motion(len(single.values) - 2)):
        assert motion.admissible, motion.why_not
        # Energy and time reversal: multipliers l, 1/l, two of them 1.
        assert np.prod(motion.multipliers) == pytest.approx(1, abs=1e-9)
        assert np.sort(np.abs(motion.multipliers - 1))[:2] == pytest.approx(0, abs=1e-6)
        run = vi.simulate(ELASTIC, initial=motion.state, time=2.5 * motion.period)
        times = run.impacts["time"]
        assert np.diff(times[times > 1e-9]) == pytest.approx(motion.period, abs=1e-10)
    middle = float(single.values[2] + single.values[3]) / 2
    (motion,) = branch.at(period=middle)
    assert motion.period == pytest.approx(middle, abs=1e-13)


@pytest.mark.parametrize(
    ("changes", "options", "message"),
    [
        ({"restitution": 0.9}, {}, r"stops\[0\].restitution"),
        ({"damping_ratios": [0.1, 0]}, {}, "damping_ratios"),
        ({"drive_amplitude": [1, 0]}, {}, "drive_amplitude"),
        ({"static_load": [1, 0]}, {}, "static_load"),
        ({"gap": -0.1}, {}, "gap"),
        ({}, {"mode": 2}, "mode"),
        ({}, {"stop": 1}, "stop"),
        ({}, {"period": (1, 2)}, "around the period of the mode"),
        ({"stiffness": [[1, 0], [0, 2]]}, {"mode": 0, "period": (6, 7)}, "moves towards stop 0"),
    ],
)
def test_what_has_no_nonsmooth_mode_is_refused(changes, options, message):
    with pytest.raises(vi.ParameterError, match=message):
        vi.nonsmooth_mode(ELASTIC.replace(**changes), **({"period": (8, 11)} | options))

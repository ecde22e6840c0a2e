"""Labels of runs of structures that settle within the run, or after it."""

import numpy as np
import pytest

import vibroimpact as vi
from struck import OSCILLATOR, REST

CHAIN = vi.Structure(
    np.eye(2).tolist(),
    [[2, -1], [-1, 2]],
    [vi.Stop([1, 0], 0.4, 0.7), vi.Stop([0, 1], 0.4, 0.7)],
    damping_ratios=0.05,
    drive_amplitude=[1, 0],
    drive_frequency=1.3,
)


@pytest.mark.parametrize("periods", [20, 50, 100, 150, 190, 200])
def test_a_run_that_settles_has_the_label_of_its_motion(periods):
    """The first periods have other numbers of impacts: the whole window shows no return."""
    run = vi.simulate(OSCILLATOR, initial=[[0], [-1]], periods=periods)
    assert run.label == "1-1"
    motion = run.refine()
    assert motion
    assert motion.stable


@pytest.mark.parametrize("periods", [30, 100, 199])
def test_the_same_holds_in_a_sweep(periods):
    values = [1.2, 1.3]
    short = vi.sweep(CHAIN, initial=REST[2], periods=periods, drive_frequency=values)
    long = vi.sweep(CHAIN, initial=REST[2], periods=2000, keep=200, drive_frequency=values)
    assert "unresolved" not in long.label.tolist()
    assert short.label.tolist() == long.label.tolist()

"""Derivatives of long chaotic motions, which grow beyond the range of numbers."""

import re

import numpy as np
import pytest

import vibroimpact as vi
from small_results import START
from systems import PAPER

# Their exponents are 0.05 and 0.19 per unit of time.
CHAOTIC = PAPER.replace(friction=0.5, drive_frequency=1.52, damping=(0.001, 0.001))
BETWEEN_STOPS = vi.Structure(
    [[1, 0], [0, 2]],
    [[2, -1], [-1, 1]],
    [vi.Stop([side, 0], 0.3, 0.8) for side in (1, -1)],
    damping_ratios=[0.02, 0.05],
    drive_amplitude=[0, 1],
    drive_frequency=0.82,
)
CASES = {"system": (CHAOTIC, START, 4000), "structure": (BETWEEN_STOPS, [[0.01, 0], [0, 0]], 600)}


@pytest.mark.parametrize("kind", CASES)
def test_derivatives_beyond_the_range_of_numbers_are_refused_with_the_time(kind):
    machine, initial, periods = CASES[kind]
    run = vi.simulate(machine, initial=initial, periods=periods)
    with pytest.raises(vi.SimulationError, match="beyond 1e308 by t = ") as refused:
        run.sensitivity("gap")
    time = float(re.search(r"by t = ([0-9.]+)", str(refused.value))[1])
    assert 0.5 * run.final_state.time < time < run.final_state.time
    # Up to the impact before they are numbers, and nearly as large as numbers can be.
    times = run.impacts["time"]
    before = times[np.flatnonzero(times < time)[-1]]
    found = vi.simulate(machine, initial=initial, time=before).sensitivity("gap")
    assert np.isfinite(found.impacts.time).all()
    assert np.isfinite(found.final_state).all()
    assert abs(found.final_state).max() > 1e300


@pytest.mark.parametrize("kind", CASES)
def test_so_are_those_of_a_window_and_gradients(kind):
    machine, initial, periods = CASES[kind]
    kept = vi.simulate(machine, initial=initial, periods=periods, keep=20)
    with pytest.raises(vi.SimulationError, match="beyond 1e308 by t = "):
        kept.sensitivity("gap")
    names = ["gap"] if kind == "system" else ["gap_0"]
    with pytest.raises(vi.SimulationError, match="beyond 1e308 by t = "):
        vi.gradient(
            lambda run: run.impacts["time"][-1], machine, names, initial=initial, periods=periods
        )

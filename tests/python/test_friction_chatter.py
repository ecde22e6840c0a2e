"""Derivatives through chatter with friction, where slip decays at another rate than bounces."""

import numpy as np
import pytest

import vibroimpact as vi

STILL = np.zeros((2, 2))


def coupled(restitution: float, friction: float, coupling: float, frequency: float):
    """Two masses pressed on a stop along which they slide."""
    return vi.Structure(
        [[1, coupling], [coupling, 1.5]],
        [[2, -0.5], [-0.5, 3]],
        [vi.Stop([1, 0], 0.1, restitution, friction=friction, tangent=[0, 1])],
        damping_ratios=[0.05, 0.05],
        static_load=[0.5, 0.3],
        drive_amplitude=[1, 0.7],
        drive_frequency=frequency,
    )


@pytest.mark.parametrize(
    "numbers", [(0.5, 0.9, 0.6, 0.5), (0.6, 0.61, 0.6, 0.8), (0.7, 0.3, -0.5, 0.8)]
)
def test_runs_have_derivatives_beyond_chatter_with_friction(numbers):
    structure = coupled(*numbers)
    run = vi.simulate(structure, initial=STILL, periods=2)
    ends = run.contacts["time"][run.contacts["kind"] == vi.EventKind.CHATTER]
    times = np.linspace(ends[0], run.final_state.time, 7)[1:-1]
    found = run.sensitivity("phase", "gap_0", "friction_0")
    mine = found.trajectory(times).reshape(len(times), 4, 3)
    step = 1e-6
    for column, name in enumerate(found.names):
        value = structure.phase if name == "phase" else structure.stops[0].gap
        value = structure.stops[0].friction if name == "friction_0" else value

        def at(steps: int, name: str = name, value: float = value):
            changed = structure.replace(**{name: value + steps * step})
            states = vi.simulate(changed, initial=STILL, periods=2).trajectory(times)
            return states.reshape(len(times), 4)

        difference = (8 * (at(1) - at(-1)) - (at(2) - at(-2))) / (12 * step)
        # The runs are right to some 1e-14.
        assert np.allclose(mine[:, :, column], difference, rtol=1e-7, atol=1e-7), name

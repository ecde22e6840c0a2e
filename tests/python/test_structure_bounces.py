"""Derivatives of runs of structures through bounces that end in contact, against differences."""

import numpy as np
import pytest

import vibroimpact as vi
from struck import changed, numbers_of, onset_between


def test_derivatives_near_the_onset_of_chatter_are_those_of_differences():
    # A second mass, by a spring, feels when the first one has come to rest.
    table = vi.Structure(
        np.diag([1.0, 0.7]),
        [[0.3, -0.3], [-0.3, 0.3]],
        [vi.Stop([1, 0], 0.0, 0.5)],
        drive_amplitude=[1, 0],
        drive_frequency=1,
    )

    def fallen(height, by=0.0):
        return vi.simulate(table, initial=[[by - height, -height], [0, 0]], time=1.8)

    low, _ = onset_between(0.01, 0.1, fallen)
    height = low * (1 - 1e-6)
    found = fallen(height).sensitivity("q_0").final_state[..., 0]
    h = 3e-9
    ends = [fallen(height, by).final_state for by in (h, -h)]
    up, down = (np.concatenate([end.q, end.v]) for end in ends)
    assert found == pytest.approx((up - down) / (2 * h), abs=3e-7)


@pytest.mark.parametrize("friction", [0.0, 0.3])
@pytest.mark.parametrize(
    "restitution", [0.0, 1e-12, 1e-10, 1e-9, 1e-8, 1e-7, 1e-6, 1e-5, 1e-4, 1e-3, 5e-3, 0.018, 0.1]
)
def test_bounces_of_any_restitution_end_with_their_derivatives(restitution, friction):
    # Of a small one few bounces are told before rounding ends them, or only the first.
    tangent = {"friction": friction, "tangent": [0.2, 1]} if friction else {}
    structure = vi.Structure(
        np.eye(2),
        [[4, -1], [-1, 3]],
        [vi.Stop([1, 0.3], 0.1, restitution, amplitude=0.02, **tangent)],
        damping_ratios=[0.02, 0.02],
        static_load=[2, 0.5],
        drive_amplitude=[0.5, 0.2],
        drive_frequency=1.0,
    )
    initial, time, h = np.array([[-0.1, 0.0], [0.6, 0.4]]), 0.9, 1e-4
    names = list(dict.fromkeys(["restitution_0", *numbers_of(structure)]))

    def simulated(machine, start):
        return vi.simulate(machine, initial=start, time=time)

    run = simulated(structure, initial)
    assert run.contacts["kind"][-1] != vi.EventKind.RELEASE
    times = np.array([0.4, 0.6, 0.8])
    exact = run.sensitivity(*names).trajectory(times)
    exact = exact.reshape(len(times), 4, len(names))

    def moved(name, step):
        machine, start = changed(structure, initial, name, step)
        return simulated(machine, start).trajectory(times).reshape(len(times), 4)

    for column, name in enumerate(names):
        if name == "restitution_0" and restitution < 2 * h:
            weights = dict(enumerate([-25 / 12, 4, -3, 4 / 3, -1 / 4]))
        else:
            weights = {-2: 1 / 12, -1: -2 / 3, 1: 2 / 3, 2: -1 / 12}
        slope = sum(weight * moved(name, k * h) for k, weight in weights.items()) / h
        off = np.abs(exact[..., column] - slope).max() / (1 + np.abs(slope).max())
        assert off < 3e-8, f"{name}: {off:.1e}"

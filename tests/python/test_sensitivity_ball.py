"""Derivatives of a ball that falls on a table at rest: all is known in closed form."""

import numpy as np
import pytest

import vibroimpact as vi


def _ball(restitution, pull=1.0):
    return vi.System(
        mass_ratio=0,
        frequency_ratio=0,
        restitution=restitution,
        gap=0,
        drive_frequency=0,
        moment_amplitude=pull,
        contact="direct",
    )


@pytest.mark.parametrize("restitution", np.linspace(0.3, 0.95, 14).round(2).tolist())
@pytest.mark.parametrize("height", [0.3, 1.0, 2.5])
def test_a_ball_that_comes_to_rest_has_derivatives_by_all_of_its_numbers(height, restitution):
    # It falls for t0 and comes to rest at t0 (1 + r)/(1 - r).
    first = np.sqrt(2.0 * height)
    end = first * (1.0 + restitution) / (1.0 - restitution)
    run = vi.simulate(_ball(restitution), initial=(-height, 0, 0, 0), time=1.2 * end)
    assert (run.contacts["kind"] == vi.EventKind.CHATTER).any()
    times = run.impacts["time"]
    for name, moved in (
        ("moment_amplitude", -0.5 * times),
        ("static_moment", -0.5 * times),
        ("x1", -0.5 * times / height),
    ):
        found = run.sensitivity(name)
        assert found.impacts.time[:, 0] == pytest.approx(moved, rel=1e-9)
        assert np.abs(found.final_state).max() < 1e-9
    for name in ("restitution", "gap", "v1"):
        assert np.isfinite(run.sensitivity(name).impacts.time).all()


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("last", [7, 8])
def test_a_fit_goes_no_further_than_the_last_sound(last, seed):
    # The motion comes to rest after it. That of the guess does, too.
    run = vi.simulate(_ball(0.85), initial=(-1, 0, 0, 0), time=12.8)
    noise = 1e-3 * np.random.default_rng(seed).standard_normal(last)
    noise[-1] = -1e-3
    record = vi.Record("impact_times", run.impacts["time"][:last] + noise, sigma=1e-3)
    guess = _ball(0.85, pull=1.1)
    found = vi.fit(record, guess, unknown=["moment_amplitude"], initial=run.initial, starts=1)
    assert found.verdict == "fits"
    assert abs(found.estimates[0] - 1.0) < 4.0 * found.standard_errors[0]

"""Derivatives of structures with a mode damped far beyond its critical damping."""

import numpy as np
import pytest

import vibroimpact as vi

pytestmark = pytest.mark.filterwarnings("ignore:damping_ratios:UserWarning")

TIME = 20.0
AWAY, RUBBING, PRESSED = -50.0, 2.0, 50.0
REST = np.zeros((2, 2))


def damped(ratio, load, omega=1.0):
    """Return two coupled bodies, the first mode damped by ``ratio``, held by ``load``."""
    return vi.Structure(
        np.eye(2),
        [[4.0, -1.0], [-1.0, 3.0]],
        [vi.Stop([1, 0], 0.1, 0.5, friction=0.3, tangent=[0, 1])],
        damping_ratios=[ratio, 0.02],
        static_load=[load, 0.5],
        drive_amplitude=[0.5, 0.2],
        drive_frequency=omega,
    )


def end(system):
    """Return the four numbers of the final state of a run from rest."""
    return vi.simulate(system, initial=REST, time=TIME).final_state.state.ravel()


def by_differences(of, value):
    """Return the derivative of ``of`` at ``value`` from central differences."""
    step = 1e-5 * value
    return (end(of(value + step)) - end(of(value - step))) / (2 * step)


@pytest.mark.parametrize("load", [AWAY, RUBBING, PRESSED])
@pytest.mark.parametrize("ratio", [10.0, 1e3])
def test_they_are_those_of_differences(ratio, load):
    run = vi.simulate(damped(ratio, load), initial=REST, time=TIME)
    assert (len(run.impacts) > 0) == (len(run.contacts) > 0) == (load != AWAY)
    found = run.sensitivity(
        drive_frequency=(lambda omega: damped(ratio, load, omega), 1.0),
        damping=(lambda other: damped(other, load), ratio),
    ).final_state
    by_omega = by_differences(lambda omega: damped(ratio, load, omega), 1.0)
    by_ratio = by_differences(lambda other: damped(other, load), ratio)
    # States of at most 20 have roundings of 4e-15, divided by the step of 1e-5; its square is
    # 1e-10 times a third derivative.
    assert found[..., 0] == pytest.approx(by_omega, abs=1e-8)
    assert ratio * found[..., 1] == pytest.approx(ratio * by_ratio, abs=1e-8)


def test_they_are_refused_where_a_contact_would_take_endless_steps():
    run = vi.simulate(damped(1e6, PRESSED), initial=REST, time=TIME)
    with pytest.raises(vi.SimulationError, match=r"damped too strongly.* in the leg from t = "):
        run.sensitivity("drive_frequency")


def test_names_that_a_flight_does_not_depend_on_are_not_refused():
    run = vi.simulate(damped(1e6, AWAY), initial=REST, time=TIME)
    assert not np.asarray(run.sensitivity("gap_0").final_state).any()
    with pytest.raises(vi.SimulationError, match=r"damped too strongly.* in the leg from t = 0"):
        run.sensitivity("drive_frequency")

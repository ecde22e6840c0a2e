"""The energy audit of runs of structures, against works that are known without it."""

import numpy as np
import pytest

import vibroimpact as vi
from struck import MOVING, REST, RUNS


@pytest.mark.parametrize("name", RUNS)
def test_works_explain_the_change_of_energy(name):
    run = RUNS[name]()
    audit = run.energy_audit()
    assert abs(audit.residual) < 1e-12 * audit.total
    assert audit.damping <= 0.0
    assert audit.contact_friction <= 0.0
    kept = run.impacts["time"] >= run.kept_from
    taken = run.impacts["energy_loss"][kept].sum()
    # Impacts that chatter skipped take energy, too.
    assert -audit.impacts >= taken * (1.0 - 1e-12)


def test_energy_is_that_of_the_matrices():
    run = vi.simulate(MOVING, initial=[[-0.2], [0.5]], time=0.5)
    assert run.energy_audit().energy_start == pytest.approx(0.5 * (0.2**2 + 0.5**2), rel=1e-14)


def test_a_constant_load_alone_does_the_work_of_a_potential():
    load = np.array([1.5, -0.4])
    ball = vi.Structure(np.eye(2), np.zeros((2, 2)), [vi.Stop([1, 0], 0.0, 0.8)], static_load=load)
    run = vi.simulate(ball, initial=[[-1, 0], [0, 0]], time=5.0)
    audit = run.energy_audit()
    assert len(run.impacts) > 2
    assert audit.loads == pytest.approx(load @ (run.final_state.q - run.initial[0]), rel=1e-11)
    assert audit.impacts == pytest.approx(-run.impacts["energy_loss"].sum(), rel=1e-12)
    assert (audit.damping, audit.contact_friction, audit.stops) == (0.0, 0.0, 0.0)


def test_a_moving_stop_does_the_work_of_its_impulses():
    run = vi.simulate(MOVING, initial=REST[1], periods=1)
    assert len(run.contacts) == 0
    first = run.impacts[run.impacts["stop"] == 0]
    stop, omega = MOVING.stops[0], MOVING.drive_frequency
    # g = n q - gap - A cos(omega t): the stop's velocity along q' n is -A omega sin(omega t).
    speed = -stop.amplitude * omega * np.sin(omega * first["time"])
    work = -(first["impulse_normal"] * speed).sum()
    assert run.energy_audit().stops == pytest.approx(work, rel=1e-11)


def test_a_saved_run_has_the_same_audit(tmp_path):
    for run in (RUNS[name]() for name in RUNS):
        run.save(tmp_path / "run.npz")
        assert vi.load(tmp_path / "run.npz").energy_audit() == run.energy_audit()

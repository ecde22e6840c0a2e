"""The energy audit of runs of structures, against works that are known without it."""

import numpy as np
import pytest

import sizes
import vibroimpact as vi
from random_structures import corner, swinging
from struck import MOVING, REST, RUNS

FAMILIES = {
    "linear": swinging,
    "friction": lambda seed: swinging(seed, rough=True),
    "contact": lambda seed: swinging(seed, pressed=True),
    "corner": corner,
}
#: Runs that had other works, or went into a stop: another stop met in the end of a chatter; one
#: that was to stay closed, and was pulled off by an impact at that instant; slip that no force
#: holds.
FOUND = {"friction": (49, 91), "contact": (48, 104, 112, 130, 196), "corner": (98,)}


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


@pytest.mark.parametrize("family", FAMILIES)
def test_random_structures_enter_no_stop_and_explain_their_energy(family):
    worst, deepest = 0.0, 0.0
    cases = sizes.either(12, 500)
    for seed in {*range(cases), *FOUND.get(family, ())}:
        structure, initial = FAMILIES[family](seed)
        run = vi.simulate(structure, initial=initial, periods=4, max_events=2000)
        audit = run.energy_audit()
        error = abs(audit.residual) / max(audit.total, 1e-3)
        end = run.final_state.time
        times = np.minimum(np.linspace(0, end, 150), end)
        q = np.concatenate([run.trajectory(times)[:, 0], run.impacts["q"]])
        angles = structure.drive_frequency * np.append(times, run.impacts["time"])
        depth = 0.0
        for stop in structure.stops:
            gap = q @ stop.normal - stop.gap - stop.amplitude * np.cos(angles + stop.phase)
            depth = max(depth, (gap / np.maximum(1, np.abs(q).max(axis=1))).max())
        assert depth < 1e-13, f"{family} {seed}: {depth:.1e}"
        assert error < 1e-9, f"{family} {seed}: {error:.1e}"
        worst, deepest = max(worst, error), max(deepest, depth)
    print(f"{family}: energy {worst:.1e}, depth {deepest:.1e}")

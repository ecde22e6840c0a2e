"""Energy audit of a run, from Python."""

import dataclasses
import math

import numpy as np
import pytest

import vibroimpact as vi

CHATTERING = vi.System(
    mass_ratio=0.6,
    frequency_ratio=2,
    restitution=0.3,
    gap=0.5,
    drive_frequency=0.25,
    damping=(0.1, 0.1),
    moment_amplitude=3,
    force_amplitude=1.5,
    friction=0.3,
)


def energy(run: vi.Run, state: np.ndarray) -> float:
    x1, v1, x2, v2 = state
    system = run.system
    first = v1**2 + (system.frequency_ratio * x1) ** 2
    return 0.5 * (first + (v2**2 + x2**2) / system.mass_ratio)


# One that presses the bodies together, one that leaves them more room.
LOADS = [(0.0, 0.0), (0.5, 0.0), (-0.3, 0.2)]


@pytest.mark.parametrize("loads", LOADS)
@pytest.mark.parametrize("law", ["poisson", "newton", "energetic"])
def test_works_sum_to_the_change_of_energy(law: str, loads: tuple[float, float]) -> None:
    moment, force = loads
    system = CHATTERING.replace(law=law, static_moment=moment, static_force=force)
    run = vi.simulate(system, initial=(0, 0.5, 0, 0), periods=6, keep=4)
    audit = run.energy_audit()
    works = (
        audit.moment
        + audit.force
        + audit.damping
        + audit.restitution
        + audit.impact_friction
        + audit.contact_friction
        + audit.wall
    )
    assert abs(audit.energy_end - audit.energy_start - works) <= 1e-12 * audit.total
    assert math.isclose(
        audit.residual, audit.energy_end - audit.energy_start - works, abs_tol=1e-14
    )
    start, end = run.trajectory([run.kept_from, run.final_state.time])
    assert math.isclose(audit.energy_start, energy(run, start), rel_tol=1e-13)
    assert math.isclose(audit.energy_end, energy(run, end), rel_tol=1e-13)
    # Every force has worked.
    for name in ("damping", "restitution", "impact_friction", "contact_friction"):
        assert getattr(audit, name) < 0, name
    assert audit.moment > 0
    assert audit.wall == 0


def test_constant_loads_alone_do_the_work_of_a_potential() -> None:
    changes = {"moment_amplitude": 0.0, "force_amplitude": 0.0, "damping": (0.0, 0.0)}
    system = CHATTERING.replace(**changes, static_moment=1.5, static_force=-0.4)
    run = vi.simulate(system, initial=(0, 0.5, 0, 0), periods=2)
    assert len(run.impacts) > 10
    audit = run.energy_audit()
    x1, _, x2, _ = run.final_state.state
    assert math.isclose(audit.moment, 1.5 * x1, rel_tol=1e-11)
    assert math.isclose(audit.force, -0.4 * x2 / 0.6, rel_tol=1e-11)


def test_work_of_impacts_is_what_they_took() -> None:
    system = CHATTERING.replace(drive_frequency=1.8, restitution=0.8, friction=0.5)
    run = vi.simulate(system, initial=(0, 0.5, 0, 0), periods=20)
    audit = run.energy_audit()
    assert len(run.contacts) == 0
    assert audit.contact_friction == 0
    taken = audit.restitution + audit.impact_friction
    assert math.isclose(taken, -run.impacts["energy_loss"].sum(), rel_tol=1e-13)


def test_a_saved_run_has_the_same_audit(tmp_path) -> None:
    run = vi.simulate(CHATTERING, initial=(0, 0.5, 0, 0), periods=3)
    run.save(tmp_path / "run.npz")
    assert vi.load(tmp_path / "run.npz").energy_audit() == run.energy_audit()


def test_the_audit_is_a_frozen_record() -> None:
    audit = vi.simulate(CHATTERING, initial=(0, 0.5, 0, 0), periods=1).energy_audit()
    assert isinstance(audit, vi.EnergyAudit)
    with pytest.raises(dataclasses.FrozenInstanceError):
        audit.moment = 0.0

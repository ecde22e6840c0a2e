"""What a user writes, checked by mypy --strict as the package's types are seen from outside.

test_stubs.py runs mypy on it; the types asserted are those that the documentation promises.
"""

from typing import assert_type

import numpy as np
from matplotlib.axes import Axes
from numpy.typing import NDArray

import vibroimpact as vi

system = vi.System(
    mass_ratio=0.6,
    frequency_ratio=2,
    restitution=0.8,
    gap=0.5,
    drive_frequency=1.8,
    moment_amplitude=1,
)
assert_type(system, vi.System)
assert_type(system.replace(friction=0.5), vi.System)
assert_type(system.drive_period, float)

run = vi.simulate(system, initial=(0, 0.5, 0, 0), periods=600, keep=100)
assert_type(run, vi.Run)
assert_type(run.label, str)
assert_type(run.final_state, vi.FinalState)
assert_type(run.energy_audit(), vi.EnergyAudit)
assert_type(run.trajectory(np.linspace(0, 1, 5)), NDArray[np.float64])
assert_type(vi.simulate(system, initial=[(0, 0.5, 0, 0), (0, 0.6, 0, 0)], periods=6), list[vi.Run])

assert_type(run.plot(), Axes)
assert_type(run.summary(), str)
assert len(run.impacts.to_pandas()) == len(run.impacts)
physical = vi.System.from_physical(
    pendulum_mass=0.3,
    oscillator_mass=0.5,
    length=0.2,
    torsional_stiffness=1.5,
    stiffness=40,
    gap=0.1,
    restitution=0.8,
    drive_frequency=12,
    law="energetic",
)
assert_type(physical.scales, vi.Scales | None)
in_si = vi.simulate(physical, initial=(0, 0.5, 0, 0), periods=6, units="SI").in_si()
assert_type(in_si, vi.RunInSI)
assert_type(in_si.final_state, vi.FinalState)


def machine(stiffness: float, damping: float = 0.0) -> vi.System:
    """Make the machine with a stiffness in N/m."""
    return physical.replace(drive_frequency=12 / stiffness, oscillator_damping=damping)


start = (0, 0.5, 0, 0)
assert_type(vi.chart(machine, initial=start, stiffness=[30], damping=[0.1]), vi.Chart)
assert_type(vi.sweep(machine, initial=lambda stiffness: start, stiffness=[30]), vi.Sweep)
assert_type(vi.bifurcation_diagram(machine, initial=start, stiffness=[30]), vi.Diagram)
assert_type(vi.lyapunov_spectrum(machine, initial=start, stiffness=[30]), vi.LyapunovSweep)

motion = run.refine()
assert_type(motion, vi.PeriodicMotion | vi.NotFound)
if isinstance(motion, vi.PeriodicMotion):
    assert_type(motion.stable, bool)
    assert_type(motion.period, float)
    branch = motion.follow(drive_frequency=(1.4, 2.2))
    assert_type(branch, vi.Branch)
    assert_type(branch.at(drive_frequency=1.6), tuple[vi.PeriodicMotion, ...])
    assert_type(branch.plot(), Axes)
    assert_type(vi.follow_motion(motion, drive_frequency=(1.4, 2.2)), vi.Branch)
    assert_type(vi.follow_motion(motion, system=machine, stiffness=(30, 40, 50)), vi.Branch)

diagram = vi.bifurcation_diagram(
    system, initial=(0, 0.5, 0, 0), drive_frequency=np.linspace(1.5, 1.6, 4)
)
assert_type(diagram, vi.Diagram)
assert_type(diagram.run(0), vi.Run)
assert_type(diagram.plot(), Axes)
assert_type(vi.plot.bifurcation(diagram), Axes)
assert_type(vi.chart(system, initial=(0, 0.5, 0, 0), gap=[0.4, 0.5]), vi.Chart)
assert_type(vi.basins(system, x1=[-1, 0], v1=[-1, 0]), vi.Basins)
assert_type(vi.basins(physical, units="SI", x2=[-0.1, 0], v2=[-1, 0]), vi.Basins)
assert_type(vi.impact(system, x1=0.3, v1=1.0, v2=0.0), NDArray[np.void])
assert_type(vi.EventKind(0), vi.EventKind)
assert_type(vi.sweeps.STATUS_NAMES, tuple[str, ...])
assert_type(vi.__version__, str)

structure = vi.Structure([[1]], [[4]], [vi.Stop([1], 0.5, 0.8)], drive_amplitude=[1j])
assert_type(structure, vi.Structure)
assert_type(structure.replace(gap=0.4), vi.Structure)
assert_type(vi.Structure.from_modes([2], [[1.0], [0.5]], structure.stops), vi.Structure)
assert_type(structure.stops, tuple[vi.Stop, ...])
assert_type(structure.stops[0].normal, NDArray[np.float64])
assert_type(structure.frequencies, NDArray[np.float64])
assert_type(structure.shapes, NDArray[np.float64])
assert_type(structure.drive_period, float)

"""A small result of every kind, made once: what tests call, copy, show and name.

They are so small that all together take seconds: a few drive periods, few points, few cells.
"""

import tempfile
from functools import cache
from pathlib import Path

import numpy as np

import vibroimpact as vi
from struck import moving_run, small_diagram
from systems import PAPER, ROUGH

START = (0.0, 0.5, 0.0, 0.0)


@cache
def motion() -> vi.PeriodicMotion:
    """A stable motion with one impact in every drive period."""
    found = vi.simulate(PAPER, initial=START, periods=300, keep=100).refine()
    assert isinstance(found, vi.PeriodicMotion)
    return found


@cache
def saddle() -> vi.PeriodicMotion:
    """A motion with one multiplier outside the unit circle."""
    found = (one for one in vi.periodic_motions(PAPER) if one.admissible)
    return next(one for one in found if np.sum(abs(one.multipliers) > 1.0) == 1)


@cache
def branch() -> vi.Branch:
    """A short branch that ends at a period doubling."""
    system = PAPER.replace(drive_frequency=1.515)
    doubled = vi.simulate(system, initial=START, periods=600, keep=100).refine()
    return vi.follow_motion(doubled, both=False, direction=-1, drive_frequency=(1.50, 1.52))


@cache
def run() -> vi.Run:
    """A short run with impacts."""
    return vi.simulate(ROUGH, initial=START, periods=3)


@cache
def grid_basins() -> vi.Basins:
    """Basins of a few cells, without rounds."""
    cells = {"x1": np.linspace(0, 0.1, 6), "v1": np.linspace(0, 0.1, 6)}
    damped = PAPER.replace(damping=(0.3, 0.3))
    return vi.basins(damped, periods=60, keep=20, scouts=4, rounds=0, **cells)


@cache
def proof() -> vi.Proof:
    """The proof of the motion."""
    return vi.prove(motion())


@cache
def branch_proof() -> vi.BranchProof:
    """The proof of a short range of a stable branch."""
    damped = PAPER.replace(damping=(0.05, 0.05))
    settled = vi.simulate(damped, initial=START, periods=300, keep=100).refine()
    return vi.prove(settled.follow(drive_frequency=(1.795, 1.805)), within=(1.799, 1.801))


@cache
def solutions() -> vi.PeriodicMotions:
    """All motions with one impact in a drive period."""
    return vi.periodic_motions(PAPER)


@cache
def solutions_proof() -> vi.SolutionsProof:
    """The proof that these are all."""
    return vi.prove(solutions())


@cache
def saved_proof() -> Path:
    """The file of its certificate."""
    path = folder() / "certificate.json"
    proof().save(path)
    return path


@cache
def region() -> vi.StabilityRegion:
    """A piece of the border of a region, a few points long."""
    plane = {"drive_frequency": (1.75, 1.85), "gap": (0.49, 0.51)}
    return vi.stability_region(motion(), max_points=8, **plane)


@cache
def motions() -> vi.MotionMap:
    """Motions over two values of two parameters."""
    grid = {"gap": [0.4, 0.5], "drive_frequency": [1.8, 1.9]}
    return vi.motion_map(PAPER, within=(0.3, 0.5), **grid)


@cache
def folder() -> Path:
    """A folder with a file and a store of each kind that can be loaded."""
    place = Path(tempfile.mkdtemp(prefix="valid_calls"))
    options = {"initial": START, "periods": 2}
    run().save(place / "run.npz")
    grid_basins().save(place / "basins.npz")
    results = {
        "sweep": vi.sweep(ROUGH, gap=[0.5], **options),
        "chart": vi.chart(ROUGH, gap=[0.5], friction=[0.1], **options),
        "diagram": vi.bifurcation_diagram(ROUGH, drive_frequency=[1.5], **options),
        "structure_diagram": small_diagram(),
        "lyapunov": vi.lyapunov_spectrum(ROUGH, initial=START, periods=20, gap=[0.5]),
        "structure_run": moving_run(),
        "branch": branch(),
        "motion": motion(),
        "spectrum": vi.lyapunov_spectrum(ROUGH, initial=START, periods=40, keep=20),
    }
    for name, result in results.items():
        result.save(place / f"{name}.npz")
    return place

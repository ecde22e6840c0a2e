"""The paper's criterion (42)-(45): its reference, its values over maps, where it is undefined."""

import numpy as np
import pytest

import vibroimpact as vi
from exact_motions import paper_system
from han_jin_hu_2004 import criterion
from references import SYMBOLS, reference

# Stated accuracy of fixed_points.json.
STATED = 1e-12
POINTS = reference("fixed_points.json")


def in_order(pairs):
    values = np.array([complex(*pair) for pair in pairs])
    return values[np.lexsort((-values.imag, -np.round(np.abs(values), 11)))]


def solution(system, n, x1) -> vi.PeriodicMotion:
    found = vi.periodic_motions(system, n, within=(x1 - 1e-3, x1 + 1e-3))
    return min(found, key=lambda motion: abs(motion.state[0] - x1))


@pytest.mark.parametrize("entry", POINTS, ids=range(len(POINTS)))
def test_the_roots_are_those_of_the_reference(entry):
    system = vi.System(**{SYMBOLS[symbol]: value for symbol, value in entry["params"].items()})
    motion = solution(system, entry["n"], entry["x1"])
    expected = in_order(entry["paper_eigenvalues"])
    assert np.abs(criterion.eigenvalues(motion) - expected).max() <= STATED
    said, largest = criterion.verdict(motion)
    assert said == entry["paper_verdict"]
    assert largest == pytest.approx(np.abs(expected).max())


@pytest.mark.parametrize(
    ("omega", "moment", "n", "largest"),
    [(1.25, 1.0, 1, 1.88), (1.8, 1.0, 1, 1.43), (2.75, 1.5, 2, 2.05)],
)
def test_stable_motions_that_are_shown_are_denied(omega, moment, n, largest):
    # Errata E5.
    (motion,) = [m for m in vi.periodic_motions(paper_system(omega, moment), n) if m.stable]
    assert criterion.verdict(motion) == ("unstable", pytest.approx(largest, abs=5e-3))


def test_a_map_has_the_roots_of_its_solutions():
    # Damped, both bodies driven, and at the resonance of either.
    system = paper_system(1.0, 1.0, damping=(0.02, 0.01), force_amplitude=0.4)
    grid = vi.motion_map(
        system, 2, within=(-1.5, 1.5), drive_frequency=[0.9, 1.0, 2.0], moment_amplitude=[0.9, 1.5]
    )
    rows, roots = grid.solutions, criterion.map_eigenvalues(grid)
    assert roots.shape == (len(rows), 4)
    assert len(rows) >= 10
    for k in range(len(rows)):
        values = {name: float(grid.parameter(name)[k]) for name in grid.grid}
        motion = solution(system.replace(**values), 2, rows["x1"][k])
        assert roots[k] == pytest.approx(criterion.eigenvalues(motion), rel=1e-9, abs=1e-9)
        assert criterion.is_stable(roots)[k] == (np.abs(roots[k]).max() < 1.0)


def test_it_is_refused_where_it_is_not_defined():
    wall = paper_system(
        1.0, 1.0, mass_ratio=0.0, frequency_ratio=1.0, damping=(0.05, 0.0), contact="direct"
    )
    at_wall = vi.periodic_motions(wall)[0]
    several = vi.simulate(paper_system(0.73, 2.3), initial=(0, 0.5, 0, 0), periods=600).refine()
    direct = paper_system(1.25, 1.0, damping=(0.05, 0.0), contact="direct")
    head_on = vi.periodic_motions(direct)[0]
    for motion in (at_wall, several, head_on):
        with pytest.raises(vi.ParameterError, match="the criterion is defined"):
            criterion.eigenvalues(motion)
    for system in (wall.replace(contact="oblique"), direct):
        with pytest.raises(vi.ParameterError, match="moving body 2"):
            criterion.map_eigenvalues(vi.motion_map(system, gap=[0.4, 0.5]))

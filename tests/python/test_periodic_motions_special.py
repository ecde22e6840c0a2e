"""Period n-1 motions in special systems: double roots, walls, resonance, none at all.

References: (38) of the paper in 200-bit balls, and values that others have published.
"""

import math

import numpy as np
import pytest
from flint import arb
from scipy.optimize import minimize_scalar

import vibroimpact as vi
from exact_motions import exact_residual, paper_system


def left_side(system, x):
    """(38), its left-hand side for n = 1, with x a ball or a float."""
    x = arb(x)
    omega, omega0 = arb(system.drive_frequency), arb(system.frequency_ratio)
    mbar, r = arb(system.mass_ratio), arb(system.restitution)
    a, b = (arb.pi() / omega).tan(), (arb.pi() * omega0 / omega).tan()
    c, y = x.cos(), x.sin() - arb(system.gap)
    square = (c / (omega0 * b)) ** 2 + ((1 - r) * (mbar + c**2) / ((1 + r) * omega * c)) ** 2
    return x**2 + 2 * a * c * y * x / (mbar * omega0 * b) + (a * y / mbar) ** 2 * square


def crossing(system, moment, inside, outside):
    """Where (38) holds between two places, by bisection in 200 bits."""
    level = (moment / (arb(system.frequency_ratio) ** 2 - arb(system.drive_frequency) ** 2)) ** 2
    inside, outside = arb(inside), arb(outside)
    for _ in range(150):
        middle = ((inside + outside) / 2).mid()
        below = left_side(system, middle) < level
        inside, outside = (middle, outside) if below else (inside, middle)
    return float(inside)


@pytest.mark.parametrize("omega", [1.25, 1.4, 2.2])
def test_two_solutions_that_merge(omega):
    # A saddle-node of (38): f1 at which its right-hand side meets the minimum of the left one.
    system = paper_system(omega, 1.0)
    best = minimize_scalar(lambda x: float(left_side(system, x)), bounds=(-0.5, 0.6)).x
    for _ in range(60):  # Newton's method on the slope, by differences in 200 bits
        h = arb(1e-20)
        low, mid, high = (left_side(system, arb(best) + k * h) for k in (-1, 0, 1))
        step = (high - low) / 2 * h / (high - 2 * mid + low)
        best = (arb(best) - step).mid()
    fold = mid.sqrt() * abs(arb(system.frequency_ratio) ** 2 - arb(omega) ** 2)
    place = float(best)
    for part in (1e-3, 1e-6, 1e-9, 1e-12):
        moment = float(fold * (1 + arb(part)))
        near = vi.periodic_motions(system.replace(moment_amplitude=moment))
        known = [crossing(system, arb(moment), best, place + side) for side in (-0.3, 0.3)]
        here = [motion for motion in near if abs(motion.state[0] - place) < 0.1]
        if part >= 1e-9:
            assert not near.undecided
            assert len(here) == 2
            for motion, x1 in zip(here, known, strict=True):
                # Rounding counts by the reciprocal of the distance to the fold.
                assert abs(motion.state[0] - x1) <= 1e-15 / math.sqrt(part)
            # At a saddle-node a multiplier is 1.
            edges = [min(abs(value - 1.0) for value in motion.multipliers) for motion in here]
            assert max(edges) <= 50.0 * math.sqrt(part)
        else:
            # Double precision may leave them undecided, but not drop them.
            boxes = [*near.boxes, *((item.lo, item.hi) for item in near.undecided)]
            for x1 in known:
                assert any(lo <= x1 <= hi for lo, hi in boxes)
        moment = float(fold * (1 - arb(part)))
        beyond = vi.periodic_motions(system.replace(moment_amplitude=moment))
        assert not [motion for motion in beyond if abs(motion.state[0] - place) < 0.1]
        if part >= 1e-9:
            assert not beyond.undecided
    met = vi.periodic_motions(system.replace(moment_amplitude=float(fold)))
    assert not [motion for motion in met if abs(motion.state[0] - place) < 0.1]
    assert any(item.lo <= place <= item.hi for item in met.undecided)
    assert all(abs(item.lo - place) + abs(item.hi - place) < 1e-5 for item in met.undecided)
    assert all("double root" in item.reason for item in met.undecided)


WALL = {"mass_ratio": 0.0, "frequency_ratio": 1.0, "contact": "direct", "moment_amplitude": 1.0}


def test_the_impact_oscillator_of_coco():
    # COCO, hspo demo `impact`.
    system = vi.System(**WALL, restitution=0.8, gap=1.0, drive_frequency=1.0, pendulum_damping=0.05)
    found = vi.periodic_motions(system)
    assert not found.undecided
    (motion,) = [motion for motion in found if motion.admissible]
    assert motion.state[0] == 1.0
    assert motion.approach_velocity == pytest.approx(1.695732937594882, rel=1e-12)
    assert motion.impacts["v1_post"][0] == pytest.approx(-1.356586350075906, rel=1e-12)
    # Only body 1's; given to 12 digits, a close pair: rounding counts by its square root.
    assert motion.multipliers.shape == (2,)
    known = -0.584295314342 + 0.005600351492j
    assert np.abs(motion.multipliers - [known, known.conjugate()]).max() <= 1e-12


def test_the_orbit_of_budd_and_dux():
    system = vi.System(**WALL, restitution=0.4, gap=0.001, drive_frequency=2.0)
    (motion,) = [motion for motion in vi.periodic_motions(system) if motion.admissible]
    assert motion.approach_velocity == pytest.approx(2.22221222219972, rel=1e-13)


def test_a_wall_at_rest_is_met_at_both_angles():
    # sin x1 = delta has two roots in a turn, and either two phases.
    system = vi.System(
        **(WALL | {"contact": "oblique"}),
        restitution=0.4,
        gap=0.3,
        drive_frequency=0.8,
        pendulum_damping=0.1,
    )
    found = vi.periodic_motions(system)
    low, high = math.asin(0.3), math.pi - math.asin(0.3)
    places = [motion.state[0] for motion in found]
    assert places == pytest.approx([low, low, high, high], abs=1e-15)
    for motion in found:
        assert exact_residual(motion)[0] <= 1e-14


def test_a_wall_that_swings_by_its_own_force():
    system = vi.System(
        **WALL,
        restitution=0.6,
        gap=0.3,
        drive_frequency=0.8,
        damping=(0.1, 0.2),
        force_amplitude=0.2,
    )
    found = vi.periodic_motions(system)
    assert len(found) == 2
    assert not found.undecided
    for motion in found:
        assert exact_residual(motion)[0] <= 1e-14 * max(1.0, abs(motion.return_map).max())


def test_undamped_resonance_of_the_pendulum():
    # omega = omega0: the impulse takes what the drive feeds in, kappa P = pi f/omega.
    system = paper_system(2.0, 1.0)
    found = vi.periodic_motions(system)
    assert not found.bounded
    assert "no bound" in found.note
    (motion,) = [motion for motion in found if motion.admissible]
    # Body 2 makes half a turn, so that it is met at rest place: sin x1 = delta.
    assert math.sin(motion.state[0]) == pytest.approx(0.5, abs=1e-15)
    assert motion.state[3] == pytest.approx(0.0, abs=1e-15)
    kick = motion.impacts["v1_pre"][0] - motion.impacts["v1_post"][0]
    assert kick == pytest.approx(math.pi / 2.0, rel=1e-14)
    assert exact_residual(motion)[0] <= 1e-14
    # The verdict does not depend on the impact falling on t = 0.
    later = vi.periodic_motions(system.replace(phase=1.0))
    assert [m.admissible for m in later] == [m.admissible for m in found]


@pytest.mark.parametrize("detuning", [1e-15, 1e-12, 1e-8, 1e-4])
def test_close_to_resonance_nothing_is_lost(detuning):
    system = paper_system(2.0 * (1.0 + detuning), 1.0, damping=(0.0, 0.02))
    found = vi.periodic_motions(system, within=(-1.5, 1.5))
    assert found
    for motion in found:
        off, size = exact_residual(motion)
        assert off <= 1e-14 * size * max(1.0, np.abs(motion.return_map).max())


@pytest.mark.parametrize(
    ("changes", "note"),
    [
        ({"drive_frequency": 1.0}, "undamped pendulum swings a whole number"),
        ({"drive_frequency": 1.0 / 3.0, "frequency_ratio": 1.9}, "undamped body 2 swings"),
        ({"frequency_ratio": 0.0, "contact": "direct"}, "nothing brings the free body 1 back"),
    ],
)
def test_systems_without_isolated_solutions_say_so(changes, note):
    found = vi.periodic_motions(paper_system(1.7, 1.0, **changes))
    assert len(found) == 0
    assert not found.undecided
    assert note in found.note


def test_the_elastic_undamped_system_has_motions_of_phase_0_and_pi():
    # r = 1: D, Nc and Ns vanish together at kappa = 0, where the phase is open; there is nothing.
    found = vi.periodic_motions(paper_system(1.8, 1.0, restitution=1.0))
    assert not found.undecided
    assert len(found) >= 10
    for motion in found:
        assert abs(math.sin(motion.state[3])) <= 1e-13
        assert abs(motion.determinant - 1.0) <= 1e-12 * np.abs(motion.return_map).max() ** 2


@pytest.mark.parametrize(("gap", "place"), [(0.0, "x1 = 0:"), (0.3, "x1 in [-0.3, 0.3]:")])
def test_where_x1_was_searched_is_told_without_the_smallest_floats(gap, place):
    wall = vi.System(
        mass_ratio=0,
        frequency_ratio=1,
        restitution=0.8,
        gap=gap,
        drive_frequency=2.6,
        moment_amplitude=1,
        contact="direct",
    )
    found = vi.periodic_motions(wall)
    assert repr(found).startswith(f"<PeriodicMotions with {place} {len(found)} solutions, ")

"""All period n-1 motions without friction: complete, exact, with their verdicts.

References: tests/data/fixed_points.json; the flights of tests/reference in 200-bit balls, which
share no code with the package; the paper's own (31) with a matrix exponential. Special systems are
in test_periodic_motions_special.py.
"""

import json
import math

import numpy as np
import pytest
from scipy.linalg import expm

import sizes
import vibroimpact as vi
from exact_motions import exact_residual, paper_system, random_system
from references import reference
from vibroimpact.system import SYMBOLS

# Stated accuracy of fixed_points.json.
STATED = 1e-12


def groups():
    """The reference by system and n."""
    found = {}
    for entry in reference("fixed_points.json"):
        found.setdefault((json.dumps(entry["params"]), entry["n"]), []).append(entry)
    return sorted(found.items())


def reference_system(parameters):
    return vi.System(**{SYMBOLS[symbol]: value for symbol, value in json.loads(parameters).items()})


def in_order(pairs):
    values = np.array([complex(*pair) for pair in pairs])
    return values[np.lexsort((-values.imag, -np.round(np.abs(values), 11)))]


@pytest.mark.parametrize(
    ("case", "known"), groups(), ids=[f"{k[1]}-{i}" for i, (k, _) in enumerate(groups())]
)
def test_the_reference_is_found_with_every_value(case, known):
    found = vi.periodic_motions(reference_system(case[0]), case[1])
    assert found.bounded
    assert not found.undecided
    taken = set()
    for entry in known:
        index = int(np.argmin([abs(motion.state[0] - entry["x1"]) for motion in found]))
        motion = found[index]
        taken.add(index)
        state = [entry[name] for name in ("x1", "v1", "v2", "phase")]
        assert np.abs(np.array(motion.state) - state).max() <= STATED
        assert motion.approach_velocity == pytest.approx(entry["approach_velocity"], abs=STATED)
        assert np.abs(motion.multipliers - in_order(entry["multipliers"])).max() <= STATED
        assert motion.admissible == entry["admissible"]
        # The reference calls stable what is also admissible.
        assert (motion.stable and motion.admissible) == entry["stable"]
        highest = entry["max_gap_between_impacts"]
        if highest > 0.0:
            # Sampled there, on some 2,000 points.
            assert 0.0 <= motion.max_gap - highest <= 1e-6
    assert len(taken) == len(known)
    for motion in found:
        off, size = exact_residual(motion)
        # Rounded states, carried through a flight that stretches them.
        assert off <= 1e-14 * size * max(1.0, np.abs(motion.return_map).max())


def test_the_quoted_motions_separate():
    # Errata E4: x10 of section 4.1, u of theory.md.
    for n, x1, u in ((1, 0.5369, -0.234), (2, 0.3300, -0.120)):
        motion = min(
            vi.periodic_motions(paper_system(0.65, 0.95), n), key=lambda m: abs(m.state[0] - x1)
        )
        assert motion.state[0] == pytest.approx(x1, abs=5e-5)
        assert motion.approach_velocity == pytest.approx(u, abs=5e-4)
        assert not motion.admissible
        assert motion.why_not.startswith("separating before the impact (u = -0.")


@pytest.mark.parametrize(
    ("omega", "moment", "n", "true"),
    [(1.25, 1.0, 1, 0.985), (1.8, 1.0, 1, 0.959), (2.75, 1.5, 2, 0.979)],
)
def test_the_shown_motions_are_stable(omega, moment, n, true):
    # Errata E5.
    system = paper_system(omega, moment)
    (motion,) = [m for m in vi.periodic_motions(system, n) if m.admissible and m.stable]
    assert abs(motion.multipliers[0]) == pytest.approx(true, abs=5e-4)
    run = vi.simulate(system, initial=motion.initial, periods=20 * n)
    assert run.label == f"{n}-1"
    assert np.abs(run.stroboscopic[n - 1 :: n] - motion.initial).max() <= 1e-12


def scan(system, n, grid):
    """sin^2 + cos^2 - 1 along x1, from (31) as printed with S_ij of a matrix exponential."""
    duration = 2.0 * math.pi * n / system.drive_frequency
    flights = []
    for natural, zeta, force in (
        (system.frequency_ratio, system.pendulum_damping, system.moment_amplitude),
        (1.0, system.oscillator_damping, system.force_amplitude),
    ):
        omega = system.drive_frequency
        generator = np.zeros((4, 4))
        generator[0, 1], generator[1] = 1.0, (-(natural**2), -2.0 * zeta * natural, 0.0, force)
        # sin and cos of the phase.
        generator[2, 3], generator[3, 2] = omega, -omega
        flights.append(expm(generator * duration)[:2])
    s, t = flights
    kappa = np.cos(grid) if system.contact == "oblique" else np.ones_like(grid)
    y = (np.sin(grid) if system.contact == "oblique" else grid) - system.gap
    mbar, r = system.mass_ratio, system.restitution
    q = mbar + kappa**2
    r1, r2 = (mbar - r * kappa**2) / q, (1.0 + r) * kappa / q
    r3, r4 = mbar * r2, (kappa**2 - r * mbar) / q
    matrix = np.empty((len(grid), 4, 4))
    for row in range(2):
        matrix[:, row, 0], matrix[:, row, 1] = r1 * s[row, 1] - row, r2 * s[row, 1]
        matrix[:, row + 2, 0], matrix[:, row + 2, 1] = r3 * t[row, 1], r4 * t[row, 1] - row
        matrix[:, row, 2:], matrix[:, row + 2, 2:] = s[row, 2:], t[row, 2:]
    rhs = np.stack([(1.0 - s[0, 0]) * grid, -s[1, 0] * grid, (1 - t[0, 0]) * y, -t[1, 0] * y], -1)
    unknowns = np.linalg.solve(matrix, rhs[..., None])[..., 0]
    return unknowns[:, 2] ** 2 + unknowns[:, 3] ** 2 - 1.0


def test_random_systems_nothing_is_missed_and_nothing_is_wrong():
    random = np.random.default_rng(2024)
    solutions = admissible = 0
    for _ in range(sizes.either(20, 60)):
        system, n = random_system(random), int(random.integers(1, 4))
        found = vi.periodic_motions(system, n)
        assert found.bounded, (system, found.note)
        assert not found.undecided, (system, found.undecided)
        solutions += len(found)
        admissible += sum(motion.admissible for motion in found)
        # Every change of sign in a dense scan has its solution; a cell without has none or two.
        reach = found.within[1]
        grid = np.linspace(-1.1 * reach - 0.1, 1.1 * reach + 0.1, 40_001)
        positive = scan(system, n, grid) > 0.0
        changes = positive[1:] != positive[:-1]
        places = [motion.state[0] for motion in found]
        counts = np.histogram(places, grid)[0]
        assert (counts % 2 == changes).all(), system
        for motion, box in zip(found, found.boxes, strict=True):
            # Newton's result lies in the proved box, up to its rounding.
            slack = 1e-13 * max(1.0, reach)
            assert box[0] - slack <= motion.state[0] <= box[1] + slack
            off, size = exact_residual(motion)
            assert off <= 1e-14 * size * max(1.0, np.abs(motion.return_map).max()), system
    # The scan would prove nothing about empty lists.
    assert solutions >= sizes.either(40, 120)
    assert admissible >= sizes.either(6, 20)


def test_wide_parameters_are_answered():
    # Every magnitude of a parameter: an answer, each solution in it exact.
    random = np.random.default_rng(8)

    def size():
        return 10.0 ** random.uniform(-4.0, 1.5)

    solutions = 0
    for _ in range(sizes.either(15, 80)):
        system = random_system(
            random,
            mass_ratio=size(),
            frequency_ratio=random.choice([0.0, size()]),
            restitution=random.choice([0.0, 1.0, 0.5]),
            gap=random.choice([-1.0, 1.0]) * size(),
            drive_frequency=10.0 ** random.uniform(-0.5, 1.5),
            moment_amplitude=size(),
            force_amplitude=random.choice([0.0, size()]),
        )
        found = vi.periodic_motions(system, int(random.integers(1, 3)))
        for motion in found:
            solutions += 1
            off, scale = exact_residual(motion)
            assert off <= 1e-13 * scale * max(1.0, np.abs(motion.return_map).max()), system
    assert solutions >= sizes.either(25, 200)


def test_admissible_motions_are_run_by_a_simulation():
    random = np.random.default_rng(77)
    seen = 0
    while seen < 15:
        system = random_system(random)
        for motion in vi.periodic_motions(system):
            if not motion.admissible:
                assert motion.why_not
                continue
            seen += 1
            assert motion.approach_velocity > 0.0
            assert motion.max_gap < 0.0
            run = vi.simulate(system, initial=motion.initial, periods=1)
            assert run.impact_count == 1
            growth = max(1.0, np.abs(motion.return_map).max())
            size = max(1.0, np.abs(motion.sections).max())
            assert np.abs(run.stroboscopic[0] - motion.initial).max() <= 1e-13 * size * growth


def test_the_determinant_of_the_return_map_is_that_of_damping_and_restitution():
    random = np.random.default_rng(5)
    for _ in range(25):
        system, n = random_system(random), int(random.integers(1, 3))
        for motion in vi.periodic_motions(system, n):
            size = max(1.0, np.abs(motion.return_map).max())
            zeta1, zeta2 = system.damping
            rate = zeta1 * system.frequency_ratio + zeta2
            product = system.restitution**2 * math.exp(-2.0 * rate * n * system.drive_period)
            assert abs(motion.determinant - product) <= 1e-12 * size**2


def test_the_law_and_the_start_of_the_drive_play_no_part():
    plain = vi.periodic_motions(paper_system(1.25, 1.0))
    for changes in ({"law": "newton"}, {"law": "energetic"}, {"law": "paper"}, {"phase": 2.0}):
        other = vi.periodic_motions(paper_system(1.25, 1.0, **changes))
        assert [m.admissible for m in other] == [m.admissible for m in plain]
        for mine, theirs in zip(plain, other, strict=True):
            assert np.abs(np.array(mine.state) - theirs.state).max() <= 1e-14


def test_part_of_the_range():
    whole = vi.periodic_motions(paper_system(1.8, 1.0))
    part = vi.periodic_motions(paper_system(1.8, 1.0), within=(0.0, 1.0))
    inside = np.array([motion.state for motion in whole if 0.0 <= motion.state[0] <= 1.0])
    # Newton's method starts from other boxes.
    assert np.array([motion.state for motion in part]) == pytest.approx(inside, abs=1e-14)
    assert part.within == (0.0, 1.0)
    assert not part.bounded
    assert len(whole[1:3]) == 2


@pytest.mark.parametrize(
    ("changes", "arguments", "match"),
    [
        ({"friction": 0.3}, {}, "friction = 0.3 is not allowed.*search_motions or run.refine"),
        ({"drive_frequency": 0.0}, {}, "drive_frequency = 0.0 is not allowed"),
        ({"moment_amplitude": 0.0}, {}, "moment_amplitude = 0.0 is not allowed"),
        ({}, {"n": 0}, "n = 0 is not allowed"),
        ({}, {"n": 1.5}, "n = 1.5 is not allowed"),
        ({}, {"n": True}, "n = True is not allowed"),
        ({}, {"within": (1.0, 0.0)}, "within = .* is not allowed"),
        ({}, {"within": (0.0, math.nan)}, "within = .* is not allowed"),
        ({}, {"within": (0.0, math.inf)}, "within = .* is not allowed"),
        ({}, {"within": 3.0}, "within = 3.0 is not allowed"),
        ({}, {"within": "ab"}, "within = 'ab' is not allowed"),
    ],
)
def test_bad_input(changes, arguments, match):
    with pytest.raises(vi.ParameterError, match=match):
        vi.periodic_motions(paper_system(1.25, 1.0, **changes), **arguments)


def test_bad_system():
    with pytest.raises(vi.ParameterError, match="system = 3 is not allowed"):
        vi.periodic_motions(3)

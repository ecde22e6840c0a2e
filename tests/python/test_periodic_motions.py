"""All period n-1 motions without friction: complete, exact, with both verdicts.

References: tests/data/fixed_points.json; the flights of tests/reference in 200-bit balls, which
share no code with the package; the paper's own (31) with a matrix exponential; values that others
have published.
"""

import json
import math

import numpy as np
import pytest
from flint import arb, arb_mat, ctx
from reference.flight import System as ExactSystem
from scipy.linalg import expm
from scipy.optimize import minimize_scalar

import vibroimpact as vi
from references import SYMBOLS, reference
from vibroimpact.orbits.algebraic import Parameters, conditions
from vibroimpact.orbits.criterion import multipliers
from vibroimpact.orbits.enclosed_flight import flight

ctx.prec = 200
PAPER = {"mass_ratio": 0.6, "frequency_ratio": 2.0, "restitution": 0.8, "gap": 0.5}
SHORT = {name: symbol for symbol, name in SYMBOLS.items()}
# Stated accuracy of fixed_points.json.
STATED = 1e-12


def paper_system(omega, moment, **changes):
    return vi.System(**(PAPER | {"drive_frequency": omega, "moment_amplitude": moment} | changes))


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


def exact_residual(motion):
    """Error of periodicity in 200-bit arithmetic, and the size of the state."""
    system = motion.system
    exact = ExactSystem.parse(
        {SHORT[name]: getattr(system, name) for name in SHORT}, system.contact
    )
    x1, v1, v2, phase = (arb(value) for value in motion.state)
    kappa = x1.cos() if exact.oblique else arb(1)
    x2 = exact.tip(x1) - arb(system.gap)
    mbar, r = arb(system.mass_ratio), arb(system.restitution)
    # (19), (20).
    q = mbar + kappa**2
    w1 = ((mbar - r * kappa**2) * v1 + (1 + r) * kappa * v2) / q
    w2 = ((1 + r) * mbar * kappa * v1 + (kappa**2 - r * mbar) * v2) / q
    time = 2 * motion.m * arb.pi() / arb(system.drive_frequency)
    first, second = exact.bodies()
    end = (*first.state(time, x1, w1, phase), *second.state(time, x2, w2, phase))
    start = (x1, v1, x2, v2)
    off = max(abs(float(a - b)) for a, b in zip(end, start, strict=True))
    return off, max(1.0, *(abs(float(a)) for a in (x1, v1, x2, v2, w1, w2)))


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
        eigenvalues = in_order(entry["paper_eigenvalues"])
        assert np.abs(motion.paper_eigenvalues - eigenvalues).max() <= STATED
        assert motion.paper_stable == (entry["paper_verdict"] == "stable")
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
    ("omega", "moment", "n", "paper", "true"),
    [(1.25, 1.0, 1, 1.88, 0.985), (1.8, 1.0, 1, 1.43, 0.959), (2.75, 1.5, 2, 2.05, 0.979)],
)
def test_the_shown_motions_are_stable_and_the_criterion_denies_it(omega, moment, n, paper, true):
    # Errata E5.
    system = paper_system(omega, moment)
    (motion,) = [m for m in vi.periodic_motions(system, n) if m.admissible and m.stable]
    assert abs(motion.multipliers[0]) == pytest.approx(true, abs=5e-4)
    assert abs(motion.paper_eigenvalues[0]) == pytest.approx(paper, abs=5e-3)
    assert not motion.paper_stable
    run = vi.simulate(system, initial=motion.initial, periods=20 * n)
    assert run.label == f"{n}-1"
    assert np.abs(run.stroboscopic[n - 1 :: n] - motion.initial).max() <= 1e-12


def random_system(random, **changes):
    values = {
        "mass_ratio": 10.0 ** random.uniform(-1.5, 1.0),
        "frequency_ratio": random.uniform(0.2, 3.0),
        "restitution": random.uniform(0.0, 1.0),
        "gap": random.uniform(-0.5, 0.8),
        "drive_frequency": random.uniform(0.3, 3.0),
        "damping": (random.choice([0.0, 0.02, 0.4, 1.0, 1.7]), random.choice([0.0, 0.05, 1.3])),
        "moment_amplitude": random.uniform(-2.0, 2.0),
        "force_amplitude": random.choice([0.0, 0.4, 1.5]),
        "phase": random.uniform(-3.0, 3.0),
        "contact": str(random.choice(["oblique", "oblique", "direct"])),
    }
    return vi.System(**(values | changes))


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
    for _ in range(60):
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
    assert solutions >= 120
    assert admissible >= 20


def test_wide_parameters_are_answered():
    # Every magnitude of a parameter: an answer, each solution in it exact.
    random = np.random.default_rng(8)

    def size():
        return 10.0 ** random.uniform(-4.0, 1.5)

    solutions = 0
    for _ in range(80):
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
    assert solutions >= 200


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


def test_multipliers_agree_with_their_formula_in_numpy_and_with_the_determinant():
    # The compiled core has them from the legs' derivatives, `criterion` from section 7's formula.
    random = np.random.default_rng(5)
    for _ in range(25):
        system, n = random_system(random), int(random.integers(1, 3))
        equations = conditions(Parameters.of([system], n))
        for motion in vi.periodic_motions(system, n):
            state = np.array([motion.state])
            values = multipliers(equations, np.zeros(1, dtype=np.int64), state)[0]
            size = max(1.0, np.abs(motion.return_map).max())
            # Products and not roots: close pairs would be ill-conditioned one by one.
            assert np.abs(np.poly(values) - np.poly(motion.multipliers)).max() <= 1e-11 * size**2
            zeta1, zeta2 = system.damping
            rate = zeta1 * system.frequency_ratio + zeta2
            product = system.restitution**2 * math.exp(-2.0 * rate * n * system.drive_period)
            assert abs(motion.determinant - product) <= 1e-12 * size**2


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
    assert motion.paper_eigenvalues is None
    assert motion.paper_stable is None


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


def exact_flow(w, zeta, load, duration):
    """The flow of x'' + 2 zeta w x' + w^2 x = load cos psi on (x, v, cos psi, sin psi)."""
    generator = arb_mat(
        [[0, 1, 0, 0], [-w * w, -2 * zeta * w, load, 0], [0, 0, 0, -1], [0, 0, 1, 0]]
    )
    flow = (generator * duration).exp()
    return [[flow[i, j] for j in range(4)] for i in range(2)]


def test_flights_are_enclosed_through_every_neighbourhood():
    random = np.random.default_rng(11)
    rows = []
    for k in range(240):
        natural, omega = 10.0 ** random.uniform(-2, 1), 10.0 ** random.uniform(-1, 0.7)
        zeta = random.choice([0, 0, 1e-12, 1e-6, 0.01, 0.5, 1 - 1e-8, 1, 1 + 1e-7, 1.5, 30])
        if k % 6 == 0:
            omega = natural
        elif k % 6 == 1:
            omega = natural * (1.0 + random.choice([1e-15, 1e-12, 1e-8, 1e-3, -1e-5]))
        elif k % 6 == 2:
            omega = natural / random.integers(1, 5)
        elif k % 6 == 3:
            natural = 0.0
        rows.append((natural, zeta, 1.3, omega))
    columns = np.array(rows).T
    for n in (1, 3):
        enclosed = flight(n, *columns)
        for k, row in enumerate(rows):
            natural, zeta, force, omega = (arb(float(value)) for value in row)
            w, load = natural / omega, force / omega**2
            body = exact_flow(w, zeta, load, 2 * n * arb.pi())
            for mine, exact in (
                (enclosed.c11, 1 - body[0][0]),
                (enclosed.a12, body[0][1]),
                (enclosed.a21, body[1][0]),
                (enclosed.c22, 1 - body[1][1]),
                (enclosed.gx.re, body[0][2]),
                (enclosed.gx.im, -body[0][3]),
                (enclosed.gv.re, body[1][2]),
                (enclosed.gv.im, -body[1][3]),
            ):
                lo, hi = arb(float(mine.lo[k])), arb(float(mine.hi[k]))
                # The exact value is itself a ball.
                assert not exact < lo, row
                assert not exact > hi, row
                size = max(1.0, float(load), abs(float(exact)))
                assert mine.hi[k] - mine.lo[k] <= 1e-11 * size, row


@pytest.mark.parametrize(
    ("changes", "arguments", "match"),
    [
        ({"friction": 0.3}, {}, "friction = 0.3 is not allowed.*search_motions or run.refine"),
        ({"drive_frequency": 0.0}, {}, "drive_frequency = 0.0 is not allowed"),
        ({"moment_amplitude": 0.0}, {}, "moment_amplitude = 0.0 is not allowed"),
        ({}, {"n": 0}, "n = 0 is not allowed"),
        ({}, {"n": 1.0}, "n = 1.0 is not allowed"),
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

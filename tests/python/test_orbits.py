"""Periodic motions: kernels, Newton's method, verdicts.

Reference: tests/data/orbits_reference.json (high precision, an independent simulator; made by
tests/reference/generate_orbits.py). The rest is checked against simulations, finite differences and
the determinant identities of docs/theory.md, section 7.
"""

import math
import pickle

import numpy as np
import pytest

import sizes
import vibroimpact as vi
from references import reference, scene_system
from systems import PAPER
from vibroimpact._core import Leg, LegEnd, Regime
from vibroimpact.continuation.newton import solve
from vibroimpact.orbits.problem import OrbitProblem
from vibroimpact.system import SYMBOLS

REFERENCE = reference("orbits_reference.json")


def reference_system(scene):
    return scene_system(scene).replace(contact=scene["contact"], law=scene["law"])


def reference_motion(name):
    scene = REFERENCE[name]
    initial = [float(value) for value in scene["stroboscopic"][0]]
    return vi.periodic_motion(reference_system(scene), initial=initial, periods=scene["m"])


@pytest.fixture(scope="module", params=sorted(REFERENCE))
def known(request):
    return REFERENCE[request.param], reference_motion(request.param)


def test_motion_and_multipliers_are_those_of_the_reference(known):
    scene, motion = known
    assert motion, motion
    assert motion.label == f"{scene['m']}-{scene['n']}"
    assert motion.admissible, motion.why_not
    assert motion.stable == scene["stable"]
    states = np.array(scene["stroboscopic"], dtype=float)
    assert np.abs(motion.sections - states).max() <= 1e-13 * max(1.0, np.abs(states).max())
    multipliers = np.array([complex(float(a), float(b)) for a, b in scene["multipliers"]])
    # Largest observed difference: 6e-14 (the 6-7 motion).
    assert np.abs(motion.multipliers - multipliers).max() <= 5e-13 * max(1.0, abs(multipliers[0]))
    assert motion.determinant == pytest.approx(float(scene["product"]), rel=1e-12, abs=1e-16)


def test_newton_comes_to_rounding(known):
    _, motion = known
    # Relative to the size of the motion: Newton's last step.
    assert motion.error <= 1e-13
    assert motion.residual <= 1e-13 * max(1.0, np.abs(motion.nodes).max())


def test_impacts_are_those_of_the_reference(known):
    scene, motion = known
    events = [event for event in scene["events"] if event["event"] == "impact"]
    if scene["n"] != "inf":
        assert len(motion.impacts) == len(events)
    for impact in motion.impacts:
        event = min(events, key=lambda e: abs(float(e["t"]) - impact["time"]))
        assert impact["time"] == pytest.approx(float(event["t"]), abs=1e-12)
        x1, v1, x2, v2 = (float(value) for value in event["pre"])
        assert impact[["x1", "v1_pre", "x2", "v2_pre"]].tolist() == pytest.approx(
            (x1, v1, x2, v2), abs=1e-12
        )
        assert vi.Regime(impact["regime"]).name.lower() == event["regime"]
        slope = math.cos(x1) if motion.system.contact == "oblique" else 1.0
        assert impact["approach_velocity"] == pytest.approx(v1 * slope - v2, abs=1e-12)


def central(function, at, step):
    columns = []
    for j in range(len(at)):
        shift = np.zeros(len(at))
        shift[j] = step
        columns.append((function(at + shift) - function(at - shift)) / (2.0 * step))
    return np.array(columns).T


def reverses(motion):
    """Whether slip reverses in one of the impacts that stand alone."""
    reversals = (Regime.REVERSAL_APPROACH, Regime.REVERSAL_RESTITUTION)
    return any(leg.regime in reversals for leg in motion.legs)


def test_residual_has_the_derivatives_of_its_differences(known):
    scene, motion = known
    itinerary, system, nodes = motion.itinerary, motion.system, motion.nodes
    numeric = central(
        lambda u: itinerary.residual(system._compiled, u.reshape(-1, 4))[0], nodes.ravel(), 1e-6
    )
    _, exact = itinerary.residual(system._compiled, nodes)
    # Error of the differences: h^2 times third derivatives and rounding over h, 1e-9; where slip
    # reverses in chatter the extrapolation stops at u = 1e-8, which the differences see.
    tolerance = 1e-5 if reverses(motion) and scene["n"] == "inf" else 1e-7
    assert np.abs(exact - numeric).max() <= tolerance * max(1.0, np.abs(exact).max())


@pytest.mark.parametrize("name", sorted(SYMBOLS.values()))
def test_residual_has_the_derivatives_by_every_parameter(known, name):
    _, motion = known
    itinerary, system, nodes = motion.itinerary, motion.system, motion.nodes
    value, step = getattr(system, name), 1e-6
    if name == "friction" and system.contact == "direct":
        return  # its range is the one value 0
    if name == "friction" and value == 0.0:
        return  # legs without friction do not know it

    def at(shift):
        moved = system.replace(**{name: value + shift})
        return itinerary.residual(moved._compiled, nodes)[0]

    signed = ("moment_amplitude", "force_amplitude", "static_moment", "static_force", "gap")
    one_sided = value == 0.0 and name not in signed
    if one_sided:
        numeric = (4.0 * at(step) - at(2.0 * step) - 3.0 * at(0.0)) / (2.0 * step)
    else:
        numeric = (at(step) - at(-step)) / (2.0 * step)
    _, jacobian = itinerary.residual(system._compiled, nodes, [name])
    exact = jacobian[:, -1]
    tolerance = 1e-5 if reverses(motion) and Leg.CHATTER in motion.legs else 1e-7
    assert np.abs(exact - numeric).max() <= tolerance * max(1.0, np.abs(exact).max())


@pytest.mark.parametrize("name", sorted(REFERENCE))
def test_multipliers_agree_with_differences_of_the_simulated_map(name):
    motion = reference_motion(name)
    wall = motion.wall_at_rest
    start = np.array(motion.initial)

    def cycle(state):
        full = np.append(state, (0.0, 0.0)) if wall else state
        run = vi.simulate(motion.system, initial=full, periods=motion.m, keep=0)
        return np.array(run.final_state.state)[: len(state)]

    if abs(start[0]) + abs(start[2]) > 0 and on_contact(motion, start):
        pytest.skip("begins in contact: no neighbouring states on one side")
    matrix = central(cycle, start[:2] if wall else start, 1e-6)
    ordered = sorted(np.linalg.eigvals(matrix), key=lambda z: (-abs(z), -z.imag))
    # Roots of the characteristic polynomial: multiple zeros are ill-conditioned themselves.
    found, expected = np.poly(ordered), np.poly(motion.multipliers)
    assert np.abs(found - expected).max() <= 1e-6 * max(1.0, np.abs(expected).max())


def on_contact(motion, state):
    x1, _, x2, _ = state
    tip = math.sin(x1) if motion.system.contact == "oblique" else x1
    return abs(tip - x2 - motion.system.gap) < 1e-9


def only_impacts(scene):
    """Whether an orbit has impacts and flights alone, and two bodies that move."""
    kinds = {event["event"] for event in scene["events"]}
    return kinds == {"impact"} and len(scene["multipliers"]) == 4


@pytest.mark.parametrize("name", [name for name in REFERENCE if only_impacts(REFERENCE[name])])
def test_every_leg_keeps_the_determinant_identity(name):
    # docs/theory.md, section 7: the flow contracts volumes by exp(-2 (zeta1 omega0 + zeta2) tau), a
    # section measures them by |g'|.
    motion = reference_motion(name)
    system = motion.system
    contraction = 2.0 * (
        system.pendulum_damping * system.frequency_ratio + system.oscillator_damping
    )
    legs = motion.itinerary.transfer(system._compiled, motion.nodes)
    before = motion.itinerary.before_events(system._compiled, motion.nodes)
    count = len(legs)
    for i, leg in enumerate(legs):
        after = (i + 1) % count
        turns = motion.clocks[after] - motion.clocks[i] + (motion.m if after == 0 else 0)
        tau = turns * system.drive_period + motion.nodes[after, 3] - motion.nodes[i, 3]
        slope = (lambda x: math.cos(x)) if system.contact == "oblique" else (lambda x: 1.0)
        start, end = motion.nodes[i], before[i]
        leaving = start[1] * slope(start[0]) - start[2]
        arriving = end[1] * slope(end[0]) - end[3]
        departing = motion.nodes[after][1] * slope(end[0]) - motion.nodes[after][2]
        expected = impact_determinant(system, motion.legs[i], end[0], -departing / arriving)
        expected *= math.exp(-contraction * tau) * leaving / arriving
        assert np.linalg.det(leg) == pytest.approx(expected, rel=1e-12, abs=1e-15)


def impact_determinant(system, leg, x1, ratio):
    """Determinant of d(v1+, v2+)/d(v1-, v2-), docs/theory.md, section 7; ``ratio`` is -u_post/u."""
    if leg.regime in (Regime.FRICTIONLESS, Regime.SLIP):
        return -system.restitution
    if leg.regime in (Regime.STICK_APPROACH, Regime.STICK_RESTITUTION):
        return 0.0
    friction = system.friction * leg.direction * abs(math.sin(x1))
    k, k_after = math.cos(x1) + friction, math.cos(x1) - friction
    a, a_after = (system.mass_ratio + each * math.cos(x1) for each in (k, k_after))
    r = system.restitution
    by_law = {"poisson": r, "newton": r * a / a_after, "energetic": r**2 / ratio}
    return -k_after / k * by_law[system.law]


@pytest.mark.parametrize("friction", [0.0, 0.3])
def test_multipliers_of_random_slipping_motions_have_the_known_product(friction):
    # r^(2n) exp(-2 (zeta1 omega0 + zeta2) 2 m pi/omega), docs/theory.md, section 7.
    random = np.random.default_rng(20040607)
    found = 0
    while found < 12:
        system = vi.System(
            mass_ratio=random.uniform(0.2, 2.0),
            frequency_ratio=random.uniform(0.5, 3.0),
            restitution=random.uniform(0.4, 0.95),
            gap=random.uniform(0.1, 0.8),
            drive_frequency=random.uniform(0.5, 3.0),
            moment_amplitude=random.uniform(0.5, 2.0),
            force_amplitude=random.uniform(0.0, 1.0),
            damping=(random.uniform(0.0, 0.1), random.uniform(0.0, 0.1)),
            friction=friction,
        )
        run = vi.simulate(system, initial=(0.0, 0.3, 0.0, 0.0), periods=1500, keep=100)
        if run.period.m is None or run.period.n in (0, math.inf):
            continue
        motion = run.refine()
        assert motion, (system, motion)
        assert motion.error <= 1e-13
        regimes = {leg.regime for leg in motion.legs if leg.regime is not None}
        if not regimes <= {Regime.FRICTIONLESS, Regime.SLIP} or len(regimes) != 1:
            continue
        found += 1
        decay = system.pendulum_damping * system.frequency_ratio + system.oscillator_damping
        volume = system.restitution ** (2 * motion.n) * math.exp(
            -2.0 * decay * motion.m * system.drive_period
        )
        assert motion.determinant == pytest.approx(volume, rel=1e-12)
        # The eigenvalues carry the rounding of the largest.
        assert np.prod(motion.multipliers) == pytest.approx(volume, rel=1e-9, abs=1e-14)


def test_newton_converges_quadratically():
    motion = reference_motion("9_3_six_seven")
    problem = OrbitProblem(motion.system, motion.itinerary)
    shift = 1e-3 * np.sin(np.arange(motion.nodes.size))
    found, report = solve(problem, motion.nodes.ravel() + shift, np.empty(0))
    assert report.converged
    assert report.order > 1.7
    assert np.abs(found.reshape(-1, 4) - motion.nodes).max() < 1e-12


def test_refine_agrees_with_the_run_it_comes_from():
    run = vi.simulate(PAPER, initial=(0, 0.5, 0, 0), periods=600, keep=100)
    motion = run.refine()
    assert motion.label == run.label == "1-1"
    # What is left of the transient falls by |lambda| = 0.9587 per period.
    assert np.abs(motion.sections[0] - run.stroboscopic[-1]).max() < 1e-9
    again = vi.simulate(PAPER, initial=motion.initial, periods=50, keep=50)
    assert np.abs(again.stroboscopic - motion.sections[0]).max() < 1e-13
    last = again.impacts[-1]
    assert motion.impacts["x1"][0] == pytest.approx(float(last["x1"]), abs=1e-13)
    assert motion.state[3] == pytest.approx(math.remainder(float(last["phase"]), math.tau))


@pytest.mark.parametrize("options", [{"section_phase": 2.0, "periods": 400}, {"time": 1234.5}])
def test_refine_does_not_depend_on_where_a_run_ends(options):
    motion = reference_motion("5b")
    run = vi.simulate(motion.system, initial=(0, 0.5, 0, 0), **options)
    assert np.abs(run.refine().sections - motion.sections).max() < 1e-13


@pytest.mark.parametrize("name", ["7c_0.3", "slide_stick", "9_3_four_five"])
def test_multipliers_do_not_depend_on_the_phase_at_the_start(name):
    # Over a turn the orbit starts in flight, amid chatter and in contact.
    motion = reference_motion(name)
    for phase in np.linspace(0.0, 2.0 * math.pi, 9)[1:-1]:
        system = motion.system.replace(phase=motion.system.phase + phase)
        ahead = phase / system.drive_frequency
        start = motion.trajectory([ahead])[0]
        moved = vi.periodic_motion(system, initial=start, periods=motion.m)
        assert moved, (phase, moved)
        assert moved.admissible, (phase, moved.why_not)
        assert np.abs(moved.multipliers - motion.multipliers).max() < 1e-12


def test_no_motion_is_a_value_that_says_why():
    system = vi.System(
        mass_ratio=0.6,
        frequency_ratio=2,
        restitution=0.8,
        gap=0.5,
        drive_frequency=1.545,
        moment_amplitude=1,
        friction=0.5,
    )
    run = vi.simulate(system, initial=(0, 0.5, 0, 0), periods=600, keep=100)
    nothing = run.refine()
    assert not nothing
    assert isinstance(nothing, vi.NotFound)
    assert "chaotic" in nothing.reason


@pytest.mark.parametrize("contact", ["direct", "oblique"])
def test_rest_against_a_wall_is_a_contact_of_its_own_without_friction(contact):
    system = vi.System(
        mass_ratio=0,
        frequency_ratio=2,
        restitution=0.5,
        gap=0.1,
        drive_frequency=0.5,
        moment_amplitude=1,
        damping=(0.1, 0.1),
        contact=contact,
    )
    motion = vi.simulate(system, initial=(-0.1, 0, 0, 0), periods=400).refine()
    assert motion.legs[-2:] == (Leg.CHATTER, Leg.stick(LegEnd.RELEASE))
    assert motion.admissible, motion.why_not


def test_a_motion_that_newton_does_not_find_is_named_as_the_run_names_it():
    # The bodies stay in contact, so that no event ends a leg.
    system = vi.System(
        mass_ratio=0,
        frequency_ratio=2,
        restitution=0.5,
        gap=-0.3,
        drive_frequency=0.5,
        moment_amplitude=1,
        force_amplitude=0.2,
        damping=(0.1, 0.1),
        contact="direct",
    )
    nothing = vi.simulate(system, initial=(-0.5, 0, 0, 0), periods=400, keep=50).refine()
    assert nothing.reason == "Newton's method does not find the run's 1-0 motion"


def test_search_finds_coexisting_motions_with_their_shares():
    # docs/theory.md, E9: 56 of 60 random starts settle on 4-5, others on 6-7.
    system = reference_system(REFERENCE["9_3_six_seven"])
    search = vi.search_motions(system, starts=60, periods=3000, seed=1)
    assert [motion.label for motion in search.motions] == ["4-5", "6-7"]
    assert search.shares.sum() + sum(search.others.values()) == pytest.approx(1.0)
    assert search.shares[0] > 0.8
    assert search.starts.shape == (60, 4)
    assert np.bincount(search.reached, minlength=2) / 60 == pytest.approx(search.shares)
    same = vi.search_motions(system, starts=search.starts[:5], periods=3000, workers=1)
    assert [m.label for m in same.motions] == [
        search.motions[k].label for k in dict.fromkeys(search.reached[:5])
    ]


def test_a_solution_beyond_its_grazing_is_not_admissible():
    # COCO's impact oscillator: below f1 = 0.1 its impact-free response misses the wall.
    system = vi.System(
        mass_ratio=0,
        frequency_ratio=1,
        pendulum_damping=0.05,
        gap=1,
        restitution=0.8,
        moment_amplitude=0.5,
        drive_frequency=1,
        contact="direct",
    )
    run = vi.simulate(system, initial=(0, 0, 0, 0), periods=800, keep=50)
    branch = vi.follow_motion(
        run.refine(), moment_amplitude=(0.09, 1.0), direction=-1, both=False, virtual=True
    )
    (piece,) = branch.pieces
    separating = [piece.motion(k) for k in range(len(piece.values))]
    separating = [motion for motion in separating if motion.approach_velocity < -1e-6]
    assert separating
    for motion in separating:
        assert not motion.admissible
        assert "u = -" in motion.why_not


@pytest.mark.parametrize("law", ["poisson", "newton", "energetic"])
def test_plastic_impacts_have_derivatives_under_every_law(law):
    # With r = 0 all laws are one; the energetic one takes a root of what vanishes.
    system = vi.System(
        mass_ratio=0.6,
        frequency_ratio=2,
        restitution=0,
        gap=0.1,
        drive_frequency=1.1,
        moment_amplitude=1,
        force_amplitude=-0.3,
        damping=(0.05, 0.05),
        friction=1.2,
        law=law,
    )
    motion = vi.simulate(system, initial=(0, -0.3, 0, 0), periods=400).refine()
    assert motion.label == "1-2"
    assert abs(motion.multipliers[0]) == pytest.approx(0.40106, abs=1e-5)


def test_a_release_is_no_graze():
    # Just after a release g, g' and g'' are rounding, which must not be taken for a maximum.
    system = vi.System(
        mass_ratio=0.6,
        frequency_ratio=2,
        restitution=0.5,
        gap=0.3,
        moment_amplitude=2,
        drive_frequency=0.3,
        damping=(0.05, 0.05),
    )
    for omega in np.linspace(0.25, 0.45, sizes.either(11, 41)):
        run = vi.simulate(
            system.replace(drive_frequency=omega), initial=(0, 0.5, 0, 0), periods=300, keep=100
        )
        if run.period.m is not None:
            motion = run.refine()
            assert motion.admissible, (omega, motion.why_not)
    motion = vi.simulate(system, initial=(0, 0.5, 0, 0), periods=300).refine()
    branch = vi.follow_motion(motion, drive_frequency=(0.28, 0.32), step=0.005, max_step=0.02)
    assert branch.ends == ("bound", "bound")
    assert not branch.of_kind("grazing")


def test_undamped_free_motion_is_not_called_stable():
    # All multipliers lie on the unit circle; rounding must not decide.
    for omega in (0.3, 0.7, 1.25, 2.75, 3.1):
        system = vi.System(
            mass_ratio=0.6,
            frequency_ratio=2,
            restitution=0.8,
            gap=5,
            drive_frequency=omega,
            moment_amplitude=1,
        )
        motion = vi.periodic_motion(system, initial=(0, 0, 0, 0), periods=1)
        assert motion.label == "1-0"
        assert motion.admissible
        assert not motion.stable


def test_motions_can_be_pickled():
    motion = reference_motion("9_3_four_five")
    assert motion.max_gap < 0.0  # fills caches
    copy = pickle.loads(pickle.dumps(motion))
    assert copy.itinerary.legs == motion.itinerary.legs
    assert copy.legs == motion.legs
    assert np.array_equal(copy.nodes, motion.nodes)
    assert np.array_equal(copy.sections, motion.sections)


def test_trajectory_is_that_of_a_simulation(known):
    _, motion = known
    period = motion.system.drive_period
    t = np.linspace(0.0, motion.m * period, 97)[:-1] + 1e-3
    run = vi.simulate(motion.system, initial=motion.initial, periods=motion.m + 1)
    growth = max(1.0, np.abs(motion.return_map).max())
    assert np.abs(motion.trajectory(t) - run.trajectory(t)).max() < 1e-11 * growth
    assert np.abs(motion.trajectory(t + 5 * motion.m * period) - run.trajectory(t)).max() < (
        1e-10 * growth
    )


@pytest.mark.parametrize(
    ("call", "name"),
    [
        (lambda s: vi.periodic_motion(s, initial=(0, 0.5, 0, 0), periods=0), "periods"),
        (lambda s: vi.periodic_motion(s, initial=(0, math.nan, 0, 0), periods=1), "initial"),
        (
            lambda s: vi.periodic_motion(
                s.replace(drive_frequency=0), initial=(0, 0, 0, 0), periods=1
            ),
            "drive_frequency",
        ),
        (lambda s: vi.search_motions(s, starts=0), "starts"),
        (lambda s: vi.search_motions(s, starts=[(0, 0, math.inf, 0)]), "starts"),
        (lambda s: vi.search_motions(s, starts=3, periods=1), "periods"),
        (lambda s: vi.search_motions(s, starts=3, seed=-1), "seed"),
    ],
)
def test_bad_input_is_named(call, name):
    system = reference_system(REFERENCE["5b"])
    with pytest.raises(ValueError, match=name):
        call(system)

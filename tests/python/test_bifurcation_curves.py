"""Curves of bifurcations in two parameters, and the regions of stability that they bound.

They are checked against what does not know of them: closed forms of the oscillator against a wall,
branches at one fixed parameter, the algebraic solutions of the period n-1 motions, simulations.
"""

import math

import numpy as np
import pytest

import sizes
import vibroimpact as vi
from references import reference, scene_system
from systems import PAPER
from vibroimpact.orbits.bifurcation import Bifurcation
from vibroimpact.orbits.border_walk import Arc, OnBound, Walk
from vibroimpact.orbits.borders import CurveSteps
from vibroimpact.orbits.curve import CodimensionTwo
from vibroimpact.orbits.curve_problem import CurveProblem
from vibroimpact.orbits.problem import OrbitProblem
from vibroimpact.orbits.shooting import solve_orbit
from vibroimpact.orbits.verdict import motion_of

REFERENCE = reference("orbits_reference.json")
PLANE = {"drive_frequency": (0.2, 3.0), "moment_amplitude": (0.05, 2.5)}


def reference_motion(name):
    scene = REFERENCE[name]
    initial = [float(value) for value in scene["stroboscopic"][0]]
    system = scene_system(scene).replace(contact=scene["contact"], law=scene["law"])
    return vi.periodic_motion(system, initial=initial, periods=scene["m"])


def settled(system, initial=(0, 0.5, 0, 0)):
    return vi.simulate(system, initial=initial, periods=2000, keep=100).refine()


def first(branch, kind, what=""):
    return next(found for found in branch.of_kind(kind) if what in str(found.test))


# Closed forms: the damped or undamped oscillator against a wall at rest


def wall(**changes):
    fields = {
        "mass_ratio": 0.0,
        "frequency_ratio": 1.0,
        "restitution": 0.8,
        "gap": 1.0,
        "drive_frequency": 2.0,
        "moment_amplitude": 1.0,
        "contact": "direct",
    }
    return vi.System(**(fields | changes))


@pytest.mark.parametrize("damping", [0.02, 0.3])
def test_the_free_response_grazes_where_its_amplitude_is_the_gap(damping):
    # |f1| = gap |omega0^2 - omega^2 + 2 i zeta omega0 omega|
    system = wall(frequency_ratio=1.3, gap=0.7, pendulum_damping=damping, moment_amplitude=0.1)
    free = settled(system, initial=(0, 0, 0, 0))
    assert free.label == "1-0"
    graze = first(vi.follow_motion(free, moment_amplitude=(0.01, 5.0)), "grazing")
    curve = vi.bifurcation_curve(graze, drive_frequency=(0.3, 3.0), moment_amplitude=(0.01, 8.0))
    assert curve.kind == "grazing"
    assert curve.ends == ("bound", "bound")
    omega, f1 = curve.values.T
    exact = 0.7 * np.abs(1.3**2 - omega**2 + 2j * damping * 1.3 * omega)
    np.testing.assert_allclose(f1, exact, rtol=2e-14)
    assert curve.bounds_stability.all()


def critical_amplitude(system, omega, multiplier):
    """Return f1 at which the 1-1 motion has a multiplier 1 or -1.

    With E = exp(-zeta omega0 T), C = cos(omega_d T), S = sin(omega_d T)/omega_d, F = f1 cos psi at
    the impact and V the velocity before it, the derivative of the return map has

        det M = r^2 E^2,    tr M = -2 r E C + E S (1 + r) (F - omega0^2 gap)/V,

    and 1 -+ tr M + det M = 0 gives (F - omega0^2 gap)/V. The conditions of periodicity, linear in
    the free part (y, w) = (kappa, lambda) V of the motion just after the impact, give V, then f1.
    """
    w0, zeta, r, gap = (
        system.frequency_ratio,
        system.pendulum_damping,
        system.restitution,
        system.gap,
    )
    period = math.tau / omega
    wd = w0 * math.sqrt(1 - zeta**2)
    e = math.exp(-zeta * w0 * period)
    c, s = math.cos(wd * period), math.sin(wd * period) / wd
    trace = multiplier * (1 + (r * e) ** 2)
    slope = (trace + 2 * r * e * c) / (e * s * (1 + r))
    free = (1 - e * (c + zeta * w0 * s)) / (e * s)  # w/y, from y(T) = y(0)
    kappa = (1 + r) / (-(w0**2) * e * s + (e * (c - zeta * w0 * s) - 1) * free)
    lam = free * kappa
    d = w0**2 - omega**2 + 2j * zeta * w0 * omega
    per_velocity = -kappa + 1j * (r + lam) / omega
    velocity = omega**2 * gap / ((d * per_velocity).real - slope)
    return abs(d * (gap + velocity * per_velocity)), velocity


@pytest.mark.parametrize("damping", [0.0, 0.05])
@pytest.mark.parametrize(
    ("kind", "multiplier", "omega", "share", "limits"),
    [
        ("saddle_node", 1, 1.5, 1.5, (1.1, 1.9)),
        ("period_doubling", -1, 1.15, 0.8, (1.05, 1.2)),
        ("period_doubling", -1, 2.3, 0.9, (2.1, 2.5)),
    ],
)
def test_curves_of_the_oscillator_against_a_wall_have_their_closed_form(
    damping, kind, multiplier, omega, share, limits
):
    system = wall(pendulum_damping=damping, drive_frequency=omega)
    start = share * critical_amplitude(system, omega, multiplier)[0]
    solutions = vi.periodic_motions(system.replace(moment_amplitude=start), n=1).motions
    motion = next(solution for solution in solutions if solution.admissible)
    branch = vi.follow_motion(motion, moment_amplitude=(0.01, 30.0))
    curve = vi.bifurcation_curve(
        first(branch, kind), drive_frequency=limits, moment_amplitude=(0.001, 100.0)
    )
    assert curve.ends == ("bound", "bound")
    assert sorted(curve.values[[0, -1], 0]) == list(limits)
    for at, f1 in curve.values:
        exact, velocity = critical_amplitude(system, at, multiplier)
        assert velocity > 0.0
        assert f1 == pytest.approx(exact, rel=1e-12)
    # A double multiplier moves by the square root of rounding.
    assert np.abs(curve.multipliers - multiplier).min(axis=1).max() < 1e-6


# Against branches at one fixed parameter

# A motion of the reference, words of the border, drive frequencies between which it is met.
SEEDS = {
    "saddle_node": ("5b", "", (1.55, 2.5)),
    "period_doubling": ("5b", "", (1.55, 1.81)),
    "neimark_sacker": ("5b", "", (1.79, 1.82)),
    "grazing": ("6b", "u, leg", (1.0, 1.11)),
    "regime_border P_f": ("slip_reversal_approach", "P* = P_f", (1.91, 1.98)),
    "regime_border restitution": ("slip", "(1 + r)", (1.0, 1.065)),
    "regime_border rest": ("slip", "x1' = 0 before", (1.0, 1.065)),
    "regime_border side": ("9_3_one_one", "sin x1 = 0", (1.52, 1.58)),
    "regime_border cone": ("newton_stick_approach", "|cos x1|", (2.8, 2.9)),
    "contact_border": ("unstable_chatter_spiral", "", (1.185, 1.23)),
    "chatter_onset": ("7c_0.45", "", (0.449, 0.49)),
}


def distance_to_branch(curve, k):
    """Return how far a point is from its bifurcation on the branch at its second parameter."""
    (value, second), nodes = curve.values[k], curve.nodes[k]
    for off in (3e-4, -3e-4):
        beside = curve.system.replace(drive_frequency=value + off, moment_amplitude=second)
        other = solve_orbit(beside, curve.itinerary, nodes.copy())
        if not other:
            continue  # beyond a saddle-node
        branch = vi.follow_motion(
            other,
            drive_frequency=(value - 1e-3, value + 1e-3),
            virtual=True,
            step=1e-3,
            max_step=0.02,
        )
        found = [x.value for x in branch.of_kind(curve.kind)]
        return min(abs(x - value) for x in found)
    raise AssertionError("no motion beside the point")


@pytest.mark.parametrize("seed", SEEDS)
def test_points_of_a_curve_are_the_bifurcations_of_branches(seed):
    name, what, between = SEEDS[seed]
    kind = seed.split()[0]
    motion = reference_motion(name)
    branch = vi.follow_motion(motion, drive_frequency=between, max_points=200)
    start = first(branch, kind, what)
    f1 = motion.system.moment_amplitude
    plane = {
        "drive_frequency": (0.9 * start.value, 1.1 * start.value),
        "moment_amplitude": (0.97 * f1, 1.03 * f1),
    }
    curve = vi.bifurcation_curve(start, max_points=sizes.either(3, 20), **plane)
    assert curve.kind == kind
    # The equations end where chatter does: how far a curve along this edge goes is up to rounding.
    assert len(curve.values) >= (2 if kind == "chatter_onset" else 5)
    at_start = np.abs(curve.values - [start.value, f1]).max(axis=1).min()
    assert at_start < 1e-9
    places = (len(curve.values) // 4, (3 * len(curve.values)) // 4)
    for k in sizes.either(places[1:], places):
        assert distance_to_branch(curve, k) < 1e-9


@pytest.mark.parametrize("name", sorted(REFERENCE))
def test_borders_depend_on_the_unknowns_that_their_gradient_takes(name):
    motion = reference_motion(name)
    problem = OrbitProblem(motion.system, motion.itinerary)
    u, p = motion.nodes.ravel(), np.empty(0)
    before = problem.border_tests(u, p)
    touched = {test: set(problem.unknowns_of(test, len(u))) for test in before}
    for j in range(len(u)):
        shifted = u.copy()
        shifted[j] += 1e-7
        after = problem.border_tests(shifted, p)
        for test, value in before.items():
            if j not in touched[test]:
                assert after[test] == value, (test, j)


def test_the_algebraic_solutions_know_the_points_of_a_curve():
    # A 1-1 motion has the multiplier -1 there; two come together at a saddle-node.
    branch = vi.follow_motion(
        settled(PAPER.replace(drive_frequency=1.8)), drive_frequency=(1.5, 2.5)
    )
    doubling = vi.bifurcation_curve(branch.of_kind("period_doubling")[0], **PLANE)
    system = doubling.system
    for omega, f1 in doubling.values[5:-5:40]:
        at = system.replace(drive_frequency=omega, moment_amplitude=f1)
        off = [
            np.abs(solution.multipliers + 1.0).min()
            for solution in vi.periodic_motions(at, n=1).motions
        ]
        assert min(off) < 1e-9
    turn = next(found for found in branch.of_kind("saddle_node") if found.value > 2.29)
    fold = vi.bifurcation_curve(turn, **PLANE)
    k = int(np.argmin(np.abs(fold.values[:, 1] - 1.5)))
    counts = []
    for off in (-1e-7, 1e-7):
        at = system.replace(
            drive_frequency=fold.values[k, 0] + off, moment_amplitude=fold.values[k, 1]
        )
        counts.append(len(vi.periodic_motions(at, n=1).motions))
    assert abs(counts[0] - counts[1]) == 2


# Points of codimension two


def test_a_neimark_sacker_curve_passes_its_strong_resonance():
    motion = settled(PAPER.replace(drive_frequency=2.75, moment_amplitude=1.5))
    birth = vi.follow_motion(motion, drive_frequency=(2.6, 3.0)).of_kind("neimark_sacker")[0]
    curve = vi.bifurcation_curve(birth, drive_frequency=(2.4, 3.0), moment_amplitude=(0.15, 2.0))
    (point,) = curve.points
    assert point.kind == "resonance_1_4"
    critical = point.motion.multipliers[:2]
    np.testing.assert_allclose(np.sort_complex(critical), [-1j, 1j], atol=1e-9)
    assert curve.bounds_stability.all()


def test_curves_cross_where_two_multipliers_are_critical():
    branch = vi.follow_motion(
        settled(PAPER.replace(drive_frequency=1.8)), drive_frequency=(1.7, 2.5)
    )
    turn = next(found for found in branch.of_kind("saddle_node") if found.value > 2.29)
    fold = vi.bifurcation_curve(turn, **PLANE)
    kinds = [point.kind for point in fold.points]
    assert sorted(kinds) == ["cusp", "period_doubling"]
    flip = fold.points[kinds.index("period_doubling")]
    for target in (1.0, -1.0):
        assert np.abs(flip.motion.multipliers - target).min() < 1e-6
    # The fold bounds stability on the side of the cusp, the other curve goes on from there.
    side = fold.bounds_stability
    assert np.count_nonzero(np.diff(side.astype(int))) == 1
    change = fold.values[np.flatnonzero(np.diff(side.astype(int)))[0]]
    assert np.abs(change - flip.values).max() < 0.1
    other = vi.bifurcation_curve(flip, **PLANE)
    assert other.kind == "period_doubling"
    assert np.abs(other.values - flip.values).max(axis=1).min() < 1e-9


def test_a_grazing_goes_on_beyond_another_one_with_one_impact_more():
    motion = reference_motion("6b")
    graze = first(vi.follow_motion(motion, drive_frequency=(1.016, 1.2)), "grazing")
    curve = vi.bifurcation_curve(graze, **PLANE)
    corner = next(point for point in curve.points if point.kind == "grazing")
    assert "grazing" in curve.ends
    beyond = corner.goes_on
    assert len(beyond.motion.legs) == len(curve.itinerary.legs) + 1
    assert len(beyond.motion.impacts) == len(beyond.motion.legs)
    assert abs(beyond.motion.impacts["approach_velocity"]).min() < 1e-12
    onward = vi.bifurcation_curve(beyond, max_points=sizes.either(20, 1000), **PLANE)
    # It begins there: on the other side the new impact would have u < 0.
    assert "start" in onward.ends
    away = np.abs(onward.values - corner.values).max(axis=1)
    assert away[[0, -1]].min() < 1e-12
    assert away.max() > 0.05
    middle = len(onward.values) // 2
    assert distance_to_branch(onward, middle) < 1e-9
    borders = onward.problem.border_tests(onward.nodes[middle].ravel(), onward.values[middle])
    assert min(value for test, value in borders.items() if test != onward.test) > 0.0
    assert abs(borders[onward.test]) < 1e-12
    # Points of codimension two of smooth bifurcations do not go on: multipliers jump at borders.
    assert all(point.goes_on is None for point in curve.points if point.kind != "grazing")


# Regions of stability


@pytest.fixture(scope="module")
def island():
    """The 1-1 motion of the paper's Fig. 5(a)."""
    motion = settled(PAPER.replace(drive_frequency=1.25))
    return vi.stability_region(motion, drive_frequency=(1.01, 3.0), moment_amplitude=(0.05, 2.5))


def test_a_border_closes_and_crosses_where_the_branch_loses_its_stability(island):
    assert island.closed, island.why_not
    assert {arc.kind for arc in island.arcs} == {
        "neimark_sacker",
        "period_doubling",
        "saddle_node",
    }
    assert all(arc.bounds_stability[1:-1].all() for arc in island.arcs)
    branch = vi.follow_motion(island.motion, drive_frequency=(1.15, 1.52))
    ends = [branch.of_kind("neimark_sacker")[0].value, branch.of_kind("period_doubling")[0].value]
    crossings = island.crossings(moment_amplitude=1.0)
    assert [crossing.kind for crossing in crossings] == ["neimark_sacker", "period_doubling"]
    np.testing.assert_allclose([crossing.value for crossing in crossings], ends, atol=1e-10)


def test_inside_a_border_there_is_one_stable_motion_and_outside_none(island):
    grid = np.array([(w, f) for w in np.linspace(1.05, 1.55, 9) for f in (0.3, 0.9, 1.6, 2.3)])
    inside = island.sheets(grid)
    assert set(inside) == {0, 1}
    # Points nearer to the border than its polygon is to it are left out.
    near = np.array([np.hypot(*(island.border - point).T).min() for point in grid])
    away = near > 0.01
    assert away.sum() > 25
    for (w, f), sheets in zip(grid[away], inside[away], strict=True):
        solutions = vi.periodic_motions(
            PAPER.replace(drive_frequency=w, moment_amplitude=f), n=1, within=(-1.5, 0.35)
        ).motions
        stable = [one for one in solutions if one.admissible and one.stable]
        assert (len(stable) > 0) == bool(sheets), (w, f, stable)


def test_a_region_round_a_cusp_lies_over_itself():
    motion = settled(PAPER.replace(drive_frequency=2.1))
    region = vi.stability_region(motion, drive_frequency=(2.05, 3.0), moment_amplitude=(0.2, 2.0))
    assert region.closed, region.why_not
    assert "cusp" in [point.kind for arc in region.arcs for point in arc.points]
    # Between the period doubling at 2.28729 and the saddle-node at 2.29791.
    between = PAPER.replace(drive_frequency=2.2926)
    stable = [
        one for one in vi.periodic_motions(between, n=1).motions if one.admissible and one.stable
    ]
    assert len(stable) == 2
    assert region.sheets([[2.2926, 1.0], [2.2, 1.0], [2.4, 1.0], [2.7, 1.0]]).tolist() == [
        2,
        1,
        1,
        0,
    ]


@pytest.fixture(scope="module")
def of_two_one():
    """The 2-1 motion between a curve of Neimark-Sacker points and one of saddle-nodes."""
    return settled(PAPER.replace(drive_frequency=2.75))


# The saddle-nodes meet the bound of the frequency at one value of the amplitude each.
@pytest.mark.parametrize("bound", [2.92, 2.96, 3.0, 3.02, 3.03])
def test_a_border_turns_inwards_where_a_curve_begins_on_a_bound(of_two_one, bound):
    region = vi.stability_region(
        of_two_one, drive_frequency=(2.6, bound), moment_amplitude=(0.2, 1.5), max_points=150
    )
    assert region.closed, region.why_not
    assert sorted(arc.kind for arc in region.arcs) == ["neimark_sacker", "saddle_node"]
    assert all(np.ptp(arc.values, axis=0).max() > 0.1 for arc in region.arcs)
    # The motion goes on above the saddle-nodes only.
    fold = of_two_one.follow(moment_amplitude=(0.2, 1.2)).of_kind("saddle_node")[0].value
    found = {at.kind: at.value for at in region.crossings(drive_frequency=2.75)}
    assert found["saddle_node"] == pytest.approx(fold, abs=1e-10)
    assert region.sheets([[2.75, fold + 0.01], [2.75, fold - 0.01]]).tolist() == [1, 0]


class TurningOnBounds(Walk):
    """Turns round at the saddle-nodes on a bound, as if their curve led out of the ranges."""

    def _next(self, place):
        if isinstance(place, Bifurcation) and place.kind == "saddle_node":
            motion = place.motion
            p = np.array([motion.system.drive_frequency, motion.system.moment_amplitude])
            index = int(place.parameter == "drive_frequency")
            place = OnBound(motion.itinerary, motion.nodes.ravel(), p, index)
            return Arc(p[None], None, None, np.empty((0, 0))), place
        return super()._next(place)


class TurningOnCurves(Walk):
    """Turns round where its first curve ends on a bound."""

    def _next(self, place):
        if isinstance(place, OnBound):
            kind = next(arc.curve.kind for arc in self.arcs if arc.curve is not None)
            system = self.motion.system.replace(**dict(zip(self.names, place.p, strict=True)))
            motion = motion_of(system, place.itinerary, place.u.reshape(-1, 4), whole=True)
            place = CodimensionTwo(
                kind=kind, values=place.p, motion=motion, test=kind, test_value=0.0
            )
            return Arc(place.values[None], None, None, np.empty((0, 0))), place
        return super()._next(place)


@pytest.mark.parametrize(
    ("turning", "way"),
    [(TurningOnBounds, "the bound"), (TurningOnCurves, "its own neimark_sacker curve")],
)
def test_a_border_that_comes_back_along_itself_is_not_closed(of_two_one, turning, way):
    plane = ("drive_frequency", "moment_amplitude"), ((2.6, 3.0), (0.5, 1.5))
    walk = turning(of_two_one, *plane, CurveSteps.checked(0.01, 0.05, 150))
    assert walk.round().count(f"the border comes back along {way}") == 2


def test_a_region_without_a_border_is_the_whole_plane():
    motion = settled(PAPER.replace(drive_frequency=1.3))
    region = vi.stability_region(motion, drive_frequency=(1.28, 1.32), moment_amplitude=(0.9, 1.1))
    assert region.closed
    assert region.arcs == ()
    assert region.sheets([[1.3, 1.0], [1.2, 1.0]]).tolist() == [1, 0]


# Input


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda x: vi.bifurcation_curve(x, drive_frequency=(1, 3)), "exactly two parameters"),
        (lambda x: vi.bifurcation_curve(x.motion, **PLANE), "bifurcation"),
        (
            lambda x: vi.bifurcation_curve(
                x, drive_frequency=(math.nan, 3), moment_amplitude=(0, 2)
            ),
            "drive_frequency",
        ),
        (
            lambda x: vi.bifurcation_curve(x, drive_frequency=(2.5, 3), moment_amplitude=(0, 2)),
            "drive_frequency",
        ),
        (lambda x: vi.bifurcation_curve(x, step=-1.0, **PLANE), "step"),
        (lambda x: vi.bifurcation_curve(x, max_points=1, **PLANE), "max_points"),
        (lambda x: vi.stability_region(x, **PLANE), "motion"),
    ],
)
def test_bad_input_is_named(call, message):
    motion = settled(PAPER.replace(drive_frequency=1.8))
    branch = vi.follow_motion(motion, drive_frequency=(1.79, 1.82), max_points=40)
    with pytest.raises(vi.ParameterError, match=message):
        call(branch.of_kind("neimark_sacker")[0])


def test_an_unstable_motion_has_no_region_of_stability():
    motions = vi.periodic_motions(PAPER.replace(drive_frequency=1.8), n=1).motions
    unstable = next(one for one in motions if one.admissible and not one.stable)
    with pytest.raises(vi.ParameterError, match="stable"):
        vi.stability_region(unstable, **PLANE)


def test_a_neutral_saddle_is_no_curve_of_bifurcations():
    motion = settled(PAPER.replace(drive_frequency=2.56))
    branch = vi.follow_motion(motion, drive_frequency=(2.53, 2.6))
    with pytest.raises(vi.ParameterError, match="neutral_saddle"):
        vi.bifurcation_curve(branch.of_kind("neutral_saddle")[0], **PLANE)


def test_problem_of_a_curve_gives_back_its_points(island):
    for arc in island.arcs:
        problem = arc.problem
        assert isinstance(problem, CurveProblem)
        for k in (0, len(arc.values) // 2):
            value, _ = problem.residual(arc.nodes[k].ravel(), arc.values[k])
            assert np.abs(value).max() < 1e-13

"""Special points along branches whose places are known in closed form."""

import math
from fractions import Fraction

import numpy as np
import pytest

import vibroimpact as vi
from equations import LOCATED, Equations, henon_cycle, kinds, logistic_cycle, settle, straight
from vibroimpact.continuation.branching import refine_branch_point
from vibroimpact.continuation.follow import follow, solve, switch
from vibroimpact.continuation.map_bifurcations import (
    neimark_sacker,
    neimark_sacker_kind,
    period_doubling,
)
from vibroimpact.continuation.names import PathEnd

# Tests of the problem


def test_events_are_located_and_ordered_within_one_step():
    # A test is named by anything hashable.
    names = {("b", 2): 0.523, ("b", 1): 0.531, ("a", 0): 0.5315, ("c", 0): 0.48}
    problem = straight(lambda u, p, j: {name: math.expm1(p[0] - at) for name, at in names.items()})
    path = follow(problem, [0.25], 0.5, bounds=(0, 1), step=0.1, classify=lambda name, *_: name[0])
    assert [point.test for point in path.special] == [("b", 2), ("b", 1), ("a", 0)]
    assert kinds(path) == ["b", "b", "a"]
    for point in path.special:
        assert point.p[0] == pytest.approx(names[point.test], abs=1e-15)
        assert point.bracket[0] <= point.arclength <= point.bracket[1]
    # all three lie between the same two points
    p = path.p[:, 0]
    assert len({int(np.searchsorted(p, point.p[0])) for point in path.special}) == 1


def test_an_event_next_to_the_start_is_found_and_one_at_the_start_is_not():
    names = {"at": 0.5 + 1e-12, "next": 0.5 + 1e-6}
    problem = straight(lambda u, p, j: {name: p[0] - at for name, at in names.items()})
    for direction, expected in ((1, ["next"]), (-1, [])):
        path = follow(problem, [0.25], 0.5, direction=direction, bounds=(0, 1))
        assert kinds(path) == expected


def test_a_branch_stops_at_the_first_event_of_a_kind():
    problem = straight(
        lambda u, p, j: {
            ("graze", 1): 0.72 - p[0],
            ("graze", 2): 0.7 - p[0],
            ("other", 0): 0.69 - p[0],
        }
    )
    path = follow(
        problem,
        [0.25],
        0.5,
        bounds=(0, 1),
        stop_at={"graze"},
        classify=lambda name, *_: name[0],
    )
    assert path.end is PathEnd.STOPPED
    assert path.stop.test == ("graze", 2)
    assert kinds(path) == ["other", "graze"]
    assert path.points[-1].p[0] == pytest.approx(0.7, abs=1e-15)


def test_tests_of_any_size_are_located_to_rounding():
    def tests(u, p, jacobian):
        return {
            "large": 1e12 * math.sinh(30 * (p[0] - 0.61)),
            "small": 1e-12 * math.atan(1e3 * (p[0] - 0.62)),
            "root": math.copysign(math.sqrt(abs(p[0] - 0.63)), p[0] - 0.63),
        }

    path = follow(straight(tests), [0.25], 0.5, bounds=(0, 1))
    assert kinds(path) == ["large", "small", "root"]
    for point, at in zip(path.special, (0.61, 0.62, 0.63), strict=True):
        assert point.p[0] == pytest.approx(at, abs=1e-15)
        assert point.continuous


def test_a_jump_across_zero_is_told_from_a_zero():
    problem = straight(lambda u, p, j: {"jump": 1.0 if p[0] < 0.7 else -2.0})
    (point,) = follow(problem, [0.25], 0.5, bounds=(0, 1)).special
    assert not point.continuous
    assert point.p[0] == pytest.approx(0.7, abs=1e-14)


def test_a_jump_with_a_zero_in_it_is_a_jump():
    problem = straight(lambda u, p, j: {"jump": float(np.sign(0.75 - p[0]))})
    (point,) = follow(problem, [0.25], 0.5, bounds=(0, 1), step=0.07, max_step=0.07).special
    assert not point.continuous
    assert point.p[0] == pytest.approx(0.75, abs=1e-14)


def test_an_event_on_an_accepted_point_is_found_once():
    problem = straight(lambda u, p, j: {"end": p[0] - 1.0, "other": 1.0 - p[0]})
    path = follow(problem, [0.25], 0.5, bounds=(0, 1))
    assert sorted(kinds(path)) == ["end", "other"]
    assert [point.p[0] for point in path.special] == [1.0, 1.0]


def test_a_test_that_stays_zero_is_located_where_it_becomes_zero():
    # As the length of a slide does where chatter brings the tip to rest.
    problem = Equations(
        lambda u, p: ([u[0] - p], [[1.0, -1.0]]), lambda u, p, j: {"length": max(0.0, 0.3 - p[0])}
    )
    for step in (0.01, 0.02, 0.07):
        path = follow(problem, [0.0], 0.0, bounds=(0, 1), step=step, stop_at={"length"})
        assert (path.end, path.stop.test) == ("stopped", "length")
        assert path.special[-1].p[0] == pytest.approx(0.3, abs=1e-14)


def test_a_missing_test_is_not_compared():
    def tests(u, p, jacobian):
        sign = 1.0 if p[0] < 0.7 else -1.0
        shared = {"nan": sign * (1.0 if abs(p[0] - 0.7) > 0.05 else math.nan)}
        return shared if abs(p[0] - 0.7) < 0.05 else {**shared, "absent": sign}

    path = follow(straight(tests), [0.25], 0.5, bounds=(0, 1), max_step=0.01)
    assert path.end == "bound"
    assert kinds(path) == []


def test_a_located_point_can_be_classified():
    problem = straight(lambda u, p, j: {"t": p[0] - 0.7})

    def classify(name, u, p, jacobian):
        assert jacobian.tolist() == [[1.0, -0.5]]
        return f"{name} at {p[0]:.1f}"

    path = follow(problem, [0.25], 0.5, bounds=(0, 1), classify=classify, stop_at=["t at 0.7"])
    assert (path.end, path.stop.test) == ("stopped", "t")
    assert kinds(path) == ["t at 0.7"]


def test_a_test_that_passes_infinity_where_a_path_stops_is_compared_before():
    # As a multiplier does at a graze: at both ends of a step across 0.65 and 0.7 it is negative.
    names = {"graze": lambda p: 0.7 - p, "doubling": lambda p: (p - 0.65) / (0.7 - p)}
    problem = straight(lambda u, p, j: {name: of(p[0]) for name, of in names.items()})
    for step in (0.01, 0.03, 0.1, 0.2):
        path = follow(
            problem, [0.25], 0.5, bounds=(0, 1), step=step, max_step=step, stop_at={"graze"}
        )
        zeros = {point.kind: point.p[0] for point in path.special if point.continuous}
        assert zeros == pytest.approx({"doubling": 0.65, "graze": 0.7}, abs=1e-14)


# Branch points


def bent_pitchfork(miss=0.0):
    """x^3 - p x = miss, in coordinates that turn and stretch, beside a second equation."""

    def residual(u, p):
        x, y = u[0] + 0.3 * np.sin(u[1] + p), u[1] - 0.5 * p**2
        cosine = 0.3 * np.cos(u[1] + p)
        dx = np.array([1.0, cosine, cosine])
        value = x**3 - p * x - miss
        slope = (3 * x**2 - p) * dx + [0.0, 0.0, -x]
        return [value + y, y], [slope + np.array([0.0, 1.0, -p]), [0.0, 1.0, -p]]

    return Equations(residual)


@pytest.mark.parametrize("seed", range(40))
def test_a_branch_point_is_passed_with_steps_of_any_size_from_anywhere(seed):
    rng = np.random.default_rng(seed)
    start, step = -(10 ** rng.uniform(-5, 0)), 10 ** rng.uniform(-2.7, 0.5)
    problem = bent_pitchfork()
    u, report = solve(problem, [-0.3 * math.sin(start), 0.0], start)
    assert report.converged
    path = follow(problem, u, start, bounds=(-1, 0.5), step=min(step, 0.1), max_step=step)
    assert path.end == "bound"
    (point,) = path.special
    assert point.kind == "branch_point"
    np.testing.assert_allclose(point.z, 0.0, atol=1e-12)
    # On the same branch: x = 0.
    last = path.points[-1]
    assert last.u[0] + 0.3 * math.sin(last.u[1] + 0.5) == pytest.approx(0, abs=1e-12)
    # The other one has x^2 = p: it leaves at right angles to p.
    assert abs(point.other[2]) < 1e-8 * np.linalg.norm(point.other)


@pytest.mark.parametrize("noise", [0.0, 1e-10, -1e-10, 1e-8, -1e-8, 1e-7, -1e-7])
@pytest.mark.parametrize("step", [1e-6, 1e-3, 0.05])
def test_the_extremum_at_a_pitchfork_is_no_fold_where_a_closed_branch_begins(noise, step):
    # x (x^2 + p^2 - 1) = 0: a circle, which the line x = 0 crosses at p = -1 and p = 1.
    ring = Equations(
        lambda u, p: (
            [u[0] * (u[0] ** 2 + p**2 - 1)],
            [[3 * u[0] ** 2 + p**2 - 1, 2 * u[0] * p]],
        )
    )
    for start in (-1.0, 1.0):
        for way in (1, -1):
            path = follow(
                ring,
                [0.0],
                start,
                bounds=(-2, 2),
                tangent=[1.0, noise],
                direction=way,
                step=step,
                max_step=0.1,
            )
            # The directions of branches are good to 1e-9, so that dp/ds begins with such a noise.
            assert (path.end, kinds(path)) == ("closed", ["branch_point"])
            assert path.special[0].p[0] == pytest.approx(-start, abs=1e-12)


@pytest.mark.parametrize("miss", [1e-9, 1e-6, 1e-3])
@pytest.mark.parametrize("step", [0.005, 0.03, 1.0])
def test_a_pitchfork_that_is_missed_is_followed_round_its_bend(miss, step):
    problem = bent_pitchfork(miss)
    u, _ = solve(problem, [0.3 * math.sin(1.0) + miss, 0.5], -1.0)
    path = follow(problem, u, -1.0, bounds=(-1, 1), step=min(step, 0.1), max_step=step)
    assert (path.end, kinds(path)) == ("bound", [])
    (x, y), p = path.u[-1], 1.0
    assert x + 0.3 * math.sin(y + p) == pytest.approx(1.0, abs=2 * miss)
    # The other two solutions meet in a fold at p = 3 (miss/2)^(2/3).
    u, _ = solve(problem, [-1.0 - 0.3 * math.sin(1.5), 0.5], 1.0)
    path = follow(problem, u, 1.0, direction=-1, bounds=(-1, 1), step=min(step, 0.1), max_step=step)
    assert (path.end, kinds(path)) == ("bound", ["fold"])
    assert path.special[0].p[0] == pytest.approx(3 * (miss / 2) ** (2 / 3), rel=1e-6)


def test_a_pitchfork_is_found_on_either_branch_and_switched_at():
    pitchfork = Equations(lambda x, p: ([p * x[0] - x[0] ** 3], [[p - 3 * x[0] ** 2, x[0]]]))
    trivial = follow(pitchfork, [0.0], -1.0, bounds=(-1, 1))
    assert kinds(trivial) == ["branch_point"]
    point = trivial.special[0]
    np.testing.assert_allclose(point.z, 0.0, atol=1e-15)
    tangent = switch(pitchfork, point)
    for direction in (1, -1):
        bent = follow(
            pitchfork, point.u, point.p, tangent=tangent, direction=direction, bounds=(-1, 1)
        )
        assert bent.end == "bound"
        assert bent.p[-1, 0] == 1.0
        np.testing.assert_allclose(bent.u[:, 0] ** 2, bent.p[:, 0], rtol=0, atol=1e-14)
    assert np.sign(bent.u[-1, 0]) == -np.sign(tangent[0])
    # Through the point along the parabola dp/ds changes sign, too: no fold is reported.
    parabola = follow(pitchfork, [1.0], 1.0, direction=-1, bounds=(-1, 1))
    assert kinds(parabola) == ["branch_point"]
    np.testing.assert_allclose(parabola.special[0].z, 0.0, atol=1e-12)


def test_a_transcritical_crossing_of_curved_branches_is_located_to_rounding():
    # Branches u = p^2 and u = exp(-p) in a rotated second unknown; p^2 = exp(-p) at p = 2 W(1/2).
    def residual(u, p):
        x, y = u
        a, b = x + y - p**2, x + y - math.exp(-p)
        return [a * b, x - y - math.sin(p)], [
            [a + b, a + b, -2 * p * b + math.exp(-p) * a],
            [1.0, -1.0, -math.cos(p)],
        ]

    problem = Equations(residual)
    crossing = 0.703_467_422_498_391_65
    x, y = (0.04 + math.sin(0.2)) / 2, (0.04 - math.sin(0.2)) / 2
    path = follow(problem, [x, y], 0.2, bounds=(0, 1))
    assert kinds(path) == ["branch_point"]
    point = path.special[0]
    assert point.p[0] == pytest.approx(crossing, abs=LOCATED)
    assert sum(point.u) == pytest.approx(crossing**2, abs=LOCATED)
    assert sum(path.u[-1]) == pytest.approx(1.0, abs=1e-14)
    assert point.tangent[2] > 0.0
    assert point.tangent[:2].sum() / point.tangent[2] == pytest.approx(2 * crossing, abs=1e-9)
    last = path.points[-1]
    (backward,) = follow(problem, last.u, last.p, direction=-1, bounds=(0, 1)).special
    np.testing.assert_allclose(backward.tangent, -point.tangent, rtol=0, atol=1e-8)
    tangent = switch(problem, point)
    assert (tangent[0] + tangent[1]) / tangent[2] == pytest.approx(-(crossing**2), abs=1e-8)
    other = follow(problem, point.u, point.p, tangent=tangent * np.sign(tangent[2]), bounds=(0, 1))
    assert other.end == "bound"
    np.testing.assert_allclose(other.u.sum(axis=1), np.exp(-other.p[:, 0]), rtol=0, atol=1e-12)


def test_branches_that_miss_each_other_have_no_branch_point():
    # u (u - p) = 1e-6: two hyperbolas.
    apart = Equations(lambda u, p: ([u[0] * (u[0] - p) - 1e-6], [[2 * u[0] - p, -u[0]]]))
    path = follow(apart, [1e-6], -1.0, bounds=(-1, 1))
    assert path.end == "bound"
    assert kinds(path) == []
    assert path.u[-1, 0] == pytest.approx(1.0, abs=1e-5)
    # mu says by how much they miss each other, in units of the equations.
    found = refine_branch_point(
        lambda z: apart.residual(z[:1], z[1:]), np.array([1e-3, 0.0]), np.ones(2)
    )
    np.testing.assert_allclose(found[0], 0.0, atol=1e-12)
    assert abs(found[1]) == pytest.approx(1e-6, rel=1e-9)
    with pytest.raises(vi.ParameterError, match="branch point"):
        switch(apart, path.points[0])


# Cycles of maps


def test_the_fixed_point_of_the_logistic_map_doubles_at_3_and_crosses_zero_at_1():
    path = follow(logistic_cycle(1), [0.5], 2.0, bounds=(0.5, 4))
    assert kinds(path) == ["period_doubling"]
    assert path.special[0].p[0] == pytest.approx(3.0, abs=LOCATED)
    path = follow(logistic_cycle(1), [0.5], 2.0, direction=-1, bounds=(0.5, 4))
    assert kinds(path) == ["branch_point"]
    assert path.special[0].p[0] == pytest.approx(1.0, abs=LOCATED)
    assert path.u[-1, 0] == pytest.approx(-1.0, abs=1e-14)
    (point,) = path.special
    zero = follow(
        logistic_cycle(1), point.u, point.p, tangent=switch(logistic_cycle(1), point), bounds=(0, 4)
    )
    assert zero.end == "bound"
    assert len(zero.points) > 5
    np.testing.assert_allclose(zero.u, 0.0, atol=1e-14)


def test_the_doubled_cycle_is_reached_by_switching_and_doubles_at_1_plus_sqrt_6():
    problem = logistic_cycle(2)
    path = follow(problem, [0.6, 0.6], 2.5, bounds=(2.5, 4))
    (birth,) = path.of_kind("branch_point")
    assert birth.p[0] == pytest.approx(3.0, abs=LOCATED)
    branch = follow(problem, birth.u, birth.p, tangent=switch(problem, birth), bounds=(2.5, 4))
    assert branch.end == "bound"
    assert branch.p[-1, 0] == 4.0
    np.testing.assert_allclose(birth.tangent @ switch(problem, birth), 0.0, atol=1e-8)
    (doubling,) = branch.special
    assert doubling.kind == "period_doubling"
    assert doubling.p[0] == pytest.approx(1 + math.sqrt(6), abs=LOCATED)


def test_the_4_cycle_doubles_at_the_root_of_its_polynomial():
    path = follow(logistic_cycle(4), settle(3.5, period=4), 3.5, bounds=(3.5, 3.6))
    (doubling,) = path.of_kind("period_doubling")
    # E. W. Weisstein, Logistic Map, MathWorld: the onset of the 8-cycle.
    coefficients = (1, -12, 48, -40, -193, 392, 44, 8, -977, -604, 2108, 0, 4913)

    def polynomial(r):
        value = Fraction(0)
        for coefficient in coefficients:
            value = value * r + coefficient
        return value

    r = Fraction(float(doubling.p[0]))
    below, above = (polynomial(r + shift * Fraction(1, 10**12)) for shift in (-1, 1))
    assert below * above < 0


def test_the_3_cycle_is_born_in_a_fold_at_1_plus_sqrt_8():
    path = follow(logistic_cycle(3), settle(3.84, period=3), 3.84, direction=-1, bounds=(3.8, 3.9))
    assert kinds(path)[0] == "fold"
    fold = path.special[0]
    assert fold.p[0] == pytest.approx(1 + math.sqrt(8), abs=LOCATED)
    assert path.end == "bound"
    assert path.p[-1, 0] == 3.9


def test_cycles_of_the_henon_map():
    b = 0.3
    fixed = follow(henon_cycle(1, b), [0.9, 0.27], 0.2, direction=-1, bounds=(-1, 2))
    assert kinds(fixed) == ["fold"]
    assert fixed.special[0].p[0] == pytest.approx(-((1 - b) ** 2) / 4, abs=LOCATED)
    fixed = follow(henon_cycle(1, b), [0.9, 0.27], 0.2, bounds=(-1, 2))
    assert kinds(fixed) == ["period_doubling"]
    assert fixed.special[0].p[0] == pytest.approx(3 * (1 - b) ** 2 / 4, abs=LOCATED)
    u, report = solve(henon_cycle(2, b), [-0.2, 0.3, 1.2, -0.1], 0.7)
    assert report.converged
    assert abs(u[0] - u[2]) > 0.5
    double = follow(henon_cycle(2, b), u, 0.7, bounds=(0.4, 2))
    assert kinds(double) == ["period_doubling"]
    # (1 - b)^2 + (1 + b)^2/4
    assert double.special[0].p[0] == pytest.approx(0.9125, abs=LOCATED)


def test_the_delayed_logistic_map_has_its_neimark_sacker_point_at_2():
    def residual(u, a):
        x, y = u
        return [a * x * (1 - y) - x, x - y], [
            [a * (1 - y) - 1, -a * x, x * (1 - y)],
            [1.0, -1.0, 0.0],
        ]

    def monodromy(jacobian):
        return jacobian[:, :2] + np.eye(2)

    problem = Equations(
        residual,
        lambda u, p, j: {
            "neimark_sacker": neimark_sacker(monodromy(j)),
            "period_doubling": period_doubling(monodromy(j)),
        },
    )
    path = follow(
        problem,
        [1 / 3, 1 / 3],
        1.5,
        bounds=(1.1, 3),
        classify=lambda name, u, p, j: neimark_sacker_kind(monodromy(j)),
    )
    assert kinds(path) == ["neimark_sacker"]
    assert path.special[0].p[0] == pytest.approx(2.0, abs=LOCATED)

"""Continuation of branches on problems whose special points are known in closed form."""

import math
from fractions import Fraction

import numpy as np
import pytest

import vibroimpact as vi
from vibroimpact.orbits.branching import refine_branch_point
from vibroimpact.orbits.continuation import OutsideDomain, follow, solve, switch
from vibroimpact.orbits.map_bifurcations import (
    neimark_sacker,
    neimark_sacker_kind,
    period_doubling,
)

# A located parameter: rounding of p, u and the test, of order 1 each.
LOCATED = 1e-13


class Equations:
    """F(u, p) = 0 from a function that gives F and its Jacobian, and one that gives the tests."""

    def __init__(self, residual, tests=None, size=1.0):
        self._residual, self._tests, self.size = residual, tests, size
        self.calls = 0

    def residual(self, u, p):
        self.calls += 1
        value, jacobian = self._residual(u, *p)
        return np.array(value, dtype=float), np.array(jacobian, dtype=float)

    def tests(self, u, p, jacobian):
        return {} if self._tests is None else self._tests(u, p, jacobian)

    def scale(self, u):
        return np.broadcast_to(self.size, len(u)).astype(float)


def ellipse(tests=None, size=1.0):
    """(u/size)^2/4 + p^2 = 1."""
    return Equations(
        lambda u, p: ([(u[0] / size) ** 2 / 4 + p**2 - 1], [[u[0] / size**2 / 2, 2 * p]]),
        tests,
        size,
    )


def straight(tests):
    """The line u = p/2."""
    return Equations(lambda u, p: ([u[0] - p / 2], [[1.0, -0.5]]), tests)


def logistic_cycle(period):
    """Return the cycles of x -> r x (1 - x), the unknowns being the points of the cycle."""

    def residual(x, r):
        jacobian = np.zeros((period, period + 1))
        jacobian[:, -1] = x * (1 - x)
        jacobian[range(period), range(period)] = r * (1 - 2 * x)
        jacobian[range(period), (np.arange(period) + 1) % period] -= 1
        return r * x * (1 - x) - np.roll(x, -1), jacobian

    def tests(x, r, jacobian):
        multiplier = np.prod(r[0] * (1 - 2 * x))
        return {"period_doubling": period_doubling(np.array([[multiplier]]))}

    return Equations(residual, tests)


def settle(r, steps=100_000, period=1):
    """Return a cycle that iteration of the logistic map converges to."""
    x = 0.3
    for _ in range(steps):
        x = r * x * (1 - x)
    cycle = [x]
    for _ in range(period - 1):
        cycle.append(r * cycle[-1] * (1 - cycle[-1]))
    return cycle


def henon_cycle(period, b):
    """Return the cycles of (x, y) -> (1 - a x^2 + y, b x)."""

    def matrices(u, a):
        x = u.reshape(period, 2)[:, 0]
        return [np.array([[-2 * a * xi, 1.0], [b, 0.0]]) for xi in x]

    def residual(u, a):
        x, y = u.reshape(period, 2).T
        image = np.column_stack((1 - a * x**2 + y, b * x))
        jacobian = np.zeros((2 * period, 2 * period + 1))
        for i, matrix in enumerate(matrices(u, a)):
            j = (i + 1) % period
            jacobian[2 * i : 2 * i + 2, 2 * i : 2 * i + 2] += matrix
            jacobian[2 * i : 2 * i + 2, 2 * j : 2 * j + 2] -= np.eye(2)
            jacobian[2 * i, -1] = -(x[i] ** 2)
        return (image - np.roll(np.column_stack((x, y)), -1, axis=0)).ravel(), jacobian

    def tests(u, a, jacobian):
        monodromy = np.eye(2)
        for matrix in matrices(u, a[0]):
            monodromy = matrix @ monodromy
        return {
            "period_doubling": period_doubling(monodromy),
            "neimark_sacker": neimark_sacker(monodromy),
        }

    return Equations(residual, tests)


def kinds(path):
    return [point.kind for point in path.special]


# Newton's method alone


def test_newton_converges_quadratically_to_rounding():
    u, report = solve(logistic_cycle(2), [0.5, 0.8], 3.2)
    # x = (r + 1 -+ sqrt((r + 1)(r - 3)))/(2 r)
    exact = (4.2 + np.array([-1, 1]) * math.sqrt(4.2 * 0.2)) / 6.4
    assert report.converged
    np.testing.assert_allclose(u, exact, rtol=0, atol=1e-15)
    assert report.error < 1e-14
    assert report.residual < 1e-15
    assert report.order == pytest.approx(2.0, abs=0.2)


def test_a_wrong_jacobian_shows_in_the_order():
    wrong = Equations(lambda u, p: ([u[0] ** 3 - p], [[2.7 * u[0] ** 2, -1.0]]))
    u, report = solve(wrong, [2.5], 8.0)
    assert report.converged
    assert u[0] == pytest.approx(2.0, abs=1e-13)
    assert report.order == pytest.approx(1.0, abs=0.1)


def test_damping_finds_what_plain_newton_runs_away_from():
    # From |u| > 1.39 undamped steps for arctan u = 0 grow without bound.
    arctan = Equations(lambda u, p: ([math.atan(u[0]) - p], [[1 / (1 + u[0] ** 2), -1.0]]))
    u, report = solve(arctan, [20.0], 0.0)
    assert report.converged
    assert abs(u[0]) < 1e-14


@pytest.mark.parametrize(
    ("residual", "start", "outcome"),
    [
        (lambda u, p: ([u[0] ** 2 + 1], [[2 * u[0], 0.0]]), 3.0, "no convergence"),
        (
            lambda u, p: ([u[0] ** 2 - 2 * u[0] / 3 + 1 / 9], [[2 * u[0] - 2 / 3, 0.0]]),
            1.0,
            "singular",
        ),
        (lambda u, p: ([1.0], [[0.0, 0.0]]), 1.0, "singular"),
        (lambda u, p: ([math.nan], [[1.0, 0.0]]), 1.0, "outside domain"),
    ],
)
def test_newton_says_why_it_failed(residual, start, outcome):
    _, report = solve(Equations(residual), [start], 0.0)
    assert report.outcome == outcome
    assert not report.converged


def test_coarse_rounding_ends_the_iteration_and_is_reported():
    # u + 10^4 is known to 2e-12 only.
    coarse = Equations(lambda u, p: ([((u[0] + 1e4) - 1e4) ** 3 - p], [[3 * u[0] ** 2, -1.0]]))
    u, report = solve(coarse, [2.0], 3.0)
    assert report.converged
    assert abs(u[0] - 3 ** (1 / 3)) < 2e-12
    assert 1e-14 < report.error < 2e-12


def test_newton_steps_back_into_the_domain():
    def residual(u, p):
        if u[0] <= 0:
            raise OutsideDomain("log of a negative number")
        return [math.log(u[0]) - p], [[1 / u[0], -1.0]]

    u, report = solve(Equations(residual), [10.0], -1.0)
    assert report.converged
    assert u[0] == pytest.approx(math.exp(-1.0), abs=1e-15)


# Branches: ends, folds, closed curves


@pytest.mark.parametrize("size", [1.0, 1e-7, 1e5])
def test_an_ellipse_closes_with_a_fold_at_either_end(size):
    path = follow(ellipse(size=size), [1.9 * size], 0.0, bounds=(-5, 5))
    assert path.end == "closed"
    assert kinds(path) == ["fold", "fold"]
    np.testing.assert_allclose([point.p[0] for point in path.special], [1, -1], atol=LOCATED)
    for point in path.special:
        assert abs(point.u[0]) < 1e-12 * size
        assert abs(point.value) < 1e-12
        assert point.continuous
        assert point.bracket[1] - point.bracket[0] < 1e-14
    np.testing.assert_array_equal(path.points[-1].z, path.points[0].z)
    assert path.points[-1].arclength > path.points[-2].arclength
    # The circumference 4 a E(e) of the ellipse with half axes 2 and 1; a step s is shorter than
    # its arc, by less than (max_step)^2 max(curvature)^2/3 of it.
    assert path.arclength[-1] == pytest.approx(9.688448220547675, rel=0.1**2 * 2**2 / 3)
    assert path.arclength[-1] < 9.688448220547675
    on_it = (path.u[:, 0] / size) ** 2 / 4 + path.p[:, 0] ** 2
    np.testing.assert_allclose(on_it, 1.0, rtol=0, atol=1e-14)


def test_a_loop_started_at_a_fold_reports_it_once():
    first = follow(ellipse(), [1.9], 0.0, bounds=(-5, 5), stop_at={"fold"})
    assert first.end == "stopped: fold"
    assert first.points[-1].p[0] == pytest.approx(1.0, abs=LOCATED)
    fold = first.special[0]
    for direction in (1, -1):
        path = follow(
            ellipse(), fold.u, fold.p, tangent=fold.tangent, direction=direction, bounds=(-5, 5)
        )
        assert path.end == "closed"
        parameters = sorted(round(point.p[0]) for point in path.special)
        assert parameters == [-1, 1]
        # and a fold does not stop the branch that starts there
        path = follow(
            ellipse(),
            fold.u,
            fold.p,
            tangent=fold.tangent,
            bounds=(-5, 5),
            direction=direction,
            stop_at={"fold"},
        )
        assert path.points[-1].p[0] == pytest.approx(-1.0, abs=LOCATED)


@pytest.mark.parametrize("bound", [0.5, 0.99, 0.999_999_9])
def test_a_branch_ends_exactly_on_its_bound(bound):
    path = follow(ellipse(), [1.9], 0.0, bounds=(-0.3, bound))
    assert path.end == "bound"
    assert path.points[-1].p[0] == bound
    assert path.points[-1].u[0] == pytest.approx(2 * math.sqrt(1 - bound**2), abs=1e-12)
    assert kinds(path) == []
    path = follow(ellipse(), [1.9], 0.0, direction=-1, bounds=(-0.3, bound))
    assert path.points[-1].p[0] == -0.3
    np.testing.assert_array_less(np.diff(path.p[:, 0]), 0.0)


def test_a_fold_on_the_bound_is_passed_or_ended_at():
    # Which of the two is decided by rounding.
    path = follow(ellipse(), [1.9], 0.0, bounds=(-0.3, 1.0))
    assert path.end == "bound"
    assert path.p.max() == pytest.approx(1.0, abs=1e-2)
    assert path.p.max() <= 1.0 + 1e-15


def test_a_fold_beyond_the_bound_within_one_step_ends_at_the_bound():
    # The step from p = 0.998 to the other side of the fold lies inside at both ends.
    path = follow(
        ellipse(),
        [2 * math.sqrt(1 - 0.998**2)],
        0.998,
        bounds=(-2, 0.9999),
        step=0.3,
        max_step=0.3,
        max_angle=1.0,
    )
    assert path.end == "bound"
    assert path.points[-1].p[0] == 0.9999
    assert path.points[-1].u[0] == pytest.approx(2 * math.sqrt(1 - 0.9999**2), abs=1e-12)
    assert kinds(path) == []


def test_a_curve_that_bends_across_its_bound_ends_there():
    # p = u^2 from its fold: the tangent never meets the bound.
    parabola = Equations(lambda u, p: ([p - u[0] ** 2], [[-2 * u[0], 1.0]]))
    path = follow(
        parabola, [0.0], 0.0, tangent=[1.0, 0.0], bounds=(-1, 0.0005), step=0.1, max_step=0.1
    )
    assert path.end == "bound"
    assert path.points[-1].p[0] == 0.0005
    assert path.points[-1].u[0] == pytest.approx(math.sqrt(0.0005), abs=1e-14)


def test_a_curve_that_passes_near_its_start_is_not_closed():
    # A spiral in (x, p) whose angle hardly counts: the next turn is 0.006 away.
    def residual(u, p):
        x, angle = u
        radius, cos, sin = 1 + 1e-3 * angle, math.cos(angle), math.sin(angle)
        return [x - radius * cos, p - radius * sin], [
            [1.0, radius * sin - 1e-3 * cos, 0.0],
            [0.0, -radius * cos - 1e-3 * sin, 1.0],
        ]

    spiral = Equations(residual, size=np.array([1.0, 1e6]))
    path = follow(spiral, [1.0, 0.0], 0.0, bounds=(-2, 2), max_points=300)
    assert path.end == "points"
    assert path.u[-1, 1] > 3 * math.tau


def test_a_branch_is_not_followed_across_a_gap():
    gap = Equations(lambda u, p: ([u[0] - (0.01 if p > 0.5 else 0.0)], [[1.0, 0.0]]))
    path = follow(gap, [0.0], 0.0, bounds=(0, 1))
    assert path.end == "no convergence"
    assert path.points[-1].p[0] == pytest.approx(0.5, abs=1e-5)
    assert path.points[-1].u[0] == 0.0


def test_a_start_on_the_bound_can_leave_it_inwards_only():
    outwards = follow(straight(None), [0.0], 0.0, direction=-1, bounds=(0, 1))
    assert outwards.end == "bound"
    assert len(outwards.points) == 1
    inwards = follow(straight(None), [0.0], 0.0, bounds=(0, 1))
    assert inwards.end == "bound"
    assert inwards.points[-1].p[0] == 1.0


def test_f_is_not_evaluated_beyond_a_bound_that_is_met_head_on():
    def residual(u, p):
        assert p <= 1.0
        return [u[0] - p**2], [[1.0, -2 * p]]

    path = follow(Equations(residual), [0.0], 0.0, bounds=(0, 1), step=0.03)
    assert path.end == "bound"
    assert path.points[-1].z.tolist() == [1.0, 1.0]


@pytest.mark.parametrize("by_exception", [True, False])
def test_a_branch_ends_where_its_domain_does(by_exception):
    def residual(u, p):
        if p < 0.25:
            if by_exception:
                raise OutsideDomain("p < 0.25")
            return [math.nan], [[1.0, math.nan]]
        return [u[0] - p], [[1.0, -1.0]]

    path = follow(Equations(residual), [1.0], 1.0, direction=-1, bounds=(0, 2), min_step=1e-8)
    assert path.end == "outside domain"
    assert path.points[-1].p[0] == pytest.approx(0.25, abs=1e-8)
    assert path.points[-1].p[0] >= 0.25


def test_a_corner_is_no_convergence():
    corner = Equations(lambda u, p: ([u[0] - abs(p) / 2], [[1.0, -math.copysign(0.5, p)]]))
    path = follow(corner, [0.25], -0.5, bounds=(-1, 1))
    assert path.end == "no convergence"
    assert path.points[-1].p[0] == pytest.approx(0.0, abs=1e-5)
    assert "turns" in path.detail


def test_a_start_without_solution_is_an_empty_path():
    nothing = Equations(lambda u, p: ([u[0] ** 2 + 1 + p], [[2 * u[0], 1.0]]))
    path = follow(nothing, [3.0], 0.0, bounds=(-0.5, 1))
    assert path.end == "no convergence"
    assert path.points == ()
    assert path.detail.startswith("start: ")
    undefined = Equations(lambda u, p: ([math.nan], [[1.0, 1.0]]))
    assert follow(undefined, [3.0], 0.0, bounds=(-1, 1)).end == "outside domain"


def test_the_number_of_points_is_capped():
    path = follow(ellipse(), [1.9], 0.0, bounds=(-5, 5), max_points=7)
    assert path.end == "points"
    assert len(path.points) == 7


def test_ctrl_c_keeps_the_points():
    problem = ellipse()
    plain = problem.residual

    def residual(u, p):
        if problem.calls == 60:
            raise KeyboardInterrupt
        return plain(u, p)

    problem.residual = residual
    with pytest.raises(vi.Interrupted) as caught:
        follow(problem, [1.9], 0.0, bounds=(-5, 5))
    path = caught.value.result
    assert path.end == "interrupted"
    assert len(path.points) > 3
    whole = follow(ellipse(), [1.9], 0.0, bounds=(-5, 5))
    np.testing.assert_array_equal(path.u, whole.u[: len(path.points)])


def test_the_same_input_gives_the_same_bits():
    one, two = (follow(ellipse(), [1.9], 0.0, bounds=(-5, 5)) for _ in range(2))
    assert one.u.tobytes() == two.u.tobytes()
    assert one.p.tobytes() == two.p.tobytes()


# Tests of the problem


def test_events_are_located_and_ordered_within_one_step():
    names = {"b: 2": 0.523, "b: 1": 0.531, "a": 0.5315, "c": 0.48}
    problem = straight(lambda u, p, j: {name: math.expm1(p[0] - at) for name, at in names.items()})
    path = follow(problem, [0.25], 0.5, bounds=(0, 1), step=0.1)
    assert [point.test for point in path.special] == ["b: 2", "b: 1", "a"]
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
            "graze: leg 1": 0.72 - p[0],
            "graze: leg 2": 0.7 - p[0],
            "other": 0.69 - p[0],
        }
    )
    path = follow(problem, [0.25], 0.5, bounds=(0, 1), stop_at={"graze"})
    assert path.end == "stopped: graze: leg 2"
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
    assert path.end == "stopped: t"
    assert kinds(path) == ["t at 0.7"]


# Branch points


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
    assert (
        refine_branch_point(
            lambda z: apart.residual(z[:1], z[1:]), np.array([1e-3, 0.0]), np.ones(2)
        )
        is None
    )
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


# Bad input


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"u": [math.nan]}, r"u\[0\] = nan"),
        ({"u": [[1.9]]}, "one dimension"),
        ({"p": math.inf}, "inf"),
        ({"p": [0.0, 1.0]}, "one number"),
        ({"bounds": (1, -1)}, "bounds"),
        ({"bounds": (0.5, 2)}, "around the start"),
        ({"bounds": (math.nan, 2)}, "bounds"),
        ({"bounds": 3.0}, "bounds"),
        ({"direction": 0}, "direction = 0"),
        ({"direction": True}, "direction = True"),
        ({"step": 0.0}, "step = 0.0"),
        ({"step": 0.5}, "max_step"),
        ({"min_step": 0.02}, "min_step"),
        ({"max_step": math.nan}, "max_step"),
        ({"max_points": 0}, "max_points"),
        ({"max_points": 2.0}, "max_points"),
        ({"max_angle": 2.0}, "max_angle"),
        ({"parameter_size": -1.0}, "parameter_size"),
        ({"tangent": [1.0]}, "tangent"),
        ({"tangent": [0.0, 0.0]}, "tangent"),
        ({"stop_at": "fold"}, "stop_at"),
    ],
)
def test_bad_input_is_refused_before_anything_is_evaluated(change, words):
    problem = ellipse()
    arguments = {"u": [1.9], "p": 0.0, "bounds": (-5, 5), **change}
    with pytest.raises(vi.ParameterError, match=words):
        follow(problem, arguments.pop("u"), arguments.pop("p"), **arguments)
    assert problem.calls == 0


def test_bad_scale_and_bad_newton_settings_are_refused():
    problem = ellipse()
    problem.size = 0.0  # a slip in the problem, not in the call
    with pytest.raises(vi.ParameterError, match="scale"):
        follow(problem, [1.9], 0.0, bounds=(-5, 5))
    with pytest.raises(vi.ParameterError, match="rtol"):
        solve(ellipse(), [1.9], 0.0, rtol=-1.0)
    with pytest.raises(vi.ParameterError, match="max_iterations"):
        solve(ellipse(), [1.9], 0.0, max_iterations=0)


def test_a_test_that_stays_zero_is_located_where_it_becomes_zero():
    # As the length of a slide does where chatter brings the tip to rest.
    problem = Equations(
        lambda u, p: ([u[0] - p], [[1.0, -1.0]]), lambda u, p, j: {"length": max(0.0, 0.3 - p[0])}
    )
    for step in (0.01, 0.02, 0.07):
        path = follow(problem, [0.0], 0.0, bounds=(0, 1), step=step, stop_at={"length"})
        assert path.end == "stopped: length"
        assert path.special[-1].p[0] == pytest.approx(0.3, abs=1e-14)

"""Continuation of branches in closed form: folds, closed curves, ends, bad input.

Newton's method is tested in test_newton.py, located points in test_special_points.py.
"""

import math

import numpy as np
import pytest

import vibroimpact as vi
from equations import LOCATED, Equations, ellipse, kinds, straight
from vibroimpact.continuation.follow import OutsideDomain, follow, solve


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
    assert (first.end, first.stop.test) == ("stopped", "fold")
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
        ({"max_points": 2.5}, "max_points"),
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

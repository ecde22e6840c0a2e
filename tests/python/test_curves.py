"""Curves of special points in two parameters, and the test functions of multipliers."""

import math
from itertools import combinations

import numpy as np
import pytest

import vibroimpact as vi
from vibroimpact.continuation.curves import HasMatrices, follow_curve
from vibroimpact.continuation.follow import OutsideDomain, follow
from vibroimpact.continuation.map_bifurcations import (
    bialternate,
    neimark_sacker,
    neimark_sacker_cosine,
    neimark_sacker_kind,
    period_doubling,
    saddle_node,
)


class Equations:
    """F(u, p) = 0 with any number of parameters, and tests by name."""

    def __init__(self, residual, tests=None):
        self._residual, self._tests = residual, tests

    def residual(self, u, p):
        value, jacobian = self._residual(u, *p)
        return np.array(value, dtype=float), np.array(jacobian, dtype=float)

    def tests(self, u, p, jacobian):
        return {} if self._tests is None else self._tests(u, p, jacobian)

    def scale(self, u):
        return np.ones(len(u))


def henon(u, a, b):
    x, y = u
    return [1 - a * x**2 + y - x, b * x - y], [[-2 * a * x - 1, 1, -(x**2), 0], [b, -1, 0, x]]


def monodromy(jacobian):
    return jacobian[:, :2] + np.eye(2)


def henon_tests(u, p, jacobian):
    m = monodromy(jacobian)
    return {
        "saddle_node": saddle_node(m),
        "period_doubling": period_doubling(m),
        "neimark_sacker": neimark_sacker(m),
    }


class WithMatrices(Equations):
    """The same with the matrices whose singularity the tests look for."""

    def singular_matrices(self, u, p, jacobian):
        m = monodromy(jacobian)
        return {
            "period_doubling": m + np.eye(2),
            "neimark_sacker": bialternate(m) - np.eye(1),
        }


def fixed_point(a, b):
    x = (-(1 - b) + math.sqrt((1 - b) ** 2 + 4 * a)) / (2 * a)
    return [x, b * x]


def kinds(path):
    return [point.kind for point in path.special]


# Curves


def test_folds_of_the_cusp_form_pass_the_cusp():
    # b + a x - x^3 = 0 has folds at a = 3 x^2, b = -2 x^3: 4 a^3 = 27 b^2, a cusp at 0.
    cusp = Equations(lambda x, a, b: ([b + a * x[0] - x[0] ** 3], [[a - 3 * x[0] ** 2, x[0], 1.0]]))
    path = follow_curve(cusp, [0.9], [2.4, -1.4], "fold", bounds=((-5, 4), (-10, 10)))
    assert path.end == "bound"
    x, (a, b) = path.u[:, 0], path.p.T
    assert a[-1] == 4.0
    assert b[-1] == pytest.approx(2 * (4 / 3) ** 1.5, abs=1e-14)
    np.testing.assert_allclose(a, 3 * x**2, rtol=0, atol=1e-13)
    np.testing.assert_allclose(b, -2 * x**3, rtol=0, atol=1e-13)
    assert kinds(path) == ["cusp"]
    np.testing.assert_allclose(path.special[0].z, 0.0, atol=1e-13)


def test_a_tilted_cusp_is_one_event():
    # The same in the parameters s = a + b, d = a - b + 0.1 b: both turn at the cusp.
    def residual(x, s, d):
        b = (s - d) / 1.9
        a = s - b
        by_s, by_d = 1 / 1.9, -1 / 1.9
        return [b + a * x[0] - x[0] ** 3], [
            [a - 3 * x[0] ** 2, by_s + (1 - by_s) * x[0], by_d - by_d * x[0]]
        ]

    a, b = 3 * 0.5**2, -2 * 0.5**3
    path = follow_curve(
        Equations(residual),
        [0.5],
        [a + b, a - 0.9 * b],
        "fold",
        direction=-1,
        bounds=((-1, 1), (-1, 1.1)),
    )
    assert path.end == "bound"
    (cusp,) = path.of_kind("cusp")
    np.testing.assert_allclose(cusp.z, 0.0, atol=1e-12)
    # s = 3 x^2 - 2 x^3 and d = 3 x^2 + 1.8 x^3 turn at x = 0, where the cusp is, and at 1, -10/9.
    assert path.u[:, 0].min() > -1.0
    assert kinds(path) == ["cusp"]


def test_folds_of_an_ellipsoid_close_and_turn_in_both_parameters():
    ellipsoid = Equations(
        lambda u, p, q: ([u[0] ** 2 + p**2 / 4 + q**2 - 1], [[2 * u[0], p / 2, 2 * q]])
    )
    path = follow_curve(ellipsoid, [0.1], [1.6, 0.6], "fold", bounds=((-3, 3), (-3, 3)))
    assert path.end == "closed"
    turns = {
        name: sorted(
            point.p.tolist() for point in path.special if point.test == f"turning_point: {name}"
        )
        for name in (1, 2)
    }
    np.testing.assert_allclose(turns[1], [[-2, 0], [2, 0]], atol=1e-9)
    np.testing.assert_allclose(turns[2], [[0, -1], [0, 1]], atol=1e-9)
    # The extremum itself is exact: the place along the curve enters it squared.
    np.testing.assert_allclose([turns[1][0][0], turns[2][1][1]], [-2, 1], atol=1e-14)
    assert len(path.special) == 4
    np.testing.assert_allclose(path.u, 0.0, atol=1e-14)
    np.testing.assert_allclose((path.p**2 / [4, 1]).sum(axis=1), 1.0, rtol=0, atol=1e-14)


def test_a_curve_that_starts_on_a_bound_does_not_leave_through_it():
    circle = Equations(
        lambda u, p, q: ([u[0] ** 2 + p**2 / 4 + q**2 - 1], [[2 * u[0], p / 2, 2 * q]])
    )
    # Rounding of q moves p, to either side of its bound.
    for bound in np.linspace(0.3, 1.9, 33):
        start = [bound, math.sqrt(1.0 - bound**2 / 4)]
        out, back = (
            follow_curve(circle, [0.0], start, "fold", direction=sign, bounds=((0, bound), (0, 2)))
            for sign in (-1, 1)
        )
        assert (out.end, len(out.points)) == ("bound", 1)
        assert out.p[0, 0] == back.p[0, 0] == bound
        np.testing.assert_allclose(back.p[-1], [0, 1], atol=1e-15)


def test_folds_of_the_henon_map():
    problem = Equations(henon, henon_tests)
    path = follow_curve(
        problem,
        [3.0, 0.9],
        [-0.13, 0.31],
        "fold",
        direction=-1,
        bounds=((-3, 3), (-1.5, 0.8)),
        ignore={"saddle_node"},
    )
    assert path.end == "bound"
    a, b = path.p.T
    assert b[-1] == -1.5
    np.testing.assert_allclose(a, -((1 - b) ** 2) / 4, rtol=0, atol=1e-13)
    # b = -1: both multipliers are 1.
    assert kinds(path) == ["neimark_sacker"]
    np.testing.assert_allclose(path.special[0].p, [-1, -1], rtol=0, atol=1e-12)


@pytest.mark.parametrize("kind_of_problem", [Equations, WithMatrices])
def test_period_doublings_of_the_henon_map(kind_of_problem):
    problem = kind_of_problem(henon, henon_tests)
    assert isinstance(problem, HasMatrices) == (kind_of_problem is WithMatrices)
    path = follow_curve(
        problem,
        fixed_point(0.36, 0.3),
        [0.36, 0.3],
        "period_doubling",
        direction=-1,
        bounds=((-5, 5), (-1.2, 0.8)),
    )
    assert path.end == "bound"
    a, b = path.p.T
    assert b[-1] == -1.2
    np.testing.assert_allclose(a, 3 * (1 - b) ** 2 / 4, rtol=0, atol=1e-13)
    # b = -1: both multipliers are -1, the resonance 1:2.
    assert kinds(path) == ["neimark_sacker"]
    np.testing.assert_allclose(path.special[0].p, [3, -1], rtol=0, atol=1e-12)


@pytest.mark.parametrize("kind_of_problem", [Equations, WithMatrices])
def test_neimark_sacker_points_of_the_henon_map_end_at_strong_resonances(kind_of_problem):
    # The determinant is -b: they lie on b = -1, so that b fixes nothing at the start.
    def tests(u, p, jacobian):
        m = monodromy(jacobian)
        cosine = neimark_sacker_cosine(m)
        return {
            "neimark_sacker": neimark_sacker(m),
            "period_doubling": period_doubling(m),
            "resonance: 1:4": cosine,
            "resonance: 1:3": cosine + 0.5,
        }

    problem = kind_of_problem(henon, tests)
    start = [-0.5, -1.02]
    path = follow_curve(
        problem,
        fixed_point(*start),
        start,
        "neimark_sacker",
        tangent=[0, 0, 1, 0],
        bounds=((-0.9, 4), (-2, 0)),
    )
    assert path.end == "bound"
    assert path.p[-1, 0] == 4.0
    np.testing.assert_allclose(path.p[:, 1], -1.0, rtol=0, atol=1e-14)
    # cos(theta) = -a x with a x^2 + 2 x - 1 = 0, that is 1 - sqrt(1 + a)
    at = [point.p[0] for point in path.special]
    assert [point.test for point in path.special] == [
        "resonance: 1:4",
        "resonance: 1:3",
        "period_doubling",
    ]
    np.testing.assert_allclose(at, [0.0, 1.25, 3.0], rtol=0, atol=1e-12)


def test_a_curve_of_any_test_function_is_followed():
    # u = p, "graze" vanishes where u^2 + q^2 = 1; it does not exist for q < -0.5.
    def tests(u, p, jacobian):
        graze = {} if p[1] < -0.5 else {"graze: leg 1": 1 - u[0] ** 2 - p[1] ** 2}
        return {**graze, "border": u[0] + 0.3}

    problem = Equations(lambda u, p, q: ([u[0] - p], [[1.0, -1.0, 0.0]]), tests)
    path = follow_curve(
        problem,
        [0.7],
        [0.7, 0.7],
        "graze: leg 1",
        bounds=((-2, 2), (-2, 2)),
        min_step=1e-7,
    )
    assert path.end == "outside domain"
    np.testing.assert_allclose((path.p**2).sum(axis=1), 1.0, rtol=0, atol=1e-14)
    assert path.points[-1].p[1] == pytest.approx(-0.5, abs=1e-6)
    assert [point.test for point in path.special] == [
        "turning_point: 2",
        "border",
        "turning_point: 1",
    ]
    np.testing.assert_allclose(path.special[1].p, [-0.3, math.sqrt(0.91)], atol=1e-13)
    stopped = follow_curve(
        problem,
        [0.7],
        [0.7, 0.7],
        "graze: leg 1",
        bounds=((-2, 2), (-2, 2)),
        stop_at={"border"},
    )
    assert (stopped.end, stopped.stop.test) == ("stopped", "border")


def test_a_curve_at_the_edge_of_its_domain_takes_one_sided_differences():
    def residual(u, p, q):
        if q < 0:
            raise OutsideDomain("q < 0")
        return [u[0] - p], [[1.0, -1.0, 0.0]]

    problem = Equations(residual, lambda u, p, j: {"t": u[0] - p[1]})
    path = follow_curve(problem, [0.0], [0.0, 0.0], "t", bounds=((-1, 1), (0, 1)))
    assert path.end == "bound"
    assert path.p[-1].tolist() == [1.0, 1.0]


def test_a_matrix_that_ceases_to_be_finite_ends_the_curve():
    class Vanishing(Equations):
        def singular_matrices(self, u, p, jacobian):
            return {"border": np.array([[u[0] - p[1] if p[0] < 0.5 else math.inf]])}

    problem = Vanishing(lambda u, p, q: ([u[0] - p], [[1.0, -1.0, 0.0]]))
    path = follow_curve(problem, [0.0], [0.0, 0.0], "border", bounds=((-1, 1), (-1, 1)))
    assert path.end == "outside domain"
    assert path.points[-1].p[0] == pytest.approx(0.5, abs=1e-4)
    path = follow_curve(problem, [0.6], [0.6, 0.6], "border", bounds=((-1, 1), (-1, 1)))
    assert path.end == "outside domain"
    assert path.points == ()


def test_a_located_fold_of_a_branch_starts_a_curve():
    fold = follow(
        Equations(lambda x, a: ([-1.0 + a * x[0] - x[0] ** 3], [[a - 3 * x[0] ** 2, x[0]]])),
        [1.0],
        2.0,
        direction=-1,
        bounds=(0, 3),
        stop_at={"fold"},
    ).special[0]
    cusp = Equations(lambda x, a, b: ([b + a * x[0] - x[0] ** 3], [[a - 3 * x[0] ** 2, x[0], 1.0]]))
    path = follow_curve(cusp, fold.u, [fold.p[0], -1.0], "fold", bounds=((0, 3), (-2, 2)))
    np.testing.assert_allclose(path.points[0].z, [*fold.z.tolist(), -1.0], atol=1e-12)
    assert path.end == "bound"


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"p": 1.6}, "one dimension|two numbers|shape"),
        ({"p": [1.6, 0.6, 0.0]}, "two numbers"),
        ({"p": [1.6, math.nan]}, r"p\[1\] = nan"),
        ({"test": "unknown"}, "test = 'unknown'"),
        ({"bounds": (-3, 3)}, "bounds"),
        ({"bounds": ((-3, 3), (2, 3))}, r"bounds\[1\]"),
        ({"tangent": [1.0, 0.0]}, "tangent"),
        ({"parameter_sizes": (1.0, 0.0)}, "parameter_sizes"),
        ({"direction": 2}, "direction"),
        ({"ignore": "fold"}, "ignore"),
        ({"min_step": -1.0}, "min_step"),
    ],
)
def test_bad_input_is_refused(change, words):
    problem = Equations(
        lambda u, p, q: ([u[0] ** 2 + p**2 / 4 + q**2 - 1], [[2 * u[0], p / 2, 2 * q]])
    )
    arguments = {
        "u": [0.1],
        "p": [1.6, 0.6],
        "test": "fold",
        "bounds": ((-3, 3), (-3, 3)),
        **change,
    }
    with pytest.raises(vi.ParameterError, match=words):
        follow_curve(
            problem, arguments.pop("u"), arguments.pop("p"), arguments.pop("test"), **arguments
        )


# Test functions of multipliers


def random_matrix(rng, n):
    return rng.normal(size=(n, n)) * 10.0 ** rng.uniform(-2, 2)


@pytest.mark.parametrize("n", [2, 4])
def test_tests_have_the_signs_of_the_products_over_multipliers(n):
    rng = np.random.default_rng(7)
    signs = set()
    for _ in range(200):
        m = random_matrix(rng, n)
        values = np.linalg.eigvals(m)
        pairs = [a * b for a, b in combinations(values, 2)]
        np.testing.assert_allclose(
            np.sort_complex(np.linalg.eigvals(bialternate(m))),
            np.sort_complex(pairs),
            rtol=0,
            atol=1e-10 * max(1, abs(np.array(pairs)).max()),
        )
        exact = (np.prod(1 - values), np.prod(1 + values), np.prod([1 - pair for pair in pairs]))
        found = (saddle_node(m), period_doubling(m), neimark_sacker(m))
        assert np.sign(found).tolist() == np.sign(np.real(exact)).tolist()
        # sigma + 1 <= sqrt(2) sqrt(1 + sigma^2), over n or n(n - 1)/2 singular values
        assert max(abs(value) for value in found) <= 2 ** (max(n, n * (n - 1) / 2) / 2)
        signs.add(tuple(np.sign(found)))
    # Two real multipliers cannot make all three tests negative.
    assert len(signs) == {2: 7, 4: 8}[n]


@pytest.mark.parametrize("others", [(), (0.0, 0.0), (0.0, 0.3), (1e-9, -0.4), (1e6, 2.0)])
def test_tests_vanish_linearly_at_their_bifurcations(others):
    rng = np.random.default_rng(3)
    basis = np.linalg.qr(rng.normal(size=(2 + len(others),) * 2))[0]

    def with_pair(block):
        m = np.zeros((2 + len(others),) * 2)
        m[:2, :2] = block
        m[range(2, len(m)), range(2, len(m))] = others
        return basis @ m @ basis.T

    def rotation(size):
        return size * np.array([[0.6, -0.8], [0.8, 0.6]])

    cases = (
        (saddle_node, lambda e: np.diag([1 + e, 0.2])),
        (period_doubling, lambda e: np.diag([-1 - e, 0.2])),
        (neimark_sacker, lambda e: rotation(1 + e)),
        (neimark_sacker, lambda e: np.diag([4 + 4 * e, 0.25])),
    )
    for test, block in cases:
        near = [test(with_pair(block(e))) for e in (-2e-4, -1e-4, 1e-4, 2e-4)]
        assert near[1] * near[2] < 0
        assert near[0] / near[1] == pytest.approx(2.0, rel=1e-2)
        assert near[3] / near[2] == pytest.approx(2.0, rel=1e-2)


def test_neimark_sacker_is_told_from_a_neutral_saddle():
    theta = 1.1
    turn = np.array([[math.cos(theta), -math.sin(theta)], [math.sin(theta), math.cos(theta)]])
    m = np.zeros((4, 4))
    m[:2, :2], m[2, 2] = turn, 0.5
    assert neimark_sacker_kind(m) == "neimark_sacker"
    assert neimark_sacker_cosine(m) == pytest.approx(math.cos(theta), abs=1e-15)
    saddle = np.diag([-4.0, -0.25, 0.0, 0.1])
    assert abs(neimark_sacker(saddle)) < 1e-15
    assert neimark_sacker_kind(saddle) == "neutral_saddle"
    assert neimark_sacker_cosine(saddle) == -2.125
    assert math.isnan(neimark_sacker_cosine(np.array([[0.5]])))


def test_huge_multipliers_do_not_overflow():
    m = np.diag([1e200, -1e150, 0.0, 0.5])
    for value in (saddle_node(m), period_doubling(m)):
        assert math.isfinite(value)
        assert value != 0.0
    assert saddle_node(np.diag([1.0, 3.0])) == 0.0

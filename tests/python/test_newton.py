"""Newton's method alone: convergence, damping, domains, and what it says when it fails."""

import math

import numpy as np
import pytest

from equations import Equations, logistic_cycle
from vibroimpact.continuation.follow import OutsideDomain, solve


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

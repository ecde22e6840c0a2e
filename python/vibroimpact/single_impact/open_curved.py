"""Solutions with an open phase (`open_phase`) whose restitution depends on the approach velocity.

In a narrow box of x1 the line of the unknowns turns with rho. The coordinate s of a piece of r(u)
is halved until the two cuts with the circle have another approach velocity than s says, or until
Krawczyk's operator proves one solution in (x1, V, W, P, cos psi, sin psi, s): of the six conditions
and omega (mbar + kappa^2) P (1 - rho)/u = 1.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from .curved import Curved
from .intervals import Interval, join
from .open_phase import hulls, jacobian_of, one_solution, residual_of, units_of
from .pieces import Slope, Speeds

Array = NDArray[np.float64]

# Intervals of s narrower than this part of themselves are left undecided.
_NARROWEST = 1e-9
# Solutions this near to each other are one: it was found from two neighbouring intervals.
_ONE = 1e-9
# Intervals that are looked at; the others are left undecided.
_MOST = 2000
# Steps of Newton's method: an interval that needs more is halved first.
_STEPS = 6


def curved_cuts(
    curved: Curved, box: Interval, within: Interval, piece: Slope
) -> tuple[list[Array], list[Array]]:
    """Find the solutions in boxes of x1 and of the coordinate s of a piece, both of shape (1,).

    Returns
    -------
    solutions, undecided
        (x1, V, W, P, cos psi, sin psi, s) of each; the ends of intervals of s that may hold others.
    """
    equations = curved.at(0.0)
    units = units_of(equations)
    omega, mbar = equations.parameters.drive_frequency, equations.parameters.mass_ratio

    def residual(point: Interval) -> Interval:
        speeds = piece.at(point[6:])
        six = residual_of(replace(equations, rho=speeds.rho), point[:6], units)
        _, kappa, _ = equations.contact(point[:1])
        lever = omega * (kappa.square() + mbar)
        return join(six, lever * point[3:4] * (1.0 - speeds.rho) * speeds.inverse - 1.0)

    def jacobian(point: Interval) -> Interval:
        speeds = piece.at(point[6:])
        six = jacobian_of(replace(equations, rho=speeds.rho), point[:6], units)
        _, kappa, bend = equations.contact(point[:1])
        mass, p = kappa.square() + mbar, point[3:4]
        weight = (1.0 - speeds.rho) * speeds.inverse
        weight_s = (1.0 - speeds.rho) * speeds.inverse_slope - speeds.rho_slope * speeds.inverse
        none = Interval(np.zeros(1))
        by_s = join(*[none] * 4, speeds.rho_slope * mass * p * units[4:5], none)
        last = join(
            2.0 * kappa * bend * p * weight * omega,
            *[none] * 2,
            mass * weight * omega,
            *[none] * 2,
            mass * p * weight_s * omega,
        )
        return join(join(six, by_s[:, None], axis=1), last[None, :])

    solutions: list[Array] = []
    undecided: list[Array] = []
    left = [within]
    for _ in range(_MOST):
        if not left:
            break
        s = left.pop()
        speeds = piece.at(s)
        around, complete = hulls(replace(equations, rho=speeds.rho), box)
        found: list[Array] = []
        for hull in around:
            _, kappa, _ = equations.contact(hull[:1])
            lever = omega * (kappa.square() + mbar)
            one = lever * hull[3:4] * (1.0 - speeds.rho) * speeds.inverse
            if bool((one - 1.0).holds_zero[0]):
                solution = one_solution(residual, jacobian, join(hull, s), steps=_STEPS)
                complete &= solution is not None
                found += [] if solution is None else [solution]
        if complete:
            solutions += [one for one in found if not _is_among(one, solutions)]
        elif s.width[0] <= _NARROWEST * (1.0 + s.largest[0]):
            undecided.append(np.array([s.lo[0], s.hi[0]]))
        else:
            middle = s.middle
            left += [Interval(s.lo, middle), Interval(middle, s.hi)]
    return solutions, undecided + [np.array([s.lo[0], s.hi[0]]) for s in left]


def is_slower(curved: Curved, box: Interval, speeds: Speeds) -> bool:
    """Whether no solution in a box of x1 has one of these approach velocities."""
    equations = curved.at(0.0)
    omega, mbar = equations.parameters.drive_frequency, equations.parameters.mass_ratio
    around, complete = hulls(replace(equations, rho=speeds.rho), box)
    _, kappa, _ = equations.contact(box)
    weight = omega * (kappa.square() + mbar) * (1.0 - speeds.rho) * speeds.inverse
    ones = [weight * hull[3:4] - 1.0 for hull in around]
    return complete and not any(bool(one.holds_zero[0]) for one in ones)


def _is_among(one: Array, others: list[Array]) -> bool:
    return any(np.abs(one - other).max() <= _ONE * (1.0 + np.abs(one).max()) for other in others)

"""The minimum of the cost in a window: Levenberg and Marquardt's method with multiple shooting.

A step is good if it lowers the cost plus a penalty on the gaps between segments, an exact penalty
function (Nocedal, Wright, section 15.4). Damping follows H. B. Nielsen, *Damping Parameter in
Marquardt's Method*, IMM, DTU, 1999.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..errors import SimulationError
from .problem import Evaluation, Point, Problem, Window
from .statistics import costs, weights
from .steps import Linear, correction, multipliers, step

Array = NDArray[np.float64]

# Damping: first, least, and where the search gives up.
_FIRST, _LEAST, _MOST = 1e-3, 1e-12, 1e12
# A step is good if the cost falls by this part of what was predicted, poor below the second.
_GOOD, _POOR = 1e-3, 0.75
# The search ends where a step would lower the sum of squares by less than this part of the variance
# of a row (values are then right to 1e-3 of their standard errors), or by rounding.
_CONVERGED, _ROUNDING = 1e-6, 1e-24
# The same where no step succeeds: beyond a border the motion has other impacts.
_AT_BORDER = 0.02
# Continuity between segments, in units of the sizes of the state.
_CONTINUOUS = 1e-9
# Damping of a variable is at least this part of that of the most sensitive one, and this.
_LEAST_WEIGHT, _NO_WEIGHT = 1e-4, 1e-6
# Random points around a minimum, and how far they go at most, in units of the scales.
_KICKS, _MOST_KICK = 8, 0.3
# A derivative of this size is none.
_MOST_DERIVATIVE = 1e100
# A step so small, in units of the scales, is rounding.
_SMALL = 1e-13
# An impact of the motion that was not measured weighs as a row so many standard errors off.
_UNHEARD = 5.0


@dataclass(frozen=True)
class Along:
    """The derivative of weighted residuals by changes after which the motion is still whole.

    In a chaotic motion the derivatives by the unknowns alone grow beyond all digits. Changes of the
    starts of segments beside them do not.

    Attributes
    ----------
    derivative
        By so many changes as there are unknowns, shape (rows, k).
    changes
        These: of the unknowns, then of the starts of segments, in units of their scales, of
        length 1 and at right angles, shape (k + ..., k).
    weighted
        Residuals in standard errors, record by record.
    """

    derivative: Array
    changes: Array
    weighted: list[Array]


@dataclass
class Found:
    """Where a search ended.

    Attributes
    ----------
    point, window, evaluation
        The values, the segments, and the residuals there.
    cost
        Half the weighted sum of squares, or of the loss.
    whole
        Whether the window holds all rows.
    converged
        Whether the search ended at a minimum.
    steps
        How many steps it took.
    """

    point: Point
    window: Window
    evaluation: Evaluation
    cost: float
    whole: bool
    converged: bool
    steps: int


class Minimiser:
    """Finds the minimum of a problem in a window.

    Parameters
    ----------
    problem
        What is fitted.
    sigmas
        Standard errors of the rows of each record; infinite for rows that do not count.
    loss
        Name of the loss.
    """

    def __init__(self, problem: Problem, sigmas: Sequence[Array], loss: str) -> None:
        self.problem = problem
        self.sigmas = list(sigmas)
        self.loss = loss
        self.sizes = np.ones(len(problem.initial))
        self.steps = 0

    def minimise(self, point: Point, window: Window, most: int, final: bool) -> Found | None:
        """Return the minimum near a point after so many steps at most; None without a motion."""
        found = self.problem.evaluate(point, window)
        if found is None:
            return None
        scales = self.scales(point)
        cost, damping, grow, penalty = self.cost(found), _FIRST, 2.0, 0.0
        converged = False
        linear = None
        for _ in range(most):
            if linear is None:
                linear = self.linear(found, window, scales)
                if linear is None:
                    break
                # In units of the scales; a floor keeps apart what the window does not determine.
                weight = np.maximum(np.linalg.norm(linear.derivative, axis=0), _NO_WEIGHT)
                weight = np.maximum(weight, _LEAST_WEIGHT * weight.max())
            self.steps += 1
            low, high = self._limits(point, scales)
            try:
                taken = step(linear, damping, weight, low, high)
                slack = float(np.abs(multipliers(linear, taken)).max(initial=0.0))
            except np.linalg.LinAlgError:  # derivatives near the end of the range of floats
                break
            penalty = max(penalty, 2.0 * slack)
            after = linear.residuals + linear.derivative @ taken
            left = linear.defects + linear.constraint @ taken
            breach = float(np.abs(linear.defects).sum())
            fall = 0.5 * float(linear.residuals @ linear.residuals - after @ after)
            fall += penalty * (breach - float(np.abs(left).sum()))
            least = _CONVERGED * max(cost, _ROUNDING) / len(linear.residuals)
            small = float(np.abs(taken).max(initial=0.0)) < _SMALL
            if (fall <= least or small) and np.abs(linear.defects).max(initial=0.0) < _CONTINUOUS:
                if damping <= 1e-6 or small:
                    converged = True
                    break
                damping *= 0.01  # a damped step that is small shows nothing
                continue
            merit = cost + penalty * breach
            trial, there, other = self._tried(point, window, taken * scales)
            gain = -1.0
            if there is not None and fall > 0.0:
                gain = (merit - other - penalty * self._breach(there)) / fall
                if gain < _POOR and len(linear.defects):
                    # The gaps are not linear: a step back to where they close (Nocedal, Wright,
                    # section 15.6), without which the penalty refuses good steps.
                    back = taken + correction(linear, self._defects(there))
                    again = self._tried(point, window, np.clip(back, low, high) * scales)
                    if again[1] is not None:
                        better = (merit - again[2] - penalty * self._breach(again[1])) / fall
                        if better > gain:
                            gain, (trial, there, other) = better, again
            if gain > _GOOD:
                assert there is not None
                point, found, cost = trial, there, other
                linear, grow, converged = None, 2.0, False
                damping = max(_LEAST, damping * max(0.1, 1.0 - (2.0 * gain - 1.0) ** 3))
            else:
                damping, grow = max(damping, 1e-8) * grow, 2.0 * grow
                # At the border of a sequence of impacts a small fall is out of reach.
                converged = fall <= _AT_BORDER * max(cost, _ROUNDING) / len(linear.residuals)
                if damping > _MOST or (converged and damping > _FIRST):
                    break
        return Found(point, window, found, cost, final, converged, self.steps)

    def _tried(
        self, point: Point, window: Window, change: Array
    ) -> tuple[Point, Evaluation | None, float]:
        """Return a point after a change, its residuals if there are some, and their cost."""
        trial = self.moved(point, change)
        there = self.problem.evaluate(trial, window)
        return trial, there, np.inf if there is None else self.cost(there)

    def _breach(self, found: Evaluation) -> float:
        """Return the sum of the gaps between segments."""
        return float(np.abs(self._defects(found)).sum())

    def kicked(self, found: Found, random: np.random.Generator) -> Point | None:
        """Return the best of some random points around a minimum; None where there is none.

        They scatter as the residuals let expect, along continuous motions. Beyond the border of a
        sequence of impacts, at which a search may have ended, the cost can be lower.
        """
        window, point = found.window, found.point
        scales = self.scales(point)
        linear = self.linear(found.evaluation, window, scales)
        if linear is None:
            return None
        basis = np.eye(len(scales))
        if len(linear.defects):
            basis = linear.spaces[2]
        _, singular, rows = np.linalg.svd(linear.derivative @ basis, full_matrices=False)
        variance = 2.0 * found.cost / len(linear.residuals)
        spread = np.sqrt(variance) / np.maximum(
            singular, 1e-12 * max(float(singular.max(initial=0.0)), 1.0)
        )
        low, high = self._limits(point, scales)
        best: Point | None = None
        least = np.inf
        for _ in range(_KICKS):
            kick = basis @ (
                rows.T @ (np.minimum(spread, _MOST_KICK) * random.standard_normal(len(spread)))
            )
            trial = self.moved(point, np.clip(kick, low, high) * scales)
            there = self.problem.evaluate(trial, window)
            if there is not None and (misfit := self.misfit(there, window)) < least:
                best, least = trial, misfit
        return best

    def scales(self, point: Point) -> Array:
        """Return the units of steps: of the unknowns, and of the starts of segments."""
        return np.concatenate([self.problem.unknowns.scales, *[self.sizes] * len(point.nodes)])

    def _limits(self, point: Point, scales: Array) -> tuple[Array, Array]:
        """Return the ends of a step in units of the scales: bounds, and not too far."""
        unknowns = self.problem.unknowns
        low, high = np.full(len(scales), -1.0), np.full(len(scales), 1.0)
        count = len(point.values)
        low[:count] = np.maximum(low[:count], (unknowns.low - point.values) / scales[:count])
        high[:count] = np.minimum(high[:count], (unknowns.high - point.values) / scales[:count])
        return low, high

    def moved(self, point: Point, change: Array) -> Point:
        """Return a point after a change of the unknowns and the starts of segments."""
        count = len(point.values)
        values = np.clip(
            point.values + change[:count], self.problem.unknowns.low, self.problem.unknowns.high
        )
        return Point(values, point.nodes + change[count:].reshape(point.nodes.shape))

    def weighted(self, found: Evaluation) -> list[Array]:
        """Return residuals in standard errors."""
        pairs = zip(found.residuals, self.sigmas, strict=True)
        return [residuals / sigma[: len(residuals)] for residuals, sigma in pairs]

    def cost(self, found: Evaluation) -> float:
        """Return half the weighted sum of squares, or of the loss."""
        return sum(costs(self.loss, z) for z in self.weighted(found))

    def misfit(self, found: Evaluation, window: Window) -> float:
        """Return the cost, with that of impacts which the motion has and the records have not.

        No derivative tells the search of these: it may end beyond a graze.
        """
        return self.cost(found) + 0.5 * _UNHEARD**2 * len(found.unheard(window.end))

    def _defects(self, found: Evaluation) -> Array:
        many = len(found.defects) // len(self.sizes)
        return found.defects / np.tile(self.sizes, many)

    def linear(self, found: Evaluation, window: Window, scales: Array) -> Linear | None:
        """Return the equations of a step; None where a derivative does not exist."""
        try:
            jacobians, constraint = self.problem.derivatives(found, window)
        except SimulationError:
            return None
        weighted = self.weighted(found)
        roots = [np.sqrt(weights(self.loss, z)) for z in weighted]
        with np.errstate(over="ignore", invalid="ignore"):  # not finite, and then refused
            rows = [
                (root / sigma[: len(root)])[:, None] * jacobian
                for root, sigma, jacobian in zip(roots, self.sigmas, jacobians, strict=True)
            ]
        residuals = np.concatenate([root * z for root, z in zip(roots, weighted, strict=True)])
        many = len(found.defects) // len(self.sizes)
        with np.errstate(over="ignore", invalid="ignore"):
            linear = Linear(
                residuals,
                np.concatenate(rows) * scales,
                self._defects(found),
                constraint * scales / np.tile(self.sizes, many)[:, None],
            )
        # Squares of larger ones leave the range of floats.
        whole = (np.abs(linear.derivative) < _MOST_DERIVATIVE).all() and (
            np.abs(linear.constraint) < _MOST_DERIVATIVE
        ).all()
        return linear if whole else None

    def along(self, found: Found) -> Along | None:
        """Return the derivative along whole motions; None where it does not exist."""
        linear = self.linear(found.evaluation, found.window, self.scales(found.point))
        if linear is None:
            return None
        weighted = self.weighted(found.evaluation)
        if not len(linear.defects):
            return Along(linear.derivative, np.eye(linear.derivative.shape[1]), weighted)
        changes = linear.spaces[2]
        return Along(linear.derivative @ changes, changes, weighted)

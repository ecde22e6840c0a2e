"""Trapping regions of periodic attractors, and where starts arrive.

Around a section point c of a stable periodic motion the map F of m drive periods contracts in a
norm |x|_P of its own, P = D + M^T P M/rho^2 with M = F'(c) and |lambda| < rho < 1. The size of the
region in which it contracts is found by simulation: a radius is confirmed if F brings every one of
many random states within it nearer to c by a fixed factor, with the motion's number of impacts in
each drive period. Half of that radius is used.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ... import _core
from ..fields import STATUS_NAMES
from .region import Follow, Region, is_rotor, to_core, wrapped

Array = NDArray[np.float64]

# Random states that confirm a radius, and those that are tried first.
_SAMPLES, _SCREENED = 1024, 64
# Drive periods per sample over all section points of one motion that are tried.
_MOST_PERIODS = 64
# Largest half extent of a region that is tried, as part of the motion's size, and the smallest.
_WIDEST, _NARROWEST = 0.25, 1e-9
# Samples lie between this part of the radius and all of it.
_INNERMOST = 1e-3
# Step of the central differences, as part of the motion's size.
_STEP = 1e-6
# Numbers of a state, up to which an equation for the norm is solved directly, in their square.
_DIRECT = 8
# Part of the confirmed radius that is used.
_USED = 0.5


def arrive(
    system: Any,
    starts: Array,
    regions: list[Region],
    follow: Follow,
    *,
    workers: int | None = None,
    progress: Callable[[int], object] | None = None,
) -> _core.Arrivals:
    """Follow every start, shape (n, d), until it arrives in one of the regions, or to the end.

    Starts and ends are states of the compiled machine.
    """
    width = starts.shape[1]
    caps = {} if follow.max_events is None else {"max_events": follow.max_events}
    arrivals = _core.arrivals(
        system._compiled,
        starts,
        centers=np.array([region.center for region in regions]).reshape(-1, width),
        factors=np.array([region.factor for region in regions]).reshape(-1, width, width),
        counts=[list(region.counts) for region in regions],
        periods=follow.periods,
        keep=follow.keep,
        chatter_tolerance=follow.chatter_tolerance,
        workers=workers,
        progress=progress,
        **caps,
    )
    return arrivals


def trapping_region(
    system: Any, sections: Array, follow: Follow, *, workers: int | None = None
) -> Region | None:
    """Find the widest trapping region of a periodic attractor, or None if none is confirmed.

    Parameters
    ----------
    system, follow
        As elsewhere.
    sections
        Its states at the starts of m drive periods, shape (m, d).
    """
    sections = to_core(system, sections)
    size = _size(sections)
    m = len(sections)
    cycle = _Cycle(system, Follow(m, m, follow.max_events, follow.chatter_tolerance), workers)
    tried = np.unique(np.linspace(0, m - 1, min(m, max(1, _MOST_PERIODS // m))).round().astype(int))
    found = [cycle.region(sections[place], size) for place in tried]
    regions = [region for region in found if region is not None]
    # The widest region has the smallest determinant. Motions with m = 1 have only one.
    volume = [-float(np.linalg.slogdet(region.factor)[1]) for region in regions]
    return regions[int(np.argmax(volume))] if regions else None


def largest_multiplier(system: Any, sections: Array, follow: Follow) -> float:
    """Return the largest modulus of a multiplier of a periodic motion, from simulations alone."""
    sections = to_core(system, sections)
    m = len(sections)
    cycle = _Cycle(system, Follow(m, m, follow.max_events, follow.chatter_tolerance), 1)
    matrix = cycle.derivative(sections[-1], _size(sections))
    return float(np.abs(np.linalg.eigvals(matrix)).max()) if matrix is not None else math.nan


def _size(sections: Array) -> Array:
    """Size of a motion along each coordinate; for an equilibrium the size is chosen."""
    largest = np.abs(sections).max(axis=0)
    size: Array = np.maximum(largest, max(0.1 * float(largest.max()), 0.01))
    return size


@dataclass(frozen=True)
class _Cycle:
    """The map of m drive periods."""

    system: Any
    follow: Follow
    workers: int | None

    def __call__(self, starts: Array) -> tuple[Array, NDArray[np.int64], NDArray[np.bool_]]:
        """Return final states, the impacts of each drive period, and which starts got there."""
        arrivals = arrive(self.system, starts, [], self.follow, workers=self.workers)
        if arrivals.interrupted:
            raise KeyboardInterrupt
        ends = np.full(starts.shape, np.nan)
        counts = np.full((len(starts), self.follow.keep), -2)
        left = arrivals.left
        ends[left], counts[left] = arrivals.tails[:, -1], arrivals.counts
        return ends, counts, arrivals.status != STATUS_NAMES.index("overlap")

    def region(self, center: Array, size: Array) -> Region | None:
        """Confirm the largest radius around one section point."""
        _, own, _ = self(center[None])
        matrix = self.derivative(center, size)
        growth = float(np.abs(np.linalg.eigvals(matrix)).max()) if matrix is not None else math.inf
        if matrix is None or not growth < 1.0:
            return None
        rho = 0.5 * (1.0 + growth)
        metric = _metric(matrix / rho, size)
        # |W x|^2 = x^T P x; the unit ball of W has half extents sqrt(diag P^-1).
        factor: Array = np.asarray(np.linalg.cholesky(metric).T, dtype=np.float64)
        inverse: Array = np.asarray(np.linalg.inv(factor), dtype=np.float64)
        widest = float((np.sqrt((inverse @ inverse.T).diagonal()) / size).max())
        radius = _WIDEST / widest
        slowest = 0.5 * (1.0 + rho)
        draw = np.random.default_rng(0)
        while radius * widest > _NARROWEST:
            if all(
                self._contracts(center, inverse * radius, own[0], slowest, draw, count)
                for count in (_SCREENED, _SAMPLES)
            ):
                return Region(
                    center=center,
                    factor=factor / (_USED * radius),
                    counts=tuple(own[0].tolist()),
                    contraction=slowest,
                    samples=_SAMPLES,
                )
            radius *= 0.5
        return None

    def derivative(self, center: Array, size: Array) -> Array | None:
        """Derivative of the map by central differences, one-sided where the bodies overlap."""
        steps = _STEP * np.diag(size)
        starts = np.concatenate([center + steps, center - steps, center[None]])
        ends, _, possible = self(starts)
        count = len(center)
        both = slice(0, 2 * count)
        starts[both][~possible[both]] = center
        ends[both][~possible[both]] = ends[-1]
        width = np.abs(starts[:count] - starts[count : 2 * count]).max(axis=1)
        matrix = (
            (ends[:count] - ends[count : 2 * count]) / np.where(width > 0.0, width, 1.0)[:, None]
        ).T
        return matrix if np.isfinite(matrix).all() else None

    def _contracts(
        self,
        center: Array,
        ball: Array,
        counts: NDArray[np.int64],
        slowest: float,
        draw: np.random.Generator,
        number: int,
    ) -> bool:
        """Whether random states of the ball come nearer with the motion's impacts."""
        direction = draw.standard_normal((number, len(center)))
        direction /= np.linalg.norm(direction, axis=1)[:, None]
        # Half of them are on the surface, which decides; the others have all scales.
        scale = _INNERMOST ** draw.random(number)
        scale[::2] = 1.0
        offsets = scale[:, None] * direction
        ends, passed, possible = self(center + offsets @ ball.T)
        # States in which the bodies overlap are no starts; near a contact they lie on one side.
        if np.count_nonzero(possible) < number // 4:
            return False
        off = wrapped(ends - center, rotor=is_rotor(self.system))
        after = np.linalg.norm(off @ np.linalg.inv(ball).T, axis=1)[possible]
        return bool(
            (after <= slowest * scale[possible]).all() and (passed[possible] == counts).all()
        )


def _metric(matrix: Array, size: Array) -> Array:
    """Solve P = D + A^T P A for a matrix A whose powers vanish; D scales the coordinates."""
    scale: Array = np.diag(size**-2.0)
    count = len(matrix)
    if count > _DIRECT:
        # The sum of (A^T)^k D A^k, twice as many terms in each step.
        metric: Array = scale
        power = matrix
        while np.abs(power).max() > 0.0:
            metric = metric + power.T @ metric @ power
            power = power @ power
        return 0.5 * (metric + metric.T)
    kron = np.kron(matrix.T, matrix.T)
    solved = np.linalg.solve(np.eye(count * count) - kron, scale.ravel()).reshape(count, count)
    return 0.5 * (solved + solved.T)

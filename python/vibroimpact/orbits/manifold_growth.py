"""Growth of one side of an unstable manifold from the first piece beside its saddle.

Every point is the image of a point of the first piece, followed by simulation (`manifolds`).
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..arguments import reject
from ..simulation import simulated
from ..system import System

Array = NDArray[np.float64]

# The image of X + s_0 v must be X + lambda s_0 v to this part of s_0; if not, s_0 is reduced, at
# most to the least value, below which rounding of X dominates.
_LINEAR = 1e-3
_LEAST_OFFSET = 1e-9
# Points nearer to each other than this part of the spacing are not kept; the curve may have a
# corner of any angle there. Twice this distance is seen: corners are then cut by 3e-4 instead of
# less than 2e-4 of the plane.
_CORNER = 0.05
# Orbits with which each side begins: an image may leave and come back between its ends.
FIRST = 16
# No point is inserted between neighbours whose preimages differ by this many roundings of X.
_ROUNDINGS = 16.0
# At a break the distance stays the same although the preimages come this many times nearer.
_NEARER = 1000.0
# A side ends on its attractor when an image of the first piece is this short, relative to the
# longest one.
_COLLAPSED = 1e-4
_MOST_IMAGES = 20_000
# States kept from image to image; beyond this number they are computed again.
_MOST_KNOWN = 4_000_000
# Orbits of a side that are followed to their attractors.
_SAMPLES = 16
# Orbits followed in one call; Ctrl-C takes effect between calls.
BATCH = 256


@dataclass(frozen=True, kw_only=True)
class Limits:
    """How far and how finely a side is grown; as in ``unstable_manifold``."""

    length: float
    spacing: float
    max_angle: float
    max_points: int


@dataclass(frozen=True, kw_only=True)
class FirstPiece:
    """Points X + s v, s_0 <= s <= growth s_0, and the map that takes them away."""

    section: System
    periods: int
    saddle: Array
    direction: Array
    growth: float
    offset: float

    def orbits(self, places: ArrayLike, images: int) -> list[tuple[Array, str]]:
        """Return the images of X + s v, shape (images + 1, 4) or fewer, and why they end."""
        starts = self.saddle + np.multiply.outer(np.asarray(places), self.direction)
        found = []
        for begin in range(0, len(starts), BATCH):
            batch = starts[begin : begin + BATCH]
            runs = simulated(self.section, initial=batch, periods=self.periods * images)
            for start, run in zip(batch, runs, strict=True):
                rows = run.stroboscopic[self.periods - 1 :: self.periods]
                found.append((np.vstack((start, rows)), run.stop_reason))
        return found


def first_piece(
    section: System, m: int, saddle: Array, direction: Array, multiplier: float, offset: float
) -> FirstPiece:
    """Return the piece of the eigenvector on which the map is linear."""
    while offset >= _LEAST_OFFSET:
        starts = saddle + np.multiply.outer([offset, -offset], direction)
        runs = simulated(section, initial=starts, periods=m, keep=0)
        ends = np.array([run.final_state.state for run in runs]) - saddle
        expected = multiplier * offset * direction
        if np.abs(ends - [expected, -expected]).max() <= _LINEAR * abs(multiplier) * offset:
            flips = multiplier < 0.0
            return FirstPiece(
                section=section,
                periods=2 * m if flips else m,
                saddle=saddle,
                direction=direction,
                growth=multiplier**2 if flips else multiplier,
                offset=offset,
            )
        offset /= 10.0
    reject("motion", multiplier, "a saddle around which the map is linear, with offset >= 1e-9")


@dataclass
class Curve:
    """A side as it grows."""

    first: FirstPiece
    sign: float
    limits: Limits
    points: list[Array] = field(default_factory=list)
    breaks: list[int] = field(default_factory=list)
    length: float = 0.0
    end: str = "points"

    def __post_init__(self) -> None:
        """Place the first orbits."""
        growth, offset = self.first.growth, self.first.offset
        self._known: dict[float, tuple[Array, str]] = {}
        # The number of images until a distance of 1, and some more.
        self._images = 16 + math.ceil(-math.log(offset) / math.log(growth))
        size = max(1.0, float(np.abs(self.first.saddle).max()))
        self._finest = _ROUNDINGS * np.finfo(float).eps * size
        self._places = [offset * growth ** (i / FIRST) for i in range(FIRST + 1)]
        # The newest point, kept or not.
        self._newest: Array | None = None

    def grow(self) -> None:
        """Add image after image of the first piece, until one of the limits."""
        longest = 0.0
        for image in range(_MOST_IMAGES):
            places, reason = self._refined(image)
            states = self._states(places, image)
            begun = self.length
            for i, state in enumerate(states[:-1]):
                self._add(state, i > 0 and self._broken(places[i - 1], places[i], image))
                if self.length >= self.limits.length:
                    reason = "length"
                elif len(self.points) >= self.limits.max_points:
                    reason = "points"
                else:
                    continue
                break
            grown = self.length - begun
            longest = max(longest, grown)
            if not reason and grown < _COLLAPSED * longest:
                reason = "attractor"
            if reason:
                self.end = reason
                break
        self._keep()

    def away(self) -> list[Array | str]:
        """Return states on orbits spread over the first piece, once they are away from the saddle.

        In place of a state there may be the stop reason of the simulation.
        """
        first = self.first
        places = first.offset * first.growth ** (np.arange(_SAMPLES) / _SAMPLES)
        return [
            orbit[-1] if reason == "completed" else reason
            for orbit, reason in first.orbits(self.sign * places, self._images)
        ]

    def _add(self, state: Array, broken: bool) -> None:
        """Add a point; not all points are kept."""
        if broken:
            self._keep()
            self.breaks.append(len(self.points))
        elif self._newest is not None:
            self.length += float(np.linalg.norm(state - self._newest))
        self._newest = state
        near = _CORNER * self.limits.spacing
        if not self.points or broken or np.linalg.norm(state - self.points[-1]) > near:
            self._keep()

    def _keep(self) -> None:
        """Keep the newest point."""
        if self._newest is not None and (not self.points or self.points[-1] is not self._newest):
            self.points.append(self._newest)

    def _states(self, places: Sequence[float], image: int) -> list[Array]:
        """Return the images of these places of the first piece."""
        if image > self._images:
            self._images = 2 * image
            self._known.clear()
        missing = [place for place in places if place not in self._known]
        signed = [self.sign * place for place in missing]
        self._known.update(
            zip(missing, self.first.orbits(signed, self._images), strict=True) if missing else ()
        )
        nothing = np.full(4, np.nan)
        orbits = (self._known[place][0] for place in places)
        return [orbit[image] if image < len(orbit) else nothing for orbit in orbits]

    def _refined(self, image: int) -> tuple[list[float], str]:
        """Return places of the first piece with images close enough, and why they end early."""
        if len(self._known) * self._images > _MOST_KNOWN:
            self._known.clear()
        for _ in range(200):
            places = self._places
            states = self._states(places, image)
            lost = next((i for i, state in enumerate(states) if np.isnan(state).any()), None)
            if lost is not None:
                return places[: lost + 1], self._known[places[lost]][1]
            split = self._too_far(states, places, image)
            if not split:
                return self._resolved(places, image)
            if len(places) > self.limits.max_points:
                return places[: split[0] + 2], "points"
            middles = [math.sqrt(places[i] * places[i + 1]) for i in split]
            self._places = sorted({*places, *middles})
        return places, "resolution"

    def _too_far(self, states: list[Array], places: list[float], image: int) -> list[int]:
        """Return the segments to be split: too long, or at too sharp a turn."""
        limits = self.limits
        before = [] if self._newest is None else [self._newest]
        chain = np.array([*before, *states])
        steps = np.diff(chain, axis=0)
        sizes = np.linalg.norm(steps, axis=1)
        split = sizes > limits.spacing
        with np.errstate(all="ignore"):
            cosines = (steps[1:] * steps[:-1]).sum(axis=1) / (sizes[1:] * sizes[:-1])
        least = _CORNER * limits.spacing
        for i in np.flatnonzero(cosines < math.cos(limits.max_angle)):
            # Both sides of a sharp turn, unless it is a corner.
            split[i : i + 2] |= sizes[i : i + 2] > least
        wide = np.diff(places) > self._finest
        return [int(i) for i in np.flatnonzero(split[len(before) :] & wide)]

    def _resolved(self, places: list[float], image: int) -> tuple[list[float], str]:
        """Cut the places where neighbours are too far apart for another reason than a break."""
        for i in range(1, len(places)):
            far, torn = self._gap(places[i - 1], places[i], image)
            if far and not torn:
                return places[: i + 1], "resolution"
        return places, ""

    def _broken(self, low: float, high: float, image: int) -> bool:
        return all(self._gap(low, high, image))

    def _gap(self, low: float, high: float, image: int) -> tuple[bool, bool]:
        """Return whether neighbours are further apart than the spacing, and whether by a break.

        The images of a stretched piece come further apart with their preimages.
        """
        one, other = self._states([low, high], image)
        width = float(np.linalg.norm(other - one))
        if width <= self.limits.spacing:
            return False, False
        away = _NEARER * (high - low)
        outside = self._states([low - away, high + away], image)
        near = (np.linalg.norm(outside[0] - one), np.linalg.norm(outside[1] - other))
        return True, bool(max(near) < width)

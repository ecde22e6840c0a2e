"""Unstable manifolds of saddles on the stroboscopic section, where they are curves.

Let P be the map over the m drive periods of a motion, X its fixed point, and lambda the one
multiplier of modulus above 1, with the eigenvector v. The points that P takes away from X form a
curve through X along v. Each side of it is the union of the images

    P^k(X + s v),   s_0 <= s < |lambda| s_0,   k = 0, 1, 2, ...

up to O(s_0^2); for lambda < 0 the map is P^2 and the factor lambda^2 (J. Palis & W. de Melo,
Geometric Theory of Dynamical Systems, Springer 1982, section 2.7). Every point drawn is the image
of a point of this first piece, followed by simulation: nothing is interpolated. Where neighbours
are too far apart or the curve turns too sharply between them, a point of the first piece between
theirs is followed too (D. Hobson, J. Comput. Phys. 104 (1993) 14-22).

The curve has corners where an orbit grazes, and it is broken where an impact falls on the section.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..checks import count, number, positive, reject
from ..errors import Interrupted
from ..simulation import simulate
from ..system import System
from .motion import PeriodicMotion, reduced
from .shooting import refine, same_orbit

Array = NDArray[np.float64]

# The image of X + s_0 v must be X + lambda s_0 v to this part of s_0; if not, s_0 is made smaller,
# down to the least, below which rounding of X tells.
LINEAR = 1e-3
LEAST_OFFSET = 1e-9
# A gap beyond which bodies that swing by 1 never meet.
APART = 1e6
# Neighbours nearer than this part of the spacing may turn by any angle, a corner, and are not kept.
CORNER = 0.05
# Orbits with which each side begins: an image may leave and come back between its ends.
FIRST = 16
# Two neighbours whose preimages differ by this many roundings of X cannot be told apart further.
ROUNDINGS = 16.0
# A break stays as wide as it is while its preimages come this many times nearer.
NEARER = 1000.0
# A side ends on its attractor when an image of the first piece is this short, relative to the
# longest one.
SETTLED = 1e-4
MOST_IMAGES = 20_000
# States kept from image to image, before they are computed anew.
MOST_KNOWN = 4_000_000
# Orbits of a side that are followed to their attractors.
SAMPLES = 16
# Orbits followed in one call, between which Ctrl-C is looked for.
BATCH = 256


@dataclass(frozen=True, kw_only=True, eq=False)
class ManifoldSide:
    """One side of an unstable manifold.

    Attributes
    ----------
    points
        States x1, v1, x2, v2 on the section, from the saddle on, shape (k, 4).
    breaks
        Numbers i of the points before which the curve is broken, shape (b,): it does not join
        points i - 1 and i.
    length
        Its length in the space of (x1, v1, x2, v2), without the breaks.
    end
        Why it ends: ``length``, ``attractor`` (the curve runs into it), ``points``,
        ``resolution`` (neighbours that double precision cannot tell apart at the start have come
        further apart than the spacing), ``interrupted``, or the stop reason of a simulation.
    attractors
        Where its orbits end up, the most frequent first, from a sample of 16 on the first piece,
        through which all of them pass: stable PeriodicMotions, or the label or stop reason of a
        run that ends on none.
    """

    points: Array
    breaks: NDArray[np.int64]
    length: float
    end: str
    attractors: tuple[PeriodicMotion | str, ...]

    @property
    def attractor(self) -> PeriodicMotion | str:
        """The attractor that most of its orbits reach; ``""`` if none was followed."""
        return self.attractors[0] if self.attractors else ""

    def pieces(self) -> list[Array]:
        """Return the points between the breaks, as arrays of shape (k, 4)."""
        return np.split(self.points, self.breaks)


@dataclass(frozen=True, kw_only=True, eq=False)
class UnstableManifold:
    """The unstable manifold of a saddle on a stroboscopic section.

    Attributes
    ----------
    motion
        The saddle.
    multiplier
        Its multiplier outside the unit circle.
    section_phase
        Drive phase of the section, from that of t = 0.
    saddle
        State x1, v1, x2, v2 of the motion on the section, shape (4,).
    direction
        Unit eigenvector there, shape (4,); its largest component is positive.
    sides
        The side along ``direction`` and the one against it.
    """

    motion: PeriodicMotion
    multiplier: float
    section_phase: float
    saddle: Array
    direction: Array
    sides: tuple[ManifoldSide, ...]

    @property
    def separates(self) -> bool:
        """Whether its sides lead to different attractors: the saddle is on their basins' border.

        False also where that is not known, something reached being no periodic motion.
        """
        one, other = self.sides[0].attractors, self.sides[-1].attractors
        known = all(isinstance(found, PeriodicMotion) for found in (*one, *other))
        return bool(one and other and known) and not any(
            _same(first, second) for first in one for second in other
        )

    def __repr__(self) -> str:
        """Motion, multiplier and where the sides lead."""
        ends = " and ".join(
            ", ".join(x.label if isinstance(x, PeriodicMotion) else x for x in side.attractors)
            for side in self.sides
        )
        return (
            f"<UnstableManifold of {self.motion.label}, lambda = {self.multiplier:.6g}, to {ends}>"
        )


def unstable_manifold(
    motion: PeriodicMotion,
    *,
    length: float = 10.0,
    spacing: float = 0.02,
    max_angle: float = 0.2,
    max_points: int = 20_000,
    offset: float = 1e-6,
    section_phase: float = 0.0,
    settle: int = 2000,
) -> UnstableManifold:
    """Grow the unstable manifold of a motion with one multiplier outside the unit circle.

    Parameters
    ----------
    motion
        An admissible motion with exactly one multiplier of modulus > 1: a saddle.
    length
        Length of each side at which to stop, in the space of (x1, v1, x2, v2).
    spacing, max_angle
        Largest distance of neighbouring points, and largest angle (radians) by which the curve
        turns at a point; at a corner only the distance counts.
    max_points
        Cap on the points of each side.
    offset
        Distance s_0 from the saddle at which a side begins, on the eigenvector; made smaller where
        the map is not linear so far.
    section_phase
        Drive phase of the section, from that of t = 0, in [0, 2 pi). The motion must be in free
        flight there.
    settle
        Drive periods that the orbits of each side are given to reach their attractor, once they
        have left the saddle.

    Returns
    -------
    UnstableManifold
        Both sides, with their breaks and attractors.

    Raises
    ------
    ParameterError
        For bad input, and if the motion is no such saddle.
    Interrupted
        After Ctrl-C; ``.result`` is the manifold so far.

    Notes
    -----
    A saddle whose sides lead to different attractors lies on the border of their basins, which is
    its stable manifold.
    """
    limits = _Limits(
        length=positive("length", length),
        spacing=positive("spacing", spacing),
        max_angle=positive("max_angle", max_angle),
        max_points=count("max_points", max_points, least=2),
    )
    offset = positive("offset", offset)
    settle = count("settle", settle, least=16)
    phase = number("section_phase", section_phase)
    if not 0.0 <= phase < math.tau:
        reject("section_phase", section_phase, "a number in [0, 2 pi)")
    multiplier = _multiplier(motion)
    time = phase / motion.system.drive_frequency
    saddle = motion.trajectory([time])[0]
    direction = _eigenvector(motion, time)
    section = motion.system.replace(phase=motion.system.phase + phase)
    first = _first_piece(section, motion.m, saddle, direction, multiplier, offset)
    sides: list[ManifoldSide] = []

    def result() -> UnstableManifold:
        return UnstableManifold(
            motion=motion,
            multiplier=multiplier,
            section_phase=phase,
            saddle=saddle,
            direction=direction,
            sides=tuple(sides),
        )

    for sign in (1.0, -1.0):
        curve = _Curve(first, sign, limits)
        try:
            curve.grow()
            sides.append(curve.side(curve.end, curve.attractors(motion.system, phase, settle)))
        except KeyboardInterrupt:  # Interrupted is one
            sides.append(curve.side("interrupted", ()))
            raise Interrupted("interrupted along an unstable manifold", result()) from None
    return result()


@dataclass(frozen=True, kw_only=True)
class _Limits:
    length: float
    spacing: float
    max_angle: float
    max_points: int


@dataclass(frozen=True, kw_only=True)
class _FirstPiece:
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
            runs = simulate(self.section, initial=batch, periods=self.periods * images)
            for start, run in zip(batch, runs, strict=True):
                rows = run.stroboscopic[self.periods - 1 :: self.periods]
                found.append((np.vstack((start, rows)), run.stop_reason))
        return found


@dataclass
class _Curve:
    """A side as it grows."""

    first: _FirstPiece
    sign: float
    limits: _Limits
    points: list[Array] = field(default_factory=list)
    breaks: list[int] = field(default_factory=list)
    length: float = 0.0
    end: str = "points"

    def __post_init__(self) -> None:
        growth, offset = self.first.growth, self.first.offset
        self._known: dict[float, tuple[Array, str]] = {}
        # As many images as it takes to come to a distance of 1, and some more.
        self._images = 16 + math.ceil(-math.log(offset) / math.log(growth))
        size = max(1.0, float(np.abs(self.first.saddle).max()))
        self._finest = ROUNDINGS * np.finfo(float).eps * size
        self._places = [offset * growth ** (i / FIRST) for i in range(FIRST + 1)]
        # The newest point, kept or not.
        self._newest: Array | None = None

    def side(self, end: str, attractors: tuple[PeriodicMotion | str, ...]) -> ManifoldSide:
        points = np.array(self.points).reshape(-1, 4)
        breaks = np.array(self.breaks, dtype=np.int64)
        for array in (points, breaks):
            array.flags.writeable = False
        return ManifoldSide(
            points=points, breaks=breaks, length=self.length, end=end, attractors=attractors
        )

    def grow(self) -> None:
        """Add image after image of the first piece, until one of the limits."""
        longest = 0.0
        for image in range(MOST_IMAGES):
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
            if not reason and grown < SETTLED * longest:
                reason = "attractor"
            if reason:
                self.end = reason
                break
        self._keep()

    def attractors(
        self, system: System, phase: float, settle: int
    ) -> tuple[PeriodicMotion | str, ...]:
        """Return where orbits spread over the first piece end up, the most frequent first."""
        first = self.first
        places = first.offset * first.growth ** (np.arange(SAMPLES) / SAMPLES)
        states = [
            orbit[-1] if reason == "completed" else reason
            for orbit, reason in first.orbits(self.sign * places, self._images)
        ]
        found: list[PeriodicMotion | str] = []
        counts: list[int] = []
        for state in states:
            reached = (
                state
                if isinstance(state, str)
                else _attractor(system, first.section, phase, state, settle)
            )
            known = next((i for i, other in enumerate(found) if _same(reached, other)), len(found))
            if known == len(found):
                found.append(reached)
                counts.append(0)
            counts[known] += 1
        return tuple(found[i] for i in np.argsort(np.negative(counts), kind="stable"))

    def _add(self, state: Array, broken: bool) -> None:
        """Go on to a point; not all are kept."""
        if broken:
            self._keep()
            self.breaks.append(len(self.points))
        elif self._newest is not None:
            self.length += float(np.linalg.norm(state - self._newest))
        self._newest = state
        near = CORNER * self.limits.spacing
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
        if len(self._known) * self._images > MOST_KNOWN:
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
        least = CORNER * limits.spacing
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
        away = NEARER * (high - low)
        outside = self._states([low - away, high + away], image)
        near = (np.linalg.norm(outside[0] - one), np.linalg.norm(outside[1] - other))
        return True, bool(max(near) < width)


def _multiplier(motion: PeriodicMotion) -> float:
    """Return the multiplier outside the unit circle, of a motion that has exactly one."""
    if not isinstance(motion, PeriodicMotion):
        reject("motion", motion, "a PeriodicMotion")
    if not motion.admissible:
        reject("motion", motion, f"an admissible one; this is none: {motion.why_not}")
    outside = motion.multipliers[np.abs(motion.multipliers) > 1.0]
    if len(outside) != 1:
        reject("motion", motion, "one with exactly one multiplier outside the unit circle")
    return float(outside[0].real)


def _eigenvector(motion: PeriodicMotion, time: float) -> Array:
    """Return the unit eigenvector of the unstable multiplier on the section at ``time``.

    With d = (dx1, dx1', dx2', dt) just after an event, at which the state is y, the state at a
    given time differs by dX = dy - F dt, F the vector field after the event.
    """
    itinerary, system = motion.itinerary, motion.system
    matrix = reduced(motion.return_map, itinerary)
    values, vectors = np.linalg.eig(matrix)
    unstable = np.real(vectors[:, np.argmax(np.abs(values))])
    change = np.zeros(4)
    change[[1, 3] if itinerary.wall_at_rest else slice(None)] = unstable
    leg, passed = _leg_at(motion, time)
    if not motion.legs[leg].startswith("impact"):
        reject("section_phase", time * system.drive_frequency, "a phase in a free flight")
    for transfer in itinerary.transfer(system._compiled, motion.nodes)[:leg]:
        change = transfer @ change
    x1, v1, v2, clock = motion.nodes[leg]
    oblique = system.contact == "oblique"
    x2 = (math.sin(x1) if oblique else x1) - system.gap
    drive = math.cos(system.drive_frequency * clock + system.phase)
    damping = 2.0 * system.pendulum_damping * system.frequency_ratio
    a1 = system.moment_amplitude * drive - damping * v1 - system.frequency_ratio**2 * x1
    a2 = system.force_amplitude * drive - 2.0 * system.oscillator_damping * v2 - x2
    slope = math.cos(x1) if oblique else 1.0
    moved = np.array([change[0], change[1], slope * change[0], change[2]])
    moved -= change[3] * np.array([v1, a1, v2, a2])
    if itinerary.wall_at_rest:
        moved[2:] = 0.0
    direction: Array = _free_flow(system, passed) @ moved
    direction /= np.linalg.norm(direction)
    direction *= np.sign(direction[np.argmax(np.abs(direction))])
    return direction


def _leg_at(motion: PeriodicMotion, time: float) -> tuple[int, float]:
    """Return the leg that runs at ``time`` and the time since its start."""
    period = motion.system.drive_period
    starts = np.array(motion.clocks) * period + motion.nodes[:, 3]
    place = (time - starts[0]) % (motion.m * period)
    leg = int(np.searchsorted(starts - starts[0], place, side="right")) - 1
    return leg, float(place - (starts[leg] - starts[0]))


def _free_flow(system: System, time: float) -> Array:
    """Return the derivative of a free flight of this time, shape (4, 4)."""
    if time == 0.0:
        return np.eye(4)
    # Without load it is the flow itself, which is linear.
    free = system.replace(moment_amplitude=0.0, force_amplitude=0.0, gap=APART)
    runs = simulate(free, initial=np.eye(4), time=time)
    return np.array([run.final_state.state for run in runs]).T


def _first_piece(
    section: System, m: int, saddle: Array, direction: Array, multiplier: float, offset: float
) -> _FirstPiece:
    """Return the piece of the eigenvector on which the map is linear."""
    while offset >= LEAST_OFFSET:
        starts = saddle + np.multiply.outer([offset, -offset], direction)
        runs = simulate(section, initial=starts, periods=m, keep=0)
        ends = np.array([run.final_state.state for run in runs]) - saddle
        expected = multiplier * offset * direction
        if np.abs(ends - [expected, -expected]).max() <= LINEAR * abs(multiplier) * offset:
            flips = multiplier < 0.0
            return _FirstPiece(
                section=section,
                periods=2 * m if flips else m,
                saddle=saddle,
                direction=direction,
                growth=multiplier**2 if flips else multiplier,
                offset=offset,
            )
        offset /= 10.0
    reject("motion", multiplier, "a saddle around which the map is linear, with offset >= 1e-9")


def _attractor(
    system: System, section: System, phase: float, state: Array, settle: int
) -> PeriodicMotion | str:
    """Return where a state on the section ends up."""
    if phase > 0.0:
        left = (math.tau - phase) / system.drive_frequency
        rest = simulate(section, initial=state.tolist(), time=left)
        if rest.stop_reason not in ("completed", "rest"):
            return str(rest.stop_reason)
        state = np.array(rest.final_state.state)
    run = simulate(system, initial=state.tolist(), periods=settle, keep=min(settle, 400))
    if run.stop_reason not in ("completed", "rest"):
        return str(run.stop_reason)
    motion = refine(run)
    if isinstance(motion, PeriodicMotion) and motion.admissible and motion.stable:
        return motion
    return str(run.label)


def _same(one: PeriodicMotion | str, other: PeriodicMotion | str) -> bool:
    if isinstance(one, PeriodicMotion) and isinstance(other, PeriodicMotion):
        return same_orbit(one, other)
    return one is other or (isinstance(one, str) and one == other)

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

import numpy as np
from numpy.typing import NDArray

from ..arguments import count, number, positive, reject
from ..errors import Interrupted
from ..interruption import interruptible
from ..system import System
from .manifold import ManifoldSide, UnstableManifold, same_attractor
from .manifold_growth import Curve, Limits, first_piece
from .motion import PeriodicMotion
from .saddle import attractor_of, eigenvector, unstable_multiplier

Array = NDArray[np.float64]


@interruptible
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
    spacing
        Largest distance of neighbouring points.
    max_angle
        Largest angle in radians by which the curve turns at a point; at a corner only the distance
        counts.
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

    Examples
    --------
    >>> import vibroimpact as vi
    >>> system = vi.System(mass_ratio=0.6, frequency_ratio=2, restitution=0.8, gap=0.5,
    ...                    drive_frequency=1.8, moment_amplitude=1)
    >>> motion = vi.simulate(system, initial=(0, 0.5, 0, 0), periods=600, keep=100).refine()
    >>> branch = motion.follow(drive_frequency=(1.5, 1.8))
    >>> saddle = branch.at(drive_frequency=1.55)[0]
    >>> manifold = vi.unstable_manifold(saddle, length=0.5, settle=300)
    >>> len(manifold.sides), saddle.stability
    (2, 'unstable')
    """
    limits = Limits(
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
    multiplier = unstable_multiplier(motion)
    time = phase / motion.system.drive_frequency
    saddle = motion.trajectory([time])[0]
    direction = eigenvector(motion, time)
    section = motion.system.replace(phase=motion.system.phase + phase)
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

    curve = None
    try:
        first = first_piece(section, motion.m, saddle, direction, multiplier, offset)
        for sign in (1.0, -1.0):
            curve = Curve(first, sign, limits)
            curve.grow()
            sides.append(_side(curve, curve.end, _attractors(curve, motion.system, phase, settle)))
            curve = None
    except KeyboardInterrupt:  # Interrupted is a KeyboardInterrupt
        sides.append(_NO_SIDE if curve is None else _side(curve, "interrupted", ()))
        raise Interrupted("interrupted along an unstable manifold", result()) from None
    return result()


# A side that was not begun because of Ctrl-C.
_NO_SIDE = ManifoldSide(
    points=np.empty((0, 4)),
    breaks=np.empty(0, dtype=np.int64),
    length=0.0,
    end="interrupted",
    attractors=(),
)


def _side(curve: Curve, end: str, attractors: tuple[PeriodicMotion | str, ...]) -> ManifoldSide:
    points = np.array(curve.points).reshape(-1, 4)
    breaks = np.array(curve.breaks, dtype=np.int64)
    for array in (points, breaks):
        array.flags.writeable = False
    return ManifoldSide(
        points=points, breaks=breaks, length=curve.length, end=end, attractors=attractors
    )


def _attractors(
    curve: Curve, system: System, phase: float, settle: int
) -> tuple[PeriodicMotion | str, ...]:
    """Return the attractors that the orbits of a side reach, the most frequent first."""
    found: list[PeriodicMotion | str] = []
    counts: list[int] = []
    for state in curve.away():
        reached = (
            state
            if isinstance(state, str)
            else attractor_of(system, curve.first.section, phase, state, settle)
        )
        same = (i for i, other in enumerate(found) if same_attractor(reached, other))
        known = next(same, len(found))
        if known == len(found):
            found.append(reached)
            counts.append(0)
        counts[known] += 1
    return tuple(found[i] for i in np.argsort(np.negative(counts), kind="stable"))

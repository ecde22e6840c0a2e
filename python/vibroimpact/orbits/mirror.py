"""Mirror images of motions: -q half a drive period later.

A structure that is its own mirror image has with each motion q(t) the motion -q(t + T/2), T the
drive period: its stops are pairs with opposite normals and equal numbers, moving ones half a period
apart, and it has no constant load. The drive then changes its sign by itself. A motion may be its
own image; else its image has the same label and the same multipliers.
"""

from __future__ import annotations

import math
import string
from collections import Counter
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..simulation import simulated
from ..stop import Stop
from ..structure import Structure
from .bifurcation import Bifurcation
from .motion import SAME_ORBIT, size_of

Array = NDArray[np.float64]

# Two motions are mirror images if their coordinates agree at so many times of each drive period.
_TIMES = 16
# Images bifurcate at the same value, each located to rounding.
_SAME_VALUE = 1e-9
# Of a motion that is its own image they agree to this part of the largest one.
_MIRRORED = 1e-8


def own_mirror_image(motion: Any) -> bool:
    """Whether q(t + T/2) = -q(t) for all coordinates of a motion with the period T."""
    now, later = _halves(motion)
    apart = _apart(now, later, motion.m)
    return apart <= _MIRRORED * float(np.abs(now).max())


def is_mirror_image(one: Any, other: Any) -> bool:
    """Whether a motion is the mirror image of another one, or of itself if both are one."""
    if (one.m, one.n) != (other.m, other.n):
        return False
    now, later = _halves(one)[0], _halves(other)[1]
    return _apart(now, later, one.m) < SAME_ORBIT * size_of(one.sections)


def own_image(motion: Any) -> bool | None:
    """Whether a motion is its own mirror image; None where motions have no images."""
    return own_mirror_image(motion) if _has_images(motion.system) else None


def image_places(motions: Sequence[Any]) -> tuple[int | None, ...]:
    """Return for each motion of one machine the place of its mirror image, None for none.

    That of a motion which is its own image is its own place. A motion may be missing (None).
    """
    found: list[int | None] = [None] * len(motions)
    for place, motion in enumerate(motions):
        if motion is None or found[place] is not None or not _has_images(motion.system):
            continue
        if own_mirror_image(motion):
            found[place] = place
            continue
        for later in range(place + 1, len(motions)):
            other = motions[later]
            if other is not None and found[later] is None and is_mirror_image(motion, other):
                found[place], found[later] = later, place
                break
    return tuple(found)


def motion_names(labels: Sequence[str], motions: Sequence[Any]) -> tuple[str, ...]:
    """Return names of attractors of one machine: labels, equal ones with letters and images."""
    images = image_places(motions)
    counts = Counter(labels)
    letters = {label: iter(string.ascii_lowercase) for label in labels}
    marks = [next(letters[label], "...") if counts[label] > 1 else "" for label in labels]
    names = []
    for place, (label, mark) in enumerate(zip(labels, marks, strict=True)):
        image, motion = images[place], motions[place]
        text = f"{label} ({mark})" if mark else label
        if image is not None and image < place:
            text += f", mirror image of ({marks[image]})"
        elif image is None and motion is not None and own_image(motion) is False:
            text += ", without its mirror image"
        names.append(text)
    return tuple(names)


def earlier_images(found: Sequence[Bifurcation]) -> tuple[int | None, ...]:
    """Return for each bifurcation the place of an earlier one of its mirror image, or None."""
    known: list[int | None] = []
    for place, point in enumerate(found):
        earlier = (
            k
            for k, other in enumerate(found[:place])
            if other.kind == point.kind
            and abs(other.value - point.value) <= _SAME_VALUE * max(1.0, abs(point.value))
            and is_mirror_image(other.motion, point.motion)
            # The same bifurcation of a motion that is its own image; not if it grazes a stop first
            # on one side and then on the other one.
            and not (other.motion.legs == point.motion.legs and own_mirror_image(point.motion))
        )
        known.append(next(earlier, None))
    return tuple(known)


def _has_images(system: Any) -> bool:
    """Whether a machine is its own mirror image; a System has its one stop on one side."""
    if not isinstance(system, Structure) or system.drive_frequency == 0.0:
        return False
    load = system.static_load
    if load is not None and np.any(load):
        return False
    left = list(system.stops)
    while left:
        stop = left.pop()
        facing = next((k for k, other in enumerate(left) if _face(stop, other)), None)
        if facing is None:
            return False
        del left[facing]
    return True


def _face(one: Stop, other: Stop) -> bool:
    """Whether one of two stops is the mirror image of the other."""
    alike = all(
        getattr(one, name) == getattr(other, name)
        for name in ("gap", "restitution", "friction", "amplitude")
    )
    if not alike or not np.array_equal(one.normal, -other.normal):
        return False
    if one.friction and one.tangent is not None and other.tangent is not None:
        same = np.array_equal(one.tangent, other.tangent)
        if not same and not np.array_equal(one.tangent, -other.tangent):
            return False
    # cos(psi + pi + phase) of the one is cos(psi + phase) of the other.
    return not one.amplitude or math.cos(one.phase - other.phase) < -1.0 + 1e-15


def _halves(motion: Any) -> tuple[Array, Array]:
    """Return coordinates over an orbit, in rows of times, and those half a drive period later."""
    period = motion.system.drive_period
    times = np.arange(_TIMES * motion.m) * (period / _TIMES)
    if not isinstance(motion.system, Structure):
        now, later = (motion.trajectory(t)[:, ::2] for t in (times, times + 0.5 * period))
    elif motion.legs:
        # Coordinates are continuous: an impact at one of the times does no harm.
        now, later = (motion.trajectory(t)[:, 0] for t in (times, times + 0.5 * period))
    else:
        run = simulated(motion.system, initial=motion.state, periods=motion.m, keep=motion.m)
        end = motion.m * period
        turned = np.mod(times + 0.5 * period, end)
        now, later = (run.trajectory(t)[:, 0] for t in (times, turned))
    return now, later


def _apart(now: Array, later: Array, m: int) -> float:
    """Return the largest sum of coordinates and later ones, from the best drive period on."""
    shifts = (np.roll(later, k * _TIMES, axis=0) for k in range(m))
    return min(float(np.abs(now + shifted).max()) for shifted in shifts)

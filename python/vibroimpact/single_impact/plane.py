"""Roots of two functions of two variables isolated with a proof.

As `intervals.isolate`, in the plane: a box is dropped where an enclosure of one of the functions
excludes zero, or where Krawczyk's operator K leaves nothing of it; K inside a box proves that the
box holds exactly one root, and that a simple one (R. E. Moore, R. B. Kearfott, M. J. Cloud,
Introduction to Interval Analysis, SIAM 2009, section 8.2).
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from .intervals import EPS, Interval, join

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

# Boxes are halved so many times at most, and dropped from the search below this size.
_MAX_LEVELS = 120
_SMALLEST = 1e-9
# Largest number of boxes at a time; with more they are left undecided.
_MAX_BOXES = 20_000
# Boxes are widened by this part of themselves before K is asked to stay inside.
_WIDENED = 0.1
_REFINEMENTS = 30


class Box(NamedTuple):
    """Boxes of the plane, the two sides of shape (k,) each."""

    x: Interval
    s: Interval

    def at(self, index: Mask | NDArray[np.int64]) -> "Box":
        """Return some of the boxes."""
        return Box(self.x[index], self.s[index])

    @property
    def middle(self) -> "Box":
        """Their middles."""
        return Box(Interval(self.x.middle), Interval(self.s.middle))

    def meet(self, other: "Box") -> "Box":
        """Return the common parts."""
        return Box(self.x.meet(other.x), self.s.meet(other.s))

    @property
    def is_empty(self) -> Mask:
        """Which hold nothing; a side that is NaN may hold anything."""
        return (self.x.lo > self.x.hi) | (self.s.lo > self.s.hi)

    def inside(self, other: "Box") -> Mask:
        """Which lie in the interior of the other's."""
        held = [(one.lo > two.lo) & (one.hi < two.hi) for one, two in zip(self, other, strict=True)]
        return held[0] & held[1]

    def hull(self, other: "Box") -> "Box":
        """Return what holds both."""
        sides = zip(self, other, strict=True)
        return Box(*(Interval(np.minimum(a.lo, b.lo), np.maximum(a.hi, b.hi)) for a, b in sides))


class Pair(NamedTuple):
    """Two functions enclosed over boxes, and their derivatives by x and by s."""

    f: Interval
    g: Interval
    fx: Interval
    fs: Interval
    gx: Interval
    gs: Interval


#: Encloses the functions over boxes.
Enclosure = Callable[[Box], Pair]


@dataclass(frozen=True)
class PlaneRoots:
    """What a search finds: every root in the boxes searched is in one of these.

    Attributes
    ----------
    root
        Boxes, narrow to rounding, with exactly one root each.
    alone
        Wider boxes around them, in which there is no other.
    undecided
        Boxes that may hold any number of roots.
    """

    root: Box
    alone: Box
    undecided: Box


def _joined(boxes: list[Box]) -> Box:
    nothing = Interval(np.empty(0))
    if not boxes:
        return Box(nothing, nothing)
    return Box(join(*(box.x for box in boxes)), join(*(box.s for box in boxes)))


def krawczyk(enclose: Enclosure, box: Box, over: Pair) -> tuple[Box, Mask]:
    """Return K of boxes, and where it is defined; ``over`` are the functions over the boxes."""
    middle = box.middle
    at = enclose(middle)
    a, b, c, d = (each.middle for each in (over.fx, over.fs, over.gx, over.gs))
    with np.errstate(all="ignore"):
        det = a * d - b * c
        rows = (d / det, -b / det), (-c / det, a / det)
    offset = (box.x - middle.x, box.s - middle.s)
    sides = []
    for place, (p, q) in enumerate(rows):
        # m - C F(m) + (1 - C J) (X - m)
        rest = [
            float(place == column) - (p * one + q * two)
            for column, (one, two) in enumerate(((over.fx, over.gx), (over.fs, over.gs)))
        ]
        moved = middle[place] - (p * at.f + q * at.g)
        sides.append(moved + rest[0] * offset[0] + rest[1] * offset[1])
    image = Box(*sides)
    finite = np.logical_and.reduce([np.isfinite(side.lo + side.hi) for side in image])
    return image, finite


@np.errstate(over="ignore", invalid="ignore")
def isolate_in_plane(enclose: Enclosure, box: Box) -> PlaneRoots:
    """Find all roots of two functions in given boxes, with proof.

    Parameters
    ----------
    enclose
        Returns intervals that hold every value and derivative of both functions over boxes.
    box
        Where to search.
    """
    roots: list[Box] = []
    around: list[Box] = []
    undecided: list[Box] = []
    whole = Box(*(Interval(side.lo.min(), side.hi.max()) for side in box))
    smallest = [_SMALLEST * (1.0 + float(side.largest)) for side in whole]
    for _ in range(_MAX_LEVELS):
        if not len(box.x.lo):
            break
        over = enclose(box)
        kept = over.f.holds_zero & over.g.holds_zero
        box, over = box.at(kept), Pair(*(each[kept] for each in over))
        image, known = krawczyk(enclose, box, over)
        met = box.meet(image)
        gone = known & met.is_empty
        near = Box(
            *(
                Interval(np.where(known, m.lo, b.lo), np.where(known, m.hi, b.hi))
                for m, b in zip(met, box, strict=True)
            )
        )
        kept = ~gone
        box, near, over = box.at(kept), near.at(kept), Pair(*(each[kept] for each in over))
        image, known = image.at(kept), known[kept]
        # A root on the side of a box is inside a wider one.
        trial = np.flatnonzero(known & _is_close(image, box))
        if len(trial):
            wide = _widened(box.at(trial).hull(image.at(trial)))
            inner, defined = krawczyk(enclose, wide, enclose(wide))
            proved = defined & inner.inside(wide)
            roots.append(inner.at(proved))
            around.append(wide.at(proved))
            left = np.ones(len(known), dtype=bool)
            left[trial[proved]] = False
            near, over = near.at(left), Pair(*(each[left] for each in over))
        small = np.logical_and.reduce(
            [side.width <= least for side, least in zip(near, smallest, strict=True)]
        )
        undecided.append(near.at(small))
        near, over = near.at(~small), Pair(*(each[~small] for each in over))
        box = near
        if len(box.x.lo) > _MAX_BOXES:
            break
        box = _halves(box, over, smallest)
    if len(box.x.lo):
        undecided.append(box)
    root, alone = _refined(enclose, _joined(roots), _joined(around))
    chosen = _different(root, alone)
    return PlaneRoots(root.at(chosen), alone.at(chosen), _joined(undecided))


def _is_close(image: Box, box: Box) -> Mask:
    """Where K is no larger than its box, so that it may prove a root."""
    narrower = [one.width < two.width for one, two in zip(image, box, strict=True)]
    return narrower[0] & narrower[1]


def _widened(box: Box) -> Box:
    by = [_WIDENED * side.width + 8.0 * EPS * np.maximum(side.largest, 1e-3) for side in box]
    return Box(*(Interval(side.lo - w, side.hi + w) for side, w in zip(box, by, strict=True)))


def _halves(box: Box, over: Pair, smallest: list[float]) -> Box:
    """Halve the side along which the functions change most."""
    wide = [side.width for side in box]
    share = np.zeros(len(wide[0]))
    for by_x, by_s in ((over.fx, over.fs), (over.gx, over.gs)):
        change = by_x.largest * wide[0], by_s.largest * wide[1]
        with np.errstate(all="ignore"):
            part = change[0] / (change[0] + change[1])
        share = share + np.where(np.isfinite(part), part, 0.5)
    along = share >= 1.0
    along = np.where(wide[0] <= smallest[0], False, np.where(wide[1] <= smallest[1], True, along))
    lower, upper = [], []
    for side, mask in zip(box, (along, ~along), strict=True):
        middle = side.middle
        lower.append(Interval(side.lo, np.where(mask, middle, side.hi)))
        upper.append(Interval(np.where(mask, middle, side.lo), side.hi))
    return _joined([Box(*lower), Box(*upper)])


def _refined(enclose: Enclosure, root: Box, alone: Box) -> tuple[Box, Box]:
    """Shrink boxes with one root each to rounding."""
    for _ in range(_REFINEMENTS):
        if not len(root.x.lo):
            break
        image, known = krawczyk(enclose, root, enclose(root))
        met = root.meet(image)
        newer = Box(
            *(
                Interval(np.where(known, m.lo, r.lo), np.where(known, m.hi, r.hi))
                for m, r in zip(met, root, strict=True)
            )
        )
        done = all(bool((n.width >= 0.9 * r.width).all()) for n, r in zip(newer, root, strict=True))
        root = newer
        if done:
            break
    return root, alone


def _different(root: Box, alone: Box) -> NDArray[np.int64]:
    """Return which roots are not one of those before: a root lies where another is alone."""
    kept: list[int] = []
    for i in range(len(root.x.lo)):
        before, this = np.array(kept, dtype=np.int64), np.full(len(kept), i)
        same = root.at(this).inside(alone.at(before)) | root.at(before).inside(alone.at(this))
        if not same.any():
            kept.append(i)
    order = sorted(kept, key=lambda i: (float(root.x.lo[i]), float(root.s.lo[i])))
    return np.array(order, dtype=np.int64)

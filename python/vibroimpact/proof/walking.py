"""From a piece of a branch to the tubes that cover it: the search, of which nothing is trusted."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from flint import arb, arb_mat, arb_series
from numpy.typing import NDArray

from ..errors import ProofError
from .along import residual
from .chain import resolved
from .files import text
from .formulas import Undecided
from .near import inverse_of
from .parts import Arc, Slice
from .special import Touch
from .touching import touches_in
from .tube import TERMS, Family, Image, Tube, derivative, image

Array = NDArray[np.float64]

#: Half lengths of tubes, as a part of the length of the piece: the first, the longest, the shortest
#: for a verdict, and the shortest.
_FIRST, _LONGEST, _FINEST, _SHORTEST = 1e-3, 0.1, 1e-5, 1e-6
#: Least radius of a tube as a part of its half length, attempts at its radius, the room that K is
#: given, and the part by which tubes overlap.
_THIN, _WIDENINGS, _ROOM, _OVERLAP = 2.0**-12, 3, 1.5, 1.25
#: Steps of Newton's method, and where they end.
_STEPS, _SMALL = 12, 1e-22
#: How far outside a range points begin, as a part of a step.
_BEFORE = 0.01
#: Shorter tubes that are tried for a verdict; tubes after which it is tried again.
_TRIES, _PAUSE = 20, 6
#: Tubes beyond the last point; how far ahead it is looked for, in half lengths of a tube.
_MOST_BEYOND, _AHEAD = 8, 4.0
#: Attempts at a narrower one, and its least radius as a power of 2 of the half length.
_NARROWINGS, _NARROWEST = 2, 44
#: Part of a tube that may stay open, as about a bifurcation.
_OPEN = 0.05
#: Halvings of a part of a tube, and how many parts are halved.
_HALVINGS, _MOST_OPEN = 30, 64
#: Part of a tube that may be open after some halvings; more, where it is taken as it is.
_DARKEST, _HASTE, _PATIENCE = 0.6, 3, 12
#: Halvings after which it is asked whether what is open is about one special point.
_ASKED = 3
#: Least part of a tube that is kept.
_WORTH = 0.03


@dataclass(frozen=True)
class Step:
    """A tube, what is shown of its parts, and touches in it."""

    tube: Tube
    told: list[Slice]
    touches: list[Touch]

    def posed(self) -> dict[str, Any]:
        """As certificates write it."""
        tube = self.tube
        times = [(about.lower().mid(), about.upper().mid()) for _, _, about in self.touches]
        places = [[leg, stop] for leg, stop, _ in self.touches]
        return {
            "line": [[text(x) for x in row] for row in tube.line],
            "half": text(tube.half),
            "radius": [text(x) for x in tube.radius],
            "cuts": [text(one.hi) for one in self.told],
            "touches": [[*a, *map(text, b)] for a, b in zip(places, times, strict=True)],
        }


def parts_of(arc: Arc, lo: arb, hi: arb, patience: int) -> tuple[list[Slice], list[Touch]]:
    """Parts of a tube, and touches: what is open is halved, as long as it is little."""
    told, touches = [arc.look(lo, hi)], list[Touch]()
    for halving in range(_HALVINGS):
        left = [k for k, one in enumerate(told) if not one.known]
        dark = sum(float((told[k].hi - told[k].lo).upper()) for k in left)
        tells = dark < _DARKEST * float((hi - lo).upper()) or halving < patience
        if len(left) > _MOST_OPEN or not left or not tells:
            break
        if halving % _ASKED == _ASKED - 1:
            touches = touches_in(arc, told)
            if all(one.known for one in resolved(arc, told, touches)):
                break
        for k in reversed(left):
            begin, end = told[k].lo, told[k].hi
            middle = ((begin + end) / 2).mid()
            told[k : k + 1] = [arc.look(begin, middle), arc.look(middle, end)]
    return told, touches or touches_in(arc, told)


def cut_back(told: list[Slice]) -> list[Slice]:
    """Parts without those at the end that are open: the next tube has them in its middle."""
    kept = list(told)
    while kept and not kept[-1].known:
        kept.pop()
    kept = kept[:-1] if len(kept) < len(told) else kept
    long = bool(kept) and kept[-1].hi - told[0].lo > _WORTH * (told[-1].hi - told[0].lo)
    return kept if long and len(kept) < len(told) else told


def exact(values: Sequence[float] | Array) -> list[arb]:
    """Doubles as balls."""
    return [arb(float(x)) for x in values]


def direction_at(family: Family, y: Sequence[arb], before: Array) -> Array:
    """The unit direction of the branch, in the sense of another one."""
    size = len(y)
    matrix = inverse_of(derivative(family, exact(before), y))
    column = np.array([float(matrix[i, size - 1].mid()) for i in range(size)])
    unit: Array = column / np.linalg.norm(column)
    return unit


def corrected(family: Family, y: Sequence[arb], direction: Array) -> list[arb]:
    """The solution in the plane across the branch at y."""
    across, z, near = exact(direction), list(y), None
    for _ in range(_STEPS):
        if near is None:
            near = inverse_of(derivative(family, across, z))
        rest = family.at(z[-1]).residual(z[:-1])
        plane = sum((s * (a - b) for s, a, b in zip(across, z, y, strict=True)), arb(0))
        step = (near * arb_mat(len(z), 1, [*rest, plane])).entries()
        z = [(a - d).mid() for a, d in zip(z, step, strict=True)]
        size = max(abs(float(d.mid())) for d in step)
        if size < _SMALL:
            return z
        if size > 1e-6:
            near = None
    raise Undecided("Newton's method does not converge")


def line_through(family: Family, y: Sequence[arb], direction: Array) -> list[list[arb]]:
    """The power series of the branch about a point of it, order by order."""
    line = [list(y), exact(direction)]
    near = inverse_of(derivative(family, line[1], y))
    for k in range(2, TERMS):
        columns = zip(*line, strict=True)
        rest = residual(family.along([arb_series(list(x), TERMS) for x in columns], TERMS), TERMS)[
            k
        ]
        change = (near * arb_mat(len(y), 1, [*rest.entries(), arb(0)])).entries()
        line.append([-x.mid() for x in change])
    return line


def narrower(family: Family, tube: Tube, found: Image) -> tuple[Tube, Image]:
    """A tube as narrow as can be shown: verdicts on motions in it are then sharper."""
    for _ in range(_NARROWINGS):
        least = tube.half * arb(2) ** -_NARROWEST
        radius = [((_ROOM * abs(x)).upper() + least).mid() for x in found.away]
        inner = Tube(tube.line, tube.half, radius)
        closer = image(family, inner)
        if not closer.inside:
            break
        tube, found = inner, closer
    return tube, found


def tube_from(
    family: Family, y: Sequence[arb], direction: Array, half: float, least: float
) -> tuple[Tube, Image, float]:
    """A tube that begins at a point of the branch, as long as can be shown; K; half its length."""
    why = "Krawczyk's operator does not contract"
    while half > least:
        try:
            ahead = [a + s * arb(half) for a, s in zip(y, exact(direction), strict=True)]
            centre = corrected(family, ahead, direction)
            line = line_through(family, centre, direction_at(family, centre, direction))
            thin = arb(half * _THIN)
            radius = [thin] * len(y)
            for _ in range(_WIDENINGS):
                tube = Tube(line, arb(half * _OVERLAP), [r.mid() for r in radius])
                found = image(family, tube)
                if found.inside:
                    return *narrower(family, tube, found), half
                radius = [(_ROOM * abs(x)).upper() + thin for x in found.away]
        except (Undecided, ProofError) as reason:
            why = str(reason)
        except (ValueError, ZeroDivisionError):
            why = "a divisor may be 0"
        half /= 2
    raise Undecided(f"no tube is shown: {why}")


class Progress:
    """How far along a polygon one has come."""

    def __init__(self, points: Array) -> None:
        self.points, steps = points, np.diff(points, axis=0)
        sizes = np.linalg.norm(steps, axis=1)
        self.steps, self.sizes, self.along = steps, sizes, np.concatenate([[0.0], sizes.cumsum()])
        self.at = 0.0

    def move(self, place: Array, reach: float) -> bool:
        """Move to the nearest point within reach; whether the end is passed."""
        near = (self.along[:-1] <= self.at + reach) & (self.along[1:] >= self.at)
        away = place - self.points[:-1]
        part = np.einsum("ij,ij->i", away, self.steps) / self.sizes**2
        kept = np.clip(part, 0.0, 1.0)
        distance = np.linalg.norm(away - kept[:, None] * self.steps, axis=1)
        k = int(np.argmin(np.where(near, distance, np.inf)))
        if distance[k] > self.sizes[max(0, k - 1) : k + 2].max() + reach:
            raise Undecided("the branch leads elsewhere")
        self.at = max(self.at, float(self.along[k] + kept[k] * self.sizes[k]))
        return k == len(self.steps) - 1 and bool(part[k] > 1.0)


def cut(family: Family, points: Array, within: tuple[float, float]) -> Array:
    """Points whose first one, if it is outside a range, is near its end."""
    first = points[0, -1]
    border, step = min(max(first, within[0]), within[1]), points[1] - points[0]
    part = (border - first) / step[-1] - _BEFORE if step[-1] else 0.0
    while _BEFORE < part < 1.0:
        begin = corrected(family, exact(points[0] + part * step), step / np.linalg.norm(step))
        place = np.array([float(x) for x in begin])
        if (place[-1] - border) * (first - border) > 0.0:
            return np.vstack([place, points[1:]])
        part /= 2
    return points


def walk(family: Family, points: Array, within: tuple[float, float]) -> Iterator[Step]:
    """The tubes along points of a branch, in rows (z, p), as far as they are in a range.

    Raises
    ------
    Undecided : there is no way on
    """
    length = float(np.linalg.norm(np.diff(points, axis=0), axis=1).sum())
    points = cut(family, cut(family, points, within)[::-1], within)[::-1]
    progress = Progress(points)
    direction = points[1] - points[0]
    direction /= np.linalg.norm(direction)
    try:  # a border at the first point is shown from both sides
        y = corrected(family, exact(points[0] - _BEFORE * (points[1] - points[0])), direction)
    except (Undecided, ValueError, ZeroDivisionError):
        y = corrected(family, exact(points[0]), direction)
    direction = direction_at(family, y, direction)
    least = _SHORTEST * length
    half, longest, before, beyond = _FIRST * length, length, None, 0
    allowed = tries = _TRIES
    pause = 0
    while True:
        tube, found, half = tube_from(family, y, direction, half, least)
        lo = -tube.half if before is None else tube.place(before)
        if lo is None:
            half /= 2
            if half < least:
                raise Undecided("two tubes are not joined")
            continue
        hi = arb(half)
        arc = Arc.of(family, tube, found)
        shorter = bool(tries) and half > _FINEST * length
        told, touches = parts_of(arc, lo, hi, _HASTE if shorter else _PATIENCE)
        open_ = [one for one in resolved(arc, told, touches) if not one.known]
        dark = sum(float((one.hi - one.lo).upper()) for one in open_)
        if dark > _OPEN * half and shorter:
            longest, half, tries = half, half / 2, tries - 1
            continue
        # where the verdict stays open some longer tubes are taken as they are
        allowed = max(1, allowed // 2) if dark > _OPEN * half else _TRIES
        pause = _PAUSE if dark > _OPEN * half and tries else pause - 1
        tries = 0 if pause > 0 else allowed
        whole, told = told, cut_back(told)
        hi = told[-1].hi
        yield Step(tube, told, touches)
        before = arc.point(hi)
        direction = np.array([float(x.mid()) for x in tube.coefficients(hi, 1)])
        direction /= np.linalg.norm(direction)
        y = [x.mid() for x in before]
        place = np.array([float(x) for x in y])
        # past the last point; a border there is shown from both sides
        beyond += bool(beyond) or progress.move(place, _AHEAD * half)
        if beyond > _MOST_BEYOND or (beyond and told is whole and told[-1].known):
            return
        # a tube that was too long is tried again some time later
        longest *= 1.1
        half = min(1.5 * half, 0.8 * longest if tries else length, _LONGEST * length)

"""From a piece of a branch to the tubes that cover it: the search, of which nothing is trusted."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any

import numpy as np
from flint import arb, arb_mat, arb_series
from numpy.typing import NDArray

from ..errors import ProofError
from .chain import resolved
from .files import text
from .formulas import Undecided
from .near import inverse_of
from .parts import OPEN, Arc, Slice, multiplier
from .tube import TERMS, Family, Tube, derivative, krawczyk, residual
from .verifier import inside

Array = NDArray[np.float64]

#: Half lengths of tubes, as a part of the length of the piece: the first, the longest, the shortest
#: for a verdict, and the shortest.
_FIRST, _LONGEST, _FINEST, _SHORTEST = 1e-3, 0.25, 1e-5, 1e-6
#: Least radius of a tube as a part of its half length, attempts at its radius, the room that K is
#: given, and the part by which tubes overlap.
_THIN, _WIDENINGS, _ROOM, _OVERLAP = 2.0**-12, 3, 1.5, 1.25
#: Steps of Newton's method, and where they end.
_STEPS, _SMALL = 12, 1e-22
#: Least part of the largest change at which the parameter goes on: planes of it cost less.
_STEADY = 0.02
#: How far outside a range points begin, as a part of a step.
_BEFORE = 0.01
#: Shorter tubes that are tried for a verdict; tubes after which it is tried again.
_TRIES, _PAUSE = 20, 6
#: Tubes beyond the last point; how far ahead it is looked for, in half lengths of a tube.
_MOST_BEYOND, _AHEAD = 8, 4.0
#: Attempts at a narrower one, and its least radius as a power of 2 of the half length.
_NARROWINGS, _NARROWEST = 2, 44
#: How much longer than the one before a tube is tried, and than one that was too long.
_GROWTH, _EASE = 4.0, 1.15
#: Halvings of a part of a tube, and how many parts are halved.
_HALVINGS, _MOST_OPEN = 30, 64
#: Part of a tube that may be open after some halvings; more, where it is taken as it is.
_DARKEST, _HASTE, _PATIENCE = 0.6, 5, 12
#: Halvings after which it is asked whether what is open is about one special point.
_ASKED = 3
#: Parts about a bifurcation, as a part of that in which it is; halvings until it is found.
_ABOUT, _BISECTIONS = (2.0**-8, 2.0**-14, 2.0**-20), 40
#: Least part of a tube that is kept.
_WORTH = 0.03


@dataclass(frozen=True)
class Step:
    """A tube, what is shown of its parts, and those in which to look for a special point."""

    tube: Tube
    told: list[Slice]
    asked: list[int]

    def posed(self) -> dict[str, Any]:
        """As certificates write it."""
        tube = self.tube
        return {
            "line": [[text(x) for x in row] for row in tube.line],
            "axis": tube.axis,
            "radius": [text(x) for x in tube.radius],
            "cuts": [text(one.hi) for one in self.told],
            "asked": self.asked,
        }


def parts_of(arc: Arc, lo: arb, hi: arb, patience: int) -> list[Slice]:
    """Parts of a tube: what is open is halved, as long as it is little."""
    told = [arc.look(lo, hi)]
    for halving in range(_HALVINGS):
        left = [k for k, one in enumerate(told) if not one.known]
        dark = sum(float((told[k].hi - told[k].lo).upper()) for k in left)
        tells = dark < _DARKEST * float((hi - lo).upper()) or halving < patience
        if len(left) > _MOST_OPEN or not left or not tells:
            break
        if halving % _ASKED == _ASKED - 1 and all(one.known for one in resolved(arc, told)):
            break
        for k in reversed(left):
            begin, end = told[k].lo, told[k].hi
            middle = ((begin + end) / 2).mid()
            told[k : k + 1] = [arc.look(begin, middle), arc.look(middle, end)]
    return told


def asked_in(arc: Arc, told: list[Slice], events: Sequence[float]) -> list[int]:
    """Cut parts about bifurcations at which stability does not change; the places of these."""
    asked: list[int] = []
    for value in events:
        for k, one in enumerate(told):
            unstable = one.verdict == "proved" and one.stability == "unstable"
            if not (unstable and one.rises and one.values.contains(value)):
                continue
            for size in _ABOUT:
                near = _about(arc, one, value, (one.hi - one.lo).mid() * size)
                if near is not None:
                    ends = [one.lo, *near, one.hi]
                    told[k : k + 1] = [arc.look(a, b) for a, b in pairwise(ends)]
                    asked = [j + 2 * (j > k) for j in asked] + [k + 1]
                    break
            break
    return asked


def _about(arc: Arc, one: Slice, value: float, room: arb) -> list[arb] | None:
    """The ends of a small part about the only special point there, near a value."""
    lo, hi = one.lo, one.hi
    for _ in range(_BISECTIONS):
        middle = ((lo + hi) / 2).mid()
        before = (arc.tube.part(middle, arc.away)[-1].mid() < value) == (one.rises > 0)
        lo, hi = (middle, hi) if before else (lo, middle)
    ends = [(lo - room).mid(), (hi + room).mid()]
    if not one.lo < ends[0] < ends[1] < one.hi:
        return None
    try:
        multiplier(arc, *ends)
    except OPEN:
        return None
    return ends


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


def derivative_at(family: Family, y: Sequence[arb], axis: int) -> arb_mat:
    """DE at a point, by all unknowns."""
    line = [arb_series([x], 1) for x in y]
    *rows, _ = derivative(family.along(line, 1), 0)[0].tolist()  # of another one's plane
    return arb_mat([*rows, [arb(int(j == axis)) for j in range(len(y))]])


@dataclass(frozen=True)
class Course:
    """A point of a branch, the unit direction in units of the unknowns, and those units."""

    y: list[arb]
    direction: Array
    sizes: Array

    @classmethod
    def of(cls, family: Family, y: list[arb], before: Array, sizes: Array) -> Course:
        """The direction at a point, in the sense of another one."""
        rows = derivative_at(family, y, 0).tolist()[:-1]
        slopes = np.array([[float(x.mid()) for x in row] for row in rows])
        unit: Array = np.linalg.svd(slopes * sizes)[2][-1]
        return cls(y, unit if unit @ before > 0.0 else -unit, sizes)

    @property
    def axis(self) -> int:
        """The unknown that goes on most steadily; the parameter, if it is about as steady."""
        steady = np.abs(self.direction)
        return len(steady) - 1 if steady[-1] > _STEADY * steady.max() else int(np.argmax(steady))

    def ahead(self, length: float) -> list[arb]:
        """A point so far on, if the branch is straight."""
        steps = exact(length * self.direction * self.sizes)
        return [(x + step).mid() for x, step in zip(self.y, steps, strict=True)]


def corrected(family: Family, y: Sequence[arb], axis: int, sizes: Array) -> list[arb]:
    """The solution near a point in the plane of one of its unknowns."""
    z, near = list(y), None
    for _ in range(_STEPS):
        if near is None:
            near = inverse_of(derivative_at(family, z, axis))
        rest = family.at(z[-1]).residual(z[:-1])
        step = (near * arb_mat(len(z), 1, [*rest, arb(0)])).entries()
        z = [(a - d).mid() for a, d in zip(z, step, strict=True)]
        z[axis] = y[axis]
        moved = np.array([float(d.mid()) for d in step]) / sizes
        size = float(np.abs(moved).max())
        if size < _SMALL:
            return z
        if size > 1e-6:
            near = None
    raise Undecided("Newton's method does not converge")


def line_through(family: Family, course: Course, length: float) -> list[list[arb]]:
    """The power series of the branch about a point of it, order by order, in parts of a length."""
    y, axis = course.y, course.axis
    near, zero = inverse_of(derivative_at(family, y, axis)), [arb(0)] * (len(y) - 1)
    sense = arb(length * course.direction[axis] * course.sizes[axis])
    line = [list(y), [x.mid() for x in (near * arb_mat(len(y), 1, [*zero, sense])).entries()]]
    line[1][axis] = sense
    for k in range(2, TERMS):
        columns = zip(*line, strict=True)
        rest = residual(family.along([arb_series(list(x), k + 1) for x in columns], k + 1))[k]
        change = (near * arb_mat(len(y), 1, [*rest.entries(), arb(0)])).entries()
        line.append([-x.mid() for x in change])
        line[-1][axis] = arb(0)
    return line


def narrower(tube: Tube, away: list[arb], least: list[arb]) -> Tube:
    """A tube as narrow as can be shown: verdicts on motions in it are then sharper."""
    for _ in range(_NARROWINGS):
        pairs = zip(away, least, strict=True)
        radius = [((_ROOM * abs(x)).upper() + r).mid() for x, r in pairs]
        inner = replace(tube, radius=radius)
        closer, *_ = krawczyk(inner)
        if not inside(closer, [arb(0, r) for r in radius]):
            break
        tube, away = inner, closer
    return tube


def tube_from(family: Family, course: Course, half: float, least: float) -> tuple[Tube, float]:
    """A tube that begins at a point of the branch, as long as can be shown; half its length."""
    why = "Krawczyk's operator does not contract"
    while half > least:
        try:
            centre = corrected(family, course.ahead(half), course.axis, course.sizes)
            there = Course.of(family, centre, course.direction, course.sizes)
            line = line_through(family, there, _OVERLAP * half)
            radius = thin = exact(half * _THIN * course.sizes)
            narrowest = exact(half * 2.0**-_NARROWEST * course.sizes)
            for _ in range(_WIDENINGS):
                tube = Tube(family, line, [r.mid() for r in radius], there.axis)
                away, *_ = krawczyk(tube)
                if inside(away, [arb(0, r) for r in tube.radius]):
                    return narrower(tube, away, narrowest), half
                pairs = zip(away, thin, strict=True)
                radius = [(_ROOM * abs(x)).upper() + r for x, r in pairs]
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


def cut(family: Family, points: Array, within: tuple[float, float], sizes: Array) -> Array:
    """Points whose first one, if it is outside a range, is near its end."""
    first, last = points[0, -1], points.shape[1] - 1
    border, step = min(max(first, within[0]), within[1]), points[1] - points[0]
    part = (border - first) / step[-1] - _BEFORE if step[-1] else 0.0
    while _BEFORE < part < 1.0:
        begin = corrected(family, exact(points[0] + part * step), last, sizes)
        place = np.array([float(x) for x in begin])
        if (place[-1] - border) * (first - border) > 0.0:
            return np.vstack([place, points[1:]])
        part /= 2
    return points


def sizes_of(family: Family, points: Array) -> Array:
    """Units of the unknowns: the largest coordinate, speed, time and value of the parameter."""
    n = family.at(arb(float(points[0, -1]))).machine.size
    nodes = np.abs(points[:, :-1]).reshape(len(points), -1, 2 * n + 1)
    sizes = [nodes[..., :n].max()] * n + [nodes[..., n:-1].max()] * n + [nodes[..., -1].max()]
    found = np.array([*sizes * nodes.shape[1], np.abs(points[:, -1]).max()])
    found[found == 0.0] = 1.0
    return found


def begun(family: Family, points: Array, sizes: Array) -> Course:
    """The beginning of a branch; a border at the first point is shown from both sides."""
    step = points[1] - points[0]
    before = step / sizes
    axis = int(np.argmax(np.abs(before)))
    try:
        y = corrected(family, exact(points[0] - _BEFORE * step), axis, sizes)
    except (Undecided, ValueError, ZeroDivisionError):
        y = corrected(family, exact(points[0]), axis, sizes)
    return Course.of(family, y, before, sizes)


def walk(
    family: Family, points: Array, within: tuple[float, float], events: Sequence[float] = ()
) -> Iterator[Step]:
    """The tubes along points of a branch, in rows (z, p), as far as they are in a range.

    `events`: where bifurcations may be at which stability does not change.

    Raises
    ------
    Undecided : there is no way on
    """
    sizes = sizes_of(family, points)
    for _ in range(2):  # both ends
        points = cut(family, points, within, sizes)[::-1]
    progress, course = Progress(points / sizes), begun(family, points, sizes)
    length = float(progress.along[-1])
    least = _SHORTEST * length
    half, longest, before, beyond = _FIRST * length, length, None, 0
    allowed = tries = _TRIES
    pause = 0
    while True:
        tube, half = tube_from(family, course, half, least)
        lo = arb(-1) if before is None else tube.place(before)
        if lo is None:
            half /= 2
            if half < least:
                raise Undecided("two tubes are not joined")
            continue
        hi = arb(1 / _OVERLAP)
        arc = Arc.of(tube)
        shorter = bool(tries) and half > _FINEST * length
        told = parts_of(arc, lo, hi, _HASTE if shorter else _PATIENCE)
        open_ = [one for one in resolved(arc, told) if not one.known]
        if open_ and shorter:
            longest, half, tries = half, half / 2, tries - 1
            continue
        # where the verdict stays open some longer tubes are taken as they are
        allowed = max(1, allowed // 2) if open_ else _TRIES
        pause = _PAUSE if open_ and tries else pause - 1
        tries = 0 if pause > 0 else allowed
        whole, told = told, cut_back(told)
        hi = told[-1].hi
        ends = told is whole and told[-1].known
        yield Step(tube, told, asked_in(arc, told, events))
        before = arc.point(hi)
        ahead = np.array([float(x.mid()) for x in tube.coefficients(hi, 1)]) / sizes
        course = Course([x.mid() for x in before], ahead / np.linalg.norm(ahead), sizes)
        place = np.array([float(x) for x in course.y]) / sizes
        # past the last point; a border there is shown from both sides
        beyond += bool(beyond) or progress.move(place, _AHEAD * half)
        if beyond > _MOST_BEYOND or (beyond and ends):
            return
        # a tube that was too long is tried again some time later
        longest *= _EASE
        half = min(_GROWTH * half, 0.8 * longest if tries else length, _LONGEST * length)

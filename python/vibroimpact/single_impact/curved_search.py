"""All solutions n-1 of one system whose restitution depends on the approach velocity u.

Where r is constant they are those of that r with u in the range. On the other pieces of r(u) they
are isolated in x1 and u together (`curved`, `plane`).
"""

from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .curved import Curved
from .intervals import Interval, join
from .open_curved import curved_cuts, is_slower
from .open_phase import FIRST, is_open
from .pieces import Level, Power, Slope, pieces_of
from .plane import Box, isolate_in_plane
from .solutions import solve_many
from .starts import CLOSE, OPEN, Starts, starts_in, state_of, states_of

Array = NDArray[np.float64]

# Zero, rounded outwards a few times.
_TINY = 1e-300
# Boxes in which the fastest impacts are to be excluded are halved to this width.
_NARROW = 1e-6
# or until they are so many.
_MOST = 20_000
# So many of them are looked at again.
_FEW = 200
_NONE = Box(Interval(np.empty(0)), Interval(np.empty(0)))
AT_KNOT = "an approach velocity at a knot of the restitution"


# Beyond the range of floats an interval is the whole line, or NaN, which decides nothing.
@np.errstate(over="ignore", invalid="ignore")
def search_curved(curved: Curved, lo: float, hi: float) -> list[Starts]:
    """Find all solutions with x1 in [lo, hi]."""
    found: dict[Any, Starts] = {}
    for starts in _search(curved, lo, hi):
        # Two pieces may leave the same interval open, for the same reason.
        found.setdefault((starts.ends, *starts.states, starts.reason), starts)
    return list(found.values())


def _search(curved: Curved, lo: float, hi: float) -> Iterator[Starts]:
    levels, slopes = pieces_of(curved.system.restitution)
    whole = Interval(np.array([lo]), np.array([hi]))
    every = curved.all()
    if all(bool((part.largest <= _TINY).all()) for part in every.d):
        # The phase is open, and x1 the same for all r.
        boxes = solve_many(every, FIRST, whole.lo, whole.hi).box
        for box in (boxes[k : k + 1] for k in range(len(boxes.lo))):
            for piece in slopes:
                yield from _open_phase(curved, Box(box, _range(piece)), piece, _NONE)
                if isinstance(piece, Power) and not is_slower(curved, box, piece.beyond()):
                    yield Starts(box, [], _faster(piece))
    else:
        for piece in slopes:
            yield from _on_slope(curved, whole, piece)
            if isinstance(piece, Power):
                yield from _beyond(curved, whole, piece)
    for level in levels:
        yield from _on_level(curved, whole, level)


def _on_level(curved: Curved, whole: Interval, level: Level) -> Iterator[Starts]:
    """Find the solutions of a constant r that have an approach velocity in the range."""
    equations = curved.at(level.r)
    found = solve_many(equations, FIRST, whole.lo, whole.hi)
    for k in range(len(found)):
        box = found.box[k : k + 1]
        starts = starts_in(equations, box, state_of(found, k))
        sides = [level.side(curved.approach_velocity(state)) for state in starts.states]
        states = [state for state, side in zip(starts.states, sides, strict=True) if side > 0]
        reason = starts.reason or (AT_KNOT if 0 in sides else "")
        if starts.reason == CLOSE and level.misses(curved.speed(box, equations.rho)):
            continue
        if states or reason:
            yield Starts(box, states, reason)


def _on_slope(curved: Curved, whole: Interval, piece: Slope) -> Iterator[Starts]:
    """Find the solutions on a piece of r(u) that is not constant."""
    ends = _range(piece)
    found = isolate_in_plane(lambda box: curved.over(piece, box), Box(whole, ends))
    for k in range(len(found.root.x.lo)):
        x1, s = found.root.at(np.array([k]))
        if x1.hi < whole.lo or x1.lo > whole.hi or s.hi < ends.lo or s.lo > ends.hi:
            continue
        if s.lo <= ends.lo or s.hi >= ends.hi:
            yield Starts(x1, [], AT_KNOT)
            continue
        equations = curved.at(float(curved.system.restitution(piece.speed(s.middle))[0]))
        matrix, rhs = equations.linear(FIRST, Interval(x1.middle))
        z = np.linalg.solve(matrix.middle[0], rhs.middle[0])
        yield Starts(x1, states_of(equations, [np.concatenate([x1.middle, z])]))
    for box in _groups(found.undecided):
        # F and G have a zero, too, where the phase is open, and that is mostly no solution.
        yield from _open_phase(curved, box, piece, found.alone)


def _beyond(curved: Curved, whole: Interval, piece: Power) -> Iterator[Starts]:
    """Name the intervals of x1 in which impacts faster than the searched are not excluded."""
    speeds = piece.beyond()
    boxes = Interval(whole.lo, whole.hi)
    while len(boxes.lo):
        over = curved.enclose(boxes, speeds)
        boxes = boxes[over.f.holds_zero & over.g.holds_zero]
        if not 0 < len(boxes.lo) < _MOST or boxes.width.max() <= _NARROW:
            break
        middle = boxes.middle
        boxes = join(Interval(boxes.lo, middle), Interval(middle, boxes.hi))
    if len(boxes.lo) < _FEW:
        slow = [is_slower(curved, boxes[k : k + 1], speeds) for k in range(len(boxes.lo))]
        boxes = boxes[~np.array(slow, dtype=bool)]
    for box in _groups(Box(boxes, Interval(np.zeros(len(boxes.lo))))):
        yield Starts(box.x, [], _faster(piece))


def _range(piece: Slope) -> Interval:
    low, high = piece.ends
    return Interval(np.array([low]), np.array([high]))


def _faster(piece: Power) -> str:
    return f"approach velocities above {piece.speed(np.array(piece.ends[1])):.3g}"


def _open_phase(curved: Curved, box: Box, piece: Slope, known: Box) -> Iterator[Starts]:
    """Find the solutions in a box of x1 and s in which the phase may be open."""
    solutions, undecided = curved_cuts(curved, *box, piece)
    low, high = piece.ends
    for one in solutions:
        s = float(one[6])
        near = 1e-12 * (1.0 + abs(s))
        point = Box(Interval(one[:1]), Interval(one[6:]))
        if s < low - near or s > high + near or bool(point.inside(known).any()):
            continue
        if min(s - low, high - s) <= near:
            yield Starts(box.x, [], AT_KNOT)
            continue
        equations = curved.at(float(curved.system.restitution(float(piece.speed(one[6])))))
        yield Starts(box.x, states_of(equations, [one[:6]]))
    if undecided:
        x1 = float(box.x.middle[0])
        equations = curved.at(float(curved.system.restitution(piece.speed(box.s.middle))[0]))
        yield Starts(box.x, [], OPEN if is_open(equations, x1) else CLOSE)


def _groups(boxes: Box) -> list[Box]:
    """Return boxes that cover the given ones, those that meet in x1 in one."""
    parts: list[list[float]] = []
    sides = (boxes.x.lo, boxes.x.hi, boxes.s.lo, boxes.s.hi)
    for lo, hi, low, high in sorted(zip(*(side.tolist() for side in sides), strict=True)):
        if parts and lo <= parts[-1][1]:
            parts[-1][1:] = max(parts[-1][1], hi), min(parts[-1][2], low), max(parts[-1][3], high)
        else:
            parts.append([lo, hi, low, high])
    ends = [[np.array([end]) for end in part] for part in parts]
    return [Box(Interval(lo, hi), Interval(low, high)) for lo, hi, low, high in ends]

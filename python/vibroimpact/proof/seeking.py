"""Search for special points of a branch: boxes that special.py judges."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import asdict
from typing import Any

import numpy as np
from flint import arb, arb_mat
from numpy.typing import NDArray

from .chain import located
from .files import text
from .formulas import Undecided
from .special import SINGULAR, Special
from .tube import Family, Slice, Tube, near_inverse

Array = NDArray[np.float64]

#: Steps of Newton's method, and where they end.
_STEPS, _SMALL = 10, 1e-22
#: Boxes that are tried, as multiples of the arc in which the point lies.
_ROOMS = (1.5, 6.0, 24.0)
#: Times of a flight at which a graze is looked for.
_TIMES = 400


def posed_special(
    family: Family, tubes: Sequence[Tube], kind: str, arc: Sequence[Slice]
) -> dict[str, Any] | None:
    """The certificate of the only special point on an arc, if one is shown."""
    for special, start in _candidates(family, kind, arc):
        try:
            point = _refined(family, special, start)
        except (Undecided, ValueError, ZeroDivisionError):
            continue
        size = len(arc[0].box)
        away = [max(abs(one.box[i] - point[i]).upper() for one in arc) for i in range(size)]
        away += [max(away)] * (len(point) - size)
        for room in _ROOMS:
            radius = [(room * x).mid() + arb(2) ** -60 for x in away]
            box = [x + arb(0, r) for x, r in zip(point, radius, strict=True)]
            try:
                located(family, tubes, special, box)
            except Undecided:
                continue
            pairs = zip(point, radius, strict=True)
            return {**asdict(special), "box": [[text(x), text(r)] for x, r in pairs]}
    return None


def _candidates(
    family: Family, kind: str, arc: Sequence[Slice]
) -> Iterator[tuple[Special, list[arb]]]:
    """Special points that may lie on an arc, and where they are looked for."""
    middle = [x.mid() for x in arc[len(arc) // 2].box]
    if kind in SINGULAR:
        yield Special(kind), middle
        return
    ends = [[x.mid() for x in one.box] for one in (arc[0], arc[-1])]
    flights = [family.at(y[-1]).flights(y[:-1]) for y in ends]
    for leg, (first, last) in enumerate(zip(*flights, strict=True)):
        pairs = zip(first.conditions, last.conditions, strict=True)
        for place, ((a, _), (b, _)) in enumerate(pairs):
            if (place >= 2) == (kind == "regime_border") and a * b < 0:
                yield Special(kind, leg, condition=place), middle
    if kind == "grazing":
        touches = []
        for leg in range(len(family.legs)):
            for stop, time, gap in _nearest(family, middle, leg):
                touches.append((abs(gap), leg, stop, time))
        for _, leg, stop, time in sorted(touches)[:2]:
            yield Special(kind, leg, stop=stop), [*middle, arb(time)]


def _nearest(family: Family, y: Sequence[arb], leg: int) -> list[tuple[int, float, float]]:
    """Stops, times, and gaps, where these have maxima inside a flight."""
    orbit = family.at(y[-1])
    machine, flight, found = orbit.machine, orbit.flights(y[:-1])[leg], []
    step = (flight.duration / _TIMES).mid()
    pass_on, w, gaps = machine.flow(step), flight.start, []
    for _ in range(_TIMES - 1):
        w = arb_mat(w.nrows(), 1, [x.mid() for x in (pass_on * w).entries()])
        gaps.append([float(stop.gap(w.entries()).mid()) for stop in machine.stops])
    for stop, values in enumerate(np.array(gaps).T):
        inner = (values[1:-1] > values[:-2]) & (values[1:-1] >= values[2:])
        for k in np.flatnonzero(inner):
            found.append((stop, float(step) * (int(k) + 2), float(values[k + 1])))
    return found


def _refined(family: Family, special: Special, start: Sequence[arb]) -> list[arb]:
    """The special point near a start."""
    x = list(start)
    for _ in range(_STEPS):
        values, slopes = special.equations(family, x)
        step = (near_inverse(slopes) * arb_mat(len(x), 1, values)).entries()
        x = [(a - d).mid() for a, d in zip(x, step, strict=True)]
        if max(abs(float(d.mid())) for d in step) < _SMALL:
            return x
    raise Undecided("Newton's method does not converge")

"""Special points of a branch: where a multiplier crosses the unit circle, or a condition ends.

Each is a zero of a test function f: |lambda|^2 - 1, a condition of a motion, or how far a flight
stays from a stop. Along the branch dY/dh is known, and with it f'. If f' is not 0 on a part, and
Newton's step h - f(h)/f' from a point of it leads into it for all f' there, it has one zero of f.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial

from flint import acb, acb_mat, arb

from .along import Leg, return_map, term
from .formulas import Number, Refuted, Undecided
from .near import null_vectors
from .parts import OPEN, Arc, Special, conditions
from .tube import Family
from .verifier import CIRCUIT, Flight, Orbit, show_clear

#: A test function along a line: f and f'.
Test = Callable[[Sequence[Number]], tuple[arb, arb]]
#: A flight that nearly touches a stop inside: its leg, the stop, and the time since its start.
Touch = tuple[int, int, arb]
#: Steps of Newton's method, each in the part that the one before leads to.
_STEPS = 6


def only_zero(arc: Arc, test: Test, lo: arb, hi: arb) -> arb:
    """The parameter at the only zero of f from h = lo to hi; raises Undecided if that is open."""
    found: arb | None = None
    for _ in range(_STEPS):
        line, h = arc.line(lo, hi), ((lo + hi) / 2).mid()
        near, slope = arc.line(h, h), test(line)[1]
        place = h - test(near)[0] / slope
        if lo < place < hi:
            found, lo, hi = near[-1][0] + line[-1][1] * (place - h), place.lower(), place.upper()
        elif found is None:
            raise Undecided("a test function may have no zero, or several")
    assert found is not None
    return found


def multiplier(arc: Arc, lo: arb, hi: arb) -> Special:
    """Where the only multiplier, or conjugate pair, that meets the unit circle crosses it."""
    over, _ = return_map(arc.family.along(arc.line(lo, hi), 2), 2)
    discs = acb_mat(over).eig(multiple=True)
    met = [x for x in discs if not (abs(x) < 1 or abs(x) > 1)]
    crossing = max(met, key=lambda x: float(x.imag.mid()))
    if len(met) == 1:  # the only one in a disc about a real number, of a real matrix: it is real
        crossing = acb(crossing.real)
        others = [x for x in discs if x is not met[0]]
        apart = acb(crossing.real, arb(0, met[0].imag.abs_upper()))
        kind = {1: "saddle_node", -1: "period_doubling"}[int(crossing.real.mid() > 0) * 2 - 1]
    else:
        others, apart, kind = [x for x in discs if x is not crossing], crossing, "neimark_sacker"
        if len(met) > 2 or not crossing.imag > 0:
            raise Undecided("several multipliers meet the unit circle")
    if any(apart.overlaps(x) for x in others):
        raise Undecided("multipliers are not told apart")

    def test(line: Sequence[Number]) -> tuple[arb, arb]:
        matrix, change = map(acb_mat, return_map(arc.family.along(line, 2), 2))
        (found,) = [x for x in matrix.eig(multiple=True) if x.overlaps(apart)]
        found = acb(found.real) if len(met) == 1 else found
        # (J - x) v = 0 = w (J - x): with a border of any two vectors, a regular matrix
        size, (row, column) = matrix.nrows(), null_vectors(matrix, found)
        bordered = acb_mat(size + 1, size + 1)
        for i in range(size):
            for j in range(size):
                bordered[i, j] = matrix[i, j] - (found if i == j else 0)
            bordered[i, size], bordered[size, i] = column[i], row[i]
        last = acb_mat([[int(i == size)] for i in range(size + 1)])
        v, w = (x.solve(last).entries()[:size] for x in (bordered, bordered.transpose()))
        v_, w_ = acb_mat(size, 1, v), acb_mat(1, size, w)
        slope = (w_ * change * v_)[0, 0] / (w_ * v_)[0, 0]
        return abs(found) ** 2 - 1, 2 * (found.conjugate() * slope).real

    value = only_zero(arc, test, lo, hi)
    return Special(kind, value, all(abs(x) < 1 for x in discs if not any(x is y for y in met)))


def border(arc: Arc, lo: arb, hi: arb, touches: Sequence[Touch]) -> Special:
    """Where the only condition that may be 0 is 0, or a flight touches a stop."""
    line = arc.line(lo, hi)
    open_ = [k for k, x in enumerate(conditions(arc.family, line)) if not term(x[0], 0) > 0]
    if len(open_) == 1:
        kind, used = conditions(arc.family, line)[open_[0]][2], list[Touch]()

        def test(line: Sequence[Number]) -> tuple[arb, arb]:
            number = conditions(arc.family, line)[open_[0]][0]
            return term(number, 0), term(number, 1)

    elif not open_ and len(touches) == 1:
        kind, used, test = "grazing", list(touches), partial(distance, arc.family, touches[0])
    else:
        raise Undecided("several borders")
    return Special(kind, only_zero(arc, test, lo, hi), _clear(arc, lo, hi, used))


def distance(family: Family, touch: Touch, line: Sequence[Number]) -> tuple[arb, arb]:
    """How far a flight stays from a stop about a time, -g at its maximum there; and derivative."""
    (k, number, about), orbit = touch, family.at(line[-1])
    stop = orbit.machine.stops[number]

    def gap(time: arb, order: int) -> Number:
        return stop.gap(Leg.of(orbit, k, line[:-1], 2, until=time).last, order)

    bend, (begin, end) = term(gap(about, 2), 0), (about.lower(), about.upper())
    if not (bend < 0 and term(gap(begin, 1), 0) > 0 and term(gap(end, 1), 0) < 0):
        raise Undecided("the gap may have no maximum, or several")
    middle = about.mid()
    top = (middle - term(gap(middle, 1), 0) / bend).intersection(about)
    # at the maximum dg/dt = 0
    return -term(gap(top, 0), 0), -term(gap(about, 0), 1)


def _clear(arc: Arc, lo: arb, hi: arb, touches: Sequence[Touch]) -> bool:
    """Whether no flight of a part meets a stop, but for touches."""
    box = arc.tube.part(lo.union(hi), arc.away)
    orbit = arc.family.at(box[-1])
    machine = orbit.machine
    try:
        for k, flight in enumerate(orbit.flights(box[:-1])):
            begin, end, whole = arb(0), flight.duration, (orbit.legs[k - 1], orbit.legs[k])
            parts = [(begin, end, *whole)]
            for _, number, about in [x for x in touches if x[0] == k]:
                between = machine.flow(about) * flight.start
                for j, stop in enumerate(machine.stops):
                    if j != number and not stop.gap(between.entries()) < 0:
                        return False
                parts = [(begin, about.lower(), whole[0], CIRCUIT)]
                parts += [(about.upper(), end, CIRCUIT, whole[1])]
            for start, until, first, last in parts:
                w = machine.flow(start) * flight.start
                piece = Flight(w, until - start, flight.after, flight.slopes, flight.conditions)
                show_clear(Orbit(machine, 1, (first, last)), 1, piece)
    except (*OPEN, Refuted):
        return False
    return True

"""Linear motion z' = G z in ball arithmetic: matrix exponentials, no eigenvectors.

z = (q, q', 1, cos omega t, sin omega t) of model.py, G that of the free motion or of one in contact
(hold.py). Damping of any kind, resonance, rigid bodies and critical damping are no special cases.

A state is found in two steps. Powers exp(2^k h G) of one short step h, squared one from the other,
lead to the last multiple of h; a Taylor series leads on from there, with a bound of its remainder:
||e^{sG} - sum_{k<n} (sG)^k/k!|| <= (s||G||)^n/n! e^{s||G||}. A row r times z has the Taylor
coefficients r G^k z/k!, with which contact.py finds its first rise through 0, with proof.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

from flint import arb, arb_mat, ctx, fmpq

from ..flight import Value, ball, rational

#: Share of 1/||G|| that one step h is at most.
_SHORT = 16


@dataclass(frozen=True)
class Generator:
    """A matrix G of a structure with `size` coordinates, its bounds, and powers of exp(hG)."""

    matrix: arb_mat
    size: int
    _powers: dict[int, list[arb_mat]] = field(default_factory=dict, repr=False)
    _taylor: dict[tuple[int, int, int], tuple[arb_mat, arb_mat]] = field(
        default_factory=dict, repr=False
    )
    _bounds: list[float] = field(default_factory=list, repr=False)

    def norm(self) -> float:
        """Bound of the maximum norm of G."""
        return self._found()[0]

    def rate(self) -> float:
        """Bound on the relative rate of change of (scale q, q') and of the drive."""
        return self._found()[1]

    def scale(self) -> float:
        """The factor of q in the norm that belongs to `rate`."""
        return self._found()[2]

    def load(self) -> float:
        """Bound of the acceleration by loads and moving stops: the last three columns."""
        return self._found()[3]

    def step(self) -> fmpq:
        """The step h: a power of two."""
        shortest = fmpq(1, _SHORT)
        while float(shortest) * self.norm() * _SHORT > 1:
            shortest /= 2
        return shortest

    def power(self, k: int) -> arb_mat:
        """The matrix exp(2^k h G)."""
        powers = self._powers.setdefault(ctx.prec, [])
        if not powers:
            powers.append((self.matrix * arb(self.step())).exp())
        while len(powers) <= k:
            powers.append(powers[-1] * powers[-1])
        return powers[k]

    def rows(self, row: arb_mat, order: int) -> arb_mat:
        """The rows r G^k/k!, k = 0 ... order."""
        key = (id(row), order, ctx.prec)
        if key not in self._taylor:
            made, term = arb_mat(order + 1, row.ncols()), row
            for k in range(order + 1):
                if k:
                    term = term * self.matrix * (arb(1) / k)
                for j in range(row.ncols()):
                    made[k, j] = term[0, j]
            self._taylor[key] = row, made  # the row is kept, so that no other one has its id
        return self._taylor[key][1]

    def _found(self) -> list[float]:
        """norm, rate, scale, load; sums of upper bounds, rounded up by a part in a million."""
        if not self._bounds:
            n, width = self.size, self.matrix.nrows()
            size = [
                [float(abs(self.matrix[i, j]).upper()) for j in range(width)] for i in range(width)
            ]
            stiff, damp = (
                max(sum(size[n + i][offset : offset + n]) for i in range(n)) for offset in (0, n)
            )
            scale = max(stiff**0.5, 0.25)
            omega = size[width - 1][width - 2]
            up = 1 + 1e-6
            norm = max(map(sum, size)) * up
            rate = max(scale, stiff / scale + damp, omega) * up
            load = max(sum(size[n + i][2 * n :]) for i in range(n)) * up
            self._bounds.extend([norm, rate, scale, load])
        return self._bounds


class Flow:
    """The motion z(t) from z(0) = `start` under a generator; of several columns at a time."""

    def __init__(self, generator: Generator, start: arb_mat) -> None:
        self.generator, self.start = generator, start
        self._states: dict[tuple[int, fmpq], arb_mat] = {}
        self._wide: dict[tuple[int, fmpq, fmpq], arb_mat] = {}

    def state(self, t: Value) -> arb_mat:
        """Enclosure of z(t), t >= 0."""
        if not isinstance(t, arb):
            key = (ctx.prec, t)
            if key not in self._states:
                self._states[key] = self._reach(t, ball(t))
            return self._states[key]
        return self._reach(rational(t.mid()), t)

    def _reach(self, near: fmpq, t: arb) -> arb_mat:
        """State at `t`, from the last multiple of the step before `near`."""
        generator = self.generator
        step = generator.step()
        count = max(int((near / step).floor()), 0)
        state, k = self.start, 0
        left, place = t - arb(step) * count, count
        while place:
            if place & 1:
                state = generator.power(k) * state
            place >>= 1
            k += 1
        return self._series(state, left)

    def _series(self, state: arb_mat, s: arb) -> arb_mat:
        """exp(sG) times a state for short s."""
        matrix, total, term = self.generator.matrix, state, state
        small = abs(s).upper() * self.generator.norm()
        if small == 0:
            return total
        biggest = arb(0)
        for entry in state.entries():
            biggest = biggest.max(abs(entry).upper())
        goal, bound, k = arb(2) ** -(ctx.prec + 8), arb(1), 0
        while not bound < goal:
            k += 1
            bound = (bound * small / k).upper()
            if bound < goal:
                break
            term = matrix * term * (s / k)
            total = total + term
        blur = arb(0, (bound * small.exp() * biggest).upper())
        return total + _filled(total.nrows(), total.ncols(), blur)

    def wide(self, centre: fmpq, h: fmpq) -> arb_mat:
        """Enclosure of z(t) for all |t - centre| <= h.

        With y = (scale q, q') it is |y'| <= rate |y| + load in the maximum norm, so that y changes
        by at most (exp(rate h) - 1) (|y| + load/rate) (Gronwall).
        """
        key = (ctx.prec, centre, h)
        if key not in self._wide:
            generator, n = self.generator, self.generator.size
            state = self.state(centre)
            scale, rate = arb(generator.scale()), arb(generator.rate())
            size = arb(0)
            for i in range(n):
                size = size.max((scale * abs(state[i, 0])).upper()).max(
                    abs(state[n + i, 0]).upper()
                )
            growth = (rate * arb(h)).expm1()
            reach = (growth * (size + arb(generator.load()) / rate)).upper()
            blur = [arb(0, (reach / scale).upper())] * n + [arb(0, reach)] * n
            turn = arb(0, growth.upper())
            blur += [arb(0), turn, turn]
            self._wide[key] = state + arb_mat(2 * n + 3, 1, blur)
        return self._wide[key]


class Watched:
    """A row times z along a flow: a gap, a force or a velocity, for the search of contact.py."""

    quick = True

    def __init__(self, flow: Flow, row: arb_mat) -> None:
        self.flow, self.row = flow, row
        self.rate = flow.generator.rate()

    def gap(self, t: Value) -> arb:
        """Value at time `t`."""
        return (self.row * self.flow.state(t))[0, 0]

    def velocity(self, t: Value) -> arb:
        """Derivative at time `t`."""
        return (self.flow.generator.rows(self.row, 1) * self.flow.state(t))[1, 0]

    def gap_series(self, centre: fmpq, h: fmpq, order: int) -> list[arb]:
        """Taylor coefficients about `centre`, the last one sound within `h` of it."""
        rows = self.flow.generator.rows(self.row, order)
        series: list[arb] = list((rows * self.flow.state(centre)).entries())
        if h != 0:
            series[-1] = (rows * self.flow.wide(centre, h))[order, 0]
        return series


def _filled(rows: int, columns: int, value: arb) -> arb_mat:
    return arb_mat(rows, columns, [value] * (rows * columns))


def vector(state: arb_mat, start: int, stop: int) -> tuple[arb, ...]:
    """Some entries of a column."""
    return tuple(state[i, 0] for i in range(start, stop))


def column(values: Sequence[arb]) -> arb_mat:
    """A column of balls."""
    return arb_mat(len(values), 1, list(values))

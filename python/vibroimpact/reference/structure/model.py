"""A linear structure with rigid stops as exact numbers, and its equations as matrices.

As on the structures page:
    M q'' + C q' + K q = c + Re(F e^{i(omega t + phase)}) - sum_j (n_j p_j - t_j f_j),
    g_j = n_j . q - gap_j - A_j cos(omega t + phase_j) <= 0.
In z = (q, q', 1, cos omega t, sin omega t) the free motion is z' = G z with a constant G, each gap,
its rate and each velocity of slip a row times z, and a force on a stop a column added to z'.
Whether two stops see each other, and whether a set of them is independent, is decided exactly, in
rationals. All inputs are exact: a float64 stands for its bits.

Modal damping needs no eigenvectors: with L = M^-1 K, its eigenvalues l_i = w_i^2 enclosed and their
multiplicities known exactly, C = M sum_i 2 zeta_i w_i prod_{k != i} (L - l_k)/(l_i - l_k).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, TypeVar, cast, get_args

from flint import acb, arb, arb_mat, ctx, fmpq, fmpq_mat

from ..flight import Curve, Number, exact
from ..impact import Law
from ..restitution import curve_of, restitution_at

T = TypeVar("T")
#: Part of the largest eigenvalue of M^-1 K below which one is a rigid-body mode, to rounding.
RIGID = 1e-12
#: How stops that act at one instant are resolved.
RULES = ("stop", "sequence", "together")


@dataclass(frozen=True)
class Stop:
    """A rigid one-sided contact; `tangent` None: without friction."""

    normal: fmpq_mat
    gap: fmpq
    restitution: fmpq
    friction: fmpq
    tangent: fmpq_mat | None
    amplitude: fmpq
    phase: fmpq
    #: r(u) in place of the number, which is then that of the lowest impacts.
    curve: Curve | None = None

    @classmethod
    def parse(cls, values: Mapping[str, Any], size: int) -> Stop:
        """From a mapping with the names of `Structure.parse`."""
        friction = exact(values.get("friction", 0))
        given = values["restitution"]
        curve = curve_of(given) if isinstance(given, Mapping) else None
        tangent = values.get("tangent")
        if friction != 0 and tangent is None:
            raise ValueError("a stop with friction needs a tangent")
        return cls(
            _row(values["normal"], size),
            exact(values["gap"]),
            exact(given) if curve is None else curve.lowest,
            friction,
            None if friction == 0 else _row(cast("Sequence[Number]", tangent), size),
            exact(values.get("amplitude", 0)),
            exact(values.get("phase", 0)),
            curve,
        )

    def restitution_at(self, u: arb) -> arb:
        """The coefficient of restitution at the approach velocity u."""
        return arb(self.restitution) if self.curve is None else restitution_at(self.curve, u)

    def rows(self) -> list[fmpq_mat]:
        """The normal, and the tangent if there is friction."""
        return [self.normal] if self.tangent is None else [self.normal, self.tangent]


@dataclass(frozen=True)
class Structure:
    """Matrices, loads and stops; `damping` or else `ratios` of the modes."""

    mass: fmpq_mat
    stiffness: fmpq_mat
    damping: fmpq_mat | None
    ratios: tuple[fmpq, ...] | None
    load: tuple[fmpq, ...]
    drive: tuple[tuple[fmpq, fmpq], ...]
    omega: fmpq
    phase: fmpq
    stops: tuple[Stop, ...]
    law: Law = "poisson"
    simultaneous: str = "stop"
    _cache: dict[tuple[str, int], Any] = field(default_factory=dict, compare=False, repr=False)

    @classmethod
    def parse(cls, values: Mapping[str, Any]) -> Structure:
        """From a mapping; numbers as `exact` takes them, matrices as nested sequences.

        Names: mass, stiffness (N, N); damping (N, N) or damping_ratios (N,), in the order of
        ascending frequency; static_load (N,); drive_amplitude (N,), complex or pairs of real and
        imaginary part; drive_frequency, phase; law; simultaneous; stops, each a mapping with
        normal (N,), gap, restitution (a number, or the fields of a curve) and perhaps friction,
        tangent (N,), amplitude, phase.

        Raises
        ------
        ValueError : sizes that do not fit, a mass matrix that is singular, friction without a
            tangent, both kinds of damping, an unknown law or rule
        """
        mass = _square(values["mass"])
        size = mass.nrows()
        if mass.det() == 0:
            raise ValueError("the mass matrix is singular")
        damping, ratios = values.get("damping"), values.get("damping_ratios")
        if damping is not None and ratios is not None:
            raise ValueError("damping and damping_ratios exclude each other")
        drive = values.get("drive_amplitude")
        load = values.get("static_load")
        rule = values.get("simultaneous", "stop")
        if rule not in RULES:
            raise ValueError(f"simultaneous is {rule!r}, not one of {', '.join(RULES)}")
        law = values.get("law", "poisson")
        if law not in get_args(Law):
            raise ValueError(f"law is {law!r}, not one of {', '.join(get_args(Law))}")
        made = cls(
            mass,
            _square(values["stiffness"]),
            None if damping is None else _square(damping),
            None if ratios is None else tuple(map(exact, ratios)),
            tuple(map(exact, [0] * size if load is None else load)),
            tuple(map(_complex, [0] * size if drive is None else drive)),
            exact(values.get("drive_frequency", 0)),
            exact(values.get("phase", 0)),
            tuple(Stop.parse(stop, size) for stop in values["stops"]),
            law,
            rule,
        )
        lengths = {made.stiffness.nrows(), len(made.load), len(made.drive)}
        lengths |= {size if made.damping is None else made.damping.nrows()}
        lengths |= {size if made.ratios is None else len(made.ratios)}
        if lengths != {size}:
            raise ValueError(f"matrices and vectors of {size} and {lengths} coordinates")
        return made

    @property
    def size(self) -> int:
        """Number of coordinates, N."""
        return int(self.mass.nrows())

    @property
    def width(self) -> int:
        """Length of z."""
        return 2 * self.size + 3

    def compliance(self) -> fmpq_mat:
        """The inverse of M, exactly."""
        return self._kept("compliance", 0, self.mass.inv)

    def coupling(self, row: fmpq_mat, other: fmpq_mat) -> fmpq:
        """The product row M^-1 other, exactly."""
        return (row * self.compliance() * other.transpose())[0, 0]

    def sees(self, i: int, j: int) -> bool:
        """Whether an impulse in one of two stops changes a velocity in the other."""
        return any(
            self.coupling(row, other) != 0
            for row in self.stops[i].rows()
            for other in self.stops[j].rows()
        )

    def damping_balls(self) -> arb_mat:
        """The damping matrix C at the present precision."""
        if self.damping is not None:
            return arb_mat(self.damping)
        if self.ratios is None or not any(self.ratios):
            return arb_mat(self.size, self.size)
        return self._kept("damping", ctx.prec, self._modal_damping)

    def free(self) -> arb_mat:
        """The matrix G of the free motion at the present precision."""
        return self._kept("free", ctx.prec, self._free)

    def gap_row(self, j: int) -> arb_mat:
        """The row of g_j: cos(omega t + phase_j) is written in cos omega t and sin omega t."""
        stop, row, n = self.stops[j], arb_mat(1, self.width), self.size
        for i in range(n):
            row[0, i] = arb(stop.normal[0, i])
        sine, cosine = arb(stop.phase).sin_cos()
        row[0, 2 * n] = -arb(stop.gap)
        row[0, 2 * n + 1] = -arb(stop.amplitude) * cosine
        row[0, 2 * n + 2] = arb(stop.amplitude) * sine
        return row

    def rate_row(self, j: int) -> arb_mat:
        """The row of g_j'; at an impact that is the approach velocity u."""
        return self.gap_row(j) * self.free()

    def slip_row(self, j: int) -> arb_mat:
        """The row of the velocity of slip, t . q'."""
        row, tangent = arb_mat(1, self.width), self.stops[j].tangent
        assert tangent is not None
        for i in range(self.size):
            row[0, self.size + i] = arb(tangent[0, i])
        return row

    def push(self, row: fmpq_mat) -> arb_mat:
        """The column in z' of a unit force along a row: M^-1 row in the velocities."""
        column, change = arb_mat(self.width, 1), self.compliance() * row.transpose()
        for i in range(self.size):
            column[self.size + i, 0] = arb(change[i, 0])
        return column

    def exact_gap(self, j: int, q: Sequence[fmpq]) -> fmpq | None:
        """The gap g_j at t = 0 if it is known to be rational, else None."""
        stop = self.stops[j]
        if stop.amplitude != 0 and stop.phase != 0:
            return None
        return _dot(stop.normal, q) - stop.gap - stop.amplitude

    def exact_rate(self, j: int, v: Sequence[fmpq]) -> fmpq:
        """The rate g_j' at t = 0 where `exact_gap` is known: the stop is at its turning point."""
        return _dot(self.stops[j].normal, v)

    def slips(self, j: int, v: Sequence[fmpq]) -> fmpq | None:
        """The velocity of slip at a stop; None without friction."""
        tangent = self.stops[j].tangent
        return None if tangent is None else _dot(tangent, v)

    def _kept(self, name: str, precision: int, make: Callable[[], T]) -> T:
        if (name, precision) not in self._cache:
            self._cache[name, precision] = make()
        return cast("T", self._cache[name, precision])

    def _free(self) -> arb_mat:
        n, inverse = self.size, arb_mat(self.compliance())
        stiffness, damping = inverse * arb_mat(self.stiffness), inverse * self.damping_balls()
        matrix = arb_mat(self.width, self.width)
        sine, cosine = arb(self.phase).sin_cos()
        drives = arb_mat(n, 3)
        for i, (real, imag) in enumerate(self.drive):
            # Re((a + ib) e^{i phase} (cos + i sin))
            drives[i, 0] = arb(self.load[i])
            drives[i, 1] = arb(real) * cosine - arb(imag) * sine
            drives[i, 2] = -arb(real) * sine - arb(imag) * cosine
        drives = inverse * drives
        for i in range(n):
            matrix[i, n + i] = arb(1)
            for j in range(n):
                matrix[n + i, j], matrix[n + i, n + j] = -stiffness[i, j], -damping[i, j]
            for j in range(3):
                matrix[n + i, 2 * n + j] = drives[i, j]
        matrix[2 * n + 1, 2 * n + 2] = -arb(self.omega)
        matrix[2 * n + 2, 2 * n + 1] = arb(self.omega)
        return matrix

    def _modal_damping(self) -> arb_mat:
        """C from the ratios of the modes, as the polynomial of M^-1 K that has these values."""
        assert self.ratios is not None
        inner = self.compliance() * self.stiffness
        # the stubs of python-flint leave out the multiplicities
        found = cast("list[tuple[acb, int]]", inner.charpoly().complex_roots())
        roots = [(root.real, count) for root, count in found]
        roots.sort(key=lambda pair: float(pair[0]))
        largest, place = float(roots[-1][0]), 0
        matrix, step = arb_mat(inner), arb_mat(self.size, self.size)
        one = arb_mat(fmpq_mat(self.size, self.size, _unit(self.size)))
        for i, (root, count) in enumerate(roots):
            ratios = set(self.ratios[place : place + count])
            place += count
            if len(ratios) > 1:
                raise ValueError("repeated frequencies with unequal damping ratios")
            (ratio,) = ratios
            if ratio == 0:
                continue
            if float(root) < RIGID * largest:
                raise ValueError("a rigid-body mode has the damping ratio 0")
            term = one * (2 * arb(ratio) * root.sqrt())
            for k, (other, _) in enumerate(roots):
                if k != i:
                    term = term * (matrix - one * other) * (1 / (root - other))
            step += term
        return arb_mat(self.mass) * step


def _unit(size: int) -> list[int]:
    return [int(i == j) for i in range(size) for j in range(size)]


def _square(rows: Sequence[Sequence[Number]]) -> fmpq_mat:
    size = len(rows)
    if size == 0 or any(len(row) != size for row in rows):
        raise ValueError("a matrix that is not square")
    return fmpq_mat(size, size, [exact(_plain(value)) for row in rows for value in row])


def _row(values: Sequence[Number], size: int) -> fmpq_mat:
    if len(values) != size:
        raise ValueError(f"a row of {len(values)} entries for {size} coordinates")
    return fmpq_mat(1, size, [exact(_plain(value)) for value in values])


def _complex(value: Any) -> tuple[fmpq, fmpq]:
    """Real and imaginary part of a number or a pair."""
    if isinstance(value, complex):
        return exact(value.real), exact(value.imag)
    real, imag = value if isinstance(value, (list, tuple)) else (value, 0)
    return exact(_plain(real)), exact(_plain(imag))


def _plain(value: Number) -> Number:
    """A number as `exact` takes it: scalars of NumPy are floats or ints by value."""
    return value.item() if hasattr(value, "item") else value


def _dot(row: fmpq_mat, values: Sequence[fmpq]) -> fmpq:
    return sum((row[0, i] * value for i, value in enumerate(values)), fmpq(0))

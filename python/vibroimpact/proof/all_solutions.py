"""Verify that motions of n drive periods with one impact, without friction, are all there are.

Just after the impact x1 and x2 = y = sigma(x1) - delta have velocities V and W; P is the impulse,
psi the phase, kappa = sigma', sigma the sine or, in direct contact, the identity. Flights of n
periods, x1 -> A11 x1 + A12 V + a z + h and so on, with z = (cos psi, sin psi), and B, b, k for
body 2, and Newton's law of impact, with rho = r/(1 + r), give

    - A12 V                - a z  = h  - (1 - A11) x1
    (1 - A22) V + kappa P  - a' z = h' + A21 x1
    - B12 W                - b z  = k  - (1 - B11) y                                            (L)
    (1 - B22) W - mbar P   - b' z = k' + B21 y
    kappa V - W + rho (mbar + kappa^2) P = 0.

At a given x1 they are linear, with a determinant D and Cramer's numerators Nc, Ns of z. Since
D cos psi = Nc and D sin psi = Ns, each solution has

    F(x1) = Nc^2 + Ns^2 - D^2 = 0.

1. An interval of x1 over which F has no zero holds no solution.
2. One over which F' has no zero holds at most one zero of F. If it holds a solution, and D is not 0
   there, that is the only one. Whether it is a motion, its own certificate tells.
3. A bound of |x1| (`reach`) tells that no solution lies outside.

A wall at rest (mbar = f2 = 0) is met where sigma(x1) = delta + c2, and F stands for the difference.
There J = kappa P and V = -rho J, and the first two of (L) give z = c + d J; |c + d J|^2 = 1 has two
solutions at most, and none if its discriminant is negative.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import Any

from flint import arb, arb_mat, arb_poly, arb_series, ctx, fmpq

from ..errors import ProofError
from .certificate import Finding, examine, machine_in, numbers
from .formulas import Number, Undecided


@dataclass(frozen=True)
class Body:
    """Flights of a body: `keeps` = 1 - A, `drive` = (a; a'), `load` = (h; h')."""

    keeps: arb_mat
    drive: arb_mat
    load: arb_mat

    def steady(self) -> tuple[arb, arb, arb, arb] | None:
        """(x, V) = (p, p') - (b, b') kick: bounds of |p|, |p'| over all phases; b, b'."""
        if not sure(self.keeps.det()):
            return None
        inverse = self.keeps.inv()
        by_z, load = (inverse * self.drive).tolist(), (inverse * self.load).entries()
        size, speed = ((by_z[i][0] ** 2 + by_z[i][1] ** 2).sqrt() + abs(load[i]) for i in (0, 1))
        return size, speed, inverse[0, 1], inverse[1, 1]


@dataclass(frozen=True)
class OneImpact:
    """The conditions (L): numbers by their symbols, kind of contact, the bodies that move."""

    number: Mapping[str, arb]
    oblique: bool
    wall_rests: bool
    bodies: tuple[Body, ...]

    @cached_property
    def determinants(self) -> tuple[arb_poly, ...]:
        """D; then of Nc, and of Ns, the factors of x1 and y, and the rest: polynomials of kappa."""
        (one, two), zero = self.bodies, [arb(0)] * 2
        kappa, mbar, rho = arb_poly([0, 1]), self.number["mbar"], self.number["rho"]
        by_p: list[Any] = [arb(0), kappa, arb(0), -mbar, rho * (kappa * kappa + mbar)]
        if mbar.is_zero():  # kappa P is the unknown
            by_p = [arb(0), arb(1), arb(0), arb(0), rho * kappa]
        columns: list[list[Any]] = [
            [one.keeps[0, 1], one.keeps[1, 1], *zero, kappa],
            [*zero, two.keeps[0, 1], two.keeps[1, 1], arb(-1)],
            by_p,
            *([*(-body.drive[i, j] for body in (one, two) for i in (0, 1)), 0] for j in (0, 1)),
        ]
        sides: list[list[Any]] = [
            [-one.keeps[0, 0], -one.keeps[1, 0], *zero, 0],
            [*zero, -two.keeps[0, 0], -two.keeps[1, 0], 0],
            [*one.load.entries(), *two.load.entries(), 0],
        ]
        swaps = [[*columns[:i], side, *columns[i + 1 :]] for i in (3, 4) for side in sides]
        return tuple(map(determinant, [columns, *swaps]))

    def parts(self, x: Number) -> tuple[Number, Number, Number]:
        """D, Nc and Ns at x1 = x."""
        y = (x.sin() if self.oblique else x) - self.number["delta"]
        kappa = x.cos() if self.oblique else arb(1)
        d, p, q, s, p2, q2, s2 = (a[0] + kappa * (a[1] + kappa * a[2]) for a in self.determinants)
        return d, x * p + y * q + s, x * p2 + y * q2 + s2

    def equation(self, x: Number) -> Number:
        """F."""
        if self.wall_rests:
            return (x.sin() if self.oblique else x) - self.number["delta"] - self.number["c2"]
        d, cosine, sine = self.parts(x)
        return cosine * cosine + sine * sine - d * d

    def enclose(self, x: arb) -> tuple[arb, arb]:
        """F and F' over a ball, by F(m) + F'(x)(x - m)."""
        slope = self.equation(arb_series([x, 1], 2))[1]
        return self.equation(x.mid()) + slope * (x - x.mid()), slope

    def most(self, x: arb) -> int:
        """How many solutions can share an x1 in a ball; raises Undecided where that is open."""
        if not self.wall_rests:
            if sure(self.parts(x)[0]):
                return 1
            raise Undecided("the conditions leave the drive phase open")
        body, rho = self.bodies[0], self.number["rho"]
        if not sure(body.drive.det()):
            raise Undecided("the drive may not move the first body")
        inverse = body.drive.inv()
        fixed = arb_mat([[body.keeps[i, 0] * x - body.load[i, 0]] for i in (0, 1)])
        by_j = arb_mat([[i - rho * body.keeps[i, 1]] for i in (0, 1)])
        (c, c2), (d, d2) = (inverse * fixed).entries(), (inverse * by_j).entries()
        square = d * d + d2 * d2
        if not square > 0:
            raise Undecided("the conditions leave the impulse open")
        return 0 if (c * d + c2 * d2) ** 2 - square * (c * c + c2 * c2 - 1) < 0 else 2

    def apart(self, boxes: Sequence[Sequence[arb]]) -> bool:
        """Whether solutions with one x1, two at most, have different phases."""
        turns, alike = [self.number["omega"] * time for *_, time in boxes], (arb.cos, arb.sin)
        return len(turns) < 2 or any(not f(turns[0]).overlaps(f(turns[1])) for f in alike)

    def reach(self) -> arb | None:
        """A bound of |x1| of all solutions, None if none is known.

        With `steady`, x1 = p - b kappa P, y = p2 + b2 mbar P, and the last of (L) is
        (kappa^2 s1 + mbar s2) P = kappa p' - p2', where s = b' - rho. If s1, s2 > 0 then
        |kappa P| <= |p'|/s1 + |p2'|/(2 sqrt(s1 mbar s2)). In oblique contact also
        |kappa P| <= |P| <= (1 + |delta| + |p2|)/(mbar |b2|); if mbar = 0 then |sin x1| <= |delta| +
        |p2| = c, and kappa^2 >= 1 - c^2. In direct contact D is constant, Nc and Ns are linear, and
        |Nc|, |Ns| <= |D|.
        """
        delta, mbar, bounds = abs(self.number["delta"]), self.number["mbar"], []
        if not self.oblique and self.wall_rests:
            return abs(self.number["delta"] + self.number["c2"])
        if not self.oblique:
            d, *others = (a(arb(1)) for a in self.determinants)
            for p, q, s in (others[:3], others[3:]):
                bounds.append((abs(d) + abs(s) + delta * abs(q)) / abs(p + q))
            return least(bounds)
        known = [body.steady() for body in self.bodies]
        if known[0] is None:
            return None
        size, speed, b, slope = known[0]
        s1 = slope - self.number["rho"]
        if self.wall_rests and s1 > 0:
            bounds.append(speed / s1)
        elif not self.wall_rests and known[1] is not None:
            size2, speed2, b2, slope2 = known[1]
            s2, height = slope2 - self.number["rho"], delta + size2
            if mbar > 0:
                bounds.append((1 + height) / (mbar * abs(b2)))
                if s1 > 0 and s2 > 0:
                    bounds.append(speed / s1 + speed2 / (2 * (s1 * s2 * mbar).sqrt()))
            elif s1 > 0 and height < 1:
                bounds.append((speed + speed2 / (1 - height**2).sqrt()) / s1)
        impulse = least(bounds)
        return None if impulse is None else (size + abs(b) * impulse).upper()


def sure(x: arb) -> bool:
    """Whether a ball does not hold 0."""
    return bool(x > 0 or x < 0)


def least(bounds: Sequence[arb]) -> arb | None:
    """The least of what bounds there are."""
    return min((x.upper() for x in bounds if x.is_finite()), default=None)


def determinant(columns: Sequence[Sequence[Any]]) -> arb_poly:
    """Of columns, by the first of them."""
    total = arb_poly([0 if columns else 1])
    for i, x in enumerate(columns[0] if columns else ()):
        if x == 0:  # not `!=`, which asks whether a ball is 0 nowhere
            continue
        minor = determinant([[*column[:i], *column[i + 1 :]] for column in columns[1:]])
        total += (-1) ** i * x * minor
    return total


def conditions_in(given: Mapping[str, Any]) -> OneImpact:
    """The conditions that a certificate is about."""
    machine, n = machine_in(given["machine"]), given["n"]
    (stop,), size = machine.stops, machine.size
    sound = given["machine"]["kind"] == "two bodies" and stop.friction.is_zero()
    if not sound or n not in range(1, 10**6):
        raise ProofError("another machine, or n")
    flow, bodies = machine.flow(2 * arb.pi() * n / machine.omega), []
    for rows in ((i, size + i) for i in range(size)):
        keeps = arb_mat([[int(i == j) - flow[i, j] for j in rows] for i in rows])
        drive = arb_mat([[flow[i, 2 * size + j] for j in (1, 2)] for i in rows])
        bodies.append(Body(keeps, drive, arb_mat([[flow[i, 2 * size]] for i in rows])))
    number = numbers(given["machine"]["numbers"], arb)
    number["rho"] = number["r"] / (1 + number["r"])
    return OneImpact(number, stop.tip, size == 1, tuple(bodies))


def problem(given: Mapping[str, Any], orbit: Mapping[str, Any]) -> dict[str, Any]:
    """The problem of the certificate of one motion."""
    shared = {"machine": given["machine"], "m": given["n"], "legs": [[0, "frictionless"]]}
    return {**shared, "precision": orbit["precision"], "box": orbit["box"]}


def examine_all(given: Mapping[str, Any]) -> tuple[list[Finding], bool]:
    """What is found of the solutions of a certificate, and whether none lies outside its range.

    `cuts`, rising, part the range of x1 into intervals; `holds` are the solutions in each. Raises
    Undecided where it is not shown that these are all.
    """
    cuts, holds, orbits = numbers(given["cuts"]), given["holds"], given["orbits"]
    intervals = list(pairwise(cuts))
    used = sorted(k for inner in holds for k in inner)
    rising = intervals and all(low < high for low, high in intervals)
    if not rising or len(intervals) != len(holds) or used != list(range(len(orbits))):
        raise ProofError("intervals, or the solutions in them")
    findings = [examine(problem(given, orbit)) for orbit in orbits]
    with ctx.workprec(int(given["precision"])):
        equations = conditions_in(given)
        for (low, high), inner in zip(intervals, holds, strict=True):
            x = arb((low + high) / 2, (high - low) / 2)
            value, slope = equations.enclose(x)
            if not inner and sure(value):
                continue
            boxes = [solution(findings[k], orbits[k], low, high) for k in inner]
            most = equations.most(boxes[0][0] if boxes else x)
            if not sure(slope) or len(boxes) != most or not equations.apart(boxes):
                raise Undecided(f"there may be other solutions with x1 near {float(x.mid()):.6g}")
        reach = equations.reach()
        everywhere = reach is not None and arb(cuts[0]) <= -reach and reach <= arb(cuts[-1])
    return findings, bool(everywhere)


def solution(found: Finding, orbit: Mapping[str, Any], low: fmpq, high: fmpq) -> Sequence[arb]:
    """The small box of a solution with low < x1 < high."""
    with ctx.workprec(int(orbit["precision"])):
        if not found.solved or not (arb(low) < found.box[0] < arb(high)):
            raise Undecided(f"no solution is shown: {found.why}")
    return found.box

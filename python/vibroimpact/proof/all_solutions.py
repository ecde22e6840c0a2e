"""Verify that certain motions of n drive periods with one impact, without friction, are all.

Just after the impact x1 and x2 = y = sigma(x1) - delta have velocities V and W; P is the impulse,
psi the phase, kappa = sigma', sigma the sine or, in direct contact, the identity. Flights of n
periods, x(nT) = A11 x + A12 V + a . (cos psi, sin psi) + h and so on (B, b for body 2), and Newton's
law, rho = r/(1 + r), ask for

    - A12 V                 - a . (cos psi, sin psi)   = h  - (1 - A11) x1
    (1 - A22) V + kappa P   - a'. (cos psi, sin psi)   = h' + A21 x1
    - B12 W                 - b . (cos psi, sin psi)   = k  - (1 - B11) y                        (L)
    (1 - B22) W - mbar P    - b'. (cos psi, sin psi)   = k' + B21 y
    kappa V - W + rho (mbar + kappa^2) P               = 0.

At a given x1 they are linear, with a determinant D and Cramer's numerators Nc, Ns of cos psi and
sin psi. Since D cos psi = Nc and D sin psi = Ns, each solution has

    F(x1) = Nc^2 + Ns^2 - D^2 = 0.

1. An interval of x1 over which F has no zero holds no solution.
2. One over which F' has no zero holds one zero of F at most. If a solution lies in it, and D is not
   0 there, that is the only one. Whether it is a motion tells its own certificate.
3. A bound of |x1| (`reach`) tells that no solution lies outside.

A wall at rest (mbar = f2 = 0) is met where sin x1 or x1 is delta + c2, and nowhere else. There, with
J = kappa P and V = -rho J, the first two of (L) give (cos psi, sin psi) = c + d J; so that
|c + d J|^2 = 1 has two solutions at most, and none if its discriminant is negative.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

from flint import arb, arb_mat, arb_poly, arb_series, ctx, fmpq

from ..errors import ProofError
from .certificate import Finding, balls, examine, machine_in, numbers
from .formulas import Machine, Number, Undecided, plain, slope_of
from .verifier import inside

@dataclass(frozen=True)
class Body:
    """A body in a flight of n periods: rows of (L), and what periodicity makes of a kick.

    `keeps` = 1 - A, (2, 2); `drive`, (2, 2), by cos psi and sin psi; `load` = (h, h').
    """

    keeps: arb_mat
    drive: arb_mat
    load: arb_mat

    @cached_property
    def solved(self) -> tuple[arb_mat, arb_mat, arb_mat] | None:
        """(x, V) = R drive . (cos psi, sin psi) + R load - R (0, kick), R = 1/keeps; None if none."""
        try:
            inverse = self.keeps.inv()
        except ZeroDivisionError:
            return None
        return inverse * self.drive, inverse * self.load, inverse * arb_mat([[0], [1]])


def largest(row: Sequence[arb], load: arb) -> arb:
    """The most that |row . (cos psi, sin psi) + load| can be."""
    return (row[0] ** 2 + row[1] ** 2).sqrt() + abs(load)


@dataclass(frozen=True)
class OneImpact:
    """The conditions (L) of a machine of two bodies without friction."""

    machine: Machine
    n: int
    number: Mapping[str, arb]

    def __post_init__(self) -> None:
        if not all(stop.friction.is_zero() for stop in self.machine.stops):
            raise ProofError("friction")

    @property
    def tip(self) -> bool:
        """Whether the contact is oblique."""
        return self.machine.stops[0].tip

    @property
    def rests(self) -> bool:
        """Whether body 2 is a wall at rest."""
        return self.machine.size == 1

    @cached_property
    def bodies(self) -> list[Body]:
        """The bodies that move."""
        size = self.machine.size
        flow, found = self.machine.flow(self.machine.period * self.n), []
        for i in range(size):
            rows = (i, size + i)
            keeps = arb_mat([[int(a == b) - flow[a, b] for b in rows] for a in rows])
            drive = arb_mat([[flow[a, 2 * size + j] for j in (1, 2)] for a in rows])
            found.append(Body(keeps, drive, arb_mat([[flow[a, 2 * size]] for a in rows])))
        return found

    @property
    def rho(self) -> arb:
        """r/(1 + r)."""
        return self.number["r"] / (1 + self.number["r"])

    @cached_property
    def determinants(self) -> tuple[arb_poly, ...]:
        """D; then of Nc, and of Ns, the factors of x1 and y, and what is without: by kappa."""
        one, two, kappa, mbar = *self.bodies, arb_poly([0, 1]), self.number["mbar"]
        by_p = [kappa, -mbar, self.rho * (kappa * kappa + mbar)]
        if mbar.is_zero():  # kappa P is the unknown: P does not act on body 2
            by_p = [arb_poly([1]), arb(0), self.rho * kappa]
        zero = [arb(0)] * 2
        columns = [
            [one.keeps[0, 1], one.keeps[1, 1], *zero, kappa],
            [*zero, two.keeps[0, 1], two.keeps[1, 1], arb(-1)],
            [arb(0), by_p[0], arb(0), by_p[1], by_p[2]],
            *([*(-body.drive[i, j] for body in (one, two) for i in (0, 1)), arb(0)] for j in (0, 1)),
        ]
        sides = [
            [-one.keeps[0, 0], -one.keeps[1, 0], *zero, arb(0)],
            [*zero, -two.keeps[0, 0], -two.keeps[1, 0], arb(0)],
            [*one.load.entries(), *two.load.entries(), arb(0)],
        ]
        found = [determinant(columns)]
        for place in (3, 4):
            for side in sides:
                found.append(determinant([*columns[:place], side, *columns[place + 1 :]]))
        return tuple(found)

    def parts(self, x: Number) -> tuple[Number, Number, Number]:
        """D, Nc and Ns at x1 = x."""
        d, *others = self.determinants
        y = (x.sin() if self.tip else x) - self.number["delta"]
        kappa = x.cos() if self.tip else arb(1)

        def at(q: arb_poly) -> Number:
            return q[0] + kappa * (q[1] + kappa * q[2])

        p, q, s, p2, q2, s2 = map(at, others)
        return at(d), x * p + y * q + s, x * p2 + y * q2 + s2

    def equation(self, x: Number) -> Number:
        """F; of a wall at rest its gap."""
        if self.rests:
            return (x.sin() if self.tip else x) - self.number["delta"] - self.number["c2"]
        d, c, s = self.parts(x)
        return c * c + s * s - d * d

    def excludes(self, x: arb) -> bool:
        """Whether F has no zero over a ball, by its value or by F(m) + F'(x)(x - m)."""
        wide = self.equation(arb_series([x, 1], 2))
        if plain(wide) > 0 or plain(wide) < 0:
            return True
        value = self.equation(x.mid()) + slope_of(wide) * (x - x.mid())
        return bool(value > 0 or value < 0)

    def rises_or_falls(self, x: arb) -> bool:
        """Whether F' has no zero over a ball."""
        slope = slope_of(self.equation(arb_series([x, 1], 2)))
        return bool(slope > 0 or slope < 0)

    def phases(self, x: arb) -> int:
        """The most solutions that share one x1 in a ball.

        Raises
        ------
        Undecided : there may be more than two
        """
        if not self.rests:
            d, *_ = self.parts(x)
            if d > 0 or d < 0:
                return 1
            raise Undecided("the conditions leave the drive phase open")
        (body,) = self.bodies
        try:
            inverse = body.drive.inv()
        except ZeroDivisionError:
            raise Undecided("the drive does not move the first body") from None
        column = arb_mat([[body.keeps[i, 0] * x - body.load[i, 0]] for i in (0, 1)])
        kick = arb_mat([[-self.rho * body.keeps[0, 1]], [1 - self.rho * body.keeps[1, 1]]])
        (c, c2), (d, d2) = (inverse * column).entries(), (inverse * kick).entries()
        square, mixed = d * d + d2 * d2, c * d + c2 * d2
        if not square > 0:
            raise Undecided("the conditions leave the impulse open")
        return 0 if mixed**2 - square * (c * c + c2 * c2 - 1) < 0 else 2

    def reach(self) -> arb | None:
        """A bound of |x1| of all solutions, None if there is none.

        With e, p and b the parts of x by load, drive and kick, and e', p', b' those of V,

            x1 = e + p - b kappa P,    y = e2 + p2 + b2 mbar P,
            (kappa^2 s1 + mbar s2) P = kappa (e' + p') - (e2' + p2'),    s = b' - rho.

        If s1, s2 > 0 then |kappa P| <= |e' + p'|/s1 + |e2' + p2'|/(2 sqrt(s1 mbar s2)). And
        |kappa P| <= |P| <= (|y| + |e2 + p2|)/(mbar |b2|), |y| <= 1 + |delta|, in oblique contact.
        In direct contact D is fixed, Nc and Ns are linear, |Nc| <= |D|, |Ns| <= |D|.
        """
        number, delta, bounds = self.number, abs(self.number["delta"]), []
        if not self.tip:
            if self.rests:
                return abs(number["delta"] + number["c2"])
            d, *others = (q(arb(1)) for q in self.determinants)
            for p, q, s in (others[:3], others[3:]):
                bounds.append((abs(d) + abs(s) + delta * abs(q)) / abs(p + q))
            return least(bounds)
        first, *others = self.bodies
        if not first.solved:
            return None
        drive, load, kick = first.solved
        place, speed = (largest(drive.tolist()[i], load[i, 0]) for i in (0, 1))
        s1 = kick[1, 0] - self.rho
        if self.rests and s1 > 0:
            bounds.append(speed / s1)
        elif not self.rests and others[0].solved:
            drive, load, kick2 = others[0].solved
            place2, speed2 = (largest(drive.tolist()[i], load[i, 0]) for i in (0, 1))
            mbar, s2 = number["mbar"], kick2[1, 0] - self.rho
            if s1 > 0 and mbar > 0 and s2 > 0:
                bounds.append(speed / s1 + speed2 / (2 * (s1 * s2 * mbar).sqrt()))
            if mbar > 0:
                bounds.append((1 + delta + place2) / (mbar * abs(kick2[0, 0])))
            height = delta + place2  # bounds sin x1 where nothing acts on body 2
            if mbar.is_zero() and s1 > 0 and height < 1:
                bounds.append((speed + speed2 / (1 - height**2).sqrt()) / s1)
        impulse = least(bounds)
        return None if impulse is None else (place + abs(kick[0, 0]) * impulse).upper()


def determinant(columns: Sequence[Sequence[Any]]) -> arb_poly:
    """By its first column."""
    if not columns:
        return arb_poly([1])
    first, total = columns[0], arb_poly([0])
    for i, x in enumerate(first):
        if not (isinstance(x, arb) and x.is_zero()):
            minor = determinant([[*column[:i], *column[i + 1 :]] for column in columns[1:]])
            total += (-1) ** i * x * minor
    return total


def least(bounds: Sequence[arb]) -> arb | None:
    """The least of what bounds there are."""
    found = [x.upper() for x in bounds if x.is_finite()]
    return min(found, default=None)


def conditions_in(given: Mapping[str, Any]) -> OneImpact:
    """The conditions that a certificate is about."""
    machine = given["machine"]
    if machine["kind"] != "two bodies" or given["n"] not in range(1, 10**6):
        raise ProofError("another machine, or n")
    number = {name: arb(numbers(x)) for name, x in machine["numbers"].items()}
    return OneImpact(machine_in(machine), given["n"], number)


def ball(low: fmpq, high: fmpq) -> arb:
    """The ball of an interval."""
    return arb((low + high) / 2, (high - low) / 2)


def problem(given: Mapping[str, Any], orbit: Mapping[str, Any]) -> dict[str, Any]:
    """The problem of the certificate of one motion."""
    shared = {"machine": given["machine"], "m": given["n"], "legs": [[0, "frictionless"]]}
    return {**shared, "precision": orbit["precision"], "box": orbit["box"]}


def examine_all(given: Mapping[str, Any]) -> tuple[list[Finding], bool]:
    """What is found of the motions of a certificate, and whether its range holds all of x1.

    `cuts`, rising, part its range into intervals; `holds` lists the motions in each.

    Raises
    ------
    Undecided : it is not shown that these are all
    ProofError, KeyError, TypeError, ValueError : the certificate is damaged
    """
    findings = [examine(problem(given, orbit)) for orbit in given["orbits"]]
    cuts, holds, orbits = numbers(given["cuts"]), given["holds"], given["orbits"]
    rising = all(low < high for low, high in zip(cuts, cuts[1:], strict=False))
    used = sorted(k for inner in holds for k in inner)
    if not rising or len(cuts) != len(holds) + 1 or used != list(range(len(orbits))):
        raise ProofError("intervals or numbers of motions")
    with ctx.workprec(int(given["precision"])):
        equations = conditions_in(given)
        for low, high, inner in zip(cuts, cuts[1:], holds, strict=False):
            x = ball(low, high)
            if not inner and equations.excludes(x):
                continue
            if not equations.rises_or_falls(x):
                raise Undecided(f"x1 near {float(x.mid()):.6g}: it is open how many solutions")
            boxes = [solution(findings[k], orbits[k], low, high) for k in inner]
            most = equations.phases(boxes[0][0] if boxes else x)
            if len(inner) != most or (most == 2 and not apart(equations, *boxes)):
                raise Undecided(f"x1 near {float(x.mid()):.6g}: there may be other solutions")
        reach = equations.reach()
        everywhere = reach is not None and arb(cuts[0]) <= -reach and reach <= arb(cuts[-1])
    return findings, bool(everywhere)


def solution(found: Finding, orbit: Mapping[str, Any], low: fmpq, high: fmpq) -> Sequence[arb]:
    """The small box of a solution with low < x1 < high."""
    # Krawczyk's image lies inside its box where, and only where, it holds a solution
    solved = found.verdict != "undecided" and inside(found.box, balls(orbit["box"]))
    if not solved or not (arb(low) < found.box[0] < arb(high)):
        raise Undecided(f"no solution is shown: {found.why}")
    return found.box


def apart(equations: OneImpact, one: Sequence[arb], other: Sequence[arb]) -> bool:
    """Whether two solutions with the same x1 differ, by phase."""
    drives = (equations.machine.drive(box[-1])[1:] for box in (one, other))
    return any(not a.overlaps(b) for a, b in zip(*drives, strict=True))

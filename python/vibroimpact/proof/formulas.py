"""The formulas that a proof rests on, in balls; sections are those of the theory page.

A ball (python-flint's arb) is a number with a bound of its error. Operations round outward, and a
comparison is True only where it holds of all numbers in the balls: `not x > 0` is no `x <= 0`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, TypeAlias

from flint import arb, arb_mat, fmpq, fmpq_mat


class Undecided(Exception):
    """Nothing is shown; says why."""


class Refuted(Exception):
    """The box holds no motion; says why."""


Number: TypeAlias = Any  # a ball (arb), or a power series with balls (arb_series)
Row: TypeAlias = Sequence[Number]
Landing: TypeAlias = tuple[list[Number], list[tuple[Number, str]]]  # and what must be positive


def plain(x: Number) -> arb:
    """Without derivative."""
    while not isinstance(x, arb):
        x = x[0]
    return x


def dot(row: Row, other: Row) -> Number:
    """The sum of products, without those that are exactly 0."""
    pairs = zip(row, other, strict=True)
    return sum((a * b for a, b in pairs if not (isinstance(a, arb) and a.is_zero())), arb(0))


@dataclass(frozen=True)
class Stop:
    """A stop: g = rows[0] . w, and + sin q_0 for the tip of a pendulum."""

    rows: list[Row]  # of g, g' and g'', each the one before times G
    first: Row  # of q_0''
    tangent: Row  # of the velocity of slip; that of the tip is sin q_0 times this
    restitution: Number
    friction: Number
    tip: bool

    def gap(self, w: Row, order: int = 0) -> Number:
        """The gap g, its rate g', at an impact the approach velocity u, or g''."""
        found, speed = dot(self.rows[order], w), w[len(self.tangent)]
        if not self.tip:
            return found
        if order < 2:
            return found + (w[0].cos() * speed if order else w[0].sin())
        return found + w[0].cos() * dot(self.first, w) - w[0].sin() * speed * speed


@dataclass(frozen=True)
class Machine:
    """Between impacts w = (q, v, 1, cos psi, sin psi) obeys w' = G w, psi = omega t + phase."""

    size: int
    rows: list[Row]  # of G
    generator: arb_mat  # G without derivatives
    inverse_mass: list[Row]
    stops: list[Stop]
    law: str
    omega: Number
    phase: Number
    _steps: dict[tuple[int, bool], arb_mat] = field(default_factory=dict, repr=False)

    def drive(self, time: Number) -> list[Number]:
        """1, cos psi and sin psi."""
        psi = self.omega * time + self.phase
        return [arb(1), psi.cos(), psi.sin()]

    def flow(self, time: arb) -> arb_mat:
        """exp(time G): that of the midpoint times that of the rest, which is short."""
        flow, rest = (self.generator * time.mid()).exp(), time - time.mid()
        return flow if rest.is_zero() else flow * (self.generator * rest).exp()

    def step(self, halvings: int, *, up_to: bool = False) -> arb_mat:
        """exp(s G) for s = 2^-halvings, or for all s from 0 up to there."""
        if (halvings, up_to) not in self._steps:
            half = arb(2) ** -(halvings + 1)
            time = arb(half, half) if up_to else 2 * half
            self._steps[halvings, up_to] = (self.generator * time).exp()
        return self._steps[halvings, up_to]


def machine_of(matrices: Any, stops: Any, drive: Row, law: str, *, tip: bool) -> Machine:
    """From M^-1, M^-1 C, M^-1 K and M^-1 times the loads by 1, cos psi, sin psi; rows of gaps."""
    inverse, damping, stiffness, loads = matrices
    n, (omega, phase), made, zero = len(inverse), drive, [], arb(0)
    g: list[Row] = [[arb(int(j == n + i)) for j in range(2 * n + 3)] for i in range(n)]
    for elastic, viscous, load in zip(stiffness, damping, loads, strict=True):
        g.append([*(-x for x in (*elastic, *viscous)), *load])
    for turn in ([zero, zero, zero], [zero, zero, -omega], [zero, omega, zero]):
        g.append([zero] * (2 * n) + turn)
    columns = list(zip(*g, strict=True))
    for row, tangent, r, mu in stops:
        rate = [dot(row, column) for column in columns]
        rows = [row, rate, [dot(rate, column) for column in columns]]
        made.append(Stop(rows, g[n], tangent, r, mu, tip))
    sharp = arb_mat([[plain(x) for x in row] for row in g])
    return Machine(n, g, sharp, inverse, made, law, omega, phase)


def two_bodies(number: Mapping[str, Number], contact: str, law: str, wall_rests: bool) -> Machine:
    """The system of sections 1 and 11 by its symbols; a wall at rest, x2 = c2, is no unknown."""
    n, tip, zero = 1 if wall_rests else 2, contact == "oblique", arb(0)
    diagonals = [
        (arb(1), number["mbar"]),
        (2 * number["zeta1"] * number["omega0"], 2 * number["zeta2"]),
        (number["omega0"] * number["omega0"], arb(1)),
    ]
    matrices = [[[one, zero][:n], [zero, other][:n]][:n] for one, other in diagonals]
    loads = [[number["c1"], number["f1"], zero], [number["c2"], number["f2"], zero]][:n]
    place = number["delta"] + number["c2"] if wall_rests else number["delta"]
    row = [zero if tip else arb(1), arb(-1)][:n] + [zero] * n + [-place, zero, zero]
    stop = (row, [arb(1), zero][:n], number["r"], number["mu"] if tip else zero)
    return machine_of([*matrices, loads], [stop], (number["omega"], number["phi"]), law, tip=tip)


def structure(given: Mapping[str, Any], law: str) -> Machine:
    """A structure with stops: matrices of exact numbers, and balls."""
    inverse, phase, stops = fmpq_mat(given["mass"]).inv(), given["phase"], []
    inner, n = inverse * fmpq_mat(given["stiffness"]), inverse.nrows()
    if "damping" in given:
        damping = arb_mat(inverse * fmpq_mat(given["damping"]))
    else:
        damping = _modal_damping(inner, given["damping_ratios"])
    # Re((a + ib) e^{i psi}) = a cos psi - b sin psi
    pairs = zip(given["static_load"], given["drive_amplitude"], strict=True)
    mass, forces = arb_mat(inverse), arb_mat([[c, a, -b] for c, (a, b) in pairs])
    for stop in given["stops"]:
        # its place is gap + A cos(omega t + phase_j) = gap + A cos(psi + shift)
        shift, amplitude = stop["phase"] - phase, stop["amplitude"]
        moving = [-stop["gap"], -amplitude * shift.cos(), amplitude * shift.sin()]
        row = [*stop["normal"], *[arb(0)] * n, *moving]
        stops.append((row, stop["tangent"], stop["restitution"], stop["friction"]))
    matrices = [x.tolist() for x in (mass, damping, arb_mat(inner), mass * forces)]
    return machine_of(matrices, stops, (given["drive_frequency"], phase), law, tip=False)


def _modal_damping(inner: fmpq_mat, ratios: Sequence[fmpq]) -> arb_mat:
    """M^-1 C: the polynomial of L = M^-1 K that is 2 zeta_i w_i at its eigenvalues w_i^2."""
    n, place = inner.nrows(), 0
    total, one = arb_mat(n, n), arb_mat([[int(i == j) for j in range(n)] for i in range(n)])
    found: Any = inner.charpoly().complex_roots()  # real, apart; ascending as the ratios
    roots = sorted(((x.real, count) for x, count in found), key=lambda pair: pair[0].mid())
    for i, (root, count) in enumerate(roots):
        (ratio,) = set(ratios[place : place + count])  # equal where frequencies are
        place += count
        term = one * (2 * arb(ratio) * root.sqrt() if ratio else 0)
        for other, _ in roots[:i] + roots[i + 1 :]:
            term = term * (arb_mat(inner) - one * other) * (1 / (root - other))
        total += term
    return total


_WAYS = ("slip", "reversal_approach", "reversal_restitution", "stick_approach", "stick_restitution")
#: "+" and "-" are the direction of slip before the impact.
REGIMES: tuple[str, ...] = ("frictionless", *(f"{way} {sign}" for way in _WAYS for sign in "+-"))


def impact(machine: Machine, stop: Stop, regime: str, w: Row) -> Landing:
    """Velocities after an impact of a regime (sections 4 and 12), and the regime's conditions.

    With a = n M^-1 n, b = n M^-1 t, c = t M^-1 t the impulses P (normal) and Q (tangential) make
    du = -a dP + b dQ, ds = -b dP + c dQ; dQ = -mu sgn(s) dP in slip, (b/c) dP in stick.
    Of the tip s is q_0', and mu that times sin q_0: where this is 0 only the friction is 0.
    """
    size, r, mu, law = machine.size, stop.restitution, stop.friction, machine.law
    normal, tangent, v = list(stop.rows[0][:size]), stop.tangent, w[size : 2 * size]
    if (regime == "frictionless") != plain(mu).is_zero():
        raise Undecided("an impact is frictionless where friction is 0, and only there")
    if stop.tip:
        normal[0], mu = w[0].cos(), mu * w[0].sin()
    by_normal = [dot(row, normal) for row in machine.inverse_mass]
    by_tangent = [dot(row, tangent) for row in machine.inverse_mass]
    u, a = stop.gap(w, 1), dot(normal, by_normal)
    shown = [(u, "the bodies do not approach")]
    s, b, c = dot(tangent, v), dot(normal, by_tangent), dot(tangent, by_tangent)
    friction = mu if "+" in regime else -mu
    way = s + friction  # has their sign, if they have the same one
    k, rate = b + friction * c, a + friction * b  # ds = -k dP, du = -rate dP
    p = (1 + r) * u / rate  # (1 + r) P_f
    q = -friction * p
    if regime != "frictionless":
        shown.append((friction * s, "slip has the other direction"))
    if "slip" in regime:
        shown += [(rate, "slip grows"), (way * (s - k * p), "slip stops")]
    elif regime != "frictionless":
        sticks, in_approach = "stick" in regime, "approach" in regime
        stopped = s / k  # P*
        # u at P*; at a wall at rest u and s vanish together, which counts as restitution
        together = stop.tip and size == 1
        bent = arb(0) if together else u - rate * stopped
        # a tip that sticks to a body without mass is held: no impulse changes a velocity any more
        held = sticks and stop.tip and plain(sum(machine.inverse_mass[-1][1:], arb(0))).is_zero()
        after = a - b * b / c if sticks else a - friction * b  # du = -after dP beyond P*
        cone = friction * friction * c * c - b * b
        shown.append((way * k, "slip does not stop"))
        shown.append((cone, "slip reverses") if sticks else (-cone, "the contact sticks"))
        if in_approach:
            shown.append((bent, "slip stops after the approach"))
        else:
            shown += [(rate, "slip grows"), (p - stopped, "slip goes on")]
            shown += [] if together else [(-bent, "slip stops in the approach")]
        if in_approach or not (held or law == "poisson"):
            shown.append((after, "the impact does not end"))
        elif not sticks:  # in all other cases u <= 0 after the impact is known
            shown.append((after * (p - stopped) - bent, "the bodies do not part"))
        if held:
            p = stopped
        elif law == "poisson":
            p = (1 + r) * (stopped + bent / after) if in_approach else p
        elif law == "newton":
            p = stopped + (bent + r * u) / after
        elif in_approach:  # of twice the work of the approach r^2 is returned
            work = (u + bent) * stopped + bent * bent / after
            p = stopped + bent / after + r * (work / after).sqrt()
        else:  # twice the work that is left to be returned after P*
            left = (r * r * u * u - bent * bent) / rate
            p = stopped + (bent + (bent * bent + after * left).sqrt()) / after
        q = -friction * stopped + (b / c if sticks else friction) * (p - stopped)
    pushed = zip(v, by_normal, by_tangent, strict=True)
    return [x - y * p + z * q for x, y, z in pushed], shown

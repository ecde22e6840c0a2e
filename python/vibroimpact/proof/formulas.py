"""The formulas that a proof rests on, in balls: free motion, gaps and impacts.

A ball (python-flint's arb) is a number with a bound of its error; every operation rounds outward.
Sections are those of the theory page. verifier.py proves with them.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, TypeAlias

from flint import arb, arb_mat, arb_series, fmpq, fmpq_mat


class Undecided(Exception):
    """Nothing is shown; says why."""


class Refuted(Exception):
    """The box holds no motion; says why."""


#: A ball (arb), or one with a derivative: x + x' h, a power series in h of two terms (arb_series).
Number: TypeAlias = Any


def plain(x: Number) -> arb:
    """Without derivative."""
    while not isinstance(x, arb):
        x = x[0]
    return x


def slope_of(x: Number) -> arb:
    """The derivative."""
    found: arb = x[1] if isinstance(x, arb_series) else arb(0)
    return found


def dot(row: Sequence[Number], other: Sequence[Number]) -> Number:
    """The sum of products, without those that are exactly 0."""
    pairs = zip(row, other, strict=False)
    terms = (a * b for a, b in pairs if not (isinstance(a, arb) and a.is_zero()))
    return sum(terms, arb(0))


@dataclass(frozen=True)
class Stop:
    """A stop: g = rows[0] . w, and + sin q_0 for the tip of a pendulum.

    `rows`: of g, g' and g'', each the one before times G. `tangent`: of the velocity of slip; that
    of the tip is (sin q_0, 0, ...).
    """

    rows: list[list[Number]]
    tangent: list[Number]
    restitution: Number
    friction: Number
    tip: bool

    def gap(self, w: Sequence[Number]) -> Number:
        """The gap g."""
        return dot(self.rows[0], w) + (w[0].sin() if self.tip else arb(0))

    def rate(self, w: Sequence[Number], n: int) -> Number:
        """Its rate g'; at an impact the approach velocity u."""
        return dot(self.rows[1], w) + (w[0].cos() * w[n] if self.tip else arb(0))

    def acceleration(self, w: Sequence[arb], n: int, first: Sequence[arb]) -> Number:
        """The second derivative g''; `first` . w is the acceleration of q_0."""
        bend = w[0].cos() * dot(first, w) - w[0].sin() * w[n] ** 2 if self.tip else arb(0)
        return dot(self.rows[2], w) + bend

    def directions(self, w: Sequence[Number], n: int) -> tuple[list[Number], list[Number]]:
        """The normal and the tangent."""
        normal, tangent = self.rows[0][:n], list(self.tangent)
        if self.tip:
            normal[0], tangent[0] = w[0].cos(), w[0].sin()
        return normal, tangent


@dataclass(frozen=True)
class Machine:
    """Between impacts w = (q, v, 1, cos psi, sin psi) obeys w' = G w, psi = omega t + phase.

    `moving`: G with series as entries where it depends on a parameter that is one; or None.
    """

    size: int
    generator: arb_mat
    moving: list[list[Number]] | None
    inverse_mass: list[list[Number]]
    stops: list[Stop]
    law: str
    omega: Number
    phase: Number
    _steps: dict[tuple[int, int, bool], arb_mat] = field(default_factory=dict, repr=False)

    @property
    def period(self) -> Number:
        """The drive period T = 2 pi/omega."""
        return 2 * arb.pi() / self.omega

    def drive(self, time: Number) -> list[Number]:
        """1, cos psi and sin psi."""
        psi = self.omega * time + self.phase
        return [arb(1), psi.cos(), psi.sin()]

    def flow(self, time: arb) -> arb_mat:
        """exp(time G): that of the midpoint times that of the rest, which is short."""
        return _exp(self.generator, time)

    def step(self, halvings: int, sign: int = 1, *, up_to: bool = False) -> arb_mat:
        """exp(s G) for s = +-2^-halvings, or for all s from 0 up to there."""
        key = (halvings, sign, up_to)
        if key not in self._steps:
            half = arb(2) ** -(halvings + 1)
            time = arb(sign * half, half) if up_to else 2 * sign * half
            self._steps[key] = (self.generator * time).exp()
        return self._steps[key]


def _exp(generator: arb_mat, time: arb) -> arb_mat:
    """The exponential: of the midpoint of the time times that of the rest, which is short."""
    flow, rest = (generator * time.mid()).exp(), time - time.mid()
    return flow if rest.is_zero() else flow * (generator * rest).exp()


def machine_of(
    matrices: Sequence[list[list[Number]]],
    stops: Sequence[tuple[list[Number], list[Number], Number, Number]],
    drive: tuple[Number, Number],
    law: str,
    *,
    tip: bool = False,
) -> Machine:
    """From M^-1, M^-1 C, M^-1 K and M^-1 times the loads by 1, cos psi, sin psi; rows of gaps."""
    inverse, damping, stiffness, loads = matrices
    n, (omega, phase), zero = len(inverse), drive, arb(0)
    g: list[list[Number]] = [[zero] * (2 * n + 3) for _ in range(2 * n + 3)]
    for i in range(n):
        g[i][n + i] = arb(1)
        g[n + i] = [-x for x in stiffness[i]] + [-x for x in damping[i]] + loads[i]
    g[2 * n + 1][2 * n + 2], g[2 * n + 2][2 * n + 1] = -omega, omega
    columns, made = list(zip(*g, strict=True)), []
    for row, tangent, restitution, friction in stops:
        rows = [row]
        for _ in range(2):
            rows.append([dot(rows[-1], column) for column in columns])
        made.append(Stop(rows, tangent, restitution, friction, tip))
    moves = any(isinstance(x, arb_series) for row in g for x in row)
    sharp = arb_mat([[plain(x) for x in row] for row in g])
    return Machine(n, sharp, g if moves else None, inverse, made, law, omega, phase)


def two_bodies(
    number: Mapping[str, Number], contact: str, law: str, *, wall_rests: bool
) -> Machine:
    """The system of sections 1 and 11 by its symbols; a wall at rest, x2 = c2, is no unknown."""
    n, tip, zero = 1 if wall_rests else 2, contact == "oblique", arb(0)

    def diagonal(one: Number, other: Number) -> list[list[Number]]:
        return [[one, zero][:n], [zero, other][:n]][:n]

    matrices = [
        diagonal(arb(1), number["mbar"]),
        diagonal(2 * number["zeta1"] * number["omega0"], 2 * number["zeta2"]),
        diagonal(number["omega0"] * number["omega0"], arb(1)),
        [[number["c1"], number["f1"], zero], [number["c2"], number["f2"], zero]][:n],
    ]
    place = number["delta"] + number["c2"] if wall_rests else number["delta"]
    row = [zero if tip else arb(1), arb(-1)][:n] + [zero] * n + [-place, zero, zero]
    stop = (row, [zero] * n, number["r"], number["mu"] if tip else zero)
    return machine_of(matrices, [stop], (number["omega"], number["phi"]), law, tip=tip)


def structure(given: Mapping[str, Any]) -> Machine:
    """The structure of section 12: matrices of exact numbers, and numbers."""
    inverse, inner = fmpq_mat(given["mass"]).inv(), fmpq_mat(given["stiffness"])
    n, inner, phase = inverse.nrows(), inverse * inner, given["phase"]
    if "damping" in given:
        damping = arb_mat(inverse * fmpq_mat(given["damping"]))
    else:
        damping = _modal_damping(inner, given["damping_ratios"])
    # Re((a + ib) e^{i psi}) = a cos psi - b sin psi
    pairs = zip(given["static_load"], given["drive_amplitude"], strict=True)
    forces = [[c, a, -b] for c, (a, b) in pairs]
    mass = arb_mat(inverse).tolist()
    loads = [[dot(row, force) for force in zip(*forces, strict=True)] for row in mass]
    stops = []
    for stop in given["stops"]:
        # cos(omega t + phase_j) = cos(psi + shift)
        shift, amplitude = stop["phase"] - phase, stop["amplitude"]
        moving = [-stop["gap"], -amplitude * shift.cos(), amplitude * shift.sin()]
        row = [*stop["normal"], *[arb(0)] * n, *moving]
        stops.append((row, stop["tangent"], stop["restitution"], stop["friction"]))
    matrices = [mass, damping.tolist(), arb_mat(inner).tolist(), loads]
    return machine_of(matrices, stops, (given["drive_frequency"], phase), given["law"])


def _modal_damping(inner: fmpq_mat, ratios: Sequence[fmpq]) -> arb_mat:
    """M^-1 C of the damping ratios of the modes, by ascending frequency.

    It is the polynomial of L = M^-1 K that is 2 zeta_i w_i at its eigenvalues w_i^2.
    """
    n, place = inner.nrows(), 0
    total, one = arb_mat(n, n), arb_mat([[int(i == j) for j in range(n)] for i in range(n)])
    found: Any = inner.charpoly().complex_roots()
    roots = [(root.real, count) for root, count in found]
    roots.sort(key=lambda pair: pair[0].mid())  # they do not overlap
    for i, (root, count) in enumerate(roots):
        (ratio,) = set(ratios[place : place + count])  # equal where frequencies are
        place += count
        if ratio != 0:
            term = one * (2 * arb(ratio) * root.sqrt())
            for other, _ in roots[:i] + roots[i + 1 :]:
                term = term * (arb_mat(inner) - one * other) * (1 / (root - other))
            total += term
    return total


#: Regimes; in those of the first two lists slip stops, to stick, and in the approach.
STICKS = ("stick_approach", "stick_restitution")
IN_APPROACH = ("stick_approach", "reversal_approach")
REGIMES = ("frictionless", "slip", "reversal_approach", "reversal_restitution", *STICKS)

#: A number that must be positive, and what is wrong where it is negative.
Condition: TypeAlias = tuple[arb, str]


def impact(
    machine: Machine, stop: Stop, regime: str, w: Sequence[Number]
) -> tuple[list[Number], list[Condition]]:
    """Velocities after an impact of a regime (sections 4 and 12), and the regime's conditions.

    With a = n M^-1 n, b = n M^-1 t, c = t M^-1 t the impulses P (normal) and Q (tangential) make
    du = -a dP + b dQ, ds = -b dP + c dQ; dQ = -mu sgn(s) dP in slip, (b/c) dP in stick.
    """
    n, r, mu = machine.size, stop.restitution, stop.friction
    normal, tangent = stop.directions(w, n)
    by_normal, by_tangent = (
        [dot(line, x) for line in machine.inverse_mass] for x in (normal, tangent)
    )
    v, u, a = w[n : 2 * n], stop.rate(w, n), dot(normal, by_normal)
    shown: list[Condition] = [(plain(u), "the bodies do not approach")]
    if (regime == "frictionless") != plain(mu).is_zero():
        raise Undecided("an impact is frictionless where friction is 0, and only there")
    if regime == "frictionless":
        impulse, tangential = (1 + r) * u / a, arb(0)
    else:
        s, b, c = dot(tangent, v), dot(normal, by_tangent), dot(tangent, by_tangent)
        if not (plain(s) > 0 or plain(s) < 0):
            raise Undecided("the slip before an impact may be 0")
        sign = 1 if plain(s) > 0 else -1
        friction = sign * mu
        k, rate = b + friction * c, a + friction * b  # ds = -k dP, du = -rate dP
        impulse = (1 + r) * u / rate
        if regime == "slip":
            shown += [(plain(rate), "slip grows"), (plain(sign * (s - k * impulse)), "slip stops")]
            tangential = -friction * impulse
        else:
            sticks, in_approach = regime in STICKS, regime in IN_APPROACH
            stopped = s / k  # P*
            # u at P*; at a wall at rest u and s vanish together, which counts as restitution
            together = stop.tip and n == 1
            bent = arb(0) if together else u - rate * stopped
            after = a - b * b / c if sticks else a - friction * b
            cone = plain(mu) * plain(c) - abs(plain(b))
            shown += [
                (plain(sign * k), "slip does not stop"),
                (cone, "slip reverses") if sticks else (-cone, "the contact sticks"),
            ]
            if in_approach:
                shown.append((plain(bent), "slip stops after the approach"))
            else:
                shown += [(plain(rate), "slip grows"), (plain(impulse - stopped), "slip goes on")]
                if not together:
                    shown.append((-plain(bent), "slip stops in the approach"))
            if in_approach or machine.law != "poisson":
                shown.append((plain(after), "the impact does not end"))
            impulse = _impulse(machine.law, r, (u, bent), stopped, (rate, after), in_approach)
            tangential = -friction * stopped + (b / c if sticks else friction) * (impulse - stopped)
    pushed = zip(v, by_normal, by_tangent, strict=True)
    return [x - y * impulse + z * tangential for x, y, z in pushed], shown


def _impulse(
    law: str,
    r: Number,
    velocities: tuple[Number, Number],
    stopped: Number,
    rates: tuple[Number, Number],
    in_approach: bool,
) -> Number:
    """P where u falls from one velocity to another at P* = `stopped`, at the one rate and then."""
    (u, bent), (rate, after) = velocities, rates
    if law == "poisson":
        return (1 + r) * (stopped + bent / after if in_approach else u / rate)
    if law == "newton":
        return stopped + (bent + r * u) / after
    if in_approach:  # twice the work of the approach
        work = (u + bent) * stopped + bent * bent / after
        return stopped + bent / after + r * (work / after).sqrt()
    left = (r * r * u * u - bent * bent) / rate  # twice what is to be returned after P*
    return stopped + (bent + (bent * bent + after * left).sqrt()) / after

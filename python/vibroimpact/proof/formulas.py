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


#: A ball, or one with a derivative: x + x' h, a power series in h of two terms.
Number: TypeAlias = arb | arb_series


def plain(x: Number) -> arb:
    """Without derivative."""
    return x[0] if isinstance(x, arb_series) else x


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

    rows: list[list[arb]]
    tangent: list[arb]
    restitution: arb
    friction: arb
    tip: bool

    def gap(self, w: Sequence[Number]) -> Number:
        """The gap g."""
        return dot(self.rows[0], w) + (w[0].sin() if self.tip else arb(0))

    def rate(self, w: Sequence[Number], n: int) -> Number:
        """Its rate g'; at an impact the approach velocity u."""
        return dot(self.rows[1], w) + (w[0].cos() * w[n] if self.tip else arb(0))

    def acceleration(self, w: Sequence[arb], n: int, first: Sequence[arb]) -> arb:
        """The second derivative g''; `first` . w is the acceleration of q_0."""
        bend = w[0].cos() * plain(dot(first, w)) - w[0].sin() * w[n] ** 2 if self.tip else arb(0)
        return plain(dot(self.rows[2], w)) + bend

    def directions(self, w: Sequence[Number], n: int) -> tuple[list[Number], list[Number]]:
        """The normal and the tangent."""
        normal, tangent = list[Number](self.rows[0][:n]), list[Number](self.tangent)
        if self.tip:
            normal[0], tangent[0] = w[0].cos(), w[0].sin()
        return normal, tangent


@dataclass(frozen=True)
class Machine:
    """Between impacts w = (q, v, 1, cos psi, sin psi) obeys w' = G w, psi = omega t + phase."""

    size: int
    generator: arb_mat
    inverse_mass: arb_mat
    stops: list[Stop]
    law: str
    omega: arb
    phase: arb
    _steps: dict[tuple[int, int, bool], arb_mat] = field(default_factory=dict, repr=False)

    @property
    def period(self) -> arb:
        """The drive period T = 2 pi/omega."""
        return 2 * arb.pi() / self.omega

    def start(self, state: Sequence[arb], time: arb) -> arb_mat:
        """The column w."""
        psi = self.omega * time + self.phase
        return arb_mat(len(state) + 3, 1, [*state, arb(1), psi.cos(), psi.sin()])

    def flow(self, time: arb) -> arb_mat:
        """exp(time G): that of the midpoint times that of the rest, which is short."""
        middle = time.mid()
        flow, rest = (self.generator * middle).exp(), time - middle
        return flow if rest.is_zero() else flow * (self.generator * rest).exp()

    def step(self, halvings: int, sign: int = 1, *, up_to: bool = False) -> arb_mat:
        """exp(s G) for s = +-2^-halvings, or for all s from 0 up to there."""
        key = (halvings, sign, up_to)
        if key not in self._steps:
            half = arb(2) ** -(halvings + 1)
            time = arb(sign * half, half) if up_to else 2 * sign * half
            self._steps[key] = (self.generator * time).exp()
        return self._steps[key]


def machine_of(
    matrices: tuple[arb_mat, arb_mat, arb_mat],
    loads: arb_mat,
    stops: Sequence[tuple[list[arb], list[arb], arb, arb]],
    drive: tuple[arb, arb],
    law: str,
    *,
    tip: bool = False,
) -> Machine:
    """From M^-1, M^-1 C, M^-1 K; M^-1 times the loads by 1, cos psi, sin psi; rows of gaps."""
    inverse, damping, stiffness = matrices
    n, (omega, phase) = inverse.nrows(), drive
    g = arb_mat(2 * n + 3, 2 * n + 3)
    for i in range(n):
        g[i, n + i] = arb(1)
        for j in range(n):
            g[n + i, j], g[n + i, n + j] = -stiffness[i, j], -damping[i, j]
        for j in range(3):
            g[n + i, 2 * n + j] = loads[i, j]
    g[2 * n + 1, 2 * n + 2], g[2 * n + 2, 2 * n + 1] = -omega, omega
    made = []
    for row, *others in stops:
        first = arb_mat(1, len(row), row)
        rows = [list(one.entries()) for one in (first, first * g, first * g * g)]
        made.append(Stop(rows, *others, tip))
    return Machine(n, g, inverse, made, law, omega, phase)


def two_bodies(number: Mapping[str, arb], contact: str, law: str, *, wall_rests: bool) -> Machine:
    """The system of sections 1 and 11 by its symbols; a wall at rest, x2 = c2, is no unknown."""
    n, tip, zero = 1 if wall_rests else 2, contact == "oblique", arb(0)

    def diagonal(*entries: arb) -> arb_mat:
        return arb_mat([[entries[i] if i == j else zero for j in range(n)] for i in range(n)])

    matrices = (
        diagonal(arb(1), number["mbar"]),
        diagonal(2 * number["zeta1"] * number["omega0"], 2 * number["zeta2"]),
        diagonal(number["omega0"] ** 2, arb(1)),
    )
    loads = [number["c1"], number["f1"], zero, number["c2"], number["f2"], zero]
    place = number["delta"] + number["c2"] if wall_rests else number["delta"]
    row = [zero if tip else arb(1), arb(-1)][:n] + [zero] * n + [-place, zero, zero]
    stop = (row, [zero] * n, number["r"], number["mu"] if tip else zero)
    drive = (number["omega"], number["phi"])
    return machine_of(matrices, arb_mat(n, 3, loads[: 3 * n]), [stop], drive, law, tip=tip)


def structure(given: Mapping[str, Any]) -> Machine:
    """The structure of section 12, of exact numbers."""
    inverse, inner = fmpq_mat(given["mass"]).inv(), fmpq_mat(given["stiffness"])
    n, inner, phase, zero = inverse.nrows(), inverse * inner, arb(given["phase"]), arb(0)
    if "damping" in given:
        damping = arb_mat(inverse * fmpq_mat(given["damping"]))
    else:
        damping = _modal_damping(inner, given["damping_ratios"])
    # Re((a + ib) e^{i psi}) = a cos psi - b sin psi
    pairs = zip(given["static_load"], given["drive_amplitude"], strict=True)
    loads = arb_mat([[arb(c), arb(a), -arb(b)] for c, (a, b) in pairs])
    stops = []
    for stop in given["stops"]:
        # cos(omega t + phase_j) = cos(psi + shift)
        shift, amplitude = arb(stop["phase"]) - phase, arb(stop["amplitude"])
        moving = [-arb(stop["gap"]), -amplitude * shift.cos(), amplitude * shift.sin()]
        row = [arb(x) for x in stop["normal"]] + [zero] * n + moving
        tangent = [arb(x) for x in stop["tangent"]]
        stops.append((row, tangent, arb(stop["restitution"]), arb(stop["friction"])))
    matrices, drive = (arb_mat(inverse), damping, arb_mat(inner)), arb(given["drive_frequency"])
    return machine_of(matrices, arb_mat(inverse) * loads, stops, (drive, phase), given["law"])


def _modal_damping(inner: fmpq_mat, ratios: Sequence[fmpq]) -> arb_mat:
    """M^-1 C of the damping ratios of the modes, by ascending frequency.

    It is the polynomial of L = M^-1 K that is 2 zeta_i w_i at its eigenvalues w_i^2.
    """
    n, place = inner.nrows(), 0
    total, one = arb_mat(n, n), arb_mat([[int(i == j) for j in range(n)] for i in range(n)])
    roots = [(root.real, count) for root, count in inner.charpoly().complex_roots()]
    roots.sort(key=lambda pair: float(pair[0]))
    for i, (root, count) in enumerate(roots):
        (ratio,) = set(ratios[place : place + count])  # equal where frequencies are
        place += count
        if ratio != 0:
            term = one * (2 * arb(ratio) * root.sqrt())
            for other, _ in roots[:i] + roots[i + 1 :]:
                term = term * (arb_mat(inner) - one * other) * (1 / (root - other))
            total += term
    return total


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
    mass = [[machine.inverse_mass[i, j] for j in range(n)] for i in range(n)]
    by_normal, by_tangent = ([dot(line, x) for line in mass] for x in (normal, tangent))
    v, u, a = w[n : 2 * n], stop.rate(w, n), dot(normal, by_normal)
    shown: list[Condition] = [(plain(u), "the bodies do not approach")]
    if regime == "frictionless":
        if not mu.is_zero():
            raise Undecided("a stop with friction has no impact without")
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
            sticks, in_approach = regime.startswith("stick"), regime.endswith("approach")
            stopped = s / k  # P*
            # u at P*; at a wall at rest u and s vanish together, which counts as restitution
            together = stop.tip and n == 1
            bent = arb(0) if together else u - rate * stopped
            after = a - b * b / c if sticks else a - friction * b
            cone = mu * plain(c) - abs(plain(b))
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
    r: arb,
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

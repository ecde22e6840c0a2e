"""Periodic motions to many digits: Newton's method on the stroboscopic map, and its multipliers.

The map P takes the state (x1, v1, x2, v2) at t = 0 to that at m T, T = 2 pi/omega, as hybrid.py
follows it: through impacts, chatter and contact (docs/theory.md, sections 3 to 7). An orbit is a
root of P(X) - X. Its Floquet multipliers are the eigenvalues of dP/dX, taken by central
differences; all shifted runs must have the orbit's own sequence of events. No tangent and no
saltation matrix is used, so that nothing here shares a formula with what it is the reference for.
Of a wall at rest (mbar = 0, f2 = 0, body 2 at 0) only body 1 is shifted: two multipliers.

Stated errors come from a second computation that differs in precision, in the tolerance of chatter
and contact and in the step of the differences. All quantities are dimensionless.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from flint import acb, acb_poly, arb, arb_mat, arb_poly, ctx, fmpq

from vibroimpact.reference.flight import Number, System, exact, rational
from vibroimpact.reference.hybrid import FINER, Run, follow, sections
from vibroimpact.reference.impact import LAWS
from vibroimpact.reference.simulate import Event
from vibroimpact.reference.slide import Settings

#: Orbits must return to themselves as closely as this.
CLOSED = 1e-40
#: Coefficients of the characteristic polynomial below this are 0: the map has lost dimensions.
LOST = 1e-20
#: Of a complete chatter, impacts that approach more slowly are not listed.
SLOWEST = 1e-3


@dataclass(frozen=True)
class Moment:
    """An event of an orbit: kind, regime of an impact, time, states just before and after it."""

    event: str
    regime: str | None
    time: arb
    pre: tuple[arb, ...]
    post: tuple[arb, ...]


@dataclass(frozen=True)
class Orbit:
    """A periodic motion at one setting: the m stroboscopic states, its events, its multipliers.

    `impacts` is None with chatter. `product` is the determinant of the map's derivative, `volume`
    what docs/theory.md, section 7, makes of it, None with contact. `gap` is |P(X) - X|.
    """

    states: list[tuple[arb, ...]]
    moments: list[Moment]
    impacts: int | None
    multipliers: list[acb]
    product: arb
    volume: arb | None
    gap: float


class StroboscopicMap:
    """P of one system over m drive periods, from a drive phase, by a law, at one setting."""

    def __init__(
        self, system: System, m: int, *, phase: Number, law: str, settings: Settings
    ) -> None:
        self.system, self.m, self.phase = system, m, phase
        self.law, self.settings = law, settings
        #: The wall at rest has no coordinates.
        self.size = 4

    def run(self, state: Sequence[fmpq]) -> Run:
        """The motion over m periods, which must not end before."""
        times = sections(self.system, self.m)
        found = follow(
            self.system, state, times, phase=self.phase, settings=self.settings, law=self.law
        )
        if found.ending != "completed":
            raise ArithmeticError(f"the motion ends: {found.ending}")
        return found

    def derivative(self, state: Sequence[fmpq], step: fmpq) -> arb_mat:
        """Central differences of P; the same sequence of events is demanded of all runs."""
        expected = sequence(self.run(state))
        columns = []
        for j in range(self.size):
            ends = []
            for sign in (1, -1):
                shifted = list(state)
                shifted[j] += sign * step
                run = self.run(shifted)
                if sequence(run) != expected:
                    raise ArithmeticError("a shifted run has other events")
                ends.append(run.samples[-1])
            columns.append([((p - q) / (2 * arb(step))).mid() for p, q in zip(*ends, strict=True)])
        return arb_mat([[columns[j][i] for j in range(self.size)] for i in range(self.size)])


def sequence(run: Run) -> list[tuple[int, str]]:
    """What a run meets, in order: the impacts with their periods and regimes, then the phases."""
    return [(hit.period, hit.regime) for hit in run.hits] + [(0, p.event) for p in run.phases]


def find(
    system: System,
    start: Sequence[Number],
    m: int,
    *,
    phase: Number = 0,
    law: str = "poisson",
    finer: bool = True,
) -> Orbit:
    """The orbit next to `start`, by Newton's method.

    Raises ArithmeticError if it does not converge, or a shifted run has other events.
    """
    settings = FINER if finer else Settings()
    strobe = StroboscopicMap(system, m, phase=phase, law=law, settings=settings)
    with ctx.workprec(settings.precision):
        state = [exact(value) for value in start]
        if system.wall_rests(*state[2:]):
            strobe.size = 2
        smooth = not strobe.run(state).phases
        # h^2, and the errors of the runs (none, 1e-60, 1e-45) divided by h
        step = fmpq(1) / fmpq(10) ** ((40 if finer else 30) if smooth else (20 if finer else 15))
        state, gap = _newton(strobe, state, step)
        return _orbit(strobe, state, step, gap)


def _newton(strobe: StroboscopicMap, state: list[fmpq], step: fmpq) -> tuple[list[fmpq], float]:
    """Newton's method until the gap |P(X) - X| no longer falls; the state and its gap."""
    slope: arb_mat | None = None
    best, closest = state, float("inf")
    for _ in range(30):
        end = strobe.run(state).samples[-1]
        miss = [end[i].mid() - arb(state[i]) for i in range(strobe.size)]
        gap = max(float(abs(value)) for value in miss)
        if gap < closest:
            best, closest = state, gap
        elif closest < CLOSED:
            return best, closest
        if gap < 1e-70:
            return state, gap
        if slope is None or gap > 1e-12:
            slope = strobe.derivative(state, step)
        identity = arb_mat(strobe.size, strobe.size, 1)
        move = (identity - slope).solve(arb_mat([[value] for value in miss]), algorithm="approx")
        moved = [rational((arb(state[i]) + move[i, 0]).mid()) for i in range(strobe.size)]
        state = moved + state[strobe.size :]
    raise ArithmeticError(f"Newton's method stays {closest} from an orbit")


def _orbit(strobe: StroboscopicMap, state: list[fmpq], step: fmpq, gap: float) -> Orbit:
    """All that is asked of an orbit, from its state at t = 0."""
    run = strobe.run(state)
    slope = strobe.derivative(state, step)
    roots = multipliers(slope)
    chatters = any(phase.event == "chatter" for phase in run.phases)
    product = arb(0) if roots[-1].is_zero() else slope.det().mid()
    return Orbit(
        states=[tuple(arb(q) for q in state), *run.samples[:-1]],
        moments=moments(run),
        impacts=None if chatters else run.impacts,
        multipliers=roots,
        product=product,
        volume=None if run.phases else volume(strobe, run.hits),
        gap=gap,
    )


def multipliers(slope: arb_mat) -> list[acb]:
    """Eigenvalues, largest first, of a conjugate pair the one with imaginary part > 0 first.

    Those that are 0 are divided out of the characteristic polynomial: they may well be defective.
    """
    coefficients = [c.mid() for c in slope.charpoly().coeffs()]
    lost = 0
    while abs(coefficients[lost]) < LOST:
        lost += 1
    poly = acb_poly(coefficients[lost:])
    isolated = arb_poly(coefficients[lost:]).complex_roots() if lost < slope.nrows() else []
    points = []
    for root in isolated:
        # balls of isolated roots, good to some nine digits; one that meets the axis is real
        point = acb(root.real.mid(), 0 if root.imag.contains(0) else root.imag.mid())
        for _ in range(8):
            newton = point - poly(point) / poly.derivative()(point)
            point = acb(newton.real.mid(), newton.imag.mid())
        points.append(point)
    points.sort(key=lambda root: (-float(abs(root).mid()), -float(root.imag)))
    return points + [acb(0)] * lost


def volume(strobe: StroboscopicMap, hits: Sequence[Event]) -> arb:
    """The determinant of dP/dX: exp(-trace) of flights times det(dv+/dv-) g'+/g'- of impacts."""
    system = strobe.system
    loss = 2 * (system.zeta1 * system.omega0 + (system.zeta2 if strobe.size == 4 else 0))
    total = (-arb(loss) * 2 * arb.pi() * strobe.m / arb(system.omega)).exp()
    step = arb(10) ** -40
    for hit in hits:
        columns = []
        for dv1, dv2 in ((step, arb(0)), (arb(0), step))[: strobe.size // 2]:
            up, down = (
                LAWS[strobe.law](system, hit.x1, hit.v1_pre + s * dv1, hit.v2_pre + s * dv2)
                for s in (1, -1)
            )
            columns.append([(up.v1 - down.v1) / (2 * step), (up.v2 - down.v2) / (2 * step)])
        cos = hit.x1.cos() if system.oblique else arb(1)
        bounce = (hit.v1_post * cos - hit.v2_post) / (hit.v1_pre * cos - hit.v2_pre)
        size = len(columns)
        total *= arb_mat([[columns[j][i] for j in range(size)] for i in range(size)]).det() * bounce
    return total.mid()


def moments(run: Run) -> list[Moment]:
    """Impacts and phases in order of time, without the slow end of a chatter."""
    ends = [phase.time for phase in run.phases if phase.event == "chatter"]
    found = []
    for hit in run.hits:
        u = hit.v1_pre * hit.x1.cos() - hit.v2_pre
        if u < SLOWEST and any(hit.time < end < hit.time + 1 for end in ends):
            continue
        pre = (hit.x1, hit.v1_pre, hit.x2, hit.v2_pre)
        post = (hit.x1, hit.v1_post, hit.x2, hit.v2_post)
        found.append(Moment("impact", hit.regime, hit.time, pre, post))
    for phase in run.phases:
        # an impact that begins a contact is among the hits
        if phase.event != "impact":
            found.append(Moment(phase.event, None, phase.time, phase.state, phase.state))
    return sorted(found, key=lambda moment: float(moment.time.mid()))


def difference(one: Orbit, two: Orbit) -> tuple[float, float]:
    """Largest difference of states and events, and of the multipliers, of two computations."""
    states = list(zip(_values(one), _values(two), strict=True))
    roots = list(zip(one.multipliers, two.multipliers, strict=True))
    return (
        max(float(abs(p - q).abs_upper()) for p, q in states),
        max(float(abs(p - q).abs_upper()) for p, q in roots),
    )


def _values(orbit: Orbit) -> list[arb]:
    """All numbers of an orbit but the multipliers."""
    found = [value for state in orbit.states for value in state]
    for moment in orbit.moments:
        found += [moment.time, *moment.pre, *moment.post]
    return found

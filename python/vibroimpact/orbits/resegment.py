"""How a branch goes on beyond a border of its sequence of legs.

At a border two sequences have one orbit in common:

- a flight that touches g = 0 there has an impact with u = 0 in the other sequence, and the other
  way round;
- an impact at the edge of its regime (P* = P_f, P* = (1 + r) P_f, |cos x1| = mu |sin x1|, x1' = 0,
  sin x1 = 0) is one of the neighbouring regime too, since the impact law is continuous;
- a slide whose x1' touches zero has a stick of no length there, and the other way round.

So the new branch starts at the border's own orbit, in the direction in which the condition of the
new sequence grows from zero. Where a contact phase ends another way the new sequence is read off a
simulation a little further on. Beyond a border where chatter becomes incomplete infinitely many
sequences follow one another: there the branch ends.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .. import _core
from ..continuation.newton import OutsideDomain, solve
from ..continuation.path import SpecialPoint
from ..run import Regime
from ..system import System
from .motion import MAX_EVENTS, motion_of, primitive
from .problem import OrbitProblem

Array = NDArray[np.float64]

# Step in units of the sizes by which the direction of a new branch is tried.
TRIAL = 1e-7
# Steps beyond a border of a contact phase at which a simulation is asked for the legs: the first
# that gives other legs. Very close to a border where chatter brings the tip to rest none may; and
# where a slide between two stops vanishes the tangent may point back, two solutions meeting there.
AHEAD = (1e-4, 1e-3, 1e-2, -1e-4, -1e-3, -1e-2)
# Impacts whose tests are this small are at their borders together.
TOGETHER = 1e-10
# A test this small at a border's own orbit vanishes there.
ON_BORDER = 1e-8
# Velocities this small at a touch are rounding.
AT_REST = 1e-6
# The orbit found there must be this close to the one expected, in units of the sizes.
NEAR = 1e-2


@dataclass(frozen=True, kw_only=True, eq=False)
class Crossing:
    """Where a branch starts or goes on.

    Attributes
    ----------
    itinerary
        The legs.
    u, p
        Nodes, flattened, and the parameter.
    tangent
        Direction of (u, p), or None: as the parameter grows.
    """

    itinerary: _core.Itinerary
    u: Array
    p: float
    tangent: Array | None


def beyond(problem: OrbitProblem, border: SpecialPoint) -> Crossing | None:
    """Return how a branch goes on beyond a border, None if it ends there."""
    kind, what, leg = parsed(border.test)
    try:
        if _has_neighbour(problem, border):
            found = _neighbour(problem, border)
        elif kind == "contact_border" and what == "x1' in the slide":
            found = _stopped(problem, border, leg)
        elif kind == "contact_border" and _slides_on(problem.itinerary, what, leg):
            found = _not_stopped(problem, border, leg)
        elif kind in ("contact_border", "regime_border"):
            steps = (_by_simulation(problem, border, ahead) for ahead in AHEAD)
            return next((crossing for crossing in steps if crossing is not None), None)
        else:
            return None
        return None if found is None else _oriented(problem, border, *found)
    except OutsideDomain:
        return None


def beside(
    problem: OrbitProblem, corner: SpecialPoint, own: str
) -> tuple[_core.Itinerary, Array, str] | None:
    """Return how a curve of borders goes on where it meets another border.

    Legs and nodes beyond that border, and the name that the curve's own test has there; None where
    another border has no neighbour, or the curve's own condition is not found again.
    """
    try:
        found = _neighbour(problem, corner) if _has_neighbour(problem, corner) else None
    except OutsideDomain:
        found = None
    if found is None:
        return None
    itinerary, nodes, crossed = found
    new = OrbitProblem(problem.system, itinerary, problem.parameters)
    mine = parsed(own)[:2]
    values = {
        test: abs(value)
        for test, value in new.border_tests(nodes.ravel(), corner.p).items()
        if parsed(test)[:2] == mine and test != crossed
    }
    same = min(values, key=lambda test: values[test], default=None)
    return (itinerary, nodes, same) if same is not None and values[same] < ON_BORDER else None


def parsed(test: str) -> tuple[str, str, int]:
    """Return kind, what vanishes, and leg of a test."""
    kind, rest = test.split(": ", 1)
    what, leg = rest.rsplit(", leg ", 1)
    return kind, what, int(leg)


# The legs beyond a border, the nodes there, and the test that grows from zero.
_New = tuple[_core.Itinerary, Array, str]


def _has_neighbour(problem: OrbitProblem, border: SpecialPoint) -> bool:
    """Whether the legs beyond a border are known: a touch, or an impact of another regime."""
    kind, _, leg = parsed(border.test)
    impact = problem.itinerary.legs[leg].startswith("impact")
    return kind == "grazing" or (kind == "regime_border" and impact)


def _neighbour(problem: OrbitProblem, border: SpecialPoint) -> _New | None:
    """The legs beyond a touch, or beyond the edge of an impact's regime."""
    kind, what, leg = parsed(border.test)
    if kind == "regime_border":
        return _other_regime(problem, border, what, leg)
    if what == "flight":
        return _struck(problem, border, leg)
    return spared(problem, border.u, border.p, leg)


def _struck(problem: OrbitProblem, border: SpecialPoint, leg: int) -> _New | None:
    """The touching flight ends in an impact with u = 0."""
    itinerary, system = problem.itinerary, problem.system_at(border.p)
    nodes = border.u.reshape(-1, 4)
    hump = itinerary.humps(system._compiled, nodes)[leg]
    if hump is None:
        return None
    touch = itinerary.state_in_leg(system._compiled, nodes, leg, hump[0])
    if touch is None:
        return None
    x1, v1, _, v2 = touch
    legs, clocks = itinerary.legs, itinerary.clocks
    circuit = legs == ["circuit"]
    start = 0.0 if circuit else clocks[leg] * system.drive_period + nodes[leg, 3]
    clock = math.floor((start + hump[0]) / system.drive_period)
    time = start + hump[0] - clock * system.drive_period
    node = np.array([x1, v1, v2, time])
    rests = abs(v1) <= AT_REST and abs(v2) <= AT_REST
    impact = _from_rest(system, touch, time) if rests else _slips(system, x1, v1)
    if circuit:
        new = _core.Itinerary([impact], itinerary.periods, [clock], itinerary.wall_at_rest)
        return new, node[None, :], "grazing: u, leg 0"
    new = _core.Itinerary(
        [*legs[:leg], impact, *legs[leg:]],
        itinerary.periods,
        [*clocks[: leg + 1], clock, *clocks[leg + 1 :]],
        itinerary.wall_at_rest,
    )
    return new, np.insert(nodes, leg + 1, node, axis=0), f"grazing: u, leg {leg}"


def _slips(system: System, x1: float, v1: float, regime: str = "slip") -> str:
    """The leg to an impact with u = 0, which as a rule slips the way the tip moves."""
    if system.friction == 0.0:
        return "impact:frictionless"
    side = "+" if system.law == "paper" or math.sin(x1) > 0.0 else "-"
    return f"impact:{regime}:{'+' if v1 > 0.0 else '-'}{side}"


def _from_rest(system: System, touch: tuple[float, float, float, float], time: float) -> str:
    """The leg to an impact with u = 0 in which both bodies are at rest.

    Just beyond, both velocities are the accelerations times the time by which it comes before the
    touch: x1'/u = a1/g'' decides the regime, not the sign of x1'.
    """
    x1, v1, _, _ = touch
    phase = system.drive_frequency * time + system.phase
    a1, a2 = system.accelerations(touch, phase)
    second = system.gap_acceleration(touch, phase)
    if system.friction == 0.0 or second >= 0.0:
        return _slips(system, x1, v1)
    before = [np.array([value]) for value in (x1, a1 / second, a2 / second)]
    regime = Regime(int(_core.impact(system._compiled, *before)["regime"][0]))
    direction = 1.0 if regime == Regime.SLIP and a1 / second == 0.0 else a1 / second
    return _slips(system, x1, direction, regime.name.lower())


def spared(problem: OrbitProblem, u: Array, p: Array, leg: int) -> _New | None:
    """Leave out the impact with u = 0 that ends a leg; None where contact begins with it."""
    itinerary, system = problem.itinerary, problem.system_at(p)
    legs, clocks = itinerary.legs, itinerary.clocks
    nodes = u.reshape(-1, 4)
    count = len(legs)
    after = (leg + 1) % count
    if count == 1:
        motion = motion_of(system, itinerary, nodes, whole=True)
        x1, v1, x2, v2 = motion.trajectory([0.0])[0]
        new = _core.Itinerary(["circuit"], 1, [0], itinerary.wall_at_rest)
        return new, np.array([[x1, v1, v2, x2]]), "grazing: flight, leg 0"
    if not legs[after].startswith("impact"):
        # What follows is contact or chatter: it has begun with this impact.
        return None
    kept = [i for i in range(count) if i != after]
    new_legs = [legs[after] if i == leg else legs[i] for i in kept]
    new = _core.Itinerary(
        new_legs, itinerary.periods, [clocks[i] for i in kept], itinerary.wall_at_rest
    )
    return new, nodes[kept], f"grazing: flight, leg {kept.index(leg)}"


def _other_regime(problem: OrbitProblem, border: SpecialPoint, what: str, leg: int) -> _New | None:
    """The impact is one of the neighbouring regime."""
    itinerary, system = problem.itinerary, problem.system_at(border.p)
    legs, nodes = itinerary.legs, border.u.reshape(-1, 4)
    angles = itinerary.before_events(system._compiled, nodes)[:, 0]
    # In a symmetric orbit several impacts may be at their borders at once.
    together = [
        other
        for kind, other, name, value, _ in itinerary.tests(system._compiled, nodes)
        if kind == "regime_border"
        and name == what
        and abs(value) <= TOGETHER
        and legs[other].startswith("impact")
    ]
    changed = list(legs)
    for other in {leg, *together}:
        new_leg = _beyond_edge(legs[other], what, system, float(angles[other]))
        if new_leg is None:
            return None
        changed[other] = new_leg
    new = _core.Itinerary(changed, itinerary.periods, itinerary.clocks, itinerary.wall_at_rest)
    test = border.test
    if system.restitution == 0.0 and what.startswith("P* = "):
        # Both edges are one: from slip to approach, and back.
        edge = "P* = (1 + r) P_f" if ":slip:" in changed[leg] else "P* = P_f"
        test = f"regime_border: {edge}, leg {leg}"
    return new, nodes, test


def _beyond_edge(leg: str, what: str, system: System, x1: float) -> str | None:
    """Return the leg to an impact of the neighbouring regime."""
    _, regime, signs = leg.split(":")
    sticks = abs(math.cos(x1)) <= system.friction * abs(math.sin(x1))
    bends = "stick" if sticks else "reversal"
    flipped = {"+": "-", "-": "+"}
    direction, side = signs[0], signs[1]
    if what == "sin x1 = 0":
        side = flipped[side]
    elif what.startswith("P* = ") and system.restitution == 0.0:
        regime = f"{bends}_approach" if regime == "slip" else "slip"
    elif what == "P* = (1 + r) P_f":
        regime = f"{bends}_restitution" if regime == "slip" else "slip"
    elif what == "P* = P_f":
        how, stage = regime.split("_")
        regime = f"{how}_{'restitution' if stage == 'approach' else 'approach'}"
    elif what == "|cos x1| = mu |sin x1|":
        how, stage = regime.split("_")
        regime = f"{'stick' if how == 'reversal' else 'reversal'}_{stage}"
    elif what == "x1' = 0 before":
        direction = flipped[direction]
        if not sticks:
            # From rest the tip slips with s = -sgn(cos x1); the other way it turns round at once.
            regime = "reversal_approach" if regime == "slip" else "slip"
    else:
        return None
    return f"impact:{regime}:{direction}{side}"


def _slides_on(itinerary: _core.Itinerary, what: str, leg: int) -> bool:
    """Whether a leg of no length is a stick between two slides in the same direction."""
    legs = itinerary.legs
    before = legs[leg - 1]
    same = before.endswith(":stop") and legs[leg] == f"stick:{before.removesuffix(':stop')}"
    return what == "length of the phase" and same and len(legs) > 2


def _not_stopped(problem: OrbitProblem, border: SpecialPoint, leg: int) -> _New:
    """The slide goes on through a stick of no length."""
    itinerary, nodes = problem.itinerary, border.u.reshape(-1, 4)
    legs, clocks = itinerary.legs, itinerary.clocks
    count = len(legs)
    first, last = (leg - 1) % count, (leg + 1) % count
    legs[first] = legs[last]
    kept = [i for i in range(count) if i not in (leg, last)]
    new = _core.Itinerary(
        [legs[i] for i in kept],
        itinerary.periods,
        [clocks[i] for i in kept],
        itinerary.wall_at_rest,
    )
    return new, nodes[kept], f"contact_border: x1' in the slide, leg {kept.index(first)}"


def _stopped(problem: OrbitProblem, border: SpecialPoint, leg: int) -> _New | None:
    """The slide whose x1' touches zero stops there, for no time."""
    itinerary, system = problem.itinerary, problem.system_at(border.p)
    nodes = border.u.reshape(-1, 4)
    tests = itinerary.tests(system._compiled, nodes)
    times = [time for _, i, name, _, time in tests if (i, name) == (leg, "x1' in the slide")]
    state = itinerary.state_in_leg(system._compiled, nodes, leg, times[0]) if times else None
    if state is None:
        return None
    legs, clocks, period = itinerary.legs, itinerary.clocks, system.drive_period
    start = clocks[leg] * period + nodes[leg, 3] + times[0]
    clock = math.floor(start / period)
    node = np.array([state[0], 0.0, 0.0, start - clock * period])
    slide = legs[leg].split(":")[0]
    new = _core.Itinerary(
        [*legs[:leg], f"{slide}:stop", f"stick:{slide}", *legs[leg:]],
        itinerary.periods,
        [*clocks[: leg + 1], clock, clock, *clocks[leg + 1 :]],
        itinerary.wall_at_rest,
    )
    nodes = np.insert(nodes, [leg + 1, leg + 1], node, axis=0)
    return new, nodes, f"contact_border: length of the phase, leg {leg + 1}"


def _oriented(
    problem: OrbitProblem, border: SpecialPoint, itinerary: _core.Itinerary, nodes: Array, test: str
) -> Crossing | None:
    """The tangent of the new branch along which its test grows from zero."""
    shorter, cut = primitive(problem.system_at(border.p), itinerary, nodes)
    if len(cut) < len(nodes):
        kind, what, leg = parsed(test)
        itinerary, nodes, test = shorter, cut, f"{kind}: {what}, leg {leg % len(cut)}"
    new = OrbitProblem(problem.system, itinerary, problem.parameters)
    u = nodes.ravel()
    sizes = np.append(new.scale(u), 1.0)
    _, jacobian = new.residual(u, border.p)
    if not np.isfinite(jacobian).all():
        return None
    _, _, right = np.linalg.svd(jacobian * sizes)
    tangent = right[-1] * sizes

    def grown(step: float) -> float:
        z = np.append(u, border.p) + step * tangent
        system = new.system_at(z[-1:])
        for kind, leg, name, value, _ in itinerary.tests(system._compiled, z[:-1].reshape(-1, 4)):
            if f"{kind}: {name}, leg {leg}" == test:
                return value
        return -math.inf

    forth, back = grown(TRIAL), grown(-TRIAL)
    if forth == back or max(forth, back) <= 0.0:
        return None
    tangent = tangent if forth > back else -tangent
    return Crossing(itinerary=itinerary, u=u, p=float(border.p[0]), tangent=tangent)


def _by_simulation(problem: OrbitProblem, border: SpecialPoint, step: float) -> Crossing | None:
    """The legs of a simulation a little beyond the border."""
    sizes = problem.scale(border.u)
    ahead = border.z + step * border.tangent
    p = ahead[-1:]
    system = problem.system_at(p)
    virtual = motion_of(system, problem.itinerary, ahead[:-1].reshape(-1, 4), whole=True)
    start = virtual.sections[0]
    if not np.isfinite(start).all():
        return None
    found, _ = _core.Itinerary.follow(
        system._compiled, tuple(start.tolist()), virtual.m, MAX_EVENTS
    )
    if found is None or found[0].legs == problem.itinerary.legs:
        return None
    itinerary, nodes = found
    new = OrbitProblem(problem.system, itinerary, problem.parameters)
    u, report = solve(new, nodes.ravel(), p)
    if not report.converged:
        return None
    motion = motion_of(system, itinerary, u.reshape(-1, 4), whole=True)
    off = np.abs(motion.sections[0] - start).max()
    if not motion.admissible or off > NEAR * max(1.0, float(sizes.max())):
        return None
    _, jacobian = new.residual(u, p)
    _, _, right = np.linalg.svd(jacobian * np.append(new.scale(u), 1.0))
    tangent = right[-1] * np.append(new.scale(u), 1.0)
    tangent *= math.copysign(1.0, tangent[-1] * float(p[0] - border.p[0]))
    return Crossing(itinerary=itinerary, u=u, p=float(p[0]), tangent=tangent)

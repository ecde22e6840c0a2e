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
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .. import _core
from .._core import (
    Border,
    BorderKind,
    Condition,
    Leg,
    LegEnd,
    LegKind,
    Regime,
    StopCondition,
    StopLeg,
)
from ..continuation.newton import OutsideDomain, solve
from ..continuation.path import SpecialPoint
from ..system import System
from .problem import OrbitProblem
from .verdict import MAX_EVENTS, motion_of, primitive

Array = NDArray[np.float64]
# The legs beyond a border, the nodes there, and the test that grows from zero.
_New = tuple[_core.Itinerary, Array, Condition]

# Step in units of the sizes by which the direction of a new branch is tried.
_TRIAL = 1e-7
# Steps beyond a border of a contact phase at which a simulation gives the legs; the first that
# gives other legs is used. Very close to a border where chatter brings the tip to rest there may be
# no other legs. Where a slide between two stops vanishes two solutions meet, and the tangent may
# point back.
_AHEAD = (1e-4, 1e-3, 1e-2, -1e-4, -1e-3, -1e-2)
# Impacts whose tests are this small are at their borders together.
_TOGETHER = 1e-10
# A test that is this small at the orbit of a border counts as zero there.
_VANISHES = 1e-8
# Velocities below this at a touch are rounding.
AT_REST = 1e-6
# The orbit found there must be this close to the one expected, in units of the sizes.
_NEAR = 1e-2


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

    itinerary: Any
    u: Array
    p: float
    tangent: Array | None


def beyond(problem: OrbitProblem, border: SpecialPoint) -> Crossing | None:
    """Return how a branch goes on beyond a border, None if it ends there."""
    test: Condition = border.test
    try:
        if _has_neighbour(problem, test):
            found = _neighbour(problem, border)
        elif test.border is Border.SPEED_IN_SLIDE:
            found = _stopped(problem, border, test)
        elif _slides_on(problem.itinerary, test):
            found = _not_stopped(problem, border, test.leg)
        elif test.kind in (BorderKind.CONTACT_BORDER, BorderKind.REGIME_BORDER):
            steps = (_by_simulation(problem, border, ahead) for ahead in _AHEAD)
            return next((crossing for crossing in steps if crossing is not None), None)
        else:
            return None
        return None if found is None else oriented(problem, border.p, *found)
    except OutsideDomain:
        return None


def beside(problem: OrbitProblem, corner: SpecialPoint, own: Condition) -> _New | None:
    """Return how a curve of borders goes on where it meets another border.

    Returns legs and nodes beyond that border, and the curve's own test there; None where the other
    border has no neighbour, or the curve's own condition is not found again.
    """
    try:
        known = _has_neighbour(problem, corner.test)
        found = _neighbour(problem, corner) if known else None
    except OutsideDomain:
        found = None
    if found is None:
        return None
    itinerary, nodes, crossed = found
    new = OrbitProblem(problem.system, itinerary, problem.parameters)
    values = {
        test: abs(value)
        for test, value in new.border_tests(nodes.ravel(), corner.p).items()
        if test.border is own.border and test != crossed
    }
    same: Any = min(values, key=lambda test: values[test], default=None)
    return (itinerary, nodes, same) if same is not None and values[same] < _VANISHES else None


def _has_neighbour(problem: OrbitProblem, test: Condition) -> bool:
    """Whether the legs beyond a border are known: a touch, or an impact of another regime."""
    impact = problem.itinerary.legs[test.leg].kind is LegKind.IMPACT
    return test.kind is BorderKind.GRAZING or (test.kind is BorderKind.REGIME_BORDER and impact)


def _neighbour(problem: OrbitProblem, border: SpecialPoint) -> _New | None:
    """The legs beyond a touch, or beyond the edge of an impact's regime."""
    test: Condition = border.test
    if test.kind is BorderKind.REGIME_BORDER:
        return _other_regime(problem, border, test)
    if test.border is Border.FLIGHT:
        return _struck(problem, border, test.leg)
    return spared(problem, border.u, border.p, test.leg)


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
    circuit = legs == [Leg.CIRCUIT]
    start = 0.0 if circuit else clocks[leg] * system.drive_period + nodes[leg, 3]
    clock = math.floor((start + hump[0]) / system.drive_period)
    time = start + hump[0] - clock * system.drive_period
    node = np.array([x1, v1, v2, time])
    rests = abs(v1) <= AT_REST and abs(v2) <= AT_REST
    impact = _from_rest(system, touch, time) if rests else _slips(system, x1, v1)
    if circuit:
        new = _core.Itinerary([impact], itinerary.periods, [clock], itinerary.wall_at_rest)
        return new, node[None, :], Condition(Border.APPROACH_VELOCITY, 0)
    new = _core.Itinerary(
        [*legs[:leg], impact, *legs[leg:]],
        itinerary.periods,
        [*clocks[: leg + 1], clock, *clocks[leg + 1 :]],
        itinerary.wall_at_rest,
    )
    touch_test = Condition(Border.APPROACH_VELOCITY, leg)
    return new, np.insert(nodes, leg + 1, node, axis=0), touch_test


def _slips(system: System, x1: float, v1: float, regime: Regime = Regime.SLIP) -> Leg:
    """The leg to an impact with u = 0, which usually slips in the direction of the tip's motion."""
    if system.friction == 0.0:
        return Leg.impact(Regime.FRICTIONLESS)
    side = 1 if system.law == "paper" or system.tip(x1) > 0.0 else -1
    return Leg.impact(regime, 1 if v1 > 0.0 else -1, side)


def _from_rest(system: System, touch: tuple[float, float, float, float], time: float) -> Leg:
    """The leg to an impact with u = 0 in which both bodies are at rest.

    Just beyond the border the impact comes before the touch, and both velocities are the
    accelerations times this time. So x1'/u = a1/g'' decides the regime, not the sign of x1'.
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
    return _slips(system, x1, direction, regime)


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
        new = _core.Itinerary([Leg.CIRCUIT], 1, [0], itinerary.wall_at_rest)
        return new, np.array([[x1, v1, v2, x2]]), Condition(Border.FLIGHT, 0)
    if legs[after].kind is not LegKind.IMPACT:
        # Contact or chatter follows, which has begun with this impact.
        return None
    kept = [i for i in range(count) if i != after]
    new_legs = [legs[after] if i == leg else legs[i] for i in kept]
    new = _core.Itinerary(
        new_legs, itinerary.periods, [clocks[i] for i in kept], itinerary.wall_at_rest
    )
    return new, nodes[kept], Condition(Border.FLIGHT, kept.index(leg))


def _other_regime(problem: OrbitProblem, border: SpecialPoint, test: Condition) -> _New | None:
    """The impact has the neighbouring regime."""
    itinerary, system = problem.itinerary, problem.system_at(border.p)
    legs, nodes = itinerary.legs, border.u.reshape(-1, 4)
    angles = itinerary.before_events(system._compiled, nodes)[:, 0]
    # In a symmetric orbit several impacts may be at their borders at once.
    together = [
        other.leg
        for other, value, _ in itinerary.tests(system._compiled, nodes)
        if other.border is test.border
        and abs(value) <= _TOGETHER
        and legs[other.leg].kind is LegKind.IMPACT
    ]
    changed = list(legs)
    for other in {test.leg, *together}:
        new_leg = _beyond_edge(legs[other], test.border, system, float(angles[other]))
        if new_leg is None:
            return None
        changed[other] = new_leg
    new = _core.Itinerary(changed, itinerary.periods, itinerary.clocks, itinerary.wall_at_rest)
    if system.restitution == 0.0 and test.border in _STOPS:
        # Here both edges coincide: from slip to approach, and back.
        slips = changed[test.leg].regime is Regime.SLIP
        edge = Border.STOP_AT_END_OF_IMPACT if slips else Border.STOP_AT_END_OF_APPROACH
        test = Condition(edge, test.leg)
    return new, nodes, test


# Edges at which slip stops.
_STOPS = (Border.STOP_AT_END_OF_APPROACH, Border.STOP_AT_END_OF_IMPACT)
# Regimes of a tip that has stopped: it slips back or sticks, in approach or in restitution.
_REVERSAL = (Regime.REVERSAL_APPROACH, Regime.REVERSAL_RESTITUTION)
_STICK = (Regime.STICK_APPROACH, Regime.STICK_RESTITUTION)
_OTHER_STAGE = dict(zip(_REVERSAL + _STICK, _REVERSAL[::-1] + _STICK[::-1], strict=True))
_OTHER_WAY = dict(zip(_REVERSAL + _STICK, _STICK + _REVERSAL, strict=True))


def _beyond_edge(leg: Leg, edge: Border, system: System, x1: float) -> Leg | None:
    """Return the leg to an impact of the neighbouring regime."""
    if edge is Border.SIDE_OF_IMPACT and leg.regime is not None:
        return Leg.impact(leg.regime, leg.direction, -leg.side)
    sticks = system._compiled.is_in_friction_cone(x1)
    found = beyond_edge(leg, edge, sticks=sticks, plastic=system.restitution == 0.0)
    return None if found is None else Leg.impact(*found, leg.side)


def beyond_edge(
    leg: Leg | StopLeg, edge: Border, *, sticks: bool, plastic: bool
) -> tuple[Regime, int] | None:
    """Return regime and direction of slip beyond an edge of the regime of an impact.

    ``sticks``: friction holds a contact point that has come to rest; ``plastic``: r = 0.
    """
    regime, direction = leg.regime, leg.direction
    in_approach, in_restitution = _STICK if sticks else _REVERSAL
    if regime is None:
        return None
    if edge in _STOPS and plastic:
        return (in_approach if regime is Regime.SLIP else Regime.SLIP), direction
    if edge is Border.STOP_AT_END_OF_IMPACT:
        return (in_restitution if regime is Regime.SLIP else Regime.SLIP), direction
    if edge is Border.STOP_AT_END_OF_APPROACH:
        return _OTHER_STAGE[regime], direction
    if edge is Border.FRICTION_CONE:
        return _OTHER_WAY[regime], direction
    if edge is Border.SLIP_BEFORE:
        if not sticks:
            # From rest the tip slips with s = -sgn(cos x1); the other way it turns round at once.
            regime = Regime.REVERSAL_APPROACH if regime is Regime.SLIP else Regime.SLIP
        return regime, -direction
    return None


def _slides_on(itinerary: _core.Itinerary, test: Condition) -> bool:
    """Whether a leg of no length is a stick between two slides in the same direction."""
    legs = itinerary.legs
    before, leg = legs[test.leg - 1], legs[test.leg]
    same = before.end is LegEnd.STOP and leg == Leg.stick(_SLIDES[before.direction])
    return test.border is Border.LENGTH and same and len(legs) > 2


# How a stick ends in a slide, by the sign of x1'.
_SLIDES = {1: LegEnd.SLIDE_POSITIVE, -1: LegEnd.SLIDE_NEGATIVE}


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
    return new, nodes[kept], Condition(Border.SPEED_IN_SLIDE, kept.index(first))


def _stopped(problem: OrbitProblem, border: SpecialPoint, test: Condition) -> _New | None:
    """The slide whose x1' touches zero stops there, for no time."""
    itinerary, system = problem.itinerary, problem.system_at(border.p)
    nodes = border.u.reshape(-1, 4)
    tests, leg = itinerary.tests(system._compiled, nodes), test.leg
    times = [time for other, _, time in tests if other == test]
    state = itinerary.state_in_leg(system._compiled, nodes, leg, times[0]) if times else None
    if state is None:
        return None
    legs, clocks, period = itinerary.legs, itinerary.clocks, system.drive_period
    start = clocks[leg] * period + nodes[leg, 3] + times[0]
    clock = math.floor(start / period)
    node = np.array([state[0], 0.0, 0.0, start - clock * period])
    direction = legs[leg].direction
    stop = [Leg.slide(direction, LegEnd.STOP), Leg.stick(_SLIDES[direction])]
    new = _core.Itinerary(
        [*legs[:leg], *stop, *legs[leg:]],
        itinerary.periods,
        [*clocks[: leg + 1], clock, clock, *clocks[leg + 1 :]],
        itinerary.wall_at_rest,
    )
    nodes = np.insert(nodes, [leg + 1, leg + 1], node, axis=0)
    return new, nodes, Condition(Border.LENGTH, leg + 1)


def on_leg(test: Any, leg: int) -> Any:
    """Return the condition of another leg."""
    if isinstance(test, StopCondition):
        return StopCondition(test.border, leg, test.stop)
    return Condition(test.border, leg)


def oriented(
    problem: OrbitProblem, p: Array, itinerary: Any, nodes: Array, test: Any
) -> Crossing | None:
    """The tangent of the new branch along which its test grows from zero."""
    shorter, cut = primitive(problem.system_at(p).drive_period, itinerary, nodes)
    if len(cut) < len(nodes):
        itinerary, nodes, test = shorter, cut, on_leg(test, test.leg % len(cut))
    new = problem.of(itinerary)
    u = nodes.ravel()
    sizes = np.append(new.scale(u), 1.0)
    _, jacobian = new.residual(u, p)
    if not np.isfinite(jacobian).all():
        return None
    _, _, right = np.linalg.svd(jacobian * sizes)
    tangent = right[-1] * sizes

    def grown(step: float) -> float:
        z = np.append(u, p) + step * tangent
        return new.border_tests(z[:-1], z[-1:]).get(test, -math.inf)

    forth, back = grown(_TRIAL), grown(-_TRIAL)
    if forth == back or max(forth, back) <= 0.0:
        return None
    tangent = tangent if forth > back else -tangent
    return Crossing(itinerary=itinerary, u=u, p=float(p[0]), tangent=tangent)


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
    if not motion.admissible or off > _NEAR * max(1.0, float(sizes.max())):
        return None
    _, jacobian = new.residual(u, p)
    _, _, right = np.linalg.svd(jacobian * np.append(new.scale(u), 1.0))
    tangent = right[-1] * np.append(new.scale(u), 1.0)
    tangent *= math.copysign(1.0, tangent[-1] * float(p[0] - border.p[0]))
    return Crossing(itinerary=itinerary, u=u, p=float(p[0]), tangent=tangent)

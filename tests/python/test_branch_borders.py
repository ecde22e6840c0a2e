"""Borders along branches: what vanishes there, and which legs simulations pass on both sides.

Located points are checked against the definition of their kind, worked out here from single impacts
and simulated flights.
"""

import math

import numpy as np
import pytest

import sizes
import vibroimpact as vi
from branch_cases import CASES, branch_of, gap_of, room_at
from vibroimpact import _core
from vibroimpact._core import Border, Leg, LegEnd, LegKind


@pytest.fixture(scope="module", params=CASES)
def case(request):
    return request.param


def highest_gap(motion, leg, length, near):
    """Largest gap near a time of the free flight from the start of a leg, by simulation.

    The flight is that of a system whose bodies are too far apart to meet.
    """
    system = motion.system
    node = motion.nodes[leg]
    if motion.legs == (Leg.CIRCUIT,):
        initial, phase = (node[0], node[1], node[3], node[2]), 0.0
    else:
        tip = math.sin(node[0]) if system.contact == "oblique" else node[0]
        initial = (node[0], node[1], tip - system.gap, node[2])
        phase = system.drive_frequency * node[3]
    apart = system.replace(gap=system.gap + 10.0, phase=system.phase + phase)
    run = vi.simulate(apart, initial=initial, time=length)
    width = 1e-2
    for _ in range(9):
        times = np.linspace(max(0.0, near - width), min(length, near + width), 41)
        gaps = gap_of(system, run.trajectory(times))
        near, width = times[gaps.argmax()], width / 10.0
    assert 0.0 < near < length
    return gaps.max()


def length_of(motion, leg):
    after = (leg + 1) % len(motion.legs)
    turns = motion.clocks[after] - motion.clocks[leg] + (motion.m if after <= leg else 0)
    passed = 0.0 if motion.legs == (Leg.CIRCUIT,) else motion.nodes[after, 3] - motion.nodes[leg, 3]
    return turns * motion.system.drive_period + passed


def test_flights_touch_at_a_grazing(case):
    for found in branch_of(case).of_kind("grazing"):
        motion, leg = found.motion, found.test.leg
        if found.test.border is Border.APPROACH_VELOCITY:
            # The impact has no impulse: the flight goes on beyond it.
            near = length_of(motion, leg)
            length = near + 0.5 * length_of(motion, (leg + 1) % len(motion.legs))
        else:
            hump = motion.itinerary.humps(motion.system._compiled, motion.nodes)[leg]
            near, length = hump[0], length_of(motion, leg)
        assert abs(highest_gap(motion, leg, length, near)) < 1e-12


def regime_at(system, x1, v1, v2):
    return vi.Regime(int(vi.impact(system, x1=x1, v1=v1, v2=v2)["regime"])).name.lower()


def test_impacts_are_at_the_edge_of_their_regime(case):
    for found in branch_of(case).of_kind("regime_border"):
        motion, leg = found.motion, found.test.leg
        if motion.legs[leg].kind is not LegKind.IMPACT:
            continue
        system = motion.system
        x1, v1, _, v2 = motion.itinerary.before_events(system._compiled, motion.nodes)[leg]
        s, side = motion.legs[leg].direction, motion.legs[leg].side
        k = math.cos(x1) + system.friction * s * side * math.sin(x1)
        u = v1 * math.cos(x1) - v2
        stop, approach = v1 / k, u / (system.mass_ratio + k * math.cos(x1))
        what = found.test.border
        small = 1e-12
        shift = 1e-6 * np.array([[-1.0], [1.0]])
        if what is Border.STOP_AT_END_OF_APPROACH:
            assert stop == pytest.approx(approach, abs=small)
            sides = regimes_around(system, (x1, v1, v2), shift * (0.0, v1, v1 * math.cos(x1)))
            assert {name.split("_")[1] for name in sides} == {"approach", "restitution"}
        elif what is Border.STOP_AT_END_OF_IMPACT:
            assert stop == pytest.approx((1.0 + system.restitution) * approach, abs=small)
            sides = regimes_around(system, (x1, v1, v2), shift * (0.0, v1, v1 * math.cos(x1)))
            assert len(sides) == 2
            assert "slip" in sides
        elif what is Border.FRICTION_CONE:
            assert abs(math.cos(x1)) == pytest.approx(
                system.friction * abs(math.sin(x1)), abs=small
            )
            sides = regimes_around(system, (x1, v1, v2), shift * (1.0, 0.0, 0.0))
            assert {name.split("_")[0] for name in sides} == {"reversal", "stick"}
        elif what is Border.SLIP_BEFORE:
            assert abs(v1) < small
            sides = regimes_around(system, (x1, 0.0, v2), shift * (0.0, 1.0, 0.0))
            sticks = abs(math.cos(x1)) <= system.friction * abs(math.sin(x1))
            assert sides == ({"stick_approach"} if sticks else {"slip", "reversal_approach"})
        else:
            assert what is Border.SIDE_OF_IMPACT
            assert abs(math.sin(x1)) < small
            sides = regimes_around(system, (x1, v1, v2), shift * (1.0, 0.0, 0.0))
            assert sides == {motion.legs[leg].regime.name.lower()}


def regimes_around(system, impact, shifts):
    return {regime_at(system, *(np.array(impact) + shift)) for shift in shifts}


def test_what_holds_a_contact_phase_is_zero_at_its_border(case):
    for found in branch_of(case).of_kind("contact_border"):
        motion, leg = found.motion, found.test.leg
        if found.test.border is Border.LENGTH:
            assert abs(length_of(motion, leg)) < 1e-12
        if found.test.border is Border.SLIP_AT_START:
            # The tip is at rest at the edge of the cone, or moves with x1' = 0.
            assert abs(motion.nodes[leg, 1]) < 1e-10
        assert abs(found.test_value) < 1e-12


def test_chatter_onset_is_where_the_contact_force_vanishes():
    branch = branch_of("chatter")
    (onset,) = branch.of_kind("chatter_onset")
    # Kept, so that a change is seen; that it is the onset is shown below.
    assert onset.value == pytest.approx(0.480061464791, abs=1e-11)
    assert branch.ends[1] == "chatter_onset"
    motion, system = onset.motion, onset.motion.system
    leg = motion.legs.index(Leg.slide(1, LegEnd.RELEASE))
    x1, v1, v2, time = motion.nodes[leg]
    x2 = math.sin(x1) - system.gap
    drive = math.cos(system.drive_frequency * time)
    w0, (z1, z2) = system.frequency_ratio, (system.pendulum_damping, system.oscillator_damping)
    a1 = system.moment_amplitude * drive - 2 * z1 * w0 * v1 - w0**2 * x1
    a2 = system.force_amplitude * drive - 2 * z2 * v2 - x2
    assert abs(a1 * math.cos(x1) - v1**2 * math.sin(x1) - a2) < 1e-11
    for beyond, infinite in ((-1e-4, True), (1e-4, False)):
        there = system.replace(drive_frequency=onset.value + beyond)
        run = vi.simulate(there, initial=motion.initial, periods=400, keep=40)
        assert run.period.m == 1
        assert (run.period.n == math.inf) == infinite


def rotated(legs, other):
    return any(legs[i:] + legs[:i] == other for i in range(len(legs)))


def significant(legs):
    """Leave out the impacts that lead into chatter, whose number is a matter of choice."""
    twice = legs + legs
    kept = []
    for leg in twice:
        while leg == Leg.CHATTER and kept and kept[-1].kind is LegKind.IMPACT:
            kept.pop()
        kept.append(leg)
    if Leg.CHATTER not in legs:
        return legs
    first = kept.index(Leg.CHATTER)
    return kept[first : kept.index(Leg.CHATTER, first + 1)]


def sides_confirmed(branch):
    """Compare the legs next to borders with simulations; the number of those compared."""
    compared = 0
    for first, second in zip(branch.pieces, branch.pieces[1:], strict=False):
        if first.itinerary.legs == second.itinerary.legs:
            continue  # the start
        for piece, k in ((first, -2), (second, 1)):
            if len(piece.values) < 3 or np.abs(piece.multipliers[k]).max() > 0.95:
                continue
            motion = piece.motion(k)
            assert motion.admissible, motion.why_not
            start = np.array(motion.initial)
            if room_at(motion) > 1e-6:
                start[1] += 1e-7
            run = vi.simulate(motion.system, initial=start, periods=400 * motion.m, keep=0)
            found, reason = _core.Itinerary.follow(
                motion.system._compiled, run.final_state.state, motion.m, 10_000
            )
            assert found is not None, reason
            assert rotated(significant(found[0].legs), significant(piece.itinerary.legs))
            compared += 1
    return compared


def test_simulations_on_both_sides_of_borders_have_the_legs_of_the_branch():
    assert sum(sides_confirmed(branch_of(name)) for name in CASES) > 80


@pytest.mark.parametrize("friction", sizes.either([0.2, 0.5], [0.05, 0.2, 0.5]))
def test_a_free_motion_grazes_a_body_at_rest(friction):
    # At the touch both velocities vanish with u: what the first impact does follows from the
    # accelerations. The place in closed form: the amplitude of x1 reaches asin(gap).
    system = vi.System(
        mass_ratio=0.4,
        frequency_ratio=1.5,
        restitution=0.7,
        gap=0.3,
        drive_frequency=2.6,
        damping=(0.02, 0.02),
        moment_amplitude=0.8,
        friction=friction,
    )
    stiffness = (0.8 / np.arcsin(0.3)) ** 2
    w, zeta = 1.5, 0.02
    roots = np.roots([1.0, 2.0 * w * w * (2.0 * zeta**2 - 1.0), w**4 - stiffness])
    exact = np.sqrt(roots.max())
    free = vi.simulate(system, initial=(-0.17, 0.0, 0.0, 0.0), periods=1000).refine()
    assert free.label == "1-0"
    downwards = vi.follow_motion(free, drive_frequency=(2.0, 2.8))
    branches = [downwards]
    if friction < 0.5:  # above, the 1-1 motion has doubled at 2.2
        struck = vi.simulate(
            system.replace(drive_frequency=2.2), initial=(0.0, 0.5, 0.0, 0.0), periods=2000
        ).refine()
        assert struck.label == "1-1"
        small = {"max_step": sizes.either(0.005, 0.001), "max_points": 20_000}
        for options in ({}, small):
            branches.append(vi.follow_motion(struck, drive_frequency=(2.1, 2.8), **options))
    for branch in branches:
        (grazing,) = (found for found in branch.bifurcations if found.kind == "grazing")
        assert grazing.value == pytest.approx(exact, rel=1e-9)
        assert branch.ends == ("bound", "bound")

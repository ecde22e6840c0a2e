"""Branches of periodic motions: bifurcations, borders, switching, and what simulations say of them.

Located points are checked against the definition of their kind, worked out here from multipliers,
single impacts and simulated flights; closed forms of the classical impact oscillator; and runs on
both sides of every border.
"""

import functools
import math

import numpy as np
import pytest

import vibroimpact as vi
from references import reference, scene_system
from test_interrupt import ctrl_c
from vibroimpact import _core

REFERENCE = reference("orbits_reference.json")
PAPER = {
    "mass_ratio": 0.6,
    "frequency_ratio": 2.0,
    "restitution": 0.8,
    "gap": 0.5,
    "moment_amplitude": 1.0,
}
DAMPED = {**PAPER, "damping": (0.1, 0.1), "force_amplitude": 1.5}


def settled(**parameters):
    """Return the motion on which a run from the paper's initial state settles."""
    run = vi.simulate(vi.System(**parameters), initial=(0, 0.5, 0, 0), periods=600, keep=100)
    motion = run.refine()
    assert motion, motion
    return motion


def known(name):
    """Return a motion of the reference."""
    scene = REFERENCE[name]
    system = scene_system(scene).replace(contact=scene["contact"], law=scene["law"])
    initial = [float(value) for value in scene["stroboscopic"][0]]
    return vi.periodic_motion(system, initial=initial, periods=scene["m"])


# A motion, and the parameter over which it is followed.
CASES = {
    "one_one": (lambda: settled(**PAPER, drive_frequency=1.8), {"drive_frequency": (1.4, 2.5)}),
    "four_five": (lambda: known("9_3_four_five"), {"drive_frequency": (1.5, 1.65)}),
    "six_seven": (lambda: known("9_3_six_seven"), {"drive_frequency": (1.5, 1.65)}),
    "chatter": (lambda: known("7c_0.45"), {"drive_frequency": (0.44, 1.0)}),
    "chatter_friction": (
        lambda: settled(**DAMPED, drive_frequency=0.44, friction=0.5),
        {"drive_frequency": (0.43, 0.48)},
    ),
    "slides_and_sticks": (lambda: known("slide_crossing"), {"drive_frequency": (0.38, 0.6)}),
    "chatter_into_stick": (lambda: known("chatter_into_stick"), {"friction": (0.5, 1.5)}),
    "force": (lambda: settled(**DAMPED, drive_frequency=0.75), {"force_amplitude": (0.45, 2.85)}),
    "damping": (lambda: settled(**DAMPED, drive_frequency=0.75), {"pendulum_damping": (0, 0.5)}),
    "gap": (lambda: known("slip_reversals_stick"), {"gap": (-0.5, 0.0)}),
    "restitution": (lambda: known("slip_reversal_approach"), {"restitution": (0.36, 1.0)}),
    "friction": (lambda: known("slip_stick_restitution"), {"friction": (0.0, 2.0)}),
    "mass_ratio": (lambda: known("reversal_stick_stick"), {"mass_ratio": (0.5, 2.0)}),
    "newton": (lambda: known("newton_reversals"), {"drive_frequency": (1.535, 3.0)}),
    "direct": (lambda: known("direct"), {"drive_frequency": (0.7, 2.5)}),
    "no_impact": (lambda: known("no_impact"), {"drive_frequency": (1.45, 3.0)}),
}


@functools.cache
def motion_of_case(name):
    return CASES[name][0]()


@functools.cache
def branch_of(name):
    return vi.follow_motion(motion_of_case(name), **CASES[name][1])


@pytest.fixture(scope="module", params=CASES)
def case(request):
    return request.param


def events(branch):
    """Kind and place of every event but neutral saddles, which are no bifurcations.

    Near a grazing multipliers run through infinity, so that neutral saddles lie as close to one
    another as one likes.
    """
    return sorted(
        (found.kind, found.value) for found in branch.bifurcations if found.kind != "neutral_saddle"
    )


def assert_same_events(one, other, tolerance=1e-10):
    assert [kind for kind, _ in one] == [kind for kind, _ in other]
    for (_, value), (_, again) in zip(one, other, strict=True):
        assert again == pytest.approx(value, rel=0, abs=tolerance)


def test_cases_have_every_kind():
    kinds = {found.kind for name in CASES for found in branch_of(name).bifurcations}
    assert kinds == {
        "saddle_node",
        "period_doubling",
        "neimark_sacker",
        "neutral_saddle",
        "grazing",
        "regime_border",
        "contact_border",
        "chatter_onset",
    }
    tests = {
        found.test.split(", leg")[0] for name in CASES for found in branch_of(name).bifurcations
    }
    for border in ("P* = P_f", "P* = (1 + r) P_f", "sin x1 = 0", "x1' = 0 before"):
        assert f"regime_border: {border}" in tests
    for border in ("length of the phase", "slip at the start"):
        assert f"contact_border: {border}" in tests


@pytest.mark.parametrize("steps", [(0.004, 0.025), (0.02, 0.08)])
def test_places_do_not_depend_on_the_steps(case, steps):
    step, max_step = steps
    branch = vi.follow_motion(
        motion_of_case(case), step=step, max_step=max_step, max_points=4000, **CASES[case][1]
    )
    assert_same_events(events(branch_of(case)), events(branch))
    assert sorted(branch.ends) == sorted(branch_of(case).ends)


def test_places_do_not_depend_on_the_start(case):
    branch = branch_of(case)
    piece = max(branch.pieces, key=lambda piece: len(piece.values))
    start = piece.motion(len(piece.values) // 3)
    again = vi.follow_motion(start, **CASES[case][1])
    assert_same_events(events(branch), events(again))


def test_both_directions_are_the_whole(case):
    branch = branch_of(case)
    ways = [
        vi.follow_motion(motion_of_case(case), both=False, direction=way, **CASES[case][1])
        for way in (1, -1)
    ]
    if "closed" in branch.ends:
        for way in ways:
            assert_same_events(events(branch), events(way))
    else:
        assert_same_events(events(branch), sorted(events(ways[0]) + events(ways[1])))
        assert [way.ends[0] for way in ways] == ["start", "start"]


def smooth(branch):
    return [
        found
        for found in branch.bifurcations
        if found.kind in ("saddle_node", "period_doubling", "neimark_sacker")
    ]


def test_multipliers_are_those_of_the_bifurcation(case):
    for found in smooth(branch_of(case)):
        values = found.motion.multipliers
        # Rounding of the eigenvalues, relative to the largest.
        tolerance = 1e-9 * max(1.0, abs(values[0]))
        if found.kind == "saddle_node":
            assert np.abs(values - 1.0).min() < tolerance
        elif found.kind == "period_doubling":
            assert np.abs(values + 1.0).min() < tolerance
        else:
            pairs = values[values.imag > 0.0]
            assert np.abs(np.abs(pairs) - 1.0).min() < tolerance


def test_points_are_motions_with_the_multipliers_of_the_branch(case):
    # A motion taken from a branch begins with the first event of its first drive period, which a
    # node may have left or entered along the branch.
    for piece in branch_of(case).pieces:
        for k in range(1, len(piece.values) - 1, 3):
            motion = piece.motion(k)
            assert motion.admissible, motion.why_not
            assert ((motion.nodes[:, 3] >= 0.0) | (motion.legs == ("circuit",))).all()
            size = max(1.0, abs(motion.multipliers[0]))
            assert np.poly(motion.multipliers) == pytest.approx(
                np.poly(piece.multipliers[k]), abs=1e-9 * size**2
            )


def gap_of(system, states):
    tip = np.sin(states[:, 0]) if system.contact == "oblique" else states[:, 0]
    return tip - states[:, 2] - system.gap


def highest_gap(motion, leg, length, near):
    """Largest gap near a time of the free flight from the start of a leg, by simulation.

    The flight is that of a system whose bodies are too far apart to meet.
    """
    system = motion.system
    node = motion.nodes[leg]
    if motion.legs == ("circuit",):
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
    passed = 0.0 if motion.legs == ("circuit",) else motion.nodes[after, 3] - motion.nodes[leg, 3]
    return turns * motion.system.drive_period + passed


def leg_of(found):
    return int(found.test.rsplit("leg ", 1)[1])


def test_flights_touch_at_a_grazing(case):
    for found in branch_of(case).of_kind("grazing"):
        motion, leg = found.motion, leg_of(found)
        if ": u," in found.test:
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
        motion, leg = found.motion, leg_of(found)
        if not motion.legs[leg].startswith("impact"):
            continue
        system = motion.system
        x1, v1, _, v2 = motion.itinerary.before_events(system._compiled, motion.nodes)[leg]
        _, regime, signs = motion.legs[leg].split(":")
        s = 1.0 if signs[0] == "+" else -1.0
        side = 1.0 if signs[1] == "+" else -1.0
        k = math.cos(x1) + system.friction * s * side * math.sin(x1)
        u = v1 * math.cos(x1) - v2
        stop, approach = v1 / k, u / (system.mass_ratio + k * math.cos(x1))
        what = found.test.split(": ", 1)[1].rsplit(", leg", 1)[0]
        small = 1e-12
        shift = 1e-6 * np.array([[-1.0], [1.0]])
        if what == "P* = P_f":
            assert stop == pytest.approx(approach, abs=small)
            sides = regimes_around(system, (x1, v1, v2), shift * (0.0, v1, v1 * math.cos(x1)))
            assert {name.split("_")[1] for name in sides} == {"approach", "restitution"}
        elif what == "P* = (1 + r) P_f":
            assert stop == pytest.approx((1.0 + system.restitution) * approach, abs=small)
            sides = regimes_around(system, (x1, v1, v2), shift * (0.0, v1, v1 * math.cos(x1)))
            assert len(sides) == 2
            assert "slip" in sides
        elif what == "|cos x1| = mu |sin x1|":
            assert abs(math.cos(x1)) == pytest.approx(
                system.friction * abs(math.sin(x1)), abs=small
            )
            sides = regimes_around(system, (x1, v1, v2), shift * (1.0, 0.0, 0.0))
            assert {name.split("_")[0] for name in sides} == {"reversal", "stick"}
        elif what == "x1' = 0 before":
            assert abs(v1) < small
            sides = regimes_around(system, (x1, 0.0, v2), shift * (0.0, 1.0, 0.0))
            sticks = abs(math.cos(x1)) <= system.friction * abs(math.sin(x1))
            assert sides == ({"stick_approach"} if sticks else {"slip", "reversal_approach"})
        else:
            assert what == "sin x1 = 0"
            assert abs(math.sin(x1)) < small
            sides = regimes_around(system, (x1, v1, v2), shift * (1.0, 0.0, 0.0))
            assert sides == {regime}


def regimes_around(system, impact, shifts):
    return {regime_at(system, *(np.array(impact) + shift)) for shift in shifts}


def test_what_holds_a_contact_phase_is_zero_at_its_border(case):
    for found in branch_of(case).of_kind("contact_border"):
        motion, leg = found.motion, leg_of(found)
        if "length of the phase" in found.test:
            assert abs(length_of(motion, leg)) < 1e-12
        if "slip at the start" in found.test:
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
    leg = motion.legs.index("slide+:release")
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
        while leg == "chatter" and kept and kept[-1].startswith("impact"):
            kept.pop()
        kept.append(leg)
    if "chatter" not in legs:
        return legs
    first = kept.index("chatter")
    return kept[first : kept.index("chatter", first + 1)]


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


def room_at(motion):
    """Size of the gap at t = 0."""
    return abs(gap_of(motion.system, np.array([motion.initial]))[0])


def returns(motion, perturbation):
    start = np.add(motion.initial, (0.0, perturbation, 0.0, 0.0))
    run = vi.simulate(motion.system, initial=start, periods=200 * motion.m, keep=0)
    off = np.abs(np.array(run.final_state.state) - motion.initial).max()
    return off < 1e-11 * max(1.0, np.abs(motion.return_map).max(), np.abs(start).max())


def test_stable_motions_return_from_a_perturbation():
    returned = 0
    for name in CASES:
        for piece in branch_of(name).pieces:
            size = np.abs(piece.multipliers).max(axis=1)
            # At the ends, where a flight may graze, neighbours are not followed to first order.
            for k in 1 + np.flatnonzero(size[1:-1] < 0.9)[:: max(1, len(size) // 3)]:
                motion = piece.motion(int(k))
                # Next to the contact there may be no room for a perturbation.
                if room_at(motion) > 1e-3:
                    assert returns(motion, 1e-9)
                    returned += 1
    assert returned > 80


def test_a_closed_branch_comes_back_to_its_start():
    branch = branch_of("six_seven")
    assert branch.ends == ("closed", "closed")
    first, last = branch.pieces[0], branch.pieces[-1]
    start, end = first.motion(0), last.motion(len(last.values) - 1)
    assert first.values[0] == pytest.approx(last.values[-1], abs=1e-12)
    shifts = [np.roll(end.sections, k, axis=0) - start.sections for k in range(start.m)]
    assert min(np.abs(shift).max() for shift in shifts) < 1e-9


def test_doublings_of_a_cascade_are_confirmed_by_simulation():
    # Frictionless 1-1 above omega = 1.5107: four doublings, with Neimark-Sacker points in between.
    doubling = min(branch_of("one_one").of_kind("period_doubling"), key=lambda d: d.value)
    places = [doubling.value]
    for m, end in ((2, 1.521), (4, 1.53), (8, 1.5297), (16, 1.52966)):
        branch = vi.switch_branch(doubling, drive_frequency=(doubling.value - 1e-3, end))
        assert {piece.itinerary.periods for piece in branch.pieces} == {m}
        assert branch.values[0] == pytest.approx(doubling.value, abs=1e-12)
        (piece,) = branch.pieces
        most_stable = int(np.abs(piece.multipliers).max(axis=1).argmin())
        motion = piece.motion(most_stable)
        assert motion.admissible, motion.why_not
        assert motion.stable
        assert (motion.m, motion.n) == (m, m)
        start = np.add(motion.initial, (0.0, 1e-8, 0.0, 0.0))
        run = vi.simulate(motion.system, initial=start, periods=20_000, keep=40 * m)
        assert run.label == f"{m}-{m}"
        assert np.abs(run.stroboscopic[-1] - motion.sections).max(axis=1).min() < 1e-11
        (doubling,) = branch.of_kind("period_doubling")
        places.append(doubling.value)
    assert places == sorted(places)
    # From a run of its own: beyond the last place period 16 is lost, before the first 1-1 is kept.
    system = vi.System(**PAPER, drive_frequency=places[0] - 1e-3)
    assert vi.simulate(system, initial=(0, 0.5, 0, 0), periods=6000, keep=100).label == "1-1"


def test_doubled_motions_are_admissible_and_meet_the_doubling_again():
    doubling = branch_of("one_one").of_kind("period_doubling")[0]
    branch = vi.switch_branch(doubling, drive_frequency=(1.5, 1.6))
    for piece in branch.pieces:
        inner = range(1, len(piece.values) - 1)
        assert all(piece.motion(k).admissible for k in inner)
    assert branch.ends == ("start", "period_doubling")
    # The branch that leaves 1-1 at one doubling comes back to it at another, found there too.
    others = [d.value for d in branch_of("one_one").of_kind("period_doubling")]
    assert min(abs(branch.bifurcations[-1].value - value) for value in others) < 1e-10
    assert abs(branch.bifurcations[-1].value - doubling.value) > 0.01


# The classical impact oscillator: x'' + 2 zeta x' + x = f cos(omega t), x < delta, x' -> -r x'.

COCO = {
    "mass_ratio": 0.0,
    "frequency_ratio": 1.0,
    "pendulum_damping": 0.05,
    "gap": 1.0,
    "restitution": 0.8,
    "drive_frequency": 1.0,
    "contact": "direct",
}


def one_impact_speeds(system, m=1):
    """Speeds before impact of all orbits with one impact in m periods: a quadratic equation.

    With x = e^(-zeta t) (A cos nu t + B sin nu t) + K cos(omega t + theta) between impacts at 0 and
    T, where x = delta, x'(0) = -r w, x'(T) = w, all of B, w and K omega sin theta are multiples of
    A = delta - K cos theta.
    """
    z, w, r, d = (
        system.pendulum_damping,
        system.drive_frequency,
        system.restitution,
        system.gap,
    )
    nu, span = math.sqrt(1.0 - z**2), m * system.drive_period
    decay, c, s = math.exp(-z * span), math.cos(nu * span), math.sin(nu * span)
    b = (1.0 / decay - c) / s
    left = nu * b - z
    right = decay * (left * c - (z * b + nu) * s)
    speed = -(left - right) / (1.0 + r)
    wave = right - speed  # K omega sin theta over A
    amplitude = system.moment_amplitude / math.hypot(1.0 - w**2, 2.0 * z * w)
    # (delta - A)^2 + (wave A/omega)^2 = K^2
    roots = np.roots([1.0 + (wave / w) ** 2, -2.0 * d, d**2 - amplitude**2])
    least = d * abs(wave / w) / math.hypot(1.0, wave / w) * math.hypot(1.0 - w**2, 2.0 * z * w)
    return speed * roots, least


def test_the_impact_oscillator_grazes_and_turns_where_it_should():
    system = vi.System(**COCO, moment_amplitude=0.05)
    rest = vi.simulate(system, initial=(0, 0, 0, 0), periods=600, keep=10).refine()
    assert rest.label == "1-0"
    branch = vi.follow_motion(rest, moment_amplitude=(0.05, 1.0))
    assert branch.ends == ("bound", "bound")
    assert [piece.label for piece in branch.pieces][-1] == "1-1"
    (grazing,) = branch.of_kind("grazing")
    # Resonance: the amplitude is f1/(2 zeta) = delta.
    assert grazing.value == pytest.approx(0.1, abs=1e-12)
    (fold,) = branch.of_kind("saddle_node")
    assert fold.value == pytest.approx(one_impact_speeds(system)[1], abs=1e-12)
    assert fold.value < grazing.value
    impacting = [piece for piece in branch.pieces if piece.label == "1-1"]
    for piece in impacting:
        for k in range(1, len(piece.values)):
            motion = piece.motion(k)
            speeds, _ = one_impact_speeds(motion.system)
            assert np.abs(motion.impacts["v1_pre"][0] - speeds).min() < 1e-11
    end = impacting[-1].motion(len(impacting[-1].values) - 1)
    assert end.system.moment_amplitude == 1.0
    assert end.impacts["v1_pre"][0] == pytest.approx(1.695732937594882, abs=1e-13)
    assert end.multipliers[0] == pytest.approx(-0.584295314342 + 0.005600351492j, abs=1e-11)


def test_the_budd_dux_orbit_is_followed():
    system = vi.System(
        mass_ratio=0,
        frequency_ratio=1,
        gap=0.001,
        restitution=0.4,
        drive_frequency=2.0,
        moment_amplitude=1.0,
        contact="direct",
    )
    run = vi.simulate(system, initial=(0, 0.1, 0, 0), periods=600, keep=50)
    motion = run.refine()
    assert motion.label == "1-1"
    assert motion.impacts["v1_pre"][0] == pytest.approx(2.22221222219972, abs=1e-13)
    branch = vi.follow_motion(motion, drive_frequency=(1.8, 2.2))
    followed = 0
    for piece in branch.pieces:
        if piece.label != "1-1":
            continue
        for k in range(len(piece.values)):
            speeds, _ = one_impact_speeds(piece.motion(k).system)
            assert np.abs(piece.motion(k).impacts["v1_pre"][0] - speeds).min() < 1e-11
            # No damping: the determinant is r^2.
            assert np.prod(piece.multipliers[k]) == pytest.approx(0.16, abs=1e-12)
            followed += 1
    assert followed > 10


# Friction from 0 on


@pytest.mark.parametrize("name", ["5b", "6b", "6b_one_two", "9_1", "7c_0.45"])
def test_a_branch_over_friction_starts_without_friction(name):
    motion = known(name)
    assert motion.system.friction == 0.0
    branch = vi.follow_motion(motion, friction=(0.0, 0.3))
    start = branch.pieces[0].motion(0)
    assert start.admissible, start.why_not
    assert branch.values.min() == 0.0
    assert np.abs(start.sections - motion.sections).max() < 1e-12
    assert np.abs(start.multipliers - motion.multipliers).max() < 1e-9
    assert branch.values.max() == 0.3
    # The motion changes with friction, and is one.
    piece = branch.pieces[-1]
    end = piece.motion(len(piece.values) - 1)
    assert end.admissible, end.why_not
    assert np.abs(end.sections - motion.sections).max() > 1e-4
    # Against central differences over friction at its small end.
    small = 1e-4
    ahead = vi.periodic_motion(
        motion.system.replace(friction=small), initial=motion.initial, periods=motion.m
    )
    assert ahead.admissible
    again = vi.follow_motion(motion, both=False, friction=(0.0, small))
    last = again.pieces[-1].motion(len(again.pieces[-1].values) - 1)
    assert np.abs(last.sections - ahead.sections).max() < 1e-11


def test_the_doubled_and_the_single_motion_meet_over_friction():
    # 2-4 at omega = 1.1 ends on 1-2, at the doubling of which it was born; found from both sides.
    double = vi.follow_motion(known("6b"), friction=(0.0, 1.0))
    single = vi.follow_motion(known("6b_one_two"), friction=(0.0, 1.0))
    assert double.ends[1] == "period_doubling"
    (doubling,) = single.of_kind("period_doubling")
    assert double.bifurcations[-1].value == pytest.approx(doubling.value, abs=1e-10)


def test_direct_contact_has_no_friction_to_vary():
    with pytest.raises(vi.ParameterError, match="friction"):
        vi.follow_motion(known("direct"), friction=(0.0, 1.0))


# Random systems


def random_motions(count):
    random = np.random.default_rng(20040607)
    found = []
    while len(found) < count:
        system = vi.System(
            mass_ratio=random.uniform(0.2, 2.0),
            frequency_ratio=random.uniform(0.5, 3.0),
            restitution=random.uniform(0.2, 0.9),
            gap=random.uniform(0.0, 0.8),
            drive_frequency=random.uniform(0.5, 2.5),
            damping=(random.uniform(0.01, 0.1), random.uniform(0.01, 0.1)),
            moment_amplitude=random.uniform(0.5, 3.0),
            force_amplitude=random.uniform(0.0, 1.5),
            friction=random.choice([0.0, random.uniform(0.0, 1.0)]),
        )
        run = vi.simulate(system, initial=(0, 0, 1, 0), periods=500, keep=60)
        motion = run.refine() if run.stop_reason == "completed" and run.period.m else None
        if motion and motion.admissible and motion.m <= 4:
            found.append(motion)
    return found


def test_branches_of_random_systems_hold_what_they_say():
    confirmed = returned = 0
    for motion in random_motions(12):
        value = motion.system.drive_frequency
        branch = vi.follow_motion(
            motion, drive_frequency=(0.9 * value, 1.1 * value), max_points=150
        )
        for piece in branch.pieces:
            for k in range(1, len(piece.values) - 1, 4):
                found = piece.motion(k)
                start = np.array(found.initial)
                run = vi.simulate(found.system, initial=start, periods=found.m)
                growth = max(1.0, np.abs(found.return_map).max())
                scale = max(1.0, np.abs(start).max())
                off = np.abs(np.array(run.final_state.state) - start).max()
                assert off < 1e-10 * growth * scale
                if found.n != math.inf:
                    assert run.impact_count == found.n
                confirmed += 1
                if room_at(found) > 1e-3 and abs(found.multipliers[0]) < 0.9:
                    assert returns(found, 1e-10)
                    returned += 1
    assert confirmed > 100
    assert returned > 50


# Bad input and Ctrl-C


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({}, "exactly one parameter"),
        ({"gap": (0.0, 1.0), "friction": (0.0, 1.0)}, "exactly one parameter"),
        ({"omega": (1.0, 2.0)}, "omega"),
        ({"contact": (0.0, 1.0)}, "contact"),
        ({"drive_frequency": 2.0}, "drive_frequency"),
        ({"drive_frequency": (1.0, math.nan)}, "drive_frequency"),
        ({"drive_frequency": (1.9, 2.0)}, "range .* around 1.8"),
        ({"drive_frequency": (1.8, 1.8)}, "range"),
        ({"drive_frequency": (1.0, 2.0), "step": 0.0}, "step"),
        ({"drive_frequency": (1.0, 2.0), "step": 0.1, "max_step": 0.01}, "step"),
        ({"drive_frequency": (1.0, 2.0), "max_points": 1}, "max_points"),
        ({"drive_frequency": (1.0, 2.0), "direction": 0}, "direction"),
    ],
)
def test_bad_input_is_refused(arguments, words):
    with pytest.raises(vi.ParameterError, match=words):
        vi.follow_motion(motion_of_case("one_one"), **arguments)


def test_only_period_doublings_are_switched_at():
    fold = branch_of("one_one").of_kind("saddle_node")[0]
    with pytest.raises(vi.ParameterError, match="bifurcation"):
        vi.switch_branch(fold, drive_frequency=(1.5, 1.6))


def test_ctrl_c_keeps_the_branch_so_far():
    motion = motion_of_case("one_one")
    with ctrl_c(0.3), pytest.raises(vi.Interrupted) as caught:
        vi.follow_motion(
            motion, step=1e-5, max_step=1e-4, max_points=10**6, drive_frequency=(0.9, 2.5)
        )
    branch = caught.value.result
    assert isinstance(branch, vi.Branch)
    assert "interrupted" in branch.ends
    assert len(branch.values) > 2

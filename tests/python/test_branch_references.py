"""Branches against what does not know of them: simulations, and closed forms of one oscillator."""

import math

import numpy as np
import pytest

import sizes
import vibroimpact as vi
from branch_cases import CASES, PAPER, branch_of, returns, room_at


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
    for motion in random_motions(sizes.either(6, 12)):
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
    assert confirmed > sizes.either(50, 100)
    assert returned > sizes.either(25, 50)


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

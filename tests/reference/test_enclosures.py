"""The enclosures that turn with the motion: they hold it, and grow no faster than it does."""

from __future__ import annotations

import random
from typing import Any

import pytest

pytest.importorskip("flint", reason="the high-precision reference needs python-flint")

from flint import arb, arb_mat, ctx, fmpq

from vibroimpact.reference.contact import Undecided
from vibroimpact.reference.dual import Dual
from vibroimpact.reference.flight import System, exact
from vibroimpact.reference.hybrid import Motion as SystemMotion
from vibroimpact.reference.parallelotope import Parallelotope
from vibroimpact.reference.samples import Samples
from vibroimpact.reference.simulate import Event
from vibroimpact.reference.slide import Settings
from vibroimpact.reference.structure import Impact, Structure
from vibroimpact.reference.structure.flow import column, vector
from vibroimpact.reference.structure.simulate import Motion

BITS = 480
#: Radius of the starts that are followed together.
WIDE = fmpq(1, 10**60)
#: A hull may be so many times as wide as the motions that it holds are apart.
SLACK = 1000.0

TWO = {
    "mass": [[1, 0], [0, "0.5"]],
    "stiffness": [[3, -1], [-1, 1]],
    "damping": [["0.15", "-0.05"], ["-0.05", "0.1"]],
    "drive_amplitude": [1, "0.2"],
    "drive_frequency": "1.35",
    "phase": "0.3",
}
STOPS = [
    {"normal": [0, 1], "gap": "0.3", "restitution": "0.7", "amplitude": "0.05", "phase": "0.4"},
    {"normal": [0, -1], "gap": "0.3", "restitution": "0.7"},
]
ROUGH = [{**STOPS[0], "friction": "0.3", "tangent": [1, "0.5"]}, STOPS[1]]
#: Two masses with a stop between them that falls on a floor: both are struck at once, at the start.
FALLING = {
    "mass": [[1, 0], [0, 1]],
    "stiffness": [[1, 0], [0, 1]],
    "drive_amplitude": [1, 2],
    "drive_frequency": "0.7",
    "stops": [
        {"normal": [0, 1], "gap": 0, "restitution": "0.5"},
        {"normal": [1, -1], "gap": 0, "restitution": "0.5"},
    ],
}
START = [[0, 0], [0, 0]]
HIT = [[0, 0], [2, 1]]
STRUCTURES = {
    "smooth": (TWO | {"stops": STOPS}, START),
    "poisson": (TWO | {"stops": ROUGH}, START),
    "newton": (TWO | {"stops": ROUGH, "law": "newton"}, START),
    "energetic": (TWO | {"stops": ROUGH, "law": "energetic"}, START),
    "plastic": (TWO | {"stops": [{**STOPS[0], "restitution": 0}, STOPS[1]]}, START),
    "sequence": (FALLING | {"simultaneous": "sequence"}, HIT),
    "together": (FALLING | {"simultaneous": "together"}, HIT),
}
PENDULUM = {
    "mbar": "0.6", "omega0": 2, "r": "0.8", "delta": "0.5", "zeta1": "0.02", "zeta2": "0.03",
    "f1": 1, "f2": "0.3", "omega": "1.8", "mu": 0, "c1": "0.1",
}  # fmt: skip
SYSTEMS = {
    "free": (PENDULUM, "oblique", "poisson"),
    "direct": (PENDULUM, "direct", "newton"),
    "poisson": (PENDULUM | {"mu": "0.9"}, "oblique", "poisson"),
    "energetic": (PENDULUM | {"mu": "0.9"}, "oblique", "energetic"),
    "paper": (PENDULUM | {"mu": "0.4"}, "oblique", "paper"),
    "damped": (PENDULUM | {"zeta2": 1}, "oblique", "poisson"),
}


def followed(made: Structure, start: Any, shifts: list[fmpq], radii: list[fmpq]) -> Motion:
    """A motion from balls about a shifted start; as a point if all radii are 0."""
    motion = Motion(
        made,
        [[exact(q) for q in part] for part in start],
        Samples([arb(1 if start is HIT else 40)]),
        500,
    )
    own = vector(motion.z, 0, 2 * made.size)
    balls = [q + arb(s) + arb(0, arb(r)) for q, s, r in zip(own, shifts, radii, strict=True)]
    motion.z = column([*balls, *vector(motion.z, 2 * made.size, made.width)])
    assert motion.carried is not None
    motion.carried.set = Parallelotope.box([*balls, motion.now])
    if not any(radii):
        motion.carried = None
    motion.run()
    return motion


def numbers(told: Any) -> tuple[arb, ...]:
    """The numbers of an event."""
    if isinstance(told, Event):
        return (told.time, told.x1, told.v1_pre, told.x2, told.v2_pre, told.v1_post, told.v2_post)
    if isinstance(told, Impact):
        return (told.time, *told.q, *told.v_pre, *told.v_post)
    return (told.time, *told.state[0], *told.state[1])


def held(whole: list[Any], points: list[list[Any]]) -> None:
    """Balls hold the motions of points, and are not much wider than these are apart."""
    for place, told in enumerate(whole):
        for number, ball in enumerate(numbers(told)):
            values = [numbers(one[place])[number] for one in points]
            assert all(ball.overlaps(value) for value in values)
            assert all(float(value.rad()) < 1e-3 * float(WIDE) for value in values)
            apart = max(abs(float(p.mid() - q.mid())) for p in values for q in values)
            assert float(ball.rad()) < SLACK * max(apart, float(WIDE))


@pytest.mark.parametrize("name", STRUCTURES)
def test_motions_of_a_structure_stay_in_the_set_that_holds_their_starts(name):
    values, start = STRUCTURES[name]
    chance = random.Random(name)
    # where several stops are struck, what is within half the digits of 0 is 0
    with ctx.workprec(BITS if start is START else 380):
        made = Structure.parse(values)
        # stops that are struck at the start touch, whatever the velocities are
        radii = [WIDE * (start is not HIT)] * 2 + [WIDE] * 2
        motion = followed(made, start, [fmpq(0)] * 4, radii)
        proved, _ = motion.proved or (len(motion.story), 0)
        whole = motion.story[:proved]
        # what is struck at the start bounces to rest, which ends the enclosures
        assert len(whole) > (5 if start is HIT else 25)
        points = [
            followed(made, start, [r * chance.choice((-1, 1)) for r in radii], [fmpq(0)] * 4).story[
                :proved
            ]
            for _ in range(4)
        ]
        for one in points:
            assert [(type(e), e.stop) for e in one] == [(type(e), e.stop) for e in whole]
        held(whole, points)


@pytest.mark.parametrize("name", SYSTEMS)
def test_motions_of_a_system_stay_in_the_set_that_holds_their_starts(name):
    values, contact, law = SYSTEMS[name]
    chance = random.Random(name)
    system = System.parse(values, contact)
    start = [exact(q) for q in (0, "0.5", 0, 0)]

    def story(signs: list[int], radius: fmpq) -> list[Any]:
        samples, settings = Samples([arb(100)]), Settings(BITS)
        given = [q + WIDE * sign for q, sign in zip(start, signs, strict=True)]
        motion = SystemMotion(
            system, given, samples, fmpq(0), settings, law, enclose=True, most_impacts=60
        )
        balls = [arb(q) + arb(0, arb(radius)) for q in given]
        motion.x1, motion.v1, motion.x2, motion.v2 = balls
        assert motion.carried is not None
        motion.carried.set = Parallelotope.box([*balls, motion.now])
        motion.carried = motion.carried if radius else None
        motion.run()
        return motion.story

    with ctx.workprec(BITS):
        whole = story([0, 0, 0, 0], WIDE)
        assert len(whole) > 15
        points = [story([chance.choice((-1, 1)) for _ in range(4)], fmpq(0)) for _ in range(4)]
        held(whole, points)


def test_a_set_that_turns_and_shrinks_is_not_wrapped():
    # (3, 4)/5 turns by no whole part of a circle
    turn = arb_mat(2, 2, [arb(3), arb(-4), arb(4), arb(3)]) * (arb(9) / 50)
    with ctx.workprec(BITS):
        there = Parallelotope.box([arb(1, 1e-10), arb(2, 1e-10)])
        balls = arb_mat([[value] for value in there.hull()])
        for _ in range(200):
            image = (turn * arb_mat([[value] for value in there.centre])).entries()
            found = Parallelotope.around(image, turn * there.axes, there.reach)
            assert found is not None
            there, balls = found, turn * balls
        # 0.9^200 = 7e-10, and the ball loses a factor of 0.9 * 7/5 each time
        assert max(float(value.rad()) for value in there.hull()) < 3e-10 * 7.1e-10
        assert float(balls[0, 0].rad()) > 1e9


def test_directions_that_a_motion_loses_are_replaced():
    flat = arb_mat(3, 3, [1, 2, 0, 2, 4, 0, 0, 0, 0])
    there = Parallelotope.around([arb(1), arb(0, 1e-9), arb(2)], flat, arb_mat(3, 1, [1, 1, 1]))
    assert there is not None
    # orthogonal to the rounding of doubles, in which the axes are
    assert abs(abs(float(there.axes.det())) - 1) < 1e-14
    held_by = there.hull()
    assert held_by[0].contains(4)
    assert held_by[1].contains(6)
    assert float(held_by[2].rad()) < 1e-7


def test_a_number_with_its_gradient():
    x = Dual(arb(3), arb_mat(1, 2, [1, 0]))
    y = Dual(arb(4), arb_mat(1, 2, [0, 1]))
    two = arb(2)
    cases = {
        x * y - two * x + 1 - y: (2, 2),
        two / x - y / x + x / two: ((-2 + 4) / 9 + 0.5, -1 / 3),
        (x**2 + y**2).sqrt(): (0.6, 0.8),
        abs(-x) + (two - y) * 3: (1, -3),
    }
    for found, gradient in cases.items():
        for number, wanted in zip(found.row.entries(), gradient, strict=True):
            assert abs(float(number) - wanted) < 1e-12
    turned = x.sin() ** 2 + x.cos() ** 2
    assert turned.value.contains(1)
    assert turned.row[0, 0].contains(0)
    assert x < y
    assert y >= x
    assert not x.is_zero()
    with pytest.raises(Undecided):
        abs(Dual(arb(0, 1), x.row))


def test_why_a_sampled_time_is_not_before_or_after_an_event():
    for radius, said in ((1e-90, "an event at a sampled time"), (1e-9, "balls too wide")):
        with ctx.workprec(256):
            samples = Samples[int]([arb(1), arb(3)])
            with pytest.raises(Undecided, match=said):
                samples.take(arb(1, radius), lambda time: 0)

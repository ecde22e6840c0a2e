"""Tests of chatter.py, slide.py, hold.py: closed forms, and the equations of motion written anew.

The reference data of whole runs are tested in test_contact_data.py. Needs python-flint.
"""

from __future__ import annotations

import random

import pytest

import sizes

pytest.importorskip("flint", reason="the high-precision reference needs python-flint")

from flint import arb, ctx, fmpq

from vibroimpact.reference.chatter import Bounce, accumulate, extrapolate
from vibroimpact.reference.contact import Undecided
from vibroimpact.reference.flight import Body, Number, State, System, exact
from vibroimpact.reference.hold import Hold
from vibroimpact.reference.hybrid import FINER, Run, follow, sections
from vibroimpact.reference.slide import Settings, Slide, Touch, first_root

from .scenes import SCENES

#: Below the error of 1e-45 of each step times the number of steps, with room for growth.
CLOSE = 1e-40


def system(contact: str = "oblique", **changes: Number) -> System:
    """The paper's usual parameters with changes."""
    plain: dict[str, Number] = {
        "mbar": "0.6", "omega0": 2, "r": "0.8", "delta": "0.5", "zeta1": 0, "zeta2": 0,
        "f1": 1, "f2": 0, "omega": "1.25", "mu": 0,
    }  # fmt: skip
    return System.parse(plain | changes, contact)


def run_scene(name: str, settings: Settings | None = None) -> Run:
    """A scene of the data file, once."""
    scene = SCENES[name]
    return follow(
        scene.system(), scene.initial, scene.sampled(), phase=scene.phase, settings=settings
    )


# --- chatter ---------------------------------------------------------------------------------


def test_extrapolation_of_a_known_function() -> None:
    with ctx.workprec(300):
        steps = [arb(2) ** -k for k in range(30, 4, -1)]
        limit = extrapolate(steps, [(3 * u).exp() / (1 + u) for u in steps])
        assert limit.contains(1)
        assert limit.rad() < 1e-70


def test_a_far_node_does_not_spoil_the_limit() -> None:
    # 1/(1 - u) has its pole at 1: beyond it the orders differ less and less, but do not converge;
    # the radius is an estimate, of the right power of ten
    with ctx.workprec(300):
        steps = [arb(2) ** -k for k in range(20, -4, -1) if k != 0]
        limit = extrapolate(steps, [1 / (1 - u) for u in steps])
        assert abs(limit.mid() - 1) < 10 * limit.rad()
        assert limit.rad() < 1e-60


@pytest.mark.parametrize(("name", "load", "r"), [("0.5", 9.8, 0.5), ("0.7", 9.81, 0.7)])
def test_bouncing_ball_comes_to_rest_at_the_sum_of_its_hops(
    name: str, load: float, r: float
) -> None:
    run = run_scene(f"bouncing_ball_{name}")
    assert [p.event for p in run.phases] == ["chatter", "stick"]
    assert run.ending == "rest"
    with ctx.workprec(400):
        ratio = arb(exact(r))
        first = (2 / arb(exact(load))).sqrt()
        rest = first * (1 + 2 * ratio / (1 - ratio))
        assert abs(run.phases[0].time - rest).abs_upper() < 1e-100
        assert abs(run.phases[0].state[0] - 1).abs_upper() < 1e-100
    # the flight before rest, published with the FMI reference ball
    if name == "0.7":
        height, speed = 1 - run.samples[0][0], -run.samples[0][1]
        # its 9.81 is the decimal, ours the float64: one rounding apart
        assert abs(float(height) - 0.1387798803595172) < 1e-15
        assert abs(float(speed) - 2.625059760719034) < 4e-15


def test_published_accumulation_time_of_the_ball() -> None:
    assert abs(float(run_scene("bouncing_ball_0.5").phases[0].time) - 1.3552618543578767) < 3e-16


@pytest.mark.parametrize(
    "name",
    sizes.either(
        ["crossing_mu_0.9", "restitution_0.05"],
        ["fig7c_omega_0.45", "crossing_mu_0.9", "restitution_0.05"],
    ),
)
def test_two_numbers_of_impacts_give_one_limit(name: str) -> None:
    # slip, reversal and nearly plastic tails; fewer impacts agree within what they state
    coarse = run_scene(name, Settings(precision=400, order=40, tolerance=1e-32))
    fine = run_scene(name, FINER)
    assert coarse.impacts < fine.impacts
    first, same = coarse.phases[0], fine.phases[0]
    assert first.event == same.event == "chatter"
    for p, q in zip((first.time, *first.state), (same.time, *same.state), strict=True):
        assert abs(p - q.mid()) < 1e-31
        assert abs(p.mid() - q.mid()) < 10 * p.rad() + 1e-100


def test_limit_of_a_tail_lies_on_the_contact() -> None:
    # v2 is extrapolated on its own: u = v1 cos x1 - v2 = 0 at the limit is a check
    with ctx.workprec(300):
        ratio = arb("0.5")
        bounces = []
        for k in range(8, 30):
            u = ratio**k
            x1 = 1 + u / (3 - u)
            v1 = u.exp()
            bounces.append(Bounce((2 - u, x1, v1, v1 * x1.cos() - u), u, "slip"))
        limit = accumulate(bounces, 0.5)
        _, x1, v1, v2 = limit.values
        assert abs(v1 * x1.cos() - v2).contains(0)
        assert limit.error() < 1e-60


# --- sliding ---------------------------------------------------------------------------------


def test_series_satisfies_the_equations_of_motion() -> None:
    # x1'' = a1 - k p, x2'' = a2 + mbar p with the tip on the contact, from a step of the motion
    rng = random.Random(5)
    with ctx.workprec(400):
        for _ in range(20):
            mu = exact(rng.choice((0.0, 0.3, 0.9)))
            given = system(mu=mu, zeta1="0.1", zeta2="0.3", f2="1.5", mbar=exact(rng.uniform(1, 3)))
            x1 = arb(exact(rng.uniform(-1.2, 1.2)))
            v1 = arb(exact(rng.choice((-1, 1)) * rng.uniform(0.1, 1)))
            s, side = (1 if v1 > 0 else -1), (1 if x1 > 0 else -1)
            slide = Slide(given, arb(exact(rng.uniform(0, 6))), s, side)
            series = slide.series(Touch(arb(0), x1, v1), 12)
            sin, cos, load = x1.sin(), x1.cos(), slide.phase.cos()
            p = series["force"][0]
            a1 = load - arb("0.4") * v1 - 4 * x1
            x2, v2 = sin - arb("0.5"), v1 * cos
            a2 = arb("1.5") * load - arb("0.6") * v2 - x2
            k = cos + arb(mu) * s * abs(sin)
            bend = 2 * series["angle"][2]
            assert (bend - (a1 - k * p)).contains(0)
            assert (bend * cos - v1**2 * sin - (a2 + arb(given.mbar) * p)).contains(0)


def test_energy_of_a_frictionless_undamped_slide_is_kept() -> None:
    given = system(mbar="0.6", f1=0, f2=0, omega=0, delta="-2")
    states: list[State] = []

    def sample(until: arb, state: object) -> None:
        states.append(state(until))  # type: ignore[operator]

    settings = Settings()
    with ctx.workprec(settings.precision):
        slide = Slide(given, arb(0), 1, 1)
        slid = slide.follow(Touch(arb(0), arb("-0.7"), arb("1")), arb(2), settings, sample)
        energies = [
            v1**2 / 2 + 2 * x1**2 + (v2**2 + x2**2) / (2 * arb("0.6")) for x1, v1, x2, v2 in states
        ]
        assert len(energies) > 10
        assert abs(states[-1][0] - states[0][0]) > 0.1
        assert slid.error < CLOSE
        for energy in energies:
            assert abs(energy - energies[0]) < CLOSE


def test_direct_contact_moves_as_the_joined_oscillator() -> None:
    # for omega0 = 4: (mbar + 1) x'' + (8 mbar zeta1 + 2 zeta2) x' + (16 mbar + 1) x
    #   = (mbar f1 + f2) cos psi + delta; mbar = 3 gives the frequency 7/2
    given = system(
        "direct", mbar=3, omega0=4, zeta1="0.05", zeta2="0.1", f1=20, f2=-30, omega="0.5", delta=1
    )
    damping = 6 * given.zeta1 + given.zeta2 / 2
    joined = Body(fmpq(7, 2), damping / 7, (3 * given.f1 + given.f2) / 4, given.omega)
    middle = fmpq(1, 49)
    seen = 0

    def sample(until: arb, state: object) -> None:
        nonlocal seen
        x1, v1, x2, v2 = state(until)  # type: ignore[operator]
        x, v = joined.state_closed(until, fmpq(1, 4) - middle, fmpq(-1, 2), fmpq(0))
        assert abs(x1 - x - arb(middle)) < CLOSE
        assert abs(v1 - v) < CLOSE
        assert abs(x2 - x1 + 1) < CLOSE
        assert abs(v2 - v1) < CLOSE
        seen += 1

    settings = Settings()
    with ctx.workprec(settings.precision):
        hold = Hold(given, arb(0), False, settings)
        held = hold.follow(Touch(arb(0), arb("0.25"), arb("-0.5")), arb(9), sample, arb(0))
        assert held.ending == "release"
        assert seen > 5
        # at the release the joined motion is the free motion of both: a1 = a2
        t = held.touch.time
        x, v = joined.state_closed(t, fmpq(1, 4) - middle, fmpq(-1, 2), fmpq(0))
        x, load = x + arb(middle), (t / 2).cos()
        a1 = 20 * load - arb("0.4") * v - 16 * x
        a2 = -30 * load - arb("0.2") * v - (x - 1)
        assert abs(a1 - a2) < CLOSE


def test_first_root_of_a_polynomial() -> None:
    with ctx.workprec(200):
        # (t - 1/4)(t - 1/2)(t - 3/4)
        coefficients = [arb(fmpq(-3, 32)), arb(fmpq(11, 16)), arb(fmpq(-3, 2)), arb(1)]
        root = first_root(coefficients, arb(1))
        assert root is not None
        assert abs(root - arb(fmpq(1, 4))) < 1e-55
        assert first_root(coefficients, arb("0.2")) is None
        with pytest.raises(Undecided, match="double root"):
            first_root([arb(fmpq(1, 9)), arb(fmpq(-2, 3)), arb(1)], arb(1))
        with pytest.raises(Undecided, match="end of a step"):
            first_root([arb(0), arb(1)], arb(1))


# --- sticking and modes ----------------------------------------------------------------------


def test_stick_ends_where_the_cone_does() -> None:
    # omega0 = f2 = 0: p_s = x2/mbar stays, a1 = cos(omega t)/2 falls to p_s (cos - mu sin)
    given = system(omega0=0, f1="0.5", mu="0.8", omega="0.5", delta="0.5", mbar="0.6")
    settings = Settings()
    with ctx.workprec(settings.precision):
        hold = Hold(given, arb(0), False, settings)
        x1 = arb(1)
        held = hold.follow(Touch(arb(0), x1, arb(0), flat=1), arb(20), lambda *_: None, arb(0))
        push = (x1.sin() - arb("0.5")) / arb("0.6")
        end = 2 * (2 * push * (x1.cos() - arb("0.8") * x1.sin())).acos()
        assert [phase.event for phase in held.phases[:2]] == ["stick", "slide_negative"]
        assert abs(held.phases[1].time - end) < 1e-100
        # the grip is at its limit, on the side that the slide keeps
        normal, friction = held.phases[1].normal, held.phases[1].friction
        assert normal is not None
        assert friction is not None
        assert abs(friction - arb("0.8") * normal) < 1e-100
        assert abs(normal - push) < 1e-100


def test_wall_at_rest_releases_where_its_force_falls_through_zero() -> None:
    scene = SCENES["wall_at_rest_sticking"]
    run = run_scene("wall_at_rest_sticking")
    first = next(phase for phase in run.phases if phase.event == "release")
    with ctx.workprec(400):
        x1 = arb(1) / 2
        angle = x1.asin()
        omega = arb(exact(scene.parameters()["omega"]))
        assert abs(first.state[0] - angle) < 1e-60
        # a1 = 2 cos(omega t) - x1 = 0
        assert abs(first.time - (angle / 2).acos() / omega) < 1e-60


def test_endings_have_their_names() -> None:
    assert run_scene("painleve").ending == "painleve"
    assert run_scene("rest_changing_load").ending == "rest"
    # tip that sticks, wall that comes nearer
    wall = system(mbar=0, mu="0.3", omega="0.4", f1=2, f2="1.5", omega0=1, r="0.5",
                  zeta1="0.1", zeta2="0.1")  # fmt: skip
    assert follow(wall, (0, "0.5", 0, 0), sections(wall, 3)).ending == "jammed"


def test_mode_at_zero_velocity_covers_the_plane_once() -> None:
    # separate, stick, slide to either side, by the written conditions
    rng = random.Random(7)
    seen: set[str] = set()
    with ctx.workprec(200):
        for _ in range(300):
            given = system(
                mu=exact(rng.uniform(0.1, 1)), f1=exact(rng.uniform(-4, 4)),
                f2=exact(rng.uniform(-2, 2)), mbar=exact(rng.uniform(0.5, 3)), omega0=1,
            )  # fmt: skip
            x1 = arb(exact(rng.uniform(-1.3, 1.3)))
            mode = Hold(given, arb(0), False, Settings()).mode(Touch(arb(0), x1, arb(0), flat=1))
            a1 = float(arb(given.f1) - x1)
            a2 = float(arb(given.f2) - x1.sin() + arb("0.5"))
            cos, sin, mu = float(x1.cos()), abs(float(x1.sin())), float(given.mu)
            push = -a2 / float(given.mbar)
            drive = a1 - push * cos
            if a1 * cos - a2 < 0:
                expected = "separate"
            elif push >= 0 and abs(drive) <= mu * push * sin:
                expected = "stick"
            else:
                expected = "slide_positive" if drive > 0 else "slide_negative"
            assert mode == expected
            seen.add(mode)
    assert seen == {"separate", "stick", "slide_positive", "slide_negative"}


def test_an_impact_that_leaves_the_bodies_approaching_ends_a_run() -> None:
    failing = system(
        omega="1.4", mu="0.8", zeta1="0.01", zeta2="0.01", f1=1, f2="0.5", delta="0.5", r="0.8"
    )
    start = (0, "0.5", 0, 0)
    printed = follow(failing, start, sections(failing, 20), law="paper")
    assert (printed.ending, printed.impacts) == ("law_failed", 4)
    assert follow(failing, start, sections(failing, 20)).ending == "completed"

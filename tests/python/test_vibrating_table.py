"""A ball on a vibrating table, with one bounce in each period of the table, in closed form.

The table is body 2 (mass_ratio 0) on its steady motion A cos(omega t), gravity G_a is the constant
load of the ball, and beta = A omega^2/G_a (P. J. Holmes, J. Sound Vib. 84, 1982; theory page,
section 1). The velocity of the table at the impact is kappa pi G_a/omega, kappa = (1-r)/(1+r).
"""

import math

import numpy as np
import pytest

import vibroimpact as vi
from vibroimpact.explorer import presets

OMEGA, ZETA = 2.0, 0.05
PER_FORCE = 1.0 / math.hypot(1.0 - OMEGA**2, 2.0 * ZETA * OMEGA)
RESTITUTIONS = [0.3, 0.5, 0.8, 0.95]


def table(beta, r, gravity):
    """The system, and its state when the table is lowest, on the stable motion."""
    amplitude = beta * gravity / OMEGA**2
    system = vi.System(
        mass_ratio=0,
        frequency_ratio=0,
        restitution=r,
        gap=0,
        drive_frequency=OMEGA,
        force_amplitude=amplitude / PER_FORCE,
        oscillator_damping=ZETA,
        static_moment=gravity,
        phase=math.atan2(2.0 * ZETA * OMEGA, 1.0 - OMEGA**2),
        contact="direct",
    )
    psi = math.pi - math.asin(math.pi * (1 - r) / (1 + r) / beta)
    speed, time = math.pi * gravity / OMEGA, (math.tau - psi) / OMEGA
    x1 = amplitude * math.cos(psi) - speed * time + 0.5 * gravity * time**2
    return system, (x1, gravity * time - speed, amplitude, 0.0)


def doubling(r):
    """Beta at which the period doubles."""
    kappa = (1 - r) / (1 + r)
    return math.sqrt((math.pi * kappa) ** 2 + 4 * (1 + r * r) ** 2 / (1 + r) ** 4)


@pytest.fixture(scope="module", params=RESTITUTIONS)
def found(request):
    """The coefficient of restitution, beta, and the motion."""
    r = request.param
    kappa = (1 - r) / (1 + r)
    beta = 0.5 * (math.pi * kappa + doubling(r))
    system, start = table(beta, r, gravity=9.81)
    run = vi.simulate(system, initial=start, periods=20)
    return r, beta, run.refine()


def test_the_known_value_is_that_of_the_literature():
    assert doubling(0.8) == pytest.approx(1.070836468247907, rel=1e-15)


def test_speeds_and_multipliers_are_those_in_closed_form(found):
    r, beta, motion = found
    kappa, speed = (1 - r) / (1 + r), math.pi * 9.81 / OMEGA
    assert (motion.label, motion.stable) == ("1-1", True)
    _, v1, v2, _ = motion.state
    assert v1 == pytest.approx(speed, rel=1e-13)
    assert v2 == pytest.approx(-kappa * speed, rel=1e-12)
    assert motion.nodes[0][1] == pytest.approx(-speed, rel=1e-13)
    trace = 1 + r * r - (1 + r) ** 2 * math.sqrt(beta**2 - (math.pi * kappa) ** 2)
    ball = np.roots([1.0, -trace, r * r])
    decay, turn = math.exp(-ZETA * math.tau / OMEGA), math.sqrt(1 - ZETA**2) * math.tau / OMEGA
    own = decay * np.exp([1j * turn, -1j * turn])
    for each in (*ball, *own):
        assert np.abs(motion.multipliers - each).min() < 1e-10


def test_the_period_doubles_where_it_does_in_closed_form(found):
    r, beta, motion = found
    system = motion.system
    begin = 1.02 * math.pi * (1 - r) / (1 + r) / beta
    over_force = motion.follow(
        force_amplitude=(
            begin * system.force_amplitude,
            1.2 * doubling(r) / beta * system.force_amplitude,
        )
    )
    over_gravity = motion.follow(
        static_moment=(
            system.static_moment * beta / doubling(r) / 1.2,
            system.static_moment / begin,
        )
    )
    (one,) = over_force.of_kind("period_doubling")
    (other,) = over_gravity.of_kind("period_doubling")
    assert abs(one.value * PER_FORCE * OMEGA**2 / system.static_moment - doubling(r)) < 1e-9
    assert abs(beta * system.static_moment / other.value - doubling(r)) < 1e-9


def test_the_doubling_is_a_straight_line_over_gravity_and_drive(found):
    r, _, motion = found
    gravity, force = motion.system.static_moment, motion.system.force_amplitude
    branch = motion.follow(force_amplitude=(force, 3.0 * force))
    (flip,) = branch.of_kind("period_doubling")
    ranges = {
        "static_moment": (0.5 * gravity, 2.0 * gravity),
        "force_amplitude": (0.0, 9.0 * force),
    }
    curve = vi.bifurcation_curve(flip, **ranges)
    moments, forces = curve.values.T
    assert np.ptp(moments) > 1.4 * gravity
    beta = forces / moments * PER_FORCE * OMEGA**2
    assert np.abs(beta - doubling(r)).max() < 1e-9


def test_the_motion_begins_where_the_table_is_fast_enough(found):
    r, _, motion = found
    force = motion.system.force_amplitude
    branch = motion.follow(force_amplitude=(0.1 * force, force))
    (fold,) = branch.of_kind("saddle_node")
    beta = fold.value * PER_FORCE * OMEGA**2 / 9.81
    assert abs(beta - math.pi * (1 - r) / (1 + r)) < 1e-9


def test_the_explorer_has_it_beyond_the_first_doubling():
    system = presets.PRESETS["Ball on a vibrating table: 2-2"].system
    beta = system.force_amplitude * PER_FORCE * OMEGA**2
    assert (system.drive_frequency, system.oscillator_damping) == (OMEGA, ZETA)
    assert doubling(system.restitution) < beta < 1.1 * doubling(system.restitution)

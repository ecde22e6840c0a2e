"""Closed stops, friction and simultaneous impacts in the reference for structures.

Checked against closed forms, a change of coordinates, the equations of motion, and Moreau's time
stepping (moreau.py). Needs python-flint.
"""

from __future__ import annotations

import random
from fractions import Fraction
from typing import Any

import numpy as np
import pytest

import sizes

pytest.importorskip("flint", reason="the high-precision reference needs python-flint")

from flint import arb, ctx

from vibroimpact.reference.flight import Number, System, exact
from vibroimpact.reference.impact import LAWS
from vibroimpact.reference.structure import (
    Change,
    Structure,
    StructureRun,
    impulses,
    simulate_structure,
)
from vibroimpact.reference.structure.flow import column
from vibroimpact.reference.structure.hold import Hold, Mode
from vibroimpact.reference.structure.impulses import impact_on

from .moreau import final_state
from .structure_scenes import row_of_balls

Values = dict[str, Any]


def kinds(run: StructureRun) -> list[str]:
    """Events in order; impacts by their regime."""
    return [e.kind if isinstance(e, Change) else e.regime for e in run.story]


def changes(run: StructureRun) -> list[Change]:
    """Events that are no impacts."""
    return [entry for entry in run.story if isinstance(entry, Change)]


# --- one closed stop with friction ---------------------------------------------------------------

#: A block on a spring (first coordinate), pressed on the ground (second one) by the force 1.
BLOCK: Values = {
    "mass": [[1, 0], [0, 1]],
    "stiffness": [[1, 0], [0, 0]],
    "static_load": [0, 1],
    "stops": [{"normal": [0, 1], "gap": 0, "restitution": 0, "friction": "0.1", "tangent": [1, 0]}],
}


def test_a_block_with_dry_friction_loses_an_amplitude_per_swing_and_sticks() -> None:
    # x'' + x = -+ mu: each half turn about +-mu, so 1, -0.8, 0.6, ..., and rest within mu of 0
    run = simulate_structure(Structure.parse(BLOCK), [[1, 0], [0, 0]], times=[50])
    assert kinds(run) == ["slide_negative", "slide_positive"] * 2 + ["slide_negative", "stick"]
    assert run.proved == len(run.story)
    with ctx.workprec(run.precision):
        for k, entry in enumerate(changes(run)):
            assert abs(entry.time - k * arb.pi()) < 1e-90
            assert abs(entry.state[0][0] - (-1) ** k * (1 - arb(k) / 5)) < 1e-90
        assert abs(run.states[0][0][0]) < 1e-90


def test_a_drive_breaks_a_stick_at_the_cone_of_friction() -> None:
    # rest until 0.2 sin t = mu; without a spring v' = 0.2 sin t - mu from there on
    values = BLOCK | {
        "stiffness": [[0, 0], [0, 0]],
        "drive_amplitude": [-0.25j, 0],
        "drive_frequency": 1,
    }
    run = simulate_structure(Structure.parse(values), [[0, 0], [0, 0]], times=[2])
    assert kinds(run) == ["stick", "slide_positive"]
    with ctx.workprec(run.precision):
        start = arb("0.4").asin()
        assert abs(changes(run)[1].time - start) < 1e-100
        speed = (start.cos() - arb(2).cos()) / 4 - (2 - start) / 10
        assert abs(run.states[0][1][0] - speed) < 1e-100


def test_a_load_that_turns_releases_a_stick() -> None:
    # the ground is left when cos t falls through 0, at rest: y'' = cos t from there on
    values = BLOCK | {"static_load": [0, 0], "drive_amplitude": [0, 1], "drive_frequency": 1}
    run = simulate_structure(Structure.parse(values), [[0, 0], [0, 0]], times=[3])
    assert kinds(run) == ["stick", "release"]
    with ctx.workprec(run.precision):
        half = arb.pi() / 2
        assert abs(changes(run)[1].time - half) < 1e-100
        assert abs(run.states[0][0][1] - (-arb(3).cos() - (3 - half))) < 1e-100


def test_a_chatter_that_sticks_is_followed_to_its_end() -> None:
    # dropped from 2 with g = 1, r = 1/2: flights of 2, 2, 1, 1/2, ...; a side load moves the block
    # by 0.05 T^2 in each, and every impact stops it
    stop = BLOCK["stops"][0] | {"restitution": "0.5", "friction": "0.5"}
    values = BLOCK | {"stiffness": [[0, 0], [0, 0]], "static_load": ["0.1", 1], "stops": [stop]}
    run = simulate_structure(Structure.parse(values), [[0, -2], [0, 0]], times=[7])
    assert kinds(run)[-3:] == ["stick_approach", "chatter", "stick"]
    with ctx.workprec(run.precision):
        limit = changes(run)[0]
        assert abs(limit.time - 6) < 1e-44
        assert abs(run.states[0][0][0] - arb("0.05") * (4 + arb(16) / 3)) < 1e-80


def test_friction_that_presses_a_stop_together_is_a_painleve_point() -> None:
    # a + s mu b = 1 - 0.9 mu for slip against the coupling of the mass matrix
    values: Values = {
        "mass": [[1, "0.9"], ["0.9", 1]],
        "stiffness": [[0, 0], [0, 0]],
        "static_load": [0, 1],
        "stops": [{"normal": [0, 1], "gap": 0, "restitution": 0, "tangent": [1, 0]}],
    }
    for friction, direction, ending in (
        (1, 1, "completed"),
        (2, -1, "completed"),
        (2, 1, "painleve"),
    ):
        values["stops"][0]["friction"] = friction
        run = simulate_structure(Structure.parse(values), [[0, 0], [direction, 0]], times=["0.01"])
        assert run.ending == ending, (friction, direction)


RUBBING: Values = {
    "mass": [[1.25, 0.25, 0.0], [0.25, 0.75, -0.125], [0.0, -0.125, 1.5]],
    "stiffness": [[3.0, -1.0, 0.0], [-1.0, 2.0, -0.5], [0.0, -0.5, 1.0]],
    "damping": [[0.25, 0.0, 0.125], [0.0, 0.25, 0.0], [0.125, 0.0, 0.5]],
    "static_load": [0.75, 0.25, -0.125],
    "drive_amplitude": [-1.25, 1.875, -1.875],
    "drive_frequency": 0.75,
    "phase": 0.5,
    "stops": [
        {
            "normal": [0.75, 0.5, 0.25], "gap": 0.25, "restitution": 0, "amplitude": 0.0625,
            "phase": 1.0, "friction": 0.5, "tangent": [-0.5, 0.75, 0.5],
        }
    ],
}  # fmt: skip


def rubbing(**changes: Any) -> Values:
    """A structure that slides and sticks on one stop, with changes of the stop."""
    return RUBBING | {"stops": [RUBBING["stops"][0] | changes]}


def test_a_change_of_coordinates_changes_no_motion() -> None:
    # q = B y: matrices B' M B, rows n B, and loads B' c
    basis = np.array([[1, 2, 0], [0, 1, -1], [1, 0, 1]])
    values = rubbing(restitution=0.125)
    other = {k: (basis.T @ np.array(values[k]) @ basis).tolist() for k in ("mass", "stiffness")}
    other["damping"] = (basis.T @ np.array(values["damping"]) @ basis).tolist()
    for name in ("static_load", "drive_amplitude"):
        other[name] = (basis.T @ np.array(values[name])).tolist()
    rows = {k: (np.array(values["stops"][0][k]) @ basis).tolist() for k in ("normal", "tangent")}
    stop = values["stops"][0] | rows
    first = simulate_structure(Structure.parse(values), [[0] * 3] * 2, periods=3)
    second = simulate_structure(
        Structure.parse(values | other | {"stops": [stop]}), [[0] * 3] * 2, periods=3
    )
    assert {"chatter", "release", "stick", "slide_positive", "slide_negative"} <= set(kinds(first))
    assert [k for k in kinds(first) if "_" in k] == [k for k in kinds(second) if "_" in k]
    with ctx.workprec(first.precision):
        for one, two in zip(changes(first), changes(second), strict=True):
            assert (one.kind, one.stop) == (two.kind, two.stop)
            assert abs(one.time - two.time) < 1e-38
        for state, moved in zip(first.states, second.states, strict=True):
            for part, other_part in zip(state, moved, strict=True):
                for i in range(3):
                    back = sum((int(basis[i, k]) * other_part[k] for k in range(3)), arb(0))
                    assert abs(part[i] - back) < 1e-38


@pytest.mark.parametrize("kind", ["slide_positive", "slide_negative", "stick"])
def test_modes_satisfy_the_equations_of_motion(kind: str) -> None:
    # M q'' + C q' + K q = c + F cos - n p + t f, with g'' = 0 and the law of friction
    made = Structure.parse(RUBBING)
    stop, n = made.stops[0], 3
    with ctx.workprec(300):
        hold = Hold(made)
        mode = hold.stick(0)[0] if kind == "stick" else hold.slide(0, 1 if kind[6] == "p" else -1)
        assert isinstance(mode, Mode)
        z = column(
            [arb(k) / 7 for k in (1, -2, 3, 2, -1, 1)]
            + [arb(1), arb("0.3").cos(), arb("0.3").sin()]
        )
        rate = mode.generator.matrix * z
        assert abs((hold.rates[0] * mode.generator.matrix * z)[0, 0]) < 1e-80
        if kind == "stick":
            _, normal, tangential = hold.stick(0)
            p, f = (normal * z)[0, 0], (tangential * z)[0, 0]
            assert abs((made.slip_row(0) * rate)[0, 0]) < 1e-80
        else:
            p = -(mode.watches[0].row * z)[0, 0]
            f = -arb(stop.friction) * mode.direction * p
        assert stop.tangent is not None
        turn = arb("0.3") + arb(made.phase)
        for i in range(n):
            total = -arb(made.load[i]) - arb(made.drive[i][0]) * turn.cos()
            total += arb(stop.normal[0, i]) * p - arb(stop.tangent[0, i]) * f
            assert made.damping is not None
            for k in range(n):
                total += arb(made.mass[i, k]) * rate[n + k, 0]
                total += arb(made.damping[i, k]) * z[n + k, 0] + arb(made.stiffness[i, k]) * z[k, 0]
            assert abs(total) < 1e-80


@pytest.mark.parametrize("friction", sizes.either([0.5], [0.0, 0.125, 0.5, 0.75]))
def test_time_stepping_converges_to_closed_stops(friction: float) -> None:
    values = rubbing(friction=friction)
    run = simulate_structure(Structure.parse(values), [[0] * 3] * 2, times=[12])
    assert not any("reversal" in kind for kind in kinds(run))
    assert {"release", "closed" if friction == 0 else "slide_positive"} <= set(kinds(run))
    wanted = np.array([float(value) for part in run.states[0] for value in part])
    errors = [float(np.abs(final_state(values, 12.0, k) - wanted).max()) for k in (1500, 12000)]
    assert errors[1] < errors[0] / 3
    assert errors[1] < 1e-3


def test_several_closed_stops_with_friction_are_no_single_outcome() -> None:
    wall = {"normal": [1, 0], "gap": 0, "restitution": 0}
    values = BLOCK | {"static_load": [1, 1], "stops": [*BLOCK["stops"], wall]}
    run = simulate_structure(Structure.parse(values), [[0, 0], [0, 0]], times=[1])
    assert run.ending == "frictional_contacts"


def test_one_stop_slips_while_another_is_left() -> None:
    # the block is pressed on the floor and touches a wall, from which its load pulls it
    wall = {"normal": [1, 0], "gap": 0, "restitution": 0}
    values = BLOCK | {"static_load": [-1, 1], "stops": [*BLOCK["stops"], wall]}
    run = simulate_structure(Structure.parse(values), [[0, 0], [0, 0]], times=[1])
    assert run.ending == "completed"
    assert kinds(run) == ["slide_negative"]
    with ctx.workprec(run.precision):
        # x'' + x = -1 + mu
        assert abs(run.states[0][0][0] - (arb(1).cos() - 1) * arb("0.9")) < 1e-90


def test_an_impact_elsewhere_ends_stick() -> None:
    # it moves the block along the floor, on which nothing presses it harder
    ball = {"normal": [-1, 0, 1], "gap": 1, "restitution": 1}
    floor = {"normal": [0, 1, 0], "gap": 0, "restitution": 0, "friction": "0.5"}
    values = {
        "mass": [[1, 0, 0], [0, 1, 0], [0, 0, 1]],
        "stiffness": [[0] * 3] * 3,
        "static_load": [0, 1, 0],
        "stops": [floor | {"tangent": [1, 0, 0]}, ball],
        "simultaneous": "sequence",
    }
    run = simulate_structure(Structure.parse(values), [[0, 0, 0], [0, 0, 1]], times=[2])
    assert kinds(run) == ["stick", "frictionless", "slide_positive"]
    with ctx.workprec(run.precision):
        # it takes the velocity of the ball at t = 1, and loses half of it to friction
        assert abs(run.states[0][0][0] - arb("0.75")) < 1e-90
        assert abs(run.states[0][1][0] - arb("0.5")) < 1e-90


# --- sets of closed stops ------------------------------------------------------------------------

#: Two masses side by side, each on a spring and against its own wall; a drive pulls them away.
TWO: Values = {
    "mass": [[1, 0], [0, 1]],
    "stiffness": [[2, -1], [-1, 2]],
    "static_load": ["0.3", "0.2"],
    "drive_amplitude": [1, "0.5"],
    "drive_frequency": 1,
    "stops": [
        {"normal": [1, 0], "gap": 0, "restitution": 0},
        {"normal": [0, 1], "gap": 0, "restitution": 0},
    ],
}


def test_closed_stops_open_one_after_the_other() -> None:
    # forces at rest: 0.3 + cos t and 0.2 + cos t/2; the second opens at cos t = -0.4 unless the
    # first has opened before, at cos t = -0.3
    run = simulate_structure(Structure.parse(TWO), [[0, 0], [0, 0]], times=[3])
    assert [(e.kind, e.stop) for e in changes(run)] == [
        ("closed", 0), ("closed", 1), ("release", 0), ("release", 1),
    ]  # fmt: skip
    with ctx.workprec(run.precision):
        first = arb("-0.3").acos()
        assert abs(changes(run)[2].time - first) < 1e-100
        # q2 is held: q1'' + 2 q1 = 0.3 + cos t from rest at q1 = 0
        t, root = changes(run)[3].time, arb(2).sqrt()
        a, b = arb("-0.15") - first.cos(), first.sin()
        s = t - first
        q1 = arb("0.15") + t.cos() + a * (root * s).cos() + b / root * (root * s).sin()
        assert abs(q1 + arb("0.2") + t.cos() / 2) < 1e-90  # the force on the second
        assert abs(changes(run)[3].state[0][0] - q1) < 1e-90


def test_a_closed_stop_opens_when_an_impact_pulls_it_away() -> None:
    # a bar of two coordinates, M^-1 with a positive coupling: W_01 > 0
    values = TWO | {"mass": [[1, "-0.25"], ["-0.25", 1]], "drive_amplitude": [0, 0]}
    values["stops"] = [
        {"normal": [1, 0], "gap": 0, "restitution": "0.5"},
        {"normal": [0, 1], "gap": "0.5", "restitution": "0.5"},
    ]
    run = simulate_structure(Structure.parse(values), [[0, "0.4"], [0, 1]], times=["0.3"])
    assert kinds(run)[:3] == ["closed", "frictionless", "release"]
    assert [(e.kind, e.stop) for e in changes(run)[:2]] == [("closed", 0), ("release", 0)]
    (hit,) = [impact for impact in run.impacts if impact.stop == 1]
    with ctx.workprec(run.precision):
        assert hit.v_pre[0].contains(0)
        assert hit.v_post[0] < 0


# --- impacts -------------------------------------------------------------------------------------


@pytest.mark.parametrize("law", ["poisson", "newton", "energetic"])
def test_an_impact_is_that_of_the_pendulum_at_its_angle(law: str) -> None:
    # at cos x1 = 3/5, sin x1 = 4/5: M = diag(1, 1/mbar), n = (cos, -1), t = (sin, 0)
    rng, regimes, mbar = random.Random(3), set(), Fraction(3, 5)
    for _ in range(sizes.either(60, 600)):
        mu, r = Fraction(rng.randint(1, 15), 10), Fraction(rng.randint(0, 10), 10)
        v1, v2 = (Fraction(rng.randint(-100, 100), 50) for _ in range(2))
        if not 3 * v1 / 5 - v2 > 0:
            continue
        stop = {"normal": ["0.6", -1], "gap": 0, "restitution": r, "friction": mu}
        made = Structure.parse(
            {
                "mass": [[1, 0], [0, 1 / mbar]],
                "stiffness": [[0, 0], [0, 0]],
                "stops": [stop | {"tangent": ["0.8", 0]}],
                "law": law,
            }
        )
        values: dict[str, Number] = dict.fromkeys(("zeta1", "zeta2", "f1", "f2", "delta"), 0)
        system = System.parse(values | {"mbar": mbar, "omega0": 1, "omega": 1, "r": r, "mu": mu})
        with ctx.workprec(300):
            z = column([*(arb(exact(v)) for v in (0, 0, v1, v2)), arb(1), arb(1), arb(0)])
            hold = Hold(made)
            found = impact_on(hold, 0, z, (hold.rates[0] * z)[0, 0])
            angle = arb("0.6").acos()
            wanted = LAWS[law](system, angle, arb(exact(v1)), arb(exact(v2)))
            assert found.regime == wanted.regime
            assert wanted.impulse is not None
            pairs = [
                (found.v_post[0], wanted.v1),
                (found.v_post[1], wanted.v2),
                (found.impulse_normal, wanted.impulse),
            ]
            assert all(abs(p - q) < 1e-70 for p, q in pairs)
        regimes.add(found.regime)
    assert len(regimes) == 5


# --- simultaneous impacts ------------------------------------------------------------------------


def test_a_cradle_by_the_three_rules() -> None:
    start = [["-1", 0, 0, 0], [1, 0, 0, 0]]
    stopped = simulate_structure(row_of_balls(4), start, times=[2])
    assert (stopped.ending, len(stopped.impacts)) == ("simultaneous", 0)

    swapped = simulate_structure(row_of_balls(4, simultaneous="sequence"), start, times=[2])
    assert [impact.stop for impact in swapped.impacts] == [0, 1, 2]
    together = simulate_structure(row_of_balls(4, simultaneous="together"), start, times=[2])
    assert {impact.stop for impact in together.impacts} == {0, 1, 2}
    with ctx.workprec(400):
        for impact in swapped.impacts:
            assert abs(impact.time - 1) < 1e-100
        for found, wanted in zip(swapped.states[0][1], (0, 0, 0, 1), strict=True):
            assert abs(found - wanted) < 1e-100
        # W P = (1 + r) u: all u+ are -1 or 0
        for found, part in zip(together.states[0][1], (-2, 2, 2, 2), strict=True):
            assert abs(found - arb(part) / 4) < 1e-100
        losses = [impact.energy_loss for impact in (*swapped.impacts, *together.impacts)]
        assert all(abs(loss) < 1e-100 for loss in losses[:3])
        assert abs(sum(losses[3:], arb(0))) < 1e-100


def test_a_sequence_that_needs_too_many_impacts_is_capped(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(impulses, "SEQUENCE_CAP", 2)
    start = [["-1", 0, 0, 0], [1, 0, 0, 0]]
    run = simulate_structure(row_of_balls(4, simultaneous="sequence"), start, times=[2])
    assert (run.ending, len(run.impacts)) == ("sequence_cap", 2)


@pytest.mark.parametrize("friction", [0, "0.25"])
def test_an_endless_sequence_shrinks_to_rest(friction: Any) -> None:
    # ball 0 hits ball 1 at a plastic wall again and again, each time a quarter as fast, or
    # 0.25 - 0.75 mu with friction that acts on ball 0
    values: Values = {
        "mass": [[1, 0], [0, 1]],
        "stiffness": [[0, 0], [0, 0]],
        "stops": [
            {"normal": [1, -1], "gap": 0, "restitution": "0.5"},
            {
                "normal": [0, 1], "gap": 0, "restitution": 0, "friction": friction,
                "tangent": [1, 0],
            },
        ],
        "simultaneous": "sequence",
    }  # fmt: skip
    run = simulate_structure(Structure.parse(values), [[-1, 0], [1, 0]], times=[2])
    assert (run.ending, run.precision) == ("completed", 400)
    assert run.proved == (1 if friction == 0 else 0)
    assert run.story[-1].kind == "closed"
    with ctx.workprec(run.precision):
        ratio = (1 - 3 * arb(friction)) / 4
        # until a velocity is below 2^-100
        assert abs(len(run.impacts) / 2 + float(100 * arb(2).log() / ratio.log())) < 2
        assert all(abs(velocity) < 1e-29 for velocity in run.states[0][1])
        for k, impact in enumerate(run.impacts[::2]):
            assert abs(impact.approach_velocity / ratio**k - 1) < 1e-100


def test_impacts_that_do_not_see_each_other_need_no_rule() -> None:
    stop = {"normal": [1, 0], "gap": 1, "restitution": "0.5"}
    values: Values = {
        "mass": [[1, 0], [0, 2]],
        "stiffness": [[0, 0], [0, 0]],
        "stops": [stop, stop | {"normal": [0, 1]}],
    }
    run = simulate_structure(Structure.parse(values), [[0, 0], [1, 1]], times=[2])
    assert [impact.stop for impact in run.impacts] == [0, 1]
    with ctx.workprec(run.precision):
        assert all(abs(v + arb("0.5")) < 1e-100 for v in run.states[0][1])


def test_together_ends_an_impact_on_a_closed_stop_without_a_gain_of_energy() -> None:
    # ball 1 lies pressed on the ground, ball 0 falls on it
    values: Values = {
        "mass": [[1, 0], [0, 2]],
        "stiffness": [[0, 0], [0, 0]],
        "static_load": [1, 1],
        "stops": [
            {"normal": [1, -1], "gap": 0, "restitution": "0.5"},
            {"normal": [0, 1], "gap": 0, "restitution": "0.5"},
        ],
        "simultaneous": "together",
    }
    run = simulate_structure(Structure.parse(values), [["-0.5", 0], [0, 0]], times=[8])
    with ctx.workprec(run.precision):
        first = run.impacts[0]
        assert abs(first.approach_velocity - 1) < 1e-100
        assert abs(first.v_post[0] + arb("0.5")) < 1e-100
        assert abs(first.v_post[1]) < 1e-100
        assert abs(run.impacts[1].impulse_normal - arb("1.5")) < 1e-100  # the ground's impulse
        # the chatter on the ball that stays closed: 1 + 2 (1/2 + 1/4 + ...) = 3
        limit = next(entry for entry in changes(run) if entry.kind == "chatter")
        assert limit.time.contains(3)
        assert limit.time.rad() < 1e-40
        assert all(abs(value) < 1e-100 for part in run.states[0] for value in part)
    assert kinds(run)[-2:] == ["chatter", "closed"]


def test_symmetric_stops_open_and_close_together() -> None:
    symmetric = {"stiffness": [[1, 0], [0, 1]], "static_load": [0, 0], "drive_amplitude": [1, 1]}
    run = simulate_structure(
        Structure.parse(TWO | symmetric | {"drive_frequency": "0.5"}), [[0, 0], [0, 0]], times=[12]
    )
    assert kinds(run) == ["closed"] * 2 + ["release"] * 2 + ["frictionless"] * 2 + ["closed"] * 2
    with ctx.workprec(run.precision):
        for entry in changes(run)[2:4]:
            assert abs(entry.time - arb.pi()) < 1e-100
        assert abs(run.impacts[0].time - run.impacts[1].time) < 1e-90

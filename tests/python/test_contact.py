"""Sustained contact: reference data, bouncing balls, starts, and what a run says of its contacts.

Sources: tests/data/contact.json (its README says how it was made); the bouncing balls of DiffEqDocs
and of the FMI reference units; docs/theory.md, section 5.
"""

import math
import pickle

import numpy as np
import pytest

import vibroimpact as vi
from comparing import assert_same_bits
from references import reference, scene_initial, scene_system
from vibroimpact import EventKind

SCENES = reference("contact.json")
# The reference is good to some 1e-10 (tests/data/README.md).
REFERENCE_ATOL = 1e-9
SLIDES = (EventKind.SLIDE_POSITIVE, EventKind.SLIDE_NEGATIVE)


def simulated(name: str, **options) -> vi.Run:
    scene = SCENES[name]
    system = scene_system({"phase": "0"} | scene)
    options = options or {"periods": scene["periods"]}
    return vi.simulate(system, initial=scene_initial(scene), **options)


@pytest.mark.parametrize("name", SCENES)
def test_every_phase_and_section_of_the_reference(name):
    scene, run = SCENES[name], simulated(name)
    assert run.stop_reason == "completed"
    assert len(run.contacts) == len(scene["phases"]) > 0
    for ours, theirs in zip(run.contacts, scene["phases"], strict=True):
        kind = EventKind(ours["kind"])
        word = "slide" if kind in SLIDES else kind.name.lower().replace("chatter", "contact")
        assert word == theirs["event"]
        for column, key in (("time", "t"), ("x1", "x1"), ("v1", "v1")):
            assert abs(ours[column] - theirs[key]) < REFERENCE_ATOL, (theirs, column)
        if kind in SLIDES:
            # At a change of direction v1 = 0: the direction is that just after.
            v1 = run.trajectory([ours["time"] + 1e-6])[0, 1]
            assert (v1 > 0.0) == (kind == EventKind.SLIDE_POSITIVE)
    rows = np.array(scene["stroboscopic"])
    np.testing.assert_allclose(run.stroboscopic, rows, rtol=0.0, atol=REFERENCE_ATOL)


@pytest.mark.parametrize("name", SCENES)
def test_columns_agree_with_one_another(name):
    run = simulated(name)
    contacts, system = run.contacts, run.system
    events = run.events[np.isin(run.events["kind"], contacts["kind"])]
    assert events["index"].tolist() == list(range(len(contacts)))
    assert events["kind"].tolist() == contacts["kind"].tolist()
    assert events["time"].tolist() == contacts["time"].tolist()
    np.testing.assert_allclose(
        contacts["period"] * system.drive_period + contacts["time_in_period"],
        contacts["time"],
        rtol=1e-14,
    )
    np.testing.assert_allclose(
        contacts["phase"], contacts["time_in_period"] * system.drive_frequency, rtol=1e-14
    )
    # On the contact, and staying there: g = g' = 0 to rounding.
    g = np.sin(contacts["x1"]) - contacts["x2"] - system.gap
    rate = contacts["v1"] * np.cos(contacts["x1"]) - contacts["v2"]
    assert max(np.abs(g).max(), np.abs(rate).max()) < 1e-15
    forces = run.trajectory(contacts["time"], forces=True)[:, 4:]
    columns = np.column_stack([contacts["normal_force"], contacts["tangential_force"]])
    # A time is known to an ulp only, and the force changes by some 1 per unit of time.
    np.testing.assert_allclose(forces, columns, rtol=0.0, atol=1e-12)
    chatter = contacts[contacts["kind"] == EventKind.CHATTER]
    others = contacts[contacts["kind"] != EventKind.CHATTER]
    assert (chatter["impacts_skipped"] > 0).all()
    assert (chatter["error"] < 1e-12).all()  # the default tolerance
    for column in ("impacts_skipped", "time_jump", "error"):
        assert (others[column] == 0.0).all()
    last = run.impacts["time"][np.searchsorted(run.impacts["time"], chatter["time"]) - 1]
    np.testing.assert_allclose(chatter["time"] - last, chatter["time_jump"], rtol=0.0, atol=1e-13)


def test_time_in_contact_is_that_between_the_events():
    run = simulated("friction_stick_slip")
    kind, time = run.contacts["kind"], run.contacts["time"]
    begins = time[kind == EventKind.CHATTER]
    ends = time[kind == EventKind.RELEASE]
    assert len(begins) == len(ends) == 4
    assert run.time_in_contact == pytest.approx(float((ends - begins).sum()), rel=1e-14)


def ball(acceleration: float, restitution: float) -> vi.System:
    """A ball that falls from height 1 onto a wall: x1 = 1 - height."""
    return vi.System(
        mass_ratio=0.0,
        frequency_ratio=0.0,
        restitution=restitution,
        gap=1.0,
        drive_frequency=0.0,
        moment_amplitude=acceleration,
        contact="direct",
    )


def test_a_bouncing_ball_comes_to_rest_where_its_bounces_accumulate():
    # DiffEqDocs: t1 = sqrt(2/9.8), accumulation at t1 (1 + r)/(1 - r) = 3 t1.
    run = vi.simulate(ball(9.8, 0.5), initial=(0, 0, 0, 0), time=2.0)
    assert run.impacts["time"][0] == pytest.approx(0.4517539514526256, abs=1e-13)
    chatter, stick = run.contacts
    assert chatter["time"] == pytest.approx(1.3552618543578767, abs=1e-13)
    assert (chatter["kind"], stick["kind"]) == (EventKind.CHATTER, EventKind.STICK)
    assert run.stop_reason == "rest"
    assert run.final_state.state == (1.0, 0.0, 0.0, 0.0)
    assert (run.final_state.time, run.final_state.mode) == (2.0, "stick")
    assert stick["normal_force"] == pytest.approx(9.8, rel=1e-15)
    assert run.time_in_contact == pytest.approx(2.0 - 1.3552618543578767, abs=1e-13)
    more = run.resume(time=1.0)
    assert (more.stop_reason, more.time_in_contact) == ("rest", 1.0)
    assert_same_bits(pickle.loads(pickle.dumps(more)), more)


def test_a_bouncing_ball_has_the_exact_heights_and_speeds():
    # FMI reference units, exact values: after the first bounce, at t1 = sqrt(2/g), the speed is
    # r g t1.
    run = vi.simulate(ball(9.81, 0.7), initial=(0, 0, 0, 0), time=3.0)
    heights = 1.0 - run.trajectory([0.5, 1.0, 2.0, 2.6])[:, 0]
    speeds = -run.trajectory([0.5, 1.0, 2.0, 2.6])[:, 1]
    first = math.sqrt(2 / 9.81)
    assert heights[:2] == pytest.approx([0.1387798803595172, 0.225059760719034], abs=1e-13)
    assert speeds[0] == pytest.approx(2.625059760719034, abs=1e-13)
    assert speeds[1] == pytest.approx(9.81 * (0.7 * first - (1.0 - first)), abs=1e-13)
    assert run.contacts["time"][0] == pytest.approx(2.5586339655858077, abs=1e-13)
    assert (heights[3], speeds[3]) == (0.0, 0.0)
    assert heights[2] > 0.0


@pytest.fixture
def touching() -> vi.System:
    """At (0, v1, -1/2, v2) the tip touches: g = 0, g'' = f1 - 1/2 at rest."""
    return vi.System(
        mass_ratio=0.6,
        frequency_ratio=2.0,
        restitution=0.8,
        gap=0.5,
        drive_frequency=1.5,
        moment_amplitude=1.0,
    )


def test_a_start_on_the_contact_that_approaches_is_an_impact_at_once(touching):
    run = vi.simulate(touching, initial=(0.0, 1.0, -0.5, 0.25), periods=1)
    hit = run.impacts[0]
    assert (hit["time"], hit["x1"], hit["v1_pre"], hit["v2_pre"]) == (0.0, 0.0, 1.0, 0.25)
    # u = 0.75, frictionless: u_post = -r u.
    assert hit["v1_post"] - hit["v2_post"] == pytest.approx(-0.6, rel=1e-15)
    assert run.trajectory([0.0])[0].tolist() == [0.0, hit["v1_post"], -0.5, hit["v2_post"]]
    assert run.events["kind"][0] == EventKind.IMPACT


def test_a_start_on_the_contact_that_separates_is_a_flight(touching):
    run = vi.simulate(touching, initial=(0.0, -1.0, -0.5, 0.0), periods=1)
    assert not (run.events["time"][:-1] < 0.5).any()
    x1, _, x2, _ = run.trajectory([0.1])[0]
    assert math.sin(x1) - x2 - 0.5 == pytest.approx(-0.1, abs=0.01)  # g = -t + O(t^2)


def test_a_start_at_rest_on_the_contact_lasts_or_ends_as_the_forces_say(touching):
    pressed = vi.simulate(touching, initial=(0.0, 0.0, -0.5, 0.0), periods=1)
    first = pressed.contacts[0]
    assert (first["time"], first["kind"]) == (0.0, EventKind.SLIDE_POSITIVE)
    # p = (a1 - a2)/(mbar + 1), a1 = f1, a2 = -x2.
    assert first["normal_force"] == pytest.approx((1.0 - 0.5) / 1.6, rel=1e-15)
    assert pressed.contacts["kind"][1] == EventKind.RELEASE
    pulled = vi.simulate(
        touching.replace(moment_amplitude=0.0), initial=(0.0, 0.0, -0.5, 0.0), periods=1
    )
    assert not (pulled.events["time"][:-1] < 0.5).any()
    x1, _, x2, _ = pulled.trajectory([0.1])[0]
    assert math.sin(x1) - x2 - 0.5 == pytest.approx(-0.25 * 0.01, rel=0.01)  # g'' t^2/2


def test_a_start_inside_the_other_body_is_an_error(touching):
    for depth in (1e-12, 0.1):
        with pytest.raises(vi.StateError, match="initial"):
            vi.simulate(touching, initial=(0.0, 0.0, -0.5 - depth, 0.0), periods=1)


def test_slip_that_drives_the_bodies_together_stops_the_run(touching):
    # mbar + k cos x1 = 0.6 + (cos x1 - 3 sin x1) cos x1 = -0.4 at pi/4, pressed by f1 = 6.
    x1, v1 = math.pi / 4, -0.1
    start = (x1, v1, math.sin(x1) - 0.5, v1 * math.cos(x1))
    rough = touching.replace(friction=3.0, moment_amplitude=6.0)
    run = vi.simulate(rough, initial=start, periods=5)
    assert (run.stop_reason, run.final_state.time) == ("painleve", 0.0)
    assert run.label == "unresolved"
    with pytest.raises(vi.ParameterError, match="painleve"):
        run.resume(periods=1)

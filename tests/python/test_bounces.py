"""All bounces of a run: those that complete chatter skipped, beside those that a run lists.

A ball that falls with acceleration a from the height h strikes at t1 = sqrt(2 h/a) with the speed
a t1, and at t1 (1 + 2 (r + ... + r^n)) with the speed a t1 r^n; the bounces accumulate at
t1 (1 + r)/(1 - r) (DiffEqDocs). Where no formula is at hand, the same chatter is followed bounce by
bounce, under a tolerance that no extrapolation meets.
"""

import copy
import math
import pickle

import numpy as np
import pytest

import vibroimpact as vi
from ctrl_c import asks_of, ctrl_c_at
from systems import LOW, PAPER, ROUGH
from vibroimpact import BouncesEnd

GRAVITY, RATIO = 9.8, 0.9
BALL = vi.System(
    mass_ratio=0,
    frequency_ratio=0,
    restitution=RATIO,
    gap=0,
    drive_frequency=0,
    moment_amplitude=GRAVITY,
    contact="direct",
)
START = (-1.0, 0.0, 0.0, 0.0)
FIRST = math.sqrt(2.0 / GRAVITY)
END = FIRST * (1.0 + RATIO) / (1.0 - RATIO)
# Complete chatter in every drive period, as in Fig. 7(c) of the paper.
SLOW = LOW.replace(drive_frequency=0.25)
SLOW_START = (0.0, 0.5, 0.0, 0.0)


@pytest.fixture(scope="module")
def run() -> vi.Run:
    return vi.simulate(BALL, initial=START, time=10.0)


def test_all_bounces_of_a_ball_follow_the_geometric_law(run):
    bounces = run.bounces(down_to=1e-9)
    impacts = bounces.impacts
    number = np.arange(len(impacts))
    exact = GRAVITY * FIRST * RATIO**number
    np.testing.assert_allclose(impacts["v1_pre"], exact, rtol=1e-12)
    np.testing.assert_allclose(impacts["v1_post"], -RATIO * exact, rtol=1e-12)
    time = FIRST * (1.0 + 2.0 * (RATIO - RATIO ** (number + 1)) / (1.0 - RATIO))
    np.testing.assert_allclose(impacts["time"], time, atol=1e-13)
    # The list goes down to the velocity asked for, and no further.
    assert impacts["v1_pre"][-1] >= 1e-9 > RATIO * impacts["v1_pre"][-1]
    assert bounces.ends == (BouncesEnd.APPROACH_VELOCITY,)
    # Those that the run lists come first, with the same bits.
    listed = ~impacts["skipped"]
    assert listed[: len(run.impacts)].all()
    assert not listed[len(run.impacts) :].any()
    assert bounces.skipped == len(impacts) - len(run.impacts) > 150
    for name in run.impacts.dtype.names:
        assert impacts[name][listed].tobytes() == run.impacts[name].tobytes()


def test_their_times_add_up_to_the_accumulation_point(run):
    bounces = run.bounces()
    assert bounces.ends == (BouncesEnd.ACCUMULATION,)
    (chatter,) = run.contacts[run.contacts["kind"] == vi.EventKind.CHATTER]
    flights = np.diff(bounces.impacts["time"])
    last = bounces.impacts[-1]
    left = 2.0 * abs(last["v1_post"]) / (GRAVITY * (1.0 - RATIO))
    assert bounces.impacts["time"][0] + flights.sum() + left == pytest.approx(END, abs=1e-12)
    assert chatter["time"] == pytest.approx(END, abs=1e-12)
    assert left < 1e-10


def test_their_energies_are_those_of_the_audit(run):
    lost = run.bounces().impacts["energy_loss"].sum()
    assert lost == pytest.approx(-run.energy_audit().restitution, rel=1e-14)
    # All of the ball's energy, that of its fall.
    assert lost == pytest.approx(GRAVITY, rel=1e-13)
    assert run.impacts["energy_loss"].sum() < 0.99 * GRAVITY


@pytest.mark.parametrize(
    ("system", "length"),
    [
        (BALL, {"time": 10.0}),
        (SLOW, {"periods": 1}),
        (SLOW.replace(friction=0.3), {"periods": 1}),
        (SLOW.replace(friction=0.1, law="newton"), {"periods": 1}),
    ],
)
def test_they_are_those_of_a_run_that_skips_none(system, length):
    start = START if system is BALL else SLOW_START
    run = vi.simulate(system, initial=start, **length)
    fine = vi.simulate(system, initial=start, chatter_tolerance=1e-30, **length)
    first = run.contacts[run.contacts["kind"] == vi.EventKind.CHATTER][0]
    before = run.bounces(down_to=1e-6).impacts
    before = before[before["time"] < first["time"]]
    assert before["skipped"].sum() > 20
    expected = fine.impacts[: len(before)]
    assert (before["regime"] == expected["regime"]).all()
    for name in ("time", "x1", "v1_pre", "v1_post", "x2", "v2_pre", "v2_post", "energy_loss"):
        np.testing.assert_allclose(before[name], expected[name], rtol=0.0, atol=1e-13)
    # The next one would have been slower.
    pre = fine.impacts[len(before)]
    slope = 1.0 if system.contact == "direct" else math.cos(pre["x1"])
    assert pre["v1_pre"] * slope - pre["v2_pre"] < 1e-6


def test_every_chatter_of_a_run_says_why_its_list_ends():
    run = vi.simulate(SLOW, initial=SLOW_START, periods=6)
    chatters = int(np.count_nonzero(run.contacts["kind"] == vi.EventKind.CHATTER))
    bounces = run.bounces(down_to=1e-5)
    assert chatters == 6
    assert bounces.ends == (BouncesEnd.APPROACH_VELOCITY,) * chatters
    assert (np.diff(bounces.impacts["time"]) > 0.0).all()
    assert not bounces.capped
    # With few allowed, later lists are cut, and no row is lost that the run has.
    few = run.bounces(down_to=1e-5, most=bounces.skipped - 1)
    assert few.skipped == bounces.skipped - 1
    assert few.ends == (*bounces.ends[:-1], BouncesEnd.CAP)
    assert few.capped
    none = run.bounces(most=0)
    assert none.ends == (BouncesEnd.CAP,) * chatters
    assert none.impacts["time"].tolist() == run.impacts["time"].tolist()


@pytest.mark.parametrize("part", [0.3, 0.77, 0.999])
def test_a_run_that_ends_among_the_bounces_lists_those_before_its_end(run, part):
    end = FIRST + part * (END - FIRST)
    cut = vi.simulate(BALL, initial=START, time=end)
    bounces = cut.bounces(down_to=1e-9)
    assert bounces.impacts["time"][-1] <= end
    expected = run.bounces(down_to=1e-9).impacts
    expected = expected[expected["time"] <= end]
    np.testing.assert_allclose(bounces.impacts["time"], expected["time"], atol=1e-14)
    among = end > run.impacts["time"][-1]
    assert bounces.ends == ((BouncesEnd.RUN_END,) if among else ())


def test_a_window_that_begins_among_the_bounces_has_those_after_its_start():
    # A soft spring presses the ball against the wall; the drive is none, but its periods count.
    spring = {"frequency_ratio": 0.1, "gap": -10.0, "moment_amplitude": 0.0}
    start = (-11.0, 0.0, 0.0, 0.0)
    system = BALL.replace(drive_frequency=50.0, **spring)
    whole = vi.simulate(system, initial=start, periods=800)
    (chatter,) = whole.contacts[whole.contacts["kind"] == vi.EventKind.CHATTER]
    period = math.ceil(whole.impacts["time"][-1] / system.drive_period)
    assert period * system.drive_period < chatter["time"]
    late = vi.simulate(system, initial=start, periods=800, keep=800 - period)
    assert len(late.impacts) == 0
    found, expected = late.bounces().impacts, whole.bounces().impacts
    expected = expected[expected["time"] > late.kept_from]
    assert 0 < len(expected) < whole.bounces().skipped
    np.testing.assert_allclose(found["time"], expected["time"], atol=1e-12)


def test_without_chatter_there_are_the_impacts_alone():
    run = vi.simulate(ROUGH, initial=(0.0, 0.5, 0.0, 0.0), periods=20)
    bounces = run.bounces()
    assert (bounces.ends, bounces.skipped) == ((), 0)
    assert not bounces.impacts["skipped"].any()
    assert bounces.impacts["time"].tobytes() == run.impacts["time"].tobytes()
    assert repr(bounces) == f"<Bounces: {len(run.impacts)} impacts, 0 of them skipped in chatter>"


def test_a_run_says_that_its_count_leaves_some_out(run):
    assert run.impact_count == len(run.impacts) == 19
    assert "19 impacts and a complete chatter, 19 kept" in repr(run)
    driven = vi.simulate(SLOW, initial=SLOW_START, periods=6, keep=4)
    chatters = np.count_nonzero(driven.contacts["kind"] == vi.EventKind.CHATTER)
    kept = f"{driven.impact_count} impacts, {len(driven.impacts)} kept"
    assert f"{kept} and {chatters} complete chatters>" in repr(driven)
    plain = vi.simulate(PAPER, initial=(0.0, 0.5, 0.0, 0.0), periods=20)
    assert "chatter" not in repr(plain)


def test_the_result_is_read_only_and_so_are_its_copies(run):
    bounces = run.bounces(down_to=1e-3)
    for one in (bounces, copy.deepcopy(bounces), pickle.loads(pickle.dumps(bounces))):
        assert one.impacts.tobytes() == bounces.impacts.tobytes()
        assert one.ends == bounces.ends
        with pytest.raises(ValueError, match="read-only"):
            one.impacts["time"] = 0.0
    with pytest.raises(AttributeError):
        bounces.ends = ()
    assert "1 x approach_velocity" in repr(bounces)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"down_to": -1e-3}, "down_to = -0.001 is not allowed; allowed: a finite number >= 0"),
        ({"down_to": math.nan}, "down_to = nan is not allowed"),
        ({"most": -1}, "most = -1 is not allowed; allowed: an integer >= 0"),
        ({"most": 0.5}, "most = 0.5 is not allowed"),
    ],
)
def test_bad_arguments_are_named(run, arguments, message):
    with pytest.raises(vi.ParameterError) as caught:
        run.bounces(**arguments)
    assert message in str(caught.value)


def test_ctrl_c_hands_over_the_bounces_so_far(run):
    whole = run.bounces()
    with ctrl_c_at(asks_of(run.bounces) // 2) as caught:
        run.bounces()
    part = caught.value.result
    assert part.ends == (BouncesEnd.INTERRUPTED,)
    assert len(run.impacts) < len(part.impacts) < len(whole.impacts)
    assert part.impacts.tobytes() == whole.impacts[: len(part.impacts)].tobytes()

"""vi.verify for runs of structures: every number, friction, chatter, closed sets, what is wrong."""

import numpy as np
import pytest

import vibroimpact as vi

pytest.importorskip("flint", reason="verification needs python-flint")

from two_masses import beam, structure

# Two masses, each pressed against a wall of its own by turns, which they chatter on and stay at.
PRESSED = vi.Structure(
    [[1, 0], [0, 2]],
    [[3, -1], [-1, 2]],
    [vi.Stop([1, 0], 0.1, 0.4), vi.Stop([0, 1], 0.2, 0.3)],
    damping=[[0.1, -0.05], [-0.05, 0.2]],
    static_load=[0.8, 0.9],
    drive_amplitude=[2, 1],
    drive_frequency=0.7,
)
# A mass on a floor that is pushed along it: it slides, sticks and leaves.
RUBBED = vi.Structure(
    [[1, 0], [0, 1]],
    [[0.5, 0], [0, 1]],
    [vi.Stop([1, 0], 0.0, 0.3, friction=0.4, tangent=[0, 1])],
    static_load=[1, 0],
    drive_amplitude=[0.9, 1.2j],
    drive_frequency=0.8,
)


# Two masses between springs, with impacts on both stops, one of them with friction.
BOTH = structure(
    stops=[
        vi.Stop([0, 1], 0.3, 0.8),
        vi.Stop([1, -1], 0.3, 0.8, friction=0.2, tangent=[1, 1], amplitude=0.05, phase=0.4),
    ]
)


def run_of(made, **options):
    start = np.zeros((2, made.coordinates))
    return vi.simulate(made, initial=start, **{"periods": 3} | options)


@pytest.fixture(scope="module")
def driven():
    return run_of(BOTH)


def falsified(run, table, name, row, value):
    """The run with another value in one row of a table."""
    names = ("impacts", "stroboscopic", "events", "grazes", "contacts")
    parts = {each: getattr(run._core, each) for each in names}
    if name is None:
        parts[table] = parts[table].copy()
        parts[table][row] = value
    else:
        column = parts[table][name].copy()
        column[row] = value
        parts[table] = parts[table] | {name: column}
    core = type(run._core).from_parts(run.system._compiled, run._core.to_json(), **parts)
    return vi.StructureRun(core, run.system, run.initial)


def test_a_run_with_impacts_on_two_stops_holds_and_is_proved(driven):
    found = vi.verify(driven)
    assert set(driven.impacts["stop"]) == {0, 1}
    assert found.holds
    assert found.certified
    assert 13 < found.least_digits <= 16
    assert len(found.impacts) == driven.impact_count > 10
    assert len(found.sections) == 3
    assert len(found.final) == 1
    assert found.impacts["stop"].tolist() == driven.impacts["stop"].tolist()
    assert found.impacts["error_q"].shape == (driven.impact_count, 2)
    assert found.impacts["error_q"].max() < 1e-13
    assert found.impacts["reference_error"].max() < 1e-20
    assert "enclosed by proof" in str(found)
    assert found.plot().get_ylabel() == "right digits"


@pytest.mark.parametrize(
    "name",
    [
        "time", "q", "v_pre", "v_post", "approach_velocity", "phase", "impulse_normal",
        "impulse_tangential", "energy_loss",
    ],
)  # fmt: skip
def test_a_falsified_number_is_found_where_it_stands(driven, name):
    row = int(np.flatnonzero(driven.impacts["stop"] == 1)[1])
    value = np.array(driven.impacts[name][row]) + 1e-7
    wrong = vi.verify(falsified(driven, "impacts", name, row, value))
    assert not wrong.holds
    assert (wrong.horizon.event, wrong.horizon.number) == ("impact", row + 1)
    assert wrong.horizon.reason == "digits"
    bad = wrong.impacts["digits"] < 10
    assert np.flatnonzero(bad).tolist() == [row]
    assert np.max(wrong.impacts[f"error_{name}"][row]) == pytest.approx(1e-7, rel=1e-6)


def test_a_falsified_regime_stop_or_section_is_found(driven):
    row = int(np.flatnonzero(driven.impacts["stop"] == 1)[0])
    other = vi.Regime.STICK_RESTITUTION
    assert driven.impacts["regime"][row] != other
    wrong = vi.verify(falsified(driven, "impacts", "regime", row, other))
    assert (wrong.horizon.number, wrong.horizon.reason) == (row + 1, "regime")
    wrong = vi.verify(falsified(driven, "impacts", "stop", row, 0))
    assert (wrong.horizon.number, wrong.horizon.reason) == (row + 1, "sequence")
    assert wrong.stopped == "sequence"
    wrong = vi.verify(falsified(driven, "stroboscopic", None, (1, 0, 1), np.nan))
    assert (wrong.horizon.event, wrong.horizon.number) == ("section", 1)


def test_chatter_and_closed_sets_are_compared_and_no_proof_is_claimed():
    run = run_of(PRESSED, periods=1)
    assert run.contacts["closed"].all(axis=1).any()
    kinds = {vi.EventKind.CHATTER, vi.EventKind.CLOSED, vi.EventKind.RELEASE}
    assert kinds <= set(run.contacts["kind"])
    found = vi.verify(run)
    assert found.holds
    assert not found.certified
    assert len(found.contacts) == len(run.contacts)
    assert found.contacts["kind"].tolist() == run.contacts["kind"].tolist()
    first = np.flatnonzero(run.events["kind"] == vi.EventKind.CHATTER)[0]
    assert found.impacts["certified"][0]
    assert first > 0
    assert not found.contacts["certified"].any()
    wrong = falsified(run, "contacts", "q", 3, run.contacts["q"][3] + [0, 1e-6])
    horizon = vi.verify(wrong).horizon
    assert (horizon.number, horizon.event) == (
        3,
        vi.EventKind(run.contacts["kind"][3]).name.lower(),
    )


def test_sliding_and_sticking_are_proved():
    run = run_of(RUBBED)
    kinds = {vi.EventKind.STICK, vi.EventKind.SLIDE_POSITIVE, vi.EventKind.SLIDE_NEGATIVE}
    assert kinds <= set(run.contacts["kind"])
    found = vi.verify(run)
    assert found.holds
    assert found.certified
    assert len(found.contacts) == len(run.contacts)


def test_a_structure_of_modes_is_compared_in_its_modes():
    made = beam(drive_amplitude=[1, 0, 0], drive_frequency=0.9, damping_ratios=[0.01, 0.02])
    run = run_of(made, periods=2)
    found = vi.verify(run)
    assert found.holds
    assert len(found.impacts) == run.impact_count > 5
    assert run.impacts["q"].shape[1] == 3
    assert found.impacts["error_q"].shape[1] == 2
    wrong = falsified(run, "impacts", "v_post", 2, run._core.impacts["v_post"][2] + [0, 1e-7])
    assert vi.verify(wrong).horizon.number == 3


def test_what_a_run_has_not_kept_is_made_again(driven):
    kept = vi.verify(run_of(BOTH, keep=1))
    whole = vi.verify(driven)
    assert kept.from_start
    assert kept.holds
    assert kept.first_kept > 1
    assert len(kept.impacts) == kept.kept[0] < len(kept.whole_impacts)
    assert kept.whole_impacts.tobytes() == whole.whole_impacts.tobytes()
    assert kept.sections["row"].tolist() == [0]
    assert kept.whole_sections.tobytes() == whole.whole_sections.tobytes()


def test_without_a_drive_period():
    made = structure(drive_frequency=0.0, drive_amplitude=[0.3, 0.1], stops=[BOTH.stops[0]])
    run = vi.simulate(made, initial=[[0, 0], [1, 1]], time=20)
    found = vi.verify(run)
    assert found.holds
    assert found.certified
    assert len(found.impacts) == run.impact_count > 2
    assert len(found.sections) == 0
    assert len(found.final) == 1


@pytest.mark.parametrize("rule", ["sequence", "together"])
def test_impacts_at_one_instant(rule):
    # two masses that touch fall on a wall, the second one first: both stops see each other
    made = vi.Structure(
        np.eye(2),
        np.zeros((2, 2)),
        [vi.Stop([0, 1], 0, 0.5), vi.Stop([1, -1], 0, 0.5)],
        static_load=[1, 1],
        simultaneous=rule,
    )
    run = vi.simulate(made, initial=[[-0.5, -0.5], [0, 0]], time=1.2)
    assert (np.diff(run.impacts["time"]) == 0).any()
    found = vi.verify(run)
    assert len(found.impacts) == run.impact_count > 1
    assert found.horizon is None
    assert found.impacts["digits"].min() > 14


def test_an_end_that_both_have_holds():
    made = vi.Structure(
        np.eye(3),
        np.zeros((3, 3)),
        [vi.Stop([1, -1, 0], 0, 0.5), vi.Stop([0, 1, -1], 0, 0.5)],
    )
    # the outer two meet the resting middle one at one instant
    run = vi.simulate(made, initial=[[-1, 0, 1], [1, 0, -1]], time=3)
    assert run.stop_reason == "simultaneous"
    found = vi.verify(run)
    assert found.stopped == "completed"
    assert found.horizon is None
    assert "both end at time 1: simultaneous" in found.stop_detail


def test_caps_end_it(driven):
    found = vi.verify(driven, max_events=5)
    assert found.stopped == "event_cap"
    assert not found.holds
    assert len(found.impacts) == 5
    assert found.horizon is None
    assert "max_events" in str(found)


def test_ctrl_c_hands_over_what_is_verified(driven, monkeypatch):
    from vibroimpact.verification import watch

    def stop(self, number, time):
        if number == 4:
            raise KeyboardInterrupt
        return False

    monkeypatch.setattr(watch.Watch, "impact", stop)
    with pytest.raises(vi.Interrupted) as caught:
        vi.verify(driven)
    assert caught.value.result.stopped == "interrupted"
    assert 4 <= len(caught.value.result.impacts) <= 5


def test_of_two_stops_that_lose_their_force_at_once_one_stays_closed():
    # both loads turn at one instant, and the second mass would leave the first one behind
    made = vi.Structure(
        np.eye(2),
        np.zeros((2, 2)),
        [vi.Stop([0, 1], 0, 0), vi.Stop([1, -1], 0, 0)],
        damping=0.1 * np.eye(2),
        drive_amplitude=[1, 2],
        drive_frequency=1,
        simultaneous="together",
    )
    run = vi.simulate(made, initial=np.zeros((2, 2)), time=3)
    kinds = [(vi.EventKind(row["kind"]).name, row["stop"]) for row in run.contacts]
    assert kinds == [("CLOSED", 0), ("RELEASE", 0)]
    found = vi.verify(run)
    assert found.holds
    assert found.certified


def test_of_two_rough_stops_one_may_leave():
    # a body is thrown into a corner, sticks to both sides, and slides off along one of them
    sides = [
        vi.Stop([0, 1], 0, 0, friction=0.2, tangent=[1, 0]),
        vi.Stop([1, 0], 0, 0, friction=0.3, tangent=[0, 1]),
    ]
    made = vi.Structure(
        np.eye(2), 0.1 * np.eye(2), sides, static_load=[-1, 1], simultaneous="sequence"
    )
    run = vi.simulate(made, initial=[[0, 0], [1, 1]], time=3)
    assert run.contacts["kind"].tolist() == [vi.EventKind.SLIDE_NEGATIVE]
    found = vi.verify(run)
    assert found.holds
    assert found.certified


def test_a_run_that_has_left_the_motion_is_given_up():
    chaotic = vi.Structure(
        [[1]],
        [[1]],
        [vi.Stop([1], 0.0, 0.8)],
        damping=[[0.02]],
        drive_amplitude=[1],
        drive_frequency=2.8,
    )
    run = vi.simulate(chaotic, initial=[[-0.5], [0.3]], periods=200)
    found = vi.verify(run)
    assert found.stopped == "lost"
    assert 10 < len(found.impacts) < run.impact_count
    assert found.horizon.reason == "digits"
    assert found.last_right > found.impacts["number"][found.impacts["digits"] >= 10].max()


def test_rows_that_only_say_what_impacts_on_closed_stops_did():
    from vibroimpact.verification.told import essential

    told = [
        ("closed", 0, 1.0),
        ("impact", 0, 2.0),
        ("closed", 0, 2.0),  # goes on so
        ("impact", 0, 3.0),  # opened by it
        ("impact", 0, 4.0),
        ("closed", 0, 4.0),
        ("impact", 1, 5.0),
        ("release", 0, 5.0),
        ("slide_positive", 1, 6.0),
        ("impact", 1, 7.0),
        ("slide_negative", 1, 7.0),
        ("impact", 0, 8.0),
        ("slide_negative", 1, 8.0),  # goes on so, though it is not hit
    ]
    told_again = (2, 12)
    exact = [row for k, row in enumerate(told) if k not in told_again]
    exact.insert(3, ("release", 0, 3.0))
    left = [told[k] for k in essential(told, told_again=True)[0]]
    right = [exact[k] for k in essential(exact, told_again=False)[0]]
    assert left == right == [row for k, row in enumerate(told) if k not in told_again]
    # a window that begins while the stop is closed
    assert essential(told[1:3], told_again=True, holds={0: "closed"}) == ([0], {0: "closed"})
    assert essential(told[1:3], told_again=True) == ([0, 1], {0: "closed"})

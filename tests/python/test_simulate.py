"""The call vi.simulate: shapes of what it returns, and errors before any work."""

import math
import re

import numpy as np
import pytest

import vibroimpact as vi
from comparing import assert_same_bits
from ctrl_c import asks_of, ctrl_c_at

# A length no run could reach: an error that comes late would not come at all.
FOREVER = 10**12

IMPACT_COLUMNS = (
    "time",
    "period",
    "time_in_period",
    "x1",
    "v1_pre",
    "v1_post",
    "x2",
    "v2_pre",
    "v2_post",
    "approach_velocity",
    "phase",
    "regime",
    "impulse_normal",
    "impulse_tangential",
    "energy_loss",
)


def test_shapes_and_columns(system, initial):
    run = vi.simulate(system, initial=initial, periods=50, keep=20)
    assert run.stop_reason == "completed"
    assert run.system == system
    assert run.initial == initial
    assert run.impacts.dtype.names == IMPACT_COLUMNS
    assert run.events.dtype.names == ("time", "period", "kind", "index")
    assert run.stroboscopic.shape == (20, 4)
    assert 0 < len(run.impacts) < run.impact_count
    assert run.kept_from == pytest.approx(30 * system.drive_period, rel=1e-15)
    final = run.final_state
    assert final.state == tuple(run.stroboscopic[-1])
    assert (final.period, final.time_in_period, final.mode) == (50, 0.0, "flight")
    assert final.time == pytest.approx(50 * system.drive_period, rel=1e-15)


def test_default_keeps_everything(system, initial):
    run = vi.simulate(system, initial=initial, periods=12)
    assert run.stroboscopic.shape == (12, 4)
    assert len(run.impacts) == run.impact_count
    assert run.kept_from == 0.0


def test_keep_selects_the_tail_of_the_whole_run(system, initial):
    whole = vi.simulate(system, initial=initial, periods=50)
    for keep in (0, 1, 20, 50):
        tail = vi.simulate(system, initial=initial, periods=50, keep=keep)
        assert tail.final_state == whole.final_state
        assert tail.impact_count == whole.impact_count
        kept = whole.impacts["time"] > tail.kept_from
        assert tail.impacts.tobytes() == whole.impacts[kept].tobytes()
        assert tail.stroboscopic.tobytes() == whole.stroboscopic[50 - keep :].tobytes()


def test_impact_columns_agree_with_one_another(system, initial):
    impacts = vi.simulate(system, initial=initial, periods=200).impacts
    assert len(impacts) > 100
    period = system.drive_period
    start = impacts["period"] * period
    # time has lost an ulp per addition against period and time_in_period.
    np.testing.assert_allclose(impacts["time"], start + impacts["time_in_period"], rtol=1e-14)
    assert (impacts["time_in_period"] >= 0.0).all()
    assert (impacts["time_in_period"] < period).all()
    assert (np.diff(impacts["time"]) > 0.0).all()
    phase = impacts["phase"]
    assert ((phase >= 0.0) & (phase < 2.0 * math.pi)).all()
    np.testing.assert_allclose(
        phase, impacts["time_in_period"] * system.drive_frequency, rtol=1e-14, atol=1e-14
    )
    # On contact g = sin x1 - x2 - gap = 0; the bodies approach before and part after.
    np.testing.assert_allclose(
        np.sin(impacts["x1"]) - impacts["x2"], system.gap, rtol=0.0, atol=1e-15
    )
    approach = impacts["v1_pre"] * np.cos(impacts["x1"]) - impacts["v2_pre"]
    departure = impacts["v1_post"] * np.cos(impacts["x1"]) - impacts["v2_post"]
    assert (approach > 0.0).all()
    assert (departure < 0.0).all()
    # Body 2 receives mass_ratio times the impulse.
    np.testing.assert_allclose(
        impacts["v2_post"] - impacts["v2_pre"],
        system.mass_ratio * impacts["impulse_normal"],
        rtol=1e-12,
        atol=1e-15,
    )
    energy = 0.5 * impacts["v1_pre"] ** 2 + impacts["v2_pre"] ** 2 / (2 * system.mass_ratio)
    after = 0.5 * impacts["v1_post"] ** 2 + impacts["v2_post"] ** 2 / (2 * system.mass_ratio)
    np.testing.assert_allclose(energy - after, impacts["energy_loss"], rtol=1e-12, atol=1e-15)
    assert (impacts["energy_loss"] >= 0.0).all()
    assert {vi.Regime(regime) for regime in impacts["regime"]} > {vi.Regime.SLIP}


def test_events_point_to_their_rows(system, initial):
    run = vi.simulate(system, initial=initial, periods=40, keep=25)
    impact_events = run.events[run.events["kind"] == vi.EventKind.IMPACT]
    assert impact_events["index"].tolist() == list(range(len(run.impacts)))
    assert impact_events["time"].tolist() == run.impacts["time"].tolist()
    assert impact_events["period"].tolist() == run.impacts["period"].tolist()
    assert len(run.events[run.events["kind"] == vi.EventKind.GRAZE]) == len(run.grazes)


def test_section_phase_moves_the_section(system, initial):
    at_start = vi.simulate(system, initial=initial, periods=10)
    moved = vi.simulate(system, initial=initial, periods=10, section_phase=1.0)
    assert moved.impacts.tobytes() == at_start.impacts.tobytes()
    assert moved.final_state == at_start.final_state
    # The rows are states of the same motion, each at phase 1 of the drive.
    times = (1.0 + 2.0 * math.pi * np.arange(10)) / system.drive_frequency
    rows = at_start.trajectory(times)
    for row in moved.stroboscopic:
        assert np.abs(rows - row).max(axis=1).min() < 1e-12


def test_time_instead_of_periods(system, initial):
    time = 10 * system.drive_period
    by_time = vi.simulate(system, initial=initial, time=time)
    by_periods = vi.simulate(system, initial=initial, periods=10)
    assert by_time.impacts.tobytes() == by_periods.impacts.tobytes()
    np.testing.assert_allclose(by_time.final_state.state, by_periods.final_state.state, atol=1e-12)


def test_constant_load_has_no_section(system, initial):
    rotor = system.replace(drive_frequency=0.0, friction=0.0)
    run = vi.simulate(rotor, initial=initial, time=20.0)
    assert run.stroboscopic.shape == (0, 4)
    assert run.final_state.time == 20.0
    assert run.impact_count > 0


def test_many_initial_states_give_a_list(system):
    initials = np.array([[0.0, 0.5, 0.0, 0.0], [0.1, -0.2, 0.0, 0.3], [-0.3, 1.0, 0.2, 0.0]])
    runs = vi.simulate(system, initial=initials, periods=30, keep=10)
    assert isinstance(runs, list)
    for run, initial in zip(runs, initials, strict=True):
        alone = vi.simulate(system, initial=tuple(initial), periods=30, keep=10)
        assert run.initial == tuple(initial)
        assert run.impacts.tobytes() == alone.impacts.tobytes()
        assert run.stroboscopic.tobytes() == alone.stroboscopic.tobytes()
        assert run.final_state == alone.final_state


def test_no_initial_states_give_no_runs(system):
    assert vi.simulate(system, initial=np.empty((0, 4)), periods=3) == []


def test_workers_do_not_change_a_bit(system):
    rng = np.random.default_rng(20040601)
    initials = rng.uniform([-0.3, -1, -0.2, -1], [0.3, 1, 0.2, 1], size=(12, 4))
    one, two = (
        vi.simulate(system, initial=initials, periods=100, keep=50, workers=workers)
        for workers in (1, 2)
    )
    for left, right in zip(one, two, strict=True):
        assert left.impacts.tobytes() == right.impacts.tobytes()
        assert left.stroboscopic.tobytes() == right.stroboscopic.tobytes()


def test_event_cap_is_an_outcome(system, initial):
    run = vi.simulate(system, initial=initial, periods=50, max_events=7)
    assert run.stop_reason == "event_cap"
    assert run.impact_count <= 7
    assert run.stop_detail
    assert run.final_state.time < 50 * system.drive_period


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({}, "exactly one of periods= and time=, got neither"),
        ({"periods": 5, "time": 5.0}, "exactly one of periods= and time=, got both"),
        ({"periods": 0}, "periods = 0 is not allowed; allowed: an integer >= 1"),
        ({"periods": -1}, "periods = -1 is not allowed; allowed: an integer >= 1"),
        ({"periods": 5.5}, "periods = 5.5 is not allowed; allowed: an integer >= 1"),
        ({"periods": 10**30}, "an integer from 1 to 9007199254740992"),
        ({"periods": True}, "periods = True is not allowed; allowed: an integer >= 1"),
        ({"periods": "5"}, "periods = '5' is not allowed; allowed: an integer >= 1"),
        ({"time": 0.0}, "time = 0.0 is not allowed; allowed: a finite number > 0"),
        ({"time": math.nan}, "time = nan is not allowed; allowed: a finite number > 0"),
        ({"time": math.inf}, "time = inf is not allowed; allowed: a finite number > 0"),
        ({"keep": 6, "periods": 5}, "keep = 6 is not allowed; allowed: an integer from 0 to 5"),
        ({"keep": -1, "periods": 5}, "keep = -1 is not allowed; allowed: an integer from 0 to 5"),
        ({"keep": 1, "time": 5.0}, "keep = 1 is not allowed; allowed: None together with time="),
        ({"keep": 1.5, "periods": 5}, "keep = 1.5 is not allowed; allowed: an integer from 0 to 5"),
        ({"max_events": 0}, "max_events = 0 is not allowed; allowed: an integer >= 1"),
        ({"max_events": 0.5}, "max_events = 0.5 is not allowed; allowed: an integer >= 1"),
        (
            {"chatter_tolerance": 0.0},
            "chatter_tolerance = 0.0 is not allowed; allowed: a finite number > 0",
        ),
        (
            {"chatter_tolerance": "small"},
            "chatter_tolerance = 'small' is not allowed; allowed: a finite number > 0",
        ),
        (
            {"section_phase": math.nan},
            "section_phase = nan is not allowed; allowed: a finite number",
        ),
        ({"workers": 0}, "workers = 0 is not allowed; allowed: an integer from 1 to 1024"),
        ({"system": None}, "system = None is not allowed; allowed: a vibroimpact.System"),
    ],
    ids=str,
)
def test_bad_arguments_are_named_before_any_work(system, initial, arguments, message):
    call = {"system": system, "initial": initial} | arguments
    if arguments and not {"periods", "time"} & set(arguments):
        call["periods"] = FOREVER
    with pytest.raises(vi.ParameterError, match=re.escape(message)):
        vi.simulate(call.pop("system"), **call)


@pytest.mark.parametrize(
    ("arguments", "name"), [({"periods": 5}, "periods"), ({"time": 5.0, "keep": 2}, "keep")]
)
def test_a_constant_load_has_no_periods(system, initial, arguments, name):
    rotor = system.replace(drive_frequency=0.0)
    with pytest.raises(vi.ParameterError, match=rf"^{name} = .*drive_frequency = 0"):
        vi.simulate(rotor, initial=initial, **arguments)


@pytest.mark.parametrize(
    "initial",
    [
        None,
        0.5,
        (0.0, 0.5, 0.0),
        np.zeros((4, 1)),
        np.zeros((1, 1, 4)),
        [(0.0, 0.5, 0.0, 0.0), (0.0, 0.5)],
        ("0", "0.5", "0", "0"),
        (0.0, 0.5j, 0.0, 0.0),
        (True, False, False, False),
        (0.0, math.nan, 0.0, 0.0),
        [(0.0, 0.5, 0.0, 0.0), (0.0, math.inf, 0.0, 0.0)],
        (1.0, 0.0, 0.0, 0.0),  # inside: sin 1 - 0 - 0.5 > 0
        (0.0, 0.0, -0.5 - 1e-9, 0.0),  # inside by little: g = 1e-9
        [(0.0, 0.5, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0)],
    ],
    ids=str,
)
def test_bad_initial_states_are_state_errors_before_any_work(system, initial):
    with pytest.raises(vi.StateError, match="initial"):
        vi.simulate(system, initial=initial, periods=FOREVER)
    assert issubclass(vi.StateError, ValueError)


def test_a_failed_computation_keeps_what_was_done(system, initial):
    with pytest.raises(vi.SimulationError, match="not finite after t = 0, 0 impacts") as failed:
        vi.simulate(system, initial=(0.0, 1e300, 0.0, 0.0), periods=3)
    run = failed.value.result
    assert run.stop_reason == "failed"
    assert run.final_state.v1 == 1e300


def test_a_failed_run_does_not_take_the_others_with_it(system, initial):
    starts = np.array([initial, (0.0, 1e300, 0.0, 0.0), initial])
    with pytest.raises(vi.SimulationError, match="run 1: the motion is not finite") as failed:
        vi.simulate(system, initial=starts, periods=3)
    sound, broken, last = failed.value.result
    alone = vi.simulate(system, initial=initial, periods=3)
    assert broken.stop_reason == "failed"
    for run in (sound, last):
        assert run.impacts.tobytes() == alone.impacts.tobytes()


def test_a_time_beyond_all_doubles_is_refused(system, initial):
    with pytest.raises(vi.ParameterError, match=r"periods = 1 .*2\^53 units of time"):
        vi.simulate(system.replace(drive_frequency=1e-300), initial=initial, periods=1)


@pytest.mark.parametrize(
    ("length", "last"), [({"periods": 600}, "600/600"), ({"time": 50.0}, "100/100")]
)
def test_progress_of_one_run_is_shown_and_changes_no_bit(system, initial, capsys, length, last):
    plain = vi.simulate(system, initial=initial, **length)
    assert capsys.readouterr() == ("", "")
    shown = vi.simulate(system, initial=initial, progress=True, **length)
    out, err = capsys.readouterr()
    assert out == ""
    assert last in err.rsplit("\r", 1)[-1]
    assert_same_bits(shown, plain)


def test_progress_of_several_runs_counts_them(system, initial, capsys):
    starts = np.array([initial] * 7)
    plain = vi.simulate(system, initial=starts, periods=30)
    shown = vi.simulate(system, initial=starts, periods=30, progress=True)
    assert "7/7" in capsys.readouterr().err.rsplit("\r", 1)[-1]
    for one, other in zip(shown, plain, strict=True):
        assert_same_bits(one, other)


def test_ctrl_c_with_a_bar_hands_over_the_run_so_far(system, initial, capsys):
    def long() -> vi.Run:
        return vi.simulate(system, initial=initial, periods=60, progress=True)

    with ctrl_c_at(asks_of(long) // 2) as caught:
        long()
    run = caught.value.result
    assert 0 < run.final_state.period < 60
    whole = vi.simulate(system, initial=initial, periods=60)
    assert run.impacts.tobytes() == whole.impacts[: len(run.impacts)].tobytes()

"""Runs of structures from Python: tables, trajectory, forces, going on, many starts, refusals."""

import re

import numpy as np
import pytest

import vibroimpact as vi
from ctrl_c import ctrl_c_at
from struck import BEAM, MOVING, PRESSED, REST, RUNS, moving_run, pressed_run
from two_masses import structure

COLUMNS = {
    "impacts": """time period time_in_period stop q v_pre v_post approach_velocity phase regime
        impulse_normal impulse_tangential energy_loss""",
    "grazes": "time period time_in_period stop q v phase gap_acceleration",
    "contacts": """time period time_in_period kind stop closed q v phase normal_force
        tangential_force impacts_skipped time_jump error""",
    "events": "time period kind index stop",
}
WIDE = ("q", "v", "v_pre", "v_post")
# Rounding of coordinates and velocities of size 1 over some tens of units of time.
ROUNDING = 1e-12


def gaps(structure: vi.Structure, times, q) -> np.ndarray:
    """The gap functions at times, (k, stops), from their definition."""
    phase = structure.drive_frequency * np.asarray(times)
    columns = [
        q @ stop.normal - stop.gap - stop.amplitude * np.cos(phase + stop.phase)
        for stop in structure.stops
    ]
    return np.stack(columns, axis=-1)


@pytest.mark.parametrize("name", RUNS)
@pytest.mark.parametrize("table", COLUMNS)
def test_tables_have_their_columns_and_shapes(name, table):
    run = RUNS[name]()
    found = getattr(run, table)
    assert getattr(run, table) is found
    assert list(found.dtype.names) == COLUMNS[table].split()
    for column in found.dtype.names:
        shape = (run.system.coordinates,) if column in WIDE else ()
        shape = (len(run.system.stops),) if column == "closed" else shape
        assert found[column].shape == (len(found), *shape)
    with pytest.raises(ValueError, match="read-only"):
        found[...] = found
    rows = found.to_pandas()
    assert len(rows) == len(found)
    if table == "impacts":
        assert rows["v_post_0"].tolist() == found["v_post"][:, 0].tolist()
        assert {*rows["regime"]} <= {regime.name.lower() for regime in vi.Regime}


@pytest.mark.parametrize("name", RUNS)
def test_events_lead_to_the_rows_of_their_tables(name):
    run = RUNS[name]()
    assert (np.diff(run.events["time"]) >= 0.0).all()
    tables = {vi.EventKind.IMPACT: run.impacts, vi.EventKind.GRAZE: run.grazes}
    seen = {"impacts": 0, "grazes": 0, "contacts": 0}
    for event in run.events[:-1]:
        table = tables.get(event["kind"], run.contacts)
        row = table[event["index"]]
        assert (row["time"], row["stop"]) == (event["time"], event["stop"])
        if table is run.contacts:
            assert row["kind"] == event["kind"]
        seen[next(key for key in seen if getattr(run, key) is table)] += 1
    assert seen == {key: len(getattr(run, key)) for key in seen}
    last = run.events[-1]
    assert (last["kind"], last["index"], last["stop"]) == (vi.EventKind.STOP, -1, -1)


@pytest.mark.parametrize("name", RUNS)
def test_impacts_obey_their_law_and_momentum(name):
    run = RUNS[name]()
    for row in run.impacts:
        stop = run.system.stops[row["stop"]]
        gap = gaps(run.system, [row["time"]], row["q"][None])[0, row["stop"]]
        assert abs(gap) < ROUNDING
        change = row["v_post"] - row["v_pre"]
        phase = run.system.drive_frequency * row["time"] + stop.phase
        moving = -run.system.drive_frequency * stop.amplitude * np.sin(phase)
        before, after = (stop.normal @ row[side] - moving for side in ("v_pre", "v_post"))
        assert before == pytest.approx(row["approach_velocity"], abs=ROUNDING)
        assert after <= ROUNDING
        if row["regime"] == vi.Regime.FRICTIONLESS:
            assert after == pytest.approx(-stop.restitution * before, abs=ROUNDING)
        impulse = -stop.normal * row["impulse_normal"]
        if stop.tangent is not None:
            impulse = impulse + stop.tangent * row["impulse_tangential"]
            bound = stop.friction * row["impulse_normal"]
            assert abs(row["impulse_tangential"]) <= bound * (1 + 1e-12) + ROUNDING
        # dq' = M^-1 J with M^-1 = Phi Phi^T
        shapes = run.system.shapes
        np.testing.assert_allclose(change, shapes @ (shapes.T @ impulse), rtol=0, atol=ROUNDING)
        assert row["energy_loss"] >= -ROUNDING


@pytest.mark.parametrize("name", RUNS)
def test_the_trajectory_is_right_continuous_and_passes_through_sections(name):
    run = RUNS[name]()
    period = run.system.drive_period
    first = run.final_state.period - len(run.stroboscopic) + 1
    times = np.arange(first, run.final_state.period + 1) * period
    within = times <= run.final_state.time
    assert within.sum() > 5
    states = run.trajectory(times[within])
    assert states.shape == (within.sum(), 2, run.system.coordinates)
    np.testing.assert_allclose(states, run.stroboscopic[within], rtol=0, atol=1e-11)
    # A time is known to an ulp: the state after the impact is that just after it.
    rows = run.impacts[np.diff(run.impacts["time"], append=np.inf) > 1e-3]
    late = run.trajectory(np.minimum(rows["time"] + 1e-9, run.final_state.time))
    np.testing.assert_allclose(late[:, 0], rows["q"], rtol=0, atol=1e-7)
    np.testing.assert_allclose(late[:, 1], rows["v_post"], rtol=0, atol=1e-7)
    before = run.trajectory(rows["time"] - 1e-9)
    np.testing.assert_allclose(before[:, 1], rows["v_pre"], rtol=0, atol=1e-7)


@pytest.mark.parametrize("name", RUNS)
def test_no_stop_is_ever_crossed(name):
    run = RUNS[name]()
    times = np.linspace(run.kept_from, run.final_state.time, 20_000)
    states, forces = run.trajectory(times, forces=True)
    found = gaps(run.system, times, states[:, 0])
    assert found.max() < ROUNDING
    assert forces.shape == (len(times), len(run.system.stops), 2)
    pressed = forces[:, :, 0] > 0.0
    assert (forces[:, :, 0] >= 0.0).all()
    assert (forces[~pressed] == 0.0).all()
    # Where a force acts the stop is closed.
    assert np.abs(found[pressed]).max(initial=0.0) < ROUNDING
    assert pressed.any() == (run.time_in_contact > 0.0)
    share = pressed.any(axis=1).mean() * (run.final_state.time - run.kept_from)
    assert share == pytest.approx(run.time_in_contact, abs=0.05 * share)
    for number, stop in enumerate(run.system.stops):
        bound = stop.friction * forces[:, number, 0]
        assert (np.abs(forces[:, number, 1]) <= bound * (1 + 1e-9)).all()


def test_trajectory_takes_times_in_any_order_and_one_time():
    run = moving_run()
    times = np.linspace(run.kept_from, run.final_state.time, 300)
    shuffled = np.random.default_rng(1).permutation(times)
    whole = run.trajectory(times)
    assert run.trajectory(shuffled)[np.argsort(shuffled)].tobytes() == whole.tobytes()
    assert run.trajectory([]).shape == (0, 2, 1)
    state, forces = run.trajectory(times[7], forces=True)
    assert (state.shape, forces.shape) == ((2, 1), (2, 2))
    assert state.tobytes() == whole[7].tobytes()


def test_the_force_of_a_stop_carries_what_the_spring_does_not():
    # k q + p = c at q = gap.
    pressed = vi.Structure([[2]], [[3]], [vi.Stop([1], 0.5, 0.4)], static_load=[4])
    run = vi.simulate(pressed, initial=[[0], [0]], time=40)
    state, forces = run.trajectory(run.final_state.time, forces=True)
    assert state.tolist() == [[0.5], [0.0]]
    assert forces[0, 0] == pytest.approx(4 - 3 * 0.5, abs=1e-14)
    # A lever: a normal of 2 halves the force, and the stop closes at half the gap.
    lever = pressed.replace(stops=[vi.Stop([2], 0.5, 0.4)])
    run = vi.simulate(lever, initial=[[0], [0]], time=40)
    state, forces = run.trajectory(run.final_state.time, forces=True)
    assert state[0, 0] == 0.25
    assert forces[0, 0] == pytest.approx((4 - 3 * 0.25) / 2, abs=1e-14)


def test_forces_are_those_of_the_equations_of_motion():
    # M q'' + C q' + K q = c + F cos(w t) - n p + t Q, with q'' by central differences.
    run, h = pressed_run(), 1e-5
    system = run.system
    times = np.linspace(run.kept_from + 1.0, run.final_state.time - 1.0, 4000)
    events = np.concatenate([run.impacts["time"], run.contacts["time"]])
    clear = np.abs(times[:, None] - events).min(axis=1) > 2 * h
    times = times[clear]
    states, forces = run.trajectory(times, forces=True)
    late, early = (run.trajectory(times + side * h)[:, 1] for side in (1, -1))
    shapes = system.shapes
    mass = system.mass
    modal = np.diag(2 * np.array(system.damping_ratios) * system.frequencies)
    damping = mass @ shapes @ modal @ shapes.T @ mass
    left = (
        (late - early) / (2 * h) @ mass + states[:, 1] @ damping + states[:, 0] @ system.stiffness
    )
    drive = np.outer(np.cos(system.drive_frequency * times), system.drive_amplitude)
    normal, tangent = (getattr(system.stops[0], name) for name in ("normal", "tangent"))
    right = system.static_load + drive
    right = right - np.outer(forces[:, 0, 0], normal) + np.outer(forces[:, 0, 1], tangent)
    assert (forces[:, 0, 0] > 0.0).sum() > 1000
    np.testing.assert_allclose(left, right, rtol=0, atol=1e-7)


def test_a_time_outside_the_kept_window_is_named_with_the_window():
    run = moving_run()
    first, last = run.kept_from, run.final_state.time
    assert len(run.trajectory([first, last])) == 2
    for outside in (np.nextafter(first, 0.0), np.nextafter(last, np.inf), 0.0, -1e300):
        message = f"t[1] = {float(outside)!r} is not allowed; allowed: times in the kept window, "
        with pytest.raises(vi.ParameterError) as caught:
            run.trajectory([last, outside, first])
        assert str(caught.value) == f"{message}{first!r} to {last!r}"
    for times in ([np.nan], [[1.0]], ["now"]):
        with pytest.raises(vi.ParameterError, match=r"^t(\[0\])? "):
            run.trajectory(times)


def test_bounces_list_what_chatter_skipped():
    # A ball of unit weight on a table, r = 1/2: flights of 2 v, v halved by each bounce.
    ball = vi.Structure([[1]], [[0]], [vi.Stop([1], 0.0, 0.5)], static_load=[1])
    run = vi.simulate(ball, initial=[[-0.5], [0]], time=5)
    listed = run.bounces(down_to=1e-6)
    (chatter,) = run.contacts[run.contacts["kind"] == vi.EventKind.CHATTER]
    assert chatter["time"] == pytest.approx(3.0, abs=1e-13)
    count = int(np.ceil(np.log2(1e6)))
    assert len(listed.impacts) == count > len(run.impacts)
    assert listed.impacts["skipped"].sum() == count - len(run.impacts)
    np.testing.assert_allclose(
        listed.impacts["approach_velocity"], 0.5 ** np.arange(count), rtol=1e-8
    )
    assert len(run.bounces(most=3).impacts) == len(run.impacts) + 3
    assert listed.impacts.dtype.names == (*run.impacts.dtype.names, "skipped")


@pytest.mark.parametrize("name", ["moving", "pressed", "beam"])
def test_resume_is_one_long_run_bit_for_bit(name):
    made = {"moving": MOVING, "pressed": PRESSED, "beam": BEAM}[name]
    start = REST[made.coordinates]
    long = vi.simulate(made, initial=start, periods=25, keep=9)
    short = vi.simulate(made, initial=start, periods=12, keep=3)
    assert short.resume(periods=13, keep=9) == long
    steps = short
    for periods in (1, 3, 9):
        steps = steps.resume(periods=periods, keep=min(periods, 9))
    assert steps == long
    assert steps.initial.tobytes() == long.initial.tobytes()
    assert steps.final_state.q.tobytes() == long.final_state.q.tobytes()


def test_resume_amid_a_contact_and_amid_a_period():
    whole = vi.simulate(PRESSED, initial=REST[2], periods=10, keep=2)
    for time in (1.3, 2.1, 17.77):
        part = vi.simulate(PRESSED, initial=REST[2], time=time)
        periods = 10 - int(time // PRESSED.drive_period)
        assert part.resume(periods=periods, keep=2) == whole


def test_resume_checks_its_arguments():
    for arguments in ({}, {"periods": 1, "time": 1.0}, {"periods": -1}, {"periods": 2, "keep": 3}):
        with pytest.raises(vi.ParameterError):
            moving_run().resume(**arguments)


def test_the_final_state_starts_another_run():
    run = vi.simulate(MOVING, initial=REST[1], periods=4)
    again = vi.simulate(MOVING, initial=run.final_state.state, periods=1)
    np.testing.assert_allclose(
        again.final_state.state, run.resume(periods=1).final_state.state, rtol=0, atol=1e-10
    )
    assert run.final_state.closed.dtype == bool


def test_what_is_kept_and_counted():
    whole = vi.simulate(MOVING, initial=REST[1], periods=30)
    kept = moving_run()
    late = whole.impacts["period"] >= 20
    assert kept.impact_count == whole.impact_count == len(whole.impacts)
    assert kept.impacts.tobytes() == whole.impacts[late].tobytes()
    assert kept.stroboscopic.tobytes() == whole.stroboscopic[-10:].tobytes()
    assert kept.kept_from == pytest.approx(20 * MOVING.drive_period, abs=1e-12)
    assert whole.time_in_contact == pytest.approx(3 * kept.time_in_contact, rel=0.2)


def test_several_starts_are_the_runs_of_each_for_any_number_of_threads():
    starts = np.random.default_rng(3).uniform(-0.2, 0.2, (7, 2, 2))
    starts[:, 0] = np.minimum(starts[:, 0], 0.0)
    alone = [vi.simulate(PRESSED, initial=start, periods=6) for start in starts]
    assert len({run.impact_count for run in alone}) > 1
    for workers in (None, 1, 2):
        runs = vi.simulate(PRESSED, initial=starts, periods=6, workers=workers)
        assert runs == alone
        assert [run.initial.tobytes() for run in runs] == [start.tobytes() for start in starts]
    assert vi.simulate(PRESSED, initial=starts[:1], periods=6) == alone[:1]
    assert vi.simulate(PRESSED, initial=np.empty((0, 2, 2)), periods=6) == []


def test_a_progress_bar_changes_nothing(capsys):
    shown = vi.simulate(MOVING, initial=REST[1], periods=30, keep=10, progress=True)
    assert shown == moving_run()
    assert "run: 100%" in capsys.readouterr().err
    many = vi.simulate(MOVING, initial=[REST[1]] * 3, periods=2, progress=True)
    assert "3/3" in capsys.readouterr().err
    assert len(many) == 3


def test_section_phase_moves_the_sections_only():
    run = vi.simulate(MOVING, initial=REST[1], periods=30, keep=10, section_phase=1.0)
    plain = moving_run()
    assert run.impacts.tobytes() == plain.impacts.tobytes()
    times = run.kept_from + (np.arange(len(run.stroboscopic)) + 1 / (2 * np.pi)) * (
        MOVING.drive_period
    )
    np.testing.assert_allclose(run.stroboscopic, run.trajectory(times), rtol=0, atol=1e-11)


# Ends.


def test_simultaneous_contacts_end_the_run_or_are_resolved():
    # Three equal balls at rest, the first strikes two that touch.
    cradle = vi.Structure(
        np.eye(3),
        np.zeros((3, 3)),
        [vi.Stop([1, -1, 0], 0.5, 1.0), vi.Stop([0, 1, -1], 0.0, 1.0)],
    )
    start = [[0, 0, 0], [1, 0, 0]]
    run = vi.simulate(cradle, initial=start, time=2)
    assert run.stop_reason == "simultaneous"
    assert run.final_state.time == 0.5
    assert "0.5" in run.stop_detail
    runs = {
        rule: vi.simulate(cradle.replace(simultaneous=rule), initial=start, time=2)
        for rule in ("sequence", "together")
    }
    assert {run.stop_reason for run in runs.values()} == {"completed"}
    # One after another the last ball takes all; all at once nothing is handed through the middle.
    assert runs["sequence"].final_state.v == pytest.approx([0, 0, 1], abs=1e-15)
    assert runs["together"].final_state.v == pytest.approx([-1 / 3, 2 / 3, 2 / 3], abs=1e-15)


def test_a_cap_of_events_ends_the_run():
    run = vi.simulate(MOVING, initial=REST[1], periods=30, max_events=7)
    assert run.stop_reason == "event_cap"
    assert run.impact_count <= 7
    assert run.resume(periods=5, max_events=100).stop_reason in ("event_cap", "completed")


def test_a_notebook_shows_how_a_run_ended():
    text = moving_run()._repr_html_()
    for words in ("completed", "of which", "time in contact", "<img"):
        assert words in text


# Refusals.


@pytest.mark.parametrize(
    ("initial", "words"),
    [
        (
            (0, 0, 0, 0),
            "initial of shape (4,) is not allowed; allowed: rows q and v of shape (2, 2)",
        ),
        (np.zeros((2, 3)), "initial of shape (2, 3) is not allowed; allowed: rows q and v"),
        ([[0, 0], [0, np.nan]], "initial[1, 1] = nan is not allowed; allowed: finite numbers"),
        ([[0, 0.5], [0, 0]], "stops[0]"),
        ([[[0, 0], [0, 0]], [[0.5, 0], [0, 0]]], "stops[1]"),
    ],
)
def test_starts_are_refused_by_name(initial, words):
    with pytest.raises(vi.StateError, match=re.escape(words)):
        vi.simulate(structure(), initial=initial, periods=1)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({}, "give exactly one of periods= and time=, got neither"),
        ({"periods": 1, "time": 1.0}, "give exactly one of periods= and time=, got both"),
        ({"periods": 0}, "periods = 0 is not allowed"),
        ({"periods": 2, "keep": 3}, "keep = 3 is not allowed"),
        ({"periods": 2, "units": "SI"}, "units = 'SI' is not allowed; allowed: None: a structure"),
        ({"periods": 2, "max_events": 0}, "max_events = 0 is not allowed"),
        ({"periods": 2, "chatter_tolerance": 0.0}, "chatter_tolerance = 0.0 is not allowed"),
        ({"periods": 2, "section_phase": np.nan}, "section_phase = nan is not allowed"),
        ({"periods": 2, "workers": 0}, "workers = 0 is not allowed"),
    ],
)
def test_options_are_refused_by_name(options, words):
    with pytest.raises(vi.ParameterError, match=f"^{re.escape(words)}"):
        vi.simulate(structure(), initial=REST[2], **options)


def test_without_a_drive_there_are_no_periods():
    still = vi.Structure([[1]], [[1]], [vi.Stop([1], 0.5, 0.8)])
    with pytest.raises(vi.ParameterError, match=r"^periods = 3"):
        vi.simulate(still, initial=[[0], [1]], periods=3)
    run = vi.simulate(still, initial=[[0], [1]], time=3.0)
    assert run.stroboscopic.shape == (0, 2, 1)
    with pytest.raises(vi.ParameterError, match=r"^periods = 3"):
        vi.plot.time_history(run, periods=3)


def test_what_is_no_system_is_refused():
    with pytest.raises(vi.ParameterError, match=r"^system = 3 .* or a vibroimpact.Structure"):
        vi.simulate(3, initial=REST[2], periods=1)


# Ctrl-C.

# The motion is irregular: one that repeats itself to the bit is not simulated again and again.
IRREGULAR = structure(damping_ratios=None).replace(restitution=1.0, friction=0.0)
LONG = {"periods": 5_000_000, "keep": 1, "max_events": 10**9}


def test_an_interrupted_run_can_be_looked_at_and_resumed():
    with ctrl_c_at(20_000) as caught:
        vi.simulate(IRREGULAR, initial=REST[2], **LONG)
    run = caught.value.result
    assert isinstance(run, vi.StructureRun)
    assert run.stop_reason == "interrupted"
    assert 0 < run.final_state.period < LONG["periods"]
    onward = run.resume(periods=3, keep=3)
    assert onward.stop_reason == "completed"
    assert onward.final_state.time > run.final_state.time


def test_an_interrupted_resume():
    short = vi.simulate(IRREGULAR, initial=REST[2], periods=40)
    with ctrl_c_at(20_000) as caught:
        short.resume(**LONG)
    assert caught.value.result.final_state.period > 40


def test_interrupted_runs_come_as_a_list():
    with ctrl_c_at(20_000) as caught:
        vi.simulate(IRREGULAR, initial=[REST[2]] * 5, **LONG, workers=1)
    runs = caught.value.result
    assert 1 <= len(runs) <= 5
    assert {run.stop_reason for run in runs} == {"interrupted"}


def test_interrupted_rows_of_a_trajectory_are_the_first_ones():
    run = vi.simulate(IRREGULAR, initial=REST[2], periods=400)
    times = np.linspace(0.0, run.final_state.time, 200_000)
    with ctrl_c_at(3) as caught:
        run.trajectory(times)
    rows = caught.value.result
    assert 0 < len(rows) < len(times)
    assert rows.tobytes() == run.trajectory(times[: len(rows)]).tobytes()


# From modes.


def test_all_modes_are_the_structure_itself():
    whole = structure(stops=[vi.Stop([0, 1], 0.3, 0.8), vi.Stop([1, -1], 0.1, 0.5)])
    modal = vi.Structure.from_modes(
        whole.frequencies,
        whole.shapes,
        whole.stops,
        damping_ratios=whole.damping_ratios,
        drive_amplitude=whole.drive_amplitude,
        drive_frequency=whole.drive_frequency,
    )
    start = [[0.1, 0.05], [0.2, -0.1]]
    one, other = (vi.simulate(made, initial=start, periods=6) for made in (whole, modal))
    assert len(one.impacts) == len(other.impacts) > 5
    assert (one.impacts["stop"] == other.impacts["stop"]).all()
    for name in ("time", "q", "v_pre", "v_post", "impulse_normal", "energy_loss"):
        np.testing.assert_allclose(
            other.impacts[name], one.impacts[name], rtol=0, atol=1e-9, err_msg=name
        )
    times = np.linspace(0.0, one.final_state.time, 50)
    np.testing.assert_allclose(other.trajectory(times), one.trajectory(times), rtol=0, atol=1e-9)
    assert (other.initial == start).all()


def test_results_of_modes_are_physical():
    run = RUNS["beam"]()
    shapes = BEAM.shapes
    # At every instant the points are a combination of the modes.
    states = run.trajectory(np.linspace(0.0, run.final_state.time, 200))
    amplitudes = np.linalg.lstsq(shapes, states[:, 0].T, rcond=None)[0]
    np.testing.assert_allclose(shapes @ amplitudes, states[:, 0].T, rtol=0, atol=ROUNDING)
    assert (np.abs(run.impacts["q"][:, 2] - 0.3) < ROUNDING).all()
    assert len(run.impacts) > 5
    assert run.impacts["q"].shape[1] == run.stroboscopic.shape[2] == 3


def test_a_start_outside_the_modes_says_by_how_much():
    inside = BEAM.shapes @ [0.1, 0.05]
    run = vi.simulate(BEAM, initial=[inside, [0, 0, 0]], time=1.0)
    np.testing.assert_allclose(run.initial[0], inside, rtol=0, atol=0)
    np.testing.assert_allclose(run.trajectory(0.0)[0], inside, rtol=0, atol=1e-15)
    with pytest.raises(vi.StateError, match=r"initial.* of its size"):
        vi.simulate(BEAM, initial=[[0.1, 0, 0], [0, 0, 0]], time=1.0)

"""The explorer of a structure without a page: its state and address, what is computed, its code."""

import csv
import io

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from matplotlib import pyplot

import vibroimpact as vi
from explorer_structures import CHAIN, EVERY, PAIR, REST, ROUGH, SMALL, arguments
from vibroimpact.explorer import compute, tables
from vibroimpact.explorer.axis import Axis
from vibroimpact.explorer.code import python_code
from vibroimpact.explorer.server import first_state
from vibroimpact.explorer.state import State, from_query
from vibroimpact.explorer.structure_numbers import DAMPING, DRIVE
from vibroimpact.plot.stop_rows import places_of, rows_of


@pytest.fixture
def coarse(monkeypatch):
    """Make every map a small one."""
    monkeypatch.setattr(compute, "FINE", SMALL)
    monkeypatch.setattr(compute, "COARSE", SMALL)


# The state and its address


@pytest.mark.parametrize("name", EVERY)
def test_where_a_page_of_a_structure_begins(name):
    structure = EVERY[name]
    state = first_state(structure, None)
    assert state.system == structure
    assert state.initial == (0.0,) * (2 * structure.coordinates)
    assert from_query(arguments(state.to_query()), state) == state
    if structure.drive_frequency:
        assert state.vary.low < structure.drive_frequency < state.vary.high
    # A stop acts on the coordinate that is looked at.
    assert any(stop.normal[int(state.shown[1:])] for stop in structure.stops)


def test_a_start_of_a_structure_is_that_of_simulate():
    initial = [[0.1, -0.05], [0.3, 0.0]]
    state = first_state(PAIR, initial)
    assert state.initial == (0.1, -0.05, 0.3, 0.0)
    assert state.machine.begin(state.initial) == initial
    for wrong in ([0.1, 0.2, 0.3], [[0.1], [0.2]], [initial, initial], [[np.nan, 0], [0, 0]]):
        with pytest.raises((vi.StateError, vi.ParameterError), match="initial"):
            first_state(PAIR, wrong)
    with pytest.raises(vi.StateError, match="stop"):
        first_state(PAIR, [[0, 0.7], [0, 0]])


def test_differences_that_stops_limit_are_looked_at_too():
    """Whichever way the stop faces, and of any size; but no other row of two coordinates."""
    machine = first_state(PAIR, None).machine
    assert machine.shown == ("q0", "q1", "q0-q1")
    assert (machine.symbol("q0-q1"), machine.words("q0-q1")) == ("q₀ - q₁", "")
    assert machine.phase_names("q0-q1") == (("q₀ - q₁", "q̇₀ - q̇₁"),)
    several = PAIR.replace(
        stops=[
            vi.Stop([-3, 3], 0.4, 0.7),
            vi.Stop([1, -1], 0.2, 0.7),
            vi.Stop([1, 1], 0.5, 0.8),
            vi.Stop([1, -0.5], 0.5, 0.8),
        ]
    )
    assert first_state(several, None).machine.shown == ("q0", "q1", "q0-q1")
    assert first_state(CHAIN, None).machine.shown == tuple(f"q{i}" for i in range(6))


def test_a_difference_is_that_of_the_run_and_of_the_diagram(coarse):
    state = first_state(PAIR, None).replace(shown="q0-q1")
    motion = compute.motion(state)
    q, v = motion.states[:, 0], motion.states[:, 1]
    samples = state.machine.samples(motion)
    assert np.array_equal(samples["place"], q[:, 0] - q[:, 1])
    assert np.array_equal(samples["speed"], v[:, 0] - v[:, 1])
    # Stop 0 lies at 0.2.
    assert 0.19 < samples["place"].max() < 0.2 + 1e-12
    sections = motion.run.stroboscopic
    assert np.array_equal(state.machine.sections(motion.run, "q0-q1"), sections @ [1, -1])
    diagram = compute.diagram(state, compute.detail(state, compute.FINE))
    column = state.machine.points(diagram, "q", "q0-q1")[1]
    assert np.array_equal(column, diagram.impacts["q"] @ [1, -1])
    column = state.machine.points(diagram, "stroboscopic", "q0-q1")[1]
    assert np.array_equal(column, diagram.stroboscopic[:, 0] @ [1, -1])


NUMBER = st.floats(-1e3, 1e3)


@given(
    gap=NUMBER,
    factors=st.tuples(NUMBER, st.floats(0.0, 10.0)),
    frequency=st.floats(0.1, 10.0),
    restitution=st.floats(0.0, 1.0),
    start=st.tuples(NUMBER, NUMBER, NUMBER, NUMBER),
    origin=st.none() | st.tuples(NUMBER, NUMBER, NUMBER, NUMBER),
    drawn=st.sampled_from(["approach_velocity", "q", "phase", "stroboscopic"]),
)
def test_every_state_of_a_structure_comes_back_bit_for_bit(
    gap, factors, frequency, restitution, start, origin, drawn
):
    first = State.of(PAIR)
    state = first.replace(
        gap_1=gap,
        restitution_0=restitution,
        drive_frequency=frequency,
        initial=start,
        origin=origin,
        value=drawn,
        shown="q1",
        simultaneous="sequence",
        vary=Axis(name="gap", low=0.1, high=0.3),
        **{DRIVE: factors[0], DAMPING: factors[1]},
    )
    assert from_query(arguments(state.to_query()), first) == state
    made = PAIR.replace(
        gap_1=gap, restitution_0=restitution, drive_frequency=frequency, simultaneous="sequence"
    ).replace(
        drive_amplitude=factors[0] * PAIR.drive_amplitude,
        damping_ratios=factors[1] * PAIR.damping_ratios,
    )
    assert state.system == made


def test_factors_are_those_of_what_was_given():
    state = first_state(ROUGH, None)
    # Nothing is lost on the way through 0.
    for name in (DRIVE, DAMPING):
        assert state.replace(**{name: 0.0}).replace(**{name: 1.0}) == state
    assert state.replace(**{DAMPING: 3.0}).system.damping.tolist() == (3 * ROUGH.damping).tolist()
    with pytest.raises(vi.ParameterError, match=DAMPING):
        state.replace(**{DAMPING: -1.0})


@pytest.mark.parametrize(
    ("query", "named"),
    [
        ("gap_2=1", "gap_2"),
        ("restitution_0=2", "restitution"),
        ("friction_0=0.5", "friction_0"),
        ("q2=1", "q2"),
        ("shown=x1", "shown"),
        ("map=basins", "map"),
        ("vary=q0", "vary"),
        ("value=x1", "value"),
        ("simultaneous=never", "simultaneous"),
        ("origin_q0=0.1", "origin"),
        ("mass=1", "mass"),
        ("drive_factor=nan", "drive_factor"),
        ("mass_ratio=0.5", "mass_ratio"),
    ],
)
def test_an_address_that_is_no_state_of_the_structure_is_refused(query, named):
    with pytest.raises((vi.ParameterError, vi.StateError), match=named):
        from_query(arguments(query), first_state(PAIR, None))


@pytest.mark.parametrize("name", EVERY)
def test_every_number_of_a_structure_has_a_name_a_range_and_a_value(name):
    machine = first_state(EVERY[name], None).machine
    numbers = machine.numbers()
    grouped = [one for names in machine.groups.values() for one in names]
    assert {*grouped} <= {*numbers}
    assert {*machine.choices} <= {*grouped}
    assert {*machine.parameters} == {*numbers} - {*machine.choices}
    for one in (*machine.parameters, *machine.coordinates):
        low, high = machine.span(one)
        assert low < high
        assert machine.name_of(one)
        value = numbers.get(one, 0.0)
        assert np.isnan(value) or low <= value <= high, one
    # A number of all stops that differ is none; as soon as it is given, it is theirs.
    if name == "chain":
        assert np.isnan(numbers["gap"])
        assert machine.replace(gap=0.4).numbers()["gap"] == 0.4
        assert len(grouped) < 10


# What is computed


@pytest.mark.parametrize("name", EVERY)
def test_the_motion_of_a_structure_is_that_of_simulate(name):
    state = first_state(EVERY[name], None)
    shown = compute.motion(state)
    machine = state.machine
    run = vi.simulate(
        state.system,
        initial=REST[name],
        max_events=compute.MOST_EVENTS,
        **compute.run_options(machine),
    )
    assert np.array_equal(shown.run.impacts, run.impacts)
    states, forces = run.trajectory(shown.time, forces=True)
    assert np.array_equal(shown.states, states)
    assert np.array_equal(shown.forces, forces)
    verdict = compute.verdict(state, shown.run)
    assert verdict.label == run.label
    if name == "free":
        assert np.isnan(verdict.exponent)
        assert verdict.periodic is None
    if verdict.periodic is not None:
        assert np.array_equal(verdict.periodic.multipliers, run.refine().multipliers)
        assert verdict.stability == run.refine().stability
    # Block and wall are apart by the gap: never below zero, and zero where a stop is closed.
    drawn = rows_of(state.system)
    assert sorted(stop for row in drawn for stop in row.stops) == [*range(len(state.system.stops))]
    for row in drawn:
        found = places_of(state.system, row, shown.time, shown.states[:, 0])
        for j, (stop, factor) in enumerate(zip(found.row.stops, found.row.factors, strict=True)):
            far = (found.walls[:, j] - found.block) * (found.high - found.low) * factor
            assert far.min() >= 0.0
            assert far[forces[:, stop, 0] > 0.0].max(initial=0.0) < 1e-12
    for row in run.impacts[run.impacts["time"] >= shown.time[0]]:
        stop = state.system.stops[row["stop"]]
        phase = state.system.drive_frequency * row["time"] + stop.phase
        gap = stop.normal @ row["q"] - stop.gap - stop.amplitude * np.cos(phase)
        assert abs(gap) < 1e-12


def test_the_exponent_of_a_structure_is_that_of_its_spectrum():
    state = first_state(PAIR, None)
    verdict = compute.verdict(state, compute.motion(state).run)
    spectrum = vi.lyapunov_spectrum(PAIR, initial=REST["pair"], periods=600, most=1)
    assert verdict.exponent == spectrum.largest
    assert verdict.error == spectrum.error[0]


@pytest.mark.parametrize("name", ["drive_frequency", "gap", "gap_1", DRIVE, DAMPING])
def test_the_diagram_of_a_structure_is_that_of_the_public_function(name, coarse):
    state = first_state(PAIR, None).replace(vary=Axis(name=name, low=0.3, high=0.9))
    detail = compute.detail(state, compute.FINE)
    diagram = compute.diagram(state, detail)
    values = np.linspace(0.3, 0.9, 7)
    made = {
        DRIVE: lambda value: PAIR.replace(drive_amplitude=value * PAIR.drive_amplitude),
        DAMPING: lambda value: PAIR.replace(damping_ratios=value * PAIR.damping_ratios),
    }.get(name, lambda value: PAIR.replace(**{name: value}))
    for place, value in enumerate(values.tolist()):
        run = vi.simulate(made(value), initial=REST["pair"], periods=60, keep=10)
        drawn = state.machine.points(diagram, "q", "q1")
        here = drawn[0] == value
        assert np.array_equal(drawn[1][here], run.impacts["q"][:, 1])
        assert np.array_equal(drawn[2][here], run.impacts["stop"])
        at, section, kind = state.machine.points(diagram, "stroboscopic", "q1")
        assert kind is None
        assert np.array_equal(section[at == value], run.stroboscopic[:, 0, 1])
        assert diagram.values[place] == value


@pytest.mark.parametrize(
    "names", [("drive_frequency", "gap_0"), (DRIVE, "gap"), (DRIVE, DAMPING)], ids="-".join
)
def test_the_chart_of_a_structure_has_the_labels_of_its_runs(names):
    across, upward = (Axis(name=name, low=0.3, high=0.9) for name in names)
    state = first_state(PAIR, None).replace(map="chart", across=across, upward=upward)
    chart = compute.chart_of(state, compute.Detail(columns=3, rows=2, periods=60, keep=20))
    assert [*chart.axes] == [*names]
    for i, x in enumerate(np.linspace(0.3, 0.9, 3).tolist()):
        for j, y in enumerate((0.3, 0.9)):
            made = state.replace(**{names[0]: x, names[1]: y}).system
            run = vi.simulate(made, initial=REST["pair"], periods=60, keep=20)
            assert chart.label[i, j] == run.label


def test_a_table_of_a_structure_holds_the_numbers_bit_for_bit(coarse):
    state = first_state(PAIR, None)
    impacts = compute.motion(state).run.impacts
    rows = [*csv.DictReader(io.StringIO(tables.of_run(compute.motion(state).run)))]
    assert [float(row["v_post1"]) for row in rows] == impacts["v_post"][:, 1].tolist()
    assert [int(row["stop"]) for row in rows] == impacts["stop"].tolist()
    assert rows[0]["regime"] == "frictionless"
    diagram = compute.diagram(state, SMALL["diagram"])
    rows = [*csv.DictReader(io.StringIO(tables.of_map(diagram, state.machine)))]
    assert [float(row["drive_frequency"]) for row in rows] == diagram.impact_parameter.tolist()
    assert [float(row["q0"]) for row in rows] == diagram.impacts["q"][:, 0].tolist()


@pytest.mark.parametrize(
    ("name", "changes"),
    [
        ("pair", {"value": "q", "shown": "q1"}),
        ("pair", {"value": "q", "shown": "q0-q1"}),
        ("pair", {"value": "stroboscopic", "shown": "q0-q1"}),
        ("pair", {"vary": Axis(name=DRIVE, low=0.5, high=1.5), DRIVE: 0.8}),
        ("rough", {"vary": Axis(name=DAMPING, low=0.5, high=1.5), "value": "phase"}),
        ("free", {}),
        ("pair", {"map": "chart"}),
        ("chain", {"value": "stroboscopic", "gap": 0.4}),
        ("beam", {"start": "forward"}),
    ],
)
def test_the_code_of_a_structure_gives_the_numbers_of_the_page(
    name, changes, coarse, tmp_path, monkeypatch, capsys
):
    monkeypatch.chdir(tmp_path)
    state = first_state(EVERY[name], None).replace(**changes)
    made = {}
    exec(compile(python_code(state), name, "exec"), made)
    assert made["structure"] == state.system
    motion = compute.motion(state)
    assert np.array_equal(made["run"].impacts, motion.run.impacts)
    label, *said = capsys.readouterr().out.splitlines()
    assert label == motion.run.label
    if name == "free":
        assert said == ["written: motion.pdf"]
    elif state.map == "chart":
        chart = compute.chart_of(state, compute.detail(state, compute.FINE))
        assert np.array_equal(made["chart"].label, chart.label)
    else:
        diagram = compute.diagram(state, compute.detail(state, compute.FINE))
        assert np.array_equal(made["diagram"].impacts, diagram.impacts)
        verdict = compute.verdict(state, motion.run)
        numbers = f"{verdict.exponent:.6g} +- {verdict.error:.1g}"
        assert said[0] == f"largest exponent {numbers} per unit of time"
        assert said[-1] == "written: motion.pdf, diagram.pdf"
    pyplot.close("all")


def test_impacts_at_a_single_stop_have_the_colour_of_their_regime():
    single = ROUGH.replace(stops=ROUGH.stops[:1])
    motion = compute.motion(first_state(single, None))
    regimes = motion.run.impacts["regime"]
    # That of stop 0 would be 0.
    assert regimes.min() > 0
    assert np.array_equal(motion.machine.kinds(motion.run.impacts), regimes)
    words = {motion.machine.kind_words(regime) for regime in regimes}
    assert all("stop" not in each for each in words)

"""The explorer without a browser: states and addresses, what is computed, its code."""

import csv
import io
import itertools
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from matplotlib import pyplot

import vibroimpact as vi
from han_jin_hu_2004.parameters import INITIAL, MOTIONS, TRANSITIONS
from systems import ROUGH
from vibroimpact._core import PARAMETERS
from vibroimpact.explorer import compute, tables
from vibroimpact.explorer.axis import Axis
from vibroimpact.explorer.code import python_code
from vibroimpact.explorer.of_system import RANGES, SYMBOLS, OfSystem
from vibroimpact.explorer.presets import DEFAULT, PRESETS
from vibroimpact.explorer.server import first_state
from vibroimpact.explorer.state import State, from_query
from vibroimpact.explorer.theme import PALETTES
from vibroimpact.explorer.views.parts import with_error
from vibroimpact.explorer.views.verdict import evidence_text

SMALL = compute.Detail(columns=9, rows=5, periods=60, keep=20)


def arguments(query: str) -> dict[str, list[bytes]]:
    """What a web server makes of a query."""
    found: dict[str, list[bytes]] = {}
    for part in query.split("&"):
        name, _, value = part.partition("=")
        found.setdefault(name, []).append(value.encode())
    return found


# The state and its address


@pytest.mark.parametrize("name", PRESETS)
def test_a_preset_comes_back_from_its_address(name):
    state = PRESETS[name]
    assert from_query(arguments(state.to_query()), DEFAULT) == state


@pytest.mark.parametrize("name", [name for name in PRESETS if name[-1].isdigit() and ":" in name])
def test_a_preset_shows_the_motion_of_its_name(name):
    assert compute.motion(PRESETS[name]).run.label == name.partition(": ")[2]


FINITE = st.floats(allow_nan=False, allow_infinity=False)


@given(
    gap=st.floats(-0.9, 5.0),
    friction=st.floats(0.0, 1e300),
    x1=FINITE,
    low=st.floats(-1e300, 0.0),
    high=st.floats(1e-300, 1e300),
    names=st.permutations([*PARAMETERS]),
    branch=st.booleans(),
    origin=st.none() | st.tuples(FINITE, FINITE, FINITE, FINITE),
    drawn=st.sampled_from([*itertools.product(OfSystem.maps, OfSystem.values)]),
)
def test_every_state_comes_back_bit_for_bit(
    gap, friction, x1, low, high, names, branch, origin, drawn
):
    axes = [Axis(name=name, low=low, high=high) for name in names[:3]]
    state = DEFAULT.replace(
        gap=gap, friction=friction, x1=x1, branch=branch, map=drawn[0], value=drawn[1]
    ).replace(vary=axes[0], across=axes[1], upward=axes[2], origin=origin)
    query = state.to_query()
    assert set(query) <= set("abcdefghijklmnopqrstuvwxyz_0123456789=&.-")
    assert from_query(arguments(query), PRESETS["Bouncing ball"]) == state


@pytest.mark.parametrize(
    ("query", "named"),
    [
        ("gap=foo", "gap"),
        ("gap=nan", "gap"),
        ("gap=inf", "gap"),
        ("gap=1_0", "gap"),
        ("gap=0x1", "gap"),
        ("gap=" + "1" * 41, "gap"),
        ("gap=", "gap"),
        ("gap=1&gap=2", "gap"),
        ("restitution=2", "restitution"),
        ("drive_frequency=-1", "drive_frequency"),
        ("friction=__import__('os')", "friction"),
        ("law=stronge", "law"),
        ("contact=%00", "contact"),
        ("map=diagram;", "map"),
        ("vary=x1", "vary"),
        ("right=gap", "right"),
        ("vary_low=9", "drive_frequency"),
        ("across=friction&upward=friction", "upward"),
        ("right=v1", "up"),
        ("origin_x1=0.1", "origin"),
        ("theme=../../etc", "theme"),
        ("branch=True", "branch"),
        ("system=1", "system"),
        ("<script>=1", "script"),
        ("contact=direct", "friction"),
    ],
)
def test_an_address_that_is_no_state_is_refused(query, named):
    with pytest.raises((vi.ParameterError, vi.StateError), match=named):
        from_query(arguments(query), DEFAULT)


def test_a_state_refuses_names_that_it_does_not_know():
    with pytest.raises(vi.ParameterError, match="did you mean friction"):
        DEFAULT.replace(frictoin=1.0)
    with pytest.raises(vi.ParameterError, match="first end"):
        Axis(name="gap", low=1.0, high=1.0)
    with pytest.raises(vi.ParameterError, match="map"):
        State.of(DEFAULT.system, initial=INITIAL, map="orbit")


def test_the_presets_of_the_paper_are_its_figures():
    shown = [state.system for name, state in PRESETS.items() if "Paper" in name]
    fixed = [system.replace(drive_frequency=1.0) for system in shown]
    for transition in TRANSITIONS:
        assert transition.system.replace(drive_frequency=1.0) in fixed, transition.id
    for motion in MOTIONS:
        if motion.id in ("5a", "5b", "5c", "6a", "6b", "6c", "9(1)", "9(2)", "9(3)"):
            assert motion.system in shown, motion.id
    # From the paper's start it is another motion than the one that the paper names.
    other = {"Paper, Fig. 9(3): 4-5"}
    assert all(
        (state.initial == INITIAL) != (name in other)
        for name, state in PRESETS.items()
        if "Paper" in name
    )


def test_every_parameter_has_one_control_with_its_symbol_and_range():
    grouped = [name for names in OfSystem(DEFAULT.system).groups.values() for name in names]
    assert sorted(grouped) == sorted([*PARAMETERS, *OfSystem.choices])
    assert {*RANGES} == {*PARAMETERS}
    assert {*SYMBOLS} >= {*PARAMETERS}
    # Loads may have either sign.
    for name in ("static_moment", "static_force"):
        low, high = RANGES[name]
        assert low == -high < 0.0


def test_where_a_page_begins():
    first = first_state(None, None)
    assert first in PRESETS.values()
    # Its basins are of two motions.
    basins = compute.basins_of(first.replace(map="basins"), compute.Detail(20, 16, 600, 100))
    assert {found.label for found in basins.attractors} == {"4-5", "6-7"}
    state = first_state(ROUGH, (0.0, 0.1, 0.0, 0.0))
    assert (state.system, state.initial) == (ROUGH, (0.0, 0.1, 0.0, 0.0))
    assert state.vary.low < ROUGH.drive_frequency < state.vary.high
    wall = PRESETS["Impact oscillator (a wall)"].system
    assert first_state(wall, None).value == "approach_velocity"
    with pytest.raises(vi.StateError, match="initial"):
        first_state(ROUGH, (1.5, 0.0, 0.0, 0.0))
    with pytest.raises(vi.ParameterError, match="system"):
        first_state("paper", None)


@pytest.mark.parametrize(
    ("options", "named"),
    [({"port": -1}, "port"), ({"browser": "yes"}, "browser"), ({"notebook_url": 8888}, "notebook")],
)
def test_explore_refuses_bad_arguments_before_it_serves(options, named):
    with pytest.raises(vi.ParameterError, match=named):
        vi.explore(ROUGH, **options)


# What is computed


@pytest.mark.parametrize("name", PRESETS)
def test_the_motion_is_that_of_simulate(name):
    state = PRESETS[name]
    shown = compute.motion(state)
    run = vi.simulate(
        state.system,
        initial=state.initial,
        max_events=compute.MOST_EVENTS,
        **compute.run_options(state.machine),
    )
    assert np.array_equal(shown.run.impacts, run.impacts)
    assert np.array_equal(shown.states, run.trajectory(shown.time))
    verdict = compute.verdict(state, shown.run)
    assert verdict.label == run.label
    if verdict.periodic is not None:
        assert np.array_equal(verdict.periodic.multipliers, run.refine().multipliers)
        assert verdict.exponent == pytest.approx(
            np.log(abs(verdict.periodic.multipliers[0]))
            / (verdict.periodic.m * state.system.drive_period),
            rel=1e-6,
        )


def test_the_maps_are_those_of_the_public_functions():
    state = DEFAULT
    diagram = compute.diagram(state, SMALL)
    same = vi.bifurcation_diagram(
        state.system,
        initial=state.initial,
        periods=60,
        keep=20,
        drive_frequency=np.linspace(1.4, 2.0, 9),
    )
    assert np.array_equal(diagram.x1, same.x1)
    assert np.array_equal(diagram.impact_parameter, same.impact_parameter)
    chart = compute.chart_of(state, SMALL)
    assert [*chart.axes] == ["drive_frequency", "moment_amplitude"]
    assert chart.label.shape == (9, 5)
    run = vi.simulate(
        state.system.replace(drive_frequency=1.4, moment_amplitude=2.0),
        initial=state.initial,
        periods=60,
        keep=20,
    )
    assert chart.label[0, -1] == run.label
    damped = PRESETS["Two oscillators head on"].replace(map="basins")
    basins = compute.basins_of(damped, SMALL)
    assert [*basins.axes] == ["x1", "v1"]
    assert basins.label.shape == (9, 5)


def test_a_table_holds_the_numbers_bit_for_bit():
    motion = compute.motion(DEFAULT)
    rows = [*csv.DictReader(io.StringIO(tables.of_run(motion.run)))]
    impacts = motion.run.impacts
    assert [float(row["x1"]) for row in rows] == impacts["x1"].tolist()
    assert rows[0]["regime"] == vi.Regime(int(impacts["regime"][0])).name.lower()
    diagram = compute.diagram(DEFAULT, SMALL)
    rows = [*csv.DictReader(io.StringIO(tables.of_map(diagram, DEFAULT.machine)))]
    assert [float(row["drive_frequency"]) for row in rows] == diagram.impact_parameter.tolist()
    assert [float(row["x1"]) for row in rows] == diagram.x1.tolist()
    chart = compute.chart_of(DEFAULT, SMALL)
    rows = [*csv.DictReader(io.StringIO(tables.of_map(chart, DEFAULT.machine)))]
    assert [row["label"] for row in rows] == chart.label.ravel().tolist()


@pytest.fixture
def coarse(monkeypatch):
    """Make every fine map a small one."""
    monkeypatch.setattr(compute, "FINE", dict.fromkeys(compute.FINE, SMALL))


@pytest.fixture
def drawn(tmp_path, monkeypatch):
    """Draw into a folder of the test, and close what was drawn."""
    monkeypatch.chdir(tmp_path)
    yield tmp_path
    pyplot.close("all")


@pytest.mark.parametrize("name", PRESETS)
def test_the_code_runs_and_gives_the_numbers_of_the_page(name, coarse, drawn):
    # The maps of the paper's figures differ in their numbers alone.
    for shown in OfSystem.maps if "Paper" not in name or "9(2)" in name else ("diagram",):
        state = PRESETS[name].replace(map=shown)
        driven = state.system.drive_frequency > 0.0
        made: dict[str, object] = {}
        exec(compile(python_code(state), shown, "exec"), made)
        assert made["system"] == state.system
        # The pictures are those of the page: four views of a motion, three without a drive.
        assert len(made["axes"].flat) == (4 if driven else 3)
        texts = [text.get_text() for text in made["axes"].flat[2].figure.findobj(pyplot.Text)]
        assert "approach velocity $u$" in texts
        assert np.array_equal(made["run"].impacts, compute.motion(state).run.impacts)
        if not driven:
            assert "diagram" not in made
        elif shown == "diagram":
            assert np.array_equal(made["diagram"].x1, compute.diagram(state, SMALL).x1)
            colors = {tuple(color) for color in made["ax"].collections[0].get_facecolors()}
            assert len(colors) == max(len(set(made["diagram"].regime.tolist())), 1)
        elif shown == "chart":
            assert np.array_equal(made["chart"].label, compute.chart_of(state, SMALL).label)
        else:
            basins = compute.basins_of(state, SMALL)
            assert np.array_equal(made["basins"].attractor, basins.attractor)


@pytest.mark.parametrize("name", ["Paper, Fig. 5(b): 1-1", "Paper, Fig. 9(2): chaos"])
def test_the_code_prints_what_the_page_says(name, coarse, drawn, capsys):
    state = PRESETS[name]
    made: dict[str, object] = {}
    exec(compile(python_code(state), "printed", "exec"), made)
    verdict = compute.verdict(state, compute.motion(state).run)
    label, exponent, *multipliers, files = capsys.readouterr().out.splitlines()
    assert label == verdict.label
    numbers = f"{verdict.exponent:.6g} +- {verdict.error:.1g}"
    assert exponent == f"largest exponent {numbers} per unit of time 1/omega_2"
    if verdict.periodic is None:
        assert multipliers == []
    else:
        texts = ", ".join(f"{one:.4g}" for one in verdict.periodic.multipliers)
        assert multipliers == [f"multipliers {texts}", "stable"]
    assert files == "written: motion.pdf, diagram.pdf"
    assert {each.name for each in drawn.iterdir()} == {"motion.pdf", "diagram.pdf"}
    history = made["axes"].flat[0]
    history.figure.canvas.draw()
    assert history.get_xlabel() == "time in drive periods"
    shown = {text.get_text() for text in history.get_xticklabels()}
    assert {"592", "594", "596", "598", "600"} <= shown


def test_the_code_of_a_branch_gives_that_branch(coarse, drawn):
    state = PRESETS["Paper, Fig. 5(b): 1-1"].replace(
        branch=True, vary=Axis(name="drive_frequency", low=1.7, high=1.85)
    )
    made: dict[str, object] = {}
    exec(compile(python_code(state), "branch", "exec"), made)
    verdict = compute.verdict(state, compute.motion(state).run)
    branch = compute.branch(state, verdict.periodic)
    for piece, same in zip(branch.pieces, made["branch"].pieces, strict=True):
        assert np.array_equal(piece.nodes, same.nodes)


@pytest.mark.parametrize(
    ("value", "error", "text"),
    [
        (0.0262256, 0.008, "0.026 ± 0.008"),
        (0.0262256, 0.0096, "0.03 ± 0.01"),
        (-0.0120808, 0.0, "-0.0120808"),
        (-0.037806491731275, 1e-15, "-0.0378065"),
        (12.3456, 1.7, "12 ± 2"),
        (2.5e-9, 3e-11, "(2.50 ± 0.03)e-9"),
        (1234.0, 56.0, "(1.23 ± 0.06)e3"),
        (1e-12, 3e-8, "(0 ± 3)e-8"),
        (-0.002501107, 7e-9, "-0.00250111"),
        (-0.002501107, 2e-8, "-0.00250111 ± 0.00000002"),
        (0.0, 0.0, "0"),
        (0.5, math.nan, "0.5"),
    ],
)
def test_a_number_has_the_digits_that_its_error_leaves(value, error, text):
    assert with_error(value, error) == text


def test_the_evidence_has_one_sign_for_an_error():
    run = compute.motion(DEFAULT).run
    evidence = run.period.evidence
    text = evidence_text(evidence)
    assert with_error(evidence.growth, evidence.growth_error) in text
    assert text.replace(" ", "") not in str(evidence)
    slow = compute.motion(PRESETS["Paper, Fig. 5(b): 1-1"]).run.period.evidence
    rate = f"the distance between sections shrinks by the factor {slow.rate:.4g} per drive period"
    assert evidence_text(slow) == rate
    returned = compute.motion(PRESETS["Paper, Fig. 6(b): 2-4"]).run.period.evidence
    assert evidence_text(returned) == str(returned)


@pytest.mark.parametrize("palette", PALETTES.values(), ids=PALETTES)
def test_a_colour_of_a_regime_means_nothing_else(palette):
    regimes = {*palette.kinds(stops=False)}
    assert len(regimes) == len(vi.Regime)
    assert regimes.isdisjoint((palette.first, palette.second, palette.mark, palette.error))
    assert len({palette.first, palette.second, palette.mark}) == 3

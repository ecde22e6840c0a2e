"""Bifurcation diagrams: ragged layout, the three ways to start, errors and files."""

import itertools
import math

import numpy as np
import pytest

import vibroimpact as vi

# A length no run could reach: an error that comes late would not come at all.
FOREVER = 10**12
ARRAYS = (
    "parameter",
    "offset",
    "x1",
    "v1",
    "v2",
    "phase",
    "regime",
    "stroboscopic_offset",
    "stroboscopic",
    "status",
    "m",
    "n",
    "residual",
    "contact_fraction",
    "final_states",
)


def assert_same_bits(left: vi.Diagram, right: vi.Diagram) -> None:
    assert left.parameter_name == right.parameter_name
    for name in ARRAYS:
        a, b = getattr(left, name), getattr(right, name)
        assert (a.dtype, a.shape) == (b.dtype, b.shape), name
        assert a.tobytes() == b.tobytes(), name


@pytest.fixture
def frequencies() -> np.ndarray:
    return np.linspace(1.2, 2.0, 9)


@pytest.fixture
def diagram(system, initial, frequencies) -> vi.Diagram:
    return vi.bifurcation_diagram(
        system, initial=initial, periods=60, keep=20, drive_frequency=frequencies
    )


def test_each_point_is_the_run_at_its_value(diagram, system, initial, frequencies):
    assert len(diagram) == 9
    assert diagram.parameter_name == "drive_frequency"
    assert diagram.parameter.tolist() == frequencies.tolist()
    assert diagram.offset[0] == diagram.stroboscopic_offset[0] == 0
    assert diagram.offset[-1] == len(diagram.x1) > 0
    assert diagram.stroboscopic_offset[-1] == len(diagram.stroboscopic)
    for i, frequency in enumerate(frequencies):
        run = vi.simulate(
            system.replace(drive_frequency=frequency), initial=initial, periods=60, keep=20
        )
        rows = slice(diagram.offset[i], diagram.offset[i + 1])
        assert diagram.x1[rows].tolist() == run.impacts["x1"].tolist()
        assert diagram.v1[rows].tolist() == run.impacts["v1_pre"].tolist()
        assert diagram.v2[rows].tolist() == run.impacts["v2_pre"].tolist()
        assert diagram.phase[rows].tolist() == run.impacts["phase"].tolist()
        assert diagram.regime[rows].tolist() == run.impacts["regime"].tolist()
        rows = slice(diagram.stroboscopic_offset[i], diagram.stroboscopic_offset[i + 1])
        assert diagram.stroboscopic[rows].tobytes() == run.stroboscopic.tobytes()
        assert diagram.status[i] == run.stop_reason
        assert tuple(diagram.final_states[i]) == run.final_state.state
        assert diagram.m[i] == (run.period.m or 0)


def test_scatter_abscissae(diagram):
    assert diagram.impact_parameter.shape == diagram.x1.shape
    assert diagram.stroboscopic_parameter.shape == diagram.stroboscopic.shape[:1]
    for i, value in enumerate(diagram.parameter):
        assert (diagram.impact_parameter[diagram.offset[i] : diagram.offset[i + 1]] == value).all()
        rows = slice(diagram.stroboscopic_offset[i], diagram.stroboscopic_offset[i + 1])
        assert (diagram.stroboscopic_parameter[rows] == value).all()


def test_settings_are_recorded(diagram, system, initial):
    assert diagram.system == system
    assert diagram.settings == vi.DiagramSettings(
        periods=60,
        keep=20,
        initial=(initial,),
        start=("fresh",),
        labels=True,
        exponents=False,
        max_events=None,
        chatter_tolerance=1e-12,
        section_phase=0.0,
    )


def test_arrays_are_read_only(diagram):
    for name in ARRAYS:
        with pytest.raises(ValueError, match="read-only"):
            getattr(diagram, name)[...] = getattr(diagram, name)
    with pytest.raises(AttributeError):
        diagram.x1 = None


@pytest.mark.parametrize("start", ["fresh", "forward", "backward"])
def test_workers_do_not_change_a_bit(system, initial, frequencies, start):
    one, two = (
        vi.bifurcation_diagram(
            system,
            initial=initial,
            periods=60,
            keep=20,
            start=start,
            workers=workers,
            drive_frequency=frequencies,
        )
        for workers in (1, 2)
    )
    assert_same_bits(one, two)


def _followed(system, initial, name, values, periods):
    """Follow the last state by hand; the drive starts anew at each value."""
    state, states = initial, []
    for value in values:
        run = vi.simulate(system.replace(**{name: value}), initial=state, periods=periods)
        state = run.final_state.state
        states.append(state)
    return states


@pytest.mark.parametrize(("start", "step"), [("forward", 1), ("backward", -1)])
def test_a_followed_branch_hands_its_last_state_on(system, initial, frequencies, start, step):
    diagram = vi.bifurcation_diagram(
        system, initial=initial, periods=60, keep=20, start=start, drive_frequency=frequencies
    )
    assert (diagram.status == "completed").all()
    assert diagram.parameter.tolist() == frequencies.tolist()
    by_hand = _followed(system, initial, "drive_frequency", frequencies[::step], 60)[::step]
    assert [tuple(row) for row in diagram.final_states] == by_hand


def test_backward_is_forward_over_the_reversed_values(system, initial, frequencies):
    options = {"initial": initial, "periods": 60, "keep": 20}
    backward = vi.bifurcation_diagram(
        system, **options, start="backward", drive_frequency=frequencies
    )
    forward = vi.bifurcation_diagram(
        system, **options, start="forward", drive_frequency=frequencies[::-1]
    )
    assert backward.final_states.tobytes() == forward.final_states[::-1].tobytes()
    assert np.diff(backward.offset).tolist() == np.diff(forward.offset)[::-1].tolist()
    for i in range(9):
        rows = slice(backward.offset[i], backward.offset[i + 1])
        mirrored = slice(forward.offset[8 - i], forward.offset[9 - i])
        assert backward.x1[rows].tobytes() == forward.x1[mirrored].tobytes()


def test_a_followed_state_that_does_not_fit_restarts(system):
    initial = (0.0, 0.5, 0.4, 0.0)
    options = {"initial": initial, "periods": 25}
    x1, _, x2, _ = vi.simulate(system, **options).final_state.state
    assert math.sin(x1) - x2 > 0.1  # free at gap 0.5, inside the other body at gap 0.1
    diagram = vi.bifurcation_diagram(system, **options, keep=5, start="forward", gap=[0.5, 0.1])
    fresh = vi.simulate(system.replace(gap=0.1), **options)
    assert diagram.status.tolist() == ["completed", "restarted"]
    assert tuple(diagram.final_states[1]) == fresh.final_state.state


@pytest.mark.parametrize(
    ("name", "values"),
    [
        ("mass_ratio", [0.0, 0.3]),
        ("frequency_ratio", [1.0, 2.0]),
        ("restitution", [0.5, 0.9]),
        ("gap", [0.1, 0.5]),
        ("drive_frequency", [1.0, 2.0]),
        ("pendulum_damping", [0.0, 0.1]),
        ("oscillator_damping", [0.0, 1.5]),
        ("moment_amplitude", [-1.0, 1.0]),
        ("force_amplitude", [0.0, 0.4]),
        ("static_moment", [-0.4, 0.3]),
        ("static_force", [-0.1, 0.2]),
        ("friction", [0.0, 0.3]),
        ("phase", [0.0, 4.0]),
    ],
)
def test_any_numeric_parameter_can_be_swept(system, initial, name, values):
    diagram = vi.bifurcation_diagram(system, initial=initial, periods=20, keep=20, **{name: values})
    for value, final in zip(values, diagram.final_states, strict=True):
        run = vi.simulate(system.replace(**{name: value}), initial=initial, periods=20)
        assert tuple(final) == run.final_state.state


def test_stop_reasons_become_the_status(system, initial):
    diagram = vi.bifurcation_diagram(
        system, initial=initial, periods=60, keep=20, max_events=5, drive_frequency=[1.4, 1.6]
    )
    assert diagram.status.tolist() == ["event_cap", "event_cap"]
    assert diagram.m.tolist() == [0, 0]


def test_progress_counts_every_point(system, initial, frequencies, capsys):
    quiet = vi.bifurcation_diagram(
        system, initial=initial, periods=20, keep=5, drive_frequency=frequencies
    )
    assert capsys.readouterr().err == ""
    shown = vi.bifurcation_diagram(
        system, initial=initial, periods=20, keep=5, progress=True, drive_frequency=frequencies
    )
    text = capsys.readouterr().err
    assert "drive_frequency" in text
    assert "9/9" in text
    assert_same_bits(shown, quiet)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({}, "got nothing"),
        ({"gap": [0.5], "friction": [0.1]}, "got gap, friction"),
        ({"colour": [0.5]}, "unknown argument colour of bifurcation_diagram"),
        ({"contact": ["direct"]}, "unknown argument contact"),
        ({"damping": [0.1]}, r"damping of bifurcation_diagram, did you mean pendulum_damping or o"),
        ({"gap": 0.5}, "gap = 0.5 is not allowed; allowed: one dimension"),
        ({"gap": [[0.5]]}, "gap of shape"),
        ({"gap": ["0.5"]}, r"gap\[0\] = '0\.5' is not allowed; allowed: a real number, not text"),
        ({"gap": [0.5j]}, r"gap\[0\] = 0\.5j is not"),
        ({"gap": [True]}, r"gap\[0\] = True is not"),
        ({"gap": [[0.5], [0.5, 0.6]]}, "gap = "),
        ({"gap": [0.5, math.nan]}, r"gap\[1\] = nan"),
        ({"friction": [0.5, math.inf]}, r"friction\[1\] = inf"),
        ({"friction": [0.5, -0.1]}, "friction.* = -0.1 .*>= 0"),
        ({"restitution": [0.5, 1.5]}, r"restitution.* = 1.5 .*\[0, 1\]"),
        ({"drive_frequency": [1.5, 0.0]}, "drive_frequency.* = 0"),
        ({"drive_frequency": [1.5, -1.0]}, "drive_frequency.* = -1"),
        ({"gap": [0.5], "periods": 0}, "periods = 0"),
        ({"gap": [0.5], "periods": None}, "periods = None"),
        ({"gap": [0.5], "keep": "all"}, "keep = 'all'"),
        ({"gap": [0.5], "periods": 50, "keep": 51}, "keep = 51 .* from 0 to 50"),
        ({"gap": [0.5], "start": "sideways"}, "start = 'sideways'"),
        ({"gap": [0.5], "chatter_tolerance": -1.0}, "chatter_tolerance = -1.0"),
        ({"gap": [0.5], "section_phase": None}, "section_phase = None"),
        ({"gap": [0.5], "max_events": 0}, "max_events = 0"),
        ({"gap": [0.5], "workers": 0}, "workers = 0"),
    ],
    ids=str,
)
def test_bad_arguments_are_named_before_any_run(system, initial, arguments, message):
    with pytest.raises(vi.ParameterError, match=message):
        vi.bifurcation_diagram(system, initial=initial, **{"periods": FOREVER} | arguments)


def test_by_default_a_short_run_keeps_all_its_periods(system, initial):
    for periods, keep in ((50, 50), (101, 100)):
        diagram = vi.bifurcation_diagram(system, initial=initial, periods=periods, gap=[0.5])
        assert (diagram.settings.periods, diagram.settings.keep) == (periods, keep)
        assert len(diagram.stroboscopic) == keep


def test_other_early_errors(system, initial):
    with pytest.raises(vi.ParameterError, match="system = 3"):
        vi.bifurcation_diagram(3, initial=initial, gap=[0.5])
    with pytest.raises(vi.ParameterError, match="drive_frequency"):
        vi.bifurcation_diagram(system.replace(drive_frequency=0.0), initial=initial, gap=[0.5])
    with pytest.raises(vi.ParameterError, match="friction"):
        vi.bifurcation_diagram(
            system.replace(friction=0.0, contact="direct"),
            initial=initial,
            periods=FOREVER,
            friction=[0.0, 0.1],
        )
    with pytest.raises(TypeError, match="initial"):
        vi.bifurcation_diagram(system, gap=[0.5])


@pytest.mark.parametrize("start", ["fresh", "forward"])
def test_an_initial_state_that_does_not_fit_a_value_is_a_status_of_its_point(
    system, initial, start
):
    # x2 = 0 and sin x1 = 0: the bodies overlap by so much.
    for gap in (-1e-9, -0.1):
        with pytest.warns(UserWarning, match="1 of 2 cells, the first at gap = -"):
            found = vi.bifurcation_diagram(
                system, initial=initial, periods=20, start=start, gap=[gap, 0.5]
            )
        assert found.status.tolist() == ["overlap", "completed"]
    for bad in ((0.0, 0.5, 0.0), [(0.0, 0.5, 0.0)], (0.0, math.nan, 0.0, 0.0)):
        with pytest.raises(vi.StateError):
            vi.bifurcation_diagram(system, initial=bad, periods=FOREVER, gap=[0.5])


@pytest.mark.parametrize("reader", [vi.load, vi.Diagram.load])
def test_files_bring_a_diagram_back_bit_for_bit(diagram, tmp_path, reader):
    path = tmp_path / "diagram.npz"
    diagram.save(path)
    back = reader(path)
    assert type(back) is vi.Diagram
    assert_same_bits(back, diagram)
    assert back.system == diagram.system
    assert back.settings == diagram.settings
    with pytest.raises(ValueError, match="read-only"):
        back.x1[0] = 0.0
    with pytest.raises(ValueError, match="holds a diagram, not a run"):
        vi.Run.load(path)


def test_repr_says_what_it_is(diagram):
    text = repr(diagram)
    assert "9 values of drive_frequency in [1.2, 2]" in text
    assert f"{len(diagram.x1)} impacts" in text


def test_several_starts_are_branches(system, initial, frequencies):
    starts = [initial, (0.1, 0.3, 0.0, 0.0)]
    both = vi.bifurcation_diagram(
        system,
        initial=starts,
        start=("fresh", "backward"),
        periods=60,
        keep=20,
        drive_frequency=frequencies,
    )
    assert len(both) == 4 * len(frequencies)
    assert both.settings.start == ("fresh", "fresh", "backward", "backward")
    assert both.settings.initial == (*map(tuple, starts), *map(tuple, starts))
    for branch, (one, start) in enumerate(
        zip(both.settings.initial, both.settings.start, strict=True)
    ):
        single = vi.bifurcation_diagram(
            system, initial=one, start=start, periods=60, keep=20, drive_frequency=frequencies
        )
        points = np.flatnonzero(both.branch == branch)
        assert both.parameter[points].tolist() == list(frequencies)
        assert both.label[points].tolist() == single.label.tolist()
        assert both.final_states[points].tobytes() == single.final_states.tobytes()
        rows = slice(both.offset[points[0]], both.offset[points[-1] + 1])
        assert both.x1[rows].tobytes() == single.x1.tobytes()


def test_points_have_what_an_impact_takes(diagram):
    v1, v2, x1 = diagram.v1, diagram.v2, diagram.x1
    np.testing.assert_allclose(diagram.approach_velocity, v1 * np.cos(x1) - v2, rtol=1e-13)
    assert (diagram.approach_velocity > 0.0).all()
    assert (diagram.energy_loss > 0.0).all()


def test_exponents_come_with_the_labels(system, initial):
    both = vi.bifurcation_diagram(
        system, initial=initial, periods=200, exponents=True, drive_frequency=[1.545, 1.8]
    )
    assert both.label.tolist() == ["chaotic", "1-1"]
    # Without damping 320 periods do not know an exponent well, and their error says so
    # (docs/labels.md).
    chaotic = system.replace(drive_frequency=1.545)
    longer = vi.lyapunov_spectrum(chaotic, initial=initial, periods=20_000).exponents[0]
    assert abs(both.largest_exponent[0] - longer) < 2.0 * both.exponent_error[0]
    assert 0.0 < both.exponent_error[0] < longer
    assert both.largest_exponent[1] < 0.0
    assert both.exponent_error[1] < 1e-6
    plain = vi.bifurcation_diagram(
        system, initial=initial, periods=200, labels=False, drive_frequency=[1.545, 1.8]
    )
    # Without labels what does not return has no name.
    assert plain.label.tolist() == ["unresolved", "1-1"]
    assert plain.x1.tobytes() == both.x1.tobytes()


@pytest.mark.parametrize("stored", [False, True])
def test_refinement_halves_the_steps_across_which_a_label_changes(
    system, initial, tmp_path, stored
):
    arguments = {"initial": initial, "periods": 150, "keep": 60}
    coarse = np.linspace(1.5, 2.3, 9)
    plain = vi.bifurcation_diagram(system, drive_frequency=coarse, **arguments)
    store = tmp_path / "refined.zarr" if stored else None
    refined = vi.bifurcation_diagram(
        system, drive_frequency=coarse, refine=2, store=store, **arguments
    )
    expected, labels = [*coarse], dict(zip(coarse, plain.label, strict=True))
    for _ in range(2):
        new = [0.5 * (a + b) for a, b in itertools.pairwise(expected) if labels[a] != labels[b]]
        for value in new:
            run = vi.simulate(system.replace(drive_frequency=value), **arguments)
            labels[value] = run.label
        expected = sorted([*expected, *new])
    assert len(expected) > len(coarse)
    assert refined.values.tolist() == expected
    assert refined.label.tolist() == [labels[value] for value in expected]
    # Rows belong to their points.
    whole = vi.bifurcation_diagram(system, drive_frequency=expected, **arguments)
    for name in ("x1", "regime", "stroboscopic", "final_states", "offset"):
        assert getattr(refined, name).tobytes() == getattr(whole, name).tobytes(), name
    if stored:
        again = vi.bifurcation_diagram(
            system, drive_frequency=coarse, refine=2, store=store, **arguments
        )
        assert_same_bits(again, refined)


def test_a_followed_branch_is_not_refined(system, initial):
    with pytest.raises(vi.ParameterError, match="refine"):
        vi.bifurcation_diagram(
            system, initial=initial, start="forward", refine=1, drive_frequency=[1.5, 1.6]
        )
    for start in ((), "sideways", ("fresh", "sideways"), None, 1, ("fresh", None)):
        with pytest.raises(vi.ParameterError, match="start"):
            vi.bifurcation_diagram(system, initial=initial, start=start, drive_frequency=[1.5])
    with pytest.raises(vi.ParameterError, match="initial"):
        vi.bifurcation_diagram(system, initial=np.empty((0, 4)), drive_frequency=[1.5])


def test_the_store_of_a_refined_diagram_is_a_folder_of_its_own(system, initial, tmp_path):
    arguments = {"initial": initial, "periods": 100, "refine": 1, "drive_frequency": [1.5, 1.9]}
    store = tmp_path / "refined"
    diagram = vi.bifurcation_diagram(system, store=store, **arguments)
    loaded = vi.load(store)
    assert type(loaded) is vi.Diagram
    assert_same_bits(loaded, diagram)
    plain = tmp_path / "plain.zarr"
    vi.bifurcation_diagram(system, initial=initial, periods=100, drive_frequency=[1.5], store=plain)
    (tmp_path / "foreign").mkdir()
    (tmp_path / "foreign" / "thesis.tex").touch()
    (tmp_path / "file").touch()
    for other in (plain, tmp_path / "foreign", tmp_path / "file", tmp_path / "no" / "folder"):
        with pytest.raises(vi.ParameterError, match="a new directory in one that exists"):
            vi.bifurcation_diagram(system, store=other, **arguments)
    with pytest.raises(vi.ParameterError, match="store = 1"):
        vi.bifurcation_diagram(system, store=1, **arguments)
    with pytest.raises(vi.ParameterError, match="chunk"):
        vi.bifurcation_diagram(system, store=tmp_path / "new", chunk=0, **arguments)
    assert not (tmp_path / "new").exists()

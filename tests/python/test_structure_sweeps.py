"""Sweeps and charts of structures: each cell is the single run, whoever computes it and when."""

import numpy as np
import pytest

import vibroimpact as vi
from ctrl_c import asks_of, ctrl_c_at
from struck import BEAM, MOVING, PRESSED, REST, SETTLING
from two_masses import structure

MASSES = structure()
PERIODS = 40
STOPS = {"gap_0": [0.3, 0.35], "restitution_1": [0.4, 0.5]}


# Two masses that meet each other and a wall; the motion is chaotic.
LIVELY = vi.Structure(
    [[1, 0], [0, 2]],
    [[2, -1], [-1, 1]],
    [vi.Stop([1, -1], 0.2, 0.7), vi.Stop([0, 1], 0.5, 0.8)],
    damping_ratios=[0.01, 0.02],
    drive_amplitude=[1, 1j],
    drive_frequency=1.28,
)


def state(run):
    """The state at the end of a run."""
    return np.array([run.final_state.q, run.final_state.v])


def same(one, other):
    """Check that two results have the same bits."""
    assert one.columns.names == other.columns.names
    for name in one.columns.names:
        assert one.columns[name].tobytes() == other.columns[name].tobytes(), name


def check(result, *cell, **single):
    """Check a cell against the single run of the same numbers."""
    run = vi.simulate(**single)
    assert np.array_equal(result.final_states[cell], state(run))
    assert result.status[cell] == run.stop_reason
    assert result.label[cell] == run.label
    window = run.final_state.time - run.kept_from
    assert result.contact_fraction[cell] == run.time_in_contact / window
    again = result.run(*cell)
    assert again.impacts.tobytes() == run.impacts.tobytes()
    assert np.array_equal(again.initial, run.initial)
    assert again.system == run.system == result.system_at(*cell)


@pytest.mark.parametrize("varied", [MASSES, MOVING, PRESSED], ids=["masses", "moving", "pressed"])
def test_cells_over_numbers_of_the_machine_are_the_single_runs(varied):
    rest = REST[varied.coordinates]
    axes = {"drive_frequency": [0.9, 1.3], "phase": [0.0, 0.4], **STOPS}
    swept = vi.sweep(varied, initial=rest, periods=PERIODS, keep=20, **axes)
    assert swept.final_states.shape == (2, 2, 2, 2, 2, varied.coordinates)
    assert swept.complete
    for cell in np.ndindex(2, 2, 2, 2):
        values = {name: axes[name][k] for name, k in zip(axes, cell, strict=True)}
        system = varied.replace(**values)
        check(swept, *cell, system=system, initial=rest, periods=PERIODS, keep=20)


def test_friction_that_begins_or_ends_is_that_of_another_structure():
    axes = {"friction": [0.0, 0.3]}
    rubbed = MASSES.replace(stops=[MASSES.stops[1]])
    for varied in (rubbed, rubbed.replace(friction=0.0)):
        swept = vi.sweep(varied, initial=REST[2], periods=PERIODS, **axes)
        for i, friction in enumerate(axes["friction"]):
            system = rubbed.replace(friction=friction)
            check(swept, i, system=system, initial=REST[2], periods=PERIODS, keep=40)
    assert not np.array_equal(swept.final_states[0], swept.final_states[1])


def test_the_number_of_one_stop_goes_before_that_of_all():
    for names in (("gap", "gap_0"), ("gap_0", "gap")):
        axes = {name: [{"gap": 0.4, "gap_0": 0.25}[name]] for name in names}
        swept = vi.sweep(MASSES, initial=REST[2], periods=PERIODS, **axes)
        system = MASSES.replace(gap_0=0.25, gap_1=0.4)
        assert swept.system_at(0) == system
        run = vi.simulate(system, initial=REST[2], periods=PERIODS)
        assert np.array_equal(swept.final_states[0, 0], state(run))


def test_axes_of_the_start_take_the_place_of_its_coordinates():
    initial = [[0.01, 0.02], [0.03, 0.04]]
    swept = vi.sweep(MASSES, initial=initial, periods=PERIODS, v_1=[0.1, 0.2], q_0=[-0.1, 0.05])
    for i, v_1 in enumerate([0.1, 0.2]):
        for j, q_0 in enumerate([-0.1, 0.05]):
            start = [[q_0, 0.02], [0.03, v_1]]
            check(swept, i, j, system=MASSES, initial=start, periods=PERIODS, keep=40)


def test_a_start_beyond_a_stop_is_a_status():
    swept = vi.sweep(MASSES, initial=REST[2], periods=PERIODS, q_1=[0.1, 0.5])
    assert swept.status.tolist() == ["completed", "overlap"]
    assert np.isnan(swept.final_states[1]).all()
    with pytest.raises(vi.StateError, match="penetrating"):
        swept.run(1)


def made(mass, gap, v_0=0.0):
    """A structure of two numbers, one of which its start has, too."""
    return structure(mass=[[mass + v_0, 0.5], [0.5, 1.0]]).replace(gap_0=gap)


def test_functions_make_structures_and_starts():
    def start(mass, gap):
        return [[0.0, gap / 2], [mass / 10, 0.0]]

    axes = {"mass": [1.5, 2.0], "gap": [0.2, 0.3]}
    swept = vi.chart(made, initial=start, periods=PERIODS, **axes)
    assert swept.is_made
    for cell in np.ndindex(2, 2):
        mass, gap = axes["mass"][cell[0]], axes["gap"][cell[1]]
        check(
            swept, *cell, system=made(mass, gap), initial=start(mass, gap), periods=PERIODS, keep=40
        )


def test_a_number_of_the_function_with_the_name_of_a_coordinate_leaves_the_start_alone():
    swept = vi.sweep(
        made, initial=REST[2], periods=PERIODS, mass=[2.0], gap=[0.3], v_0=[0.0, 0.1], v_1=[0.2]
    )
    start = [[0, 0], [0, 0.2]]
    for i, v_0 in enumerate([0.0, 0.1]):
        system = made(2.0, 0.3, v_0)
        check(swept, 0, 0, i, 0, system=system, initial=start, periods=PERIODS, keep=40)


def test_structures_from_modes_have_physical_starts_and_ends():
    span = BEAM.shapes @ np.array([0.05, 0.02])
    swept = vi.sweep(BEAM, initial=[span, [0, 0, 0]], periods=PERIODS, drive_frequency=[1.2, 1.3])
    assert swept.final_states.shape == (2, 2, 3)
    for i, frequency in enumerate([1.2, 1.3]):
        system = BEAM.replace(drive_frequency=frequency)
        check(swept, i, system=system, initial=[span, [0, 0, 0]], periods=PERIODS, keep=40)
    with pytest.raises(vi.StateError, match=r"over q_0: .*span"):
        vi.sweep(BEAM, initial=REST[3], periods=PERIODS, q_0=[0.0, 0.1])

    def other(scale):
        shapes = scale * BEAM.shapes
        return BEAM.replace(shapes=shapes)

    by_function = vi.sweep(other, initial=REST[3], periods=PERIODS, scale=[1.0, 0.5])
    for i, scale in enumerate([1.0, 0.5]):
        run = vi.simulate(other(scale), initial=REST[3], periods=PERIODS)
        assert np.array_equal(by_function.final_states[i], state(run))


@pytest.fixture(scope="module")
def chart():
    """A chart over numbers of the machine, with exponents."""
    return charted()


def charted(**options):
    frequencies = [1.9, 2.0, 2.6]
    return vi.chart(
        SETTLING,
        initial=REST[1],
        periods=120,
        drive_frequency=frequencies,
        gap_0=[0.3, 0.4],
        **options,
    )


@pytest.mark.parametrize("options", [{"workers": 1}, {"workers": 2, "chunk": 1}, {"chunk": 4}])
def test_the_bits_depend_on_neither_threads_nor_chunks(chart, options):
    same(chart, charted(**options))


def test_exponents_are_those_of_multipliers_or_measured(chart):
    assert chart.label[1, 0] == "1-1"
    run = vi.simulate(SETTLING.replace(gap=0.3), initial=REST[1], periods=400)
    largest = np.log(abs(run.refine().multipliers[0])) / run.system.drive_period
    assert chart.largest_exponent[1, 0] == pytest.approx(largest, abs=1e-9)
    assert np.isfinite(chart.largest_exponent).all()
    assert (chart.exponent_error >= 0).all()
    chaotic = vi.sweep(LIVELY, initial=REST[2], periods=100, exponents=True, phase=[0.0])
    assert chaotic.label[0] == "chaotic"
    spectrum = vi.lyapunov_spectrum(LIVELY, initial=REST[2], periods=2100, keep=2000, most=1)
    error = chaotic.exponent_error[0] + spectrum.error[0]
    assert abs(chaotic.largest_exponent[0] - spectrum.exponents[0]) < 4 * error
    assert chaotic.largest_exponent[0] > 4 * chaotic.exponent_error[0]


def test_without_labels_nothing_is_measured():
    plain = vi.sweep(MASSES, initial=REST[2], periods=100, labels=False, drive_frequency=[1.2])
    assert plain.label.tolist() == ["unresolved"]
    with pytest.raises(AttributeError, match="exponents=True"):
        _ = plain.largest_exponent


def test_a_cap_is_a_status():
    capped = vi.sweep(SETTLING, initial=REST[1], periods=100, gap=[0.3], max_events=5)
    assert capped.status.tolist() == ["event_cap"]
    assert capped.run(0).stop_reason == "event_cap"


@pytest.mark.parametrize("options", [{}, {"chunk": 2}])
def test_a_store_is_resumed_and_compared(tmp_path, chart, options):
    path = tmp_path / "s"
    asks = asks_of(lambda: charted(workers=1, chunk=1))
    with ctrl_c_at(asks // 2) as caught:
        charted(workers=1, chunk=1, store=path)
    part = caught.value.result
    assert 0 < part.columns.done < len(part)
    same(chart, charted(store=path, **options))
    loaded = vi.load(path)
    same(chart, loaded)
    assert loaded.system == SETTLING
    with pytest.raises(vi.ParameterError, match=r"system.damping_ratios is \[0.05\] there, \[0.06"):
        vi.chart(
            SETTLING.replace(damping_ratios=[0.06]),
            initial=REST[1],
            periods=120,
            drive_frequency=[1.9, 2.0, 2.6],
            gap_0=[0.3, 0.4],
            store=path,
        )


def test_a_store_compares_what_functions_made(tmp_path):
    axes = {"mass": [1.5, 2.0], "gap": [0.2, 0.3]}
    asked = {"initial": REST[2], "periods": 20, "store": tmp_path / "s", **axes}
    stored = vi.chart(made, **asked, chunk=1)
    memory = vi.chart(made, **{**asked, "store": None})
    same(stored, memory)
    assert vi.load(tmp_path / "s").system_at(1, 1) == made(2.0, 0.3)
    same(memory, vi.chart(made, **asked))
    with pytest.raises(
        vi.ParameterError, match=r"mass = 1.5, gap = 0.3 stops\[1\].gap is 0.1 there, 0.2 here"
    ):
        vi.chart(
            lambda mass, gap: made(mass, gap).replace(gap_1=0.1 if gap < 0.25 else 0.2), **asked
        )


def test_results_are_saved_and_loaded(tmp_path, chart):
    chart.save(tmp_path / "c.npz")
    again = vi.load(tmp_path / "c.npz")
    assert isinstance(again, vi.Chart)
    same(chart, again)
    assert again.run(1, 0).impacts.tobytes() == chart.run(1, 0).impacts.tobytes()


def test_data_sets_and_frames_name_coordinates(chart):
    data = chart.to_xarray()
    assert data.final_state.dims == ("drive_frequency", "gap_0", "part", "coordinate")
    assert data.final_state.sel(part="v", coordinate=0).shape == (3, 2)
    frame = chart.to_pandas()
    assert frame["final_state_v_0"].tolist() == chart.final_states[:, :, 1, 0].ravel().tolist()


def test_ctrl_c_keeps_the_cells_that_are_done(chart):
    asks = asks_of(lambda: charted(workers=1))
    with ctrl_c_at(asks // 2) as caught:
        charted(workers=1)
    part = caught.value.result
    done = part.status != "pending"
    assert 0 < done.sum() < done.size
    assert np.array_equal(part.final_states[done], chart.final_states[done])
    assert np.isnan(part.final_states[~done]).all()


@pytest.mark.parametrize(
    ("asked", "error", "words"),
    [
        ({"gap_1": [0.1]}, vi.ParameterError, "unknown argument gap_1 of sweep.*drive_frequency"),
        ({"q_1": [0.1]}, vi.ParameterError, "unknown argument q_1 .*q_0"),
        ({"x1": [0.1]}, vi.ParameterError, "unknown argument x1"),
        ({"restitution": [0.5, 1.5]}, vi.ParameterError, r"stops\[0\].restitution = 1.5"),
        ({"friction_0": [0.5]}, vi.ParameterError, r"stops\[0\].tangent = None"),
        ({"gap": [float("nan")]}, vi.ParameterError, r"gap\[0\] = nan"),
        ({"gap": []}, vi.ParameterError, "gap = .*at least one number"),
        ({"drive_frequency": [0.0, 1.0]}, vi.ParameterError, "drive_frequency = 0.0 .*> 0"),
        ({"q_0": [float("inf")]}, vi.ParameterError, r"q_0\[0\] = inf"),
        ({"gap": [0.1], "units": "SI"}, vi.ParameterError, "units = 'SI' .*no scales"),
        ({"gap": [0.1], "initial": [0, 0, 0, 0]}, vi.StateError, r"shape \(2, 1\)"),
        ({"gap": [0.1], "initial": [REST[1], REST[1]]}, vi.StateError, r"shape \(2, 2, 1\)"),
        ({"gap": [0.1], "initial": [[np.nan], [0]]}, vi.StateError, r"initial\[0, 0\] = nan"),
        ({"gap": [0.1], "periods": 0}, vi.ParameterError, "periods = 0"),
        ({"gap": [0.1], "keep": 500}, vi.ParameterError, "keep = 500"),
        ({"gap": [0.1], "workers": 0}, vi.ParameterError, "workers = 0"),
        ({"gap": [0.1], "client": 3}, vi.ParameterError, "client = 3"),
        ({"gap": [0.1], "labels": 1}, vi.ParameterError, "labels = 1"),
    ],
)
def test_bad_input_is_refused_by_name(asked, error, words):
    with pytest.raises(error, match=words):
        vi.sweep(SETTLING, **{"initial": REST[1]} | asked)


@pytest.mark.parametrize(
    ("function", "words"),
    [
        (lambda gap: SETTLING.replace(drive_frequency=0.0), "at gap = 0.3: drive_frequency = 0.0"),
        (lambda gap: gap, "at gap = 0.3: the function gave 0.3; allowed: a vibroimpact.System or"),
        (lambda gap: SETTLING.replace(gap=-gap / 0), "float division by zero"),
        (lambda other: SETTLING, "unknown argument gap of the function system"),
        (
            lambda gap: SETTLING if gap < 0.35 else MASSES,
            "at gap = 0.4: the function gave a structure of 2 .*as for the first values",
        ),
        (
            lambda gap: SETTLING.replace(law="newton" if gap > 0.35 else "poisson"),
            "at gap = 0.4: law = 'newton' .*'poisson'.*as for the first values",
        ),
        (
            lambda gap: SETTLING if gap < 0.35 else vi.System.from_dict(PENDULUM),
            "at gap = 0.4: the function gave System",
        ),
    ],
)
def test_functions_that_do_not_fit_are_refused_with_their_values(function, words):
    with pytest.raises((vi.ParameterError, ZeroDivisionError), match=words):
        vi.sweep(function, initial=REST[1], gap=[0.3, 0.4], periods=10)


PENDULUM = {
    "mass_ratio": 0.6,
    "frequency_ratio": 2.0,
    "restitution": 0.8,
    "gap": 0.5,
    "drive_frequency": 1.8,
    "moment_amplitude": 1.0,
}


def test_charts_take_two_numbers_of_the_machine():
    with pytest.raises(vi.ParameterError, match="chart sweeps exactly 2 of drive_frequency"):
        vi.chart(SETTLING, initial=REST[1], gap=[0.1])
    with pytest.raises(vi.ParameterError, match="unknown argument q_0 of chart"):
        vi.chart(SETTLING, initial=REST[1], q_0=[0.1], gap=[0.3])


def test_pictures_have_names_of_structures(chart):
    ax = chart.plot()
    assert (ax.get_xlabel(), ax.get_ylabel()) == (r"drive frequency $\omega$", "gap of stop 0")
    ends = vi.sweep(MASSES, initial=REST[2], periods=20, v_1=[0.0, 0.1])
    assert ends.plot().get_ylabel() == "coordinate $q_0$ at the end"
    ax = ends.plot(value="v_1")
    assert (ax.get_xlabel(), ax.get_ylabel()) == (
        r"velocity $\dot q_1$",
        r"velocity $\dot q_1$ at the end",
    )
    heights = ax.collections[0].get_offsets()[:, 1]
    assert heights.tolist() == ends.final_states[:, 1, 1].tolist()
    with pytest.raises(vi.ParameterError, match=r"value = 'x1' .*q_0, q_1, v_0, v_1"):
        ends.plot(value="x1")

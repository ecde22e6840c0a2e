"""Sweeps and charts: each cell is the run of its values; bits, stores, data sets, bad input."""

import pickle
import re

import numpy as np
import pytest

import vibroimpact as vi
from systems import ROUGH
from vibroimpact.sweeps import label_array
from vibroimpact.sweeps.labels import labels

FREQUENCIES = np.linspace(0.5, 3.5, 7)
AMPLITUDES = np.array([0.4, 1.0, 2.0])
LENGTH = {"periods": 150, "keep": 60}


@pytest.fixture(scope="module")
def rubbing() -> vi.System:
    return ROUGH


@pytest.fixture(scope="module")
def chart(rubbing) -> vi.Chart:
    return vi.chart(
        rubbing,
        initial=(0.0, 0.5, 0.0, 0.0),
        drive_frequency=FREQUENCIES,
        moment_amplitude=AMPLITUDES,
        **LENGTH,
    )


def assert_same_bits(left, right):
    assert left.columns.names == right.columns.names
    for name in left.columns.names:
        assert left.columns[name].tobytes() == right.columns[name].tobytes(), name


def test_each_cell_is_the_run_of_its_values(chart, rubbing):
    kinds = set()
    for i, frequency in enumerate(FREQUENCIES):
        for j, amplitude in enumerate(AMPLITUDES):
            system = rubbing.replace(drive_frequency=frequency, moment_amplitude=amplitude)
            run = vi.simulate(system, initial=(0.0, 0.5, 0.0, 0.0), **LENGTH)
            assert chart.label[i, j] == run.label
            assert chart.status[i, j] == run.stop_reason
            end = run.final_state
            assert chart.final_states[i, j].tolist() == [end.x1, end.v1, end.x2, end.v2]
            kinds.add("periodic" if run.period.m else run.label)
            evidence = run.period.evidence
            if run.period.m is None and evidence.growth is not None:
                # Measured over longer where it is more than a verdict.
                exponent, error = chart.largest_exponent[i, j], chart.exponent_error[i, j]
                apart = abs(exponent - evidence.growth / system.drive_period)
                assert apart <= 4.0 * (error + evidence.growth_error / system.drive_period)
                assert error > 0.0 or evidence.growth_periods == 0
    assert {"periodic", "chaotic", "quasi-periodic"} <= kinds


def test_without_labels_only_returns_are_looked_for(chart, rubbing):
    axes = {"drive_frequency": FREQUENCIES, "moment_amplitude": AMPLITUDES}
    start = {"initial": (0.0, 0.5, 0.0, 0.0), **LENGTH}
    plain = vi.chart(rubbing, **start, **axes, labels=False)
    assert vi.sweep(rubbing, **start, **axes, labels=False).label.tolist() == plain.label.tolist()
    assert set(plain.label.ravel()) >= {"unresolved"}
    assert not {"chaotic", "quasi-periodic"} & set(plain.label.ravel())
    returned = plain.m > 0
    assert returned.any()
    assert np.array_equal(plain.final_states, chart.final_states)
    with pytest.raises(AttributeError, match="exponents=True"):
        _ = plain.largest_exponent
    # An exponent comes with the label.
    both = vi.chart(rubbing, **start, **axes, labels=False, exponents=True)
    assert both.label.tolist() == chart.label.tolist()
    with pytest.raises(vi.ParameterError, match="labels"):
        vi.sweep(rubbing, **start, **axes, labels="no")


def test_the_exponent_of_a_periodic_motion_is_that_of_its_multipliers(rubbing):
    system = rubbing.replace(friction=0.0, drive_frequency=1.8)
    sweep = vi.sweep(
        system,
        initial=(0.0, 0.5, 0.0, 0.0),
        periods=3000,
        exponents=True,
        drive_frequency=[1.1, 1.25, 1.8],
    )
    for i, frequency in enumerate([1.1, 1.25, 1.8]):
        run = vi.simulate(
            system.replace(drive_frequency=frequency), initial=(0.0, 0.5, 0.0, 0.0), periods=3000
        )
        motion = run.refine()
        largest = np.log(np.abs(motion.multipliers).max()) / (motion.m * run.system.drive_period)
        assert sweep.largest_exponent[i] == pytest.approx(largest, abs=1e-10)
        assert sweep.exponent_error[i] < 1e-8


def test_a_motion_that_settles_late_has_the_exponent_of_what_it_settles_on(rubbing):
    # After 600 periods it is still far from its orbit; the label follows it further.
    system = rubbing.replace(
        friction=0.0, drive_frequency=1.694915254237288, moment_amplitude=1.0871794871794873
    )
    start = (0.0, 0.5, 0.0, 0.0)
    sweep = vi.sweep(system, initial=start, periods=600, exponents=True, gap=[0.5])
    motion = vi.simulate(system, initial=start, periods=20_000, keep=200).refine()
    largest = np.log(np.abs(motion.multipliers).max()) / (motion.m * system.drive_period)
    assert sweep.label[0] == motion.label
    assert sweep.largest_exponent[0] == pytest.approx(largest, abs=1e-6)
    assert sweep.exponent_error[0] < 1e-6


def test_chatter_is_named_and_has_an_exponent(rubbing):
    # Complete chatter in every period (docs/theory.md, section 5).
    system = rubbing.replace(friction=0.3, force_amplitude=1.5)
    sweep = vi.sweep(
        system.replace(pendulum_damping=0.1, oscillator_damping=0.1),
        initial=(0.0, 0.5, 0.0, 0.0),
        exponents=True,
        drive_frequency=[0.25, 0.3, 0.35],
        **LENGTH,
    )
    assert (sweep.n == -1).any()
    assert all(label.endswith("-inf") for label in sweep.label[sweep.n == -1])
    assert (sweep.largest_exponent[sweep.n == -1] < 0.0).all()


@pytest.mark.parametrize("options", [{"workers": 1}, {"workers": 2, "chunk": 4}, {"chunk": 1}])
def test_nothing_but_the_arguments_changes_a_bit(chart, rubbing, options, tmp_path):
    for store in (None, tmp_path / "chart.zarr"):
        again = vi.chart(
            rubbing,
            initial=(0.0, 0.5, 0.0, 0.0),
            drive_frequency=FREQUENCIES,
            moment_amplitude=AMPLITUDES,
            store=store,
            **LENGTH,
            **options,
        )
        assert_same_bits(again, chart)
    loaded = vi.load(tmp_path / "chart.zarr")
    assert type(loaded) is vi.Chart
    assert loaded.system == rubbing
    assert_same_bits(loaded, chart)


def test_two_or_three_numbers_in_a_tuple_are_no_axis(rubbing):
    start = (0.0, 0.5, 0.0, 0.0)
    of_two = "np.linspace(0.2, 4, 200) for a range, [0.2, 4] for these two values"
    of_three = "np.linspace({}, {}, {}) for a range, [{}, {}, {}] for these three values"
    refused = {
        (0.2, 4): of_two,
        (80.0, 100.0, 50): of_three.format(80, 100, 50, 80, 100, 50),
        (0.2, 0.4, 0.5): of_three.format(0.2, 0.4, 200, 0.2, 0.4, 0.5),
        (0.2, 4, 1e30): of_three.format(0.2, 4, 200, 0.2, 4, 1e30),
        (2, 1, -3): of_three.format(2, 1, 200, 2, 1, -3),
    }
    grids = [
        lambda axis: vi.sweep(rubbing, initial=start, drive_frequency=axis, **LENGTH),
        lambda axis: vi.bifurcation_diagram(rubbing, initial=start, drive_frequency=axis, **LENGTH),
        lambda axis: vi.chart(rubbing, initial=start, drive_frequency=axis, gap=[0.1], **LENGTH),
        lambda axis: vi.lyapunov_spectrum(rubbing, initial=start, drive_frequency=axis, **LENGTH),
        lambda axis: vi.basins(rubbing, x1=axis, v1=[0.0]),
        lambda axis: vi.motion_map(rubbing, 1, drive_frequency=axis),
        lambda axis: vi.sweep(
            lambda made: rubbing.replace(gap=made), initial=start, made=axis, **LENGTH
        ),
    ]
    for grid in grids:
        for values, said in refused.items():
            with pytest.raises(vi.ParameterError, match=re.escape(said)):
                grid(values)
    for allowed in ([0.2, 4], np.array([0.2, 4]), [0.2, 1, 4], (0.2, 1, 3, 4)):
        assert len(grids[0](allowed)) == len(allowed)
    with pytest.raises(vi.ParameterError, match="drive_frequency = 'a'"):
        grids[0](("a", 4))
    for function in (vi.sweep, vi.chart, vi.bifurcation_diagram, vi.basins, vi.motion_map):
        assert "for a range use ``numpy.linspace``" in " ".join(function.__doc__.split())


def test_initial_coordinates_are_axes_too(rubbing):
    sweep = vi.sweep(
        rubbing,
        initial=(0.0, 0.5, 0.0, 0.0),
        x1=[-0.2, 0.1, 2.0],
        v2=[-0.5, 0.5],
        friction=[0.0, 0.5],
        **LENGTH,
    )
    assert sweep.label.shape == (3, 2, 2)
    run = vi.simulate(rubbing, initial=(0.1, 0.5, 0.0, -0.5), **LENGTH)
    assert sweep.label[1, 0, 1] == run.label
    # sin 2 > 0.5: the bodies overlap there, and nothing is run.
    assert (sweep.status[2] == "overlap").all()
    assert (sweep.label[2] == "unresolved").all()
    assert np.isnan(sweep.final_states[2]).all()
    assert sweep.complete


def test_a_data_set_has_the_axes_as_coordinates(chart):
    data = chart.to_xarray()
    assert data.sizes["drive_frequency"] == 7
    assert data["moment_amplitude"].values.tolist() == AMPLITUDES.tolist()
    one = data["largest_exponent"].sel(drive_frequency=FREQUENCIES[2], moment_amplitude=1.0)
    assert one.item() == chart.largest_exponent[2, 1]
    assert data["motion"].attrs["flag_meanings"].split()[3] == "chaotic"


def test_a_data_set_has_the_labels_as_texts(chart, rubbing, tmp_path, monkeypatch):
    chattering = vi.bifurcation_diagram(
        rubbing.replace(friction=0.3, force_amplitude=1.5, damping=(0.1, 0.1)),
        initial=[(0.0, 0.5, 0.0, 0.0), (0.1, 0.5, 0.0, 0.0)],
        drive_frequency=[0.25, 0.3],
        **LENGTH,
    )
    stored = vi.chart(
        rubbing,
        initial=(0.0, 0.5, 0.0, 0.0),
        drive_frequency=FREQUENCIES,
        moment_amplitude=AMPLITUDES,
        store=tmp_path / "chart.zarr",
        **LENGTH,
    )
    seen = []
    monkeypatch.setattr(
        label_array, "labels", lambda *parts: seen.append(parts[0].size) or labels(*parts)
    )
    for data in (chart.to_xarray(), stored.to_xarray()):
        one = data["label"].isel(drive_frequency=2, moment_amplitude=slice(1, 3))
        assert data["label"].dtype == data["label"].values.dtype
        assert data["label"].dims == ("drive_frequency", "moment_amplitude")
        assert one.values.tolist() == chart.label[2, 1:].tolist()
        assert data["label"][3, 1].item() == chart.label[3, 1]
        assert seen == [21, 2, 1]  # nothing is put together but what is looked at
        seen.clear()
        whole = pickle.loads(pickle.dumps(data)).chunk(drive_frequency=3)["label"]
        assert np.array_equal(whole.values, chart.label)
        assert sorted(seen) == [3, 9, 9]  # a chunk of Dask reads no more than itself
        seen.clear()
        assert (data["status"].where(data["label"] == "chaotic") > 0).any()
        seen.clear()
    data = chattering.to_xarray()
    assert data["label"].values.ravel().tolist() == chattering.label.tolist()
    assert "1-inf" in data["label"]


@pytest.mark.parametrize("reader", [vi.load, vi.Chart.load])
def test_a_file_brings_a_chart_back_bit_for_bit(chart, tmp_path, reader):
    chart.save(tmp_path / "chart.npz")
    back = reader(tmp_path / "chart.npz")
    assert type(back) is vi.Chart
    assert (back.system, back.settings) == (chart.system, chart.settings)
    assert back.axes.keys() == chart.axes.keys()
    assert_same_bits(back, chart)
    with pytest.raises(ValueError, match="holds a chart"):
        vi.Diagram.load(tmp_path / "chart.npz")


def test_exponents_that_were_not_asked_for_are_no_attributes(rubbing):
    arguments = {"initial": (0.0, 0.5, 0.0, 0.0), "gap": [0.5, 0.7], **LENGTH}
    sweep = vi.sweep(rubbing, **arguments)
    for result in (sweep, vi.bifurcation_diagram(rubbing, **arguments)):
        for name in ("largest_exponent", "exponent_error"):
            assert not hasattr(result, name)
            message = f"this {result.kind} has no {name}: it was computed without exponents=True"
            with pytest.raises(AttributeError, match=f"^{message}$"):
                getattr(result, name)
            with pytest.raises(KeyError, match=name):
                _ = result.columns[name]
    assert "2 of 2 completed" in repr(sweep)
    assert not sweep.label.flags.writeable


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (
            {"colour": [1.0]},
            "unknown argument colour of sweep; what can be swept: mass_ratio, .* v2, or an ",
        ),
        ({"drive_freq": [1.0]}, r"drive_freq of sweep, did you mean drive_frequency\? what"),
        ({"period": 10, "gap": [0.5]}, r"period of sweep, did you mean periods\?"),
        ({"transient": 10, "gap": [0.5]}, r"transient of sweep; .*; options: initial, periods, "),
        ({"friction": [0.1, -0.1]}, "friction"),
        ({"friction": [0.1, np.nan]}, r"friction\[1\]"),
        ({"drive_frequency": [1.0, 0.0]}, "drive_frequency"),
        ({"gap": [0.5], "periods": 0}, "periods"),
        ({"gap": [0.5], "periods": 10, "keep": 11}, "keep"),
        ({"gap": [0.5], "workers": 0}, "workers"),
        ({"gap": [0.5], "chunk": 0}, "chunk"),
        ({"gap": [[0.5]]}, "gap of shape"),
        ({"gap": [0.5], "section_phase": np.inf}, "section_phase"),
    ],
)
def test_bad_arguments_are_named(rubbing, arguments, message):
    with pytest.raises(vi.ParameterError, match=message):
        vi.sweep(rubbing, initial=(0.0, 0.5, 0.0, 0.0), **arguments)


@pytest.mark.parametrize(
    ("function", "arguments"),
    [
        (vi.sweep, {}),
        (vi.sweep, {"friction": [0.5]}),
        (vi.chart, {"friction": [0.5]}),
        (vi.bifurcation_diagram, {}),
        (vi.bifurcation_diagram, {"refine": 2}),
        (vi.lyapunov_spectrum, {}),
    ],
)
@pytest.mark.parametrize("values", [[], (), np.linspace(0, 1, 0)], ids=["list", "tuple", "array"])
def test_a_sweep_over_nothing_is_refused(rubbing, function, arguments, values):
    with pytest.raises(vi.ParameterError) as caught:
        function(rubbing, initial=(0.0, 0.5, 0.0, 0.0), gap=values, **arguments)
    allowed = "an array of at least one number"
    assert str(caught.value) == f"gap = {values!r} is not allowed; allowed: {allowed}"


def test_by_default_a_short_run_keeps_all_its_periods(rubbing, tmp_path):
    arguments = {"initial": (0.0, 0.5, 0.0, 0.0), "gap": [0.5], "friction": [0.5]}
    for function, usual in ((vi.sweep, 400), (vi.chart, 400)):
        assert function(rubbing, **arguments, periods=50).settings["keep"] == 50
        assert function(rubbing, **arguments, periods=101).settings["keep"] == 100
        assert function(rubbing, **arguments).settings["periods"] == usual
    # A store knows the number, not whether it was given.
    store = tmp_path / "s.zarr"
    vi.sweep(rubbing, **arguments, periods=150, keep=100, store=store)
    assert vi.sweep(rubbing, **arguments, periods=150, store=store).settings["keep"] == 100
    with pytest.raises(vi.ParameterError, match="keep is 100 there, 99 here"):
        vi.sweep(rubbing, **arguments, periods=150, keep=99, store=store)


def test_a_chart_has_two_parameters(rubbing):
    for axes in ({}, {"gap": [0.5]}, {"gap": [0.5], "friction": [0.0], "phase": [0.0]}):
        with pytest.raises(vi.ParameterError, match="chart sweeps exactly 2 of"):
            vi.chart(rubbing, initial=(0.0, 0.5, 0.0, 0.0), **axes)
    with pytest.raises(vi.ParameterError, match="unknown argument x1 of chart"):
        vi.chart(rubbing, initial=(0.0, 0.5, 0.0, 0.0), gap=[0.5], x1=[0.0])
    with pytest.raises(vi.ParameterError, match="system"):
        vi.chart("system", initial=(0.0, 0.5, 0.0, 0.0), gap=[0.5], friction=[0.0])


def test_a_store_of_other_arguments_is_refused(rubbing, tmp_path):
    arguments = {"initial": (0.0, 0.5, 0.0, 0.0), "gap": [0.5, 0.6], "store": tmp_path / "s.zarr"}
    vi.sweep(rubbing, **arguments, **LENGTH)
    with pytest.raises(vi.ParameterError, match=r"friction is 0\.5 there, 0\.4 here"):
        vi.sweep(rubbing.replace(friction=0.4), **arguments, **LENGTH)
    with pytest.raises(vi.ParameterError, match="periods is 150 there, 160 here"):
        vi.sweep(rubbing, **arguments, **(LENGTH | {"periods": 160}))


def test_results_can_be_pickled(chart, rubbing, tmp_path):
    store = tmp_path / "s.zarr"
    arguments = {"initial": (0.0, 0.5, 0.0, 0.0), **LENGTH}
    stored = vi.sweep(rubbing, gap=[0.5, 0.6], store=store, **arguments)
    diagram = vi.bifurcation_diagram(rubbing, gap=[0.5, 0.6], **arguments)
    spectra = vi.lyapunov_spectrum(
        rubbing, initial=(0.0, 0.5, 0.0, 0.0), periods=100, gap=[0.5, 0.6]
    )
    for result in (chart, stored, diagram, spectra):
        back = pickle.loads(pickle.dumps(result))
        assert type(back) is type(result)
        assert (back.system, back.settings) == (result.system, result.settings)
        assert_same_bits(back, result)


def test_a_periodic_motion_has_no_positive_exponent(rubbing):
    # But for the error that is stated of slow ones.
    sweep = vi.sweep(
        rubbing,
        initial=(0.0, 0.5, 0.0, 0.0),
        exponents=True,
        drive_frequency=np.linspace(1.0, 3.5, 100),
    )
    periodic = sweep.m > 0
    assert np.count_nonzero(periodic) > 30
    exponents = sweep.largest_exponent[periodic]
    assert not np.isnan(exponents).any()
    assert (exponents <= 2.0 * sweep.exponent_error[periodic] + 1e-4).all()


def test_masks_and_words_are_no_arguments(rubbing):
    start = (0.0, 0.5, 0.0, 0.0)
    with pytest.raises(vi.ParameterError, match="without a mask"):
        vi.sweep(rubbing, initial=start, gap=np.ma.masked_array([0.5, 0.6], mask=[False, True]))
    with pytest.raises(vi.ParameterError, match="exponents = 'no'"):
        vi.sweep(rubbing, initial=start, exponents="no", gap=[0.5])
    with pytest.raises(vi.ParameterError, match="workers = 1025"):
        vi.sweep(rubbing, initial=start, workers=1025, gap=[0.5])


@pytest.mark.parametrize("start", ["fresh", "forward", "backward"])
def test_a_point_whose_motion_leaves_the_range_of_floats_has_failed(start):
    # After its first impact, at a force of 1e100; the points beside it are none the worse for it.
    forces = np.array([0.1, 1e100, 0.2])
    call = {"initial": (0.0, 0.5, 0.0, 0.0), "periods": 60, "keep": 20}
    with pytest.raises(vi.SimulationError, match="not finite after t = 2"):
        vi.simulate(ROUGH.replace(force_amplitude=1e100), **call)
    diagram = vi.bifurcation_diagram(ROUGH, **call, start=start, force_amplitude=forces)
    assert diagram.status.tolist() == ["completed", "failed", "completed"]
    assert np.isnan(diagram.final_states[1]).all()
    assert not np.isnan(diagram.final_states[[0, 2]]).any()
    assert np.diff(diagram.offset)[1] == 0
    if start == "fresh":
        sound = vi.bifurcation_diagram(ROUGH, **call, force_amplitude=forces[[0, 2]])
        assert diagram.final_states[[0, 2]].tobytes() == sound.final_states.tobytes()
        assert diagram.x1.tobytes() == sound.x1.tobytes()


def test_every_computation_over_a_grid_names_its_failed_cells():
    start, forces = (0.0, 0.5, 0.0, 0.0), {"force_amplitude": [0.1, 1e100]}
    call = {"initial": start, "periods": 60, **forces}
    results = [
        vi.sweep(ROUGH, **call),
        vi.chart(ROUGH, **call, gap=[0.5]),
        vi.lyapunov_spectrum(ROUGH, **call),
    ]
    for result in results:
        assert result.status.ravel().tolist() == ["completed", "failed"], result
    pressed = ROUGH.replace(force_amplitude=1e100)
    assert (vi.basins(pressed, x1=[0.0, 0.1], v1=[0.5]).status == "failed").all()

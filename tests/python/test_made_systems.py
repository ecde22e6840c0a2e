"""A function that makes the system, in sweeps, stores and continuation."""

import math

import matplotlib.pyplot as plt
import numpy as np
import pytest

import vibroimpact as vi

STIFFNESSES = np.linspace(30.0, 50.0, 5)
START = (0.0, 0.5, 0.0, 0.0)
OMEGA_2 = math.sqrt(80.0)
MACHINE = {
    "pendulum_mass": 0.3,
    "oscillator_mass": 0.5,
    "length": 0.2,
    # frequency_ratio 2, drive_frequency 1.8 and moment_amplitude 1 at a stiffness of 40 N/m.
    "torsional_stiffness": 4 * 0.3 * 0.04 * 80.0,
    "stiffness": 40.0,
    "gap": 0.1,
    "restitution": 0.8,
    "drive_frequency": 1.8 * OMEGA_2,
    "moment_amplitude": 0.3 * 0.04 * 80.0,
}


def make(stiffness=40.0, damping=0.0, **others):
    """Return the machine with some of its SI quantities changed."""
    return vi.System.from_physical(
        **MACHINE | {"stiffness": stiffness, "damping": damping} | others
    )


def over_stiffness(stiffness):
    return make(stiffness)


def rows(diagram, i):
    return (
        diagram.stroboscopic[diagram.stroboscopic_offset[i] : diagram.stroboscopic_offset[i + 1]],
        diagram.x1[diagram.offset[i] : diagram.offset[i + 1]],
    )


@pytest.mark.parametrize("start", ["fresh", "forward", "backward"])
def test_a_diagram_over_stiffness_is_that_of_explicit_systems(start):
    diagram = vi.bifurcation_diagram(
        over_stiffness, initial=START, start=start, periods=60, keep=20, stiffness=STIFFNESSES
    )
    assert diagram.is_made
    state = START
    order = range(5)[::-1] if start == "backward" else range(5)
    for i in order:
        system = make(float(STIFFNESSES[i]))
        run = vi.simulate(system, initial=state, periods=60, keep=20)
        sections, x1 = rows(diagram, i)
        assert np.array_equal(sections, run.stroboscopic)
        assert np.array_equal(x1, run.impacts["x1"])
        assert diagram.system_at(i) == system
        assert diagram.system_at(i).scales == system.scales
        if start != "fresh":
            state = run.final_state.state


def test_a_chart_over_two_quantities_is_that_of_explicit_systems():
    dampings = np.array([0.0, 0.3])
    chart = vi.chart(make, initial=START, periods=60, stiffness=STIFFNESSES, damping=dampings)
    for i, stiffness in enumerate(STIFFNESSES.tolist()):
        for j, damping in enumerate(dampings.tolist()):
            run = vi.simulate(make(stiffness, damping), initial=START, periods=60)
            assert np.array_equal(chart.final_states[i, j], run.final_state.state)
            assert chart.system_at(i, j) == chart.system_at(2 * i + j) == make(stiffness, damping)
    for cell in ((5, 0), (10,), (-1,), (0, 0, 0)):
        with pytest.raises(vi.ParameterError, match="cell"):
            chart.system_at(*cell)


def test_a_start_may_be_a_function_and_a_coordinate_an_axis():
    def start(stiffness):
        return (0.0, stiffness / 100, 0.0, 0.0)

    sweep = vi.sweep(over_stiffness, initial=start, periods=30, stiffness=STIFFNESSES, x2=[0, 0.1])
    for i, stiffness in enumerate(STIFFNESSES.tolist()):
        run = vi.simulate(make(stiffness), initial=(0, stiffness / 100, 0.1, 0), periods=30)
        assert np.array_equal(sweep.final_states[i, 1], run.final_state.state)
    own = vi.sweep(make(), initial=lambda gap: (0, gap, 0, 0), periods=30, gap=[0.4, 0.5])
    run = vi.simulate(make().replace(gap=0.4), initial=(0, 0.4, 0, 0), periods=30)
    assert np.array_equal(own.final_states[0], run.final_state.state)


NAMED_LIKE_COORDINATES = {
    "x1": lambda x1, damping=0.0: make(40.0 + x1, damping),
    "v1": lambda v1, damping=0.0: make(40.0 + v1, damping),
    "x2": lambda x2, damping=0.0: make(40.0 + x2, damping),
    "v2": lambda v2, damping=0.0: make(40.0 + v2, damping),
}


@pytest.mark.parametrize("name", NAMED_LIKE_COORDINATES)
def test_a_number_with_the_name_of_a_coordinate_leaves_the_start_alone(name):
    function, values = NAMED_LIKE_COORDINATES[name], {name: [0.0, 4.0]}
    sweep = vi.sweep(function, initial=START, periods=30, **values)
    exponents = vi.lyapunov_spectrum(function, initial=START, periods=30, **values)
    chart = vi.chart(function, initial=START, periods=30, **values, damping=[0.3, 0.0])
    for i, number in enumerate(values[name]):
        run = vi.simulate(make(40.0 + number), initial=START, periods=30)
        assert sweep.run(i).initial == exponents.run(i).initial == START
        assert np.array_equal(sweep.final_states[i], run.final_state.state)
        assert sweep.run(i).final_state == run.final_state
        assert chart.run(i, 1).final_state == run.final_state
    # In a diagram the other three names are those of its columns.
    if name == "x2":
        diagram = vi.bifurcation_diagram(
            function, initial=[START, (0, 0.1, 0, 0)], start="forward", periods=30, **values
        )
        assert diagram.run(0).initial == START
        assert diagram.run(2).initial == (0, 0.1, 0, 0)
        for i in range(4):
            assert np.array_equal(diagram.run(i).final_state.state, diagram.final_states[i])


def test_an_axis_that_the_function_does_not_take_moves_the_start():
    sweep = vi.sweep(
        lambda x2: make(40.0 + x2), initial=START, periods=30, x2=[0.0, 4.0], v1=[0.1, 0.2]
    )
    assert sweep.run(1, 0).initial == (START[0], 0.1, *START[2:])
    assert sweep.run(1, 1).system == make(44.0)
    assert np.array_equal(sweep.run(1, 1).final_state.state, sweep.final_states[1, 1])


def test_a_function_of_any_names_takes_those_of_coordinates():
    def any_names(**numbers):
        return make(40.0 + numbers["x1"], numbers.get("damping", 0.0))

    for name, axes in {"x1": {}, "damping": {"damping": [0.0, 0.3]}}.items():
        sweep = vi.sweep(any_names, initial=START, periods=30, x1=[0.0, 4.0], **axes)
        alone = vi.sweep(
            NAMED_LIKE_COORDINATES["x1"], initial=START, periods=30, x1=[0.0, 4.0], **axes
        )
        assert np.array_equal(sweep.final_states, alone.final_states), name
        cell = (1,) * (1 + len(axes))
        assert sweep.run(*cell).initial == START
        assert sweep.system_at(*cell) == make(44.0, 0.3 if axes else 0.0)


def test_exponents_over_stiffness_are_those_of_explicit_systems():
    values = STIFFNESSES[:2]
    found = vi.lyapunov_spectrum(over_stiffness, initial=START, periods=60, stiffness=values)
    for i, stiffness in enumerate(values.tolist()):
        alone = vi.lyapunov_spectrum(make(stiffness), initial=START, periods=60)
        assert np.array_equal(found.exponents[i], alone.exponents)


def test_a_function_is_called_once_per_value_before_anything_runs():
    calls = []

    def counted(stiffness):
        calls.append(stiffness)
        return make(stiffness)

    vi.sweep(counted, initial=START, periods=10, stiffness=STIFFNESSES, v1=[0.1, 0.2, 0.3])
    assert calls == STIFFNESSES.tolist()
    calls.clear()
    values = np.linspace(35.0, 45.0, 4)
    diagram = vi.bifurcation_diagram(
        counted, initial=START, periods=100, keep=20, stiffness=values, refine=2
    )
    assert sorted(calls) == diagram.values.tolist()


REFUSED = [
    (lambda stiffness: make(stiffness), {"stiffness": [40.0, -1.0]}, "at stiffness = -1.0: stiff"),
    (lambda k: 3.0, {"k": [1.0]}, "at k = 1.0: the function gave 3.0"),
    (lambda k: make(k), {"kk": [1.0]}, "argument kk of the function system, did you mean k"),
    (lambda k, c: make(k, c), {"k": [1.0]}, "no values are given for c"),
    (lambda m: make(), {"m": [1.0]}, "name of an axis = 'm'"),
    (lambda k: make(drive_frequency=k), {"k": [1.0, 0.0]}, "at k = 0.0: drive_frequency"),
    (lambda k: make(law="paper" if k else "newton"), {"k": [0.0, 1.0]}, "at k = 1.0: law"),
]


@pytest.mark.parametrize(
    ("function", "axes", "message"), REFUSED, ids=[each[2] for each in REFUSED]
)
def test_what_does_not_fit_is_refused_and_names_the_value(function, axes, message):
    with pytest.raises(vi.ParameterError, match=message):
        vi.sweep(function, initial=START, **axes)


def test_other_errors_of_a_function_note_the_value():
    with pytest.raises(ZeroDivisionError) as caught:
        vi.sweep(lambda k: make(1 / k), initial=START, k=[1.0, 0.0])
    assert caught.value.__notes__ == ["at k = 0.0"]


def test_an_overlap_names_the_value():
    with pytest.warns(UserWarning, match=r"^1 of 2 cells, the first at gap = -0\.1, has a start"):
        found = vi.bifurcation_diagram(lambda gap: make(gap=gap), initial=START, gap=[0.1, -0.1])
    assert found.status.tolist() == ["completed", "overlap"]


def test_a_single_motion_and_basins_need_a_system():
    with pytest.raises(vi.ParameterError, match="system = "):
        vi.lyapunov_spectrum(over_stiffness, initial=START)
    with pytest.raises(vi.ParameterError, match="system = "):
        vi.basins(over_stiffness, x1=[0.0, 0.1], v1=[0.0, 0.1])


def test_a_store_keeps_the_systems_and_compares_them(tmp_path):
    pytest.importorskip("zarr")
    asked = {"initial": START, "periods": 40, "stiffness": STIFFNESSES, "damping": [0.0, 0.1]}
    memory = vi.chart(make, **asked)
    stored = vi.chart(make, **asked, chunk=2, store=tmp_path / "s")
    again = vi.load(tmp_path / "s")
    for chart in (stored, again, vi.chart(make, **asked, store=tmp_path / "s")):
        assert np.array_equal(chart.final_states, memory.final_states)
        assert chart.system_at(3, 1) == make(45.0, 0.1)

    def other(stiffness, damping):
        return make(stiffness, damping * (2.0 if stiffness == 45.0 else 1.0))

    wanted = r"at stiffness = 45.0, damping = 0.1 oscillator_damping is .* there, .* here"
    with pytest.raises(vi.ParameterError, match=wanted):
        vi.chart(other, **asked, store=tmp_path / "s")
    memory.save(tmp_path / "c.npz")
    assert vi.load(tmp_path / "c.npz").system_at(3, 1) == make(45.0, 0.1)


def test_a_store_calls_functions_once_chunk_by_chunk(tmp_path):
    pytest.importorskip("zarr")
    calls = []

    def fails_late(stiffness):
        calls.append(stiffness)
        if stiffness == STIFFNESSES[-1] and len(calls) < 10:
            raise ValueError("not yet")
        return make(stiffness)

    asked = {"initial": START, "periods": 20, "chunk": 2, "store": tmp_path / "s"}
    with pytest.raises(ValueError, match="not yet") as caught:
        vi.sweep(fails_late, **asked, stiffness=STIFFNESSES)
    assert caught.value.__notes__ == ["at stiffness = 50.0"]
    assert calls == STIFFNESSES.tolist()
    kept = vi.load(tmp_path / "s")
    assert (kept.status[:2] == "completed").all()
    assert kept.status[-1] == "pending"
    assert kept.system_at(1) == make(STIFFNESSES[1])
    calls[:] = [0.0] * 10
    whole = vi.sweep(fails_late, **asked, stiffness=STIFFNESSES)
    assert (whole.status == "completed").all()
    # Those of finished chunks are made again, to be compared.
    assert calls[10:] == STIFFNESSES.tolist()

    calls.clear()
    both = {"stiffness": STIFFNESSES[:3], "v1": [0.1, 0.2, 0.3]}
    stored = vi.sweep(fails_late, **{**asked, "store": tmp_path / "both"}, **both)
    assert calls == STIFFNESSES[:3].tolist()
    memory = vi.sweep(over_stiffness, initial=START, periods=20, **both)
    assert np.array_equal(stored.final_states, memory.final_states)


def test_pictures_are_labelled_with_the_quantity():
    def over(drive_frequency):
        return make(drive_frequency=drive_frequency)

    values = np.linspace(14.0, 18.0, 3)
    diagram = vi.bifurcation_diagram(over, initial=START, periods=30, drive_frequency=values)
    assert vi.plot.bifurcation(diagram).get_xlabel() == r"drive frequency $\Omega$ (rad/s)"
    chart = vi.chart(make, initial=START, periods=30, stiffness=STIFFNESSES, damping=[0, 0.1])
    ax = vi.plot.chart(chart)
    assert (ax.get_xlabel(), ax.get_ylabel()) == (
        "stiffness $K_2$ (N/m)",
        "damping $C_2$ (N s/m)",
    )
    plt.close("all")


@pytest.fixture(scope="module")
def motion():
    return vi.simulate(make(), initial=START, periods=600, keep=100).refine()


def test_a_branch_over_a_physical_quantity_is_that_over_the_own_parameter(motion):
    own = vi.follow_motion(motion, drive_frequency=(1.4, 2.2))
    ends = (1.4 * OMEGA_2, MACHINE["drive_frequency"], 2.2 * OMEGA_2)
    physical = vi.follow_motion(
        motion,
        system=lambda drive_frequency: make(drive_frequency=drive_frequency),
        drive_frequency=ends,
    )
    assert [one.kind for one in physical.bifurcations] == [one.kind for one in own.bifurcations]
    assert len(own.bifurcations) == 8
    for one, other in zip(own.bifurcations, physical.bifurcations, strict=True):
        assert other.value / OMEGA_2 == pytest.approx(one.value, rel=1e-11)
        assert other.motion.system == make(drive_frequency=other.value)
    plt.close("all")


def test_a_quantity_that_moves_several_parameters_can_be_followed(motion):
    # With a stiffness all of frequency ratio, drive frequency and amplitudes change.
    branch = vi.follow_motion(motion, system=over_stiffness, stiffness=(35, 40, 45))
    (found,) = branch.bifurcations
    assert found.kind == "neimark_sacker"
    assert np.abs(found.motion.multipliers[:2]) == pytest.approx(1.0, abs=1e-9)
    start = found.motion.initial
    alone = vi.periodic_motion(make(found.value), initial=start, periods=1)
    assert np.abs(alone.multipliers[:2]) == pytest.approx(1.0, abs=1e-9)
    assert vi.plot.branches(branch).get_xlabel() == "stiffness $K_2$ (N/m)"
    plt.close("all")


def test_curves_and_regions_over_physical_quantities(motion):
    def two(stiffness, gap):
        return make(stiffness, gap=gap)

    branch = vi.follow_motion(motion, system=over_stiffness, stiffness=(35, 40, 45))
    (found,) = branch.bifurcations
    curve = vi.bifurcation_curve(
        found, system=two, stiffness=(35, found.value, 45), gap=(0.09, 0.1, 0.11)
    )
    assert len(curve.values) > 5
    assert np.abs(curve.multipliers[:, :2]) == pytest.approx(1.0, abs=1e-8)
    region = vi.stability_region(
        motion, system=two, stiffness=(38, 40, 42), gap=(0.098, 0.1, 0.102)
    )
    assert region.closed
    assert region.parameters == ("stiffness", "gap")


def test_starts_of_continuation_that_do_not_fit_are_refused(motion):
    with pytest.raises(vi.ParameterError, match="another system than the motion has: frequency_r"):
        vi.follow_motion(motion, system=over_stiffness, stiffness=(35, 41, 45))
    with pytest.raises(vi.ParameterError, match="low, value at the start, high"):
        vi.follow_motion(motion, system=over_stiffness, stiffness=(35, 45))
    with pytest.raises(vi.ParameterError, match="> 0 at the start"):
        vi.follow_motion(
            motion, system=lambda friction: make(friction=friction), friction=(0, 0.0, 0.1)
        )
    with pytest.raises(vi.ParameterError, match="system = 3"):
        vi.follow_motion(motion, system=3, stiffness=(35, 40, 45))

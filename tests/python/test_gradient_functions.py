"""What a function that is differentiated may use and return."""

import copy

import numpy as np
import pytest

import vibroimpact as vi

SYSTEM = vi.System(
    mass_ratio=0.6,
    frequency_ratio=2,
    restitution=0.8,
    gap=0.5,
    drive_frequency=1.8,
    moment_amplitude=1,
    friction=0.1,
)
STRUCTURE = vi.Structure(
    mass=[[1, 0], [0, 2]],
    stiffness=[[5, -2], [-2, 2]],
    stops=[vi.Stop([0, 1], 0.3, 0.8), vi.Stop([0, -1], 0.3, 0.8)],
    damping_ratios=[0.02, 0.02],
    drive_amplitude=[1, 0],
    drive_frequency=1.2,
)
REST = [[0, 0], [0, 0]]


def of_system(function):
    return vi.gradient(function, SYSTEM, ["gap", "v1"], initial=(0, 0.5, 0, 0), periods=3)


@pytest.mark.parametrize(
    ("made", "name", "slope"),
    [
        (lambda d: STRUCTURE.replace(gap=d), "gap", 1.0),
        (lambda d: STRUCTURE.replace(restitution=2 * d), "restitution", 2.0),
        (lambda d: STRUCTURE.replace(gap=d), "restitution", 0.0),
    ],
)
def test_a_number_of_all_stops_has_the_derivative_of_each(made, name, slope):
    found = vi.gradient(
        lambda run: getattr(run.system, name), made, {"d": 0.3}, initial=REST, periods=2
    )
    assert found[1].tolist() == pytest.approx([slope], abs=1e-9)


def test_a_number_of_all_stops_of_which_one_changes_has_none():
    with pytest.raises(AttributeError, match=r"^gap of all stops has no derivatives"):
        vi.gradient(lambda run: run.system.gap, STRUCTURE, ["gap_0"], initial=REST, periods=2)
    own = vi.gradient(lambda run: run.system.gap_0, STRUCTURE, ["gap_0"], initial=REST, periods=2)
    assert own[1].tolist() == [1.0]


@pytest.mark.parametrize("order", [0, 1, -1, np.inf, "fro"])
def test_another_norm_is_refused(order):
    with pytest.raises(TypeError, match=r"^numpy.linalg.norm with ord = "):
        of_system(lambda run: np.linalg.norm(run.stroboscopic[:, 0], order))


def test_the_norm_is_that_of_numpy():
    run = vi.simulate(SYSTEM, initial=(0, 0.5, 0, 0), periods=3)
    times = run.impacts["time"]
    for order in (None, 2):
        value, _ = of_system(lambda run, order=order: np.linalg.norm(run.impacts["time"], order))
        assert value == pytest.approx(np.linalg.norm(times, order), rel=1e-14)


@pytest.mark.parametrize(
    ("function", "said"),
    [
        (lambda run: (run.final_state.x1, None), "one that returns None"),
        (lambda _: np.complex128(1 + 2j), "one that returns "),
        (lambda _: ["1.5"], "one that returns '1.5'"),
        (lambda _: (True,), "one that returns True"),
        (lambda _: float("nan"), "one with a value that is not finite"),
        (lambda run: np.sqrt(run.initial[1] - 0.5), "one with a derivative that is not finite"),
        (lambda run: (run.final_state.x1, run.impacts["time"]), "numbers of several shapes"),
    ],
)
def test_what_is_no_finite_number_is_refused(function, said):
    with pytest.raises(vi.ParameterError, match=f"^function = .*{said}"):
        of_system(function)


def test_choices_without_derivatives_by_a_condition_with_them():
    value, slope = of_system(lambda run: np.where(run.impacts["time"] > 4, 1.0, 0.0))
    plain, _ = of_system(lambda run: np.where(run.impacts["time"], 1.0, 0.0))
    assert value.tolist() == [0.0] + [1.0] * (len(value) - 1)
    assert plain.tolist() == [1.0] * len(value)
    assert not slope.any()


def test_parts_of_a_run_can_be_copied():
    assert of_system(lambda run: copy.copy(run.system).gap)[1].tolist() == [1.0, 0.0]
    of_copy, slope = of_system(lambda run: copy.copy(run.final_state).x1)
    value, own = of_system(lambda run: run.final_state.x1)
    assert of_copy == value
    assert np.array_equal(slope, own)


def test_some_of_the_impacts_are_chosen_as_rows_of_their_table():
    times, slopes = of_system(lambda run: run.impacts["time"])
    for chosen in (slice(1, None), 0, -1, [1, 0], times > times[0]):
        value, slope = of_system(lambda run, chosen=chosen: run.impacts[chosen]["time"])
        assert np.array_equal(value, times[chosen])
        assert np.array_equal(slope, slopes[chosen])
    value, slope = of_system(lambda run: run.impacts[run.impacts["time"] > times[0]]["time"])
    assert np.array_equal(slope, slopes[1:])
    value, slope = of_system(lambda run: [impact["time"] for impact in run.impacts])
    assert np.array_equal(value, times)
    assert np.array_equal(slope, slopes)


def test_what_a_run_has_without_derivatives_is_refused_with_what_it_has():
    with pytest.raises(AttributeError, match=r"^energy_audit has no derivatives; allowed: run, "):
        of_system(lambda run: run.energy_audit())
    with pytest.raises(AttributeError, match=r"^impacts have no time; columns are taken by name: "):
        of_system(lambda run: run.impacts.time)
    with pytest.raises(vi.ParameterError, match=r"did you mean approach_velocity\?"):
        of_system(lambda run: run.impacts["aproach_velocity"])
    with pytest.raises(vi.ParameterError, match=r"^rate = 3 "):
        of_system(lambda run: run.integral(3))

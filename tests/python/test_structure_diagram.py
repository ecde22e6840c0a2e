"""Diagrams, refined motions and exponents of structures."""

import numpy as np
import pytest

import vibroimpact as vi
from struck import REST, SETTLING, orbit, settled_run, small_diagram, spectrum


def test_the_points_of_a_diagram_are_the_single_runs():
    diagram = small_diagram()
    for i, frequency in enumerate([1.9, 2.0, 2.05]):
        single = vi.simulate(
            SETTLING.replace(drive_frequency=frequency), initial=REST[1], periods=200, keep=50
        )
        assert diagram.run(i).impacts.tobytes() == single.impacts.tobytes()
        assert np.array_equal(diagram.run(i).final_state.state, single.final_state.state)
        here = slice(*diagram.offset[i : i + 2])
        assert diagram.impacts["time"][here].tolist() == single.impacts["time"].tolist()
        assert set(diagram.impact_values[here].tolist()) == {frequency}
        assert (diagram.label[i], diagram.m[i], diagram.n[i]) == (single.label, 1, 1)
    assert diagram.stroboscopic.shape == (len(diagram.stroboscopic_values), 2, 1)


def test_continuation_goes_from_point_to_point_in_both_directions():
    values = np.linspace(1.9, 2.1, 5)
    both = vi.bifurcation_diagram(
        SETTLING,
        initial=REST[1],
        drive_frequency=values,
        periods=60,
        keep=1,
        start=("forward", "backward"),
    )
    assert both.branch.tolist() == [0] * 5 + [1] * 5
    assert both.values.tolist() == [*values, *values]
    before = [both.run(i - 1 if branch == 0 else i + 1) for i, branch in ((1, 0), (8, 1))]
    for i, run in zip((1, 8), before, strict=True):
        state = run.final_state
        again = vi.simulate(
            SETTLING.replace(drive_frequency=both.values[i]),
            initial=[state.q, state.v],
            periods=60,
            keep=1,
        )
        assert np.allclose(both.run(i).final_state.q, again.final_state.q, rtol=0, atol=1e-12)


def test_a_function_makes_the_structures_of_a_diagram():
    made = []

    def system(damping):
        made.append(damping)
        return SETTLING.replace(damping_ratios=[damping])

    values = [0.04, 0.05]
    diagram = vi.bifurcation_diagram(system, initial=REST[1], damping=values, periods=30, keep=5)
    assert made == values
    assert diagram.name == "damping"
    single = vi.simulate(SETTLING, initial=REST[1], periods=30, keep=5)
    assert diagram.run(1).impacts.tobytes() == single.impacts.tobytes()


def test_a_field_of_the_stops_is_varied_by_name():
    diagram = vi.bifurcation_diagram(
        SETTLING, initial=REST[1], gap_0=[0.3, 0.35], periods=30, keep=5
    )
    assert diagram.run(1).system.stops[0].gap == 0.35


@pytest.mark.parametrize(
    ("asked", "what"),
    [
        ({"damping": [0.1]}, "name of the parameter = 'damping' .*gap_0"),
        ({"gap": [0.3], "store": "x"}, "store = 'x' is not allowed; allowed: None"),
        (
            {"gap": [0.3], "drive_frequency": [1.0]},
            "parameters = 'gap, drive_frequency' .*exactly one",
        ),
        ({"gap": []}, r"gap = \[\] .*at least one value"),
        ({"gap": [float("nan")]}, r"gap\[0\] = nan .*finite"),
    ],
)
def test_what_a_diagram_of_structures_cannot_do_is_refused(asked, what):
    with pytest.raises(vi.ParameterError, match=what):
        vi.bifurcation_diagram(SETTLING, initial=REST[1], **asked)


def test_a_start_beyond_a_stop_names_the_value():
    with pytest.raises(vi.StateError, match=r"at gap=0\.1: "):
        vi.bifurcation_diagram(SETTLING, initial=[[0.2], [0.0]], gap=[0.3, 0.1])


def test_a_refined_motion_repeats():
    found = orbit()
    assert (found.label, found.m, found.n, found.stability) == ("1-1", 1, 1, "stable")
    assert found.residual < 1e-13
    again = vi.simulate(SETTLING, initial=found.state, periods=1)
    assert np.allclose(again.final_state.q, found.state[0], rtol=0, atol=1e-13)
    # The volume shrinks by damping, exp(-2 zeta w T), and by r^2 in each impact.
    shrinks = 0.8**2 * np.exp(-2 * 0.05 * SETTLING.drive_period)
    assert abs(np.prod(found.multipliers)) == pytest.approx(shrinks, rel=1e-12)


def test_a_motion_that_is_not_periodic_says_so():
    short = vi.simulate(SETTLING, initial=REST[1], periods=2)
    assert not short.refine()
    assert "not periodic" in short.refine().reason


def test_the_exponents_of_a_motion_are_those_of_its_multipliers():
    expected = np.sort(np.log(abs(orbit().multipliers)) / SETTLING.drive_period)[::-1]
    assert np.allclose(spectrum().exponents, expected, rtol=0, atol=3 * spectrum().error + 1e-3)
    assert spectrum().exponents.sum() == pytest.approx(expected.sum(), abs=1e-9)
    first = vi.lyapunov_spectrum(SETTLING, initial=REST[1], periods=400, keep=200, most=1)
    assert first.exponents.shape == (1,)
    assert settled_run().label == spectrum().label


def test_exponents_come_with_their_convergence():
    found = vi.lyapunov_spectrum(SETTLING, initial=REST[1], periods=1000, keep=900)
    steps = np.diff(found.history_time)
    # 810 periods are measured, and shown in steps of five.
    assert found.history.shape == (162, 2)
    assert np.allclose(steps, 5 * SETTLING.drive_period, rtol=1e-12)
    assert found.history_time[-1] == found.time
    assert found.history[-1].tolist() == found.exponents.tolist()
    # The volume shrinks alike in every period.
    decays = found.history.sum(axis=1)
    assert np.allclose(decays, found.sum, rtol=1e-9)
    ax = found.plot()
    lines = [line for line in ax.lines if len(line.get_xdata()) == 162]
    for k in range(2):
        assert np.array_equal(lines[k].get_ydata(), found.history[:, k])

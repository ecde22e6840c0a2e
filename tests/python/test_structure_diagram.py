"""Diagrams, refined motions and exponents of structures."""

import math

import numpy as np
import pytest

import vibroimpact as vi
from ctrl_c import asks_of, ctrl_c_at
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
        assert diagram.impacts[here].tobytes() == single.impacts.tobytes()
        sections = slice(*diagram.stroboscopic_offset[i : i + 2])
        assert np.array_equal(diagram.stroboscopic[sections], single.stroboscopic)
        assert set(diagram.impact_parameter[here].tolist()) == {frequency}
        assert (diagram.label[i], diagram.m[i], diagram.n[i]) == (single.label, 1, 1)
    assert diagram.stroboscopic.shape == (len(diagram.stroboscopic_parameter), 2, 1)


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
    assert both.parameter.tolist() == [*values, *values]
    for i, before in ((1, 0), (8, 9)):
        state = both.run(before).final_state
        again = vi.simulate(
            SETTLING.replace(drive_frequency=both.parameter[i]),
            initial=[state.q, state.v],
            periods=60,
            keep=1,
        )
        assert both.run(i).initial.tolist() == [state.q.tolist(), state.v.tolist()]
        assert np.array_equal(both.final_states[i], [again.final_state.q, again.final_state.v])


def test_several_starts_are_branches_and_one_that_does_not_fit_is_begun_anew():
    starts = [[[0.0], [0.0]], [[-0.5], [0.2]]]
    # On a stop that is closed a motion ends where the next one has no room.
    pressed = SETTLING.replace(static_load=[0.8], restitution=0.0, drive_frequency=1.0)
    diagram = vi.bifurcation_diagram(
        pressed, initial=starts, gap=[0.4, 0.1, 0.4], start="forward", periods=3, keep=1
    )
    assert diagram.settings.initial == tuple(tuple(map(tuple, one)) for one in starts)
    assert diagram.status.tolist() == ["completed", "restarted", "completed"] * 2
    for i, start in ((0, starts[0]), (1, starts[0]), (3, starts[1]), (4, starts[1])):
        assert diagram.run(i).initial.tolist() == start
        assert np.array_equal(diagram.run(i).final_state.state, diagram.final_states[i])


def test_a_function_makes_the_structures_of_a_diagram():
    made = []

    def system(damping):
        made.append(damping)
        return SETTLING.replace(damping_ratios=[damping])

    values = [0.04, 0.05]
    diagram = vi.bifurcation_diagram(system, initial=REST[1], damping=values, periods=30, keep=5)
    assert made == values
    assert diagram.parameter_name == "damping"
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
        ({"damping": [0.1]}, "unknown argument damping .*gap_0"),
        ({"q_0": [0.1]}, "unknown argument q_0 .*gap_0"),
        ({"gap": [0.3], "units": "SI"}, "units = 'SI' .*a structure has no scales"),
        ({"gap": [0.3], "drive_frequency": [1.0]}, "exactly 1 of .*gap, drive_frequency"),
        ({"gap": []}, r"gap = \[\] .*at least one number"),
        ({"gap": [float("nan")]}, r"gap\[0\] = nan .*finite"),
        ({"gap": [0.3], "start": "forward", "refine": 1}, "refine = 1 .*followed branches"),
    ],
)
def test_bad_input_of_a_diagram_is_refused_by_name(asked, what):
    with pytest.raises(vi.ParameterError, match=what):
        vi.bifurcation_diagram(SETTLING, initial=REST[1], **asked)


def same(one, other):
    """Check that two results have the same bits."""
    for name in one.columns.names:
        assert one.columns[name].tobytes() == other.columns[name].tobytes(), name


@pytest.mark.parametrize("start", ["fresh", ("forward", "backward")])
def test_a_store_is_resumed_and_threads_change_nothing(tmp_path, start):
    asked = {"initial": REST[1], "drive_frequency": np.linspace(1.9, 2.05, 4), "start": start}
    asked |= {"periods": 60, "keep": 10, "exponents": True}
    whole = vi.bifurcation_diagram(SETTLING, workers=1, **asked)
    asks = asks_of(lambda: vi.bifurcation_diagram(SETTLING, workers=1, chunk=1, **asked))
    path = tmp_path / "d"
    with ctrl_c_at(asks // 2) as caught:
        vi.bifurcation_diagram(SETTLING, workers=1, chunk=1, store=path, **asked)
    done = caught.value.result.status != "pending"
    assert 0 < done.sum() < len(whole)
    stored = vi.bifurcation_diagram(SETTLING, store=path, workers=2, **asked)
    same(whole, stored)
    loaded = vi.load(path)
    assert isinstance(loaded, vi.StructureDiagram)
    same(whole, loaded)
    assert (loaded.largest_exponent < 0).all()
    whole.save(tmp_path / "d.npz")
    again = vi.load(tmp_path / "d.npz")
    same(whole, again)
    assert again.impacts.tobytes() == whole.impacts.tobytes()
    assert again.run(1).impacts.tobytes() == whole.run(1).impacts.tobytes()


def test_steps_across_which_the_label_changes_are_halved():
    diagram = vi.bifurcation_diagram(
        SETTLING, initial=REST[1], gap=[0.3, 5.0], refine=3, periods=120, keep=20
    )
    assert len(diagram) == 5
    assert {*diagram.label} >= {"1-1", "1-0"}


def test_frames_have_a_column_for_each_number():
    frame = small_diagram().to_pandas()
    assert {"q_0", "v_pre_0", "stop", "approach_velocity"} <= {*frame.columns}
    assert len(frame) == small_diagram().offset[-1]
    assert {"q_0", "v_0"} <= {*small_diagram().to_pandas("stroboscopic").columns}
    assert small_diagram().to_pandas("point")["drive_frequency"].tolist() == [1.9, 2.0, 2.05]


def test_a_refined_motion_repeats():
    found = orbit()
    assert (found.label, found.m, found.n, found.stability) == ("1-1", 1, 1, "stable")
    assert found.residual < 1e-13
    again = vi.simulate(SETTLING, initial=found.state, periods=1)
    assert np.allclose(again.final_state.q, found.state[0], rtol=0, atol=1e-13)
    # The volume shrinks by damping, exp(-2 zeta w T), and by r^2 in each impact.
    shrinks = 0.8**2 * np.exp(-2 * 0.05 * SETTLING.drive_period)
    assert abs(np.prod(found.multipliers)) == pytest.approx(shrinks, rel=1e-12)


def test_a_motion_with_contact_has_a_section_in_each_of_its_periods():
    pressed = SETTLING.replace(
        restitution=0.3, static_load=[0.3], gap=0.1, drive_frequency=4.523489932885906
    )
    run = vi.simulate(pressed, initial=REST[1], periods=400, keep=60)
    motion = run.refine()
    assert (motion.m, motion.legs) == (3, ())
    assert run.time_in_contact > 0
    before = run.stroboscopic[-4:-1]  # the first of them ends the period before the last three
    assert motion.sections.shape == (3, 2, 1)
    off = [np.abs(np.roll(before, k, axis=0) - motion.sections).max() for k in range(3)]
    assert min(off) < 1e-12
    assert sorted(off)[1] > 0.1


def test_a_motion_with_complete_chatter_has_infinitely_many_impacts(tmp_path):
    silent = vi.Structure(  # a gear in its play, pressed on one side and shaken off once per period
        [[1]],
        [[0]],
        [vi.Stop([1], 0.6, 0.5), vi.Stop([-1], 0.6, 0.5)],
        damping=[[0.6]],
        static_load=[4 * np.pi * 0.6],
        drive_amplitude=[-(np.pi**2)],
        drive_frequency=2 * np.pi,
    )
    run = vi.simulate(silent, initial=[[0], [0]], periods=100, keep=20)
    motion = run.refine()
    assert (motion.label, motion.n) == ("1-inf", math.inf)
    assert motion.label == run.label
    assert motion.impacts[0] > 0  # those that are listed
    motion.save(tmp_path / "motion.npz")
    read = vi.load(tmp_path / "motion.npz")
    assert (read.label, read.system, read.stable) == ("1-inf", silent, True)
    assert read.derivative.tobytes() == motion.derivative.tobytes()
    plane = {"q_0": [0, 0.3], "v_0": [-1, 1]}
    basins = vi.basins(silent, **plane, scouts=4, periods=100)
    basins.save(tmp_path / "basins.npz")
    again = vi.load(tmp_path / "basins.npz")
    labels = [each.motion.label for each in (*basins.attractors, *again.attractors)]
    assert labels == ["1-inf", "1-inf"]


def test_a_motion_comes_back_from_a_file(tmp_path):
    motion = orbit()
    motion.save(tmp_path / "motion.npz")
    for read in (vi.load(tmp_path / "motion.npz"), vi.StructureOrbit.load(tmp_path / "motion.npz")):
        for name in ("system", "m", "n", "residual", "error", "stability", "legs", "clocks"):
            assert getattr(read, name) == getattr(motion, name)
        for name in ("state", "impacts", "derivative", "multipliers", "nodes"):
            assert getattr(read, name).tobytes() == getattr(motion, name).tobytes()
        assert read.admissible
        assert not read.why_not
        here, there = (of.follow(drive_frequency=(1.99, 2.01)) for of in (motion, read))
        assert here.values.tobytes() == there.values.tobytes()
    with pytest.raises(ValueError, match="structure_motion"):
        vi.PeriodicMotion.load(tmp_path / "motion.npz")


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


def test_the_exponents_of_a_cell_are_those_of_its_motion():
    frequencies = [1.9, 2.0, 2.2]
    asked = {"initial": REST[1], "periods": 800}
    found = vi.lyapunov_spectrum(SETTLING, drive_frequency=frequencies, gap=[0.3, 0.35], **asked)
    assert found.exponents.shape == (3, 2, 2)
    assert found.complete
    for i, frequency in enumerate(frequencies):
        here = SETTLING.replace(drive_frequency=frequency, gap=0.35)
        assert found.system_at(i, 1) == here
        one = vi.lyapunov_spectrum(here, **asked)
        # That of a cell is measured once its motion has settled, to the same exponents.
        assert np.allclose(found.exponents[i, 1], one.exponents, rtol=0, atol=1e-12)
        assert found.largest[i, 1] == found.exponents[i, 1, 0]
    drawn = vi.lyapunov_spectrum(
        lambda ratio: SETTLING.replace(damping_ratios=[ratio]), ratio=[0.02, 0.1], **asked
    )
    assert np.allclose(drawn.exponents.sum(axis=1), found_sums(drawn), rtol=1e-9)
    ax = drawn.plot()
    curves = {line.get_label(): line.get_ydata() for line in ax.lines}
    for k in range(2):
        assert np.array_equal(curves[rf"$\lambda_{k + 1}$"], drawn.exponents[:, k])


def found_sums(sweep) -> list[float]:
    """Return the mean rates at which volumes shrink: by damping, and r^2 at each impact."""
    sums = []
    for i in range(len(sweep)):
        system = sweep.system_at(i)
        (ratio,) = system.damping_ratios
        impacts = vi.lyapunov_spectrum(system, initial=REST[1], periods=200)
        rate = impacts.impacts.sum() / impacts.time
        sums.append(2 * rate * np.log(system.stops[0].restitution) - 2 * ratio)
    return sums


def test_more_exponents_than_a_picture_names_are_drawn_in_part():
    many = vi.Structure(
        np.eye(7),
        np.diag(np.arange(1.0, 8.0)),
        [vi.Stop(np.eye(7)[0], 0.3, 0.8)],
        damping_ratios=np.linspace(0.02, 0.08, 7),
        drive_amplitude=np.ones(7),
        drive_frequency=2.0,
    )
    found = vi.lyapunov_spectrum(many, initial=np.zeros((2, 7)), periods=40, gap=[0.3, 0.4])
    assert found.exponents.shape == (2, 14)
    names = [line.get_label() for line in found.plot().lines if line.get_label()[0] == "$"]
    assert names == [rf"$\lambda_{k}$" for k in range(1, 10)] + [
        rf"$\lambda_{{{k}}}$" for k in range(10, 13)
    ]


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"gap": [0.3], "most": 1}, "most = 1 .* None, but for one motion of a structure"),
        ({"most": 3}, "most = 3 .* from 1 to 2"),
        ({"x1": [0.3]}, r"unknown argument x1 of lyapunov_spectrum, did you mean q_0\?"),
        ({"gap": [0.3], "time": 30.0}, "time = 30.0 .* None, but for a single motion"),
        ({"units": "SI"}, "units = 'SI'"),
        ({"chunk": 3}, "chunk = 3 .* single motion"),
    ],
)
def test_what_a_spectrum_does_not_take_is_named(options, words):
    with pytest.raises(vi.ParameterError, match=words):
        vi.lyapunov_spectrum(SETTLING, initial=REST[1], **{"periods": 60} | options)


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

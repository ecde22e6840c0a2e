"""What is said of runs that could not begin, or that ended at a cap nobody asked for."""

import warnings

import numpy as np
import pytest

import vibroimpact as vi
from command_lines import DIAGRAM
from systems import PAPER

START = (0.0, 0.5, 0.0, 0.0)
OF_A_SYSTEM = (
    "a start where the bodies overlap and no run, status overlap: the initial state is pen"
)
ONE = vi.Structure([[1]], [[1]], [vi.Stop([1], 0.3, 0.8)], drive_amplitude=[1], drive_frequency=2)
OF_A_STOP = (
    "a start inside a stop and no run, status overlap: the initial state is penetrating: gap "
)


@pytest.mark.parametrize("start", ["fresh", "forward", "backward"])
def test_points_that_overlap_have_a_status_in_a_diagram_and_are_warned_of(start):
    gaps = [0.5, -0.4, 0.2]
    asked = {"initial": START, "periods": 20, "start": start}
    with pytest.warns(
        UserWarning, match=rf"^1 of 3 cells, the first at gap = -0.4, has {OF_A_SYSTEM}"
    ):
        found = vi.bifurcation_diagram(PAPER, gap=gaps, **asked)
    where = found.parameter.tolist().index(-0.4)
    assert found.status[where] == "overlap"
    assert set(np.delete(found.status, where)) <= {"completed", "restarted"}
    assert f"of {len(found)} completed, 1 overlap, " in repr(found)
    with pytest.raises(vi.StateError, match="penetrating"):
        found.run(where)
    # The others are as they are without it.
    alone = vi.bifurcation_diagram(PAPER, gap=[0.5, 0.2], **asked)
    assert np.array_equal(np.delete(found.final_states, where, 0), alone.final_states)


def test_the_warning_of_an_overlap_names_start_and_stop():
    starts = np.array([START, (0.3, 0.5, 0.0, 0.0), (1.0, 0.5, 0.0, 0.0)])
    said = rf"^1 of 3 cells, the first at branch = 2, drive_frequency = 1.8, has {OF_A_SYSTEM}"
    with pytest.warns(UserWarning, match=said) as caught:
        vi.bifurcation_diagram(PAPER, initial=starts, periods=10, drive_frequency=[1.8])
    assert caught[0].filename == __file__
    inside = {"initial": [[0.5], [0.0]], "periods": 10}
    said = rf"^1 of 2 cells, the first at gap = 0.3, has {OF_A_STOP}function g = 0.2 of stops\[0\]"
    for call in (vi.bifurcation_diagram, vi.sweep):
        with pytest.warns(UserWarning, match=said):
            found = call(ONE, gap=[0.6, 0.3], **inside)
        assert found.status.tolist() == ["completed", "overlap"]
    said = rf"^4 of 4 cells, the first at friction = 0, restitution = 0.2, have {OF_A_STOP}"
    with pytest.warns(UserWarning, match=said):
        found = vi.chart(ONE, friction=[0, 0], restitution=[0.2, 0.4], **inside)
    assert set(found.status.flat) == {"overlap"}
    by = {"by": [0.6, 0.3]}
    with pytest.warns(UserWarning, match=rf"^1 of 2 cells, the first at by = 0.3, has {OF_A_STOP}"):
        vi.bifurcation_diagram(lambda by: ONE.replace(gap=by), **inside, **by)
    with pytest.warns(UserWarning, match=r"^1 of 2 cells, the first at gap = 0.3, has a start"):
        vi.lyapunov_spectrum(ONE, gap=[0.6, 0.3], initial=[[0.5], [0.0]], periods=40)
    with pytest.warns(UserWarning, match=r"cells, the first at gap = 0.3, have a start"):
        vi.bifurcation_diagram(ONE, gap=[0.6, 0.3], refine=1, **inside)
    # A plane of starts shows where there are none.
    plane = vi.sweep(ONE, q_0=[0.0, 0.5], initial=[[0.0], [0.0]], periods=10)
    assert plane.status.tolist() == ["completed", "overlap"]


def test_a_run_that_ends_at_the_usual_cap_is_warned_of(monkeypatch):
    def capped(of):
        return lambda *given, max_events=40, **options: of(*given, max_events=max_events, **options)

    core = vi.simulate.__globals__["_core"]
    monkeypatch.setattr(core, "simulate", capped(core.simulate))
    monkeypatch.setattr(core, "sweep", capped(core.sweep))
    said = (
        r"^the run ended early, at t = 13\d\.\d+, after \d+ drive periods \(stop_reason event_cap\)"
    )
    with pytest.warns(UserWarning, match=said) as caught:
        run = vi.simulate(PAPER, initial=START, periods=10**12)
    assert run.stop_reason == "event_cap"
    assert caught[0].filename == __file__
    assert "10 million events, the cap unless max_events= gives another" in str(caught[0].message)
    with pytest.warns(UserWarning, match=r"^the run ended early"):
        run.resume(periods=10)
    with pytest.warns(UserWarning, match=r"^2 of 2 runs ended early"):
        vi.simulate(PAPER, initial=[START, START], periods=10**6)
    said = r"^2 of 2 cells, the first at gap = 0.5, have a run that ended early, status event_cap"
    with pytest.warns(UserWarning, match=said):
        vi.sweep(PAPER, initial=START, periods=10**6, gap=[0.5, 0.4], labels=False)
    # Who gives a cap has asked for it.
    assert vi.simulate(PAPER, initial=START, periods=99, max_events=9).stop_reason == "event_cap"
    vi.sweep(PAPER, initial=START, periods=10**6, gap=[0.5], max_events=9)


def test_a_machine_in_si_without_units_and_without_impacts_is_warned_of():
    machine = vi.System.from_physical(
        **{"pendulum_mass": 0.3, "oscillator_mass": 0.5, "length": 0.2, "stiffness": 40},
        **{"torsional_stiffness": 1.5, "moment_amplitude": 0.4, "force_amplitude": 0.2},
        **{"drive_frequency": 12.6, "gap": 0.1, "restitution": 0.8},
    )
    start = {"initial": (0.1, 0, 0, 0), "periods": 20}
    meant = r"dimensionless, .* made in SI: 1 means 0\.112 s, 8\.94 rad/s, 0\.2 m$"
    faster = {"drive_frequency": np.linspace(12, 14, 3)}
    with pytest.warns(UserWarning, match=rf"^there are no impacts in any cell; without .* {meant}"):
        vi.bifurcation_diagram(machine, **start, **faster)
    quick = machine.replace(drive_frequency=30)
    with pytest.warns(UserWarning, match=rf"^there are no impacts; without .* {meant}") as caught:
        run = vi.simulate(quick, **start)
    assert caught[0].filename == __file__
    # As it was meant, with impacts, and of a system that has no units.
    vi.bifurcation_diagram(machine, **start, **faster, units="SI")
    vi.simulate(quick, **start, units="SI")
    vi.simulate(machine, **start)
    vi.simulate(PAPER.replace(gap=5.0), **start)
    # Nobody asked for a run of its own.
    assert not run.refine()


def test_a_warning_is_a_line_on_the_command_line(run_command):
    command = DIAGRAM.replace("drive-frequency 1.7 1.9 5", "gap -0.4 0.5 2")
    with warnings.catch_warnings():
        warnings.simplefilter("default")
        code, _, said = run_command(command.replace("--gap 0.5", "--drive-frequency 1.8"))
    assert code == 0, said
    assert said.startswith("vibroimpact: 1 of 2 cells, the first at gap = -0.4, has a start where")

"""Runs that are made with their derivatives: both are those of the run alone, and cost less."""

import pickle

import numpy as np
import pytest

import vibroimpact as vi
from ctrl_c import asks_of, ctrl_c_at
from small_results import START
from struck import BEAM, MOVING, PRESSED, REST, SETTLING
from systems import PAPER
from vibroimpact import _core

DAMPED = PAPER.replace(damping=(0.02, 0.03), force_amplitude=0.3, phase=0.3)
NAMES = ("restitution", "gap", "drive_frequency", "v1")
SYSTEMS = {
    "chaos": PAPER.replace(drive_frequency=1.9, friction=0.1),
    "copied": PAPER,
    "chatter": DAMPED.replace(restitution=0.3, drive_frequency=0.6, force_amplitude=0.8),
    "rubs": DAMPED.replace(restitution=0.3, drive_frequency=0.25, friction=0.3),
    "curve": DAMPED.replace(restitution=vi.RestitutionTable([0.1, 0.6], [0.9, 0.6])),
    "no impacts": PAPER.replace(moment_amplitude=0.01, gap=0.9),
}
STRUCTURES = {"settles": SETTLING, "moves": MOVING, "is pressed": PRESSED, "of modes": BEAM}
OF_STRUCTURE = ("gap", "drive_frequency", "v_0")


# Whose derivatives grow beyond all numbers.
GROWS = PAPER.replace(friction=0.5, drive_frequency=1.52, damping=(0.001, 0.001))


def fresh(monkeypatch):
    """Let derivatives be computed after a run never again."""

    def never(*_):
        raise AssertionError("the derivatives were computed again")

    for name in ("sensitivity", "structure_sensitivity"):
        monkeypatch.setattr(_core, name, never)


def all_of(found: vi.Sensitivity, run) -> list[np.ndarray]:
    inside = np.linspace(run.kept_from, run.final_state.time, 23)
    return [*found.impacts, found.stroboscopic, found.final_state, found.trajectory(inside)]


def assert_same(run, alone, names, directions=None, least: float = 1e-9):
    directions = directions or {}
    ours, others = (one.sensitivity(*names, **directions) for one in (run, alone))
    assert run == alone
    assert ours == others
    assert ours.one_sided == others.one_sided
    for mine, other in zip(all_of(ours, run), all_of(others, alone), strict=True):
        assert mine == pytest.approx(other, rel=least, abs=least)


@pytest.mark.parametrize("keep", [None, 0, 1, 7, 60])
@pytest.mark.parametrize("kind", SYSTEMS)
def test_a_run_and_its_derivatives_are_those_of_the_run_alone(kind, keep):
    given = {"initial": START, "periods": 60, "keep": keep, "section_phase": 0.7}
    names = ("r_0", *NAMES[1:]) if kind == "curve" else NAMES
    run = vi.simulate(SYSTEMS[kind], **given, sensitivity=names)
    assert_same(run, vi.simulate(SYSTEMS[kind], **given), names)


@pytest.mark.parametrize("keep", [None, 0, 3, 40])
@pytest.mark.parametrize("kind", STRUCTURES)
def test_so_are_those_of_structures(kind, keep):
    structure = STRUCTURES[kind]
    start = REST[structure.coordinates]
    along = {"harder": {"drive_amplitude": structure.drive_amplitude}}
    given = {"initial": start, "periods": 40, "keep": keep}
    # In modes no coordinate of the start changes alone.
    names = OF_STRUCTURE[: 2 if kind == "of modes" else None]
    asked = dict.fromkeys(names) | along
    run = vi.simulate(structure, **given, sensitivity=asked)
    assert_same(run, vi.simulate(structure, **given), names, along, least=1e-8)


def test_nothing_is_computed_again_for_some_of_the_names_in_any_order(monkeypatch):
    along = {"heavier": {"mass": SETTLING.mass}}
    given = {"initial": REST[SETTLING.coordinates], "periods": 40, "keep": 3}
    whole = vi.simulate(SETTLING, **given).sensitivity("v_0", "gap", **along)
    run = vi.simulate(SETTLING, **given, sensitivity={"gap": None, "v_0": None} | along)
    mine = vi.simulate(PAPER, initial=START, periods=60, keep=3, sensitivity="gap")
    fresh(monkeypatch)
    found = run.sensitivity("v_0", "gap", **along)
    assert found.names == ("v_0", "gap", "heavier")
    for ours, other in zip(all_of(found, run), all_of(whole, run), strict=True):
        assert ours == pytest.approx(other, rel=1e-9)
    assert run.sensitivity("gap").impacts.before.shape[-1] == 1
    assert mine.sensitivity("gap").names == ("gap",)
    for names in (("restitution",), ("gap", "gap"), ()):
        with pytest.raises((AssertionError, vi.ParameterError)):
            mine.sensitivity(*names)


def test_another_direction_of_the_same_name_is_computed():
    given = {"initial": REST[SETTLING.coordinates], "periods": 10, "keep": 3}
    run = vi.simulate(SETTLING, **given, sensitivity={"more": {"gap": 1.0}})
    twice = run.sensitivity(more={"gap": 2.0})
    assert twice.final_state == pytest.approx(2 * run.sensitivity("gap").final_state)


ENDS = {
    "event_cap": ({}, {"periods": 60, "keep": 20, "max_events": 45}),
    "law_failed": ({"restitution": 0.24, "gap": 0.45, "friction": 2.94, "law": "paper"}, {}),
    "painleve": ({"restitution": 0.33, "gap": 0.12, "friction": 2.98, "law": "energetic"}, {}),
    "completed": ({}, {"time": 33.0, "periods": None, "keep": None}),
}
OTHER = {"law_failed": (1.2, 1.71), "painleve": (0.87, 2.74)}


@pytest.mark.filterwarnings("ignore:the run ended early")
@pytest.mark.parametrize("reason", ENDS)
def test_runs_end_where_they_end(reason):
    changes, options = ENDS[reason]
    omega, moment = OTHER.get(reason, (1.8, 1.0))
    system = PAPER.replace(**changes, drive_frequency=omega, moment_amplitude=moment)
    for keep in (60, 50, 0):
        given = {"initial": (-1, 0.5, 0, 0), "periods": 60, "keep": keep} | options
        if given["periods"] is None and keep < 60:
            continue
        run = vi.simulate(system, **given, sensitivity=NAMES)
        assert run.stop_reason == reason
        assert_same(run, vi.simulate(system, **given), NAMES)


def test_what_has_no_derivatives_is_refused_when_it_is_asked_for():
    given = {"initial": START, "periods": 4000, "keep": 2}
    run = vi.simulate(GROWS, **given, sensitivity="gap")
    assert run == vi.simulate(GROWS, **given)
    with pytest.raises(vi.SimulationError, match="beyond 1e308") as caught:
        run.sensitivity("gap")
    assert caught.value.result is run


@pytest.mark.parametrize(
    ("system", "sensitivity", "words"),
    [
        (PAPER, "gop", "sensitivity: names = 'gop' .*did you mean gap"),
        (PAPER, {"spring": {"stiffness": 1}}, "sensitivity: spring = .*for a Structure only"),
        (PAPER, [], r"sensitivity = \[\] is not allowed"),
        (PAPER, ["gap", 3], "sensitivity = "),
        (PAPER, 3.0, "sensitivity = 3.0 is not allowed; allowed: names"),
        (PAPER, ["gap", "gap"], r"sensitivity = \['gap', 'gap'\] is not allowed.* each once"),
        (SETTLING, "friction", "friction"),
        (SETTLING, {"spring": {"stuffness": [[1]]}}, "sensitivity: "),
    ],
)
def test_bad_names_are_refused_before_any_work(system, sensitivity, words):
    start = START if system is PAPER else REST[1]
    with pytest.raises(vi.ParameterError, match=words):
        vi.simulate(system, initial=start, periods=10**9, sensitivity=sensitivity)


def test_several_starts_are_refused():
    with pytest.raises(vi.ParameterError, match=r"sensitivity = \['gap'\] .*several starts"):
        vi.simulate(PAPER, initial=[START, START], periods=10, sensitivity="gap")


def test_a_bad_start_is_told_as_always():
    for more in ({}, {"sensitivity": "gap"}):
        with pytest.raises(vi.StateError, match="which is x2 >="):
            vi.simulate(PAPER, initial=(1.5, 0, 0, 0), periods=10, **more)


@pytest.mark.parametrize("part", [0.1, 0.5, 0.99])
@pytest.mark.parametrize("kind", ["chaos", "copied"])
def test_ctrl_c_keeps_the_run_so_far(kind, part):
    given = {"initial": START, "periods": 300, "keep": 280}

    def call():
        return vi.simulate(SYSTEMS[kind], **given, sensitivity=NAMES)

    with ctrl_c_at(int(part * asks_of(call))) as caught:
        call()
    run = caught.value.result
    assert run.stop_reason == "interrupted"
    whole = vi.simulate(SYSTEMS[kind], **given)
    count = len(run.impacts)
    assert run.impacts["time"].tolist() == whole.impacts["time"][:count].tolist()
    found, other = run.sensitivity("gap"), whole.sensitivity("gap")
    assert found.impacts.time == pytest.approx(other.impacts.time[:count], rel=1e-9)


@pytest.mark.parametrize("part", [0.1, 0.45, 0.55, 0.9])
def test_ctrl_c_is_not_lost_where_derivatives_are_refused(part):
    def call():
        return vi.simulate(GROWS, initial=START, periods=6000, keep=2, sensitivity="gap")

    with ctrl_c_at(int(part * asks_of(call))) as caught:
        call()
    assert caught.value.result.stop_reason == "interrupted"


def test_a_window_tells_the_same_time_of_what_is_lost():
    told = []
    for keep in (None, 2):
        run = vi.simulate(GROWS, initial=START, periods=4000, keep=keep)
        with pytest.raises(vi.SimulationError, match="beyond 1e308 by t = ") as caught:
            run.sensitivity("gap")
        told.append(str(caught.value))
    assert told[0] == told[1]


def test_a_list_of_names_is_refused_as_of_any_run():
    for more in ({}, {"sensitivity": "gap"}):
        run = vi.simulate(PAPER, initial=START, periods=9, keep=3, **more)
        with pytest.raises(vi.ParameterError, match="each an argument of its own"):
            run.sensitivity(["gap"])


def test_borders_before_the_window_are_told_once():
    # The mass that strikes never slips: friction is on a border at each impact.
    apart = vi.Structure(
        mass=np.eye(2),
        stiffness=np.eye(2),
        stops=[vi.Stop([1, 0], 0.3, 0.6, friction=0.2, tangent=[0, 1])],
        damping_ratios=[0.05, 0.05],
        drive_amplitude=[1, 0],
        drive_frequency=1.2,
    )
    # They are as many as no memory has room for.
    given = {"initial": [[0, 0], [0, 0]], "periods": 10**12, "keep": 9, "max_events": 10**15}
    run = vi.simulate(apart, **given, sensitivity="gap")
    first, *others = run.sensitivity("gap").one_sided
    assert (first.index, first.reason) == (-1, "regime_border")
    assert first.time < apart.drive_period
    assert [mark.index for mark in others] == list(range(len(run.impacts)))
    assert f"and {len(others) - 7} more" in run.sensitivity("gap")._repr_html_()
    whole = vi.simulate(apart, initial=[[0, 0], [0, 0]], periods=50)
    assert len(whole.sensitivity("gap").one_sided) == len(whole.impacts)


def test_progress_is_told(capsys):
    given = {"initial": START, "periods": 3000, "keep": 3, "sensitivity": "gap"}
    vi.simulate(SYSTEMS["chaos"], **given, progress=True)
    assert "3000/3000" in capsys.readouterr().err


def test_copies_compute_them_anew():
    run = vi.simulate(PAPER, initial=START, periods=60, keep=3, sensitivity="gap")
    again = pickle.loads(pickle.dumps(run))
    assert again == run
    assert again.sensitivity("gap") == run.sensitivity("gap")


def test_a_gradient_follows_the_motion_once(monkeypatch):
    def last(run):
        return run.impacts["approach_velocity"][-1]

    whole = vi.gradient(last, PAPER, ["gap", "v1"], initial=START, periods=60)
    fresh(monkeypatch)
    value, slope = vi.gradient(last, PAPER, ["gap", "v1"], initial=START, periods=60, keep=2)
    assert (value, slope) == (whole[0], pytest.approx(whole[1], rel=1e-9))


def test_so_it_is_in_units():
    system = vi.System.from_physical(
        **{"pendulum_mass": 0.3, "oscillator_mass": 0.5, "length": 0.2, "stiffness": 40},
        **{"torsional_stiffness": 1.5, "moment_amplitude": 0.9, "drive_frequency": 16.0},
        **{"gap": 0.1, "restitution": 0.8},
    )
    given = {"initial": START, "time": 3.0, "units": "SI"}
    run = vi.simulate(system, **given, sensitivity="gap")
    assert_same(run, vi.simulate(system, **given), ["gap"])

"""What users of other simulators complain of, each as a test of this one (docs/robustness.md)."""

import importlib.machinery
import math
import re
import tomllib
from pathlib import Path

import numpy as np
import pytest

import repository
import vibroimpact as vi
from systems import PAPER, STICKY
from vibroimpact import _core

GRAVITY = 9.8
START = (0.0, 0.5, 0.0, 0.0)


def ball(restitution: float, height: float = 1.0, **changes: float) -> tuple[vi.System, tuple]:
    """Return a ball that falls onto a wall at rest, and its start at this height."""
    system = vi.System(
        mass_ratio=0,
        frequency_ratio=0,
        restitution=restitution,
        gap=0,
        drive_frequency=0,
        moment_amplitude=GRAVITY,
        contact="direct",
    )
    return system.replace(**changes), (-height, 0.0, 0.0, 0.0)


def gaps(run: vi.Run, states: np.ndarray) -> np.ndarray:
    """Return the gap function g, positive where the bodies overlap."""
    tip = states[:, 0] if run.system.contact == "direct" else np.sin(states[:, 0])
    return tip - states[:, 2] - run.system.gap


def kinds(run: vi.Run) -> list[vi.EventKind]:
    return [vi.EventKind(kind) for kind in run.events["kind"]]


@pytest.mark.parametrize("height", [1e-2, 1e-5, 1e-8, 1e-11])
def test_a_double_crossing_within_a_step_is_not_missed(height):
    """scipy#9228 and diffrax#507: no sign change at the ends of a step, no event."""
    # x1 = sin t would rise above the wall by `height` for a time of 2 sqrt(2 height).
    system = vi.System(
        mass_ratio=0,
        frequency_ratio=1,
        restitution=0.5,
        gap=1 - height,
        drive_frequency=0,
        contact="direct",
    )
    start = (0.0, 1.0, 0.0, 0.0)
    run = vi.simulate(system, initial=start, time=math.pi)
    (impact,) = run.impacts
    # Half the chord, from the wall's own rounded place: cos s = gap.
    half = 2 * math.asin(math.sqrt((1 - system.gap) / 2))
    # A rounding of the gap, over the speed at which it closes.
    rounding = 4 * np.finfo(float).eps / math.sin(half)
    assert abs(impact["time"] - (math.pi / 2 - half)) < rounding
    assert abs(impact["v1_pre"] - math.sin(half)) < rounding
    below = system.replace(gap=1 + height)
    assert vi.simulate(below, initial=start, time=math.pi).impact_count == 0


def test_an_event_at_the_end_of_the_run_is_told_once():
    """scipy#17066: a root at the end of a bracket is an exception, or is told twice."""
    system, start = ball(0.5)
    whole = vi.simulate(system, initial=start, time=1.2)
    for before, time in enumerate(whole.impacts["time"][:4]):
        # The recorded time is rounded, so that the impact may lie on either side of it.
        for end, counts in (
            (math.nextafter(time, 0.0), {before}),
            (time, {before, before + 1}),
            (math.nextafter(time, math.inf), {before + 1}),
        ):
            first = vi.simulate(system, initial=start, time=end)
            assert first.stop_reason == "completed"
            assert first.impact_count in counts
            rest = first.resume(time=1.2 - end)
            joined = np.concatenate([first.impacts, rest.impacts])
            np.testing.assert_array_equal(joined["time"], whole.impacts["time"])


@pytest.mark.parametrize("system", [PAPER, STICKY, PAPER.replace(friction=0.5)])
def test_a_root_is_never_on_the_wrong_side_of_zero(system):
    """DifferentialEquations.jl#551: the state after an event is still past it."""
    run = vi.simulate(system, initial=START, periods=100)
    assert run.impact_count > 50
    times = run.impacts["time"]
    assert (np.diff(times) > 0).all()
    # At the instants, and at the floats on both sides of them.
    near = [times, np.nextafter(times, 0.0), np.nextafter(times, math.inf)]
    window = np.concatenate([t[t < run.final_state.time] for t in near])
    states = run.trajectory(window)
    size = 1 + np.abs(states).max(axis=1)
    assert (gaps(run, states) <= 4 * np.finfo(float).eps * size).all()
    impacts = run.impacts
    slope = np.cos(impacts["x1"])
    assert (impacts["v1_pre"] * slope > impacts["v2_pre"]).all()
    assert (impacts["v1_post"] * slope <= impacts["v2_post"] + 1e-15).all()


def test_two_events_at_one_instant_are_both_told():
    """DiffEqBase#1229: of two events at one instant one is lost."""
    # Chatter ends and the stick begins at once,
    system, start = ball(0.5)
    run = vi.simulate(system, initial=start, time=2)
    assert kinds(run)[-3:] == [vi.EventKind.CHATTER, vi.EventKind.STICK, vi.EventKind.STOP]
    assert run.events["time"][-3] == run.events["time"][-2]
    # a cap between the two loses neither,
    capped = vi.simulate(system, initial=start, time=2, max_events=len(run.events) - 2)
    assert kinds(capped)[-2:] == [vi.EventKind.CHATTER, vi.EventKind.STOP]
    rest = capped.resume(time=2 - capped.final_state.time, max_events=100)
    assert kinds(rest) == [vi.EventKind.STICK, vi.EventKind.STOP]
    # and an impact at a section leaves both: the section shows the state after it.
    fall = math.sqrt(2 / GRAVITY)
    driven, start = ball(0.5, moment_amplitude=0.0, drive_frequency=2 * math.pi / fall)
    thrown = vi.simulate(driven, initial=(-1.0, 1 / fall, 0.0, 0.0), periods=2)
    assert len(thrown.stroboscopic) == 2
    assert thrown.impact_count == 1
    assert thrown.impacts["time"][0] == pytest.approx(fall, rel=4e-16)


@pytest.mark.parametrize("restitution", [0.0, 0.2, 0.5, 0.9])
def test_a_ball_never_falls_through_the_floor(restitution):
    """DifferentialEquations.jl#138, #696, OpenModelica PR#16009: through the floor in the end."""
    system, start = ball(restitution)
    run = vi.simulate(system, initial=start, time=1000)
    assert run.stop_reason == "rest"
    assert run.final_state.state == (0.0, 0.0, 0.0, 0.0)
    states = run.trajectory(np.linspace(0, 20, 20_001))
    assert states[:, 0].max() <= 1e-15
    energy = states[:, 1] ** 2 / 2 - GRAVITY * states[:, 0]
    # The first flight keeps what the ball has, each impact takes some.
    assert energy.max() <= GRAVITY * (1 + 1e-14)
    assert (np.diff(energy) <= 1e-14 * GRAVITY).all()


@pytest.mark.parametrize("restitution", [0.3, 0.9, 0.99])
def test_chatter_neither_sticks_nor_aborts_the_run(restitution):
    """OpenModelica#12190, modypy#32: stuck in, or aborted by, infinitely many events."""
    system, start = ball(restitution)
    run = vi.simulate(system, initial=start, time=1000, max_events=10_000)
    assert run.stop_reason == "rest"
    (chatter,) = run.contacts[run.contacts["kind"] == vi.EventKind.CHATTER]
    fall = math.sqrt(2 / GRAVITY)
    end = fall * (1 + restitution) / (1 - restitution)
    assert abs(chatter["time"] - end) <= chatter["error"] + 4e-16 * run.impact_count * end
    forced = vi.simulate(STICKY, initial=START, periods=200, keep=100)
    assert forced.stop_reason == "completed"
    assert forced.label == "1-inf"


def test_a_contact_that_should_last_does():
    """ModelingToolkit#4822: a contact that should last is left at once."""
    run = vi.simulate(STICKY, initial=START, periods=20, keep=10)
    assert run.time_in_contact > 0.1 * 10 * STICKY.drive_period
    moments = run.contacts["time"]
    kind = run.contacts["kind"]
    held = np.isin(kind, [vi.EventKind.SLIDE_POSITIVE, vi.EventKind.SLIDE_NEGATIVE])
    held |= kind == vi.EventKind.STICK
    begins, ends = moments[:-1][held[:-1]], moments[1:][held[:-1]]
    assert len(begins) >= 20
    for begin, end in zip(begins, ends, strict=True):
        within = np.linspace(begin, end, 12)[1:-1]
        states = run.trajectory(within, forces=True)
        assert (np.abs(gaps(run, states)) < 1e-14).all()
        # It presses throughout, and Coulomb's law bounds the tangential force.
        assert (states[:, 4] >= 0).all()
        assert (np.abs(states[:, 5]) <= STICKY.friction * states[:, 4] * (1 + 1e-12)).all()


def test_the_exponents_of_the_flow_are_those_of_the_stroboscopic_map():
    """ChaosTools#301: the exponent of the stroboscopic map is another than that of the flow."""
    damped = PAPER.replace(drive_frequency=1.1, damping=(0.05, 0.05))
    motion = vi.simulate(damped, initial=START, periods=2000, keep=100).refine()
    assert motion
    # Of the map of m drive periods, per unit time of the flow.
    by_map = np.sort(np.log(np.abs(motion.multipliers)))[::-1] / (motion.m * damped.drive_period)
    flow = vi.lyapunov_spectrum(damped, initial=START, periods=2500, keep=1000)
    transient = math.log(1000) / flow.time
    difference = np.abs(flow.exponents[: len(by_map)] - by_map)
    assert (difference <= 3 * flow.error[: len(by_map)] + transient).all()
    chaotic = PAPER.replace(drive_frequency=1.545, friction=0.5)
    run = vi.simulate(chaotic, initial=START, periods=1000, keep=200)
    spectrum = vi.lyapunov_spectrum(chaotic, initial=START, periods=3000)
    growth = run.period.evidence.growth / chaotic.drive_period
    error = math.hypot(run.period.evidence.growth_error / chaotic.drive_period, spectrum.error[0])
    assert spectrum.exponents[0] > 4 * spectrum.error[0] > 0
    assert abs(growth - spectrum.exponents[0]) < 4 * error


def test_what_was_computed_before_an_early_end_is_kept():
    """siconos#44: a failure throws, and the data so far are lost."""
    # Caps and physical ends are values: all up to there is in the run, which can go on.
    capped = vi.simulate(PAPER, initial=START, periods=100, max_events=30)
    whole = vi.simulate(PAPER, initial=START, periods=100)
    assert capped.stop_reason == "event_cap"
    np.testing.assert_array_equal(capped.impacts, whole.impacts[:30])
    last = capped.resume(periods=100 - capped.final_state.period, max_events=10**6)
    np.testing.assert_array_equal(last.impacts, whole.impacts[30:])
    # A point of a sweep that fails is one point of the sweep.
    moments = [1.0, 1e308, 1.1]
    swept = vi.sweep(PAPER, initial=START, periods=50, moment_amplitude=moments)
    assert swept.status.tolist() == ["completed", "failed", "completed"]
    alone = vi.sweep(PAPER, initial=START, periods=50, moment_amplitude=[1.0, 1.1])
    assert swept.label[[0, 2]].tolist() == alone.label.tolist()


def test_the_package_is_not_tied_to_the_versions_of_its_day():
    """pydstool#171: does not install, or import, with what is current some years later."""
    # The compiled part asks for the stable ABI only: every later CPython loads it.
    file = Path(_core.__file__).name
    assert any(file.endswith(f".abi3{suffix}") for suffix in (".so", ".pyd")) or file == "_core.pyd"
    assert any(file.endswith(suffix) for suffix in importlib.machinery.EXTENSION_SUFFIXES)
    text = (repository.root() / "pyproject.toml").read_text()
    project = tomllib.loads(text)["project"]
    # Lowest versions, and no highest ones.
    assert project["requires-python"].startswith(">=")
    for needed in (project["requires-python"], *project["dependencies"]):
        assert "<" not in needed
        assert "==" not in needed


def test_every_complaint_stands_on_the_page_with_its_test():
    page = (repository.root() / "docs" / "robustness.md").read_text(encoding="utf-8")
    table = page.split("## What users of others complain of", 1)[1]
    named = set(re.findall(r"`(test_\w+)` \|$", table, re.M))
    here = {name for name in globals() if name.startswith("test_")}
    assert named == here - {"test_every_complaint_stands_on_the_page_with_its_test"}

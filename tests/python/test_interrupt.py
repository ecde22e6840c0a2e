"""Ctrl-C ends a long call early and hands over what was done by then."""

import enum
import functools
import inspect
import signal
import sys

import numpy as np
import pytest

import vibroimpact as vi
from ctrl_c import asks_of, ctrl_c_at, ctrl_c_in, interrupted
from vibroimpact import _core
from vibroimpact.interruption import is_covered
from vibroimpact.sweeps import engine

# What has public names.
PARTS = (vi, vi.orbits, vi.sweeps)
# Much more work than is done before Ctrl-C comes.
LONG = {"periods": 5_000_000, "keep": 1, "max_events": 10**9}


def test_an_interrupted_run_can_be_looked_at_and_resumed(system, initial):
    with ctrl_c_at(20_000) as caught:
        vi.simulate(system, initial=initial, **LONG)
    run = caught.value.result
    assert isinstance(run, vi.Run)
    assert run.stop_reason == "interrupted"
    assert run.final_state.period > 0
    assert run.impact_count > 0
    onward = run.resume(periods=3, keep=3)
    assert onward.stop_reason == "completed"
    assert onward.final_state.time > run.final_state.time


def test_a_motion_without_events_can_be_interrupted(system, initial):
    with ctrl_c_at(20_000) as caught:
        vi.simulate(system.replace(gap=5.0), initial=initial, periods=10**11, keep=0)
    assert caught.value.result.impact_count == 0


def test_an_interrupted_resume(system, initial):
    run = vi.simulate(system, initial=initial, periods=3)
    with ctrl_c_at(20_000) as caught:
        run.resume(**LONG)
    assert caught.value.result.final_state.period > 3


def test_interrupted_runs_come_as_a_list(system, initial):
    initials = np.tile(initial, (5, 1))
    with ctrl_c_at(20_000) as caught:
        vi.simulate(system, initial=initials, **LONG, workers=1)
    runs = caught.value.result
    assert 1 <= len(runs) <= 5
    for run in runs:
        assert run.stop_reason == "interrupted"
    assert runs[0].final_state.period > 0


def test_a_diagram_of_long_runs_can_be_interrupted(system, initial):
    with ctrl_c_at(20_000) as caught:
        vi.bifurcation_diagram(system, initial=initial, **LONG, workers=2, gap=[0.5, 0.6])
    assert len(caught.value.result) == 2


@pytest.mark.parametrize("start", ["fresh", "forward", "backward"])
def test_an_interrupted_diagram_keeps_the_points_it_reached(system, initial, start):
    values = np.linspace(1.2, 2.0, 300)
    options = {"initial": initial, "periods": 600, "keep": 2, "start": start, "workers": 1}
    with ctrl_c_at(60_000) as caught:
        vi.bifurcation_diagram(system, **options, drive_frequency=values)
    assert "of 300 cells" in str(caught.value)
    diagram = caught.value.result
    assert diagram.parameter.tolist() == values.tolist()
    pending = diagram.status == "pending"
    assert 0 < np.count_nonzero(~pending) < len(values)
    assert (np.diff(diagram.stroboscopic_offset)[~pending] == 2).all()
    assert (np.diff(diagram.stroboscopic_offset)[pending] == 0).all()
    assert (np.diff(diagram.offset)[pending] == 0).all()
    # What was reached is what an undisturbed call gives there.
    done = np.flatnonzero(~pending)
    if start != "fresh":
        expected = np.arange(len(done))
        assert (
            done.tolist()
            == (expected if start == "forward" else expected + len(values) - len(done)).tolist()
        )
    few = done[:20] if start != "backward" else done[-20:]
    again = vi.bifurcation_diagram(system, **options, drive_frequency=values[few])
    assert diagram.final_states[few].tobytes() == again.final_states.tobytes()


def test_ctrl_c_is_not_lost_in_a_progress_bar(system, initial, monkeypatch):
    values = np.linspace(0.4, 0.6, 1000)
    told = []

    def tell(bar, before, done):
        told.append(done)
        if len(told) == 3:
            signal.raise_signal(signal.SIGINT)

    monkeypatch.setattr(engine, "_advance", tell)
    with interrupted() as caught:
        vi.bifurcation_diagram(
            system, initial=initial, periods=600, keep=1, progress=True, chunk=128, gap=values
        )
    done = np.asarray(caught.value.result.status) != "pending"
    # Nothing is begun after the chunk in which it came.
    assert not done[3 * 128 :].any()


def test_another_exception_of_a_signal_handler_is_raised(system, initial):
    class Alarm(Exception):
        pass

    def ring(*_):
        raise Alarm

    before = signal.signal(signal.SIGINT, ring)
    _core._interrupt_at(20_000)
    try:
        with pytest.raises(Alarm):
            vi.simulate(system, initial=initial, **LONG)
    finally:
        _core._interrupt_at(None)
        signal.signal(signal.SIGINT, before)


@pytest.mark.parametrize("asks", [1, 17, 4_321])
def test_the_same_ask_gives_the_same_part(system, initial, asks):
    parts = []
    for _ in range(2):
        with ctrl_c_at(asks) as caught:
            vi.simulate(system, initial=initial, **LONG)
        parts.append(caught.value.result)
    one, other = parts
    assert one.final_state == other.final_state
    assert one.impact_count == other.impact_count
    assert asks_of(lambda: one.resume(periods=3)) == asks_of(lambda: other.resume(periods=3)) > 1


def test_interrupted_is_a_keyboard_interrupt():
    assert issubclass(vi.Interrupted, KeyboardInterrupt)


def test_an_interrupted_measurement_of_exponents(system, initial):
    with ctrl_c_at(200_000) as caught:
        vi.lyapunov_spectrum(system, initial=initial, periods=5_000_100, keep=5_000_000)
    spectrum = caught.value.result
    assert isinstance(spectrum, vi.LyapunovSpectrum)
    assert spectrum.time > 0.0
    assert np.isfinite(spectrum.exponents).all()
    assert len(spectrum.history) > 0


def test_an_interrupted_refinement(system, initial):
    with ctrl_c_at(200_000) as caught:
        vi.bifurcation_diagram(
            system,
            initial=initial,
            periods=2000,
            refine=15,
            drive_frequency=np.linspace(1.5, 1.6, 60),
        )
    diagram = caught.value.result
    assert isinstance(diagram, vi.Diagram)
    assert len(diagram) >= 60
    assert np.count_nonzero(diagram.status == "completed") > 0


def test_an_interrupted_grid_of_spectra(system, initial):
    with ctrl_c_at(200_000) as caught:
        vi.lyapunov_spectrum(
            system, initial=initial, periods=4000, drive_frequency=np.linspace(1.5, 1.6, 5000)
        )
    sweep = caught.value.result
    assert isinstance(sweep, vi.LyapunovSweep)
    done = sweep.status == "completed"
    assert 0 < np.count_nonzero(done) < len(sweep)
    assert np.isfinite(sweep.exponents[done]).all()
    assert np.isnan(sweep.exponents[~done]).all()


def public_members():
    """Give every public function, and every public member of a class, by name."""
    for name, found in ((name, getattr(part, name)) for part in PARTS for name in part.__all__):
        if inspect.isfunction(found):
            yield name, found
        elif inspect.isclass(found) and not issubclass(found, BaseException | enum.Enum):
            for base in found.__mro__:
                own = base.__module__.startswith("vibroimpact.")
                if own and base.__module__ != "vibroimpact._core":
                    for member, value in vars(base).items():
                        kinds = property | classmethod | staticmethod | functools.cached_property
                        works = inspect.isfunction(value) or isinstance(value, kinds)
                        abstract = getattr(value, "__isabstractmethod__", False)
                        if works and not abstract and not member.startswith("_"):
                            yield f"{base.__name__}.{member}", value


def test_every_public_call_is_covered():
    members = dict(public_members())
    assert len(members) > 100
    assert [name for name, member in members.items() if not is_covered(member)] == []


@pytest.mark.parametrize(
    ("module", "name"),
    [
        ("simulation", "horizon"),
        ("system", "states"),
        ("simulation", "threads"),
        ("simulation", "positive"),
    ],
)
def test_ctrl_c_while_arguments_are_checked(system, initial, monkeypatch, module, name):
    with ctrl_c_in(monkeypatch, sys.modules[f"vibroimpact.{module}"], name) as caught:
        vi.simulate(system, initial=initial, periods=3)
    assert caught.value.result is None


def test_ctrl_c_while_an_array_is_built(system, initial, monkeypatch):
    run = vi.simulate(system, initial=initial, periods=3)
    module = sys.modules["vibroimpact.run_record"]
    with ctrl_c_in(monkeypatch, module, "times_of") as caught:
        run.trajectory([0.0, 1.0])
    assert caught.value.result is None
    with ctrl_c_in(monkeypatch, np, "flatnonzero") as caught:
        run.trajectory([0.0, 1.0])
    assert caught.value.result is None

"""Ctrl-C ends a long call early and hands over what was done by then."""

import _thread
import signal
from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np
import pytest

import vibroimpact as vi
from after_work import AfterWork

# Some twenty seconds of work: long beside the fraction of a second after which Ctrl-C comes, short
# enough to end should Ctrl-C be lost.
LONG = {"periods": 5_000_000, "keep": 1, "max_events": 10**9}


@contextmanager
def ctrl_c(after: float) -> Iterator[None]:
    """Simulate Ctrl-C in the main thread after so many seconds of work."""
    timer = AfterWork(after, _thread.interrupt_main)
    timer.start()
    try:
        yield
    except KeyboardInterrupt:  # Interrupted is caught further in
        pytest.fail("Ctrl-C came out as a plain KeyboardInterrupt")
    finally:
        timer.cancel()
        timer.join()


def test_an_interrupted_run_can_be_looked_at_and_resumed(system, initial):
    with ctrl_c(0.2), pytest.raises(vi.Interrupted) as caught:
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
    with ctrl_c(0.2), pytest.raises(vi.Interrupted) as caught:
        vi.simulate(system.replace(gap=5.0), initial=initial, periods=10**11, keep=0)
    assert caught.value.result.impact_count == 0


def test_an_interrupted_resume(system, initial):
    run = vi.simulate(system, initial=initial, periods=3)
    with ctrl_c(0.2), pytest.raises(vi.Interrupted) as caught:
        run.resume(**LONG)
    assert caught.value.result.final_state.period > 3


def test_interrupted_runs_come_as_a_list(system, initial):
    initials = np.tile(initial, (5, 1))
    with ctrl_c(0.2), pytest.raises(vi.Interrupted) as caught:
        vi.simulate(system, initial=initials, **LONG, workers=1)
    runs = caught.value.result
    assert 1 <= len(runs) <= 5
    for run in runs:
        assert run.stop_reason == "interrupted"
    assert runs[0].final_state.period > 0


def test_a_diagram_of_long_runs_can_be_interrupted(system, initial):
    with ctrl_c(0.2), pytest.raises(vi.Interrupted) as caught:
        vi.bifurcation_diagram(system, initial=initial, **LONG, workers=2, gap=[0.5, 0.6])
    assert len(caught.value.result) == 2


@pytest.mark.parametrize("start", ["fresh", "forward", "backward"])
def test_an_interrupted_diagram_keeps_the_points_it_reached(system, initial, start):
    # A tenth of a second of work per handful of points, a minute for all of them.
    values = np.linspace(1.2, 2.0, 100_000)
    options = {"initial": initial, "periods": 600, "keep": 2, "start": start, "workers": 2}
    with ctrl_c(0.5), pytest.raises(vi.Interrupted, match="of 100000 cells") as caught:
        vi.bifurcation_diagram(system, **options, drive_frequency=values)
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


def test_ctrl_c_is_not_lost_in_a_progress_bar(system, initial):
    values = np.linspace(0.4, 0.6, 1000)
    with ctrl_c(0.3), pytest.raises(vi.Interrupted) as caught:
        vi.bifurcation_diagram(
            system, initial=initial, periods=20_000, keep=1, progress=True, gap=values
        )
    done = np.asarray(caught.value.result.status) != "pending"
    assert np.count_nonzero(done) < len(values) - 128
    # Nothing is begun after the chunk in which it came.
    assert not done[np.flatnonzero(~done)[0] + 128 :].any()


def test_another_exception_of_a_signal_handler_is_raised(system, initial):
    class Alarm(Exception):
        pass

    def ring(*_):
        raise Alarm

    before = signal.signal(signal.SIGALRM, ring)
    try:
        signal.setitimer(signal.ITIMER_REAL, 0.2)
        with pytest.raises(Alarm):
            vi.simulate(system, initial=initial, **LONG)
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, before)


def test_interrupted_is_a_keyboard_interrupt():
    assert issubclass(vi.Interrupted, KeyboardInterrupt)


def test_an_interrupted_measurement_of_exponents(system, initial):
    with ctrl_c(0.4), pytest.raises(vi.Interrupted) as caught:
        vi.lyapunov_spectrum(system, initial=initial, periods=5_000_100, keep=5_000_000)
    spectrum = caught.value.result
    assert isinstance(spectrum, vi.LyapunovSpectrum)
    assert spectrum.time > 0.0
    assert np.isfinite(spectrum.exponents).all()
    assert len(spectrum.history) > 0


def test_an_interrupted_refinement(system, initial):
    with ctrl_c(0.4), pytest.raises(vi.Interrupted) as caught:
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
    with ctrl_c(0.4), pytest.raises(vi.Interrupted) as caught:
        vi.lyapunov_spectrum(
            system, initial=initial, periods=4000, drive_frequency=np.linspace(1.5, 1.6, 5000)
        )
    sweep = caught.value.result
    assert isinstance(sweep, vi.LyapunovSweep)
    done = sweep.status == "completed"
    assert 0 < np.count_nonzero(done) < len(sweep)
    assert np.isfinite(sweep.exponents[done]).all()
    assert np.isnan(sweep.exponents[~done]).all()

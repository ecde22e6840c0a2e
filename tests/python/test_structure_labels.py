"""Labels of runs of structures that settle within the run, or after it."""

import numpy as np
import pytest

import vibroimpact as vi
from struck import OSCILLATOR, REST

CHAIN = vi.Structure(
    np.eye(2).tolist(),
    [[2, -1], [-1, 2]],
    [vi.Stop([1, 0], 0.4, 0.7), vi.Stop([0, 1], 0.4, 0.7)],
    damping_ratios=0.05,
    drive_amplitude=[1, 0],
    drive_frequency=1.3,
)


@pytest.mark.parametrize("periods", [20, 50, 100, 150, 190, 200])
def test_a_run_that_settles_has_the_label_of_its_motion(periods):
    """The first periods have other numbers of impacts: the whole window shows no return."""
    run = vi.simulate(OSCILLATOR, initial=[[0], [-1]], periods=periods)
    assert run.label == "1-1"
    motion = run.refine()
    assert motion
    assert motion.stable


@pytest.mark.parametrize("periods", [30, 100, 199])
def test_the_same_holds_in_a_sweep(periods):
    values = [1.2, 1.3]
    short = vi.sweep(CHAIN, initial=REST[2], periods=periods, drive_frequency=values)
    long = vi.sweep(CHAIN, initial=REST[2], periods=2000, keep=200, drive_frequency=values)
    assert "unresolved" not in long.label.tolist()
    assert short.label.tolist() == long.label.tolist()


# A frame of two storeys, the upper one beside a wall.
FRAME = vi.Structure(
    np.diag([2.0, 1.0]),
    [[300, -100], [-100, 100]],
    [vi.Stop([0, 1], 0.02, 0.65)],
    damping_ratios=0.03,
    drive_amplitude=[3, 0],
    drive_frequency=9,
)


def labels_of_frame(frequency, *lengths):
    """Return the labels of runs of these periods and kept periods, from rest."""
    frame = FRAME.replace(drive_frequency=frequency)
    runs = [vi.simulate(frame, initial=REST[2], periods=p, keep=k) for p, k in lengths]
    return [run.label for run in runs]


@pytest.mark.parametrize(
    ("frequency", "label"),
    [(13.601504, "1-1"), (13.604, "1-1"), (13.608, "1-1"), (6.629073, "51-100")],
)
def test_a_slow_spiral_is_no_torus(frequency, label):
    """Its perturbations shrink by less in some hundred periods than a shear would let them grow."""
    frame = FRAME.replace(drive_frequency=frequency)
    short = vi.simulate(frame, initial=REST[2], periods=600, keep=100)
    assert short.label == label
    assert str(short.period.evidence.kind) == "converging"
    assert short.period.evidence.further > 0
    settled = vi.simulate(frame, initial=REST[2], periods=20_000, keep=400)
    assert settled.label == label
    assert str(settled.period.evidence.kind) == "returned"
    assert settled.refine().stable


def test_a_slow_drift_along_a_torus_is_no_convergence():
    """The torus has just ceased to exist: the motion passes it in some 80,000 periods."""
    frequency = np.linspace(5, 18, 400)[263]
    long = labels_of_frame(frequency, (30_000, 10_000), (60_000, 10_000), (100_000, 1_000))
    assert long == ["quasi-periodic", "quasi-periodic", "5-4"]


@pytest.mark.parametrize("frequency", [10.208125, 10.395])
def test_a_motion_that_alternates_about_its_orbit_has_no_double_period(frequency):
    """Its largest multiplier is -0.999: sections two periods apart draw together steadily."""
    assert labels_of_frame(frequency, (600, 100), (20_000, 2_000)) == ["1-1", "1-1"]


def test_past_the_period_doubling_the_label_has_the_double_period():
    assert labels_of_frame(10.386875, (600, 100), (20_000, 2_000)) == ["2-2", "2-2"]


@pytest.mark.parametrize("ratio", [1e-8, 1e-6, 1e-4, 1e-2])
def test_the_weakest_damping_tells_a_periodic_motion_from_a_torus(ratio):
    """The motion never meets its stop: exp(-ratio w T) per drive period is exact."""
    free = vi.Structure(
        [[1]],
        [[1]],
        [vi.Stop([1], 50, 0.8)],
        damping_ratios=ratio,
        drive_amplitude=[1],
        drive_frequency=1.37,
    )
    run = vi.simulate(free, initial=[[0], [0]], periods=600, keep=100)
    assert run.label == "1-0"
    decay = ratio * free.drive_period
    assert -np.log(run.period.evidence.rate) == pytest.approx(decay, rel=0.03)


def test_without_damping_a_torus_stays_one():
    free = vi.Structure(
        np.eye(2),
        [[2, -1], [-1, 1.5]],
        [vi.Stop([1, 0], 50, 0.8)],
        drive_amplitude=[1, 0],
        drive_frequency=1.37,
    )
    assert vi.simulate(free, initial=REST[2], periods=600, keep=100).label == "quasi-periodic"


@pytest.mark.parametrize(("frequency", "part"), [(6.629073, 0.5), (13.63408521303258, 0.25)])
def test_a_run_that_ends_within_a_drive_period_goes_on_from_there(frequency, part):
    """With the phase of its start it would go on as another motion."""
    frame = FRAME.replace(drive_frequency=frequency)
    within = vi.simulate(frame, initial=REST[2], time=(600 + part) * frame.drive_period)
    whole = vi.simulate(frame, initial=REST[2], periods=601)
    assert within.label == whole.label != "chaotic"

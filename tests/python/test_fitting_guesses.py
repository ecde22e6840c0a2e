"""Fits from poor first guesses, steps that bounds stop, and times or frequencies in other units."""

import numpy as np
import pytest

import vibroimpact as vi
from vibroimpact.fitting.steps import Linear, step

GRAVITY, DROPPED, RESTITUTION = 9.81, 0.31, 0.75
# A ball that falls from a height of 1, some time after the clock was started.
FLIGHT = np.sqrt(2.0 / GRAVITY)
SOUNDS = DROPPED + FLIGHT * (1.0 + 2.0 * np.cumsum([0.0, *RESTITUTION ** np.arange(1, 9)]))
ERRORS = 1e-3 * np.array([3, -2, 5, -4, 1, 0, -6, 2, 4])
STRUCTURE_START = np.zeros((2, 2))


@pytest.mark.parametrize("restitution", [0.5, 0.9])
@pytest.mark.parametrize("height", [0.05, 0.3, 0.5, 0.8, 4.0])
def test_a_ball_is_heard_from_poor_guesses(height, restitution):
    ball = vi.Structure(
        [[0.05]], [[0]], [vi.Stop([1], 0, restitution)], static_load=[0.05 * GRAVITY]
    )
    record = vi.Record("impact_times", SOUNDS + ERRORS, sigma=4e-3)
    unknown = ["restitution", "q_0", "v_0"]
    found = vi.fit(record, ball, unknown=unknown, initial=[[-height], [0]])
    assert found.verdict == "fits"
    # The motion that was heard was a fall from q_0 = -1 on, at t = DROPPED.
    start = [GRAVITY * DROPPED**2 / 2 - 1.0, -GRAVITY * DROPPED]
    off = (found.estimates - [RESTITUTION, *start]) / found.standard_errors
    assert np.abs(off).max() < 3.0
    # What counts as large is told by the motion, not by the guess v_0 = 0.
    assert found.sizes[2] > 3.0


def test_a_step_lowers_what_is_minimised_wherever_bounds_stop_it():
    random = np.random.default_rng(5)
    stopped = 0
    for _ in range(300):
        count = int(random.integers(1, 7))
        matrix = random.standard_normal((count + 2, count)) * 10.0 ** random.uniform(-2, 2, count)
        residuals = 10.0 * random.standard_normal(count + 2)
        low, high = -random.random(count), random.random(count)
        low[random.random(count) < 0.1] = 0.0
        linear = Linear(residuals, matrix, np.zeros(0), np.zeros((0, count)))
        taken = step(linear, 1e-12, np.ones(count), low, high)
        assert (low <= taken).all()
        assert (taken <= high).all()
        stopped += bool(((taken == low) | (taken == high)).any())
        after = residuals + matrix @ taken
        assert after @ after <= residuals @ residuals * (1 + 1e-12)
    assert stopped > 200


def _rig(c2=0.3, restitution=0.5, gap=0.008, drive=2 * np.pi * 5.3):
    return vi.Structure(
        np.diag([0.8, 0.5]),
        [[1500, -600], [-600, 600]],
        [vi.Stop([0, 1], gap, restitution)],
        damping=[[0.9 + c2, -c2], [-c2, c2]],
        drive_amplitude=[3, 0],
        drive_frequency=drive,
    )


@pytest.mark.parametrize("kind", ["q_1", "impact_times"])
@pytest.mark.parametrize(("by", "asked"), [(1 / (2 * np.pi), "Hz"), (2 * np.pi, "once too often")])
def test_a_frequency_in_hertz_is_asked_about(kind, by, asked):
    run = vi.simulate(_rig(0.7, 0.72, 0.006), initial=STRUCTURE_START, time=3.0)
    how = {"noise": 1e-4} if kind == "impact_times" else {"noise": 6e-5, "sampling": 5e-3}
    record = vi.measure(run, kind, **how)
    drive = run.system.drive_frequency

    def machine(restitution=0.5, gap=0.008):
        return _rig(0.7, restitution, gap, drive * by)

    unknown = ["restitution", "gap"]
    found = vi.fit(record, machine, unknown=unknown, initial=STRUCTURE_START, starts=1)
    (said,) = [each for each in found.reasons if "goes with" in each]
    assert said.startswith(f"{kind} goes with the frequency {drive:.6g}, and drive_frequency is ")
    assert asked in said
    right = vi.fit(record, _rig(0.7), unknown=unknown, initial=STRUCTURE_START, starts=1)
    assert not [each for each in right.reasons if "goes with" in each]


@pytest.mark.parametrize(("by", "told"), [(1e3, "are 5 apart"), (1e-3, "are 5e-06 apart")])
def test_times_of_a_trace_in_other_units_are_asked_about(by, told):
    run = vi.simulate(_rig(), initial=STRUCTURE_START, time=1.0)
    record = vi.measure(run, "q_1", noise=6e-5, sampling=5e-3)
    other = vi.Record("q_1", record.times * by, record.values, sigma=6e-5)
    found = vi.fit(other, _rig(), unknown=["gap"], initial=STRUCTURE_START, starts=1)
    (said,) = [each for each in found.reasons if each.endswith("are the times in other units?")]
    assert told in said


RIVAL = vi.System(
    mass_ratio=0.8,
    frequency_ratio=1.5,
    restitution=0.7,
    gap=0.3,
    drive_frequency=1.2,
    moment_amplitude=1,
    friction=0.3,
    damping=(0.03, 0.05),
)


@pytest.mark.parametrize(("noise", "seed"), [(0.03, 260), (0.06, 380), (0.06, 390)])
def test_another_motion_that_explains_a_record_as_well_is_told(noise, seed):
    # Of eleven times two sequences of impacts have minima of one chi2, and far apart.
    run = vi.simulate(RIVAL, initial=(0, 0.3, 0.05, 0.1), periods=8)
    record = vi.measure(run, "impact_times", noise=noise, seed=seed)
    guess = RIVAL.replace(restitution=0.6, friction=0.2, gap=0.33)
    unknown = ["restitution", "friction", "gap"]
    found = vi.fit(record, guess, unknown=unknown, initial=run.initial)
    assert "another motion may be the right one" in found.reasons[0]
    # The true values are within errors that hold both minima.
    off = (found.estimates - [0.7, 0.3, 0.3]) / found.standard_errors
    assert np.abs(off).max() < 3.0
    assert found.errors["restitution"] > 0.03
    assert found.standard_errors == pytest.approx(np.sqrt(np.diag(found.covariance)))


def test_an_error_in_a_flat_valley_is_taken_from_where_chi2_rises():
    run = vi.simulate(RIVAL, initial=(0, 0.3, 0.05, 0.1), periods=8)
    record = vi.measure(run, "impact_times", noise=0.06, seed=90)
    unknown = ["restitution", "friction", "gap"]
    found = vi.fit(record, RIVAL, unknown=unknown, initial=run.initial, starts=1)
    (told,) = [each for each in found.reasons if "error of restitution" in each]
    assert told.endswith("; it is taken from where it does")
    held = found.machine.replace(
        restitution=found.values["restitution"] - 2 * found.errors["restitution"]
    )
    others = vi.fit(record, held, unknown=unknown[1:], initial=run.initial)
    assert others.chi2 - found.chi2 == pytest.approx(4.0, abs=2.0)

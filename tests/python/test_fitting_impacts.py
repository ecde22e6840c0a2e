"""Fits of records with other impacts than those of the motion, and many constraints."""

import numpy as np
import pytest
from matplotlib import pyplot

import vibroimpact as vi
from systems import PAPER
from vibroimpact.fitting.steps import Linear, multipliers, step

START = (0, 0.5, 0, 0)
RUN = vi.simulate(PAPER, initial=START, periods=30)
HEARD = vi.measure(RUN, "impact_times", noise=0.002, seed=1)
GUESS = PAPER.replace(restitution=0.6, gap=0.45)
UNKNOWN = ["restitution", "gap"]
CHATTERING = vi.System(
    mass_ratio=1.1542,
    frequency_ratio=0.8504,
    restitution=0.7541,
    gap=0.0858,
    drive_frequency=0.8181,
    moment_amplitude=1.7977,
    force_amplitude=0.1534,
    friction=0.2989,
    damping=(0.0265, 0.0392),
)
CHATTERS = (0, 0.1398, 0, 0)


def _found(times, **options):
    record = vi.Record("impact_times", times, sigma=0.002)
    return vi.fit(record, GUESS, unknown=UNKNOWN, initial=START, **options)


def _off(found):
    return np.abs(found.estimates - [0.8, 0.5]) / found.standard_errors


@pytest.mark.parametrize("row", [0, 5, 12, 19, 26])
def test_an_impact_that_was_not_heard_is_told(row):
    found = _found(np.delete(HEARD.times, row))
    assert found.verdict == "other impacts"
    assert found.extra_impacts == pytest.approx(HEARD.times[[row]], abs=0.02)
    assert not len(found.missing_impacts)
    assert (
        f"the motion has 1 impact that is not in the record, at t = {found.extra_impacts[0]:.6g}"
        in (found.reasons[0])
    )
    assert found.dof == len(HEARD) - 1 - 2
    # Values and errors are those of the impacts that were heard.
    assert found.probability > 0.01
    assert (_off(found) < 3.0).all()


def test_a_sound_that_was_no_impact_changes_no_value():
    whole = _found(HEARD.times)
    knock = 0.5 * (HEARD.times[20] + HEARD.times[21])
    found = _found(np.sort([*HEARD.times, knock]))
    assert found.verdict == "other impacts"
    assert found.missing_impacts.tolist() == [knock]
    assert not len(found.extra_impacts)
    assert found.estimates == pytest.approx(whole.estimates, rel=1e-6)
    assert found.standard_errors == pytest.approx(whole.standard_errors, rel=1e-3)
    assert found.chi2 == pytest.approx(whole.chi2, rel=1e-3)


def test_both_are_marked_in_the_picture_and_kept_in_files(tmp_path):
    knock = 0.5 * (HEARD.times[20] + HEARD.times[21])
    found = _found(np.sort([*np.delete(HEARD.times, 12), knock]))
    top, _ = found.plot()
    drawn = {line.get_label(): line.get_xdata() for line in top.lines}
    assert drawn["measured only"].tolist() == [knock]
    assert drawn["of the machine only"].tolist() == found.extra_impacts.tolist()
    pyplot.close(top.figure)
    found.save(tmp_path / "fit.npz")
    assert vi.load(tmp_path / "fit.npz") == found


def test_the_run_has_all_impacts_that_were_fitted():
    for seed in range(6):
        heard = vi.measure(RUN, "impact_times", noise=0.002, seed=seed)
        found = _found(heard.times, starts=1)
        assert len(found.run.impacts) == len(heard)
        assert found.run.impacts["time"] == pytest.approx(found.predicted, rel=1e-12)


def test_impacts_too_near_to_be_told_apart_are_named():
    run = vi.simulate(CHATTERING, initial=CHATTERS, periods=8)
    bouncing = vi.measure(run, "impact_times", noise=0.005, seed=42)
    assert np.diff(bouncing.times).min() < 0.005
    guess = CHATTERING.replace(restitution=0.8967, gap=0.0849)
    options = {"unknown": UNKNOWN, "initial": CHATTERS, "starts": 1}
    found = vi.fit(bouncing, guess, **options)
    (said,) = [reason for reason in found.reasons if "such impacts are not told apart" in reason]
    assert "came within 6 standard errors of the one before" in said
    # The resolution that is advised leaves them out.
    resolution = float(said.split("resolution=")[1].split()[0])
    clear = vi.Record("impact_times", bouncing.times, sigma=0.005, resolution=resolution)
    assert vi.fit(clear, guess, **options).verdict == "fits"


def test_other_minima_are_looked_for_where_something_stays_open():
    # An unknown speed of a knot: the knot may lie where no impact tells of it.
    table = vi.RestitutionTable([0.6, 1.2, 2.4], [0.9, 0.8, 0.45])
    system = PAPER.replace(restitution=table, friction=0.2)
    run = vi.simulate(system, initial=START, periods=15)
    records = [
        vi.measure(run, "x1", sampling=0.2, noise=0.01, seed=0),
        vi.measure(run, "impact_times", noise=0.005, seed=1),
    ]
    unknown = ["r_0", "r_1", "r_2", "speed_1", "gap"]
    guess = system.replace(r_0=0.8, r_1=0.7, r_2=0.6, speed_1=1.4)
    found = vi.fit(records, guess, unknown=unknown, initial=START)
    first = vi.fit(records, guess, unknown=unknown, initial=START, starts=1)
    assert first.verdict == "not identifiable"
    assert found.chi2 < first.chi2 - 5.0
    known = np.isfinite(found.standard_errors)
    off = (found.estimates - [0.9, 0.8, 0.45, 1.2, 0.5])[known] / found.standard_errors[known]
    assert np.abs(off).max() < 4.0


def test_steps_of_many_segments_are_at_their_minimum():
    random = np.random.default_rng(3)
    size, unknown = 4, 2
    turned = np.linalg.qr(random.standard_normal((size, size)))[0]
    # One direction grows from segment to segment, as in a chaotic motion.
    growth = turned @ np.diag([3.0, 0.9, 0.5, 0.3]) @ turned.T
    for segments in (1, 3, 40):
        count = unknown + size * segments
        constraint = np.zeros((size * segments, count))
        for k in range(segments):
            rows, own = slice(size * k, size * (k + 1)), unknown + size * k
            constraint[rows, :unknown] = random.standard_normal((size, unknown))
            constraint[rows, own : own + size] = -np.eye(size)
            if k:
                constraint[rows, own - size : own] = growth
        derivative = random.standard_normal((3 * count, count))
        residuals = random.standard_normal(len(derivative))
        defects = 1e-3 * random.standard_normal(len(constraint))
        linear = Linear(residuals, derivative, defects, constraint)
        wide = np.full(count, np.inf)
        taken = step(linear, 0.0, np.ones(count), -wide, wide)
        # The conditions of the minimum: Nocedal, Wright, section 16.1.
        assert np.abs(constraint @ taken + defects).max() < 1e-11 * np.abs(taken).max()
        slope = derivative.T @ (residuals + derivative @ taken)
        slack = multipliers(linear, taken)
        assert np.abs(slope + constraint.T @ slack).max() < 1e-10 * np.abs(slope).max()


def test_steps_with_constraints_that_depend_on_each_other_stay_finite():
    constraint = np.array([[1.0, 2.0, 3.0], [2.0, 4.0, 6.0]])
    linear = Linear(np.ones(3), np.eye(3), np.array([0.1, 0.2]), constraint)
    wide = np.full(3, np.inf)
    taken = step(linear, 1e-3, np.ones(3), -wide, wide)
    assert np.isfinite(taken).all()
    assert constraint @ taken == pytest.approx([-0.1, -0.2])

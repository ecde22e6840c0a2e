"""Machines found from records: true values, errors that hold, verdicts, and what stays open."""

import sys

import numpy as np
import pytest

import repository
import vibroimpact as vi
from small_results import START
from systems import PAPER

sys.path.insert(0, str(repository.root() / "examples"))

from fit_coverage import fitted

RUBBING = PAPER.replace(friction=0.2)
CHAOTIC = PAPER.replace(drive_frequency=1.9, friction=0.05)


def wrong_by(found: vi.Fit, system: vi.System, initial=START) -> np.ndarray:
    """By how many standard errors the values found are wrong."""
    true = dict(zip(("x1", "v1", "x2", "v2"), initial, strict=True)) | system.to_dict()
    return np.array([(found.values[n] - true[n]) / found.errors[n] for n in found.names])


def test_true_values_lie_within_the_stated_errors():
    # The first of those of examples/fit_coverage.py, which draws 200.
    verdicts, off = fitted(25)
    deviations = np.concatenate([*off.values()])
    assert verdicts["fits"] + verdicts["not identifiable"] >= 22
    inside = np.mean(np.abs(deviations) <= 2.0)
    assert 0.92 <= inside <= 0.98


def test_restitution_and_friction_from_thirty_times_of_impacts():
    run = vi.simulate(RUBBING, initial=START, periods=32)
    heard = vi.measure(run, "impact_times", noise=1e-3, seed=5)
    heard = vi.Record("impact_times", heard.times[:30], sigma=1e-3)
    guess = RUBBING.replace(restitution=0.6, friction=0.4)
    found = vi.fit(heard, guess, unknown=["restitution", "friction"], initial=START)
    assert found.verdict == "fits"
    assert found.values["restitution"] == pytest.approx(0.8, rel=0.01)
    assert found.values["friction"] == pytest.approx(0.2, rel=0.01)
    assert np.abs(wrong_by(found, RUBBING)).max() < 4.0


def test_a_record_without_noise_gives_the_numbers():
    run = vi.simulate(RUBBING, initial=START, periods=20)
    for kind, options in (("impact_times", {}), ("x1", {"sampling": 0.2})):
        guess = RUBBING.replace(restitution=0.7, friction=0.3, gap=0.45)
        found = vi.fit(
            vi.measure(run, kind, **options),
            guess,
            unknown=["restitution", "friction", "gap"],
            initial=START,
        )
        assert found.estimates == pytest.approx([0.8, 0.2, 0.5], rel=1e-7)


def test_a_chaotic_record_of_ten_lyapunov_times_is_fitted():
    exponent = vi.lyapunov_spectrum(CHAOTIC, initial=START, periods=1000).exponents[0]
    length = 10.0 / exponent
    assert exponent > 0.01
    run = vi.simulate(CHAOTIC, initial=START, time=length)
    exact = vi.measure(run, "x1", sampling=0.2)
    record = vi.measure(run, "x1", sampling=0.2, noise=0.01 * float(exact.values.std()), seed=2)
    guess = CHAOTIC.replace(restitution=0.75, friction=0.1, gap=0.45)
    found = vi.fit(
        record, guess, unknown=["restitution", "friction", "gap", "start"], initial=(0, 0.4, 0, 0)
    )
    assert found.verdict == "fits"
    assert len(found.segments) > 2
    assert np.abs(wrong_by(found, CHAOTIC)).max() < 4.0
    assert found.errors["restitution"] < 1e-3
    # Times of impacts alone, with one per cent of the drive period.
    heard = vi.measure(run, "impact_times", noise=0.01, seed=2)
    found = vi.fit(
        heard, guess, unknown=["restitution", "friction", "gap", "start"], initial=(0, 0.4, 0, 0)
    )
    assert found.verdict in ("fits", "not identifiable")
    assert np.abs(wrong_by(found, CHAOTIC)).max() < 4.0


def test_the_drive_frequency_is_found_through_segments():
    run = vi.simulate(CHAOTIC, initial=START, periods=60)
    record = vi.measure(run, "x1", sampling=0.2, noise=3e-3, seed=4)
    guess = CHAOTIC.replace(drive_frequency=1.89)
    found = vi.fit(record, guess, unknown=["drive_frequency", "phase", "gap"], initial=START)
    assert found.verdict == "fits"
    assert np.abs(wrong_by(found, CHAOTIC)).max() < 4.0


def test_several_records_of_one_motion():
    run = vi.simulate(RUBBING, initial=START, periods=15)
    records = [
        vi.measure(run, "impact_times", noise=1e-2, seed=1),
        vi.measure(run, "x2", noise=2e-3, sampling=0.3, seed=2),
    ]
    names = ["restitution", "friction", "gap", "mass_ratio"]
    guess = RUBBING.replace(mass_ratio=0.7, gap=0.45)
    found = vi.fit(records, guess, unknown=names, initial=START)
    assert found.verdict == "fits"
    assert np.abs(wrong_by(found, RUBBING)).max() < 4.0
    one = vi.fit(records[1], guess, unknown=names, initial=START)
    assert (found.standard_errors < one.standard_errors).all()


def test_unknown_errors_are_estimated():
    run = vi.simulate(RUBBING, initial=START, periods=20)
    measured = vi.measure(run, "x1", noise=4e-3, sampling=0.1, seed=8)
    silent = vi.Record("x1", measured.times, measured.values)
    found = vi.fit(silent, RUBBING, unknown=["restitution", "gap"], initial=START)
    told = vi.fit(measured, RUBBING, unknown=["restitution", "gap"], initial=START)
    assert found.verdict == told.verdict == "fits"
    assert found.probability is None
    assert found.sigma == pytest.approx(4e-3, rel=0.1)
    assert found.estimates == pytest.approx(told.estimates, abs=1e-6)
    assert found.standard_errors == pytest.approx(told.standard_errors, rel=0.1)


def test_outliers_spoil_least_squares_and_not_a_robust_loss():
    run = vi.simulate(RUBBING, initial=START, periods=20)
    measured = vi.measure(run, "x1", noise=2e-3, sampling=0.1, seed=8)
    values = measured.values.copy()
    values[::25] += 0.2
    record = vi.Record("x1", measured.times, values, sigma=2e-3)
    names = ["restitution", "friction", "gap"]
    assert vi.fit(record, RUBBING, unknown=names, initial=START, starts=1).verdict != "fits"
    for loss in ("huber", "soft_l1", "cauchy"):
        found = vi.fit(record, RUBBING, unknown=names, initial=START, loss=loss)
        assert found.verdict == "fits"
        assert "outlier" in found.summary()
        assert np.abs(wrong_by(found, RUBBING)).max() < (4.0 if loss == "cauchy" else 12.0)


def test_another_machine_is_not_called_a_fit():
    # The record is of a heavier damped machine than the one that is offered.
    run = vi.simulate(RUBBING.replace(pendulum_damping=0.05), initial=START, periods=20)
    record = vi.measure(run, "x1", noise=2e-3, sampling=0.1, seed=8)
    found = vi.fit(record, RUBBING, unknown=["restitution", "gap"], initial=START)
    assert not found
    assert found.verdict == "systematic residuals"
    assert "not random" in found.summary()


def test_errors_that_are_stated_too_small_are_told():
    run = vi.simulate(RUBBING, initial=START, periods=20)
    measured = vi.measure(run, "x1", noise=4e-3, sampling=0.1, seed=8)
    record = vi.Record("x1", measured.times, measured.values, sigma=2e-3)
    found = vi.fit(record, RUBBING, unknown=["restitution", "gap"], initial=START, starts=1)
    assert found.verdict == "residuals too large"
    honest = vi.fit(measured, RUBBING, unknown=["restitution", "gap"], initial=START)
    assert found.standard_errors == pytest.approx(honest.standard_errors, rel=0.1)


def test_what_a_record_cannot_tell_apart_is_named():
    # In flight alone the restitution has no part, and a moment and its unit are not told apart.
    still = PAPER.replace(gap=5.0)
    run = vi.simulate(still, initial=START, periods=4)
    record = vi.measure(run, "x1", noise=1e-3, sampling=0.1)
    found = vi.fit(record, still, unknown=["restitution", "moment_amplitude"], initial=START)
    assert found.verdict == "not identifiable"
    (open_one,) = found.undetermined
    assert [*open_one] == ["restitution"]
    assert np.isinf(found.errors["restitution"])
    assert found.errors["moment_amplitude"] < 1e-3
    said = found.summary()
    assert "the record says nothing about restitution\nfix what you know of these" in said
    assert found.sizes == pytest.approx([0.8, 1.0], rel=1e-3)
    assert np.isfinite(found.correlation).all()


def test_what_changes_together_is_told_in_the_numbers_of_the_unknowns():
    # Along what is told, by so much, the residuals change by their error.
    run = vi.simulate(PAPER, initial=START, periods=8)
    record = vi.measure(run, "impact_times", noise=0.1)
    names = ["restitution", "gap", "moment_amplitude", "frequency_ratio", "mass_ratio"]
    known = vi.expected_errors(run, record, unknown=names)
    (row,), (error,) = known.combinations, known.combination_errors
    moved = dict(zip(names, row * error * known.sizes, strict=True))
    *_, told, advice = known.summary().splitlines()
    together = ", ".join(f"{name} {moved[name]:+.2g}" for name in known.undetermined[0])
    assert told.endswith(f"together, the record changes within its errors: {together}")
    assert advice == "fix what you know of these, or measure more"
    rises = []
    for part in (1e-3, 2e-3):
        there = PAPER.replace(**{n: getattr(PAPER, n) + part * by for n, by in moved.items()})
        times = vi.simulate(there, initial=START, periods=8).impacts["time"]
        rises.append((((times - run.impacts["time"]) / 0.1) ** 2).sum() / part**2)
    assert rises[0] == pytest.approx(1.0, rel=0.05)
    assert rises[1] == pytest.approx(1.0, rel=0.05)


def test_times_in_other_units_are_asked_about():
    rig = vi.System.from_physical(
        **{"pendulum_mass": 3, "oscillator_mass": 5, "length": 0.1, "torsional_stiffness": 500},
        **{"stiffness": 50e3, "gap": 0.05, "restitution": 0.8, "drive_frequency": 180},
        **{"moment_amplitude": 300, "torsional_damping": 0.1, "damping": 40, "friction": 0.2},
    )
    run = vi.simulate(rig, initial=START, periods=20)
    seconds = run.in_si().impacts["time"][:10]
    asked = {"unknown": ["restitution"], "starts": 1}
    si = {"initial": (0, 50, 0, 0), "units": "SI"}
    ms = vi.fit(vi.Record("impact_times", 1000 * seconds), rig, **asked, **si)
    *_, asks, advice = ms.reasons
    assert "impact_times: impacts follow each other after 3.4" in asks
    assert "a period of the machine is 3.49: are they in other units?" in asks
    assert advice == "this is the best of 1 search; starts=5 makes more"
    forgotten = vi.fit(vi.Record("impact_times", seconds), rig, **asked, initial=START)
    assert "are they in other units?" in forgotten.reasons[-3]
    assert forgotten.reasons[-1] == (
        "without units='SI' all numbers are dimensionless, also those of a system made in SI: 1 "
        "means 0.01 s, 100 rad/s, 0.1 m"
    )
    right = vi.fit(vi.Record("impact_times", seconds), rig, **asked, **si)
    assert not any("units" in reason for reason in right.reasons)


def test_bounds_hold():
    run = vi.simulate(RUBBING, initial=START, periods=10)
    record = vi.measure(run, "x1", noise=2e-3, sampling=0.1)
    guess = RUBBING.replace(restitution=0.7)
    ranges = {"restitution": (0.2, 0.78), "gap": None}
    found = vi.fit(record, guess, unknown=ranges, initial=START, starts=1)
    assert found.values["restitution"] == 0.78
    assert found.at_bounds == ("restitution",)
    assert not found


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"unknown": ["restitutoin"]}, "did you mean"),
        ({"unknown": []}, "at least one"),
        ({"unknown": ["gap", "gap"]}, "each name once"),
        ({"unknown": {"gap": (0.6, 0.7)}}, "gap = 0.5, from which the search starts"),
        ({"unknown": {"restitution": (0.5, 1.5)}}, r"inside \[0, 1\]"),
        ({"unknown": {"gap": (1, 0)}}, "low < high"),
        ({"unknown": 3}, "list of names"),
        ({"loss": "l2"}, "'huber'"),
        ({"starts": 0}, "starts"),
        ({"units": "SI"}, r"^units = 'SI' .* None for a system without scales: .*from_physical"),
        ({"record": []}, "record"),
        ({"record": vi.Record("q_0", [0.0], [0.0])}, "kind = 'q_0'"),
        ({"record": vi.Record("x1", [0.0, 1e9], [0.0, 0.0])}, r"times\[1\] = 1000000000.0"),
    ],
)
def test_wrong_arguments_are_named(change, said):
    given = {
        "record": vi.Record("x1", [0.0, 1.0], [0.0, 0.4]),
        "system": PAPER,
        "unknown": ["gap"],
        "initial": START,
    }
    with pytest.raises(vi.ParameterError, match=said):
        vi.fit(**given | change)


def test_an_overlapping_start_is_refused():
    record = vi.Record("x1", [0.0, 1.0], [0.0, 0.4])
    with pytest.raises(vi.StateError):
        vi.fit(record, PAPER, unknown=["gap"], initial=(1.5, 0, 0, 0))


def test_friction_of_direct_contact_is_no_unknown():
    record = vi.Record("x1", [0.0, 1.0], [0.0, 0.4])
    direct = PAPER.replace(contact="direct")
    with pytest.raises(vi.ParameterError, match="friction"):
        vi.fit(record, direct, unknown=["friction"], initial=START)


def test_a_bouncing_ball_is_heard():
    ball = vi.System(
        mass_ratio=0, frequency_ratio=0, restitution=0.85, gap=0, drive_frequency=0,
        moment_amplitude=1, contact="direct",
    )  # fmt: skip
    run = vi.simulate(ball, initial=(-1, 0, 0, 0), time=15)
    heard = vi.measure(run, "impact_times", noise=2e-3, seed=1)
    guess = ball.replace(restitution=0.7)
    found = vi.fit(heard, guess, unknown=["restitution", "x1", "v1"], initial=(-0.8, 0.1, 0, 0))
    assert found.verdict == "fits"
    assert np.abs(wrong_by(found, ball, (-1, 0, 0, 0))).max() < 4.0
    assert found.errors["restitution"] < 2e-3


@pytest.mark.parametrize(
    ("kind", "noise", "jitter"), [("v1", 2e-2, 0.0), ("a1", 5e-2, 0.0), ("v1", 1e-2, 1e-2)]
)
def test_expected_errors_of_what_jumps_at_impacts_are_those_of_fits(kind, noise, jitter):
    run = vi.simulate(RUBBING, initial=START, periods=12)
    names = ["restitution", "friction", "gap", "v1"]
    plan = vi.measure(run, kind, noise=noise, sampling=0.1, jitter=jitter)
    expected = vi.expected_errors(run, plan, unknown=names)
    z = []
    for seed in range(20):
        record = vi.measure(run, kind, noise=noise, sampling=0.1, jitter=jitter, seed=seed)
        found = vi.fit(record, RUBBING, unknown=names, initial=START, starts=1)
        assert found.standard_errors == pytest.approx(expected.standard_errors, rel=0.05)
        true = [*(getattr(RUBBING, name) for name in names[:3]), START[1]]
        z.append((found.estimates - true) / expected.standard_errors)
    # 1 but for chance: 80 numbers, of which those of one fit are correlated.
    assert 0.6 < np.sqrt(np.mean(np.square(z))) < 1.4


def test_displacements_beside_impacts_are_off_by_what_jitter_does_to_them():
    run = vi.simulate(RUBBING, initial=START, periods=12)
    jitter = 1e-2
    off, sigma = [], None
    for seed in range(200):
        record = vi.measure(run, "x1", sampling=0.05, jitter=jitter, seed=seed)
        exact = vi.measure(run, "x1", at=record.times).values
        off.append(record.values - exact)
        sigma = record.sigma
    away = np.abs(record.times[:, None] - np.asarray(run.impacts["time"])).min(axis=1)
    beside = away < 3 * jitter
    assert beside.sum() > 10
    found = np.sqrt(np.mean(np.square(off), axis=0))[beside] / sigma[beside]
    assert np.median(found) == pytest.approx(1.0, abs=0.15)


def test_expected_errors_are_those_of_a_fit():
    run = vi.simulate(RUBBING, initial=START, periods=20)
    names = ["restitution", "friction", "gap"]
    plan = vi.measure(run, "x1", noise=2e-3, sampling=0.1)
    expected = vi.expected_errors(run, plan, unknown=names)
    found = vi.fit(plan, RUBBING, unknown=names, initial=START)
    assert expected.standard_errors == pytest.approx(found.standard_errors, rel=0.05)
    assert expected.correlation == pytest.approx(found.correlation, abs=0.05)
    half = vi.measure(run, "x1", noise=1e-3, sampling=0.1)
    better = vi.expected_errors(run, half, unknown=names)
    assert better.standard_errors == pytest.approx(expected.standard_errors / 2)
    with pytest.raises(vi.ParameterError, match="sigma"):
        vi.expected_errors(run, vi.measure(run, "x1", sampling=0.1), unknown=names)


def test_a_long_chaotic_record_has_errors():
    # Differences of the start grow by 10^13, beyond what one derivative tells of other unknowns.
    run = vi.simulate(CHAOTIC, initial=START, periods=400)
    heard = vi.measure(run, "impact_times", noise=1e-3, seed=1)
    guess = CHAOTIC.replace(restitution=0.79)
    names = ["restitution", "friction", "start"]
    found = vi.fit(heard, guess, unknown=names, initial=START, starts=1)
    assert found.verdict == "fits", found.reasons
    assert np.abs(wrong_by(found, CHAOTIC)).max() < 4.0
    # Longer records tell more: 200 periods leave 1.3e-4.
    assert found.errors["restitution"] < 1e-4


@pytest.mark.parametrize("kind", ["x1", "v1", "a1", "x2", "impact_times"])
@pytest.mark.parametrize("sigma", [None, 1e-2, 1e-6])
def test_a_record_without_noise_fits(kind, sigma):
    # Rounding is not random: the residuals of a perfect fit have neighbours alike.
    run = vi.simulate(RUBBING, initial=START, periods=20)
    exact = vi.measure(run, kind, sampling=None if kind == "impact_times" else 0.1)
    values = None if kind == "impact_times" else exact.values
    record = vi.Record(kind, exact.times, values, sigma=sigma)
    guess = RUBBING.replace(restitution=0.7)
    found = vi.fit(record, guess, unknown=["restitution", "friction"], initial=START)
    assert found.verdict == "fits", found.reasons
    assert found.estimates == pytest.approx([RUBBING.restitution, RUBBING.friction], abs=1e-11)


def test_systematic_residuals_that_move_no_value_by_its_error_are_no_verdict():
    run = vi.simulate(RUBBING, initial=START, periods=20)
    exact = vi.measure(run, "x1", sampling=0.1)
    wave = np.sin(0.3 * exact.times)
    for size, verdict in ((0.9, "fits"), (30.0, "systematic residuals")):
        wrong = exact.values + 1e-3 * size * wave / np.sqrt(wave @ wave)
        record = vi.Record("x1", exact.times, wrong, sigma=1e-3)
        found = vi.fit(record, RUBBING, unknown=["restitution", "gap"], initial=START, starts=1)
        assert found.verdict == verdict
        if verdict == "fits":
            off = found.estimates - [RUBBING.restitution, RUBBING.gap]
            assert np.abs(off / found.standard_errors).max() < 1.0


def test_a_record_that_does_not_vary_is_told_in_words():
    run = vi.simulate(RUBBING, initial=START, periods=20)
    times = vi.measure(run, "x1", sampling=0.1).times
    still = vi.Record("x1", times, np.zeros(len(times)))
    found = vi.fit(still, RUBBING, unknown=["restitution"], initial=START, starts=1)
    assert any("x1 does not vary" in reason for reason in found.reasons)
    assert max(map(len, found.reasons)) < 200


def test_a_fit_is_saved(tmp_path):
    run = vi.simulate(RUBBING, initial=START, periods=10)
    records = [
        vi.measure(run, "impact_times", noise=1e-2),
        vi.Record("x1", [0.0, 1.0, 2.0], run.trajectory([0.0, 1.0, 2.0])[:, 0], name="laser"),
    ]
    found = vi.fit(records, RUBBING, unknown=["restitution", "gap"], initial=START)
    found.save(tmp_path / "fit.npz")
    again = vi.load(tmp_path / "fit.npz")
    assert again == found
    assert hash(again) == hash(found)
    assert again.records == found.records
    assert again.values == found.values
    assert again.summary() == found.summary()
    assert again.machine == found.machine
    assert [record.name for record in again.records] == ["impact_times", "laser"]
    for one, other in zip(again.residuals, found.residuals, strict=True):
        assert np.array_equal(one, other)
    assert np.array_equal(again.run.impacts, found.run.impacts)


def test_records_in_si():
    rig = vi.System.from_physical(
        pendulum_mass=3, oscillator_mass=5, length=0.1, torsional_stiffness=500, stiffness=50e3,
        gap=0.05, restitution=0.8, drive_frequency=180, moment_amplitude=300,
    )  # fmt: skip
    run = vi.simulate(rig, initial=START, periods=15)
    units = {"x1": 1.0, "v1": rig.scales.frequency, "x2": 0.1, "a2": rig.scales.speed / 0.01}
    names = ["restitution", "gap"]
    for kind, unit in units.items():
        plain = vi.measure(run, kind, sampling=0.1, noise=1e-3)
        in_si = vi.Record(kind, plain.times * 0.01, plain.values * unit, sigma=1e-3 * unit)
        one = vi.fit(plain, rig, unknown=names, initial=START)
        other = vi.fit(in_si, rig, unknown=names, initial=rig.scales.to_si(START), units="SI")
        assert one.estimates == pytest.approx(other.estimates, abs=1e-7)
    with pytest.raises(vi.ParameterError, match="scales"):
        vi.fit(in_si, PAPER, unknown=names, initial=START, units="SI")


def rig(drive_frequency=180.0, torsional_stiffness=500.0, restitution=0.8, stiffness=50e3):
    """A machine in SI, by its quantities."""
    return vi.System.from_physical(
        pendulum_mass=3, oscillator_mass=5, length=0.1, torsional_stiffness=torsional_stiffness,
        stiffness=stiffness, gap=0.05, restitution=restitution, drive_frequency=drive_frequency,
        moment_amplitude=300,
    )  # fmt: skip


@pytest.mark.parametrize("kind", ["x1", "impact_times"])
def test_records_in_si_with_a_function_that_makes_the_machine(kind):
    true = rig(drive_frequency=181.0, torsional_stiffness=520.0, restitution=0.75)
    run = vi.simulate(true, initial=START, periods=15)
    plain = vi.measure(run, kind, noise=1e-3, **({"sampling": 0.1} if kind == "x1" else {}))
    second = true.scales.time
    values = plain.values if kind == "x1" else None
    sigma = 1e-3 if kind == "x1" else 1e-3 * second
    in_si = vi.Record(kind, plain.times * second, values, sigma=sigma)
    names = {"drive_frequency": None, "torsional_stiffness": (400, 600), "restitution": (0.6, 0.9)}
    start = true.scales.to_si(START)
    found = vi.fit(in_si, rig, unknown=names, initial=start, units="SI", starts=15)
    assert found.verdict == "fits"
    for name, value in (("drive_frequency", 181.0), ("torsional_stiffness", 520.0)):
        assert abs(found.values[name] - value) < 4 * found.errors[name]
        assert found.errors[name] < 0.01 * value
    # The same in dimensionless numbers.
    other = vi.fit(plain, true, unknown=["drive_frequency", "restitution"], initial=START)
    assert other.verdict == "fits"
    for name, unit in (("drive_frequency", second), ("restitution", 1.0)):
        apart = found.values[name] * unit - other.values[name]
        assert abs(apart) < 4 * found.errors[name] * unit
    # 1/omega_2 is the unit of time.
    with pytest.raises(vi.ParameterError, match="units of length and time, as stiffness does"):
        vi.fit(in_si, rig, unknown=["stiffness"], initial=start, units="SI")


def test_machines_are_drawn_from_the_estimate():
    run = vi.simulate(RUBBING, initial=START, periods=10)
    record = vi.measure(run, "x1", noise=2e-2, sampling=0.3)
    found = vi.fit(record, RUBBING, unknown=["restitution", "gap", "v1"], initial=START)
    drawn = np.array([(each.restitution, each.gap) for each in found.sample(4000, seed=1)])
    assert drawn.mean(axis=0) == pytest.approx(found.estimates[:2], abs=1e-3)
    assert np.cov(drawn.T) == pytest.approx(found.covariance[:2, :2], rel=0.15, abs=1e-9)


def test_a_record_that_says_nothing_of_the_unknown_does_not_judge_the_model():
    record = vi.Record("x1", [0.0, 1.0], [0.0, 0.1])  # before the first impact
    found = vi.fit(record, PAPER, unknown=["restitution"], initial=(0, 0.5, 0, 0))
    assert np.isinf(found.errors["restitution"])
    assert found.verdict == "not identifiable"


def test_as_many_rows_as_unknowns_tell_no_errors():
    run = vi.simulate(PAPER, initial=START, periods=5)
    record = vi.Record("impact_times", run.impacts["time"][:2])
    guess = PAPER.replace(gap=0.49, restitution=0.79)
    found = vi.fit(record, guess, unknown=["gap", "restitution"], initial=START)
    assert found.verdict == "not identifiable"
    assert list(found.errors.values()) == [np.inf, np.inf]
    assert "nothing tells their errors" in found.summary()

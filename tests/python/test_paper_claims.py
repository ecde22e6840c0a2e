"""The paper's parameters, the reference beside them, and how a verdict comes about."""

import dataclasses
import json
from collections import Counter

import numpy as np
import pytest

import vibroimpact as vi
from references import reference, scene_initial, scene_system
from vibroimpact.paper import INITIAL, KEEP, MOTIONS, PERIODS, claims, evidence
from vibroimpact.paper.evidence import Coexistence

BY_ID = {motion.id: motion for motion in MOTIONS}
SCENES = reference("paper_scenes.json")


def scene(motion):
    """The reference scene of a motion: 9(3) is fig9_3 there."""
    return SCENES["fig" + motion.id.replace("(", "_").replace(")", "")]


def simulated(motion, periods=PERIODS) -> vi.Run:
    return vi.simulate(motion.system, initial=INITIAL, periods=periods, keep=min(periods, KEEP))


def test_every_scene_is_a_motion():
    assert len(MOTIONS) == len(BY_ID) == len(SCENES)
    assert set(claims.references()) == set(BY_ID)


@pytest.mark.parametrize("motion", MOTIONS, ids=lambda motion: motion.id)
def test_parameters_are_those_of_the_reference(motion):
    assert motion.system == scene_system(scene(motion))
    assert list(INITIAL) == scene_initial(scene(motion))


@pytest.mark.parametrize("motion", MOTIONS, ids=lambda motion: motion.id)
def test_packaged_reference_is_that_of_the_test_data(motion):
    packaged, original = claims.references()[motion.id], scene(motion)
    assert packaged["impacts"] == original["impacts_in_600_periods"]
    assert packaged["impacts_last_100"] == original["impacts_in_last_100_periods"]
    assert packaged["state"] == original["state_after_600_periods"]


@pytest.mark.parametrize("name", ["5a", "5b", "5c", "6a", "6b", "6c", "9(1)"])
def test_periodic_motions_are_reproduced(name):
    motion = BY_ID[name]
    run = simulated(motion)
    claim = claims.evaluate(motion, run)
    assert claim.verdict == "reproduced"
    assert claim.found == run.label == motion.paper_says == claim.reference["label"]
    assert claim.residual == run.period.residual
    assert claim.source.startswith("Han, Jin & Hu (2004), caption of Fig. " + name[0])
    assert f"{run.impact_count} impacts in 600 periods" in claim.evidence


def test_a_chaotic_motion_needs_label_and_growth():
    motion = BY_ID["9(2)"]
    claim = claims.evaluate(motion, simulated(motion))
    assert (claim.found, claim.verdict) == ("chaotic", "reproduced")
    assert evidence.amplification(motion.system, periods=PERIODS).max() > 1e6


def test_a_bounded_perturbation_refutes_chaos():
    motion = BY_ID["9(4)"]
    claim = claims.evaluate(motion, simulated(motion))
    assert claim.verdict == "refuted"
    growth = evidence.amplification(motion.system, periods=PERIODS)
    expected = scene(motion)["amplification"]
    assert growth[: len(expected)] == pytest.approx(expected, rel=0.02)
    assert f"at most {growth.max():.2g}-fold" in claim.evidence


def test_a_motion_that_settles_slowly_has_its_label_from_600_periods_on():
    # What README and erratum E10 say of Fig. 9(4).
    motion = BY_ID["9(4)"]
    run = simulated(motion)
    long_run = vi.simulate(motion.system, initial=INITIAL, periods=20000, keep=2000)
    assert run.label == long_run.label == "154-77"
    assert run.period.residual == pytest.approx(1.07e-3, rel=0.01)
    assert long_run.period.residual < 1e-12
    refined = long_run.refine()
    assert refined.stable
    assert refined.multipliers[0] == pytest.approx(-0.745, abs=1e-3)
    claim = claims.evaluate(motion, run, long_run=long_run)
    assert (claim.found, claim.verdict) == ("154-77", "refuted")
    assert f"after 20000 periods the motion is {long_run.label}" in claim.evidence


def test_amplification_of_an_unstable_label_is_open(monkeypatch):
    motion = BY_ID["9(4)"]
    monkeypatch.setattr(evidence, "amplification", lambda *_, **__: np.array([1e3, 1e4]))
    assert claims.evaluate(motion, simulated(motion)).verdict == "open"


def test_another_start_corrects_a_label():
    motion = BY_ID["9(3)"]
    run = simulated(motion)
    other = evidence.coexisting(motion.system, "4-5", starts=evidence.random_starts(3))
    assert other.run is not None
    assert other.run.label == "4-5"
    assert other.labels.total() == 3
    claim = claims.evaluate(motion, run, coexistence=other)
    assert (claim.found, claim.verdict) == ("6-7", "corrected")
    assert f"{other.labels['4-5']} of 3 random starts" in claim.evidence


def test_without_a_start_that_reaches_it_a_label_stays_open():
    motion = BY_ID["9(3)"]
    run = simulated(motion)
    nowhere = Coexistence("4-5", Counter({"6-7": 3}), None)
    assert claims.evaluate(motion, run, coexistence=nowhere).verdict == "open"
    assert claims.evaluate(motion, run).verdict == "open"


def test_impacts_that_go_on_refute_that_they_stop():
    motion = BY_ID["10"]
    long_run = vi.simulate(motion.system, initial=INITIAL, periods=max(evidence.HORIZONS))
    claim = claims.evaluate(motion, simulated(motion), long_run=long_run)
    assert claim.verdict == "refuted"
    counts = evidence.impacts_by(long_run)
    assert counts[600] == scene(motion)["impacts_in_600_periods"]
    # Later counts depend on rounding; that contacts go on to the end does not.
    assert evidence.longest_wait(long_run) <= evidence.recurrence(motion.system) == 149
    assert f"9 by 600, {counts[2000]} by 2000" in claim.evidence


def test_impacts_that_stop_are_reproduced():
    motion = BY_ID["10"]
    silent = vi.simulate(motion.system.replace(gap=5.0), initial=INITIAL, periods=1000)
    claim = claims.evaluate(motion, simulated(motion), long_run=silent)
    assert claim.verdict == "reproduced"
    assert evidence.longest_wait(silent) == 0.0


def test_a_pause_without_a_recurrence_is_open(monkeypatch):
    motion = BY_ID["10"]
    short = vi.simulate(motion.system, initial=INITIAL, periods=3000)
    assert len(set(evidence.impacts_by(short).values())) > 1
    run = simulated(motion)
    assert claims.evaluate(motion, run, long_run=short).verdict == "refuted"
    monkeypatch.setattr(evidence, "recurrence", lambda _: None)
    assert claims.evaluate(motion, run, long_run=short).verdict == "open"


@pytest.mark.parametrize(
    ("changes", "expected"),
    [
        ({}, 149),
        ({"drive_frequency": 1.0}, 1),
        ({"drive_frequency": 1.0, "frequency_ratio": 2.5}, 2),
        ({"drive_frequency": 0.75, "frequency_ratio": 1.5}, 3),
        ({"frequency_ratio": 2**0.5}, None),
        ({"drive_frequency": 2.98001}, None),
        ({"drive_frequency": 0.0}, None),
        ({"damping": (0.0, 0.1)}, None),
    ],
)
def test_recurrence_is_that_of_the_free_motion(changes, expected):
    assert evidence.recurrence(BY_ID["10"].system.replace(**changes)) == expected


def test_the_longest_wait_counts_the_end_of_the_run():
    system = BY_ID["10"].system
    run = vi.simulate(system, initial=INITIAL, periods=300)
    periods = run.impacts["time"] / system.drive_period
    expected = max(*np.diff(periods), 300 - periods[-1])
    assert evidence.longest_wait(run) == pytest.approx(expected)


def test_random_starts_are_the_same_each_time_and_lie_in_the_box():
    starts = evidence.random_starts(200)
    assert np.array_equal(starts, evidence.random_starts(200))
    assert (np.abs(starts) <= evidence.START_BOX).all()
    assert (np.abs(starts).max(axis=0) > 0.9 * np.array(evidence.START_BOX)).all()


def test_files_hold_every_field():
    motion = BY_ID["9(1)"]
    claim = claims.evaluate(motion, simulated(motion))
    (stored,) = json.loads(claims.to_json([claim]))
    assert stored == dataclasses.asdict(claim)
    assert list(stored) == [
        "id",
        "figure",
        "source",
        "paper_says",
        "found",
        "residual",
        "reference",
        "verdict",
        "evidence",
        "command",
    ]
    text = claims.to_markdown([claim])
    assert f"| Fig. 9(1) | 1-3 | 1-3 | {claim.residual:.1e} | 1-3 | reproduced |" in text
    assert claim.command in text


def test_no_residual_is_null():
    motion = BY_ID["9(1)"]
    claim = dataclasses.replace(claims.evaluate(motion, simulated(motion)), residual=None)
    (stored,) = json.loads(claims.to_json([claim]))
    assert stored["residual"] is None
    assert claims.table([claim]).splitlines()[-1].split() == [
        "9(1)",
        "1-3",
        "1-3",
        "-",
        "reproduced",
    ]
